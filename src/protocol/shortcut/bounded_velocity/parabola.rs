//! Exponent of `bounded_velocity`: the parabola `f = -z (L + c x)`.

use crate::protocol::profile::Exponent;

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
}
