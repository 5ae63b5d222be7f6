//! The families `step`, `cubic` and `bounded_velocity` against a high-precision table, a library's ODE integrator and
//! invariants; and the numerical tools that only they use.

use crate::reference::{self, Row};
use crate::support::relative;
use ode_solvers::dop_shared::OutputType;
use ode_solvers::{Dop853, SVector, System};
use slipsweep::model::{Law, Transition};
use slipsweep::numerics::dilogarithm::dilogarithm;
use slipsweep::numerics::polynomial::roots_between;
use slipsweep::numerics::radau::{NODES, radau};
use slipsweep::protocol::shortcut::{Case, Obstacle, Shortcut, find};
use slipsweep::protocol::{Motion, SolverStats, Status};

const PAPER: Law = Law { a: 0.03, b: 0.05 };

fn case(law: Law, v_i: f64, v_f: f64, t_f: f64) -> Case {
    Case { transition: Transition { law, v_i, v_f }, t_f, tau_ceiling: f64::INFINITY }
}

fn solve(family: &str, case: &Case, rtol: f64) -> Result<Shortcut, Obstacle> {
    find(family).expect("is a family").solve(case, rtol, &mut SolverStats::default())
}

fn motion(family: &str, case: &Case) -> Box<dyn Motion> {
    find(family).expect("is a family").motion(case, 1e-12).unwrap_or_else(|o| panic!("{family} {case:?}: {o}"))
}

const FAMILIES: [&str; 3] = ["step", "cubic", "bounded_velocity"];

/// `ln(v_f/v_i) + ln((v_i - 1)/(v_f - 1))`.
fn min_duration(v_i: f64, v_f: f64) -> f64 {
    ((v_i - v_f) / (v_i * (v_f - 1.0))).ln_1p()
}

#[test]
fn reference_every_number_is_good_to_rtol() {
    let rows = reference::table("shortcut_velocity");
    for family in FAMILIES {
        let rows: Vec<&Row> = rows.iter().filter(|row| row.text("family") == family).collect();
        assert!(rows.len() >= 55, "{family}: {} rows", rows.len());
        is_good_to_rtol(family, &rows);
    }
}

/// The first points of the stress sample, over the whole legal domain.
#[test]
fn reference_points_of_the_sample_are_good_to_rtol() {
    for family in FAMILIES {
        let rows = reference::table(&format!("stress_{family}"));
        assert!(rows.len() >= 40, "{family}: {} rows", rows.len());
        is_good_to_rtol(family, &rows.iter().collect::<Vec<_>>());
    }
}

fn is_good_to_rtol(family: &str, rows: &[&Row]) {
    for rtol in [1e-6, 1e-10, 1e-13] {
        for row in rows {
            let law = Law { a: row.number("a"), b: row.number("b") };
            let (v_i, v_f, t_f) = (row.number("v_i"), row.number("v_f"), row.number("t_f"));
            let solved = solve(family, &case(law, v_i, v_f, t_f), rtol);
            if row.text("status") == "infeasible" {
                let obstacle = solved.expect_err("has no member");
                assert_eq!(obstacle.status(), Status::Infeasible, "{row:?}");
                continue;
            }
            let shortcut = solved.unwrap_or_else(|obstacle| panic!("{row:?}: {obstacle}"));
            assert_eq!(shortcut.status().name(), row.text("status"), "{row:?}");
            // t_min is known to a few eps of itself, so alpha near it is known to that fraction of t_f - t_min.
            let t_min = min_duration(v_i, v_f);
            let has_least = family == "bounded_velocity";
            let near = if has_least { 2.0 * f64::EPSILON * t_min.abs() / (t_f - t_min) } else { 0.0 };
            // 1 + (a ln v + b ln theta), of which the second may be large and negative.
            let level = (law.a * shortcut.v_max.ln()).abs() + law.b * (v_i.max(v_f).ln());
            let rounding = 16.0 * f64::EPSILON * (1.0 + level);
            let tau = |value: f64| rounding / value.abs();
            let mean = row.number("work") / (v_i * t_f + v_f * t_f + 1.0);
            let columns = [
                ("alpha", shortcut.alpha, rtol + 32.0 * f64::EPSILON + near),
                ("work", Some(shortcut.work), rtol + 32.0 * f64::EPSILON + 0.1 * tau(mean) + near),
                ("v_min", Some(shortcut.v_min), rtol + 32.0 * f64::EPSILON + near),
                ("v_max", Some(shortcut.v_max), rtol + 32.0 * f64::EPSILON + near),
                ("friction_max", Some(shortcut.friction_max), rtol + tau(shortcut.friction_max) + near),
                ("miss", Some(shortcut.miss), 2.0 * f64::EPSILON * (8.0 + v_f * t_f)),
            ];
            for (name, found, budget) in columns {
                assert_eq!(found.is_some(), row.optional(name).is_some(), "{name} in {row:?}");
                let Some(found) = found else { continue };
                let error = relative(found, row.number(name));
                // A subnormal miss has lost digits.
                let ill_conditioned = name == "miss" && found.abs() < 1e-300;
                assert!(
                    error <= budget || ill_conditioned,
                    "{name} at {rtol}: {found} off by {error:.1e} > {budget:.1e} in {row:?}"
                );
            }
        }
    }
}

/// `theta' = 1 - theta v` and `W' = tau v` for a velocity that is given over `x = t/t_f`, with `ln theta` as variable.
/// `x` is a variable too: the library's steps shrink to nothing where a system depends on its argument.
struct Sliding<F> {
    law: Law,
    velocity: F,
    t_f: f64,
}

impl<F: Fn(f64) -> f64> System<f64, SVector<f64, 3>> for Sliding<F> {
    fn system(&self, _: f64, y: &SVector<f64, 3>, dy: &mut SVector<f64, 3>) {
        let v = (self.velocity)(y[2]);
        dy[0] = self.t_f * ((-y[0]).exp() - v);
        dy[1] = self.t_f * (1.0 + self.law.a * v.ln() + self.law.b * y[0]) * v;
        dy[2] = 1.0;
    }
}

/// `theta(t_f)` and the work by a library's integrator.
fn integrate(law: Law, velocity: impl Fn(f64) -> f64, theta: f64, t_f: f64) -> (f64, f64) {
    let start = SVector::<f64, 3>::new(theta.ln(), 0.0, 0.0);
    let sliding = Sliding { law, velocity, t_f };
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
    stepper.integrate().unwrap_or_else(|error| panic!("theta {theta}, t_f {t_f}: {error}"));
    let last = stepper.y_out().last().expect("has a last state");
    (last[0].exp(), last[1])
}

#[test]
fn reference_bounded_velocity_arrives_when_its_formula_is_integrated_as_an_ode() {
    let cases = [
        (3.0, 100.0, 0.02),
        (3.0, 100.0, 0.5),
        (100.0, 3.0, 0.5),
        (100.0, 3.0, 0.41),
        (1.001, 1e4, 1e-5),
        (1e4, 1.001, 7.2),
        (3.0, 3.000003, 0.1),
        (50.0, 40.0, 1e-2),
    ];
    for (v_i, v_f, t_f) in cases {
        let shortcut = solve("bounded_velocity", &case(PAPER, v_i, v_f, t_f), 1e-13).expect("has a member");
        let alpha = shortcut.alpha.expect("has a parameter");
        let l = ((v_f - 1.0) / (v_i - 1.0)).ln();
        let velocity = |x: f64| 1.0 + (v_i - 1.0) * (l * x - alpha * t_f * t_f * (1.0 - x) * x).exp();
        let (theta, work) = integrate(PAPER, velocity, 1.0 / v_i, t_f);
        assert!(relative(theta, 1.0 / v_f) < 1e-11, "{v_i} {v_f} {t_f}: theta v_f = {}", theta * v_f);
        assert!(relative(shortcut.work, work) < 1e-11, "{v_i} {v_f} {t_f}: {} {work}", shortcut.work);
    }
}

#[test]
fn reference_step_and_cubic_agree_with_an_ode() {
    for (v_i, v_f, t_f) in
        [(3.0, 100.0, 0.02), (3.0, 100.0, 1e-6), (100.0, 3.0, 0.9), (1.0, 1e3, 1e-3), (1e3, 1.0, 3.0)]
    {
        let step = solve("step", &case(PAPER, v_i, v_f, t_f), 1e-13).expect("always is");
        let (theta, work) = integrate(PAPER, |_| v_f, 1.0 / v_i, t_f);
        assert!((theta * v_f - 1.0 - step.miss).abs() < 1e-12 * (1.0 + step.miss), "{theta} {}", step.miss);
        assert!(relative(step.work, work) < 1e-11, "{} {work}", step.work);
        let Ok(cubic) = solve("cubic", &case(PAPER, v_i, v_f, t_f), 1e-13) else { continue };
        let rise = 1.0 / v_f - 1.0 / v_i;
        let velocity = |x: f64| (1.0 - 6.0 * rise * x * (1.0 - x) / t_f) / (1.0 / v_i + rise * x * x * (3.0 - 2.0 * x));
        let (theta, work) = integrate(PAPER, velocity, 1.0 / v_i, t_f);
        assert!(relative(theta, 1.0 / v_f) < 1e-10, "theta v_f = {}", theta * v_f);
        assert!(relative(cubic.work, work) < 1e-10, "{} {work}", cubic.work);
    }
}

/// Work along a motion whose pieces are linear in time: Romberg's scheme on every piece.
fn work_along(motion: &dyn Motion) -> f64 {
    let landmarks = motion.landmarks();
    let piece = |from: f64, to: f64| {
        let power = |s: f64| {
            let moment = motion.at(s);
            moment.friction * moment.v
        };
        let duration = motion.at(to - 1e-13).t.max(motion.at(to).t) - motion.at(from).t;
        let mut row = vec![0.5 * (power(from + 1e-15 * (to - from)) + power(to - 1e-15 * (to - from)))];
        for level in 1..10 {
            let count = 1 << (level - 1);
            let middle: f64 =
                (0..count).map(|i| power(from + (to - from) * (f64::from(i) + 0.5) / f64::from(count))).sum();
            let mut next = vec![0.5 * (row[0] + middle / f64::from(count))];
            for (k, coarse) in row.iter().enumerate() {
                let factor = 4f64.powi(k as i32 + 1);
                next.push((factor * next[k] - coarse) / (factor - 1.0));
            }
            row = next;
        }
        duration * row[row.len() - 1]
    };
    landmarks.windows(2).map(|pair| piece(pair[0], pair[1])).sum()
}

#[test]
fn reference_motions_carry_the_numbers_of_their_member() {
    let cases = [
        ("cubic", 3.0, 100.0, 0.02),
        ("cubic", 1.001, 1e8, 1e-8),
        ("cubic", 1e8, 1.001, 3.0),
        ("bounded_velocity", 3.0, 100.0, 0.02),
        ("bounded_velocity", 3.0, 100.0, 20.0),
        ("bounded_velocity", 100.0, 3.0, 0.4),
        ("bounded_velocity", 100.0, 3.0, 0.395_415_2),
        ("bounded_velocity", 1.001, 1e8, 1e-5),
        ("bounded_velocity", 1e8, 1.001, 7.0),
        ("bounded_velocity", 1.001, 1e8, 1e-14),
    ];
    for (family, v_i, v_f, t_f) in cases {
        let case = case(PAPER, v_i, v_f, t_f);
        let shortcut = solve(family, &case, 1e-12).unwrap_or_else(|o| panic!("{family} {case:?}: {o}"));
        let motion = motion(family, &case);
        let (start, end) = (motion.at(0.0), motion.at(1.0));
        assert_eq!((start.t, end.t, motion.duration()), (0.0, t_f, t_f));
        for (moment, v) in [(start, v_i), (end, v_f)] {
            assert!(relative(moment.v, v) < 1e-13, "{family} {case:?} {moment:?}");
            assert!(relative(moment.theta, 1.0 / v) < 1e-10, "{family} {case:?} {moment:?}");
        }
        let landmarks = motion.landmarks();
        assert_eq!((landmarks[0], landmarks[landmarks.len() - 1]), (0.0, 1.0));
        assert!(landmarks.windows(2).all(|pair| pair[0] < pair[1]));
        let (mut v_min, mut v_max, mut friction_max, mut t) = (f64::INFINITY, 0.0f64, f64::NEG_INFINITY, 0.0);
        let between = |pair: &[f64]| {
            let (from, to) = (pair[0], pair[1]);
            (0..=1000).map(move |i| from + (to - from) * f64::from(i) / 1000.0)
        };
        for s in landmarks.windows(2).flat_map(between) {
            let moment = motion.at(s);
            assert!(moment.t >= t, "{family} {case:?}: time falls at {moment:?}");
            let friction = 1.0 + PAPER.a * moment.v.ln() + PAPER.b * moment.theta.ln();
            assert!((moment.friction - friction).abs() < 1e-13, "{moment:?}");
            t = moment.t;
            (v_min, v_max) = (v_min.min(moment.v), v_max.max(moment.v));
            friction_max = friction_max.max(moment.friction);
        }
        // The samples come close to the extrema and never pass them.
        for (sampled, found) in
            [(shortcut.v_min, v_min), (v_max, shortcut.v_max), (friction_max, shortcut.friction_max)]
        {
            assert!(sampled <= found * (1.0 + 1e-11), "{family} {case:?}: {sampled} {found}");
            assert!(sampled >= found * (1.0 - 1e-4), "{family} {case:?}: {sampled} {found}");
        }
        let work = work_along(motion.as_ref());
        assert!(relative(work, shortcut.work) < 1e-9, "{family} {case:?}: {work} {}", shortcut.work);
    }
}

#[test]
fn reference_the_motion_of_the_step_relaxes() {
    for (v_i, v_f, t_f) in [(3.0, 100.0, 0.02), (1e8, 1.001, 5.0), (1.0, 1e8, 1e-3), (2.0, 2.0, 1.0)] {
        let motion = motion("step", &case(PAPER, v_i, v_f, t_f));
        assert_eq!((motion.at(0.0).t, motion.at(1.0).t), (0.0, t_f));
        for i in 0..=1000 {
            let moment = motion.at(f64::from(i) / 1000.0);
            let decay = (-v_f * moment.t).exp();
            let theta = decay / v_i - (-v_f * moment.t).exp_m1() / v_f;
            assert!(relative(moment.theta, theta) < 1e-12, "{moment:?} {theta}");
        }
    }
}

#[test]
fn paper_least_time_of_the_deceleration_is_0_39() {
    let t_min = min_duration(100.0, 3.0);
    assert!((t_min - 0.39).abs() < 0.01);
    let Err(Obstacle::Time { t_min: found }) = solve("bounded_velocity", &case(PAPER, 100.0, 3.0, 0.39), 1e-10) else {
        panic!("0.39 is too short");
    };
    assert!(relative(found, t_min) < 1e-15);
    let shortcut = solve("bounded_velocity", &case(PAPER, 100.0, 3.0, 0.5), 1e-10).expect("has a member");
    assert_eq!(shortcut.status(), Status::Ok);
    // Where the cubic would need v < 0.
    assert_eq!(solve("cubic", &case(PAPER, 100.0, 3.0, 0.4), 1e-10), Err(Obstacle::Velocity));
}

#[test]
fn paper_cubic_overshoots_v_f_far_in_a_short_time() {
    let shortcut = solve("cubic", &case(PAPER, 3.0, 100.0, 0.02), 1e-10).expect("has a member");
    assert!(shortcut.v_max > 5.0 * 100.0, "{}", shortcut.v_max);
    assert_eq!(shortcut.v_min, 3.0);
    // v ~ g(t/t_f)/t_f for short times.
    let shorter = solve("cubic", &case(PAPER, 3.0, 100.0, 2e-5), 1e-10).expect("has a member");
    let shortest = solve("cubic", &case(PAPER, 3.0, 100.0, 2e-7), 1e-10).expect("has a member");
    assert!(relative(shortest.v_max * 2e-7, shorter.v_max * 2e-5) < 1e-3);
}

#[test]
fn regress_a_cubic_that_dips_below_one_is_returned_and_states_so() {
    let shortcut = solve("cubic", &case(PAPER, 100.0, 3.0, 0.5), 1e-10).expect("v stays positive");
    assert!(shortcut.v_min > 0.0 && shortcut.v_min < 1.0, "{}", shortcut.v_min);
    assert_eq!(shortcut.status(), Status::BelowBound);
}

#[test]
fn regress_just_above_the_least_time_v_is_one_but_for_thin_layers() {
    for (v_i, v_f) in [(100.0, 3.0), (1e8, 1.001), (1e8, 1e7), (1.01, 1.001), (3.000003, 3.0)] {
        // The double of the library.
        let t_min = case(PAPER, v_i, v_f, 1.0).transition.min_duration();
        assert!(relative(t_min, min_duration(v_i, v_f)) < 4.0 * f64::EPSILON, "{v_i} {v_f}: {t_min}");
        let t_f = t_min * (1.0 + 1e-12);
        let spare = t_f - t_min;
        let shortcut = solve("bounded_velocity", &case(PAPER, v_i, v_f, t_f), 1e-10).expect("has a member");
        assert_eq!(shortcut.v_min, 1.0, "{v_i} {v_f}");
        // Both layers have the thickness 1/(alpha t_f): each slows theta by its fraction of t_f - t_min.
        let layers = shortcut.alpha.expect("has a parameter") * t_f * spare;
        assert!(layers > 0.2 && layers < 50.0, "{v_i} {v_f}: {layers}");
        for short in [t_min, 0.5 * t_min, 1e-9 * t_min] {
            let obstacle = solve("bounded_velocity", &case(PAPER, v_i, v_f, short), 1e-10);
            assert_eq!(obstacle, Err(Obstacle::Time { t_min }), "{v_i} {v_f} {short}");
        }
    }
}

#[test]
fn regress_equal_velocities_are_a_constant_protocol() {
    for (v, t_f) in [(1.001, 1e3), (3.0, 1e-9), (1e8, 10.0)] {
        let friction = 1.0 + (PAPER.a - PAPER.b) * f64::ln(v);
        for family in ["step", "cubic", "bounded_velocity"] {
            let case = case(PAPER, v, v, t_f);
            let shortcut = solve(family, &case, 1e-10).expect("has a member");
            assert_eq!((shortcut.v_min, shortcut.v_max, shortcut.miss), (v, v, 0.0), "{family}");
            assert!(shortcut.alpha.unwrap_or(0.0) == 0.0);
            assert!(relative(shortcut.friction_max, friction) < 4e-16, "{family} {}", shortcut.friction_max);
            assert!(relative(shortcut.work, friction * v * t_f) < 1e-15, "{family} {}", shortcut.work);
            let moment = motion(family, &case).at(0.3);
            assert!(relative(moment.theta, 1.0 / v) < 1e-14 && relative(moment.v, v) < 1e-15, "{moment:?}");
        }
    }
}

#[test]
fn regress_what_does_not_exist_states_why() {
    for family in ["step", "cubic", "bounded_velocity"] {
        let wrong = [
            case(Law { a: 0.0, b: 0.05 }, 3.0, 100.0, 0.02),
            case(Law { a: 0.03, b: -0.1 }, 3.0, 100.0, 0.02),
            case(Law { a: f64::NAN, b: 0.05 }, 3.0, 100.0, 0.02),
            case(PAPER, 0.5, 100.0, 0.02),
            case(PAPER, 3.0, 0.5, 0.02),
            case(PAPER, 3.0, f64::INFINITY, 0.02),
            case(PAPER, 3.0, 100.0, 0.0),
            case(PAPER, 3.0, 100.0, f64::INFINITY),
            case(PAPER, 3.0, 100.0, f64::NAN),
        ];
        for case in wrong {
            assert_eq!(solve(family, &case, 1e-10), Err(Obstacle::Domain), "{family} {case:?}");
            assert!(find(family).expect("is a family").motion(&case, 1e-10).is_err());
        }
    }
    for (v_i, v_f) in [(1.0, 3.0), (3.0, 1.0), (1.0, 1.0)] {
        assert_eq!(solve("bounded_velocity", &case(PAPER, v_i, v_f, 1.0), 1e-10), Err(Obstacle::End));
        assert!(solve("step", &case(PAPER, v_i, v_f, 1.0), 1e-10).is_ok());
        assert!(solve("cubic", &case(PAPER, v_i, v_f, 9.0), 1e-10).is_ok());
    }
}

#[test]
fn regress_every_corner_of_the_range_is_solved() {
    let velocities = [1.0 + 1e-12, 1.001, 1.5, 30.0, 1e4, 1e8];
    let mut solved = 0;
    for v_i in velocities {
        for v_f in velocities {
            for fraction in [1e-9, 1e-6, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e6] {
                for ratio in [0.0, 1.0, 50.0] {
                    for t_f in [fraction / v_f, min_duration(v_i, v_f).max(0.0) * (1.0 + fraction)] {
                        let case = case(Law { a: 1e-4, b: 1e-4 * ratio }, v_i, v_f, t_f);
                        for rtol in [1e-6, 1e-10, 1e-13] {
                            match solve("bounded_velocity", &case, rtol) {
                                Ok(shortcut) => {
                                    solved += 1;
                                    assert!(shortcut.work.is_finite() && shortcut.friction_max.is_finite(), "{case:?}");
                                    assert!(shortcut.v_min >= 1.0 && shortcut.v_max >= v_i.max(v_f), "{case:?}");
                                }
                                Err(obstacle) => assert_ne!(obstacle, Obstacle::NotConverged, "{case:?} at {rtol}"),
                            }
                        }
                        assert_ne!(solve("cubic", &case, 1e-10), Err(Obstacle::NotConverged));
                        assert_ne!(solve("step", &case, 1e-10), Err(Obstacle::NotConverged));
                    }
                }
            }
        }
    }
    assert!(solved > 2900, "{solved}");
}

#[test]
fn regress_work_counts() {
    let mut stats = SolverStats::default();
    let family = find("bounded_velocity").expect("is a family");
    family.solve(&case(PAPER, 3.0, 100.0, 0.02), 1e-10, &mut stats).expect("has a member");
    assert_eq!((stats.quadratures, stats.nodes), (5, 320));
}

#[test]
fn reference_radau_rule_is_exact_for_its_degree() {
    let rule = radau();
    assert_eq!((rule.u[NODES - 1], rule.rest[NODES - 1]), (1.0, 0.0));
    for degree in 0..=2 * NODES - 2 {
        let sum: f64 = rule.u.iter().zip(&rule.w).map(|(u, w)| w * u.powi(degree as i32)).sum();
        assert!(relative(sum, 1.0 / (degree as f64 + 1.0)) < 1e-14, "degree {degree}: {sum}");
    }
    let sum: f64 = rule.u.iter().zip(&rule.w).map(|(u, w)| w * u.powi(2 * NODES as i32)).sum();
    assert!(relative(sum, 1.0 / (2.0 * NODES as f64 + 1.0)) > 1e-16, "the degree is no higher");
    for degree in 0..NODES {
        let power = rule.u.map(|u| u.powi(degree as i32));
        let integrals = rule.integrals(&power);
        for (&u, found) in rule.u.iter().zip(integrals) {
            let exact = u.powi(degree as i32 + 1) / (degree as f64 + 1.0);
            assert!((found - exact).abs() < 1e-16 * (0.1 + 4.0 * u), "degree {degree} to {u}");
        }
        for u in [0.0, 1e-9, 0.123, 0.5, rule.u[7], 0.999, 1.0] {
            let start = if degree == 0 { 1.0 } else { 0.0 };
            assert!(
                (rule.interpolate(Some(start), &power, u) - f64::powi(u, degree as i32)).abs() < 1e-14,
                "{degree} at {u}"
            );
            assert!((rule.interpolate(None, &power, u) - f64::powi(u, degree as i32)).abs() < 1e-14, "{degree} at {u}");
        }
    }
    // A polynomial that is 0 at 0 may be of one degree more; the rounding is what `bounded_friction` counts with.
    for degree in 1..=NODES {
        let slopes = rule.slopes(&rule.u.map(|u| u.powi(degree as i32)));
        for (&u, found) in rule.u.iter().zip(slopes) {
            let exact = degree as f64 * u.powi(degree as i32 - 1);
            assert!((found - exact).abs() < 300.0 * f64::EPSILON, "slope of degree {degree} at {u}: {found} {exact}");
        }
    }
    for j in 0..NODES {
        assert!((rule.u[j] + rule.rest[j] - 1.0).abs() <= f64::EPSILON);
    }
}

#[test]
fn reference_dilogarithm_of_negative_arguments() {
    let square = std::f64::consts::PI * std::f64::consts::PI;
    assert!(relative(dilogarithm(-1.0), -square / 12.0) < 4e-16);
    // Landen: Li_2(-x) = -Li_2(x/(1 + x)) - ln(1 + x)^2/2 leads into the unit interval.
    for i in -80..=80 {
        let x = 10f64.powf(0.1 * f64::from(i));
        let expected = -dilogarithm(x / (1.0 + x)) - 0.5 * x.ln_1p().powi(2);
        assert!(relative(dilogarithm(-x), expected) < 4e-15, "{x}: {} {expected}", dilogarithm(-x));
    }
}

#[test]
fn reference_roots_of_polynomials() {
    // (x - 1/4)(x - 1/2)(x - 3/4)(x - 2), times 32.
    let roots = roots_between(&[-6.0, 47.0, -118.0, 112.0, -32.0].map(|c| -c), 0.0, 1.0);
    assert_eq!(roots.len(), 3, "{roots:?}");
    for (found, exact) in roots.iter().zip([0.25, 0.5, 0.75]) {
        assert!(relative(*found, exact) < 1e-14, "{found}");
    }
    // A root at 1e-14 keeps its digits.
    let roots = roots_between(&[-1e-14, 1.0, 1.0, 0.0, 3.0], 0.0, 0.5);
    assert_eq!(roots.len(), 1);
    assert!(relative(roots[0], 1e-14 - 1e-28) < 1e-15, "{roots:?}");
    assert!(roots_between(&[1.0, 0.0, 1.0], -5.0, 5.0).is_empty());
}

/// Ends so close to `v = 1` that theta depends on excesses of 1e-14: works were off by up to 1e-8.
#[test]
fn regress_works_of_bounded_velocity_that_ends_near_1() {
    for (a, b, v_i, v_f, t_f) in [
        (3.0337636112542627e-6, 5.154069349071326e-6, 193778775726.23297, 1.0000000000005314, 28.75928102330747),
        (0.12759216246512392, 0.08549748178616094, 2.7159654836887115, 1.0000000000000109, 31.710669870606424),
        (0.0009820626285478536, 8.823687098399451e-6, 5353.366060636093, 1.0000000000000222, 31.450755299922164),
        (0.18235831350970214, 0.00038676534730321653, 783636.0529573326, 1.0000000000001041, 29.940696764922556),
        (0.11203849461271626, 0.8671824725817633, 86832.6510979074, 1.0000000000000138, 32.04346029703987),
    ] {
        let case = case(Law { a, b }, v_i, v_f, t_f);
        let fine = solve("bounded_velocity", &case, 1e-13).expect("has a member").work;
        for rtol in [1e-4, 1e-6, 1e-8, 1e-10] {
            let rough = solve("bounded_velocity", &case, rtol).expect("has a member").work;
            assert!(relative(rough, fine) <= rtol + 1e-11, "{rtol}: {rough} {fine} in {case:?}");
        }
    }
}

/// Accelerations from a few units in the last place above 1: the time that theta has aged by was no number, or Newton's method
/// went from side to side of the root.
#[test]
fn regress_accelerations_from_near_1_have_members() {
    for (v_i, v_f, t_f) in [
        (1.0000000000000002, 3.9284274811939435, 3.562394294994745e-7),
        (1.0000000003117506, 145546016740.36246, 4.946497240424514e-10),
        (1.000000000000001, 2321565911.590869, 2.7476173557658705e-8),
        (1.0000000000000002, 373081570.5949581, 3.473192259781033e-17),
    ] {
        let case = case(Law { a: 0.03, b: 0.05 }, v_i, v_f, t_f);
        let fine = solve("bounded_velocity", &case, 1e-13).expect("has a member").work;
        for rtol in [1e-3, 1e-6, 1e-9] {
            let rough = solve("bounded_velocity", &case, rtol).expect("has a member").work;
            assert!(relative(rough, fine) <= rtol + 1e-11, "{rtol}: {rough} {fine} in {case:?}");
        }
    }
}

/// Greatest friction that is a small rest of terms of size 1, by Taylor series of 110 bits.
#[test]
fn regress_a_small_greatest_friction_is_good_to_rtol() {
    for (t_f, a, b, v_i, v_f, friction_max) in [
        (
            0.00290937123183722,
            0.015343257127902792,
            0.16529455471616664,
            694.7705303682163,
            26024.173648158474,
            0.021114379617535,
        ),
        (
            0.18241855418041925,
            0.22299246067944017,
            0.4845720492695942,
            39.5907406142355,
            260340.05479050046,
            0.136649307433753,
        ),
    ] {
        let found = solve("bounded_velocity", &case(Law { a, b }, v_i, v_f, t_f), 1e-10).expect("exists");
        assert!(relative(found.friction_max, friction_max) < 1e-10, "{}", found.friction_max);
    }
}
