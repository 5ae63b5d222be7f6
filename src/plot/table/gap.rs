//! The landscape of the work gap, with the line `v_min = 1` and the best shortcut.

use super::cells::AxisCells;
use super::filtered::FilteredTable;
use super::groups::Groups;
use super::map::{self, MapFigure};
use super::{Source, TableScene};
use crate::model::Units;
use crate::numerics::cubic::Cubic;
use crate::plot::PlotError;
use crate::plot::canvas::Stroke;
use crate::plot::contour::contour;
use crate::plot::figure::{Entry, Key, Layer};

/// The axes of the landscape.
const ALPHAS: [&str; 2] = ["alpha_2", "alpha_3"];

/// Steps of the grid for the line `v = 1`, along both axes. Chosen: finer than the dots of a printer.
const STEPS: usize = 300;

/// Lines through points.
type Lines = Vec<Vec<(f64, f64)>>;

/// Adds the border and the best shortcut to a map of the landscape.
pub fn border(scene: &TableScene<'_>, plan: &map::MapColumns, map: &mut MapFigure) -> Result<(), PlotError> {
    if scene.filtered.table != "gap" || plan.x != ALPHAS[0] || plan.y != ALPHAS[1] {
        return Ok(());
    }
    let MapFigure { figure, groups, least, cells, .. } = map;
    let stroke = Stroke::solid("#000", 0.9);
    let best = best(scene, groups)?;
    let from_table = best.iter().any(Option::is_some);
    let (mut any_line, mut any_zero, mut any_star) = (false, false, false);
    for (place, panel) in figure.panels.iter_mut().enumerate() {
        if let Some((lines, meets_zero)) = border_of(scene, groups, place, cells) {
            any_line |= !lines.is_empty();
            any_zero |= meets_zero;
            panel.layers.push(Layer::Contour(lines, stroke));
        }
        let star = if from_table { best[place] } else { least[place] };
        any_star |= star.is_some();
        panel.layers.extend(star.map(Layer::Star));
    }
    if any_line {
        let floor = if scene.source.units == Units::Scaled { "1" } else { "*v*_{0}" };
        let zero = if any_zero { " or *θ* = 0" } else { "" };
        figure.legend.push(Entry { key: Key::Contour(stroke), text: format!("*v*_{{min}} = {floor}{zero}") });
    }
    if any_star {
        let text = if from_table { "best shortcut" } else { "least gap of the grid" };
        figure.legend.push(Entry { key: Key::Star, text: text.to_owned() });
    }
    Ok(())
}

/// The border of the shortcuts with `v >= 1`, and whether `theta` becomes 0 on a piece of it, as it does far from the optimum. The border of
/// feasibility is often closer than a cell, so the line is computed from the cubic: for `theta > 0`, `v >= 1` means `1 - theta' - theta >= 0`.
fn border_of(scene: &TableScene<'_>, groups: &Groups, panel: usize, cells: &[AxisCells; 2]) -> Option<(Lines, bool)> {
    let value = |name| scene.scaled(groups, panel, name);
    let (t_f, start, end) = (value("t_f")?, 1.0 / value("v_i")?, 1.0 / value("v_f")?);
    // Coefficients relative to `t_f` do not depend on it.
    let unit = |alpha: &str, power: f64| if scene.filtered.unit(alpha).contains("t_f") { 1.0 } else { power };
    let rate = scene.source.units.size("v_0/l");
    let (unit_2, unit_3) = (unit(ALPHAS[0], t_f), unit(ALPHAS[1], t_f * t_f / rate));
    let at = |cells: &AxisCells, step: usize| cells.scale.value(step as f64 / STEPS as f64);
    let mut margin = Vec::with_capacity((STEPS + 1) * (STEPS + 1));
    let mut is_zero = Vec::with_capacity((STEPS + 1) * (STEPS + 1));
    for row in 0..=STEPS {
        let a_3 = at(&cells[1], row) * unit_3;
        for column in 0..=STEPS {
            let a_2 = at(&cells[0], column) * unit_2;
            let a_4 = end - start - a_2 - a_3;
            let theta = Cubic { c: [start, a_2, a_3, a_4] };
            let slope = [a_2, 2.0 * a_3, 3.0 * a_4, 0.0];
            let excess =
                Cubic { c: std::array::from_fn(|i| if i == 0 { t_f } else { 0.0 } - slope[i] - t_f * theta.c[i]) };
            let (theta, excess) = (theta.least(), excess.least());
            // Both terms in units of the order of 1.
            margin.push((excess / t_f).min(theta / start.min(end)));
            is_zero.push(theta <= 0.0 && excess >= 0.0);
        }
    }
    let lines = contour(&margin, STEPS + 1);
    let place = |(x, y): (f64, f64)| (cells[0].scale.value(x / STEPS as f64), cells[1].scale.value(y / STEPS as f64));
    let is_inside = |node: Option<usize>| node.and_then(|node| margin.get(node)).is_some_and(|margin| *margin > 0.0);
    let neighbours =
        |node: usize| [node.checked_sub(1), Some(node + 1), node.checked_sub(STEPS + 1), Some(node + STEPS + 1)];
    let meets_zero = (0..margin.len()).any(|node| is_zero[node] && neighbours(node).into_iter().any(is_inside));
    Some((lines.into_iter().map(|line| line.into_iter().map(place).collect()).collect(), meets_zero))
}

/// The best shortcut of each panel, from the table `best_cubic`, if the dataset has it.
fn best(scene: &TableScene<'_>, groups: &Groups) -> Result<Vec<Option<(f64, f64)>>, PlotError> {
    let mut found = vec![None; groups.shown.len()];
    let Source { folder, manifest, .. } = scene.source;
    if manifest.table("best_cubic").is_none() {
        return Ok(found);
    }
    let filtered = match FilteredTable::new(folder, manifest, "best_cubic", &[]) {
        Err(PlotError::Empty { .. }) => return Ok(found),
        filtered => filtered?,
    };
    if !ALPHAS.iter().all(|alpha| filtered.has(alpha)) {
        return Ok(found);
    }
    let axes: Vec<&str> = filtered.axes.iter().map(|axis| axis.name.as_str()).collect();
    let values: Vec<Option<Vec<f64>>> =
        (0..found.len()).map(|group| axes.iter().map(|axis| scene.value(groups, group, axis)).collect()).collect();
    let columns: Vec<&str> = axes.iter().copied().chain(ALPHAS).collect();
    filtered.each(&columns, |row| {
        for (values, star) in values.iter().zip(&mut found) {
            let (place, alphas) = row.split_at(axes.len());
            if values.as_deref() == Some(place) && alphas.iter().all(|alpha| alpha.is_finite()) {
                *star = Some((alphas[0], alphas[1]));
            }
        }
    })?;
    Ok(found)
}
