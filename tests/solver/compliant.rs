//! The smooth shortcut at finite stiffness: against a high-precision table, simulations by a library's integrator,
//! finite perturbations, limits and orders; and the loop closed.

use crate::reference;
use crate::support::relative;
use nalgebra::Matrix3;
use ode_solvers::dop_shared::OutputType;
use ode_solvers::{Dop853, SVector, System};
use slipsweep::model::Law;
use slipsweep::protocol::compliant::{self, Compliant, CompliantPath};
use slipsweep::protocol::{SpringBlock, Status};
use slipsweep::stability::{OpenLoopResult, amplification, held_error, open_loop_error};

/// The paper's block and spring, and what is required of it: `(v_i, v_f)` and `t_f`.
const PAPER: (SpringBlock, (f64, f64), f64) =
    (SpringBlock { law: Law { a: 0.005, b: 0.01 }, k: 7.5e-3, m: 2.5e-16 }, (1e5, 3.2e6), 3.1e-6);

/// A slower one, of the material of the paper's rigid figures.
const SLOW: (SpringBlock, (f64, f64), f64) =
    (SpringBlock { law: Law { a: 0.03, b: 0.05 }, k: 0.5, m: 1e-6 }, (3.0, 100.0), 0.037);

fn solve((slider, velocities, t_f): (SpringBlock, (f64, f64), f64), rtol: f64) -> Compliant {
    let solved = compliant::solve(&slider, velocities, t_f, rtol);
    assert_eq!(solved.status, Status::Ok, "{slider:?} {velocities:?} {t_f}");
    solved.value.expect("has a member")
}

fn path((slider, velocities, t_f): (SpringBlock, (f64, f64), f64)) -> CompliantPath {
    compliant::path(&slider, velocities, t_f, 1e-12).expect("has a member")
}

fn amplified((slider, velocities, t_f): (SpringBlock, (f64, f64), f64), rtol: f64) -> OpenLoopResult {
    amplification(&slider, velocities, t_f, rtol)
}

fn held((slider, velocities, t_f): (SpringBlock, (f64, f64), f64), dt: f64, rtol: f64) -> OpenLoopResult {
    held_error(&slider, velocities, t_f, dt, rtol)
}

#[test]
fn reference_every_number_is_good_to_rtol() {
    let rows = reference::table("compliant");
    assert!(rows.len() >= 40, "{} rows", rows.len());
    for rtol in [1e-6, 1e-10, 1e-13] {
        for row in &rows {
            let slider = SpringBlock {
                law: Law { a: row.number("a"), b: row.number("b") },
                k: row.number("k"),
                m: row.number("m"),
            };
            let (v_i, v_f, t_f) = (row.number("v_i"), row.number("v_f"), row.number("t_f"));
            let found = solve((slider, (v_i, v_f), t_f), rtol);
            // t_min is known to a few eps of itself, so alpha near it is known to that fraction of t_f - t_min.
            let t_min = ((v_i - v_f) / (v_i * (v_f - 1.0))).ln_1p();
            let near = 3.0 * f64::EPSILON * t_min.abs() / (t_f - t_min);
            let allowed = rtol + 8.0 * f64::EPSILON;
            assert!(relative(found.alpha, row.number("alpha")) <= allowed + 3.0 * near, "{row:?}: {found:?}");
            assert!(relative(found.work, row.number("work")) <= allowed + near, "{row:?}: {found:?}");
            assert!(relative(found.v_min, row.number("v_min")) <= allowed + near, "{row:?}: {found:?}");
            assert!(relative(found.v_max, row.number("v_max")) <= allowed + near, "{row:?}: {found:?}");
            let (low, high) = (row.number("v_c_min"), row.number("v_c_max"));
            let size = low.abs().max(high.abs()) * (allowed + 3.0 * near);
            assert!((found.control_min - low).abs() <= size, "{row:?}: {found:?}");
            assert!((found.control_max - high).abs() <= size, "{row:?}: {found:?}");
            let grown = amplification(&slider, (v_i, v_f), t_f, rtol).number.expect("is solved");
            assert!(relative(grown, row.number("amplification")) <= allowed + 1e-12, "{row:?}: {grown}");
        }
    }
}

#[test]
fn paper_shortcut_stays_below_4_31e6_and_its_control_goes_negative() {
    let found = solve(PAPER, 1e-10);
    assert_eq!(found.v_min, 1e5);
    assert!((found.v_max / 4.31e6 - 1.0).abs() < 1e-3, "{found:?}");
    assert!(found.control_min < 0.0 && found.control_max < PAPER.1.1 * 1.02, "{found:?}");
}

#[test]
fn paper_larger_steps_of_the_control_leave_visible_oscillations() {
    let errors = [100.0, 30.0, 10.0, 4.0, 2.0].map(|n| held(PAPER, PAPER.2 / n, 1e-8).number.expect("is simulated"));
    assert!(errors.windows(2).all(|pair| pair[1] > 4.0 * pair[0]), "{errors:?}");
    assert!(errors[0] < 2e-3 && errors[2] > 0.1, "{errors:?}");
}

/// The equations of motion in `(ln v, ln theta, k s - 1)`, `ln theta` of the protocol itself, and
/// time over `t_f`, which the library does not determine exactly inside its steps.
#[derive(Clone, Copy)]
struct Sliding {
    slider: SpringBlock,
    velocities: (f64, f64),
    t_f: f64,
    alpha: f64,
    held: Option<f64>,
}

impl Sliding {
    fn new((slider, velocities, t_f): (SpringBlock, (f64, f64), f64)) -> Sliding {
        Sliding { slider, velocities, t_f, alpha: solve((slider, velocities, t_f), 1e-13).alpha, held: None }
    }

    /// `v_c` from the formula of the shortcut.
    fn reported(&self, x: f64, ln_theta: f64) -> f64 {
        let (w_i, w_f) = (self.velocities.0 - 1.0, self.velocities.1 - 1.0);
        let (l, z) = ((w_f / w_i).ln(), 1.0 - x);
        let y = x * z;
        let f = w_i.ln() + l * x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x) + self.alpha * y.powi(3);
        let f_1 = 30.0 * l * y * y + 3.0 * self.alpha * y * y * (z - x);
        let f_2 = 60.0 * l * y * (z - x) + self.alpha * (6.0 * y - 30.0 * y * y);
        let v = 1.0 + f.exp();
        let v_1 = f.exp() * f_1 / self.t_f;
        let v_2 = f.exp() * (f_2 + f_1 * f_1) / self.t_f.powi(2);
        let Law { a, b } = self.slider.law;
        v + (a * v_1 / v + b * ((-ln_theta).exp() - v) + self.slider.m * v_2) / self.slider.k
    }
}

impl System<f64, SVector<f64, 5>> for Sliding {
    fn system(&self, _: f64, y: &SVector<f64, 5>, dy: &mut SVector<f64, 5>) {
        let SpringBlock { law, k, m } = self.slider;
        let x = y[4];
        let (w_i, w_f, z) = (self.velocities.0 - 1.0, self.velocities.1 - 1.0, 1.0 - x);
        let v = y[0].exp();
        let exponent = (w_f / w_i).ln() * x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x);
        let protocol = 1.0 + w_i * (exponent + self.alpha * (x * z).powi(3)).exp();
        dy[0] = self.t_f * (y[2] - law.a * y[0] - law.b * y[1]) / (m * v);
        dy[1] = self.t_f * ((-y[1]).exp() - v);
        dy[2] = self.t_f * k * (self.held.unwrap_or_else(|| self.reported(x, y[3])) - v);
        dy[3] = self.t_f * ((-y[3]).exp() - protocol);
        dy[4] = 1.0;
    }
}

/// A library's integration from `t` to `t_end`, in units of `t_f`.
fn integrate(sliding: Sliding, (t, t_end): (f64, f64), start: SVector<f64, 5>) -> SVector<f64, 5> {
    let h = t_end - t;
    // Tolerances, then the library's defaults but for the test for stiffness.
    let mut stepper = Dop853::from_param(
        sliding,
        t,
        t_end,
        h,
        start,
        1e-13,
        1e-13,
        0.9,
        0.0,
        0.333,
        6.0,
        h,
        0.0,
        100_000,
        u32::MAX,
        OutputType::Sparse,
    );
    stepper.integrate().expect("is integrated");
    *stepper.y_out().last().expect("has an end")
}

fn steady(slider: &SpringBlock, v: f64) -> SVector<f64, 5> {
    SVector::<f64, 5>::new(v.ln(), -v.ln(), (slider.law.a - slider.law.b) * v.ln(), -v.ln(), 0.0)
}

/// The difference of two states in `(ln v, ln theta, k s/a)`.
fn scaled(slider: &SpringBlock, difference: SVector<f64, 5>) -> [f64; 3] {
    [difference[0], difference[1], difference[2] / slider.law.a]
}

#[test]
fn reference_the_control_brings_the_block_to_its_target_when_a_library_integrates() {
    for case in [PAPER, SLOW] {
        let end = integrate(Sliding::new(case), (0.0, 1.0), steady(&case.0, case.1.0));
        let missed = scaled(&case.0, end - steady(&case.0, case.1.1));
        assert!((end[3] + case.1.1.ln()).abs() < 1e-11, "{end}");
        let grown = amplified(case, 1e-10).number.expect("is solved");
        assert!(missed.iter().all(|x| x.abs() < 1e-10 * (1.0 + grown)), "{missed:?} {grown}");
    }
}

#[test]
fn reference_amplification_is_that_of_small_perturbations() {
    for case in [PAPER, SLOW] {
        let sliding = Sliding::new(case);
        let start = steady(&case.0, case.1.0);
        let scale = [1.0, 1.0, case.0.law.a];
        let columns = std::array::from_fn::<_, 3, _>(|i| {
            let mut shift = SVector::<f64, 5>::zeros();
            shift[i] = 1e-4 * scale[i];
            let [ahead, behind] = [start + shift, start - shift].map(|start| integrate(sliding, (0.0, 1.0), start));
            scaled(&case.0, (ahead - behind) / 2e-4)
        });
        let flow = Matrix3::from_fn(|i, j| columns[j][i]);
        let grown = amplified(case, 1e-10).number.expect("is solved");
        let found = flow.singular_values()[0];
        // The cubic term of the flow, and the integrator's error over the shift.
        assert!(relative(grown, found) < 1e-5, "{grown} {found}");
    }
}

#[test]
fn reference_a_held_control_misses_by_what_a_library_finds() {
    for case in [PAPER, SLOW] {
        let path = path(case);
        let sliding = Sliding::new(case);
        let dt = case.2 / 15.5;
        let mut state = steady(&case.0, case.1.0);
        for i in 0..16 {
            let (t, t_end) = (f64::from(i) / 15.5, (f64::from(i + 1) / 15.5).min(1.0));
            let held = case.0.control(&path.at_time(f64::from(i) * dt));
            state = integrate(Sliding { held: Some(held), ..sliding }, (t, t_end), state);
        }
        let expected = scaled(&case.0, state - steady(&case.0, case.1.1)).iter().map(|x| x * x).sum::<f64>().sqrt();
        for rtol in [1e-4, 1e-6, 1e-8, 1e-10] {
            let found = held(case, dt, rtol).number.expect("is simulated");
            assert!((found - expected).abs() <= rtol, "{found} {expected} at {rtol}");
        }
    }
}

/// An unstable motion that steps follow by symmetry, one that grows from rounding, and a relaxation within one step.
#[test]
fn regress_sampling_errors_are_confirmed_at_every_rtol() {
    let block = |a, b, k, m| SpringBlock { law: Law { a, b }, k, m };
    let growing = (
        block(0.009726472942776397, 0.019756482060041557, 1.9564830019060147e-5, 1.8698073792463112e-15),
        (1694.414030518873, 1673.5407267384317),
        2572.504292784483,
    );
    let rounding = (
        block(0.0014259086007340333, 0.00010463874126539788, 5.2686872107475295, 0.1114746559165563),
        (2.4801821635137093, 2.4802022796548004),
        4989.594452405204,
    );
    let relaxing = (
        block(0.29741210813052255, 0.22698566715183058, 0.03195997618147473, 0.0),
        (1.0012222492696503, 1.0012193258920763),
        500.6923492821583,
    );
    let exact = held(relaxing, 226.89267334993363, 1e-10).number.expect("is confirmed");
    for rtol in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
        let relaxed = held(relaxing, 226.89267334993363, rtol).number;
        assert!(relaxed.is_none_or(|found| (found - exact).abs() <= rtol), "{relaxed:?} {exact} at {rtol}");
        // The exact motion arrives; its computed errors grow by more than any accuracy.
        assert_eq!(held(growing, 47.089729322708926, rtol).number, None, "at {rtol}");
        let rounded = held(rounding, 163.5932956432249, rtol).number;
        assert!(rounded.is_none_or(|found| found <= rtol), "{rounded:?} at {rtol}");
    }
    assert!(held(relaxing, 226.89267334993363, 1e-4).number.is_some());
}

#[test]
fn the_error_of_a_held_control_is_of_second_order() {
    let rigid = (SpringBlock { k: f64::INFINITY, ..SLOW.0 }, SLOW.1, SLOW.2);
    let light = (SpringBlock { m: 0.0, ..SLOW.0 }, SLOW.1, SLOW.2);
    // A rigid spring forgives the third order later.
    for (case, n) in [(PAPER, 800.0), (SLOW, 800.0), (light, 800.0), (rigid, 6400.0)] {
        let errors = [n, 2.0 * n, 4.0 * n].map(|n| held(case, case.2 / n, 1e-11).number.expect("is simulated"));
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((order - 2.0).abs() < 0.05, "{case:?}: {errors:?}");
        }
    }
}

#[test]
fn the_loop_closes_to_what_the_amplification_allows() {
    let light = (SpringBlock { m: 0.0, ..PAPER.0 }, PAPER.1, PAPER.2);
    let back = (SLOW.0, (100.0, 3.0), 0.5);
    for case in [PAPER, light, SLOW, back] {
        let path = path(case);
        let grown = amplified(case, 1e-10).number.expect("is solved");
        for rtol in [1e-4, 1e-6, 1e-8, 1e-10] {
            let missed = open_loop_error(&path, rtol).number.expect("is simulated");
            assert!(missed <= rtol * (1.0 + grown), "{case:?} at {rtol}: {missed}, amplification {grown}");
        }
    }
}

#[test]
fn derivatives_are_those_of_the_path() {
    let path = path(PAPER);
    for i in 1..60 {
        let (t, h) = (PAPER.2 * f64::from(i) / 60.0, 1e-4 * PAPER.2);
        let [behind, here, ahead] = [t - h, t, t + h].map(|t| path.at_time(t));
        for k in 0..3 {
            let slope = (ahead.v[k] - behind.v[k]) / (2.0 * h);
            let size = 3.2e6 * (30.0 / PAPER.2).powi(k as i32 + 1);
            assert!((slope - here.v[k + 1]).abs() < 1e-4 * size, "{i} {k}: {slope} {}", here.v[k + 1]);
        }
        let slope = (PAPER.0.control(&ahead) - PAPER.0.control(&behind)) / (2.0 * h);
        let reported = PAPER.0.control_rate(&here, -(here.rate * here.v[0] + here.theta * here.v[1]));
        assert!((slope - reported).abs() < 1e-4 * 3.2e6 * 30.0 / PAPER.2, "{i}: {slope} {reported}");
        let rate = (ahead.theta - behind.theta) / (2.0 * h);
        assert!((rate - here.rate).abs() < 1e-4, "{i}: {rate} {}", here.rate);
    }
}

#[test]
fn stiff_springs_and_light_blocks_tend_to_rigid_ones_and_to_none() {
    let (slider, velocities, t_f) = SLOW;
    let rigid = (SpringBlock { k: f64::INFINITY, ..slider }, velocities, t_f);
    let expected = solve(rigid, 1e-12);
    assert_eq!([expected.control_min, expected.control_max], [expected.v_min, expected.v_max]);
    let grown = amplified(rigid, 1e-10).number.expect("is solved");
    let mut last = f64::INFINITY;
    for k in [1e3, 1e5, 1e7] {
        let found = solve((SpringBlock { k, ..slider }, velocities, t_f), 1e-12);
        assert_eq!([found.alpha, found.work, found.v_max], [expected.alpha, expected.work, expected.v_max]);
        let lag = relative(found.control_max, expected.control_max);
        assert!(lag < 0.02 * last && lag < 200.0 / k, "{k}: {lag}");
        last = lag;
        let without_mass = (SpringBlock { k, m: 0.0, ..slider }, velocities, t_f);
        let found = amplified(without_mass, 1e-10).number.expect("is solved");
        assert!(relative(found, grown) < 10.0 / k, "{k}: {found} {grown}");
    }
    let without_mass = (SpringBlock { m: 0.0, ..slider }, velocities, t_f);
    let expected = amplified(without_mass, 1e-10).number.expect("is solved");
    for m in [1e-8, 1e-10, 1e-12] {
        let found = amplified((SpringBlock { m, ..slider }, velocities, t_f), 1e-10).number.expect("is solved");
        assert!(relative(found, expected) < 1e5 * m, "{m}: {found} {expected}");
    }
}

#[test]
fn regress_equal_velocities_are_a_constant_protocol() {
    let (slider, _, t_f) = SLOW;
    let found = solve((slider, (7.0, 7.0), t_f), 1e-10);
    let friction = 1.0 + (slider.law.a - slider.law.b) * 7f64.ln();
    assert!(found.alpha.to_bits() == 0 && relative(found.work, friction * 7.0 * t_f) < 1e-15, "{found:?}");
    assert_eq!([found.v_min, found.v_max], [7.0, 7.0]);
    assert!(relative(found.control_min, 7.0) < 1e-14 && relative(found.control_max, 7.0) < 1e-14, "{found:?}");
}

#[test]
fn regress_what_does_not_exist_is_infeasible() {
    let (slider, velocities, t_f) = SLOW;
    let t_min = ((100.0f64 - 3.0) / (100.0 * 2.0)).ln_1p();
    let status = |slider: SpringBlock, velocities, t_f| {
        let solved = compliant::solve(&slider, velocities, t_f, 1e-10);
        assert!(solved.value.is_none());
        solved.status
    };
    for (slider, velocities, t_f) in [
        (slider, (100.0, 3.0), t_min * (1.0 - 1e-12)),
        (slider, (1.0, 3.0), t_f),
        (slider, (3.0, 1.0), t_f),
        (slider, velocities, 0.0),
        (slider, velocities, f64::INFINITY),
        (slider, velocities, f64::NAN),
        (SpringBlock { k: 0.0, ..slider }, velocities, t_f),
        (SpringBlock { m: -1.0, ..slider }, velocities, t_f),
        (SpringBlock { m: f64::INFINITY, ..slider }, velocities, t_f),
        (SpringBlock { law: Law { a: 0.0, b: 0.05 }, ..slider }, velocities, t_f),
    ] {
        assert_eq!(status(slider, velocities, t_f), Status::Infeasible, "{slider:?} {velocities:?} {t_f}");
    }
    assert_eq!(compliant::path(&slider, velocities, -1.0, 1e-10).err(), Some(Status::Infeasible));
}

#[test]
fn regress_every_corner_of_the_range_is_solved() {
    let velocities: [f64; 6] = [1.0 + 1e-12, 1.001, 1.5, 30.0, 1e4, 1e8];
    let mut solved = 0;
    for v_i in velocities {
        for v_f in velocities {
            let t_min = ((v_i - v_f) / (v_i * (v_f - 1.0))).ln_1p().max(0.0);
            for fraction in [1e-9, 1e-6, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e6] {
                for (k, m) in [(1e-3, 0.0), (1.0, 1e-6), (f64::INFINITY, 1.0)] {
                    for t_f in [fraction / v_f, t_min * (1.0 + fraction)] {
                        let slider = SpringBlock { law: Law { a: 1e-3, b: 2e-3 }, k, m };
                        for rtol in [1e-6, 1e-10, 1e-13] {
                            let found = compliant::solve(&slider, (v_i, v_f), t_f, rtol);
                            assert_ne!(found.status, Status::NotConverged, "{slider:?} {v_i} {v_f} {t_f} {rtol}");
                            if let Some(found) = found.value {
                                solved += 1;
                                assert!(found.v_min >= 1.0 && found.v_max >= v_i.max(v_f), "{found:?}");
                                assert!(found.work.is_finite() && found.control_min <= found.control_max);
                            }
                        }
                    }
                }
            }
        }
    }
    assert!(solved > 2900, "{solved}");
}

#[test]
fn regress_work_counts() {
    let solved = compliant::solve(&PAPER.0, PAPER.1, PAPER.2, 1e-10);
    assert_eq!((solved.stats.quadratures, solved.stats.nodes), (7, 496));
    let path = path(PAPER);
    let followed = [amplified(PAPER, 1e-10), open_loop_error(&path, 1e-10), held(PAPER, PAPER.2 / 100.0, 1e-10)];
    let [grown, reported, held] = followed.map(|followed| followed.steps);
    // At least a step a sample in each of two simulations.
    assert!(grown == 41 && reported < 100 && (200..600).contains(&held), "{grown} {reported} {held}");
}

/// Squares of a large flow overflowed, and the amplification came out as 0. The logarithms are from an integration of the
/// logarithm of the flow.
#[test]
fn regress_amplifications_beyond_the_square_root_of_the_largest_double() {
    let at = |t_f| {
        let slider = SpringBlock { law: Law { a: 0.01, b: 0.05 }, k: 0.001, m: 0.0 };
        amplified((slider, (100.0, 1000.0), t_f), 1e-10).number
    };
    for (t_f, expected) in [(0.2, 176.42), (0.3, 263.3)] {
        let found = at(t_f).expect("is a double").log10();
        assert!((found - expected).abs() < 0.05, "{t_f} {found}");
    }
    assert_eq!(at(0.5), None);
}

/// Where contacts follow, `theta v = 1` and friction is `1 + (a - b) ln v`: a soft spring is driven by its slope, which is lost
/// in the rounding of `1 - theta v`.
#[test]
fn regress_control_velocities_of_slow_protocols_on_soft_springs() {
    let (law, k, t_f) = (Law { a: 0.03, b: 0.05 }, 1e-20, 1e13);
    for rtol in [1e-6, 1e-10] {
        let found = solve((SpringBlock { law, k, m: 1e-9 }, (2.0, 3.0), t_f), rtol);
        let rise = 2f64.ln();
        let reported = |x: f64| {
            let (flat, z) = (x * x * (1.0 - x) * (1.0 - x), 1.0 - x);
            let f = rise * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x) + found.alpha * (x * z).powi(3);
            let slope = 30.0 * rise * flat + 3.0 * found.alpha * flat * (1.0 - 2.0 * x);
            let v = 1.0 + f.exp();
            v + (law.a - law.b) * f.exp() * slope / (v * t_f * k)
        };
        let places = (0..=200_000).map(|i| reported(f64::from(i) / 200_000.0));
        let (low, high) =
            places.fold((f64::MAX, f64::MIN), |(low, high), reported| (low.min(reported), high.max(reported)));
        let size = low.abs().max(high.abs());
        assert!(size > 1e5);
        assert!((found.control_min - low).abs() <= (rtol + 1e-8) * size, "{found:?} {low}");
        assert!((found.control_max - high).abs() <= (rtol + 1e-8) * size, "{found:?} {high}");
    }
}

#[test]
fn regress_a_soft_spring_that_slides_steadily_is_driven_as_fast() {
    let law = Law { a: 0.00018869557042703084, b: 0.00018869557042703084 };
    let v = 1.0000219636724441;
    let found = solve((SpringBlock { law, k: 5.39280429386416e-32, m: 1e-30 }, (v, v), 3.953104389605138e8), 4e-3);
    assert_eq!((found.control_min, found.control_max), (v, v));
}

/// Small factors lose digits, so they are 0: those of `sweeps/compliant.toml` differed by up to 1000 rtol at 1e-25.
#[test]
fn amplifications_keep_their_digits_or_are_0() {
    let law = Law { a: 0.005, b: 0.01 };
    let factor = |t_f: f64, k: f64, rtol: f64| {
        amplified((SpringBlock { law, k, m: 2.5e-16 }, (1e5, 3.2e6), t_f), rtol).number.expect("is solved")
    };
    for (t_f, k) in [(1.5537e-5, 0.0299), (1.5537e-5, 0.0376), (1.3847e-5, 0.0474)] {
        let (found, finer) = (factor(t_f, k, 1e-4), factor(t_f, k, 1e-10));
        assert!(found > 0.0 && relative(found, finer) <= 1e-9, "{t_f} {k}: {found:e}, {finer:e}");
    }
    assert_eq!(factor(3.1e-5, 0.029858, 1e-10), 0.0);
}

/// A coarse shortcut changed the exponents of large amplifications, and coarse steps lost contractions: at an rtol of 1e-2 these were off by factors
/// of 2 to 1e12.
#[test]
fn regress_amplifications_are_as_accurate_as_requested_at_every_rtol() {
    let case = |[a, b, k, m, v_i, v_f, t_f]: [f64; 7]| (SpringBlock { law: Law { a, b }, k, m }, (v_i, v_f), t_f);
    for numbers in [
        [0.016, 0.255, 0.0546, 0.0, 7.777, 1174.3, 1.004e-5],
        [0.00444, 0.0403, 254.2, 0.0, 1.00389, 9.924e9, 2.7517e-8],
        [0.0129, 0.06195, 23.735, 0.0, 1.6676, 7.512e9, 2.7379e-8],
        [0.00438, 0.04953, 4.32e-5, 1.7675e-11, 214202.0, 40.377, 0.071878],
        [0.0012888, 0.0025839, 3.0994e-7, 0.0, 1.2283, 1722673.0, 2.6735e-4],
    ] {
        let exact = amplified(case(numbers), 1e-9).number.expect("is solved");
        for rtol in [1e-2, 1e-3, 1e-4, 1e-6, 1e-7] {
            let found = amplified(case(numbers), rtol).number.expect("is solved");
            assert!(relative(found, exact) <= rtol || found == exact, "{numbers:?} at {rtol}: {found:e}, {exact:e}");
        }
    }
}

/// Extremes of the control velocity close to a node of vanishing slope, and between nodes; from collocation of 16 nodes with 32 digits.
#[test]
fn regress_extremes_of_the_control_velocity_near_the_ends_and_between_nodes() {
    let solved = |[a, b, k, m]: [f64; 4], velocities, t_f, rtol| {
        solve((SpringBlock { law: Law { a, b }, k, m }, velocities, t_f), rtol)
    };
    let flat = [0.01969701349410895, 0.013833986400713722, 1696.067088324354, 1.0242042020307178e-14];
    let found = solved(flat, (4851.6865682743955, 26307.028466228687), 0.04538134269045604, 1e-10);
    assert!(relative(found.control_max, 26307.02847505378) < 1e-10, "{found:?}");
    let inside = [0.0076400947422102326, 0.027434780847828955, 0.019447057139259195, 6.8651666915539605e-19];
    let found = solved(inside, (1758.7827747243555, 209649.51058623596), 5.975879336875064e-07, 1e-10);
    assert!(relative(found.control_min, -19265908.53636156) < 1e-10, "{found:?}");
    let inside = [0.001189742002423645, 0.008687122298856062, 0.0074969666882502735, 1.1518823454289702e-26];
    let found = solved(inside, (40850308.356057756, 4234725534.9070506), 4.543284006552238e-11, 1e-10);
    assert!(relative(found.control_min, -139920016329.61243) < 1e-10, "{found:?}");
    // Three extrema between the last two nodes; the greatest is that of a fine trace.
    let three = [0.0045204534807925635, 4.505821101400291e-05, 0.0001548194647883899, 7.283257617631542e-07];
    for rtol in [1e-10, 1e-12] {
        let found = solved(three, (1.001297443504528, 30.827635705038755), 1703.0543213200197, rtol);
        assert!(relative(found.control_max, 30.82763571588791) < 1e-12, "{rtol}: {found:?}");
    }
}
