//! The working mesh: what the window holds while edges collapse.
//!
//! Flat arrays. Most vertices lie inside one label, so each has room for one wedge in `first`; further ones hang in
//! `overflow`. A wedge's colour is not stored: it is the one its quadric likes best.

use glam::{IVec3, Vec3};

use super::quadric::{PositionQuadric, TetField, WedgeQuadric};
use super::stars::Stars;
use crate::mesh::{Domain, FACES, Sides, TetMesh};
use crate::video::Label;

/// No number.
pub(super) const NONE: u32 = u32::MAX;

/// One label's share of a vertex.
#[derive(Debug, Clone, Copy)]
pub(super) struct WorkWedge<Q> {
    pub(super) label: Label,
    /// Next wedge of the same vertex in the overflow, or [`NONE`].
    pub(super) next: u32,
    /// Number in the committed mesh, or [`NONE`].
    pub(super) committed: u32,
    pub(super) quadric: Q,
}

/// The lattice vertices that a vertex has inherited, for the uniformity term (Eq. 5, 6): number, sum and sum of
/// squares of their offsets in pixels.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Inherited {
    pub(super) count: f32,
    pub(super) sum: Vec3,
    pub(super) squares: f32,
}

/// The window's mesh.
#[derive(Debug)]
pub struct WorkMesh<Q> {
    pub(super) domain: Domain,
    pub(super) positions: Vec<IVec3>,
    pub(super) sides: Vec<Sides>,
    /// Counts changes of a vertex; [`NONE`] where it has merged into another.
    pub(super) stamps: Vec<u32>,
    /// Number in the committed mesh, or [`NONE`].
    pub(super) committed: Vec<u32>,
    pub(super) inherited: Vec<Inherited>,
    /// Where the vertex's surface quadric is, or [`NONE`].
    pub(super) surface: Vec<u32>,
    pub(super) surfaces: Vec<PositionQuadric>,
    pub(super) first: Vec<WorkWedge<Q>>,
    pub(super) overflow: Vec<WorkWedge<Q>>,
    pub(super) tets: Vec<[u32; 4]>,
    pub(super) labels: Vec<Label>,
    pub(super) stars: Stars,
}

impl Inherited {
    fn one() -> Self {
        Self { count: 1.0, ..Self::default() }
    }

    /// The same points seen from an origin moved by `shift`.
    pub(super) fn recentered(&self, shift: Vec3) -> Self {
        Self {
            count: self.count,
            sum: self.sum - self.count * shift,
            squares: self.squares - 2.0 * shift.dot(self.sum) + self.count * shift.length_squared(),
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.squares += other.squares;
    }
}

impl<Q: WedgeQuadric> WorkMesh<Q> {
    /// A mesh without vertices.
    pub fn new(domain: Domain) -> Self {
        Self {
            domain,
            positions: Vec::new(),
            sides: Vec::new(),
            stamps: Vec::new(),
            committed: Vec::new(),
            inherited: Vec::new(),
            surface: Vec::new(),
            surfaces: Vec::new(),
            first: Vec::new(),
            overflow: Vec::new(),
            tets: Vec::new(),
            labels: Vec::new(),
            stars: Stars::default(),
        }
    }

    /// Numbers, in the committed mesh, of the vertices handed on whose stars are not handed on whole.
    pub fn committed_vertices(&self) -> Vec<u32> {
        self.committed.iter().copied().filter(|&number| number != NONE).collect()
    }

    /// Sets where the box ends in time, once the slab's end is known.
    pub fn set_duration(&mut self, duration: u32) {
        self.domain.duration = duration;
        for (sides, &position) in self.sides.iter_mut().zip(&self.positions) {
            *sides = self.domain.sides(position);
        }
    }

    /// Appends a run of lattice, glued where its vertices lie on vertices that are there already: the plane at the
    /// window's leading end. Surfaces between labels count with `surface_weight` (squared levels a squared pixel).
    pub fn append(&mut self, run: &TetMesh, surface_weight: f32) {
        let vertices = self.glue_vertices(run);
        let first_tet = self.tets.len();
        for (tet, corners) in run.tets.iter().enumerate() {
            self.tets.push(corners.map(|w| vertices[run.vertex(w).index()]));
            self.labels.push(run.tet_label(tet));
        }
        self.add_color_quadrics(run, &vertices);
        self.stars = Stars::new(self.positions.len(), &self.tets);
        self.add_surfaces(first_tet, surface_weight);
    }

    /// Numbers of the run's vertices here.
    fn glue_vertices(&mut self, run: &TetMesh) -> Vec<u32> {
        let key = |p: IVec3| (p.z, p.y, p.x);
        let bottom = run.positions.iter().map(|p| p.z).min().unwrap_or(0);
        let mut plane: Vec<u32> =
            (0..self.positions.len() as u32).filter(|&v| self.positions[v as usize].z == bottom).collect();
        plane.sort_unstable_by_key(|&v| key(self.positions[v as usize]));
        let mut vertices = Vec::with_capacity(run.positions.len());
        for &position in &run.positions {
            let known = if position.z == bottom {
                plane.binary_search_by_key(&key(position), |&v| key(self.positions[v as usize])).ok()
            } else {
                None
            };
            vertices.push(match known {
                Some(at) => plane[at],
                None => self.push_vertex(position),
            });
        }
        vertices
    }

    fn push_vertex(&mut self, position: IVec3) -> u32 {
        self.positions.push(position);
        self.sides.push(self.domain.sides(position));
        self.stamps.push(0);
        self.committed.push(NONE);
        self.inherited.push(Inherited::one());
        self.surface.push(NONE);
        self.first.push(WorkWedge { label: UNSET, next: NONE, committed: NONE, quadric: Q::default() });
        self.positions.len() as u32 - 1
    }

    /// The wedge of `label` at `vertex`, made if there is none.
    pub(super) fn wedge_mut(&mut self, vertex: u32, label: Label) -> &mut WorkWedge<Q> {
        let first = &mut self.first[vertex as usize];
        if first.label == UNSET {
            first.label = label;
        }
        if first.label == label {
            return &mut self.first[vertex as usize];
        }
        let mut at = first.next;
        while at != NONE && self.overflow[at as usize].label != label {
            at = self.overflow[at as usize].next;
        }
        if at == NONE {
            at = self.overflow.len() as u32;
            let next = std::mem::replace(&mut self.first[vertex as usize].next, at);
            self.overflow.push(WorkWedge { label, next, committed: NONE, quadric: Q::default() });
        }
        &mut self.overflow[at as usize]
    }

    /// The wedges of `vertex`.
    #[inline]
    pub(super) fn wedges(&self, vertex: u32) -> impl Iterator<Item = &WorkWedge<Q>> {
        let first = &self.first[vertex as usize];
        let mut next = first.next;
        std::iter::once(first).chain(std::iter::from_fn(move || {
            let wedge = self.overflow.get(next as usize)?;
            next = wedge.next;
            Some(wedge)
        }))
    }

    /// The wedge of `label` at `vertex`, if it has one.
    #[inline]
    pub(super) fn wedge(&self, vertex: u32, label: Label) -> Option<&WorkWedge<Q>> {
        self.wedges(vertex).find(|wedge| wedge.label == label)
    }

    /// From `from` to `to`, in pixels and frames.
    #[inline]
    pub(super) fn offset(&self, from: IVec3, to: IVec3) -> Vec3 {
        (to - from).as_vec3() / self.domain.unit() as f32
    }

    fn add_color_quadrics(&mut self, run: &TetMesh, vertices: &[u32]) {
        let unit = self.domain.unit() as f32;
        for (tet, corners) in run.tets.iter().enumerate() {
            let positions = run.tet_positions(tet).map(|p| p.as_vec3() / unit);
            let colors = corners.map(|w| run.wedges[w.index()].color);
            let (gradient, volume) = linear_field(positions, colors);
            for (corner, wedge) in corners.iter().enumerate() {
                let field = TetField { gradient, color: colors[corner], weight: 0.25 * volume };
                let vertex = vertices[run.vertex(*wedge).index()];
                self.wedge_mut(vertex, run.tet_label(tet)).quadric.add(&Q::of_tet(&field));
            }
        }
    }

    /// Adds the planes of faces between labels, found among tets from `first_tet` on, to their vertices.
    fn add_surfaces(&mut self, first_tet: usize, weight: f32) {
        for tet in first_tet..self.tets.len() {
            let corners = self.tets[tet];
            if corners.iter().all(|&v| self.first[v as usize].next == NONE) {
                continue;
            }
            for face in FACES {
                let face = face.map(|corner| corners[corner]);
                if face.iter().any(|&v| self.first[v as usize].next == NONE) {
                    continue;
                }
                // Each face between labels once: from its side of the greater label, which may be an older tet.
                let across = self.across(tet, face);
                let between = across.is_some_and(|other| {
                    self.labels[other] != self.labels[tet]
                        && (other < first_tet || self.labels[other] < self.labels[tet])
                });
                if between {
                    self.add_plane(face, weight);
                }
            }
        }
    }

    /// The tet on the other side of a face of `tet`.
    fn across(&self, tet: usize, face: [u32; 3]) -> Option<usize> {
        let star = self.stars.star(face[0]).iter().map(|&t| t as usize);
        star.filter(|&t| t != tet).find(|&t| face.iter().all(|v| self.tets[t].contains(v)))
    }

    fn add_plane(&mut self, face: [u32; 3], weight: f32) {
        let [a, b, c] = face.map(|v| self.positions[v as usize]);
        let normal = self.offset(a, b).cross(self.offset(a, c));
        let length = normal.length();
        // A third of the face's area for each corner.
        let quadric = PositionQuadric::plane(normal / length, 0.0, weight * length / 6.0);
        for v in face {
            let slot = &mut self.surface[v as usize];
            if *slot == NONE {
                *slot = self.surfaces.len() as u32;
                self.surfaces.push(PositionQuadric::default());
            }
            self.surfaces[*slot as usize].add_scaled(&quadric, 1.0);
        }
    }
}

/// Label of a first wedge that is not set yet.
const UNSET: Label = Label(u32::MAX);

/// The gradient (rgb per x, y, t) of the field that is linear between the corners, and the tet's volume.
fn linear_field(p: [Vec3; 4], c: [Vec3; 4]) -> ([Vec3; 3], f32) {
    let (u, v, w) = (p[1] - p[0], p[2] - p[0], p[3] - p[0]);
    let (vw, wu, uv) = (v.cross(w), w.cross(u), u.cross(v));
    let determinant = u.dot(vw);
    let (du, dv, dw) = (c[1] - c[0], c[2] - c[0], c[3] - c[0]);
    let axis = |a: f32, b: f32, d: f32| (du * a + dv * b + dw * d) / determinant;
    let gradient = [axis(vw.x, wu.x, uv.x), axis(vw.y, wu.y, uv.y), axis(vw.z, wu.z, uv.z)];
    (gradient, determinant / 6.0)
}
