//! The checked sweep: from a spec to a grid, tables and columns that are all legal, or a fault that says what is not.

use std::fs;
use std::path::Path;

use sha2::{Digest, Sha256};

use super::error::{SpecError, unknown};
use super::spec::{AxisForm, AxisSpec, AxisValue, Spec, TableSpec};
use super::{place, points};
use crate::dataset::Identity;
use crate::grid::{Axis, Factor, Grid, Quantity, RTOL, Scale, Values};
use crate::table::{self, OPTIMUM_AXES, STATUS, Selection, Table};

/// A sweep that is known to be legal.
pub struct Sweep {
    /// Name of the dataset.
    pub name: String,
    /// What it is for.
    pub description: String,
    /// The text that it was read from.
    pub text: String,
    /// All points.
    pub grid: Grid,
    /// Whether optimal protocols obey `v >= 1`.
    pub bounded: bool,
    /// The tables to write, in the order of the spec.
    pub requests: Vec<Request>,
}

/// A table that is asked for.
pub struct Request {
    /// The table.
    pub table: &'static dyn Table,
    /// Its columns.
    pub selection: Selection,
    /// Its accuracy.
    pub rtol: f64,
    /// Its rows.
    pub rows: u64,
}

impl Sweep {
    /// Reads and checks the spec in `path`.
    pub fn load(path: &Path) -> Result<Sweep, SpecError> {
        let text = fs::read_to_string(path).map_err(|error| {
            SpecError::new("", format!("cannot read: {error}"), "a readable TOML file", "check the path").at(path, None)
        })?;
        let spec = place::parse(&text).map_err(|(error, line)| error.at(path, line))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Sweep::check(&spec, &text, folder).map_err(|error| {
            let line = place::line(&text, &error.key);
            error.at(path, line)
        })
    }

    /// Checks `spec`, read from `text`; files that it names are relative to `folder`.
    pub fn check(spec: &Spec, text: &str, folder: &Path) -> Result<Sweep, SpecError> {
        check_name(&spec.name)?;
        refuse_later_features(spec)?;
        check_rtol("accuracy.rtol", spec.accuracy.rtol)?;
        let grid = grid(spec, folder)?;
        let mut requests = Vec::new();
        for (name, table) in &spec.tables {
            requests.push(request(name, table, spec.accuracy.rtol, &grid)?);
        }
        if requests.is_empty() {
            let known = table::ALL.map(|table| table.name());
            return Err(SpecError::new(
                "tables",
                "no table is asked for",
                format!("at least one of {}", known.join(", ")),
                "add a line such as [tables.optimal]",
            ));
        }
        Ok(Sweep {
            name: spec.name.clone(),
            description: spec.description.clone(),
            text: text.to_owned(),
            grid,
            bounded: spec.model.velocity_bound,
            requests,
        })
    }

    /// What the dataset is made from.
    pub fn identity(&self) -> Identity {
        let spec_hash = Sha256::digest(self.canonical()).iter().map(|byte| format!("{byte:02x}")).collect();
        Identity { spec_hash, version: env!("CARGO_PKG_VERSION").to_owned() }
    }

    /// Everything that the numbers depend on, in one way of writing it.
    fn canonical(&self) -> String {
        let mut text = format!("velocity_bound {}\n", self.bounded);
        for factor in &self.grid.factors {
            text.push_str("factor\n");
            for axis in &factor.axes {
                let (name, unit) = (axis.quantity.name(), axis.quantity.unit(axis.scale));
                text.push_str(&format!("axis {name} {unit} {:?}\n", axis.values));
            }
        }
        for request in &self.requests {
            text.push_str(&format!("table {} rtol {:?}", request.table.name(), request.rtol));
            for &column in request.selection.indices() {
                text.push_str(&format!(" {}", request.table.columns()[column].name));
            }
            text.push('\n');
        }
        text
    }

    /// Accuracy of the shared optimal protocols: the strictest of the tables that use them.
    pub fn optimum_rtol(&self) -> f64 {
        let users = self.requests.iter().filter(|request| request.table.needs_optimum(&request.selection));
        users.map(|request| request.rtol).fold(1.0, f64::min)
    }

    /// How many different optimal problems the tables that need them have; 0 if none does.
    pub fn optimum_tuples(&self) -> u64 {
        let needed = self.requests.iter().any(|request| request.table.needs_optimum(&request.selection));
        let projection = self.grid.project(OPTIMUM_AXES).filter(|_| needed);
        projection.map_or(0, |projection| projection.tuples(OPTIMUM_AXES).count())
    }
}

fn check_name(name: &str) -> Result<(), SpecError> {
    let legal = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if !name.is_empty() && name.chars().all(legal) && !name.starts_with('.') {
        return Ok(());
    }
    Err(SpecError::new(
        "name",
        format!("`{name}` cannot name a folder"),
        "letters, digits, '-', '_' and '.', the first not '.'",
        "choose another name",
    ))
}

/// Parts of the contract that this version does not have.
fn refuse_later_features(spec: &Spec) -> Result<(), SpecError> {
    let mut used: Vec<(String, &str)> = Vec::new();
    for (key, value, instead) in [
        ("zip", &spec.zip, "write such axes as columns of a `points` file"),
        ("where", &spec.condition, "leave it out and filter the table"),
        ("block", &spec.block, "write one spec a grid"),
    ] {
        if value.is_some() {
            used.push((key.to_owned(), instead));
        }
    }
    for (name, axis) in &spec.axes {
        let AxisSpec::Form(form) = axis else { continue };
        for (key, value) in [("expr", &form.expr), ("sobol", &form.sobol), ("lhs", &form.lhs), ("seed", &form.seed)] {
            if value.is_some() {
                used.push((format!("axes.{name}.{key}"), "write the values as a list or in a `points` file"));
            }
        }
    }
    if let Some((key, instead)) = used.into_iter().next() {
        let word = key.rsplit('.').next().unwrap_or(&key).to_owned();
        return Err(SpecError::new(
            key,
            format!("`{word}` is not available in version {}", env!("CARGO_PKG_VERSION")),
            "points, numbers, lists, linspace, geomspace",
            instead,
        ));
    }
    match spec.model.units.as_str() {
        "dimensionless" => Ok(()),
        "si" => Err(SpecError::new(
            "model.units",
            format!("\"si\" is not available in version {}", env!("CARGO_PKG_VERSION")),
            "\"dimensionless\"",
            "give scaled values",
        )),
        other => Err(SpecError::new(
            "model.units",
            format!("unknown unit system {other:?}"),
            "\"dimensionless\"",
            "correct it",
        )),
    }
}

fn check_rtol(key: &str, rtol: f64) -> Result<(), SpecError> {
    if RTOL.contains(rtol) {
        return Ok(());
    }
    Err(SpecError::new(key, format!("{rtol:?} is out of range"), RTOL.text, "choose a value in the range"))
}

fn grid(spec: &Spec, folder: &Path) -> Result<Grid, SpecError> {
    let mut factors = Vec::new();
    if let Some(path) = &spec.points {
        factors.push(points::read(&folder.join(path))?);
    }
    for (name, axis) in &spec.axes {
        let Some(quantity) = Quantity::from_name(name) else {
            return Err(unknown(format!("axes.{name}"), "axis", name, &Quantity::ALL.map(Quantity::name)));
        };
        let axis = self::axis(quantity, axis)?;
        if factors.iter().flat_map(|factor: &Factor| &factor.axes).any(|other| other.quantity == quantity) {
            return Err(SpecError::new(
                format!("axes.{name}"),
                format!("`{name}` is also a column of `points`"),
                "each axis once",
                "remove the axis here or the column there",
            ));
        }
        factors.push(Factor { axes: vec![axis] });
    }
    for quantity in Quantity::ALL {
        let held = factors.iter().flat_map(|factor| &factor.axes).any(|axis| axis.quantity == quantity);
        let values = quantity.default();
        if !held && !values.is_empty() {
            factors.push(Factor { axes: vec![Axis { quantity, scale: Scale::Model, values: Values::List(values) }] });
        }
    }
    Ok(Grid { factors })
}

fn axis(quantity: Quantity, spec: &AxisSpec) -> Result<Axis, SpecError> {
    let key = format!("axes.{}", quantity.name());
    let words = quantity.words();
    let (scale, values) = match spec {
        AxisSpec::One(AxisValue::Word(word)) if words.is_empty() => {
            return Err(SpecError::new(key, format!("found string {word:?}"), AXIS, "change the value"));
        }
        AxisSpec::One(one) => (Scale::Model, Values::List(vec![value(quantity, &words, &key, one)?])),
        AxisSpec::List(values) => {
            if values.is_empty() {
                return Err(SpecError::new(
                    key,
                    "an empty list",
                    "at least one value",
                    "add values, or remove the axis",
                ));
            }
            let values = values.iter().enumerate();
            let values = values.map(|(index, one)| value(quantity, &words, &format!("{key}[{index}]"), one));
            (Scale::Model, Values::List(values.collect::<Result<_, _>>()?))
        }
        AxisSpec::Form(_) if !words.is_empty() => {
            let expected = format!("one or a list of {}", quoted(&words));
            return Err(SpecError::new(key, "a range", expected, "write the words as a list"));
        }
        AxisSpec::Form(form) => (scale(quantity, &key, form)?, range(quantity, &key, form)?),
    };
    Ok(Axis { quantity, scale, values })
}

/// What an axis of numbers may be.
const AXIS: &str = "a number, a list of numbers or a range such as { linspace = [first, last, count] }";

fn quoted(words: &[&str]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}

/// One value: a number in its range, or the place of a word among `words`.
fn value(quantity: Quantity, words: &[&str], key: &str, value: &AxisValue) -> Result<f64, SpecError> {
    match value {
        AxisValue::Word(word) if !words.is_empty() => match words.iter().position(|known| known == word) {
            Some(place) => Ok(place as f64),
            None => Err(unknown(key.to_owned(), quantity.name(), word, words)),
        },
        AxisValue::Word(word) => {
            Err(SpecError::new(key, format!("found string {word:?}"), "a number", "change the value"))
        }
        AxisValue::Number(number) if !words.is_empty() => Err(SpecError::new(
            key,
            format!("found {number:?}"),
            format!("one of {}", quoted(words)),
            "write the word in quotes",
        )),
        AxisValue::Number(number) if quantity.domain().contains(*number) => Ok(*number),
        AxisValue::Number(number) => Err(SpecError::new(
            key,
            format!("{number:?} is out of range"),
            quantity.domain().text,
            "choose values in the range",
        )),
    }
}

fn scale(quantity: Quantity, key: &str, form: &AxisForm) -> Result<Scale, SpecError> {
    let Some(unit) = &form.unit else { return Ok(Scale::Model) };
    let known: &[Scale] = if quantity.has_scale() { &[Scale::Duration, Scale::Model] } else { &[Scale::Model] };
    known.iter().copied().find(|scale| quantity.unit(*scale) == unit).ok_or_else(|| {
        let units: Vec<String> = known.iter().map(|scale| format!("\"{}\"", quantity.unit(*scale))).collect();
        SpecError::new(
            format!("{key}.unit"),
            format!("unknown unit {unit:?}"),
            units.join(" or "),
            "correct the unit, or remove it",
        )
    })
}

fn range(quantity: Quantity, key: &str, form: &AxisForm) -> Result<Values, SpecError> {
    let (name, numbers) = match (&form.linspace, &form.geomspace) {
        (Some(numbers), None) => ("linspace", numbers),
        (None, Some(numbers)) => ("geomspace", numbers),
        (Some(_), Some(_)) => {
            return Err(SpecError::new(key, "both linspace and geomspace", "one of them", "remove one of the two"));
        }
        (None, None) => {
            return Err(SpecError::new(
                key,
                "a table without a range",
                "{ linspace = [first, last, count] } or { geomspace = [first, last, count] }",
                "add a range, or write a number or a list",
            ));
        }
    };
    let key = format!("{key}.{name}");
    let &[first, last, count] = numbers.as_slice() else {
        return Err(SpecError::new(
            key,
            format!("{} values", numbers.len()),
            "[first, last, count]",
            "give exactly three values",
        ));
    };
    for (index, end) in [first, last].into_iter().enumerate() {
        if !(end.is_finite() && quantity.domain().contains(end)) {
            let legal = if end.is_finite() { quantity.domain().text } else { "finite ends" };
            return Err(SpecError::new(
                format!("{key}[{index}]"),
                format!("{end:?} is out of range"),
                legal,
                "choose values in the range",
            ));
        }
    }
    // Beyond 2^53 a double no longer tells whole numbers apart.
    if !(2.0..=9_007_199_254_740_992.0).contains(&count) || count.fract() != 0.0 {
        return Err(SpecError::new(
            format!("{key}[2]"),
            format!("{count} is not a count of values"),
            "a whole number from 2 to 2^53",
            "for one value write the number itself",
        ));
    }
    if first == last {
        return Err(SpecError::new(
            key,
            "first and last are the same",
            "a range",
            "for one value write the number itself",
        ));
    }
    let count = count as u64;
    if name == "linspace" {
        return Ok(Values::Linspace { first, last, count });
    }
    if first == 0.0 || last == 0.0 || (first < 0.0) != (last < 0.0) {
        return Err(SpecError::new(
            key,
            format!("from {first:?} to {last:?} passes through zero"),
            "ends of the same sign, neither 0",
            "use linspace, or a range on one side of zero",
        ));
    }
    Ok(Values::Geomspace { first, last, count })
}

fn request(name: &str, spec: &TableSpec, rtol: f64, grid: &Grid) -> Result<Request, SpecError> {
    let key = format!("tables.{name}");
    let Some(table) = table::find(name) else {
        return Err(unknown(key, "table", name, &table::ALL.map(|table| table.name())));
    };
    if let Some(missing) = table.axes().iter().find(|axis| grid.axis(**axis).is_none()) {
        return Err(SpecError::new(
            key,
            format!("needs the axis `{}`, which the spec does not have", missing.name()),
            format!("axes {}", table.axes().iter().map(|axis| axis.name()).collect::<Vec<_>>().join(", ")),
            format!("add `{} = ...` to [axes], or remove the table", missing.name()),
        ));
    }
    let rtol = spec.rtol.or(table.default_rtol()).unwrap_or(rtol);
    check_rtol(&format!("{key}.rtol"), rtol)?;
    let selection = selection(table, &key, spec.columns.as_deref())?;
    let Some(rows) = grid.project(table.axes()).map(|projection| projection.rows()) else {
        return Err(SpecError::new(
            key,
            "more rows than 64 bits can count",
            "at most 2^64 - 1 rows",
            "take fewer values on its axes",
        ));
    };
    Ok(Request { table, selection, rtol, rows })
}

fn selection(table: &dyn Table, key: &str, names: Option<&[String]>) -> Result<Selection, SpecError> {
    let known: Vec<&str> = table.columns().iter().map(|column| column.name).collect();
    let Some(names) = names else {
        return Ok(Selection::new((0..known.len()).filter(|&column| !table.columns()[column].optional).collect()));
    };
    let mut indices = Vec::new();
    for (place, name) in names.iter().enumerate() {
        let key = format!("{key}.columns[{place}]");
        if name == STATUS {
            continue;
        }
        let Some(index) = known.iter().position(|column| column == name) else {
            return Err(unknown(key, "column", name, &known));
        };
        if indices.contains(&index) {
            return Err(SpecError::new(
                key,
                format!("`{name}` is there twice"),
                "each column once",
                "remove one of the two",
            ));
        }
        indices.push(index);
    }
    if indices.is_empty() {
        return Err(SpecError::new(
            format!("{key}.columns"),
            "no column is asked for",
            format!("at least one of {}", known.join(", ")),
            "name columns, or remove `columns` to have all",
        ));
    }
    Ok(Selection::new(indices))
}
