//! `slipsweep trace PROTOCOL` and `slipsweep trace DATASET TABLE --row N`: one protocol over time, as a table, CSV or
//! Parquet.

mod arguments;
mod description;
mod row;

use std::path::Path;

use super::kind::{self, Kind};
use super::{EXIT_REQUEST, Failure, dataset, no_table, put, refused, say, whole, words, write_file, wrong};
use crate::grid::Quantity;
use crate::model::{Friction, StateLaw, Units};
use crate::protocol::shortcut::Case;
use crate::protocol::{Motion, Status};
use crate::sweep::AccuracySpec;
use crate::trace::{self, Absence, Disturbed, Protocol, Times, Trace, TracedPath};

pub use arguments::Arguments;
use arguments::{Format, Loop, flag};
use description::{Effects, Named, facts, header, table};

/// The protocol to trace, from flags or from a row.
struct TraceRequest {
    /// The name of the protocol.
    name: String,
    protocol: Protocol,
    /// Parameters in scaled units.
    case: Case,
    /// Parameters of the protocol as given.
    numbers: Vec<Named>,
    /// The evolution law, if named.
    law: Option<StateLaw>,
    /// The form of friction.
    friction: Friction,
    /// Whether `v >= 1`; `None` if the bound has no effect.
    bounded: Option<bool>,
    rtol: f64,
    units: Units,
    /// Dataset, table and row of the protocol.
    origin: Option<Origin>,
}

/// The row of a dataset.
struct Origin {
    dataset: String,
    table: String,
    row: u64,
    /// Its labels, from the file of points.
    label: String,
    /// Its status.
    status: Option<Status>,
}

/// Traces a protocol.
///
/// # Errors
///
/// Illegal parameters, a protocol that does not exist, or a file that cannot be written.
pub fn trace(arguments: &Arguments) -> Result<(), Failure> {
    let (format, output) = (arguments.output.format()?, &arguments.output);
    let Traced { header, trace, units, facts } = solved(arguments)?;
    let version = env!("CARGO_PKG_VERSION");
    let bytes = match format {
        Format::Table => format!("{header}\n{}", table(&trace, &units)).into_bytes(),
        Format::Csv => trace::csv(&trace, &units, &facts, version).into_bytes(),
        Format::Parquet => trace::parquet(&trace, &units, &facts, version).map_err(Failure::failed)?,
    };
    if output.is_stdout() {
        return put(&bytes);
    }
    write_file(&output.out, &bytes)?;
    say(&format!("{header}written to {}\n", output.out.display()))
}

/// A protocol over time, and its description.
pub struct Traced {
    /// Protocol, parameters, work and status in a few lines.
    pub header: String,
    /// The moments, in `units`.
    pub trace: Trace,
    /// The units of the trace.
    pub units: Units,
    /// The contents of `header` as keys and values.
    pub facts: Vec<(String, String)>,
}

/// Traces the protocol that the arguments of `slipsweep trace` name.
///
/// # Errors
///
/// The failure that the command reports.
pub fn traced(arguments: &[String]) -> Result<Traced, Failure> {
    solved(&parsed(arguments)?)
}

/// Why the protocol of a row does not exist, in the units of the dataset; `None` if it does, or if the row cannot be read.
pub fn reason(dataset: &str, table: &str, row: u64) -> Option<String> {
    let arguments = parsed(&[dataset, table, "--row", &row.to_string()].map(str::to_owned)).ok()?;
    let request = arguments.row_of(table).ok()?;
    let absence = request.protocol.path(&request.case, request.rtol).err()?;
    Some(first_line(&absence.text(&request.units)))
}

fn parsed(arguments: &[String]) -> Result<Arguments, Failure> {
    /// The command.
    #[derive(clap::Parser)]
    #[command(name = "trace")]
    struct Command {
        #[command(flatten)]
        arguments: Arguments,
    }
    let name = "trace".to_owned();
    let command = <Command as clap::Parser>::try_parse_from(std::iter::once(&name).chain(arguments));
    let command = command.map_err(|error| Failure { code: EXIT_REQUEST, message: error.to_string() })?;
    Ok(command.arguments)
}

/// A message without its help, which names options of a protocol.
fn first_line(message: &str) -> String {
    message.lines().next().unwrap_or_default().to_owned()
}

fn solved(arguments: &Arguments) -> Result<Traced, Failure> {
    let request = match &arguments.table {
        Some(table) => arguments.row_of(table)?,
        None => arguments.request()?,
    };
    let (mut path, trace, effects) = arguments.traced(&request)?;
    // A row states its status, which may depend on an optimum; friction of steady sliding before and after a jump is not that of the protocol.
    path.status = request.origin.as_ref().and_then(|origin| origin.status).unwrap_or_else(|| {
        let inner = trace.within_jumps().iter().map(|moment| moment.friction);
        path.status.with_friction(inner.fold(f64::INFINITY, f64::min))
    });
    let mut trace = trace.in_units(&request.units);
    // A given duration keeps its digits, which the conversion to and from SI rounds.
    let is_duration = |number: &&Named| number.name == Quantity::Time.name() && request.units != Units::Scaled;
    let given = request.numbers.iter().find(is_duration);
    if let (Some(t_f), Some(last)) = (given.map(|number| number.value), trace.moments.last().map(|moment| moment.t)) {
        trace.moments.iter_mut().for_each(|moment| moment.t = t_f * (moment.t / last));
    }
    let mut header = header(arguments, &request, &path, &trace);
    let mut facts = facts(arguments, &request, &path, &trace);
    if let Some(effects) = effects {
        header.push_str(&effects.text());
        facts.extend(effects.facts());
    }
    Ok(Traced { header, trace, units: request.units, facts })
}

impl Arguments {
    /// The protocol that the arguments name.
    fn request(&self) -> Result<TraceRequest, Failure> {
        if trace::names().all(|(name, _)| name != self.subject) {
            kind::expect(Path::new(&self.subject), &[Kind::Dataset])?;
            let (folder, expected) = (&self.subject, "a protocol, or a dataset with a table and a row");
            let help = format!("slipsweep trace {folder} optimal --row 0");
            return Err(refused(format!("{folder}: a dataset without a table"), expected, help));
        }
        let name = self.subject.as_str();
        self.check(name)?;
        let given = self.given();
        let number = |quantity: Quantity| {
            let of = given.iter().find(|(known, _)| *known == quantity).and_then(|(_, given)| *given);
            of.or(quantity.default().first().copied())
        };
        let friction = self.friction.unwrap_or_default();
        let known = if self.from.is_some() { "feedback" } else { name };
        let (protocol, case) = Protocol::new(known, (friction, !self.unbounded, [true; 2]), number)
            .map_err(|quantity| wrong(format!("`{name}` needs {}", flag(quantity))))?;
        let is_number = |quantity: Quantity| !quantity.has_scale() && quantity != Quantity::Law;
        let numbers = given.iter().filter(|(quantity, _)| is_number(*quantity));
        let numbers =
            numbers.filter_map(|(quantity, given)| Some(Named::new(quantity.name(), (*given)?, ""))).collect();
        Ok(TraceRequest {
            name: name.to_owned(),
            protocol,
            case,
            numbers,
            law: self.law,
            friction,
            bounded: trace::has_floor(name, friction).then_some(!self.unbounded),
            rtol: self.rtol.unwrap_or(AccuracySpec::default().rtol),
            units: Units::Scaled,
            origin: None,
        })
    }

    /// The failure for a protocol that does not exist.
    fn absent(&self, request: &TraceRequest, absence: &Absence) -> Failure {
        let message = match &request.origin {
            Some(origin) => self.of_row(origin, &first_line(&absence.text(&request.units))),
            None => format!("no `{}` protocol: {absence}", request.name),
        };
        if absence.is_defect() { Failure::failed(message) } else { wrong(message) }
    }

    /// The message that the row of `origin` has no protocol.
    fn of_row(&self, Origin { table, row, .. }: &Origin, reason: &str) -> String {
        format!("{}: row {row} of `{table}`: {reason}\n  help: choose a row whose status is ok", self.subject)
    }

    /// The protocol, its trace, and the effects of a disturbance if one is requested.
    fn traced(&self, request: &TraceRequest) -> Result<(TracedPath, Trace, Option<Effects>), Failure> {
        let absent = |absence| self.absent(request, &absence);
        let times = self.points.map_or(Times::Fewest, |count| Times::Spaced(count as usize));
        let of = |motion: &dyn Motion| {
            let trace = Trace::of(motion, &request.case.transition, times);
            trace.ok_or_else(|| Failure::failed("the protocol has more detail than a trace can resolve"))
        };
        let Some(disturbance) = self.disturb else {
            let path = request.protocol.path(&request.case, request.rtol).map_err(absent)?;
            if let Some(origin) = request.origin.as_ref().filter(|origin| origin.status == Some(Status::Infeasible)) {
                let reason = "its status is infeasible: the response diverges, or its optimum does not exist";
                return Err(wrong(self.of_row(origin, reason)));
            }
            let trace = of(&*path.motion)?;
            return Ok((path, trace, None));
        };
        let Protocol::Optimal { bounds } = request.protocol else {
            let why =
                "only the optimal protocol of the law `ageing` and logarithmic friction is known from every state";
            return Err(wrong(format!("--disturb: {why}\n  help: remove --disturb")));
        };
        let found = Disturbed::new(&request.case, &bounds, &disturbance, request.rtol).map_err(absent)?;
        let rest = if self.feedback == Loop::Open { &found.open } else { &found.closed };
        let trace = of(&*found.head)?.then(of(&*rest.motion)?);
        let effects = Effects {
            disturbance,
            units: request.units,
            t: found.t,
            shown: if self.feedback == Loop::Open { "open" } else { "closed" },
            open: (found.open.work - found.planned.work, found.open.terminal_error),
            closed: (found.closed.work - found.planned.work, found.closed.terminal_error),
        };
        Ok((TracedPath { work: rest.work, ..found.planned }, trace, Some(effects)))
    }
}
