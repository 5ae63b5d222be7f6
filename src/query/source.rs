//! A table on disk that can be queried.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use polars::prelude::{DataFrame, IntoLazy, LazyFrame, PolarsError, PolarsResult};
use polars_io::SerReader;
use polars_io::prelude::{CsvParseOptions, CsvReadOptions, CsvReader};

use super::scan::Files;
use super::{Absent, QueryError, Tables};
use crate::dataset::Folder;
use crate::dataset::frame::{self, FrameError};
use crate::file;
use crate::sweep::path_hint;

/// A table and its files.
pub struct Source {
    /// Its name in queries.
    pub name: String,
    /// The names of its columns.
    pub columns: Vec<String>,
    /// The units of its columns; empty if unknown.
    pub units: Vec<String>,
    /// The files that it consists of.
    pub paths: Vec<PathBuf>,
    /// The number of missing files.
    pub missing: u64,
    /// The number of rows according to the dataset; `None` for a single file.
    pub rows: Option<u64>,
    /// Its Parquet files.
    pub(super) files: Option<Files>,
    /// The table, read lazily.
    pub(super) frame: LazyFrame,
}

/// The tables of a query.
const EXPECTED: &str = "the folder of a dataset, such as results/NAME, or a Parquet or CSV file";

impl Tables {
    /// Opens the tables of the dataset in `path`. A folder of Parquet files, or a Parquet or CSV file, is one table under its name.
    ///
    /// # Errors
    ///
    /// If there is no table, or if one of its files cannot be read.
    pub fn open(path: &Path) -> Result<Tables, QueryError> {
        let wrong = |found: &str, help: &str| {
            QueryError::sql(format!("{}: {found}\n  expected: {EXPECTED}", path.display()), help)
        };
        if path.is_dir() {
            // The folder of a table belongs to its dataset, and is checked like it.
            let above = fs::canonicalize(path).ok().and_then(|real| real.parent().map(Path::to_owned));
            if let (Some(above), Some(name)) = (above, path.file_name())
                && let Ok(Some(_)) = Folder::at(&above).manifest()
            {
                let mut tables = Tables::open(&above)?;
                tables.sources.retain(|source| *source.name == *name.to_string_lossy());
                if !tables.sources.is_empty() {
                    return Ok(tables);
                }
            }
            let folder = Folder::at(path);
            let manifest = folder.manifest().map_err(|error| wrong(&error.to_string(), "name another folder"))?;
            let Some(manifest) = manifest else {
                let files = parts(path);
                if files.is_empty() {
                    return Err(wrong(
                        "holds neither a manifest.json nor Parquet files",
                        "name a folder that `slipsweep run` wrote",
                    ));
                }
                return Source::parquet(path, name_of(path), files, 0, None).map(Tables::of);
            };
            let (mut sources, mut absent) = (Vec::new(), Vec::new());
            for table in &manifest.tables {
                let name = table.name.clone();
                match folder.verified(&manifest, table) {
                    Ok((files, _)) if files.is_empty() => absent.push(Absent { name, fault: None }),
                    Ok((files, missing)) => {
                        sources.push(Source::parquet(path, name, files, missing, Some(table.rows))?)
                    }
                    Err(fault) => absent.push(Absent { name, fault: Some(Arc::new(fault)) }),
                }
            }
            if sources.is_empty() {
                if let Some(damaged) = absent.iter().find(|table| table.fault.is_some()) {
                    return Err(damaged.error());
                }
                return Err(wrong("the dataset has no parts yet", "compute them with `slipsweep run`"));
            }
            return Ok(Tables { sources, absent });
        }
        if !path.exists() {
            return Err(wrong("there is no such file or folder", &path_hint(path, "")));
        }
        if !path.is_file() {
            return Err(wrong("a device or a named pipe, not a file", "write it to a file, and name that file"));
        }
        match file::ending(path).as_str() {
            "parquet" => Source::parquet(path, name_of(path), vec![path.to_owned()], 0, None),
            "csv" => Source::csv(path),
            _ => return Err(wrong("neither a folder nor a file that ends in .parquet or .csv", "check the path")),
        }
        .map(Tables::of)
    }

    fn of(source: Source) -> Tables {
        Tables { sources: vec![source], absent: Vec::new() }
    }
}

impl Source {
    /// A table of Parquet files with equal columns. Its name comes from the parts if they belong to a dataset, else from the folder.
    fn parquet(
        path: &Path,
        name: String,
        paths: Vec<PathBuf>,
        missing: u64,
        rows: Option<u64>,
    ) -> Result<Source, QueryError> {
        let failed = |path: &Path, source| QueryError::Read { path: path.display().to_string(), source };
        let first = paths.first().map_or(path, PathBuf::as_path);
        let (headings, facts) = frame::headings(first)
            .map_err(|FrameError { reason, .. }| failed(first, PolarsError::ComputeError(reason.into())))?;
        let files = Files::new(paths.clone()).map_err(|source| failed(path, source))?;
        let frame = files.frame().map_err(|source| failed(path, source))?;
        let name = facts.into_iter().find(|(key, _)| key == "slipsweep.table").map_or(name, |(_, table)| table);
        let (columns, units) = headings.into_iter().map(|heading| (heading.name, heading.unit)).unzip();
        Ok(Source { name, columns, units, paths, missing, rows, files: Some(files), frame })
    }

    /// The table in a CSV file. A column is numeric if all its cells are numbers; lines that begin with # are comments.
    fn csv(path: &Path) -> Result<Source, QueryError> {
        let failed = |source| QueryError::Read { path: path.display().to_string(), source };
        let (frame, units) = csv(path).map_err(failed)?;
        let columns: Vec<String> = frame.get_column_names_owned().iter().map(ToString::to_string).collect();
        let units = units.filter(|units| units.len() == columns.len());
        Ok(Source {
            name: name_of(path),
            units: units.unwrap_or_else(|| vec![String::new(); columns.len()]),
            columns,
            paths: vec![path.to_owned()],
            missing: 0,
            rows: None,
            files: None,
            frame: frame.lazy(),
        })
    }
}

/// The rows of a CSV file, and the units of its columns if a comment of `slipsweep trace` states them.
fn csv(path: &Path) -> PolarsResult<(DataFrame, Option<Vec<String>>)> {
    let bytes = fs::read(path)?;
    let mut opened = None;
    for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let is_comment = opened.is_none() && line.starts_with(b"#");
        if !is_comment && line.iter().filter(|&&byte| byte == b'"').count() % 2 == 1 {
            opened = if opened.is_none() { Some(number + 1) } else { None };
        }
    }
    let header = bytes.split(|&byte| byte == b'\n').find(|line| !line.starts_with(b"#")).unwrap_or_default();
    if !header.contains(&b',') && header.iter().any(|byte| b";\t".contains(byte)) {
        return Err(PolarsError::ComputeError("columns that end with ; or a tab; write CSV with commas".into()));
    }
    if let Some(line) = opened {
        return Err(PolarsError::ComputeError(format!("line {line}: a quote is not closed").into()));
    }
    let format = CsvParseOptions::default().with_comment_prefix(Some("#"));
    let options = CsvReadOptions::default().with_infer_schema_length(None).with_parse_options(format);
    let comments = bytes.split(|&byte| byte == b'\n').take_while(|line| line.starts_with(b"#"));
    let units = comments.into_iter().find_map(|line| line.strip_prefix(b"# units = "));
    let units = units.map(|units| String::from_utf8_lossy(units).trim_end().split(", ").map(str::to_owned).collect());
    Ok((CsvReader::new(Cursor::new(&bytes)).with_options(options).finish()?, units))
}

/// The Parquet files in a folder, in the order of their names.
fn parts(folder: &Path) -> Vec<PathBuf> {
    file::sorted(folder, |path| {
        let hidden = path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
        !hidden && path.is_file() && path.extension().is_some_and(|ending| ending == "parquet")
    })
}

/// The name of a file or folder as an identifier that needs no quotes in SQL.
fn name_of(path: &Path) -> String {
    let real = fs::canonicalize(path);
    let stem = real.as_deref().unwrap_or(path).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let word: String = stem.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
    if word.starts_with(|c: char| c.is_ascii_digit()) || word.is_empty() { format!("t{word}") } else { word }
}
