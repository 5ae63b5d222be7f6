//! Parquet files as a table of polars. Only the needed columns and row groups are read, on all threads.

use std::any::Any;
use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowPrimitiveType, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type,
    UInt32Type, UInt64Type,
};
use arrow_array::{Array, BooleanArray, RecordBatch, new_empty_array};
use arrow_schema::{DataType as ArrowType, FieldRef, Fields, Schema as ArrowSchema};
use arrow_select::filter::filter_record_batch;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder};
use parquet::errors::ParquetError;
use parquet::file::metadata::RowGroupMetaData;
use polars::lazy::dsl::{Expr, Operator};
use polars::prelude::{
    AnonymousScan, AnonymousScanArgs, BooleanChunked, Categories, ChunkedArray, Column, DataFrame, DataType, IdxCa,
    IntoLazy, IntoSeries, LazyFrame, NamedFrom, PlSmallStr, PolarsError, PolarsNumericType, PolarsResult,
    ScanArgsAnonymous, Schema, SchemaRef, Series, StringChunked,
};
use rayon::prelude::*;

use super::filter::{Condition, Top, of_predicate};
use super::groups::{GroupAggregation, GroupQuery};
use crate::dataset::{self, label};

/// The rows of Parquet files with equal columns, one file after another.
#[derive(Clone)]
pub struct Files {
    paths: Vec<PathBuf>,
    /// Its columns and their types.
    pub schema: SchemaRef,
    /// The condition of rows; others are skipped.
    conditions: Vec<Condition>,
    /// The order of rows, if only the first are needed.
    top: Option<Top>,
}

impl Files {
    /// The table in the files of `paths`, with the columns of the first file.
    pub fn new(paths: Vec<PathBuf>) -> PolarsResult<Files> {
        let mut schema = Schema::default();
        if let Some(first) = paths.first() {
            for field in sound(first, || open(first))?.1.schema().fields() {
                schema.insert(PlSmallStr::from_str(field.name()), kind(field.data_type()));
            }
        }
        Ok(Files { paths, schema: Arc::new(schema), conditions: Vec::new(), top: None })
    }

    /// Restricts the table to rows that match `conditions`, and in each part to rows that may be among the first.
    pub fn only(mut self, conditions: Vec<Condition>, top: Option<Top>) -> Files {
        (self.conditions, self.top) = (conditions, top);
        self
    }

    /// The groups of all rows.
    pub fn groups(&self, groups: &GroupQuery) -> PolarsResult<DataFrame> {
        let mut aggregation = GroupAggregation::new(groups);
        for path in &self.paths {
            sound(path, || {
                self.batches(path, groups.columns(), &self.conditions, None, &mut |batch, kept| {
                    aggregation.add(&batch, &kept);
                    Ok(())
                })
            })?;
        }
        aggregation.frame()
    }

    /// The names of its columns of words.
    pub fn words(&self) -> Vec<String> {
        let fields = self.schema.iter().filter(|(_, kind)| kind.is_categorical());
        fields.map(|(name, _)| name.to_string()).collect()
    }

    /// The table as a lazy frame of polars.
    pub fn frame(&self) -> PolarsResult<LazyFrame> {
        let options = ScanArgsAnonymous { schema: Some(self.schema.clone()), ..ScanArgsAnonymous::default() };
        LazyFrame::anonymous_scan(Arc::new(self.clone()), options)
    }

    /// Each file as a separate table.
    pub fn parts(&self) -> Vec<Files> {
        // Without all paths in each clone.
        let none = Files { paths: Vec::new(), ..self.clone() };
        self.paths.iter().map(|path| Files { paths: vec![path.clone()], ..none.clone() }).collect()
    }

    /// The columns `names` without rows.
    fn empty(&self, names: &[PlSmallStr]) -> PolarsResult<DataFrame> {
        let kind = |name| self.schema.get(name).cloned().unwrap_or(DataType::Null);
        DataFrame::new(0, names.iter().map(|name| Column::new_empty(name.clone(), &kind(name))).collect())
    }

    /// The rows of one file that `predicate` keeps, at most the first `most` of the file.
    fn read(
        &self,
        path: &Path,
        names: &[PlSmallStr],
        predicate: Option<&Expr>,
        most: Option<usize>,
    ) -> PolarsResult<DataFrame> {
        let predicate = predicate.map(without_hints).transpose()?.flatten();
        let mut conditions = self.conditions.clone();
        conditions.extend(predicate.iter().flat_map(|predicate| of_predicate(predicate).0));
        let names_read = names.iter().map(PlSmallStr::as_str).chain(self.top.iter().map(|top| top.column.as_str()));
        // A filter drops rows, so more have to be read.
        let most = most.filter(|_| conditions.is_empty() && self.top.is_none());
        let mut frame = self.empty(names)?;
        let mut take = |batch: RecordBatch, mut kept: Vec<bool>| {
            if let Some(top) = &self.top {
                top.mark(&batch, &mut kept);
            }
            let batch = match kept.iter().all(|kept| *kept) {
                true => batch,
                false => filter_record_batch(&batch, &BooleanArray::from(kept))?,
            };
            append(&mut frame, columns(&batch, names)?).map_err(foreign)
        };
        sound(path, || self.batches(path, names_read, &conditions, most, &mut take))?;
        match predicate {
            Some(predicate) => frame.lazy().filter(predicate).collect(),
            None => Ok(frame),
        }
    }
}

/// A predicate without the dynamic bounds that polars adds for a top-k. They are optional, and an expression can only display them.
fn without_hints(predicate: &Expr) -> PolarsResult<Option<Expr>> {
    if !predicate.into_iter().any(|part| matches!(part, Expr::Display { .. })) {
        return Ok(Some(predicate.clone()));
    }
    match predicate {
        Expr::Display { .. } => Ok(None),
        Expr::BinaryExpr { left, op: Operator::And | Operator::LogicalAnd, right } => {
            let (left, right) = (without_hints(left)?, without_hints(right)?);
            Ok(match (left, right) {
                (Some(left), Some(right)) => Some(left.and(right)),
                (left, right) => left.or(right),
            })
        }
        _ => Err(PolarsError::ComputeError(format!("a condition that is not supported: {predicate}").into())),
    }
}

impl AnonymousScan for Files {
    fn as_any(&self) -> &dyn Any {
        self
    }

    fn schema(&self, _: Option<usize>) -> PolarsResult<SchemaRef> {
        Ok(self.schema.clone())
    }

    fn allows_predicate_pushdown(&self) -> bool {
        true
    }

    fn allows_projection_pushdown(&self) -> bool {
        true
    }

    fn scan(&self, options: AnonymousScanArgs) -> PolarsResult<DataFrame> {
        let names: Vec<PlSmallStr> = match &options.with_columns {
            Some(names) => names.to_vec(),
            None => self.schema.iter_names().cloned().collect(),
        };
        let predicate = options.predicate.as_ref();
        let mut rows = self.empty(&names)?;
        match (options.n_rows, predicate) {
            (Some(most), None) => {
                for path in &self.paths {
                    if rows.height() >= most {
                        break;
                    }
                    let part = self.read(path, &names, None, Some(most - rows.height()))?;
                    append(&mut rows, part)?;
                }
            }
            _ => {
                let read = |path: &PathBuf| self.read(path, &names, predicate, None);
                let parts = self.paths.par_iter().map(read).collect::<PolarsResult<Vec<DataFrame>>>()?;
                parts.into_iter().try_for_each(|part| append(&mut rows, part))?;
            }
        }
        Ok(rows.slice(0, options.n_rows.unwrap_or(usize::MAX)))
    }
}

/// Appends `more` rows.
pub fn append(rows: &mut DataFrame, more: DataFrame) -> PolarsResult<()> {
    if rows.height() == 0 && (more.height() > 0 || rows.columns().is_empty()) {
        *rows = more;
    } else if rows.columns().is_empty() {
        *rows = DataFrame::new(rows.height() + more.height(), Vec::new())?;
    } else if more.height() > 0 {
        rows.vstack_mut_owned(more)?;
    }
    Ok(())
}

/// The message for a file that cannot be read.
const UNREADABLE: &str = "cannot be read as Parquet";

fn unreadable(path: &Path, error: &ParquetError) -> PolarsError {
    PolarsError::ComputeError(format!("{}: {UNREADABLE}: {error}", path.display()).into())
}

/// The result of reading a file; a panic of the reader is a fault of the file.
fn sound<T>(path: &Path, read: impl FnOnce() -> Result<T, ParquetError>) -> PolarsResult<T> {
    dataset::sound(read).map_err(|error| unreadable(path, &error))
}

/// Whether a file is at fault, rather than the query.
pub fn is_unreadable(error: &PolarsError) -> bool {
    error.to_string().contains(UNREADABLE)
}

/// Opens a Parquet file. Words are read as dictionaries in a dataset, else as text.
fn open(path: &Path) -> Result<(File, ArrowReaderMetadata), ParquetError> {
    let file = File::open(path)?;
    let stored = ArrowReaderMetadata::load(&file, ArrowReaderOptions::new())?;
    let read = |field: &FieldRef| match field.data_type() {
        ArrowType::LargeUtf8 | ArrowType::Utf8View | ArrowType::Dictionary(..) if *field.data_type() != label() => {
            Arc::new(field.as_ref().clone().with_data_type(ArrowType::Utf8))
        }
        _ => field.clone(),
    };
    let fields: Fields = stored.schema().fields().iter().map(read).collect();
    let options = ArrowReaderOptions::new().with_schema(Arc::new(ArrowSchema::new(fields)));
    let metadata = ArrowReaderMetadata::try_new(stored.metadata().clone(), options)?;
    Ok((file, metadata))
}

impl Files {
    /// Passes the columns `names` of a file and those of `conditions` to `take`, batch by batch, with the rows that match `conditions`. Skips row
    /// groups without such rows. Reads at most the first `most` rows.
    fn batches<'a>(
        &self,
        path: &Path,
        names: impl Iterator<Item = &'a str>,
        conditions: &'a [Condition],
        most: Option<usize>,
        take: &mut dyn FnMut(RecordBatch, Vec<bool>) -> Result<(), ParquetError>,
    ) -> Result<(), ParquetError> {
        let (file, metadata) = open(path)?;
        let names: BTreeSet<&str> = names.chain(conditions.iter().map(|condition| condition.column.as_str())).collect();
        for name in &names {
            let found = metadata.schema().field_with_name(name).ok();
            let found = found.map(|field| kind(field.data_type()));
            if found.as_ref() != self.schema.get(name) {
                let found = found.map_or("is missing".to_owned(), |kind| format!("has the type {kind}"));
                return Err(ParquetError::General(format!("column `{name}` {found}, unlike in the first file")));
            }
        }
        // Statistics of other writers exclude NaN, which is the greatest number in polars.
        let is_ours = is_ours(&metadata);
        let allows = |group: &RowGroupMetaData| !is_ours || conditions.iter().all(|condition| condition.allows(group));
        let wanted: Vec<&str> = names.iter().copied().collect();
        let mask = dataset::frame::projection(metadata.parquet_schema(), &wanted);
        let groups = metadata.metadata().row_groups();
        let allowed = (0..groups.len()).filter(|&group| allows(&groups[group])).collect();
        // In parts, which have row groups of one size, a batch is a row group.
        let rows = groups.iter().filter_map(|group| usize::try_from(group.num_rows()).ok()).max().unwrap_or(0);
        let mut builder = ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata.clone())
            .with_row_groups(allowed)
            .with_projection(mask)
            .with_batch_size(rows.max(1));
        if let Some(most) = most {
            builder = builder.with_limit(most);
        }
        for batch in builder.build()? {
            let batch = batch?;
            let mut kept = vec![true; batch.num_rows()];
            conditions.iter().for_each(|condition| condition.mark(&batch, &mut kept));
            take(batch, kept)?;
        }
        Ok(())
    }
}

fn foreign(error: PolarsError) -> ParquetError {
    ParquetError::General(error.to_string())
}

/// Whether slipsweep wrote a file.
fn is_ours(metadata: &ArrowReaderMetadata) -> bool {
    let entries = metadata.metadata().file_metadata().key_value_metadata();
    entries.into_iter().flatten().any(|entry| entry.key == "slipsweep.version")
}

/// The columns `names` of a batch, in that order.
fn columns(batch: &RecordBatch, names: &[PlSmallStr]) -> Result<DataFrame, ParquetError> {
    let column = |name: &PlSmallStr| {
        let array =
            batch.column_by_name(name).ok_or_else(|| ParquetError::General(format!("it has no column `{name}`")))?;
        series(name, array.as_ref()).map(Column::from)
    };
    let columns: Result<Vec<Column>, ParquetError> = names.iter().map(column).collect();
    DataFrame::new(batch.num_rows(), columns?).map_err(foreign)
}

/// The type of a column in polars; `Null` for an unsupported type.
fn kind(kind: &ArrowType) -> DataType {
    series(&PlSmallStr::EMPTY, &new_empty_array(kind)).map_or(DataType::Null, |column| column.dtype().clone())
}

/// An array as a column of polars.
fn series(name: &PlSmallStr, array: &dyn Array) -> Result<Series, ParquetError> {
    let name = name.clone();
    Ok(match array.data_type() {
        ArrowType::Float64 => numbers::<Float64Type, polars::prelude::Float64Type>(name, array).into_series(),
        ArrowType::Float32 => numbers::<Float32Type, polars::prelude::Float32Type>(name, array).into_series(),
        ArrowType::Int8 => numbers::<Int8Type, polars::prelude::Int32Type>(name, array).into_series(),
        ArrowType::Int16 => numbers::<Int16Type, polars::prelude::Int32Type>(name, array).into_series(),
        ArrowType::Int32 => numbers::<Int32Type, polars::prelude::Int32Type>(name, array).into_series(),
        ArrowType::Int64 => numbers::<Int64Type, polars::prelude::Int64Type>(name, array).into_series(),
        ArrowType::UInt8 => numbers::<UInt8Type, polars::prelude::UInt32Type>(name, array).into_series(),
        ArrowType::UInt16 => numbers::<UInt16Type, polars::prelude::UInt32Type>(name, array).into_series(),
        ArrowType::UInt32 => numbers::<UInt32Type, polars::prelude::UInt32Type>(name, array).into_series(),
        ArrowType::UInt64 => numbers::<UInt64Type, polars::prelude::UInt64Type>(name, array).into_series(),
        ArrowType::Boolean => {
            let flags: Vec<Option<bool>> = array.as_boolean().iter().collect();
            BooleanChunked::new(name, flags).into_series()
        }
        ArrowType::Utf8 => text(name, array.as_string::<i32>().iter()),
        kind if *kind == label() => {
            let codes = array.as_dictionary::<Int32Type>();
            let known = text(PlSmallStr::EMPTY, codes.values().as_string::<i32>().iter());
            let words = known.cast(&DataType::from_categories(Categories::global())).map_err(foreign)?;
            let places = codes.keys().iter().map(|key| key.and_then(|key| u32::try_from(key).ok()));
            let places: IdxCa = places.collect();
            words.take(&places).map_err(foreign)?.with_name(name)
        }
        kind => {
            return Err(ParquetError::General(format!(
                "column `{name}` is of type {kind}, which `query` does not read"
            )));
        }
    })
}

fn numbers<A, P>(name: PlSmallStr, array: &dyn Array) -> ChunkedArray<P>
where
    A: ArrowPrimitiveType,
    P: PolarsNumericType,
    A::Native: Into<P::Native>,
{
    let array = array.as_primitive::<A>();
    match array.null_count() {
        0 => ChunkedArray::from_vec(name, array.values().iter().map(|&number| number.into()).collect()),
        _ => {
            let mut numbers: ChunkedArray<P> = array.iter().map(|number| number.map(Into::into)).collect();
            numbers.rename(name);
            numbers
        }
    }
}

fn text<'a>(name: PlSmallStr, words: impl Iterator<Item = Option<&'a str>>) -> Series {
    let mut text: StringChunked = words.collect();
    text.rename(name);
    text.into_series()
}
