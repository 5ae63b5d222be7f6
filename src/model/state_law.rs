//! The laws by which the state of the contacts evolves.

use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::ln;
use crate::numerics::lambert::above_branch;

/// Evolution law of the state: `theta' = G(u)` with `u = theta v`, in scaled units.
///
/// All have `G(1) = 0` and `G'(1) = -1`: steady sliding is at `theta = 1/v`, and small deviations decay over the slip distance `l`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum StateLaw {
    /// `G = 1 - u`: contacts age at rest (Dieterich 1979).
    #[default]
    Ageing,
    /// `G = -u ln u`: contacts change only with slip (Ruina 1983).
    Slip,
    /// `G = (1 - u^2)/2` (Perrin, Rice and Zheng 1995), with their state divided by 2.
    Prz,
}

impl StateLaw {
    /// Every law, in the order of the words of the axis `law`.
    pub const ALL: [StateLaw; 3] = [StateLaw::Ageing, StateLaw::Slip, StateLaw::Prz];

    /// Word for the law on the axis `law`.
    pub fn name(self) -> &'static str {
        match self {
            StateLaw::Ageing => "ageing",
            StateLaw::Slip => "slip",
            StateLaw::Prz => "prz",
        }
    }

    /// The law with this word.
    pub fn find(name: &str) -> Option<StateLaw> {
        StateLaw::ALL.into_iter().find(|law| law.name() == name)
    }

    /// Rate of the state, `G(u)`, for `u = theta v >= 0`.
    pub fn rate(self, u: f64) -> f64 {
        match self {
            StateLaw::Ageing => 1.0 - u,
            StateLaw::Slip if u > 0.0 => -u * ln(u),
            StateLaw::Slip => 0.0,
            StateLaw::Prz => (1.0 - u) * (1.0 + u) / 2.0,
        }
    }

    /// The greatest rate of the state on the branch through steady sliding, to 32 digits: at rest, for the slip law at `u = 1/e`.
    pub fn fastest_rise(self) -> DoubleDouble {
        match self {
            StateLaw::Ageing => DoubleDouble::new(1.0),
            StateLaw::Slip => ONE_OVER_E,
            StateLaw::Prz => DoubleDouble::new(0.5),
        }
    }

    /// `theta v` on the branch through steady sliding, the inverse of [`rate`](StateLaw::rate), for `lack = 1 - theta'/c >= 0` with the
    /// [`fastest_rise`](StateLaw::fastest_rise) `c`.
    pub fn product(self, lack: f64) -> f64 {
        match self {
            StateLaw::Ageing => lack,
            StateLaw::Slip => ONE_OVER_E.high * above_branch(lack),
            StateLaw::Prz => lack.sqrt(),
        }
    }

    /// The least lack at which [`product`](StateLaw::product) is at least `u`, a convex function of `u`, and its derivative.
    pub fn lack(self, u: f64) -> [f64; 2] {
        let e = std::f64::consts::E * u;
        match self {
            StateLaw::Ageing => [u, 1.0],
            StateLaw::Slip if e > 1.0 => [e * ln(e) - e + 1.0, std::f64::consts::E * ln(e)],
            StateLaw::Slip => [0.0, 0.0],
            StateLaw::Prz => [u * u, 2.0 * u],
        }
    }
}

/// `1/e`.
const ONE_OVER_E: DoubleDouble = DoubleDouble { high: 0.36787944117144233, low: -1.2428753672788363e-17 };
