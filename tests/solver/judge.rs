//! A judge to 25 digits for any point: the definitions in double-double arithmetic, integrated by halving until nothing
//! changes. It shares no chart, no rule and no function with the solvers, and is itself checked against the 40-digit
//! tables.

use std::sync::OnceLock;

use slipsweep::model::{Law, Transition};
use slipsweep::numerics::double_double::DoubleDouble as Dd;
use slipsweep::protocol::optimal::Optimum;

fn dd(x: f64) -> Dd {
    Dd::new(x)
}

fn scaled(x: Dd, factor: f64) -> Dd {
    // A power of two: exact.
    Dd { high: x.high * factor, low: x.low * factor }
}

fn sqrt(x: Dd) -> Dd {
    let root = dd(x.high.sqrt());
    if x.high > 0.0 { root + (x - root * root) / (root + root) } else { dd(0.0) }
}

const LN_2: Dd = Dd { high: std::f64::consts::LN_2, low: 2.319046813846299e-17 };

/// `(e^x, e^x - 1)`, the latter good where `x` is small.
fn exp_and_m1(x: Dd) -> (Dd, Dd) {
    let twos = (x.high / std::f64::consts::LN_2).round();
    let rest = scaled(x - dd(twos) * LN_2, 1.0 / 256.0);
    // e^rest - 1 by its series, then (1 + p)^2 - 1 = p (2 + p), eight times.
    let mut sum = dd(1.0);
    for n in (2..=11).rev() {
        sum = dd(1.0) + sum * rest / dd(f64::from(n));
    }
    let mut grown = sum * rest;
    for _ in 0..8 {
        grown = grown * (grown + dd(2.0));
    }
    if twos == 0.0 {
        return (grown + dd(1.0), grown);
    }
    let whole = grown + dd(1.0);
    // In two halves, so that the power of two is a number.
    let half = (twos / 2.0).floor();
    let value = scaled(scaled(whole, half.exp2()), (twos - half).exp2());
    (value, value - dd(1.0))
}

fn exp(x: Dd) -> Dd {
    exp_and_m1(x).0
}

fn ln(x: Dd) -> Dd {
    // Halley's step from sixteen digits.
    let near = dd(x.high.ln());
    let value = exp(near);
    near + scaled((x - value) / (x + value), 2.0)
}

/// `ln(1 + x)`.
fn ln_1p(x: Dd) -> Dd {
    if x.high.abs() > 0.05 {
        return ln(dd(1.0) + x);
    }
    // 2 artanh(x/(2 + x)).
    let q = x / (dd(2.0) + x);
    let square = q * q;
    let mut sum = dd(0.0);
    for n in (0..=11).rev() {
        sum = sum * square + dd(1.0) / dd(f64::from(2 * n + 1));
    }
    scaled(sum * q, 2.0)
}

/// `e^z - 1 - z`.
fn phi(z: Dd) -> Dd {
    if z.high.abs() > 0.3 {
        return exp_and_m1(z).1 - z;
    }
    let mut sum = dd(1.0);
    for n in (3..=22).rev() {
        sum = dd(1.0) + sum * z / dd(f64::from(n));
    }
    scaled(sum * z * z, 0.5)
}

/// The solution of `e^z - 1 - z = e` with the sign of `side`.
fn ln_u(e: Dd, side: f64) -> Dd {
    let w = side * (2.0 * e.high).max(0.0).sqrt();
    let mut z = if w > 0.0 {
        (1.0 + w + e.high - w * w / (6.0 + w)).ln()
    } else if w > -1.5 {
        w - w * w / 6.0 + w * w * w / 36.0
    } else {
        (-(1.0 + e.high)).exp() - (1.0 + e.high)
    };
    if w.abs() > 1e-4 {
        for _ in 0..4 {
            let slope = z.exp_m1();
            z -= (slope - z - e.high) / slope;
        }
    }
    let mut z = dd(z);
    for _ in 0..3 {
        z = z - (phi(z) - e) / exp_and_m1(z).1;
    }
    z
}

/// Nodes of the Gauss rule that pieces are integrated by.
const NODES: usize = 24;

/// Nodes in `(0, 1)` and weights.
fn rule() -> &'static [(Dd, Dd); NODES] {
    static RULE: OnceLock<[(Dd, Dd); NODES]> = OnceLock::new();
    RULE.get_or_init(|| {
        std::array::from_fn(|i| {
            let mut x = dd((std::f64::consts::PI * (i as f64 + 0.75) / (NODES as f64 + 0.5)).cos());
            let mut slope = dd(0.0);
            for _ in 0..6 {
                let (mut before, mut value) = (dd(1.0), x);
                for k in 2..=NODES {
                    let n = k as f64;
                    (before, value) = (value, (dd(2.0 * n - 1.0) * x * value - dd(n - 1.0) * before) / dd(n));
                }
                slope = dd(NODES as f64) * (before - x * value) / (dd(1.0) - x * x);
                x = x - value / slope;
            }
            (scaled(x + dd(1.0), 0.5), dd(1.0) / ((dd(1.0) - x * x) * slope * slope))
        })
    })
}

type Pair = [Dd; 2];

fn plus(x: Pair, y: Pair) -> Pair {
    [x[0] + y[0], x[1] + y[1]]
}

/// A piece by the rule.
fn piece(f: &dyn Fn(Dd) -> Pair, from: Dd, to: Dd) -> Pair {
    let length = to - from;
    let sum = rule().iter().fold([dd(0.0); 2], |sum, &(x, weight)| {
        let value = f(from + length * x);
        plus(sum, value.map(|value| value * weight))
    });
    sum.map(|sum| sum * length)
}

/// Change that counts as none.
const SAME: f64 = 1e-21;

/// Number of pieces after which an integral counts as one that 32 digits do not hold: near a zero of theta they cancel.
const MOST_PIECES: u32 = 400;

/// Both integrals, halving until nothing changes, of them or of wholes of these sizes that they are parts of.
fn integrate(f: &dyn Fn(Dd) -> Pair, from: Dd, to: Dd, wholes: [f64; 2]) -> Option<Pair> {
    fn halve(
        f: &dyn Fn(Dd) -> Pair,
        (from, to): (Dd, Dd),
        whole: Pair,
        size: [f64; 2],
        left: &mut u32,
    ) -> Option<Pair> {
        *left = left.checked_sub(2)?;
        let middle = scaled(from + to, 0.5);
        let (first, second) = (piece(f, from, middle), piece(f, middle, to));
        let sum = plus(first, second);
        let size = [0, 1].map(|i| size[i].max(sum[i].high.abs()));
        // A NaN never settles.
        if (0..2).all(|i| (sum[i] - whole[i]).high.abs() <= SAME * size[i]) {
            return Some(sum);
        }
        Some(plus(halve(f, (from, middle), first, size, left)?, halve(f, (middle, to), second, size, left)?))
    }
    halve(f, (from, to), piece(f, from, to), wholes, &mut { MOST_PIECES })
}

/// The work of a cubic shortcut, given scaled, and the size of what it is a sum of; `None` where 32 digits do not determine it.
pub fn shortcut_work(transition: &Transition, t_f: f64, (a_2, a_3): (f64, f64)) -> Option<(f64, f64)> {
    let Transition { law: Law { a, b }, v_i, v_f } = *transition;
    let (start, end) = (dd(1.0) / dd(v_i), dd(1.0) / dd(v_f));
    let (a_2, a_3, t_f) = (dd(a_2), dd(a_3), dd(t_f));
    let a_4 = end - start - a_2 - a_3;
    let (a, slope) = (dd(a), dd(b) - dd(a));
    let density = |x: Dd| {
        let theta = start + x * (a_2 + x * (a_3 + x * a_4));
        let n = t_f - a_2 - x * (scaled(a_3, 2.0) + x * dd(3.0) * a_4);
        let friction = dd(1.0) + a * ln(n / t_f) + slope * ln(theta);
        // The size of friction, but for a smooth bottom.
        let size = sqrt(friction * friction + dd(1e-2));
        [friction * n / theta, size * n / theta]
    };
    Some(integrate(&density, dd(0.0), dd(1.0), [0.0; 2])?.map(|sum| sum.high)).map(|[work, size]| (work, size))
}

/// An extremal: the law and its `C`.
struct Extremal {
    a: Dd,
    slope: Dd,
    c: Dd,
    /// About the time and the work of the whole.
    wholes: [f64; 2],
}

impl Extremal {
    /// `a (u - 1 - ln u)`.
    fn excess(&self, theta: Dd) -> Dd {
        dd(1.0) + self.slope * ln(theta) + self.c * theta
    }

    /// The contact lifetime above `theta` where the excess vanishes.
    fn turn(&self, theta: Dd) -> Option<Dd> {
        let rough = |theta: f64| 1.0 + self.slope.high * theta.ln() + self.c.high * theta;
        let (mut low, mut high) = (theta.high, 2.0 * theta.high);
        while rough(high) > 0.0 {
            (low, high) = (high, 2.0 * high);
            if high > 1e60 {
                return None;
            }
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            (low, high) = if rough(middle) > 0.0 { (middle, high) } else { (low, middle) };
        }
        let mut turn = dd(low);
        for _ in 0..4 {
            turn = turn - self.excess(turn) / (self.slope / turn + self.c);
        }
        Some(turn)
    }

    /// Time and work while theta runs from `from` to `to`, rising (`side = -1`) or falling (1), away from its turning
    /// point.
    fn arc(&self, from: Dd, to: Dd, side: f64) -> Option<Pair> {
        // In ln theta.
        let density = |y: Dd| {
            let theta = exp(y);
            self.density(theta, y, self.excess(theta) / self.a, side).map(|value| value * theta)
        };
        let (low, high) = (ln(from), ln(to));
        Some(integrate(&density, low, high, self.wholes)?.map(|value| if value.high < 0.0 { -value } else { value }))
    }

    /// Time and work between `theta` and the turning point.
    fn leg_to_turn(&self, turn: Dd, theta: Dd, side: f64) -> Option<Pair> {
        let ln_turn = ln(turn);
        let force = dd(1.0) + self.slope * ln_turn;
        // theta = turn e^(-s^2) makes everything smooth.
        let reach = sqrt(-ln_1p((theta - turn) / turn));
        if reach.high == 0.0 {
            return Some([dd(0.0); 2]);
        }
        let density = |s: Dd| {
            let y = -(s * s);
            let fall = exp_and_m1(y).1;
            let theta = turn + turn * fall;
            // Referred to the turning point, where the excess vanishes.
            let excess = (self.slope * y - force * fall) / self.a;
            let rate = scaled(s * theta, 2.0);
            self.density(theta, ln_turn + y, excess, side).map(|value| value * rate)
        };
        integrate(&density, dd(0.0), reach, self.wholes)
    }

    /// `dt/dtheta` and `tau v dt/dtheta`, as sizes.
    fn density(&self, theta: Dd, ln_theta: Dd, excess: Dd, side: f64) -> Pair {
        let z = ln_u(excess, side);
        let (u, u_m1) = exp_and_m1(z);
        let rate = dd(side) / u_m1;
        let friction = dd(1.0) + self.a * z + self.slope * ln_theta;
        [rate, friction * u / theta * rate]
    }
}

/// A start that is slower determines too little of the extremal.
const LEAST_VELOCITY: f64 = 1e-280;

/// The least work at `t_f` from an optimum that is only nearly right: its own duration `T` and work `W` exactly, and
/// `W + C (T - t_f)`, which is wrong by the square of the distance. Also that distance, relative.
pub fn optimal_work(transition: &Transition, t_f: f64, optimum: &Optimum) -> Option<(f64, f64)> {
    if optimum.v_start < LEAST_VELOCITY {
        return None;
    }
    let Transition { law: Law { a, b }, v_i, v_f } = *transition;
    let (start, end) = (dd(1.0) / dd(v_i), dd(1.0) / dd(v_f));
    let wholes = [t_f, optimum.work.abs()];
    let (a, slope) = (dd(a), dd(b) - dd(a));
    let (mut theta, mut v, mut sums) = (start, dd(optimum.v_start), [dd(0.0); 2]);
    if optimum.time_at_floor > 0.0 {
        let time = dd(optimum.time_at_floor);
        let (from, (kept, lost)) = (dd(1.0) - start, exp_and_m1(-time));
        let lifetime = |s: Dd| start - from * exp_and_m1(-s).1;
        // Over the time, or over 1 - theta where that is long.
        let sum = if time.high < 1.0 {
            integrate(&|s: Dd| [ln(lifetime(s)), dd(0.0)], dd(0.0), time, [t_f; 2])
        } else {
            integrate(&|x: Dd| [ln_1p(-x) / x, dd(0.0)], from * kept, from, [t_f; 2])
        };
        sums = [time, time + dd(b) * sum?[0]];
        theta = start - from * lost;
        v = dd(1.0);
    }
    let z = ln(v * theta);
    let c = (a * phi(z) - dd(1.0) - slope * ln(theta)) / theta;
    let extremal = Extremal { a, slope, c, wholes };
    let (rises, falls) = (z.high < 0.0, optimum.v_end >= v_f);
    let arcs = match (rises, falls) {
        (true, true) => {
            let turn = extremal.turn(if end.high > theta.high { end } else { theta })?;
            plus(extremal.leg_to_turn(turn, theta, -1.0)?, extremal.leg_to_turn(turn, end, 1.0)?)
        }
        (true, false) => extremal.arc(theta, end, -1.0)?,
        (false, _) => extremal.arc(theta, end, 1.0)?,
    };
    let [time, work] = plus(sums, arcs);
    let late = time - dd(t_f);
    let least = work + c * late;
    (least.high.is_finite()).then(|| (least.high, (late / dd(t_f)).high.abs()))
}
