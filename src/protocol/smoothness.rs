//! How much of the slip law ends the smoothness of optimal protocols.
//!
//! At a fixed state the velocities trace a curve of the cost `tau v` over the rate `theta' = G(u)`, `u = theta v`. Where it is convex for `G' < 0`, that is
//! `u G''/G' <= a/(tau + a)`, the optimum is smooth; a concave piece is jumped over, or the velocity chatters (docs/derivations.md).

use crate::model::{Law, Transition};
use crate::numerics::MAX_STEPS;
use crate::numerics::elementary::{exp, ln};

/// Greatest fraction of the slip law, in a mixture with the ageing law, for which the cost is convex at the steady states of `v_i` and `v_f`, at every velocity
/// at which the state falls: `a/(a + T)` with the greater steady friction `T`. `None` if that is not positive: every mixture is convex.
pub fn smooth_slip_fraction(transition: &Transition) -> Option<f64> {
    let Law { a, b } = transition.law;
    let [start, end] = [transition.v_i, transition.v_f].map(|v| 1.0 + (a - b) * ln(v));
    let steady = start.max(end);
    (steady > 0.0).then(|| a / (a + steady))
}

/// Least `law_eps` for which the cost is convex at all velocities `v >= 1`, at all states from the lower steady one to 1.
///
/// In `s = 1 - law_eps` the border at the state `theta` is the one root in (0, 1) of the convex `a (theta^(1 - s) - s) - s (1 - s)(1 + a + b ln theta)`, which
/// is positive at 0. It rises with `theta` where friction at the floor is above 0 and `b - a`; `None` where it is not.
pub fn smooth_eps(transition: &Transition) -> Option<f64> {
    let Law { a, b } = transition.law;
    let fastest = transition.v_i.max(transition.v_f);
    let lag = ln(fastest);
    let at_floor = 1.0 - b * lag;
    if at_floor <= (b - a).max(0.0) {
        return None;
    }
    let mut s = 0.0;
    for _ in 0..MAX_STEPS {
        let power = exp(s * lag) / fastest;
        let value = a * (power - s) - s * (1.0 - s) * (a + at_floor);
        let slope = a * (lag * power - 1.0) - (1.0 - 2.0 * s) * (a + at_floor);
        // Newton's method approaches the root of a convex function from below, until rounding.
        let next = s - value / slope;
        if next <= s {
            break;
        }
        s = next;
    }
    Some(1.0 - s)
}
