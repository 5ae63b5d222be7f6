//! A question with cases whose answers are known, ways to answer it, and what one way costs and errs at one setting.

use std::hint::black_box;
use std::ops::Range;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// Two numbers that answer a case; the first is NaN where there is no answer.
pub type Answer = [f64; 2];

/// No answer.
pub const NONE: Answer = [f64::NAN; 2];

/// What is known of a case.
#[derive(Debug, Clone, Copy)]
pub struct Truth {
    /// The answer, from a table of many digits; [`NONE`] where there is none.
    pub answer: Answer,
    /// The relative error that the rounding of the case's own numbers makes.
    pub doubt: f64,
}

/// Cases of one kind, and ways to solve them.
pub struct Subject {
    /// What is computed: pictures and tables of one name belong together.
    pub name: &'static str,
    /// Which cases.
    pub cases: &'static str,
    /// What the error is, in words.
    pub error: &'static str,
    /// One a case.
    pub truths: Vec<Truth>,
    /// The row of the reference table that each case is.
    pub rows: Vec<usize>,
    /// Error of an answer; infinite if it is no answer to the case.
    pub judge: fn(&Answer, &Answer) -> f64,
    /// The first is ours.
    pub methods: Vec<Method>,
}

/// A way to solve the cases.
pub struct Method {
    pub name: String,
    pub kind: Kind,
    pub settings: Vec<Setting>,
}

/// How a method is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// It is held to its tolerance.
    Ours,
    Other,
}

/// A way with its tolerance or number of nodes.
pub struct Setting {
    pub name: String,
    /// The relative error that is requested, if the method has one.
    pub tolerance: Option<f64>,
    pub solve: Box<Solve>,
}

/// Solves a range of the cases.
type Solve = dyn Fn(Range<usize>, &mut [Answer]);

impl Setting {
    /// A setting that solves one case at a time to a tolerance.
    pub fn each<T: 'static>(
        tolerance: f64,
        cases: &Rc<Vec<T>>,
        solve: impl Fn(&T, f64) -> Option<Answer> + 'static,
    ) -> Setting {
        let cases = Rc::clone(cases);
        let solve = move |range: Range<usize>, answers: &mut [Answer]| {
            for (case, answer) in cases[range].iter().zip(answers) {
                *answer = solve(black_box(case), tolerance).unwrap_or(NONE);
            }
        };
        Setting { name: format!("{tolerance:e}"), tolerance: Some(tolerance), solve: Box::new(solve) }
    }
}

impl Method {
    /// A method that solves one case at a time, at tolerances.
    pub fn each<T: 'static>(
        name: &str,
        kind: Kind,
        tolerances: &[f64],
        cases: &Rc<Vec<T>>,
        solve: impl Fn(&T, f64) -> Option<Answer> + Copy + 'static,
    ) -> Method {
        let settings = tolerances.iter().map(|&tolerance| Setting::each(tolerance, cases, solve)).collect();
        Method { name: name.to_owned(), kind, settings }
    }
}

/// How much is measured.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    /// Time for one setting; a pass over the cases is finished.
    pub budget: Duration,
    /// Every how many cases are solved by methods other than ours.
    pub stride: usize,
    /// Whether one pass is enough.
    pub once: bool,
}

/// What one setting of one method costs and errs.
#[derive(Debug, Clone)]
pub struct Record {
    pub subject: &'static str,
    pub cases: &'static str,
    pub method: String,
    pub ours: bool,
    pub setting: String,
    pub tolerance: Option<f64>,
    /// Cases solved.
    pub count: usize,
    /// Those without an answer, or with one that is no answer to the case.
    pub failures: usize,
    /// Nanoseconds a case that has an answer.
    pub ns: f64,
    /// Median, 95 % quantile and greatest of the errors of all that did not fail.
    pub errors: [f64; 3],
    /// The greatest of the errors less what the case's own rounding makes, as a fraction of the tolerance.
    pub fraction: f64,
}

/// A case fails if it is further off than so many times what was requested.
const WRONG: f64 = 1e3;

/// And so does every error above this; none below the other one does.
const WRONG_FROM: [f64; 2] = [1e-9, 1e-2];

/// Cases that are timed together, if they are fast.
const SPELL: usize = 25;

/// Seconds from which on a case is timed alone.
const LONG: f64 = 2e-5;

/// The relative error of the first number; the second must be right to a tenth.
pub fn relative(found: &Answer, truth: &Answer) -> f64 {
    let error = |i: usize| if found[i] == truth[i] { 0.0 } else { ((found[i] - truth[i]) / truth[i]).abs() };
    if truth[1].is_nan() || error(1) <= 0.1 { error(0) } else { f64::INFINITY }
}

/// Measures one setting.
pub fn measure(subject: &Subject, method: &Method, setting: &Setting, extent: Extent) -> Record {
    let all = subject.truths.len();
    let stride = match method.kind {
        Kind::Ours => 1,
        Kind::Other => extent.stride,
    };
    let mut answers = vec![NONE; all];
    // The first call may make what later ones share.
    (setting.solve)(0..1, &mut answers[..1]);
    let start = Instant::now();
    (setting.solve)(0..1, &mut answers[..1]);
    let length = if stride > 1 || start.elapsed().as_secs_f64() > LONG { 1 } else { SPELL };
    let spells: Vec<Range<usize>> =
        (0..all).step_by(length.max(stride)).map(|first| first..(first + length).min(all)).collect();
    let mut least = vec![f64::INFINITY; spells.len()];
    let begin = Instant::now();
    for round in 1.. {
        for (spell, least) in spells.iter().zip(&mut least) {
            let start = Instant::now();
            (setting.solve)(spell.clone(), black_box(&mut answers[spell.clone()]));
            *least = least.min(start.elapsed().as_secs_f64());
        }
        if extent.once || begin.elapsed() > extent.budget * if round > 1 { 1 } else { 4 } {
            break;
        }
    }
    let solved: Vec<(usize, Answer)> = spells.iter().flat_map(Clone::clone).map(|i| (i, answers[i])).collect();
    Record {
        ours: method.kind == Kind::Ours,
        ..judged(subject, &method.name, &setting.name, setting.tolerance, &solved, least.iter().sum())
    }
}

/// The record of a setting that took `seconds` for the answers to some cases.
pub fn judged(
    subject: &Subject,
    method: &str,
    setting: &str,
    tolerance: Option<f64>,
    solved: &[(usize, Answer)],
    seconds: f64,
) -> Record {
    let limit = tolerance.map_or(WRONG_FROM[1], |asked| (WRONG * asked).clamp(WRONG_FROM[0], WRONG_FROM[1]));
    let (mut errors, mut failures, mut answered, mut fraction) = (Vec::new(), 0, 0, 0.0_f64);
    for (i, found) in solved {
        let Truth { answer, doubt } = subject.truths[*i];
        if answer[0].is_nan() {
            failures += usize::from(!found[0].is_nan());
            continue;
        }
        answered += 1;
        let error = (subject.judge)(found, &answer);
        // NaN is a failure, too.
        if error <= limit + WRONG * doubt {
            errors.push(error);
            fraction = fraction.max((error - doubt) / tolerance.unwrap_or(1.0));
        } else {
            failures += 1;
        }
    }
    errors.sort_by(f64::total_cmp);
    let quantile = |fraction: f64| {
        let place = (fraction * errors.len() as f64).ceil() as usize;
        errors.get(place.saturating_sub(1)).copied().unwrap_or(f64::INFINITY)
    };
    Record {
        subject: subject.name,
        cases: subject.cases,
        method: method.to_owned(),
        ours: false,
        setting: setting.to_owned(),
        tolerance,
        count: solved.len(),
        failures,
        ns: 1e9 * seconds / f64::from(answered.max(1)),
        errors: [quantile(0.5), quantile(0.95), quantile(1.0)],
        fraction,
    }
}
