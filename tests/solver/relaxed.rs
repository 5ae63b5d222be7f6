//! The laws of slip and of Perrin, Rice and Zheng: least works against dynamic programming, random protocols and identities.

use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::protocol::optimal::Strategy;
use slipsweep::protocol::relaxed::{Relaxed, least_time, least_v_ceiling, motion, slopes, solve, work_error};
use slipsweep::protocol::{Solved, Status};

use crate::extent::quick_or_long;
use crate::support::Random;

const LAWS: [StateLaw; 2] = [StateLaw::Slip, StateLaw::Prz];

/// A problem: law, transition, duration and ceiling.
type Problem = (StateLaw, Transition, f64, f64);

fn transition(a: f64, b: f64, v_i: f64, v_f: f64) -> Transition {
    Transition { law: Law { a, b }, v_i, v_f }
}

fn solved(&(law, transition, t_f, ceiling): &Problem) -> Solved<Relaxed> {
    solve(law, &transition, t_f, ceiling)
}

fn found(problem: &Problem) -> Relaxed {
    solved(problem).value.unwrap_or_else(|| panic!("{problem:?}"))
}

/// A problem of the physical domain, feasible.
fn random_problem(random: &mut Random) -> Problem {
    let law = LAWS[(2.0 * random.next()) as usize];
    let a = random.between(1e-3, 0.3);
    let b = (a * [0.0, 0.5, 1.0, 1.5, 3.0, 10.0][(6.0 * random.next()) as usize]).min(0.5);
    let [v_i, v_f] = [(); 2].map(|()| {
        let greatest = [10.0, 1e3, 1e6, 1e10][(4.0 * random.next()) as usize];
        random.between(1.001, greatest)
    });
    let ceiling = (v_i.max(v_f) * (1.0 + random.between(1e-6, 1e4))).min(1e12);
    let transition = transition(a, b, v_i, v_f);
    let least = least_time(law, &transition, ceiling).expect("has one");
    let t_f = match (3.0 * random.next()) as u32 {
        0 => least * (1.0 + random.between(1e-8, 1.0)),
        1 => least + random.between(1e-6, 1e3),
        _ => least + random.between(1e-2, 1e2) / v_i.max(v_f),
    };
    (law, transition, t_f.min(1e7 / v_i.max(v_f)).max(least * (1.0 + 1e-9)), ceiling)
}

/// `d ln theta/dt`.
fn rate(law: StateLaw, w: f64, v: f64) -> f64 {
    law.rate(w.exp() * v) / w.exp()
}

/// The least work by dynamic programming: values on a grid of `ln theta`, a control that is constant for a step, linear interpolation. The target is
/// met by a penalty that the slope of the value exceeds nowhere.
fn by_programming(&(law, Transition { law: Law { a, b }, v_i, v_f }, t_f, ceiling): &Problem, cells: usize) -> f64 {
    let (low, high) = (-ceiling.ln() - 0.01, -1e-3);
    let width = (high - low) / cells as f64;
    let place = |w: f64| ((w - low) / width).clamp(0.0, cells as f64);
    let at = |values: &[f64], w: f64| {
        let place = place(w);
        let below = (place as usize).min(cells - 1);
        let fraction = place - below as f64;
        values[below] * (1.0 - fraction) + values[below + 1] * fraction
    };
    let mut values: Vec<f64> = (0..=cells).map(|i| PENALTY * (low + width * i as f64 + v_f.ln()).abs()).collect();
    let steps = (t_f * ceiling * cells as f64 / 40.0) as usize;
    let dt = t_f / steps as f64;
    // Both bounds and what lies between, by logarithm.
    let controls: Vec<f64> = (0..=CONTROLS).map(|i| ceiling.powf(i as f64 / CONTROLS as f64)).collect();
    for _ in 0..steps {
        let next: Vec<f64> = (0..=cells)
            .map(|i| {
                let w = low + width * i as f64;
                let cost = |&v: &f64| {
                    let half = w + 0.5 * dt * rate(law, w, v);
                    (1.0 + a * v.ln() + b * half) * v * dt + at(&values, w + dt * rate(law, half, v))
                };
                controls.iter().map(cost).fold(f64::INFINITY, f64::min)
            })
            .collect();
        values = next;
    }
    at(&values, -v_i.ln())
}

/// Work for a distance of 1 in `ln theta` from the target.
const PENALTY: f64 = 3.0;

/// Controls but one.
const CONTROLS: usize = 8;

#[test]
fn dynamic_programming_finds_no_less() {
    let cases: [Problem; 5] = [
        (StateLaw::Slip, transition(0.03, 0.05, 4.0, 20.0), 0.3, 40.0),
        (StateLaw::Slip, transition(0.05, 0.02, 15.0, 4.0), 1.0, 25.0),
        (StateLaw::Slip, transition(0.03, 0.05, 20.0, 2.5), 1.1, 30.0),
        (StateLaw::Prz, transition(0.03, 0.05, 4.0, 20.0), 0.3, 40.0),
        (StateLaw::Prz, transition(0.01, 0.2, 4.0, 6.0), 0.5, 40.0),
    ];
    for problem in &cases {
        let least = found(problem);
        // Interpolation adds a diffusion of the order of a cell.
        let errors = [400, 800, 1600].map(|cells| by_programming(problem, cells) / least.optimum.work - 1.0);
        assert!(errors[2] > -1e-3 && errors[2] < 0.03, "{problem:?}: {errors:?}");
        assert!(
            errors.windows(2).all(|pair| pair[1] < 0.75 * pair[0] || pair[1].abs() < 2e-3),
            "{problem:?}: {errors:?}"
        );
    }
}

/// The cost of a protocol with switches at random times that arrives by its last two arcs: a path to the last random state, then the optimum is
/// replaced by its value. Bellman's principle: no first arc does better.
#[test]
fn no_first_arc_is_better() {
    let mut random = Random(3);
    let mut compared = 0;
    for _ in 0..quick_or_long(3_000, 300_000) {
        let problem = random_problem(&mut random);
        let (law, transition, t_f, ceiling) = problem;
        let solved = solved(&problem);
        let (Status::Ok, Some(least)) = (solved.status, solved.value) else { continue };
        let v = ceiling.powf(random.next());
        let Law { a, b } = transition.law;
        // A short arc, by the midpoint rule.
        let w = -transition.v_i.ln();
        let u = v * w.exp();
        let damping = if law == StateLaw::Slip { v } else { (1.0 + u * u) / w.exp() };
        let dt = (1e-4 / damping).min(0.1 * t_f);
        let half = w + 0.5 * dt * rate(law, w, v);
        let end = w + dt * rate(law, half, v);
        let spent = (1.0 + a * v.ln() + b * half) * v * dt;
        let rest = Transition { v_i: (-end).exp(), ..transition };
        if rest.v_i > ceiling || rest.v_i <= 1.0 {
            continue;
        }
        let Some(rest) = solve(law, &rest, t_f - dt, ceiling).value else { continue };
        let lack = least.optimum.work - (spent + rest.optimum.work);
        // Rounding, and the third order of the rule.
        let noise =
            1e-12 * (1.0 + least.optimum.work.abs()) + 1e-9 * spent.abs() + work_error(&least, &transition, t_f);
        let noise = noise + 1e-7 * least.optimum.hamiltonian.abs() * dt;
        assert!(lack <= noise, "{problem:?} v = {v}: {lack:e} {noise:e} {dt:e} {:?} {:?}", least.optimum, rest.optimum);
        compared += 1;
    }
    assert!(compared > 1_000, "{compared}");
}

#[test]
fn the_hamiltonian_is_the_derivative_of_the_work() {
    let mut random = Random(5);
    let mut compared = 0;
    for _ in 0..quick_or_long(3_000, 300_000) {
        let problem = random_problem(&mut random);
        let (law, transition, t_f, ceiling) = problem;
        let Some(found) = solved(&problem).value else { continue };
        let here = found.optimum;
        // Within the time in which the path approaches steady sliding.
        let h = (1e-5 * t_f).min(0.05 / ceiling);
        let at = |t_f: f64| solve(law, &transition, t_f, ceiling).value.map(|found| found.optimum);
        let (Some(before), Some(after)) = (at(t_f - h), at(t_f + h)) else { continue };
        if before.strategy != after.strategy {
            continue;
        }
        let slope = (after.work - before.work) / (2.0 * h);
        let bend = (after.hamiltonian - before.hamiltonian).abs();
        let noise = work_error(&found, &transition, t_f) / h;
        // Simpson's rule.
        let error = (slope - (before.hamiltonian + 4.0 * here.hamiltonian + after.hamiltonian) / 6.0).abs();
        let relative = bend / here.hamiltonian.abs();
        // Nor where the rounding of t_f shows.
        if relative > 0.05 || h < 1e-9 * t_f {
            continue;
        }
        let allowed = (relative * relative + 1e-8) * here.hamiltonian.abs() + noise;
        assert!(error <= allowed, "{problem:?}: {slope} {here:?} {relative:e}");
        compared += 1;
    }
    assert!(compared > 1_000, "{compared}");
}

#[test]
fn random_points_have_sound_numbers() {
    let mut random = Random(7);
    let mut strategies = std::collections::BTreeSet::new();
    for _ in 0..quick_or_long(5_000, 1_000_000) {
        let problem = random_problem(&mut random);
        let (law, transition, t_f, ceiling) = problem;
        let solved = solved(&problem);
        assert!(solved.status != Status::NotConverged && solved.status != Status::Infeasible, "{problem:?} {solved:?}");
        let Some(Relaxed { optimum, chatter }) = solved.value else {
            assert_eq!(solved.status, Status::Unproven, "{problem:?}");
            continue;
        };
        strategies.insert(optimum.strategy);
        let rising = if optimum.strategy == Strategy::Rise { t_f } else { 0.0 };
        let times = optimum.time_at_floor + optimum.time_at_v_ceiling;
        assert!((times - t_f).abs() <= 1e-12 * t_f + rising, "{problem:?} {optimum:?}");
        assert!(optimum.time_at_floor >= 0.0 && optimum.time_at_v_ceiling >= 0.0, "{problem:?} {optimum:?}");
        if let Some(chatter) = chatter {
            let is_least = chatter.work_bang_bang >= optimum.work * (1.0 - 1e-13);
            assert!(is_least || solved.status != Status::Ok, "{problem:?} {chatter:?}");
        }
        let path = motion(law, &transition, t_f, ceiling).1.expect("has a motion");
        let ends = [path.at(0.0).theta * transition.v_i, path.at(1.0).theta * transition.v_f];
        assert!((ends[0] - 1.0).abs() < 1e-12 && (ends[1] - 1.0).abs() < 1e-7, "{problem:?} {ends:?}");
    }
    assert_eq!(strategies.len(), 4, "{strategies:?}");
}

#[test]
fn outside_of_the_domain_there_are_no_numbers() {
    let up = transition(0.03, 0.05, 4.0, 80.0);
    let status = |law, transition: &Transition, t_f, ceiling| solve(law, transition, t_f, ceiling).status;
    for law in LAWS {
        assert_eq!(status(law, &up, 0.1, 80.0), Status::Infeasible);
        assert_eq!(status(law, &up, 0.1, 79.0), Status::Infeasible);
        assert_eq!(status(law, &up, 1e-6, 600.0), Status::Infeasible);
        assert!(slopes(law, &up, 1e-6, 600.0).is_none());
        assert_eq!(status(law, &transition(0.03, 0.05, 80.0, 4.0), 10.0, 60.0), Status::Ok);
        assert_eq!(status(law, &transition(0.03, 0.05, 80.0, 70.0), 10.0, 60.0), Status::Unproven);
        assert_eq!(status(law, &transition(0.03, 0.05, 80.0, 80.0), 1.0, 80.0), Status::Ok);
        for t_f in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
            assert_eq!(status(law, &up, t_f, 600.0), Status::Infeasible);
        }
    }
    assert_eq!(status(StateLaw::Ageing, &up, 0.1, 600.0), Status::Infeasible);
    // The rise starts above the ceiling.
    assert_eq!(status(StateLaw::Slip, &transition(0.03, 0.05, 80.0, 4.0), 0.646, 20.0), Status::Unproven);
}

/// Central differences, whose error is the difference to that of twice the step.
#[test]
fn slopes_are_derivatives_of_the_work() {
    let mut random = Random(11);
    let mut compared = 0;
    for _ in 0..quick_or_long(2_000, 200_000) {
        let (law, problem, t_f, ceiling) = random_problem(&mut random);
        let Solved { status: Status::Ok, value: Some(here), .. } = solved(&(law, problem, t_f, ceiling)) else {
            continue;
        };
        let Law { a, b } = problem.law;
        let found = slopes(law, &problem, t_f, ceiling).expect("has an optimum");
        let inputs = [a, b, problem.v_i, problem.v_f, ceiling];
        let room = |v: f64, other: f64| (v - 1.0).min((other - v).abs());
        let [_, _, v_i, v_f, _] = inputs;
        let sizes =
            [a, b.max(1e-3), room(v_i, ceiling), room(v_f, ceiling), room(ceiling, v_i).min(room(ceiling, v_f))];
        for (place, slope) in [found.a, found.b, found.v_i, found.v_f, found.v_ceiling].into_iter().enumerate() {
            let work = |step: f64| {
                let mut moved = inputs;
                moved[place] += step * sizes[place];
                let [a, b, v_i, v_f, ceiling] = moved;
                let found = solve(law, &transition(a, b, v_i, v_f), t_f, ceiling).value?.optimum;
                (found.strategy == here.optimum.strategy).then_some(found.work)
            };
            let steps = [-2.0, -1.0, 1.0, 2.0].map(|step| work(step * STEP));
            let [Some(far_below), Some(below), Some(above), Some(far_above)] = steps else { continue };
            let [near, far] = [(above - below) / (2.0 * STEP), (far_above - far_below) / (4.0 * STEP)];
            // Steps as large as the distance to the least duration.
            if (near - far).abs() > 0.01 * near.abs() {
                continue;
            }
            // Of the works, and of the input.
            let rounding = 4.0 * f64::EPSILON * inputs[place] / sizes[place] * near.abs();
            let noise = (4.0 * work_error(&here, &problem, t_f) + rounding) / STEP;
            let error = (slope * sizes[place] - near).abs();
            assert!(
                error <= (near - far).abs() + noise + 1e-9 * near.abs(),
                "{place}: {problem:?} {law:?} {t_f} {ceiling} {error:e}"
            );
            compared += usize::from(noise < 1e-4 * near.abs());
        }
    }
    assert!(compared > 4_000, "{compared}");
}

/// Step of a difference, relative to the distance from a border.
const STEP: f64 = 1e-5;

#[test]
fn the_least_ceiling_makes_a_duration_the_least() {
    let mut random = Random(13);
    let mut compared = 0;
    for _ in 0..1_000 {
        let (law, problem, t_f, _) = random_problem(&mut random);
        let Some(least) = least_v_ceiling(law, &problem, t_f) else {
            assert!(problem.v_f <= problem.v_i);
            continue;
        };
        // Closer to v_f the ceiling has not enough digits.
        if least < problem.v_f * (1.0 + 1e-6) {
            continue;
        }
        let time = least_time(law, &problem, least).expect("is feasible");
        assert!((time / t_f - 1.0).abs() < 1e-8, "{problem:?} {t_f} {least} {time}");
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
}

/// A ceiling below `v_i` changes nothing for a path that waits first and slides at the ceiling last: it is the limit from above.
#[test]
fn a_ceiling_may_be_below_the_first_velocity() {
    for law in LAWS {
        let work = |v_i: f64| found(&(law, transition(0.03, 0.05, v_i, 4.0), 5.0, 60.0)).optimum.work;
        let works = [60.0 - 1e-6, 60.0 + 1e-6].map(work);
        assert!((works[0] - works[1]).abs() < 1e-8, "{works:?}");
        let below = found(&(law, transition(0.03, 0.05, 80.0, 4.0), 5.0, 60.0));
        assert!(below.optimum.strategy == Strategy::WaitJerk || law == StateLaw::Prz, "{below:?}");
    }
}

/// Protocols of three arcs of constant velocity have a work of -94.98 and of -15.36: they jump down to states where `T < 0`, and rise faster than at
/// `v = 1`.
#[test]
fn regress_a_fast_rise_from_a_feasible_weak_state_is_no_proof() {
    for (t_f, a, b, v_i, v_f, ceiling) in [
        (
            0.22154159550042463,
            0.007881882680759676,
            0.15720117994517083,
            15.795505468276955,
            22.68871017785537,
            6974.596584997595,
        ),
        (
            0.05651918084192962,
            0.010647952918719584,
            0.1695164451243126,
            3.8292430741976533,
            88.63766691243711,
            3290.4534525264035,
        ),
    ] {
        let found = solved(&(StateLaw::Slip, transition(a, b, v_i, v_f), t_f, ceiling));
        assert!(found.status == Status::Unproven && found.value.is_some(), "{found:?}");
    }
}

/// Without evolution effect the work is `t_f + [V (1 + a ln V) - 1] t_j` with the time `t_j` on the ceiling, whose derivative is elementary.
#[test]
fn slopes_by_the_velocity_before_keep_their_digits_without_evolution_effect() {
    for law in LAWS {
        for v_i in [1.0032, 1.1, 30.0] {
            for (t_f, v_f, ceiling) in [(0.01, 176e6, 1e12), (1.0, 176e6, 1e9), (20.0, 176e6, 1e12), (7.0, 40.0, 800.0)]
            {
                let (a, v) = (0.0022756257569547214, transition(0.0022756257569547214, 0.0, v_i, v_f));
                let on_ceiling = found(&(law, v, t_f, ceiling)).optimum.time_at_v_ceiling;
                let waited = t_f - on_ceiling;
                let by_time = if law == StateLaw::Slip {
                    let w = -f64::ln(v_i) * (-waited).exp();
                    -(-waited).exp() / v_i / (ceiling * (ceiling.ln() + w) - w)
                } else {
                    // Of (1 - theta)/(1 + theta), which decays like e^-t.
                    let q = (v_i - 1.0) / (v_i + 1.0) * (-waited).exp();
                    let turn = (1.0 - q) / (1.0 + q);
                    let left = 4.0 * q / ((1.0 + q) * (1.0 + q));
                    -2.0 * left / ((v_i - 1.0) * (v_i + 1.0) * turn * turn * (ceiling * ceiling - 1.0))
                };
                let expected = (ceiling * (1.0 + a * ceiling.ln()) - 1.0) * by_time;
                let slope = slopes(law, &v, t_f, ceiling).expect("has an optimum").v_i;
                assert!((slope / expected - 1.0).abs() < 1e-12, "{law:?} {v:?} {t_f} {ceiling}: {slope} {expected}");
            }
        }
    }
}
