//! The cubic shortcuts: `theta = 1/v_i + alpha_2 t + alpha_3 t^2 + alpha_4 t^3`, `v` free to jump at both ends.
//!
//! `alpha_4` follows from `theta(t_f) = 1/v_f`. A shortcut is a `path` of two polynomials; whether it is feasible is
//! decided from their stationary points before any quadrature is spent, and the quadrature follows from their zeros
//! (`rules`).

mod kernel;
mod moments;
mod motion;
mod path;
mod plan;
mod rules;

use super::{Effort, Motion, Status};
use crate::model::{Law, Transition};
use crate::numerics::elementary::ln;
use crate::numerics::gauss::rule;
use crate::numerics::lanes::LANES;
use kernel::Slice;
pub(super) use path::Path;
use path::{Ends, screen};
use plan::{BLOCK, plan};
use rules::{Accuracy, Map, Panel, Zeros, choose};

/// The work landscape of one transition in one time over the plane of `(alpha_2, alpha_3)`.
#[derive(Debug, Clone)]
pub struct Landscape {
    law: Law,
    ends: Ends,
    ln_t_f: f64,
    accuracy: Accuracy,
    /// Largest share of an error in theta.
    rounding: f64,
}

/// Nodes that no better map can save much of.
const CHEAP: usize = 16;

/// Most nodes of a panel that is taken without a search for a better one.
const MOST_PLANNED: usize = 64;

/// Nodes from which the polynomials are expanded in double-double.
const NEAR: usize = 72;

/// The results of a run of shortcuts, one element a shortcut, laid out column by column.
#[derive(Debug)]
pub struct Shortcuts<'a> {
    /// `W_s`; left untouched where infeasible, and everywhere if empty (not asked for).
    pub work: &'a mut [f64],
    /// Least velocity on `[0, t_f]`; left untouched where infeasible, and everywhere if empty (not asked for).
    pub v_min: &'a mut [f64],
    /// `Ok`, `BelowBound` or `Infeasible`.
    pub status: &'a mut [Status],
}

impl Landscape {
    /// Prepares the landscape of `transition` in time `t_f`; every work is good to relative accuracy `rtol`.
    pub fn new(transition: &Transition, t_f: f64, rtol: f64) -> Self {
        let ends = Ends::between(transition.v_i, transition.v_f, t_f, 0.5 * rtol);
        Landscape {
            law: transition.law,
            ends,
            ln_t_f: ln(t_f),
            accuracy: Accuracy::new(0.5 * rtol),
            rounding: 0.05 * rtol,
        }
    }

    /// Whether friction at `u = 1`, `1 + (b - a) ln theta`, is positive; for `b > a` it fails at the smallest theta.
    pub(super) fn pulls(&self, theta: f64) -> bool {
        1.0 + (self.law.b - self.law.a) * ln(theta) > 0.0
    }

    /// One shortcut, given scaled.
    pub(super) fn path(&self, a_2: f64, a_3: f64) -> Path<'_> {
        Path::new(&self.ends, a_2, a_3)
    }

    /// `theta_0`, `theta_1`, their difference `theta_1 - theta_0`, and `t_f`.
    pub(super) fn ends(&self) -> [f64; 4] {
        [self.ends.theta_0.high, self.ends.theta_1.high, self.ends.rise.high, self.ends.t_f]
    }

    /// The motion of one shortcut, given scaled; `None` where it is infeasible.
    pub fn motion(&self, a_2: f64, a_3: f64) -> Option<Box<dyn Motion>> {
        let mut status = [Status::Infeasible];
        self.evaluate(&[a_2], &[a_3], Shortcuts { work: &mut [], v_min: &mut [], status: &mut status });
        let motion = motion::FreeCubic::new(self.law, self.ends, a_2, a_3);
        (status != [Status::Infeasible]).then(|| Box::new(motion) as Box<dyn Motion>)
    }

    /// Evaluates the shortcuts `(a_2[i], a_3[i])`, given scaled: `alpha_2 t_f` and `alpha_3 t_f^2`.
    ///
    /// As many as the shortest of `a_2`, `a_3` and `out.status` holds.
    pub fn evaluate(&self, a_2: &[f64], a_3: &[f64], out: Shortcuts<'_>) -> Effort {
        let mut effort = Effort::default();
        let mut panels = Vec::with_capacity(8);
        let count = a_2.len().min(a_3.len()).min(out.status.len());
        // Feasible shortcuts whose work is still due.
        let mut due = [0; BLOCK];
        let mut dues = 0;
        for first in (0..count).step_by(LANES) {
            let block = first..(first + LANES).min(count);
            let (mut a_2_lanes, mut a_3_lanes, mut v_lanes) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
            a_2_lanes[..block.len()].copy_from_slice(&a_2[block.clone()]);
            a_3_lanes[..block.len()].copy_from_slice(&a_3[block.clone()]);
            let status = screen(&self.ends, &a_2_lanes, &a_3_lanes, (!out.v_min.is_empty()).then_some(&mut v_lanes));
            for (lane, i) in block.enumerate() {
                out.status[i] = status[lane];
                if status[lane] == Status::Infeasible {
                    continue;
                }
                if let Some(v_min) = out.v_min.get_mut(i) {
                    *v_min = v_lanes[lane];
                }
                if i < out.work.len() {
                    due[dues] = i;
                    dues += 1;
                    if dues == BLOCK {
                        self.works(&due, a_2, a_3, out.work, &mut panels, &mut effort);
                        dues = 0;
                    }
                }
            }
        }
        self.works(&due[..dues], a_2, a_3, out.work, &mut panels, &mut effort);
        effort
    }

    /// The works of up to eight feasible shortcuts.
    fn works(
        &self,
        due: &[usize],
        a_2: &[f64],
        a_3: &[f64],
        work: &mut [f64],
        panels: &mut Vec<Panel>,
        effort: &mut Effort,
    ) {
        let Some(&first) = due.first() else { return };
        let (mut a_2_lanes, mut a_3_lanes) = ([a_2[first]; BLOCK], [a_3[first]; BLOCK]);
        for (lane, &i) in due.iter().enumerate() {
            (a_2_lanes[lane], a_3_lanes[lane]) = (a_2[i], a_3[i]);
        }
        let plan = plan(&self.ends, &a_2_lanes, &a_3_lanes, self.accuracy.enough(CHEAP));
        for (lane, &i) in due.iter().enumerate() {
            let path = Path::new(&self.ends, a_2[i], a_3[i]);
            let nodes = self.accuracy.nodes(plan.focal[lane]);
            let side = plan.side[lane];
            let power = plan.squarings[lane] > 0.0;
            let end = if power { side > 0.0 } else { self.ends.rise.high < 0.0 };
            work[i] = if nodes <= MOST_PLANNED && !self.is_faint(&path, !end) {
                let (centre, shift) = if end { (1.0, -1.0) } else { (0.0, 0.0) };
                effort.quadratures += 1;
                let panel = if power {
                    let map = Map::Power { side, gap: plan.gap[lane], squarings: plan.squarings[lane] as u32 };
                    Panel { centre, map, from: plan.from[lane], to: plan.to[lane], nodes }
                } else {
                    Panel { centre, map: Map::Line, from: shift, to: 1.0 + shift, nodes }
                };
                self.sum(&path, &panel, effort)
            } else {
                self.work(&path, panels, effort)
            };
        }
    }

    /// `W_s = int tau v dt`.
    fn work(&self, path: &Path, panels: &mut Vec<Panel>, effort: &mut Effort) -> f64 {
        panels.clear();
        let zeros = Zeros::of(path);
        if self.is_faint(path, false) || self.is_faint(path, true) {
            // Each half has its own expansions.
            choose(&zeros, 0.0, 0.5, &self.accuracy, 1, panels);
            choose(&zeros, 0.5, 1.0, &self.accuracy, 1, panels);
        } else {
            choose(&zeros, 0.0, 1.0, &self.accuracy, 0, panels);
        }
        effort.quadratures += 1;
        panels.iter().map(|panel| self.sum(path, panel, effort)).sum()
    }

    /// Whether theta at the start or at the end is so small that an expansion about the other end loses its digits.
    #[inline(always)]
    fn is_faint(&self, path: &Path, end: bool) -> bool {
        let [c0, c1, c2, c3] = path.theta().c;
        let size = c0.abs() + c1.abs() + c2.abs() + c3.abs();
        let theta = if end { self.ends.theta_1.high } else { self.ends.theta_0.high };
        size * f64::EPSILON > self.rounding * theta
    }

    /// The part of one panel in the work.
    #[inline(always)]
    fn sum(&self, path: &Path, panel: &Panel, effort: &mut Effort) -> f64 {
        let rule = rule(panel.nodes);
        effort.nodes += rule.x.len() as u32;
        // Where a zero is near, the digits of the small theta there count.
        let (theta, n) = if panel.nodes >= NEAR {
            path.about(panel.centre)
        } else if panel.centre == 1.0 {
            path.about_end()
        } else if panel.centre == 0.0 {
            path.about_start()
        } else {
            path.about(panel.centre)
        };
        let slice = Slice {
            constant: 1.0 - self.law.a * self.ln_t_f,
            a: self.law.a,
            slope: self.law.b - self.law.a,
            theta,
            n,
            middle: 0.5 * (panel.from + panel.to),
            half: 0.5 * (panel.to - panel.from),
        };
        slice.sum(panel.map, rule)
    }
}
