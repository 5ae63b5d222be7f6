//! The least velocities of eight shortcuts at a time under another law than ageing.
//!
//! A chord shows for many shortcuts that they are slowest at an end. In the others, samples of the trend of the velocity locate a minimum, and Newton's
//! method finds it. Where samples leave doubt, the caller searches alone.

use multiversion::multiversion;

use super::path::Ends;
use super::product::{Product, Prz, Slip, positive};
use crate::model::StateLaw;
use crate::numerics::elementary::ln;
use crate::numerics::lanes::{LANES, Lanes, Vector, choose, lower};

/// Samples of the trend of the velocity. Chosen: more than twice as many as the trend has zeros, so that close pairs of zeros show in the differences.
const SAMPLES: usize = 9;

/// Distance between samples.
const SPACING: f64 = 1.0 / (SAMPLES - 1) as f64;

/// Most Newton steps from a secant between samples. Chosen: more than smooth minima take; close to the border of feasibility minima are narrow.
const NEWTON_STEPS: usize = 6;

/// Greatest relative change of the velocity that a further Newton step would bring. Chosen: below the rounding of a double.
const MAX_LAST_CHANGE: f64 = 1e-17;

/// Fraction of a sample below which the parabola through it and its neighbours hints at two zeros. Chosen: a half, for the error of the parabola.
pub(super) const NEAR_ZERO: f64 = 0.5;

/// The least velocities of eight shortcuts and their positions.
#[derive(Default)]
pub(super) struct Least {
    pub v: Lanes,
    pub place: Lanes,
    /// 1 where the search needs more samples.
    pub doubt: Lanes,
    /// 1 where rounding matters.
    pub lossy: Lanes,
}

/// A cubic and its derivatives at some places.
#[inline(always)]
fn jet(c: &[Vector; 4], x: Vector) -> [Vector; 4] {
    let two_c_2 = c[2] + c[2];
    let six_c_3 = 6.0 * c[3];
    [
        c[0] + x * (c[1] + x * (c[2] + x * c[3])),
        c[1] + x * (two_c_2 + x * (0.5 * six_c_3)),
        two_c_2 + x * six_c_3,
        six_c_3,
    ]
}

/// The rate of `ln v` at a place, times a positive number.
///
/// With derivatives by `x`, `s = theta_x` and `r = theta_xx`, it is `-p s - theta r`, with the factor `p theta`: `p = 2 n` for the law of Perrin, Rice
/// and Zheng, and `p = t_f u (1 + ln u)` for the slip law, where `e u (1 + ln u) = lack - 1 + e u`.
struct Trend {
    value: Vector,
    slope: Vector,
    /// The factor.
    factor: Vector,
    theta: Vector,
    /// `theta v`.
    u: Vector,
}

impl Trend {
    #[inline(always)]
    fn at<P: Product>(scaled_time: f64, c: &[Vector; 4], x: Vector) -> Trend {
        let [theta, s, r, jerk] = jet(c, x);
        let n = Vector::splat(scaled_time) - s;
        let lack = lack(scaled_time, n);
        let u = P::of(lack);
        // p, and its derivative by theta_x.
        let (pull, rate) = if P::LAW == StateLaw::Prz {
            (n + n, Vector::splat(-2.0))
        } else {
            let e = std::f64::consts::E * u;
            let rest = lack + e - Vector::splat(1.0);
            (scaled_time * rest, Vector::splat(-1.0) - e / rest)
        };
        let value = Vector::splat(0.0) - pull * s - theta * r;
        let slope = Vector::splat(0.0) - (rate * s + pull + s) * r - theta * jerk;
        Trend { value, slope, factor: pull * theta, theta, u }
    }
}

/// The least velocities under the law of Perrin, Rice and Zheng, or that of slip.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub(super) fn least_velocities(state: StateLaw, ends: &Ends, a_2: &Lanes, a_3: &Lanes, wanted: &Lanes) -> Least {
    if state == StateLaw::Prz {
        least_by::<Prz>(ends, a_2, a_3, wanted)
    } else {
        least_by::<Slip>(ends, a_2, a_3, wanted)
    }
}

/// The least velocities: at an end, or where the trend changes from falling to rising between two samples.
#[inline(always)]
fn least_by<P: Product>(ends: &Ends, a_2: &Lanes, a_3: &Lanes, wanted: &Lanes) -> Least {
    let ([a_2, a_3], rise) = ([a_2, a_3].map(|a| Vector(*a)), ends.rise.high);
    let c = [Vector::splat(ends.theta_0.high), a_2, a_3, rise - (a_2 + a_3)];
    let n_ends = [ends.t_f - a_2, ends.t_f - (3.0 * rise - (2.0 * a_2 + a_3))];
    let theta_ends = [c[0], Vector::splat(ends.theta_1.high)];
    let u_ends = [P::of(lack(ends.t_f, n_ends[0])), P::of(lack(ends.t_f, n_ends[1]))];
    let v_ends = [u_ends[0] / theta_ends[0], u_ends[1] / theta_ends[1]];
    let is_first = v_ends[1] - v_ends[0];
    let end = End {
        v: choose(is_first, v_ends[0], v_ends[1]),
        theta: choose(is_first, theta_ends[0], theta_ends[1]),
        n: choose(is_first, n_ends[0], n_ends[1]),
    };
    let place = choose(is_first, Vector::splat(0.0), Vector::splat(1.0));
    let mut found = Least { v: end.v.0, place: place.0, ..Least::default() };
    let open = open::<P>(ends, &c, &n_ends, &end, wanted);
    if open != [0.0; LANES] {
        let at_end = (found.v, found.place);
        search::<P>(ends, &c, &open, &mut found);
        for i in (0..LANES).filter(|&i| open[i] == 0.0) {
            (found.v[i], found.place[i], found.doubt[i]) = (at_end.0[i], at_end.1[i], 0.0);
        }
    }
    let [theta, s, ..] = jet(&c, Vector(found.place));
    let n = Vector::splat(ends.t_f) - s;
    let loss = 4.0 * f64::EPSILON * (Vector::splat(ends.t_f) + 3.0 * size_of(&c));
    let [none, one] = [0.0, 1.0].map(Vector::splat);
    // At the ends theta is known, and n the sum of four numbers.
    let is_inside = Vector(found.place) * (one - Vector(found.place));
    let inside = lower(ends.v_loss * theta - loss, ends.v_loss * n - 3.0 * loss);
    let margin = choose(is_inside, inside, ends.v_loss * n - 0.5 * loss);
    // The status depends on the side of v = 1.
    let distance = (Vector(found.v) - one).map(f64::abs);
    found.lossy = choose(lower(margin, distance - Vector::splat(2.0 * ends.v_loss)), none, one).0;
    found
}

/// The sum of the magnitudes of the coefficients.
#[inline(always)]
fn size_of(c: &[Vector; 4]) -> Vector {
    c[0].map(f64::abs) + c[1].map(f64::abs) + (c[2].map(f64::abs) + c[3].map(f64::abs))
}

/// The lack `n/t_f`.
#[inline(always)]
fn lack(scaled_time: f64, n: Vector) -> Vector {
    positive((1.0 / scaled_time) * n)
}

/// The slower end of eight shortcuts.
struct End {
    v: Vector,
    theta: Vector,
    n: Vector,
}

/// 1 where the slower end, with `v = m`, need not be the slowest place.
///
/// `v >= m` where `lack >= f(m theta)`, with the inverse `f` of the product, which is convex (0 below `u = 1/e`). A chord bounds `f` from above; the rest
/// is a cubic, not negative if no coefficient in Bernstein's form is.
#[inline(always)]
fn open<P: Product>(ends: &Ends, c: &[Vector; 4], n_ends: &[Vector; 2], end: &End, wanted: &Lanes) -> Lanes {
    let third = 1.0 / 3.0;
    let theta = [c[0], c[0] + third * c[1], c[0] + third * (c[1] + c[1] + c[2]), Vector::splat(ends.theta_1.high)];
    let low = lower(lower(theta[0], theta[1]), lower(theta[2], theta[3]));
    let minus = theta.map(|theta| -1.0 * theta);
    let high = -1.0 * lower(lower(minus[0], minus[1]), lower(minus[2], minus[3]));
    let other = choose(high - end.theta, high, low);
    let u = end.v * other;
    let lack = if P::LAW == StateLaw::Prz {
        let u = choose(u, u, Vector::splat(0.0));
        u * u
    } else {
        let (e, one) = (std::f64::consts::E * u, Vector::splat(1.0));
        let above = choose(e - one, e, one);
        above * above.map(ln) - above + one
    };
    let chord = (end.n - ends.t_f * lack) / (end.theta - other);
    // n in Bernstein's form.
    let n = [n_ends[0], n_ends[0] - (2.0 * third) * c[2], n_ends[1] + third * (c[2] + c[2] + 6.0 * c[3]), n_ends[1]];
    let size = Vector::splat(ends.t_f) + size_of(c);
    let doubt = 16.0 * f64::EPSILON * ((Vector::splat(3.0) + chord.map(f64::abs)) * size);
    let mut worst = Vector::splat(1.0);
    for k in 0..4 {
        let rest = (n[k] - end.n) - chord * (theta[k] - end.theta);
        // Zero at the slower end itself.
        let is_own = |rest: f64| if (k % 3 == 0) & (rest == 0.0) { 1.0 } else { -1.0 };
        worst = lower(worst, choose(rest.map(is_own), Vector::splat(1.0), rest - doubt));
    }
    // Above 0 where theta at the slower end is none of its bounds.
    let inner = lower(high - end.theta, end.theta - low);
    let none = Vector::splat(0.0);
    choose(inner, Vector(*wanted), choose(worst, none, Vector(*wanted))).0
}

/// Searches the shortcuts for velocities below those of `found`.
#[inline(always)]
fn search<P: Product>(ends: &Ends, c: &[Vector; 4], open: &Lanes, found: &mut Least) {
    let [none, one] = [0.0, 1.0].map(Vector::splat);
    let Turns { count, mut low, mut high, mut x, doubt } = Turns::of(&trends::<P>(ends.t_f, c));
    // One turn is followed to the minimum.
    let mut left = choose(count - Vector::splat(0.5), choose(count - Vector::splat(1.5), none, Vector(*open)), none);
    let (mut last, mut u, mut theta, mut change) = (Vector::splat(SPACING), one, one, none);
    for _ in 0..NEWTON_STEPS {
        if left == none {
            break;
        }
        let trend = Trend::at::<P>(ends.t_f, c, x);
        let falls = none - trend.value;
        (low, high) = (choose(falls, x, low), choose(falls, high, x));
        let step = falls / trend.slope;
        let next = x + step;
        let is_outside = choose(low - next, one, next - high);
        // ln v changes by this; what is left of it is smaller by the square of the ratio of the steps.
        let newton_change = 0.5 * (step * (trend.value / trend.factor));
        let (before, now) = (last * last, step * step);
        let is_last = choose(is_outside, none, lower(before - now, MAX_LAST_CHANGE * before + newton_change * now));
        (u, theta) = (choose(left, trend.u, u), choose(left, trend.theta, theta));
        change = choose(left, newton_change, change);
        let next = choose(is_outside, 0.5 * (low + high), next);
        last = next - x;
        x = choose(left, next, x);
        left = choose(is_last, none, left);
    }
    let inside = (u + u * change) / theta;
    let is_lower = choose(count - Vector::splat(0.5), Vector(found.v) - inside, none);
    found.v = choose(is_lower, inside, Vector(found.v)).0;
    found.place = choose(is_lower, x, Vector(found.place)).0;
    found.doubt = choose(left, one, choose(doubt, one, none)).0;
}

/// Trends at even places.
#[inline(always)]
fn trends<P: Product>(scaled_time: f64, c: &[Vector; 4]) -> [Vector; SAMPLES] {
    // Places are summed up, for the compiler would split the lanes of multiples.
    let (mut x, step) = (Vector::splat(0.0), Vector::splat(SPACING));
    std::array::from_fn(|_| {
        let Trend { value, .. } = Trend::at::<P>(scaled_time, c, x);
        x = x + step;
        value
    })
}

/// Where the trend changes from falling to rising.
struct Turns {
    count: Vector,
    /// Bounds and estimate of the last one.
    low: Vector,
    high: Vector,
    x: Vector,
    /// Above 0 where there are several, or samples hint at two more.
    doubt: Vector,
}

impl Turns {
    #[inline(always)]
    fn of(trends: &[Vector; SAMPLES]) -> Turns {
        let [none, one] = [0.0, 1.0].map(Vector::splat);
        let (mut count, mut low, mut high, mut x) = (none, none, none, none);
        for (k, pair) in trends.windows(2).enumerate() {
            let [f, g] = [pair[0], pair[1]];
            let is_turn = choose(none - f, choose(none - g, none, one), none);
            let [from, to] = [k, k + 1].map(|k| Vector::splat(k as f64 * SPACING));
            count = count + is_turn;
            (low, high) = (choose(is_turn, from, low), choose(is_turn, to, high));
            x = choose(is_turn, from + SPACING * (f / (f - g)), x);
        }
        let mut doubt = count - Vector::splat(1.5);
        for three in trends.windows(3) {
            let [f, g, h] = [three[0], three[1], three[2]];
            let (slope, bend) = (0.5 * (h - f), f - (g + g) + h);
            let (steepness, curvature) = (slope.map(f64::abs), bend.map(f64::abs));
            // The extremum of the parabola lies between the three, and close to 0 or beyond.
            let is_same = lower(lower(f * g, g * h), lower(bend * g, curvature - steepness));
            let is_near = 0.5 * (slope * slope * g.map(f64::abs)) - (1.0 - NEAR_ZERO) * (g * g * curvature);
            doubt = choose(lower(is_same, is_near), one, doubt);
        }
        Turns { count, low, high, x, doubt }
    }
}
