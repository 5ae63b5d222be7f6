//! Laws that hold at every point, at points drawn at random: a failure is shrunk, and kept in `properties.regressions`,
//! whose points come first in every run.
//!
//! The draws are the same in every run; `PROPTEST_RNG_SEED` and `PROPTEST_CASES` request others and more of them.

use proptest::prelude::*;
use proptest::test_runner::{Config, FileFailurePersistence, RngSeed};

use slipsweep::model::{Law, Transition};
use slipsweep::numerics::elementary::ln;
use slipsweep::protocol::optimal::crossover::{self, CrossoverTimes, Wanted};
use slipsweep::protocol::optimal::{self, Optimum, Strategy as Start};
use slipsweep::protocol::shortcut::{Case, find};
use slipsweep::protocol::{SolverStats, Status, best_cubic};

const RTOL: f64 = 1e-10;

fn config(cases: u32) -> Config {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/solver/properties.regressions");
    let chosen = Config::default();
    Config {
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct(file))),
        cases: if std::env::var_os("PROPTEST_CASES").is_some() { chosen.cases } else { cases },
        rng_seed: match chosen.rng_seed {
            RngSeed::Random => RngSeed::Fixed(2026),
            fixed => fixed,
        },
        ..chosen
    }
}

/// Numbers that are as likely in each decade.
fn decades(least: f64, greatest: f64) -> impl Strategy<Value = f64> {
    (least.log10()..greatest.log10()).prop_map(|exponent| 10_f64.powf(exponent))
}

fn law() -> impl Strategy<Value = Law> {
    let b = prop_oneof![4 => decades(1e-3, 0.3), 1 => Just(0.0)];
    (decades(1e-3, 0.3), b, 0..5).prop_map(|(a, b, same)| Law { a, b: if same == 0 { a } else { b } })
}

fn velocity() -> impl Strategy<Value = f64> {
    decades(1e-3, 1e6).prop_map(|excess| 1.0 + excess)
}

fn transition() -> impl Strategy<Value = Transition> {
    (law(), velocity(), velocity()).prop_map(|(law, v_i, v_f)| Transition { law, v_i, v_f })
}

/// Faster at the end.
fn acceleration() -> impl Strategy<Value = Transition> {
    transition().prop_map(|t| Transition { v_i: t.v_i.min(t.v_f), v_f: t.v_i.max(t.v_f), ..t })
}

fn slowed() -> impl Strategy<Value = Transition> {
    transition().prop_map(|t| Transition { v_i: t.v_i.max(t.v_f), v_f: t.v_i.min(t.v_f), ..t })
}

/// A time that is feasible, and a matter of the transition.
fn time(transition: &Transition, fraction: f64) -> f64 {
    transition.min_duration().max(0.0) * (1.0 + fraction) + fraction / transition.v_i
}

/// The optimum where it is one of the model, else nothing to be said about.
fn optimum(transition: &Transition, t_f: f64, bounded: bool) -> Result<Optimum, TestCaseError> {
    let solved = optimal::solve(transition, t_f, bounded, RTOL);
    prop_assert_ne!(solved.status, Status::NotConverged, "{:?} {:?}", transition, t_f);
    match solved.status {
        Status::Ok | Status::BelowBound => Ok(solved.value.expect("is there")),
        _ => Err(TestCaseError::reject("outside of the model")),
    }
}

fn times(transition: &Transition) -> Result<CrossoverTimes, TestCaseError> {
    let wanted = Wanted { cross: true, floor: true, cheapest: true, min: true, turn: true, free: true };
    let (status, times, _) = crossover::solve(transition, true, RTOL, wanted);
    prop_assert_ne!(status, Status::NotConverged, "{:?}", transition);
    if status == Status::Ok { Ok(times) } else { Err(TestCaseError::reject("outside of the model")) }
}

fn close(found: f64, expected: f64, tolerance: f64) -> bool {
    found == expected || (found - expected).abs() <= tolerance * expected.abs()
}

proptest! {
    #![proptest_config(config(256))]

    /// `t_cheapest` is the global minimum of `W*`, from which it rises on both sides; `v(0+)` falls with the time.
    #[test]
    fn work_falls_until_the_cheapest_time_and_rises_after(
        transition in acceleration(),
        fractions in (decades(1e-6, 1.0), 0.0..1.0, decades(1.0, 1e4), decades(1.0, 1e2)),
    ) {
        let Some(cheapest) = times(&transition)?.t_cheapest else { return Err(TestCaseError::reject("none")) };
        let (far, near, late, later) = fractions;
        let before = [cheapest * far * near, cheapest * far];
        let after = [cheapest * late, cheapest * late * later];
        let of = |t_f: f64| optimum(&transition, t_f, true);
        let [first, second] = [of(before[0])?, of(before[1])?];
        let least = of(cheapest)?;
        let [third, fourth] = [of(after[0])?, of(after[1])?];
        for pair in [first, second, least].windows(2) {
            prop_assert!(pair[0].work >= pair[1].work * (1.0 - RTOL), "{pair:?}");
        }
        for pair in [least, third, fourth].windows(2) {
            prop_assert!(pair[1].work >= pair[0].work * (1.0 - RTOL), "{pair:?}");
        }
        for pair in [first, second, least, third, fourth].windows(2) {
            prop_assert!(pair[1].v_start <= pair[0].v_start * (1.0 + RTOL), "{pair:?}");
            prop_assert!(pair[1].time_at_floor >= pair[0].time_at_floor * (1.0 - RTOL), "{pair:?}");
        }
        prop_assert!(first.hamiltonian <= 0.0 && fourth.hamiltonian >= 0.0 || before[1] == cheapest, "{first:?} {fourth:?}");
    }

    /// The work of a deceleration rises with the time, and steepest where the final velocity does not jump.
    #[test]
    fn work_of_a_deceleration_rises(transition in slowed(), one in decades(1e-6, 1e3), more in decades(1e-6, 1e3)) {
        let t_f = time(&transition, one);
        let (early, late) = (optimum(&transition, t_f, true)?, optimum(&transition, t_f * (1.0 + more), true)?);
        prop_assert!(late.work >= early.work * (1.0 - RTOL), "{early:?} {late:?}");
        prop_assert!(early.hamiltonian > 0.0, "{early:?}");
        if let Some(t_turn) = times(&transition)?.t_turn {
            let steepest = optimum(&transition, t_turn, true)?.hamiltonian;
            prop_assert!(early.hamiltonian <= steepest * (1.0 + 1e-8), "{early:?} {steepest}");
        }
    }

    /// The strategy changes at the times of the crossover table.
    #[test]
    fn strategies_change_at_the_crossover_times(transition in acceleration(), fraction in decades(1e-9, 1.0)) {
        let CrossoverTimes { t_cross: Some(cross), t_floor: Some(hold), t_cheapest: Some(cheapest), .. } = times(&transition)? else {
            return Err(TestCaseError::reject("none"));
        };
        prop_assert!(cheapest <= cross * (1.0 + RTOL) && cross <= hold * (1.0 + RTOL), "{cheapest} {cross} {hold}");
        for (t_f, strategy) in [
            (cross * (1.0 - fraction), Start::SpeedUp),
            (cross + fraction * (hold - cross), Start::SlowDown),
            (hold * (1.0 + fraction), Start::Floor),
        ] {
            // Closer than the accuracy of the times either may be found.
            let clear = [cross, hold].iter().all(|time| (t_f / time - 1.0).abs() > 1e-9);
            prop_assert!(!clear || optimum(&transition, t_f, true)?.strategy == strategy, "{t_f} {strategy:?}");
        }
    }

    /// The bound costs work; without it the law has no velocity of its own: velocities may be taken `lambda` times as large and
    /// times as small if friction, `1 + (a - b) ln lambda` at the new unit, is in units of that.
    #[test]
    fn work_scales_with_the_unit_of_velocity(transition in transition(), fraction in decades(1e-6, 1e3), lambda in decades(1.0, 1e3)) {
        let t_f = time(&transition, fraction);
        let free = optimum(&transition, t_f, false)?;
        if let Ok(bounded) = optimum(&transition, t_f, true) {
            prop_assert!(bounded.work >= free.work * (1.0 - RTOL), "{bounded:?} {free:?}");
        }
        let Transition { law: Law { a, b }, v_i, v_f } = transition;
        let level = 1.0 + (a - b) * ln(lambda);
        prop_assume!(level > 0.1);
        let law = Law { a: a / level, b: b / level };
        let same = optimum(&Transition { law, ..transition }, t_f, false)?;
        let faster = optimum(&Transition { law: transition.law, v_i: lambda * v_i, v_f: lambda * v_f }, t_f / lambda, false)?;
        // What is subtracted inside is of the size of the terms of friction.
        let size = level * same.work.abs() + (a + b) * (ln(lambda * v_i.max(v_f)) + t_f * v_i);
        prop_assert!((faster.work - level * same.work).abs() <= 1e-9 * size, "{faster:?} {same:?} {level}");
        // Without a bound it may be a subnormal number, which has few digits.
        let subnormal = faster.v_start < 1e-300;
        prop_assert!(subnormal || close(faster.v_start, lambda * same.v_start, 1e-8), "{faster:?} {same:?}");
    }

    /// No shortcut that keeps to `v >= 1` costs less than the optimum.
    #[test]
    fn shortcuts_cost_no_less_than_the_optimum(transition in transition(), fraction in decades(1e-3, 1e3)) {
        let t_f = time(&transition, fraction);
        let least = optimum(&transition, t_f, true)?;
        for name in ["cubic", "bounded_velocity", "bounded_friction"] {
            let case = Case { transition, t_f, tau_ceiling: f64::INFINITY };
            let Ok(shortcut) = find(name).expect("is a family").solve(&case, RTOL, &mut SolverStats::default()) else { continue };
            let size = shortcut.work.abs().max(least.work.abs());
            prop_assert!(shortcut.v_min < 1.0 || shortcut.work >= least.work - 2.0 * RTOL * size, "{name} {shortcut:?} {least:?}");
            prop_assert!(shortcut.v_min <= shortcut.v_max, "{name} {shortcut:?}");
        }
    }
}

proptest! {
    #![proptest_config(config(32))]

    /// The best cubic shortcut is no worse than the one of continuous velocity, and no better than the optimum.
    #[test]
    fn the_best_shortcut_lies_between_the_cubic_and_the_optimum(transition in transition(), fraction in decades(1e-2, 1e2)) {
        let t_f = time(&transition, fraction);
        let least = optimum(&transition, t_f, true)?;
        let found = best_cubic::solve(&transition, t_f, true, RTOL);
        let Some(found) = found.value.filter(|_| found.status == Status::Ok) else {
            return Err(TestCaseError::reject("none"));
        };
        prop_assert!(found.gap >= 0.0 && close(found.work_optimal, least.work, 2.0 * RTOL), "{found:?} {least:?}");
        prop_assert!(found.v_min >= 1.0 - RTOL, "{found:?}");
        let case = Case { transition, t_f, tau_ceiling: f64::INFINITY };
        if let Ok(cubic) = find("cubic").expect("is a family").solve(&case, RTOL, &mut SolverStats::default())
            && cubic.v_min >= 1.0
        {
            prop_assert!(found.work <= cubic.work * (1.0 + 1e-9), "{found:?} {cubic:?}");
        }
    }
}
