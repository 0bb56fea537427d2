//! Subdivision as sparse linear maps from the control mesh: what a fit solves through.

use std::ops::{AddAssign, Mul};

use super::complex::Complex;
use super::level::Level;
use super::rings::NodeMask;
use crate::mesh::TetMesh;

/// A sparse matrix in compressed rows: row r of the fine mesh is the sum of `weight[i]` * control value `source[i]`
/// over i in `start[r]..start[r + 1]`. Weights of a row add up to 1; sources ascend within a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Masks {
    /// Where each row starts; one entry more than rows.
    pub start: Vec<u32>,
    /// Control wedges (colours) or control vertices (positions).
    pub source: Vec<u32>,
    /// Weights.
    pub weight: Vec<f32>,
    /// Number of control values.
    pub sources: usize,
}

impl Masks {
    /// Number of fine values.
    pub fn rows(&self) -> usize {
        self.start.len() - 1
    }

    /// (control number, weight) of fine value `row`.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (u32, f32)> {
        let range = self.start[row] as usize..self.start[row + 1] as usize;
        self.source[range.clone()].iter().copied().zip(self.weight[range].iter().copied())
    }

    /// Fine values from control values (`sources` of them; panics with fewer).
    pub fn apply<V>(&self, control: &[V]) -> Vec<V>
    where
        V: Copy + Default + AddAssign + Mul<f32, Output = V>,
    {
        let blend = |row| {
            let mut sum = V::default();
            for (source, weight) in self.row(row) {
                sum += control[source as usize] * weight;
            }
            sum
        };
        (0..self.rows()).map(blend).collect()
    }

    /// The transpose: control values gather from `fine` (one a row; panics with fewer), rows in ascending order.
    pub fn apply_transpose<V>(&self, fine: &[V]) -> Vec<V>
    where
        V: Copy + Default + AddAssign + Mul<f32, Output = V>,
    {
        let mut control = vec![V::default(); self.sources];
        for (row, &value) in (0..self.rows()).zip(fine) {
            for (source, weight) in self.row(row) {
                control[source as usize] += value * weight;
            }
        }
        control
    }
}

/// How colours of fine nodes ([`super::Refined::nodes`]) follow from colours of control wedges.
pub fn color_masks(mesh: &TetMesh, levels: u8) -> Masks {
    let complex = Complex::new(mesh);
    let nodes = complex.nodes.len();
    compose(complex, nodes, levels, |_, level, masks| {
        masks.extend(level.masks.iter().map(|mask| blend(mask, &level.rings, |node| node)));
    })
}

/// How positions of fine points ([`super::Refined::points`]) follow from control vertices, up to the rounding of
/// fine positions.
pub fn position_masks(mesh: &TetMesh, levels: u8) -> Masks {
    let complex = Complex::new(mesh);
    let points = complex.points.len();
    compose(complex, points, levels, |below, level, rows| {
        rows.resize(level.complex.points.len(), Vec::new());
        for (node, mask) in level.masks.iter().enumerate() {
            let row = &mut rows[level.complex.point(node as u32) as usize];
            if row.is_empty() {
                *row = blend(&super::level::pinned_mask(below, mask), &level.rings, |node| below.point(node));
            }
        }
    })
}

/// A row over the level below: (source, weight).
type Row = Vec<(u32, f64)>;

/// Multiplies the maps of all levels; `rows` pushes those of one.
fn compose(mut complex: Complex, sources: usize, levels: u8, rows: impl Fn(&Complex, &Level, &mut Vec<Row>)) -> Masks {
    let mut total: Vec<Row> = (0..sources as u32).map(|source| vec![(source, 1.0)]).collect();
    for _ in 0..levels {
        let level = Level::new(&complex);
        let mut step = Vec::new();
        rows(&complex, &level, &mut step);
        total = step.iter().map(|row| product(row, &total)).collect();
        complex = level.complex;
    }
    let mut masks = Masks { start: vec![0], source: Vec::new(), weight: Vec::new(), sources };
    for row in total {
        masks.source.extend(row.iter().map(|(source, _)| source));
        masks.weight.extend(row.iter().map(|&(_, weight)| weight as f32));
        masks.start.push(masks.source.len() as u32);
    }
    masks
}

fn blend(mask: &NodeMask, rings: &[u32], source: impl Fn(u32) -> u32) -> Row {
    let weight = |w: u32| f64::from(w) / f64::from(mask.den);
    let mut row = vec![(source(mask.near), weight(mask.own))];
    if mask.is_edge() {
        row.push((source(mask.far), weight(mask.own)));
    }
    row.extend(rings[mask.start as usize..mask.end as usize].iter().map(|&node| (source(node), weight(mask.ring))));
    row
}

fn product(row: &Row, below: &[Row]) -> Row {
    let mut terms: Row = Vec::new();
    for &(middle, outer) in row {
        terms.extend(below[middle as usize].iter().map(|&(source, inner)| (source, outer * inner)));
    }
    terms.sort_by_key(|&(source, _)| source);
    terms.dedup_by(|next, sum| {
        let same = next.0 == sum.0;
        if same {
            sum.1 += next.1;
        }
        same
    });
    terms
}
