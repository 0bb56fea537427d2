//! Meshes to draw: regular lattices, moved and labelled at random.

use std::collections::BTreeMap;

use glam::{IVec3, Vec3};
use tetvec::mesh::{Domain, TetMesh, VertexId, Wedge, WedgeId, volume6};
use tetvec::video::Label;

/// A small generator of reproducible numbers (splitmix64).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// The next number.
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// One of `low..=high`.
    pub(crate) fn range(&mut self, low: i32, high: i32) -> i32 {
        low + (self.next() % (high - low + 1) as u64) as i32
    }
}

/// The lattice's unmoved vertices, in lattice units.
pub(crate) struct Lattice {
    pub(crate) domain: Domain,
    pub(crate) cells: [u32; 3],
}

impl Lattice {
    /// `cells` in x, y, t over a box of `size` pixels and frames at 1/8 px.
    pub(crate) fn new(size: [u32; 3], cells: [u32; 3]) -> Self {
        let domain = Domain { width: size[0], height: size[1], duration: size[2], subpixel_bits: 3 };
        Self { domain, cells }
    }

    fn index(&self, [x, y, t]: [u32; 3]) -> u32 {
        x + (self.cells[0] + 1) * (y + (self.cells[1] + 1) * t)
    }

    /// Six Kuhn tets a cell, one path along the axes each, over vertex numbers.
    fn tets(&self) -> Vec<[u32; 4]> {
        let paths = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        let [nx, ny, nt] = self.cells;
        let cells = (0..nt).flat_map(|t| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, t])));
        let tet = |cell: [u32; 3], path: [usize; 3]| {
            let mut corner = cell;
            let mut tet = [self.index(corner); 4];
            for (i, axis) in path.into_iter().enumerate() {
                corner[axis] += 1;
                tet[i + 1] = self.index(corner);
            }
            tet
        };
        cells.flat_map(|cell| paths.map(|path| tet(cell, path))).collect()
    }

    /// Vertices of the regular lattice, x fastest.
    pub(crate) fn positions(&self) -> Vec<IVec3> {
        let [nx, ny, nt] = self.cells;
        let e = self.domain.extent();
        let at = |i: u32, n: u32, extent: i32| (i64::from(extent) * i64::from(i) / i64::from(n)) as i32;
        let grid = (0..=nt).flat_map(|t| (0..=ny).flat_map(move |y| (0..=nx).map(move |x| [x, y, t])));
        grid.map(|[x, y, t]| IVec3::new(at(x, nx, e.x), at(y, ny, e.y), at(t, nt, e.z))).collect()
    }

    /// The mesh over these positions, with the label and the colour that the functions give. A tet's label may depend
    /// on its number and its lowest corner.
    pub(crate) fn mesh(
        &self,
        positions: Vec<IVec3>,
        mut label: impl FnMut(usize, IVec3) -> u32,
        mut color: impl FnMut(IVec3, Label) -> Vec3,
    ) -> TetMesh {
        let mut mesh = TetMesh::empty(self.domain);
        for position in positions {
            mesh.push_vertex(position);
        }
        let mut wedges = BTreeMap::new();
        for (i, mut tet) in self.tets().into_iter().enumerate() {
            let at = |v: u32| mesh.positions[v as usize];
            if volume6(at(tet[0]), at(tet[1]), at(tet[2]), at(tet[3])) < 0 {
                tet.swap(2, 3);
            }
            let label = Label(label(i, at(tet[0])));
            let corners = tet.map(|v| {
                *wedges.entry((v, label)).or_insert_with(|| {
                    let color = color(mesh.positions[v as usize], label);
                    mesh.wedges.push(Wedge { vertex: VertexId(v), label, color });
                    WedgeId(mesh.wedges.len() as u32 - 1)
                })
            });
            mesh.tets.push(corners);
        }
        mesh
    }

    /// Positions moved at random within the box, by at most a third of a cell, keeping every tet positive.
    pub(crate) fn jittered(&self, random: &mut Random) -> Vec<IVec3> {
        let mut positions = self.positions();
        let tets = self.tets();
        let mut stars = vec![Vec::new(); positions.len()];
        for (i, tet) in tets.iter().enumerate() {
            tet.iter().for_each(|&v| stars[v as usize].push(i));
        }
        let sign: Vec<i64> = tets.iter().map(|tet| volume(&positions, tet).signum()).collect();
        let e = self.domain.extent();
        let reach = e / IVec3::from_array(self.cells.map(|n| 3 * n as i32));
        for v in 0..positions.len() {
            let home = positions[v];
            let mut step = IVec3::from_array(reach.to_array().map(|r| random.range(-r, r)));
            for axis in 0..3 {
                if home[axis] == 0 || home[axis] == e[axis] {
                    step[axis] = 0;
                }
            }
            positions[v] = home + step;
            if stars[v].iter().any(|&tet| volume(&positions, &tets[tet]) * sign[tet] <= 0) {
                positions[v] = home;
            }
        }
        positions
    }

    /// A jittered mesh of one label and random colours.
    pub(crate) fn plain(&self, seed: u64) -> TetMesh {
        let mut random = Random(seed);
        let positions = self.jittered(&mut random);
        self.mesh(positions, |_, _| 0, |_, _| random_color(&mut random))
    }

    /// A jittered mesh whose tets are labelled at random: pinches and many-class vertices everywhere.
    pub(crate) fn wild(&self, seed: u64, labels: u64) -> TetMesh {
        let mut random = Random(seed);
        let positions = self.jittered(&mut random);
        let mut dice = Random(seed + 1);
        self.mesh(positions, |_, _| (dice.next() % labels) as u32, |_, _| random_color(&mut random))
    }

    /// A jittered mesh of a moving disc (label 1) before a background cut into halves (labels 0 and 2).
    pub(crate) fn disc(&self, seed: u64) -> TetMesh {
        let mut random = Random(seed);
        let positions = self.jittered(&mut random);
        let e = self.domain.extent().as_dvec3();
        let label = |_, corner: IVec3| {
            let p = corner.as_dvec3() / e;
            let center = 0.35 + 0.2 * p.z;
            if (p.x - center).hypot(p.y - 0.45) < 0.3 { 1 } else { 2 * u32::from(p.y > 0.5) }
        };
        self.mesh(positions, label, |_, _| random_color(&mut random))
    }
}

fn volume(positions: &[IVec3], tet: &[u32; 4]) -> i64 {
    let [a, b, c, d] = tet.map(|v| positions[v as usize]);
    volume6(a, b, c, d)
}

fn random_color(random: &mut Random) -> Vec3 {
    Vec3::from_array([(); 3].map(|()| random.range(0, 255) as f32))
}
