//! `gap`, `best_cubic`, `shortcut`, `compliant`, `regularised`: the traced protocol obeys the equations and its formula, arrives, and has the work
//! and the velocities of the row; the gap is that to the traced optimum.

use super::checked_row::NEGATIVE;
use super::motion::Followed;
use super::open_loop::{self, ControlledProtocol};
use super::route::UNCLEAR_RTOL;
use super::task::{Task, min_duration};
use super::{Checked, CheckedRow, relaxed};
use crate::grid::Quantity;
use crate::model::{StateLaw, Transition};
use crate::numerics::LONG_ROUNDING_RTOL;
use crate::numerics::double_double::DoubleDouble;
use crate::protocol::cubic::Landscape;
use crate::protocol::optimal::Bounds;
use crate::protocol::shortcut::Case;
use crate::protocol::{Moment, SolverStats, Status};
use crate::table::{STATUS, slider, transition};
use crate::trace::Absence;

/// Times that an interval of a cubic may be halved. Chosen: the velocity of the slip law has kinks, to which halving leads.
const CUBIC_SPLITS: u32 = 40;

/// Relative rounding error of a square root of a number that rounding alone keeps from 0. Derived: the root of 1e-15, with room.
const HALF_OF_THE_DIGITS: f64 = 1e-7;

/// The traced protocol of a row of `table`, whose numbers are compared; `formula` adds its errors beyond those of the equations. Without a protocol the
/// row is wrong.
fn follow(
    row: &mut CheckedRow<'_>,
    table: &str,
    cubic: Option<&Cubic>,
    formula: impl FnOnce(&mut CheckedRow<'_>, &Followed) -> f64,
) -> Result<Followed, &'static str> {
    let ((protocol, case), state) = (row.protocol(table)?, row.point.state_law());
    let path = match protocol.path(&case, row.context.rtol) {
        Ok(path) => path,
        Err(Absence::Border) => return Err("cubics at the border, which have no motion"),
        Err(_) => {
            row.push("motion", f64::INFINITY);
            return Err("there is no motion of the row");
        }
    };
    let followed =
        Followed::new(path.motion, state, &slider(&row.point), if cubic.is_some() { CUBIC_SPLITS } else { 0 });
    let off = formula(row, &followed) + (followed.end().t / case.t_f - 1.0).abs();
    row.push("motion", followed.equation + off);
    row.push("control", followed.control);
    row.compare("work", followed.work);
    let [v_min, v_max] = [followed.least(|at| at.v), followed.greatest(|at| at.v)];
    // The velocity of a cubic is a small difference of 1 and theta', over theta; where theta rises as fast as its law allows, it depends on the root
    // of the rounding of the coefficients.
    let mut noise = v_max * cubic.map_or(0.0, |cubic| cubic.rounding(state));
    // The least velocity of a best shortcut that touches the floor is 1; its coefficients determine that to half of the digits.
    if table == "best_cubic" && state != StateLaw::Ageing && row.number("v_min") == Some(1.0) {
        noise = noise.max(HALF_OF_THE_DIGITS);
    }
    row.compare_relative("v_min", v_min, v_min + noise / row.context.rtol);
    row.compare("v_max", v_max);
    let friction_max = followed.greatest(|at| at.friction);
    row.compare_relative("friction_max", friction_max, friction_max.abs().max(1.0));
    if noise < v_min {
        row.compare_friction(followed.least(|at| at.friction));
    }
    let [least, greatest] = followed.control_range();
    row.compare_relative("v_c_min", least, least.abs().max(greatest.abs()));
    row.compare_relative("v_c_max", greatest, least.abs().max(greatest.abs()));
    Ok(followed)
}

impl CheckedRow<'_> {
    /// Compares the least work and the gap of the protocol `work` above it.
    fn compare_gap(&mut self, least: f64, work: f64) {
        self.compare("work_optimal", least);
        // The promised error of the gap is relative to the greater of 1 and the gap.
        let gap = (work - least) / least;
        self.compare_relative("gap", gap, gap.abs().max(1.0));
    }

    /// Compares the least work and a gap of relative error `gap_rtol`, which the difference of two integrations determines to 1e-12 of the works.
    fn compare_small_gap(&mut self, least: f64, followed: &Followed, gap_rtol: f64) {
        self.compare("work_optimal", least);
        let excess = followed.work - least;
        let rounding =
            followed.rounding(|at| at.friction * at.v) + LONG_ROUNDING_RTOL * (followed.work.abs() + least.abs());
        let scale = (gap_rtol * excess.abs() + rounding) / self.context.rtol;
        self.compare_relative("gap", excess / least, scale / least.abs());
    }
}

/// A cubic theta over `x = t/t_f`.
struct Cubic {
    t_f: f64,
    theta: [f64; 4],
}

impl Cubic {
    fn new(&Transition { v_i, v_f, .. }: &Transition, t_f: f64, [a_2, a_3]: [f64; 2]) -> Cubic {
        let theta_0 = 1.0 / v_i;
        Cubic { t_f, theta: [theta_0, a_2, a_3, 1.0 / v_f - theta_0 - a_2 - a_3] }
    }

    fn theta(&self, x: f64) -> f64 {
        self.theta.iter().rev().fold(0.0, |sum, c| sum * x + c)
    }

    /// The least value of theta and of the distance of `theta'` from its bound; not positive if there is no such shortcut.
    fn slack(&self, state: StateLaw) -> f64 {
        let bound = match state {
            StateLaw::Ageing => 1.0,
            StateLaw::Slip => (-1.0_f64).exp(),
            StateLaw::Prz => 0.5,
        };
        let [_, c_1, c_2, c_3] = self.theta;
        let rate = |x: f64| (c_1 + x * (2.0 * c_2 + 3.0 * c_3 * x)) / self.t_f;
        // Ends, the place of the greatest rate, and those where theta turns.
        let root = (c_2 * c_2 - 3.0 * c_1 * c_3).sqrt();
        let sum = -(c_2 + root.copysign(c_2));
        let places = [0.0, 1.0, -c_2 / (3.0 * c_3), sum / (3.0 * c_3), c_1 / sum];
        let inside = places.into_iter().filter(|x| (0.0..=1.0).contains(x));
        inside.map(|x| self.theta(x).min(bound - rate(x))).fold(f64::INFINITY, f64::min)
    }

    /// Rounding of the least velocity, relative to the greatest.
    fn rounding(&self, state: StateLaw) -> f64 {
        let has_root = state != StateLaw::Ageing && self.slack(state) < HALF_OF_THE_DIGITS;
        if has_root { HALF_OF_THE_DIGITS } else { 16.0 * f64::EPSILON }
    }

    /// Greatest relative distance of theta along a motion from the cubic, beyond rounding.
    fn off(&self, followed: &Followed) -> f64 {
        let size: f64 = self.theta.iter().map(|c| c.abs()).sum();
        followed.worst(|at| {
            let off = (at.theta - self.theta(at.t / self.t_f)).abs() - 16.0 * f64::EPSILON * size;
            (off / at.theta).max(0.0)
        })
    }
}

/// Checks a row of `gap`.
pub fn gap(row: &mut CheckedRow<'_>) -> Checked {
    let (task, state) = (Task::of(row), row.point.state_law());
    let cubic = Cubic::new(&task.problem, task.t_f, row.coefficients(task.t_f).ok_or("an axis is missing")?);
    let slack = cubic.slack(state);
    if slack.abs() < 1e-9 {
        return Err("within 1e-9 of the border of feasibility");
    }
    let relaxed = (state != StateLaw::Ageing).then(|| relaxed::certify(row, &task.problem, state, task.t_f));
    let has_optimum = match &relaxed {
        Some(optimum) => Some(optimum.status != Status::Infeasible),
        None => task.is_feasible(),
    };
    if !row.compare_feasible(if slack <= 0.0 { Some(false) } else { has_optimum }) {
        return Ok(());
    }
    let followed = follow(row, "gap", Some(&cubic), |_, followed| cubic.off(followed))?;
    let least = match relaxed {
        Some(optimum) => optimum.value,
        None => row.certify(&task).map(|optimum| optimum.work),
    };
    if let Some(least) = least {
        row.compare_gap(least, followed.work);
    }
    Ok(())
}

/// Fractions of the coefficients by which a search for less work moves. Chosen: from a visible change to one whose effect on the work, of second order,
/// is above rounding.
const FRACTIONS: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];

/// Fractions that reach over the whole set where the work is not convex. Chosen: rings about twice as far from each other.
const FAR_FRACTIONS: [f64; 5] = [0.2, 0.4, 0.8, 1.6, 3.2];

/// Checks a row of `best_cubic`: no neighbour takes less work.
pub fn best_cubic(row: &mut CheckedRow<'_>) -> Checked {
    let (task, state, rtol) = (Task::of(row), row.point.state_law(), row.context.rtol);
    if !(row.has_status("ok") || row.has_status(NEGATIVE)) {
        return Err("status is neither ok nor negative_friction");
    }
    let [a_2, a_3] = row.coefficients(task.t_f).ok_or("a coefficient was not written")?;
    let cubic = Cubic::new(&task.problem, task.t_f, [a_2, a_3]);
    let followed = follow(row, "best_cubic", Some(&cubic), |_, followed| cubic.off(followed))?;
    if state != StateLaw::Ageing {
        if let Some(least) = relaxed::certify(row, &task.problem, state, task.t_f).value {
            row.compare_gap(least, followed.work);
        }
    } else if let Some(optimum) = row.certify(&task) {
        row.compare_small_gap(optimum.work, &followed, 1e-7);
    }
    let landscape = Landscape::under(state, &task.problem, task.t_f, rtol);
    let v_least = if row.context.bounded { 1.0 } else { 0.0 };
    let work = |place: [f64; 2]| {
        let place = place.map(DoubleDouble::new);
        let near = landscape.point(place, row.context.friction, rtol, &mut SolverStats::default())?;
        (near.v_min >= v_least).then_some(near.work)
    };
    let size = a_2.abs() + a_3.abs();
    let far = if state == StateLaw::Ageing { &[][..] } else { &FAR_FRACTIONS };
    let mut saved = 0.0_f64;
    for fraction in FRACTIONS.iter().chain(far) {
        for turn in 0..8 {
            let (sin, cos) = (f64::from(turn) * std::f64::consts::FRAC_PI_4).sin_cos();
            let near = work([a_2 + fraction * size * cos, a_3 + fraction * size * sin]);
            saved = saved.max(near.map_or(0.0, |near| (followed.work - near) / followed.work.abs()));
        }
    }
    // Differences below the error of a work are ignored.
    row.push("beaten", if saved > rtol { saved } else { 0.0 });
    Ok(())
}

/// Checks a row of `shortcut`.
pub fn shortcut(row: &mut CheckedRow<'_>) -> Checked {
    let (problem, t_f, bounds) = (transition(&row.point), row.point[Quantity::Time], row.bounds());
    let name = row.word("family").ok_or("an axis is missing")?;
    let case = Case { transition: problem, t_f, tau_ceiling: bounds.tau_ceiling };
    if !["ok", "below_bound", NEGATIVE, "infeasible"].iter().any(|status| row.has_status(status)) {
        return Err("status is neither ok, below_bound, negative_friction nor infeasible");
    }
    let exists = exists(&case, name, bounds.floor)
        .ok_or("too close to the border to determine whether the family has a member")?;
    if !row.compare_feasible(exists) {
        return Ok(());
    }
    let followed = follow(row, "shortcut", None, |row, followed| formula(row, &case, name, followed))?;
    // The optimum of this family has its ceiling.
    let bounds = if name == "bounded_friction" { bounds } else { bounds.without_ceilings() };
    if let Some(optimum) = row.certify(&Task::new(&problem, t_f, bounds)) {
        row.compare_gap(optimum.work, followed.work);
    }
    Ok(())
}

/// Compares the parameter of a member of a family and its terminal error; its greatest distance from the formula of the family and from the target.
fn formula(row: &mut CheckedRow<'_>, case: &Case, name: &str, followed: &Followed) -> f64 {
    let Case { transition: Transition { law, v_i, v_f }, t_f, tau_ceiling } = *case;
    if name == "step" {
        row.compare_relative("terminal_error", followed.end().theta * v_f - 1.0, 1.0);
        return followed.worst(|at| (at.v / v_f - 1.0).abs());
    }
    let shape = |x: f64| [x, x * (1.0 - x)];
    let over_floor = |at: &Moment| [at.v - 1.0, at.v];
    let under_ceiling = |at: &Moment| [tau_ceiling - at.friction, tau_ceiling.abs() + at.friction.abs()];
    let (family, unit) = match name {
        "cubic" => return smooth_cubic(case).off(followed),
        "bounded_velocity" => {
            let l = ((v_f - 1.0) / (v_i - 1.0)).ln();
            (Exponential { t_f, first: v_i - 1.0, l, shape, distance: &over_floor, rounding: 0.0 }, -t_f * t_f)
        }
        // A parabola, for which alpha is 0.
        _ if tau_ceiling == f64::INFINITY => return followed.arrival(v_f),
        _ => {
            let [first, last] = [v_i, v_f].map(|v| tau_ceiling - (1.0 + (law.a - law.b) * v.ln()));
            let rounding = (tau_ceiling.abs() + 1.0) / first.min(last);
            (Exponential { t_f, first, l: (last / first).ln(), shape, distance: &under_ceiling, rounding }, 1.0)
        }
    };
    family.compare_alpha(row, followed, unit)[1] + followed.arrival(v_f)
}

/// A family by the distance of its motions from a bound: the logarithm of that over the one at the start is `l p(x) + c q(x)`, `x = t/t_f`.
struct Exponential<'a> {
    t_f: f64,
    /// Distance at the start.
    first: f64,
    l: f64,
    /// `p` and `q`.
    shape: fn(f64) -> [f64; 2],
    /// Distance of a moment from the bound, and the size of its terms.
    distance: &'a dyn Fn(&Moment) -> [f64; 2],
    /// Relative rounding of the distances at the ends, in units of `8 eps`.
    rounding: f64,
}

impl Exponential<'_> {
    /// Compares `alpha = c/unit` with `c` by the moment that determines it best; `alpha`, and the greatest distance from the formula along the motion.
    fn compare_alpha(&self, row: &mut CheckedRow<'_>, followed: &Followed, unit: f64) -> [f64; 2] {
        let terms = |at: &Moment| ((self.shape)(at.t / self.t_f), (self.distance)(at));
        let coefficient = |(_, at): &(f64, Moment)| {
            let ([p, q], [distance, size]) = terms(at);
            let noise = 8.0 * f64::EPSILON * (size / distance.abs() + self.l.abs() + self.rounding);
            [((distance / self.first).ln() - self.l * p) / q, noise / q]
        };
        let determined =
            followed.samples.iter().map(coefficient).filter(|fit| fit.iter().all(|number| number.is_finite()));
        let Some([c, noise]) = determined.min_by(|x, y| x[1].total_cmp(&y[1])) else { return [f64::INFINITY; 2] };
        row.compare_relative("alpha", c / unit, (c.abs() + noise / row.context.rtol) / unit.abs());
        let off = followed.worst(|at| {
            let ([p, q], [distance, size]) = terms(at);
            let expected = self.first * (self.l * p + c * q).exp();
            // In the layers near the least time the rounding of the time counts.
            let moved = (self.shape)(at.t / self.t_f * (1.0 - 4.0 * f64::EPSILON))[1];
            let noise = noise * q + c.abs() * (moved - q).abs();
            ((distance - expected).abs() / size - noise * expected / size).max(0.0)
        });
        [c / unit, off]
    }
}

/// The cubic shortcut without jumps of the velocity: theta changes as `3 x^2 - 2 x^3`.
fn smooth_cubic(&Case { transition, t_f, .. }: &Case) -> Cubic {
    let Transition { v_i, v_f, .. } = transition;
    Cubic::new(&transition, t_f, [0.0, -3.0 * (v_f - v_i) / (v_i * v_f)])
}

/// Whether the family has a member: some protocol under its bounds arrives, and its own shape allows one; `None` where rounding decides.
fn exists(case: &Case, family: &str, bounded: bool) -> Option<bool> {
    let Case { transition: problem, t_f, tau_ceiling } = *case;
    let Transition { law, v_i, v_f } = problem;
    let free = Bounds::new(bounded || family == "bounded_velocity");
    // The room that the shape leaves, relative to the size of its terms.
    let (bounds, room) = match family {
        "cubic" => (free, smooth_cubic(case).slack(StateLaw::Ageing)),
        "bounded_friction" => {
            let highest = [v_i, v_f].map(|v| 1.0 + (law.a - law.b) * v.ln()).into_iter().fold(f64::MIN, f64::max);
            (free.with_tau_ceiling(tau_ceiling), (tau_ceiling - highest) / (highest.abs() + 1.0))
        }
        _ => (free, f64::INFINITY),
    };
    if room <= UNCLEAR_RTOL {
        return (room < -UNCLEAR_RTOL).then_some(false);
    }
    // Without a floor every duration has a step, and the shape of a cubic decides.
    if !bounds.floor && family != "bounded_friction" {
        return Some(true);
    }
    let is_clear = (t_f - min_duration(&problem, bounds.floor)).abs() > UNCLEAR_RTOL * t_f;
    is_clear.then(|| Task::new(&problem, t_f, bounds).is_feasible()).flatten()
}

/// Checks a row of `compliant`: its control moves the spring, also open loop.
pub fn compliant(row: &mut CheckedRow<'_>) -> Checked {
    let (problem, t_f, slider) = (transition(&row.point), row.point[Quantity::Time], slider(&row.point));
    if !row.compare_feasible(t_f > min_duration(&problem, true)) {
        return Ok(());
    }
    let Transition { v_i, v_f, .. } = problem;
    let family = Exponential {
        t_f,
        first: v_i - 1.0,
        l: ((v_f - 1.0) / (v_i - 1.0)).ln(),
        shape: |x| [x * x * x * (10.0 + x * (6.0 * x - 15.0)), (x * (1.0 - x)).powi(3)],
        distance: &|at| [at.v - 1.0, at.v],
        rounding: 0.0,
    };
    let mut found = f64::NAN;
    let formula = |row: &mut CheckedRow<'_>, followed: &Followed| {
        let [alpha, off] = family.compare_alpha(row, followed, 1.0);
        found = alpha;
        off + followed.arrival(v_f)
    };
    let followed = follow(row, "compliant", None, formula)?;
    let protocol = ControlledProtocol { slider, v_i, v_f, t_f, alpha: row.number("alpha").unwrap_or(found) };
    open_loop::compare(row, &protocol, &followed);
    if let Some(optimum) = row.certify(&Task::new(&problem, t_f, row.context.bounded)) {
        row.compare_gap(optimum.work, followed.work);
    }
    Ok(())
}

/// Checks a row of `regularised`: off its pieces the protocol is the optimum.
pub fn regularised(row: &mut CheckedRow<'_>) -> Checked {
    let (problem, t_f, delta_t) = (transition(&row.point), row.point[Quantity::Time], row.point[Quantity::Smoothing]);
    let (bounded, rtol) = (row.context.bounded, row.context.rtol);
    let overlaps = 2.0 * delta_t > t_f || bounded && t_f < min_duration(&problem, true);
    let infeasible = row.has_status("infeasible");
    if infeasible && !overlaps && !bounded {
        return Err("optima that nearly come to rest");
    }
    if overlaps || infeasible {
        row.compare_feasible(!overlaps);
        return Ok(());
    }
    if row.has_status("unproven") {
        return Err("status is unproven");
    }
    let Some(optimum) = row.certify(&Task::new(&problem, t_f, bounded)) else { return Ok(()) };
    let corner = if bounded { optimum.motion.time_on(|at| at.v == 1.0) } else { 0.0 };
    // How far the protocol is from the optimum, on the floor up to the corner, where no piece replaces it.
    let piece = delta_t * (1.0 + rtol);
    let drift = |at: &Moment| {
        let replaced = at.t <= piece || at.t >= t_f - piece || corner > 0.0 && (at.t - corner).abs() <= piece;
        let (kinetic, press) = (problem.law.a * at.v, (at.friction + problem.law.a) / at.theta);
        match () {
            () if replaced => 0.0,
            () if at.t < corner => (at.v - 1.0).abs(),
            () => (kinetic - press - optimum.c).abs() / (kinetic.abs() + press.abs()),
        }
    };
    let formula = |_: &mut CheckedRow<'_>, followed: &Followed| followed.worst(drift) + followed.arrival(problem.v_f);
    let followed = follow(row, "regularised", None, formula)?;
    row.compare_small_gap(optimum.work, &followed, rtol);
    let (least, friction_min) = (followed.least(|at| at.v), followed.least(|at| at.friction));
    if (least - 1.0).abs() > 100.0 * rtol && friction_min > 0.0 {
        row.compare_word(STATUS, if least < 1.0 { "below_bound" } else { "ok" });
    }
    Ok(())
}
