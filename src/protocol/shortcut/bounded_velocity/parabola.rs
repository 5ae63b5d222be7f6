//! Exponent of `bounded_velocity`: the parabola `f = -z (L + c x)`.

use crate::protocol::profile::{CurvePanel, Exponent, PanelRanges, ProtocolEnd};

/// The parabolic exponent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parabola {
    /// `L = ln((v_f - 1)/(v_i - 1))`.
    pub l: f64,
    /// `c = alpha_3 t_f^2`.
    pub c: f64,
}

impl Parabola {
    /// `x` of the vertex; `None` if it lies outside `(0, 1)`.
    pub fn vertex(&self) -> Option<f64> {
        let x = 0.5 - 0.5 * self.l / self.c;
        (x > 0.0 && x < 1.0).then_some(x)
    }
}

impl Exponent for Parabola {
    const INTERPOLATION: f64 = 0.75;

    fn with(self, c: f64) -> Parabola {
        Parabola { c, ..self }
    }

    #[inline(always)]
    fn value(&self, x: f64, z: f64) -> f64 {
        -z * (self.l + self.c * x)
    }

    #[inline(always)]
    fn slope(&self, x: f64, z: f64) -> f64 {
        self.l - self.c * (z - x)
    }

    #[inline(always)]
    fn sensitivity(x: f64, z: f64) -> f64 {
        x * z
    }

    fn distance_of_variation(&self, x: f64, z: f64, variation: f64) -> f64 {
        let slope = self.slope(x, z);
        2.0 * variation / (slope.abs() + (slope * slope + 4.0 * self.c.abs() * variation).sqrt())
    }

    fn size(&self) -> f64 {
        self.c.abs() + self.l.abs()
    }

    fn parameter_scale(&self) -> f64 {
        if self.c < 0.0 { self.size().min(1.0) } else { self.size() }
    }

    fn newton_step(ratio: f64) -> f64 {
        1.0 - 1.0 / ratio
    }

    fn has_minimum(&self) -> bool {
        self.c > 0.0
    }

    /// The ranges meet at the bottom of a deep minimum, else in the middle; a negligible part is a range of its own.
    fn panel_ranges(&self, level: f64, depth: f64) -> PanelRanges {
        let bottom = self.vertex().filter(|x| self.c > 0.0 && (0.25..=0.75).contains(x));
        let x = bottom.unwrap_or(0.5);
        let is_negligible = self.c > 0.0 && level + self.value(x, 1.0 - x) < depth;
        let crossing = |rise: f64, slope: f64, end: f64| {
            // Nearer root of e0 + slope d + c d^2 = depth, written without cancellation; slope < 0.
            let fall = end - depth;
            let d = 2.0 * fall / (-slope + (slope * slope - 4.0 * self.c * fall).max(0.0).sqrt());
            if fall > 0.0 && d < rise { d } else { 0.0 }
        };
        let whole = |side, meeting| {
            [CurvePanel { side, from: 0.0, to: meeting }, CurvePanel { side, from: meeting, to: meeting }]
        };
        let parts = |side, meeting: f64, slope: f64, end: f64| {
            if !is_negligible {
                return whole(side, meeting);
            }
            let d = crossing(meeting, slope, end);
            [CurvePanel { side, from: 0.0, to: d }, CurvePanel { side, from: d, to: meeting }]
        };
        let [first, second] = parts(ProtocolEnd::Start, x, self.l - self.c, level + self.value(0.0, 1.0));
        let [fourth, third] = parts(ProtocolEnd::End, 1.0 - x, -(self.l + self.c), level);
        PanelRanges { panels: [first, second, third.reversed(), fourth.reversed()] }
    }
}
