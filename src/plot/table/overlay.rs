//! Computed curves over maps, and marks on lines: durations and ceilings at which the optimum changes, the critical stiffness.

use super::groups::Groups;
use super::lines::{self, LineFigure};
use super::map::{self, MapFigure};
use super::{CEILINGS, TableScene};
use crate::model::{Law, Transition};
use crate::plot::canvas::Stroke;
use crate::plot::figure::{Entry, Key, Layer};
use crate::plot::{colour, label};
use crate::protocol::optimal::crossover::{self, CrossoverTimes, Wanted};
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
    /// The values of the curves at a point, in scaled units.
    of: fn(&MapPoint<'_>) -> Vec<Option<f64>>,
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

const OVERLAYS: [Overlay; 5] = [
    Overlay {
        tables: &["stability", "step_response"],
        value: "",
        along: &["v_f", "m", "b", "a"],
        other: "k",
        curves: &[Curve("k_c_f", "", 1.0, &[4.0, 2.0])],
        is_zero_of: "growth_rate",
        steps: 400,
        of: |point| vec![point.critical_stiffness()],
    },
    Overlay {
        tables: &["optimal"],
        value: "strategy",
        along: &["a", "b", "v_i", "v_f"],
        other: "t_f",
        curves: &[Curve("t_cross", "", 0.9, &[]), Curve("t_floor", "", 0.9, DASHES)],
        is_zero_of: "",
        steps: 120,
        of: |point| {
            let times = point.times(Wanted { cross: true, floor: true, ..NO_TIME });
            times.map_or(Vec::new(), |times| vec![times.t_cross, times.t_floor])
        },
    },
    Overlay {
        tables: &["optimal"],
        value: "binding",
        along: &["t_f"],
        other: "v_ceiling",
        curves: &[Curve("v_ceiling_least", "", 0.9, DASHES), Curve("v_max", " without ceiling", 0.9, &[])],
        is_zero_of: "",
        steps: 120,
        of: |point| point.ceilings("v_ceiling"),
    },
    Overlay {
        tables: &["optimal"],
        value: "binding",
        along: &["t_f"],
        other: "tau_ceiling",
        curves: &[Curve("tau_ceiling_least", "", 0.9, DASHES), Curve("friction_max", " without ceiling", 0.9, &[])],
        is_zero_of: "",
        steps: 120,
        of: |point| point.ceilings("tau_ceiling"),
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
        of: |point| {
            let times = point.times(Wanted { cross: true, floor: true, min: true, ..NO_TIME });
            times.map_or(Vec::new(), |times| vec![times.t_cross, times.t_floor, times.t_min])
        },
    },
];

/// No duration.
const NO_TIME: Wanted = Wanted { cross: false, floor: false, cheapest: false, min: false, turn: false, free: false };

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
                let found = (self.of)(&MapPoint { value: &value, bounded: scene.source.bounded });
                for (curve, points) in points.iter_mut().enumerate() {
                    let found = found.get(curve).copied().flatten();
                    points.push((at, found.map_or(f64::NAN, |found| found * unit_of_other)));
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

    fn critical_stiffness(&self) -> Option<f64> {
        let sliding = SteadySliding::new(self.law()?, 1.0, (self.value)("m")?, (self.value)("v_f")?);
        Some(sliding.critical_stiffness())
    }

    /// The durations at which the strategy changes without ceilings.
    fn times(&self, wanted: Wanted) -> Option<CrossoverTimes> {
        let transition = self.transition()?;
        let Transition { law: Law { a, b }, v_i, v_f } = transition;
        let is_legal = a > 0.0 && b >= 0.0 && v_i > 1.0 && v_f > 1.0 && v_i != v_f;
        is_legal.then(|| crossover::solve(&transition, self.bounded, RTOL, wanted).1)
    }

    /// The least feasible value of the ceiling `axis`, and the greatest value of the optimum without it.
    fn ceilings(&self, axis: &str) -> Vec<Option<f64>> {
        let (Some(transition), Some(t_f)) = (self.transition(), (self.value)("t_f")) else { return Vec::new() };
        // A ceiling without a finite value is none.
        let [v_ceiling, tau_ceiling] =
            CEILINGS.map(|name| (self.value)(name).filter(|_| name != axis).unwrap_or(f64::INFINITY));
        let bounds = Bounds { floor: self.bounded, v_ceiling, tau_ceiling };
        let free = optimal::solve(&transition, t_f, bounds, RTOL).value;
        if axis == CEILINGS[0] {
            // The velocity has its greatest value at an end, or just below on a friction ceiling.
            let greatest = free.map(|free| free.v_start.max(free.v_end));
            vec![optimal::least_v_ceiling(&transition, t_f, bounds, RTOL), greatest]
        } else {
            vec![optimal::least_tau_ceiling(&transition, t_f, bounds, RTOL), free.map(|free| free.friction_max)]
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
            let place = place.map(|place| place * scene.size(&plan.x));
            let Some(at) = place.filter(|at| (lined.x.low..=lined.x.high).contains(at)) else { continue };
            for (place, panel) in lined.figure.panels.iter_mut().enumerate() {
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
    if CEILINGS.contains(&axis) {
        let names: [&str; 2] =
            if axis == CEILINGS[0] { ["v_ceiling_least", "v_max"] } else { ["tau_ceiling_least", "friction_max"] };
        return names.into_iter().zip(point.ceilings(axis)).collect();
    }
    let is_capped = CEILINGS.iter().any(|name| scene.value(groups, group, name).is_some_and(f64::is_finite));
    if axis != "t_f" || is_capped {
        return Vec::new();
    }
    let all = Wanted { cross: true, floor: true, cheapest: true, min: true, turn: true, free: false };
    point.times(all).map_or(Vec::new(), |times| {
        vec![
            ("t_cheapest", times.t_cheapest),
            ("t_cross", times.t_cross),
            ("t_floor", times.t_floor),
            ("t_min", times.t_min),
            ("t_turn", times.t_turn),
        ]
    })
}
