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
        Some(Eigenvalues {
            // The Routh-Hurwitz determinant has the opposite sign, also where rounding reverses that of a small growth.
            growth_rate: if self.hurwitz == 0.0 { 0.0 } else { (scale * growth).abs().copysign(-self.hurwitz) },
            frequency: scale * frequency,
            decay_rate: has_mass.then_some(scale * decay),
        })
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

#[cfg(test)]
mod tests {
    //! The eigenvalues against nalgebra's where those are accurate, against the characteristic equation in double-double
    //! everywhere, and the sign of the growth rate at the critical stiffness.

    use super::*;
    use nalgebra::Matrix3;

    /// Numbers between 0 and 1 from a fixed linear congruence.
    fn uniform(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn log_uniform(state: &mut u64, least: f64, greatest: f64) -> f64 {
        least * (greatest / least).powf(uniform(state))
    }

    /// `(x^3 M + (M + a) x^2 + c x + k)` and the sum of the sizes of its terms at a complex `x`, in double-double.
    fn residual(law: Law, k: f64, m: f64, v: f64, (re, im): (f64, f64)) -> f64 {
        let double = DoubleDouble::new;
        let inertia = double(m) * double(v) * double(v);
        let coefficients = [inertia, inertia + double(law.a), double(k) + double(law.a) - double(law.b), double(k)];
        let (mut x, mut y, mut size) = (double(0.0), double(0.0), 0.0);
        for coefficient in coefficients {
            (x, y) = (x * double(re) - y * double(im) + coefficient, x * double(im) + y * double(re));
            size = size * re.hypot(im) + coefficient.high.abs();
        }
        x.high.hypot(y.high) / size
    }

    fn scaled(eigenvalues: &Eigenvalues, v: f64) -> [(f64, f64); 2] {
        [(eigenvalues.growth_rate / v, eigenvalues.frequency / v), (eigenvalues.decay_rate.unwrap_or(0.0) / v, 0.0)]
    }

    #[test]
    fn roots_solve_the_characteristic_equation() {
        let mut state = 1;
        for _ in 0..200_000 {
            let a = log_uniform(&mut state, 1e-4, 0.3);
            let law = Law { a, b: 10.0 * a * uniform(&mut state) };
            let (k, v) = (log_uniform(&mut state, 1e-6, 1e3), log_uniform(&mut state, 1.001, 1e9));
            let m = log_uniform(&mut state, 1e-20, 1e3);
            let sliding = SteadySliding::new(law, k, m, v);
            let eigenvalues = sliding.eigenvalues().expect("is elastic");
            for root in scaled(&eigenvalues, v) {
                let residual = residual(law, k, m, v, root);
                assert!(residual <= 4e-15, "{law:?} {k} {m} {v} {eigenvalues:?} {residual}");
            }
            assert!(eigenvalues.decay_rate.is_some_and(|decay| decay < 0.0));
            assert_eq!(eigenvalues.growth_rate < 0.0, sliding.is_stable(), "{law:?} {k} {m} {v}");
        }
    }

    #[test]
    fn regress_two_equal_roots_far_from_the_third() {
        let cases = [
            (
                Law { a: 0.19086204474307833, b: 2.2434371767818206e-5 },
                1.1408613468454599e-36,
                0.19506509378437617,
                1.0000000013126165,
            ),
            (
                Law { a: 0.029836586823087336, b: 0.011314424028958483 },
                2.864919705106888e21,
                7.77143814637104e-26,
                1.0000000000024418,
            ),
            (Law { a: 9.573661630788803e-6, b: 0.0 }, 2.5530113256544154e-38, 9.286204574305586e-6, 1.0000000000000049),
        ];
        for (law, k, m, v) in cases {
            let eigenvalues = SteadySliding::new(law, k, m, v).eigenvalues().expect("is elastic");
            for root in scaled(&eigenvalues, v) {
                let residual = residual(law, k, m, v, root);
                assert!(residual <= 4e-15, "{law:?} {k} {m} {v} {eigenvalues:?} {residual}");
            }
        }
    }

    #[test]
    fn nalgebra_agrees_where_it_is_accurate() {
        let mut state = 2;
        for _ in 0..2000 {
            let a = log_uniform(&mut state, 1e-3, 0.3);
            let law = Law { a, b: 3.0 * a * uniform(&mut state) };
            let (k, m) = (log_uniform(&mut state, 1e-3, 10.0), log_uniform(&mut state, 1e-3, 10.0));
            let (sum, c) = (m + law.a, k + law.a - law.b);
            let companion = Matrix3::new(-sum / m, -c / m, -k / m, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
            let expected_roots = companion.complex_eigenvalues();
            let eigenvalues = SteadySliding::new(law, k, m, 1.0).eigenvalues().expect("is elastic");
            for (re, im) in scaled(&eigenvalues, 1.0) {
                let near =
                    expected_roots.iter().map(|root| (root.re - re).hypot(root.im - im)).fold(f64::INFINITY, f64::min);
                // A double root is known to half the digits only.
                assert!(near <= 1e-7 * re.hypot(im), "{law:?} {k} {m} {eigenvalues:?} {expected_roots:?}");
            }
        }
    }

    #[test]
    fn growth_changes_sign_at_the_critical_stiffness() {
        let mut state = 3;
        for _ in 0..20_000 {
            let a = log_uniform(&mut state, 1e-4, 0.3);
            let law = Law { a, b: a * (1.0 + log_uniform(&mut state, 1e-6, 10.0)) };
            let (v, m) = (log_uniform(&mut state, 1.001, 1e9), log_uniform(&mut state, 1e-20, 1e3));
            let inertia = DoubleDouble::product(v, v) * DoubleDouble::new(m);
            let weakening = DoubleDouble::sum(law.b, -law.a);
            let critical = weakening * (DoubleDouble::new(1.0) + inertia / DoubleDouble::new(law.a));
            for fraction in [-1e-12, 1e-12, -1e-9, 1e-6] {
                let k = critical.high + fraction * critical.high;
                let stable = (DoubleDouble::new(k) - critical).high > 0.0;
                let sliding = SteadySliding::new(law, k, m, v);
                assert_eq!(sliding.is_stable(), stable, "{law:?} {m} {v} {fraction}");
                let eigenvalues = sliding.eigenvalues().expect("is elastic");
                assert_eq!(eigenvalues.growth_rate < 0.0, stable);
                // To first order sigma = -H/(2 S), with H = a (k - k_c) at 32 digits.
                let h = (DoubleDouble::new(law.a) * (DoubleDouble::new(k) - critical)).high;
                let (sum, c) = (inertia.high + law.a, k - weakening.high);
                let expected = -0.5 * v * h / (sum * sum + c * inertia.high);
                assert!(
                    (eigenvalues.growth_rate / expected - 1.0).abs() <= 1e-4 * (1.0 + 10.0 * fraction.abs() / 1e-6)
                );
            }
        }
    }

    #[test]
    fn without_mass_two_eigenvalues_are_left() {
        let law = Law { a: 0.02, b: 0.05 };
        let eigenvalues = SteadySliding::new(law, 0.04, 0.0, 2.0).eigenvalues().expect("is elastic");
        // 0.02 x^2 + 0.01 x + 0.04 = 0.
        assert_eq!(eigenvalues.decay_rate, None);
        assert!((eigenvalues.growth_rate / (2.0 * -0.25) - 1.0).abs() < 1e-14);
        assert!((eigenvalues.frequency / (2.0 * (2.0_f64 - 0.0625).sqrt()) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn paper_case_is_just_unstable() {
        let law = Law { a: 0.005, b: 0.01 };
        let sliding = SteadySliding::new(law, 7.5e-3, 2.5e-16, 3.2e6);
        assert!((sliding.critical_stiffness() / 0.00756 - 1.0).abs() < 1e-15 && !sliding.is_stable());
        let eigenvalues = sliding.eigenvalues().expect("is elastic");
        let [growth, frequency] = [eigenvalues.growth_rate, eigenvalues.frequency];
        assert!((growth / 7.53e3 - 1.0).abs() < 5e-4 && (frequency / 3.185e6 - 1.0).abs() < 5e-4);
        assert!(eigenvalues.decay_rate.is_some_and(|decay| (decay / -9.465e6 - 1.0).abs() < 5e-4));
        // The double 0.00756 lies just below the critical stiffness.
        assert!(!SteadySliding::new(law, 0.00756, 2.5e-16, 3.2e6).is_stable());
    }

    #[test]
    fn velocities_beyond_the_critical_one_are_unstable() {
        let law = Law { a: 0.005, b: 0.01 };
        let critical = critical_velocity(law, 7.5e-3, 2.5e-16).expect("exists");
        for (fraction, stable) in [(1.0 - 1e-12, true), (1.0 + 1e-12, false)] {
            assert_eq!(SteadySliding::new(law, 7.5e-3, 2.5e-16, fraction * critical).is_stable(), stable);
        }
        assert_eq!(critical_velocity(law, 7.5e-3, 0.0), None);
        assert_eq!(critical_velocity(law, 0.004, 1.0), None);
        assert_eq!(critical_velocity(Law { a: 0.01, b: 0.005 }, 1.0, 1.0), None);
    }
}
