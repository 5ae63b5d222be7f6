//! Optimal protocols under ceilings, their slopes, least times and least ceilings, and the feedback law: against tables to
//! 25 digits, and against routes that share nothing with the solver.

use std::collections::BTreeMap;

use crate::reference::{self, Row};
use slipsweep::model::{Law, Transition};
use slipsweep::protocol::Status;
use slipsweep::protocol::optimal::{
    Bounds, feasible_times, feedback_at, least_tau_ceiling, least_v_ceiling, obstacle, slopes, solve,
};

/// The inputs of a problem, changed one by one to learn what their rounding does.
#[derive(Debug, Clone, Copy)]
struct Inputs {
    /// `a`, `b`, `v_i` or `theta`, `v_f`, `t_f` or `t_left`, `v_ceiling`, `tau_ceiling`.
    numbers: [f64; 7],
    floor: bool,
}

impl Inputs {
    fn of(row: &Row, start: &str, time: &str) -> Inputs {
        let names = ["a", "b", start, "v_f", time, "v_ceiling", "tau_ceiling"];
        Inputs { numbers: names.map(|name| row.number(name)), floor: row.text("bounded") == "1" }
    }

    fn law(&self) -> Law {
        Law { a: self.numbers[0], b: self.numbers[1] }
    }

    fn transition(&self) -> Transition {
        Transition { law: self.law(), v_i: self.numbers[2], v_f: self.numbers[3] }
    }

    fn time(&self) -> f64 {
        self.numbers[4]
    }

    fn bounds(&self) -> Bounds {
        Bounds::new(self.floor).with_v_ceiling(self.numbers[5]).with_tau_ceiling(self.numbers[6])
    }
}

/// Units in the last place by which an input is changed: differences over many rise above rounding.
const NUDGES: [i64; 3] = [1 << 20, 1 << 10, 1 << 5];

/// Units in the last place of each input that may count as its rounding.
const ROUNDINGS: f64 = 4.0;

/// What rounding of the inputs does to each number, all inputs together.
fn by_inputs<const N: usize>(inputs: &Inputs, find: impl Fn(&Inputs) -> Option<[f64; N]>) -> [f64; N] {
    let mut total = [0.0; N];
    let Some(here) = find(inputs) else { return total };
    for (place, &number) in inputs.numbers.iter().enumerate() {
        if number == 0.0 || !number.is_finite() {
            continue;
        }
        let mut least = [f64::INFINITY; N];
        for nudge in NUDGES {
            for units in [nudge, -nudge] {
                let mut other = *inputs;
                other.numbers[place] = f64::from_bits(number.to_bits().saturating_add_signed(units));
                let Some(there) = find(&other) else { continue };
                for i in 0..N {
                    least[i] = least[i].min((there[i] - here[i]).abs() / nudge as f64);
                }
            }
        }
        for (total, least) in total.iter_mut().zip(least) {
            *total += ROUNDINGS * if least.is_finite() { least } else { 0.0 };
        }
    }
    total
}

/// The greatest errors of each column in each structure, in units of what is allowed.
#[derive(Default)]
struct Errors {
    worst: BTreeMap<(String, String), (f64, String)>,
    failures: Vec<String>,
}

impl Errors {
    fn add(&mut self, column: &str, structure: &str, fraction: f64, what: String) {
        // NaN is a failure.
        if fraction.is_nan() || fraction > 1.0 {
            self.failures.push(format!("{column} {structure} {fraction:.1e}: {what}"));
        }
        let entry = self.worst.entry((column.into(), structure.into())).or_insert((0.0, String::new()));
        if fraction.is_nan() || fraction > entry.0 {
            *entry = (fraction, what);
        }
    }

    /// Fails where an error is larger than is allowed; with `SLIPSWEEP_ERRORS=1` lists the greatest of each column and structure.
    fn settle(self, table: &str) {
        if std::env::var_os("SLIPSWEEP_ERRORS").is_some() {
            for ((column, structure), (fraction, _)) in &self.worst {
                println!("{table},{column},{structure},{fraction:.2e}");
            }
        }
        let named = self.failures.iter().take(60).cloned().collect::<Vec<_>>().join("\n");
        assert!(self.failures.is_empty(), "{table}: {} failures\n{named}", self.failures.len());
    }
}

const OPTIMUM: [&str; 9] = [
    "work",
    "v_start",
    "v_end",
    "time_at_floor",
    "time_at_v_ceiling",
    "time_at_tau_ceiling",
    "hamiltonian",
    "theta_max",
    "friction_max",
];

fn optimum(inputs: &Inputs, rtol: f64) -> Option<[f64; 9]> {
    let found = solve(&inputs.transition(), inputs.time(), inputs.bounds(), rtol).value?;
    Some([
        found.work,
        found.v_start,
        found.v_end,
        found.time_at_floor,
        found.time_at_v_ceiling,
        found.time_at_tau_ceiling,
        found.hamiltonian,
        found.theta_max,
        found.friction_max,
    ])
}

const SLOPES: [&str; 6] =
    ["dwork_da", "dwork_db", "dwork_dv_i", "dwork_dv_f", "dwork_dv_ceiling", "dwork_dtau_ceiling"];

fn derivatives(inputs: &Inputs, rtol: f64) -> Option<[f64; 6]> {
    let found = slopes(&inputs.transition(), inputs.time(), inputs.bounds(), rtol).1?;
    Some([found.a, found.b, found.v_i, found.v_f, found.v_ceiling, found.tau_ceiling])
}

/// The tightest accuracy that a spec may request.
const FINE: f64 = 1e-13;

const ACCURACIES: [f64; 3] = [1e-6, 1e-10, FINE];

/// Slopes are good to this at the tightest accuracy: the one by a ceiling is an integral of differences. The greatest error
/// of `reference_slopes_under_ceilings` is 4.5e-13; `SLIPSWEEP_ERRORS=1 cargo test --release --test solver ceilings -- --nocapture`
/// lists the fractions.
const SLOPES_AT_BEST: f64 = 3e-13;

/// Compares numbers with the cells of a row, where they are not empty.
fn compare<const N: usize>(
    errors: &mut Errors,
    row: &Row,
    inputs: &Inputs,
    columns: [&str; N],
    find: impl Fn(&Inputs, f64) -> Option<[f64; N]>,
) {
    let structure = row.text("arcs").to_string();
    let doubt = by_inputs(inputs, |inputs| find(inputs, FINE));
    for rtol in ACCURACIES {
        let Some(found) = find(inputs, rtol) else {
            errors.add("status", &structure, f64::INFINITY, format!("{} no numbers at {rtol}: {inputs:?}", columns[0]));
            continue;
        };
        for (i, column) in columns.into_iter().enumerate() {
            let Some(expected) = row.optional(column) else { continue };
            // A time is what is left of t_f.
            let part = 16.0 * f64::EPSILON;
            let rest = if column.starts_with("time_at") { part * inputs.time() } else { 0.0 };
            let best = if column.starts_with("dwork") { rtol.max(SLOPES_AT_BEST) } else { rtol };
            let allowed = (2.0 * best + 16.0 * f64::EPSILON) * expected.abs() + doubt[i] + rest;
            let error = (found[i] - expected).abs();
            let fraction = if error == 0.0 { 0.0 } else { error / allowed };
            let what = format!("at {rtol} {} for {expected} {inputs:?}", found[i]);
            errors.add(column, &structure, fraction, what);
        }
    }
}

#[test]
fn reference_optima_under_ceilings() {
    let rows = reference::table("optimal_ceilings");
    let mut errors = Errors::default();
    for row in &rows {
        let inputs = Inputs::of(row, "v_i", "t_f");
        let solved = solve(&inputs.transition(), inputs.time(), inputs.bounds(), 1e-10);
        let below = !inputs.floor && row.number("v_start") < 1.0;
        let expected = if below { Status::BelowBound } else { Status::Ok };
        errors.add(
            "status",
            row.text("arcs"),
            f64::from(u8::from(solved.status != expected)) * 2.0,
            format!("{:?} {inputs:?}", solved.status),
        );
        compare(&mut errors, row, &inputs, OPTIMUM, optimum);
    }
    errors.settle("optimal_ceilings");
}

#[test]
fn reference_slopes_under_ceilings() {
    let mut errors = Errors::default();
    for row in &reference::table("optimal_ceilings") {
        let inputs = Inputs::of(row, "v_i", "t_f");
        compare(&mut errors, row, &inputs, SLOPES, derivatives);
    }
    errors.settle("slopes");
}

/// Where the protocol ends in steady sliding on a ceiling, the work has no corner.
#[test]
fn slopes_of_steady_sliding_on_a_ceiling_are_differences() {
    let rows = reference::table("optimal_ceilings");
    let sits = |row: &&Row| row.text("regime") == "sitting" && row.text("v_i") != row.text("v_f");
    for row in rows.iter().filter(sits) {
        let inputs = Inputs::of(row, "v_i", "t_f");
        let slopes = derivatives(&inputs, FINE).expect("has slopes");
        for (place, slope) in [(0, 0), (1, 1), (2, 2), (3, 3), (5, 4), (6, 5)] {
            let number = inputs.numbers[place];
            if number == 0.0 || !number.is_finite() {
                continue;
            }
            let work = |step: f64| {
                let mut other = inputs;
                other.numbers[place] += step;
                optimum(&other, FINE).expect("is feasible")[0]
            };
            let h = 1e-7 * number;
            let sides = [(work(h) - work(0.0)) / h, (work(0.0) - work(-h)) / h];
            for side in sides {
                let error = (side / slopes[slope] - 1.0).abs();
                assert!(error < 1e-4, "{} {sides:?} for {}: {inputs:?}", SLOPES[slope], slopes[slope]);
            }
        }
    }
}

#[test]
fn reference_least_times_and_least_ceilings() {
    let mut errors = Errors::default();
    for row in &reference::table("optimal_ceilings") {
        let inputs = Inputs::of(row, "v_i", "t_f");
        assert_eq!(obstacle(&inputs.transition(), inputs.time(), inputs.bounds()), None, "{inputs:?}");
        let columns = ["t_least", "v_ceiling_least", "tau_ceiling_least"];
        compare(&mut errors, row, &inputs, columns, |inputs, rtol| {
            let (transition, t_f, bounds) = (inputs.transition(), inputs.time(), inputs.bounds());
            let t_least = feasible_times(&transition, bounds)?.0;
            Some([
                t_least,
                least_v_ceiling(&transition, t_f, bounds, rtol)?,
                least_tau_ceiling(&transition, t_f, bounds, rtol)?,
            ])
        });
    }
    errors.settle("feasible");
}

/// A ceiling a little below the least feasible one, and a time a little below the least one, are infeasible.
#[test]
fn reference_infeasible_just_beyond_the_limits() {
    for row in &reference::table("optimal_ceilings") {
        let inputs = Inputs::of(row, "v_i", "t_f");
        let (transition, t_f, bounds) = (inputs.transition(), inputs.time(), inputs.bounds());
        let infeasible = |t_f: f64, bounds: Bounds| {
            let found = solve(&transition, t_f, bounds, 1e-10);
            assert_eq!(found.status, Status::Infeasible, "{row:?} {t_f} {bounds:?}");
            assert!(found.value.is_none() && obstacle(&transition, t_f, bounds).is_some(), "{row:?}");
        };
        let (v, tau) = (row.number("v_ceiling_least"), row.number("tau_ceiling_least"));
        infeasible(t_f, bounds.with_v_ceiling(v * (1.0 - 1e-9)));
        infeasible(t_f, bounds.with_tau_ceiling(tau - 1e-9 * tau.abs()));
        if row.number("t_least") > 0.0 {
            infeasible(row.number("t_least") * (1.0 - 1e-9), bounds);
        }
    }
}

#[test]
fn reference_feedback() {
    let columns = ["v", "work_to_go", "costate", "gain"];
    let find = |inputs: &Inputs, rtol: f64| {
        let [_, _, theta, v_f, t_left, ..] = inputs.numbers;
        let found = feedback_at(inputs.law(), theta, t_left, v_f, inputs.bounds(), rtol).value?;
        Some([found.v, found.work_to_go, found.costate, found.gain])
    };
    let mut errors = Errors::default();
    for row in &reference::table("feedback") {
        let inputs = Inputs::of(row, "theta", "t_left");
        let [_, _, theta, v_f, t_left, ..] = inputs.numbers;
        let solved = feedback_at(inputs.law(), theta, t_left, v_f, inputs.bounds(), 1e-10);
        if row.text("status") == "infeasible" {
            errors.add(
                "status",
                "infeasible",
                if solved.status == Status::Infeasible { 0.0 } else { 2.0 },
                format!("{inputs:?}"),
            );
            continue;
        }
        let arc = solved.value.map_or("none", |found| found.arc.name());
        errors.add(
            "arc",
            row.text("arcs"),
            if arc == row.text("arc") { 0.0 } else { 2.0 },
            format!("{arc} {inputs:?}"),
        );
        compare(&mut errors, row, &inputs, columns, find);
    }
    errors.settle("feedback");
}

/// From a theta above that of every steady state the protocol is that without the floor, if it does not fall below 1.
#[test]
fn feedback_from_old_contacts_has_no_floor() {
    let law = Law { a: 0.03, b: 0.05 };
    for theta in [1.0, 1.5, 100.0] {
        for t_left in [1e-3, 0.01, 0.5, 20.0] {
            let [found, free] = [true, false].map(|floor| feedback_at(law, theta, t_left, 10.0, floor, 1e-10));
            assert_eq!((found.status, found.value), (free.status, free.value), "{theta} {t_left}");
            let v = found.value.expect("has numbers").v;
            assert_eq!(found.status, if v < 1.0 { Status::BelowBound } else { Status::Ok }, "{theta} {t_left}");
        }
    }
    let v = feedback_at(law, 1.5, 0.01, 10.0, true, 1e-10).value.expect("is ok").v;
    assert!((v / 194.548809 - 1.0).abs() < 1e-8, "{v}");
}

/// Friction falls below `b - a`, that of steady sliding is at least `2 (b - a)`: works of tests/reference/ceilings.py to 20 digits.
#[test]
fn reference_optima_proven_although_friction_is_low() {
    const NONE: f64 = f64::INFINITY;
    for ([a, b, v_i, v_f, t_f], floor, [v_ceiling, tau_ceiling], work) in [
        ([0.112, 0.231, 259.0, 259.0, 0.0202], true, [14600.0, NONE], 1.1819318651446669),
        ([0.0748, 0.245, 44.4, 1.01, 4.63], true, [65.7, NONE], 4.256450653660342),
        ([0.246, 0.5, 4.77, 1.01, 6.39], true, [NONE, NONE], 5.873924494193371),
        ([0.252, 0.282, 939.0, 339.0, 0.00217], true, [NONE, 0.972], 0.03951780915517184),
        ([0.269, 0.5, 6.64, 1.02, 4.15], true, [1.17, 1.84], 3.5752858184937097),
        ([0.133, 0.221, 45.3, 1660.0, 0.193], false, [109000.0, NONE], 5.6401287484426526),
        ([0.237, 0.5, 5.58, 3.83, 1.19], false, [NONE, NONE], 2.041081882352123),
    ] {
        let transition = Transition { law: Law { a, b }, v_i, v_f };
        let bounds = Bounds { floor, v_ceiling, tau_ceiling };
        let solved = solve(&transition, t_f, bounds, FINE);
        let Some(found) = solved.value else { panic!("{transition:?} {solved:?}") };
        let status = if found.v_start < 1.0 { Status::BelowBound } else { Status::Ok };
        assert_eq!(solved.status, status, "{transition:?}");
        assert!((found.work / work - 1.0).abs() < 2e-13, "{transition:?} {found:?}");
    }
    let status = |a, b, v_i, v_f, t_f| solve(&Transition { law: Law { a, b }, v_i, v_f }, t_f, true, 1e-10).status;
    // Friction of steady sliding at v_i is 1.96 (b - a).
    assert_eq!(status(0.1, 0.3, 21.0, 3.0, 1.0), Status::Unproven);
    // On the floor at first, though a free arc should come before.
    assert_eq!(status(0.0957, 0.273, 24.8, 13.0, 0.0391), Status::Unproven);
}

/// The last step of the search ended where all of the path is on the ceiling, and found no member there.
#[test]
fn regress_times_within_roundings_of_the_greatest_are_solved() {
    for ([a, b, v_i, v_f, t_f], floor, [v_ceiling, tau_ceiling], rtol) in [
        (
            [0.001688701183722153, 0.00045415176754638753, 73391971.52354269, 9701.152279152298, 0.0001030738294141329],
            true,
            [1.301737469246437, 0.996275802594523],
            3.799694896454695e-10,
        ),
        (
            [0.002549442998066802, 0.030450811154495487, 26442.431032876433, 7.120833426735706, 0.14039522947702607],
            false,
            [4.824096977897136e-6, 0.9182076698666832],
            7.907537692149901e-8,
        ),
        (
            [0.033002543742235865, 0.033002543742235865, 8991385585.147257, 8368437.383641427, 1.193865057184922e-7],
            true,
            [154.22561577238633, 0.6401440220696943],
            5.531261120871604e-9,
        ),
    ] {
        let bounds = Bounds { floor, v_ceiling, tau_ceiling };
        let solved = solve(&Transition { law: Law { a, b }, v_i, v_f }, t_f, bounds, rtol);
        assert!(solved.value.is_some_and(|found| found.v_end <= v_ceiling), "{t_f} {solved:?}");
    }
}

/// Steady sliding on the ceiling after a turn that friction near 0 does not allow.
#[test]
fn regress_a_turn_where_friction_is_too_low_is_unproven() {
    let transition = Transition { law: Law { a: 0.03, b: 0.28 }, v_i: 1000.0, v_f: 400.0 };
    let bounds = Bounds { v_ceiling: 400.0, ..Bounds::from(true) };
    let solved = solve(&transition, 0.002, bounds, 1e-10);
    assert_eq!((solved.status, solved.value), (Status::Unproven, None));
}

/// Rounding alone keeps the ceiling off the friction of steady sliding at the end: the time on it has no digit, and was 15.6.
#[test]
fn regress_a_time_on_a_ceiling_beyond_the_duration_is_no_answer() {
    let law = Law { a: 0.005465879976621947, b: 0.0 };
    let transition = Transition { law, v_i: 194588.4328281252, v_f: 1.0134000213417642 };
    let bounds = Bounds::new(true).with_tau_ceiling(1.0000727565203265);
    let solved = solve(&transition, 4.325908089474069, bounds, 6.258699240760209e-12);
    assert_eq!((solved.status, solved.value), (Status::NotConverged, None));
}
