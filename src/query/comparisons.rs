//! Comparisons of columns with constants that hold for no row by mistake: a word that a column never has, or a number without all its digits.

use std::collections::HashSet;
use std::ops::ControlFlow;

use sqlparser::ast::{BinaryOperator, Expr, Query, UnaryOperator, Value, VisitorMut};

use super::Source;
use super::checked_query::{is_name, name};
use super::walk::walk;
use crate::table;

/// Notes on the comparisons of a query.
#[derive(Default)]
pub struct Comparisons {
    /// On words that a column of a table never has.
    pub words: Vec<String>,
    /// On numbers that a column equals; they matter if the answer has no rows.
    pub numbers: Vec<String>,
}

impl Comparisons {
    /// The comparisons in `query` with columns of the `sources` that it reads. `aliases` are its names after AS.
    pub fn of(query: &mut Query, sources: Vec<&Source>, aliases: HashSet<String>) -> Comparisons {
        let mut search = Search { sources, aliases, found: Comparisons::default() };
        walk(query, &mut search);
        search.found
    }
}

/// Digits from which a number is probably copied from a table and rounded. Chosen: specs have fewer.
const MIN_ROUNDED_DIGITS: usize = 5;

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
        match constant {
            Expr::Value(value) => match &value.value {
                Value::SingleQuotedString(word) if !vocabulary.is_empty() && !vocabulary.contains(&word.as_str()) => {
                    let words = vocabulary.join(", ");
                    self.found.words.push(format!("`{column}` is never '{word}'; it is one of {words}"));
                }
                Value::Number(number, _) if digits(number) >= MIN_ROUNDED_DIGITS => {
                    let close = format!("{column} BETWEEN {number} * (1 - 1e-6) AND {number} * (1 + 1e-6)");
                    self.found
                        .numbers
                        .push(format!("`=` compares all digits of `{column}`; for a rounded number, write {close}"));
                }
                _ => {}
            },
            Expr::UnaryOp { op: UnaryOperator::Minus | UnaryOperator::Plus, expr } => self.read(column, expr),
            _ => {}
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

/// The significant digits of a number.
fn digits(number: &str) -> usize {
    let mantissa = number.split(['e', 'E']).next().unwrap_or_default();
    mantissa.trim_start_matches(['0', '.']).chars().filter(char::is_ascii_digit).count()
}
