//! Exponent with given value, slope and curvature at both ends, and a free bump.
//!
//! `f = Q(x) + rise S(xi) - c x^3 (1 - x)^3`. The quintic `Q` has the slopes and curvatures and no rise; `S = 10 xi^3 -
//! 15 xi^4 + 6 xi^5` has the rise alone. The stretched variable is `xi = (1 + p) x/(1 + p x + q z)`, `z = 1 - x`:
//! `p > 0` stretches the start, `q > 0` the end.

use super::Exponent;
use crate::numerics::MAX_STEPS;

/// The Hermite exponent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hermite {
    /// `f(1) - f(0)`.
    pub rise: f64,
    /// First and second derivative at the start.
    pub start: [f64; 2],
    /// First and second derivative at the end.
    pub end: [f64; 2],
    /// `p` and `q`.
    pub stretch: [f64; 2],
    /// Coefficient of `-x^3 (1 - x)^3`.
    pub c: f64,
}

/// Coefficients of `x^3 (1 - x)^3` in powers of `x`, or of `1 - x`, from the first on.
const BUMP: [f64; 6] = [0.0, 0.0, 1.0, -3.0, 3.0, -1.0];

/// Coefficients of `S` in powers of `xi`, from the first on; `S(1 - xi) = 1 - S(xi)`.
const STEP: [f64; 6] = [0.0, 0.0, 10.0, -15.0, 6.0, 0.0];

/// The stretched variable `xi` and its derivatives in `x`.
struct Stretched {
    xi: f64,
    /// `1 - xi`.
    zeta: f64,
    d1: f64,
    d2: f64,
    d3: f64,
}

impl Hermite {
    /// Exponent without slopes and curvatures at the ends, not stretched.
    pub fn flat(rise: f64) -> Hermite {
        Hermite { rise, start: [0.0; 2], end: [0.0; 2], stretch: [0.0; 2], c: 0.0 }
    }

    #[inline(always)]
    fn stretched(&self, x: f64, z: f64) -> Stretched {
        let [p, q] = self.stretch;
        let inverse = 1.0 / (1.0 + p * x + q * z);
        let d1 = (1.0 + p) * (1.0 + q) * inverse * inverse;
        let bend = (p - q) * inverse;
        Stretched {
            xi: (1.0 + p) * x * inverse,
            zeta: (1.0 + q) * z * inverse,
            d1,
            d2: -2.0 * d1 * bend,
            d3: 6.0 * d1 * bend * bend,
        }
    }

    /// Taylor coefficients from the first power on, in the distance away from the nearer end: of `Q` with the bump in
    /// `x`, of `rise S` in `xi`, and the signs of the two directions.
    fn about(&self, x: f64, z: f64, at: &Stretched) -> ([f64; 6], [f64; 6], [f64; 2]) {
        let ([p, q], [s, t]) = if x <= z {
            (self.start, self.end)
        } else {
            ([-self.end[0], self.end[1]], [-self.start[0], self.start[1]])
        };
        let mut plain = [
            p,
            0.5 * q,
            -6.0 * p - 4.0 * s - 1.5 * q + 0.5 * t,
            8.0 * p + 7.0 * s + 1.5 * q - t,
            -3.0 * p - 3.0 * s - 0.5 * q + 0.5 * t,
            0.0,
        ];
        plain.iter_mut().zip(BUMP).for_each(|(plain, bump)| *plain -= self.c * bump);
        let sign = |forwards: bool| if forwards { 1.0 } else { -1.0 };
        let signs = [sign(x <= z), sign(at.xi <= at.zeta)];
        let step = STEP.map(|step| signs[1] * self.rise * step);
        (shifted(&plain, x.min(z)), shifted(&step, at.xi.min(at.zeta)), signs)
    }

    /// The first three derivatives in `x`.
    pub fn derivatives(&self, x: f64, z: f64) -> [f64; 3] {
        let at = self.stretched(x, z);
        let (plain, step, signs) = self.about(x, z, &at);
        let [f1, f2, f3] = [signs[0] * plain[0], 2.0 * plain[1], signs[0] * 6.0 * plain[2]];
        let [h1, h2, h3] = [signs[1] * step[0], 2.0 * step[1], signs[1] * 6.0 * step[2]];
        [
            f1 + h1 * at.d1,
            f2 + h2 * at.d1 * at.d1 + h1 * at.d2,
            f3 + h3 * at.d1 * at.d1 * at.d1 + 3.0 * h2 * at.d1 * at.d2 + h1 * at.d3,
        ]
    }

    /// `x` of the only extremum inside, for [`Hermite::flat`] ends.
    pub fn extremum(&self) -> Option<f64> {
        let x = 0.5 - 5.0 * self.rise / self.c;
        (x > 0.0 && x < 1.0).then_some(x)
    }
}

/// Coefficients of a polynomial about `d`, without the constant term (Taylor shift by Horner's scheme).
fn shifted(powers: &[f64; 6], d: f64) -> [f64; 6] {
    let mut t = [0.0, powers[0], powers[1], powers[2], powers[3], powers[4], powers[5]];
    for k in 0..6 {
        for j in (k..6).rev() {
            t[j] += d * t[j + 1];
        }
    }
    [t[1], t[2], t[3], t[4], t[5], t[6]]
}

impl Exponent for Hermite {
    // Measured: with 0.45 control velocities between nodes were off by up to 3 rtol (`cargo test --release --test solver compliant`).
    const INTERPOLATION: f64 = 0.35;

    fn with(self, c: f64) -> Hermite {
        Hermite { c, ..self }
    }

    #[inline(always)]
    fn value(&self, x: f64, z: f64) -> f64 {
        let Stretched { zeta, .. } = self.stretched(x, z);
        let (x2, z2, xz) = (x * x, z * z, x * z);
        let (x3, z3) = (x2 * x, z2 * z);
        let ends = self.start[0] * x * z3 * (1.0 + 3.0 * x) - self.end[0] * z * x3 * (1.0 + 3.0 * z)
            + 0.5 * (self.start[1] * x2 * z3 + self.end[1] * z2 * x3);
        ends - zeta * zeta * zeta * self.rise * (10.0 - 15.0 * zeta + 6.0 * zeta * zeta) - self.c * (xz * xz * xz)
    }

    #[inline(always)]
    fn slope(&self, x: f64, z: f64) -> f64 {
        let Stretched { xi, zeta, d1, .. } = self.stretched(x, z);
        let (x2, z2, xz, stretched) = (x * x, z * z, x * z, xi * zeta);
        let ends = self.start[0] * z2 * (1.0 + 2.0 * x - 15.0 * x2)
            + self.end[0] * x2 * (1.0 + 2.0 * z - 15.0 * z2)
            + 0.5 * (self.start[1] * x * z2 * (2.0 - 5.0 * x) - self.end[1] * z * x2 * (2.0 - 5.0 * z));
        ends + 30.0 * self.rise * d1 * stretched * stretched - 3.0 * self.c * xz * xz * (z - x)
    }

    #[inline(always)]
    fn sensitivity(x: f64, z: f64) -> f64 {
        let xz = x * z;
        xz * xz * xz
    }

    fn distance_of_variation(&self, x: f64, z: f64, variation: f64) -> f64 {
        let at = self.stretched(x, z);
        let (mut t, step, _) = self.about(x, z, &at);
        // Over at most this distance xi changes by no more than twice its slope times the distance.
        let bend = (at.d2 / at.d1).abs();
        let mut h = 1.0;
        if bend > 0.0 {
            h = (1.0 / bend).min(1.0);
            let mut scale = 1.0;
            for (t, step) in t.iter_mut().zip(&step) {
                scale *= 2.0 * at.d1;
                *t = t.abs() + scale * step.abs();
            }
        } else {
            t.iter_mut().zip(&step).for_each(|(t, step)| *t = (*t + step).abs());
        }
        for _ in 0..MAX_STEPS {
            let (value, slope) =
                t.iter().rev().fold((0.0, 0.0), |(value, slope), t| (t + h * value, value + h * slope));
            // The polynomial without constant term is h times this value.
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

    fn parameter_scale(&self) -> f64 {
        // The height of the bump is 1/64.
        if self.c < 0.0 { self.size().min(16.0) } else { self.size() }
    }

    fn newton_step(ratio: f64) -> f64 {
        (1.0 - 1.0 / (ratio * ratio * ratio)) / 3.0
    }
}
