//! The equations that are integrated: implicit, with one equation a variable.

/// Equations `mass(t, y) y' = f(t, y)` with one mass a variable: the residual `r(t, y, y') = f - mass y'` vanishes
/// along a solution. A mass may be 0, which makes its equation a constraint (index 1: solvable for its variable).
///
/// Variables should be chosen so that one absolute tolerance each makes sense: logarithms of what spans decades. They
/// are eliminated in their order: first those whose equation does not contain them, then those that are damped, last
/// those that the others depend on most.
pub trait System<const N: usize> {
    /// Residual, masses and Jacobian at `L` points at once. A result that is not finite makes the step shorter.
    fn linearise<const L: usize>(&self, points: &Points<N, L>) -> Linearised<N, L>;
}

/// `L` points, side by side.
#[derive(Debug, Clone, Copy)]
pub struct Points<const N: usize, const L: usize> {
    /// Times.
    pub t: [f64; L],
    /// Variables.
    pub y: [[f64; L]; N],
    /// Slopes `y'`.
    pub slope: [[f64; L]; N],
}

/// A system about `L` points.
#[derive(Debug, Clone, Copy)]
pub struct Linearised<const N: usize, const L: usize> {
    /// `f - mass y'`, by equation.
    pub residual: [[f64; L]; N],
    /// Masses, by equation.
    pub mass: [[f64; L]; N],
    /// Derivative of the residual of equation `i` by variable `j`, at fixed slopes: `jacobian[i][j]`.
    pub jacobian: [[[f64; L]; N]; N],
}
