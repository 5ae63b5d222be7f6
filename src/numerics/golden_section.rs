//! The minimum of a function in an interval, by golden section.

/// Fraction of the interval that a section keeps. Derived: `(sqrt 5 - 1)/2`.
pub const FRACTION: f64 = 0.618_033_988_749_894_9;

/// Number of sections. Derived: they shrink an interval by 2e-17, below rounding.
const SECTIONS: u32 = 80;

/// Position and value of the minimum of `f` in an interval that contains one.
pub fn least(f: impl Fn(f64) -> f64, (mut low, mut high): (f64, f64)) -> (f64, f64) {
    for _ in 0..SECTIONS {
        let (left, right) = (high - FRACTION * (high - low), low + FRACTION * (high - low));
        if f(left) < f(right) { high = right } else { low = left }
    }
    let middle = 0.5 * (low + high);
    (middle, f(middle))
}
