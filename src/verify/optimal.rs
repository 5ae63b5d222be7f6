//! `optimal`: the traced optimum obeys the equations and conserves `C`, and no bound holds it back from less work: it is the extremal.
//!
//! With the costate `beta` of `theta` the Hamiltonian `tau v - beta theta'` is `-C` all the way. Off the bounds it is stationary in `v`,
//! so `C = a v - (tau + a)/theta`; on the floor it rises with `v`, on a ceiling it falls. What it falls by is the multiplier of the bound, whose
//! integral is a derivative of the work.

use super::motion::Followed;
use super::task::Task;
use super::verdict::{Checked, axis, state_law};
use super::{Context, Verdict, arcsinh, number, relaxed, transition};
use crate::dataset::Row;
use crate::model::{Friction, Law, StateLaw, Transition};
use crate::protocol::optimal::{ArcKind, Bounds};
use crate::protocol::{Moment, SpringBlock, Status};

/// The certified optimum of a task.
pub struct Optimum {
    task: Task,
    pub motion: Followed,
    pub work: f64,
    pub start: Moment,
    pub end: Moment,
    /// The conserved `C`, and its rounding error.
    pub c: f64,
    pub c_noise: f64,
    /// Whether rounding leaves digits of the multipliers on the ceilings.
    has_slopes: bool,
}

/// Distance from a ceiling, relative to 1 plus the ceiling, below which a moment is on it. Chosen: some roundings.
const CEILING_RTOL: f64 = 1e-14;

/// Times that an interval of a motion may be halved. Chosen: a 64th of an interval resolves the layers at the ends of arcs.
const MAX_SPLITS: u32 = 6;

/// Logarithm of the growth of an error on the ceilings, beyond which `C` does not determine the rest of the path. Derived: `e^12` roundings are 2e-11, a
/// fraction of the default `rtol`.
const MAX_GROWTH: f64 = 12.0;

/// Relative error of a duration that is ignored under ceilings. Chosen: that of the motions.
const TIME_NOISE: f64 = 1e-12;

/// Time on a bound, relative to `t_f`, below which rounding decides whether the protocol is ever on it. Chosen: ten times [`TIME_NOISE`].
const MIN_TIME_RTOL: f64 = 1e-11;

impl Task {
    /// The bound on which a moment is.
    fn arc(&self, &Moment { v, friction, .. }: &Moment) -> ArcKind {
        let Bounds { floor, v_ceiling, tau_ceiling } = self.bounds;
        let near = |value: f64, ceiling: f64| {
            ceiling.is_finite() && (value - ceiling).abs() <= CEILING_RTOL * (1.0 + ceiling.abs())
        };
        match () {
            () if floor && v == 1.0 => ArcKind::Floor,
            () if near(v, v_ceiling) => ArcKind::VCeiling,
            () if near(friction, tau_ceiling) => ArcKind::TauCeiling,
            () => ArcKind::Free,
        }
    }

    /// The optimum, if there is one, with its error as a difference of the column `optimum`.
    pub fn certify(&self, verdict: &mut Verdict) -> Option<Optimum> {
        let (solved, motion) = self.solve();
        let Some(motion) = motion else {
            verdict.miss("there is no motion of the optimum");
            return None;
        };
        let Task { problem: Transition { law, v_f, .. }, t_f, .. } = *self;
        let rigid = SpringBlock { law, k: f64::INFINITY, m: 0.0 };
        let motion = Followed::under(StateLaw::Ageing, motion, &rigid, MAX_SPLITS);
        let slip = |kind| motion.integral(|at| if self.arc(at) == kind { at.v } else { 0.0 });
        let (growth, slips) = (law.b / law.a - 1.0, [ArcKind::VCeiling, ArcKind::TauCeiling].map(slip));
        let sits = self.sits() && (motion.end().v / v_f - 1.0).abs() <= 2.0 * f64::EPSILON;
        if growth * slips[1] > MAX_GROWTH && !sits {
            verdict.miss("paths that slide long on the friction ceiling");
            return None;
        }
        let mut conserved: Vec<(f64, f64)> = Vec::new();
        let proven = matches!(solved.status, Status::Ok | Status::BelowBound);
        let mut wrong = 0.0f64;
        for (_, at) in &motion.samples {
            let &Moment { v, theta, friction, beta, .. } = at;
            let (press, arc) = (friction + law.a, self.arc(at));
            if arc == ArcKind::Free {
                // Where friction is close to -a, its terms cancel.
                conserved.push((law.a * v - press / theta, law.a * v + (1.0 + law.a + friction.abs()) / theta));
                continue;
            }
            // Without a costate theta is steady.
            let Some(beta) = beta else {
                conserved.push((-friction * v, friction.abs() * v));
                continue;
            };
            let (pull, push) = (beta * (1.0 - theta * v), friction * v);
            conserved.push((pull - push, beta.abs() * (1.0 + theta * v) + push.abs()));
            // The Hamiltonian must not fall with the velocity on the floor, nor rise with it at a ceiling, except where friction is too low for
            // a proof.
            let sign = if arc == ArcKind::Floor { -1.0 } else { 1.0 };
            wrong = wrong.max(if proven { sign * (press + beta * theta) / press.abs().max(law.a) } else { 0.0 });
        }
        let (c, size) = conserved.iter().copied().min_by(|x, y| x.1.total_cmp(&y.1)).unwrap_or((f64::NAN, f64::NAN));
        let drift = conserved.iter().map(|(other, size)| (other - c).abs() / size).fold(0.0, f64::max);
        let (start, end) = (motion.samples[0].1, motion.end());
        let arrival =
            (start.theta / self.from() - 1.0).abs() + (end.theta * v_f - 1.0).abs() + (end.t / t_f - 1.0).abs();
        let has_slopes = !sits && (slips[0] + slips[1]) * growth.abs().max(1.0) < MAX_GROWTH;
        verdict.push("optimum", motion.equation + motion.stretch() + arrival + drift + wrong);
        Some(Optimum { task: *self, work: motion.work, start, end, c, c_noise: 1e-14 * size, has_slopes, motion })
    }

    /// The optimum of a time that rounding does not distinguish from `t_f`.
    pub fn near(&self) -> Option<Optimum> {
        let at = |t_f: f64| Task { t_f, ..*self }.certify(&mut Verdict::default());
        at(self.t_f * (1.0 + TIME_NOISE)).or_else(|| at(self.t_f * (1.0 - TIME_NOISE)))
    }

    /// Compares the work of the optimum and, where the row has one, the gap of the protocol `work` above it.
    pub fn compare_gap(&self, verdict: &mut Verdict, row: &Row, work: Option<f64>) {
        let optimum = self.certify(verdict);
        compare_gap(verdict, row, optimum.map(|optimum| optimum.work), work);
    }
}

/// Compares the least work, if it is known, and the gap of the protocol `work` above it.
pub fn compare_gap(verdict: &mut Verdict, row: &Row, least: Option<f64>, work: Option<f64>) {
    let Some(least) = least else { return };
    verdict.compare(row, "work_optimal", Some(least), None);
    if let Some(work) = work {
        // The promised error of the gap is relative to the greater of 1 and the gap.
        let gap = (work - least) / least;
        verdict.compare(row, "gap", Some(gap), Some(gap.abs().max(1.0)));
    }
}

impl Optimum {
    /// The numbers of the protocol.
    fn numbers(&self) -> [(&'static str, f64); 8] {
        let on = |kind: ArcKind| self.motion.time_on(|at| self.task.arc(at) == kind);
        [
            ("work", self.work),
            ("v_start", self.start.v),
            ("v_end", self.end.v),
            ("time_at_floor", on(ArcKind::Floor)),
            ("time_at_v_ceiling", on(ArcKind::VCeiling)),
            ("time_at_tau_ceiling", on(ArcKind::TauCeiling)),
            ("hamiltonian", -self.c),
            ("theta_max", self.motion.greatest(|at| at.theta)),
        ]
    }

    /// Derivatives of the work, and their rounding errors.
    fn slopes(&self) -> [(&'static str, f64, f64); 6] {
        let Law { a, .. } = self.task.problem.law;
        // The multiplier of the bound of this kind.
        let multiplier = |before: &Moment, at: &Moment, kind: ArcKind| {
            let fall = -(at.friction + a + at.beta.unwrap_or(f64::NAN) * at.theta);
            if self.task.arc(before) == kind { fall } else { 0.0 }
        };
        let by_tau = |before: &Moment, at: &Moment| multiplier(before, at, ArcKind::TauCeiling) * at.v / a;
        let by_law = |before: &Moment, at: &Moment| at.v + by_tau(before, at);
        let summed = |column, f: &dyn Fn(&Moment, &Moment) -> f64| {
            (column, self.motion.integral_along(f), self.motion.rounding(|at| f(at, at)))
        };
        let [start, end] = [self.start, self.end].map(|at| at.beta.unwrap_or(f64::NAN));
        let (from, to) = (self.task.from(), 1.0 / self.task.problem.v_f);
        [
            summed("dwork_da", &|before, at| by_law(before, at) * at.v.max(f64::MIN_POSITIVE).ln()),
            summed("dwork_db", &|before, at| by_law(before, at) * at.theta.ln()),
            ("dwork_dv_i", start * from * from, 0.0),
            ("dwork_dv_f", -end * to * to, 0.0),
            summed("dwork_dv_ceiling", &|before, at| -multiplier(before, at, ArcKind::VCeiling)),
            summed("dwork_dtau_ceiling", &|before, at| -by_tau(before, at)),
        ]
    }

    /// Compares the numbers of a row of this optimum.
    fn compare(&self, verdict: &mut Verdict, row: &Row, rtol: f64) {
        let near = self.task.near();
        let near = near.as_ref().unwrap_or(self);
        let has_ceilings = self.task.bounds.has_ceilings();
        let (t_f, found) = (self.task.t_f, self.numbers());
        for ((column, expected), (_, other)) in found.into_iter().zip(near.numbers()) {
            let is_time = column.starts_with("time");
            let size = if is_time && !has_ceilings && expected == 0.0 { t_f } else { expected.abs() };
            let own = if column == "hamiltonian" { self.c_noise } else { 0.0 };
            let rounding = (other - expected).abs() + if is_time { TIME_NOISE * t_f } else { 0.0 };
            let noise = own + if has_ceilings { rounding } else { 0.0 };
            verdict.compare(row, column, Some(expected), Some(size + noise / rtol));
        }
        let times = [3, 4, 5].map(|place| found[place].1);
        if !has_ceilings || times.iter().all(|&time| time == 0.0 || time > MIN_TIME_RTOL * t_f) {
            let binding = match times.map(|time| time > 0.0) {
                [_, true, true] => "both",
                [_, true, false] => "v_ceiling",
                [_, false, true] => "tau_ceiling",
                _ => "none",
            };
            verdict.compare_word(row, "binding", binding);
            let strategy = match self.start.v {
                _ if times[0] > 0.0 => "floor",
                v if v / self.task.problem.v_i - 1.0 > 2.0 * f64::EPSILON => "speed_up",
                _ => "slow_down",
            };
            verdict.compare_word(row, "strategy", strategy);
        }
        verdict.compare(row, "friction_max", Some(self.motion.greatest(|at| at.friction)), None);
        verdict.friction(row, self.motion.least(|at| at.friction));
        if let (Some(work), Some(error)) = (number(row, "work"), number(row, "work_error")) {
            let noise = self.motion.rounding(|at| at.friction * at.v)
                + (near.work - self.work).abs()
                + 0.1 * rtol * self.work.abs();
            verdict.judge("work_error", (work - self.work).abs() <= error + noise, "a bound");
        }
        if !row.iter().any(|(column, _)| column.starts_with("dwork")) {
            return;
        }
        if !self.has_slopes {
            return verdict.miss("derivatives of rows that slide long on a ceiling");
        }
        for ((column, slope, noise), (_, other, _)) in self.slopes().into_iter().zip(near.slopes()) {
            let size = if slope == 0.0 { 1.0 } else { slope.abs() };
            verdict.compare(row, column, Some(slope), Some(size + (noise + (other - slope).abs()) / rtol));
        }
    }

    /// The kind of the arc at the start.
    pub fn arc(&self) -> ArcKind {
        self.task.arc(&self.start)
    }
}

pub fn check(row: &Row, context: &Context, rtol: f64) -> Checked {
    let (problem, t_f) = (transition(row)?, axis(row, "t_f")?);
    if context.friction == Friction::Regularised {
        return arcsinh::check(row, &problem, t_f, rtol);
    }
    let law = state_law(row)?;
    if law != StateLaw::Ageing {
        return relaxed::check(row, &problem, law);
    }
    let [v_ceiling, tau_ceiling] = ["v_ceiling", "tau_ceiling"].map(|name| number(row, name).unwrap_or(f64::INFINITY));
    let bounds = Bounds { floor: context.bounded, v_ceiling, tau_ceiling };
    let task = Task::new(&problem, t_f, bounds);
    let mut verdict = Verdict::default();
    let is_infeasible = task.compare_status(&mut verdict, row);
    task.compare_limits(&mut verdict, row, rtol);
    if !is_infeasible && let Some(optimum) = task.certify(&mut verdict) {
        optimum.compare(&mut verdict, row, rtol);
    }
    Ok(verdict)
}
