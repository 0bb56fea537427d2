//! Labels and wedges of the tets of a growing slab.
//!
//! In: a tet's corners. Out: its label and wedges, coded where they are new. Forbidden here: moving the front.

use crate::bitstream::MeshFault;
use glam::Vec3;

use crate::bitstream::colors::{Around, code_color, from_grains};
use crate::bitstream::labels::{LabelContext, code_label};
use crate::mesh::{VertexId, Wedge, WedgeId};
use crate::video::Label;

use super::{Side, Slab};

/// Labels that may meet at one vertex; bounds the time to find one of its wedges.
const MAX_WEDGES_A_VERTEX: usize = 1 << 8;

/// Wedges of a corner that are looked at to find candidates for a label.
const LABEL_SCAN: usize = 8;

/// Tets around a vertex that are looked at to predict a colour.
const STAR_SCAN: usize = 256;

impl Slab {
    /// Codes the label of the tet with these corners; `facing` are the open faces that it will close.
    pub(super) fn code_tet_label(
        &mut self,
        side: &mut impl Side,
        corners: [VertexId; 4],
        gate: Option<u32>,
        facing: [Option<u32>; 4],
    ) -> Result<u32, MeshFault> {
        let label_of = |face: u32| self.mesh.tet_label(self.front.face(face).tet as usize).0;
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
            let mut wedges = 0;
            for label in self.wedges_at(vertex).take(LABEL_SCAN).map(|w| self.mesh.wedges[w].label.0) {
                wedges += 1;
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
            context.boundary_corners += usize::from(corner < 3 && wedges > 1);
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

    /// Wedges of `vertex`, the youngest first.
    fn wedges_at(&self, vertex: VertexId) -> impl Iterator<Item = usize> + '_ {
        let mut wedge = self.wedge_head[vertex.index()];
        std::iter::from_fn(move || {
            let found = wedge as usize;
            wedge = *self.wedge_next.get(found)?;
            Some(found)
        })
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
            let mut looked_at = 0;
            *slot = self.wedges_at(vertex).inspect(|_| looked_at += 1).find(|&w| self.mesh.wedges[w].label.0 == label);
            if slot.is_none() && looked_at >= MAX_WEDGES_A_VERTEX {
                return Err(MeshFault::TooMany { field: "labels at a vertex", limit: MAX_WEDGES_A_VERTEX as u32 });
            }
        }
        for (slot, vertex) in wedges.iter_mut().zip(corners) {
            if slot.is_none() {
                *slot = Some(self.push_wedge(vertex, label)?);
                side.wedge_made(vertex);
            }
        }
        Ok(wedges.map(|w| WedgeId(w.unwrap_or(0) as u32)))
    }

    fn push_wedge(&mut self, vertex: VertexId, label: u32) -> Result<usize, MeshFault> {
        if self.mesh.wedges.len() >= self.limits.max_wedges as usize {
            return Err(MeshFault::TooMany { field: "wedges", limit: self.limits.max_wedges });
        }
        let wedge = self.mesh.push_wedge(Wedge { vertex, label: Label(label), color: Vec3::ZERO });
        self.wedge_next.push(std::mem::replace(&mut self.wedge_head[vertex.index()], wedge.0));
        match self.last_wedge.get_mut(label as usize) {
            Some(last) => *last = wedge.0,
            None => self.last_wedge.push(wedge.0),
        }
        Ok(wedge.index())
    }

    /// Codes the colours of all wedges that have none yet.
    pub(super) fn code_colors(&mut self, side: &mut impl Side) -> Result<(), MeshFault> {
        for wedge in self.colors.len()..self.mesh.wedges.len() {
            side.check()?;
            let around = self.around(wedge);
            let step = self.color_steps.at(self.extents.size(self.mesh.wedges[wedge].vertex));
            let truth = side.color(wedge, step);
            let (color, misses) = code_color(side, &mut self.models.colors, &around, step, truth)?;
            self.mesh.wedges[wedge].color = from_grains(color);
            self.colors.push(color);
            self.misses.push(misses);
        }
        Ok(())
    }

    /// What the colour of the next wedge is predicted from.
    fn around(&self, wedge: usize) -> Around {
        let mut around = Around::default();
        let Wedge { vertex, .. } = self.mesh.wedges[wedge];
        for tet in self.stars.at(vertex).take(STAR_SCAN) {
            let wedges = self.mesh.tets[tet as usize];
            if wedges.iter().any(|w| w.index() == wedge) {
                for other in wedges.into_iter().filter(|w| w.index() < wedge) {
                    around.add(self.colors[other.index()], self.misses[other.index()]);
                }
            }
        }
        if around.is_empty() && wedge > 0 {
            around.add(self.colors[wedge - 1], [0; 2]);
        }
        around
    }
}
