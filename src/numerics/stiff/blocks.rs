//! The linear system of a Newton step: one block of `S x S` for each pair of variables, eliminated variable by variable.
//!
//! The equations couple the stages only through the slopes, so off-diagonal blocks are diagonal or empty at first. A chain of three variables
//! costs little more than two small inversions.

#![expect(clippy::needless_range_loop, reason = "matrices are written with the indices of their formulas")]

use super::Linearised;
use super::collocation::Collocation;

pub(super) type Square<const S: usize> = [[f64; S]; S];

/// The matrix `mass/h W - J`, factorised.
#[derive(Debug, Clone)]
pub(super) struct Factors<const N: usize, const S: usize> {
    /// Inverses of the pivot blocks.
    pivots: [Square<S>; N],
    /// Below the diagonal: the multipliers; above it: the blocks.
    others: [[OffDiagonal<S>; N]; N],
}

/// An off-diagonal block.
#[derive(Debug, Clone, Copy)]
enum OffDiagonal<const S: usize> {
    Empty,
    Diagonal([f64; S]),
    Full(Square<S>),
}

impl<const N: usize, const S: usize> Factors<N, S> {
    /// Factorises the matrix; `None` if a pivot block is singular or not finite.
    #[inline(always)]
    pub(super) fn new(rule: &Collocation<S>, h: f64, at: &Linearised<N, S>) -> Option<Self> {
        let mut pivots = [[[0.0; S]; S]; N];
        let mut others = [[OffDiagonal::Empty; N]; N];
        for r in 0..N {
            for i in 0..S {
                let fraction = at.mass[r][i] / h;
                for j in 0..S {
                    pivots[r][i][j] = fraction * rule.differentiation[i][j];
                }
                pivots[r][i][i] -= at.jacobian[r][r][i];
            }
            for c in (0..N).filter(|&c| c != r) {
                let coupling = &at.jacobian[r][c];
                if coupling.iter().any(|&x| x != 0.0) {
                    others[r][c] = OffDiagonal::Diagonal(coupling.map(|x| -x));
                }
            }
        }
        for p in 0..N {
            pivots[p] = match integral(rule, h, at, p) {
                Some(known) if p == 0 => known,
                _ => inverse(pivots[p])?,
            };
            for r in p + 1..N {
                let Some(multiplier) = others[r][p].times(&pivots[p]) else { continue };
                for c in p + 1..N {
                    let Some(change) = others[p][c].multiplied(&multiplier) else { continue };
                    if r == c {
                        subtract(&mut pivots[r], &change);
                    } else {
                        let mut full = others[r][c].full();
                        subtract(&mut full, &change);
                        others[r][c] = OffDiagonal::Full(full);
                    }
                }
                others[r][p] = OffDiagonal::Full(multiplier);
            }
        }
        Some(Factors { pivots, others })
    }

    /// Overwrites the right-hand side with the solution.
    #[inline(always)]
    pub(super) fn solve(&self, x: &mut [[f64; S]; N]) {
        for r in 1..N {
            let (known, rest) = x.split_at_mut(r);
            for (block, known) in self.others[r].iter().zip(known) {
                block.reduce(&mut rest[0], known);
            }
        }
        for p in (0..N).rev() {
            let mut right = x[p];
            for c in p + 1..N {
                self.others[p][c].reduce(&mut right, &x[c]);
            }
            for i in 0..S {
                let mut sum = 0.0;
                for j in 0..S {
                    sum += self.pivots[p][i][j] * right[j];
                }
                x[p][i] = sum;
            }
        }
    }
}

/// The inverse of the pivot of an equation that does not contain its own variable: the matrix of integration.
#[inline(always)]
fn integral<const N: usize, const S: usize>(
    rule: &Collocation<S>,
    h: f64,
    at: &Linearised<N, S>,
    p: usize,
) -> Option<Square<S>> {
    let mass = at.mass[p][0];
    let plain = at.jacobian[p][p].iter().all(|&x| x == 0.0) && at.mass[p].iter().all(|&x| x == mass);
    plain.then(|| rule.integration.map(|row| row.map(|x| x * (h / mass))))
}

impl<const S: usize> OffDiagonal<S> {
    /// `x - self y`.
    #[inline(always)]
    fn reduce(&self, x: &mut [f64; S], y: &[f64; S]) {
        match self {
            OffDiagonal::Empty => {}
            OffDiagonal::Diagonal(d) => {
                for i in 0..S {
                    x[i] -= d[i] * y[i];
                }
            }
            OffDiagonal::Full(square) => {
                for i in 0..S {
                    for j in 0..S {
                        x[i] -= square[i][j] * y[j];
                    }
                }
            }
        }
    }

    /// `self right`; `None` if empty.
    #[inline(always)]
    fn times(&self, right: &Square<S>) -> Option<Square<S>> {
        match self {
            OffDiagonal::Empty => None,
            OffDiagonal::Diagonal(d) => Some(std::array::from_fn(|i| right[i].map(|x| d[i] * x))),
            OffDiagonal::Full(square) => Some(product(square, right)),
        }
    }

    /// `left self`; `None` if empty.
    #[inline(always)]
    fn multiplied(&self, left: &Square<S>) -> Option<Square<S>> {
        match self {
            OffDiagonal::Empty => None,
            OffDiagonal::Diagonal(d) => Some(left.map(|row| std::array::from_fn(|j| row[j] * d[j]))),
            OffDiagonal::Full(square) => Some(product(left, square)),
        }
    }

    fn full(&self) -> Square<S> {
        let mut full = [[0.0; S]; S];
        match self {
            OffDiagonal::Empty => {}
            OffDiagonal::Diagonal(d) => (0..S).for_each(|i| full[i][i] = d[i]),
            OffDiagonal::Full(square) => full = *square,
        }
        full
    }
}

#[inline(always)]
fn subtract<const S: usize>(from: &mut Square<S>, change: &Square<S>) {
    for i in 0..S {
        for j in 0..S {
            from[i][j] -= change[i][j];
        }
    }
}

#[inline(always)]
fn product<const S: usize>(left: &Square<S>, right: &Square<S>) -> Square<S> {
    let mut result = [[0.0; S]; S];
    for i in 0..S {
        for k in 0..S {
            for j in 0..S {
                result[i][j] += left[i][k] * right[k][j];
            }
        }
    }
    result
}

/// The inverse by Gauss-Jordan elimination with row exchanges; `None` if the matrix is singular or not finite.
#[inline(always)]
pub(super) fn inverse<const S: usize>(mut left: Square<S>) -> Option<Square<S>> {
    let mut right: Square<S> = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    for p in 0..S {
        let mut best = p;
        for r in p + 1..S {
            if left[r][p].abs() > left[best][p].abs() {
                best = r;
            }
        }
        left.swap(p, best);
        right.swap(p, best);
        let scale = 1.0 / left[p][p];
        if !scale.is_finite() {
            return None;
        }
        let (row, image) = (left[p].map(|x| x * scale), right[p].map(|x| x * scale));
        for r in 0..S {
            let factor = left[r][p];
            for j in 0..S {
                left[r][j] -= factor * row[j];
                right[r][j] -= factor * image[j];
            }
        }
        (left[p], right[p]) = (row, image);
    }
    Some(right)
}
