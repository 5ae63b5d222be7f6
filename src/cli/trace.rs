//! `slipsweep trace PROTOCOL` and `slipsweep trace DATASET TABLE --row N`: one protocol over time, as a table, CSV or
//! Parquet.

use std::path::Path;

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};

use super::output::{self, Output};
use super::{FAILED, Failure, WRONG, dataset, no_table, put, say, words, write_file, wrong};
use crate::dataset::{Cell, Folder, ManifestTable, Row, frame};
use crate::grid::{Domain, Quantity, RTOL, Scale};
use crate::model::{Law, Transition, Units};
use crate::names::hint;
use crate::plot::table::Condition;
use crate::protocol::Status;
use crate::protocol::swift::{self, Case};
use crate::sweep::{Spec, units};
use crate::table;
use crate::trace::{
    self, Absence, COLUMNS, Course, Parameter, Pathless, Protocol, RANGE_RTOL, Times, Trace, VALUE_RTOL,
};
use crate::verify::scale;

/// Arguments of `trace`.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  slipsweep trace optimal --t-f 0.02 --a 0.03 --b 0.05 --v-i 3 --v-f 100
  slipsweep trace free_cubic --alpha-2 -0.12 --alpha-3 -0.066 --t-f 0.02 --a 0.03 --b 0.05 --v-i 3 --v-f 100 --out cubic.csv
  slipsweep trace results/NAME optimal --row 17
  slipsweep trace results/NAME gap --where \"t_f=0.02, alpha_2=-0.12, alpha_3=-0.066\" --out row.csv"
)]
pub struct Arguments {
    /// The protocol, or the folder of a dataset
    #[arg(value_name = "PROTOCOL|DATASET", value_parser = Subject)]
    subject: String,
    /// Table of the dataset
    table: Option<String>,
    /// Row of the table, counted from 0
    #[arg(long, value_name = "N", requires = "table", conflicts_with = "conditions")]
    row: Option<u64>,
    /// Conditions that one row of the table meets, such as "t_f=0.02, v_f=100"
    #[arg(long = "where", value_name = "CONDITION", requires = "table")]
    conditions: Vec<String>,
    /// Duration, in l/v_0; with a row of `step` how much of the response to show, in the units of the dataset
    #[arg(long, value_name = "T", value_parser = |text: &str| legal(text, Quantity::Time.domain()))]
    t_f: Option<f64>,
    /// Direct effect of the velocity on friction, in mu_0
    #[arg(long, value_name = "A", value_parser = |text: &str| legal(text, Quantity::A.domain()))]
    a: Option<f64>,
    /// Effect of the contact lifetime on friction, in mu_0
    #[arg(long, value_name = "B", value_parser = |text: &str| legal(text, Quantity::B.domain()))]
    b: Option<f64>,
    /// Velocity before the protocol, in v_0
    #[arg(long, value_name = "V", value_parser = |text: &str| legal(text, Quantity::InitialVelocity.domain()))]
    v_i: Option<f64>,
    /// Velocity after the protocol, in v_0
    #[arg(long, value_name = "V", value_parser = |text: &str| legal(text, Quantity::FinalVelocity.domain()))]
    v_f: Option<f64>,
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
    /// Relative accuracy of the solution [default: 1e-10, or that of the table]
    #[arg(long, value_name = "R", value_parser = |text: &str| legal(text, RTOL))]
    rtol: Option<f64>,
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

/// Reads the name of a protocol, or the path of a folder.
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
        if path.components().count() > 1 || path.is_dir() {
            return StringValueParser::new().parse_ref(command, argument, value);
        }
        PossibleValuesParser::new(protocols()).parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(protocols()))
    }
}

/// The number that `text` stands for, if it is in `domain`.
fn legal(text: &str, domain: Domain) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if domain.contains(value) => Ok(value),
        Ok(_) => Err(format!("expected {domain}")),
        Err(_) => Err(format!("not a number; expected {domain}")),
    }
}

/// What is to be traced, however it was named.
struct Asked {
    /// The name of the protocol.
    name: String,
    protocol: Protocol,
    /// In the units of the model.
    case: Case,
    /// What tells the protocol, number by number: name, value and unit as they were given.
    numbers: Vec<(String, f64, &'static str)>,
    /// Whether `v >= 1`, where that matters.
    bounded: Option<bool>,
    rtol: f64,
    units: Units,
    /// Dataset, table and row that it is from.
    origin: Vec<(&'static str, String)>,
}

/// Traces a protocol.
pub fn trace(arguments: &Arguments) -> Result<(), Failure> {
    let (format, output) = (arguments.output.format()?, &arguments.output);
    let asked = match &arguments.table {
        Some(table) => arguments.row_of(table)?,
        None => arguments.asked()?,
    };
    let mut course = asked.protocol.course(&asked.case, asked.rtol).map_err(|absence| absent(&asked.name, absence))?;
    let times = arguments.points.map_or(Times::Fewest, |count| Times::Spaced(count as usize));
    let Some(trace) = Trace::of(&*course.motion, &asked.case.transition, times) else {
        return Err(Failure::failed("the protocol shows more detail than can be resolved"));
    };
    let least = trace.moments.iter().map(|moment| moment.friction).fold(f64::INFINITY, f64::min);
    course.status = course.status.with_friction(least);
    let trace = trace.in_units(&asked.units);
    let header = header(arguments, &asked, &course, &trace);
    let facts = facts(arguments, &asked, &course, &trace);
    let version = env!("CARGO_PKG_VERSION");
    let bytes = match format {
        Format::Table => format!("{header}\n{}", table(&trace, &asked.units)).into_bytes(),
        Format::Csv => trace::csv(&trace, &asked.units, &facts, version).into_bytes(),
        Format::Parquet => trace::parquet(&trace, &asked.units, &facts, version).map_err(Failure::failed)?,
    };
    if output.is_stdout() {
        return put(&bytes);
    }
    write_file(&output.out, &bytes)?;
    say(&format!("{header}written to {}\n", output.out.display()))
}

fn absent(protocol: &str, absence: Absence) -> Failure {
    let code = if absence.is_defect() { FAILED } else { WRONG };
    Failure { code, message: format!("error: no `{protocol}` protocol: {absence}") }
}

impl Arguments {
    /// What the arguments name.
    fn asked(&self) -> Result<Asked, Failure> {
        if Path::new(&self.subject).is_dir() {
            return Err(wrong(format!(
                "{folder}: a folder, without a table\n  expected: a protocol, or a dataset with a table and a row\n  \
                 help: slipsweep trace {folder} optimal --row 0",
                folder = self.subject
            )));
        }
        let needed = &self.flags()[..5];
        let missing: Vec<&str> = needed.iter().filter(|(_, is_given)| !is_given).map(|(flag, _)| *flag).collect();
        if !missing.is_empty() {
            return Err(wrong(format!("`{}` needs {}", self.subject, missing.join(", "))));
        }
        let bounded = matches!(self.subject.as_str(), "optimal" | "best" | "regularised").then_some(!self.unbounded);
        Ok(Asked {
            name: self.subject.clone(),
            protocol: self.protocol()?,
            case: self.case(),
            numbers: self.numbers(),
            bounded,
            rtol: self.rtol.unwrap_or(DEFAULT_RTOL),
            units: Units::Scaled,
            origin: Vec::new(),
        })
    }

    /// The flags of the numbers of a protocol, those first that every protocol needs, and whether they are given.
    fn flags(&self) -> [(&'static str, bool); 12] {
        [
            ("--t-f", self.t_f.is_some()),
            ("--a", self.a.is_some()),
            ("--b", self.b.is_some()),
            ("--v-i", self.v_i.is_some()),
            ("--v-f", self.v_f.is_some()),
            ("--tau-max", self.tau_max.is_some()),
            ("--alpha-2", self.alpha_2.is_some()),
            ("--alpha-3", self.alpha_3.is_some()),
            ("--k", self.k.is_some()),
            ("--m", self.m.is_some()),
            ("--delta-t", self.delta_t.is_some()),
            ("--unbounded", self.unbounded),
        ]
    }

    /// The protocol of a row of a table.
    fn row_of(&self, name: &str) -> Result<Asked, Failure> {
        let is_own = |flag: &str| !(flag == "--t-f" && name == "step");
        if let Some((flag, _)) = self.flags().into_iter().find(|(flag, is_given)| *is_given && is_own(flag)) {
            return Err(wrong(format!("{flag}: the row of a dataset has its own\n  help: leave {flag} out")));
        }
        let path = Path::new(&self.subject);
        let (folder, manifest) = dataset(path)?;
        let Some(listed) = manifest.tables.iter().find(|table| table.name == name) else {
            let names: Vec<&str> = manifest.tables.iter().map(|table| table.name.as_str()).collect();
            return Err(no_table(&format!("{}: ", path.display()), name, &names));
        };
        if !trace::TABLES.contains(&name) {
            return Err(wrong(Pathless::Table(name.to_owned())));
        }
        let number = match self.row {
            Some(row) => row,
            None if self.conditions.is_empty() => {
                return Err(wrong(format!(
                    "{}: which row of `{name}`?\n  expected: --row N, from 0 to {}, or --where CONDITION\n  help: add --row 0",
                    path.display(),
                    listed.rows.saturating_sub(1)
                )));
            }
            None => the_row(path, &folder, listed, &self.conditions)?,
        };
        let (part, written) = row_at(path, &folder, listed, number)?;
        let spec: Spec = toml::from_str(&manifest.spec).map_err(Failure::failed)?;
        let units = units(&spec.model)?;
        let headings = frame::headings(&part).map_err(Failure::failed)?.0;
        let relative = [Quantity::Alpha2, Quantity::Alpha3].map(|alpha| {
            let heading = headings.iter().find(|heading| heading.name == alpha.name());
            heading.is_some_and(|heading| heading.unit == alpha.unit(Scale::Duration))
        });
        let definition = table::find(name);
        let mut scaled = [(number, written.clone())];
        if let Some(definition) = definition {
            scale(&mut scaled, definition, &units, relative);
        }
        let bounded = spec.model.velocity_bound;
        let t_f = self.t_f.map(|t_f| units.scaled(Quantity::Time.unit(Scale::Model), t_f));
        let (protocol_name, protocol, case) = trace::protocol_of(name, &scaled[0].1, (bounded, relative), t_f)
            .map_err(|reason| wrong(format!("{}: row {number} of `{name}`: {reason}", path.display())))?;
        let key = if name == "gap_min" { "gap" } else { name };
        let own = spec.tables.get(key).and_then(|table| table.rtol);
        let own = own.or(definition.and_then(|table| table.default_rtol())).unwrap_or(spec.accuracy.rtol);
        let mut numbers = axes_of(&written, &units);
        numbers.extend(self.t_f.map(|t_f| ("t_f".to_owned(), t_f, units.name("l/v_0"))));
        Ok(Asked {
            bounded: matches!(name, "optimal" | "best" | "regularised").then_some(bounded),
            name: protocol_name,
            protocol,
            case,
            numbers,
            rtol: self.rtol.unwrap_or(own),
            units,
            origin: vec![("dataset", manifest.name.clone()), ("table", name.to_owned()), ("row", number.to_string())],
        })
    }

    /// The protocol, once the arguments that it needs are there and no others.
    fn protocol(&self) -> Result<Protocol, Failure> {
        let name = self.subject.as_str();
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

    /// The case of a protocol, all of whose numbers are given.
    fn case(&self) -> Case {
        let [t_f, a, b, v_i, v_f] =
            [self.t_f, self.a, self.b, self.v_i, self.v_f].map(|given| given.unwrap_or(f64::NAN));
        Case {
            transition: Transition { law: Law { a, b }, v_i, v_f },
            t_f,
            tau_max: self.tau_max.unwrap_or(f64::INFINITY),
        }
    }

    /// What was asked for, number by number.
    fn numbers(&self) -> Vec<(String, f64, &'static str)> {
        let given = [
            ("t_f", self.t_f),
            ("a", self.a),
            ("b", self.b),
            ("v_i", self.v_i),
            ("v_f", self.v_f),
            ("tau_max", self.tau_max),
            ("k", self.k),
            ("m", self.m),
            ("delta_t", self.delta_t),
        ];
        given.into_iter().filter_map(|(name, given)| Some((name.to_owned(), given?, ""))).collect()
    }
}

/// Relative accuracy of a protocol that is no row of a table.
const DEFAULT_RTOL: f64 = 1e-10;

/// The axes of a row that are finite numbers, with their units where those are SI; the coefficients of a cubic are among its
/// parameters.
fn axes_of(row: &Row, units: &Units) -> Vec<(String, f64, &'static str)> {
    let axis = |(name, cell): &(String, Cell)| {
        let quantity = Quantity::from_name(name)?;
        let Cell::Number(value) = cell else { return None };
        let shown = value.is_finite() && !matches!(quantity, Quantity::Alpha2 | Quantity::Alpha3);
        let unit = if *units == Units::Scaled { "" } else { units.name(quantity.unit(Scale::Model)) };
        shown.then(|| (name.clone(), *value, unit))
    };
    row.iter().filter_map(axis).collect()
}

/// The part of a row of a table, and the row.
fn row_at(path: &Path, folder: &Folder, table: &ManifestTable, row: u64) -> Result<(std::path::PathBuf, Row), Failure> {
    if row >= table.rows {
        return Err(wrong(format!(
            "{}: no row {row} in `{}`\n  expected: a row from 0 to {}",
            path.display(),
            table.name,
            table.rows.saturating_sub(1)
        )));
    }
    let part = row / table.rows_per_part.max(1);
    let file = folder.part(&table.name, part);
    if !file.is_file() {
        return Err(wrong(format!(
            "{}: row {row} is in a part that is missing\n  help: run the sweep again, which makes only what is missing",
            file.display()
        )));
    }
    let place = usize::try_from(row - table.rows_of(part).start).map_err(Failure::failed)?;
    let row = frame::row(&file, place).map_err(Failure::failed)?;
    Ok((file, row))
}

/// Rows that a message names.
const NAMED: usize = 5;

/// The one row of a table that meets all conditions; of the parts only the columns of the conditions are read.
fn the_row(path: &Path, folder: &Folder, table: &ManifestTable, conditions: &[String]) -> Result<u64, Failure> {
    let mut all = Vec::new();
    for text in conditions {
        all.extend(Condition::all(text)?);
    }
    let names: Vec<&str> = all.iter().map(|condition| condition.column.as_str()).collect();
    let mut found = Vec::new();
    for part in folder.parts_there(table) {
        let file = folder.part(&table.name, part);
        if part == 0 || found.is_empty() {
            let headings = frame::headings(&file).map_err(Failure::failed)?.0;
            let known: Vec<&str> = headings.iter().map(|heading| heading.name.as_str()).collect();
            if let Some(unknown) = names.iter().find(|name| !known.contains(name)) {
                let help = hint(unknown, known.iter().copied());
                let expected = known.join(", ");
                return Err(wrong(format!(
                    "--where: `{}` has no column `{unknown}`\n  expected: {expected}\n  help: {help}",
                    table.name
                )));
            }
        }
        let frame = frame::read(&file, &names).map_err(Failure::failed)?;
        let first = table.rows_of(part).start;
        let meets = |place: &usize| {
            frame.row(*place).iter().zip(&all).all(|((_, cell), condition)| match cell {
                Cell::Number(number) => condition.holds(*number),
                Cell::Word(word) => condition.holds_word(Some(word)),
                Cell::Missing => false,
            })
        };
        found.extend((0..frame.height).filter(meets).take(NAMED + 1).map(|place| first + place as u64));
        if found.len() > NAMED {
            break;
        }
    }
    match found.as_slice() {
        [row] => Ok(*row),
        [] => Err(wrong(format!(
            "{}: no row of `{}` meets --where {:?}\n  help: slipsweep head {} {}",
            path.display(),
            table.name,
            conditions.join(", "),
            path.display(),
            table.name
        ))),
        several => {
            let shown: Vec<String> = several.iter().take(NAMED).map(u64::to_string).collect();
            let more = if several.len() > NAMED { " and more" } else { "" };
            Err(wrong(format!(
                "{}: several rows of `{}` meet --where {:?}\n  found: rows {}{more}\n  expected: one row\n  help: --row {}",
                path.display(),
                table.name,
                conditions.join(", "),
                shown.join(", "),
                several[0]
            )))
        }
    }
}

/// The value of a parameter in the units of what was asked for, and that unit where it is SI.
fn in_units(parameter: &Parameter, asked: &Asked) -> (f64, &'static str) {
    // The one parameter of a family that has a dimension.
    if parameter.name == "alpha" && asked.name == "bounded_velocity" && asked.units != Units::Scaled {
        let rate = asked.units.size("v_0/l");
        return (parameter.value * rate * rate, "1/s^2");
    }
    let unit = if asked.units == Units::Scaled { "" } else { asked.units.name(parameter.unit) };
    (parameter.value * asked.units.size(parameter.unit), unit)
}

/// A number with its unit, if that is to be shown.
fn with_unit(name: &str, value: f64, unit: &str) -> String {
    let gap = if unit.is_empty() || unit == "1" { "" } else { " " };
    let unit = if unit == "1" { "" } else { unit };
    format!("{name} = {}{gap}{unit}", words::number(value))
}

/// What the protocol is, in a few lines.
fn header(arguments: &Arguments, asked: &Asked, course: &Course, trace: &Trace) -> String {
    let doc = asked.protocol.doc(&asked.name);
    let numbers: Vec<String> = asked.numbers.iter().map(|(name, value, unit)| with_unit(name, *value, unit)).collect();
    let mut text = format!("{}: {doc}\n  at {}", asked.name, numbers.join(", "));
    if asked.bounded == Some(false) {
        text.push_str(", without the bound v >= 1");
    }
    text.push('\n');
    if let [(_, dataset), (_, table), (_, row)] = asked.origin.as_slice() {
        text.push_str(&format!("  row {row} of table {table} of {dataset}\n"));
    }
    for parameter in &course.parameters {
        let (value, unit) = in_units(parameter, asked);
        text.push_str(&format!("  {}: {}\n", with_unit(parameter.name, value, unit), parameter.doc));
    }
    let results: Vec<String> =
        results(asked, course, trace).into_iter().map(|(name, value, unit)| with_unit(name, value, unit)).collect();
    text.push_str(&format!("  {}\n  status {}\n", results.join(", "), status(course.status)));
    let rows = words::things(trace.moments.len() as u64, "row");
    match arguments.points {
        Some(_) => {
            text.push_str(&format!("  {rows}: equally spaced times, and the states on the other side of a jump\n"))
        }
        None => text.push_str(&format!(
            "  {rows}; straight lines between them are good to {} of the range of a column, and to {} of v and theta\n",
            words::number(RANGE_RTOL),
            words::number(VALUE_RTOL)
        )),
    }
    text
}

/// What comes out: name, value and unit where that is SI.
fn results(asked: &Asked, course: &Course, trace: &Trace) -> [(&'static str, f64, &'static str); 3] {
    let unit = |unit| if asked.units == Units::Scaled { "" } else { asked.units.name(unit) };
    let work = course.work * asked.units.size("mu_0 sigma l");
    [("work", work, unit("mu_0 sigma l")), ("v_min", trace.v_min, unit("v_0")), ("v_max", trace.v_max, unit("v_0"))]
}

fn status(status: Status) -> String {
    let meaning = match status {
        Status::BelowBound => ": v < 1 somewhere, outside the range of the friction law",
        Status::Infeasible => ": no protocol with v >= 1 arrives in this time",
        Status::NegativeFriction => ": friction < 0 somewhere, outside any friction law",
        Status::Nonphysical => ": friction is so low that the extremal need not be the only one",
        _ => "",
    };
    format!("{}{meaning}", status.name())
}

/// The columns with their units, aligned. Times that nine digits do not tell apart are shown with all of theirs.
fn table(trace: &Trace, units: &Units) -> String {
    let nine: Vec<String> = trace.moments.iter().map(|moment| words::number(moment.t)).collect();
    let pairs = trace.moments.windows(2).zip(nine.windows(2));
    let alike = |(moments, shown): (&[_], &[String])| {
        let moments: &[crate::protocol::Moment] = moments;
        shown[0] == shown[1] && moments[0].t < moments[1].t
    };
    let all_digits = pairs.into_iter().any(alike);
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

/// What a file says of itself.
fn facts(arguments: &Arguments, asked: &Asked, course: &Course, trace: &Trace) -> Vec<(String, String)> {
    let mut facts = vec![("protocol".to_owned(), asked.name.clone())];
    let mut number = |name: &str, value: f64| facts.push((name.to_owned(), format!("{value:?}")));
    for (name, value, _) in &asked.numbers {
        number(name, *value);
    }
    number("rtol", asked.rtol);
    for parameter in &course.parameters {
        number(parameter.name, in_units(parameter, asked).0);
    }
    for (name, value, _) in results(asked, course, trace) {
        number(name, value);
    }
    if let Some(bounded) = asked.bounded {
        facts.push(("velocity_bound".to_owned(), bounded.to_string()));
    }
    if let Some(points) = arguments.points {
        facts.push(("points".to_owned(), points.to_string()));
    }
    facts.push(("status".to_owned(), course.status.name().to_owned()));
    facts.extend(asked.origin.iter().map(|(key, value)| ((*key).to_owned(), value.clone())));
    facts
}
