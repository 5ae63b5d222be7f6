//! The units of the columns of an answer.

use std::collections::HashMap;

use sqlparser::ast::{
    Expr, Function, Query, Select, SelectItem, SelectItemQualifiedWildcardKind, SetExpr, TableFactor, TableWithJoins,
    WildcardAdditionalOptions,
};

use super::checked_query::{first_argument, is_one_of, name};

/// Names of columns and their units; empty if unknown.
pub type Columns = Vec<(String, String)>;

/// The columns of `query` with known names, and their units. `tables` are the tables that it can read.
pub fn units(query: &Query, tables: &HashMap<String, Columns>) -> Columns {
    let mut tables = tables.clone();
    for table in query.with.iter().flat_map(|with| &with.cte_tables) {
        let columns = units(&table.query, &tables);
        tables.insert(table.alias.name.value.clone(), columns);
    }
    of_body(&query.body, &tables)
}

fn of_body(body: &SetExpr, tables: &HashMap<String, Columns>) -> Columns {
    match body {
        SetExpr::Select(select) => of_select(select, tables),
        SetExpr::Query(query) => units(query, tables),
        SetExpr::SetOperation { left, right, .. } => {
            let is_ordered = is_ordered(left) && is_ordered(right);
            let (mut left, right) = (of_body(left, tables), of_body(right, tables));
            for (place, (_, unit)) in left.iter_mut().enumerate() {
                if !is_ordered || right.get(place).is_none_or(|(_, other)| other != unit) {
                    unit.clear();
                }
            }
            left
        }
        _ => Vec::new(),
    }
}

/// Whether the columns of a query are known in their order: names, expressions and a plain `*` of one table.
fn is_ordered(body: &SetExpr) -> bool {
    let is_plain = |select: &Select, item: &SelectItem| match item {
        SelectItem::UnnamedExpr(Expr::Function(function)) => !is_one_of("columns", function),
        SelectItem::Wildcard(options) | SelectItem::QualifiedWildcard(_, options) => {
            let is_one_table = matches!(select.from.as_slice(), [from] if from.joins.is_empty());
            is_one_table && *options == WildcardAdditionalOptions::default()
        }
        _ => true,
    };
    match body {
        SetExpr::Select(select) => select.projection.iter().all(|item| is_plain(select, item)),
        SetExpr::Query(query) => is_ordered(&query.body),
        SetExpr::SetOperation { left, right, .. } => is_ordered(left) && is_ordered(right),
        _ => false,
    }
}

fn of_select(select: &Select, tables: &HashMap<String, Columns>) -> Columns {
    let mut scope = Scope::default();
    select.from.iter().for_each(|from| scope.read(from, tables));
    let all = |table: Option<&str>, options: &WildcardAdditionalOptions| {
        // A column with a new name or a new meaning may have the name of another.
        let is_changed = options.opt_rename.is_some();
        let mut columns = if is_changed { Vec::new() } else { scope.columns(table) };
        for item in options.opt_replace.iter().flat_map(|replace| &replace.items) {
            columns.retain(|(name, _)| *name != item.column_name.value);
        }
        columns
    };
    let of_item = |item: &SelectItem| match item {
        SelectItem::UnnamedExpr(Expr::Function(function)) if is_one_of("columns", function) => scope.columns(None),
        SelectItem::UnnamedExpr(expression) => vec![(name(expression), scope.unit(expression))],
        SelectItem::ExprWithAlias { expr, alias } => vec![(alias.value.clone(), scope.unit(expr))],
        SelectItem::QualifiedWildcard(SelectItemQualifiedWildcardKind::ObjectName(table), options) => {
            all(Some(table.to_string().as_str()), options)
        }
        SelectItem::Wildcard(options) => all(None, options),
        _ => Vec::new(),
    };
    select.projection.iter().flat_map(of_item).collect()
}

/// The tables in FROM.
#[derive(Default)]
struct Scope(Vec<(String, Columns)>);

impl Scope {
    fn read(&mut self, from: &TableWithJoins, tables: &HashMap<String, Columns>) {
        for table in std::iter::once(&from.relation).chain(from.joins.iter().map(|join| &join.relation)) {
            match table {
                TableFactor::Table { name, alias, .. } => {
                    let name = name.to_string().replace('"', "");
                    let columns = tables.get(&name).cloned().unwrap_or_default();
                    self.0.push((alias.as_ref().map_or(name, |alias| alias.name.value.clone()), columns));
                }
                TableFactor::Derived { subquery, alias, .. } => {
                    let name = alias.as_ref().map_or_else(String::new, |alias| alias.name.value.clone());
                    self.0.push((name, units(subquery, tables)));
                }
                TableFactor::NestedJoin { table_with_joins, .. } => self.read(table_with_joins, tables),
                _ => {}
            }
        }
    }

    /// The columns of one table or of all.
    fn columns(&self, table: Option<&str>) -> Columns {
        let tables = self.0.iter().filter(|(name, _)| table.is_none_or(|table| table == name));
        let columns = tables.flat_map(|(_, columns)| columns);
        columns.map(|(name, _)| (name.clone(), self.unit_of(table, name))).collect()
    }

    /// The unit of a column, if all tables that have it agree.
    fn unit_of(&self, table: Option<&str>, column: &str) -> String {
        let tables = self.0.iter().filter(|(name, _)| table.is_none_or(|table| table == name));
        let mut units = tables.flat_map(|(_, columns)| columns).filter(|(name, _)| name == column);
        match units.next() {
            Some((_, first)) if units.all(|(_, other)| other == first) => first.clone(),
            _ => String::new(),
        }
    }

    /// The unit of an expression that has the unit of one column.
    fn unit(&self, expression: &Expr) -> String {
        match expression {
            Expr::Identifier(column) => self.unit_of(None, &column.value),
            Expr::CompoundIdentifier(names) => match names.as_slice() {
                [table, column] => self.unit_of(Some(&table.value), &column.value),
                _ => String::new(),
            },
            Expr::Nested(inner) | Expr::UnaryOp { expr: inner, .. } | Expr::Cast { expr: inner, .. } => {
                self.unit(inner)
            }
            Expr::Function(function) => self.of_function(function),
            _ => String::new(),
        }
    }

    fn of_function(&self, function: &Function) -> String {
        const UNIT_PRESERVING: &str = "min max avg mean sum median first last first_value last_value lag lead abs \
            quantile_cont quantile_disc stddev";
        match first_argument(function) {
            Some(inner) if is_one_of(UNIT_PRESERVING, function) => self.unit(inner),
            _ => String::new(),
        }
    }
}
