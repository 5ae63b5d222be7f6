//! The compliant shortcut over time, with the control velocity that drives it.

use crate::protocol::profile::{Hermite, ResolvedPanel, ResolvedProfile};
use crate::protocol::{Jet, Moment, Motion, SpringBlock, interval_at};

/// The shortcut in consecutive panels; it is smooth on the scale of a panel.
pub struct CompliantPath {
    /// The block on its spring.
    pub slider: SpringBlock,
    pub(super) resolution: ResolvedProfile<Hermite>,
}

impl CompliantPath {
    /// Number of panels.
    pub fn panels(&self) -> usize {
        self.resolution.panels.len()
    }

    /// Duration of a panel, in `l/v_0`.
    pub fn panel_duration(&self, panel: usize) -> f64 {
        self.resolution.panels[panel].duration(&self.resolution.curve)
    }

    /// State at the fraction `u` of a panel.
    pub fn jet(&self, panel: usize, u: f64) -> Jet {
        self.resolution.panels[panel].jet(&self.resolution.curve, u)
    }

    /// State at the end.
    pub fn end(&self) -> Jet {
        self.jet(self.panels() - 1, 1.0)
    }

    /// State at a time, clamped to `[0, t_f]`.
    pub fn at_time(&self, t: f64) -> Jet {
        let ResolvedProfile { curve, panels, .. } = &self.resolution;
        let start = |panel: &ResolvedPanel| curve.t_f * panel.x_and_z(0.0).0;
        let panel = panels.partition_point(|panel| start(panel) <= t).max(1) - 1;
        let u = (t - start(&panels[panel])) / self.panel_duration(panel);
        self.jet(panel, u.clamp(0.0, 1.0))
    }
}

impl Motion for CompliantPath {
    fn duration(&self) -> f64 {
        self.resolution.duration()
    }

    fn landmarks(&self) -> Vec<f64> {
        self.resolution.landmarks()
    }

    fn at(&self, s: f64) -> Moment {
        let (panel, u) = interval_at(s, self.panels());
        let v_c = self.slider.control(&self.jet(panel, u));
        Moment { v_c: Some(v_c), ..self.resolution.at(s) }
    }
}
