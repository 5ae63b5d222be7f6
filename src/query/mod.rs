//! SQL queries on the tables of a dataset, or on a single file.
//!
//! `checked_query` checks a query and translates it into the dialect of polars. `streaming` splits it into parts if possible, so that the
//! table need not fit into memory. `scan` reads the needed columns and row groups, `filter` drops rows, `groups` aggregates them, and
//! `answer` writes the result. Only the opened tables are read.

mod answer;
mod checked_query;
mod comparisons;
mod filter;
mod groups;
mod scan;
mod source;
mod streaming;
mod units;
mod walk;

use std::collections::HashSet;
use std::sync::Arc;

use indexmap::IndexSet;
use polars::prelude::{IntoLazy, LazyFrame, PolarsError, PolarsResult, Schema, SortMultipleOptions};
use polars::sql::SQLContext;

use crate::dataset::{DatasetError, guarded};
use crate::names::{hint, nearest};
use crate::table;

pub use answer::{Answer, AnswerError, Format};
use checked_query::CheckedQuery;
pub use comparisons::Comparisons;
pub use scan::is_unreadable;
pub use source::Source;

/// Tables that can be queried.
pub struct Tables {
    /// The tables, in the order of the dataset.
    pub sources: Vec<Source>,
    /// The tables of the dataset that cannot be read.
    pub absent: Vec<Absent>,
}

/// A table without a computed part, or with a damaged one.
pub struct Absent {
    /// Its name.
    pub name: String,
    /// The damage of a part.
    pub fault: Option<Arc<DatasetError>>,
}

impl Absent {
    /// Why it cannot be read.
    pub fn error(&self) -> QueryError {
        match &self.fault {
            Some(fault) => QueryError::Part(fault.clone()),
            None => QueryError::sql(format!("`{}` has no parts yet", self.name), "compute them with `slipsweep run`"),
        }
    }
}

/// The error of a query.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum QueryError {
    /// The path leads to no table, or the query is not valid for its tables.
    #[error("{found}\n  help: {help}")]
    Sql { found: String, help: String },
    /// A part is damaged, or belongs to another dataset.
    #[error(transparent)]
    Part(Arc<DatasetError>),
    /// A file cannot be read.
    #[error(
        "{path}: cannot read: {source}\n  help: check the file; if a run wrote it, run the sweep again, which recomputes damaged parts"
    )]
    Read { path: String, source: PolarsError },
}

/// Greatest length of an error of polars in a message, in characters. Chosen: two lines.
const MAX_ERROR_CHARS: usize = 200;

/// Functions of the engine, and their names elsewhere.
const FUNCTIONS: [(&str, &[&str]); 5] = [
    ("avg(x)", &["mean", "average"]),
    ("stddev(x)", &["std", "stdev", "sd"]),
    ("variance(x)", &["var"]),
    ("quantile_cont(x, 0.9)", &["quantile", "percentile", "percentile_cont", "approx_quantile"]),
    (
        "ORDER BY x LIMIT 1 for the row of the least x; QUALIFY row_number() OVER (PARTITION BY g ORDER BY x) = 1 for that of each g",
        &["argmin", "arg_min", "min_by", "argmax", "arg_max", "max_by"],
    ),
];

impl QueryError {
    fn sql(found: impl Into<String>, help: impl Into<String>) -> QueryError {
        QueryError::Sql { found: found.into(), help: help.into() }
    }

    /// Whether the path or the query is wrong, rather than the files or the machine.
    pub fn is_wrong(&self) -> bool {
        matches!(self, QueryError::Sql { .. })
    }
}

/// The plan of the query `sql` on named `tables`.
fn plan<'a>(tables: impl IntoIterator<Item = (&'a str, LazyFrame)>, sql: &str) -> PolarsResult<LazyFrame> {
    let mut context = SQLContext::new();
    for (name, frame) in tables {
        context.register(name, frame);
    }
    context.execute(sql)
}

/// The rows in the order of their columns, so that each run of a query has the same answer.
fn sorted(frame: LazyFrame, schema: &Schema) -> LazyFrame {
    let columns = schema.iter().filter(|(_, kind)| !kind.is_nested()).map(|(name, _)| name.clone());
    let columns: Vec<_> = columns.collect();
    if columns.is_empty() { frame } else { frame.sort(columns, SortMultipleOptions::default()) }
}

impl Tables {
    /// The answer to a SQL query, computed when it is read.
    ///
    /// # Errors
    ///
    /// If the query is not one SELECT from these tables.
    pub fn query(&self, sql: &str) -> Result<Answer, QueryError> {
        let checked = CheckedQuery::parse(sql, self)?;
        let planned = || -> PolarsResult<(LazyFrame, Arc<Schema>)> {
            let tables = self.sources.iter().map(|source| (source.name.as_str(), source.frame.clone()));
            let mut frame = plan(tables, &checked.query.to_string())?;
            let schema = frame.collect_schema()?;
            Ok((frame, schema))
        };
        let (frame, schema) = guarded(planned)
            .unwrap_or_else(|| Err(PolarsError::ComputeError("the engine does not support this query".into())))
            .map_err(|error| self.explain(sql, &checked, &error))?;
        if let Some(error) = checked.mixed {
            return Err(error);
        }
        let columns: Vec<String> = schema.iter_names().map(ToString::to_string).collect();
        let frame = if checked.is_unordered { sorted(frame, &schema) } else { frame };
        let unit = |name: &String| {
            let known = checked.units.iter().find(|(column, _)| column == name);
            known.map_or_else(String::new, |(_, unit)| unit.clone())
        };
        let units = columns.iter().map(unit).collect();
        let streaming = streaming::streaming(&checked.query, &self.sources);
        let streaming = streaming.filter(|streaming| streaming.names == columns);
        Ok(Answer { columns, units, comparisons: checked.comparisons, frame, streaming })
    }

    /// The error of a query that failed during its computation, if the query is to blame: it also fails on the first rows alone, such as a sum
    /// of words. Otherwise `None`.
    pub fn diagnose(&self, sql: &str) -> Option<QueryError> {
        let checked = CheckedQuery::parse(sql, self).ok()?;
        let mut first = Vec::new();
        for source in &self.sources {
            first.push((source.name.as_str(), source.frame.clone().limit(1).collect().ok()?.lazy()));
        }
        let answered = guarded(|| plan(first, &checked.query.to_string()).and_then(LazyFrame::collect));
        Some(self.explain(sql, &checked, &answered?.err()?))
    }

    /// The fault of a query with a column that no table has, according to a `line` of polars.
    fn missing_column(&self, sql: &str, checked: &CheckedQuery, line: &str) -> QueryError {
        let name = line.split(['"', '\'']).nth(1).unwrap_or_default();
        // polars joins tables with such names.
        if let Some((column, table)) = name.split_once(':') {
            let found = format!("`{table}.{column}` with the name of another column");
            return QueryError::sql(found, "choose a name after AS that no table has");
        }
        let read = || self.sources.iter().filter(|source| checked.read.contains(&source.name));
        if read().any(|source| source.columns.iter().any(|column| column == name)) {
            let help = "select it, too, or use a subquery: FROM (SELECT …) AS t ORDER BY …";
            return QueryError::sql(format!("`{name}` is in ORDER BY, but not in SELECT"), help);
        }
        let columns = || read().flat_map(|source| &source.columns).map(String::as_str);
        let is_optional = |source: &&Source| {
            let table = table::find(&source.name);
            table.is_some_and(|table| table.columns().iter().any(|column| column.name == name))
        };
        let spaced = columns().find(|column| column.split_once(' ').is_some_and(|(first, _)| first == name));
        let help = match nearest(name, columns()) {
            _ if spaced.is_some() => format!("a name with spaces goes in double quotes: \"{}\"", spaced.unwrap_or_default()),
            _ if ["inf", "infinity", "nan"].contains(&name.to_lowercase().as_str()) => {
                format!("CAST('{name}' AS DOUBLE) is this number")
            }
            _ if read().any(|source| is_optional(&source)) => {
                "the dataset lacks this optional column; name it in `columns` of a spec with another `name`, and run that".to_owned()
            }
            None if sql.contains(&format!("\"{name}\"")) => {
                format!("text goes in single quotes: '{name}'; double quotes are for names of columns")
            }
            None => format!("choose one of these; text goes in single quotes: '{name}'"),
            _ => hint(name, columns()),
        };
        let tables = read().map(|source| format!("{}: {}", source.name, source.columns.join(", ")));
        let expected = match tables.collect::<Vec<_>>().join("\n    ") {
            tables if tables.is_empty() => "FROM and the name of a table".to_owned(),
            tables => format!("a column of {tables}"),
        };
        QueryError::sql(format!("no column `{name}`\n  expected: {expected}"), help)
    }

    /// The columns of words that a query names.
    fn words(&self, sql: &str, checked: &CheckedQuery) -> Vec<String> {
        let named: HashSet<&str> = sql.split(|letter: char| !(letter.is_alphanumeric() || letter == '_')).collect();
        let mut words = IndexSet::new();
        for source in self.sources.iter().filter(|source| checked.read.contains(&source.name)) {
            let Ok(schema) = source.frame.clone().collect_schema() else { continue };
            let of_words = schema.iter().filter(|(_, kind)| kind.is_categorical() || kind.is_string());
            words.extend(of_words.map(|(name, _)| name.to_string()).filter(|name| named.contains(name.as_str())));
        }
        words.into_iter().collect()
    }

    /// The fault of a query.
    fn explain(&self, sql: &str, checked: &CheckedQuery, error: &PolarsError) -> QueryError {
        let text = error.to_string();
        // The first line contains the reason; lists of names and query plans follow.
        let line = text.lines().next().unwrap_or_default().trim_end_matches(':');
        let line = crate::names::shown(line, MAX_ERROR_CHARS);
        let line = &*line;
        if line.contains("unable to find column") || line.contains("no column named") {
            return self.missing_column(sql, checked, line);
        }
        // Names of types and of nodes of the syntax tree of polars mean nothing to a user.
        let is_internal = line.contains("Query {")
            || line.starts_with("join type")
            || line.contains("activate '")
            || line.contains("'Expr: ")
            || line.contains(" { ") && line.contains("expression");
        if is_internal {
            let found =
                "a part of the query is not supported, such as EXISTS, SEMI JOIN or a subquery in an expression";
            return QueryError::sql(found, "write it as a join, with IN for one column, or with WITH");
        }
        let known = |sign: &str| line.contains(sign);
        let (found, help) = if known("GROUP BY clause") {
            let name = line.split('\'').nth(1).unwrap_or_default();
            let found = format!("`{name}` is neither in GROUP BY nor in an aggregate");
            let mut help = format!("add it to GROUP BY, or write min({name}) or max({name})");
            if sql.to_lowercase().contains(" as ") {
                help.push_str("; choose names after AS that no column has");
            }
            (found, help)
        } else if known("datatypes of join keys") {
            ("ON compares a column with a constant".to_owned(), "write the comparison in WHERE".to_owned())
        } else if known("group_by keys contained duplicate") {
            let help = "name them in a subquery: FROM (SELECT upper(x) AS a, length(x) AS b FROM t) AS s GROUP BY a, b";
            ("two keys of GROUP BY are functions of one column".to_owned(), help.to_owned())
        } else if known("LIMIT/OFFSET") {
            ("LIMIT and OFFSET take whole numbers from 0".to_owned(), "correct the number".to_owned())
        } else if let Some(name) = line.strip_prefix("unsupported function '") {
            let name = name.split('\'').next().unwrap_or_default();
            let ours = FUNCTIONS.iter().find(|(_, theirs)| theirs.contains(&name)).map(|(ours, _)| *ours);
            let help = ours.map_or("choose another function".to_owned(), |ours| format!("write {ours}"));
            (format!("no function `{name}`"), help)
        } else if known("dtype") || known("supertype") || known("cannot compare") || known("cannot cast") {
            let help = "words can be compared and counted; arithmetic, sum and avg need numbers; CAST('inf' AS DOUBLE) is infinity";
            let words = self.words(sql, checked);
            let mut found = "words in place of numbers, or numbers in place of words".to_owned();
            if !words.is_empty() {
                found.push_str(&format!("; columns of words: {}", words.join(", ")));
            }
            (found, help.to_owned())
        } else {
            (line.to_owned(), "correct the query".to_owned())
        };
        QueryError::sql(found, help)
    }
}
