//! Gauss-Legendre rules on `[-1, 1]`, nodes and weights to the last bit.

use std::sync::OnceLock;

use super::double_double::DoubleDouble;

/// Nodes of a panel with distant singularities. Chosen: two vectors of eight; the lengths of panels state the error.
pub const SHORT_NODES: usize = 16;

/// Nodes of the largest rule. Chosen: twice those of the largest panel of a landscape.
pub const MAX_NODES: usize = 512;

/// Nodes and weights: `int_-1^1 f dx = sum w f(x)`, exact for polynomials of degree `2n - 1`.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// Nodes, rising.
    pub x: Vec<f64>,
    /// Weights, positive, of sum 2.
    pub w: Vec<f64>,
}

/// The rule with `n` nodes, computed at its first use; `n` is clamped to `1 ..= MAX_NODES`.
pub fn rule(n: usize) -> &'static Rule {
    static RULES: [OnceLock<Rule>; MAX_NODES] = [const { OnceLock::new() }; MAX_NODES];
    let n = n.clamp(1, MAX_NODES);
    RULES[n - 1].get_or_init(|| make(n))
}

/// Newton's method in double-double from Tricomi's estimate, so that the rounded nodes are the nearest doubles.
fn make(n: usize) -> Rule {
    let (mut x, mut w) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n.div_ceil(2) {
        let mut node = DoubleDouble::new(libm::cos(std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)));
        for _ in 0..5 {
            let (p, slope) = legendre(n, node);
            let step = p / slope;
            node = node - step;
            // The next step is its square.
            if step.high.abs() < f64::EPSILON {
                break;
            }
        }
        let slope = legendre(n, node).1;
        let weight = DoubleDouble::new(2.0) / ((DoubleDouble::new(1.0) - node * node) * slope * slope);
        (x[n - 1 - i], w[n - 1 - i]) = (node.high, weight.high);
        (x[i], w[i]) = (-node.high, weight.high);
    }
    if n % 2 == 1 {
        x[n / 2] = 0.0;
    }
    Rule { x, w }
}

/// `P_n` and, inside `(-1, 1)`, its derivative by the three-term recurrence (DLMF 18.9.1, 18.9.17).
pub(super) fn legendre(n: usize, x: DoubleDouble) -> (DoubleDouble, DoubleDouble) {
    let (mut before, mut p) = (DoubleDouble::new(0.0), DoubleDouble::new(1.0));
    for k in 1..=n {
        let k = k as f64;
        let next =
            (DoubleDouble::new(2.0 * k - 1.0) * x * p - DoubleDouble::new(k - 1.0) * before) / DoubleDouble::new(k);
        (before, p) = (p, next);
    }
    let derivative = DoubleDouble::new(n as f64) * (before - x * p) / (DoubleDouble::new(1.0) - x * x);
    (p, derivative)
}

/// A Gauss rule with an even number of nodes, and the matrix that integrates the product of a function and the primitive of another one.
#[derive(Debug, Clone, PartialEq)]
pub struct Primitive {
    /// Positive nodes, rising.
    pub x: Vec<f64>,
    /// Their weights.
    pub w: Vec<f64>,
    /// The matrix of the bilinear form, row by row, padded with zeros to a multiple of [`ROWS`].
    pub matrix: Vec<f64>,
}

/// Rows of the matrix that are processed together. Chosen: two accumulators hide the latency of an addition.
pub const ROWS: usize = 2;

/// The rule with `2 half` nodes, computed at its first use.
pub fn primitive(half: usize) -> &'static Primitive {
    static RULES: [OnceLock<Primitive>; MAX_HALF] = [const { OnceLock::new() }; MAX_HALF];
    let half = half.clamp(1, MAX_HALF);
    RULES[half - 1].get_or_init(|| make_primitive(half))
}

/// Greatest `half` of a rule with a primitive. Chosen: the rules of all bins, up to 80 nodes.
pub const MAX_HALF: usize = 40;

fn make_primitive(half: usize) -> Primitive {
    let n = 2 * half;
    let rule = rule(n);
    let (x, w) = (rule.x[half..].to_vec(), rule.w[half..].to_vec());
    // P_0 to P_n at the nodes.
    let p: Vec<Vec<f64>> = x
        .iter()
        .map(|&x| {
            let mut p = vec![1.0, x];
            for k in 2..=n {
                let f = k as f64;
                p.push(((2.0 * f - 1.0) * x * p[k - 1] - (f - 1.0) * p[k - 2]) / f);
            }
            p[n] = 0.0;
            p
        })
        .collect();
    let entry = |i: usize, j: usize| {
        let mut sum = x[i];
        for k in (2..n).step_by(2) {
            sum += p[j][k] * (p[i][k + 1] - p[i][k - 1]);
        }
        0.5 * w[i] * w[j] * sum
    };
    let mut matrix = vec![0.0; half * half.next_multiple_of(ROWS)];
    for (place, cell) in matrix[..half * half].iter_mut().enumerate() {
        *cell = entry(place / half, place % half);
    }
    Primitive { x, w, matrix }
}
