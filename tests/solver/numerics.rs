//! The numerical tools against 40-digit tables.

use crate::reference;
use slipsweep::numerics::cubic::ExactCubic;
use slipsweep::numerics::dilogarithm::dilogarithm;
use slipsweep::numerics::double_double::DoubleDouble;
use slipsweep::numerics::elementary::{exp, exp_and_m1, exp_m1, ln, ln_1p};
use slipsweep::numerics::gauss::rule;
use slipsweep::numerics::lanes::LANES;
use slipsweep::numerics::root::{Probe, newton};
use slipsweep::numerics::turning::{turning, turning_lanes};

/// Distance in units in the last place of the expected number.
fn ulps(found: f64, expected: f64) -> f64 {
    let spacing = f64::from_bits(expected.abs().to_bits() + 1) - expected.abs();
    if found == expected { 0.0 } else { (found - expected).abs() / spacing }
}

fn worst(errors: impl IntoIterator<Item = f64>) -> f64 {
    errors.into_iter().fold(0.0, f64::max)
}

#[test]
fn reference_elementary_functions() {
    let rows = reference::table("elementary");
    let error = |column: &str, f: fn(f64) -> f64| {
        worst(rows.iter().filter_map(|row| Some(ulps(f(row.number("x")), row.optional(column)?))))
    };
    assert!(rows.len() > 250);
    for (column, f, budget) in
        [("ln", ln as fn(f64) -> f64, 1.0), ("ln_1p", ln_1p, 1.0), ("exp", exp, 1.0), ("exp_m1", exp_m1, 2.0)]
    {
        let error = error(column, f);
        assert!(error <= budget, "{column}: {error} ulp");
    }
}

#[test]
fn elementary_functions_stay_within_an_ulp_of_the_libm_crate() {
    let mut x = 1e-3f64;
    while x < 700.0 {
        assert!(ulps(ln(x), libm::log(x)) <= 1.0, "ln {x}");
        assert!(
            ulps(ln_1p(x), libm::log1p(x)) <= 1.0 && ulps(ln_1p(-x / 701.0), libm::log1p(-x / 701.0)) <= 1.0,
            "ln_1p {x}"
        );
        assert!(ulps(exp(x), libm::exp(x)) <= 1.0 && ulps(exp(-x), libm::exp(-x)) <= 1.0, "exp {x}");
        assert!(ulps(exp_m1(x), libm::expm1(x)) <= 2.0 && ulps(exp_m1(-x), libm::expm1(-x)) <= 2.0, "exp_m1 {x}");
        for x in [x, -x] {
            assert!(ulps(exp_and_m1(x).1, libm::expm1(x)) <= 2.0, "exp_and_m1 {x}");
        }
        x *= 1.000_71;
    }
    assert_eq!((exp(-800.0), exp(800.0), exp_m1(800.0), exp_m1(-800.0)), (0.0, f64::INFINITY, f64::INFINITY, -1.0));
}

#[test]
fn reference_turning_function_is_good_to_a_few_ulp_over_the_whole_line() {
    let rows = reference::table("turning");
    assert!(rows.len() >= 300);
    let mut lanes = [0.0; LANES];
    for (i, row) in rows.iter().enumerate() {
        let (w, expected) = (row.number("w"), row.number("ln_u"));
        let found = turning(w);
        assert!(ulps(found.ln_u, expected) <= 4.0, "ln U({w}) = {} against {expected}", found.ln_u);
        // (U - 1)/w = (z + w^2/2)/w, by an expression without cancellation where that one cancels.
        let slope =
            if w.abs() > 1e-3 { expected.exp_m1() / w } else { 1.0 + w / 3.0 + w * w / 36.0 - w * w * w / 270.0 };
        assert!(
            (found.slope - slope).abs() <= 8.0 * f64::EPSILON * slope,
            "slope at {w}: {} against {slope}",
            found.slope
        );
        // Eight at once have the bits of one by one, whatever their neighbours are.
        lanes[i % LANES] = w;
        let side_by_side = turning_lanes(&lanes);
        let i = i % LANES;
        let slope = side_by_side.over[i] / side_by_side.under[i];
        assert_eq!(
            [side_by_side.ln_u[i].to_bits(), side_by_side.excess[i].to_bits(), slope.to_bits()],
            [found.ln_u.to_bits(), found.excess.to_bits(), found.slope.to_bits()]
        );
        assert_eq!(turning_lanes(&[w]).ln_u[0].to_bits(), found.ln_u.to_bits());
    }
}

#[test]
fn reference_gauss_rules_are_right_to_the_last_bit() {
    for row in reference::table("gauss") {
        let (n, i) = (row.number("n") as usize, row.number("i") as usize);
        assert_eq!((rule(n).x[i], rule(n).w[i]), (row.number("x"), row.number("weight")), "{row:?}");
        assert_eq!(rule(n).x[n - 1 - i], -rule(n).x[i]);
    }
}

#[test]
fn gauss_rules_integrate_polynomials_exactly() {
    for n in 1..60 {
        let power = 2 * n - 2;
        let sum: f64 = rule(n).x.iter().zip(&rule(n).w).map(|(x, w)| w * x.powi(power as i32)).sum();
        assert!((sum * (power + 1) as f64 / 2.0 - 1.0).abs() < 1e-14 * n as f64, "{n}");
    }
}

#[test]
fn dilogarithm_obeys_its_identities() {
    let pi2 = std::f64::consts::PI * std::f64::consts::PI;
    assert!(ulps(dilogarithm(1.0), pi2 / 6.0) <= 1.0);
    let half = pi2 / 12.0 - 0.5 * 2f64.ln() * 2f64.ln();
    assert!(ulps(dilogarithm(0.5), half) <= 4.0);
    for i in 1..1000 {
        let x = f64::from(i) / 1000.0;
        // The series, where it converges fast; Landen's form of the square relation elsewhere would need negative
        // arguments.
        let series: f64 = (1..4000).rev().map(|k| x.powi(k) / (f64::from(k) * f64::from(k))).sum();
        if x < 0.98 {
            assert!((dilogarithm(x) - series).abs() < 1e-14 * series, "{x}");
        }
        let reflected = pi2 / 6.0 - x.ln() * (-x).ln_1p() - dilogarithm(1.0 - x);
        assert!((dilogarithm(x) - reflected).abs() < 1e-14, "{x}");
    }
}

#[test]
fn the_root_finder_always_ends() {
    let count = |f: &dyn Fn(f64) -> Option<Probe>, start: f64, bracket: (f64, f64)| {
        let mut probes = 0;
        let root = newton(
            |x| {
                probes += 1;
                f(x)
            },
            start,
            bracket,
            true,
            1e-10,
        );
        (root.map(|root| root.x), probes)
    };
    let cubic = |x: f64| Some(Probe { value: x * x * x - 2.0, slope: 3.0 * x * x });
    let (root, probes) = count(&cubic, 1.0, (f64::NEG_INFINITY, f64::INFINITY));
    assert!(ulps(root.expect("has a root"), 2f64.cbrt()) <= 1.0 && probes <= 7, "{root:?} {probes}");
    // Far below the root every step is longer than the one before: a leap to 1 would be far beyond it.
    let logarithm = |x: f64| Some(Probe { value: (x / 1e-6).ln(), slope: 1.0 / x });
    let (root, probes) = count(&logarithm, 1e-9, (0.0, f64::INFINITY));
    assert!(ulps(root.expect("has a root"), 1e-6) <= 1.0 && probes <= 10, "{root:?} {probes}");
    // Wrong slopes, a jump through zero, a function without a root, one that is nowhere defined, one that is NaN.
    let wrong = |x: f64| Some(Probe { value: x - 0.3, slope: 1e-9 });
    assert!((count(&wrong, 5.0, (0.0, 10.0)).0.expect("bisects") - 0.3).abs() < 1e-9);
    let jump = |x: f64| Some(Probe { value: if x < 0.7 { -1.0 } else { 1.0 }, slope: 0.0 });
    assert!((count(&jump, 0.0, (-1.0, 1.0)).0.expect("closes in") - 0.7).abs() < 1e-15);
    let none = |x: f64| Some(Probe { value: 1.0 + x * x, slope: 2.0 * x });
    assert_eq!(count(&none, 0.5, (0.0, 1.0)).0, None);
    assert_eq!(count(&|_| None, 0.5, (0.0, 1.0)).0, None);
    let nan = |_| Some(Probe { value: f64::NAN, slope: 1.0 });
    assert_eq!(count(&nan, 0.5, (f64::NEG_INFINITY, f64::INFINITY)).0, None);
}

/// Cubics multiplied out from their zeros, a real one and a pair, in 32 digits: the zeros come back with all their digits,
/// their distances from 1 and from the real axis too, however close they are to each other, to the ends or to infinity.
#[test]
fn exact_zeros_are_those_that_a_cubic_is_made_of() {
    let dd = DoubleDouble::new;
    for lone in [-4e-8, -1.15, 3.0, -1e12, 1.0 + 1e-12] {
        // The middle of the pair, and half its distance: of conjugates, or of two real zeros.
        for (middle, half, real) in [
            (0.0103, 1e-9, false),
            (0.577, 7.8e-6, false),
            (0.577, 7.8e-6, true),
            (5e-9, 1e-9, false),
            (1.5, 0.25, true),
            (-20.0, 3.0, false),
        ] {
            let square = DoubleDouble::product(half, half);
            let product = DoubleDouble::product(middle, middle) + if real { -square } else { square };
            let sum = dd(2.0 * middle);
            // (x - lone)(x^2 - sum x + product), with the sign that makes it positive at 0.
            let lone_dd = dd(lone);
            let c = [-lone_dd * product, product + lone_dd * sum, -sum - lone_dd, dd(1.0)];
            let c = if c[0].high > 0.0 { c } else { c.map(|c| -c) };
            let mut found = ExactCubic { c }.zeros().map(|(re, im)| ((re - dd(1.0)).high, im));
            let (shift, im) = if real { (half, 0.0) } else { (0.0, half) };
            let place = |x: f64, shift: f64| ((dd(x) + dd(shift) - dd(1.0)).high, im);
            let mut expected = [((lone_dd - dd(1.0)).high, 0.0), place(middle, -shift), place(middle, shift)];
            let order = |a: &(f64, f64), b: &(f64, f64)| (a.0, a.1).partial_cmp(&(b.0, b.1)).expect("are numbers");
            found.sort_by(order);
            expected.sort_by(order);
            for (found, expected) in found.iter().zip(&expected) {
                let near = |x: f64, y: f64| (x - y).abs() <= 1e-12 * y.abs();
                assert!(
                    near(found.0, expected.0) && near(found.1, expected.1),
                    "{found:?} {expected:?}: {lone} {middle}"
                );
            }
        }
    }
}
