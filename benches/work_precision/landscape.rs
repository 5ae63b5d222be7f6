//! The landscape point: ours, Gauss rules of fixed size, and adaptive quadrature from libraries.

use std::cell::Cell;
use std::ops::Range;
use std::rc::Rc;

use gkquad::Tolerance;
use gkquad::single::Integrator;
use gkquad::single::algorithm::QAGS;
use multiversion::multiversion;
use slipsweep::model::{Law, Transition};
use slipsweep::numerics::elementary::ln;
use slipsweep::numerics::gauss::{Rule, rule};
use slipsweep::protocol::Status;
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};

use super::measure::{Answer, Kind, Method, NONE, Setting, Subject, Truth, relative};
use super::optimal::transition;
use super::reference::{self, Row};

/// Sizes of the fixed rules.
const NODES: [usize; 5] = [16, 24, 32, 48, 64];

/// Subdivisions after which the adaptive rule gives up.
const MOST_PARTS: usize = 500;

/// A shortcut, by the coefficients of `theta` and of `n = t_f (1 - theta')` in powers of `x = t/t_f`.
struct Cubic {
    law: Law,
    t_f: f64,
    theta: [f64; 4],
    n: [f64; 3],
}

pub fn subjects(tolerances: &[f64]) -> [Subject; 2] {
    let (paper, others) = reference::table("landscape").into_iter().enumerate().partition(|(_, row)| is_paper(row));
    [
        subject("the paper's landscapes", paper, tolerances),
        subject("the whole domain, up to the border", others, tolerances),
    ]
}

/// Whether a row is of the paper's landscapes and not put near the border of feasibility.
fn is_paper(row: &Row) -> bool {
    let inside = |name: &str| row.number(name).abs() <= 0.5;
    transition(row) == (Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.0, v_f: 100.0 })
        && inside("a_2")
        && inside("a_3")
        && row.text("v_min").parse().map_or(true, |v_min: f64| v_min > 1e-2)
}

fn subject(cases: &'static str, rows: Vec<(usize, Row)>, tolerances: &[f64]) -> Subject {
    let (places, rows): (Vec<usize>, Vec<Row>) = rows.into_iter().unzip();
    let truth = |row: &Row| match row.optional("work") {
        Some(work) => Truth { answer: [work, f64::NAN], doubt: 16.0 * f64::EPSILON },
        None => Truth { answer: NONE, doubt: 0.0 },
    };
    let truths = rows.iter().map(truth).collect();
    let cubics: Rc<Vec<Cubic>> = Rc::new(rows.iter().map(cubic).collect());
    let mut methods = vec![Method {
        name: "ours".into(),
        kind: Kind::Ours,
        settings: tolerances.iter().map(|&rtol| ours(&rows, rtol)).collect(),
    }];
    methods.extend([("Gauss rules, vectorised", true), ("Gauss rules, f64::ln", false)].map(|(name, vectorised)| {
        let setting = |&nodes: &usize| {
            let cubics = Rc::clone(&cubics);
            let rule = rule(nodes);
            let solve = move |range: Range<usize>, answers: &mut [Answer]| {
                for (cubic, answer) in cubics[range].iter().zip(answers) {
                    let work = if vectorised { vectors(cubic, rule) } else { scalars(cubic, rule) };
                    *answer = [work, f64::NAN];
                }
            };
            Setting { name: format!("{nodes} nodes"), tolerance: None, solve: Box::new(solve) }
        };
        Method { name: name.into(), kind: Kind::Other, settings: NODES.iter().map(setting).collect() }
    }));
    methods.push(Method::each("Gauss-Kronrod (gkquad)", Kind::Other, tolerances, &cubics, kronrod));
    methods.push(Method::each("double exponential (quadrature)", Kind::Other, tolerances, &cubics, double_exponential));
    Subject {
        name: "landscape",
        cases,
        error: "relative error of the work",
        truths,
        rows: places,
        judge: relative,
        methods,
    }
}

fn cubic(row: &Row) -> Cubic {
    let Transition { law, v_i, v_f } = transition(row);
    let [t_f, a_2, a_3] = ["t_f", "a_2", "a_3"].map(|name| row.number(name));
    let a_4 = 1.0 / v_f - 1.0 / v_i - a_2 - a_3;
    Cubic { law, t_f, theta: [1.0 / v_i, a_2, a_3, a_4], n: [t_f - a_2, -2.0 * a_3, -3.0 * a_4] }
}

/// Rows of one landscape are evaluated together; each landscape is prepared beforehand, as a run does it once for all
/// of its points.
fn ours(rows: &[Row], rtol: f64) -> Setting {
    let key = |row: &Row| ["a", "b", "v_i", "v_f", "t_f"].map(|name| row.number(name).to_bits());
    let landscapes: Vec<Landscape> =
        rows.iter().map(|row| Landscape::new(&transition(row), row.number("t_f"), rtol)).collect();
    let mut ends: Vec<usize> = (1..rows.len()).filter(|&i| key(&rows[i]) != key(&rows[i - 1])).collect();
    ends.push(rows.len());
    let [a_2, a_3] = ["a_2", "a_3"].map(|name| rows.iter().map(|row| row.number(name)).collect::<Vec<f64>>());
    let solve = move |range: Range<usize>, answers: &mut [Answer]| {
        let mut work = [f64::NAN; 64];
        let mut status = [Status::NotConverged; 64];
        let mut first = range.start;
        while first < range.end {
            let next = ends[ends.partition_point(|&end| end <= first)].min(range.end).min(first + work.len());
            let out = LandscapeBuffers { work: &mut work, v_min: &mut [], status: &mut status[..next - first] };
            landscapes[first].evaluate(&a_2[first..next], &a_3[first..next], out);
            for i in first..next {
                let feasible = status[i - first] != Status::Infeasible;
                answers[i - range.start] = [if feasible { work[i - first] } else { f64::NAN }, f64::NAN];
            }
            first = next;
        }
    };
    Setting { name: format!("{rtol:e}"), tolerance: Some(rtol), solve: Box::new(solve) }
}

impl Cubic {
    #[inline(always)]
    fn at(&self, x: f64) -> (f64, f64) {
        let ([c0, c1, c2, c3], [d0, d1, d2]) = (self.theta, self.n);
        (c0 + x * (c1 + x * (c2 + x * c3)), d0 + x * (d1 + x * d2))
    }

    #[inline(always)]
    fn power(&self, theta: f64, n: f64, ln: impl Fn(f64) -> f64) -> f64 {
        let Law { a, b } = self.law;
        (1.0 + a * ln(n / self.t_f) + (b - a) * ln(theta)) * n / theta
    }
}

/// With the logarithm of ours, by vector instructions; infeasible where a node shows it.
#[multiversion(targets(
    "x86_64+avx+avx2+bmi1+bmi2+avx512f+avx512bw+avx512cd+avx512dq+avx512vl",
    "x86_64+avx+avx2+bmi1+bmi2"
))]
fn vectors(cubic: &Cubic, rule: &Rule) -> f64 {
    let mut sum = [0.0; 8];
    let mut least = [f64::INFINITY; 8];
    for (x, weight) in rule.x.chunks_exact(8).zip(rule.w.chunks_exact(8)) {
        for lane in 0..8 {
            let (theta, n) = cubic.at(0.5 + 0.5 * x[lane]);
            least[lane] = least[lane].min(theta).min(n);
            sum[lane] += 0.5 * weight[lane] * cubic.power(theta, n, ln);
        }
    }
    if least.iter().all(|&least| least > 0.0) { sum.iter().sum() } else { f64::NAN }
}

/// As it would be written down.
fn scalars(cubic: &Cubic, rule: &Rule) -> f64 {
    let mut sum = 0.0;
    for (x, weight) in rule.x.iter().zip(&rule.w) {
        let (theta, n) = cubic.at(0.5 + 0.5 * x);
        if theta <= 0.0 || n <= 0.0 {
            return f64::NAN;
        }
        sum += 0.5 * weight * cubic.power(theta, n, f64::ln);
    }
    sum
}

/// The integrand, which notes where theta or v are not positive.
fn noted(cubic: &Cubic, fails: &Cell<bool>, x: f64) -> f64 {
    let (theta, n) = cubic.at(x);
    if theta > 0.0 && n > 0.0 {
        cubic.power(theta, n, f64::ln)
    } else {
        fails.set(true);
        0.0
    }
}

fn kronrod(cubic: &Cubic, tolerance: f64) -> Option<Answer> {
    let fails = Cell::new(false);
    let result = Integrator::with_algorithm(|x: f64| noted(cubic, &fails, x), QAGS::new())
        .tolerance(Tolerance::Relative(tolerance))
        .max_iters(MOST_PARTS)
        .run(0.0..1.0);
    if fails.get() { None } else { Some([result.estimate().ok()?, f64::NAN]) }
}

/// Its tolerance is absolute: a relative one is made of it by the middle's value.
fn double_exponential(cubic: &Cubic, tolerance: f64) -> Option<Answer> {
    let fails = Cell::new(false);
    let size = noted(cubic, &fails, 0.5).abs();
    let result = quadrature::double_exponential::integrate(|x| noted(cubic, &fails, x), 0.0, 1.0, tolerance * size);
    (!fails.get()).then_some([result.integral, f64::NAN])
}
