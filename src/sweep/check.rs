//! The checked sweep: grid, tables and columns of a legal spec, or its faults.

use std::collections::HashMap;
use std::fs;
use std::io::{self, Read};
use std::iter;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use super::block::{self, too_many};
use super::error::{SpecError, all, refuse, unknown};
use super::laws;
use super::spec::{BlockSpec, Spec, TableSpec};
use super::units::{doubtful_axis, doubtful_scales, units};
use crate::file;
use crate::grid::{Block, Factor, Grid, Quantity, RTOL, RowIndex, TooMany};
use crate::model::{Friction, Units};
use crate::names::nearest;
use crate::table::{self, OPTIMUM_AXES, OptimumCache, Projection, STATUS, Table};

/// Greatest size of a spec, in bytes. Chosen: reading one takes about a hundred times this memory, 400 MiB.
const MAX_SPEC_BYTES: u64 = 1 << 22;

/// Greatest length of a name, in bytes. File names have at most 255 (`NAME_MAX` of Linux), and job scripts add a suffix.
pub(super) const MAX_NAME_BYTES: usize = 200;

/// A legal sweep.
pub struct Sweep {
    /// Name of the dataset.
    pub name: String,
    /// Description of the sweep.
    pub description: String,
    /// Its text.
    pub text: String,
    /// The folder of relative file names.
    pub folder: PathBuf,
    /// All points.
    pub grid: Grid,
    /// Whether optimal protocols obey `v >= 1`.
    pub bounded: bool,
    /// Form of the direct effect of friction.
    pub friction: Friction,
    /// The tables to write, in the order of the spec.
    pub requests: Vec<Request>,
    /// Rows that cover every optimal problem that is shared; `None` if there is none.
    pub optimum_rows: Option<RowIndex>,
    /// Warnings: legal input that is probably a mistake.
    pub warnings: Vec<SpecError>,
}

/// A requested table.
pub struct Request {
    /// The table.
    pub table: &'static Table,
    /// Its columns.
    pub projection: Projection,
    /// Its accuracy.
    pub rtol: f64,
    /// The number of its rows.
    pub rows: u64,
    /// Its rows.
    pub row_index: RowIndex,
    /// The landscape rows of a reduced table, contiguous for each of its rows.
    pub members: Option<RowIndex>,
    /// The hash of the inputs of its rows, once computed.
    pub(super) hash: OnceLock<String>,
}

/// Help for a path that cannot be read: the dataset of this name, or the nearest name with this ending in the same folder, if any.
pub fn path_hint(path: &Path, ending: &str) -> String {
    if path == Path::new("-") {
        return "standard input is not read: write it to a file".to_owned();
    }
    let dataset = Path::new("results").join(path);
    if ending.is_empty() && dataset.is_dir() {
        return format!("did you mean `{}`?", dataset.display());
    }
    let entries = fs::read_dir(file::folder_of(path)).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    let name = if ending.is_empty() { path.file_name() } else { path.file_stem() };
    let name = name.unwrap_or_default().to_string_lossy();
    match nearest(&name, names.iter().filter_map(|name| name.strip_suffix(ending))) {
        Some(name) => format!("did you mean `{}`?", path.with_file_name(format!("{name}{ending}")).display()),
        None => "check the path".to_owned(),
    }
}

impl Sweep {
    /// Reads and checks the spec in `path`.
    ///
    /// # Errors
    ///
    /// The faults of the file or spec, with their lines.
    pub fn load(path: &Path) -> Result<Sweep, SpecError> {
        let text = file::open(path).and_then(|file| file::text(file.take(MAX_SPEC_BYTES + 1)));
        let text = text.map_err(|error| {
            let help = match error.kind() {
                io::ErrorKind::NotFound => path_hint(path, ".toml"),
                io::ErrorKind::InvalidData => "save it as UTF-8 in the editor".to_owned(),
                _ => "name a readable file".to_owned(),
            };
            SpecError::new("", format!("cannot read: {error}"), "a readable TOML file", help).of(path)
        })?;
        if text.len() as u64 > MAX_SPEC_BYTES {
            let expected = format!("a spec of at most {MAX_SPEC_BYTES} bytes");
            let help = "write lists of values as a file of `points`";
            return Err(SpecError::new("", "too long", expected, help).of(path));
        }
        Sweep::parse_at(&text, path)
    }

    /// Reads and checks the spec in `text`, the content of `path`.
    pub(crate) fn parse_at(text: &str, path: &Path) -> Result<Sweep, SpecError> {
        let parsed = Sweep::parse(text, path.parent().unwrap_or(Path::new("")));
        let mut sweep = parsed.map_err(|error| error.of(path))?;
        sweep.warnings = sweep.warnings.into_iter().map(|warning| warning.of(path)).collect();
        Ok(sweep)
    }

    /// Reads and checks the spec in `text`; files that it names are relative to `folder`.
    ///
    /// # Errors
    ///
    /// The faults of the spec, with their lines.
    pub fn parse(text: &str, folder: &Path) -> Result<Sweep, SpecError> {
        match Spec::recovered(text) {
            Ok(spec) => Sweep::check(&spec, text, folder),
            Err(faulty) => {
                let (faults, spec) = *faulty;
                // Without an axis, a scale or the name, other faults may follow.
                let is_needed = |fault: &SpecError| {
                    fault.key.contains("axes") || fault.key.starts_with("model") || &*fault.key == "name"
                };
                let spec = spec.filter(|_| !iter::once(&faults).chain(&faults.others).any(is_needed));
                let others = spec.and_then(|spec| independent(&spec, folder).err());
                Err(match others {
                    Some(others) => SpecError::and(Some(faults), others.located(text)),
                    None => faults,
                })
            }
        }
    }

    /// Checks `spec`, read from `text`; files that it names are relative to `folder`.
    ///
    /// # Errors
    ///
    /// The faults of the spec, with their lines.
    pub fn check(spec: &Spec, text: &str, folder: &Path) -> Result<Sweep, SpecError> {
        let located = |fault: SpecError| fault.located(text);
        let (grid, friction) = independent(spec, folder).map_err(located)?;
        let requests = spec.tables.iter().map(|(name, table)| request(name, table, spec, friction, &grid));
        let requests = all(requests).map_err(located)?;
        let warnings = doubtful_scales(&spec.model).into_iter().chain(unused(spec, &grid, &requests));
        // A condition may drop the points outside.
        let unconditional = spec.blocks().zip(&grid.blocks).filter(|(_, block)| block.condition.is_none());
        let axes = unconditional.flat_map(|((prefix, _), block)| {
            let axes = block.factors.iter().flat_map(|factor| &factor.axes);
            axes.map(move |axis| (format!("{prefix}axes.{}", axis.quantity.name()), axis))
        });
        let warnings = warnings.chain(axes.filter_map(|(key, axis)| doubtful_axis(key, &grid.units, axis)));
        Ok(Sweep {
            name: spec.name.clone(),
            description: spec.description.clone(),
            text: text.to_owned(),
            folder: folder.to_owned(),
            bounded: spec.model.velocity_bound && friction == Friction::Log,
            friction,
            optimum_rows: optimum_rows(&grid, &requests),
            warnings: warnings.map(located).collect(),
            requests,
            grid,
        })
    }

    /// Relative accuracy of the shared optimal protocols: the tightest of the tables that use them.
    pub fn optimum_rtol(&self) -> f64 {
        let users = self.requests.iter().filter(|request| request.needs_optimum(&self.grid));
        users.map(|request| request.rtol).fold(1.0, f64::min)
    }

    /// The number of different optimal problems that are shared.
    pub fn optimum_tuples(&self) -> u64 {
        self.optimum_rows.as_ref().map_or(0, |rows| rows.distinct(OPTIMUM_AXES, OptimumCache::MAX_CACHED))
    }

    /// An empty optimum cache for each table. Tables of one accuracy share it, so no table depends on the accuracy of another.
    pub fn optimum_cache(&self) -> Vec<Arc<OptimumCache>> {
        // Every row index numbers the tuples of all blocks alike.
        let users = self.requests.iter().filter(|request| request.needs_optimum(&self.grid));
        let span = users.map(|request| request.row_index.tuples(OPTIMUM_AXES).span()).max().unwrap_or(0);
        let tuples = self.optimum_tuples();
        let mut caches: HashMap<u64, Arc<OptimumCache>> = HashMap::new();
        let cache = |request: &Request| {
            if !request.needs_optimum(&self.grid) {
                return Arc::new(OptimumCache::new(0, 0));
            }
            let new = || Arc::new(OptimumCache::new(tuples, span));
            caches.entry(request.rtol.to_bits()).or_insert_with(new).clone()
        };
        self.requests.iter().map(cache).collect()
    }
}

impl Request {
    /// The request of `table` over `row_index`.
    pub(super) fn new(
        table: &'static Table,
        projection: Projection,
        rtol: f64,
        row_index: RowIndex,
        members: Option<RowIndex>,
    ) -> Request {
        Request { table, projection, rtol, rows: row_index.rows(), row_index, members, hash: OnceLock::new() }
    }

    /// Whether the table needs optimal protocols that are shared.
    pub fn needs_optimum(&self, grid: &Grid) -> bool {
        grid.blocks.iter().any(|block| self.table.needs_optimum(&self.projection, block))
    }
}

/// Warnings on axes of the spec that no table has, and that neither a computed axis nor the condition reads; and on ceilings that some tables lack.
fn unused(spec: &Spec, grid: &Grid, requests: &[Request]) -> Vec<SpecError> {
    let gap = |request: &Request| request.members.as_ref().and_then(|_| table::find("gap"));
    let tables: Vec<&Table> =
        requests.iter().flat_map(|request| [Some(request.table), gap(request)]).flatten().collect();
    // The best shortcut has the units of these axes.
    let has_best = tables.iter().any(|table| table.name() == "best_cubic");
    let mut warnings = Vec::new();
    for ((prefix, written), block) in spec.blocks().zip(&grid.blocks) {
        let expressions = block.derived.iter().map(|derived| &derived.expression).chain(&block.condition);
        let read: Vec<Quantity> = expressions.flat_map(|expression| expression.reads()).collect();
        for quantity in written.axes.keys().filter_map(|name| Quantity::from_name(name)) {
            let has = |table: &Table| table.axes().contains(&quantity);
            let is_ceiling = matches!(quantity, Quantity::VelocityCeiling | Quantity::FrictionCeiling)
                && block.may_be(quantity, f64::is_finite);
            let is_used = tables.iter().any(|table| has(table));
            // A ceiling also changes the optimum with which a table compares, unless the table lacks it.
            let lacks = |table: &&&Table| !has(table) && (!is_used || is_ceiling && is_of_optimum(table));
            let lacking: Vec<&Table> = tables.iter().filter(lacks).copied().collect();
            if lacking.is_empty() || !is_used && (read.contains(&quantity) || has_best && quantity.has_scale()) {
                continue;
            }
            let names = |tables: &[&Table]| tables.iter().map(|table| table.name()).collect::<Vec<_>>().join(", ");
            let others: Vec<&Table> = table::ALL.into_iter().filter(|table| has(table)).collect();
            let (expected, help) = if is_used {
                ("numbers under the ceiling", "these tables ignore it; their protocols may exceed it".to_owned())
            } else {
                let help = format!("remove it, or add a table that has it: {}", names(&others));
                ("an axis of a requested table", help)
            };
            let (key, found) =
                (format!("{prefix}axes.{}", quantity.name()), format!("no effect on {}", names(&lacking)));
            warnings.push(SpecError::new(key, found, expected, help));
        }
    }
    warnings
}

/// Whether numbers of a table are those of an optimum, or compared with one.
fn is_of_optimum(table: &Table) -> bool {
    table.columns().iter().any(|column| matches!(column.name, "work_optimal" | "t_cross"))
}

/// Rows that cover every optimal problem that is shared; `None` if there is none.
fn optimum_rows(grid: &Grid, requests: &[Request]) -> Option<RowIndex> {
    let needs = |block: &Block| requests.iter().any(|request| request.table.needs_optimum(&request.projection, block));
    let blocks: Vec<Arc<Block>> = grid.blocks.iter().filter(|block| needs(block)).cloned().collect();
    if blocks.is_empty() {
        return None;
    }
    Grid { blocks, units: grid.units }.project(OPTIMUM_AXES).ok()
}

/// Whether `name` is legal for a dataset.
///
/// # Errors
///
/// The rule that the name violates.
pub fn check_name(name: &str) -> Result<(), SpecError> {
    let legal = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if (1..=MAX_NAME_BYTES).contains(&name.len()) && name.chars().all(legal) && !name.starts_with('.') {
        return Ok(());
    }
    let expected = format!("at most {MAX_NAME_BYTES} letters from a to z, digits, '-', '_' and '.', the first not '.'");
    refuse("name", format!("`{name}` cannot name a folder"), expected, "choose another name")
}

/// The help for a spec without a name.
const HELP_FOR_NO_NAME: &str = "write it at the top, such as name = \"my_sweep\"; it names the folder of the dataset";

/// The grid and the form of friction of `spec`, after the checks that do not depend on each other.
fn independent(spec: &Spec, folder: &Path) -> Result<(Grid, Friction), SpecError> {
    let (mut known_units, mut friction, mut grid) = (Units::Scaled, Friction::default(), Vec::new());
    let axes = units(&spec.model).and_then(|units| {
        known_units = units;
        grid = blocks(spec, &units, folder)?;
        Ok(())
    });
    let form = laws::friction(&spec.model).map(|form| friction = form);
    let name = check_name(&spec.name).map_err(|fault| match spec.name.as_str() {
        "" => SpecError { found: "missing or empty".into(), help: HELP_FOR_NO_NAME.into(), ..fault },
        _ => fault,
    });
    all([name, axes, check_rtol("accuracy.rtol", spec.accuracy.rtol), form, check_tables(spec)])?;
    Ok((Grid { blocks: grid.into_iter().map(Arc::new).collect(), units: known_units }, friction))
}

/// The blocks of `spec`.
fn blocks(spec: &Spec, units: &Units, folder: &Path) -> Result<Vec<Block>, SpecError> {
    if !spec.block.is_empty() && spec.top != BlockSpec::default() {
        let help = "move axes, points, zip and where into the blocks that they concern";
        return refuse(
            "block",
            "keys of the grid outside of the blocks",
            "the whole grid in [[block]]s, or no block",
            help,
        );
    }
    let mut blocks = all(spec.blocks().map(|(prefix, one)| block::check(one, &prefix, units, folder)))?;
    for quantity in Quantity::ALL {
        let Some((first, usual)) = blocks.iter().enumerate().find_map(|(at, block)| Some((at, block.scale(quantity)?)))
        else {
            continue;
        };
        for (number, block) in blocks.iter_mut().enumerate() {
            match block.scale(quantity) {
                Some(scale) if scale != usual => {
                    let key = format!("block[{number}].axes.{}", quantity.name());
                    let [scale, usual] = [scale, usual].map(|scale| quantity.unit(scale));
                    let found = format!("in units of \"{scale}\", but \"{usual}\" in block[{first}]");
                    let expected = "one unit, since all blocks share a column";
                    return refuse(key, found, expected, "convert the values of one of them");
                }
                // All blocks share the column of a tacit axis.
                None if quantity.is_tacit() => block.factors.push(Factor::usual(quantity)),
                _ => {}
            }
        }
    }
    Ok(blocks)
}

pub(super) fn check_rtol(key: &str, rtol: f64) -> Result<(), SpecError> {
    if RTOL.contains(rtol) {
        return Ok(());
    }
    refuse(key, format!("{rtol:?} is out of range"), RTOL.to_string(), "choose a value in the range")
}

/// Checks that `spec` requests tables, and none that is unknown.
fn check_tables(spec: &Spec) -> Result<(), SpecError> {
    if spec.tables.is_empty() {
        let expected = format!("at least one of {}", table::ALL.map(|table| table.name()).join(", "));
        return refuse("tables", "no table is requested", expected, "add a line such as [tables.optimal]");
    }
    all(spec.tables.keys().map(|name| table_of(name))).map(|_| ())
}

/// The table `name` of a spec, before any reduction.
fn table_of(name: &str) -> Result<&'static Table, SpecError> {
    let known = table::ALL.map(|table| table.name());
    let place = known.iter().position(|known| *known == name);
    place.map(|place| table::ALL[place]).ok_or_else(|| unknown(format!("tables.{name}"), "table", name, &known))
}

/// The table `name` of `spec`, requested as `table_spec`, over its rows of `grid`.
fn request(
    name: &str,
    table_spec: &TableSpec,
    spec: &Spec,
    friction: Friction,
    grid: &Grid,
) -> Result<Request, SpecError> {
    let key = format!("tables.{name}");
    let written = table_of(name)?;
    let has_ceiling = grid.blocks.iter().any(|block| block.may_be(Quantity::VelocityCeiling, f64::is_finite));
    let has_laws = has_ceiling || grid.blocks.iter().any(|block| block.scale(Quantity::Law).is_some());
    // A reduced table is one of ageing, without ceilings.
    let written = table::over(written, has_laws && table_spec.reduce.is_none());
    if has_ceiling && table_spec.reduce.is_some() {
        let (found, help) = ("a reduction supports no velocity ceiling", "remove the axis v_ceiling, or this key");
        return refuse(format!("{key}.reduce"), found, "no v_ceiling", help);
    }
    let table = reduced(written, &key, table_spec.reduce.as_deref())?;
    let columns = table_spec.columns.as_deref();
    for ((prefix, _), block) in spec.blocks().zip(&grid.blocks) {
        laws::check(&key, table, block, spec.model.velocity_bound)?;
        if friction == Friction::Regularised {
            laws::check_regularised(&key, written, columns, block)?;
        }
        let is_missing = |axis: &&Quantity| !axis.is_tacit() && block.scale(**axis).is_none();
        let missing: Vec<&str> = written.axes().iter().filter(is_missing).map(|axis| axis.name()).collect();
        if !missing.is_empty() {
            let place = if prefix.is_empty() { "the spec" } else { prefix.trim_end_matches('.') };
            let found = format!("needs {}, which {place} does not have", missing.join(", "));
            let help = format!("add {} = ... to its axes, or remove the table", missing.join(" = ..., "));
            return refuse(key, found, expected_axes(written.axes()), help);
        }
    }
    let rtol = spec.rtol_of(table.name());
    check_rtol(&format!("{key}.rtol"), rtol)?;
    let projection = projection(table, &key, columns)?;

    let members = if written.name() == table.name() { None } else { Some(members(written, table, &key, grid)?) };
    let prefix = |block: usize| spec.blocks().nth(block).map_or_else(String::new, |(prefix, _)| prefix);
    let row_index = grid.project(table.axes()).map_err(|error| match error {
        TooMany::Rows => too_many_rows(key),
        TooMany::Combinations(block) => too_many(format!("{}where", prefix(block))),
    })?;
    if let Some(empty) = row_index.blocks().iter().position(|block_rows| block_rows.rows() == 0) {
        let help = "correct the condition, or the axes in it; a computed axis that is NaN meets no condition";
        return refuse(
            format!("{}where", prefix(empty)),
            "matches no points",
            "a condition that some point meets",
            help,
        );
    }
    Ok(Request::new(table, projection, rtol, row_index, members))
}

/// The fault of a table at `key` with too many rows.
pub(super) fn too_many_rows(key: String) -> SpecError {
    let help = "take fewer values on its axes";
    SpecError::new(key, "more rows than 64 bits can count", "at most 2^64 - 1 rows", help)
}

/// The words for the axes that a table takes.
pub(super) fn expected_axes(axes: &[Quantity]) -> String {
    let (required, optional): (Vec<Quantity>, Vec<Quantity>) = axes.iter().partition(|axis| axis.default().is_empty());
    let listed = |axes: &[Quantity]| axes.iter().map(|axis| axis.name()).collect::<Vec<_>>().join(", ");
    let optional = if optional.is_empty() { String::new() } else { format!("; optional: {}", listed(&optional)) };
    format!("axes {}{optional}", listed(&required))
}

/// The reduction of `table` that the key `reduce` names, or `table`.
fn reduced(table: &'static Table, key: &str, reduce: Option<&str>) -> Result<&'static Table, SpecError> {
    let Some(word) = reduce else { return Ok(table) };
    let key = format!("{key}.reduce");
    if table.name() != "gap" {
        return refuse(key, format!("`{}` cannot be reduced", table.name()), "tables.gap.reduce", "remove the key");
    }
    match table::REDUCED.into_iter().find(|(known, _)| *known == word) {
        Some((_, reduced)) => Ok(reduced),
        None => Err(unknown(key, "reduction", word, &table::REDUCED.map(|(known, _)| known))),
    }
}

/// The rows of `landscape`, contiguous for each row of `reduced`: its further axes vary fastest.
fn members(landscape: &Table, reduced: &Table, key: &str, grid: &Grid) -> Result<RowIndex, SpecError> {
    let wrong = |found: &str, help: &str| {
        let expected = "one grid in which alpha_2 and alpha_3 are independent axes";
        SpecError::new(format!("{key}.reduce"), found, expected, help)
    };
    let fast: Vec<Quantity> = landscape.axes().iter().copied().filter(|axis| !reduced.axes().contains(axis)).collect();
    let [block] = grid.blocks.as_slice() else {
        return Err(wrong("a grid of several blocks", "write one spec per block"));
    };
    let is_fast = |factor: &Factor| factor.holds_any(&fast);
    let expressions = block.derived.iter().map(|derived| &derived.expression).chain(&block.condition);
    if block.factors.iter().any(|factor| is_fast(factor) && factor.axes.len() > 1)
        || fast.iter().any(|axis| block.axis(*axis).is_none())
        || expressions.flat_map(|expression| expression.reads()).any(|axis| fast.contains(&axis))
    {
        let found = "alpha_2 or alpha_3 depends on another axis, or another axis or `where` on it";
        return Err(wrong(found, "remove that dependence, or filter the full table"));
    }
    let (last, first): (Vec<Factor>, Vec<Factor>) = block.factors.iter().cloned().partition(is_fast);
    let each = last.iter().map(Factor::len).fold(1, u64::saturating_mul);
    if reduced.name() == "gap_quantiles" && each > table::MAX_SORTED {
        let found = format!("quantiles of {each} shortcuts for each transition and duration");
        let expected = format!("at most {}, which are sorted in memory", table::MAX_SORTED);
        let help = "take fewer values of alpha_2 and alpha_3, or reduce to \"min\" or \"histogram\"";
        return refuse(format!("{key}.reduce"), found, expected, help);
    }
    let ordered = Block { factors: first.into_iter().chain(last).collect(), ..Block::clone(block) };
    let row_index = Grid { blocks: vec![Arc::new(ordered)], units: grid.units }.project(landscape.axes());
    row_index.map_err(|_| wrong("more shortcuts than 64 bits can count", "take fewer values on the axes"))
}

/// The columns with these names, or the default ones.
pub(super) fn projection(table: &Table, key: &str, names: Option<&[String]>) -> Result<Projection, SpecError> {
    let known: Vec<&str> = table.columns().iter().map(|column| column.name).collect();
    let Some(names) = names else {
        return Ok(Projection::usual(table.columns()));
    };
    let mut indices = Vec::new();
    // Axes and the status are always written.
    let is_written = |name: &str| name == STATUS || table.axes().iter().any(|axis| axis.name() == name);
    for (place, name) in names.iter().enumerate().filter(|(_, name)| !is_written(name)) {
        let key = format!("{key}.columns[{place}]");
        match known.iter().position(|column| column == name) {
            Some(index) if indices.contains(&index) => {
                return refuse(key, format!("`{name}` is a duplicate"), "each column once", "remove one of the two");
            }
            Some(index) => indices.push(index),
            None => return Err(unknown(key, "column", name, &known)),
        }
    }
    if indices.is_empty() {
        let expected = format!("at least one of {}", known.join(", "));
        let help = "name columns, or remove `columns` for the default ones";
        return refuse(format!("{key}.columns"), "no column is requested", expected, help);
    }
    Ok(Projection::new(indices))
}
