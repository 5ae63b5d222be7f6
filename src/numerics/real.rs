//! Real numbers of single or double precision, for estimates. Single precision has twice the lanes, and roots and quotients cost a third.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// `f64` or `f32`.
pub trait Real:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The smallest normal number: added to a divisor, it prevents 0/0.
    const MIN_NORMAL: Self;

    /// The nearest number.
    fn of(x: f64) -> Self;

    /// The number in double precision.
    fn wide(self) -> f64;

    /// The nearest number in single precision.
    fn narrow(self) -> f32;

    /// The absolute value.
    fn abs(self) -> Self;

    /// The square root.
    fn sqrt(self) -> Self;

    /// The cube root of a positive normal number with a relative error of 5 %, from its bits.
    fn rough_cube_root(self) -> Self;

    /// The cube root of a positive normal number, accurate to the last bits if its square and cube do not overflow.
    #[inline(always)]
    fn cube_root(self) -> Self {
        // Halley's method triples the digits: 5e-2, 1e-4, 1e-12.
        let step = |y: Self| {
            let cube = y * y * y;
            y * (cube + self + self) / (cube + cube + self)
        };
        step(step(self.rough_cube_root()))
    }
}

impl Real for f64 {
    const MIN_NORMAL: f64 = f64::MIN_POSITIVE;

    #[inline(always)]
    fn of(x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        self
    }

    #[inline(always)]
    fn narrow(self) -> f32 {
        self as f32
    }

    #[inline(always)]
    fn abs(self) -> f64 {
        self.abs()
    }

    #[inline(always)]
    fn sqrt(self) -> f64 {
        self.sqrt()
    }

    #[inline(always)]
    fn rough_cube_root(self) -> f64 {
        // A third of the exponent and of the mantissa at once: 1/3 = 1/4 + 1/16 + …, and two thirds of the bias.
        let bits = self.to_bits();
        let sum = (bits >> 2) + (bits >> 4);
        let sum = sum + (sum >> 4);
        let sum = sum + (sum >> 8);
        f64::from_bits(sum + (sum >> 16) + 0x2A9F_7893_0000_0000)
    }
}

impl Real for f32 {
    const MIN_NORMAL: f32 = f32::MIN_POSITIVE;

    #[inline(always)]
    fn of(x: f64) -> f32 {
        x as f32
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        f64::from(self)
    }

    #[inline(always)]
    fn narrow(self) -> f32 {
        self
    }

    #[inline(always)]
    fn abs(self) -> f32 {
        self.abs()
    }

    #[inline(always)]
    fn sqrt(self) -> f32 {
        self.sqrt()
    }

    #[inline(always)]
    fn rough_cube_root(self) -> f32 {
        let bits = self.to_bits();
        let sum = (bits >> 2) + (bits >> 4);
        let sum = sum + (sum >> 4);
        f32::from_bits(sum + (sum >> 8) + 0x2A51_37A0)
    }
}
