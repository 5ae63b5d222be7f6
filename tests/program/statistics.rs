//! What footers say of a table is what its rows hold.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use slipsweep::dataset::{Cell, CheckDepth, Folder, Row, Survey, TableStatistics, frame};
use slipsweep::grid::Point;
use slipsweep::protocol::Status;
use slipsweep::sweep::Plan;
use slipsweep::table;

use super::common::{LANDSCAPE, MATERIAL, run, sweep};

/// Many transitions; the first part of `gap` holds some of them, the second one the others.
const MANY: &str = "t_f = { geomspace = [0.01, 0.1, 14] }\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n\
                    alpha_2 = { linspace = [-0.5, 0.5, 151], unit = \"1/t_f\" }\n\
                    alpha_3 = { linspace = [-0.5, 0.5, 151], unit = \"1/t_f^2\" }\n";

/// Few and many transitions over two parts, families that do not arrive, predictions, flags, an infinite axis, and tables of few rows.
const SPECS: [(&str, &str); 5] = [
    (LANDSCAPE, "[tables.gap]\n[tables.optimal]\n[tables.crossover]\n"),
    (MANY, "[tables.gap]\n[tables.optimal]\n"),
    (
        "t_f = [0.02, 0.037]\na = 0.03\nb = [0.05, 0.06]\nv_i = 3.0\nv_f = [50.0, 100.0]\nfamily = [\"step\", \"cubic\", \"bounded_velocity\"]\n",
        "[tables.shortcut]\n",
    ),
    (
        "a = 0.03\nb = 0.05\nv_i = 3.0\nv_f = [50.0, 100.0]\nk = { geomspace = [1e-3, 1.0, 5] }\nm = [0.0, 1e-10]\n",
        "[tables.stability]\n[tables.step_response]\n",
    ),
    (MATERIAL, "[tables.stability]\n"),
];

fn number(cell: &Cell) -> Option<f64> {
    if let Cell::Number(number) = cell { Some(*number) } else { None }
}

fn word(cell: &Cell) -> &str {
    if let Cell::Word(word) = cell { word } else { "" }
}

fn at<'a>(row: &'a Row, name: &str) -> &'a Cell {
    row.iter().find(|(known, _)| known == name).map_or(&Cell::Missing, |(_, cell)| cell)
}

/// All rows of a table, read back.
fn rows(folder: &Folder, table: &str, parts: u64) -> Vec<Row> {
    let parts = (0..parts).map(|part| frame::read_all(&folder.part(table, part)).expect("is sound"));
    parts.flat_map(|frame| (0..frame.height).map(|row| frame.row(row)).collect::<Vec<_>>()).collect()
}

/// Compares statistics with the rows, one by one.
fn compare(name: &str, statistics: &TableStatistics, rows: &[Row]) {
    let table = table::find(name).expect("is a table");
    for status in Status::ALL {
        let count = rows.iter().filter(|row| word(at(row, "status")) == status.name()).count() as u64;
        assert_eq!(statistics.status[status as usize], count, "{name} {}", status.name());
    }
    assert_eq!(statistics.columns.len(), rows[0].len(), "{name}");
    for column in table.columns().iter().filter(|column| !at(&rows[0], column.name).eq(&Cell::Missing)) {
        let cells: Vec<&Cell> = rows.iter().map(|row| at(row, column.name)).collect();
        let numbers: Vec<f64> = cells.iter().filter_map(|cell| number(cell)).collect();
        if let Some(range) = statistics.ranges.iter().find(|range| range.column == column.name) {
            let least = numbers.iter().copied().fold(f64::INFINITY, f64::min);
            let greatest = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            assert_eq!((range.count, range.least, range.greatest), (numbers.len() as u64, least, greatest), "{name}");
        } else {
            let (_, counts) = statistics.words.iter().find(|(known, _)| known == column.name).expect("is counted");
            let mut expected = BTreeMap::new();
            for cell in cells.iter().filter(|cell| ***cell != Cell::Missing) {
                *expected.entry(word(cell).to_owned()).or_insert(0) += 1;
            }
            assert_eq!(*counts, expected, "{name}.{}", column.name);
        }
    }
    let cells = |row: &Row| row.iter().map(|(_, cell)| cell.clone()).collect::<Vec<_>>();
    let whole = (rows.len() <= 12).then(|| rows.iter().map(cells).collect::<Vec<_>>());
    assert_eq!(
        statistics.rows.as_ref().map(|rows| rows.iter().map(|row| row.cells.clone()).collect()),
        whole,
        "{name}"
    );
    let is_counted = |row: &&Row| word(at(row, "status")) == "ok" && word(at(row, "family")) != "step";
    let mut least: Vec<(String, &Row)> = Vec::new();
    for row in rows.iter().filter(is_counted) {
        let Some(gap) = number(at(row, "gap")) else { continue };
        let axes = if word(at(row, "family")).is_empty() {
            ["t_f", "a", "b", "v_i", "v_f"]
        } else {
            ["family", "a", "b", "v_i", "v_f"]
        };
        let key = format!("{:?}", axes.map(|axis| at(row, axis)));
        match least.iter_mut().find(|(known, _)| *known == key) {
            Some((_, known)) if number(at(known, "gap")).is_some_and(|known| gap < known) => *known = row,
            Some(_) => {}
            None => least.push((key, row)),
        }
    }
    if least.len() > 12 {
        let gap = |row: &Row| number(at(row, "gap")).expect("has one");
        least.sort_by(|one, other| gap(one.1).total_cmp(&gap(other.1)));
        least.truncate(1);
    }
    let least: Vec<_> = least.into_iter().map(|(_, row)| cells(row)).collect();
    assert_eq!(statistics.least().map(|row| row.cells.clone()).collect::<Vec<_>>(), least, "{name}");
    assert_eq!(least.is_empty(), !["gap", "shortcut"].contains(&name), "{name}");
    let mut predicted: BTreeMap<String, BTreeMap<String, u64>> = BTreeMap::new();
    for (prediction, row) in
        table.prediction().iter().flat_map(|prediction| rows.iter().map(move |row| (prediction, row)))
    {
        let mut point = Point::default();
        for axis in prediction.axes {
            point[*axis] = number(at(row, axis.name())).expect("is a number");
        }
        let found = word(at(row, prediction.column)).to_owned();
        if !found.is_empty() {
            *predicted.entry((prediction.word)(&point).to_owned()).or_default().entry(found).or_insert(0) += 1;
        }
    }
    assert_eq!(statistics.predicted, predicted, "{name}");
    assert_eq!(statistics.predicted.is_empty(), name != "step_response", "{name}");
}

fn survey(out: &Path, sweep: &slipsweep::sweep::Sweep) -> Survey {
    let manifest = Plan::new(sweep).manifest(sweep);
    Survey::new(&Folder::new(out, &sweep.name), &manifest, CheckDepth::Footer)
}

#[test]
fn footers_hold_what_the_rows_do() {
    for (axes, tables) in SPECS {
        let folder = tempfile::tempdir().expect("is writable");
        let sweep = sweep(folder.path(), axes, tables);
        let outcome = run(&sweep, folder.path(), 2);
        let at = Folder::new(folder.path(), &sweep.name);
        let surveyed = survey(folder.path(), &sweep);
        for (table, statistics) in surveyed.tables.iter().zip(&outcome.statistics) {
            assert_eq!(table.statistics, *statistics, "{}", table.name);
            compare(&table.name, statistics, &rows(&at, &table.name, table.parts));
        }
        // What is kept counts as what is made.
        for table in &surveyed.tables {
            fs::remove_file(at.part(&table.name, 0)).expect("is there");
        }
        assert_eq!(run(&sweep, folder.path(), 1).statistics, outcome.statistics);
        assert_eq!(run(&sweep, folder.path(), 2).statistics, outcome.statistics);
    }
}

/// Nothing but the footers is read: without the rest of the bytes the answer is the same.
#[test]
fn a_survey_reads_the_footers_alone() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), LANDSCAPE, "[tables.gap]\n");
    run(&sweep, folder.path(), 2);
    let whole = survey(folder.path(), &sweep);
    for part in 0..2 {
        let path = Folder::new(folder.path(), "test").part("gap", part);
        let mut bytes = fs::read(&path).expect("is there");
        let footer = u32::from_le_bytes(bytes[bytes.len() - 8..][..4].try_into().expect("has four bytes")) as usize + 8;
        let data = bytes.len() - footer;
        // The contents of a page; its header is checked with the footer.
        bytes[data / 2] ^= 1;
        fs::remove_file(&path).expect("is there");
        fs::write(&path, bytes).expect("is writable");
    }
    assert_eq!(survey(folder.path(), &sweep), whole);
}

#[test]
fn statistics_add_up_in_any_order() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = sweep(folder.path(), MANY, "[tables.gap]\n[tables.optimal]\n");
    run(&sweep, folder.path(), 2);
    let at = Folder::new(folder.path(), "test");
    let parts: Vec<TableStatistics> = (0..2)
        .map(|part| {
            let manifest = Plan::new(&sweep).manifest(&sweep);
            match at.state(&manifest, "gap", part, CheckDepth::Whole) {
                slipsweep::dataset::State::There { statistics } => *statistics,
                state => panic!("{state:?}"),
            }
        })
        .collect();
    let [first, second] = [&parts[0], &parts[1]];
    assert_ne!(first, second);
    assert_eq!(first.clone().merge(second.clone()), second.clone().merge(first.clone()));
    assert_eq!(TableStatistics::default().merge(first.clone()), *first);
    assert_eq!(first.clone().merge(TableStatistics::default()), *first);
}
