//! Which vertex lies behind a face: the choice of the next gate and the coding of its apex.
//!
//! In: the front around a focus vertex. Out: a gate, and what lies behind it. Forbidden here: positions of new
//! vertices, colours, labels.
//!
//! As in the cut-border machine (Gumhold et al. 1999), tets are attached to open faces one by one, and a symbol says
//! whether the new corner closes the gap to a neighbouring open face, is a new vertex, or lies elsewhere on the front.
//! Unlike there, the mesh's geometry is known to both sides before its connectivity: the gap at an edge between two
//! open faces is either sharp, then almost surely closed by one tet, or wide. So the sharpest gap at the focus comes
//! first, and its angle is the context. Meshes are long in time where nothing moves, so angles and distances are
//! measured in the extents of the edges around.

use glam::{DVec3, I64Vec3, IVec3};

use super::MeshFault;
use super::bits::Part;
use super::extents::{self, PARTS};
use super::fan::{Fan, gap_cos};
use super::front::Front;
use super::near::{Ranking, Rings};
use super::range_coder::{BitCoder, BitModel};
use super::symbols::UintModel;
use super::vertices::Vertices;
use crate::mesh::VertexId;

/// Open faces of one vertex that are looked at. Typical vertices have six; a hub of thousands stays cheap.
pub(super) const SCAN: usize = 24;

/// Classes of cos(angle) of a gap.
const ANGLES: usize = 16;

/// Squares of distances, in extents, between which classes of distance lie.
const DISTANCES: [f64; 7] = [0.75, 1.25, 1.75, 2.75, 4.0, 6.0, 9.0];
/// Classes of distance.
const RANGES: usize = DISTANCES.len() + 1;

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

/// A coded vertex across an edge of the gate.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    vertex: VertexId,
    /// Cosine of the gap's angle, the sharpest if several edges lead to the vertex.
    cos: f64,
    /// Edges of the gate across which the vertex lies, 1 to 3.
    edges: usize,
}

/// An open face to be closed, and the vertices that may close it.
#[derive(Debug, Clone)]
pub(super) struct Gate {
    /// Its id in the front.
    pub(super) face: u32,
    /// Its corners, the focus first.
    pub(super) corners: [VertexId; 3],
    /// Sum of the extents at its corners.
    pub(super) extent: IVec3,
    /// Vertices of the open faces across its edges: from third corner to first, first to second, second to third.
    pub(super) across: [Option<VertexId>; 3],
    candidates: [Option<Candidate>; 3],
    /// Position of the focus, and the plane through it.
    origin: IVec3,
    plane: I64Vec3,
}

impl Gate {
    pub(super) fn has_candidate(&self, vertex: VertexId) -> bool {
        self.candidates.iter().flatten().any(|c| c.vertex == vertex)
    }

    /// Whether the tet of the gate and `apex` is positive.
    #[inline]
    pub(super) fn is_positive(&self, vertices: &Vertices, apex: VertexId) -> bool {
        self.plane.dot((vertices.position(apex) - self.origin).as_i64vec3()) > 0
    }

    /// Square of the distance of a vertex from the gate's centre, in extents.
    pub(super) fn distance2(&self, vertices: &Vertices, vertex: VertexId) -> f64 {
        let at = |v: VertexId| vertices.position(v);
        let [a, b, c] = self.corners.map(at);
        let d = (3 * at(vertex) - (a + b + c)).as_dvec3() / self.extent.as_dvec3();
        f64::from(PARTS * PARTS) * (d.x * d.x + d.y * d.y + d.z * d.z)
    }

    /// Class of that distance.
    fn range(&self, vertices: &Vertices, vertex: VertexId) -> usize {
        let distance2 = self.distance2(vertices, vertex);
        DISTANCES.iter().filter(|&&limit| distance2 > limit).count()
    }
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

/// Class of an angle: equal steps of its cosine.
fn angle_class(cos: f64) -> usize {
    (((cos + 1.0) * (ANGLES as f64 / 2.0)) as usize).min(ANGLES - 1)
}

/// The open face at `focus` to close next: the one before the sharpest gap at an edge of `focus`, going around it
/// anticlockwise. `None`: all faces at `focus` are closed.
pub(super) fn choose_gate(fan: &mut Fan, (front, vertices): (&Front, &Vertices), focus: VertexId) -> Option<Gate> {
    fan.turn_to(front, vertices, focus);
    let (blade, [next, previous]) = fan.sharpest(vertices)?;
    let corners = [focus, blade.spoke.second, blade.spoke.third];
    let across = [
        next.map(|next| (next.spoke.third, next.normal)),
        previous.map(|previous| (previous.spoke.second, previous.normal)),
        find_opposite(front, vertices, corners),
    ];
    let mut gate = Gate {
        face: blade.spoke.face,
        corners,
        extent: extents::around(vertices, corners),
        origin: vertices.position(focus),
        plane: blade.plane,
        across: across.map(|found| found.map(|(vertex, _)| vertex)),
        candidates: [None; 3],
    };
    for (vertex, normal) in across.into_iter().flatten() {
        if gate.is_positive(vertices, vertex) {
            add_candidate(&mut gate.candidates, vertex, gap_cos(blade.normal, normal));
        }
    }
    // Those of several edges first, then by angle. Neighbours only, so that ties keep the order of edges.
    for place in [0, 1, 0] {
        let [Some(a), Some(b)] = [gate.candidates[place], gate.candidates[place + 1]] else { continue };
        if b.edges > a.edges || (b.edges == a.edges && b.cos > a.cos) {
            gate.candidates.swap(place, place + 1);
        }
    }
    Some(gate)
}

/// The vertex and the normal of the youngest open face across the gate's edge opposite the focus.
fn find_opposite(front: &Front, vertices: &Vertices, [_, a, b]: [VertexId; 3]) -> Option<(VertexId, DVec3)> {
    // Neighbours run through a common edge in opposite directions, this one from b to a. Of its two ends the one with
    // fewer open faces is searched.
    let from_a = vertices[a].list.count() <= vertices[b].list.count();
    let ends = if from_a { [a, b] } else { [b, a] };
    let (face, vertex) = front.across(vertices, ends, SCAN as u32, from_a)?;
    Some((vertex, front.face(face).normal))
}

fn add_candidate(candidates: &mut [Option<Candidate>; 3], vertex: VertexId, cos: f64) {
    for slot in candidates {
        match slot {
            Some(known) if known.vertex == vertex => {
                known.edges += 1;
                known.cos = known.cos.max(cos);
                return;
            }
            Some(_) => {}
            None => {
                *slot = Some(Candidate { vertex, cos, edges: 1 });
                return;
            }
        }
    }
}

/// Codes what lies behind `gate`. `truth` is what the writer knows; the parser's is ignored.
///
/// # Errors
/// A reference to a vertex that does not exist.
pub(super) fn code_apex(
    coder: &mut impl BitCoder,
    (models, rings): (&mut ConnectivityModels, &mut Rings),
    (front, vertices): (&Front, &Vertices),
    gate: &Gate,
    truth: Apex,
) -> Result<Apex, MeshFault> {
    coder.enter(Part::Connectivity);
    let mut first = (0, 0);
    let mut count = 0;
    for (place, candidate) in gate.candidates.iter().flatten().enumerate() {
        let (angle, range) = (angle_class(candidate.cos), gate.range(vertices, candidate.vertex));
        let model = &mut models.join[place][candidate.edges - 1][angle][range];
        if coder.bit(model, truth == Apex::Known(candidate.vertex)) {
            return Ok(Apex::Known(candidate.vertex));
        }
        if place == 0 {
            first = (angle, range);
        }
        count = place + 1;
    }
    if coder.bit(&mut models.new[count][first.0][first.1], truth == Apex::New) {
        return Ok(Apex::New);
    }
    let near = |rings: &mut Rings| Ranking::new(vertices, gate, rings.near(front, vertices, gate));
    if let Some(near) = code_rank(coder, &mut models.near, || near(rings), truth)? {
        return Ok(Apex::Known(near));
    }
    if coder.bit(&mut models.nothing, matches!(truth, Apex::Hole | Apex::Top)) {
        return Ok(if coder.bit(&mut models.top, truth == Apex::Top) { Apex::Top } else { Apex::Hole });
    }
    let far = |rings: &mut Rings| Ranking::new(vertices, gate, rings.far(front, vertices, gate));
    if let Some(far) = code_rank(coder, &mut models.far, || far(rings), truth)? {
        return Ok(Apex::Known(far));
    }
    let known = if let Apex::Known(v) = truth { v } else { VertexId(0) };
    code_vertex_id(coder, known, vertices.len() as u32).map(Apex::Known)
}

/// Codes which of the `ranked` vertices the apex is, if it is one of them. They are not asked for in vain: to rank them
/// takes time.
fn code_rank<'a>(
    coder: &mut impl BitCoder,
    model: &mut UintModel,
    mut ranked: impl FnMut() -> Ranking<'a>,
    truth: Apex,
) -> Result<Option<VertexId>, MeshFault> {
    let rank = match truth {
        Apex::Known(apex) => ranked().position(|v| v == apex).map_or(0, |place| place as u32 + 1),
        _ => 0,
    };
    let rank = model.code(coder, rank);
    let Some(place) = rank.checked_sub(1) else { return Ok(None) };
    let mut expected = 0;
    let found = ranked().inspect(|_| expected += 1).nth(place as usize);
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
