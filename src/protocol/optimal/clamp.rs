//! A free extremal, clamped at the ceilings: the pieces of the optimal protocol, all with the same `C`.
//!
//! Where theta falls the optimum is `z = ln u = min(z_free, z_cap)`. It is on a ceiling where `G = a [phi(z_cap) - E]` is
//! negative, so the pieces end at the zeros of `G`, which has one stationary point at most, and where the ceilings cross.

use std::cell::Cell;

use super::arc::{Arc, ArcPoint, Chart, Sums, friction_range, steady_friction};
use super::ceiling::{CeilingArc, Ceilings};
use super::extremal::{Extremal, Problem};
use super::lifetime::Lifetime;
use super::{ArcKind, floor};
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p, phi, phi_and_slope};
use crate::numerics::{MAX_SQUARABLE, MAX_STEPS};

/// The part of an extremal on which theta falls to `theta_1`, as a function of the depth `d = ln(theta_top/theta)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fall {
    law: Law,
    pub theta_top: f64,
    ln_theta_top: f64,
    /// `a E` at the top; 0 where theta turns there.
    excess: f64,
    /// Friction at the top with `u = 1`.
    friction: f64,
    /// The depth of `theta_1`.
    pub depth: f64,
    /// `ln u` at the top on the ceiling of the velocity and of friction.
    z_v: f64,
    z_tau: f64,
    kappa: f64,
}

impl Fall {
    /// `a E` and its derivative with respect to the depth.
    fn energy(&self, d: f64) -> (f64, f64) {
        let Law { a, b } = self.law;
        // Each keeps its digits.
        let (theta, shrunk) = if d > 1.0 {
            let theta = exp(-d);
            (theta, theta - 1.0)
        } else {
            let shrunk = exp_m1(-d);
            (1.0 + shrunk, shrunk)
        };
        let value = self.excess * theta - (b - a) * d - self.friction * shrunk;
        (value, (self.friction - self.excess) * theta - (b - a))
    }

    /// `ln u` on a ceiling.
    pub fn cap(&self, kind: ArcKind, d: f64) -> f64 {
        if kind == ArcKind::VCeiling { self.z_v - d } else { self.z_tau - self.kappa * d }
    }

    /// `a phi(z_cap)` and `a E` with their derivatives with respect to the depth.
    fn parts(&self, kind: ArcKind, d: f64) -> [(f64, f64); 2] {
        let (phi, slope) = phi_and_slope(self.cap(kind, d));
        let fall = if kind == ArcKind::VCeiling { 1.0 } else { self.kappa };
        [(self.law.a * phi, -self.law.a * slope * fall), self.energy(d)]
    }

    /// `G = a [phi(z_cap) - E]`.
    fn gap(&self, kind: ArcKind, d: f64) -> f64 {
        let [(phi, _), (energy, _)] = self.parts(kind, d);
        phi - energy
    }

    /// The depth at which `G` of friction is stationary.
    fn stationary(&self) -> f64 {
        let Law { a, b } = self.law;
        let ratio = (self.excess - self.friction) / (a * self.kappa);
        if ratio > 0.0 && b > 0.0 { a / b * (ln(ratio) - self.z_tau) } else { f64::NAN }
    }

    /// Intervals of the depth, in their order, in each of which one ceiling is the lower one and its `G` is monotone: two of
    /// friction, then that of the velocity.
    fn intervals(&self, ceilings: &Ceilings) -> [(ArcKind, [f64; 2]); 3] {
        let across = (self.depth - ceilings.crossing()).max(0.0).min(self.depth);
        let stationary = if across > 0.0 { self.stationary() } else { 0.0 };
        let bend = if stationary > 0.0 && stationary < across { stationary } else { across };
        let of = |kind, from, to| (kind, [from, to]);
        [
            of(ArcKind::TauCeiling, 0.0, bend),
            of(ArcKind::TauCeiling, bend, across),
            of(ArcKind::VCeiling, across, self.depth),
        ]
    }

    /// Whether a ceiling binds anywhere.
    pub fn is_bound(&self, ceilings: &Ceilings) -> bool {
        let below = |kind, [from, to]: [f64; 2]| from < to && (self.gap(kind, from) < 0.0 || self.gap(kind, to) < 0.0);
        self.intervals(ceilings).into_iter().any(|(kind, interval)| below(kind, interval))
    }

    /// The zero of a monotone `G` between two depths at which it is of different signs; `known` is one nearby, if it is
    /// between them.
    fn zero(&self, kind: ArcKind, [mut from, mut to]: [f64; 2], [start, end]: [f64; 2], known: f64) -> f64 {
        let Law { a, b } = self.law;
        let rise = if kind == ArcKind::VCeiling { 1.0 } else { self.kappa };
        let mut d = if known > from && known < to {
            known
        } else if start.abs() < end.abs() {
            from
        } else {
            to
        };
        for _ in 0..MAX_STEPS {
            let [(phi, phi_slope), (energy, energy_slope)] = self.parts(kind, d);
            let (value, slope) = (phi - energy, phi_slope - energy_slope);
            if (value < 0.0) == (start < 0.0) {
                from = d
            } else {
                to = d
            }
            // phi may be an exponential that is far from its zero.
            let newton = if phi > 2.0 * energy && energy > 0.0 {
                ln(phi / energy) / (phi_slope / phi - energy_slope / energy)
            } else {
                value / slope
            };
            // Halley's method, of whose error that of third order is left.
            let bend = 0.5 * (rise * (a * rise - phi_slope) + energy_slope + b - a) / slope;
            let correction = if phi > 2.0 * energy { f64::INFINITY } else { (bend * newton).abs() };
            let step = if correction < 0.3 { newton / (1.0 - bend * newton) } else { newton };
            let next = d - step;
            // The third derivative is that of phi, whose rate cancels where both terms fall alike.
            let third = rise.abs().max(1.0) * rise.abs().max(1.0) * (phi_slope / slope).abs();
            let left = (correction * correction + third * newton * newton) * step.abs();
            if left.min(step.abs()) <= f64::EPSILON * d {
                return next.max(from).min(to);
            }
            d = if next > from && next < to { next } else { 0.5 * (from + to) };
        }
        d
    }
}

/// Depths of the switches of the last path of a search, from which the next search for them starts: the first and the second
/// of friction, and that of the velocity; NaN before.
pub(super) struct Switches([Cell<f64>; 3]);

impl Switches {
    pub fn unknown() -> Switches {
        Switches([const { Cell::new(f64::NAN) }; 3])
    }
}

/// A piece of a clamped extremal.
#[derive(Debug, Clone, Copy)]
pub(super) enum ClampedPiece {
    /// A part of the free extremal.
    Free {
        arc: Arc,
        /// What its ends add to the sensitivity: `theta/(u - 1)` at a switch, or a term of the extremal.
        turned: f64,
        /// Whether it starts or ends where the extremal does.
        at: [bool; 2],
        ends: [ArcPoint; 2],
    },
    /// A part on a ceiling.
    Ceiling { arc: CeilingArc, gap: Gap },
}

/// `G = a [phi(z_cap) - E]` along an arc on a ceiling, from its value at one place: where a free arc begins it is 0, and
/// nothing cancels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gap {
    /// Whether it counts from the end of greater theta, or from the other.
    from_high: bool,
    /// The value, `u` and `C theta` there.
    value: f64,
    u: f64,
    pull: f64,
}

/// A place on an arc by `ln theta` below its end of greater theta, and above the other: near an end only one of them has
/// its digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Depth {
    pub below: f64,
    pub above: f64,
}

impl Gap {
    /// Refers to an end at which the value is known.
    fn refer(&mut self, arc: &CeilingArc, to_high: bool, value: f64) {
        if self.from_high != to_high {
            self.pull *= exp(if to_high { arc.length } else { -arc.length });
        }
        self.u = exp(if to_high { arc.z_hi } else { arc.z_lo });
        (self.from_high, self.value) = (to_high, value);
    }

    /// `ln theta` from the end that it counts from.
    fn way(&self, depth: Depth) -> f64 {
        if self.from_high { -depth.below } else { depth.above }
    }

    /// `C theta`.
    pub fn pull(&self, depth: Depth) -> f64 {
        self.pull * exp(self.way(depth))
    }

    /// The value at a place on `arc`.
    pub fn value(&self, arc: &CeilingArc, depth: Depth) -> f64 {
        let (Law { a, b }, rise, y) = (arc.ceilings.law, arc.rise(), self.way(depth));
        let (grown, bend) = if rise == 1.0 { (exp_m1(y), b * y) } else { (exp_m1(rise * y), 0.0) };
        self.value + a * self.u * grown - self.pull * exp_m1(y) - bend
    }

    /// The limit of the value over `u - 1` at `u = 1`, for a value that vanishes there.
    pub fn limit(&self, arc: &CeilingArc, depth: Depth) -> f64 {
        let Law { a, b } = arc.ceilings.law;
        (a - b - self.pull(depth)) / arc.rise()
    }
}

/// A clamped extremal after its time at the floor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Path {
    pub extremal: Extremal,
    pieces: [Option<ClampedPiece>; Path::MAX_PIECES],
    /// Times on the ceilings of the velocity and of friction.
    pub times: (f64, f64),
    /// Derivative of the time with respect to the parameter where quadratures do not resolve it.
    rate: Option<f64>,
}

impl Path {
    /// Most pieces. Derived: friction, free, friction, free, velocity.
    const MAX_PIECES: usize = 5;

    /// A free extremal as one piece.
    pub fn of(problem: &Problem, extremal: Extremal) -> Path {
        let mut path = Path::new(extremal);
        path.push(whole(problem, &extremal));
        path
    }

    /// A path without pieces.
    fn new(extremal: Extremal) -> Path {
        Path { extremal, pieces: [None; Path::MAX_PIECES], times: (0.0, 0.0), rate: None }
    }

    /// The pieces in their order.
    pub fn pieces(&self) -> impl Iterator<Item = &ClampedPiece> {
        self.pieces.iter().flatten()
    }

    fn push(&mut self, piece: ClampedPiece) {
        if let ClampedPiece::Ceiling { arc, .. } = &piece {
            let time = if arc.kind == ArcKind::VCeiling { &mut self.times.0 } else { &mut self.times.1 };
            *time += arc.time();
        }
        if let Some(room) = self.pieces.iter_mut().find(|room| room.is_none()) {
            *room = Some(piece);
        }
    }

    /// The kinds of all pieces as one number.
    pub fn signature(&self) -> u32 {
        let code = |piece: &ClampedPiece| match piece {
            ClampedPiece::Free { .. } => 1,
            ClampedPiece::Ceiling { arc, .. } => 1 + arc.kind as u32,
        };
        let floor = u32::from(self.extremal.time_at_floor > 0.0);
        self.pieces().fold(floor, |sum, piece| 4 * sum + code(piece))
    }

    /// The extremal at `problem`, clamped; `None` where theta could not fall from the top.
    pub fn clamped(problem: &Problem, ceilings: &Ceilings, extremal: Extremal, switches: &Switches) -> Option<Path> {
        let Some(fall) = falling_part(problem, ceilings, &extremal) else {
            return Some(Path::of(problem, extremal));
        };
        if fall.z_v.min(fall.z_tau) <= 0.0 {
            return None;
        }
        Some(Path::along(problem, ceilings, extremal, &fall, switches))
    }

    /// The extremal with its falling part clamped.
    pub fn along(problem: &Problem, ceilings: &Ceilings, extremal: Extremal, fall: &Fall, switches: &Switches) -> Path {
        let mut path = Path::new(extremal);
        // What rises to the turn is free.
        let turns = fall.excess == 0.0;
        let mut add = |kind, from: f64, to: f64, gap| match kind {
            _ if from >= to && !(turns && to == 0.0) => (),
            ArcKind::Free => path.push(part(problem, &extremal, fall, from, to)),
            _ => path.push(ceiling_part(ceilings, fall, kind, [from, to], gap)),
        };
        let (mut kind, mut from, mut gap) = (ArcKind::Free, 0.0, 0.0);
        for ((ceiling, [first, last]), known) in fall.intervals(ceilings).into_iter().zip(&switches.0) {
            if first >= last {
                continue;
            }
            let ends = [fall.gap(ceiling, first), fall.gap(ceiling, last)];
            let mut switch = last;
            if (ends[0] < 0.0) != (ends[1] < 0.0) {
                switch = fall.zero(ceiling, [first, last], ends, known.get());
                known.set(switch);
            }
            for (at, to, value, sign) in [(first, switch, ends[0], ends[0]), (switch, last, 0.0, ends[1])] {
                let next = if sign < 0.0 { ceiling } else { ArcKind::Free };
                if at < to && next != kind {
                    add(kind, from, at, gap);
                    (kind, from, gap) = (next, at, value);
                }
            }
        }
        add(kind, from, fall.depth, gap);
        path
    }

    /// Refers `G` of each arc on a ceiling to where it is 0, at an adjacent free arc, or to the arc that it continues.
    pub fn refer_to_switches(&mut self) {
        let mut known = [false; Path::MAX_PIECES];
        for at_end in [false, true] {
            let mut neighbour: Option<Option<f64>> = None;
            for step in 0..Path::MAX_PIECES {
                let i = if at_end { Path::MAX_PIECES - 1 - step } else { step };
                let Some(piece) = &mut self.pieces[i] else { continue };
                let ClampedPiece::Ceiling { arc, gap } = piece else {
                    neighbour = Some(Some(0.0));
                    continue;
                };
                let (near_high, far) = (arc.falls() != at_end, arc.end(arc.falls() == at_end));
                if let (false, Some(Some(value))) = (known[i], neighbour) {
                    gap.refer(arc, near_high, value);
                    known[i] = true;
                }
                neighbour = Some(known[i].then(|| gap.value(arc, far)));
            }
        }
    }

    /// Quadrature of the free pieces to relative accuracy `tolerance`, but with the whole time, also at the floor and on the ceilings;
    /// and the derivative of that time with respect to the parameter of the family.
    pub fn sums(&self, tolerance: f64) -> Option<(Sums, f64)> {
        let mut sums = Sums { time: self.extremal.time_at_floor, ..Sums::default() };
        let (mut ends, mut has) = (0.0, [false; 2]);
        for piece in self.pieces() {
            let ClampedPiece::Free { arc, turned, at, .. } = piece else { continue };
            sums.add(&arc.sums(tolerance)?);
            ends += turned;
            has = [has[0] || at[0], has[1] || at[1]];
        }
        sums.time += self.times.0 + self.times.1;
        let rate = self.rate.unwrap_or_else(|| self.extremal.rate_of(&sums, ends, has));
        (sums.time.is_finite() && sums.work.is_finite()).then_some((sums, rate))
    }

    /// Work at the floor and on the ceilings, and the nodes that it takes.
    pub fn bound_work(&self, problem: &Problem) -> (f64, u32) {
        let (mut work, mut nodes) = (0.0, 0);
        for piece in self.pieces() {
            if let ClampedPiece::Ceiling { arc, .. } = piece {
                let (of_arc, spent) = arc.work();
                work += of_arc;
                nodes += spent;
            }
        }
        (work + floor::work(&problem.law, problem.from, self.extremal.time_at_floor), nodes)
    }

    /// Friction along the pieces and at the floor; `met` is the least at nodes.
    pub fn friction(&self, problem: &Problem, met: f64) -> FrictionRange {
        let (law, c) = (&problem.law, self.extremal.arc.c());
        let waits = self.extremal.time_at_floor > 0.0;
        let least = if waits { met.min(1.0 + law.b * problem.from.ln) } else { met };
        let mut range = FrictionRange { least, least_steady: f64::INFINITY, greatest: f64::NEG_INFINITY };
        for piece in self.pieces() {
            let ends = piece.ends();
            let steady = |end: &ArcPoint| steady_friction(law, end.ln_theta);
            let at = |end: &ArcPoint| steady(end) + law.a * end.ln_u;
            let [low, high] = match piece.kind() {
                ArcKind::Free => friction_range(law, c, &ends),
                _ => [at(&ends[0]).min(at(&ends[1])), at(&ends[0]).max(at(&ends[1]))],
            };
            range.least = range.least.min(low);
            range.greatest = range.greatest.max(high);
            if piece.kind() == ArcKind::TauCeiling {
                range.least_steady = range.least_steady.min(steady(&ends[0])).min(steady(&ends[1]));
            }
        }
        range.least_steady = range.least_steady.min(range.least);
        range
    }
}

/// Friction along a path.
pub(super) struct FrictionRange {
    pub least: f64,
    /// The least, with that of steady sliding on the ceiling of friction.
    pub least_steady: f64,
    pub greatest: f64,
}

impl ClampedPiece {
    /// An arc on a ceiling with `G` from its `value` at the end of greater theta, where `C theta` is `pull`.
    fn on_ceiling(arc: CeilingArc, pull: f64, value: f64) -> ClampedPiece {
        ClampedPiece::Ceiling { arc, gap: Gap { from_high: true, value, u: exp(arc.z_hi), pull } }
    }

    pub fn kind(&self) -> ArcKind {
        match self {
            ClampedPiece::Free { .. } => ArcKind::Free,
            ClampedPiece::Ceiling { arc, .. } => arc.kind,
        }
    }

    /// The start and the end.
    #[inline(always)]
    pub fn ends(&self) -> [ArcPoint; 2] {
        match self {
            ClampedPiece::Free { ends, .. } => *ends,
            ClampedPiece::Ceiling { arc, .. } => {
                let high = ArcPoint { theta: arc.theta_hi, ln_theta: ln(arc.theta_hi), ln_u: arc.z_hi };
                let (theta, ln_theta) = (arc.theta_hi * exp(-arc.length), high.ln_theta - arc.length);
                let low = ArcPoint { theta, ln_theta, ln_u: arc.z_lo };
                if arc.falls() { [high, low] } else { [low, high] }
            }
        }
    }
}

/// The part of an extremal on which theta falls; `None` if it rises to the end.
pub(super) fn falling_part(problem: &Problem, ceilings: &Ceilings, extremal: &Extremal) -> Option<Fall> {
    let law = problem.law;
    let (theta_top, ln_theta_top, excess, depth) = match extremal.arc.chart {
        Chart::Turning { x_end, .. } if x_end <= 0.0 => return None,
        Chart::Turning { theta_h, ln_theta_h, x_start, x_end, .. } if x_start <= 0.0 => {
            (theta_h, ln_theta_h, 0.0, ln_1p(x_end * x_end))
        }
        Chart::Direct { y_end: 0.0, .. } => return None,
        _ => (problem.from.theta, problem.from.ln, law.a * phi(extremal.start), problem.depth()),
    };
    Some(Fall {
        law,
        theta_top,
        ln_theta_top,
        excess,
        friction: steady_friction(&law, ln_theta_top),
        depth,
        z_v: ceilings.cap_of(ArcKind::VCeiling, depth),
        z_tau: ceilings.cap_of(ArcKind::TauCeiling, depth),
        kappa: ceilings.kappa,
    })
}

/// A free extremal as one piece.
fn whole(problem: &Problem, extremal: &Extremal) -> ClampedPiece {
    let [start, end] = extremal.end_terms();
    let ends = ends_of(problem, extremal);
    ClampedPiece::Free { arc: extremal.arc, turned: start + end, at: [true, true], ends }
}

/// The start and the end of the arc of an extremal.
#[inline(always)]
fn ends_of(problem: &Problem, extremal: &Extremal) -> [ArcPoint; 2] {
    // Where the arc leaves the floor, u = theta.
    let ln_theta = if extremal.time_at_floor > 0.0 { extremal.start } else { problem.from.ln };
    let start = ArcPoint { theta: extremal.theta_s, ln_theta, ln_u: extremal.start };
    [start, ArcPoint { theta: problem.to.theta, ln_theta: problem.to.ln, ln_u: extremal.end }]
}

/// The free part of an extremal between two depths; from the start if the first is 0.
fn part(problem: &Problem, extremal: &Extremal, fall: &Fall, from: f64, to: f64) -> ClampedPiece {
    let law = problem.law;
    let (first, last) = (from == 0.0, to == fall.depth);
    if first && last {
        return whole(problem, extremal);
    }
    let chart = match extremal.arc.chart {
        Chart::Turning { theta_h, ln_theta_h, x_start, x_end, .. } => {
            // 1 + X^2 = theta_h/theta.
            let top = if x_start <= 0.0 { 0.0 } else { x_start * x_start };
            let place = |d: f64| (top + (1.0 + top) * exp_m1(d)).sqrt();
            let begin = if first { x_start } else { place(from) };
            let end = if last { x_end } else { place(to) };
            let squares = (1.0 + top) * exp(from) * exp_m1(to - from);
            let x_squares = if first && x_start <= 0.0 { squares - x_start * x_start } else { squares };
            Chart::Turning { theta_h, ln_theta_h, x_start: begin, x_end: end, x_squares }
        }
        Chart::Direct { theta_a, z_a, friction_a, .. } => {
            Chart::Direct { theta_a, z_a, friction_a, y_start: -from, y_end: -to }
        }
    };
    let switch = |d: f64| {
        let ln_u = fall.cap(ArcKind::VCeiling, d).min(fall.cap(ArcKind::TauCeiling, d));
        ArcPoint { theta: fall.theta_top * exp(-d), ln_theta: fall.ln_theta_top - d, ln_u }
    };
    let [start, end] = ends_of(problem, extremal);
    let (start, end) = (if first { start } else { switch(from) }, if last { end } else { switch(to) });
    let swing = |at: ArcPoint| at.theta / exp_m1(at.ln_u);
    let [at_start, at_end] = extremal.end_terms();
    let turned = if last { at_end } else { swing(end) } + if first { at_start } else { -swing(start) };
    ClampedPiece::Free { arc: Arc { law, chart }, turned, at: [first, last], ends: [start, end] }
}

/// An arc on a ceiling, with `G` from its end of greater theta.
fn ceiling_part(ceilings: &Ceilings, fall: &Fall, kind: ArcKind, [from, to]: [f64; 2], value: f64) -> ClampedPiece {
    let theta_hi = fall.theta_top * exp(-from);
    // At theta_1 the ceilings are known best.
    let z_lo = if to == fall.depth { ceilings.cap_of(kind, 0.0) } else { fall.cap(kind, to) };
    let arc = ceilings.arc(kind, theta_hi, to - from, fall.cap(kind, from), z_lo);
    let pull = (fall.excess - fall.friction) * exp(-from);
    ClampedPiece::on_ceiling(arc, pull, value)
}

impl Path {
    /// An extremal that turns at `theta_c e^-delta`, the lifetime of steady sliding on the ceiling of friction being
    /// `theta_c`, clamped. `delta` may be too small for a number.
    pub fn lingering(problem: &Problem, ceilings: &Ceilings, extremal: Extremal, ln_delta: f64) -> Option<Path> {
        let mut fall = falling_part(problem, ceilings, &extremal)?;
        let slope = -ceilings.kappa;
        fall.z_tau = slope * exp(ln_delta);
        let mut path = Path::along(problem, ceilings, extremal, &fall, &Switches::unknown());
        // Squares of delta underflow.
        if exp(ln_delta) < 1.0 / MAX_SQUARABLE {
            path.rate = Some(-fall.theta_top / slope);
            let first = path.pieces.iter_mut().flatten().find_map(|piece| match piece {
                ClampedPiece::Ceiling { arc, .. } => Some(arc),
                ClampedPiece::Free { .. } => None,
            });
            if let Some(arc) = first {
                let before = arc.time();
                (arc.z_hi, arc.ln_z[0]) = (fall.z_tau, ln(slope) + ln_delta);
                path.times.1 += arc.time() - before;
            }
        }
        Some(path)
    }

    /// An extremal of a rising problem that meets a ceiling at `theta_1 e^-way`, where `ln u = z` and its slope over `ln
    /// theta` is `rise`, and stays there. `pace` is the derivative of `way` with respect to the parameter.
    pub fn rising(problem: &Problem, ceilings: &Ceilings, switch: Switch) -> Option<Path> {
        let Switch { way, z, ln_z, rise, pace_over_z } = switch;
        let (law, to) = (problem.law, &problem.to);
        let theta = Lifetime::with(to.theta * exp(-way), to.rest - to.theta * exp_m1(-way));
        let fall = exp_m1(way + problem.depth());
        if fall >= 0.0 || way < 0.0 {
            return None;
        }
        let sub = Problem { to: theta, fall, ..*problem };
        let mut extremal = sub.arriving(z, z - theta.ln, 1.0)?;
        // C = [a phi(z) - tau_ss]/theta along the ceiling, and its derivative with respect to ln theta.
        let c = extremal.arc.c();
        let steepness = (law.a * exp_m1(z) * rise - (law.b - law.a)) / theta.theta - c;
        extremal.follow_c(z, pace_over_z * steepness);
        let mut path = Path::of(&sub, extremal);
        let pull = c * theta.theta;
        let mut add = |arc: CeilingArc| {
            path.push(ClampedPiece::on_ceiling(arc, pull * (arc.theta_hi / theta.theta), 0.0));
        };
        if let Some(ln_z) = ln_z {
            let mut arc = ceilings.arc(ArcKind::TauCeiling, to.theta, way, ceilings.z_tau, z);
            arc.ln_z[1] = ln_z;
            add(arc);
        } else {
            // In time theta rises.
            let [high, low] = ceilings.arcs(to.theta, 0.0, -way);
            low.into_iter().chain(high).for_each(add);
        }
        Some(path)
    }
}

/// Where theta, rising, meets a ceiling.
pub(super) struct Switch {
    /// `ln(theta_1/theta)`.
    pub way: f64,
    /// `ln u`.
    pub z: f64,
    /// Logarithm of its absolute value, if that may be too small for a number.
    pub ln_z: Option<f64>,
    /// Derivative of `ln u` on the ceiling with respect to `ln theta`.
    pub rise: f64,
    /// Derivative of `way` with respect to the parameter, over `-z`.
    pub pace_over_z: f64,
}
