//! A member of the family for one `alpha_3`, and the pass along it in the direction in which theta contracts.
//!
//! The variable is `w = ln(theta/theta_0)` with `theta_0 = 1/v_0` at the nearer end:
//!
//! ```text
//! w' = v_0 (e^-w - v/v_0),    ln(v/v_0) = f - (b/a) w,    f = (tau - tau_0)/a.
//! ```
//!
//! Places are distances from the nearer end too, in units of `t_f`: so layers much thinner than the rounding of `x` are
//! seen, and small changes keep their digits.

use super::panel::{Panel, collocate};
use crate::model::Transition;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::radau::{NODES, Radau, radau};
use crate::protocol::SolverStats;
use crate::protocol::shortcut::Case;

/// The end from which a place is measured, in the direction of integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Start,
    End,
}

/// What is known at an end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Anchor {
    /// Velocity `v_0`, which is `1/theta_0`.
    pub v: f64,
    /// Friction.
    friction: f64,
    /// `tau_M - tau`.
    pub gap: f64,
    /// Slope of `ln R^x` from here inwards.
    l: f64,
    /// `w` where theta is that of the other end.
    other: f64,
    /// From here on the exponent leaves a velocity that moves nothing.
    quiet: f64,
    /// From here on it leaves a velocity that is 0 in double precision.
    cap: f64,
}

/// What tells how far a course is from arriving.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Measure {
    /// `ln theta` at the end.
    Level,
    /// Just beyond the time of `v = 0`: the slip in contact lifetimes, `int theta v dt`, against the time to spare.
    Slip { spare: f64 },
    /// Just beyond the time of `tau = tau_M`: the time lost to lower friction against the time to spare.
    Lag { spare: f64 },
    /// The slip in contact lifetimes of both ways, from the start forwards and from the end backwards, to where they
    /// meet in a standstill, against the time to spare.
    Meeting { spare: f64 },
}

/// A member of the family for one `alpha_3`.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionPath {
    pub alpha: f64,
    pub forward: bool,
    pub t_f: f64,
    pub a: f64,
    /// `b/a`.
    pub ratio: f64,
    /// `1 - b/a`.
    pub kappa: f64,
    /// The size of `w`: its change from end to end, or 1 if that is less.
    pub size: f64,
    /// What rounding of `tau_M` makes of `ln R`, in units of the last place of 1.
    pub blur: f64,
    pub measure: Measure,
    /// The ends in the direction of integration.
    anchors: [Anchor; 2],
}

/// Where a pass ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    /// `w`: 0 if it arrives.
    pub w: f64,
    /// Its derivative by `alpha_3`.
    pub turn: f64,
    /// The greatest derivative of `ln v` by it on the way.
    sway: f64,
    /// What rounding on the way may have made of it, in units of the last place of 1.
    pub noise: f64,
    /// What errors of 1 in every panel would have made of it.
    pub errors: f64,
    /// The integral of the measure but for [`Measure::Level`].
    sum: f64,
    /// The work on the way, roughly and without regard to its sign.
    pub work: f64,
}

/// What a pass has to tell the work to.
#[derive(Debug, Clone, Copy)]
pub(super) struct WorkSums {
    /// Share of the work that quadrature may leave.
    pub accuracy: f64,
    /// The work that is to be expected; 0 where it is not known.
    pub expected: f64,
}

/// Why a pass did not reach the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stop {
    /// Theta fell to nothing: too little of `alpha_3` for a way forwards.
    Little,
    /// Theta fell to nothing backwards: too much of `alpha_3`.
    Much,
    /// A defect of ours.
    GaveUp,
}

/// Where `w` has fallen this far below both ends, theta counts as lost.
const LOST: f64 = 25.0;

/// A velocity below `e^-QUIET` moves nothing within any time.
pub(super) const QUIET: f64 = 100.0;

/// A velocity below `e^-NOTHING` is 0 in double precision.
const NOTHING: f64 = 800.0;

/// Where `ln[(tau_M - tau)/gap]` is below this, friction is `tau_M` to the last bit.
const SATURATED: f64 = -45.0;

/// Keeps `tau_M - tau` within the range of a double.
pub(super) const MOST_EXPONENT: f64 = 400.0;

/// Most panels of one pass: far more than a course takes that is not lost.
const MOST_PANELS: usize = 4000;

impl FrictionPath {
    pub fn new(case: &Case, gaps: (f64, f64), ln_r: f64, log_ratio: f64, measure: Measure) -> FrictionPath {
        let Transition { law, v_i, v_f } = case.transition;
        let ratio = law.b / law.a;
        let anchor = |v: f64, gap: f64, l: f64, other: f64| {
            // The exponent that leaves a velocity below this power of e.
            let depth = |power: f64| ln_1p((power + ln(v) + ratio * (LOST + log_ratio.abs())) * law.a / gap);
            let friction = 1.0 + (law.a - law.b) * ln(v);
            Anchor { v, friction, gap, l, other, quiet: depth(QUIET), cap: depth(NOTHING) }
        };
        let forward = law.b <= law.a;
        let ends = [anchor(v_i, gaps.0, ln_r, log_ratio), anchor(v_f, gaps.1, -ln_r, -log_ratio)];
        let anchors = if forward { ends } else { [ends[1], ends[0]] };
        let (kappa, size) = ((law.a - law.b) / law.a, log_ratio.abs().min(1.0));
        let bound = if case.tau_ceiling.is_finite() { case.tau_ceiling.abs().max(1.0) } else { 0.0 };
        let blur = bound / gaps.0 * ((law.a - law.b) * log_ratio).abs() / gaps.1;
        FrictionPath { alpha: 0.0, forward, t_f: case.t_f, a: law.a, ratio, kappa, size, blur, measure, anchors }
    }

    /// A change of `alpha_3` that counts: about a quarter of it is the change of `ln v`.
    pub fn unit(&self) -> f64 {
        self.a / self.anchors[0].gap.max(self.anchors[1].gap)
    }

    /// The change of `alpha_3` that changes some velocity by as much as itself, or `alpha_3` if that is less.
    pub fn scale(&self, end: &End) -> f64 {
        let mut greatest = end.sway.max(1.0 / self.alpha.abs());
        for k in 1..8 {
            let near = 0.125 * f64::from(k);
            let anchor = self.anchor(Side::Start);
            let exponent = self.exponent(anchor, near);
            // What stands still does so as long as its velocity is not 0 in double precision.
            if exponent > anchor.quiet && exponent < anchor.cap {
                greatest = greatest.max(self.lean(anchor, near));
            }
        }
        1.0 / greatest
    }

    /// By how much friction falls with `alpha_3` at a place, in units of `a`.
    #[inline(always)]
    pub fn lean(&self, anchor: &Anchor, near: f64) -> f64 {
        anchor.gap / self.a * near * (1.0 - near) * exp(self.exponent(anchor, near).min(MOST_EXPONENT))
    }

    /// The course with another `alpha_3`.
    pub fn with(self, alpha: f64) -> FrictionPath {
        FrictionPath { alpha, ..self }
    }

    /// The same course, integrated the other way.
    pub fn reversed(self) -> FrictionPath {
        let [first, last] = self.anchors;
        FrictionPath { forward: !self.forward, anchors: [last, first], ..self }
    }

    /// The same course, integrated forwards or not.
    pub fn towards(self, forward: bool) -> FrictionPath {
        if self.forward == forward { self } else { self.reversed() }
    }

    /// The course with another measure.
    pub fn measured_by(self, measure: Measure) -> FrictionPath {
        FrictionPath { measure, ..self }
    }

    /// What is known at an end.
    #[inline(always)]
    pub fn anchor(&self, side: Side) -> &Anchor {
        &self.anchors[side as usize]
    }

    /// How far the end lies beyond its target, in a form that rises with `alpha_3`, and the step of Newton's method
    /// from here.
    pub fn miss(&self, end: &End) -> (f64, f64) {
        let rise = if self.forward { 1.0 } else { -1.0 };
        match self.measure {
            // It is `theta` that bends least: where it is about to be lost it falls to 0 on a line.
            Measure::Level => {
                let bent = -exp_m1(-end.w.max(-3.0));
                (rise * bent, -bent / end.turn)
            }
            Measure::Slip { spare } | Measure::Meeting { spare } => {
                let excess = ln(end.sum / spare);
                (-excess, excess * end.sum / (rise * self.worth(end.w) * end.turn))
            }
            Measure::Lag { spare } => {
                let excess = ln(end.sum / spare);
                (excess, -excess * end.sum / (rise * self.worth(end.w) * end.turn))
            }
        }
    }

    /// What a change of `w` at the end is worth in time, where it is `w`.
    pub fn worth(&self, w: f64) -> f64 {
        let theta = exp(w) / self.anchors[1].v;
        match self.measure {
            Measure::Lag { .. } => theta / exp_m1(self.surplus(Side::End, w)),
            Measure::Level | Measure::Slip { .. } => theta,
            // The end of a meeting is in units of time.
            Measure::Meeting { .. } => 1.0,
        }
    }

    /// What an error of 1 in each panel may be worth of `alpha_3`, inverse.
    pub fn precision(&self, end: &End) -> f64 {
        end.turn.abs() / end.errors
    }

    /// The change of `alpha_3` that rounding at the end stands for.
    pub fn rounding(&self, end: &End) -> f64 {
        match self.measure {
            Measure::Level => end.noise / end.turn.abs(),
            Measure::Slip { .. } | Measure::Lag { .. } | Measure::Meeting { .. } => {
                // One unit of the measure, and what rounding of t_f is of the time to spare.
                let (miss, step) = self.miss(&End { sum: std::f64::consts::E * end.sum, ..*end });
                (step / (std::f64::consts::E * miss)).abs() * (1.0 + self.t_f / end.sum)
            }
        }
    }

    /// The change of `alpha_3` that rounding of a meeting's sum stands for, without that of `t_f`, which no measure escapes; 0
    /// for the other measures.
    pub fn lost_in_sum(&self, end: &End) -> f64 {
        match self.measure {
            Measure::Meeting { .. } => self.rounding(end) / (1.0 + self.t_f / end.sum),
            _ => 0.0,
        }
    }

    /// `ln[(tau_M - tau)/gap]` with the gap of this side: where `alpha_3` is next to `-ln R`, the sum of both is exact.
    #[inline(always)]
    pub fn exponent(&self, anchor: &Anchor, near: f64) -> f64 {
        near * ((anchor.l + self.alpha) - self.alpha * near)
    }

    /// Rounding of the exponent, in units of the last place of 1.
    #[inline(always)]
    pub fn uncertainty(&self, anchor: &Anchor, near: f64) -> f64 {
        near * ((anchor.l + self.alpha).abs() + self.alpha.abs() * near)
    }

    /// `f = (tau - tau_0)/a`.
    #[inline(always)]
    pub fn drive(&self, anchor: &Anchor, exponent: f64) -> f64 {
        let e = if exponent > anchor.cap { anchor.cap } else { exponent };
        -anchor.gap / self.a * exp_m1(e)
    }

    /// `tau_M - tau`, within the range of a double.
    #[inline(always)]
    fn distance(&self, side: Side, near: f64) -> f64 {
        let anchor = self.anchor(side);
        anchor.gap * exp(self.exponent(anchor, near).min(MOST_EXPONENT))
    }

    /// Friction at a place, within the range of a double.
    #[inline(always)]
    pub fn friction(&self, side: Side, near: f64) -> f64 {
        let anchor = self.anchor(side);
        anchor.friction - anchor.gap * exp_m1(self.exponent(anchor, near).min(MOST_EXPONENT))
    }

    /// `z = ln(theta v)` at a place with this `w`.
    #[inline(always)]
    pub fn excess(&self, side: Side, near: f64, w: f64) -> f64 {
        let anchor = self.anchor(side);
        self.drive(anchor, self.exponent(anchor, near)) + self.kappa * w
    }

    /// Velocity at a place with this `w` and `z`.
    #[inline(always)]
    pub fn velocity(&self, side: Side, w: f64, z: f64) -> f64 {
        self.anchor(side).v * exp(z - w)
    }

    /// `ln(theta v)` that friction `tau_M` would give.
    #[inline(always)]
    fn surplus(&self, side: Side, w: f64) -> f64 {
        self.anchor(side).gap / self.a + self.kappa * w
    }

    /// Greatest friction: at an end, or at the vertex of the parabola.
    pub fn friction_max(&self) -> f64 {
        let ends = self.anchors[0].friction.max(self.anchors[1].friction);
        self.vertex_friction().filter(|_| self.alpha < 0.0).map_or(ends, |vertex| vertex.max(ends))
    }

    /// Least friction: at an end, or at the vertex of the parabola.
    pub fn friction_min(&self) -> f64 {
        let ends = self.anchors[0].friction.min(self.anchors[1].friction);
        self.vertex_friction().filter(|_| self.alpha > 0.0).map_or(ends, |vertex| vertex.min(ends))
    }

    /// Friction at the vertex of the parabola, where that lies between the ends.
    fn vertex_friction(&self) -> Option<f64> {
        let vertex = 0.5 + 0.5 * self.anchors[0].l / self.alpha;
        (vertex > 0.0 && vertex < 1.0).then(|| self.friction(Side::Start, vertex))
    }

    /// The rate of theta in units of `theta_0`, `v_0 t_f`, with the sign of the integration against time.
    #[inline(always)]
    pub fn pace(&self, anchor: &Anchor) -> f64 {
        if self.forward { self.t_f * anchor.v } else { -self.t_f * anchor.v }
    }

    /// Slope of `ln v` along the integration at a place with this `w` and `z`.
    pub fn bend(&self, side: Side, near: f64, w: f64, z: f64) -> f64 {
        let anchor = self.anchor(side);
        let slope = anchor.l + self.alpha * (1.0 - 2.0 * near);
        let along = if side == Side::Start { slope } else { -slope };
        let rate = -self.pace(anchor) * exp(-w) * exp_m1(z);
        -self.distance(side, near) / self.a * along - self.ratio * rate
    }

    /// Passes along the course; every panel goes to `visit`. The end is good to a tolerance in units of the size of `w`,
    /// what the end forgets to a looser one. If the pass is to tell the work as well, the velocity has to be resolved.
    pub fn pass(
        &self,
        tolerances: (f64, f64),
        work: Option<WorkSums>,
        stats: &mut SolverStats,
        mut visit: impl FnMut(&FrictionPath, &Panel),
    ) -> Result<End, Stop> {
        if !matches!(self.measure, Measure::Meeting { .. }) {
            return self.leg(None, tolerances, work, stats, |panel| visit(self, panel));
        }
        let other = self.reversed();
        let (side, near) = self.deepest().ok_or(Stop::Little)?;
        let first = self.leg(Some((side, near)), tolerances, work, stats, |panel| visit(self, panel))?;
        let opposite = if side == Side::Start { Side::End } else { Side::Start };
        let second = other.leg(Some((opposite, near)), tolerances, work, stats, |panel| visit(&other, panel))?;
        let theta = |path: &FrictionPath, side, end: &End| exp(end.w) / path.anchor(side).v;
        Ok(End {
            w: 0.0,
            turn: theta(self, side, &first) * first.turn - theta(&other, opposite, &second) * second.turn,
            sway: first.sway.max(second.sway),
            noise: first.noise.max(second.noise),
            errors: first.errors.max(second.errors),
            sum: first.sum + second.sum,
            work: first.work + second.work,
        })
    }

    /// What a theta that falls to nothing means.
    fn lost(&self) -> Stop {
        if self.forward { Stop::Little } else { Stop::Much }
    }

    /// Next to where friction is least on a course that comes to a standstill: panels must not meet in an extremum.
    fn deepest(&self) -> Option<(Side, f64)> {
        let place = |side: Side| (side, 0.5 + 0.5 * self.anchor(side).l / self.alpha);
        let places = [place(Side::Start), place(Side::End)].into_iter();
        let mut places = places.filter(|(_, near)| self.alpha > 0.0 && (0.0..=MIDDLE).contains(near));
        places.next().map(|(side, near)| (side, 0.97 * near))
    }

    /// Passes along the course, up to a place of a side if there is one.
    fn leg(
        &self,
        until: Option<(Side, f64)>,
        (tolerance, loosest): (f64, f64),
        work: Option<WorkSums>,
        stats: &mut SolverStats,
        mut visit: impl FnMut(&Panel),
    ) -> Result<End, Stop> {
        let rule = radau();
        let mut end = End { w: 0.0, turn: 0.0, sway: 0.0, noise: 0.0, errors: 0.0, sum: 0.0, work: 0.0 };
        let mut h = self.thin(Side::Start);
        let mut panels = 0;
        let mut before = Side::Start;
        // What is forgotten before the end needs not be good to more than this.
        let loosest = self.size * tolerance.max(loosest) / (1.0 + self.ratio);
        let (tolerance, relative) = (self.size * tolerance, tolerance);
        let (damping, layer) = self.damping();
        let last_layer = SEEN * self.thin(Side::End);
        let settles = work.map_or(0.0, |work| self.settles(work.accuracy));
        let grows = until.is_some() && self.kappa * self.pace(self.anchor(Side::Start)) < 0.0;
        stats.quadratures += 1;
        for (side, from, to, quiet) in self.stretches(until) {
            let anchor = self.anchor(side);
            if side != before {
                end.w += anchor.other;
                before = side;
            }
            let floor = anchor.other.min(0.0) - LOST;
            if quiet {
                end = self.leap(side, (from, to), end, rule, work.is_some(), &mut visit)?;
                continue;
            }
            let along = if side == Side::Start { 1.0 } else { -1.0 };
            let mut near = from;
            while near != to {
                let left = (to - near).abs();
                // Several panels without elimination cost less than one with it.
                let stiffness = self.stiffness(anchor, side, near, end.w);
                let mild = 0.9 * MILD / stiffness.abs();
                // What grows has to be followed: collocation would damp it.
                let taken = if stiffness < 0.0 || h.min(left) < WORTH * mild { h.min(mild) } else { h };
                // What the velocity does before theta follows it is next to nothing to theta.
                let taken = if side == Side::Start && near < settles { taken.min(mild) } else { taken };
                // Towards a layer at the end, or where theta follows the velocity up to there, panels shrink like what is
                // left.
                let thin = left > last_layer || (stiffness > 0.0 && left > mild);
                let taken = if side == Side::End && to == 0.0 && thin { taken.min(GRADED * left) } else { taken };
                let next = if 1.0001 * taken >= left { to } else { near + along * taken };
                let length = (next - near).abs();
                if next == near || panels == MOST_PANELS {
                    // Theta may fall to nothing within less time than a place can tell.
                    let falls = next == near && stiffness < 0.0 && self.forward && self.excess(side, near, end.w) > 0.0;
                    let lost = end.w < floor + 0.75 * LOST || falls;
                    return Err(if lost { self.lost() } else { Stop::GaveUp });
                }
                panels += 1;
                stats.nodes += NODES as u32;
                let forgotten = match side {
                    _ if until.is_some() => 0.0,
                    Side::Start => damping * layer - FALL - self.size,
                    Side::End => damping.min(stiffness) * layer.min(next),
                };
                let tolerance = (tolerance * exp(forgotten.clamp(0.0, MOST_EXPONENT))).min(loosest);
                let enough = 0.1 * tolerance * if grows { end.w.abs().min(1.0) } else { 1.0 };
                let Some(found) = collocate(self, side, (near, next), [end.w, end.turn], enough, rule) else {
                    h = 0.25 * length;
                    continue;
                };
                // What grows from nothing has to be good to a share of what it is.
                let seed = if grows { found.panel.w[NODES - 1].abs().min(1.0) } else { 1.0 };
                let (size, tolerance) = (seed * self.size, seed * tolerance);
                let (part, lack) = self.part(&found.panel, rule);
                // What the end lacks is of the order of the square of what the nodes lack.
                let end_lacks = |nodes: f64| nodes * nodes.sqrt();
                let mut excess = end_lacks(found.error / size) * size / tolerance;
                excess = excess.max(end_lacks(lack) / relative);
                let friction = self.friction(side, near).abs().max(self.friction(side, next).abs());
                if let Some(WorkSums { accuracy, expected }) = work {
                    let expected = expected.max(end.work + friction * found.slid).max(f64::MIN_POSITIVE);
                    excess = excess.max(end_lacks(friction * found.lack / expected / accuracy));
                }
                let change = root_of_order(1.0 / excess.max(1e-20));
                if excess > 1.0 {
                    h = length * (0.8 * change).clamp(0.2, 0.8);
                    continue;
                }
                visit(&found.panel);
                end = End {
                    w: found.panel.w[NODES - 1],
                    turn: found.turn,
                    sway: end.sway.max((self.lean(anchor, next) + self.ratio * found.turn).abs()),
                    noise: found.noise + end.noise * found.growth,
                    errors: 1.0 + end.errors * found.growth,
                    sum: end.sum + part,
                    work: end.work + friction * found.slid,
                };
                if end.w < floor {
                    return Err(self.lost());
                }
                h = length.max(h.min(left)) * (0.8 * change).clamp(0.5, 5.0);
                near = next;
            }
        }
        Ok(end)
    }

    /// Passes a stretch in which nothing moves, so that theta changes by the time alone.
    fn leap(
        &self,
        side: Side,
        (from, to): (f64, f64),
        start: End,
        rule: &Radau,
        shown: bool,
        visit: &mut impl FnMut(&Panel),
    ) -> Result<End, Stop> {
        let pace = self.pace(self.anchor(side)) * exp(-start.w);
        let change = |near: f64| pace * (near - from).abs();
        let last = 1.0 + change(to);
        if last <= 0.0 {
            return Err(self.lost());
        }
        let level = |near: f64| start.w + ln_1p(change(near));
        let mut near = from;
        while shown && near != to {
            // Theta changes by a factor of three at most, and the last share of it in one piece.
            let theta = 1.0 + change(near);
            let step = theta * if self.forward { 2.0 } else { 2.0 / 3.0 } / pace.abs();
            let next = if 1.5 * step >= (to - near).abs() { to } else { near + step * (to - from).signum() };
            let place = |s: f64| near * (1.0 - s) + next * s;
            let w = rule.u.map(|s| level(place(s)));
            let z = std::array::from_fn(|j| self.excess(side, place(rule.u[j]), w[j]));
            visit(&Panel {
                forward: self.forward,
                side,
                from: near,
                to: next,
                start: level(near),
                w,
                z,
                follows: false,
            });
            near = next;
        }
        let noise = (start.noise + 2.0 * (last - 1.0).abs()) / last + level(to).abs();
        let (turn, errors) = (start.turn / last, start.errors / last);
        Ok(End { w: level(to), turn, noise, errors, ..start })
    }

    /// How fast the course forgets at a place with this `w`; negative where `w` grows as theta falls.
    fn stiffness(&self, anchor: &Anchor, side: Side, near: f64, w: f64) -> f64 {
        let excess = exp_m1(self.excess(side, near, w));
        -self.pace(anchor) * exp(-w) * (excess - self.kappa * (1.0 + excess))
    }

    /// How fast the course surely forgets at its end, and how far from the end it does.
    fn damping(&self) -> (f64, f64) {
        let anchor = self.anchor(Side::End);
        let layer = (anchor.l.abs() + self.alpha.abs()) * (1.0 + anchor.gap / self.a);
        (0.25 * (self.kappa * self.pace(anchor)).abs(), (1.0 / layer).min(0.25))
    }

    /// How far from its start theta comes to follow the velocity to an accuracy, where the change of velocity in between
    /// is too small for theta to show it.
    fn settles(&self, accuracy: f64) -> f64 {
        let anchor = self.anchor(Side::Start);
        let rate = self.kappa * self.pace(anchor);
        let jump = (anchor.gap / self.a * (anchor.l + self.alpha) / rate).abs();
        // Theta changes by that over kappa.
        let faint = jump < FAINT * self.kappa.abs().min(1.0);
        if rate > 0.0 && jump > accuracy && faint { ln(jump / accuracy) / rate } else { 0.0 }
    }

    /// The part of a panel in the integral of the measure, and what its nodes lack of it.
    fn part(&self, panel: &Panel, rule: &Radau) -> (f64, f64) {
        let spare = match self.measure {
            Measure::Level => return (0.0, 0.0),
            Measure::Slip { spare } | Measure::Lag { spare } | Measure::Meeting { spare } => spare,
        };
        let scale = self.t_f * (panel.to - panel.from).abs();
        let mut values = [0.0; NODES];
        for ((value, &node), &w) in values.iter_mut().zip(&rule.u).zip(&panel.w) {
            let near = panel.place(node);
            *value = scale
                * if matches!(self.measure, Measure::Lag { .. }) {
                    exp_m1(-self.distance(panel.side, near) / self.a) / exp_m1(-self.surplus(panel.side, w))
                } else {
                    exp(self.excess(panel.side, near, w))
                };
        }
        let part = values.iter().zip(&rule.w).map(|(value, w)| value * w).sum();
        (part, rule.unresolved(&values) / spare)
    }

    /// Stretches in the direction of integration, with whether nothing moves there: from the start to the middle and
    /// from there to the end, each cut where the velocity vanishes or friction saturates; no farther than a place of a
    /// side.
    fn stretches(&self, until: Option<(Side, f64)>) -> impl Iterator<Item = (Side, f64, f64, bool)> {
        let (start, end) = (self.cuts(Side::Start), self.cuts(Side::End));
        let all = [
            (Side::Start, 0.0, start.0, false),
            (Side::Start, start.0, start.1, self.alpha > 0.0),
            (Side::Start, start.1, MIDDLE, false),
            (Side::End, MIDDLE, end.1, false),
            (Side::End, end.1, end.0, self.alpha > 0.0),
            (Side::End, end.0, 0.0, false),
        ];
        let clipped = move |(side, from, to, quiet): (Side, f64, f64, bool)| match until {
            Some((last, near)) if last == side && side == Side::Start => (side, from.min(near), to.min(near), quiet),
            Some((last, near)) if last == side => (side, from.max(near), to.max(near), quiet),
            Some((Side::Start, _)) => (side, to, to, quiet),
            _ => (side, from, to, quiet),
        };
        all.into_iter().map(clipped).filter(|(_, from, to, _)| from != to)
    }

    /// From where to where on a side the velocity vanishes or friction saturates.
    fn cuts(&self, side: Side) -> (f64, f64) {
        let anchor = self.anchor(side);
        let level = if self.alpha > 0.0 { anchor.quiet } else { SATURATED };
        // The roots of near (l + alpha (1 - near)) = level, written without cancellation.
        let slope = anchor.l + self.alpha;
        let square = slope * slope - 4.0 * self.alpha * level;
        if square <= 0.0 || slope * level <= 0.0 {
            return (MIDDLE, MIDDLE);
        }
        let sum = slope + slope.signum() * square.sqrt();
        let (near, far) = (2.0 * level / sum, 0.5 * (sum / self.alpha).abs());
        (near.min(MIDDLE), far.min(MIDDLE))
    }

    /// A panel at an end: what the exponent and the rate of theta allow.
    fn thin(&self, side: Side) -> f64 {
        let anchor = self.anchor(side);
        let layer = (anchor.l.abs() + self.alpha.abs()) * (1.0 + anchor.gap / self.a);
        (2.0 / (layer + self.t_f * anchor.v + 1.0)).min(1.0)
    }
}

/// The place that is as far from either end.
const MIDDLE: f64 = 0.5;

/// A relative change of velocity that theta may not show.
const FAINT: f64 = 0.01;

/// What theta falls on the way before it is lost makes of an error.
const FALL: f64 = LOST + 30.0;

/// How many times as long as a layer at its end a panel may be.
const SEEN: f64 = 20.0;

/// Share of what is left that a panel takes towards a layer.
const GRADED: f64 = 0.8;

/// Exponents of a panel that quadrature at its nodes resolves.
pub(super) const MILD: f64 = 6.0;

/// How many times as dear a panel with elimination is.
const WORTH: f64 = 4.0;

/// By how much a panel may grow for its error to grow as much: near enough to the root of the order, the sixteenth with
/// half of it once more.
fn root_of_order(x: f64) -> f64 {
    let sixteenth = x.sqrt().sqrt().sqrt().sqrt();
    sixteenth * sixteenth.sqrt()
}
