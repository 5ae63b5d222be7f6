//! Cubic polynomials on an interval: the least value, with a certain sign, and the zeros.

use super::MAX_STEPS;
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

    /// The least value on `[0, 1]`.
    #[inline(always)]
    pub fn least(&self) -> f64 {
        self.lowest().1
    }

    /// The position of the least value on `[0, 1]`, an end or the one stationary minimum, and this value.
    #[inline(always)]
    pub fn lowest(&self) -> (f64, f64) {
        let inside = self.minimum();
        let lower = |a: (f64, f64), b: (f64, f64)| if b.1 < a.1 { b } else { a };
        lower(lower((0.0, self.c[0]), (1.0, self.at(1.0))), (inside, self.at(inside)))
    }

    /// A bound on the rounding error of a value on `[0, 1]` and of the coefficients in Bernstein's form.
    #[inline(always)]
    pub fn doubt(&self) -> f64 {
        let [c0, c1, c2, c3] = self.c;
        8.0 * f64::EPSILON * (c0.abs() + c1.abs() + c2.abs() + c3.abs())
    }

    /// A lower and an upper bound of the least value on `[0, 1]`: the least coefficient in Bernstein's form, and the
    /// lesser end.
    #[inline(always)]
    pub fn bounds(&self) -> (f64, f64) {
        let lower = |x: f64, y: f64| if y < x { y } else { x };
        let [first, second] = self.inner();
        let end = lower(self.c[0], self.at(1.0));
        (lower(end, lower(first, second)), end)
    }

    /// The two inner coefficients in Bernstein's form on `[0, 1]`.
    #[inline(always)]
    pub fn inner(&self) -> [f64; 2] {
        let [c0, c1, c2, _] = self.c;
        [c0 + c1 * THIRD, c0 + (2.0 * c1 + c2) * THIRD]
    }

    /// The stationary minimum if it lies inside `(0, 1)`, else 0.
    #[inline(always)]
    pub fn minimum(&self) -> f64 {
        let [_, c1, c2, c3] = self.c;
        // c1 + 2 c2 x + 3 c3 x^2 = 0 with a positive second derivative 2 c2 + 6 c3 x = 2 root.
        let root = (c2 * c2 - 3.0 * c1 * c3).sqrt();
        let rises = c2 > 0.0;
        let x = if rises { -c1 } else { root - c2 } / if rises { c2 + root } else { 3.0 * c3 };
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

    /// The stationary minimum if it lies inside `(0, 1)`, else 0. The coefficients are accurate to the last bit of a double.
    pub fn minimum(&self) -> f64 {
        Cubic { c: self.c.map(|c| c.high) }.minimum()
    }

    /// Whether the cubic is above 0 (`strict`) or at least 0 everywhere on `[0, 1]`. The position of the minimum in double precision suffices,
    /// since the value there depends on the square of its error.
    pub fn is_positive(&self, strict: bool) -> bool {
        [0.0, 1.0, self.minimum()].iter().all(|&x| {
            let value = self.at(x).high;
            if strict { value > 0.0 } else { value >= 0.0 }
        })
    }

    /// The zeros as real part and distance from the real axis; both zeros of a conjugate pair have the same entry. Real parts have enough digits
    /// for differences with any point. Infinite zeros are NaN or very large.
    pub fn zeros(&self) -> [(DoubleDouble, f64); 3] {
        let rough = cubic_zeros(self.c.map(|c| c.high));
        // The real zero farthest from the others, relatively, is simple. Division by it leaves a quadratic.
        let apart = |k: usize| {
            let distance = |j: usize| (rough.re[j] - rough.re[k]).hypot(rough.im[j]) / rough.re[k].abs();
            let others = (0..3).filter(|&j| j != k).map(distance).fold(f64::INFINITY, f64::min);
            if rough.im[k] == 0.0 && rough.re[k].is_finite() { others } else { -1.0 }
        };
        let lone = (1..3).fold(0, |best, k| if apart(k) > apart(best) { k } else { best });
        let [c0, c1, c2, c3] = self.c;
        if rough.re[lone].abs() <= 1.0 {
            let x = refined(self.c, rough.re[lone]);
            let upper = c2 + x * c3;
            let [first, second] = exact_quadratic_zeros([c1 + x * upper, upper, c3]);
            [(x, 0.0), first, second]
        } else {
            // In y = 1/x, which is 0 for a zero at infinity.
            let y = if rough.re[lone].is_finite() { 1.0 / rough.re[lone] } else { 0.0 };
            let y = refined([c3, c2, c1, c0], y);
            let upper = c1 + y * c0;
            let [first, second] = exact_quadratic_zeros([c0, upper, c2 + y * upper]);
            [(DoubleDouble::new(1.0) / y, 0.0), first, second]
        }
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

/// The simple real zero near `x`, by Newton's method.
fn refined([c0, c1, c2, c3]: [DoubleDouble; 4], x: f64) -> DoubleDouble {
    let mut x = DoubleDouble::new(x);
    let mut last = f64::INFINITY;
    for _ in 0..MAX_STEPS {
        let value = c0 + x * (c1 + x * (c2 + x * c3));
        let slope = c1.high + x.high * (2.0 * c2.high + 3.0 * x.high * c3.high);
        let step = value.high / slope;
        // Steps shrink down to rounding.
        if step.is_nan() || step.abs() >= last {
            break;
        }
        x = x - DoubleDouble::new(step);
        last = 0.5 * step.abs();
    }
    x
}

/// The zeros of `c + b x + a x^2`, in the form of [`ExactCubic::zeros`].
pub fn exact_quadratic_zeros([c, b, a]: [DoubleDouble; 3]) -> [(DoubleDouble, f64); 2] {
    let half = DoubleDouble::new(-0.5) * b;
    let discriminant = half * half - a * c;
    if discriminant.high < 0.0 {
        let (re, im) = (half / a, ((-discriminant).sqrt() / a).high.abs());
        return [(re, im); 2];
    }
    let root = discriminant.sqrt();
    let q = if half.high < 0.0 { half - root } else { half + root };
    [(q / a, 0.0), (c / q, 0.0)]
}

const THIRD: f64 = 1.0 / 3.0;

/// The zeros of a polynomial of degree `N` in the closed upper half plane, a conjugate pair given twice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zeros<const N: usize> {
    /// Real parts.
    pub re: [f64; N],
    /// Imaginary parts, at least 0.
    pub im: [f64; N],
}

/// `cos(acos(c)/3)` on `0 <= c <= 1` in powers of `c`: Chebyshev interpolant with an error of 5e-6; one Newton step follows.
const TRISECTION: [f64; 5] =
    [0.8660304320226909, 0.1664117217875963, -0.04592193313076373, 0.01751218857520906, -0.004035398716654312];

/// The zeros of `d[0] + d[1] s + d[2] s^2 + d[3] s^3` with `d[0] > 0`, without branches, to a few digits.
///
/// The reciprocals are computed, so that a vanishing leading coefficient gives a very large or infinite zero.
#[inline(always)]
pub fn cubic_zeros(d: [f64; 4]) -> Zeros<3> {
    let scale = 1.0 / d[0];
    let third = d[1] * scale * THIRD;
    let (q, r) = (d[2] * scale, d[3] * scale);
    // y = u - third, u^3 - 3 big_q u + 2 big_r = 0.
    let big_q = third * third - q * THIRD;
    let big_r = third * (third * third - 0.5 * q) + 0.5 * r;
    let size = big_r.abs();
    let excess = size * size - big_q * big_q * big_q;
    let single = excess > 0.0;
    // One real zero: Cardano's formula, in the form whose terms have equal signs. Three real zeros: Viète's formula for the zero farthest from
    // the mean. Both are nested fractions, so that each lane divides only once.
    let cube = size + (if single { excess } else { 0.0 }).sqrt() + f64::MIN_POSITIVE;
    let s = cube_root(cube);
    let root = (if big_q > 0.0 { big_q } else { 0.0 }).sqrt() + f64::MIN_POSITIVE;
    let inner = if single { big_q } else { size } / if single { s } else { root * root * root + f64::MIN_POSITIVE };
    let c = if inner < 1.0 { inner } else { 1.0 };
    let [g0, g1, g2, g3, g4] = TRISECTION;
    let g = g0 + c * (g1 + c * (g2 + c * (g3 + c * g4)));
    let above = if single { 2.0 * size } else { (4.0 * g * g - 3.0) * g - c };
    let below = if single { s * s - big_q + inner * inner + f64::MIN_POSITIVE } else { 12.0 * g * g - 3.0 };
    let outer = above / below;
    let u = if single { outer } else { 2.0 * root * (g - outer) };
    let u = if big_r > 0.0 { -u } else { u };
    let y = u - third;
    let inverse = 1.0 / y;
    // The remaining quadratic, y^2 - 2 mean y + product: divided from the low end for a large zero, from the high end for a small one.
    let large = (y * y * y).abs() > r.abs();
    let rest = 3.0 * third + y;
    let product = if large { -r * inverse } else { q + y * rest };
    let mean = -0.5 * if large { (product - q) * inverse } else { rest };
    let spread = mean * mean - product;
    let real = spread >= 0.0;
    let distance = spread.abs().sqrt();
    let farther = if mean < 0.0 { mean - distance } else { mean + distance };
    let norm = mean * mean + distance * distance + f64::MIN_POSITIVE;
    let scale = 1.0 / if real { farther } else { norm };
    let (re, im) = (mean * scale, distance * scale);
    Zeros {
        re: [inverse, if real { scale } else { re }, if real { farther / product } else { re }],
        im: [0.0, if real { 0.0 } else { im }, if real { 0.0 } else { im }],
    }
}

/// The zeros of `c + b x + a x^2`, without branches and without cancellation; zeros at infinity are very large, infinite or NaN.
#[inline(always)]
pub fn quadratic_zeros([c, b, a]: [f64; 3]) -> Zeros<2> {
    let half = -0.5 * b;
    let discriminant = half * half - a * c;
    let real = discriminant >= 0.0;
    let root = discriminant.abs().sqrt();
    let q = if half < 0.0 { half - root } else { half + root };
    let scale = 1.0 / a;
    let (re, im) = (half * scale, root * scale.abs());
    Zeros {
        re: [if real { q * scale } else { re }, if real { c / q } else { re }],
        im: [if real { 0.0 } else { im }, if real { 0.0 } else { im }],
    }
}

/// The cube root of a positive normal number, accurate to the last bits if its square and cube do not overflow.
#[inline(always)]
fn cube_root(x: f64) -> f64 {
    // A third of the exponent and of the mantissa at once: 1/3 = 1/4 + 1/16 + …, and two thirds of the bias. The error is 5 %.
    let bits = x.to_bits();
    let sum = (bits >> 2) + (bits >> 4);
    let sum = sum + (sum >> 4);
    let sum = sum + (sum >> 8);
    let rough = f64::from_bits(sum + (sum >> 16) + 0x2A9F_7893_0000_0000);
    // Halley's method triples the digits: 5e-2, 1e-4, 1e-12.
    let step = |y: f64| {
        let cube = y * y * y;
        y * (cube + x + x) / (cube + cube + x)
    };
    step(step(rough))
}
