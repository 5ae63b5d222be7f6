//! One panel for each of eight shortcuts at a time: the zeros and the power map that suits most of a landscape, without a branch.
//!
//! The same estimate as in [`rules`](super::rules), restricted to what is cheap: the straight rule, and the maps `x = r ± s^2`, `s^4`, `s^8` about the
//! shadow of the most hindering zero on the real axis beyond the nearer end. Where that asks for many nodes, `rules` looks further.

use multiversion::multiversion;

use super::path::{Ends, Path};
use super::rules::{FAR, ZEROS, complex_sqrt, zeros};
use crate::numerics::lanes::{LANES, Lanes};

/// The panels over `[0, 1]` of eight shortcuts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    /// Focal sum that the map reaches.
    pub focal: Lanes,
    /// log2 of the power, 0 for the straight rule.
    pub squarings: Lanes,
    /// Which end the power map grows from: +1 the upper, -1 the lower.
    pub side: Lanes,
    /// Distance of the centre of the map from that end.
    pub gap: Lanes,
    /// Bounds of the mapped variable; without meaning for the straight rule.
    pub from: Lanes,
    pub to: Lanes,
}

/// Largest map tried.
const MOST_SQUARINGS: u32 = 3;

/// Chooses the panels of the shortcuts `(a_2[i], a_3[i])`, all feasible. No better map is sought from the focal sum `plain` on.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub(super) fn plan(ends: &Ends, a_2: &Lanes, a_3: &Lanes, plain: f64) -> Plan {
    let (mut re, mut im) = ([[0.0; LANES]; ZEROS], [[0.0; LANES]; ZEROS]);
    for i in 0..LANES {
        let zeros = zeros(&Path::new(ends, a_2[i], a_3[i]));
        for k in 0..ZEROS {
            (re[k][i], im[k][i]) = (zeros.re[k], zeros.im[k]);
        }
    }
    let mut plan = Plan {
        focal: [FAR; LANES],
        squarings: [0.0; LANES],
        side: [1.0; LANES],
        gap: [0.0; LANES],
        from: [0.0; LANES],
        to: [0.0; LANES],
    };
    // The most hindering zero names the end and the centre.
    let mut shadow = [0.0; LANES];
    let mut least = [FAR * FAR; LANES];
    for k in 0..ZEROS {
        for i in 0..LANES {
            let square = ellipse(re[k][i], im[k][i], 0.0, 1.0);
            let nearer = square < least[i];
            least[i] = if nearer { square } else { least[i] };
            shadow[i] = if nearer { re[k][i] } else { shadow[i] };
        }
    }
    let (mut near, mut far) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        plan.focal[i] = 2.0 * least[i].sqrt();
        let upper = shadow[i] > 0.5;
        let beyond = if upper { shadow[i] - 1.0 } else { -shadow[i] };
        plan.side[i] = if upper { 1.0 } else { -1.0 };
        plan.gap[i] = if beyond > 0.0 { beyond } else { 0.0 };
        near[i] = plan.gap[i];
        far[i] = plan.gap[i] + 1.0;
    }
    for k in 0..ZEROS {
        for i in 0..LANES {
            let end = if plan.side[i] > 0.0 { 1.0 - re[k][i] } else { re[k][i] };
            re[k][i] = plan.gap[i] + end;
        }
    }
    for squarings in 1..=MOST_SQUARINGS {
        // A lane goes on only for its own sake, so that it does not depend on its neighbours.
        let going: Lanes = plan.focal.map(|focal| if focal < plain { 1.0 } else { 0.0 });
        if going == [0.0; LANES] {
            break;
        }
        let mut least = [FAR * FAR; LANES];
        for i in 0..LANES {
            near[i] = near[i].sqrt();
            far[i] = far[i].sqrt();
        }
        for k in 0..ZEROS {
            for i in 0..LANES {
                let (x, y) = complex_sqrt(re[k][i], im[k][i]);
                (re[k][i], im[k][i]) = (x, y);
                let square = ellipse(x, y, near[i], far[i]);
                least[i] = if square < least[i] { square } else { least[i] };
            }
        }
        for i in 0..LANES {
            let focal = 2.0 * least[i].sqrt() / (far[i] - near[i]);
            let better = going[i] * focal > plan.focal[i];
            plan.focal[i] = if better { focal } else { plan.focal[i] };
            plan.squarings[i] = if better { f64::from(squarings) } else { plan.squarings[i] };
            plan.from[i] = if better { near[i] } else { plan.from[i] };
            plan.to[i] = if better { far[i] } else { plan.to[i] };
        }
    }
    plan
}

/// Square of the sum of the distances of `x + iy` from both ends of `[from, to]`.
#[inline(always)]
fn ellipse(x: f64, y: f64, from: f64, to: f64) -> f64 {
    let (u, v, y2) = (x - from, x - to, y * y);
    let (u2, v2) = (u * u + y2, v * v + y2);
    u2 + v2 + 2.0 * (u2 * v2).sqrt()
}
