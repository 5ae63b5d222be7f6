//! Cubic polynomials on an interval: their least value, decided without doubt about its sign, and their zeros.

use super::double_double::DoubleDouble;

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

    /// Whether the cubic is above 0 (`strict`) or at least 0 everywhere on `[0, 1]`. `rounded` is the same in double: the place of its minimum is good
    /// enough, since the value there depends on the square of its error.
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

/// A zero in the closed upper half plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zero {
    /// Real part.
    pub re: f64,
    /// Imaginary part, at least 0; a positive one stands for a conjugate pair.
    pub im: f64,
}

/// The zeros of `c + b x + a x^2`, without cancellation; those at infinity are left out.
pub fn quadratic_zeros([c, b, a]: [f64; 3]) -> [Option<Zero>; 2] {
    let half = -0.5 * b;
    let discriminant = half * half - a * c;
    let finite = |re: f64, im: f64| (re.is_finite() && im.is_finite()).then_some(Zero { re, im });
    if discriminant < 0.0 {
        return [finite(half / a, (-discriminant).sqrt() / a.abs()), None];
    }
    let q = half + discriminant.sqrt().copysign(half);
    [finite(q / a, 0.0), finite(c / q, 0.0)]
}

/// The zeros of `d[0] + d[1] s + d[2] s^2 + d[3] s^3` with `d[0] != 0`, to a few digits; those beyond `1e6` are left out.
///
/// Found as reciprocals, so that a vanishing leading coefficient only sends a zero to infinity.
pub fn cubic_zeros(d: [f64; 4]) -> [Option<Zero>; 3] {
    let (p, q, r) = (d[1] / d[0], d[2] / d[0], d[3] / d[0]);
    // y^3 + p y^2 + q y + r (Numerical Recipes, 3rd ed., section 5.6).
    let third = p / 3.0;
    let big_q = third * third - q / 3.0;
    let big_r = third * (third * third - 0.5 * q) + 0.5 * r;
    let cube = big_q * big_q * big_q;
    let excess = big_r * big_r - cube;
    let y = if excess < 0.0 {
        // Three real zeros: the one of largest distance from the mean.
        let angle = libm::acos((big_r.abs() / cube.sqrt()).min(1.0));
        -2.0 * (big_q.sqrt() * libm::cos(angle / 3.0)).copysign(big_r) - third
    } else {
        let s = -libm::cbrt(big_r.abs() + excess.sqrt()).copysign(big_r);
        s + if s == 0.0 { 0.0 } else { big_q / s } - third
    };
    let rest = quadratic_zeros([q + y * (p + y), p + y, 1.0]);
    let invert = |zero: Zero| {
        let square = zero.re * zero.re + zero.im * zero.im;
        (square > 1e-12).then(|| Zero { re: zero.re / square, im: zero.im / square })
    };
    [invert(Zero { re: y, im: 0.0 }), rest[0].and_then(invert), rest[1].and_then(invert)]
}
