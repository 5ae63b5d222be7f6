//! Families of shortcuts over their duration: a bound on friction tells only one of them apart.

use super::choice::Shape;
use super::{Scene, lines, plain};
use crate::plot::PlotError;
use crate::plot::figure::Figure;
use crate::protocol::swift::FAMILIES;

pub fn draw(scene: &Scene<'_>, shape: &Shape) -> Result<Figure, PlotError> {
    let Shape::Lines(plan) = shape else { return plain(scene, shape) };
    // The gap of a step that has not arrived is negative; those of the others span decades.
    let log = plan.y.iter().map(|column| (column == "gap").then_some(true)).collect();
    let plan = &lines::Plan { log, ..plan.clone() };
    let lined = lines::lines(scene.survey, plan, |axes, cells| {
        let place = |name| axes.iter().position(|axis| *axis == name);
        let (Some(family), Some(bound)) = (place("family"), place("tau_max")) else { return };
        let heeds = FAMILIES.get(cells[family] as usize).is_some_and(|family| family.heeds_tau_max());
        if !heeds {
            cells[bound] = f64::NAN;
        }
    })?;
    let mut figure = lined.figure;
    if lined.leaves_out {
        figure.notes.push("Gaps below zero, of steps that have not arrived, are not drawn.".to_owned());
    }
    Ok(figure)
}
