//! Labels and wedges of the tets of a growing slab.
//!
//! In: a tet's corners. Out: its label and wedges, coded where they are new. Forbidden here: moving the front.

use crate::bitstream::MeshFault;
use glam::Vec3;

use crate::bitstream::colors::{Around, KnownColor, code_color, from_grains};
use crate::bitstream::extents::size;
use crate::bitstream::front::{Corner, Met};
use crate::bitstream::labels::SameContext;
use crate::bitstream::vertices::Wedges;
use crate::mesh::{EDGES, VertexId, Wedge, WedgeId};
use crate::video::Label;

use super::{Side, Slab};

/// Labels that may meet at one vertex; bounds the time to find one of its wedges.
const MAX_WEDGES_A_VERTEX: u16 = 1 << 8;

/// Wedges of a corner that are looked at to find candidates for a label.
const LABEL_SCAN: usize = 8;

/// Neighbours of a wedge that its colour is predicted from, at most.
const NEIGHBOUR_SCAN: usize = 256;

/// All edges of a tet, as bits.
const ALL_EDGES: u8 = 0b111111;

/// Which of them each face has, as bits.
const FACE_EDGES: [u8; 4] = [0b111000, 0b100110, 0b010101, 0b001011];

impl Slab {
    /// Codes the label of the tet with these corners, `before` being the label before its gate.
    #[inline]
    pub(super) fn code_tet_label(
        &mut self,
        side: &mut impl Side,
        corners: [VertexId; 4],
        before: Option<u32>,
        closed: &[Option<u32>; 3],
    ) -> Result<u32, MeshFault> {
        if let Some(before) = before.filter(|_| self.is_uniform) {
            return Ok(before);
        }
        let count = self.labels;
        let truth = side.label(count);
        if let Some(before) = before {
            let context = self.label_context(corners, before, closed);
            if self.models.labels.code_same(side, context, truth == before) {
                return Ok(before);
            }
        }
        let mut others = [(0, 0); 4 * LABEL_SCAN];
        let others = self.other_labels(corners, before, &mut others);
        let label = self.models.labels.code_other(side, others, count, truth)?;
        if label >= self.limits.max_labels {
            return Err(MeshFault::TooMany { field: "labels", limit: self.limits.max_labels });
        }
        Ok(label)
    }

    /// What tells whether the tet has the label before its gate.
    #[inline]
    fn label_context(&self, [a, b, c, _]: [VertexId; 4], before: u32, closed: &[Option<u32>; 3]) -> SameContext {
        let agreeing = closed.iter().filter(|&&label| label == Some(before)).count();
        let is_boundary = |vertex: VertexId| usize::from(self.vertices[vertex].wedges.count > 1);
        SameContext {
            boundary_corners: is_boundary(a) + is_boundary(b) + is_boundary(c),
            agreeing,
            differing: closed.iter().flatten().count() - agreeing,
        }
    }

    /// Labels at the corners but for the one before the gate, with the number of corners that have them: the most likely
    /// first.
    #[inline(never)]
    fn other_labels<'a>(
        &self,
        corners: [VertexId; 4],
        before: Option<u32>,
        others: &'a mut [(u32, u32); 4 * LABEL_SCAN],
    ) -> &'a [(u32, u32)] {
        let mut length = 0;
        for vertex in corners {
            for (_, label) in self.wedges_at(vertex).take(LABEL_SCAN) {
                if Some(label) == before {
                    continue;
                }
                match others[..length].iter_mut().find(|(known, _)| *known == label) {
                    Some((_, count)) => *count += 1,
                    None => {
                        others[length] = (label, 1);
                        length += 1;
                    }
                }
            }
        }
        others[..length].sort_unstable_by_key(|&(label, count)| (u32::MAX - count, label));
        &others[..length]
    }

    /// Wedges of `vertex` and their labels, the youngest first.
    fn wedges_at(&self, vertex: VertexId) -> impl Iterator<Item = (u32, u32)> + '_ {
        let Wedges { youngest, label, .. } = self.vertices[vertex].wedges;
        let mut next = (youngest, label);
        std::iter::from_fn(move || {
            let found = next;
            let older = *self.wedge_next.get(found.0 as usize)?;
            next = (older, self.mesh.wedges.get(older as usize).map_or(0, |wedge| wedge.label.0));
            Some(found)
        })
    }

    /// The tet's wedges; those that do not exist yet are made.
    #[inline(always)]
    pub(super) fn code_wedges(
        &mut self,
        side: &mut impl Side,
        corners: [VertexId; 4],
        label: u32,
    ) -> Result<[WedgeId; 4], MeshFault> {
        let mut wedges = [WedgeId(0); 4];
        for (slot, vertex) in wedges.iter_mut().zip(corners) {
            let known = self.vertices[vertex].wedges;
            let wedge = if known.count > 0 && known.label == label {
                known.youngest
            } else {
                self.find_or_make_wedge(side, vertex, label)?
            };
            *slot = WedgeId(wedge);
        }
        Ok(wedges)
    }

    #[inline(never)]
    fn find_or_make_wedge(&mut self, side: &mut impl Side, vertex: VertexId, label: u32) -> Result<u32, MeshFault> {
        if let Some((wedge, _)) = self.wedges_at(vertex).find(|&(_, other)| other == label) {
            return Ok(wedge);
        }
        if self.vertices[vertex].wedges.count >= MAX_WEDGES_A_VERTEX {
            return Err(MeshFault::TooMany { field: "labels at a vertex", limit: MAX_WEDGES_A_VERTEX.into() });
        }
        let wedge = self.push_wedge(vertex, label)?;
        side.wedge_made(vertex);
        Ok(wedge)
    }

    fn push_wedge(&mut self, vertex: VertexId, label: u32) -> Result<u32, MeshFault> {
        if self.mesh.wedges.len() >= self.limits.max_wedges as usize {
            return Err(MeshFault::TooMany { field: "wedges", limit: self.limits.max_wedges });
        }
        let wedge = self.mesh.push_wedge(Wedge { vertex, label: Label(label), color: Vec3::ZERO });
        let known = &mut self.vertices[vertex].wedges;
        self.wedge_next.push(known.youngest);
        self.neighbours.push_wedge();
        *known = Wedges { youngest: wedge.0, label, count: known.count + 1 };
        self.labels = self.labels.max(label + 1);
        Ok(wedge.0)
    }

    /// Labels before the faces that a tet closes but for the gate.
    pub(super) fn closed_labels(&self, met: &Met) -> [Option<u32>; 3] {
        met.closed.map(|face| face.is_some().then(|| self.front.before(face).label))
    }

    /// Notes which wedges of a tet are neighbours from now on: those of edges that no tet before it has, as far as the
    /// faces tell that it closes; `closed` are the labels before them.
    #[inline(never)]
    pub(super) fn note_neighbours(&mut self, wedges: [WedgeId; 4], label: u32, closed: &[Option<u32>; 4]) {
        let mut known = 0;
        for (closed, edges) in closed.iter().zip(FACE_EDGES) {
            known |= if *closed == Some(label) { edges } else { 0 };
        }
        let mut new = !known & ALL_EDGES;
        while new != 0 {
            let [a, b] = EDGES[new.trailing_zeros() as usize % EDGES.len()];
            new &= new - 1;
            self.neighbours.push(wedges[a].0, wedges[b].0);
        }
    }

    /// The same of a tet behind a gate where there is one label: the edges to the apex that no closed face has.
    #[inline(always)]
    pub(super) fn note_spokes(&mut self, [a, b, c, apex]: [WedgeId; 4], met: &Met) {
        let [first, second, third] = met.closed.map(Corner::is_some);
        for (wedge, is_known) in [(a, second | third), (b, third | first), (c, first | second)] {
            if !is_known {
                self.neighbours.push(wedge.0, apex.0);
            }
        }
    }

    /// Codes the colours of all wedges that have none yet.
    pub(super) fn code_colors(&mut self, side: &mut impl Side) -> Result<(), MeshFault> {
        for wedge in self.known.len()..self.mesh.wedges.len() {
            side.check()?;
            let around = self.around(wedge);
            let step = self.color_steps.at(size(self.vertices[self.mesh.wedges[wedge].vertex].extent));
            let truth = side.color(wedge, step);
            let (color, misses) = code_color(side, &mut self.models.colors, &around, step, truth)?;
            self.mesh.wedges[wedge].color = from_grains(color);
            self.known.push(KnownColor::new(color, misses));
        }
        self.neighbours.clear(self.mesh.wedges.len() as u32);
        Ok(())
    }

    /// What the colour of the next wedge is predicted from.
    fn around(&self, wedge: usize) -> Around {
        let mut around = Around::default();
        for other in self.neighbours.of(wedge as u32).take(NEIGHBOUR_SCAN) {
            around.add(self.known[other as usize]);
        }
        if around.is_empty() && wedge > 0 {
            around.add(self.known[wedge - 1].without_misses());
        }
        around
    }
}
