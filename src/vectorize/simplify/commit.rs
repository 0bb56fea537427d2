//! Handing on: tets that can no longer change move from the working mesh to the slab's committed mesh.

use glam::{IVec3, Vec3};

use super::quadric::WedgeQuadric;
use super::work_mesh::{NONE, WorkMesh};
use crate::mesh::{TetMesh, VertexId, Wedge, WedgeId};

impl<Q: WedgeQuadric> WorkMesh<Q> {
    /// Moves every tet whose vertices all lie at or before `low` (lattice units of t) to the end of `committed`, and
    /// packs what is left. Ids in `committed` stay as they are; a vertex or wedge gets one with its first tet.
    pub fn commit(&mut self, low: i32, committed: &mut TetMesh) {
        let tets = std::mem::take(&mut self.tets);
        let labels = std::mem::take(&mut self.labels);
        let mut ready = Vec::new();
        for (number, tet) in (0..).zip(&tets).filter(|(_, tet)| tet[0] != NONE) {
            if tet.iter().all(|&v| self.vertices[v as usize].position.z <= low) {
                ready.push(self.place_in_curve(tet) << u32::BITS | number);
            } else {
                self.tets.push(*tet);
                self.labels.push(labels[number as usize]);
            }
        }
        // Neighbours next to each other: fit and writing, which go from tet to tet, find them in the caches.
        ready.sort_unstable();
        for number in ready.into_iter().map(|ready| ready as u32 as usize) {
            let corners = tets[number].map(|v| self.commit_wedge(v, labels[number], committed));
            committed.tets.push(corners);
        }
        self.pack();
    }

    /// How far along Morton's curve through the box a tet lies, in 30 bits.
    fn place_in_curve(&self, tet: &[u32; 4]) -> u64 {
        let extent = self.domain.extent();
        let middle = tet.iter().map(|&v| self.vertices[v as usize].position).sum::<IVec3>() / 4;
        let axis = |n: usize| spread(i64::from(middle[n]) as u64 * 1023 / extent[n].max(1) as u64) << n;
        axis(0) | axis(1) | axis(2)
    }

    /// Drops what has collapsed before the mesh is put aside.
    pub(super) fn compact(&mut self) {
        let mut tets = self.tets.iter();
        self.labels.retain(|_| tets.next().is_some_and(|tet| tet[0] != NONE));
        self.tets.retain(|tet| tet[0] != NONE);
        self.tets.shrink_to_fit();
        self.labels.shrink_to_fit();
        self.pack();
    }

    fn commit_wedge(&mut self, v: u32, label: crate::video::Label, committed: &mut TetMesh) -> WedgeId {
        let number = &mut self.committed[v as usize];
        if *number == NONE {
            *number = committed.push_vertex(self.vertices[v as usize].position).0;
        }
        let vertex = VertexId(*number);
        let wedge = self.wedge_mut(v, label);
        if wedge.committed == NONE {
            let color = wedge.quadric.color_at(Vec3::ZERO);
            wedge.committed = committed.push_wedge(Wedge { vertex, label, color }).0;
        }
        WedgeId(wedge.committed)
    }

    /// Drops vertices without tets and renumbers the others in their order.
    fn pack(&mut self) {
        let mut number = vec![NONE; self.vertices.len()];
        for &v in self.tets.as_flattened() {
            number[v as usize] = 0;
        }
        for (kept, slot) in (0..).zip(number.iter_mut().filter(|slot| **slot != NONE)) {
            *slot = kept;
        }
        for v in self.tets.as_flattened_mut() {
            *v = number[*v as usize];
        }
        self.pack_overflow(&number);
        retain_numbered(&mut self.vertices, &number);
        retain_numbered(&mut self.committed, &number);
    }

    fn pack_overflow(&mut self, number: &[u32]) {
        let old_overflow = std::mem::take(&mut self.overflow);
        let old_surfaces = std::mem::take(&mut self.surfaces);
        for v in (0..number.len()).filter(|&v| number[v] != NONE) {
            let mut next = self.vertices[v].first.next;
            self.vertices[v].first.next = NONE;
            let mut tail = NONE;
            while next != NONE {
                let wedge = old_overflow[next as usize];
                next = wedge.next;
                let at = self.overflow.len() as u32;
                self.overflow.push(super::work_mesh::WorkWedge { next: NONE, ..wedge });
                let link = if tail == NONE {
                    &mut self.vertices[v].first.next
                } else {
                    &mut self.overflow[tail as usize].next
                };
                *link = at;
                tail = at;
            }
            if let Some(&surface) = old_surfaces.get(self.vertices[v].surface as usize) {
                self.vertices[v].surface = self.surfaces.len() as u32;
                self.surfaces.push(surface);
            }
        }
    }
}

/// The lowest ten bits, each followed by two zeros.
fn spread(bits: u64) -> u64 {
    let bits = (bits | bits << 16) & 0x0300_00ff;
    let bits = (bits | bits << 8) & 0x0300_f00f;
    let bits = (bits | bits << 4) & 0x030c_30c3;
    (bits | bits << 2) & 0x0924_9249
}

fn retain_numbered<T>(items: &mut Vec<T>, number: &[u32]) {
    let mut v = 0;
    items.retain(|_| {
        v += 1;
        number[v - 1] != NONE
    });
    items.shrink_to_fit();
}
