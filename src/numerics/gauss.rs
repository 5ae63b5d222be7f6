//! Gauss-Legendre rules on `[-1, 1]`, nodes and weights to the last bit.

use std::sync::OnceLock;

use super::double_double::DoubleDouble;

/// Largest rule that is kept.
pub const MOST_NODES: usize = 512;

/// Nodes and weights: `int_-1^1 f dx = sum w f(x)`, exact for polynomials of degree `2n - 1`.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// Nodes, rising.
    pub x: Vec<f64>,
    /// Weights, positive, of sum 2.
    pub w: Vec<f64>,
}

/// The rule with `n` nodes, made at its first use; `n` is taken into `1 ..= MOST_NODES`.
pub fn rule(n: usize) -> &'static Rule {
    static RULES: [OnceLock<Rule>; MOST_NODES] = [const { OnceLock::new() }; MOST_NODES];
    let n = n.clamp(1, MOST_NODES);
    RULES[n - 1].get_or_init(|| make(n))
}

/// Newton's method from Tricomi's estimate, the last step in double-double, so that rounding it gives the nearest
/// doubles.
fn make(n: usize) -> Rule {
    let (mut x, mut w) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n.div_ceil(2) {
        let mut t = libm::cos(std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5));
        if 2 * i + 1 == n {
            t = 0.0;
        }
        for _ in 0..4 {
            let (p, derivative) = legendre(n, DoubleDouble::new(t));
            t -= p.high / derivative.high;
        }
        let t = DoubleDouble::new(t);
        let one = DoubleDouble::new(1.0);
        let (p, derivative) = legendre(n, t);
        let step = -(p / derivative);
        let node = t + step;
        // P'' from Legendre's equation carries P' to the new node.
        let count = DoubleDouble::new((n * (n + 1)) as f64);
        let second = (DoubleDouble::new(2.0) * t * derivative - count * p) / (one - t * t);
        let slope = derivative + step * second;
        let weight = DoubleDouble::new(2.0) / ((one - node * node) * slope * slope);
        (x[n - 1 - i], w[n - 1 - i]) = (node.high, weight.high);
        (x[i], w[i]) = (-node.high, weight.high);
    }
    if n % 2 == 1 {
        x[n / 2] = 0.0;
    }
    Rule { x, w }
}

/// `P_n` and its derivative by the three-term recurrence (DLMF 18.9.1, 18.9.17).
fn legendre(n: usize, x: DoubleDouble) -> (DoubleDouble, DoubleDouble) {
    let (mut before, mut p) = (DoubleDouble::new(1.0), x);
    for k in 2..=n {
        let k = k as f64;
        let next =
            (DoubleDouble::new(2.0 * k - 1.0) * x * p - DoubleDouble::new(k - 1.0) * before) / DoubleDouble::new(k);
        (before, p) = (p, next);
    }
    let derivative = DoubleDouble::new(n as f64) * (before - x * p) / (DoubleDouble::new(1.0) - x * x);
    (p, derivative)
}
