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

#[cfg(test)]
mod tests {
    //! The borders compared with the sign of the curvature by differences.

    use super::*;

    /// Rate of the state and cost `tau v` at `u`, at the state 1/`v`.
    type Curve<'a> = &'a dyn Fn(f64) -> [f64; 2];

    /// The sign of the curvature of the cost over the rate at `u`, from three points.
    fn curvature(curve: Curve<'_>, u: f64) -> f64 {
        let [[g0, c0], [g1, c1], [g2, c2]] = [u * (1.0 - 1e-3), u, u * (1.0 + 1e-3)].map(curve);
        ((c2 - c1) / (g2 - g1) - (c1 - c0) / (g1 - g0)) / (g2 - g0)
    }

    #[test]
    fn curvature_by_differences_changes_sign_at_the_borders() {
        for (a, b, v) in [(0.03, 0.05, 4.0), (0.1, 0.02, 50.0), (0.003, 0.006, 300.0), (0.3, 0.35, 1.5)] {
            let transition = Transition { law: Law { a, b }, v_i: v, v_f: v };
            let cost = |u: f64| v * u * (1.0 - b * v.ln() + a * (u * v).ln());
            let fraction = smooth_slip_fraction(&transition).expect("is positive");
            let eps = smooth_eps(&transition).expect("has friction");
            for (shift, sign) in [(1.0 - 1e-2, 1.0), (1.0 + 1e-2, -1.0)] {
                let mixed = shift * fraction;
                let mixture = |u: f64| [(1.0 - mixed) * (1.0 - u) - mixed * u * u.ln(), cost(u)];
                for u in [0.5, 1.0, 30.0, 1e4] {
                    assert_eq!(curvature(&mixture, u).signum(), sign, "{a} {b} {v} {u}");
                }
                let slip = shift * (1.0 - eps);
                let interpolated = |u: f64| [(u.powf(slip) - u) / (1.0 - slip), cost(u)];
                assert_eq!(curvature(&interpolated, 1.0 / v).signum(), sign, "{a} {b} {v}");
                if sign > 0.0 {
                    for u in [2.0 / v, 1.0, 10.0, 1e4] {
                        assert_eq!(curvature(&interpolated, u).signum(), 1.0, "{a} {b} {v} {u}");
                    }
                }
            }
        }
        assert_eq!(smooth_eps(&Transition { law: Law { a: 0.03, b: 0.5 }, v_i: 2.0, v_f: 1e3 }), None);
    }
}
