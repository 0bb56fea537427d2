//! The working mesh: what the window holds while edges collapse.
//!
//! Flat arrays. Most vertices lie inside one label, so each has room for one wedge; further ones hang in `overflow`.
//! A wedge's colour is not stored: it is the one its quadric likes best.

use std::collections::HashMap;

use glam::{IVec3, Vec3};

use super::SimplifyParams;
use super::quadric::{PositionQuadric, TetField, WedgeQuadric};
use super::stars::Stars;
use super::surfaces::surface_quadrics;
use crate::mesh::{Domain, Sides, TetMesh};
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

/// A vertex and what its collapses cost: two cache lines, which is what evaluating an edge waits for.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct WorkVertex<Q> {
    /// Its wedge, if it lies inside one label, else the first. The uniformity term (Eq. 5, 6) is part of its quadric.
    pub(super) first: WorkWedge<Q>,
    /// In lattice units.
    pub(super) position: IVec3,
    /// Counts changes; [`NONE`] where the vertex has merged into another.
    pub(super) stamp: u32,
    /// Where the surface quadric is, or [`NONE`].
    pub(super) surface: u32,
    pub(super) sides: Sides,
    /// Whether it waits for neighbours in another part of the mesh.
    pub(super) frozen: bool,
}

/// The window's mesh.
#[derive(Debug)]
pub struct WorkMesh<Q> {
    pub(super) domain: Domain,
    pub(super) vertices: Vec<WorkVertex<Q>>,
    /// Numbers of the vertices in the committed mesh, or [`NONE`].
    pub(super) committed: Vec<u32>,
    pub(super) surfaces: Vec<PositionQuadric>,
    pub(super) overflow: Vec<WorkWedge<Q>>,
    pub(super) tets: Vec<[u32; 4]>,
    pub(super) labels: Vec<Label>,
    /// Tets around each vertex, while edges collapse.
    pub(super) stars: Stars,
    /// Positions of the vertices once more, while edges collapse: checks wait for nothing else.
    pub(super) places: Vec<IVec3>,
}

impl<Q: WedgeQuadric> WorkMesh<Q> {
    /// A mesh without vertices.
    pub fn new(domain: Domain) -> Self {
        Self {
            domain,
            vertices: Vec::new(),
            committed: Vec::new(),
            surfaces: Vec::new(),
            overflow: Vec::new(),
            tets: Vec::new(),
            labels: Vec::new(),
            stars: Stars::default(),
            places: Vec::new(),
        }
    }

    /// Vertices in it.
    pub fn vertex_count(&self) -> usize {
        self.vertices.iter().filter(|vertex| vertex.stamp != NONE).count()
    }

    /// Numbers, in the committed mesh, of the vertices handed on whose stars are not handed on whole.
    pub fn committed_vertices(&self) -> Vec<u32> {
        self.committed.iter().copied().filter(|&number| number != NONE).collect()
    }

    /// Sets where the box ends in time, once the slab's end is known.
    pub fn set_duration(&mut self, duration: u32) {
        self.domain.duration = duration;
        for vertex in &mut self.vertices {
            vertex.sides = self.domain.sides(vertex.position);
        }
    }

    /// Appends a run of lattice, glued where its vertices lie on vertices that are there already: the plane at the
    /// window's leading end.
    pub fn append(&mut self, run: &TetMesh, params: &SimplifyParams) {
        let bottom = run.positions.iter().map(|p| p.z).min().unwrap_or(0);
        let known = self.plane(bottom);
        let place = |mesh: &mut Self, &position: &IVec3| match known.get(&position) {
            Some(&vertex) => vertex,
            None => mesh.push_vertex(position, false),
        };
        let first_vertex = self.vertices.len();
        let vertices: Vec<u32> = run.positions.iter().map(|position| place(self, position)).collect();
        for tet in 0..run.tets.len() {
            self.add_tet(run, tet, run.tet_vertices(tet).map(|v| vertices[v.index()]), params);
        }
        self.spread(first_vertex, params.spread_weight);
        let surfaces = surface_quadrics(run, 1, params.surface_weight);
        (0..).zip(vertices).for_each(|(own, vertex)| self.add_surface(vertex, surfaces.get(&own)));
    }

    /// The vertices at time `t` (lattice units), by position.
    pub(super) fn plane(&self, t: i32) -> HashMap<IVec3, u32> {
        let vertices = self.vertices.iter().zip(0..).filter(|(vertex, _)| vertex.position.z == t);
        vertices.map(|(vertex, number)| (vertex.position, number)).collect()
    }

    pub(super) fn push_vertex(&mut self, position: IVec3, frozen: bool) -> u32 {
        self.vertices.push(WorkVertex {
            first: WorkWedge { label: UNSET, next: NONE, committed: NONE, quadric: Q::default() },
            position,
            stamp: 0,
            surface: NONE,
            sides: self.domain.sides(position),
            frozen,
        });
        self.committed.push(NONE);
        self.vertices.len() as u32 - 1
    }

    /// Adds a tet of `run`, whose corners are `corners` here, with its colours' quadrics, and those of its face in the first or the
    /// last plane.
    pub(super) fn add_tet(&mut self, run: &TetMesh, tet: usize, corners: [u32; 4], params: &SimplifyParams) {
        let label = run.tet_label(tet);
        self.tets.push(corners);
        self.labels.push(label);
        let unit = self.domain.unit() as f32;
        let positions = run.tet_positions(tet).map(|p| p.as_vec3() / unit);
        let colors = run.tets[tet].map(|w| run.wedges[w.index()].color);
        let (gradient, volume) = linear_field(positions, colors);
        for (vertex, color) in corners.into_iter().zip(colors) {
            let field = TetField { gradient, color, weight: 0.25 * volume };
            self.wedge_mut(vertex, label).quadric.add(&Q::of_tet(&field));
        }
        for (end, weight) in [Sides::T_LOW, Sides::T_HIGH].into_iter().zip(params.end_weights) {
            let at_end = corners.map(|v| self.vertices[v as usize].sides.contains(end));
            let Some(area) = area_of_three(positions, at_end).filter(|_| weight > 0.0) else { continue };
            for ((vertex, color), _) in corners.into_iter().zip(colors).zip(at_end).filter(|(_, at_end)| *at_end) {
                let field = TetField { gradient, color, weight: weight * area / 3.0 };
                self.wedge_mut(vertex, label).quadric.add(&Q::of_tet(&field));
            }
        }
    }

    /// Gives the vertices from `first` on, other than frozen ones, their part in the uniformity term.
    pub(super) fn spread(&mut self, first: usize, weight: f32) {
        for vertex in self.vertices[first..].iter_mut().filter(|vertex| !vertex.frozen) {
            vertex.first.quadric.add(&Q::of_point(weight));
        }
    }

    /// The wedge of `label` at `vertex`, made if there is none.
    pub(super) fn wedge_mut(&mut self, vertex: u32, label: Label) -> &mut WorkWedge<Q> {
        let first = &mut self.vertices[vertex as usize].first;
        if first.label == UNSET {
            first.label = label;
        }
        if first.label == label {
            return &mut self.vertices[vertex as usize].first;
        }
        let mut at = first.next;
        while at != NONE && self.overflow[at as usize].label != label {
            at = self.overflow[at as usize].next;
        }
        if at == NONE {
            at = self.overflow.len() as u32;
            let next = std::mem::replace(&mut self.vertices[vertex as usize].first.next, at);
            self.overflow.push(WorkWedge { label, next, committed: NONE, quadric: Q::default() });
        }
        &mut self.overflow[at as usize]
    }

    /// The wedges of `vertex`.
    #[inline]
    pub(super) fn wedges(&self, vertex: u32) -> impl Iterator<Item = &WorkWedge<Q>> {
        let first = &self.vertices[vertex as usize].first;
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

    /// The tets around the edge between two vertices. Stars must be there.
    #[inline]
    pub(super) fn around_edge(&self, u: u32, v: u32) -> impl Iterator<Item = u32> + '_ {
        let (near, far) = if self.stars.star(u).len() <= self.stars.star(v).len() { (u, v) } else { (v, u) };
        self.stars.star(near).iter().copied().filter(move |&tet| self.tets[tet as usize].contains(&far))
    }

    /// From `from` to `to`, in pixels and frames.
    #[inline]
    pub(super) fn offset(&self, from: IVec3, to: IVec3) -> Vec3 {
        (to - from).as_vec3() / self.domain.unit() as f32
    }

    /// Adds a surface quadric, if there is one, to that of `vertex`.
    pub(super) fn add_surface(&mut self, vertex: u32, surface: Option<&PositionQuadric>) {
        if let Some(surface) = surface {
            self.surface_mut(vertex).add_scaled(surface, 1.0);
        }
    }

    /// The surface quadric of `vertex`, made if there is none.
    pub(super) fn surface_mut(&mut self, vertex: u32) -> &mut PositionQuadric {
        let slot = &mut self.vertices[vertex as usize].surface;
        if *slot == NONE {
            *slot = self.surfaces.len() as u32;
            self.surfaces.push(PositionQuadric::default());
        }
        &mut self.surfaces[*slot as usize]
    }
}

/// The area of the face whose corners are chosen, if three are.
fn area_of_three(corners: [Vec3; 4], is_chosen: [bool; 4]) -> Option<f32> {
    let mut chosen = corners.into_iter().zip(is_chosen).filter(|(_, is_chosen)| *is_chosen).map(|(corner, _)| corner);
    let [a, b, c] = [chosen.next()?, chosen.next()?, chosen.next()?];
    Some(0.5 * (b - a).cross(c - a).length())
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
