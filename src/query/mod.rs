//! Questions to tables on disk, in SQL: the tables of a dataset, or a single file, as they lie in their folder.
//!
//! Files are scanned as far as a question needs them, column by column and in pieces, so that memory does not grow with
//! the tables but with the answer that is kept in memory, if any.

mod answer;
mod literal;
mod source;

use std::path::Path;
use std::thread;

use polars::prelude::{IntoLazy, LazyFrame, PolarsError};
use polars::sql::SQLContext;

use crate::names::nearest;

pub use answer::{Answer, AnswerError, Format};
pub use source::Source;

/// Tables that can be asked.
pub struct Tables {
    /// The tables, in the order of the dataset.
    pub sources: Vec<Source>,
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum QueryError {
    /// The path leads to nothing that could be asked.
    #[error("{path}: {found}\n  expected: {expected}\n  help: {help}")]
    Path {
        /// The path.
        path: String,
        /// What is wrong with it.
        found: String,
        /// What would be right.
        expected: &'static str,
        /// What to do.
        help: &'static str,
    },
    /// The question makes no sense, or none for these tables.
    #[error("{found}\n  expected: a SELECT from these tables:{tables}\n  help: {help}")]
    Sql {
        /// What is wrong with it.
        found: String,
        /// The tables and their columns, a line each.
        tables: String,
        /// What to do.
        help: String,
    },
    /// A file cannot be read.
    #[error(
        "{path}: cannot read: {source}\n  help: if a run wrote it, delete it and run the sweep again, which makes only what is missing"
    )]
    Read {
        /// The file or folder.
        path: String,
        /// Why not.
        source: PolarsError,
    },
}

impl QueryError {
    /// Whether the path or the question is wrong, rather than the files or the machine.
    pub fn is_wrong(&self) -> bool {
        matches!(self, QueryError::Path { .. } | QueryError::Sql { .. })
    }
}

impl Tables {
    /// The tables of the dataset in `path`; or of a folder of Parquet files, or a Parquet or CSV file, one table under its name.
    pub fn open(path: &Path) -> Result<Tables, QueryError> {
        source::open(path).map(|sources| Tables { sources })
    }

    /// The table of this name.
    pub fn find(&self, name: &str) -> Option<&Source> {
        self.sources.iter().find(|source| source.name == name)
    }

    /// The answer to a question in SQL, which is found when it is read.
    pub fn ask(&self, sql: &str) -> Result<Answer, QueryError> {
        let mut context = SQLContext::new();
        for source in &self.sources {
            context.register(&source.name, source.frame.clone());
        }
        match context.execute(&literal::written_out(sql)).and_then(Answer::new) {
            Ok(answer) if answer.columns().is_empty() => {
                Err(self.refuse("this asks for nothing".to_owned(), "begin with SELECT"))
            }
            Ok(answer) => Ok(answer),
            Err(error) => Err(self.explain(&error)),
        }
    }

    /// What is wrong with a question that failed while it was answered: what fails on the first rows alone too, such as the sum of words,
    /// is no fault of the files. `None` if it is not the question.
    pub fn fault(&self, sql: &str) -> Option<QueryError> {
        let mut context = SQLContext::new();
        for source in &self.sources {
            let first = source.frame.clone().limit(1).collect().ok()?;
            context.register(&source.name, first.lazy());
        }
        let mut answer = || context.execute(&literal::written_out(sql)).and_then(LazyFrame::collect);
        // A question that is too much for polars ends its thread.
        let answered = thread::scope(|scope| scope.spawn(&mut answer).join());
        Some(self.explain(&answered.ok()?.err()?))
    }

    /// What is wrong with a question.
    fn explain(&self, error: &PolarsError) -> QueryError {
        let text = error.to_string();
        // The first line says it, before lists of what there is and plans of queries.
        let line = text.lines().next().unwrap_or_default().trim_end_matches(':');
        let quoted = |quote: char| line.split(quote).nth(1).unwrap_or_default();
        let columns = || self.sources.iter().flat_map(|source| &source.columns).map(String::as_str);
        let tables = || self.sources.iter().map(|source| source.name.as_str());
        let meant = |near: Option<&str>| match near {
            Some(name) => format!("did you mean `{name}`?"),
            None => "choose one of these".to_owned(),
        };
        if line.contains("unable to find column") {
            let name = quoted('"');
            return self.refuse(format!("no column `{name}`"), &meant(nearest(name, columns())));
        }
        if line.starts_with("relation ") && line.ends_with("was not found") {
            let name = quoted('\'');
            return self.refuse(format!("no table `{name}`"), &meant(nearest(name, tables())));
        }
        if line.starts_with("one (and only one) statement") {
            return self.refuse("not one statement".to_owned(), "write one SELECT");
        }
        let found = line.strip_prefix("sql parser error: ").map_or(line.to_owned(), |rest| format!("not SQL: {rest}"));
        self.refuse(
            found,
            "correct the query; text goes in 'single quotes', names with odd characters in \"double\" ones",
        )
    }

    fn refuse(&self, found: String, help: &str) -> QueryError {
        let columns = |source: &Source| format!("\n    {}: {}", source.name, source.columns.join(", "));
        let tables = self.sources.iter().map(columns).collect();
        QueryError::Sql { found, tables, help: help.to_owned() }
    }
}
