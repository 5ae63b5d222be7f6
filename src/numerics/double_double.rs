//! Double-double arithmetic: an unevaluated sum of two doubles, about 32 digits, for the few operations that need the last bit.
//!
//! Error-free transformations after Dekker (Numer. Math. 18, 224, 1971) and Knuth (TAOCP 2, 4.2.2), without fused
//! multiply-add.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// `high + low` with `|low| <= ulp(high)/2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DoubleDouble {
    /// The nearest double.
    pub high: f64,
    /// The remainder.
    pub low: f64,
}

impl DoubleDouble {
    /// A double, exactly.
    pub const fn new(value: f64) -> Self {
        DoubleDouble { high: value, low: 0.0 }
    }

    /// The exact sum of two doubles.
    pub fn sum(x: f64, y: f64) -> Self {
        let high = x + y;
        let carried = high - x;
        DoubleDouble { high, low: (x - (high - carried)) + (y - carried) }
    }

    /// The exact product of two doubles (below `1e300`).
    pub fn product(x: f64, y: f64) -> Self {
        let high = x * y;
        let (x1, x2) = halves(x);
        let (y1, y2) = halves(y);
        DoubleDouble { high, low: ((x1 * y1 - high) + x1 * y2 + x2 * y1) + x2 * y2 }
    }

    /// The square root of a number that is not negative.
    pub fn sqrt(self) -> Self {
        let root = Self::new(self.high.sqrt());
        if self.high > 0.0 { root + (self - root * root) / (root + root) } else { Self::new(0.0) }
    }

    /// `high + low` where `|high| >= |low|`.
    fn normalised(high: f64, low: f64) -> Self {
        let sum = high + low;
        DoubleDouble { high: sum, low: low - (sum - high) }
    }
}

/// The upper 26 bits and the rest (Veltkamp).
fn halves(x: f64) -> (f64, f64) {
    let t = 134217729.0 * x;
    let high = t - (t - x);
    (high, x - high)
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let s = Self::sum(self.high, other.high);
        let t = Self::sum(self.low, other.low);
        let u = Self::normalised(s.high, s.low + t.high);
        Self::normalised(u.high, u.low + t.low)
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        DoubleDouble { high: -self.high, low: -self.low }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let p = Self::product(self.high, other.high);
        Self::normalised(p.high, p.low + (self.high * other.low + self.low * other.high))
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = Self::new(self.high / other.high);
        let second = Self::new((self - first * other).high / other.high);
        let third = Self::new((self - first * other - second * other).high / other.high);
        first + second + third
    }
}
