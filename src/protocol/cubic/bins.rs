//! Bins of shortcuts with equal numbers of nodes, of which eight are summed side by side.

use std::cell::Cell;

use multiversion::multiversion;

use super::cells::CellCache;
use super::panel_batch::{NodeBuffer, PanelBatch, Prepared, prepare};
use super::plan::PlannedPanels;
use super::rules::NODE_STEP;
use super::{Landscape, PerShortcut};
use crate::model::StateLaw;
use crate::numerics::gauss::{MAX_HALF, primitive};
use crate::numerics::lanes::LANES;

/// Number of bins: 4, 8, … 80 nodes, those of the rules with a primitive. A panel with more nodes is cut.
pub(super) const BINS: usize = 2 * MAX_HALF / NODE_STEP;

/// Bin from which a panel over all of `[0, 1]` is cut. Measured: two parts are cheaper there (`cargo bench --bench landscape`).
pub(super) const CUT_BIN: usize = 16;

/// The nodes of a bin.
#[inline(always)]
pub(super) fn nodes_of(bin: usize) -> u32 {
    NODE_STEP as u32 * (bin as u32 + 1)
}

/// Full bundles that are summed together. Measured: all are prepared first, so that their logarithms overlap in the pipeline of the processor
/// (`cargo bench --bench landscape`).
const MAX_FULL_BUNDLES: usize = 8;

/// Bundles of all bins, and full bundles.
const MAX_BUNDLES: usize = BINS + MAX_FULL_BUNDLES;

/// A bundle, the indices of its shortcuts, and its bin.
#[derive(Debug, Clone, Copy)]
struct PendingBatch {
    panel_batch: PanelBatch,
    indices: [usize; LANES],
    count: usize,
    bin: usize,
    /// Whether every panel covers all of `[0, 1]`.
    whole: bool,
}

/// All bins.
#[derive(Debug, Clone)]
pub(super) struct Bins {
    loads: [PendingBatch; MAX_BUNDLES],
    /// Indices of loads: the one that each bin fills, then full ones, then empty ones.
    order: [usize; MAX_BUNDLES],
    /// The number of full bundles.
    ready: usize,
    prepared: [Prepared; MAX_FULL_BUNDLES],
    space: NodeBuffer,
    /// Plans of cells of the last landscape.
    pub cells: CellCache,
}

thread_local! {
    /// Memory for the next call, since clearing it takes longer than a few sums.
    static SPARE: Cell<Option<Box<Bins>>> = const { Cell::new(None) };
}

impl Bins {
    /// Empty bins, in the memory of the last bins of this thread, if any.
    pub fn take() -> Box<Bins> {
        SPARE.take().unwrap_or_else(|| Box::new(Bins::new()))
    }

    /// Keeps the memory of empty bins for the next call.
    pub fn keep(self: Box<Bins>) {
        SPARE.set(Some(self));
    }

    fn new() -> Bins {
        let load =
            PendingBatch { panel_batch: PanelBatch::default(), indices: [0; LANES], count: 0, bin: 0, whole: false };
        let order = std::array::from_fn(|i| i);
        Bins {
            loads: [load; MAX_BUNDLES],
            order,
            ready: 0,
            prepared: [Prepared::default(); MAX_FULL_BUNDLES],
            space: NodeBuffer::EMPTY,
            cells: CellCache::new(),
        }
    }

    /// Adds a panel of the shortcut at `index` to its bin, given by its lane of a plan, its coordinates and bounds. A full bin is summed into
    /// the works.
    #[inline(always)]
    pub fn add(
        &mut self,
        of: &Landscape,
        (plan, lane): (&PlannedPanels, usize),
        panel: [f64; 4],
        index: usize,
        work: &mut [f64],
    ) {
        let bin = plan.bin[lane] as usize;
        let PendingBatch { panel_batch, indices, count, .. } = &mut self.loads[self.order[bin]];
        let last = *count % LANES;
        (panel_batch.a_2[last], panel_batch.a_3[last]) = (panel[0], panel[1]);
        (panel_batch.low[last], panel_batch.high[last]) = (panel[2], panel[3]);
        (panel_batch.side[last], panel_batch.gap[last]) = (plan.side[lane], plan.gap[lane]);
        panel_batch.squarings[last] = plan.squarings[lane];
        (panel_batch.from[last], panel_batch.to[last]) = (plan.from[lane], plan.to[lane]);
        indices[last] = index;
        *count = last + 1;
        if *count == LANES {
            self.empty(of, bin, work);
        }
    }

    /// Adds eight shortcuts of one bin, from lane `first` on, over all of `[0, 1]`, as a bundle.
    #[inline(always)]
    pub fn add_all(
        &mut self,
        of: &Landscape,
        (plan, first): (&PlannedPanels, usize),
        [a_2, a_3]: [&PerShortcut; 2],
        indices: &[usize],
        work: &mut [f64],
    ) {
        let load = &mut self.loads[self.order[BINS + self.ready]];
        fill(&mut load.panel_batch, plan, first, a_2, a_3);
        load.indices.copy_from_slice(indices);
        (load.count, load.bin, load.whole) = (LANES, plan.bin[first] as usize, true);
        self.ready += 1;
        if self.ready == MAX_FULL_BUNDLES {
            self.sum(of, work);
        }
    }

    /// Sums the remaining bundles.
    pub fn close(&mut self, of: &Landscape, work: &mut [f64]) {
        for bin in 0..BINS {
            self.empty(of, bin, work);
        }
        self.sum(of, work);
    }

    /// Replaces the load of a bin, if not empty, by an empty one.
    fn empty(&mut self, of: &Landscape, bin: usize, work: &mut [f64]) {
        let load = &mut self.loads[self.order[bin]];
        if load.count > 0 {
            (load.bin, load.whole) = (bin, false);
            self.order.swap(bin, BINS + self.ready);
            self.ready += 1;
            if self.ready == MAX_FULL_BUNDLES {
                self.sum(of, work);
            }
        }
    }

    /// Sums the full bundles.
    fn sum(&mut self, of: &Landscape, work: &mut [f64]) {
        let ready = &self.order[BINS..BINS + std::mem::take(&mut self.ready)];
        for (&load, prepared) in ready.iter().zip(&mut self.prepared) {
            prepare(&self.loads[load].panel_batch, &of.ends, &of.friction, prepared);
        }
        for (&load, prepared) in ready.iter().zip(&self.prepared) {
            let PendingBatch { indices, count, bin, whole, .. } = &mut self.loads[load];
            let rule = primitive(nodes_of(*bin) as usize / 2);
            let mut works = prepared.works(of.state, rule, &mut self.space);
            if of.state != StateLaw::Ageing {
                // Velocities are not in units of t_f.
                let of_ends = if *whole { of.work_of_ends } else { 0.0 };
                works = works.map(|work| of_ends + of.t_f * work);
            }
            let (count, first) = (std::mem::take(count), indices[0]);
            if *whole && indices.iter().enumerate().all(|(lane, &i)| i == first + lane) {
                work[first..first + LANES].copy_from_slice(&works);
                continue;
            }
            for (work_of, &i) in works.iter().zip(&indices[..count]) {
                work[i] = if *whole { *work_of } else { work[i] + *work_of };
            }
        }
    }
}

/// A bundle of eight planned shortcuts from lane `first` on, over all of `[0, 1]`.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn fill(panel_batch: &mut PanelBatch, plan: &PlannedPanels, first: usize, a_2: &PerShortcut, a_3: &PerShortcut) {
    let lanes = first..first + LANES;
    panel_batch.a_2.copy_from_slice(&a_2[lanes.clone()]);
    panel_batch.a_3.copy_from_slice(&a_3[lanes.clone()]);
    (panel_batch.low, panel_batch.high) = ([0.0; LANES], [1.0; LANES]);
    panel_batch.side.copy_from_slice(&plan.side[lanes.clone()]);
    panel_batch.gap.copy_from_slice(&plan.gap[lanes.clone()]);
    panel_batch.squarings.copy_from_slice(&plan.squarings[lanes.clone()]);
    panel_batch.from.copy_from_slice(&plan.from[lanes.clone()]);
    panel_batch.to.copy_from_slice(&plan.to[lanes]);
}
