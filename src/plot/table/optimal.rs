//! The optimal protocol over its duration, with the durations at which its strategy changes.

use super::choice::Shape;
use super::groups::Groups;
use super::map;
use super::{Scene, lines, plain};
use crate::model::{Law, Transition};
use crate::plot::canvas::Stroke;
use crate::plot::figure::{Figure, Layer};
use crate::plot::{PlotError, colour, label};
use crate::protocol::optimal::crossover::{self, CrossoverTimes, Wanted};

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

pub fn draw(scene: &Scene<'_>, shape: &Shape) -> Result<Figure, PlotError> {
    let Shape::Lines(plan) = shape else {
        return match shape {
            Shape::Map(plan) if plan.value == "strategy" => strategies(scene, plan),
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
    if plan.x != "t_f" || count > MAX_MARKED_LINES {
        return Ok(figure);
    }
    // Of coinciding lines, one is drawn.
    for group in (0..count).filter(|&group| lined.leaders[group] == group) {
        let times = times(scene, &lined.groups, group);
        let colour = if count == 1 { "#555".to_owned() } else { colour::series(group).colour };
        for (name, time) in MARKED.iter().zip(times) {
            let Some(time) = time.filter(|time| (lined.x.low..=lined.x.high).contains(time)) else { continue };
            let stroke = Stroke { colour: colour.clone(), width: 0.5, dashes: &[2.0, 1.5] };
            for (place, panel) in figure.panels.iter_mut().enumerate() {
                // The first panel labels the marks.
                let words = if place == 0 { label::name(name) } else { String::new() };
                panel.layers.push(Layer::Vertical(time, words, stroke.clone()));
            }
        }
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

/// The durations of a line, in the order of [`MARKED`].
fn times(scene: &Scene<'_>, groups: &Groups, group: usize) -> [Option<f64>; MARKED.len()] {
    let scaled: Option<Vec<f64>> = AXES.iter().map(|axis| scene.scaled(groups, group, axis)).collect();
    let wanted = Wanted { cross: true, floor: true, cheapest: true, min: true, turn: true, free: false };
    let Some(times) = scaled.and_then(|values| solved(scene, &values, wanted)) else { return [None; MARKED.len()] };
    let CrossoverTimes { t_cross, t_floor, t_cheapest, t_min, t_turn, .. } = times;
    let unit = scene.source.units.size("l/v_0");
    [t_cheapest, t_cross, t_floor, t_min, t_turn].map(|time| Some(time? * unit))
}

/// The durations at which the strategy changes, for a transition whose values are in the order of [`AXES`].
fn solved(scene: &Scene<'_>, values: &[f64], wanted: Wanted) -> Option<CrossoverTimes> {
    let &[a, b, v_i, v_f] = values else { return None };
    let transition = Transition { law: Law { a, b }, v_i, v_f };
    Some(crossover::solve(&transition, scene.source.bounded, RTOL, wanted).1)
}
