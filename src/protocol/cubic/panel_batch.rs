//! The works of eight shortcuts at a time, without logarithms at the nodes.
//!
//! `W = int tau v dt`, and `tau` is known at both ends, its derivative `tau'` rational: `tau = (tau_0 + tau_1)/2 + 1/2
//! int sign(x - y) tau'(y) dy`. So the work is the mean of `tau_0` and `tau_1` times `int v dt`, plus a bilinear form of
//! `v` and `tau'`, which the nodes of one Gauss rule give to the order of that rule
//! ([`Primitive`](crate::numerics::gauss::Primitive)).
//!
//! Under the law of Perrin, Rice and Zheng `tau = 1 + a/2 ln n + (b - a) ln theta` up to a constant. Under the slip law
//! `tau v = T v - a theta'/theta` with `T = 1 + (b - a) ln theta`: the sums use `T` for tau, and the rest depends on the ends alone.

use multiversion::multiversion;

use super::path::Ends;
use super::plan::MAX_SQUARINGS;
use super::product::{Ageing, Product, Prz, Slip};
use crate::model::{Law, StateLaw};
use crate::numerics::elementary::ln;
use crate::numerics::gauss::{MAX_HALF, Primitive, ROWS};
use crate::numerics::lanes::{Lanes, Vector, choose};

/// Panels of eight shortcuts with equal numbers of nodes, each with its map `delta = side (gap - s^(2^squarings))` of the distance from an end
/// of the panel.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PanelBatch {
    pub a_2: Lanes,
    pub a_3: Lanes,
    /// Bounds of the panel; one of them is an end of `[0, 1]`.
    pub low: Lanes,
    pub high: Lanes,
    /// The end at which the map begins: +1 the upper, -1 the lower.
    pub side: Lanes,
    /// Distance of the centre of the map beyond that end.
    pub gap: Lanes,
    /// log2 of the power.
    pub squarings: Lanes,
    /// Bounds of the mapped variable `s`.
    pub from: Lanes,
    pub to: Lanes,
}

/// The friction data common to the shortcuts of a landscape.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionTerms {
    /// The factor of `ln n`.
    a: f64,
    /// `b - a`.
    slope: f64,
    /// `(b - a) t_f`, the unit of `tau'` in the sums; replaced by a tiny number if it is 0.
    drive: f64,
    /// `tau` for `n = 1` and `theta = 1`.
    constant: f64,
    /// Sum of ln theta at both ends.
    ln_theta: f64,
}

impl FrictionTerms {
    pub fn new(state: StateLaw, law: Law, ends: &Ends) -> FrictionTerms {
        let ln_theta = ln(ends.theta_0.high) + ln(ends.theta_1.high);
        let slope = law.b - law.a;
        let unit = if slope.abs() > MIN_WEAKENING * law.a { slope } else { MIN_WEAKENING * law.a };
        let a = match state {
            StateLaw::Ageing => law.a,
            StateLaw::Slip => 0.0,
            StateLaw::Prz => 0.5 * law.a,
        };
        FrictionTerms { a, slope, drive: unit * ends.t_f, constant: 1.0 - a * ln(ends.t_f), ln_theta }
    }
}

/// Least magnitude of `b - a` in the unit of the sums, in units of `a`. Chosen: far below the rounding of `a`.
const MIN_WEAKENING: f64 = 1e-30;

/// Memory for the values at the nodes: sums and differences of values on both sides of the middle.
#[derive(Debug, Clone)]
pub(super) struct NodeBuffer {
    v_even: [Vector; MAX_HALF],
    v_odd: [Vector; MAX_HALF],
    g_even: [Vector; MAX_HALF],
    g_odd: [Vector; MAX_HALF],
}

impl NodeBuffer {
    pub const EMPTY: NodeBuffer = {
        let none = [Vector::splat(0.0); MAX_HALF];
        NodeBuffer { v_even: none, v_odd: none, g_even: none, g_odd: none }
    };
}

/// The constants of a bundle for all its nodes. Positions are given by `eta = gap - s^(2^squarings) = side delta`.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Prepared {
    /// Coefficients of theta and of n in powers of `eta`.
    pub theta: [Vector; 4],
    pub n: [Vector; 3],
    /// `a dn/d(delta)` in powers of `eta`, in units of `drive side`.
    slope: [Vector; 2],
    /// `(b - a) t_f`, times `side`.
    drive: Vector,
    /// Mean of tau at both ends.
    tau: Vector,
    pub gap: Vector,
    pub squarings: Vector,
    pub middle: Vector,
    pub half: Vector,
    /// 1, loaded from memory like the others: with a constant, the compiler would split the lanes.
    pub unit: Vector,
    /// The constant factor of `d(eta)/dx`, `x` the node of the rule.
    pub scale: Vector,
    /// `1/t_f`.
    inverse_time: Vector,
    /// Whether all maps are squares.
    are_squares: bool,
}

impl Prepared {
    /// The works; those of empty lanes are meaningless.
    #[inline(always)]
    pub fn works(&self, state: StateLaw, rule: &Primitive, space: &mut NodeBuffer) -> Lanes {
        match (state, self.are_squares) {
            (StateLaw::Ageing, true) => sum::<true, Ageing>(self, rule, space),
            (StateLaw::Ageing, false) => sum::<false, Ageing>(self, rule, space),
            (StateLaw::Slip, true) => sum::<true, Slip>(self, rule, space),
            (StateLaw::Slip, false) => sum::<false, Slip>(self, rule, space),
            (StateLaw::Prz, true) => sum::<true, Prz>(self, rule, space),
            (StateLaw::Prz, false) => sum::<false, Prz>(self, rule, space),
        }
    }
}

/// Prepares the sum of a bundle.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub(super) fn prepare(panel_batch: &PanelBatch, ends: &Ends, friction: &FrictionTerms, prepared: &mut Prepared) {
    let [a_2, a_3, low, high] = [panel_batch.a_2, panel_batch.a_3, panel_batch.low, panel_batch.high].map(Vector);
    let [side, gap, squarings] = [panel_batch.side, panel_batch.gap, panel_batch.squarings].map(Vector);
    let [from, to] = [panel_batch.from, panel_batch.to].map(Vector);
    let (t_f, rise) = (ends.t_f, ends.rise.high);
    let [none, unit] = [0.0, 1.0].map(Vector::splat);
    // The polynomials are expanded about the end at which the map begins; for a part of a cut panel, about the end of `[0, 1]`.
    let centre = choose(low, unit, choose(unit - high, none - unit, side));
    let slope = 3.0 * rise - (2.0 * a_2 + a_3);
    let bend = 3.0 * rise - (3.0 * a_2 + 2.0 * a_3);
    let a_4 = rise - (a_2 + a_3);
    let [theta_0, theta_1] = [ends.theta_0.high, ends.theta_1.high].map(Vector::splat);
    let (q0, q1) = (choose(centre, theta_1, theta_0), choose(centre, slope, a_2));
    let (q2, q3) = (choose(centre, bend, a_3), a_4);
    let (n0, n1, n2) = (t_f - q1, -2.0 * q2, -3.0 * q3);
    // Both ends of the panel, and tau there from the polynomials used at the nodes.
    let length = high - low;
    let near = choose(side, high, low) - choose(centre, unit, none);
    let far = near - side * length;
    let theta_at = |delta: Vector| q0 + delta * (q1 + delta * (q2 + delta * q3));
    let n_at = |delta: Vector| n0 + delta * (n1 + delta * n2);
    let part = unit - length;
    let mut ln_theta = Vector::splat(friction.ln_theta);
    if part != none {
        let of_part = (theta_at(near) * theta_at(far)).map(ln);
        ln_theta = choose(part, of_part, ln_theta);
    }
    let ln_n = (n_at(near) * n_at(far)).map(ln);
    let mut factor = unit;
    for level in 1..=MAX_SQUARINGS {
        let more = squarings - Vector::splat(f64::from(level) - 0.5);
        factor = choose(more, factor + factor, factor);
    }
    let half = 0.5 * (to - from);
    *prepared = Prepared {
        inverse_time: Vector::splat(1.0 / t_f),
        theta: [q0, side * q1, q2, side * q3],
        n: [n0, side * n1, n2],
        slope: [(friction.a / friction.drive) * n1, (2.0 * friction.a / friction.drive) * (side * n2)],
        drive: friction.drive * side,
        tau: friction.constant + 0.5 * (friction.a * ln_n + friction.slope * ln_theta),
        gap: side * near + gap,
        squarings,
        middle: 0.5 * (from + to),
        half,
        unit,
        scale: half * factor,
        are_squares: squarings == unit,
    };
}

/// The works of any maps, or of squares only.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn sum<const SQUARES: bool, P: Product>(prepared: &Prepared, rule: &Primitive, space: &mut NodeBuffer) -> Lanes {
    let NodeBuffer { v_even, v_odd, g_even, g_odd } = space;
    let Prepared { theta, n, slope, drive, tau, gap, squarings, middle, half, unit, scale, inverse_time, .. } =
        *prepared;
    let count = rule.x.len().min(MAX_HALF);
    let mut mean = Vector::splat(0.0);
    for j in 0..count {
        let none = [Vector::splat(0.0); 2];
        let (mut v, mut g, mut below, mut weight) = (none, none, none, none);
        let places = v.iter_mut().zip(&mut g).zip(&mut below).zip(&mut weight);
        for ((((v, g), below), weight), x) in places.zip([rule.x[j], -rule.x[j]]) {
            let s = middle + x * half;
            let (mut power, mut jacobian) = if SQUARES { (s * s, s) } else { (s, unit) };
            for level in 0..if SQUARES { 0 } else { MAX_SQUARINGS } {
                let more = squarings - Vector::splat(f64::from(level) + 0.5);
                (power, jacobian) = (choose(more, power * power, power), choose(more, power * jacobian, jacobian));
            }
            let eta = gap - power;
            let theta = theta[0] + eta * (theta[1] + eta * (theta[2] + eta * theta[3]));
            let n = n[0] + eta * (n[1] + eta * n[2]);
            let slope = slope[0] + eta * slope[1];
            // Division by `theta n`: one division for two nodes.
            [*v, *g, *below] = P::node(theta, n, slope, inverse_time);
            *weight = jacobian;
        }
        let inverse = 1.0 / (below[0] * below[1]);
        let factors = [weight[0] * (below[1] * inverse), weight[1] * (below[0] * inverse)];
        for ((v, g), factor) in v.iter_mut().zip(&mut g).zip(factors) {
            (*v, *g) = (*v * factor, *g * factor);
        }
        (v_even[j], v_odd[j]) = (v[0] + v[1], v[0] - v[1]);
        (g_even[j], g_odd[j]) = (g[0] + g[1], g[0] - g[1]);
        mean = mean + rule.w[j] * v_even[j];
    }
    // The matrix is padded with zero rows.
    let padded = count.next_multiple_of(ROWS);
    v_odd[count..padded].fill(Vector::splat(0.0));
    g_odd[count..padded].fill(Vector::splat(0.0));
    let mut sum = Vector::splat(0.0);
    let pairs = v_odd.chunks_exact(ROWS).zip(g_odd.chunks_exact(ROWS));
    for (rows, (v, g)) in rule.matrix.chunks_exact(ROWS * count).zip(pairs) {
        let (one, two) = rows.split_at(count);
        let (mut y, mut z) = ([Vector::splat(0.0); ROWS], [Vector::splat(0.0); ROWS]);
        for j in 0..count {
            for (r, row) in [one, two].into_iter().enumerate() {
                y[r] = y[r] + row[j] * g_even[j];
                z[r] = z[r] + row[j] * v_even[j];
            }
        }
        for r in 0..ROWS {
            sum = sum + (g[r] * z[r] - v[r] * y[r]);
        }
    }
    (scale * (tau * mean + scale * (drive * sum))).0
}
