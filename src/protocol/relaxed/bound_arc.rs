//! Arcs at `v = 1` and on the ceiling: time, work and friction.

use std::f64::consts::PI;

use super::Problem;
use super::state::State;
use crate::model::StateLaw;
use crate::numerics::dilogarithm::dilogarithm;
use crate::numerics::elementary::{ln, ln_1p};
use crate::numerics::gauss::{SHORT_NODES, rule};

/// The bound on which an arc lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// At `v = 1`.
    Wait,
    /// On the ceiling.
    Jerk,
}

/// An arc on a bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundArc {
    /// The bound.
    pub kind: Kind,
    /// Time at `v = 1`, slip on the ceiling.
    pub length: f64,
    /// Where it begins and ends.
    pub ends: [State; 2],
    /// Change of theta, without its sign.
    pub span: f64,
}

impl BoundArc {
    /// Its duration.
    pub fn time(&self, ceiling: f64) -> f64 {
        match self.kind {
            Kind::Wait => self.length,
            Kind::Jerk => self.length / ceiling,
        }
    }

    /// Its velocity.
    pub(super) fn velocity(&self, problem: &Problem) -> f64 {
        match self.kind {
            Kind::Wait => 1.0,
            Kind::Jerk => problem.ceiling,
        }
    }
}

/// Time at `v = 1` and on the ceiling.
pub fn times(arcs: &[BoundArc; 2], ceiling: f64) -> [f64; 2] {
    let of = |kind: Kind| arcs.iter().filter(|arc| arc.kind == kind).map(|arc| arc.time(ceiling)).sum();
    [of(Kind::Wait), of(Kind::Jerk)]
}

/// Work of both arcs of a path from one end of `problem` to the other.
pub(super) fn work(arcs: &[BoundArc; 2], problem: &Problem) -> f64 {
    let [slip, a, b] = terms(arcs, problem);
    slip + (problem.a * a + problem.b * b)
}

/// The slip on both arcs, and the derivatives of their work with respect to `a` and `b`, in which it is linear.
pub(super) fn terms(arcs: &[BoundArc; 2], problem: &Problem) -> [f64; 3] {
    let Problem { law, ceiling, ln_ceiling, ratio, .. } = *problem;
    let of = |kind: Kind| arcs.iter().filter(|arc| arc.kind == kind).map(|arc| arc.length).sum::<f64>();
    let [wait, jerk] = [Kind::Wait, Kind::Jerk].map(of);
    let by_state = if law == StateLaw::Slip {
        // int ln theta v dt is the change of ln theta, but for a constant on the ceiling.
        if problem.rises() { -ratio } else { ratio }
    } else {
        let by_state = arcs.iter().map(|arc| {
            let [from, to] = arc.ends;
            match arc.kind {
                Kind::Wait => integral(from.theta, arc.span),
                // The integrand is the same, but for its sign, at x and 1/x. Below the steady state of the ceiling theta rises.
                Kind::Jerk if from.excess < 0.0 => integral(ceiling * from.theta, ceiling * arc.span),
                Kind::Jerk => {
                    let [x, y] = [from, to].map(|end| 1.0 / (ceiling * end.theta));
                    -integral(x, arc.span * ceiling * x * y)
                }
            }
        });
        2.0 * by_state.sum::<f64>()
    };
    [wait + jerk, ln_ceiling * jerk, by_state - ln_ceiling * jerk]
}

/// Least and greatest friction on arcs of some length.
pub(super) fn friction(arcs: &[BoundArc; 2], problem: &Problem) -> [f64; 2] {
    let ends = arcs.iter().filter(|arc| arc.length > 0.0).flat_map(|arc| {
        let direct = match arc.kind {
            Kind::Wait => 0.0,
            Kind::Jerk => problem.a * problem.ln_ceiling,
        };
        arc.ends.map(|end| 1.0 + (direct - problem.b * end.below_floor))
    });
    ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], tau| [least.min(tau), most.max(tau)])
}

/// `int ln x/(1 - x^2) dx` from `x > 0` over `span >= 0`, up to 1 at most.
fn integral(x: f64, span: f64) -> f64 {
    if span > x {
        return primitive(x + span) - primitive(x);
    }
    // The integrand is regular at 1; the nearest singularity, at 0, is three half lengths from the middle: the error is (3 + sqrt 8)^-32.
    let rule = rule(SHORT_NODES);
    let half = 0.5 * span;
    let slope = |node: f64| {
        let x = x + half * (1.0 + node);
        if x == 1.0 { -0.5 } else { ln(x) / ((1.0 - x) * (1.0 + x)) }
    };
    half * rule.x.iter().zip(&rule.w).map(|(&node, &weight)| weight * slope(node)).sum::<f64>()
}

/// `artanh(x) ln x - [Li_2(x) - Li_2(-x)]/2`, whose derivative is `ln x/(1 - x^2)`; `-pi^2/8` at 1.
fn primitive(x: f64) -> f64 {
    if x >= 1.0 {
        return -PI * PI / 8.0;
    }
    0.5 * (ln_1p(2.0 * x / (1.0 - x)) * ln(x) - (dilogarithm(x) - dilogarithm(-x)))
}
