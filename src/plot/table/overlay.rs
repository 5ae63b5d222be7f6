//! Computed curves over maps, and marks on lines: durations and ceilings at which the optimum changes, the critical stiffness.

use super::groups::Groups;
use super::lines::{self, LineFigure};
use super::map::{self, MapFigure};
use super::{CEILINGS, TableScene};
use crate::model::{Law, Transition};
use crate::plot::canvas::Stroke;
use crate::plot::figure::{Entry, Key, Layer, Panel};
use crate::plot::{colour, label};
use crate::protocol::optimal::crossover::{self, Wanted};
use crate::protocol::optimal::{self, Bounds};
use crate::stability::SteadySliding;

/// Relative tolerance of a curve or mark. Chosen: finer than a picture shows.
const RTOL: f64 = 1e-6;

/// Greatest number of lines with marks. Chosen: more marks hide the curves.
const MAX_MARKED_LINES: usize = 3;

/// Curves over a map: along one axis, the values of the other.
struct Overlay {
    tables: &'static [&'static str],
    /// The colour column; any if empty.
    value: &'static str,
    along: &'static [&'static str],
    other: &'static str,
    curves: &'static [Curve],
    /// The column that is 0 on the curves; none if empty.
    is_zero_of: &'static str,
    /// Steps along a curve. Chosen: no corner is visible in print.
    steps: usize,
}

/// A curve: its column, words after the name of the column, width and dashes.
struct Curve(&'static str, &'static str, f64, &'static [f64]);

/// A point of a panel, on an axis.
struct MapPoint<'a> {
    /// The value of a quantity there, in scaled units.
    value: &'a dyn Fn(&str) -> Option<f64>,
    /// Whether `v >= 1`.
    bounded: bool,
}

const DASHES: &[f64] = &[3.0, 1.6];

/// Durations at which the optimal strategy changes.
const TIMES: [&str; 5] = ["t_cheapest", "t_cross", "t_floor", "t_min", "t_turn"];

const OVERLAYS: [Overlay; 5] = [
    Overlay {
        tables: &["stability", "step_response"],
        value: "",
        along: &["v_f", "m", "b", "a"],
        other: "k",
        curves: &[Curve("k_c_f", "", 1.0, &[4.0, 2.0])],
        is_zero_of: "growth_rate",
        steps: 400,
    },
    Overlay {
        tables: &["optimal"],
        value: "strategy",
        along: &["a", "b", "v_i", "v_f"],
        other: "t_f",
        curves: &[Curve("t_cross", "", 0.9, &[]), Curve("t_floor", "", 0.9, DASHES)],
        is_zero_of: "",
        steps: 120,
    },
    Overlay {
        tables: &["optimal"],
        value: "binding",
        along: &["t_f"],
        other: "v_ceiling",
        curves: &[Curve("v_ceiling_least", "", 0.9, DASHES), Curve("v_max", " without ceiling", 0.9, &[])],
        is_zero_of: "",
        steps: 120,
    },
    Overlay {
        tables: &["optimal"],
        value: "binding",
        along: &["t_f"],
        other: "tau_ceiling",
        curves: &[Curve("tau_ceiling_least", "", 0.9, DASHES), Curve("friction_max", " without ceiling", 0.9, &[])],
        is_zero_of: "",
        steps: 120,
    },
    // From steady sliding at `v = 1/theta`: where the velocity is `1/theta` now, where it reaches the floor, and the least time.
    Overlay {
        tables: &["feedback"],
        value: "",
        along: &["theta"],
        other: "t_left",
        curves: &[
            Curve("t_cross", "", 0.9, &[]),
            Curve("t_floor", "", 0.9, DASHES),
            Curve("t_min", "", 0.9, &[1.0, 1.5]),
        ],
        is_zero_of: "",
        steps: 240,
    },
];

/// Draws the curves that belong on a map, and the lines on which its column is 0 if none of the curves is such a line. A curve that leaves a panel
/// everywhere is not drawn there.
pub fn curves(scene: &TableScene<'_>, plan: &map::MapColumns, map: &mut MapFigure) {
    let mut has_zero_line = false;
    let table = scene.filtered.table.as_str();
    let known = OVERLAYS.iter().filter(|overlay| overlay.tables.contains(&table) && scene.source.is_logarithmic);
    for overlay in known {
        let along = match [plan.x.as_str(), plan.y.as_str()] {
            [x, y] if overlay.along.contains(&x) && y == overlay.other => 0,
            [x, y] if overlay.along.contains(&y) && x == overlay.other => 1,
            _ => continue,
        };
        if ["", plan.value.as_str()].contains(&overlay.value) {
            overlay.draw(scene, map, (along, if along == 0 { &plan.x } else { &plan.y }), &plan.value);
            has_zero_line |= overlay.is_zero_of == plan.value;
        }
    }
    if !has_zero_line {
        map.zero_line(&plan.value);
    }
}

impl Overlay {
    /// Whether the curves are those of the ageing law alone: durations and ceilings of its optimum.
    fn is_of_ageing(&self) -> bool {
        self.tables.contains(&"optimal")
    }

    fn draw(&self, scene: &TableScene<'_>, map: &mut MapFigure, (along, axis): (usize, &str), value: &str) {
        let mut is_drawn = vec![false; self.curves.len()];
        let (unit, unit_of_other) = (scene.size(axis), scene.size(self.other));
        for (group, panel) in map.figure.panels.iter_mut().enumerate() {
            if self.is_of_ageing() && scene.word(&map.groups, group, "law").is_some_and(|law| law != "ageing") {
                continue;
            }
            let mut points = vec![Vec::with_capacity(self.steps + 1); self.curves.len()];
            for step in 0..=self.steps {
                let at = map.cells[along].scale.value(step as f64 / self.steps as f64);
                let value =
                    |name: &str| if name == axis { Some(at / unit) } else { scene.scaled(&map.groups, group, name) };
                let point = MapPoint { value: &value, bounded: scene.source.bounded };
                for (curve, points) in self.curves.iter().zip(&mut points) {
                    points.push((at, point.find(curve.0).map_or(f64::NAN, |found| found * unit_of_other)));
                }
            }
            let scale = if along == 0 { panel.y.scale } else { panel.x.scale };
            for ((curve, mut points), is_drawn) in self.curves.iter().zip(points).zip(&mut is_drawn) {
                if points.iter().any(|(_, value)| (0.0..=1.0).contains(&scale.fraction(*value))) {
                    *is_drawn = true;
                    if along == 1 {
                        points.iter_mut().for_each(|(x, y)| std::mem::swap(x, y));
                    }
                    panel.layers.push(Layer::Contour(vec![points], curve.stroke()));
                }
            }
        }
        let has_ceilings = |name: &str| scene.filtered.axis(name).is_some_and(|axis| !axis.values.is_empty());
        let is_free = !CEILINGS.contains(&self.other) && CEILINGS.into_iter().any(has_ceilings);
        for (curve, _) in self.curves.iter().zip(is_drawn).filter(|(_, is_drawn)| *is_drawn) {
            let condition = if is_free { " without ceilings" } else { curve.1 };
            let zero = if self.is_zero_of == value { format!(": {} = 0", label::name(value)) } else { String::new() };
            let text = format!("{}{condition}{zero}", label::name(curve.0));
            map.figure.legend.push(Entry { key: Key::Contour(curve.stroke()), text });
        }
    }
}

impl Curve {
    fn stroke(&self) -> Stroke {
        Stroke { dashes: self.3, ..Stroke::solid("#000", self.2) }
    }
}

impl MapPoint<'_> {
    fn law(&self) -> Option<Law> {
        Some(Law { a: (self.value)("a")?, b: (self.value)("b")? })
    }

    /// The transition; from a state, that from steady sliding with its contact lifetime.
    fn transition(&self) -> Option<Transition> {
        let v_i = (self.value)("v_i").or_else(|| Some(1.0 / (self.value)("theta")?))?;
        Some(Transition { law: self.law()?, v_i, v_f: (self.value)("v_f")? })
    }

    /// The value of a curve or mark, in scaled units.
    fn find(&self, name: &str) -> Option<f64> {
        if name == "k_c_f" {
            let sliding = SteadySliding::new(self.law()?, 1.0, (self.value)("m")?, (self.value)("v_f")?);
            return Some(sliding.critical_stiffness());
        }
        let transition = self.transition()?;
        if name.starts_with("t_") { self.time(&transition, name) } else { self.ceiling(&transition, name) }
    }

    /// A duration at which the strategy changes without ceilings.
    fn time(&self, transition: &Transition, name: &str) -> Option<f64> {
        let [cheapest, cross, floor, min, turn] = TIMES.map(|time| time == name);
        let wanted = Wanted { cross, floor, cheapest, min, turn, free: false };
        let times = crossover::solve(transition, self.bounded, RTOL, wanted).1;
        let wanted = times.t_cheapest.or(times.t_cross).or(times.t_floor).or(times.t_min).or(times.t_turn);
        wanted.filter(|_| transition.v_i != transition.v_f)
    }

    /// The least feasible value of a ceiling, or the greatest value of the optimum without this ceiling.
    fn ceiling(&self, transition: &Transition, name: &str) -> Option<f64> {
        let t_f = (self.value)("t_f")?;
        let is_of_v = name.starts_with('v');
        // A ceiling without a finite value is none.
        let other = |ceiling: &str, is_own: bool| (self.value)(ceiling).filter(|_| !is_own).unwrap_or(f64::INFINITY);
        let [v_ceiling, tau_ceiling] = [other(CEILINGS[0], is_of_v), other(CEILINGS[1], !is_of_v)];
        let bounds = Bounds { floor: self.bounded, v_ceiling, tau_ceiling };
        match name {
            "v_ceiling_least" => optimal::least_v_ceiling(transition, t_f, bounds, RTOL),
            "tau_ceiling_least" => optimal::least_tau_ceiling(transition, t_f, bounds, RTOL),
            _ => {
                let free = optimal::solve(transition, t_f, bounds, RTOL).value?;
                // The velocity has its greatest value at an end, or just below on a friction ceiling.
                Some(if is_of_v { free.v_start.max(free.v_end) } else { free.friction_max })
            }
        }
    }
}

/// Marks the durations, or the ceilings, at which the optimum of a line changes.
pub fn marks(scene: &TableScene<'_>, plan: &lines::LineColumns, lined: &mut LineFigure) {
    let count = lined.groups.shown.len();
    if scene.filtered.table != "optimal" || count > MAX_MARKED_LINES || !scene.source.is_logarithmic {
        return;
    }
    // Of coinciding lines, one is drawn.
    for group in (0..count).filter(|&group| lined.leaders[group] == group) {
        let colour = if count == 1 { "#555" } else { colour::series(group).colour };
        let stroke = Stroke { colour, width: 0.5, dashes: &[2.0, 1.5] };
        for (name, place) in marks_of(scene, &lined.groups, group, &plan.x) {
            let Some(at) = place.map(|place| place * scene.size(&plan.x)) else { continue };
            let is_inside = |panel: &Panel| (panel.x.scale.low..=panel.x.scale.high).contains(&at);
            let panels = lined.figure.panels.iter_mut().filter(|panel| is_inside(panel));
            for (place, panel) in panels.enumerate() {
                // The first panel labels the marks.
                let words = if place == 0 { label::name(name) } else { String::new() };
                panel.layers.push(Layer::Vertical(at, words, stroke));
            }
        }
    }
}

/// The marks of a group along `axis`, in scaled units.
fn marks_of(scene: &TableScene<'_>, groups: &Groups, group: usize, axis: &str) -> Vec<(&'static str, Option<f64>)> {
    if scene.word(groups, group, "law").is_some_and(|law| law != "ageing") {
        return Vec::new();
    }
    let value = |name: &str| scene.scaled(groups, group, name);
    let point = MapPoint { value: &value, bounded: scene.source.bounded };
    let is_capped = CEILINGS.iter().any(|name| scene.value(groups, group, name).is_some_and(f64::is_finite));
    let names: &[&str] = match axis {
        "v_ceiling" => &["v_ceiling_least", "v_max"],
        "tau_ceiling" => &["tau_ceiling_least", "friction_max"],
        "t_f" if !is_capped => &TIMES,
        _ => &[],
    };
    names.iter().map(|&name| (name, point.find(name))).collect()
}
