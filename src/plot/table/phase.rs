//! Phase diagrams of sliding on a spring: the outcome over stiffness and velocity, and the critical stiffness.

use super::choice::Shape;
use super::map;
use super::{Scene, plain};
use crate::model::Law;
use crate::plot::PlotError;
use crate::plot::canvas::Stroke;
use crate::plot::figure::Figure;
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
    let mut map = map::map(scene.survey, plan)?;
    let mut axes: [&str; 2] = [&plan.x, &plan.y];
    axes.sort_unstable();
    if axes == ["k", "v_f"] {
        let stroke = Stroke { colour: "#000".to_owned(), width: 1.0, dashes: &[4.0, 2.0] };
        let (unit_of_v, unit_of_k) = (scene.source.units.size("v_0"), scene.source.units.size("mu_0 sigma/l"));
        let groups = map.groups.clone();
        let critical_stiffness = |panel: usize, v: f64| {
            let value = |name| scene.scaled(&groups, panel, name);
            let law = Law { a: value("a")?, b: value("b")? };
            let sliding = SteadySliding::new(law, 1.0, value("m")?, v / unit_of_v);
            Some(sliding.critical_stiffness() * unit_of_k)
        };
        let along = usize::from(plan.x == "k");
        map.draw_curve(along, CURVE_STEPS, ("*k*_{c}(*v*_{f})", stroke), critical_stiffness);
    }
    Ok(map.figure)
}
