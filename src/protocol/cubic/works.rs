//! The works of many shortcuts, each summed together with others of equal node count.

use super::bins::{BINS, Bins, CUT_BIN, nodes_of};
use super::cells::OWN_PLAN_BIN;
use super::path::Path;
use super::plan::{PlannedPanels, plan};
use super::queue::{Cuts, Queue};
use super::{Landscape, PerShortcut, SPAN_SHORTCUTS};
use crate::numerics::lanes::LANES;
use crate::protocol::SolverStats;

/// Works in progress. A shortcut waits for the plan of its cell, possibly for its own plan or that of its parts, and then for its sum.
pub(super) struct Works<'a> {
    due: Queue,
    alone: Queue,
    from_cells: PlannedPanels,
    own: PlannedPanels,
    sums: Sums<'a>,
}

/// Sums in progress: shortcuts cut in two, which wait for the plans of their parts, and shortcuts in bins.
struct Sums<'a> {
    of: &'a Landscape,
    work: &'a mut [f64],
    cut: Cuts,
    bins: &'a mut Bins,
    stats: SolverStats,
}

impl<'a> Works<'a> {
    /// An empty queue for shortcuts of a landscape, whose works are written to `work`.
    pub fn new(of: &'a Landscape, work: &'a mut [f64], bins: &'a mut Bins) -> Works<'a> {
        let sums = Sums { of, work, cut: Cuts::EMPTY, bins, stats: SolverStats::default() };
        let (from_cells, own) = (PlannedPanels::default(), PlannedPanels::default());
        Works { due: Queue::default(), alone: Queue::default(), from_cells, own, sums }
    }

    /// Adds the feasible shortcut at `index`, if its work is requested.
    #[inline(always)]
    pub fn push(&mut self, index: usize, a_2: f64, a_3: f64) {
        if index < self.sums.work.len() && self.due.push(index, a_2, a_3) {
            self.plan_due();
        }
    }

    /// Adds the feasible shortcuts from `first` on.
    pub fn push_span(&mut self, first: usize, a_2: &PerShortcut, a_3: &PerShortcut) {
        if self.sums.work.len() < first + SPAN_SHORTCUTS {
            for lane in 0..SPAN_SHORTCUTS {
                self.push(first + lane, a_2[lane], a_3[lane]);
            }
            return;
        }
        let indices: [usize; SPAN_SHORTCUTS] = std::array::from_fn(|lane| first + lane);
        let Works { alone, from_cells, own, sums, .. } = self;
        sums.plan_cells(&indices, [a_2, a_3], from_cells, (alone, own));
    }

    /// Sums the remaining shortcuts.
    pub fn finish(mut self) -> SolverStats {
        self.plan_due();
        let Works { mut alone, mut own, mut sums, .. } = self;
        sums.plan_alone(&mut alone, &mut own);
        sums.plan_parts();
        sums.bins.close(sums.of, sums.work);
        sums.stats
    }

    fn plan_due(&mut self) {
        let Works { due, alone, from_cells, own, sums } = self;
        if let Some((indices, places)) = due.take() {
            sums.plan_cells(indices, places, from_cells, (alone, own));
        }
    }
}

impl Sums<'_> {
    /// Plans shortcuts from their cells; other shortcuts wait for their own plan.
    fn plan_cells(
        &mut self,
        indices: &[usize],
        [a_2, a_3]: [&PerShortcut; 2],
        plan: &mut PlannedPanels,
        (alone, own): (&mut Queue, &mut PlannedPanels),
    ) {
        self.bins.cells.plan(&self.of.frame, a_2, a_3, plan);
        for (k, indices) in indices.chunks(LANES).enumerate() {
            let first = k * LANES;
            let bin = plan.bin[first];
            if bin != OWN_PLAN_BIN && indices.len() == LANES && plan.bin[first..first + LANES] == [bin; LANES] {
                self.settle_all(plan, first, indices, [a_2, a_3]);
                continue;
            }
            for (lane, &i) in (first..).zip(indices) {
                if plan.bin[lane] != OWN_PLAN_BIN {
                    self.settle(plan, lane, i, [a_2[lane], a_3[lane]]);
                } else if alone.push(i, a_2[lane], a_3[lane]) {
                    self.plan_alone(alone, own);
                }
            }
        }
    }

    /// Plans shortcuts one by one.
    fn plan_alone(&mut self, alone: &mut Queue, own: &mut PlannedPanels) {
        let Some((indices, [a_2, a_3])) = alone.take() else { return };
        let whole = [a_2, a_3, &[0.0; SPAN_SHORTCUTS], &[1.0; SPAN_SHORTCUTS]];
        plan(&self.of.ends, whole, &self.of.accuracy, own);
        for (lane, &i) in indices.iter().enumerate() {
            self.settle(own, lane, i, [a_2[lane], a_3[lane]]);
        }
    }

    /// Sums eight shortcuts of one bin, from lane `first` on, side by side.
    #[inline(always)]
    fn settle_all(&mut self, plan: &PlannedPanels, first: usize, indices: &[usize], places: [&PerShortcut; 2]) {
        self.stats.quadratures += LANES as u32;
        self.stats.nodes += LANES as u32 * nodes_of(plan.bin[first] as usize);
        self.bins.add_all(self.of, (plan, first), places, indices, self.work);
    }

    /// Adds the shortcut at `index` to the bin or queue of its plan.
    #[inline(always)]
    fn settle(&mut self, plan: &PlannedPanels, lane: usize, index: usize, place: [f64; 2]) {
        let bin = plan.bin[lane] as usize;
        if bin < CUT_BIN {
            self.work[index] = self.of.work_of_ends;
            self.stats.quadratures += 1;
            self.stats.nodes += nodes_of(bin);
            self.bins.add(self.of, (plan, lane), [place[0], place[1], 0.0, 1.0], index, self.work);
        } else if self.cut.push(index, place, plan.cut[lane]) {
            self.plan_parts();
        }
    }

    /// Plans the parts of shortcuts that are cut in two. Shortcuts that need more are summed alone.
    fn plan_parts(&mut self) {
        let Sums { of, work, cut, bins, stats } = self;
        let Some((indices, parts)) = cut.take() else { return };
        let mut made = PlannedPanels::default();
        plan(&of.ends, parts, &of.accuracy, &mut made);
        let [a_2, a_3, low, high] = parts;
        for (k, &i) in indices.iter().enumerate() {
            stats.quadratures += 1;
            let lanes = [k, k + SPAN_SHORTCUTS / 2];
            let path = Path::new(&of.ends, a_2[k], a_3[k]);
            // A shortcut may be fastest at the cut.
            let near = path.is_within(if low[k] == 0.0 { high[k] } else { low[k] }, of.accuracy.longest);
            if near && lanes.iter().all(|&lane| made.bin[lane] < BINS as u32) {
                work[i] = of.work_of_ends;
                for lane in lanes {
                    stats.nodes += nodes_of(made.bin[lane] as usize);
                    bins.add(of, (&made, lane), [a_2[lane], a_3[lane], low[lane], high[lane]], i, work);
                }
            } else {
                work[i] = of.work_of_ends + of.work(&path, stats);
            }
        }
    }
}
