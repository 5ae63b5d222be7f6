//! Grids against brute force: counts, order and identity of the rows of random blocks, and of blocks too large to be written out.

use std::collections::{BTreeSet, HashMap};
use std::fs;
use std::path::Path;
use std::sync::Arc;

use crate::common::{files, numbers, read, run, words};
use crate::support::Random;
use slipsweep::grid::{Axis, Block, Derived, Expression, Factor, Grid, Quantity, RowIndex, Scale, Values};
use slipsweep::sweep::{Plan, SpecError, Sweep};
use slipsweep::table::OPTIMUM_AXES;

/// The axes that random blocks are made of; words and their default lists are left to other tests.
const AXES: [Quantity; 7] = [
    Quantity::Time,
    Quantity::A,
    Quantity::B,
    Quantity::InitialVelocity,
    Quantity::FinalVelocity,
    Quantity::Alpha2,
    Quantity::Stiffness,
];

type Values1 = HashMap<Quantity, f64>;

/// An expression as text and as a function.
struct Formula {
    text: String,
    value: Box<dyn Fn(&Values1) -> f64>,
}

fn number(random: &mut Random, axes: &[Quantity]) -> Formula {
    let (x, y) = (axes[random.below(axes.len())], axes[random.below(axes.len())]);
    let c = random.below(4) as f64 + 0.5;
    match random.below(3) {
        0 => Formula { text: format!("{c} * {}", x.name()), value: Box::new(move |at| c * at[&x]) },
        1 => Formula {
            text: format!("{} + 2 * {}", x.name(), y.name()),
            value: Box::new(move |at| at[&x] + 2.0 * at[&y]),
        },
        _ => Formula {
            text: format!("max({}, {c}) - (-{})", x.name(), y.name()),
            value: Box::new(move |at| at[&x].max(c) + at[&y]),
        },
    }
}

fn condition(random: &mut Random, axes: &[Quantity], depth: usize) -> Formula {
    let (left, right) = (number(random, axes), number(random, axes));
    let c = random.below(12) as f64;
    let truth = |is: bool| f64::from(u8::from(is));
    match random.below(if depth == 0 { 2 } else { 4 }) {
        0 => Formula {
            text: format!("{} > {}", left.text, right.text),
            value: Box::new(move |at| truth((left.value)(at) > (right.value)(at))),
        },
        1 => Formula { text: format!("{} <= {c}", left.text), value: Box::new(move |at| truth((left.value)(at) <= c)) },
        2 => {
            let (one, two) = (condition(random, axes, depth - 1), condition(random, axes, depth - 1));
            Formula {
                text: format!("(({}) and not ({}))", one.text, two.text),
                value: Box::new(move |at| truth((one.value)(at) != 0.0 && (two.value)(at) == 0.0)),
            }
        }
        _ => {
            let (one, two) = (condition(random, axes, depth - 1), condition(random, axes, depth - 1));
            Formula {
                text: format!("{} or {}", one.text, two.text),
                value: Box::new(move |at| truth((one.value)(at) != 0.0 || (two.value)(at) != 0.0)),
            }
        }
    }
}

/// A random block, and its data for brute force.
struct Known {
    block: Block,
    derived: Vec<(Quantity, Formula)>,
    condition: Option<Formula>,
}

impl Known {
    fn new(random: &mut Random) -> Known {
        let mut left: Vec<Quantity> = AXES.to_vec();
        let mut take = |random: &mut Random| left.remove(random.below(left.len()));
        let mut factors = Vec::new();
        for _ in 0..2 + random.below(3) {
            let length = 1 + random.below(5);
            let axes = (0..1 + random.below(7) / 6).map(|_| Axis {
                quantity: take(random),
                scale: Scale::Model,
                // Few values, so that some repeat.
                values: Values::List((0..length).map(|_| random.below(6) as f64).collect()),
            });
            factors.push(Factor { axes: axes.collect(), ..Factor::default() });
        }
        let held: Vec<Quantity> = factors.iter().flat_map(|factor| &factor.axes).map(|axis| axis.quantity).collect();
        let mut known = held.clone();
        let (mut derived, mut formulas) = (Vec::new(), Vec::new());
        for _ in 0..random.below(3).min(AXES.len() - held.len()) {
            let (quantity, formula) = (take(random), number(random, &known));
            let expression = Expression::number(&formula.text, &known).expect("is an expression");
            derived.push(Derived { quantity, scale: Scale::Model, expression });
            formulas.push((quantity, formula));
            known.push(quantity);
        }
        let condition = (random.below(4) > 0).then(|| condition(random, &known, 2));
        let expression = condition
            .as_ref()
            .map(|formula| Expression::condition(&formula.text, &known, None).expect("is a condition"));
        Known { block: Block { factors, derived, condition: expression }, derived: formulas, condition }
    }

    /// The steps of all factors and the values of all axes at every kept point, in order.
    fn points(&self) -> Vec<(Vec<u64>, Values1)> {
        let lengths: Vec<u64> = self.block.factors.iter().map(Factor::len).collect();
        (0..lengths.iter().product::<u64>())
            .map(|point| {
                let mut rest = point;
                let mut steps: Vec<u64> =
                    lengths.iter().rev().map(|length| (rest % length, rest /= length).0).collect();
                steps.reverse();
                let mut at = Values1::new();
                for (factor, &step) in self.block.factors.iter().zip(&steps) {
                    at.extend(factor.axes.iter().map(|axis| (axis.quantity, axis.values.at(step))));
                }
                for (quantity, formula) in &self.derived {
                    let value = (formula.value)(&at);
                    at.insert(*quantity, value);
                }
                (steps, at)
            })
            .filter(|(_, at)| self.condition.as_ref().is_none_or(|condition| (condition.value)(at) != 0.0))
            .collect()
    }

    /// The rows of a table over `axes`: one a combination of the factors that these axes depend on.
    fn rows(&self, axes: &[Quantity]) -> Vec<Values1> {
        let mut seen = BTreeSet::new();
        let roots = self.block.roots(axes);
        let factors = self.block.factors_of(&roots);
        let reported = |steps: &[u64]| factors.iter().map(|&factor| steps[factor]).collect::<Vec<u64>>();
        let mut rows: Vec<(Vec<u64>, Values1)> = self
            .points()
            .into_iter()
            .filter(|(steps, _)| seen.insert(reported(steps)))
            .map(|(steps, mut at)| {
                at.retain(|quantity, _| axes.contains(quantity));
                (reported(&steps), at)
            })
            .collect();
        rows.sort_by(|one, other| one.0.cmp(&other.0));
        rows.into_iter().map(|(_, at)| at).collect()
    }
}

/// Compares every access to rows with the rows themselves.
fn check(row_index: &RowIndex, expected: &[Values1], axes: &[Quantity], random: &mut Random, place: &str) {
    assert_eq!(row_index.rows(), expected.len() as u64, "{place}");
    let count = expected.len();
    for _ in 0..4 {
        let start = random.below(count + 1);
        let end = start + random.below(count - start + 1);
        let (first, last) = (start as u64, end as u64);
        let view = row_index.view(first..last);
        for &quantity in axes {
            let runs = view.runs(quantity, first..last).expect("is an axis");
            let inner = first + (last - first) / 3;
            let got: Vec<f64> = runs
                .over(inner..last)
                .flat_map(|(step, length)| std::iter::repeat_n(runs.values()[step], length))
                .collect();
            let wanted: Vec<f64> = expected[inner as usize..end].iter().map(|at| at[&quantity]).collect();
            assert_eq!(got, wanted, "{place}: {quantity:?} in {inner}..{end}");
            for row in first..last {
                assert_eq!(runs.values()[runs.step_of(row)], expected[row as usize][&quantity], "{place}: {row}");
            }
        }
        for row in first..last.min(first + 3) {
            let point = view.point(row);
            for &quantity in axes {
                assert_eq!(point[quantity], expected[row as usize][&quantity], "{place}: {quantity:?} at {row}");
            }
        }
    }
}

#[test]
fn rows_of_random_blocks_are_those_of_nested_loops() {
    let mut random = Random(1);
    let (mut with_condition, mut dropped) = (0, 0);
    for case in 0..450 {
        let blocks: Vec<Known> = (0..1 + random.below(3) / 2).map(|_| Known::new(&mut random)).collect();
        let blocks_of = blocks.iter().map(|known| Arc::new(known.block.clone()));
        let grid = Grid { blocks: blocks_of.collect(), ..Grid::default() };
        let shared: Vec<Quantity> =
            AXES.into_iter().filter(|axis| blocks.iter().all(|known| known.block.scale(*axis).is_some())).collect();
        for _ in 0..3 {
            let axes: Vec<Quantity> = shared.iter().copied().filter(|_| random.below(3) > 0).collect();
            let texts: Vec<_> =
                blocks.iter().map(|known| known.condition.as_ref().map(|formula| &formula.text)).collect();
            let place = format!("case {case}, table over {axes:?}, where {texts:?}");
            let expected: Vec<Values1> = blocks.iter().flat_map(|known| known.rows(&axes)).collect();
            let row_index = grid.project(&axes).expect("is small");
            check(&row_index, &expected, &axes, &mut random, &place);
            with_condition += u64::from(texts.iter().any(Option::is_some));
            dropped += row_index.dropped();
        }
    }
    assert!(with_condition > 500 && dropped > 10_000, "{with_condition} {dropped}");
}

#[test]
fn rows_of_several_chunks_are_those_of_nested_loops() {
    // Chunks of a condition have 65,536 combinations.
    let lengths = [(Quantity::Time, 300), (Quantity::A, 2), (Quantity::FinalVelocity, 250)];
    let factor = |(quantity, length): (Quantity, u32)| {
        let values = Values::List((1..=length).map(f64::from).collect());
        Factor { axes: vec![Axis { quantity, scale: Scale::Model, values }], ..Factor::default() }
    };
    let axes = lengths.map(|(quantity, _)| quantity);
    for (text, holds) in [
        ("t_f < v_f", (|x| x[0] < x[2]) as fn([f64; 3]) -> bool),
        ("t_f * a * v_f > 30 and t_f <> 7", |x| x[0] * x[1] * x[2] > 30.0 && x[0] != 7.0),
        ("v_f = 250 and t_f > 250", |x| x[2] == 250.0 && x[0] > 250.0),
    ] {
        let condition = Expression::condition(text, &axes, None).expect("is a condition");
        let block = Block { factors: lengths.map(factor).to_vec(), condition: Some(condition), ..Block::default() };
        let grid = Grid { blocks: vec![Arc::new(block)], ..Grid::default() };
        let rows = grid.project(&axes).expect("is small");
        let all = (1..=300)
            .flat_map(|t_f| [1, 2].map(|a| [t_f, a]))
            .flat_map(|[t_f, a]| (1..=250).map(move |v_f| [t_f, a, v_f]));
        let expected: Vec<[f64; 3]> = all.map(|x| x.map(f64::from)).filter(|x| holds(*x)).collect();
        assert_eq!(rows.rows(), expected.len() as u64, "{text}");
        for (row, expected) in expected.iter().enumerate().step_by(11) {
            assert_eq!(axes.map(|axis| rows.point(row as u64)[axis]), *expected, "{text}: {row}");
        }
    }
}

#[test]
fn optimal_problems_of_random_blocks_are_distinguished() {
    let mut random = Random(2);
    for case in 0..200 {
        let known = Known::new(&mut random);
        let axes: Vec<Quantity> = AXES.into_iter().filter(|axis| known.block.scale(*axis).is_some()).collect();
        let grid = Grid { blocks: vec![Arc::new(known.block.clone())], ..Grid::default() };
        let all = grid.project(&axes).expect("is small");
        let few = grid.project(OPTIMUM_AXES).expect("is small");
        let roots = known.block.roots(OPTIMUM_AXES);
        // The number of a tuple, by its values: the same in either table, and another one for each.
        let mut number_of: HashMap<Vec<u64>, u64> = HashMap::new();
        for row_index in [&few, &all] {
            let tuples = row_index.tuples(OPTIMUM_AXES);
            let view = row_index.view(0..row_index.rows());
            for (tuple, rows) in view.tuples(&tuples, 0..row_index.rows()) {
                assert!(tuple < tuples.span(), "case {case}");
                for row in rows {
                    let point = view.point(row);
                    let values: Vec<u64> = roots.iter().map(|root| point[*root].to_bits()).collect();
                    assert_eq!(*number_of.entry(values).or_insert(tuple), tuple, "case {case}, row {row}");
                }
            }
        }
        let numbers: BTreeSet<u64> = number_of.values().copied().collect();
        assert_eq!(numbers.len(), number_of.len(), "case {case}");
        assert_eq!(few.distinct(OPTIMUM_AXES, u64::MAX), number_of.len() as u64, "case {case}");
    }
}

/// The spec of this text, with its name and tables added.
fn load(folder: &Path, text: &str, tables: &str) -> Result<Sweep, SpecError> {
    let path = folder.join("spec.toml");
    fs::write(&path, format!("name = \"test\"\n{text}\n{tables}")).expect("is writable");
    Sweep::load(&path)
}

#[test]
fn a_condition_over_billions_of_rows_costs_what_it_reads() {
    let folder = tempfile::tempdir().expect("is writable");
    // 7 axes, 4e12 rows; the condition reads two of them, a million combinations.
    let text = "where = \"v_f > v_i and alpha_2 < 0\"\n[axes]\nt_f = { geomspace = [0.01, 1.0, 100] }\n\
                v_i = { linspace = [2.0, 101.0, 100] }\na = { linspace = [0.01, 0.05, 10] }\n\
                v_f = { linspace = [2.0, 101.0, 100] }\nb = { linspace = [0.0, 0.1, 10] }\n\
                alpha_2 = { linspace = [-0.5, 0.5, 401], unit = \"1/t_f\" }\nalpha_3 = { linspace = [-1.0, 1.0, 1001], unit = \"1/t_f^2\" }\n";
    let sweep = load(folder.path(), text, "[tables.gap]\n[tables.optimal]\n[tables.crossover]\n").expect("is legal");
    let pairs: u64 = 100 * 99 / 2;
    let rows: Vec<u64> = Plan::new(&sweep).tables.iter().map(|table| table.rows).collect();
    assert_eq!(rows, [100 * 10 * 10 * pairs * 200 * 1001, 100 * 10 * 10 * pairs, 10 * 10 * pairs]);
    let gap = &sweep.requests[0].row_index;
    assert_eq!(gap.dropped(), 100 * 100 * 10 * 100 * 10 * 401 * 1001 - rows[0]);
    // The last row is the last point with v_i = 100, v_f = 101.
    let last = gap.point(rows[0] - 1);
    let values =
        [Quantity::Time, Quantity::InitialVelocity, Quantity::FinalVelocity, Quantity::Alpha3].map(|q| last[q]);
    assert_eq!(values, [1.0, 100.0, 101.0, 1.0]);
    assert_eq!(last[Quantity::Alpha2], -0.5 + 199.0 / 400.0);
}

const MATERIAL: &str = "a = 0.03\nb = 0.05\n";

/// A union of a zip, a condition on a computed axis and samples.
const UNION: &str = "[[block]]\nzip = [[\"t_f\", \"v_i\"]]\nwhere = \"v_f > 20 and alpha_2 <= 0.1\"\n[block.axes]\n\
    a = 0.03\nt_f = [0.02, 0.037, 0.049]\nb = [0.05, 0.04]\nv_i = [3.0, 2.0, 5.0]\nv_f = { expr = \"10 * v_i + t_f\" }\n\
    alpha_2 = { linspace = [-0.4, 0.2, 7], unit = \"1/t_f\" }\nalpha_3 = { linspace = [-0.4, 0.4, 9], unit = \"1/t_f^2\" }\n\
    [[block]]\n[block.axes]\nt_f = 0.02\nv_i = { sobol = [2.0, 5.0, 8], seed = 3 }\nv_f = { sobol = [20.0, 200.0, 8] }\n\
    a = { lhs = [0.02, 0.04, 5], seed = 1 }\nb = { lhs = [0.03, 0.06, 5] }\n\
    alpha_2 = { expr = \"-0.12\", unit = \"1/t_f\" }\nalpha_3 = { expr = \"alpha_2 / 2\", unit = \"1/t_f^2\" }\n";

#[test]
fn a_union_of_every_kind_of_block_is_the_same_on_any_threads() {
    let folder = tempfile::tempdir().expect("is writable");
    let sweep = load(folder.path(), UNION, "[tables.gap]\n[tables.optimal]\n[tables.stability]\n[tables.shortcut]\n")
        .expect("is legal");
    let plan = Plan::new(&sweep);
    let rows: Vec<u64> = plan.tables.iter().map(|table| table.rows).collect();
    // v_f is 30.02, 20.037 and 50.049; each kept, with five of seven alpha_2 in the first table.
    assert_eq!(rows, [3 * 2 * 5 * 9 + 8 * 5, 3 * 2 + 8 * 5, 3 * 2 + 8 * 5, 4 * (3 * 2 + 8 * 5)]);
    assert_eq!(plan.optima, 3 * 2 + 8 * 5);
    let made = [1, 2].map(|threads| {
        let out = folder.path().join(threads.to_string());
        let outcome = run(&sweep, &out, threads);
        assert_eq!(outcome.work.optima, plan.optima);
        files(&out)
    });
    assert_eq!(made[0], made[1]);

    let gap = read(&folder.path().join("1"), "gap");
    let column = |name: &str| -> Vec<f64> { numbers(&gap, name).into_iter().map(Option::unwrap_or_default).collect() };
    let [t_f, b, v_i, v_f] = ["t_f", "b", "v_i", "v_f"].map(column);
    assert_eq!((t_f[0], b[0], v_i[0], v_f[0]), (0.02, 0.05, 3.0, 30.02));
    assert_eq!((t_f[269], b[269], v_i[269], v_f[269]), (0.049, 0.04, 5.0, 50.049));
    // In the units of the axes, as written.
    assert_eq!((column("alpha_2")[270], column("alpha_3")[270]), (-0.12, -0.06));
    let sampled: BTreeSet<[u64; 2]> = (270..310).map(|row| [v_i[row].to_bits(), v_f[row].to_bits()]).collect();
    assert_eq!(sampled.len(), 8);
    assert!(
        v_i[270..].iter().all(|v| (2.0..=5.0).contains(v)) && v_f[270..].iter().all(|v| (20.0..=200.0).contains(v))
    );
    assert!(words(&gap, "status").iter().any(|status| status == "ok"));
}

#[test]
fn a_grid_written_in_another_way_has_the_same_rows() {
    let folder = tempfile::tempdir().expect("is writable");
    let product = format!("[axes]\nt_f = [0.02, 0.05]\n{MATERIAL}v_i = [3.0, 5.0]\nv_f = [50.0, 100.0]\n");
    let block =
        format!("[[block]]\n[block.axes]\nt_f = [0.02, 0.05]\n{MATERIAL}v_i = [3.0, 5.0]\nv_f = [50.0, 100.0]\n");
    let always = format!("where = \"v_f > v_i\"\n{product}");
    let zip = "zip = [[\"v_i\", \"v_f\"]]\n[axes]\nt_f = [0.02, 0.05]\na = 0.03\nb = 0.05\nv_i = [3.0, 3.0, 5.0, 5.0]\n\
               v_f = [50.0, 100.0, 50.0, 100.0]\n";
    let two = format!(
        "[[block]]\n[block.axes]\nt_f = 0.02\n{MATERIAL}v_i = [3.0, 5.0]\nv_f = [50.0, 100.0]\n\
         [[block]]\n[block.axes]\nt_f = 0.05\n{MATERIAL}v_i = [3.0, 5.0]\nv_f = [50.0, 100.0]\n"
    );
    let table = |name: &str, text: &str| {
        let sweep = load(folder.path(), text, "[tables.optimal]\n").expect("is legal");
        let out = folder.path().join(name);
        run(&sweep, &out, 1);
        (read(&out, "optimal"), sweep.hash(&sweep.requests[0]))
    };
    let (expected, hash) = table("product", &product);
    let (same, same_hash) = table("block", &block);
    assert!(same.equals_missing(&expected) && same_hash == hash);
    for (name, text) in [("always", always.as_str()), ("zip", zip), ("two", &two)] {
        let (frame, other_hash) = table(name, text);
        assert!(frame.equals_missing(&expected), "{name}");
        assert_ne!(other_hash, hash, "{name}");
    }
}

#[test]
fn words_are_compared_by_name() {
    let folder = tempfile::tempdir().expect("is writable");
    let text = format!(
        "where = \"family = 'bounded_friction' or tau_ceiling = inf\"\n[axes]\nt_f = 0.02\n{MATERIAL}v_i = 3.0\nv_f = 100.0\n\
         tau_ceiling = [1.2, 1.6, inf]\n"
    );
    let sweep = load(folder.path(), &text, "[tables.shortcut]\ncolumns = [\"work\"]\n").expect("is legal");
    run(&sweep, folder.path(), 1);
    let frame = read(folder.path(), "shortcut");
    let families = words(&frame, "family");
    // tau_ceiling varies slower than family, which is not written.
    let rest = ["step", "cubic", "bounded_velocity", "bounded_friction"];
    assert_eq!(families, [&["bounded_friction", "bounded_friction"][..], &rest].concat());
}

#[test]
fn samples_fill_their_boxes_evenly() {
    use slipsweep::grid::Design;
    // One point in each of n equal parts of every axis; of a Sobol sequence also in each box of n = 2^k parts of two axes.
    for (design, count) in [(Design::LatinHypercube, 100), (Design::Sobol, 64)] {
        for axis in 0..3 {
            let values = design.values(axis, count, 7);
            let parts: BTreeSet<u64> = values.iter().map(|value| (value * count as f64) as u64).collect();
            assert_eq!(parts, (0..count).collect(), "{design:?} {axis}");
        }
    }
    let (x, y) = (Design::Sobol.values(0, 64, 7), Design::Sobol.values(1, 64, 7));
    for columns in [2, 4, 8, 16, 32] {
        let boxes: BTreeSet<(u64, u64)> =
            x.iter().zip(&y).map(|(x, y)| ((x * columns as f64) as u64, (y * (64 / columns) as f64) as u64)).collect();
        assert_eq!(boxes.len(), 64, "{columns}");
    }
    assert_ne!(Design::LatinHypercube.values(0, 16, 1), Design::LatinHypercube.values(0, 16, 2));
    assert_ne!(Design::Sobol.values(0, 16, 1), Design::Sobol.values(0, 16, 2));
    // Values do not depend on the machine or on the version of the generators.
    assert_eq!(Design::Sobol.values(1, 2, 5), [0.6856530904769897, 0.3123617172241211]);
    assert_eq!(Design::LatinHypercube.values(1, 2, 5), [0.26811426894908796, 0.9098618628848139]);
}

#[test]
fn expressions_mean_what_they_say() {
    let at = |text: &str| -> f64 {
        let axes = [Quantity::InitialVelocity, Quantity::Time];
        let expression = Expression::number(text, &axes).unwrap_or_else(|fault| panic!("{text}: {fault:?}"));
        let one = |quantity, value| {
            let axis = Axis { quantity, scale: Scale::Model, values: Values::List(vec![value]) };
            Factor { axes: vec![axis], ..Factor::default() }
        };
        let block = Block {
            factors: vec![one(axes[0], 3.0), one(axes[1], 0.5)],
            derived: vec![Derived { quantity: Quantity::FinalVelocity, scale: Scale::Model, expression }],
            condition: None,
        };
        let grid = Grid { blocks: vec![Arc::new(block)], ..Grid::default() };
        grid.project(&[Quantity::FinalVelocity]).expect("is small").point(0)[Quantity::FinalVelocity]
    };
    for (text, value) in [
        ("1 + 2 * v_i ^ 2", 19.0),
        ("-v_i ^ 2", -9.0),
        ("2 ^ -1", 0.5),
        ("(2 ^ 3) ^ 2", 64.0),
        ("10 - 4 - 3", 3.0),
        ("12 / 4 / 3", 1.0),
        ("- - 2", 2.0),
        ("+v_i - -t_f", 3.5),
        ("1e-3 * 1E3", 1.0),
        (".5 + t_f", 1.0),
        ("min(v_i, t_f, 1) + max(v_i, t_f, 1)", 3.5),
        ("sqrt(v_i * v_i) + abs(-2)", 5.0),
        ("exp(0) + ln(1) + log10(1000)", 4.0),
        ("floor(2.5) + ceil(2.5)", 5.0),
        ("pow(v_i, 2)", 9.0),
        ("log(100) + ceiling(2.5) + power(2, 3) + least(4, v_i) + greatest(0, t_f)", 16.5),
        ("inf", f64::INFINITY),
        ("\n 1\n + 1 ", 2.0),
    ] {
        assert_eq!(at(text), value, "{text}");
    }
    let axes = [Quantity::InitialVelocity, Quantity::Time, Quantity::Family];
    for text in [
        "v_i > t_f and v_i < 4 or t_f = 1",
        "v_i between 1 and 3",
        "v_i not in (1, 2)",
        "not v_i == 3",
        "v_i != 2",
        "family in ('step', 'cubic')",
        "family <> 'step'",
        "true",
    ] {
        assert!(Expression::condition(text, &axes, None).is_ok(), "{text}");
    }
}

/// All tables over a small grid, with scales that are powers of two: nothing is rounded on the way.
const SI: &str = "[model]\nunits = \"si\"\nmu_0 = 0.5\nl = 0.00000095367431640625\nv_0 = 0.000000000931322574615478515625\n\
                  normal_stress = 1048576.0\n";

/// Specs of one point in SI and in scaled units.
fn both(folder: &Path) -> [std::path::PathBuf; 2] {
    let (mu_0, l, v_0, sigma): (f64, f64, f64, f64) = (0.5, 2.0_f64.powi(-20), 2.0_f64.powi(-30), 2.0_f64.powi(20));
    let axes = |one: f64, time: f64, v: f64, stress: f64, stiffness: f64, mass: f64, rate: f64| {
        let list = |size: f64, values: &[f64]| format!("{:?}", values.iter().map(|x| x * size).collect::<Vec<f64>>());
        format!(
            "t_f = {}\na = {}\nb = {}\nv_i = {}\nv_f = {}\nv_ceiling = {}\ntheta = {}\nt_left = {}\ntau_ceiling = {}\nk = [{:?}, inf]\nm = {}\ndt = {}\ndelta_t = {}\nalpha_2 = {}\nalpha_3 = {}\n",
            list(time, &[0.02, 0.5]),
            list(one, &[0.03]),
            list(one, &[0.05]),
            list(v, &[3.0]),
            list(v, &[100.0, 2.0]),
            list(v, &[400.0, f64::INFINITY]),
            list(time, &[0.25]),
            list(time, &[0.0625]),
            list(stress, &[1.6]),
            0.04 * stiffness,
            list(mass, &[1e-5]),
            list(time, &[0.0, 0.001]),
            list(time, &[0.001]),
            list(1.0, &[-6.0, 0.0]),
            list(rate, &[-160.0, 0.0]),
        )
    };
    let tables = "[tables.gap]\n[tables.best_cubic]\n[tables.optimal]\n[tables.crossover]\n[tables.shortcut]\n[tables.stability]\n[tables.step_response]\n\
                  [tables.compliant]\n[tables.regularised]\n[tables.feedback]\n";
    let (stress, time) = (mu_0 * sigma, l / v_0);
    let si = axes(mu_0, time, v_0, stress, stress / l, stress * l / (v_0 * v_0), 1.0 / time);
    let scaled = axes(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0);
    [("si", format!("{SI}[axes]\n{si}")), ("scaled", format!("[axes]\n{scaled}"))].map(|(name, text)| {
        let sweep = load(folder, &text, tables).expect("is legal");
        let out = folder.join(name);
        run(&sweep, &out, 2);
        out
    })
}

#[test]
fn si_and_scaled_runs_agree_to_the_last_bit() {
    let folder = tempfile::tempdir().expect("is writable");
    let [si, scaled] = both(folder.path());
    let (stress, time, v_0, l) = (2.0_f64.powi(19), 1024.0, 2.0_f64.powi(-30), 2.0_f64.powi(-20));
    let size = |unit: &str| match unit {
        "1" | "" => 1.0,
        "mu_0" => 0.5,
        "l/v_0" => time,
        "v_0/l" => 1.0 / time,
        "v_0" => v_0,
        "mu_0 sigma" => stress,
        "mu_0 sigma/l" => stress / l,
        "mu_0 sigma l" => stress * l,
        "mu_0 sigma v_0" => stress * v_0,
        "v_0^2/l" => v_0 * v_0 / l,
        "mu_0 sigma l/v_0^2" => stress * l / (v_0 * v_0),
        other => panic!("no size for {other}"),
    };
    let (mut compared, grid) = (0, Grid::default());
    for table in slipsweep::table::ALL.map(|table| slipsweep::table::over(table, false)) {
        let [mine, theirs] = [&si, &scaled].map(|out| read(out, table.name()));
        let axes = Quantity::ALL.into_iter().filter(|axis| table.axes().contains(axis) && !axis.is_tacit());
        let units = axes.map(|axis| (axis.name(), axis.unit(Scale::Model)));
        // `best_cubic` has its coefficients in the units of the axes, which are not relative here.
        let columns = table.columns().iter().filter(|column| !column.optional).map(|column| {
            let unit = match column.kind {
                slipsweep::table::Kind::Quantity(quantity) => quantity.unit(Scale::Model),
                _ => column.unit(&grid),
            };
            (column.name, unit)
        });
        for (name, unit) in units.chain(columns) {
            let Some(values) = mine.column(name).expect("is there").try_f64() else { continue };
            let rate = |row: usize| {
                let is_rate = unit.starts_with("1; ") && words(&mine, "family")[row] == "bounded_velocity";
                if is_rate {
                    1.0 / (time * time)
                } else if unit.starts_with("1; ") {
                    1.0
                } else {
                    size(unit)
                }
            };
            let expected = numbers(&theirs, name);
            for (row, value) in values.iter().enumerate() {
                assert_eq!(value, expected[row].map(|x| x * rate(row)), "{} {name} in row {row}", table.name());
                compared += 1;
            }
        }
        assert_eq!(words(&mine, "status"), words(&theirs, "status"), "{}", table.name());
    }
    assert!(compared > 1000, "{compared}");
}

#[test]
fn every_column_has_a_unit_that_si_knows() {
    let grid = Grid::default();
    for table in slipsweep::table::ALL {
        for axis in table.axes() {
            for scale in [Scale::Model, Scale::Duration] {
                assert!(slipsweep::model::is_known(axis.unit(scale)), "{}", axis.name());
            }
        }
        for column in table.columns() {
            assert!(slipsweep::model::is_known(column.unit(&grid)), "{} {}", table.name(), column.name);
        }
    }
}

#[test]
fn paper_parameters_in_si_are_the_scaled_ones() {
    // The paper's case of a soft spring: a = 0.003/0.6, b = 0.006/0.6, m = 2.5e-16, k = 7.5e-3, v from 1e5 to 3.2e6, t_f = 3.1e-6. It gives a and
    // mu_0; contacts are renewed over a micrometre, the law holds from 1 nm/s on, and the load is 1 MPa: then 4.5 GPa/m and 150 kg/m^2.
    let folder = tempfile::tempdir().expect("is writable");
    let si = "[model]\nunits = \"si\"\nmu_0 = 0.6\nl = 1e-6\nv_0 = 1e-9\nnormal_stress = 1e6\n[axes]\nt_f = 3.1e-3\na = 0.003\nb = 0.006\n\
              v_i = 1e-4\nv_f = 3.2e-3\nk = 4.5e9\nm = 150.0\n";
    let sweep = load(folder.path(), si, "[tables.stability]\n[tables.compliant]\n").expect("is legal");
    let point = sweep.grid.scaled(&sweep.grid.project(&Quantity::ALL).expect("is small").point(0));
    for (quantity, value) in [
        (Quantity::Time, 3.1e-6),
        (Quantity::A, 0.005),
        (Quantity::B, 0.01),
        (Quantity::InitialVelocity, 1e5),
        (Quantity::FinalVelocity, 3.2e6),
        (Quantity::Stiffness, 7.5e-3),
        (Quantity::Mass, 2.5e-16),
    ] {
        assert!((point[quantity] / value - 1.0).abs() <= 4e-16, "{quantity:?} {}", point[quantity]);
    }
    run(&sweep, folder.path(), 1);
    let stability = read(folder.path(), "stability");
    // k_c(v_f) = 0.00756 beyond the spring's 7.5e-3, and a frequency of 3.185e6 v_0/l.
    let number = |frame: &polars::prelude::DataFrame, name: &str| numbers(frame, name)[0].expect("is there");
    assert!((number(&stability, "k_c_f") / 4.536e9 - 1.0).abs() <= 1e-12);
    assert!((number(&stability, "frequency") / 3.185e3 - 1.0).abs() <= 1e-3);
    let compliant = read(folder.path(), "compliant");
    assert!((number(&compliant, "v_max") / 4.31e-3 - 1.0).abs() <= 1e-3);
}

/// The shortcut with continuous velocity is a point of the landscape, at which the family `cubic` has formulas of its own.
#[test]
fn the_greatest_velocity_of_a_cubic_shortcut_in_si_is_that_of_its_family() {
    let folder = tempfile::tempdir().expect("is writable");
    let si = "[model]\nunits = \"si\"\nmu_0 = 0.6\nl = 20e-6\nv_0 = 1e-8\nnormal_stress = 50e6\n[axes]\nt_f = [20.0, 60.0, 300.0]\na = 0.01\n\
              b = [0.008, 0.015]\nv_i = [1e-7, 3e-5]\nv_f = [1e-5, 2e-6]\nfamily = \"cubic\"\nalpha_2 = 0.0\n\
              alpha_3 = { expr = \"3 * 20e-6 * (1 / v_f - 1 / v_i) / t_f ^ 2\" }\nv_ceiling = [2e-5, inf]\n";
    let tables = "[tables.shortcut]\ncolumns = [\"v_max\"]\n[tables.gap]\ncolumns = [\"v_max\"]\n";
    run(&load(folder.path(), si, tables).expect("is legal"), folder.path(), 2);
    let (family, landscape) = (read(folder.path(), "shortcut"), read(folder.path(), "gap"));
    let known = numbers(&family, "v_max");
    let (mut compared, mut faster) = (0, 0);
    for (row, (found, ceiling)) in
        numbers(&landscape, "v_max").into_iter().zip(numbers(&landscape, "v_ceiling")).enumerate()
    {
        let (Some(found), Some(known), Some(ceiling)) = (found, known[row / 2], ceiling) else { continue };
        assert!((found / known - 1.0).abs() <= 1e-12, "row {row}: {found} {known}");
        compared += 1;
        faster += usize::from(found > ceiling);
    }
    assert!(compared > 20 && faster > 3, "{compared} {faster}");
}

#[test]
fn odd_values_are_written_as_they_were_requested() {
    let folder = tempfile::tempdir().expect("is writable");
    let axes = "[axes]\nt_f = [0.05, 0.02, 0.02, 1e-20]\na = [0.03, 1e-6]\nb = [-0.0, 5e-324]\nv_i = 3.0\n\
                v_f = { linspace = [100.0, 2.0, 3] }\nm = [-0.0, 1e-40]\nk = [inf, 1e-40]\n";
    let sweep = load(folder.path(), axes, "[tables.optimal]\n[tables.stability]\n").expect("is legal");
    let outcome = run(&sweep, folder.path(), 1);
    // A repeated duration is solved once.
    assert_eq!(outcome.work.optima, 3 * 2 * 2 * 3);
    let optimal = read(folder.path(), "optimal");
    let bits = |frame: &polars::prelude::DataFrame, name: &str| -> Vec<u64> {
        numbers(frame, name).into_iter().map(|value| value.expect("is there").to_bits()).collect()
    };
    let expected: Vec<[f64; 4]> = [0.05, 0.02, 0.02, 1e-20]
        .into_iter()
        .flat_map(|t_f| [0.03, 1e-6].map(|a| (t_f, a)))
        .flat_map(|(t_f, a)| [-0.0, 5e-324].map(|b| (t_f, a, b)))
        .flat_map(|(t_f, a, b)| [100.0, 51.0, 2.0].map(|v_f| [t_f, a, b, v_f]))
        .collect();
    for (place, name) in ["t_f", "a", "b", "v_f"].into_iter().enumerate() {
        let column: Vec<u64> = expected.iter().map(|row| row[place].to_bits()).collect();
        assert_eq!(bits(&optimal, name), column, "{name}");
    }
    let stability = read(folder.path(), "stability");
    let [zero, least] = [-0.0_f64, 1e-40].map(f64::to_bits);
    assert_eq!(bits(&stability, "m")[..4], [zero, zero, least, least]);
    assert!(numbers(&stability, "k_c_f").iter().flatten().all(|value| value.is_finite()));
}

#[test]
fn a_file_of_points_is_a_file_and_of_bounded_length() {
    let folder = tempfile::tempdir().expect("is writable");
    let message = |text: &str| {
        load(folder.path(), text, "[tables.optimal]\n").map(|_| ()).expect_err("is refused").found.to_string()
    };
    let axes = "[axes]\nt_f = 0.02\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n";
    fs::create_dir(folder.path().join("folder.csv")).expect("is writable");
    assert!(message(&format!("points = \"folder.csv\"\n{axes}")).ends_with("folder.csv: a folder, not a file"));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("/dev/zero", folder.path().join("endless.csv")).expect("is writable");
        assert!(
            message(&format!("points = \"endless.csv\"\n{axes}"))
                .ends_with("endless.csv: a device or a named pipe, not a file")
        );
    }
    fs::write(folder.path().join("long.csv"), format!("a\n{}", "1\n".repeat((1 << 22) + 1))).expect("is writable");
    assert!(message(&format!("points = \"long.csv\"\n{axes}")).ends_with("long.csv: 4194305 points or more"));
}

#[test]
fn regress_files_of_points_that_are_not_quite_csv() {
    let folder = tempfile::tempdir().expect("is writable");
    let found = |file: &str, content: &[u8]| {
        fs::write(folder.path().join(file), content).expect("is writable");
        let error = load(folder.path(), &format!("points = \"{file}\"\n"), "[tables.optimal]\n");
        let error = error.map(|_| ()).expect_err("is refused");
        error.found.rsplit_once('/').map_or_else(|| error.found.to_string(), |(_, found)| found.to_owned())
    };
    let csv = |content: &[u8]| found("cases.csv", content);
    for content in [&b"t_f;a;b\n1;2;3\n"[..], b"t_f\ta\n1\t2\n", b"t_f,a\r1,2\r"] {
        assert!(csv(content).starts_with("cases.csv:1: columns or lines that end with ; or a tab"));
    }
    assert_eq!(csv(b",t_f,a\n0,1,2\n"), "cases.csv:1: column 1 has no name");
    assert_eq!(csv(b"\xff\xfet\0_\0f\0"), "cases.csv: line 1 is not UTF-8");
}
