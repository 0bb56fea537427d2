//! Swaps: other tets between the same vertices, where the worst of them becomes better.
//!
//! In: a mesh in which edges collapse. Out: the same volume of each label, cut into other tets. Edges inside of a label are
//! removed, the ring of 3 to 7 vertices around each being triangulated anew (Shewchuk, "Two discrete optimization algorithms
//! for the topological improvement of tetrahedral meshes", 2002; the triangulation after Klincsek 1980), or an edge is put
//! through a face. Surfaces between labels and the box's sides stay as they are. Forbidden here: moving vertices, collapsing.

use glam::Vec3;

use super::legality::{Form, Limits};
use super::quadric::WedgeQuadric;
use super::work_mesh::{NONE, WorkMesh};
use crate::mesh::{EDGES, FACES};

/// Most tets around an edge that is removed.
const MOST_RING: usize = 7;
/// Quality from which on a tet is left alone: a mean ratio of 0.46.
const GOOD: f32 = 0.1;
/// How many times better the worst tet must become.
const BETTER: f32 = 1.1;
/// Quality of what there is none of.
const BEST: f32 = 1.0;

impl<Q: WedgeQuadric> WorkMesh<Q> {
    /// Swaps where that changes colours by no more than `price` each time.
    pub(super) fn swap(&mut self, limits: &Limits, price: f32) {
        let quality = |corners: &[u32; 4]| match corners {
            [NONE, ..] => BEST,
            corners => self.quality_of(*corners, limits),
        };
        let qualities = self.tets.iter().map(quality).collect();
        let (old, ring, new) = Default::default();
        let mut swapper = Swapper { mesh: self, limits, price, qualities, old, ring, new };
        for tet in 0..swapper.mesh.tets.len() {
            swapper.improve(tet as u32);
        }
    }
}

struct Swapper<'a, Q> {
    mesh: &'a mut WorkMesh<Q>,
    limits: &'a Limits,
    price: f32,
    /// Of each tet.
    qualities: Vec<f32>,
    /// The tets of a swap, by number.
    old: Vec<u32>,
    /// The vertices around their edge, in the order in which the edge, a vertex and the next make a positive tet.
    ring: Vec<u32>,
    /// The tets in their place.
    new: Vec<[u32; 4]>,
}

impl<Q: WedgeQuadric> Swapper<'_, Q> {
    /// Makes the first swap that is worth it for a tet that is not good.
    fn improve(&mut self, tet: u32) {
        if self.qualities[tet as usize] >= GOOD {
            return;
        }
        let corners = self.mesh.tets[tet as usize];
        for edge in EDGES {
            if self.remove_edge(tet, edge.map(|n| corners[n])) {
                return;
            }
        }
        for face in FACES {
            if self.pierce(tet, face.map(|n| corners[n])) {
                return;
            }
        }
    }

    fn quality(&self, corners: [u32; 4]) -> f32 {
        self.mesh.quality_of(corners, self.limits)
    }

    /// Removes an edge if other tets in its place are better than `tet`, the worst there.
    fn remove_edge(&mut self, tet: u32, [u, v]: [u32; 2]) -> bool {
        let before = self.qualities[tet as usize];
        if !self.gather(u, v, before) || !self.find_ring(u, v) {
            return false;
        }
        if self.change_of_colors(self.ring.iter().copied().chain([u, v])) > self.price {
            return false;
        }
        let triangulation =
            Triangulation::of_ring(&self.ring, |[a, b, c]| self.quality([u, a, b, c]).min(self.quality([a, v, b, c])));
        if triangulation.worst() <= BETTER * before.max(0.0) {
            return false;
        }
        self.new.clear();
        let (ring, new) = (&self.ring, &mut self.new);
        triangulation.for_each(|triangle| {
            let [a, b, c] = triangle.map(|n| ring[n]);
            new.extend([[u, a, b, c], [a, v, b, c]]);
        });
        self.replace();
        true
    }

    /// Finds the tets around an edge, if they are few, of one label, and none of them is worse than `worst`. Most edges are given
    /// up at the first that is.
    fn gather(&mut self, u: u32, v: u32, worst: f32) -> bool {
        let Self { mesh, old, qualities, .. } = self;
        old.clear();
        for tet in mesh.around_edge(u, v) {
            let first = *old.first().unwrap_or(&tet);
            let is_alike = mesh.labels[tet as usize] == mesh.labels[first as usize];
            if old.len() == MOST_RING || !is_alike || qualities[tet as usize] < worst {
                return false;
            }
            old.push(tet);
        }
        old.len() >= 3
    }

    /// Finds the vertices around an edge, if the tets there go all around.
    fn find_ring(&mut self, u: u32, v: u32) -> bool {
        let Self { mesh, old, ring, .. } = self;
        let count = old.len();
        let mut steps = [[NONE; 2]; MOST_RING];
        for (step, &tet) in steps.iter_mut().zip(&*old) {
            *step = others(mesh.tets[tet as usize], u, v);
        }
        ring.clear();
        let mut at = steps[0][0];
        for _ in 0..count {
            ring.push(at);
            let Some(step) = steps[..count].iter().find(|step| step[0] == at) else { return false };
            at = step[1];
        }
        at == ring[0] && (1..count).all(|n| !ring[..n].contains(&ring[n]))
    }

    /// Puts an edge through a face inside of a label: two tets become three, if these are better.
    fn pierce(&mut self, tet: u32, face: [u32; 3]) -> bool {
        let mesh = &*self.mesh;
        let holds = |&&other: &&u32| other != tet && face.iter().all(|v| mesh.tets[other as usize].contains(v));
        let stars = face.map(|v| mesh.stars.star(v));
        let smallest = stars.into_iter().min_by_key(|star| star.len()).unwrap_or_default();
        let Some(&other) = smallest.iter().find(holds) else { return false };
        if mesh.labels[other as usize] != mesh.labels[tet as usize] {
            return false;
        }
        let [own, across] = [tet, other].map(|tet| mesh.tets[tet as usize]);
        let Some(&apex) = across.iter().find(|v| !face.contains(v)) else { return false };
        let before = self.qualities[tet as usize].min(self.qualities[other as usize]);
        self.new.clear();
        self.new.extend(face.map(|gone| own.map(|v| if v == gone { apex } else { v })));
        if self.new.iter().map(|&new| self.quality(new)).fold(BEST, f32::min) <= BETTER * before.max(0.0) {
            return false;
        }
        self.old.clear();
        self.old.extend([tet, other]);
        if self.change_of_colors(own.into_iter().chain([apex])) > self.price {
            return false;
        }
        self.replace();
        true
    }

    /// Puts the new tets in the place of the old ones.
    fn replace(&mut self) {
        let Self { mesh, qualities, .. } = self;
        let label = mesh.labels[self.old[0] as usize];
        for &tet in &self.old {
            qualities[tet as usize] = BEST;
            for v in std::mem::replace(&mut mesh.tets[tet as usize], [NONE; 4]) {
                mesh.stars.remove(v, tet);
            }
        }
        let mut free = self.old.iter().copied();
        for &corners in &self.new {
            let tet = free.next().unwrap_or_else(|| {
                mesh.tets.push([NONE; 4]);
                mesh.labels.push(label);
                qualities.push(BEST);
                mesh.tets.len() as u32 - 1
            });
            mesh.tets[tet as usize] = corners;
            qualities[tet as usize] = mesh.quality_of(corners, self.limits);
            corners.iter().for_each(|&v| mesh.stars.add(v, tet));
        }
    }

    /// At most what the squared colour changes by if the old tets are replaced by others of the same vertices, integrated
    /// over them: within them colours are between those of the vertices, and on their surface they stay.
    fn change_of_colors(&self, vertices: impl Iterator<Item = u32>) -> f32 {
        let mesh = &*self.mesh;
        let label = mesh.labels[self.old[0] as usize];
        let mut colors = [Vec3::ZERO; MOST_RING + 2];
        let wedges = vertices.filter_map(|v| mesh.wedge(v, label));
        let count = colors.iter_mut().zip(wedges).map(|(color, w)| *color = w.quadric.color_at(Vec3::ZERO)).count();
        let colors = &colors[..count];
        let mean = colors.iter().sum::<Vec3>() / count.max(1) as f32;
        let spread = colors.iter().map(|color| color.distance_squared(mean)).fold(0.0, f32::max);
        let volume6 = |&tet: &u32| Form::of(mesh.tets[tet as usize].map(|v| mesh.places[v as usize])).volume6 as f32;
        let unit = mesh.domain.unit() as f32;
        // The square of a hat over a simplex has a tenth of the simplex's volume.
        spread * self.old.iter().map(volume6).sum::<f32>() / (60.0 * unit.powi(3))
    }
}

/// The triangulation of a ring whose worst triangle is best, by its number from vertex to vertex.
struct Triangulation {
    len: usize,
    /// Of the part of the ring from one vertex to another: the quality of its worst triangle, and the third vertex of the one
    /// between the two.
    parts: [[(f32, usize); MOST_RING]; MOST_RING],
}

impl Triangulation {
    fn of_ring(ring: &[u32], quality: impl Fn([u32; 3]) -> f32) -> Self {
        let mut parts = [[(BEST, 0); MOST_RING]; MOST_RING];
        for length in 2..ring.len() {
            for first in 0..ring.len() - length {
                let last = first + length;
                let between = (first + 1..last).map(|n| {
                    let own = quality([first, n, last].map(|n| ring[n]));
                    (own.min(parts[first][n].0).min(parts[n][last].0), n)
                });
                parts[first][last] = between.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((BEST, 0));
            }
        }
        Self { len: ring.len(), parts }
    }

    fn worst(&self) -> f32 {
        self.parts[0][self.len - 1].0
    }

    /// Calls `found` with each triangle.
    fn for_each(&self, mut found: impl FnMut([usize; 3])) {
        let mut waiting = vec![(0, self.len - 1)];
        while let Some((first, last)) = waiting.pop() {
            if last - first > 1 {
                let between = self.parts[first][last].1;
                found([first, between, last]);
                waiting.extend([(first, between), (between, last)]);
            }
        }
    }
}

/// The corners of a positive tet beside `u` and `v`, in the order in which these and they make a positive tet.
fn others(corners: [u32; 4], u: u32, v: u32) -> [u32; 2] {
    let at = |w: u32| corners.iter().position(|&corner| corner == w).unwrap_or(0);
    let (i, j) = (at(u), at(v));
    let mut rest = (0..4).filter(|&n| n != i && n != j);
    let (k, l) = (rest.next().unwrap_or(0), rest.next().unwrap_or(0));
    let order = [i, j, k, l];
    let pairs = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b)));
    let is_even = pairs.filter(|&(a, b)| order[a] > order[b]).count() % 2 == 0;
    if is_even { [corners[k], corners[l]] } else { [corners[l], corners[k]] }
}
