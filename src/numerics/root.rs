//! A bracketed root finder that always terminates: Newton's method inside a shrinking bracket.

use super::MAX_STEPS;

/// The value and the slope of a function at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probe {
    /// Value; its sign determines on which side the root lies.
    pub value: f64,
    /// Derivative with respect to the argument.
    pub slope: f64,
}

/// Result of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// Best argument: one Newton step beyond the last probe.
    pub x: f64,
    /// Argument of the last probe.
    pub probed: f64,
    /// Result of the last probe.
    pub probe: Probe,
}

/// Greatest growth factor of a step towards an unbounded side. Chosen: ten steps reach a billion times farther.
const MAX_GROWTH: f64 = 8.0;

/// Relative residual after which one more step of [`newton`] leaves rounding. Derived: the step squares it, to 1e-18.
pub const LAST_STEP_RESIDUAL: f64 = 1e-9;

/// Finds the root of an increasing function inside `(low, high)`, from `start`. Both bounds may be infinite.
///
/// `probe(x)` returns `None` where the function is not defined; such points count as above the root if `undefined_above`, else as below it. The
/// search ends with the first probe whose absolute value is at most `enough`. One more Newton step, with an error of the order of `enough^2`,
/// gives the result. The search also ends if a change of sign is bracketed by neighbouring doubles, the limit set by rounding. It returns `None`
/// if the bracket is empty or shrinks to a point without a change of sign.
pub fn newton(
    mut probe: impl FnMut(f64) -> Option<Probe>,
    start: f64,
    bracket: (f64, f64),
    undefined_above: bool,
    enough: f64,
) -> Option<Root> {
    // Every probe has its own piece.
    let mut count = 0u32;
    let probe = |x| {
        count += 1;
        Some((probe(x)?, count))
    };
    newton_in_pieces(probe, start, bracket, undefined_above, enough, 0.0).map(|(root, _)| root)
}

/// [`newton`] for a piecewise smooth function: `probe` also returns the piece, and the result contains the piece of the last probe.
///
/// If the last two probes lie in one piece, the change of the slope between them corrects the step, which leaves an error of third order. The
/// search also ends if this error is at most `least`.
pub fn newton_in_pieces<Piece: Copy + PartialEq>(
    mut probe: impl FnMut(f64) -> Option<(Probe, Piece)>,
    start: f64,
    (mut low, mut high): (f64, f64),
    undefined_above: bool,
    enough: f64,
    least: f64,
) -> Option<(Root, Piece)> {
    if low.is_nan() || high.is_nan() || low >= high {
        return None;
    }
    let mut x = if start.is_nan() { middle(low, high) } else { start.clamp(low, high) };
    let mut last_steps = [f64::INFINITY; 2];
    let mut last: Option<(Probe, Piece)> = None;
    let mut below = false;
    let mut above = false;
    for _ in 0..MAX_STEPS {
        let p = probe(x).filter(|(p, _)| !p.value.is_nan());
        let step = match p {
            Some((p, piece)) => {
                let before = last.filter(|&(_, before)| before == piece).map(|(before, _)| before);
                let corrected = before.and_then(|before| corrected(&p, &before));
                let newton = if p.slope > 0.0 { -p.value / p.slope } else { f64::NAN };
                let step = corrected.map_or(newton, |(step, _)| step);
                if p.value.abs() <= enough || corrected.is_some_and(|(_, left)| left <= least) {
                    let x_next = if step.is_finite() { (x + step).clamp(low, high) } else { x };
                    return Some((Root { x: x_next, probed: x, probe: p }, piece));
                }
                if p.value > 0.0 {
                    (high, above) = (x, true);
                } else {
                    (low, below) = (x, true);
                }
                last = Some((p, piece));
                step
            }
            None if undefined_above => {
                high = x;
                f64::NAN
            }
            None => {
                low = x;
                f64::NAN
            }
        };
        // A step that leaves the bracket is replaced by a bisection, and so are two alternating steps that do not shrink by a quarter. Towards
        // an unbounded side, steps may grow.
        let [last_step, step_before] = last_steps;
        let open = if step > 0.0 { !above && high.is_infinite() } else { !below && low.is_infinite() };
        let step = if open && step.abs() >= last_step {
            step.abs().clamp(2.0 * last_step, MAX_GROWTH * last_step).copysign(step)
        } else {
            step
        };
        let shrinks = step.abs() < last_step && !(below && above && step.abs() > 0.75 * step_before);
        let next = x + step;
        let next = if next > low && next < high && (shrinks || open) { next } else { middle(low, high) };
        if next == x || !(next > low && next < high) {
            return p.filter(|_| below && above).map(|(probe, piece)| (Root { x, probed: x, probe }, piece));
        }
        last_steps = [(next - x).abs(), last_step];
        x = next;
    }
    None
}

/// The step to the root of the inverse function, from the slope at the last probe and its change since the previous probe; and the order of the
/// remaining error, in units of the value.
fn corrected(last: &Probe, before: &Probe) -> Option<(f64, f64)> {
    let (pace, pace_before) = (1.0 / last.slope, 1.0 / before.slope);
    let bend = (pace - pace_before) / (last.value - before.value);
    let correction = 0.5 * bend * last.value / pace;
    // Only small corrections are accepted: far from the root the slope may change irregularly.
    let sound = pace > 0.0 && pace_before > 0.0 && correction.abs() <= 0.3;
    let values = last.value.abs() + before.value.abs();
    let left = last.value.abs() * last.value.abs().max(correction.abs()) * values.min(1.0);
    sound.then(|| (-last.value * pace * (1.0 - correction), left))
}

/// A point well inside `(low, high)`: the middle, or a doubling step outwards if one side is infinite.
fn middle(low: f64, high: f64) -> f64 {
    match (low.is_finite(), high.is_finite()) {
        (true, true) => 0.5 * (low + high),
        (true, false) => low + (1.0 + low.abs()),
        (false, true) => high - (1.0 + high.abs()),
        (false, false) => 0.0,
    }
}

/// A zero of a continuous function between two points with values of opposite signs, to within `resolution`, by the Illinois method (Dowell and
/// Jarratt, BIT 11, 168, 1971).
pub fn crossing(
    mut f: impl FnMut(f64) -> f64,
    [mut x0, mut x1]: [f64; 2],
    [mut f0, mut f1]: [f64; 2],
    resolution: f64,
) -> f64 {
    for _ in 0..MAX_STEPS {
        if f1 == 0.0 || (x1 - x0).abs() <= resolution {
            return x1;
        }
        let x = x1 - f1 * (x1 - x0) / (f1 - f0);
        let value = f(x);
        if (value > 0.0) == (f1 > 0.0) {
            f0 *= 0.5;
        } else {
            (x0, f0) = (x1, f1);
        }
        let step = (x - x1).abs();
        (x1, f1) = (x, value);
        if step <= resolution {
            return x1;
        }
    }
    x1
}
