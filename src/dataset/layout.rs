//! The columns of a table on disk: Arrow types, and units and meanings as field metadata.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_schema::{DataType, Field, Schema, SchemaRef};

use crate::grid::{Grid, Quantity, Scale};
use crate::model::Units;
use crate::table::{Column, Kind, Prediction, Projection, STATUS, STATUS_DOC, Table, written};

/// Meaning of a column of labels.
const LABEL_DOC: &str = "label of the row's point, from the file of `points`";

/// The columns of one table of one sweep, in order: axes, labels, the selected columns, `status`.
#[derive(Debug, Clone)]
pub struct Layout {
    /// The axes.
    pub axes: Vec<Quantity>,
    /// The names of the labels, in the order of the grid.
    pub labels: Vec<String>,
    /// The selected columns.
    pub columns: Vec<Column>,
    /// All columns as Arrow fields.
    pub schema: SchemaRef,
    /// The units of the values.
    pub units: Units,
    /// The prediction for a column by a simpler theory.
    pub prediction: Option<Prediction>,
}

impl Layout {
    /// The layout of `table` over `grid`, with the columns of `projection`.
    pub fn new(table: &Table, projection: &Projection, grid: &Grid) -> Layout {
        let is_written =
            |axis: &Quantity| table.axes().contains(axis) && (!axis.is_tacit() || grid.scale(*axis).is_some());
        let axes: Vec<Quantity> = Quantity::ALL.into_iter().filter(is_written).collect();
        let columns: Vec<Column> =
            projection.indices().iter().map(|&index| written(table.columns()[index], grid)).collect();
        let mut labels: Vec<String> = Vec::new();
        for name in grid.blocks.iter().flat_map(|block| block.labels(table.axes())) {
            if !labels.iter().any(|known| known == name) {
                labels.push(name.to_owned());
            }
        }
        let mut fields = Vec::new();
        for axis in &axes {
            let unit = grid.units.name(axis.unit(grid.scale(*axis).unwrap_or(Scale::Model)));
            let kind = if axis.words().is_empty() { DataType::Float64 } else { label() };
            fields.push(field(axis.name(), kind, false, unit, axis.doc()));
        }
        fields.extend(labels.iter().map(|name| field(name, label(), true, "", LABEL_DOC)));
        for column in &columns {
            let kind = match column.kind {
                Kind::Number(_) | Kind::Quantity(_) => DataType::Float64,
                Kind::Label(_) => label(),
                Kind::Flag => DataType::Boolean,
            };
            fields.push(field(column.name, kind, true, column.unit(grid), column.doc));
        }
        fields.push(field(STATUS, label(), false, "", STATUS_DOC));
        let (units, prediction) = (grid.units, table.prediction());
        Layout { axes, labels, columns, schema: Arc::new(Schema::new(fields)), units, prediction }
    }
}

/// The Arrow type of words: a dictionary.
pub fn label() -> DataType {
    DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8))
}

/// A field with its unit and meaning as metadata.
pub fn field(name: &str, kind: DataType, nullable: bool, unit: &str, doc: &str) -> Field {
    let entries = [("unit", unit), ("description", doc)].map(|(key, value)| (key.to_owned(), value.to_owned()));
    Field::new(name, kind, nullable).with_metadata(HashMap::from(entries))
}
