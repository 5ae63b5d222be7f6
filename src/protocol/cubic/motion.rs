//! A cubic shortcut over time.

use super::Landscape;
use super::path::Path;
use super::rules::Zeros;
use crate::model::{Friction, StateLaw};
use crate::numerics::double_double::DoubleDouble;
use crate::numerics::elementary::ln;
use crate::protocol::{Moment, Motion};

/// The motion of one feasible shortcut; its parameter is `x = t/t_f`.
pub(super) struct CubicMotion {
    pub of: Landscape,
    /// `alpha_2 t_f` and `alpha_3 t_f^2`.
    pub place: [DoubleDouble; 2],
    pub friction: Friction,
}

impl CubicMotion {
    pub fn path(&self) -> Path<'_> {
        Path::exact(&self.of.ends, self.place[0], self.place[1])
    }
}

impl Motion for CubicMotion {
    fn duration(&self) -> f64 {
        self.of.t_f
    }

    /// Points around each zero of `theta` and of `n = t_f (1 - theta')`; near a zero, `v = n/(t_f theta)` varies on the scale of its distance
    /// from the real interval.
    fn landmarks(&self) -> Vec<f64> {
        let zeros = Zeros::of(&self.path());
        let mut landmarks = vec![0.0, 1.0];
        for (&re, &im) in zeros.re.iter().zip(&zeros.im) {
            let centre = re.clamp(0.0, 1.0);
            let near = ((re - centre) * (re - centre) + im * im).sqrt();
            let mut reach = near.max(f64::EPSILON);
            landmarks.push(centre);
            while reach < 1.0 {
                landmarks.extend([centre - reach, centre + reach]);
                reach *= LANDMARK_RATIO;
            }
        }
        landmarks.retain(|x| (0.0..=1.0).contains(x));
        landmarks.sort_by(f64::total_cmp);
        landmarks.dedup();
        landmarks
    }

    fn at(&self, s: f64) -> Moment {
        let x = s.clamp(0.0, 1.0);
        let (theta, n) = self.path().at(x);
        let Landscape { law, state, t_f, .. } = self.of;
        let v = match state {
            StateLaw::Ageing => n / (t_f * theta),
            _ => self.of.velocity(&self.path(), x),
        };
        let friction = self.friction.at(&law, ln(v), ln(theta));
        Moment { t: x * t_f, v, theta, friction, v_c: None, beta: None }
    }

    fn friction(&self) -> Friction {
        self.friction
    }
}

/// Ratio of the distances of neighbouring landmarks from a zero. Chosen: a trace resolves the curve between them.
const LANDMARK_RATIO: f64 = 8.0;
