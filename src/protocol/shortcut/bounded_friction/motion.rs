//! A member over time.

use super::panel::FrictionPanel;
use super::path::{FrictionPath, PathEnd};
use crate::numerics::elementary::exp;
use crate::protocol::{Moment, Motion};

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
        let count = self.panels.len();
        (0..=count).map(|k| k as f64 / count as f64).collect()
    }

    fn at(&self, s: f64) -> Moment {
        let (path, count) = (&self.path, self.panels.len());
        let along = s.clamp(0.0, 1.0) * count as f64;
        let k = (along as usize).min(count - 1);
        let (panel, fraction) = (&self.panels[k], along - k as f64);
        let fraction = if path.forward { fraction } else { 1.0 - fraction };
        let (side, d, w) = (panel.side, panel.distance(fraction), panel.level(fraction));
        let x = if path.forward == (side == PathEnd::Start) { d } else { 1.0 - d };
        Moment {
            t: path.t_f * x,
            v: path.velocity(side, d, w),
            theta: exp(w) / path.end_state(side).v,
            friction: path.friction(side, d),
            beta: None,
            v_c: None,
        }
    }
}
