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

use glam::{DVec3, IVec3};

use super::MeshFault;
use super::bits::Part;
use super::extents::{Extents, PARTS};
use super::front::Front;
use super::near::{far_vertices, near_vertices};
use super::range_coder::{BitCoder, BitModel};
use super::symbols::UintModel;
use crate::mesh::{TetMesh, VertexId, volume6};

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
}

impl Gate {
    pub(super) fn has_candidate(&self, vertex: VertexId) -> bool {
        self.candidates.iter().flatten().any(|c| c.vertex == vertex)
    }

    /// Whether the tet of the gate and `apex` is positive.
    pub(super) fn is_positive(&self, mesh: &TetMesh, apex: VertexId) -> bool {
        is_positive(mesh, self.corners, apex)
    }

    /// Square of the distance of a vertex from the gate's centre, in extents.
    pub(super) fn distance2(&self, mesh: &TetMesh, vertex: VertexId) -> f64 {
        let at = |v: VertexId| mesh.positions[v.index()];
        let [a, b, c] = self.corners.map(at);
        let d = (3 * at(vertex) - (a + b + c)).as_dvec3() / self.extent.as_dvec3();
        f64::from(PARTS * PARTS) * (d.x * d.x + d.y * d.y + d.z * d.z)
    }

    /// Class of that distance.
    fn range(&self, mesh: &TetMesh, vertex: VertexId) -> usize {
        let distance2 = self.distance2(mesh, vertex);
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

/// Whether the tet of `corners` and `apex` is positive.
#[inline]
fn is_positive(mesh: &TetMesh, [a, b, c]: [VertexId; 3], apex: VertexId) -> bool {
    let at = |v: VertexId| mesh.positions[v.index()];
    volume6(at(a), at(b), at(c), at(apex)) > 0
}

/// Cosine of the angle between two open faces with a common edge and these unit normals, measured on the open side;
/// angles beyond 180 degrees are the caller's to exclude.
fn gap_cos(n: DVec3, m: DVec3) -> f64 {
    -(n.x * m.x + n.y * m.y + n.z * m.z)
}

/// The youngest open faces of a vertex, as columns: they are compared all with all.
#[derive(Debug, Clone)]
pub(super) struct Fan {
    count: usize,
    faces: [u32; SCAN],
    /// The corner after the focus, anticlockwise.
    second: [VertexId; SCAN],
    /// The corner before it.
    third: [VertexId; SCAN],
    normals: [DVec3; SCAN],
}

impl Fan {
    pub(super) const NEW: Self = Self {
        count: 0,
        faces: [0; SCAN],
        second: [VertexId(0); SCAN],
        third: [VertexId(0); SCAN],
        normals: [DVec3::ZERO; SCAN],
    };

    fn gather(&mut self, front: &Front, focus: VertexId) {
        self.count = 0;
        for (face, [_, second, third]) in front.at(focus).take(SCAN) {
            let place = self.count;
            self.faces[place] = face;
            self.second[place] = second;
            self.third[place] = third;
            self.normals[place] = front.face(face).normal;
            self.count += 1;
        }
    }

    /// The youngest face that follows face `place` around the focus.
    fn next(&self, place: usize) -> Option<usize> {
        let wanted = self.third[place];
        self.second[..self.count].iter().position(|&second| second == wanted)
    }

    /// The youngest face that comes before face `place` around the focus.
    fn previous(&self, place: usize) -> Option<usize> {
        let wanted = self.second[place];
        self.third[..self.count].iter().position(|&third| third == wanted)
    }

    /// The face before the sharpest gap; without a gap below 180 degrees the youngest.
    fn sharpest(&self, mesh: &TetMesh, focus: VertexId) -> usize {
        let (mut best, mut best_cos) = (0, f64::NEG_INFINITY);
        for place in 0..self.count {
            let Some(next) = self.next(place) else { continue };
            let cos = gap_cos(self.normals[place], self.normals[next]);
            let corners = [focus, self.second[place], self.third[place]];
            if cos > best_cos && is_positive(mesh, corners, self.third[next]) {
                (best, best_cos) = (place, cos);
            }
        }
        best
    }
}

/// The open face at `focus` to close next: the one before the sharpest gap at an edge of `focus`, going around it
/// anticlockwise. `None`: all faces at `focus` are closed. `fan` is room to work in.
pub(super) fn choose_gate(
    fan: &mut Fan,
    (front, mesh): (&Front, &TetMesh),
    extents: &Extents,
    focus: VertexId,
) -> Option<Gate> {
    fan.gather(front, focus);
    if fan.count == 0 {
        return None;
    }
    let place = fan.sharpest(mesh, focus);
    let corners = [focus, fan.second[place], fan.third[place]];
    let across = [
        fan.next(place).map(|next| (fan.third[next], fan.normals[next])),
        fan.previous(place).map(|previous| (fan.second[previous], fan.normals[previous])),
        find_opposite(front, corners),
    ];
    let mut candidates: [Option<Candidate>; 3] = [None; 3];
    for (vertex, normal) in across.into_iter().flatten() {
        if is_positive(mesh, corners, vertex) {
            add_candidate(&mut candidates, vertex, gap_cos(fan.normals[place], normal));
        }
    }
    // Those of several edges first, then by angle. Stable: ties keep the order of edges.
    candidates.sort_by(|a, b| {
        let key = |c: &Option<Candidate>| c.map_or((0, f64::NEG_INFINITY), |c| (c.edges, c.cos));
        let (a, b) = (key(a), key(b));
        b.0.cmp(&a.0).then(b.1.total_cmp(&a.1))
    });
    Some(Gate {
        face: fan.faces[place],
        corners,
        extent: extents.around(corners),
        across: across.map(|found| found.map(|(vertex, _)| vertex)),
        candidates,
    })
}

/// The vertex and the normal of the youngest open face across the gate's edge opposite the focus.
fn find_opposite(front: &Front, [_, a, b]: [VertexId; 3]) -> Option<(VertexId, DVec3)> {
    // Neighbours run through a common edge in opposite directions, this one from b to a. Of its two ends the one with
    // fewer open faces is searched.
    let from_a = front.count(a) <= front.count(b);
    let (start, end) = if from_a { (a, b) } else { (b, a) };
    let turned = |[_, second, third]: [VertexId; 3]| if from_a { (third, second) } else { (second, third) };
    let mut faces = front.at(start).take(SCAN).map(|(face, corners)| (face, turned(corners)));
    let (face, (_, vertex)) = faces.find(|&(_, (across, _))| across == end)?;
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
    models: &mut ConnectivityModels,
    (front, mesh): (&Front, &TetMesh),
    gate: &Gate,
    truth: Apex,
) -> Result<Apex, MeshFault> {
    coder.enter(Part::Connectivity);
    let mut first = (0, 0);
    let mut count = 0;
    for (place, candidate) in gate.candidates.iter().flatten().enumerate() {
        let (angle, range) = (angle_class(candidate.cos), gate.range(mesh, candidate.vertex));
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
    if let Some(near) = code_rank(coder, &mut models.near, &near_vertices(front, mesh, gate), truth)? {
        return Ok(Apex::Known(near));
    }
    if coder.bit(&mut models.nothing, matches!(truth, Apex::Hole | Apex::Top)) {
        return Ok(if coder.bit(&mut models.top, truth == Apex::Top) { Apex::Top } else { Apex::Hole });
    }
    if let Some(far) = code_rank(coder, &mut models.far, &far_vertices(front, mesh, gate), truth)? {
        return Ok(Apex::Known(far));
    }
    let known = if let Apex::Known(v) = truth { v } else { VertexId(0) };
    code_vertex_id(coder, known, mesh.positions.len() as u32).map(Apex::Known)
}

/// Codes which of the `ranked` vertices the apex is, if it is one of them.
fn code_rank(
    coder: &mut impl BitCoder,
    model: &mut UintModel,
    ranked: &[VertexId],
    truth: Apex,
) -> Result<Option<VertexId>, MeshFault> {
    let rank = ranked.iter().position(|&v| truth == Apex::Known(v)).map_or(0, |place| place as u32 + 1);
    let rank = model.code(coder, rank);
    let Some(place) = rank.checked_sub(1) else { return Ok(None) };
    let expected = ranked.len() as u32;
    let fault = MeshFault::Reference { field: "vertex near the gate", expected, found: place };
    ranked.get(place as usize).copied().map(Some).ok_or(fault)
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
