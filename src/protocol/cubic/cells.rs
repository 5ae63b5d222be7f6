//! One map for all shortcuts in a cell of the plane, and the number of nodes of each: most plans serve hundreds of neighbours.
//!
//! The landscape determines the cells, and a cell determines its plan, so a result never depends on neighbouring shortcuts. The zeros move
//! smoothly from one shortcut to the next. So ln rho, to which the number of nodes is inversely proportional, is interpolated between the
//! corners. Its deviations at the middles of the edges bound the interpolation error. A shortcut near the border of feasibility, or with many
//! nodes, has its own plan.

use multiversion::multiversion;

use super::bins::CUT_BIN;
use super::path::{Ends, Path};
use super::plan::{MIN_GAP, PAIRS, Places, PlannedPanels, SINGLE_PRECISION_ERROR, nearest, places, rooted};
use super::rules::{MAX_CHEAP_NODES, MAX_ZERO_DISTANCE, NODE_STEP, NodeThresholds, ZEROS};
use super::{PerShortcut, SPAN_SHORTCUTS};
use crate::numerics::elementary::{INTEGER_SHIFT, rough_ln};
use crate::numerics::lanes::{LANES, Vector};

/// A cache of the plans of the last used cells of a landscape.
#[derive(Debug, Clone)]
pub(super) struct CellCache {
    frame: Option<CellInputs>,
    /// The age of the current frame.
    age: u64,
    of: [CellPlan; CACHED_CELLS],
}

/// The inputs that determine the cells.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CellInputs {
    ends: Ends,
    accuracy: NodeThresholds,
    /// Cells per unit of either coordinate.
    scale: f64,
}

/// The plan of one cell.
#[derive(Debug, Clone, Copy, Default)]
struct CellPlan {
    place: CellKey,
    /// The age of its frame.
    age: u64,
    /// ln rho in units of the value that needs [`NODE_STEP`] nodes, as coefficients of 1, `u`, `v` and `u v` with the distances `u` and `v` from
    /// the centre.
    pace: [f64; 4],
    /// The value of ln rho below which a shortcut needs its own plan; 0 if all shortcuts of the cell do.
    least: f64,
    side: f64,
    gap: f64,
    squarings: f64,
    /// Bounds of the mapped variable.
    from: f64,
    to: f64,
}

/// The key of a cell: the bits of its centre.
type CellKey = [u64; 2];

/// Cells in the cache. Chosen: the cells of two or three rows of a map.
const CACHED_CELLS: usize = 64;

/// Cells that are planned together, each from all its samples.
const CELLS_PER_PLAN: usize = SPAN_SHORTCUTS / SAMPLES.len();

/// Samples of a cell: its corners, then the middles of its edges.
const SAMPLES: [[f64; 2]; 8] =
    [[-0.5, -0.5], [-0.5, 0.5], [0.5, -0.5], [0.5, 0.5], [0.0, -0.5], [0.0, 0.5], [-0.5, 0.0], [0.5, 0.0]];

/// Number of corners among the samples.
const CORNERS: usize = 4;

/// Cells per power of 2 below the mean of n, the scale of the feasible set. Measured: more cells need more plans, fewer have worse maps (`cargo
/// bench --bench landscape`).
const CELLS_PER_UNIT: f64 = 8.0;

/// Distance of the centre of a map beyond the end, as a fraction of the distance of the nearest zero at the samples. Chosen: no zero of the cell
/// comes closer.
const GAP_FRACTION: f64 = 0.97;

/// Greatest relative error of the interpolated ln rho. Measured: an own plan costs more nodes than it saves (`cargo bench --bench landscape`).
const MAX_INTERPOLATION_RTOL: f64 = 0.12;

/// Bin number of a shortcut that needs its own plan.
pub(super) const OWN_PLAN_BIN: u32 = u32::MAX;

impl CellInputs {
    /// The frame of the landscape between `ends`.
    pub fn new(ends: &Ends, accuracy: &NodeThresholds) -> CellInputs {
        let mean = ends.t_f - ends.rise.high;
        // The exponent of the mean only.
        let power = f64::from_bits(mean.to_bits() & 0x7FF0_0000_0000_0000);
        let scale = CELLS_PER_UNIT / power;
        CellInputs { ends: *ends, accuracy: accuracy.clone(), scale: if scale.is_normal() { scale } else { 1.0 } }
    }
}

impl CellCache {
    /// A cache without cells.
    pub fn new() -> CellCache {
        CellCache { frame: None, age: 0, of: [CellPlan::default(); CACHED_CELLS] }
    }

    /// Discards the cells of another frame.
    pub fn begin(&mut self, frame: &CellInputs) {
        if self.frame.as_ref() != Some(frame) {
            self.frame = Some(frame.clone());
            self.age += 1;
        }
    }

    /// The slot of a cell.
    #[inline(always)]
    fn slot([i, j]: CellKey) -> u32 {
        i.wrapping_mul(37).wrapping_add(j) as u32 % CACHED_CELLS as u32
    }

    #[inline(always)]
    fn holds(&self, slot: u32, place: CellKey) -> bool {
        let cell = &self.of[slot as usize];
        cell.place == place && cell.age == self.age
    }

    /// Plans feasible shortcuts from their cells.
    pub fn plan(&mut self, frame: &CellInputs, a_2: &PerShortcut, a_3: &PerShortcut, plan: &mut PlannedPanels) {
        let located = locate(frame.scale, a_2, a_3);
        let (mut runs, mut count) = ([LaneRun { from: 0, slot: 0 }; SPAN_SHORTCUTS], 0);
        let (mut missing, mut lost) = ([[0; 2]; SPAN_SHORTCUTS], 0);
        // The previous cell, and the cell before the last missing one.
        let (mut last, mut before) = (located.place(0), located.place(0));
        let mut starts = located.starts;
        while starts != 0 {
            let from = starts.trailing_zeros();
            starts &= starts - 1;
            let place = located.place(from as usize);
            let slot = CellCache::slot(place);
            runs[count] = LaneRun { from, slot };
            count += 1;
            if !self.holds(slot, place) {
                missing[lost] = place;
                lost += 1;
                before = last;
            }
            last = place;
        }
        let (runs, missing) = (&runs[..count], &missing[..lost]);
        for places in missing.chunks(CELLS_PER_PLAN) {
            let mut padded = [places[0]; CELLS_PER_PLAN];
            padded[..places.len()].copy_from_slice(places);
            // Free lanes plan the cells that probably follow.
            let last = places[places.len() - 1];
            let step = [0, 1].map(|axis| last[axis].wrapping_sub(before[axis]));
            for next in places.len()..CELLS_PER_PLAN {
                padded[next] = [0, 1].map(|axis| padded[next - 1][axis].wrapping_add(step[axis]));
            }
            for cell in chart(frame, &padded) {
                self.keep(cell);
            }
        }
        assemble(&self.of, runs, &located, plan);
        if missing.is_empty() {
            return;
        }
        // A slot contains only its last cell.
        for lane in 0..SPAN_SHORTCUTS {
            let place = located.place(lane);
            let slot = CellCache::slot(place);
            if !self.holds(slot, place) {
                let [cell, ..] = chart(frame, &[place; CELLS_PER_PLAN]);
                self.keep(cell);
            }
            self.of[slot as usize].write(located.local[0][lane], located.local[1][lane], lane, plan);
        }
    }

    fn keep(&mut self, cell: CellPlan) {
        self.of[CellCache::slot(cell.place) as usize] = CellPlan { age: self.age, ..cell };
    }
}

/// A run of neighbouring lanes in one cell.
#[derive(Clone, Copy)]
struct LaneRun {
    from: u32,
    slot: u32,
}

/// The cells of shortcuts, and the distances from the cell centres.
struct CellOffsets {
    places: [[u64; SPAN_SHORTCUTS]; 2],
    local: [PerShortcut; 2],
    /// Bit mask of the lanes whose cell differs from that of the previous lane.
    starts: u32,
}

impl CellOffsets {
    #[inline(always)]
    fn place(&self, lane: usize) -> CellKey {
        [self.places[0][lane], self.places[1][lane]]
    }
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn locate(scale: f64, a_2: &PerShortcut, a_3: &PerShortcut) -> CellOffsets {
    let mut located = CellOffsets { places: [[0; SPAN_SHORTCUTS]; 2], local: [[0.0; SPAN_SHORTCUTS]; 2], starts: 1 };
    for ((places, local), a) in located.places.iter_mut().zip(&mut located.local).zip([a_2, a_3]) {
        for i in 0..SPAN_SHORTCUTS {
            let x = a[i] * scale;
            let middle = x + INTEGER_SHIFT;
            places[i] = middle.to_bits();
            local[i] = x - (middle - INTEGER_SHIFT);
        }
    }
    let [i, j] = &located.places;
    for lane in 1..SPAN_SHORTCUTS {
        let other = (i[lane] != i[lane - 1]) | (j[lane] != j[lane - 1]);
        located.starts |= u32::from(other) << lane;
    }
    located
}

impl CellPlan {
    /// The plan of a shortcut.
    #[inline(always)]
    fn write(&self, u: f64, v: f64, lane: usize, plan: &mut PlannedPanels) {
        let [p0, p1, p2, p3] = self.pace;
        plan.bin[lane] = bin(p0 + u * p1 + v * (p2 + u * p3), self.least);
        (plan.side[lane], plan.gap[lane], plan.squarings[lane]) = (self.side, self.gap, self.squarings);
        (plan.from[lane], plan.to[lane]) = (self.from, self.to);
    }
}

/// The bin of a shortcut of a cell.
#[inline(always)]
fn bin(pace: f64, least: f64) -> u32 {
    // The sufficient number of steps, rounded up; the first bin is one step.
    let last = (1.0 / pace - 0.5) + INTEGER_SHIFT;
    if pace > least { last.to_bits() as u32 } else { OWN_PLAN_BIN }
}

/// Writes the plans of shortcuts of cells.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn assemble(cells: &[CellPlan; CACHED_CELLS], runs: &[LaneRun], located: &CellOffsets, plan: &mut PlannedPanels) {
    let from = |run: usize| runs.get(run).map_or(SPAN_SHORTCUTS, |run| run.from as usize);
    let cell = |run: usize| &cells[runs[run].slot as usize % CACHED_CELLS];
    let mut run = 0;
    for start in (0..SPAN_SHORTCUTS).step_by(LANES) {
        let lanes = start..start + LANES;
        while from(run + 1) <= start {
            run += 1;
        }
        if from(run + 2) < lanes.end {
            for lane in lanes {
                while from(run + 1) <= lane {
                    run += 1;
                }
                cell(run).write(located.local[0][lane], located.local[1][lane], lane, plan);
            }
            continue;
        }
        // The lanes have at most two cells; the border between them.
        let border = from(run + 1).min(lanes.end);
        let (one, other) = (cell(run), cell(if border < lanes.end { run + 1 } else { run }));
        let beyond = ORDER - Vector::splat((border - start) as f64);
        let pick = |one: f64, other: f64| beyond.map(|beyond| if beyond > 0.0 { other } else { one });
        let mut local = [Vector::splat(0.0); 2];
        for (local, all) in local.iter_mut().zip(&located.local) {
            local.0.copy_from_slice(&all[lanes.clone()]);
        }
        let [p0, p1, p2, p3]: [Vector; 4] = std::array::from_fn(|k| pick(one.pace[k], other.pace[k]));
        let [u, v] = local;
        let pace = p0 + u * p1 + v * (p2 + u * p3);
        let least = pick(one.least, other.least);
        for lane in 0..LANES {
            plan.bin[start + lane] = bin(pace.0[lane], least.0[lane]);
        }
        plan.side[lanes.clone()].copy_from_slice(&pick(one.side, other.side).0);
        plan.gap[lanes.clone()].copy_from_slice(&pick(one.gap, other.gap).0);
        plan.squarings[lanes.clone()].copy_from_slice(&pick(one.squarings, other.squarings).0);
        plan.from[lanes.clone()].copy_from_slice(&pick(one.from, other.from).0);
        plan.to[lanes].copy_from_slice(&pick(one.to, other.to).0);
    }
}

/// The centres of the lanes of a vector.
const ORDER: Vector = Vector([0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5]);

/// Copies one value per cell to all its samples.
#[inline(always)]
fn spread<T: Copy>(of: [T; CELLS_PER_PLAN]) -> [T; SPAN_SHORTCUTS] {
    let mut all = [of[0]; SPAN_SHORTCUTS];
    for places in all.chunks_exact_mut(CELLS_PER_PLAN) {
        places.copy_from_slice(&of);
    }
    all
}

/// The least value of each cell.
#[inline(always)]
fn lowest(values: &[f32; SPAN_SHORTCUTS]) -> [f32; CELLS_PER_PLAN] {
    let mut lowest = [f32::MAX; CELLS_PER_PLAN];
    for places in values.chunks_exact(CELLS_PER_PLAN) {
        for c in 0..CELLS_PER_PLAN {
            lowest[c] = if places[c] < lowest[c] { places[c] } else { lowest[c] };
        }
    }
    lowest
}

/// The coefficients at the samples of cells of this size.
#[inline(always)]
fn samples(middles: &[[f64; CELLS_PER_PLAN]; 2], size: f64) -> [PerShortcut; 2] {
    let (mut a_2, mut a_3) = (spread(middles[0]), spread(middles[1]));
    for (sample, [u, v]) in SAMPLES.into_iter().enumerate() {
        for i in sample * CELLS_PER_PLAN..(sample + 1) * CELLS_PER_PLAN {
            (a_2[i], a_3[i]) = ((a_2[i] + u) * size, (a_3[i] + v) * size);
        }
    }
    [a_2, a_3]
}

/// Plans cells.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn chart(frame: &CellInputs, cells: &[CellKey; CELLS_PER_PLAN]) -> [CellPlan; CELLS_PER_PLAN] {
    let CellInputs { ends, accuracy, scale } = frame;
    let middles = [0, 1].map(|k| std::array::from_fn(|c| f64::from_bits(cells[c][k]) - INTEGER_SHIFT));
    let [a_2, a_3] = samples(&middles, 1.0 / scale);
    let Places { re, im, doubt } = places::<f32>(ends, &a_2, &a_3);
    let (mut straight, shadow) = nearest(&re, &im, &[0.0; SPAN_SHORTCUTS], &[1.0; SPAN_SHORTCUTS]);
    for straight in &mut straight {
        *straight = 2.0 * straight.sqrt();
    }
    let centres = Centres::of(&shadow);
    let Squared { focal: squared, room } = Squared::of(&re, &im, &centres);
    let mut gain = [0.0f32; CELLS_PER_PLAN];
    for (gain, (squared, straight)) in gain.iter_mut().zip(lowest(&squared).into_iter().zip(lowest(&straight))) {
        *gain = squared - straight;
    }
    let (gains, sides) = (spread(gain), spread(centres.side));
    let (mut paces, mut lost, mut unsure) = ([0.0; SPAN_SHORTCUTS], [0.0f32; SPAN_SHORTCUTS], [0.0f32; CELLS_PER_PLAN]);
    let steady = if ends.rise.high < 0.0 { 1.0 } else { -1.0 };
    let mean = ends.t_f - ends.rise.high;
    for i in 0..SPAN_SHORTCUTS {
        let focal = if gains[i] > 0.0 { squared[i] } else { straight[i] };
        // The margin for errors of the zeros.
        let excess = (f64::from(focal) - 2.0) * (0.5 / (1.0 + SINGLE_PRECISION_ERROR));
        let excess = if excess > 0.0 { excess } else { 0.0 };
        paces[i] = rough_ln(1.0 + excess + (excess * (2.0 + excess)).sqrt()) / accuracy.pace;
    }
    for i in 0..CORNERS * CELLS_PER_PLAN {
        let path = Path::new(ends, a_2[i], a_3[i]);
        let side = if gains[i] > 0.0 { f64::from(sides[i]) } else { steady };
        // The mean of n is a lower bound of the sum of the magnitudes of its coefficients.
        let kept = path.is_sound(side > 0.0, 0.0, -side, accuracy) & (accuracy.rounding * mean >= 3.0 * path.slack());
        lost[i] = if kept { 0.0 } else { 1.0 };
    }
    for (lost, doubt) in lost.chunks_exact(CELLS_PER_PLAN).zip(doubt.chunks_exact(CELLS_PER_PLAN)) {
        for c in 0..CELLS_PER_PLAN {
            unsure[c] += lost[c] + doubt[c];
        }
    }
    std::array::from_fn(|c| {
        let squared = gain[c] > 0.0;
        let (side, gap) = if squared { (centres.side[c], centres.gap[c]) } else { (steady as f32, 0.0) };
        let one_map = !squared || centres.common[c] & ((gap == 0.0) | (gap >= MIN_GAP as f32)) & (gap <= 1.0);
        // Coordinates of farther cells lose digits.
        let meant = middles[0][c].abs() + middles[1][c].abs() < MAX_ZERO_DISTANCE;
        let none = CellPlan { place: cells[c], ..CellPlan::default() };
        if !(unsure[c] == 0.0 && one_map && meant) {
            return none;
        }
        let (side, gap) = (f64::from(side), f64::from(gap));
        let (from, to) = if squared { (gap.sqrt(), (1.0 + gap).sqrt()) } else { (0.0, 1.0) };
        let most = if squared && room[c] < 0.0 { MAX_CHEAP_NODES / NODE_STEP } else { CUT_BIN };
        let squarings = if squared { 1.0 } else { 0.0 };
        let cell = CellPlan { side, gap, squarings, from, to, least: 1.0 / most as f64, ..none };
        interpolated(std::array::from_fn(|sample| paces[sample * CELLS_PER_PLAN + c]))
            .map_or(none, |pace| CellPlan { pace, ..cell })
    })
}

/// ln rho over a cell from its samples; `None` if it is not smooth enough.
#[inline(always)]
fn interpolated([mm, mp, pm, pp, m_low, m_high, low_m, high_m]: [f64; SAMPLES.len()]) -> Option<[f64; 4]> {
    let off = |middle: f64, one: f64, other: f64| (middle - 0.5 * (one + other)).abs();
    let greater = |a: f64, b: f64| if a > b { a } else { b };
    let off_u = greater(off(m_low, mm, pm), off(m_high, mp, pp));
    let off_v = greater(off(low_m, mm, mp), off(high_m, pm, pp));
    let slack = off_u + off_v;
    let lowest = -greater(greater(-mm, -mp), greater(-pm, -pp));
    (slack <= MAX_INTERPOLATION_RTOL * lowest).then_some([
        0.25 * ((mm + pp) + (mp + pm)) - slack,
        0.5 * ((pp - mm) + (pm - mp)),
        0.5 * ((pp - mm) - (pm - mp)),
        (pp + mm) - (pm + mp),
    ])
}

/// The centres of one map for each cell.
struct Centres {
    /// The end: +1 the upper, -1 the lower.
    side: [f32; CELLS_PER_PLAN],
    /// The distance beyond it.
    gap: [f32; CELLS_PER_PLAN],
    /// Whether all samples of a cell need the same end.
    common: [bool; CELLS_PER_PLAN],
}

impl Centres {
    /// The centres as far beyond an end as the projected zeros of the samples allow.
    #[inline(always)]
    fn of(shadow: &[f32; SPAN_SHORTCUTS]) -> Centres {
        let (mut above, mut below) = ([0.0f32; SPAN_SHORTCUTS], [0.0f32; SPAN_SHORTCUTS]);
        for i in 0..SPAN_SHORTCUTS {
            let upper = shadow[i] > 0.5;
            let beyond = if upper { shadow[i] - 1.0 } else { -shadow[i] };
            let beyond = if beyond > 0.0 { beyond } else { 0.0 };
            (above[i], below[i]) = if upper { (beyond, -1.0) } else { (-1.0, beyond) };
        }
        let (above, below) = (lowest(&above), lowest(&below));
        let mut centres =
            Centres { side: [0.0; CELLS_PER_PLAN], gap: [0.0; CELLS_PER_PLAN], common: [false; CELLS_PER_PLAN] };
        for c in 0..CELLS_PER_PLAN {
            let beyond = if above[c] >= 0.0 { above[c] } else { below[c] };
            centres.side[c] = if above[c] >= 0.0 { 1.0 } else { -1.0 };
            centres.gap[c] = GAP_FRACTION as f32 * beyond;
            centres.common[c] = (above[c] >= 0.0) | (below[c] >= 0.0);
        }
        centres
    }
}

/// The map `r ± s^2` for the samples of each cell.
struct Squared {
    /// The focal sums of the samples.
    focal: [f32; SPAN_SHORTCUTS],
    /// Negative where the centre of the map itself limits the focal sum, so that a larger power might help.
    room: [f32; CELLS_PER_PLAN],
}

impl Squared {
    #[inline(always)]
    fn of(re: &[[f32; SPAN_SHORTCUTS]; ZEROS], im: &[[f32; SPAN_SHORTCUTS]; ZEROS], centres: &Centres) -> Squared {
        let (side, gap) = (spread(centres.side), spread(centres.gap));
        let (mut near, mut far) = ([0.0f32; SPAN_SHORTCUTS], [0.0f32; SPAN_SHORTCUTS]);
        for i in 0..SPAN_SHORTCUTS {
            (near[i], far[i]) = (gap[i].sqrt(), (1.0 + gap[i]).sqrt());
        }
        let mut least = [f32::MAX; SPAN_SHORTCUTS];
        for k in 0..ZEROS {
            for i in 0..SPAN_SHORTCUTS {
                let end = if side[i] > 0.0 { 1.0 - re[k][i] } else { re[k][i] };
                let (x, y) = (gap[i] + end, im[k][i]);
                let size = if PAIRS.contains(&k) { (x * x + y * y).sqrt() } else { x.abs() };
                let (_, sum) = rooted(size, x, near[i], far[i]);
                least[i] = if sum < least[i] { sum } else { least[i] };
            }
        }
        let (mut focal, mut room) = ([0.0f32; SPAN_SHORTCUTS], [0.0f32; SPAN_SHORTCUTS]);
        for i in 0..SPAN_SHORTCUTS {
            focal[i] = 2.0 * least[i].sqrt() / (far[i] - near[i]);
            let ceiling = 4.0 * near[i] / (far[i] - near[i]);
            room[i] = 0.5 * ceiling - (focal[i] - 2.0);
        }
        Squared { focal, room: lowest(&room) }
    }
}
