//! Pictures of tables: the axes, columns and marks of each table.

mod cells;
mod choice;
mod condition;
mod filtered;
mod gap;
mod groups;
mod lines;
mod map;
mod overlay;
mod reduced;

use super::figure::Figure;
use super::{PlotError, label};
use crate::dataset::{Folder, Manifest};
use crate::grid::{Quantity, Scale};
use crate::model::{Friction, Units};
use crate::sweep::{ModelSpec, Spec};

use choice::Shape;
pub use condition::Condition;
pub(crate) use filtered::FilteredTable;

/// The request.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// Conditions on the shown rows.
    pub conditions: Vec<Condition>,
    /// Horizontal axis.
    pub x: Option<String>,
    /// Vertical axis, or the column of lines.
    pub y: Option<String>,
    /// Colour column of a map, or the axis that distinguishes lines.
    pub colour: Option<String>,
}

/// A dataset whose tables can be drawn.
#[derive(Debug)]
pub struct Source {
    /// Its manifest.
    pub manifest: Manifest,
    folder: Folder,
    bounded: bool,
    /// Whether the computed curves hold, which are those of logarithmic friction.
    is_logarithmic: bool,
    units: Units,
}

/// The picture of a table: its title, and what it shows by default.
struct TablePicture {
    table: &'static str,
    title: &'static str,
    /// Horizontal axes, in the order of preference.
    x: &'static [&'static str],
    /// Vertical axes of a map.
    y: &'static [&'static str],
    /// Columns of words that colour a map if they vary.
    classes: &'static [&'static str],
    /// Columns that colour a map otherwise: the first one with a value.
    value: &'static [&'static str],
    /// Columns of lines, one panel each.
    lines: &'static [&'static str],
    /// Axes whose values have separate lines.
    series: &'static [&'static str],
    /// Least number of values of both axes for a map.
    least_map: usize,
    /// Whether scattered points, such as materials, always make a map, since lines between them have no meaning.
    scatters: bool,
}

/// The source of a picture.
struct TableScene<'a> {
    source: &'a Source,
    filtered: &'a FilteredTable,
}

/// Defaults of pictures of optimal protocols and best shortcuts.
const PROTOCOL_DEFAULTS: TablePicture = TablePicture {
    table: "",
    title: "",
    x: &["t_f", "v_f", "v_i", "b", "a"],
    y: &["v_f", "v_i", "b", "a"],
    classes: &[],
    value: &[],
    lines: &[],
    series: &[],
    least_map: 12,
    scatters: false,
};

/// Defaults of phase diagrams.
const SPRING_DEFAULTS: TablePicture = TablePicture {
    x: &["v_f", "k", "m", "b", "a"],
    y: &["k", "v_i", "m", "b"],
    series: &["k"],
    least_map: 5,
    scatters: true,
    ..PROTOCOL_DEFAULTS
};

/// Axes whose infinite value means that there is no ceiling, which is not stated.
const CEILINGS: [&str; 2] = ["v_ceiling", "tau_ceiling"];

/// Defaults of a picture with its own drawing code.
const OWN_DRAWING: TablePicture =
    TablePicture { y: &[], least_map: usize::MAX, lines: &["shortcuts"], ..PROTOCOL_DEFAULTS };

/// The picture of each table. A new table needs an entry here, and a file if it has special marks.
const TABLE_PICTURES: [TablePicture; 13] = [
    TablePicture {
        table: "gap",
        title: "Landscape of cubic shortcuts",
        x: &["alpha_2", "alpha_3", "t_f"],
        y: &["alpha_3"],
        value: &["gap", "work"],
        lines: &["gap", "v_min"],
        least_map: 2,
        ..PROTOCOL_DEFAULTS
    },
    TablePicture {
        table: "best_cubic",
        title: "Best cubic shortcut",
        value: &["gap"],
        lines: &["gap", "alpha_2", "alpha_3", "v_min"],
        ..PROTOCOL_DEFAULTS
    },
    TablePicture {
        table: "optimal",
        title: "Optimal protocol",
        x: &["t_f", "v_ceiling", "tau_ceiling", "v_f", "v_i", "b", "a"],
        y: &["v_ceiling", "tau_ceiling", "v_f", "v_i", "b", "a"],
        classes: &["binding", "strategy"],
        value: &["work"],
        lines: &["work", "v_start", "time_at_floor", "dwork_dv_ceiling", "dwork_dtau_ceiling"],
        ..PROTOCOL_DEFAULTS
    },
    TablePicture {
        table: "feedback",
        title: "Optimal feedback by state and time left",
        x: &["theta", "t_left", "v_ceiling", "tau_ceiling", "v_f", "b", "a"],
        y: &["t_left", "v_ceiling", "tau_ceiling", "v_f"],
        classes: &["arc"],
        value: &["v"],
        lines: &["v", "work_to_go", "gain"],
        series: &["t_left", "v_ceiling", "tau_ceiling"],
        ..PROTOCOL_DEFAULTS
    },
    TablePicture {
        table: "crossover",
        title: "Changes of the optimal strategy",
        x: &["v_f", "v_i", "b", "a"],
        y: &["v_i", "b", "a"],
        value: &["t_cross", "t_floor", "t_cheapest", "t_turn", "t_min"],
        lines: &["t_cheapest", "t_cross", "t_floor", "t_min", "t_turn"],
        series: &["b", "a"],
        least_map: 5,
        ..PROTOCOL_DEFAULTS
    },
    TablePicture {
        table: "shortcut",
        title: "Families of shortcuts",
        x: &["t_f", "v_f", "v_i", "tau_ceiling", "b", "a"],
        y: &[],
        value: &["gap", "work"],
        lines: &["gap", "v_max"],
        series: &["family"],
        least_map: usize::MAX,
        ..PROTOCOL_DEFAULTS
    },
    TablePicture {
        table: "stability",
        title: "Stability of steady sliding",
        classes: &["stable_f", "hopf_type"],
        value: &["growth_rate", "k_c_f", "stable_f"],
        lines: &["growth_rate", "frequency", "k_c_f"],
        ..SPRING_DEFAULTS
    },
    TablePicture {
        table: "step_response",
        title: "Step response",
        classes: &["outcome", "stick_slip"],
        value: &["v_peak", "cycle_peak", "outcome"],
        lines: &["v_peak", "v_trough", "settling_time", "period"],
        ..SPRING_DEFAULTS
    },
    TablePicture {
        table: "compliant",
        title: "Smooth shortcut on a spring",
        x: &["t_f", "k", "dt", "m", "v_f"],
        y: &["k", "m", "v_f", "v_i"],
        value: &["sampling_error", "amplification", "v_c_min"],
        lines: &["amplification", "sampling_error", "v_c_min", "v_c_max"],
        series: &["k", "dt"],
        ..PROTOCOL_DEFAULTS
    },
    TablePicture {
        table: "regularised",
        title: "Optimum with its jumps made smooth",
        x: &["delta_t", "t_f", "k", "m", "v_f"],
        y: &["t_f", "k", "v_f"],
        value: &["gap"],
        lines: &["gap", "v_c_max", "v_c_min"],
        series: &["t_f", "k"],
        ..PROTOCOL_DEFAULTS
    },
    TablePicture {
        table: "gap_min",
        title: "Best shortcut of a landscape",
        value: &["gap"],
        lines: &["gap", "alpha_2", "alpha_3", "v_min"],
        ..PROTOCOL_DEFAULTS
    },
    TablePicture { table: "gap_quantiles", title: "Quantiles of the work gap of the cubic shortcuts", ..OWN_DRAWING },
    TablePicture { table: "gap_histogram", title: "Cubic shortcuts by their work gap", ..OWN_DRAWING },
];

impl TablePicture {
    /// A column of lines, for messages.
    fn line(&self, filtered: &FilteredTable) -> String {
        self.lines.iter().find(|column| filtered.has(column)).map_or("COLUMN", |column| column).to_owned()
    }
}

impl Source {
    /// The dataset in `folder`, whose values are in `units`.
    pub fn new(folder: Folder, manifest: Manifest, units: Units) -> Source {
        let ModelSpec { velocity_bound, friction, .. } = Spec::parse(&manifest.spec).unwrap_or_default().model;
        let is_logarithmic = friction == Friction::Log.name();
        Source { manifest, folder, bounded: velocity_bound, is_logarithmic, units }
    }

    /// Names of the tables with a picture.
    pub fn tables(&self) -> Vec<String> {
        let known = |name: &str| TABLE_PICTURES.iter().any(|picture| picture.table == name);
        self.manifest.tables.iter().map(|table| table.name.clone()).filter(|name| known(name)).collect()
    }

    /// What of the model differs from the default, for a table that depends on it.
    fn model(&self, table: &str) -> &'static str {
        match (self.is_logarithmic, self.bounded) {
            (false, _) => "regularised friction",
            (true, false) if !["stability", "step_response"].contains(&table) => "no velocity floor",
            _ => "",
        }
    }

    /// The picture of a table.
    ///
    /// # Errors
    ///
    /// A table without rows, a request that it does not satisfy, or a part that cannot be read.
    pub fn figure(&self, table: &str, request: &Request) -> Result<Figure, PlotError> {
        let mut filtered = FilteredTable::new(&self.folder, &self.manifest, table, &request.conditions)?;
        let front = front(&filtered, request)?;
        if let Some((_, hidden)) = front {
            let conditions = [request.conditions.clone(), Condition::all(&format!("{hidden}=inf"))?].concat();
            filtered = FilteredTable::new(&self.folder, &self.manifest, table, &conditions)?;
        }
        let no_table = || PlotError::unknown("the dataset has no table", table, &self.tables());
        let picture = TABLE_PICTURES.iter().find(|picture| picture.table == table).ok_or_else(no_table)?;
        let is_default = request.x.is_none() && request.y.is_none() && request.colour.is_none();
        let mut figure = match table {
            "gap_histogram" if is_default => reduced::histogram(&filtered)?,
            "gap_quantiles" if is_default => reduced::quantiles(&filtered)?,
            _ => {
                let shape = choice::choose(&filtered, picture, request)?;
                if let (Shape::Lines(plan), Some(label)) = (&shape, &request.colour)
                    && !plan.has_symbols
                {
                    filtered.keep_label(label);
                }
                TableScene { source: self, filtered: &filtered }.draw(&shape)?
            }
        };
        figure.title = picture.title.to_owned();
        let model = self.model(table).to_owned();
        let same = [fixed(&filtered), figure.subtitle, model].into_iter().filter(|words| !words.is_empty());
        figure.subtitle = same.collect::<Vec<_>>().join(", ");
        if let Some((drawn, hidden)) = front {
            figure.remarks.push(format!("rows of {drawn} alone; draw those of {hidden} with --x {hidden}"));
        }
        if filtered.missing > 0 {
            figure.notes.push(format!("{} parts of the table are missing.", filtered.missing));
        }
        Ok(figure)
    }
}

/// The ceiling of the rows to draw and that of the hidden rows, where both ceilings vary, but never together: the requested ceiling is drawn, else
/// the one with most values.
fn front(filtered: &FilteredTable, request: &Request) -> Result<Option<(&'static str, &'static str)>, PlotError> {
    let [v, tau] = CEILINGS;
    let values = |name| filtered.axis(name).filter(|axis| axis.varies() && axis.infinite).map(|axis| axis.values.len());
    let (Some(of_v), Some(of_tau)) = (values(v), values(tau)) else { return Ok(None) };
    let requested = [&request.x, &request.y, &request.colour];
    let draws_v = match [v, tau].map(|name| requested.iter().any(|column| column.as_deref() == Some(name))) {
        [true, true] => return Ok(None),
        [false, false] => of_v >= of_tau,
        [draws_v, _] => draws_v,
    };
    let mut both_finite = false;
    filtered.each_while(&CEILINGS, |row| {
        both_finite = row.iter().all(|ceiling| ceiling.is_finite());
        !both_finite
    })?;
    Ok((!both_finite).then_some(if draws_v { (v, tau) } else { (tau, v) }))
}

/// The labels and values common to all rows.
fn fixed(filtered: &FilteredTable) -> String {
    let mut words: Vec<String> = filtered.common_labels.iter().map(|(_, word)| label::literal(word)).collect();
    for axis in &filtered.axes {
        match axis.values.as_slice() {
            [one] if !axis.infinite => words.push(axis.text_of(*one)),
            [] if axis.infinite && !CEILINGS.contains(&axis.name.as_str()) => {
                words.push(format!("{} = ∞", label::name(&axis.name)))
            }
            _ => {}
        }
    }
    words.join(", ")
}

impl TableScene<'_> {
    /// Lines or a map, with the layers of the table.
    fn draw(&self, shape: &Shape) -> Result<Figure, PlotError> {
        let (mut figure, groups) = match shape {
            Shape::Map(plan) => {
                let mut map = map::map(self.filtered, plan)?;
                overlay::curves(self, plan, &mut map);
                gap::border(self, plan, &mut map)?;
                (map.figure, map.groups)
            }
            Shape::Lines(plan) => {
                let mut lines = lines::lines(self.filtered, plan)?;
                overlay::marks(self, plan, &mut lines);
                (lines.figure, lines.groups)
            }
        };
        if (0..groups.shown.len()).any(|group| self.word(&groups, group, "family") == Some("step")) {
            let note =
                "The step only approaches the final state: its work may be below that of all protocols that reach it.";
            figure.notes.push(note.to_owned());
        }
        // The work of this table is the least work.
        if self.filtered.table == "optimal" {
            let axes = figure.panels.iter_mut().map(|panel| &mut panel.y).chain(&mut figure.colours);
            axes.filter(|axis| axis.column == "work").for_each(|axis| axis.column = "work_optimal".to_owned());
        }
        Ok(figure)
    }

    /// The value of a quantity in all rows of a group: from the group, or the only value of the table.
    fn value(&self, groups: &groups::Groups, group: usize, name: &str) -> Option<f64> {
        if let Some(index) = groups.axes.iter().position(|axis| axis == name) {
            return groups.shown.get(group)?.values.get(index).copied();
        }
        match self.filtered.axis(name)?.values.as_slice() {
            [one] => Some(*one),
            _ => None,
        }
    }

    /// The factor of a quantity from scaled units to those of the dataset.
    fn size(&self, name: &str) -> f64 {
        Quantity::from_name(name).map_or(1.0, |quantity| self.source.units.size(quantity.unit(Scale::Model)))
    }

    /// The word of an axis of words, if the group has one.
    fn word(&self, groups: &groups::Groups, group: usize, name: &str) -> Option<&str> {
        let place = self.value(groups, group, name)?;
        self.filtered.axis(name)?.words.get(place as usize).map(String::as_str)
    }

    /// The value of a quantity in scaled units.
    fn scaled(&self, groups: &groups::Groups, group: usize, name: &str) -> Option<f64> {
        let unit = Quantity::from_name(name)?.unit(Scale::Model);
        Some(self.source.units.scaled(unit, self.value(groups, group, name)?))
    }
}
