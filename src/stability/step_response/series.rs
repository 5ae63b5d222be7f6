//! Taylor series of a response in time.
//!
//! With `v = e^x` and `w = e^-y` the equations of `scaled_block.rs` are
//!
//! ```text
//! z' = k (1 - v),    y' = w - v,    M v' = z - a x - b y,    v' = v x',    w' = -w y',
//! ```
//!
//! which contain products of two series at most, so each coefficient follows from those before it.

use super::scaled_block::{Rates, ScaledBlock, State, X, Y, Z};
use crate::numerics::elementary::{exp, ln};

/// Number of terms: the order of a step.
pub const TERMS: usize = 16;

/// Coefficients of `u, …, u^TERMS` of the changes of `[z, y, x]`.
pub type Powers = [[f64; TERMS]; 3];

impl ScaledBlock {
    /// Series about `state` in powers of the time in units of `unit`, which keeps coefficients in the range of doubles.
    #[inline(always)]
    pub fn series(&self, &[z, y, x]: &State, rates: &Rates, unit: f64) -> Powers {
        let (factor, inverse) = (unit / self.inertia, 1.0 / rates.v);
        let (mut v, mut w) = ([rates.v; TERMS], [rates.ageing; TERMS]);
        // Coefficients of x' and y'.
        let (mut x_slope, mut y_slope) = ([0.0; TERMS], [0.0; TERMS]);
        let mut powers = [[0.0; TERMS]; 3];
        let mut force = z - self.a * x - self.b * y;
        let (mut stretching, mut growth) = (-self.k * rates.excess, rates.growth);
        for n in 0..TERMS {
            let v_slope = factor * force;
            y_slope[n] = unit * growth;
            let (mut known, mut w_slope) = (0.0, w[0] * y_slope[n]);
            for j in 0..n {
                known += x_slope[j] * v[n - j];
                w_slope += y_slope[j] * w[n - j];
            }
            x_slope[n] = (v_slope - known) * inverse;
            let weight = 1.0 / (n + 1) as f64;
            powers[Z][n] = unit * stretching * weight;
            powers[Y][n] = y_slope[n] * weight;
            powers[X][n] = x_slope[n] * weight;
            if n + 1 < TERMS {
                (v[n + 1], w[n + 1]) = (v_slope * weight, -w_slope * weight);
                force = powers[Z][n] - self.a * powers[X][n] - self.b * powers[Y][n];
                (stretching, growth) = (-self.k * v[n + 1], w[n + 1] - v[n + 1]);
            }
        }
        powers
    }
}

/// Time, in the unit of the series, at which its last two terms are `tolerance` in units of `scale`.
#[inline(always)]
pub fn reach(powers: &Powers, scale: &State, tolerance: f64) -> f64 {
    let size = |n: usize| (0..3).map(|r| powers[r][n].abs() / scale[r]).fold(f64::MIN_POSITIVE, f64::max);
    let level = ln(tolerance);
    let reach = |n: usize| (level - ln(size(n))) / (n + 1) as f64;
    exp(reach(TERMS - 2).min(reach(TERMS - 1)))
}
