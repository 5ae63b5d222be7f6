//! The Radau rule on `[0, 1]` with a node at 1: quadrature, indefinite integrals and interpolation on the same nodes.
//!
//! The nodes are those of Radau IIA collocation (Hairer and Wanner, Solving Ordinary Differential Equations II, section
//! IV.5), which damps stiff components. The integrals from 0 to every node follow from one product with a matrix.

use std::sync::OnceLock;

use super::MIN_INVERTIBLE;
use super::double_double::DoubleDouble;
use super::gauss::legendre;

/// Number of nodes. Chosen: two vectors of eight.
pub const NODES: usize = 16;

/// One value per node.
pub type Nodes = [f64; NODES];

/// Nodes, weights and the matrix of integration.
#[derive(Debug, Clone, PartialEq)]
pub struct Radau {
    /// Nodes `u`, ascending, the last one 1.
    pub u: Nodes,
    /// `1 - u`, each to the last bit, the last one 0.
    pub rest: Nodes,
    /// Weights: `int_0^1 f du = sum w f(u)`, exact for polynomials of degree `2 NODES - 2`.
    pub w: Nodes,
    /// `columns[k][j] = int_0^u[j]` of the polynomial of degree `NODES - 1` that is 1 at `u[k]` and 0 at the others.
    pub columns: [Nodes; NODES],
    /// Barycentric weights of the nodes and, last, of the additional node 0.
    barycentric: [f64; NODES + 1],
    /// `slopes[k][j]`: the slope at node `j` of the polynomial of degree `NODES` that is 1 at `u[k]` and 0 at the others
    /// and at 0.
    slopes: [Nodes; NODES],
    /// The slopes of these polynomials at 0.
    slopes_at_0: Nodes,
    /// Weights of the two highest Legendre coefficients that the nodes determine.
    highest: [Nodes; 2],
}

impl Radau {
    /// `int_0^u[j] f du` for every node, from the values of `f` at the nodes.
    #[inline(always)]
    pub fn integrals(&self, f: &Nodes) -> Nodes {
        combined(&self.columns, f)
    }

    /// The slopes at the nodes of the polynomial through 0 at 0 and `f` at the nodes.
    #[inline(always)]
    pub fn slopes(&self, f: &Nodes) -> Nodes {
        combined(&self.slopes, f)
    }

    /// The slope at 0 of the polynomial through 0 at 0 and `f` at the nodes.
    pub fn slope_at_0(&self, f: &Nodes) -> f64 {
        self.slopes_at_0.iter().zip(f).map(|(slope, f)| slope * f).sum()
    }

    /// An estimate of the quadrature error of `f`: the integrated magnitude of its two highest Legendre coefficients.
    pub fn unresolved(&self, f: &Nodes) -> f64 {
        let coefficient = |weights: &Nodes| weights.iter().zip(f).map(|(w, f)| w * f).sum::<f64>().abs();
        (coefficient(&self.highest[0]) + coefficient(&self.highest[1])) / (4 * NODES) as f64
    }

    /// The polynomial through `f` at the nodes, and through `start` at 0 if there is one, at `u` (barycentric formula).
    pub fn interpolate(&self, start: Option<f64>, f: &Nodes, u: f64) -> f64 {
        let (mut above, mut below) = (0.0, 0.0);
        if let Some(start) = start {
            if u.abs() < MIN_INVERTIBLE {
                return start;
            }
            below = self.barycentric[NODES] / u;
            above = below * start;
        }
        for ((&node, &value), &weight) in self.u.iter().zip(f).zip(&self.barycentric) {
            let distance = u - node;
            if distance == 0.0 {
                return value;
            }
            // The weights include the node 0.
            let fraction = if start.is_some() { weight / distance } else { weight * node / distance };
            above += fraction * value;
            below += fraction;
        }
        above / below
    }
}

/// `x^(1/NODES)`: the change of a panel's length for a change of its error at the nodes.
pub fn root_of_order(x: f64) -> f64 {
    x.sqrt().sqrt().sqrt().sqrt()
}

/// The sum of the columns of a matrix, each times the value of its node.
#[inline(always)]
fn combined(columns: &[Nodes; NODES], f: &Nodes) -> Nodes {
    let mut sum = [0.0; NODES];
    for (column, &value) in columns.iter().zip(f) {
        for j in 0..NODES {
            sum[j] += column[j] * value;
        }
    }
    sum
}

/// The rule, computed at its first use.
pub fn radau() -> &'static Radau {
    static RADAU: OnceLock<Radau> = OnceLock::new();
    RADAU.get_or_init(make)
}

/// The nodes of the method with `S` stages on `[0, 1]`, ascending: Newton's method on `P_S - P_(S-1)` in double-double.
pub(super) fn nodes<const S: usize>() -> [DoubleDouble; S] {
    let (one, half) = (DoubleDouble::new(1.0), DoubleDouble::new(0.5));
    std::array::from_fn(|i| {
        if i == S - 1 {
            return one;
        }
        let turn = 2.0 * std::f64::consts::PI * (S - 1 - i) as f64 / (2.0 * S as f64 - 1.0);
        let mut x = DoubleDouble::new(libm::cos(turn));
        for _ in 0..8 {
            let [(last, slope), (before, slope_before)] = [S, S - 1].map(|n| legendre(n, x));
            x = x - (last - before) / (slope - slope_before);
        }
        half * (one + x)
    })
}

fn make() -> Radau {
    let one = DoubleDouble::new(1.0);
    let half = DoubleDouble::new(0.5);
    let n = NODES as f64;
    let u = nodes::<NODES>();
    let nodes = u.map(|u| u + u - one);
    // P_0 to P_n at the nodes.
    let polynomials = nodes.map(|x| std::array::from_fn::<_, { NODES + 1 }, _>(|m| legendre(m, x).0));
    let count = DoubleDouble::new(n * n);
    let mut rule = Radau {
        u: [0.0; NODES],
        rest: [0.0; NODES],
        w: [0.0; NODES],
        columns: [[0.0; NODES]; NODES],
        barycentric: [1.0; NODES + 1],
        slopes: [[0.0; NODES]; NODES],
        slopes_at_0: [0.0; NODES],
        highest: [[0.0; NODES]; 2],
    };
    for k in 0..NODES {
        let last = polynomials[k][NODES - 1];
        let weight = half * (one + nodes[k]) / (count * last * last);
        rule.u[k] = u[k].high;
        rule.rest[k] = (one - u[k]).high;
        rule.w[k] = weight.high;
        for j in 0..NODES {
            // int_-1^x P_m = (P_(m+1) - P_(m-1))/(2m + 1); the rule keeps the P_m orthogonal up to m = n - 1.
            let mut sum = one + nodes[j];
            for m in 1..NODES {
                sum = sum + polynomials[k][m] * (polynomials[j][m + 1] - polynomials[j][m - 1]);
            }
            rule.columns[k][j] = (weight * half * sum).high;
        }
        for (i, highest) in rule.highest.iter_mut().enumerate() {
            let m = NODES - 2 + i;
            highest[k] = (weight * polynomials[k][m]).high * (2 * m + 1) as f64;
        }
    }
    let places: [f64; NODES + 1] = std::array::from_fn(|k| if k < NODES { rule.u[k] } else { 0.0 });
    for k in 0..=NODES {
        for j in (0..=NODES).filter(|&j| j != k) {
            // The factor keeps the products near 1; it cancels in the formula.
            rule.barycentric[k] /= 4.0 * (places[k] - places[j]);
        }
    }
    for j in 0..NODES {
        // The slope of a constant is 0. This determines the diagonal; the sum includes the node 0.
        let entry = |k: usize| rule.barycentric[k] / rule.barycentric[j] / (places[j] - places[k]);
        let others: Vec<f64> = (0..=NODES).map(|k| if k == j { 0.0 } else { entry(k) }).collect();
        for k in 0..NODES {
            rule.slopes[k][j] = if k == j { -others.iter().sum::<f64>() } else { others[k] };
        }
    }
    for k in 0..NODES {
        rule.slopes_at_0[k] = -rule.barycentric[k] / rule.barycentric[NODES] / rule.u[k];
    }
    rule
}
