//! The box that a slab's mesh tiles, and the integer lattice its vertices live on.

use glam::{IVec3, Vec3};

/// Sides of the box on which a vertex lies, one bit each. Each side counts as one more label in the paper's
/// K-class rule (§V-B), so that edges and corners of the box stay fixed under subdivision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Sides(pub u8);

impl Sides {
    /// x = 0, x = width, y = 0, y = height, t = 0, t = duration, in this order of bits.
    pub const X_LOW: Self = Self(1);
    /// x = width.
    pub const X_HIGH: Self = Self(2);
    /// y = 0.
    pub const Y_LOW: Self = Self(4);
    /// y = height.
    pub const Y_HIGH: Self = Self(8);
    /// t = 0, the slab's first frame.
    pub const T_LOW: Self = Self(16);
    /// t = duration, the slab's end.
    pub const T_HIGH: Self = Self(32);

    /// Number of sides.
    pub fn count(self) -> u32 {
        self.0.count_ones()
    }

    /// Sides that both have.
    pub fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Sides that either has.
    pub fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all of `other`'s sides are among these.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// 1 for the axes along which a vertex may move without leaving one of its sides, 0 for the others.
    pub fn free_axes(self) -> Vec3 {
        let axis = |low: Self, high: Self| if self.0 & (low.0 | high.0) == 0 { 1.0 } else { 0.0 };
        Vec3::new(axis(Self::X_LOW, Self::X_HIGH), axis(Self::Y_LOW, Self::Y_HIGH), axis(Self::T_LOW, Self::T_HIGH))
    }

    /// Whether the vertex lies on no side.
    pub fn is_interior(self) -> bool {
        self.0 == 0
    }
}

/// The box [0, width] x [0, height] x [0, duration] of a slab, in pixels and frames since the slab's first frame.
///
/// Positions are integers: multiples of 2^-`subpixel_bits` of a pixel in x and y and of a frame in t, from the first
/// lattice to the stream, so that orientation and volume are exact everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Domain {
    /// Width of the picture in pixels.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// Extent in time, in frames: a slab of frames a to b has duration b - a. At least 1.
    pub duration: u32,
    /// Binary digits of a position after the point.
    pub subpixel_bits: u8,
}

impl Domain {
    /// Lattice units in a pixel or a frame.
    pub fn unit(&self) -> i32 {
        1 << self.subpixel_bits
    }

    /// The far corner in lattice units; the near one is the origin.
    pub fn extent(&self) -> IVec3 {
        IVec3::new(self.width as i32, self.height as i32, self.duration as i32) * self.unit()
    }

    /// Volume of the box in sixths of a cubic lattice unit.
    pub fn volume6(&self) -> i64 {
        let e = self.extent();
        6 * i64::from(e.x) * i64::from(e.y) * i64::from(e.z)
    }

    /// The sides on which `position` (lattice units) lies.
    pub fn sides(&self, position: IVec3) -> Sides {
        let e = self.extent();
        let bit = |on: bool, side: Sides| if on { side.0 } else { 0 };
        Sides(
            bit(position.x == 0, Sides::X_LOW)
                | bit(position.x == e.x, Sides::X_HIGH)
                | bit(position.y == 0, Sides::Y_LOW)
                | bit(position.y == e.y, Sides::Y_HIGH)
                | bit(position.z == 0, Sides::T_LOW)
                | bit(position.z == e.z, Sides::T_HIGH),
        )
    }
}
