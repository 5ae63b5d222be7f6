//! The landscape of cubic shortcuts against quadrature by repeated halving, which knows nothing of zeros or maps.

use crate::judge;
use crate::support::Random;
use slipsweep::model::{Law, Transition};
use slipsweep::numerics::gauss::rule;
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::{SolverStats, Status};

const PAPER: Transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.0, v_f: 100.0 };
const PAPER_TIMES: [f64; 3] = [0.02, 0.037, 0.049];
const ACCURACIES: [f64; 5] = [1e-6, 1e-8, 1e-10, 1e-12, 1e-13];

/// One shortcut, evaluated point by point.
#[derive(Debug, Clone, Copy)]
struct Plain {
    transition: Transition,
    t_f: f64,
    a_2: f64,
    a_3: f64,
}

/// The results of the landscape for it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Found {
    work: f64,
    v_min: f64,
    status: Status,
    stats: SolverStats,
}

impl Plain {
    /// `theta` and `t_f (1 - theta')` at `x = u` for `u >= 0`, at `x = 1 + u` for `u < 0`: from the nearer end, so that
    /// a small theta keeps its digits.
    fn at(&self, u: f64) -> (f64, f64) {
        let Transition { v_i, v_f, .. } = self.transition;
        let (theta_0, theta_1, rise) = (1.0 / v_i, 1.0 / v_f, (v_i - v_f) / (v_i * v_f));
        let a_4 = rise - self.a_2 - self.a_3;
        let x = if u < 0.0 { 1.0 + u } else { u };
        let theta = if u < 0.0 {
            theta_1 - u * (x * ((self.a_2 - rise) - x * a_4) - rise)
        } else {
            theta_0 + x * (self.a_2 + x * (self.a_3 + x * a_4))
        };
        (theta, self.t_f - (self.a_2 + x * (2.0 * self.a_3 + 3.0 * a_4 * x)))
    }

    /// `tau v dt/dx` and its absolute value.
    fn integrand(&self, u: f64) -> [f64; 2] {
        let Law { a, b } = self.transition.law;
        let (theta, n) = self.at(u);
        let power = (1.0 + a * libm::log(n / (self.t_f * theta)) + b * libm::log(theta)) * n / theta;
        [power, power.abs()]
    }

    fn panel(&self, low: f64, high: f64) -> [f64; 2] {
        let rule = rule(20);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let mut sums = [0.0; 2];
        for (x, w) in rule.x.iter().zip(&rule.w) {
            let [power, size] = self.integrand(middle + half * x);
            sums = [sums[0] + half * w * power, sums[1] + half * w * size];
        }
        sums
    }

    fn halve(&self, low: f64, high: f64, whole: [f64; 2], enough: f64, depth: u32) -> [f64; 2] {
        let middle = 0.5 * (low + high);
        let (left, right) = (self.panel(low, middle), self.panel(middle, high));
        let sums = [left[0] + right[0], left[1] + right[1]];
        if (sums[0] - whole[0]).abs() <= enough || depth == 0 {
            return sums;
        }
        let (left, right) =
            (self.halve(low, middle, left, enough, depth - 1), self.halve(middle, high, right, enough, depth - 1));
        [left[0] + right[0], left[1] + right[1]]
    }

    /// `int tau v dt` and `int |tau| v dt`.
    fn work(&self) -> [f64; 2] {
        let (late, early) = (self.panel(-0.5, 0.0), self.panel(0.0, 0.5));
        let enough = 3e-15 * (late[1] + early[1]);
        let (late, early) = (self.halve(-0.5, 0.0, late, enough, 50), self.halve(0.0, 0.5, early, enough, 50));
        [late[0] + early[0], late[1] + early[1]]
    }

    /// Least theta and `n` on a grid of `2 count` steps, and the least velocity, refined by a golden section.
    fn least(&self, count: usize) -> [f64; 3] {
        let v = |u: f64| {
            let (theta, n) = self.at(u);
            n / (self.t_f * theta)
        };
        let step = 0.5 / count as f64;
        let mut least = [f64::INFINITY; 3];
        let mut place = 0.0;
        for i in 0..=count {
            for u in [-(step * i as f64), step * i as f64] {
                // u = 0 is the start; the end is just below it.
                let u = if i == 0 && u.is_sign_negative() { -f64::MIN_POSITIVE } else { u };
                let (theta, n) = self.at(u);
                least = [least[0].min(theta), least[1].min(n), least[2].min(v(u))];
                place = if v(u) <= least[2] { u } else { place };
            }
        }
        let (mut low, mut high) = if place < 0.0 {
            ((place - step).max(-0.5), (place + step).min(-f64::MIN_POSITIVE))
        } else {
            ((place - step).max(0.0), (place + step).min(0.5))
        };
        let golden = 0.381_966_011_250_105_1;
        for _ in 0..60 {
            let (left, right) = (low + golden * (high - low), high - golden * (high - low));
            if v(left) < v(right) { high = right } else { low = left }
        }
        least[2] = least[2].min(v(0.5 * (low + high)));
        least
    }

    fn found(&self, landscape: &Landscape) -> Found {
        let (mut work, mut v_min, mut status) = ([f64::NAN], [f64::NAN], [Status::NotConverged]);
        let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
        let stats = landscape.evaluate(&[self.a_2], &[self.a_3], out);
        Found { work: work[0], v_min: v_min[0], status: status[0], stats }
    }
}

/// `count` values from -0.5 to 0.5.
fn axis(count: usize) -> Vec<f64> {
    (0..count).map(|i| -0.5 + i as f64 / (count - 1) as f64).collect()
}

/// One line of the landscape: all `a_3` at one `a_2`.
fn line(landscape: &Landscape, a_2: f64, a_3: &[f64]) -> (Vec<f64>, Vec<f64>, Vec<Status>, SolverStats) {
    let count = a_3.len();
    let (mut work, mut v_min, mut status) = (vec![0.0; count], vec![0.0; count], vec![Status::NotConverged; count]);
    let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
    let stats = landscape.evaluate(&vec![a_2; count], a_3, out);
    (work, v_min, status, stats)
}

#[test]
fn paper_landscape_keeps_every_accuracy_at_every_feasible_point() {
    let a_3 = axis(401);
    for t_f in PAPER_TIMES {
        let landscapes = ACCURACIES.map(|rtol| Landscape::new(&PAPER, t_f, rtol));
        for a_2 in axis(401) {
            let lines = landscapes.each_ref().map(|landscape| line(landscape, a_2, &a_3));
            for (i, &a_3) in a_3.iter().enumerate() {
                if lines[0].2[i] == Status::Infeasible {
                    continue;
                }
                let [reference, _] = Plain { transition: PAPER, t_f, a_2, a_3 }.work();
                for (rtol, (work, ..)) in ACCURACIES.into_iter().zip(&lines) {
                    let error = (work[i] / reference - 1.0).abs();
                    assert!(error <= rtol, "t_f {t_f}, a_2 {a_2}, a_3 {a_3}: {error:e} at rtol {rtol:e}");
                }
            }
        }
    }
}

#[test]
fn paper_landscape_has_exact_status_and_least_velocity() {
    let a_3 = axis(201);
    for t_f in PAPER_TIMES {
        let landscape = Landscape::new(&PAPER, t_f, 1e-10);
        for a_2 in axis(201) {
            let (_, v_min, status, _) = line(&landscape, a_2, &a_3);
            for (i, &a_3) in a_3.iter().enumerate() {
                let [theta, n, v] = Plain { transition: PAPER, t_f, a_2, a_3 }.least(100);
                // On the border itself rounding of the plain evaluation decides nothing; regress_* tests do.
                if theta.abs() < 1e-15 || n.abs() < 1e-15 {
                    continue;
                }
                let place = format!("t_f {t_f}, a_2 {a_2}, a_3 {a_3}");
                if status[i] == Status::Infeasible {
                    // A grid may miss a sign that changes between its points, by the square of its step.
                    assert!(theta.min(n) < 2e-4, "{place}: infeasible, but least theta {theta}, n {n}");
                    continue;
                }
                assert!(theta > 0.0 && n > 0.0, "{place}: feasible, but least theta {theta}, n {n}");
                // Of the plain evaluation: that of n over the least t_f theta.
                let rounding = 1e-12 + 1e-12 / v;
                assert!((v_min[i] / v - 1.0).abs() < rounding, "{place}: v_min {} against {v}", v_min[i]);
                assert_eq!(status[i] == Status::Ok, v_min[i] >= 1.0, "{place}");
            }
        }
    }
}

#[test]
fn many_materials_keep_their_accuracy_up_to_the_border() {
    let mut random = Random(88172645463325252);
    let mut checked = 0;
    while checked < 2000 {
        let a = random.between(1e-4, 0.3);
        let law = Law { a, b: 10.0 * a * random.next() };
        let transition = Transition { law, v_i: 1.0 + random.between(1e-3, 1e6), v_f: 1.0 + random.between(1e-3, 1e6) };
        let t_f = random.between(1e-9, 1e3);
        // n is a positive quadratic of known mean, so its ends are at most 9 times that.
        let rise = (transition.v_i - transition.v_f) / (transition.v_i * transition.v_f);
        let mean = t_f - rise;
        let mut place = |most: f64| {
            let (start, end) = (most * random.next() * random.next(), most * random.next() * random.next());
            let a_2 = t_f - mean * start;
            (a_2, mean * end - t_f - 2.0 * a_2 + 3.0 * rise)
        };
        let (inner, outer) = (place(9.0), place(27.0));
        let landscapes = ACCURACIES.map(|rtol| Landscape::new(&transition, t_f, rtol));
        let between = |s: f64| Plain {
            transition,
            t_f,
            a_2: inner.0 + s * (outer.0 - inner.0),
            a_3: inner.1 + s * (outer.1 - inner.1),
        };
        let feasible = |s: f64| between(s).found(&landscapes[0]).status != Status::Infeasible;
        if mean <= 0.0 || !feasible(0.0) || feasible(1.0) {
            continue;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if feasible(middle) { low = middle } else { high = middle }
        }
        let shortcut = between(low * (1.0 - random.between(1e-5, 1.0)));
        let [reference, size] = shortcut.work();
        for (rtol, landscape) in ACCURACIES.into_iter().zip(&landscapes) {
            let error = (shortcut.found(landscape).work - reference).abs() / size;
            // The plain evaluation itself loses digits where theta or n is nearly 0 inside: it can judge no better than
            // 1e-10 there.
            let [theta, n, _] = shortcut.least(500);
            let ill_conditioned = (theta * transition.v_i.min(transition.v_f)).min(n / mean) < 0.03;
            let judge = if ill_conditioned { 1e-10 } else { 2e-13 };
            assert!(error <= rtol.max(judge), "{shortcut:?}: {error:e} at rtol {rtol:e}");
        }
        checked += 1;
    }
}

/// `t_f (1 - theta')` at the end vanishes on `2 a_2 + a_3 = -0.99`, a line of the grid: only the rounding of the
/// coordinates decides. Velocities from exact rational arithmetic.
#[test]
fn regress_points_on_the_border_are_decided_exactly() {
    let landscape = Landscape::new(&PAPER, 0.02, 1e-10);
    for (a_2, a_3, v_min) in
        [(-0.5, 0.010000000000000009, 4.649058915617843e-14), (-0.4975, 0.0050000000000000044, 4.649058915617843e-14)]
    {
        let found = Plain { transition: PAPER, t_f: 0.02, a_2, a_3 }.found(&landscape);
        // So slow that friction is below 0.
        assert_eq!(found.status, Status::NegativeFriction);
        assert!((found.v_min / v_min - 1.0).abs() < 1e-14, "{}", found.v_min);
    }
    // theta'(0) = 1 and just above it.
    for a_2 in [0.02, 0.020000000000000018] {
        let found = Plain { transition: PAPER, t_f: 0.02, a_2, a_3: -0.3 }.found(&landscape);
        assert_eq!(found.status, Status::Infeasible, "{a_2}");
    }
}

/// Reference: 50-digit quadrature. Close pairs of zeros near the start, and zeros just beyond the end.
#[test]
fn regress_zeros_close_to_both_ends() {
    let cases = [
        ([0.05611217460538437, 0.4113088214653343, 640625.1500541139, 1.002546539359029], 919.6267614047433).with(
            -0.10815782460764245,
            1874.818635372492,
            -12122966.634583167,
        ),
        ([0.02189376355512217, 0.010826024949659696, 44.27401137397675, 4423.767896572818], 0.07781433039565566).with(
            -0.20823441154529795,
            0.567052377021662,
            6499.15194608383,
        ),
        ([0.030411301866694624, 0.21487814166166327, 18546.78301107986, 214764.481466066], 0.00029933356463209297)
            .with(-0.000269850913366327, 0.00042757638988498767, -47466.79925901642),
        ([0.00014409375260631408, 0.0007340859266480505, 1.0579413655202259, 1.0615278167947968], 58.81757388060599)
            .with(-11.909775721579019, 42.56556422933596, 23514.86504480085),
    ];
    for (shortcut, reference) in cases {
        let landscape = Landscape::new(&shortcut.transition, shortcut.t_f, 1e-13);
        let error = (shortcut.found(&landscape).work / reference - 1.0).abs();
        assert!(error <= 1e-13, "{shortcut:?}: {error:e}");
    }
}

/// A material and a time, to be completed with a shortcut and its work.
trait With {
    fn with(self, a_2: f64, a_3: f64, work: f64) -> (Plain, f64);
}

impl With for ([f64; 4], f64) {
    fn with(self, a_2: f64, a_3: f64, work: f64) -> (Plain, f64) {
        let ([a, b, v_i, v_f], t_f) = self;
        (Plain { transition: Transition { law: Law { a, b }, v_i, v_f }, t_f, a_2, a_3 }, work)
    }
}

#[test]
fn a_result_does_not_depend_on_its_neighbours() {
    let landscape = Landscape::new(&PAPER, 0.037, 1e-10);
    let a_3 = axis(101);
    for a_2 in [-0.31, -0.05364, 0.0171] {
        let (work, v_min, status, stats) = line(&landscape, a_2, &a_3);
        let mut total = SolverStats::default();
        for (i, &a_3) in a_3.iter().enumerate() {
            let alone = Plain { transition: PAPER, t_f: 0.037, a_2, a_3 }.found(&landscape);
            assert_eq!(alone.status, status[i]);
            if status[i] != Status::Infeasible {
                assert_eq!((alone.work.to_bits(), alone.v_min.to_bits()), (work[i].to_bits(), v_min[i].to_bits()));
            }
            total.quadratures += alone.stats.quadratures;
            total.nodes += alone.stats.nodes;
        }
        assert_eq!(total, stats);
    }
}

#[test]
fn no_order_and_no_split_changes_a_bit() {
    let mut places: Vec<(f64, f64)> = Vec::new();
    for a_2 in axis(61) {
        places.extend(axis(61).iter().map(|&a_3| (a_2, a_3)));
    }
    // Up to the border of feasibility, where plans of every kind are made.
    places.extend((1..40).map(|k| (0.02 * (1.0 - libm::pow(10.0, -0.4 * f64::from(k))), -0.3)));
    let others = [
        (Transition { law: Law { a: 0.01, b: 0.3 }, v_i: 50.0, v_f: 2.0 }, 1.0),
        (Transition { law: Law { a: 0.05, b: 0.02 }, v_i: 1.1, v_f: 1e6 }, 0.5),
    ];
    let landscapes = others.iter().map(|case| (*case, 1e-10));
    for ((transition, t_f), rtol) in
        [1e-6, 1e-10, 1e-13].map(|rtol| ((PAPER, 0.02), rtol)).into_iter().chain(landscapes)
    {
        let landscape = Landscape::new(&transition, t_f, rtol);
        let run = |places: &[(f64, f64)]| {
            let (a_2, a_3): (Vec<f64>, Vec<f64>) = places.iter().copied().unzip();
            let (mut work, mut v_min) = (vec![0.0; places.len()], vec![0.0; places.len()]);
            let mut status = vec![Status::NotConverged; places.len()];
            landscape.evaluate(
                &a_2,
                &a_3,
                LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status },
            );
            let bits = |values: Vec<f64>| values.into_iter().map(f64::to_bits).collect::<Vec<u64>>();
            (bits(work), bits(v_min), status)
        };
        let whole = run(&places);
        let feasible = whole.2.iter().filter(|&&status| status != Status::Infeasible).count();
        assert!(feasible > 1000, "{feasible} for {transition:?}");
        // A stride that meets all places once, in a very different order and in pieces of odd lengths.
        let order: Vec<usize> = (0..places.len()).map(|i| i * 1009 % places.len()).collect();
        for piece in order.chunks(37) {
            let (work, v_min, status) = run(&piece.iter().map(|&i| places[i]).collect::<Vec<_>>());
            for (k, &i) in piece.iter().enumerate() {
                let found = (work[k], v_min[k], status[k]);
                assert_eq!(found, (whole.0[i], whole.1[i], whole.2[i]), "{:?} of {transition:?} at {rtol}", places[i]);
            }
        }
    }
}

/// Plans are made for many shortcuts at once; a shortcut that needs a larger power than its neighbours must not change theirs.
#[test]
fn works_of_random_materials_do_not_depend_on_neighbours() {
    let mut random = Random(1);
    let mut feasible = 0;
    for case in 0..2000 {
        let law = Law { a: random.between(1e-3, 0.3), b: random.between(1e-3, 0.5) };
        let transition = Transition { law, v_i: random.between(1.001, 1e6), v_f: random.between(1.001, 1e6) };
        let (theta_0, theta_1) = (1.0 / transition.v_i, 1.0 / transition.v_f);
        let t_f = random.between(1e-2, 1e6) / transition.v_i.max(transition.v_f);
        let landscape = Landscape::new(&transition, t_f, [1e-6, 1e-10, 1e-13][case % 3]);
        let size = t_f + theta_0.max(theta_1);
        let axis = || (0..12).map(|i| 2.0 * f64::from(i) / 11.0 - 1.0);
        let places =
            axis().flat_map(|q| axis().map(move |p| (3.0 * p * size + theta_1 - theta_0, 2.1 * (q - p) * size)));
        let (a_2, a_3): (Vec<f64>, Vec<f64>) = places.unzip();
        let works = |a_2: &[f64], a_3: &[f64]| {
            let (mut work, mut status) = (vec![0.0; a_2.len()], vec![Status::NotConverged; a_2.len()]);
            landscape.evaluate(a_2, a_3, LandscapeBuffers { work: &mut work, v_min: &mut [], status: &mut status });
            work.into_iter().zip(status).map(|(work, status)| (work.to_bits(), status)).collect::<Vec<_>>()
        };
        let all = works(&a_2, &a_3);
        for i in (0..all.len()).filter(|&i| all[i].1 != Status::Infeasible) {
            feasible += 1;
            assert_eq!(works(&a_2[i..=i], &a_3[i..=i])[0], all[i], "{transition:?}, {t_f}, {}, {}", a_2[i], a_3[i]);
        }
    }
    assert!(feasible > 20_000, "{feasible}");
}

/// On lines of as many points as are settled together most least velocities are searched for span by span.
#[test]
fn spans_of_a_line_are_as_their_shortcuts_alone() {
    let landscape = Landscape::new(&PAPER, 0.037, 1e-10);
    let a_3 = axis(401);
    let mut inside = 0;
    for a_2 in [-0.4, -0.31, -0.05364, 0.0171] {
        let (work, v_min, status, _) = line(&landscape, a_2, &a_3);
        for (i, &a_3) in a_3.iter().enumerate().filter(|&(i, _)| status[i] != Status::Infeasible) {
            let shortcut = Plain { transition: PAPER, t_f: 0.037, a_2, a_3 };
            let alone = shortcut.found(&landscape);
            assert_eq!((alone.work.to_bits(), alone.v_min.to_bits()), (work[i].to_bits(), v_min[i].to_bits()));
            let [start, end] = [0.0, -f64::MIN_POSITIVE].map(|u| shortcut.at(u)).map(|(theta, n)| n / (0.037 * theta));
            inside += u32::from(alone.v_min < 0.999 * start.min(end));
        }
        // Fewer velocities than shortcuts are wanted, down to none of the last spans.
        for wanted in (0..a_3.len()).step_by(29) {
            let (mut some, mut status) = (vec![0.0; wanted], status.clone());
            let out = LandscapeBuffers { work: &mut [], v_min: &mut some, status: &mut status };
            landscape.evaluate(&[a_2; 401], &a_3, out);
            assert_eq!(some[..], v_min[..wanted]);
        }
    }
    assert!(inside > 200, "{inside}");
}

/// `tau'` is summed in units of `b - a`, which may be nothing.
#[test]
fn equal_effects_of_velocity_and_contacts_keep_their_digits() {
    for b in [0.03, 0.03 * (1.0 + f64::EPSILON), 0.03 * (1.0 - 1e-12), 0.03 + 1e-9] {
        let transition = Transition { law: Law { a: 0.03, b }, ..PAPER };
        let landscape = Landscape::new(&transition, 0.037, 1e-12);
        for (a_2, a_3) in [(-0.12, -0.066), (-0.25, 0.1), (-0.05, -0.3)] {
            let shortcut = Plain { transition, t_f: 0.037, a_2, a_3 };
            let found = shortcut.found(&landscape);
            let [work, size] = shortcut.work();
            assert_ne!(found.status, Status::Infeasible);
            assert!((found.work - work).abs() <= 1e-12 * size, "{shortcut:?}: {} and {work}", found.work);
        }
    }
}

#[test]
fn effort_is_spent_on_feasible_points_alone() {
    let landscape = Landscape::new(&PAPER, 0.02, 1e-10);
    let a_3 = axis(401);
    let (mut feasible, mut total) = (0, SolverStats::default());
    for a_2 in axis(401) {
        let (.., status, stats) = line(&landscape, a_2, &a_3);
        feasible += status.iter().filter(|&&s| s != Status::Infeasible).count() as u32;
        total.quadratures += stats.quadratures;
        total.nodes += stats.nodes;
    }
    assert_eq!(total.quadratures, feasible);
    assert_eq!(feasible, 69446);
    assert_eq!(total.nodes, 1_795_792);
}

#[test]
fn what_is_not_requested_is_not_computed() {
    let landscape = Landscape::new(&PAPER, 0.02, 1e-10);
    let (a_2, a_3) = ([-0.12, 0.4], [-0.07, 0.4]);
    let mut status = [Status::NotConverged; 2];
    let stats = landscape.evaluate(&a_2, &a_3, LandscapeBuffers { work: &mut [], v_min: &mut [], status: &mut status });
    assert_eq!(status, [Status::Ok, Status::Infeasible]);
    assert_eq!(stats, SolverStats::default());
    let (mut work, mut v_min) = ([7.0; 2], [7.0; 2]);
    landscape.evaluate(&a_2, &a_3, LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status });
    assert!(work[0] != 7.0 && v_min[0] != 7.0);
    assert_eq!((work[1], v_min[1]), (7.0, 7.0));
}

#[test]
fn no_coordinate_panics() {
    let landscape = Landscape::new(&PAPER, 0.02, 1e-10);
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 1e160, 5e-324];
    for a_2 in odd {
        let (work, v_min, status, _) = line(&landscape, a_2, &odd);
        for (i, a_3) in odd.into_iter().enumerate() {
            let sane = a_2 == 5e-324 && a_3 == 5e-324;
            assert_eq!(status[i] != Status::Infeasible, sane, "{a_2}, {a_3}: {:?}", status[i]);
            assert!(!sane || (work[i] > 0.0 && v_min[i] > 0.0));
        }
    }
}

/// Status, work and least velocity of one shortcut of the paper's law.
fn shortcut(v_i: f64, v_f: f64, t_f: f64, a_2: f64, a_3: f64, rtol: f64) -> (Status, f64, f64) {
    let landscape = Landscape::new(&Transition { v_i, v_f, ..PAPER }, t_f, rtol);
    let (work, v_min, status, _) = line(&landscape, a_2, &[a_3]);
    (status[0], work[0], v_min[0])
}

/// 60-digit arithmetic. What rounding costs `A_4` near its last bits had not been counted: velocities near 0 were off
/// or negative, and a shortcut that is not feasible was called so.
#[test]
fn regress_shortcuts_near_standstill() {
    let ends = (1.0000209365393198, 1.0000015231028443);
    let (_, _, v_min) =
        shortcut(ends.0, ends.1, 1.9413016820670486e-5, 1.941300051516957e-5, -1.645352653290548e-11, 1e-3);
    assert!((v_min / 1.720_843_759_323_131_2e-16 - 1.0).abs() < 1e-3, "{v_min:e}");
    let ends = (137.9213869972983, 1.0044021109958423);
    let (_, _, v_min) = shortcut(ends.0, ends.1, 0.9883666755211702, 0.98836667552117, 9.95810717255122e-22, 1e-10);
    assert!((v_min / 6.671_787_299_060_274e-17 - 1.0).abs() < 1e-10, "{v_min:e}");
    let ends = (4997653.7218464725, 1.00000000021693);
    let found = shortcut(ends.0, ends.1, 1.0003579731013132, 0.9998229964214663, -4.56687672156778e-6, 1e-10);
    assert_eq!(found.0, Status::Infeasible);
}

/// `v_min` is 1.000000000000001 in 60-digit arithmetic: it came out below 1 where the status is `ok`.
#[test]
fn regress_the_least_velocity_is_on_the_side_of_the_bound_that_the_status_states() {
    let (v_i, v_f, t_f) = (1472.7956884479472, 38.08732996379844, 0.03222291732502);
    let (status, _, v_min) = shortcut(v_i, v_f, t_f, 0.02263307617866728, 8.636609700465113e-5, 1e-10);
    assert_eq!((status, v_min), (Status::Ok, 1.0));
}

/// Near `theta = 0` a pair of zeros is so close to the real axis that its closed form has no digit of the distance.
#[test]
fn regress_works_near_theta_0() {
    for (v_i, v_f, t_f, a_2, a_3) in [
        (1.0000000000000262, 1.1909490862569156, 220111.22750737667, -2.513843771204648, -4.017770078845403e-5),
        (1.0000055294667975, 7695340.3526740745, 0.00205834334261616, -0.9999921503148949, -1.0010187767355003),
    ] {
        let [rough, fine] = [1e-8, 1e-13].map(|rtol| shortcut(v_i, v_f, t_f, a_2, a_3, rtol).1);
        assert!((rough / fine - 1.0).abs() < 1e-8, "{rough} {fine}");
    }
}

/// Zeros of several scales: a pair that all but touches the real axis near a third one at the start, `n` all but 0 everywhere, a
/// zero 1e-16 beyond the end without a logarithm of theta, a path much longer than both ends suggest.
#[test]
fn regress_works_with_zeros_of_several_scales() {
    for ([a, b, v_i, v_f, t_f], place, rtol) in [
        (
            [0.12771134682699903, 0.008054296086812216, 226846004436.63333, 1.00000000000041, 28.52287697405042],
            (0.00010898088906453852, -0.021096785949950084),
            1e-10,
        ),
        (
            [2.8783825393849702, 0.0005820842634676324, 57465565.12841112, 45349240.18854099, 4.6493604278747185e-9],
            (4.649360427872015e-9, 5.1651374759366986e-21),
            1e-12,
        ),
        (
            [6.418618583465492e-6, 6.418618583465492e-6, 1.0000000000000022, 3841540.9362283815, 2799746208945.687],
            (488751.35097401176, 721652150.1907557),
            1e-12,
        ),
        (
            [2.8086906641696894e-6, 3.695096459327166e-6, 1.0001883045310644, 1.0000001363284983, 7.408574350856026e16],
            (0.00018813275031176292, -6.749575769630921),
            1.2e-3,
        ),
    ] {
        let transition = Transition { law: Law { a, b }, v_i, v_f };
        let (truth, size) = judge::shortcut_work(&transition, t_f, place).expect("is judged");
        let (mut work, mut status) = ([f64::NAN], [Status::NotConverged]);
        let out = LandscapeBuffers { work: &mut work, v_min: &mut [], status: &mut status };
        Landscape::new(&transition, t_f, rtol).evaluate(&[place.0], &[place.1], out);
        assert!((work[0] - truth).abs() <= rtol * size, "{v_i} {v_f}: {} {truth}", work[0]);
    }
}

/// A close pair of zeros with the third one nearby, and a zero of theta 1e-15 beyond the end. Works from quadrature with 50
/// digits, over panels that double away from every zero.
#[test]
fn reference_works_near_several_zeros() {
    for ((law, v_i, v_f, t_f), (a_2, a_3), reference) in [
        (
            (Law { a: 2.9874847423939768, b: 10.0 }, 241913802.79474756, 1.0000000002174823, 22.24890385365414),
            (0.003661195740994983, -0.12833936892676173),
            -13095338897959.611,
        ),
        (
            (Law { a: 8.973324146389017e-5, b: 0.0 }, 820542734.4293783, 820542740.8129041, 978298.031505419),
            (978298.0315054024, -1.996117818054176e-27),
            51.499081933139436,
        ),
    ] {
        let transition = Transition { law, v_i, v_f };
        for rtol in [1e-3, 1e-6, 1e-8, 1e-10, 1e-13] {
            let work = Plain { transition, t_f, a_2, a_3 }.found(&Landscape::new(&transition, t_f, rtol)).work;
            assert!((work / reference - 1.0_f64).abs() < rtol, "{work} at {rtol:e}");
        }
    }
}
