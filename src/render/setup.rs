//! Polygons of a slice to pieces, which are ready to be painted: where each is seen, what it covers, its colour.
//!
//! In: polygons side by side. Out: pieces, one by one. Polygons that smoothing turned over are not drawn. The slice covers
//! every pixel once, counted with sign, as the box stays in place under subdivision; so each pixel has a polygon that was
//! not turned over, and the last of them is shown.
//!
//! Most polygons cover a few pixels, so this is most of the work where pictures are small: nothing branches on what a polygon
//! looks like until all is known of it, and a quarter of them turns out to cover nothing.
#![expect(clippy::needless_range_loop, reason = "many lists are walked side by side, lane by lane")]

use super::canvas::{ColorSpace, PART};
use super::cpu::{self, Kernel};
use super::lanes::{LANES, Lanes, ceil, least, most, whole};
use super::piece::{Patch, Piece, Pieces};
use super::run::{FRACTION, Run, Way, clamped};
use super::scan::{Edge, Outline, ROWS, Span, Turning, span};
use super::slice::Polygons;
use super::view::View;

/// What pieces are made for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Making<'a> {
    pub(super) view: &'a View,
    pub(super) space: ColorSpace,
    pub(super) antialias: bool,
}

/// x and y of corners in pixels, on the grid; a triangle's last one stands twice.
type Places = [[Lanes<f64>; 2]; 4];

/// Colours at corners.
type Colors = [[Lanes<f32>; 3]; 4];

/// What is worked with; its memory is used again.
pub(super) struct Table {
    places: Places,
    made: Made,
}

impl Default for Table {
    fn default() -> Self {
        let numbers = [0; LANES];
        let made = Made {
            column: numbers,
            row: numbers,
            end_row: numbers,
            is_seen: [false; LANES],
            is_narrow: [false; LANES],
            extent: [0.0; LANES],
            is_convex: [false; LANES],
            edges: [[[0.0; LANES]; 4]; 4],
            cover: [[Span::EMPTY; LANES]; ROWS],
            base: [[0; LANES]; 3],
            right: [[0; LANES]; 3],
            down: [[0; LANES]; 3],
        };
        Self { places: [[[0.0; LANES]; 2]; 4], made }
    }
}

impl Pieces {
    /// Appends what of polygons is seen.
    pub(super) fn push(&mut self, making: &Making<'_>, polygons: &Polygons, table: &mut Table) {
        let Table { places, made } = table;
        cpu::run(Placing { view: making.view, polygons, places });
        self.push_placed(making, polygons, places, made);
    }

    /// Appends what is seen of polygons at these places.
    fn push_placed(&mut self, making: &Making<'_>, polygons: &Polygons, places: &Places, made: &mut Made) {
        let (mut clamped_colors, mut ways) = (None, [Way::Chunks; LANES]);
        for lane in (0..polygons.count).filter(|&lane| polygons.are_beyond[lane]) {
            let (way, colors) = clamped(&polygons.colors(lane), making.space);
            ways[lane] = way;
            let corners: &mut Colors = clamped_colors.get_or_insert(polygons.colors);
            for (corner, color) in corners.iter_mut().zip(colors) {
                corner.iter_mut().zip(color.to_array()).for_each(|(channel, level)| channel[lane] = level);
            }
        }
        let colors = clamped_colors.as_ref().unwrap_or(&polygons.colors);
        cpu::run(SettingUp { making, places, colors, made });
        for (lane, &way) in ways[..polygons.count].iter().enumerate() {
            if !made.is_seen[lane] {
                continue;
            }
            let outline = || outline(places, lane);
            let is_convex =
                if made.extent[lane] < Turning::SMALL { made.is_convex[lane] } else { outline().is_convex() };
            let patch = || Patch {
                outline: outline(),
                colors: polygons.colors(lane),
                is_beyond: polygons.are_beyond[lane],
                count: polygons.corners[lane],
                boundary: polygons.boundaries[lane],
            };
            if !is_convex {
                self.push_halves(making, &patch());
                continue;
            }
            let (row, end_row) = (made.row[lane] as u16, made.end_row[lane] as u16);
            let piece = if usize::from(end_row - row) > ROWS {
                // Looked up row by row when it is painted.
                self.tall.push(outline());
                Piece::tall(made.run(lane, way), end_row, self.tall.len() - 1)
            } else {
                let cover = made.cover(lane);
                if !making.antialias && Span::are_empty(&cover) {
                    continue;
                }
                Piece::low(made.run(lane, way), end_row, made.is_narrow[lane], cover)
            };
            self.rows.push([row, end_row]);
            self.pieces.push(piece);
            if making.antialias {
                self.patches.push(patch());
            }
        }
    }

    #[cold]
    fn push_halves(&mut self, making: &Making<'_>, patch: &Patch) {
        let (Table { mut places, mut made }, mut halves) = (Table::default(), Polygons::NONE);
        for (lane, half) in patch.halves().enumerate() {
            for corner in 0..4 {
                (places[corner][0][lane], places[corner][1][lane]) = (half.outline.x[corner], half.outline.y[corner]);
                let color = half.colors[corner].to_array();
                halves.colors[corner].iter_mut().zip(color).for_each(|(channel, level)| channel[lane] = level);
            }
            (halves.corners[lane], halves.boundaries[lane]) = (half.count, half.boundary);
            halves.are_beyond[lane] = patch.is_beyond;
            halves.count = lane + 1;
        }
        if halves.count > 0 {
            self.push_placed(making, &halves, &places, &mut made);
        }
    }
}

fn outline(places: &Places, lane: usize) -> Outline {
    let axis = |axis: usize| [0, 1, 2, 3].map(|corner| places[corner][axis][lane]);
    Outline { x: axis(0), y: axis(1) }
}

/// From fine units to pixels.
struct Placing<'a> {
    view: &'a View,
    polygons: &'a Polygons,
    places: &'a mut Places,
}

impl Kernel for Placing<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (places, fine) in self.places.iter_mut().zip(&self.polygons.places) {
            for axis in 0..2 {
                for i in 0..LANES {
                    places[axis][i] = self.view.px(axis, fine[axis][i]);
                }
            }
        }
    }
}

/// What is found out of polygons.
struct Made {
    /// The first column and row, and the row beyond the last, cut to the surface.
    column: Lanes<u32>,
    row: Lanes<u32>,
    end_row: Lanes<u32>,
    /// Whether there are any.
    is_seen: Lanes<bool>,
    /// Whether there are no more than [`PART`] columns.
    is_narrow: Lanes<bool>,
    /// The larger side, in pixels.
    extent: Lanes<f64>,
    /// As of [`Turning`].
    is_convex: Lanes<bool>,
    /// Corner by corner the edge to the next: what an [`Edge`] is made of.
    edges: [[Lanes<f64>; 4]; 4],
    /// Spans of the first rows.
    cover: [Lanes<Span>; ROWS],
    /// As of [`Run`].
    base: [Lanes<i32>; 3],
    right: [Lanes<i32>; 3],
    down: [Lanes<i32>; 3],
}

impl Made {
    #[inline(always)]
    fn run(&self, lane: usize, way: Way) -> Run {
        let of = |channels: &[Lanes<i32>; 3]| [channels[0][lane], channels[1][lane], channels[2][lane]];
        let origin = [self.column[lane] as u16, self.row[lane] as u16];
        Run { base: of(&self.base), right: of(&self.right), down: of(&self.down), origin, way }
    }

    #[inline(always)]
    fn cover(&self, lane: usize) -> [Span; ROWS] {
        [0, 1, 2, 3].map(|row| self.cover[row][lane])
    }
}

/// From places and colours to all that pieces are made of.
struct SettingUp<'a> {
    making: &'a Making<'a>,
    places: &'a Places,
    colors: &'a Colors,
    made: &'a mut Made,
}

impl Kernel for SettingUp<'_> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        self.find_rows();
        self.find_spans();
        self.find_colors();
    }
}

impl SettingUp<'_> {
    #[inline(always)]
    fn corners(&self, axis: usize, lane: usize) -> [f64; 4] {
        [0, 1, 2, 3].map(|corner| self.places[corner][axis][lane])
    }

    #[inline(always)]
    fn find_rows(&mut self) {
        let Making { view, antialias, .. } = *self.making;
        for i in 0..LANES {
            let (first_column, end_column, width) = extent(self.corners(0, i), view.columns, antialias);
            let (first_row, end_row, height) = extent(self.corners(1, i), view.rows, antialias);
            self.made.column[i] = whole(first_column);
            self.made.row[i] = whole(first_row);
            self.made.end_row[i] = whole(end_row);
            self.made.is_seen[i] = (first_column < end_column) & (first_row < end_row);
            self.made.is_narrow[i] = end_column - first_column <= PART as f64;
            self.made.extent[i] = most(width, height);
        }
    }

    #[inline(always)]
    fn find_spans(&mut self) {
        let width = f64::from(self.making.view.columns);
        let edges = &mut self.made.edges;
        for corner in 0..4 {
            let (from, to) = (&self.places[corner], &self.places[(corner + 1) % 4]);
            for i in 0..LANES {
                let Edge { x, y, slope, first } = Edge::new([from[0][i], from[1][i]], [to[0][i], to[1][i]]);
                edges[corner][0][i] = x;
                edges[corner][1][i] = y;
                edges[corner][2][i] = slope;
                edges[corner][3][i] = first;
            }
        }
        for (row, spans) in self.made.cover.iter_mut().enumerate() {
            for i in 0..LANES {
                let row = f64::from(self.made.row[i] as i32) + row as f64;
                spans[i] = span(&edges_of(edges, i), row, width);
            }
        }
    }

    /// The linear field that takes the colours at the corners. It follows from the diagonals; a triangle's second one is a
    /// side.
    #[inline(always)]
    fn find_colors(&mut self) {
        // Beyond this, rounding of the gradient shows: a sliver that is thinner than any pixel's digits has one colour.
        const STEEPEST: f64 = (1u64 << 30) as f64;
        let mut scaled = [[0.0; LANES]; 4];
        for i in 0..LANES {
            let Turning { diagonals: [u, v], double_area, is_convex } =
                Turning::new(self.corners(0, i), self.corners(1, i));
            self.made.is_convex[i] = is_convex;
            let scale = 1.0 / double_area;
            (scaled[0][i], scaled[1][i]) = (u[0] * scale, u[1] * scale);
            (scaled[2][i], scaled[3][i]) = (v[0] * scale, v[1] * scale);
        }
        let mut gradients = [[[0.0; LANES]; 2]; 3];
        let mut are_flat = [u64::MAX; LANES];
        for (channel, [right, down]) in gradients.iter_mut().enumerate() {
            let [a, b, c, d] = [0, 1, 2, 3].map(|corner| &self.colors[corner][channel]);
            for i in 0..LANES {
                let (along_u, along_v) = (f64::from(c[i] - a[i]), f64::from(d[i] - b[i]));
                right[i] = along_u * scaled[3][i] - along_v * scaled[1][i];
                down[i] = along_v * scaled[0][i] - along_u * scaled[2][i];
                let extent = most(self.made.extent[i], 1.0);
                let is_flat = ((right[i] * extent).abs() < STEEPEST) & ((down[i] * extent).abs() < STEEPEST);
                are_flat[i] &= if is_flat { u64::MAX } else { 0 };
            }
        }
        let mut origin = [[0.0; LANES]; 2];
        for i in 0..LANES {
            origin[0][i] = f64::from(self.made.column[i] as i32) + 0.5 - self.places[0][0][i];
            origin[1][i] = f64::from(self.made.row[i] as i32) + 0.5 - self.places[0][1][i];
        }
        for (channel, [right, down]) in gradients.iter().enumerate() {
            let color = &self.colors[0][channel];
            for i in 0..LANES {
                let [right, down] = [right[i], down[i]].map(|change| f64::from_bits(change.to_bits() & are_flat[i]));
                self.made.base[channel][i] =
                    fixed(f64::from(color[i]) + right * origin[0][i] + down * origin[1][i] + 0.5);
                self.made.right[channel][i] = fixed(right);
                self.made.down[channel][i] = fixed(down);
            }
        }
    }
}

#[inline(always)]
fn edges_of(edges: &[[Lanes<f64>; 4]; 4], lane: usize) -> [Edge; 4] {
    [0, 1, 2, 3].map(|corner| {
        let [x, y, slope, first] = &edges[corner];
        Edge { x: x[lane], y: y[lane], slope: slope[lane], first: first[lane] }
    })
}

/// The first row or column, the one beyond the last, cut to a surface of this size, and the length in pixels.
#[inline(always)]
fn extent([a, b, c, d]: [f64; 4], size: i32, antialias: bool) -> (f64, f64, f64) {
    let low = least(least(a, b), least(c, d));
    let high = most(most(a, b), most(c, d));
    // For anti-aliasing all pixels that are touched, else those whose centres are covered.
    let first = if antialias { -ceil(-low) } else { ceil(low - 0.5) };
    let end = if antialias { ceil(high) } else { ceil(high - 0.5) };
    let cut = |v: f64| least(most(v, 0.0), size.into());
    (cut(first), cut(end), high - low)
}

/// Rounds to [`FRACTION`] digits; what is beyond 32 bits of that is cut off above. Values are below 2^31.
#[inline(always)]
fn fixed(v: f64) -> i32 {
    // Added to 1.5 * 2^52, a number's last digits are those of the integer: cheaper than a checked cast.
    const ROUND: f64 = (3u64 << 51) as f64;
    const SCALE: f64 = (1u64 << FRACTION) as f64;
    (v * SCALE + ROUND).to_bits() as i32
}

#[cfg(test)]
pub(super) mod tests {
    use glam::Vec4;

    use super::super::cpu::tests::both_ways;
    use super::super::refiner::{COLOR_BITS, FineNode};
    use super::super::slice::{SliceNode, Slices};
    use super::super::view::Viewport;
    use super::*;
    use crate::mesh::Domain;

    /// The run of a triangle with these colours in the channels of a canvas, and whether one is beyond what it holds.
    pub(in super::super) fn run_of(
        outline: &Outline,
        (colors, is_beyond): ([Vec4; 4], bool),
        space: ColorSpace,
    ) -> Run {
        let domain = Domain { width: 8192, height: 8192, duration: 1, subpixel_bits: 3 };
        let view = View::new(&domain, Viewport::whole(&domain), (8192, 8192));
        let making = Making { view: &view, space, antialias: false };
        let (mut pieces, mut polygons) = (Pieces::default(), Polygons::NONE);
        let Table { mut places, mut made } = Table::default();
        for corner in 0..4 {
            (places[corner][0][0], places[corner][1][0]) = (outline.x[corner], outline.y[corner]);
            let color = colors[corner].to_array();
            polygons.colors[corner].iter_mut().zip(color).for_each(|(channel, level)| channel[0] = level);
        }
        (polygons.count, polygons.corners[0], polygons.are_beyond[0]) = (1, 3, is_beyond);
        pieces.push_placed(&making, &polygons, &places, &mut made);
        pieces.pieces[0].run
    }

    /// Wide instructions change nothing: neither where polygons are cut nor what is painted.
    #[test]
    fn pieces_are_the_same_with_and_without_wide_instructions() {
        let mut seed = 11u64;
        let mut random = |end: i32| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((seed >> 33) % end as u64) as i32
        };
        let domain = Domain { width: 640, height: 360, duration: 4, subpixel_bits: 3 };
        let view = View::new(&domain, Viewport::whole(&domain), (1000, 563));
        let mut node = |[x, y]: [i32; 2], size: i32| {
            let position = glam::IVec3::new(x + random(size), y + random(size), random(4096));
            let color = glam::IVec3::new(random(270), random(270), random(270)) << COLOR_BITS as i32;
            SliceNode::new(&FineNode { position, color }, ColorSpace::Rgb)
        };
        let tets: Vec<_> = (0..2000)
            .map(|n| {
                let (corner, size) = ([n * 300 % 655_360, n * 170 % 368_640], [900, 6000, 200_000][n as usize % 3]);
                [(); 4].map(|()| node(corner, size))
            })
            .collect();
        for antialias in [false, true] {
            let making = Making { view: &view, space: ColorSpace::Rgb, antialias };
            let [wide, narrow] = both_ways(|| {
                let (mut slices, mut pieces, mut table) = (Slices::new(), Pieces::default(), Table::default());
                for tets in tets.chunks(LANES) {
                    for [a, b, c, d] in tets {
                        let nodes = [a, b, c, d];
                        slices.push(0, nodes, SliceNode::above(nodes, 2048), 0);
                    }
                    slices.cut(2048, |polygons| pieces.push(&making, polygons, &mut table));
                }
                assert!(pieces.pieces.len() > 300 && pieces.tall.len() > 100, "{}", pieces.pieces.len());
                format!("{pieces:?}")
            });
            assert!(wide == narrow, "anti-aliased: {antialias}");
        }
    }
}
