//! The Hopf point at the critical stiffness: whether the oscillation that starts there is small and stable, or not.
//!
//! The first Lyapunov coefficient by projection onto the critical eigenvectors (Kuznetsov, Elements of Applied Bifurcation
//! Theory, equation 5.62), in the scaled variables of `slider.rs`, where the frequency at the Hopf point is
//! `sqrt((b - a)/a)` whatever the mass. The equation of motion enters times `M`, so that `M = 0` is a case like any other.

use std::ops::{Add, Mul, Sub};

use super::slider::{X, Y, Z};
use crate::model::Law;

/// First Lyapunov coefficient `l_1` at the critical stiffness of a block of scaled mass `M = m v_f^2 >= 0`; `None` for
/// `b <= a`, where there is no critical stiffness.
///
/// There, `ln A` of a small oscillation `ln(v/v_f) = A cos(omega t)` changes by `(pi/2) l_1 A^2` a cycle. Negative: the
/// Hopf point is supercritical, and a stable limit cycle grows from nothing where sliding becomes unstable. Positive: it
/// is subcritical, an unstable cycle lies around stable sliding, and a large step may end on a limit cycle above the
/// critical stiffness too.
pub fn lyapunov_coefficient(law: Law, inertia: f64) -> Option<f64> {
    let Law { a, b } = law;
    let weakening = b - a;
    if weakening <= 0.0 {
        return None;
    }
    let hopf = Hopf { a, b, k: weakening * (1.0 + inertia / a), inertia };
    let omega = (weakening / a).sqrt();
    let rotation = Complex { re: 0.0, im: omega };
    // The critical eigenvector, with the net force M x' = z - a x - b y as its fourth component.
    let q = hopf.vector(real(1.0), rotation, [real(0.0); 3]);
    let conjugate = q.map(Complex::conjugate);
    let mean = hopf.inverse(hopf.quadratic(&q, &conjugate));
    let twice = rotation + rotation;
    let double = hopf.resolvent(twice, hopf.quadratic(&q, &q));
    // The left eigenvector, up to a factor: (1/lambda, -b/(1 + lambda), 1) for the equations of z, y and M x'.
    let left = [rotation.inverse(), real(-b) * (real(1.0) + rotation).inverse(), real(1.0)];
    let project = |r: [Complex; 3]| left[Z] * r[Z] + left[Y] * r[Y] + left[X] * r[X];
    let norm = project([q[Z], q[Y], real(inertia) * q[X]]);
    let sum = project(hopf.cubic(&q, &q, &conjugate)) - real(2.0) * project(hopf.quadratic(&q, &mean))
        + project(hopf.quadratic(&conjugate, &double));
    Some((sum * norm.inverse()).re / (2.0 * omega))
}

/// `z`, `y`, `x` and the net force.
type Vector = [Complex; 4];

/// Place of the net force.
const FORCE: usize = 3;

struct Hopf {
    a: f64,
    b: f64,
    k: f64,
    inertia: f64,
}

impl Hopf {
    /// Second derivatives of `z'`, `y'` and `M x'`.
    fn quadratic(&self, u: &Vector, v: &Vector) -> [Complex; 3] {
        let xx = u[X] * v[X];
        [real(-self.k) * xx, u[Y] * v[Y] - xx, real(0.0) - (u[FORCE] * v[X] + v[FORCE] * u[X])]
    }

    /// Third derivatives.
    fn cubic(&self, u: &Vector, v: &Vector, w: &Vector) -> [Complex; 3] {
        let xxx = u[X] * v[X] * w[X];
        let force = u[FORCE] * v[X] * w[X] + v[FORCE] * u[X] * w[X] + w[FORCE] * u[X] * v[X];
        [real(-self.k) * xxx, real(0.0) - (u[Y] * v[Y] * w[Y] + xxx), force]
    }

    /// The vector with this `x` that solves `(lambda - A) h = r` in `z` and `y`.
    fn vector(&self, x: Complex, lambda: Complex, r: [Complex; 3]) -> Vector {
        let z = (r[Z] - real(self.k) * x) * lambda.inverse();
        let y = (r[Y] - x) * (lambda + real(1.0)).inverse();
        [z, y, x, real(self.inertia) * lambda * x - r[X]]
    }

    /// `(lambda - A)^-1 r`.
    fn resolvent(&self, lambda: Complex, r: [Complex; 3]) -> Vector {
        let (first, second) = (lambda.inverse(), (lambda + real(1.0)).inverse());
        let pivot = real(self.inertia) * lambda + real(self.a) + real(self.k) * first - real(self.b) * second;
        let right = r[X] + r[Z] * first - real(self.b) * r[Y] * second;
        self.vector(right * pivot.inverse(), lambda, r)
    }

    /// `A^-1 r`.
    fn inverse(&self, r: [Complex; 3]) -> Vector {
        let x = real(-1.0 / self.k) * r[Z];
        let y = real(0.0) - (r[Y] + x);
        [r[X] + real(self.b) * y + real(self.a) * x, y, x, r[X]]
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Complex {
    re: f64,
    im: f64,
}

fn real(re: f64) -> Complex {
    Complex { re, im: 0.0 }
}

impl Complex {
    fn conjugate(self) -> Complex {
        Complex { im: -self.im, ..self }
    }

    fn inverse(self) -> Complex {
        let square = self.re * self.re + self.im * self.im;
        Complex { re: self.re / square, im: -self.im / square }
    }
}

impl Add for Complex {
    type Output = Complex;
    fn add(self, other: Complex) -> Complex {
        Complex { re: self.re + other.re, im: self.im + other.im }
    }
}

impl Sub for Complex {
    type Output = Complex;
    fn sub(self, other: Complex) -> Complex {
        Complex { re: self.re - other.re, im: self.im - other.im }
    }
}

impl Mul for Complex {
    type Output = Complex;
    fn mul(self, other: Complex) -> Complex {
        let Complex { re, im } = other;
        Complex { re: self.re * re - self.im * im, im: self.re * im + self.im * re }
    }
}

#[cfg(test)]
mod tests {
    //! The coefficient against cycles that were followed at the critical stiffness.

    use super::*;
    use crate::stability::response::{Orbit, Slider};

    /// Change of `ln A` over a small cycle at the critical stiffness, divided by `(pi/2) A^2`, from the energy that friction
    /// takes; the contact lifetime has relaxed for some cycles.
    fn followed(law: Law, inertia: f64, z: f64) -> f64 {
        let Law { a, b } = law;
        let slider = Slider { a, b, inertia, k: (b - a) * (1.0 + inertia / a) };
        let mut orbit = Orbit::new(&slider, [z, 0.0, 0.0], 1e-13);
        let mut budget = 100_000;
        let mut before = z;
        for _ in 0..20 {
            before = orbit.cycle(false, &mut budget).expect("goes on").end[Z];
        }
        let cycle = orbit.cycle(false, &mut budget).expect("goes on");
        let change = -cycle.loss[0] * slider.k / (before * before);
        let [low, high] = cycle.extrema.map(|seen| orbit.polished(seen.expect("oscillates")).x);
        let amplitude = 0.5 * (high - low);
        change / (0.5 * std::f64::consts::PI * amplitude * amplitude)
    }

    #[test]
    fn reference_small_cycles_change_as_foreseen() {
        for (a, ratio, inertia) in [
            (0.005, 2.0, 0.00256),
            (0.005, 2.0, 0.02),
            (0.01, 1.5, 0.001),
            (0.02, 3.0, 0.1),
            (0.005, 2.0, 1.0),
            (0.01, 1.2, 0.5),
        ] {
            let law = Law { a, b: ratio * a };
            let expected = lyapunov_coefficient(law, inertia).expect("has a critical stiffness");
            // The section is not exactly where the phase is the same: an error of the order of the amplitude.
            let [twice, once] = [2e-2, 1e-2].map(|share| followed(law, inertia, share * (ratio - 1.0) * (a + inertia)));
            let found = 2.0 * once - twice;
            assert!((found / expected - 1.0).abs() < 5e-4, "{law:?} {inertia}: {found} {expected}");
        }
    }

    #[test]
    fn both_kinds_of_hopf_point_exist() {
        let kind = |ratio: f64, inertia: f64| {
            lyapunov_coefficient(Law { a: 0.005, b: ratio * 0.005 }, 0.005 * inertia).map(f64::signum)
        };
        assert_eq!(kind(1.0, 1.0), None);
        // The paper's material at its final velocity, and without mass.
        assert_eq!(kind(2.0, 0.512), Some(-1.0));
        assert_eq!(kind(1.5, 1.0), Some(-1.0));
        assert_eq!(kind(2.0, 0.03), Some(1.0));
        assert_eq!(kind(1.5, 0.1), Some(1.0));
        // Without mass neither: the coefficient vanishes, and rounding is left.
        let law = Law { a: 0.005, b: 0.01 };
        assert!(lyapunov_coefficient(law, 0.0).is_some_and(|found| found.abs() < 1e-15));
    }
}
