//! Reader of the reference tables in this folder.

use std::collections::BTreeMap;
use std::path::Path;

/// One row, by column.
#[derive(Debug)]
pub struct Row(BTreeMap<String, String>);

impl Row {
    pub fn text(&self, column: &str) -> &str {
        &self.0[column]
    }

    pub fn number(&self, column: &str) -> f64 {
        self.optional(column).unwrap_or_else(|| panic!("{column} is empty in {self:?}"))
    }

    pub fn optional(&self, column: &str) -> Option<f64> {
        let text = self.text(column);
        (!text.is_empty()).then(|| text.parse().unwrap_or_else(|_| panic!("{column}: {text} is no number")))
    }
}

/// The rows of `tests/reference/NAME.csv`; lines that begin with `#` say how it was made.
pub fn table(name: &str) -> Vec<Row> {
    // Of this package, or of the one that it is nested in.
    let file = format!("tests/reference/{name}.csv");
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = package.ancestors().map(|folder| folder.join(&file)).find(|path| path.exists()).unwrap_or(file.into());
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().expect("has a header").split(',').collect();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), header.len(), "{name}: {line}");
        Row(header.iter().map(|c| c.to_string()).zip(cells.iter().map(|c| c.to_string())).collect())
    };
    lines.map(row).collect()
}
