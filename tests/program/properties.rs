//! Laws of specs, grids and readers that hold whatever is written: a failure is shrunk, and kept in
//! `properties.regressions`, whose cases come first in every run.
//!
//! The draws are the same in every run; `PROPTEST_RNG_SEED` and `PROPTEST_CASES` request others and more of them.

use std::fs;
use std::path::Path;

use arrow_array::RecordBatch;
use arrow_array::cast::AsArray;
use arrow_array::types::Float64Type;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{select, subsequence};
use proptest::test_runner::{Config, FileFailurePersistence, RngSeed};
use slipsweep::grid::{Point, Quantity, RowIndex};
use slipsweep::sweep::{SpecError, Sweep};

fn config(cases: u32) -> Config {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/program/properties.regressions");
    let chosen = Config::default();
    Config {
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct(file))),
        cases: if std::env::var_os("PROPTEST_CASES").is_some() { chosen.cases } else { cases },
        rng_seed: match chosen.rng_seed {
            RngSeed::Random => RngSeed::Fixed(2026),
            fixed => fixed,
        },
        ..chosen
    }
}

/// The axes of the table `gap`, whose values are all different below.
const AXES: [&str; 7] = ["t_f", "a", "b", "v_i", "v_f", "alpha_2", "alpha_3"];

fn parse(text: &str) -> Result<Sweep, SpecError> {
    Sweep::parse(text, Path::new(""))
}

fn rows(text: &str) -> RowIndex {
    parse(text).unwrap_or_else(|error| panic!("{text}{error}")).requests.swap_remove(0).row_index
}

/// Two numbers are the same if no bit differs; a quantity that the grid lacks is NaN on both sides.
fn bits(point: &Point) -> Vec<u64> {
    Quantity::ALL.map(|quantity| point[quantity].to_bits()).to_vec()
}

fn all(rows: &RowIndex) -> Vec<Vec<u64>> {
    (0..rows.rows()).map(|row| bits(&rows.point(row))).collect()
}

/// Legal values of an axis, as likely near either end of its range as inside, to the last bit.
fn value(name: &'static str) -> BoxedStrategy<f64> {
    let domain = Quantity::from_name(name).expect("is an axis").domain();
    let (least, greatest) = (domain.least, domain.greatest);
    let inside = move |bits: u64| f64::from_bits(least.to_bits() + bits % (greatest.to_bits() - least.to_bits()) + 1);
    if least < 0.0 {
        return prop_oneof![least..greatest, -1.0..1.0, Just(0.0), Just(-0.0), Just(least), Just(greatest)].boxed();
    }
    let next = least.next_up();
    prop_oneof![4 => any::<u64>().prop_map(inside), 4 => least.max(1.5)..greatest.min(100.0), 1 => Just(next), 1 => Just(greatest)]
        .boxed()
}

/// One to three values of each axis, in any order, some of them twice.
fn axes() -> impl Strategy<Value = Vec<(&'static str, Vec<f64>)>> {
    AXES.map(|name| vec(value(name), 1..=3)).to_vec().prop_map(|values| AXES.into_iter().zip(values).collect())
}

fn written(axes: &[(&str, Vec<f64>)]) -> String {
    axes.iter().map(|(name, values)| format!("{name} = {values:?}\n")).collect()
}

fn spec(head: &str, axes: &[(&str, Vec<f64>)]) -> String {
    format!("name = \"test\"\n{head}[axes]\n{}[tables.gap]\n", written(axes))
}

proptest! {
    #![proptest_config(config(256))]

    /// A product has as many rows as its axes have combinations, and every value comes back to the last bit, the last axis fastest.
    #[test]
    fn rows_are_the_product_of_what_was_written(axes in axes()) {
        let rows = rows(&spec("", &axes));
        prop_assert_eq!(rows.rows(), axes.iter().map(|(_, values)| values.len() as u64).product::<u64>());
        for row in 0..rows.rows() {
            let (point, mut rest) = (rows.point(row), row as usize);
            for (name, values) in axes.iter().rev() {
                let found = point[Quantity::from_name(name).expect("is an axis")];
                prop_assert_eq!(found.to_bits(), values[rest % values.len()].to_bits(), "{} at {}", name, row);
                rest /= values.len();
            }
        }
    }

    /// What a row is does not depend on which rows it is seen with.
    #[test]
    fn a_row_is_the_same_in_every_shard(axes in axes(), cuts in vec(any::<prop::sample::Index>(), 1..6)) {
        let rows = rows(&spec("where = \"v_f > v_i or alpha_2 > 0 or k < 1.5\"\n", &[axes, vec![("k", vec![1.0, 2.0])]].concat()));
        let mut cuts: Vec<u64> = cuts.iter().map(|cut| cut.index(rows.rows() as usize) as u64).collect();
        cuts.extend([0, rows.rows()]);
        cuts.sort_unstable();
        for pair in cuts.windows(2) {
            let view = rows.view(pair[0]..pair[1]);
            for row in pair[0]..pair[1] {
                prop_assert_eq!(bits(&view.point(row)), bits(&rows.point(row)), "{} in {:?}", row, pair);
            }
        }
    }

    /// A condition and its contrary share the rows of the grid out, in order; blocks put them one after another again.
    #[test]
    fn a_condition_and_its_contrary_make_the_whole(axes in axes(), level in -1.0..3.0) {
        let condition = format!("alpha_2 + ln(v_i) - b * {level:?} < 2 and not (t_f > 50 or a = v_f)");
        let part = |condition: &str| match parse(&spec(&format!("where = \"{condition}\"\n"), &axes)) {
            Ok(mut sweep) => all(&sweep.requests.swap_remove(0).row_index),
            // Refused, for a sweep without a point is a mistake.
            Err(error) => { assert_eq!(&*error.found, "matches no points"); Vec::new() }
        };
        let (kept, left, whole) = (part(&condition), part(&format!("not ({condition})")), all(&rows(&spec("", &axes))));
        prop_assert_eq!(kept.len() + left.len(), whole.len());
        let (mut kept_rows, mut left_rows) = (kept.iter().peekable(), left.iter().peekable());
        for row in &whole {
            prop_assert!(kept_rows.next_if_eq(&row).is_some() || left_rows.next_if_eq(&row).is_some());
        }
        if !kept.is_empty() && !left.is_empty() {
            let block = |condition: &str| format!("[[block]]\nwhere = \"{condition}\"\n[block.axes]\n{}", written(&axes));
            let blocks = format!("name = \"test\"\n{}{}[tables.gap]\n", block(&condition), block(&format!("not ({condition})")));
            prop_assert_eq!(all(&rows(&blocks)), [kept, left].concat());
        }
    }

    /// A zip is the rows of the product at which its axes are at the same place.
    #[test]
    fn a_zip_is_the_diagonal_of_the_product(axes in axes(), zipped in subsequence(AXES.to_vec(), 2..=4), length in 1_usize..=3) {
        let long = |(name, values): &(&'static str, Vec<f64>)| {
            let values = (0..if zipped.contains(name) { length } else { values.len() }).map(|place| values[place % values.len()]);
            (*name, values.collect::<Vec<f64>>())
        };
        let axes: Vec<(&str, Vec<f64>)> = axes.iter().map(long).collect();
        let zip = rows(&spec(&format!("zip = [{zipped:?}]\n"), &axes));
        let product = rows(&spec("", &axes));
        let mut expected: Vec<Vec<u64>> = Vec::new();
        for row in 0..product.rows() {
            let mut rest = row as usize;
            let places: Vec<(&str, usize)> =
                axes.iter().rev().map(|(name, values)| (*name, (rest % values.len(), rest /= values.len()).0)).collect();
            let mut diagonal = places.iter().filter(|(name, _)| zipped.contains(name)).map(|(_, place)| place);
            let first = diagonal.next();
            if diagonal.all(|place| Some(place) == first) {
                expected.push(bits(&product.point(row)));
            }
        }
        prop_assert_eq!(zip.rows(), expected.len() as u64);
        // A zip stands where the first of its axes does, so the order may be another one.
        let mut found = all(&zip);
        found.sort();
        expected.sort();
        prop_assert_eq!(found, expected);
    }

    /// The hash of a spec depends on its meaning: neither comments, spaces and the order of keys nor the way to write a number
    /// change it, and any number does.
    #[test]
    fn the_hash_is_that_of_the_meaning(axes in axes(), changed in select(AXES.to_vec()), comment in "[ -~]{0,20}") {
        let hash = |text: &str| {
            let sweep = parse(text).unwrap_or_else(|error| panic!("{text}{error}"));
            sweep.hash(&sweep.requests[0])
        };
        let plain = hash(&format!("name = \"test\"\n[model]\nvelocity_bound = true\n[accuracy]\nrtol = 1e-9\n[axes]\n{}[tables.gap]\n", written(&axes)));
        let other: String = axes.iter().map(|(name, values)| {
            let values: Vec<String> = values.iter().map(|value| format!("  {value:e} ,# {comment}\n")).collect();
            format!("# {comment}\n{name}=[{}]\n\n", values.concat())
        }).collect();
        let same = format!("[tables]\ngap = {{}} # {comment}\n[axes]\n{other}[accuracy]\nrtol = 0.1e-8\n[model]\nunits = \"dimensionless\"\n");
        prop_assert_eq!(&plain, &hash(&format!("description = \"other\"\nname = \"other\"\n{same}")));
        let mut axes = axes;
        let values = &mut axes.iter_mut().find(|(name, _)| *name == changed).expect("is there").1;
        let last = values.len() - 1;
        values[last] = if values[last] > 2.0 { values[last].next_down() } else { values[last].next_up() };
        let next = format!("name = \"test\"\n[model]\nvelocity_bound = true\n[accuracy]\nrtol = 1e-9\n[axes]\n{}[tables.gap]\n", written(&axes));
        prop_assert_ne!(plain, hash(&next));
    }

    /// Any bytes are points, or a short error with its place.
    #[test]
    fn any_bytes_are_points_or_a_fault(bytes in csv()) {
        let folder = tempfile::tempdir().expect("is writable");
        fs::write(folder.path().join("points.csv"), &bytes).expect("is writable");
        for axes in ["", "[axes]\nt_f = 0.1\na = 0.03\nb = 0.05\nv_i = 3.0\nv_f = 100.0\n"] {
            let text = format!("name = \"test\"\npoints = \"points.csv\"\n{axes}[tables.optimal]\n");
            match Sweep::parse(&text, folder.path()) {
                Ok(sweep) => prop_assert!((1..=bytes.len() as u64).contains(&sweep.requests[0].rows)),
                Err(error) => prop_assert!(error.line.is_some() && error.to_string().len() < 3000, "{}", error),
            }
        }
    }

    /// Any text is a spec or a fault.
    #[test]
    fn any_text_is_a_spec_or_a_fault(lines in vec(line(), 0..12)) {
        match parse(&lines.join("\n")) {
            Ok(sweep) => prop_assert!(sweep.requests.iter().all(|request| request.rows > 0)),
            Err(error) => prop_assert!(!error.expected.is_empty() && error.to_string().len() < 40_000, "{}", error),
        }
    }
}

/// What may be a file of points, and what looks like one.
fn csv() -> impl Strategy<Value = Vec<u8>> {
    let cell = prop_oneof![
        select(vec![
            "0.03", "1e-3", "inf", "nan", "-0", "3", "\"5\"", "", " ", "x", "step", "1e999", "\u{feff}", "#", "5e-324"
        ])
        .prop_map(str::to_owned),
        any::<f64>().prop_map(|number| format!("{number:?}")),
        "\\PC{0,4}",
    ];
    let line = |cells| vec(cells, 0..4).prop_map(|cells: Vec<String>| cells.join(","));
    let header = line(
        select(vec!["a", "b", "v_i", "v_f", "t_f", "family", "m", "\"k\"", "x", ""]).prop_map(str::to_owned).boxed(),
    );
    let lines = (header, vec(line(cell.boxed()), 0..6), select(vec!["\n", "\r\n", "\r", "\n\n", "\n#"]));
    prop_oneof![
        4 => lines.prop_map(|(header, lines, end)| [vec![header], lines].concat().join(end).into_bytes()),
        1 => vec(any::<u8>(), 0..64),
    ]
}

/// A line of a spec, perhaps.
fn line() -> impl Strategy<Value = String> {
    let whole = select(vec![
        "name = \"test\"",
        "[axes]",
        "[tables.optimal]",
        "[tables.gap]",
        "reduce = \"min\"",
        "[[block]]",
        "[block.axes]",
        "[model]",
        "units = \"si\"",
        "l = 1e-6",
        "t_f = 0.1",
        "a = 0.03",
        "b = { expr = \"a * 2\" }",
        "v_i = [3.0, 2.0]",
        "v_f = 100",
        "v_f = { geomspace = [2, 1e12, 7] }",
        "m = { linspace = [0, 1, 9007199254740992] }",
        "k = { lhs = [1, 2, 9], seed = 4 }",
        "where = \"v_f > v_i\"",
        "zip = [[\"a\", \"b\"]]",
        "columns = [\"gap\"]",
        "rtol = 1e-9",
        "[accuracy]",
    ]);
    prop_oneof![8 => whole.prop_map(str::to_owned), 1 => "\\PC{0,30}", 1 => "[a-z_]{1,9} ?[=.] ?[\\[{\"0-9a-z]{0,12}"]
}

/// All numbers of a column.
fn column(batches: &[RecordBatch], name: &str) -> Vec<Option<f64>> {
    let arrays = batches.iter().map(|batch| batch.column_by_name(name).expect("is there"));
    arrays.flat_map(|array| array.as_primitive::<Float64Type>().iter().collect::<Vec<_>>()).collect()
}

fn batches(text: &str, table: &str) -> Vec<RecordBatch> {
    let sweep = parse(text).unwrap_or_else(|error| panic!("{text}{error}"));
    sweep.batches(table).expect("is requested").collect::<Result<_, _>>().expect("is a table")
}

proptest! {
    #![proptest_config(config(48))]

    /// A sweep in SI units has the same results as in scaled units.
    #[test]
    fn units_do_not_change_what_is_found(
        scales in (0.1..1.0, 1e-8..1e-4, 1e-10..1e-6, 1e4..1e8),
        (t_f, a, b) in (1e-3..1.0, 5e-3..0.1, 0.0..0.1),
        (v_i, v_f) in (1.1..50.0, 1.1..500.0),
        (k, m) in (1e-3..1.0, 1e-16..1e-3),
    ) {
        let (mu_0, l, v_0, load) = scales;
        let stress = mu_0 * load;
        let axes = |[time, velocity, friction, stiffness, mass]: [f64; 5]| format!(
            "t_f = {:?}\na = {:?}\nb = {:?}\nv_i = {:?}\nv_f = {:?}\nk = {:?}\nm = {:?}\n",
            t_f * time, a * friction, b * friction, v_i * velocity, v_f * velocity, k * stiffness, m * mass,
        );
        let tables = "[tables.optimal]\n[tables.stability]\n";
        let scaled = format!("name = \"test\"\n[axes]\n{}{tables}", axes([1.0; 5]));
        let si = format!(
            "name = \"test\"\n[model]\nunits = \"si\"\nmu_0 = {mu_0:?}\nl = {l:?}\nv_0 = {v_0:?}\nnormal_stress = {load:?}\n[axes]\n{}{tables}",
            axes([l / v_0, v_0, mu_0, stress / l, stress * l / (v_0 * v_0)]),
        );
        for (table, column_of, size) in [
            ("optimal", "t_f", l / v_0),
            ("optimal", "work", stress * l),
            ("optimal", "v_start", v_0),
            ("optimal", "hamiltonian", stress * v_0),
            ("optimal", "theta_max", l / v_0),
            ("stability", "k_od", stress / l),
            ("stability", "frequency", v_0 / l),
        ] {
            let (one, other) = (column(&batches(&scaled, table), column_of), column(&batches(&si, table), column_of));
            let (one, other) = (one[0].map(|number| number * size), other[0]);
            // The values themselves are rounded on the way, which `b - a` and the Hamiltonian's zero make more of.
            let near = match (one, other) {
                (Some(one), Some(other)) => (one - other).abs() <= 1e-8 * one.abs() + 1e-12 * size,
                (one, other) => one == other,
            };
            prop_assert!(near, "{} {}: {:?} {:?}", table, column_of, one, other);
        }
    }
}
