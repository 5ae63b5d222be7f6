//! Tables at given points, computed as a sweep computes them.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{Array, RecordBatch};
use slipsweep::sweep::Sweep;
use slipsweep::table;

use super::case::{Case, Value};

/// How points are made a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grid {
    /// A row a point: all axes advance together.
    Points,
    /// A row a point with coefficients relative to `t_f`, which only ranges have: the first row of a block each.
    Shortcuts,
    /// A row a point, which reduces a landscape of `alphas` coefficients either way, from `-reach` to `reach`.
    Reduced { word: &'static str, reach: f64, alphas: usize },
}

/// What a cell holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    Null,
    Number(f64),
    Flag(bool),
    Word(String),
}

/// The cells of points, by column.
pub type Columns = BTreeMap<&'static str, Vec<Cell>>;

/// All columns of a table, also those that are written only if requested, at the points of `cases`.
pub fn compute(name: &'static str, grid: Grid, cases: &[Case], rtol: f64) -> Columns {
    let table = table::find(name).expect("is a table");
    let every: Vec<&str> = table.columns().iter().map(|column| column.name).chain([table::STATUS]).collect();
    let mut columns: Columns = every.iter().map(|name| (*name, vec![Cell::Null; cases.len()])).collect();
    // A sweep is bounded or not as a whole and has one form of friction, and its points have the same axes.
    let kind = |place: usize| {
        let Case { bounded, friction, axes, .. } = &cases[place];
        (*bounded, *friction, axes.iter().map(|(axis, _)| *axis).collect::<Vec<_>>())
    };
    let kinds: BTreeSet<_> = (0..cases.len()).map(kind).collect();
    for one in kinds {
        let places: Vec<usize> = (0..cases.len()).filter(|&place| kind(place) == one).collect();
        let (bounded, friction, _) = one;
        let chosen: Vec<&Case> = places.iter().map(|&place| &cases[place]).collect();
        // Regularised friction has not all columns.
        let is_known = |name: &&str| chosen.iter().any(|case| case.truths.iter().any(|(known, ..)| known == name));
        let names: Vec<&str> = every.iter().copied().filter(|name| friction == "log" || is_known(name)).collect();
        let all = names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
        let head = format!("name = \"budgets\"\n[model]\nvelocity_bound = {bounded}\nfriction = \"{friction}\"\n");
        let tail = |table: &str| format!("[tables.{table}]\nrtol = {rtol:?}\ncolumns = [{all}]\n");
        let sweeps: Vec<(String, usize)> = match grid {
            Grid::Points => vec![(format!("{}{head}{}{}", zip(&chosen), lists(&chosen), tail(name)), 1)],
            Grid::Shortcuts => vec![(format!("{head}{}{}", blocks(&chosen), tail(name)), 4)],
            Grid::Reduced { word, reach, alphas } => {
                let sweep = |case: &&Case| {
                    let mut axes = lists(&[case]);
                    for (alpha, unit) in [("alpha_2", "1/t_f"), ("alpha_3", "1/t_f^2")] {
                        let range = format!("{{ linspace = [{:?}, {reach:?}, {alphas}], unit = \"{unit}\" }}", -reach);
                        writeln!(axes, "{alpha} = {range}").expect("is a string");
                    }
                    (format!("{head}{axes}{}reduce = \"{word}\"\n", tail("gap")), 1)
                };
                chosen.iter().map(sweep).collect()
            }
        };
        let mut rows = sweeps.iter().flat_map(|(spec, each)| run(spec, &names).into_iter().step_by(*each));
        for place in places {
            let cells = rows.next().expect("has a row a point");
            for (name, cell) in names.iter().zip(cells) {
                columns.get_mut(name).expect("is a column")[place] = cell;
            }
        }
        assert!(rows.next().is_none(), "{name}: more rows than points");
    }
    columns
}

fn text(value: Value) -> String {
    match value {
        Value::Number(number) => format!("{number:?}"),
        Value::Word(word) => format!("\"{word}\""),
    }
}

fn zip(cases: &[&Case]) -> String {
    let axes = cases[0].axes.iter().map(|(axis, _)| format!("\"{axis}\"")).collect::<Vec<_>>().join(", ");
    format!("zip = [[{axes}]]\n")
}

fn lists(cases: &[&Case]) -> String {
    let mut axes = "[axes]\n".to_owned();
    for (place, (axis, _)) in cases[0].axes.iter().enumerate() {
        let value = |case: &&Case| {
            assert_eq!(case.axes[place].0, *axis, "points of one table have one order of axes");
            text(case.axes[place].1)
        };
        writeln!(axes, "{axis} = [{}]", cases.iter().map(value).collect::<Vec<_>>().join(", ")).expect("is a string");
    }
    axes
}

fn blocks(cases: &[&Case]) -> String {
    let mut blocks = String::new();
    for case in cases {
        blocks += "[[block]]\n[block.axes]\n";
        for &(axis, value) in &case.axes {
            let unit = match axis {
                "alpha_2" => "1/t_f",
                "alpha_3" => "1/t_f^2",
                _ => {
                    writeln!(blocks, "{axis} = {}", text(value)).expect("is a string");
                    continue;
                }
            };
            let Value::Number(first) = value else { panic!("{axis} is a number") };
            writeln!(blocks, "{axis} = {{ linspace = [{first:?}, {:?}, 2], unit = \"{unit}\" }}", first + 1.0)
                .expect("is a string");
        }
    }
    blocks
}

/// The rows of a sweep of one table.
fn run(spec: &str, names: &[&'static str]) -> Vec<Vec<Cell>> {
    let sweep = Sweep::parse(spec, Path::new(".")).unwrap_or_else(|error| panic!("{error}\n{spec}"));
    let batches = sweep.batches(sweep.requests[0].table.name()).expect("is requested");
    let rows = |batch: RecordBatch| {
        let columns: Vec<_> = names.iter().map(|name| batch.column_by_name(name).expect("is there").clone()).collect();
        let row = move |row: usize| columns.iter().map(|column| cell(column.as_ref(), row)).collect::<Vec<Cell>>();
        (0..batch.num_rows()).map(row).collect::<Vec<_>>()
    };
    batches.flat_map(|batch| rows(batch.expect("is computed"))).collect()
}

fn cell(column: &dyn Array, row: usize) -> Cell {
    if column.is_null(row) {
        return Cell::Null;
    }
    if let Some(numbers) = column.as_primitive_opt::<Float64Type>() {
        return Cell::Number(numbers.value(row));
    }
    if let Some(flags) = column.as_boolean_opt() {
        return Cell::Flag(flags.value(row));
    }
    let words = column.as_dictionary::<Int32Type>();
    match words.key(row) {
        Some(key) => Cell::Word(words.values().as_string::<i32>().value(key).to_owned()),
        None => Cell::Null,
    }
}
