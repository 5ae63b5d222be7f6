//! Pictures of traces and tables: a figure is laid out, drawn as SVG, and written as SVG, PNG or PDF.

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
mod symbol;
pub mod table;
pub mod trace;

pub use canvas::Stroke;
pub use colour::series;
pub use error::PlotError;
pub use export::Format;
pub use figure::{Axis, Entry, Figure, Key, Layer, Panel, SvgFigure};
pub use label::missing_letters;
pub use page::Page;
pub use scale::Scale;
pub use symbol::Symbol;

/// Width of a picture in one column, in millimetres, as in Nature's journals.
pub const COLUMN: f64 = 89.0;

/// Width of a picture over two columns, in millimetres, as in Nature's journals.
pub const PAGE: f64 = 183.0;
