//! The Hopf point at the critical stiffness: supercritical or subcritical.
//!
//! The first Lyapunov coefficient of the block at `k = k_c` is elementary (docs/derivations.md). With `mu =
//! m v^2/a` and `omega^2 = (b - a)/a`, in units of `l/v` for time and of `ln v` for the amplitude,
//!
//! ```text
//! ageing: l_1 = -mu omega [(7 + 4 omega^2) mu^2 + 6 mu - 1]/D
//! slip:   l_1 = -mu omega (1 + omega^2) (1 + mu) (1 + 9 mu)/D
//! law_eps = 1 - s: l_1 = -mu omega [(7 + 4 omega^2) mu^2 + 6 mu - 1 + 2 s ((1 + mu)^2 + omega^2 mu (mu + 3)) + s^2 omega^2 (1 + mu)(1 + 3 mu)]/D
//! prz:    l_1 = -omega [18 mu^3 + 20 mu^2 + 2 mu + omega^2 (34 mu^3 + 35 mu^2 - 1) + omega^4 (10 mu^3 + 16 mu^2 + 2 mu)]
//!               / [2 (1 + omega^2) D]
//! D = 2 [(1 + mu)^2 + omega^2 mu^2] [(1 + mu)^2 + 4 omega^2 mu^2].
//! ```

use crate::model::{Law, StateLaw};

/// Side of the critical stiffness on which small limit cycles exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hopf {
    /// Below it, attracting: oscillations grow continuously from 0 beyond the Hopf point.
    Supercritical,
    /// Above it, repelling: larger disturbances of stable sliding lead to stick-slip.
    Subcritical,
}

impl Hopf {
    /// Names in tables, in the order of the variants.
    pub const NAMES: [&'static str; 2] = ["supercritical", "subcritical"];

    /// Kind of the Hopf point of steady sliding at `v > 0` of a mass `m >= 0`; `None` for `b <= a` (no Hopf point) and,
    /// except for [`StateLaw::Prz`], for `m = 0` (degenerate).
    pub fn of(state: StateLaw, law: Law, m: f64, v: f64) -> Option<Hopf> {
        lyapunov_coefficient(state, law, m * v * v).map(Hopf::from_coefficient)
    }

    /// Kind of a Hopf point with this first Lyapunov coefficient.
    pub fn from_coefficient(coefficient: f64) -> Hopf {
        if coefficient < 0.0 { Hopf::Supercritical } else { Hopf::Subcritical }
    }
}

/// First Lyapunov coefficient `l_1` at the critical stiffness of a block of scaled mass `M = m v^2`; `None` as in
/// [`Hopf::of`].
///
/// There, `ln A` of a small oscillation `A cos(omega t)` of `ln v` changes by `(pi/2) l_1 A^2` a cycle. Near it the
/// amplitude of limit cycles is `2 sqrt(-sigma/(omega l_1))`, with the growth rate `sigma`.
pub fn lyapunov_coefficient(state: StateLaw, law: Law, inertia: f64) -> Option<f64> {
    match state {
        StateLaw::Ageing => interpolated_lyapunov_coefficient(1.0, law, inertia),
        StateLaw::Slip => interpolated_lyapunov_coefficient(0.0, law, inertia),
        StateLaw::Prz => {
            let point = Point::new(law, inertia)?;
            let Point { p, q, square, .. } = point;
            let [outer, inner, last] = [
                (18.0 * p + 20.0 * q) * p * p + 2.0 * p * q * q,
                (34.0 * p + 35.0 * q) * p * p - q * q * q,
                (10.0 * p + 16.0 * q) * p * p + 2.0 * p * q * q,
            ];
            Some(point.coefficient((outer + square * (inner + square * last)) / (2.0 * (1.0 + square))))
        }
    }
}

/// First Lyapunov coefficient, as [`lyapunov_coefficient`], for the interpolated law `theta' = (u^s - u)/(1 - s)` with `s = 1 - eps`: slip for `eps = 0`, ageing for
/// 1. `None` for `b <= a` and without mass.
pub fn interpolated_lyapunov_coefficient(eps: f64, law: Law, inertia: f64) -> Option<f64> {
    let point = Point::new(law, inertia).filter(|point| point.mu > 0.0)?;
    let (Point { p, q, square, .. }, s) = (point, 1.0 - eps);
    let ageing = (7.0 + 4.0 * square) * p * p + (6.0 * p - q) * q;
    let first = 2.0 * ((p + q) * (p + q) + square * p * (p + 3.0 * q));
    let second = square * (p + q) * (3.0 * p + q);
    Some(point.coefficient(p * (ageing + s * (first + s * second))))
}

/// A Hopf point: `mu`, `omega^2`, and `p = mu/scale`, `q = 1/scale` for forms in which no large `mu` overflows.
#[derive(Debug, Clone, Copy)]
struct Point {
    mu: f64,
    square: f64,
    p: f64,
    q: f64,
}

impl Point {
    /// That of a scaled mass; `None` for `b <= a`.
    fn new(law: Law, inertia: f64) -> Option<Point> {
        let (mu, square) = (inertia / law.a, (law.b - law.a) / law.a);
        let scale = mu.max(1.0);
        let point = Point { mu, square, p: mu / scale, q: 1.0 / scale };
        (square > 0.0 && mu >= 0.0 && mu.is_finite()).then_some(point)
    }

    /// The coefficient whose numerator over `-omega`, a cubic form of `p` and `q`, is `sum`.
    fn coefficient(&self, sum: f64) -> f64 {
        let Point { square, p, q, .. } = *self;
        let pairs = ((p + q) * (p + q) + square * p * p) * ((p + q) * (p + q) + 4.0 * square * p * p);
        -0.5 * square.sqrt() * q * sum / pairs
    }
}
