//! SUNDIALS CVODE, by its driver `cvode.c`, which takes the time itself.

use std::ffi::OsString;
use std::process::Command;

use slipsweep::stability::step_response::{ScaledBlock, State};

use crate::case::{Case, Measured, Method};
use crate::peaks::Peaks;

pub struct Cvode {
    /// Path of the driver.
    pub driver: OsString,
}

impl Method for Cvode {
    fn name(&self) -> String {
        "SUNDIALS CVODE".into()
    }

    fn integrate(&self, case: &Case, tolerance: f64, peaks: Option<&mut Peaks>) -> Option<State> {
        let measured = self.measure(case, tolerance)?;
        if let Some(peaks) = peaks {
            *peaks = measured.peaks;
        }
        Some(measured.end)
    }

    fn measure(&self, case: &Case, tolerance: f64) -> Option<Measured> {
        let ScaledBlock { a, b, inertia, k, .. } = case.block;
        let [z, y, x] = case.start();
        let arguments = [a, b, inertia, k, z, y, x, case.t_end, case.block.force(), tolerance];
        let output = Command::new(&self.driver).args(arguments.map(|number| format!("{number:e}"))).output().ok()?;
        let words = String::from_utf8(output.stdout).ok()?;
        let numbers: Vec<f64> = words.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let &[seconds, z, y, x, count, first] = numbers.as_slice() else { return None };
        Some(Measured { seconds, end: [z, y, x], peaks: Peaks::of(count as u32, first) })
    }
}
