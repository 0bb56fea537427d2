//! Pixel neighbourhoods of a picture stored row by row.
//!
//! In: a size. Out: indices of neighbours, and which pixels may change sides without tearing a region. Forbidden here:
//! colours and labels of any kind.

/// Size of a picture in pixels; both sides are at least 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
}

/// Stands for a neighbour outside the picture in [`Raster::ring`].
pub(super) const OUTSIDE: usize = usize::MAX;

impl Raster {
    pub(super) fn new(width: u32, height: u32) -> Self {
        Self { width: width as usize, height: height as usize }
    }

    /// Number of pixels.
    pub(super) fn len(self) -> usize {
        self.width * self.height
    }

    /// Column and row of pixel `p`.
    pub(super) fn xy(self, p: usize) -> (usize, usize) {
        (p % self.width, p / self.width)
    }

    /// The pixel at column `x`, row `y`; none outside the picture.
    pub(super) fn index(self, x: i64, y: i64) -> Option<usize> {
        let inside = (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y);
        inside.then(|| y as usize * self.width + x as usize)
    }

    /// The pixels that share a side with `p`: above, left, right, below.
    pub(super) fn sides(self, p: usize) -> impl Iterator<Item = usize> {
        let (x, y) = self.xy(p);
        [
            (y > 0).then(|| p - self.width),
            (x > 0).then(|| p - 1),
            (x + 1 < self.width).then_some(p + 1),
            (y + 1 < self.height).then_some(p + self.width),
        ]
        .into_iter()
        .flatten()
    }

    /// The eight pixels around `p`, clockwise from the one above; [`OUTSIDE`] where there is none.
    pub(super) fn ring(self, p: usize) -> [usize; 8] {
        let w = self.width;
        let (x, y) = self.xy(p);
        if x > 0 && y > 0 && x + 1 < w && y + 1 < self.height {
            return [p - w, p - w + 1, p + 1, p + w + 1, p + w, p + w - 1, p - 1, p - w - 1];
        }
        const STEPS: [(isize, isize); 8] = [(0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1)];
        STEPS.map(|(dx, dy)| match (x.checked_add_signed(dx), y.checked_add_signed(dy)) {
            (Some(nx), Some(ny)) if nx < w && ny < self.height => ny * w + nx,
            _ => OUTSIDE,
        })
    }

    /// Pairs of pixels that share a side, each once: (left, right) and (upper, lower), in row order.
    pub(super) fn side_pairs(self) -> impl Iterator<Item = (usize, usize)> {
        (0..self.height).flat_map(move |y| {
            (0..self.width).flat_map(move |x| {
                let p = y * self.width + x;
                let right = (x + 1 < self.width).then_some((p, p + 1));
                let below = (y + 1 < self.height).then_some((p, p + self.width));
                right.into_iter().chain(below)
            })
        })
    }
}

/// Columns and rows of a grid of about `count` cells on the picture, at most one cell a pixel.
pub(super) fn grid(raster: Raster, count: u32) -> (usize, usize) {
    let aspect = raster.width as f64 / raster.height as f64;
    let columns = (f64::from(count) * aspect).sqrt().round().clamp(1.0, raster.width as f64);
    let rows = (f64::from(count) / columns).round().clamp(1.0, raster.height as f64);
    (columns as usize, rows as usize)
}

/// Whether a pixel may leave its region without disconnecting it, by which ring pixels (bit i: ring pixel i) belong to
/// the region: those that share a side with it must hang together through the ring (simple points of digital topology,
/// Kong and Rosenfeld 1989, for 4-connected regions). A pixel alone in its region may not leave.
#[derive(Debug, Clone)]
pub(super) struct SimplePoints([bool; 256]);

impl SimplePoints {
    pub(super) fn new() -> Self {
        let mut simple = [false; 256];
        for (mask, entry) in simple.iter_mut().enumerate() {
            *entry = arcs_with_a_side(mask as u8) == 1;
        }
        Self(simple)
    }

    pub(super) fn may_leave(&self, mask: u8) -> bool {
        self.0[mask as usize]
    }
}

/// Number of runs of set bits around the ring that hold a side neighbour (an even bit).
fn arcs_with_a_side(mask: u8) -> u32 {
    if mask == u8::MAX {
        return 1;
    }
    let set = |i: u32| mask >> (i % 8) & 1 == 1;
    let starts = (0..8).filter(|&i| set(i) && !set(i + 7));
    starts.map(|start| (start..start + 8).take_while(|&i| set(i)).any(|i| i % 2 == 0)).map(u32::from).sum()
}

#[cfg(test)]
mod tests {
    use super::{OUTSIDE, Raster, SimplePoints, grid};

    #[test]
    fn grids_have_about_the_asked_number_of_cells() {
        assert_eq!(grid(Raster::new(640, 360), 3600), (80, 45));
        assert_eq!(grid(Raster::new(1, 1), 100), (1, 1));
        assert_eq!(grid(Raster::new(3, 1), 2), (2, 1));
        assert_eq!(grid(Raster::new(100, 100), 1), (1, 1));
    }

    #[test]
    fn ring_agrees_with_sides_everywhere() {
        for (w, h) in [(1, 1), (2, 1), (3, 2), (5, 4)] {
            let raster = Raster::new(w, h);
            for p in 0..raster.len() {
                let ring = raster.ring(p);
                let mut sides: Vec<usize> = ring.into_iter().step_by(2).filter(|&q| q != OUTSIDE).collect();
                sides.sort_unstable();
                assert_eq!(sides, raster.sides(p).collect::<Vec<_>>(), "pixel {p} of {w}x{h}");
            }
        }
    }

    #[test]
    fn side_pairs_are_counted_once() {
        assert_eq!(Raster::new(4, 3).side_pairs().count(), 3 * 3 + 4 * 2);
        assert_eq!(Raster::new(1, 1).side_pairs().count(), 0);
    }

    #[test]
    fn simple_points_match_a_flood_fill_of_the_ring() {
        let simple = SimplePoints::new();
        for mask in 0..=u8::MAX {
            let members: Vec<usize> = (0..8).filter(|i| mask >> i & 1 == 1).collect();
            let sides: Vec<usize> = members.iter().copied().filter(|i| i % 2 == 0).collect();
            let reached = sides.first().map(|&first| {
                let mut seen = vec![first];
                while let Some(&next) = members
                    .iter()
                    .find(|&&i| !seen.contains(&i) && (seen.contains(&((i + 1) % 8)) || seen.contains(&((i + 7) % 8))))
                {
                    seen.push(next);
                }
                sides.iter().all(|s| seen.contains(s))
            });
            assert_eq!(simple.may_leave(mask), reached == Some(true), "mask {mask:08b}");
        }
    }
}
