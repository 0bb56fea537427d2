//! Simplification in blocks: on all cores, and each block small enough for the caches.
//!
//! In: a run of mesh that is to join the window, or the window itself. Out: the window with what is left. Blocks are
//! bands of the picture; vertices that two of them share, or that wait for the next run, are frozen meanwhile. What the
//! blocks are depends on the mesh alone, so the result does not depend on the number of threads.

use std::collections::HashMap;

use glam::IVec3;

use super::SimplifyParams;
use super::collapse::{Goal, SimplifyReport, Unfrozen, simplify};
use super::quadric::{PositionQuadric, WedgeQuadric};
use super::surfaces::{face_quadrics, surface_quadrics};
use super::work_mesh::{NONE, WorkMesh};
use crate::mesh::{Domain, Sides, TetMesh};
use crate::vectorize::parallel::{for_each, map};

/// A vertex of more than one block.
const SHARED: u32 = u32::MAX - 1;

/// How far blocks are simplified.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockGoal {
    /// About which share is to be left of the vertices that only one block has.
    pub keep: f64,
    /// As [`Goal::max_error`], over the whole run.
    pub max_error: f32,
    /// By which part of a band, less than 1, the lines between bands are moved: what one pass leaves frozen another
    /// reaches.
    pub shift: f64,
}

impl BlockGoal {
    /// The goal of one of `count` blocks.
    fn of_one(self, count: usize) -> Self {
        Self { max_error: self.max_error / count as f32, ..self }
    }
}

impl<Q: WedgeQuadric> WorkMesh<Q> {
    /// Appends a run as [`WorkMesh::append`] does, after simplifying its blocks. Its lattice has 1 or 2 planes a frame.
    pub fn append_simplified(
        &mut self,
        run: &TetMesh,
        planes_a_frame: i32,
        goal: BlockGoal,
        params: &SimplifyParams,
    ) -> SimplifyReport {
        self.append_blocks(run, surface_quadrics(run, planes_a_frame, params.surface_weight), goal, params)
    }

    /// The same with a fitted mesh, whose surfaces are where they belong.
    pub fn append_fitted(&mut self, mesh: &TetMesh, goal: BlockGoal, params: &SimplifyParams) -> SimplifyReport {
        self.append_blocks(mesh, face_quadrics(mesh, params.surface_weight), goal, params)
    }

    fn append_blocks(
        &mut self,
        run: &TetMesh,
        surfaces: HashMap<u32, PositionQuadric>,
        goal: BlockGoal,
        params: &SimplifyParams,
    ) -> SimplifyReport {
        let goal = goal.of_one(params.blocks(run.positions.len()));
        let Split { parts, numbers } = split(run, goal.shift, params);
        let blocks = map(parts, |part| {
            let mut mesh = Self::new(self.domain);
            mesh.fill(run, &part, (&numbers, &surfaces), params);
            let report = mesh.simplify_alone(goal, params);
            (mesh, report)
        });
        let bottom = run.positions.iter().map(|p| p.z).min().unwrap_or(0);
        let mut glued = self.plane(bottom);
        glued.values().for_each(|&vertex| self.vertices[vertex as usize].frozen = true);
        let first_vertex = self.vertices.len();
        let total = self.absorb_all(blocks, &mut glued, params.spread_weight);
        let total = SimplifyReport { vertices_in_window: self.vertices.len() - first_vertex, ..total };
        // The blocks have the surfaces of all vertices but those that are shared.
        for (own, (position, _)) in
            (0..).zip(run.positions.iter().zip(&numbers)).filter(|(_, (_, number))| **number == SHARED)
        {
            if let Some(&vertex) = glued.get(position) {
                self.add_surface(vertex, surfaces.get(&own));
            }
        }
        self.vertices.iter_mut().for_each(|vertex| vertex.frozen = false);
        total
    }

    /// Simplifies what is not frozen of the window block by block.
    pub fn simplify_blocks(&mut self, unfrozen: Unfrozen, goal: BlockGoal, params: &SimplifyParams) -> SimplifyReport {
        // What an earlier simplification of the whole has left behind.
        self.compact();
        let goal = goal.of_one(params.blocks(self.vertices.len()));
        let bands = Bands::new(params.blocks(self.vertices.len()), goal.shift, self.domain);
        let of_tet = bands.of_tets(self.tets.len(), |tet| self.tets[tet].map(|v| self.vertices[v as usize].position));
        let mut owners = owners(self.vertices.len(), self.tets.iter().copied().zip(of_tet.iter().copied()));
        for (owner, vertex) in owners.iter_mut().zip(&self.vertices) {
            if *owner != NONE && unfrozen.freezes(vertex.position.z) {
                *owner = SHARED;
            }
        }
        let blocks = self.take_blocks(&of_tet, &owners, bands.count);
        let blocks = map(blocks, |mut block: Self| {
            let report = block.simplify_alone(goal, params);
            (block, report)
        });
        let mut glued = self.vertices.iter().zip(0..).map(|(vertex, number)| (vertex.position, number)).collect();
        let total = self.absorb_all(blocks, &mut glued, 0.0);
        self.vertices.iter_mut().for_each(|vertex| vertex.frozen = false);
        total
    }

    /// Takes all tets out, and the vertices that only one block has. Of a shared vertex the first block that has it takes
    /// the quadrics; the vertex itself stays.
    fn take_blocks(&mut self, of_tet: &[u32], owners: &[u32], count: usize) -> Vec<Self> {
        let mut blocks: Vec<Self> = (0..count).map(|_| Self::new(self.domain)).collect();
        let mut numbers = vec![NONE; self.vertices.len()];
        let mut taken = vec![false; self.vertices.len()];
        for (same, block) in by_band(of_tet, count).into_iter().zip(&mut blocks) {
            let mut members = Vec::new();
            for tet in same {
                let corners = self.tets[tet as usize].map(|v| {
                    if numbers[v as usize] == NONE {
                        let is_first = !std::mem::replace(&mut taken[v as usize], true);
                        numbers[v as usize] = self.copy_vertex(v, block, owners[v as usize] == SHARED, is_first);
                        members.push(v);
                    }
                    numbers[v as usize]
                });
                block.tets.push(corners);
                block.labels.push(self.labels[tet as usize]);
            }
            members.into_iter().for_each(|v| numbers[v as usize] = NONE);
        }
        self.keep_shared(owners);
        blocks
    }

    /// Copies a vertex into a block, with its quadrics or with empty ones.
    fn copy_vertex(&self, v: u32, block: &mut Self, frozen: bool, with_quadrics: bool) -> u32 {
        let vertex = &self.vertices[v as usize];
        let copy = block.push_vertex(vertex.position, frozen);
        block.vertices[copy as usize].sides = vertex.sides;
        for wedge in self.wedges(v) {
            let own = block.wedge_mut(copy, wedge.label);
            if with_quadrics {
                own.quadric = wedge.quadric;
            }
        }
        if with_quadrics && let Some(surface) = self.surfaces.get(vertex.surface as usize) {
            *block.surface_mut(copy) = *surface;
        }
        copy
    }

    /// Leaves only shared vertices, without tets and quadrics.
    fn keep_shared(&mut self, owners: &[u32]) {
        self.tets.clear();
        self.labels.clear();
        self.surfaces.clear();
        let old_overflow = std::mem::take(&mut self.overflow);
        let old = std::mem::take(&mut self.vertices).into_iter().zip(std::mem::take(&mut self.committed));
        for ((vertex, committed), _) in old.zip(owners).filter(|&(_, &owner)| owner == SHARED) {
            let kept = self.push_vertex(vertex.position, true);
            self.committed[kept as usize] = committed;
            self.vertices[kept as usize].sides = vertex.sides;
            let mut wedge = Some(&vertex.first);
            while let Some(old) = wedge {
                self.wedge_mut(kept, old.label).committed = old.committed;
                wedge = old_overflow.get(old.next as usize);
            }
        }
    }

    /// Simplifies a block by itself.
    fn simplify_alone(
        &mut self,
        BlockGoal { keep, max_error, .. }: BlockGoal,
        params: &SimplifyParams,
    ) -> SimplifyReport {
        let frozen = self.vertices.iter().filter(|vertex| vertex.frozen).count();
        let free = self.vertices.len() - frozen;
        let goal = Goal {
            vertices: frozen + (keep * free as f64) as usize,
            before: i32::MAX,
            vertices_in_window: usize::MAX,
            max_cost: f32::MAX,
            max_error,
        };
        let report = simplify(self, Unfrozen { low: i32::MIN, high: i32::MAX }, goal, params);
        self.compact();
        report
    }

    /// Fills an empty mesh with a part of a run.
    fn fill(
        &mut self,
        run: &TetMesh,
        part: &Part,
        (numbers, surfaces): (&[u32], &HashMap<u32, PositionQuadric>),
        params: &SimplifyParams,
    ) {
        for &vertex in &part.vertices {
            self.push_vertex(run.positions[vertex as usize], false);
        }
        let mut shared = HashMap::new();
        for &tet in &part.tets {
            let corners = run.tet_vertices(tet as usize).map(|v| match numbers[v.index()] {
                SHARED => *shared.entry(v).or_insert_with(|| self.push_vertex(run.positions[v.index()], true)),
                number => number,
            });
            self.add_tet(run, tet as usize, corners, params);
        }
        self.spread(0, params.spread_weight);
        for (&vertex, number) in part.vertices.iter().zip(0..) {
            self.add_surface(number, surfaces.get(&vertex));
        }
    }

    /// Takes over blocks, in the same memory as far as possible.
    fn absorb_all(
        &mut self,
        blocks: Vec<(Self, SimplifyReport)>,
        glued: &mut HashMap<IVec3, u32>,
        spread_weight: f32,
    ) -> SimplifyReport {
        let added = |of: fn(&Self) -> usize| blocks.iter().map(|(block, _)| of(block)).sum();
        self.vertices.reserve_exact(added(|block| block.vertices.len()));
        self.tets.reserve_exact(added(|block| block.tets.len()));
        self.labels.reserve_exact(self.tets.capacity() - self.labels.len());
        let mut total = SimplifyReport::default();
        for (block, report) in blocks {
            self.absorb(block, glued, spread_weight);
            total.add(&report);
        }
        total
    }

    /// Takes over a block; its frozen vertices meet those of the same position in `glued`.
    fn absorb(&mut self, block: Self, glued: &mut HashMap<IVec3, u32>, spread_weight: f32) {
        let mut numbers = vec![NONE; block.vertices.len()];
        for (vertex, number) in block.vertices.iter().zip(&mut numbers).filter(|(vertex, _)| vertex.stamp != NONE) {
            let known = if vertex.frozen { glued.get(&vertex.position).copied() } else { None };
            *number = known.unwrap_or_else(|| {
                let new = self.push_vertex(vertex.position, vertex.frozen);
                self.vertices[new as usize].sides = vertex.sides;
                if vertex.frozen {
                    glued.insert(vertex.position, new);
                    self.wedge_mut(new, vertex.first.label).quadric.add(&Q::of_point(spread_weight));
                }
                new
            });
            let mut wedge = Some(&vertex.first);
            while let Some(own) = wedge {
                self.wedge_mut(*number, own.label).quadric.add(&own.quadric);
                wedge = block.overflow.get(own.next as usize);
            }
            self.add_surface(*number, block.surfaces.get(vertex.surface as usize));
        }
        for (tet, label) in block.tets.into_iter().zip(block.labels).filter(|(tet, _)| tet[0] != NONE) {
            self.tets.push(tet.map(|v| numbers[v as usize]));
            self.labels.push(label);
        }
    }
}

/// Bands across the picture's longer side.
#[derive(Clone, Copy)]
struct Bands {
    count: usize,
    /// By which part of a band they are moved.
    shift: f64,
    domain: Domain,
}

impl Bands {
    /// `whole` bands, or one more of which the first and the last are narrower.
    fn new(whole: usize, shift: f64, domain: Domain) -> Self {
        Self { count: whole + usize::from(shift > 0.0), shift, domain }
    }

    /// The band of each tet, by its corners.
    fn of_tets(&self, tets: usize, corners: impl Fn(usize) -> [IVec3; 4] + Send + Sync) -> Vec<u32> {
        const CHUNK: usize = 1 << 14;
        let mut of_tet = vec![0; tets];
        for_each(of_tet.chunks_mut(CHUNK).enumerate().collect(), |(n, chunk): (usize, &mut [u32])| {
            for (tet, band) in (n * CHUNK..).zip(chunk) {
                *band = self.of(corners(tet));
            }
        });
        of_tet
    }

    /// The band of the tet with these corners.
    fn of(&self, corners: [IVec3; 4]) -> u32 {
        let axis = usize::from(self.domain.height > self.domain.width);
        let middle = corners.iter().map(|p| f64::from(p[axis])).sum::<f64>() / 4.0;
        let whole = self.count as f64 - self.shift;
        let band = middle / f64::from(self.domain.extent()[axis]) * whole + self.shift;
        (band as u32).min(self.count as u32 - 1)
    }
}

/// A run in parts.
struct Split {
    parts: Vec<Part>,
    /// Of each vertex of the run, its number in the only part that has it, or [`SHARED`].
    numbers: Vec<u32>,
}

/// The tets of one band of a run, and the vertices that it alone has.
struct Part {
    tets: Vec<u32>,
    vertices: Vec<u32>,
}

fn split(run: &TetMesh, shift: f64, params: &SimplifyParams) -> Split {
    let bands = Bands::new(params.blocks(run.positions.len()), shift, run.domain);
    let of_tet = bands.of_tets(run.tets.len(), |tet| run.tet_positions(tet));
    let corners = (0..run.tets.len()).map(|tet| run.tet_vertices(tet).map(|v| v.0));
    let mut numbers = owners(run.positions.len(), corners.zip(of_tet.iter().copied()));
    let times = || run.positions.iter().map(|p| p.z);
    let ends = [times().min(), times().max()];
    let mut parts: Vec<Part> =
        by_band(&of_tet, bands.count).into_iter().map(|tets| Part { tets, vertices: Vec::new() }).collect();
    for ((vertex, number), position) in (0..).zip(&mut numbers).zip(&run.positions) {
        let sides = run.domain.sides(*position);
        let at_end = sides.contains(Sides::T_LOW) || sides.contains(Sides::T_HIGH);
        if ends.contains(&Some(position.z)) && !at_end {
            *number = SHARED;
        } else if let Some(part) = parts.get_mut(*number as usize) {
            *number = part.vertices.len() as u32;
            part.vertices.push(vertex);
        }
    }
    Split { parts, numbers }
}

/// The tets of each band.
fn by_band(of_tet: &[u32], count: usize) -> Vec<Vec<u32>> {
    let mut bands = vec![Vec::new(); count];
    for (tet, &band) in (0..).zip(of_tet) {
        bands[band as usize].push(tet);
    }
    bands
}

/// The only block that a vertex is in, or [`SHARED`].
fn owners(vertices: usize, tets: impl Iterator<Item = ([u32; 4], u32)>) -> Vec<u32> {
    let mut owners = vec![NONE; vertices];
    for (tet, block) in tets {
        for vertex in tet {
            let owner = &mut owners[vertex as usize];
            *owner = if *owner == NONE || *owner == block { block } else { SHARED };
        }
    }
    owners
}
