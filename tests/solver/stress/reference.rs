//! The first points of the sample against arithmetic of 80 digits: `tests/reference/generate_stress.py`.

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::optimal::{crossover, shortest_time, solve};
use slipsweep::protocol::{SolverStats, Status};
use slipsweep::stability::SteadySliding;

use super::crossover::columns;
use super::random::EVERY_TIME;
use crate::reference::{Row, table};

const RTOLS: [f64; 3] = [1e-6, 1e-10, 1e-13];

fn transition(row: &Row) -> Transition {
    let law = Law { a: row.number("a"), b: row.number("b") };
    Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") }
}

/// Asserts that a column is as good as `allowed`, relative.
fn close(row: &Row, column: &str, found: f64, allowed: f64) {
    let expected = row.number(column);
    let error = if found == expected { 0.0 } else { (found - expected).abs() / expected.abs() };
    assert!(error <= allowed, "{column}: {found:e} is off by {error:.1e} > {allowed:.1e} in {row:?}");
}

#[test]
fn reference_shortcuts_of_the_sample() {
    let rows = table("stress_gap");
    assert!(rows.len() >= 190, "{} rows", rows.len());
    for row in &rows {
        for rtol in RTOLS {
            let (mut work, mut v_min, mut status) = ([f64::NAN], [f64::NAN], [Status::NotConverged]);
            let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
            let landscape = Landscape::new(&transition(row), row.number("t_f"), rtol);
            let _: SolverStats = landscape.evaluate(&[row.number("a_2")], &[row.number("a_3")], out);
            assert_eq!(status[0].name(), row.text("status"), "{row:?}");
            if status[0] != Status::Infeasible {
                close(row, "work", work[0], rtol + 64.0 * f64::EPSILON);
                close(row, "v_min", v_min[0], rtol + 8.0 * f64::EPSILON);
            }
        }
    }
}

#[test]
fn reference_optima_of_the_sample() {
    let rows = table("stress_optimal");
    assert!(rows.len() >= 60, "{} rows", rows.len());
    for row in &rows {
        let (transition, t_f, bounded) = (transition(row), row.number("t_f"), row.text("bounded") == "1");
        // Beyond the least time t_f is known to its rounding, and ends of paths to that over a.
        let least = shortest_time(&transition, bounded).expect("is in the domain");
        let time = f64::EPSILON * t_f / (t_f - least);
        let end = |column: &str| (time + 4.0 * f64::EPSILON * row.number(column).ln().abs()) / transition.law.a;
        for rtol in RTOLS {
            let solved = solve(&transition, t_f, bounded, rtol);
            let value = solved.value.unwrap_or_else(|| panic!("{:?} in {row:?}", solved.status));
            assert!(matches!(solved.status, Status::Ok | Status::BelowBound), "{:?} in {row:?}", solved.status);
            let within = |doubt: f64| 2.0 * rtol + 8.0 * f64::EPSILON + 4.0 * doubt;
            // Near t_cross it is `speed_up` as well as `slow_down`.
            let crosses = (row.number("v_start") / transition.v_i - 1.0).abs() <= within(end("v_start"));
            assert!(crosses || value.strategy.name() == row.text("strategy"), "{} in {row:?}", value.strategy.name());
            close(row, "work", value.work, within(time));
            close(row, "v_start", value.v_start, within(end("v_start")));
            close(row, "v_end", value.v_end, within(end("v_end")));
            close(row, "theta_max", value.theta_max, within(time));
            // It vanishes at the cheapest time: a rounding of t_f moves it by that fraction of W/t_f.
            let small = row.number("work").abs() / (t_f * row.number("hamiltonian").abs());
            close(row, "hamiltonian", value.hamiltonian, within(time + f64::EPSILON * small));
            let hold = (value.time_at_floor - row.number("time_at_floor")).abs();
            assert!(
                hold <= within(time) * t_f,
                "time_at_floor: {} is off by {hold:.1e} in {row:?}",
                value.time_at_floor
            );
        }
    }
}

#[test]
fn reference_special_times_of_the_sample() {
    let rows = table("stress_crossover");
    assert!(rows.len() >= 50, "{} rows", rows.len());
    for row in &rows {
        for rtol in RTOLS {
            let (status, found, _) = crossover::solve(&transition(row), true, rtol, EVERY_TIME);
            assert_eq!(status, Status::Ok, "{row:?}");
            for (column, found) in columns(&found) {
                assert_eq!(found.is_some(), row.optional(column).is_some(), "{column} in {row:?}");
                if let Some(found) = found {
                    close(row, column, found, 2.0 * rtol + 16.0 * f64::EPSILON);
                }
            }
        }
    }
}

#[test]
fn reference_eigenvalues_of_the_sample() {
    let rows = table("stress_stability");
    assert!(rows.len() >= 150, "{} rows", rows.len());
    for row in &rows {
        let law = Law { a: row.number("a"), b: row.number("b") };
        let sliding = SteadySliding::new(law, row.number("k"), row.number("m"), row.number("v"));
        let found = sliding.eigenvalues().expect("is elastic");
        close(row, "growth_rate", found.growth_rate, 64.0 * f64::EPSILON);
        close(row, "frequency", found.frequency, 64.0 * f64::EPSILON);
        close(row, "decay_rate", found.decay_rate.expect("has mass"), 64.0 * f64::EPSILON);
    }
}
