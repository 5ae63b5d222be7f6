//! Pictures of traces and tables: a figure is set out, drawn as SVG, and written as SVG, PNG or PDF.

mod canvas;
mod coincide;
mod colour;
mod contour;
mod error;
mod export;
mod figure;
mod label;
mod page;
mod scale;
pub mod table;
pub mod trace;

pub use canvas::Stroke;
pub use colour::series;
pub use error::PlotError;
pub use export::{ExportError, Format};
pub use figure::{Axis, Dot, Drawn, Entry, Figure, Key, Layer, Marker, Panel};
pub use page::Page;
pub use scale::Scale;

/// Width of a picture in one column of a journal, in millimetres.
pub const COLUMN: f64 = 89.0;

/// Width of a picture over two columns.
pub const PAGE: f64 = 183.0;
