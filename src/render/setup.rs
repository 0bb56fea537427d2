//! Polygons of a slice to pieces, which are ready to be painted: where each is seen, what it covers, its colour.
//!
//! In: polygons side by side. Out: pieces, one by one. Polygons that smoothing turned over are not drawn. The slice covers
//! every pixel once, counted with sign, as the box stays in place under subdivision; so each pixel has a polygon that was
//! not turned over, and the last of them is shown.
//!
//! Most polygons cover a few pixels, so this is most of the work where pictures are small: all is found out of all of them
//! at once ([`Measures`]), though a quarter turns out to cover nothing.

use super::canvas::ColorSpace;
use super::lanes::LANES;
use super::measure::{Colors, Measures, Places, place};
use super::near::LARGEST;
use super::piece::{Patch, Piece, Pieces};
use super::run::{Way, clamped};
use super::scan::{Outline, ROWS, Span, Turning};
use super::slice::Polygons;
use super::view::View;

/// What pieces are made for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Making<'a> {
    pub(super) view: &'a View,
    pub(super) space: ColorSpace,
    pub(super) antialias: bool,
}

/// What is worked with; its memory is used again.
#[derive(Default)]
pub(super) struct Table {
    places: Places,
    measures: Measures,
}

impl Pieces {
    /// Appends what of polygons is seen.
    pub(super) fn push(&mut self, making: &Making<'_>, polygons: &Polygons, table: &mut Table) {
        let Table { places, measures } = table;
        place(making.view, polygons, places);
        self.push_placed(making, polygons, places, measures);
    }

    /// Appends what is seen of polygons at these places.
    fn push_placed(&mut self, making: &Making<'_>, polygons: &Polygons, places: &Places, measures: &mut Measures) {
        let (mut clamped_colors, mut ways) = (None, [Way::Chunks; LANES]);
        for lane in (0..polygons.count).filter(|&lane| polygons.are_beyond[lane]) {
            // A corner of the tet may be beyond, and what is cut out of it not.
            let colors = polygons.colors(lane);
            if colors.iter().all(|&color| making.space.holds(making.space.to_rgb(color))) {
                continue;
            }
            let (way, colors) = clamped(&colors, making.space);
            ways[lane] = way;
            let corners: &mut Colors = clamped_colors.get_or_insert(polygons.colors);
            for (corner, color) in corners.iter_mut().zip(colors) {
                corner.iter_mut().zip(color.to_array()).for_each(|(channel, level)| channel[lane] = level);
            }
        }
        let colors = clamped_colors.as_ref().unwrap_or(&polygons.colors);
        measures.find(making.view, making.antialias, places, colors);
        for (lane, &way) in ways[..polygons.count].iter().enumerate() {
            if !measures.is_seen[lane] {
                continue;
            }
            let outline = || outline(places, lane);
            let is_convex =
                if measures.extent[lane] < Turning::SMALL { measures.is_convex[lane] } else { outline().is_convex() };
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
            let (row, end_row) = (measures.row[lane] as u16, measures.end_row[lane] as u16);
            let piece = if usize::from(end_row - row) > ROWS {
                // Looked up row by row when it is painted.
                self.tall.push(measures.sides(lane));
                self.outlines.push(outline());
                let is_near = measures.extent[lane] <= LARGEST;
                Piece::tall(measures.run(lane, way), end_row, is_near, self.tall.len() - 1)
            } else {
                let cover = measures.cover(lane);
                if !making.antialias && Span::are_empty(&cover) {
                    continue;
                }
                Piece::low(measures.run(lane, way), end_row, measures.is_narrow[lane], cover)
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
        let (Table { mut places, mut measures }, mut halves) = (Table::default(), Polygons::NONE);
        for (lane, half) in patch.halves().enumerate() {
            for (corner, place) in places.iter_mut().enumerate() {
                (place[0][lane], place[1][lane]) = (half.outline.x[corner], half.outline.y[corner]);
                let color = half.colors[corner].to_array();
                halves.colors[corner].iter_mut().zip(color).for_each(|(channel, level)| channel[lane] = level);
            }
            (halves.corners[lane], halves.boundaries[lane]) = (half.count, half.boundary);
            halves.are_beyond[lane] = patch.is_beyond;
            halves.count = lane + 1;
        }
        if halves.count > 0 {
            self.push_placed(making, &halves, &places, &mut measures);
        }
    }
}

fn outline(places: &Places, lane: usize) -> Outline {
    let axis = |axis: usize| [0, 1, 2, 3].map(|corner| places[corner][axis][lane]);
    Outline { x: axis(0), y: axis(1) }
}

#[cfg(test)]
pub(super) mod tests {
    use glam::Vec4;

    use super::super::cpu::tests::both_ways;
    use super::super::refiner::{COLOR_BITS, FineNode};
    use super::super::run::Run;
    use super::super::slice::{SliceNode, Slices};
    use super::super::view::Viewport;
    use super::*;
    use crate::mesh::Domain;
    use crate::render::random;

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
        let Table { mut places, mut measures } = Table::default();
        for corner in 0..4 {
            (places[corner][0][0], places[corner][1][0]) = (outline.x[corner], outline.y[corner]);
            let color = colors[corner].to_array();
            polygons.colors[corner].iter_mut().zip(color).for_each(|(channel, level)| channel[0] = level);
        }
        (polygons.count, polygons.corners[0], polygons.are_beyond[0]) = (1, 3, is_beyond);
        pieces.push_placed(&making, &polygons, &places, &mut measures);
        pieces.pieces[0].run
    }

    /// Wide instructions change nothing: neither where polygons are cut nor what is painted.
    #[test]
    fn pieces_are_the_same_with_and_without_wide_instructions() {
        let mut random = random::below::<i32>(11);
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
