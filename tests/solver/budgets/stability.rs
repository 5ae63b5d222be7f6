//! `stability`: eigenvalues at 120 digits, closed forms in double-double arithmetic.

use slipsweep::numerics::double_double::DoubleDouble as Dd;

use super::Known;
use super::case::{Case, Route, Truth, Value};
use super::sweeps::Grid;
use crate::reference::{self, Row};

pub const KNOWN: Known = Known {
    table: "stability",
    grid: Grid::Points,
    regimes: &[
        ("b <= a", "no critical stiffness"),
        ("above k_c", "more than 1 % stiffer than critical at v_f"),
        ("below k_c", "more than 1 % softer than critical at v_f"),
        ("near k_c", "within 1 % of the critical stiffness at v_f, down to a relative 1e-13"),
        ("no mass", "m = 0"),
        ("rigid", "k = inf"),
        ("Hopf point", "the first Lyapunov coefficient from its definition"),
        ("Hopf point of slip and prz", "the same for the other laws of the state"),
        ("regularised friction", "eigenvalues at 120 digits and critical velocities with regularised friction"),
        ("interpolated law", "the same, and the borders of smooth optima, by differences"),
    ],
    cases,
};

/// The axes of the table, and of `step_response`.
pub const AXES: [&str; 6] = ["a", "b", "v_i", "v_f", "k", "m"];

/// The material, spring, mass and final velocity of a point.
#[derive(Debug, Clone, Copy)]
struct Sliding {
    a: f64,
    b: f64,
    k: f64,
    m: f64,
    v: f64,
}

fn dd(x: f64) -> Dd {
    Dd::new(x)
}

fn sqrt(x: Dd) -> Dd {
    let root = dd(x.high.sqrt());
    if x.high > 0.0 { root + (x - root * root) / (root + root) } else { dd(0.0) }
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for row in reference::table("stability") {
        let number = |name: &str| row.number(name);
        let sliding = Sliding { a: number("a"), b: number("b"), k: number("k"), m: number("m"), v: number("v") };
        let critical = critical(&sliding, sliding.v);
        let regime = match sliding.k / critical.high - 1.0 {
            _ if sliding.b <= sliding.a => "b <= a",
            beyond if beyond.abs() < 0.01 => "near k_c",
            beyond if beyond > 0.0 => "above k_c",
            _ => "below k_c",
        };
        cases.push(point(&sliding, regime).reference(&row, &["growth_rate", "frequency", "decay_rate"]));
        let massless = Sliding { m: 0.0, ..sliding };
        cases.push(massless_eigenvalues(point(&massless, "no mass"), &massless));
        let rigid = point(&Sliding { k: f64::INFINITY, ..sliding }, "rigid");
        cases.push(rigid.nulls(&["growth_rate", "frequency", "decay_rate"], Route::Formula));
    }
    cases.extend(reference::table("hopf").iter().map(|row| hopf(row, Case::of(row, &AXES).within("Hopf point"))));
    let mut cases: Vec<Case> = cases.into_iter().map(|case| with_law(case, "ageing")).collect();
    cases.extend(reference::table("hopf_laws").iter().map(|row| {
        let law = if row.text("law") == "slip" { "slip" } else { "prz" };
        hopf(row, with_law(Case::of(row, &AXES).within("Hopf point of slip and prz"), law))
    }));
    cases.extend(reference::table("arcsinh_stability").iter().map(|row| {
        let case = Case::at(
            ["a", "b", "v_i", "v", "k", "m"].map(|name| (if name == "v" { "v_f" } else { name }, row.number(name))),
        );
        let case = Case { friction: "regularised", ..case.within("regularised friction") };
        let numbers = ["k_od", "k_c_i", "k_c_f", "growth_rate", "decay_rate", "v_crit"];
        let size = row.number("frequency").max(row.number("growth_rate").abs());
        let case = case.reference(row, &numbers).scaled("frequency", row.number("frequency"), size, Route::Reference);
        case.word("status", "ok", Route::Reference)
    }));
    cases.extend(reference::table("interpolated").iter().map(|row| {
        let axes = ["law_eps", "a", "b", "v_i", "v_f", "k", "m"];
        let case = Case::of(row, &axes).within("interpolated law");
        hopf(row, case.reference(row, &["slip_fraction_smooth", "law_eps_smooth"]))
    }));
    cases
}

/// This case for a law of the state.
pub fn with_law(mut case: Case, law: &'static str) -> Case {
    case.axes.push(("law", Value::Word(law)));
    case
}

/// `(b - a)(1 + m v^2/a)`.
fn critical(sliding: &Sliding, v: f64) -> Dd {
    let &Sliding { a, b, m, .. } = sliding;
    Dd::sum(b, -a) * (dd(1.0) + Dd::product(v, v) * dd(m) / dd(a))
}

/// A point at `v_f = v` with what has a closed form.
fn point(sliding: &Sliding, regime: &'static str) -> Case {
    let &Sliding { a, b, k, m, v } = sliding;
    let v_i = 1.5 * v;
    let case = Case::at(AXES.into_iter().zip([a, b, v_i, v, k, m])).within(regime);
    let weakening = Dd::sum(b, -a);
    let spare = dd(k) - weakening;
    let v_crit = if weakening.high > 0.0 && m > 0.0 && k.is_finite() && spare.high > 0.0 {
        Some(sqrt(dd(a) * (spare / weakening) / dd(m)).high)
    } else {
        None
    };
    let stable = |v: f64| k.is_infinite() || (dd(k) - critical(sliding, v)).high > 0.0;
    case.number("k_od", weakening.high, Route::Formula)
        .number("k_c_i", critical(sliding, v_i).high, Route::Formula)
        .number("k_c_f", critical(sliding, v).high, Route::Formula)
        .knows("stable_i", Truth::Flag(stable(v_i)), Route::Formula)
        .knows("stable_f", Truth::Flag(stable(v)), Route::Formula)
        .maybe("v_crit", v_crit, Route::Formula)
        .word("status", "ok", Route::Formula)
}

/// The roots of `a x^2 + (k + a - b) x + k = 0`, times `v`.
fn massless_eigenvalues(case: Case, sliding: &Sliding) -> Case {
    let &Sliding { a, b, k, v, .. } = sliding;
    let half = (dd(k) - Dd::sum(b, -a)) / dd(2.0 * a);
    let square = half * half - dd(k) / dd(a);
    let (growth, frequency) = if square.high < 0.0 {
        (-half, sqrt(-square))
    } else {
        // Of the two, the greater; the product determines the smaller in size.
        let large = if half.high > 0.0 { -half - sqrt(square) } else { sqrt(square) - half };
        let small = dd(k) / dd(a) / large;
        (if large.high > small.high { large } else { small }, dd(0.0))
    };
    let case = case.number("growth_rate", (growth * dd(v)).high, Route::Formula);
    let case = case.number("frequency", (frequency * dd(v)).high, Route::Formula);
    case.nulls(&["decay_rate"], Route::Formula)
}

/// A row of the table of Lyapunov coefficients.
fn hopf(row: &Row, case: Case) -> Case {
    let case = case.reference(row, &["first_lyapunov_coefficient"]);
    match row.optional("first_lyapunov_coefficient") {
        Some(coefficient) if coefficient < 0.0 => case.word("hopf_type", "supercritical", Route::Reference),
        Some(_) => case.word("hopf_type", "subcritical", Route::Reference),
        None => case.nulls(&["hopf_type"], Route::Reference),
    }
}
