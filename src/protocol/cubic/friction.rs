//! The sign of the least friction on a shortcut.
//!
//! `tau = 1 + a ln(n/t_f) + (b - a) ln theta`. For most shortcuts, least values of `n` and theta prove positive friction (`FrictionBounds`).
//! Both are linear in the coefficients, so for `b >= a` friction at every `x` is concave in them: if it is not negative at both ends of a line,
//! it is nowhere negative on the line. The remaining shortcuts are decided one by one: friction is stationary at the roots of a polynomial of
//! degree four.

use std::ops::Range;

use multiversion::multiversion;

use super::path::{Ends, Path};
use crate::model::{Law, StateLaw};
use crate::numerics::elementary::{exp, ln};
use crate::numerics::lanes::{LANES, Lanes};
use crate::numerics::polynomial::roots_between;
use crate::protocol::Status;

/// Bounds of `n` and theta above which friction is positive.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionBounds {
    pub n: f64,
    pub theta: f64,
}

/// The greatest decrease of friction by either logarithm. Derived: a half, less rounding.
const MAX_LOGARITHM_DECREASE: f64 = 0.499;

impl FrictionBounds {
    fn new(law: Law, ends: &Ends) -> FrictionBounds {
        let Law { a, b } = law;
        let theta = if b > a {
            exp(-MAX_LOGARITHM_DECREASE / (b - a))
        } else if (a - b) * ln(ends.theta_0.high + ends.t_f) < MAX_LOGARITHM_DECREASE {
            // Theta grows at most by the duration.
            0.0
        } else {
            f64::INFINITY
        };
        FrictionBounds { n: ends.t_f * exp(-MAX_LOGARITHM_DECREASE / a), theta }
    }

    /// The bounds under an evolution law of the state: friction is `1 + a ln u + (b - a) ln theta`, with `u^2 = n/t_f` for the law of Perrin, Rice and
    /// Zheng and `u >= 1/e` for the slip law.
    pub fn under(state: StateLaw, law: Law, ends: &Ends) -> FrictionBounds {
        match state {
            StateLaw::Ageing => FrictionBounds::new(law, ends),
            StateLaw::Prz => FrictionBounds::new(Law { a: 0.5 * law.a, b: law.b - 0.5 * law.a }, ends),
            // Less than a half is lost by u.
            StateLaw::Slip if law.a < MAX_LOGARITHM_DECREASE => {
                FrictionBounds { n: f64::NEG_INFINITY, ..FrictionBounds::new(law, ends) }
            }
            StateLaw::Slip => FrictionBounds { n: f64::INFINITY, theta: f64::INFINITY },
        }
    }

    /// A bit mask of the feasible shortcuts that the bounds do not decide.
    pub fn open(&self, ends: &Ends, a_2: &Lanes, a_3: &Lanes, status: &[Status; LANES]) -> u32 {
        let mut open = 0;
        for (i, &sure) in sure(self, ends, a_2, a_3).iter().enumerate() {
            if sure == 0.0 && status[i] != Status::Infeasible && !self.settle(&Path::new(ends, a_2[i], a_3[i])) {
                open |= 1 << i;
            }
        }
        open
    }

    /// Whether the least values are above the bounds.
    fn settle(&self, path: &Path) -> bool {
        let slack = path.slack();
        path.n.least() > self.n + path.n.doubt() + 3.0 * slack
            && path.theta.least() > self.theta + path.theta.doubt() + slack
    }
}

/// 1 in lanes whose coefficients in Bernstein's form are above the bounds.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn sure(floors: &FrictionBounds, ends: &Ends, a_2: &Lanes, a_3: &Lanes) -> Lanes {
    let mut sure = [0.0; LANES];
    for i in 0..LANES {
        let path = Path::new(ends, a_2[i], a_3[i]);
        let slack = path.slack();
        let n = path.n.bounds().0 > floors.n + path.n.doubt() + 3.0 * slack;
        let theta = path.theta.bounds().0 > floors.theta + path.theta.doubt() + slack;
        sure[i] = if n & theta { 1.0 } else { 0.0 };
    }
    sure
}

/// Sets the status of the shortcuts with negative friction among consecutive ones on a line in the plane, along which friction may be concave.
pub(super) fn decide(all: Range<usize>, is_concave: bool, is_negative: impl Fn(usize) -> bool, status: &mut [Status]) {
    if all.len() > 1 && is_concave && !is_negative(all.start) && !is_negative(all.end - 1) {
        return;
    }
    for i in all {
        if status[i] != Status::Infeasible && is_negative(i) {
            status[i] = Status::NegativeFriction;
        }
    }
}

impl Path<'_> {
    /// The least friction, or any negative friction on the path.
    pub fn friction_min(&self, law: Law) -> f64 {
        let mut least = f64::INFINITY;
        for friction in self.frictions(law) {
            least = least.min(friction);
            if least < 0.0 {
                break;
            }
        }
        least
    }

    /// The least and the greatest friction on the path.
    pub fn friction_range(&self, law: Law) -> [f64; 2] {
        self.frictions(law).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    }

    /// Friction where it may be least or greatest, places found with less work first.
    fn frictions(&self, law: Law) -> impl Iterator<Item = f64> {
        let stationary = move |end: f64| self.stationary(law, end).into_iter().map(move |d| (end - d).abs());
        // The middle, at which both halves end, is stationary on symmetric paths.
        let places = [0.0, 1.0, 0.5, self.theta.minimum(), self.n.minimum()].into_iter();
        places.chain([0.0, 1.0].into_iter().flat_map(stationary)).map(move |x| {
            let (theta, n) = self.at(x);
            if n > 0.0 && theta > 0.0 {
                1.0 + law.a * ln(n / self.ends.t_f) + (law.b - law.a) * ln(theta)
            } else {
                // The border of feasibility.
                f64::NEG_INFINITY
            }
        })
    }

    /// The stationary points of friction in the half near an end, as distances from it: roots of `a n' theta + (b - a) n theta'`.
    pub(super) fn stationary(&self, law: Law, end: f64) -> Vec<f64> {
        let ([t0, t1, t2, t3], [n0, n1, n2]) = self.about(end);
        let side = if end == 0.0 { 1.0 } else { -1.0 };
        let (theta, n) = ([t0, side * t1, t2, side * t3], [n0, side * n1, n2]);
        let (theta_slope, n_slope) = ([theta[1], 2.0 * theta[2], 3.0 * theta[3]], [n[1], 2.0 * n[2]]);
        let mut c = [0.0; 5];
        for (i, n_slope) in n_slope.into_iter().enumerate() {
            for (j, theta) in theta.into_iter().enumerate() {
                c[i + j] += law.a * n_slope * theta;
            }
        }
        for (i, n) in n.into_iter().enumerate() {
            for (j, theta_slope) in theta_slope.into_iter().enumerate() {
                c[i + j] += (law.b - law.a) * n * theta_slope;
            }
        }
        roots_between(&c, 0.0, 0.5)
    }
}
