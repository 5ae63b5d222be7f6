//! The first Lyapunov coefficient at the critical stiffness from the multilinear forms of the equations of motion.
//!
//! Y. A. Kuznetsov, Elements of Applied Bifurcation Theory, (5.39), for `(z, y, x)` in the scaled variables of the step
//! response; `q` and `p` are the eigenvectors of the Jacobian and of its transpose for the eigenvalue `i omega`.

use super::verdict::Verdict;
use crate::dataset::Row;
use crate::model::Law;

/// Real and imaginary part.
type Complex = [f64; 2];

type Vector = [Complex; 3];

fn add(x: Complex, y: Complex) -> Complex {
    [x[0] + y[0], x[1] + y[1]]
}

fn mul(x: Complex, y: Complex) -> Complex {
    [x[0] * y[0] - x[1] * y[1], x[0] * y[1] + x[1] * y[0]]
}

fn scale(x: Complex, factor: f64) -> Complex {
    [factor * x[0], factor * x[1]]
}

fn conjugate(x: Complex) -> Complex {
    [x[0], -x[1]]
}

fn inverse(x: Complex) -> Complex {
    let square = x[0] * x[0] + x[1] * x[1];
    [x[0] / square, -x[1] / square]
}

/// `y` with `matrix y = right`, by Gauss elimination with pivots.
fn solve(mut matrix: [[Complex; 3]; 3], mut right: Vector) -> Vector {
    let size = |x: Complex| x[0].hypot(x[1]);
    for k in 0..3 {
        let best = (k..3).max_by(|&i, &j| size(matrix[i][k]).total_cmp(&size(matrix[j][k]))).unwrap_or(k);
        matrix.swap(k, best);
        right.swap(k, best);
        let pivot = inverse(matrix[k][k]);
        for i in k + 1..3 {
            let fraction = scale(mul(matrix[i][k], pivot), -1.0);
            let row = matrix[k];
            matrix[i].iter_mut().zip(row).for_each(|(x, y)| *x = add(*x, mul(fraction, y)));
            right[i] = add(right[i], mul(fraction, right[k]));
        }
    }
    for k in (0..3).rev() {
        for j in k + 1..3 {
            right[k] = add(right[k], scale(mul(matrix[k][j], right[j]), -1.0));
        }
        right[k] = mul(right[k], inverse(matrix[k][k]));
    }
    right
}

/// The coefficient for a scaled mass `m v^2`; `None` where there is no Hopf point.
pub fn coefficient(Law { a, b }: Law, mass: f64) -> Option<f64> {
    let k = (b - a) * (1.0 + mass / a);
    let omega = ((k + a - b) / mass).sqrt();
    if !(b > a && mass > 0.0 && k.is_finite() && omega > 0.0) {
        return None;
    }
    let real = |x: f64| [x, 0.0];
    let jacobian = [[0.0, 0.0, -k], [0.0, -1.0, -1.0], [1.0 / mass, -b / mass, -a / mass]];
    let pull = |u: &Vector| scale(add(u[0], add(scale(u[1], -b), scale(u[2], -a))), 1.0 / mass);
    let second = |u: &Vector, v: &Vector| {
        let square = mul(u[2], v[2]);
        let last = add(mul(u[2], pull(v)), mul(v[2], pull(u)));
        [scale(square, -k), add(mul(u[1], v[1]), scale(square, -1.0)), scale(last, -1.0)]
    };
    let third = |u: &Vector, v: &Vector, w: &Vector| {
        let cube = mul(u[2], mul(v[2], w[2]));
        let pulls = [mul(mul(u[2], v[2]), pull(w)), mul(mul(u[2], w[2]), pull(v)), mul(mul(v[2], w[2]), pull(u))];
        let first = scale(add(mul(u[1], mul(v[1], w[1])), cube), -1.0);
        [scale(cube, -k), first, add(pulls[0], add(pulls[1], pulls[2]))]
    };
    let q = [[0.0, k / omega], scale(inverse([1.0, omega]), -1.0), real(1.0)];
    let p = [[0.0, 1.0 / (omega * mass)], scale(inverse([-1.0, omega]), b / mass), real(1.0)];
    let mirrored = q.map(conjugate);
    let still = solve(jacobian.map(|row| row.map(real)), second(&q, &mirrored));
    let shifted =
        std::array::from_fn(|i| std::array::from_fn(|j| [-jacobian[i][j], if i == j { 2.0 * omega } else { 0.0 }]));
    let double = solve(shifted, second(&q, &q));
    let (cubic, mean, twice) = (third(&q, &q, &mirrored), second(&q, &still), second(&mirrored, &double));
    let dot = |v: &Vector| p.iter().zip(v).fold([0.0; 2], |sum, (p, v)| add(sum, mul(conjugate(*p), *v)));
    let sum = std::array::from_fn(|i| add(cubic[i], add(scale(mean[i], -2.0), twice[i])));
    Some(mul(dot(&sum), inverse(dot(&q)))[0] / (2.0 * omega))
}

/// Size of the coefficient, in units of `a/mass`, below which rounding decides its sign.
const SIGN_ROUNDING: f64 = 1e-13;

/// Compares the first Lyapunov coefficient; the forms have `1/mass` in them.
pub fn compare_coefficient(verdict: &mut Verdict, row: &Row, law: Law, mass: f64, rtol: f64) {
    let expected = coefficient(law, mass);
    let noise = 1e-14 * law.a / mass / rtol;
    verdict.compare(row, "first_lyapunov_coefficient", expected, expected.map(|l| l.abs() + noise));
}

/// Compares the type of the Hopf point.
pub fn compare_kind(verdict: &mut Verdict, row: &Row, law: Law, mass: f64) {
    match coefficient(law, mass) {
        Some(l) if l.abs() < SIGN_ROUNDING * law.a / mass => verdict.miss("Hopf points between the two kinds"),
        Some(l) => verdict.compare_word(row, "hopf_type", if l < 0.0 { "supercritical" } else { "subcritical" }),
        None => verdict.demand_nothing(row, "hopf_type"),
    }
}
