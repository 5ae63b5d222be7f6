//! Any bytes as a file of points, Parquet where they begin like it and CSV otherwise: refused with a message, or points.
#![no_main]

use std::fs;
use std::panic;
use std::path::PathBuf;
use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use slipsweep::sweep::Sweep;

/// Columns that the file does not have make the spec wrong, which is another way out and as good.
const AXES: [&str; 2] = ["", "[axes]\nt_f = 0.1\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n"];

fuzz_target!(|bytes: &[u8]| {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = std::env::temp_dir().join(format!("points-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("TMPDIR is writable");
        // A panic ends the process, but for those of the library that reads Parquet, which become a fault.
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            let file = panic.location().map_or("", |location| location.file());
            if !["/parquet-", "/arrow-"].iter().any(|library| file.contains(library)) {
                usual(panic);
            }
        }));
        folder
    });
    let name = if bytes.starts_with(b"PAR1") { "points.parquet" } else { "points.csv" };
    fs::write(folder.join(name), bytes).expect("TMPDIR is writable");
    for axes in AXES {
        let text = format!("name = \"points\"\npoints = \"{name}\"\n{axes}[tables.optimal]\n");
        match Sweep::parse(&text, folder) {
            Ok(sweep) => {
                for row in 0..sweep.requests[0].rows {
                    sweep.requests[0].row_index.point(row);
                }
            }
            Err(error) => assert!(error.to_string().len() < 4096),
        }
    }
});
