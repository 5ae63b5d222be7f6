//! The description of a traced protocol: a few lines, or the metadata of a file; and its table.

use super::{Arguments, Origin, TraceRequest, words};
use crate::model::{Friction, Units};
use crate::protocol::Status;
use crate::trace::{self, COLUMNS, Disturbance, Parameter, RANGE_RTOL, Trace, TracedPath, VALUE_RTOL};

/// What a disturbance does to a protocol: the work beyond the planned one and the terminal error, by loop; in scaled units.
pub(super) struct Effects {
    pub disturbance: Disturbance,
    /// The units of the description.
    pub units: Units,
    pub t: f64,
    /// The name of the loop that is shown.
    pub shown: &'static str,
    pub open: (f64, f64),
    pub closed: (f64, f64),
}

impl Effects {
    pub fn text(&self) -> String {
        let change = words::number(100.0 * self.disturbance.change);
        let sign = if self.disturbance.change > 0.0 { "+" } else { "" };
        let line = |name: &str, (extra, error): (f64, f64)| {
            let (extra, sign) = (self.extra(extra), if extra < 0.0 { "" } else { "+" });
            let work = format!("{sign}{} {}", words::number(extra.value), extra.unit);
            format!("    {name}: work {}, terminal_error {}\n", work.trim_end(), words::number(error))
        };
        format!(
            "  disturbed: theta {sign}{change} % at {}; extra work, and relative miss of the target theta\n{}{}  shown: {} loop\n",
            self.time().words(),
            line("open loop, v(t) as planned", self.open),
            line("closed loop, v(theta, t_left)", self.closed),
            self.shown,
        )
    }

    fn time(&self) -> Named {
        Named::scaled("t", self.t, "l/v_0", &self.units)
    }

    fn extra(&self, work: f64) -> Named {
        Named::scaled("extra_work", work, "mu_0 sigma l", &self.units)
    }

    pub fn facts(&self) -> Vec<(String, String)> {
        let (extra, error) = if self.shown == "open" { self.open } else { self.closed };
        [
            ("disturbed_theta", format!("{:?}", self.disturbance.change)),
            ("disturbed_at", format!("{:?}", self.time().value)),
            ("loop", self.shown.to_owned()),
            ("extra_work", format!("{:?}", self.extra(extra).value)),
            ("terminal_error", format!("{error:?}")),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .to_vec()
    }
}

/// The name of a unit in SI, else empty.
pub(super) fn si_name(units: &Units, unit: &'static str) -> &'static str {
    if *units == Units::Scaled { "" } else { units.name(unit) }
}

/// A number with its unit in SI, if any.
pub(super) struct Named {
    pub name: String,
    pub value: f64,
    unit: &'static str,
}

impl Named {
    pub fn new(name: &str, value: f64, unit: &'static str) -> Named {
        Named { name: name.to_owned(), value, unit: if unit == "1" { "" } else { unit } }
    }

    /// Converts the scaled `value` to `units`.
    pub fn scaled(name: &str, value: f64, unit: &'static str, units: &Units) -> Named {
        Named::new(name, value * units.size(unit), si_name(units, unit))
    }

    fn words(&self) -> String {
        format!("{} = {} {}", self.name, words::number(self.value), self.unit).trim_end().to_owned()
    }
}

/// The parameters of a protocol in the units of the request, each with its meaning.
fn parameters(request: &TraceRequest, path: &TracedPath) -> Vec<(Named, &'static str)> {
    let named = |parameter: &Parameter| {
        // The only parameter of a family with a unit.
        if parameter.name == "alpha" && request.name == "bounded_velocity" && request.units != Units::Scaled {
            let rate = request.units.size("v_0/l");
            return (Named::new(parameter.name, parameter.value * rate * rate, "1/s^2"), parameter.doc);
        }
        (Named::scaled(parameter.name, parameter.value, parameter.unit, &request.units), parameter.doc)
    };
    path.parameters.iter().map(named).collect()
}

/// The results.
fn results(request: &TraceRequest, path: &TracedPath, trace: &Trace) -> [Named; 3] {
    // The trace has the units of the request.
    let velocity = |name, value| Named::new(name, value, si_name(&request.units, "v_0"));
    let work = Named::scaled("work", path.work, "mu_0 sigma l", &request.units);
    [work, velocity("v_min", trace.v_min), velocity("v_max", trace.v_max)]
}

/// The description of the protocol, in a few lines.
pub(super) fn header(arguments: &Arguments, request: &TraceRequest, path: &TracedPath, trace: &Trace) -> String {
    let all = |numbers: &[Named]| numbers.iter().map(Named::words).collect::<Vec<_>>().join(", ");
    let mut text = format!("{}: {}\n  at {}", request.name, request.protocol.doc(&request.name), all(&request.numbers));
    if let Some(law) = request.law {
        text.push_str(&format!(", law {}", law.name()));
    }
    if request.friction == Friction::Regularised {
        text.push_str(", regularised friction");
    }
    if request.bounded == Some(false) {
        text.push_str(", without the velocity floor v >= 1");
    }
    text.push('\n');
    if let Some(Origin { dataset, table, row, label, .. }) = &request.origin {
        let label = if label.is_empty() { String::new() } else { format!(": {label}") };
        text.push_str(&format!("  row {row} of table {table} of {dataset}{label}\n"));
    }
    for (parameter, doc) in parameters(request, path) {
        text.push_str(&format!("  {}: {doc}\n", parameter.words()));
    }
    text.push_str(&format!(
        "  {}\n  status {}\n",
        all(&results(request, path, trace)),
        status(path.status, &request.units)
    ));
    let rows = words::things(trace.moments.len() as u64, "row");
    match arguments.points {
        Some(_) => {
            text.push_str(&format!("  {rows}: equally spaced times, and the states before and after jumps\n"));
        }
        None => {
            let (range, value) = (words::number(RANGE_RTOL), words::number(VALUE_RTOL));
            let lines = format!("linear interpolation errs by up to {range} of the range of a column");
            text.push_str(&format!("  {rows}; {lines}, and by up to {value} of v and theta\n"));
        }
    }
    text
}

/// A status and its meaning.
fn status(status: Status, units: &Units) -> String {
    let floor = if *units == Units::Scaled { "1" } else { "v_0" };
    let meaning = match status {
        Status::BelowBound => format!(": v < {floor} somewhere, outside the range of the friction law"),
        Status::Infeasible => format!(": no protocol with v >= {floor} arrives in this time"),
        Status::NegativeFriction => ": friction < 0 somewhere, outside any friction law".to_owned(),
        Status::Unproven => ": friction is so low that the extremal need not be the only one".to_owned(),
        _ => String::new(),
    };
    format!("{}{meaning}", status.name())
}

/// The aligned columns with their units.
pub(super) fn table(trace: &Trace, units: &Units) -> String {
    let columns = trace.columns();
    let mut lines = vec![columns.iter().map(|&column| COLUMNS[column].name.to_owned()).collect::<Vec<_>>()];
    lines.push(columns.iter().map(|&column| units.name(trace::unit(column)).to_owned()).collect());
    for moment in &trace.moments {
        let cell = |column: usize| Trace::value(moment, column).map_or_else(|| "-".to_owned(), words::number);
        lines.push(columns.iter().map(|&column| cell(column)).collect());
    }
    words::aligned(&lines, 2)
}

/// The metadata of a file.
pub(super) fn facts(
    arguments: &Arguments,
    request: &TraceRequest,
    path: &TracedPath,
    trace: &Trace,
) -> Vec<(String, String)> {
    let mut facts = vec![("protocol", request.name.clone())];
    let (parameters, results) = (parameters(request, path), results(request, path, trace));
    let rtol = Named::new("rtol", request.rtol, "");
    let numbers = request.numbers.iter().chain([&rtol]).chain(parameters.iter().map(|(parameter, _)| parameter));
    facts.extend(numbers.chain(&results).map(|number| (number.name.as_str(), format!("{:?}", number.value))));
    facts.extend(request.law.map(|law| ("law", law.name().to_owned())));
    if request.friction == Friction::Regularised {
        facts.push(("friction", request.friction.name().to_owned()));
    }
    facts.extend(request.bounded.map(|bounded| ("velocity_bound", bounded.to_string())));
    facts.extend(arguments.points.map(|points| ("points", points.to_string())));
    facts.push(("status", path.status.name().to_owned()));
    if let Some(Origin { dataset, table, row, label, .. }) = &request.origin {
        facts.extend([("dataset", dataset.clone()), ("table", table.clone()), ("row", row.to_string())]);
        facts.extend((!label.is_empty()).then(|| ("label", label.clone())));
    }
    facts.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}
