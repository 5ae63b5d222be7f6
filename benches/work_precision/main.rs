//! Time against true error, ours compared with what one would use instead, in one run on one core.
//!
//! `cargo bench --bench work_precision` takes some minutes, prints tables in Markdown, and writes
//! `results/work_precision.parquet` and a picture for each subject. `-- --quick` takes seconds, writes nothing, and gives
//! the other methods a few cases only. Both fail if an answer of ours is missing or is further off than was asked.
//!
//! The true answers are those of `tests/reference`. What is not ours is written as a user would, with libraries for
//! integrals and differential equations; `benches/peers` has further ones. `-- --peers FILE` adds those that
//! `benches/peers/python` ran.

#![allow(missing_docs, reason = "a program")]

#[path = "../support/cases.rs"]
#[allow(dead_code, reason = "shared by several benchmarks")]
mod cases;
mod crossover;
mod integrate;
mod landscape;
mod measure;
mod optimal;
mod peers;
mod picture;
mod report;
mod response;
mod shortcut;
mod stability;
mod store;
#[path = "../support/mod.rs"]
mod support;

use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use cases::reference;
use measure::{Extent, Record, Subject, measure};
use peers::Peers;

/// Tolerances of a full run.
const TOLERANCES: [f64; 11] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13];

/// Those of a quick one.
const FEW: [f64; 4] = [1e-3, 1e-6, 1e-10, 1e-13];

const FULL: Extent = Extent { budget: Duration::from_millis(500), stride: 1, once: false };
const QUICK: Extent = Extent { budget: Duration::ZERO, stride: 16, once: true };

fn main() -> ExitCode {
    // cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args().collect();
    let quick = arguments.iter().any(|argument| argument == "--quick");
    let file = arguments.iter().position(|argument| argument == "--peers").map(|place| arguments.get(place + 1));
    let peers = match file.map(|file| Peers::read(Path::new(file.map_or("", String::as_str)))).transpose() {
        Ok(peers) => peers,
        Err(error) => {
            eprintln!("--peers: {error}");
            return ExitCode::FAILURE;
        }
    };
    let (tolerances, extent): (&[f64], _) = if quick { (&FEW, QUICK) } else { (&TOLERANCES, FULL) };
    let ln = 1e9 * support::one_ln();
    println!("### Machine\n\n{}; one scalar `f64::ln` takes {ln:.2} ns.\n", machine());
    let mut measured: Vec<(Subject, Vec<Record>)> = Vec::new();
    let mut last = "";
    for subject in subjects(tolerances) {
        let name = words(subject.name);
        if subject.name != last {
            last = subject.name;
            println!("### {name}\n\nError: {}.\n", subject.error);
            if !quick && is_drawn(&subject) {
                println!("![Time against error: {name}](work_precision_{last}.svg)\n");
            }
        }
        let mut own: Vec<Record> = Vec::new();
        for method in &subject.methods {
            own.extend(method.settings.iter().map(|setting| measure(&subject, method, setting, extent)));
        }
        own.extend(peers.iter().flat_map(|peers| peers.records(&subject)));
        println!("Cases: {}.\n\n{}", subject.cases, report::table(&own.iter().collect::<Vec<_>>(), ln));
        measured.push((subject, own));
    }
    if !quick && let Err(error) = keep(&measured, ln) {
        eprintln!("results/work_precision: {error}");
        return ExitCode::from(2);
    }
    let faults = faults(measured.iter().flat_map(|(_, records)| records));
    faults.iter().for_each(|fault| eprintln!("{fault}"));
    if faults.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Where and of what this is measured.
fn machine() -> String {
    let processor = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    let count = std::thread::available_parallelism().map_or(1, usize::from);
    let profile = if cfg!(debug_assertions) { "dev" } else { "release" };
    let processor = processor.unwrap_or_else(|| std::env::consts::ARCH.into());
    format!("{processor}, {count} processors; slipsweep {}, {profile} profile", env!("CARGO_PKG_VERSION"))
}

fn subjects(tolerances: &[f64]) -> Vec<Subject> {
    let mut subjects = Vec::from(optimal::subjects(tolerances));
    subjects.push(optimal::under_ceilings(tolerances));
    subjects.extend(landscape::subjects(tolerances));
    subjects.push(crossover::subject(tolerances));
    subjects.extend(shortcut::subjects(tolerances));
    subjects.push(response::subject(tolerances));
    subjects.push(stability::subject());
    subjects
}

/// Whether a picture shows more than a table: some method has settings.
fn is_drawn(subject: &Subject) -> bool {
    subject.methods.iter().any(|method| method.settings.len() > 1)
}

/// The name of a subject, for people.
fn words(name: &str) -> &str {
    match name {
        "optimal" => "Optimal solve",
        "ceilings" => "Optimal solve under ceilings",
        "landscape" => "Landscape point",
        "crossover" => "Crossover time",
        "bounded_friction" => "Shortcut of bounded friction",
        "step" => "Step response",
        "stability" => "Linear stability",
        other => other,
    }
}

/// Where ours does not do what was asked.
fn faults<'a>(records: impl Iterator<Item = &'a Record>) -> Vec<String> {
    let ours = records.filter(|record| record.ours && (record.failures > 0 || record.fraction > 1.0));
    ours.map(|record| {
        let Record { cases, count, failures, setting, fraction, .. } = record;
        let name = words(record.subject);
        format!(
            "{name}, {cases}, at {setting}: {failures} of {count} cases failed, and the greatest error is {fraction:.2} \
             times what was asked"
        )
    })
    .collect()
}

/// Writes the table and the pictures.
fn keep(measured: &[(Subject, Vec<Record>)], ln: f64) -> Result<(), Box<dyn std::error::Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("results");
    std::fs::create_dir_all(&folder)?;
    let all: Vec<&Record> = measured.iter().flat_map(|(_, records)| records).collect();
    store::write(&folder.join("work_precision.parquet"), &all, ln)?;
    for same in measured.chunk_by(|(p, _), (q, _)| p.name == q.name) {
        let Some((subject, _)) = same.first().filter(|(subject, _)| is_drawn(subject)) else { continue };
        let own: Vec<&Record> = same.iter().flat_map(|(_, records)| records).collect();
        if let Some(svg) = picture::draw(words(subject.name), subject.error, &own) {
            std::fs::write(folder.join(format!("work_precision_{}.svg", subject.name)), svg)?;
        }
    }
    Ok(())
}
