//! The panels that are made of pixels, and the sheet that holds all of them.

use std::fmt;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use image::codecs::png::{self, CompressionType, PngEncoder};
use image::imageops::{self, FilterType};
use image::{ImageResult, Rgb, RgbImage};
use tetvec::{Frame, Viewport};

/// Space between panels, in pixels.
const GAP: u32 = 8;
/// Columns and rows of panels.
const GRID: (u32, u32) = (4, 2);
/// Pixels around a region that Lanczos' kernel reaches, and one more.
const MARGIN: u32 = 4;

/// All panels, on white.
pub(crate) struct Sheet {
    panel: (u32, u32),
    picture: RgbImage,
}

impl Sheet {
    /// A sheet for panels of so many pixels.
    pub(crate) fn new(panel: (u32, u32)) -> Self {
        let side = |panel: u32, count: u32| panel * count + GAP * (count - 1);
        let size = (side(panel.0, GRID.0), side(panel.1, GRID.1));
        Self { panel, picture: RgbImage::from_pixel(size.0, size.1, Rgb([255; 3])) }
    }

    /// Puts a panel in the middle of its place, counted from the upper left.
    pub(crate) fn place(&mut self, column: u32, row: u32, panel: &RgbImage) {
        let at = |index: u32, side: u32, own: u32| i64::from(index * (side + GAP) + side.saturating_sub(own) / 2);
        let (x, y) = (at(column, self.panel.0, panel.width()), at(row, self.panel.1, panel.height()));
        imageops::replace(&mut self.picture, panel, x, y);
    }

    /// Writes the sheet as PNG, as small as that gets.
    pub(crate) fn save(&self, path: &Path) -> ImageResult<()> {
        let file = BufWriter::new(File::create(path)?);
        let encoder = PngEncoder::new_with_quality(file, CompressionType::Best, png::FilterType::Adaptive);
        self.picture.write_with_encoder(encoder)
    }
}

/// A frame with each pixel drawn `scale` times as large.
pub(crate) fn enlarge(frame: &Frame, scale: u32) -> RgbImage {
    RgbImage::from_fn(frame.width() * scale, frame.height() * scale, |x, y| Rgb(frame.pixel(x / scale, y / scale)))
}

/// Absolute difference of two frames of one size, times `gain`.
pub(crate) fn difference(a: &Frame, b: &Frame, gain: u32) -> Frame {
    let mut difference = a.clone();
    for (to, from) in difference.pixels_mut().as_flattened_mut().iter_mut().zip(b.pixels().as_flattened()) {
        *to = u32::from(to.abs_diff(*from)).saturating_mul(gain).min(255) as u8;
    }
    difference
}

/// A rectangle of pixels to enlarge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Region {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{} pixels from ({}, {})", self.width, self.height, self.x, self.y)
    }
}

impl Region {
    /// A region around `middle`, or where edges are strongest, that lies within `frame`.
    pub(crate) fn new(frame: &Frame, (width, height): (u32, u32), middle: Option<(u32, u32)>) -> Self {
        let (width, height) = (width.clamp(1, frame.width()), height.clamp(1, frame.height()));
        let (x, y) = match middle {
            Some((x, y)) => {
                let place = |middle: u32, own: u32, side: u32| middle.saturating_sub(own / 2).min(side - own);
                (place(x, width, frame.width()), place(y, height, frame.height()))
            }
            None => strongest_edges(frame, (width, height)),
        };
        Self { x, y, width, height }
    }

    /// The region's size, enlarged.
    pub(crate) fn size(self, zoom: u32) -> (u32, u32) {
        (self.width * zoom, self.height * zoom)
    }

    /// The region as what a decoder is to draw.
    pub(crate) fn viewport(self) -> Viewport {
        let [x, y, width, height] = [self.x, self.y, self.width, self.height].map(f64::from);
        Viewport { x, y, width, height }
    }

    /// The region with pixels as squares.
    pub(crate) fn nearest(self, frame: &Frame, zoom: u32) -> RgbImage {
        let (width, height) = self.size(zoom);
        RgbImage::from_fn(width, height, |x, y| Rgb(frame.pixel(self.x + x / zoom, self.y + y / zoom)))
    }

    /// The region as a good scaler enlarges it.
    pub(crate) fn lanczos(self, frame: &Frame, zoom: u32) -> RgbImage {
        let (left, top) = (self.x.min(MARGIN), self.y.min(MARGIN));
        let right = (frame.width() - self.x - self.width).min(MARGIN);
        let bottom = (frame.height() - self.y - self.height).min(MARGIN);
        let around = RgbImage::from_fn(left + self.width + right, top + self.height + bottom, |x, y| {
            Rgb(frame.pixel(self.x - left + x, self.y - top + y))
        });
        let (width, height) = (around.width() * zoom, around.height() * zoom);
        let large = imageops::resize(&around, width, height, FilterType::Lanczos3);
        let (width, height) = self.size(zoom);
        imageops::crop_imm(&large, left * zoom, top * zoom, width, height).to_image()
    }
}

/// The place of a rectangle of this size with the largest sum of differences between neighbouring pixels; the first
/// one of several.
fn strongest_edges(frame: &Frame, (width, height): (u32, u32)) -> (u32, u32) {
    let (columns, rows) = (frame.width() as usize, frame.height() as usize);
    let luma = |x: usize, y: usize| frame.pixel(x as u32, y as u32).iter().map(|&v| i64::from(v)).sum::<i64>();
    // Sums over all pixels above and to the left.
    let mut sums = vec![0i64; (columns + 1) * (rows + 1)];
    let at = |x: usize, y: usize| y * (columns + 1) + x;
    for y in 0..rows {
        for x in 0..columns {
            let here = luma(x, y);
            let right = if x + 1 < columns { (luma(x + 1, y) - here).abs() } else { 0 };
            let below = if y + 1 < rows { (luma(x, y + 1) - here).abs() } else { 0 };
            sums[at(x + 1, y + 1)] = right + below + sums[at(x, y + 1)] + sums[at(x + 1, y)] - sums[at(x, y)];
        }
    }
    let (w, h) = (width as usize, height as usize);
    let sum = |x: usize, y: usize| sums[at(x + w, y + h)] - sums[at(x, y + h)] - sums[at(x + w, y)] + sums[at(x, y)];
    let places = (0..=rows - h).flat_map(|y| (0..=columns - w).map(move |x| (x, y)));
    let best = places.rev().max_by_key(|&(x, y)| sum(x, y)).unwrap_or_default();
    (best.0 as u32, best.1 as u32)
}
