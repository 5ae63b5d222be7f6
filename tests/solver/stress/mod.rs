//! Random points over the legal domain of every table, crowded where double precision breaks and where one regime ends:
//! invariants that hold at each of them, and no row that is not converged.
//!
//! `SLIPSWEEP_STRESS` is the number of points of each table, fewer in proportion of open loops, which are simulated;
//! without it they are as many as `SLIPSWEEP_TESTS` allows. Point number `i` of a table is the same whatever that
//! number: `SLIPSWEEP_STRESS_POINT=i` runs it alone. `SLIPSWEEP_STRESS_PRINT=1` prints the points instead. `tests/nightly/run`
//! runs them by the million.

mod best_cubic;
mod ceilings;
mod compliant;
pub mod crossover;
mod landscape;
mod laws;
mod optimal;
pub mod random;
mod reference;
mod regularised;
mod shortcut;
mod stability;
mod step_response;

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use crate::extent::quick_or_long;
use random::Random;
use slipsweep::protocol::Status;

/// Points of a table in continuous integration.
const POINTS: u64 = 10_000;

/// How many times fewer points a quick test has: `cargo test --release --test solver stress` then takes 14 s of processor time.
const QUICK: u64 = 25;

/// Failures that a report names.
const NAMED: usize = 8;

/// Points that a thread takes at a time.
const BATCH: u64 = 64;

/// What is found at one point: a status and, for each invariant, its violation in units of what is allowed.
#[derive(Default)]
struct Row {
    status: Option<Status>,
    checks: Vec<(&'static str, f64)>,
}

impl Row {
    /// Notes the status, which must not be that of a defect.
    fn status(&mut self, status: Status) {
        self.status = Some(status);
        self.fact("converged", status != Status::NotConverged);
    }

    /// What must be.
    fn fact(&mut self, invariant: &'static str, holds: bool) {
        self.checks.push((invariant, if holds { 0.0 } else { f64::INFINITY }));
    }

    /// What must be at most `allowed`; NaN is not.
    fn at_most(&mut self, invariant: &'static str, violation: f64, allowed: f64) {
        let fraction = if violation <= 0.0 { 0.0 } else { violation / allowed };
        self.checks.push((invariant, if fraction.is_nan() { f64::INFINITY } else { fraction }));
    }

    /// Two numbers that must agree to a fraction of the first.
    fn agree(&mut self, invariant: &'static str, found: f64, expected: f64, allowed: f64) {
        let distance = if found == expected { 0.0 } else { (found - expected).abs() };
        self.at_most(invariant, distance, allowed * expected.abs());
    }
}

/// How one invariant fares over all points.
#[derive(Default)]
struct Fare {
    points: u64,
    failures: u64,
    worst: f64,
    at: u64,
}

/// How a table fares.
#[derive(Default)]
struct Tally {
    statuses: BTreeMap<&'static str, u64>,
    fares: BTreeMap<&'static str, Fare>,
    failed: BTreeMap<u64, String>,
}

impl Tally {
    fn add(&mut self, index: u64, point: &dyn Debug, row: Row) {
        *self.statuses.entry(row.status.map_or("panicked", Status::name)).or_default() += 1;
        let mut failed = String::new();
        for (invariant, fraction) in row.checks {
            let fare = self.fares.entry(invariant).or_default();
            fare.points += 1;
            if fraction > 1.0 {
                fare.failures += 1;
                failed += &format!(" {invariant} {fraction:.1e};");
            }
            // The first of equals, whatever the order in which threads come.
            if fraction > fare.worst || (fraction == fare.worst && index < fare.at) {
                (fare.worst, fare.at) = (fraction, index);
            }
        }
        if !failed.is_empty() {
            self.failed.insert(index, format!("{index}:{failed} {point:?}"));
        }
    }
}

/// Draws the points of a table, checks each, prints how they fare, and fails with the points at which an invariant is
/// violated by more than is allowed.
fn sample<P: Debug>(
    table: &str,
    default: u64,
    draw: impl Fn(&mut Random) -> P + Sync,
    check: impl Fn(&P, &mut Row) + Sync,
) {
    let number = |name: &str| std::env::var(name).ok().map(|text| text.parse::<u64>().expect("is a number of points"));
    let alone = number("SLIPSWEEP_STRESS_POINT");
    let points =
        number("SLIPSWEEP_STRESS").map_or(quick_or_long(default / QUICK, default), |points| points * default / POINTS);
    let indices = alone.map_or(0..points, |index| index..index + 1);
    if number("SLIPSWEEP_STRESS_PRINT").is_some() {
        indices.for_each(|index| println!("{table} {index}: {:?}", draw(&mut Random::of(table, index))));
        return;
    }
    let (started, next, tally) = (Instant::now(), AtomicU64::new(indices.start), Mutex::new(Tally::default()));
    let work = || {
        loop {
            let first = next.fetch_add(BATCH, Ordering::Relaxed);
            if first >= indices.end {
                break;
            }
            for index in first..(first + BATCH).min(indices.end) {
                let point = draw(&mut Random::of(table, index));
                let mut row = Row::default();
                let outcome = catch_unwind(AssertUnwindSafe(|| check(&point, &mut row)));
                row.fact("no panic", outcome.is_ok());
                tally.lock().expect("no thread panics with it").add(index, &point, row);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    let tally = tally.into_inner().expect("no thread panics with it");
    let points = indices.end - indices.start;
    println!("{table}: {points} points, {:.1} s, rows {:?}", started.elapsed().as_secs_f64(), tally.statuses);
    for (invariant, Fare { points, failures, worst, at }) in &tally.fares {
        println!("  {invariant}: {points} points, worst {worst:.2e} of what is allowed at {at}, {failures} failures");
    }
    let named: Vec<&str> = tally.failed.values().map(String::as_str).take(NAMED).collect();
    assert!(named.is_empty(), "{table}: {} points fail, such as\n{}", tally.failed.len(), named.join("\n"));
}
