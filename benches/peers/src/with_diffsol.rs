//! diffsol: its BDF and ESDIRK34, dense nalgebra matrices.

use diffsol::{
    DiffsolError, NalgebraLU, NalgebraMat, OdeBuilder, OdeEquations, OdeSolverMethod, OdeSolverStopReason, VectorCommon,
};
use slipsweep::stability::step_response::State;

use crate::case::{Case, Method, X};
use crate::peaks::Peaks;

pub struct Bdf;
pub struct Esdirk34;

type Lu = NalgebraLU<f64>;

macro_rules! method {
    ($method:ty, $name:literal, $solver:ident) => {
        impl Method for $method {
            fn name(&self) -> String {
                $name.into()
            }

            fn integrate(&self, case: &Case, tolerance: f64, peaks: Option<&mut Peaks>) -> Option<State> {
                let mut problem = OdeBuilder::<NalgebraMat<f64>>::new()
                    .rtol(tolerance)
                    .atol(case.absolute(tolerance))
                    .rhs_implicit(
                        |state: &[f64], _: &[f64], _, slope: &mut [f64]| case.slope(state, slope),
                        |state: &[f64], _: &[f64], _, by: &[f64], product: &mut [f64]| {
                            for (product, row) in product.iter_mut().zip(case.jacobian(state)) {
                                *product = row[0] * by[0] + row[1] * by[1] + row[2] * by[2];
                            }
                        },
                    )
                    .init(|_: &[f64], _, state: &mut [f64]| state.copy_from_slice(&case.start()), 3)
                    .build()
                    .ok()?;
                // The default limits, 50 failures of Newton's method in a whole run among them, end it early.
                problem.ode_options.min_timestep = 1e-18;
                problem.ode_options.max_nonlinear_solver_failures = usize::MAX;
                problem.ode_options.max_error_test_failures = usize::MAX;
                // A little faster than the default, 10.
                problem.ode_options.max_nonlinear_solver_iterations = 4;
                run(problem.$solver::<Lu>().ok()?, case.t_end, peaks).ok()
            }
        }
    };
}

method!(Bdf, "diffsol BDF", bdf);
method!(Esdirk34, "diffsol ESDIRK34", esdirk34);

fn run<'a, E, S>(mut solver: S, t_end: f64, mut peaks: Option<&mut Peaks>) -> Result<State, DiffsolError>
where
    E: OdeEquations<T = f64, V = diffsol::NalgebraVec<f64>> + 'a,
    S: OdeSolverMethod<'a, E>,
{
    solver.set_stop_time(t_end)?;
    loop {
        let before = solver.state().t;
        let reason = solver.step()?;
        let after = solver.state().t;
        if let Some(peaks) = &mut peaks {
            peaks.look(|u| {
                let t = (before + u * (after - before)).min(after);
                solver.interpolate(t).map_or(f64::NAN, |state| state.inner()[X])
            });
        }
        if matches!(reason, OdeSolverStopReason::TstopReached) {
            let end = solver.state().y.inner();
            return Ok([end[0], end[1], end[2]]);
        }
    }
}
