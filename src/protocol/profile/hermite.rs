//! The polynomial that meets value, slope and curvature at both ends, with one term more that meets nothing.
//!
//! `f = H(x) - c x^3 (1 - x)^3`, where `H` is the quintic Hermite interpolant.

use super::Exponent;
use super::curve::{Panel, Side, Stretches};
use crate::numerics::polynomial::roots_between;

/// The exponent; derivatives are those in `x`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hermite {
    /// `f(1) - f(0)`.
    pub rise: f64,
    /// `f'` and `f''` at the start.
    pub start: [f64; 2],
    /// `f'` and `f''` at the end.
    pub end: [f64; 2],
    /// Coefficient of `-x^3 (1 - x)^3`.
    pub c: f64,
}

/// `x^3 (1 - x)^3` in powers of `x`, from the third on.
const BUMP: [f64; 4] = [1.0, -3.0, 3.0, -1.0];

/// Steps after which Newton's method, which runs down a convex polynomial of degree six, is close enough.
const MOST_STEPS: u32 = 100;

impl Hermite {
    /// Coefficients of the distance from an end, from the first power on.
    fn powers(&self, side: Side) -> [f64; 6] {
        let (r, [p, q], [s, t]) = match side {
            Side::Start => (self.rise, self.start, self.end),
            Side::End => (-self.rise, [-self.end[0], self.end[1]], [-self.start[0], self.start[1]]),
        };
        [
            p,
            0.5 * q,
            10.0 * r - 6.0 * p - 4.0 * s - 1.5 * q + 0.5 * t - self.c * BUMP[0],
            -15.0 * r + 8.0 * p + 7.0 * s + 1.5 * q - t - self.c * BUMP[1],
            6.0 * r - 3.0 * p - 3.0 * s - 0.5 * q + 0.5 * t - self.c * BUMP[2],
            -self.c * BUMP[3],
        ]
    }

    /// The coefficients about a place, from the first power of the distance on, measured away from the nearer end, and
    /// that end.
    fn about(&self, x: f64, z: f64) -> ([f64; 6], Side) {
        let (d, side) = if x <= z { (x, Side::Start) } else { (z, Side::End) };
        let mut t = self.powers(side);
        // Taylor's shift by Horner's scheme.
        let mut shifted = [0.0, t[0], t[1], t[2], t[3], t[4], t[5]];
        for k in 0..6 {
            for j in (k..6).rev() {
                shifted[j] += d * shifted[j + 1];
            }
        }
        t.copy_from_slice(&shifted[1..]);
        (t, side)
    }

    /// `f'`, `f''` and `f'''`.
    pub fn derivatives(&self, x: f64, z: f64) -> [f64; 3] {
        let (t, side) = self.about(x, z);
        let sign = if side == Side::Start { 1.0 } else { -1.0 };
        [sign * t[0], 2.0 * t[1], sign * 6.0 * t[2]]
    }

    /// Every turn inside.
    pub fn turns(&self) -> Vec<f64> {
        let powers = self.powers(Side::Start);
        let slope: [f64; 6] = std::array::from_fn(|k| (k + 1) as f64 * powers[k]);
        roots_between(&slope, 0.0, 1.0)
    }

    /// `x` of the only turn inside, where slopes and curvatures at the ends are 0.
    pub fn turn(&self) -> Option<f64> {
        let x = 0.5 - 5.0 * self.rise / self.c;
        (x > 0.0 && x < 1.0).then_some(x)
    }
}

impl Exponent for Hermite {
    fn with(self, c: f64) -> Hermite {
        Hermite { c, ..self }
    }

    #[inline(always)]
    fn value(&self, x: f64, z: f64) -> f64 {
        let (x2, z2, xz) = (x * x, z * z, x * z);
        let (x3, z3) = (x2 * x, z2 * z);
        let ends = self.start[0] * x * z3 * (1.0 + 3.0 * x) - self.end[0] * z * x3 * (1.0 + 3.0 * z)
            + 0.5 * (self.start[1] * x2 * z3 + self.end[1] * z2 * x3);
        ends - z3 * self.rise * (10.0 - 15.0 * z + 6.0 * z2) - self.c * (xz * xz * xz)
    }

    #[inline(always)]
    fn slope(&self, x: f64, z: f64) -> f64 {
        let (x2, z2) = (x * x, z * z);
        let ends = self.start[0] * z2 * (1.0 + 2.0 * x - 15.0 * x2)
            + self.end[0] * x2 * (1.0 + 2.0 * z - 15.0 * z2)
            + 0.5 * (self.start[1] * x * z2 * (2.0 - 5.0 * x) - self.end[1] * z * x2 * (2.0 - 5.0 * z));
        ends + x2 * z2 * (30.0 * self.rise - 3.0 * self.c * (z - x))
    }

    #[inline(always)]
    fn lean(x: f64, z: f64) -> f64 {
        let xz = x * z;
        xz * xz * xz
    }

    fn stride(&self, x: f64, z: f64, variation: f64) -> f64 {
        let t = self.about(x, z).0.map(f64::abs);
        let mut h = 1.0;
        for _ in 0..MOST_STEPS {
            let (value, slope) = t.iter().rev().fold((0.0, 0.0), |(value, slope), t| {
                // The polynomial without its constant term: value = h (…), slope by the product rule.
                (t + h * value, value + h * slope)
            });
            let (value, slope) = (h * value, value + h * slope);
            if value <= 1.01 * variation {
                break;
            }
            h -= (value - variation) / slope;
        }
        h
    }

    fn size(&self) -> f64 {
        let ends = self.start[0].abs() + self.start[1].abs() + self.end[0].abs() + self.end[1].abs();
        self.c.abs() + self.rise.abs() + ends
    }

    fn unit(&self) -> f64 {
        // The bump is 1/64 high.
        if self.c < 0.0 { self.size().min(16.0) } else { self.size() }
    }

    fn settle(ratio: f64) -> f64 {
        (1.0 - 1.0 / (ratio * ratio * ratio)) / 3.0
    }

    fn dips(&self) -> bool {
        false
    }

    fn stretches(&self, _level: f64, _depth: f64) -> Stretches {
        let half = |side| Panel { side, from: 0.0, to: 0.5 };
        let empty = Panel { side: Side::End, from: 0.5, to: 0.5 };
        Stretches { panels: [half(Side::Start), empty, empty, half(Side::End).reversed()] }
    }
}
