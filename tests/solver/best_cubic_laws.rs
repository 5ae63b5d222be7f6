//! Best cubic shortcuts under the slip law and that of Perrin, Rice and Zheng: a 30-digit table, and random points by brute force.

use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::protocol::Status;
use slipsweep::protocol::best_cubic::{BestCubic, solve_under};
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::optimal::Bounds;

use crate::extent::quick_or_long;
use crate::reference;
use crate::support::{Random, relative};

#[test]
fn reference_best_shortcuts_of_other_laws() {
    let rows = reference::table("best_cubic_laws");
    for (state, count) in [(StateLaw::Slip, 9), (StateLaw::Prz, 28)] {
        assert!(rows.iter().filter(|row| row.text("law") == state.name()).count() >= count, "{state:?}");
    }
    for row in &rows {
        let state = StateLaw::find(row.text("law")).expect("is a law");
        let law = Law { a: row.number("a"), b: row.number("b") };
        let transition = Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") };
        let bounds = Bounds::new(true).with_v_ceiling(row.number("v_ceiling"));
        let solved = solve_under(state, &transition, row.number("t_f"), bounds, 1e-10);
        assert_eq!(solved.status, Status::Ok, "{row:?}");
        let BestCubic { a_2, a_3, work, work_optimal, gap, v_min, v_max, .. } = solved.value.expect("has values");
        let size = a_2.abs() + a_3.abs();
        for (name, found, scale, budget) in [
            ("a_2", a_2, size, 2e-8),
            ("a_3", a_3, size, 2e-8),
            ("work", work, work, 1e-13),
            ("work_optimal", work_optimal, work_optimal, 1e-13),
            ("gap", gap, 1.0 + gap, 3e-13),
            ("v_min", v_min, v_min, 2e-8),
            // Some times the errors of the coefficients.
            ("v_max", v_max, v_max, 1e-7),
        ] {
            let error = (found - row.number(name)).abs() / scale;
            assert!(error < budget, "{name} {found} off by {error:.1e} in {row:?}");
        }
    }
}

/// A random transition with its duration and a ceiling.
fn draw(random: &mut Random, state: StateLaw) -> (Transition, f64, Bounds) {
    let a = random.between(1e-3, 0.2);
    let law = Law { a, b: a * [0.0, 0.5, 1.0, 1.5, 3.0][(5.0 * random.next()) as usize] };
    let greatest = [10.0, 1e2, 1e4][(3.0 * random.next()) as usize];
    let [v_i, v_f] = [(); 2].map(|()| random.between(1.1, greatest));
    let rise = (1.0 / v_f - 1.0 / v_i).max(0.0) / state.fastest_rise().high;
    let t_f = rise * (1.0 + random.between(1e-2, 10.0)) + random.between(0.1, 1e3) / v_i.max(v_f);
    let bounds = Bounds::new(true).with_v_ceiling(v_i.max(v_f) * random.between(1.5, 1e3));
    (Transition { law, v_i, v_f }, t_f, bounds)
}

/// No shortcut with `v >= 1` on grids from a fraction of the coefficients to the whole admissible set costs less.
#[test]
fn no_shortcut_of_other_laws_on_a_grid_costs_less() {
    const N: usize = 61;
    let mut random = Random(22);
    let (mut solved_rows, mut touching) = (0, 0);
    for _ in 0..quick_or_long(60, 600) {
        let state = [StateLaw::Slip, StateLaw::Prz][(2.0 * random.next()) as usize];
        let (transition, t_f, bounds) = draw(&mut random, state);
        let solved = solve_under(state, &transition, t_f, bounds, 1e-10);
        assert!(solved.status != Status::NotConverged, "{state:?} {transition:?} {t_f}");
        let Some(best) = solved.value.filter(|_| solved.status == Status::Ok) else { continue };
        let case = format!("{state:?} {transition:?} {t_f} {best:?}");
        assert!(best.v_min >= 1.0, "{case}");
        touching += u32::from(best.v_min == 1.0);
        solved_rows += 1;
        let landscape = Landscape::under(state, &transition, t_f, 1e-12);
        assert!(sampled_velocity(state, &transition, t_f, best) >= 1.0 - ROUNDED_VELOCITY, "{case}");
        let size = best.a_2.abs().max(best.a_3.abs());
        for reach in [1e-5, 1e-3, 0.1, 1.0, 5.0] {
            let at = |middle: f64, i: usize| middle + reach * size * (2.0 * i as f64 / (N - 1) as f64 - 1.0);
            let a_3: [f64; N] = std::array::from_fn(|i| at(best.a_3, i));
            for i in 0..N {
                let (mut work, mut status) = ([f64::NAN; N], [Status::NotConverged; N]);
                let (mut v_min, a_2) = ([f64::NAN; N], [at(best.a_2, i); N]);
                let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
                landscape.evaluate(&a_2, &a_3, out);
                for k in (0..N).filter(|&k| status[k] == Status::Ok) {
                    let saved = (best.work - work[k]) / best.work;
                    assert!(saved < 1e-11, "{case}: {} costs {saved:e} less at {} {}", work[k], a_2[k], a_3[k]);
                }
            }
        }
    }
    assert!(solved_rows > 30 && touching > 10, "{solved_rows} {touching}");
}

/// The least velocity on a best shortcut by dense sampling; NaN where theta rises faster than the law allows.
fn sampled_velocity(state: StateLaw, transition: &Transition, t_f: f64, best: BestCubic) -> f64 {
    let rise = 1.0 / transition.v_f - 1.0 / transition.v_i;
    let (a_2, a_3, a_4) = (best.a_2, best.a_3, rise - best.a_2 - best.a_3);
    let even = (0..=2000).map(|i| f64::from(i) / 2000.0);
    let ends = (11..50).map(|k| (-f64::from(k)).exp2());
    let places = even.chain(ends.clone()).chain(ends.map(|d| 1.0 - d));
    let velocity = |x: f64| {
        let theta = 1.0 / transition.v_i + x * (a_2 + x * (a_3 + x * a_4));
        let rate = (a_2 + x * (2.0 * a_3 + 3.0 * x * a_4)) / t_f;
        let lack = 1.0 - rate / state.fastest_rise().high;
        if lack > -ROUNDED_LACK { state.product(lack.max(0.0)) / theta } else { f64::NAN }
    };
    places.map(velocity).fold(f64::INFINITY, |least, v| if v.is_nan() || v < least { v } else { least })
}

/// Rounding of the coefficients in the lack, and in a velocity, which may depend on its square root.
const ROUNDED_LACK: f64 = 1e-14;
const ROUNDED_VELOCITY: f64 = 1e-8;

/// The velocity is least close to the start, or twice within a thirtieth of the path: an earlier version took shortcuts for the best that stop there.
#[test]
fn regress_no_dip_of_the_velocity_is_missed() {
    let bounds = Bounds::new(true).with_v_ceiling(1e5);
    let fast = Transition { law: Law { a: 0.03, b: 0.02 }, v_i: 3000.0, v_f: 10.0 };
    let slow = Transition { law: Law { a: 0.0179, b: 0.0268 }, v_i: 3.113991860040082, v_f: 2.1096698583843083 };
    for (state, transition, t_f) in [
        (StateLaw::Prz, fast, 0.232079),
        (StateLaw::Slip, fast, 0.293901),
        (StateLaw::Slip, fast, 0.5),
        (StateLaw::Slip, slow, 2.5009569495217936),
    ] {
        let solved = solve_under(state, &transition, t_f, bounds, 1e-10);
        assert_eq!(solved.status, Status::Ok, "{state:?} {t_f}");
        let best = solved.value.expect("has values");
        let found = sampled_velocity(state, &transition, t_f, best);
        assert!(found >= 1.0 - ROUNDED_VELOCITY, "{state:?} {t_f}: {found} {best:?}");
    }
}

/// Under a ceiling that the optimum does not reach, the numbers of ageing are those without it; a lower one raises W* alone.
#[test]
fn the_ceiling_bounds_the_optimum_alone() {
    let transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 4.0, v_f: 80.0 };
    let at = |v_ceiling: f64| {
        let bounds = Bounds::new(true).with_v_ceiling(v_ceiling);
        solve_under(StateLaw::Ageing, &transition, 0.1, bounds, 1e-10).value.expect("exists")
    };
    assert_eq!(at(1e6), at(f64::INFINITY));
    let (free, capped) = (at(f64::INFINITY), at(300.0));
    assert_eq!((free.work, free.a_2, free.a_3, free.v_min), (capped.work, capped.a_2, capped.a_3, capped.v_min));
    assert!(capped.work_optimal > free.work_optimal && capped.gap < free.gap);
    assert!(relative(capped.gap, capped.work / capped.work_optimal - 1.0) < 1e-9);
}
