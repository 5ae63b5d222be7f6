//! The floor arc: the block slides at the bound `v = 1` while the contacts age, `theta = 1 - (1 - theta_0) e^{-t}`.

use multiversion::multiversion;

use super::lifetime::Lifetime;
use crate::model::Law;
use crate::numerics::dilogarithm::dilogarithm;
use crate::numerics::elementary::{exp_m1, ln_1p};
use crate::numerics::gauss::{Rule, SHORT_NODES, rule};
use crate::numerics::lanes::{LANES, fold};

/// Time to age by `growth`, until `rest` is left to 1.
pub(super) fn time(growth: f64, rest: f64) -> f64 {
    ln_1p(growth / rest)
}

/// Work of a floor arc of `time` that starts from the lifetime `from`: `time + b int ln theta dt`.
pub(super) fn work(law: &Law, from: Lifetime, time: f64) -> f64 {
    if time <= 0.0 {
        return 0.0;
    }
    // ln theta(t) has its singularity at t = ln(1 - theta_0) < 0: as long as the floor arc is no longer than that is away,
    // few nodes do. Beyond, theta has about doubled and a difference of dilogarithms does not cancel.
    let integral = if time <= -ln_1p(-from.theta) {
        time * from.ln + ln_growth_integral(from.rest / from.theta, time, rule(SHORT_NODES))
    } else {
        let to = from.aged(time);
        if from.theta >= 0.5 { dilogarithm(to.rest) - dilogarithm(from.rest) } else { aged(to) - aged(from) }
    };
    time + law.b * integral
}

/// `int ln(theta/theta_0) dt`, of `theta/theta_0 = 1 + ratio (1 - e^{-t})`.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn ln_growth_integral(ratio: f64, time: f64, rule: &Rule) -> f64 {
    let half = 0.5 * time;
    let mut sum = [0.0; LANES];
    for (x, w) in rule.x.as_chunks::<LANES>().0.iter().zip(rule.w.as_chunks::<LANES>().0) {
        for i in 0..LANES {
            sum[i] += w[i] * ln_1p(-ratio * exp_m1(-half * (1.0 + x[i])));
        }
    }
    half * fold(&sum)
}

/// `int_0^theta ln y/(1 - y) dy = Li_2(1 - theta) - pi^2/6`, to full relative accuracy as `theta -> 0`.
fn aged(Lifetime { theta, rest, ln }: Lifetime) -> f64 {
    if theta < 0.5 {
        -(ln_1p(-theta) * ln + dilogarithm(theta))
    } else {
        dilogarithm(rest) - std::f64::consts::PI * std::f64::consts::PI / 6.0
    }
}

/// `C` of the arc that leaves the bound at `theta`: `a - (1 + a + b ln theta)/theta`, rising with theta where `tau > b
/// - a`.
pub(super) fn c_leaving(law: &Law, theta: f64, ln_theta: f64) -> f64 {
    law.a - (1.0 + law.a + law.b * ln_theta) / theta
}

/// The state at which an arc with a given `C` leaves the floor, relative to `theta_r`: `ln(theta_c/theta_r)`.
///
/// `kappa` is `theta_r (C - C_leaving(theta_r))`, so that nothing cancels where the arc leaves near the reference. The
/// equation is `(A - kappa)(e^d - 1) - b d - kappa = 0` with `A = 1 + a + b ln theta_r`, convex and rising at the root
/// sought. `None` if there is no root.
pub(super) fn leave(law: &Law, ln_theta_r: f64, kappa: f64) -> Option<f64> {
    let slope = 1.0 + law.a + law.b * ln_theta_r - kappa;
    if slope <= 0.0 {
        return None;
    }
    let mut d = ln_1p(kappa / slope);
    for _ in 0..100 {
        let m = exp_m1(d);
        let derivative = slope * (1.0 + m) - law.b;
        if derivative.is_nan() || derivative <= 0.0 {
            return None;
        }
        let step = (slope * m - law.b * d - kappa) / derivative;
        d -= step;
        if step.abs() <= 1e-15 * d.abs() {
            return Some(d);
        }
    }
    // Rounding keeps the last steps at an ulp or two.
    d.is_finite().then_some(d)
}
