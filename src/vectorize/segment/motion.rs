//! Motion between two pictures by hierarchical block matching.
//!
//! In: the brightness pyramids of two pictures. Out: a vector for each block of the first. Forbidden here: labels.
//!
//! From the smallest level down, each block takes the best of few candidates (its parents' vectors, its neighbours',
//! none at all) and walks downhill from there (predictive search as in de Haan et al., "True-motion estimation with
//! 3-D recursive search block matching", 1993). A price on differing from the prediction keeps flat blocks along.

use super::pyramid::Gray;

/// A displacement in pixels, (x, y).
pub(super) type Vector = [i32; 2];

/// Side of a block in pixels of its level.
pub(super) const BLOCK: usize = 8;
/// The match looks this far around a block, in pixels: 12x12 pixels a block.
const MARGIN: isize = 2;
/// How far the smallest level is searched, in pixels of that level.
const REACH: i32 = 12;
/// Steps of the walk downhill at the other levels.
const STEPS: u32 = 3;
/// Price of a pixel of difference from the predicted vector, in levels summed over the 144 pixels of a match.
const SMOOTHNESS: u32 = 24;

/// One vector a block, row by row: block content at p in the first picture is found at p + vector in the second.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MotionField {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) vectors: Vec<Vector>,
}

impl MotionField {
    /// Matches `from` to `to`, pyramids of pictures of one size, full size first.
    pub(super) fn estimate(from: &[Gray], to: &[Gray]) -> Self {
        let mut coarser: Option<Self> = None;
        for (a, b) in from.iter().zip(to).rev() {
            coarser = Some(match_level(a, b, coarser.as_ref()));
        }
        coarser.unwrap_or(Self { columns: 0, rows: 0, vectors: Vec::new() })
    }

    /// The vector of the block (column, row), the nearest one where that is outside.
    pub(super) fn clamped(&self, column: isize, row: isize) -> Vector {
        let column = column.clamp(0, self.columns as isize - 1) as usize;
        let row = row.clamp(0, self.rows as isize - 1) as usize;
        self.vectors[row * self.columns + column]
    }
}

fn match_level(from: &Gray, to: &Gray, coarser: Option<&MotionField>) -> MotionField {
    let (columns, rows) = (from.width.div_ceil(BLOCK), from.height.div_ceil(BLOCK));
    let mut field = MotionField { columns, rows, vectors: vec![[0, 0]; columns * rows] };
    for row in 0..rows {
        for column in 0..columns {
            let block = Block { from, to, x: (column * BLOCK) as isize, y: (row * BLOCK) as isize };
            let vector = match coarser {
                None => block.search_all(),
                Some(coarser) => block.search_near(&candidates(coarser, &field, column, row)),
            };
            field.vectors[row * columns + column] = vector;
        }
    }
    field
}

/// Prediction first: the parent's vector; then its neighbours', the left and upper neighbours' of this level, and none.
fn candidates(coarser: &MotionField, field: &MotionField, column: usize, row: usize) -> [Vector; 8] {
    let parent = |dx: isize, dy: isize| {
        coarser.clamped(column as isize / 2 + dx, row as isize / 2 + dy).map(|component| 2 * component)
    };
    let left = if column > 0 { field.vectors[row * field.columns + column - 1] } else { [0, 0] };
    let above = if row > 0 { field.vectors[(row - 1) * field.columns + column] } else { [0, 0] };
    [parent(0, 0), parent(-1, 0), parent(1, 0), parent(0, -1), parent(0, 1), left, above, [0, 0]]
}

struct Block<'a> {
    from: &'a Gray,
    to: &'a Gray,
    x: isize,
    y: isize,
}

impl Block<'_> {
    fn search_all(&self) -> Vector {
        let all = (-REACH..=REACH).flat_map(|dy| (-REACH..=REACH).map(move |dx| [dx, dy]));
        let best = all.map(|v| (self.cost(v, [0, 0]), v[0].abs() + v[1].abs(), v)).min();
        best.map_or([0, 0], |(_, _, v)| v)
    }

    fn search_near(&self, candidates: &[Vector]) -> Vector {
        let prediction = candidates.first().copied().unwrap_or([0, 0]);
        let mut best = (self.cost(prediction, prediction), prediction);
        for (i, &v) in candidates.iter().enumerate().skip(1) {
            if !candidates[..i].contains(&v) {
                best = best.min((self.cost(v, prediction), v));
            }
        }
        for _ in 0..STEPS {
            let [x, y] = best.1;
            let around = [[x - 1, y], [x + 1, y], [x, y - 1], [x, y + 1]];
            let next = around.iter().map(|&v| (self.cost(v, prediction), v)).min().unwrap_or(best);
            if next.0 >= best.0 {
                break;
            }
            best = next;
        }
        best.1
    }

    fn cost(&self, v: Vector, prediction: Vector) -> u32 {
        let bend = v[0].abs_diff(prediction[0]) + v[1].abs_diff(prediction[1]);
        self.difference(v) + SMOOTHNESS * bend
    }

    /// Sum of absolute differences over the block and its margin.
    fn difference(&self, v: Vector) -> u32 {
        let side = BLOCK as isize + 2 * MARGIN;
        let (x0, y0) = (self.x - MARGIN, self.y - MARGIN);
        let (u0, v0) = (x0 + v[0] as isize, y0 + v[1] as isize);
        let inside = |x: isize, y: isize| {
            x >= 0 && y >= 0 && x + side <= self.from.width as isize && y + side <= self.from.height as isize
        };
        if !inside(x0, y0) || !inside(u0, v0) {
            return self.difference_clamped([x0, y0], [u0, v0], side);
        }
        let row = |gray: &Gray, x: isize, y: isize| y as usize * gray.width + x as usize;
        (0..side)
            .map(|dy| {
                let a = &self.from.pixels[row(self.from, x0, y0 + dy)..][..side as usize];
                let b = &self.to.pixels[row(self.to, u0, v0 + dy)..][..side as usize];
                a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b))).sum::<u32>()
            })
            .sum()
    }

    /// The same where that reaches beyond a picture, whose last row and column stand for all further ones.
    fn difference_clamped(&self, from: [isize; 2], to: [isize; 2], side: isize) -> u32 {
        let columns = |x: isize| (x..x + side).map(|x| x.clamp(0, self.from.width as isize - 1) as usize);
        let row = |gray: &'_ Gray, y: isize| y.clamp(0, gray.height as isize - 1) as usize * gray.width;
        let difference = |dy: isize| {
            let a = &self.from.pixels[row(self.from, from[1] + dy)..][..self.from.width];
            let b = &self.to.pixels[row(self.to, to[1] + dy)..][..self.to.width];
            columns(from[0]).zip(columns(to[0])).map(|(x, u)| u32::from(a[x].abs_diff(b[u]))).sum::<u32>()
        };
        (0..side).map(difference).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::{BLOCK, MotionField};
    use crate::vectorize::segment::pyramid::pyramid;
    use crate::video::Frame;

    /// A smooth texture that repeats nowhere in the picture.
    fn texture(x: f64, y: f64) -> u8 {
        let v = (x * 0.11).sin() + (y * 0.13 + 1.0).sin() + (x * 0.031 - y * 0.047).cos() + (x * y * 0.0007).sin();
        (128.0 + 30.0 * v) as u8
    }

    fn frame(shift: [f64; 2]) -> Frame {
        Frame::from_fn(200, 160, |x, y| [texture(f64::from(x) - shift[0], f64::from(y) - shift[1]); 3]).expect("size")
    }

    #[test]
    fn finds_small_and_large_shifts() {
        for shift in [[0, 0], [1, 0], [-3, 2], [17, -9], [-30, 24]] {
            let field = MotionField::estimate(&pyramid(&frame([0.0, 0.0])), &pyramid(&frame(shift.map(f64::from))));
            // Blocks whose content leaves the picture have no answer.
            let inner = |i: usize, far: i32, side: usize| {
                let p = (i * BLOCK) as i32;
                (8..side as i32 - 16).contains(&(p + far)) && (8..side as i32 - 16).contains(&p)
            };
            let blocks = (0..field.rows).flat_map(|r| (0..field.columns).map(move |c| (c, r)));
            let (mut right, mut all) = (0, 0);
            for (c, r) in blocks.filter(|&(c, r)| inner(c, shift[0], 200) && inner(r, shift[1], 160)) {
                all += 1;
                right += u32::from(field.vectors[r * field.columns + c] == shift);
            }
            assert!(all > 100 && right * 10 >= all * 9, "{shift:?}: {right} of {all}");
        }
    }
}
