//! One cubic shortcut: its two polynomials, whether it is feasible, and its least velocity.
//!
//! In `x = t/t_f`: `theta = theta_0 + A_2 x + A_3 x^2 + A_4 x^3` and `n = t_f (1 - theta') = t_f - dtheta/dx`, so `v = n/(t_f theta)`.

use crate::numerics::cubic::{Cubic, ExactCubic};
use crate::numerics::double_double::DoubleDouble;
use crate::protocol::Status;

/// The ends that all shortcuts of a landscape share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ends {
    pub theta_0: DoubleDouble,
    pub theta_1: DoubleDouble,
    /// `theta_1 - theta_0`.
    pub rise: DoubleDouble,
    pub t_f: f64,
}

impl Ends {
    /// Between the steady states at `v_i` and `v_f`.
    pub fn between(v_i: f64, v_f: f64, t_f: f64) -> Ends {
        let one = DoubleDouble::new(1.0);
        let (theta_0, theta_1) = (one / DoubleDouble::new(v_i), one / DoubleDouble::new(v_f));
        Ends { theta_0, theta_1, rise: theta_1 - theta_0, t_f }
    }
}

/// One shortcut.
#[derive(Debug, Clone, Copy)]
pub(super) struct Path<'a> {
    pub ends: &'a Ends,
    a_2: f64,
    a_3: f64,
    /// `theta` in powers of `x`.
    theta: Cubic,
    /// `n` in powers of `x`.
    n: Cubic,
}

impl<'a> Path<'a> {
    /// The shortcut with `alpha_2 t_f = a_2`, `alpha_3 t_f^2 = a_3`.
    #[inline(always)]
    pub fn new(ends: &'a Ends, a_2: f64, a_3: f64) -> Path<'a> {
        let a_4 = ends.rise.high - a_2 - a_3;
        Path {
            ends,
            a_2,
            a_3,
            theta: Cubic { c: [ends.theta_0.high, a_2, a_3, a_4] },
            n: Cubic { c: [ends.t_f - a_2, -2.0 * a_3, -3.0 * a_4, 0.0] },
        }
    }

    /// `theta(x)` to 32 digits.
    fn exact_theta(&self) -> ExactCubic {
        let (a_2, a_3) = (DoubleDouble::new(self.a_2), DoubleDouble::new(self.a_3));
        ExactCubic { c: [self.ends.theta_0, a_2, a_3, self.ends.rise - a_2 - a_3] }
    }

    /// `n(x)` to 32 digits.
    fn exact_n(&self) -> ExactCubic {
        let [_, a_2, a_3, a_4] = self.exact_theta().c;
        let (two, three) = (DoubleDouble::new(-2.0), DoubleDouble::new(-3.0));
        ExactCubic { c: [DoubleDouble::new(self.ends.t_f) - a_2, two * a_3, three * a_4, DoubleDouble::new(0.0)] }
    }

    /// `n - t_f theta`, at least 0 where `v >= 1`, to 32 digits.
    fn exact_surplus(&self) -> ExactCubic {
        let t_f = DoubleDouble::new(self.ends.t_f);
        let mut surplus = self.exact_n();
        for (s, theta) in surplus.c.iter_mut().zip(self.exact_theta().c) {
            *s = *s - t_f * theta;
        }
        surplus
    }

    /// `Infeasible` where theta or v falls to 0 or below, `BelowBound` where only `v >= 1` fails, else `Ok`; decided exactly.
    #[inline(always)]
    pub fn status(&self) -> Status {
        if !self.n.is_positive(true, || self.exact_n()) || !self.theta.is_positive(true, || self.exact_theta()) {
            return Status::Infeasible;
        }
        let mut surplus = self.n;
        for (s, theta) in surplus.c.iter_mut().zip(self.theta.c) {
            *s -= self.ends.t_f * theta;
        }
        if surplus.is_positive(false, || self.exact_surplus()) { Status::Ok } else { Status::BelowBound }
    }

    /// The coefficients of theta and of n in powers of `x - 1`.
    #[inline(always)]
    pub fn about_end(&self) -> ([f64; 4], [f64; 3]) {
        let (a_2, a_3, rise) = (self.a_2, self.a_3, self.ends.rise.high);
        let slope = 3.0 * rise - 2.0 * a_2 - a_3;
        let bend = 3.0 * rise - 3.0 * a_2 - 2.0 * a_3;
        let a_4 = rise - a_2 - a_3;
        ([self.ends.theta_1.high, slope, bend, a_4], [self.ends.t_f - slope, -2.0 * bend, -3.0 * a_4])
    }

    /// The coefficients of theta and of n in powers of `x - centre`, each right to the last bit.
    pub fn about(&self, centre: f64) -> ([f64; 4], [f64; 3]) {
        let [n0, n1, n2, _] = self.exact_n().about(centre);
        (self.exact_theta().about(centre), [n0, n1, n2])
    }

    /// Least velocity of a feasible shortcut on `[0, t_f]`.
    ///
    /// `v'` has the sign of the quartic `f = theta_x^2 - t_f theta_x - theta theta_xx`; a minimum inside is a zero where `f` rises.
    pub fn v_min(&self) -> f64 {
        let [q0, q1, q2, q3] = self.theta.c;
        let t_f = self.ends.t_f;
        let quartic = [
            q1 * q1 - t_f * q1 - 2.0 * q0 * q2,
            2.0 * (q1 * q2 - t_f * q2 - 3.0 * q0 * q3),
            2.0 * q2 * q2 - 3.0 * t_f * q3,
            4.0 * q2 * q3,
            3.0 * q3 * q3,
        ];
        let v = |x: f64| self.n.at(x) / (t_f * self.theta.at(x));
        let (theta_end, n_end) = self.about_end();
        let at_end = n_end[0] / (t_f * theta_end[0]);
        let ends = v(0.0).min(at_end);
        let [r0, r1, r2, r3, r4] = quartic;
        // Bernstein coefficients on [0, 1]: where they have one sign, v is monotone.
        let bernstein = [
            r0,
            r0 + r1 / 4.0,
            r0 + r1 / 2.0 + r2 / 6.0,
            r0 + 3.0 * r1 / 4.0 + r2 / 2.0 + r3 / 4.0,
            r0 + r1 + r2 + r3 + r4,
        ];
        let mut least = ends;
        rising_zeros(bernstein, 0.0, 1.0, &mut |x| {
            let inside = v(x);
            if inside < least {
                least = inside;
            }
        });
        least
    }
}

/// Visits a point within 2^-26 of each zero of a quartic where it rises from below to above 0 on `[from, to]`, from its Bernstein coefficients: by bisection
/// (de Casteljau) until the sign changes at most once, then further. A stationary value needs only the square root of its precision.
fn rising_zeros(b: [f64; 5], from: f64, to: f64, visit: &mut impl FnMut(f64)) {
    let below = b.iter().any(|&b| b < 0.0);
    let above = b.iter().any(|&b| b > 0.0);
    if !(below && above) {
        return;
    }
    let middle = 0.5 * (from + to);
    let changes = b.windows(2).filter(|w| (w[0] < 0.0) != (w[1] < 0.0)).count();
    if changes == 1 {
        if b[0] < 0.0 {
            visit(refine(b, from, to));
        }
        return;
    }
    if to - from < 1.5e-8 {
        visit(middle);
        return;
    }
    let (left, right) = halve(b);
    rising_zeros(left, from, middle, visit);
    rising_zeros(right, middle, to, visit);
}

/// De Casteljau's subdivision in the middle.
fn halve(mut b: [f64; 5]) -> ([f64; 5], [f64; 5]) {
    let mut left = [b[0]; 5];
    for level in 1..5 {
        for i in 0..5 - level {
            b[i] = 0.5 * (b[i] + b[i + 1]);
        }
        left[level] = b[0];
    }
    // b now holds the right half in its own order.
    (left, b)
}

/// The single rising zero of a quartic on `[from, to]`: regula falsi with Illinois weights on the Bernstein form.
fn refine(b: [f64; 5], from: f64, to: f64) -> f64 {
    let value = |s: f64| {
        let mut b = b;
        for level in 1..5 {
            for i in 0..5 - level {
                b[i] += s * (b[i + 1] - b[i]);
            }
        }
        b[0]
    };
    let (mut low, mut high) = (0.0, 1.0);
    let (mut f_low, mut f_high) = (b[0], b[4]);
    let mut last = 0.0;
    for _ in 0..60 {
        let s = low - f_low * (high - low) / (f_high - f_low);
        let f = value(s);
        if f < 0.0 {
            f_high *= if last < 0.0 { 0.5 } else { 1.0 };
            (low, f_low) = (s, f);
        } else {
            f_low *= if last > 0.0 { 0.5 } else { 1.0 };
            (high, f_high) = (s, f);
        }
        if f.abs() <= 1e-9 * (b[4] - b[0]) || high - low < 1e-9 {
            return from + (to - from) * s;
        }
        last = f;
    }
    from + (to - from) * 0.5 * (low + high)
}
