//! The work of a shortcut above the optimum, without subtracting two works.
//!
//! With the value function `V(theta, t)` of the optimal control problem, `W_s - W*` is the integral along the shortcut
//! of what its velocity costs more than the optimal feedback `v~` would there (docs/theory.md, "The gap without
//! cancellation"):
//!
//! ```text
//! W_s - W* = int a [v ln(v/v~) - v + v~] + lambda (v - v~) dt,    lambda >= 0, and 0 unless v~ = 1 is held by the bound.
//! ```
//!
//! Both terms are at least 0, so the sum is good to full relative precision however small it is.

use super::Place;
use crate::model::Transition;
use crate::numerics::elementary::ln_1p;
use crate::numerics::gauss::rule;
use crate::protocol::cubic::Landscape;
use crate::protocol::{Effort, optimal};

/// Relative accuracy of the integral.
const ACCURACY: f64 = 1e-9;
/// Error that counts for nothing, relative to the work: below it the rounding of `v - v~` shows.
const NOTHING: f64 = 1e-20;
/// Relative accuracy of the feedback; an error in it counts quadratically until it comes near `v - v~` itself.
const FEEDBACK: f64 = 1e-12;
/// Nodes of a panel.
const NODES: usize = 12;
/// Most halvings of a panel: kinks where the feedback leaves the bound are caught this closely.
const DEEPEST: u32 = 30;
/// Most panels; smooth cases take two to eight, a kink some thirty.
const MOST_PANELS: u32 = 300;

/// `W_s - W*` of a shortcut that costs `work`; `None` where the optimal feedback is not to be had on the way.
pub(super) fn over_optimum(
    transition: &Transition,
    landscape: &Landscape,
    place: Place,
    work: f64,
    bounded: bool,
    effort: &mut Effort,
) -> Option<f64> {
    let [_, theta_1, _, t_f] = landscape.ends();
    let (theta, n) = landscape.path(place.a_2, place.a_3).about_end();
    let law = transition.law;
    // The density at `delta`, the time before the end in units of `-t_f`, and whether the optimum would hold there.
    let mut judge = |delta: f64| {
        let drop = delta * (theta[1] + delta * (theta[2] + delta * theta[3]));
        let here = theta[0] + drop;
        let v = (n[0] + delta * (n[1] + delta * n[2])).max(0.0) / (t_f * here);
        let best = optimal::feedback(law, here, theta_1, drop / theta_1, -delta * t_f, bounded, FEEDBACK, effort)?;
        let r = (v - best.v) / best.v;
        Some((law.a * best.v * entropy(r) + best.pressure * (v - best.v), best.pressure > 0.0))
    };
    // A hold at the start may be shorter than the distance of the first node from it.
    let mut places = vec![-1.0, 0.0];
    if judge(-1.0)?.1 {
        places.insert(1, kink(&mut |delta| judge(delta).map(|(_, held)| held))?);
    }
    let mut density = |delta: f64| judge(delta).map(|(density, _)| density);
    let wholes = places.windows(2).map(|ends| panel(&mut density, ends[0], ends[1])).collect::<Option<Vec<f64>>>()?;
    let tolerance = ACCURACY * wholes.iter().sum::<f64>().abs() + NOTHING * work / t_f;
    let mut left = MOST_PANELS;
    let mut sum = 0.0;
    for (ends, whole) in places.windows(2).zip(wholes) {
        sum += refine(&mut density, ends[0], ends[1], whole, tolerance, 0, &mut left)?;
    }
    Some(t_f * sum)
}

/// Where the optimum that holds at the start leaves the bound, by bisection.
fn kink(held: &mut impl FnMut(f64) -> Option<bool>) -> Option<f64> {
    let (mut low, mut high) = (-1.0, 0.0);
    for _ in 0..DEEPEST {
        let middle = 0.5 * (low + high);
        if held(middle)? {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(high)
}

/// `(1 + r) ln(1 + r) - r`, without cancellation near 0.
fn entropy(r: f64) -> f64 {
    if r.abs() < 0.1 {
        // sum_k (-r)^k/(k (k - 1)) from k = 2: sixteen terms leave 1e-17 of the first.
        let mut power = r * r;
        let mut sum = 0.0;
        for k in 2..18 {
            let k = f64::from(k);
            sum += power / (k * (k - 1.0));
            power *= -r;
        }
        sum
    } else if r > -1.0 {
        (1.0 + r) * ln_1p(r) - r
    } else {
        1.0
    }
}

fn panel(density: &mut impl FnMut(f64) -> Option<f64>, from: f64, to: f64) -> Option<f64> {
    let rule = rule(NODES);
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let mut sum = 0.0;
    for (x, w) in rule.x.iter().zip(&rule.w) {
        sum += w * density(middle + half * x)?;
    }
    Some(half * sum)
}

/// Halves a panel until its halves agree with it to `tolerance`; `None` once no panels are left.
fn refine(
    density: &mut impl FnMut(f64) -> Option<f64>,
    from: f64,
    to: f64,
    whole: f64,
    tolerance: f64,
    depth: u32,
    left: &mut u32,
) -> Option<f64> {
    *left = left.checked_sub(2)?;
    let middle = 0.5 * (from + to);
    let halves = [panel(density, from, middle)?, panel(density, middle, to)?];
    if (halves[0] + halves[1] - whole).abs() <= tolerance || depth >= DEEPEST {
        return Some(halves[0] + halves[1]);
    }
    let lower = refine(density, from, middle, halves[0], tolerance, depth + 1, left)?;
    Some(lower + refine(density, middle, to, halves[1], tolerance, depth + 1, left)?)
}
