//! The sum of `tau v dt` over the nodes of one panel, eight at a time, with logarithms: for the few shortcuts that [`works`](super::works)
//! cannot sum without them.

use multiversion::multiversion;

use super::rules::PanelMap;
use crate::numerics::elementary::ln;
use crate::numerics::gauss::Rule;
use crate::numerics::lanes::{LANES, fold};

/// Constants of one panel: `tau = constant + a ln n + slope ln theta`, both polynomials in powers of the distance
/// `delta` from the panel's centre.
pub(super) struct Slice {
    pub constant: f64,
    pub a: f64,
    pub slope: f64,
    pub theta: [f64; 4],
    pub n: [f64; 3],
    /// Middle and half length of the panel in the mapped variable.
    pub middle: f64,
    pub half: f64,
}

impl Slice {
    /// `int tau v dt` over the panel.
    pub fn sum(&self, map: PanelMap, rule: &Rule) -> f64 {
        self.half * weigh(self, map, rule)
    }

    /// `tau v dt/dx` at one node.
    #[inline(always)]
    fn integrand(&self, delta: f64) -> f64 {
        let [q0, q1, q2, q3] = self.theta;
        let [n0, n1, n2] = self.n;
        let theta = q0 + delta * (q1 + delta * (q2 + delta * q3));
        let n = n0 + delta * (n1 + delta * n2);
        (self.constant + self.a * ln(n) + self.slope * ln(theta)) * (n / theta)
    }

    /// The weighted sum over a rule.
    #[inline(always)]
    fn weigh(&self, map: PanelMap, rule: &Rule) -> f64 {
        let mut sum = [0.0; LANES];
        for (x, w) in rule.x.chunks_exact(LANES).zip(rule.w.chunks_exact(LANES)) {
            for i in 0..LANES {
                let (delta, jacobian) = map.place(self.middle + self.half * x[i]);
                sum[i] += w[i] * jacobian * self.integrand(delta);
            }
        }
        fold(&sum)
    }
}

/// [`Slice::weigh`], with a loop for each kind of map.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn weigh(slice: &Slice, map: PanelMap, rule: &Rule) -> f64 {
    match map {
        PanelMap::Line => slice.weigh(PanelMap::Line, rule),
        PanelMap::Power { side, gap, squarings: 1 } => slice.weigh(PanelMap::Power { side, gap, squarings: 1 }, rule),
        PanelMap::Power { side, gap, squarings: 2 } => slice.weigh(PanelMap::Power { side, gap, squarings: 2 }, rule),
        PanelMap::Power { side, gap, .. } => slice.weigh(PanelMap::Power { side, gap, squarings: 3 }, rule),
        PanelMap::Sinh { height } => slice.weigh(PanelMap::Sinh { height }, rule),
    }
}
