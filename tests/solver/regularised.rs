//! The regularised optimum: every number against a library's integration of the paper's equations and of pieces built
//! again, the order and the limit of its excess work, and its edges.

use crate::support::relative;
use nalgebra::{SMatrix, SVector as Vector};
use ode_solvers::dop_shared::OutputType;
use ode_solvers::{Dop853, SVector, System};
use slipsweep::model::{Law, Transition};
use slipsweep::protocol::optimal::{self, Optimum};
use slipsweep::protocol::regularised::{self, Regularised};
use slipsweep::protocol::{Solved, SpringBlock, Status, error};

#[derive(Debug, Clone, Copy)]
struct Case {
    slider: SpringBlock,
    velocities: (f64, f64),
    t_f: f64,
    bounded: bool,
}

const fn case(velocities: (f64, f64), t_f: f64) -> Case {
    Case { slider: SpringBlock { law: Law { a: 0.03, b: 0.05 }, k: 0.5, m: 1e-6 }, velocities, t_f, bounded: true }
}

/// Speeds up at once, slows down first, and waits at `v = 1`.
const FAST: Case = case((3.0, 100.0), 0.02);
const SLOWING: Case = case((3.0, 100.0), 0.045);
const HOLDING: Case = case((3.0, 100.0), 0.5);

fn solve(case: &Case, delta_t: f64, rtol: f64) -> Solved<Regularised> {
    regularised::solve(&case.slider, case.velocities, case.t_f, delta_t, case.bounded, rtol)
}

fn optimum(case: &Case) -> Optimum {
    let (v_i, v_f) = case.velocities;
    let transition = Transition { law: case.slider.law, v_i, v_f };
    optimal::solve(&transition, case.t_f, case.bounded, 1e-13).value.expect("exists")
}

/// State at one time: `ln v` with two derivatives in time, and `ln theta`.
#[derive(Debug, Clone, Copy)]
struct Moment {
    q: [f64; 3],
    y: f64,
}

/// The paper's equations of the optimum in `(ln v, ln theta, W)`, forwards or backwards.
struct Extremal {
    law: Law,
    sign: f64,
}

fn forwards(law: Law) -> Extremal {
    Extremal { law, sign: 1.0 }
}

impl Extremal {
    /// `ln v` with two derivatives: `v' = -(v/a)(b/theta + beta)`, `beta' = v (b/theta + beta)`.
    fn moment(&self, q: f64, y: f64) -> Moment {
        let Law { a, b } = self.law;
        let (v, theta) = (q.exp(), y.exp());
        let beta = -(1.0 + a + a * q + b * y) / theta;
        let pull = b / theta + beta;
        let bend = -b * (1.0 - theta * v) / (theta * theta) + v * pull;
        Moment { q: [q, -pull / a, -bend / a], y }
    }
}

impl System<f64, SVector<f64, 3>> for Extremal {
    fn system(&self, _: f64, s: &SVector<f64, 3>, ds: &mut SVector<f64, 3>) {
        ds[0] = self.sign * self.moment(s[0], s[1]).q[1];
        ds[1] = self.sign * ((-s[1]).exp() - s[0].exp());
        ds[2] = self.sign * (1.0 + self.law.a * s[0] + self.law.b * s[1]) * s[0].exp();
    }
}

/// A piece: `ln(v - floor)` is a quintic in the fraction of the time, a step in the stretched one, and a bump; the state
/// is `(ln theta, W, fraction)`.
#[derive(Clone)]
struct Piece {
    law: Law,
    floor: f64,
    /// Coefficients of the quintic, which has no rise.
    g: [f64; 6],
    rise: f64,
    /// That of `x^3 (1 - x)^3`.
    alpha: f64,
    stretch: [f64; 2],
    time: f64,
}

/// The value and two derivatives of a power.
fn powers(x: f64, n: i32) -> [f64; 3] {
    let n_f = f64::from(n);
    [
        x.powi(n),
        if n < 1 { 0.0 } else { n_f * x.powi(n - 1) },
        if n < 2 { 0.0 } else { n_f * (n_f - 1.0) * x.powi(n - 2) },
    ]
}

/// `(1 + p) x/(1 + p x + q (1 - x))` with two derivatives, as a quotient.
fn stretched(x: f64, [p, q]: [f64; 2]) -> [f64; 3] {
    let (above, below, slope) = ((1.0 + p) * x, 1.0 + p * x + q * (1.0 - x), p - q);
    let first = ((1.0 + p) * below - above * slope) / (below * below);
    [above / below, first, -2.0 * first * slope / below]
}

/// How far an end above the mean is stretched.
fn stretch(rho: f64) -> f64 {
    if rho > 1.0 { (4.0 * (rho * (1.0 + 10.0 * rho.ln()).powf(-1.0 / 3.0) - 1.0)).max(0.0) } else { 0.0 }
}

impl Piece {
    /// `v` and its first two derivatives in time.
    fn velocity(&self, x: f64) -> [f64; 3] {
        let [xi, xi_1, xi_2] = stretched(x, self.stretch);
        let mut h = [0.0; 3];
        for (n, c) in [(3, 10.0), (4, -15.0), (5, 6.0)] {
            h.iter_mut().zip(powers(xi, n)).for_each(|(h, power)| *h += self.rise * c * power);
        }
        let mut plain = [0.0; 3];
        let bump = [0.0, 0.0, 0.0, 1.0, -3.0, 3.0, -1.0];
        for (n, bump) in bump.into_iter().enumerate() {
            let c = self.alpha * bump + self.g.get(n).unwrap_or(&0.0);
            plain.iter_mut().zip(powers(x, n as i32)).for_each(|(plain, power)| *plain += c * power);
        }
        let g_1 = (h[1] * xi_1 + plain[1]) / self.time;
        let g_2 = (h[2] * xi_1 * xi_1 + h[1] * xi_2 + plain[2]) / self.time.powi(2);
        let w = (h[0] + plain[0]).exp();
        [self.floor + w, w * g_1, w * (g_2 + g_1 * g_1)]
    }
}

impl System<f64, SVector<f64, 3>> for Piece {
    fn system(&self, _: f64, s: &SVector<f64, 3>, ds: &mut SVector<f64, 3>) {
        let v = self.velocity(s[2])[0];
        ds[0] = self.time * ((-s[0]).exp() - v);
        ds[1] = self.time * (1.0 + self.law.a * v.ln() + self.law.b * s[0]) * v;
        ds[2] = 1.0;
    }
}

/// A library's integration: the states at `steps` equal steps, or for none the last state alone, which is the best.
fn integrate(
    system: impl System<f64, SVector<f64, 3>>,
    t: f64,
    start: SVector<f64, 3>,
    steps: f64,
) -> Vec<SVector<f64, 3>> {
    let (dx, output) = if steps > 0.0 { (t / steps, OutputType::Dense) } else { (t, OutputType::Sparse) };
    let mut stepper = Dop853::from_param(
        system,
        0.0,
        t,
        dx,
        start,
        1e-13,
        1e-13,
        0.9,
        0.0,
        0.333,
        6.0,
        t,
        0.0,
        100_000,
        u32::MAX,
        output,
    );
    stepper.integrate().expect("is integrated");
    stepper.y_out().clone()
}

/// The last state.
fn end(system: impl System<f64, SVector<f64, 3>>, t: f64, start: SVector<f64, 3>) -> SVector<f64, 3> {
    *integrate(system, t, start, 0.0).last().expect("has an end")
}

/// What the library and the formulas find: excess work and the ranges of `v` and `v_c`.
struct Found {
    excess: f64,
    v: Vec<f64>,
    control: Vec<f64>,
}

impl Found {
    fn range(values: &[f64]) -> [f64; 2] {
        [values.iter().copied().fold(f64::INFINITY, f64::min), values.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Takes in a moment with these derivatives of `v`.
    fn take(&mut self, slider: &SpringBlock, [v, v_1, v_2]: [f64; 3], theta: f64) {
        let SpringBlock { law: Law { a, b }, k, m } = *slider;
        self.v.push(v);
        self.control.push(v + (a * v_1 / v + b * (1.0 / theta - v) + m * v_2) / k);
    }

    /// Takes in the optimum along these states.
    fn keep(&mut self, slider: &SpringBlock, states: &[SVector<f64, 3>]) {
        for state in states {
            let at = forwards(slider.law).moment(state[0], state[1]);
            let v = at.q[0].exp();
            self.take(slider, [v, v * at.q[1], v * (at.q[2] + at.q[1] * at.q[1])], at.y.exp());
        }
    }

    /// Takes in a piece from one moment to another that replaces `work` of the optimum; `outer` determines which of the two
    /// are ends of the protocol.
    fn replace(
        &mut self,
        slider: &SpringBlock,
        floor: f64,
        (ends, outer, time): ([Moment; 2], [bool; 2], f64),
        work: f64,
    ) {
        let theta = ends.map(|at| at.y.exp());
        let mean = (time - (theta[1] - theta[0])) / (time * (theta[0] * theta[1]).sqrt()) - floor;
        let stretch = [0, 1].map(|i| if outer[i] { stretch((ends[i].q[0].exp() - floor) / mean) } else { 0.0 });
        let mut matrix = SMatrix::<f64, 6, 6>::zeros();
        let mut right = Vector::<f64, 6>::zeros();
        let mut levels = [0.0; 2];
        for (i, (x, at)) in [0.0, 1.0].into_iter().zip(ends).enumerate() {
            let (v, q) = (at.q[0].exp(), at.q);
            let (v_1, v_2, w) = (v * q[1], v * (q[2] + q[1] * q[1]), v - floor);
            let g = [w.ln(), v_1 / w * time, (v_2 / w - (v_1 / w).powi(2)) * time * time];
            // The step takes the rise.
            levels[i] = g[0];
            right.rows_mut(3 * i, 3).copy_from_slice(&[levels[0], g[1], g[2]]);
            for n in 0..6 {
                for (order, power) in powers(x, n as i32).into_iter().enumerate() {
                    matrix[(3 * i + order, n)] = power;
                }
            }
        }
        let hermite = matrix.lu().solve(&right).expect("is regular");
        let g = std::array::from_fn(|n| hermite[n]);
        let piece = |alpha: f64| Piece { law: slider.law, floor, g, rise: levels[1] - levels[0], alpha, stretch, time };
        let start = SVector::<f64, 3>::new(ends[0].y, 0.0, 0.0);
        let miss = |alpha: f64| end(piece(alpha), 1.0, start)[0] - ends[1].y;
        // More alpha, less theta.
        let (mut low, mut high) = (-10.0, 10.0);
        while miss(low) < 0.0 {
            low *= 1.5;
        }
        while miss(high) > 0.0 {
            high *= 1.5;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if miss(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        let piece = piece(0.5 * (low + high));
        self.excess += end(piece.clone(), 1.0, start)[1] - work;
        for state in &integrate(piece.clone(), 1.0, start, 20_000.0) {
            self.take(slider, piece.velocity(state[2]), state[0].exp());
        }
    }
}

/// An independent regularised optimum, except for `v` at both ends of the optimum and the time of its hold.
fn again(case: &Case, delta_t: f64, floors: [f64; 2]) -> Found {
    let Case { slider, velocities: (v_i, v_f), t_f, .. } = *case;
    let best = optimum(case);
    let law = slider.law;
    let steady = |v: f64| Moment { q: [v.ln(), 0.0, 0.0], y: -v.ln() };
    let mut found = Found { excess: 0.0, v: Vec::new(), control: Vec::new() };
    let held = |t: f64| Moment { q: [0.0; 3], y: (1.0 - (1.0 - 1.0 / v_i) * (-t).exp()).ln() };
    let moment = |state: &SVector<f64, 3>| forwards(law).moment(state[0], state[1]);
    // Where the first piece ends, and the optimum from there on.
    let hold = best.time_at_floor;
    let (leaving, work, last_start) = if hold > 0.0 {
        // A hold is long here: the first piece lies on it, the corner has a piece of its own.
        assert!(hold > 1.5 * delta_t && t_f - hold > 1.5 * delta_t);
        let worked = |from: f64, to: f64| {
            let steps = 20_000;
            let h = (to - from) / f64::from(steps);
            // Midpoints.
            (0..steps).map(|i| h * (1.0 + law.b * held(from + h * (f64::from(i) + 0.5)).y)).sum::<f64>()
        };
        let corner = SVector::<f64, 3>::new(0.0, held(hold).y, 0.0);
        let after = end(forwards(law), 0.5 * delta_t, corner);
        let before = held(hold - 0.5 * delta_t);
        let work = worked(hold - 0.5 * delta_t, hold) + after[2];
        found.replace(&slider, 0.0, ([before, moment(&after)], [false; 2], delta_t), work);
        (held(delta_t), worked(0.0, delta_t), (after, t_f - hold - 1.5 * delta_t))
    } else {
        let start = SVector::<f64, 3>::new(best.v_start.ln(), -v_i.ln(), 0.0);
        let after = end(forwards(law), delta_t, start);
        (moment(&after), after[2], (after, t_f - 2.0 * delta_t))
    };
    found.replace(&slider, floors[0], ([steady(v_i), leaving], [true, false], delta_t), work);
    let (from, time) = last_start;
    found.keep(&slider, &integrate(forwards(law), time, from, 20_000.0));
    // Backwards from the end.
    let last = SVector::<f64, 3>::new(best.v_end.ln(), -v_f.ln(), 0.0);
    let before = end(Extremal { law, sign: -1.0 }, delta_t, last);
    found.replace(&slider, floors[1], ([moment(&before), steady(v_f)], [false, true], delta_t), -before[2]);
    found
}

/// The bounds of the errors of work and gap hold, but for what the library leaves. How many of the errors are larger than
/// that.
fn error_bounds(case: &Case, delta_t: f64, (least, excess): (f64, f64)) -> u32 {
    let at = |rtol| solve(case, delta_t, rtol).value.expect("exists");
    let finest = at(error::TIGHTEST_RTOL);
    let mut reported = 0;
    for rtol in [1e-2, 1e-3, 1e-4, 1e-5] {
        let found = at(rtol);
        for (found, finest, truth) in
            [(found.gap, finest.gap, excess / least), (found.work, finest.work, least + excess)]
        {
            let (error, bound) = ((found - truth).abs(), error::bound(found, finest, found));
            let left = 1e-8 * excess.max(excess / least);
            assert!(error <= bound + left, "{case:?} {delta_t} {rtol}: {error:e} of {bound:e}");
            if error > 10.0 * left {
                assert!(bound < 10.0 * error, "{case:?} {delta_t} {rtol}: {error:e} of {bound:e}");
                reported += 1;
            }
        }
    }
    reported
}

#[test]
fn reference_every_number_is_what_a_library_finds() {
    let mut reported = 0;
    let unbounded = Case { bounded: false, ..case((3.0, 100.0), 0.045) };
    let soft =
        Case { slider: SpringBlock { law: Law { a: 0.05, b: 0.02 }, k: 0.05, m: 1e-4 }, ..case((5.0, 20.0), 0.03) };
    for (case, fraction, floors, status) in [
        (FAST, 0.1, [0.0, 0.0], Status::Ok),
        (FAST, 0.01, [0.0, 0.0], Status::Ok),
        (FAST, 0.4, [0.0, 0.0], Status::Ok),
        (SLOWING, 0.2, [0.0, 0.0], Status::Ok),
        (SLOWING, 0.01, [1.0, 0.0], Status::Ok),
        (unbounded, 0.2, [0.0, 0.0], Status::Ok),
        (HOLDING, 0.02, [0.0, 0.0], Status::BelowBound),
        (soft, 0.1, [0.0, 0.0], Status::Ok),
    ] {
        let delta_t = fraction * case.t_f;
        let solved = solve(&case, delta_t, 1e-10);
        assert_eq!(solved.status, status, "{case:?} {fraction}");
        let (value, expected) = (solved.value.expect("exists"), again(&case, delta_t, floors));
        let best = optimum(&case);
        assert!(relative(value.work_optimal, best.work) < 1e-12);
        assert!(relative(value.gap, expected.excess / best.work) < 1e-8, "{case:?} {fraction}: {value:?}");
        assert!(relative(value.work, best.work + expected.excess) < 1e-11, "{case:?} {fraction}: {value:?}");
        reported += error_bounds(&case, delta_t, (best.work, expected.excess));
        let [v, control] = [&expected.v, &expected.control].map(|values| Found::range(values));
        // Of 20,000 places the best is off by the square of the distance between two.
        assert!(relative(value.v_min, v[0]) < 1e-6 && relative(value.v_max, v[1]) < 1e-6, "{value:?} {v:?}");
        let size = 1e-5 * control[1].max(-control[0]);
        assert!((value.control_min - control[0]).abs() < size, "{case:?} {fraction}: {value:?} {control:?}");
        assert!((value.control_max - control[1]).abs() < size, "{case:?} {fraction}: {value:?} {control:?}");
    }
    assert!(reported >= 10, "{reported}");
}

/// `int r ln r dx` of the limiting profile of a piece, `r = v/v_*` with `ln r = ln(rho) s(1 - xi) + alpha x^3 (1 -
/// x)^3` and mean 1, by the trapezium rule, which converges fast for such a profile.
fn shape(rho: f64) -> f64 {
    let mean = |alpha: f64, f: &dyn Fn(f64) -> f64| {
        let n = 20_000;
        let ratio = |i: i32| {
            let x = f64::from(i) / f64::from(n);
            let z = 1.0 - stretched(x, [stretch(rho), 0.0])[0];
            let bump = alpha * (x * (1.0 - x)).powi(3);
            (rho.ln() * z.powi(3) * (10.0 - 15.0 * z + 6.0 * z * z) + bump).exp()
        };
        let ends = 0.5 * (f(ratio(0)) + f(ratio(n)));
        (ends + (1..n).map(|i| f(ratio(i))).sum::<f64>()) / f64::from(n)
    };
    let (mut low, mut high) = (-1e5, 1e4);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if mean(middle, &|r| r) < 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    mean(low, &|r| r * r.ln())
}

#[test]
fn the_excess_is_of_first_order_with_the_derived_limit() {
    for case in [FAST, case((3.0, 100.0), 0.037), HOLDING, case((100.0, 3.0), 0.5)] {
        let best = optimum(&case);
        let (v_i, v_f) = case.velocities;
        let start = best.v_start * shape(v_i / best.v_start);
        let end = best.v_end * shape(v_f / best.v_end);
        let limit = case.slider.law.a * (start + end);
        // The term of the next order, from the longest, halves with the length.
        let rates: Vec<f64> = [1e-5, 1e-6, 1e-7]
            .map(|fraction| {
                let delta_t = fraction * case.t_f;
                solve(&case, delta_t, 1e-12).value.expect("exists").gap * best.work / delta_t
            })
            .to_vec();
        let misses: Vec<f64> = rates.iter().map(|rate| rate / limit - 1.0).collect();
        assert!(misses[2].abs() < 1e-4, "{case:?}: {limit} {rates:?}");
        for pair in misses.windows(2) {
            assert!((pair[0] / pair[1] / 10.0 - 1.0).abs() < 0.1, "{case:?}: {misses:?}");
        }
    }
}

#[test]
fn the_work_does_not_depend_on_the_spring() {
    for delta_t in [0.1, 0.01] {
        let [soft, rigid] =
            [SpringBlock { k: 0.01, m: 1.0, ..FAST.slider }, SpringBlock { k: f64::INFINITY, ..FAST.slider }]
                .map(|slider| solve(&Case { slider, ..FAST }, delta_t * FAST.t_f, 1e-10).value.expect("exists"));
        assert_eq!([soft.work, soft.gap, soft.v_min, soft.v_max], [rigid.work, rigid.gap, rigid.v_min, rigid.v_max]);
        assert_eq!([rigid.control_min, rigid.control_max], [rigid.v_min, rigid.v_max]);
        let mut last = f64::INFINITY;
        for k in [1e7, 1e9, 1e11] {
            let stiff = Case { slider: SpringBlock { k, ..FAST.slider }, ..FAST };
            let found = solve(&stiff, delta_t * FAST.t_f, 1e-10).value.expect("exists");
            let lag = relative(found.control_max, rigid.v_max);
            assert!(lag < 0.03 * last, "{k}: {lag} {last}");
            last = lag;
        }
        assert!(last < 1e-5, "{last}");
    }
}

#[test]
fn pieces_near_a_hold_dip_below_the_bound_and_say_so() {
    for fraction in [0.3, 0.01, 1e-5] {
        let solved = solve(&HOLDING, fraction * HOLDING.t_f, 1e-10);
        assert_eq!(solved.status, Status::BelowBound);
        assert!(solved.value.is_some_and(|value| value.v_min > 0.0 && value.v_min < 1.0));
    }
    // Where the optimum only slows down, they need not.
    for fraction in [0.3, 0.01, 1e-5] {
        let solved = solve(&SLOWING, fraction * SLOWING.t_f, 1e-10);
        assert_eq!(solved.status, Status::Ok);
        assert!(solved.value.is_some_and(|value| value.v_min > 1.0));
    }
}

#[test]
fn regress_what_does_not_exist_is_infeasible() {
    let t_f = FAST.t_f;
    let at = |case: Case, delta_t: f64| {
        let solved = solve(&case, delta_t, 1e-10);
        assert!(solved.value.is_none() || solved.status != Status::Infeasible);
        solved.status
    };
    assert_eq!(at(FAST, 0.5 * t_f), Status::Ok);
    for delta_t in [0.5 * t_f * (1.0 + 1e-15), 0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(at(FAST, delta_t), Status::Infeasible, "{delta_t}");
    }
    assert_eq!(at(case((100.0, 3.0), 0.3), 0.01), Status::Infeasible);
    assert_eq!(at(case((1.0, 3.0), 0.3), 0.01), Status::Infeasible);
    let broken = |slider| at(Case { slider, ..FAST }, 0.01 * t_f);
    assert_eq!(broken(SpringBlock { k: 0.0, ..FAST.slider }), Status::Infeasible);
    assert_eq!(broken(SpringBlock { m: -1.0, ..FAST.slider }), Status::Infeasible);
    let b = 3.0;
    let weak = Case { slider: SpringBlock { law: Law { a: 0.03, b }, ..FAST.slider }, ..FAST };
    assert_eq!(at(weak, 0.01 * t_f), Status::Unproven);
}

#[test]
fn regress_every_corner_of_the_range_is_solved() {
    let velocities: [f64; 5] = [1.001, 1.5, 30.0, 1e3, 1e5];
    let mut solved = 0;
    for v_i in velocities {
        for v_f in velocities {
            let t_min = ((v_i - v_f) / (v_i * (v_f - 1.0))).ln_1p().max(0.0);
            for fraction in [1e-3, 0.1, 1.0, 10.0] {
                for t_f in [fraction / v_f, t_min * (1.0 + fraction)] {
                    for part in [0.5, 0.2, 1e-2, 1e-4] {
                        let case = Case { velocities: (v_i, v_f), t_f, ..FAST };
                        let found = solve(&case, part * t_f, 1e-8);
                        let transition = Transition { law: case.slider.law, v_i, v_f };
                        let best = optimal::solve(&transition, t_f, true, 1e-8).status;
                        let expected = if found.status == Status::BelowBound { Status::Ok } else { found.status };
                        assert_eq!(best, expected, "{case:?} {part}: {found:?}");
                        if let Some(value) = found.value {
                            solved += 1;
                            assert!(value.v_min > 0.0 && value.v_max.is_finite(), "{case:?} {part}: {value:?}");
                        }
                    }
                }
            }
        }
    }
    assert!(solved > 400, "{solved}");
}

#[test]
fn regress_work_counts() {
    let solved = solve(&FAST, 0.1 * FAST.t_f, 1e-10);
    assert_eq!((solved.stats.quadratures, solved.stats.nodes), (26, 1640));
}

#[test]
fn the_motion_carries_the_numbers() {
    for (case, fraction) in
        [(FAST, 0.1), (FAST, 0.5), (SLOWING, 0.01), (HOLDING, 0.02), (case((100.0, 3.0), 0.5), 0.05)]
    {
        let delta_t = fraction * case.t_f;
        let (solved, motion) =
            regularised::motion(&case.slider, case.velocities, case.t_f, delta_t, case.bounded, 1e-10);
        assert_eq!(solved, solve(&case, delta_t, 1e-10));
        let (value, motion) = (solved.value.expect("exists"), motion.expect("exists"));
        let marks = motion.landmarks();
        let mut before = motion.at(0.0);
        assert_eq!((before.t, before.theta), (0.0, 1.0 / case.velocities.0));
        let (mut work, mut range) = (0.0, [[f64::INFINITY, f64::NEG_INFINITY]; 2]);
        for pair in marks.windows(2) {
            let steps = 400;
            for i in 1..=steps {
                // Near a mark, so that a place just before and one just after are compared.
                let s = pair[0] + (pair[1] - pair[0]) * (f64::from(i) / f64::from(steps)).min(1.0 - 1e-12);
                let now = motion.at(s);
                let h = now.t - before.t;
                assert!(h >= 0.0, "{case:?} at {s}: {before:?} {now:?}");
                work += 0.5 * h * (before.friction * before.v + now.friction * now.v);
                let grown = h * (1.0 - 0.5 * (before.theta * before.v + now.theta * now.v));
                let change = now.theta - before.theta;
                assert!((change - grown).abs() <= 1e-4 * (h + change.abs()) + 1e-13, "{case:?} at {s}: {now:?}");
                for (range, x) in range.iter_mut().zip([now.v, now.v_c.expect("is reported")]) {
                    *range = [range[0].min(x), range[1].max(x)];
                }
                before = now;
            }
        }
        let end = motion.at(1.0);
        assert!(relative(end.t, case.t_f) < 1e-11 && relative(end.v, case.velocities.1) < 1e-9, "{end:?}");
        assert!(relative(end.theta * case.velocities.1, 1.0) < 1e-9, "{end:?}");
        assert!(relative(work, value.work) < 1e-4, "{work} {value:?}");
        let size = value.control_max.max(-value.control_min);
        assert!((range[1][0] - value.control_min).abs() < 1e-3 * size, "{range:?} {value:?}");
        assert!((range[1][1] - value.control_max).abs() < 1e-3 * size, "{range:?} {value:?}");
        assert!(relative(range[0][0], value.v_min) < 1e-3 && relative(range[0][1], value.v_max) < 1e-3);
    }
}

/// Friction falls below `b - a` on the way, where the quadrature of the optimum had too few nodes and its hold did not meet
/// its arc.
#[test]
fn regress_pieces_meet_where_the_optimum_need_not_be_unique() {
    let law = Law { a: 0.04441617478685306, b: 0.21926684639255162 };
    let (velocities, t_f) = ((8.261710127696999, 283.6422011468145), 1.092981213773395);
    let case = Case { slider: SpringBlock { law, k: f64::INFINITY, m: 0.0 }, velocities, t_f, bounded: true };
    let exact = solve(&case, 5.35e-4 * t_f, 1e-12);
    for rtol in [1e-6, 1e-8, 1e-10] {
        let found = solve(&case, 5.35e-4 * t_f, rtol);
        assert_eq!((found.status, exact.status), (Status::Unproven, Status::Unproven));
        let (found, exact) = (found.value.expect("has numbers"), exact.value.expect("has numbers"));
        assert!(relative(found.work, exact.work) < rtol && relative(found.gap, exact.gap) < 10.0 * rtol, "{found:?}");
    }
}

/// Theta follows `1/v` at the end of long pieces. These were stretched all the same, and peaked beyond all measure.
#[test]
fn regress_long_pieces_do_not_peak() {
    let law = Law { a: 1.885e-4, b: 6.17e-4 };
    for (velocities, t_f) in [((3.57e6, 31886.0), 151.5), ((1.34, 3.0), 65.0), ((5.6, 2.2e4), 24.0), ((2.0, 58.0), 1e3)]
    {
        let slider = SpringBlock { law, k: f64::INFINITY, m: 0.0 };
        for fraction in [0.3, 0.1, 1e-2, 1e-3] {
            let case = Case { slider, velocities, t_f, bounded: true };
            let found = solve(&case, fraction * t_f, 1e-10).value.expect("exists");
            let most = velocities.0.max(velocities.1).max(optimum(&case).v_end);
            assert!(found.v_max <= 2.0 * most, "{velocities:?} {t_f} {fraction}: {found:?}");
        }
    }
}

/// Without the bound a deceleration jumps down by a factor of about `e^(1/a)`: beyond 1e12 no piece is drawn.
#[test]
fn regress_a_standstill_is_infeasible() {
    let t_min = 1.0 / 3.0 - 1.0 / 100.0;
    let at = |a: f64| {
        let slider = SpringBlock { law: Law { a, b: 0.01 }, k: 1.0, m: 1e-6 };
        let case = Case { slider, velocities: (100.0, 3.0), t_f: t_min + 0.1, bounded: false };
        let found = solve(&case, 1e-3, 1e-10);
        (found.status, found.value.is_some())
    };
    assert_eq!([0.05, 0.02].map(at), [(Status::NegativeFriction, true), (Status::Infeasible, false)]);
}

/// A piece that is short near the lifetime of contacts: the slip, not theta, determines its velocity.
#[test]
fn regress_short_pieces_keep_the_digits_of_v_min() {
    let law = Law { a: 2.5401475772267644e-6, b: 0.0 };
    let slider = SpringBlock { law, k: 2.3583748302810077e23, m: 0.0136346039616178 };
    let case =
        Case { slider, velocities: (6804880689.211707, 106433661.09597254), t_f: 9.248594399029421e-9, bounded: true };
    let v_min = |rtol| solve(&case, 1.5791875720478793e-13, rtol).value.expect("has pieces").v_min;
    let exact = v_min(1e-13);
    for rtol in [1e-6, 1e-8, 1e-10] {
        assert!(relative(v_min(rtol), exact) <= rtol + 1e-10, "{rtol}: {} {exact}", v_min(rtol));
    }
}

/// Two extremes of the control velocity between two nodes, with slopes of one sign at both: `v_c_max` was 24 rtol too small.
#[test]
fn regress_two_extremes_between_two_nodes_are_found() {
    let slider =
        SpringBlock { law: Law { a: 0.009667847704338074, b: 0.0 }, k: 0.011369200743058134, m: 6.3186683515381965e-9 };
    let solved = regularised::motion(
        &slider,
        (1.606403045726257, 958.2102301354813),
        12.248931224546684,
        0.7789704607635612,
        true,
        1e-10,
    );
    let (value, motion) = (solved.0.value.expect("has numbers"), solved.1.expect("has a motion"));
    let marks = motion.landmarks();
    let fine =
        marks.windows(2).flat_map(|ends| (0..=2000).map(|i| ends[0] + (ends[1] - ends[0]) * f64::from(i) / 2000.0));
    let found = fine.filter_map(|s| motion.at(s).v_c).fold(f64::NEG_INFINITY, f64::max);
    assert!(value.control_max >= found * (1.0 - 2e-10), "{} {found}", value.control_max);
}

/// Rounding of places left no slope in the search for the start of the last piece: the row did not converge. The gap of short pieces is in
/// proportion to their length.
#[test]
fn regress_pieces_of_a_billionth_of_the_duration_are_solved() {
    let slider = SpringBlock { law: Law { a: 0.119015, b: 0.015379 }, k: 0.922764, m: 1.923139e-7 };
    let case = Case { slider, velocities: (4.181147, 4.238696), t_f: 0.01289901, bounded: true };
    let gap = |part: f64| solve(&case, part * case.t_f, 1e-10).value.expect("is solved").gap;
    for part in [1e-9, 2e-9, 3e-9, 5e-9, 1e-8] {
        assert!(relative(gap(part) / part, gap(1e-7) / 1e-7) < 4.0 * f64::EPSILON / part + 1e-7, "{part}");
    }
}

/// Ends within rounding of the bound: rounding chose between two pieces, so works at two accuracies differed by 2e-4 of themselves.
#[test]
fn regress_rounding_does_not_choose_the_piece() {
    let slider = |a, b| SpringBlock { law: Law { a, b }, k: 1.0, m: 0.0 };
    let cases = [
        (slider(0.009997349188535258, 0.0015176379993275158), 641667.2741643195, 1.050814111963941e-14, 0.1358523),
        (slider(0.002306516995236996, 0.00036020391600471215), 1.0095763067871886, 1.0908071333667237e-7, 0.1567214),
    ];
    for (slider, v_f, t_f, part) in cases {
        for v_i in [1.0 + f64::EPSILON, 1.0000000000000016, 1.0000000000000038, 1.0 + 1e-13] {
            let case = Case { slider, velocities: (v_i, v_f), t_f, bounded: false };
            let at = |rtol| solve(&case, part * t_f, rtol).value.expect("is solved").work;
            for rtol in [1e-6, 1e-9, 3.8e-13] {
                assert!(
                    relative(at(rtol), at(1e-12)) <= 2.0 * (rtol + 1e-12),
                    "{v_i} {rtol}: {} {}",
                    at(rtol),
                    at(1e-12)
                );
            }
        }
    }
}

/// Where friction falls below `b - a` the velocity of the optimum has a minimum inside, which the rows did not see.
#[test]
fn regress_the_least_velocity_may_lie_inside_the_optimum() {
    let law = Law { a: 0.09277699673632564, b: 0.30582394754152137 };
    let slider = SpringBlock { law, k: 0.005430997778573722, m: 0.3659999983411617 };
    let velocities = (1.0013437226483737, 6.655768274959893);
    let case = Case { slider, velocities, t_f: 5081.059658968803, bounded: false };
    let delta_t = 0.0032414461149289303;
    let v_min = solve(&case, delta_t, 1e-10).value.expect("is solved").v_min;
    let motion = regularised::motion(&case.slider, velocities, case.t_f, delta_t, false, 1e-10).1.expect("is solved");
    let places = (0..=100_000).map(|i| motion.at(f64::from(i) / 1e5).v);
    let seen = places.fold(f64::INFINITY, f64::min);
    assert!(v_min < 1e-12 && v_min <= seen * (1.0 + 1e-9) && v_min > 0.9 * seen, "{v_min} {seen}");
}

/// Between almost equal velocities the excess is a small difference of works. True gaps by Taylor series at 50 digits (`tests/reference/generate_regularised.py`).
#[test]
fn regress_small_gaps_keep_their_digits() {
    let cases = [
        (
            [0.001963687063027459, 0.006204606955667535, 1.276671596367123, 1.275671439236018],
            [8.534225157262075, 3.542646449679203e-10, 0.0028378018729460597, 0.0008513405618838179],
            1.2031242657e-5,
        ),
        (
            [0.0015584197899592008, 0.0, 13.920437906803139, 13.919649735078002],
            [f64::INFINITY, 0.0, 0.00011046875711315495, 9.345128677400449e-06],
            9.20409145177e-6,
        ),
    ];
    for ([a, b, v_i, v_f], [k, m, t_f, delta_t], gap) in cases {
        let slider = SpringBlock { law: Law { a, b }, k, m };
        for rtol in [1e-2, 1e-6, 1e-10] {
            let found =
                regularised::solve(&slider, (v_i, v_f), t_f, delta_t, true, rtol).value.expect("has numbers").gap;
            let error = (found / gap - 1.0).abs();
            // The reference has eleven digits, and rounding leaves some epsilon over the gap.
            assert!(error <= rtol + 1e-10, "{a} {rtol:e}: {found:e} {gap:e}");
        }
    }
}

/// The velocity overshoots just before the end of the last piece, where its slope vanishes; the greatest is that of a fine trace.
#[test]
fn regress_an_overshoot_before_the_end_is_seen() {
    let slider = SpringBlock {
        law: Law { a: 0.0015502959734901216, b: 0.00492779049952559 },
        k: 0.0033774917147892055,
        m: 3.950586775737542e-22,
    };
    let (velocities, t_f, delta_t) =
        ((1.0013147866638126, 4204805.908084423), 0.0024579918381777924, 0.00030876471182874086);
    let found = regularised::solve(&slider, velocities, t_f, delta_t, true, 1e-10).value.expect("has numbers");
    assert!((found.v_max / 4204805.912167092 - 1.0).abs() < 1e-10, "{found:?}");
}

/// At the end of so long a wait `1 - theta` is subnormal, and so are slopes there.
#[test]
fn regress_a_wait_until_theta_is_1_has_no_negative_friction() {
    let slider = SpringBlock { law: Law { a: 0.08, b: 0.05 }, k: f64::INFINITY, m: 0.0 };
    for t_f in [700.0, 712.0, 715.0, 718.0, 721.0, 724.0, 727.0, 740.0] {
        let case = Case { slider, velocities: (1.02, 1.05), t_f, bounded: true };
        for rtol in [1e-6, 1e-10, 1e-12] {
            assert_eq!(solve(&case, 0.001, rtol).status, Status::BelowBound, "{t_f} {rtol}");
        }
    }
}
