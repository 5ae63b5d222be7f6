//! Adaptive Gauss-Legendre quadrature of several functions at once.

use super::MAX_PANELS;
use super::gauss::rule;

/// Relative difference of the rules with 10 and 20 nodes at which the second is good to rounding. Measured: near a kink its error may be almost the
/// difference, and with 1e-8 works near rest were off by 1e-10 (`gap.work` of regularised friction in `tests/budgets.csv`).
const COARSE_RTOL: f64 = 1e-13;

/// Difference of both rules that is none. Derived: far above the least double, so that rounding near it does not matter.
const UNDERFLOW: f64 = 1e-280;

/// The integrals of the functions `f` over `panels` of start and length, and the number of nodes; `None` if `f` is somewhere, or takes too many
/// panels.
///
/// The first functions, each with a size, must not change sign: their integrals are good to rounding, of themselves or of the size if that is
/// greater. Panels are halved towards the start of each.
pub fn integrals<const N: usize>(
    f: impl Fn(f64) -> Option<[f64; N]>,
    mut panels: Vec<(f64, f64)>,
    sizes: &[f64],
) -> Option<([f64; N], u32)> {
    let on_panel = |(from, length): (f64, f64), nodes: usize| {
        let rule = rule(nodes);
        let mut sums = [0.0; N];
        for (x, weight) in rule.x.iter().zip(&rule.w) {
            let values = f(from + 0.5 * length * (1.0 + x))?;
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += 0.5 * length * weight * value);
        }
        Some(sums)
    };
    let (mut total, mut nodes) = ([0.0; N], 0);
    for _ in 0..MAX_PANELS {
        let Some(panel) = panels.pop() else { return Some((total, nodes)) };
        let [coarse, fine] = [on_panel(panel, 10)?, on_panel(panel, 20)?];
        nodes += 30;
        let limit = |i: usize, size: f64| (COARSE_RTOL * (total[i] + fine[i]).abs().max(size)).max(UNDERFLOW);
        let agrees = (0..N).zip(sizes).all(|(i, &size)| (fine[i] - coarse[i]).abs() <= limit(i, size));
        if agrees {
            total.iter_mut().zip(fine).for_each(|(sum, value)| *sum += value);
        } else {
            let (from, half) = (panel.0, 0.5 * panel.1);
            panels.extend([(from + half, half), (from, half)]);
        }
    }
    None
}
