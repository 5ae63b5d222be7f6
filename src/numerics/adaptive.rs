//! Adaptive Gauss-Legendre quadrature of several functions at once.

use super::gauss::rule;
use super::{MAX_PANELS, MIN_INVERTIBLE};

/// Relative difference of the rules with 10 and 20 nodes at which the second is good to rounding. Measured: near a kink its error may be almost the
/// difference, and with 1e-8 works near rest were off by 1e-10 (`gap.work` of regularised friction in `tests/budgets.csv`).
pub const COARSE_RTOL: f64 = 1e-13;

/// The integrals of the functions `f` over `panels` of start and length, and the number of nodes; `None` if `f` is somewhere, or takes too many
/// panels.
///
/// The first functions, each with a size, must not change sign: both rules agree on them to `rtol`, relative to their integrals or to the size if that
/// is greater. The last panel comes first; panels are halved towards the start of each.
pub fn integrals<const N: usize>(
    mut f: impl FnMut(f64) -> Option<[f64; N]>,
    mut panels: Vec<(f64, f64)>,
    sizes: &[f64],
    rtol: f64,
) -> Option<([f64; N], u32)> {
    let mut on_panel = |(from, length): (f64, f64), nodes: usize| {
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
        let limit = |i: usize, size: f64| (rtol * (total[i] + fine[i]).abs().max(size)).max(MIN_INVERTIBLE);
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
