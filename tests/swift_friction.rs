//! The family `bounded_friction` against a high-precision table, a library's ODE integrator and invariants.

mod reference;

use ode_solvers::dop_shared::OutputType;
use ode_solvers::{Dop853, SVector, System};
use slipsweep::model::{Law, Transition};
use slipsweep::protocol::swift::{Case, Obstacle, Swift, find};
use slipsweep::protocol::{Effort, Motion, Status};

const PAPER: Law = Law { a: 0.03, b: 0.05 };

fn case(law: Law, v_i: f64, v_f: f64, t_f: f64, tau_max: f64) -> Case {
    Case { transition: Transition { law, v_i, v_f }, t_f, tau_max }
}

fn solve(case: &Case, rtol: f64) -> Result<Swift, Obstacle> {
    find("bounded_friction").expect("is a family").solve(case, rtol, &mut Effort::default())
}

fn motion(case: &Case) -> Box<dyn Motion> {
    find("bounded_friction").expect("is a family").motion(case, 1e-11).unwrap_or_else(|o| panic!("{case:?}: {o}"))
}

fn relative(found: f64, expected: f64) -> f64 {
    if found == expected { 0.0 } else { ((found - expected) / expected).abs() }
}

fn in_table(row: &reference::Row) -> Case {
    let law = Law { a: row.number("a"), b: row.number("b") };
    case(law, row.number("v_i"), row.number("v_f"), row.number("t_f"), row.number("tau_max"))
}

/// What rounding makes of a number: that of the exponent `(tau - 1)/a`, which theta and v carry, that of `t_f` in the
/// time to spare, and the small rest that a great change of velocity leaves of theta.
fn rounding(case: &Case, row: &reference::Row) -> f64 {
    let Transition { law: Law { a, b }, v_i, v_f } = case.transition;
    let exponent = 64.0 * f64::EPSILON * (1.0 + (case.tau_max.abs() + b) / a);
    let rest = f64::EPSILON * v_i / v_f + if (v_f / v_i).ln().abs() > 8.0 { 2e-11 } else { 0.0 };
    exponent + lost_in_time(case, row) + rest
}

/// What rounding of `t_f` makes of the time to spare.
fn lost_in_time(case: &Case, row: &reference::Row) -> f64 {
    4.0 * f64::EPSILON * case.t_f / (case.t_f - row.number("t_least"))
}

#[test]
fn reference_every_number_is_good_to_rtol() {
    let rows = reference::table("swift_friction");
    assert!(rows.len() >= 40, "{} rows", rows.len());
    let mut faults = Vec::new();
    for rtol in [1e-6, 1e-10, 1e-12] {
        for row in &rows {
            let case = in_table(row);
            if row.text("status") == "infeasible" {
                assert_eq!(solve(&case, rtol).map_err(|o| o.status()), Err(Status::Infeasible), "{row:?}");
                continue;
            }
            let swift = match solve(&case, rtol) {
                Ok(swift) => swift,
                // The time cannot tell as much as it is asked for.
                Err(Obstacle::NotConverged) if lost_in_time(&case, row) > 100.0 * rtol => continue,
                Err(obstacle) => {
                    faults.push(format!("{rtol} {obstacle:?} in {row:?}"));
                    continue;
                }
            };
            for (name, found) in [
                ("alpha", swift.alpha.unwrap_or(f64::NAN)),
                ("work", swift.work),
                ("v_min", swift.v_min),
                ("v_max", swift.v_max),
                ("friction_max", swift.friction_max),
            ] {
                let error = relative(found, row.number(name));
                // A velocity of next to nothing carries the rounding of its exponent.
                let exponent = if name == "v_min" { 1.0 + row.number(name).max(1e-308).ln().abs() } else { 1.0 };
                let budget = (rtol + rounding(&case, row)) * exponent;
                if error.is_nan() || error > budget {
                    faults.push(format!("{name} at {rtol}: {found} off by {error:.1e} > {budget:.1e} in {row:?}"));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

/// `ln theta`, work and `x`, along the formula for tau.
struct Sliding {
    case: Case,
    alpha: f64,
    sign: f64,
}

impl System<f64, SVector<f64, 3>> for Sliding {
    fn system(&self, _: f64, y: &SVector<f64, 3>, dy: &mut SVector<f64, 3>) {
        let Transition { law, v_i, v_f } = self.case.transition;
        let gap = |v: f64| self.case.tau_max - 1.0 - (law.a - law.b) * v.ln();
        let x = y[2];
        let tau = self.case.tau_max - gap(v_i) * (x * (gap(v_f) / gap(v_i)).ln() + self.alpha * x * (1.0 - x)).exp();
        let v = ((tau - 1.0 - law.b * y[0]) / law.a).exp();
        dy[0] = self.sign * self.case.t_f * ((-y[0]).exp() - v);
        dy[1] = self.case.t_f * tau * v;
        dy[2] = self.sign;
    }
}

#[test]
fn a_librarys_integrator_arrives_with_the_same_work() {
    for (law, v_i, v_f, t_f, tau_max) in [
        (PAPER, 3.0, 100.0, 0.05, 1.6),
        (PAPER, 50.0, 4.0, 1.0, 2.0),
        (Law { a: 0.05, b: 0.03 }, 3.0, 100.0, 0.05, 1.6),
        (Law { a: 0.05, b: 0.05 }, 3.0, 10.0, 0.5, 1.6),
    ] {
        let case = case(law, v_i, v_f, t_f, tau_max);
        let swift = solve(&case, 1e-11).unwrap_or_else(|o| panic!("{case:?}: {o}"));
        let forward = law.b <= law.a;
        let (first, last) = if forward { (v_i, v_f) } else { (v_f, v_i) };
        let (x, sign) = if forward { (0.0, 1.0) } else { (1.0, -1.0) };
        let sliding = Sliding { case, alpha: swift.alpha.expect("has a parameter"), sign };
        let start = SVector::<f64, 3>::new(-f64::ln(first), 0.0, x);
        let mut stepper = Dop853::from_param(
            sliding,
            0.0,
            1.0,
            1.0,
            start,
            1e-13,
            1e-14,
            0.9,
            0.0,
            0.333,
            6.0,
            1.0,
            0.0,
            1_000_000,
            u32::MAX,
            OutputType::Sparse,
        );
        stepper.integrate().expect("integrates");
        let end = stepper.y_out().last().expect("has an end");
        assert!((end[0] + last.ln()).abs() < 1e-10, "{case:?}: {}", end[0] + last.ln());
        assert!(relative(swift.work, end[1]) < 1e-10, "{case:?}: {} {}", swift.work, end[1]);
    }
}

#[test]
fn equal_ends_give_steady_sliding() {
    for (v, tau_max) in [(3.0, 1.5), (1e8, 100.0), (1.001, 1.0 + 1e-4)] {
        let swift = solve(&case(PAPER, v, v, 2.0 / v, tau_max), 1e-10).expect("has a member");
        assert_eq!(swift.alpha, Some(0.0));
        let friction = 1.0 - 0.02 * f64::ln(v);
        assert!(relative(swift.work, friction * 2.0) < 1e-12, "{swift:?}");
        assert!(relative(swift.v_min, v) < 1e-12 && relative(swift.v_max, v) < 1e-12, "{swift:?}");
    }
}

#[test]
fn what_has_no_member_says_why() {
    let law = Law { a: 0.05, b: 0.03 };
    let ends = solve(&case(law, 3.0, 100.0, 0.1, 1.05), 1e-10).expect_err("is below tau_f");
    assert!(
        matches!(ends, Obstacle::FrictionAtEnds { friction } if relative(friction, 1.0 + 0.02 * 100f64.ln()) < 1e-14)
    );
    assert_eq!(solve(&case(law, 3.0, 100.0, 1e-4, 1.1), 1e-10), Err(Obstacle::Friction));
    assert_eq!(solve(&case(PAPER, 100.0, 3.0, 0.1, 1.6), 1e-10), Err(Obstacle::Velocity));
    for bad in [
        case(Law { a: 0.0, b: 0.1 }, 3.0, 9.0, 1.0, 2.0),
        case(PAPER, 0.5, 9.0, 1.0, 2.0),
        case(PAPER, 3.0, 9.0, 0.0, 2.0),
        case(PAPER, 3.0, 9.0, 1.0, f64::NAN),
    ] {
        assert_eq!(solve(&bad, 1e-10), Err(Obstacle::Domain), "{bad:?}");
    }
}

#[test]
fn motion_starts_and_ends_at_steady_sliding() {
    for law in [PAPER, Law { a: 0.05, b: 0.03 }] {
        let case = case(law, 3.0, 100.0, 0.05, 1.6);
        let motion = motion(&case);
        for (s, v, t) in [(0.0, 3.0, 0.0), (1.0, 100.0, 0.05)] {
            let moment = motion.at(s);
            assert!(relative(moment.v, v) < 1e-8 && relative(moment.theta, 1.0 / v) < 1e-9, "{moment:?}");
            assert!((moment.t - t).abs() < 1e-17, "{moment:?}");
        }
        for k in 0..=100 {
            let moment = motion.at(k as f64 / 100.0);
            let friction = 1.0 + law.a * moment.v.ln() + law.b * moment.theta.ln();
            assert!(relative(moment.friction, friction) < 1e-12, "{moment:?}");
            assert!(moment.friction < 1.6, "{moment:?}");
        }
        let marks = motion.landmarks();
        assert!(marks.first() == Some(&0.0) && marks.last() == Some(&1.0) && marks.is_sorted());
    }
}
