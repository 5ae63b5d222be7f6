//! A shortcut driven open loop: how small errors grow, and where the block ends under a sampled control. Under the continuous one it ends at the target.
//!
//! In the variables of the model, `v`, `theta` and the spring's length `s`, with the library's explicit integrator.

use nalgebra::{Matrix3, Vector3};

use super::CheckedRow;
use super::motion::Followed;
use super::route::integrate;
use crate::protocol::SpringBlock;

/// Number of samples from which `sampling_error` is not checked. Chosen: limits the time of a check.
const MAX_SAMPLES: f64 = 3000.0;

/// Amplification below which the error is absolute. Chosen: smaller ones are differences of terms of size 1.
const MIN_AMPLIFICATION: f64 = 1e-2;

const TOO_STIFF: &str = "motions too stiff for an explicit integrator";

/// Compares the columns of open-loop control of a traced protocol.
pub fn compare(row: &mut CheckedRow<'_>, protocol: &ControlledProtocol, followed: &Followed) {
    let (ControlledProtocol { slider, t_f, .. }, rtol) = (*protocol, row.context.rtol);
    let dt = row.number("dt").unwrap_or(0.0);
    let columns = ["amplification", "sampling_error", "open_loop_error"];
    if columns.iter().all(|column| row.number(column).is_none()) {
        return;
    }
    let is_stiff =
        slider.m > 0.0 && slider.m * followed.least(|at| at.v) / slider.law.a < MIN_RELAXATION_FRACTION * t_f;
    let Some([whole, most]) = (!is_stiff).then(|| protocol.growth()).flatten() else {
        return row.miss(TOO_STIFF);
    };
    let scale = whole.max(MIN_AMPLIFICATION).max(1e-11 * most / rtol);
    row.compare_number("amplification", whole, scale);
    // The spring force under the greatest control alone, in units of a. Errors of the control act in proportion to it, and rounding in proportion to
    // the greatest force of the motion.
    let control = followed.control_range().map(f64::abs);
    let reach = if slider.k.is_finite() { slider.k / slider.law.a * t_f * control[0].max(control[1]) } else { 0.0 };
    // Effect at the end of an error rtol of the control at any time.
    let felt = (1.0 + reach + 1e-14 / rtol * followed.force) * (1.0 + most);
    row.compare_number("open_loop_error", 0.0, felt);
    match row.number("sampling_error") {
        Some(_) if t_f / dt > MAX_SAMPLES => row.miss("controls sampled more than 3000 times"),
        Some(_) => match protocol.held_error(dt) {
            Some(expected) => row.compare_number("sampling_error", expected, felt.max(expected)),
            None => row.miss(TOO_STIFF),
        },
        None => {}
    }
}

/// Relaxation time of the velocity, as a fraction of the protocol, below which the motion counts as stiff. Derived: an explicit
/// integrator takes steps of about the relaxation time, so more than 10,000 there.
const MIN_RELAXATION_FRACTION: f64 = 1e-4;

/// Intervals over which errors are followed, one after another. Chosen: a growing error is restarted before it hides the others.
const ERROR_INTERVALS: usize = 256;

/// The smooth shortcut as control of the spring, over the fraction `x` of the time: `ln(v - 1)` is a quintic between both ends, and
/// `alpha x^3 (1 - x)^3`.
#[derive(Debug, Clone, Copy)]
pub struct ControlledProtocol {
    pub slider: SpringBlock,
    pub v_i: f64,
    pub v_f: f64,
    pub t_f: f64,
    pub alpha: f64,
}

impl ControlledProtocol {
    /// Velocity and its first two derivatives in time.
    fn moment(&self, x: f64) -> [f64; 3] {
        let &ControlledProtocol { v_i, v_f, t_f, alpha, .. } = self;
        let start = (v_i - 1.0).ln();
        let change = (v_f - 1.0).ln() - start;
        let p = x * (1.0 - x);
        let f = start + x * x * x * change * (10.0 + x * (6.0 * x - 15.0)) + alpha * p * p * p;
        let g = p * p * (30.0 * change + 3.0 * alpha * (1.0 - 2.0 * x));
        let h = p * (60.0 * change * (1.0 - 2.0 * x) + 6.0 * alpha * (1.0 - 5.0 * p));
        let w = f.exp();
        [1.0 + w, w * g / t_f, w * (h + g * g) / (t_f * t_f)]
    }

    fn velocity(&self, x: f64) -> f64 {
        self.moment(x)[0]
    }

    /// The control velocity at `x` and `ln theta`.
    fn control(&self, x: f64, ln_theta: f64) -> f64 {
        let SpringBlock { law, k, m } = self.slider;
        let [v, v1, v2] = self.moment(x);
        v + (law.a * v1 / v + law.b * ((-ln_theta).exp() - v) + m * v2) / k
    }

    /// `ln theta` and the error at the end of the interval from `x` on, for an error in one variable at its start.
    fn piece(&self, x: f64, ln_theta: f64, unit: usize) -> Option<(f64, Vector3<f64>)> {
        let SpringBlock { law, k, m } = self.slider;
        let (t_f, length, follows) = (self.t_f, 1.0 / ERROR_INTERVALS as f64, m == 0.0);
        let rigid = k == f64::INFINITY;
        // Errors of v, ln theta and k s/a. A rigid spring gives v, and without mass the force does.
        let slope = |y: &[f64; 5]| {
            let (theta, v) = (y[0].exp(), self.velocity(y[1]));
            let driven = law.a * y[4] - law.b * y[3];
            let (dv, rate) = match () {
                () if rigid => (0.0, 0.0),
                () if follows => (v * driven / law.a, 0.0),
                () => (y[2], (driven - law.a / v * y[2]) / m),
            };
            let force = if rigid { 0.0 } else { -k / law.a * dv };
            [t_f * (1.0 / theta - v), 1.0, t_f * rate, -t_f * (y[3] / theta + dv), t_f * force]
        };
        let mut start = [ln_theta, x, 0.0, 0.0, 0.0];
        start[2 + unit] = [self.velocity(x), 1.0, 1.0][unit];
        let end = integrate(slope, start, (0.0, length))?;
        let error = Vector3::new(end[2] / self.velocity(x + length), end[3], end[4]);
        Some((end[0], error))
    }

    /// Greatest factors by which errors in `(ln v, ln theta, k s/a)` grow from the start to the end, and from any time to the end.
    fn growth(&self) -> Option<[f64; 2]> {
        let SpringBlock { law, k, m } = self.slider;
        let (ratio, mut ln_theta) = (law.b / law.a, -self.v_i.ln());
        // Errors in all three variables due to an error of theta or of the spring force. A variable that depends on others has no error of its own.
        let (last, free) = match () {
            () if k == f64::INFINITY => (Matrix3::new(0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, ratio, 0.0), 1..2),
            () if m == 0.0 => (Matrix3::new(0.0, -ratio, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), 1..3),
            () => (Matrix3::identity(), 0..3),
        };
        let mut pieces = Vec::new();
        for index in 0..ERROR_INTERVALS {
            let (x, mut piece, from) = (index as f64 / ERROR_INTERVALS as f64, Matrix3::zeros(), ln_theta);
            for unit in free.clone() {
                let (aged, error) = self.piece(x, from, unit)?;
                piece.set_column(unit, &error);
                ln_theta = aged;
            }
            pieces.push(piece);
        }
        let norm = |matrix: &Matrix3<f64>| matrix.singular_values().max();
        let (mut after, mut most) = (last, norm(&last));
        for piece in pieces.iter().rev() {
            after *= piece;
            most = most.max(norm(&after));
        }
        let whole = norm(&after);
        (whole.is_finite() && most.is_finite()).then_some([whole, most])
    }

    /// Distance from the target at the end, in `(ln v, ln theta, k s/a)`, of a block that starts in steady sliding, if the control is
    /// sampled every `dt` and held.
    fn held_error(&self, dt: f64) -> Option<f64> {
        let &ControlledProtocol { slider: SpringBlock { law, k, m }, v_i, v_f, t_f, .. } = self;
        let (ratio, rigid) = (law.b / law.a, k == f64::INFINITY);
        // p = (k s - tau_ss(v_f))/a, y = ln(theta v_f), x = ln(v/v_f), the fraction of the time, and ln theta of the protocol.
        let start = (v_i / v_f).ln();
        let mut state = [(1.0 - ratio) * start, -start, start, 0.0, -v_i.ln()];
        let holds = (t_f / dt).ceil().max(1.0) as u32;
        let at = |hold: u32| if hold == holds { 1.0 } else { f64::from(hold) * dt / t_f };
        for hold in 0..holds {
            let control = self.control(at(hold), state[4]);
            let slope = |s: &[f64; 5]| {
                let [p, y, x, place, aged] = *s;
                let rest = p - ratio * y;
                let v = match () {
                    () if rigid => control,
                    () if m == 0.0 => v_f * rest.exp(),
                    () => v_f * x.exp(),
                };
                let stretch = if rigid { 0.0 } else { k / law.a * (control - v) };
                let speed = if rigid || m == 0.0 { 0.0 } else { law.a * (rest - x) / (m * v) };
                let ageing = (-aged).exp() - self.velocity(place);
                [t_f * stretch, t_f * ((-y).exp() * v_f - v), t_f * speed, 1.0, t_f * ageing]
            };
            state[3] = at(hold);
            state = integrate(slope, state, (0.0, at(hold + 1) - at(hold)))?;
            let [p, y, ..] = state;
            if rigid {
                state[2] = (control / v_f).ln();
                state[0] = state[2] + ratio * y;
            } else if m == 0.0 {
                state[2] = p - ratio * y;
            }
        }
        let distance = Vector3::new(state[0], state[1], state[2]).norm();
        distance.is_finite().then_some(distance)
    }
}
