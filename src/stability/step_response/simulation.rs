//! A response followed to its end at finer and finer steps, until none of its numbers changes.

use super::long_term::{LinearStability, MAX_STEPS, follow_once, step_error};
use super::orbit::Extremum;
use super::scaled_block::ScaledBlock;
use crate::numerics::elementary::exp;

/// The end of a response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LongTermBehaviour {
    /// Steady sliding.
    Settled {
        /// Time after which the velocity stays within [`SETTLED`](super::SETTLED), in `l/v_f`; NaN if unknown.
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
    BlowUp,
}

/// A response that was followed to its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Simulation {
    /// Its end.
    pub long_term: LongTermBehaviour,
    /// Its fastest moment since `v = v_f` was first met, if there was one; its time is NaN if unknown.
    pub high: Option<Extremum>,
    /// Its slowest.
    pub low: Option<Extremum>,
    /// Time up to which it was followed, in `l/v_f`.
    pub t: f64,
    /// Steps taken.
    pub steps: u32,
    /// Numbers that two accuracies do not agree on.
    pub unresolved: UnresolvedNumbers,
}

/// Numbers of a course that steps cannot be made fine enough for: a velocity that falls over many decades magnifies every
/// error, and so does the last of thousands of swings that just leaves the band of settled velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct UnresolvedNumbers {
    /// The least velocity.
    pub trough: bool,
    /// The least velocity on the limit cycle.
    pub cycle_trough: bool,
    /// The time of the greatest velocity.
    pub t_peak: bool,
    /// The time after which it is settled.
    pub settling_time: bool,
}

/// Accuracies of the runs, in units of `rtol`. A change by `rtol` from one run to the next leaves an error of a tenth of that.
const ACCURACIES: [f64; 4] = [3.0, 0.3, 0.03, 0.003];

/// Least change of a logarithm between two runs that tells them apart. Rounding of a state of size 1 in 1e4 steps.
pub(super) const MIN_DIFFERENCE: f64 = 1e-11;

/// `ln(v/v_f)` whose velocity is 0 in doubles, whatever its unit.
pub(super) const UNDERFLOW_LN_V: f64 = -1000.0;

/// Follows the response that starts from steady sliding at `e^x v_f`, `x` not 0, with numbers good to `rtol`: at finer and
/// finer steps, until nothing changes by more than that from one run to the next. Where that does not happen it is
/// `Undecided`, or in doubt in the numbers that change.
pub fn follow(slider: &ScaledBlock, linear: LinearStability, x: f64, rtol: f64) -> Simulation {
    if slider.inertia == 0.0 && slider.b > slider.a && !linear.stable {
        // Below the critical stiffness the potential of theory.md grows without bound; at it nothing changes.
        let long_term = if slider.is_critical() { LongTermBehaviour::Undecided } else { LongTermBehaviour::BlowUp };
        return Simulation {
            long_term,
            high: None,
            low: None,
            t: 0.0,
            steps: 0,
            unresolved: UnresolvedNumbers::default(),
        };
    }
    if !is_checked(slider, x) {
        return Simulation {
            long_term: LongTermBehaviour::Undecided,
            high: None,
            low: None,
            t: 0.0,
            steps: 0,
            unresolved: UnresolvedNumbers::default(),
        };
    }
    let mut simulation = follow_once(slider, linear, x, rtol, ACCURACIES[0]);
    let mut known = false;
    for fractions in ACCURACIES.windows(2) {
        let [coarse, fine] = [fractions[0], fractions[1]].map(|fraction| step_error(rtol, fraction));
        // Finer steps would be more, and the same steps lead to the same.
        if (simulation.long_term == LongTermBehaviour::Undecided && simulation.steps >= MAX_STEPS)
            || fine > 0.5 * coarse
        {
            break;
        }
        let finer = follow_once(slider, linear, x, rtol, fractions[1]);
        let unresolved = simulation.compared(&finer, rtol.max(MIN_DIFFERENCE));
        simulation =
            Simulation { steps: simulation.steps + finer.steps, unresolved: unresolved.unwrap_or_default(), ..finer };
        // A number that is still in doubt at a third run seldom becomes clear.
        if unresolved.is_some_and(|unresolved| known || unresolved == UnresolvedNumbers::default()) {
            return simulation;
        }
        known = unresolved.is_some();
    }
    if known { simulation } else { Simulation { long_term: LongTermBehaviour::Undecided, ..simulation } }
}

/// How far beyond the physical domain responses are followed, a factor of each bound. Chosen: the random sample of
/// `tests/solver/stress/step.rs` checks numbers up to there.
const DOMAIN_MARGIN: f64 = 1e6;

/// Whether a response lies in the physical domain of docs/accuracy.md, or not far from it.
fn is_checked(slider: &ScaledBlock, x: f64) -> bool {
    let near =
        |value: f64, [least, greatest]: [f64; 2]| (least / DOMAIN_MARGIN..=greatest * DOMAIN_MARGIN).contains(&value);
    near(slider.a, [1e-3, 0.3])
        && slider.b <= DOMAIN_MARGIN * 20.0 * slider.a
        && near(slider.k / slider.a, [1e-4, 1e5])
        && (slider.inertia == 0.0 || near(slider.inertia / slider.a, [1e-8, 1e4]))
        && near(exp(x), [1e-6, 1e6])
}

impl Simulation {
    /// Fastest moment on the way, if it is one: what is only approached is not.
    pub fn peak(&self, rtol: f64) -> Option<Extremum> {
        let last = if let LongTermBehaviour::Cycle { high, .. } = self.long_term { high } else { 0.0 };
        self.high.filter(|high| high.x > last + rtol)
    }

    /// `ln(v/v_f)` at its slowest and fastest, the end included.
    pub fn range(&self) -> [f64; 2] {
        let [low, high] =
            if let LongTermBehaviour::Cycle { high, low, .. } = self.long_term { [low, high] } else { [0.0; 2] };
        let reached = |extremum: Option<Extremum>| extremum.map_or(0.0, |extremum| extremum.x);
        [low.min(reached(self.low)), high.max(reached(self.high))]
    }

    /// Which of its numbers differ by more than `rtol` from those of another; `None` if the end or the peak does.
    fn compared(&self, other: &Simulation, rtol: f64) -> Option<UnresolvedNumbers> {
        let near = |x: f64, y: f64| (x - y).abs() <= rtol;
        let alike = |x: f64, y: f64| near(x / y, 1.0) || x == y;
        let slow = |x: f64, y: f64| near(x, y) || (x < UNDERFLOW_LN_V && y < UNDERFLOW_LN_V);
        let mut unresolved = other.unresolved;
        let ends = match (self.long_term, other.long_term) {
            (LongTermBehaviour::Settled { time }, LongTermBehaviour::Settled { time: other }) => {
                unresolved.settling_time |= !alike(time, other);
                true
            }
            (
                LongTermBehaviour::Cycle { period, high, low },
                LongTermBehaviour::Cycle { period: other, high: top, low: bottom },
            ) => {
                unresolved.cycle_trough |= !slow(low, bottom);
                alike(period, other) && near(high, top)
            }
            (LongTermBehaviour::Undecided, LongTermBehaviour::Undecided) => return Some(unresolved),
            _ => false,
        };
        let ([low, high], [bottom, top]) = (self.range(), other.range());
        // That of the cycle may be the least of all.
        unresolved.trough = !slow(low, bottom) || (unresolved.cycle_trough && bottom > UNDERFLOW_LN_V);
        // The flatter a peak, the less is known of when it was. On the way to a cycle all but as high moments are many.
        let simultaneous = |peak: Extremum, exact: Extremum| (peak.t / exact.t - 1.0).abs() <= rtol / exact.x.min(1.0);
        unresolved.t_peak |= match (self.peak(rtol), other.peak(rtol)) {
            (None, None) => false,
            (Some(peak), Some(other)) => !simultaneous(peak, other),
            _ => true,
        };
        (ends && near(high, top)).then_some(unresolved)
    }
}
