//! The block on its spring, in the scaled variables of one final velocity.
//!
//! Lengths in `l`, times in `l/v_f`. With `x = ln(v/v_f)`, `y = ln(theta v_f/l)`, `z = k s - tau_ss(v_f)` and `M = m
//! v_f^2`, the equations under `v_c = v_f` are
//!
//! ```text
//! z' = k (1 - e^x),    y' = e^-y - e^x,    M e^x x' = z - a x - b y,
//! ```
//!
//! with steady sliding at 0. They stay regular for `M = 0`, where the last one is a constraint, and no velocity is too
//! low for them.

use crate::numerics::elementary::{exp, exp_and_m1, ln};
use crate::numerics::stiff::{Linearised, Points, System};

/// Place of the scaled force in a [`State`].
pub const Z: usize = 0;
/// Place of the logarithm of the contact lifetime.
pub const Y: usize = 1;
/// Place of the logarithm of the velocity.
pub const X: usize = 2;

/// `[z, y, x]`, in the order in which they are eliminated.
pub type State = [f64; 3];

/// A place on the section `v = v_f`, crossed upwards: the logarithm of the force about which the block swings, and `y`.
pub type SectionPoint = [f64; 2];

/// Change of a logarithm, at most, that an arrest of no duration leaves out. Chosen: below the tightest tolerance.
const NEGLIGIBLE: f64 = 1e-14;

/// The four numbers that the response to a step depends on, beside where it starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaledBlock {
    /// Direct effect `a > 0`.
    pub a: f64,
    /// Effect of the contact lifetime `b >= 0`.
    pub b: f64,
    /// Scaled mass `M = m v_f^2 >= 0`.
    pub inertia: f64,
    /// Stiffness `k > 0`, finite.
    pub k: f64,
}

impl ScaledBlock {
    /// Steady sliding at `e^x v_f`, held there until now by the spring.
    pub fn steady(&self, x: f64) -> State {
        [(self.a - self.b) * x, -x, x]
    }

    /// Whether `k = b - a` exactly.
    pub fn is_critical(&self) -> bool {
        self.k == self.b - self.a && self.b - self.k == self.a
    }

    /// The state on the section `v = v_f` at a place.
    pub fn state(&self, [w, y]: SectionPoint) -> State {
        let pull = exp(w);
        if self.inertia > 0.0 { [pull + self.theta_coefficient() * y, y, 0.0] } else { [pull, pull / self.b, 0.0] }
    }

    /// The place of a state on the section; NaN where rounding at rest has led to it.
    pub fn section_point(&self, &[z, y, _]: &State) -> SectionPoint {
        let pull = z - self.theta_coefficient() * y;
        [if pull > 0.0 { ln(pull) } else { f64::NAN }, y]
    }

    /// Share of `ln theta` in the force about which the block swings: `b` where it swings faster than contacts age.
    fn theta_coefficient(&self) -> f64 {
        let swings = self.k * self.inertia > self.a * self.a && self.k > self.inertia;
        if swings { self.b } else { 0.0 }
    }

    /// The state after an arrest that takes no time, if one is under way.
    ///
    /// Where the spring holds the block back, the velocity falls faster than exponentially to where friction carries
    /// the spring's force, `a x = z - b y`, which may be thousands of decades below. It gets there within `M e^x/(a x
    /// + b y - z)`; once nothing else changes by more than `NEGLIGIBLE` in this time, the rest of the way is left out.
    pub fn arrest(&self, &[z, y, x]: &State) -> Option<State> {
        let resting = (z - self.b * y) / self.a;
        let pull = self.a * (x - resting);
        let time = self.inertia * exp(x) / pull;
        let rate = self.k / self.force() + exp(-y) + exp(x);
        (x > resting + 1.0 && time * rate < NEGLIGIBLE).then_some([z, y, resting])
    }

    /// A step so short that little changes in it.
    pub fn first_step(&self, &[_, y, x]: &State) -> f64 {
        let v = exp(x);
        1e-3 / (self.k * (1.0 - v).abs() / self.a + v + exp(-y))
    }

    /// Size of the force that counts: what moves `ln v` by 1 at rest, more where inertia rules.
    pub fn force(&self) -> f64 {
        (self.a * self.a.max((self.k * self.inertia).sqrt())).sqrt()
    }

    /// Rate of the fastest motion that there may be at `v` and `ageing = e^-y`: damping by friction, swinging on the
    /// spring, or ageing.
    pub fn fast(&self, v: f64, ageing: f64) -> f64 {
        let (damping, swinging) = (self.a / (self.inertia * v), (self.k / self.inertia).sqrt());
        damping.max(swinging) + ageing
    }
}

/// What the equations are made of, at a state: relative to their size also near steady sliding, where they vanish.
#[derive(Debug, Clone, Copy)]
pub struct Rates {
    /// `v = e^x`.
    pub v: f64,
    /// `v - 1`.
    pub excess: f64,
    /// `e^-y`.
    pub ageing: f64,
    /// `y' = e^-y - v`.
    pub growth: f64,
}

impl Rates {
    /// At `y` and `x`.
    #[inline(always)]
    pub fn of(y: f64, x: f64) -> Rates {
        let ((v, excess), (ageing, surplus)) = (exp_and_m1(x), exp_and_m1(-y));
        // Far from 1 the difference with 1 would lose digits.
        let near = excess.abs() < 0.5 && surplus.abs() < 0.5;
        Rates { v, excess, ageing, growth: if near { surplus - excess } else { ageing - v } }
    }
}

impl System<3> for ScaledBlock {
    #[inline(always)]
    fn linearise<const L: usize>(&self, points: &Points<3, L>) -> Linearised<3, L> {
        let mut at = Linearised { residual: [[0.0; L]; 3], mass: [[1.0; L]; 3], jacobian: [[[0.0; L]; 3]; 3] };
        let [z, y, x] = &points.y;
        let [z_slope, y_slope, x_slope] = &points.slope;
        for i in 0..L {
            let Rates { v, excess, ageing, growth } = Rates::of(y[i], x[i]);
            let mass = self.inertia * v;
            at.mass[X][i] = mass;
            at.residual[Z][i] = -self.k * excess - z_slope[i];
            at.residual[Y][i] = growth - y_slope[i];
            at.residual[X][i] = (z[i] - self.a * x[i] - self.b * y[i]) - mass * x_slope[i];
            at.jacobian[Z][X][i] = -self.k * v;
            at.jacobian[Y][Y][i] = -ageing;
            at.jacobian[Y][X][i] = -v;
            at.jacobian[X][Z][i] = 1.0;
            at.jacobian[X][Y][i] = -self.b;
            at.jacobian[X][X][i] = -self.a - mass * x_slope[i];
        }
        at
    }
}
