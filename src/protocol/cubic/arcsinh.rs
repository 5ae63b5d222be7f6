//! Works of cubic shortcuts with regularised friction.
//!
//! It differs from the logarithm by `a ln((1 + sqrt(1 + 4 e^{-2L}))/2) <= a e^{-2L}` with `L` the friction of the logarithm over `a`. So the work is
//! that of the logarithm unless friction is at most a few `a` somewhere; there, the integral is recomputed.

use super::{Landscape, LandscapeBuffers, Path};
use crate::model::arcsinh::scaled_friction;
use crate::numerics::adaptive::{COARSE_RTOL, integrals};
use crate::numerics::elementary::{exp, ln, polynomial};
use crate::protocol::{SolverStats, Status};

/// Fraction of the tolerance below which the difference to the logarithm is neglected. Chosen: a tenth.
const NEGLIGIBLE: f64 = 0.1;

impl Landscape {
    /// Turns what [`Landscape::evaluate`] found into the works and statuses of regularised friction, which holds down to rest and is never
    /// negative. `v_min` must be requested; works are good to `rtol`.
    pub fn regularise(&self, a_2: &[f64], a_3: &[f64], rtol: f64, out: LandscapeBuffers<'_>) -> SolverStats {
        let LandscapeBuffers { work, v_min, status } = out;
        let mut stats = SolverStats::default();
        for (i, status) in status.iter_mut().enumerate() {
            if matches!(status, Status::Infeasible | Status::NotConverged) {
                continue;
            }
            *status = Status::Ok;
            let Some(work) = work.get_mut(i) else { continue };
            let path = Path::new(&self.ends, a_2[i], a_3[i]);
            if self.is_logarithmic(&path, v_min[i], rtol) {
                continue;
            }
            match self.regularised_work(&path) {
                Some((found, nodes)) => {
                    *work = found;
                    stats += SolverStats { quadratures: 1, nodes };
                }
                None => *status = Status::NotConverged,
            }
        }
        stats
    }

    /// Whether the difference to the logarithm is negligible, by the least velocity and the least theta.
    pub(super) fn is_logarithmic(&self, path: &Path<'_>, v_min: f64, rtol: f64) -> bool {
        let theta = [0.0, 1.0, path.theta.minimum()].map(|x| path.exact_theta().at(x).high);
        let least = 1.0 + self.law.a * ln(v_min) + self.law.b * ln(theta.into_iter().fold(f64::INFINITY, f64::min));
        least > 0.0 && self.law.a * exp(-2.0 * least / self.law.a) < NEGLIGIBLE * rtol * least
    }

    /// The work, and the number of nodes. Expansions about the ends and the minima of theta and `1 - theta'` keep the digits of both.
    pub(super) fn regularised_work(&self, path: &Path<'_>) -> Option<(f64, u32)> {
        let inside = |x: f64| x > 0.0 && x < 1.0;
        let mut centres = vec![0.0, 1.0];
        centres.extend([path.theta.minimum(), path.n.minimum()].into_iter().filter(|&x| inside(x)));
        centres.sort_by(f64::total_cmp);
        centres.dedup();
        let (mut work, mut nodes) = (0.0, 0);
        for pair in centres.windows(2) {
            let half = 0.5 * (pair[1] - pair[0]);
            for (centre, from) in [(pair[0], 0.0), (pair[1], -half)] {
                let (theta, n) = path.about(centre);
                let integrand = |x: f64| Some([self.power(polynomial(&theta, x), polynomial(&n, x))]);
                let (sum, more) = integrals(integrand, vec![(from, half)], &[0.0], COARSE_RTOL)?;
                (work, nodes) = (work + sum[0], nodes + more);
            }
        }
        Some((work, nodes))
    }

    /// `t_f tau v` at theta and `n = t_f v theta`.
    fn power(&self, theta: f64, n: f64) -> f64 {
        let slip = n / theta;
        let level = ln(slip) - self.ln_t_f + (1.0 + self.law.b * ln(theta)) / self.law.a;
        self.law.a * scaled_friction(level) * slip
    }
}
