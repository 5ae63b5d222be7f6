//! `gap_min`, `gap_quantiles`, `gap_histogram`: every shortcut of a landscape by the judge.

use std::sync::OnceLock;

use slipsweep::model::{Law, Transition};

use super::Known;
use super::case::{Case, Route, Truth};
use super::optimal::{AXES, least_work};
use super::sweeps::Grid;
use crate::judge;

pub const MINIMUM: Known = known("gap_min", "min", || cases(minimum));
pub const QUANTILES: Known = known("gap_quantiles", "quantiles", || cases(quantiles));
pub const HISTOGRAM: Known = known("gap_histogram", "histogram", || cases(histogram));

/// Coefficients either way, and how far they go.
const ALPHAS: usize = 15;
const REACH: f64 = 0.37;

const fn known(table: &'static str, word: &'static str, cases: fn() -> Vec<Case>) -> Known {
    let regimes = &[("landscape", "the paper's landscapes, a deceleration's, and one without a shortcut")];
    Known { table, grid: Grid::Reduced { word, reach: REACH, alphas: ALPHAS }, regimes, cases }
}

/// A shortcut with status ok.
struct Shortcut {
    alphas: [f64; 2],
    work: f64,
    gap: f64,
    v_min: f64,
}

/// A landscape: where it is, its least work and its shortcuts.
struct Landscape {
    axes: [f64; 5],
    work_optimal: f64,
    shortcuts: Vec<Shortcut>,
    /// Whether some fall below `v = 1`.
    below: bool,
}

fn landscapes() -> &'static [Landscape] {
    static LANDSCAPES: OnceLock<Vec<Landscape>> = OnceLock::new();
    LANDSCAPES.get_or_init(|| {
        let law = Law { a: 0.03, b: 0.05 };
        let accelerate = |t_f| (t_f, Transition { law, v_i: 3.0, v_f: 100.0 });
        let decelerate = (0.9, Transition { law, v_i: 20.0, v_f: 2.0 });
        let nothing = (0.4, Transition { law, v_i: 100.0, v_f: 3.0 });
        [accelerate(0.02), accelerate(0.037), accelerate(0.049), decelerate, nothing].map(landscape).into()
    })
}

fn landscape((t_f, transition): (f64, Transition)) -> Landscape {
    let Transition { law, v_i, v_f } = transition;
    let work_optimal = least_work(&transition, t_f, true).expect("is judged");
    // As ranges are counted: values are exact to the last place, which the gap does not notice.
    let value = |i: usize| REACH * (2.0 * i as f64 / (ALPHAS - 1) as f64 - 1.0);
    let (mut shortcuts, mut below) = (Vec::new(), false);
    for alphas in (0..ALPHAS).flat_map(|i| (0..ALPHAS).map(move |j| [value(i), value(j)])) {
        let v_min = least_velocity(&transition, t_f, alphas);
        assert!((v_min - 1.0).abs() > 1e-9, "{alphas:?} is on the border");
        below |= v_min > 0.0 && v_min < 1.0;
        if v_min > 1.0 {
            let (work, _) = judge::shortcut_work(&transition, t_f, (alphas[0], alphas[1])).expect("is judged");
            shortcuts.push(Shortcut { alphas, work, gap: (work - work_optimal) / work_optimal, v_min });
        }
    }
    Landscape { axes: [t_f, law.a, law.b, v_i, v_f], work_optimal, shortcuts, below }
}

/// `v` from the definition at many places, and between the best of them by sections.
fn least_velocity(transition: &Transition, t_f: f64, [a_2, a_3]: [f64; 2]) -> f64 {
    let (start, end) = (1.0 / transition.v_i, 1.0 / transition.v_f);
    let a_4 = end - start - a_2 - a_3;
    let v = |x: f64| {
        let theta = start + x * (a_2 + x * (a_3 + x * a_4));
        let n = t_f - a_2 - x * (2.0 * a_3 + x * 3.0 * a_4);
        if theta > 0.0 { n / (t_f * theta) } else { f64::NEG_INFINITY }
    };
    let places = 2000;
    let place = |i: i32| f64::from(i) / f64::from(places);
    let best = (0..=places).min_by(|i, j| v(place(*i)).total_cmp(&v(place(*j)))).expect("there are places");
    let (mut low, mut high) = (place((best - 1).max(0)), place((best + 1).min(places)));
    for _ in 0..100 {
        let (first, second) = (low + 0.4 * (high - low), low + 0.6 * (high - low));
        if v(first) < v(second) { high = second } else { low = first }
    }
    v(0.5 * (low + high)).min(v(place(best)))
}

fn cases(of_reduction: fn(Case, &Landscape) -> Case) -> Vec<Case> {
    let case = |landscape: &Landscape| {
        let case = Case::at(AXES.into_iter().zip(landscape.axes)).within("landscape");
        let count = landscape.shortcuts.len();
        let status = match count {
            0 if landscape.below => "below_bound",
            0 => "infeasible",
            _ => "ok",
        };
        let case = case.knows("shortcuts", Truth::Exact(count as f64), Route::Judge);
        of_reduction(case.word("status", status, Route::Judge), landscape)
    };
    landscapes().iter().map(case).collect()
}

fn minimum(case: Case, landscape: &Landscape) -> Case {
    let columns = ["alpha_2", "alpha_3", "work", "work_optimal", "gap", "v_min"];
    let Some(best) = landscape.shortcuts.iter().min_by(|one, other| one.gap.total_cmp(&other.gap)) else {
        return case.nulls(&columns, Route::Judge);
    };
    let case = case.scaled("alpha_2", best.alphas[0], REACH, Route::Judge);
    let case = case.scaled("alpha_3", best.alphas[1], REACH, Route::Judge);
    let case = case.number("work", best.work, Route::Judge).number("v_min", best.v_min, Route::Formula);
    let case = case.number("work_optimal", landscape.work_optimal, Route::Judge);
    case.scaled("gap", best.gap, 1.0 + best.gap, Route::Judge)
}

fn quantiles(case: Case, landscape: &Landscape) -> Case {
    let mut gaps: Vec<f64> = landscape.shortcuts.iter().map(|shortcut| shortcut.gap).collect();
    gaps.sort_by(f64::total_cmp);
    let fractions =
        [("gap_min", 0), ("gap_q05", 5), ("gap_q25", 25), ("gap_q50", 50), ("gap_q75", 75), ("gap_q95", 95)];
    fractions.into_iter().chain([("gap_max", 100)]).fold(case, |case, (column, hundredths)| {
        // The least that at least so many do not exceed.
        let least = gaps.iter().enumerate().find(|(place, _)| 100 * (place + 1) >= hundredths * gaps.len());
        match least {
            Some((_, &gap)) => case.scaled(column, gap, 1.0 + gap, Route::Judge),
            None => case.knows(column, Truth::Null, Route::Judge),
        }
    })
}

fn histogram(case: Case, landscape: &Landscape) -> Case {
    let classes = [
        ("below_1e_8", f64::NEG_INFINITY, 1e-8),
        ("from_1e_8", 1e-8, 1e-7),
        ("from_1e_7", 1e-7, 1e-6),
        ("from_1e_6", 1e-6, 1e-5),
        ("from_1e_5", 1e-5, 1e-4),
        ("from_1e_4", 1e-4, 1e-3),
        ("from_1e_3", 1e-3, 1e-2),
        ("from_1e_2", 1e-2, 0.1),
        ("from_1e_1", 0.1, 1.0),
        ("from_1", 1.0, 10.0),
        ("from_10", 10.0, f64::INFINITY),
    ];
    classes.into_iter().fold(case, |case, (column, least, beyond)| {
        let within = |shortcut: &&Shortcut| least <= shortcut.gap && shortcut.gap < beyond;
        let count = landscape.shortcuts.iter().filter(within).count();
        case.knows(column, Truth::Exact(count as f64), Route::Judge)
    })
}
