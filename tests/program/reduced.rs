//! Landscapes reduced while they are computed, against the same reductions of the whole table.

use crate::common::{files, numbers, read, run, sweep, words};
use polars::prelude::DataFrame;

/// An acceleration, and a deceleration that is impossible in the shorter times; the coefficients vary slower than the time.
const AXES: &str =
    "alpha_2 = { linspace = [-0.5, 0.5, 301], unit = \"1/t_f\" }\nt_f = { geomspace = [0.001, 0.2, 4] }\n";
const MATERIAL: &str = "a = 0.03\nb = 0.05\nv_i = 3.0\nv_f = [100.0, 2.0]\n";
const FAST: &str = "alpha_3 = { linspace = [-0.5, 0.5, 299], unit = \"1/t_f^2\" }\n";

struct Group {
    /// `t_f` and `v_f`.
    key: [Option<f64>; 2],
    /// Gap, row in the group, and cells of the shortcuts that are ok.
    gaps: Vec<(f64, usize)>,
    rows: Vec<[Option<f64>; 6]>,
    status: Vec<String>,
}

fn keys(frame: &DataFrame) -> Vec<[Option<f64>; 2]> {
    numbers(frame, "t_f").into_iter().zip(numbers(frame, "v_f")).map(|(t_f, v_f)| [t_f, v_f]).collect()
}

/// The rows of the whole table by duration and final velocity, in the order of rows.
fn groups(frame: &DataFrame) -> Vec<Group> {
    let columns = ["alpha_2", "alpha_3", "work", "work_optimal", "gap", "v_min"].map(|name| numbers(frame, name));
    let (keys, status) = (keys(frame), words(frame, "status"));
    let mut groups: Vec<Group> = Vec::new();
    for row in 0..frame.height() {
        let key = keys[row];
        let place = groups.iter().position(|group| group.key == key).unwrap_or_else(|| {
            groups.push(Group { key, gaps: Vec::new(), rows: Vec::new(), status: Vec::new() });
            groups.len() - 1
        });
        let group = &mut groups[place];
        if status[row] == "ok" {
            group.gaps.push((columns[4][row].expect("is ok"), group.rows.len()));
        }
        group.rows.push(columns.each_ref().map(|column| column[row]));
        group.status.push(status[row].clone());
    }
    groups
}

#[test]
fn reductions_are_those_of_the_whole_table() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = format!("{AXES}{MATERIAL}{FAST}");
    run(&sweep(folder.path(), &axes, "[tables.gap]\n"), &folder.path().join("whole"), 2);
    let groups = groups(&read(&folder.path().join("whole"), "gap"));
    assert_eq!(groups.len(), 8);
    for reduce in ["min", "quantiles", "histogram"] {
        let sweep = sweep(folder.path(), &axes, &format!("[tables.gap]\nreduce = \"{reduce}\"\n"));
        let made = [1, 3].map(|threads| {
            let out = folder.path().join(format!("{reduce}-{threads}"));
            run(&sweep, &out, threads);
            files(&out)
        });
        assert!(made[0] == made[1], "{reduce}");
        let table = format!("gap_{reduce}");
        let frame = read(&folder.path().join(format!("{reduce}-1")), &table);
        assert_eq!(frame.height(), 8);
        let names: Vec<&str> = frame.get_column_names().into_iter().map(|name| name.as_str()).collect();
        let reported: Vec<_> = names[5..names.len() - 1].iter().map(|name| numbers(&frame, name)).collect();
        let (keys, status) = (keys(&frame), words(&frame, "status"));
        for (row, group) in groups.iter().enumerate() {
            assert_eq!(keys[row], group.key);
            let cells: Vec<Option<f64>> = reported.iter().map(|column| column[row]).collect();
            assert_eq!(cells[0], Some(group.gaps.len() as f64));
            let some = ["ok", "unproven", "below_bound", "infeasible"];
            let expected = some.into_iter().find(|word| group.status.iter().any(|status| status == word));
            assert_eq!(Some(status[row].as_str()), expected);
            let mut sorted = group.gaps.clone();
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let count = |from: f64, to: f64| sorted.iter().filter(|(gap, _)| (from..to).contains(gap)).count() as f64;
            let expected: Vec<Option<f64>> = match reduce {
                "min" => sorted.first().map_or(vec![None; 6], |(_, row)| group.rows[*row].to_vec()),
                "quantiles" => [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0]
                    .map(|fraction: f64| {
                        // The first value that at least this fraction of all does not exceed.
                        let all = sorted.len() as f64;
                        let place = (0..sorted.len()).find(|place| (place + 1) as f64 >= fraction * all - 1e-9);
                        place.map(|place| sorted[place].0)
                    })
                    .to_vec(),
                _ => {
                    let mut edges = vec![f64::NEG_INFINITY];
                    edges.extend([1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0, f64::INFINITY]);
                    edges.windows(2).map(|pair| Some(count(pair[0], pair[1]))).collect()
                }
            };
            assert_eq!(cells[1..], expected, "{reduce} at {:?}", group.key);
        }
    }
    // Not an empty comparison.
    let sizes: Vec<usize> = groups.iter().map(|group| group.gaps.len()).collect();
    assert!(sizes.iter().any(|size| *size > 10_000) && sizes.contains(&0), "{sizes:?}");
}
