//! A query: one SELECT from the tables of the dataset, checked and translated into the dialect of polars.

use std::collections::HashSet;
use std::ops::ControlFlow;

use sqlparser::ast::{
    BinaryOperator, DuplicateTreatment, Expr, Function, FunctionArg, FunctionArgExpr, FunctionArguments, GroupByExpr,
    Ident, JoinConstraint, JoinOperator, NamedWindowDefinition, NamedWindowExpr, ObjectName, ObjectNamePart,
    OrderByExpr, OrderByKind, Query, Select, SelectItem, SetExpr, Statement, TableFactor, UnaryOperator, Value,
    ValueWithSpan, VisitorMut, WindowType,
};
use sqlparser::dialect::GenericDialect;
use sqlparser::parser::{Parser, ParserError};

use super::comparisons::Comparisons;
use super::scan::Files;
use super::units::{Columns, units};
use super::walk::walk;
use super::{Absent, QueryError, Source, Tables};
use crate::names::hint;

/// A valid query.
pub struct CheckedQuery {
    /// The query in the dialect of polars.
    pub query: Box<Query>,
    /// The known units of its columns, by name.
    pub units: Columns,
    /// The tables in its FROM.
    pub read: HashSet<String>,
    /// A fault of a query whose names are valid.
    pub mixed: Option<QueryError>,
    /// Its comparisons of columns with constants.
    pub comparisons: Comparisons,
    /// Whether its rows are groups without an order.
    pub is_unordered: bool,
}

/// Functions of text. In polars they take text alone; functions of numbers take text too, and return nulls for it.
const TEXT_FUNCTIONS: &str = "array_agg bit_length concat concat_ws ends_with greatest initcap least left length lower ltrim max min octet_length \
    regexp_like replace reverse right rtrim split_part starts_with string_agg strpos substr upper";

/// Whether a function has one of these names.
pub fn is_one_of(names: &str, function: &Function) -> bool {
    let called = function.name.to_string().to_lowercase();
    names.split(' ').any(|name| name == called)
}

/// The help for most queries.
const GENERAL_HELP: &str =
    "correct the query; text goes in 'single quotes', names with special characters in \"double\" ones";

impl CheckedQuery {
    /// Parses and checks the query `sql` on these tables.
    ///
    /// # Errors
    ///
    /// What is wrong with the query, and how to correct it.
    pub fn parse(sql: &str, opened: &Tables) -> Result<CheckedQuery, QueryError> {
        let statements = Parser::parse_sql(&GenericDialect {}, sql).map_err(|error| match error {
            ParserError::RecursionLimitExceeded => {
                QueryError::sql("parentheses are nested too deeply", "simplify the query")
            }
            ParserError::TokenizerError(text) | ParserError::ParserError(text) => {
                QueryError::sql(format!("not SQL: {text}"), GENERAL_HELP)
            }
        })?;
        let [statement] = <[Statement; 1]>::try_from(statements).map_err(|statements| {
            let found = if statements.is_empty() { "the query is empty" } else { "several statements" };
            QueryError::sql(found, "write one SELECT")
        })?;
        let Statement::Query(mut query) = statement else {
            let words = statement.to_string();
            let first = words.split_whitespace().next().unwrap_or_default().to_uppercase();
            return Err(match first.as_str() {
                "SHOW" | "DESCRIBE" | "EXPLAIN" | "DESC" => QueryError::sql(
                    format!("{first} is not supported"),
                    "`slipsweep head DATASET` lists the tables with their columns; write one SELECT",
                ),
                _ => QueryError::sql(format!("{first} is refused: `query` reads and never writes"), "write one SELECT"),
            });
        };
        let Tables { sources, absent } = opened;
        let [tables, read, windows, aliases] = Default::default();
        let mut check = Check { sources, absent, tables, read, windows, aliases, fault: None, mixed: None };
        walk(query.as_mut(), &mut check);
        if let Some(fault) = check.fault {
            return Err(fault);
        }
        let words = sources.iter().flat_map(|source| &source.files).flat_map(Files::words).collect();
        walk(query.as_mut(), &mut Names);
        let columns = |source: &Source| source.columns.iter().cloned().zip(source.units.iter().cloned()).collect();
        let tables = sources.iter().map(|source| (source.name.clone(), columns(source))).collect();
        let units = units(&query, &tables);
        let read = sources.iter().filter(|source| check.read.contains(&source.name)).collect();
        let comparisons = Comparisons::of(&mut query, read, check.aliases);
        let is_grouped = matches!(query.body.as_ref(), SetExpr::Select(select) if !is_empty(&select.group_by));
        let is_unordered = is_grouped && query.order_by.is_none() && query.limit_clause.is_none();
        walk(query.as_mut(), &mut PolarsDialect { words });
        Ok(CheckedQuery { query, units, read: check.read, mixed: check.mixed, comparisons, is_unordered })
    }
}

/// The visitor that finds unsupported parts of a query.
struct Check<'a> {
    sources: &'a [Source],
    absent: &'a [Absent],
    /// Names of tables that the query defines itself.
    tables: HashSet<String>,
    /// Names of all tables in FROM.
    read: HashSet<String>,
    /// Names of windows with an order.
    windows: HashSet<String>,
    /// Names after AS in SELECT.
    aliases: HashSet<String>,
    fault: Option<QueryError>,
    /// A column and an aggregate in one SELECT or its ORDER BY, without GROUP BY.
    mixed: Option<QueryError>,
}

impl Check<'_> {
    fn is_ordered(&self, window: &WindowType) -> bool {
        match window {
            WindowType::WindowSpec(window) => !window.order_by.is_empty(),
            WindowType::NamedWindow(name) => self.windows.contains(&name.value),
        }
    }

    fn refuse(&mut self, found: impl Into<String>, help: impl Into<String>) -> ControlFlow<()> {
        self.fault = Some(QueryError::sql(found, help));
        ControlFlow::Break(())
    }

    /// Records the first of `columns` in or after a SELECT of an aggregate without GROUP BY.
    fn mix(&mut self, select: &Select, mut columns: impl Iterator<Item = String>) {
        let mut items = select.projection.iter().filter_map(expression);
        if is_empty(&select.group_by)
            && let Some(aggregate) = items.find_map(|item| first_part(item, is_plain_aggregate, |_| false))
            && let Some(column) = columns.next()
        {
            // polars would repeat the aggregate in every row, and order the only row.
            self.mixed = Some(QueryError::sql(
                format!("`{column}` is neither in GROUP BY nor in an aggregate"),
                format!("write {aggregate} alone or with GROUP BY; for every row, write {aggregate} OVER ()"),
            ));
        }
    }
}

impl VisitorMut for Check<'_> {
    type Break = ();

    fn pre_visit_query(&mut self, query: &mut Query) -> ControlFlow<()> {
        for table in query.with.iter().flat_map(|with| &with.cte_tables) {
            let name = &table.alias.name.value;
            // polars would use the table of the dataset instead.
            if self.sources.iter().any(|source| source.name == *name) {
                return self.refuse(format!("WITH {name}: a table has this name"), "choose another name");
            }
            self.tables.insert(name.clone());
        }
        if let SetExpr::Select(select) = query.body.as_ref()
            && let Some(OrderByKind::Expressions(keys)) = query.order_by.as_ref().map(|order| &order.kind)
        {
            let columns = keys.iter().filter_map(|key| first_part(&key.expr, is_column, is_plain_aggregate));
            let is_item =
                |column: &String| select.projection.iter().any(|item| item_name(item) == column.trim_matches('"'));
            self.mix(select, columns.filter(|column| !is_item(column)));
        }
        match query.body.as_ref() {
            SetExpr::Insert(_) | SetExpr::Update(_) | SetExpr::Delete(_) | SetExpr::Merge(_) => {
                self.refuse("refused: `query` reads and never writes", "write one SELECT")
            }
            _ => ControlFlow::Continue(()),
        }
    }

    fn pre_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
        let Expr::Function(function) = &*expression else { return ControlFlow::Continue(()) };
        let argument = first_argument(function).filter(|argument| is_constant(argument));
        if argument.is_some() && is_one_of(AGGREGATE_FUNCTIONS, function) {
            return self.refuse(
                format!("`{expression}`: no column in it"),
                "count(*) counts rows; name a column for other aggregates",
            );
        }
        match &function.over {
            // polars would ignore the order.
            Some(window) if self.is_ordered(window) && !is_one_of(ORDERED, function) => self.refuse(
                format!("`{expression}`: no running `{}`", function.name),
                "with ORDER BY, use row_number, lag, lead, first_value, last_value, sum, count, min or max",
            ),
            _ => ControlFlow::Continue(()),
        }
    }

    fn pre_visit_select(&mut self, select: &mut Select) -> ControlFlow<()> {
        let joins = select.from.iter().flat_map(|from| &from.joins);
        let condition = joins.filter_map(|join| outer_condition(&join.join_operator));
        if let Some(condition) = condition.into_iter().find(|condition| !is_equalities(condition)) {
            // polars would apply the other conditions to the joined rows, and lose rows without a match.
            return self.refuse(
                format!("ON {condition}: an outer join compares columns with columns by ="),
                "filter in a subquery: FROM a LEFT JOIN (SELECT * FROM b WHERE ...) AS b ON a.x = b.x",
            );
        }
        self.aliases.extend(select.projection.iter().filter_map(|item| match item {
            SelectItem::ExprWithAlias { alias, .. } => Some(alias.value.clone()),
            _ => None,
        }));
        for NamedWindowDefinition(name, window) in &select.named_window {
            if matches!(window, NamedWindowExpr::WindowSpec(window) if !window.order_by.is_empty()) {
                self.windows.insert(name.value.clone());
            }
        }
        if let Some(function) = select.selection.as_ref().and_then(first_aggregate) {
            return self.refuse(
                format!("WHERE contains the aggregate `{function}`, but it selects single rows"),
                "write the condition in HAVING, after GROUP BY; for OVER, filter a subquery: FROM (SELECT ...) AS t WHERE ...",
            );
        }
        self.mix(select, select.projection.iter().filter_map(first_bare_column));
        let is_grouped = select.having.is_some() || !is_empty(&select.group_by);
        let mut items = select.projection.iter().filter_map(expression).chain(&select.qualify);
        if is_grouped && let Some(window) = items.find_map(|item| first_part(item, is_window, |_| false)) {
            return self.refuse(
                format!("`{window}`: OVER and GROUP BY in one SELECT"),
                "group in a subquery: SELECT ... OVER (...) FROM (SELECT ... GROUP BY ...) AS t",
            );
        }
        if select.into.is_some() {
            return self.refuse(
                "SELECT INTO writes a table, and `query` never does",
                "leave INTO out; `--out FILE` writes the answer",
            );
        }
        ControlFlow::Continue(())
    }

    fn pre_visit_table_factor(&mut self, table: &mut TableFactor) -> ControlFlow<()> {
        let name = match &*table {
            TableFactor::Table { name, args: None, .. } => name,
            TableFactor::Table { name, .. } => {
                return self.refuse(
                    format!("`{name}(...)`: only the tables of the dataset can be read"),
                    "name another dataset or file on the command line instead",
                );
            }
            TableFactor::TableFunction { .. } | TableFactor::Function { .. } => {
                return self.refuse(
                    "a function in FROM: only the tables of the dataset can be read",
                    "name another dataset or file on the command line instead",
                );
            }
            _ => return ControlFlow::Continue(()),
        };
        let word = match name.0.as_slice() {
            [ObjectNamePart::Identifier(word)] => word.value.clone(),
            _ => name.to_string(),
        };
        let names: Vec<&str> = self.sources.iter().map(|source| source.name.as_str()).collect();
        if self.tables.contains(&word) || names.contains(&word.as_str()) {
            self.read.insert(word);
            return ControlFlow::Continue(());
        }
        if let Some(table) = self.absent.iter().find(|table| table.name == word) {
            self.fault = Some(table.error());
            return ControlFlow::Break(());
        }
        let help = hint(&word, names.iter().copied());
        self.refuse(format!("no table `{word}`\n  expected: {}", names.join(", ")), help)
    }
}

/// Window functions that follow the order of their window.
const ORDERED: &str = "row_number lag lead first_value last_value sum count min max";

/// Whether a SELECT has no GROUP BY.
fn is_empty(group_by: &GroupByExpr) -> bool {
    matches!(group_by, GroupByExpr::Expressions(keys, _) if keys.is_empty())
}

/// The expression of an item of SELECT.
pub fn expression(item: &SelectItem) -> Option<&Expr> {
    match item {
        SelectItem::UnnamedExpr(expression) | SelectItem::ExprWithAlias { expr: expression, .. } => Some(expression),
        _ => None,
    }
}

/// The name of an item of SELECT; empty for several columns.
pub fn item_name(item: &SelectItem) -> String {
    match item {
        SelectItem::UnnamedExpr(expression) => name(expression),
        SelectItem::ExprWithAlias { alias, .. } => alias.value.clone(),
        _ => String::new(),
    }
}

/// The first part of an expression that is `wanted`, as text, outside subqueries and outside parts for which `hides` holds.
fn first_part(expression: &Expr, wanted: fn(&Expr) -> bool, hides: fn(&Expr) -> bool) -> Option<String> {
    struct Search {
        wanted: fn(&Expr) -> bool,
        hides: fn(&Expr) -> bool,
        /// Number of subqueries and hiding parts around the visited one.
        depth: u32,
        found: Option<String>,
    }
    impl VisitorMut for Search {
        type Break = ();

        fn pre_visit_query(&mut self, _: &mut Query) -> ControlFlow<()> {
            self.depth += 1;
            ControlFlow::Continue(())
        }

        fn post_visit_query(&mut self, _: &mut Query) -> ControlFlow<()> {
            self.depth -= 1;
            ControlFlow::Continue(())
        }

        fn pre_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
            if self.depth == 0 && (self.wanted)(expression) {
                self.found = Some(expression.to_string());
                return ControlFlow::Break(());
            }
            self.depth += u32::from((self.hides)(expression));
            ControlFlow::Continue(())
        }

        fn post_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
            self.depth -= u32::from((self.hides)(expression));
            ControlFlow::Continue(())
        }
    }
    let mut search = Search { wanted, hides, depth: 0, found: None };
    walk(&mut expression.clone(), &mut search);
    search.found
}

fn is_window(expression: &Expr) -> bool {
    matches!(expression, Expr::Function(function) if function.over.is_some())
}

/// Whether an expression is an aggregate without OVER.
fn is_plain_aggregate(expression: &Expr) -> bool {
    matches!(expression, Expr::Function(function) if function.over.is_none() && is_aggregate(function))
}

/// The first aggregate or window function of an expression.
fn first_aggregate(expression: &Expr) -> Option<String> {
    first_part(expression, |part| is_window(part) || is_plain_aggregate(part), |_| false)
}

/// The first column of an item of SELECT outside aggregates and subqueries, as text.
fn first_bare_column(item: &SelectItem) -> Option<String> {
    match expression(item) {
        Some(expression) => first_part(expression, is_column, is_plain_aggregate),
        None => Some(item.to_string()),
    }
}

/// Whether a function reduces the rows of a group to one value.
pub fn is_aggregate(function: &Function) -> bool {
    is_one_of(AGGREGATE_FUNCTIONS, function)
        || is_one_of(
            "array_agg corr count covar covar_pop covar_samp first group_concat last listagg string_agg",
            function,
        )
}

/// Aggregates that polars applies to a constant as if it were one row.
const AGGREGATE_FUNCTIONS: &str = "avg max mean median min quantile_cont quantile_disc stddev stddev_samp stdev stdev_samp sum total var var_samp \
    variance";

/// The condition of a join that keeps rows without a match.
fn outer_condition(join: &JoinOperator) -> Option<&Expr> {
    match join {
        JoinOperator::Left(constraint)
        | JoinOperator::LeftOuter(constraint)
        | JoinOperator::Right(constraint)
        | JoinOperator::RightOuter(constraint)
        | JoinOperator::FullOuter(constraint) => match constraint {
            JoinConstraint::On(condition) => Some(condition),
            _ => None,
        },
        _ => None,
    }
}

/// Whether a condition contains only comparisons of columns with columns by `=`.
fn is_equalities(condition: &Expr) -> bool {
    match condition {
        Expr::Nested(inner) => is_equalities(inner),
        Expr::BinaryOp { left, op: BinaryOperator::And, right } => is_equalities(left) && is_equalities(right),
        Expr::BinaryOp { left, op: BinaryOperator::Eq, right } => is_name(left) && is_name(right),
        _ => false,
    }
}

/// Whether an expression is the name of a column.
pub fn is_name(expression: &Expr) -> bool {
    matches!(expression, Expr::Identifier(_) | Expr::CompoundIdentifier(_))
}

/// Whether an expression is a column, or all or some columns.
fn is_column(expression: &Expr) -> bool {
    match expression {
        Expr::Identifier(_) | Expr::CompoundIdentifier(_) | Expr::Wildcard(_) | Expr::QualifiedWildcard(..) => true,
        Expr::Function(function) => is_one_of("columns", function),
        _ => false,
    }
}

/// Whether an expression contains no column.
fn is_constant(expression: &Expr) -> bool {
    first_part(expression, is_column, |_| false).is_none()
}

/// The visitor that names the columns of every SELECT, also for use in ORDER BY.
struct Names;

impl VisitorMut for Names {
    type Break = ();

    fn pre_visit_select(&mut self, select: &mut Select) -> ControlFlow<()> {
        if let Some(mut having) = select.having.take() {
            let keys = keys_of(select);
            walk(&mut having, &mut HavingTerms { keys: &keys, projection: &select.projection, inside: 0 });
            select.having = Some(having);
        }
        ControlFlow::Continue(())
    }

    fn pre_visit_query(&mut self, query: &mut Query) -> ControlFlow<()> {
        let SetExpr::Select(select) = query.body.as_mut() else { return ControlFlow::Continue(()) };
        let mut taken: HashSet<String> = HashSet::new();
        for item in &mut select.projection {
            let (expression, name) = match item {
                // It stands for several columns, which have names already.
                SelectItem::UnnamedExpr(Expr::Function(function)) if is_one_of("columns", function) => continue,
                SelectItem::UnnamedExpr(expression) => (expression.clone(), name(expression)),
                SelectItem::ExprWithAlias { alias, .. } => {
                    taken.insert(alias.value.clone());
                    continue;
                }
                _ => continue,
            };
            let mut free = name.clone();
            let mut number = 0;
            while !taken.insert(free.clone()) {
                number += 1;
                free = format!("{name}_{number}");
            }
            if !is_name(&expression) || number > 0 {
                *item = SelectItem::ExprWithAlias { expr: expression, alias: Ident::with_quote('"', free) };
            }
        }
        let Some(OrderByKind::Expressions(keys)) = query.order_by.as_mut().map(|order| &mut order.kind) else {
            return ControlFlow::Continue(());
        };
        for key in keys {
            let is_plain = is_name(&key.expr) || matches!(key.expr, Expr::Value(_));
            let same = select.projection.iter().find_map(|item| match item {
                SelectItem::ExprWithAlias { expr, alias } if *expr == key.expr => Some(alias.clone()),
                _ => None,
            });
            if let (false, Some(alias)) = (is_plain, same) {
                key.expr = Expr::Identifier(alias);
            }
        }
        ControlFlow::Continue(())
    }
}

/// The expressions of GROUP BY; a name that stands for an item of SELECT also as that item.
fn keys_of(select: &Select) -> Vec<Expr> {
    let items = || select.projection.iter().filter_map(expression).filter(|item| first_aggregate(item).is_none());
    let GroupByExpr::Expressions(keys, _) = &select.group_by else { return items().cloned().collect() };
    let places = keys.iter().filter_map(whole_number);
    let numbered = places.filter_map(|place| select.projection.get(place.checked_sub(1)?));
    let named = keys.iter().filter_map(|key| meaning(key, &select.projection));
    let written = keys.iter().filter(|key| whole_number(key).is_none());
    written.chain(named).chain(numbered.filter_map(expression)).cloned().collect()
}

/// The item of SELECT that a name stands for.
fn meaning<'a>(name: &Expr, projection: &'a [SelectItem]) -> Option<&'a Expr> {
    let Expr::Identifier(name) = name else { return None };
    projection.iter().find_map(|item| match item {
        SelectItem::ExprWithAlias { expr, alias } if alias.value == name.value => Some(expr),
        _ => None,
    })
}

/// The visitor that writes HAVING in aggregates of the columns of the table: polars does not know the keys of the groups there, nor other names
/// together with aggregates.
struct HavingTerms<'a> {
    keys: &'a [Expr],
    projection: &'a [SelectItem],
    /// Depth in aggregates and subqueries, whose columns keep their meaning.
    inside: u32,
}

impl VisitorMut for HavingTerms<'_> {
    type Break = ();

    fn pre_visit_query(&mut self, _: &mut Query) -> ControlFlow<()> {
        self.inside += 1;
        ControlFlow::Continue(())
    }

    fn post_visit_query(&mut self, _: &mut Query) -> ControlFlow<()> {
        self.inside -= 1;
        ControlFlow::Continue(())
    }

    fn pre_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
        if self.inside == 0 {
            if self.keys.contains(expression) {
                *expression = parsed(format!("min({expression})"));
            } else if let Some(item) = meaning(expression, self.projection) {
                let function = if first_aggregate(item).is_some() { "" } else { "min" };
                *expression = parsed(format!("{function}({item})"));
            }
        }
        self.inside += u32::from(matches!(expression, Expr::Function(function) if is_aggregate(function)));
        ControlFlow::Continue(())
    }

    fn post_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
        self.inside -= u32::from(matches!(expression, Expr::Function(function) if is_aggregate(function)));
        ControlFlow::Continue(())
    }
}

/// The expression `sql`, put together from expressions of the query. If these are nested too deeply for more, it stays text, which polars refuses.
pub fn parsed(sql: String) -> Expr {
    let expression = Parser::new(&GenericDialect {}).try_with_sql(&sql).and_then(|mut parser| parser.parse_expr());
    expression.unwrap_or_else(|_| Expr::Identifier(Ident::new(sql)))
}

/// The name of a column without `AS`, as in DuckDB; `count(*)` is `count`.
pub fn name(expression: &Expr) -> String {
    match expression {
        Expr::CompoundIdentifier(names) => names.last().map(|name| name.value.clone()).unwrap_or_default(),
        Expr::Nested(inner) => name(inner),
        other => written(other),
    }
}

/// An expression in the name of a column.
fn written(expression: &Expr) -> String {
    match expression {
        Expr::Identifier(name) => name.value.clone(),
        Expr::CompoundIdentifier(names) => names.iter().map(|name| name.value.as_str()).collect::<Vec<_>>().join("."),
        Expr::Nested(inner) => written(inner),
        Expr::BinaryOp { left, op, right } => format!("({} {op} {})", written(left), written(right)),
        Expr::Ceil { expr, .. } => format!("ceil({})", written(expr)),
        Expr::Floor { expr, .. } => format!("floor({})", written(expr)),
        Expr::Function(function) => {
            let called = function.name.to_string().to_lowercase();
            let FunctionArguments::List(list) = &function.args else { return expression.to_string() };
            let is_plain = function.over.is_none() && function.filter.is_none() && list.clauses.is_empty();
            if !is_plain {
                return expression.to_string();
            }
            if called == "count" && matches!(list.args.as_slice(), [FunctionArg::Unnamed(FunctionArgExpr::Wildcard)]) {
                return called;
            }
            let distinct = match list.duplicate_treatment {
                Some(DuplicateTreatment::Distinct) => "DISTINCT ",
                _ => "",
            };
            let argument = |argument: &FunctionArg| match argument {
                FunctionArg::Unnamed(FunctionArgExpr::Expr(inner)) => written(inner),
                other => other.to_string(),
            };
            let arguments: Vec<String> = list.args.iter().map(argument).collect();
            format!("{called}({distinct}{})", arguments.join(", "))
        }
        other => other.to_string(),
    }
}

/// The first argument of a function.
pub fn first_argument(function: &Function) -> Option<&Expr> {
    let FunctionArguments::List(list) = &function.args else { return None };
    match list.args.first()? {
        FunctionArg::Unnamed(FunctionArgExpr::Expr(inner)) => Some(inner),
        _ => None,
    }
}

/// The visitor that translates a query into the dialect of polars.
struct PolarsDialect {
    /// Columns of words, which are categories in polars; functions need them as text.
    words: HashSet<String>,
}

impl PolarsDialect {
    /// Makes text of a column of words.
    fn as_text(&self, expression: &mut Expr) {
        let column = match &*expression {
            Expr::Identifier(name) => Some(name),
            Expr::CompoundIdentifier(names) => names.last(),
            _ => None,
        };
        if column.is_some_and(|name| self.words.contains(&name.value)) {
            *expression = text(expression);
        }
    }
}

/// The keys of GROUP BY that are columns of joined tables, with their names in SELECT, such as `least` in `c.gap AS least`: polars does not find
/// `c.gap` if there is an aggregate of another column `gap`.
fn named_keys(select: &Select) -> Vec<(Expr, Ident)> {
    let GroupByExpr::Expressions(keys, _) = &select.group_by else { return Vec::new() };
    let named = |item: &SelectItem| {
        let key = expression(item).filter(|key| keys.contains(key))?;
        let Expr::CompoundIdentifier(names) = key else { return None };
        let name = match item {
            SelectItem::ExprWithAlias { alias, .. } => alias.clone(),
            _ => names.last()?.clone(),
        };
        Some((key.clone(), name))
    };
    select.projection.iter().filter_map(named).collect()
}

/// Whether a name is that of the column itself.
fn is_own_name(column: &Expr, name: &Ident) -> bool {
    matches!(column, Expr::CompoundIdentifier(names) if names.last().is_some_and(|last| last.value == name.value))
}

/// `expression` as text.
fn text(expression: &Expr) -> Expr {
    parsed(format!("CAST({expression} AS VARCHAR)"))
}

impl VisitorMut for PolarsDialect {
    type Break = ();

    fn pre_visit_query(&mut self, query: &mut Query) -> ControlFlow<()> {
        let SetExpr::Select(select) = query.body.as_ref() else { return ControlFlow::Continue(()) };
        let named = named_keys(select);
        if let Some(OrderByKind::Expressions(keys)) = query.order_by.as_mut().map(|order| &mut order.kind) {
            for key in keys {
                if let Some((_, name)) = named.iter().find(|(known, _)| *known == key.expr) {
                    key.expr = Expr::Identifier(name.clone());
                }
            }
        }
        ControlFlow::Continue(())
    }

    fn pre_visit_select(&mut self, select: &mut Select) -> ControlFlow<()> {
        for NamedWindowDefinition(_, window) in &mut select.named_window {
            if let NamedWindowExpr::WindowSpec(window) = window {
                order_nulls(&mut window.order_by);
            }
        }
        for (key, name) in named_keys(select) {
            if let (false, GroupByExpr::Expressions(keys, _)) = (is_own_name(&key, &name), &mut select.group_by) {
                keys.iter_mut()
                    .filter(|known| **known == key)
                    .for_each(|known| *known = Expr::Identifier(name.clone()));
                continue;
            }
            for item in &mut select.projection {
                if matches!(item, SelectItem::ExprWithAlias { expr, .. } if *expr == key) {
                    *item = SelectItem::UnnamedExpr(key.clone());
                }
            }
        }
        ControlFlow::Continue(())
    }

    fn post_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
        match expression {
            Expr::Value(ValueWithSpan { value: Value::Number(digits, _), .. }) => *digits = plain(digits),
            // polars would cast the code of a category.
            Expr::Cast { expr, .. } => self.as_text(expr),
            Expr::Like { expr, .. }
            | Expr::ILike { expr, .. }
            | Expr::SimilarTo { expr, .. }
            | Expr::RLike { expr, .. } => {
                **expr = text(expr);
            }
            Expr::Substring { expr, .. } | Expr::Trim { expr, .. } | Expr::Position { r#in: expr, .. } => {
                self.as_text(expr);
            }
            Expr::BinaryOp { left, op: BinaryOperator::StringConcat, right } => {
                self.as_text(left);
                self.as_text(right);
            }
            Expr::InList { list, .. } => numbers_alike(list),
            // polars would return null for null.
            Expr::IsNotTrue(inner) => *expression = parsed(format!("(({inner}) IS NULL OR NOT ({inner}))")),
            Expr::IsNotFalse(inner) => *expression = parsed(format!("(({inner}) IS NULL OR ({inner}))")),
            Expr::Function(function) => self.function(function),
            _ => {}
        }
        ControlFlow::Continue(())
    }
}

/// Gives the nulls of the first key of a window their place. polars puts them first in either direction.
fn order_nulls(keys: &mut Vec<OrderByExpr>) {
    let Some(first) = keys.first().cloned() else { return };
    let descends = first.options.asc == Some(false);
    let nulls_first = first.options.nulls_first.unwrap_or(descends);
    // Of 0 and 1, the one that comes first in this direction.
    let place = |comes_first: bool| u8::from(comes_first == descends);
    let (key, of_null, of_others) = (&first.expr, place(nulls_first), place(!nulls_first));
    let expr = parsed(format!("CASE WHEN ({key}) IS NULL THEN {of_null} ELSE {of_others} END"));
    keys.insert(0, OrderByExpr { expr, ..first });
    keys.iter_mut().for_each(|key| key.options.nulls_first = None);
}

impl PolarsDialect {
    fn function(&self, function: &mut Function) {
        if let Some(WindowType::WindowSpec(window)) = &mut function.over {
            order_nulls(&mut window.order_by);
        }
        let called = function.name.to_string().to_lowercase();
        let FunctionArguments::List(list) = &mut function.args else { return };
        // A constant has a value in every row.
        if let ("count", [FunctionArg::Unnamed(FunctionArgExpr::Expr(argument))]) = (called.as_str(), &mut *list.args)
            && list.duplicate_treatment.is_none()
            && is_constant(argument)
            && !matches!(argument, Expr::Value(ValueWithSpan { value: Value::Null, .. }))
        {
            list.args = vec![FunctionArg::Unnamed(FunctionArgExpr::Wildcard)];
            return;
        }
        // As in DuckDB and PostgreSQL, `log` of one number has base 10.
        if called == "log" && list.args.len() == 1 {
            function.name = ObjectName::from(vec![Ident::new("log10")]);
        }
        if !TEXT_FUNCTIONS.split(' ').any(|name| name == called) {
            return;
        }
        for argument in &mut list.args {
            if let FunctionArg::Unnamed(FunctionArgExpr::Expr(inner)) = argument {
                self.as_text(inner);
            }
        }
    }
}

/// The value of a whole number without a sign.
pub fn whole_number(expression: &Expr) -> Option<usize> {
    match expression {
        Expr::Value(ValueWithSpan { value: Value::Number(digits, _), .. }) => digits.parse().ok(),
        _ => None,
    }
}

/// Removes parentheses around the numbers of a list, and makes all of them decimals if one is: polars needs one type.
fn numbers_alike(list: &mut [Expr]) {
    for item in list.iter_mut() {
        while let Expr::Nested(inner) = item {
            *item = (**inner).clone();
        }
    }
    fn digits(item: &mut Expr) -> Option<&mut String> {
        match item {
            Expr::UnaryOp { op: UnaryOperator::Minus | UnaryOperator::Plus, expr } => digits(expr),
            Expr::Value(ValueWithSpan { value: Value::Number(digits, _), .. }) => Some(digits),
            _ => None,
        }
    }
    let is_decimal = |item: &mut Expr| digits(item).is_some_and(|digits| digits.contains('.'));
    if list.iter_mut().any(is_decimal) {
        for digits in list.iter_mut().filter_map(digits).filter(|digits| !digits.contains('.')) {
            digits.push_str(".0");
        }
    }
}

/// A number without an exponent; other numbers are unchanged.
fn plain(digits: &str) -> String {
    let value: Option<f64> = digits.parse().ok().filter(|value: &f64| value.is_finite());
    match value.filter(|_| digits.contains(['e', 'E'])) {
        // Without a decimal point it would be an integer of at most 64 bits.
        Some(value) if value.fract() == 0.0 => format!("{value}.0"),
        Some(value) => format!("{value}"),
        None => digits.to_owned(),
    }
}
