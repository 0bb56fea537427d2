//! Labels of tets.
//!
//! In: a label, and the labels known around the tet. Out: the same, coded. Labels are numbered in the order in which
//! the stream names them. Forbidden here: geometry, colours.

use super::MeshFault;
use super::models::BitModel;
use super::range_coder::BitCoder;
use super::symbols::UintModel;

/// Places among the candidates that have a model of their own.
const PLACES: usize = 6;

/// What is known around a tet behind a gate, each number 0 to 3.
#[derive(Debug, Clone, Copy)]
pub(super) struct SameContext {
    /// Corners of the gate known to have several labels.
    pub(super) boundary_corners: usize,
    /// Coded tets across the other three faces with the same label as the one before the gate.
    pub(super) agreeing: usize,
    /// Those with another label.
    pub(super) differing: usize,
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

    /// Codes whether a tet has the label before its gate.
    #[inline]
    pub(super) fn code_same(&mut self, coder: &mut impl BitCoder, context: SameContext, truth: bool) -> bool {
        let SameContext { boundary_corners, agreeing, differing } = context;
        coder.bit(&mut self.same[boundary_corners][agreeing][differing], truth)
    }

    /// Codes another label: one of the candidates, with the number of corners that have it, the most likely first; one of
    /// the `count` labels known so far; or a new one, which gets the number `count`.
    ///
    /// # Errors
    /// A reference to a label that does not exist.
    pub(super) fn code_other(
        &mut self,
        coder: &mut impl BitCoder,
        candidates: &[(u32, u32)],
        count: u32,
        truth: u32,
    ) -> Result<u32, MeshFault> {
        for (place, &(candidate, _)) in candidates.iter().enumerate() {
            if coder.bit(&mut self.candidate[place.min(PLACES - 1)], truth == candidate) {
                return Ok(candidate);
            }
        }
        if count == 0 || coder.bit(&mut self.new, truth == count) {
            return Ok(count);
        }
        // Counted back from the newest: labels that appear late are met again nearby.
        let found = self.distance.code(coder, (count - 1).saturating_sub(truth));
        if found < count {
            Ok(count - 1 - found)
        } else {
            Err(MeshFault::Reference { field: "label", expected: count, found })
        }
    }
}
