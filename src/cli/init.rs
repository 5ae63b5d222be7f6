//! `slipsweep init NAME`: a commented spec that runs unchanged.

use std::io;
use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::{Failure, refused, say, write_file};
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
    /// Question that the spec answers
    #[arg(long, value_enum, default_value_t = Question::Landscape)]
    question: Question,
}

/// A question with a spec that answers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Question {
    /// How close do cubic shortcuts come to the protocol of least work?
    Landscape,
    /// Above what duration does the optimal protocol slow down first?
    Crossover,
    /// Which shortcut costs least at each duration, under a friction ceiling?
    Families,
    /// On which spring does sliding end in stick-slip?
    StickSlip,
}

impl Question {
    /// The spec, with NAME in place of the name.
    fn spec(self) -> &'static str {
        match self {
            Question::Landscape => include_str!("init/landscape.toml"),
            Question::Crossover => include_str!("init/crossover.toml"),
            Question::Families => include_str!("init/families.toml"),
            Question::StickSlip => include_str!("init/stick_slip.toml"),
        }
    }
}

/// The file of the JSON Schema, for completion and checks in editors.
const SCHEMA: &str = "slipsweep.schema.json";

/// Writes a spec and its JSON Schema.
///
/// # Errors
///
/// An illegal name, an existing file, or a file that cannot be written.
pub fn init(arguments: &Arguments) -> Result<(), Failure> {
    let given = arguments.name.display();
    let bare = match arguments.name.extension() {
        Some(ending) if ending == "toml" => arguments.name.with_extension(""),
        _ => arguments.name.clone(),
    };
    let name = bare.file_name().unwrap_or_default().to_string_lossy();
    let folder = bare.parent().unwrap_or(Path::new(""));
    check_name(&name).map_err(|error| {
        let place = if name == given.to_string() { String::new() } else { format!("`{given}`: ") };
        refused(format!("{place}{}", error.found), error.expected, error.help)
    })?;
    if !(folder.as_os_str().is_empty() || folder.is_dir()) {
        let found = format!("`{given}`: there is no folder `{}`", folder.display());
        return Err(refused(found, "a name, or a path in an existing folder", format!("slipsweep init {name}")));
    }
    let text = format!("#:schema ./{SCHEMA}\n{}", arguments.question.spec().replace("NAME", &name));
    let path = folder.join(format!("{name}.toml"));
    let has = |path: &Path, text: &str| file::open(path).and_then(io::read_to_string).is_ok_and(|found| found == text);
    // A spec that equals the new one is no conflict.
    if path.exists() && !has(&path, &text) {
        let found = format!("{}: exists already", path.display());
        return Err(refused(found, "a new name", "choose another name, or remove the file"));
    }
    let schema_path = folder.join(SCHEMA);
    let schema = format!("{:#}\n", schema());
    // A schema of another version would report valid keys of this version as errors.
    if !has(&schema_path, &schema) {
        write_file(&schema_path, schema.as_bytes())?;
    }
    write_file(&path, text.as_bytes())?;
    let path = path.display();
    say(&format!(
        "written: {path}, a commented spec, and {SCHEMA}, its schema for editors\n\
         next:\n  slipsweep plan {path}\n  slipsweep run {path}\n"
    ))
}
