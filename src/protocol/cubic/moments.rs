//! Work of one shortcut with its gradient and Hessian in `(a_2, a_3)`, all from the same nodes.

use super::Landscape;
use super::path::Path;
use super::rules::{Map, Panel, Zeros, choose};
use crate::numerics::elementary::{exp, ln};
use crate::numerics::gauss::rule;
use crate::protocol::Effort;

/// `W_s` and its derivatives with respect to `a_2 = alpha_2 t_f` and `a_3 = alpha_3 t_f^2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::protocol) struct Moments {
    pub work: f64,
    /// `dW/da_2`, `dW/da_3`.
    pub gradient: [f64; 2],
    /// `d2W/da_2^2`, `d2W/da_2 da_3`, `d2W/da_3^2`.
    pub hessian: [f64; 3],
}

impl Landscape {
    /// Work, gradient and Hessian of a feasible shortcut.
    ///
    /// With `H(n, theta) = tau n/theta` the work is `int H dx`; theta and `n` are linear in the coefficients.
    pub(in crate::protocol) fn moments(&self, a_2: f64, a_3: f64, effort: &mut Effort) -> Moments {
        let path = Path::new(&self.ends, a_2, a_3);
        let (a, slope) = (self.law.a, self.law.b - self.law.a);
        let constant = 1.0 - a * self.ln_t_f;
        let mut moments = Moments { work: 0.0, gradient: [0.0; 2], hessian: [0.0; 3] };
        effort.quadratures += 1;
        for panel in self.panels(&path) {
            let ([q0, q1, q2, q3], [n0, n1, n2]) = path.about(panel.centre);
            effort.nodes += panel.nodes as u32;
            panel.each_node(|delta, weight| {
                let theta = q0 + delta * (q1 + delta * (q2 + delta * q3));
                // On the border v = 0 rounding may take n below 0.
                let n = (n0 + delta * (n1 + delta * n2)).max(f64::MIN_POSITIVE);
                let tau = constant + a * ln(n) + slope * ln(theta);
                // theta and n change by these for a change of a_2, a_3 (a_4 gives way).
                let x = panel.centre + delta;
                let d_theta = [x * (1.0 - x) * (1.0 + x), x * x * (1.0 - x)];
                let d_n = [3.0 * x * x - 1.0, x * (3.0 * x - 2.0)];
                let h_n = (tau + a) / theta;
                let h_theta = (slope - tau) * n / (theta * theta);
                let h_nn = a / (n * theta);
                let h_mixed = (slope - tau - a) / (theta * theta);
                let h_theta_theta = n * (2.0 * tau - 3.0 * slope) / (theta * theta * theta);
                moments.work += weight * tau * n / theta;
                for (sum, (dn, dq)) in moments.gradient.iter_mut().zip(d_n.iter().zip(d_theta)) {
                    *sum += weight * (h_n * dn + h_theta * dq);
                }
                for (sum, (i, j)) in moments.hessian.iter_mut().zip([(0, 0), (0, 1), (1, 1)]) {
                    *sum += weight
                        * (h_nn * d_n[i] * d_n[j]
                            + h_mixed * (d_n[i] * d_theta[j] + d_n[j] * d_theta[i])
                            + h_theta_theta * d_theta[i] * d_theta[j]);
                }
            });
        }
        moments
    }

    fn panels(&self, path: &Path) -> Vec<Panel> {
        let mut panels = Vec::with_capacity(4);
        choose(&Zeros::of(path), 0.0, 1.0, &self.accuracy, 0, &mut panels);
        panels
    }
}

impl Panel {
    /// Visits the distance from the centre and the weight of every node.
    fn each_node(&self, mut visit: impl FnMut(f64, f64)) {
        let rule = rule(self.nodes);
        let (middle, half) = (0.5 * (self.from + self.to), 0.5 * (self.to - self.from));
        for (x, w) in rule.x.iter().zip(&rule.w) {
            let s = middle + half * x;
            let (delta, jacobian) = match self.map {
                Map::Line => (s, 1.0),
                Map::Power { side, gap, squarings } => {
                    let (mut power, mut jacobian) = (s, 1.0);
                    for _ in 0..squarings {
                        jacobian *= 2.0 * power;
                        power *= power;
                    }
                    (side * (gap - power), jacobian)
                }
                Map::Sinh { height } => {
                    let q = exp(s);
                    (0.5 * height * (q - 1.0 / q), 0.5 * height * (q + 1.0 / q))
                }
            };
            visit(delta, half * w * jacobian);
        }
    }
}
