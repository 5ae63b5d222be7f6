//! The optimal protocol over its duration, with the durations at which its strategy changes.

use super::choice::Shape;
use super::groups::Groups;
use super::map::{self, MapFigure};
use super::{CEILINGS, Scene, lines, plain};
use crate::model::{Law, Transition};
use crate::plot::canvas::Stroke;
use crate::plot::figure::{Entry, Figure, Key, Layer};
use crate::plot::{PlotError, colour, label};
use crate::protocol::optimal::crossover::{self, CrossoverTimes, Wanted};
use crate::protocol::optimal::{self, Bounds};

/// The marked durations.
const MARKED: [&str; 5] = ["t_cheapest", "t_cross", "t_floor", "t_min", "t_turn"];

/// Greatest number of lines with marks. Chosen: more marks hide the curves.
const MAX_MARKED_LINES: usize = 3;

/// The axes of a transition.
const AXES: [&str; 4] = ["a", "b", "v_i", "v_f"];

/// Steps along a curve of durations. Chosen: no corner is visible in print.
const CURVE_STEPS: usize = 120;

/// Relative tolerance of a mark. Chosen: finer than a picture shows.
const RTOL: f64 = 1e-6;

/// Figure of table `optimal`: columns over an axis, or a map.
///
/// # Errors
///
/// A request that the table does not satisfy, or a part that cannot be read.
pub fn draw(scene: &Scene<'_>, shape: &Shape) -> Result<Figure, PlotError> {
    let Shape::Lines(plan) = shape else {
        return match shape {
            Shape::Map(plan) if plan.value == "strategy" => strategies(scene, plan),
            Shape::Map(plan) if plan.value == "binding" => binding(scene, plan),
            Shape::Map(plan) => {
                let mut figure = plain(scene, shape)?;
                if let Some(colours) = figure.colours.as_mut().filter(|_| plan.value == "work") {
                    colours.label = label::axis("work_optimal", &scene.survey.unit("work"), 0);
                }
                Ok(figure)
            }
            Shape::Lines(_) => plain(scene, shape),
        };
    };
    let lined = lines::lines(scene.survey, plan)?;
    let mut figure = lined.figure;
    let count = lined.groups.shown.len();
    // The work of this table is the least work.
    for panel in figure.panels.iter_mut().filter(|panel| panel.y.column == "work") {
        panel.y.column = "work_optimal".to_owned();
    }
    if count > MAX_MARKED_LINES {
        return Ok(figure);
    }
    // Of coinciding lines, one is drawn.
    for group in (0..count).filter(|&group| lined.leaders[group] == group) {
        let marks = match plan.x.as_str() {
            "t_f" => times(scene, &lined.groups, group),
            "v_ceiling" | "tau_ceiling" => ceilings(scene, (&lined.groups, group), &plan.x, None),
            _ => Vec::new(),
        };
        let colour = if count == 1 { "#555".to_owned() } else { colour::series(group).colour };
        for (name, place) in marks {
            let Some(at) = place.filter(|at| (lined.x.low..=lined.x.high).contains(at)) else { continue };
            let stroke = Stroke { colour: colour.clone(), width: 0.5, dashes: &[2.0, 1.5] };
            for (place, panel) in figure.panels.iter_mut().enumerate() {
                // The first panel labels the marks.
                let words = if place == 0 { label::name(name) } else { String::new() };
                panel.layers.push(Layer::Vertical(at, words, stroke.clone()));
            }
        }
    }
    Ok(figure)
}

/// The least feasible value of the ceiling `axis` for a group, and the greatest value of the optimum without it; `t_f`, scaled, where the
/// duration is an axis of the picture.
fn ceilings(
    scene: &Scene<'_>,
    (groups, group): (&Groups, usize),
    axis: &str,
    t_f: Option<f64>,
) -> Vec<(&'static str, Option<f64>)> {
    let value = |name: &str| scene.scaled(groups, group, name);
    let (Some(a), Some(b), Some(v_i), Some(v_f), Some(t_f)) =
        (value("a"), value("b"), value("v_i"), value("v_f"), t_f.or_else(|| value("t_f")))
    else {
        return Vec::new();
    };
    let transition = Transition { law: Law { a, b }, v_i, v_f };
    // A ceiling without a finite value is none.
    let other = |name: &str| if name == axis { f64::INFINITY } else { value(name).unwrap_or(f64::INFINITY) };
    let bounds =
        Bounds { floor: scene.source.bounded, v_ceiling: other("v_ceiling"), tau_ceiling: other("tau_ceiling") };
    let free = optimal::solve(&transition, t_f, bounds, RTOL).value;
    let marks = if axis == "v_ceiling" {
        let least = optimal::least_v_ceiling(&transition, t_f, bounds, RTOL);
        // The velocity has its greatest value at an end, or just below on a friction ceiling.
        [("v_ceiling_least", least), ("v_max", free.map(|free| free.v_start.max(free.v_end)))]
    } else {
        let least = optimal::least_tau_ceiling(&transition, t_f, bounds, RTOL);
        [("tau_ceiling_least", least), ("friction_max", free.map(|free| free.friction_max))]
    };
    marks.map(|(name, place)| (name, place.map(|place| place * scene.size(axis)))).to_vec()
}

/// A map of the ceilings that bind, with the least feasible ceiling and the peak of the optimum without it.
fn binding(scene: &Scene<'_>, plan: &map::Plan) -> Result<Figure, PlotError> {
    let MapFigure { mut figure, groups, cells, .. } = map::map(scene.survey, plan)?;
    let styles = [Stroke { dashes: &[3.0, 1.6], ..Stroke::solid("#000", 0.9) }, Stroke::solid("#000", 0.9)];
    if plan.x != "t_f" || !CEILINGS.contains(&plan.y.as_str()) {
        return Ok(figure);
    }
    let mut names = [""; 2];
    for (group, panel) in figure.panels.iter_mut().enumerate() {
        let mut curves = [Vec::new(), Vec::new()];
        for step in 0..=CURVE_STEPS {
            let t_f = cells[0].scale.value(step as f64 / CURVE_STEPS as f64);
            let time = t_f / scene.size("t_f");
            for ((curve, name), (mark, place)) in
                curves.iter_mut().zip(&mut names).zip(ceilings(scene, (&groups, group), &plan.y, Some(time)))
            {
                *name = mark;
                curve.push((t_f, place.unwrap_or(f64::NAN)));
            }
        }
        for (curve, stroke) in curves.into_iter().zip(&styles) {
            panel.layers.push(Layer::Contour(vec![curve], stroke.clone()));
        }
    }
    for (name, stroke) in names.into_iter().zip(styles).filter(|(name, _)| !name.is_empty()) {
        let text =
            if name.ends_with("least") { label::name(name) } else { format!("{} without ceiling", label::name(name)) };
        figure.legend.push(Entry { key: Key::Contour(stroke), text });
    }
    Ok(figure)
}

/// A map of the strategy, with the durations at which it changes.
fn strategies(scene: &Scene<'_>, plan: &map::Plan) -> Result<Figure, PlotError> {
    let mut map = map::map(scene.survey, plan)?;
    // The place of the duration among the axes, and what the other axis is.
    let (time, other) = match (plan.x.as_str(), plan.y.as_str()) {
        ("t_f", other) => (0, other),
        (other, "t_f") => (1, other),
        _ => return Ok(map.figure),
    };
    if !AXES.contains(&other) {
        return Ok(map.figure);
    }
    let (unit, unit_of_time) = (scene.size(other), scene.source.units.size("l/v_0"));
    let none = Wanted { cross: false, floor: false, cheapest: false, min: false, turn: false, free: false };
    type Curve = (&'static str, Wanted, fn(&CrossoverTimes) -> Option<f64>, &'static [f64]);
    let curves: [Curve; 2] = [
        ("t_cross", Wanted { cross: true, ..none }, |times| times.t_cross, &[]),
        ("t_floor", Wanted { floor: true, ..none }, |times| times.t_floor, &[3.0, 1.6]),
    ];
    let groups = map.groups.clone();
    for (name, wanted, duration, dashes) in curves {
        let duration = |panel: usize, at: f64| {
            let value = |axis: &&str| if *axis == other { Some(at / unit) } else { scene.scaled(&groups, panel, axis) };
            let values = AXES.iter().map(value).collect::<Option<Vec<f64>>>()?;
            let is_legal = matches!(
                values[..], [a, b, v_i, v_f] if a > 0.0 && b >= 0.0 && v_i > 1.0 && v_f > 1.0 && v_i != v_f
            );
            let times = is_legal.then(|| solved(scene, &values, wanted)).flatten()?;
            Some(duration(&times)? * unit_of_time)
        };
        let stroke = Stroke { dashes, ..Stroke::solid("#000", 0.9) };
        map.draw_curve(1 - time, CURVE_STEPS, (&label::name(name), stroke), duration);
    }
    Ok(map.figure)
}

/// The durations of a line, by the names of [`MARKED`]: those without ceilings.
fn times(scene: &Scene<'_>, groups: &Groups, group: usize) -> Vec<(&'static str, Option<f64>)> {
    let scaled: Option<Vec<f64>> = AXES.iter().map(|axis| scene.scaled(groups, group, axis)).collect();
    let wanted = Wanted { cross: true, floor: true, cheapest: true, min: true, turn: true, free: false };
    let is_capped = CEILINGS.iter().any(|name| scene.value(groups, group, name).is_some_and(f64::is_finite));
    let Some(times) = scaled.filter(|_| !is_capped).and_then(|values| solved(scene, &values, wanted)) else {
        return Vec::new();
    };
    let CrossoverTimes { t_cross, t_floor, t_cheapest, t_min, t_turn, .. } = times;
    let unit = scene.source.units.size("l/v_0");
    let times = [t_cheapest, t_cross, t_floor, t_min, t_turn].map(|time| Some(time? * unit));
    MARKED.into_iter().zip(times).collect()
}

/// The durations at which the strategy changes, for a transition whose values are in the order of [`AXES`].
fn solved(scene: &Scene<'_>, values: &[f64], wanted: Wanted) -> Option<CrossoverTimes> {
    let &[a, b, v_i, v_f] = values else { return None };
    let transition = Transition { law: Law { a, b }, v_i, v_f };
    Some(crossover::solve(&transition, scene.source.bounded, RTOL, wanted).1)
}
