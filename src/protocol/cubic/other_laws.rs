//! Landscapes under the slip law and that of Perrin, Rice and Zheng.
//!
//! `theta'` is at most the fastest rise `c`, and `theta v = u(lack)` depends on `lack = 1 - theta'/c = n/(c t_f)` alone. So feasible set, zeros and
//! panels are those of an ageing path of the duration `c t_f` ([`Ends::under`]). At the zeros of `n` the integrand has a square root in place of a
//! logarithm. Under the slip law `tau v = T v - a theta'/theta` with `T = 1 + (b - a) ln theta`, so that the work needs no logarithm of the velocity.

use super::Landscape;
use super::least_velocity::{Least, NEAR_ZERO, least_velocities};
use super::path::Path;
use super::rules::MappedPanel;
use crate::model::{Law, StateLaw};
use crate::numerics::elementary::ln;
use crate::numerics::lambert::above_branch;
use crate::numerics::lanes::{LANES, Lanes};
use crate::numerics::root::crossing;
use crate::protocol::Status;

impl Landscape {
    /// The least velocities of feasible shortcuts; others are meaningless.
    pub(super) fn least_velocities(&self, a_2: &Lanes, a_3: &Lanes, found: &[Status; LANES]) -> Lanes {
        let wanted = found.map(|found| if found == Status::Infeasible { 0.0 } else { 1.0 });
        let Least { mut v, place, doubt, lossy } = least_velocities(self.state, &self.ends, a_2, a_3, &wanted);
        for i in (0..LANES).filter(|&i| wanted[i] * (doubt[i] + lossy[i]) > 0.0) {
            let path = Path::new(&self.ends, a_2[i], a_3[i]);
            let inside = if doubt[i] > 0.0 { self.minima(&path, 1.0, -1.0) } else { vec![place[i]] };
            let places = inside.into_iter().chain([0.0, 1.0]);
            v[i] = places.map(|x| self.velocity(&path, x)).fold(f64::INFINITY, f64::min);
        }
        v
    }

    /// The place where the lack exceeds that of `v = 1` least.
    pub(in crate::protocol) fn slowest(&self, path: &Path) -> f64 {
        let exact = |x: &f64| {
            let (theta, n) = path.at(*x);
            n / self.ends.t_f - self.state.lack(theta)[0]
        };
        self.slow_places(path).min_by(|x, y| exact(x).total_cmp(&exact(y))).unwrap_or(0.0)
    }

    /// [`slowest`](Landscape::slowest) in double precision.
    pub(in crate::protocol) fn roughly_slowest(&self, path: &Path) -> f64 {
        self.slow_places(path).min_by(|x, y| self.excess(path, *x).total_cmp(&self.excess(path, *y))).unwrap_or(0.0)
    }

    /// By how much the lack exceeds that of `v = 1`.
    fn excess(&self, path: &Path, x: f64) -> f64 {
        path.n.at(x) / self.ends.t_f - self.state.lack(path.theta.at(x))[0]
    }

    /// The ends, and the places at which the excess is least within its neighbourhood.
    fn slow_places(&self, path: &Path) -> impl Iterator<Item = f64> {
        let trend = |x: f64| {
            let (slope, bend) = slopes(&path.theta.c, x);
            -bend / self.ends.t_f - self.state.lack(path.theta.at(x))[1] * slope
        };
        minima(trend, even_places().collect()).into_iter().chain([0.0, 1.0])
    }

    /// The least velocity and the least friction of a feasible shortcut.
    pub(in crate::protocol) fn least(&self, path: &Path) -> [f64; 2] {
        let places = self.minima(path, 1.0, -1.0).into_iter().chain([0.0, 1.0]);
        let v_min = places.map(|x| self.velocity(path, x)).fold(f64::INFINITY, f64::min);
        [v_min, self.friction_min(path)]
    }

    /// The greatest velocity of a feasible shortcut.
    pub(in crate::protocol) fn greatest_velocity(&self, path: &Path) -> f64 {
        let places = self.minima(path, -1.0, 1.0).into_iter().chain([0.0, 1.0, path.theta.minimum()]);
        places.map(|x| self.velocity(path, x)).fold(0.0, f64::max)
    }

    /// The velocity at `x`, from values of 32 digits.
    pub(super) fn velocity(&self, path: &Path, x: f64) -> f64 {
        let (theta, n) = path.at(x);
        self.state.product((n / self.ends.t_f).max(0.0)) / theta
    }

    /// The least friction on a feasible shortcut.
    pub(super) fn friction_min(&self, path: &Path) -> f64 {
        let Law { a, b } = self.law;
        let friction = |x: f64| {
            let (v, theta) = (self.velocity(path, x), path.at(x).0);
            if v > 0.0 { 1.0 + a * ln(v) + b * ln(theta) } else { f64::NEG_INFINITY }
        };
        self.minima(path, a, b - a).into_iter().chain([0.0, 1.0]).map(friction).fold(f64::INFINITY, f64::min)
    }

    /// The minima of `p ln(theta v) + q ln theta` inside the shortcut, and possibly other points.
    fn minima(&self, path: &Path, p: f64, q: f64) -> Vec<f64> {
        if self.state != StateLaw::Slip {
            // Of the power of n.
            let power = if self.state == StateLaw::Prz { 0.5 * p } else { p };
            let exponents = Law { a: power, b: power + q };
            let half = |end: f64| path.stationary(exponents, end).into_iter().map(move |d| (end - d).abs());
            return half(0.0).chain(half(1.0)).collect();
        }
        let trend = |x: f64| {
            let (theta, (slope, bend)) = (path.theta.at(x), slopes(&path.theta.c, x));
            let lack = (path.n.at(x) / self.ends.t_f).max(0.0);
            q * slope * self.ends.t_f * (lack - 1.0 + above_branch(lack)) - p * theta * bend
        };
        // Denser towards both ends, where theta may be small.
        let ends = (5..52).map(|k| (-k as f64).exp2());
        let mut places: Vec<f64> = even_places().chain(ends.clone()).chain(ends.map(|d| 1.0 - d)).collect();
        places.sort_by(f64::total_cmp);
        minima(trend, places)
    }
}

/// Intervals between even places. Chosen: three for each stationary point of a cubic of a cubic; hints at more are followed.
const INTERVALS: usize = 16;

/// Places that divide the path into equal intervals.
fn even_places() -> impl Iterator<Item = f64> {
    (0..=INTERVALS).map(|i| i as f64 / INTERVALS as f64)
}

/// Where a trend changes from falling to rising, from samples at ascending places.
fn minima(trend: impl Fn(f64) -> f64, places: Vec<f64>) -> Vec<f64> {
    let sample = |x: f64| (x, trend(x));
    let mut samples: Vec<(f64, f64)> = places.into_iter().map(sample).collect();
    for _ in 0..MAX_HALVINGS {
        let hints: Vec<bool> = samples.windows(3).map(hints_at_zeros).collect();
        if !hints.contains(&true) {
            break;
        }
        // Both intervals of a hint are halved.
        let is_halved = |i: usize| (i > 0 && hints[i - 1]) || hints.get(i) == Some(&true);
        let pairs = samples.windows(2).enumerate().filter(|&(i, _)| is_halved(i));
        let halves: Vec<(f64, f64)> = pairs.map(|(_, pair)| sample(0.5 * (pair[0].0 + pair[1].0))).collect();
        samples.extend(halves);
        samples.sort_by(|x, y| x.0.total_cmp(&y.0));
    }
    let pairs = samples.windows(2).filter(|pair| pair[0].1 < 0.0 && pair[1].1 >= 0.0);
    let between = |pair: &[(f64, f64)]| crossing(&trend, [pair[0].0, pair[1].0], [pair[0].1, pair[1].1], f64::EPSILON);
    pairs.map(between).collect()
}

/// Most halvings of intervals in which a pair of zeros may hide. Chosen: 1/512 of the path; between closer zeros the velocity changes by the cube of
/// their distance.
const MAX_HALVINGS: u32 = 5;

/// Whether three samples of one sign hint at two zeros between them: the parabola through them has its extremum there, close to 0 or beyond.
fn hints_at_zeros(samples: &[(f64, f64)]) -> bool {
    let &[(x, f), (y, g), (z, h)] = samples else { return false };
    if f * g <= 0.0 || g * h <= 0.0 {
        return false;
    }
    // f = g + slope (x - y) + bend (x - y)^2.
    let (before, after) = ((g - f) / (y - x), (h - g) / (z - y));
    let bend = (after - before) / (z - x);
    let slope = before + bend * (y - x);
    let extremum = -0.5 * slope / bend;
    extremum >= x - y && extremum <= z - y && bend * g > 0.0 && (g + 0.5 * slope * extremum) / g < NEAR_ZERO
}

/// First and second derivative of a cubic.
#[inline(always)]
fn slopes(&[_, c_1, c_2, c_3]: &[f64; 4], x: f64) -> (f64, f64) {
    (c_1 + x * (2.0 * c_2 + 3.0 * c_3 * x), 2.0 * c_2 + 6.0 * c_3 * x)
}

/// The contribution of one panel to the work.
pub(super) fn panel_sum(of: &Landscape, path: &Path, panel: &MappedPanel) -> f64 {
    let ([q0, q1, q2, q3], [n0, n1, n2]) = path.about(panel.centre);
    let Law { a, b } = of.law;
    let mut sum = 0.0;
    panel.each_node(|delta, weight| {
        let theta = q0 + delta * (q1 + delta * (q2 + delta * q3));
        let lack = ((n0 + delta * (n1 + delta * n2)) / of.ends.t_f).max(f64::MIN_POSITIVE);
        // The part of `tau v` that is integrated.
        let direct = if of.state == StateLaw::Prz { 0.5 * a * ln(lack) } else { 0.0 };
        sum += weight * (1.0 + (b - a) * ln(theta) + direct) * of.state.product(lack) / theta;
    });
    of.t_f * sum
}
