//! `slipsweep plot` as a user meets it: pictures of every table and of traces, words, exit codes.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Every table of a small dataset.
const SPEC: &str = r#"
name = "small"
[axes]
t_f = [0.02, 0.037]
a = 0.03
b = 0.05
v_i = 3.0
v_f = { geomspace = [50.0, 200.0, 5] }
alpha_2 = { linspace = [-0.3, 0.1, 21], unit = "1/t_f" }
alpha_3 = { linspace = [-0.3, 0.3, 21], unit = "1/t_f^2" }
tau_ceiling = [1.1, 2.0]
k = { geomspace = [0.01, 0.1, 5] }
m = 1e-9
dt = [0.0, 0.001]
delta_t = [1e-4, 1e-3]
theta = { geomspace = [0.02, 0.3, 8] }
t_left = { geomspace = [0.005, 0.05, 6] }
[tables.gap]
[tables.best_cubic]
[tables.optimal]
[tables.crossover]
[tables.shortcut]
[tables.stability]
[tables.step_response]
[tables.compliant]
[tables.regularised]
[tables.feedback]
"#;

fn command(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slipsweep")).current_dir(folder).args(arguments).output().expect("runs")
}

/// Standard output of a command that succeeds.
fn shown(folder: &Path, arguments: &[&str]) -> String {
    let output = command(folder, arguments);
    assert_eq!(
        (output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()),
        (Some(0), ""),
        "{arguments:?}"
    );
    String::from_utf8(output.stdout).expect("is text")
}

/// The message of a refused command.
fn complaint(folder: &Path, arguments: &[&str]) -> String {
    let output = command(folder, arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    String::from_utf8(output.stderr).expect("is text")
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).expect("is readable")
}

/// The words of a picture, markup aside.
fn words(svg: &str) -> String {
    let mut words = String::new();
    for text in svg.split("<text").skip(1) {
        let text = text.split("</text>").next().unwrap_or_default();
        let mut inside = false;
        for letter in text.chars() {
            match letter {
                '<' => inside = false,
                '>' => inside = true,
                _ if inside => words.push(letter),
                _ => {}
            }
        }
        words.push('\n');
    }
    words
}

fn dataset() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("small.toml"), SPEC).expect("is writable");
    let run = command(folder.path(), &["run", "small.toml"]);
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
    folder
}

#[test]
fn every_table_has_its_picture() {
    let folder = dataset();
    let folder = folder.path();
    let said = shown(folder, &["plot", "results/small"]);
    let written: String = said.lines().filter(|line| !line.starts_with("  ")).map(|line| format!("{line}\n")).collect();
    let tables = [
        "gap",
        "best_cubic",
        "optimal",
        "crossover",
        "shortcut",
        "stability",
        "step_response",
        "compliant",
        "regularised",
        "feedback",
    ];
    assert_eq!(written, tables.map(|table| format!("{table}: written to small-{table}.svg\n")).concat());
    assert!(said.contains("\n  8 of 10 panels (t_f, v_f); choose others with --where\n"), "{said}");
    let all: Vec<String> = tables.iter().map(|table| read(folder, &format!("small-{table}.svg"))).collect();
    for (table, svg) in tables.iter().zip(&all) {
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{table}");
    }
    let words_of = words;
    let words: Vec<String> = all.iter().map(|svg| words_of(svg)).collect();
    assert!(words.iter().all(|words| !words.contains("NaN")));
    for part in
        ["Landscape of cubic shortcuts", "infeasible", "vmin = 1", "best shortcut", "α2 tf", "α3 tf2", "tf = 0.02"]
    {
        assert!(words[0].contains(part), "{part} in {}", words[0]);
    }
    assert!(words[2].contains("W* (μ0 σ l)"), "{}", words[2]);
    assert!(words[4].contains("vi = 3 v0, tf = 0.02 l/v0"), "{}", words[4]);
    assert!(words[4].contains("\nbounded friction, τceiling = 1.1 μ0 σ"), "{}", words[4]);
    // A step costs little because it does not arrive.
    let note = "The step only approaches the final state";
    assert!(words[4].contains(note), "{}", words[4]);
    shown(folder, &["plot", "results/small", "--table", "shortcut", "--where", "family!=step", "--out", "arrived.svg"]);
    assert!(!words_of(&read(folder, "arrived.svg")).contains(note));
    // Scaled figures state their units too; nothing in a figure is for the command line.
    assert!(words[0].contains("a = 0.03 μ0, b = 0.05 μ0, vi = 3 v0"), "{}", words[0]);
    assert!(words.iter().all(|words| !words.contains("--")));
    assert!(words[5].contains("kc(vf)") && words[5].contains("k (μ0 σ/l)"), "{}", words[5]);
    // A title names no column, since another may be drawn.
    shown(folder, &["plot", "results/small", "--table", "gap", "--color", "v_min", "--out", "v_min.svg"]);
    assert!(!words_of(&read(folder, "v_min.svg")).contains("gap"));
    // A second picture has the same bytes.
    shown(folder, &["plot", "results/small", "--table", "gap", "--out", "again.svg"]);
    assert_eq!(read(folder, "again.svg"), all[0]);
    refusals(folder);
    formats(folder);
}

/// PNG and PDF, and the pixels requested.
fn formats(folder: &Path) {
    shown(folder, &["plot", "results/small", "--table", "optimal", "--width", "89", "--dpi", "100", "--out", "o.png"]);
    let png = fs::read(folder.join("o.png")).expect("is readable");
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    let width = u32::from_be_bytes(png[16..20].try_into().expect("four bytes"));
    assert_eq!(width, (89.0_f64 / 25.4 * 100.0).ceil() as u32);
    shown(folder, &["plot", "results/small", "--table", "gap", "--where", "t_f=0.02, v_f=100", "--out", "g.pdf"]);
    let pdf = fs::read(folder.join("g.pdf")).expect("is readable");
    assert!(pdf.starts_with(b"%PDF-"));
    // Text stays text: its font is embedded.
    assert!(pdf.windows(5).any(|bytes| bytes == b"Arimo"));
}

/// Messages list the known names.
fn refusals(folder: &Path) {
    let gap = ["plot", "results/small", "--table", "gap"];
    let with = |more: &[&str]| complaint(folder, &[&gap, more].concat());
    assert_eq!(
        with(&["--where", "t_f=0.03"]),
        "error: --where t_f = 0.03: no row of the table `gap` meets this\n  found: t_f = 0.02, 0.037\n  help: the \
         nearest rows have --where \"t_f=0.037\"\n"
    );
    let near = with(&["--where", "t_f=0.0200001, b=0.05"]);
    assert!(near.ends_with("  help: the nearest rows have --where \"t_f=0.02, b=0.05\"\n"), "{near}");
    assert_eq!(
        with(&["--where", "t_f<0.02s AND b=0.05"]),
        "error: --where t_f < 0.02s: the column `t_f` has numbers\n  expected: a number without a unit, such as 0.03, 1e-6 or inf\n  help: \
         correct the value\n"
    );
    assert_eq!(
        with(&["--where", "tf=0.02"]),
        "error: --where: the table `gap` has no column `tf`\n  found: t_f, a, b, v_i, v_f, alpha_2, alpha_3, work, work_optimal, \
         gap, v_min, status\n  help: did you mean `t_f`?\n"
    );
    assert_eq!(
        complaint(folder, &["plot", "results/small", "--table", "optimal", "--where", "strategy!=speedup"]),
        "error: --where strategy != speedup: `strategy` is never `speedup`\n  expected: speed_up, slow_down, floor, wait_jerk, \
         jerk_wait, chatter, rise\n  help: did you mean `speed_up`?\n"
    );
    assert_eq!(
        with(&["--x", "gap"]),
        "error: --x: the table `gap` has no axis `gap`\n  found: t_f, a, b, v_i, v_f, alpha_2, alpha_3\n  help: choose one of these\n"
    );
    assert_eq!(
        with(&["--out", "gap.jpg"]),
        "error: --out gap.jpg: the name ends in none of .svg, .png, .pdf\n  help: end it in one of these; for a folder, make it \
         first\n"
    );
    let contradiction = with(&["--out", "gap.pdf", "--format", "png"]);
    assert!(contradiction.starts_with("error: --out gap.pdf: the ending contradicts --format\n"), "{contradiction}");
    assert_eq!(
        complaint(folder, &["plot", "results/small", "--table", "gop"]),
        "error: the dataset has no table `gop`\n  found: gap, best_cubic, optimal, crossover, shortcut, stability, step_response, compliant, \
         regularised, feedback\n  help: did you mean `gap`?\n"
    );
}

#[test]
fn the_wrong_kind_of_file_is_named_with_the_command_that_takes_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let spec =
        "name = \"tiny\"\n[axes]\nt_f = [0.02, 0.03]\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n[tables.optimal]\n";
    fs::write(folder.join("tiny.toml"), spec).expect("is writable");
    shown(folder, &["run", "tiny.toml", "--quiet"]);
    let case = ["--t-f", "0.02", "--a", "0.03", "--b", "0.05", "--v-i", "3", "--v-f", "100"];
    shown(folder, &[&["trace", "best_cubic", "--out", "best.csv"], &case[..]].concat());
    fs::write(folder.join("other.csv"), "a,b\n0,1\n").expect("is writable");
    let spec = "error: tiny.toml: a spec\n";
    let run = "help: `slipsweep run tiny.toml` computes its dataset; name that folder\n";
    for command in ["plot", "report", "summary", "head", "status", "verify"] {
        let said = complaint(folder, &[command, "tiny.toml"]);
        assert!(said.contains(spec) && said.ends_with(run), "{command}: {said}");
        assert!(!said.contains("delete"), "{command}: {said}");
    }
    assert_eq!(
        complaint(folder, &["summary", "best.csv"]),
        "error: best.csv: a trace\n  expected: the folder of a dataset, such as results/NAME\n  help: `slipsweep \
         plot best.csv` draws it\n"
    );
    for (path, kind, help) in [
        ("results", "a folder of datasets", "name one of them: results/tiny"),
        ("results/tiny/optimal", "a piece of a dataset", "name the dataset, results/tiny"),
        ("results/tiny/manifest.json", "a piece of a dataset", "name the dataset, results/tiny"),
        ("other.csv", "a file of rows", "`slipsweep head other.csv` shows it, and `slipsweep query` reads it"),
    ] {
        let said = complaint(folder, &["plot", path]);
        assert!(said.starts_with(&format!("error: {path}: {kind}\n")), "{said}");
        assert!(said.ends_with(&format!("\n  help: {help}\n")), "{said}");
    }
    assert!(complaint(folder, &["plot", "none.csv"]).starts_with("error: none.csv: there is no such file or folder\n"));
    // A protocol is named where `trace` expects one; whatever has the look of a path is one.
    for (path, kind, help) in [
        ("tiny.toml", "a spec", "`slipsweep run tiny.toml` computes"),
        ("best.csv", "a trace", "`slipsweep plot best.csv` draws it"),
        ("results/none", "there is no such file or folder", "check the path"),
        ("results/tint", "there is no such file or folder", "did you mean `results/tiny`?"),
        ("results/tiny", "a dataset without a table", "slipsweep trace results/tiny optimal --row 0"),
    ] {
        let said = complaint(folder, &["trace", path]);
        assert!(said.starts_with(&format!("error: {path}: {kind}\n")), "{said}");
        assert!(said.contains(&format!("\n  help: {help}")), "{said}");
    }
    for (path, kind) in [("results", "a folder of datasets"), ("results/tiny/optimal", "a piece of a dataset")] {
        let said = complaint(folder, &["run", path]);
        assert!(said.starts_with(&format!("error: {path}: {kind}\n")), "{said}");
    }
}

#[test]
fn all_tables_go_into_a_folder_in_a_format() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let spec = "name = \"tiny\"\n[axes]\nt_f = [0.02, 0.03, 0.04]\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n\
                [tables.optimal]\n[tables.best_cubic]\n";
    fs::write(folder.join("tiny.toml"), spec).expect("is writable");
    shown(folder, &["run", "tiny.toml", "--quiet"]);
    // A file needs an existing folder, as in other commands.
    let output = command(folder, &["plot", "results/tiny", "--table", "optimal", "--out", "new/picture.svg"]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8(output.stderr).expect("is text");
    assert!(
        said.ends_with("\n  help: name a file in an existing folder with write permission and free space\n"),
        "{said}"
    );
    assert!(!folder.join("new").exists());
    let said = shown(folder, &["plot", "results/tiny", "--format", "png", "--out", "new/pictures", "--dpi", "60"]);
    let path = |table: &str| format!("new/pictures/tiny-{table}.png");
    assert_eq!(said, ["optimal", "best_cubic"].map(|table| format!("{table}: written to {}\n", path(table))).concat());
    assert!(fs::read(folder.join(path("best_cubic"))).expect("is there").starts_with(b"\x89PNG"));
    shown(folder, &["plot", "results/tiny", "--format", "pdf", "--table", "best_cubic"]);
    assert!(fs::read(folder.join("tiny-best_cubic.pdf")).expect("is there").starts_with(b"%PDF-"));
}

#[test]
fn traces_are_drawn_over_each_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let case = ["--t-f", "0.02", "--a", "0.03", "--b", "0.05", "--v-i", "3", "--v-f", "100"];
    shown(folder, &[&["trace", "optimal", "--out", "optimal.parquet"], &case[..]].concat());
    shown(folder, &[&["trace", "best_cubic", "--out", "best.csv"], &case[..]].concat());
    assert_eq!(shown(folder, &["plot", "optimal.parquet"]), "written to optimal.svg\n");
    let alone = words(&read(folder, "optimal.svg"));
    for part in ["Protocol optimal", "tf = 0.02", "v (v0)", "θ (l/v0)", "τ (μ0 σ)", "t (l/v0)"] {
        assert!(alone.contains(part), "{part} in {alone}");
    }
    assert_eq!(shown(folder, &["plot", "optimal.parquet", "best.csv"]), "written to traces.svg\n");
    let both = words(&read(folder, "traces.svg"));
    // They lie on each other: one line, one entry of the legend.
    assert!(both.contains("\noptimal; best cubic, α2 = −0.11983/tf, α3 = −0.066423/tf2\n"), "{both}");
    shown(folder, &[&["trace", "step", "--out", "step.parquet"], &case[..]].concat());
    shown(folder, &["plot", "optimal.parquet", "step.parquet"]);
    let apart = words(&read(folder, "traces.svg"));
    assert!(apart.contains("\noptimal\nstep\n"), "{apart}");
    let spring = ["--t-f", "3.1e-6", "--a", "0.005", "--b", "0.01", "--v-i", "1e5", "--v-f", "3.2e6", "--k", "7.5e-3"];
    shown(folder, &[&["trace", "compliant", "--m", "2.5e-16", "--out", "spring.parquet"], &spring[..]].concat());
    shown(folder, &["plot", "spring.parquet"]);
    let spring = words(&read(folder, "spring.svg"));
    // One panel for both velocities; one format of numbers, with units.
    for part in ["v, vc (106 v0)", "k = 0.0075 μ0 σ/l", "vi = 105 v0", "vf = 3.2×106 v0", "\nv\nvc\n"] {
        assert!(spring.contains(part), "{part} in {spring}");
    }
    // A phase portrait: one panel of friction over velocity, without the control velocity.
    shown(folder, &["plot", "spring.parquet", "--x", "v", "--y", "tau", "--out", "phase.svg"]);
    let phase = words(&read(folder, "phase.svg"));
    assert!(phase.contains("τ (μ0 σ)") && phase.contains("\nv (") && !phase.contains("vc"), "{phase}");
    let message = complaint(folder, &["plot", "spring.parquet", "--x", "u"]);
    assert!(message.starts_with("error: --x: the trace has no column `u`\n  found: t, v, theta, tau"), "{message}");
    fs::copy(folder.join("best.csv"), folder.join("my_<best>*\u{1}.csv")).expect("is writable");
    shown(folder, &["plot", "my_<best>*\u{1}.csv", "--out", "odd.png"]);
    shown(folder, &["plot", "my_<best>*\u{1}.csv", "--out", "odd.svg"]);
    let odd = words(&read(folder, "odd.svg"));
    assert!(odd.starts_with("Protocol best cubic"), "{odd}");
    fs::write(folder.join("bad.csv"), "t,v\n0,1\n1,x\n").expect("is writable");
    assert_eq!(
        complaint(folder, &["plot", "bad.csv"]),
        "error: bad.csv, line 3: found `x`\n  expected: a number or nothing\n  help: `slipsweep trace … --out \
         FILE.csv` writes traces\n"
    );
    assert!(
        complaint(folder, &["plot", "best.csv", "--table", "gap"])
            .starts_with("error: --table: traces have no tables\n")
    );
}

#[test]
fn several_rows_of_a_cell_are_noted_in_the_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let spec = "name = \"many\"\n[axes]\nt_f = { geomspace = [0.001, 2.0, 9000] }\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n\
                [tables.optimal]\ncolumns = [\"time_at_floor\"]\n";
    fs::write(folder.join("many.toml"), spec).expect("is writable");
    shown(folder, &["run", "many.toml"]);
    shown(folder, &["plot", "results/many"]);
    let words = words(&read(folder, "many-optimal.svg"));
    assert!(
        words.contains("3000 values of tf have several rows each: their least and greatest values are drawn."),
        "{words}"
    );
    for mark in ["tcheapest", "tcross", "tfloor"] {
        assert!(words.contains(mark), "{mark} in {words}");
    }
}

/// A dataset of its own, and the words of the picture of a table of it.
fn picture(name: &str, spec: &str, table: &str) -> (String, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    fs::write(folder.join("spec.toml"), format!("name = \"{name}\"\n{spec}")).expect("is writable");
    shown(folder, &["run", "spec.toml", "--quiet"]);
    shown(folder, &["plot", &format!("results/{name}"), "--table", table, "--out", "picture.svg"]);
    let svg = read(folder, "picture.svg");
    (words(&svg), svg)
}

#[test]
fn pictures_in_si_units_show_the_same() {
    let spec = "[model]\nunits = \"si\"\nmu_0 = 0.6\nl = 1e-6\nv_0 = 1e-9\nnormal_stress = 10.0\n[axes]\nt_f = [20.0, 49.0]\na = 0.018\n\
                b = 0.03\nv_i = 3e-9\nv_f = 1e-7\nalpha_2 = { linspace = [-0.3, 0.1, 21], unit = \"1/t_f\" }\n\
                alpha_3 = { linspace = [-0.3, 0.3, 21], unit = \"1/t_f^2\" }\n[tables.gap]\n[tables.optimal]\n";
    let (gap, _) = picture("si", spec, "gap");
    for part in ["vmin = v0", "vf = 10−7 m/s", "tf = 20 s", "least gap of the grid"] {
        assert!(gap.contains(part), "{part} in {gap}");
    }
    let (optimal, _) = picture("si", spec, "optimal");
    for part in ["W* (10−5 J/m2)", "v(0+) (10−8 m/s)", "tcross"] {
        assert!(optimal.contains(part), "{part} in {optimal}");
    }
    let spec = "[model]\nunits = \"si\"\nmu_0 = 0.6\nl = 1e-6\nv_0 = 1e-9\nnormal_stress = 10.0\n[axes]\na = 0.003\nb = 0.006\n\
                v_i = 1e-6\nv_f = { geomspace = [2e-6, 1e-2, 7] }\nk = { geomspace = [1e3, 1e5, 7] }\nm = 1.0\n[tables.stability]\n";
    let (stability, svg) = picture("spring", spec, "stability");
    for part in ["kc(vf)", "k (Pa/m)", "vf (m/s)", "m = 1 kg/m2"] {
        assert!(stability.contains(part), "{part} in {stability}");
    }
    // The metre is upright, the mass is not.
    assert!(svg.contains("(Pa/m)") && svg.contains("<tspan font-style=\"italic\">m</tspan> = 1 kg"), "{svg}");
}

#[test]
fn axes_that_change_together_make_lines_and_sampled_ones_dots() {
    let (along, svg) = picture(
        "along",
        "[axes]\na = 0.03\nb = 0.05\nv_i = { geomspace = [2.0, 200.0, 41] }\nv_f = { expr = \"10 * v_i\" }\nt_f = 0.02\n\
         [tables.optimal]\n",
        "optimal",
    );
    assert!(along.contains("Along with vi, vf changes.") && !svg.contains("<image"), "{along}");
    let (sampled, svg) = picture(
        "sampled",
        "[axes]\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = { sobol = [10.0, 1000.0, 64], seed = 1 }\n\
         t_f = { sobol = [0.01, 0.1, 64], seed = 1 }\n[tables.optimal]\n",
        "optimal",
    );
    assert!(
        !svg.contains("<image") && sampled.contains("\nspeed up\n") && !sampled.contains("several rows"),
        "{sampled}"
    );
    let dots = svg.matches("stroke=\"#222\" stroke-width=\"0.3\"").count();
    // A dot a row, and those of the legend.
    assert_eq!(
        dots,
        64 + sampled.matches("speed up").count()
            + sampled.matches("slow down").count()
            + sampled.matches("\nfloor\n").count()
    );
}

/// The paper's transition.
const MATERIAL: &str = "a = 0.03\nb = 0.05\nv_i = 3.0\n";

#[test]
fn two_axes_are_crossed_and_omitted_panels_are_noted() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let spec = "name = \"crossed\"\n[axes]\nt_f = { geomspace = [0.01, 0.04, 5] }\na = 0.03\nb = [0.04, 0.05]\nv_i = 3.0\nv_f = 100.0\n\
                alpha_2 = { linspace = [-0.3, 0.1, 11], unit = \"1/t_f\" }\n\
                alpha_3 = { linspace = [-0.3, 0.3, 11], unit = \"1/t_f^2\" }\n[tables.gap]\n";
    fs::write(folder.join("spec.toml"), spec).expect("is writable");
    shown(folder, &["run", "spec.toml", "--quiet"]);
    let said = shown(folder, &["plot", "results/crossed"]);
    assert_eq!(said, "gap: written to crossed-gap.svg\n  8 of 10 panels (t_f, b); choose others with --where\n");
    let words_of = words;
    let words = words_of(&read(folder, "crossed-gap.svg"));
    // A title a row and a column.
    for title in ["\ntf = 0.01 l/v0\n", "\ntf = 0.04 l/v0\n", "\nb = 0.04 μ0\n", "\nb = 0.05 μ0\n"] {
        assert_eq!(words.matches(title).count(), 1, "{title} in {words}");
    }
    assert!(words.contains("\n8 of 10 panels (tf, b) are shown.\n"), "{words}");
    // A condition on a result leaves a row of each kind in different places: the panels stay apart.
    shown(folder, &["plot", "results/crossed", "--table", "gap", "--where", "gap<1e-4, b=0.05", "--out", "few.svg"]);
    let few = words_of(&read(folder, "few.svg"));
    assert!(few.matches("\ntf = ").count() > 1, "{few}");
}

#[test]
fn of_two_ceilings_that_never_meet_one_is_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let block =
        |ceiling: &str| format!("[[block]]\n[block.axes]\nt_f = [0.01, 0.02]\n{MATERIAL}v_f = 100.0\n{ceiling}\n");
    let [v, tau] = ["v_ceiling = { geomspace = [400.0, 5000.0, 31] }", "tau_ceiling = { linspace = [1.07, 1.1, 21] }"];
    let spec = format!("name = \"fronts\"\n{}{}[tables.optimal]\ncolumns = [\"work\"]\n", block(v), block(tau));
    fs::write(folder.join("spec.toml"), spec).expect("is writable");
    shown(folder, &["run", "spec.toml", "--quiet"]);
    let said = shown(folder, &["plot", "results/fronts", "--out", "default.svg"]);
    let expected = "\n  rows of v_ceiling alone; draw those of tau_ceiling with --x tau_ceiling\n";
    assert!(said.ends_with(expected), "{said}");
    shown(folder, &["plot", "results/fronts", "--where", "tau_ceiling=inf", "--out", "selected.svg"]);
    assert_eq!(read(folder, "default.svg"), read(folder, "selected.svg"));
    shown(folder, &["plot", "results/fronts", "--x", "tau_ceiling", "--out", "default.svg"]);
    shown(folder, &["plot", "results/fronts", "--where", "v_ceiling=inf", "--out", "selected.svg"]);
    assert_eq!(read(folder, "default.svg"), read(folder, "selected.svg"));
}

#[test]
fn few_points_are_shown_and_what_is_constant_is_said() {
    let axes = |count: u32| {
        format!(
            "[axes]\nt_f = {{ geomspace = [0.3, 1.0, {count}] }}\n{MATERIAL}v_f = [50.0, 100.0]\n[tables.optimal]\n"
        )
    };
    let (few, svg) = picture("few", &axes(20), "optimal");
    // v(0+) = 1 throughout; 20 points a line, two panels, two entries of the legend with the marks of their lines.
    assert!(few.contains("v(0+) = 1 v0") && !few.contains("v(0+) (v0)"), "{few}");
    assert_eq!(svg.matches("<circle").count(), 2 * 20 + 1);
    let (_, svg) = picture("many", &axes(60), "optimal");
    assert_eq!(svg.matches("<circle").count(), 0);
}

#[test]
fn the_map_of_optima_shows_the_strategy_and_when_it_changes() {
    let spec = format!(
        "[axes]\nt_f = {{ geomspace = [0.01, 0.1, 15] }}\n{MATERIAL}v_f = {{ geomspace = [50.0, 200.0, 15] }}\n[tables.optimal]\n"
    );
    let (map, _) = picture("strategies", &spec, "optimal");
    for part in ["speed up", "slow down", "floor", "\ntcross\n", "\ntfloor\n"] {
        assert!(map.contains(part), "{part} in {map}");
    }
    let (same, _) = picture("same", &spec.replace("0.01, 0.1", "0.001, 0.01"), "optimal");
    assert!(same.contains("W* (μ0 σ l)") && !same.contains("speed up"), "{same}");
}

/// Small gaps of the colour bar need powers of ten, durations and velocities do not.
#[test]
fn regress_each_axis_has_its_own_form_of_numbers() {
    let spec = "[axes]\nt_f = { geomspace = [0.002, 0.1, 13] }\na = 0.03\nb = 0.05\nv_i = 3.0\n\
                v_f = { geomspace = [3.3, 200.0, 13] }\n[tables.best_cubic]\n";
    let (map, _) = picture("forms", spec, "best_cubic");
    for part in ["\n0.003\n", "\n0.03\n", "\n30\n", "\n10−6\n"] {
        assert!(map.contains(part), "{part} in {map}");
    }
    assert!(!map.contains('×'), "{map}");
}

#[test]
fn gaps_below_zero_have_a_colour_of_their_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    // Cubic shortcuts are faster than the ceiling where they are short.
    for (name, ceiling, is_below) in [("bounded", "1e3", true), ("free", "inf", false)] {
        let spec = format!(
            "name = \"{name}\"\n[axes]\nt_f = {{ geomspace = [0.005, 0.1, 9] }}\n{MATERIAL}v_f = {{ geomspace = [50.0, 200.0, 9] }}\n\
             v_ceiling = {ceiling}\n[tables.best_cubic]\n"
        );
        fs::write(folder.join("spec.toml"), spec).expect("is writable");
        shown(folder, &["run", "spec.toml", "--quiet"]);
        shown(folder, &["plot", &format!("results/{name}"), "--color", "gap", "--out", "map.svg"]);
        let words = words(&read(folder, "map.svg"));
        assert_eq!(words.contains("\ngap below 0\n"), is_below, "{words}");
    }
}

/// The best shortcut lies on the grid: its gap is rounding, and the next gap is seven decades above. The colour bar starts there.
#[test]
fn regress_gaps_that_are_rounding_do_not_stretch_the_colours() {
    let spec = "[axes]\nt_f = 0.002\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 4.0\n\
                alpha_2 = { linspace = [-0.1251150175, -0.0451150175, 21], unit = \"1/t_f\" }\n\
                alpha_3 = { linspace = [-0.03821242107, 0.04178757893, 21], unit = \"1/t_f^2\" }\n[tables.gap]\n";
    let (map, _) = picture("rounding", spec, "gap");
    assert!(map.contains("\n10−5\n") && !map.contains("10−8"), "{map}");
    assert!(map.contains("Gaps below rtol = 10−10, which are rounding, have the darkest colour."), "{map}");
}

#[test]
fn reduced_landscapes_have_pictures_of_their_own() {
    let spec = |reduce: &str| {
        format!(
            "[axes]\nt_f = [0.02, 0.03, 0.037]\n{MATERIAL}v_f = 100.0\nalpha_2 = {{ linspace = [-0.3, 0.1, 21], unit = \"1/t_f\" }}\n\
             alpha_3 = {{ linspace = [-0.3, 0.3, 21], unit = \"1/t_f^2\" }}\n[tables.gap]\nreduce = \"{reduce}\"\n"
        )
    };
    let (bars, svg) = picture("bars", &spec("histogram"), "gap_histogram");
    assert!(bars.contains("\nshortcuts\n") && bars.matches("\ntf = ").count() == 3, "{bars}");
    assert!(svg.matches("fill=\"#9ec4e4\"").count() > 6);
    let (bands, _) = picture("bands", &spec("quantiles"), "gap_quantiles");
    for part in ["median", "25 % to 75 %", "5 % to 95 %", "tf (l/v0)"] {
        assert!(bands.contains(part), "{part} in {bands}");
    }
    let (least, _) = picture("least", &spec("min"), "gap_min");
    assert!(least.contains("α2 tf") && least.contains("gap"), "{least}");
    let (alone, _) = picture("alone", &spec("quantiles").replace("[0.02, 0.03, 0.037]", "0.02"), "gap_quantiles");
    assert!(alone.contains("shortcuts of at most this gap (%)"), "{alone}");
}

#[test]
fn single_materials_are_symbols_of_their_outcome() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let points =
        "a,b,k,m\n0.01,0.015,0.004,1e-15\n0.005,0.01,0.006,2e-16\n0.012,0.02,0.006,3e-16\n0.008,0.011,0.02,1e-16\n";
    fs::write(folder.join("points.csv"), points).expect("is writable");
    let spec = "name = \"materials\"\npoints = \"points.csv\"\n[axes]\nv_i = 1e5\nv_f = 1e6\n[tables.step_response]\n";
    fs::write(folder.join("spec.toml"), spec).expect("is writable");
    shown(folder, &["run", "spec.toml", "--quiet"]);
    shown(folder, &["plot", "results/materials"]);
    let svg = read(folder, "materials-step_response.svg");
    let words = words(&svg);
    assert!(words.contains("\nsettled\n") && words.contains("\nlimit cycle\n"), "{words}");
    // Two settle and two do not; each symbol is in the legend, too. Nothing is hatched or blank.
    assert_eq!(svg.matches("<circle").count(), 3);
    assert!(!svg.contains("<image") && !words.contains("no row"), "{words}");
}

/// Maps of stiffness over mass show the critical stiffness, as those over the final velocity do.
#[test]
fn regress_maps_over_mass_show_the_critical_stiffness() {
    let spec = "[axes]\na = 0.005\nb = 0.01\nv_i = 1e5\nv_f = 1e6\nk = { geomspace = [1e-3, 1e-1, 5] }\n\
                m = { geomspace = [1e-17, 1e-14, 5] }\n[tables.step_response]\n";
    let (map, svg) = picture("mass", spec, "step_response");
    assert!(svg.contains("<image") && map.contains("\nkc(vf)\n"), "{map}");
}

/// Lines over an axis are named by the labels of their points, also on request.
#[test]
fn regress_a_label_as_colour_names_lines() {
    let folder = tempfile::tempdir().expect("is writable");
    let folder = folder.path();
    fs::write(folder.join("points.csv"), "material,a,b\ngranite,0.01,0.015\nquartz,0.02,0.03\n").expect("is writable");
    let spec = "name = \"labels\"\npoints = \"points.csv\"\n[axes]\nt_f = [0.02, 0.05, 0.1]\nv_i = 3.0\nv_f = 100.0\n\
                [tables.optimal]\n";
    fs::write(folder.join("labels.toml"), spec).expect("is writable");
    shown(folder, &["run", "labels.toml", "--quiet"]);
    let lines = ["plot", "results/labels", "--table", "optimal", "--x", "t_f", "--y", "work", "--out", "lines.svg"];
    shown(folder, &lines);
    let plain = read(folder, "lines.svg");
    shown(folder, &[&lines[..], &["--color", "material"]].concat());
    let words = words(&plain);
    assert!(read(folder, "lines.svg") == plain && words.contains("granite") && words.contains("quartz"), "{words}");
    // Also without a column: those that are drawn by default.
    let all = ["plot", "results/labels", "--table", "optimal", "--out", "all.svg"];
    shown(folder, &all);
    let plain = read(folder, "all.svg");
    shown(folder, &[&all[..], &["--color", "material"]].concat());
    assert_eq!(read(folder, "all.svg"), plain);
}

/// A second axis that distinguishes lines is stated after the label; a label common to all lines is in the subtitle.
#[test]
fn regress_labels_stay_in_the_legend_when_another_axis_varies() {
    let folder = tempfile::tempdir().expect("is writable");
    let folder = folder.path();
    fs::write(folder.join("points.csv"), "material,a,b\nquartz,0.02,0.03\ngranite,0.01,0.015\n").expect("is writable");
    let spec = "name = \"labels\"\npoints = \"points.csv\"\n[axes]\nt_f = [0.02, 0.05, 0.1]\nv_i = 3.0\n\
                v_f = [50.0, 100.0]\n[tables.optimal]\n";
    fs::write(folder.join("labels.toml"), spec).expect("is writable");
    shown(folder, &["run", "labels.toml", "--quiet"]);
    let lines = ["plot", "results/labels", "--x", "t_f", "--y", "work", "--table", "optimal", "--out", "lines.svg"];
    shown(folder, &lines);
    let both = words(&read(folder, "lines.svg"));
    for part in ["quartz, vf = 50 v0", "quartz, vf = 100 v0", "granite, vf = 50 v0", "granite, vf = 100 v0"] {
        assert!(both.contains(&format!("\n{part}\n")), "{part} in {both}");
    }
    assert!(!both.contains("a = "), "{both}");
    shown(folder, &[&lines[..], &["--where", "material=granite"]].concat());
    let one = words(&read(folder, "lines.svg"));
    assert!(one.contains("\ngranite, a = ") && one.contains("\nvf = 50 v0\n"), "{one}");
}

/// Materials in the order of their file, which is not that of their numbers; two pairs have the same `a` or the same `b`.
const MATERIALS: &str = "sample,a,b\nm1,0.010,0.015\nm2,0.009,0.0125\nm3,0.0085,0.0095\nm4,0.0075,0.011\nm5,0.006,0.010\n\
                         m6,0.011,0.012\nm7,0.012,0.008\nm8,0.010,0.006\nm9,0.014,0.009\nm10,0.005,0.009\n";

/// A dataset of these points in a folder of its own.
fn of_points(points: &str, spec: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("points.csv"), points).expect("is writable");
    fs::write(folder.path().join("spec.toml"), format!("name = \"m\"\n{spec}\n")).expect("is writable");
    shown(folder.path(), &["run", "spec.toml", "--quiet"]);
    folder
}

/// A dataset of [`MATERIALS`].
fn materials(axes: &str, tables: &str) -> tempfile::TempDir {
    of_points(MATERIALS, &format!("points = \"points.csv\"\n[axes]\nv_i = 3.0\nv_f = 100.0\n{axes}\n{tables}"))
}

/// What the terminal shows, and the words of a picture of the dataset `m`.
fn drawn(folder: &Path, arguments: &[&str]) -> (String, String) {
    let said = shown(folder, &[&["plot", "results/m", "--out", "drawn.svg"], arguments].concat());
    (said.split_once('\n').expect("a line").1.to_owned(), words(&read(folder, "drawn.svg")))
}

/// Seven of ten labelled points, evenly spread over the file of points: the picture and the terminal speak of labels.
#[test]
fn lines_of_labelled_points_are_an_even_choice_and_the_picture_states_it() {
    let folder = materials("t_f = { geomspace = [0.01, 0.1, 9] }", "[tables.optimal]");
    let folder = folder.path();
    let (said, words) = drawn(folder, &["--table", "optimal", "--y", "work"]);
    assert_eq!(said, "  7 of 10 lines (sample); choose others with --where\n");
    let names: Vec<&str> = words.lines().filter(|line| line.starts_with('m')).collect();
    assert_eq!(names, ["m1", "m3", "m4", "m6", "m7", "m9", "m10"]);
    assert!(words.contains("\n7 of 10 lines (sample) are shown.\n"), "{words}");
    let (said, one) = drawn(folder, &["--table", "optimal", "--y", "work", "--where", "sample=m2"]);
    assert!(said.is_empty() && one.contains("\nm2, a = 0.009 μ0, b = 0.0125 μ0, "), "{said}{one}");
}

/// Axes of labelled points are points over each other, and no axes of a map over another axis.
#[test]
fn labelled_points_are_dots_or_panels() {
    let folder = materials("t_f = { geomspace = [0.01, 0.1, 9] }", "[tables.optimal]\n[tables.crossover]");
    let folder = folder.path();
    // Every point has its dot and its name, those of equal `b` too.
    for x in ["a", "b"] {
        let (said, words) = drawn(folder, &["--table", "crossover", "--x", x, "--y", "t_cross"]);
        let names = words.lines().filter(|line| line.starts_with('m')).count();
        assert!(said.is_empty() && names == 10, "{said}{words}");
        assert_eq!(read(folder, "drawn.svg").matches("<circle").count(), 10);
    }
    assert_eq!(
        complaint(folder, &["plot", "results/m", "--table", "crossover", "--x", "a", "--color", "b"]),
        "error: --color b: an axis of 9 values\n  expected: at most 7, each with a symbol\n  help: --x a --y b draws a map\n"
    );
    drawn(folder, &["--table", "crossover", "--x", "a", "--y", "b"]);
    let plot = ["plot", "results/m", "--table", "optimal"];
    let with = |more: &[&str]| complaint(folder, &[&plot, more].concat());
    assert_eq!(
        with(&["--color", "strategy"]),
        "error: --color strategy: a map needs two axes of several values, which the table `optimal` does not have\n  found: t_f; \
         the label sample determines a, b\n  help: --y work draws lines; `slipsweep query` lists the words\n"
    );
    assert_eq!(
        with(&["--x", "t_f", "--y", "sample", "--color", "strategy"]),
        "error: --y sample: a label is no axis\n  expected: a column of numbers\n  help: --y work draws a line for each sample; --where \
         \"sample=…\" selects one\n"
    );
    let folder = materials(
        "t_f = { geomspace = [0.01, 0.1, 4] }\nv_ceiling = { geomspace = [2000.0, 5000.0, 4] }",
        "[tables.optimal]",
    );
    let (said, words) = drawn(folder.path(), &["--table", "optimal", "--color", "strategy"]);
    assert_eq!(said, "  9 of 10 panels (sample); choose others with --where\n");
    assert_eq!(words.lines().filter(|line| line.starts_with('m')).count(), 9, "{words}");
}

/// Dots have a symbol for each value of a label, of which several points may share one or have none, or of an axis of their points.
#[test]
fn dots_have_a_symbol_for_each_value_of_their_colour() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let points =
        "sample,rock,a,b\ns1,granite,0.010,0.015\ns2,granite,0.010,0.012\ns3,gabbro,0.020,0.011\ns4,,0.020,0.018\n";
    fs::write(folder.join("points.csv"), points).expect("is writable");
    // The rocks alone do not determine the points.
    let rocks: Vec<String> = points.lines().filter_map(|line| Some(format!("{}\n", line.split_once(',')?.1))).collect();
    fs::write(folder.join("rocks.csv"), rocks.concat()).expect("is writable");
    for (name, has_names) in [("points", true), ("rocks", false)] {
        let spec = format!(
            "name = \"{name}\"\npoints = \"{name}.csv\"\n[axes]\nt_f = 0.02\nv_i = 3.0\nv_f = 100.0\n[tables.optimal]\n"
        );
        fs::write(folder.join("spec.toml"), spec).expect("is writable");
        shown(folder, &["run", "spec.toml", "--quiet"]);
        let dataset = format!("results/{name}");
        let plot = ["plot", &dataset, "--table", "optimal", "--x", "b", "--y", "work", "--out", "drawn.svg", "--color"];
        for (colour, legend) in
            [("rock", &["granite", "gabbro", "no rock"][..]), ("a", &["a = 0.01 μ0", "a = 0.02 μ0"])]
        {
            shown(folder, &[&plot[..], &[colour]].concat());
            let words = words(&read(folder, "drawn.svg"));
            for text in legend {
                assert_eq!(words.lines().filter(|line| line == text).count(), 1, "{name} {colour} {text}: {words}");
            }
            assert!(!words.contains(" are shown."), "{words}");
            assert_eq!(words.lines().any(|line| line == "s3"), has_names, "{words}");
        }
    }
    let plot = ["plot", "results/points", "--table", "optimal", "--x", "a", "--y", "work"];
    assert!(shown(folder, &[&plot[..], &["--color", "sample", "--out", "drawn.svg"]].concat()).contains("drawn.svg"));
}

/// Groups without values take no place of those with values.
#[test]
fn groups_with_values_are_preferred() {
    let spec = "[axes]\na = 0.01\nb = 0.015\nv_i = 1e2\nv_f = { geomspace = [2e2, 1e4, 5] }\nk = { geomspace = [1e-4, 1.0, 25] }\n\
                m = 1e-12\n[tables.step_response]\n";
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    fs::write(folder.join("spec.toml"), format!("name = \"m\"\n{spec}")).expect("is writable");
    shown(folder, &["run", "spec.toml", "--quiet"]);
    let (said, words) =
        drawn(folder, &["--table", "step_response", "--x", "v_f", "--y", "settling_time", "--color", "k"]);
    let settled = shown(
        folder,
        &["query", "results/m", "select count(distinct k) as n from step_response where settling_time is not null"],
    );
    let settled: u32 = settled.split_whitespace().last().expect("a number").parse().expect("a number");
    assert!((8..25).contains(&settled), "{settled}");
    assert_eq!(said, format!("  7 of {settled} lines (k); choose others with --where\n"));
    assert_eq!(words.lines().filter(|line| line.starts_with("k = ")).count(), 7, "{words}");
    assert!(words.contains(&format!(" and {} more.", 25 - settled - 1)), "{words}");
}

/// The sign of a column shows in a map: by the critical stiffness, or by a line of its own.
#[test]
fn maps_of_both_signs_show_where_the_column_is_zero() {
    let spec = |friction: &str| {
        format!(
            "{friction}[axes]\na = 0.01\nb = 0.015\nv_i = 1e5\nv_f = {{ geomspace = [2e5, 1e7, 9] }}\n\
             k = {{ geomspace = [1e-4, 1e-1, 9] }}\nm = 1e-16\n[tables.stability]\ncolumns = [\"growth_rate\"]\n"
        )
    };
    let (known, svg) = picture("known", &spec(""), "stability");
    assert!(known.contains("\nkc(vf): growth rate = 0\n") && !known.contains("\ngrowth rate = 0\n"), "{known}");
    let lines = |svg: &str| svg.matches("stroke=\"#fff\"").count();
    let (found, other) = picture("found", &spec("[model]\nfriction = \"regularised\"\n"), "stability");
    assert!(found.contains("\ngrowth rate = 0\n") && !found.contains("kc"), "{found}");
    assert!(lines(&svg) > 0 && lines(&other) > 0);
    let (stable, _) = picture("stable", &spec("").replace("b = 0.015", "b = 0.005"), "stability");
    assert!(!stable.contains("= 0\n"), "{stable}");
}

/// A requested label distinguishes lines of points that have the same axes.
#[test]
fn regress_a_label_as_colour_distinguishes_equal_points() {
    let points = "rock,a,b\ngranite,0.03,0.05\nbasalt,0.03,0.05\nquartz,0.02,0.03\n";
    let axes = "points = \"points.csv\"\n[axes]\nt_f = [0.02, 0.05, 0.1]\nv_i = 3.0\nv_f = 100.0\n[tables.optimal]";
    let folder = of_points(points, axes);
    let (said, words) = drawn(folder.path(), &["--table", "optimal", "--y", "work", "--color", "rock"]);
    assert!(said.is_empty() && words.contains("\ngranite; basalt\nquartz\n"), "{said}{words}");
}

/// If only one block has a label, each of its dots has the name.
#[test]
fn regress_no_dot_has_the_name_of_a_block_alone() {
    let points = "rock,a,b\ngranite,0.020,0.030\ngranite,0.010,0.018\ngranite,0.015,0.016\n";
    let velocities = "v_i = 3.0\nv_f = 100.0\n";
    let blocks = format!(
        "[[block]]\npoints = \"points.csv\"\n[block.axes]\n{velocities}[[block]]\n[block.axes]\na = 0.03\nb = 0.05\n{velocities}\
         [tables.crossover]"
    );
    let folder = of_points(points, &blocks);
    let (_, words) = drawn(folder.path(), &["--table", "crossover", "--x", "a", "--y", "t_cross"]);
    assert_eq!(read(folder.path(), "drawn.svg").matches("<circle").count(), 4);
    assert_eq!(words.lines().filter(|line| *line == "granite").count(), 3, "{words}");
}

/// An axis of more values than are kept is as long as it is: sampled rows have cells for several of them.
#[test]
fn regress_maps_of_many_samples_are_filled() {
    let spec = format!(
        "[axes]\n{MATERIAL}v_f = {{ lhs = [10.0, 1000.0, 150000], seed = 1 }}\nt_f = {{ lhs = [0.01, 0.1, 150000], seed = 1 }}\n\
         [tables.optimal]\ncolumns = [\"work\"]\n"
    );
    let (map, svg) = picture("samples", &spec, "optimal");
    let note = "Several rows fall into one cell (193 cells of tf and 193 cells of vf); the cell shows the least value.";
    assert!(svg.contains("<image") && map.replace('\n', " ").contains(note), "{map}");
}

/// A cell with rows of several labels shows one of them, and a note states it.
#[test]
fn regress_several_labels_of_a_cell_are_noted() {
    let grid = "t_f = { geomspace = [0.01, 0.1, 5] }\nv_f = { geomspace = [50.0, 200.0, 5] }\nv_i = 3.0\n";
    let spec = format!("points = \"points.csv\"\n[axes]\n{grid}[tables.optimal]");
    let folder = of_points("rock,a,b\ngranite,0.03,0.05\nbasalt,0.03,0.05\n", &spec);
    let (_, words) = drawn(folder.path(), &["--table", "optimal", "--x", "t_f", "--y", "v_f", "--color", "rock"]);
    let note = "Several rows fall into one cell; the cell shows the first word of the legend.";
    assert!(words.contains("\ngranite\n") && words.replace('\n', " ").contains(note), "{words}");
}

/// A panel of a crossing without rows is blank, not hatched as infeasible.
#[test]
fn regress_panels_without_rows_are_blank() {
    let spec = "where = \"t_f < 0.025 or b < 0.045\"\n[axes]\nt_f = [0.01, 0.02, 0.03]\na = 0.03\nb = [0.04, 0.05]\nv_i = 3.0\n\
                v_f = 100.0\nalpha_2 = { linspace = [-0.3, 0.1, 11], unit = \"1/t_f\" }\n\
                alpha_3 = { linspace = [-0.3, 0.3, 11], unit = \"1/t_f^2\" }\n[tables.gap]\n";
    let (map, svg) = picture("blank", spec, "gap");
    // Five panels and the colour bar.
    assert_eq!(svg.matches("<image").count(), 6);
    assert!(map.contains("\nBlank panels have no rows.\n") && !map.contains("no row\n"), "{map}");
}
