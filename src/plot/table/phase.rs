//! Phase diagrams of sliding on a spring: the outcome over stiffness and velocity, and the critical stiffness.

use super::choice::Shape;
use super::groups::Groups;
use super::map::{self, MapFigure};
use super::{Scene, plain};
use crate::model::Law;
use crate::plot::PlotError;
use crate::plot::canvas::Stroke;
use crate::plot::figure::{Entry, Figure, Key, Layer};
use crate::stability::SteadySliding;

/// Steps along the curve. Chosen: no corner is visible in print.
const CURVE_STEPS: usize = 400;

/// Figure of a table on a spring: columns over an axis, or a map with the critical stiffness.
///
/// # Errors
///
/// A request that the table does not satisfy, or a part that cannot be read.
pub fn draw(scene: &Scene<'_>, shape: &Shape) -> Result<Figure, PlotError> {
    let Shape::Map(plan) = shape else { return plain(scene, shape) };
    let MapFigure { mut figure, groups, cells, .. } = map::map(scene.survey, plan)?;
    let mut velocities: [&str; 2] = [&plan.x, &plan.y];
    velocities.sort_unstable();
    if velocities != ["k", "v_f"] {
        return Ok(figure);
    }
    let stroke = Stroke { colour: "#000".to_owned(), width: 1.0, dashes: &[4.0, 2.0] };
    let velocity = usize::from(plan.x == "k");
    let (unit_of_v, unit_of_k) = (scene.source.units.size("v_0"), scene.source.units.size("mu_0 sigma/l"));
    let mut any = false;
    for (place, panel) in figure.panels.iter_mut().enumerate() {
        let Some((law, m)) = slider(scene, &groups, place) else { continue };
        let curve = (0..=CURVE_STEPS).map(|i| {
            let v = cells[velocity].scale.value(i as f64 / CURVE_STEPS as f64);
            let k = SteadySliding::new(law, 1.0, m, v / unit_of_v).critical_stiffness() * unit_of_k;
            if velocity == 0 { (v, k) } else { (k, v) }
        });
        panel.layers.push(Layer::Contour(vec![curve.collect()], stroke.clone()));
        any = true;
    }
    if any {
        figure.legend.push(Entry { key: Key::Contour(stroke), text: "*k*_{c}(*v*_{f})".to_owned() });
    }
    Ok(figure)
}

/// The law and the mass of a panel.
fn slider(scene: &Scene<'_>, groups: &Groups, panel: usize) -> Option<(Law, f64)> {
    let value = |name| scene.scaled(groups, panel, name);
    Some((Law { a: value("a")?, b: value("b")? }, value("m")?))
}
