//! `step`: the velocity jumps to `v_f` and stays there.
//!
//! With `p = v_f t` and `k = v_f/v_i - 1` the state variable is `theta = (1 + k e^-p)/v_f`, so all numbers have a
//! closed form. The work contains `int ln(1 + k e^-p) dp`, a difference of two dilogarithms.

use super::{Case, Family, Obstacle, Shortcut};
use crate::model::{Law, Transition};
use crate::numerics::NEGLIGIBLE_LN;
use crate::numerics::dilogarithm::dilogarithm;
use crate::numerics::elementary::{exp, exp_m1, ln, ln_1p};
use crate::numerics::gauss::rule;
use crate::protocol::{Moment, Motion, SolverStats};

/// The family `step`.
pub(super) const FAMILY: Family = Family {
    name: "step",
    doc: "the velocity jumps to v_f at once and stays there; theta only approaches its target",
    alpha: None,
    uses_tau_ceiling: false,
    arrives: false,
    solve,
    motion: |case, _| Ok(Box::new(Relaxation::new(case))),
};

fn solve(case: &Case, _rtol: f64, stats: &mut SolverStats) -> Result<Shortcut, Obstacle> {
    let Relaxation { law, v_f, t_f, decay } = Relaxation::new(case);
    stats.quadratures += 1;
    let end = v_f * t_f;
    let steady = 1.0 + (law.a - law.b) * ln(v_f);
    // Theta is monotone.
    let ratios = [decay.ln_at(0.0), decay.ln_at(end)];
    Ok(Shortcut {
        alpha: None,
        work: end * steady + law.b * decay.integral(end),
        v_min: v_f,
        v_max: v_f,
        friction_max: steady + law.b * ratios[0].max(ratios[1]),
        friction_min: steady + law.b * ratios[0].min(ratios[1]),
        miss: decay.k * exp(-end),
    })
}

/// The member as a motion: theta relaxes at constant velocity.
#[derive(Debug, Clone, Copy)]
struct Relaxation {
    law: Law,
    v_f: f64,
    t_f: f64,
    decay: Decay,
}

impl Relaxation {
    fn new(case: &Case) -> Relaxation {
        let Transition { law, v_i, v_f } = case.transition;
        Relaxation { law, v_f, t_f: case.t_f, decay: Decay { k: (v_f - v_i) / v_i, ratio: v_f / v_i } }
    }

    /// Finest scale in `p`: theta grows within the ratio of the velocities.
    fn finest_scale(&self) -> f64 {
        self.decay.ratio.min(1.0)
    }

    /// `p` at `s`; geometric beyond the finest scale.
    fn stretched(&self, s: f64) -> f64 {
        let finest_scale = self.finest_scale();
        finest_scale * exp_m1(s * ln_1p(self.v_f * self.t_f / finest_scale))
    }
}

impl Motion for Relaxation {
    fn duration(&self) -> f64 {
        self.t_f
    }

    fn landmarks(&self) -> Vec<f64> {
        let (end, finest_scale) = (self.v_f * self.t_f, self.finest_scale());
        let relaxed = NEGLIGIBLE_LN + ln_1p(self.decay.k.max(0.0));
        let mut landmarks = vec![0.0];
        let mut p = finest_scale;
        while p < 0.9 * end {
            landmarks.push(ln_1p(p / finest_scale) / ln_1p(end / finest_scale));
            // Steps double, but are at most 1 while theta relaxes.
            p += if p < relaxed { p.min(1.0) } else { p };
        }
        landmarks.push(1.0);
        landmarks
    }

    fn at(&self, s: f64) -> Moment {
        let s = s.clamp(0.0, 1.0);
        let (p, t) =
            if s < 1.0 { (self.stretched(s), self.stretched(s) / self.v_f) } else { (self.v_f * self.t_f, self.t_f) };
        let ln_ratio = self.decay.ln_at(p);
        Moment {
            t: t.min(self.t_f),
            v: self.v_f,
            theta: self.decay.at(p) / self.v_f,
            friction: 1.0 + (self.law.a - self.law.b) * ln(self.v_f) + self.law.b * ln_ratio,
            v_c: None,
            beta: None,
        }
    }
}

/// Relaxation of theta, `1 + k e^-p`, where `k = ratio - 1 > -1`.
#[derive(Debug, Clone, Copy)]
struct Decay {
    k: f64,
    ratio: f64,
}

impl Decay {
    /// Value `1 + k e^-p`, without cancellation.
    fn at(&self, p: f64) -> f64 {
        // ratio e^-p + (1 - e^-p): both terms positive.
        self.ratio * exp(-p) - exp_m1(-p)
    }

    /// `ln(1 + k e^-p)`, accurate near 0.
    fn ln_at(&self, p: f64) -> f64 {
        let change = self.k * exp(-p);
        if change > -0.5 { ln_1p(change) } else { ln(self.at(p)) }
    }

    /// Integral `int_0^end ln(1 + k e^-p) dp = Li_2(-k e^-end) - Li_2(-k)`, to a few units in the last place.
    fn integral(&self, end: f64) -> f64 {
        let Decay { k, ratio } = *self;
        // Distance of the singularity 1 + k e^-p = 0 from the start; it is complex for k > 0.
        let gap = if k >= 0.0 {
            std::f64::consts::PI
        } else if ratio < 0.5 {
            -ln_1p(-ratio)
        } else {
            -ln(-k)
        };
        if end <= gap.min(MAX_GAUSS_P) {
            // The dilogarithms would cancel. The singularity is at least `end` away: the error is 5.8^-32.
            let rule = rule(16);
            let weigh = |(x, w): (&f64, &f64)| w * self.ln_at(0.5 * end * (1.0 + x));
            0.5 * end * rule.x.iter().zip(&rule.w).map(weigh).sum::<f64>()
        } else if k < 0.0 && end < std::f64::consts::LN_2 {
            // Reflected, since both arguments are close to 1.
            let rest = self.at(end);
            gap * ln(rest / ratio) + end * ln(rest) + dilogarithm(ratio) - dilogarithm(rest)
        } else {
            dilogarithm(-k * exp(-end)) - dilogarithm(-k)
        }
    }
}

/// `p` at the end below which a Gauss rule gives the whole integral. Chosen: the dilogarithms would cancel there.
const MAX_GAUSS_P: f64 = 2.0;
