//! `slipsweep query DATASET "SELECT …"`: a question in SQL, and the answer as a table, CSV, JSON lines or Parquet.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::output::{self, Output};
use super::{Failure, say, summary, to_file, words};
use crate::query::{self, Answer, AnswerError, Tables};

/// Arguments of `query`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  slipsweep query results/granite \"SELECT t_f, min(gap) FROM gap GROUP BY t_f ORDER BY t_f\"
  slipsweep query results/granite \"SELECT status, count(*) FROM gap GROUP BY status\"
  slipsweep query results/granite \"SELECT * FROM best WHERE status = 'ok'\" --out best.csv")]
pub struct Arguments {
    /// Folder of the dataset, such as results/NAME; or a Parquet or CSV file, which is a table under its own name
    dataset: PathBuf,
    /// The question in SQL, in quotes; every table of the dataset has its name
    sql: String,
    #[command(flatten)]
    output: Output<Format>,
}

/// How an answer is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Aligned columns of nine digits (.txt)
    Table,
    /// All digits (.csv)
    Csv,
    /// A JSON object a line (.jsonl)
    Jsonl,
    /// Parquet (.parquet)
    Parquet,
}

impl output::Format for Format {
    const ENDINGS: &'static [(&'static str, Format)] = &[
        ("csv", Format::Csv),
        ("jsonl", Format::Jsonl),
        ("ndjson", Format::Jsonl),
        ("parquet", Format::Parquet),
        ("txt", Format::Table),
    ];
    const TABLE: Format = Format::Table;
    const PARQUET: Format = Format::Parquet;
}

/// Answers a question.
pub fn query(arguments: &Arguments) -> Result<(), Failure> {
    let format = arguments.output.format()?;
    let tables = Tables::open(&arguments.dataset)?;
    let answer = tables.ask(&arguments.sql)?;
    for source in tables.sources.iter().filter(|source| source.missing > 0) {
        let (missing, all) = (source.missing, source.missing + source.files.len() as u64);
        // That the answer is incomplete is worth saying, but not worth failing if it cannot be said.
        let _ = writeln!(
            io::stderr(),
            "note: `{}` lacks {} of {}, which `slipsweep run` makes",
            source.name,
            words::count(missing),
            words::things(all, "part")
        );
    }
    if arguments.output.is_stdout() {
        return match write(answer, format, &mut BufWriter::new(io::stdout().lock())) {
            // Who reads has had enough.
            Err(AnswerError::Write(error)) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            Err(AnswerError::Write(error)) => Err(Failure::failed(format!("cannot write to standard output: {error}"))),
            done => done.map_err(|error| failure(&tables, arguments, error)),
        };
    }
    let path = arguments.output.out.display();
    let fill = |file: &mut dyn Write| write(answer, format, &mut BufWriter::new(file));
    to_file(&arguments.output.out, fill).map_err(|error| match error {
        AnswerError::Write(error) => Failure::failed(format!("cannot write {path}: {error}")),
        error => failure(&tables, arguments, error),
    })?;
    say(&format!("written to {path}\n"))
}

/// A question that cannot be answered, or files that cannot be read to the end.
fn failure(tables: &Tables, arguments: &Arguments, error: AnswerError) -> Failure {
    tables.fault(&arguments.sql).map_or_else(|| unreadable(&arguments.dataset, &error), Failure::from)
}

/// Tables that cannot be read to the end, for all that is known by a file that is damaged.
pub(super) fn unreadable(dataset: &Path, error: &AnswerError) -> Failure {
    let path = dataset.display();
    let help = if dataset.join("manifest.json").exists() {
        format!("`slipsweep status {path} --check` names damaged files, and the next run makes them again")
    } else {
        "make the file again".to_owned()
    };
    Failure::failed(format!("{path}: {error}\n  help: {help}"))
}

fn write(answer: Answer, format: Format, out: &mut dyn Write) -> Result<(), AnswerError> {
    let format = match format {
        Format::Table => return table(answer, out),
        Format::Csv => query::Format::Csv,
        Format::Jsonl => query::Format::JsonLines,
        Format::Parquet => query::Format::Parquet,
    };
    answer.write(format, out)
}

/// Aligned columns under their names.
fn table(answer: Answer, out: &mut dyn Write) -> Result<(), AnswerError> {
    let mut columns = words::Columns::default();
    let mut lines = vec![answer.columns()];
    answer.rows(|rows| {
        lines.extend(rows.iter().map(|row| row.iter().map(summary::shown).collect()));
        out.write_all(columns.lines(&lines, 0).as_bytes())?;
        lines.clear();
        Ok(())
    })?;
    // The names alone, where there was no row.
    out.write_all(columns.lines(&lines, 0).as_bytes())?;
    Ok(out.flush()?)
}
