//! Queries on one table that can be computed part by part, so that the table need not fit into memory.
//!
//! Filtered rows are passed on as they are read. For `ORDER BY ... LIMIT` each part returns its first rows. For `GROUP BY` each part returns its
//! groups with sums, counts, least and greatest values, which are then merged.

use std::collections::HashSet;
use std::ops::ControlFlow;

use sqlparser::ast::{
    Expr, Function, FunctionArg, FunctionArgExpr, FunctionArguments, GroupByExpr, Ident, LimitClause, OrderByKind,
    Query, Select, SelectItem, SetExpr, TableFactor, VisitorMut,
};
use sqlparser::dialect::GenericDialect;
use sqlparser::parser::Parser;

use super::Source;
use super::checked_query::{expression, is_one_of, item_name, parsed, whole_number};
use super::filter::{Top, of_where};
use super::groups::{Aggregate, GroupQuery, Kind, Measure};
use super::scan::Files;
use super::walk::walk;

/// The plan of a query that is computed part by part.
pub struct StreamPlan {
    /// The files of the table, without rows that the answer does not need.
    pub files: Files,
    /// The table.
    pub table: String,
    /// The query on each part.
    pub partial: String,
    /// The plan for groups; `None` concatenates rows.
    pub groups: Option<GroupPlan>,
    /// The order of rows by the columns `__k0`, `__k1`, ...
    pub keys: Vec<Key>,
    /// Rows to skip at the start.
    pub offset: usize,
    /// Greatest number of rows.
    pub limit: Option<usize>,
    /// The columns of the answer.
    pub names: Vec<String>,
}

/// The plan that computes groups from those of the parts.
pub struct GroupPlan {
    /// The groups of a part, if they need columns alone: then they replace the query on each part.
    pub columns: Option<GroupQuery>,
    /// The query that merges partial answers in the table [`PARTS`].
    pub merge: String,
    /// The query that computes the answer from the table [`PARTS`].
    pub finish: String,
}

/// The direction of a sort key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key {
    pub descending: bool,
    pub nulls_last: bool,
}

/// The name of the partial answers as a table.
pub const PARTS: &str = "__parts";

/// Functions of the row alone.
const SCALAR_FUNCTIONS: &str = "abs acos asin atan atan2 cbrt ceil ceiling coalesce concat cos degrees ends_with exp floor greatest if ifnull least \
    left length ln log log10 log1p log2 lower mod nullif octet_length pi pow power radians replace right round sign sin sqrt starts_with \
    strpos tan upper";

/// Functions of groups that can be put together.
const MERGED_FUNCTIONS: &str = "avg count max mean min sum";

/// The part-by-part plan of `query`; `None` if it needs all rows at once.
pub fn streaming(query: &Query, sources: &[Source]) -> Option<StreamPlan> {
    let SetExpr::Select(select) = query.body.as_ref() else { return None };
    if !is_plain(query, select) {
        return None;
    }
    // One table, without a function that needs all its rows.
    let (source, alias) = table_of(select, sources)?;
    let files = source.files.clone()?;
    let mut select = select.as_ref().clone();
    let mut order = query.order_by.clone();
    let mut plain = ColumnSimplifier { table: &source.name, alias: &alias, aggregates: false };
    if !walk(&mut select, &mut plain) || !walk(&mut order, &mut plain) {
        return None;
    }
    let items = items(&select, source)?;
    let names = items.iter().map(|(name, _)| name.clone()).collect();
    let (limit, offset) = limits(query)?;
    let (ordered, keys) = order_of(order.map(|order| order.kind), &items)?;
    let GroupByExpr::Expressions(groups, modifiers) = select.group_by else { return None };
    if !modifiers.is_empty() {
        return None;
    }
    let conditions = of_where(select.selection.as_ref(), &files.schema);
    let condition = select.selection.map(|condition| condition.to_string());
    let table_query = TableQuery { source, items, condition, having: select.having, ordered };
    let (partial, groups, top) = if groups.is_empty() && !plain.aggregates {
        if table_query.having.is_some() || !keys.is_empty() && limit.is_none() {
            return None;
        }
        let most = limit.map(|limit| limit.saturating_add(offset));
        let top = conditions.as_ref().and_then(|_| table_query.top(&keys, most?, &files));
        (table_query.rows(most), None, top)
    } else {
        let (partial, groups) = table_query.groups(groups, &files)?;
        let columns = groups.columns.filter(|_| conditions.is_some());
        (partial, Some(GroupPlan { columns, ..groups }), None)
    };
    let (table, files) = (source.name.clone(), files.only(conditions.unwrap_or_default(), top));
    Some(StreamPlan { files, table, partial, groups, keys, offset, limit, names })
}

/// Whether a query consists only of items, tables, WHERE, GROUP BY, HAVING, ORDER BY, LIMIT and OFFSET.
fn is_plain(query: &Query, select: &Select) -> bool {
    let bare = Parser::new(&GenericDialect {}).try_with_sql("SELECT 1").and_then(|mut parser| parser.parse_query());
    let Ok(Query { body, .. }) = bare.as_deref() else { return false };
    let SetExpr::Select(bare_select) = body.as_ref() else { return false };
    let Select { projection, from, selection, group_by, having, .. } = select.clone();
    let select = Select { projection, from, selection, group_by, having, ..bare_select.as_ref().clone() };
    let (order_by, limit_clause) = (query.order_by.clone(), query.limit_clause.clone());
    let body = Box::new(SetExpr::Select(Box::new(select)));
    bare.is_ok_and(|bare| *query == Query { body, order_by, limit_clause, ..*bare })
}

/// The only table of a SELECT, and its alias.
fn table_of<'a>(select: &Select, sources: &'a [Source]) -> Option<(&'a Source, String)> {
    let [from] = select.from.as_slice() else { return None };
    let TableFactor::Table { name, alias, args: None, sample: None, version: None, .. } = &from.relation else {
        return None;
    };
    if !from.joins.is_empty() || alias.as_ref().is_some_and(|alias| !alias.columns.is_empty()) {
        return None;
    }
    let table = &name.0.last()?.as_ident()?.value;
    let source = sources.iter().find(|source| source.name == *table)?;
    // This prefix is reserved for columns of partial answers.
    if source.columns.iter().any(|column| column.starts_with("__")) {
        return None;
    }
    Some((source, alias.as_ref().map_or(table, |alias| &alias.name.value).clone()))
}

/// The sort keys and their directions.
fn order_of(kind: Option<OrderByKind>, items: &[(String, Expr)]) -> Option<(Vec<Expr>, Vec<Key>)> {
    let keys = match kind {
        None => Vec::new(),
        Some(OrderByKind::All(_)) => return None,
        Some(OrderByKind::Expressions(keys)) => keys,
    };
    let (mut ordered, mut directions) = (Vec::new(), Vec::new());
    for key in keys {
        if key.with_fill.is_some() {
            return None;
        }
        let descending = !key.options.asc.unwrap_or(true);
        // As in PostgreSQL: null is the greatest value.
        directions.push(Key { descending, nulls_last: !key.options.nulls_first.unwrap_or(descending) });
        ordered.push(item(&key.expr, items).unwrap_or(key.expr));
    }
    Some((ordered, directions))
}

/// The names and expressions of the columns of an answer.
fn items(select: &Select, source: &Source) -> Option<Vec<(String, Expr)>> {
    let mut items = Vec::new();
    for item in &select.projection {
        match item {
            SelectItem::Wildcard(options) if options.to_string().is_empty() => {
                items.extend(source.columns.iter().map(|column| (column.clone(), quoted(column))));
            }
            item => items.push((item_name(item), expression(item)?.clone())),
        }
    }
    let mut names = HashSet::new();
    let distinct = items.iter().all(|(name, _)| names.insert(name));
    (distinct && !items.is_empty()).then_some(items)
}

fn quoted(name: &str) -> Expr {
    Expr::Identifier(Ident::with_quote('"', name))
}

/// The item that `ORDER BY` or `GROUP BY` refers to by name or position.
fn item(expression: &Expr, items: &[(String, Expr)]) -> Option<Expr> {
    let found = match expression {
        Expr::Identifier(name) => items.iter().find(|(known, _)| *known == name.value),
        place => items.get(whole_number(place)?.checked_sub(1)?),
    };
    found.map(|(_, expression)| expression.clone())
}

/// The numbers of `LIMIT` and `OFFSET`; `None` if they are not literals.
fn limits(query: &Query) -> Option<(Option<usize>, usize)> {
    match &query.limit_clause {
        None => Some((None, 0)),
        Some(LimitClause::LimitOffset { limit, offset, limit_by }) if limit_by.is_empty() => {
            let limit = match limit {
                Some(limit) => Some(whole_number(limit)?),
                None => None,
            };
            Some((limit, offset.as_ref().map_or(Some(0), |offset| whole_number(&offset.value))?))
        }
        Some(_) => None,
    }
}

/// The column that an expression is.
fn column_name(expression: &Expr) -> Option<&str> {
    match expression {
        Expr::Identifier(name) => Some(&name.value),
        _ => None,
    }
}

/// A query on one table.
struct TableQuery<'a> {
    source: &'a Source,
    items: Vec<(String, Expr)>,
    condition: Option<String>,
    having: Option<Expr>,
    ordered: Vec<Expr>,
}

impl TableQuery<'_> {
    /// The columns of the answer, and those of its order.
    fn columns(&self) -> impl Iterator<Item = (String, &Expr)> {
        let keys = self.ordered.iter().enumerate().map(|(place, key)| (format!("__k{place}"), key));
        self.items.iter().map(|(name, expression)| (name.clone(), expression)).chain(keys)
    }

    /// The rows of a part that may be among the first `most`, if the first of `keys` is a column of numbers.
    fn top(&self, keys: &[Key], most: usize, files: &Files) -> Option<Top> {
        let (column, key) = (column_name(self.ordered.first()?)?.to_owned(), *keys.first()?);
        let is_number = Kind::of(&column, &files.schema) == Some(Kind::Number);
        is_number.then_some(Top { column, key, most, is_only_key: keys.len() == 1 })
    }

    /// The query for at most `most` rows of a part.
    fn rows(&self, most: Option<usize>) -> String {
        let columns: Vec<String> = self.columns().map(|(name, expression)| aliased(expression, &name)).collect();
        let most = most.filter(|_| self.ordered.is_empty()).map(|most| most.to_string());
        sql(&columns, &self.source.name, &[("WHERE", self.condition.as_slice()), ("LIMIT", most.as_slice())])
    }

    /// The query for the groups of a part, and the plan that computes the answer from them.
    fn groups(&self, groups: Vec<Expr>, files: &Files) -> Option<(String, GroupPlan)> {
        let is_column = |group: &Expr| column_name(group).is_some_and(|name| files.schema.contains(name));
        let key = |group: Expr| if is_column(&group) { group } else { item(&group, &self.items).unwrap_or(group) };
        let keys: Vec<Expr> = groups.into_iter().map(key).collect();
        let mut lift = AggregateExtractor { keys: &keys, aggregates: Vec::new() };
        let mut columns = Vec::new();
        for (name, expression) in self.columns() {
            columns.push(aliased(&lift.lifted(expression)?, &name));
        }
        let having = match &self.having {
            Some(having) => Some(lift.lifted(having)?.to_string()),
            None => None,
        };
        let aggregates = lift.aggregates;

        let names: Vec<String> = (0..keys.len()).map(|place| quoted(&format!("__g{place}")).to_string()).collect();
        let mut found: Vec<String> = keys.iter().zip(&names).map(|(key, name)| format!("{key} AS {name}")).collect();
        let mut merged = names.clone();
        for (place, aggregate) in aggregates.iter().enumerate() {
            let name = quoted(&format!("__a{place}"));
            found.push(format!("{} AS {name}", aggregate.sql()));
            merged.push(format!("{}({name}) AS {name}", aggregate.measure.merged_by()));
        }
        let grouped: Vec<String> = keys.iter().map(ToString::to_string).collect();
        let partial = [("WHERE", self.condition.as_slice()), ("GROUP BY", &grouped)];
        // Without an order, two runs would print the groups in different orders.
        let order = if self.ordered.is_empty() { names.as_slice() } else { &[] };
        let finish = sql(&columns, PARTS, &[("WHERE", having.as_slice()), ("ORDER BY", order)]);
        let merge = sql(&merged, PARTS, &[("GROUP BY", &names)]);
        let plain = keys.iter().map(|key| column_name(key).map(str::to_owned)).collect::<Option<Vec<_>>>();
        let columns = plain.and_then(|keys| GroupQuery::new(keys, aggregates, &files.schema));
        Some((sql(&found, &self.source.name, &partial), GroupPlan { columns, merge, finish }))
    }
}

/// A SELECT of `columns` from a table, with those clauses that have terms.
fn sql(columns: &[String], table: &str, clauses: &[(&str, &[String])]) -> String {
    let mut sql = format!("SELECT {} FROM {}", columns.join(", "), quoted(table));
    for (keyword, terms) in clauses.iter().filter(|(_, terms)| !terms.is_empty()) {
        sql.push_str(&format!(" {keyword} {}", terms.join(", ")));
    }
    sql
}

fn aliased(expression: &Expr, name: &str) -> String {
    format!("{expression} AS {}", quoted(name))
}

/// Extracts the groups and their sums, counts and extremes from expressions.
struct AggregateExtractor<'a> {
    keys: &'a [Expr],
    /// The aggregates of a part, in the columns `__a0`, `__a1`, ...
    aggregates: Vec<Aggregate>,
}

impl AggregateExtractor<'_> {
    /// `expression` in terms of the columns of partial answers; `None` if it contains other columns.
    fn lifted(&mut self, expression: &Expr) -> Option<Expr> {
        let mut expression = expression.clone();
        walk(&mut expression, self).then_some(expression)
    }

    /// The column of partial answers with this aggregate.
    fn column(&mut self, measure: Measure, argument: &str, column: Option<&str>) -> Expr {
        let (argument, column) = (argument.to_owned(), column.map(str::to_owned));
        let aggregate = Aggregate { measure, argument, column };
        let place = self.aggregates.iter().position(|known| *known == aggregate).unwrap_or_else(|| {
            self.aggregates.push(aggregate);
            self.aggregates.len() - 1
        });
        quoted(&format!("__a{place}"))
    }

    fn aggregate(&mut self, function: &Function) -> Option<Expr> {
        let called = function.name.to_string().to_lowercase();
        let FunctionArguments::List(list) = &function.args else { return None };
        let (argument, column) = match list.args.as_slice() {
            [FunctionArg::Unnamed(FunctionArgExpr::Expr(argument))] => (argument.to_string(), column_name(argument)),
            [FunctionArg::Unnamed(FunctionArgExpr::Wildcard)] if called == "count" => ("*".to_owned(), None),
            _ => return None,
        };
        Some(match called.as_str() {
            "min" => self.column(Measure::Least, &argument, column),
            "max" => self.column(Measure::Greatest, &argument, column),
            "sum" => self.column(Measure::Sum, &argument, column),
            "count" => self.column(Measure::Count, &argument, column),
            _ => {
                let sum = self.column(Measure::Sum, &format!("CAST({argument} AS DOUBLE)"), column);
                let count = self.column(Measure::Count, &argument, column);
                // The mean of no values is null, as their sum is.
                parsed(format!("({sum} / CAST({count} AS DOUBLE))"))
            }
        })
    }
}

impl VisitorMut for AggregateExtractor<'_> {
    type Break = ();

    fn pre_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
        if let Some(place) = self.keys.iter().position(|key| key == expression) {
            *expression = quoted(&format!("__g{place}"));
            return ControlFlow::Continue(());
        }
        match expression {
            Expr::Identifier(name) if name.value.starts_with("__") => ControlFlow::Continue(()),
            Expr::Identifier(_) => ControlFlow::Break(()),
            Expr::Function(function) if is_one_of(MERGED_FUNCTIONS, function) => match self.aggregate(function) {
                Some(column) => {
                    *expression = column;
                    ControlFlow::Continue(())
                }
                None => ControlFlow::Break(()),
            },
            _ => ControlFlow::Continue(()),
        }
    }
}

/// Removes the name of the table from columns, and finds aggregates. Ends at an expression that may need all rows at once.
struct ColumnSimplifier<'a> {
    table: &'a str,
    alias: &'a str,
    aggregates: bool,
}

impl VisitorMut for ColumnSimplifier<'_> {
    type Break = ();

    fn pre_visit_query(&mut self, _: &mut Query) -> ControlFlow<()> {
        ControlFlow::Break(())
    }

    fn pre_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
        match expression {
            Expr::CompoundIdentifier(names) => match names.as_slice() {
                [table, column] if table.value == self.table || table.value == self.alias => {
                    *expression = Expr::Identifier(column.clone());
                }
                _ => return ControlFlow::Break(()),
            },
            Expr::Function(function) => {
                let bare = function.over.is_none()
                    && function.filter.is_none()
                    && function.within_group.is_empty()
                    && function.null_treatment.is_none();
                let list = match &function.args {
                    FunctionArguments::List(list) => list.duplicate_treatment.is_none() && list.clauses.is_empty(),
                    _ => false,
                };
                let aggregate = is_one_of(MERGED_FUNCTIONS, function);
                self.aggregates |= aggregate;
                if !bare || !list || !aggregate && !is_one_of(SCALAR_FUNCTIONS, function) {
                    return ControlFlow::Break(());
                }
            }
            _ => {}
        }
        ControlFlow::Continue(())
    }
}
