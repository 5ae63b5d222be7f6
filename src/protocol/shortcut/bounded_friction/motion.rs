//! A member over time.

use super::panel::FrictionPanel;
use super::path::{FrictionPath, PathEnd};
use crate::numerics::elementary::exp;
use crate::protocol::{Moment, Motion, equal_landmarks, interval_at};

/// Member as a motion: panels in the order of time, of equal length in the parameter `s`.
pub(super) struct BoundedFrictionMotion {
    pub path: FrictionPath,
    pub panels: Vec<FrictionPanel>,
}

impl Motion for BoundedFrictionMotion {
    fn duration(&self) -> f64 {
        self.path.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        equal_landmarks(self.panels.len())
    }

    fn at(&self, s: f64) -> Moment {
        let (k, fraction) = interval_at(s, self.panels.len());
        let panel = &self.panels[k];
        let path = self.path.towards(panel.forward);
        let fraction = if panel.forward { fraction } else { 1.0 - fraction };
        let (side, d, (w, z)) = (panel.side, panel.distance(fraction), panel.state(&path, fraction));
        let x = if panel.forward == (side == PathEnd::Start) { d } else { 1.0 - d };
        Moment {
            t: self.path.t_f * x,
            v: path.velocity(side, w, z),
            theta: exp(w) / path.end_state(side).v,
            friction: path.friction(side, d),
            beta: None,
            v_c: None,
        }
    }
}
