//! Meshes to write: jittered Kuhn lattices, thinned by random edge collapses until they are as irregular as those of
//! the simplifier, with labels and colours.

use std::collections::HashMap;

use glam::{IVec3, Vec3};
use tetvec::mesh::{Domain, TetMesh, VertexId, Wedge, WedgeId, volume6};
use tetvec::video::Label;

/// A small generator of pseudo-random numbers (xorshift).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// Uniform in [0, bound).
    pub(crate) fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((u128::from(self.0) * bound as u128) >> 64) as usize
    }

    fn around_zero(&mut self, radius: i32) -> i32 {
        self.below(2 * radius as usize + 1) as i32 - radius
    }
}

/// What to make.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MeshParams {
    pub(crate) domain: Domain,
    /// Cells of the lattice in x, y and t.
    pub(crate) cells: [i32; 3],
    /// Labels; their borders wander with t.
    pub(crate) labels: u32,
    /// Part of the vertices to remove by collapses, in percent.
    pub(crate) thinning: usize,
    pub(crate) seed: u64,
}

/// Tets with plain vertex numbers while they are worked on.
struct Draft {
    domain: Domain,
    positions: Vec<IVec3>,
    tets: Vec<Option<[u32; 4]>>,
    stars: Vec<Vec<u32>>,
}

/// A mesh whose wedges are known by vertex and label.
struct Colored {
    mesh: TetMesh,
    wedges: HashMap<(VertexId, u32), WedgeId>,
}

/// A mesh that tiles its box.
pub(crate) fn irregular_mesh(params: &MeshParams) -> TetMesh {
    let mut random = Random::new(params.seed);
    let mut draft = Draft::lattice(params.domain, params.cells);
    let extent = params.domain.extent();
    let cell = [0, 1, 2].map(|axis| extent[axis] / params.cells[axis]);
    for vertex in 0..draft.positions.len() {
        draft.jitter(vertex, cell.map(|c| random.around_zero(c * 2 / 5)));
    }
    let target = draft.positions.len() * params.thinning / 100;
    let mut removed = 0;
    for _ in 0..draft.positions.len() * 30 {
        if removed >= target {
            break;
        }
        let vertex = random.below(draft.positions.len());
        let Some(&tet) = draft.stars[vertex].get(random.below(draft.stars[vertex].len().max(1))) else { continue };
        let onto = draft.tets[tet as usize].expect("stars hold living tets")[random.below(4)] as usize;
        removed += usize::from(onto != vertex && draft.collapse(vertex, onto));
    }
    draft.finish(params, &mut random)
}

impl Draft {
    fn lattice(domain: Domain, cells: [i32; 3]) -> Self {
        let extent = domain.extent();
        let side = cells.map(|c| c + 1);
        let id = |at: [i32; 3]| ((at[2] * side[1] + at[1]) * side[0] + at[0]) as u32;
        let mut positions = Vec::new();
        for t in 0..side[2] {
            for y in 0..side[1] {
                for x in 0..side[0] {
                    let at = [x, y, t];
                    positions.push(IVec3::from_array([0, 1, 2].map(|a| extent[a] * at[a] / cells[a])));
                }
            }
        }
        let mut tets = Vec::new();
        // Kuhn's six tets of a cell: one for each order in which the axes are walked.
        for axes in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            for t in 0..cells[2] {
                for y in 0..cells[1] {
                    for x in 0..cells[0] {
                        let mut at = [x, y, t];
                        let mut corners = [id(at); 4];
                        for (step, &axis) in axes.iter().enumerate() {
                            at[axis] += 1;
                            corners[step + 1] = id(at);
                        }
                        let [a, b, c, d] = corners.map(|v| positions[v as usize]);
                        if volume6(a, b, c, d) < 0 {
                            corners.swap(2, 3);
                        }
                        tets.push(Some(corners));
                    }
                }
            }
        }
        let mut stars = vec![Vec::new(); positions.len()];
        for (number, corners) in tets.iter().enumerate() {
            corners.iter().flatten().for_each(|&v| stars[v as usize].push(number as u32));
        }
        Self { domain, positions, tets, stars }
    }

    fn is_positive(&self, corners: [u32; 4]) -> bool {
        let [a, b, c, d] = corners.map(|v| self.positions[v as usize]);
        volume6(a, b, c, d) > 0
    }

    /// Moves a vertex within the sides it lies on, unless a tet would flip.
    fn jitter(&mut self, vertex: usize, by: [i32; 3]) {
        let before = self.positions[vertex];
        let extent = self.domain.extent();
        for axis in 0..3 {
            if before[axis] != 0 && before[axis] != extent[axis] {
                self.positions[vertex][axis] += by[axis];
            }
        }
        if !self.stars[vertex].iter().all(|&t| self.is_positive(self.tets[t as usize].expect("living"))) {
            self.positions[vertex] = before;
        }
    }

    /// Collapses `vertex` onto its neighbour `onto`, unless that would flip a tet or dent a side of the box.
    fn collapse(&mut self, vertex: usize, onto: usize) -> bool {
        let sides = |v: usize| self.domain.sides(self.positions[v]);
        if !sides(onto).contains(sides(vertex)) {
            return false;
        }
        let moved = |corners: [u32; 4]| corners.map(|v| if v as usize == vertex { onto as u32 } else { v });
        let star = std::mem::take(&mut self.stars[vertex]);
        let living = |t: u32| self.tets[t as usize].expect("living");
        let (gone, kept): (Vec<u32>, Vec<u32>) = star.iter().partition(|&&t| living(t).contains(&(onto as u32)));
        if !kept.iter().all(|&t| self.is_positive(moved(living(t)))) {
            self.stars[vertex] = star;
            return false;
        }
        for t in kept {
            self.tets[t as usize] = self.tets[t as usize].map(moved);
            self.stars[onto].push(t);
        }
        for t in gone {
            for v in self.tets[t as usize].take().expect("living") {
                self.stars[v as usize].retain(|&other| other != t);
            }
        }
        true
    }

    /// Numbers what is left, and gives it labels and colours.
    fn finish(self, params: &MeshParams, random: &mut Random) -> TetMesh {
        let extent = self.domain.extent();
        let centers: Vec<[IVec3; 2]> = (0..params.labels)
            .map(|_| [0, 1].map(|_| IVec3::from_array([0, 1, 2].map(|a| random.below(extent[a] as usize) as i32))))
            .collect();
        let label_at = |p: IVec3| {
            let distance = |&[from, to]: &[IVec3; 2]| {
                let c = (from * (extent.z - p.z) + to * p.z) / extent.z;
                (c.x - p.x).pow(2) + (c.y - p.y).pow(2)
            };
            (0..params.labels).min_by_key(|&l| distance(&centers[l as usize])).unwrap_or(0)
        };
        let mut draft = Colored { mesh: TetMesh::empty(self.domain), wedges: HashMap::new() };
        let mut number = vec![None; self.positions.len()];
        let mut tets: Vec<[u32; 4]> = self.tets.into_iter().flatten().collect();
        // Earliest first, as the encoder commits them.
        tets.sort_by_key(|corners| corners.iter().map(|&v| self.positions[v as usize].z).min());
        for corners in tets {
            let label = label_at(corners.iter().map(|&v| self.positions[v as usize]).sum::<IVec3>() / 4);
            let wedges = corners.map(|v| {
                let vertex =
                    *number[v as usize].get_or_insert_with(|| draft.mesh.push_vertex(self.positions[v as usize]));
                wedge_of(&mut draft, vertex, label, random)
            });
            draft.mesh.tets.push(wedges);
        }
        let mut mesh = draft.mesh;
        for vertex in 0..mesh.pinned.len() {
            mesh.pinned[vertex] = random.below(50) == 0;
        }
        mesh
    }
}

/// The wedge of `label` at `vertex`; its colour is smooth within the label, with a little noise.
fn wedge_of(draft: &mut Colored, vertex: VertexId, label: u32, random: &mut Random) -> WedgeId {
    let Colored { mesh, wedges } = draft;
    *wedges.entry((vertex, label)).or_insert_with(|| {
        let p = mesh.positions[vertex.index()].as_vec3() / mesh.domain.unit() as f32;
        let wave = |scale: f32, phase: f32| (p.x * scale + p.z * 0.05).sin() * (p.y * scale + phase).cos();
        let base = Vec3::new((label % 7) as f32 * 30.0, (label % 5) as f32 * 40.0, (label % 3) as f32 * 60.0);
        let noise = Vec3::from_array([0; 3].map(|_| random.around_zero(60) as f32 / 10.0));
        let color = base + Vec3::splat(90.0 * wave(0.05, 1.0)) + Vec3::new(10.0, 0.0, -20.0) * wave(0.02, 0.5) + noise;
        // Label numbers of the source mean nothing to the stream, so let them not be its own.
        mesh.push_wedge(Wedge { vertex, label: Label(1000 - label), color })
    })
}
