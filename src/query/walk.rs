//! The walk through the parts of a question, common to all visitors: each visitor of sqlparser's would be code of its own for all of SQL.

use std::ops::ControlFlow;

use sqlparser::ast::{Expr, Query, Select, TableFactor, VisitMut, VisitorMut};

/// The visitor of the parts of a question; `Break` ends the walk.
pub trait Visit {
    /// Before the parts of a query.
    fn query(&mut self, _: &mut Query) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Before the parts of a SELECT.
    fn select(&mut self, _: &mut Select) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Before the parts of what FROM and JOIN name.
    fn table(&mut self, _: &mut TableFactor) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Before the parts of an expression.
    fn before(&mut self, _: &mut Expr) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// After the parts of an expression.
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

/// Leads a visitor through a part of a question; whether it got to the end.
pub fn walk(part: &mut impl VisitMut, visitor: &mut dyn Visit) -> bool {
    VisitMut::visit(part, &mut Walk(visitor)).is_continue()
}
