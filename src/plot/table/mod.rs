//! Pictures of tables: the axes, columns and marks of each table.

mod cells;
mod choice;
mod condition;
mod feedback;
mod gap;
mod groups;
mod lines;
mod map;
mod optimal;
mod phase;
mod reduced;
mod survey;

use super::figure::Figure;
use super::{PlotError, label};
use crate::dataset::{Folder, Manifest};
use crate::grid::{Quantity, Scale};
use crate::model::Units;

use choice::{Defaults, Shape};
pub use condition::Condition;
use survey::Survey;

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
    units: Units,
}

/// The kind of a picture.
struct Kind {
    table: &'static str,
    title: &'static str,
    defaults: Defaults,
    /// The additional layers of lines or a map.
    draw: fn(&Scene<'_>, &Shape) -> Result<Figure, PlotError>,
}

/// The source of a picture.
struct Scene<'a> {
    source: &'a Source,
    survey: &'a Survey,
}

/// Defaults of pictures of optimal protocols and best shortcuts.
const OVER_TIME: Defaults = Defaults {
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
const ON_A_SPRING: Defaults = Defaults {
    x: &["v_f", "k", "m", "b", "a"],
    y: &["k", "v_i", "m", "b"],
    classes: &[],
    value: &[],
    lines: &[],
    series: &["k"],
    least_map: 5,
    scatters: true,
};

/// Axes whose infinite value means that there is no ceiling, which is not stated.
const CEILINGS: [&str; 2] = ["v_ceiling", "tau_ceiling"];

/// Defaults of a picture with its own drawing code.
const ALONE: Defaults =
    Defaults { x: &["t_f", "v_f", "v_i", "b", "a"], y: &[], least_map: usize::MAX, lines: &["shortcuts"], ..OVER_TIME };

/// The picture of each table. A new table needs an entry here, and a file if it has special marks.
const KINDS: [Kind; 13] = [
    Kind {
        table: "gap",
        title: "Work gap of the cubic shortcuts",
        defaults: Defaults {
            x: &["alpha_2", "alpha_3", "t_f"],
            y: &["alpha_3"],
            value: &["gap", "work"],
            lines: &["gap", "v_min"],
            least_map: 2,
            ..OVER_TIME
        },
        draw: gap::draw,
    },
    Kind {
        table: "best_cubic",
        title: "Best cubic shortcut",
        defaults: Defaults { value: &["gap"], lines: &["gap", "alpha_2", "alpha_3", "v_min"], ..OVER_TIME },
        draw: plain,
    },
    Kind {
        table: "optimal",
        title: "Optimal protocol",
        defaults: Defaults {
            x: &["t_f", "v_ceiling", "tau_ceiling", "v_f", "v_i", "b", "a"],
            y: &["v_ceiling", "tau_ceiling", "v_f", "v_i", "b", "a"],
            classes: &["binding", "strategy"],
            value: &["work"],
            lines: &["work", "v_start", "time_at_floor", "dwork_dv_ceiling", "dwork_dtau_ceiling"],
            ..OVER_TIME
        },
        draw: optimal::draw,
    },
    Kind {
        table: "feedback",
        title: "Optimal velocity by state and time left",
        defaults: Defaults {
            x: &["theta", "t_left", "v_ceiling", "tau_ceiling", "v_f", "b", "a"],
            y: &["t_left", "v_ceiling", "tau_ceiling", "v_f"],
            classes: &["arc"],
            value: &["v"],
            lines: &["v", "work_to_go", "gain"],
            series: &["t_left", "v_ceiling", "tau_ceiling"],
            ..OVER_TIME
        },
        draw: feedback::draw,
    },
    Kind {
        table: "crossover",
        title: "Durations at which the optimal strategy changes",
        defaults: Defaults {
            x: &["v_f", "v_i", "b", "a"],
            y: &["v_i", "b", "a"],
            value: &["t_cross", "t_floor", "t_cheapest", "t_turn", "t_min"],
            lines: &["t_cheapest", "t_cross", "t_floor", "t_min", "t_turn"],
            series: &["b", "a"],
            least_map: 5,
            ..OVER_TIME
        },
        draw: plain,
    },
    Kind {
        table: "shortcut",
        title: "Families of shortcuts",
        defaults: Defaults {
            x: &["t_f", "v_f", "v_i", "tau_ceiling", "b", "a"],
            y: &[],
            value: &["gap", "work"],
            lines: &["gap", "v_max"],
            series: &["family"],
            least_map: usize::MAX,
            ..OVER_TIME
        },
        draw: plain,
    },
    Kind {
        table: "stability",
        title: "Stability of steady sliding",
        defaults: Defaults {
            classes: &["stable_f", "hopf_type"],
            value: &["growth_rate", "k_c_f", "stable_f"],
            lines: &["growth_rate", "frequency", "k_c_f"],
            ..ON_A_SPRING
        },
        draw: phase::draw,
    },
    Kind {
        table: "step_response",
        title: "Outcome of the step response",
        defaults: Defaults {
            classes: &["outcome", "stick_slip"],
            value: &["v_peak", "cycle_peak", "outcome"],
            lines: &["v_peak", "v_trough", "settling_time", "period"],
            ..ON_A_SPRING
        },
        draw: phase::draw,
    },
    Kind {
        table: "compliant",
        title: "Smooth shortcut on a spring",
        defaults: Defaults {
            x: &["t_f", "k", "dt", "m", "v_f"],
            y: &["k", "m", "v_f", "v_i"],
            value: &["sampling_error", "amplification", "v_c_min"],
            lines: &["amplification", "sampling_error", "v_c_min", "v_c_max"],
            series: &["k", "dt"],
            least_map: 12,
            ..OVER_TIME
        },
        draw: plain,
    },
    Kind {
        table: "regularised",
        title: "Optimum with its jumps made smooth",
        defaults: Defaults {
            x: &["delta_t", "t_f", "k", "m", "v_f"],
            y: &["t_f", "k", "v_f"],
            value: &["gap"],
            lines: &["gap", "v_c_max", "v_c_min"],
            series: &["t_f", "k"],
            least_map: 12,
            ..OVER_TIME
        },
        draw: plain,
    },
    Kind {
        table: "gap_min",
        title: "Least work gap of the cubic shortcuts",
        defaults: Defaults { value: &["gap"], lines: &["gap", "alpha_2", "alpha_3", "v_min"], ..OVER_TIME },
        draw: plain,
    },
    Kind {
        table: "gap_quantiles",
        title: "Quantiles of the work gap of the cubic shortcuts",
        defaults: ALONE,
        draw: plain,
    },
    Kind { table: "gap_histogram", title: "Cubic shortcuts by their work gap", defaults: ALONE, draw: plain },
];

impl Source {
    /// The dataset in `folder`, whose values are in `units`.
    pub fn new(folder: Folder, manifest: Manifest, units: Units) -> Source {
        let spec: Option<toml::Table> = manifest.spec.parse().ok();
        let model = spec.as_ref().and_then(|spec| spec.get("model"));
        let bound = model.and_then(|model| model.get("velocity_bound")).and_then(toml::Value::as_bool);
        Source { manifest, folder, bounded: bound.unwrap_or(true), units }
    }

    /// Names of the tables with a picture.
    pub fn tables(&self) -> Vec<String> {
        let known = |name: &str| KINDS.iter().any(|kind| kind.table == name);
        self.manifest.tables.iter().map(|table| table.name.clone()).filter(|name| known(name)).collect()
    }

    /// The picture of a table.
    ///
    /// # Errors
    ///
    /// A table without rows, a request that it does not satisfy, or a part that cannot be read.
    pub fn figure(&self, table: &str, request: &Request) -> Result<Figure, PlotError> {
        let mut survey = Survey::new(&self.folder, &self.manifest, table, &request.conditions)?;
        let front = front(&survey, request)?;
        if let Some(Front { hidden, .. }) = &front {
            let conditions = [request.conditions.clone(), Condition::all(&format!("{hidden}=inf"))?].concat();
            survey = Survey::new(&self.folder, &self.manifest, table, &conditions)?;
        }
        let no_table = || PlotError::NoTable { name: table.to_owned(), found: self.tables() };
        let kind = KINDS.iter().find(|kind| kind.table == table).ok_or_else(no_table)?;
        let is_alone = request.x.is_none() && request.y.is_none() && request.colour.is_none();
        let (mut figure, drawn) = match table {
            "gap_histogram" if is_alone => reduced::histogram(&survey)?,
            "gap_quantiles" if is_alone => reduced::quantiles(&survey)?,
            _ => {
                let shape = choice::choose(&survey, &kind.defaults, request)?;
                let drawn = match &shape {
                    Shape::Map(plan) => vec![plan.x.clone(), plan.y.clone()],
                    Shape::Lines(plan) => vec![plan.x.clone()],
                };
                ((kind.draw)(&Scene { source: self, survey: &survey }, &shape)?, drawn)
            }
        };
        figure.title = kind.title.to_owned();
        let same = [fixed(&survey, &drawn), figure.subtitle].into_iter().filter(|words| !words.is_empty());
        figure.subtitle = same.collect::<Vec<_>>().join(", ");
        if let Some(Front { hidden, drawn }) = front {
            figure.remarks.push(format!("rows of {drawn} alone; draw those of {hidden} with --x {hidden}"));
        }
        if survey.missing > 0 {
            figure.notes.push(format!("{} parts of the table are missing.", survey.missing));
        }
        Ok(figure)
    }
}

/// One of two sets of rows, each with one ceiling alone.
struct Front {
    /// The ceiling of the other rows.
    hidden: &'static str,
    drawn: &'static str,
}

/// The front to draw where both ceilings vary, but never together: that of the requested ceiling, else of the one with most values.
fn front(survey: &Survey, request: &Request) -> Result<Option<Front>, PlotError> {
    let [v, tau] = CEILINGS;
    let values = |name| survey.axis(name).filter(|axis| axis.varies() && axis.infinite).map(|axis| axis.values.len());
    let (Some(of_v), Some(of_tau)) = (values(v), values(tau)) else { return Ok(None) };
    let requested = [&request.x, &request.y, &request.colour];
    let draws_v = match [v, tau].map(|name| requested.iter().any(|column| column.as_deref() == Some(name))) {
        [true, true] => return Ok(None),
        [false, false] => of_v >= of_tau,
        [draws_v, _] => draws_v,
    };
    let mut meet = false;
    survey.each_while(&CEILINGS, |row| {
        meet = row.iter().all(|ceiling| ceiling.is_finite());
        !meet
    })?;
    let (drawn, hidden) = if draws_v { (v, tau) } else { (tau, v) };
    Ok((!meet).then_some(Front { hidden, drawn }))
}

/// Lines or a map without further layers.
fn plain(scene: &Scene<'_>, shape: &Shape) -> Result<Figure, PlotError> {
    match shape {
        Shape::Map(plan) => Ok(map::map(scene.survey, plan)?.figure),
        Shape::Lines(plan) => Ok(lines::lines(scene.survey, plan)?.figure),
    }
}

/// The values common to all rows.
fn fixed(survey: &Survey, drawn: &[String]) -> String {
    let mut words = Vec::new();
    for axis in survey.axes.iter().filter(|axis| !drawn.contains(&axis.name)) {
        match axis.values.as_slice() {
            [one] if !axis.infinite => {
                words.push(axis.text_of(*one));
            }
            [] if axis.infinite && !CEILINGS.contains(&axis.name.as_str()) => {
                words.push(format!("{} = ∞", label::name(&axis.name)))
            }
            _ => {}
        }
    }
    words.join(", ")
}

impl Scene<'_> {
    /// The value of a quantity in all rows of a group: from the group, or the only value of the table.
    fn value(&self, groups: &groups::Groups, group: usize, name: &str) -> Option<f64> {
        if let Some(place) = groups.axes.iter().position(|axis| axis == name) {
            return groups.shown.get(group)?.values.get(place).copied();
        }
        match self.survey.axis(name)?.values.as_slice() {
            [one] => Some(*one),
            _ => None,
        }
    }

    /// The factor of a quantity from scaled units to those of the dataset.
    fn size(&self, name: &str) -> f64 {
        Quantity::from_name(name).map_or(1.0, |quantity| self.source.units.size(quantity.unit(Scale::Model)))
    }

    /// The value of a quantity in scaled units.
    fn scaled(&self, groups: &groups::Groups, group: usize, name: &str) -> Option<f64> {
        let unit = Quantity::from_name(name)?.unit(Scale::Model);
        Some(self.source.units.scaled(unit, self.value(groups, group, name)?))
    }
}
