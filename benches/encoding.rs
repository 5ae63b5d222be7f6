//! Encodings and compressions of the columns of a landscape: nanoseconds and bytes per row, one column alone.
//!
//! `cargo bench --bench encoding`. The column is the paper's landscape at t_f = 0.02, 0.037 and 0.049; the least time
//! of five.

use std::sync::Arc;
use std::time::Instant;

use arrow_array::{ArrayRef, Float64Array, RecordBatch};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::file::properties::WriterProperties;
use slipsweep::model::{Law, Transition};
use slipsweep::protocol::Status;
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::optimal;

const POINTS: usize = 401;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Outcome<()> {
    let zstd = |level| ZstdLevel::try_new(level).map(Compression::ZSTD);
    let ways = [
        ("plain", Some(Encoding::PLAIN), Compression::UNCOMPRESSED),
        ("plain, zstd 1", Some(Encoding::PLAIN), zstd(1)?),
        ("plain, zstd 3", Some(Encoding::PLAIN), zstd(3)?),
        ("byte stream split", Some(Encoding::BYTE_STREAM_SPLIT), Compression::UNCOMPRESSED),
        ("byte stream split, zstd 1", Some(Encoding::BYTE_STREAM_SPLIT), zstd(1)?),
        ("byte stream split, zstd 3", Some(Encoding::BYTE_STREAM_SPLIT), zstd(3)?),
        ("dictionary, zstd 1", None, zstd(1)?),
    ];
    let columns = columns();
    println!("{:<26} {:>16} {:>16} {:>16}", "ns, bytes per row", "work", "gap", "v_min");
    for (name, encoding, compression) in ways {
        let mut line = format!("{name:<26}");
        for column in &columns {
            let (time, bytes) = measure(column, encoding, compression)?;
            line.push_str(&format!(" {time:>8.1} {bytes:>7.2}"));
        }
        println!("{line}");
    }
    Ok(())
}

/// `work`, `gap` and `v_min`, null where infeasible.
fn columns() -> [ArrayRef; 3] {
    let transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.0, v_f: 100.0 };
    let axis: Vec<f64> = (0..POINTS).map(|i| -0.5 + i as f64 / (POINTS - 1) as f64).collect();
    let mut cells: [Vec<Option<f64>>; 3] = Default::default();
    for t_f in [0.02, 0.037, 0.049] {
        let landscape = Landscape::new(&transition, t_f, 1e-10);
        let optimum = optimal::solve(&transition, t_f, true, 1e-10).value.map_or(f64::NAN, |optimum| optimum.work);
        for &a_2 in &axis {
            let (mut work, mut v_min) = ([0.0; POINTS], [0.0; POINTS]);
            let mut status = [Status::Infeasible; POINTS];
            let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
            landscape.evaluate(&[a_2; POINTS], &axis, out);
            for i in 0..POINTS {
                let feasible = status[i] != Status::Infeasible;
                for (cells, value) in cells.iter_mut().zip([work[i], (work[i] - optimum) / optimum, v_min[i]]) {
                    cells.push(feasible.then_some(value));
                }
            }
        }
    }
    cells.map(|cells| Arc::new(Float64Array::from(cells)) as ArrayRef)
}

/// Nanoseconds and bytes per row.
fn measure(column: &ArrayRef, encoding: Option<Encoding>, compression: Compression) -> Outcome<(f64, f64)> {
    let batch = RecordBatch::try_from_iter([("column", column.clone())])?;
    let rows = batch.num_rows() as f64;
    let (mut least, mut bytes) = (f64::INFINITY, 0);
    for _ in 0..5 {
        let start = Instant::now();
        let mut properties =
            WriterProperties::builder().set_compression(compression).set_dictionary_enabled(encoding.is_none());
        if let Some(encoding) = encoding {
            properties = properties.set_encoding(encoding);
        }
        let mut writer = ArrowWriter::try_new(Vec::new(), batch.schema(), Some(properties.build()))?;
        writer.write(&batch)?;
        bytes = writer.into_inner()?.len();
        least = least.min(start.elapsed().as_secs_f64());
    }
    Ok((1e9 * least / rows, bytes as f64 / rows))
}
