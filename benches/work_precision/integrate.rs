//! An ODE from a library's integrator: DOP853 of `ode_solvers`, its last state.

use ode_solvers::dop_shared::OutputType;
use ode_solvers::{Dop853, SVector, System};

/// Steps after which an integration gives up.
const MOST_STEPS: u32 = 10_000;

struct Slope<F>(F);

impl<const N: usize, F: Fn(&[f64; N]) -> [f64; N]> System<f64, SVector<f64, N>> for Slope<F> {
    fn system(&self, _: f64, y: &SVector<f64, N>, slope: &mut SVector<f64, N>) {
        *slope = SVector::from((self.0)(&(*y).into()));
    }
}

/// The state at `x = to` from `start` at 0; `None` if it gives up. What depends on `x` has it as a state: with the slope
/// a function of `x` that integrator is off by much more than its tolerance.
pub fn dop853<const N: usize>(
    slope: impl Fn(&[f64; N]) -> [f64; N],
    start: [f64; N],
    to: f64,
    rtol: f64,
    atol: f64,
) -> Option<[f64; N]> {
    let (safety, beta, least, most) = (0.9, 0.0, 0.333, 6.0);
    let mut stepper = Dop853::from_param(
        Slope(slope),
        0.0,
        to,
        to,
        SVector::from(start),
        rtol,
        atol,
        safety,
        beta,
        least,
        most,
        to,
        0.0,
        MOST_STEPS,
        u32::MAX,
        OutputType::Sparse,
    );
    stepper.integrate().ok()?;
    let end: [f64; N] = (*stepper.y_out().last()?).into();
    end.iter().all(|x| x.is_finite()).then_some(end)
}
