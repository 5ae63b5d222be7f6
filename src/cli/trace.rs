//! `slipsweep trace PROTOCOL`: one protocol over time, as a table, CSV or Parquet.

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser};

use super::output::{self, Output};
use super::{FAILED, Failure, WRONG, put, say, to_file, words, wrong};
use crate::grid::{Domain, Quantity, RTOL};
use crate::model::{Law, Transition};
use crate::protocol::Status;
use crate::protocol::swift::{self, Case};
use crate::trace::{self, Absence, CLOSE_UP, COLUMNS, Course, GOOD, Protocol, Times, Trace};

/// Arguments of `trace`.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  slipsweep trace optimal --t-f 0.02 --a 0.03 --b 0.05 --v-i 3 --v-f 100
  slipsweep trace free_cubic --alpha-2 -0.12 --alpha-3 -0.066 --t-f 0.02 --a 0.03 --b 0.05 --v-i 3 --v-f 100 --out cubic.csv"
)]
pub struct Arguments {
    /// The protocol
    #[arg(value_parser = protocols())]
    protocol: String,
    /// Duration, in l/v_0
    #[arg(long, value_name = "T", value_parser = |text: &str| legal(text, Quantity::Time.domain()))]
    t_f: f64,
    /// Direct effect of the velocity on friction, in mu_0
    #[arg(long, value_name = "A", value_parser = |text: &str| legal(text, Quantity::A.domain()))]
    a: f64,
    /// Effect of the contact lifetime on friction, in mu_0
    #[arg(long, value_name = "B", value_parser = |text: &str| legal(text, Quantity::B.domain()))]
    b: f64,
    /// Velocity before the protocol, in v_0
    #[arg(long, value_name = "V", value_parser = |text: &str| legal(text, Quantity::InitialVelocity.domain()))]
    v_i: f64,
    /// Velocity after the protocol, in v_0
    #[arg(long, value_name = "V", value_parser = |text: &str| legal(text, Quantity::FinalVelocity.domain()))]
    v_f: f64,
    /// Bound on friction, in mu_0 sigma (bounded_friction)
    #[arg(long, value_name = "M", value_parser = |text: &str| legal(text, Quantity::FrictionBound.domain()))]
    tau_max: Option<f64>,
    /// Coefficient of t in theta, in units of 1/t_f as in the table `best` (free_cubic)
    #[arg(long, value_name = "X", value_parser = |text: &str| legal(text, Quantity::Alpha2.domain()))]
    alpha_2: Option<f64>,
    /// Coefficient of t^2 in theta, in units of 1/t_f^2 (free_cubic)
    #[arg(long, value_name = "Y", value_parser = |text: &str| legal(text, Quantity::Alpha3.domain()))]
    alpha_3: Option<f64>,
    /// Stiffness of the spring, in mu_0 sigma/l; rigid by default (compliant, regularised; step, which then is the response to a jump of v_c)
    #[arg(long, value_name = "K", value_parser = |text: &str| legal(text, Quantity::Stiffness.domain()))]
    k: Option<f64>,
    /// Mass of the block, in mu_0 sigma l/v_0^2; 0 by default (step, compliant, regularised)
    #[arg(long, value_name = "M", value_parser = |text: &str| legal(text, Quantity::Mass.domain()))]
    m: Option<f64>,
    /// Length of the smooth pieces, in l/v_0 (regularised)
    #[arg(long, value_name = "D", value_parser = |text: &str| legal(text, Quantity::Smoothing.domain()))]
    delta_t: Option<f64>,
    /// Without the bound v >= 1 (optimal, best, regularised)
    #[arg(long)]
    unbounded: bool,
    /// Relative accuracy of the solution
    #[arg(long, value_name = "R", default_value = "1e-10", value_parser = |text: &str| legal(text, RTOL))]
    rtol: f64,
    /// So many equally spaced times instead of the fewest that show every detail
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=10_000_000))]
    points: Option<u32>,
    #[command(flatten)]
    output: Output<Format>,
}

/// How a trace is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Aligned columns of nine digits under a few words (.txt)
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

/// The names of the protocols, with their meanings.
fn protocols() -> PossibleValuesParser {
    trace::names().map(|(name, doc)| PossibleValue::new(name).help(doc)).collect::<Vec<_>>().into()
}

/// The number that `text` stands for, if it is in `domain`.
fn legal(text: &str, domain: Domain) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if domain.contains(value) => Ok(value),
        Ok(_) => Err(format!("expected {domain}")),
        Err(_) => Err(format!("not a number; expected {domain}")),
    }
}

/// Traces a protocol.
pub fn trace(arguments: &Arguments) -> Result<(), Failure> {
    let (format, output) = (arguments.output.format()?, &arguments.output);
    let protocol = arguments.protocol()?;
    let case = arguments.case();
    let course = protocol.course(&case, arguments.rtol).map_err(|absence| absent(&arguments.protocol, absence))?;
    let times = arguments.points.map_or(Times::Fewest, |count| Times::Spaced(count as usize));
    let Some(trace) = Trace::of(&*course.motion, &case.transition, times) else {
        return Err(Failure::failed("the protocol shows more detail than can be resolved"));
    };
    let header = header(arguments, &protocol, &course, &trace);
    let bytes = match format {
        Format::Table => format!("{header}\n{}", table(&trace)).into_bytes(),
        Format::Csv => trace::csv(&trace).into_bytes(),
        Format::Parquet => trace::parquet(&trace, &facts(arguments, &course, &trace), env!("CARGO_PKG_VERSION"))
            .map_err(Failure::failed)?,
    };
    if output.is_stdout() {
        return put(&bytes);
    }
    to_file(&output.out, |file| file.write_all(&bytes))
        .map_err(|error| Failure::failed(format!("cannot write {}: {error}", output.out.display())))?;
    say(&format!("{header}written to {}\n", output.out.display()))
}

fn absent(protocol: &str, absence: Absence) -> Failure {
    let code = if absence.is_defect() { FAILED } else { WRONG };
    Failure { code, message: format!("error: no `{protocol}` protocol: {absence}") }
}

impl Arguments {
    /// The protocol, once the arguments that it needs are there and no others.
    fn protocol(&self) -> Result<Protocol, Failure> {
        let name = self.protocol.as_str();
        let family = swift::find(name);
        let given = [
            ("--tau-max", self.tau_max.is_some(), family.is_some_and(|family| family.heeds_tau_max()), false),
            ("--alpha-2", self.alpha_2.is_some(), name == "free_cubic", true),
            ("--alpha-3", self.alpha_3.is_some(), name == "free_cubic", true),
            ("--k", self.k.is_some(), matches!(name, "step" | "compliant" | "regularised"), false),
            ("--m", self.m.is_some(), matches!(name, "step" | "compliant" | "regularised"), false),
            ("--delta-t", self.delta_t.is_some(), name == "regularised", true),
            ("--unbounded", self.unbounded, matches!(name, "optimal" | "best" | "regularised"), false),
        ];
        for (flag, is_given, is_heeded, is_needed) in given {
            if is_given && !is_heeded {
                return Err(wrong(format!("`{name}` takes no {flag}")));
            }
            if !is_given && is_heeded && is_needed {
                return Err(wrong(format!("`{name}` needs {flag}")));
            }
        }
        let bounded = !self.unbounded;
        let (k, m) = (self.k.unwrap_or(f64::INFINITY), self.m.unwrap_or(0.0));
        Ok(match (name, self.alpha_2, self.alpha_3, family) {
            ("optimal", ..) => Protocol::Optimal { bounded },
            ("best", ..) => Protocol::Best { bounded },
            ("compliant", ..) => Protocol::Compliant { k, m },
            ("regularised", ..) => Protocol::Regularised { k, m, delta_t: self.delta_t.unwrap_or(f64::NAN), bounded },
            ("step", ..) if k.is_finite() && self.v_i != self.v_f => Protocol::Response { k, m },
            (_, Some(a_2), Some(a_3), _) => Protocol::FreeCubic { a_2, a_3 },
            (.., Some(family)) => Protocol::Family(family),
            _ => return Err(wrong(format!("no protocol is named `{name}`"))),
        })
    }

    fn case(&self) -> Case {
        Case {
            transition: Transition { law: Law { a: self.a, b: self.b }, v_i: self.v_i, v_f: self.v_f },
            t_f: self.t_f,
            tau_max: self.tau_max.unwrap_or(f64::INFINITY),
        }
    }

    /// What was asked for, number by number.
    fn numbers(&self) -> Vec<(&'static str, f64)> {
        let mut numbers = vec![("t_f", self.t_f), ("a", self.a), ("b", self.b), ("v_i", self.v_i), ("v_f", self.v_f)];
        for (name, given) in [("tau_max", self.tau_max), ("k", self.k), ("m", self.m), ("delta_t", self.delta_t)] {
            numbers.extend(given.map(|value| (name, value)));
        }
        numbers
    }
}

/// What the protocol is, in a few lines.
fn header(arguments: &Arguments, protocol: &Protocol, course: &Course, trace: &Trace) -> String {
    let doc = protocol.doc(&arguments.protocol);
    let listed = |numbers: &[(&'static str, f64)]| {
        let cells: Vec<String> =
            numbers.iter().map(|(name, value)| format!("{name} = {}", words::number(*value))).collect();
        cells.join(", ")
    };
    let mut text = format!("{}: {doc}\n  at {}", arguments.protocol, listed(&arguments.numbers()));
    if arguments.unbounded {
        text.push_str(", without the bound v >= 1");
    }
    text.push('\n');
    for (name, value, meaning) in &course.parameters {
        text.push_str(&format!("  {name} = {}: {meaning}\n", words::number(*value)));
    }
    let results = [("work", course.work), ("v_min", trace.v_min), ("v_max", trace.v_max)];
    text.push_str(&format!("  {}\n  status {}\n", listed(&results), status(course.status)));
    let rows = words::things(trace.moments.len() as u64, "row");
    match arguments.points {
        Some(_) => {
            text.push_str(&format!("  {rows}: equally spaced times, and the states on the other side of a jump\n"))
        }
        None => text.push_str(&format!(
            "  {rows}; straight lines between them are good to {} of the range of a column, and to {} of v and theta\n",
            words::number(GOOD),
            words::number(CLOSE_UP)
        )),
    }
    text
}

fn status(status: Status) -> String {
    let meaning = match status {
        Status::BelowBound => ": v < 1 somewhere, outside the range of the friction law",
        Status::Infeasible => ": no protocol with v >= 1 arrives in this time",
        Status::Nonphysical => ": friction is so low that the extremal need not be the only one",
        _ => "",
    };
    format!("{}{meaning}", status.name())
}

/// The columns, aligned. Times that nine digits do not tell apart are shown with all of theirs.
fn table(trace: &Trace) -> String {
    let nine: Vec<String> = trace.moments.iter().map(|moment| words::number(moment.t)).collect();
    let pairs = trace.moments.windows(2).zip(nine.windows(2));
    let alike = |(moments, shown): (&[_], &[String])| {
        let moments: &[crate::protocol::Moment] = moments;
        shown[0] == shown[1] && moments[0].t < moments[1].t
    };
    let all_digits = pairs.into_iter().any(alike);
    let columns = trace.columns();
    let mut lines = vec![columns.iter().map(|&column| COLUMNS[column].name.to_owned()).collect::<Vec<_>>()];
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

/// What a file says of itself.
fn facts(arguments: &Arguments, course: &Course, trace: &Trace) -> Vec<(String, String)> {
    let mut facts = vec![("protocol".to_owned(), arguments.protocol.clone())];
    let mut number = |name: &str, value: f64| facts.push((name.to_owned(), format!("{value:?}")));
    for (name, value) in arguments.numbers() {
        number(name, value);
    }
    number("rtol", arguments.rtol);
    for &(name, value, _) in &course.parameters {
        number(name, value);
    }
    for (name, value) in [("work", course.work), ("v_min", trace.v_min), ("v_max", trace.v_max)] {
        number(name, value);
    }
    if matches!(arguments.protocol.as_str(), "optimal" | "best" | "regularised") {
        facts.push(("velocity_bound".to_owned(), (!arguments.unbounded).to_string()));
    }
    if let Some(points) = arguments.points {
        facts.push(("points".to_owned(), points.to_string()));
    }
    facts.push(("status".to_owned(), course.status.name().to_owned()));
    facts
}
