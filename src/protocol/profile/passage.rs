//! Theta along a member, panel by panel in the order of time, with work and the greatest friction.
//!
//! `theta' = 1 - theta v` contracts forwards. Where the slip of a panel is small, theta follows from the solution in
//! closed form, of which all terms are positive. Where it is large theta has forgotten its start and follows `1/v`:
//! Radau collocation gives `theta'` at the nodes.

use multiversion::multiversion;

use super::Exponent;
use super::arrival::total;
use super::curve::{Curve, MOST_PANELS, Panel, Side, place, places};
use crate::model::Law;
use crate::numerics::elementary::{exp, exp_m1, ln};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};
use crate::protocol::SolverStats;

/// One panel with v and theta at its start and at its nodes.
#[derive(Debug, Clone, Copy)]
pub struct Resolved {
    pub panel: Panel,
    v_start: f64,
    theta_start: f64,
    theta: Nodes,
    /// `theta'` at the start and at the nodes, accurate where it is small beside 1.
    rate_start: f64,
    rate: Nodes,
    v: Nodes,
}

/// What is gathered along the way.
#[derive(Debug, Clone, Copy)]
pub struct Passage {
    pub work: f64,
    pub friction_max: f64,
    /// As [`Resolved::sum`] has it.
    pub friction_min: f64,
}

/// Where a passage starts.
#[derive(Debug, Clone, Copy)]
pub struct Start {
    /// Velocity.
    pub v: f64,
    /// Contact lifetime.
    pub theta: f64,
    /// `theta'`, accurate where it is small beside 1.
    pub rate: f64,
    /// Whether theta is off the slow solution by no more than the first derivative of the velocity there tells.
    pub slow: bool,
}

impl Start {
    /// Steady sliding at `v`.
    pub fn steady(v: f64, slow: bool) -> Start {
        Start { v, theta: 1.0 / v, rate: 0.0, slow }
    }
}

/// Passes along the curve; every panel goes to `visit`. Returns theta at the end, `None` where numbers leave the range
/// of a double.
pub fn pass<E: Exponent>(
    curve: &Curve<E>,
    start: Start,
    rtol: f64,
    reach: f64,
    stats: &mut SolverStats,
    mut visit: impl FnMut(&Resolved),
) -> Option<f64> {
    let rule = radau();
    let Start { mut v, mut theta, mut rate, slow } = start;
    // Slip since theta last left the slow solution, and by which share: at the start, or where v changes too fast.
    let (mut slip, mut off) = (0.0, if slow { lag(curve, Side::Start, 0.0, v) } else { 1.0 });
    let mut count = 0;
    stats.quadratures += 1;
    for stretch in curve.stretches().forward() {
        let mut d = stretch.from;
        while d != stretch.to {
            let mut panel = curve.panel(&stretch, d, reach);
            if lag(curve, stretch.side, d, v) > SLOW {
                (slip, off) = (0.0, 1.0);
            }
            let forgotten = slip >= ln(off.clamp(rtol, 1.0) / rtol) + 3.0;
            let last = curve.last(&panel);
            let stiff = forgotten && curve.stiffness(&panel, v, last) > reach;
            panel = if stiff {
                curve.panel(&stretch, d, STIFF * reach)
            } else {
                // Since theta' <= 1, theta has no zero nearer behind than its own size: ln theta is smooth on that
                // scale.
                curve.cut(panel, v, last, reach).shortened(reach * theta / curve.t_f)
            };
            if panel.to == d || panel.to.is_nan() || count == MOST_PANELS {
                return None;
            }
            count += 1;
            stats.nodes += NODES as u32;
            let (resolved, slipped) = resolve(curve, panel, [v, theta, rate], stiff, rule);
            visit(&resolved);
            v = resolved.v[NODES - 1];
            theta = resolved.theta[NODES - 1];
            rate = resolved.rate[NODES - 1];
            slip += slipped;
            d = panel.to;
        }
    }
    Some(theta)
}

/// The relative change of v in the time in which theta follows: how far theta is from `1/v`, relative, where it
/// follows.
fn lag<E: Exponent>(curve: &Curve<E>, side: Side, d: f64, v: f64) -> f64 {
    let (x, z) = place(side, d);
    curve.exponent.slope(x, z).abs() * (v - curve.floor) / (v * v * curve.t_f)
}

/// Greatest lag at which theta follows v without leaving the slow solution: what it leaves it by is exponentially small
/// in the inverse of the lag.
const SLOW: f64 = 0.02;

/// How much less the exponent may vary over a panel on which theta is not given in closed form.
const STIFF: f64 = 0.6;

/// Below this one `theta'` is so small beside 1 that `1 - theta v` loses a digit or more.
const STEADY: f64 = 0.1;

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn resolve<E: Exponent>(curve: &Curve<E>, panel: Panel, start: [f64; 3], stiff: bool, rule: &Radau) -> (Resolved, f64) {
    let [v_start, theta_start, rate_start] = start;
    let (x, z) = places(&panel, rule);
    let (w, _) = curve.surpluses(&x, &z);
    let h = curve.t_f * (panel.to - panel.from).abs();
    let v = w.map(|w| curve.floor + w);
    let slip = rule.integrals(&v).map(|slip| h * slip);
    let (mut theta, mut rate) = ([0.0; NODES], [0.0; NODES]);
    if stiff {
        // v - v_start, as good where it is small.
        let level = |x: f64, z: f64| curve.exponent.value(x, z);
        let (x_0, z_0) = place(panel.side, panel.from);
        let before = level(x_0, z_0);
        let w_start = curve.w_f * exp(before);
        let mut gained = [0.0; NODES];
        for j in 0..NODES {
            let rise = level(x[j], z[j]) - before;
            gained[j] = if rise.abs() < 1.0 { w_start * exp_m1(rise) } else { w[j] - w_start };
        }
        rate = collocate(rule, h, &v, &gained, v_start, rate_start);
        for j in 0..NODES {
            theta[j] = (1.0 - rate[j]) / v[j];
        }
    } else {
        let mut growth = [0.0; NODES];
        for j in 0..NODES {
            growth[j] = exp(slip[j]);
        }
        let gained = rule.integrals(&growth);
        for j in 0..NODES {
            theta[j] = (theta_start + h * gained[j]) / growth[j];
            rate[j] = 1.0 - theta[j] * v[j];
        }
        // Next to steady sliding that difference cancels: theta'' = -v theta' - v' theta keeps its digits.
        if rate.iter().fold(rate_start.abs(), |most, rate| most.max(rate.abs())) < STEADY {
            let length = (panel.to - panel.from).abs();
            let mut loss = [0.0; NODES];
            for j in 0..NODES {
                loss[j] = growth[j] * theta[j] * w[j] * length * curve.exponent.slope(x[j], z[j]);
            }
            let lost = rule.integrals(&loss);
            for j in 0..NODES {
                rate[j] = (rate_start - lost[j]) / growth[j];
            }
        }
    }
    (Resolved { panel, v_start, theta_start, theta, rate_start, rate, v }, slip[NODES - 1])
}

/// `theta'` at the nodes of a panel of length `h`, from `rate/v + h A rate = 1/v - theta_start` divided by `h`; `gained` is `v
/// - v_start`, in which the right side keeps its digits however little changes.
#[inline(always)]
fn collocate(rule: &Radau, h: f64, v: &Nodes, gained: &Nodes, v_start: f64, rate_start: f64) -> Nodes {
    let (mut rows, mut right) = ([[0.0; NODES]; NODES], [0.0; NODES]);
    for (j, row) in rows.iter_mut().enumerate() {
        for (entry, column) in row.iter_mut().zip(&rule.columns) {
            *entry = column[j];
        }
        row[j] += 1.0 / (h * v[j]);
        right[j] = (rate_start - gained[j] / v[j]) / (h * v_start);
    }
    for k in 0..NODES {
        let mut best = k;
        for j in k + 1..NODES {
            if rows[j][k].abs() > rows[best][k].abs() {
                best = j;
            }
        }
        rows.swap(k, best);
        right.swap(k, best);
        let pivot = rows[k];
        let inverse = 1.0 / pivot[k];
        for j in k + 1..NODES {
            let share = rows[j][k] * inverse;
            for i in 0..NODES {
                rows[j][i] -= share * pivot[i];
            }
            right[j] -= share * right[k];
        }
    }
    for k in (0..NODES).rev() {
        right[k] /= rows[k][k];
        for j in 0..k {
            right[j] -= rows[j][k] * right[k];
        }
    }
    right
}

impl Resolved {
    /// Duration of the panel.
    pub fn duration<E: Exponent>(&self, curve: &Curve<E>) -> f64 {
        curve.t_f * (self.panel.to - self.panel.from).abs()
    }

    /// `x` and `z` at a share `u` of the panel.
    #[inline(always)]
    pub fn place(&self, u: f64) -> (f64, f64) {
        place(self.panel.side, self.panel.from * (1.0 - u) + self.panel.to * u)
    }

    /// Theta at a share `u` of the panel.
    pub fn theta(&self, u: f64) -> f64 {
        radau().interpolate(self.theta_start, &self.theta, u)
    }

    /// `theta'` at a share `u` of the panel.
    pub fn rate(&self, u: f64) -> f64 {
        radau().interpolate(self.rate_start, &self.rate, u)
    }

    /// `theta''` at the start and at the nodes of a panel of this duration. Where theta follows `1/v`, the terms of `-theta'
    /// v - theta v'` cancel: the slope of what is interpolated keeps its digits.
    pub fn bends(&self, duration: f64) -> (f64, Nodes) {
        let rule = radau();
        let gained = self.rate.map(|rate| rate - self.rate_start);
        (rule.slope_at_0(&gained) / duration, rule.slopes(&gained).map(|slope| slope / duration))
    }

    /// The nodes, as shares of the panel, with theta and `theta'`.
    pub fn nodes(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        radau().u.into_iter().zip(self.theta).zip(self.rate).map(|((u, theta), rate)| (u, theta, rate))
    }

    /// Work of friction on the panel, and the least friction on it: at a node, or between two if only there it falls
    /// below 0.
    pub fn sum<E: Exponent>(&self, law: &Law, curve: &Curve<E>) -> (f64, f64) {
        let (friction, rise, power) = frictions(law, curve, self, radau());
        let first = self.first(law, curve);
        (self.duration(curve) * power, self.least(law, curve, first, &friction, &rise))
    }

    /// Friction at the start.
    fn first<E: Exponent>(&self, law: &Law, curve: &Curve<E>) -> Sample {
        let friction = friction_at(law, self.v_start, self.theta_start);
        Sample { u: 0.0, friction, rise: self.rise(law, curve, 0.0, self.v_start, self.theta_start, self.rate_start) }
    }

    /// The least friction, from that at the start and at the nodes.
    fn least<E: Exponent>(
        &self,
        law: &Law,
        curve: &Curve<E>,
        mut before: Sample,
        friction: &Nodes,
        rise: &Nodes,
    ) -> f64 {
        let mut least = friction.iter().copied().fold(before.friction, f64::min);
        for j in 0..NODES {
            let after = Sample { u: radau().u[j], friction: friction[j], rise: rise[j] };
            // The tangent bounds a minimum in between.
            if least >= 0.0
                && before.rise < 0.0
                && after.rise > 0.0
                && before.friction + before.rise * (after.u - before.u) < 0.0
            {
                least = least.min(self.turn(law, curve, SIGN, before, after, -1.0));
            }
            before = after;
        }
        least
    }

    /// Adds the work of the panel, and raises the greatest friction to what is found on it, good to `rtol`.
    pub fn gather<E: Exponent>(&self, law: &Law, curve: &Curve<E>, rtol: f64, passage: &mut Passage) {
        let rule = radau();
        let (friction, rise, power) = frictions(law, curve, self, rule);
        passage.work += self.duration(curve) * power;
        let mut before = self.first(law, curve);
        passage.friction_min = passage.friction_min.min(self.least(law, curve, before, &friction, &rise));
        passage.friction_max = passage.friction_max.max(before.friction);
        for j in 0..NODES {
            let after = Sample { u: rule.u[j], friction: friction[j], rise: rise[j] };
            passage.friction_max = passage.friction_max.max(after.friction);
            // The tangent bounds a maximum in between.
            if before.rise > 0.0
                && after.rise < 0.0
                && before.friction + before.rise * (after.u - before.u) > passage.friction_max
            {
                let greatest = self.turn(law, curve, rtol, before, after, 1.0);
                passage.friction_max = passage.friction_max.max(greatest);
            }
            before = after;
        }
    }

    /// `dtau/du = a v'/v + b theta'/theta`.
    #[inline(always)]
    fn rise<E: Exponent>(&self, law: &Law, curve: &Curve<E>, u: f64, v: f64, theta: f64, rate: f64) -> f64 {
        let (x, z) = self.place(u);
        let length = (self.panel.to - self.panel.from).abs();
        length * (law.a * curve.exponent.slope(x, z) * (1.0 - curve.floor / v) + law.b * curve.t_f * rate / theta)
    }

    /// The greatest friction (`side` 1) between two samples where it first rises and then falls, or the least one (-1)
    /// where it first falls and then rises: the root of `tau'` by the Illinois method.
    fn turn<E: Exponent>(
        &self,
        law: &Law,
        curve: &Curve<E>,
        rtol: f64,
        mut low: Sample,
        mut high: Sample,
        side: f64,
    ) -> f64 {
        let mut extreme = side * (side * low.friction).max(side * high.friction);
        let (mut rise_low, mut rise_high) = (low.rise, high.rise);
        let mut last = 0.0;
        for _ in 0..MOST_STEPS {
            let u = low.u + (high.u - low.u) * (rise_low / (rise_low - rise_high));
            let theta = self.theta(u);
            let rate = self.rate(u);
            let (x, z) = self.place(u);
            let v = curve.floor + curve.w_f * exp(curve.exponent.value(x, z));
            let rise = self.rise(law, curve, u, v, theta, rate);
            let friction = friction_at(law, v, theta);
            extreme = side * (side * extreme).max(side * friction);
            // What is left to gain is less than the rise over the bracket.
            if rise.abs() * (high.u - low.u) <= 0.1 * rtol * friction.abs() {
                break;
            }
            let sample = Sample { u, friction, rise };
            if side * rise > 0.0 {
                (low, rise_low) = (sample, rise);
                rise_high *= if last > 0.0 { 0.5 } else { 1.0 };
                last = 1.0;
            } else {
                (high, rise_high) = (sample, rise);
                rise_low *= if last < 0.0 { 0.5 } else { 1.0 };
                last = -1.0;
            }
        }
        extreme
    }
}

/// Accuracy of a least friction of which only the sign counts, relative to itself: it ends where that is certain.
const SIGN: f64 = 0.1;

/// Friction at a place and its slope there.
#[derive(Debug, Clone, Copy)]
struct Sample {
    u: f64,
    friction: f64,
    /// `dtau/du`.
    rise: f64,
}

/// More steps than a bracket between two nodes takes.
const MOST_STEPS: u32 = 60;

/// `tau = 1 + a ln v + b ln theta`.
#[inline(always)]
pub fn friction_at(law: &Law, v: f64, theta: f64) -> f64 {
    1.0 + law.a * ln(v) + law.b * ln(theta)
}

/// Friction and its slope at the nodes, and `int tau v du`.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn frictions<E: Exponent>(law: &Law, curve: &Curve<E>, resolved: &Resolved, rule: &Radau) -> (Nodes, Nodes, f64) {
    let Resolved { v, theta, rate, .. } = resolved;
    let (mut tau, mut rise, mut power) = ([0.0; NODES], [0.0; NODES], [0.0; NODES]);
    for j in 0..NODES {
        tau[j] = friction_at(law, v[j], theta[j]);
        power[j] = rule.w[j] * tau[j] * v[j];
    }
    for j in 0..NODES {
        rise[j] = resolved.rise(law, curve, rule.u[j], v[j], theta[j], rate[j]);
    }
    (tau, rise, total(&power))
}
