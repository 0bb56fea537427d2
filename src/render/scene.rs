//! A slab as it is drawn: the control mesh as far as it has come, and the levels refined so far.

use glam::IVec3;

use super::active::Active;
use super::canvas::ColorSpace;
use super::complex::{Complex, FINE_BITS, emptied};
use super::interfaces::{Faces, Interfaces, child_faces};
use super::lanes::LANES;
use super::paint::Painters;
use super::parallel::{List, fill_chunks};
use super::piece::Pieces;
use super::refiner::{FineNode, Refiner, Span, fine_color};
use super::second::Second;
use super::slice::{Polygons, SliceNode, Slices};
use super::view::Viewport;
use super::window::Extents;
use crate::mesh::{Domain, MeshCounts, MeshTail, TetMesh};

/// First-level children that the second level may hold before it starts anew; or four times what a picture needs, if
/// that is more. About 150 bytes each.
const SECOND_TETS: usize = 1 << 19;

/// Tets that a thread slices at a time.
pub(super) const CHUNK: usize = 512;

/// A slab's control mesh, ready to be cut by planes. It grows with the mesh; what was refined is kept.
#[derive(Debug)]
pub struct Scene {
    domain: Domain,
    complex: Complex,
    /// One a node, in fine levels.
    colors: Vec<IVec3>,
    /// One a node: its position and colour side by side.
    nodes: Vec<SliceNode>,
    /// What their colours are in.
    space: ColorSpace,
    spans: Vec<Span>,
    active: Active,
    /// As of the last picture of a part.
    extents: Extents,
    /// As of the last anti-aliased picture.
    interfaces: Interfaces,
    /// Level 1; empty until it is first asked for.
    refiner: Refiner,
    /// Level 2, around the planes lately drawn.
    second: Second,
    /// Polygons of the last picture; kept for their memory.
    pub(super) pieces: Vec<Pieces>,
    pub(super) painters: Painters,
}

impl Scene {
    /// A scene without tets.
    pub fn new(domain: Domain) -> Self {
        Self {
            domain,
            complex: Complex::default(),
            colors: Vec::new(),
            nodes: Vec::new(),
            space: ColorSpace::Rgb,
            spans: Vec::new(),
            active: Active::new(domain.unit() << FINE_BITS),
            extents: Extents::default(),
            interfaces: Interfaces::new(),
            refiner: Refiner::default(),
            second: Second::default(),
            pieces: Vec::new(),
            painters: Painters::default(),
        }
    }

    /// A scene without tets in the memory of this one, which the next slab of a stream fills as far again.
    pub fn emptied(self, domain: Domain) -> Self {
        Self {
            complex: self.complex.emptied(),
            colors: emptied(self.colors),
            nodes: emptied(self.nodes),
            spans: emptied(self.spans),
            pieces: self.pieces,
            painters: self.painters,
            ..Self::new(domain)
        }
    }

    /// The box of the slab.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// The smallest difference of times that can be drawn, in frames.
    pub fn time_step(&self) -> f64 {
        1.0 / (f64::from(self.domain.unit()) * f64::from(1 << FINE_BITS))
    }

    /// Takes in what `mesh` gained since the last call. It must be the same mesh, changed at the ends of its arrays
    /// only; its duration may change.
    pub fn extend(&mut self, mesh: &TetMesh) {
        let known = self.counts();
        let moved = self.complex.extend(mesh);
        self.take_in(&mesh.tail(known), &moved);
    }

    /// Takes in what a mesh gained: all tails, one after the other, are [`Self::extend`] with the mesh.
    pub fn append(&mut self, tail: &MeshTail<'_>) {
        let moved = self.complex.append(tail);
        self.take_in(tail, &moved);
    }

    fn counts(&self) -> MeshCounts {
        let Complex { points, nodes, tets, .. } = &self.complex;
        MeshCounts { vertices: points.len(), wedges: nodes.len(), tets: tets.len() }
    }

    /// Takes in what the complex has taken in, given the points that changed sides.
    fn take_in(&mut self, tail: &MeshTail<'_>, moved: &[u32]) {
        self.domain = tail.domain;
        if !moved.is_empty() {
            self.refiner.forget_around(&self.complex, moved);
            self.second = Second::default();
        }
        self.colors.extend(tail.wedges.iter().map(|wedge| fine_color(wedge.color)));
        for node in self.nodes.len()..self.complex.nodes.len() {
            self.nodes.push(self.slice_node(node));
        }
        let time = |node: u32| self.nodes[node as usize].t();
        let span = |&[a, b, c, d]: &[u32; 4]| {
            let [a, b, c, d] = [time(a), time(b), time(c), time(d)];
            Span::new(a.min(b).min(c.min(d)), a.max(b).max(c.max(d)))
        };
        self.spans.extend(self.complex.tets[self.spans.len()..].iter().map(span));
    }

    fn slice_node(&self, node: usize) -> SliceNode {
        let position = self.complex.position(node as u32);
        SliceNode::new(&FineNode { position, color: self.colors[node] }, self.space)
    }

    /// From now on polygons have their colours in the channels of a canvas of this kind.
    pub(super) fn color_in(&mut self, space: ColorSpace) {
        if std::mem::replace(&mut self.space, space) != space {
            self.nodes = (0..self.nodes.len()).map(|node| self.slice_node(node)).collect();
        }
    }

    /// Brings what is known of interfaces up to date. False if there are none.
    pub(super) fn find_interfaces(&mut self) -> bool {
        self.interfaces.extend(&self.complex);
        self.interfaces.any()
    }

    /// Cuts the scene, subdivided `levels` times, at `t` (fine units). `take` appends to a list what the caller keeps
    /// of polygons; what it works with it gets with each. Lists, one after the other, hold polygons in the order
    /// of control tets and of children; what was in them is gone. Given a part of the picture, and the size of the surface
    /// that it is stretched over, polygons that are not seen there may be left out.
    pub(super) fn cut<L: List, S: Default>(
        &mut self,
        t: i32,
        levels: u8,
        part: Option<(Viewport, (u32, u32))>,
        lists: &mut Vec<L>,
        take: impl Fn(&mut L, &Polygons, &mut S) + Sync + Send,
    ) {
        if levels == 0 {
            let mut tets = self.active.cut(&self.spans, t);
            let seen: Vec<u32>;
            if let Some((viewport, size)) = part {
                self.extents.extend(&self.domain, &self.complex);
                let window = self.extents.window(&self.domain, &viewport, size);
                seen = tets.iter().copied().filter(|&tet| self.extents.is_seen(tet, &window)).collect();
                tets = &seen;
            }
            return fill_chunks(lists, tets.len(), CHUNK, |list, run| {
                let (mut slices, mut table) = (Slices::new(), S::default());
                for tets in tets[run].chunks(LANES) {
                    let nodes = |tet: u32| self.complex.tets[tet as usize].map(|node| &self.nodes[node as usize]);
                    // Nodes lie far apart: looked at in one go, the waits for them overlap.
                    let mut above = [0; LANES];
                    above.iter_mut().zip(tets).for_each(|(above, &tet)| *above = SliceNode::above(nodes(tet), t));
                    for (&tet, above) in tets.iter().zip(above) {
                        slices.push(tet, nodes(tet), above, self.interfaces.faces(tet));
                    }
                    slices.cut(t, |polygons| take(list, polygons, &mut table));
                }
            });
        }
        self.refiner.extend(&self.complex);
        if levels == 1 {
            let tets = self.refiner.cut(&self.complex, &self.colors, t);
            // The second level is not kept up to date here; it starts anew when it is next asked for.
            if !self.refiner.take_changed().is_empty() {
                self.second = Second::default();
            }
            return cut_children(lists, &tets, t, take, |tet| Parent {
                level: (&self.refiner, &self.complex),
                tet,
                control: tet,
                faces: self.interfaces.faces(tet),
                space: self.space,
            });
        }
        self.refine_twice(t);
        let tets = self.second.cut(t);
        cut_children(lists, &tets, t, take, |tet| {
            let control = self.second.parent(tet);
            let child = self.refiner.children(control)[tet as usize % 8];
            let faces = child_faces(child, self.interfaces.faces(control));
            Parent { level: self.second.level(), tet, control, faces, space: self.space }
        });
    }

    /// Brings the second level up to the plane at `t`.
    ///
    /// A second-level node lies within the hull of the first-level nodes around the corners of its control tet. So the
    /// tets that may be cut are those with a corner whose star is cut; and they, with all tets around them, hold
    /// everything that their masks reach.
    fn refine_twice(&mut self, t: i32) {
        let near = self.refiner.cut(&self.complex, &self.colors, t);
        let once = self.grow(&near);
        let twice = self.grow(&once);
        self.refiner.refine(&self.complex, &self.colors, &twice);
        let changed = self.refiner.take_changed();
        if self.second.tet_count() > (4 * 8 * twice.len()).max(SECOND_TETS) {
            self.second = Second::default();
        }
        self.second.update(&self.refiner, &changed);
        for &tet in &twice {
            self.second.push_children(&self.complex, &self.refiner, tet);
        }
    }

    /// `tets` and all tets that share a vertex with one of them, ascending.
    fn grow(&self, tets: &[u32]) -> Vec<u32> {
        let mut seen = vec![false; self.complex.points.len()];
        let mut grown = vec![false; self.complex.tets.len()];
        for &tet in tets {
            for point in self.complex.tets[tet as usize].map(|node| self.complex.point(node)) {
                if !std::mem::replace(&mut seen[point as usize], true) {
                    self.refiner.star(point).for_each(|tet| grown[tet as usize] = true);
                }
            }
        }
        (0..grown.len() as u32).filter(|&tet| grown[tet as usize]).collect()
    }
}

/// Cuts the children of refined tets, on any number of threads.
fn cut_children<'a, L: List, S: Default>(
    lists: &mut Vec<L>,
    tets: &[u32],
    t: i32,
    take: impl Fn(&mut L, &Polygons, &mut S) + Sync + Send,
    parent: impl Fn(u32) -> Parent<'a> + Sync + Send,
) {
    fill_chunks(lists, tets.len(), CHUNK, |list, run| {
        let (mut slices, mut table) = (Slices::new(), S::default());
        for &tet in &tets[run] {
            parent(tet).push_children(t, &mut slices);
            if slices.room() < CHILDREN_A_TET {
                slices.cut(t, |polygons| take(list, polygons, &mut table));
            }
        }
        slices.cut(t, |polygons| take(list, polygons, &mut table));
    });
}

/// Children of a refined tet.
const CHILDREN_A_TET: usize = 8;

/// A refined tet.
struct Parent<'a> {
    level: (&'a Refiner, &'a Complex),
    tet: u32,
    /// The control tet that it belongs to.
    control: u32,
    /// Its faces between labels.
    faces: Faces,
    space: ColorSpace,
}

impl Parent<'_> {
    #[inline]
    fn push_children(&self, t: i32, slices: &mut Slices) {
        let (refiner, complex) = self.level;
        let nodes = refiner.ten(complex, self.tet).map(|node| SliceNode::new(&node, self.space));
        for child in refiner.children(self.tet) {
            let faces = child_faces(*child, self.faces);
            let corners = child.map(|i| &nodes[usize::from(i)]);
            slices.push(self.control, corners, SliceNode::above(corners, t), faces);
        }
    }
}
