//! The arguments of `slipsweep trace`, and which of them each protocol takes.

use std::path::Path;

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};

use super::{Failure, whole, wrong};
use crate::cli::output::Output;
use crate::grid::{Domain, Quantity, RTOL, Scale};
use crate::model::{Friction, StateLaw};
use crate::trace::{self, Disturbance};

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
    pub(super) subject: String,
    /// Table of the dataset
    pub(super) table: Option<String>,
    /// Row of the table, counted from 0
    #[arg(long, value_name = "N", requires = "table", conflicts_with = "conditions", value_parser = whole::<u64>(0, u64::MAX))]
    pub(super) row: Option<u64>,
    /// Conditions that one row of the table meets, such as "t_f=0.02, v_f=100"
    #[arg(long = "where", value_name = "CONDITION", requires = "table")]
    pub(super) conditions: Vec<String>,
    /// Duration, in l/v_0; for a row of `step_response` the shown duration, in the units of the dataset
    #[arg(long, value_name = "T", value_parser = number(Quantity::Time))]
    pub(super) t_f: Option<f64>,
    /// Direct effect: coefficient of ln v in friction, in mu_0
    #[arg(long, value_name = "A", value_parser = number(Quantity::A))]
    pub(super) a: Option<f64>,
    /// Evolution effect: coefficient of ln theta in friction, in mu_0
    #[arg(long, value_name = "B", value_parser = number(Quantity::B))]
    pub(super) b: Option<f64>,
    /// Evolution law of the state: ageing, slip or prz; ageing by default (optimal and best_cubic with --v-ceiling, gap, step_response)
    #[arg(long, value_name = "LAW", value_parser = law)]
    pub(super) law: Option<StateLaw>,
    /// Form of friction: log or regularised; log by default (optimal, gap)
    #[arg(long, value_name = "FORM", value_parser = form)]
    pub(super) friction: Option<Friction>,
    /// Velocity before the protocol, in v_0
    #[arg(long, value_name = "V", value_parser = number(Quantity::InitialVelocity))]
    pub(super) v_i: Option<f64>,
    /// Velocity after the protocol, in v_0
    #[arg(long, value_name = "V", value_parser = number(Quantity::FinalVelocity))]
    pub(super) v_f: Option<f64>,
    /// Velocity ceiling, in v_0 (optimal; for best_cubic that of the optimum)
    #[arg(long, value_name = "V", value_parser = number(Quantity::VelocityCeiling))]
    pub(super) v_ceiling: Option<f64>,
    /// Friction ceiling, in mu_0 sigma (optimal, bounded_friction)
    #[arg(long, value_name = "M", value_parser = number(Quantity::FrictionCeiling))]
    pub(super) tau_ceiling: Option<f64>,
    /// State and time left from which the protocol starts, as theta=0.3,t_left=0.015, instead of --v-i and --t-f (optimal)
    #[arg(long, value_name = "STATE", value_parser = state, conflicts_with_all = ["v_i", "t_f", "table"])]
    pub(super) from: Option<State>,
    /// Sudden change of theta at a fraction of the duration, as "theta=+10% at 0.25"; compares open and closed loop; not with --points (optimal)
    #[arg(long, value_name = "CHANGE", value_parser = disturbance, conflicts_with_all = ["from", "points"])]
    pub(super) disturb: Option<Disturbance>,
    /// Protocol that is shown after the disturbance [default: closed]
    #[arg(
        long = "loop",
        value_name = "LOOP",
        default_value = "closed",
        hide_default_value = true,
        requires = "disturb"
    )]
    pub(super) feedback: Loop,
    /// Coefficient of t in theta, in units of 1/t_f as in the table `best_cubic` (gap)
    #[arg(long, value_name = "X", value_parser = number(Quantity::Alpha2))]
    pub(super) alpha_2: Option<f64>,
    /// Coefficient of t^2 in theta, in units of 1/t_f^2 (gap)
    #[arg(long, value_name = "Y", value_parser = number(Quantity::Alpha3))]
    pub(super) alpha_3: Option<f64>,
    /// Stiffness of the spring, in mu_0 sigma/l; rigid by default (step_response, compliant, regularised)
    #[arg(long, value_name = "K", value_parser = number(Quantity::Stiffness))]
    pub(super) k: Option<f64>,
    /// Mass of the block, in mu_0 sigma l/v_0^2; 0 by default (step_response, compliant, regularised)
    #[arg(long, value_name = "M", value_parser = number(Quantity::Mass))]
    pub(super) m: Option<f64>,
    /// Length of the smooth pieces, in l/v_0 (regularised)
    #[arg(long, value_name = "D", value_parser = number(Quantity::Smoothing))]
    pub(super) delta_t: Option<f64>,
    /// Without the velocity floor v >= 1 (optimal, best_cubic, regularised)
    #[arg(long)]
    pub(super) unbounded: bool,
    /// Relative accuracy of the solution [default: 1e-10, or that of the table]
    #[arg(long, value_name = "R", value_parser = |text: &str| legal(text, RTOL))]
    pub(super) rtol: Option<f64>,
    /// Number of equally spaced times [default: the fewest that show every detail]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(2, 10_000_000))]
    pub(super) points: Option<u32>,
    #[command(flatten)]
    pub(super) output: Output<Format>,
}

/// Format of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// A header and aligned columns of nine digits (.txt)
    Table,
    /// All digits (.csv)
    Csv,
    /// With units and meanings (.parquet)
    Parquet,
}

/// The protocol that is shown after a disturbance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Loop {
    /// The optimal velocity of the disturbed state
    Closed,
    /// The velocity as planned
    Open,
}

/// The start of a protocol on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    pub theta: f64,
    pub t_left: f64,
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

/// The flag that gives a quantity.
pub(super) fn flag(quantity: Quantity) -> String {
    format!("--{}", quantity.name().replace('_', "-"))
}

impl Arguments {
    /// The numbers of a protocol.
    pub(super) fn given(&self) -> [(Quantity, Option<f64>); 15] {
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

    /// The names of all given options that determine a protocol.
    pub(super) fn flags(&self) -> Vec<String> {
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
    pub(super) fn check(&self, name: &str) -> Result<(), Failure> {
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
            let found = format!("`{name}` needs {}", flags.join(", "));
            return Err(wrong(format!(
                "{found}\n  help: add {}, or name a dataset and a row",
                if flags.len() > 1 { "them" } else { "it" }
            )));
        }
        match given.into_iter().find(|(quantity, _)| !heeded.contains(quantity)) {
            Some((quantity, _)) => {
                let flag = flag(quantity);
                Err(wrong(format!("`{name}` takes no {flag}\n  help: remove {flag}")))
            }
            None => Ok(()),
        }
    }

    /// Whether the law is ageing.
    pub(super) fn is_ageing(&self) -> bool {
        self.law.unwrap_or_default() == StateLaw::Ageing
    }
}
