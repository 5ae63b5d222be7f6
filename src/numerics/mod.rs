//! Numerical methods, independent of friction.

pub mod adaptive;
pub mod cubic;
pub mod dilogarithm;
pub mod double_double;
pub mod elementary;
pub mod gauss;
pub mod lambert;
pub mod lanes;
pub mod polynomial;
pub mod radau;
pub mod real;
pub mod root;
pub mod stiff;
pub mod turning;
pub mod wright;

/// Steps of an iteration, at most: only rounding takes as many. Chosen: a bisection of any bracket of doubles takes fewer.
pub const MAX_STEPS: u32 = 200;

/// Panels of a quadrature, at most. Chosen: 0.1 s; the hardest cases take some hundreds.
pub const MAX_PANELS: u32 = 10_000;

/// Relative difference that counts as rounding. Chosen: that of a few operations.
pub const ROUNDING_RTOL: f64 = 4.0 * f64::EPSILON;

/// Relative difference that counts as the rounding of a quadrature or of an integration. Chosen: ten thousand roundings.
pub const LONG_ROUNDING_RTOL: f64 = 1e-12;

/// `-ln` of a factor that rounding hides. Derived: that of the rounding, 37, and a margin of `e^8`.
pub const NEGLIGIBLE_LN: f64 = 45.0;

/// Exponent, at most, whose exponential and its inverse are numbers. Derived: doubles overflow at 709.
pub const MAX_EXPONENT: f64 = 700.0;

/// Size that stands for an infinite one. Derived: its square is a number, and that of its inverse.
pub const HUGE: f64 = 1e100;

/// Least size that counts as a number; its inverse is one, too. Derived: doubles have fewer digits below 2.2e-308.
pub const LEAST: f64 = 1e-300;
