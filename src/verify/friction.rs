//! Both forms of friction by their definitions, with the standard library.

use crate::model::{Friction, Law};

/// Level, `ln v + (1 + b ln theta)/a`, above which friction is the logarithm. Derived: the difference, `e^-60`, is below rounding.
const LOG_LEVEL: f64 = 30.0;

/// Friction and its derivatives.
pub struct Terms {
    pub tau: f64,
    /// The derivative by `a ln v`, which is 1 for the logarithm.
    pub reduced: f64,
    pub by_a: f64,
    pub by_b: f64,
}

/// Friction of a form at a velocity and a state.
pub fn terms(form: Friction, law: &Law, v: f64, theta: f64) -> Terms {
    let (ln_v, ln_theta) = (v.ln(), theta.ln());
    if form == Friction::Log {
        return Terms { tau: 1.0 + law.a * ln_v + law.b * ln_theta, reduced: 1.0, by_a: ln_v, by_b: ln_theta };
    }
    let level = ln_v + (1.0 + law.b * ln_theta) / law.a;
    let scaled = if level > LOG_LEVEL { level } else { (0.5 * level.exp()).asinh() };
    let reduced = scaled.tanh();
    let by_a = reduced * ln_v + (scaled - reduced * level);
    Terms { tau: law.a * scaled, reduced, by_a, by_b: reduced * ln_theta }
}

/// `a` and `b` of the logarithm with the same derivatives at steady sliding.
pub fn linearised(form: Friction, law: &Law, v: f64) -> Law {
    let reduced = terms(form, law, v, 1.0 / v).reduced;
    Law { a: law.a * reduced, b: law.b * reduced }
}
