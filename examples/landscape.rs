//! Maps the landscape of cubic shortcuts, and finds the best point of the map at each duration.
//!
//! `cargo run --release --example landscape`

use std::error::Error;
use std::path::Path;

use arrow_array::cast::AsArray;
use arrow_array::types::Float64Type;
use arrow_array::{Float64Array, RecordBatch};
use slipsweep::sweep::Sweep;

const SPEC: &str = r#"
name = "landscape"
[axes]
t_f = [0.02, 0.037, 0.049]
a = 0.03
b = 0.05
v_i = 3.0
v_f = 100.0
alpha_2 = { linspace = [-0.5, 0.5, 101], unit = "1/t_f" }
alpha_3 = { linspace = [-0.5, 0.5, 101], unit = "1/t_f^2" }
[tables.gap]
columns = ["gap"]
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let sweep = Sweep::parse(SPEC, Path::new("."))?;
    // (t_f, alpha_2, alpha_3, gap) of the least gap so far at each duration.
    let mut best: Vec<[f64; 4]> = Vec::new();
    for batch in sweep.batches("gap").ok_or("the sweep has no such table")? {
        let batch = batch?;
        let [t_f, alpha_2, alpha_3, gap] = ["t_f", "alpha_2", "alpha_3", "gap"].map(|name| column(&batch, name));
        let status =
            batch.column_by_name("status").ok_or("no status")?.as_dictionary::<arrow_array::types::Int32Type>();
        let words = status.values().as_string::<i32>();
        for row in 0..batch.num_rows() {
            if status.key(row).is_none_or(|key| words.value(key) != "ok") {
                continue;
            }
            let point = [&t_f, &alpha_2, &alpha_3, &gap].map(|column| column.value(row));
            match best.iter_mut().find(|known| known[0] == point[0]) {
                Some(known) if point[3] < known[3] => *known = point,
                Some(_) => {}
                None => best.push(point),
            }
        }
    }
    for [t_f, alpha_2, alpha_3, gap] in best {
        println!("landscape: t_f={t_f} alpha_2={alpha_2:.2} alpha_3={alpha_3:.2} gap={gap:.3e}");
    }
    Ok(())
}

/// A column of numbers.
fn column(batch: &RecordBatch, name: &str) -> Float64Array {
    batch
        .column_by_name(name)
        .map_or_else(|| Float64Array::new_null(0), |column| column.as_primitive::<Float64Type>().clone())
}
