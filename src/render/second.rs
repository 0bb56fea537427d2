//! The second level: a complex over the first level's children, as far as planes have come near them.
//!
//! In: refined parents. Out: the children that a plane cuts, refined once more. Second-level nodes are far more than
//! can be held for a slab, so this is dropped and built anew when it outgrows what pictures need.

use glam::IVec3;

use super::complex::{Complex, Node};
use super::refiner::{NodeName, Refiner};
use crate::mesh::EDGES;

const NONE: u32 = u32::MAX;

/// Level 2 of some parents.
#[derive(Debug, Default)]
pub(super) struct Second {
    /// The first level's nodes and children.
    complex: Complex,
    /// One a node, in fine levels.
    colors: Vec<IVec3>,
    refiner: Refiner,
    /// For each control tet, whether its children are here.
    taken: Vec<bool>,
    /// The control tet of each eight children.
    parents: Vec<u32>,
    nodes: NameTable,
    points: NameTable,
}

/// What became of the first level's nodes, or of their points, here.
#[derive(Debug, Default)]
struct NameTable {
    corners: Vec<u32>,
    edges: Vec<u32>,
}

impl NameTable {
    /// The entry of `name`, [`NONE`] at first.
    fn entry(&mut self, name: NodeName) -> &mut u32 {
        let (table, i) = match name {
            NodeName::Corner(i) => (&mut self.corners, i as usize),
            NodeName::Edge(i) => (&mut self.edges, i as usize),
        };
        if i >= table.len() {
            table.resize(i + 1, NONE);
        }
        &mut table[i]
    }
}

impl Second {
    /// Number of first-level children held.
    pub(super) fn tet_count(&self) -> usize {
        self.complex.tets.len()
    }

    /// The control tet of a first-level child.
    pub(super) fn parent(&self, tet: u32) -> u32 {
        self.parents[tet as usize / 8]
    }

    /// What holds the children of first-level children.
    pub(super) fn level(&self) -> (&Refiner, &Complex) {
        (&self.refiner, &self.complex)
    }

    /// The first-level children whose own children the plane at `t` may cut, by control tet and child.
    pub(super) fn cut(&mut self, t: i32) -> Vec<u32> {
        self.refiner.extend(&self.complex);
        let mut tets = self.refiner.cut(&self.complex, &self.colors, t);
        self.refiner.take_changed();
        tets.sort_unstable_by_key(|&tet| (self.parents[tet as usize / 8], tet % 8));
        tets
    }

    /// Takes in new values of first-level nodes, which changed as more of the mesh came.
    pub(super) fn update(&mut self, first: &Refiner, changed: &[NodeName]) {
        let mut moved = Vec::new();
        for &name in changed {
            let node = *self.nodes.entry(name);
            if node != NONE {
                let value = first.node(name);
                let point = self.complex.point(node);
                self.complex.points[point as usize] = value.position;
                self.colors[node as usize] = value.color;
                moved.push(point);
            }
        }
        self.refiner.forget_around(&self.complex, &moved);
    }

    /// Appends the children of a refined control tet, unless they are here.
    pub(super) fn push_children(&mut self, control: &Complex, first: &Refiner, tet: u32) {
        if self.taken.len() < control.tets.len() {
            self.taken.resize(control.tets.len(), false);
        }
        if std::mem::replace(&mut self.taken[tet as usize], true) {
            return;
        }
        let corners = control.tets[tet as usize];
        let edges = first.edge_nodes(tet);
        let local: [u32; 10] = std::array::from_fn(|i| match i.checked_sub(4) {
            None => {
                let name = NodeName::Corner(corners[i]);
                self.push_node(control, first, [name, NodeName::Corner(control.point(corners[i]))], [corners[i]; 2])
            }
            Some(edge) => {
                let (node, point) = edges[edge];
                let ends = EDGES[edge].map(|end| corners[end]);
                self.push_node(control, first, [NodeName::Edge(node), NodeName::Edge(point)], ends)
            }
        });
        self.complex.tets.extend(first.children(tet).map(|child| child.map(|i| local[i as usize])));
        self.parents.push(tet);
    }

    /// The node here of a first-level node, given its name, its point's name and the ends of its edge (twice itself
    /// for a corner).
    fn push_node(&mut self, control: &Complex, first: &Refiner, names: [NodeName; 2], ends: [u32; 2]) -> u32 {
        let node = self.nodes.entry(names[0]);
        if *node != NONE {
            return *node;
        }
        *node = self.complex.nodes.len() as u32;
        let number = *node;
        let value = first.node(names[0]);
        let point = self.points.entry(names[1]);
        if *point == NONE {
            *point = self.complex.points.len() as u32;
            let pinned = ends.map(|end| control.pinned[control.point(end) as usize]);
            self.complex.points.push(value.position);
            self.complex.pinned.push(pinned[0] || pinned[1]);
            self.complex.sides.push(control.sides(ends[0]).and(control.sides(ends[1])));
        }
        let label = control.nodes[ends[0] as usize].label;
        self.complex.nodes.push(Node { point: *point, label });
        self.colors.push(value.color);
        number
    }
}
