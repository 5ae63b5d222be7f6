//! The system of equations: implicit, with one equation for each variable.

/// Equations `mass(t, y) y' = f(t, y)` with one mass for each variable: the residual `r(t, y, y') = f - mass y'` vanishes along a solution. A
/// mass may be 0, which makes its equation a constraint (index 1: solvable for its variable).
///
/// Choose variables with meaningful absolute tolerances: logarithms of quantities that span decades. The order of the variables is the order of
/// elimination: first those whose equation does not contain them, then damped ones, last those on which the others depend most.
pub trait System<const N: usize> {
    /// Residual, masses and Jacobian at `L` points at once. If a result is not finite, the integrator shortens the step.
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
