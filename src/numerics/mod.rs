//! Numerical methods, independent of friction.

pub mod adaptive;
pub mod cubic;
pub mod dilogarithm;
pub mod double_double;
pub mod elementary;
pub mod gauss;
pub mod golden_section;
pub mod lambert;
pub mod lanes;
pub mod polynomial;
pub mod radau;
pub mod root;
pub mod stiff;
pub mod turning;
pub mod wright;

/// Steps of an iteration, at most. Chosen: a bisection down to the rounding of its bracket takes 53.
pub const MAX_STEPS: u32 = 200;

/// Panels of a quadrature or other parts of a whole, at most. Chosen: 0.1 s; the hardest cases take some hundreds.
pub const MAX_PANELS: u32 = 10_000;

/// Relative difference that counts as rounding. Chosen: that of a few operations.
pub const ROUNDING_RTOL: f64 = 4.0 * f64::EPSILON;

/// Relative difference that counts as the rounding of a quadrature or of an integration. Chosen: ten thousand roundings.
pub const LONG_ROUNDING_RTOL: f64 = 1e-12;

/// Tightest accuracy that a solver aims at. Chosen: nine hundred roundings, the noise of a long path.
pub const TIGHT_RTOL: f64 = 1e-13;

/// Relative change of a place at which a function with an extremum there changes by rounding. Derived: the root of `f64::EPSILON`.
pub const ROOT_OF_ROUNDING: f64 = 1.5e-8;

/// `-ln` of a factor that rounding hides. Derived: that of the rounding, 37, and a margin of `e^8`.
pub const NEGLIGIBLE_LN: f64 = 45.0;

/// Greatest absolute logarithm of a number. Derived: doubles overflow beyond 709.
pub const MAX_LN: f64 = 700.0;

/// Size that stands for an infinite one. Derived: its square and the square of its inverse are numbers.
pub const MAX_SQUARABLE: f64 = 1e100;

/// Least size above 0. Derived: it and its inverse have all digits, which doubles below 2.2e-308 lack.
pub const MIN_INVERTIBLE: f64 = 1e-300;
