//! The bounds that one chooses: the floor `v >= 1`, a ceiling on the velocity, a ceiling on friction.

/// Bounds of the optimal protocol for `0 < t < t_f`. They do not hold for the steady sliding before and after.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Whether `v >= 1`.
    pub floor: bool,
    /// Largest velocity; infinite for none.
    pub v_ceiling: f64,
    /// Largest friction; infinite for none.
    pub tau_ceiling: f64,
}

impl Bounds {
    /// No ceilings, and `v >= 1` if `floor`.
    pub const fn new(floor: bool) -> Bounds {
        Bounds { floor, v_ceiling: f64::INFINITY, tau_ceiling: f64::INFINITY }
    }

    /// These bounds with a ceiling on the velocity.
    pub const fn with_v_ceiling(self, v_ceiling: f64) -> Bounds {
        Bounds { v_ceiling, ..self }
    }

    /// These bounds with a ceiling on friction.
    pub const fn with_tau_ceiling(self, tau_ceiling: f64) -> Bounds {
        Bounds { tau_ceiling, ..self }
    }

    /// The floor alone.
    pub const fn without_ceilings(self) -> Bounds {
        Bounds::new(self.floor)
    }

    /// Whether both ceilings are numbers, and that of the velocity positive.
    pub(super) fn is_valid(&self) -> bool {
        self.v_ceiling > 0.0 && !self.tau_ceiling.is_nan()
    }

    /// Whether a ceiling is finite.
    pub const fn has_ceilings(&self) -> bool {
        self.v_ceiling != f64::INFINITY || self.tau_ceiling != f64::INFINITY
    }
}

/// The floor or no bound.
impl From<bool> for Bounds {
    fn from(floor: bool) -> Bounds {
        Bounds::new(floor)
    }
}

impl From<&Bounds> for Bounds {
    fn from(bounds: &Bounds) -> Bounds {
        *bounds
    }
}
