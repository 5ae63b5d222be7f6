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

#[cfg(test)]
mod tests {
    //! The coefficient compared with Kuznetsov's formula, and the predicted amplitude of limit cycles with simulations.

    use nalgebra::{Complex, Matrix3, Vector3};

    use super::*;
    use crate::model::{StateLaw, Transition};
    use crate::stability::SteadySliding;
    use crate::stability::step_response::{Orbit, Outcome, ScaledBlock, VelocityStep, Z};

    type C = Complex<f64>;

    /// Kuznetsov, Elements of Applied Bifurcation Theory, (5.39), for `(z, y, x)` in the scaled variables of the response.
    fn by_multilinear_forms(law: Law, mass: f64) -> f64 {
        let Law { a, b } = law;
        let k = (b - a) * (1.0 + mass / a);
        let omega = ((k + a - b) / mass).sqrt();
        let (one, i) = (C::new(1.0, 0.0), C::new(0.0, 1.0));
        let jacobian = Matrix3::new(0.0, 0.0, -k, 0.0, -1.0, -1.0, 1.0 / mass, -b / mass, -a / mass).map(|x| one * x);
        let pull = |u: &Vector3<C>| (u[0] - u[1] * b - u[2] * a) / mass;
        let second = |u: &Vector3<C>, v: &Vector3<C>| {
            Vector3::new(-u[2] * v[2] * k, u[1] * v[1] - u[2] * v[2], -(u[2] * pull(v) + v[2] * pull(u)))
        };
        let third = |u: &Vector3<C>, v: &Vector3<C>, w: &Vector3<C>| {
            let x = u[2] * v[2] * pull(w) + u[2] * w[2] * pull(v) + v[2] * w[2] * pull(u);
            Vector3::new(-u[2] * v[2] * w[2] * k, -u[1] * v[1] * w[1] - u[2] * v[2] * w[2], x)
        };
        let q = Vector3::new(i * (k / omega), -one / (one + i * omega), one);
        let p = Vector3::new(i / (omega * mass), one * (b / mass) / (i * omega - one), one);
        assert!((jacobian * q - q * (i * omega)).norm() < 1e-9 * q.norm() * jacobian.norm());
        assert!((jacobian.transpose() * p + p * (i * omega)).norm() < 1e-9 * p.norm() * jacobian.norm());
        let conjugate = q.map(|x| x.conj());
        let solve = |matrix: Matrix3<C>, v: Vector3<C>| matrix.lu().solve(&v).expect("is regular");
        let still = solve(jacobian, second(&q, &conjugate));
        let double = solve(Matrix3::from_diagonal_element(i * (2.0 * omega)) - jacobian, second(&q, &q));
        let sum = third(&q, &q, &conjugate) - second(&q, &still) * (one * 2.0) + second(&conjugate, &double);
        (p.dotc(&sum) / p.dotc(&q)).re / (2.0 * omega)
    }

    #[test]
    fn coefficient_equals_that_of_the_multilinear_forms() {
        for a in [0.005, 0.05] {
            for ratio in [1.001, 1.5, 2.0, 10.0] {
                let law = Law { a, b: ratio * a };
                for mu in [1e-3, 0.05, 0.13, 0.14, 1.0, 30.0] {
                    let found = lyapunov_coefficient(StateLaw::Ageing, law, mu * a).expect("has a Hopf point");
                    let expected = by_multilinear_forms(law, mu * a);
                    assert!(
                        (found - expected).abs() < 1e-7 * expected.abs().max(1e-3),
                        "{law:?} {mu} {found} {expected}"
                    );
                }
            }
        }
    }

    /// Change of `ln A` over a small cycle at the critical stiffness, divided by `(pi/2) A^2`, after some cycles.
    fn simulated_growth(law: Law, inertia: f64, z: f64) -> f64 {
        let Law { a, b } = law;
        let slider = ScaledBlock { state_law: StateLaw::Ageing, a, b, inertia, k: (b - a) * (1.0 + inertia / a) };
        let mut orbit = Orbit::new(&slider, [z, 0.0, 0.0], 1e-13, 0.0);
        let mut budget = 100_000;
        let mut before = z;
        for _ in 0..20 {
            before = orbit.cycle(false, &mut budget).expect("goes on").end[Z];
        }
        let cycle = orbit.cycle(false, &mut budget).expect("goes on");
        let change = (cycle.end[Z] / before).ln();
        let [low, high] = cycle.extrema.map(|seen| orbit.refined(seen.expect("oscillates")).x);
        let amplitude = 0.5 * (high - low);
        change / (0.5 * std::f64::consts::PI * amplitude * amplitude)
    }

    #[test]
    fn small_cycles_change_as_predicted() {
        for (a, ratio, inertia) in [
            (0.005, 2.0, 0.00256),
            (0.005, 2.0, 0.02),
            (0.01, 1.5, 0.001),
            (0.02, 3.0, 0.1),
            (0.005, 2.0, 1.0),
            (0.01, 1.2, 0.5),
        ] {
            let law = Law { a, b: ratio * a };
            let expected = lyapunov_coefficient(StateLaw::Ageing, law, inertia).expect("has a critical stiffness");
            // The phase at the section varies: an error of the order of the amplitude.
            let [twice, once] =
                [2e-2, 1e-2].map(|fraction| simulated_growth(law, inertia, fraction * (ratio - 1.0) * (a + inertia)));
            let found = 2.0 * once - twice;
            assert!((found / expected - 1.0).abs() < 5e-4, "{law:?} {inertia}: {found} {expected}");
        }
    }

    #[test]
    fn kind_changes_at_the_critical_mass() {
        for square in [1e-6, 0.5, 1.0, 30.0_f64] {
            let law = Law { a: 0.01, b: 0.01 * (1.0 + square) };
            let mu = 1.0 / (3.0 + 2.0 * (4.0 + (law.b - law.a) / law.a).sqrt());
            for (fraction, kind) in [(1.0 - 1e-9, Hopf::Subcritical), (1.0 + 1e-9, Hopf::Supercritical)] {
                assert_eq!(Hopf::of(StateLaw::Ageing, law, fraction * mu * law.a / 4.0, 2.0), Some(kind), "{square}");
            }
        }
        assert_eq!(Hopf::of(StateLaw::Ageing, Law { a: 0.01, b: 0.01 }, 1.0, 1.0), None);
        assert_eq!(Hopf::of(StateLaw::Ageing, Law { a: 0.01, b: 0.02 }, 0.0, 1.0), None);
        assert_eq!(Hopf::of(StateLaw::Ageing, Law { a: 0.01, b: 0.02 }, 1e300, 1e10), None);
    }

    #[test]
    fn simulated_limit_cycles_have_the_predicted_amplitude() {
        let law = Law { a: 0.005, b: 0.01 };
        for v_f in [2.5e6, 3.2e6, 1e7] {
            let m = 2.5e-16;
            let at = |fraction: f64| {
                let critical = SteadySliding::new(law, 1.0, m, v_f).critical_stiffness();
                let k = critical * (1.0 - fraction);
                let growth = SteadySliding::new(law, k, m, v_f).eigenvalues().expect("is elastic").growth_rate / v_f;
                let omega = ((law.b - law.a) / law.a).sqrt();
                let coefficient = lyapunov_coefficient(StateLaw::Ageing, law, m * v_f * v_f).expect("has a Hopf point");
                let predicted = 2.0 * (-growth / (omega * coefficient)).sqrt();
                let transition = Transition { law, v_i: 0.99 * v_f, v_f };
                let (_, response) = VelocityStep { state_law: StateLaw::Ageing, transition, k, m }.respond(1e-8);
                let response = response.expect("is simulated_growth");
                assert_eq!(response.outcome, Outcome::LimitCycle);
                let cycle = response.cycle.expect("is a cycle");
                0.5 * (cycle.v_peak / cycle.v_trough).ln() / predicted - 1.0
            };
            // The next order of the amplitude is linear in the distance from the critical stiffness.
            let (far, near) = (at(4e-4), at(1e-4));
            assert!(near.abs() < 0.01 && (far / near / 4.0 - 1.0).abs() < 0.1, "{v_f} {far} {near}");
        }
    }
}
