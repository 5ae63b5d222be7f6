//! Whole runs through the library: what is written, that nothing else decides its bytes, and what it costs.

use std::fs;
use std::sync::Arc;

use crate::common::{LANDSCAPE, MATERIAL, files, numbers, read, run, sweep, words, write_batch};
use crate::reference;
use arrow_array::{ArrayRef, Float64Array, Int64Array, RecordBatch};
use parquet::file::reader::{FileReader, SerializedFileReader};
use slipsweep::dataset::{Build, Folder};
use slipsweep::sweep::{Plan, RunError, Sweep, TableOutcome};
use slipsweep::table::{RunStats, Signal};

const ALL_TABLES: &str = "[tables.gap]\n[tables.best_cubic]\n[tables.optimal]\n[tables.crossover]\n";

#[test]
fn bytes_do_not_depend_on_threads() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), LANDSCAPE, ALL_TABLES);
    let made = [1, 2, 7].map(|threads| {
        let out = folder.path().join(threads.to_string());
        let outcome = run(&sweep, &out, threads);
        (outcome, files(&out))
    });
    assert_eq!(made[0].1.len(), 6);
    assert_eq!(made[0], made[1]);
    assert_eq!(made[0], made[2]);
}

#[test]
fn finished_parts_are_kept_and_the_rest_is_the_same_as_without_a_break() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), LANDSCAPE, "[tables.gap]\n[tables.optimal]\n");
    run(&sweep, folder.path(), 2);
    let whole = files(&folder.path().join("test"));
    fs::remove_file(folder.path().join("test/gap/part-000000.parquet")).expect("is there");
    let outcome = run(&sweep, folder.path(), 2);
    let one = |kept, made, rows| TableOutcome { kept, made, damaged: 0, rows };
    assert_eq!(outcome.tables, [one(1, 1, 1 << 18), one(1, 0, 0)]);
    // The first part touches two of the three durations.
    assert_eq!((outcome.work.optima, outcome.work.landscapes), (2, 2));
    assert_eq!(files(&folder.path().join("test")), whole);
    let again = run(&sweep, folder.path(), 2);
    assert_eq!(again.work, RunStats::default());
    assert_eq!(files(&folder.path().join("test")), whole);
}

#[test]
fn work_is_insided_and_counted_exactly() {
    let folder = tempfile::tempdir().expect("is writable");
    let spent = |name: &str, tables: &str| {
        let out = folder.path().join(name);
        run(&sweep(folder.path(), LANDSCAPE, tables), &out, 2).work
    };
    let optimal = spent("optimal", "[tables.optimal]\n");
    assert_eq!((optimal.optima, optimal.landscapes, optimal.best, optimal.crossovers), (3, 0, 0, 0));
    let crossover = spent("crossover", "[tables.crossover]\n");
    assert_eq!((crossover.optima, crossover.landscapes, crossover.best, crossover.crossovers), (0, 0, 0, 1));
    // A duration is cut by the border of the two parts, and prepared in each.
    let gap = spent("gap", "[tables.gap]\n");
    assert_eq!((gap.optima, gap.landscapes, gap.best, gap.crossovers), (3, 4, 0, 0));
    let mut all = optimal;
    all.quadratures += gap.quadratures - optimal.quadratures + crossover.quadratures;
    all.nodes += gap.nodes - optimal.nodes + crossover.nodes;
    all.landscapes += gap.landscapes;
    all.crossovers += crossover.crossovers;
    assert_eq!(spent("three", "[tables.optimal]\n[tables.crossover]\n[tables.gap]\n"), all);
}

#[test]
fn columns_that_are_not_requested_cost_nothing() {
    let folder = tempfile::tempdir().expect("is writable");
    let feasible = {
        let sweep = sweep(folder.path(), LANDSCAPE, "[tables.gap]\ncolumns = [\"v_min\", \"work\"]\n");
        let work = run(&sweep, folder.path(), 2).work;
        let frame = read(folder.path(), "gap");
        let names: Vec<&str> = frame.get_column_names().into_iter().map(|name| name.as_str()).collect();
        assert_eq!(names, ["t_f", "a", "b", "v_i", "v_f", "alpha_2", "alpha_3", "work", "v_min", "status"]);
        let feasible = numbers(&frame, "work").into_iter().flatten().count() as u64;
        // One quadrature a feasible shortcut, none for the others, no optimum.
        assert_eq!((work.quadratures, work.optima, work.landscapes), (feasible, 0, 4));
        feasible
    };
    assert_eq!(feasible, 217_891);
    let out = folder.path().join("v_min");
    let sweep = sweep(folder.path(), LANDSCAPE, "[tables.gap]\ncolumns = [\"v_min\"]\n");
    assert_eq!(run(&sweep, &out, 2).work, RunStats { landscapes: 4, ..RunStats::default() });
    assert_eq!(numbers(&read(&out, "gap"), "v_min"), numbers(&read(folder.path(), "gap"), "v_min"));
}

#[test]
fn order_of_axes_changes_the_order_of_rows_alone() {
    let folder = tempfile::tempdir().expect("is writable");
    let alphas = "alpha_2 = { linspace = [-0.4, 0.2, 7], unit = \"1/t_f\" }\n\
                  alpha_3 = { linspace = [-0.4, 0.4, 9], unit = \"1/t_f^2\" }\n";
    let times = "t_f = [0.02, 0.037, 0.049, 0.02]\n";
    let mut seen = Vec::new();
    for (name, axes) in [
        ("slow", format!("{times}{MATERIAL}{alphas}")),
        ("middle", alphas.replace("alpha_3", &format!("{times}alpha_3")) + MATERIAL),
        ("fast", format!("{alphas}{MATERIAL}{times}")),
    ] {
        let sweep = sweep(folder.path(), &axes, "[tables.gap]\n");
        let out = folder.path().join(name);
        let work = run(&sweep, &out, 2).work;
        // A duration that is given twice is solved once.
        assert_eq!((work.optima, work.landscapes), (3, 3), "{name}");
        let frame = read(&out, "gap");
        let columns = ["t_f", "alpha_2", "alpha_3", "work", "work_optimal", "gap", "v_min"];
        let cells = columns.map(|column| numbers(&frame, column));
        let status = words(&frame, "status");
        let mut rows: Vec<_> = (0..frame.height())
            .map(|row| (cells.each_ref().map(|column| column[row].map(f64::to_bits)), status[row].clone()))
            .collect();
        rows.sort();
        assert_eq!(rows.len(), 4 * 7 * 9);
        seen.push((rows, work));
    }
    assert_eq!(seen[0], seen[1]);
    assert_eq!(seen[0], seen[2]);
}

#[test]
fn coefficients_are_the_same_in_either_unit() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = |alphas: &str| format!("t_f = 0.5\n{MATERIAL}{alphas}");
    // Powers of two: the units convert exactly.
    let relative = axes(
        "alpha_2 = { linspace = [-0.25, 0.25, 3], unit = \"1/t_f\" }\n\
         alpha_3 = { linspace = [-0.25, 0.25, 3], unit = \"1/t_f^2\" }\n",
    );
    let plain = axes("alpha_2 = [-0.5, 0.0, 0.5]\nalpha_3 = { linspace = [-1.0, 1.0, 3], unit = \"v_0/l\" }\n");
    let tables = "[tables.gap]\n[tables.best_cubic]\n";
    let [relative, plain] = [("relative", relative), ("plain", plain)].map(|(name, axes)| {
        let out = folder.path().join(name);
        run(&sweep(folder.path(), &axes, tables), &out, 1);
        (read(&out, "gap"), read(&out, "best_cubic"))
    });
    assert_eq!(numbers(&relative.0, "alpha_3"), [-0.25, 0.0, 0.25].repeat(3).into_iter().map(Some).collect::<Vec<_>>());
    assert_eq!(numbers(&plain.0, "alpha_3"), [-1.0, 0.0, 1.0].repeat(3).into_iter().map(Some).collect::<Vec<_>>());
    for column in ["work", "gap", "v_min"] {
        assert_eq!(numbers(&relative.0, column), numbers(&plain.0, column));
    }
    let scaled =
        |column, unit: f64| numbers(&plain.1, column).iter().map(|cell| cell.map(|x| x * unit)).collect::<Vec<_>>();
    assert_eq!(numbers(&relative.1, "alpha_2"), scaled("alpha_2", 0.5));
    assert_eq!(numbers(&relative.1, "alpha_3"), scaled("alpha_3", 0.25));
}

/// The products of coefficients in natural units with the duration keep all digits.
#[test]
fn reference_coefficients_in_natural_units_are_good_to_rtol_up_to_the_border_of_feasibility() {
    const AXES: [&str; 7] = ["a", "b", "v_i", "v_f", "t_f", "alpha_2", "alpha_3"];
    let folder = tempfile::tempdir().expect("is writable");
    let rows = reference::table("landscape_natural");
    assert!(rows.len() >= 80, "{} rows", rows.len());
    let points = rows.iter().map(|row| AXES.map(|axis| row.text(axis)).join(","));
    let text = [AXES.join(",")].into_iter().chain(points).collect::<Vec<String>>().join("\n");
    fs::write(folder.path().join("points.csv"), text).expect("is writable");
    for rtol in [1e-6, 1e-9, 1e-12] {
        let path = folder.path().join("spec.toml");
        let text = format!(
            "name = \"test\"\npoints = \"points.csv\"\n[accuracy]\nrtol = {rtol:e}\n[tables.gap]\n\
             columns = [\"work\", \"v_min\", \"v_max\", \"work_error\"]\n"
        );
        fs::write(&path, text).expect("is writable");
        let out = folder.path().join(format!("{rtol:e}"));
        run(&Sweep::load(&path).expect("is legal"), &out, 2);
        let frame = read(&out, "gap");
        let status = words(&frame, "status");
        for (i, row) in rows.iter().enumerate() {
            assert_eq!(status[i], row.text("status"), "{row:?}");
            for name in ["work", "v_min", "v_max"] {
                let (found, expected) = (numbers(&frame, name)[i].expect("is feasible"), row.number(name));
                let error = (found - expected).abs();
                assert!(error <= 1.01 * rtol * expected.abs(), "{name} {found} at {rtol} in {row:?}");
                if name == "work" {
                    let bound = numbers(&frame, "work_error")[i].expect("is feasible");
                    assert!(error <= bound, "{error:e} beyond {bound:e} at {rtol} in {row:?}");
                }
            }
        }
    }
}

#[test]
fn points_vary_together_and_slowest() {
    let folder = tempfile::tempdir().expect("is writable");
    fs::write(folder.path().join("cases.csv"), "v_f, \"b\"\n# soft\n50,0.04\n\n100,0.05\n50,0.04\n")
        .expect("is writable");
    let path = folder.path().join("spec.toml");
    let text =
        "name = \"test\"\npoints = \"cases.csv\"\n[axes]\nt_f = [0.01, 0.02]\na = 0.03\nv_i = 3.0\n[tables.optimal]\n";
    fs::write(&path, text).expect("is writable");
    let sweep = Sweep::load(&path).expect("is legal");
    let work = run(&sweep, folder.path(), 1).work;
    assert_eq!(work.optima, 4);
    let frame = read(folder.path(), "optimal");
    let column = |name| numbers(&frame, name).into_iter().flatten().collect::<Vec<f64>>();
    assert_eq!(column("v_f"), [50.0, 50.0, 100.0, 100.0, 50.0, 50.0]);
    assert_eq!(column("b"), [0.04, 0.04, 0.05, 0.05, 0.04, 0.04]);
    assert_eq!(column("t_f"), [0.01, 0.02].repeat(3));
    let work = column("work");
    assert_eq!(work[..2], work[4..]);
    assert_ne!(work[..2], work[2..4]);

    // Points from Parquet, with whole numbers as such, give the same grid.
    let v_f: ArrayRef = Arc::new(Int64Array::from(vec![50, 100, 50]));
    let b: ArrayRef = Arc::new(Float64Array::from(vec![0.04, 0.05, 0.04]));
    let cases = RecordBatch::try_from_iter([("v_f", v_f), ("b", b)]).expect("is a table");
    write_batch(&folder.path().join("cases.parquet"), &cases);
    fs::write(&path, text.replace("cases.csv", "cases.parquet")).expect("is writable");
    assert_eq!(Sweep::load(&path).expect("is legal").grid, sweep.grid);
}

#[test]
fn columns_are_those_of_the_contract() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = format!("t_f = 0.02\n{MATERIAL}alpha_2 = 0.0\nalpha_3 = 0.0\nk = inf\nm = 0.0\ntau_ceiling = 2.0\n");
    run(
        &sweep(folder.path(), &axes, &format!("{ALL_TABLES}[tables.shortcut]\n[tables.stability]\n")),
        folder.path(),
        1,
    );
    let names = |table| {
        let frame = read(folder.path(), table);
        frame.get_column_names().into_iter().map(|name| name.as_str()).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(names("gap"), "t_f a b v_i v_f alpha_2 alpha_3 work work_optimal gap v_min status");
    assert_eq!(names("best_cubic"), "t_f a b v_i v_f alpha_2 alpha_3 work work_optimal gap v_min status");
    assert_eq!(
        names("optimal"),
        "t_f a b v_i v_f v_ceiling tau_ceiling work v_start v_end time_at_floor time_at_v_ceiling time_at_tau_ceiling hamiltonian \
         theta_max strategy status"
    );
    assert_eq!(
        names("shortcut"),
        "t_f a b v_i v_f family tau_ceiling alpha work work_optimal gap v_min v_max friction_max status"
    );
    assert_eq!(
        names("stability"),
        "a b v_i v_f k m k_od k_c_i k_c_f stable_i stable_f v_crit growth_rate frequency decay_rate status"
    );
    assert_eq!(
        names("crossover"),
        "a b v_i v_f t_cross t_floor t_cheapest t_min t_turn t_free_in t_free_out work_at_t_cross work_at_t_floor work_at_t_cheapest work_at_t_min \
         work_at_t_turn status"
    );
}

#[test]
fn numbers_are_null_where_there_are_none() {
    let folder = tempfile::tempdir().expect("is writable");
    // A deceleration too short for v >= 1 whose unbounded shortcuts exist, one that is long enough, and shortcuts that do not exist.
    let axes = "t_f = [0.35, 0.41]\na = 0.03\nb = 0.05\nv_i = 100.0\nv_f = 3.0\n\
                alpha_2 = { linspace = [0.0, 0.3233, 2], unit = \"1/t_f\" }\nalpha_3 = 0.0\n";
    run(&sweep(folder.path(), axes, "[tables.gap]\n[tables.optimal]\n"), folder.path(), 1);
    let optimal = read(folder.path(), "optimal");
    assert_eq!(words(&optimal, "status"), ["infeasible", "ok"]);
    assert_eq!(words(&optimal, "strategy"), ["", "floor"]);
    for column in ["work", "v_start", "v_end", "time_at_floor", "hamiltonian", "theta_max"] {
        let cells = numbers(&optimal, column);
        assert_eq!((cells[0], cells[1].is_some()), (None, true), "{column}");
    }
    let gap = read(folder.path(), "gap");
    let columns = ["work", "v_min", "work_optimal", "gap"].map(|column| numbers(&gap, column));
    let status = words(&gap, "status");
    let mut kinds = std::collections::BTreeSet::new();
    for row in 0..gap.height() {
        let given = columns.each_ref().map(|column| column[row].is_some());
        assert!(columns.iter().filter_map(|column| column[row]).all(f64::is_finite));
        kinds.insert((row < 2, status[row].clone(), given));
    }
    let expected = [
        (false, "below_bound".to_owned(), [true, true, true, true]),
        (false, "infeasible".to_owned(), [false, false, false, false]),
        (true, "infeasible".to_owned(), [false, false, false, false]),
    ];
    assert_eq!(kinds.into_iter().collect::<Vec<_>>(), expected);
}

#[test]
fn footers_name_the_origin_of_a_part() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), LANDSCAPE, "[tables.gap]\ncolumns = [\"v_min\"]\n");
    run(&sweep, folder.path(), 2);
    for (part, rows) in [(0, (0, 262_144)), (1, (262_144, 482_403))] {
        let path = Folder::new(folder.path(), "test").part("gap", part);
        let reader = SerializedFileReader::new(fs::File::open(path).expect("is there")).expect("is Parquet");
        let file = reader.metadata().file_metadata();
        let entry = |key: &str| {
            let entries = file.key_value_metadata().expect("has entries");
            entries.iter().find(|entry| entry.key == key).and_then(|entry| entry.value.clone()).expect("is there")
        };
        assert_eq!(entry("slipsweep.spec"), sweep.text);
        assert_eq!(entry("slipsweep.hash"), sweep.hash(&sweep.requests[0]));
        assert_eq!(entry("slipsweep.version"), env!("CARGO_PKG_VERSION"));
        assert_eq!(entry("slipsweep.revision"), Build::this().revision);
        assert_eq!(entry("slipsweep.table"), "gap");
        assert_eq!(
            (entry("slipsweep.row_start").parse(), entry("slipsweep.row_end").parse()),
            (Ok(rows.0), Ok(rows.1))
        );
        assert_eq!(file.num_rows(), rows.1 - rows.0);
    }
}

#[test]
fn a_run_that_should_stop_stops() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), LANDSCAPE, "[tables.gap]\n");
    let signal = Signal::default();
    signal.stop();
    let place = Folder::new(folder.path(), "test");
    let stopped = slipsweep::sweep::run(&sweep, &place, 2, &signal);
    assert!(matches!(stopped, Err(RunError::Stopped(_))), "{stopped:?}");
    assert_eq!(
        files(place.path()).into_keys().map(|path| path.display().to_string()).collect::<Vec<_>>(),
        ["manifest.json"]
    );
}

#[test]
fn a_sweep_of_a_billion_rows_plans_at_once() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = LANDSCAPE.replace("401", "1000").replace("[0.02, 0.037, 0.049]", "{ geomspace = [0.001, 2.0, 1000] }");
    let start = std::time::Instant::now();
    let sweep = sweep(folder.path(), &axes, ALL_TABLES);
    let plan = Plan::new(&sweep);
    assert!(start.elapsed() < std::time::Duration::from_millis(100));
    let sizes: Vec<(u64, u64)> = plan.tables.iter().map(|table| (table.rows, table.parts)).collect();
    assert_eq!(sizes, [(1_000_000_000, 3815), (1000, 1), (1000, 1), (1, 1)]);
    assert_eq!(plan.optima, 1000);
}

#[test]
fn paper_landscape_read_back() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), LANDSCAPE, "[tables.gap]\n[tables.crossover]\n");
    let outcome = run(&sweep, folder.path(), 2);
    let statistics = &outcome.statistics[0];
    assert_eq!(statistics.status.iter().sum::<u64>(), 482_403);
    // Near theta = 0 the friction of 83 shortcuts is negative.
    assert_eq!(statistics.status[3..], [83, 0, 0]);
    let least: Vec<_> = statistics.least().collect();
    assert_eq!(least.len(), 3);
    // Where the paper sees the best shortcut at t_f = 0.02: (-0.12, -0.068), to a step of the grid.
    let cell = |row: usize, column: &str| {
        let place = statistics.columns.iter().position(|(name, _)| name == column).expect("is there");
        let slipsweep::dataset::Cell::Number(value) = least[row].cell(place) else { panic!("{:?}", least[row]) };
        *value
    };
    let alpha = |i: f64| -0.5 + i * 0.0025;
    let best =
        [[0.02, alpha(152.0), alpha(174.0)], [0.037, alpha(179.0), alpha(308.0)], [0.049, alpha(170.0), alpha(395.0)]];
    for (row, expected) in best.iter().enumerate() {
        assert_eq!(["t_f", "alpha_2", "alpha_3"].map(|column| cell(row, column)), *expected);
    }
    let frame = read(folder.path(), "gap");
    let gaps = numbers(&frame, "gap");
    let status = words(&frame, "status");
    // Within the model no shortcut beats the optimum.
    assert!(
        gaps.iter().zip(&status).filter(|(_, status)| *status == "ok").all(|(gap, _)| gap.is_some_and(|gap| gap > 0.0))
    );
}

#[test]
fn families_are_words_and_say_which_bound_stops_them() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = "t_f = [0.35, 0.41]\na = 0.03\nb = 0.05\nv_i = 100.0\nv_f = 3.0\n\
                family = [\"bounded_friction\", \"step\"]\ntau_ceiling = [0.5, 1.5]\n";
    let tables = "[tables.shortcut]\ncolumns = [\"work\", \"terminal_error\", \"bound\"]\n";
    run(&sweep(folder.path(), axes, tables), folder.path(), 1);
    let shortcut = read(folder.path(), "shortcut");
    let names = shortcut.get_column_names().into_iter().map(|name| name.as_str()).collect::<Vec<_>>().join(" ");
    assert_eq!(names, "t_f a b v_i v_f family tau_ceiling work terminal_error bound status");
    let families: Vec<String> = words(&shortcut, "family");
    let of_one_time = ["bounded_friction", "bounded_friction", "step", "step"];
    assert_eq!(families, [of_one_time, of_one_time].concat());
    // t_min is 0.395, and friction at the ends is 0.91 and 0.98.
    assert_eq!(words(&shortcut, "bound")[..5], ["time", "time", "time", "time", "friction"]);
    assert_eq!(words(&shortcut, "status")[..5], ["infeasible"; 5]);
    let (work, terminal_error) = (numbers(&shortcut, "work"), numbers(&shortcut, "terminal_error"));
    assert_eq!(work[..5], [None; 5]);
    for row in [6, 7] {
        // theta(t_f) v_f - 1 of a step in closed form.
        let expected = (3.0 / 100.0 - 1.0) * (-3.0 * 0.41_f64).exp();
        assert!(terminal_error[row].is_some_and(|error| (error / expected - 1.0).abs() < 1e-12));
        assert_eq!((words(&shortcut, "status")[row].as_str(), work[row].is_some()), ("ok", true));
    }
}

#[test]
fn stability_is_flagged() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = "a = 0.005\nb = 0.01\nv_i = 1e5\nv_f = 3.2e6\nk = [7.5e-3, 0.00757, inf]\nm = [0.0, 2.5e-16]\n";
    run(&sweep(folder.path(), axes, "[tables.stability]\n"), folder.path(), 2);
    let frame = read(folder.path(), "stability");
    let flags = |name: &str| -> Vec<Option<bool>> {
        frame.column(name).expect("is there").bool().expect("holds flags").iter().collect()
    };
    assert_eq!(flags("stable_i"), [Some(true); 6]);
    assert_eq!(flags("stable_f"), [true, false, true, true, true, true].map(Some));
    let given = |name: &str| numbers(&frame, name).into_iter().map(|cell| cell.is_some()).collect::<Vec<_>>();
    // No third eigenvalue without mass, none at all of a rigid spring, no critical velocity where all are stable.
    assert_eq!(given("decay_rate"), [false, true, false, true, false, false]);
    assert_eq!(given("growth_rate"), [true, true, true, true, false, false]);
    assert_eq!(given("v_crit"), [false, true, false, true, false, false]);
}

#[test]
fn errors_are_bounded_for_every_work_and_gap_where_a_spec_names_them() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = format!(
        "t_f = [0.02, 0.037, 0.06]\n{MATERIAL}alpha_2 = {{ linspace = [-0.2, 0.2, 5], unit = \"1/t_f\" }}\n\
         alpha_3 = {{ linspace = [-0.2, 0.2, 5], unit = \"1/t_f^2\" }}\nk = 0.01\nm = 1e-9\ndelta_t = 1e-4\ntau_ceiling = 1.5\n"
    );
    let tables = ["gap", "optimal", "best_cubic", "shortcut", "compliant", "regularised"];
    for rtol in [1e-6, 1e-10] {
        let specs: String = tables
            .iter()
            .map(|&table| {
                let columns = match table {
                    "optimal" | "best_cubic" => "\"work\", \"work_error\"",
                    _ => "\"work\", \"gap\", \"work_error\", \"gap_error\"",
                };
                format!("[tables.{table}]\nrtol = {rtol:e}\ncolumns = [{columns}]\n")
            })
            .collect();
        let out = folder.path().join(format!("{rtol:e}"));
        run(&sweep(folder.path(), &axes, &specs), &out, 2);
        for table in tables {
            let frame = read(&out, table);
            let mut reported = 0;
            for (value, bound) in [("work", "work_error"), ("gap", "gap_error")] {
                let Ok(_) = frame.column(bound) else { continue };
                let scale = if value == "gap" { 1.0 } else { f64::NAN };
                for (value, bound) in numbers(&frame, value).into_iter().zip(numbers(&frame, bound)) {
                    assert_eq!(value.is_some(), bound.is_some(), "{table}");
                    let (Some(value), Some(bound)) = (value, bound) else { continue };
                    let size = value.abs().max(scale);
                    assert!(bound > 0.0 && bound < 2.0 * (rtol + 1e-13) * size, "{table} {value} {bound}");
                    reported += 1;
                }
            }
            assert!(reported > 2, "{table}");
        }
    }
}
