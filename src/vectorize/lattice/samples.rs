//! What the frames hold at the lines of a layer, and smoothed versions of it for coarser tets.
//!
//! In: planes and three axes. Out: a pyramid of colours, whose level n has every 2^n-th line, and the labels.
//! A vertex that stands for many pixels must not take the noise of one of them for their colour.

use glam::Vec3;

use super::axis::{Axis, CELL};
use crate::vectorize::parallel::for_each;
use crate::video::Frame;

/// Levels of the pyramid: steps of 1, 2, 4, ... up to [`CELL`].
pub(super) const LEVELS: usize = CELL.trailing_zeros() as usize + 1;

/// Colours on a grid, x fastest, t slowest.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    size: [usize; 3],
    colors: Vec<[u8; 3]>,
}

impl Grid {
    /// The frames at the lines of the axes.
    fn sample(axes: &[Axis; 3], frames: &[std::sync::Arc<Frame>]) -> Self {
        let size = axes.each_ref().map(|axis| axis.steps() + 1);
        let [columns, rows, planes] = axes.each_ref().map(Axis::lines);
        let mut colors = vec![[0; 3]; size[0] * size[1] * size[2]];
        for_each(colors.chunks_mut(size[0]).enumerate().collect(), |(n, out): (usize, &mut [[u8; 3]])| {
            let (row, plane) = (&rows[n % rows.len()], &planes[n / rows.len()]);
            let source = |plane: usize, row: usize| frames[plane].row(row as u32);
            let quad = [
                source(plane.low, row.low),
                source(plane.low, row.high),
                source(plane.high, row.low),
                source(plane.high, row.high),
            ];
            let is_exact = row.low == row.high && plane.low == plane.high;
            for (line, color) in columns.iter().zip(out) {
                if is_exact && line.low == line.high {
                    *color = quad[0][line.low];
                    continue;
                }
                let along = |row: &[[u8; 3]]| {
                    let [a, b] = [line.low, line.high].map(|x| Vec3::from_array(row[x].map(f32::from)));
                    a.lerp(b, line.share)
                };
                let [a, b, c, d] = quad.map(along);
                let value = a.lerp(b, row.share).lerp(c.lerp(d, row.share), plane.share);
                *color = value.to_array().map(|channel| (channel + 0.5) as u8);
            }
        });
        Self { size, colors }
    }

    /// Every second line, smoothed by (1, 2, 1) / 4 along each axis.
    fn halved(&self) -> Self {
        let size = self.size.map(|n| n / 2 + 1);
        let mut colors = vec![[0; 3]; size[0] * size[1] * size[2]];
        let around = |n: usize, axis: usize| [(2 * n).saturating_sub(1), 2 * n, (2 * n + 1).min(self.size[axis] - 1)];
        for_each(colors.chunks_mut(size[0]).enumerate().collect(), |(n, out): (usize, &mut [[u8; 3]])| {
            let (ys, zs) = (around(n % size[1], 1), around(n / size[1], 2));
            for (x, color) in out.iter_mut().enumerate() {
                let xs = around(x, 0);
                let mut sum = [32u32; 3];
                for (k, z) in zs.into_iter().enumerate() {
                    for (j, y) in ys.into_iter().enumerate() {
                        let row = (z * self.size[1] + y) * self.size[0];
                        let weight = (1 + (k & 1) as u32) * (1 + (j & 1) as u32);
                        let [a, b, c] = xs.map(|x| self.colors[row + x]);
                        for channel in 0..3 {
                            let along = u32::from(a[channel]) + 2 * u32::from(b[channel]) + u32::from(c[channel]);
                            sum[channel] += weight * along;
                        }
                    }
                }
                *color = sum.map(|s| (s / 64) as u8);
            }
        });
        Self { size, colors }
    }

    /// The colour at a grid point.
    #[inline]
    pub(super) fn at(&self, [x, y, z]: [usize; 3]) -> [u8; 3] {
        self.colors[(z * self.size[1] + y) * self.size[0] + x]
    }
}

/// The pyramid of a layer.
pub(super) fn pyramid(axes: &[Axis; 3], frames: &[std::sync::Arc<Frame>]) -> [Grid; LEVELS] {
    let finest = Grid::sample(axes, frames);
    let half = finest.halved();
    let quarter = half.halved();
    let eighth = quarter.halved();
    [finest, half, quarter, eighth]
}
