//! The first Lyapunov coefficient at the critical stiffness from the multilinear forms of the equations of motion.
//!
//! Y. A. Kuznetsov, Elements of Applied Bifurcation Theory, (5.39), for `(z, y, x)` in the scaled variables of the step
//! response; `q` and `p` are the eigenvectors of the Jacobian and of its transpose for the eigenvalue `i omega`.

use nalgebra::{Complex, Matrix3, Vector3};

use super::CheckedRow;
use crate::model::{Law, StateLaw};

type Number = Complex<f64>;
type Vector = Vector3<Number>;

const ZERO: Number = Number::new(0.0, 0.0);

/// A Hopf point: derivatives of the evolution law, material, and scaled mass `m v^2`.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Second and third derivative of `G` at 1 (docs/derivations.md).
    evolution: [f64; 2],
    /// Whether the coefficient is 0 without mass.
    is_degenerate: bool,
    law: Law,
    mass: f64,
}

impl Point {
    /// That of a law of the state.
    pub fn new(state: StateLaw, law: Law, mass: f64) -> Point {
        match state {
            StateLaw::Ageing => Point::interpolated(1.0, law, mass),
            StateLaw::Slip => Point::interpolated(0.0, law, mass),
            StateLaw::Prz => Point { evolution: [-1.0, 0.0], is_degenerate: false, law, mass },
        }
    }

    /// That of the law between slip, 0, and ageing, 1.
    pub fn interpolated(eps: f64, law: Law, mass: f64) -> Point {
        Point { evolution: [eps - 1.0, (1.0 - eps) * (1.0 + eps)], is_degenerate: true, law, mass }
    }
}

/// The second and third derivatives of `y' = e^-y G(e^(x + y))` along vectors `(y, x + y)`.
fn evolution([second, third]: [f64; 2], vectors: [[Number; 2]; 3]) -> [Number; 2] {
    let [[u, p], [v, q], [w, r]] = vectors;
    // Derivatives of G(e^s) with respect to s.
    let (second, third) = (second - 1.0, third + 3.0 * second - 1.0);
    let once = u * q * r + v * p * r + w * p * q;
    let twice = r * u * v + q * u * w + p * v * w;
    [p * q * second + u * q + v * p, p * q * r * third - once * second - twice]
}

impl Point {
    /// The coefficient; `None` where there is no Hopf point or where it is degenerate.
    fn coefficient(&self) -> Option<f64> {
        let Point { evolution: derivatives, is_degenerate, law: Law { a, b }, mass } = *self;
        let k = (b - a) * (1.0 + mass / a);
        if !(b > a && mass >= 0.0 && k.is_finite()) || (mass == 0.0 && is_degenerate) {
            return None;
        }
        let omega = ((b - a) / a).sqrt();
        // Without mass the balance of forces gives x, and a third variable is apart from the others.
        let is_massless = mass == 0.0;
        let force = |u: &Vector| u[0] - u[1] * b;
        let x = |u: &Vector| if is_massless { force(u) / a } else { u[2] };
        let pull = |u: &Vector| if is_massless { ZERO } else { (force(u) - u[2] * a) / mass };
        let pair = |u: &Vector| [u[1], u[1] + x(u)];
        let second = |u: &Vector, v: &Vector| {
            let [square, _] = evolution(derivatives, [pair(u), pair(v), [ZERO; 2]]);
            Vector::new(x(u) * x(v) * -k, square, -(x(u) * pull(v) + x(v) * pull(u)))
        };
        let third = |u: &Vector, v: &Vector, w: &Vector| {
            let pulls = x(u) * x(v) * pull(w) + x(u) * x(w) * pull(v) + x(v) * x(w) * pull(u);
            let [_, cube] = evolution(derivatives, [pair(u), pair(v), pair(w)]);
            Vector::new(x(u) * x(v) * x(w) * -k, cube, pulls)
        };
        let (one, i) = (Number::new(1.0, 0.0), Number::i());
        let (jacobian, last, p) = if is_massless {
            let jacobian = Matrix3::new(-k / a, k * b / a, 0.0, -1.0 / a, b / a - 1.0, 0.0, 0.0, 0.0, -1.0);
            (jacobian, ZERO, Vector::new(one, Number::new(-k, omega * a), ZERO))
        } else {
            let jacobian = Matrix3::new(0.0, 0.0, -k, 0.0, -1.0, -1.0, 1.0 / mass, -b / mass, -a / mass);
            (jacobian, one, Vector::new(i / (omega * mass), one * (b / mass) / (i * omega - one), one))
        };
        let q = Vector::new(i * (k / omega), -one / (one + i * omega), last);
        let (mirrored, jacobian) = (q.conjugate(), jacobian.map(|x| Number::new(x, 0.0)));
        let still = jacobian.lu().solve(&second(&q, &mirrored))?;
        let double = (Matrix3::from_diagonal_element(i * (2.0 * omega)) - jacobian).lu().solve(&second(&q, &q))?;
        let sum = third(&q, &q, &mirrored) - second(&q, &still) * Number::new(2.0, 0.0) + second(&mirrored, &double);
        Some((p.dotc(&sum) / p.dotc(&q)).re / (2.0 * omega))
    }

    /// Rounding of the coefficient. Chosen: a hundred roundings of its terms, which have `a/mass` in them.
    fn rounding(&self) -> f64 {
        1e-14 * if self.mass > 0.0 { self.law.a / self.mass } else { 1.0 }
    }

    /// Compares the first Lyapunov coefficient.
    pub fn compare_coefficient(&self, row: &mut CheckedRow<'_>) {
        let expected = self.coefficient();
        let noise = self.rounding() / row.context.rtol;
        row.compare_relative("first_lyapunov_coefficient", expected, expected.map_or(0.0, f64::abs) + noise);
    }

    /// Compares the type of the Hopf point.
    pub fn compare_kind(&self, row: &mut CheckedRow<'_>) {
        match self.coefficient() {
            Some(l) if l.abs() < 10.0 * self.rounding() => row.miss("Hopf points between the two kinds"),
            Some(l) => row.compare_word("hopf_type", if l < 0.0 { "supercritical" } else { "subcritical" }),
            None => {}
        }
    }
}
