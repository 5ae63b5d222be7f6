//! A first parameter for the search.

use multiversion::multiversion;

use super::extremal::Problem;
use crate::model::Law;
use crate::numerics::MAX_LN;
use crate::numerics::elementary::{exp, ln, phi};
use crate::numerics::gauss::rule;
use crate::numerics::lanes::{LANES, Lanes};
use crate::numerics::turning::{rough_excess, turning};

/// A first parameter.
pub(super) struct Guess {
    /// The origin of the parameter.
    pub q_floor: Option<f64>,
    /// The parameter, counted from `q_floor`.
    pub p: f64,
    /// Tolerance of the first quadrature.
    pub tolerance: f64,
}

impl Guess {
    /// For the time `beyond` the least. For `b = a` time is linear in `ln u` along an arc; that line, `v = const` for very
    /// short times, and a floor arc for long ones come close. Where theta falls at once, a coarse quadrature comes closer.
    pub fn of(problem: &Problem, beyond: f64) -> Guess {
        let q_floor = problem.q_floor().filter(|&q_floor| problem.reach(beyond) >= MIN_REACH * q_floor.abs());
        let p = line(problem, q_floor, beyond);
        let z_0 = p + q_floor.unwrap_or(0.0);
        if problem.fall > 0.0
            && z_0 > 0.0
            && let Some(z_0) = Falling::of(problem).start(&between(z_0), beyond)
        {
            return Guess { q_floor, p: z_0 - q_floor.unwrap_or(0.0), tolerance: 1e-3 * QUADRATURE_ERROR };
        }
        Guess { q_floor, p, tolerance: QUADRATURE_ERROR }
    }
}

/// Fraction of `q_floor` below which parameters are counted from 0. Chosen: counted from `q_floor`, a search would lose five digits of them.
const MIN_REACH: f64 = 1e-5;

/// Error of the coarsest quadrature. Measured: coarser ones cost more steps (`cargo bench --bench optimal`).
pub(super) const QUADRATURE_ERROR: f64 = 1e-4;

fn line(problem: &Problem, q_floor: Option<f64>, beyond: f64) -> f64 {
    let law = problem.law;
    let friction = problem.friction_a();
    let origin = q_floor.unwrap_or(0.0);
    if problem.rises() {
        // An arc that leaves the bound at the anchor comes back to it with the same E.
        let z_end = turning((2.0 * phi(problem.to.ln)).sqrt()).ln_u;
        let arc = problem.to.theta * law.a * (z_end - problem.to.ln) / friction;
        return match q_floor {
            Some(_) if beyond > arc => (beyond - arc) / problem.theta_a(),
            _ => -origin,
        };
    }
    let e = ((problem.friction_end() - friction / (1.0 + problem.fall)) / law.a).max(0.0);
    let z_end = turning((2.0 * e).sqrt()).ln_u;
    let z_start = z_end - beyond * friction / (law.a * problem.from.theta);
    if z_start > 0.0 {
        let fast = problem.from.theta * problem.depth() / beyond;
        z_start.max(ln(fast) - 1.5) - origin
    } else {
        let q = -(2.0 * phi(z_start)).sqrt();
        match q_floor {
            Some(q_floor) if q < q_floor => {
                let arc = problem.from.theta * law.a * (z_end - problem.from.ln) / friction;
                -(beyond - arc).max(0.0) / problem.theta_a()
            }
            _ => q - origin,
        }
    }
}

/// Arcs along which theta falls at once.
struct Falling {
    law: Law,
    theta_0: f64,
    /// `ln(theta_0/theta_1)`.
    depth: f64,
    /// Friction at the start with `u = 1`.
    friction: f64,
}

/// Between neighbouring values of `ln u(0+)` that are tried. Chosen: eight of them span a factor of 66 in `u(0+)`.
const SPACING: f64 = 0.6;

/// Eight values of `ln u(0+)` about `near`, which is more often too high; the time has a pole at 0.
fn between(near: f64) -> Lanes {
    let first = (near - 4.5 * SPACING).max(0.05 * SPACING);
    let mut z = [0.0; LANES];
    for (i, z) in z.iter_mut().enumerate() {
        *z = first + SPACING * i as f64;
    }
    z
}

impl Falling {
    fn of(problem: &Problem) -> Falling {
        let depth = problem.depth();
        Falling { law: problem.law, theta_0: problem.from.theta, depth, friction: problem.friction_a() }
    }

    /// `ln u(0+)` for a `time`, by interpolation between these eight; `None` where it is not among them.
    fn start(&self, z: &Lanes, time: f64) -> Option<f64> {
        let rule = rule(LANES);
        let times = ln_times(self, z, rule.x.first_chunk()?, rule.w.first_chunk()?);
        let wanted = ln(time);
        // Times fall; four of them about the one wanted.
        let after = times.iter().position(|&time| time < wanted).filter(|&after| after > 0)?;
        let from = after.saturating_sub(2).min(LANES - 4);
        let mut sum = 0.0;
        for i in from..from + 4 {
            let (mut over, mut under) = (z[i], 1.0);
            for j in (from..from + 4).filter(|&j| j != i) {
                over *= wanted - times[j];
                under *= times[i] - times[j];
            }
            sum += over / under;
        }
        (times[from] < MAX_LN).then_some(sum)
    }
}

/// Logarithms of the times of eight arcs with these `ln u(0+)`, to about 1e-4; at least [`MAX_LN`] where there is no arc.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn ln_times(arcs: &Falling, z: &Lanes, x: &Lanes, w: &Lanes) -> Lanes {
    let Law { a, b } = arcs.law;
    let per_a = 1.0 / a;
    let (mut grow, mut bend, mut weight) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        // y = ln(theta/theta_0) = -depth s^3 opens the start, where u changes fast.
        let s = 0.5 * (1.0 + x[i]);
        let y = -arcs.depth * (s * s * s);
        grow[i] = exp(y);
        bend[i] = ((b - a) * y - arcs.friction * (grow[i] - 1.0)) * per_a;
        weight[i] = 1.5 * arcs.theta_0 * arcs.depth * w[i] * (s * s) * grow[i];
    }
    let (mut phi, mut time, mut ln_time) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        phi[i] = exp(z[i]) - 1.0 - z[i];
    }
    // E = phi(z_0) grow + bend.
    for node in 0..LANES {
        for i in 0..LANES {
            let e = phi[i] * grow[node] + bend[node];
            let e = if e > 0.0 { e } else { 0.0 };
            let excess = rough_excess((2.0 * e).sqrt(), e);
            time[i] += weight[node] / (excess + f64::MIN_POSITIVE);
        }
    }
    for i in 0..LANES {
        ln_time[i] = ln(time[i]);
    }
    ln_time
}
