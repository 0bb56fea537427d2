//! What is to be known of polygons on a surface before they are painted, side by side.
//!
//! In: polygons of a slice. Out: where they lie in pixels; which rows and columns they are seen in, spans of the first rows,
//! the linear colour. Forbidden here: branches on what a polygon looks like.
#![expect(clippy::needless_range_loop, reason = "many lists are walked side by side, lane by lane")]

use super::canvas::PART;
use super::cpu::{self, Kernel};
use super::lanes::{LANES, Lanes, ceil, least, most, whole};
use super::near::Sides;
use super::run::{FRACTION, Run, Way};
use super::scan::{Edge, ROWS, Span, Turning, span};
use super::slice::Polygons;
use super::view::View;

/// x and y of corners in pixels, on the grid; a triangle's last one stands twice.
pub(super) type Places = [[Lanes<f64>; 2]; 4];

/// Colours at corners.
pub(super) type Colors = [[Lanes<f32>; 3]; 4];

/// Where polygons lie on a surface.
pub(super) fn place(view: &View, polygons: &Polygons, places: &mut Places) {
    cpu::run(Placing { view, polygons, places });
}

/// See [`place`].
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
pub(super) struct Measures {
    /// The first column and row, and the row beyond the last, cut to the surface.
    pub(super) column: Lanes<u32>,
    pub(super) row: Lanes<u32>,
    pub(super) end_row: Lanes<u32>,
    /// Whether there are any.
    pub(super) is_seen: Lanes<bool>,
    /// Whether there are no more than [`PART`] columns.
    pub(super) is_narrow: Lanes<bool>,
    /// The larger side, in pixels.
    pub(super) extent: Lanes<f64>,
    /// As of [`Turning`].
    pub(super) is_convex: Lanes<bool>,
    /// Corner by corner the edge to the next: what an [`Edge`] is made of.
    edges: [[Lanes<f64>; 4]; 4],
    /// Spans of the first rows.
    cover: [Lanes<Span>; ROWS],
    /// As of [`Run`].
    base: [Lanes<i32>; 3],
    right: [Lanes<i32>; 3],
    down: [Lanes<i32>; 3],
}

impl Default for Measures {
    fn default() -> Self {
        let numbers = [0; LANES];
        Self {
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
        }
    }
}

impl Measures {
    /// Finds all of them.
    pub(super) fn find(&mut self, view: &View, antialias: bool, places: &Places, colors: &Colors) {
        cpu::run(Measuring { view, antialias, places, colors, found: self });
    }

    /// What a polygon is painted with.
    #[inline(always)]
    pub(super) fn run(&self, lane: usize, way: Way) -> Run {
        let of = |channels: &[Lanes<i32>; 3]| [channels[0][lane], channels[1][lane], channels[2][lane]];
        let origin = [self.column[lane] as u16, self.row[lane] as u16];
        Run { base: of(&self.base), right: of(&self.right), down: of(&self.down), origin, way }
    }

    /// Its edges from the upper corner on, as seen from the first pixel.
    #[inline]
    pub(super) fn sides(&self, lane: usize) -> Sides {
        let edges = edges_of(&self.edges, lane);
        let (left, right) =
            (usize::from(edges[1].first < edges[0].first), 2 + usize::from(edges[3].first < edges[2].first));
        let top = if edges[right].first < edges[left].first { right } else { left };
        Sides::new([0, 1, 2, 3].map(|i| edges[(top + i) % 4]), [self.column[lane], self.row[lane]])
    }

    /// What it covers of its first rows.
    #[inline(always)]
    pub(super) fn cover(&self, lane: usize) -> [Span; ROWS] {
        [0, 1, 2, 3].map(|row| self.cover[row][lane])
    }
}

/// See [`Measures::find`].
struct Measuring<'a> {
    view: &'a View,
    antialias: bool,
    places: &'a Places,
    colors: &'a Colors,
    found: &'a mut Measures,
}

impl Kernel for Measuring<'_> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        self.find_rows();
        self.find_spans();
        self.find_colors();
    }
}

impl Measuring<'_> {
    #[inline(always)]
    fn corners(&self, axis: usize, lane: usize) -> [f64; 4] {
        [0, 1, 2, 3].map(|corner| self.places[corner][axis][lane])
    }

    #[inline(always)]
    fn find_rows(&mut self) {
        let Self { view, antialias, .. } = *self;
        for i in 0..LANES {
            let (first_column, end_column, width) = extent(self.corners(0, i), view.columns, antialias);
            let (first_row, end_row, height) = extent(self.corners(1, i), view.rows, antialias);
            self.found.column[i] = whole(first_column);
            self.found.row[i] = whole(first_row);
            self.found.end_row[i] = whole(end_row);
            self.found.is_seen[i] = (first_column < end_column) & (first_row < end_row);
            self.found.is_narrow[i] = end_column - first_column <= PART as f64;
            self.found.extent[i] = most(width, height);
        }
    }

    #[inline(always)]
    fn find_spans(&mut self) {
        let width = f64::from(self.view.columns);
        let edges = &mut self.found.edges;
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
        for (row, spans) in self.found.cover.iter_mut().enumerate() {
            for i in 0..LANES {
                let row = f64::from(self.found.row[i] as i32) + row as f64;
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
            self.found.is_convex[i] = is_convex;
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
                let extent = most(self.found.extent[i], 1.0);
                let is_flat = ((right[i] * extent).abs() < STEEPEST) & ((down[i] * extent).abs() < STEEPEST);
                are_flat[i] &= if is_flat { u64::MAX } else { 0 };
            }
        }
        let mut origin = [[0.0; LANES]; 2];
        for i in 0..LANES {
            origin[0][i] = f64::from(self.found.column[i] as i32) + 0.5 - self.places[0][0][i];
            origin[1][i] = f64::from(self.found.row[i] as i32) + 0.5 - self.places[0][1][i];
        }
        for (channel, [right, down]) in gradients.iter().enumerate() {
            let color = &self.colors[0][channel];
            for i in 0..LANES {
                let [right, down] = [right[i], down[i]].map(|change| f64::from_bits(change.to_bits() & are_flat[i]));
                self.found.base[channel][i] =
                    fixed(f64::from(color[i]) + right * origin[0][i] + down * origin[1][i] + 0.5);
                self.found.right[channel][i] = fixed(right);
                self.found.down[channel][i] = fixed(down);
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
