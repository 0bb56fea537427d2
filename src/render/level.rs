//! One level of subdivision of a whole complex: masks of all nodes, points, children.

use glam::{I64Vec3, IVec3};

use super::children::{CHILDREN, diagonal};
use super::complex::{Complex, Node, Stars};
use super::parallel::map_chunks;
use super::rings::{Gather, NodeMask};
use crate::mesh::EDGES;

/// Vertices gathered in one go: enough to outweigh handing the work to a thread.
const CHUNK: usize = 2048;

/// A complex and how its nodes follow from those of the level below.
///
/// Points: first one for each point below, in order, then one for each edge, by (lower end, higher end). Nodes: first
/// one for each node below, then the edges' nodes by (lower end's point, higher end's point, higher end's node).
#[derive(Debug)]
pub(super) struct Level {
    pub(super) complex: Complex,
    /// One a node.
    pub(super) masks: Vec<NodeMask>,
    /// Ring nodes (of the level below) of all masks.
    pub(super) rings: Vec<u32>,
}

impl Level {
    /// Subdivides `below` once.
    pub(super) fn new(below: &Complex) -> Self {
        let mut level = Self::gather(below);
        let edge_start = level.place_nodes(below);
        let children = map_chunks(below.tets.len(), CHUNK, |tets| {
            let mut children = Vec::with_capacity(8 * tets.len());
            for tet in tets {
                let corners = below.tets[tet];
                let nodes = level.ten_nodes(below, &edge_start, corners);
                let around = diagonal(corners.map(|node| below.position(node)));
                children.extend(CHILDREN[around].map(|child| child.map(|i| nodes[i as usize])));
            }
            children
        });
        level.complex.tets = children.concat();
        level
    }

    /// Gathers all masks: nodes' own first, then edges' in the order of their owners.
    fn gather(below: &Complex) -> Self {
        let stars = Stars::new(below);
        let runs = map_chunks(below.points.len(), CHUNK, |points| {
            let (mut masks, mut rings, mut gather) = (Vec::new(), Vec::new(), Gather::default());
            for point in points {
                gather.run(below, &stars, point as u32);
                let base = rings.len() as u32;
                masks.extend(gather.masks.iter().map(|m| NodeMask { start: m.start + base, end: m.end + base, ..*m }));
                rings.extend_from_slice(&gather.rings);
            }
            (masks, rings)
        });
        // Nodes that no tet uses stay what they are.
        let mut masks: Vec<_> = (0..below.nodes.len() as u32).map(|node| NodeMask::stay(node, node)).collect();
        let mut rings = Vec::new();
        for (run_masks, run_rings) in runs {
            let base = rings.len() as u32;
            for mask in run_masks {
                let mask = NodeMask { start: mask.start + base, end: mask.end + base, ..mask };
                if mask.is_edge() {
                    masks.push(mask);
                } else {
                    masks[mask.near as usize] = mask;
                }
            }
            rings.extend(run_rings);
        }
        Self { complex: Complex::default(), masks, rings }
    }

    /// Makes points and nodes from the masks. Returns where each point's edge nodes start.
    fn place_nodes(&mut self, below: &Complex) -> Vec<u32> {
        let mut edge_start = vec![0u32; below.points.len() + 1];
        let complex = &mut self.complex;
        complex.points = below.points.clone();
        complex.pinned = below.pinned.clone();
        complex.sides = below.sides.clone();
        complex.nodes = below.nodes.clone();
        let mut edge = (u32::MAX, u32::MAX);
        for mask in &self.masks {
            let (near, far) = (below.point(mask.near), below.point(mask.far));
            if !mask.is_edge() {
                complex.points[near as usize] = place(below, mask, &self.rings);
                continue;
            }
            if edge != (near, far) {
                edge = (near, far);
                complex.points.push(place(below, mask, &self.rings));
                complex.pinned.push(below.pinned[near as usize] || below.pinned[far as usize]);
                complex.sides.push(below.sides(mask.near).and(below.sides(mask.far)));
            }
            let point = complex.points.len() as u32 - 1;
            complex.nodes.push(Node { point, label: below.nodes[mask.near as usize].label });
            edge_start[near as usize + 1] += 1;
        }
        edge_start[0] = below.nodes.len() as u32;
        for i in 1..edge_start.len() {
            edge_start[i] += edge_start[i - 1];
        }
        edge_start
    }

    /// The ten nodes of a parent: its corners, then its edges' nodes in the order of [`EDGES`].
    fn ten_nodes(&self, below: &Complex, edge_start: &[u32], corners: [u32; 4]) -> [u32; 10] {
        std::array::from_fn(|i| match i.checked_sub(4) {
            None => corners[i],
            Some(edge) => self.edge_node(below, edge_start, EDGES[edge].map(|end| corners[end])),
        })
    }

    /// The node of the edge between two nodes of one label.
    fn edge_node(&self, below: &Complex, edge_start: &[u32], mut ends: [u32; 2]) -> u32 {
        ends.sort_unstable_by_key(|&node| below.point(node));
        let [near, far] = ends;
        let owner = below.point(near) as usize;
        let (first, last) = (edge_start[owner] as usize, edge_start[owner + 1] as usize);
        let key = (below.point(far), far);
        let found = self.masks[first..last].binary_search_by_key(&key, |mask| (below.point(mask.far), mask.far));
        // Every edge of a tet was gathered, unless both its ends are one point: then it is that point.
        found.map_or(near, |i| (first + i) as u32)
    }
}

/// A node's mask as it applies to its position: a pinned point stays, an edge with a pinned end is split at its
/// midpoint. Colours know no pins.
pub(super) fn pinned_mask(below: &Complex, mask: &NodeMask) -> NodeMask {
    let pinned = |node: u32| below.pinned[below.point(node) as usize];
    if pinned(mask.near) || pinned(mask.far) { NodeMask::stay(mask.near, mask.far) } else { *mask }
}

/// Where a mask puts its point, in fine units.
pub(super) fn place(below: &Complex, mask: &NodeMask, rings: &[u32]) -> IVec3 {
    blend(&pinned_mask(below, mask), rings, |node| below.position(node))
}

/// What a mask makes of integer values at the nodes below. The sum is exact and rounded once to the nearest integer,
/// halves up: it does not depend on how nodes are numbered, and all labels at a point get the same position.
pub(super) fn blend(mask: &NodeMask, rings: &[u32], value: impl Fn(u32) -> IVec3) -> IVec3 {
    let value = |node: u32| value(node).as_i64vec3();
    let ends = if mask.is_edge() { value(mask.near) + value(mask.far) } else { value(mask.near) };
    let ring: I64Vec3 = rings[mask.start as usize..mask.end as usize].iter().map(|&node| value(node)).sum();
    let den = i64::from(mask.den);
    let sum = ends * i64::from(mask.own) + ring * i64::from(mask.ring);
    let divide = |v: i64| (2 * v + den).div_euclid(2 * den) as i32;
    IVec3::new(divide(sum.x), divide(sum.y), divide(sum.z))
}
