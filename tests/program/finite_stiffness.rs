//! The tables of finite stiffness, written and read back: columns, what is null, what is shared.

use crate::common::{MATERIAL, files, numbers, read, run, sweep, words};

const AXES: &str = "t_f = [0.02, 0.037]\nk = [0.5, inf]\nm = 1e-6\n";

#[test]
fn compliant_is_written_and_its_members_are_shared_between_samplings() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = format!("{MATERIAL}{AXES}dt = [0.0, 1e-4, 1e-9]\n");
    let sweep = sweep(folder.path(), &axes, "[tables.compliant]\n");
    let outcome = run(&sweep, folder.path(), 1);
    assert_eq!((outcome.work.shortcuts, outcome.work.optima), (4, 2));
    // On the elastic spring the flow is linearised for each of two times, and the control sampled once for each.
    assert_eq!(outcome.work.simulations, 4);
    assert!(outcome.work.steps > 0, "{:?}", outcome.work);
    let frame = read(folder.path(), "compliant");
    let names: Vec<&str> = frame.get_column_names().into_iter().map(|name| name.as_str()).collect();
    assert_eq!(
        names.join(" "),
        "t_f a b v_i v_f k m dt alpha work work_optimal gap v_min v_max v_c_min v_c_max amplification sampling_error stiffness_ratio \
         status"
    );
    assert_eq!(words(&frame, "status"), ["ok"; 12]);
    let column = |name: &str| numbers(&frame, name);
    for name in ["alpha", "work", "work_optimal", "gap", "v_min", "v_max", "v_c_min", "v_c_max", "amplification"] {
        assert!(column(name).iter().all(Option::is_some), "{name}");
    }
    let (dt, k, t_f) = (column("dt"), column("k"), column("t_f"));
    for (row, error) in column("sampling_error").into_iter().enumerate() {
        // Not sampled, sampled, sampled more often than is simulated.
        assert_eq!(error.is_some(), dt[row] == Some(1e-4), "row {row}: {error:?}");
        let ratio = column("stiffness_ratio")[row].zip(k[row]).zip(t_f[row]).expect("is given");
        assert_eq!(ratio.0.0, ratio.0.1 * ratio.1 * ratio.1 / 1e-6);
    }
    for row in (0..12).filter(|&row| k[row] == Some(f64::INFINITY)) {
        assert_eq!([column("v_c_min")[row], column("v_c_max")[row]], [column("v_min")[row], column("v_max")[row]]);
    }
}

#[test]
fn compliant_reports_open_loop_errors_on_request() {
    let folder = tempfile::tempdir().expect("is writable");
    let tables = "[tables.compliant]\ncolumns = [\"open_loop_error\", \"amplification\"]\n";
    let outcome = run(&sweep(folder.path(), &format!("{MATERIAL}{AXES}"), tables), folder.path(), 2);
    assert_eq!(outcome.work.simulations, 4);
    let frame = read(folder.path(), "compliant");
    // Without an axis dt the control is not sampled.
    assert_eq!(numbers(&frame, "dt"), [Some(0.0); 4]);
    for (error, growth) in numbers(&frame, "open_loop_error").into_iter().zip(numbers(&frame, "amplification")) {
        assert!(error.zip(growth).is_some_and(|(error, growth)| error < 1e-10 * (1.0 + growth)), "{error:?}");
    }
}

#[test]
fn regularised_is_written_and_null_where_pieces_overlap() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = format!("{MATERIAL}{AXES}delta_t = [1e-3, 0.015]\n");
    let sweep = sweep(folder.path(), &axes, "[tables.regularised]\n");
    let [one, many] = [1, 3].map(|threads| {
        let out = folder.path().join(threads.to_string());
        run(&sweep, &out, threads);
        files(&out)
    });
    assert_eq!(one, many);
    let frame = read(&folder.path().join("1"), "regularised");
    let names: Vec<&str> = frame.get_column_names().into_iter().map(|name| name.as_str()).collect();
    assert_eq!(names.join(" "), "t_f a b v_i v_f k m delta_t work work_optimal gap v_min v_max v_c_min v_c_max status");
    let status = words(&frame, "status");
    assert_eq!(status, ["ok", "infeasible", "ok", "infeasible", "ok", "ok", "ok", "ok"]);
    for name in ["work", "work_optimal", "gap", "v_min", "v_max", "v_c_min", "v_c_max"] {
        let given: Vec<bool> = numbers(&frame, name).iter().map(Option::is_some).collect();
        assert_eq!(given, status.iter().map(|status| status == "ok").collect::<Vec<_>>(), "{name}");
    }
}
