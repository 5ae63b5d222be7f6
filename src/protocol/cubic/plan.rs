//! One panel for each of eight shortcuts at a time: the zeros and the power map that suits most of a landscape, without
//! a branch.
//!
//! The same estimate as in [`rules`](super::rules), restricted to what is cheap: the straight rule, and the maps `x = r
//! ± s^2`, `s^4`, `s^8` about the shadow of the most hindering zero on the real axis beyond the nearer end. Where that
//! asks for many nodes, `rules` looks further.

use multiversion::multiversion;

use super::path::{Ends, Path};
use super::rules::{FAR, ZEROS, complex_sqrt, zeros};

/// The panels over `[0, 1]` of eight shortcuts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    /// Focal sum that the map reaches.
    pub focal: Block,
    /// log2 of the power, 0 for the straight rule.
    pub squarings: Block,
    /// Which end the power map grows from: +1 the upper, -1 the lower.
    pub side: Block,
    /// Distance of the centre of the map from that end.
    pub gap: Block,
    /// Bounds of the mapped variable; without meaning for the straight rule.
    pub from: Block,
    pub to: Block,
}

/// Shortcuts that are planned together: enough to hide the latency of square roots, few enough to be filled.
pub(super) const BLOCK: usize = 32;

/// One value a shortcut.
pub(super) type Block = [f64; BLOCK];

/// Largest map tried.
const MOST_SQUARINGS: u32 = 3;

/// Chooses the panels of the shortcuts `(a_2[i], a_3[i])`, all feasible. No better map is sought from the focal sum
/// `plain` on.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub(super) fn plan(ends: &Ends, a_2: &Block, a_3: &Block, plain: f64) -> Plan {
    let (mut re, mut im) = ([[0.0; BLOCK]; ZEROS], [[0.0; BLOCK]; ZEROS]);
    for i in 0..BLOCK {
        let zeros = zeros(&Path::new(ends, a_2[i], a_3[i]));
        for k in 0..ZEROS {
            (re[k][i], im[k][i]) = (zeros.re[k], zeros.im[k]);
        }
    }
    // The most hindering zero names the end and the centre.
    let mut shadow = [0.0; BLOCK];
    let mut least = [FAR * FAR; BLOCK];
    for k in 0..ZEROS {
        for i in 0..BLOCK {
            let square = ellipse(re[k][i], im[k][i], 0.0, 1.0);
            let nearer = square < least[i];
            least[i] = if nearer { square } else { least[i] };
            shadow[i] = if nearer { re[k][i] } else { shadow[i] };
        }
    }
    let (mut focal, mut side, mut gap) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
    let (mut near, mut far) = ([0.0; BLOCK], [0.0; BLOCK]);
    for i in 0..BLOCK {
        focal[i] = 2.0 * least[i].sqrt();
        let upper = shadow[i] > 0.5;
        let beyond = if upper { shadow[i] - 1.0 } else { -shadow[i] };
        side[i] = if upper { 1.0 } else { -1.0 };
        gap[i] = if beyond > 0.0 { beyond } else { 0.0 };
        near[i] = gap[i];
        far[i] = gap[i] + 1.0;
    }
    for re in &mut re {
        for i in 0..BLOCK {
            let end = if side[i] > 0.0 { 1.0 - re[i] } else { re[i] };
            re[i] = gap[i] + end;
        }
    }
    let (mut squarings, mut from, mut to) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
    for level in 1..=MOST_SQUARINGS {
        // A lane goes on only for its own sake, so that it does not depend on its neighbours.
        if focal.iter().all(|&focal| focal >= plain) {
            break;
        }
        let mut least = [FAR * FAR; BLOCK];
        for i in 0..BLOCK {
            near[i] = near[i].sqrt();
            far[i] = far[i].sqrt();
        }
        for k in 0..ZEROS {
            for i in 0..BLOCK {
                let (x, y) = complex_sqrt(re[k][i], im[k][i]);
                (re[k][i], im[k][i]) = (x, y);
                let square = ellipse(x, y, near[i], far[i]);
                least[i] = if square < least[i] { square } else { least[i] };
            }
        }
        let mut reached = [0.0; BLOCK];
        for i in 0..BLOCK {
            reached[i] = 2.0 * least[i].sqrt() / (far[i] - near[i]);
        }
        for i in 0..BLOCK {
            let better = (focal[i] < plain) & (reached[i] > focal[i]);
            focal[i] = if better { reached[i] } else { focal[i] };
            squarings[i] = if better { f64::from(level) } else { squarings[i] };
            from[i] = if better { near[i] } else { from[i] };
            to[i] = if better { far[i] } else { to[i] };
        }
    }
    Plan { focal, squarings, side, gap, from, to }
}

/// Square of the sum of the distances of `x + iy` from both ends of `[from, to]`.
#[inline(always)]
fn ellipse(x: f64, y: f64, from: f64, to: f64) -> f64 {
    let (u, v, y2) = (x - from, x - to, y * y);
    let (u2, v2) = (u * u + y2, v * v + y2);
    u2 + v2 + 2.0 * (u2 * v2).sqrt()
}
