//! `optimal`: the traced optimum obeys the equations and conserves `C`, and no bound holds it back from less work: it is the extremal.
//!
//! With the costate `beta` of `theta` the Hamiltonian `tau v - beta theta'` is `-C` all the way. Off the bounds it is stationary in `v`,
//! so `C = a v - (tau + a)/theta`, with `a tanh(tau/a)` for `a` if friction is regularised; on the floor it rises with `v`, on a ceiling it falls. What it falls by is the multiplier of the bound, whose
//! integral is a derivative of the work.

use super::motion::Followed;
use super::task::Task;
use super::{Checked, CheckedRow, relaxed};
use crate::model::{Friction, Law, StateLaw, Transition};
use crate::numerics::LONG_ROUNDING_RTOL;
use crate::protocol::optimal::{ArcKind, Bounds};
use crate::protocol::shortcut::Case;
use crate::protocol::{Moment, SpringBlock, Status};
use crate::trace::Protocol;

/// The certified optimum of a task.
pub struct Optimum {
    task: Task,
    pub motion: Followed,
    pub work: f64,
    pub start: Moment,
    pub end: Moment,
    /// The conserved `C`, and its rounding error.
    pub c: f64,
    c_noise: f64,
    /// Sum of the relative errors of the motion.
    error: f64,
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

    /// The fraction of `a` that is the derivative of friction with respect to `ln v`.
    fn part(&self, at: &Moment) -> f64 {
        match self.form {
            Friction::Log => 1.0,
            Friction::Regularised => (at.friction / self.problem.law.a).tanh(),
        }
    }

    /// `C` at a moment, and the size of its terms.
    fn conserved(&self, at: &Moment) -> (f64, f64) {
        let &Moment { v, theta, friction, beta, .. } = at;
        let part = self.part(at);
        let a = part * self.problem.law.a;
        match beta {
            // Where friction is close to -a, its terms cancel.
            _ if self.arc(at) == ArcKind::Free => {
                (a * v - (friction + a) / theta, a * v + (part + a + friction.abs()) / theta)
            }
            Some(beta) => {
                let push = friction * v;
                (beta * (1.0 - theta * v) - push, beta.abs() * (1.0 + theta * v) + push.abs())
            }
            // Without a costate theta is steady.
            None => (-friction * v, friction.abs() * v),
        }
    }

    /// What the Hamiltonian falls by with the velocity on the floor, or rises by at a ceiling, relative to its terms.
    fn wrong(&self, at: &Moment) -> f64 {
        let a = self.problem.law.a;
        let sign = match self.arc(at) {
            ArcKind::Free => return 0.0,
            ArcKind::Floor => -1.0,
            ArcKind::VCeiling | ArcKind::TauCeiling => 1.0,
        };
        let press = at.friction + a;
        at.beta.map_or(0.0, |beta| sign * (press + beta * at.theta) / press.abs().max(a))
    }

    /// The optimum.
    ///
    /// # Errors
    ///
    /// The reason why it cannot be certified.
    pub fn certify(&self) -> Result<Optimum, &'static str> {
        let Task { problem: transition, theta, t_f, bounds, form } = *self;
        let protocol = match theta {
            _ if form == Friction::Regularised => Protocol::OptimalRegularised,
            Some(theta) => Protocol::OptimalFrom { theta, bounds },
            None => Protocol::Optimal { bounds },
        };
        let case = Case { transition, t_f, tau_ceiling: bounds.tau_ceiling };
        let path = protocol.path(&case, LONG_ROUNDING_RTOL).map_err(|_| "there is no motion of the optimum")?;
        let Transition { law, v_f, .. } = transition;
        let rigid = SpringBlock { law, k: f64::INFINITY, m: 0.0 };
        let motion = Followed::new(path.motion, StateLaw::Ageing, &rigid, MAX_SPLITS);
        let slip = |kind| motion.integral(|at| if self.arc(at) == kind { at.v } else { 0.0 });
        let (growth, slips) = (law.b / law.a - 1.0, [ArcKind::VCeiling, ArcKind::TauCeiling].map(slip));
        let sits = self.sits() && (motion.end().v / v_f - 1.0).abs() <= 2.0 * f64::EPSILON;
        if growth * slips[1] > MAX_GROWTH && !sits {
            return Err("paths that slide long on the friction ceiling");
        }
        let conserved: Vec<_> = motion.samples.iter().map(|(_, at)| self.conserved(at)).collect();
        let (c, size) = conserved.iter().copied().min_by(|x, y| x.1.total_cmp(&y.1)).unwrap_or((f64::NAN, f64::NAN));
        let drift = conserved.iter().map(|(other, size)| (other - c).abs() / size).fold(0.0, f64::max);
        // Where friction is too low for a proof, a bound may hold the optimum back.
        let proven = matches!(path.status, Status::Ok | Status::BelowBound);
        let wrong = motion.samples.iter().filter(|_| proven).map(|(_, at)| self.wrong(at)).fold(0.0, f64::max);
        let (start, end) = (motion.samples[0].1, motion.end());
        let arrival =
            (start.theta / self.from() - 1.0).abs() + (end.theta * v_f - 1.0).abs() + (end.t / t_f - 1.0).abs();
        let has_slopes = !sits && (slips[0] + slips[1]) * growth.abs().max(1.0) < MAX_GROWTH;
        let error = motion.equation + motion.stretch() + arrival + drift + wrong;
        Ok(Optimum { task: *self, work: motion.work, start, end, c, c_noise: 1e-14 * size, error, has_slopes, motion })
    }

    /// The optimum of a time that rounding does not distinguish from `t_f`.
    pub fn near(&self) -> Option<Optimum> {
        let at = |t_f: f64| Task { t_f, ..*self }.certify().ok();
        at(self.t_f * (1.0 + LONG_ROUNDING_RTOL)).or_else(|| at(self.t_f * (1.0 - LONG_ROUNDING_RTOL)))
    }
}

impl CheckedRow<'_> {
    /// The optimum of a task, with its error as a difference of the column `optimum`; the reason where there is none is recorded.
    pub fn certify(&mut self, task: &Task) -> Option<Optimum> {
        let found = task.certify();
        match &found {
            Ok(optimum) => self.push("optimum", optimum.error),
            Err(reason) => self.miss(reason),
        }
        found.ok()
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
        let Law { a, b } = self.task.problem.law;
        // The multiplier of the bound of this kind.
        let multiplier = |before: &Moment, at: &Moment, kind: ArcKind| {
            let fall = -(at.friction + a + at.beta.unwrap_or(f64::NAN) * at.theta);
            if self.task.arc(before) == kind { fall } else { 0.0 }
        };
        let by_tau = |before: &Moment, at: &Moment| multiplier(before, at, ArcKind::TauCeiling) * at.v / a;
        let by_law = |before: &Moment, at: &Moment| at.v + by_tau(before, at);
        // Derivative of friction with respect to a.
        let by_a = |at: &Moment| match self.task.form {
            Friction::Log => at.v.max(f64::MIN_POSITIVE).ln(),
            Friction::Regularised => (at.friction - self.task.part(at) * (1.0 + b * at.theta.ln())) / a,
        };
        let summed = |column, f: &dyn Fn(&Moment, &Moment) -> f64| {
            (column, self.motion.integral_along(f), self.motion.rounding(|at| f(at, at)))
        };
        let [start, end] = [self.start, self.end].map(|at| at.beta.unwrap_or(f64::NAN));
        let (from, to) = (self.task.from(), 1.0 / self.task.problem.v_f);
        [
            summed("dwork_da", &|before, at| by_law(before, at) * by_a(at)),
            summed("dwork_db", &|before, at| by_law(before, at) * self.task.part(at) * at.theta.ln()),
            ("dwork_dv_i", start * from * from, 0.0),
            ("dwork_dv_f", -end * to * to, 0.0),
            summed("dwork_dv_ceiling", &|before, at| -multiplier(before, at, ArcKind::VCeiling)),
            summed("dwork_dtau_ceiling", &|before, at| -by_tau(before, at)),
        ]
    }

    /// Compares the numbers of a row of this optimum.
    fn compare(&self, row: &mut CheckedRow<'_>) {
        let rtol = row.context.rtol;
        let near = self.task.near();
        let near = near.as_ref().unwrap_or(self);
        let has_ceilings = self.task.bounds.has_ceilings();
        let t_f = self.task.t_f;
        for ((column, expected), (_, other)) in self.numbers().into_iter().zip(near.numbers()) {
            let is_time = column.starts_with("time");
            let size = if is_time && !has_ceilings && expected == 0.0 { t_f } else { expected.abs() };
            let own = if column == "hamiltonian" { self.c_noise } else { 0.0 };
            let rounding = (other - expected).abs() + if is_time { LONG_ROUNDING_RTOL * t_f } else { 0.0 };
            let noise = own + if has_ceilings { rounding } else { 0.0 };
            row.compare_relative(column, expected, size + noise / rtol);
        }
        row.compare("friction_max", self.motion.greatest(|at| at.friction));
        row.compare_friction(self.motion.least(|at| at.friction));
        if let (Some(work), Some(error)) = (row.number("work"), row.number("work_error")) {
            let noise = self.motion.rounding(|at| at.friction * at.v)
                + (near.work - self.work).abs()
                + 0.1 * rtol * self.work.abs();
            row.judge("work_error", (work - self.work).abs() <= error + noise, "a bound");
        }
        if !row.has_column("dwork") {
            return;
        }
        if !self.has_slopes {
            return row.miss("derivatives of rows that slide long on a ceiling");
        }
        for ((column, slope, noise), (_, other, _)) in self.slopes().into_iter().zip(near.slopes()) {
            let size = if slope == 0.0 { 1.0 } else { slope.abs() };
            row.compare_relative(column, slope, size + (noise + (other - slope).abs()) / rtol);
        }
    }

    /// The kind of the arc at the start.
    pub fn arc(&self) -> ArcKind {
        self.task.arc(&self.start)
    }
}

pub fn check(row: &mut CheckedRow<'_>) -> Checked {
    let (task, state) = (Task::of(row), row.point.state_law());
    if state != StateLaw::Ageing {
        relaxed::certify(row, &task.problem, state, task.t_f);
        return Ok(());
    }
    let has_numbers = row.compare_feasible(task.is_feasible());
    task.compare_limits(row);
    if has_numbers && let Some(optimum) = row.certify(&task) {
        optimum.compare(row);
    }
    Ok(())
}
