//! Which dataset a run may write to, and which parts its readers accept: manifests, specs and builds compared, damage found.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Barrier;

use crate::common::{MATERIAL, files, run, sweep};
use crate::extent::quick_or_long;
use parquet::file::metadata::{ParquetMetaData, ParquetMetaDataReader};
use sha2::Digest;
use slipsweep::dataset::{Concurrency, DatasetError, Folder, Footer, Manifest, frame};
use slipsweep::sweep::{self, Plan, RunError, Shard, Sweep, TableOutcome};
use slipsweep::table::Signal;

const TIMES: &str = "t_f = [0.02, 0.037]\n";

/// Two parts of `gap`.
const TWO_PARTS: &str = "t_f = [0.02, 0.037]\nalpha_2 = { linspace = [-0.5, 0.5, 400], unit = \"1/t_f\" }\n\
                         alpha_3 = { linspace = [-0.5, 0.5, 400], unit = \"1/t_f^2\" }\n";

fn refusal(sweep: &Sweep, out: &Path) -> String {
    let refused = sweep::run(sweep, &Folder::new(out, "test"), 1, &Signal::default());
    refused.expect_err("is refused").to_string()
}

fn metadata(part: &Path) -> ParquetMetaData {
    let file = fs::File::open(part).expect("is there");
    ParquetMetaDataReader::new().parse_and_finish(&file).expect("is Parquet")
}

fn manifest(out: &Path) -> Manifest {
    Folder::new(out, "test").manifest().expect("is readable").expect("is there")
}

#[test]
fn a_table_that_is_added_is_computed_into_the_same_dataset() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = format!("{TIMES}{MATERIAL}");
    run(&sweep(folder.path(), &axes, "[tables.optimal]\n"), folder.path(), 1);
    let before = files(&folder.path().join("test"));
    // What `optimal` does not depend on may change with it.
    let wider = format!("{axes}alpha_2 = [0.0, 0.1]\nalpha_3 = 0.0\n");
    let more = sweep(folder.path(), &wider, "[tables.gap]\nrtol = 1e-12\n[tables.optimal]\n");
    let outcome = run(&more, folder.path(), 1);
    let done = |kept, made, rows| TableOutcome { kept, made, damaged: 0, rows };
    assert_eq!(outcome.tables, [done(0, 1, 4), done(1, 0, 0)]);
    let after = files(&folder.path().join("test"));
    let part = Path::new("optimal/part-000000.parquet");
    assert_eq!(after[part], before[part]);
    let names = |manifest: &Manifest| manifest.tables.iter().map(|table| table.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&manifest(folder.path())), ["gap", "optimal"]);

    // Fewer tables than the dataset has leave it alone.
    let outcome = run(&sweep(folder.path(), &axes, "[tables.optimal]\n"), folder.path(), 1);
    assert_eq!(outcome.tables, [done(1, 0, 0)]);
    assert_eq!(files(&folder.path().join("test")), after);

    let other = sweep(folder.path(), &axes, "[tables.optimal]\n[tables.crossover]\n");
    assert_eq!(
        refusal(&other, folder.path()),
        format!(
            "{}: the spec and the dataset each have a table that the other lacks\n  in the spec: optimal, crossover\n  in the dataset: gap, optimal\n  \
             help: add the tables of the dataset to the spec, which keeps its rows and computes yours; or change `name` in the spec, or write elsewhere \
             with --out DIR, or remove the dataset",
            folder.path().join("test").display()
        )
    );
    assert_eq!(files(&folder.path().join("test")), after);
}

#[test]
fn a_table_depends_on_no_other_table() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = format!("{TIMES}{MATERIAL}alpha_2 = 0.1\nalpha_3 = 0.0\n");
    run(&sweep(folder.path(), &axes, "[tables.gap]\nrtol = 1e-6\n"), &folder.path().join("alone"), 1);
    let both = sweep(folder.path(), &axes, "[tables.optimal]\n[tables.gap]\nrtol = 1e-6\n");
    run(&both, &folder.path().join("both"), 1);
    let rows = |out: &str| {
        let part = Folder::new(&folder.path().join(out), "test").part("gap", 0);
        frame::read_all(&part).expect("reads")
    };
    assert_eq!(rows("alone"), rows("both"));
}

#[test]
fn specs_are_compared_by_meaning_and_the_first_difference_is_named() {
    let folder = tempfile::tempdir().expect("is writable");
    let text = |axes: &str, rest: &str| format!("name = \"test\"\n{rest}[axes]\n{axes}");
    let load = |text: &str| {
        let path = folder.path().join("spec.toml");
        fs::write(&path, text).expect("is writable");
        Sweep::load(&path).expect("is legal")
    };
    let first = text(&format!("t_f = 1\n{MATERIAL}[tables.optimal]\n"), "");
    run(&load(&first), folder.path(), 1);
    let before = files(&folder.path().join("test"));
    for same in [
        format!("# comment\ndescription = \"x\"\n{first}# end\n"),
        first.replace("t_f = 1", "t_f   =   1.0 # unit"),
        first.replace("a = 0.03\nb = 0.05\n", "b = 0.05\na = 0.03\n"),
        text(&format!("t_f = [1]\n{MATERIAL}"), "[tables]\noptimal = {}\n[accuracy]\nrtol = 0.1e-9\n"),
    ] {
        assert_eq!(run(&load(&same), folder.path(), 1).tables[0].kept, 1, "{same}");
        assert_eq!(files(&folder.path().join("test")), before, "{same}");
    }
    for (other, expected, found) in [
        (first.replace("t_f = 1", "# longer\n\nt_f = 1.5"), "axes.t_f = 1.5 (line 5)", "axes.t_f = 1"),
        (
            first.replace("t_f = 1", "t_f = { linspace = [1,  2, 3] }"),
            "axes.t_f = { linspace = [1, 2, 3] } (line 3)",
            "axes.t_f = 1",
        ),
        (
            first.replace("[axes]", "[model]\nvelocity_bound = false\n[axes]"),
            "model.velocity_bound = false (line 3)",
            "model.velocity_bound = true",
        ),
        (
            first.replace("[axes]", "[accuracy]\nrtol = 1e-9\n[axes]"),
            "accuracy.rtol = 1e-9 (line 3)",
            "accuracy.rtol = 1e-10",
        ),
        (
            first.replace("[tables.optimal]", "[tables.optimal]\ncolumns = [\"work\"]"),
            "tables.optimal.columns = [\"work\"] (line 9)",
            "tables.optimal.columns = work, v_start, v_end, time_at_floor, time_at_v_ceiling, time_at_tau_ceiling, hamiltonian, theta_max,...",
        ),
        (first.replace("t_f = 1", "t_f = 1\nv_ceiling = 3e2"), "axes.v_ceiling = 3e2 (line 4)", "no axes.v_ceiling"),
        (
            first.replace("name = \"test\"", "name = \"test\"\nwhere = \"t_f > a\""),
            "where = \"t_f > a\" (line 2)",
            "where = none",
        ),
    ] {
        let reported = refusal(&load(&other), folder.path());
        let message = format!(
            "{}: holds a dataset of another spec\n  in the spec: {expected}\n  in the dataset: {found}\n  help: change `name` in the spec, or write \
             elsewhere with --out DIR, or remove the dataset",
            folder.path().join("test").display()
        );
        assert_eq!(reported, message);
        assert_eq!(files(&folder.path().join("test")), before);
    }

    // The order of axes that vary is that of the rows.
    let [here, there] = ["v_f = [50, 100]\nt_f = [1, 2]", "t_f = [1, 2]\nv_f = [50, 100]"]
        .map(|axes| load(&text(&format!("{axes}\na = 0.03\nb = 0.05\nv_i = 3\n[tables.optimal]\n"), "")));
    let out = folder.path().join("order");
    run(&there, &out, 1);
    let reported = refusal(&here, &out);
    assert!(
        reported.contains("\n  in the spec: axes = v_f, t_f (line 2)\n  in the dataset: axes = t_f, v_f\n"),
        "{reported}"
    );

    // An axis that only one of them has.
    let with_law = load(&first.replace("t_f = 1", "t_f = 1\nlaw = \"ageing\""));
    let out = folder.path().join("law");
    run(&with_law, &out, 1);
    let reported = refusal(&load(&first), &out);
    assert!(reported.contains("\n  in the spec: no axes.law\n  in the dataset: axes.law = \"ageing\"\n"), "{reported}");
    let reported = refusal(&with_law, folder.path());
    assert!(
        reported.contains("\n  in the spec: axes.law = \"ageing\" (line 4)\n  in the dataset: no axes.law\n"),
        "{reported}"
    );
}

#[test]
fn other_points_in_the_same_file_are_another_spec() {
    let folder = tempfile::tempdir().expect("is writable");
    let path = folder.path().join("spec.toml");
    let points = folder.path().join("points.csv");
    fs::write(&path, format!("name = \"test\"\npoints = \"points.csv\"\n[axes]\n{MATERIAL}[tables.optimal]\n"))
        .expect("is writable");
    fs::write(&points, "t_f\n0.02\n").expect("is writable");
    run(&Sweep::load(&path).expect("is legal"), folder.path(), 1);
    fs::write(&points, "t_f\n0.03\n").expect("is writable");
    let reported = refusal(&Sweep::load(&path).expect("is legal"), folder.path());
    assert!(
        reported
            .contains("\n  in the spec: the file of points (line 2)\n  in the dataset: other contents of this file\n"),
        "{reported}"
    );
}

#[test]
fn another_build_is_refused() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), &format!("{TIMES}{MATERIAL}"), "[tables.optimal]\n");
    let ours = Plan::new(&sweep).manifest(&sweep);
    for what in ["version", "numerics revision"] {
        let mut other = ours.clone();
        let theirs = if what == "version" { &mut other.build.version } else { &mut other.build.revision };
        let expected = format!("{theirs}, of this program");
        *theirs = "other".to_owned();
        let out = folder.path().join(what);
        Folder::new(&out, "test").open(&other, Concurrency::Alone).expect("is writable");
        let before = files(&out);
        let reported = refusal(&sweep, &out);
        let message =
            format!("holds a dataset of another {what}\n  expected: {expected}\n  found: other\n  help: change `name`");
        assert!(reported.contains(&message), "{reported}");
        assert_eq!(files(&out), before);
    }
}

/// Of runs of different specs under one name, started together, one wins, whose dataset is complete and its own.
#[test]
fn two_specs_that_start_together_never_mix() {
    let folder = tempfile::tempdir().expect("is writable");
    let specs = [0.02, 0.03]
        .map(|t_f| sweep(folder.path(), &format!("t_f = {t_f}\n{MATERIAL}"), "[tables.optimal]\n[tables.crossover]\n"));
    let alone = specs.each_ref().map(|sweep| {
        let out = folder.path().join(sweep.grid.blocks[0].factors[0].axes[0].values.at(0).to_string());
        run(sweep, &out, 1);
        files(&out)
    });
    for trial in 0..60 {
        let out = folder.path().join(format!("trial-{trial}"));
        let barrier = Barrier::new(2);
        // With and without the help of a lock.
        let start = |sweep: &Sweep| {
            let place = Folder::new(&out, "test");
            barrier.wait();
            match trial % 2 {
                0 => sweep::run(sweep, &place, 1, &Signal::default()),
                _ => sweep::run_shard(sweep, &place, Shard::WHOLE, 1, &Signal::default()),
            }
        };
        let ended = std::thread::scope(|scope| {
            let threads = specs.each_ref().map(|sweep| scope.spawn(|| start(sweep)));
            threads.map(|thread| thread.join().expect("does not panic"))
        });
        let winners: Vec<usize> = (0..2).filter(|&index| ended[index].is_ok()).collect();
        assert_eq!(winners.len(), 1, "{trial}: {ended:?}");
        assert!(files(&out) == alone[winners[0]], "{trial}: {ended:?}");
    }
}

#[test]
fn a_run_whose_dataset_is_taken_away_stops_there() {
    let folder = tempfile::tempdir().expect("is writable");
    let [first, second] = [0.02, 0.03].map(|t_f| {
        let sweep = sweep(folder.path(), &format!("t_f = {t_f}\n{MATERIAL}"), "[tables.optimal]\n");
        Plan::new(&sweep).manifest(&sweep)
    });
    let place = Folder::new(folder.path(), "test");
    let session = place.open(&first, Concurrency::Alone).expect("is writable");
    session.write_part("optimal", 0, b"whole").expect("is writable");
    fs::remove_dir_all(place.path()).expect("is there");
    let other = place.open(&second, Concurrency::Alone).expect("is another folder");
    let stopped = session.write_part("optimal", 0, b"mixed").expect_err("is another dataset");
    assert_eq!(
        stopped.to_string(),
        format!(
            "{}: manifest.json was replaced by another one during this run, which stopped\n  help: run the same command \
             again; it keeps finished parts",
            place.path().display()
        )
    );
    assert!(!place.part("optimal", 0).exists());
    other.check().expect("is its own");
    fs::remove_file(place.manifest_path()).expect("is there");
    assert!(matches!(other.check(), Err(DatasetError::Taken { what: "manifest.json was removed", .. })));
}

#[test]
fn the_second_run_on_a_dataset_states_that_the_first_one_is_at_work() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), &format!("{TIMES}{MATERIAL}"), "[tables.optimal]\n");
    let planned = Plan::new(&sweep).manifest(&sweep);
    let place = Folder::new(folder.path(), "test");
    let open = |company| place.open(&planned, company);
    let first = open(Concurrency::Alone).expect("is free");
    for company in [Concurrency::Alone, Concurrency::Shards] {
        let reported = open(company).expect_err("is taken").to_string();
        assert!(
            reported.starts_with(&format!("{}: another run is writing this dataset\n  help: ", place.path().display())),
            "{reported}"
        );
    }
    let status =
        Command::new(env!("CARGO_BIN_EXE_slipsweep")).arg("status").arg(place.path()).output().expect("starts");
    let shown = String::from_utf8_lossy(&status.stdout);
    assert!(shown.contains("a run is writing this dataset\n"), "{shown}");
    assert!(!shown.contains("to finish the dataset:"), "{shown}");
    drop(first);
    assert!(!place.is_busy());
    let shards =
        [open(Concurrency::Shards).expect("is free"), open(Concurrency::Shards).expect("shards run side by side")];
    assert!(!place.is_busy());
    assert!(matches!(open(Concurrency::Alone), Err(DatasetError::Busy { .. })));
    drop(shards);
    open(Concurrency::Alone).expect("is free");
}

#[test]
fn every_flipped_bit_of_a_manifest_is_noticed_and_the_parts_make_up_for_it() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), &format!("{TIMES}{MATERIAL}"), "[tables.optimal]\n[tables.crossover]\n");
    run(&sweep, folder.path(), 1);
    let place = Folder::new(folder.path(), "test");
    let whole = files(place.path());
    let good = fs::read(place.manifest_path()).expect("is there");
    let sound = manifest(folder.path());
    assert_eq!(sound.rebuilt, None);
    for bit in (0..8 * good.len()).step_by(quick_or_long(7, 1)) {
        let mut bad = good.clone();
        bad[bit / 8] ^= 1 << (bit % 8);
        fs::write(place.manifest_path(), bad).expect("is writable");
        let found = manifest(folder.path());
        assert!(found.rebuilt.as_ref().is_some_and(|why| why.starts_with("damaged: ")), "bit {bit}: {found:?}");
        assert_eq!(Manifest { rebuilt: None, ..found }, sound, "bit {bit}");
    }
    // A run writes it again, and only a run.
    run(&sweep, folder.path(), 1);
    assert!(files(place.path()) == whole);

    // Where no part is there, nobody knows; the spec does.
    fs::remove_dir_all(place.path().join("optimal")).expect("is there");
    fs::remove_dir_all(place.path().join("crossover")).expect("is there");
    fs::write(place.manifest_path(), &good[1..]).expect("is writable");
    assert!(matches!(place.manifest(), Err(DatasetError::Manifest { .. })));
    run(&sweep, folder.path(), 1);
    assert!(files(place.path()) == whole);
}

/// A manifest with a forged checksum is detected by the parts.
#[test]
fn a_manifest_that_contradicts_its_parts_is_refused() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), &format!("{TWO_PARTS}{MATERIAL}"), "[tables.gap]\n");
    run(&sweep, folder.path(), 2);
    let place = Folder::new(folder.path(), "test");
    let text = fs::read_to_string(place.manifest_path()).expect("is there");
    let (body, _) = text.split_once(",\n  \"sha256\"").expect("has a checksum");
    let body = body.replace("\"parts\": 2", "\"parts\": 1");
    let checksum: String =
        sha2::Sha256::digest(format!("{body}\n}}")).iter().map(|byte| format!("{byte:02x}")).collect();
    fs::write(place.manifest_path(), format!("{body},\n  \"sha256\": \"{checksum}\"\n}}\n")).expect("is writable");
    let found = manifest(folder.path());
    assert_eq!((found.tables[0].parts, &found.rebuilt), (1, &None));
    let refused = place.verified(&found, &found.tables[0]).expect_err("is refused");
    assert!(matches!(refused, DatasetError::ForeignPart { .. }), "{refused}");
    // A run corrects it.
    run(&sweep, folder.path(), 2);
    assert_eq!(fs::read_to_string(place.manifest_path()).expect("is there"), text);
}

#[test]
fn parts_of_another_spec_are_refused_by_readers() {
    let folder = tempfile::tempdir().expect("is writable");
    let other = sweep(folder.path(), &format!("t_f = [0.02, 0.03]\n{MATERIAL}"), "[tables.optimal]\n");
    run(&other, &folder.path().join("other"), 1);
    let sweep = sweep(folder.path(), &format!("{TIMES}{MATERIAL}"), "[tables.optimal]\n");
    run(&sweep, folder.path(), 1);
    let place = Folder::new(folder.path(), "test");
    let manifest = manifest(folder.path());
    assert_eq!(place.verified(&manifest, &manifest.tables[0]).expect("are sound").1, 0);
    fs::copy(Folder::new(&folder.path().join("other"), "test").part("optimal", 0), place.part("optimal", 0))
        .expect("is writable");
    let refused = place.verified(&manifest, &manifest.tables[0]).expect_err("is refused");
    assert!(matches!(refused, DatasetError::ForeignPart { .. }), "{refused}");
}

/// A reader of a whole table finds every flipped bit, or reads what was written.
#[test]
fn no_flipped_bit_of_a_part_is_read() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = format!("t_f = {{ linspace = [0.02, 0.049, 30] }}\n{MATERIAL}");
    let sweep = sweep(folder.path(), &axes, "[tables.optimal]\n");
    run(&sweep, folder.path(), 1);
    let place = Folder::new(folder.path(), "test");
    let manifest = manifest(folder.path());
    let path = place.part("optimal", 0);
    let good = fs::read(&path).expect("is there");
    let sound = frame::read_all(&path).expect("reads");
    let pages = metadata(&path);
    let pages: i64 = pages.row_group(0).columns().iter().map(|column| column.compressed_size()).sum();
    let mut harmless = 0;
    // All bits, or one of each byte of the pages and of every eighth one of the footer.
    let end = 4 + pages as usize;
    let some = (0..end).chain((end..good.len()).step_by(8)).map(|byte| 8 * byte + byte * 5 % 8).collect();
    for bit in quick_or_long(some, (0..8 * good.len()).collect::<Vec<usize>>()) {
        let mut bad = good.clone();
        bad[bit / 8] ^= 1 << (bit % 8);
        fs::write(&path, bad).expect("is writable");
        match place.verified(&manifest, &manifest.tables[0]) {
            Err(DatasetError::DamagedPart { .. }) => continue,
            opened => assert!(opened.is_ok_and(|(_, missing)| missing == 0), "bit {bit}"),
        }
        if let Ok(read) = frame::read_all(&path) {
            assert_eq!(read, sound, "bit {bit} of byte {}", bit / 8);
            harmless += 1;
        }
    }
    // Those of the first four bytes, and of the checksum of the file, which readers do not look at.
    assert!(harmless <= quick_or_long(1, 8) * (4 + 64), "{harmless}");
}

#[test]
fn parts_carry_the_hash_of_their_table_and_a_long_spec_is_in_the_manifest_alone() {
    let folder = tempfile::tempdir().expect("is writable");
    let path = folder.path().join("spec.toml");
    let mut footers = Vec::new();
    for comment in [10, 1 << 17] {
        let text = format!("# {}\nname = \"test\"\n[axes]\n{TIMES}{MATERIAL}[tables.optimal]\n", "x".repeat(comment));
        fs::write(&path, &text).expect("is writable");
        let sweep = Sweep::load(&path).expect("is legal");
        let out = folder.path().join(comment.to_string());
        run(&sweep, &out, 1);
        let manifest = manifest(&out);
        assert_eq!((&manifest.spec, manifest.tables[0].hash.len()), (&text, 64));
        let place = Folder::new(&out, "test");
        let metadata = metadata(&place.part("optimal", 0));
        let entries = metadata.file_metadata().key_value_metadata().expect("is there");
        let footer = Footer::from_entries(entries).expect("is sound");
        assert_eq!(footer.planned(), manifest.table("optimal"));
        let size = fs::metadata(place.part("optimal", 0)).expect("is there").len();
        footers.push((!footer.manifest.spec.is_empty(), size < 1 << 15));
        // A lost manifest comes back with the spec.
        let whole = files(&out);
        fs::remove_file(place.manifest_path()).expect("is there");
        run(&sweep, &out, 1);
        assert!(files(&out) == whole);
    }
    assert_eq!(footers, [(true, true), (false, true)]);
}

#[test]
fn a_refusal_leaves_no_folder_behind() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), &format!("{TIMES}{MATERIAL}"), "[tables.optimal]\n");
    let place = folder.path().join("test");
    fs::create_dir(&place).expect("is writable");
    fs::write(place.join("notes.txt"), "mine").expect("is writable");
    let refused = sweep::run(&sweep, &Folder::new(folder.path(), "test"), 1, &Signal::default());
    assert!(matches!(refused, Err(RunError::Dataset(DatasetError::Occupied { .. }))), "{refused:?}");
    assert_eq!(files(&place).len(), 1);
}
