//! The walk through a query, common to all visitors. With the generic visitors of sqlparser, each visitor would have its own copy of the code
//! for all of SQL.

use std::ops::ControlFlow;

use sqlparser::ast::{Expr, Query, Select, TableFactor, VisitMut, VisitorMut};

/// A visitor of the parts of a query; `Break` ends the walk.
pub trait Visit {
    /// Called before the parts of a query.
    fn query(&mut self, _: &mut Query) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called after the parts of a query.
    fn after_query(&mut self) {}

    /// Called before the parts of a SELECT.
    fn select(&mut self, _: &mut Select) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called before the parts of a table in FROM or JOIN.
    fn table(&mut self, _: &mut TableFactor) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called before the parts of an expression.
    fn before(&mut self, _: &mut Expr) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called after the parts of an expression.
    fn after(&mut self, _: &mut Expr) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

struct Walk<'a>(&'a mut dyn Visit);

impl VisitorMut for Walk<'_> {
    type Break = ();

    fn pre_visit_query(&mut self, query: &mut Query) -> ControlFlow<()> {
        self.0.query(query)
    }

    fn post_visit_query(&mut self, _: &mut Query) -> ControlFlow<()> {
        self.0.after_query();
        ControlFlow::Continue(())
    }

    fn pre_visit_select(&mut self, select: &mut Select) -> ControlFlow<()> {
        self.0.select(select)
    }

    fn pre_visit_table_factor(&mut self, table: &mut TableFactor) -> ControlFlow<()> {
        self.0.table(table)
    }

    fn pre_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
        self.0.before(expression)
    }

    fn post_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<()> {
        self.0.after(expression)
    }
}

/// Leads a visitor through a part of a query, and returns whether it reached the end.
pub fn walk(part: &mut impl VisitMut, visitor: &mut dyn Visit) -> bool {
    VisitMut::visit(part, &mut Walk(visitor)).is_continue()
}
