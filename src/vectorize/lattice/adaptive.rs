//! The adaptive lattice: newest-vertex bisection of coarse cells, refined where colour or labels ask for it, straight
//! from the pixels. The dense lattice is never built.
//!
//! In: layers of frames, each starting with the last one's last plane. Out: a [`TetLattice`] a layer, one layer late:
//! what the next layer needs in the plane they share must be known first. Layers, cells and tets conform.

use std::sync::Arc;

use glam::{IVec3, Vec3};

use super::axis::{Axis, CELL};
use super::bisect::{Bisection, Leaves};
use super::importance::Importance;
use super::labels::{Crossing, LayerLabels, step_between};
use super::samples::{Grid, LEVELS, pyramid};
use super::{LatticeError, check};
use crate::mesh::{Domain, EDGES};
use crate::vectorize::parallel::map;
use crate::video::{Edges, Frame, Label, LabelPlane};

/// Tets over vertices of a lattice, before labels split them.
#[derive(Debug, Clone)]
pub struct TetLattice {
    /// The slab's box, of which the lattice covers a run of frames.
    pub domain: Domain,
    /// Of the vertices, in lattice units, t since the slab's first frame; ascending by (t, y, x).
    pub positions: Vec<IVec3>,
    /// Of the vertices.
    pub labels: Vec<Label>,
    /// Of the vertices, in 8-bit levels: of the pixel there, or smoothed over as much as the tets around span.
    pub colors: Vec<Vec3>,
    /// Corners of the tets, all of positive volume. Those of three or four labels have corners next to each other, as in
    /// the dense lattice.
    pub tets: Vec<[u32; 4]>,
    /// Where edges between labels are cut; ascending by edge.
    pub cuts: Vec<EdgeCut>,
}

/// The cut of an edge between two labels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeCut {
    /// Its vertices, ascending.
    pub edge: [u32; 2],
    /// How far along from the first, strictly between 0 and 1.
    pub share: f32,
    /// Of the pixels on either side, in 8-bit levels.
    pub colors: [Vec3; 2],
}

/// Builds lattices layer by layer.
#[derive(Debug)]
pub struct AdaptiveLattice {
    domain: Domain,
    vertices_per_pixel: f64,
    repeats: f64,
    waiting: Option<Layer>,
}

/// A layer that waits for the next one.
#[derive(Debug)]
struct Layer {
    axes: [Axis; 3],
    pyramid: [Grid; LEVELS],
    labels: LayerLabels,
    importance: Importance,
    /// Of each plane, where they are known.
    edges: Vec<Option<Edges>>,
}

impl AdaptiveLattice {
    /// Most frame steps of a layer.
    pub const MAX_STEPS: u32 = CELL as u32;
    /// Fewest frame steps of a layer, and fewest pixels of a picture's side, where labels are to be cut: below, lines lie
    /// too close for the points between.
    pub const MIN_CUT: u32 = 5;
    /// Fewest binary digits after the point.
    pub const MIN_SUBPIXEL_BITS: u8 = 3;

    /// Lattices in the slab that `domain` describes, of about `vertices_per_pixel` vertices a pixel and frame beside those
    /// that labels need.
    pub fn new(domain: Domain, vertices_per_pixel: f64) -> Self {
        Self { domain, vertices_per_pixel, repeats: 1.0, waiting: None }
    }

    /// What a vertex counts at which nothing changes from step to step: less than 1 where it collapses at no cost, so that detail
    /// that stands still has more of them.
    pub fn with_repeats(self, repeats: f64) -> Self {
        Self { repeats, ..self }
    }

    /// Takes the next layer, whose first plane, frame number `first` of the slab, is the last of the one before; gives the
    /// lattice of that one.
    ///
    /// # Errors
    /// As [`super::Lattice::try_new`]; a layer of more than [`Self::MAX_STEPS`] steps counts as too many planes.
    pub fn push(
        &mut self,
        first: u32,
        frames: &[Arc<Frame>],
        labels: &[LabelPlane],
    ) -> Result<Option<TetLattice>, LatticeError> {
        let unit = i64::from(self.domain.unit());
        let times: Vec<i64> = (i64::from(first)..).map(|frame| frame * unit).take(frames.len()).collect();
        self.push_planes(&times, frames, labels)
    }

    /// The same with planes between frames, too: `times` are those of all planes, ascending, in lattice units. Up to
    /// twice as many planes make a layer.
    ///
    /// # Errors
    /// As [`Self::push`]; planes without a time count as missing.
    pub fn push_planes(
        &mut self,
        times: &[i64],
        frames: &[Arc<Frame>],
        labels: &[LabelPlane],
    ) -> Result<Option<TetLattice>, LatticeError> {
        let unit = i64::from(self.domain.unit());
        let last = times.last().map_or(0, |&time| (time.max(0) as u64).div_ceil(unit as u64));
        check(self.domain, Self::MIN_SUBPIXEL_BITS, last, frames, labels)?;
        let most = if times.iter().all(|time| time % unit == 0) { Self::MAX_STEPS } else { 2 * Self::MAX_STEPS };
        let is_ascending = times.windows(2).all(|pair| pair[0] < pair[1]);
        if frames.len() > most as usize + 1 || times.len() != frames.len() || !is_ascending || times[0] < 0 {
            return Err(LatticeError::PlaneCount { frames: frames.len(), labels: labels.len() });
        }
        // What was checked fits.
        let times: Vec<i32> = times.iter().map(|&time| time as i32).collect();
        let mut layer = self.layer(&times, frames, labels);
        let done = self.waiting.take().map(|mut before| {
            before.importance.join(&mut layer.importance);
            before.importance.saturate();
            before.lattice(self.domain)
        });
        self.waiting = Some(layer);
        Ok(done)
    }

    /// The lattice of the last layer, if there is one.
    pub fn finish(&mut self) -> Option<TetLattice> {
        let mut layer = self.waiting.take()?;
        layer.importance.saturate();
        Some(layer.lattice(self.domain))
    }

    fn layer(&self, times: &[i32], frames: &[Arc<Frame>], labels: &[LabelPlane]) -> Layer {
        let unit = self.domain.unit();
        let axes = [
            Axis::of_pixels(self.domain.width, unit),
            Axis::of_pixels(self.domain.height, unit),
            Axis::of_planes(times),
        ];
        let planes: Vec<(&Arc<Frame>, &LabelPlane)> = frames.iter().zip(labels).collect();
        // What is blended at edges is for the cuts to say.
        let pure: Vec<Arc<Frame>> =
            planes.iter().map(|(frame, labels)| labels.pure_colors().unwrap_or(frame).clone()).collect();
        let edges = map(planes, |(frame, labels)| Edges::new(frame, labels));
        let pyramid = pyramid(&axes, &pure);
        let mut importance = Importance::of_colors(&axes, &pyramid);
        importance.saturate();
        let frames = f64::from(times[times.len() - 1] - times[0]) / f64::from(unit);
        let pixels = f64::from(self.domain.width) * f64::from(self.domain.height) * frames;
        let count = (self.vertices_per_pixel * pixels) as usize;
        let threshold = importance.threshold(count, self.repeats, &pyramid);
        importance.normalize(threshold);
        let labels = LayerLabels::new(&axes, labels);
        if let LayerLabels::Mixed(labels) = &labels {
            importance.need(|vertex, step| labels.need(vertex, step));
            importance.saturate();
        }
        Layer { axes, pyramid, labels, importance, edges }
    }
}

impl Layer {
    /// The tets whose vertices are important enough, with what is known at their corners.
    fn lattice(&self, domain: Domain) -> TetLattice {
        let leaves = self.leaves();
        let levels = self.levels(&leaves);
        let mut lattice = TetLattice {
            domain,
            positions: Vec::new(),
            labels: Vec::new(),
            colors: Vec::new(),
            tets: Vec::with_capacity(leaves.iter().map(|part| part.tets.len()).sum()),
            cuts: Vec::new(),
        };
        let mut numbers = vec![0; levels.len()];
        for (index, &level) in levels.iter().enumerate().filter(|&(_, &level)| level != ABSENT) {
            numbers[index] = lattice.positions.len() as u32;
            let vertex = self.vertex(index as u32);
            lattice.positions.push(IVec3::from_array(std::array::from_fn(|a| self.axes[a].lines()[vertex[a]].place)));
            lattice.labels.push(self.labels.at(vertex));
            lattice.colors.push(self.color(vertex, level));
        }
        lattice.cuts = self.cuts(&leaves, &numbers);
        for part in leaves {
            lattice.tets.extend(part.tets.into_iter().map(|tet| tet.map(|v| numbers[v as usize])));
        }
        lattice
    }

    /// The level of the pyramid that each vertex is sampled at: the finest that a tet of its asks for, and pixels alone
    /// where labels meet.
    fn levels(&self, leaves: &[Leaves]) -> Vec<u8> {
        let mut levels = vec![ABSENT; self.importance.size().iter().product()];
        for part in leaves {
            for (tet, &level) in part.tets.iter().zip(&part.levels) {
                let level = if self.is_mixed(tet) { 0 } else { level };
                for &v in tet {
                    levels[v as usize] = levels[v as usize].min(level);
                }
            }
        }
        levels
    }

    fn is_mixed(&self, tet: &[u32; 4]) -> bool {
        let LayerLabels::Mixed(labels) = &self.labels else { return false };
        let [first, rest @ ..] = tet.map(|v| labels.at(self.vertex(v)));
        rest.into_iter().any(|label| label != first)
    }

    /// Cuts of the leaves' edges between labels.
    fn cuts(&self, leaves: &[Leaves], numbers: &[u32]) -> Vec<EdgeCut> {
        let LayerLabels::Mixed(labels) = &self.labels else { return Vec::new() };
        let mixed = leaves.iter().flat_map(|part| &part.tets).filter(|tet| self.is_mixed(tet));
        let edges = mixed.flat_map(|tet| EDGES.map(|ends| ends.map(|end| tet[end])));
        let mut edges: Vec<[u32; 2]> = edges.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        edges.sort_unstable();
        edges.dedup();
        let cut = |edge: [u32; 2]| {
            let ends = edge.map(|v| self.vertex(v));
            let crossing = labels.crossing(ends)?;
            let share = self.along(ends, &crossing, self.share(&crossing));
            let colors = crossing.samples.map(|sample| self.color(sample, 0));
            Some(EdgeCut { edge: edge.map(|v| numbers[v as usize]), share, colors })
        };
        edges.into_iter().filter_map(cut).collect()
    }

    /// Indices along x, y, t of a vertex by its number in the layer.
    #[inline]
    fn vertex(&self, index: u32) -> [usize; 3] {
        let ([columns, lines, _], index) = (self.importance.size(), index as usize);
        [index % columns, index / columns % lines, index / (columns * lines)]
    }

    /// How far along its edge a crossing lies that is `share` of the way from its first sample to the next: lines are not
    /// everywhere equally far apart.
    fn along(&self, ends: [[usize; 3]; 2], crossing: &Crossing, share: f32) -> f32 {
        let axis = (0..3).find(|&axis| ends[0][axis].abs_diff(ends[1][axis]) == crossing.steps).unwrap_or(0);
        let lines = self.axes[axis].lines();
        let place = |n: usize| lines[step_between(ends.map(|end| end[axis]), n, crossing.steps)].place as f32;
        let [before, after] = [crossing.before, crossing.before + 1].map(place);
        (before + share * (after - before) - place(0)) / (place(crossing.steps) - place(0))
    }

    /// How far from its first sample to the next a crossing lies: within a plane where the edge is, from one plane to
    /// another by how far the edge is in each. Halfway where that is not known.
    fn share(&self, crossing: &Crossing) -> f32 {
        let pixel = |vertex: [usize; 3]| {
            let [x, y, t] = std::array::from_fn(|axis| self.axes[axis].lines()[vertex[axis]].sample());
            Some(([x? as u32, y? as u32], t?))
        };
        let [first, second] = crossing.samples.map(pixel);
        let (Some((p, before)), Some((q, after))) = (first, second) else { return 0.5 };
        let edges = [before, after].map(|plane| self.edges[plane].as_ref());
        if before == after {
            return edges[0].filter(|_| p != q).map_or(0.5, |edges| edges.share(p, q));
        }
        let [from_p, from_q] = [(edges[0], p, crossing.labels[1]), (edges[1], q, crossing.labels[0])]
            .map(|(edges, at, label)| edges.map_or(1.0, |edges| edges.distance(at, label)));
        (from_p / (from_p + from_q)).clamp(MARGIN, 1.0 - MARGIN)
    }

    fn color(&self, vertex: [usize; 3], level: u8) -> Vec3 {
        let color = self.pyramid[usize::from(level)].at(vertex.map(|n| n >> level));
        Vec3::from_array(color.map(f32::from))
    }

    /// Leaves by rows of cells.
    fn leaves(&self) -> Vec<Leaves> {
        let size = self.importance.size();
        let is_wanted = |vertex: [usize; 3]| self.importance.at(vertex) > 1.0;
        let cells = |steps: usize| (0..steps - 1).step_by(CELL);
        let rows = cells(size[2]).flat_map(|z| cells(size[1]).map(move |y| (y, z))).collect();
        map(rows, |(y, z)| {
            let mut bisection = Bisection::new(size, &is_wanted);
            cells(size[0]).for_each(|x| bisection.add_cell([x, y, z]));
            bisection.finish()
        })
    }
}

/// Closest to a sample that a crossing lies, of the way to the next.
const MARGIN: f32 = 0.05;

/// Level of a vertex that no leaf has.
const ABSENT: u8 = u8::MAX;
