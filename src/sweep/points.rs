//! The points file: its columns are axes that vary together, and labels.

use std::borrow::Cow;
use std::fmt::{self, Display, Formatter};
use std::fs;
use std::path::Path;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, ArrowPrimitiveType};
use arrow_schema::DataType;
use indexmap::IndexSet;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use super::error::{MAX_NAME_CHARS, SpecError, unknown};
use crate::dataset::{coded, guarded, label};
use crate::grid::{Axis, Factor, Label, Quantity, Scale, Values};
use crate::model::Units;
use crate::names::shown;
use crate::protocol::Status;
use crate::table::{self, STATUS};

/// Reads the points of a CSV or Parquet file. Values are in `units`; coefficients are not relative to `t_f`.
///
/// # Errors
///
/// A file that cannot be read, an unknown column, or an illegal value.
pub fn read(path: &Path, units: &Units) -> Result<Factor, SpecError> {
    let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
    let columns = match extension.as_ref().and_then(|extension| extension.to_str()) {
        Some("csv") => csv(path, units)?,
        // A panic of the reader on a damaged file is a fault of the file.
        Some("parquet") => guarded(|| parquet(path, units)).unwrap_or_else(|| Err(unsound(path, &"it is damaged")))?,
        _ => {
            let (expected, help) = ("a file whose name ends in .csv or .parquet", "write the points as CSV");
            return Err(fault(format!("{}: neither CSV nor Parquet", path.display()), expected, help));
        }
    };
    if columns.iter().all(|column| column.is_empty()) {
        let (expected, help) = ("axis names and at least one point", "add points, or remove `points`");
        return Err(fault(format!("{}: no points", path.display()), expected, help));
    }
    let mut factor = Factor::default();
    for Column { name, cells } in columns {
        match cells {
            Cells::Axis(quantity, values) => {
                factor.axes.push(Axis { quantity, scale: Scale::Model, values: Values::List(values) });
            }
            Cells::Label(cells) if cells.has_text => {
                factor.labels.push(Label { name, words: cells.words.into_iter().collect(), places: cells.places });
            }
            Cells::Label(_) => return Err(unknown_column(&path.display(), &name)),
        }
    }
    Ok(factor)
}

/// Greatest number of points. Chosen: the values of all 16 quantities take 512 MiB of memory.
const MAX_POINTS: usize = 1 << 22;

/// Greatest size of a file, in bytes: 64 for each of [`MAX_POINTS`].
const MAX_FILE_BYTES: u64 = 1 << 28;

/// Checks that the file fits into memory: a regular file of at most [`MAX_FILE_BYTES`].
fn check_size(path: &Path) -> Result<(), SpecError> {
    let file = fs::metadata(path).map_err(|error| unreadable(path, &error))?;
    if !file.is_file() {
        return Err(unreadable(path, &"not a file"));
    }
    if file.len() > MAX_FILE_BYTES {
        let found = format!("{}: {} bytes", path.display(), file.len());
        return Err(fault(found, &format!("at most {MAX_FILE_BYTES} bytes"), "take fewer points, or several sweeps"));
    }
    Ok(())
}

/// Checks the number of points against [`MAX_POINTS`].
fn check_count(path: &Path, count: usize) -> Result<(), SpecError> {
    if count <= MAX_POINTS {
        return Ok(());
    }
    let found = format!("{}: more than {MAX_POINTS} points", path.display());
    Err(fault(found, &format!("at most {MAX_POINTS}"), "take fewer points, or several sweeps"))
}

/// A column of a file of points.
struct Column {
    name: String,
    cells: Cells,
}

/// The values of a column.
enum Cells {
    /// Values of an axis.
    Axis(Quantity, Vec<f64>),
    /// Labels, if the column has text.
    Label(Texts),
}

/// A dictionary-encoded text column: the distinct texts, and the index of each point; `None` for an empty cell.
#[derive(Default)]
struct Texts {
    words: IndexSet<String>,
    places: Vec<Option<u32>>,
    /// Whether a text is not a number.
    has_text: bool,
}

impl Texts {
    /// Adds the cell of a point; an empty one is missing.
    fn push(&mut self, place: impl Fn() -> String, cell: &str) -> Result<(), SpecError> {
        if cell.is_empty() {
            self.places.push(None);
            return Ok(());
        }
        let number = match self.words.get_index_of(cell) {
            Some(number) => number,
            None => {
                let length = cell.chars().count();
                if length > MAX_LABEL_CHARS {
                    let (expected, help) = (format!("at most {MAX_LABEL_CHARS}"), "shorten the label");
                    return Err(fault(format!("{}: a label of {length} characters", place()), &expected, help));
                }
                if cell.contains(char::is_control) {
                    let found = format!("{}: a label with a line break or another control character", place());
                    return Err(fault(found, "one line of text", "correct the label"));
                }
                self.has_text |= cell.parse::<f64>().is_err();
                self.words.insert_full(cell.to_owned()).0
            }
        };
        self.places.push(Some(number as u32));
        Ok(())
    }
}

/// Greatest length of a label, in characters. Chosen: it fits the legend of a picture.
const MAX_LABEL_CHARS: usize = 200;

/// Reads CSV: a header of names, then one line for each point. Skips empty lines and lines that begin with #.
fn csv(path: &Path, units: &Units) -> Result<Vec<Column>, SpecError> {
    check_size(path)?;
    let bytes = fs::read(path).map_err(|error| unreadable(path, &error))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let place = Line { file: path, number: 1 + before.iter().filter(|&&byte| byte == b'\n').count() };
        fault(format!("{place}: not in UTF-8"), "CSV in UTF-8", "save it as CSV in UTF-8")
    })?;
    // Spreadsheets write a byte order mark.
    let mut lines = text
        .trim_start_matches('\u{feff}')
        .lines()
        .enumerate()
        .map(|(index, line)| (Line { file: path, number: index + 1 }, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let mut columns = match lines.next() {
        Some((place, line)) => header(&place, cells_of(&place, line)?.iter().map(AsRef::as_ref))?,
        None => Vec::new(),
    };
    for (count, (place, line)) in lines.enumerate() {
        check_count(path, count + 1)?;
        point(&place, line, units, &mut columns)?;
    }
    Ok(columns)
}

/// The cells of a line of CSV, quoted or not.
fn cells_of<'a>(place: &Line<'_>, line: &'a str) -> Result<Vec<Cow<'a, str>>, SpecError> {
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
        let mut end = quoted.find('"');
        while let Some(place) = end.filter(|place| quoted[place + 1..].starts_with('"')) {
            end = quoted[place + 2..].find('"').map(|next| place + 2 + next);
        }
        let after = end.map(|end| (&quoted[..end], quoted[end + 1..].trim_start()));
        let Some((cell, after)) = after.filter(|(_, after)| after.is_empty() || after.starts_with(',')) else {
            let cell = line.split(',').next().unwrap_or(line).trim_end();
            let found = format!("{place}: the quote in `{}` is not closed", shown(cell, MAX_NAME_CHARS));
            return Err(fault(found, "quotes around a whole cell", "close the quote, or remove it"));
        };
        cells.push(cell.replace("\"\"", "\"").trim().to_owned().into());
        rest = after.strip_prefix(',');
    }
    Ok(cells)
}

fn unsound(path: &Path, error: &dyn Display) -> SpecError {
    let found = format!("cannot read {}: {error}", path.display());
    fault(
        found,
        "a Parquet file, uncompressed or with Snappy or Zstandard",
        "write it in one of these forms, or as CSV",
    )
}

/// Reads Parquet: numbers, or text for axes of words and for labels.
fn parquet(path: &Path, units: &Units) -> Result<Vec<Column>, SpecError> {
    let name = path.display();
    check_size(path)?;
    let unsound = |error: &dyn Display| unsound(path, error);
    let file = fs::File::open(path).map_err(|error| unreadable(path, &error))?;
    let metadata = coded(&file).map_err(|error| unsound(&error))?;
    let reader = ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata);
    let rows = reader.metadata().file_metadata().num_rows();
    check_count(path, usize::try_from(rows).unwrap_or(0))?;
    let mut columns = header(&name, reader.schema().fields().iter().map(|field| field.name().as_str()))?;
    for (column, field) in columns.iter().zip(reader.schema().fields()) {
        column.check_type(&name, field.data_type())?;
    }
    let reader = reader.with_batch_size(BATCH_ROWS).build().map_err(|error| unsound(&error))?;
    let mut first = 0;
    for batch in reader {
        let batch = batch.map_err(|error| unsound(&error))?;
        check_count(path, first + batch.num_rows())?;
        for (column, array) in columns.iter_mut().zip(batch.columns()) {
            column.extend(&name, first, array, units)?;
        }
        first += batch.num_rows();
    }
    Ok(columns)
}

impl Column {
    fn is_empty(&self) -> bool {
        match &self.cells {
            Cells::Axis(_, values) => values.is_empty(),
            Cells::Label(texts) => texts.places.is_empty(),
        }
    }

    /// Checks the type of the column of `file` against its name.
    fn check_type(&self, file: &impl Display, kind: &DataType) -> Result<(), SpecError> {
        let is_text = *kind == label();
        let wrong = |expected: &str, help: &str| {
            let held = if is_text { "words".to_owned() } else { kind.to_string() };
            Err(fault(format!("{file}: column `{}` holds {held}", self.name), expected, help))
        };
        match &self.cells {
            Cells::Axis(quantity, _) if !quantity.words().is_empty() && !is_text => {
                wrong("words", "write the column as text")
            }
            Cells::Axis(..) if !kind.is_numeric() => wrong("numbers", "write the column as numbers"),
            Cells::Label(_) if !is_text => Err(unknown_column(file, &self.name)),
            _ => Ok(()),
        }
    }

    /// Adds the rows of a batch that begins at row `first` of `file`.
    fn extend(&mut self, file: &impl Display, first: usize, array: &ArrayRef, units: &Units) -> Result<(), SpecError> {
        let name = &self.name;
        let place = |row: usize| format!("{file}: row {} of column `{name}`", first + row);
        let (quantity, values) = match &mut self.cells {
            Cells::Label(texts) => {
                let mut cells = texts_of(array).enumerate();
                return cells.try_for_each(|(row, cell)| texts.push(|| place(row), cell.unwrap_or_default().trim()));
            }
            Cells::Axis(quantity, values) => (*quantity, values),
        };
        let words = quantity.words();
        if let Some(row) = (0..array.len()).find(|&row| array.is_null(row)) {
            let expected = if words.is_empty() { "a number" } else { "a word" };
            return Err(fault(format!("{}: no value", place(row)), expected, "fill in the value"));
        }
        if !words.is_empty() {
            for (row, cell) in texts_of(array).enumerate() {
                values.push(word(|| place(row), &words, cell.unwrap_or_default())?);
            }
            return Ok(());
        }
        let Some(numbers) = numbers(array) else {
            let found = format!("{file}: column `{name}` holds {}", array.data_type());
            return Err(fault(found, "numbers", "write the column as floating-point numbers"));
        };
        for (row, value) in numbers.into_iter().enumerate() {
            values.push(legal(|| place(row), units, quantity, value)?);
        }
        Ok(())
    }
}

/// The cells of a column of text.
fn texts_of(column: &ArrayRef) -> impl Iterator<Item = Option<&str>> {
    let column = column.as_dictionary_opt::<Int32Type>();
    let words = column.and_then(|column| column.values().as_string_opt::<i32>());
    let cell = move |key: Option<i32>| words.zip(key).map(|(words, key)| words.value(key as usize));
    column.into_iter().flat_map(|column| column.keys()).map(cell)
}

/// Rows of a record batch. Chosen: a column of them fits a cache of 512 KiB.
const BATCH_ROWS: usize = 1 << 16;

/// The values of a column of numbers, none of them null; `None` for decimals and halves.
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
    fault(found, "a readable file", "check the path; it is relative to the spec")
}

/// `value` if it is legal for `quantity`.
fn legal(place: impl Fn() -> String, units: &Units, quantity: Quantity, value: f64) -> Result<f64, SpecError> {
    match super::units::legal(units, quantity, Scale::Model, value) {
        Ok(()) => Ok(value),
        Err(range) => Err(fault(format!("{}: {value:?} is out of range", place()), &range, "correct the value")),
    }
}

/// The index of `cell` among `words`.
fn word(place: impl Fn() -> String, words: &[&str], cell: &str) -> Result<f64, SpecError> {
    match words.iter().position(|word| *word == cell) {
        Some(number) => Ok(number as f64),
        None => {
            let found = format!("{}: unknown word `{}`", place(), shown(cell, MAX_NAME_CHARS));
            Err(fault(found, &words.join(", "), "correct the word"))
        }
    }
}

fn fault(found: impl Into<Box<str>>, expected: &str, help: &str) -> SpecError {
    SpecError::new("points", found, expected, help)
}

/// The fault of a column that is neither an axis nor a label.
fn unknown_column(place: &impl Display, name: &str) -> SpecError {
    let error = unknown("points".to_owned(), "axis", name, &Quantity::ALL.map(Quantity::name));
    let expected = format!("{}; or a label, a column of text", error.expected);
    let help = match error.help.strip_prefix("did you mean") {
        _ if super::units::UNIT_KEYS.contains(&name) => {
            "scales belong to [model]: write a spec for each material, or convert the points to dimensionless values"
                .into()
        }
        Some(_) => error.help,
        None => "remove the column; for a label, write text, or quotes around the number, such as \"17\"".into(),
    };
    SpecError { found: format!("{place}: {}", error.found).into(), expected: expected.into(), help, ..error }
}

/// Whether `name` is probably a misspelt axis.
fn is_misspelt(name: &str) -> bool {
    let plain = |name: &str| name.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase();
    let name = plain(name);
    // A letter away from a symbol is another symbol.
    let is_near = |axis: String| axis == name || axis.len() > 2 && strsim::damerau_levenshtein(&axis, &name) <= 1;
    Quantity::ALL.iter().map(|axis| plain(axis.name())).any(is_near)
}

/// Whether `name` is reserved in tables or in SQL.
fn is_taken(name: &str) -> bool {
    let tables = table::ALL.into_iter().chain(table::REDUCED.map(|(_, table)| table));
    let columns = tables.flat_map(|table| table.columns()).map(|column| column.name);
    let status = Status::ALL.into_iter().map(Status::name);
    columns.chain(status).chain([STATUS]).any(|taken| taken.eq_ignore_ascii_case(name))
}

fn header<'a>(place: &impl Display, names: impl Iterator<Item = &'a str>) -> Result<Vec<Column>, SpecError> {
    let mut columns: Vec<Column> = Vec::new();
    for (number, name) in names.enumerate() {
        if name.is_empty() {
            let found = format!("{place}: column {} has no name", number + 1);
            let expected = "the name of an axis or label over every column";
            return Err(fault(found, expected, "name it, or remove the column"));
        }
        let quantity = Quantity::from_name(name);
        if quantity.is_none() {
            if let Some(separator) = name.chars().find(|c| matches!(c, ';' | '\t' | '\r')) {
                let found = format!("{place}: columns or lines that end with {separator:?}");
                return Err(fault(found, "columns that end with commas, lines with newlines", "save it as such CSV"));
            }
            if is_taken(name) {
                let found = format!("{place}: the label `{name}` has the name of a column or status of a table");
                return Err(fault(found, "a name that no table has", &format!("name it `{name}_label`")));
            }
            if name.len() > MAX_NAME_CHARS || name.contains(char::is_control) || is_misspelt(name) {
                return Err(unknown_column(place, name));
            }
        }
        if columns.iter().any(|other| other.name == name) {
            let found = format!("{place}: column `{name}` is a duplicate");
            return Err(fault(found, "each column once", "remove one of the two"));
        }
        let label = || Cells::Label(Texts::default());
        let cells = quantity.map_or_else(label, |quantity| Cells::Axis(quantity, Vec::new()));
        columns.push(Column { name: name.to_owned(), cells });
    }
    Ok(columns)
}

/// A line of a file, formatted lazily for messages.
struct Line<'a> {
    file: &'a Path,
    number: usize,
}

impl Display for Line<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file.display(), self.number)
    }
}

fn point(place: &Line<'_>, line: &str, units: &Units, columns: &mut [Column]) -> Result<(), SpecError> {
    let texts = cells_of(place, line)?;
    if texts.len() != columns.len() {
        let count = |n: usize, noun: &str| format!("{n} {noun}{}", if n == 1 { "" } else { "s" });
        let found = format!("{place}: {} for {}", count(texts.len(), "value"), count(columns.len(), "column"));
        return Err(fault(found, "a value for each column", "correct the line"));
    }
    for (Column { name, cells }, cell) in columns.iter_mut().zip(texts) {
        let place = || format!("{place}: column `{name}`");
        match cells {
            Cells::Label(texts) => {
                // A cell in quotes is text, also if it reads as a number.
                texts.has_text |= matches!(cell, Cow::Owned(_)) && !cell.is_empty();
                texts.push(place, &cell)?;
            }
            Cells::Axis(quantity, values) => {
                let words = quantity.words();
                if !words.is_empty() {
                    values.push(word(place, &words, &cell)?);
                    continue;
                }
                let Ok(value) = cell.parse::<f64>() else {
                    let found = format!("{}: `{}` is not a number", place(), shown(&cell, MAX_NAME_CHARS));
                    return Err(fault(found, "a number such as 0.03 or 1e-3", "correct the value"));
                };
                values.push(legal(place, units, *quantity, value)?);
            }
        }
    }
    Ok(())
}
