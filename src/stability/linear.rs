//! Linear stability of steady sliding: critical stiffness and the three eigenvalues, without cancellation.
//!
//! With time in units of `l/v` the eigenvalues at velocity `v` are the roots of
//!
//! ```text
//! M x^3 + (M + a) x^2 + (k + a - b) x + k = 0,    M = m v^2,
//! ```
//!
//! so they depend on `a`, `b`, `k` and `M` only (docs/derivations.md; Rice and Ruina 1983). The sign of the Routh-Hurwitz
//! determinant `H = a k - (b - a)(M + a)` decides stability. Small differences are formed in double-double.

use crate::model::Law;
use crate::numerics::cubic::{ExactCubic, exact_quadratic_zeros};
use crate::numerics::double_double::DoubleDouble;

/// Steady sliding of a block on a spring at one velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadySliding {
    law: Law,
    k: f64,
    v: f64,
    /// Scaled mass `M = m v^2`.
    inertia: DoubleDouble,
    /// Routh-Hurwitz determinant.
    hurwitz: f64,
}

/// The eigenvalues of steady sliding, in units of `v_0/l`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eigenvalues {
    /// Real part of the complex pair; the largest eigenvalue if all are real.
    pub growth_rate: f64,
    /// Imaginary part of the complex pair; 0 if all are real.
    pub frequency: f64,
    /// Real eigenvalue apart from the pair, the least if all are real; `None` for `m = 0`, where it is minus infinity.
    pub decay_rate: Option<f64>,
}

/// Growth rate in units of the frequency up to which it is `-H/(2 [(M + a)^2 + c M])`. Derived: the next term is less than that fraction of it.
const MIN_GROWTH: f64 = 1e-16;

impl SteadySliding {
    /// Steady sliding at velocity `v > 0`, on a spring of stiffness `k > 0` (infinite: rigid), of a mass `m >= 0`.
    pub fn new(law: Law, k: f64, m: f64, v: f64) -> SteadySliding {
        let inertia = DoubleDouble::product(v, v) * DoubleDouble::new(m);
        let push = DoubleDouble::sum(law.b, -law.a) * (inertia + DoubleDouble::new(law.a));
        let hurwitz = if k.is_finite() { (DoubleDouble::product(law.a, k) - push).high } else { k };
        SteadySliding { law, k, v, inertia, hurwitz }
    }

    /// Critical stiffness `(b - a)(1 + m v^2/a)`.
    pub fn critical_stiffness(&self) -> f64 {
        (self.law.b - self.law.a) * (1.0 + self.inertia.high / self.law.a)
    }

    /// Whether `k` is above the critical stiffness, decided as if in exact arithmetic.
    pub fn is_stable(&self) -> bool {
        self.hurwitz > 0.0
    }

    /// The eigenvalues; `None` for a rigid spring, under which the block does not oscillate.
    pub fn eigenvalues(&self) -> Option<Eigenvalues> {
        if !self.k.is_finite() {
            return None;
        }
        let (k, sum) = (DoubleDouble::new(self.k), self.inertia + DoubleDouble::new(self.law.a));
        let c = excess_stiffness(self.law, self.k);
        let has_mass = self.inertia.high > 0.0;
        let (scale, lone, pair) = if has_mass {
            // In units of a power of 2 near the geometric mean of the eigenvalues, outer ones lie on both sides of 1.
            let s = ((self.k.log2() - self.inertia.high.log2()) / 3.0).round().exp2();
            let power = |value: DoubleDouble, n: usize| (0..n).fold(value, |value, _| value.scaled(s));
            let c = [k, power(c, 1), power(sum, 2), power(self.inertia, 3)];
            let [(lone, _), pair @ ..] = ExactCubic { c }.zeros();
            (self.v * s, lone.high, pair)
        } else {
            (self.v, f64::NAN, exact_quadratic_zeros([k, c, sum]))
        };
        let [(first, frequency), (second, _)] = pair.map(|(re, im)| (re.high, im));
        // Without mass the real one is NaN, which `max` and `min` ignore.
        let [growth, decay] =
            if frequency > 0.0 { [first, lone] } else { [first.max(second).max(lone), first.min(second).min(lone)] };
        // The sum P of the pair solves M^2 P^3 + 2 M (M + a) P^2 + [(M + a)^2 + c M] P = -H; a small one is below the 32 digits.
        let growth_rate = if growth.abs() <= MIN_GROWTH * frequency {
            let slope = sum * sum + c * self.inertia;
            self.v * (0.0 - self.hurwitz) / (2.0 * slope.high)
        } else {
            scale * growth
        };
        Some(Eigenvalues { growth_rate, frequency: scale * frequency, decay_rate: has_mass.then_some(scale * decay) })
    }
}

/// Critical velocity `sqrt(a (k/(b - a) - 1)/m)`, in `v_0`, above which steady sliding is unstable; `None` where it is
/// stable at every velocity, or at none.
pub fn critical_velocity(law: Law, k: f64, m: f64) -> Option<f64> {
    let weakening = law.b - law.a;
    let spare = excess_stiffness(law, k).high;
    let velocity = (law.a * (spare / weakening) / m).sqrt();
    (weakening > 0.0 && spare > 0.0 && velocity.is_finite()).then_some(velocity)
}

/// `k - (b - a)`.
fn excess_stiffness(law: Law, k: f64) -> DoubleDouble {
    DoubleDouble::new(k) - DoubleDouble::sum(law.b, -law.a)
}
