//! `slipsweep trace PROTOCOL` and `slipsweep trace DATASET TABLE --row N`: one protocol over time, as a table, CSV or
//! Parquet.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};

use super::kind::{self, Kind};
use super::output::{self, Output};
use super::{
    EXIT_FAILURE, EXIT_REQUEST, Failure, dataset, no_table, put, refused, say, whole, words, write_file, wrong,
};
use crate::dataset::frame;
use crate::dataset::{Cell, Folder, Manifest, ManifestTable, Row};
use crate::grid::{Domain, Quantity, RTOL, Scale};
use crate::model::{Friction, StateLaw, Units};
use crate::plot::table::{Condition, FilteredTable};
use crate::protocol::shortcut::Case;
use crate::protocol::{Motion, Status};
use crate::sweep::{Spec, friction, units};
use crate::table;
use crate::trace::{
    self, Absence, COLUMNS, Disturbance, Disturbed, Parameter, Pathless, Protocol, RANGE_RTOL, Times, Trace,
    TracedPath, VALUE_RTOL,
};
use crate::verify::scale;

/// Arguments of `trace`.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  slipsweep trace optimal --t-f 0.02 --a 0.03 --b 0.05 --v-i 3 --v-f 100
  slipsweep trace optimal --v-ceiling 300 --t-f 0.02 --a 0.03 --b 0.05 --v-i 3 --v-f 100 --out capped.csv
  slipsweep trace optimal --law slip --v-ceiling 600 --t-f 0.1 --a 0.03 --b 0.05 --v-i 4 --v-f 80
  slipsweep trace optimal --friction regularised --t-f 0.5 --a 0.1 --b 0.12 --v-i 50 --v-f 200
  slipsweep trace optimal --from theta=0.3,t_left=0.015 --a 0.03 --b 0.05 --v-f 100
  slipsweep trace optimal --disturb \"theta=+10% at 0.25\" --t-f 0.02 --a 0.03 --b 0.05 --v-i 3 --v-f 100
  slipsweep trace gap --alpha-2 -0.12 --alpha-3 -0.066 --t-f 0.02 --a 0.03 --b 0.05 --v-i 3 --v-f 100 --out cubic.csv
  slipsweep trace results/NAME optimal --row 17
  slipsweep trace results/NAME gap --where \"t_f=0.02, alpha_2=-0.12, alpha_3=-0.066\" --out row.csv"
)]
pub struct Arguments {
    /// Protocol, or folder of a dataset
    #[arg(value_name = "PROTOCOL|DATASET", value_parser = Subject)]
    subject: String,
    /// Table of the dataset
    table: Option<String>,
    /// Row of the table, counted from 0
    #[arg(long, value_name = "N", requires = "table", conflicts_with = "conditions", value_parser = whole::<u64>(0, u64::MAX))]
    row: Option<u64>,
    /// Conditions that one row of the table meets, such as "t_f=0.02, v_f=100"
    #[arg(long = "where", value_name = "CONDITION", requires = "table")]
    conditions: Vec<String>,
    /// Duration, in l/v_0; for a row of `step_response` the shown duration, in the units of the dataset
    #[arg(long, value_name = "T", value_parser = number(Quantity::Time))]
    t_f: Option<f64>,
    /// Direct effect: coefficient of ln v in friction, in mu_0
    #[arg(long, value_name = "A", value_parser = number(Quantity::A))]
    a: Option<f64>,
    /// Evolution effect: coefficient of ln theta in friction, in mu_0
    #[arg(long, value_name = "B", value_parser = number(Quantity::B))]
    b: Option<f64>,
    /// Evolution law of the state: ageing, slip or prz; ageing by default (optimal and best_cubic with --v-ceiling, gap, step_response)
    #[arg(long, value_name = "LAW", value_parser = law)]
    law: Option<StateLaw>,
    /// Form of friction: log or regularised; log by default (optimal, gap)
    #[arg(long, value_name = "FORM", value_parser = form)]
    friction: Option<Friction>,
    /// Velocity before the protocol, in v_0
    #[arg(long, value_name = "V", value_parser = number(Quantity::InitialVelocity))]
    v_i: Option<f64>,
    /// Velocity after the protocol, in v_0
    #[arg(long, value_name = "V", value_parser = number(Quantity::FinalVelocity))]
    v_f: Option<f64>,
    /// Velocity ceiling, in v_0 (optimal; for best_cubic that of the optimum)
    #[arg(long, value_name = "V", value_parser = number(Quantity::VelocityCeiling))]
    v_ceiling: Option<f64>,
    /// Friction ceiling, in mu_0 sigma (optimal, bounded_friction)
    #[arg(long, value_name = "M", value_parser = number(Quantity::FrictionCeiling))]
    tau_ceiling: Option<f64>,
    /// State and time left from which the protocol starts, as theta=0.3,t_left=0.015, instead of --v-i and --t-f (optimal)
    #[arg(long, value_name = "STATE", value_parser = state, conflicts_with_all = ["v_i", "t_f", "table"])]
    from: Option<State>,
    /// Sudden change of theta at a fraction of the duration, as "theta=+10% at 0.25"; compares open and closed loop; not with --points (optimal)
    #[arg(long, value_name = "CHANGE", value_parser = disturbance, conflicts_with_all = ["from", "points", "table"])]
    disturb: Option<Disturbance>,
    /// Protocol that is shown after the disturbance [default: closed]
    #[arg(
        long = "loop",
        value_name = "LOOP",
        default_value = "closed",
        hide_default_value = true,
        requires = "disturb"
    )]
    feedback: Loop,
    /// Coefficient of t in theta, in units of 1/t_f as in the table `best_cubic` (gap)
    #[arg(long, value_name = "X", value_parser = number(Quantity::Alpha2))]
    alpha_2: Option<f64>,
    /// Coefficient of t^2 in theta, in units of 1/t_f^2 (gap)
    #[arg(long, value_name = "Y", value_parser = number(Quantity::Alpha3))]
    alpha_3: Option<f64>,
    /// Stiffness of the spring, in mu_0 sigma/l; rigid by default (step_response, compliant, regularised)
    #[arg(long, value_name = "K", value_parser = number(Quantity::Stiffness))]
    k: Option<f64>,
    /// Mass of the block, in mu_0 sigma l/v_0^2; 0 by default (step_response, compliant, regularised)
    #[arg(long, value_name = "M", value_parser = number(Quantity::Mass))]
    m: Option<f64>,
    /// Length of the smooth pieces, in l/v_0 (regularised)
    #[arg(long, value_name = "D", value_parser = number(Quantity::Smoothing))]
    delta_t: Option<f64>,
    /// Without the velocity floor v >= 1 (optimal, best_cubic, regularised)
    #[arg(long)]
    unbounded: bool,
    /// Relative accuracy of the solution [default: 1e-10, or that of the table]
    #[arg(long, value_name = "R", value_parser = |text: &str| legal(text, RTOL))]
    rtol: Option<f64>,
    /// Number of equally spaced times [default: the fewest that show every detail]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(2, 10_000_000))]
    points: Option<u32>,
    #[command(flatten)]
    output: Output<Format>,
}

/// Format of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A header and aligned columns of nine digits (.txt)
    Table,
    /// All digits (.csv)
    Csv,
    /// With units and meanings (.parquet)
    Parquet,
}

impl output::Format for Format {
    const ENDINGS: &'static [(&'static str, Format)] =
        &[("csv", Format::Csv), ("parquet", Format::Parquet), ("txt", Format::Table)];
    const TABLE: Format = Format::Table;
    const PARQUET: Format = Format::Parquet;
}

/// The protocol that is shown after a disturbance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Loop {
    /// The optimal velocity of the disturbed state
    Closed,
    /// The velocity as planned
    Open,
}

/// The start of a protocol on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
struct State {
    theta: f64,
    t_left: f64,
}

/// Reads `theta=0.3,t_left=0.015`.
fn state(text: &str) -> Result<State, String> {
    let expected = || "expected theta=THETA,t_left=TIME".to_owned();
    let mut values = [None; 2];
    for part in text.split(',') {
        let (name, value) = part.split_once('=').ok_or_else(expected)?;
        let quantities = [Quantity::Theta, Quantity::TimeLeft];
        let place = quantities.iter().position(|quantity| quantity.name() == name.trim()).ok_or_else(expected)?;
        let value = legal(value.trim(), quantities[place].domain()).map_err(|error| format!("{name}: {error}"))?;
        if values[place].replace(value).is_some() {
            return Err(format!("{name} occurs twice"));
        }
    }
    let [Some(theta), Some(t_left)] = values else { return Err(expected()) };
    Ok(State { theta, t_left })
}

/// Reads `theta=+10% at 0.25`.
fn disturbance(text: &str) -> Result<Disturbance, String> {
    let expected =
        || "expected \"theta=+10% at 0.25\": a change in per cent, and a fraction of the duration".to_owned();
    let (change, at) = text.split_once(" at ").ok_or_else(expected)?;
    let (name, change) = change.split_once('=').ok_or_else(expected)?;
    let percent = change.trim().strip_suffix('%').ok_or_else(expected)?.trim();
    let percent: f64 = percent.parse().map_err(|_| expected())?;
    let at: f64 = at.trim().parse().map_err(|_| expected())?;
    if name.trim() != Quantity::Theta.name() {
        return Err(expected());
    }
    if !(percent > -100.0 && percent <= 1e6) {
        return Err("expected a change above -100 %, at most 1e6 %".to_owned());
    }
    if !(at > 0.0 && at < 1.0) {
        return Err("expected a fraction of the duration between 0 and 1".to_owned());
    }
    Ok(Disturbance { change: percent / 100.0, at })
}

/// Reads the name of a protocol, or a path.
#[derive(Debug, Clone)]
struct Subject;

/// The names of the protocols, with their meanings.
fn protocols() -> impl Iterator<Item = PossibleValue> {
    trace::names().map(|(name, doc)| PossibleValue::new(name).help(doc))
}

impl TypedValueParser for Subject {
    type Value = String;

    fn parse_ref(
        &self,
        command: &clap::Command,
        argument: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<String, clap::Error> {
        let path = Path::new(value);
        if path.components().count() > 1 || path.extension().is_some() || path.exists() {
            return StringValueParser::new().parse_ref(command, argument, value);
        }
        PossibleValuesParser::new(protocols()).parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(protocols()))
    }
}

/// Parses the word of an evolution law.
fn law(text: &str) -> Result<StateLaw, String> {
    let expected = || format!("expected {}", StateLaw::ALL.map(StateLaw::name).join(", "));
    StateLaw::find(text).ok_or_else(expected)
}

/// Parses the word of a form of friction.
fn form(text: &str) -> Result<Friction, String> {
    Friction::find(text).ok_or_else(|| format!("expected {}", Friction::ALL.map(Friction::name).join(", ")))
}

/// Parses a number in `domain`.
fn legal(text: &str, domain: Domain) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if domain.contains(value) => Ok(value),
        Ok(_) => Err(format!("expected {domain}")),
        Err(_) => Err(format!("not a number; expected {domain}")),
    }
}

/// A parser of a quantity. A velocity below 1 is probably in m/s.
fn number(quantity: Quantity) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        let is_small = text.parse().is_ok_and(|value: f64| value > 0.0 && value < 1.0);
        let help = match quantity.unit(Scale::Model) {
            "v_0" if is_small => "\n  help: velocities are in units of v_0; divide m/s by v_0",
            _ => "",
        };
        legal(text, quantity.domain()).map_err(|error| format!("{error}{help}"))
    }
}

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

/// A number with its unit in SI, if any.
struct Named {
    name: String,
    value: f64,
    unit: &'static str,
}

/// The row of a dataset.
struct Origin {
    dataset: String,
    table: String,
    row: u64,
    /// Whether the status of the row is infeasible.
    is_infeasible: bool,
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
    let least = trace.moments.iter().map(|moment| moment.friction).fold(f64::INFINITY, f64::min);
    path.status = path.status.with_friction(least);
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

/// Relative accuracy without a row of a table: the default of a spec.
const DEFAULT_RTOL: f64 = 1e-10;

/// Refuses the first of these flags that is given, since `what`, requested by `other`, does not support it.
fn refuse_first(flags: &[(bool, &str)], what: &str, other: &str) -> Result<(), Failure> {
    match flags.iter().find(|(is_given, _)| *is_given) {
        Some((_, flag)) => Err(wrong(format!("{flag} does not support {what}\n  help: remove {flag} or {other}"))),
        None => Ok(()),
    }
}

/// The flag that gives a quantity.
fn flag(quantity: Quantity) -> String {
    format!("--{}", quantity.name().replace('_', "-"))
}

impl Arguments {
    /// The numbers of a protocol.
    fn given(&self) -> [(Quantity, Option<f64>); 15] {
        [
            (Quantity::Time, self.t_f),
            (Quantity::Theta, self.from.map(|state| state.theta)),
            (Quantity::TimeLeft, self.from.map(|state| state.t_left)),
            (Quantity::A, self.a),
            (Quantity::B, self.b),
            (Quantity::Law, self.law.map(|law| f64::from(law as u8))),
            (Quantity::InitialVelocity, self.v_i),
            (Quantity::FinalVelocity, self.v_f),
            (Quantity::VelocityCeiling, self.v_ceiling),
            (Quantity::FrictionCeiling, self.tau_ceiling),
            (Quantity::Alpha2, self.alpha_2),
            (Quantity::Alpha3, self.alpha_3),
            (Quantity::Stiffness, self.k),
            (Quantity::Mass, self.m),
            (Quantity::Smoothing, self.delta_t),
        ]
    }

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
            rtol: self.rtol.unwrap_or(DEFAULT_RTOL),
            units: Units::Scaled,
            origin: None,
        })
    }

    /// The failure for a protocol that does not exist.
    fn absent(&self, request: &TraceRequest, absence: &Absence) -> Failure {
        let code = if absence.is_defect() { EXIT_FAILURE } else { EXIT_REQUEST };
        let Some(Origin { table, row, .. }) = &request.origin else {
            return Failure { code, message: format!("error: no `{}` protocol: {absence}", request.name) };
        };
        let reason = first_line(&absence.text(&request.units));
        Failure { code, message: format!("error: {}: row {row} of `{table}`: {reason}", self.subject) }
    }

    /// The protocol, its trace, and the effects of a disturbance if one is requested.
    fn traced(&self, request: &TraceRequest) -> Result<(TracedPath, Trace, Option<Effects>), Failure> {
        let absent = |absence| self.absent(request, &absence);
        let times = self.points.map_or(Times::Fewest, |count| Times::Spaced(count as usize));
        let of = |motion: &dyn Motion| {
            let trace = Trace::of(motion, &request.case.transition, times);
            trace.ok_or_else(|| Failure::failed("the protocol has more detail than a trace can resolve"))
        };
        let Some((disturbance, Protocol::Optimal { bounds })) = self.disturb.zip(Some(request.protocol)) else {
            let path = request.protocol.path(&request.case, request.rtol).map_err(absent)?;
            if let Some(Origin { table, row, .. }) = request.origin.as_ref().filter(|origin| origin.is_infeasible) {
                let reason = match table.as_str() {
                    "step_response" => "the response diverges: without mass the velocity becomes infinite",
                    _ => "its status is infeasible: the optimum that it is compared with does not exist",
                };
                return Err(wrong(format!("{}: row {row} of `{table}`: {reason}", self.subject)));
            }
            let trace = of(&*path.motion)?;
            return Ok((path, trace, None));
        };
        let found = Disturbed::new(&request.case, &bounds, &disturbance, request.rtol).map_err(absent)?;
        let rest = if self.feedback == Loop::Open { &found.open } else { &found.closed };
        let trace = of(&*found.head)?.then(of(&*rest.motion)?);
        let effects = Effects {
            disturbance,
            t: found.t,
            shown: if self.feedback == Loop::Open { "open" } else { "closed" },
            open: (found.open.work - found.planned.work, found.open.terminal_error),
            closed: (found.closed.work - found.planned.work, found.closed.terminal_error),
        };
        Ok((TracedPath { work: rest.work, ..found.planned }, trace, Some(effects)))
    }

    /// Checks that exactly the parameters of the protocol `name` are given.
    fn check(&self, name: &str) -> Result<(), Failure> {
        for (is_given, flag) in [(self.from.is_some(), "--from"), (self.disturb.is_some(), "--disturb")] {
            if is_given && name != "optimal" {
                return Err(wrong(format!("`{name}` takes no {flag}")));
            }
        }
        self.check_friction(name)?;
        self.check_law(name)?;
        let mut heeded = trace::quantities(if self.from.is_some() { "feedback" } else { name });
        heeded.retain(|quantity| self.is_ageing() || *quantity != Quantity::FrictionCeiling);
        let (given, missing): (Vec<_>, Vec<_>) = self.given().into_iter().partition(|(_, given)| given.is_some());
        let is_needed = |quantity: &Quantity| heeded.contains(quantity) && quantity.default().is_empty();
        let missing: Vec<Quantity> = missing.into_iter().map(|(quantity, _)| quantity).filter(is_needed).collect();
        if !missing.is_empty() {
            let flags: Vec<String> = missing.into_iter().map(flag).collect();
            return Err(wrong(format!("`{name}` needs {}", flags.join(", "))));
        }
        let unused = given.into_iter().find(|(quantity, _)| !heeded.contains(quantity));
        let is_unbounded = self.unbounded && !trace::has_floor(name, self.friction.unwrap_or_default());
        match unused.map(|(quantity, _)| flag(quantity)).or(is_unbounded.then(|| "--unbounded".to_owned())) {
            Some(flag) => Err(wrong(format!("`{name}` takes no {flag}"))),
            None => Ok(()),
        }
    }

    /// Checks that the protocol `name` and the other parameters support the form of friction.
    fn check_friction(&self, name: &str) -> Result<(), Failure> {
        if self.friction.unwrap_or_default() == Friction::Log {
            return Ok(());
        }
        let what = "regularised friction";
        if !trace::has_regularised_friction(name) {
            return Err(wrong(format!("`{name}` does not support {what}\n  help: remove --friction")));
        }
        self.refuse_starts(what, "--friction")?;
        let others = [
            (self.v_ceiling.is_some(), "--v-ceiling"),
            (self.tau_ceiling.is_some(), "--tau-ceiling"),
            (!self.is_ageing(), "--law"),
        ];
        refuse_first(&others, what, "--friction")
    }

    /// Checks that the other parameters support the evolution law.
    fn check_law(&self, name: &str) -> Result<(), Failure> {
        if self.is_ageing() {
            return Ok(());
        }
        let law = self.law.unwrap_or_default().name();
        self.refuse_starts(&format!("the law `{law}`"), "--law")?;
        if matches!(name, "optimal" | "best_cubic") && !self.v_ceiling.is_some_and(f64::is_finite) {
            let why = "without one, faster is always better";
            return Err(wrong(format!("the law `{law}` needs --v-ceiling: {why}\n  help: add --v-ceiling 1000")));
        }
        Ok(())
    }

    /// Refuses a start on the way, a disturbance and a missing floor, which `what` does not support.
    fn refuse_starts(&self, what: &str, flag: &str) -> Result<(), Failure> {
        let given =
            [(self.from.is_some(), "--from"), (self.disturb.is_some(), "--disturb"), (self.unbounded, "--unbounded")];
        refuse_first(&given, what, flag)
    }

    /// Whether the law is ageing.
    fn is_ageing(&self) -> bool {
        self.law.unwrap_or_default() == StateLaw::Ageing
    }

    /// The number of the row of a table.
    fn row_number(&self, source: &RowSource<'_>) -> Result<u64, Failure> {
        match self.row {
            Some(row) => Ok(row),
            None if self.conditions.is_empty() => {
                let RowSource { path, table, .. } = source;
                let expected = format!("--row N, from 0 to {}, or --where CONDITION", table.rows.saturating_sub(1));
                Err(refused(format!("{}: which row of `{}`?", path.display(), table.name), expected, "add --row 0"))
            }
            None => source.only_row(&self.conditions),
        }
    }

    /// The protocol of a row of a table.
    fn row_of(&self, name: &str) -> Result<TraceRequest, Failure> {
        let is_own = |quantity: Quantity| !(quantity == Quantity::Time && name == "step_response");
        let given = self.given().into_iter().find(|(quantity, given)| given.is_some() && is_own(*quantity));
        let words = [(self.friction.is_some(), "--friction"), (self.unbounded, "--unbounded")];
        let word = words.into_iter().find(|(is_given, _)| *is_given).map(|(_, flag)| flag.to_owned());
        let given = given.map(|(quantity, _)| flag(quantity)).or(word);
        if let Some(flag) = given {
            return Err(wrong(format!(
                "{flag}: not for a row of a dataset, which has its own parameters\n  help: remove {flag}"
            )));
        }
        let path = Path::new(&self.subject);
        if trace::names().any(|(known, _)| known == self.subject) && !path.exists() && Path::new(name).is_dir() {
            let help = format!("slipsweep trace {name} {} --row {}", self.subject, self.row.unwrap_or(0));
            return Err(refused(format!("{name}: a dataset after its table"), "the dataset, then the table", help));
        }
        let (folder, manifest) = dataset(path)?;
        let Some(table) = manifest.tables.iter().find(|table| table.name == name) else {
            let names: Vec<&str> = manifest.tables.iter().map(|table| table.name.as_str()).collect();
            return Err(no_table(&format!("{}: ", path.display()), name, &names));
        };
        if !trace::TABLES.contains(&name) {
            return Err(wrong(Pathless::Table(name.to_owned())));
        }
        let source = RowSource { path, folder: &folder, manifest: &manifest, table };
        let number = self.row_number(&source)?;
        let (part, written) = source.row(number)?;
        let spec = Spec::parse(&manifest.spec).map_err(Failure::failed)?;
        let units = units(&spec.model)?;
        let friction = friction(&spec.model)?;
        let headings = frame::headings(&part).map_err(Failure::failed)?.0;
        let relative = [Quantity::Alpha2, Quantity::Alpha3].map(|alpha| {
            let heading = headings.iter().find(|heading| heading.name == alpha.name());
            heading.is_some_and(|heading| heading.unit == units.name(alpha.unit(Scale::Duration)))
        });
        let definition = table::find(name);
        let mut scaled = written.clone();
        if let Some(definition) = definition {
            scale(&mut scaled, definition, &units, relative);
        }
        let bounded = spec.model.velocity_bound;
        let t_f = self.t_f.map(|t_f| units.scaled(Quantity::Time.unit(Scale::Model), t_f));
        let (protocol_name, protocol, case) = trace::protocol_of(name, &scaled, (friction, bounded, relative), t_f)
            .map_err(|reason| wrong(format!("{}: row {number} of `{name}`: {reason}", path.display())))?;
        let key = if name == "gap_min" { "gap" } else { name };
        let own = spec.tables.get(key).and_then(|table| table.rtol);
        let own = own.or(definition.and_then(|table| table.default_rtol())).unwrap_or(spec.accuracy.rtol);
        let mut numbers = axes_of(&written, &units);
        numbers.extend(self.t_f.map(|t_f| Named::new("t_f", t_f, units.name("l/v_0"))));
        let law = written.iter().find_map(|(name, cell)| match cell {
            Cell::Word(word) if name == Quantity::Law.name() => StateLaw::find(word),
            _ => None,
        });
        let infeasible = Cell::Word(Status::Infeasible.name().to_owned());
        let is_infeasible = written.iter().any(|(name, cell)| name == table::STATUS && *cell == infeasible);
        Ok(TraceRequest {
            bounded: trace::has_floor(name, friction).then_some(bounded),
            name: protocol_name,
            protocol,
            case,
            numbers,
            law,
            friction,
            rtol: self.rtol.unwrap_or(own),
            units,
            origin: Some(Origin { dataset: manifest.name.clone(), table: name.to_owned(), row: number, is_infeasible }),
        })
    }
}

/// The axes of a row that are finite numbers, with SI units if any. The coefficients of a cubic are parameters instead.
fn axes_of(row: &Row, units: &Units) -> Vec<Named> {
    let axis = |(name, cell): &(String, Cell)| {
        let quantity = Quantity::from_name(name).filter(|quantity| !quantity.has_scale())?;
        let Cell::Number(value) = cell else { return None };
        value.is_finite().then(|| Named::new(name, *value, si_name(units, quantity.unit(Scale::Model))))
    };
    row.iter().filter_map(axis).collect()
}

/// Greatest number of rows that a message names. Chosen: they fit on a line.
const MAX_NAMED_ROWS: usize = 5;

/// A table of the dataset in `path`.
struct RowSource<'a> {
    path: &'a Path,
    folder: &'a Folder,
    manifest: &'a Manifest,
    table: &'a ManifestTable,
}

impl RowSource<'_> {
    /// Reads a row from its part.
    fn row(&self, row: u64) -> Result<(PathBuf, Row), Failure> {
        let RowSource { path, folder, manifest, table } = self;
        if row >= table.rows {
            let (path, last) = (path.display(), table.rows.saturating_sub(1));
            return Err(wrong(format!("{path}: no row {row} in `{}`\n  expected: a row from 0 to {last}", table.name)));
        }
        let part = row / table.rows_per_part.max(1);
        let verified = folder.verified_part(manifest, table, part).map_err(Failure::failed)?;
        let file = verified.ok_or_else(|| {
            let (file, help) = (folder.part(&table.name, part), "run the sweep again; it computes only missing parts");
            wrong(format!("{}: row {row} is in a part that is missing\n  help: {help}", file.display()))
        })?;
        let place = usize::try_from(row - table.rows_of(part).start).map_err(Failure::failed)?;
        let row = frame::row(&file, place).map_err(Failure::failed)?;
        Ok((file, row))
    }

    /// The only row that meets all conditions.
    fn only_row(&self, conditions: &[String]) -> Result<u64, Failure> {
        let all = conditions.iter().map(|text| Condition::all(text)).collect::<Result<Vec<_>, _>>()?.concat();
        let found = self.rows(&all);
        let (at, name, conditions) = (self.path.display(), &self.table.name, conditions.join(", "));
        match found.as_slice() {
            [row] => Ok(*row),
            [] => Err(match FilteredTable::new(self.folder, self.manifest, name, &all) {
                Err(error) => error.into(),
                Ok(_) => Failure::failed(format!("{at}: the dataset has changed\n  help: repeat the command")),
            }),
            several => {
                let shown: Vec<String> = several.iter().take(MAX_NAMED_ROWS).map(u64::to_string).collect();
                let more = if several.len() > MAX_NAMED_ROWS { " and more" } else { "" };
                let what = format!("{at}: several rows of `{name}` meet --where {conditions:?}");
                let found = format!("{what}\n  found: rows {}{more}", shown.join(", "));
                let axes = self.differing_axes(several)?.join(", ");
                let more = if axes.is_empty() { String::new() } else { format!(", or a condition on {axes}") };
                Err(refused(found, "one row", format!("--row {}{more}", several[0])))
            }
        }
    }

    /// The first rows that meet all conditions, more than [`MAX_NAMED_ROWS`] if there are more; none if a column of a condition cannot be read.
    fn rows(&self, conditions: &[Condition]) -> Vec<u64> {
        let names: Vec<&str> = conditions.iter().map(|condition| condition.column.as_str()).collect();
        let mut found = Vec::new();
        for part in self.folder.parts_there(self.table) {
            let Ok(frame) = frame::read(&self.folder.part(&self.table.name, part), &names) else { return Vec::new() };
            let meets = |row: &usize| {
                frame.columns.iter().zip(conditions).all(|((_, cells), condition)| condition.holds_in(cells, *row))
            };
            let first = self.table.rows_of(part).start;
            found.extend((0..frame.height).filter(meets).take(MAX_NAMED_ROWS + 1).map(|row| first + row as u64));
            if found.len() > MAX_NAMED_ROWS {
                break;
            }
        }
        found
    }

    /// The axes in which rows differ.
    fn differing_axes(&self, numbers: &[u64]) -> Result<Vec<String>, Failure> {
        let rows: Vec<Row> = numbers.iter().map(|row| Ok(self.row(*row)?.1)).collect::<Result<_, Failure>>()?;
        let varies = |place: usize| rows.iter().any(|row| row.get(place) != rows[0].get(place));
        let names = rows[0].iter().enumerate().filter(|(place, _)| varies(*place)).map(|(_, (name, _))| name);
        Ok(names.filter(|name| Quantity::from_name(name).is_some()).cloned().collect())
    }
}

/// What a disturbance does to a protocol: the work beyond the planned one and the terminal error, by loop.
struct Effects {
    disturbance: Disturbance,
    t: f64,
    /// The name of the loop that is shown.
    shown: &'static str,
    open: (f64, f64),
    closed: (f64, f64),
}

impl Effects {
    fn text(&self) -> String {
        let change = words::number(100.0 * self.disturbance.change);
        let sign = if self.disturbance.change > 0.0 { "+" } else { "" };
        let line = |name: &str, (extra, error): (f64, f64)| {
            format!("    {name}: work {:+.6}, terminal_error {}\n", extra, words::number(error))
        };
        format!(
            "  disturbed: theta {sign}{change} % at t = {}; extra work, and relative miss of the target theta\n{}{}  shown: {} loop\n",
            words::number(self.t),
            line("open loop, v(t) as planned", self.open),
            line("closed loop, v(theta, t_left)", self.closed),
            self.shown,
        )
    }

    fn facts(&self) -> Vec<(String, String)> {
        [
            ("disturbed_theta", format!("{:?}", self.disturbance.change)),
            ("disturbed_at", format!("{:?}", self.t)),
            ("loop", self.shown.to_owned()),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .to_vec()
    }
}

/// The name of a unit in SI, else empty.
fn si_name(units: &Units, unit: &'static str) -> &'static str {
    if *units == Units::Scaled { "" } else { units.name(unit) }
}

impl Named {
    fn new(name: &str, value: f64, unit: &'static str) -> Named {
        Named { name: name.to_owned(), value, unit: if unit == "1" { "" } else { unit } }
    }

    /// Converts the scaled `value` to `units`.
    fn scaled(name: &str, value: f64, unit: &'static str, units: &Units) -> Named {
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

/// Fraction of the greatest velocity that equally spaced rows show. Chosen: less is visible in a picture.
const SHOWN_PEAK: f64 = 0.99;

/// The description of the protocol, in a few lines.
fn header(arguments: &Arguments, request: &TraceRequest, path: &TracedPath, trace: &Trace) -> String {
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
    if let Some(Origin { dataset, table, row, .. }) = &request.origin {
        text.push_str(&format!("  row {row} of table {table} of {dataset}\n"));
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
            let fastest = trace.moments.iter().map(|moment| moment.v).fold(0.0, f64::max);
            if fastest < SHOWN_PEAK * trace.v_max {
                let fastest = words::number(fastest);
                text.push_str(&format!("  these times miss v_max; the greatest v in the rows is {fastest}\n"));
            }
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

/// The aligned columns with their units. Times that nine digits do not distinguish have all digits.
fn table(trace: &Trace, units: &Units) -> String {
    let nine: Vec<String> = trace.moments.iter().map(|moment| words::number(moment.t)).collect();
    let mut pairs = trace.moments.windows(2).zip(nine.windows(2));
    let all_digits = pairs.any(|(moments, shown)| shown[0] == shown[1] && moments[0].t < moments[1].t);
    let columns = trace.columns();
    let mut lines = vec![columns.iter().map(|&column| COLUMNS[column].name.to_owned()).collect::<Vec<_>>()];
    lines.push(columns.iter().map(|&column| units.name(trace::unit(column)).to_owned()).collect());
    for moment in &trace.moments {
        let cell = |column: usize| match Trace::value(moment, column) {
            Some(t) if column == 0 && all_digits => format!("{t:?}"),
            Some(value) => words::number(value),
            None => "-".to_owned(),
        };
        lines.push(columns.iter().map(|&column| cell(column)).collect());
    }
    words::aligned(&lines, 2)
}

/// The metadata of a file.
fn facts(arguments: &Arguments, request: &TraceRequest, path: &TracedPath, trace: &Trace) -> Vec<(String, String)> {
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
    if let Some(Origin { dataset, table, row, .. }) = &request.origin {
        facts.extend([("dataset", dataset.clone()), ("table", table.clone()), ("row", row.to_string())]);
    }
    facts.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}
