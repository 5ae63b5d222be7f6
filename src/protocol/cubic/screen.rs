//! Statuses and least velocities of shortcuts, eight at a time.
//!
//! Cheap tests come first. Theta, `n` and `n - t_f theta` are linear in the coordinates at every `x`, so the ends of a span decide most spans of
//! a line. Then the ends of a shortcut and the coefficients in Bernstein's form decide most shortcuts; stationary points are computed only for
//! undecided lanes. A result never depends on neighbouring shortcuts; only the time does.

use multiversion::multiversion;

use super::friction::FrictionBounds;
use super::path::{Ends, Path};
use super::{PerShortcut, SPAN_SHORTCUTS};
use crate::numerics::cubic::Cubic;
use crate::numerics::lanes::{LANES, Lanes};
use crate::numerics::root::LAST_STEP_RESIDUAL;
use crate::numerics::{MAX_SQUARABLE, MAX_STEPS};
use crate::protocol::Status;

/// Spans that are tested together, with two ends each.
pub(super) const BATCH_SPANS: usize = LANES / 2;

/// The decision at the ends of a span.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpanDecision {
    pub status: Status,
    /// Whether friction is certainly positive.
    pub sound: bool,
}

/// The common status of all shortcuts of each span; `None` if they differ, if rounding leaves doubt, or if a span is not on a line along one of
/// the coordinates between its first and its last shortcut.
///
/// Signs at both ends of a span hold on the whole span, for a polynomial that is positive at both, and for one that is negative at both for the
/// same `x`.
pub(super) fn settle(
    ends: &Ends,
    floors: &FrictionBounds,
    a_2: &SpanCoordinate,
    a_3: &SpanCoordinate,
) -> [Option<SpanDecision>; BATCH_SPANS] {
    let (mut first_2, mut first_3) = ([0.0; LANES], [0.0; LANES]);
    for span in 0..BATCH_SPANS {
        for (lane, place) in [(span, span * SPAN_SHORTCUTS), (span + BATCH_SPANS, (span + 1) * SPAN_SHORTCUTS - 1)] {
            (first_2[lane], first_3[lane]) = (a_2[place], a_3[place]);
        }
    }
    let mut found = verdicts(ends, floors, &first_2, &first_3);
    let straight = straight(a_2, a_3);
    for (verdict, straight) in found.iter_mut().zip(straight) {
        *verdict = verdict.filter(|_| straight);
    }
    found
}

/// One coordinate of the shortcuts of all spans.
pub(super) type SpanCoordinate = [f64; SPAN_SHORTCUTS * BATCH_SPANS];

/// Whether one coordinate of a span is constant, and the other stays between its first and last value.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn straight(a_2: &SpanCoordinate, a_3: &SpanCoordinate) -> [bool; BATCH_SPANS] {
    let mut straight = [false; BATCH_SPANS];
    for ((straight, a_2), a_3) in
        straight.iter_mut().zip(a_2.chunks_exact(SPAN_SHORTCUTS)).zip(a_3.chunks_exact(SPAN_SHORTCUTS))
    {
        *straight = if a_2[0] == a_2[SPAN_SHORTCUTS - 1] { is_along(a_3, a_2) } else { is_along(a_2, a_3) };
    }
    straight
}

/// Whether one coordinate stays between its ends while the other one does not change.
#[inline(always)]
fn is_along(moving: &[f64], fixed: &[f64]) -> bool {
    let (first, last, same) = (moving[0], moving[SPAN_SHORTCUTS - 1], fixed[0]);
    let (low, high) = if first < last { (first, last) } else { (last, first) };
    let mut beyond = [0.0; LANES];
    for (moving, fixed) in moving.chunks_exact(LANES).zip(fixed.chunks_exact(LANES)) {
        for i in 0..LANES {
            let between = (moving[i] >= low) & (moving[i] <= high) & (fixed[i] == same);
            beyond[i] = if between { beyond[i] } else { 1.0 };
        }
    }
    beyond == [0.0; LANES]
}

/// The status of all shortcuts between those of lanes `i` and `i + BATCH_SPANS`.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn verdicts(ends: &Ends, floors: &FrictionBounds, a_2: &Lanes, a_3: &Lanes) -> [Option<SpanDecision>; BATCH_SPANS] {
    // The position of the least value of each polynomial, and whether it is positive, or negative at the other end, too.
    let (mut places, mut positive, mut negative) = ([[0.0; LANES]; 3], [[false; LANES]; 3], [[false; LANES]; 3]);
    // Whether the first two are above the bounds for positive friction.
    let mut high = [[false; LANES]; 3];
    let (mut others_2, mut others_3) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        (others_2[i], others_3[i]) = (a_2[(i + BATCH_SPANS) % LANES], a_3[(i + BATCH_SPANS) % LANES]);
    }
    for (k, floor) in [floors.n, floors.theta, 0.0].into_iter().enumerate() {
        for i in 0..LANES {
            let (cubic, doubt) = polynomial(ends, a_2[i], a_3[i], k);
            let (place, least) = cubic.lowest();
            places[k][i] = place;
            positive[k][i] = least > doubt;
            high[k][i] = least > floor + doubt;
        }
        for i in 0..LANES {
            let (cubic, doubt) = polynomial(ends, a_2[i], a_3[i], k);
            let (other, other_doubt) = polynomial(ends, others_2[i], others_3[i], k);
            let x = places[k][i];
            negative[k][i] = (cubic.at(x) < -doubt) & (other.at(x) < -other_doubt);
        }
    }
    let mut found = [None; BATCH_SPANS];
    for (i, found) in found.iter_mut().enumerate() {
        let j = i + BATCH_SPANS;
        let tame = (a_2[i].abs() + a_3[i].abs() < MAX_SQUARABLE) & (a_2[j].abs() + a_3[j].abs() < MAX_SQUARABLE);
        let [n, theta, surplus] = [0, 1, 2].map(|k| positive[k][i] & positive[k][j]);
        let [no_n, no_theta, no_surplus] = [0, 1, 2].map(|k| negative[k][i] | negative[k][j]);
        let sound = high[0][i] & high[0][j] & high[1][i] & high[1][j];
        let status = if !tame {
            None
        } else if no_n | no_theta {
            Some(Status::Infeasible)
        } else if n & theta & surplus {
            Some(Status::Ok)
        } else if n & theta & no_surplus {
            Some(Status::BelowBound)
        } else {
            None
        };
        *found = status.map(|status| SpanDecision { status, sound });
    }
    found
}

/// `n`, theta or `n - t_f theta` of a shortcut, and the rounding of its values.
#[inline(always)]
fn polynomial(ends: &Ends, a_2: f64, a_3: f64, which: usize) -> (Cubic, f64) {
    let path = Path::new(ends, a_2, a_3);
    let (cubic, slack) = match which {
        0 => (path.n, 3.0 * path.slack()),
        1 => (path.theta, path.slack()),
        _ => (path.surplus(ends.t_f), (3.0 + ends.t_f) * path.slack()),
    };
    (cubic, cubic.doubt() + slack)
}

/// The status of eight shortcuts.
///
/// It follows from the signs of the least values of theta, `n` and `n - t_f theta`; the few that rounding could change are decided in
/// double-double.
#[inline(always)]
pub(super) fn screen(ends: &Ends, a_2: &Lanes, a_3: &Lanes) -> [Status; LANES] {
    let Some([n, theta, surplus]) = signs(ends, a_2, a_3) else { return [Status::Infeasible; LANES] };
    std::array::from_fn(|i| {
        if n[i] < 0.0 || theta[i] < 0.0 {
            Status::Infeasible
        } else if n[i] * theta[i] * surplus[i] == 0.0 {
            Path::new(ends, a_2[i], a_3[i]).exact_status()
        } else if surplus[i] > 0.0 {
            Status::Ok
        } else {
            Status::BelowBound
        }
    })
}

/// The signs of the least values of `n`, theta and `n - t_f theta`: -1, +1, or 0 if rounding leaves doubt; `None` if `n` excludes all lanes.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn signs(ends: &Ends, a_2: &Lanes, a_3: &Lanes) -> Option<[Lanes; 3]> {
    let mut n = [0.0; LANES];
    for i in 0..LANES {
        let (quadratic, doubt) = polynomial(ends, a_2[i], a_3[i], 0);
        let sign = sign_of_quadratic(&quadratic, doubt);
        // No greater coefficients are feasible: `n >= 0` has the mean `t_f - rise`, so its ends are at most nine times that.
        let tame = a_2[i].abs() + a_3[i].abs() < MAX_SQUARABLE;
        n[i] = if tame { sign } else { -1.0 };
    }
    if n.iter().all(|&n| n < 0.0) {
        return None;
    }
    let theta = sign(&|i| polynomial(ends, a_2[i], a_3[i], 1));
    let surplus = sign(&|i| polynomial(ends, a_2[i], a_3[i], 2));
    Some([n, theta, surplus])
}

/// Sign of the least value of `c[0] + c[1] x + c[2] x^2`, whose rounding is `doubt`.
#[inline(always)]
fn sign_of_quadratic(quadratic: &Cubic, doubt: f64) -> f64 {
    let [c0, c1, c2, _] = quadratic.c;
    let x = -0.5 * c1 / c2;
    let inside = c2 > 0.0 && x > 0.0 && x < 1.0;
    let bottom = if inside { c0 + 0.5 * x * c1 } else { c0 };
    let lower = |x: f64, y: f64| if y < x { y } else { x };
    sign_of(lower(lower(c0, c0 + c1 + c2), bottom), doubt)
}

/// Signs of the least values of eight cubics, each with the rounding of its values.
#[inline(always)]
fn sign(cubic: &impl Fn(usize) -> (Cubic, f64)) -> Lanes {
    let mut signs = [0.0; LANES];
    for (i, sign) in signs.iter_mut().enumerate() {
        let (cubic, doubt) = cubic(i);
        let (least, greatest) = cubic.bounds();
        // Positive if all coefficients are, negative if an end is.
        *sign = if least > doubt {
            1.0
        } else if greatest < -doubt {
            -1.0
        } else {
            0.0
        };
    }
    if signs.iter().all(|&sign| sign != 0.0) {
        return signs;
    }
    for (i, sign) in signs.iter_mut().enumerate() {
        let (cubic, doubt) = cubic(i);
        *sign = sign_of(cubic.least(), doubt);
    }
    signs
}

#[inline(always)]
fn sign_of(value: f64, doubt: f64) -> f64 {
    if value > doubt {
        1.0
    } else if value < -doubt {
        -1.0
    } else {
        0.0
    }
}

/// Writes the lesser end velocity of eight feasible shortcuts as their least velocity, and returns a bit for each shortcut where that is not
/// certain. An end with `v = m` has the least velocity if the cubic `n - m t_f theta` has no coefficient below 0.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
pub(super) fn end_velocities(
    ends: &Ends,
    a_2: &Lanes,
    a_3: &Lanes,
    status: &[Status; LANES],
    v_min: &mut Lanes,
) -> u32 {
    let mut open = [0; LANES];
    for i in 0..LANES {
        let path = Path::new(ends, a_2[i], a_3[i]);
        let (v, place) = path.v_ends();
        let surplus = path.surplus(v * ends.t_f);
        let [first, second] = surplus.inner();
        let slack = path.slack();
        let doubt = surplus.doubt() + (3.0 + v * ends.t_f) * slack;
        let lost =
            is_lossy(&path.n, 3.0 * slack, place, ends.v_loss) | is_lossy(&path.theta, slack, place, ends.v_loss);
        v_min[i] = on_side(v, status[i]);
        let is_open = lost | !((first > doubt) & (second > doubt));
        open[i] = if is_open { 1u32 << i } else { 0 };
    }
    open.iter().fold(0, |all, bit| all | bit)
}

/// The status is exact, but a least velocity is rounded; this function moves it to the side of the bound that the status states.
#[inline(always)]
pub(super) fn on_side(v_min: f64, status: Status) -> f64 {
    if status == Status::Ok { v_min.max(1.0) } else { v_min.min(1.0 - 0.5 * f64::EPSILON) }
}

/// Searches the least velocities of feasible shortcuts.
pub(super) fn inner_velocities(ends: &Ends, a_2: &PerShortcut, a_3: &PerShortcut) -> PerShortcut {
    let [mut v_min, place, lossy] = least(ends, a_2, a_3);
    for i in (0..SPAN_SHORTCUTS).filter(|&i| lossy[i] > 0.0) {
        v_min[i] = Path::new(ends, a_2[i], a_3[i]).exact_velocity(place[i]);
    }
    v_min
}

/// The least velocities, their positions, and 1 where rounding matters; infeasible lanes are meaningless.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn least(ends: &Ends, a_2: &PerShortcut, a_3: &PerShortcut) -> [PerShortcut; 3] {
    let [mut v_min, mut place] = [[0.0; SPAN_SHORTCUTS]; 2];
    for i in 0..SPAN_SHORTCUTS {
        (v_min[i], place[i]) = Path::new(ends, a_2[i], a_3[i]).v_ends();
    }
    lower(ends, a_2, a_3, &mut v_min, &mut place);
    let mut lossy = [0.0; SPAN_SHORTCUTS];
    for i in 0..SPAN_SHORTCUTS {
        let path = Path::new(ends, a_2[i], a_3[i]);
        let slack = path.slack();
        let lost =
            is_lossy(&path.n, 3.0 * slack, place[i], ends.v_loss) | is_lossy(&path.theta, slack, place[i], ends.v_loss);
        lossy[i] = if lost { 1.0 } else { 0.0 };
    }
    [v_min, place, lossy]
}

/// The least velocity by Dinkelbach's method (Management Science 13, 492, 1967): `v = n/(t_f theta) >= m` where the cubic `n - m t_f theta` is
/// not negative. The minimum of this cubic gives the next, lower `m`. The steps decrease to the least ratio, and each doubles the digits.
#[inline(always)]
fn lower(ends: &Ends, a_2: &PerShortcut, a_3: &PerShortcut, v_min: &mut PerShortcut, place: &mut PerShortcut) {
    let mut due = [1.0; SPAN_SHORTCUTS];
    for _ in 0..MAX_STEPS {
        for i in 0..SPAN_SHORTCUTS {
            let path = Path::new(ends, a_2[i], a_3[i]);
            let x = path.surplus(v_min[i] * ends.t_f).minimum();
            let v = path.n.at(x) / (ends.t_f * path.theta.at(x));
            let lower = (due[i] > 0.0) & (v < v_min[i]) & (v > 0.0);
            let last = v >= (1.0 - LAST_STEP_RESIDUAL) * v_min[i];
            v_min[i] = if lower { v } else { v_min[i] };
            // A velocity lost in rounding is computed again.
            place[i] = if lower | (v <= 0.0) { x } else { place[i] };
            due[i] = if lower & !last { 1.0 } else { 0.0 };
        }
        if due == [0.0; SPAN_SHORTCUTS] {
            break;
        }
    }
}

/// Whether the relative rounding error of a cubic at `x` may exceed `loss`, or its value is NaN.
#[inline(always)]
fn is_lossy(cubic: &Cubic, slack: f64, x: f64, loss: f64) -> bool {
    let [c0, c1, c2, c3] = cubic.c;
    let sound = loss * cubic.at(x) > 4.0 * f64::EPSILON * (c0.abs() + c1.abs() + c2.abs() + c3.abs()) + slack;
    !sound
}
