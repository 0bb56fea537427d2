//! Colours of labels where no other label shows through.
//!
//! In: a frame and its labels. Out: a frame of what each label would look like alone. Inside of a label that is the frame
//! itself, at its rim what is inside nearby. A thin label has no inside: what its pixels are blends of, if another label
//! has that colour (drawings have few), else its purest pixel.

use std::collections::BTreeMap;

use glam::Vec3;

use super::{Frame, Label, LabelPlane};

/// How far pixels inside of a label are looked for.
const REACH: u32 = 3;
/// How far the purest pixel of a thin label is looked for.
const THIN_REACH: u32 = 10;
/// Fewest pixels inside of a label whose colour others may have.
const LEAST_INSIDE: u32 = 12;
/// Largest error of a thin label's pixels as blends, mean squared levels summed over the channels: 8 a channel.
const MOST_ERROR: f32 = 3.0 * 64.0;
/// Least part of a pixel that a thin label has.
const LEAST_PART: f32 = 0.1;

/// For every pixel the colour that its label has there.
pub(super) fn pure_colors(frame: &Frame, labels: &LabelPlane) -> Frame {
    let view = View::new(frame, labels);
    let mut thin: BTreeMap<Label, Vec<(usize, Vec3)>> = BTreeMap::new();
    let mut colors: Vec<[u8; 3]> = (0..view.inside.len())
        .map(|p| {
            if view.inside[p] {
                return frame.pixels()[p];
            }
            match view.near(p) {
                Near { own: Some(own), .. } => rounded(own),
                Near { other: Some(other), .. } => {
                    thin.entry(labels.labels()[p]).or_default().push((p, other));
                    frame.pixels()[p]
                }
                _ => frame.pixels()[p],
            }
        })
        .collect();
    let palette = view.palette();
    for pixels in thin.values() {
        let color = view.blended(pixels, &palette);
        for &(p, other) in pixels {
            colors[p] = color.unwrap_or_else(|| view.purest(p, other));
        }
    }
    let mut pure = frame.clone();
    pure.pixels_mut().copy_from_slice(&colors);
    pure
}

/// A frame, its labels, and which pixels have only pixels of their own label at their sides.
struct View<'a> {
    frame: &'a Frame,
    labels: &'a LabelPlane,
    inside: Vec<bool>,
}

/// Mean colours near a pixel, inside of its own label and of others.
struct Near {
    own: Option<Vec3>,
    other: Option<Vec3>,
}

impl<'a> View<'a> {
    fn new(frame: &'a Frame, labels: &'a LabelPlane) -> Self {
        let (width, all) = (frame.width() as usize, labels.labels());
        let is_inside = |p: usize| {
            let x = p % width;
            let same = |q: usize| all.get(q).is_none_or(|label| *label == all[p]);
            (x == 0 || same(p - 1))
                && (x + 1 == width || same(p + 1))
                && (p < width || same(p - width))
                && same(p + width)
        };
        Self { frame, labels, inside: (0..all.len()).map(is_inside).collect() }
    }

    fn color(&self, p: usize) -> Vec3 {
        Vec3::from_array(self.frame.pixels()[p].map(f32::from))
    }

    /// The pixels around `p` within `reach`, with their squared distances, `p` included.
    fn around(&self, p: usize, reach: u32) -> impl Iterator<Item = (usize, u32)> {
        let (width, height) = (self.frame.width(), self.frame.height());
        let (x, y) = (p as u32 % width, p as u32 / width);
        let rows = y.saturating_sub(reach)..=(y + reach).min(height - 1);
        rows.flat_map(move |v| {
            let columns = x.saturating_sub(reach)..=(x + reach).min(width - 1);
            columns.map(move |u| ((v * width + u) as usize, u.abs_diff(x).pow(2) + v.abs_diff(y).pow(2)))
        })
    }

    fn near(&self, p: usize) -> Near {
        let all = self.labels.labels();
        let mut sums = [(Vec3::ZERO, 0.0); 2];
        for (q, squared) in self.around(p, REACH).filter(|(q, _)| self.inside[*q]) {
            let weight = 1.0 / squared.pow(2) as f32;
            let (sum, total) = &mut sums[usize::from(all[q] != all[p])];
            *sum += self.color(q) * weight;
            *total += weight;
        }
        let [own, other] = sums.map(|(sum, total)| (total > 0.0).then(|| sum / total));
        Near { own, other }
    }

    /// The mean colours inside of labels.
    fn palette(&self) -> Vec<Vec3> {
        let mut sums: BTreeMap<Label, (Vec3, u32)> = BTreeMap::new();
        for p in (0..self.inside.len()).filter(|&p| self.inside[p]) {
            let (sum, count) = sums.entry(self.labels.labels()[p]).or_default();
            *sum += self.color(p);
            *count += 1;
        }
        sums.into_values().filter(|(_, count)| *count >= LEAST_INSIDE).map(|(sum, n)| sum / n as f32).collect()
    }

    /// The colour of the palette that all of these pixels, each with what is beside it, are best explained as blends with.
    fn blended(&self, pixels: &[(usize, Vec3)], palette: &[Vec3]) -> Option<[u8; 3]> {
        let error = |color: Vec3| {
            let of_pixel = |&(p, other): &(usize, Vec3)| {
                let (here, jump) = (self.color(p), color - other);
                let part = (here - other).dot(jump) / jump.length_squared().max(1.0);
                here.distance_squared(other + jump * part.clamp(LEAST_PART, 1.0))
            };
            pixels.iter().map(of_pixel).sum::<f32>() / pixels.len() as f32
        };
        let best = palette.iter().map(|&color| (error(color), color)).min_by(|a, b| a.0.total_cmp(&b.0))?;
        (best.0 <= MOST_ERROR).then(|| rounded(best.1))
    }

    /// The pixel of the same label nearby that is least like what is beside it.
    fn purest(&self, p: usize, other: Vec3) -> [u8; 3] {
        let all = self.labels.labels();
        let same = self.around(p, THIN_REACH).map(|(q, _)| q).filter(|&q| all[q] == all[p]);
        let purest = same.max_by(|&a, &b| {
            let far = |q: usize| self.color(q).distance_squared(other);
            far(a).total_cmp(&far(b))
        });
        self.frame.pixels()[purest.unwrap_or(p)]
    }
}

fn rounded(color: Vec3) -> [u8; 3] {
    color.to_array().map(|channel| (channel + 0.5) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A column of light at x = 4, of which `part` covers its pixels, on dark; a block of light at the right.
    fn pure(part: f32, block: bool) -> Frame {
        let is_light = |x: u32| x == 4 || (block && x > 12);
        let level = |x: u32| if x == 4 { (20.0 + 200.0 * part) as u8 } else { [20, 220][usize::from(is_light(x))] };
        let frame = Frame::from_fn(20, 12, |x, _| [level(x); 3]).expect("size");
        let labels = (0..240).map(|n| Label(if n % 20 == 4 { 1 } else { 2 * u32::from(is_light(n % 20)) }));
        pure_colors(&frame, &LabelPlane::new(20, 12, labels.collect()))
    }

    #[test]
    fn thin_labels_take_a_colour_that_is_pure_elsewhere() {
        assert!(pure(0.5, true).pixel(4, 5)[0].abs_diff(220) < 3);
        assert_eq!(pure(0.5, false).pixel(4, 5), [120; 3], "nothing is known of it");
    }

    #[test]
    fn rims_are_as_the_inside() {
        let frame =
            Frame::from_fn(16, 8, |x, _| [[10, 90, 200][usize::from(x > 6) + usize::from(x > 7)]; 3]).expect("size");
        let labels = (0..128).map(|n| Label(u32::from(n % 16 > 6))).collect();
        let pure = pure_colors(&frame, &LabelPlane::new(16, 8, labels));
        assert_eq!([pure.pixel(6, 4), pure.pixel(7, 4), pure.pixel(8, 4)], [[10; 3], [200; 3], [200; 3]]);
    }
}
