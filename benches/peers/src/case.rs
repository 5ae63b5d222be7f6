//! The two responses to a step of the control velocity that are integrated, and what is known of them.

#![expect(clippy::excessive_precision, reason = "reference values as they were printed")]

use std::time::Instant;

use slipsweep::model::StateLaw;
use slipsweep::stability::step_response::{ScaledBlock, State};

use crate::peaks::Peaks;

/// Indices of the scaled force, of the logarithm of the contact lifetime and of that of the velocity in a [`State`].
const Z: usize = 0;
const Y: usize = 1;
pub const X: usize = 2;

/// A step from steady sliding at `v_i = v_f/32`, in the scaled variables of `ScaledBlock`.
pub struct Case {
    pub name: &'static str,
    pub block: ScaledBlock,
    /// Time integrated, in `l/v_f`.
    pub t_end: f64,
    /// Values printed by `reference.c`: `[z, y, x]` at `t_end`, and `ln(v/v_f)` at the first peak.
    pub end: State,
    pub first_peak: f64,
    /// Peaks up to `t_end`.
    pub peaks: u32,
}

/// What an integration gives.
#[derive(Debug, Clone, Copy)]
pub struct Measured {
    /// Least time of several integrations without dense output.
    pub seconds: f64,
    pub end: State,
    /// From one more, with dense output.
    pub peaks: Peaks,
}

/// A way to integrate a case.
pub trait Method {
    fn name(&self) -> String;

    /// To the end at a tolerance; with dense output of every step to `peaks` if it is wanted. `None` if it gives up.
    fn integrate(&self, case: &Case, tolerance: f64, peaks: Option<&mut Peaks>) -> Option<State>;

    /// Times it: 5 to 50 integrations, 0.3 s.
    fn measure(&self, case: &Case, tolerance: f64) -> Option<Measured> {
        let mut peaks = Peaks::default();
        let end = self.integrate(case, tolerance, Some(&mut peaks))?;
        let (mut seconds, mut spent) = (f64::INFINITY, 0.0);
        for i in 0..50 {
            if i >= 5 && spent >= 0.3 {
                break;
            }
            let from = Instant::now();
            std::hint::black_box(self.integrate(std::hint::black_box(case), tolerance, None)?);
            let time = from.elapsed().as_secs_f64();
            (seconds, spent) = (time.min(seconds), spent + time);
        }
        Some(Measured { seconds, end, peaks })
    }
}

/// `ln(1/32)`.
const START: f64 = -3.4657359027997265;

const A: f64 = 0.005;
const B: f64 = 0.01;
const V_F: f64 = 3.2e6;
const INERTIA: f64 = 2.5e-16 * V_F * V_F;
const BLOCK: ScaledBlock = ScaledBlock { state_law: StateLaw::Ageing, a: A, b: B, inertia: INERTIA, k: 7.5e-3 };

/// The published case: the time of 50 periods of its limit cycle.
pub const PAPER: Case = Case {
    name: "paper",
    block: BLOCK,
    t_end: 50.0 * (1.98357e-6 * V_F),
    end: [2.150556631719136e-3, 1.675067640442670e-1, -3.358494268033420e-2],
    first_peak: 1.880764967911048852,
    peaks: 48,
};

/// Deep stick-slip: half the critical stiffness, 50 cycles.
pub const STICK_SLIP: Case = Case {
    name: "stick-slip",
    block: ScaledBlock { k: 0.5 * (B - A) * (1.0 + INERTIA / A), ..BLOCK },
    t_end: 940.0,
    end: [1.148246712724051e-2, 2.377628815983700166, -2.486601127518542733],
    first_peak: 2.427547735588468582,
    peaks: 50,
};

impl Case {
    /// Steady sliding at `v_i`.
    pub fn start(&self) -> State {
        self.block.steady(START)
    }

    /// Absolute tolerances of `[z, y, x]`.
    pub fn absolute(&self, tolerance: f64) -> State {
        [tolerance * self.block.force(), tolerance, tolerance]
    }

    /// Greatest error of `ln v` and `ln theta`, and of the force in units of what moves `ln v` by 1.
    pub fn error(&self, end: &State) -> f64 {
        let unit = self.absolute(1.0);
        [Z, Y, X].map(|r| (end[r] - self.end[r]).abs() / unit[r]).into_iter().fold(0.0, f64::max)
    }

    /// `[z', y', x']`, for the libraries.
    pub fn slope(&self, state: &[f64], slope: &mut [f64]) {
        let ScaledBlock { a, b, inertia, k, .. } = self.block;
        let (v, ageing) = (state[X].exp(), (-state[Y]).exp());
        slope[Z] = k * (1.0 - v);
        slope[Y] = ageing - v;
        slope[X] = (state[Z] - a * state[X] - b * state[Y]) / (inertia * v);
    }

    /// Derivatives of `slope`: rows as there, columns by `[z, y, x]`.
    pub fn jacobian(&self, state: &[f64]) -> [[f64; 3]; 3] {
        let ScaledBlock { a, b, inertia, k, .. } = self.block;
        let (v, ageing) = (state[X].exp(), (-state[Y]).exp());
        let rate = 1.0 / (inertia * v);
        let pull = state[Z] - a * state[X] - b * state[Y];
        [[0.0, 0.0, -k * v], [0.0, -ageing, -v], [rate, -b * rate, -(a + pull) * rate]]
    }
}
