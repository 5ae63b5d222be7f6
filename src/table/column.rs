//! A column: one definition gives its name, type, unit and meaning.

use crate::grid::{Grid, Quantity, Scale};

/// The type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A number in this unit.
    Number(&'static str),
    /// A value of a quantity, in the unit of its axis; relative to `t_f` where the grid has no such axis.
    Quantity(Quantity),
    /// One of these words.
    Label(&'static [&'static str]),
    /// A truth value: 1 or 0 in a [`ColumnBuffer`](super::ColumnBuffer).
    Flag,
}

/// One column of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    /// Its name.
    pub name: &'static str,
    /// Its type.
    pub kind: Kind,
    /// Its meaning in one line.
    pub doc: &'static str,
    /// Whether it is written only if a spec names it.
    pub optional: bool,
}

impl Column {
    /// A column of numbers in `unit`.
    pub const fn number(name: &'static str, unit: &'static str, doc: &'static str) -> Column {
        Column { name, kind: Kind::Number(unit), doc, optional: false }
    }

    /// This column, written only if a spec names it.
    pub const fn optional(self) -> Column {
        Column { optional: true, ..self }
    }

    /// The unit of its values in a sweep over `grid`; empty for words.
    pub fn unit(&self, grid: &Grid) -> &'static str {
        grid.units.name(self.model_unit(grid))
    }

    /// The unit in the model.
    fn model_unit(&self, grid: &Grid) -> &'static str {
        match self.kind {
            Kind::Number(unit) => unit,
            Kind::Quantity(quantity) => quantity.unit(grid.scale(quantity).unwrap_or(Scale::Duration)),
            Kind::Label(_) | Kind::Flag => "",
        }
    }

    /// The factor from the units of the model to those of `grid`.
    pub fn size(&self, grid: &Grid) -> f64 {
        grid.units.size(self.model_unit(grid))
    }
}

/// A column of a table, and the value of its cell for a row `R`.
pub struct Field<R> {
    /// The column.
    pub column: Column,
    /// The cell in the units of the model: a number, NaN for none; the index of a word; 1 or 0 for a flag.
    pub cell: fn(&R) -> f64,
}

/// Defines the fields of a table and its columns: for each field the name, the unit or `(kind)`, the meaning, `optional` if it is written
/// only if a spec names it, and the cell of a row.
macro_rules! fields {
    ($row:ty: $($name:ident $kind:tt $doc:literal $(, $optional:ident)? => $cell:expr;)+) => {
        const FIELDS: &[$crate::table::Field<$row>] = &[$($crate::table::Field {
            column: $crate::table::Column {
                name: stringify!($name),
                kind: $crate::table::column::fields!(@kind $kind),
                doc: $doc,
                optional: $crate::table::column::fields!(@flag $($optional)?),
            },
            cell: $cell,
        }),+];
        const COLUMNS: [$crate::table::Column; FIELDS.len()] = $crate::table::columns(FIELDS);

        /// The indices of the columns.
        #[allow(dead_code, non_camel_case_types)]
        enum Index { $($name),+ }

        impl From<Index> for usize {
            fn from(index: Index) -> usize {
                index as usize
            }
        }
    };
    (@kind ($kind:expr)) => { $kind };
    (@kind $unit:literal) => { $crate::table::Kind::Number($unit) };
    (@flag) => { false };
    (@flag optional) => { true };
}
pub(super) use fields;

/// The columns of these fields.
pub const fn columns<R, const N: usize>(fields: &[Field<R>]) -> [Column; N] {
    let mut columns = [fields[0].column; N];
    let mut place = 0;
    while place < N {
        columns[place] = fields[place].column;
        place += 1;
    }
    columns
}

/// An optional number as a cell: NaN for `None`.
pub fn number(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

/// Name of the last column of every table.
pub const STATUS: &str = "status";

/// Meaning of the last column of every table.
pub const STATUS_DOC: &str = "outcome of the row; a number that does not exist is null";
