//! `regularised`: the traced protocol obeys the equations, arrives, its control moves the spring, and off its pieces it is the optimum.

use super::motion::Followed;
use super::task::{Task, min_duration};
use super::verdict::{Checked, Context, Verdict, axis, transition, word};
use crate::dataset::Row;
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

pub fn check(row: &Row, context: &Context, rtol: f64) -> Checked {
    let (problem, t_f, delta_t) = (transition(row)?, axis(row, "t_f")?, axis(row, "delta_t")?);
    let slider = SpringBlock { law: problem.law, k: axis(row, "k")?, m: axis(row, "m")? };
    let mut verdict = Verdict::default();
    let overlaps = 2.0 * delta_t > t_f || context.bounded && t_f < min_duration(&problem, true);
    let infeasible = word(row, STATUS) == Some("infeasible");
    if infeasible && !overlaps && !context.bounded {
        verdict.miss("optima that nearly come to rest");
        return Ok(verdict);
    }
    if overlaps || infeasible {
        verdict.status(row, overlaps);
        return Ok(verdict);
    }
    if word(row, STATUS) == Some("unproven") {
        verdict.miss("status is unproven");
        return Ok(verdict);
    }
    ["work", "gap", "v_min", "v_max", "v_c_min", "v_c_max"].iter().for_each(|column| verdict.demand(row, column, true));
    let (_, motion) = regularised::motion(&slider, (problem.v_i, problem.v_f), t_f, delta_t, context.bounded, rtol);
    let Some(motion) = motion else {
        verdict.push("motion", f64::INFINITY);
        return Ok(verdict);
    };
    let Some(optimum) = Task::new(&problem, t_f, context.bounded).certify(&mut verdict) else { return Ok(verdict) };
    let followed = Followed::new(motion, &slider);
    let arrival = (followed.end().theta * problem.v_f - 1.0).abs();
    let corner = if context.bounded { optimum.motion.time_on(|at| at.v == 1.0) } else { 0.0 };
    let drift = drift(&followed, problem.law.a, (optimum.c, corner), [delta_t * (1.0 + rtol), t_f]);
    verdict.push("motion", followed.equation + arrival + drift);
    verdict.push("control", followed.control);
    verdict.compare(row, "work_optimal", Some(optimum.work), None);
    verdict.compare(row, "work", Some(followed.work), None);
    let excess = followed.work - optimum.work;
    // A difference of works that are each known to about 1e-12, and to the rounding of times.
    let rounding = followed.rounding(|at| at.friction * at.v) + 1e-12 * (followed.work.abs() + optimum.work.abs());
    let scale = excess.abs() + rounding / rtol;
    verdict.compare(row, "gap", Some(excess / optimum.work), Some(scale / optimum.work.abs()));
    let v = followed.compare_velocities(&mut verdict, row);
    followed.compare_control(&mut verdict, row);
    let friction_min = followed.least(|at| at.friction);
    verdict.friction(row, friction_min);
    if (v[0] - 1.0).abs() > 100.0 * rtol && friction_min > 0.0 {
        verdict.compare_word(row, STATUS, if v[0] < 1.0 { "below_bound" } else { "ok" });
    }
    Ok(verdict)
}
