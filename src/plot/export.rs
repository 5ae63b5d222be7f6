//! A picture as SVG, PNG or PDF. Text in the PNG and the PDF is set in the embedded fonts: nothing depends on those of the machine.

use std::path::Path;
use std::sync::Arc;

use resvg::tiny_skia::{Color, Pixmap, PremultipliedColorU8, Transform};
use resvg::usvg::{self, fontdb};
use svg2pdf::{ConversionOptions, PageOptions};

use super::label::FONTS;

/// How a picture is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Format {
    /// Vectors and text (`.svg`).
    Svg,
    /// Pixels (`.png`).
    Png,
    /// Vectors and text, for LaTeX (`.pdf`).
    Pdf,
}

/// Why a picture cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The picture is not understood by the converter.
    #[error("cannot convert the picture: {0}\n  help: write it as .svg")]
    Convert(String),
    /// More pixels than can be held.
    #[error("a picture of {width} x {height} pixels is too large\n  help: ask for fewer with --dpi")]
    Size {
        /// Width in pixels.
        width: f64,
        /// Height in pixels.
        height: f64,
    },
}

impl Format {
    /// The format that the name of a file ends in.
    pub fn of(path: &Path) -> Option<Format> {
        match path.extension()?.to_str()?.to_lowercase().as_str() {
            "svg" => Some(Format::Svg),
            "png" => Some(Format::Png),
            "pdf" => Some(Format::Pdf),
            _ => None,
        }
    }

    /// What names of files of this format end in.
    pub fn ending(self) -> &'static str {
        match self {
            Format::Svg => "svg",
            Format::Png => "png",
            Format::Pdf => "pdf",
        }
    }

    /// The picture `svg` in this format; pixels with `dpi` to the inch.
    pub fn encode(self, svg: &str, dpi: f64) -> Result<Vec<u8>, ExportError> {
        match self {
            Format::Svg => Ok(svg.as_bytes().to_vec()),
            Format::Png => png(&tree(svg)?, dpi),
            Format::Pdf => {
                let page = PageOptions { dpi: 96.0 };
                svg2pdf::to_pdf(&tree(svg)?, ConversionOptions::default(), page)
                    .map_err(|error| ExportError::Convert(error.to_string()))
            }
        }
    }
}

fn tree(svg: &str) -> Result<usvg::Tree, ExportError> {
    let mut fonts = fontdb::Database::new();
    for font in FONTS {
        fonts.load_font_data(font.to_vec());
    }
    fonts.set_sans_serif_family("Arimo");
    let options =
        usvg::Options { font_family: "Arimo".to_owned(), fontdb: Arc::new(fonts), ..usvg::Options::default() };
    usvg::Tree::from_str(svg, &options).map_err(|error| ExportError::Convert(error.to_string()))
}

/// Most pixels of a picture, 64 million.
const MOST_PIXELS: f64 = 6.4e7;

fn png(tree: &usvg::Tree, dpi: f64) -> Result<Vec<u8>, ExportError> {
    // A CSS pixel is a 96th of an inch.
    let scale = dpi / 96.0;
    let (width, height) =
        ((f64::from(tree.size().width()) * scale).ceil(), (f64::from(tree.size().height()) * scale).ceil());
    let size = ExportError::Size { width, height };
    if !(width >= 1.0 && height >= 1.0 && width * height <= MOST_PIXELS) {
        return Err(size);
    }
    let mut pixels = Pixmap::new(width as u32, height as u32).ok_or(size)?;
    pixels.fill(Color::WHITE);
    resvg::render(tree, Transform::from_scale(scale as f32, scale as f32), &mut pixels.as_mut());
    pixels.encode_png().map_err(|error| ExportError::Convert(error.to_string()))
}

/// Pixels as a PNG, row after row from the top: a colour, or nothing where it is transparent. `None` without pixels.
pub fn image(columns: usize, pixels: &[Option<[u8; 3]>]) -> Option<Vec<u8>> {
    let rows = pixels.len().checked_div(columns)?;
    let mut image = Pixmap::new(u32::try_from(columns).ok()?, u32::try_from(rows).ok()?)?;
    for (pixel, colour) in image.pixels_mut().iter_mut().zip(pixels) {
        if let Some([red, green, blue]) = *colour {
            *pixel = PremultipliedColorU8::from_rgba(red, green, blue, 255)?;
        }
    }
    image.encode_png().ok()
}
