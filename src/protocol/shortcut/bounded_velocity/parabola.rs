//! The exponent of `bounded_velocity`: a parabola, `f = -z (L + c x)`.

use crate::protocol::profile::{Exponent, Panel, Side, Stretches};

/// The parabola.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parabola {
    /// `L = ln((v_f - 1)/(v_i - 1))`.
    pub l: f64,
    /// `c = alpha_3 t_f^2`.
    pub c: f64,
}

impl Parabola {
    /// `x` of the vertex, if it lies inside.
    pub fn vertex(&self) -> Option<f64> {
        let x = 0.5 - 0.5 * self.l / self.c;
        (x > 0.0 && x < 1.0).then_some(x)
    }
}

impl Exponent for Parabola {
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
    fn lean(x: f64, z: f64) -> f64 {
        x * z
    }

    fn stride(&self, x: f64, z: f64, variation: f64) -> f64 {
        let slope = self.slope(x, z);
        2.0 * variation / (slope.abs() + (slope * slope + 4.0 * self.c.abs() * variation).sqrt())
    }

    fn size(&self) -> f64 {
        self.c.abs() + self.l.abs()
    }

    fn unit(&self) -> f64 {
        if self.c < 0.0 { self.size().min(1.0) } else { self.size() }
    }

    fn settle(ratio: f64) -> f64 {
        1.0 - 1.0 / ratio
    }

    fn dips(&self) -> bool {
        self.c > 0.0
    }

    /// They meet at the bottom of a deep dip, else in the middle; what is quiet is a stretch of its own.
    fn stretches(&self, level: f64, depth: f64) -> Stretches {
        let bottom = self.vertex().filter(|x| self.c > 0.0 && (0.25..=0.75).contains(x));
        let x = bottom.unwrap_or(0.5);
        let quiet = self.c > 0.0 && level + self.value(x, 1.0 - x) < depth;
        let crossing = |rise: f64, slope: f64, end: f64| {
            // Nearer root of e0 + slope d + c d^2 = depth, written without cancellation; slope < 0.
            let fall = end - depth;
            let d = 2.0 * fall / (-slope + (slope * slope - 4.0 * self.c * fall).max(0.0).sqrt());
            if fall > 0.0 && d < rise { d } else { 0.0 }
        };
        let whole =
            |side, meeting| [Panel { side, from: 0.0, to: meeting }, Panel { side, from: meeting, to: meeting }];
        let parts = |side, meeting: f64, slope: f64, end: f64| {
            if !quiet {
                return whole(side, meeting);
            }
            let d = crossing(meeting, slope, end);
            [Panel { side, from: 0.0, to: d }, Panel { side, from: d, to: meeting }]
        };
        let [first, second] = parts(Side::Start, x, self.l - self.c, level + self.value(0.0, 1.0));
        let [fourth, third] = parts(Side::End, 1.0 - x, -(self.l + self.c), level);
        Stretches { panels: [first, second, third.reversed(), fourth.reversed()] }
    }
}
