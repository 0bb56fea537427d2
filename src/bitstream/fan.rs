//! The open faces around the focus, and the gaps between them: where the next tet goes.
//!
//! In: the front at the focus, and what comes and goes there, tet by tet. Out: the face before the sharpest gap, its
//! neighbours around the focus. Forbidden here: coding.
//!
//! A tet changes two or three faces of the fan; gaps between the others stay as they were computed. Faces stand in the
//! order of their age in slots that are not used again, so that "the youngest" is the highest bit of a mask.

use glam::{DVec3, I64Vec3};

use super::connectivity::SCAN;
use super::front::{Front, Lanes, ROOM, Spoke, equal_lanes, plane};
use super::vertices::Vertices;
use crate::mesh::VertexId;

/// Slots of a fan: as many as a mask has bits.
const SLOTS: usize = 32;

/// No slot.
const NONE: u32 = u32::MAX;

/// One number of each slot.
type Column = [Lanes; SLOTS / ROOM];

/// The [`SCAN`] youngest open faces of the focus.
#[derive(Debug, Clone)]
pub(super) struct Fan {
    focus: VertexId,
    /// Whether it has all open faces of the focus, so that it can be kept in step with them.
    is_whole: bool,
    /// Slots that were used since the fan was gathered, and those of them that have a face.
    used: usize,
    live: u32,
    faces: Column,
    seconds: Column,
    thirds: Column,
    normals: [DVec3; SLOTS],
    planes: [I64Vec3; SLOTS],
    /// The slot of the next face around the focus.
    nexts: Column,
    /// Cosines of the gaps to them; minus infinity where there is none below 180 degrees.
    cosines: [f64; SLOTS],
    /// Slots whose gaps have to be computed.
    stale: u32,
}

/// An open face of the fan.
#[derive(Debug, Clone, Copy)]
pub(super) struct Blade {
    pub(super) spoke: Spoke,
    pub(super) normal: DVec3,
    /// As of [`plane`].
    pub(super) plane: I64Vec3,
}

/// Cosine of the angle between two open faces with a common edge and these unit normals, measured on the open side;
/// angles beyond 180 degrees are the caller's to exclude.
#[inline]
pub(super) fn gap_cos(n: DVec3, m: DVec3) -> f64 {
    -(n.x * m.x + n.y * m.y + n.z * m.z)
}

impl Fan {
    pub(super) const NEW: Self = Self {
        focus: VertexId(NONE),
        is_whole: false,
        used: 0,
        live: 0,
        faces: [[NONE; ROOM]; SLOTS / ROOM],
        seconds: [[NONE; ROOM]; SLOTS / ROOM],
        thirds: [[NONE; ROOM]; SLOTS / ROOM],
        normals: [DVec3::ZERO; SLOTS],
        planes: [I64Vec3::ZERO; SLOTS],
        nexts: [[NONE; ROOM]; SLOTS / ROOM],
        cosines: [f64::NEG_INFINITY; SLOTS],
        stale: 0,
    };

    /// Makes it the fan of `focus`.
    #[inline]
    pub(super) fn turn_to(&mut self, front: &Front, vertices: &Vertices, focus: VertexId) {
        if self.focus != focus || !self.is_whole {
            self.gather(front, vertices, focus);
        }
    }

    fn gather(&mut self, front: &Front, vertices: &Vertices, focus: VertexId) {
        let count = vertices[focus].list.count() as usize;
        (self.focus, self.is_whole, self.used, self.live) = (focus, count <= SCAN, count.min(SCAN), 0);
        for (slot, spoke) in (0..self.used).rev().zip(front.at(vertices, focus)) {
            let plane = plane([focus, spoke.second, spoke.third].map(|v| vertices.position(v)));
            self.put(slot, Blade { spoke, normal: front.face(spoke.face).normal, plane });
        }
        self.stale = self.live;
        front.fetch(vertices, front.at(vertices, focus).take(SCAN).map(|spoke| spoke.second));
    }

    #[inline]
    fn put(&mut self, slot: usize, blade: Blade) {
        let Blade { spoke, normal, plane } = blade;
        let (chunk, lane) = (slot / ROOM, slot % ROOM);
        self.faces[chunk][lane] = spoke.face;
        self.seconds[chunk][lane] = spoke.second.0;
        self.thirds[chunk][lane] = spoke.third.0;
        self.nexts[chunk][lane] = NONE;
        self.normals[slot] = normal;
        self.planes[slot] = plane;
        self.live |= 1 << slot;
    }

    /// Notes that a face was opened.
    #[inline]
    pub(super) fn open(&mut self, [a, b, c]: [VertexId; 3], face: u32, normal: DVec3, plane: I64Vec3) {
        let (second, third) = if a == self.focus {
            (b, c)
        } else if b == self.focus {
            (c, a)
        } else if c == self.focus {
            (a, b)
        } else {
            return;
        };
        if self.used == SLOTS || self.live.count_ones() as usize == SCAN {
            self.is_whole = false;
            return;
        }
        // It is the youngest: the next one of all that it follows.
        self.stale |= self.equal(&self.thirds, second.0) | 1 << self.used;
        self.used += 1;
        self.put(self.used - 1, Blade { spoke: Spoke { face, second, third }, normal, plane });
    }

    /// Notes that a face was closed.
    #[inline]
    pub(super) fn close(&mut self, face: u32) {
        let found = self.equal(&self.faces, face);
        if found != 0 {
            self.live &= !found;
            self.stale |= self.equal(&self.nexts, found.trailing_zeros());
            self.cosines[found.trailing_zeros() as usize] = f64::NEG_INFINITY;
        }
    }

    /// Slots that have a face for which the column says so, as bits.
    #[inline]
    fn equal(&self, column: &Column, wanted: u32) -> u32 {
        let chunks = column[..self.used.div_ceil(ROOM)].iter().enumerate();
        self.live & chunks.fold(0, |equal, (chunk, lanes)| equal | equal_lanes(lanes, wanted) << (ROOM * chunk))
    }

    #[inline]
    fn blade(&self, slot: usize) -> Blade {
        let of = |column: &Column| column[slot / ROOM][slot % ROOM];
        let spoke =
            Spoke { face: of(&self.faces), second: VertexId(of(&self.seconds)), third: VertexId(of(&self.thirds)) };
        Blade { spoke, normal: self.normals[slot], plane: self.planes[slot] }
    }

    /// Computes the gaps that have changed.
    fn refresh(&mut self, vertices: &Vertices) {
        let origin = vertices.position(self.focus);
        let mut stale = self.stale & self.live;
        self.stale = 0;
        while stale != 0 {
            let slot = stale.trailing_zeros() as usize;
            stale &= stale - 1;
            let Blade { spoke, normal, plane } = self.blade(slot);
            let following = self.equal(&self.seconds, spoke.third.0);
            let Some(next) = following.checked_ilog2() else {
                self.nexts[slot / ROOM][slot % ROOM] = NONE;
                self.cosines[slot] = f64::NEG_INFINITY;
                continue;
            };
            self.nexts[slot / ROOM][slot % ROOM] = next;
            let Blade { spoke: other, normal: to, .. } = self.blade(next as usize % SLOTS);
            let across = (vertices.position(other.third) - origin).as_i64vec3();
            let is_sharp = plane.dot(across) > 0;
            self.cosines[slot] = if is_sharp { gap_cos(normal, to) } else { f64::NEG_INFINITY };
        }
    }

    /// The face before the sharpest gap, the youngest of equals; without a gap below 180 degrees the youngest. With it the
    /// next one and the one before around the focus. `None`: there is no face.
    pub(super) fn sharpest(&mut self, vertices: &Vertices) -> Option<(Blade, [Option<Blade>; 2])> {
        let youngest = self.live.checked_ilog2()? as usize;
        self.refresh(vertices);
        let (mut slot, mut best) = (youngest, f64::NEG_INFINITY);
        let mut left = self.live;
        while left != 0 {
            let other = left.trailing_zeros() as usize;
            left &= left - 1;
            let cos = self.cosines[other];
            (slot, best) = if cos >= best { (other, cos) } else { (slot, best) };
        }
        if best == f64::NEG_INFINITY {
            slot = youngest;
        }
        let blade = self.blade(slot);
        let next = self.nexts[slot / ROOM][slot % ROOM];
        let next = (next != NONE).then(|| self.blade(next as usize % SLOTS));
        let before = self.equal(&self.thirds, blade.spoke.second.0).checked_ilog2();
        let before = before.map(|slot| self.blade(slot as usize));
        Some((blade, [next, before]))
    }
}

#[cfg(test)]
mod tests {
    use glam::IVec3;

    use super::*;
    use crate::bitstream::front::CodedTet;

    /// A fan that is kept in step says the same as one that is gathered anew, at sizes on both sides of [`SCAN`].
    #[test]
    fn fans_keep_in_step() {
        let mut seed = 3u64;
        let mut random = |end: u32| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as u32 % end
        };
        let (mut front, mut vertices) = (Front::new(), Vertices::default());
        for _ in 0..14 {
            vertices.push(IVec3::from_array([0; 3].map(|_| random(100) as i32)), 0);
        }
        let (focus, mut fan, mut open) = (VertexId(5), Fan::NEW, Vec::new());
        // Miri is a thousand times slower.
        for step in 0..if cfg!(miri) { 60 } else { 6000 } {
            let [second, third] = [0; 2].map(|_| VertexId(random(14)));
            let is_growing = random(10) < if step % 1000 < 300 { 7 } else { 4 };
            if is_growing && second != third && second != focus && third != focus {
                let corners = [[second, third, focus], [third, focus, second]][random(2) as usize];
                let plane = plane(corners.map(|v| vertices.position(v)));
                if plane != I64Vec3::ZERO && !front.meet(&vertices, corners).is_there {
                    let normal = plane.as_dvec3().normalize();
                    let behind = CodedTet { number: 0, label: 0, opposite: focus };
                    open.push(front.insert(&mut vertices, corners, normal, behind));
                    fan.open(corners, open[open.len() - 1], normal, plane);
                }
            } else if !open.is_empty() {
                let face = open.swap_remove(random(open.len() as u32) as usize);
                front.remove(&mut vertices, face);
                fan.close(face);
            }
            let mut anew = Fan::NEW;
            for fan in [&mut fan, &mut anew] {
                fan.turn_to(&front, &vertices, focus);
            }
            let [kept, anew] = [&mut fan, &mut anew].map(|fan| {
                let found = fan.sharpest(&vertices)?;
                Some((found.0.spoke, found.1.map(|blade| blade.map(|blade| blade.spoke))))
            });
            assert_eq!(kept, anew, "step {step}");
        }
    }
}
