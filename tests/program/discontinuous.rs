//! Inputs that are legal and unlike what a sweep usually has: zeros with a sign, ends of ranges, axes that descend or repeat
//! values, neighbouring doubles.

use std::fs;
use std::path::Path;
use std::process::Command;

use polars::prelude::DataFrame;
use slipsweep::dataset::frame;
use slipsweep::sweep::Sweep;
use slipsweep::table::RunStats;

use crate::common::{numbers, read, run, sweep, words};

/// Every table with its axes but those of the material.
const TABLES: [(&str, &str); 9] = [
    ("gap", "t_f = [0.02, 0.04]\nalpha_2 = [-0.1, 0.1]\nalpha_3 = [-0.1, 0.1]\n"),
    ("best_cubic", "t_f = [0.02]\n"),
    ("optimal", "t_f = [0.02, 0.04]\n"),
    ("crossover", ""),
    ("shortcut", "t_f = [0.02]\nfamily = [\"step\", \"cubic\"]\ntau_ceiling = [1.5]\n"),
    ("stability", "k = [7.5e-3, 1.0]\nm = [1e-12, 1e-6]\n"),
    ("step_response", "k = [1.0]\nm = [1e-12, 1e-6]\n"),
    ("compliant", "t_f = [0.02]\nk = [1.0]\nm = [1e-12]\ndt = [0.0]\n"),
    ("regularised", "t_f = [0.02]\nk = [7.5e-3]\nm = [1e-12, 1e-6]\ndelta_t = [1e-3]\n"),
];

/// The axes that all tables have.
const COMMON: &str = "a = [0.03]\nb = [0.04, 0.02]\nv_i = [2.0, 3.0]\nv_f = [50.0, 100.0]\n";

fn table(folder: &Path, axes: &str, name: &str) -> (DataFrame, RunStats) {
    let out = folder.join("out");
    let _ = fs::remove_dir_all(&out);
    let outcome = run(&sweep(folder, axes, &format!("[tables.{name}]\n")), &out, 2);
    (read(&out, name), outcome.work)
}

/// `axes` with the list of each of its axes changed.
fn changed(axes: &str, change: impl Fn(&[&str]) -> String) -> String {
    let lines = axes.lines().map(|line| {
        let (name, list) = line.split_once(" = [").expect("is a list");
        let values: Vec<&str> = list.trim_end_matches(']').split(", ").collect();
        format!("{name} = [{}]\n", change(&values))
    });
    lines.collect()
}

#[test]
fn descending_axes_have_the_rows_of_ascending_ones() {
    let folder = tempfile::tempdir().expect("is writable");
    for (name, own) in TABLES {
        let axes = format!("{own}{COMMON}");
        let (up, _) = table(folder.path(), &axes, name);
        let reversed = |values: &[&str]| values.iter().rev().copied().collect::<Vec<_>>().join(", ");
        let (down, _) = table(folder.path(), &changed(&axes, reversed), name);
        assert!(up.height() >= 8, "{name}");
        assert!(up.equals_missing(&down.reverse()), "{name}");
    }
}

/// A velocity ceiling bounds the optimum of every table that has one, whether the spec names a law or not.
#[test]
fn regress_a_ceiling_without_a_law_bounds_the_optimum_of_every_table() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = "t_f = [0.02, 0.1]\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\nv_ceiling = [600.0, inf]\n";
    let plane = "alpha_2 = { linspace = [-0.12, 0.0, 2], unit = \"1/t_f\" }\nalpha_3 = { linspace = [-0.06, 0.0, 2], unit = \"1/t_f^2\" }\n";
    let optimal = numbers(&table(folder.path(), axes, "optimal").0, "work");
    assert!(optimal[0] > optimal[1] && optimal[2] > optimal[3], "{optimal:?}");
    let near = |one: Option<f64>, other: Option<f64>| {
        one.zip(other).is_some_and(|(one, other)| (one / other - 1.0).abs() < 1e-10)
    };
    let best = numbers(&table(folder.path(), axes, "best_cubic").0, "work_optimal");
    let all = numbers(&table(folder.path(), &format!("{axes}{plane}"), "gap").0, "work_optimal");
    assert_eq!((best.len(), all.len()), (optimal.len(), 4 * optimal.len()));
    for ((four, best), optimal) in all.chunks(4).zip(best).zip(optimal) {
        assert!(near(best, optimal) && four.iter().all(|work| near(*work, optimal)), "{four:?} {best:?} {optimal:?}");
    }
}

#[test]
fn regress_values_that_repeat_make_repeated_rows() {
    let folder = tempfile::tempdir().expect("is writable");
    let material = "a = 0.03\nb = 0.05\n";
    let (once, twice) =
        ("v_i = [2.0, 3.0]\nv_f = [50.0, 100.0]\n", "v_i = [2.0, 3.0, 2.0]\nv_f = [50.0, 50.0, 100.0, 50.0]\n");
    for (name, own) in TABLES {
        let (once, work) = table(folder.path(), &format!("{own}{material}{once}"), name);
        let (all, again) = table(folder.path(), &format!("{own}{material}{twice}"), name);
        // Optimal protocols are shared by all rows of a transition and duration.
        if matches!(name, "gap" | "optimal") {
            assert_eq!(work.optima, again.optima, "{name}");
        }
        assert_eq!(all.height(), 3 * once.height(), "{name}");
        for row in 0..all.height() {
            let (rest, v_i, v_f) = (row / 12, row / 4 % 3, row % 4);
            let same = 4 * rest + 2 * (v_i % 2) + usize::from(v_f == 2);
            assert!(all.slice(row as i64, 1).equals_missing(&once.slice(same as i64, 1)), "{name} {row}");
        }
    }
}

/// `-0` is 0, and another spelling of an existing value.
#[test]
fn regress_minus_zero_is_zero() {
    let folder = tempfile::tempdir().expect("is writable");
    for (name, own) in TABLES {
        let zero = |zero: &str| {
            let own = changed(own, |values| match values[0] {
                "-0.1" => format!("{zero}, 0.1"),
                _ => values.join(", "),
            });
            let own = own.replace("m = [1e-12", &format!("m = [{zero}")).replace("dt = [0.0", &format!("dt = [{zero}"));
            table(folder.path(), &format!("{own}a = 0.03\nb = [{zero}, 0.05]\nv_i = 3.0\nv_f = 100.0\n"), name)
        };
        let ((plus, work), (minus, again), (both, once)) = (zero("0.0"), zero("-0.0"), zero("0.0, -0.0"));
        assert!(plus.equals_missing(&minus), "{name}");
        assert_eq!(work, again, "{name}");
        assert!(both.height() > plus.height(), "{name}");
        if matches!(name, "gap" | "optimal") {
            assert_eq!(work.optima, once.optima, "{name}");
        }
        // Written as asked.
        let signs: Vec<bool> =
            numbers(&minus, "b").into_iter().map(|b| b.expect("is there").is_sign_negative()).collect();
        assert!(signs.contains(&true) && signs.contains(&false), "{name}");
    }
}

/// Both ends of every range and what lies near them, each alone and all at once: typed, finite, and no defect.
#[test]
fn regress_ends_of_ranges_are_solved() {
    let folder = tempfile::tempdir().expect("is writable");
    let ceilings = ("optimal", "t_f = [0.02, 0.04]\nv_ceiling = [300.0]\ntau_ceiling = [1.05]\n");
    for (name, own) in TABLES.into_iter().chain([ceilings]) {
        let mut defects = 0;
        for (axis, values) in [
            ("t_f", "[1e-20, 1e-10, 1e10, 1e20]"),
            ("a", "[1e-6, 1.0000000000000002e-6, 10.0]"),
            ("b", "[5e-324, 1e-300, 0.03, 0.030000000000000002, 10.0]"),
            ("v_i", "[1.0000000000000002, 1.0000000001, 99.99999999999999, 100.00000000000001, 1e12]"),
            ("v_f", "[1.0000000000000002, 2.9999999999999996, 3.0000000000000004, 1e12]"),
            ("k", "[1e-40, 1e40, inf]"),
            ("m", "[0.0, 1e-40, 1e-20]"),
            ("v_ceiling", "[1.0000000000000002, 100.00000000000001, 1e12, inf]"),
            ("tau_ceiling", "[1e-20, 1e20, inf]"),
        ] {
            let axes = format!("{own}a = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n");
            let line = |line: &str| line.split(" = ").next() == Some(axis);
            if !axes.lines().any(line) {
                continue;
            }
            let lines =
                axes.lines().map(|text| if line(text) { format!("{axis} = {values}\n") } else { format!("{text}\n") });
            let (rows, _) = table(folder.path(), &lines.collect::<String>(), name);
            defects += words(&rows, "status").iter().filter(|status| *status == "not_converged").count();
            for column in rows.columns().iter().filter(|column| column.dtype().is_float()) {
                let infinite = ["k", "v_ceiling", "tau_ceiling", "stiffness_ratio"].contains(&column.name().as_str());
                for value in numbers(&rows, column.name()).into_iter().flatten() {
                    assert!(value.is_finite() || infinite, "{name} {axis} {}: {value}", column.name());
                }
            }
        }
        // Most of these points lie outside the physical domain, where an optimum under ceilings need not converge.
        assert!(defects == 0 || own == ceilings.1, "{name}");
    }
}

/// What a stranger may send: neither memory nor words without bound.
#[test]
fn regress_what_is_too_large_is_refused() {
    let folder = tempfile::tempdir().expect("is writable");
    let path = folder.path().join("spec.toml");
    let fault = |spec: &str, points: &[u8]| {
        fs::write(&path, spec).expect("is writable");
        fs::write(folder.path().join("points.csv"), points).expect("is writable");
        let message = Sweep::load(&path).err().expect("is refused").to_string();
        assert!(message.len() < 4000, "{message}");
        message.lines().next().unwrap_or_default().replace(&path.display().to_string(), "spec.toml")
    };
    let spec = format!("name = \"test\"\n# {}\n", "-".repeat(1 << 22));
    assert_eq!(fault(&spec, b""), "spec.toml: too long");
    let key = "v".repeat(1 << 20);
    let unknown = fault(&format!("name = \"test\"\n[axes]\n{key} = 1\n[tables.optimal]\n"), b"");
    assert!(unknown.starts_with("spec.toml:3: axes.vvvv") && unknown.ends_with("vvvv..."), "{unknown}");
    let points = "name = \"test\"\npoints = \"points.csv\"\n[tables.stability]\n";
    assert!(fault(points, format!("{}\n1", "v".repeat(1 << 24)).as_bytes()).ends_with("a name of 16777216 characters"));
    assert!(
        fault(points, format!("a\n1{}", ",".repeat(1 << 24)).as_bytes())
            .ends_with("the number of values is 16777217, that of columns 1")
    );
    assert!(fault(points, b"a\x1b[2J\n1").contains("unknown axis `a\\u{1b}[2J`"));
    assert_eq!(fault(&"a.".repeat(1 << 20), b"").get(..14), Some("spec.toml:1: n"));
    assert_eq!(fault(&format!("name = {}", "[".repeat(1 << 20)), b"").get(..14), Some("spec.toml:1: n"));
}

/// Files of points cut anywhere or with any byte changed are points or a fault.
#[test]
fn regress_damaged_parquet_is_a_fault() {
    let folder = tempfile::tempdir().expect("is writable");
    let bad = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_specs/points_parquet_out_of_range.parquet");
    let whole = fs::read(bad).expect("is there");
    let text = "name = \"test\"\npoints = \"points.parquet\"\n[tables.stability]\n";
    let load = |bytes: &[u8]| {
        fs::write(folder.path().join("points.parquet"), bytes).expect("is writable");
        Sweep::parse(text, folder.path()).err().map(|error| error.to_string().len())
    };
    assert!(load(&whole).is_some());
    for place in 0..whole.len() {
        assert!(load(&whole[..place]).is_some_and(|length| length < 4000), "{place}");
        for mask in [0x01, 0x80, 0xff] {
            let mut bytes = whole.clone();
            bytes[place] ^= mask;
            assert!(load(&bytes).is_none_or(|length| length < 4000), "{place} {mask}");
        }
    }
}

/// A part with any byte changed, or cut anywhere: what was read, or a fault that names it.
#[test]
fn regress_damaged_parts_are_read_or_refused() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = "t_f = [0.02, 0.037]\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n";
    let spec = format!("name = \"test\"\n[axes]\n{axes}[tables.optimal]\n");
    fs::write(folder.path().join("spec.toml"), spec).expect("is writable");
    let run = |arguments: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
        program.args(arguments).current_dir(folder.path()).output().expect("runs")
    };
    assert!(run(&["run", "spec.toml"]).status.success());
    let part = folder.path().join("results/test/optimal/part-000000.parquet");
    let whole = fs::read(&part).expect("is there");
    let damaged = folder.path().join("damaged.parquet");
    let mut refused = 0;
    let mut read = |bytes: &[u8]| {
        fs::write(&damaged, bytes).expect("is writable");
        if let Err(error) = frame::read_all(&damaged) {
            let message = error.to_string();
            assert!(message.contains("damaged.parquet: ") && message.len() < 4000, "{message}");
            refused += 1;
        }
    };
    for place in 0..whole.len() {
        read(&whole[..place]);
        let mut bytes = whole.clone();
        bytes[place] ^= 0x81;
        read(&bytes);
    }
    assert!(refused > whole.len());

    fs::write(&part, &whole[..whole.len() / 2]).expect("is writable");
    for command in ["plot", "summary", "verify"] {
        let output = run(&[command, "results/test"]);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{command}: {message}");
        let why = "part-000000.parquet: the part is damaged: it is cut short or not Parquet";
        assert!(message.contains(why), "{command}: {message}");
    }
}
