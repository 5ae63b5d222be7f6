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
        let (low, high, frequency) = self.pair(root);
        // Of three real roots, the one found is the least or the greatest.
        let (growth, decay) = if frequency > 0.0 { (high, real) } else { (high.max(real), low.min(real)) };
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
pub(super) fn excess_stiffness(law: Law, k: f64) -> f64 {
    let plain = k - (law.b - law.a);
    let cancels = plain.abs() < CANCELLATION * k;
    if cancels { (DoubleDouble::new(k) - DoubleDouble::sum(law.b, -law.a)).high } else { plain }
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
        let root = (slope * slope - 4.0 * square * hurwitz).sqrt();
        if slope > 0.0 { -2.0 * hurwitz / (slope + root) } else { (root - slope) / (2.0 * square) }
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

    /// The two eigenvalues apart from the real one, roots of `x^2 + P x + Q`: the lower and the higher real part, and the imaginary part.
    fn pair(&self, r: f64) -> (f64, f64, f64) {
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
            return (0.0 - half, 0.0 - half, (-squares).sqrt());
        }
        // The smaller root follows from the product.
        let larger = -(half + squares.sqrt().copysign(half));
        let smaller = q / larger;
        (larger.min(smaller), larger.max(smaller), 0.0)
    }
}
