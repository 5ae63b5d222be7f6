//! Theta along a member by collocation at the Radau nodes, in the direction in which it contracts.
//!
//! The variable is `u = ln theta`: `u' = e^-u - v` with `ln v = (tau - 1)/a - (b/a) u`. Places are distances `d` from the
//! end where the integration starts, in units of `t_f`.

use std::sync::OnceLock;

use multiversion::multiversion;

use crate::model::Transition;
use crate::numerics::elementary::{exp, exp_m1, ln};
use crate::numerics::radau::{NODES, Nodes, Radau, radau};
use crate::protocol::Effort;
use crate::protocol::swift::Case;

/// A member of the family for one `alpha_3`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    pub alpha: f64,
    pub forward: bool,
    pub t_f: f64,
    /// `ln theta` at the start of the integration, and where it is to end.
    pub start: f64,
    pub target: f64,
    a: f64,
    b: f64,
    tau_max: f64,
    /// `tau_M - tau` at the start of the integration and at its end.
    gap: f64,
    gap_last: f64,
    /// Slope of `ln R^x` along the integration.
    l: f64,
}

/// Where a pass ended: `ln theta` and its derivative by `alpha_3`.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    pub level: f64,
    pub turn: f64,
}

/// Why a pass did not reach the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stop {
    /// Theta fell to nothing.
    Lost,
    /// A defect of ours.
    GaveUp,
}

/// A panel with `ln theta` at its start and nodes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Panel {
    pub from: f64,
    pub to: f64,
    pub start: f64,
    pub u: Nodes,
}

/// Where `ln theta` has fallen this far below both ends, theta counts as lost.
const LOST: f64 = 25.0;

/// Most panels of one pass: far more than a course takes that is not lost.
const MOST_PANELS: usize = 4000;

/// Most steps of Newton's method on a panel.
const MOST_STEPS: usize = 10;

impl Course {
    pub fn new(case: &Case, (gap_i, gap_f): (f64, f64), ln_r: f64) -> Course {
        let law = case.transition.law;
        let (first, last) = (-ln(case.transition.v_i), -ln(case.transition.v_f));
        let forward = law.b <= law.a;
        let pick = |i: f64, f: f64| if forward { (i, f) } else { (f, i) };
        let ((start, target), (gap, gap_last)) = (pick(first, last), pick(gap_i, gap_f));
        let l = if forward { ln_r } else { -ln_r };
        Course {
            alpha: 0.0,
            forward,
            t_f: case.t_f,
            start,
            target,
            a: law.a,
            b: law.b,
            tau_max: case.tau_max,
            gap,
            gap_last,
            l,
        }
    }

    /// A change of `alpha_3` that counts: about a quarter of it is the change of `ln v`.
    pub fn unit(&self) -> f64 {
        self.a / self.gap.max(self.gap_last)
    }

    /// The course with another `alpha_3`.
    pub fn with(self, alpha: f64) -> Course {
        Course { alpha, ..self }
    }

    /// How far the end lies beyond its target, in a form that rises with `alpha_3`, and the step of Newton's method from
    /// here.
    ///
    /// It is `theta` that bends least: where it is about to be lost it falls to 0 on a line.
    pub fn miss(&self, end: &End) -> (f64, f64) {
        let miss = end.level - self.target;
        let bent = -exp_m1(-miss.max(-3.0));
        (if self.forward { bent } else { -bent }, -bent / end.turn)
    }

    /// `ln[(tau_M - tau)/gap]`.
    #[inline(always)]
    fn exponent(&self, d: f64) -> f64 {
        d * (self.l + self.alpha * (1.0 - d))
    }

    /// `(tau - 1)/a`; exact where the integration starts.
    #[inline(always)]
    fn drive(&self, d: f64) -> f64 {
        (self.b / self.a - 1.0) * self.start - self.gap / self.a * exp_m1(self.exponent(d))
    }

    /// Friction at a place.
    pub fn friction(&self, d: f64) -> f64 {
        self.tau_max - self.gap * exp(self.exponent(d))
    }

    /// Velocity at a place with this `ln theta`.
    #[inline(always)]
    pub fn velocity(&self, d: f64, u: f64) -> f64 {
        exp(self.drive(d) - self.b / self.a * u)
    }

    /// Greatest friction: at an end, or at the vertex of the parabola.
    pub fn friction_max(&self) -> f64 {
        let ends = self.tau_max - self.gap.min(self.gap_last);
        let vertex = 0.5 + 0.5 * self.l / self.alpha;
        if self.alpha < 0.0 && vertex > 0.0 && vertex < 1.0 { self.friction(vertex).max(ends) } else { ends }
    }

    /// The sign of `d` against time, times `t_f`.
    fn pace(&self) -> f64 {
        if self.forward { self.t_f } else { -self.t_f }
    }

    /// Slope of `ln v` along the integration.
    fn bend(&self, d: f64, u: f64) -> f64 {
        let e = self.exponent(d);
        let slope = self.l + self.alpha * (1.0 - 2.0 * d);
        let rate = self.pace() * (exp(-u) - self.velocity(d, u));
        -self.gap / self.a * slope * exp(e) - self.b / self.a * rate
    }

    /// Passes along the course; every panel goes to `visit`.
    pub fn pass(&self, tolerance: f64, effort: &mut Effort, mut visit: impl FnMut(&Panel)) -> Result<End, Stop> {
        let rule = radau();
        let (mut d, mut u, mut turn) = (0.0, self.start, 0.0);
        let mut h = self.first();
        let floor = self.start.min(self.target) - LOST;
        effort.quadratures += 1;
        for _ in 0..MOST_PANELS {
            // Several panels without elimination cost less than one with it.
            let mild = 0.9 * MILD / (self.t_f * (self.b / self.a * self.velocity(d, u) - exp(-u)).abs());
            if h.min(1.0 - d) < WORTH * mild {
                h = h.min(mild);
            }
            let to = if d + 1.0001 * h >= 1.0 { 1.0 } else { d + h };
            effort.nodes += NODES as u32;
            let Some((panel, last, error)) = step(self, d, to, [u, turn], rule) else {
                h = 0.25 * (to - d);
                if d + h == d {
                    break;
                }
                continue;
            };
            // What the end lacks is of the order of the square of what the nodes lack.
            let change = (tolerance / (error * error.sqrt()).max(1e-30)).powf_tenth();
            if error * error.sqrt() <= tolerance {
                visit(&panel);
                (u, turn) = (panel.u[NODES - 1], last);
                if u < floor {
                    return Err(Stop::Lost);
                }
                if to == 1.0 {
                    return Ok(End { level: u, turn });
                }
                h = (to - d) * (0.8 * change).clamp(0.5, 5.0);
                d = to;
            } else {
                h = (to - d) * (0.8 * change).clamp(0.2, 0.8);
            }
            if d + h == d {
                break;
            }
        }
        Err(if u < floor + 0.75 * LOST { Stop::Lost } else { Stop::GaveUp })
    }

    /// A first panel: what the exponent and the rate of theta allow.
    fn first(&self) -> f64 {
        let layer = (self.l.abs() + self.alpha.abs()) * (1.0 + self.gap / self.a);
        (2.0 / (layer + self.t_f * exp(-self.start) + 1.0)).min(1.0)
    }

    /// The highest coefficients of the rate in Legendre polynomials: what the panel does not resolve.
    fn top(&self, rate: &Nodes) -> f64 {
        static WEIGHTS: OnceLock<[Nodes; 2]> = OnceLock::new();
        let weights = WEIGHTS.get_or_init(|| {
            let rule = radau();
            let mut weights = [[0.0; NODES]; 2];
            for (j, &u) in rule.u.iter().enumerate() {
                let x = 2.0 * u - 1.0;
                let (mut before, mut p) = (1.0, x);
                for m in 1..NODES {
                    if m + 2 >= NODES {
                        weights[m + 2 - NODES][j] = (2 * m + 1) as f64 * rule.w[j] * p;
                    }
                    let k = m as f64;
                    (before, p) = (p, ((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0));
                }
            }
            weights
        });
        let coefficient = |w: &Nodes| w.iter().zip(rate).map(|(w, f)| w * f).sum::<f64>().abs();
        (coefficient(&weights[0]) + coefficient(&weights[1])) / (4 * NODES) as f64
    }
}

/// One panel: `ln theta`, the derivative by `alpha_3` at its end, and an estimate of the error at its nodes; `None`
/// where Newton's method does not settle.
///
/// A step of Newton's method solves `delta = R + int slope delta dd`. Where the slope integrates to little, its solution
/// `R + int e^(S(d) - S(c)) slope R dc` needs no elimination; quadrature only makes the steps a little inexact.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn step(course: &Course, from: f64, to: f64, [start, turn]: [f64; 2], rule: &Radau) -> Option<(Panel, f64, f64)> {
    let h = to - from;
    let scale = h * course.pace();
    let ratio = course.b / course.a;
    let (mut drive, mut lean) = ([0.0; NODES], [0.0; NODES]);
    for j in 0..NODES {
        let d = from * rule.rest[j] + to * rule.u[j];
        drive[j] = course.drive(d);
        lean[j] = -course.gap / course.a * d * (1.0 - d) * exp(course.exponent(d));
    }
    let mut u = [start; NODES];
    for _ in 0..MOST_STEPS {
        let (mut rate, mut slope, mut push) = ([0.0; NODES], [0.0; NODES], [0.0; NODES]);
        for j in 0..NODES {
            let (inverse, v) = (exp(-u[j]), exp(drive[j] - ratio * u[j]));
            rate[j] = scale * (inverse - v);
            slope[j] = scale * (ratio * v - inverse);
            push[j] = -scale * v * lean[j];
        }
        let sums = rule.integrals(&rate);
        let mut rest = [0.0; NODES];
        for j in 0..NODES {
            rest[j] = start + sums[j] - u[j];
        }
        let decay = rule.integrals(&slope);
        let mild = decay.iter().all(|s| s.abs() <= MILD);
        let (steps, last) = if mild {
            let (mut grow, mut weighted, mut pushed) = ([0.0; NODES], [0.0; NODES], [0.0; NODES]);
            for j in 0..NODES {
                grow[j] = exp(decay[j]);
                weighted[j] = slope[j] * rest[j] / grow[j];
                pushed[j] = push[j] / grow[j];
            }
            let sums = rule.integrals(&weighted);
            let mut steps = [0.0; NODES];
            for j in 0..NODES {
                steps[j] = rest[j] + grow[j] * sums[j];
            }
            (steps, grow[NODES - 1] * (turn + rule.integrals(&pushed)[NODES - 1]))
        } else {
            let forced = rule.integrals(&push);
            let mut right: [[f64; 2]; NODES] = std::array::from_fn(|j| [rest[j], turn + forced[j]]);
            let mut matrix: [Nodes; NODES] = std::array::from_fn(|j| {
                std::array::from_fn(|k| f64::from(u8::from(j == k)) - rule.columns[k][j] * slope[k])
            });
            solve(&mut matrix, &mut right);
            (right.map(|pair| pair[0]), right[NODES - 1][1])
        };
        let mut change = 0.0f64;
        for j in 0..NODES {
            u[j] += steps[j];
            // A NaN stays.
            change = if steps[j].abs() <= change { change } else { steps[j].abs() };
        }
        if change.is_nan() || change > 50.0 {
            return None;
        }
        // Newton's method squares the change; without elimination it loses four digits a step at the least.
        if change <= if mild { 1e-11 } else { 1e-8 } {
            let top = course.top(&rate);
            return Some((Panel { from, to, start, u }, last, top));
        }
    }
    None
}

/// Exponents of a panel that quadrature at its nodes resolves.
const MILD: f64 = 6.0;

/// How many times as dear a panel with elimination is.
const WORTH: f64 = 4.0;

/// The root by which a step follows from an error.
trait StepRoot {
    fn powf_tenth(self) -> f64;
}

impl StepRoot for f64 {
    /// Near enough to the root of the order: the sixteenth, with half of it once more.
    fn powf_tenth(self) -> f64 {
        let sixteenth = self.sqrt().sqrt().sqrt().sqrt();
        sixteenth * sixteenth.sqrt()
    }
}

/// Gaussian elimination with row pivots, two right-hand sides.
fn solve(matrix: &mut [Nodes; NODES], right: &mut [[f64; 2]; NODES]) {
    for k in 0..NODES {
        let mut pivot = k;
        for j in k + 1..NODES {
            if matrix[j][k].abs() > matrix[pivot][k].abs() {
                pivot = j;
            }
        }
        matrix.swap(k, pivot);
        right.swap(k, pivot);
        let (row, values) = (matrix[k], right[k]);
        let inverse = 1.0 / row[k];
        for j in k + 1..NODES {
            let factor = matrix[j][k] * inverse;
            for m in k..NODES {
                matrix[j][m] -= factor * row[m];
            }
            right[j][0] -= factor * values[0];
            right[j][1] -= factor * values[1];
        }
    }
    for k in (0..NODES).rev() {
        let inverse = 1.0 / matrix[k][k];
        let found = [right[k][0] * inverse, right[k][1] * inverse];
        right[k] = found;
        for j in 0..k {
            right[j][0] -= matrix[j][k] * found[0];
            right[j][1] -= matrix[j][k] * found[1];
        }
    }
}

/// Work and the extremes of velocity, gathered along a pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub work: f64,
    pub v_min: f64,
    pub v_max: f64,
}

impl Extent {
    pub fn new(transition: &Transition) -> Extent {
        let Transition { v_i, v_f, .. } = *transition;
        Extent { work: 0.0, v_min: v_i.min(v_f), v_max: v_i.max(v_f) }
    }

    /// Of steady sliding.
    pub fn steady(course: &Course, v: f64) -> Extent {
        Extent { work: course.friction(0.0) * v * course.t_f, v_min: v, v_max: v }
    }

    /// Adds one panel.
    pub fn add(&mut self, course: &Course, panel: &Panel) {
        let rule = radau();
        let h = panel.to - panel.from;
        let (mut before, mut sum) = (0.0, 0.0);
        let mut bend_before = course.bend(panel.from, panel.start);
        for j in 0..NODES {
            let d = panel.place(rule.u[j]);
            sum += rule.w[j] * course.friction(d) * course.velocity(d, panel.u[j]);
            let bend = course.bend(d, panel.u[j]);
            if (bend > 0.0) != (bend_before > 0.0) {
                self.turn(course, panel, (before, rule.u[j]), bend_before > 0.0);
            }
            (before, bend_before) = (rule.u[j], bend);
        }
        self.work += course.t_f * h * sum;
    }

    /// The extremum between two places of a panel, by bisection.
    fn turn(&mut self, course: &Course, panel: &Panel, (mut low, mut high): (f64, f64), rising: bool) {
        for _ in 0..MOST_HALVINGS {
            let middle = 0.5 * (low + high);
            if (course.bend(panel.place(middle), panel.level(middle)) > 0.0) == rising {
                low = middle;
            } else {
                high = middle;
            }
        }
        let v = course.velocity(panel.place(low), panel.level(low));
        self.v_min = self.v_min.min(v);
        self.v_max = self.v_max.max(v);
    }
}

/// The value at an extremum is off by the square of what is left of the bracket.
const MOST_HALVINGS: u32 = 28;

impl Panel {
    /// The place at a share `s` of the panel.
    pub fn place(&self, s: f64) -> f64 {
        self.from * (1.0 - s) + self.to * s
    }

    /// `ln theta` there.
    pub fn level(&self, s: f64) -> f64 {
        radau().interpolate(self.start, &self.u, s)
    }
}
