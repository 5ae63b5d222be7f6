//! Work and the extremes of velocity, gathered along a pass.

use super::panel::Panel;
use super::path::{FrictionPath, Side};
use crate::model::Transition;
use crate::numerics::radau::{NODES, radau};

/// What a pass gathers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub work: f64,
    pub v_min: f64,
    pub v_max: f64,
    /// Whether the velocity rises at the end of the last panel, and what it is there.
    last: Option<(bool, f64)>,
}

impl Extent {
    pub fn new(transition: &Transition) -> Extent {
        let Transition { v_i, v_f, .. } = *transition;
        Extent { work: 0.0, v_min: v_i.min(v_f), v_max: v_i.max(v_f), last: None }
    }

    /// Of steady sliding.
    pub fn steady(path: &FrictionPath, v: f64) -> Extent {
        Extent { work: path.friction(Side::Start, 0.0) * v * path.t_f, v_min: v, v_max: v, last: None }
    }

    /// Adds one panel.
    pub fn add(&mut self, path: &FrictionPath, panel: &Panel) {
        let rule = radau();
        let (mut before, mut sum) = (0.0, 0.0);
        let (_, z) = panel.state(path, 0.0);
        let mut bend_before = path.bend(panel.side, panel.from, panel.start, z);
        // Where theta comes to follow the velocity from one panel to the next, the extremum lies between them.
        if panel.side == Side::Start && panel.from == 0.0 {
            self.last = None;
        }
        if let Some((_, v)) = self.last.filter(|&(rises, _)| rises != (bend_before > 0.0)) {
            self.see(v);
        }
        for j in 0..NODES {
            let (near, w, z) = (panel.place(rule.u[j]), panel.w[j], panel.z[j]);
            sum += rule.w[j] * path.friction(panel.side, near) * path.velocity(panel.side, w, z);
            let bend = path.bend(panel.side, near, w, z);
            if (bend > 0.0) != (bend_before > 0.0) {
                self.turn(path, panel, (before, rule.u[j]), bend_before > 0.0);
            }
            (before, bend_before) = (rule.u[j], bend);
        }
        self.last = Some((bend_before > 0.0, path.velocity(panel.side, panel.w[NODES - 1], panel.z[NODES - 1])));
        self.work += path.t_f * (panel.to - panel.from).abs() * sum;
    }

    /// The extremum between two places of a panel, by bisection.
    fn turn(&mut self, path: &FrictionPath, panel: &Panel, (mut low, mut high): (f64, f64), rising: bool) {
        for _ in 0..MOST_HALVINGS {
            let middle = 0.5 * (low + high);
            let (w, z) = panel.state(path, middle);
            if (path.bend(panel.side, panel.place(middle), w, z) > 0.0) == rising {
                low = middle;
            } else {
                high = middle;
            }
        }
        let (w, z) = panel.state(path, low);
        self.see(path.velocity(panel.side, w, z));
    }

    /// Notes an extremum.
    fn see(&mut self, v: f64) {
        self.v_min = self.v_min.min(v);
        self.v_max = self.v_max.max(v);
    }
}

/// The value at an extremum is off by the square of what is left of the bracket.
const MOST_HALVINGS: u32 = 28;
