//! Cubic shortcuts one by one, from coefficients of 32 digits.
//!
//! A coefficient in natural units is a product with `t_f`. Where theta or `n` almost vanishes, the rounding of this product matters.

use super::{Landscape, Path};
use crate::model::{Friction, StateLaw};
use crate::numerics::cubic::Cubic;
use crate::numerics::double_double::DoubleDouble;
use crate::protocol::{SolverStats, Status};

/// One shortcut.
#[derive(Debug, Clone, Copy)]
pub struct CubicPoint {
    /// `Ok`, `BelowBound`, `NegativeFriction`, `Infeasible` or `NotConverged`.
    pub status: Status,
    /// `W_s`; NaN if it did not converge or is infeasible.
    pub work: f64,
    /// Least velocity.
    pub v_min: f64,
    /// Greatest velocity.
    pub v_max: f64,
}

impl CubicPoint {
    /// No such protocol.
    pub const INFEASIBLE: Self =
        CubicPoint { status: Status::Infeasible, work: f64::NAN, v_min: f64::NAN, v_max: f64::NAN };
}

impl Landscape {
    /// Whether a relative error of `f64::EPSILON` of both coefficients matters to a shortcut of this `status` and `v_min`: it changes theta by up to
    /// `EPSILON (|a_2| + |a_3|)` and `n` by up to three times as much. The bound `v = 1` is decided with all digits.
    #[inline]
    pub fn depends_on_rounding(&self, [a_2, a_3]: [f64; 2], status: Status, v_min: f64) -> bool {
        let path = Path::new(&self.ends, a_2, a_3);
        let change = f64::EPSILON * (a_2.abs() + a_3.abs());
        let doubt = |cubic: &Cubic, slack: f64| cubic.doubt() + slack * (path.slack() + change);
        let [of_theta, of_n] = [doubt(&path.theta, 1.0), doubt(&path.n, 3.0)];
        if status == Status::Infeasible {
            return path.n.bounds().1 > -of_n && path.n.least() > -of_n && path.theta.least() > -of_theta;
        }
        // Half of rtol.
        let tolerance = self.ends.v_loss;
        let matters = |theta: f64, n: f64| {
            let (theta, n) = (theta - of_theta, n - of_n);
            theta <= 0.0 || n <= 0.0 || change * (n + 3.0 * theta) > tolerance * theta * n
        };
        matters(path.theta.bounds().0, path.n.bounds().0) && matters(path.theta.least(), path.n.least())
            || (v_min - 1.0).abs() <= tolerance
    }

    /// The shortcut with `alpha_2 t_f = a_2` and `alpha_3 t_f^2 = a_3` under a form of friction, its work good to `rtol`; `None` if it is
    /// infeasible.
    pub fn point(
        &self,
        [a_2, a_3]: [DoubleDouble; 2],
        friction: Friction,
        rtol: f64,
        stats: &mut SolverStats,
    ) -> Option<CubicPoint> {
        let path = Path::exact(&self.ends, a_2, a_3);
        let of_bounds = path.exact_status();
        if of_bounds == Status::Infeasible {
            return None;
        }
        let ([v_min, friction_min], own) = match self.state {
            StateLaw::Ageing => ([path.least_velocity(), path.friction_min(self.law)], of_bounds),
            _ => {
                let least = self.least(&path);
                (least, if least[0] < 1.0 { Status::BelowBound } else { Status::Ok })
            }
        };
        let (mut status, mut work) = match friction {
            Friction::Log => (own.with_friction(friction_min), f64::NAN),
            Friction::Regularised => (Status::Ok, f64::NAN),
        };
        if friction == Friction::Log || self.is_logarithmic(&path, v_min, rtol) {
            work = self.whole_work(&path, stats);
        } else if let Some((found, nodes)) = self.regularised_work(&path) {
            *stats += SolverStats { quadratures: 1, nodes };
            work = found;
        } else {
            status = Status::NotConverged;
        }
        Some(CubicPoint { status, work, v_min, v_max: self.greatest_velocity(&path) })
    }
}
