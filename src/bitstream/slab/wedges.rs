//! Labels and wedges of the tets of a growing slab.
//!
//! In: a tet's corners. Out: its label and wedges, coded where they are new. Forbidden here: moving the front.

use crate::bitstream::MeshFault;
use glam::Vec3;

use crate::bitstream::colors::{Around, KnownColor, code_color, from_grains};
use crate::bitstream::extents::size_of;
use crate::bitstream::labels::{LabelContext, code_label};
use crate::bitstream::vertices::Wedges;
use crate::mesh::{VertexId, Wedge, WedgeId};
use crate::video::Label;

use super::{Side, Slab};

/// Labels that may meet at one vertex; bounds the time to find one of its wedges.
const MAX_WEDGES_A_VERTEX: u16 = 1 << 8;

/// Wedges of a corner that are looked at to find candidates for a label.
const LABEL_SCAN: usize = 8;

/// Tets around a vertex that are looked at to predict a colour.
const STAR_SCAN: u32 = 256;

impl Slab {
    /// Codes the label of the tet with these corners; `facing` are the open faces that it will close.
    pub(super) fn code_tet_label(
        &mut self,
        side: &mut impl Side,
        corners: [VertexId; 4],
        gate: Option<u32>,
        facing: [Option<u32>; 4],
    ) -> Result<u32, MeshFault> {
        let label_of = |face: u32| self.front.face(face).behind.label;
        let mut context = LabelContext { before: gate.map(label_of), ..LabelContext::default() };
        for other in facing.into_iter().flatten().filter(|&face| Some(face) != gate) {
            if Some(label_of(other)) == context.before {
                context.agreeing = (context.agreeing + 1).min(3);
            } else {
                context.differing = (context.differing + 1).min(3);
            }
        }
        // Other labels with the number of corners that have them.
        let mut others = [(0, 0); 4 * LABEL_SCAN];
        let mut length = 0;
        for (corner, vertex) in corners.into_iter().enumerate() {
            let known = self.vertices[vertex].wedges;
            context.boundary_corners += usize::from(corner < 3 && known.count > 1);
            if known.count == 1 && Some(known.label) == context.before {
                continue;
            }
            for (_, label) in self.wedges_at(vertex).take(LABEL_SCAN) {
                if Some(label) == context.before {
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
        context.candidates = &others[..length];
        let count = self.last_wedge.len() as u32;
        let truth = side.label(count);
        let label = code_label(side, &mut self.models.labels, &context, count, truth)?;
        if label >= self.limits.max_labels {
            return Err(MeshFault::TooMany { field: "labels", limit: self.limits.max_labels });
        }
        Ok(label)
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

    /// The wedge of `vertex` that has this label.
    fn wedge_of(&self, vertex: VertexId, label: u32) -> Option<u32> {
        let known = self.vertices[vertex].wedges;
        if known.count > 0 && known.label == label {
            return Some(known.youngest);
        }
        self.wedges_at(vertex).find(|&(_, other)| other == label).map(|(wedge, _)| wedge)
    }

    /// The tet's wedges; codes the colours of those that do not exist yet.
    pub(super) fn code_wedges(
        &mut self,
        side: &mut impl Side,
        corners: [VertexId; 4],
        label: u32,
    ) -> Result<[WedgeId; 4], MeshFault> {
        let mut wedges = [None; 4];
        for (slot, vertex) in wedges.iter_mut().zip(corners) {
            *slot = self.wedge_of(vertex, label);
            if slot.is_none() && self.vertices[vertex].wedges.count >= MAX_WEDGES_A_VERTEX {
                return Err(MeshFault::TooMany { field: "labels at a vertex", limit: MAX_WEDGES_A_VERTEX.into() });
            }
        }
        for (slot, vertex) in wedges.iter_mut().zip(corners) {
            if slot.is_none() {
                *slot = Some(self.push_wedge(vertex, label)?);
                side.wedge_made(vertex);
            }
        }
        Ok(wedges.map(|w| WedgeId(w.unwrap_or(0))))
    }

    fn push_wedge(&mut self, vertex: VertexId, label: u32) -> Result<u32, MeshFault> {
        if self.mesh.wedges.len() >= self.limits.max_wedges as usize {
            return Err(MeshFault::TooMany { field: "wedges", limit: self.limits.max_wedges });
        }
        let wedge = self.mesh.push_wedge(Wedge { vertex, label: Label(label), color: Vec3::ZERO });
        let known = &mut self.vertices[vertex].wedges;
        self.wedge_next.push(known.youngest);
        *known = Wedges { youngest: wedge.0, label, count: known.count + 1 };
        match self.last_wedge.get_mut(label as usize) {
            Some(last) => *last = wedge.0,
            None => self.last_wedge.push(wedge.0),
        }
        Ok(wedge.0)
    }

    /// Codes the colours of all wedges that have none yet.
    pub(super) fn code_colors(&mut self, side: &mut impl Side) -> Result<(), MeshFault> {
        for wedge in self.known.len()..self.mesh.wedges.len() {
            side.check()?;
            let around = self.around(wedge);
            let step = self.color_steps.at(size_of(self.vertices[self.mesh.wedges[wedge].vertex].extent));
            let truth = side.color(wedge, step);
            let (color, misses) = code_color(side, &mut self.models.colors, &around, step, truth)?;
            self.mesh.wedges[wedge].color = from_grains(color);
            self.known.push(KnownColor::new(color, misses));
        }
        Ok(())
    }

    /// What the colour of the next wedge is predicted from.
    fn around(&self, wedge: usize) -> Around {
        let mut around = Around::default();
        let Wedge { vertex, .. } = self.mesh.wedges[wedge];
        for tet in self.stars.runs(self.vertices[vertex].star, STAR_SCAN).flatten() {
            let wedges = self.mesh.tets[*tet as usize].map(WedgeId::index);
            if !wedges.contains(&wedge) {
                continue;
            }
            // Taken in as nothing, not passed over: whether a wedge is known is as good as random.
            for other in wedges {
                around.add(self.known.get(other).copied().unwrap_or_default());
            }
        }
        if around.is_empty() && wedge > 0 {
            around.add(self.known[wedge - 1].without_misses());
        }
        around
    }
}
