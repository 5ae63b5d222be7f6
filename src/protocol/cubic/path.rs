//! One cubic shortcut: its two polynomials, whether it is feasible, and its least velocity.
//!
//! In `x = t/t_f`: `theta = theta_0 + A_2 x + A_3 x^2 + A_4 x^3` and `n = t_f (1 - theta') = t_f - dtheta/dx`, so `v =
//! n/(t_f theta)`.

use multiversion::multiversion;

use crate::numerics::cubic::{Cubic, ExactCubic};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::lanes::{LANES, Lanes};
use crate::protocol::Status;

/// The ends that all shortcuts of a landscape share.
#[derive(Debug, Clone, Copy)]
pub(in crate::protocol) struct Ends {
    pub theta_0: DoubleDouble,
    pub theta_1: DoubleDouble,
    /// `theta_1 - theta_0`.
    pub rise: DoubleDouble,
    pub t_f: f64,
    /// Largest share of a velocity that rounding may cost.
    v_loss: f64,
}

impl Ends {
    /// Between the steady states at `v_i` and `v_f`; velocities are to be good to `v_loss` (relative).
    pub fn between(v_i: f64, v_f: f64, t_f: f64, v_loss: f64) -> Ends {
        let one = DoubleDouble::new(1.0);
        let (theta_0, theta_1) = (one / DoubleDouble::new(v_i), one / DoubleDouble::new(v_f));
        Ends { theta_0, theta_1, rise: theta_1 - theta_0, t_f, v_loss }
    }
}

/// One shortcut.
#[derive(Debug, Clone, Copy)]
pub(in crate::protocol) struct Path<'a> {
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

    /// `theta` in powers of `x`.
    pub fn theta(&self) -> &Cubic {
        &self.theta
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
    fn exact_status(&self) -> Status {
        let surplus = self.surplus(self.ends.t_f);
        if !self.exact_n().is_positive(&self.n, true) || !self.exact_theta().is_positive(&self.theta, true) {
            Status::Infeasible
        } else if self.exact_surplus().is_positive(&surplus, false) {
            Status::Ok
        } else {
            Status::BelowBound
        }
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

    /// The coefficients of theta and of n in powers of `x`.
    #[inline(always)]
    pub fn about_start(&self) -> ([f64; 4], [f64; 3]) {
        let [n0, n1, n2, _] = self.n.c;
        (self.theta.c, [n0, n1, n2])
    }

    /// The coefficients of theta and of n in powers of `x - centre`, each right to the last bit.
    pub fn about(&self, centre: f64) -> ([f64; 4], [f64; 3]) {
        let [n0, n1, n2, _] = self.exact_n().about(centre);
        (self.exact_theta().about(centre), [n0, n1, n2])
    }

    /// `theta` and `n` at `x`, each right to the last bit.
    pub fn at(&self, x: f64) -> (f64, f64) {
        (self.exact_theta().at(x).high, self.exact_n().at(x).high)
    }

    /// Status decided in double-double, and least velocity.
    pub fn judge(&self) -> (Status, f64) {
        let (_, place, _) = least_velocities(self.ends, &[self.a_2; LANES], &[self.a_3; LANES]);
        (self.exact_status(), self.exact_velocity(place[0]))
    }

    /// Velocity at both ends: the lesser, and where it is found.
    #[inline(always)]
    fn v_ends(&self) -> (f64, f64) {
        let (theta_end, n_end) = self.about_end();
        let (start, end) = (self.n.c[0] / self.theta.c[0], n_end[0] / theta_end[0]);
        let first = start < end;
        ((if first { start } else { end }) / self.ends.t_f, if first { 0.0 } else { 1.0 })
    }

    /// The least velocity, found near `x`, from 32 digits: for where `n` or theta is so small that rounding shows.
    ///
    /// In double the velocity is flat within rounding, so the place is known to half the digits only. Dinkelbach's
    /// step takes it from the stationary point of a cubic instead, which is good to all of them.
    fn exact_velocity(&self, x: f64) -> f64 {
        let t_f = DoubleDouble::new(self.ends.t_f);
        let at = |x: f64| (self.exact_n().at(x) / (t_f * self.exact_theta().at(x))).high;
        let mut v = at(x);
        for _ in 0..MOST_STEPS {
            let lower = at(self.surplus(v * self.ends.t_f).minimum());
            if lower.is_nan() || lower >= v {
                break;
            }
            v = lower;
        }
        v
    }
}

/// Whether rounding may cost the value of a cubic at `x` a share `loss` of it (or it is not a number).
#[inline(always)]
fn is_faint(cubic: &Cubic, x: f64, loss: f64) -> bool {
    let [c0, c1, c2, c3] = cubic.c;
    let sound = loss * cubic.at(x) > 4.0 * f64::EPSILON * (c0.abs() + c1.abs() + c2.abs() + c3.abs());
    !sound
}

/// Sign of the least value of a polynomial: -1, +1, or 0 where rounding leaves doubt.
#[inline(always)]
fn sign(cubic: &Cubic) -> f64 {
    let (least, doubt) = cubic.least();
    if least > doubt {
        1.0
    } else if least < -doubt {
        -1.0
    } else {
        0.0
    }
}

/// Status and, where asked for, least velocity on `[0, t_f]` of eight shortcuts.
///
/// Feasibility follows from the stationary minima of theta, of `n` and of `n - t_f theta`; the few that rounding leaves
/// in doubt are decided in double-double.
pub(super) fn screen(ends: &Ends, a_2: &Lanes, a_3: &Lanes, v_min: Option<&mut Lanes>) -> [Status; LANES] {
    let signs = signs(ends, a_2, a_3);
    let mut status = [Status::Infeasible; LANES];
    for i in 0..LANES {
        let [n, theta, surplus] = [signs[0][i], signs[1][i], signs[2][i]];
        let tame = a_2[i].abs() + a_3[i].abs() < WILD;
        status[i] = if n < 0.0 || theta < 0.0 || !tame {
            Status::Infeasible
        } else if n * theta * surplus == 0.0 {
            Path::new(ends, a_2[i], a_3[i]).exact_status()
        } else if surplus > 0.0 {
            Status::Ok
        } else {
            Status::BelowBound
        };
    }
    if let Some(v_min) = v_min
        && status.iter().any(|&s| s != Status::Infeasible)
    {
        let (rounded, place, faint) = least_velocities(ends, a_2, a_3);
        *v_min = rounded;
        for i in (0..LANES).filter(|&i| faint[i] > 0.0 && status[i] != Status::Infeasible) {
            v_min[i] = Path::new(ends, a_2[i], a_3[i]).exact_velocity(place[i]);
        }
    }
    status
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn signs(ends: &Ends, a_2: &Lanes, a_3: &Lanes) -> [Lanes; 3] {
    let mut signs = [[0.0; LANES]; 3];
    for i in 0..LANES {
        let path = Path::new(ends, a_2[i], a_3[i]);
        signs[0][i] = sign(&path.n);
        signs[1][i] = sign(&path.theta);
        signs[2][i] = sign(&path.surplus(ends.t_f));
    }
    signs
}

/// `v = n/(t_f theta) >= m` where the cubic `n - m t_f theta` is not negative. The minimum of that cubic gives the
/// next, lower `m`: Dinkelbach's method (Management Science 13, 492, 1967), which falls to the least ratio and doubles
/// its digits with each step. Returns the least velocities, their places, and 1 where rounding shows; infeasible lanes
/// hold no meaning.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn least_velocities(ends: &Ends, a_2: &Lanes, a_3: &Lanes) -> (Lanes, Lanes, Lanes) {
    let (mut v_min, mut place) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        (v_min[i], place[i]) = Path::new(ends, a_2[i], a_3[i]).v_ends();
    }
    for _ in 0..MOST_STEPS {
        let before = v_min;
        for i in 0..LANES {
            let path = Path::new(ends, a_2[i], a_3[i]);
            let x = path.surplus(v_min[i] * ends.t_f).minimum();
            let v = path.n.at(x) / (ends.t_f * path.theta.at(x));
            let lower = v < v_min[i] && v > 0.0;
            v_min[i] = if lower { v } else { v_min[i] };
            place[i] = if lower { x } else { place[i] };
        }
        if v_min == before {
            break;
        }
    }
    let mut faint = [0.0; LANES];
    for i in 0..LANES {
        let path = Path::new(ends, a_2[i], a_3[i]);
        let lost = is_faint(&path.n, place[i], ends.v_loss) | is_faint(&path.theta, place[i], ends.v_loss);
        faint[i] = if lost { 1.0 } else { 0.0 };
    }
    (v_min, place, faint)
}

/// Coordinates of this size are not feasible for any time that is meant: the quadratic `n >= 0` has the mean `t_f -
/// rise`, so its ends are at most nine times that. Their squares do not overflow below it.
const WILD: f64 = 1e100;

/// More steps than the doubling of digits can use.
const MOST_STEPS: u32 = 60;
