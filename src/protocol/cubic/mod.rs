//! The cubic shortcuts: `theta = 1/v_i + alpha_2 t + alpha_3 t^2 + alpha_4 t^3`; `v` may jump at both ends.
//!
//! `alpha_4` follows from `theta(t_f) = 1/v_f`. A shortcut is a `path` of two polynomials. Their stationary points decide whether it is
//! feasible, and their zeros determine its quadrature (`rules`).

mod arcsinh;
mod bins;
mod cells;
mod exact;
mod friction;
mod kernel;
mod least_velocity;
mod motion;
mod other_laws;
mod panel_batch;
mod path;
mod plan;
mod product;
mod queue;
mod rules;
mod screen;
mod work_derivatives;
mod works;

use std::ops::Range;

use super::{Motion, SolverStats, Status};
use crate::model::{Friction, Law, StateLaw, Transition};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::ln;
use crate::numerics::gauss::rule;
use crate::numerics::lanes::{LANES, Lanes};
use bins::Bins;
use cells::CellInputs;
pub use exact::CubicPoint;
use friction::{FrictionBounds, decide};
use kernel::Slice;
use panel_batch::FrictionTerms;
pub(super) use path::{Ends, Path, rise};
use queue::Queue;
use rules::{MappedPanel, NodeThresholds, Zeros, choose};
use screen::{BATCH_SPANS, SpanDecision, end_velocities, inner_velocities, on_side, screen, settle};
pub(super) use work_derivatives::{Basis, WorkDerivatives};
use works::Works;

/// Shortcuts of a span, which are screened, searched and planned together. Chosen: enough to hide the latency of roots and quotients, few enough to
/// fill.
const SPAN_SHORTCUTS: usize = 32;

/// Loosest accuracy of a work. Measured: at looser ones the residues of a close pair of zeros exceed the margin of [`rules`].
const MAX_TOLERANCE: f64 = 1e-5;

/// One value for each shortcut of a span.
type PerShortcut = [f64; SPAN_SHORTCUTS];

/// The work landscape of one transition and duration over the plane of `(alpha_2, alpha_3)`.
#[derive(Debug, Clone)]
pub struct Landscape {
    law: Law,
    pub(super) state: StateLaw,
    friction: FrictionTerms,
    floors: FrictionBounds,
    /// The data common to all shortcuts.
    pub(super) ends: Ends,
    t_f: f64,
    ln_t_f: f64,
    /// Work that depends on the ends alone.
    work_of_ends: f64,
    frame: CellInputs,
    accuracy: NodeThresholds,
}

/// Buffers for the results of shortcuts, column by column, with one element for each shortcut.
#[derive(Debug)]
pub struct LandscapeBuffers<'a> {
    /// `W_s`; unchanged for infeasible shortcuts; empty if not requested.
    pub work: &'a mut [f64],
    /// Least velocity on `[0, t_f]`; unchanged for infeasible shortcuts; empty if not requested.
    pub v_min: &'a mut [f64],
    /// `Ok`, `BelowBound`, `NegativeFriction` or `Infeasible`.
    pub status: &'a mut [Status],
}

impl Landscape {
    /// The landscape of `transition` with duration `t_f`; works have a relative error of at most `rtol`.
    pub fn new(transition: &Transition, t_f: f64, rtol: f64) -> Self {
        Landscape::under(StateLaw::Ageing, transition, t_f, rtol)
    }

    /// The landscape of `transition` with duration `t_f` under an evolution law of the state; works have a relative error of at most `rtol`.
    pub fn under(state: StateLaw, transition: &Transition, t_f: f64, rtol: f64) -> Self {
        let tolerance = (0.5 * rtol).min(MAX_TOLERANCE);
        let Transition { law, v_i, v_f } = *transition;
        let ends = Ends::under(state, v_i, v_f, t_f, tolerance);
        let accuracy = NodeThresholds::new(tolerance, law, t_f * v_i.max(v_f));
        Landscape {
            law,
            state,
            friction: FrictionTerms::new(state, law, &ends),
            floors: FrictionBounds::under(state, law, &ends),
            ends,
            t_f,
            ln_t_f: ln(t_f),
            work_of_ends: if state == StateLaw::Slip { law.a * ln(v_f / v_i) } else { 0.0 },
            frame: CellInputs::new(&ends, &accuracy),
            accuracy,
        }
    }

    /// The motion of the shortcut with these scaled coefficients, under a form of friction; `None` if it is infeasible.
    pub fn motion(&self, place: [DoubleDouble; 2], friction: Friction) -> Option<Box<dyn Motion>> {
        let motion = motion::CubicMotion { of: self.clone(), place, friction };
        let is_feasible = motion.path().exact_status() != Status::Infeasible;
        is_feasible.then(|| Box::new(motion) as Box<dyn Motion>)
    }

    /// Evaluates the shortcuts with the scaled coefficients `a_2[i] = alpha_2 t_f` and `a_3[i] = alpha_3 t_f^2`.
    ///
    /// The number of shortcuts is the minimum of the lengths of `a_2`, `a_3` and `out.status`.
    pub fn evaluate(&self, a_2: &[f64], a_3: &[f64], out: LandscapeBuffers<'_>) -> SolverStats {
        let LandscapeBuffers { work, v_min, status } = out;
        let count = a_2.len().min(a_3.len()).min(status.len());
        let (velocities, works) = (count.min(v_min.len()), count.min(work.len()));
        let mut bins = Bins::take();
        bins.cells.begin(&self.frame);
        let mut evaluation = Evaluation {
            of: self,
            status,
            v_min: &mut v_min[..velocities],
            open: Queue::default(),
            works: Works::new(self, &mut work[..works], &mut bins),
            doubtful: Vec::new(),
        };
        for start in (0..count).step_by(SPAN_SHORTCUTS * BATCH_SPANS) {
            let group = start..(start + SPAN_SHORTCUTS * BATCH_SPANS).min(count);
            let settled = match (a_2[group.clone()].try_into(), a_3[group.clone()].try_into()) {
                (Ok(a_2), Ok(a_3)) if self.state == StateLaw::Ageing => settle(&self.ends, &self.floors, a_2, a_3),
                _ => [None; BATCH_SPANS],
            };
            for (first, common) in group.clone().step_by(SPAN_SHORTCUTS).zip(settled) {
                let span = first..(first + SPAN_SHORTCUTS).min(group.end);
                match (common, a_2[span.clone()].try_into(), a_3[span.clone()].try_into()) {
                    (Some(common), Ok(a_2), Ok(a_3)) => evaluation.span(first, a_2, a_3, common),
                    _ => {
                        for first in span.clone().step_by(LANES) {
                            let block = first..(first + LANES).min(span.end);
                            evaluation.block(first, &a_2[block.clone()], &a_3[block]);
                        }
                    }
                }
            }
        }
        evaluation.inner_velocities();
        let Evaluation { status, works, doubtful, .. } = evaluation;
        let stats = works.finish();
        // Up to this point the status determines on which side of v = 1 a velocity is.
        let is_negative = |i: usize| {
            let path = Path::new(&self.ends, a_2[i], a_3[i]);
            let is_ageing = self.state == StateLaw::Ageing;
            (if is_ageing { path.friction_min(self.law) } else { self.friction_min(&path) }) < 0.0
        };
        for open in doubtful {
            decide(open, self.law.b >= self.law.a, is_negative, status);
        }
        bins.keep();
        stats
    }

    /// Writes the greatest velocities of the shortcuts with a work.
    pub fn greatest_velocities(&self, a_2: &[f64], a_3: &[f64], status: &[Status], v_max: &mut [f64]) {
        for (i, v_max) in v_max.iter_mut().enumerate() {
            if !matches!(status[i], Status::Infeasible | Status::NotConverged) {
                *v_max = self.greatest_velocity(&Path::new(&self.ends, a_2[i], a_3[i]));
            }
        }
    }

    /// The work of a feasible shortcut.
    pub(super) fn whole_work(&self, path: &Path, stats: &mut SolverStats) -> f64 {
        stats.quadratures += 1;
        self.work_of_ends + self.work(path, stats)
    }

    /// `W_s = int tau v dt`, without the work of the ends.
    fn work(&self, path: &Path, stats: &mut SolverStats) -> f64 {
        let mut panels = Vec::with_capacity(8);
        let zeros = Zeros::of(path);
        if [false, true].iter().any(|&end| path.is_lossy(end, self.accuracy.rounding)) {
            // Each half has its own expansions.
            choose(&zeros, 0.0, 0.5, &self.accuracy, 1, &mut panels);
            choose(&zeros, 0.5, 1.0, &self.accuracy, 1, &mut panels);
        } else {
            choose(&zeros, 0.0, 1.0, &self.accuracy, 0, &mut panels);
        }
        panels.iter().map(|panel| self.sum(path, panel, stats)).sum()
    }

    /// The contribution of one panel to the work.
    #[inline(always)]
    fn sum(&self, path: &Path, panel: &MappedPanel, stats: &mut SolverStats) -> f64 {
        let rule = rule(panel.nodes);
        stats.nodes += rule.x.len() as u32;
        if self.state != StateLaw::Ageing {
            return other_laws::panel_sum(self, path, panel);
        }
        // Near a zero, the relative accuracy of the small theta matters.
        let (theta, n) = path.about(panel.centre);
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

/// The evaluation of one call: statuses, then least velocities, then works.
struct Evaluation<'a> {
    of: &'a Landscape,
    status: &'a mut [Status],
    v_min: &'a mut [f64],
    /// Shortcuts whose least velocity is not certain to be at an end.
    open: Queue,
    works: Works<'a>,
    /// Shortcuts with possibly negative friction: spans, which are on a line in the plane, and single ones.
    doubtful: Vec<Range<usize>>,
}

impl Evaluation<'_> {
    /// Adds a span of shortcuts from `first` on, with one status.
    #[inline(always)]
    fn span(
        &mut self,
        first: usize,
        a_2: &PerShortcut,
        a_3: &PerShortcut,
        SpanDecision { status, sound }: SpanDecision,
    ) {
        self.status[first..first + SPAN_SHORTCUTS].fill(status);
        if status == Status::Infeasible {
            return;
        }
        if !sound {
            self.doubtful.push(first..first + SPAN_SHORTCUTS);
        }
        let eights = a_2.as_chunks::<LANES>().0.iter().zip(a_3.as_chunks::<LANES>().0);
        for (eight, (a_2, a_3)) in eights.enumerate() {
            self.velocities(first + eight * LANES, a_2, a_3, &[status; LANES]);
        }
        self.works.push_span(first, a_2, a_3);
    }

    /// Adds up to eight shortcuts from `first` on, each with its own status.
    #[inline(always)]
    fn block(&mut self, first: usize, a_2: &[f64], a_3: &[f64]) {
        let ends = &self.of.ends;
        let block = first..first + a_2.len();
        let (mut a_2_lanes, mut a_3_lanes) = ([0.0; LANES], [0.0; LANES]);
        a_2_lanes[..a_2.len()].copy_from_slice(a_2);
        a_3_lanes[..a_3.len()].copy_from_slice(a_3);
        let mut found = screen(ends, &a_2_lanes, &a_3_lanes);
        if found.iter().all(|&found| found == Status::Infeasible) {
            self.status[block].fill(Status::Infeasible);
            return;
        }
        let unsure = self.of.floors.open(ends, &a_2_lanes, &a_3_lanes, &found);
        let unsure = block.clone().enumerate().filter(|(lane, _)| unsure & (1 << lane) != 0);
        self.doubtful.extend(unsure.map(|(_, i)| i..i + 1));
        if self.of.state == StateLaw::Ageing {
            self.status[block.clone()].copy_from_slice(&found[..block.len()]);
            self.velocities(first, &a_2_lanes, &a_3_lanes, &found);
        } else {
            // The velocity decides between the other two.
            let least = self.of.least_velocities(&a_2_lanes, &a_3_lanes, &found);
            for (found, (v, i)) in found.iter_mut().zip(least.into_iter().zip(block.clone())) {
                if *found != Status::Infeasible {
                    *found = if v < 1.0 { Status::BelowBound } else { Status::Ok };
                    self.v_min.get_mut(i).into_iter().for_each(|v_min| *v_min = v);
                }
            }
            self.status[block.clone()].copy_from_slice(&found[..block.len()]);
        }
        for (lane, i) in block.enumerate() {
            if self.status[i] != Status::Infeasible {
                self.works.push(i, a_2[lane], a_3[lane]);
            }
        }
    }

    /// Writes the least velocities of up to eight shortcuts from `first` on, if requested; uncertain ones are queued.
    #[inline(always)]
    fn velocities(&mut self, first: usize, a_2: &Lanes, a_3: &Lanes, found: &[Status; LANES]) {
        let mut least = [0.0; LANES];
        let Some(wanted) = self.v_min.get_mut(first..).filter(|wanted| !wanted.is_empty()) else { return };
        let left = end_velocities(&self.of.ends, a_2, a_3, found, &mut least);
        for ((v_min, least), found) in wanted.iter_mut().zip(least).zip(found) {
            *v_min = if *found == Status::Infeasible { *v_min } else { least };
        }
        self.search(first, left, a_2, a_3);
    }

    /// Queues the shortcuts from `first` on that have a bit in the mask for a search of their least velocities, if requested.
    #[inline(always)]
    fn search(&mut self, first: usize, mut left: u32, a_2: &Lanes, a_3: &Lanes) {
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            let i = first + lane;
            let wanted = i < self.v_min.len() && self.status[i] != Status::Infeasible;
            if wanted && self.open.push(i, a_2[lane], a_3[lane]) {
                self.inner_velocities();
            }
        }
    }

    /// Searches the least velocities of the queued shortcuts.
    fn inner_velocities(&mut self) {
        if let Some((indices, [a_2, a_3])) = self.open.take() {
            for (&i, found) in indices.iter().zip(inner_velocities(&self.of.ends, a_2, a_3)) {
                self.v_min[i] = on_side(found, self.status[i]);
            }
        }
    }
}
