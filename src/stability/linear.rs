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
use crate::numerics::MAX_STEPS;
use crate::numerics::double_double::DoubleDouble;

/// Steady sliding of a block on a spring at one velocity, with the coefficients of its characteristic equation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadySliding {
    law: Law,
    k: f64,
    m: f64,
    v: f64,
    /// Scaled mass `M = m v^2`.
    inertia: f64,
    /// Coefficient `M + a`.
    sum: f64,
    /// Coefficient `k + a - b`.
    c: f64,
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

/// Square of half the distance of two eigenvalues, fraction of their product, below which it is formed in double-double.
/// Chosen: three digits are lost there.
const CLOSE_PAIR: f64 = 1e-3;

/// Difference, fraction of its terms, below which it is formed in double-double. Chosen: three bits are lost there.
const CANCELLATION: f64 = 0.125;

impl SteadySliding {
    /// Steady sliding at velocity `v > 0`, on a spring of stiffness `k > 0` (infinite: rigid), of a mass `m >= 0`.
    pub fn new(law: Law, k: f64, m: f64, v: f64) -> SteadySliding {
        let weakening = law.b - law.a;
        // A mass of -0 would give the decay rate the wrong sign.
        let m = m + 0.0;
        let inertia = m * v * v;
        let sum = inertia + law.a;
        let (pull, push) = (law.a * k, weakening * sum);
        let mut sliding =
            SteadySliding { law, k, m, v, inertia, sum, c: excess_stiffness(law, k), hurwitz: pull - push };
        if k.is_finite() && sliding.hurwitz.abs() < CANCELLATION * pull {
            let inertia = DoubleDouble::product(v, v) * DoubleDouble::new(m);
            let weakening = DoubleDouble::sum(law.b, -law.a);
            let push = weakening * (inertia + DoubleDouble::new(law.a));
            sliding.hurwitz = (DoubleDouble::product(law.a, k) - push).high;
        }
        sliding
    }

    /// Critical stiffness `(b - a)(1 + m v^2/a)`.
    pub fn critical_stiffness(&self) -> f64 {
        (self.law.b - self.law.a) * (1.0 + self.inertia / self.law.a)
    }

    /// Whether `k` is above the critical stiffness, decided as if in exact arithmetic.
    pub fn is_stable(&self) -> bool {
        !self.k.is_finite() || self.hurwitz > 0.0
    }

    /// The eigenvalues; `None` for a rigid spring, under which the block does not oscillate.
    pub fn eigenvalues(&self) -> Option<Eigenvalues> {
        if !self.k.is_finite() {
            return None;
        }
        let root = self.real_root();
        let real = -root / self.inertia;
        let [growth, frequency, decay] = match self.pair(root) {
            RemainingEigenvalues::Complex { growth, frequency } => [growth, frequency, real],
            // The root found is the least or the greatest of three.
            RemainingEigenvalues::Real { low, high } if real < low => [high, 0.0, real],
            RemainingEigenvalues::Real { low, high } => [high.max(real), 0.0, low],
        };
        Some(Eigenvalues {
            growth_rate: self.v * growth,
            frequency: self.v * frequency,
            decay_rate: (self.inertia > 0.0).then_some(self.v * decay),
        })
    }
}

/// Critical velocity `sqrt(a (k/(b - a) - 1)/m)`, in `v_0`, above which steady sliding is unstable; `None` where it is
/// stable at every velocity, or at none.
pub fn critical_velocity(law: Law, k: f64, m: f64) -> Option<f64> {
    let weakening = law.b - law.a;
    let spare = excess_stiffness(law, k);
    let velocity = (law.a * (spare / weakening) / m).sqrt();
    (weakening > 0.0 && spare > 0.0 && velocity.is_finite()).then_some(velocity)
}

/// `k - (b - a)`.
fn excess_stiffness(law: Law, k: f64) -> f64 {
    let plain = k - (law.b - law.a);
    let cancels = plain.abs() < CANCELLATION * k;
    if cancels { (DoubleDouble::new(k) - DoubleDouble::sum(law.b, -law.a)).high } else { plain }
}

/// The two eigenvalues apart from a real one, scaled.
enum RemainingEigenvalues {
    Complex { growth: f64, frequency: f64 },
    Real { low: f64, high: f64 },
}

impl SteadySliding {
    /// `R = -M x` of a real root `x`, the largest `R` or the only one: a root of `R^3 - (M + a) R^2 + c M R - k M^2`.
    ///
    /// The sign at the inflection point decides from which side Newton's method converges monotonically.
    fn real_root(&self) -> f64 {
        let SteadySliding { k, inertia, sum, c, hurwitz, .. } = *self;
        let value = |r: f64| ((r - sum) * r + c * inertia) * r - k * inertia * inertia;
        let slope = |r: f64| (3.0 * r - 2.0 * sum) * r + c * inertia;
        let inflection = sum / 3.0;
        let mut r = if value(inflection) > 0.0 {
            0.0
        } else if hurwitz >= 0.0 {
            sum
        } else {
            sum + inertia * self.growth_bound()
        };
        let from_above = r > inflection;
        for _ in 0..MAX_STEPS {
            let step = value(r) / slope(r);
            let next = r - step;
            // Steps keep their direction until rounding reverses one.
            if !(next.is_finite() && if from_above { next < r } else { next > r }) {
                break;
            }
            r = next;
            // The next step would be of the order of the square of this one.
            if step.abs() <= 1e-10 * r {
                break;
            }
        }
        r
    }

    /// Upper bound of the sum of the two other eigenvalues where it is positive: `q` in `M^2 q^3 + 2 M (M + a) q^2 + S
    /// q = |H|`, `S = (M + a)^2 + c M`, without the first term.
    fn growth_bound(&self) -> f64 {
        let SteadySliding { inertia, sum, c, hurwitz, .. } = *self;
        let (square, slope) = (2.0 * inertia * sum, sum * sum + c * inertia);
        if slope > 0.0 {
            let by_slope = -hurwitz / slope;
            return if square * by_slope > slope { (-hurwitz / square).sqrt() } else { by_slope };
        }
        (-slope + (slope * slope - 4.0 * square * hurwitz).sqrt()) / (2.0 * square)
    }

    /// `P^2/4 - Q` in double-double: near a double root it is a small difference. `P` follows from the sum of the
    /// eigenvalues, or from their products in pairs.
    fn discriminant(&self, r: f64, by_sum: bool) -> f64 {
        let double = DoubleDouble::new;
        let (k, inertia) = (double(self.k), DoubleDouble::product(self.v, self.v) * double(self.m));
        let (sum, c) = (inertia + double(self.law.a), k - DoubleDouble::sum(self.law.b, -self.law.a));
        let x = double(r);
        let rest = (((x - sum) * x + c * inertia) * x - k * inertia * inertia).high;
        let x = x - double(rest / ((3.0 * r - 2.0 * self.sum) * r + self.c * self.inertia));
        let p = if by_sum { (sum - x) / inertia } else { (c - inertia * k / x) / x };
        let half = p * double(0.5);
        (half * half - k / x).high
    }

    /// The two eigenvalues apart from the real one: roots of `x^2 + P x + Q`.
    fn pair(&self, r: f64) -> RemainingEigenvalues {
        let SteadySliding { k, inertia, sum, c, hurwitz, .. } = *self;
        let q = k / r;
        // Two formulas for P: smaller terms lose fewer digits.
        let (first, second) = (sum / inertia, c.abs().max(inertia * q) / r);
        let by_sum = first < second;
        let mut p = if by_sum { (sum - r) / inertia } else { (c - inertia * q) / r };
        if p.abs() * inertia < 0.125 * sum {
            // Near the Hopf point P is small: M^2 P^3 - 2 M (M + a) P^2 + ((M + a)^2 + c M) P = H gives all its digits.
            let slope = sum * sum + c * inertia;
            for _ in 0..3 {
                let rest = ((inertia * p - 2.0 * sum) * inertia * p + slope) * p - hurwitz;
                let step = rest / ((3.0 * inertia * p - 4.0 * sum) * inertia * p + slope);
                p -= step;
                if step.abs() <= 1e-9 * p.abs() {
                    break;
                }
            }
        }
        let half = 0.5 * p;
        let mut squares = (half - q.sqrt()) * (half + q.sqrt());
        if squares.abs() < CLOSE_PAIR * q {
            squares = self.discriminant(r, by_sum);
        }
        if squares < 0.0 {
            // No negative zero at the critical stiffness.
            return RemainingEigenvalues::Complex { growth: 0.0 - half, frequency: (-squares).sqrt() };
        }
        // The smaller root follows from the product.
        let larger = -(half + squares.sqrt().copysign(half));
        let smaller = q / larger;
        RemainingEigenvalues::Real { low: larger.min(smaller), high: larger.max(smaller) }
    }
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
