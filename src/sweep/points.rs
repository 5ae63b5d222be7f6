//! The points file: its columns are axes that vary together, and labels.

use std::borrow::Cow;
use std::fmt::Display;
use std::fs::File;
use std::io;
use std::path::Path;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, ArrowPrimitiveType};
use indexmap::IndexSet;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use super::error::{SpecError, unknown};
use super::units::legal;
use crate::dataset::{coded, guarded, label};
use crate::file;
use crate::grid::{Axis, Factor, Label, Quantity, Scale, Values};
use crate::model::Units;
use crate::table::{self, STATUS};

/// Reads the points of a CSV or Parquet file. Values are in `units`; coefficients are not relative to `t_f`.
///
/// # Errors
///
/// A file that cannot be read, an unknown column, or an illegal value.
pub fn read(path: &Path, units: &Units) -> Result<Factor, SpecError> {
    let name = path.display();
    let file = check_size(path)?;
    let columns = match file::ending(path).as_str() {
        "csv" => csv(path, file, units)?,
        // A panic of the reader on a damaged file is a fault of the file.
        "parquet" => {
            guarded(|| parquet(path, file, units)).unwrap_or_else(|| Err(unreadable(path, &"it is damaged")))?
        }
        _ => {
            let (expected, help) = ("a file whose name ends in .csv or .parquet", "write the points as CSV");
            return Err(fault(format!("{name}: neither CSV nor Parquet"), expected, help));
        }
    };
    if columns.iter().all(Column::is_empty) {
        let (expected, help) = ("axis names and at least one point", "add points, or remove `points`");
        return Err(fault(format!("{name}: no points"), expected, help));
    }
    let mut factor = Factor::default();
    for Column { name, cells } in columns {
        match cells {
            Cells::Axis(quantity, values) => {
                factor.axes.push(Axis { quantity, scale: Scale::Model, values: Values::List(values) });
            }
            Cells::Label { words, places, has_text: true } => {
                factor.labels.push(Label { name, words: words.into_iter().collect(), places });
            }
            Cells::Label { .. } => {
                return Err(unknown_axis(path, &name));
            }
        }
    }
    Ok(factor)
}

/// The fault of a column of numbers that is no axis.
fn unknown_axis(path: &Path, name: &str) -> SpecError {
    // Spreadsheets write units behind names.
    let bare = name.split(['(', '[']).next().unwrap_or_default().trim();
    let error = unknown("points".to_owned(), "axis", bare, &Quantity::ALL.map(Quantity::name));
    let help = match bare {
        _ if Quantity::from_name(bare).is_some() => format!("name it `{bare}`; its unit is that of the spec"),
        "l" | "v_0" | "mu_0" | "normal_stress" => {
            format!("`{bare}` goes below [model]; samples that differ in it need a spec each")
        }
        _ if error.help.starts_with("did you mean") => error.help.to_string(),
        _ => "remove it, or make it a label: text, in CSV with a letter or in quotes".to_owned(),
    };
    let expected = format!("{}; or a label: text, such as \"S1\", or numbers in quotes", error.expected);
    let found = format!("{}: unknown axis `{name}`", path.display());
    SpecError { found: found.into(), expected: expected.into(), help: help.into(), ..error }
}

/// Greatest number of points. Chosen: the values of all 16 quantities take 512 MiB of memory.
const MAX_POINTS: usize = 1 << 22;

/// Greatest size of a file, in bytes: 64 for each of [`MAX_POINTS`].
const MAX_FILE_BYTES: u64 = 64 * MAX_POINTS as u64;

/// Opens a file that fits into memory: a regular file of at most [`MAX_FILE_BYTES`].
fn check_size(path: &Path) -> Result<File, SpecError> {
    let file = file::open(path).map_err(|error| unreadable(path, &error))?;
    let bytes = file.metadata().map_err(|error| unreadable(path, &error))?.len();
    if bytes > MAX_FILE_BYTES {
        return Err(too_many(path, &format!("{bytes} bytes"), MAX_FILE_BYTES));
    }
    Ok(file)
}

/// Checks the number of points against [`MAX_POINTS`].
fn check_count(path: &Path, count: usize) -> Result<(), SpecError> {
    let found = format!("{count} points or more");
    if count <= MAX_POINTS { Ok(()) } else { Err(too_many(path, &found, MAX_POINTS as u64)) }
}

fn too_many(path: &Path, found: &str, most: u64) -> SpecError {
    fault(format!("{}: {found}", path.display()), &format!("at most {most}"), "take fewer points, or several sweeps")
}

/// Greatest length of a label and of its name, in characters. Chosen: it fits a line of a picture.
const MAX_LABEL_CHARS: usize = 200;

/// A cell without a value, in messages.
const EMPTY: &str = "an empty cell";

/// A column of a file of points.
struct Column {
    name: String,
    cells: Cells,
}

/// The values of a column.
enum Cells {
    /// Values of an axis.
    Axis(Quantity, Vec<f64>),
    /// The distinct texts of a label, and the index of each point; `None` for an empty cell.
    Label {
        words: IndexSet<String>,
        places: Vec<Option<u32>>,
        /// Whether a text is not a number.
        has_text: bool,
    },
}

impl Column {
    fn is_empty(&self) -> bool {
        match &self.cells {
            Cells::Axis(_, values) => values.is_empty(),
            Cells::Label { places, .. } => places.is_empty(),
        }
    }

    /// Adds a cell of text, which may be a number; `place` names the line.
    fn push(&mut self, place: impl Fn() -> String, cell: &str, units: &Units) -> Result<(), SpecError> {
        match &mut self.cells {
            Cells::Label { places, .. } if cell.is_empty() => places.push(None),
            Cells::Label { .. } if cell.chars().count() > MAX_LABEL_CHARS => {
                let found = format!("a label of {} characters", cell.chars().count());
                return self.wrong(place, &found, &format!("at most {MAX_LABEL_CHARS} characters"));
            }
            Cells::Label { words, places, has_text } => {
                *has_text |= cell.parse::<f64>().is_err();
                let place = words.get_index_of(cell).unwrap_or_else(|| words.insert_full(cell.to_owned()).0);
                places.push(Some(place as u32));
            }
            Cells::Axis(quantity, _) if quantity.words().is_empty() => match cell.parse::<f64>() {
                Ok(value) => self.push_number(place, value, units)?,
                Err(_) => {
                    let found = if cell.is_empty() { EMPTY.to_owned() } else { format!("`{cell}` is not a number") };
                    return self.wrong(place, &found, "a number with a decimal point, such as 0.03 or 1e-3");
                }
            },
            Cells::Axis(quantity, values) => {
                let words = quantity.words();
                match words.iter().position(|word| *word == cell) {
                    Some(index) => values.push(index as f64),
                    None => return self.wrong(place, &format!("unknown word `{cell}`"), &words.join(", ")),
                }
            }
        }
        Ok(())
    }

    /// Adds a number to an axis of numbers.
    fn push_number(&mut self, place: impl Fn() -> String, value: f64, units: &Units) -> Result<(), SpecError> {
        let Cells::Axis(quantity, values) = &mut self.cells else { return Ok(()) };
        match legal(units, *quantity, Scale::Model, value) {
            Ok(()) => values.push(value),
            Err(range) => return self.wrong(place, &format!("{value:?} is out of range"), &range),
        }
        Ok(())
    }

    fn wrong(&self, place: impl Fn() -> String, found: &str, expected: &str) -> Result<(), SpecError> {
        let help = if found == EMPTY { "fill it in, or remove the line" } else { "correct the value" };
        Err(fault(format!("{}: column `{}`: {found}", place(), self.name), expected, help))
    }
}

/// Reads CSV: a header of names, then one line for each point. Skips lines without values and lines that begin with #.
fn csv(path: &Path, file: File, units: &Units) -> Result<Vec<Column>, SpecError> {
    let text = file::text(file).map_err(|error| match error.kind() {
        io::ErrorKind::InvalidData => {
            fault(format!("{}: {error}", path.display()), "a CSV file in UTF-8", "save it as \"CSV UTF-8\"")
        }
        _ => unreadable(path, &error),
    })?;
    // Spreadsheets write a byte order mark.
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim).zip(1..);
    let mut lines = lines.filter(|(line, _)| !line.is_empty() && !line.starts_with('#'));
    let place = |number: usize| format!("{}:{number}", path.display());
    let mut columns = match lines.next() {
        Some((line, number)) => header(&place(number), cells_of(&place(number), line)?.iter().map(AsRef::as_ref))?,
        None => Vec::new(),
    };
    let mut faults: Option<SpecError> = None;
    for (count, (line, number)) in lines.enumerate() {
        if faults.as_ref().is_some_and(SpecError::is_full) {
            break;
        }
        check_count(path, count + 1)?;
        let cells = cells_of(&place(number), line)?;
        // Spreadsheets write empty rows.
        if cells.len() > 1 && cells.iter().all(|cell| cell.is_empty()) {
            continue;
        }
        if cells.len() != columns.len() {
            let found = format!(
                "{}: the number of values is {}, that of columns {}",
                place(number),
                cells.len(),
                columns.len()
            );
            return Err(fault(found, "a value for each column", "correct the line"));
        }
        for (column, cell) in columns.iter_mut().zip(cells) {
            if let Err(fault) = column.push(|| place(number), &cell, units) {
                faults = Some(SpecError::and(faults, fault));
            }
            // A cell in quotes is text, also if it reads as a number.
            if let (Cells::Label { has_text, .. }, Cow::Owned(text)) = (&mut column.cells, &cell) {
                *has_text |= !text.is_empty();
            }
        }
    }
    faults.map_or(Ok(columns), Err)
}

/// The cells of a line of CSV, quoted (and then owned) or not.
fn cells_of<'a>(place: &str, line: &'a str) -> Result<Vec<Cow<'a, str>>, SpecError> {
    let mut cells: Vec<Cow<'_, str>> = Vec::new();
    let mut rest = Some(line);
    while let Some(line) = rest.map(str::trim_start) {
        let Some(quoted) = line.strip_prefix('"') else {
            let (cell, others) = line.split_once(',').map_or((line, None), |(cell, others)| (cell, Some(others)));
            cells.push(cell.trim_end().into());
            rest = others;
            continue;
        };
        // A doubled quote is a quote.
        let end = quoted.replace("\"\"", "__").find('"');
        let after = end.map(|end| (&quoted[..end], quoted[end + 1..].trim_start()));
        let Some((cell, after)) = after.filter(|(_, after)| after.is_empty() || after.starts_with(',')) else {
            let found = format!("{place}: the quote in `{line}` is not closed on its line");
            return Err(fault(
                found,
                "quotes around a whole cell, without line breaks",
                "close the quote, or remove it",
            ));
        };
        cells.push(cell.replace("\"\"", "\"").trim().to_owned().into());
        rest = after.strip_prefix(',');
    }
    Ok(cells)
}

/// Reads Parquet: numbers, or text for axes of words and for labels.
fn parquet(path: &Path, file: File, units: &Units) -> Result<Vec<Column>, SpecError> {
    let name = path.display().to_string();
    let metadata = coded(&file).map_err(|error| unreadable(path, &error))?;
    let reader = ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata);
    let rows = reader.metadata().file_metadata().num_rows();
    check_count(path, usize::try_from(rows).unwrap_or(0))?;
    let mut columns = header(&name, reader.schema().fields().iter().map(|field| field.name().as_str()))?;
    let reader = reader.build().map_err(|error| unreadable(path, &error))?;
    let mut first = 0;
    for batch in reader {
        let batch = batch.map_err(|error| unreadable(path, &error))?;
        check_count(path, first + batch.num_rows())?;
        for (column, array) in columns.iter_mut().zip(batch.columns()) {
            let place = |row: usize| format!("{name}: row {}", first + row);
            if *array.data_type() == label() {
                for (row, cell) in texts_of(array).enumerate() {
                    column.push(|| place(row), cell.unwrap_or_default().trim(), units)?;
                }
                // Text is a label, also if it reads as a number.
                if let Cells::Label { has_text, .. } = &mut column.cells {
                    *has_text = true;
                }
                continue;
            }
            let numbers =
                numbers(array).filter(|_| matches!(&column.cells, Cells::Axis(axis, _) if axis.words().is_empty()));
            if let Some(row) = (0..array.len()).find(|&row| array.is_null(row)) {
                column.wrong(|| place(row), "a missing value", "a value for each point")?;
            }
            let Some(numbers) = numbers else {
                if matches!(column.cells, Cells::Label { .. }) && array.data_type().is_numeric() {
                    return Err(unknown_axis(path, &column.name));
                }
                let held = array.data_type();
                let found = format!("{name}: column `{}` holds {held}", column.name);
                let expected = "numbers for an axis, text for an axis of words or a label";
                return Err(fault(found, expected, "write the column in this type, or remove it"));
            };
            for (row, value) in numbers.into_iter().enumerate() {
                column.push_number(|| place(row), value, units)?;
            }
        }
        first += batch.num_rows();
    }
    Ok(columns)
}

/// The cells of a column of text.
fn texts_of(column: &ArrayRef) -> impl Iterator<Item = Option<&str>> {
    let column = column.as_dictionary_opt::<Int32Type>();
    let words = column.and_then(|column| column.values().as_string_opt::<i32>());
    let cell = move |key: Option<i32>| words.zip(key).map(|(words, key)| words.value(key as usize));
    column.into_iter().flat_map(|column| column.keys()).map(cell)
}

/// The values of a column of numbers; `None` for decimals and halves.
fn numbers(column: &ArrayRef) -> Option<Vec<f64>> {
    macro_rules! values {
        ($($type:ident)+) => {
            match column.data_type() {
                $(&$type::DATA_TYPE => column.as_primitive::<$type>().values().iter().map(|x| *x as f64).collect(),)+
                _ => return None,
            }
        };
    }
    Some(values!(Float64Type Float32Type Int8Type Int16Type Int32Type Int64Type
                UInt8Type UInt16Type UInt32Type UInt64Type))
}

fn unreadable(path: &Path, error: &dyn Display) -> SpecError {
    let found = format!("cannot read {}: {error}", path.display());
    let expected = "a readable CSV file in UTF-8, or a Parquet file, uncompressed or with Snappy or Zstandard";
    fault(found, expected, "check the path, which is relative to the spec, and the format of the file")
}

fn fault(found: String, expected: &str, help: &str) -> SpecError {
    SpecError::new("points", found, expected, help)
}

/// The columns with these names.
fn header<'a>(place: &str, names: impl Iterator<Item = &'a str>) -> Result<Vec<Column>, SpecError> {
    let tables = table::ALL.into_iter().chain(table::REDUCED.map(|(_, table)| table));
    let taken: Vec<&str> = tables.flat_map(|table| table.columns()).map(|column| column.name).chain([STATUS]).collect();
    let mut columns: Vec<Column> = Vec::new();
    for name in names {
        let quantity = Quantity::from_name(name);
        if name.is_empty() {
            let found = format!("{place}: column {} has no name", columns.len() + 1);
            return Err(fault(
                found,
                "a name for each column",
                "name it, or remove it; pandas: to_csv(..., index=False)",
            ));
        }
        if columns.iter().any(|other| other.name == name) {
            let found = format!("{place}: duplicate column `{name}`");
            return Err(fault(found, "each column once", "rename it, or remove it"));
        }
        if quantity.is_none() && name.contains([';', '\t', '\r']) {
            let found = format!("{place}: columns or lines that end with ; or a tab, in `{name}`");
            let help = "save it as CSV with commas and decimal points; commas in numbers are not decimal points";
            return Err(fault(found, "columns that end with commas, lines with newlines", help));
        }
        if name.chars().count() > MAX_LABEL_CHARS {
            let found = format!("{place}: a column with a name of {} characters", name.chars().count());
            return Err(fault(found, &format!("at most {MAX_LABEL_CHARS} characters"), "shorten the name"));
        }
        if quantity.is_none() && taken.iter().any(|taken| taken.eq_ignore_ascii_case(name)) {
            let found = format!("{place}: the label `{name}` has the name of a column of a table");
            return Err(fault(found, "a name that no table has", &format!("name it `{name}_label`")));
        }
        let cells = match quantity {
            Some(quantity) => Cells::Axis(quantity, Vec::new()),
            None => Cells::Label { words: IndexSet::new(), places: Vec::new(), has_text: false },
        };
        columns.push(Column { name: name.to_owned(), cells });
    }
    Ok(columns)
}
