//! Comparisons of columns with constants that hold for no row by mistake: a word that a column never has, or a number without all its digits.

use std::collections::HashSet;
use std::ops::ControlFlow;

use sqlparser::ast::{BinaryOperator, Expr, Query, Value, ValueWithSpan, VisitorMut};

use super::checked_query::{is_name, name};
use super::walk::walk;
use super::{Source, Tables};
use crate::dataset::Cell;
use crate::table;

/// Notes on the comparisons of a query.
#[derive(Default)]
pub struct Comparisons {
    /// On words that a column of a table never has.
    pub words: Vec<String>,
    /// Numbers that a column of a table is compared with: they may lack digits if the answer has no rows, or is a single row about none.
    pub numbers: Vec<ComparedNumber>,
}

impl Comparisons {
    /// The comparisons in `query` with columns of the `sources` that it reads. `aliases` are its names after AS.
    pub fn of(query: &mut Query, sources: Vec<&Source>, aliases: HashSet<String>) -> Comparisons {
        let mut search = Search { sources, aliases, found: Comparisons::default() };
        walk(query, &mut search);
        search.found
    }
}

/// A column of a table and the number that it is compared with.
pub struct ComparedNumber {
    table: String,
    column: String,
    number: f64,
}

impl Tables {
    /// A note if no row has the compared number, but some row has it with more digits.
    pub fn note_on(&self, ComparedNumber { table, column, number }: &ComparedNumber) -> Option<String> {
        let [low, high] = if *number < 0.0 { ['+', '-'] } else { ['-', '+'] };
        let close = format!("{column} BETWEEN {number} * (1 {low} 1e-6) AND {number} * (1 {high} 1e-6)");
        let found = self.query(&format!("SELECT DISTINCT {column} FROM \"{table}\" WHERE {close} LIMIT 2")).ok()?;
        let mut cells = Vec::new();
        let take = |rows: Vec<Vec<Cell>>| {
            cells.extend(rows.into_iter().flatten());
            Ok(())
        };
        found.rows(take).ok()?;
        let is_rounded = !cells.is_empty() && !cells.contains(&Cell::Number(*number));
        is_rounded.then(|| format!("`=` compares all digits of `{column}`; for a rounded number, write {close}"))
    }
}

struct Search<'a> {
    sources: Vec<&'a Source>,
    /// Names that may stand for other columns than those of the tables.
    aliases: HashSet<String>,
    found: Comparisons,
}

impl Search<'_> {
    fn read(&mut self, column: &str, constant: &Expr) {
        let has = |source: &&&Source| source.columns.iter().any(|known| known == column);
        if self.aliases.contains(column) || !self.sources.iter().any(|source| has(&source)) {
            return;
        }
        let of_tables = self.sources.iter().filter(has).flat_map(|source| table::vocabulary(&source.name, column));
        let vocabulary: Vec<&str> = of_tables.collect();
        if let Expr::Value(ValueWithSpan { value: Value::SingleQuotedString(word), .. }) = constant
            && !vocabulary.is_empty()
            && !vocabulary.contains(&word.as_str())
        {
            let words = vocabulary.join(", ");
            self.found.words.push(format!("`{column}` is never '{word}'; it is one of {words}"));
        }
        if let Some(number) = constant.to_string().parse().ok().filter(|number| *number != 0.0) {
            let of =
                |source: &&Source| ComparedNumber { table: source.name.clone(), column: column.to_owned(), number };
            self.found.numbers.extend(self.sources.iter().filter(has).map(of));
        }
    }
}

impl VisitorMut for Search<'_> {
    type Break = ();

    fn pre_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
        match &*expression {
            Expr::BinaryOp { left, op: BinaryOperator::Eq | BinaryOperator::NotEq, right } => {
                for (column, constant) in [(left, right), (right, left)] {
                    if is_name(column) {
                        self.read(&name(column), constant);
                    }
                }
            }
            Expr::InList { expr, list, .. } if is_name(expr) => {
                list.iter().for_each(|constant| self.read(&name(expr), constant));
            }
            _ => {}
        }
        ControlFlow::Continue(())
    }
}
