//! Colours for colour-blind readers and for greyscale print: a map for numbers, and styles for series.

use super::canvas::Stroke;

/// The colour map viridis by S. van der Walt and N. Smith (released into the public domain, CC0), every eighth of its 256 colours and the
/// last; its lightness grows evenly, so that it also reads in grey.
#[rustfmt::skip]
const VIRIDIS: [[u8; 3]; 33] = [
    [68, 1, 84], [71, 13, 96], [72, 24, 106], [72, 35, 116], [71, 45, 123], [69, 55, 129], [66, 64, 134], [62, 73, 137],
    [59, 82, 139], [55, 91, 141], [51, 99, 141], [47, 107, 142], [44, 114, 142], [41, 122, 142], [38, 130, 142], [35, 137, 142],
    [33, 145, 140], [31, 152, 139], [31, 160, 136], [34, 167, 133], [40, 174, 128], [50, 182, 122], [63, 188, 115], [78, 195, 107],
    [94, 201, 98], [112, 207, 87], [132, 212, 75], [152, 216, 62], [173, 220, 48], [194, 223, 35], [216, 226, 25], [236, 229, 27],
    [253, 231, 37],
];

/// The colour of a fraction from 0 (dark) to 1 (light).
pub fn viridis(fraction: f64) -> [u8; 3] {
    let last = VIRIDIS.len() - 1;
    let place = (if fraction.is_nan() { 0.0 } else { fraction.clamp(0.0, 1.0) }) * last as f64;
    let left = (place as usize).min(last - 1);
    let rest = place - left as f64;
    std::array::from_fn(|i| {
        let (from, to) = (f64::from(VIRIDIS[left][i]), f64::from(VIRIDIS[left + 1][i]));
        (from + rest * (to - from)).round() as u8
    })
}

/// A colour in SVG notation.
pub fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Colours of series (M. Okabe and K. Ito, "Color universal design", 2008), the darkest first.
const SERIES: [&str; 7] = ["#000000", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"];

/// Dashes of series, so that lines also differ without colours.
const DASHES: [&[f64]; 7] =
    [&[], &[5.0, 1.8], &[1.2, 1.4], &[6.0, 1.5, 1.2, 1.5], &[2.6, 1.4], &[8.0, 2.0], &[6.0, 1.4, 1.2, 1.4, 1.2, 1.4]];

/// Greatest number of series of a panel, each with its own colour and dash.
pub const MAX_SERIES: usize = SERIES.len();

/// The line of series number `place`.
pub fn series(place: usize) -> Stroke {
    Stroke { colour: SERIES[place % SERIES.len()], width: 1.1, dashes: DASHES[place % DASHES.len()] }
}

/// Fills of classes. Chosen: as many as strategies of an optimum, none of the same grey as its neighbours.
pub const CLASSES: [[u8; 3]; 7] = [
    [0xd7, 0xe8, 0xf5],
    [0x2a, 0x5f, 0x9e],
    [0xf2, 0xc4, 0x5a],
    [0x8c, 0x2d, 0x19],
    [0x66, 0x66, 0x66],
    [0x9f, 0xc9, 0xa0],
    [0xc0, 0x8f, 0xc4],
];

/// The fill of class number `place`, from light to dark, so that classes differ in grey.
pub fn class(place: usize) -> [u8; 3] {
    CLASSES[place % CLASSES.len()]
}
