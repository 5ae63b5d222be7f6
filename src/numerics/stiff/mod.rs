//! Stiff initial value problems of a few variables: Radau IIA collocation of order 9, without memory allocation.
//!
//! A [`System`] is a set of equations `mass y' = f(t, y)`; a mass of 0 makes a constraint of index 1. It returns its residual and its Jacobian
//! at several points at once. An [`Integrator`] takes steps along a solution; each is a [`DenseOutput`], the collocation polynomial.
//!
//! ```
//! use slipsweep::numerics::elementary::exp;
//! use slipsweep::numerics::stiff::{Accuracy, Integrator, Linearised, Points, System, radau_iia_9};
//!
//! /// `y' = -1000 (y - e^-t)`.
//! struct Follower;
//!
//! impl System<1> for Follower {
//!     fn linearise<const L: usize>(&self, points: &Points<1, L>) -> Linearised<1, L> {
//!         let mut at = Linearised { residual: [[0.0; L]], mass: [[1.0; L]], jacobian: [[[-1000.0; L]]] };
//!         for i in 0..L {
//!             at.residual[0][i] = -1000.0 * (points.y[0][i] - exp(-points.t[i])) - points.slope[0][i];
//!         }
//!         at
//!     }
//! }
//!
//! let accuracy = Accuracy { tolerance: 1e-8, scale: [1.0] };
//! let mut integrator = Integrator::new(&Follower, radau_iia_9(), accuracy, 0.0, [0.0], 1e-3);
//! while integrator.t() < 1.0 {
//!     let piece = integrator.step(1.0).expect("the solution goes on");
//!     // Dense output: variable 0 half way along the step.
//!     let _half_way = piece.value(0, 0.5);
//! }
//! assert!((integrator.y()[0] - exp(-1.0) * 1000.0 / 999.0).abs() < 1e-8);
//! ```
//!
//! If the equations jump (a control that is sampled and held), end a step there, and continue with a new integrator whose first step is
//! [`Integrator::proposal`] of the old one. To evaluate a number inside a step with the order of the method, as for an event, integrate again up
//! to it with [`Integrator::between`].
//!
//! # Method
//!
//! Newton's method solves for the stages. It evaluates the Jacobian at every stage, so long steps through strong nonlinearities converge. The
//! matrix is eliminated variable by variable, in the order of [`System`], which costs about as much as one iteration of the usual frozen and
//! diagonalised form. The extrapolated polynomial of the last step is the first guess.

mod blocks;
mod collocation;
mod dense_output;
mod integrator;
mod system;

pub use collocation::{Collocation, radau_iia_9};
pub use dense_output::DenseOutput;
pub use integrator::{Accuracy, Integrator};
pub use system::{Linearised, Points, System};
