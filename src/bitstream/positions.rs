//! Positions of new vertices.
//!
//! In: a position, predicted by the gate that it lies behind. Out: the same, coded. Forbidden here: which tets use it.

use glam::IVec3;

use super::MeshFault;
use super::header::MAX_EXTENT;
use super::range_coder::{BitCoder, BitModel};
use super::symbols::{IntModel, TreeModel};
use crate::mesh::Domain;

/// Classes of a gate's extent along an axis: its binary logarithm in lattice units, which is below 2^19.
const SCALES: usize = 20;
/// How near the prediction is to a side: beyond it, within the gate's extent, farther.
const NEARNESS: usize = 3;

/// Models of one axis of one kind of coordinate.
#[derive(Debug, Clone)]
struct AxisModels {
    /// Whether the vertex lies on the low and on the high side, by number of gate corners there and nearness.
    on_side: [[[BitModel; NEARNESS]; 4]; 2],
    /// Whole pixels or frames from the prediction, by scale.
    whole: [IntModel; SCALES],
    /// Digits after the point, by whole part: -1, 0, other.
    fraction: [TreeModel; 3],
}

impl AxisModels {
    const NEW: Self = Self {
        on_side: [[[BitModel::NEW; NEARNESS]; 4]; 2],
        whole: [const { IntModel::NEW }; SCALES],
        fraction: [const { TreeModel::NEW }; 3],
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
        coder.bit(&mut self.pinned, truth)
    }
}

/// What a new vertex's position is predicted from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Behind {
    /// Positions of the gate's corners.
    pub(super) gate: [IVec3; 3],
    /// Position of the fourth corner of the tet before the gate.
    pub(super) opposite: IVec3,
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
}

/// Predicts and codes the position of the new vertex behind a gate.
///
/// The prediction carries on from the opposite corner through the gate's centre by an eighth of their distance (three
/// quarters cost 0.7 bits a vertex more). It is affine, so the scale of time against space does not matter. Rounded to whole pixels and frames, it leaves the
/// digits after the point to a model of their own, which costs nothing where vertices sit on the pixel lattice.
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
    let bits = u32::from(bounds.domain.subpixel_bits);
    let far = bounds.far();
    let sum: IVec3 = behind.gate.into_iter().sum();
    let mut position = IVec3::ZERO;
    for (axis, models) in models.axes.iter_mut().enumerate() {
        let gate = behind.gate.map(|p| p[axis]);
        let all = [gate[0], gate[1], gate[2], behind.opposite[axis]];
        let scale = all.iter().fold(0, |e, &c| e.max((c - all[0]).unsigned_abs())).max(1);
        let predicted = (3 * i64::from(sum[axis]) - i64::from(behind.opposite[axis])).div_euclid(8) as i32;
        // The end of the slab is a side only once it is known.
        let high = (axis < 2 || bounds.top_known).then_some(far[axis]);
        let mut on_side = None;
        for (side, place) in [Some(0), high].into_iter().enumerate() {
            let Some(place) = place else { continue };
            let beyond = if side == 0 { predicted } else { place - predicted };
            let nearness = if beyond <= 0 { 0 } else { 1 + usize::from(beyond.unsigned_abs() > scale) };
            let corners = gate.iter().filter(|&&c| c == place).count();
            if coder.bit(&mut models.on_side[side][corners][nearness], truth[axis] == place) {
                on_side = Some(place);
                break;
            }
        }
        position[axis] = match on_side {
            Some(place) => place,
            None => {
                let class = (scale.ilog2() as usize).min(SCALES - 1);
                let rounded = (predicted.clamp(0, far[axis]) + ((1 << bits) >> 1)) >> bits;
                code_coordinate(coder, models, class, rounded, bits, truth[axis])?
            }
        };
    }
    Ok(position)
}

/// Codes one coordinate as whole part and digits after the point, from a prediction in whole pixels or frames.
fn code_coordinate(
    coder: &mut impl BitCoder,
    models: &mut AxisModels,
    scale_class: usize,
    predicted: i32,
    bits: u32,
    truth: i32,
) -> Result<i32, MeshFault> {
    let residual = truth - (predicted << bits);
    let whole = models.whole[scale_class].code(coder, residual >> bits);
    let context = match whole {
        -1 => 0,
        0 => 1,
        _ => 2,
    };
    let fraction = models.fraction[context].code(coder, bits, residual as u32 & ((1 << bits) - 1));
    let coordinate = ((i64::from(predicted) + i64::from(whole)) << bits) + i64::from(fraction);
    i32::try_from(coordinate).map_err(|_| MeshFault::Range {
        field: "coordinate",
        low: i32::MIN.into(),
        high: i32::MAX.into(),
        found: coordinate,
    })
}

/// Codes a position as plain numbers, for the corners of a seed.
pub(super) fn code_free_position(coder: &mut impl BitCoder, bounds: &Bounds, truth: IVec3) -> IVec3 {
    let far = bounds.far();
    IVec3::from_array([0, 1, 2].map(|axis| {
        let bits = u32::BITS - far[axis].unsigned_abs().leading_zeros();
        coder.raw(bits, truth[axis].unsigned_abs()) as i32
    }))
}
