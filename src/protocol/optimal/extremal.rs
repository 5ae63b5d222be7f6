//! The one-parameter family of extremals between two values of the state variable, ordered so that the total time is monotone in
//! the parameter.
//!
//! The parameter `q` is 0 where the turning point sits at the end of larger theta (docs/derivations.md, "One parameter for
//! every case"):
//!
//! - falling problems (`theta_0 >= theta_1`): `q > 0` is `ln u(0+)`, theta falls at once; `q < 0` is the scaled start
//!   of the turning chart, theta rises first; below `q_floor` a floor arc of `q_floor - q`, in units of theta at the
//!   anchor, comes before the arc. Time falls with `q`.
//! - rising problems (`theta_0 < theta_1`): `q < 0` is `ln u(t_f-)`, theta still rises at the end (with the bound it is
//!   stretched so that `v(t_f-) = 1` lies at minus infinity); `q > 0` is the scaled end of the turning chart, theta
//!   falls at the end; above `q_floor` the floor arc is `q - q_floor` of those units longer than the shortest protocol. Time
//!   rises with `q`.
//!
//! A search counts `q` from `q_floor` where that exists, so that short floor arcs keep their digits.

use super::arc::{Arc, Chart, Sums, omega, steady_friction};
use super::floor;
use super::lifetime::Lifetime;
use crate::model::Law;
use crate::numerics::MAX_LN;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p, phi, phi_and_slope};
use crate::numerics::root::Probe;
use crate::numerics::turning::Turning;

/// The optimal-control problem: two states, and whether `v >= 1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Problem {
    pub law: Law,
    /// State variable at the start, not necessarily steady.
    pub from: Lifetime,
    /// State variable at the end.
    pub to: Lifetime,
    /// `theta_0/theta_1 - 1`, of these two, from the velocities, free of cancellation.
    pub fall: f64,
    pub bounded: bool,
}

/// One member of the family.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extremal {
    pub time_at_floor: f64,
    /// State variable where the arc starts.
    pub theta_s: f64,
    /// By how much later than `t_min` the arc starts (negative: sooner), free of cancellation; for arcs of rising problems
    /// that are parametrised by their end, what is to be added to their lag instead of their time.
    late: f64,
    /// Whether it is.
    lags: bool,
    pub arc: Arc,
    /// `ln u` at the start and at the end of the arc.
    pub start: f64,
    pub end: f64,
    /// The time as a function of the parameter.
    rate: Rate,
}

/// Derivative of the total time with respect to `q`, up to the interior sum `I` of the quadrature.
#[derive(Debug, Clone, Copy)]
enum Rate {
    /// `gain (I + inner) + outer`, where `outer` belongs to the start of the arc and `inner` to its end; where theta falls
    /// at once, also `one_way` times the swing.
    Turning { gain: f64, inner: f64, outer: f64, one_way: f64 },
    /// `gain (I + inner) + outer`, where `inner` belongs to the start and `outer` to the end.
    Ending { gain: f64, inner: f64, outer: f64 },
    /// `gain` times the swing, for arcs on which theta goes one way.
    OneWay { gain: f64 },
}

/// What an extremal does before its arc, with the fields of [`Extremal`].
struct Leaving {
    time_at_floor: f64,
    theta_s: f64,
    late: f64,
    lags: bool,
}

impl Leaving {
    /// The extremal that goes on along `arc`, with `ln u` from `start` to `end`.
    fn along(self, arc: Arc, start: f64, end: f64, rate: Rate) -> Extremal {
        let Leaving { time_at_floor, theta_s, late, lags } = self;
        Extremal { time_at_floor, theta_s, late, lags, arc, start, end, rate }
    }
}

impl Problem {
    pub fn rises(&self) -> bool {
        self.fall < 0.0
    }

    /// `ln(theta_0/theta_1)`, free of cancellation.
    pub fn depth(&self) -> f64 {
        if self.fall < -0.5 { self.from.ln - self.to.ln } else { ln_1p(self.fall) }
    }

    /// The least time of a rising problem (0 for a falling one): `v = 1` or, without the bound, `v = 0` throughout.
    pub fn t_min(&self) -> f64 {
        match (self.rises(), self.bounded) {
            (false, _) => 0.0,
            (true, true) => floor::time(-self.fall * self.to.theta, self.to.rest),
            (true, false) => -self.fall * self.to.theta,
        }
    }

    /// The growth of theta at rest beyond `t_min`, without cancellation; at most 0.
    pub fn rest_beyond(&self) -> f64 {
        if !(self.rises() && self.bounded) {
            return 0.0;
        }
        self.growth_beyond(-self.fall * self.to.theta)
    }

    /// `growth - ln(1 + growth/rest)`: what a growth of theta up to its end takes at rest, less what it takes at `v = 1`.
    fn growth_beyond(&self, growth: f64) -> f64 {
        let time = floor::time(growth, self.to.rest);
        if time > 1.0 { growth - time } else { phi(time) - growth * self.to.theta / self.to.rest }
    }

    /// An extremal counts as the only one if friction exceeds this, `max(0, b - a)`, all along it.
    pub fn unique_above(&self) -> f64 {
        (self.law.b - self.law.a).max(0.0)
    }

    /// Whether a steady state at either end is already outside of where extremals are unique.
    pub fn is_doubtful(&self) -> bool {
        [self.friction_start(), self.friction_end()].iter().any(|&tau| tau <= self.unique_above())
    }

    /// The end of larger theta, where the parameter is anchored.
    pub fn anchor(&self) -> Lifetime {
        if self.rises() { self.to } else { self.from }
    }

    /// Theta at the anchor, also the unit of time of the floor arcs that the parameter counts.
    pub fn theta_a(&self) -> f64 {
        self.anchor().theta
    }

    /// Friction at the anchor with `u = 1`.
    pub fn friction_a(&self) -> f64 {
        steady_friction(&self.law, self.anchor().ln)
    }

    /// Friction at the start with `u = 1`, `tau_ss(v_i)` where that is steady.
    pub fn friction_start(&self) -> f64 {
        steady_friction(&self.law, self.from.ln)
    }

    /// Friction at the end with `u = 1`, `tau_ss(v_f)` where that is steady.
    pub fn friction_end(&self) -> f64 {
        steady_friction(&self.law, self.to.ln)
    }

    /// Scale of the turning layer at the anchor, `w = X/layer`; NaN where `tau <= b - a` there.
    fn layer(&self) -> f64 {
        (self.law.a / (2.0 * (self.friction_a() + self.law.a - self.law.b))).sqrt()
    }

    /// The parameter beyond which a floor arc parametrises the family (`None`: never).
    pub fn q_floor(&self) -> Option<f64> {
        if !self.bounded {
            return None;
        }
        // v = 1 at the anchor.
        let z = self.anchor().ln;
        let c_a = self.law.a * phi(z) - self.friction_a();
        let xi = turning_distance(&self.law, self.law.a * phi(z), -c_a)?;
        let q = xi.sqrt() / self.layer();
        Some(if self.rises() { q } else { -q })
    }

    /// About how far from 0 the parameter is of a protocol that takes `beyond` more than the least time.
    pub fn reach(&self, beyond: f64) -> f64 {
        beyond * self.friction_a().abs() / (self.law.a * self.theta_a()) + self.depth().abs()
    }

    /// Bounds of the parameter, counted from `q_floor`: a floor arc cannot last longer than the whole, and `e^q` must stay a
    /// number.
    pub fn bracket(&self, q_floor: Option<f64>, beyond: f64) -> (f64, f64) {
        match (self.rises(), q_floor) {
            (false, Some(q_floor)) => (-beyond / self.theta_a(), MAX_LN - q_floor),
            (false, None) => (f64::NEG_INFINITY, MAX_LN),
            (true, Some(_)) => (f64::NEG_INFINITY, beyond / self.theta_a()),
            (true, None) => (f64::NEG_INFINITY, f64::INFINITY),
        }
    }

    /// Both arcs of a rising problem that start at `v = 1` from `theta_0` without a floor arc: theta still rising at the
    /// end, and falling. `None` if they turn below `theta_1`.
    pub fn free_window(&self) -> Option<[Extremal; 2]> {
        let law = self.law;
        let ln_theta = self.from.ln;
        let excess = law.a * phi(ln_theta);
        let xi = turning_distance(&law, excess, self.friction_start() - excess)?;
        let x_squares = (1.0 + xi) * self.fall;
        let x = (xi + x_squares).sqrt();
        let one = |x_end: f64| {
            let (theta_h, ln_theta_h) = (self.from.theta * (1.0 + xi), ln_theta + ln_1p(xi));
            let arc = Arc { law, chart: Chart::Turning { theta_h, ln_theta_h, x_start: -xi.sqrt(), x_end, x_squares } };
            // No parameter leads along these arcs.
            Some(self.at_once().along(arc, ln_theta, arc.end()?.ln_u, Rate::OneWay { gain: 0.0 }))
        };
        if x > 0.0 { Some([one(-x)?, one(x)?]) } else { None }
    }

    /// The member at parameter `p`, which is `q - q_floor`, or `q` where there is no `q_floor`; `None` where the extremal
    /// does not exist.
    pub fn extremal(&self, p: f64, q_floor: Option<f64>) -> Option<Extremal> {
        let unit = self.theta_a();
        let q = p + q_floor.unwrap_or(0.0);
        match (self.rises(), q_floor) {
            (false, Some(_)) if p < 0.0 => self.after_hold(self.from, self.fall, -p * unit, -unit),
            (true, Some(_)) if p > 0.0 => self.after_hold(self.to, 0.0, p * unit, unit),
            (false, _) if q > 0.0 => self.falling_at_once(q),
            (false, _) => self.rising_first(q),
            (true, _) if q < 0.0 => self.rising_to_the_end(q),
            (true, _) => self.falling_at_the_end(q),
        }
    }

    /// A floor arc that ends `time` after the lifetime `since`, which is `fall` above `theta_1`, then an arc through its
    /// turning point down to `theta_1`.
    fn after_hold(&self, since: Lifetime, fall: f64, time: f64, unit: f64) -> Option<Extremal> {
        let law = self.law;
        let (released, growth) = since.aged_by(time);
        let Lifetime { theta, rest, ln: z } = released;
        let excess = law.a * phi(z);
        let xi = turning_distance(&law, excess, steady_friction(&law, z) - excess)?;
        let (theta_h, ln_theta_h) = (theta * (1.0 + xi), z + ln_1p(xi));
        // theta_c/theta_1 - 1.
        let fall = fall + growth / self.to.theta;
        let x_squares = (1.0 + xi) * fall;
        let (x_start, x_end) = (-xi.sqrt(), (xi + x_squares).sqrt());
        let arc = Arc { law, chart: Chart::Turning { theta_h, ln_theta_h, x_start, x_end, x_squares } };
        let end = arc.end()?;
        let c_h = steady_friction(&law, ln_theta_h);
        // d ln theta_h/d ln theta_c from C(theta_h) = C_leaving(theta_c); the floor arc's own time cancels against the start
        // of the arc.
        let m = (1.0 + law.a - law.b + law.b * z) / theta * theta_h / (c_h + law.a - law.b);
        let (gain, inner) = (unit * m * rest / theta, self.to.theta / end.excess);
        let rate = Rate::Turning { gain, inner, outer: unit * m, one_way: 0.0 };
        let leaving = Leaving { time_at_floor: self.t_min() + time, theta_s: theta, late: time, lags: false };
        Some(leaving.along(arc, z, end.ln_u, rate))
    }

    /// The start without a floor arc.
    fn at_once(&self) -> Leaving {
        Leaving { time_at_floor: 0.0, theta_s: self.from.theta, late: self.rest_beyond(), lags: self.rises() }
    }

    /// Falling problem, `q = ln u(0+) > 0`.
    fn falling_at_once(&self, z_0: f64) -> Option<Extremal> {
        let law = self.law;
        let (phi_0, excess_0) = phi_and_slope(z_0);
        let excess = law.a * phi_0;
        let friction_a = self.friction_a();
        let pull = friction_a - excess;
        let one_way = -excess_0 / self.from.theta;
        if let Some(xi) = turning_distance(&law, excess, pull).filter(|&xi| xi <= 1.0) {
            let x_squares = (1.0 + xi) * self.fall;
            let (theta_h, ln_theta_h) = (self.from.theta * (1.0 + xi), self.from.ln + ln_1p(xi));
            let (x_start, x_end) = (xi.sqrt(), (xi + x_squares).sqrt());
            let arc = Arc { law, chart: Chart::Turning { theta_h, ln_theta_h, x_start, x_end, x_squares } };
            let end = arc.end()?;
            let c_h = steady_friction(&law, ln_theta_h);
            let swing = law.a * (1.0 + xi) / (c_h + law.a - law.b);
            let rate = if x_squares < xi {
                // A short arc: both ends would cancel.
                Rate::OneWay { gain: one_way }
            } else {
                Rate::Turning {
                    gain: swing * excess_0,
                    inner: self.to.theta / end.excess,
                    outer: -self.from.theta * swing,
                    one_way,
                }
            };
            return Some(self.at_once().along(arc, z_0, end.ln_u, rate));
        }
        let y_end = -self.depth();
        let chart = Chart::Direct { theta_a: self.from.theta, z_a: z_0, friction_a, y_start: 0.0, y_end };
        let arc = Arc { law, chart };
        Some(self.at_once().along(arc, z_0, arc.end()?.ln_u, Rate::OneWay { gain: one_way }))
    }

    /// Falling problem, `q <= 0`: `X = layer q` at the start.
    fn rising_first(&self, q: f64) -> Option<Extremal> {
        let law = self.law;
        let layer = self.layer();
        let x_start = layer * q;
        let x2 = x_start * x_start;
        let grow = 1.0 + x2;
        let (theta_h, ln_theta_h) = (self.from.theta * grow, self.from.ln + ln_1p(x2));
        let x_squares = grow * self.fall;
        let x_end = (x2 + x_squares).sqrt();
        let arc = Arc { law, chart: Chart::Turning { theta_h, ln_theta_h, x_start, x_end, x_squares } };
        let (start, end) = (arc.start()?, arc.end()?);
        let rate = Rate::Turning {
            gain: layer * 2.0 * x_start / grow,
            inner: if end.excess == 0.0 { 0.0 } else { self.to.theta / end.excess },
            outer: -layer * edge(&law, theta_h, ln_theta_h, x_start, &start),
            one_way: 0.0,
        };
        Some(self.at_once().along(arc, start.ln_u, end.ln_u, rate))
    }

    /// Rising problem, `q < 0`: `ln u(t_f-)`, stretched under the bound.
    fn rising_to_the_end(&self, q: f64) -> Option<Extremal> {
        let reach = -self.to.ln;
        // ln v(t_f-), and ln u(t_f-).
        let (eta, z_1, stretch) = if self.bounded {
            let shrink = exp(q / reach);
            (reach * shrink, reach * exp_m1(q / reach), shrink)
        } else {
            (q + reach, q, 1.0)
        };
        self.arriving(z_1, eta, stretch)
    }

    /// Rising problem: the member whose `ln u(t_f-)` is `z_1`, with `eta = ln v(t_f-)` and the derivative `stretch` of
    /// `z_1` with respect to the parameter.
    pub fn arriving(&self, z_1: f64, eta: f64, stretch: f64) -> Option<Extremal> {
        let law = self.law;
        let (phi_1, excess_1) = phi_and_slope(z_1);
        let excess = law.a * phi_1;
        let friction_a = self.friction_a();
        let pull = friction_a - excess;
        let (leaving, d) = self.leaving(law.a * (self.to.theta * exp_m1(eta) - eta));
        let rising = Rate::OneWay { gain: -stretch * excess_1 / self.to.theta };
        if let Some(xi) = turning_distance(&law, excess, pull).filter(|&xi| xi <= 1.0) {
            let (theta_h, ln_theta_h) = (self.to.theta * (1.0 + xi), self.to.ln + ln_1p(xi));
            let x_squares = -(1.0 + xi) * exp_m1(-d);
            let (x_start, x_end) = (-(xi - x_squares).sqrt(), -xi.sqrt());
            let arc = Arc { law, chart: Chart::Turning { theta_h, ln_theta_h, x_start, x_end, x_squares } };
            let start = arc.start()?;
            let c_h = steady_friction(&law, ln_theta_h);
            let swing = law.a * (1.0 + xi) / (c_h + law.a - law.b);
            let rate = if z_1 < -1.0 || -x_squares < xi {
                rising
            } else {
                Rate::Ending {
                    gain: stretch * swing * excess_1,
                    inner: -leaving.theta_s / start.excess,
                    outer: stretch * self.to.theta * swing,
                }
            };
            return Some(leaving.along(arc, start.ln_u, z_1, rate));
        }
        let chart = Chart::Direct { theta_a: self.to.theta, z_a: z_1, friction_a, y_start: d, y_end: 0.0 };
        let arc = Arc { law, chart };
        Some(leaving.along(arc, arc.start()?.ln_u, z_1, rising))
    }

    /// Rising problem, `q >= 0`: `X = layer q` at the end.
    fn falling_at_the_end(&self, q: f64) -> Option<Extremal> {
        let law = self.law;
        let layer = self.layer();
        let x_end = layer * q;
        let x2 = x_end * x_end;
        let grown = ln_1p(x2);
        let (theta_h, ln_theta_h) = (self.to.theta * (1.0 + x2), self.to.ln + grown);
        let c_h = steady_friction(&law, ln_theta_h);
        let excess = (law.a - law.b) * grown + c_h * x2 / (1.0 + x2);
        let (leaving, d) = self.leaving(excess - law.a * phi(self.to.ln));
        let x_squares = -(1.0 + x2) * exp_m1(-d);
        let x_start = -(x2 - x_squares).sqrt();
        let arc = Arc { law, chart: Chart::Turning { theta_h, ln_theta_h, x_start, x_end, x_squares } };
        let (start, end) = (arc.start()?, arc.end()?);
        let rate = Rate::Ending {
            gain: layer * 2.0 * x_end / (1.0 + x2),
            inner: -leaving.theta_s / start.excess,
            outer: layer * edge(&law, theta_h, ln_theta_h, x_end, &end),
        };
        Some(leaving.along(arc, start.ln_u, end.ln_u, rate))
    }

    /// The member that turns at the lifetime `turn`, `depth = ln(turn/theta_1)`, where theta rises first; the parameter is
    /// `ln theta_h` times `gain`.
    pub fn turning_at(&self, turn: Lifetime, depth: f64, gain: f64) -> Option<Extremal> {
        let law = self.law;
        let below = Problem { to: turn, fall: self.from.theta / turn.theta - 1.0, ..*self };
        let (leaving, d) = below.leaving(-law.a * phi(turn.ln));
        let (grown, shrunk) = (exp_m1(-d), exp_m1(depth));
        let (x_start, x_end) = (-grown.sqrt(), shrunk.sqrt());
        let chart =
            Chart::Turning { theta_h: turn.theta, ln_theta_h: turn.ln, x_start, x_end, x_squares: shrunk - grown };
        let arc = Arc { law, chart };
        let (start, end) = (arc.start()?, arc.end()?);
        let (inner, outer) = (self.to.theta / end.excess, -gain * leaving.theta_s / start.excess);
        let rate = Rate::Turning { gain, inner, outer, one_way: 0.0 };
        Some(leaving.along(arc, start.ln_u, end.ln_u, rate))
    }

    /// For a rising problem: the start and where it ends, `ln(theta_s/theta_1)`, from `kappa = theta_1 (C - C_leaving(theta_1))`.
    fn leaving(&self, kappa: f64) -> (Leaving, f64) {
        let all = self.depth();
        let at_once = (self.at_once(), all);
        if !self.bounded {
            return at_once;
        }
        // Where no arc leaves the bound (friction at v = 1 too low) only the protocol without a floor arc is left.
        let Some(d) = floor::leave(&self.law, self.to.ln, kappa).filter(|&d| d > all) else {
            return at_once;
        };
        let held = self.to.theta * exp_m1(d) - self.fall * self.to.theta;
        if held <= 0.0 {
            return at_once;
        }
        // 1 - theta_s comes from theta_1: it is a small difference where v_f is near 1.
        let left = -self.to.theta * exp_m1(d);
        let time_at_floor = floor::time(held, self.to.rest + left);
        let theta_s = if time_at_floor > 0.0 { self.to.theta * exp(d) } else { self.from.theta };
        (Leaving { time_at_floor, theta_s, late: self.growth_beyond(left), lags: true }, d)
    }
}

impl Extremal {
    /// Work of the floor arc and the free arc together.
    pub fn work(&self, problem: &Problem, sums: &Sums) -> f64 {
        floor::work(&problem.law, problem.from, self.time_at_floor) + sums.work
    }

    /// Total time.
    pub fn time(&self, sums: &Sums) -> f64 {
        self.time_at_floor + sums.time
    }

    /// The total time beyond the least time `t_min` of the problem.
    pub fn time_beyond(&self, sums: &Sums) -> f64 {
        self.late + if self.lags { sums.lag } else { sums.time }
    }

    /// Makes a parameter that of an extremal without a turn, which ends at `ln u = z`: `C` changes by `z pace` with it.
    pub fn follow_c(&mut self, z: f64, pace: f64) {
        let Law { a, b } = self.arc.law;
        self.rate = match (self.arc.chart, self.rate) {
            // d time/dC = (I + theta/(u - 1) - theta_s/(u_s - 1))/k, where C = -c_h/theta_h changes by k d ln theta_h.
            (Chart::Turning { theta_h, ln_theta_h, x_end, x_squares, .. }, Rate::Ending { inner, .. })
                if -x_squares > x_end * x_end =>
            {
                let k = (steady_friction(&self.arc.law, ln_theta_h) + a - b) / theta_h;
                let regular = if z == 0.0 { 1.0 } else { z / exp_m1(z) };
                let outer = theta_h / (1.0 + x_end * x_end) * regular * pace / k;
                Rate::Ending { gain: z * pace / k, inner, outer }
            }
            _ => Rate::OneWay { gain: -z * pace / a },
        };
    }

    /// What the start and the end of the arc add to the sums over free pieces.
    #[inline(always)]
    pub fn end_terms(&self) -> [f64; 2] {
        match self.rate {
            Rate::Turning { inner, .. } => [0.0, inner],
            Rate::Ending { inner, .. } => [inner, 0.0],
            Rate::OneWay { .. } => [0.0, 0.0],
        }
    }

    /// Derivative of the total time with respect to the parameter, from the `sums` over all free pieces, and over their `ends` of
    /// `theta/(u - 1)`, that at the start of each less, and of [`Extremal::end_terms`]. The start and the end of the extremal are
    /// among the pieces where `has` states so.
    #[inline(always)]
    pub fn rate_of(&self, sums: &Sums, ends: f64, has: [bool; 2]) -> f64 {
        let &Sums { sensitivity, swing, .. } = sums;
        let inside = |gain: f64| gain * (sensitivity + ends);
        match self.rate {
            Rate::Turning { one_way, .. } if !has[0] && one_way != 0.0 => one_way * swing,
            Rate::Turning { gain, outer, .. } => inside(gain) + if has[0] { outer } else { 0.0 },
            Rate::Ending { gain, outer, .. } => inside(gain) + if has[1] { outer } else { 0.0 },
            Rate::OneWay { gain } => gain * swing,
        }
    }

    /// How far the time (beyond the least) is from the one wanted, as a rising function of the parameter: the logarithm
    /// of their ratio, or their relative difference where a floor arc makes time linear in the parameter.
    pub fn probe(&self, problem: &Problem, sums: &Sums, beyond: f64) -> Probe {
        let time = self.time_beyond(sums);
        let [start, end] = self.end_terms();
        let rate = self.rate_of(sums, start + end, [true; 2]);
        let floor_counts = self.time_at_floor > 0.0 && !self.lags;
        let (value, slope) = if floor_counts {
            (time / beyond - 1.0, rate / beyond)
        } else if time > 0.0 {
            (ln(time / beyond), rate / time)
        } else {
            (f64::MIN, 0.0)
        };
        if problem.rises() { Probe { value, slope } } else { Probe { value: -value, slope: -slope } }
    }
}

/// `d time/dX` at an end of the turning chart: `2 theta_h X/((1 + X^2)^2 (u - 1))`, regular at `X = 0`.
fn edge(law: &Law, theta_h: f64, ln_theta_h: f64, x: f64, at: &Turning) -> f64 {
    let grow = 1.0 + x * x;
    2.0 * theta_h / (grow * grow * omega(law, steady_friction(law, ln_theta_h), x * x) * at.slope)
}

/// `xi = theta_h/theta - 1` from `a E = (a - b) ln(1 + xi) - C theta xi` at `theta`; `None` where there is no turning
/// point above.
///
/// `excess` is `a E >= 0` and `pull` is `-C theta`, below 0 where `C > 0`: for `a > b` friction then still turns theta if
/// it is near. Newton's method from the tangent at 0 converges monotonically on either side of `a = b`; Halley's, whose
/// steps it corrects, gets there in fewer.
fn turning_distance(law: &Law, excess: f64, pull: f64) -> Option<f64> {
    let bend = law.a - law.b;
    if pull + bend <= 0.0 {
        return None;
    }
    // From ln(1 + xi) = xi (6 + xi)/(6 + 4 xi), which is good to 1 % up to xi = 1; else from the tangent.
    let tangent = excess / (pull + bend);
    let (square, linear) = (bend + 4.0 * pull, 3.0 * (bend + pull) - 2.0 * excess);
    let near = 6.0 * excess / (linear + (linear * linear + 6.0 * square * excess).sqrt());
    let mut xi = if near > 0.0 && near < 2.0 { near } else { tangent };
    for _ in 0..60 {
        let inverse = 1.0 / (1.0 + xi);
        let slope = bend * inverse + pull;
        if slope.is_nan() || slope <= 0.0 {
            return None;
        }
        let newton = (bend * ln_1p(xi) + pull * xi - excess) / slope;
        // Half of the second derivative over the first: what Newton's step lacks.
        let curvature = -0.5 * bend * inverse * inverse / slope;
        let correction = curvature * newton;
        let step = if correction.abs() < 0.3 { newton / (1.0 - correction) } else { newton };
        xi -= step;
        // The error left is of third order: by the second derivative squared and by the third.
        let left = (correction * correction + (correction * inverse * newton).abs()) * step;
        if step.abs() <= 1e-15 * xi.abs() || (correction.abs() < 0.3 && left.abs() <= 1e-17 * xi.abs()) {
            break;
        }
    }
    (xi.is_finite() && xi >= 0.0).then_some(xi)
}
