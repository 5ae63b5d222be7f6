//! The edges of every shortcut family: existing members are solved, and missing ones have their obstacle.
//!
//! A member is judged by what it cannot miss: its motion ends on theta's balance of ageing and slip, it costs no less
//! than the optimum, and it stays within the bound of its family.

use crate::support::relative;
use slipsweep::model::{Law, Transition};
use slipsweep::protocol::shortcut::{Case, FAMILIES, Family, Obstacle, Shortcut, find};
use slipsweep::protocol::{Motion, SolverStats, Status, optimal};

const PAPER: Law = Law { a: 0.03, b: 0.05 };
const RTOL: f64 = 1e-10;

fn case(law: Law, v_i: f64, v_f: f64, t_f: f64) -> Case {
    Case { transition: Transition { law, v_i, v_f }, t_f, tau_ceiling: friction_of_ends(law, v_i, v_f) + 1.0 }
}

fn friction_of_ends(law: Law, v_i: f64, v_f: f64) -> f64 {
    let steady = |v: f64| 1.0 + (law.a - law.b) * v.ln();
    steady(v_i).max(steady(v_f))
}

fn solve(family: &Family, case: &Case) -> Result<Shortcut, Obstacle> {
    family.solve(case, RTOL, &mut SolverStats::default())
}

/// Gauss-Legendre nodes and weights for the interval from 0 to 1.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_6, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// Ageing less slip, `t_f - int theta v dt`, along a motion whose parameter is linear in time between landmarks.
fn balance(motion: &dyn Motion) -> f64 {
    let marks = motion.landmarks();
    let mut slip = 0.0;
    for pair in marks.windows(2) {
        for k in 0..8 {
            let width = (pair[1] - pair[0]) / 8.0;
            let from = pair[0] + width * f64::from(k);
            let length = motion.at(from + 0.75 * width).t - motion.at(from + 0.25 * width).t;
            for (node, weight) in GAUSS {
                let moment = motion.at(from + width * node);
                slip += 2.0 * length * weight * moment.theta * moment.v;
            }
        }
    }
    motion.duration() - slip
}

/// Solves, and checks what is found.
fn examine(family: &Family, case: &Case) -> Result<Shortcut, Obstacle> {
    let solved = solve(family, case);
    let shortcut = match &solved {
        Ok(shortcut) => shortcut,
        Err(obstacle) => {
            assert_ne!(*obstacle, Obstacle::NotConverged, "{} {case:?}", family.name);
            return solved;
        }
    };
    let Transition { v_i, v_f, .. } = case.transition;
    let name = family.name;
    assert!(shortcut.work.is_finite() && shortcut.friction_max.is_finite(), "{name} {case:?} {shortcut:?}");
    assert!(
        shortcut.v_min >= 0.0 && shortcut.v_min <= shortcut.v_max && shortcut.v_max < f64::INFINITY,
        "{name} {case:?} {shortcut:?}"
    );
    let expected = if shortcut.v_min < 1.0 { Status::BelowBound } else { Status::Ok };
    assert_eq!(
        shortcut.status(),
        if shortcut.friction_min < 0.0 { Status::NegativeFriction } else { expected },
        "{name}"
    );
    if name != "step" {
        assert!(shortcut.v_min <= v_i.min(v_f) && shortcut.v_max >= v_i.max(v_f), "{name} {case:?} {shortcut:?}");
        // No protocol that arrives costs less than the optimum of its kind.
        let bounded = shortcut.status() == Status::Ok;
        let optimum = optimal::solve(&case.transition, case.t_f, bounded, 1e-12);
        if let (Some(best), Status::Ok) = (optimum.value, optimum.status) {
            assert!(shortcut.work >= best.work * (1.0 - 1e-9), "{name} {case:?}: {} < {}", shortcut.work, best.work);
        }
    }
    if name == "bounded_friction" {
        assert!(shortcut.friction_max < case.tau_ceiling, "{case:?} {shortcut:?}");
    }
    if name == "bounded_velocity" {
        assert!(shortcut.v_min >= 1.0, "{case:?} {shortcut:?}");
    }
    solved
}

/// The balance of theta along the motion of a member.
fn assert_arrives(family: &Family, case: &Case, accuracy: f64) {
    let motion = family.motion(case, 1e-12).unwrap_or_else(|o| panic!("{} {case:?}: {o}", family.name));
    let Transition { v_i, v_f, .. } = case.transition;
    let error = balance(&*motion) - (1.0 / v_f - 1.0 / v_i);
    assert!(error.abs() <= accuracy * case.t_f, "{} {case:?}: {error:e}", family.name);
}

#[test]
fn edge_time_of_the_hold_and_near_nothing_more() {
    for (v_i, v_f) in [(100.0, 3.0), (1e8, 1.001), (1e8, 1e7), (1.01, 1.001), (3.000003, 3.0)] {
        for b in [0.03, 0.05] {
            let law = Law { a: 0.04, b };
            let t_min = Transition { law, v_i, v_f }.min_duration();
            let case = case(law, v_i, v_f, t_min * (1.0 + 1e-12));
            for family in FAMILIES {
                match (family.name, examine(family, &case)) {
                    // Between 1 and v_i, as fast as can be.
                    ("bounded_velocity", Ok(shortcut)) => assert_eq!(shortcut.v_min, 1.0),
                    // Friction is continuous: v rises from below 1, or it would take longer than the hold.
                    ("bounded_friction", Ok(shortcut)) => {
                        assert!(shortcut.v_min < 1.0, "{case:?}");
                        assert_arrives(family, &case, 1e-9);
                    }
                    ("cubic", Ok(shortcut)) => assert!(shortcut.v_min < 1.0, "{case:?}"),
                    ("cubic", Err(obstacle)) => assert_eq!(obstacle, Obstacle::Velocity, "{case:?}"),
                    ("step", Ok(shortcut)) => assert_eq!(shortcut.v_min, v_f),
                    (name, other) => panic!("{name} {case:?}: {other:?}"),
                }
            }
        }
    }
}

#[test]
fn edge_times_near_the_least_of_bounded_friction() {
    let family = find("bounded_friction").expect("is a family");
    for (a, b) in [(0.03, 0.05), (0.05, 0.03), (0.03, 0.03)] {
        for (v_i, v_f) in [(100.0, 3.0), (3.0, 2.9), (1e4, 1e3)] {
            let least = (v_i - v_f) / (v_i * v_f);
            for excess in [1e-12, 1e-9, 1e-6, 1e-3, 0.1] {
                let case = case(Law { a, b }, v_i, v_f, least * (1.0 + excess));
                let shortcut = examine(family, &case).unwrap_or_else(|o| panic!("{case:?}: {o}"));
                assert!(shortcut.v_min < 1.0 || excess > 1e-3, "{case:?} {shortcut:?}");
                assert_arrives(family, &case, 1e-10);
            }
            for short in [1.0 - 1e-12, 0.5, 1e-6] {
                let case = case(Law { a, b }, v_i, v_f, least * short);
                assert_eq!(solve(family, &case), Err(Obstacle::Velocity), "{case:?}");
            }
        }
    }
}

#[test]
fn edge_times_of_1e_minus_6_and_1e3_and_velocities_of_1_001_to_1e8_in_both_directions() {
    let velocities = [1.001, 3.0, 1e3, 1e8];
    let mut solved = [0; 4];
    for v_i in velocities {
        for v_f in velocities {
            for fraction in [1e-6, 1e3] {
                for b in [0.0, 0.03, 0.05, 0.4] {
                    let case = case(Law { a: 0.03, b }, v_i, v_f, fraction / v_f);
                    for (count, family) in solved.iter_mut().zip(FAMILIES) {
                        if let Ok(shortcut) = examine(family, &case) {
                            *count += 1;
                            // A long time: steady sliding at v_f for most of it, or slower.
                            if fraction == 1e3 && v_f >= v_i && family.name == "bounded_velocity" {
                                assert!(shortcut.v_max <= 1.01 * v_f, "{} {case:?} {shortcut:?}", family.name);
                            }
                        }
                    }
                }
            }
        }
    }
    // All steps; of the others no deceleration in a short time.
    assert_eq!(solved[0], 128);
    assert!(solved[1..].iter().all(|&count| (64..128).contains(&count)), "{solved:?}");
}

#[test]
fn edge_equal_velocities_cost_their_gap_over_the_optimum_of_the_same_time() {
    for (v, t_f) in [(1.001, 10.0), (3.0, 0.1), (100.0, 0.3), (1e8, 1e-6)] {
        for b in [0.0, 0.03, 0.05] {
            let case = case(Law { a: 0.03, b }, v, v, t_f);
            let steady = (1.0 + (0.03 - b) * v.ln()) * v * t_f;
            let optimum = optimal::solve(&case.transition, t_f, true, 1e-12).value.expect("has an optimum").work;
            for family in FAMILIES {
                let shortcut = examine(family, &case).expect("steady sliding is a member");
                assert!(relative(shortcut.work, steady) < 1e-14, "{} {case:?}", family.name);
                assert!(relative(shortcut.v_min, v) < 1e-15 && relative(shortcut.v_max, v) < 1e-15, "{shortcut:?}");
                assert!((shortcut.work - optimum) / optimum >= -1e-12, "{} {case:?}", family.name);
            }
        }
    }
}

#[test]
fn edge_tau_max_from_1e_minus_9_above_both_ends_to_100_and_without_a_bound() {
    let family = find("bounded_friction").expect("is a family");
    for (b, v_i, v_f, t_f) in [(0.05, 3.0, 100.0, 0.05), (0.02, 3.0, 100.0, 0.05), (0.05, 100.0, 3.0, 0.6)] {
        let law = Law { a: 0.03, b };
        let ends = friction_of_ends(law, v_i, v_f);
        let mut costs = Vec::new();
        for above in [-1e-9, 1e-9, 1e-6, 1e-3, 0.03, 0.3, 3.0, 100.0, 1e6, 1e12, f64::INFINITY] {
            let case = Case { tau_ceiling: ends + above, ..case(law, v_i, v_f, t_f) };
            match examine(family, &case) {
                Ok(shortcut) => {
                    assert_arrives(family, &case, 1e-10);
                    costs.push(shortcut.work);
                }
                Err(Obstacle::FrictionAtEnds { friction }) => {
                    assert!(above < 0.0 && relative(friction, ends) < 1e-15, "{case:?}");
                }
                // A bound near nothing above the ends hardly accelerates.
                Err(obstacle) => assert!(obstacle == Obstacle::Friction && v_f > v_i && above < 0.1, "{case:?}"),
            }
        }
        let [.., far, farther, none] = costs[..] else { panic!("too few are feasible") };
        // The bound counts for less and less: the difference from its absence falls like its inverse.
        assert!(relative(far, none) < 1e-5 && relative(farther, none) < 1e-11, "{far} {farther} {none}");
    }
}

#[test]
fn edge_a_bound_on_friction_at_infinity_is_a_parabola_in_time() {
    let family = find("bounded_friction").expect("is a family");
    let case = Case { tau_ceiling: f64::INFINITY, ..case(PAPER, 3.0, 100.0, 0.05) };
    assert_eq!(examine(family, &case).expect("has a member").alpha, Some(0.0));
    let motion = family.motion(&case, 1e-12).expect("has a member");
    let steady = |v: f64| 1.0 + (PAPER.a - PAPER.b) * v.ln();
    let bow = |s: f64| {
        let moment = motion.at(s);
        let x = moment.t / case.t_f;
        (moment.friction - steady(3.0) * (1.0 - x) - steady(100.0) * x) / (x * (1.0 - x))
    };
    let first = bow(0.37);
    for k in 1..20 {
        assert!(relative(bow(f64::from(k) / 20.0), first) < 1e-9, "{} {first}", bow(f64::from(k) / 20.0));
    }
}

#[test]
fn edge_ratio_of_b_to_a_from_0_to_50_and_b_near_a() {
    for (v_i, v_f, t_f) in [(3.0, 100.0, 0.05), (100.0, 3.0, 0.6), (1.001, 1.01, 1.0)] {
        for family in FAMILIES {
            let work = |ratio: f64| {
                let case = Case { tau_ceiling: 3.0, ..case(Law { a: 0.02, b: 0.02 * ratio }, v_i, v_f, t_f) };
                examine(family, &case).map(|shortcut| shortcut.work)
            };
            for ratio in [0.0, 1e-9, 0.5, 2.0, 10.0, 50.0] {
                work(ratio).ok();
            }
            // The direction of the integration turns at b = a: the numbers do not.
            let Ok(equal) = work(1.0) else { continue };
            for ratio in [1.0 - 1e-12, 1.0 + 1e-12, 1.0 - 2.3e-16, 1.0 + 2.3e-16] {
                let near = work(ratio).expect("is as feasible");
                assert!(relative(near, equal) < 1e-9, "{} {v_i} {v_f} {ratio}: {near} {equal}", family.name);
            }
        }
    }
}

#[test]
fn edge_exponents_that_overflow_when_written_naively() {
    // (tau_M - tau)/a is 1e6, and v_f t_f, e^(v_f t_f) and the like leave the range of a double.
    for (v_i, v_f, t_f) in [(3.0, 100.0, 0.02), (100.0, 3.0, 0.5), (1e8, 2.0, 1e3), (2.0, 1e8, 1e3), (3.0, 3.1, 1e6)] {
        for b in [0.0, 1e-4, 5e-3] {
            let case = Case { tau_ceiling: 100.0, ..case(Law { a: 1e-4, b }, v_i, v_f, t_f) };
            for family in FAMILIES {
                let solved = examine(family, &case);
                assert!(solved.is_ok() || family.name == "cubic", "{} {case:?} {solved:?}", family.name);
            }
        }
    }
}

#[test]
fn edge_velocities_of_1() {
    for (v_i, v_f) in [(1.0, 3.0), (3.0, 1.0), (1.0, 1.0)] {
        let case = case(PAPER, v_i, v_f, 9.0);
        for family in FAMILIES {
            let solved = examine(family, &case);
            if family.name == "bounded_velocity" {
                assert_eq!(solved, Err(Obstacle::End));
            } else {
                assert!(solved.is_ok(), "{} {case:?}: {solved:?}", family.name);
            }
        }
    }
}

#[test]
fn edge_what_leaves_the_model_states_below_bound() {
    for (family, t_f) in [("cubic", 0.5), ("bounded_friction", 0.4)] {
        let shortcut =
            examine(find(family).expect("is a family"), &case(PAPER, 100.0, 3.0, t_f)).expect("has a member");
        assert!(shortcut.v_min > 0.0 && shortcut.v_min < 1.0, "{family} {shortcut:?}");
        assert_eq!(shortcut.status(), Status::BelowBound);
    }
}
