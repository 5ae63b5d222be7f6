//! A response over time.

use super::integration::step_to;
use super::long_term::STEP_ERROR;
use super::scaled_block::{State, X, Y};
use super::series::TERMS;
use super::{ScaledStep, VelocityStep};
use crate::model::{Law, Transition};
use crate::numerics::elementary::{exp, ln};
use crate::numerics::gauss::{SHORT_NODES, rule};
use crate::numerics::stiff::DenseOutput;
use crate::protocol::{Moment, Motion, equal_landmarks, interval_at};

/// Intervals of a traced response, at most. Chosen: a limit of memory, far beyond the resolution of a picture.
const MAX_INTERVALS: usize = 1 << 18;

/// The response to a step, up to some time.
#[derive(Debug, Clone)]
pub struct StepResponseMotion {
    law: Law,
    v_f: f64,
    t_f: f64,
    intervals: Vec<MotionInterval>,
}

/// Step of the integrator, or an arrest that takes no time; time in `l/v_f`.
type MotionInterval = DenseOutput<3, TERMS>;

/// An arrest at a time.
fn arrest(t: f64, from: State, to: State) -> MotionInterval {
    let mut powers = [[0.0; TERMS]; 3];
    (0..3).for_each(|r| powers[r][0] = to[r] - from[r]);
    DenseOutput::from_powers(t, 0.0, from, powers)
}

impl VelocityStep {
    /// Response up to the time `t_f`, in `l/v_0`, with errors of a step below `STEP_ERROR rtol`.
    ///
    /// `None` for a rigid spring, for `v_i = v_f`, where the velocity becomes infinite, and for too many oscillations.
    pub fn motion(&self, t_f: f64, rtol: f64) -> Option<StepResponseMotion> {
        let Transition { law, v_f, .. } = self.transition;
        let ScaledStep { slider, ratio } = self.scaled()?;
        let start = slider.steady(ln(ratio));
        let mut run = slider.run(start, slider.first_step(&start), STEP_ERROR * rtol);
        let mut intervals = Vec::new();
        let end = t_f * v_f;
        while run.t() < end {
            if let Some(arrested) = slider.arrest(run.y()) {
                intervals.push(arrest(run.t(), *run.y(), arrested));
                run.jump(arrested, slider.first_step(&arrested));
            }
            intervals.push(step_to(&mut run, end)?.path);
            if intervals.len() > MAX_INTERVALS {
                return None;
            }
        }
        Some(StepResponseMotion { law, v_f, t_f, intervals })
    }
}

impl StepResponseMotion {
    /// Work of friction up to the end, `int tau v dt`, in scaled units.
    pub fn work(&self) -> f64 {
        let rule = rule(SHORT_NODES);
        let work = |interval: &MotionInterval| {
            let at = |x: f64| self.moment(interval, 0.5 * (1.0 + x));
            let power: f64 = rule.x.iter().zip(&rule.w).map(|(&x, w)| w * at(x).friction * at(x).v).sum();
            0.5 * interval.h / self.v_f * power
        };
        self.intervals.iter().map(work).sum()
    }

    /// Least velocity at the nodes and the ends of all intervals, in `v_0`.
    pub fn least_velocity(&self) -> f64 {
        let rule = rule(SHORT_NODES);
        let fractions = || rule.x.iter().map(|x| 0.5 * (1.0 + x)).chain([0.0, 1.0]);
        let least =
            |interval: &MotionInterval| fractions().map(|u| self.moment(interval, u).v).fold(f64::INFINITY, f64::min);
        self.intervals.iter().map(least).fold(f64::INFINITY, f64::min)
    }

    /// State at the fraction `u` of an interval.
    fn moment(&self, interval: &MotionInterval, u: f64) -> Moment {
        let (ln_v, ln_theta) = (interval.value(X, u) + ln(self.v_f), interval.value(Y, u) - ln(self.v_f));
        Moment {
            t: interval.time(u) / self.v_f,
            v: exp(ln_v),
            theta: exp(ln_theta),
            friction: 1.0 + self.law.a * ln_v + self.law.b * ln_theta,
            v_c: Some(self.v_f),
            beta: None,
        }
    }
}

impl Motion for StepResponseMotion {
    fn duration(&self) -> f64 {
        self.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        equal_landmarks(self.intervals.len())
    }

    fn at(&self, s: f64) -> Moment {
        let (k, u) = interval_at(s, self.intervals.len());
        self.moment(&self.intervals[k], u)
    }

    fn arrives(&self) -> bool {
        false
    }
}
