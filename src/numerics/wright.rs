//! The Wright omega function: the principal branch of the Lambert function of an exponential.

use super::elementary::{exp, ln};

/// `omega` with `omega + ln omega = z`, that is `W_0(e^z)`, to a few units in the last place, for `-700 < z < 1e15`.
///
/// Two steps of the fourth-order iteration of Fritsch, Shafer and Crowley (Communications of the ACM 16, 123, 1973) from an estimate within 20 %.
pub fn wright_omega(z: f64) -> f64 {
    let mut omega = if z < -1.5 {
        let x = exp(z);
        if z < -40.0 {
            return x;
        }
        x * (1.0 - x * (1.0 - 1.5 * x))
    } else if z < 1.0 {
        // Of order two about omega = 1 at z = 1.
        let x = exp(0.5 * (z - 1.0));
        x * (1.0 + (1.0 - x) * -0.25).max(0.5)
    } else {
        let l = ln(z);
        z - l + l / z
    };
    for _ in 0..2 {
        let rest = z - omega - ln(omega);
        let sum = 1.0 + omega;
        let scale = 2.0 * sum * (sum + 2.0 / 3.0 * rest);
        omega *= 1.0 + rest / sum * (scale - rest) / (scale - 2.0 * rest);
    }
    omega
}
