//! `stability`: all roots of the characteristic polynomial at once, by simultaneous iteration with 32 digits.

use super::verdict::{Context, Verdict, number, state_law, transition};
use super::{arcsinh, hopf};
use crate::dataset::Row;
use crate::model::{Friction, Law, Transition};
use crate::numerics::double_double::DoubleDouble;

type Complex = [DoubleDouble; 2];

const ZERO: DoubleDouble = DoubleDouble::new(0.0);
const ONE: Complex = [DoubleDouble::new(1.0), ZERO];

fn difference(x: Complex, y: Complex) -> Complex {
    [x[0] - y[0], x[1] - y[1]]
}

fn product(x: Complex, y: Complex) -> Complex {
    [x[0] * y[0] - x[1] * y[1], x[0] * y[1] + x[1] * y[0]]
}

fn quotient(x: Complex, y: Complex) -> Complex {
    let square = y[0] * y[0] + y[1] * y[1];
    let [re, im] = product(x, [y[0], -y[1]]);
    [re / square, im / square]
}

fn size(x: Complex) -> f64 {
    x[0].high.hypot(x[1].high)
}

/// Greatest number of iterations. Chosen: roots that differ by many decades separate by a constant factor in each iteration.
const ROUNDS: u32 = 2000;

/// The roots of `x^n + c[n - 1] x^(n - 1) + … + c[0]` (Weierstrass, Durand, Kerner); `None` if the iteration does not converge.
fn roots<const N: usize>(c: [DoubleDouble; N]) -> Option<[Complex; N]> {
    let value = |x: Complex| {
        c.iter().rev().fold(ONE, |sum, &c| {
            let [re, im] = product(sum, x);
            [re + c, im]
        })
    };
    // Start on a circle that encloses all roots, at places that are not real, no two of them conjugate.
    let bound = (0..N).map(|n| (2.0 * c[n].high.abs()).powf(1.0 / (N - n) as f64)).fold(0.0, f64::max);
    let mut found = std::array::from_fn(|n| {
        let angle = 0.4 + 2.0 * std::f64::consts::PI * n as f64 / N as f64;
        [bound * angle.cos(), bound * angle.sin()].map(DoubleDouble::new)
    });
    for _ in 0..ROUNDS {
        let mut rests = true;
        for n in 0..N {
            let x = found[n];
            let others = (0..N).filter(|&m| m != n).fold(ONE, |all, m| product(all, difference(x, found[m])));
            let step = quotient(value(x), others);
            found[n] = difference(x, step);
            rests &= size(step) <= 1e-24 * size(x);
        }
        if rests {
            return Some(found);
        }
    }
    None
}

/// Growth rate, frequency and decay rate over `v` from all eigenvalues.
fn modes(mut roots: Vec<Complex>) -> [f64; 3] {
    let is_real = |root: &Complex| root[1].high.abs() <= 1e-20 * size(*root);
    // The pair first, then by descending real part.
    roots.sort_by(|x, y| is_real(x).cmp(&is_real(y)).then(y[0].high.total_cmp(&x[0].high)));
    let frequency = if is_real(&roots[0]) { 0.0 } else { roots[0][1].high.abs() };
    [roots[0][0].high, frequency, roots.last().map_or(f64::NAN, |root| root[0].high)]
}

/// Compares the borders of smooth optima: bisections of Legendre's condition `u G''/G' <= a/(tau + a)` at one velocity.
fn smoothness(verdict: &mut Verdict, row: &Row, problem: &Transition) {
    let Law { a, b } = problem.law;
    let bisected = |holds: &dyn Fn(f64) -> bool| {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            *if holds(middle) { &mut low } else { &mut high } = middle;
        }
        low
    };
    let [slow, fast] = [problem.v_i.min(problem.v_f), problem.v_i.max(problem.v_f)].map(f64::ln);
    let steady = 1.0 + (a - b) * if b > a { slow } else { fast };
    // At 10 times the steady velocity.
    let (ln_u, tau) = (10.0_f64.ln(), steady + a * 10.0_f64.ln());
    let mixture = bisected(&|slip: f64| slip * (tau + a) <= a * (1.0 + slip * ln_u));
    verdict.compare(row, "slip_fraction_smooth", (steady > 0.0).then_some(mixture), None);
    let tau = 1.0 - b * fast;
    let interpolated = bisected(&|slip: f64| {
        let power = (-(1.0 - slip) * fast).exp();
        power > slip && slip * (1.0 - slip) * (tau + a) <= a * (power - slip)
    });
    verdict.compare(row, "law_eps_smooth", (tau > (b - a).max(0.0)).then_some(1.0 - interpolated), None);
}

pub fn check(row: &Row, context: &Context, rtol: f64) -> Verdict {
    let numbers = number(row, "k").zip(number(row, "m"));
    let (Some(problem), Some(state), Some((k, m))) = (transition(row), state_law(row), numbers) else {
        return Verdict::unchecked("an axis is missing");
    };
    let double = DoubleDouble::new;
    let law = |v: f64| match context.friction {
        Friction::Log => problem.law,
        Friction::Regularised => arcsinh::linearised(&problem.law, v),
    };
    let critical = |v: f64| {
        let (a, b) = (double(law(v).a), double(law(v).b));
        (b - a) * (double(1.0) + double(m) * double(v) * double(v) / a)
    };
    let (a, b) = (double(law(problem.v_f).a), double(law(problem.v_f).b));
    let weakening = b - a;
    let mut verdict = Verdict::default();
    verdict.compare(row, "k_od", Some(weakening.high), None);
    for (k_c, stable, v) in [("k_c_i", "stable_i", problem.v_i), ("k_c_f", "stable_f", problem.v_f)] {
        let critical = critical(v);
        verdict.compare(row, k_c, Some(critical.high), None);
        let is_stable = !k.is_finite() || (double(k) - critical).high > 0.0;
        verdict.compare_word(row, stable, if is_stable { "yes" } else { "no" });
    }
    if context.friction == Friction::Regularised {
        // k is critical there, and no twice as great velocity is stable.
        if let Some(v) = number(row, "v_crit") {
            verdict.push("v_crit", (critical(v).high / k - 1.0).abs());
            verdict.push("v_crit", if critical(2.0 * v).high < k { f64::INFINITY } else { 0.0 });
        }
    } else {
        let square = (a * (double(k) / weakening - double(1.0)) / double(m)).high;
        let exists = weakening.high > 0.0 && square > 0.0 && square.is_finite();
        verdict.compare(row, "v_crit", exists.then(|| square.sqrt()), None);
        let mass = m * problem.v_f * problem.v_f;
        let hopf = match number(row, "law_eps") {
            Some(eps) => hopf::Point::interpolated(eps, problem.law, mass),
            None => hopf::Point::new(state, problem.law, mass),
        };
        hopf.compare_kind(&mut verdict, row);
        hopf.compare_coefficient(&mut verdict, row, rtol);
        smoothness(&mut verdict, row, &problem);
    }
    eigenvalues(&mut verdict, row, law(problem.v_f), (k, m, problem.v_f));
    verdict
}

/// Compares the eigenvalues at steady sliding with `v`, from the roots of the characteristic polynomial.
fn eigenvalues(verdict: &mut Verdict, row: &Row, law: Law, (k, m, v): (f64, f64, f64)) {
    if !k.is_finite() {
        for column in ["growth_rate", "frequency", "decay_rate"] {
            verdict.compare(row, column, None, None);
        }
        return;
    }
    let double = DoubleDouble::new;
    let a = double(law.a);
    let weakening = double(law.b) - a;
    let inertia = double(m) * double(v) * double(v);
    let (sum, c) = (inertia + a, double(k) - weakening);
    let all = if m > 0.0 {
        roots([double(k) / inertia, c / inertia, sum / inertia]).map(Vec::from)
    } else {
        roots([double(k) / a, c / a]).map(Vec::from)
    };
    let Some([growth, frequency, decay]) = all.map(modes) else {
        verdict.miss("two eigenvalues are too close to be distinguished");
        return;
    };
    // At the critical stiffness the growth rate is 0 and has no relative error.
    let modulus = growth.hypot(frequency);
    verdict.compare(row, "growth_rate", Some(v * growth), Some(v * growth.abs().max(1e-20 * modulus)));
    // Near a double root the frequency is the square root of a small difference.
    verdict.compare(row, "frequency", Some(v * frequency), Some(v * modulus));
    verdict.compare(row, "decay_rate", (m > 0.0).then_some(v * decay), None);
}
