//! A response followed to its end as finely as its numbers ask for: at finer and finer steps, until none of them moves.

use super::fate::{Linear, MOST_STEPS, follow_once};
use super::orbit::{Extremum, quiet};
use super::slider::Slider;
use super::{averaging, massless, strengthening};

/// The end of a response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fate {
    /// Steady sliding.
    Settled {
        /// Time after which the velocity stays within [`SETTLED`](super::SETTLED), in `l/v_f`.
        time: f64,
    },
    /// A limit cycle.
    Cycle {
        /// Its duration, in `l/v_f`.
        period: f64,
        /// `ln(v/v_f)` at its fastest.
        high: f64,
        /// `ln(v/v_f)` at its slowest.
        low: f64,
    },
    /// None that could be decided with the work allowed.
    Undecided,
    /// The velocity becomes infinite in finite time, which takes a mass of 0 and `k < b - a`.
    Ends,
}

/// A response that was followed to its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    /// Its end.
    pub fate: Fate,
    /// Its fastest moment since `v = v_f` was first met, if there was one.
    pub high: Option<Extremum>,
    /// Its slowest.
    pub low: Option<Extremum>,
    /// Time up to which it was followed, in `l/v_f`.
    pub t: f64,
    /// Steps taken.
    pub steps: u32,
    /// What of it is not known.
    pub doubts: Doubts,
}

/// Numbers of a course that steps cannot be made fine enough for: a velocity that falls over many decades magnifies every
/// error, and so does the last of thousands of swings that just leaves the band of settled velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Doubts {
    /// The least velocity.
    pub trough: bool,
    /// The least velocity on the limit cycle.
    pub cycle_trough: bool,
    /// The time of the greatest velocity.
    pub t_peak: bool,
    /// The time after which it is settled.
    pub settling_time: bool,
}

/// Accuracy, in units of what is asked for, with which a response is first followed, and share of it that is taken each
/// time after that: a change by `rtol` from one time to the next then leaves an error of a tenth of that.
pub(super) const COARSE: f64 = 3.0;
pub(super) const FINER: f64 = 0.1;

/// What a trough may make of the errors of the finest steps but one: below it nothing would be told.
const ROUNDED: f64 = 1e-11;

/// Times that a response is followed more finely.
const MOST_TIMES: u32 = 3;

/// Logarithm of a velocity that is 0 in doubles, whatever its unit.
pub(super) const VANISHING: f64 = -1000.0;

/// Follows the response that starts from steady sliding at `e^x v_f`, `x` not 0, with numbers good to `rtol`: at finer and
/// finer steps, until nothing changes by more than that from one time to the next. Where that does not happen it is
/// `Undecided`, or in doubt in what little else hangs on.
///
/// A start closer than 1e-4 to sliding that is unstable is moved out to there or, by whole cycles, to below 1e-3: what
/// grows from it has the same shape, but comes later, so that the times of its extrema are NaN.
///
/// A block whose swings friction hardly changes is not simulated, nor is one without mass whose velocity becomes infinite. What
/// comes to rest without fail, but not within the work allowed, is told as far as the first swings do.
pub fn follow(slider: &Slider, linear: Linear, x: f64, rtol: f64) -> Course {
    if let Some(course) = massless::end(slider, linear) {
        return course;
    }
    let course = follow_to_the_end(slider, linear, x, rtol);
    if course.fate != Fate::Undecided {
        return course;
    }
    let told = strengthening::course(slider, x, rtol).or_else(|| massless::course(slider, linear, x, rtol));
    told.map_or(course, |told| Course { steps: course.steps + told.steps, ..told })
}

/// The same without what the first swings tell.
fn follow_to_the_end(slider: &Slider, linear: Linear, x: f64, rtol: f64) -> Course {
    let told = averaging::course(slider, linear, x, rtol);
    if let Some(course) = told.or_else(|| averaging::course_after_first_swings(slider, linear, x, rtol)) {
        return course;
    }
    if linear.is_neutral(slider) && x.abs() > quiet(linear.step_error(x, rtol, COARSE * FINER)) {
        let fate = Fate::Undecided;
        return Course { fate, high: None, low: None, t: 0.0, steps: 0, doubts: Doubts::default() };
    }
    let mut course = follow_once(slider, linear, x, rtol, COARSE);
    // Finer steps would be more.
    if course.fate == Fate::Undecided && course.steps == MOST_STEPS {
        return course;
    }
    let mut share = COARSE;
    let mut known = false;
    for _ in 0..MOST_TIMES {
        let errors = [share, FINER * share].map(|share| linear.step_error(x, rtol, share));
        // The same steps would tell the same.
        if errors[1] > 0.5 * errors[0] {
            break;
        }
        share *= FINER;
        let finer = follow_once(slider, linear, x, rtol, share);
        let doubts = course.compared(&finer, rtol.max(ROUNDED));
        let steps = course.steps + finer.steps;
        course = Course { steps, doubts: doubts.unwrap_or_default(), ..finer };
        // What is left in doubt seldom becomes clear.
        if doubts.is_some_and(|doubts| known || doubts == Doubts::default()) {
            return course;
        }
        known = doubts.is_some();
    }
    if known { course } else { Course { fate: Fate::Undecided, ..course } }
}

impl Course {
    /// Fastest moment on the way, if it is one: what is only approached is not.
    pub fn peak(&self, rtol: f64) -> Option<Extremum> {
        let last = if let Fate::Cycle { high, .. } = self.fate { high } else { 0.0 };
        self.high.filter(|high| high.x > last + rtol)
    }

    /// `ln(v/v_f)` at its slowest and fastest, the end included.
    pub fn range(&self) -> [f64; 2] {
        let [low, high] = if let Fate::Cycle { high, low, .. } = self.fate { [low, high] } else { [0.0; 2] };
        let reached = |extremum: Option<Extremum>| extremum.map_or(0.0, |extremum| extremum.x);
        [low.min(reached(self.low)), high.max(reached(self.high))]
    }

    /// Which of its numbers differ by more than `rtol` from those of another; `None` if those do that say what becomes of
    /// it and how high it swings.
    fn compared(&self, other: &Course, rtol: f64) -> Option<Doubts> {
        let near = |x: f64, y: f64| (x - y).abs() <= rtol;
        let alike = |x: f64, y: f64| near(x / y, 1.0) || x == y;
        let slow = |x: f64, y: f64| as_slow(x, y, rtol);
        let mut doubts = other.doubts;
        let ends = match (self.fate, other.fate) {
            (Fate::Settled { time }, Fate::Settled { time: other }) => {
                doubts.settling_time |= !alike(time, other);
                true
            }
            (Fate::Cycle { period, high, low }, Fate::Cycle { period: other, high: top, low: bottom }) => {
                doubts.cycle_trough |= !slow(low, bottom);
                alike(period, other) && near(high, top)
            }
            (Fate::Undecided, Fate::Undecided) => return Some(doubts),
            _ => false,
        };
        let ([low, high], [bottom, top]) = (self.range(), other.range());
        // That of the cycle may be the least of all.
        doubts.trough = !slow(low, bottom) || (doubts.cycle_trough && bottom > VANISHING);
        doubts.t_peak = match (self.peak(rtol), other.peak(rtol)) {
            // On the way to a cycle all but as high moments are many, and none of them is told.
            (None, None) => false,
            // NaN is told as such.
            (Some(peak), Some(other)) => doubts.t_peak || is_later(peak, other, rtol),
            _ => true,
        };
        (ends && near(high, top)).then_some(doubts)
    }
}

/// Whether two logarithms of a least velocity are the same: to `rtol`, or both of 0 in doubles.
pub(super) fn as_slow(x: f64, y: f64, rtol: f64) -> bool {
    (x - y).abs() <= rtol || (x < VANISHING && y < VANISHING)
}

/// Whether two peaks, the second of them the more exact, are not at the same time to `rtol`: the flatter a peak, the less is
/// known of when it was.
pub(super) fn is_later(peak: Extremum, exact: Extremum, rtol: f64) -> bool {
    (peak.t / exact.t - 1.0).abs() > rtol / exact.x.min(1.0)
}
