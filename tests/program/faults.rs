//! What a run makes of damage, strangers, limits and its own defects. The scripts in tests/faults go on where a process cannot test itself.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::common::{files, run, sweep, write_batch};
use crate::support::Random;
use slipsweep::dataset::{CheckDepth, Folder, Foreign, State};
use slipsweep::sweep::{Plan, Sweep};

const AXES: &str = "t_f = { linspace = [0.02, 0.049, 30] }\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\nalpha_2 = [0.0, 0.1]\n\
                    alpha_3 = { linspace = [0.0, 0.5, 5000], unit = \"1/t_f^2\" }\n";

fn slipsweep(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_slipsweep"));
    command.current_dir(folder);
    command
}

fn said(output: &Output) -> (Option<i32>, String) {
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// A file recomputed: writing over it would wait for the disk.
fn rewrite(path: &Path, bytes: &[u8]) {
    fs::remove_file(path).expect("is there");
    fs::write(path, bytes).expect("is writable");
}

fn part_of(sweep: &Sweep, out: &Path, look: CheckDepth) -> State {
    Folder::new(out, "test").state(&Plan::new(sweep).manifest(sweep), "optimal", 0, look)
}

#[test]
fn a_flipped_bit_is_found_wherever_it_is() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), AXES, "[tables.optimal]\n");
    run(&sweep, folder.path(), 1);
    let path = Folder::new(folder.path(), "test").part("optimal", 0);
    let good = fs::read(&path).expect("is there");
    let sound = part_of(&sweep, folder.path(), CheckDepth::Whole);
    assert!(matches!(&sound, State::There { statistics } if statistics.status[0] == 30), "{sound:?}");
    let mut random = Random(20);
    // The last bytes are the checksum, the schema, and what Parquet ends with.
    let inside = (0..1000).map(|_| random.below(good.len())).collect::<Vec<_>>();
    for byte in inside.into_iter().chain(good.len().saturating_sub(200)..good.len()) {
        let mut bad = good.clone();
        bad[byte] ^= 1 << random.below(8);
        rewrite(&path, &bad);
        let state = part_of(&sweep, folder.path(), CheckDepth::Whole);
        assert!(matches!(state, State::Damaged { .. }), "byte {byte} of {}: {state:?}", good.len());
        // A look at the footer may miss it, but neither fails nor takes part in it.
        let _ = part_of(&sweep, folder.path(), CheckDepth::Footer);
    }
}

#[test]
fn a_part_that_is_cut_is_found_by_any_look() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), AXES, "[tables.optimal]\n");
    run(&sweep, folder.path(), 1);
    let path = Folder::new(folder.path(), "test").part("optimal", 0);
    let good = fs::read(&path).expect("is there");
    for length in 0..good.len() {
        rewrite(&path, &good[..length]);
        for look in [CheckDepth::Footer, CheckDepth::Whole] {
            let state = part_of(&sweep, folder.path(), look);
            assert!(matches!(state, State::Damaged { .. }), "{length} of {}: {state:?}", good.len());
        }
    }
}

/// Files of points of several writers, without checksums: damage that goes unnoticed may be read, but never ends the process.
#[test]
fn damaged_points_are_read_or_refused() {
    let folder = tempfile::tempdir().expect("is writable");
    let path = folder.path().join("points.parquet");
    let spec = "name = \"points\"\npoints = \"points.parquet\"\n[tables.optimal]\n";
    let mut random = Random(20);
    let read = |bytes: &[u8]| {
        fs::write(&path, bytes).expect("is writable");
        Sweep::parse(spec, folder.path()).err().map(|error| error.to_string())
    };
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/points");
    for sample in fs::read_dir(samples).expect("is there") {
        let sample = sample.expect("is readable").path();
        let good = fs::read(&sample).expect("is there");
        for length in (0..good.len()).step_by(7) {
            let reported = read(&good[..length]).expect("is cut");
            assert!(reported.contains("cannot read "), "{}, {length}: {reported}", sample.display());
        }
        for _ in 0..300 {
            let mut bad = good.clone();
            let (at, length) = (random.below(good.len()), 1 << random.below(6));
            for byte in bad.iter_mut().skip(at).take(length) {
                *byte = if length == 1 { *byte ^ 1 << random.below(8) } else { random.below(256) as u8 };
            }
            if let Some(reported) = read(&bad) {
                assert!(reported.len() < 4096, "{}: {reported}", sample.display());
            }
        }
    }
}

#[test]
fn damaged_and_missing_parts_are_made_again() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), AXES, "[tables.gap]\n[tables.optimal]\n[tables.crossover]\n");
    run(&sweep, folder.path(), 2);
    let place = Folder::new(folder.path(), "test");
    let whole = files(place.path());
    let mut bytes = fs::read(place.part("gap", 0)).expect("is there");
    bytes[70_000] ^= 4;
    fs::write(place.part("gap", 0), &bytes).expect("is writable");
    fs::write(place.part("optimal", 0), "").expect("is writable");
    fs::remove_file(place.part("crossover", 0)).expect("is there");

    let output = slipsweep(folder.path()).args(["status", "test"]).output().expect("runs");
    assert_eq!(said(&output), (Some(2), "incomplete: 2 of 4 parts are present\n".to_owned()));
    let output = slipsweep(folder.path()).args(["status", "test", "--check"]).output().expect("runs");
    assert_eq!(said(&output), (Some(2), "incomplete: 1 of 4 parts are present\n".to_owned()));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("  test/gap/part-000000.parquet: its checksum does not match its bytes\n"), "{text}");
    assert!(text.contains("  test/optimal/part-000000.parquet: it is cut short or not Parquet: "), "{text}");

    let outcome = run(&sweep, folder.path(), 2);
    let done: Vec<_> = outcome.tables.iter().map(|table| (table.kept, table.made, table.damaged)).collect();
    assert_eq!(done, [(1, 1, 1), (0, 1, 1), (0, 1, 0)]);
    assert!(files(place.path()) == whole);
}

#[test]
fn a_damaged_part_is_reported_and_keeps_no_other_table_from_its_picture() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), AXES, "[tables.optimal]\n[tables.gap]\n");
    run(&sweep, folder.path(), 1);
    let path = Folder::new(folder.path(), "test").part("gap", 0);
    let good = fs::read(&path).expect("is there");
    let said_by = |arguments: &[&str]| said(&slipsweep(folder.path()).args(arguments).output().expect("runs"));
    let mut headless = good.clone();
    headless[4..60].fill(0xff);
    for (bad, cause) in
        [(&good[..good.len() / 2], "it is cut short or not Parquet"), (&headless, "its page header is damaged")]
    {
        rewrite(&path, bad);
        for command in ["plot", "report"] {
            let (code, reported) = said_by(&[command, "test"]);
            assert_eq!(code, Some(2), "{reported}");
            assert!(reported.contains("test/gap/part-000000.parquet: ") && reported.contains(cause), "{reported}");
            assert!(
                reported.contains("\n  help: `slipsweep run test` recomputes it and keeps all intact parts"),
                "{reported}"
            );
        }
        let picture = folder.path().join("test-optimal.svg");
        assert!(picture.is_file() && !folder.path().join("test-gap.svg").exists());
        fs::remove_file(picture).expect("is there");
        for question in [["head", "test", "gap"], ["query", "test", "SELECT sum(t_f) FROM gap"]] {
            let (code, reported) = said_by(&question);
            assert_eq!(code, Some(2), "{reported}");
            assert!(reported.contains("  help: ") && reported.contains("run"), "{reported}");
        }
    }
}

#[test]
fn foreign_parts_are_left_alone() {
    let folder = tempfile::tempdir().expect("is writable");
    let other = sweep(folder.path(), &AXES.replace("0.049", "0.048"), "[tables.optimal]\n");
    run(&other, &folder.path().join("other"), 1);
    let sweep = sweep(folder.path(), AXES, "[tables.optimal]\n[tables.crossover]\n");
    run(&sweep, folder.path(), 1);
    let path = Folder::new(folder.path(), "test").part("optimal", 0);
    fs::copy(Folder::new(&folder.path().join("other"), "test").part("optimal", 0), &path).expect("is writable");
    let foreign = fs::read(&path).expect("is there");

    let output = slipsweep(folder.path()).args(["run", "spec.toml", "--out", ".", "--quiet"]).output().expect("runs");
    let message = "error: ./test/optimal/part-000000.parquet: not a part of this dataset: it belongs to another place, sweep, version or numerics \
                   revision\n  help: move the file away; `slipsweep run` then computes the part and keeps all others\n";
    assert_eq!(said(&output), (Some(1), message.to_owned()));
    assert_eq!(fs::read(&path).expect("is there"), foreign);
    let output = slipsweep(folder.path()).args(["status", "test"]).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("to finish the dataset:\n  mv test/optimal/part-000000.parquet test/optimal/part-000000.parquet.foreign\n  slipsweep run test\n"), "{text}");

    // A Parquet file of another program is foreign, not damaged.
    let x: arrow_array::ArrayRef = std::sync::Arc::new(arrow_array::Float64Array::from(vec![1.0]));
    write_batch(&path, &arrow_array::RecordBatch::try_from_iter([("x", x)]).expect("is a table"));
    for look in [CheckDepth::Footer, CheckDepth::Whole] {
        let state = part_of(&sweep, folder.path(), look);
        assert_eq!(state, State::Foreign { why: Foreign::OtherProgram });
    }
}

#[test]
fn a_panic_names_the_part_and_the_other_parts_are_kept() {
    let folder = tempfile::tempdir().expect("is writable");
    sweep(folder.path(), AXES, "[tables.gap]\n[tables.optimal]\n");
    let whole =
        slipsweep(folder.path()).args(["run", "spec.toml", "--out", "whole", "--quiet"]).output().expect("runs");
    assert_eq!(said(&whole), (Some(0), String::new()));
    let whole = files(&folder.path().join("whole/test"));
    for (row, reported, others) in [
        (270_007, "gap: part 1, rows 262144 to 299999, panicked: requested by SLIPSWEEP_PANIC\n", 0),
        (17, "gap: part 0, rows 0 to 262143, panicked: requested by SLIPSWEEP_PANIC\n", 1),
    ] {
        let out = row.to_string();
        let mut command = slipsweep(folder.path());
        command.args(["run", "spec.toml", "--out", &out, "--threads", "2"]).env("SLIPSWEEP_PANIC", &out);
        let (code, message) = said(&command.output().expect("runs"));
        assert_eq!(code, Some(2), "{message}");
        assert!(message.contains(&format!("error: {reported}")), "{message}");
        assert!(message.contains("help: this is a bug in slipsweep: please report it; "), "{message}");
        assert_eq!(message.contains("; 1 more parts panicked"), others == 1, "{message}");
        // The usual message, which has the line of the source, comes once for each part.
        assert_eq!(message.matches("panicked at src/table/failpoint.rs:").count(), 1 + others, "{message}");
        let there = files(&folder.path().join(&out).join("test"));
        let lost: Vec<&PathBuf> = whole.keys().filter(|path| !there.contains_key(*path)).collect();
        assert_eq!(lost.len(), 1 + others, "{lost:?}");
        assert!(there.iter().all(|(path, bytes)| whole.get(path) == Some(bytes)));
        let again = slipsweep(folder.path()).args(["run", "spec.toml", "--out", &out, "--quiet"]).output();
        assert_eq!(said(&again.expect("runs")), (Some(0), String::new()));
        assert!(files(&folder.path().join(&out).join("test")) == whole);
    }
}

#[test]
fn regress_what_is_no_file_is_never_waited_for() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), AXES, "[tables.optimal]\n");
    run(&sweep, folder.path(), 1);
    let path = Folder::new(folder.path(), "test").part("optimal", 0);
    let good = fs::read(&path).expect("is there");
    let stranger = |place: &Path, found: &str| {
        let expected = State::Foreign { why: Foreign::NotAFile(found.to_owned()) };
        for look in [CheckDepth::Footer, CheckDepth::Whole] {
            assert_eq!(part_of(&sweep, folder.path(), look), expected, "{}", place.display());
        }
    };
    fs::remove_file(&path).expect("is there");
    fs::create_dir(&path).expect("is writable");
    stranger(&path, "a folder, not a file");
    let status = said(&slipsweep(folder.path()).args(["status", "test"]).output().expect("runs"));
    assert_eq!(status.0, Some(2), "{status:?}");
    fs::remove_dir(&path).expect("is there");
    #[cfg(unix)]
    {
        let pipe = |path: &Path| {
            let made = Command::new("mkfifo").arg(path).status().expect("runs");
            assert!(made.success());
            let path = path.to_owned();
            // A reader would get nothing, and not wait for ever.
            std::thread::spawn(move || drop(fs::OpenOptions::new().write(true).open(path)));
        };
        pipe(&path);
        stranger(&path, "a device or a named pipe, not a file");
        // One that bears the name of a temporary file of this machine is not opened either.
        let machine = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let odd = path.with_file_name(format!(".part-000000.parquet.1-0@{}.tmp", machine.trim()));
        pipe(&odd);
        let code = slipsweep(folder.path()).args(["run", "spec.toml", "--out", "."]).output().expect("runs");
        assert_eq!(said(&code).0, Some(1), "{code:?}");
        assert!(odd.exists());
        fs::remove_file(&odd).expect("is there");
        fs::remove_file(&path).expect("is there");
        std::os::unix::fs::symlink("/dev/zero", &path).expect("is writable");
        stranger(&path, "a device or a named pipe, not a file");
        fs::remove_file(&path).expect("is there");
        let manifest = folder.path().join("test/manifest.json");
        let reported = fs::read(&manifest).expect("is there");
        fs::remove_file(&manifest).expect("is there");
        pipe(&manifest);
        let code = slipsweep(folder.path()).args(["status", "test"]).output().expect("runs");
        assert_eq!(said(&code), (Some(2), format!("error: {UNREADABLE}")));
        fs::remove_file(&manifest).expect("is there");
        fs::write(&manifest, reported).expect("is writable");
    }
    assert_eq!(part_of(&sweep, folder.path(), CheckDepth::Whole), State::Missing);
    run(&sweep, folder.path(), 1);
    assert_eq!(fs::read(&path).expect("is there"), good);
}

/// The report of `status` on a manifest that is not a file.
const UNREADABLE: &str = "test/manifest.json: cannot read: a device or a named pipe, not a file\n  help: solve this and run the same command again\n";
