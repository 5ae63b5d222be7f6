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
