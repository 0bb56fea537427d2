//! The lattice over a run of frames: the dense one of the paper (§III-B), one vertex a pixel and frame, or the adaptive
//! one ([`AdaptiveLattice`]), which has these vertices only where colour or labels ask for them.
//!
//! In: consecutive frames of a slab with a label for every pixel. Out: position, label and colour of every lattice
//! vertex; of the dense lattice computed on demand, of the adaptive one with the tets that join them. Forbidden here:
//! splitting tets between labels, which is cleaving's business.

mod adaptive;
mod axis;
mod bisect;
mod importance;
mod labels;
mod samples;

use std::sync::Arc;

pub use adaptive::{AdaptiveLattice, EdgeCut, TetLattice};

use glam::IVec3;
use thiserror::Error;

use crate::mesh::Domain;
use crate::video::{Frame, Label, LabelPlane};

/// Fewest binary digits after the point: with them, midpoints of lattice edges and interior points of faces are still
/// lattice positions.
pub const MIN_SUBPIXEL_BITS: u8 = 2;
/// Most binary digits after the point: [`crate::mesh::volume6`] is exact up to these at the largest frame side.
pub const MAX_SUBPIXEL_BITS: u8 = 6;

/// Why frames and labels do not make a lattice.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LatticeError {
    /// Positions would be too coarse to cut or too fine to be exact.
    #[error("subpixel bits: expected {least} to {MAX_SUBPIXEL_BITS}, found {found}")]
    SubpixelBits {
        /// Fewest that would do.
        least: u8,
        /// The domain's value.
        found: u8,
    },
    /// There are too few planes to enclose a volume, or not as many label planes as frames.
    #[error(
        "planes: expected at least 2, as many frames as label planes, found {frames} frames, {labels} label planes"
    )]
    PlaneCount {
        /// Frames handed in.
        frames: usize,
        /// Label planes handed in.
        labels: usize,
    },
    /// A frame or a label plane has another size than the domain.
    #[error("plane {plane}: expected {expected:?} pixels, found {found:?}")]
    PlaneSize {
        /// Index into the planes handed in.
        plane: usize,
        /// (width, height) of the domain.
        expected: (u32, u32),
        /// (width, height) of the frame or label plane.
        found: (u32, u32),
    },
    /// The run of planes ends after the slab, or the slab is too long for positions of 32 bits.
    #[error("last plane: expected at most frame {expected}, found {found}")]
    LastPlane {
        /// Last frame that the domain allows.
        expected: u64,
        /// Frame of the last plane handed in.
        found: u64,
    },
}

/// Lattice over frames `first` to `first + planes - 1` of a slab.
///
/// Lattice vertex (column, row, plane) stands for pixel (column, row) of that frame and sits at the pixel's centre in
/// x and y and at the frame's number in t. The outermost columns and rows are moved out to the sides of the picture,
/// so that the lattice fills the picture whole. A picture one pixel wide (high) has two columns (rows) of that pixel.
#[derive(Debug, Clone, Copy)]
pub struct Lattice<'a> {
    domain: Domain,
    first: u32,
    frames: &'a [Arc<Frame>],
    labels: &'a [LabelPlane],
}

impl<'a> Lattice<'a> {
    /// Lattice of `frames` and their `labels`; the first of them is frame number `first` of the slab that `domain`
    /// describes.
    ///
    /// # Errors
    /// See [`LatticeError`]'s variants.
    pub fn try_new(
        domain: Domain,
        first: u32,
        frames: &'a [Arc<Frame>],
        labels: &'a [LabelPlane],
    ) -> Result<Self, LatticeError> {
        let last = u64::from(first) + frames.len().saturating_sub(1) as u64;
        check(domain, MIN_SUBPIXEL_BITS, last, frames, labels)?;
        Ok(Self { domain, first, frames, labels })
    }

    /// The slab's box, of which the lattice covers a run of frames.
    pub fn domain(&self) -> Domain {
        self.domain
    }

    /// Lattice vertices in a row: at least 2.
    pub fn columns(&self) -> usize {
        self.domain.width.max(2) as usize
    }

    /// Rows of lattice vertices in a plane: at least 2.
    pub fn rows(&self) -> usize {
        self.domain.height.max(2) as usize
    }

    /// Planes, one a frame: at least 2.
    pub fn planes(&self) -> usize {
        self.frames.len()
    }

    /// Position of a lattice vertex in lattice units, t since the slab's first frame.
    pub fn position(&self, column: usize, row: usize, plane: usize) -> IVec3 {
        let unit = self.domain.unit();
        IVec3::new(
            place_sample(column, self.columns(), self.domain.width, unit),
            place_sample(row, self.rows(), self.domain.height, unit),
            (self.first as i32 + plane as i32) * unit,
        )
    }

    /// Labels of the pixels behind a row of lattice vertices: `width` of them, where a picture one pixel wide has one
    /// for both columns.
    pub fn label_row(&self, row: usize, plane: usize) -> &'a [Label] {
        let width = self.domain.width as usize;
        let start = self.pixel_row(row) * width;
        &self.labels[plane].labels()[start..start + width]
    }

    /// Colours of the pixels behind a row of lattice vertices, laid out as [`Self::label_row`].
    pub fn color_row(&self, row: usize, plane: usize) -> &'a [[u8; 3]] {
        self.frames[plane].row(self.pixel_row(row) as u32)
    }

    fn pixel_row(&self, row: usize) -> usize {
        row.min(self.domain.height as usize - 1)
    }
}

/// Checks that planes, the last of them at frame `last`, fit each other and the slab.
fn check(
    domain: Domain,
    least_bits: u8,
    last: u64,
    frames: &[Arc<Frame>],
    labels: &[LabelPlane],
) -> Result<(), LatticeError> {
    if !(least_bits..=MAX_SUBPIXEL_BITS).contains(&domain.subpixel_bits) {
        return Err(LatticeError::SubpixelBits { least: least_bits, found: domain.subpixel_bits });
    }
    if frames.len() < 2 || frames.len() != labels.len() {
        return Err(LatticeError::PlaneCount { frames: frames.len(), labels: labels.len() });
    }
    let expected = (domain.width, domain.height);
    for (plane, (frame, label)) in frames.iter().zip(labels).enumerate() {
        for found in [(frame.width(), frame.height()), (label.width(), label.height())] {
            if found != expected {
                return Err(LatticeError::PlaneSize { plane, expected, found });
            }
        }
    }
    let expected = u64::from(domain.duration).min((i32::MAX >> domain.subpixel_bits) as u64);
    if last > expected { Err(LatticeError::LastPlane { expected, found: last }) } else { Ok(()) }
}

/// Coordinate of lattice line `index` of `count` over `side` pixels: the sample's centre, the outermost at the sides.
fn place_sample(index: usize, count: usize, side: u32, unit: i32) -> i32 {
    if index == 0 {
        0
    } else if index + 1 == count {
        side as i32 * unit
    } else {
        index as i32 * unit + unit / 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planes(width: u32, height: u32, count: usize) -> (Vec<Arc<Frame>>, Vec<LabelPlane>) {
        let frame = Arc::new(Frame::from_fn(width, height, |x, y| [x as u8, y as u8, 7]).unwrap());
        (vec![frame; count], vec![LabelPlane::uniform(width, height, Label(0)); count])
    }

    fn domain(width: u32, height: u32, duration: u32) -> Domain {
        Domain { width, height, duration, subpixel_bits: 3 }
    }

    #[test]
    fn samples_sit_at_pixel_centres_and_the_outermost_at_the_sides() {
        let (frames, labels) = planes(4, 1, 2);
        let lattice = Lattice::try_new(domain(4, 1, 9), 5, &frames, &labels).unwrap();
        let xs: Vec<i32> = (0..lattice.columns()).map(|i| lattice.position(i, 0, 0).x).collect();
        assert_eq!(xs, [0, 12, 20, 32]);
        assert_eq!(lattice.rows(), 2);
        assert_eq!(lattice.position(0, 1, 1), IVec3::new(0, 8, 48));
        assert_eq!(lattice.color_row(1, 0), lattice.color_row(0, 1));
    }

    #[test]
    fn refuses_what_does_not_fit() {
        let (frames, labels) = planes(3, 2, 3);
        let refusal = |domain, first, planes: usize, label_planes: usize| {
            Lattice::try_new(domain, first, &frames[..planes], &labels[..label_planes]).err()
        };
        let fits = domain(3, 2, 2);
        assert_eq!(refusal(fits, 0, 3, 3), None);
        assert_eq!(refusal(fits, 1, 3, 3), Some(LatticeError::LastPlane { expected: 2, found: 3 }));
        assert_eq!(refusal(fits, u32::MAX, 2, 2), Some(LatticeError::LastPlane { expected: 2, found: 1 << 32 }));
        assert_eq!(refusal(fits, 0, 1, 1), Some(LatticeError::PlaneCount { frames: 1, labels: 1 }));
        assert_eq!(refusal(fits, 0, 3, 2), Some(LatticeError::PlaneCount { frames: 3, labels: 2 }));
        let size = LatticeError::PlaneSize { plane: 0, expected: (2, 2), found: (3, 2) };
        assert_eq!(refusal(domain(2, 2, 2), 0, 3, 3), Some(size));
        for found in [1, 7] {
            let coarse = Domain { subpixel_bits: found, ..fits };
            assert_eq!(refusal(coarse, 0, 3, 3), Some(LatticeError::SubpixelBits { least: MIN_SUBPIXEL_BITS, found }));
        }
    }
}
