//! What the tests have in common: how far a number is from the expected one, and random numbers.

// Each crate of tests or benchmarks uses some of it.
#![allow(dead_code)]

/// The relative error of a number; 0 where both are the same, 0 and infinity included.
pub fn relative(found: f64, expected: f64) -> f64 {
    if found == expected { 0.0 } else { ((found - expected) / expected).abs() }
}

/// Numbers between 0 and 1 from a fixed linear congruence.
pub fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*state >> 11) as f64 / (1_u64 << 53) as f64
}

/// A sequence of [`uniform`] numbers.
pub struct Random(pub u64);

impl Random {
    /// A uniform number from 0 to 1.
    pub fn next(&mut self) -> f64 {
        uniform(&mut self.0)
    }

    /// A number from `low` to `high`, uniform in its logarithm.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.next())
    }

    /// A whole number from 0 to `end - 1`.
    pub fn below(&mut self, end: usize) -> usize {
        (self.next() * end as f64) as usize
    }
}
