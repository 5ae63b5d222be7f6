//! Following a response cycle by cycle: extrema, and the section `v = v_f` crossed upwards.

use std::collections::VecDeque;

use super::run::{Leg, Run, between, step_to};
use super::scaled_block::{ScaledBlock, State, X, Y, Z};
use crate::numerics::root::crossing;
use crate::numerics::stiff::radau_iia_9;

/// A velocity and when it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremum {
    /// `ln(v/v_f)`.
    pub x: f64,
    /// Time since the start of the orbit, in `l/v_f`.
    pub t: f64,
}

/// What happened between two upward crossings of `v = v_f`; the first cycle begins where `v = v_f` is first met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// State at its end, on the section: `x = 0`.
    pub end: State,
    /// Time at its end, since the start of the orbit.
    pub t: f64,
    /// Duration.
    pub period: f64,
    /// Slowest and fastest moment; `None` if the first cycle has none.
    pub extrema: [Option<Seen>; 2],
}

/// Why an orbit is followed no further.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The state is as close to steady sliding as errors of steps tell.
    Quiet,
    /// No step is short enough.
    Ends,
    /// The work allowed is used up.
    Budget,
    /// The motion is too small to be told from the errors of its steps.
    Faint,
}

/// Distance from steady sliding, in `ln v`, within which motions are linear to ten digits: their squares.
const LINEAR: f64 = 1e-5;

/// Distance from rest, in errors of a step, that counts as rest. Chosen: errors of three steps may add up before they decay.
const REST: f64 = 3.0;

/// Settled means `|v/v_f - 1|` below this, for good.
pub const SETTLED: f64 = 0.01;

/// `ln(1 - SETTLED)` and `ln(1 + SETTLED)`.
pub const BAND: [f64; 2] = [-0.01005033585350144, 0.009950330853168083];

/// Fractions of a step, before and after, within which an extremum is looked for again. Chosen: the dense output, of order 5, is
/// nearer at every tolerance.
const POLISH_WINDOW: [f64; 2] = [0.125, 0.125];

/// A response under way.
#[derive(Debug)]
pub struct Orbit<'a> {
    slider: &'a ScaledBlock,
    run: Run<'a>,
    /// Distance from steady sliding within which it rests.
    quiet: f64,
    /// Time from the last section to the start of the last step: the time since the start has too few digits for short cycles
    /// after a long rest.
    elapsed: f64,
    /// Whether `v = v_f` has been met.
    met: bool,
    /// Cycles that ended in the last step and were not given out yet: one step can cross the section several times.
    closed: VecDeque<Cycle>,
    /// Slope of `x` at the end of the last step.
    slope: f64,
    high: Option<Seen>,
    low: Option<Seen>,
    /// The last entry into the band of settled velocities; `None` outside.
    entry: Option<Entry>,
}

/// An extremum as it was seen, good to the order of the dense output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Where and when, about.
    pub rough: Extremum,
    /// The step and the share of it; `None` at an arrest.
    place: Option<(Leg, f64)>,
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    edge: f64,
    place: Option<(Leg, f64)>,
}

impl<'a> Orbit<'a> {
    /// Starts at `state`.
    pub fn new(slider: &'a ScaledBlock, state: State, tolerance: f64) -> Orbit<'a> {
        Orbit {
            slider,
            run: slider.run(state, slider.first_step(&state), tolerance),
            quiet: quiet(tolerance),
            elapsed: 0.0,
            met: state[X] == 0.0,
            closed: VecDeque::new(),
            slope: 0.0,
            high: None,
            low: None,
            entry: is_inside(state[X]).then_some(Entry { edge: state[X], place: None }),
        }
    }

    /// Time reached.
    pub fn t(&self) -> f64 {
        self.run.t()
    }

    /// Follows up to the next section. An orbit that `may_rest` ends where it is quiet. Steps come off the `budget`.
    pub fn cycle(&mut self, may_rest: bool, budget: &mut u32) -> Result<Cycle, Stop> {
        loop {
            if let Some(cycle) = self.closed.pop_front() {
                return Ok(cycle);
            }
            if *budget == 0 {
                return Err(Stop::Budget);
            }
            *budget -= 1;
            if may_rest && self.is_quiet() {
                return Err(Stop::Quiet);
            }
            if let Some(arrested) = self.slider.arrest(self.run.y()) {
                // It falls past v_f, and out of the band of settled velocities.
                self.met |= self.run.y()[X] > 0.0 && arrested[X] <= 0.0;
                self.entry = self.entry.filter(|_| is_inside(arrested[X]));
                self.run.jump(arrested, self.slider.first_step(&arrested));
                self.turn(-1.0, Seen { rough: Extremum { x: arrested[X], t: self.run.t() }, place: None });
                self.slope = 0.0;
            }
            let leg = step_to(&mut self.run, f64::MAX).map_err(|_| Stop::Ends)?;
            self.look(&leg);
            self.elapsed += leg.h();
        }
    }

    fn is_quiet(&self) -> bool {
        let [z, y, x] = *self.run.y();
        let ScaledBlock { a, b, inertia, k } = *self.slider;
        // Friction turns a share b/a of ln theta into ln v, and a soft spring moves masses of M and a by its energy.
        let force = a.min((k * (inertia + a)).sqrt());
        x.abs() < self.quiet && y.abs() * a.max(b) < self.quiet * a && z.abs() < self.quiet * force
    }

    /// Looks through a step, from node to node, for what happens in it.
    fn look(&mut self, leg: &Leg) {
        let mut u0 = 0.0;
        let (mut x0, mut slope0) = (leg.start()[X], leg.slope(X, 0.0));
        if self.slope * slope0 < 0.0 {
            // Between two steps: the slope of their polynomials jumps a little.
            self.turn(self.slope, Seen { rough: Extremum { x: x0, t: leg.t() }, place: None });
        }
        for u1 in radau_iia_9().nodes {
            let (x1, slope1) = (leg.value(X, u1), leg.slope(X, u1));
            if slope0 * slope1 < 0.0 {
                let turn = crossing(|u| leg.slope(X, u), [u0, u1], [slope0, slope1], 1e-6 * (u1 - u0));
                let x = leg.value(X, turn);
                self.pass(leg, [u0, turn], [x0, x]);
                let rough = Extremum { x, t: leg.time(turn) };
                self.turn(slope0, Seen { rough, place: Some((*leg, turn)) });
                self.pass(leg, [turn, u1], [x, x1]);
            } else {
                self.pass(leg, [u0, u1], [x0, x1]);
            }
            (u0, x0, slope0) = (u1, x1, slope1);
        }
        self.slope = slope0;
    }

    /// Notes an extremum after a rise or a fall, if `v = v_f` has been met and it is further out than `v_f` and the one
    /// before: at rest rounding makes extrema as well.
    fn turn(&mut self, slope: f64, seen: Seen) {
        let (kept, sign) = if slope > 0.0 { (&mut self.high, 1.0) } else { (&mut self.low, -1.0) };
        let out = sign * seen.rough.x;
        if self.met && out > 0.0 && kept.is_none_or(|kept| out > sign * kept.rough.x) {
            *kept = Some(seen);
        }
    }

    /// Looks through a piece in which the velocity only rises or only falls.
    fn pass(&mut self, leg: &Leg, u: [f64; 2], x: [f64; 2]) {
        let at = |level: f64| crossing(|u| leg.value(X, u) - level, u, [x[0] - level, x[1] - level], 1e-9);
        let (rises, falls) = (x[0] < 0.0 && x[1] >= 0.0, x[0] > 0.0 && x[1] <= 0.0);
        if rises {
            let cycle = self.close(leg, at(0.0));
            self.closed.push_back(cycle);
            (self.high, self.low) = (None, None);
        }
        self.met |= rises || falls;
        if !is_inside(x[1]) {
            self.entry = None;
        } else if self.entry.is_none() {
            let edge = if x[0] > 0.0 { BAND[1] } else { BAND[0] };
            self.entry = Some(Entry { edge, place: Some((*leg, at(edge))) });
        }
    }

    /// The cycle that ends at the section, at about the share `u` of a step.
    fn close(&mut self, leg: &Leg, u: f64) -> Cycle {
        let (end, t, part) = self.exactly(leg, u, 0.0);
        let time = part.map_or(u * leg.h(), |part| part.h());
        let cycle =
            Cycle { end: [end[Z], end[Y], 0.0], t, period: self.elapsed + time, extrema: [self.low, self.high] };
        // The whole step will be added.
        self.elapsed = -time;
        cycle
    }

    /// State and time where `x` is `level`, near the share `u` of a step, to the order of the method.
    fn exactly(&mut self, leg: &Leg, u: f64, level: f64) -> (State, f64, Option<Leg>) {
        let mut u = u;
        let mut best = (std::array::from_fn(|r| leg.value(r, u)), leg.time(u), None);
        for _ in 0..2 {
            let Some(part) = between(&mut self.run, leg, 0.0, u) else { break };
            best = (*part.end(), part.time(1.0), Some(part));
            let change = (level - part.end()[X]) / part.slope(X, 1.0);
            u += change / leg.h();
            if change.abs() <= 1e-12 * leg.h() || !(u > 0.0 && u < 1.5) {
                break;
            }
        }
        best
    }

    /// An extremum, integrated again about where it was seen, on ever shorter steps.
    pub fn polished(&mut self, Seen { rough, place }: Seen) -> Extremum {
        let Some((mut leg, mut u)) = place else { return rough };
        for near in POLISH_WINDOW {
            let Some(part) = between(&mut self.run, &leg, (u - near).max(0.0), u + near) else { return rough };
            let slopes = [part.slope(X, 0.0), part.slope(X, 1.0)];
            if slopes[0] * slopes[1] >= 0.0 {
                break;
            }
            (leg, u) = (part, crossing(|u| part.slope(X, u), [0.0, 1.0], slopes, 1e-9));
        }
        between(&mut self.run, &leg, 0.0, u).map_or(rough, |part| Extremum { x: part.end()[X], t: part.time(1.0) })
    }

    /// The slowest and the fastest moment since the last section, if there was one.
    pub fn extrema(&self) -> [Option<Seen>; 2] {
        [self.low, self.high]
    }

    /// When the velocity last came into the band of settled velocities; `None` if it is outside.
    pub fn settled_at(&mut self) -> Option<f64> {
        let Entry { edge, place } = self.entry?;
        Some(place.map_or(0.0, |(leg, u)| self.exactly(&leg, u, edge).1))
    }
}

/// How close to steady sliding a motion rests whose steps have errors below `tolerance`: what is left of it is linear, and
/// of the size of these errors.
pub(super) fn quiet(tolerance: f64) -> f64 {
    LINEAR.min(REST * tolerance)
}

fn is_inside(x: f64) -> bool {
    x > BAND[0] && x < BAND[1]
}
