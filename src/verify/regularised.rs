//! `regularised`: the traced protocol obeys the equations, arrives, its control moves the spring, and off its pieces it is the optimum.

use super::motion::Followed;
use super::task::{Task, min_duration};
use super::{Checked, CheckedRow};
use crate::protocol::{Moment, SpringBlock, regularised};
use crate::table::STATUS;

/// How far the protocol is from the optimum of this `C`, on the floor up to `corner`, where no piece may replace it.
fn drift(followed: &Followed, a: f64, (c, corner): (f64, f64), [delta_t, t_f]: [f64; 2]) -> f64 {
    let drift = |at: &Moment| {
        if at.t < corner {
            return (at.v - 1.0).abs();
        }
        let (kinetic, press) = (a * at.v, (at.friction + a) / at.theta);
        (kinetic - press - c).abs() / (kinetic.abs() + press.abs())
    };
    let moments = followed.samples.iter().map(|(_, at)| at);
    let kept = moments.filter(|at| at.t > delta_t && at.t < t_f - delta_t);
    kept.filter(|at| corner == 0.0 || (at.t - corner).abs() > delta_t).map(drift).fold(0.0, f64::max)
}

pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let (problem, t_f, delta_t) = (row.transition()?, row.axis("t_f")?, row.axis("delta_t")?);
    let slider = SpringBlock { law: problem.law, k: row.axis("k")?, m: row.axis("m")? };
    let (bounded, rtol) = (row.context.bounded, row.context.rtol);
    let overlaps = 2.0 * delta_t > t_f || bounded && t_f < min_duration(&problem, true);
    let infeasible = row.has_status("infeasible");
    if infeasible && !overlaps && !bounded {
        return Err("optima that nearly come to rest");
    }
    if overlaps || infeasible {
        row.compare_feasible(!overlaps);
        return Ok(());
    }
    if row.has_status("unproven") {
        return Err("status is unproven");
    }
    ["work", "gap", "v_min", "v_max", "v_c_min", "v_c_max"].iter().for_each(|column| row.demand(column, true));
    let (_, motion) = regularised::motion(&slider, (problem.v_i, problem.v_f), t_f, delta_t, bounded, rtol);
    let Some(motion) = motion else {
        row.push("motion", f64::INFINITY);
        return Ok(());
    };
    let Some(optimum) = row.certify(&Task::new(&problem, t_f, bounded)) else { return Ok(()) };
    let followed = Followed::new(motion, &slider);
    let arrival = (followed.end().theta * problem.v_f - 1.0).abs();
    let corner = if bounded { optimum.motion.time_on(|at| at.v == 1.0) } else { 0.0 };
    let drift = drift(&followed, problem.law.a, (optimum.c, corner), [delta_t * (1.0 + rtol), t_f]);
    row.push("motion", followed.equation + arrival + drift);
    row.push("control", followed.control);
    row.compare("work_optimal", optimum.work);
    row.compare("work", followed.work);
    let excess = followed.work - optimum.work;
    // A difference of works that are each known to about 1e-12, and to the rounding of times.
    let rounding = followed.rounding(|at| at.friction * at.v) + 1e-12 * (followed.work.abs() + optimum.work.abs());
    let scale = excess.abs() + rounding / rtol;
    row.compare_relative("gap", excess / optimum.work, scale / optimum.work.abs());
    let least = followed.compare_velocities(row);
    followed.compare_control(row);
    let friction_min = followed.least(|at| at.friction);
    row.compare_friction(friction_min);
    if (least - 1.0).abs() > 100.0 * rtol && friction_min > 0.0 {
        row.compare_word(STATUS, if least < 1.0 { "below_bound" } else { "ok" });
    }
    Ok(())
}
