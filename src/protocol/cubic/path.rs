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
    /// `v = n/(t_f theta) >= m` where the cubic `n - m t_f theta` is not negative. The minimum of that cubic gives the next, lower `m`: Dinkelbach's
    /// method (Management Science 13, 492, 1967), which falls to the least ratio and doubles its digits with each step.
    #[inline(always)]
    pub fn v_min(&self) -> f64 {
        let t_f = self.ends.t_f;
        let (theta_end, n_end) = self.about_end();
        let mut least = (self.n.c[0] / (t_f * self.theta.c[0])).min(n_end[0] / (t_f * theta_end[0]));
        for _ in 0..MOST_STEPS {
            let scale = least * t_f;
            let mut surplus = self.n;
            for (s, theta) in surplus.c.iter_mut().zip(self.theta.c) {
                *s -= scale * theta;
            }
            let x = surplus.minimum();
            let v = self.n.at(x) / (t_f * self.theta.at(x));
            if x == 0.0 || v.is_nan() || v >= least {
                break;
            }
            least = v;
        }
        least
    }
}

/// More steps than the doubling of digits can use.
const MOST_STEPS: u32 = 60;
