//! A member of the family for one `alpha_3`, and its integration in the direction in which theta contracts.
//!
//! The variable is `w = ln(theta/theta_0)` with `theta_0 = 1/v_0` at the nearer end:
//!
//! ```text
//! w' = v_0 (e^-w - v/v_0),    ln(v/v_0) = f - (b/a) w,    f = (tau - tau_0)/a.
//! ```
//!
//! Positions are distances `d` from the nearer end, in units of `t_f`. They resolve layers much thinner than the rounding
//! of `x`, and small changes keep their digits.

use super::panel::{FrictionPanel, collocate};
use crate::model::Transition;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::radau::{NODES, Radau, radau, root_of_order};
use crate::numerics::{MAX_PANELS, NEGLIGIBLE_LN};
use crate::protocol::SolverStats;
use crate::protocol::shortcut::Case;

/// End of the path from which a distance is measured, in the direction of integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PathEnd {
    Start,
    End,
}

/// Quantities at an end.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndState {
    /// Velocity `v_0`, which is `1/theta_0`.
    pub v: f64,
    /// Friction.
    friction: f64,
    /// Margin `tau_M - tau`.
    pub margin: f64,
    /// Slope of `ln R^x` inwards.
    l: f64,
    /// `w` for theta at the other end.
    other: f64,
    /// Exponent above which the slip is negligible.
    negligible_exponent: f64,
    /// Exponent above which the velocity is 0 in double precision.
    underflow_exponent: f64,
}

/// Residual of a path at its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Residual {
    /// `ln theta` at the end.
    LnTheta,
    /// Near the time of `v = 0`: the slip in contact lifetimes, `int theta v dt`, compared with the spare time.
    Slip,
    /// Near the time of `tau = tau_M`: the time lost to lower friction, compared with the spare time.
    TimeLoss,
    /// The slip in contact lifetimes from both ends to a point in a standstill, compared with the spare time.
    TwoSidedSlip,
}

/// A member of the family for one `alpha_3`.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionPath {
    pub alpha: f64,
    pub forward: bool,
    pub t_f: f64,
    pub a: f64,
    /// Ratio `b/a`.
    pub ratio: f64,
    /// `1 - b/a`.
    pub kappa: f64,
    /// Size of `w`: the smaller of 1 and its change from end to end.
    pub size: f64,
    pub residual: Residual,
    /// Spare time with which the residual is compared; infinite for [`Residual::LnTheta`].
    pub spare: f64,
    /// The ends in the direction of integration.
    end_states: [EndState; 2],
}

/// Result of a pass at its end.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PassResult {
    /// `w`: 0 if it arrives.
    pub w: f64,
    /// Derivative of `w` with respect to `alpha_3`.
    pub w_by_alpha: f64,
    /// Greatest derivative of `ln v` with respect to `alpha_3` on the path.
    max_ln_v_by_alpha: f64,
    /// Rounding error of `w`, in units of the last position of 1.
    pub noise: f64,
    /// Error of `w` for an error of 1 in every panel.
    pub errors: f64,
    /// Integral of the residual; 0 for [`Residual::LnTheta`].
    sum: f64,
    /// Absolute work, roughly.
    pub work: f64,
}

/// Tolerance of the work of a pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct WorkTolerance {
    /// Relative error of the quadrature, at most.
    pub accuracy: f64,
    /// Expected work; 0 where it is unknown.
    pub expected: f64,
}

/// Why a pass did not reach the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PassFailure {
    /// Theta fell to 0 forwards: `alpha_3` is too small.
    AlphaTooSmall,
    /// Theta fell to 0 backwards: `alpha_3` is too large.
    AlphaTooLarge,
    /// A defect of the program.
    NotConverged,
}

/// Fall of `w` below both ends at which theta counts as 0. Chosen: `e^-25` is 1.4e-11, a seventh of the default `rtol`.
const MAX_LN_THETA_FALL: f64 = 25.0;

/// `-ln v` above which slip is negligible within any time. Chosen: `e^-100` is 3.7e-44, and a legal duration is at most 1e20.
const NEGLIGIBLE_LN_V: f64 = 100.0;

/// `-ln v` above which the velocity is 0 in double precision. Derived: `e^-746` underflows.
const UNDERFLOW_LN_V: f64 = 800.0;

/// Exponent of `tau_M - tau`, at most: it stays within the range of a double. Chosen: `e^400` is 5e173.
pub(super) const MAX_EXPONENT: f64 = 400.0;

impl FrictionPath {
    pub fn new(case: &Case, margins: (f64, f64), ln_r: f64, log_ratio: f64) -> FrictionPath {
        let Transition { law, v_i, v_f } = case.transition;
        let ratio = law.b / law.a;
        let end_state = |v: f64, margin: f64, l: f64, other: f64| {
            // Exponent of a velocity of e^-power.
            let depth =
                |power: f64| ln_1p((power + ln(v) + ratio * (MAX_LN_THETA_FALL + log_ratio.abs())) * law.a / margin);
            let friction = 1.0 + (law.a - law.b) * ln(v);
            EndState {
                v,
                friction,
                margin,
                l,
                other,
                negligible_exponent: depth(NEGLIGIBLE_LN_V),
                underflow_exponent: depth(UNDERFLOW_LN_V),
            }
        };
        let forward = law.b <= law.a;
        let ends = [end_state(v_i, margins.0, ln_r, log_ratio), end_state(v_f, margins.1, -ln_r, -log_ratio)];
        let end_states = if forward { ends } else { [ends[1], ends[0]] };
        let (kappa, size) = ((law.a - law.b) / law.a, log_ratio.abs().min(1.0));
        let (residual, spare) = (Residual::LnTheta, f64::INFINITY);
        FrictionPath { alpha: 0.0, forward, t_f: case.t_f, a: law.a, ratio, kappa, size, residual, spare, end_states }
    }

    /// Scale of `alpha_3`: a change by it changes `ln v` by about a quarter.
    pub fn alpha_scale(&self) -> f64 {
        self.a / self.end_states[0].margin.max(self.end_states[1].margin)
    }

    /// Smaller of `alpha_3` and its change that changes some velocity by a factor of e.
    pub fn alpha_resolution(&self, end: &PassResult) -> f64 {
        1.0 / end.max_ln_v_by_alpha.max(1.0 / self.alpha.abs())
    }

    /// Sensitivity of friction to `alpha_3`, `-dtau/dalpha_3`, in units of `a`.
    #[inline(always)]
    pub fn friction_sensitivity(&self, end_state: &EndState, d: f64) -> f64 {
        end_state.margin / self.a * d * (1.0 - d) * exp(self.exponent(end_state, d).min(MAX_EXPONENT))
    }

    /// The path with another `alpha_3`.
    pub fn with(self, alpha: f64) -> FrictionPath {
        FrictionPath { alpha, ..self }
    }

    /// The path integrated in the other direction.
    pub fn reversed(self) -> FrictionPath {
        let [first, last] = self.end_states;
        FrictionPath { forward: !self.forward, end_states: [last, first], ..self }
    }

    /// The path integrated forwards or backwards.
    pub fn towards(self, forward: bool) -> FrictionPath {
        if self.forward == forward { self } else { self.reversed() }
    }

    /// The path with a residual that is compared with a spare time.
    pub fn with_residual(self, residual: Residual, spare: f64) -> FrictionPath {
        FrictionPath { residual, spare, ..self }
    }

    /// Quantities at an end.
    #[inline(always)]
    pub fn end_state(&self, side: PathEnd) -> &EndState {
        &self.end_states[side as usize]
    }

    /// Residual at the end, in a form that rises with `alpha_3`, and the Newton step of `alpha_3`.
    pub fn residual_and_step(&self, end: &PassResult) -> (f64, f64) {
        let rise = if self.forward { 1.0 } else { -1.0 };
        match self.residual {
            // Theta is the most linear: where it falls to 0, it does so on a line.
            Residual::LnTheta => {
                let bent = -exp_m1(-end.w.max(-3.0));
                (rise * bent, -bent / end.w_by_alpha)
            }
            Residual::Slip | Residual::TwoSidedSlip | Residual::TimeLoss => {
                let ln_ratio = ln(end.sum / self.spare);
                let step = ln_ratio * end.sum / (rise * self.time_per_w(end.w) * end.w_by_alpha);
                if self.residual == Residual::TimeLoss { (ln_ratio, -step) } else { (-ln_ratio, step) }
            }
        }
    }

    /// Time that corresponds to a change of `w` by 1 at the end.
    pub fn time_per_w(&self, w: f64) -> f64 {
        let theta = exp(w) / self.end_states[1].v;
        match self.residual {
            Residual::TimeLoss => theta / exp_m1(self.ln_theta_v_at_ceiling(PathEnd::End, w)),
            Residual::LnTheta | Residual::Slip => theta,
            // This derivative is in units of time already.
            Residual::TwoSidedSlip => 1.0,
        }
    }

    /// Error of `alpha_3` from rounding at the end, in units of the last position of 1, without that of `t_f`.
    pub fn rounding(&self, end: &PassResult) -> f64 {
        if self.residual == Residual::LnTheta {
            return end.noise / end.w_by_alpha.abs();
        }
        (end.sum / (self.time_per_w(end.w) * end.w_by_alpha)).abs()
    }

    /// The factor of that error by the rounding of `t_f` in the spare time.
    pub fn spare_rounding(&self, end: &PassResult) -> f64 {
        if self.residual == Residual::LnTheta { 1.0 } else { 1.0 + self.t_f / end.sum }
    }

    /// `ln[(tau_M - tau)/margin]` with the margin of this end; the sum of `alpha_3` and `ln R` is exact where they cancel.
    #[inline(always)]
    pub fn exponent(&self, end_state: &EndState, d: f64) -> f64 {
        d * ((end_state.l + self.alpha) - self.alpha * d)
    }

    /// Rounding of the exponent, in units of the last position of 1.
    #[inline(always)]
    pub fn uncertainty(&self, end_state: &EndState, d: f64) -> f64 {
        d * ((end_state.l + self.alpha).abs() + self.alpha.abs() * d)
    }

    /// Scaled friction `f = (tau - tau_0)/a`.
    #[inline(always)]
    pub fn scaled_friction(&self, end_state: &EndState, exponent: f64) -> f64 {
        let e = if exponent > end_state.underflow_exponent { end_state.underflow_exponent } else { exponent };
        -end_state.margin / self.a * exp_m1(e)
    }

    /// Margin `tau_M - tau`, within the range of a double.
    #[inline(always)]
    fn margin_at(&self, side: PathEnd, d: f64) -> f64 {
        let end_state = self.end_state(side);
        end_state.margin * exp(self.exponent(end_state, d).min(MAX_EXPONENT))
    }

    /// Friction at a distance from an end, within the range of a double.
    #[inline(always)]
    pub fn friction(&self, side: PathEnd, d: f64) -> f64 {
        let end_state = self.end_state(side);
        end_state.friction - end_state.margin * exp_m1(self.exponent(end_state, d).min(MAX_EXPONENT))
    }

    /// `z = ln(theta v)` at a distance from an end, for this `w`.
    #[inline(always)]
    pub fn ln_theta_v(&self, side: PathEnd, d: f64, w: f64) -> f64 {
        let end_state = self.end_state(side);
        self.scaled_friction(end_state, self.exponent(end_state, d)) + self.kappa * w
    }

    /// Velocity for this `w` and `z`, in `v_0`.
    #[inline(always)]
    pub fn velocity(&self, side: PathEnd, w: f64, z: f64) -> f64 {
        self.end_state(side).v * exp(z - w)
    }

    /// `ln(theta v)` at friction `tau_M`.
    #[inline(always)]
    fn ln_theta_v_at_ceiling(&self, side: PathEnd, w: f64) -> f64 {
        self.end_state(side).margin / self.a + self.kappa * w
    }

    /// Greatest friction: at an end, or at the vertex of the parabola.
    pub fn friction_max(&self) -> f64 {
        let ends = self.end_states[0].friction.max(self.end_states[1].friction);
        self.vertex_friction().filter(|_| self.alpha < 0.0).map_or(ends, |vertex| vertex.max(ends))
    }

    /// Least friction: at an end, or at the vertex of the parabola.
    pub fn friction_min(&self) -> f64 {
        let ends = self.end_states[0].friction.min(self.end_states[1].friction);
        self.vertex_friction().filter(|_| self.alpha > 0.0).map_or(ends, |vertex| vertex.min(ends))
    }

    /// Friction at the vertex of the parabola, where that lies between the ends.
    fn vertex_friction(&self) -> Option<f64> {
        let vertex = 0.5 + 0.5 * self.end_states[0].l / self.alpha;
        (vertex > 0.0 && vertex < 1.0).then(|| self.friction(PathEnd::Start, vertex))
    }

    /// Rate of theta in units of `theta_0`, `v_0 t_f`; negative for backward integration.
    #[inline(always)]
    pub fn theta_rate(&self, end_state: &EndState) -> f64 {
        if self.forward { self.t_f * end_state.v } else { -self.t_f * end_state.v }
    }

    /// Slope of `ln v` in the direction of integration, for this `w` and `z`.
    pub fn ln_v_slope(&self, side: PathEnd, d: f64, w: f64, z: f64) -> f64 {
        let end_state = self.end_state(side);
        let slope = end_state.l + self.alpha * (1.0 - 2.0 * d);
        let along = if side == PathEnd::Start { slope } else { -slope };
        let rate = -self.theta_rate(end_state) * exp(-w) * exp_m1(z);
        -self.margin_at(side, d) / self.a * along - self.ratio * rate
    }

    /// Integrates along the path. The two tolerances, in units of the size of `w`, are those of the end, and of all that
    /// the end does not depend on. With a tolerance of the work, panels resolve the velocity, and are returned.
    ///
    /// # Errors
    ///
    /// The reason why the integration ends early.
    pub fn pass(
        &self,
        tolerance: f64,
        work: Option<WorkTolerance>,
        stats: &mut SolverStats,
    ) -> Result<(PassResult, Vec<FrictionPanel>), PassFailure> {
        let mut panels = Vec::new();
        if self.residual != Residual::TwoSidedSlip {
            let end = self.pass_one_way(None, tolerance, work, stats, &mut panels)?;
            return Ok((end, panels));
        }
        let other = self.reversed();
        let (side, d) = self.friction_minimum().ok_or(PassFailure::AlphaTooSmall)?;
        let first = self.pass_one_way(Some((side, d)), tolerance, work, stats, &mut panels)?;
        let opposite = if side == PathEnd::Start { PathEnd::End } else { PathEnd::Start };
        let second = other.pass_one_way(Some((opposite, d)), tolerance, work, stats, &mut panels)?;
        let theta = |path: &FrictionPath, side, end: &PassResult| exp(end.w) / path.end_state(side).v;
        let end = PassResult {
            w: 0.0,
            w_by_alpha: theta(self, side, &first) * first.w_by_alpha
                - theta(&other, opposite, &second) * second.w_by_alpha,
            max_ln_v_by_alpha: first.max_ln_v_by_alpha.max(second.max_ln_v_by_alpha),
            noise: first.noise.max(second.noise),
            errors: first.errors.max(second.errors),
            sum: first.sum + second.sum,
            work: first.work + second.work,
        };
        Ok((end, panels))
    }

    /// Failure where theta falls to 0.
    fn lost(&self) -> PassFailure {
        if self.forward { PassFailure::AlphaTooSmall } else { PassFailure::AlphaTooLarge }
    }

    /// Position near the least friction of a path with a standstill: panels must not meet in an extremum.
    fn friction_minimum(&self) -> Option<(PathEnd, f64)> {
        let position = |side: PathEnd| (side, 0.5 + 0.5 * self.end_state(side).l / self.alpha);
        let positions = [position(PathEnd::Start), position(PathEnd::End)].into_iter();
        let mut positions = positions.filter(|(_, d)| self.alpha > 0.0 && (0.0..=0.5).contains(d));
        positions.next().map(|(side, d)| (side, 0.97 * d))
    }

    /// Integrates along the path in one direction, to the end or to a distance from an end.
    fn pass_one_way(
        &self,
        until: Option<(PathEnd, f64)>,
        tolerance: f64,
        work: Option<WorkTolerance>,
        stats: &mut SolverStats,
        kept: &mut Vec<FrictionPanel>,
    ) -> Result<PassResult, PassFailure> {
        let rule = radau();
        let mut end = PassResult::default();
        let mut h = self.first_panel(PathEnd::Start);
        let mut panels = 0;
        let mut before = PathEnd::Start;
        let (tolerance, relative) = (self.size * tolerance / (1.0 + self.ratio), tolerance);
        let relaxation_distance = work.map_or(0.0, |work| self.relaxation_distance(work.accuracy));
        let last_layer = MAX_LAYERS * self.first_panel(PathEnd::End);
        stats.quadratures += 1;
        for (side, from, to, is_negligible) in self.intervals(until) {
            let end_state = self.end_state(side);
            if side != before {
                end.w += end_state.other;
                before = side;
            }
            let floor = end_state.other.min(0.0) - MAX_LN_THETA_FALL;
            if is_negligible {
                end = self.skip_standstill(side, (from, to), end, work.map(|_| &mut *kept))?;
                continue;
            }
            let along = if side == PathEnd::Start { 1.0 } else { -1.0 };
            let mut d = from;
            while d != to {
                let left = (to - d).abs();
                let stiffness = self.stiffness(end_state, side, d, end.w);
                // Short panels follow a growing solution: collocation would damp it.
                // Theta hardly shows the velocity before it follows it.
                let is_relaxing = side == PathEnd::Start && d < relaxation_distance;
                let taken = if stiffness < 0.0 || is_relaxing {
                    h.min(0.9 * MAX_QUADRATURE_EXPONENT / stiffness.abs())
                } else {
                    h
                };
                // Panels are graded towards a layer at the end, or where theta follows the velocity up to the end.
                let is_graded = left > last_layer || (stiffness > 0.0 && left * stiffness > MAX_QUADRATURE_EXPONENT);
                let taken = if side == PathEnd::End && to == 0.0 && is_graded {
                    taken.min(GRADING_RATIO * left)
                } else {
                    taken
                };
                let next = if 1.0001 * taken >= left { to } else { d + along * taken };
                let length = (next - d).abs();
                if next == d || panels == MAX_PANELS {
                    // Theta may fall to 0 within less than the rounding of a distance.
                    let falls = next == d && stiffness < 0.0 && self.forward && self.ln_theta_v(side, d, end.w) > 0.0;
                    let lost = end.w < floor + 0.75 * MAX_LN_THETA_FALL || falls;
                    return Err(if lost { self.lost() } else { PassFailure::NotConverged });
                }
                panels += 1;
                stats.nodes += NODES as u32;
                let start = [end.w, end.w_by_alpha];
                let Some(found) = collocate(self, side, (d, next), start, 0.1 * tolerance, rule) else {
                    h = 0.25 * length;
                    continue;
                };
                let (contribution, lack) = self.residual_contribution(&found.panel, rule);
                // The order of the error at the end is higher than that at the nodes: the power 3/2.
                let end_lacks = |nodes: f64| nodes * nodes.sqrt();
                let mut error_ratio = end_lacks(found.error / self.size) * self.size / tolerance;
                error_ratio = error_ratio.max(end_lacks(lack) / relative);
                let friction = self.friction(side, d).abs().max(self.friction(side, next).abs());
                if let Some(WorkTolerance { accuracy, expected }) = work {
                    let expected = expected.max(end.work + friction * found.slip).max(f64::MIN_POSITIVE);
                    error_ratio = error_ratio.max(end_lacks(friction * found.lack / expected / accuracy));
                }
                // The power 3/32 is close to the root of the order of the error at the end.
                let change = root_of_order(1.0 / error_ratio.max(1e-20));
                let change = change * change.sqrt();
                if error_ratio > 1.0 {
                    h = length * (0.8 * change).clamp(0.2, 0.8);
                    continue;
                }
                if work.is_some() {
                    kept.push(found.panel);
                }
                end = PassResult {
                    w: found.panel.w[NODES - 1],
                    w_by_alpha: found.w_by_alpha,
                    max_ln_v_by_alpha: end
                        .max_ln_v_by_alpha
                        .max((self.friction_sensitivity(end_state, next) + self.ratio * found.w_by_alpha).abs()),
                    noise: found.noise + end.noise * found.growth,
                    errors: 1.0 + end.errors * found.growth,
                    sum: end.sum + contribution,
                    work: end.work + friction * found.slip,
                };
                if end.w < floor {
                    return Err(self.lost());
                }
                h = length.max(h.min(left)) * (0.8 * change).clamp(0.5, 5.0);
                d = next;
            }
        }
        Ok(end)
    }

    /// Passes an interval of negligible slip, in which theta only ages.
    fn skip_standstill(
        &self,
        side: PathEnd,
        (from, to): (f64, f64),
        start: PassResult,
        kept: Option<&mut Vec<FrictionPanel>>,
    ) -> Result<PassResult, PassFailure> {
        let theta_rate = self.theta_rate(self.end_state(side)) * exp(-start.w);
        let change = |d: f64| theta_rate * (d - from).abs();
        let last = 1.0 + change(to);
        if last <= 0.0 {
            return Err(self.lost());
        }
        let level = |d: f64| start.w + ln_1p(change(d));
        let mut d = from;
        if let Some(kept) = kept {
            while d != to {
                // Theta changes by a factor of three at most.
                let theta = 1.0 + change(d);
                let step = theta * if self.forward { 2.0 } else { 2.0 / 3.0 } / theta_rate.abs();
                let next = if 1.5 * step >= (to - d).abs() { to } else { d + step * (to - from).signum() };
                let position = |s: f64| d * (1.0 - s) + next * s;
                let w = radau().u.map(|s| level(position(s)));
                let z = std::array::from_fn(|j| self.ln_theta_v(side, position(radau().u[j]), w[j]));
                let (forward, start) = (self.forward, level(d));
                kept.push(FrictionPanel { forward, side, from: d, to: next, start, w, z, follows: false });
                d = next;
            }
        }
        let noise = (start.noise + 2.0 * (last - 1.0).abs()) / last + level(to).abs();
        let (w_by_alpha, errors) = (start.w_by_alpha / last, start.errors / last);
        Ok(PassResult { w: level(to), w_by_alpha, noise, errors, ..start })
    }

    /// Rate at which errors of `w` decay; negative where they grow.
    fn stiffness(&self, end_state: &EndState, side: PathEnd, d: f64, w: f64) -> f64 {
        let excess = exp_m1(self.ln_theta_v(side, d, w));
        -self.theta_rate(end_state) * exp(-w) * (excess - self.kappa * (1.0 + excess))
    }

    /// Distance from the start at which theta follows the velocity to `accuracy`; 0 where the change of velocity on the
    /// way changes theta.
    fn relaxation_distance(&self, accuracy: f64) -> f64 {
        let end_state = self.end_state(PathEnd::Start);
        let rate = self.kappa * self.theta_rate(end_state);
        let jump = (end_state.margin / self.a * (end_state.l + self.alpha) / rate).abs();
        // The change of ln theta is the jump over kappa.
        let is_unresolved = jump < MAX_UNRESOLVED_CHANGE * self.kappa.abs().min(1.0);
        if rate > 0.0 && jump > accuracy && is_unresolved { ln(jump / accuracy) / rate } else { 0.0 }
    }

    /// Integral of the residual over a panel, and its error estimate in units of the spare time.
    fn residual_contribution(&self, panel: &FrictionPanel, rule: &Radau) -> (f64, f64) {
        if self.residual == Residual::LnTheta {
            return (0.0, 0.0);
        }
        let scale = self.t_f * (panel.to - panel.from).abs();
        let mut values = [0.0; NODES];
        for ((value, &node), &w) in values.iter_mut().zip(&rule.u).zip(&panel.w) {
            let d = panel.distance(node);
            *value = scale
                * if self.residual == Residual::TimeLoss {
                    exp_m1(-self.margin_at(panel.side, d) / self.a) / exp_m1(-self.ln_theta_v_at_ceiling(panel.side, w))
                } else {
                    exp(self.ln_theta_v(panel.side, d, w))
                };
        }
        let contribution = values.iter().zip(&rule.w).map(|(value, w)| value * w).sum();
        (contribution, rule.unresolved(&values) / self.spare)
    }

    /// Intervals in the direction of integration, with whether slip is negligible there: from the start to the middle and
    /// from there to the end. They are divided where the velocity vanishes or friction saturates, and clipped at `until`.
    fn intervals(&self, until: Option<(PathEnd, f64)>) -> impl Iterator<Item = (PathEnd, f64, f64, bool)> {
        let (start, end) = (self.negligible_range(PathEnd::Start), self.negligible_range(PathEnd::End));
        let all = [
            (PathEnd::Start, 0.0, start.0, false),
            (PathEnd::Start, start.0, start.1, self.alpha > 0.0),
            (PathEnd::Start, start.1, 0.5, false),
            (PathEnd::End, 0.5, end.1, false),
            (PathEnd::End, end.1, end.0, self.alpha > 0.0),
            (PathEnd::End, end.0, 0.0, false),
        ];
        let clipped = move |(side, from, to, is_negligible): (PathEnd, f64, f64, bool)| match until {
            Some((last, d)) if last == side && side == PathEnd::Start => (side, from.min(d), to.min(d), is_negligible),
            Some((last, d)) if last == side => (side, from.max(d), to.max(d), is_negligible),
            Some((PathEnd::Start, _)) => (side, to, to, is_negligible),
            _ => (side, from, to, is_negligible),
        };
        all.into_iter().map(clipped).filter(|(_, from, to, _)| from != to)
    }

    /// Distances from an end between which the velocity vanishes or friction saturates.
    fn negligible_range(&self, side: PathEnd) -> (f64, f64) {
        let end_state = self.end_state(side);
        let level = if self.alpha > 0.0 { end_state.negligible_exponent } else { -NEGLIGIBLE_LN };
        // The roots of near (l + alpha (1 - near)) = level, written without cancellation.
        let slope = end_state.l + self.alpha;
        let square = slope * slope - 4.0 * self.alpha * level;
        if square <= 0.0 || slope * level <= 0.0 {
            return (0.5, 0.5);
        }
        let sum = slope + slope.signum() * square.sqrt();
        let (d, far) = (2.0 * level / sum, 0.5 * (sum / self.alpha).abs());
        (d.min(0.5), far.min(0.5))
    }

    /// Length of a panel at an end, from the exponent and the rate of theta.
    fn first_panel(&self, side: PathEnd) -> f64 {
        let end_state = self.end_state(side);
        let layer = (end_state.l.abs() + self.alpha.abs()) * (1.0 + end_state.margin / self.a);
        (2.0 / (layer + self.t_f * end_state.v + 1.0)).min(1.0)
    }
}

/// Relative change of velocity that theta does not resolve, at most. Chosen; the budgets of `shortcut` judge it.
const MAX_UNRESOLVED_CHANGE: f64 = 0.01;

/// Length of a panel in units of a layer at its end, at most. Chosen; the budgets of `shortcut` judge it.
const MAX_LAYERS: f64 = 20.0;

/// Length of a panel towards a layer, fraction of the remaining distance. Chosen; the budgets of `shortcut` judge it.
const GRADING_RATIO: f64 = 0.8;

/// Exponent over a panel that quadrature at its nodes resolves, at most. Chosen; the budgets of `shortcut` judge it.
pub(super) const MAX_QUADRATURE_EXPONENT: f64 = 6.0;
