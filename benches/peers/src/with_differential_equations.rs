//! differential-equations: its Radau5 and DOP853, state on the stack.

use differential_equations::interpolate::Interpolation;
use differential_equations::linalg::Matrix;
use differential_equations::ode::{ODE, OrdinaryNumericalMethod};
use differential_equations::prelude::{ExplicitRungeKutta, ImplicitRungeKutta};
use differential_equations::status::Status;
use slipsweep::stability::step_response::State;

use crate::case::{Case, Method, X};
use crate::peaks::Peaks;

pub struct Radau5 {
    /// Fraction of the tolerance that is left to Newton's method; for 0 the library chooses one that goes with the
    /// tolerance.
    pub newton_tol: f64,
}

impl ODE<f64, State> for Case {
    fn diff(&self, _: f64, state: &State, slope: &mut State) {
        self.slope(state, slope);
    }

    fn jacobian(&self, _: f64, state: &State, matrix: &mut Matrix<f64>) {
        for (r, row) in Case::jacobian(self, state).into_iter().enumerate() {
            for (c, value) in row.into_iter().enumerate() {
                matrix[(r, c)] = value;
            }
        }
    }
}

impl Method for Radau5 {
    fn name(&self) -> String {
        let newton = if self.newton_tol > 0.0 { "fixed" } else { "own" };
        format!("differential-equations Radau5, {newton} Newton tolerance")
    }

    fn integrate(&self, case: &Case, tolerance: f64, peaks: Option<&mut Peaks>) -> Option<State> {
        // It works with 0.1 r^(2/3) for a tolerance r, element by element of a vector, and refuses r <= 1e-15.
        let handed = (10.0 * tolerance).powf(1.5).max(1.1e-15);
        let mut solver = ImplicitRungeKutta::radau5()
            .rtol(vec![handed; 3])
            .atol(case.absolute(handed).to_vec())
            .newton_tol(self.newton_tol)
            .max_steps(10_000_000)
            .max_rejects(usize::MAX);
        drive(&mut solver, case, peaks)
    }
}

/// Explicit and not for stiff problems: compared with the others where the response is not stiff.
pub struct Dop853;

impl Method for Dop853 {
    fn name(&self) -> String {
        "differential-equations DOP853".into()
    }

    fn integrate(&self, case: &Case, tolerance: f64, peaks: Option<&mut Peaks>) -> Option<State> {
        let mut solver = ExplicitRungeKutta::dop853()
            .rtol(vec![tolerance; 3])
            .atol(case.absolute(tolerance).to_vec())
            .max_steps(10_000_000)
            .max_rejects(usize::MAX);
        drive(&mut solver, case, peaks)
    }
}

/// As its `solve_ode`, without the recording of points.
fn drive<S>(solver: &mut S, case: &Case, mut peaks: Option<&mut Peaks>) -> Option<State>
where
    S: OrdinaryNumericalMethod<f64, State> + Interpolation<f64, State>,
{
    solver.init(case, 0.0, case.t_end, &case.start()).ok()?;
    solver.set_status(Status::Solving);
    while case.t_end - solver.t() > 10.0 * f64::EPSILON {
        if solver.t() + solver.h() > case.t_end {
            solver.set_h(case.t_end - solver.t());
        }
        solver.step(case).ok()?;
        if matches!(solver.status(), Status::RejectedStep) {
            continue;
        }
        if let Some(peaks) = &mut peaks {
            let (before, after) = (solver.t_prev(), solver.t());
            peaks.look(|u| {
                let t = (before + u * (after - before)).clamp(before, after);
                solver.interpolate(t).map_or(f64::NAN, |state| state[X])
            });
        }
    }
    Some(*solver.y())
}
