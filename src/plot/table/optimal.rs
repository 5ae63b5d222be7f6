//! The optimal protocol over its duration, with the durations at which its strategy changes.

use super::choice::Shape;
use super::groups::Groups;
use super::map::{self, MapFigure};
use super::{Scene, lines, plain};
use crate::model::{Law, Transition};
use crate::plot::canvas::Stroke;
use crate::plot::figure::{Entry, Figure, Key, Layer};
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

/// Figure of table `optimal`: columns over an axis, or a map.
///
/// # Errors
///
/// A request that the table does not satisfy, or a part that cannot be read.
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
    let MapFigure { mut figure, groups, cells, .. } = map::map(scene.survey, plan)?;
    let styles = [
        ("t_cross", Stroke::solid("#000", 0.9)),
        ("t_floor", Stroke { dashes: &[3.0, 1.6], ..Stroke::solid("#000", 0.9) }),
    ];
    // The index of the duration among the axes, and the other axis.
    let (time, other) = match (plan.x.as_str(), plan.y.as_str()) {
        ("t_f", other) => (0, other),
        (other, "t_f") => (1, other),
        _ => return Ok(figure),
    };
    let Some(place) = AXES.iter().position(|axis| *axis == other) else { return Ok(figure) };
    let (unit, unit_of_time) = (scene.size(other), scene.source.units.size("l/v_0"));
    let wanted = Wanted { cross: true, floor: true, cheapest: false, min: false, turn: false, free: false };
    let mut is_drawn = [false; 2];
    for (group, panel) in figure.panels.iter_mut().enumerate() {
        let value = |&axis: &&str| if axis == other { Some(0.0) } else { scene.scaled(&groups, group, axis) };
        let Some(mut values) = AXES.iter().map(value).collect::<Option<Vec<f64>>>() else { continue };
        let mut curves = [Vec::new(), Vec::new()];
        for step in 0..=CURVE_STEPS {
            let at = cells[1 - time].scale.value(step as f64 / CURVE_STEPS as f64);
            values[place] = at / unit;
            let is_legal = matches!(
                values[..], [a, b, v_i, v_f] if a > 0.0 && b >= 0.0 && v_i > 1.0 && v_f > 1.0 && v_i != v_f
            );
            let times = is_legal.then(|| solved(scene, &values, wanted)).flatten();
            let found = times.map_or([None; 2], |times| [times.t_cross, times.t_floor]);
            for (curve, found) in curves.iter_mut().zip(found) {
                let found = found.map_or(f64::NAN, |found| found * unit_of_time);
                curve.push(if time == 0 { (found, at) } else { (at, found) });
            }
        }
        for ((curve, (_, stroke)), is_drawn) in curves.into_iter().zip(&styles).zip(&mut is_drawn) {
            let scale = if time == 0 { panel.x.scale } else { panel.y.scale };
            let of = |&(x, y): &(f64, f64)| scale.fraction(if time == 0 { x } else { y });
            if curve.iter().any(|point| (0.0..=1.0).contains(&of(point))) {
                *is_drawn = true;
                panel.layers.push(Layer::Contour(vec![curve], stroke.clone()));
            }
        }
    }
    for ((name, stroke), _) in styles.into_iter().zip(is_drawn).filter(|(_, is_drawn)| *is_drawn) {
        figure.legend.push(Entry { key: Key::Contour(stroke), text: label::name(name) });
    }
    Ok(figure)
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
