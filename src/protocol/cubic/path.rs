//! A cubic shortcut: its two polynomials, its feasibility and its least velocity.
//!
//! In `x = t/t_f`: `theta = theta_0 + A_2 x + A_3 x^2 + A_4 x^3` and `n = t_f (1 - theta') = t_f - dtheta/dx`, so `v =
//! n/(t_f theta)`.

use super::rules::NodeThresholds;
use crate::model::StateLaw;
use crate::numerics::MAX_STEPS;
use crate::numerics::cubic::{Cubic, ExactCubic, exact_quadratic_zeros};
use crate::numerics::double_double::DoubleDouble;
use crate::protocol::Status;

/// The ends common to all shortcuts of a landscape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::protocol) struct Ends {
    pub theta_0: DoubleDouble,
    pub theta_1: DoubleDouble,
    /// `theta_1 - theta_0`.
    pub rise: DoubleDouble,
    /// The duration times the fastest rise of theta; with ageing, the duration.
    pub t_f: f64,
    /// The low word of `t_f`.
    pub t_low: f64,
    /// Greatest relative error of a velocity by rounding.
    pub v_loss: f64,
}

impl Ends {
    /// The ends of shortcuts between the steady states at `v_i` and `v_f` under an evolution law of the state; velocities need a relative accuracy of
    /// `v_loss`. In the time `c t_f`, with the fastest rise `c`, an ageing path has the theta of a path under the law, and `n = c t_f (1 - theta'/c)`:
    /// feasible sets and zeros are the same.
    pub fn under(state: StateLaw, v_i: f64, v_f: f64, t_f: f64, v_loss: f64) -> Ends {
        let one = DoubleDouble::new(1.0);
        let (theta_0, theta_1) = (one / DoubleDouble::new(v_i), one / DoubleDouble::new(v_f));
        let scaled = DoubleDouble::new(t_f) * state.fastest_rise();
        Ends { theta_0, theta_1, rise: rise(v_i, v_f), t_f: scaled.high, t_low: scaled.low, v_loss }
    }
}

/// `1/v_f - 1/v_i`, without the cancellation of nearly equal inverses.
pub(in crate::protocol) fn rise(v_i: f64, v_f: f64) -> DoubleDouble {
    DoubleDouble::sum(v_i, -v_f) / DoubleDouble::product(v_i, v_f)
}

/// A shortcut.
#[derive(Debug, Clone, Copy)]
pub(in crate::protocol) struct Path<'a> {
    pub ends: &'a Ends,
    /// The low words of the coefficients of `x` and `x^2`.
    low: [f64; 2],
    /// `theta` in powers of `x`.
    pub theta: Cubic,
    /// `n` in powers of `x`.
    pub n: Cubic,
}

impl<'a> Path<'a> {
    /// The shortcut with `alpha_2 t_f = a_2`, `alpha_3 t_f^2 = a_3`.
    #[inline(always)]
    pub fn new(ends: &'a Ends, a_2: f64, a_3: f64) -> Path<'a> {
        let a_4 = ends.rise.high - a_2 - a_3;
        Path {
            ends,
            low: [0.0; 2],
            theta: Cubic { c: [ends.theta_0.high, a_2, a_3, a_4] },
            n: Cubic { c: [ends.t_f - a_2, -2.0 * a_3, -3.0 * a_4, 0.0] },
        }
    }

    /// The shortcut with coefficients of 32 digits, which the expansions `about` a point and the `exact` methods use.
    pub fn exact(ends: &'a Ends, a_2: DoubleDouble, a_3: DoubleDouble) -> Path<'a> {
        let mut path = Path { low: [a_2.low, a_3.low], ..Path::new(ends, a_2.high, a_3.high) };
        (path.theta.c, path.n.c) = (path.exact_theta().c.map(|c| c.high), path.exact_n().c.map(|c| c.high));
        path
    }

    /// The rounding error of `A_4`, a small difference if `A_2 + A_3` is close to the rise.
    #[inline(always)]
    pub fn slack(&self) -> f64 {
        let [_, a_2, a_3, _] = self.theta.c;
        f64::EPSILON * (self.ends.rise.high.abs() + a_2.abs() + a_3.abs())
    }

    /// `theta(x)` to 32 digits.
    pub fn exact_theta(&self) -> ExactCubic {
        let [_, a_2, a_3, _] = self.theta.c;
        let (a_2, a_3) = (DoubleDouble::sum(a_2, self.low[0]), DoubleDouble::sum(a_3, self.low[1]));
        ExactCubic { c: [self.ends.theta_0, a_2, a_3, self.ends.rise - a_2 - a_3] }
    }

    /// `n(x)` to 32 digits.
    pub fn exact_n(&self) -> ExactCubic {
        let [_, a_2, a_3, a_4] = self.exact_theta().c;
        let (two, three) = (DoubleDouble::new(-2.0), DoubleDouble::new(-3.0));
        ExactCubic {
            c: [
                DoubleDouble::sum(self.ends.t_f, self.ends.t_low) - a_2,
                two * a_3,
                three * a_4,
                DoubleDouble::new(0.0),
            ],
        }
    }

    /// The zeros of `n`, in the form of [`ExactCubic::zeros`].
    pub(super) fn zeros_of_n(&self) -> [(DoubleDouble, f64); 2] {
        let [n0, n1, n2, _] = self.exact_n().c;
        exact_quadratic_zeros([n0, n1, n2])
    }

    /// `n - v t_f theta`, at least 0 where the velocity is at least `v`, to 32 digits.
    pub fn exact_surplus(&self, v: f64) -> ExactCubic {
        let scale = DoubleDouble::product(v, self.ends.t_f);
        let mut surplus = self.exact_n();
        for (s, theta) in surplus.c.iter_mut().zip(self.exact_theta().c) {
            *s = *s - scale * theta;
        }
        surplus
    }

    /// `n - scale theta`: at least 0 where `v >= scale/t_f`.
    #[inline(always)]
    pub fn surplus(&self, scale: f64) -> Cubic {
        let mut surplus = self.n;
        for (s, theta) in surplus.c.iter_mut().zip(self.theta.c) {
            *s -= scale * theta;
        }
        surplus
    }

    /// `Infeasible` where theta or v falls to 0 or below, `BelowBound` where only `v >= 1` fails, else `Ok`; decided in
    /// double-double.
    pub fn exact_status(&self) -> Status {
        if !self.exact_n().is_positive(true) || !self.exact_theta().is_positive(true) {
            Status::Infeasible
        } else if self.exact_surplus(1.0).is_positive(false) {
            Status::Ok
        } else {
            Status::BelowBound
        }
    }

    /// The coefficients of theta and of n in powers of `x - 1`.
    #[inline(always)]
    pub fn about_end(&self) -> ([f64; 4], [f64; 3]) {
        let ([_, a_2, a_3, _], rise) = (self.theta.c, self.ends.rise.high);
        let slope = 3.0 * rise - 2.0 * a_2 - a_3;
        let bend = 3.0 * rise - 3.0 * a_2 - 2.0 * a_3;
        let a_4 = rise - a_2 - a_3;
        ([self.ends.theta_1.high, slope, bend, a_4], [self.ends.t_f - slope, -2.0 * bend, -3.0 * a_4])
    }

    /// The coefficients of theta and of n in powers of `x`.
    #[inline(always)]
    pub fn about_start(&self) -> ([f64; 4], [f64; 3]) {
        let [n0, n1, n2, _] = self.n.c;
        (self.theta.c, [n0, n1, n2])
    }

    /// Whether theta at one end is so small that an expansion about the other end has a relative error above `loss` there.
    #[inline(always)]
    pub fn is_lossy(&self, end: bool, loss: f64) -> bool {
        let [c0, c1, c2, c3] = self.theta.c;
        let size = c0.abs() + c1.abs() + c2.abs() + c3.abs();
        let theta = if end { self.ends.theta_1.high } else { self.ends.theta_0.high };
        size * f64::EPSILON > loss * theta
    }

    /// Whether the expansion about an end of `[0, 1]` keeps enough digits of theta and n at both ends of a panel, at the distances `near` and
    /// `far`.
    #[inline(always)]
    pub(super) fn is_sound(&self, about_end: bool, near: f64, far: f64, accuracy: &NodeThresholds) -> bool {
        let (start, end) = (self.about_start(), self.about_end());
        let mut sound = accuracy.slight > 0.0;
        let [q0, q1, q2, q3]: [f64; 4] = std::array::from_fn(|i| if about_end { end.0[i] } else { start.0[i] });
        let [n0, n1, n2]: [f64; 3] = std::array::from_fn(|i| if about_end { end.1[i] } else { start.1[i] });
        let theta_size = f64::EPSILON * (q0.abs() + q1.abs() + q2.abs() + q3.abs());
        let size = n0.abs() + n1.abs() + n2.abs();
        let n_size = f64::EPSILON * size + 3.0 * self.slack();
        sound &= accuracy.rounding * size >= 3.0 * self.slack();
        for x in [near, far] {
            let theta = q0 + x * (q1 + x * (q2 + x * q3));
            let n = n0 + x * (n1 + x * n2);
            // The values at the centre are exact.
            let fine = (accuracy.rounding * theta >= theta_size) & (accuracy.slight * n >= n_size);
            // An error of ln n at an end affects the whole panel, and the sums multiply theta and n of two nodes.
            let size = theta * n;
            sound &= n >= MIN_END_FRACTION * (n0.abs() + n1.abs() + n2.abs());
            sound &= (fine | (x == 0.0)) & (size > 1e-120) & (size < 1e120);
        }
        sound
    }

    /// The coefficients of theta and of n in powers of `x - centre`, each accurate to the last bit.
    pub fn about(&self, centre: f64) -> ([f64; 4], [f64; 3]) {
        let [n0, n1, n2, _] = self.exact_n().about(centre);
        (self.exact_theta().about(centre), [n0, n1, n2])
    }

    /// The coefficients of `theta - theta_0` in powers of `x - centre`, each accurate to the last bit.
    pub fn change_about(&self, centre: f64) -> [f64; 4] {
        let mut change = self.exact_theta();
        change.c[0] = DoubleDouble::new(0.0);
        change.about(centre)
    }

    /// The coefficients of `n theta_0 - t_f theta` in powers of `x - centre`, each right to the last bit: `t_f theta (v/v_i
    /// - 1)`.
    pub fn above_start_about(&self, centre: f64) -> [f64; 4] {
        let (mut above, theta) = (self.exact_n(), self.exact_theta());
        let t_f = DoubleDouble::new(self.ends.t_f);
        for (c, theta) in above.c.iter_mut().zip(theta.c) {
            *c = *c * self.ends.theta_0 - t_f * theta;
        }
        above.about(centre)
    }

    /// `theta` and `n` at `x`, each accurate to the last bit.
    pub fn at(&self, x: f64) -> (f64, f64) {
        (self.exact_theta().at(x).high, self.exact_n().at(x).high)
    }

    /// Whether `n <= most theta` at `x`; decided in double-double if rounding matters.
    pub fn is_within(&self, x: f64, most: f64) -> bool {
        let rest = self.surplus(most);
        let (value, doubt) = (rest.at(x), rest.doubt() + (3.0 + most) * self.slack());
        if value.abs() > doubt {
            return value < 0.0;
        }
        let (theta, n) = self.at(x);
        n <= most * theta
    }

    /// The velocity at `x`, from coefficients of 32 digits.
    fn velocity(&self, x: f64) -> f64 {
        (self.exact_n().at(x) / (DoubleDouble::new(self.ends.t_f) * self.exact_theta().at(x))).high
    }

    /// The least velocity, from coefficients of 32 digits.
    pub fn least_velocity(&self) -> f64 {
        let place = if self.velocity(1.0) < self.velocity(0.0) { 1.0 } else { 0.0 };
        self.exact_velocity(place)
    }

    /// The lesser velocity of both ends, and its position.
    #[inline(always)]
    pub fn v_ends(&self) -> (f64, f64) {
        let (theta_end, n_end) = self.about_end();
        let (n_start, theta_start) = (self.n.c[0], self.theta.c[0]);
        // Compares ratios without a division.
        let first = n_start * theta_end[0] < n_end[0] * theta_start;
        let (n, theta) = if first { (n_start, theta_start) } else { (n_end[0], theta_end[0]) };
        (n / (self.ends.t_f * theta), if first { 0.0 } else { 1.0 })
    }

    /// The least velocity near `x` with 32 digits, for small `n` or theta, where rounding matters.
    ///
    /// In double precision the velocity is flat within rounding, so its minimum is known to half the digits only. Dinkelbach's step uses the
    /// stationary point of a cubic instead, which has all digits.
    pub fn exact_velocity(&self, x: f64) -> f64 {
        let mut v = self.velocity(x);
        for _ in 0..MAX_STEPS {
            let lower = self.velocity(self.exact_surplus(v).minimum());
            if lower.is_nan() || lower >= v || lower <= 0.0 {
                break;
            }
            v = lower;
        }
        v
    }
}

/// Least n at an end of a panel for sums without logarithms, as a fraction of its coefficients. Measured: below it the rounding of `n'/n` is
/// visible (`tests/solver/stress/landscape.rs`).
const MIN_END_FRACTION: f64 = 1e-4;
