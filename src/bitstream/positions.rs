//! Positions of new vertices.
//!
//! In: a position, and the gate that it lies behind. Out: the same, coded. Forbidden here: which tets use it.

use glam::{IVec3, Vec3A};

use super::MeshFault;
use super::bits::Part;
use super::extents::ilog2;
use super::header::MAX_EXTENT;
use super::models::BitModel;
use super::normals::{floor, unit_normal, whole};
use super::range_coder::BitCoder;
use super::symbols::{SignedModel, SmallModel, UintModel};
use super::vertices::TOP;
use crate::mesh::Domain;

/// Classes of a length: the binary logarithm of its square, which is below 2^38.
const SCALES: usize = 40;
/// Classes of lengths in x and y that have models of their own.
const SHORT_SCALES: usize = 8;
/// How near the prediction is to a side: beyond it, within an extent, farther.
const NEARNESS: usize = 3;
/// Classes of how far behind the gate's plane the vertex is expected, in quarters of an extent.
const HEIGHTS: usize = 5;

/// How far ahead of the gate's centre a vertex is expected, in extents along the normal.
const AHEAD: f32 = 0.625;
/// Weights, in sixteenths, of the vertices across the gate's edges, relative to the gate's centre.
const ACROSS: [f32; 3] = [4.0, 2.0, 1.0];
/// The same of the gate's first and second corner and of the fourth corner of the tet before it.
const FIRST: f32 = -3.0;
/// See [`FIRST`].
const SECOND: f32 = 6.0;
/// See [`FIRST`].
const OPPOSITE: f32 = -1.0;

/// Models of one axis.
#[derive(Debug, Clone)]
struct AxisModels {
    /// Whether the vertex lies on the low and on the high side, by number of gate corners there and nearness.
    on_side: [[[BitModel; NEARNESS]; 4]; 2],
    /// Residual of one of the first two coordinates, by scale.
    free: [SignedModel; SCALES],
    /// Distance beyond the gate's plane, by scale and expectation.
    height: [[SmallModel; HEIGHTS]; SCALES],
    escape: UintModel,
}

impl AxisModels {
    const NEW: Self = Self {
        on_side: [[[BitModel::NEW; NEARNESS]; 4]; 2],
        free: [const { SignedModel::NEW }; SCALES],
        height: [const { [const { SmallModel::NEW }; HEIGHTS] }; SCALES],
        escape: UintModel::NEW,
    };
}

/// Models of positions.
#[derive(Debug, Clone)]
pub(super) struct PositionModels {
    axes: [AxisModels; 3],
    pinned: BitModel,
}

impl PositionModels {
    pub(super) const NEW: Self = Self { axes: [const { AxisModels::NEW }; 3], pinned: BitModel::NEW };

    /// Codes whether subdivision must leave the new vertex where it is.
    pub(super) fn code_pinned(&mut self, coder: &mut impl BitCoder, truth: bool) -> bool {
        coder.enter(Part::Space);
        coder.bit(&mut self.pinned, truth)
    }
}

/// What a new vertex's position is predicted from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Behind {
    /// Positions of the gate's corners, the focus first.
    pub(super) gate: [Vec3A; 3],
    /// Position of the fourth corner of the tet before the gate.
    pub(super) opposite: Vec3A,
    /// Positions of the vertices across the gate's edges.
    pub(super) across: [Option<Vec3A>; 3],
    /// Sum of the extents at the gate's corners.
    pub(super) extent: Vec3A,
}

/// The part of space that is known of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// The box; its duration counts only with `top_known`.
    pub(super) domain: Domain,
    /// Whether the duration is known yet.
    pub(super) top_known: bool,
}

impl Bounds {
    /// The far corner in lattice units, at the latest t of the format if the duration is not known.
    pub(super) fn far(&self) -> IVec3 {
        let extent = self.domain.extent();
        if self.top_known { extent } else { IVec3::new(extent.x, extent.y, MAX_EXTENT) }
    }

    /// The sides that a vertex lies on, as bits; the end of the slab is one once it is known.
    pub(super) fn sides(&self, position: IVec3) -> u8 {
        let far = self.domain.extent();
        let on: [bool; 5] =
            [position.x == 0, position.x == far.x, position.y == 0, position.y == far.y, position.z == 0];
        let sides: u8 = on.into_iter().enumerate().map(|(side, on)| u8::from(on) << side).sum();
        if self.top_known && position.z == far.z { sides | TOP } else { sides }
    }

    /// The high side along an axis; the end of the slab is one only once it is known.
    fn high_side(&self, axis: usize) -> Option<i32> {
        (axis < 2 || self.top_known).then_some(self.far()[axis])
    }
}

/// Where a vertex is expected behind a gate, and the gate's plane.
struct Expectation {
    /// Mean extent of edges around the gate, in lattice units.
    extent: [f32; 3],
    /// The gate's unit normal, measured in extents.
    normal: [f32; 3],
    predicted: [i32; 3],
    /// The gate's normal in lattice units, exact.
    plane: [i64; 3],
    /// A point of the plane.
    origin: IVec3,
    /// The axis along which the plane is steepest: its coordinate comes last.
    last: usize,
}

impl Expectation {
    fn new(behind: &Behind) -> Self {
        let [a, b, c] = behind.gate;
        let origin = whole(a);
        let plane = (whole(b) - origin).as_i64vec3().cross((whole(c) - origin).as_i64vec3());
        let normal = unit_normal(plane.as_vec3a(), behind.extent);
        let extent = behind.extent / 3.0;
        let sum = a + b + c;
        let mut ahead = 3.0 * (SECOND * b + FIRST * a + OPPOSITE * behind.opposite) - (SECOND + FIRST + OPPOSITE) * sum;
        for (weight, across) in ACROSS.into_iter().zip(behind.across) {
            ahead += across.map_or(Vec3A::ZERO, |p| weight * (3.0 * p - sum));
        }
        let center = sum / 3.0 + ahead / 48.0;
        let predicted = (center + AHEAD * extent * normal + 0.5).to_array().map(floor);
        let (extent, normal) = (extent.to_array(), normal.to_array());
        // The first of equals.
        let steeper = |best: usize, axis: usize| if normal[axis].abs() > normal[best].abs() { axis } else { best };
        let last = steeper(steeper(0, 1), 2);
        Self { extent, normal, predicted, plane: plane.to_array(), origin, last }
    }

    /// Coordinates in the order in which they are coded.
    fn order(&self) -> [usize; 3] {
        match self.last {
            0 => [1, 2, 0],
            1 => [0, 2, 1],
            _ => [0, 1, 2],
        }
    }

    /// The first coordinate along the last axis that lies behind the gate's plane, given the others, and the direction.
    fn nearest(&self, position: IVec3) -> (i64, i64) {
        let d = (position - self.origin).as_i64vec3();
        let rest: i64 = (0..3).filter(|&axis| axis != self.last).map(|axis| self.plane[axis] * d[axis]).sum();
        let (slope, origin) = (self.plane[self.last], i64::from(self.origin[self.last]));
        // slope * (coordinate - origin) > -rest
        if slope > 0 {
            (origin + (-rest).div_euclid(slope) + 1, 1)
        } else {
            (origin - (-rest).div_euclid((-slope).max(1)) - 1, -1)
        }
    }
}

/// Class of a length in lattice units.
fn scale_class(length: f32) -> usize {
    (ilog2((length * length).max(1.0)) as usize).min(SCALES - 1)
}

/// Which models a scale has. Lengths in x and y that differ by octaves differ in their raw digits alone, but for the shortest
/// ones; in time frames show.
fn context(axis: usize, class: usize) -> usize {
    if axis < 2 && class >= SHORT_SCALES { SHORT_SCALES + class % 2 } else { class }
}

/// Binary digits at the end of a number of this scale that are as good as random: all below half of the length.
fn low_digits(class: usize) -> u32 {
    (class as u32 / 2).saturating_sub(1)
}

/// Predicts and codes the position of the new vertex behind a gate.
///
/// The prediction lies ahead of the gate, drawn towards the open faces around it; the weights are a least squares fit
/// over the vertices of CUP and BUNNY360. The vertex must lie behind the gate's plane, so the coordinate along the axis
/// that is nearest to the gate's normal comes last, as a distance from the plane.
///
/// # Errors
/// A position outside the box.
pub(super) fn code_position(
    coder: &mut impl BitCoder,
    models: &mut PositionModels,
    behind: &Behind,
    bounds: &Bounds,
    truth: IVec3,
) -> Result<IVec3, MeshFault> {
    let expectation = Expectation::new(behind);
    let far = bounds.far();
    let mut position = IVec3::ZERO;
    for axis in expectation.order() {
        coder.enter(if axis < 2 { Part::Space } else { Part::Time });
        let models = &mut models.axes[axis];
        if let Some(place) = code_side(coder, models, behind, &expectation, (axis, bounds.high_side(axis)), truth[axis])
        {
            position[axis] = place;
            continue;
        }
        let coordinate = if axis == expectation.last {
            let nearest = expectation.nearest(position);
            code_height(coder, models, &expectation, nearest, truth[axis])
        } else {
            let class = scale_class(expectation.extent[axis]);
            let predicted = expectation.predicted[axis];
            let rest = truth[axis].wrapping_sub(predicted);
            let digits = low_digits(class);
            let high = models.free[context(axis, class)].code(&mut models.escape, coder, rest >> digits);
            let low = coder.raw(digits, rest as u32 & ((1 << digits) - 1));
            i64::from(predicted) + (high << digits) + i64::from(low)
        };
        if !(0..=i64::from(far[axis])).contains(&coordinate) {
            return Err(MeshFault::Range { field: "coordinate", low: 0, high: far[axis].into(), found: coordinate });
        }
        position[axis] = coordinate as i32;
    }
    Ok(position)
}

/// Codes whether a coordinate is that of a side of the box, and of which.
fn code_side(
    coder: &mut impl BitCoder,
    models: &mut AxisModels,
    behind: &Behind,
    expectation: &Expectation,
    (axis, high): (usize, Option<i32>),
    truth: i32,
) -> Option<i32> {
    let predicted = expectation.predicted[axis];
    for (side, place) in [Some(0), high].into_iter().enumerate() {
        let Some(place) = place else { continue };
        let beyond = if side == 0 { i64::from(predicted) } else { i64::from(place) - i64::from(predicted) };
        let is_far = beyond as f32 > expectation.extent[axis];
        let nearness = if beyond <= 0 { 0 } else { 1 + usize::from(is_far) };
        let corners = behind.gate.iter().filter(|p| p[axis] == place as f32).count();
        // Where it is not expected there, no decision is spent on it: it comes as any other coordinate does.
        if corners == 0 && nearness == NEARNESS - 1 {
            continue;
        }
        if coder.bit(&mut models.on_side[side][corners][nearness], truth == place) {
            return Some(place);
        }
    }
    None
}

/// Codes the coordinate along the last axis: how far it is from the first one behind the gate's plane.
fn code_height(
    coder: &mut impl BitCoder,
    models: &mut AxisModels,
    expectation: &Expectation,
    (nearest, direction): (i64, i64),
    truth: i32,
) -> i64 {
    let axis = expectation.last;
    let scale = expectation.extent[axis] / expectation.normal[axis].abs();
    let expected = (i64::from(expectation.predicted[axis]) - nearest) * direction;
    let class = (expected as f32 / scale * 4.0).clamp(0.0, (HEIGHTS - 1) as f32) as usize;
    let height = ((i64::from(truth) - nearest) * direction).clamp(0, MAX_EXTENT.into()) as u32;
    let scale = scale_class(scale);
    let digits = low_digits(scale);
    let high = models.height[context(axis, scale)][class].code(&mut models.escape, coder, height >> digits);
    let low = coder.raw(digits, height & ((1 << digits) - 1));
    nearest + direction * ((high << digits) + i64::from(low))
}

/// Codes a position as plain numbers, for the corners of a seed.
pub(super) fn code_free_position(coder: &mut impl BitCoder, bounds: &Bounds, truth: IVec3) -> IVec3 {
    let far = bounds.far();
    IVec3::from_array([0, 1, 2].map(|axis| {
        let bits = u32::BITS - far[axis].unsigned_abs().leading_zeros();
        coder.raw(bits, truth[axis].unsigned_abs()) as i32
    }))
}
