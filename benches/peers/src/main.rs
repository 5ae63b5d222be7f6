//! Time against error of the stiff integrator and of libraries, on two responses to a step of the control velocity.
//!
//! `bash benches/peers/run`. The first argument, if given, is the driver of CVODE.

#![forbid(unsafe_code)]

mod case;
mod cvode;
mod ours;
mod peaks;
mod summary;
mod with_differential_equations;
mod with_diffsol;

use case::{Case, Method, PAPER, STICK_SLIP};
use cvode::Cvode;
use ours::{Radau, Switching};
use summary::Point;
use with_differential_equations::{Dop853, Radau5};
use with_diffsol::{Bdf, Esdirk34};

fn main() {
    let ours: Vec<Box<dyn Method>> = vec![Box::new(Switching), Box::new(Radau)];
    let mut libraries: Vec<Box<dyn Method>> = vec![
        Box::new(Bdf),
        Box::new(Esdirk34),
        Box::new(Radau5 { newton_tol: 0.01 }),
        Box::new(Radau5 { newton_tol: 0.0 }),
        Box::new(Dop853),
    ];
    libraries.extend(std::env::args_os().nth(1).map(|driver| Box::new(Cvode { driver }) as Box<dyn Method>));
    println!("### all runs\n");
    println!("| case | method | tolerance | ms | error of end | error of first peak | peaks |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let cases = [PAPER, STICK_SLIP];
    let measured: Vec<[Vec<Vec<Point>>; 2]> =
        cases.iter().map(|case| [&ours, &libraries].map(|methods| measure(case, methods))).collect();
    for (case, [ours, libraries]) in cases.iter().zip(&measured) {
        summary::print(case, ours, libraries);
    }
}

/// All tolerances of all methods, a table row each.
fn measure(case: &Case, methods: &[Box<dyn Method>]) -> Vec<Vec<Point>> {
    methods.iter().map(|method| (3..=13).filter_map(|digits| row(case, method.as_ref(), digits)).collect()).collect()
}

fn row(case: &Case, method: &dyn Method, digits: i32) -> Option<Point> {
    let tolerance = 10f64.powi(-digits);
    let start = format!("| {} | {} | 1e-{digits} |", case.name, method.name());
    let Some(measured) = method.measure(case, tolerance) else {
        println!("{start} gives up | | | |");
        return None;
    };
    let point = Point::new(case, &method.name(), &measured);
    let first_peak = measured.peaks.first.map_or(f64::NAN, |first| (first - case.first_peak).abs());
    let wrong = if point.right { "" } else { " (wrong)" };
    let (ms, error) = (1e3 * point.seconds, point.error);
    println!("{start} {ms:.3} | {error:.1e} | {first_peak:.1e} | {}{wrong} |", measured.peaks.count);
    Some(point)
}
