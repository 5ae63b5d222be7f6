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
    let text: String = text.split_whitespace().collect();
    let parts = text.strip_prefix("theta=").and_then(|rest| rest.split_once(",t_left="));
    let (theta, t_left) = parts.ok_or("expected theta=THETA,t_left=TIME")?;
    let [theta, t_left] = [(theta, Quantity::Theta), (t_left, Quantity::TimeLeft)]
        .map(|(text, quantity)| legal(text.trim(), quantity.domain()));
    Ok(State { theta: theta?, t_left: t_left? })
}

/// Reads `theta=+10% at 0.25`.
fn disturbance(text: &str) -> Result<Disturbance, String> {
    let parts = text.strip_prefix("theta=").and_then(|rest| rest.split_once("% at "));
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let numbers = parts.and_then(|(percent, at)| Some((number(percent)?, number(at)?)));
    let legal = numbers.filter(|&(percent, at)| percent > -100.0 && percent <= 1e6 && at > 0.0 && at < 1.0);
    let expected =
        "expected \"theta=+10% at 0.25\": a change above -100 %, at a fraction of the duration between 0 and 1";
    legal.map(|(percent, at)| Disturbance { change: percent / 100.0, at }).ok_or_else(|| expected.to_owned())
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
    StateLaw::find(text).ok_or_else(|| format!("expected {}", StateLaw::ALL.map(StateLaw::name).join(", ")))
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

/// A parser of a quantity.
fn number(quantity: Quantity) -> impl Fn(&str) -> Result<f64, String> + Clone {
    let unit = quantity.unit(Scale::Model);
    let unit = if unit == "1" { String::new() } else { format!(", in units of {unit}") };
    move |text| legal(text, quantity.domain()).map_err(|expected| expected + &unit)
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
                let reason = "its status is infeasible: the response diverges, or its optimum does not exist";
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

    /// The names of all given options that determine a protocol.
    fn flags(&self) -> Vec<String> {
        let numbers =
            self.given().into_iter().filter(|(quantity, given)| given.is_some() && *quantity != Quantity::Law);
        let others = [
            (self.from.is_some(), "--from"),
            (self.disturb.is_some(), "--disturb"),
            (!self.is_ageing(), "--law"),
            (self.friction.is_some(), "--friction"),
            (self.unbounded, "--unbounded"),
        ];
        let others = others.into_iter().filter(|(is_given, _)| *is_given).map(|(_, flag)| flag.to_owned());
        numbers.map(|(quantity, _)| flag(quantity)).chain(others).collect()
    }

    /// Checks that exactly the parameters of the protocol `name` are given.
    fn check(&self, name: &str) -> Result<(), Failure> {
        let friction = self.friction.unwrap_or_default();
        let mut refused: Vec<(&str, String)> = Vec::new();
        if name != "optimal" {
            refused.extend(["--from", "--disturb"].map(|flag| (flag, format!("`{name}`"))));
        }
        if !trace::has_floor(name, friction) {
            refused.push(("--unbounded", format!("`{name}`")));
        }
        if friction == Friction::Regularised {
            if !trace::has_regularised_friction(name) {
                return Err(wrong(format!(
                    "`{name}` does not support regularised friction\n  help: remove --friction"
                )));
            }
            let flags = ["--from", "--disturb", "--unbounded", "--v-ceiling", "--tau-ceiling", "--law"];
            refused.extend(flags.map(|flag| (flag, "regularised friction".to_owned())));
        } else if !self.is_ageing() {
            let law = format!("the law `{}`", self.law.unwrap_or_default().name());
            if matches!(name, "optimal" | "best_cubic") && !self.v_ceiling.is_some_and(f64::is_finite) {
                let why = "without one, faster is always better";
                return Err(wrong(format!("{law} needs --v-ceiling: {why}\n  help: add --v-ceiling 1000")));
            }
            refused.extend(["--from", "--disturb", "--unbounded", "--tau-ceiling"].map(|flag| (flag, law.clone())));
        }
        let given = self.flags();
        if let Some((flag, what)) = refused.iter().find(|(flag, _)| given.iter().any(|given| given == flag)) {
            return Err(wrong(format!("{what} takes no {flag}\n  help: remove {flag}")));
        }
        let heeded = trace::quantities(if self.from.is_some() { "feedback" } else { name });
        let (given, missing): (Vec<_>, Vec<_>) = self.given().into_iter().partition(|(_, given)| given.is_some());
        let is_needed = |quantity: &Quantity| heeded.contains(quantity) && quantity.default().is_empty();
        let missing: Vec<Quantity> = missing.into_iter().map(|(quantity, _)| quantity).filter(is_needed).collect();
        if !missing.is_empty() {
            let flags: Vec<String> = missing.into_iter().map(flag).collect();
            return Err(wrong(format!("`{name}` needs {}", flags.join(", "))));
        }
        match given.into_iter().find(|(quantity, _)| !heeded.contains(quantity)) {
            Some((quantity, _)) => Err(wrong(format!("`{name}` takes no {}", flag(quantity)))),
            None => Ok(()),
        }
    }

    /// Whether the law is ageing.
    fn is_ageing(&self) -> bool {
        self.law.unwrap_or_default() == StateLaw::Ageing
    }

    /// The protocol of a row of a table.
    fn row_of(&self, name: &str) -> Result<TraceRequest, Failure> {
        let is_own = |flag: &&String| !(*flag == "--t-f" && name == "step_response");
        if let Some(flag) = self.flags().iter().find(is_own) {
            let why = "not for a row of a dataset, which has its own parameters";
            return Err(wrong(format!("{flag}: {why}\n  help: remove {flag}")));
        }
        let path = Path::new(&self.subject);
        let (folder, manifest) = dataset(path)?;
        let Some(table) = manifest.tables.iter().find(|table| table.name == name) else {
            let names: Vec<&str> = manifest.tables.iter().map(|table| table.name.as_str()).collect();
            return Err(no_table(&format!("{}: ", path.display()), name, &names));
        };
        if !trace::TABLES.contains(&name) {
            return Err(wrong(Pathless::Table(name.to_owned())));
        }
        let source = RowSource { path, folder: &folder, manifest: &manifest, table };
        let number = match self.row {
            Some(row) => row,
            None => source.only_row(&self.conditions)?,
        };
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
        let word = |key: &str| {
            let cell = written.iter().find(|(name, _)| name == key).map(|(_, cell)| cell);
            cell.and_then(|cell| if let Cell::Word(word) = cell { Some(word.as_str()) } else { None })
        };
        let law = word(Quantity::Law.name()).and_then(StateLaw::find);
        let is_infeasible = word(table::STATUS) == Some(Status::Infeasible.name());
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
        let (at, name) = (self.path.display(), &self.table.name);
        if conditions.is_empty() {
            let expected = format!("--row N, from 0 to {}, or --where CONDITION", self.table.rows.saturating_sub(1));
            return Err(refused(format!("{at}: which row of `{name}`?"), expected, "add --row 0"));
        }
        let all = conditions.iter().map(|text| Condition::all(text)).collect::<Result<Vec<_>, _>>()?.concat();
        match self.rows(&all).as_slice() {
            [row] => Ok(*row),
            [] => Err(match FilteredTable::new(self.folder, self.manifest, name, &all) {
                Err(error) => error.into(),
                Ok(_) => Failure::failed(format!("{at}: the dataset has changed\n  help: repeat the command")),
            }),
            several => {
                let shown: Vec<String> = several.iter().take(MAX_NAMED_ROWS).map(u64::to_string).collect();
                let more = if several.len() > MAX_NAMED_ROWS { " and more" } else { "" };
                let what = format!("{at}: several rows of `{name}` meet --where {:?}", conditions.join(", "));
                let found = format!("{what}\n  found: rows {}{more}", shown.join(", "));
                Err(refused(found, "one row", format!("--row {}, or a further condition", several[0])))
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
            let sign = if extra < 0.0 { "" } else { "+" };
            format!("    {name}: work {sign}{}, terminal_error {}\n", words::number(extra), words::number(error))
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
        let (extra, error) = if self.shown == "open" { self.open } else { self.closed };
        [
            ("disturbed_theta", format!("{:?}", self.disturbance.change)),
            ("disturbed_at", format!("{:?}", self.t)),
            ("loop", self.shown.to_owned()),
            ("extra_work", format!("{extra:?}")),
            ("terminal_error", format!("{error:?}")),
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
fn table(trace: &Trace, units: &Units) -> String {
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
