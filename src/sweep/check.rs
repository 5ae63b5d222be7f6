//! The checked sweep: from a spec to a grid, tables and columns that are all legal, or a fault that says what is not.

use std::fmt::{self, Write};
use std::fs;
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::block::{block, too_many};
use super::error::{SpecError, unknown};
use super::place;
use super::spec::{Spec, TableSpec};
use super::units::units;
use crate::dataset::Identity;
use crate::grid::{Block, Factor, Grid, Projection, Quantity, RTOL, TooMany};
use crate::model::Units;
use crate::table::{self, OPTIMUM_AXES, Optima, STATUS, Selection, Table};

/// Most bytes of a spec: reading one takes about a hundred times as much memory.
const MOST_BYTES: u64 = 1 << 22;

/// Longest name, in bytes: names of files have at most 255.
pub(super) const LONGEST_NAME: usize = 200;

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
    /// The rows that tell all optimal problems of the tables that need them; `None` if none does.
    pub optimum_rows: Option<Projection>,
}

/// A table that is asked for.
pub struct Request {
    /// The table.
    pub table: &'static dyn Table,
    /// Its columns.
    pub selection: Selection,
    /// Its accuracy.
    pub rtol: f64,
    /// The number of its rows.
    pub rows: u64,
    /// Its rows.
    pub projection: Projection,
    /// Of a reduced table: the rows of the landscapes, those of one of its rows side by side.
    pub members: Option<Projection>,
    /// What the values of each column are multiplied by to be in the units of the grid.
    pub sizes: Vec<f64>,
}

impl Sweep {
    /// Reads and checks the spec in `path`.
    pub fn load(path: &Path) -> Result<Sweep, SpecError> {
        let fault = |found: String, expected: &str, help| SpecError::new("", found, expected, help).at(path, None);
        let unreadable = |error| fault(format!("cannot read: {error}"), "a readable TOML file", "check the path");
        let mut bytes = Vec::new();
        // A pipe tells no length before it is read.
        let read = fs::File::open(path).and_then(|file| file.take(MOST_BYTES + 1).read_to_end(&mut bytes));
        read.map_err(unreadable)?;
        if bytes.len() as u64 > MOST_BYTES {
            let expected = format!("a spec of at most {MOST_BYTES} bytes");
            return Err(fault("too long".to_owned(), &expected, "write lists of values as a file of `points`"));
        }
        let text = String::from_utf8(bytes).map_err(|error| unreadable(io::Error::other(error)))?;
        Sweep::parse_at(&text, path)
    }

    /// Reads and checks the spec in `text`, which stands in `path`.
    pub(crate) fn parse_at(text: &str, path: &Path) -> Result<Sweep, SpecError> {
        Sweep::parse(text, path.parent().unwrap_or(Path::new(""))).map_err(|error| {
            let line = error.line;
            error.at(path, line)
        })
    }

    /// Reads and checks the spec in `text`; files that it names are relative to `folder`.
    ///
    /// # Errors
    ///
    /// What is wrong with the spec, and in which line.
    pub fn parse(text: &str, folder: &Path) -> Result<Sweep, SpecError> {
        let spec = place::parse(text).map_err(|(error, line)| SpecError { line, ..error })?;
        Sweep::check(&spec, text, folder).map_err(|error| {
            let line = place::line(text, &error.key);
            SpecError { line, ..error }
        })
    }

    /// Checks `spec`, read from `text`; files that it names are relative to `folder`.
    pub fn check(spec: &Spec, text: &str, folder: &Path) -> Result<Sweep, SpecError> {
        check_name(&spec.name)?;
        let units = units(&spec.model)?;
        check_rtol("accuracy.rtol", spec.accuracy.rtol)?;
        let (grid, prefixes) = grid(spec, units, folder)?;
        let mut requests = Vec::new();
        for (name, table) in &spec.tables {
            requests.push(request(name, table, spec.accuracy.rtol, &grid, &prefixes)?);
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
        let needed = requests.iter().any(|request| request.table.needs_optimum(&request.selection));
        // A table that depends on nothing else has these very rows.
        let own = requests.iter().find(|request| request.table.axes() == OPTIMUM_AXES);
        let optimum_rows = match own {
            _ if !needed => None,
            Some(request) => Some(request.projection.clone()),
            None => grid.project(OPTIMUM_AXES).ok(),
        };
        Ok(Sweep {
            name: spec.name.clone(),
            description: spec.description.clone(),
            text: text.to_owned(),
            grid,
            bounded: spec.model.velocity_bound,
            requests,
            optimum_rows,
        })
    }

    /// What the dataset is made from.
    pub fn identity(&self) -> Identity {
        let mut hashed = Hashed(Sha256::new());
        // Never fails.
        let _ = self.canonical(&mut hashed);
        let spec_hash = hashed.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        Identity { spec_hash, version: env!("CARGO_PKG_VERSION").to_owned() }
    }

    /// Everything that the numbers depend on, in one way of writing it.
    fn canonical(&self, text: &mut impl Write) -> fmt::Result {
        writeln!(text, "velocity_bound {}", self.bounded)?;
        if let Units::Si(scales) = &self.grid.units {
            writeln!(text, "si {scales:?}")?;
        }
        for block in &self.grid.blocks {
            if self.grid.blocks.len() > 1 {
                writeln!(text, "block")?;
            }
            for factor in &block.factors {
                writeln!(text, "factor")?;
                for axis in &factor.axes {
                    let (name, unit) = (axis.quantity.name(), axis.quantity.unit(axis.scale));
                    writeln!(text, "axis {name} {unit} {:?}", axis.values)?;
                }
            }
            for derived in &block.derived {
                let (name, unit) = (derived.quantity.name(), derived.quantity.unit(derived.scale));
                writeln!(text, "computed {name} {unit} {:?}", derived.expression)?;
            }
            if let Some(condition) = &block.condition {
                writeln!(text, "where {condition:?}")?;
            }
        }
        for request in &self.requests {
            write!(text, "table {} rtol {:?}", request.table.name(), request.rtol)?;
            for &column in request.selection.indices() {
                write!(text, " {}", request.table.columns()[column].name)?;
            }
            writeln!(text)?;
        }
        Ok(())
    }

    /// Accuracy of the shared optimal protocols: the strictest of the tables that use them.
    pub fn optimum_rtol(&self) -> f64 {
        let users = self.requests.iter().filter(|request| request.table.needs_optimum(&request.selection));
        users.map(|request| request.rtol).fold(1.0, f64::min)
    }

    /// How many different optimal problems the tables that need them have; 0 if none does.
    pub fn optimum_tuples(&self) -> u64 {
        self.optimum_rows.as_ref().map_or(0, |rows| rows.distinct(OPTIMUM_AXES, Optima::MOST_KEPT))
    }

    /// An empty store for them.
    pub fn optima(&self) -> Optima {
        let span = self.optimum_rows.as_ref().map_or(0, |rows| rows.tuples(OPTIMUM_AXES).span());
        Optima::among(self.optimum_tuples(), span, self.bounded, self.optimum_rtol())
    }
}

/// The hash of a text that is never held as a whole: written out, the values of large files of points are many times as long.
struct Hashed(Sha256);

impl Write for Hashed {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text);
        Ok(())
    }
}

fn check_name(name: &str) -> Result<(), SpecError> {
    let legal = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if (1..=LONGEST_NAME).contains(&name.len()) && name.chars().all(legal) && !name.starts_with('.') {
        return Ok(());
    }
    Err(SpecError::new(
        "name",
        format!("`{name}` cannot name a folder"),
        format!("at most {LONGEST_NAME} letters, digits, '-', '_' and '.', the first not '.'"),
        "choose another name",
    ))
}

/// The blocks of `spec`, and what their keys begin with.
fn grid(spec: &Spec, units: Units, folder: &Path) -> Result<(Grid, Vec<String>), SpecError> {
    let top = spec.top();
    if spec.block.is_empty() {
        return Ok((Grid { blocks: vec![Arc::new(block(&top, "", &units, folder)?)], units }, vec![String::new()]));
    }
    let outside = [
        ("axes", !top.axes.is_empty()),
        ("points", top.points.is_some()),
        ("zip", !top.zip.is_empty()),
        ("where", top.condition.is_some()),
    ];
    if let Some((key, _)) = outside.into_iter().find(|(_, is_there)| *is_there) {
        return Err(SpecError::new(
            key,
            format!("`{key}` outside of the blocks"),
            "everything about the grid in [[block]]s, or no block",
            "move it into the blocks that it concerns",
        ));
    }
    let (mut blocks, mut prefixes) = (Vec::new(), Vec::new());
    for (number, one) in spec.block.iter().enumerate() {
        let prefix = format!("block[{number}].");
        blocks.push(Arc::new(block(one, &prefix, &units, folder)?));
        prefixes.push(prefix);
    }
    for quantity in Quantity::ALL {
        let scales = blocks.iter().enumerate().filter_map(|(number, block)| Some((number, block.scale(quantity)?)));
        let scales: Vec<_> = scales.collect();
        if let Some((number, scale)) = scales.iter().find(|(_, scale)| *scale != scales[0].1) {
            return Err(SpecError::new(
                format!("block[{number}].axes.{}", quantity.name()),
                format!(
                    "in units of \"{}\", but \"{}\" in block[{}]",
                    quantity.unit(*scale),
                    quantity.unit(scales[0].1),
                    scales[0].0
                ),
                "one unit, since all blocks share a column",
                "convert the values of one of them",
            ));
        }
    }
    Ok((Grid { blocks, units }, prefixes))
}

fn check_rtol(key: &str, rtol: f64) -> Result<(), SpecError> {
    if RTOL.contains(rtol) {
        return Ok(());
    }
    Err(SpecError::new(key, format!("{rtol:?} is out of range"), RTOL.text, "choose a value in the range"))
}

fn request(name: &str, spec: &TableSpec, rtol: f64, grid: &Grid, prefixes: &[String]) -> Result<Request, SpecError> {
    let key = format!("tables.{name}");
    let Some(written) = table::ALL.into_iter().find(|table| table.name() == name) else {
        return Err(unknown(key, "table", name, &table::ALL.map(|table| table.name())));
    };
    let table = reduced(written, &key, spec.reduce.as_deref())?;
    for (block, prefix) in grid.blocks.iter().zip(prefixes) {
        let Some(missing) = written.axes().iter().find(|axis| block.scale(**axis).is_none()) else { continue };
        let (place, axes) = match prefix.trim_end_matches('.') {
            "" => ("the spec", "[axes]"),
            block => (block, "its [block.axes]"),
        };
        return Err(SpecError::new(
            key,
            format!("needs the axis `{}`, which {place} does not have", missing.name()),
            format!("axes {}", written.axes().iter().map(|axis| axis.name()).collect::<Vec<_>>().join(", ")),
            format!("add `{} = ...` to {axes}, or remove the table", missing.name()),
        ));
    }
    let rtol = spec.rtol.or(table.default_rtol()).unwrap_or(rtol);
    check_rtol(&format!("{key}.rtol"), rtol)?;
    let selection = selection(table, &key, spec.columns.as_deref())?;
    let members = if spec.reduce.is_some() { Some(members(written, table, &key, grid)?) } else { None };
    let projection = grid.project(table.axes()).map_err(|error| match error {
        TooMany::Rows => SpecError::new(
            key,
            "more rows than 64 bits can count",
            "at most 2^64 - 1 rows",
            "take fewer values on its axes",
        ),
        TooMany::Combinations(block) => too_many(format!("{}where", prefixes[block])),
    })?;
    if let Some(empty) = projection.stretches().iter().position(|stretch| stretch.rows() == 0) {
        return Err(SpecError::new(
            format!("{}where", prefixes[empty]),
            "keeps no point at all",
            "a condition that some point meets",
            "correct the condition, or the axes that it reads",
        ));
    }
    let sizes = selection.indices().iter().map(|&column| table.columns()[column].size(grid)).collect();
    Ok(Request { table, selection, rtol, rows: projection.rows(), projection, members, sizes })
}

/// The table that `reduce` makes of `table`, or `table` without it.
fn reduced(table: &'static dyn Table, key: &str, reduce: Option<&str>) -> Result<&'static dyn Table, SpecError> {
    let Some(word) = reduce else { return Ok(table) };
    let key = format!("{key}.reduce");
    if table.name() != "gap" {
        return Err(SpecError::new(
            key,
            format!("`{}` cannot be reduced", table.name()),
            "tables.gap.reduce",
            "remove the key",
        ));
    }
    match table::REDUCED.into_iter().find(|(known, _)| *known == word) {
        Some((_, reduced)) => Ok(reduced),
        None => Err(unknown(key, "reduction", word, &table::REDUCED.map(|(known, _)| known))),
    }
}

/// The rows of `landscape` with those of each row of `reduced` side by side: its other axes are made the fastest.
fn members(landscape: &dyn Table, reduced: &dyn Table, key: &str, grid: &Grid) -> Result<Projection, SpecError> {
    let wrong = |found: &str, help: &str| {
        let expected = "one grid, in which alpha_2 and alpha_3 are axes of their own that nothing else depends on";
        SpecError::new(format!("{key}.reduce"), found, expected, help)
    };
    let fast: Vec<Quantity> = landscape.axes().iter().copied().filter(|axis| !reduced.axes().contains(axis)).collect();
    let [block] = grid.blocks.as_slice() else {
        return Err(wrong("a grid of several blocks", "write one spec a block"));
    };
    let is_fast = |factor: &Factor| factor.holds_any(&fast);
    if block.factors.iter().any(|factor| is_fast(factor) && factor.axes.len() > 1)
        || fast.iter().any(|axis| block.axis(*axis).is_none())
    {
        return Err(wrong("alpha_2 or alpha_3 varies together with another axis", "give it values of its own"));
    }
    let expressions = block.derived.iter().map(|derived| &derived.expression).chain(&block.condition);
    if expressions.flat_map(|expression| expression.reads()).any(|axis| fast.contains(&axis)) {
        return Err(wrong(
            "another axis or `where` depends on alpha_2 or alpha_3",
            "leave that out, or filter the full table",
        ));
    }
    let (last, first): (Vec<Factor>, Vec<Factor>) = block.factors.iter().cloned().partition(is_fast);
    let each = last.iter().map(Factor::len).fold(1, u64::saturating_mul);
    if reduced.name() == "gap_quantiles" && each > table::MOST_SORTED {
        return Err(SpecError::new(
            format!("{key}.reduce"),
            format!("quantiles of {each} shortcuts of each transition and time"),
            format!("at most {}, which are sorted in memory", table::MOST_SORTED),
            "take fewer values of alpha_2 and alpha_3, or reduce to \"min\" or \"histogram\"",
        ));
    }
    let ordered = Block { factors: first.into_iter().chain(last).collect(), ..Block::clone(block) };
    let projection = Grid { blocks: vec![Arc::new(ordered)], units: grid.units }.project(landscape.axes());
    projection.map_err(|_| wrong("more shortcuts than 64 bits can count", "take fewer values on the axes"))
}

fn selection(table: &dyn Table, key: &str, names: Option<&[String]>) -> Result<Selection, SpecError> {
    let known: Vec<&str> = table.columns().iter().map(|column| column.name).collect();
    let Some(names) = names else {
        return Ok(Selection::usual(table.columns()));
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
            "name columns, or remove `columns` to have the usual ones",
        ));
    }
    Ok(Selection::new(indices))
}
