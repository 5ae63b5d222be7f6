//! The walk through a query, common to all visitors. On its own, each visitor would have a copy of the code for all of SQL.

use std::ops::ControlFlow;

use sqlparser::ast::{Expr, Query, Select, TableFactor, VisitMut, VisitorMut};

struct Walk<'a>(&'a mut dyn VisitorMut<Break = ()>);

impl VisitorMut for Walk<'_> {
    type Break = ();

    fn pre_visit_query(&mut self, query: &mut Query) -> ControlFlow<()> {
        self.0.pre_visit_query(query)
    }

    fn post_visit_query(&mut self, query: &mut Query) -> ControlFlow<()> {
        self.0.post_visit_query(query)
    }

    fn pre_visit_select(&mut self, select: &mut Select) -> ControlFlow<()> {
        self.0.pre_visit_select(select)
    }

    fn pre_visit_table_factor(&mut self, table: &mut TableFactor) -> ControlFlow<()> {
        self.0.pre_visit_table_factor(table)
    }

    fn pre_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
        self.0.pre_visit_expr(expression)
    }

    fn post_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
        self.0.post_visit_expr(expression)
    }
}

/// Leads a visitor through a part of a query, and returns whether it reached the end. The visitor sees queries, selects, tables and expressions.
pub fn walk(part: &mut impl VisitMut, visitor: &mut dyn VisitorMut<Break = ()>) -> bool {
    VisitMut::visit(part, &mut Walk(visitor)).is_continue()
}
