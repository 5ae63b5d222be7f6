//! Work and range of the velocity along a pass.

use super::panel::FrictionPanel;
use super::path::{FrictionPath, PathEnd};
use crate::model::Transition;
use crate::numerics::radau::{NODES, radau};

/// Work and range of the velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct WorkAndVelocity {
    pub work: f64,
    pub v_min: f64,
    pub v_max: f64,
}

/// Bisections for an extremum. Derived: the error of its value is quadratic in the width of the bracket.
const MAX_HALVINGS: u32 = 28;

impl WorkAndVelocity {
    /// Work and velocity of a transition along the panels of a pass.
    pub fn of(transition: &Transition, path: &FrictionPath, panels: &[FrictionPanel]) -> WorkAndVelocity {
        let Transition { v_i, v_f, .. } = *transition;
        if v_i == v_f {
            let work = path.friction(PathEnd::Start, 0.0) * v_i * path.t_f;
            return WorkAndVelocity { work, v_min: v_i, v_max: v_i };
        }
        let mut all = WorkAndVelocity { work: 0.0, v_min: v_i.min(v_f), v_max: v_i.max(v_f) };
        let mut rising = None;
        panels.iter().for_each(|panel| all.add(path, panel, &mut rising));
        all
    }

    /// Adds one panel; `rising` is whether the velocity rises at its start and, then, at its end.
    fn add(&mut self, path: &FrictionPath, panel: &FrictionPanel, rising: &mut Option<bool>) {
        let (rule, side) = (radau(), panel.side);
        let rises_at = |s: f64, w: f64| path.ln_v_slope(side, panel.distance(s), w) > 0.0;
        let (mut before, mut sum) = (0.0, 0.0);
        let nodes = (0..NODES).map(|j| (rule.u[j], panel.w[j], rule.w[j]));
        // An extremum may lie between two panels, where theta begins to follow the velocity.
        for (s, w, weight) in std::iter::once((0.0, panel.start, 0.0)).chain(nodes) {
            let d = panel.distance(s);
            sum += weight * path.friction(side, d) * path.velocity(side, d, w);
            let rises = rises_at(s, w);
            if *rising == Some(!rises) {
                // The extremum, by bisection.
                let (mut low, mut high) = (before, s);
                for _ in 0..MAX_HALVINGS {
                    let middle = 0.5 * (low + high);
                    if rises_at(middle, panel.level(middle)) == rises { high = middle } else { low = middle }
                }
                let v = path.velocity(side, panel.distance(low), panel.level(low));
                (self.v_min, self.v_max) = (self.v_min.min(v), self.v_max.max(v));
            }
            (before, *rising) = (s, Some(rises));
        }
        self.work += path.t_f * (panel.to - panel.from).abs() * sum;
    }
}
