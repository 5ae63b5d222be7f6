//! The stiff integrator and the integration along a response: error against tolerance, and exact step counts.

use slipsweep::model::StateLaw;
use slipsweep::numerics::elementary::exp;
use slipsweep::numerics::stiff::{Accuracy, Collocation, Integrator, Linearised, Points, System, radau_iia_9};
use slipsweep::stability::step_response::{ScaledBlock, State, step_to};

/// Index of `ln(v/v_f)` in a [`State`].
const X: usize = 2;

/// `e^(w/4) c' = -e^(w/4) s`, `s' = c` and the constraint `w = c s`: a rotation.
struct Rotation;

impl System<3> for Rotation {
    fn linearise<const L: usize>(&self, points: &Points<3, L>) -> Linearised<3, L> {
        let mut at = Linearised { residual: [[0.0; L]; 3], mass: [[0.0; L]; 3], jacobian: [[[0.0; L]; 3]; 3] };
        for i in 0..L {
            let [c, s, w] = [0, 1, 2].map(|r: usize| points.y[r][i]);
            let mass = exp(0.25 * w);
            (at.mass[0][i], at.mass[1][i]) = (mass, 1.0);
            at.residual[0][i] = mass * (-s - points.slope[0][i]);
            at.residual[1][i] = c - points.slope[1][i];
            at.residual[2][i] = w - c * s;
            (at.jacobian[0][1][i], at.jacobian[0][2][i]) = (-mass, 0.25 * at.residual[0][i]);
            at.jacobian[1][0][i] = 1.0;
            (at.jacobian[2][0][i], at.jacobian[2][1][i], at.jacobian[2][2][i]) = (-s, -c, 1.0);
        }
        at
    }
}

/// `y' = -1e9 (y - cos t)`, and `x' = -y`: `x = -sin t - 1e-9 (2 - cos t)` after the layer.
struct Follower;

impl System<2> for Follower {
    fn linearise<const L: usize>(&self, points: &Points<2, L>) -> Linearised<2, L> {
        let rate = 1e9;
        let mut at = Linearised { residual: [[0.0; L]; 2], mass: [[1.0; L]; 2], jacobian: [[[0.0; L]; 2]; 2] };
        for i in 0..L {
            at.residual[0][i] = -points.y[1][i] - points.slope[0][i];
            at.residual[1][i] = -rate * (points.y[1][i] - libm::cos(points.t[i])) - points.slope[1][i];
            (at.jacobian[0][1][i], at.jacobian[1][1][i]) = (-1.0, -rate);
        }
        at
    }
}

fn follow(tolerance: f64) -> (f64, u32) {
    let accuracy = Accuracy { tolerance, scale: [1.0; 2] };
    let mut integrator = Integrator::new(&Follower, radau_iia_9(), accuracy, 0.0, [0.0, 2.0], 1e-3);
    let mut steps = 0;
    while integrator.t() < 10.0 {
        integrator.step(10.0).expect("goes on");
        steps += 1;
    }
    assert_eq!(integrator.t(), 10.0);
    ((integrator.y()[0] + libm::sin(10.0) + 1e-9 * (2.0 - libm::cos(10.0))).abs(), steps)
}

#[test]
fn error_got_is_the_error_asked_through_a_layer_of_1e_9() {
    for digits in 3..=11 {
        let tolerance = libm::pow(10.0, -f64::from(digits));
        let (error, _) = follow(tolerance);
        assert!(error <= tolerance, "{error:.1e} at {tolerance:.0e}");
    }
}

#[test]
fn work_is_known_exactly() {
    assert_eq!(follow(1e-8).1, 28);
}

/// `y' = e^y`, which is infinite at `t = e^-y(0)`.
struct FiniteTimeBlowUp;

impl System<1> for FiniteTimeBlowUp {
    fn linearise<const L: usize>(&self, points: &Points<1, L>) -> Linearised<1, L> {
        let rate = points.y[0].map(exp);
        let mut at = Linearised { residual: [rate], mass: [[1.0; L]], jacobian: [[rate]] };
        for i in 0..L {
            at.residual[0][i] -= points.slope[0][i];
        }
        at
    }
}

#[test]
fn a_solution_that_ends_reports_where() {
    let accuracy = Accuracy { tolerance: 1e-10, scale: [1.0] };
    let mut integrator = Integrator::new(&FiniteTimeBlowUp, radau_iia_9(), accuracy, 0.0, [0.0], 0.1);
    let mut steps = 0;
    while integrator.step(2.0).is_some() {
        steps += 1;
    }
    assert!((integrator.t() - 1.0).abs() < 1e-10, "{}", integrator.t());
    assert_eq!(steps, 280);
}

#[test]
fn part_of_a_step_has_the_order_of_the_method() {
    let accuracy = Accuracy { tolerance: 1e-6, scale: [1.0; 3] };
    let mut integrator = Integrator::new(&Rotation, radau_iia_9(), accuracy, 0.0, [1.0, 0.0, 0.0], 0.1);
    let (mut dense, mut exact) = (0.0_f64, 0.0_f64);
    while integrator.t() < 6.0 {
        let dense_output = integrator.step(6.0).expect("goes on");
        let part = integrator.between(&dense_output, 0.0, 0.4).expect("converges");
        let cos = libm::cos(dense_output.t + 0.4 * dense_output.h);
        dense = dense.max((dense_output.value(0, 0.4) - cos).abs());
        exact = exact.max((part.end[0] - cos).abs());
    }
    assert!(exact < 1e-6 && exact < 0.1 * dense, "{dense:.1e} {exact:.1e}");
}

fn power(x: f64, n: usize) -> f64 {
    (0..n).fold(1.0, |product, _| product * x)
}

fn conditions<const S: usize>(rule: &Collocation<S>) {
    let near = |found: f64, expected: f64, size: f64| {
        assert!((found - expected).abs() <= 4.0 * f64::EPSILON * size, "{S} stages: {found} {expected}");
    };
    assert_eq!(rule.nodes[S - 1], 1.0);
    assert!(rule.nodes.windows(2).all(|pair| pair[0] > 0.0 && pair[0] < pair[1]));
    for n in 1..=2 * S - 1 {
        // The weights are the last row: quadrature of x^(n-1) up to the order of the method.
        let sum: f64 = (0..S).map(|j| rule.integration[S - 1][j] * power(rule.nodes[j], n - 1)).sum();
        near(sum, 1.0 / n as f64, 1.0);
    }
    let sum = |row: &[f64; S], f: &dyn Fn(f64) -> f64| {
        let terms: Vec<f64> = (0..S).map(|j| row[j] * f(rule.nodes[j])).collect();
        (terms.iter().sum::<f64>(), terms.iter().map(|term| term.abs()).sum::<f64>())
    };
    for n in 1..=S {
        for i in 0..S {
            let c = rule.nodes[i];
            let (integral, size) = sum(&rule.integration[i], &|x| power(x, n - 1));
            near(integral, power(c, n) / n as f64, size);
            let (slope, size) = sum(&rule.differentiation[i], &|x| power(x, n));
            near(slope, n as f64 * power(c, n - 1), size);
            let (coefficient, size) = sum(&rule.powers[i], &|x| power(x, n));
            near(coefficient, if i + 1 == n { 1.0 } else { 0.0 }, size);
        }
        let (slope, size) = sum(&rule.powers[0], &|x| power(x, n));
        near(slope, if n == 1 { 1.0 } else { 0.0 }, size);
    }
}

#[test]
fn collocation_conditions_hold() {
    conditions(radau_iia_9());
}

/// The published material at `v_f = 3.2e6`.
const SLIDER: ScaledBlock = ScaledBlock { state_law: StateLaw::Ageing, a: 0.005, b: 0.01, inertia: 2.56e-3, k: 7.5e-3 };

/// State at the end of a response, its upward crossings of `v_f`, and the numbers of its series and implicit steps.
fn follow_response(k: f64, t_end: f64, tolerance: f64) -> (State, usize, [u32; 2]) {
    let slider = ScaledBlock { k, ..SLIDER };
    let start = slider.steady(-32.0_f64.ln());
    let mut run = slider.run(start, slider.first_step(&start), tolerance);
    let (mut rises, mut counts) = (0, [0; 2]);
    while run.t() < t_end {
        if let Some(arrested) = slider.arrest(run.y()) {
            run.jump(arrested, slider.first_step(&arrested));
        }
        let step = step_to(&mut run, t_end).expect("goes on");
        counts[usize::from(step.is_implicit)] += 1;
        let values: Vec<f64> = (0..=8).map(|i| step.path.value(X, f64::from(i) / 8.0)).collect();
        rises += values.windows(2).filter(|pair| pair[0] < 0.0 && pair[1] >= 0.0).count();
    }
    (*run.y(), rises, counts)
}

/// The published response over 50 periods and deep stick-slip over 50 peaks: the cases of `benches/peers`, with the final
/// states of its `reference.c`, and the amplification of errors.
const CASES: [(f64, f64, State, usize, f64); 2] = [
    (7.5e-3, 50.0 * (1.98357e-6 * 3.2e6), [2.150556631719136e-3, 1.67506764044267e-1, -3.35849426803342e-2], 48, 10.0),
    (3.78e-3, 940.0, [1.148246712724051e-2, 2.3776288157839837, -2.4866011275185427], 50, 250.0),
];

#[test]
fn reference_error_is_the_requested_error_times_the_amplification() {
    for (k, t_end, end, expected, growth) in CASES {
        for digits in 3..=13 {
            let tolerance = libm::pow(10.0, -f64::from(digits));
            let (state, rises, ..) = follow_response(k, t_end, tolerance);
            let unit = [ScaledBlock { k, ..SLIDER }.force(), 1.0, 1.0];
            let error = (0..3).map(|r| (state[r] - end[r]).abs() / unit[r]).fold(0.0, f64::max);
            // Below 1e-12 rounding errors grow like those of steps.
            assert!(error <= growth * tolerance.max(1e-12), "{k} at {tolerance:.0e}: {error:.1e}");
            assert_eq!(rises, expected, "{k} at {tolerance:.0e}");
        }
    }
}

#[test]
fn step_counts_are_exact() {
    assert_eq!(CASES.map(|(k, t_end, ..)| follow_response(k, t_end, 1e-6).2), [[373, 14], [1211, 656]]);
}
