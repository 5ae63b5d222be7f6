//! An optimal transition under bounds: which durations and ceilings are feasible.

use super::CheckedRow;
use super::route::{UNCLEAR_RTOL, integrate};
use crate::grid::Quantity;
use crate::model::{Friction, Transition, friction_margin};
use crate::protocol::optimal::Bounds;
use crate::table::transition;

/// A transition to steady sliding in a given time, under bounds.
#[derive(Debug, Clone, Copy)]
pub struct Task {
    pub problem: Transition,
    /// State variable at the start, if it is not that of steady sliding at `v_i`.
    pub theta: Option<f64>,
    pub t_f: f64,
    pub bounds: Bounds,
    pub form: Friction,
}

/// Distance of a friction ceiling from steady sliding, in `mu_0 sigma`, below which rounding decides. Chosen: a hundred roundings.
const STEADY_NOISE: f64 = 2e-14;

impl Task {
    /// The transition between steady sliding with logarithmic friction.
    pub fn new(problem: &Transition, t_f: f64, bounds: impl Into<Bounds>) -> Task {
        Task { problem: *problem, theta: None, t_f, bounds: bounds.into(), form: Friction::Log }
    }

    /// That of a row.
    pub fn of(row: &CheckedRow<'_>) -> Task {
        let task = Task::new(&transition(&row.point), row.point[Quantity::Time], row.bounds());
        Task { form: row.context.friction, ..task }
    }

    /// State variable at the start.
    pub fn from(&self) -> f64 {
        self.theta.unwrap_or(1.0 / self.problem.v_i)
    }

    /// State variable at the end.
    fn to(&self) -> f64 {
        1.0 / self.problem.v_f
    }

    /// The velocity of steady sliding at the start and at the end.
    fn steady(&self) -> [f64; 2] {
        [self.theta.map_or(self.problem.v_i, |theta| 1.0 / theta), self.problem.v_f]
    }

    /// `ln` of theta at the end over that at the start.
    fn way(&self) -> f64 {
        let [before, after] = self.steady();
        ln_ratio(before, after)
    }

    /// `ln(theta v)` on the ceilings of velocity and friction, as a function of the part of the way of `ln theta`.
    fn caps(&self) -> impl Fn(f64) -> [f64; 2] {
        let (law, way, Bounds { v_ceiling, tau_ceiling, .. }) = (self.problem.law, self.way(), self.bounds);
        let ends = self.steady().map(|v| [ln_ratio(v_ceiling, v), friction_margin(law, tau_ceiling, v) / law.a]);
        move |part| {
            let ([v, tau], y) = if part > 0.5 { (ends[1], (part - 1.0) * way) } else { (ends[0], part * way) };
            [v + y, tau + (law.a - law.b) / law.a * y]
        }
    }

    /// The lower one.
    fn cap(&self) -> impl Fn(f64) -> f64 {
        let caps = self.caps();
        move |part| {
            let [v, tau] = caps(part);
            v.min(tau)
        }
    }

    /// Whether the ceilings allow steady sliding at the end, and nothing above its theta.
    pub fn sits(&self) -> bool {
        self.to() >= self.from() && self.cap()(1.0) == 0.0
    }

    /// The part of the way between the ends at which the ceilings cross: both are linear in it.
    fn crossing(&self) -> Option<f64> {
        let [before, after] = [0.0, 1.0].map(self.caps()).map(|[v, tau]| v - tau);
        (before * after < 0.0).then(|| before / (before - after))
    }

    /// Time on the ceilings from one end to the other.
    pub fn time_on_ceilings(&self) -> Option<f64> {
        let (way, cap) = (self.way(), self.cap());
        let rate = |part: f64| -way * self.from() * (part * way).exp() / cap(part).exp_m1();
        // The rate has a kink where the ceilings cross, and rounding makes it jump where the nearer end changes.
        let across = self.crossing().unwrap_or(1.0);
        let edges = [0.0, across.min(0.5), across.max(0.5), 1.0];
        let time = |unit: f64| {
            let slope = |y: &[f64; 2]| [1.0, rate(y[0]) / unit];
            let part = |time, ends: &[f64]| Some(integrate(slope, [ends[0], time], (ends[0], ends[1]))?[1]);
            Some(unit * edges.windows(2).try_fold(0.0, part)?)
        };
        // In units of its largest slope the time may be so small that the absolute tolerance of the integrator leaves too few digits: its own unit is
        // better.
        let steepest = rate(0.0).abs().max(rate(1.0).abs());
        if steepest == 0.0 {
            // Without ceilings.
            return Some(0.0);
        }
        time(time(steepest)?)
    }

    /// The least and the greatest feasible time, if the ceilings allow any; `None` where rounding decides.
    fn limits(&self) -> Option<Option<(f64, f64)>> {
        let (from, to) = (self.from(), self.to());
        let Bounds { floor, v_ceiling, tau_ceiling } = self.bounds;
        let rooms = self.steady().map(|v| friction_margin(self.problem.law, tau_ceiling, v).abs());
        if rooms.iter().any(|room| *room > 0.0 && *room < STEADY_NOISE) {
            return None;
        }
        let [at_start, at_end] = [0.0, 1.0].map(self.cap());
        if to <= from {
            let cap = at_end.min(at_start);
            if cap < 0.0 || (cap == 0.0 && to < from) {
                return Some(None);
            }
            return Some(Some((if to < from { self.time_on_ceilings()? } else { 0.0 }, f64::INFINITY)));
        }
        let least = if floor {
            let room = tau_ceiling - (1.0 + self.problem.law.b * to.ln());
            match () {
                () if v_ceiling < 1.0 => return Some(None),
                () if room.abs() < STEADY_NOISE => return None,
                () if room < 0.0 => return Some(None),
                () => ((to - from) / (1.0 - to)).ln_1p(),
            }
        } else {
            to - from
        };
        // Above theta_1 theta can wait or turn; below it only where the ceilings allow steady sliding.
        let allows = |part: f64| self.cap()(part) > 0.0;
        let waits = at_end >= 0.0 || allows(0.0) || self.crossing().is_some_and(allows);
        Some(Some((least, if waits { f64::INFINITY } else { self.time_on_ceilings()? })))
    }

    /// Whether there is a protocol; `None` where rounding decides.
    pub fn is_feasible(&self) -> Option<bool> {
        if self.theta.is_none() && !self.bounds.has_ceilings() {
            let least = min_duration(&self.problem, self.bounds.floor);
            return Some(if self.bounds.floor { self.t_f >= least } else { self.t_f > least });
        }
        let clear = |room: f64| (room.abs() > UNCLEAR_RTOL * self.t_f).then_some(room > 0.0);
        match self.limits()? {
            None => Some(false),
            Some((least, most)) => Some(clear(self.t_f - least)? && clear(most - self.t_f)?),
        }
    }

    /// Compares the least feasible numbers.
    pub fn compare_limits(&self, row: &mut CheckedRow<'_>) {
        if let Some(limits) = self.limits() {
            let least = limits.map(|(least, _)| least);
            let scale = least.filter(|least| *least != 0.0).unwrap_or(self.t_f);
            row.compare_relative("t_least", least, scale.abs());
        }
        if self.form == Friction::Regularised {
            return;
        }
        let by_v = |v_ceiling: f64| Task { bounds: Bounds { v_ceiling, ..self.bounds }, ..*self }.is_feasible();
        let by_tau = |tau_ceiling: f64| Task { bounds: Bounds { tau_ceiling, ..self.bounds }, ..*self }.is_feasible();
        type Under<'a> = &'a dyn Fn(f64) -> Option<bool>;
        // Friction is a sum of terms of size 1.
        let ceilings: [(&str, f64, Under<'_>); 2] =
            [("v_ceiling_least", 0.0, &by_v), ("tau_ceiling_least", 1.0, &by_tau)];
        let margin = 10.0 * row.context.rtol;
        for (column, terms, under) in ceilings {
            let Some(least) = row.number(column) else { continue };
            // Ten `rtol` above a least ceiling a protocol exists, ten below none does.
            let [below, above] = [-margin, margin].map(|part| under(least + part * (terms + least.abs())));
            row.judge(column, below != Some(true) && above != Some(false), "least feasible");
        }
    }
}

/// `ln(x/y)`.
fn ln_ratio(x: f64, y: f64) -> f64 {
    let above = (x - y) / y;
    if above.abs() < 0.5 { above.ln_1p() } else { (x / y).ln() }
}

/// Shortest duration: the time at `v = 1` with a floor, else at rest, from `1/v_i` to `1/v_f`; 0 for an acceleration.
pub fn min_duration(&Transition { v_i, v_f, .. }: &Transition, floor: bool) -> f64 {
    let rise = (v_i - v_f).max(0.0) / v_i;
    if floor { (rise / (v_f - 1.0)).ln_1p() } else { rise / v_f }
}
