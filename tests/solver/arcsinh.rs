//! Regularised friction: optima, works of shortcuts and eigenvalues against references, the equation of Hamilton, Jacobi and Bellman, and the limit
//! of the logarithm.

use slipsweep::model::arcsinh::{excess, friction_rise, reduction, scaled_friction};
use slipsweep::model::{Law, Transition};
use slipsweep::protocol::arcsinh::{Regularised, least_time, motion, solve};
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::{Status, optimal};
use slipsweep::stability::SteadySliding;
use slipsweep::stability::arcsinh::{critical_velocity, linearised};
use slipsweep::trace::{Times, Trace};

use crate::extent::quick_or_long;
use crate::reference::{self, Row};
use crate::support::{Random, relative};

fn transition(row: &Row) -> Transition {
    let law = Law { a: row.number("a"), b: row.number("b") };
    Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") }
}

/// Checks that `found` is the number in a column, to a relative `rtol`.
fn assert_near(row: &Row, column: &str, found: f64, rtol: f64) {
    let expected = row.number(column);
    assert!((found - expected).abs() <= rtol * expected.abs(), "{column}: {found:e} {expected:e} {row:?}");
}

#[test]
fn reference_optima() {
    let rows = reference::table("arcsinh_optimal");
    assert_eq!(rows.len(), 121);
    for row in &rows {
        let solved = solve(&transition(row), row.number("t_f"));
        let found = solved.value.unwrap_or_else(|| panic!("{row:?}"));
        assert_eq!(solved.status, Status::Ok, "{row:?}");
        let Regularised { optimum, slopes } = found;
        for (column, number) in [
            ("work", optimum.work),
            ("v_start", optimum.v_start),
            ("v_end", optimum.v_end),
            ("hamiltonian", optimum.hamiltonian),
            ("theta_max", optimum.theta_max),
            ("dwork_da", slopes.a),
            ("dwork_db", slopes.b),
            ("dwork_dv_i", slopes.v_i),
            ("dwork_dv_f", slopes.v_f),
        ] {
            assert_near(row, column, number, 5e-12);
        }
    }
}

#[test]
fn reference_works_of_shortcuts() {
    let rows = reference::table("arcsinh_gap");
    assert_eq!(rows.len(), 121);
    let mut recomputed = 0;
    for row in &rows {
        let (transition, t_f) = (transition(row), row.number("t_f"));
        let landscape = Landscape::new(&transition, t_f, 1e-10);
        let (mut work, mut v_min, mut status) = ([f64::NAN], [f64::NAN], [Status::Infeasible]);
        let (a_2, a_3) = ([row.number("a_2")], [row.number("a_3")]);
        landscape.evaluate(&a_2, &a_3, LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status });
        let buffers = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
        recomputed += landscape.regularise(&a_2, &a_3, 1e-10, buffers).quadratures;
        assert_eq!(status, [Status::Ok], "{row:?}");
        assert_near(row, "work", work[0], 1e-10);
        assert_near(row, "v_min", v_min[0], 1e-10);
    }
    assert!((25..=60).contains(&recomputed), "{recomputed}");
}

#[test]
fn reference_stability() {
    let rows = reference::table("arcsinh_stability");
    assert_eq!(rows.len(), 80);
    for row in &rows {
        let law = Law { a: row.number("a"), b: row.number("b") };
        let (v_i, v, k, m) = (row.number("v_i"), row.number("v"), row.number("k"), row.number("m"));
        let at = |v: f64| SteadySliding::new(linearised(law, v), k, m, v);
        assert_near(row, "k_od", linearised(law, v).b - linearised(law, v).a, 1e-12);
        assert_near(row, "k_c_i", at(v_i).critical_stiffness(), 1e-12);
        assert_near(row, "k_c_f", at(v).critical_stiffness(), 1e-12);
        let found = at(v).eigenvalues().expect("is elastic");
        // The growth rate is relative to its distance from the Hopf point.
        assert_near(row, "growth_rate", found.growth_rate, 1e-10);
        let frequency = row.number("frequency");
        assert!((found.frequency - frequency).abs() <= 1e-10 * frequency.max(found.growth_rate.abs()), "{row:?}");
        assert_eq!(found.decay_rate.is_some(), row.optional("decay_rate").is_some(), "{row:?}");
        if let Some(decay) = found.decay_rate {
            assert_near(row, "decay_rate", decay, 1e-10);
        }
        let v_crit = critical_velocity(law, k, m);
        assert_eq!(v_crit.is_some(), row.optional("v_crit").is_some(), "{row:?} {v_crit:?}");
        if let Some(v_crit) = v_crit {
            assert_near(row, "v_crit", v_crit, 1e-10);
        }
    }
}

/// Roots of `k = k_c(v)`, computed with 60 digits: close to the least `k_c`, where a scan missed them, and where `k` is just above `b - a`.
#[test]
fn regress_critical_velocities_are_found_to_all_digits() {
    for (a, b, k, m, v_crit) in [
        (0.1, 0.3, 0.08183795266523215, 3.8840372918869876e-7, 228.60421817470785),
        (0.05, 0.2, 0.025047552296244065, 2.1230232193368384e-9, 1543.5819188788155),
        (0.07060508714795379, 0.08649194090857298, 0.01588686043693309, 1.9846198752313042e-19, 386809.583811517),
        (0.05227298138692854, 0.07971476769557728, 0.027441833189729738, 5.562216861675018e-13, 400.6888888881906),
    ] {
        let found = critical_velocity(Law { a, b }, k, m).expect("exists");
        assert!(relative(found, v_crit) < 1e-12, "{found} {v_crit}");
    }
}

/// Of all velocities of a fine grid, those above the critical one are unstable, and the one just below is stable.
#[test]
fn no_greater_velocity_is_critical() {
    let mut random = Random(7);
    let (mut found, mut none) = (0, 0);
    for _ in 0..2000 {
        let (a, over) = (random.between(1e-2, 0.3), random.between(0.02, 5.0));
        let (law, v_0) = (Law { a, b: a * (1.0 + over) }, random.between(1.001, 1e8));
        let m = a / (v_0 * v_0);
        let k = (law.b - law.a) * random.between(0.05, 20.0);
        let margin = |v: f64| 1.0 - SteadySliding::new(linearised(law, v), k, m, v).critical_stiffness() / k;
        let grid = || (-600..900).map(|i| v_0 * (0.02 * f64::from(i)).exp());
        let v_crit = critical_velocity(law, k, m);
        assert!(grid().filter(|v| v_crit.is_none_or(|v_crit| *v > v_crit * (1.0 + 1e-9))).all(|v| margin(v) < 1e-12));
        if let Some(v_crit) = v_crit {
            found += 1;
            assert!(margin(v_crit).abs() < 1e-12 && margin(v_crit * (1.0 - 1e-4)) > 0.0, "{law:?} {k} {m} {v_crit}");
        } else {
            none += 1;
        }
    }
    assert!(found > 500 && none > 100, "{found} {none}");
}

/// A problem of the physical domain, and its duration.
fn random_problem(random: &mut Random) -> (Transition, f64) {
    let a = random.between(1e-3, 0.3);
    let b = (a * [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 10.0][(7.0 * random.next()) as usize]).min(0.5);
    let [v_i, mut v_f] = [(); 2].map(|()| {
        let greatest = [10.0, 1e3, 1e6, 1e10][(4.0 * random.next()) as usize];
        random.between(1.001, greatest)
    });
    if random.next() < 0.25 {
        // Almost the same velocity.
        v_f = v_i * (1.0 + random.between(1e-6, 1e-2));
    }
    let transition = Transition { law: Law { a, b }, v_i, v_f };
    let least = least_time(&transition).expect("is in the domain");
    let t_f = least * (1.0 + 1e-9) + random.between(1e-3, 1e7) / v_i.max(v_f);
    (transition, t_f.min(1e4))
}

/// Whether friction at the least theta of a path between these velocities is above the least with a proof, with the margin for rounding.
fn is_proven(transition: &Transition) -> bool {
    let &Transition { law: Law { a, b }, v_i, v_f } = transition;
    let level = (1.0 - (b - a) * v_i.max(v_f).ln()) / a;
    a * scaled_friction(level) * (1.0 - 1e-4) > (b - a) * reduction(level).0
}

/// Near steady sliding, where the durations of both branches meet, and far below the turning point with almost no friction. Works by quadrature at 50
/// digits (`tests/reference/arcsinh.py`).
#[test]
fn regress_optima_near_steady_sliding_converge() {
    for (t_f, a, b, v_i, v_f, work) in [
        (0.004285714285714286, 0.25, 0.5, 7.0, 7.00007, 0.01553332993162),
        (
            0.23466389473487803,
            0.11756864228452205,
            0.2351372845690441,
            146.13053363015663,
            4.8598340635613635,
            0.1284016134328723,
        ),
        (
            0.5575756937437075,
            0.09406946466909784,
            0.12298394919380824,
            583656.8280764753,
            1.972049360001737,
            0.0924507739824226,
        ),
    ] {
        let transition = Transition { law: Law { a, b }, v_i, v_f };
        for scale in [1.0, 1.0 - 1e-5, 1.0 + 1e-5, 1.0 - 1e-3, 1.0 + 1e-3] {
            assert_eq!(solve(&transition, scale * t_f).status, Status::Ok, "{transition:?} {scale}");
        }
        let found = solve(&transition, t_f).value.expect("is ok").optimum.work;
        assert!((found / work - 1.0).abs() < 1e-13, "{found:e} {work:e}");
    }
    let (v_i, v_f) = (948632860.2283959, 30053.55703793864);
    let law = Law { a: 0.14659590701670225, b: 0.29023880898726273 };
    assert_eq!(solve(&Transition { law, v_i, v_f }, 0.00012515114977566786).status, Status::Ok);
}

#[test]
fn random_points_have_sound_numbers() {
    let mut random = Random(1);
    let mut unproven = 0;
    let count = quick_or_long(500, 100_000);
    for _ in 0..count {
        let (transition, t_f) = random_problem(&mut random);
        let solved = solve(&transition, t_f);
        if !is_proven(&transition) {
            assert_eq!(solved.status, Status::Unproven, "{transition:?} {t_f}");
            unproven += 1;
            continue;
        }
        assert_eq!(solved.status, Status::Ok, "{transition:?} {t_f}");
        let Regularised { optimum, .. } = solved.value.expect("is ok");
        assert!(
            optimum.work > 0.0 && optimum.friction_max > 0.0 && optimum.v_start >= 0.0,
            "{transition:?} {optimum:?}"
        );
        // Theta rises by the rate 1 at most, and any duration longer has a greater turning point.
        let most = 1.0 / transition.v_i + t_f;
        assert!(optimum.theta_max <= most * (1.0 + 1e-12), "{transition:?} {t_f} {optimum:?}");
        let longer = solve(&transition, 1.1 * t_f).value.expect("is ok").optimum;
        assert!(longer.theta_max >= optimum.theta_max, "{transition:?} {t_f}");
    }
    assert!(unproven < count / 2, "{unproven}");
}

/// Every random optimum can be traced: time never falls, and both ends have the theta of steady sliding and the velocities of the optimum.
#[test]
fn random_optima_can_be_traced() {
    let mut random = Random(3);
    let mut traced = 0;
    for _ in 0..quick_or_long(60, 1_000) {
        let (transition, t_f) = random_problem(&mut random);
        let (solved, motion) = motion(&transition, t_f);
        if solved.status != Status::Ok {
            continue;
        }
        let (found, motion) = (solved.value.expect("is ok").optimum, motion.expect("is ok"));
        let trace = Trace::of(&*motion, &transition, Times::Fewest);
        let moments = trace.unwrap_or_else(|| panic!("{transition:?} {t_f}: no trace")).moments;
        assert!(moments.windows(2).all(|pair| pair[0].t <= pair[1].t), "{transition:?} {t_f}");
        let [first, last] = [0.0, 1.0].map(|s| motion.at(s));
        assert!((first.theta * transition.v_i - 1.0).abs() < 1e-12, "{transition:?} {first:?}");
        assert!((last.theta * transition.v_f - 1.0).abs() < 1e-11, "{transition:?} {last:?}");
        assert!((first.v, last.v) == (found.v_start, found.v_end), "{transition:?} {first:?} {last:?}");
        traced += 1;
    }
    assert!(traced > 20, "{traced}");
}

/// The value function solves `V_T = min_v [tau v + V_theta (1 - theta v)]`, so no protocol is cheaper: derivatives by differences, the minimum over
/// a grid of velocities.
#[test]
fn the_value_solves_the_equation_of_hamilton_jacobi_and_bellman() {
    let mut random = Random(2);
    let mut compared = 0;
    for _ in 0..quick_or_long(200, 20_000) {
        let (transition, t_f) = random_problem(&mut random);
        let Transition { law, v_i, v_f } = transition;
        if !is_proven(&transition) {
            continue;
        }
        let work = |v_i: f64, t_f: f64| {
            solve(&Transition { v_i, ..transition }, t_f).value.map_or(f64::NAN, |found| found.optimum.work)
        };
        let theta = 1.0 / v_i;
        // Within the scales of the path.
        let spare = t_f - least_time(&transition).expect("is in the domain");
        let scale = (theta.min(1.0 / v_f) * law.a).min(law.a * spare);
        let (by_time, by_theta) = (1e-3 * scale, 1e-3 * scale);
        let difference =
            |at: &dyn Fn(f64) -> f64, h: f64| (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        let in_time = difference(&|h| work(v_i, t_f + h), by_time);
        let in_theta = difference(&|h| work(1.0 / (theta + h), t_f), by_theta);
        let found = solve(&transition, t_f).value.expect("is proven").optimum;
        let cost = |v: f64| {
            let level = v.ln() + (1.0 + law.b * theta.ln()) / law.a;
            law.a * scaled_friction(level) * v + in_theta * (1.0 - theta * v)
        };
        let least = (-400..=400).map(|i| cost(found.v_start.max(1e-200) * (f64::from(i) / 100.0).exp()));
        let least = least.fold(f64::INFINITY, f64::min);
        // Terms that cancel, and the rounding of differences.
        let size = in_time.abs() + in_theta.abs() * (1.0 + theta * found.v_start);
        let of_work = 1e-12 * found.work * (1.0 / by_time + (1.0 + theta * found.v_start) / by_theta);
        let of_arguments = 1e-14 * (t_f / by_time + theta / by_theta);
        let noise = (1e-5 + of_arguments) * size + of_work;
        if noise > 1e-2 * size {
            continue;
        }
        assert!((in_time - least).abs() <= noise, "{transition:?} {t_f}: {in_time} {least} {noise} {found:?}");
        assert!((in_time - found.hamiltonian).abs() <= noise, "{transition:?} {t_f} {in_time} {found:?}");
        compared += 1;
    }
    assert!(compared > 30, "{compared}");
}

#[test]
fn high_friction_is_that_of_the_logarithm() {
    // Steady friction is far above a.
    let mut random = Random(3);
    for _ in 0..quick_or_long(200, 30_000) {
        let a = random.between(1e-3, 0.02);
        let b = a * random.between(0.2, 1.5);
        let (v_i, ratio) = (random.between(10.0, 1e3), random.between(1.1, 30.0));
        let transition = Transition { law: Law { a, b }, v_i, v_f: v_i * ratio };
        let t_f = random.between(0.1, 0.5) / v_i;
        let expected = optimal::solve(&transition, t_f, false, 1e-12).value.expect("is feasible");
        let found = solve(&transition, t_f).value.expect("is feasible").optimum;
        let pairs = [
            (found.work, expected.work),
            // Relative to v_i: where the block waits, friction is low.
            (1.0 + found.v_start / v_i, 1.0 + expected.v_start / v_i),
            (found.v_end, expected.v_end),
            (found.theta_max, expected.theta_max),
            (found.friction_max, expected.friction_max),
        ];
        for (found, expected) in pairs {
            assert!((found / expected - 1.0).abs() < 1e-10, "{transition:?} {t_f}: {found} {expected}");
        }
    }
}

#[test]
fn no_protocol_is_faster_than_rest() {
    let transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 100.0, v_f: 4.0 };
    let least = least_time(&transition).expect("is in the domain");
    assert_eq!(least, 0.24);
    for t_f in [least, 0.1, 0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(solve(&transition, t_f).status, Status::Infeasible);
    }
    let works = [1.0001, 1.01, 1.1].map(|more| solve(&transition, least * more).value.expect("is ok").optimum.work);
    assert!(works[0] < works[1] && works[1] < works[2], "{works:?}");
}

#[test]
fn friction_agrees_with_its_definition() {
    for i in -300..300 {
        let level = 0.1 * f64::from(i);
        let expected = (0.5 * level.exp()).asinh();
        assert!((scaled_friction(level) / expected - 1.0).abs() < 1e-14, "{level}");
        let (f, rest) = reduction(level);
        assert!((f / expected.tanh() - 1.0).abs() < 1e-14, "{level}");
        assert!((rest * expected.cosh().powi(2) - 1.0).abs() < 1e-13, "{level}");
        if level > 0.0 {
            assert!((scaled_friction(level) - level - excess(level)).abs() < 1e-15 * level, "{level}");
        }
        for rise in [-30.0, -1.5, -0.3, -1e-5, 1e-9, 0.02, 0.9, 4.0] {
            let found = friction_rise(level, rise);
            // The mean slope lies between those at both ends.
            let [low, high] = [reduction(level).0 * rise, reduction(level + rise).0 * rise];
            assert!(found >= low.min(high) - 1e-14 * rise.abs(), "{level} {rise}");
            assert!(found <= low.max(high) + 1e-14 * rise.abs(), "{level} {rise}");
        }
    }
}
