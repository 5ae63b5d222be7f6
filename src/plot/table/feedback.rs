//! The optimal velocity over the state and the time left, with the times at which the strategy changes.

use super::choice::Shape;
use super::map::{self, MapFigure};
use super::{CEILINGS, Scene, plain};
use crate::model::{Law, Transition};
use crate::plot::canvas::Stroke;
use crate::plot::figure::{Entry, Figure, Key, Layer};
use crate::plot::{PlotError, label};
use crate::protocol::optimal::crossover::{self, Wanted};

/// Steps along a curve. Chosen: no corner is visible in print.
const CURVE_STEPS: usize = 240;

/// Relative tolerance of a curve. Chosen: finer than a picture shows.
const RTOL: f64 = 1e-6;

/// Times from steady sliding at `v = 1/theta`: where the velocity is `1/theta` now, where it reaches the floor, and the least one.
const TIMES: [&str; 3] = ["t_cross", "t_floor", "t_min"];

/// Figure of table `feedback`: columns over an axis, or a map of the control law.
///
/// # Errors
///
/// A request that the table does not satisfy, or a part that cannot be read.
pub fn draw(scene: &Scene<'_>, shape: &Shape) -> Result<Figure, PlotError> {
    let Shape::Map(plan) = shape else { return plain(scene, shape) };
    let MapFigure { mut figure, groups, cells, .. } = map::map(scene.survey, plan)?;
    if plan.x != "theta" || plan.y != "t_left" {
        return Ok(figure);
    }
    let dashed = |dashes| Stroke { dashes, ..Stroke::solid("#000", 0.9) };
    let styles = [Stroke::solid("#000", 0.9), dashed(&[3.0, 1.6]), dashed(&[1.0, 1.5])];
    let time = scene.source.units.size("l/v_0");
    let mut is_drawn = [false; TIMES.len()];
    for (group, panel) in figure.panels.iter_mut().enumerate() {
        let value = |name| scene.scaled(&groups, group, name);
        let (Some(a), Some(b), Some(v_f)) = (value("a"), value("b"), value("v_f")) else { continue };
        let mut curves = [Vec::new(), Vec::new(), Vec::new()];
        for step in 0..=CURVE_STEPS {
            let theta = cells[0].scale.value(step as f64 / CURVE_STEPS as f64);
            let transition = Transition { law: Law { a, b }, v_i: time / theta, v_f };
            let found = times(&transition, scene.source.bounded);
            for (curve, found) in curves.iter_mut().zip(found) {
                curve.push((theta, found.map_or(f64::NAN, |found| found * time)));
            }
        }
        for ((curve, stroke), is_drawn) in curves.into_iter().zip(&styles).zip(&mut is_drawn) {
            if curve.iter().any(|(_, t)| (0.0..=1.0).contains(&panel.y.scale.fraction(*t))) {
                *is_drawn = true;
                panel.layers.push(Layer::Contour(vec![curve], stroke.clone()));
            }
        }
    }
    let is_capped =
        scene.survey.axes.iter().any(|axis| CEILINGS.contains(&axis.name.as_str()) && !axis.values.is_empty());
    let condition = if is_capped { " without ceilings" } else { "" };
    for ((name, stroke), _) in TIMES.iter().zip(styles).zip(is_drawn).filter(|(_, is_drawn)| *is_drawn) {
        figure.legend.push(Entry { key: Key::Contour(stroke), text: format!("{}{condition}", label::name(name)) });
    }
    Ok(figure)
}

/// The times of [`TIMES`] without ceilings, from steady sliding.
fn times(transition: &Transition, bounded: bool) -> [Option<f64>; TIMES.len()] {
    if transition.v_i <= 1.0 || transition.v_i == transition.v_f {
        return [None; TIMES.len()];
    }
    let wanted = Wanted { cross: true, floor: true, cheapest: false, min: true, turn: false, free: false };
    let (_, times, _) = crossover::solve(transition, bounded, RTOL, wanted);
    [times.t_cross, times.t_floor, times.t_min]
}
