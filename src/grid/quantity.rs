//! The quantities a sweep can vary: name, unit, meaning, legal range and default of each.

use std::fmt;

use crate::model::StateLaw;
use crate::protocol::shortcut::FAMILIES;

/// A quantity that can be an axis of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Quantity {
    /// Duration of the protocol.
    Time,
    /// State variable now.
    Theta,
    /// Time left.
    TimeLeft,
    /// Direct effect.
    A,
    /// Evolution effect.
    B,
    /// Evolution law of the state.
    Law,
    /// Interpolation between the slip law, 0, and the ageing law, 1.
    LawEps,
    /// Initial velocity.
    InitialVelocity,
    /// Final velocity.
    FinalVelocity,
    /// Family of shortcuts.
    Family,
    /// Velocity ceiling.
    VelocityCeiling,
    /// Friction ceiling.
    FrictionCeiling,
    /// Linear coefficient of the cubic shortcut.
    Alpha2,
    /// Quadratic coefficient of the cubic shortcut.
    Alpha3,
    /// Stiffness of the spring.
    Stiffness,
    /// Mass of the block.
    Mass,
    /// Time between samples of the control velocity.
    Sampling,
    /// Length of the smooth pieces.
    Smoothing,
}

/// The legal range of a number: an interval, and at most one isolated value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// The name of the number.
    name: &'static str,
    /// The lower end of its interval.
    pub least: f64,
    /// Whether that is excluded.
    pub least_excluded: bool,
    /// The upper end of its interval, which is included.
    pub greatest: f64,
    /// The isolated legal value, 0 or infinity, if any.
    pub apart: Option<f64>,
    /// The meaning of that, for messages.
    note: &'static str,
}

impl Domain {
    /// The numbers from `least` to `greatest`.
    const fn new(name: &'static str, least: f64, greatest: f64) -> Domain {
        Domain { name, least, least_excluded: false, greatest, apart: None, note: "" }
    }

    /// Whether `value` is in the range; NaN never is.
    pub fn contains(&self, value: f64) -> bool {
        let above = if self.least_excluded { value > self.least } else { value >= self.least };
        (above && value <= self.greatest) || self.apart == Some(value)
    }

    /// The range in words, as in `1 < v_i <= 1e12`, with `unit` after the number that `number` makes of the upper end.
    pub fn words(&self, number: impl Fn(f64) -> String, unit: &str) -> String {
        let [least, greatest] = [self.least, self.greatest].map(number);
        let below = if self.least_excluded { "<" } else { "<=" };
        let apart = self.apart.map_or(String::new(), |apart| format!(", or {apart}"));
        format!("{least} {below} {} <= {greatest}{unit}{apart}", self.name)
    }
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_short = |number: f64| number.abs() <= 10.0 && number.fract() == 0.0;
        let number = |number: f64| if is_short(number) { format!("{number}") } else { format!("{number:e}") };
        write!(f, "{}{}", self.words(number, ""), self.note)
    }
}

/// Legal range of every `rtol`. Chosen: rounding of long sums comes near smaller values, and greater ones leave less than two digits.
pub const RTOL: Domain = Domain::new("rtol", 1e-13, 1e-2);

/// The unit of a coefficient axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// The scaled units of the model: the value is the coefficient.
    Model,
    /// Relative to the duration: the coefficient of `t^n` is the value over `t_f^n` (`n = 1` for `alpha_2`, 2 for
    /// `alpha_3`).
    Duration,
}

impl Quantity {
    /// Every quantity; axis columns come in this order.
    pub const ALL: [Quantity; 18] = [
        Quantity::Time,
        Quantity::Theta,
        Quantity::TimeLeft,
        Quantity::A,
        Quantity::B,
        Quantity::Law,
        Quantity::LawEps,
        Quantity::InitialVelocity,
        Quantity::FinalVelocity,
        Quantity::Family,
        Quantity::VelocityCeiling,
        Quantity::FrictionCeiling,
        Quantity::Alpha2,
        Quantity::Alpha3,
        Quantity::Stiffness,
        Quantity::Mass,
        Quantity::Sampling,
        Quantity::Smoothing,
    ];

    /// The quantity of this name.
    pub fn from_name(name: &str) -> Option<Quantity> {
        Quantity::ALL.into_iter().find(|quantity| quantity.name() == name)
    }

    /// Name, unit and meaning.
    fn definition(self) -> [&'static str; 3] {
        match self {
            Quantity::Time => ["t_f", "l/v_0", "duration of the protocol"],
            Quantity::Theta => ["theta", "l/v_0", "state variable now, on the way to steady sliding at v_f"],
            Quantity::TimeLeft => ["t_left", "l/v_0", "time left of the protocol"],
            Quantity::A => ["a", "mu_0", "direct effect: coefficient of ln v in friction"],
            Quantity::B => ["b", "mu_0", "evolution effect: coefficient of ln theta in friction"],
            Quantity::Law => ["law", "", "evolution law of the state; ageing where there is no such column"],
            Quantity::LawEps => {
                ["law_eps", "1", "interpolated evolution law instead of `law`: from slip, 0, to ageing, 1"]
            }
            Quantity::InitialVelocity => ["v_i", "v_0", "velocity of the initial steady state"],
            Quantity::FinalVelocity => ["v_f", "v_0", "velocity of the final steady state"],
            Quantity::Family => ["family", "", "family of shortcuts"],
            Quantity::VelocityCeiling => ["v_ceiling", "v_0", "velocity ceiling between the ends; inf: none"],
            Quantity::FrictionCeiling => ["tau_ceiling", "mu_0 sigma", "friction ceiling between the ends; inf: none"],
            Quantity::Alpha2 => ["alpha_2", "1", "coefficient of t in theta of the cubic shortcut"],
            Quantity::Alpha3 => ["alpha_3", "v_0/l", "coefficient of t^2 in theta of the cubic shortcut"],
            Quantity::Stiffness => ["k", "mu_0 sigma/l", "stiffness of the spring"],
            Quantity::Mass => ["m", "mu_0 sigma l/v_0^2", "mass of the block"],
            Quantity::Sampling => [
                "dt",
                "l/v_0",
                "time between samples of the control velocity, each held until the next; 0: not sampled",
            ],
            Quantity::Smoothing => {
                ["delta_t", "l/v_0", "length of the smooth pieces that replace the jumps of the optimum"]
            }
        }
    }

    /// The name in specs and tables.
    pub fn name(self) -> &'static str {
        self.definition()[0]
    }

    /// Its meaning, in one line.
    pub fn doc(self) -> &'static str {
        self.definition()[2]
    }

    /// Its unit, for values given in `scale`.
    pub fn unit(self, scale: Scale) -> &'static str {
        match (self, scale) {
            (Quantity::Alpha2, Scale::Duration) => "1/t_f",
            (Quantity::Alpha3, Scale::Duration) => "1/t_f^2",
            _ => self.definition()[1],
        }
    }

    /// Whether its values can be given relative to `t_f`.
    pub fn has_scale(self) -> bool {
        matches!(self, Quantity::Alpha2 | Quantity::Alpha3)
    }

    /// Its legal units.
    pub fn scales(self) -> &'static [Scale] {
        if self.has_scale() { &[Scale::Duration, Scale::Model] } else { &[Scale::Model] }
    }

    /// The words of an axis of words, coded by index; empty for a number.
    pub fn words(self) -> Vec<&'static str> {
        match self {
            Quantity::Family => FAMILIES.iter().map(|family| family.name).collect(),
            Quantity::Law => StateLaw::ALL.map(StateLaw::name).into(),
            _ => Vec::new(),
        }
    }

    /// Its legal range: far beyond the physical domain (docs/spec.md), and small enough that products of quantities do not overflow.
    pub fn domain(self) -> Domain {
        let range = |least, greatest| Domain::new(self.name(), least, greatest);
        let or = |apart: f64, note, domain| Domain { apart: Some(apart), note, ..domain };
        let velocity = Domain { least_excluded: true, ..range(1.0, 1e12) };
        match self {
            Quantity::Time | Quantity::Theta | Quantity::TimeLeft | Quantity::Smoothing => range(1e-20, 1e20),
            Quantity::A => range(1e-6, 10.0),
            Quantity::B => range(0.0, 10.0),
            Quantity::LawEps => range(0.0, 1.0),
            Quantity::InitialVelocity | Quantity::FinalVelocity => velocity,
            Quantity::VelocityCeiling => or(f64::INFINITY, ": no ceiling", velocity),
            Quantity::FrictionCeiling => or(f64::INFINITY, ": no ceiling", range(1e-20, 1e20)),
            Quantity::Alpha2 | Quantity::Alpha3 => range(-1e100, 1e100),
            Quantity::Stiffness => or(f64::INFINITY, " (rigid)", range(1e-40, 1e40)),
            Quantity::Mass => or(0.0, "", range(1e-40, 1e40)),
            Quantity::Sampling => or(0.0, ": not sampled", range(1e-20, 1e20)),
            // The indices of the words.
            Quantity::Law | Quantity::Family => range(0.0, (self.words().len() - 1) as f64),
        }
    }

    /// The least and the greatest value of the physical domain (docs/spec.md); `None` if it depends on other quantities alone.
    pub fn physical(self) -> Option<[f64; 2]> {
        match self {
            Quantity::A => Some([1e-3, 0.3]),
            Quantity::B => Some([0.0, 0.5]),
            Quantity::InitialVelocity | Quantity::FinalVelocity => Some([1.001, 1e10]),
            Quantity::Time => Some([0.0, 1e4]),
            // `k/a` from 1e-4 to 1e5.
            Quantity::Stiffness => Some([1e-7, 3e4]),
            _ => None,
        }
    }

    /// Whether a table has its column only if the grid names the axis. Without it, its quantity has the default value.
    pub fn is_tacit(self) -> bool {
        matches!(self, Quantity::Law | Quantity::LawEps)
    }

    /// Its default values; empty if a spec must define it.
    pub fn default(self) -> Vec<f64> {
        match self {
            Quantity::Family => (0..FAMILIES.len()).map(|place| place as f64).collect(),
            Quantity::Stiffness | Quantity::VelocityCeiling | Quantity::FrictionCeiling => vec![f64::INFINITY],
            Quantity::LawEps => vec![1.0],
            Quantity::Law | Quantity::Mass | Quantity::Sampling => vec![0.0],
            _ => Vec::new(),
        }
    }
}

/// The values of all quantities at a point of a grid; NaN for a quantity that is not in the grid.
#[derive(Debug, Clone, Copy)]
pub struct Point([f64; Quantity::ALL.len()]);

impl Default for Point {
    fn default() -> Self {
        Point([f64::NAN; Quantity::ALL.len()])
    }
}

impl Point {
    /// The evolution law of the state; ageing in a grid without the axis.
    pub fn state_law(&self) -> StateLaw {
        // The place of a word is exact; NaN becomes 0.
        StateLaw::ALL.get(self[Quantity::Law] as usize).copied().unwrap_or_default()
    }
}

impl std::ops::Index<Quantity> for Point {
    type Output = f64;

    fn index(&self, quantity: Quantity) -> &f64 {
        &self.0[quantity as usize]
    }
}

impl std::ops::IndexMut<Quantity> for Point {
    fn index_mut(&mut self, quantity: Quantity) -> &mut f64 {
        &mut self.0[quantity as usize]
    }
}

#[cfg(test)]
mod tests {
    //! Ranges agree with the book.

    use super::*;

    #[test]
    fn the_book_has_every_range() {
        let book = include_str!("../../docs/spec.md");
        for quantity in Quantity::ALL.into_iter().filter(|quantity| quantity.words().is_empty()) {
            let domain = quantity.domain();
            let Domain { least, least_excluded, greatest, .. } = domain;
            assert!(book.contains(&format!("| `{}` | {domain} |", quantity.name())), "{domain}");
            for edge in [least, greatest] {
                assert_eq!(domain.contains(edge), edge != least || !least_excluded, "{domain}");
            }
            for beyond in [least.next_down(), greatest.next_up(), f64::NAN] {
                assert!(!domain.contains(beyond), "{domain}");
            }
        }
        assert!(book.contains(&RTOL.to_string()));
    }
}
