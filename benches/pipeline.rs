//! The pipeline against its own computation: how much encoding and writing add, and what a second thread brings.
//!
//! `cargo bench --bench pipeline` computes the landscape of sixty durations (9.6 million rows) into memory on one and
//! on two threads, then in turn with the same encoded into memory and with runs that write Parquet to disk, each several
//! times, and prints the least time of each and their ratios. The floor of a run is the larger of computing and encoding
//! where the two overlap, and their sum on a machine of one processor (`taskset -c 0`). Two runs side by side that share nothing show the gain of a second thread. Then,
//! on other runs: rows per second against `rtol`, with what encoding and the disk add to the computation (a run whose
//! files stay in memory distinguishes them, where there is `/dev/shm`); what `ArrowWriter` would cost; the memory of ever longer
//! runs; and what the columns of some tables cost.

use std::hint::black_box;
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::schema::types::ColumnPath;
use slipsweep::dataset::{self, Folder, Footer, Layout};
use slipsweep::grid::RowIndex;
use slipsweep::sweep::{self, Plan, Sweep};
use slipsweep::table::{self, ColumnBuffer, Signal};

/// As in the program.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Durations of the landscapes of the first part, and of those at several accuracies.
const MANY: usize = 60;
const FEW: usize = 10;

/// Durations of ever longer runs.
const LENGTHS: [usize; 4] = [5, 20, 80, 320];

const RTOLS: [f64; 6] = [1e-3, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13];

/// A folder whose files stay in memory.
const IN_MEMORY: &str = "/dev/shm";

/// Tables whose columns are measured, each with axes.
const TABLES: [(&str, &str); 6] = [
    (
        "gap",
        "t_f = 0.02\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\nalpha_2 = { linspace = [-0.5, 0.5, 401], unit = \"1/t_f\" }\n\
             alpha_3 = { linspace = [-0.5, 0.5, 401], unit = \"1/t_f^2\" }\n",
    ),
    ("optimal", "t_f = { linspace = [0.02, 0.5, 4000] }\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n"),
    ("crossover", "a = 0.03\nb = 0.05\nv_i = 3.0\nv_f = { geomspace = [10.0, 1e4, 4000] }\n"),
    (
        "shortcut",
        "t_f = { linspace = [0.02, 0.5, 50] }\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\ntau_ceiling = 1.6\n\
               family = [\"step\", \"cubic\", \"bounded_velocity\", \"bounded_friction\"]\n",
    ),
    (
        "stability",
        "a = 0.005\nb = 0.01\nv_i = 1e5\nm = 2.5e-16\nv_f = { geomspace = [1e5, 1e7, 200] }\n\
                   k = { geomspace = [1e-3, 1e-1, 200] }\n",
    ),
    (
        "step_response",
        "a = 0.005\nb = 0.01\nv_i = 1e5\nm = 2.5e-16\nv_f = { geomspace = [2e5, 1e7, 8] }\n\
              k = { geomspace = [1e-3, 1e-1, 8] }\n",
    ),
];

const ROUNDS: usize = 15;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// A part of the measurement.
type Part = fn(&Path) -> Outcome<()>;

fn main() -> Outcome<()> {
    let folder = std::env::temp_dir().join(format!("slipsweep-pipeline-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let done = measure(&folder);
    std::fs::remove_dir_all(&folder)?;
    done
}

fn measure(folder: &Path) -> Outcome<()> {
    let parts: [(&str, Part); 5] =
        [("threads", threads), ("writers", writers), ("accuracy", accuracy), ("memory", memory), ("columns", columns)];
    // `-- writers` is for that part alone; cargo adds `--bench`.
    let wanted: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|word| word == name);
    parts.into_iter().filter(|(name, _)| is_wanted(name)).try_for_each(|(_, part)| part(folder))
}

/// A sweep with these axes, these lines under `[accuracy]` and this under `[tables]`.
fn sweep(folder: &Path, axes: &str, rtol: f64, tables: &str) -> Outcome<Sweep> {
    let path = folder.join("spec.toml");
    std::fs::write(
        &path,
        format!("name = \"pipeline\"\n[accuracy]\nrtol = {rtol:e}\n[axes]\n{axes}[tables]\n{tables}\n"),
    )?;
    Ok(Sweep::load(&path)?)
}

/// The paper's landscapes at so many durations.
fn landscapes(folder: &Path, durations: usize, rtol: f64) -> Outcome<Sweep> {
    let axes = format!(
        "t_f = {{ linspace = [0.02, 0.049, {durations}] }}\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n\
         alpha_2 = {{ linspace = [-0.5, 0.5, 401], unit = \"1/t_f\" }}\n\
         alpha_3 = {{ linspace = [-0.5, 0.5, 401], unit = \"1/t_f^2\" }}\n"
    );
    sweep(folder, &axes, rtol, "gap = {}")
}

/// What encoding and writing add, and what a second thread brings.
fn threads(folder: &Path) -> Outcome<()> {
    let sweep = landscapes(folder, MANY, 1e-10)?;
    let rows = Plan::new(&sweep).tables[0].rows as f64;
    // Nothing is written before these are done: the system writes files back long after the run.
    let alone = least(ROUNDS, || Ok([compute(&sweep, 1)?, compute(&sweep, 2)?, side_by_side(&sweep)?]))?;
    let [one, two, encoded, one_on_disk, two_on_disk] = least(ROUNDS, || {
        let (computed, encoded) = (compute(&sweep, 1)?, encode(&sweep, ours)?);
        let written = [pipeline(&sweep, folder, 1)?, pipeline(&sweep, folder, 2)?];
        Ok([computed, compute(&sweep, 2)?, encoded, written[0], written[1]])
    })?;
    println!("### Threads\n\n| | ns per row | million rows per second |\n| --- | --- | --- |");
    for (name, seconds) in [
        ("compute alone, 1 thread", alone[0]),
        ("compute alone, 2 threads", alone[1]),
        ("compute, 1 thread", one),
        ("compute, 2 threads", two),
        ("encode into memory, 1 thread", encoded),
        ("pipeline, 1 thread", one_on_disk),
        ("pipeline, 2 threads", two_on_disk),
    ] {
        println!("| {name} | {:.1} | {:.2} |", seconds / rows * 1e9, rows / seconds / 1e6);
    }
    println!("| two threads over one, compute alone | {:.2} | |", alone[0] / alone[1]);
    println!("| two runs side by side over one, compute alone | {:.2} | |", 2.0 * alone[0] / alone[2]);
    println!("| pipeline over the larger of compute and encode, 1 thread | {:.2} | |", one_on_disk / one.max(encoded));
    println!("| pipeline over the sum of compute and encode, 1 thread | {:.2} | |", one_on_disk / (one + encoded));
    println!("| pipeline over compute, 2 threads | {:.2} | |", two_on_disk / two);
    Ok(())
}

/// Rows a second against the accuracy requested. Writing has threads of its own, so what it adds is not what it takes.
fn accuracy(folder: &Path) -> Outcome<()> {
    let in_memory = Path::new(IN_MEMORY);
    let in_memory = in_memory.is_dir().then(|| in_memory.join(format!("slipsweep-pipeline-{}", std::process::id())));
    println!("\n### Accuracy\n");
    println!(
        "| rtol | million rows per second, 1 thread | 2 threads | computing, ns per row | encoding adds | the disk adds |"
    );
    println!("| --- | --- | --- | --- | --- | --- |");
    for rtol in RTOLS {
        let sweep = landscapes(folder, FEW, rtol)?;
        let rows = Plan::new(&sweep).tables[0].rows as f64;
        let [computed, encoded, one, two] = least(5, || {
            let encoded = in_memory.as_ref().map_or(Ok(f64::NAN), |folder| pipeline(&sweep, folder, 1))?;
            Ok([compute(&sweep, 1)?, encoded, pipeline(&sweep, folder, 1)?, pipeline(&sweep, folder, 2)?])
        })?;
        let ns = |seconds: f64| 1e9 * seconds / rows;
        let added = |seconds: f64| if seconds.is_finite() { format!("{:.1}", ns(seconds)) } else { "-".into() };
        println!(
            "| {rtol:e} | {:.2} | {:.2} | {:.1} | {} | {} |",
            1e-6 * rows / one,
            1e-6 * rows / two,
            ns(computed),
            added(encoded - computed),
            added(one - encoded)
        );
    }
    if let Some(folder) = in_memory.filter(|folder| folder.exists()) {
        std::fs::remove_dir_all(folder)?;
    }
    Ok(())
}

/// The greatest memory so far of ever longer runs: it does not grow with the rows.
fn memory(folder: &Path) -> Outcome<()> {
    println!("\n### Memory\n\n| rows | greatest resident memory so far, MiB |\n| --- | --- |");
    for durations in LENGTHS {
        let sweep = landscapes(folder, durations, 1e-3)?;
        pipeline(&sweep, folder, 2)?;
        println!("| {} | {} |", Plan::new(&sweep).tables[0].rows, peak().map_or("-".into(), |mib| format!("{mib:.0}")));
    }
    Ok(())
}

/// The greatest resident memory of this process so far, in MiB, where the system reports it.
fn peak() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()? / 1024.0)
}

/// Computation of some tables with all columns that are not optional, and with each column alone, on one thread.
fn columns(folder: &Path) -> Outcome<()> {
    println!("\n### Columns\n\n| table | columns | ns per row |\n| --- | --- | --- |");
    for (name, axes) in TABLES {
        let table = table::find(name).ok_or("no such table")?;
        let time = |request: &str| {
            let sweep = sweep(folder, axes, 1e-10, request)?;
            let rows = Plan::new(&sweep).tables[0].rows as f64;
            let [seconds] = least(5, || Ok([compute(&sweep, 1)?]))?;
            Ok::<f64, Box<dyn std::error::Error>>(1e9 * seconds / rows)
        };
        println!("| `{name}` | all that are not optional | {:.0} |", time(&format!("{name} = {{}}"))?);
        for column in table.columns() {
            let optional = if column.optional { ", optional" } else { "" };
            let ns = time(&format!("{name} = {{ columns = [\"{}\"] }}", column.name))?;
            println!("| | `{}`{optional} | {ns:.0} |", column.name);
        }
    }
    Ok(())
}

/// The least of each of several times, measured in turn.
fn least<const N: usize>(rounds: usize, measure: impl Fn() -> Outcome<[f64; N]>) -> Outcome<[f64; N]> {
    let mut least = [f64::INFINITY; N];
    for _ in 0..rounds {
        for (least, seconds) in least.iter_mut().zip(measure()?) {
            *least = least.min(seconds);
        }
    }
    Ok(least)
}

/// Seconds to compute every part and throw it away.
fn compute(sweep: &Sweep, threads: usize) -> Outcome<f64> {
    let pool = sweep::pool(threads)?;
    let plan = Plan::new(sweep);
    let optima = sweep.optimum_cache();
    let signal = Signal::default();
    let request = &sweep.requests[0];
    let job = sweep.job(request, &optima[0], &signal);
    let start = Instant::now();
    sweep::compute(&pool, request.table, &job, &plan.tables[0], 0..plan.tables[0].parts, |_, _| {})?;
    Ok(start.elapsed().as_secs_f64())
}

/// The bytes of a part.
type Encoder = fn(&Layout, &RowIndex, &ColumnBuffer, &Footer) -> Option<Vec<u8>>;

/// The encoder of the program: with the statistics and the checksums of the part and of its pages.
fn ours(layout: &Layout, row_index: &RowIndex, buffer: &ColumnBuffer, footer: &Footer) -> Option<Vec<u8>> {
    dataset::encode(layout, row_index, buffer, footer).ok().map(|(bytes, _)| bytes)
}

/// `ArrowWriter` with the encodings and the compression of the program: no statistics of ours, and no checksums, which it cannot write.
fn arrow(layout: &Layout, row_index: &RowIndex, buffer: &ColumnBuffer, footer: &Footer) -> Option<Vec<u8>> {
    let batch = dataset::batch(layout, row_index, footer.rows.clone(), buffer.clone()).ok()?;
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(1).ok()?))
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true)
        .set_max_row_group_row_count(Some(1 << 16));
    // Axes and columns that repeat are dictionaries; of the others every number differs.
    for name in ["work", "gap", "v_min"] {
        let column = ColumnPath::from(name);
        properties = properties.set_column_dictionary_enabled(column.clone(), false);
        properties = properties.set_column_encoding(column, Encoding::BYTE_STREAM_SPLIT);
    }
    let mut writer = ArrowWriter::try_new(Vec::new(), batch.schema(), Some(properties.build())).ok()?;
    writer.write(&batch).ok()?;
    writer.into_inner().ok()
}

/// What `ArrowWriter` would cost.
fn writers(folder: &Path) -> Outcome<()> {
    let sweep = landscapes(folder, FEW, 1e-10)?;
    let rows = Plan::new(&sweep).tables[0].rows as f64;
    let [computed, ours, arrow] =
        least(5, || Ok([compute(&sweep, 1)?, encode(&sweep, ours)?, encode(&sweep, arrow)?]))?;
    println!("\n### Writers\n\n| | ns per row |\n| --- | --- |");
    println!("| compute, 1 thread | {:.1} |", 1e9 * computed / rows);
    println!("| encode by the program, statistics and checksums included | {:.1} |", 1e9 * ours / rows);
    println!("| encode by `ArrowWriter`, without them | {:.1} |", 1e9 * arrow / rows);
    println!("| compute and encode, `ArrowWriter` over the program | {:.2} |", (computed + arrow) / (computed + ours));
    Ok(())
}

/// Seconds that encoding takes of every part, on the thread that has just computed it.
fn encode(sweep: &Sweep, encoder: Encoder) -> Outcome<f64> {
    let pool = sweep::pool(1)?;
    let plan = Plan::new(sweep);
    let manifest = plan.manifest(sweep);
    let optima = sweep.optimum_cache();
    let signal = Signal::default();
    let (request, table) = (&sweep.requests[0], &plan.tables[0]);
    let job = sweep.job(request, &optima[0], &signal);
    let layout = Layout::new(request.table, &request.projection, &sweep.grid);
    let spent = Mutex::new(Duration::ZERO);
    sweep::compute(&pool, request.table, &job, table, 0..table.parts, |number, buffer| {
        let Ok(buffer) = buffer else { return };
        let start = Instant::now();
        let footer = Footer::new(&manifest, &table.name, table.rows_of(number));
        black_box(encoder(&layout, job.rows, buffer, &footer));
        if let Ok(mut spent) = spent.lock() {
            *spent += start.elapsed();
        }
    })?;
    Ok(spent.into_inner().unwrap_or_default().as_secs_f64())
}

/// Seconds to compute every part twice, by two pools of one thread each at the same time.
fn side_by_side(sweep: &Sweep) -> Outcome<f64> {
    let start = Instant::now();
    std::thread::scope(|scope| {
        let other = scope.spawn(|| compute(sweep, 1).is_ok());
        compute(sweep, 1)?;
        if other.join().unwrap_or(false) { Ok(()) } else { Err("the other run failed".into()) }
    })
    .map(|()| start.elapsed().as_secs_f64())
}

/// Seconds to run the sweep with its parts on disk.
fn pipeline(sweep: &Sweep, folder: &Path, threads: usize) -> Outcome<f64> {
    let out = folder.join("out");
    let start = Instant::now();
    sweep::run(sweep, &Folder::new(&out, &sweep.name), threads, &Signal::default())?;
    let seconds = start.elapsed().as_secs_f64();
    std::fs::remove_dir_all(&out)?;
    Ok(seconds)
}
