//! The protocols that can be traced, by name, and their parameters.

use std::fmt;

use super::disturbed::{self, Disturbance, MotionPart, Rest};
use super::sample;
use crate::grid::Quantity;
use crate::model::{Friction, Law, StateLaw, Transition, Units};
use crate::names::number;
use crate::numerics::double_double::DoubleDouble;
use crate::protocol::cubic::Landscape;
use crate::protocol::optimal::{self, Bounds, Optimum};
use crate::protocol::shortcut::{self, Case, FAMILIES, Family, Obstacle};
use crate::protocol::{Motion, SolverStats, SpringBlock, Status, arcsinh, best_cubic, compliant, regularised, relaxed};
use crate::stability::step_response::VelocityStep;

/// A protocol, with its spring if that is elastic.
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub enum Protocol {
    /// The protocol of least work under these bounds.
    Optimal { bounds: Bounds },
    /// The protocol of least work with regularised friction, which needs no floor.
    OptimalRegularised,
    /// The protocol of least work for a law other than ageing, between `v = 1` and `v_ceiling`.
    Relaxed { law: StateLaw, v_ceiling: f64 },
    /// The rest of a protocol of least work, from a state on the way: the transition of its case starts at `v_i = 1/theta`, its `t_f` is the
    /// time left.
    OptimalFrom { theta: f64, bounds: Bounds },
    /// The cubic shortcut of least work, with `v >= 1` under the floor of `bounds`, compared with the optimum under them.
    BestCubic { law: StateLaw, bounds: Bounds },
    /// A point of the landscape, scaled: `alpha_2 t_f` and `alpha_3 t_f^2`.
    CubicPoint { law: StateLaw, friction: Friction, place: [DoubleDouble; 2] },
    /// The member of a family.
    Family(&'static Family),
    /// The response of a block on a spring to a step of the control velocity.
    StepResponse { state_law: StateLaw, k: f64, m: f64 },
    /// The smooth shortcut on a spring.
    Compliant { k: f64, m: f64 },
    /// The optimal protocol with smooth pieces instead of jumps, on a spring.
    Regularised { k: f64, m: f64, delta_t: f64, bounded: bool },
}

/// The quantities that determine the protocol `name`: those of [`names`], and `feedback`, the rest of an optimal protocol from a state.
pub fn quantities(name: &str) -> Vec<Quantity> {
    let (start, own): (_, &[Quantity]) = match name {
        "feedback" => ([Quantity::Theta, Quantity::TimeLeft], &[Quantity::VelocityCeiling, Quantity::FrictionCeiling]),
        _ => (
            [Quantity::Time, Quantity::InitialVelocity],
            match name {
                "optimal" => &[Quantity::Law, Quantity::VelocityCeiling, Quantity::FrictionCeiling],
                "best_cubic" => &[Quantity::Law, Quantity::VelocityCeiling],
                "gap" => &[Quantity::Law, Quantity::Alpha2, Quantity::Alpha3],
                "step_response" => &[Quantity::Law, Quantity::Stiffness, Quantity::Mass],
                "compliant" => &[Quantity::Stiffness, Quantity::Mass],
                "regularised" => &[Quantity::Stiffness, Quantity::Mass, Quantity::Smoothing],
                _ if shortcut::find(name).is_some_and(|family| family.uses_tau_ceiling) => &[Quantity::FrictionCeiling],
                _ => &[],
            },
        ),
    };
    start.into_iter().chain([Quantity::A, Quantity::B, Quantity::FinalVelocity]).chain(own.iter().copied()).collect()
}

/// Whether a protocol supports regularised friction.
pub fn has_regularised_friction(name: &str) -> bool {
    matches!(name, "optimal" | "gap")
}

/// Whether the velocity floor has an effect on a protocol.
pub fn has_floor(name: &str, friction: Friction) -> bool {
    friction == Friction::Log && matches!(name, "optimal" | "feedback" | "best_cubic" | "regularised")
}

impl Protocol {
    /// The protocol `name` and its case, from the scaled numbers of its [`quantities`]; `relative` states which of `alpha_2` and `alpha_3`
    /// are relative to the duration.
    ///
    /// # Errors
    ///
    /// A quantity without a number; the family, if no protocol has this name.
    pub fn new(
        name: &str,
        (friction, bounded, relative): (Friction, bool, [bool; 2]),
        number: impl Fn(Quantity) -> Option<f64>,
    ) -> Result<(Protocol, Case), Quantity> {
        let number = |quantity: Quantity| number(quantity).ok_or(quantity);
        let (v_i, t_f) = match name {
            "feedback" => (1.0 / number(Quantity::Theta)?, number(Quantity::TimeLeft)?),
            _ => (number(Quantity::InitialVelocity)?, number(Quantity::Time)?),
        };
        let law = Law { a: number(Quantity::A)?, b: number(Quantity::B)? };
        let transition = Transition { law, v_i, v_f: number(Quantity::FinalVelocity)? };
        let [v_ceiling, tau_ceiling] = [number(Quantity::VelocityCeiling)?, number(Quantity::FrictionCeiling)?];
        let bounds = Bounds { floor: bounded, v_ceiling, tau_ceiling };
        let (k, m) = (number(Quantity::Stiffness)?, number(Quantity::Mass)?);
        let state_law = StateLaw::ALL.get(number(Quantity::Law)? as usize).copied().unwrap_or_default();
        let protocol = match (name, shortcut::find(name)) {
            ("optimal", _) if friction == Friction::Regularised => Protocol::OptimalRegularised,
            ("optimal", _) if state_law != StateLaw::Ageing => Protocol::Relaxed { law: state_law, v_ceiling },
            ("optimal", _) => Protocol::Optimal { bounds },
            ("feedback", _) => Protocol::OptimalFrom { theta: number(Quantity::Theta)?, bounds },
            ("best_cubic", _) => Protocol::BestCubic { law: state_law, bounds },
            ("gap", _) => {
                let alphas = [number(Quantity::Alpha2)?, number(Quantity::Alpha3)?].map(DoubleDouble::new);
                let units = [DoubleDouble::new(t_f), DoubleDouble::product(t_f, t_f)];
                let place = [0, 1].map(|i| if relative[i] { alphas[i] } else { alphas[i] * units[i] });
                Protocol::CubicPoint { law: state_law, friction, place }
            }
            // With a rigid spring, or without a change of velocity, the block follows the load point at once, which only
            // the ageing law has as a shortcut.
            ("step_response", _) => {
                let is_shortcut = k == f64::INFINITY && state_law == StateLaw::Ageing;
                match shortcut::find("step") {
                    Some(step) if is_shortcut || v_i == transition.v_f => Protocol::Family(step),
                    _ => Protocol::StepResponse { state_law, k, m },
                }
            }
            ("compliant", _) => Protocol::Compliant { k, m },
            ("regularised", _) => Protocol::Regularised { k, m, delta_t: number(Quantity::Smoothing)?, bounded },
            (_, Some(family)) => Protocol::Family(family),
            _ => return Err(Quantity::Family),
        };
        Ok((protocol, Case { transition, t_f, tau_ceiling }))
    }
}

/// Names and meanings of all protocols: first optima and landscape points, then [`FAMILIES`], then protocols on a spring.
pub fn names() -> impl Iterator<Item = (&'static str, &'static str)> {
    let others = [
        ("optimal", "least work of friction of all protocols; v may jump at both ends"),
        ("best_cubic", "theta a cubic in time, of least work; v may jump at both ends"),
        ("gap", "theta a cubic in time with alpha_2 and alpha_3 given; v may jump at both ends"),
    ];
    let elastic = [
        ("step_response", "a block on a spring whose load point jumps to v_f at once; with its v_c"),
        ("compliant", "v, v' and v'' continuous, so that an elastic spring can drive it; with its v_c"),
        ("regularised", "the optimal protocol, its jumps made smooth in pieces of length delta_t; with its v_c"),
    ];
    others.into_iter().chain(FAMILIES.into_iter().map(|family| (family.name, family.doc))).chain(elastic)
}

/// The path of a protocol: its motion and its numbers.
pub struct TracedPath {
    /// The motion.
    pub motion: Box<dyn Motion>,
    /// `Ok`, `BelowBound` or `Unproven`.
    pub status: Status,
    /// Work of friction, `int tau v dt`.
    pub work: f64,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
}

/// A number of a protocol.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// Its value, in scaled units.
    pub value: f64,
    /// The unit.
    pub unit: &'static str,
    /// Its meaning in one line.
    pub doc: &'static str,
}

impl Parameter {
    fn new(name: &'static str, value: f64, unit: &'static str, doc: &'static str) -> Parameter {
        Parameter { name, value, unit, doc }
    }
}

/// A positive `value` with six digits, rounded up (`direction` 1) or down (-1).
fn six_digits(value: f64, direction: f64) -> f64 {
    let nearest = |value: f64| format!("{value:.5e}").parse().unwrap_or(value);
    let near: f64 = nearest(value);
    let place = 10_f64.powf(value.log10().floor() - 5.0);
    if direction * (near - value) >= 0.0 { near } else { nearest(near + direction * place) }
}

/// The reason for a missing protocol.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub enum Absence {
    /// The reason given by the family.
    Obstacle(Obstacle),
    /// No protocol is that short.
    Time { t_f: f64, t_min: f64, bounded: bool },
    /// A ceiling leaves no protocol.
    Ceiling { obstacle: optimal::Obstacle, t_f: f64 },
    /// The state cannot arrive.
    State,
    /// No cubic shortcut keeps `v >= 1` (`bounded`) or `v > 0` in this time.
    Cubic { bounded: bool },
    /// The least work of all cubic shortcuts is approached at the border `v = 0`, not attained.
    Border,
    /// The smooth pieces do not fit.
    Pieces,
    /// The velocity becomes infinite, or has too many oscillations to show.
    Response,
    /// The spring is rigid, under another law than ageing.
    Rigid,
    /// Friction is so low somewhere that the extremal need not be unique, and none was found.
    Unproven,
}

impl fmt::Display for Absence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text(&Units::Scaled))
    }
}

impl std::error::Error for Absence {}

impl Absence {
    /// Whether the cause is a defect of slipsweep.
    pub fn is_defect(self) -> bool {
        self == Absence::Obstacle(Obstacle::NotConverged)
    }

    /// The reason, with numbers in `units`; a help follows on a line of its own.
    pub fn text(&self, units: &Units) -> String {
        let floor = |bounded: &bool| match (bounded, units) {
            (true, Units::Scaled) => "v >= 1",
            (true, Units::Si(_)) => "v >= v_0",
            (false, _) => "v > 0",
        };
        let time = |t: f64| shown(units, t, "l/v_0");
        match self {
            Absence::Obstacle(Obstacle::Time { t_min }) => {
                format!("the time is too short for {}: the least is t_min = {}", floor(&true), time(*t_min))
            }
            Absence::Obstacle(Obstacle::FrictionAtEnds { friction }) => {
                let friction = shown(units, *friction, "mu_0 sigma");
                format!("tau_ceiling must be above the friction of both ends, {friction}")
            }
            Absence::Obstacle(obstacle) => obstacle.to_string(),
            Absence::Time { t_f, t_min, bounded } => {
                let (t_f, t_min) = (time(*t_f), time(*t_min));
                format!("t_f = {t_f} is too short for {}: the least is t_min = {t_min}", floor(bounded))
            }
            Absence::Ceiling { obstacle, t_f } => of_ceiling(obstacle, *t_f, units),
            Absence::State => "no protocol arrives from this theta in the time t_left under these bounds".to_owned(),
            Absence::Cubic { bounded } => format!("no cubic shortcut keeps {} in this time", floor(bounded)),
            Absence::Border => {
                "no protocol attains the least work without the velocity floor: v falls to 0 somewhere\n  \
                                help: remove --unbounded"
                    .to_owned()
            }
            Absence::Pieces => {
                "delta_t is too long: two pieces must fit into t_f, and v must stay well above 0 in them".to_owned()
            }
            Absence::Response => {
                "before t_f the velocity becomes infinite, or there are more oscillations than can be shown".to_owned()
            }
            Absence::Rigid => "on a rigid spring a jump is traced with the ageing law alone\n  \
                               help: give the stiffness of a spring"
                .to_owned(),
            Absence::Unproven => {
                "friction is too low: where tau <= max(0, b - a) an optimum is not guaranteed, and none was found"
                    .to_owned()
            }
        }
    }
}

/// The bound that leaves no protocol of duration `t_f`.
fn of_ceiling(obstacle: &optimal::Obstacle, t_f: f64, units: &Units) -> String {
    let size = units.size("l/v_0");
    let t_f = shown(units, t_f, "l/v_0");
    let rounded = |t: f64, direction: f64| shown(units, six_digits(t * size, direction) / size, "l/v_0");
    match obstacle {
        optimal::Obstacle::Domain => Obstacle::Domain.to_string(),
        optimal::Obstacle::TooFast { t_least } => {
            let least = rounded(*t_least, 1.0);
            let found = format!("t_f = {t_f} is too short under these ceilings: the least is {least}");
            format!("{found}\n  help: raise --t-f to at least {least}, or raise the ceilings")
        }
        optimal::Obstacle::TooSlow { t_most } => {
            let greatest = rounded(*t_most, -1.0);
            let found = format!("t_f = {t_f} is too long under these ceilings: the greatest is {greatest}");
            format!("{found}\n  help: lower --t-f to at most {greatest}, or raise the ceilings")
        }
        optimal::Obstacle::VCeiling { above } => format!("v_ceiling must be above {}", shown(units, *above, "v_0")),
        optimal::Obstacle::TauCeiling { above } => {
            format!("tau_ceiling must be above {}", shown(units, *above, "mu_0 sigma"))
        }
    }
}

/// A number in `units`, with all its digits; in SI with nine and its unit.
fn shown(units: &Units, value: f64, unit: &'static str) -> String {
    if *units == Units::Scaled {
        return value.to_string();
    }
    format!("{} {}", number(value * units.size(unit)), units.name(unit))
}

impl From<Obstacle> for Absence {
    fn from(obstacle: Obstacle) -> Absence {
        Absence::Obstacle(obstacle)
    }
}

impl Protocol {
    /// The meaning, in one line.
    pub fn doc(&self, name: &str) -> &'static str {
        match self {
            Protocol::StepResponse { .. } => {
                "the control velocity jumps to v_f and stays there; the block on its spring up to t_f"
            }
            _ => names().find(|(known, _)| *known == name).map_or("", |(_, doc)| doc),
        }
    }

    /// The path of the protocol for `case`, with a relative error of `rtol`.
    ///
    /// # Errors
    ///
    /// The reason why the protocol does not exist.
    pub fn path(&self, case: &Case, rtol: f64) -> Result<TracedPath, Absence> {
        match *self {
            Protocol::Optimal { bounds } => optimum(case, &bounds, rtol),
            Protocol::OptimalRegularised => regularised_optimum(case),
            Protocol::Relaxed { law, v_ceiling } => relaxed_optimum(case, law, v_ceiling),
            Protocol::OptimalFrom { theta, bounds } => rest(case, theta, &bounds, rtol),
            Protocol::BestCubic { law, bounds } => least_cubic(case, law, &bounds, rtol),
            Protocol::CubicPoint { law, friction, place } => gap(case, (law, friction), place, rtol),
            Protocol::Family(family) => member(family, case, rtol),
            Protocol::StepResponse { state_law, k, m } => response(case, state_law, (k, m), rtol),
            Protocol::Compliant { k, m } => smooth(case, k, m, rtol),
            Protocol::Regularised { k, m, delta_t, bounded } => pieced(case, (k, m), delta_t, bounded, rtol),
        }
    }
}

/// The reason for a missing protocol, by its status.
fn reason(status: Status, infeasible: impl FnOnce() -> Absence) -> Absence {
    match status {
        Status::Infeasible => infeasible(),
        Status::Unproven => Absence::Unproven,
        _ => Obstacle::NotConverged.into(),
    }
}

fn optimum(case: &Case, bounds: &Bounds, rtol: f64) -> Result<TracedPath, Absence> {
    let (solved, motion) = optimal::motion(&case.transition, case.t_f, bounds, rtol);
    let (Some(value), Some(motion)) = (solved.value, motion) else {
        return Err(without_optimum(case, bounds, solved.status));
    };
    Ok(TracedPath { motion, status: solved.status, work: value.work, parameters: of_optimum(&value, bounds) })
}

/// The optimum with regularised friction.
fn regularised_optimum(case: &Case) -> Result<TracedPath, Absence> {
    let Case { transition, t_f, .. } = *case;
    let (solved, motion) = arcsinh::motion(&transition, t_f);
    let (Some(found), Some(motion)) = (solved.value, motion) else {
        let too_short = |t_min| Absence::Time { t_f, t_min, bounded: false };
        let infeasible = || arcsinh::least_time(&transition).map_or(Obstacle::Domain.into(), too_short);
        return Err(reason(solved.status, infeasible));
    };
    let hamiltonian = Parameter::new("hamiltonian", found.optimum.hamiltonian, "mu_0 sigma v_0", "dW*/dt_f");
    Ok(TracedPath { motion, status: solved.status, work: found.optimum.work, parameters: vec![hamiltonian] })
}

/// The optimum of another law than ageing; pulses stand for chattering.
fn relaxed_optimum(case: &Case, law: StateLaw, v_ceiling: f64) -> Result<TracedPath, Absence> {
    let Case { transition, t_f, .. } = *case;
    let (solved, motion) = relaxed::motion(law, &transition, t_f, v_ceiling);
    let (Some(found), Some(motion)) = (solved.value, motion) else {
        let ceiling = |above: f64| Absence::Ceiling { obstacle: optimal::Obstacle::VCeiling { above }, t_f };
        let too_fast = |t_least| Absence::Ceiling { obstacle: optimal::Obstacle::TooFast { t_least }, t_f };
        let least = relaxed::least_time(law, &transition, v_ceiling);
        return Err(match solved.status {
            Status::Unproven if transition.v_i > v_ceiling => ceiling(transition.v_i),
            status => reason(status, || least.map_or(ceiling(transition.v_f), too_fast)),
        });
    };
    let bounds = Bounds::new(true).with_v_ceiling(v_ceiling);
    let mut parameters = of_optimum(&found.optimum, &bounds);
    if let Some(chatter) = found.chatter {
        let rest = [
            ("chatter_time", chatter.time, "l/v_0", "time in which v alternates ever faster"),
            ("chatter_theta", chatter.theta, "l/v_0", "state variable theta while v alternates"),
            ("chatter_duty", chatter.duty, "1", "fraction of chatter_time on the velocity ceiling"),
            ("chatter_pulses", relaxed::PULSES as f64, "1", "pulses of this trace; work is the limit of ever more"),
        ];
        parameters.extend(rest.map(|(name, value, unit, doc)| Parameter::new(name, value, unit, doc)));
    }
    Ok(TracedPath { motion, status: solved.status, work: found.optimum.work, parameters })
}

/// The numbers of an optimal protocol that a trace lists.
fn of_optimum(value: &Optimum, bounds: &Bounds) -> Vec<Parameter> {
    let time = |name, value, doc| Parameter::new(name, value, "l/v_0", doc);
    let mut parameters = vec![
        Parameter::new("hamiltonian", value.hamiltonian, "mu_0 sigma v_0", "dW*/dt_f"),
        time("time_at_floor", value.time_at_floor, "time spent on the velocity floor v = v_0"),
    ];
    if bounds.v_ceiling.is_finite() {
        parameters.push(time("time_at_v_ceiling", value.time_at_v_ceiling, "time spent on the velocity ceiling"));
    }
    if bounds.tau_ceiling.is_finite() {
        parameters.push(time("time_at_tau_ceiling", value.time_at_tau_ceiling, "time spent on the friction ceiling"));
    }
    parameters
}

/// The rest of an optimal protocol from the state `theta`, in the time `case.t_f`.
fn rest(case: &Case, theta: f64, bounds: &Bounds, rtol: f64) -> Result<TracedPath, Absence> {
    let Transition { law, v_f, .. } = case.transition;
    let (solved, motion) = optimal::motion_from(law, theta, case.t_f, v_f, bounds, rtol);
    let (Some(value), Some(motion)) = (solved.value, motion) else {
        return Err(reason(solved.status, || Absence::State));
    };
    let (motion, parameters) = (Box::new(MotionPart::from_state(motion)), of_optimum(&value, bounds));
    Ok(TracedPath { motion, status: solved.status, work: value.work, parameters })
}

/// A protocol of least work whose state variable is disturbed on the way.
pub struct Disturbed {
    /// The protocol up to the disturbance.
    pub head: Box<dyn Motion>,
    /// Time of the disturbance.
    pub t: f64,
    /// The protocol as planned.
    pub planned: TracedPath,
    /// Its rest with the velocity as planned. Its work is that of the whole protocol.
    pub open: Rest,
    /// Its rest with the optimal velocity of the disturbed state. Its work is that of the whole protocol.
    pub closed: Rest,
}

impl Disturbed {
    /// The protocol of least work for `case` under `bounds`, with `disturbance`.
    ///
    /// # Errors
    /// If there is no such protocol, or if the disturbed state cannot arrive in the time left.
    pub fn new(case: &Case, bounds: &Bounds, disturbance: &Disturbance, rtol: f64) -> Result<Disturbed, Absence> {
        let rtol = rtol.min(DISTURBED_RTOL);
        let motion = || Ok::<_, Absence>(optimum(case, bounds, rtol)?.motion);
        let planned = optimum(case, bounds, rtol)?;
        let t = disturbance.at * planned.motion.duration();
        let place = sample::at_time(&*planned.motion, t).ok_or(Obstacle::NotConverged)?;
        let moment = place.1;
        let left = case.t_f - moment.t;
        let go = |theta: f64| rest(&Case { t_f: left, ..*case }, theta, bounds, rtol);
        let undisturbed = go(moment.theta)?.work;
        let closed = go(moment.theta * (1.0 + disturbance.change))?;
        let work = planned.work - undisturbed + closed.work;
        let open = disturbed::open_loop(motion()?, place, planned.work, disturbance.change, &case.transition);
        let head = Box::new(MotionPart::start(motion()?, place));
        let closed = Rest { motion: closed.motion, work, terminal_error: 0.0 };
        Ok(Disturbed { head, t: moment.t, planned, open, closed })
    }
}

/// Accuracy of a disturbed protocol: its works are compared. Chosen: a hundredth of the default `rtol`.
const DISTURBED_RTOL: f64 = 1e-12;

fn without_optimum(case: &Case, bounds: &Bounds, status: Status) -> Absence {
    let (Case { transition, t_f, .. }, bounded) = (*case, bounds.floor);
    reason(status, || {
        let obstacle = optimal::obstacle(&transition, t_f, bounds).filter(|_| bounds.has_ceilings());
        match (obstacle, optimal::shortest_time(&transition, bounded)) {
            (Some(obstacle), _) => Absence::Ceiling { obstacle, t_f },
            (None, Some(t_min)) if t_f <= t_min => Absence::Time { t_f, t_min, bounded },
            _ => Obstacle::Domain.into(),
        }
    })
}

fn least_cubic(case: &Case, law: StateLaw, bounds: &Bounds, rtol: f64) -> Result<TracedPath, Absence> {
    let solved = best_cubic::solve_under(law, &case.transition, case.t_f, *bounds, rtol);
    let Some(value) = solved.value else {
        // Without an optimum there is no shortcut either.
        match law {
            StateLaw::Ageing => optimum(case, bounds, rtol)?,
            _ => relaxed_optimum(case, law, bounds.v_ceiling)?,
        };
        return Err(reason(solved.status, || Absence::Cubic { bounded: bounds.floor }));
    };
    if value.v_min == 0.0 {
        return Err(Absence::Border);
    }
    let landscape = Landscape::under(law, &case.transition, case.t_f, rtol);
    let motion = landscape.motion(value.coefficients, Friction::Log).ok_or(Obstacle::NotConverged)?;
    let mut parameters = scaled(value.a_2, value.a_3);
    let doc = match bounds.v_ceiling.is_finite() {
        true => "(W_s - W*)/W*; W* obeys v_ceiling, the shortcut need not",
        false => "(W_s - W*)/W*",
    };
    parameters.push(Parameter::new("gap", value.gap, "1", doc));
    Ok(TracedPath { motion, status: solved.status, work: value.work, parameters })
}

fn gap(
    case: &Case,
    (law, friction): (StateLaw, Friction),
    place: [DoubleDouble; 2],
    rtol: f64,
) -> Result<TracedPath, Absence> {
    let landscape = Landscape::under(law, &case.transition, case.t_f, rtol);
    let point = landscape.point(place, friction, rtol, &mut SolverStats::default()).ok_or(Obstacle::Velocity)?;
    if point.status == Status::NotConverged {
        return Err(Obstacle::NotConverged.into());
    }
    let motion = landscape.motion(place, friction).ok_or(Obstacle::Velocity)?;
    let parameters = scaled(place[0].high, place[1].high);
    Ok(TracedPath { motion, status: point.status, work: point.work, parameters })
}

fn scaled(a_2: f64, a_3: f64) -> Vec<Parameter> {
    vec![
        Parameter::new("alpha_2", a_2, "1/t_f", "coefficient of t in theta"),
        Parameter::new("alpha_3", a_3, "1/t_f^2", "coefficient of t^2 in theta"),
    ]
}

/// A parameter, and the range of the control velocity.
fn with_control(first: Parameter, least: f64, greatest: f64) -> Vec<Parameter> {
    let control = |name, value, doc| Parameter::new(name, value, "v_0", doc);
    let least = control("v_c_min", least, "least control velocity");
    vec![first, least, control("v_c_max", greatest, "greatest control velocity")]
}

fn response(case: &Case, state_law: StateLaw, (k, m): (f64, f64), rtol: f64) -> Result<TracedPath, Absence> {
    if k == f64::INFINITY {
        return Err(Absence::Rigid);
    }
    let motion = VelocityStep { state_law, transition: case.transition, k, m }
        .motion(case.t_f, rtol)
        .ok_or(Absence::Response)?;
    let status = if motion.least_velocity() < 1.0 { Status::BelowBound } else { Status::Ok };
    Ok(TracedPath { work: motion.work(), motion: Box::new(motion), status, parameters: Vec::new() })
}

fn smooth(case: &Case, k: f64, m: f64, rtol: f64) -> Result<TracedPath, Absence> {
    let Case { transition: Transition { law, v_i, v_f }, t_f, .. } = *case;
    let slider = SpringBlock { law, k, m };
    let solved = compliant::solve(&slider, (v_i, v_f), t_f, rtol);
    let t_min = case.transition.min_duration();
    let (Some(value), Ok(path)) = (solved.value, compliant::path(&slider, (v_i, v_f), t_f, rtol)) else {
        let too_short = Absence::Time { t_f, t_min, bounded: true };
        return Err(reason(solved.status, || if t_f <= t_min { too_short } else { Obstacle::Domain.into() }));
    };
    let alpha = Parameter::new("alpha", value.alpha, "1", "coefficient of x^3 (1 - x)^3 in ln(v - 1), x = t/t_f");
    let parameters = with_control(alpha, value.control_min, value.control_max);
    Ok(TracedPath { motion: Box::new(path), status: solved.status, work: value.work, parameters })
}

fn pieced(case: &Case, (k, m): (f64, f64), delta_t: f64, bounded: bool, rtol: f64) -> Result<TracedPath, Absence> {
    let Case { transition: Transition { law, v_i, v_f }, t_f, .. } = *case;
    let (solved, motion) = regularised::motion(&SpringBlock { law, k, m }, (v_i, v_f), t_f, delta_t, bounded, rtol);
    let (Some(value), Some(motion)) = (solved.value, motion) else {
        let optimum = optimal::solve(&case.transition, t_f, bounded, rtol);
        return Err(match optimum.value {
            None => without_optimum(case, &Bounds::new(bounded), optimum.status),
            Some(_) => reason(solved.status, || Absence::Pieces),
        });
    };
    let gap = Parameter::new("gap", value.gap, "1", "(work - W*)/W*");
    let parameters = with_control(gap, value.control_min, value.control_max);
    Ok(TracedPath { motion, status: solved.status, work: value.work, parameters })
}

fn member(family: &Family, case: &Case, rtol: f64) -> Result<TracedPath, Absence> {
    let shortcut = family.solve(case, rtol, &mut SolverStats::default())?;
    let motion = family.motion(case, rtol)?;
    // A step has no least duration, but it counts as infeasible where every other protocol is.
    let late = case.t_f < case.transition.min_duration();
    let status = if late { Status::Infeasible } else { shortcut.status() };
    let alpha = shortcut.alpha.into_iter().zip(family.alpha);
    let mut parameters: Vec<_> = alpha.map(|(alpha, doc)| Parameter::new("alpha", alpha, "1", doc)).collect();
    if shortcut.miss != 0.0 {
        parameters.push(Parameter::new("miss", shortcut.miss, "1", "distance from the target, theta(t_f) v_f - 1"));
    }
    Ok(TracedPath { motion, status, work: shortcut.work, parameters })
}
