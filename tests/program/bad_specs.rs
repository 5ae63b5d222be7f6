//! Every way to get a spec wrong, each with the whole message that it earns: `tests/bad_specs/NAME.toml` and `NAME.txt`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn slipsweep(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slipsweep")).args(arguments).current_dir(folder).output().expect("runs")
}

fn names(extension: &str) -> BTreeSet<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_specs");
    let entries =
        fs::read_dir(folder).expect("is there").map(|entry| PathBuf::from(entry.expect("is readable").file_name()));
    entries
        .filter(|path| path.extension().is_some_and(|found| found == extension))
        .map(|path| path.file_stem().expect("has a name").to_string_lossy().into_owned())
        .collect()
}

#[test]
fn every_bad_spec_earns_its_message() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_specs");
    let out = tempfile::tempdir().expect("is writable");
    let specs = names("toml");
    assert!(specs.len() >= 40, "{}", specs.len());
    assert_eq!(specs, names("txt"));
    for name in specs {
        let expected = fs::read_to_string(folder.join(format!("{name}.txt"))).expect("is readable");
        for command in [&["run", "--out", &out.path().to_string_lossy()][..], &["plan"]] {
            let spec = format!("{name}.toml");
            let arguments = [command, &[&spec]].concat();
            let output = slipsweep(&arguments, &folder);
            assert_eq!(String::from_utf8_lossy(&output.stderr), expected, "{name}");
            assert_eq!(output.status.code(), Some(1), "{name}");
            assert!(output.stdout.is_empty(), "{name}");
        }
    }
    assert_eq!(fs::read_dir(out.path()).expect("is readable").count(), 0);
}

#[test]
fn a_spec_that_cannot_be_read() {
    let folder = tempfile::tempdir().expect("is writable");
    let output = slipsweep(&["run", "nowhere.toml"], folder.path());
    let message = "error: nowhere.toml: cannot read: No such file or directory (os error 2)\n  expected: a readable TOML file\n  \
                   help: check the path\n";
    assert_eq!(String::from_utf8_lossy(&output.stderr), message);
    assert_eq!(output.status.code(), Some(1));
    fs::write(folder.path().join("granite.toml"), "").expect("is writable");
    for name in ["granite", "granit.toml"] {
        let output = slipsweep(&["run", name], folder.path());
        let message = format!(
            "error: {name}: cannot read: No such file or directory (os error 2)\n  expected: a readable TOML file\n  \
             help: did you mean `granite.toml`?\n"
        );
        assert_eq!(String::from_utf8_lossy(&output.stderr), message);
    }
    // Another letter is another name.
    fs::write(folder.path().join("a.toml"), "").expect("is writable");
    let output = slipsweep(&["run", "b"], folder.path());
    assert_eq!(String::from_utf8_lossy(&output.stderr), message.replace("nowhere.toml", "b"));
}

/// Neither a named pipe nor a device is waited for.
#[test]
fn a_spec_that_is_no_file() {
    let folder = tempfile::tempdir().expect("is writable");
    let pipe = folder.path().join("pipe.toml");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("runs").success());
    let (expected, help) = ("a readable TOML file", "name a readable file");
    for (spec, found) in
        [("pipe.toml", "a device or a named pipe"), ("/dev/zero", "a device or a named pipe"), (".", "a folder")]
    {
        for command in [&["plan"][..], &["shards", "--engine", "slurm", "--shards", "2"]] {
            let output = slipsweep(&[command, &[spec]].concat(), folder.path());
            let message =
                format!("error: {spec}: cannot read: {found}, not a file\n  expected: {expected}\n  help: {help}\n");
            assert_eq!(String::from_utf8_lossy(&output.stderr), message, "{command:?}");
            assert_eq!(output.status.code(), Some(1), "{command:?}");
        }
    }
    fs::rename(&pipe, folder.path().join("pipe.csv")).expect("is writable");
    let points = "name = \"x\"\npoints = \"pipe.csv\"\n[tables.stability]\n";
    fs::write(folder.path().join("points.toml"), points).expect("is writable");
    for arguments in [&["plan", "points.toml"][..], &["plot", "pipe.csv"], &["head", "pipe.csv"]] {
        let output = slipsweep(arguments, folder.path());
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(1) && message.contains("not a file"), "{arguments:?}: {message}");
    }
}

/// An axis that no table has, and scales in other units, are legal, but a warning names them.
#[test]
fn doubtful_axes_and_scales() {
    let folder = tempfile::tempdir().expect("is writable");
    let spec = "name = \"k\"\n[axes]\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\nk = [1.0, 2.0]\ndt = [0.1, 0.2]\n[tables.crossover]\n";
    fs::write(folder.path().join("k.toml"), format!("where = \"dt > 0\"\n{spec}")).expect("is writable");
    let warning = "warning: k.toml:8: axes.k: no effect on crossover\n  expected: an axis of a requested table\n  help: remove it, or add a \
                   table that has it: stability, step_response, compliant, regularised\n";
    assert_eq!(String::from_utf8_lossy(&slipsweep(&["plan", "k.toml"], folder.path()).stderr), warning);
    let used = spec.replace("dt = [0.1, 0.2]\n[tables.crossover]", "[tables.crossover]\n[tables.stability]");
    fs::write(folder.path().join("used.toml"), used).expect("is writable");
    assert!(slipsweep(&["plan", "used.toml"], folder.path()).stderr.is_empty());
    let si = "name = \"si\"\n[model]\nunits = \"si\"\nmu_0 = 60\nl = 20\nv_0 = 1e-4\nnormal_stress = 25\n[axes]\nt_f = 9\na = 0.018\n\
              b = 0.03\nv_i = 3.0\nv_f = 10.0\nv_ceiling = [500, inf]\n[tables.optimal]\n";
    fs::write(folder.path().join("si.toml"), si).expect("is writable");
    let output = slipsweep(&["plan", "si.toml"], folder.path());
    let warnings = String::from_utf8_lossy(&output.stderr);
    for expected in [
        "si.toml:5: model.l: 20.0 is unusual\n  expected: usually at most 1.0 m",
        "si.toml:4: model.mu_0: 60.0 is unusual",
        "si.toml:7: model.normal_stress: 25.0 is unusual",
        "si.toml:14: axes.v_ceiling: 500.0 m/s is unusually fast",
    ] {
        assert!(warnings.contains(expected), "{warnings}");
    }
    // A coefficient of friction in place of a stress.
    let coefficient = si.replace("v_ceiling = [500, inf]", "tau_ceiling = 0.7");
    fs::write(folder.path().join("tau.toml"), coefficient).expect("is writable");
    let output = slipsweep(&["plan", "tau.toml"], folder.path());
    assert!(String::from_utf8_lossy(&output.stderr).contains("tau.toml:14: axes.tau_ceiling: 0.7 Pa is unusually low"));
    // A ceiling that one of two tables lacks.
    let mixed = "name = \"mixed\"\n[axes]\nt_f = 0.02\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\nv_ceiling = 300.0\n[tables.optimal]\n\
                 [tables.crossover]\n";
    fs::write(folder.path().join("mixed.toml"), mixed).expect("is writable");
    let warning = "warning: mixed.toml:8: axes.v_ceiling: no effect on crossover\n  expected: numbers under the ceiling\n  help: these tables \
                   ignore it; their protocols may exceed it\n";
    assert_eq!(String::from_utf8_lossy(&slipsweep(&["plan", "mixed.toml"], folder.path()).stderr), warning);
}

/// Options of other programs, folders that are not there, and paths that Slurm cannot log to.
#[test]
fn options_and_paths_lead_to_what_was_meant() {
    let folder = tempfile::tempdir().expect("is writable");
    let say = |arguments: &[&str]| {
        let output = slipsweep(arguments, folder.path());
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    for (command, given, meant) in [
        ("run", "--jobs", "--threads"),
        ("run", "-j2", "--threads"),
        ("trace", "--tf", "--t-f"),
        ("trace", "--vi", "--v-i"),
    ] {
        let said = say(&[command, "x", given]);
        assert!(said.contains(&format!("a similar argument exists: '{meant}'")), "{said}");
    }
    assert!(say(&["init", "nowhere/b"]).starts_with("error: `nowhere/b`: there is no folder `nowhere`\n"));
    assert_eq!(slipsweep(&["init", "a"], folder.path()).status.code(), Some(0));
    let said = say(&["shards", "a.toml", "--engine", "slurm", "--shards", "2", "--out", "back\\slash"]);
    assert!(said.contains("Slurm writes no log below a folder whose name has a backslash"), "{said}");
}

/// Rows without values, as spreadsheets write them below the last one, are no points.
#[test]
fn empty_rows_of_a_spreadsheet_are_skipped() {
    let folder = tempfile::tempdir().expect("is writable");
    fs::write(folder.path().join("p.csv"), "t_f,v_f\r\n0.02,100\r\n,\r\n0.03,100\r\n,\r\n").expect("is writable");
    let spec = "name = \"p\"\npoints = \"p.csv\"\n[axes]\na = 0.03\nb = 0.05\nv_i = 3.0\n[tables.optimal]\n";
    fs::write(folder.path().join("p.toml"), spec).expect("is writable");
    let output = slipsweep(&["run", "p.toml"], folder.path());
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("optimal: 2 rows (2 ok)\n"), "{output:?}");
}

/// Axes outside the physical domain are computed with a warning, unless a condition may drop those points.
#[test]
fn axes_outside_the_physical_domain() {
    let folder = tempfile::tempdir().expect("is writable");
    let warnings = |spec: &str| {
        fs::write(folder.path().join("far.toml"), spec).expect("is writable");
        String::from_utf8_lossy(&slipsweep(&["plan", "far.toml"], folder.path()).stderr).into_owned()
    };
    let spec = "name = \"far\"\n[axes]\nt_f = [0.02, 0.04]\na = [0.03, 0.5]\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n[tables.optimal]\n";
    let help = "help: check the unit; outside the physical domain rows may have no numbers\n";
    let expected = format!(
        "warning: far.toml:4: axes.a: 0.5 is outside the physical domain\n  expected: 0.001 to 0.3, in mu_0\n  {help}"
    );
    assert_eq!(warnings(spec), expected);
    assert_eq!(warnings(&spec.replace("[axes]", "where = \"a < 0.3\"\n[axes]")), "");
    assert_eq!(warnings(&spec.replace(", 0.5]", ", 0.3]")), "");
}

/// Values that are legal, and yet probably in other units, are computed with a warning.
#[test]
fn doubtful_velocities() {
    let folder = tempfile::tempdir().expect("is writable");
    let spec = "name = \"fast\"\n[model]\nunits = \"Si\"\nmu_0 = 0.6\nl = 1e-6\nv_0 = 1e-4\nnormal_stress = 1e6\n[axes]\na = 0.018\nb = 0.03\n\
                v_i = 3.0\nv_f = { geomspace = [10.0, 1e3, 3] }\n[tables.crossover]\n";
    fs::write(folder.path().join("fast.toml"), spec).expect("is writable");
    let output = slipsweep(&["plan", "fast.toml"], folder.path());
    let warning = "warning: fast.toml:12: axes.v_f: 1000.0 m/s is unusually fast\n  expected: velocities in m/s, \
                   because of `units = \"si\"`\n  help: if these are in units of v_0, multiply them by v_0, or remove `units` and the scales \
                   from [model]\n";
    assert_eq!(String::from_utf8_lossy(&output.stderr), warning);
    assert_eq!(output.status.code(), Some(0));
    fs::write(folder.path().join("fast.toml"), spec.replace("1e3", "40.0")).expect("is writable");
    assert!(slipsweep(&["plan", "fast.toml"], folder.path()).stderr.is_empty());
}

const GOOD: &str = "name = \"good\"\n[axes]\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = [100.0, 200.0]\n[tables.crossover]\n";

#[test]
fn a_place_that_cannot_be_written() {
    let folder = tempfile::tempdir().expect("is writable");
    fs::write(folder.path().join("good.toml"), GOOD).expect("is writable");
    fs::write(folder.path().join("file"), "").expect("is writable");
    let output = slipsweep(&["run", "good.toml", "--out", "file"], folder.path());
    let message = "error: --out file: not a folder\n  expected: a folder, which the run makes if it is missing\n  help: name a folder\n";
    assert_eq!(String::from_utf8_lossy(&output.stderr), message);
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn a_place_that_belongs_to_something_else() {
    let folder = tempfile::tempdir().expect("is writable");
    fs::create_dir_all(folder.path().join("results/good")).expect("is writable");
    fs::write(folder.path().join("results/good/notes.txt"), "mine").expect("is writable");
    fs::write(folder.path().join("good.toml"), GOOD).expect("is writable");
    let output = slipsweep(&["run", "good.toml"], folder.path());
    let message = "error: results/good: neither a dataset nor empty\n  expected: an empty folder, or one with a manifest.json\n  \
                   help: change `name` in the spec, or write elsewhere with --out DIR\n";
    assert_eq!(String::from_utf8_lossy(&output.stderr), message);
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn wrong_arguments() {
    let folder = tempfile::tempdir().expect("is writable");
    for arguments in [&["run"][..], &["sweep"], &["run", "x.toml", "--threads", "0"], &["run", "x.toml", "--fast"], &[]]
    {
        assert_eq!(slipsweep(arguments, folder.path()).status.code(), Some(1), "{arguments:?}");
    }
    for arguments in [&["--help"][..], &["--version"], &["run", "--help"]] {
        assert_eq!(slipsweep(arguments, folder.path()).status.code(), Some(0), "{arguments:?}");
    }
    for (given, meant) in [
        (&["run", "x.toml", "--thread", "2"][..], "'--threads'"),
        (&["sumary", "results/x"], "'summary'"),
        (&["trace", "optimum"], "'optimal'"),
        (&["tables", "stabilty"], "`stability`"),
        (&["man", "sumary"], "`summary`"),
    ] {
        let output = slipsweep(given, folder.path());
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(1) && message.contains(meant), "{given:?}: {message}");
    }
}
