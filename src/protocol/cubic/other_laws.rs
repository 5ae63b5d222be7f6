//! Landscapes under the slip law and that of Perrin, Rice and Zheng.
//!
//! `theta'` is at most the fastest rise `c`, and `theta v = u(lack)` depends on `lack = 1 - theta'/c = n/(c t_f)` alone. So feasible set, zeros and
//! panels are those of an ageing path of the duration `c t_f` ([`Ends::under`]). At the zeros of `n` the integrand has a square root in place of a
//! logarithm. Under the slip law `tau v = T v - a theta'/theta` with `T = 1 + (b - a) ln theta`, so that the work needs no logarithm of the velocity.

use multiversion::multiversion;

use super::path::{Ends, Path};
use super::product::{NearSlip, Product, Prz, Slip, positive};
use super::rules::MappedPanel;
use super::screen::screen;
use super::works::Works;
use super::{Bins, Landscape, LandscapeBuffers};
use crate::model::{Law, StateLaw};
use crate::numerics::elementary::ln;
use crate::numerics::lambert::above_branch;
use crate::numerics::lanes::{LANES, Lanes, Vector, choose, lower};
use crate::numerics::root::crossing;
use crate::protocol::{SolverStats, Status};

/// Evaluates the shortcuts of a landscape under another law than ageing.
pub(super) fn evaluate(of: &Landscape, a_2: &[f64], a_3: &[f64], out: LandscapeBuffers<'_>) -> SolverStats {
    let LandscapeBuffers { work, v_min, status } = out;
    let count = a_2.len().min(a_3.len()).min(status.len());
    let wanted = count.min(work.len());
    let mut bins = Bins::take();
    bins.cells.begin(&of.frame);
    let mut works = Works::new(of, &mut work[..wanted], &mut bins);
    for first in (0..count).step_by(LANES) {
        let block = first..(first + LANES).min(count);
        let (mut a_2_lanes, mut a_3_lanes) = ([0.0; LANES], [0.0; LANES]);
        a_2_lanes[..block.len()].copy_from_slice(&a_2[block.clone()]);
        a_3_lanes[..block.len()].copy_from_slice(&a_3[block.clone()]);
        let found = screen(&of.ends, &a_2_lanes, &a_3_lanes);
        status[block.clone()].fill(Status::Infeasible);
        if found[..block.len()].iter().all(|&found| found == Status::Infeasible) {
            continue;
        }
        let doubtful = of.floors.open(&of.ends, &a_2_lanes, &a_3_lanes, &found);
        let velocities = of.least_velocities(&a_2_lanes, &a_3_lanes, &found);
        for (lane, i) in block.enumerate().filter(|&(lane, _)| found[lane] != Status::Infeasible) {
            let own = if velocities[lane] < 1.0 { Status::BelowBound } else { Status::Ok };
            let is_doubtful = doubtful & (1 << lane) != 0;
            let friction = if is_doubtful { of.friction_min(&Path::new(&of.ends, a_2[i], a_3[i])) } else { 1.0 };
            status[i] = own.with_friction(friction);
            if let Some(v_min) = v_min.get_mut(i) {
                *v_min = velocities[lane];
            }
            works.push(i, a_2[i], a_3[i]);
        }
    }
    let stats = works.finish();
    bins.keep();
    if of.work_of_ends != 0.0 {
        let feasible = work[..wanted].iter_mut().zip(status).filter(|(_, status)| **status != Status::Infeasible);
        feasible.for_each(|(work, _)| *work += of.work_of_ends);
    }
    stats
}

/// Samples of the trend of the velocity. Chosen: more than twice as many as the trend has zeros, so that close pairs of zeros show in the differences.
const SAMPLES: usize = 9;

/// Most Newton steps from a secant between samples. Chosen: twice as many as usual; close to the border of feasibility minima are narrow.
const NEWTON_STEPS: usize = 6;

/// Greatest relative change of the velocity that a further Newton step would bring. Chosen: below the rounding of a double.
const MAX_LAST_CHANGE: f64 = 1e-17;

/// Error of a rough trend in units of its first term. Chosen: thrice the greatest error of `u (1 + ln u)` (2.9e-4).
const ROUGH_ERROR: f64 = 1e-3;

/// Fraction of a sample below which the parabola through it and its neighbours hints at two zeros. Chosen: a half, for the error of the parabola.
const NEAR_ZERO: f64 = 0.5;

/// The least velocities of eight shortcuts and their positions.
struct Least {
    v: Lanes,
    place: Lanes,
    /// 1 where the search needs more samples.
    doubt: Lanes,
    /// 1 where rounding matters.
    lossy: Lanes,
}

impl Least {
    const NONE: Least = Least { v: [0.0; LANES], place: [0.0; LANES], doubt: [0.0; LANES], lossy: [0.0; LANES] };
}

impl Landscape {
    /// The least velocities of feasible shortcuts; others are meaningless.
    fn least_velocities(&self, a_2: &Lanes, a_3: &Lanes, found: &[Status; LANES]) -> Lanes {
        let wanted = found.map(|found| if found == Status::Infeasible { 0.0 } else { 1.0 });
        let Least { mut v, place, doubt, lossy } = match self.state {
            StateLaw::Slip => {
                let c = [Vector(*a_2), Vector(*a_3), self.ends.rise.high - (Vector(*a_2) + Vector(*a_3))];
                let search = if NearSlip::holds(self.ends.t_f, c) { near_slip_velocities } else { slip_velocities };
                search(&self.ends, a_2, a_3, &wanted)
            }
            _ => prz_velocities(&self.ends, a_2, a_3, &wanted),
        };
        for i in (0..LANES).filter(|&i| wanted[i] * (doubt[i] + lossy[i]) > 0.0) {
            let path = Path::new(&self.ends, a_2[i], a_3[i]);
            let inside = if doubt[i] > 0.0 { self.minima(&path, 1.0, -1.0) } else { vec![place[i]] };
            let places = inside.into_iter().chain([0.0, 1.0]);
            v[i] = places.map(|x| self.velocity(&path, x)).fold(f64::INFINITY, f64::min);
        }
        v
    }

    /// The place where the lack exceeds that of `v = 1` least.
    pub(in crate::protocol) fn slowest(&self, path: &Path) -> f64 {
        let exact = |x: &f64| {
            let (theta, n) = path.at(*x);
            n / self.ends.t_f - self.state.lack(theta)[0]
        };
        self.slow_places(path).min_by(|x, y| exact(x).total_cmp(&exact(y))).unwrap_or(0.0)
    }

    /// [`slowest`](Landscape::slowest) in double precision.
    pub(in crate::protocol) fn roughly_slowest(&self, path: &Path) -> f64 {
        self.slow_places(path).min_by(|x, y| self.excess(path, *x).total_cmp(&self.excess(path, *y))).unwrap_or(0.0)
    }

    /// By how much the lack exceeds that of `v = 1`.
    fn excess(&self, path: &Path, x: f64) -> f64 {
        path.n().at(x) / self.ends.t_f - self.state.lack(path.theta().at(x))[0]
    }

    /// The ends, and the places at which the excess is least within its neighbourhood.
    fn slow_places(&self, path: &Path) -> impl Iterator<Item = f64> {
        let trend = |x: f64| {
            let (slope, bend) = slopes(&path.theta().c, x);
            -bend / self.ends.t_f - self.state.lack(path.theta().at(x))[1] * slope
        };
        minima(trend, even_places().collect()).into_iter().chain([0.0, 1.0])
    }

    /// The least velocity and the least friction of a feasible shortcut.
    pub(in crate::protocol) fn least(&self, path: &Path) -> [f64; 2] {
        let places = self.minima(path, 1.0, -1.0).into_iter().chain([0.0, 1.0]);
        let v_min = places.map(|x| self.velocity(path, x)).fold(f64::INFINITY, f64::min);
        [v_min, self.friction_min(path)]
    }

    /// The velocity at `x`, from values of 32 digits.
    pub(super) fn velocity(&self, path: &Path, x: f64) -> f64 {
        let (theta, n) = path.at(x);
        self.state.product((n / self.ends.t_f).max(0.0)) / theta
    }

    /// The least friction on a feasible shortcut.
    fn friction_min(&self, path: &Path) -> f64 {
        let Law { a, b } = self.law;
        let friction = |x: f64| {
            let (v, theta) = (self.velocity(path, x), path.at(x).0);
            if v > 0.0 { 1.0 + a * ln(v) + b * ln(theta) } else { f64::NEG_INFINITY }
        };
        self.minima(path, a, b - a).into_iter().chain([0.0, 1.0]).map(friction).fold(f64::INFINITY, f64::min)
    }

    /// The minima of `p ln(theta v) + q ln theta` inside the shortcut, and possibly other points.
    fn minima(&self, path: &Path, p: f64, q: f64) -> Vec<f64> {
        if self.state == StateLaw::Prz {
            // p/2 ln n + q ln theta.
            let exponents = Law { a: 0.5 * p, b: 0.5 * p + q };
            let half = |end: f64| path.stationary(exponents, end).into_iter().map(move |d| (end - d).abs());
            return half(0.0).chain(half(1.0)).collect();
        }
        let trend = |x: f64| {
            let (theta, (slope, bend)) = (path.theta().at(x), slopes(&path.theta().c, x));
            let lack = (path.n().at(x) / self.ends.t_f).max(0.0);
            q * slope * self.ends.t_f * (lack - 1.0 + above_branch(lack)) - p * theta * bend
        };
        // Denser towards both ends, where theta may be small.
        let ends = (6..52).map(|k| (-k as f64).exp2());
        let mut places: Vec<f64> = even_places().chain(ends.clone()).chain(ends.map(|d| 1.0 - d)).collect();
        places.sort_by(f64::total_cmp);
        minima(trend, places)
    }
}

/// Intervals between even places. Chosen: several for each stationary point of a cubic of a cubic.
const INTERVALS: usize = 32;

fn even_places() -> impl Iterator<Item = f64> {
    (0..=INTERVALS).map(|i| i as f64 / INTERVALS as f64)
}

/// Where a trend changes from falling to rising, from samples at ascending places.
fn minima(trend: impl Fn(f64) -> f64, places: Vec<f64>) -> Vec<f64> {
    let sample = |x: f64| (x, trend(x));
    let mut samples: Vec<(f64, f64)> = places.into_iter().map(sample).collect();
    for _ in 0..MAX_HALVINGS {
        let hints: Vec<bool> = samples.windows(3).map(hints_at_zeros).collect();
        if !hints.contains(&true) {
            break;
        }
        // Both intervals of a hint are halved.
        let is_halved = |i: usize| (i > 0 && hints[i - 1]) || hints.get(i) == Some(&true);
        let pairs = samples.windows(2).enumerate().filter(|&(i, _)| is_halved(i));
        let halves: Vec<(f64, f64)> = pairs.map(|(_, pair)| sample(0.5 * (pair[0].0 + pair[1].0))).collect();
        samples.extend(halves);
        samples.sort_by(|x, y| x.0.total_cmp(&y.0));
    }
    let pairs = samples.windows(2).filter(|pair| pair[0].1 < 0.0 && pair[1].1 >= 0.0);
    let between = |pair: &[(f64, f64)]| crossing(&trend, [pair[0].0, pair[1].0], [pair[0].1, pair[1].1], f64::EPSILON);
    pairs.map(between).collect()
}

/// Most halvings of intervals in which a pair of zeros may hide. Chosen: a pair as close as the last ones changes the velocity by less than 1e-9.
const MAX_HALVINGS: u32 = 5;

/// Whether three samples of one sign hint at two zeros between them: the parabola through them has its extremum there, close to 0 or beyond.
fn hints_at_zeros(samples: &[(f64, f64)]) -> bool {
    let &[(x, f), (y, g), (z, h)] = samples else { return false };
    if f * g <= 0.0 || g * h <= 0.0 {
        return false;
    }
    // f = g + slope (x - y) + bend (x - y)^2.
    let (before, after) = ((g - f) / (y - x), (h - g) / (z - y));
    let bend = (after - before) / (z - x);
    let slope = before + bend * (y - x);
    let extremum = -0.5 * slope / bend;
    extremum >= x - y && extremum <= z - y && bend * g > 0.0 && (g + 0.5 * slope * extremum) / g < NEAR_ZERO
}

/// First and second derivative of a cubic.
#[inline(always)]
fn slopes(&[_, c_1, c_2, c_3]: &[f64; 4], x: f64) -> (f64, f64) {
    (c_1 + x * (2.0 * c_2 + 3.0 * c_3 * x), 2.0 * c_2 + 6.0 * c_3 * x)
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

    /// The value alone and its first term, with `theta v`.
    #[inline(always)]
    fn value<P: Product>(scaled_time: f64, c: &[Vector; 4], x: Vector, u: Vector) -> [Vector; 2] {
        let [theta, s, r, _] = jet(c, x);
        let n = Vector::splat(scaled_time) - s;
        let pull = if P::LAW == StateLaw::Prz {
            n + n
        } else {
            n + scaled_time * (std::f64::consts::E * u - Vector::splat(1.0))
        };
        let first = Vector::splat(0.0) - pull * s;
        [first - theta * r, first]
    }
}

macro_rules! searches {
    ($($name:ident = $product:ty;)*) => {$(
        #[multiversion(targets(
            "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
            "x86_64+avx+avx2+bmi1+bmi2"
        ))]
        fn $name(ends: &Ends, a_2: &Lanes, a_3: &Lanes, wanted: &Lanes) -> Least {
            least_velocities::<$product>(ends, a_2, a_3, wanted)
        }
    )*};
}

searches! {
    near_slip_velocities = NearSlip;
    slip_velocities = Slip;
    prz_velocities = Prz;
}

/// The least velocities: at an end, or where the trend changes from falling to rising between two samples.
#[inline(always)]
fn least_velocities<P: Product>(ends: &Ends, a_2: &Lanes, a_3: &Lanes, wanted: &Lanes) -> Least {
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
    let mut found = Least { v: end.v.0, place: place.0, ..Least::NONE };
    let open = open::<P>(ends, &c, &n_ends, &end, wanted);
    if open != [0.0; LANES] {
        let at_end = (found.v, found.place);
        search::<P>(ends, &c, &u_ends, &open, &mut found);
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
    // The status tells the side of v = 1.
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
fn search<P: Product>(ends: &Ends, c: &[Vector; 4], u_ends: &[Vector; 2], open: &Lanes, found: &mut Least) {
    let spacing = 1.0 / (SAMPLES - 1) as f64;
    let [none, one, step] = [0.0, 1.0, spacing].map(Vector::splat);
    let [first, _] = Trend::value::<P>(ends.t_f, c, none, u_ends[0]);
    let mut trends = [first; SAMPLES];
    [trends[SAMPLES - 1], _] = Trend::value::<P>(ends.t_f, c, one, u_ends[1]);
    // Places are summed up, for the compiler would split the lanes of multiples.
    let (mut x, mut sure) = (none, one);
    for sample in &mut trends[1..SAMPLES - 1] {
        x = x + step;
        let n = Vector::splat(ends.t_f) - jet(c, x)[1];
        let [value, first] = Trend::value::<P>(ends.t_f, c, x, P::rough(lack(ends.t_f, n)));
        (*sample, sure) = (value, lower(sure, value.map(f64::abs) - ROUGH_ERROR * first.map(f64::abs)));
    }
    // Where a sign may be wrong, samples are exact.
    let unsure = choose(sure, none, Vector(*open));
    if P::LAW == StateLaw::Slip && unsure != none {
        x = none;
        for sample in &mut trends[1..SAMPLES - 1] {
            x = x + step;
            let n = Vector::splat(ends.t_f) - jet(c, x)[1];
            let [value, _] = Trend::value::<P>(ends.t_f, c, x, P::of(lack(ends.t_f, n)));
            *sample = choose(unsure, value, *sample);
        }
    }
    let (mut turns, mut low, mut high, mut x) = (none, none, none, none);
    for (k, pair) in trends.windows(2).enumerate() {
        let [f, g] = [pair[0], pair[1]];
        let is_turn = choose(none - f, choose(none - g, none, one), none);
        let [from, to] = [k, k + 1].map(|k| Vector::splat(k as f64 * spacing));
        turns = turns + is_turn;
        (low, high) = (choose(is_turn, from, low), choose(is_turn, to, high));
        x = choose(is_turn, from + spacing * (f / (f - g)), x);
    }
    let mut doubt = turns - Vector::splat(1.5);
    for three in trends.windows(3) {
        let [f, g, h] = [three[0], three[1], three[2]];
        let (slope, bend) = (0.5 * (h - f), f - (g + g) + h);
        let (steepness, curvature) = (slope.map(f64::abs), bend.map(f64::abs));
        // The extremum of the parabola lies between the three, and close to 0 or beyond.
        let is_same = lower(lower(f * g, g * h), lower(bend * g, curvature - steepness));
        let is_near = 0.5 * (slope * slope * g.map(f64::abs)) - (1.0 - NEAR_ZERO) * (g * g * curvature);
        doubt = choose(lower(is_same, is_near), one, doubt);
    }
    // One turn is followed to the minimum.
    let mut left = choose(turns - Vector::splat(0.5), choose(turns - Vector::splat(1.5), none, Vector(*open)), none);
    let (mut last, mut u, mut theta, mut change) = (Vector::splat(spacing), one, one, none);
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
    let is_lower = choose(turns - Vector::splat(0.5), Vector(found.v) - inside, none);
    found.v = choose(is_lower, inside, Vector(found.v)).0;
    found.place = choose(is_lower, x, Vector(found.place)).0;
    found.doubt = choose(left, one, choose(doubt, one, none)).0;
}

/// The contribution of one panel to the work.
pub(super) fn panel_sum(of: &Landscape, path: &Path, panel: &MappedPanel) -> f64 {
    let ([q0, q1, q2, q3], [n0, n1, n2]) = path.about(panel.centre);
    let Law { a, b } = of.law;
    let mut sum = 0.0;
    panel.each_node(|delta, weight| {
        let theta = q0 + delta * (q1 + delta * (q2 + delta * q3));
        let lack = ((n0 + delta * (n1 + delta * n2)) / of.ends.t_f).max(f64::MIN_POSITIVE);
        // The part of `tau v` that is integrated.
        let direct = if of.state == StateLaw::Prz { 0.5 * a * ln(lack) } else { 0.0 };
        sum += weight * (1.0 + (b - a) * ln(theta) + direct) * of.state.product(lack) / theta;
    });
    of.t_f * sum
}
