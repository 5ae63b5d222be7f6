//! Cubic polynomials on an interval: their least value, decided without doubt about its sign, and their zeros.

use super::double_double::DoubleDouble;
use super::elementary::{exp, ln};

/// `c[0] + c[1] x + c[2] x^2 + c[3] x^3`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cubic {
    /// Coefficients, lowest power first.
    pub c: [f64; 4],
}

/// A cubic whose coefficients are known to about 32 digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactCubic {
    /// Coefficients, lowest power first.
    pub c: [DoubleDouble; 4],
}

impl Cubic {
    /// The value at `x`.
    #[inline(always)]
    pub fn at(&self, x: f64) -> f64 {
        let [c0, c1, c2, c3] = self.c;
        c0 + x * (c1 + x * (c2 + x * c3))
    }

    /// The least value on `[0, 1]`, at an end or at the one stationary minimum, and a bound on its rounding error.
    #[inline(always)]
    pub fn least(&self) -> (f64, f64) {
        let [c0, c1, c2, c3] = self.c;
        let doubt = 8.0 * f64::EPSILON * (c0.abs() + c1.abs() + c2.abs() + c3.abs());
        let lower = |x: f64, y: f64| if y < x { y } else { x };
        (lower(lower(c0, self.at(1.0)), self.at(self.minimum())), doubt)
    }

    /// The stationary minimum if it lies inside `(0, 1)`, else 0.
    #[inline(always)]
    pub fn minimum(&self) -> f64 {
        let [_, c1, c2, c3] = self.c;
        // c1 + 2 c2 x + 3 c3 x^2 = 0 with a positive second derivative 2 c2 + 6 c3 x = 2 root.
        let root = (c2 * c2 - 3.0 * c1 * c3).sqrt();
        let x = if c2 > 0.0 { -c1 / (c2 + root) } else { (root - c2) / (3.0 * c3) };
        if x > 0.0 && x < 1.0 { x } else { 0.0 }
    }
}

impl ExactCubic {
    /// The value at `x`.
    pub fn at(&self, x: f64) -> DoubleDouble {
        let x = DoubleDouble::new(x);
        let [c0, c1, c2, c3] = self.c;
        c0 + x * (c1 + x * (c2 + x * c3))
    }

    /// Whether the cubic is above 0 (`strict`) or at least 0 everywhere on `[0, 1]`. `rounded` is the same in double:
    /// the place of its minimum is good enough, since the value there depends on the square of its error.
    pub fn is_positive(&self, rounded: &Cubic, strict: bool) -> bool {
        [0.0, 1.0, rounded.minimum()].iter().all(|&x| {
            let value = self.at(x).high;
            if strict { value > 0.0 } else { value >= 0.0 }
        })
    }

    /// The coefficients in powers of `x - centre`, rounded to double after the shift.
    pub fn about(&self, centre: f64) -> [f64; 4] {
        let x = DoubleDouble::new(centre);
        let [c0, c1, c2, c3] = self.c;
        let (two, three) = (DoubleDouble::new(2.0), DoubleDouble::new(3.0));
        [
            (c0 + x * (c1 + x * (c2 + x * c3))).high,
            (c1 + x * (two * c2 + three * x * c3)).high,
            (c2 + three * x * c3).high,
            c3.high,
        ]
    }
}

/// The zeros of a polynomial of degree `N` in the closed upper half plane, a conjugate pair given twice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zeros<const N: usize> {
    /// Real parts.
    pub re: [f64; N],
    /// Imaginary parts, at least 0.
    pub im: [f64; N],
}

/// `cos(acos(c)/3)` on `0 <= c <= 1` in powers of `c`: Chebyshev interpolant, good to 5e-6; one Newton step follows.
const TRISECTION: [f64; 5] =
    [0.8660304320226909, 0.1664117217875963, -0.04592193313076373, 0.01751218857520906, -0.004035398716654312];

/// The zeros of `d[0] + d[1] s + d[2] s^2 + d[3] s^3` with `d[0] > 0`, without branches, to a few digits.
///
/// Found as reciprocals, so that a vanishing leading coefficient only sends a zero to infinity: it comes out very large
/// or infinite.
#[inline(always)]
pub fn cubic_zeros(d: [f64; 4]) -> Zeros<3> {
    let scale = 1.0 / d[0];
    let third = d[1] * scale / 3.0;
    let (q, r) = (d[2] * scale, d[3] * scale);
    // y = u - third, u^3 - 3 big_q u + 2 big_r = 0.
    let big_q = third * third - q / 3.0;
    let big_r = third * (third * third - 0.5 * q) + 0.5 * r;
    let size = big_r.abs();
    let excess = size * size - big_q * big_q * big_q;
    // One real zero: Cardano, in the form whose terms all have one sign.
    let cube = size + (if excess > 0.0 { excess } else { 0.0 }).sqrt() + f64::MIN_POSITIVE;
    let s = exp(ln(cube) / 3.0);
    let t = big_q / s;
    let cardano = 2.0 * size / (s * s - big_q + t * t + f64::MIN_POSITIVE);
    // Three real zeros: Viete, the one of largest distance from the mean.
    let root = (if big_q > 0.0 { big_q } else { 0.0 }).sqrt() + f64::MIN_POSITIVE;
    let c = size / (root * root * root + f64::MIN_POSITIVE);
    let c = if c < 1.0 { c } else { 1.0 };
    let [g0, g1, g2, g3, g4] = TRISECTION;
    let g = g0 + c * (g1 + c * (g2 + c * (g3 + c * g4)));
    let g = g - ((4.0 * g * g - 3.0) * g - c) / (12.0 * g * g - 3.0);
    let u = if excess > 0.0 { cardano } else { 2.0 * root * g };
    let u = if big_r > 0.0 { -u } else { u };
    let y = u - third;
    // The quadratic that is left, y^2 - 2 mean y + product: divided from the low end for a large zero, from the high
    // end for a small one.
    let large = (y * y * y).abs() > r.abs();
    let rest = 3.0 * third + y;
    let product = if large { -r / y } else { q + y * rest };
    let mean = -0.5 * if large { (product - q) / y } else { rest };
    let spread = mean * mean - product;
    let real = spread >= 0.0;
    let distance = spread.abs().sqrt();
    let outer = if mean < 0.0 { mean - distance } else { mean + distance };
    let norm = mean * mean + distance * distance + f64::MIN_POSITIVE;
    let (re, im) = (mean / norm, distance / norm);
    Zeros {
        re: [1.0 / y, if real { 1.0 / outer } else { re }, if real { outer / product } else { re }],
        im: [0.0, if real { 0.0 } else { im }, if real { 0.0 } else { im }],
    }
}

/// The zeros of `c + b x + a x^2`, without branches and without cancellation; those at infinity come out very large,
/// infinite or NaN.
#[inline(always)]
pub fn quadratic_zeros([c, b, a]: [f64; 3]) -> Zeros<2> {
    let half = -0.5 * b;
    let discriminant = half * half - a * c;
    let real = discriminant >= 0.0;
    let root = discriminant.abs().sqrt();
    let q = if half < 0.0 { half - root } else { half + root };
    let (re, im) = (half / a, root / a.abs());
    Zeros {
        re: [if real { q / a } else { re }, if real { c / q } else { re }],
        im: [if real { 0.0 } else { im }, if real { 0.0 } else { im }],
    }
}
