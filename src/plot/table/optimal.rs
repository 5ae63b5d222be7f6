//! The optimal protocol over its duration, with the durations at which its strategy changes.

use super::choice::Shape;
use super::groups::Groups;
use super::survey::Survey;
use super::{Scene, lines, plain};
use crate::model::{Law, Transition};
use crate::plot::canvas::Stroke;
use crate::plot::figure::{Figure, Layer};
use crate::plot::{PlotError, colour, label};
use crate::protocol::optimal::crossover::{self, CrossoverTimes, Wanted};

/// The durations that are marked.
const MARKED: [&str; 5] = ["t_cheapest", "t_cross", "t_hold", "t_min", "t_turn"];

/// Most lines for which they are marked: more marks hide what they are to show.
const MOST_MARKED: usize = 3;

/// What a transition depends on.
const AXES: [&str; 4] = ["a", "b", "v_i", "v_f"];

/// Accuracy of a mark: finer than a picture shows.
const RTOL: f64 = 1e-6;

pub fn draw(scene: &Scene<'_>, shape: &Shape) -> Result<Figure, PlotError> {
    let Shape::Lines(plan) = shape else {
        let mut figure = plain(scene, shape)?;
        if let (Shape::Map(plan), Some(colours)) = (shape, &mut figure.colours)
            && plan.value == "work"
        {
            colours.label = label::axis("work_optimal", &scene.survey.unit("work"), 0);
        }
        return Ok(figure);
    };
    let lined = lines::lines(scene.survey, plan, |_, _| {})?;
    let mut figure = lined.figure;
    let count = lined.groups.shown.len();
    // This work is the least one.
    for panel in figure.panels.iter_mut().filter(|panel| panel.y.column == "work") {
        panel.y.column = "work_optimal".to_owned();
    }
    if plan.x != "t_f" || count > MOST_MARKED {
        return Ok(figure);
    }
    for group in 0..count {
        let times = times(scene, &lined.groups, group)?;
        let colour = if count == 1 { "#555".to_owned() } else { colour::series(group).colour };
        for (name, time) in MARKED.iter().zip(times) {
            let Some(time) = time.filter(|time| (lined.x.low..=lined.x.high).contains(time)) else { continue };
            let stroke = Stroke { colour: colour.clone(), width: 0.5, dashes: &[2.0, 1.5] };
            for (place, panel) in figure.panels.iter_mut().enumerate() {
                // One panel says what the marks are.
                let words = if place == 0 { label::name(name) } else { String::new() };
                panel.layers.push(Layer::Mark(time, words, stroke.clone()));
            }
        }
    }
    Ok(figure)
}

/// The durations of a line: from the table `crossover` if the dataset has it, else solved.
fn times(scene: &Scene<'_>, groups: &Groups, group: usize) -> Result<Vec<Option<f64>>, PlotError> {
    let values: Option<Vec<f64>> = AXES.iter().map(|axis| scene.value(groups, group, axis)).collect();
    let Some(values) = values else { return Ok(Vec::new()) };
    if let Some(times) = tabled(scene, &values)? {
        return Ok(times);
    }
    let scaled: Option<Vec<f64>> = AXES.iter().map(|axis| scene.scaled(groups, group, axis)).collect();
    let Some(&[a, b, v_i, v_f]) = scaled.as_deref() else { return Ok(Vec::new()) };
    let transition = Transition { law: Law { a, b }, v_i, v_f };
    let wanted = Wanted { cross: true, hold: true, cheapest: true, min: true, turn: true, free: false };
    let (_, times, _) = crossover::solve(&transition, scene.source.bounded, RTOL, wanted);
    let CrossoverTimes { t_cross, t_hold, t_cheapest, t_min, t_turn, .. } = times;
    let unit = scene.source.units.size("l/v_0");
    Ok([t_cheapest, t_cross, t_hold, t_min, t_turn].into_iter().map(|time| Some(time? * unit)).collect())
}

fn tabled(scene: &Scene<'_>, values: &[f64]) -> Result<Option<Vec<Option<f64>>>, PlotError> {
    let source = scene.source;
    if !source.manifest.tables.iter().any(|table| table.name == "crossover") {
        return Ok(None);
    }
    let survey = match Survey::new(&source.folder, &source.manifest, "crossover", &[]) {
        Err(PlotError::Empty { .. }) => return Ok(None),
        survey => survey?,
    };
    if !MARKED.iter().all(|column| survey.has(column)) {
        return Ok(None);
    }
    let columns: Vec<&str> = AXES.into_iter().chain(MARKED).collect();
    let mut found = None;
    survey.each(&columns, |row| {
        if row[..AXES.len()] == *values {
            found = Some(row[AXES.len()..].iter().map(|&time| time.is_finite().then_some(time)).collect());
        }
    })?;
    Ok(found)
}
