//! The scales of the model, and its units in SI.

/// The four scales that make the model dimensionless.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Friction coefficient at the velocity `v_0`, `mu_0 > 0`.
    pub mu_0: f64,
    /// Critical slip distance `D_c`, in m.
    pub l: f64,
    /// Velocity above which the friction law holds, in m/s.
    pub v_0: f64,
    /// Normal stress `sigma` on the interface, in Pa.
    pub normal_stress: f64,
}

/// The units in which values are given and reported.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Units {
    /// Units of the model: velocities in `v_0`, lengths in `l`, stresses in `mu_0 sigma`.
    #[default]
    Scaled,
    /// SI units for these scales. Masses, stiffnesses and work are per area of the interface.
    Si(Scales),
}

/// Size of a unit of the model in SI.
type Size = fn(&Scales) -> f64;

/// Every unit of the model that a column may have, its SI unit and its size.
const UNITS: [(&str, &str, Size); 17] = [
    ("1", "1", |_| 1.0),
    ("mu_0", "1", |s| s.mu_0),
    ("l/v_0", "s", |s| s.l / s.v_0),
    ("v_0/l", "1/s", |s| s.v_0 / s.l),
    ("v_0", "m/s", |s| s.v_0),
    ("mu_0 sigma", "Pa", |s| s.mu_0 * s.normal_stress),
    ("mu_0 sigma/l", "Pa/m", |s| s.mu_0 * s.normal_stress / s.l),
    ("mu_0 sigma l", "J/m^2", |s| s.mu_0 * s.normal_stress * s.l),
    ("mu_0 sigma v_0", "W/m^2", |s| s.mu_0 * s.normal_stress * s.v_0),
    ("mu_0 sigma l/v_0^2", "kg/m^2", |s| s.mu_0 * s.normal_stress * s.l / (s.v_0 * s.v_0)),
    // Derivatives of work with respect to a and b, velocities and friction, and of velocity with respect to theta.
    ("sigma l", "J/m^2", |s| s.normal_stress * s.l),
    ("mu_0 sigma l/v_0", "J s/m^3", |s| s.mu_0 * s.normal_stress * s.l / s.v_0),
    ("l", "m", |s| s.l),
    ("v_0^2/l", "m/s^2", |s| s.v_0 * s.v_0 / s.l),
    // A coefficient of theta relative to the duration alone stays in l/v_0, and has the same value in both systems.
    ("1/t_f", "(l/v_0)/t_f", |_| 1.0),
    ("1/t_f^2", "(l/v_0)/t_f^2", |_| 1.0),
    // The unit differs from row to row: the table converts it.
    ("1; (v_0/l)^2 for bounded_velocity", "1; 1/s^2 for bounded_velocity", |_| 1.0),
];

impl Units {
    /// Size of `unit`, a unit of the model, in these units.
    pub fn size(&self, unit: &str) -> f64 {
        match self {
            Units::Scaled => 1.0,
            Units::Si(scales) => known(unit).map_or(1.0, |(_, _, size)| size(scales)),
        }
    }

    /// Name in these units of `unit`, a unit of the model.
    pub fn name(&self, unit: &'static str) -> &'static str {
        match self {
            Units::Scaled => unit,
            Units::Si(_) => known(unit).map_or(unit, |(_, name, _)| name),
        }
    }

    /// Converts `value` from these units to `unit`, a unit of the model.
    pub fn scaled(&self, unit: &str, value: f64) -> f64 {
        value / self.size(unit)
    }
}

fn known(unit: &str) -> Option<&'static (&'static str, &'static str, Size)> {
    UNITS.iter().find(|(name, ..)| *name == unit)
}

/// Whether `unit` is a unit of the model, or empty for words.
pub fn is_known(unit: &str) -> bool {
    unit.is_empty() || known(unit).is_some()
}
