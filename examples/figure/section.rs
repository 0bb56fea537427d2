//! The panel that shows the control mesh: its polygons coloured by label, their edges drawn over.

use image::{Rgb, RgbImage};
use tetvec::Viewport;
use tetvec::render::SectionPolygon;
use tetvec::video::Label;

/// Samples of a pixel, each way.
const SAMPLES: u32 = 4;
/// Half the width of an edge, in pixels: each of two neighbours draws its half.
const HALF_EDGE_PX: f64 = 0.25;
/// Brightness of an edge beside its polygon's: where edges are dense, labels can still be told apart.
const EDGE_SHADE: f32 = 0.3;

/// Draws what `viewport` shows of a cross-section.
pub(crate) fn draw_section(polygons: &[SectionPolygon], viewport: Viewport, (width, height): (u32, u32)) -> RgbImage {
    let (columns, rows) = (width * SAMPLES, height * SAMPLES);
    let scale = [f64::from(columns) / viewport.width, f64::from(rows) / viewport.height];
    let mut samples = vec![[255.0; 3]; columns as usize * rows as usize];
    for polygon in polygons {
        let corners = polygon.corners.iter();
        let corners: Vec<[f64; 2]> =
            corners.map(|c| [(c.x - viewport.x) * scale[0], (c.y - viewport.y) * scale[1]]).collect();
        paint(&corners, label_color(polygon.label), &mut samples, (columns, rows));
    }
    RgbImage::from_fn(width, height, |x, y| {
        let mut sum = [0.0; 3];
        for sub in 0..SAMPLES * SAMPLES {
            let (column, row) = (x * SAMPLES + sub % SAMPLES, y * SAMPLES + sub / SAMPLES);
            let sample = samples[row as usize * columns as usize + column as usize];
            (0..3).for_each(|channel| sum[channel] += sample[channel]);
        }
        Rgb(sum.map(|sum| (sum / (SAMPLES * SAMPLES) as f32).round() as u8))
    })
}

/// Paints a convex polygon, given in samples.
fn paint(corners: &[[f64; 2]], color: [f32; 3], samples: &mut [[f32; 3]], (columns, rows): (u32, u32)) {
    let range = |axis: usize, end: u32| {
        let low = corners.iter().map(|c| c[axis]).fold(f64::INFINITY, f64::min);
        let high = corners.iter().map(|c| c[axis]).fold(f64::NEG_INFINITY, f64::max);
        (low.floor().clamp(0.0, f64::from(end)) as u32)..(high.ceil().clamp(0.0, f64::from(end)) as u32)
    };
    for row in range(1, rows) {
        for column in range(0, columns) {
            let distance = depth(corners, [f64::from(column) + 0.5, f64::from(row) + 0.5]);
            if distance >= 0.0 {
                let edge = distance < HALF_EDGE_PX * f64::from(SAMPLES);
                let shade = if edge { EDGE_SHADE } else { 1.0 };
                samples[row as usize * columns as usize + column as usize] = color.map(|v| v * shade);
            }
        }
    }
}

/// How far inside of a convex polygon a point lies; negative outside. Either turning will do.
fn depth(corners: &[[f64; 2]], point: [f64; 2]) -> f64 {
    let next = |i: usize| corners[(i + 1) % corners.len()];
    let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let area: f64 = (0..corners.len()).map(|i| cross(corners[i], next(i))).sum();
    let distance = |i: usize| {
        let (from, to) = (corners[i], next(i));
        let edge = [to[0] - from[0], to[1] - from[1]];
        let length = edge[0].hypot(edge[1]);
        if length == 0.0 {
            // Slices through vertices have corners that coincide.
            return f64::INFINITY;
        }
        let side = cross(edge, [point[0] - from[0], point[1] - from[1]]);
        side * area.signum() / length
    };
    (0..corners.len()).map(distance).fold(f64::INFINITY, f64::min)
}

/// A light colour of its own for each label: hues a golden section apart.
fn label_color(label: Label) -> [f32; 3] {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let hue = f64::from(label.0) * GOLDEN;
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|shift| (190.0 + 55.0 * (std::f64::consts::TAU * (hue + shift)).cos()) as f32)
}
