//! `slipsweep init NAME`: a commented spec to start from, that runs as it is.

use std::io;
use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::{FAILED, Failure, say, to_file, wrong};
use crate::file;
use crate::sweep::{check_name, schema};

/// Arguments of `init`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  slipsweep init granite
  slipsweep run granite.toml

  slipsweep init granite-spring --question stick-slip")]
pub struct Arguments {
    /// Name of the dataset; the spec is written to NAME.toml
    name: PathBuf,
    /// What to ask
    #[arg(long, value_enum, default_value_t = Question::Landscape)]
    question: Question,
}

/// A question with a spec that answers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Question {
    /// How close do cubic shortcuts come to the protocol of least work?
    Landscape,
    /// From which duration on does the best protocol slow down first, and wait?
    Crossover,
    /// Which shortcut costs least for which duration, under a bound on friction?
    Families,
    /// On which spring does sliding end in stick-slip?
    StickSlip,
}

impl Question {
    /// The spec, in which NAME stands for the name.
    fn spec(self) -> &'static str {
        match self {
            Question::Landscape => include_str!("init/landscape.toml"),
            Question::Crossover => include_str!("init/crossover.toml"),
            Question::Families => include_str!("init/families.toml"),
            Question::StickSlip => include_str!("init/stick_slip.toml"),
        }
    }
}

/// The file with which editors complete and check specs, beside them.
const SCHEMA: &str = "slipsweep.schema.json";

/// Writes a spec, and the schema beside it.
pub fn init(arguments: &Arguments) -> Result<(), Failure> {
    let given = arguments.name.display();
    let bare = match arguments.name.extension() {
        Some(ending) if ending == "toml" => arguments.name.with_extension(""),
        _ => arguments.name.clone(),
    };
    let name = bare.file_name().unwrap_or_default().to_string_lossy();
    let folder = bare.parent().unwrap_or(Path::new(""));
    check_name(&name).map_err(|error| {
        wrong(format!("`{given}`: {}\n  expected: {}\n  help: {}", error.found, error.expected, error.help))
    })?;
    if !(folder.as_os_str().is_empty() || folder.is_dir()) {
        let folder = folder.display();
        return Err(wrong(format!(
            "`{given}`: there is no folder `{folder}`\n  expected: a name such as {name}, or one in a folder that is there\n  \
             help: slipsweep init {name}"
        )));
    }
    let text = format!("#:schema ./{SCHEMA}\n{}", arguments.question.spec().replace("NAME", &name));
    let path = folder.join(format!("{name}.toml"));
    // The spec as it would be written is no other one.
    let found = file::open(&path).and_then(io::read_to_string);
    if path.exists() && !found.is_ok_and(|found| found == text) {
        return Err(wrong(format!(
            "{}: is there already\n  expected: a new name\n  help: choose another name, or remove the file",
            path.display()
        )));
    }
    let write = |path: &Path, text: &str| {
        let failed = |error: io::Error| Failure {
            code: FAILED,
            message: format!(
                "error: {}: cannot write: {error}\n  help: choose a folder that is there and can be written to",
                path.display()
            ),
        };
        to_file(path, |file| file.write_all(text.as_bytes())).map_err(failed)
    };
    let schema_path = folder.join(SCHEMA);
    let schema = format!("{:#}\n", schema());
    // One of another version would complain of what this version can do.
    if !file::open(&schema_path).and_then(io::read_to_string).is_ok_and(|found| found == schema) {
        write(&schema_path, &schema)?;
    }
    write(&path, &text)?;
    let path = path.display();
    say(&format!(
        "{path}: a spec to start from, with {SCHEMA} beside it, by which editors complete and check it\n\
         next:\n  slipsweep plan {path}\n  slipsweep run {path}\n"
    ))
}
