//! A member over time.

use super::panel::Panel;
use super::path::{FrictionPath, Side};
use crate::numerics::elementary::exp;
use crate::protocol::{Moment, Motion};

/// Panels in the order of time, of equal length in the parameter `s`.
pub(super) struct Resolution {
    pub path: FrictionPath,
    pub panels: Vec<Panel>,
}

impl Motion for Resolution {
    fn duration(&self) -> f64 {
        self.path.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        let count = self.panels.len();
        (0..=count).map(|k| k as f64 / count as f64).collect()
    }

    fn at(&self, s: f64) -> Moment {
        let count = self.panels.len();
        let along = s.clamp(0.0, 1.0) * count as f64;
        let k = (along as usize).min(count - 1);
        let (panel, share) = (&self.panels[k], along - k as f64);
        let path = self.path.towards(panel.forward);
        let share = if panel.forward { share } else { 1.0 - share };
        let (side, near, (w, z)) = (panel.side, panel.place(share), panel.state(&path, share));
        let x = if panel.forward == (side == Side::Start) { near } else { 1.0 - near };
        Moment {
            t: self.path.t_f * x,
            v: path.velocity(side, w, z),
            theta: exp(w) / path.anchor(side).v,
            friction: path.friction(side, near),
            beta: None,
            v_c: None,
        }
    }
}
