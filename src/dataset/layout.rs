//! The columns of a table on disk: Arrow types, and units and meanings as field metadata.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_schema::{DataType, Field, Schema, SchemaRef};

use crate::grid::{Grid, Quantity, Scale};
use crate::table::{Column, Kind, STATUS, STATUS_DOC, Selection, Table};

/// The columns of one table of one sweep, in order: axes, the selected columns, `status`.
#[derive(Debug, Clone)]
pub struct Layout {
    /// The axes.
    pub axes: Vec<Quantity>,
    /// The selected columns.
    pub columns: Vec<Column>,
    /// All of them as Arrow fields.
    pub schema: SchemaRef,
}

impl Layout {
    /// The layout of `table` over `grid`, with the columns of `selection`.
    pub fn new(table: &dyn Table, selection: &Selection, grid: &Grid) -> Layout {
        let axes: Vec<Quantity> = Quantity::ALL.into_iter().filter(|axis| table.axes().contains(axis)).collect();
        let columns: Vec<Column> = selection.indices().iter().map(|&index| table.columns()[index]).collect();
        let mut fields = Vec::new();
        for axis in &axes {
            let unit = grid.units.name(axis.unit(grid.scale(*axis).unwrap_or(Scale::Model)));
            let kind = if axis.words().is_empty() { DataType::Float64 } else { label() };
            fields.push(field(axis.name(), kind, false, unit, axis.doc()));
        }
        for column in &columns {
            let kind = match column.kind {
                Kind::Number(_) | Kind::Quantity(_) => DataType::Float64,
                Kind::Label(_) => label(),
                Kind::Flag => DataType::Boolean,
            };
            fields.push(field(column.name, kind, true, column.unit(grid), column.doc));
        }
        fields.push(field(STATUS, label(), false, "", STATUS_DOC));
        Layout { axes, columns, schema: Arc::new(Schema::new(fields)) }
    }
}

/// The type of words: places in a dictionary.
pub fn label() -> DataType {
    DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8))
}

/// A field with its unit and meaning as metadata.
pub fn field(name: &str, kind: DataType, nullable: bool, unit: &str, doc: &str) -> Field {
    let entries = [("unit", unit), ("description", doc)].map(|(key, value)| (key.to_owned(), value.to_owned()));
    Field::new(name, kind, nullable).with_metadata(HashMap::from(entries))
}
