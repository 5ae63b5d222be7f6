//! Queries on one table that can be computed part by part, so that the table need not fit into memory.
//!
//! Filtered rows are passed on as they are read. For `ORDER BY ... LIMIT` each part returns its first rows. For `GROUP BY` each part returns its
//! groups with sums, counts, least and greatest values, which are then merged.

use std::ops::ControlFlow;

use polars::prelude::Schema;
use sqlparser::ast::{
    BinaryOperator, DataType, Expr, Function, FunctionArg, FunctionArgExpr, FunctionArguments, GroupByExpr, Ident,
    LimitClause, OrderByKind, Query, Select, SelectItem, SetExpr, TableFactor, Value, ValueWithSpan,
};
use sqlparser::dialect::GenericDialect;
use sqlparser::parser::Parser;

use super::Source;
use super::checked_query::{cast, if_else_null, is_one_of, name};
use super::filter::{Condition, Top, of_where};
use super::groups::{Aggregate, GroupQuery, Kind};
use super::walk::{Visit, walk};

/// The plan of a query that is computed part by part.
pub struct StreamPlan {
    /// The table.
    pub table: String,
    /// The query on each part.
    pub partial: String,
    /// The plan of counts, sums and extremes of columns.
    pub groups: Option<GroupQuery>,
    /// The condition of all rows, if `WHERE` is a plain condition.
    pub conditions: Vec<Condition>,
    /// The order of rows by one column of numbers.
    pub top: Option<Top>,
    /// The query that merges partial answers in the table [`PARTS`]; `None` concatenates rows.
    pub merge: Option<String>,
    /// The query that computes the answer from the table [`PARTS`].
    pub finish: Option<String>,
    /// The order of rows by the columns `__k0`, `__k1`, ...
    pub keys: Vec<Key>,
    /// Rows to skip at the start.
    pub offset: usize,
    /// Greatest number of rows.
    pub limit: Option<usize>,
    /// The columns of the answer.
    pub names: Vec<String>,
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
    let mut select = select.as_ref().clone();
    let mut order = query.order_by.clone();
    let mut plain = ColumnSimplifier { table: &source.name, alias: &alias, functions: Functions::default() };
    let plainly = walk(&mut select.projection, &mut plain)
        && walk(&mut select.selection, &mut plain)
        && walk(&mut select.having, &mut plain)
        && walk(&mut select.group_by, &mut plain)
        && walk(&mut order, &mut plain);
    let Functions { aggregates, others } = plain.functions;
    if !plainly || others {
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
    let schema = source.files.as_ref()?.schema();
    let conditions = of_where(select.selection.as_ref(), schema);
    let table = source.name.clone();
    let table_query = TableQuery { table, source, items, condition: select.selection, having: select.having, ordered };
    let mut streaming = StreamPlan {
        table: table_query.table.clone(),
        partial: String::new(),
        groups: None,
        conditions: conditions.clone().unwrap_or_default(),
        top: None,
        merge: None,
        finish: None,
        keys,
        offset,
        limit,
        names,
    };
    if groups.is_empty() && !aggregates {
        if table_query.having.is_some() || !streaming.keys.is_empty() && limit.is_none() {
            return None;
        }
        let most = limit.map(|limit| limit.saturating_add(offset));
        streaming.partial = table_query.rows(most);
        streaming.top = conditions.and_then(|_| table_query.top(&streaming.keys, most?, schema));
    } else {
        let (partial, merge, finish, measured) = table_query.groups(groups)?;
        streaming.groups = conditions.and_then(|conditions| counted(measured?, conditions, schema));
        (streaming.partial, streaming.merge, streaming.finish) = (partial, Some(merge), Some(finish));
    }
    Some(streaming)
}

/// The aggregation of columns, if it suffices for the groups.
fn counted((keys, aggregates): GroupedColumns, conditions: Vec<Condition>, schema: &Schema) -> Option<GroupQuery> {
    let kinds = keys.into_iter().map(|key| Some((key.clone(), Kind::of(&key, schema)?)));
    let groups = GroupQuery { conditions, keys: kinds.collect::<Option<_>>()?, aggregates };
    groups.fits(schema).then_some(groups)
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
            SelectItem::UnnamedExpr(expression) => items.push((name(expression), expression.clone())),
            SelectItem::ExprWithAlias { expr, alias } => items.push((alias.value.clone(), expr.clone())),
            SelectItem::Wildcard(options) if options.to_string().is_empty() => {
                items.extend(source.columns.iter().map(|column| (column.clone(), quoted(column))));
            }
            _ => return None,
        }
    }
    let mut names: Vec<&String> = items.iter().map(|(name, _)| name).collect();
    names.sort();
    let distinct = names.windows(2).all(|pair| pair[0] != pair[1]);
    (distinct && !items.is_empty()).then_some(items)
}

fn quoted(name: &str) -> Expr {
    Expr::Identifier(Ident::with_quote('"', name))
}

/// The item that `ORDER BY` or `GROUP BY` refers to by name or position.
fn item(expression: &Expr, items: &[(String, Expr)]) -> Option<Expr> {
    let found = match expression {
        Expr::Identifier(name) => items.iter().find(|(known, _)| *known == name.value),
        Expr::Value(ValueWithSpan { value: Value::Number(digits, _), .. }) => {
            items.get(digits.parse::<usize>().ok()?.checked_sub(1)?)
        }
        _ => None,
    };
    found.map(|(_, expression)| expression.clone())
}

/// The numbers of `LIMIT` and `OFFSET`; `None` if they are not literals.
fn limits(query: &Query) -> Option<(Option<usize>, usize)> {
    let number = |expression: &Expr| match expression {
        Expr::Value(ValueWithSpan { value: Value::Number(digits, _), .. }) => digits.parse::<usize>().ok(),
        _ => None,
    };
    match &query.limit_clause {
        None => Some((None, 0)),
        Some(LimitClause::LimitOffset { limit, offset, limit_by }) if limit_by.is_empty() => {
            let limit = limit.as_ref().map(|limit| number(limit).ok_or(())).transpose().ok()?;
            Some((limit, offset.as_ref().map_or(Some(0), |offset| number(&offset.value))?))
        }
        Some(_) => None,
    }
}

/// A query on one table.
struct TableQuery<'a> {
    table: String,
    source: &'a Source,
    items: Vec<(String, Expr)>,
    condition: Option<Expr>,
    having: Option<Expr>,
    ordered: Vec<Expr>,
}

impl TableQuery<'_> {
    /// The rows of a part that may be among the first `most`, if the first of `keys` is a column of numbers.
    fn top(&self, keys: &[Key], most: usize, schema: &Schema) -> Option<Top> {
        let (Expr::Identifier(column), Key { descending, nulls_last }) = (self.ordered.first()?, *keys.first()?) else {
            return None;
        };
        let column = column.value.clone();
        let is_number = Kind::of(&column, schema) == Some(Kind::Number);
        is_number.then_some(Top { column, descending, nulls_last, most, is_only_key: keys.len() == 1 })
    }

    /// The query for at most `most` rows of a part.
    fn rows(&self, most: Option<usize>) -> String {
        let items = self.items.iter().map(|(name, expression)| aliased(expression, name));
        let keys = self.ordered.iter().enumerate().map(|(place, key)| aliased(key, &format!("__k{place}")));
        let mut sql = format!("SELECT {} FROM {}", joined(items.chain(keys)), quoted(&self.table));
        if let Some(condition) = &self.condition {
            sql.push_str(&format!(" WHERE {condition}"));
        }
        if self.ordered.is_empty()
            && let Some(most) = most
        {
            sql.push_str(&format!(" LIMIT {most}"));
        }
        sql
    }

    /// The queries for the groups of a part, for merging them, and for the final answer.
    fn groups(&self, groups: Vec<Expr>) -> Option<(String, String, String, Option<GroupedColumns>)> {
        let mut keys = Vec::new();
        for group in groups {
            let is_column = matches!(&group, Expr::Identifier(name) if self.source.columns.contains(&name.value));
            keys.push(if is_column { group } else { item(&group, &self.items).unwrap_or(group) });
        }
        let mut lift = AggregateExtractor { keys: &keys, partial: Vec::new(), aggregates: Vec::new() };
        let mut columns = Vec::new();
        for (name, expression) in &self.items {
            columns.push(aliased(&lift.lifted(expression)?, name));
        }
        for (place, key) in self.ordered.iter().enumerate() {
            columns.push(aliased(&lift.lifted(key)?, &format!("__k{place}")));
        }
        let having = match &self.having {
            Some(having) => format!(" WHERE {}", lift.lifted(having)?),
            None => String::new(),
        };
        let names: Vec<String> = (0..keys.len()).map(|place| format!("__g{place}")).collect();
        let mut finish = format!("SELECT {} FROM {}{having}", joined(columns.into_iter()), quoted(PARTS));
        if self.ordered.is_empty() && !keys.is_empty() {
            // Otherwise two runs would print the groups in different orders.
            finish.push_str(&format!(" ORDER BY {}", joined(names.iter().map(|name| format!("\"{name}\"")))));
        }
        let key_columns = keys.iter().zip(&names).map(|(key, name)| aliased(key, name));
        let parts = lift.partial.iter().enumerate().map(|(place, (sql, _))| format!("{sql} AS \"__a{place}\""));
        let merged = lift
            .partial
            .iter()
            .enumerate()
            .map(|(place, (_, merge))| format!("{merge}(\"__a{place}\") AS \"__a{place}\""));
        let mut partial = format!("SELECT {} FROM {}", joined(key_columns.chain(parts)), quoted(&self.table));
        if let Some(condition) = &self.condition {
            partial.push_str(&format!(" WHERE {condition}"));
        }
        let quoted_names = || names.iter().map(|name| format!("\"{name}\""));
        let mut merge = format!("SELECT {} FROM {}", joined(quoted_names().chain(merged)), quoted(PARTS));
        if !keys.is_empty() {
            partial.push_str(&format!(" GROUP BY {}", joined(keys.iter().map(ToString::to_string))));
            merge.push_str(&format!(" GROUP BY {}", joined(quoted_names())));
        }
        let plain = |key: &Expr| match key {
            Expr::Identifier(name) => Some(name.value.clone()),
            _ => None,
        };
        let measured = keys.iter().map(plain).collect::<Option<Vec<_>>>();
        let measured = measured.zip(lift.aggregates.into_iter().collect::<Option<Vec<_>>>());
        Some((partial, merge, finish, measured))
    }
}

/// The key columns of the groups, and the aggregates.
type GroupedColumns = (Vec<String>, Vec<Aggregate>);

fn aliased(expression: &Expr, name: &str) -> String {
    format!("{expression} AS {}", quoted(name))
}

fn joined(parts: impl Iterator<Item = String>) -> String {
    parts.collect::<Vec<_>>().join(", ")
}

/// Extracts the groups and their sums, counts and extremes from expressions.
struct AggregateExtractor<'a> {
    keys: &'a [Expr],
    /// Aggregates of a part, each with the function that merges it.
    partial: Vec<(String, &'static str)>,
    /// The aggregates of columns, if they have this form.
    aggregates: Vec<Option<Aggregate>>,
}

impl AggregateExtractor<'_> {
    /// `expression` in terms of the columns of partial answers; `None` if it contains other columns.
    fn lifted(&mut self, expression: &Expr) -> Option<Expr> {
        let mut expression = expression.clone();
        walk(&mut expression, self).then_some(expression)
    }

    /// The column of partial answers with `sql`.
    fn column(&mut self, sql: String, merge: &'static str, aggregate: Option<Aggregate>) -> Expr {
        let known = self.partial.iter().position(|(other, by)| *other == sql && *by == merge);
        let place = known.unwrap_or_else(|| {
            self.partial.push((sql, merge));
            self.aggregates.push(aggregate);
            self.partial.len() - 1
        });
        quoted(&format!("__a{place}"))
    }

    fn aggregate(&mut self, function: &Function) -> Option<Expr> {
        let called = function.name.to_string().to_lowercase();
        let FunctionArguments::List(list) = &function.args else { return None };
        let (argument, column) = match list.args.as_slice() {
            [FunctionArg::Unnamed(FunctionArgExpr::Expr(argument))] => match argument {
                Expr::Identifier(name) => (argument.to_string(), Some(name.value.clone())),
                _ => (argument.to_string(), None),
            },
            [FunctionArg::Unnamed(FunctionArgExpr::Wildcard)] if called == "count" => ("*".to_owned(), None),
            _ => return None,
        };
        let counted = if argument == "*" { Some(Aggregate::Rows) } else { column.clone().map(Aggregate::Count) };
        let count = format!("CAST(count({argument}) AS BIGINT)");
        Some(match called.as_str() {
            "min" => self.column(format!("min({argument})"), "min", column.map(Aggregate::Least)),
            "max" => self.column(format!("max({argument})"), "max", column.map(Aggregate::Greatest)),
            "sum" => self.column(format!("sum({argument})"), "sum", column.map(Aggregate::Sum)),
            "count" => self.column(count, "sum", counted),
            _ => {
                let sum = self.column(format!("sum(CAST({argument} AS DOUBLE))"), "sum", column.map(Aggregate::Sum));
                let count = self.column(count, "sum", counted);
                let count = cast(count, DataType::Double(sqlparser::ast::ExactNumberInfo::None));
                let binary = |left, op, right| Expr::BinaryOp { left: Box::new(left), op, right: Box::new(right) };
                // The mean of no values is null, not 0/0.
                let zero = Expr::value(Value::Number("0.0".to_owned(), false));
                let some = binary(count.clone(), BinaryOperator::Gt, zero);
                if_else_null(some, binary(sum, BinaryOperator::Divide, count))
            }
        })
    }
}

impl Visit for AggregateExtractor<'_> {
    fn before(&mut self, expression: &mut Expr) -> ControlFlow<()> {
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

/// The functions that a query calls.
#[derive(Default)]
struct Functions {
    aggregates: bool,
    /// Whether it calls functions that need all rows at once, or unknown functions.
    others: bool,
}

/// Removes the name of the table from columns, and finds expressions that need all rows at once.
struct ColumnSimplifier<'a> {
    table: &'a str,
    alias: &'a str,
    functions: Functions,
}

impl Visit for ColumnSimplifier<'_> {
    fn query(&mut self, _: &mut Query) -> ControlFlow<()> {
        ControlFlow::Break(())
    }

    fn before(&mut self, expression: &mut Expr) -> ControlFlow<()> {
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
                self.functions.aggregates |= aggregate;
                self.functions.others |= !bare || !list || !aggregate && !is_one_of(SCALAR_FUNCTIONS, function);
            }
            _ => {}
        }
        ControlFlow::Continue(())
    }
}
