//! The best cubic shortcut against a 40-digit table, the paper's figures, and a search by brute force.

mod reference;

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::best::{Best, solve};
use slipsweep::protocol::cubic::{Landscape, Shortcuts};
use slipsweep::protocol::{Status, optimal};

const PAPER: Transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.0, v_f: 100.0 };

fn best(transition: &Transition, t_f: f64, bounded: bool) -> Best {
    let solved = solve(transition, t_f, bounded, 1e-10);
    assert!(matches!(solved.status, Status::Ok | Status::BelowBound), "{transition:?} {t_f} {:?}", solved.status);
    solved.value.expect("a solved row has values")
}

fn relative(found: f64, expected: f64) -> f64 {
    ((found - expected) / expected).abs()
}

/// Least work over a grid of `n x n` places around `(a_2, a_3)`, at a distance of up to `reach`, among those with `v >=
/// 1` or `v > 0`.
fn scan(transition: &Transition, t_f: f64, bounded: bool, centre: (f64, f64), reach: f64, n: usize) -> f64 {
    let landscape = Landscape::new(transition, t_f, 1e-12);
    let at = |middle: f64, i: usize| middle + reach * (2.0 * i as f64 / (n - 1) as f64 - 1.0);
    let a_3: Vec<f64> = (0..n).map(|i| at(centre.1, i)).collect();
    let mut least = f64::INFINITY;
    for i in 0..n {
        let (mut work, mut v_min) = (vec![0.0; n], vec![0.0; n]);
        let mut status = vec![Status::NotConverged; n];
        let out = Shortcuts { work: &mut work, v_min: &mut v_min, status: &mut status };
        landscape.evaluate(&vec![at(centre.0, i); n], &a_3, out);
        for (work, status) in work.into_iter().zip(status) {
            if (status == Status::Ok || (!bounded && status == Status::BelowBound)) && work < least {
                least = work;
            }
        }
    }
    least
}

#[test]
fn paper_best_shortcut_lies_at_minus_0_12_and_minus_0_068_with_a_gap_close_to_zero() {
    let found = best(&PAPER, 0.02, true);
    assert!((found.a_2 + 0.1198296).abs() < 1e-7 && (found.a_3 + 0.0664228).abs() < 1e-7, "{found:?}");
    assert!((found.a_2 + 0.12).abs() < 5e-3 && (found.a_3 + 0.068).abs() < 5e-3);
    assert!(relative(found.gap, 6.580308e-7) < 1e-6, "{found:?}");
    let later = best(&PAPER, 0.037, true);
    assert!(relative(later.gap, 1.1321e-4) < 1e-4 && (later.a_2 + 0.05364).abs() < 1e-5, "{later:?}");
}

#[test]
fn paper_at_0_049_the_best_shortcut_touches_the_bound_inside() {
    let found = best(&PAPER, 0.049, true);
    assert!(relative(found.gap, 6.2112e-4) < 1e-4 && found.v_min == 1.0, "{found:?}");
    assert!((found.a_2 + 0.07618).abs() < 1e-5 && (found.a_3 - 0.49105).abs() < 1e-5, "{found:?}");
    let free = best(&PAPER, 0.049, false);
    assert!(relative(free.gap, 5.6751e-4) < 1e-4 && (free.v_min - 0.19).abs() < 1e-2, "{free:?}");
    assert_eq!(solve(&PAPER, 0.049, false, 1e-10).status, Status::BelowBound);
}

#[test]
fn reference_best_shortcuts() {
    let rows = reference::table("best");
    assert!(rows.len() >= 8, "{} rows", rows.len());
    for row in &rows {
        let law = Law { a: row.number("a"), b: row.number("b") };
        let transition = Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") };
        let found = best(&transition, row.number("t_f"), row.text("bounded") == "1");
        for (name, found, budget) in [
            ("a_2", found.a_2, 1e-9),
            ("a_3", found.a_3, 1e-9),
            ("work", found.work, 2e-12),
            ("work_optimal", found.work_optimal, 2e-12),
            ("gap", found.gap, 1e-7),
            ("v_min", found.v_min, 1e-8),
        ] {
            let error = relative(found, row.number(name));
            assert!(error < budget, "{name} {found} off by {error:.1e} in {row:?}");
        }
    }
}

#[test]
fn no_shortcut_on_a_fine_grid_costs_less() {
    let cases = [
        (PAPER, 0.02, true),
        (PAPER, 0.049, true),
        (PAPER, 0.049, false),
        (PAPER, 0.1, false),
        (PAPER, 0.5, true),
        (PAPER, 5.0, true),
        (PAPER, 1e-6, true),
        (Transition { v_i: 100.0, v_f: 3.0, ..PAPER }, 0.4, true),
        (Transition { v_i: 100.0, v_f: 3.0, ..PAPER }, 2.0, true),
        (Transition { law: Law { a: 0.1, b: 0.0 }, ..PAPER }, 0.05, true),
        (Transition { v_f: 3.001, ..PAPER }, 0.01, true),
    ];
    for (transition, t_f, bounded) in cases {
        let found = best(&transition, t_f, bounded);
        let size = found.a_2.abs().max(found.a_3.abs());
        for reach in [1e-4, 1e-2, 0.3, 3.0] {
            let least = scan(&transition, t_f, bounded, (found.a_2, found.a_3), reach * size, 81);
            assert!(
                least >= found.work * (1.0 - 2e-12),
                "{transition:?} {t_f} {bounded}: {least} below {}",
                found.work
            );
        }
        assert!(found.gap > 0.0, "{found:?}");
    }
}

#[test]
fn both_routes_to_the_gap_agree() {
    // Around 1e-4 the difference of two works takes over from the integral of positive terms; both are good there.
    for i in 0..40 {
        let t_f = 0.03 + 0.0003 * f64::from(i);
        let found = best(&PAPER, t_f, true);
        let optimum = optimal::solve(&PAPER, t_f, true, 1e-12).value.expect("exists").work;
        let difference = (found.work - optimum) / optimum;
        assert!((found.gap - difference).abs() < 5e-12, "{t_f}: {} against {difference}", found.gap);
    }
}

#[test]
fn the_gap_keeps_its_digits_where_the_difference_has_none() {
    // Gaps of 1e-13, of which a difference of works has no digit: as v_f approaches v_i they run into their limit along
    // a straight line, so that the slopes, which rest on the fifth digit of the gap, agree.
    let gap = |change: f64| best(&Transition { v_f: 3.0 * (1.0 + change), ..PAPER }, 1e-3, true).gap;
    let [far, middle, near] = [3e-5, 1e-5, 3e-6].map(gap);
    assert!(relative(near, 1.1741e-13) < 1e-4, "{near:e}");
    let (one, other) = ((near - middle) / 7e-6, (middle - far) / 2e-5);
    assert!(relative(one, other) < 0.05, "{one:e} {other:e}");
}

#[test]
fn nothing_admissible_is_infeasible() {
    let deceleration = Transition { v_i: 100.0, v_f: 3.0, ..PAPER };
    assert_eq!(solve(&deceleration, 0.39, true, 1e-10).status, Status::Infeasible);
    // Just above t_min the optimum exists, but no cubic stays above v = 1.
    let solved = solve(&deceleration, 0.3954147722547, true, 1e-10);
    assert_eq!((solved.status, solved.value), (Status::Infeasible, None));
}

#[test]
fn regress_ends_that_are_almost_the_same() {
    // A linear theta is admissible wherever t_f > 1/v_f - 1/v_i without the bound, and somewhat later with it.
    for r in [1e-8, 1e-6, 1e-5, 1e-4, 1e-3] {
        for factor in [2.0, 3.0, 10.0] {
            for (v_i, v_f) in [(3.0 * (1.0 + r), 3.0), (3.0, 3.0 * (1.0 + r))] {
                let transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i, v_f };
                let t_f = factor * (1.0 / v_f - 1.0 / v_i).abs();
                let best = solve(&transition, t_f, true, 1e-10);
                assert_eq!(best.status, Status::Ok, "{transition:?} {t_f}");
                assert!(best.value.is_some_and(|best| best.gap >= 0.0 && best.gap < 1e-6), "{transition:?} {t_f}");
            }
        }
    }
}

#[test]
fn regress_the_optimum_that_is_a_cubic() {
    // For b = a and C = 0 the optimal theta is a straight line: the gap is 0, of which nothing is 1e-7.
    let transition = Transition { law: Law { a: 0.03, b: 0.03 }, v_i: 3.0, v_f: 100.0 };
    for share in [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2] {
        let best = solve(&transition, 0.008745798437999044 * (1.0 + share), true, 1e-10);
        assert_eq!(best.status, Status::Ok, "{share}");
        assert!(best.value.is_some_and(|best| best.gap.abs() < 1e-17), "{share}");
    }
}

#[test]
fn regress_holds_shorter_than_a_panel_sees() {
    // Just past t_free_out the optimum starts with a hold of 3e-5 that no quadrature node meets.
    let decelerate = |t_f| (Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.03, v_f: 3.0 }, t_f);
    let accelerate = (Transition { law: Law { a: 0.03, b: 0.1 }, v_i: 3.0, v_f: 3.03 }, 0.025046181509522085);
    for (transition, t_f) in [decelerate(0.0165), decelerate(0.0165016501650165), accelerate] {
        let best = best(&transition, t_f, true);
        let difference = best.work - best.work_optimal;
        assert!((best.gap * best.work_optimal - difference).abs() < 2e-13 * best.work, "{transition:?} {t_f} {best:?}");
    }
}
