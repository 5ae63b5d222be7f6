//! Optimal protocols under a floor and ceilings by integration along `ln theta`: the free minimiser, clamped, with one `C`
//! (docs/derivations.md, equation 6).

use super::motion::{golden, lowest};
use super::route::integrate;
use crate::model::{Law, Transition};
use crate::numerics::root::{Probe, newton};
use crate::protocol::optimal::ArcKind;

/// A transition from a state variable to steady sliding, under bounds.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    pub law: Law,
    /// State variable at the start.
    pub from: f64,
    /// Velocity of the final steady state.
    pub v_f: f64,
    /// Duration.
    pub t_f: f64,
    /// Whether `v >= 1`.
    pub floor: bool,
    /// Velocity ceiling, or infinity.
    pub v_ceiling: f64,
    /// Friction ceiling, or infinity.
    pub tau_ceiling: f64,
}

/// Integrals along a protocol, and its ends.
#[derive(Debug, Clone, Copy, Default)]
pub struct Totals {
    pub time: f64,
    pub work: f64,
    pub time_at_floor: f64,
    pub time_at_v_ceiling: f64,
    pub time_at_tau_ceiling: f64,
    /// Integrals of the multipliers of the two ceilings.
    pub pressure: [f64; 2],
    /// Derivatives of the work with respect to `a` and `b`.
    pub by_law: [f64; 2],
    /// `W + C t` of a neighbouring protocol.
    pub varied: f64,
    pub v_start: f64,
    pub v_end: f64,
    pub theta_max: f64,
    /// Derivatives of the work with respect to theta at the start and at the end.
    pub costate: [f64; 2],
    /// `dW*/dt_f` with the opposite sign.
    pub c: f64,
}

/// A protocol, and the effect of rounding on it.
pub struct Solution {
    pub totals: Totals,
    /// The protocol at another `C` that rounding does not distinguish.
    near: Totals,
    legs: Vec<MonotoneArc>,
    /// The arc at the start.
    pub arc: ArcKind,
}

impl Solution {
    /// Whether theta rises first and falls at the end.
    pub fn turns(&self) -> bool {
        self.legs.len() > 1
    }

    /// The effect of rounding on a number of the protocol.
    pub fn noise(&self, number: impl Fn(&Totals) -> f64) -> f64 {
        (number(&self.near) - number(&self.totals)).abs()
    }
}

/// A leg, on which `theta` is monotone: `ln theta` at its ends.
#[derive(Debug, Clone, Copy)]
struct MonotoneArc {
    start: f64,
    end: f64,
    /// `ln theta` at the turn at one of its ends, if any.
    turn: Option<f64>,
    c: f64,
}

impl MonotoneArc {
    fn falls(&self) -> bool {
        self.end < self.start
    }
}

/// An arc: the bound on which a leg is between two values of `ln theta`, the lower one first.
struct Piece {
    kind: ArcKind,
    low: f64,
    high: f64,
}

/// Relative distance from the border of the feasible region below which rounding decides. Chosen: a hundred times the tolerance of
/// the integrator (`route.rs`).
const BORDER_RTOL: f64 = 1e-11;

/// Distance of a friction ceiling from steady sliding, in `mu_0 sigma`, below which rounding decides. Chosen: a hundred roundings.
const STEADY_NOISE: f64 = 2e-14;

/// Relative change of `z` of the neighbouring protocols. Chosen: its effect of second order, 1e-6 of the work, is above rounding.
const VARIATION_FRACTION: f64 = 1e-3;

/// Number of integrated quantities, with the variable itself.
const SUMS: usize = 8;

impl Way {
    /// The transition under ceilings of velocity and friction.
    pub fn of(problem: &Transition, t_f: f64, floor: bool, [v_ceiling, tau_ceiling]: [f64; 2]) -> Way {
        let Transition { law, v_i, v_f } = *problem;
        Way { law, from: 1.0 / v_i, v_f, t_f, floor, v_ceiling, tau_ceiling }
    }

    /// State variable at the end.
    fn to(&self) -> f64 {
        1.0 / self.v_f
    }

    /// `ln theta` at both ends.
    fn ends(&self) -> [f64; 2] {
        [self.from.ln(), self.to().ln()]
    }

    fn steady_friction(&self, l: f64) -> f64 {
        1.0 + (self.law.b - self.law.a) * l
    }

    /// `z = ln(theta v)` on the ceilings of velocity and friction.
    fn caps(&self, l: f64) -> [f64; 2] {
        let at_end = ((self.v_ceiling - self.v_f) / self.v_f).ln_1p();
        [at_end + (l - self.ends()[1]), (self.tau_ceiling - self.steady_friction(l)) / self.law.a]
    }

    fn cap(&self, l: f64) -> f64 {
        let [v, tau] = self.caps(l);
        v.min(tau)
    }

    /// The lower ceiling at `ln theta = l`.
    fn lower(&self, l: f64) -> ArcKind {
        let [v, tau] = self.caps(l);
        if v <= tau { ArcKind::VCeiling } else { ArcKind::TauCeiling }
    }

    /// Whether the ceilings allow steady sliding at the end, and nothing above its theta; and which of them.
    pub fn sits(&self) -> Option<ArcKind> {
        let end = self.ends()[1];
        (self.to() >= self.from && self.cap(end) == 0.0).then(|| self.lower(end))
    }

    /// Time on the ceilings from one end to the other.
    fn time_on_ceilings(&self) -> Option<f64> {
        let [start, end] = self.ends();
        let slope = |y: &[f64; 2]| [1.0, -y[0].exp() / self.t_f / self.cap(y[0]).exp_m1()];
        // Both ceilings are linear in ln theta, so they cross once at most.
        let [before, after] = [start, end].map(|l| self.caps(l)).map(|[v, tau]| v - tau);
        let crossing = (before * after < 0.0).then(|| start + (end - start) * before / (before - after));
        let middle = crossing.unwrap_or(end);
        let time = integrate(slope, [start, 0.0], (start, middle))?[1];
        Some(self.t_f * integrate(slope, [middle, time], (middle, end))?[1])
    }

    /// The least and the greatest feasible time, or the ceilings that allow none; `None` where rounding decides.
    pub fn limits(&self) -> Option<Result<(f64, f64), Vec<ArcKind>>> {
        let (ends, (from, to)) = (self.ends(), (self.from, self.to()));
        let rooms = ends.map(|l| (self.tau_ceiling - self.steady_friction(l)).abs());
        if rooms.iter().any(|room| *room > 0.0 && *room < STEADY_NOISE) {
            return None;
        }
        let [at_start, at_end] = ends.map(|l| self.cap(l));
        if to <= from {
            let (cap, l) = if at_end <= at_start { (at_end, ends[1]) } else { (at_start, ends[0]) };
            if cap < 0.0 || (cap == 0.0 && to < from) {
                let both = [ArcKind::VCeiling, ArcKind::TauCeiling].into_iter().zip(self.caps(l));
                return Some(Err(both.filter(|(_, own)| *own == cap).map(|(kind, _)| kind).collect()));
            }
            return Some(Ok((if to < from { self.time_on_ceilings()? } else { 0.0 }, f64::INFINITY)));
        }
        let least = if self.floor {
            let room = self.tau_ceiling - (1.0 + self.law.b * ends[1]);
            match () {
                () if self.v_ceiling < 1.0 => return Some(Err(vec![ArcKind::VCeiling])),
                () if room.abs() < STEADY_NOISE => return None,
                () if room < 0.0 => return Some(Err(vec![ArcKind::TauCeiling])),
                () => ((to - from) / (1.0 - to)).ln_1p(),
            }
        } else {
            to - from
        };
        // Above theta_1 theta can wait or turn; below it only where the ceilings allow steady sliding.
        let place = |index: u32| ends[0] + (ends[1] - ends[0]) * f64::from(index) / f64::from(SCAN_POINTS);
        let waits = at_end >= 0.0 || (0..=SCAN_POINTS).any(|index| self.cap(place(index)) > 0.0);
        Some(Ok((least, if waits { f64::INFINITY } else { self.time_on_ceilings()? })))
    }

    /// Whether there is a protocol; `None` where rounding decides.
    pub fn is_feasible(&self) -> Option<bool> {
        let [start, end] = self.ends();
        // Rounding of both ends, relative to their distance.
        let noise = if start == end { 0.0 } else { 4.0 * f64::EPSILON * (1.0 + end.abs()) / (end - start).abs() };
        let clear = |room: f64| (room.abs() > (BORDER_RTOL + noise) * self.t_f).then_some(room > 0.0);
        match self.limits()? {
            Err(_) => Some(false),
            Ok((least, most)) => Some(clear(self.t_f - least)? && clear(most - self.t_f)?),
        }
    }

    /// `e^z - 1 - z` of the free minimiser, relative to the turn if there is one.
    fn energy(&self, leg: &MonotoneArc, l: f64) -> f64 {
        match leg.turn {
            Some(turn) => self.energy_beyond(turn, l - turn),
            None => (self.steady_friction(l) + leg.c * l.exp()) / self.law.a,
        }
    }

    /// `e^z - 1 - z` of the free minimiser at `ln theta = turn + beyond`, without cancellation near the turn.
    fn energy_beyond(&self, turn: f64, beyond: f64) -> f64 {
        let Law { a, b } = self.law;
        ((b - a) * beyond - self.steady_friction(turn) * beyond.exp_m1()) / a
    }

    /// How far the free minimiser is beyond each bound: ceilings of velocity and friction, and the floor.
    fn beyond(&self, leg: &MonotoneArc, l: f64) -> [f64; 3] {
        let free = free(self.energy(leg, l), leg.falls());
        let [v, tau] = self.caps(l);
        [free - v, free - tau, if self.floor && !leg.falls() { l - free } else { f64::NEG_INFINITY }]
    }

    /// The bound that clamps the minimiser at `ln theta = l`.
    fn kind(&self, leg: &MonotoneArc, l: f64) -> ArcKind {
        let [v, tau, floor] = self.beyond(leg, l);
        match () {
            () if v.max(tau) >= 0.0 => self.lower(l),
            () if floor >= 0.0 => ArcKind::Floor,
            () => ArcKind::Free,
        }
    }

    /// `z` on an arc.
    fn z(&self, kind: ArcKind, l: f64, energy: f64, falls: bool) -> f64 {
        match kind {
            ArcKind::Free => free(energy, falls),
            ArcKind::Floor => l,
            ArcKind::VCeiling => self.caps(l)[0],
            ArcKind::TauCeiling => self.caps(l)[1],
        }
    }

    /// The arcs of a leg, by increasing theta. Arcs too short for the scan are found where the minimiser is farthest beyond a bound.
    fn pieces(&self, leg: &MonotoneArc) -> Vec<Piece> {
        let (low, high) = (leg.start.min(leg.end), leg.start.max(leg.end));
        let place = |index: u32| low + (high - low) * f64::from(index) / f64::from(SCAN_POINTS);
        let mut places: Vec<f64> = (0..=SCAN_POINTS).map(place).collect();
        let scan: Vec<[f64; 3]> = places.iter().map(|&l| self.beyond(leg, l)).collect();
        for (bound, index) in (0..3).flat_map(|bound| (1..SCAN_POINTS).map(move |index| (bound, index))) {
            let [before, here, after] = [index - 1, index, index + 1].map(|index| scan[index as usize][bound]);
            if here.is_finite() && here < 0.0 && here >= before && here >= after {
                let (top, below) = golden(&|l| -self.beyond(leg, l)[bound], place(index - 1), place(index + 1));
                places.extend((below < 0.0).then_some(top));
            }
        }
        places.sort_by(f64::total_cmp);
        let mut pieces = vec![Piece { kind: self.kind(leg, low), low, high }];
        for ends in places.windows(2) {
            let (mut from, last) = (ends[0], self.kind(leg, ends[1]));
            // Another arc may lie between those of both ends.
            for _ in 0..MAX_ARCS {
                let kind = self.kind(leg, from);
                if kind == last {
                    break;
                }
                let (mut below, mut above) = (from, ends[1]);
                for _ in 0..BISECTIONS {
                    let middle = 0.5 * (below + above);
                    if self.kind(leg, middle) == kind { below = middle } else { above = middle }
                }
                if let Some(piece) = pieces.last_mut() {
                    piece.high = above;
                }
                pieces.push(Piece { kind: self.kind(leg, above), low: above, high });
                from = above;
            }
        }
        pieces
    }

    /// `ln theta` at the turn of the protocol of `c`, above both ends.
    fn turn(&self, c: f64) -> Option<f64> {
        let g = |l: f64| self.steady_friction(l) + c * l.exp();
        let mut low = self.from.max(self.to()).ln();
        let mut high = low;
        if g(low) < 0.0 {
            return None;
        }
        let mut step = 1e-3;
        while g(high) > 0.0 {
            (low, high, step) = (high, high + step, 2.0 * step);
            if high > 50.0 {
                return None;
            }
        }
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if g(middle) > 0.0 { low = middle } else { high = middle }
        }
        Some(low)
    }

    /// The legs of the protocol of `c` that turns if `turns`.
    fn legs(&self, c: f64, turns: bool) -> Option<Vec<MonotoneArc>> {
        let [start, end] = self.ends();
        if !turns {
            return Some(vec![MonotoneArc { start, end, turn: None, c }]);
        }
        let turn = self.turn(c)?;
        let leg = |start: f64, end: f64| MonotoneArc { start, end, turn: Some(turn), c };
        Some(vec![leg(start, turn), leg(turn, end)])
    }

    /// The totals of these legs; `None` if they are no protocol.
    fn totals(&self, legs: &[MonotoneArc]) -> Option<Totals> {
        let (first, last) = (legs.first()?, legs.last()?);
        let mut all = Totals { c: first.c, ..Totals::default() };
        all.theta_max = legs.iter().map(|leg| leg.start.max(leg.end)).fold(f64::NEG_INFINITY, f64::max).exp();
        for leg in legs {
            self.add(leg, &mut all)?;
        }
        let ends = [(first, first.start), (last, last.end)].map(|(leg, l)| {
            let z = self.z(self.kind(leg, l), l, self.energy(leg, l), leg.falls());
            let (v, friction) = ((z - l).exp(), self.steady_friction(l) + self.law.a * z);
            (v, (friction * v + leg.c) / z.exp_m1())
        });
        [all.v_start, all.v_end] = ends.map(|(v, _)| v);
        all.costate = ends.map(|(_, costate)| costate);
        Some(all)
    }

    /// Adds the integrals of a leg.
    fn add(&self, leg: &MonotoneArc, all: &mut Totals) -> Option<()> {
        for piece in self.pieces(leg) {
            let Piece { kind, low, high } = piece;
            let sums = match leg.turn {
                // theta = theta_h/(1 + X^2): the integrand is regular at the turn.
                Some(turn) => {
                    let [near, far] = [high, low].map(|l| (turn - l).exp_m1().max(0.0).sqrt());
                    let slope = |y: &[f64; SUMS]| {
                        let x = y[0].max(1e-9 * far);
                        let beyond = -(x * x).ln_1p();
                        let rates = self.rates(leg, kind, turn + beyond, self.energy_beyond(turn, beyond));
                        let mut slope = rates.map(|rate| rate * 2.0 * x / (1.0 + x * x));
                        slope[0] = 1.0;
                        slope
                    };
                    let mut from = [0.0; SUMS];
                    from[0] = near;
                    integrate(slope, from, (near, far))?
                }
                None => {
                    let mut from = [0.0; SUMS];
                    from[0] = low;
                    integrate(|y: &[f64; SUMS]| self.rates(leg, kind, y[0], self.energy(leg, y[0])), from, (low, high))?
                }
            };
            let [_, time, work, by_v, by_tau, by_a, by_b, varied] = sums;
            let time = self.t_f * time;
            all.time += time;
            all.work += work;
            match kind {
                ArcKind::Free => {}
                ArcKind::Floor => all.time_at_floor += time,
                ArcKind::VCeiling => all.time_at_v_ceiling += time,
                ArcKind::TauCeiling => all.time_at_tau_ceiling += time,
            }
            all.pressure = [all.pressure[0] + by_v / self.v_ceiling, all.pressure[1] + by_tau];
            all.by_law = [all.by_law[0] + by_a, all.by_law[1] + by_b];
            all.varied += varied;
        }
        Some(())
    }

    /// The derivatives of the sums on an arc with respect to `ln theta`, counted as positive.
    fn rates(&self, leg: &MonotoneArc, kind: ArcKind, l: f64, energy: f64) -> [f64; SUMS] {
        let z = self.z(kind, l, energy, leg.falls());
        let (v, slope) = ((z - l).exp(), z.exp_m1());
        let dt = l.exp() / slope.abs();
        // Times and prices are scaled, since the tolerance of the integrator is absolute.
        let scale = 1.0 / self.t_f;
        let friction = self.steady_friction(l) + self.law.a * z;
        let pressure = (energy - (slope - z)) / slope;
        let (nu, lambda) = match kind {
            ArcKind::VCeiling => (self.law.a * pressure * self.v_ceiling, 0.0),
            ArcKind::TauCeiling => (0.0, v * pressure),
            _ => (0.0, 0.0),
        };
        let varied = if kind == ArcKind::Free { (z * (1.0 - VARIATION_FRACTION)).min(self.cap(l)) } else { z };
        let (v_varied, dt_varied) = ((varied - l).exp(), l.exp() / varied.exp_m1().abs());
        let cost = (self.steady_friction(l) + self.law.a * varied) * v_varied + leg.c;
        [
            1.0,
            scale * dt,
            friction * v * dt,
            nu * dt,
            lambda * dt,
            (v + lambda) * v.ln() * dt,
            (v + lambda) * l * dt,
            cost * dt_varied,
        ]
    }

    /// Least and greatest friction between the ends.
    pub fn friction(&self, solution: &Solution) -> [f64; 2] {
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for leg in &solution.legs {
            for Piece { kind, low, high } in self.pieces(leg) {
                let friction = |l: f64| match kind {
                    ArcKind::TauCeiling => self.tau_ceiling,
                    _ => self.steady_friction(l) + self.law.a * self.z(kind, l, self.energy(leg, l), leg.falls()),
                };
                let least = lowest(&friction, (low, high), SCAN_POINTS);
                let greatest = -lowest(&|l| -friction(l), (low, high), SCAN_POINTS);
                range = [range[0].min(least), range[1].max(greatest)];
            }
        }
        range
    }

    /// The protocol that turns if `turns`, near `c`.
    pub fn solve(&self, c: f64, turns: bool) -> Option<Solution> {
        let totals = |c: f64| self.totals(&self.legs(c, turns)?);
        // With a turn the time rises with `c`, without one it falls.
        let sign = if turns { 1.0 } else { -1.0 };
        let residual = |c: f64| Some(sign * (totals(c)?.time / self.t_f - 1.0));
        let slope = |c: f64, value: f64| {
            let step = 1e-6 * c.abs().max(1.0);
            Some((residual(c + step)? - value) / step)
        };
        let probe = |c: f64| {
            let value = residual(c)?;
            Some(Probe { value, slope: slope(c, value).unwrap_or(0.0) })
        };
        let root = newton(probe, c, (f64::NEG_INFINITY, f64::INFINITY), false, 0.1 * TIME_NOISE)?;
        let here = totals(root.x)?;
        if (here.time / self.t_f - 1.0).abs() > BORDER_RTOL {
            return None;
        }
        let vague = (TIME_NOISE / root.probe.slope).abs().max(C_NOISE * here.c.abs());
        let near = totals(here.c + vague).or_else(|| totals(here.c - vague))?;
        let legs = self.legs(here.c, turns)?;
        let arc = self.kind(legs.first()?, legs.first()?.start);
        Some(Solution { totals: here, near, legs, arc })
    }

    /// The protocol that slides steadily at `v_f` from before `t_f` on; `None` if it arrives later than that.
    pub fn sitting(&self) -> Option<Solution> {
        let kind = self.sits()?;
        let [start, end] = self.ends();
        let friction = self.steady_friction(end);
        // It would turn at the end.
        let leg = MonotoneArc { start, end, turn: Some(end), c: -friction * self.v_f };
        let mut totals = if start == end {
            Totals { v_start: self.v_f, theta_max: self.from, c: leg.c, ..Totals::default() }
        } else {
            self.totals(&[leg])?
        };
        let rest = self.t_f - totals.time;
        if rest < 0.0 {
            return None;
        }
        (totals.time, totals.work, totals.v_end) = (self.t_f, totals.work + rest * friction * self.v_f, self.v_f);
        match kind {
            ArcKind::VCeiling => totals.time_at_v_ceiling += rest,
            _ => totals.time_at_tau_ceiling += rest,
        }
        Some(Solution { totals, near: totals, legs: vec![leg], arc: kind })
    }
}

/// The free minimiser `z`; near a turn the first terms of its series in `w`, where `e^z - 1 - z = w^2/2`.
fn free(energy: f64, falls: bool) -> f64 {
    if energy >= SMALL_ENERGY {
        return branch(energy, falls).unwrap_or(0.0);
    }
    let root = (2.0 * energy.max(0.0)).sqrt();
    let w = if falls { root } else { -root };
    w * (1.0 - w / 6.0 * (1.0 - w / 6.0 * (1.0 - w * 2.0 / 15.0)))
}

/// Energy `w^2/2` below which the series is used. Derived: its next term, `w^5/4320`, is below 1e-20 there.
const SMALL_ENERGY: f64 = 1e-7;

/// Greatest number of arcs between two neighbouring points of a scan. Derived: both ceilings, the floor and a free arc.
const MAX_ARCS: u32 = 4;

/// Bisections of the place where an arc ends. Derived: from the distance of two points of a scan to rounding.
const BISECTIONS: u32 = 60;

/// Number of points of a leg at which its arcs are distinguished. Chosen: as many as an integrator takes.
const SCAN_POINTS: u32 = 256;

/// Relative error of a time that is ignored. Chosen: ten times the tolerance of the integrator (`route.rs`).
pub const TIME_NOISE: f64 = 1e-12;

/// Relative error of `C` that is ignored. Chosen: some roundings.
const C_NOISE: f64 = 2e-15;

/// The root of `e^z - 1 - z = h` above or below 0.
fn branch(h: f64, above: bool) -> Option<f64> {
    if h.is_nan() || h < 0.0 {
        return None;
    }
    let mut z = if above { (1.0 + h + (2.0 * h).sqrt()).ln() } else { -h - (2.0 * h).sqrt() };
    for _ in 0..100 {
        let slope = z.exp_m1();
        if slope == 0.0 {
            break;
        }
        let step = (slope - z - h) / slope;
        z -= step;
        if step.abs() <= 1e-15 * z.abs() {
            break;
        }
    }
    Some(z)
}

#[cfg(test)]
mod tests {
    //! Protocols of known `C`, with work by a 40-digit quadrature of another program.

    use super::*;

    #[test]
    fn reference_totals_of_a_known_c() {
        let paper = Law { a: 0.03, b: 0.05 };
        let way = |law, v_i: f64, v_f: f64, ceilings| Way::of(&Transition { law, v_i, v_f }, 1.0, true, ceilings);
        let none = f64::INFINITY;
        let cases = [
            (way(paper, 3.0, 100.0, [1000.0, none]), -2.55860702801, false, 0.02, 3.82172461194),
            (way(paper, 3.0, 100.0, [none, 1.05]), -2.30742868597, false, 0.02, 3.80883954761),
            (way(paper, 3.0, 100.0, [400.0, 1.04]), -2.79363404017, true, 0.08, 4.09134444436),
            (way(paper, 100.0, 3.0, [4.5, none]), -2.28801277001, true, 0.7, 1.15046557999),
            (way(paper, 100.0, 3.0, [none, 0.965]), -3.52153861668, false, 0.5, 0.695391959139),
            (way(Law { a: 0.05, b: 0.02 }, 3.0, 100.0, [none, 1.36]), 117.191032104, false, 0.0012, 4.74738331205),
        ];
        for (way, c, turns, t_f, work) in cases {
            let found = way.legs(c, turns).and_then(|legs| way.totals(&legs)).expect("the integrator gets there");
            assert!((found.time / t_f - 1.0).abs() < 1e-9, "{way:?}: {}", found.time);
            assert!((found.work / work - 1.0).abs() < 1e-9, "{way:?}: {}", found.work);
        }
    }
}
