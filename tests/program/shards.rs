//! Sweeps in shards: the bytes of one process; status and its advice.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::common::{files, run, sweep};
use slipsweep::dataset::{Concurrency, Folder};
use slipsweep::sweep::{self, Plan, Shard, TableOutcome, shards_with};
use slipsweep::table::Signal;

/// 31 parts of `best_cubic`, `optimal`, `gap` and `crossover` of very different cost.
const AXES: &str = "t_f = { geomspace = [0.001, 10.0, 400] }\na = 0.03\nb = [0.04, 0.05]\nv_i = 3.0\nv_f = 100.0\n\
                    alpha_2 = { linspace = [-0.5, 0.5, 40], unit = \"1/t_f\" }\n\
                    alpha_3 = { linspace = [-0.5, 0.5, 40], unit = \"1/t_f^2\" }\n";
const TABLES: &str = "[tables.crossover]\n[tables.gap]\ncolumns = [\"v_min\", \"gap\"]\n[tables.optimal]\n";

fn slipsweep(folder: &Path, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_slipsweep");
    Command::new(program).current_dir(folder).env_remove("PATH").args(arguments).output().expect("runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn any_number_of_shards_gives_the_bytes_of_one_process() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), AXES, TABLES);
    let whole = folder.path().join("whole");
    run(&sweep, &whole, 2);
    let whole = files(&whole);
    for count in [2, 3, 5, 9] {
        let out = folder.path().join(count.to_string());
        let place = Folder::new(&out, "test");
        // Two of them at a time, the last one twice.
        std::thread::scope(|scope| {
            for first in 0..2 {
                let (sweep, place) = (&sweep, &place);
                scope.spawn(move || {
                    for index in (first..count).step_by(2).chain([count - 1]) {
                        let shard = Shard::new(index, count).expect("exists");
                        sweep::run_shard(sweep, place, shard, 1, &Signal::default()).expect("finishes");
                    }
                });
            }
        });
        assert!(files(&out) == whole, "{count}");
    }
}

#[test]
fn a_shard_makes_its_parts_and_solves_what_they_need() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), AXES, TABLES);
    let plan = Plan::new(&sweep);
    assert_eq!(plan.tables.iter().map(|table| table.parts).collect::<Vec<_>>(), [1, 5, 1]);
    let count = 4;
    let mut made = [0; 3];
    let place = Folder::new(folder.path(), "test");
    for index in 0..count {
        let shard = Shard::new(index, count).expect("exists");
        let outcome = sweep::run_shard(&sweep, &place, shard, 1, &Signal::default()).expect("finishes");
        let parts = shard.parts(&sweep, &plan).expect("are few");
        for (sum, (done, parts)) in made.iter_mut().zip(outcome.tables.iter().zip(&parts)) {
            let parts = parts.iter().map(|range| range.end - range.start).sum::<u64>();
            assert_eq!(*done, TableOutcome { kept: 0, made: parts, damaged: 0, rows: done.rows });
            *sum += parts;
        }
        let rows = |table: usize| outcome.tables[table].rows;
        // 1,600 rows of `gap` share an optimum, of which the borders of a part cut one each.
        assert!(outcome.work.optima <= rows(2) + rows(1) / 1600 + 2 * parts[1].len() as u64, "{index}");
        assert!(outcome.work.optima < plan.optima || rows(2) > 0, "{index}");
    }
    assert_eq!(made, [1, 5, 1]);
}

#[test]
fn every_part_is_in_one_shard_of_any_number() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), AXES, TABLES);
    let plan = Plan::new(&sweep);
    for count in (1..40).chain([100, 1000]) {
        let mut owners = vec![Vec::new(); 7];
        for index in 0..count {
            let parts = Shard::new(index, count).expect("exists").parts(&sweep, &plan).expect("are few");
            for (first, parts) in [0, 1, 6].into_iter().zip(parts) {
                parts.into_iter().flatten().for_each(|part| owners[first + part as usize].push(index));
            }
        }
        assert!(owners.iter().all(|owners| owners.len() == 1), "{count}: {owners:?}");
        let lacking = shards_with(&sweep, &plan, count, |table, part| (table, part) == (1, 3));
        assert_eq!(lacking.as_ref(), Ok(&owners[4]), "{count}");
    }
}

#[test]
fn status_lists_parts_and_the_command_for_the_missing_ones() {
    let folder = tempfile::tempdir().expect("is writable");
    sweep(folder.path(), AXES, TABLES);
    let say = |arguments: &[&str]| {
        let output = slipsweep(folder.path(), arguments);
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (code, _, error) = say(&["status", "results/test"]);
    assert_eq!(code, Some(1));
    assert_eq!(
        error,
        "error: results/test: there is no such file or folder\n  expected: the folder of a dataset, such as results/NAME\n  \
         help: check the path\n"
    );
    let (code, said, error) = say(&["run", "spec.toml", "--shard", "1/4"]);
    // A busy machine may have lines of progress.
    assert!(code == Some(0) && error.lines().all(|line| line.ends_with(" left")), "{said} {error}");
    assert!(said.contains(" in shard 1 of 4\n"), "{said}");

    // The script that would make the shards stands in the folder of the dataset folder.
    let (code, said, _) = say(&["shards", "spec.toml", "--engine", "slurm", "--shards", "4", "--minutes", "0"]);
    assert_eq!(code, Some(0));
    let script = folder.path().join("results/test.slurm.sh");
    assert!(said.contains(&format!("\n  sbatch {}\n", script.display())), "{said}");
    assert!(
        said.ends_with(&format!("\n  slipsweep status {}\n", folder.path().join("results/test").display())),
        "{said}"
    );

    let (code, said, error) = say(&["status", "results/test"]);
    assert_eq!(code, Some(2));
    assert!(error.starts_with("incomplete: ") && error.ends_with(" of 7 parts are present\n"), "{error}");
    assert!(
        said.contains(
            "to finish the dataset:\n  slipsweep run results/test\nor as tasks, 3 of 4 shards:\n  sbatch --array=0,2-3 "
        ),
        "{said}"
    );

    let (code, ..) = say(&["run", "results/test", "--quiet"]);
    assert_eq!(code, Some(0));
    let (code, said, error) = say(&["status", "results/test"]);
    assert_eq!((code, error.as_str()), (Some(0), ""));
    assert!(said.contains("\n  optimal    1      1        0        0        0        800 of 800: 800 ok\n"), "{said}");
    assert!(said.ends_with("\ncomplete\n"), "{said}");
    let (code, said, _) = say(&["status", "results/test", "--check"]);
    assert_eq!((code, said.ends_with("\ncomplete; all checksums match\n")), (Some(0), true), "{said}");
}

#[test]
fn the_manifest_follows_from_any_part() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), AXES, TABLES);
    run(&sweep, folder.path(), 2);
    let dataset = folder.path().join("test");
    let whole = files(&dataset);
    fs::remove_file(dataset.join("manifest.json")).expect("is there");
    fs::remove_file(dataset.join("gap/part-000002.parquet")).expect("is there");
    let output = slipsweep(folder.path(), &["status", "test"]);
    assert_eq!(output.status.code(), Some(2));
    let said = text(&output.stdout);
    assert!(said.contains("manifest.json is missing"), "{said}");
    assert!(said.contains("missing parts:\n  gap: 2\n"), "{said}");
    assert_eq!(slipsweep(folder.path(), &["run", "test", "--quiet"]).status.code(), Some(0));
    assert!(files(&dataset) == whole);
    // Nor can another spec take over a dataset that lost it.
    fs::remove_file(dataset.join("manifest.json")).expect("is there");
    let other = crate::common::sweep(folder.path(), &AXES.replace("v_i = 3.0", "v_i = 2.0"), "[tables.optimal]\n");
    let refused = sweep::run(&other, &Folder::new(folder.path(), "test"), 1, &Signal::default());
    let refused = refused.expect_err("is refused").to_string();
    assert!(refused.contains("holds a dataset of another spec"), "{refused}");
}

#[test]
fn job_scripts_survive_the_paths_of_their_users() {
    let folder = tempfile::tempdir().expect("is writable");
    let place = folder.path().join("Größe & 'Reibung' $HOME");
    fs::create_dir(&place).expect("is writable");
    sweep(&place, AXES, TABLES);
    for (engine, variable) in [("slurm", "SLURM_ARRAY_TASK_ID"), ("hyperqueue", "HQ_TASK_ID")] {
        let arguments = ["shards", "spec.toml", "--engine", engine, "--shards", "3", "--minutes", "0", "--out", "a b"];
        let output = slipsweep(&place, &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let script = place.join(format!("a b/test.{engine}.sh"));
        for index in 0..3 {
            let task =
                Command::new("/bin/bash").arg(&script).current_dir("/").env(variable, index.to_string()).output();
            let task = task.expect("runs");
            assert_eq!(task.status.code(), Some(0), "{}", text(&task.stderr));
        }
        let output = slipsweep(&place, &["status", "a b/test"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stdout));
        fs::remove_dir_all(place.join("a b/test")).expect("is there");
    }
}

#[test]
fn tasks_that_would_have_too_little_to_do_are_not_made() {
    let folder = tempfile::tempdir().expect("is writable");
    sweep(folder.path(), AXES, TABLES);
    let shards = |arguments: &[&str]| {
        let output = slipsweep(folder.path(), &[&["shards", "spec.toml", "--engine", "slurm"], arguments].concat());
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (_, said, _) = shards(&["--shards", "100"]);
    assert!(said.contains("\n1 task of about "), "{said}");
    let reason = "\nfewer than the 100 requested: more of them would have less than 5 minutes of work each\n";
    assert!(said.contains(reason), "{said}");
    let (_, said, _) = shards(&["--shards", "100", "--minutes", "0"]);
    assert!(said.contains("\n7 tasks of about "), "{said}");
    assert!(said.contains("\nfewer than the 100 requested: the sweep has only so many parts\n"), "{said}");
    let (code, _, error) = shards(&["--shards", "3", "--minutes", "x"]);
    assert_eq!(code, Some(1));
    assert!(error.contains("expected a number from 0 to 1000000000"), "{error}");
    let output = slipsweep(folder.path(), &["run", "spec.toml", "--shard", "4/4"]);
    assert_eq!(output.status.code(), Some(1));
    let message = "no shard 4 of 4: shards are numbered from 0 to 3";
    assert!(text(&output.stderr).contains(message), "{}", text(&output.stderr));
}

#[test]
fn a_job_script_is_written_whole_or_not_at_all() {
    let folder = tempfile::tempdir().expect("is writable");
    sweep(folder.path(), AXES, TABLES);
    let shards = |limit: &str| {
        let line =
            format!("ulimit -f {limit}; exec \"$0\" shards spec.toml --engine slurm --shards 3 --minutes 0 --out .");
        let mut bash = Command::new("bash");
        bash.current_dir(folder.path()).args(["-c", &line, env!("CARGO_BIN_EXE_slipsweep")]).output().expect("runs")
    };
    let left = || files(folder.path()).into_keys().collect::<Vec<_>>();
    let output = shards("0");
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("test.slurm.sh: cannot write: File too large"), "{}", text(&output.stderr));
    assert_eq!(left(), [Path::new("spec.toml")]);
    assert_eq!(shards("unlimited").status.code(), Some(0));
    let script = fs::read(folder.path().join("test.slurm.sh")).expect("is there");
    assert_eq!(shards("0").status.code(), Some(2));
    assert!(fs::read(folder.path().join("test.slurm.sh")).is_ok_and(|still| still == script));
}

/// Rows beyond any disk, of which a spec can ask.
const ENDLESS: &str = "t_f = { linspace = [0.001, 2.0, 4294967295] }\na = 0.03\nb = { linspace = [0.03, 0.07, 4294967297] }\n\
                       v_i = 3.0\nv_f = 100.0\n";

#[test]
fn regress_parts_that_are_missing_cost_nothing() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), ENDLESS, "[tables.optimal]\n");
    let plan = Plan::new(&sweep);
    let [table] = plan.tables.as_slice() else { panic!("one table") };
    assert_eq!((table.rows, table.rows_of(table.parts - 1).end), (u64::MAX, u64::MAX));
    Folder::new(&folder.path().join("results"), "test")
        .open(&plan.manifest(&sweep), Concurrency::Alone)
        .expect("is writable");
    let output = slipsweep(folder.path(), &["status", "results/test"]);
    assert_eq!(output.status.code(), Some(2));
    let last = table.parts - 1;
    assert!(
        text(&output.stdout).contains(&format!("missing parts:\n  optimal: 0-{last}\n")),
        "{}",
        text(&output.stdout)
    );
    let output = slipsweep(folder.path(), &["summary", "results/test"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
}

#[test]
fn regress_more_parts_than_can_be_shared_out_are_refused() {
    let folder = tempfile::tempdir().expect("is writable");
    sweep(folder.path(), ENDLESS, "[tables.optimal]\n");
    for arguments in
        [&["run", "spec.toml", "--shard", "0/2"][..], &["shards", "spec.toml", "--engine", "slurm", "--shards", "4"]]
    {
        let output = slipsweep(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(1));
        assert_eq!(
            text(&output.stderr),
            "error: 281474976710656 parts are too many for shards\n  expected: at most 8388608\n  help: divide an axis over several \
             specs\n"
        );
    }
    assert!(!folder.path().join("results").exists());
}

#[test]
fn a_shard_without_parts_states_it() {
    let folder = tempfile::tempdir().expect("is writable");
    sweep(folder.path(), "t_f = 0.02\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n", "[tables.optimal]\n");
    let said: Vec<String> = (0..2)
        .map(|index| text(&slipsweep(folder.path(), &["run", "spec.toml", "--shard", &format!("{index}/2")]).stdout))
        .collect();
    let without = said.iter().filter(|text| text.contains("nothing to compute: this shard has no parts\n")).count();
    assert_eq!(without, 1, "{said:?}");
}
