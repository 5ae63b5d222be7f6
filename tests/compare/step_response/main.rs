//! Step responses of 0.1.0 (`before`) and of this version (`after`) at random points of the physical domain.

use rayon::prelude::*;

/// Accuracy of both versions.
const RTOL: f64 = 1e-6;

/// Accuracy of the judge: this version's, which 0.1.0 checks where both agree.
const JUDGE_RTOL: f64 = 1e-9;

/// Every such point is judged, whether or not the versions agree.
const JUDGED: usize = 100;

/// Points between two reports.
const CHUNK: usize = 50_000;

/// Names of the compared numbers.
const NUMBERS: [&str; 4] = ["v_peak", "v_trough", "settling_time", "period"];

/// Outcomes, in the order of [`Answer::outcome`].
const OUTCOMES: [&str; 4] = ["settled", "limit_cycle", "undecided", "infinite"];
const UNDECIDED: usize = 2;

/// A response.
#[derive(Clone, Copy)]
struct Answer {
    outcome: usize,
    /// NaN where it has none.
    numbers: [f64; 4],
}

/// The answer of a step in the types of either version.
macro_rules! respond {
    ($step:expr, $rtol:expr) => {
        match $step.respond($rtol).1 {
            None => Answer { outcome: 3, numbers: [f64::NAN; 4] },
            Some(response) => Answer {
                outcome: response.outcome as usize,
                numbers: [
                    response.v_peak,
                    response.v_trough,
                    response.settling_time.unwrap_or(f64::NAN),
                    response.cycle.map_or(f64::NAN, |cycle| cycle.period),
                ],
            },
        }
    };
}

/// A point of the physical domain, in units of `v_0`, `l` and `mu_0 sigma`.
#[derive(Debug, Clone, Copy)]
struct Point {
    a: f64,
    b: f64,
    v_i: f64,
    k: f64,
    m: f64,
}

/// Final velocity of every step. Chosen: only `m v_f^2` and `v_i/v_f` matter.
const V_F: f64 = 1e6;

impl Point {
    /// Logarithmically uniform; one in eleven without mass. As in `benches/step_response.rs`.
    fn all(count: usize) -> Vec<Point> {
        let mut state: u64 = 7;
        let mut uniform = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut random = |least: f64, greatest: f64| least * (greatest / least).powf(uniform());
        (0..count)
            .map(|i| {
                let a = random(1e-3, 0.3);
                let b = (a * random(0.05, 20.0)).min(0.5);
                let m = if i % 11 == 0 { 0.0 } else { a * random(1e-8, 1e4) / 1e12 };
                Point { a, b, v_i: 1e6 * random(1e-6, 1e6), k: a * random(1e-4, 1e5), m }
            })
            .collect()
    }

    fn before(&self, rtol: f64) -> Answer {
        use before::model::{Law, Transition};
        let transition = Transition { law: Law { a: self.a, b: self.b }, v_i: self.v_i, v_f: V_F };
        respond!(before::stability::response::Step { transition, k: self.k, m: self.m }, rtol)
    }

    fn after(&self, rtol: f64) -> Answer {
        use after::model::{Law, StateLaw, Transition};
        use after::stability::step_response::VelocityStep;
        let transition = Transition { law: Law { a: self.a, b: self.b }, v_i: self.v_i, v_f: V_F };
        respond!(VelocityStep { state_law: StateLaw::Ageing, transition, k: self.k, m: self.m }, rtol)
    }
}

impl Answer {
    /// Relative differences of the numbers that both have.
    fn differences(&self, other: &Answer) -> [f64; 4] {
        std::array::from_fn(|i| {
            let (a, b) = (self.numbers[i], other.numbers[i]);
            if a == b || a.is_nan() || b.is_nan() { 0.0 } else { (a / b - 1.0).abs() }
        })
    }

    fn greatest_difference(&self, other: &Answer) -> f64 {
        self.differences(other).into_iter().fold(0.0, f64::max)
    }
}

/// Processor time of this thread, s.
fn thread_time() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a valid place for the result.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// The outcomes, time and errors of one version.
#[derive(Clone, Default)]
struct Totals {
    outcomes: [usize; 4],
    seconds: f64,
    /// Largest relative errors against the judge, and how many points are off by more than 2 `RTOL`.
    errors: [f64; 4],
    off: usize,
    /// Points with another outcome than the judge's.
    wrong_outcomes: usize,
}

impl Totals {
    fn plus(mut self, other: &Totals) -> Totals {
        for i in 0..4 {
            self.outcomes[i] += other.outcomes[i];
            self.errors[i] = self.errors[i].max(other.errors[i]);
        }
        self.seconds += other.seconds;
        self.off += other.off;
        self.wrong_outcomes += other.wrong_outcomes;
        self
    }

    fn judge(&mut self, point: &Point, name: &str, found: &Answer, judge: &Answer) {
        if found.outcome == UNDECIDED || judge.outcome == UNDECIDED {
            return;
        }
        if found.outcome != judge.outcome {
            self.wrong_outcomes += 1;
            println!("{name}: {} for {}: {point:?}", OUTCOMES[found.outcome], OUTCOMES[judge.outcome]);
            return;
        }
        let errors = found.differences(judge);
        if errors.iter().any(|&error| error > 2.0 * RTOL) {
            self.off += 1;
            if name == "after" {
                println!("{name}: off by {errors:?}: {point:?}");
            }
        }
        for (largest, error) in self.errors.iter_mut().zip(errors) {
            *largest = largest.max(error);
        }
    }
}

/// The totals of both versions.
#[derive(Clone, Default)]
struct Both {
    before: Totals,
    after: Totals,
    judged: usize,
    undecided_judges: usize,
    /// Largest difference of the versions at points that are not judged.
    largest_agreed: f64,
}

impl Both {
    /// Both versions at a point; the versions are compared, and judged where they differ or `must_judge`.
    fn at(point: &Point, must_judge: bool) -> Both {
        let mut both = Both::default();
        let start = thread_time();
        let before = point.before(RTOL);
        let middle = thread_time();
        let after = point.after(RTOL);
        (both.before.seconds, both.after.seconds) = (middle - start, thread_time() - middle);
        both.before.outcomes[before.outcome] += 1;
        both.after.outcomes[after.outcome] += 1;
        let difference = before.greatest_difference(&after);
        if before.outcome == after.outcome && difference <= 2.0 * RTOL && !must_judge {
            both.largest_agreed = difference;
            return both;
        }
        let judge = point.after(JUDGE_RTOL);
        both.judged = 1;
        both.undecided_judges = usize::from(judge.outcome == UNDECIDED);
        both.before.judge(point, "before", &before, &judge);
        both.after.judge(point, "after", &after, &judge);
        both
    }

    fn plus(self, other: &Both) -> Both {
        Both {
            before: self.before.plus(&other.before),
            after: self.after.plus(&other.after),
            judged: self.judged + other.judged,
            undecided_judges: self.undecided_judges + other.undecided_judges,
            largest_agreed: self.largest_agreed.max(other.largest_agreed),
        }
    }

    fn print(&self, count: usize) {
        println!("{count} random points of the physical domain at {RTOL:e}; {} judged at {JUDGE_RTOL:e}", self.judged);
        println!(
            "  ({} of them undecided there); the others agree to {:.1e}",
            self.undecided_judges, self.largest_agreed
        );
        for (name, totals) in [("0.1.0", &self.before), ("now", &self.after)] {
            let outcomes: Vec<String> =
                OUTCOMES.iter().zip(totals.outcomes).map(|(name, n)| format!("{n} {name}")).collect();
            println!("{name}: {}, {:.2} ms of a core each", outcomes.join(", "), 1e3 * totals.seconds / count as f64);
            println!(
                "  {} outcomes wrong, {} points off by more than 2 rtol; largest errors:",
                totals.wrong_outcomes, totals.off
            );
            for (name, error) in NUMBERS.iter().zip(totals.errors) {
                println!("    {name:13} {error:.1e}");
            }
        }
    }
}

fn main() {
    let count: usize = std::env::args().nth(1).and_then(|count| count.parse().ok()).expect("the number of points");
    let points = Point::all(count);
    let (mut all, mut done) = (Both::default(), 0);
    for chunk in points.chunks(CHUNK) {
        let found = chunk.par_iter().enumerate().map(|(i, point)| Both::at(point, i % JUDGED == 0));
        all = all.plus(&found.reduce(Both::default, |one, other| one.plus(&other)));
        done += chunk.len();
        all.print(done);
    }
    if all.after.wrong_outcomes + all.after.off > 0 {
        std::process::exit(1);
    }
}
