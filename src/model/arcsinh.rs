//! Regularised friction: an inverse hyperbolic sine instead of the logarithm, so that friction is positive at every velocity and 0 at rest.
//!
//! `tau = a asinh(v/2 exp((1 + b ln theta)/a))` (Rice and Ben-Zion 1996; Lapusta et al. 2000), with the ageing law. Everything depends on the
//! *level* `L = ln v + (1 + b ln theta)/a`, the friction of the logarithm over `a`.

use super::Law;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};

/// The form of the direct effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Friction {
    /// `tau = 1 + a ln v + b ln theta`, for velocities above `v_0`.
    #[default]
    Log,
    /// `tau = a asinh(v/2 exp((1 + b ln theta)/a))`, for all velocities.
    Regularised,
}

impl Friction {
    /// Both forms.
    pub const ALL: [Friction; 2] = [Friction::Log, Friction::Regularised];

    /// Word for the form in a spec.
    pub fn name(self) -> &'static str {
        match self {
            Friction::Log => "log",
            Friction::Regularised => "regularised",
        }
    }

    /// The form with this word.
    pub fn find(name: &str) -> Option<Friction> {
        Friction::ALL.into_iter().find(|friction| friction.name() == name)
    }

    /// Friction, in `mu_0`, at `ln v` and `ln theta`.
    pub fn at(self, law: &Law, ln_v: f64, ln_theta: f64) -> f64 {
        match self {
            Friction::Log => 1.0 + law.a * ln_v + law.b * ln_theta,
            Friction::Regularised => law.a * scaled_friction(ln_v + (1.0 + law.b * ln_theta) / law.a),
        }
    }
}

/// The level of steady sliding at `ln theta`.
pub fn steady_level(law: &Law, ln_theta: f64) -> f64 {
    (1.0 + (law.b - law.a) * ln_theta) / law.a
}

/// Friction over `a`, `asinh(e^L/2)`.
pub fn scaled_friction(level: f64) -> f64 {
    if level > 0.0 { level + excess(level) } else { asinh(0.5 * exp(level)) }
}

/// How far [`scaled_friction`] is above the level: `ln((1 + sqrt(1 + 4 e^{-2L}))/2)`.
pub fn excess(level: f64) -> f64 {
    let q = 4.0 * exp(-2.0 * level);
    ln_1p(0.5 * q / (1.0 + (1.0 + q).sqrt()))
}

/// `f = tanh(tau/a)`: the direct effect is `a f`, the evolution effect `b f`; and `1 - f^2`.
pub fn reduction(level: f64) -> (f64, f64) {
    if level > 0.0 {
        let q = 4.0 * exp(-2.0 * level);
        (1.0 / (1.0 + q).sqrt(), q / (1.0 + q))
    } else {
        let z = 0.5 * exp(level);
        (z / (1.0 + z * z).sqrt(), 1.0 / (1.0 + z * z))
    }
}

/// `scaled_friction(level + rise) - scaled_friction(level)`, without cancellation.
pub fn friction_rise(level: f64, rise: f64) -> f64 {
    if level.min(level + rise) > LOG_LEVEL {
        return rise;
    }
    if rise.abs() > 1.0 {
        return scaled_friction(level + rise) - scaled_friction(level);
    }
    // asinh x - asinh y = asinh((x^2 - y^2)/(x sqrt(1 + y^2) + y sqrt(1 + x^2))), both sides over the greater of 1 and y.
    let grow = exp(rise);
    let (unit, y) = if level > 0.0 { (2.0 * exp(-level), 1.0) } else { (1.0, 0.5 * exp(level)) };
    let x = y * grow;
    let below = x * (unit * unit + y * y).sqrt() + y * (unit * unit + x * x).sqrt();
    asinh(y * y * exp_m1(2.0 * rise) / below)
}

/// Level above which the logarithm has the same friction. Derived: the excess `e^{-2L}` is below `1e-17`.
pub const LOG_LEVEL: f64 = 20.0;

fn asinh(x: f64) -> f64 {
    let size = x.abs();
    let value =
        if size > 1e8 { ln(2.0 * size) } else { ln_1p(size + size * size / (1.0 + (1.0 + size * size).sqrt())) };
    value.copysign(x)
}
