//! A picture as SVG, PNG or PDF. PNG and PDF use the embedded fonts, so that they do not depend on the fonts of the machine.

use std::path::Path;
use std::sync::Arc;

use resvg::tiny_skia::{Color, Pixmap, PremultipliedColorU8, Transform};
use resvg::usvg::{self, fontdb};
use svg2pdf::{ConversionOptions, PageOptions};

use super::error::PlotError;
use super::label::FONTS;

/// The format of a picture.
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

/// Greatest number of pixels of a picture: 64 million. Chosen: they take 256 MB.
const MAX_PIXELS: f64 = 6.4e7;

/// CSS pixels per inch, the unit of lengths in an SVG (CSS Values and Units, section 6.2).
const CSS_DPI: f64 = 96.0;

impl Format {
    /// The format of a file name, by its ending.
    pub fn of(path: &Path) -> Option<Format> {
        let ending = path.extension()?.to_str()?.to_lowercase();
        [Format::Svg, Format::Png, Format::Pdf].into_iter().find(|format| format.ending() == ending)
    }

    /// The file ending.
    pub fn ending(self) -> &'static str {
        match self {
            Format::Svg => "svg",
            Format::Png => "png",
            Format::Pdf => "pdf",
        }
    }

    /// The picture `svg` in this format; pixels with `dpi` per inch.
    ///
    /// # Errors
    ///
    /// A picture that is too large for the format.
    pub fn encode(self, svg: &str, dpi: f64) -> Result<Vec<u8>, PlotError> {
        match self {
            Format::Svg => Ok(svg.as_bytes().to_vec()),
            Format::Png => png(&tree(svg)?, dpi),
            Format::Pdf => {
                let page = PageOptions { dpi: CSS_DPI as f32 };
                let pdf = svg2pdf::to_pdf(&tree(svg)?, ConversionOptions::default(), page);
                pdf.map_err(unconvertible)
            }
        }
    }
}

fn unconvertible(error: impl std::fmt::Display) -> PlotError {
    PlotError::Refused(format!("cannot convert the picture: {error}\n  help: write it as .svg"))
}

fn tree(svg: &str) -> Result<usvg::Tree, PlotError> {
    let mut fonts = fontdb::Database::new();
    for font in FONTS {
        fonts.load_font_data(font.to_vec());
    }
    let options = usvg::Options { fontdb: Arc::new(fonts), ..usvg::Options::default() };
    usvg::Tree::from_str(svg, &options).map_err(unconvertible)
}

fn png(tree: &usvg::Tree, dpi: f64) -> Result<Vec<u8>, PlotError> {
    let scale = dpi / CSS_DPI;
    let (width, height) =
        ((f64::from(tree.size().width()) * scale).ceil(), (f64::from(tree.size().height()) * scale).ceil());
    let what = format!("a picture of {width} x {height} pixels is too large\n  help: lower --dpi");
    let size = PlotError::Refused(what);
    if !(width >= 1.0 && height >= 1.0 && width * height <= MAX_PIXELS) {
        return Err(size);
    }
    let mut pixels = Pixmap::new(width as u32, height as u32).ok_or(size)?;
    pixels.fill(Color::WHITE);
    resvg::render(tree, Transform::from_scale(scale as f32, scale as f32), &mut pixels.as_mut());
    pixels.encode_png().map_err(unconvertible)
}

/// Pixels as a PNG, row by row from the top: a colour, or `None` for transparent. `None` without pixels.
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
