//! Responses without mass of a block whose friction weakens with velocity, `b > a`.
//!
//! With `u = theta v` a function of the state
//!
//! ```text
//! P = k (theta - 1 - ln theta) + a (u - 1 - ln u),    P' = -(k - k_c)(u - 1)^2/theta,    k_c = b - a,
//! ```
//!
//! which vanishes at steady sliding alone, only falls above the critical stiffness, only grows below it, and is kept at it. So
//! the sign of `k - k_c` tells the end of every response: steady sliding above; below a velocity that is infinite in
//! finite time, since once `(k_c - k)(u - 1) > k` nothing stops the growth of `u`; and the same swing for ever where `k` is
//! `k_c` to the last digit.

use super::course::{Course, Doubts, Fate};
use super::slider::{Slider, Y};
use super::swings::{Descent, stored};
use super::{Linear, State, swings};
use crate::numerics::elementary::{exp_m1, ln_1p};

/// The end of a response that is known without following it: below the critical stiffness and at it.
pub(super) fn end(slider: &Slider, linear: Linear) -> Option<Course> {
    let massless = slider.inertia == 0.0 && slider.b > slider.a;
    let fate = if slider.is_critical() { Fate::Undecided } else { Fate::Ends };
    (massless && !linear.stable).then_some(Course {
        fate,
        high: None,
        low: None,
        t: 0.0,
        steps: 0,
        doubts: Doubts::default(),
    })
}

/// The response from `e^x v_f` above the critical stiffness, as far as its first swings tell it; `None` elsewhere, and where
/// its peak is not known.
pub(super) fn course(slider: &Slider, linear: Linear, x: f64, rtol: f64) -> Option<Course> {
    let settles = slider.inertia == 0.0 && slider.b > slider.a && linear.stable;
    settles.then(|| swings::first(slider, &Potential(slider), x, rtol))?
}

impl Slider {
    /// Whether `k = b - a` exactly, for `b > a`.
    fn is_critical(&self) -> bool {
        self.k == self.b - self.a && self.b - self.k == self.a
    }
}

/// `P`, which falls.
struct Potential<'a>(&'a Slider);

impl Descent for Potential<'_> {
    /// On the section `v = 1`, so `u = theta`.
    fn on_section(&self, state: &State) -> f64 {
        (self.0.k + self.0.a) * stored(state[Y])
    }

    /// Where `v' = 0` the spring's force changes as friction does, `k (1 - v) = b (1/theta - v)`, which tells theta.
    fn of_extremum(&self, x: f64) -> Option<f64> {
        let &Slider { a, b, k, .. } = self.0;
        let (share, excess) = (k / b, exp_m1(x));
        // 1/theta and ln(theta v), which are 1 and 0 at v = 1.
        let surplus = excess * (1.0 - share);
        if surplus <= -1.0 {
            return Some(f64::INFINITY);
        }
        let y = -ln_1p(surplus);
        let ln_u = if excess.abs() < 0.5 { ln_1p(share * excess / (1.0 + surplus)) } else { x + y };
        Some(k * stored(y) + a * stored(ln_u)).filter(|least| !least.is_nan())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Orbit;
    use super::*;

    /// Numbers between 0 and 1 from a fixed linear congruence.
    fn uniform(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    }

    #[test]
    fn reference_the_potential_falls_above_the_critical_stiffness_and_bounds_every_extremum() {
        let mut state = 7;
        let mut random = |least: f64, greatest: f64| least * (greatest / least).powf(uniform(&mut state));
        let mut bounded = 0;
        for i in 0..200 {
            let a = random(1e-4, 1.0);
            let b = a * random(1.01, 50.0);
            let k = (b - a) * [1.0 + random(1e-9, 1e-3), random(1.0, 3.0)][i % 2];
            let slider = Slider { a, b, inertia: 0.0, k };
            let potential = Potential(&slider);
            let mut orbit =
                Orbit::new(&slider, slider.steady(random(1e-2, 3.0) * if i % 3 == 0 { 1.0 } else { -1.0 }), 1e-10);
            let (mut left, mut budget) = (f64::INFINITY, 5_000);
            for _ in 0..5 {
                let Ok(cycle) = orbit.cycle(true, &mut budget) else { break };
                // Where the motion is well above the errors of its steps.
                if potential.on_section(&cycle.end) < 1e-6 * (k + a) {
                    break;
                }
                for seen in cycle.extrema.into_iter().flatten() {
                    let Some(least) = potential.of_extremum(orbit.polished(seen).x) else { continue };
                    let before = left * (1.0 + 1e-6);
                    // What an extremum takes is what there is at it: its state is known.
                    let after = potential.on_section(&cycle.end) * (1.0 - 1e-6);
                    bounded += 1;
                    assert!(least <= before && least >= after, "{slider:?}: {after} {least} {before}");
                }
                left = potential.on_section(&cycle.end);
            }
        }
        assert!(bounded > 600, "{bounded}");
    }

    #[test]
    fn at_the_critical_stiffness_nothing_is_decided_and_below_it_everything_is() {
        let at = |k: f64| {
            let slider = Slider { a: 0.25, b: 0.75, inertia: 0.0, k };
            let linear = super::super::Scaled { slider, ratio: 2.0 }.linear();
            end(&slider, linear).map(|course| course.fate)
        };
        assert_eq!(
            [0.5f64.next_down(), 0.5, 0.5f64.next_up()].map(at),
            [Some(Fate::Ends), Some(Fate::Undecided), None]
        );
    }
}
