//! Simulation of a response at ever tighter tolerances, until its numbers agree.

use super::long_term::{LinearStability, MAX_STEPS, follow_once, step_error};
use super::orbit::Extremum;
use super::scaled_block::ScaledBlock;
use crate::model::StateLaw;
use crate::numerics::elementary::{exp, exp_m1};

/// Long-term behaviour of a response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LongTermBehaviour {
    /// Steady sliding.
    Settled {
        /// Time after which the velocity stays within [`SETTLED`](super::SETTLED), in `l/v_f`; NaN if unknown.
        time: f64,
    },
    /// A limit cycle.
    Cycle {
        /// Period, in `l/v_f`.
        period: f64,
        /// Greatest `ln(v/v_f)`.
        high: f64,
        /// Least `ln(v/v_f)`.
        low: f64,
    },
    /// Undecided within the step limit.
    Undecided,
    /// The velocity becomes infinite in finite time, which takes a mass of 0.
    BlowUp,
}

/// Simulated response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Simulation {
    /// Long-term behaviour.
    pub long_term: LongTermBehaviour,
    /// Maximum of the velocity after `v = v_f` is first reached, if there is one; its time is NaN if unknown.
    pub high: Option<Extremum>,
    /// Minimum of the velocity after `v = v_f` is first reached, if there is one.
    pub low: Option<Extremum>,
    /// Simulated time, in `l/v_f`.
    pub t: f64,
    /// Number of steps.
    pub steps: u32,
    /// Numbers that differ between two accuracies.
    pub unresolved: UnresolvedNumbers,
}

/// Numbers that no step size resolves.
///
/// A velocity that falls over many decades magnifies every error. So does the last of thousands of oscillations that just
/// leaves the band of settled velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct UnresolvedNumbers {
    /// The greatest velocity: it is only known that the response settles.
    pub peak: bool,
    /// The least velocity.
    pub trough: bool,
    /// The least velocity on the limit cycle.
    pub cycle_trough: bool,
    /// The time of the greatest velocity.
    pub t_peak: bool,
    /// The settling time.
    pub settling_time: bool,
}

/// Accuracies of the runs, in units of `rtol`. Derived: a change by `rtol` between two runs leaves a tenth of it as error.
pub(super) const ACCURACIES: [f64; 4] = [3.0, 0.3, 0.03, 0.003];

/// Difference of a logarithm between two runs, at least. Derived: rounding of a state of size 1 in 1e4 steps.
pub(super) const MIN_DIFFERENCE: f64 = 1e-11;

/// `ln(v/v_f)` below which the velocity is 0 in doubles, in any unit.
pub(super) const UNDERFLOW_LN_V: f64 = -1000.0;

/// Simulates the response from steady sliding at `e^x v_f`, `x` not 0, with numbers to `rtol`.
///
/// Runs at ever tighter tolerances end where no number changes by more than `rtol`. Otherwise the response is `Undecided`, or settles in an unknown
/// time if that is proved, or the numbers that change are unresolved.
pub(super) fn follow(slider: &ScaledBlock, x: f64, rtol: f64) -> Simulation {
    let linear = LinearStability::of(slider);
    if let Some(long_term) = without_simulation(slider, linear, x) {
        return Simulation::known(long_term);
    }
    let settles = settles(slider, linear, x);
    let simulation = simulate(slider, linear, x, rtol, settles);
    if settles && simulation.long_term == LongTermBehaviour::Undecided {
        let unresolved = UnresolvedNumbers { peak: true, trough: true, t_peak: true, ..simulation.unresolved };
        return Simulation { long_term: LongTermBehaviour::Settled { time: f64::NAN }, unresolved, ..simulation };
    }
    simulation
}

/// Runs at ever tighter tolerances.
fn simulate(slider: &ScaledBlock, linear: LinearStability, x: f64, rtol: f64, settles: bool) -> Simulation {
    let mut simulation = follow_once(slider, linear, x, rtol, ACCURACIES[0]);
    let mut known = false;
    for fractions in ACCURACIES.windows(2) {
        let [coarse, fine] = [fractions[0], fractions[1]].map(|fraction| step_error(rtol, fraction));
        // A finer run would exceed the step limit, or have equal steps.
        if (simulation.long_term == LongTermBehaviour::Undecided && simulation.steps >= MAX_STEPS)
            || fine > 0.5 * coarse
        {
            break;
        }
        let finer = follow_once(slider, linear, x, rtol, fractions[1]);
        // Just above the critical stiffness errors of a run may let it diverge.
        let is_wrong = settles && finer.long_term == LongTermBehaviour::BlowUp;
        let unresolved = simulation.compared(&finer, rtol.max(MIN_DIFFERENCE)).filter(|_| !is_wrong);
        simulation =
            Simulation { steps: simulation.steps + finer.steps, unresolved: unresolved.unwrap_or_default(), ..finer };
        // A number that is unresolved at a third run seldom becomes resolved.
        if unresolved.is_some_and(|unresolved| known || unresolved == UnresolvedNumbers::default()) {
            return simulation;
        }
        known = unresolved.is_some();
    }
    if known { simulation } else { Simulation { long_term: LongTermBehaviour::Undecided, ..simulation } }
}

/// Long-term behaviour that is known, or left undecided, without a simulation (docs/derivations.md).
fn without_simulation(slider: &ScaledBlock, linear: LinearStability, x: f64) -> Option<LongTermBehaviour> {
    if slider.inertia == 0.0 && slider.b > slider.a && !linear.stable {
        // At the critical stiffness a potential is constant. Its level lines are closed for ageing, and for slip up to
        // v_f/v_i = b/(b - a).
        let is_closed = match slider.state_law {
            StateLaw::Ageing => Some(true),
            StateLaw::Slip => Some(exp(-x) < slider.b / slider.k),
            StateLaw::Prz => None,
        };
        match is_closed {
            Some(true) if slider.is_critical() => return Some(LongTermBehaviour::Undecided),
            Some(_) => return Some(LongTermBehaviour::BlowUp),
            None => {}
        }
    }
    (!is_checked(slider, x)).then_some(LongTermBehaviour::Undecided)
}

/// Whether the response is proved to settle by a Lyapunov function (docs/derivations.md): for `b <= a`; without a mass also above the critical
/// stiffness, under the slip law if the potential at the start is negative.
fn settles(slider: &ScaledBlock, linear: LinearStability, x: f64) -> bool {
    let &ScaledBlock { state_law, a, b, inertia, k } = slider;
    let is_decreasing = || match state_law {
        StateLaw::Ageing => true,
        StateLaw::Slip => k * exp_m1(-x) + (k - (b - a)) * x < a,
        StateLaw::Prz => false,
    };
    state_law != StateLaw::Prz && (b <= a || inertia == 0.0 && linear.stable && is_decreasing())
}

/// Factor of each bound of the physical domain up to which responses are simulated. Chosen: the random sample of
/// `tests/solver/stress/step_response.rs` checks numbers up to there.
const DOMAIN_MARGIN: f64 = 1e6;

/// Whether a response lies within [`DOMAIN_MARGIN`] of the physical domain of docs/accuracy.md.
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
    /// A long-term behaviour that takes no simulation.
    pub fn known(long_term: LongTermBehaviour) -> Simulation {
        Simulation { long_term, high: None, low: None, t: 0.0, steps: 0, unresolved: UnresolvedNumbers::default() }
    }

    /// Greatest velocity of the transient; `None` if the greatest velocity is only approached.
    pub fn peak(&self, rtol: f64) -> Option<Extremum> {
        let last = if let LongTermBehaviour::Cycle { high, .. } = self.long_term { high } else { 0.0 };
        self.high.filter(|high| high.x > last + rtol)
    }

    /// Least and greatest `ln(v/v_f)`, the long-term behaviour included.
    pub fn range(&self) -> [f64; 2] {
        let [low, high] =
            if let LongTermBehaviour::Cycle { high, low, .. } = self.long_term { [low, high] } else { [0.0; 2] };
        let reached = |extremum: Option<Extremum>| extremum.map_or(0.0, |extremum| extremum.x);
        [low.min(reached(self.low)), high.max(reached(self.high))]
    }

    /// Numbers that differ by more than `rtol` from those of another; `None` if the long-term behaviour or the peak differs.
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
            (LongTermBehaviour::Undecided, LongTermBehaviour::Undecided)
            | (LongTermBehaviour::BlowUp, LongTermBehaviour::BlowUp) => return Some(unresolved),
            _ => false,
        };
        let ([low, high], [bottom, top]) = (self.range(), other.range());
        // The trough of the cycle may be the least velocity of all.
        unresolved.trough = !slow(low, bottom) || (unresolved.cycle_trough && bottom > UNDERFLOW_LN_V);
        // The flatter a peak, the less accurate its time. Many peaks on the way to a cycle are almost as high.
        let simultaneous = |peak: Extremum, exact: Extremum| (peak.t / exact.t - 1.0).abs() <= rtol / exact.x.min(1.0);
        unresolved.t_peak |= match (self.peak(rtol), other.peak(rtol)) {
            (None, None) => false,
            (Some(peak), Some(other)) => !simultaneous(peak, other),
            _ => true,
        };
        (ends && near(high, top)).then_some(unresolved)
    }
}
