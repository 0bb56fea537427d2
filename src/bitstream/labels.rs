//! Labels of tets.
//!
//! In: a label, and the labels known around the tet. Out: the same, coded. Labels are numbered in the order in which
//! the stream names them. Forbidden here: geometry, colours.

use super::MeshFault;
use super::range_coder::{BitCoder, BitModel};
use super::symbols::UintModel;

/// Places among the candidates that have a model of their own.
const PLACES: usize = 6;

/// What is known around a tet whose label is coded.
#[derive(Debug, Clone, Default)]
pub(super) struct LabelContext<'a> {
    /// Label of the tet before the gate; none for a seed.
    pub(super) before: Option<u32>,
    /// Corners of the gate, 0 to 3, known to have several labels.
    pub(super) boundary_corners: usize,
    /// Coded tets across the other three faces with the same label as the one before the gate.
    pub(super) agreeing: usize,
    /// Those with another label.
    pub(super) differing: usize,
    /// Other labels at the tet's corners and at how many, the most likely first.
    pub(super) candidates: &'a [(u32, u32)],
}

/// Models of labels.
#[derive(Debug, Clone)]
pub(super) struct LabelModels {
    /// The label before the gate carries on; by corners on a boundary, agreeing and differing neighbours.
    same: [[[BitModel; 4]; 4]; 4],
    /// It is the candidate at this place.
    candidate: [BitModel; PLACES],
    new: BitModel,
    distance: UintModel,
}

impl LabelModels {
    pub(super) const NEW: Self = Self {
        same: [[[BitModel::NEW; 4]; 4]; 4],
        candidate: [BitModel::NEW; PLACES],
        new: BitModel::NEW,
        distance: UintModel::NEW,
    };
}

/// Codes the label of a tet, of `count` labels known so far; a new label gets the number `count`.
///
/// # Errors
/// A reference to a label that does not exist.
pub(super) fn code_label(
    coder: &mut impl BitCoder,
    models: &mut LabelModels,
    context: &LabelContext<'_>,
    count: u32,
    truth: u32,
) -> Result<u32, MeshFault> {
    if let Some(before) = context.before {
        let model = &mut models.same[context.boundary_corners][context.agreeing][context.differing];
        if coder.bit(model, truth == before) {
            return Ok(before);
        }
    }
    for (place, &(candidate, _)) in context.candidates.iter().enumerate() {
        if coder.bit(&mut models.candidate[place.min(PLACES - 1)], truth == candidate) {
            return Ok(candidate);
        }
    }
    if count == 0 || coder.bit(&mut models.new, truth == count) {
        return Ok(count);
    }
    // Counted back from the newest: labels that appear late are met again nearby.
    let found = models.distance.code(coder, (count - 1).saturating_sub(truth));
    if found < count {
        Ok(count - 1 - found)
    } else {
        Err(MeshFault::Reference { field: "label", expected: count, found })
    }
}
