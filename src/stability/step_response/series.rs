//! Taylor series of a response in time.
//!
//! With `v = e^x`, `w = e^-y` and `p = v e^q`, `q = x + y`, the equations of `scaled_block.rs` are
//!
//! ```text
//! z' = k (1 - v),    M v' = z - a x - b y,    v' = v x',    w' = -w y',    p' = p (x' + q'),
//! y' = w - v (ageing),    -v q (slip),    (w - p)/2 (Perrin, Rice, Zheng),
//! ```
//!
//! which contain products of two series at most, so each coefficient follows from those before it.

use super::scaled_block::{Rates, ScaledBlock, State, X, Y, Z};
use crate::model::StateLaw;
use crate::numerics::elementary::{exp, ln};

/// Number of terms: the order of a step.
pub const TERMS: usize = 16;

/// Coefficients of `u, …, u^TERMS` of the changes of `[z, y, x]`.
pub type Powers = [[f64; TERMS]; 3];

/// Coefficients known so far of `v`, `x'` and `y'`.
struct Known {
    v: [f64; TERMS],
    x_slope: [f64; TERMS],
    y_slope: [f64; TERMS],
}

impl ScaledBlock {
    /// Series about `state` in powers of the time in units of `unit`, which keeps coefficients in the range of doubles.
    #[inline(always)]
    pub fn series(&self, state: &State, rates: &Rates, unit: f64) -> Powers {
        match self.state_law {
            StateLaw::Ageing => {
                let mut w = [rates.relaxation; TERMS];
                self.series_by(state, rates, unit, |n, Known { v, y_slope, .. }| {
                    w[n] = -weight(n) * product(&w, y_slope, n - 1);
                    w[n] - v[n]
                })
            }
            StateLaw::Slip => {
                let mut q = [state[X] + state[Y]; TERMS];
                self.series_by(state, rates, unit, |n, Known { v, x_slope, y_slope }| {
                    q[n] = weight(n) * (x_slope[n - 1] + y_slope[n - 1]);
                    -product(v, &q, n)
                })
            }
            StateLaw::Prz => {
                let (mut w, mut p) = ([exp(-state[Y]); TERMS], [-rates.by_x; TERMS]);
                self.series_by(state, rates, unit, |n, Known { x_slope, y_slope, .. }| {
                    w[n] = -weight(n) * product(&w, y_slope, n - 1);
                    p[n] = weight(n) * (2.0 * product(&p, x_slope, n - 1) + product(&p, y_slope, n - 1));
                    0.5 * (w[n] - p[n])
                })
            }
        }
    }

    /// Series with the coefficients of `y'` by `growth`, from the number of the coefficient and those known before.
    #[inline(always)]
    fn series_by(
        &self,
        &[z, y, x]: &State,
        rates: &Rates,
        unit: f64,
        mut growth: impl FnMut(usize, &Known) -> f64,
    ) -> Powers {
        let (factor, inverse) = (unit / self.inertia, 1.0 / rates.v);
        let mut known = Known { v: [rates.v; TERMS], x_slope: [0.0; TERMS], y_slope: [0.0; TERMS] };
        let mut powers = [[0.0; TERMS]; 3];
        let mut force = z - self.a * x - self.b * y;
        let mut stretching = -self.k * rates.excess;
        known.y_slope[0] = unit * rates.growth;
        #[expect(clippy::needless_range_loop, reason = "n is the coefficient of several series")]
        for n in 0..TERMS {
            let v_slope = factor * force;
            let before = (0..n).fold(0.0, |sum, j| sum + known.x_slope[j] * known.v[n - j]);
            known.x_slope[n] = (v_slope - before) * inverse;
            powers[Z][n] = unit * stretching * weight(n + 1);
            powers[Y][n] = known.y_slope[n] * weight(n + 1);
            powers[X][n] = known.x_slope[n] * weight(n + 1);
            if n + 1 < TERMS {
                known.v[n + 1] = v_slope * weight(n + 1);
                force = powers[Z][n] - self.a * powers[X][n] - self.b * powers[Y][n];
                stretching = -self.k * known.v[n + 1];
                known.y_slope[n + 1] = unit * growth(n + 1, &known);
            }
        }
        powers
    }
}

/// Weight of coefficient `n` in the integral of the one before.
#[inline(always)]
fn weight(n: usize) -> f64 {
    1.0 / n as f64
}

/// Coefficient `n` of the product of two series.
#[inline(always)]
fn product(first: &[f64; TERMS], second: &[f64; TERMS], n: usize) -> f64 {
    (0..n).fold(first[0] * second[n], |sum, j| sum + second[j] * first[n - j])
}

/// Time, in the unit of the series, at which its last two terms are `tolerance` in units of `scale`.
#[inline(always)]
pub fn reach(powers: &Powers, scale: &State, tolerance: f64) -> f64 {
    let size = |n: usize| (0..3).map(|r| powers[r][n].abs() / scale[r]).fold(f64::MIN_POSITIVE, f64::max);
    let level = ln(tolerance);
    let reach = |n: usize| (level - ln(size(n))) / (n + 1) as f64;
    exp(reach(TERMS - 2).min(reach(TERMS - 1)))
}
