//! The best cubic shortcut against a 40-digit table, the paper's figures, and a search by brute force.

use crate::reference;
use crate::support::relative;
use slipsweep::model::{Law, Transition};
use slipsweep::protocol::best_cubic::{BestCubic, solve};
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::{Status, optimal};

const PAPER: Transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.0, v_f: 100.0 };

fn best(transition: &Transition, t_f: f64, bounded: bool) -> BestCubic {
    let solved = solve(transition, t_f, bounded, 1e-10);
    let found = solved.value.expect("a solved row has values");
    // At the border v = 0 friction falls without limit.
    let at_border = found.v_min == 0.0 && solved.status == Status::NegativeFriction;
    let expected = at_border || matches!(solved.status, Status::Ok | Status::BelowBound);
    assert!(expected, "{transition:?} {t_f} {:?}", solved.status);
    found
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
        let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
        landscape.evaluate(&vec![at(centre.0, i); n], &a_3, out);
        for (work, status) in work.into_iter().zip(status) {
            let admissible = match status {
                Status::Ok => true,
                Status::BelowBound | Status::NegativeFriction => !bounded,
                _ => false,
            };
            if admissible && work < least {
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
    let rows = reference::table("best_cubic");
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
    for fraction in [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2] {
        let best = solve(&transition, 0.008745798437999044 * (1.0 + fraction), true, 1e-10);
        assert_eq!(best.status, Status::Ok, "{fraction}");
        assert!(best.value.is_some_and(|best| best.gap.abs() < 1e-17), "{fraction}");
    }
}

/// The optimum holds for almost half of the time: halves of a panel across the end of the hold agreed by chance.
#[test]
fn regress_holds_of_half_the_time() {
    let law = Law { a: 1.3094022960939522, b: 0.0 };
    let transition = Transition { law, v_i: 1.0000000000001092, v_f: 1.0017523331852594 };
    let best = solve(&transition, 0.08514974796105777, true, 1e-10);
    assert_eq!(best.status, Status::Ok);
}

/// The search for the optimum lengthens its steps from 1e-8 on, where a leap to 1 met what cannot be integrated.
#[test]
fn regress_optima_between_velocities_a_rounding_apart() {
    let law = Law { a: 6.621256489523037, b: 5.45716375648159 };
    let transition = Transition { law, v_i: 1.068944223223348, v_f: 1.0689442232233477 };
    let solved = solve(&transition, 2.025223566696026e-7, true, 4.547561724399975e-8);
    assert_eq!(solved.status, Status::Ok);
}

/// No place of the shortcut is further than a rounding from where no time is left to arrive: there is no feedback to compare with.
#[test]
fn regress_best_shortcuts_a_rounding_from_the_least_time() {
    let law = Law { a: 2.41896179387082, b: 1.0348235315141456e-6 };
    let transition = Transition { law, v_i: 1.000000000000015, v_f: 1.0000000000000002 };
    let solved = solve(&transition, 5.9429391678875705, true, 8.6e-4);
    assert_eq!(solved.status, Status::Ok);
    assert!(solved.value.is_some_and(|best| (0.0..1e-13).contains(&best.gap)), "{solved:?}");
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

/// What the bound costs was formed from `v - 1` and from `1 - theta` as differences.
#[test]
fn regress_best_shortcuts_near_the_bound() {
    for (a, b, v_i, v_f, t_f) in [
        (0.9716919041812424, 0.7540956419873299, 1.0000000000000004, 1.000009205942604, 0.009081888152565203),
        (1.118864779321712e-5, 9.265961534263374e-6, 1.0000000000000395, 1.0000000000112839, 1443492.5103811584),
        (0.035636105661880337, 0.03759411163731032, 1.0000000000000868, 1.000000000231336, 256744.2664110307),
    ] {
        let transition = Transition { law: Law { a, b }, v_i, v_f };
        let best = best(&transition, t_f, true);
        assert!(best.v_min == 1.0 && best.gap >= 0.0, "{transition:?} {best:?}");
        let difference = best.work - best.work_optimal;
        assert!((best.gap * best.work_optimal - difference).abs() <= 1e-11 * best.work, "{transition:?} {best:?}");
    }
}

/// All but a triple zero of theta at the end, whose linear term is a small difference of large ones; work that varies by
/// little; and corners of the border, where `v = 1` at the end and at a place before it.
#[test]
fn regress_best_shortcuts_of_far_changes() {
    for (a, b, v_i, v_f, t_f) in [
        (2.0, 5e-6, 1.0 + 2e-9, 2.2e8, 5.8e-10),
        (0.36, 0.36, 1.035, 1.9e8, 1.1e-9),
        (2.8e-4, 2.7e-3, 1.006, 1.8e8, 1.4e-12),
        (0.2, 0.02, 30.0, 5.7e8, 7.7e-9),
        (1.4e-6, 5.1e-6, 1.08, 5.8e6, 3.3e-10),
        (4.4e-5, 1.3e-3, 7.8e6, 1.00027, 50.0),
        (5.2e-6, 0.025, 1.9e4, 1.0081, 67.0),
    ] {
        let transition = Transition { law: Law { a, b }, v_i, v_f };
        let solved = solve(&transition, t_f, true, 1e-10);
        assert_eq!(solved.status, Status::Ok, "{transition:?}");
        let best = solved.value.expect("is solved");
        assert!(best.gap > 0.0 && best.v_min >= 1.0, "{transition:?} {best:?}");
        // No neighbour in any direction costs less.
        let landscape = Landscape::new(&transition, t_f, 1e-12);
        for k in 0..32 {
            let (sine, cosine) = (std::f64::consts::TAU * f64::from(k) / 32.0).sin_cos();
            for reach in [1e-6, 1e-3, 0.1] {
                let size = reach * best.a_2.abs().max(best.a_3.abs());
                let (mut work, mut status) = ([f64::NAN], [Status::NotConverged]);
                let out = LandscapeBuffers { work: &mut work, v_min: &mut [], status: &mut status };
                landscape.evaluate(&[best.a_2 + size * cosine], &[best.a_3 + size * sine], out);
                assert!(status[0] != Status::Ok || work[0] >= best.work * (1.0 - 4e-12), "{transition:?} {k} {reach}");
            }
        }
    }
}

/// Admissible sets as thin as rounding; layers at both ends, of theta or in time; hardly any velocity; near the least
/// time; optima whose velocity is too small for a number; and corners.
#[test]
fn regress_best_shortcuts_over_the_whole_domain() {
    for (a, b, v_i, v_f, t_f, bounded) in [
        (4.2060762562435505e-6, 0.0, 1.000000000001215, 31867589574.386703, 5.2066953019595964e-5, true),
        (0.033560825441527165, 0.03356082544152384, 1.9456535686994174, 1.0021383971921212, 0.4839000537951614, false),
        (4.094621117133459e-5, 4.094621117133459e-5, 1.0000081127125373, 1.0002052892425979, 2700037.022758166, true),
        (2.3710397274335327e-6, 5.05578775443774e-6, 1.0000008634118729, 1.0000008621059657, 13781.74950456446, true),
        (8.479748771635301e-6, 0.0, 1.0000000000001006, 1.0000000000000837, 1.6875389974302424e-14, false),
        (
            0.001940979378273884,
            0.013094542595829517,
            1615086875.816498,
            1615086867.283258,
            3.2713136887592526e-18,
            true,
        ),
        (0.027665491667940464, 0.0276650381445758, 1175.795636600442, 1175.795636324349, 1.9987628949944075e-13, true),
        (2.043555916030484e-6, 0.0, 1.0092888553924948, 1.0000008214020364, 0.00920254524919201, false),
        (0.020946795683962634, 0.16701313962787173, 1.000289540903126, 1.0000000000001306, 3008696264664509.5, true),
        (0.0003998278770327999, 0.0, 1.0000000000000004, 1.000001107630573, 3.8644756400196504e-5, true),
        (4.0594034150135905e-6, 2.326262956484412e-6, 1.0000000000000373, 769789503789.094, 8.29986186395648e-6, true),
        (0.0008349545586355515, 0.0008205361126329902, 1.000303434051639, 1.0003034429477777, 135.45688310232177, true),
    ] {
        let transition = Transition { law: Law { a, b }, v_i, v_f };
        let found = best(&transition, t_f, bounded);
        let optimum = optimal::solve(&transition, t_f, bounded, 1e-12).value.expect("exists");
        let allowed = 2e-11 * found.work + 16.0 * f64::EPSILON * t_f * optimum.hamiltonian.abs();
        let difference = found.work - found.work_optimal;
        assert!((found.gap * found.work_optimal - difference).abs() <= allowed, "{transition:?} {found:?}");
        assert!(found.gap >= 0.0 && found.v_min >= if bounded { 1.0 } else { 0.0 }, "{transition:?} {found:?}");
        for reach in [1e-4, 1e-2, 0.3] {
            let size = found.a_2.abs().max(found.a_3.abs());
            let least = scan(&transition, t_f, bounded, (found.a_2, found.a_3), reach * size, 21);
            assert!(least >= found.work * (1.0 - 4e-12), "{transition:?} {found:?}: {least}");
        }
    }
}

/// Friction below `b - a` is met only where theta is well below both ends, but not below half of them.
#[test]
fn regress_shortcuts_of_low_friction_are_no_candidates() {
    for (a, b, v_i, v_f, t_f) in [
        (0.0028021572970077543, 0.9224398236503251, 1.0000000001271758, 1.0008356327447516, 54.33783755718244),
        (3.0457500241251454e-6, 0.7784244335559632, 1.0041247684039736, 1.0041247684070338, 611.3881557518564),
    ] {
        let transition = Transition { law: Law { a, b }, v_i, v_f };
        let solved = solve(&transition, t_f, true, 1e-10);
        assert_eq!(solved.status, Status::Ok);
        let best = solved.value.expect("exists");
        assert!(best.gap >= 0.0 && best.gap < 1e-3, "{best:?}");
    }
}
