//! Work and range of the velocity along a pass.

use super::panel::FrictionPanel;
use super::path::{FrictionPath, PathEnd};
use crate::model::Transition;
use crate::numerics::LONG_ROUNDING_RTOL;
use crate::numerics::radau::{NODES, radau};
use crate::protocol::control::{Tolerance, ValueRange};

/// Work and range of the velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct WorkAndVelocity {
    pub work: f64,
    pub v: ValueRange,
    /// Whether the velocity rises at the end of the last panel, and its value there.
    last: Option<(bool, f64)>,
}

impl WorkAndVelocity {
    /// Work and velocity of a transition along the panels of a pass.
    pub fn of(transition: &Transition, path: &FrictionPath, panels: &[FrictionPanel]) -> WorkAndVelocity {
        let Transition { v_i, v_f, .. } = *transition;
        let v = ValueRange { low: v_i.min(v_f), high: v_i.max(v_f) };
        let mut all = WorkAndVelocity { work: 0.0, v, last: None };
        panels.iter().for_each(|panel| all.add(&path.towards(panel.forward), panel));
        all
    }

    /// Work and velocity of steady sliding.
    pub fn steady(path: &FrictionPath, v: f64) -> WorkAndVelocity {
        let work = path.friction(PathEnd::Start, 0.0) * v * path.t_f;
        WorkAndVelocity { work, v: ValueRange { low: v, high: v }, last: None }
    }

    /// Adds one panel.
    fn add(&mut self, path: &FrictionPath, panel: &FrictionPanel) {
        let rule = radau();
        let length = (panel.to - panel.from).abs();
        let at =
            |d: f64, w: f64, z: f64| [path.velocity(panel.side, w, z), length * path.ln_v_slope(panel.side, d, w, z)];
        let at_fraction = |u: f64| {
            let (w, z) = panel.state(path, u);
            at(panel.distance(u), w, z)
        };
        let (mut before, mut sum) = ((0.0, at_fraction(0.0)), 0.0);
        // An extremum may lie between two panels, where theta begins to follow the velocity.
        if panel.side == PathEnd::Start && panel.from == 0.0 {
            self.last = None;
        }
        if let Some((_, v)) = self.last.filter(|&(rises, _)| rises != (before.1[1] > 0.0)) {
            self.v.add(v);
        }
        for j in 0..NODES {
            let (d, w, z) = (panel.distance(rule.u[j]), panel.w[j], panel.z[j]);
            sum += rule.w[j] * path.friction(panel.side, d) * path.velocity(panel.side, w, z);
            let after = (rule.u[j], at(d, w, z));
            if (after.1[1] > 0.0) != (before.1[1] > 0.0) {
                self.v.add_interval(before, after, Tolerance::OfValue(LONG_ROUNDING_RTOL), &at_fraction);
            }
            before = after;
        }
        self.last = Some((before.1[1] > 0.0, before.1[0]));
        self.work += path.t_f * length * sum;
    }
}
