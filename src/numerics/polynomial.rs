//! All real roots of a polynomial on an interval, each bracketed between roots of its derivative.

use super::root::{LAST_STEP_RESIDUAL, Probe, newton};

/// The value of `c[0] + c[1] x + c[2] x^2 + …` at `x`, and its slope.
pub fn value_and_slope(c: &[f64], x: f64) -> (f64, f64) {
    c.iter().rev().fold((0.0, 0.0), |(value, slope), &c| (value * x + c, slope * x + value))
}

/// The sign changes of the polynomial in `(low, high)` in ascending order, each as accurate as rounding of the polynomial allows.
pub fn roots_between(c: &[f64], low: f64, high: f64) -> Vec<f64> {
    if c.len() < 2 {
        return Vec::new();
    }
    let derivative: Vec<f64> = c.iter().enumerate().skip(1).map(|(k, &c)| k as f64 * c).collect();
    let mut ends = roots_between(&derivative, low, high);
    ends.insert(0, low);
    ends.push(high);
    ends.windows(2).filter_map(|piece| root_of_monotone(c, piece[0], piece[1])).collect()
}

/// The sign change of a polynomial without extrema in `(low, high)`; `None` if there is none.
fn root_of_monotone(c: &[f64], low: f64, high: f64) -> Option<f64> {
    let (first, last) = (value_and_slope(c, low).0, value_and_slope(c, high).0);
    let rises = last.signum();
    let probe = |x: f64| {
        let (value, slope) = value_and_slope(c, x);
        Some(Probe { value: rises * value, slope: rises * slope })
    };
    if first * rises >= 0.0 || last == 0.0 {
        return None;
    }
    let enough = LAST_STEP_RESIDUAL * first.abs().min(last.abs());
    newton(probe, 0.5 * (low + high), (low, high), true, enough).map(|root| root.x)
}
