//! Landscapes under the slip law and that of Perrin, Rice and Zheng: a 40-digit table, and random points by dense sampling.

use slipsweep::model::{Law, StateLaw, Transition};
use slipsweep::protocol::Status;
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};

use crate::extent::quick_or_long;
use crate::reference;
use crate::support::Random;

fn one(landscape: &Landscape, a_2: f64, a_3: f64) -> (Status, f64, f64) {
    let (mut work, mut v_min, mut status) = ([f64::NAN], [f64::NAN], [Status::NotConverged]);
    let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
    landscape.evaluate(&[a_2], &[a_3], out);
    (status[0], work[0], v_min[0])
}

#[test]
fn reference_points_of_other_laws_are_good_to_rtol_up_to_the_border_of_feasibility() {
    let rows = reference::table("landscape_laws");
    for rtol in [1e-6, 1e-10, 1e-13] {
        for row in &rows {
            let state = StateLaw::find(row.text("law")).expect("is a law");
            let law = Law { a: row.number("a"), b: row.number("b") };
            let transition = Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") };
            let landscape = Landscape::under(state, &transition, row.number("t_f"), rtol);
            let (status, work, v_min) = one(&landscape, row.number("a_2"), row.number("a_3"));
            assert_eq!(status.name(), row.text("status"), "{row:?}");
            for (column, found) in [("work", work), ("v_min", v_min)] {
                let Some(expected) = row.optional(column) else { continue };
                let error = ((found - expected) / expected).abs();
                assert!(error <= rtol + 8.0 * f64::EPSILON, "{column} {found} off by {error:.1e} at {rtol} in {row:?}");
            }
        }
    }
}

/// `u >= 1/e` with `-u ln u = rate`, by Newton's method on its logarithm, and for the law of Perrin, Rice and Zheng in closed form.
fn product(state: StateLaw, rate: f64) -> f64 {
    if state == StateLaw::Prz {
        return (1.0 - 2.0 * rate).sqrt();
    }
    // -w e^w falls from w = -1 on.
    let (mut low, mut high) = (-1.0_f64, 700.0);
    for _ in 0..64 {
        let w = 0.5 * (low + high);
        if -w * w.exp() > rate { low = w } else { high = w }
    }
    (0.5 * (low + high)).exp()
}

/// Statuses, works and least velocities of random shortcuts agree with dense sampling: no dip of the velocity is missed, wherever it is.
#[test]
fn random_points_of_other_laws_agree_with_dense_sampling() {
    let mut random = Random(20);
    let (mut feasible, mut inside) = (0, 0);
    for _ in 0..quick_or_long(20_000, 40_000) {
        let state = [StateLaw::Slip, StateLaw::Prz][(2.0 * random.next()) as usize];
        let fastest = state.fastest_rise().high;
        let law = Law { a: random.between(1e-3, 0.3), b: random.between(1e-3, 0.3) };
        let greatest = [10.0, 1e3, 1e6][(3.0 * random.next()) as usize];
        let [v_i, v_f] = [(); 2].map(|()| random.between(1.01, greatest));
        let rise = 1.0 / v_f - 1.0 / v_i;
        let t_f = (rise / fastest).max(0.0) + random.between(1e-2, 1e3) / v_i.max(v_f);
        let size = (1.0 / v_i).max(1.0 / v_f) + fastest * t_f;
        let [a_2, a_3] = [(); 2].map(|()| size * (2.0 * random.next() - 1.0));
        let landscape = Landscape::under(state, &Transition { law, v_i, v_f }, t_f, 1e-10);
        let (status, work, v_min) = one(&landscape, a_2, a_3);
        let case = format!("{state:?} {law:?} v {v_i} {v_f} t_f {t_f} a {a_2} {a_3}: {status:?} {work} {v_min}");
        let theta = |x: f64| 1.0 / v_i + x * (a_2 + x * (a_3 + x * (rise - a_2 - a_3)));
        let rate = |x: f64| (a_2 + x * (2.0 * a_3 + 3.0 * x * (rise - a_2 - a_3))) / t_f;
        let slack = |x: f64| (theta(x) / size).min(1.0 - rate(x) / fastest);
        let places = || (0..=1000).map(|i| f64::from(i) / 1000.0);
        let least = places().map(slack).fold(f64::INFINITY, f64::min);
        if status == Status::Infeasible {
            assert!(least < 1e-4, "{case}: slack {least}");
            continue;
        }
        assert!(least > -1e-12, "{case}: slack {least}");
        feasible += 1;
        let v = |x: f64| product(state, rate(x).min(fastest)) / theta(x);
        let (place, sampled) = places().map(|x| (x, v(x))).min_by(|x, y| x.1.total_cmp(&y.1)).expect("has places");
        assert!(v_min <= sampled * (1.0 + 1e-9), "{case}: v = {sampled} at {place}");
        // Where nothing is narrow, the samples enclose the minimum.
        if least > 1e-2 && place > 0.0 && place < 1.0 {
            inside += 1;
            let (mut low, mut high) = (place - 1e-3, place + 1e-3);
            for _ in 0..80 {
                let thirds = [(2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0];
                (low, high) = if v(thirds[0]) < v(thirds[1]) { (low, thirds[1]) } else { (thirds[0], high) };
            }
            let searched = v(0.5 * (low + high));
            assert!((v_min / searched - 1.0).abs() <= 1e-10, "{case}: v = {searched} near {place}");
        }
        let friction = |x: f64| 1.0 + law.a * v(x).ln() + law.b * theta(x).ln();
        let lowest = places().map(friction).fold(f64::INFINITY, f64::min);
        if lowest < 0.0 {
            assert_eq!(status, Status::NegativeFriction, "{case}: {lowest}");
        } else {
            assert!(status == if v_min < 1.0 { Status::BelowBound } else { Status::Ok } || lowest < 1e-2, "{case}");
        }
        if least > 1e-2 {
            // Simpson's rule.
            let weight = |i: usize| if i == 0 || i == 1000 { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
            let slip = |f: &dyn Fn(f64) -> f64| -> f64 {
                t_f * places().enumerate().map(|(i, x)| weight(i) * f(x) * v(x)).sum::<f64>() / 3000.0
            };
            let (simpson, size) = (slip(&friction), slip(&|x| 1.0 + friction(x).abs()));
            assert!((work - simpson).abs() <= 1e-3 * size, "{case}: work {simpson}");
        }
    }
    assert!(feasible > 2_000 && inside > 100, "{feasible} {inside}");
}

#[test]
fn the_product_is_the_inverse_of_the_rate() {
    for state in [StateLaw::Slip, StateLaw::Prz] {
        for i in 0..2000 {
            let u = 0.4 * (f64::from(i) / 50.0).exp();
            let lack = 1.0 - state.rate(u) / state.fastest_rise().high;
            let error = (state.product(lack) / u - 1.0).abs();
            // Close to the fastest rise of the slip law the lack is a square.
            let condition = if state == StateLaw::Slip { (1.0 / (1.0 + u.ln())).max(1.0) } else { 1.0 };
            assert!(error < 1e-14 * condition, "{state:?} {u}: {error:e}");
        }
    }
}

/// The works of eight shortcuts are summed together, in memory that earlier calls have used: neither may show in the bits of one of them.
#[test]
fn regress_bits_do_not_depend_on_other_shortcuts() {
    let mut random = Random(4);
    let mut feasible = 0;
    for _ in 0..quick_or_long(400, 4_000) {
        let state = [StateLaw::Slip, StateLaw::Prz][(2.0 * random.next()) as usize];
        let law = Law { a: random.between(1e-3, 0.3), b: random.between(1e-3, 0.3) };
        let [v_i, v_f] = [(); 2].map(|()| random.between(1.01, 1e6));
        let rise = 1.0 / v_f - 1.0 / v_i;
        let t_f = (rise / state.fastest_rise().high).max(0.0) + random.between(1e-2, 1e3) / v_i.max(v_f);
        let size = (1.0 / v_i).max(1.0 / v_f) + t_f;
        let landscape = Landscape::under(state, &Transition { law, v_i, v_f }, t_f, 1e-10);
        let [a_2, a_3] = [(); 2].map(|()| [(); 40].map(|()| size * (2.0 * random.next() - 1.0)));
        let (mut work, mut v_min, mut status) = ([f64::NAN; 40], [f64::NAN; 40], [Status::NotConverged; 40]);
        let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
        landscape.evaluate(&a_2, &a_3, out);
        for i in (0..40).filter(|&i| status[i] != Status::Infeasible) {
            let alone = one(&landscape, a_2[i], a_3[i]);
            let case = format!("{state:?} {law:?} v {v_i} {v_f} t_f {t_f} a {} {}", a_2[i], a_3[i]);
            let bits = |(status, work, v_min): (Status, f64, f64)| (status, work.to_bits(), v_min.to_bits());
            assert_eq!(bits(alone), bits((status[i], work[i], v_min[i])), "{case}: {alone:?}");
            feasible += 1;
        }
    }
    assert!(feasible > 500, "{feasible}");
}

/// Within a unit in the last place of the border of what is feasible, a pair of zeros of `n` lies beyond the end at 3e-8 from the real axis. The quadrature
/// did not count the second images of the zeros of theta under its change of variable: 1.9e-8 at an `rtol` of 1e-10. The work is by mpmath at 30 digits.
#[test]
fn regress_both_images_of_a_zero_count() {
    let law = Law { a: 0.20703195247702713, b: 0.0 };
    let transition = Transition { law, v_i: 49678.90856484529, v_f: 19.534530498217947 };
    for power in 4..=13 {
        let rtol = 10f64.powi(-power);
        let landscape = Landscape::under(StateLaw::Slip, &transition, 0.1406066110241989, rtol);
        let (status, work, _) = one(&landscape, 0.05172628148859265, -8.830626068913141e-11);
        assert_eq!(status, Status::Ok);
        let error = (work / 17.905_680_286_822_04 - 1.0).abs();
        assert!(error <= rtol + 8.0 * f64::EPSILON, "{work} off by {error:.1e} at {rtol:e}");
    }
}
