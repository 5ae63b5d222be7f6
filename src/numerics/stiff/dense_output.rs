//! Dense output: the collocation polynomial of one step.

use super::collocation::Collocation;

/// The solution over one step: a polynomial of degree `S` that satisfies the equations at the `S` nodes.
///
/// At the end its order is that of the method, `2 S - 1`; in between it is `S`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DenseOutput<const N: usize, const S: usize> {
    /// Time at its start.
    pub t: f64,
    /// Duration.
    pub h: f64,
    /// Variables at its start.
    pub start: [f64; N],
    /// Variables at its end.
    pub end: [f64; N],
    /// Coefficients of `u … u^S`, `u` from 0 to 1 along the step.
    powers: [[f64; S]; N],
}

impl<const N: usize, const S: usize> DenseOutput<N, S> {
    /// The polynomial through `start` and through `start + change` at the nodes.
    #[inline(always)]
    pub(super) fn new(rule: &Collocation<S>, t: f64, h: f64, start: [f64; N], change: &[[f64; S]; N]) -> Self {
        let mut powers = [[0.0; S]; N];
        let mut end = start;
        for r in 0..N {
            powers[r] = rule.powers.map(|row| row.iter().zip(&change[r]).map(|(p, c)| p * c).sum());
            end[r] += change[r][S - 1];
        }
        DenseOutput { t, h, start, end, powers }
    }

    /// The polynomial with the coefficients `powers` of `u … u^S`.
    #[inline(always)]
    pub fn from_powers(t: f64, h: f64, start: [f64; N], powers: [[f64; S]; N]) -> Self {
        let mut dense_output = DenseOutput { t, h, start, end: start, powers };
        for r in 0..N {
            dense_output.end[r] = dense_output.value(r, 1.0);
        }
        dense_output
    }

    /// This polynomial as one of a degree `P` above `S`.
    #[inline(always)]
    pub fn raised<const P: usize>(&self) -> DenseOutput<N, P> {
        let &DenseOutput { t, h, start, end, powers } = self;
        DenseOutput {
            t,
            h,
            start,
            end,
            powers: powers.map(|row| std::array::from_fn(|k| if k < S { row[k] } else { 0.0 })),
        }
    }

    /// Time at `u`.
    pub fn time(&self, u: f64) -> f64 {
        self.t + u * self.h
    }

    /// The part of the polynomial between two fractions of the step, as a step of its own.
    pub fn between(&self, from: f64, to: f64) -> Self {
        let mut powers = self.powers;
        for row in &mut powers {
            // Repeated Horner schemes give the coefficients of the powers of `u - from`; the constant is dropped.
            for pass in 0..S {
                for k in (pass.saturating_sub(1)..S - 1).rev() {
                    row[k] += from * row[k + 1];
                }
            }
            let mut scale = 1.0;
            for power in row {
                scale *= to - from;
                *power *= scale;
            }
        }
        let start = std::array::from_fn(|r| self.value(r, from));
        DenseOutput::from_powers(self.t + from * self.h, (to - from) * self.h, start, powers)
    }

    /// Change of variable `r` since the start at `u`, the fraction of the step (beyond 1: extrapolated).
    #[inline(always)]
    pub fn change(&self, r: usize, u: f64) -> f64 {
        let mut sum = 0.0;
        for k in (0..S).rev() {
            sum = sum * u + self.powers[r][k];
        }
        sum * u
    }

    /// Variable `r` at `u`.
    #[inline(always)]
    pub fn value(&self, r: usize, u: f64) -> f64 {
        self.start[r] + self.change(r, u)
    }

    /// Time derivative of variable `r` at `u`.
    #[inline(always)]
    pub fn slope(&self, r: usize, u: f64) -> f64 {
        let mut sum = 0.0;
        for k in (0..S).rev() {
            sum = sum * u + (k + 1) as f64 * self.powers[r][k];
        }
        sum / self.h
    }
}
