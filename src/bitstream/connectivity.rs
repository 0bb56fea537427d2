//! Which vertex lies behind a face: the coding of a gate's apex.
//!
//! In: the front around a gate. Out: what lies behind it. Forbidden here: positions of new vertices, colours, labels.
//!
//! As in the cut-border machine (Gumhold et al. 1999), tets are attached to open faces one by one, and a symbol says
//! whether the new corner closes the gap to a neighbouring open face, is a new vertex, or lies elsewhere on the front.
//! Unlike there, the mesh's geometry is known to both sides before its connectivity ([`super::gate`]): the angles of the
//! gaps around the gate and the distances of the vertices across them are the contexts.

use super::MeshFault;
use super::bits::Part;
use super::front::{Front, NOWHERE, Sharpness, WIDE};
use super::gate::{Gate, RANGES};
use super::models::BitModel;
use super::near::{Ranking, Rings};
use super::range_coder::BitCoder;
use super::symbols::UintModel;
use super::vertices::Vertices;
use crate::mesh::VertexId;

/// Classes of cos(angle) of a gap.
const ANGLES: usize = 16;

/// What lies behind a gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Apex {
    /// A vertex that is not coded yet.
    New,
    /// A coded vertex.
    Known(VertexId),
    /// Nothing: the mesh has a hole here.
    Hole,
    /// Nothing: the face lies on t = duration.
    Top,
}

/// Models of the apex symbols.
#[derive(Debug, Clone)]
pub(super) struct ConnectivityModels {
    /// By place in the order of candidates, edges, angle, distance.
    join: [[[[BitModel; RANGES]; ANGLES]; 3]; 3],
    /// By number of candidates, angle and distance of the first.
    new: [[[BitModel; RANGES]; ANGLES]; 4],
    /// Rank among the front's vertices near the gate, plus 1; 0: not among them.
    near: UintModel,
    nothing: BitModel,
    top: BitModel,
    /// Rank among those one ring farther, plus 1; 0: not among them.
    far: UintModel,
}

impl ConnectivityModels {
    pub(super) const NEW: Self = Self {
        join: [[[[BitModel::NEW; RANGES]; ANGLES]; 3]; 3],
        new: [[[BitModel::NEW; RANGES]; ANGLES]; 4],
        near: UintModel::NEW,
        nothing: BitModel::NEW,
        top: BitModel::NEW,
        far: UintModel::NEW,
    };
}

/// Class of an angle: steps of its cosine.
fn angle_class(gap: Sharpness) -> usize {
    usize::from(gap >> 4)
}

/// Codes what lies behind `gate`. `truth` is what the writer knows; the parser's is ignored.
///
/// # Errors
/// A reference to a vertex that does not exist.
pub(super) fn code_apex(
    coder: &mut impl BitCoder,
    (models, rings): (&mut ConnectivityModels, &mut Rings),
    (front, vertices): (&mut Front, &Vertices),
    gate: &Gate,
    truth: Apex,
) -> Result<Apex, MeshFault> {
    coder.enter(Part::Connectivity);
    let [next, before, opposite] = gate.across;
    let mut asked = Asked { first: (0, 0), count: 0 };
    let more = usize::from(next == before) + usize::from(next == opposite);
    if ask(coder, models, (front, vertices), gate, &mut asked, (0, more), truth) {
        return Ok(Apex::Known(next));
    }
    if before != next {
        let more = usize::from(before == opposite);
        if ask(coder, models, (front, vertices), gate, &mut asked, (1, more), truth) {
            return Ok(Apex::Known(before));
        }
    }
    if opposite != next && opposite != before && ask(coder, models, (front, vertices), gate, &mut asked, (2, 0), truth)
    {
        return Ok(Apex::Known(opposite));
    }
    let Asked { first, count } = asked;
    if coder.bit(&mut models.new[count][first.0][first.1], truth == Apex::New) {
        return Ok(Apex::New);
    }
    code_elsewhere(coder, (models, rings), (front, vertices), gate, truth)
}

/// Which vertices across edges of the gate have been asked for.
struct Asked {
    /// Classes of the first one's angle and distance.
    first: (usize, usize),
    count: usize,
}

/// Codes whether the apex is the vertex across an edge of the gate, if there is one that makes a gap below 180 degrees;
/// `more` edges have it, too.
#[inline(always)]
fn ask(
    coder: &mut impl BitCoder,
    models: &mut ConnectivityModels,
    (front, vertices): (&mut Front, &Vertices),
    gate: &Gate,
    asked: &mut Asked,
    (side, more): (usize, usize),
    truth: Apex,
) -> bool {
    let gap = front.gap(vertices, gate.edges[side]);
    if gap == WIDE {
        return false;
    }
    let vertex = gate.across[side];
    let (angle, range) = (angle_class(gap), gate.range(vertices, vertex));
    if coder.bit(&mut models.join[asked.count][more][angle][range], truth == Apex::Known(vertex)) {
        return true;
    }
    if asked.count == 0 {
        asked.first = (angle, range);
    }
    asked.count += 1;
    false
}

/// Codes an apex that is neither new nor across an edge of the gate.
///
/// # Errors
/// A reference to a vertex that does not exist.
#[inline(never)]
fn code_elsewhere(
    coder: &mut impl BitCoder,
    (models, rings): (&mut ConnectivityModels, &mut Rings),
    (front, vertices): (&mut Front, &Vertices),
    gate: &Gate,
    truth: Apex,
) -> Result<Apex, MeshFault> {
    let mut asked = gate.across;
    for (edge, vertex) in gate.edges.into_iter().zip(&mut asked) {
        if *vertex != NOWHERE && front.gap(vertices, edge) == WIDE {
            *vertex = NOWHERE;
        }
    }
    let front = &*front;
    if let Some(near) = code_rank(coder, &mut models.near, || rings.near(front, vertices, gate, asked), truth)? {
        return Ok(Apex::Known(near));
    }
    if coder.bit(&mut models.nothing, matches!(truth, Apex::Hole | Apex::Top)) {
        return Ok(if coder.bit(&mut models.top, truth == Apex::Top) { Apex::Top } else { Apex::Hole });
    }
    if let Some(far) = code_rank(coder, &mut models.far, || rings.far(front, vertices, gate, asked), truth)? {
        return Ok(Apex::Known(far));
    }
    let known = if let Apex::Known(v) = truth { v } else { VertexId(0) };
    code_vertex_id(coder, known, vertices.len() as u32).map(Apex::Known)
}

/// Codes which of the ranked vertices the apex is, if it is one of them. They are not asked for in vain: to rank them
/// takes time.
fn code_rank<'a>(
    coder: &mut impl BitCoder,
    model: &mut UintModel,
    rank: impl FnOnce() -> Ranking<'a>,
    truth: Apex,
) -> Result<Option<VertexId>, MeshFault> {
    if let Apex::Known(apex) = truth {
        let place = rank().position(|v| v == apex);
        model.code(coder, place.map_or(0, |place| place as u32 + 1));
        return Ok(place.map(|_| apex));
    }
    let Some(place) = model.code(coder, 0).checked_sub(1) else { return Ok(None) };
    let mut expected = 0;
    let found = rank().inspect(|_| expected += 1).nth(place as usize);
    found.map(Some).ok_or(MeshFault::Reference { field: "vertex near the gate", expected, found: place })
}

/// Codes a reference to one of `count` vertices as a plain number.
pub(super) fn code_vertex_id(coder: &mut impl BitCoder, truth: VertexId, count: u32) -> Result<VertexId, MeshFault> {
    let found = coder.raw(u32::BITS - count.leading_zeros(), truth.0);
    if found < count {
        Ok(VertexId(found))
    } else {
        Err(MeshFault::Reference { field: "vertex", expected: count, found })
    }
}
