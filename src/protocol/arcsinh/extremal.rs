//! Extremals of regularised friction and their quadratures.
//!
//! Along an extremal `tau + a f (1 - u) = theta H`. With the *level* `L_1` of steady sliding at theta, `p = ln u` and `d = (tau_ss(theta) - theta H)/a`
//! this is `f (u - 1) - [tau(L_1 + p) - tau(L_1)]/a = d`: the left side falls for `u < 1` and rises for `u > 1`, so each `d > 0` has one root on
//! either side. For the logarithm it is `u - 1 - ln u = d`, the [turning function](crate::numerics::turning).

use crate::model::Law;
use crate::model::arcsinh::{LOG_LEVEL, friction_rise, reduction, scaled_friction, steady_level};
use crate::numerics::adaptive::{COARSE_RTOL, integrals};
use crate::numerics::elementary::{exp, exp_m1, ln};
use crate::numerics::gauss::rule;
use crate::numerics::root::{LAST_STEP_RESIDUAL, Probe, newton};
use crate::numerics::turning::turning;
use crate::numerics::{MIN_INVERTIBLE, golden_section};
use crate::protocol::SolverStats;

/// The coordinate along an extremal.
#[derive(Debug, Clone, Copy)]
enum Chart {
    /// `theta = theta_h e^{-x^2}` around the turning point, where `u = 1`: theta rises for `x < 0` and falls for `x > 0`.
    Turning { ln_theta: f64, theta: f64, level: f64, friction: f64 },
    /// `theta = theta_0 e^{-x}` from the start; theta falls. `theta_0 H/a` is the scale.
    Falling { ln_theta: f64, theta: f64, level: f64, scale: f64 },
}

/// An extremal between two coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extremal {
    pub law: Law,
    chart: Chart,
    from: f64,
    length: f64,
}

/// A point of an extremal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub ln_theta: f64,
    pub theta: f64,
    /// `ln u`.
    pub ln_u: f64,
    /// `u - 1`.
    excess: f64,
    /// Level of friction, `ln v + (1 + b ln theta)/a`.
    level: f64,
    /// `-d ln theta/dx`.
    slope: f64,
}

/// Integrals along an extremal.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    pub time: f64,
    /// Slip, `int v dt`, weighted by theta: `int u dt`.
    pub lag: f64,
    pub work: f64,
    /// `dW/da` and `dW/db` at fixed path.
    pub by_law: [f64; 2],
}

impl Extremal {
    /// The extremal around the turning point at `ln theta`, from the coordinate `from` over `length`.
    pub fn turning(law: Law, ln_theta: f64, from: f64, length: f64) -> Extremal {
        let level = steady_level(&law, ln_theta);
        let chart = Chart::Turning { ln_theta, theta: exp(ln_theta), level, friction: scaled_friction(level) };
        Extremal { law, chart, from, length }
    }

    /// The extremal that starts at `ln theta` with `ln u > 0`, until theta has fallen by the factor `e^-length`.
    pub fn falling(law: Law, ln_theta: f64, ln_u: f64, length: f64) -> Extremal {
        let level = steady_level(&law, ln_theta);
        let scale = scaled_friction(level + ln_u) - reduction(level + ln_u).0 * exp_m1(ln_u);
        Extremal { law, chart: Chart::Falling { ln_theta, theta: exp(ln_theta), level, scale }, from: 0.0, length }
    }

    /// The part between two fractions of the length.
    pub fn part(&self, [from, to]: [f64; 2]) -> Extremal {
        Extremal { from: self.from + from * self.length, length: (to - from) * self.length, ..*self }
    }

    /// The Hamiltonian `H = dW/dt_f`.
    pub fn hamiltonian(&self) -> f64 {
        match self.chart {
            Chart::Turning { theta, friction, .. } => self.law.a * friction / theta,
            Chart::Falling { theta, scale, .. } => self.law.a * scale / theta,
        }
    }

    /// `ln theta` of the turning point, if it lies on the extremal.
    pub fn turning_point(&self) -> Option<f64> {
        match self.chart {
            Chart::Turning { ln_theta, .. } if self.from < 0.0 && self.from + self.length > 0.0 => Some(ln_theta),
            _ => None,
        }
    }

    /// The point at the coordinate `from + fraction * length`; `None` where there is no root.
    pub fn at(&self, fraction: f64) -> Option<Point> {
        self.place(self.from + fraction * self.length)
    }

    fn place(&self, x: f64) -> Option<Point> {
        let Law { a, b } = self.law;
        let gain = (b - a) / a;
        match self.chart {
            Chart::Turning { ln_theta, theta, level, .. } if x == 0.0 => {
                Some(Point { ln_theta, theta, ln_u: 0.0, excess: 0.0, level, slope: 0.0 })
            }
            Chart::Turning { ln_theta, theta, level, friction } => {
                let fall = x * x;
                let target = friction * exp(-fall);
                // Near the turning point the frictions are almost equal, and far from it their changes.
                let deficit = if fall > FAR_FALL {
                    scaled_friction(level - gain * fall) - target
                } else {
                    friction_rise(level, -gain * fall) - friction * exp_m1(-fall)
                };
                let ln_u = velocity(level - gain * fall, target, deficit, x < 0.0)?;
                let level = level - gain * fall + ln_u;
                let (ln_theta, theta) = (ln_theta - fall, theta * exp(-fall));
                Some(Point { ln_theta, theta, ln_u, excess: exp_m1(ln_u), level, slope: 2.0 * x })
            }
            Chart::Falling { ln_theta, theta, level, scale } => {
                let steady = level - gain * x;
                let target = scale * exp(-x);
                let ln_u = velocity(steady, target, scaled_friction(steady) - target, false)?;
                let (ln_theta, theta) = (ln_theta - x, theta * exp(-x));
                Some(Point { ln_theta, theta, ln_u, excess: exp_m1(ln_u), level: steady + ln_u, slope: 1.0 })
            }
        }
    }

    /// The integrals along the extremal, to rounding of those of the `whole` of which it is a part; `None` if it does not exist throughout.
    pub fn sums(&self, whole: &Sums, stats: &mut SolverStats) -> Option<Sums> {
        let (from, to) = (self.from, self.from + self.length);
        stats.quadratures += 1;
        let panels = if from < 0.0 && to > 0.0 { vec![(from, -from), (0.0, to)] } else { vec![(from, self.length)] };
        // Time, lag and work are positive.
        let (sums, nodes) = integrals(|x| self.terms(x), panels, &[whole.time, whole.lag, whole.work], COARSE_RTOL)?;
        stats.nodes += nodes;
        let [time, lag, work, a, b] = sums;
        Some(Sums { time, lag, work, by_law: [a, b] })
    }

    /// The integrands of [`Sums`] at a coordinate.
    fn terms(&self, x: f64) -> Option<[f64; 5]> {
        let place = self.place(x)?;
        let time = place.slope * place.theta / place.excess;
        // v dt.
        let slip = place.slope * exp(place.ln_u) / place.excess;
        let (friction, reduced) = (scaled_friction(place.level), reduction(place.level).0);
        let by_a = friction - reduced * (1.0 + self.law.b * place.ln_theta) / self.law.a;
        Some([time, slip * place.theta, slip * self.law.a * friction, slip * by_a, slip * reduced * place.ln_theta])
    }

    /// The greatest friction along the extremal.
    pub fn friction_max(&self) -> Option<f64> {
        let friction = |fraction: f64| Some(self.law.a * scaled_friction(self.at(fraction)?.level));
        let values: Option<Vec<f64>> = (0..=INTERVALS).map(|i| friction(f64::from(i) / f64::from(INTERVALS))).collect();
        let values = values?;
        let (best, _) = values.iter().enumerate().max_by(|x, y| x.1.total_cmp(y.1))?;
        let width = 1.0 / f64::from(INTERVALS);
        let place = best as f64 * width;
        let around = ((place - width).max(0.0), (place + width).min(1.0));
        let (_, least) = golden_section::least(|fraction| -friction(fraction).unwrap_or(f64::NEG_INFINITY), around);
        Some(values[best].max(-least))
    }
}

/// Intervals of an extremal, inside which friction has at most one maximum. Measured: with so many, all random optima of the physical domain can be
/// traced (`cargo test --release random_optima`).
pub(super) const INTERVALS: u32 = 32;

impl Point {
    /// The velocity; 0 below the normal numbers.
    pub fn velocity(&self) -> f64 {
        let v = exp(self.ln_u) / self.theta;
        if v < MIN_INVERTIBLE { 0.0 } else { v }
    }

    /// Friction.
    pub fn friction(&self, law: &Law) -> f64 {
        law.a * scaled_friction(self.level)
    }

    /// The price of theta, `dW/dtheta` of the rest of the protocol: `(tau + a f)/theta`.
    pub fn costate(&self, law: &Law) -> f64 {
        law.a * (scaled_friction(self.level) + reduction(self.level).0) / self.theta
    }
}

/// `f (u - 1) - [tau(L_1 + p) - tau(L_1)]/a` at `p = ln u` and the level `L_1 = steady`.
fn surplus(steady: f64, p: f64) -> f64 {
    if p.abs() > NEAR_STEADY {
        return reduction(steady + p).0 * exp_m1(p) - friction_rise(steady, p);
    }
    // Both terms agree to first order in p: the integral of the slope does not cancel.
    let (half, rule) = (0.5 * p, rule(NODES));
    let nodes = rule.x.iter().zip(&rule.w);
    half * nodes.map(|(x, w)| w * surplus_slope(steady, half * (1.0 + x))).sum::<f64>()
}

/// The derivative of [`surplus`] with respect to `p`.
fn surplus_slope(steady: f64, p: f64) -> f64 {
    let (f, rest) = reduction(steady + p);
    exp_m1(p) * f * (1.0 + rest)
}

/// Fall of `ln theta` from which frictions are compared instead of their changes. Derived: either loses less than a digit there.
const FAR_FALL: f64 = 0.5;

/// `|ln u|` up to which [`surplus`] is an integral, and the nodes of that. Derived: the difference loses one digit beyond; the singularities
/// `pi/2` from the real axis leave `120^-8`.
const NEAR_STEADY: f64 = 0.05;
const NODES: usize = 4;

/// `ln u` at the level `steady` of `u = 1`, where `tau/a + f (1 - u) = target` and `deficit` is how far this is below steady friction; below 0 if
/// theta `rises`.
fn velocity(steady: f64, target: f64, deficit: f64, rises: bool) -> Option<f64> {
    if deficit.is_nan() || deficit <= 0.0 || rises && target <= 0.0 {
        return None;
    }
    let w = (2.0 * deficit).sqrt();
    let guess = turning(if rises { -w } else { w }).ln_u;
    if (steady + guess).min(steady) > LOG_LEVEL {
        return Some(guess);
    }
    let near = |p: f64, size: f64| Probe {
        value: (deficit - surplus(steady, p)) / size,
        slope: -surplus_slope(steady, p) / size,
    };
    if !rises {
        let probe = |p: f64| {
            let Probe { value, slope } = near(p, deficit);
            Some(Probe { value: -value, slope: -slope })
        };
        return newton(probe, guess, (0.0, f64::INFINITY), true, LAST_STEP_RESIDUAL).map(|root| root.x);
    }
    if deficit < target {
        return newton(|p| Some(near(p, deficit)), guess, (f64::NEG_INFINITY, 0.0), true, LAST_STEP_RESIDUAL)
            .map(|root| root.x);
    }
    // Friction is small: its own equation keeps the digits.
    let far = |p: f64| {
        let (f, rest) = reduction(steady + p);
        let value = scaled_friction(steady + p) - f * exp_m1(p) - target;
        Some(Probe { value: value / target, slope: -exp_m1(p) * f * (1.0 + rest) / target })
    };
    // Of tau/a + f = target, without u.
    let friction = if target < 1.0 { 0.5 * target } else { target - 0.9 };
    let at_rest = if friction < 20.0 { ln(exp_m1(2.0 * friction)) - friction - steady } else { guess };
    newton(far, at_rest.min(0.5 * guess), (f64::NEG_INFINITY, 0.0), true, LAST_STEP_RESIDUAL).map(|root| root.x)
}
