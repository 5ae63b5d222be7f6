//! One cubic shortcut: its two polynomials, whether it is feasible, and its least velocity.
//!
//! In `x = t/t_f`: `theta = theta_0 + A_2 x + A_3 x^2 + A_4 x^3` and `n = t_f (1 - theta') = t_f - dtheta/dx`, so `v = n/(t_f theta)`.

use crate::numerics::cubic::Cubic;
use crate::numerics::double_double::DoubleDouble;
use crate::protocol::Status;

/// The ends that all shortcuts of a landscape share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ends {
    pub theta_0: DoubleDouble,
    pub theta_1: DoubleDouble,
    pub t_f: f64,
}

/// One shortcut.
#[derive(Debug, Clone, Copy)]
pub(super) struct Path {
    pub t_f: f64,
    /// `theta(x)`.
    pub theta: Cubic,
    /// `n(x)`, a quadratic.
    pub n: Cubic,
}

impl Path {
    /// The shortcut with `alpha_2 t_f = a_2`, `alpha_3 t_f^2 = a_3`.
    pub fn new(ends: &Ends, a_2: f64, a_3: f64) -> Path {
        let (a_2, a_3, t_f) = (DoubleDouble::new(a_2), DoubleDouble::new(a_3), DoubleDouble::new(ends.t_f));
        let a_4 = ends.theta_1 - ends.theta_0 - a_2 - a_3;
        let (two, three) = (DoubleDouble::new(-2.0), DoubleDouble::new(-3.0));
        Path {
            t_f: ends.t_f,
            theta: Cubic { c: [ends.theta_0, a_2, a_3, a_4] },
            n: Cubic { c: [t_f - a_2, two * a_3, three * a_4, DoubleDouble::new(0.0)] },
        }
    }

    /// `Infeasible` where theta or v falls to 0 or below, `BelowBound` where only `v >= 1` fails, else `Ok`; decided exactly.
    pub fn status(&self) -> Status {
        if !(self.n.is_positive(true) && self.theta.is_positive(true)) {
            return Status::Infeasible;
        }
        // v >= 1 where n - t_f theta >= 0.
        let t_f = DoubleDouble::new(self.t_f);
        let mut surplus = self.n;
        for (s, theta) in surplus.c.iter_mut().zip(self.theta.c) {
            *s = *s - t_f * theta;
        }
        if surplus.is_positive(false) { Status::Ok } else { Status::BelowBound }
    }

    /// Least velocity of a feasible shortcut on `[0, t_f]`.
    ///
    /// `v'` has the sign of the quartic `f = theta_x^2 - t_f theta_x - theta theta_xx`; a minimum inside is a zero where `f` rises.
    pub fn v_min(&self) -> f64 {
        let [q0, q1, q2, q3] = self.theta.c.map(|c| c.high);
        let t_f = self.t_f;
        let quartic = [
            q1 * q1 - t_f * q1 - 2.0 * q0 * q2,
            2.0 * (q1 * q2 - t_f * q2 - 3.0 * q0 * q3),
            2.0 * q2 * q2 - 3.0 * t_f * q3,
            4.0 * q2 * q3,
            3.0 * q3 * q3,
        ];
        let v = |x: f64| self.n.at(x) / (t_f * self.theta.at(x));
        let at_end = self.n_at_end() / (t_f * self.theta_at_end());
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

    fn n_at_end(&self) -> f64 {
        self.n.exactly_at(1.0).high
    }

    fn theta_at_end(&self) -> f64 {
        self.theta.exactly_at(1.0).high
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
