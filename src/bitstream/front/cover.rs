//! The front moves over a new tet.
//!
//! In: a tet behind a gate, and which of its other faces lie on the box. Out: the front with the tet behind it.
//! Forbidden here: coding.
//!
//! Around an edge, runs of tets and gaps take turns; partners are the two open faces on both sides of a gap. A tet that
//! fills a part of a gap passes it on from one of its two faces there to the other: if such a face closes an open one,
//! that one's partner is what lies beyond; if it opens, the new face itself. An edge that the front has elsewhere and now
//! has once more gets two gaps, each between a new face and an old one.

use glam::Vec3A;

use super::rows::{Row, enlist, pair, pair_as, unlist};
use super::{Before, Corner, Front, WIDE};
use crate::bitstream::MeshFault;
use crate::bitstream::extents;
use crate::bitstream::gate::Gate;
use crate::bitstream::normals::{cross, unit_normal};
use crate::bitstream::vertices::{Linked, Vertices};
use crate::mesh::VertexId;

/// Open faces of a vertex that are looked at to find those that a tet meets. No stream can make a search long.
const SCAN: usize = 128;

/// Corners of a tet's faces but for the gate: where each has an edge of the gate, from and to; the third is the apex.
const SIDES: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

/// A tet behind a gate, or a seed.
#[derive(Debug, Clone, Copy)]
pub(in crate::bitstream) struct NewTet {
    pub(in crate::bitstream) number: u32,
    pub(in crate::bitstream) label: u32,
    /// Its corners, the apex last.
    pub(in crate::bitstream) corners: [VertexId; 4],
    /// The sides of the box that they lie on, as bits.
    pub(in crate::bitstream) sides: [u8; 4],
    /// Where the lists of their open faces end.
    pub(in crate::bitstream) ends: [Corner; 4],
    /// Extents there.
    pub(in crate::bitstream) extents: [Vec3A; 4],
    /// From the apex to the others.
    pub(in crate::bitstream) edges: [Vec3A; 3],
}

/// What of the front a tet behind a gate meets.
#[derive(Debug, Clone, Copy)]
pub(in crate::bitstream) struct Met {
    /// The mirror image of each face but for the gate, which the tet closes: its corner at the apex.
    pub(in crate::bitstream) closed: [Corner; 3],
    /// Whether there is an open face just like each.
    is_there: [bool; 3],
    /// Where no face that has it is closed: the edge from each corner of the gate to the apex, or back, that is there
    /// already.
    spokes: [Corner; 3],
}

/// What lies beyond a face of the new tet at each of its edges: that from the gate, that to the apex, that from there.
type Beyond = [Corner; 3];

impl Met {
    /// A tet with a new vertex meets nothing.
    pub(in crate::bitstream) const NOTHING: Self =
        Self { closed: [Corner::NONE; 3], is_there: [false; 3], spokes: [Corner::NONE; 3] };
}

impl Front {
    /// What a tet behind a gate with a known apex meets.
    ///
    /// Where the apex lies across edges of the gate, these tell. Across one only, or none, the far ends of the edge that
    /// is new may have it elsewhere on the front: only if the two have had an edge before.
    #[inline(always)]
    pub(in crate::bitstream) fn meet(&self, vertices: &Vertices, gate: &Gate, apex: VertexId) -> Met {
        let [first, second, third] = gate.corners;
        let mut met = Met::NOTHING;
        let mut count = 0;
        let mut far = apex;
        // The order of the gate's edges is another one than that of the tet's faces.
        for (face, edge, opposite) in [(0, 2, first), (1, 0, second), (2, 1, third)] {
            let is_closed = gate.across[edge] == apex;
            met.closed[face] = if is_closed { gate.opposite[edge] } else { Corner::NONE };
            count += u32::from(is_closed);
            far = if is_closed { opposite } else { far };
        }
        let others = [first, second, third].map(Linked::one);
        let wanted = match count {
            0 => others[0].with(others[1]).with(others[2]),
            1 => Linked::one(apex),
            _ => Linked::NOTHING,
        };
        if vertices[far].linked.may_meet(wanted) {
            self.look_around(vertices, [first, second, third, apex], far, &mut met);
        }
        met
    }

    /// Looks for open faces at `far` that share more with a tet than that vertex: it is the apex, or the corner of the gate
    /// that only the edge to the apex leads to.
    #[inline(never)]
    fn look_around(&self, vertices: &Vertices, corners: [VertexId; 4], far: VertexId, met: &mut Met) {
        let apex = corners[3];
        for corner in self.at(vertices, far).take(SCAN) {
            let [_, second, third] = self.vertices_from(corner);
            let shares = if far == apex {
                corners[..3].contains(&second) || corners[..3].contains(&third)
            } else {
                (second == apex) | (third == apex)
            };
            if shares {
                self.take_note(corners, corner, met);
            }
        }
    }

    /// Notes what an open face that has the apex shares with the tet; of several such the youngest counts.
    #[cold]
    fn take_note(&self, corners: [VertexId; 4], corner: Corner, met: &mut Met) {
        let apex = corners[3];
        let Some(at_apex) =
            [corner, corner.next(), corner.previous()].into_iter().find(|&corner| self.vertex(corner) == apex)
        else {
            return;
        };
        let [_, next, before] = self.vertices_from(at_apex);
        for (place, vertex) in corners[..3].iter().enumerate() {
            for (edge, end) in [(at_apex, next), (at_apex.previous(), before)] {
                if end == *vertex && !met.spokes[place].is_some() {
                    met.spokes[place] = edge;
                }
            }
        }
        for (face, [from, to]) in SIDES.into_iter().enumerate() {
            let [from, to] = [corners[from], corners[to]];
            if [next, before] == [to, from] && !met.closed[face].is_some() {
                met.closed[face] = at_apex;
            }
            met.is_there[face] |= [next, before] == [from, to];
        }
    }

    /// Opens the last face of a seed, a tet that no face leads to, and the gate that the tet is then behind: two sides of a
    /// sheet. Returns the gate's corner at the first vertex.
    pub(in crate::bitstream) fn sow(&mut self, tet: &NewTet) -> Corner {
        let [a, b, c, opposite] = tet.corners;
        let before = Before { tet: tet.number, label: tet.label, opposite };
        let [at_a, at_b, at_c] = [(a, tet.ends[0]), (b, tet.ends[1]), (c, tet.ends[2])];
        self.reserve(2);
        let Self { rows, normals, free, .. } = self;
        let gate = open(rows, normals, free, [at_a, at_b, at_c], Vec3A::ZERO, before);
        if tet.sides[0] & tet.sides[1] & tet.sides[2] == 0 {
            let [to_a, to_b, to_c] = tet.edges;
            let [of_a, of_b, of_c, _] = tet.extents;
            let normal = unit_normal(cross(to_a - to_b, to_c - to_b), extents::around([of_a, of_b, of_c]));
            let back = open(rows, normals, free, [at_a, at_c, at_b], normal, before);
            pair(rows, gate, back.previous());
            pair(rows, gate.next(), back.next());
            pair(rows, gate.previous(), back);
        }
        gate
    }

    /// Moves the front over a tet behind a gate (its corner at the first vertex): takes out the faces that the tet closes,
    /// adds those that it opens, and pairs the edges.
    ///
    /// # Errors
    /// An open face that is there already.
    #[inline(never)]
    pub(in crate::bitstream) fn cover(&mut self, tet: &NewTet, gate: Corner, met: &Met) -> Result<(), MeshFault> {
        // One of three comes from the gate.
        self.reserve(2);
        let (rows, normals, free) = (&mut self.rows[..], &mut self.normals[..], &mut self.free);
        let [at_gate, at_next, at_previous] = unlist(rows, gate);
        free.push(gate.face() as u32);
        let gate_beyond = [at_next, at_previous, at_gate];
        let beyond = [
            pass_side(rows, normals, free, tet, met, (0, 1, 2))?,
            pass_side(rows, normals, free, tet, met, (1, 2, 0))?,
            pass_side(rows, normals, free, tet, met, (2, 0, 1))?,
        ];
        for (face, (beyond_gate, [beyond, ..])) in gate_beyond.into_iter().zip(beyond).enumerate() {
            // A gap that the tet fills has no sides any more: its two faces there close both.
            let closed = met.closed[face];
            if !(closed.is_some() & (beyond_gate == closed.next())) {
                pair(rows, beyond_gate, beyond);
            }
        }
        join_spoke(rows, tet, met, (0, 1, 2), &beyond);
        join_spoke(rows, tet, met, (1, 2, 0), &beyond);
        join_spoke(rows, tet, met, (2, 0, 1), &beyond);
        Ok(())
    }
}

/// Takes out the open face that a face of a tet closes, or opens that face unless it lies on the box: it has the gate's
/// edge `from`, `to` and the apex. Returns what lies beyond.
#[inline(always)]
fn pass_side(
    rows: &mut [Row],
    normals: &mut [Vec3A],
    free: &mut Vec<u32>,
    tet: &NewTet,
    met: &Met,
    (face, from, to): (usize, usize, usize),
) -> Result<Beyond, MeshFault> {
    let closed = met.closed[face];
    if closed.is_some() {
        let [at_apex, at_next, at_previous] = unlist(rows, closed);
        free.push(closed.face() as u32);
        return Ok([at_next, at_apex, at_previous]);
    }
    if tet.sides[from] & tet.sides[to] & tet.sides[3] != 0 {
        return Ok([Corner::NONE; 3]);
    }
    if met.is_there[face] {
        return Err(MeshFault::DuplicateFace { face: [from, to, 3].map(|corner| tet.corners[corner].0) });
    }
    let extent = extents::around([tet.extents[from], tet.extents[to], tet.extents[3]]);
    let normal = unit_normal(cross(tet.edges[from], tet.edges[to]), extent);
    let before = Before { tet: tet.number, label: tet.label, opposite: tet.corners[face] };
    // Not mapped: such small functions are not always inlined.
    let at_apex = (tet.corners[3], tet.ends[3]);
    let corners = [(tet.corners[from], tet.ends[from]), (tet.corners[to], tet.ends[to]), at_apex];
    let opened = open(rows, normals, free, corners, normal, before);
    Ok([opened, Corner(opened.0 + 1), Corner(opened.0 + 2)])
}

/// Adds an open face in place of one that is free: its vertices, each with the end of its list, and its normal. Its edges
/// have no partners yet. Returns its first corner.
#[inline(always)]
fn open(
    rows: &mut [Row],
    normals: &mut [Vec3A],
    free: &mut Vec<u32>,
    [a, b, c]: [(VertexId, Corner); 3],
    normal: Vec3A,
    before: Before,
) -> Corner {
    let first = Corner::first_of(free.pop().unwrap_or_default());
    normals[first.face()] = normal;
    let (second, third) = (Corner(first.0 + 1), Corner(first.0 + 2));
    rows.as_chunks_mut::<4>().0[first.face()] =
        [enlist(rows, first, a), enlist(rows, second, b), enlist(rows, third, c), before.to_row()];
    first
}

/// Pairs what lies beyond both faces at the edge from the gate's corner `place` to the apex: `towards`
/// has the edge so, `from` the other way.
#[inline(always)]
fn join_spoke(
    rows: &mut [Row],
    tet: &NewTet,
    met: &Met,
    (place, towards, from): (usize, usize, usize),
    beyond: &[Beyond; 3],
) {
    let (one, other) = (beyond[towards][1], beyond[from][2]);
    let (is_closed, is_other_closed) = (met.closed[towards].is_some(), met.closed[from].is_some());
    if is_closed | is_other_closed {
        if !(is_closed & is_other_closed & (one == met.closed[from].previous())) {
            pair(rows, one, other);
        }
    } else if met.spokes[place].is_some() {
        pair_crosswise(rows, tet.corners[place], met.spokes[place], one, other);
    } else {
        // What is left around the edge of a tet is more than 180 degrees.
        pair_as(rows, one, other, WIDE);
    }
}

/// Pairs the edges of two new faces, the one from `start` on and the one that runs back, with those of two faces that were
/// there: `known` is one of them.
#[cold]
fn pair_crosswise(rows: &mut [Row], start: VertexId, known: Corner, one: Corner, other: Corner) {
    let Row { across: partner, .. } = rows[known.index()];
    let (along, back) = if rows[known.index()].vertex() == start { (known, partner) } else { (partner, known) };
    pair(rows, one, back);
    pair(rows, other, along);
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use glam::IVec3;

    use super::*;
    use crate::bitstream::normals::point;
    use crate::mesh::FACES;

    const CELLS: i32 = 3;

    fn vertex([x, y, z]: [i32; 3]) -> VertexId {
        VertexId((x + (CELLS + 1) * (y + (CELLS + 1) * z)) as u32)
    }

    /// Positive tets of a cube of cells, six each around a diagonal.
    fn cube() -> (Vec<IVec3>, Vec<[VertexId; 4]>) {
        let side = 0..=CELLS;
        let positions = side.clone().flat_map(|z| {
            let side = side.clone();
            side.clone().flat_map(move |y| side.clone().map(move |x| IVec3::new(x, y, z)))
        });
        let mut tets = Vec::new();
        for cell in 0..CELLS.pow(3) {
            let origin = [cell % CELLS, cell / CELLS % CELLS, cell / CELLS / CELLS];
            for (axes, is_even) in [
                ([0, 1, 2], true),
                ([1, 2, 0], true),
                ([2, 0, 1], true),
                ([0, 2, 1], false),
                ([1, 0, 2], false),
                ([2, 1, 0], false),
            ] {
                let mut at = origin;
                let mut corners = [vertex(at); 4];
                for (corner, axis) in corners[1..].iter_mut().zip(axes) {
                    at[axis] += 1;
                    *corner = vertex(at);
                }
                let [a, b, c, d] = corners;
                tets.push(if is_even { [a, b, c, d] } else { [a, b, d, c] });
            }
        }
        (positions.collect(), tets)
    }

    /// The face turned so that its lowest vertex comes first.
    fn turned(corners: [VertexId; 3]) -> [VertexId; 3] {
        let [a, b, c] = corners;
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or(corners)
    }

    /// Every open face is listed at its three vertices, and partners are mutual and run opposite ways.
    fn open_faces(front: &Front, vertices: &Vertices) -> BTreeSet<[VertexId; 3]> {
        let mut faces = BTreeSet::new();
        let mut corners = 0;
        for vertex in (0..vertices.len() as u32).map(VertexId) {
            for corner in front.at(vertices, vertex) {
                assert_eq!(front.vertex(corner), vertex);
                let partner = front.across(corner);
                if partner.is_some() {
                    assert_eq!(front.across(partner), corner);
                    assert_eq!(front.vertex(partner.next()), vertex);
                    assert_eq!(front.vertex(partner), front.vertex(corner.next()));
                }
                faces.insert(turned(front.vertices_from(corner)));
                corners += 1;
            }
        }
        assert_eq!(corners, 3 * faces.len());
        faces
    }

    /// The open face with these corners.
    fn find(front: &Front, vertices: &Vertices, [a, b, c]: [VertexId; 3]) -> Option<Corner> {
        front.at(vertices, a).find(|&corner| front.vertices_from(corner) == [a, b, c])
    }

    /// Tets in whatever order, behind whatever face: the front is what a plain set of faces says.
    #[test]
    fn the_front_is_the_boundary_of_what_is_coded() {
        let (positions, mut left) = cube();
        let mut seed = 5u64;
        let mut random = |end: usize| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as usize % end
        };
        // Miri is a thousand times slower.
        left.truncate(if cfg!(miri) { 20 } else { left.len() });
        let (mut front, mut vertices) = (Front::new(), Vertices::default());
        positions.iter().for_each(|&position| vertices.push(point(position), 0, front.push_list()));
        let mut expected = BTreeSet::new();
        while !left.is_empty() {
            let corners = left.swap_remove(random(left.len()));
            let behind = FACES.into_iter().enumerate().find_map(|(face, [a, b, c])| {
                // Seen from before the gate.
                let [a, b, c] = [a, c, b].map(|corner| corners[corner]);
                find(&front, &vertices, [a, b, c]).map(|gate| ([a, b, c, corners[face]], gate))
            });
            let [a, b, c, d] = corners;
            let corners = behind.map_or([a, b, c, d], |(corners, _)| corners);
            let [at_a, at_b, at_c, at_apex] = corners.map(|v| vertices.position(v));
            let tet = NewTet {
                number: 0,
                label: 0,
                corners,
                sides: [0; 4],
                ends: corners.map(|v| vertices[v].open),
                extents: [Vec3A::ONE; 4],
                edges: [at_a, at_b, at_c].map(|corner| corner - at_apex),
            };
            let (gate, met) = match behind {
                Some((corners, gate)) => (gate, front.meet(&vertices, &Gate::new(&front, &vertices, gate), corners[3])),
                None => (front.sow(&tet), Met::NOTHING),
            };
            for (one, other) in corners.into_iter().flat_map(|one| corners.map(|other| (one, other))) {
                vertices[one].linked = vertices[one].linked.with(Linked::one(other));
            }
            front.cover(&tet, gate, &met).expect("faces that are not there");
            for face in FACES {
                let [a, b, c] = face.map(|corner| corners[corner]);
                if !expected.remove(&turned([a, c, b])) {
                    expected.insert(turned([a, b, c]));
                }
            }
            let open = open_faces(&front, &vertices);
            // Faces that meet unseen stay open on both sides.
            let seen = open.iter().filter(|&&[a, b, c]| !open.contains(&turned([a, c, b]))).copied();
            assert!(seen.eq(expected.iter().copied()));
        }
    }
}
