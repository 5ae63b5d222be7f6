//! The checked sweep: grid, tables and columns of a legal spec, or its faults.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use super::block::{self, Checked, too_many};
use super::error::{Faults, SpecError, refuse, unknown};
use super::friction;
use super::laws;
use super::read;
use super::spec::{Spec, TableSpec};
use super::units::{UNIT_KEYS, doubtful_axes, doubtful_scales, units};
use crate::file;
use crate::grid::{Axis, Block, Factor, Grid, Quantity, RTOL, RowIndex, Scale, TooMany, Values};
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
    /// The factor of each column from the units of the model to those of the grid.
    pub sizes: Vec<f64>,
}

/// Help for a path that cannot be read: the dataset of this name, or the nearest name with this ending in the same folder, if any.
pub fn path_hint(path: &Path, ending: &str) -> String {
    let dataset = Path::new("results").join(path);
    if ending.is_empty() && dataset.is_dir() {
        return format!("did you mean `{}`?", dataset.display());
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
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
        let fault = |found: String, expected: &str, help: &str| SpecError::new("", found, expected, help).of(path);
        let mut bytes = Vec::new();
        let read = file::open(path).and_then(|file| file.take(MAX_SPEC_BYTES + 1).read_to_end(&mut bytes));
        read.map_err(|error| match error.kind() {
            io::ErrorKind::InvalidInput => {
                fault(error.to_string(), "a TOML file", "write the spec to a file, and name that file")
            }
            kind => {
                let hint = path_hint(path, ".toml");
                let help = if kind == io::ErrorKind::NotFound { &hint } else { "check its permissions" };
                fault(format!("cannot read: {error}"), "a readable TOML file", help)
            }
        })?;
        if bytes.len() as u64 > MAX_SPEC_BYTES {
            let expected = format!("a spec of at most {MAX_SPEC_BYTES} bytes");
            return Err(fault("too long".to_owned(), &expected, "write lists of values as a file of `points`"));
        }
        let text = String::from_utf8(bytes).map_err(|error| {
            let (start, bytes) = (error.utf8_error().valid_up_to(), error.as_bytes());
            let line = 1 + bytes[..start].iter().filter(|&&byte| byte == b'\n').count();
            let found = format!("not UTF-8: the byte 0x{:02x}", bytes.get(start).copied().unwrap_or_default());
            SpecError { line: Some(line), ..fault(found, "a spec in UTF-8", "save as UTF-8 in the editor") }
        })?;
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
        let mut faults = Faults::default();
        let spec = read::read(text, &mut faults)?;
        Sweep::checked(&spec, text, folder, faults)
    }

    /// Checks `spec`, read from `text`; files that it names are relative to `folder`.
    ///
    /// # Errors
    ///
    /// The faults of the spec, with their lines.
    pub fn check(spec: &Spec, text: &str, folder: &Path) -> Result<Sweep, SpecError> {
        Sweep::checked(spec, text, folder, Faults::default())
    }

    /// Checks `spec`; `faults` are those found on reading.
    fn checked(spec: &Spec, text: &str, folder: &Path, mut faults: Faults) -> Result<Sweep, SpecError> {
        faults.take(check_name(&spec.name));
        let is_any_wrong = UNIT_KEYS.iter().any(|key| faults.concern(&format!("model.{key}")));
        let units = if is_any_wrong { None } else { faults.take(units(&spec.model)) };
        faults.take(check_rtol("accuracy.rtol", spec.accuracy.rtol));
        let friction = faults.take(friction::friction(&spec.model)).unwrap_or_default();
        let mut blocks = blocks(spec, units.as_ref(), folder, &mut faults);
        let tables = tables(spec, friction, &mut blocks, &mut faults);
        faults.finish(text)?;

        // Every key is legal by itself.
        let prefixes: Vec<String> = blocks.iter().map(|block| block.prefix.clone()).collect();
        let blocks = blocks.into_iter().filter_map(|block| block.block).map(Arc::new).collect();
        let grid = Grid { blocks, units: units.unwrap_or_default() };
        let placed = |fault| {
            let mut faults = [fault];
            read::find_lines(text, &mut faults);
            let [fault] = faults;
            fault
        };
        let requests = tables.into_iter().map(|table| request(table, &grid, &prefixes).map_err(placed));
        let requests = requests.collect::<Result<Vec<Request>, _>>()?;
        let optimum_rows = optimum_rows(&grid, &requests);
        let mut warnings = doubtful_scales(&spec.model);
        warnings.extend(unused(spec, &grid, &requests));
        for (prefix, block) in prefixes.iter().zip(&grid.blocks) {
            let axes = block.factors.iter().flat_map(|factor| &factor.axes);
            // A condition may drop the points outside.
            if block.condition.is_none() {
                warnings.extend(doubtful_axes(prefix, &grid.units, axes));
            }
        }
        read::find_lines(text, &mut warnings);
        Ok(Sweep {
            name: spec.name.clone(),
            description: spec.description.clone(),
            text: text.to_owned(),
            folder: folder.to_owned(),
            grid,
            bounded: spec.model.velocity_bound && friction == Friction::Log,
            friction,
            requests,
            optimum_rows,
            warnings,
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
        let mut stores: Vec<(u64, Arc<OptimumCache>)> = Vec::new();
        let store = |request: &Request| {
            if !request.needs_optimum(&self.grid) {
                return Arc::new(OptimumCache::new(0, 0));
            }
            let key = request.rtol.to_bits();
            if let Some((_, store)) = stores.iter().find(|(known, _)| *known == key) {
                return store.clone();
            }
            let store = Arc::new(OptimumCache::new(tuples, span));
            stores.push((key, store.clone()));
            store
        };
        self.requests.iter().map(store).collect()
    }
}

impl Request {
    /// Whether the table needs optimal protocols that are shared.
    pub fn needs_optimum(&self, grid: &Grid) -> bool {
        grid.blocks.iter().any(|block| self.table.needs_optimum(&self.projection, block))
    }

    /// Whether it has numbers of an optimum that knows nothing of the axis `quantity`.
    fn compares_without(&self, quantity: Quantity) -> bool {
        let mut names = self.projection.indices().iter().map(|&column| self.table.columns()[column].name);
        let is_of_optimum = |name: &str| name == "work_optimal" || name.starts_with("gap");
        !self.table.axes().contains(&quantity) && (self.table.name() == "crossover" || names.any(is_of_optimum))
    }
}

/// Warnings on axes of the spec that no table has, and that neither a computed axis nor the condition reads, and on ceilings of which the optimum of
/// a table knows nothing.
fn unused(spec: &Spec, grid: &Grid, requests: &[Request]) -> Vec<SpecError> {
    let tables = |request: &Request| [Some(request.table), request.members.as_ref().and_then(|_| table::find("gap"))];
    let tables: Vec<&Table> = requests.iter().flat_map(tables).flatten().collect();
    // The best shortcut has the units of these axes.
    let has_best = tables.iter().any(|table| table.name() == "best_cubic");
    let of_table = |quantity: Quantity| tables.iter().any(|table| table.axes().contains(&quantity));
    let mut warnings = Vec::new();
    for ((prefix, written), block) in spec.blocks().zip(&grid.blocks) {
        let expressions = block.derived.iter().map(|derived| &derived.expression).chain(&block.condition);
        let read: Vec<Quantity> = expressions.flat_map(|expression| expression.reads()).collect();
        for quantity in written.axes.keys().filter_map(|name| Quantity::from_name(name)) {
            let others = table::ALL.into_iter().filter(|table| table.axes().contains(&quantity));
            let others = others.map(|table| table.name()).collect::<Vec<_>>().join(", ");
            let is_ceiling = matches!(quantity, Quantity::VelocityCeiling | Quantity::FrictionCeiling);
            let is_used = of_table(quantity) || read.contains(&quantity) || (has_best && quantity.has_scale());
            let (names, expected, help): (Vec<&str>, _, _) = if !is_used {
                let help = format!("remove it, or add a table that has it: {others}");
                (tables.iter().map(|table| table.name()).collect(), "an axis of a requested table".to_owned(), help)
            } else if is_ceiling && block.may_be(quantity, f64::is_finite) {
                let free = requests.iter().filter(|request| request.compares_without(quantity));
                let help = format!("compare their optimum with rows of the others where {} = inf", quantity.name());
                (free.map(|request| request.table.name()).collect(), format!("tables that have it: {others}"), help)
            } else {
                continue;
            };
            if !names.is_empty() {
                let (key, found) =
                    (format!("{prefix}axes.{}", quantity.name()), format!("no effect on {}", names.join(", ")));
                warnings.push(SpecError::new(key, found, expected, help));
            }
        }
    }
    warnings
}

/// Rows that cover every optimal problem that is shared; `None` if there is none.
fn optimum_rows(grid: &Grid, requests: &[Request]) -> Option<RowIndex> {
    let needs = |block: &Block| requests.iter().any(|request| request.table.needs_optimum(&request.projection, block));
    let blocks: Vec<Arc<Block>> = grid.blocks.iter().filter(|block| needs(block)).cloned().collect();
    if blocks.is_empty() {
        return None;
    }
    // A table with these axes alone has the rows of the optimum.
    let own = requests.iter().find(|request| request.table.axes() == OPTIMUM_AXES);
    match own.filter(|_| blocks.len() == grid.blocks.len()) {
        Some(request) => Some(request.row_index.clone()),
        None => Grid { blocks, units: grid.units }.project(OPTIMUM_AXES).ok(),
    }
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

/// The blocks of `spec`.
fn blocks(spec: &Spec, units: Option<&Units>, folder: &Path, faults: &mut Faults) -> Vec<Checked> {
    let top = &spec.top;
    let outside = [
        ("axes", !top.axes.is_empty()),
        ("points", top.points.is_some()),
        ("zip", !top.zip.is_empty()),
        ("where", top.condition.is_some()),
    ];
    for (key, _) in outside.into_iter().filter(|(_, is_there)| *is_there && !spec.block.is_empty()) {
        let (found, expected) =
            (format!("`{key}` outside of the blocks"), "everything about the grid in [[block]]s, or no block");
        faults.push(SpecError::new(key, found, expected, "move it into the blocks that it concerns"));
    }
    let mut blocks: Vec<Checked> =
        spec.blocks().map(|(prefix, one)| block::check(one, prefix, units, folder, faults)).collect();
    complete(&mut blocks);
    for quantity in Quantity::ALL {
        let scale = |checked: &Checked| checked.block.as_ref()?.scale(quantity);
        let mut scales = blocks.iter().enumerate().filter_map(|(number, block)| Some((number, scale(block)?)));
        let Some((first, usual)) = scales.next() else { continue };
        if let Some((number, scale)) = scales.find(|(_, scale)| *scale != usual) {
            let (key, units) =
                (format!("block[{number}].axes.{}", quantity.name()), [scale, usual].map(|scale| quantity.unit(scale)));
            let found = format!("in units of \"{}\", but \"{}\" in block[{first}]", units[0], units[1]);
            let help = "convert the values of one of them";
            faults.push(SpecError::new(key, found, "one unit, since all blocks share a column", help));
        }
    }
    blocks
}

/// Adds the default of a tacit axis to the other blocks if one block names it: all blocks share the column.
fn complete(blocks: &mut [Checked]) {
    for quantity in Quantity::ALL.into_iter().filter(|quantity| quantity.is_tacit()) {
        let (with, without): (Vec<_>, Vec<_>) = blocks
            .iter_mut()
            .filter_map(|checked| checked.block.as_mut())
            .partition(|block| block.scale(quantity).is_some());
        for block in without.into_iter().filter(|_| !with.is_empty()) {
            let axis = Axis { quantity, scale: Scale::Model, values: Values::List(quantity.default()) };
            block.factors.push(Factor { axes: vec![axis], ..Factor::default() });
        }
    }
}

pub(super) fn check_rtol(key: &str, rtol: f64) -> Result<(), SpecError> {
    if RTOL.contains(rtol) {
        return Ok(());
    }
    refuse(key, format!("{rtol:?} is out of range"), RTOL.text, "choose a value in the range")
}

/// A table of a spec with legal keys.
struct TableDraft {
    /// Its name in the spec.
    name: String,
    /// The table with the rows.
    written: &'static Table,
    /// The table to write: this table or its reduction.
    table: &'static Table,
    projection: Projection,
    rtol: f64,
}

/// The tables of `spec`. A missing axis is reported once.
fn tables(spec: &Spec, friction: Friction, blocks: &mut [Checked], faults: &mut Faults) -> Vec<TableDraft> {
    if spec.tables.is_empty() && !faults.concern("tables") {
        let expected = format!("at least one of {}", table::ALL.map(|table| table.name()).join(", "));
        faults.push(SpecError::new("tables", "no table is requested", expected, "add a line such as [tables.optimal]"));
    }
    let model = (spec.accuracy.rtol, spec.model.velocity_bound, friction);
    spec.tables.iter().filter_map(|(name, table)| draft(name, table, model, blocks, faults)).collect()
}

fn draft(
    name: &str,
    spec: &TableSpec,
    (rtol, is_bounded, friction): (f64, bool, Friction),
    blocks: &mut [Checked],
    faults: &mut Faults,
) -> Option<TableDraft> {
    let key = format!("tables.{name}");
    let Some(written) = table::ALL.into_iter().find(|table| table.name() == name) else {
        faults.push(unknown(key, "table", name, &table::ALL.map(|table| table.name())));
        return None;
    };
    let is_reduction_known = !faults.concern(&format!("{key}.reduce"));
    let has_ceiling = |block: &Block| block.may_be(Quantity::VelocityCeiling, f64::is_finite);
    let has_ceiling = blocks.iter().filter_map(|block| block.block.as_ref()).any(has_ceiling);
    let has_laws = has_ceiling || blocks.iter().any(|block| block.held.contains(&Quantity::Law));
    // A reduced table is one of ageing, without ceilings.
    let written = table::over(written, has_laws && spec.reduce.is_none());
    if has_ceiling && spec.reduce.is_some() {
        let (found, help) = ("a reduction supports no velocity ceiling", "remove the axis v_ceiling, or this key");
        faults.push(SpecError::new(format!("{key}.reduce"), found, "no v_ceiling", help));
    }
    let table = faults.take(reduced(written, &key, spec.reduce.as_deref()));
    for block in blocks {
        if let Some(grid) = &block.block {
            faults.take(laws::check(&key, table.unwrap_or(written), grid, &block.prefix, is_bounded));
            faults.take(friction::check(&key, written, spec.columns.as_deref(), grid, friction));
        }
        let is_missing = |axis: &Quantity| !axis.is_tacit() && !block.held.contains(axis);
        let missing: Vec<Quantity> = written.axes().iter().copied().filter(is_missing).collect();
        if !missing.is_empty() {
            faults.push(lacks(&key, written, &block.prefix, &missing));
            block.held.extend(missing);
        }
    }
    let table = table?;
    let rtol = spec.rtol.or(table.default_rtol()).unwrap_or(rtol);
    if spec.rtol.is_some() {
        faults.take(check_rtol(&format!("{key}.rtol"), rtol));
    }
    // The columns are those of the reduced table.
    let projection = projection(table, &key, spec.columns.as_deref().filter(|_| is_reduction_known), faults);
    Some(TableDraft { name: name.to_owned(), written, table, projection, rtol })
}

/// The fault of a table that lacks axes in the block of `prefix`.
fn lacks(key: &str, table: &Table, prefix: &str, missing: &[Quantity]) -> SpecError {
    let (place, axes) = match prefix.trim_end_matches('.') {
        "" => ("the spec", "[axes]"),
        block => (block, "its [block.axes]"),
    };
    let names: Vec<String> = missing.iter().map(|axis| format!("`{}`", axis.name())).collect();
    let lines: Vec<String> = missing.iter().map(|axis| format!("`{} = ...`", axis.name())).collect();
    let noun = if missing.len() == 1 { "axis" } else { "axes" };
    let found = format!("needs the {noun} {}, which {place} does not have", names.join(", "));
    SpecError::new(
        key,
        found,
        expected_axes(table.axes()),
        format!("add {} to {axes}, or remove the table", lines.join(", ")),
    )
}

/// The words for the axes that a table takes.
pub(super) fn expected_axes(axes: &[Quantity]) -> String {
    let (required, optional): (Vec<Quantity>, Vec<Quantity>) = axes.iter().partition(|axis| axis.default().is_empty());
    let listed = |axes: &[Quantity]| axes.iter().map(|axis| axis.name()).collect::<Vec<_>>().join(", ");
    let optional = if optional.is_empty() { String::new() } else { format!("; optional: {}", listed(&optional)) };
    format!("axes {}{optional}", listed(&required))
}

/// A table over its rows of `grid`, whose blocks have keys that begin with `prefixes`.
fn request(draft: TableDraft, grid: &Grid, prefixes: &[String]) -> Result<Request, SpecError> {
    let TableDraft { name, written, table, projection, rtol } = draft;
    let key = format!("tables.{name}");
    let members = if written.name() == table.name() { None } else { Some(members(written, table, &key, grid)?) };
    let row_index = grid.project(table.axes()).map_err(|error| match error {
        TooMany::Rows => {
            let (found, help) = ("more rows than 64 bits can count", "take fewer values on its axes");
            SpecError::new(key, found, "at most 2^64 - 1 rows", help)
        }
        TooMany::Combinations(block) => too_many(format!("{}where", prefixes[block])),
    })?;
    if let Some(empty) = row_index.blocks().iter().position(|block_rows| block_rows.rows() == 0) {
        let help = block::nan(&grid.blocks[empty])
            .map_or("correct the condition, or the axes in it".to_owned(), |nan| {
                format!("correct the expression of {nan}, which meets no condition")
            });
        let key = format!("{}where", prefixes[empty]);
        return refuse(key, "matches no points", "a condition that some point meets", help);
    }
    let sizes = projection.indices().iter().map(|&column| table.columns()[column].size(grid)).collect();
    Ok(Request { table, projection, rtol, rows: row_index.rows(), row_index, members, hash: OnceLock::new(), sizes })
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
    if block.factors.iter().any(|factor| is_fast(factor) && factor.axes.len() > 1)
        || fast.iter().any(|axis| block.axis(*axis).is_none())
    {
        return Err(wrong("alpha_2 or alpha_3 varies together with another axis", "give it values of its own"));
    }
    let expressions = block.derived.iter().map(|derived| &derived.expression).chain(&block.condition);
    if expressions.flat_map(|expression| expression.reads()).any(|axis| fast.contains(&axis)) {
        return Err(wrong(
            "another axis or `where` depends on alpha_2 or alpha_3",
            "remove that dependence, or filter the full table",
        ));
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
pub(super) fn projection(table: &Table, key: &str, names: Option<&[String]>, faults: &mut Faults) -> Projection {
    let known: Vec<&str> = table.columns().iter().map(|column| column.name).collect();
    let Some(names) = names else {
        return Projection::usual(table.columns());
    };
    let mut indices = Vec::new();
    for (place, name) in names.iter().enumerate() {
        let key = format!("{key}.columns[{place}]");
        match known.iter().position(|column| column == name) {
            _ if name == STATUS => {}
            Some(index) if indices.contains(&index) => {
                let found = format!("`{name}` is a duplicate");
                faults.push(SpecError::new(key, found, "each column once", "remove one of the two"));
            }
            Some(index) => indices.push(index),
            None => faults.push(unknown(key, "column", name, &known)),
        }
    }
    let key = format!("{key}.columns");
    if indices.is_empty() && !faults.concern(&key) {
        let expected = format!("at least one of {}", known.join(", "));
        let help = "name columns, or remove `columns` for the default ones";
        faults.push(SpecError::new(key, "no column is requested", expected, help));
    }
    Projection::new(indices)
}
