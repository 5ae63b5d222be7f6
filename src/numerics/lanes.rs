//! Eight numbers side by side: the unit in which kernels work, whatever the width of the machine's vectors.
//!
//! Loops over [`LANES`] are unrolled into vector instructions by the compiler. Sums run lane by lane and are folded in
//! one fixed order, so a result has the same bits at every vector width.

/// Lanes of a kernel.
pub const LANES: usize = 8;

/// One value a lane.
pub type Lanes = [f64; LANES];

/// The sum of all lanes, pairwise and in a fixed order.
#[inline(always)]
pub fn fold(sum: &Lanes) -> f64 {
    ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]))
}

/// The least of all lanes.
#[inline(always)]
pub fn least(values: &Lanes) -> f64 {
    let lower = |x: f64, y: f64| if y < x { y } else { x };
    let pair = |i: usize| lower(values[i], values[i + 4]);
    lower(lower(pair(0), pair(2)), lower(pair(1), pair(3)))
}
