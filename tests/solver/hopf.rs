//! The kind of the Hopf point, from closed form, against limit cycles of simulated responses on both sides of it.

use nalgebra::{Complex, Matrix3, Vector3};
use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::stability::step_response::{Outcome, Response, VelocityStep};
use slipsweep::stability::{Hopf, SteadySliding, lyapunov_coefficient};

const A: f64 = 0.005;
const MASS: f64 = 2.5e-16;

/// The paper's material but for `b`, at the velocity at which `m v^2/a` is this fraction of where the kind changes.
fn sliding(ratio: f64, fraction: f64) -> (Law, f64) {
    let mu = fraction / (3.0 + 2.0 * (3.0 + ratio).sqrt());
    (Law { a: A, b: ratio * A }, (mu * A / MASS).sqrt())
}

/// The response to a step from `v_i` times the final velocity, `1 + distance` times as stiff as critical.
fn response((law, v_f): (Law, f64), distance: f64, v_i: f64) -> Response {
    let k = (1.0 + distance) * SteadySliding::new(law, 1.0, MASS, v_f).critical_stiffness();
    let step =
        VelocityStep { state_law: StateLaw::Ageing, transition: Transition { law, v_i: v_i * v_f, v_f }, k, m: MASS };
    step.respond(1e-6).1.expect("is followed")
}

/// Range of `ln v` on the limit cycle.
fn amplitude(response: &Response) -> f64 {
    let cycle = response.cycle.unwrap_or_else(|| panic!("{response:?}"));
    (cycle.v_peak / cycle.v_trough).ln()
}

#[test]
fn supercritical_cycles_grow_from_nothing_below_the_critical_stiffness() {
    for ratio in [1.2, 2.0, 6.0] {
        let sliding = sliding(ratio, 1.25);
        assert_eq!(Hopf::of(StateLaw::Ageing, sliding.0, MASS, sliding.1), Some(Hopf::Supercritical));
        let [far, near] = [-1e-4, -1e-6].map(|distance| amplitude(&response(sliding, distance, 0.999)));
        assert!((far / near / 10.0 - 1.0).abs() < 0.05 && near < 0.03, "{ratio}: {far} {near}");
        assert_eq!(response(sliding, 1e-4, 0.999).outcome, Outcome::Settled, "{ratio}");
    }
}

#[test]
fn subcritical_cycles_are_there_at_once_and_on_both_sides() {
    for ratio in [1.2, 2.0, 6.0] {
        let sliding = sliding(ratio, 0.8);
        assert_eq!(Hopf::of(StateLaw::Ageing, sliding.0, MASS, sliding.1), Some(Hopf::Subcritical));
        // None is small: the response jumps to one that hardly depends on the distance,
        let [far, near] = [-1e-4, -1e-6].map(|distance| amplitude(&response(sliding, distance, 0.999)));
        assert!((far / near - 1.0).abs() < 0.05 && near > 0.5, "{ratio}: {far} {near}");
        // which is still there where small steps settle.
        let [small, large] = [0.999, 0.1].map(|v_i| response(sliding, 1e-4, v_i));
        assert_eq!(small.outcome, Outcome::Settled, "{ratio}");
        assert!((amplitude(&large) / near - 1.0).abs() < 0.05, "{ratio}: {large:?}");
    }
}

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
                assert!((found - expected).abs() < 1e-7 * expected.abs().max(1e-3), "{law:?} {mu} {found} {expected}");
            }
        }
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
