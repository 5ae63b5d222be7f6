//! The integrators of this crate: the one of the table `step_response`, and Radau IIA alone.

use multiversion::multiversion;

use crate::case::{Case, Method};
use crate::numerics::stiff::{Accuracy, Collocation, Integrator, Piece, radau_iia_9};
use crate::peaks::Peaks;
use crate::run::{between, step_to};
use crate::slider::{Slider, State, X};

/// Series where nothing is stiff, Radau IIA of order 9 elsewhere: what the table `step_response` uses.
pub struct Switching;

impl Method for Switching {
    fn name(&self) -> String {
        "ours".into()
    }

    fn integrate(&self, case: &Case, tolerance: f64, mut peaks: Option<&mut Peaks>) -> Option<State> {
        let (slider, start) = (&case.slider, case.start());
        let mut run = slider.run(start, slider.first_step(&start), tolerance);
        while run.t() < case.t_end {
            if let Some(arrested) = slider.arrest(run.y()) {
                run.jump(arrested, slider.first_step(&arrested));
            }
            let leg = step_to(&mut run, case.t_end)?;
            if let Some(peaks) = &mut peaks {
                // To the order of the method, as the table polishes its extrema.
                peaks.look(|u| match between(&mut run, &leg, 0.0, u) {
                    Some(part) if u > 0.0 => part.end()[X],
                    _ => leg.value(X, u),
                });
            }
        }
        Some(*run.y())
    }
}

/// Radau IIA with `S` stages.
pub struct Ours<const S: usize>;

macro_rules! method {
    ($stages:literal, $rule:ident, $step:ident) => {
        #[multiversion(targets(
            "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
            "x86_64+avx+avx2+bmi1+bmi2"
        ))]
        fn $step(run: &mut Integrator<'_, Slider, 3, $stages>, t_end: f64) -> Option<Piece<3, $stages>> {
            run.step(t_end)
        }

        impl Method for Ours<$stages> {
            fn name(&self) -> String {
                format!("ours, Radau IIA of order {}", 2 * $stages - 1)
            }

            fn integrate(&self, case: &Case, tolerance: f64, peaks: Option<&mut Peaks>) -> Option<State> {
                integrate(case, tolerance, peaks, $rule(), $step)
            }
        }
    };
}

method!(5, radau_iia_9, step_9);

fn integrate<const S: usize>(
    case: &Case,
    tolerance: f64,
    mut peaks: Option<&mut Peaks>,
    rule: &'static Collocation<S>,
    step: fn(&mut Integrator<'_, Slider, 3, S>, f64) -> Option<Piece<3, S>>,
) -> Option<State> {
    let (slider, start) = (&case.slider, case.start());
    let accuracy = Accuracy { tolerance, scale: case.absolute(1.0) };
    let mut run = Integrator::new(slider, rule, accuracy, 0.0, start, slider.first_step(&start));
    while run.t() < case.t_end {
        if let Some(arrested) = slider.arrest(run.y()) {
            run.jump(arrested, slider.first_step(&arrested));
        }
        let piece = step(&mut run, case.t_end)?;
        if let Some(peaks) = &mut peaks {
            // To the order of the method, as the table polishes its extrema.
            peaks.look(|u| match run.between(&piece, 0.0, u) {
                Some(part) if u > 0.0 => part.end[X],
                _ => piece.value(X, u),
            });
        }
    }
    Some(*run.y())
}
