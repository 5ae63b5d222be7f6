//! The library integrator (Dormand and Prince, order 8) at tight tolerance.

use ode_solvers::dop_shared::OutputType;
use ode_solvers::{Dop853, SVector, System};

use crate::numerics::TIGHT_RTOL;

struct Slope<F>(F);

impl<const N: usize, F: Fn(&[f64; N]) -> [f64; N]> System<f64, SVector<f64, N>> for Slope<F> {
    fn system(&self, _: f64, y: &SVector<f64, N>, dy: &mut SVector<f64, N>) {
        *dy = SVector::from((self.0)(&y.data.0[0]));
    }
}

/// Relative difference of integrated numbers below which rounding decides. Chosen: a hundred times the tolerance.
pub const UNCLEAR_RTOL: f64 = 100.0 * TIGHT_RTOL;

/// Greatest number of steps of one integration. Chosen: more mean a stiff motion.
const MAX_STEPS: u32 = 20_000;

/// `y` at `to`, from slopes that depend on `y` alone, which may contain the independent variable; `None` if the integrator fails.
pub fn integrate<const N: usize>(
    slope: impl Fn(&[f64; N]) -> [f64; N],
    y: [f64; N],
    (from, to): (f64, f64),
) -> Option<[f64; N]> {
    if from == to {
        return Some(y);
    }
    let start = SVector::from(y);
    let length = to - from;
    let mut stepper = Dop853::from_param(
        Slope(slope),
        from,
        to,
        length,
        start,
        TIGHT_RTOL,
        1e-15,
        0.9,
        0.0,
        0.333,
        6.0,
        length.abs(),
        0.0,
        MAX_STEPS,
        u32::MAX,
        OutputType::Sparse,
    );
    stepper.integrate().ok()?;
    let end = stepper.y_out().last()?.data.0[0];
    end.iter().all(|value| value.is_finite()).then_some(end)
}
