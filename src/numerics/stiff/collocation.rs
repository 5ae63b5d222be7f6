//! Coefficients of Radau IIA collocation with `S` stages: nodes, differentiation, integration, the polynomial's powers.
//!
//! The nodes are the zeros of `P_S - P_(S-1)` on `[0, 1]`, the last one 1 (Hairer and Wanner, Solving Ordinary Differential Equations II,
//! section IV.5). All other coefficients are computed from them in double-double and rounded once.

use std::sync::OnceLock;

use crate::numerics::double_double::DoubleDouble;
use crate::numerics::radau;

/// The method with `S` stages: order `2 S - 1`, stiffly accurate, L-stable.
#[derive(Debug, Clone, PartialEq)]
pub struct Collocation<const S: usize> {
    /// Nodes `c`, ascending, the last one 1.
    pub nodes: [f64; S],
    /// `differentiation[i][j]`: slope at node `i` of the polynomial of degree `S` that is 1 at node `j` and 0 at the
    /// others and at 0. The inverse of [`Collocation::integration`].
    pub differentiation: [[f64; S]; S],
    /// The matrix `A` of the method: `integration[i][j]` is the integral from 0 to node `i` of the polynomial of degree
    /// `S - 1` that is 1 at node `j` and 0 at the others.
    pub integration: [[f64; S]; S],
    /// `powers[k][j]`: coefficient of `u^(k+1)` in the polynomial of degree `S` that is 1 at node `j` and 0 at the
    /// others and at 0. The first row has their slopes at 0.
    pub powers: [[f64; S]; S],
}

/// The method of order 9.
pub fn radau_iia_9() -> &'static Collocation<5> {
    static RULE: OnceLock<Collocation<5>> = OnceLock::new();
    RULE.get_or_init(Collocation::make)
}

impl<const S: usize> Collocation<S> {
    /// The method, computed.
    fn make() -> Collocation<S> {
        let one = DoubleDouble::new(1.0);
        let c = radau::nodes::<S>();
        // The basis polynomial j is u/c_j prod_(k != j) (u - c_k)/(c_j - c_k): its factors, multiplied out one by one.
        let mut powers = [[DoubleDouble::new(0.0); S]; S];
        for j in 0..S {
            // Coefficients of u^1 … u^S, starting from u/c_j.
            let mut coefficients = [DoubleDouble::new(0.0); S];
            coefficients[0] = one / c[j];
            for (degree, k) in (0..S).filter(|&k| k != j).enumerate() {
                let scale = one / (c[j] - c[k]);
                for i in (0..=degree + 1).rev() {
                    let lower = if i > 0 { coefficients[i - 1] } else { DoubleDouble::new(0.0) };
                    let same = if i <= degree { coefficients[i] } else { DoubleDouble::new(0.0) };
                    coefficients[i] = scale * (lower - c[k] * same);
                }
            }
            for k in 0..S {
                powers[k][j] = coefficients[k];
            }
        }
        let slope = |i: usize, j: usize| {
            let horner = |sum: DoubleDouble, k: usize| sum * c[i] + DoubleDouble::new((k + 1) as f64) * powers[k][j];
            (0..S).rev().fold(DoubleDouble::new(0.0), horner)
        };
        // int_0^c_i of the polynomial of degree S - 1 in its powers; its coefficients are those of u^1 … u^S times c_j,
        // less one power.
        let integral = |i: usize, j: usize| {
            let mut sum = DoubleDouble::new(0.0);
            let mut power = one;
            for (k, row) in powers.iter().enumerate() {
                power = power * c[i];
                sum = sum + row[j] * c[j] * power / DoubleDouble::new((k + 1) as f64);
            }
            sum
        };
        Collocation {
            nodes: c.map(|node| node.high),
            differentiation: std::array::from_fn(|i| std::array::from_fn(|j| slope(i, j).high)),
            integration: std::array::from_fn(|i| std::array::from_fn(|j| integral(i, j).high)),
            powers: powers.map(|row| row.map(|value| value.high)),
        }
    }
}
