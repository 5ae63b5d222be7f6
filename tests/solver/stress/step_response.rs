//! `step_response`: the end of a response agrees with stability, and responses scale.

use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::protocol::SpringBlock;
use slipsweep::stability::SteadySliding;
use slipsweep::stability::step_response::{Outcome, Response, VelocityStep};

use super::random::Random;
use super::{POINTS, Row, sample};

/// Velocities below this may have too few bits to scale.
const TINY: f64 = 1e-300;

/// Fraction of the points that are held to a finer accuracy.
const HELD: f64 = 0.05;

/// How much finer the accuracy is to which a response is held.
const FINER: f64 = 1e-2;

#[derive(Debug)]
struct Point {
    step: VelocityStep,
    rtol: f64,
    /// Whether it is solved to a finer accuracy as well, which takes longer.
    held: bool,
}

fn draw(random: &mut Random) -> Point {
    let transition = random.transition();
    let SpringBlock { k, m, .. } = random.slider(transition.law, transition.v_f);
    let rtol = random.between(1e-8, 1e-2);
    let held = random.chance(HELD);
    let state_law = random.one(&StateLaw::ALL);
    Point { step: VelocityStep { state_law, transition, k, m }, rtol, held }
}

#[test]
fn every_response_is_right_or_undecided() {
    sample("step_response", POINTS, draw, |point, row| {
        let &Point { step, rtol, held } = point;
        let simulation = step.scaled().map(|scaled| scaled.follow(rtol));
        let (status, response) = step.from_simulation(simulation.as_ref(), rtol);
        row.status(status);
        let sliding = SteadySliding::new(step.transition.law, step.k, step.m, step.transition.v_f);
        // Only without mass does anything become infinite: with ageing below k_c, with the slip law also for large steps up.
        let Transition { law, v_i, v_f } = step.transition;
        let runs_away = match step.state_law {
            StateLaw::Ageing => !sliding.is_stable(),
            StateLaw::Slip => !sliding.is_stable() || (law.b > law.a && (v_f - v_i) / v_i >= law.a / step.k),
            StateLaw::Prz => law.b > law.a,
        };
        row.fact("infinite only where theory allows it", response.is_some() || (step.m == 0.0 && runs_away));
        let Some(response) = response else { return };
        // The response knows m v^2 alone, which is rounded.
        let rounded = SteadySliding::new(step.transition.law, step.k, step.inertia(), 1.0);
        sound(&step, &response, sliding.is_stable() || rounded.is_stable(), row);
        if held {
            accurate(&step, &response, rtol, row);
        }
        // Powers of two scale without rounding.
        let Transition { law, v_i, v_f } = step.transition;
        let other = VelocityStep {
            transition: Transition { law, v_i: 16.0 * v_i, v_f: 16.0 * v_f },
            m: step.m / 256.0,
            ..step
        };
        let same = |x: f64, y: f64| x == y || (x.is_nan() && y.is_nan()) || (x < TINY && y < TINY);
        // Steps that share their scaled numbers share their course.
        let key = |step: &VelocityStep| step.scaled().map(|scaled| scaled.key());
        row.fact("scaled numbers", key(&other) == key(&step));
        let scaled = other.from_simulation(simulation.as_ref(), rtol).1.expect("exists as the other one does");
        let times = |t: Option<f64>| t.map(|t| 16.0 * t);
        row.fact(
            "scaling",
            scaled.outcome == response.outcome
                && same(scaled.v_peak, 16.0 * response.v_peak)
                && same(scaled.v_trough, 16.0 * response.v_trough)
                && times(scaled.t_peak) == response.t_peak
                && times(scaled.settling_time) == response.settling_time,
        );
    });
}

/// What is reported at one accuracy agrees with what is reported at a finer one, if that decides at all.
fn accurate(step: &VelocityStep, rough: &Response, rtol: f64, row: &mut Row) {
    let finer = FINER * rtol;
    let simulation = step.scaled().map(|scaled| scaled.follow(finer));
    let Some(fine) = step.from_simulation(simulation.as_ref(), finer).1 else { return };
    if [rough.outcome, fine.outcome].contains(&Outcome::Undecided) {
        return;
    }
    row.fact("same outcome at a finer accuracy", rough.outcome == fine.outcome);
    let v_f = step.transition.v_f;
    let mut agree = |name, rough: f64, fine: f64, flat: f64| {
        if !rough.is_nan() && !fine.is_nan() {
            row.agree(name, rough, fine, (2.0 * rtol + 2.0 * finer) / flat);
        }
    };
    agree("v_peak to rtol", rough.v_peak, fine.v_peak, 1.0);
    agree("v_trough to rtol", rough.v_trough, fine.v_trough, 1.0);
    if let (Some(rough), Some(fine)) = (rough.cycle, fine.cycle) {
        agree("period to rtol", rough.period, fine.period, 1.0);
        agree("cycle_peak to rtol", rough.v_peak, fine.v_peak, 1.0);
        agree("cycle_trough to rtol", rough.v_trough, fine.v_trough, 1.0);
    }
    if let (Some(rough), Some(fine)) = (rough.settling_time, fine.settling_time) {
        agree("settling_time to rtol", rough, fine, 1.0);
    }
    if let (Some(early), Some(late)) = (rough.t_peak, fine.t_peak) {
        agree("t_peak to rtol", early, late, (fine.v_peak / v_f).ln().min(1.0));
    }
}

fn sound(step: &VelocityStep, response: &Response, stable: bool, row: &mut Row) {
    let &Response { outcome, v_peak, v_trough, t_peak, settling_time, cycle, t_end, .. } = response;
    let v_f = step.transition.v_f;
    let moves = step.k.is_finite() && step.transition.v_i != v_f;
    row.fact("outcome decided", outcome != Outcome::Undecided || moves);
    match outcome {
        Outcome::Settled => row.fact("settles where stable", stable || !moves),
        Outcome::LimitCycle => {
            row.fact("a limit cycle has a period", cycle.is_some_and(|cycle| cycle.period > 0.0));
            row.fact("a limit cycle takes b > a", step.transition.law.b > step.transition.law.a);
        }
        Outcome::Diverged => row.fact("a step that diverges has no response", false),
        Outcome::Undecided => row.fact("nothing is reported if undecided", v_peak.is_nan() && settling_time.is_none()),
    }
    let Law { a, b } = step.transition.law;
    let is_proven = step.state_law != StateLaw::Prz && (b <= a || step.m == 0.0 && stable);
    // A proof of settling gives no numbers.
    let has_numbers = outcome != Outcome::Undecided && !(outcome == Outcome::Settled && is_proven && v_peak.is_nan());
    if has_numbers {
        row.fact("peak and trough about v_f", v_peak >= v_f && (v_trough.is_nan() || v_trough <= v_f));
        row.fact("finite", v_peak.is_finite() && t_end.is_finite() && t_peak.is_none_or(f64::is_finite));
        row.fact("times in order", t_peak.is_none_or(|t| (0.0..=t_end).contains(&t)));
    }
    if let Some(cycle) = cycle {
        row.fact("the cycle is about v_f", cycle.v_peak >= v_f && (cycle.v_trough.is_nan() || cycle.v_trough <= v_f));
    }
}
