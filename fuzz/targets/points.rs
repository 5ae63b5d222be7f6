//! Any bytes as a CSV file of points: refused with a message, or points.
#![no_main]

use std::fs;
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
        folder
    });
    fs::write(folder.join("points.csv"), bytes).expect("TMPDIR is writable");
    for axes in AXES {
        let text = format!("name = \"points\"\npoints = \"points.csv\"\n{axes}[tables.optimal]\n");
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
