//! A first parameter for the search.

use multiversion::multiversion;

use super::ceiling::Ceilings;
use super::extremal::Problem;
use crate::model::Law;
use crate::numerics::MAX_LN;
use crate::numerics::elementary::{exp, exp_m1, ln, phi};
use crate::numerics::gauss::{SHORT_NODES, rule};
use crate::numerics::lanes::{LANES, Lanes};
use crate::numerics::turning::{rough_excess, turning};

/// A first parameter.
pub(super) struct Guess {
    /// The origin of the parameter.
    pub q_floor: Option<f64>,
    /// The parameter, counted from `q_floor`.
    pub p: f64,
    /// The expected relative error of the time.
    pub error: f64,
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
            && let Some(z_0) = Falling::of(problem).start(&between(z_0), [beyond, 0.0], &[f64::INFINITY; LANES])
        {
            return Guess { q_floor, p: z_0 - q_floor.unwrap_or(0.0), error: QUADRATURE_ERROR };
        }
        Guess { q_floor, p, error: UNKNOWN_TIME_ERROR }
    }
}

/// Fraction of `q_floor` below which parameters are counted from 0. Chosen: counted from `q_floor`, a search would lose five digits of them.
const MIN_REACH: f64 = 1e-5;

/// A first parameter for the time `t_f` under ceilings, where theta falls at once and the ceilings bind: between that of the free
/// arc and that of the arc that is on a ceiling throughout, which takes the time `least`.
pub(super) fn capped_guess(
    problem: &Problem,
    ceilings: &Ceilings,
    times: [f64; 2],
    [free, most]: [f64; 2],
) -> Option<f64> {
    let arcs = Falling::of(problem);
    let mut z = [0.0; LANES];
    for (i, z) in z.iter_mut().enumerate() {
        let left = 1.0 - i as f64 / LANES as f64;
        *z = most - (most - free) * (left * left);
    }
    arcs.start(&z, times, &ceilings_at(ceilings, &arcs, rule(SHORT_NODES).x.first_chunk()?))
}

/// `u - 1` at the ceilings at the nodes.
fn ceilings_at(ceilings: &Ceilings, arcs: &Falling, x: &[f64; SHORT_NODES]) -> [f64; SHORT_NODES] {
    let mut caps = [0.0; SHORT_NODES];
    for (cap, x) in caps.iter_mut().zip(x) {
        let s = 0.5 * (1.0 + x);
        *cap = exp_m1(ceilings.cap(arcs.depth * (1.0 - s * s * s)).min(MAX_LN));
    }
    caps
}

/// Expected relative error of the time before any quadrature. Measured: it decides only the tolerance of the first one (`cargo bench --bench optimal`).
pub(super) const UNKNOWN_TIME_ERROR: f64 = 0.1;

/// Error of the coarsest quadrature. Measured: coarser ones cost more steps (`cargo bench --bench optimal`).
pub(super) const QUADRATURE_ERROR: f64 = 1e-4;

fn line(problem: &Problem, q_floor: Option<f64>, beyond: f64) -> f64 {
    let law = problem.law;
    let friction = problem.friction_a();
    let origin = q_floor.unwrap_or(0.0);
    let held = |z_start: f64| {
        // An arc that leaves the bound at the anchor comes back to it with the same E.
        let z_end = turning((2.0 * phi(z_start)).sqrt()).ln_u;
        law.a * (z_end - z_start) / friction
    };
    if problem.rises() {
        let arc = problem.to.theta * held(problem.to.ln);
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

/// The offset below the predicted value, which is more often too high. Measured (`cargo bench --bench optimal`).
const LOWER: f64 = 2.7;

/// Least of them. Chosen: the time has a pole at 0.
const LEAST: f64 = 0.02;

/// Eight values of `ln u(0+)` about `near`.
fn between(near: f64) -> Lanes {
    let first = (near - LOWER).max(LEAST);
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

    /// `ln u(0+)` for a `time`, by interpolation between these eight; `None` where it is not among them. `u - 1` is at most
    /// `caps` at the nodes, which takes the time `least` where it is that all along.
    fn start<const N: usize>(&self, z: &Lanes, [time, least]: [f64; 2], caps: &[f64; N]) -> Option<f64> {
        let rule = rule(N);
        let times = ln_times(self, z, rule.x.first_chunk()?, rule.w.first_chunk()?, caps);
        let wanted = ln(time - least);
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

/// Logarithms of the times of eight arcs with these `ln u(0+)`, to about 1e-4; at least [`MAX_LN`] where there is no arc. Under
/// ceilings, of the times beyond that on the ceilings.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn ln_times<const N: usize>(arcs: &Falling, z: &Lanes, x: &[f64; N], w: &[f64; N], caps: &[f64; N]) -> Lanes {
    let Law { a, b } = arcs.law;
    let per_a = 1.0 / a;
    let (mut grow, mut bend, mut weight, mut least) = ([0.0; N], [0.0; N], [0.0; N], 0.0);
    for i in 0..N {
        // y = ln(theta/theta_0) = -depth s^3 opens the start, where u changes fast.
        let s = 0.5 * (1.0 + x[i]);
        let y = -arcs.depth * (s * s * s);
        grow[i] = exp(y);
        bend[i] = ((b - a) * y - arcs.friction * (grow[i] - 1.0)) * per_a;
        weight[i] = 1.5 * arcs.theta_0 * arcs.depth * w[i] * (s * s) * grow[i];
    }
    for i in 0..N {
        least += weight[i] / (caps[i] + f64::MIN_POSITIVE);
    }
    let (mut phi, mut time, mut ln_time) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        phi[i] = exp(z[i]) - 1.0 - z[i];
    }
    // E = phi(z_0) grow + bend.
    for node in 0..N {
        for i in 0..LANES {
            let e = phi[i] * grow[node] + bend[node];
            let e = if e > 0.0 { e } else { 0.0 };
            let excess = rough_excess((2.0 * e).sqrt(), e);
            let excess = if excess < caps[node] { excess } else { caps[node] };
            time[i] += weight[node] / (excess + f64::MIN_POSITIVE);
        }
    }
    for i in 0..LANES {
        ln_time[i] = ln(time[i] - least);
    }
    ln_time
}
