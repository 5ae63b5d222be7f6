//! Linear stability with regularised friction: that of the logarithm with `a f` and `b f`, where `f = tanh(tau_ss/a)`.
//!
//! `v dtau/dv = a f` and `theta dtau/dtheta = b f`, so `k_c = (b - a)(f + m v^2/a)` (docs/derivations.md).

use super::linear::excess_stiffness;
use crate::model::Law;
use crate::model::arcsinh::{reduction, steady_level};
use crate::numerics::elementary::{exp, ln, ln_1p};
use crate::numerics::root::{LAST_STEP_RESIDUAL, Probe, newton};
use crate::numerics::{MAX_STEPS, ROUNDING_RTOL};

/// The law whose logarithmic friction has the same derivatives at steady sliding at `v > 0`: `a f` and `b f`.
pub fn linearised(law: Law, v: f64) -> Law {
    let (f, _) = reduction(steady_level(&law, -ln(v)));
    Law { a: law.a * f, b: law.b * f }
}

/// The greatest velocity, in `v_0`, at which `k` is critical: above it steady sliding is unstable. `None` for `b <= a`, a rigid spring and `m = 0`,
/// and where `k` is below critical at all velocities.
///
/// Unlike with the logarithm there may be lesser ones, since `f` falls with the velocity: `k_c` has a greatest and then a least value over `v`, or
/// neither (docs/derivations.md, "Regularised friction").
pub fn critical_velocity(law: Law, k: f64, m: f64) -> Option<f64> {
    let Law { a, b } = law;
    let (weakening, gain) = (b - a, (b - a) / a);
    // k is critical where k/(b - a) - f = mass.
    let (ratio, spare) = (k / weakening, excess_stiffness(law, k) / weakening);
    let ln_mass = |x: f64| 2.0 * x + ln(m / a);
    let highest = 0.5 * (ln(ratio) - ln(m / a));
    if !(b > a && m > 0.0 && highest.is_finite()) {
        return None;
    }
    let reduced = |x: f64| {
        let over = ln_over(&law, x);
        let (f, rest) = (exp(-0.5 * soft_plus(-over)), exp(-soft_plus(over)));
        // Either keeps its digits: rest is 1 - f^2.
        (if ratio < 0.5 { ratio - f } else { spare + rest / (1.0 + f) }, f * rest)
    };
    let is_below = |x: f64| ln_mass(x) < ln(reduced(x).0.max(0.0));
    let least = least_stiffness(&law, ln_mass(0.0), highest);
    let bracket = match least {
        Some(least) if is_below(least) => (least, highest),
        _ if spare > 0.0 => (0.5 * (ln(spare) - ln(m / a)), least.unwrap_or(highest)),
        _ => return None,
    };
    let probe = |x: f64| {
        let (left, fall) = reduced(x);
        Some(Probe { value: ln_mass(x) - ln(left), slope: 2.0 - gain * fall / left })
    };
    newton(probe, bracket.1, bracket, true, LAST_STEP_RESIDUAL).map(|root| exp(root.x))
}

/// `ln(f^2/(1 - f^2))` at steady sliding with `ln v = x`.
fn ln_over(&Law { a, b }: &Law, x: f64) -> f64 {
    2.0 * ((1.0 - (b - a) * x) / a - std::f64::consts::LN_2)
}

/// `ln(1 + e^y)`.
fn soft_plus(y: f64) -> f64 {
    y.max(0.0) + ln_1p(exp(-y.abs()))
}

/// `ln v` of the least `k_c`, if it is below `highest`; `ln_mass` is `ln(m/a)`.
///
/// There the logarithm of `-df/dx` over `d(mass)/dx` falls through 0. It is concave, so that Newton's method comes down to it from above.
fn least_stiffness(law: &Law, ln_mass: f64, highest: f64) -> Option<f64> {
    let gain = (law.b - law.a) / law.a;
    let mut x = highest;
    for _ in 0..MAX_STEPS {
        let over = ln_over(law, x);
        let value = ln(0.5 * gain) - soft_plus(over) - 0.5 * soft_plus(-over) - ln_mass - 2.0 * x;
        let slope = 2.0 * (gain - 1.0) - 3.0 * gain * exp(-soft_plus(over));
        if value >= 0.0 {
            return (x < highest).then_some(x);
        }
        if slope >= 0.0 {
            return None;
        }
        let step = value / slope;
        if step <= ROUNDING_RTOL * (1.0 + x.abs()) {
            return Some(x);
        }
        x -= step;
    }
    None
}
