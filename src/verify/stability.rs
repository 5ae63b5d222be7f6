//! `stability`: the roots of the characteristic polynomial with 32 digits: a real one by bisection, the others from what is left.

use super::motion::{bisect, tau};
use super::{Checked, CheckedRow, hopf};
use crate::model::{Friction, Law, Transition};
use crate::numerics::double_double::DoubleDouble;
use crate::protocol::SpringBlock;
use crate::table::{slider, transition};

/// Bisections of a real root. Derived: 32 digits of a root by 50 decades below its bound.
const BISECTIONS: u32 = 280;

/// A real root of `x^3 + c_2 x^2 + c_1 x + c_0` with `c_0 > 0`.
fn real_root(c: [DoubleDouble; 3]) -> DoubleDouble {
    // Fujiwara's bound of all roots.
    let bound = 2.0 * (0..3).map(|n| c[n].high.abs().powf(1.0 / (3 - n) as f64)).fold(0.0, f64::max);
    let (mut low, mut high) = (DoubleDouble::new(-bound), DoubleDouble::new(0.0));
    for _ in 0..BISECTIONS {
        let x = (low + high) * DoubleDouble::new(0.5);
        *if (((x + c[2]) * x + c[1]) * x + c[0]).high > 0.0 { &mut high } else { &mut low } = x;
    }
    high
}

/// Growth rate, frequency and decay rate over `v` from the roots of `x^2 + p x + q` and perhaps another one.
fn modes([p, q]: [DoubleDouble; 2], other: Option<f64>) -> [f64; 3] {
    let half = p * DoubleDouble::new(0.5);
    let square = (half * half - q).high;
    if square < 0.0 {
        return [-half.high, (-square).sqrt(), other.unwrap_or(f64::NAN)];
    }
    // The smaller root follows from the product.
    let larger = -(half.high + square.sqrt().copysign(half.high));
    let all = [larger, q.high / larger].into_iter().chain(other);
    [all.clone().fold(f64::NEG_INFINITY, f64::max), 0.0, all.fold(f64::INFINITY, f64::min)]
}

/// Compares the borders of smooth optima: bisections of Legendre's condition `u G''/G' <= a/(tau + a)` at one velocity.
fn smoothness(row: &mut CheckedRow<'_>, problem: &Transition) {
    let Law { a, b } = problem.law;
    let [slow, fast] = [problem.v_i.min(problem.v_f), problem.v_i.max(problem.v_f)].map(f64::ln);
    let steady = 1.0 + (a - b) * if b > a { slow } else { fast };
    // At 10 times the steady velocity.
    let (ln_u, tau) = (10.0_f64.ln(), steady + a * 10.0_f64.ln());
    let mixture = bisect(0.0, 1.0, |slip: f64| slip * (tau + a) <= a * (1.0 + slip * ln_u));
    row.compare("slip_fraction_smooth", (steady > 0.0).then_some(mixture));
    let tau = 1.0 - b * fast;
    let interpolated = bisect(0.0, 1.0, |slip: f64| {
        let power = (-(1.0 - slip) * fast).exp();
        power > slip && slip * (1.0 - slip) * (tau + a) <= a * (power - slip)
    });
    row.compare("law_eps_smooth", (tau > (b - a).max(0.0)).then_some(1.0 - interpolated));
}

pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let (problem, state) = (transition(&row.point), row.point.state_law());
    let SpringBlock { k, m, .. } = slider(&row.point);
    let double = DoubleDouble::new;
    let friction = row.context.friction;
    let law = |v: f64| match friction {
        Friction::Log => problem.law,
        // The logarithm with the same derivatives at steady sliding.
        Friction::Regularised => {
            let Law { a, b } = problem.law;
            let reduced = (tau(friction, &problem.law, v, 1.0 / v) / a).tanh();
            Law { a: a * reduced, b: b * reduced }
        }
    };
    let critical = |v: f64| {
        let (a, b) = (double(law(v).a), double(law(v).b));
        (b - a) * (double(1.0) + double(m) * double(v) * double(v) / a)
    };
    let (a, b) = (double(law(problem.v_f).a), double(law(problem.v_f).b));
    let weakening = b - a;
    row.compare("k_od", weakening.high);
    for (k_c, stable, v) in [("k_c_i", "stable_i", problem.v_i), ("k_c_f", "stable_f", problem.v_f)] {
        let critical = critical(v);
        row.compare(k_c, critical.high);
        let is_stable = !k.is_finite() || (double(k) - critical).high > 0.0;
        row.compare_word(stable, if is_stable { "true" } else { "false" });
    }
    if friction == Friction::Regularised {
        // k is critical there, and no twice as great velocity is stable.
        if let Some(v) = row.number("v_crit") {
            row.push("v_crit", (critical(v).high / k - 1.0).abs());
            row.push("v_crit", if critical(2.0 * v).high < k { f64::INFINITY } else { 0.0 });
        } else if m > 0.0 && problem.law.b > problem.law.a && k.is_finite() {
            // Sliding that is stable somewhere is unstable at high velocities.
            let is_stable = [problem.v_i, problem.v_f].map(|v| critical(v).high < k);
            row.judge("v_crit", !is_stable.contains(&true), "a number");
        }
    } else {
        let square = (a * (double(k) / weakening - double(1.0)) / double(m)).high;
        let exists = weakening.high > 0.0 && square > 0.0 && square.is_finite();
        row.compare("v_crit", exists.then(|| square.sqrt()));
        let mass = m * problem.v_f * problem.v_f;
        let hopf = match row.number("law_eps") {
            Some(eps) => hopf::Point::interpolated(eps, problem.law, mass),
            None => hopf::Point::new(state, problem.law, mass),
        };
        hopf.compare_kind(row);
        hopf.compare_coefficient(row);
        smoothness(row, &problem);
    }
    eigenvalues(row, law(problem.v_f), (k, m, problem.v_f));
    Ok(())
}

/// Compares the eigenvalues at steady sliding with `v`, from the roots of the characteristic polynomial.
fn eigenvalues(row: &mut CheckedRow<'_>, law: Law, (k, m, v): (f64, f64, f64)) {
    if !k.is_finite() {
        return;
    }
    let double = DoubleDouble::new;
    let a = double(law.a);
    let weakening = double(law.b) - a;
    let inertia = double(m) * double(v) * double(v);
    let (sum, c) = (inertia + a, double(k) - weakening);
    let [growth, frequency, decay] = if m > 0.0 {
        let [c_0, c_1, c_2] = [double(k) / inertia, c / inertia, sum / inertia];
        let root = real_root([c_0, c_1, c_2]);
        let q = -(c_0 / root);
        // Of both formulas that with the smaller terms.
        let p = if c_2.high < c_1.high.abs() / root.high.abs() { c_2 + root } else { (q - c_1) / root };
        modes([p, q], Some(root.high))
    } else {
        modes([c / a, double(k) / a], None)
    };
    // At the critical stiffness the growth rate is 0 and has no relative error.
    let modulus = growth.hypot(frequency);
    row.compare_relative("growth_rate", v * growth, v * growth.abs().max(1e-20 * modulus));
    // Near a double root the frequency is the square root of a small difference.
    row.compare_relative("frequency", v * frequency, v * modulus);
    row.compare("decay_rate", (m > 0.0).then_some(v * decay));
}
