//! Work and range of the velocity along a pass.

use super::panel::FrictionPanel;
use super::path::{FrictionPath, PathEnd};
use crate::model::Transition;
use crate::numerics::radau::{NODES, radau};
use crate::protocol::control::ValueRange;

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
        let (mut before, mut sum) = (0.0, 0.0);
        let (_, z) = panel.state(path, 0.0);
        let mut bend_before = path.ln_v_slope(panel.side, panel.from, panel.start, z);
        // An extremum may lie between two panels, where theta begins to follow the velocity.
        if panel.side == PathEnd::Start && panel.from == 0.0 {
            self.last = None;
        }
        if let Some((_, v)) = self.last.filter(|&(rises, _)| rises != (bend_before > 0.0)) {
            self.v.add(v);
        }
        for j in 0..NODES {
            let (d, w, z) = (panel.distance(rule.u[j]), panel.w[j], panel.z[j]);
            sum += rule.w[j] * path.friction(panel.side, d) * path.velocity(panel.side, w, z);
            let ln_v_slope = path.ln_v_slope(panel.side, d, w, z);
            if (ln_v_slope > 0.0) != (bend_before > 0.0) {
                self.add_extremum(path, panel, (before, rule.u[j]), bend_before > 0.0);
            }
            (before, bend_before) = (rule.u[j], ln_v_slope);
        }
        self.last = Some((bend_before > 0.0, path.velocity(panel.side, panel.w[NODES - 1], panel.z[NODES - 1])));
        self.work += path.t_f * (panel.to - panel.from).abs() * sum;
    }

    /// Adds the extremum between two fractions of a panel, by bisection.
    fn add_extremum(
        &mut self,
        path: &FrictionPath,
        panel: &FrictionPanel,
        (mut low, mut high): (f64, f64),
        rising: bool,
    ) {
        for _ in 0..MAX_HALVINGS {
            let middle = 0.5 * (low + high);
            let (w, z) = panel.state(path, middle);
            if (path.ln_v_slope(panel.side, panel.distance(middle), w, z) > 0.0) == rising {
                low = middle;
            } else {
                high = middle;
            }
        }
        let (w, z) = panel.state(path, low);
        self.v.add(path.velocity(panel.side, w, z));
    }
}

/// Bisections for an extremum. Derived: the error of its value is quadratic in the width of the bracket.
const MAX_HALVINGS: u32 = 28;
