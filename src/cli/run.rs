//! `slipsweep run SPEC`.
use super::*;
use crate::dataset::Folder;
use crate::sweep::{self, Sweep};

/// Arguments of `run`.
#[derive(Debug, clap::Args)]
pub struct RunArguments {
    spec: PathBuf,
    #[arg(long, value_name = "DIR", default_value = "results")]
    out: PathBuf,
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
}

pub fn run(arguments: &RunArguments) -> ExitCode {
    let sweep = match Sweep::load(&arguments.spec) {
        Ok(s) => s,
        Err(e) => {
            eprintln!("error: {e}");
            return WRONG.into();
        }
    };
    let folder = Folder::new(&arguments.out, &sweep.name);
    let start = std::time::Instant::now();
    match sweep::run(&sweep, &folder, arguments.threads, &Default::default()) {
        Ok(o) => {
            println!("{o:?} {:?}", start.elapsed());
            ExitCode::SUCCESS
        }
        Err(e) => {
            eprintln!("error: {e}");
            FAILED.into()
        }
    }
}
