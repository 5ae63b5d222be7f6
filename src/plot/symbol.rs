//! Marks at points: symbols of series and rows, and a star.

use std::f64::consts::PI;

use super::canvas::{Canvas, Stroke};
use super::colour::{self, hex};

/// Radius of a symbol, in points. Chosen: twice the width of a curve on each side of it.
pub const RADIUS: f64 = 2.0;

/// Outer radius of a star, in points. Chosen: it stands out among symbols.
pub const STAR_RADIUS: f64 = 4.6;
const INNER_STAR_RADIUS: f64 = 1.9;

/// A small mark: a circle, a square, a triangle or a rhombus.
#[derive(Debug, Clone, PartialEq)]
pub struct Symbol {
    shape: usize,
    fill: String,
    stroke: Stroke,
}

impl Symbol {
    /// The mark of a point of series number `series`.
    pub fn of_series(series: usize) -> Symbol {
        let stroke = Stroke { dashes: &[], width: 0.8, ..colour::series(series) };
        Symbol { shape: series, fill: "#fff".to_owned(), stroke }
    }

    /// The mark of a row, in the colour of its value; a row without a value is a hollow circle.
    pub fn of_row(colour: Option<[u8; 3]>, shape: usize) -> Symbol {
        match colour {
            Some(colour) => Symbol { shape, fill: hex(colour), stroke: Stroke::solid("#222", 0.3) },
            None => Symbol { shape: 0, fill: "none".to_owned(), stroke: Stroke::solid("#888", 0.4) },
        }
    }

    /// Draws the symbol around a position.
    pub fn draw(&self, canvas: &mut Canvas, (x, y): (f64, f64)) {
        let r = RADIUS;
        let corners: &[(f64, f64)] = match self.shape % 4 {
            0 => return canvas.circle((x, y), r, &self.fill, &self.stroke),
            1 => &[(-r, -r), (r, -r), (r, r), (-r, r)],
            2 => &[(0.0, -r - 0.5), (r + 0.3, r), (-r - 0.3, r)],
            _ => &[(0.0, -r - 0.8), (r + 0.8, 0.0), (0.0, r + 0.8), (-r - 0.8, 0.0)],
        };
        let corners: Vec<(f64, f64)> = corners.iter().map(|(right, down)| (x + right, y + down)).collect();
        canvas.shape(&corners, &self.fill, Some(&self.stroke));
    }
}

/// Draws a star with five points.
pub fn draw_star(canvas: &mut Canvas, (x, y): (f64, f64)) {
    let corner = |i: usize| {
        let angle = PI * (i as f64 / 5.0 - 0.5);
        let radius = if i.is_multiple_of(2) { STAR_RADIUS } else { INNER_STAR_RADIUS };
        (x + radius * angle.cos(), y + radius * angle.sin())
    };
    let corners: Vec<(f64, f64)> = (0..10).map(corner).collect();
    canvas.shape(&corners, "#fff", Some(&Stroke::solid("#000", 0.8)));
}
