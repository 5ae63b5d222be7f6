//! The cubic shortcuts: `theta = 1/v_i + alpha_2 t + alpha_3 t^2 + alpha_4 t^3`, `v` free to jump at both ends.
//!
//! `alpha_4` follows from `theta(t_f) = 1/v_f`. A shortcut is a [`path`] of two polynomials; whether it is feasible is decided from their
//! stationary points before any quadrature is spent, and the quadrature follows from their zeros ([`rules`]).

mod path;
mod rules;

use multiversion::multiversion;

use super::{Effort, Status};
use crate::model::{Law, Transition};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::ln;
use crate::numerics::gauss::{Rule, rule};
use crate::numerics::lanes::{LANES, fold};
use path::{Ends, Path};
use rules::{Map, Panel, Zeros, choose};

/// The work landscape of one transition in one time over the plane of `(alpha_2, alpha_3)`.
#[derive(Debug, Clone)]
pub struct Landscape {
    law: Law,
    ends: Ends,
    tolerance: f64,
}

/// The results of a run of shortcuts, one element a shortcut, laid out column by column.
#[derive(Debug)]
pub struct Shortcuts<'a> {
    /// `W_s`; left untouched where infeasible, and everywhere if empty (not asked for).
    pub work: &'a mut [f64],
    /// Least velocity on `[0, t_f]`; left untouched where infeasible, and everywhere if empty (not asked for).
    pub v_min: &'a mut [f64],
    /// `Ok`, `BelowBound` or `Infeasible`.
    pub status: &'a mut [Status],
}

impl Landscape {
    /// Prepares the landscape of `transition` in time `t_f`; every work is good to relative accuracy `rtol`.
    pub fn new(transition: &Transition, t_f: f64, rtol: f64) -> Self {
        let one = DoubleDouble::new(1.0);
        let ends = Ends {
            theta_0: one / DoubleDouble::new(transition.v_i),
            theta_1: one / DoubleDouble::new(transition.v_f),
            t_f,
        };
        Landscape { law: transition.law, ends, tolerance: 0.5 * rtol }
    }

    /// Evaluates the shortcuts `(a_2[i], a_3[i])`, given scaled: `alpha_2 t_f` and `alpha_3 t_f^2`.
    ///
    /// As many as the shortest of `a_2`, `a_3` and `out.status` holds.
    pub fn evaluate(&self, a_2: &[f64], a_3: &[f64], out: Shortcuts<'_>) -> Effort {
        let mut effort = Effort::default();
        let mut panels = Vec::with_capacity(8);
        let coefficients = a_2.iter().zip(a_3);
        for (i, ((&a_2, &a_3), status)) in coefficients.zip(out.status.iter_mut()).enumerate() {
            let path = Path::new(&self.ends, a_2, a_3);
            *status = path.status();
            if *status == Status::Infeasible {
                continue;
            }
            if let Some(v_min) = out.v_min.get_mut(i) {
                *v_min = path.v_min();
            }
            if let Some(work) = out.work.get_mut(i) {
                *work = self.work(&path, &mut panels, &mut effort);
            }
        }
        effort
    }

    /// `W_s = int tau v dt`.
    fn work(&self, path: &Path, panels: &mut Vec<Panel>, effort: &mut Effort) -> f64 {
        panels.clear();
        choose(&Zeros::of(path), 0.0, 1.0, self.tolerance, 0, panels);
        effort.quadratures += 1;
        let mut work = 0.0;
        for panel in panels.iter() {
            let rule = rule(LANES * (panel.nodes / LANES as f64).ceil().max(1.0) as usize);
            effort.nodes += rule.x.len() as u32;
            let [q0, q1, q2, q3] = path.theta.about(panel.centre);
            let [n0, n1, n2, _] = path.n.about(panel.centre);
            let slice = Slice {
                constant: 1.0 - self.law.a * ln(self.ends.t_f),
                a: self.law.a,
                slope: self.law.b - self.law.a,
                theta: [q0, q1, q2, q3],
                n: [n0, n1, n2],
                middle: 0.5 * (panel.from + panel.to),
                half: 0.5 * (panel.to - panel.from),
            };
            work += match panel.map {
                Map::Line => line_kernel(&slice, rule),
                map => mapped_kernel(&slice, &map, rule),
            };
        }
        work
    }
}

/// Constants of a kernel: `tau = constant + a ln n + slope ln theta` with both polynomials about the panel's centre.
struct Slice {
    constant: f64,
    a: f64,
    slope: f64,
    theta: [f64; 4],
    n: [f64; 3],
    middle: f64,
    half: f64,
}

impl Slice {
    /// `tau v dt` at one node of the mapped variable.
    #[inline(always)]
    fn integrand(&self, delta: f64) -> f64 {
        let [q0, q1, q2, q3] = self.theta;
        let [n0, n1, n2] = self.n;
        let theta = q0 + delta * (q1 + delta * (q2 + delta * q3));
        let n = n0 + delta * (n1 + delta * n2);
        (self.constant + self.a * ln(n) + self.slope * ln(theta)) * (n / theta)
    }
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn line_kernel(slice: &Slice, rule: &Rule) -> f64 {
    let mut sum = [0.0; LANES];
    for (x, w) in rule.x.chunks_exact(LANES).zip(rule.w.chunks_exact(LANES)) {
        for i in 0..LANES {
            sum[i] += w[i] * slice.integrand(slice.middle + slice.half * x[i]);
        }
    }
    slice.half * fold(&sum)
}

#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn mapped_kernel(slice: &Slice, map: &Map, rule: &Rule) -> f64 {
    let mut sum = [0.0; LANES];
    for (x, w) in rule.x.chunks_exact(LANES).zip(rule.w.chunks_exact(LANES)) {
        for i in 0..LANES {
            let (delta, jacobian) = map.apply(slice.middle + slice.half * x[i]);
            sum[i] += w[i] * jacobian * slice.integrand(delta);
        }
    }
    slice.half * fold(&sum)
}
