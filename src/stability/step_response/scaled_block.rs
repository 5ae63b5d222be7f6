//! The block on its spring, in the scaled variables of one final velocity.
//!
//! Lengths in `l`, times in `l/v_f`. With `x = ln(v/v_f)`, `y = ln(theta v_f/l)`, `z = k s - tau_ss(v_f)` and `M = m
//! v_f^2`, the equations under `v_c = v_f` are
//!
//! ```text
//! z' = k (1 - e^x),    y' = e^-y G(e^q),    M e^x x' = z - a x - b y,    q = x + y,
//! ```
//!
//! with steady sliding at 0. The evolution law of the state enters `y'` alone: `e^-y - e^x` for ageing, `-e^x q` for slip,
//! and `(e^-y - e^(x + q))/2` for the law of Perrin, Rice and Zheng. The equations are regular for `M = 0`, where the last
//! is a constraint, and at every velocity.

use super::envelope::MIN_STEP_ERROR;
use crate::model::StateLaw;
use crate::numerics::elementary::{exp, exp_and_m1, ln};
use crate::numerics::stiff::{Linearised, Points, System};

/// Index of the scaled force in a [`State`].
pub const Z: usize = 0;
/// Index of the logarithm of the contact lifetime.
pub const Y: usize = 1;
/// Index of the logarithm of the velocity.
pub const X: usize = 2;

/// State `[z, y, x]`, in the order of elimination.
pub type State = [f64; 3];

/// Point of the section `v = v_f`, crossed upwards: the logarithm of the force about which the block oscillates, and `y`.
pub type SectionPoint = [f64; 2];

/// The block on its spring: the evolution law of the state and the four parameters of the scaled equations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaledBlock {
    /// Evolution law of the state.
    pub state_law: StateLaw,
    /// Direct effect `a > 0`.
    pub a: f64,
    /// Evolution effect `b >= 0`.
    pub b: f64,
    /// Scaled mass `M = m v_f^2 >= 0`.
    pub inertia: f64,
    /// Stiffness `k > 0`, finite.
    pub k: f64,
}

impl ScaledBlock {
    /// State of steady sliding at `e^x v_f`.
    pub fn steady(&self, x: f64) -> State {
        [(self.a - self.b) * x, -x, x]
    }

    /// Whether `k = b - a` exactly.
    pub fn is_critical(&self) -> bool {
        self.k == self.b - self.a && self.b - self.k == self.a
    }

    /// State at a point of the section `v = v_f`.
    pub fn state(&self, [w, y]: SectionPoint) -> State {
        let pull = exp(w);
        if self.inertia > 0.0 { [pull + self.theta_coefficient() * y, y, 0.0] } else { [pull, pull / self.b, 0.0] }
    }

    /// Section point of a state with `v = v_f`; NaN for a state that is rounding at rest.
    pub fn section_point(&self, &[z, y, _]: &State) -> SectionPoint {
        let pull = z - self.theta_coefficient() * y;
        [if pull > 0.0 { ln(pull) } else { f64::NAN }, y]
    }

    /// Coefficient of `ln theta` in the force about which the block oscillates: `b` for oscillations faster than ageing.
    fn theta_coefficient(&self) -> f64 {
        let is_fast = self.k * self.inertia > self.a * self.a && self.k > self.inertia;
        if is_fast { self.b } else { 0.0 }
    }

    /// State after an instantaneous arrest; `None` if there is none.
    ///
    /// Where the spring holds the block back, the velocity falls faster than exponentially to the balance of friction and
    /// spring force, `a x = z - b y`, which may be thousands of decades below. This takes at most `M e^x/(a x + b y - z)`.
    /// The arrest is instantaneous once no other variable changes by more than `MIN_STEP_ERROR` in this time.
    pub fn arrest(&self, &[z, y, x]: &State) -> Option<State> {
        let resting = (z - self.b * y) / self.a;
        let pull = self.a * (x - resting);
        let time = self.inertia * exp(x) / pull;
        let rate = self.k / self.force() + exp(-y) + self.slip_rate(y, x);
        (x > resting + 1.0 && time * rate < MIN_STEP_ERROR).then_some([z, y, resting])
    }

    /// First step, in which the state changes little.
    pub fn first_step(&self, &[_, y, x]: &State) -> f64 {
        let v = exp(x);
        1e-3 / (self.k * (1.0 - v).abs() / self.a + self.slip_rate(y, x) + exp(-y))
    }

    /// Bound of the rate of `y` by slip; that by healing is at most `e^-y`.
    fn slip_rate(&self, y: f64, x: f64) -> f64 {
        match self.state_law {
            StateLaw::Ageing => exp(x),
            StateLaw::Slip => exp(x) * (1.0 + (x + y).abs()),
            StateLaw::Prz => exp(x) * (1.0 + exp(x + y)),
        }
    }

    /// Whether a block without mass has certainly begun to diverge: `a q' = k (1 - v) - k_c v G(u)/u` with `u = e^q` per unit of slip is
    /// positive, and stays so.
    ///
    /// With ageing this takes `k < k_c`, where every step diverges.
    pub fn diverges(&self, &[_, y, x]: &State) -> bool {
        let critical = self.b - self.a;
        if self.inertia > 0.0 || critical <= 0.0 {
            return false;
        }
        let q = x + y;
        match self.state_law {
            StateLaw::Ageing => false,
            StateLaw::Slip => q >= self.k / critical,
            StateLaw::Prz => 0.5 * (exp(q) - exp(-q)) >= self.k / critical,
        }
    }

    /// Scale of the force: the change that changes `ln v` by 1 at rest, or more where inertia dominates.
    pub fn force(&self) -> f64 {
        (self.a * self.a.max((self.k * self.inertia).sqrt())).sqrt()
    }

    /// Upper bound of the rate of the fastest motion: damping by friction, oscillation on the spring, and relaxation of the
    /// state.
    pub fn fast(&self, rates: &Rates) -> f64 {
        let (damping, swinging) = (self.a / (self.inertia * rates.v), (self.k / self.inertia).sqrt());
        damping.max(swinging) + rates.relaxation
    }
}

/// Terms of the equations at a state, with full relative accuracy near steady sliding, where they vanish.
#[derive(Debug, Clone, Copy)]
pub struct Rates {
    /// Velocity `v = e^x`.
    pub v: f64,
    /// Excess velocity `v - 1`.
    pub excess: f64,
    /// Slope `y'`.
    pub growth: f64,
    /// Relaxation `-dy'/dy` of the state at fixed velocity.
    pub relaxation: f64,
    /// Derivative `dy'/dx`.
    pub by_x: f64,
}

impl Rates {
    /// Rates at `y` and `x` under a law.
    #[inline(always)]
    pub fn of(state_law: StateLaw, y: f64, x: f64) -> Rates {
        let (v, excess) = exp_and_m1(x);
        let q = x + y;
        match state_law {
            StateLaw::Ageing => {
                let (ageing, surplus) = exp_and_m1(-y);
                // Far from 1 the difference with 1 would lose digits.
                let near = excess.abs() < 0.5 && surplus.abs() < 0.5;
                let growth = if near { surplus - excess } else { ageing - v };
                Rates { v, excess, growth, relaxation: ageing, by_x: -v }
            }
            StateLaw::Slip => Rates { v, excess, growth: -v * q, relaxation: v, by_x: -v * (1.0 + q) },
            StateLaw::Prz => {
                let healing = exp(-y);
                let (square, surplus) = exp_and_m1(2.0 * q);
                let relaxation = 0.5 * healing * (1.0 + square);
                Rates { v, excess, growth: -0.5 * healing * surplus, relaxation, by_x: -healing * square }
            }
        }
    }
}

impl System<3> for ScaledBlock {
    #[inline(always)]
    fn linearise<const L: usize>(&self, points: &Points<3, L>) -> Linearised<3, L> {
        match self.state_law {
            StateLaw::Ageing => self.linearise_by::<L, 0>(points),
            StateLaw::Slip => self.linearise_by::<L, 1>(points),
            StateLaw::Prz => self.linearise_by::<L, 2>(points),
        }
    }
}

impl ScaledBlock {
    /// The system under the law `StateLaw::ALL[LAW]`.
    #[inline(always)]
    fn linearise_by<const L: usize, const LAW: usize>(&self, points: &Points<3, L>) -> Linearised<3, L> {
        let mut at = Linearised { residual: [[0.0; L]; 3], mass: [[1.0; L]; 3], jacobian: [[[0.0; L]; 3]; 3] };
        let [z, y, x] = &points.y;
        let [z_slope, y_slope, x_slope] = &points.slope;
        for i in 0..L {
            let Rates { v, excess, growth, relaxation, by_x } = Rates::of(StateLaw::ALL[LAW], y[i], x[i]);
            let mass = self.inertia * v;
            at.mass[X][i] = mass;
            at.residual[Z][i] = -self.k * excess - z_slope[i];
            at.residual[Y][i] = growth - y_slope[i];
            at.residual[X][i] = (z[i] - self.a * x[i] - self.b * y[i]) - mass * x_slope[i];
            at.jacobian[Z][X][i] = -self.k * v;
            at.jacobian[Y][Y][i] = -relaxation;
            at.jacobian[Y][X][i] = by_x;
            at.jacobian[X][Z][i] = 1.0;
            at.jacobian[X][Y][i] = -self.b;
            at.jacobian[X][X][i] = -self.a - mass * x_slope[i];
        }
        at
    }
}
