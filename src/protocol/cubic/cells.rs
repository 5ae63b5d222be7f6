//! One map for all shortcuts in a cell of the plane, and the number of nodes of each: most plans serve hundreds of neighbours.
//!
//! The landscape determines the cells, and a cell determines its plan, so a result never depends on neighbouring shortcuts. The zeros move
//! smoothly from one shortcut to the next. So ln rho, to which the number of nodes is inversely proportional, is interpolated between the
//! corners. Its deviations at the middles of the edges bound the interpolation error. A shortcut near the border of feasibility, or with many
//! nodes, has its own plan.

use std::ops::Range;

use multiversion::multiversion;

use super::bins::CUT_BIN;
use super::path::{Ends, Path};
use super::plan::{MIN_GAP, PAIRS, Places, PlannedPanels, rooted};
use super::rules::{MAX_CHEAP_NODES, MAX_ZERO_DISTANCE, NODE_STEP, NodeThresholds, ZEROS};
use super::{PerShortcut, SPAN_SHORTCUTS};
use crate::numerics::elementary::{INTEGER_SHIFT, rough_ln};

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
    key: CellKey,
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

/// Samples of a cell: its corners, then the middles of its edges.
const SAMPLES: [[f64; 2]; SAMPLE_COUNT] =
    [[-0.5, -0.5], [-0.5, 0.5], [0.5, -0.5], [0.5, 0.5], [0.0, -0.5], [0.0, 0.5], [-0.5, 0.0], [0.5, 0.0]];

/// Number of samples.
const SAMPLE_COUNT: usize = 8;

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

    /// Plans feasible shortcuts from their cells.
    pub fn plan(&mut self, frame: &CellInputs, a_2: &PerShortcut, a_3: &PerShortcut, plan: &mut PlannedPanels) {
        let CellOffsets { keys, local, mut starts } = locate(frame.scale, a_2, a_3);
        while starts != 0 {
            let from = starts.trailing_zeros() as usize;
            starts &= starts - 1;
            let to = SPAN_SHORTCUTS.min(starts.trailing_zeros() as usize);
            write(self.cell(frame, [keys[0][from], keys[1][from]]), &local, from..to, plan);
        }
    }

    /// The plan of a cell, from the cache if it is there.
    fn cell(&mut self, frame: &CellInputs, key: CellKey) -> &CellPlan {
        let slot = key[0].wrapping_mul(37).wrapping_add(key[1]) as usize % CACHED_CELLS;
        let cell = &mut self.of[slot];
        if cell.key != key || cell.age != self.age {
            *cell = CellPlan { age: self.age, ..chart(frame, key) };
        }
        cell
    }
}

/// The cells of shortcuts, and the distances from the cell centres.
struct CellOffsets {
    keys: [[u64; SPAN_SHORTCUTS]; 2],
    local: [PerShortcut; 2],
    /// Bit mask of the lanes whose cell differs from that of the previous lane.
    starts: u32,
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn locate(scale: f64, a_2: &PerShortcut, a_3: &PerShortcut) -> CellOffsets {
    let mut located = CellOffsets { keys: [[0; SPAN_SHORTCUTS]; 2], local: [[0.0; SPAN_SHORTCUTS]; 2], starts: 1 };
    for ((keys, local), a) in located.keys.iter_mut().zip(&mut located.local).zip([a_2, a_3]) {
        for i in 0..SPAN_SHORTCUTS {
            let x = a[i] * scale;
            let middle = x + INTEGER_SHIFT;
            keys[i] = middle.to_bits();
            local[i] = x - (middle - INTEGER_SHIFT);
        }
    }
    let [i, j] = &located.keys;
    for lane in 1..SPAN_SHORTCUTS {
        let other = (i[lane] != i[lane - 1]) | (j[lane] != j[lane - 1]);
        located.starts |= u32::from(other) << lane;
    }
    located
}

/// Writes the plans of shortcuts of a cell.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn write(cell: &CellPlan, [u, v]: &[PerShortcut; 2], lanes: Range<usize>, plan: &mut PlannedPanels) {
    let [p0, p1, p2, p3] = cell.pace;
    for ((bin, u), v) in plan.bin[lanes.clone()].iter_mut().zip(&u[lanes.clone()]).zip(&v[lanes.clone()]) {
        let pace = p0 + u * p1 + v * (p2 + u * p3);
        // The sufficient number of steps, rounded up; the first bin is one step.
        let last = (1.0 / pace - 0.5) + INTEGER_SHIFT;
        *bin = if pace > cell.least { last.to_bits() as u32 } else { OWN_PLAN_BIN };
    }
    plan.side[lanes.clone()].fill(cell.side);
    plan.gap[lanes.clone()].fill(cell.gap);
    plan.squarings[lanes.clone()].fill(cell.squarings);
    plan.from[lanes.clone()].fill(cell.from);
    plan.to[lanes].fill(cell.to);
}

/// Plans a cell.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn chart(frame: &CellInputs, key: CellKey) -> CellPlan {
    let CellInputs { ends, accuracy, scale } = frame;
    let own = CellPlan { key, ..CellPlan::default() };
    let centre = key.map(|bits| f64::from_bits(bits) - INTEGER_SHIFT);
    let [a_2, a_3] = [0, 1].map(|k| SAMPLES.map(|sample| (centre[k] + sample[k]) * (1.0 / scale)));
    let places = Places::of(ends, &a_2, &a_3);
    let [straight, shadow] = places.nearest(&[0.0; SAMPLE_COUNT], &[1.0; SAMPLE_COUNT]);
    let straight = straight.map(|square| 2.0 * square.sqrt());
    // A map about the end that is nearer at all samples, as far beyond it as the projected zeros allow.
    let [first, last] = range(&shadow);
    let upper = first > 0.5;
    let gap = GAP_FRACTION * if upper { first - 1.0 } else { -last }.max(0.0);
    let (near, far) = (gap.sqrt(), (1.0 + gap).sqrt());
    let squared = squared(&places, upper, gap, [near, far]);
    let [lowest, highest] = range(&squared);
    let is_squared = lowest > range(&straight)[0];
    let one_map = !is_squared || ((gap == 0.0) | (gap >= MIN_GAP)) & (gap <= 1.0);
    // Coordinates of farther cells lose digits.
    let meant = centre[0].abs() + centre[1].abs() < MAX_ZERO_DISTANCE;
    if (last > 0.5) != upper || !one_map || !meant || places.doubt != [0.0; SAMPLE_COUNT] {
        return own;
    }
    let (focal, cell) = if is_squared {
        let side = if upper { 1.0 } else { -1.0 };
        (squared, CellPlan { side, gap, squarings: 1.0, from: near, to: far, ..own })
    } else {
        (straight, CellPlan { side: if ends.rise.high < 0.0 { 1.0 } else { -1.0 }, to: 1.0, ..own })
    };
    let mean = ends.t_f - ends.rise.high;
    let kept = (0..CORNERS).all(|i| {
        let path = Path::new(ends, a_2[i], a_3[i]);
        // The mean of n is a lower bound of the sum of the magnitudes of its coefficients.
        path.is_sound(cell.side > 0.0, 0.0, -cell.side, accuracy) & (accuracy.rounding * mean >= 3.0 * path.slack())
    });
    if !kept {
        return own;
    }
    let pace = interpolated(focal.map(|focal| {
        let excess = 0.5 * (focal - 2.0);
        let excess = if excess > 0.0 { excess } else { 0.0 };
        rough_ln(1.0 + excess + (excess * (2.0 + excess)).sqrt()) / accuracy.pace
    }));
    // Where the centre of the map itself limits a focal sum, a larger power might help.
    let is_limited = is_squared && highest - 2.0 > 2.0 * near / (far - near);
    let most = if is_limited { MAX_CHEAP_NODES / NODE_STEP } else { CUT_BIN };
    pace.map_or(own, |pace| CellPlan { pace, least: 1.0 / most as f64, ..cell })
}

/// The least and the greatest of some numbers.
#[inline(always)]
fn range(values: &[f64; SAMPLE_COUNT]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &x| [low.min(x), high.max(x)])
}

/// The focal sums of the samples for the map `r ± s^2` with the centre `gap` beyond an end.
#[inline(always)]
fn squared(places: &Places<SAMPLE_COUNT>, upper: bool, gap: f64, [near, far]: [f64; 2]) -> [f64; SAMPLE_COUNT] {
    let mut least = [f64::MAX; SAMPLE_COUNT];
    for k in 0..ZEROS {
        for (least, (re, y)) in least.iter_mut().zip(places.re[k].iter().zip(&places.im[k])) {
            let x = gap + if upper { 1.0 - re } else { *re };
            let size = if PAIRS.contains(&k) { (x * x + y * y).sqrt() } else { x.abs() };
            let (_, sum) = rooted(size, x, near, far);
            *least = if sum < *least { sum } else { *least };
        }
    }
    least.map(|square| 2.0 * square.sqrt() / (far - near))
}

/// ln rho over a cell from its samples; `None` if it is not smooth enough.
#[inline(always)]
fn interpolated([mm, mp, pm, pp, m_low, m_high, low_m, high_m]: [f64; SAMPLE_COUNT]) -> Option<[f64; 4]> {
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
