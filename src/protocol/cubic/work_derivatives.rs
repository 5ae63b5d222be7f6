//! Work of a shortcut with gradient and Hessian, from the same nodes.
//!
//! With `H(n, theta) = tau n/theta` the work is `int H dx`; theta and `n` are linear in the coefficients. A change
//! `dtheta` that vanishes at both ends changes `n` by `-d(dtheta)/dx`, so that for a constant `K`
//!
//! ```text
//! int K (dn/theta - n dtheta/theta^2) dx = -K t_f int dtheta/theta^2 dx.
//! ```
//!
//! With `K = tau_r + a`, the friction of steady sliding at `v_i` and `a`, the gradient is therefore
//!
//! ```text
//! int L dn/theta + [(b - L) n - K t_f] dtheta/theta^2 dx,    L = a ln(v/v_i) + b ln(v_i theta):
//! ```
//!
//! this form does not cancel where the velocity hardly changes. The Hessian follows from it.

use super::Landscape;
use super::path::Path;
use super::rules::{Zeros, choose};
use crate::numerics::elementary::{ln, ln_near_1};
use crate::protocol::SolverStats;

/// Work and its derivatives with respect to the two coefficients of a basis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::protocol) struct WorkDerivatives {
    pub work: f64,
    pub gradient: [f64; 2],
    /// `d2W/dy_1^2`, `d2W/dy_1 dy_2`, `d2W/dy_2^2`.
    pub hessian: [f64; 3],
}

/// Two coefficients that determine a cubic theta between its ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::protocol) enum Basis {
    /// The coefficients of `x` and `x^2`.
    Start,
    /// The coefficients of `1 - x` and `(1 - x)^2`. If theta decreases strongly, it has almost a triple zero at the end, and its coefficients in
    /// `x` would cancel.
    End,
}

impl Basis {
    /// The derivatives of theta and `n` with respect to both, at `x`, a distance `rest` from 1.
    pub fn changes(self, x: f64, rest: f64) -> ([f64; 2], [f64; 2]) {
        match self {
            Basis::Start => ([x * rest * (1.0 + x), x * x * rest], [3.0 * x * x - 1.0, x * (3.0 * x - 2.0)]),
            Basis::End => {
                ([rest * x * (1.0 + rest), rest * rest * x], [1.0 - 3.0 * rest * rest, rest * (2.0 - 3.0 * rest)])
            }
        }
    }
}

impl Landscape {
    /// Work, gradient and Hessian of a feasible shortcut.
    pub(in crate::protocol) fn work_derivatives(
        &self,
        path: &Path,
        basis: Basis,
        stats: &mut SolverStats,
    ) -> WorkDerivatives {
        let (a, b) = (self.law.a, self.law.b);
        let slope = b - a;
        let constant = 1.0 - a * self.ln_t_f;
        let (theta_i, t_f) = (self.ends.theta_0.high, self.ends.t_f);
        let pull = (1.0 + slope * ln(theta_i) + a) * t_f;
        let mut work_derivatives = WorkDerivatives { work: 0.0, gradient: [0.0; 2], hessian: [0.0; 3] };
        stats.quadratures += 1;
        let mut panels = Vec::with_capacity(4);
        choose(&Zeros::of(path), 0.0, 1.0, &self.accuracy, 0, &mut panels);
        for panel in panels {
            let (q, [n0, n1, n2]) = path.about(panel.centre);
            // theta - theta_0 and, in units of v_i/t_f, n - v_i t_f theta.
            let aged = path.change_about(panel.centre);
            let above = path.above_start_about(panel.centre);
            stats.nodes += panel.nodes as u32;
            panel.each_node(|delta, weight| {
                let theta = at(&q, delta);
                // On the border v = 0, rounding may make n negative.
                let n = (n0 + delta * (n1 + delta * n2)).max(f64::MIN_POSITIVE);
                let tau = constant + a * ln(n) + slope * ln(theta);
                let speed = ln_near_1(at(&above, delta) / (t_f * theta), n / (t_f * theta) * theta_i);
                let age = ln_near_1(at(&aged, delta) / theta_i, theta / theta_i);
                let l = a * speed + b * age;
                let (x, rest) = (panel.centre + delta, (1.0 - panel.centre) - delta);
                let (d_theta, d_n) = basis.changes(x, rest);
                let inverse = 1.0 / theta;
                let by_theta = ((b - l) * n - pull) * inverse * inverse;
                let h_nn = a * inverse / n;
                let h_mixed = (slope - l) * inverse * inverse;
                let h_theta_theta = -(slope * n * inverse * inverse + 2.0 * by_theta) * inverse;
                work_derivatives.work += weight * tau * n * inverse;
                for (sum, (dn, dq)) in work_derivatives.gradient.iter_mut().zip(d_n.iter().zip(d_theta)) {
                    *sum += weight * (l * inverse * dn + by_theta * dq);
                }
                for (sum, (i, j)) in work_derivatives.hessian.iter_mut().zip([(0, 0), (0, 1), (1, 1)]) {
                    *sum += weight
                        * (h_nn * d_n[i] * d_n[j]
                            + h_mixed * (d_n[i] * d_theta[j] + d_n[j] * d_theta[i])
                            + h_theta_theta * d_theta[i] * d_theta[j]);
                }
            });
        }
        work_derivatives
    }
}

/// The value of a cubic at a distance from its expansion point.
fn at([c0, c1, c2, c3]: &[f64; 4], delta: f64) -> f64 {
    c0 + delta * (c1 + delta * (c2 + delta * c3))
}
