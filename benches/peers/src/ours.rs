//! The integrators of this crate: the one of the table `step_response`, and Radau IIA alone.

use multiversion::multiversion;
use slipsweep::numerics::stiff::{Accuracy, DenseOutput, Integrator, radau_iia_9};
use slipsweep::stability::step_response::{ScaledBlock, State, step_to};

use crate::case::{Case, Method, X};
use crate::peaks::Peaks;

/// Series where nothing is stiff, Radau IIA of order 9 elsewhere: what the table `step_response` uses.
pub struct Switching;

impl Method for Switching {
    fn name(&self) -> String {
        "ours".into()
    }

    fn integrate(&self, case: &Case, tolerance: f64, mut peaks: Option<&mut Peaks>) -> Option<State> {
        let (block, start) = (&case.block, case.start());
        let mut run = block.run(start, block.first_step(&start), tolerance);
        while run.t() < case.t_end {
            if let Some(arrested) = block.arrest(run.y()) {
                run.jump(arrested, block.first_step(&arrested));
            }
            let step = step_to(&mut run, case.t_end)?;
            if let Some(peaks) = &mut peaks {
                peaks.look(|u| step.path.value(X, u));
            }
        }
        Some(*run.y())
    }
}

/// Radau IIA of order 9.
pub struct Radau;

impl Method for Radau {
    fn name(&self) -> String {
        "ours, Radau IIA of order 9".into()
    }

    fn integrate(&self, case: &Case, tolerance: f64, mut peaks: Option<&mut Peaks>) -> Option<State> {
        let (block, start) = (&case.block, case.start());
        let accuracy = Accuracy { tolerance, scale: case.absolute(1.0) };
        let mut run = Integrator::new(block, radau_iia_9(), accuracy, 0.0, start, block.first_step(&start));
        while run.t() < case.t_end {
            if let Some(arrested) = block.arrest(run.y()) {
                run.jump(arrested, block.first_step(&arrested));
            }
            let dense_output = step(&mut run, case.t_end)?;
            if let Some(peaks) = &mut peaks {
                // To the order of the method, as the table polishes its extrema.
                peaks.look(|u| match run.between(&dense_output, 0.0, u) {
                    Some(part) if u > 0.0 => part.end[X],
                    _ => dense_output.value(X, u),
                });
            }
        }
        Some(*run.y())
    }
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn step(run: &mut Integrator<'_, ScaledBlock, 3, 5>, t_end: f64) -> Option<DenseOutput<3, 5>> {
    run.step(t_end)
}
