//! Linear stability with regularised friction: that of the logarithm with `a f` and `b f`, where `f = tanh(tau_ss/a)`.
//!
//! `v dtau/dv = a f` and `theta dtau/dtheta = b f`, so `k_c = (b - a)(f + m v^2/a)` (docs/derivations.md).

use super::linear;
use crate::model::Law;
use crate::model::arcsinh::{LOG_LEVEL, reduction, steady_level};
use crate::numerics::MAX_PANELS;
use crate::numerics::elementary::{exp, ln};
use crate::numerics::root::{LAST_STEP_RESIDUAL, Probe, newton};

/// The law whose logarithmic friction has the same derivatives at steady sliding at `v > 0`: `a f` and `b f`.
pub fn linearised(law: Law, v: f64) -> Law {
    let (f, _) = reduction(steady_level(&law, -ln(v)));
    Law { a: law.a * f, b: law.b * f }
}

/// The greatest velocity, in `v_0`, at which `k` is critical: above it steady sliding is unstable. `None` for `b <= a`, a rigid spring and `m = 0`,
/// and where `k` is below critical at all velocities.
///
/// Unlike with the logarithm there may be lesser ones, since `f` falls with the velocity.
pub fn critical_velocity(law: Law, k: f64, m: f64) -> Option<f64> {
    let ratio = k / (law.b - law.a);
    // Without f.
    let highest = 0.5 * ln(law.a * ratio / m);
    if !(law.b > law.a && m > 0.0 && highest.is_finite()) {
        return None;
    }
    let gain = (law.b - law.a) / law.a;
    let probe = |x: f64| {
        let (f, rest) = reduction(steady_level(&law, -x));
        let mass = m * exp(2.0 * x) / law.a;
        Some(Probe { value: (f + mass) / ratio - 1.0, slope: (2.0 * mass - gain * f * rest) / ratio })
    };
    let step = STEP / (1.0 + gain);
    let mut high = highest;
    for _ in 0..MAX_PANELS {
        // At lower velocities f is 1.
        if steady_level(&law, -high) > LOG_LEVEL {
            return linear::critical_velocity(law, k, m);
        }
        let low = high - step;
        if probe(low)?.value < 0.0 {
            return newton(probe, high, (low, high + step), true, LAST_STEP_RESIDUAL).map(|root| exp(root.x));
        }
        high = low;
    }
    None
}

/// Steps of the search in `ln v`, over the scale `a/(b - a)` on which `f` falls, or 1. Chosen: finer than the bend of `f`.
const STEP: f64 = 0.05;
