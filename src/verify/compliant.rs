//! `compliant`: the traced shortcut obeys the equations and its formula, arrives, and its control moves the spring; open loop again.

use super::motion::Followed;
use super::open_loop::ControlledProtocol;
use super::shortcut::Exponential;
use super::task::{Task, min_duration};
use super::{Checked, CheckedRow};
use crate::model::Transition;
use crate::protocol::{SpringBlock, compliant};

pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let (problem, t_f, k, m) = (row.transition()?, row.axis("t_f")?, row.axis("k")?, row.axis("m")?);
    if !row.compare_feasible(t_f > min_duration(&problem, true)) {
        return Ok(());
    }
    let (Transition { law, v_i, v_f }, rtol) = (problem, row.context.rtol);
    let slider = SpringBlock { law, k, m };
    let Ok(path) = compliant::path(&slider, (v_i, v_f), t_f, rtol) else {
        row.push("motion", f64::INFINITY);
        return Ok(());
    };
    let followed = Followed::new(Box::new(path), &slider);
    let family = Exponential {
        t_f,
        first: v_i - 1.0,
        l: ((v_f - 1.0) / (v_i - 1.0)).ln(),
        shape: |x| [x * x * x * (10.0 + x * (6.0 * x - 15.0)), (x * (1.0 - x)).powi(3)],
        distance: &|at| [at.v - 1.0, at.v],
        rounding: 0.0,
    };
    let [alpha, noise, formula] = family.fit(&followed).ok_or("alpha is not determined")?;
    row.demand("alpha", true);
    row.compare_relative("alpha", alpha, alpha.abs() + noise / rtol);
    let arrival = (followed.end().theta * v_f - 1.0).abs();
    row.push("motion", followed.equation + arrival + formula);
    row.push("control", followed.control);
    row.compare("work", followed.work);
    let least = followed.compare_velocities(row);
    row.compare_friction(followed.least(|at| at.friction));
    let size = followed.compare_control(row);
    row.compare("stiffness_ratio", if m > 0.0 { k * t_f * t_f / m } else { f64::INFINITY });
    let protocol = ControlledProtocol { slider, v_i, v_f, t_f, alpha: row.number("alpha").unwrap_or(alpha) };
    // The spring force under the greatest control alone, in units of a. Errors of the control act in proportion to it, and rounding in
    // proportion to the greatest force of the motion.
    let reach = if k.is_finite() { k / law.a * t_f * size } else { 0.0 };
    open_loop(row, &protocol, (least, 1.0 + reach + 1e-14 / rtol * followed.force));
    if let Some(optimum) = row.certify(&Task::new(&problem, t_f, row.context.bounded)) {
        row.compare_gap(optimum.work, Some(followed.work));
    }
    Ok(())
}

/// Number of samples from which `sampling_error` is not checked. Chosen: limits the time of a check.
const MAX_SAMPLES: f64 = 3000.0;

/// Amplification below which the error is absolute. Chosen: smaller ones are differences of terms of size 1.
const MIN_AMPLIFICATION: f64 = 1e-2;

const TOO_STIFF: &str = "motions too stiff for an explicit integrator";

/// Compares the columns of open-loop control of a protocol of this `least` velocity; `felt` is the effect of an error of the control at once.
fn open_loop(row: &mut CheckedRow<'_>, protocol: &ControlledProtocol, (least, felt): (f64, f64)) {
    let dt = row.number("dt").unwrap_or(0.0);
    if dt == 0.0 {
        row.compare("sampling_error", None);
    }
    let columns = ["amplification", "sampling_error", "open_loop_error"];
    if columns.iter().any(|column| row.is_missing(column) && (*column != "sampling_error" || dt > 0.0)) {
        row.miss("numbers of a motion that was given up");
    }
    let [grown, held, closed] = columns.map(|column| row.number(column));
    if grown.or(held).or(closed).is_none() {
        return;
    }
    let Some(growth) = (!protocol.is_stiff(least)).then(|| protocol.growth()).flatten() else {
        return row.miss(TOO_STIFF);
    };
    let noise = 1e-11 * growth.most / row.context.rtol;
    row.compare_number("amplification", growth.whole, growth.whole.max(MIN_AMPLIFICATION).max(noise));
    // Effect at the end of an error rtol of the control at any time.
    let felt = felt * (1.0 + growth.most);
    let mut compare = |column: &'static str, dt: Option<f64>| match protocol.miss(dt) {
        Some(expected) => row.compare_number(column, expected, felt.max(expected)),
        None => row.miss(TOO_STIFF),
    };
    if closed.is_some() {
        compare("open_loop_error", None);
    }
    if held.is_some() && protocol.t_f / dt <= MAX_SAMPLES {
        compare("sampling_error", Some(dt));
    } else if held.is_some() {
        row.miss("controls sampled more than 3000 times");
    }
}
