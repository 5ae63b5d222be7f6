//! A bracketed root finder that always ends: Newton's method inside a bracket that only ever shrinks.

/// The value and the slope of a function at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probe {
    /// Value; its sign tells on which side the root lies.
    pub value: f64,
    /// Derivative with respect to the argument.
    pub slope: f64,
}

/// Where a search ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// Best argument: one Newton step beyond the last probe.
    pub x: f64,
    /// Argument of the last probe.
    pub probed: f64,
    /// What the last probe returned.
    pub probe: Probe,
}

/// Most probes of one search. Newton's method takes four to eight; a bisection of any bracket of doubles takes fewer
/// than this.
const MOST_PROBES: u32 = 200;

/// Finds the root of a rising function inside `(low, high)`, either of which may be infinite, from `start`.
///
/// `probe(x)` returns `None` where the function is not defined; such points count as lying beyond the root on the side
/// named by `undefined_above`. The search ends with the first probe whose absolute value is at most `enough`: the
/// Newton step from there, whose error is of the order of `enough^2`, is taken unprobed. It also ends where the bracket
/// has closed to neighbouring doubles with a change of sign between them: rounding of the function allows no better. It
/// returns `None` if the bracket is empty or closes on a place without a change of sign.
pub fn newton(
    mut probe: impl FnMut(f64) -> Option<Probe>,
    start: f64,
    (mut low, mut high): (f64, f64),
    undefined_above: bool,
    enough: f64,
) -> Option<Root> {
    if low.is_nan() || high.is_nan() || low >= high {
        return None;
    }
    let mut x = if start.is_nan() { middle(low, high) } else { start.clamp(low, high) };
    let mut last_step = f64::INFINITY;
    let mut below = false;
    let mut above = false;
    for _ in 0..MOST_PROBES {
        let p = probe(x).filter(|p| !p.value.is_nan());
        let step = match p {
            Some(p) => {
                let step = if p.slope > 0.0 { -p.value / p.slope } else { f64::NAN };
                if p.value.abs() <= enough {
                    let x_next = if step.is_finite() { (x + step).clamp(low, high) } else { x };
                    return Some(Root { x: x_next, probed: x, probe: p });
                }
                if p.value > 0.0 {
                    (high, above) = (x, true);
                } else {
                    (low, below) = (x, true);
                }
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
        let newton = x + step;
        // A step that leaves the bracket, or that does not shrink, gives way to a bisection.
        let next = if newton > low && newton < high && step.abs() < last_step { newton } else { middle(low, high) };
        if next == x || !(next > low && next < high) {
            return p.filter(|_| below && above).map(|probe| Root { x, probed: x, probe });
        }
        last_step = (next - x).abs();
        x = next;
    }
    None
}

/// A point well inside `(low, high)`: the middle, or a step outwards that doubles where one side is infinite.
fn middle(low: f64, high: f64) -> f64 {
    match (low.is_finite(), high.is_finite()) {
        (true, true) => 0.5 * (low + high),
        (true, false) => low + (1.0 + low.abs()),
        (false, true) => high - (1.0 + high.abs()),
        (false, false) => 0.0,
    }
}

/// A zero of a continuous function between two places where its values differ in sign, to `resolution`: the Illinois
/// method (Dowell and Jarratt, BIT 11, 168, 1971).
pub fn crossing(
    mut f: impl FnMut(f64) -> f64,
    [mut x0, mut x1]: [f64; 2],
    [mut f0, mut f1]: [f64; 2],
    resolution: f64,
) -> f64 {
    for _ in 0..MOST_PROBES {
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
