//! The bounds that solvers state of their own errors, against the true errors: a judge in double-double arithmetic over
//! random points, and the 40-digit tables.

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::optimal::{self, Optimum};
use slipsweep::protocol::shortcut::{Case, find};
use slipsweep::protocol::{SolverStats, SpringBlock, Status, best_cubic, compliant, error};

use crate::extent::quick_or_long;
use crate::stress::random::Random;
use crate::{judge, reference};

/// Points of the stress sample in a test.
fn points() -> u64 {
    quick_or_long(100, 800)
}

/// Accuracies that are requested.
const RTOLS: [f64; 6] = [1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13];

/// Coefficients of a path that leans on the steady one.
fn coefficients(random: &mut Random, transition: &Transition, t_f: f64) -> (f64, f64) {
    let (rise, lean) = (1.0 / transition.v_f - 1.0 / transition.v_i, t_f.min(1.0));
    let a_2 = 3.0 * rise * random.uniform() + lean * (1.5 * random.uniform() - 0.5);
    (a_2, rise * (6.0 * random.uniform() - 3.0) + lean * (1.5 * random.uniform() - 1.0))
}

/// What was found, the bound of its error, and what is true.
#[derive(Debug, Clone, Copy)]
struct BoundCheck {
    found: f64,
    bound: f64,
    truth: f64,
}

/// A bound holds in 999 of 1000 rows, and in the median it is no more than a hundred times the error, or half of the
/// last place where that is more.
fn assert_honest(tag: &str, checks: &[BoundCheck]) {
    let error = |check: &BoundCheck| (check.found - check.truth).abs();
    let broken: Vec<&BoundCheck> =
        checks.iter().filter(|check| error(check) > check.bound || check.bound.is_nan()).collect();
    assert!(broken.len() * 1000 <= checks.len(), "{tag}: {} of {}, {broken:?}", broken.len(), checks.len());
    let last_place = |check: &BoundCheck| 0.25 * f64::EPSILON * check.truth.abs();
    let mut ratios: Vec<f64> = checks.iter().map(|check| check.bound / error(check).max(last_place(check))).collect();
    ratios.sort_by(f64::total_cmp);
    println!(
        "{tag}: {} checks, {} broken, median of bound over error {:.1}",
        checks.len(),
        broken.len(),
        ratios[ratios.len() / 2]
    );
    assert!(ratios[ratios.len() / 2] <= 100.0, "{tag}: {}", ratios[ratios.len() / 2]);
}

/// Work, least velocity and status.
fn work(transition: &Transition, t_f: f64, rtol: f64, (a_2, a_3): (f64, f64)) -> (f64, f64, Status) {
    let (mut work, mut v_min, mut status) = ([f64::NAN], [f64::NAN], [Status::NotConverged]);
    let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
    Landscape::new(transition, t_f, rtol).evaluate(&[a_2], &[a_3], out);
    (work[0], v_min[0], status[0])
}

#[test]
fn work_errors_of_random_shortcuts_are_bounded_and_within_rtol() {
    let mut checks: [Vec<BoundCheck>; RTOLS.len()] = Default::default();
    let mut unjudged = 0;
    let points = points();
    for index in 0..points {
        let random = &mut Random::of("work_error of gap", index);
        let transition = random.transition();
        let t_f = random.duration(&transition, true);
        let place = coefficients(random, &transition, t_f);
        let (finest, _, status) = work(&transition, t_f, error::TIGHTEST_RTOL, place);
        if status == Status::Infeasible {
            continue;
        }
        let Some((truth, size)) = judge::shortcut_work(&transition, t_f, place) else {
            unjudged += 1;
            continue;
        };
        for (&rtol, checks) in RTOLS.iter().zip(&mut checks) {
            let (found, v_min, _) = work(&transition, t_f, rtol, place);
            let budget = (rtol + 4.0 * f64::EPSILON) * size;
            assert!((found - truth).abs() <= budget, "{transition:?} {t_f} {place:?} {rtol}: {found} {truth}");
            checks.push(BoundCheck { found, bound: error::of_shortcut(&transition, t_f, v_min, found, finest), truth });
        }
    }
    assert!(checks[0].len() as u64 > points / 3 && unjudged < points / 8, "{} {unjudged}", checks[0].len());
    for (rtol, checks) in RTOLS.iter().zip(&checks) {
        assert_honest(&format!("{rtol}"), checks);
    }
}

fn least_work(transition: &Transition, t_f: f64, bounded: bool, rtol: f64) -> Option<Optimum> {
    let solved = optimal::solve(transition, t_f, bounded, rtol);
    solved.value.filter(|_| matches!(solved.status, Status::Ok | Status::BelowBound))
}

#[test]
fn work_errors_of_random_optima_are_bounded() {
    let mut checks: [Vec<BoundCheck>; RTOLS.len()] = Default::default();
    let mut unjudged = 0;
    let points = points();
    for index in 0..points {
        let random = &mut Random::of("work_error of optimal", index);
        let (transition, bounded) = (random.transition(), random.chance(0.7));
        let t_f = random.duration(&transition, bounded);
        let Some(fine) = least_work(&transition, t_f, bounded, 1e-13) else { continue };
        let Some((truth, late)) = judge::optimal_work(&transition, t_f, &fine) else {
            unjudged += 1;
            continue;
        };
        if late > 1e-9 {
            unjudged += 1;
            continue;
        }
        for (&rtol, checks) in RTOLS.iter().zip(&mut checks) {
            let optimum = least_work(&transition, t_f, bounded, rtol).expect("is solved as the finer one is");
            let (bound, _) = error::of_optimum(&transition, t_f, bounded, &optimum);
            let check = BoundCheck { found: optimum.work, bound: bound.expect("has a bound"), truth };
            // What t_f itself leaves of a work that is a small difference.
            let given = f64::EPSILON * (4.0 * truth.abs() + (optimum.hamiltonian * t_f).abs());
            let budget = rtol * truth.abs() + given;
            assert!((check.found - truth).abs() <= budget, "{transition:?} {t_f} {bounded} {rtol}: {check:?}");
            checks.push(check);
        }
    }
    assert!(checks[0].len() as u64 > points / 3 && unjudged < points / 8, "{} {unjudged}", checks[0].len());
    for (rtol, checks) in RTOLS.iter().zip(&checks) {
        assert_honest(&format!("{rtol}"), checks);
    }
}

/// The judge knows nothing of the solvers, and the tables know nothing of the judge.
#[test]
fn reference_the_judge_is_right_to_the_last_bit() {
    for row in reference::table("landscape") {
        let Some(expected) = row.optional("work") else { continue };
        let (transition, place) = (transition(&row), (row.number("a_2"), row.number("a_3")));
        assert_eq!(
            judge::shortcut_work(&transition, row.number("t_f"), place).map(|(work, _)| work),
            Some(expected),
            "{row:?}"
        );
    }
    let mut judged = 0;
    for row in reference::table("optimal") {
        let (transition, t_f) = (transition(&row), row.number("t_f"));
        let optimum = optimal::solve(&transition, t_f, row.text("bounded") == "1", 1e-13).value.expect("has numbers");
        if let Some((found, late)) = judge::optimal_work(&transition, t_f, &optimum) {
            assert!(found == row.number("work") && late < 1e-11, "{found} {late:.1e} {row:?}");
            judged += 1;
        }
    }
    assert!(judged > 320, "{judged}");
}

fn transition(row: &reference::Row) -> Transition {
    let law = Law { a: row.number("a"), b: row.number("b") };
    Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") }
}

/// The checks of the rows of a table, at some accuracies.
fn checks(name: &str, rtols: &[f64], solve: impl Fn(&reference::Row, f64) -> Option<BoundCheck>) {
    let rows = reference::table(name);
    let found: Vec<BoundCheck> =
        rtols.iter().flat_map(|&rtol| rows.iter().filter_map(|row| solve(row, rtol)).collect::<Vec<_>>()).collect();
    assert!(found.len() > rows.len(), "{name}: {}", found.len());
    assert_honest(name, &found);
}

#[test]
fn reference_work_errors_of_families_are_bounded() {
    for name in ["shortcut_velocity", "shortcut_friction"] {
        checks(name, &RTOLS[..5], |row, rtol| {
            let family = if name == "shortcut_friction" { "bounded_friction" } else { row.text("family") };
            let tau_ceiling = if name == "shortcut_friction" { row.number("tau_ceiling") } else { f64::INFINITY };
            let case = Case { transition: transition(row), t_f: row.number("t_f"), tau_ceiling };
            let (family, stats) = (find(family)?, &mut SolverStats::default());
            let member = family.solve(&case, rtol, stats).ok()?;
            let bound = error::of_member(family, &case, &member, stats)?;
            Some(BoundCheck { found: member.work, bound, truth: row.optional("work")? })
        });
    }
}

#[test]
fn reference_work_errors_of_smooth_and_best_shortcuts_are_bounded() {
    checks("compliant", &RTOLS, |row, rtol| {
        let Transition { law, v_i, v_f } = transition(row);
        let slider = SpringBlock { law, k: row.number("k"), m: row.number("m") };
        let solve = |rtol| Some(compliant::solve(&slider, (v_i, v_f), row.number("t_f"), rtol).value?.work);
        let found = solve(rtol)?;
        Some(BoundCheck {
            found,
            bound: error::bound(found, solve(error::TIGHTEST_RTOL)?, found),
            truth: row.number("work"),
        })
    });
    checks("best_cubic", &[1e-10, 1e-12], |row, rtol| {
        let solve = |rtol| {
            Some(best_cubic::solve(&transition(row), row.number("t_f"), row.text("bounded") == "1", rtol).value?.work)
        };
        let found = solve(rtol)?;
        Some(BoundCheck {
            found,
            bound: error::bound(found, solve(error::TIGHTEST_RTOL)?, found),
            truth: row.number("work"),
        })
    });
}

/// Near `v_f = 1` the hold was the logarithm of a rest that had lost its digits.
#[test]
fn regress_long_holds_near_the_bound_keep_their_digits() {
    let law = Law { a: 0.06892476098268442, b: 0.06892476098268442 };
    let transition = Transition { law, v_i: 3.8313585412225946, v_f: 1.0000145426281766 };
    let t_f = 10.83597917609958;
    let found = least_work(&transition, t_f, true, 1e-13).expect("is solved");
    let (truth, late) = judge::optimal_work(&transition, t_f, &found).expect("is judged");
    assert!((found.work / truth - 1.0).abs() < 4.0 * f64::EPSILON && late < 1e-15, "{found:?} {truth} {late:.1e}");
}
