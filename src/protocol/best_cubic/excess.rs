//! The work of a shortcut above the optimum, without subtracting two works.
//!
//! With the value function of the optimal control problem, `W_s - W*` is the integral along the shortcut of the additional cost of its
//! velocity, compared with the optimal feedback `v~` (docs/derivations.md, "The gap without cancellation"):
//!
//! ```text
//! W_s - W* = int a [v ln(v/v~) - v + v~] + lambda (v - v~) dt,    lambda >= 0, and 0 unless v~ is on the floor.
//! ```
//!
//! Both terms are at least 0, so the sum has full relative precision, however small it is.

use crate::model::Transition;
use crate::numerics::adaptive::integrals;
use crate::numerics::cubic::ExactCubic;
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::{ln, ln_1p, phi};
use crate::protocol::cubic::Path;
use crate::protocol::{SolverStats, optimal};

/// Relative difference of two rules on a panel. Chosen: a thousandth of the promised 1e-7.
const INTEGRAL_RTOL: f64 = 1e-10;
/// Negligible error relative to the work, from the rounding of `v - v~`. Derived: the promised absolute error of the gap.
const NEGLIGIBLE_ERROR: f64 = 1e-20;
/// Halvings that locate the kink where the feedback leaves the floor. Chosen: 2^-30 is below the promised error.
const MAX_BISECTIONS: u32 = 30;
/// Fraction of the shortcut's velocity below which that of the optimum may underflow. Chosen; the budgets of `best_cubic` judge it.
const MIN_DENSITY: f64 = 1e-3;
/// Ratio of the lengths of successive panels towards an end. Chosen: a graded mesh resolves the layer with a few panels.
const PANEL_RATIO: f64 = 0.2;

/// A path relative to one of its ends: polynomials in the distance from it, `x` or `1 - x`, which keep their digits where it is short.
struct EndPolynomials {
    /// From the end, else from the start.
    from_end: bool,
    theta: [f64; 4],
    /// `1 - theta`.
    rest: [f64; 4],
    /// `theta - theta_1`.
    drop: [f64; 4],
    n: [f64; 4],
    /// `t_f theta (v - 1)`, which keeps its digits near the floor.
    surplus: [f64; 4],
    /// The [`optimal::Position`].
    margin: [f64; 4],
}

impl EndPolynomials {
    fn of(path: &Path, bounded: bool, from_end: bool) -> EndPolynomials {
        let theta = path.exact_theta();
        let one = DoubleDouble::new(1.0);
        let theta_1 = path.ends.theta_1;
        let rest = ExactCubic { c: [one - theta.c[0], -theta.c[1], -theta.c[2], -theta.c[3]] };
        let drop = ExactCubic { c: [theta.c[0] - theta_1, theta.c[1], theta.c[2], theta.c[3]] };
        // (1 - x) t_f, times 1 - theta_1 under the bound, and the drop.
        let time = DoubleDouble::new(path.ends.t_f) * if bounded { one - theta_1 } else { one };
        let margin = ExactCubic { c: [drop.c[0] + time, drop.c[1] - time, drop.c[2], drop.c[3]] };
        let about = |cubic: &ExactCubic| {
            let [c0, c1, c2, c3] = cubic.about(if from_end { 1.0 } else { 0.0 });
            if from_end { [c0, -c1, c2, -c3] } else { [c0, c1, c2, c3] }
        };
        let mut side = EndPolynomials {
            from_end,
            theta: about(&theta),
            rest: about(&rest),
            drop: about(&drop),
            n: about(&path.exact_n()),
            surplus: about(&path.exact_surplus(1.0)),
            margin: about(&margin),
        };
        if from_end {
            (side.drop[0], side.margin[0]) = (0.0, 0.0);
        }
        side
    }
}

/// The excess of a shortcut, as a density.
struct Excess<'a> {
    transition: &'a Transition,
    t_f: f64,
    bounded: bool,
    stats: &'a mut SolverStats,
}

impl Excess<'_> {
    /// The density at a distance from one side, and whether the optimum is on the floor there.
    fn judge(&mut self, side: &EndPolynomials, distance: f64) -> Option<(f64, bool)> {
        let at = |[c0, c1, c2, c3]: [f64; 4]| c0 + distance * (c1 + distance * (c2 + distance * c3));
        let time_left = self.t_f * if side.from_end { distance } else { 1.0 - distance };
        let (theta, rest, drop, margin) = (at(side.theta), at(side.rest), at(side.drop), at(side.margin));
        let v = at(side.n).max(0.0) / (self.t_f * theta);
        let position = optimal::Position { theta, rest, drop, time_left, margin };
        let Transition { law, v_f, .. } = *self.transition;
        let best = optimal::feedback(law, v_f, position, self.bounded, optimal::MOTION_RTOL, self.stats)?;
        let dearer = if best.v > MIN_DENSITY * v {
            best.v * entropy((v - best.v) / best.v)
        } else {
            v * (ln(v) - best.ln_v - 1.0) + best.v
        };
        let pressed = best.pressure * at(side.surplus).max(0.0) / (self.t_f * theta);
        Some((law.a * dearer + pressed, best.pressure > 0.0))
    }

    /// The point in its half of the path at which an optimum leaves the floor, by bisection; `None` if it is elsewhere.
    fn kink(&mut self, side: &EndPolynomials) -> Option<Option<f64>> {
        let (mut held, mut free) = if side.from_end { (0.5, 0.0) } else { (0.0, 0.5) };
        // At the end no time is left for the floor.
        if !self.judge(side, held)?.1 || (!side.from_end && self.judge(side, free)?.1) {
            return Some(None);
        }
        for _ in 0..MAX_BISECTIONS {
            let middle = 0.5 * (held + free);
            if self.judge(side, middle)?.1 {
                held = middle;
            } else {
                free = middle;
            }
        }
        Some(Some(free))
    }
}

/// `W_s - W*` of a shortcut that costs `work`; `None` where the optimal feedback is not available along it.
pub(super) fn over_optimum(
    transition: &Transition,
    path: &Path,
    work: f64,
    bounded: bool,
    stats: &mut SolverStats,
) -> Option<f64> {
    let t_f = path.ends.t_f;
    let mut excess = Excess { transition, t_f, bounded, stats };
    let negligible = NEGLIGIBLE_ERROR * work / t_f / INTEGRAL_RTOL;
    let mut sum = 0.0;
    for from_end in [false, true] {
        let side = EndPolynomials::of(path, bounded, from_end);
        let mut places = layers(&side, t_f);
        // Time at the floor may end before the first node. Elsewhere, both rules may agree by chance.
        places.extend(excess.kink(&side)?);
        places.sort_by(f64::total_cmp);
        let panels = places.windows(2).map(|ends| (ends[0], ends[1] - ends[0])).collect();
        let density = |distance| Some([excess.judge(&side, distance)?.0]);
        sum += integrals(density, panels, &[negligible], INTEGRAL_RTOL)?.0[0];
    }
    Some(t_f * sum)
}

/// Ends of panels that become shorter towards the end of a side, down to the length over which theta or the velocity changes: by the slope of
/// theta, and by the time in which contacts are renewed.
fn layers(side: &EndPolynomials, t_f: f64) -> Vec<f64> {
    let [theta, slopes @ ..] = side.theta;
    let thin = theta / (theta + t_f + slopes.iter().map(|slope| slope.abs()).sum::<f64>());
    let mut places = vec![0.0, 0.5];
    let mut width = 0.5 * PANEL_RATIO;
    while width > thin {
        places.push(width);
        width *= PANEL_RATIO;
    }
    places.sort_by(f64::total_cmp);
    places
}

/// `(1 + r) ln(1 + r) - r`, without cancellation near 0.
fn entropy(r: f64) -> f64 {
    if r > -1.0 { (1.0 + r) * phi(-ln_1p(r)) } else { 1.0 }
}
