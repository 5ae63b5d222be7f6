//! Reading of possibly damaged Parquet files.
//!
//! The reader of the `parquet` crate compares stated lengths with the bytes that are left, and pages with their checksums. Some damage makes it
//! panic, which is reported as damage of the file. `sweep::points` limits the bytes and rows of a file of points.

use std::cell::Cell;
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use arrow_schema::{DataType, FieldRef, Fields, Schema};
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
use parquet::errors::{ParquetError, Result};

use super::layout::label;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic of this thread is converted to an error of a file, and therefore not printed.
#[cfg(feature = "cli")]
pub fn is_guarded() -> bool {
    GUARDED.get()
}

/// The result of `read`; `None` if it panics.
pub fn guarded<T>(read: impl FnOnce() -> T) -> Option<T> {
    GUARDED.set(true);
    // The state left by a panic is dropped.
    let done = catch_unwind(AssertUnwindSafe(read));
    GUARDED.set(false);
    done.ok()
}

/// The result of `read`; an error if it panics.
///
/// # Errors
///
/// Damage of the file that it reads.
pub fn sound<T>(read: impl FnOnce() -> Result<T>) -> Result<T> {
    guarded(read).unwrap_or_else(|| Err(ParquetError::General("it is damaged".to_owned())))
}

/// The metadata of a Parquet file. Words are read as codes, from any writer.
///
/// Type hints of Arrow or pandas are ignored: the type of a column is that of Parquet.
pub fn coded(file: &File) -> Result<ArrowReaderMetadata> {
    let plain = ArrowReaderMetadata::load(file, ArrowReaderOptions::new().with_skip_arrow_metadata(true))?;
    let coded = |field: &FieldRef| match field.data_type() {
        DataType::Utf8 => Arc::new(field.as_ref().clone().with_data_type(label())),
        _ => field.clone(),
    };
    let schema: Fields = plain.schema().fields().iter().map(coded).collect();
    let options = ArrowReaderOptions::new().with_schema(Arc::new(Schema::new(schema)));
    ArrowReaderMetadata::try_new(plain.metadata().clone(), options)
}
