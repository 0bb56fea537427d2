//! Gives small islands of a label away.
//!
//! In: named superpixels, each in one piece. Out: the same with labels that have no small pieces. Forbidden here:
//! moving pixels between superpixels.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use super::superpixels::{NONE, Superpixels};
use crate::video::Label;

/// Gives every connected piece of a label of fewer than `min_area` pixels the label with which it shares most pixel
/// sides (of equals, the oldest): the smallest piece first, until none is left or the picture is one piece.
pub(super) fn dissolve_islands(map: &mut Superpixels, min_area: u32) {
    let neighbors = map.neighbors();
    // Each round joins a piece with another, so there are fewer rounds than superpixels.
    loop {
        let pieces = label_pieces(map, &neighbors);
        let area = |piece: &[u32]| piece.iter().map(|&cell| map.cells[cell as usize].area).sum::<u32>();
        let small = pieces.iter().min_by_key(|piece| area(piece)).filter(|piece| area(piece) < min_area);
        let Some(piece) = small.filter(|_| pieces.len() > 1) else { return };
        let mut shares: BTreeMap<Option<Label>, u32> = BTreeMap::new();
        let label = map.cells[piece[0] as usize].label;
        for &(neighbor, sides) in piece.iter().flat_map(|&cell| &neighbors[cell as usize]) {
            let other = map.cells[neighbor as usize].label;
            if other != label {
                *shares.entry(other).or_default() += sides;
            }
        }
        let Some((widest, _)) = shares.into_iter().max_by_key(|&(label, sides)| (sides, Reverse(label))) else {
            return;
        };
        piece.iter().for_each(|&cell| map.cells[cell as usize].label = widest);
    }
}

/// Superpixels of equal label that hang together, in order of the first of each piece.
fn label_pieces(map: &Superpixels, neighbors: &[Vec<(u32, u32)>]) -> Vec<Vec<u32>> {
    let mut seen = vec![NONE; map.cells.len()];
    let mut pieces = Vec::new();
    for seed in 0..map.cells.len() as u32 {
        if seen[seed as usize] != NONE {
            continue;
        }
        seen[seed as usize] = seed;
        let mut piece = vec![seed];
        let mut next = 0;
        while let Some(&cell) = piece.get(next) {
            next += 1;
            for &(neighbor, _) in &neighbors[cell as usize] {
                let same = map.cells[neighbor as usize].label == map.cells[cell as usize].label;
                if same && seen[neighbor as usize] == NONE {
                    seen[neighbor as usize] = seed;
                    piece.push(neighbor);
                }
            }
        }
        pieces.push(piece);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::dissolve_islands;
    use crate::vectorize::segment::raster::Raster;
    use crate::vectorize::segment::superpixels::Superpixels;
    use crate::video::Label;

    /// One row of superpixels of the given lengths and labels; the labels afterwards.
    fn dissolved(cells: &[(u32, u32)]) -> Vec<u32> {
        let total = cells.iter().map(|(length, _)| length).sum();
        let mut map = Superpixels::new(Raster::new(total, 1));
        map.plane.clear();
        for &(length, label) in cells {
            let place = map.add(Some(Label(label)), [0, 0]);
            map.plane.extend((0..length).map(|_| place));
        }
        map.recount(&vec![[0.0; 3]; total as usize]);
        dissolve_islands(&mut map, 12);
        map.cells.iter().map(|cell| cell.label.map_or(u32::MAX, |label| label.0)).collect()
    }

    #[test]
    fn small_pieces_go_even_where_their_label_lives_elsewhere() {
        assert_eq!(dissolved(&[(20, 0), (5, 1), (30, 0), (20, 1)]), [0, 0, 0, 1]);
    }

    #[test]
    fn pieces_made_of_several_superpixels_count_as_one() {
        assert_eq!(dissolved(&[(20, 0), (6, 1), (6, 1), (20, 2)]), [0, 1, 1, 2]);
        assert_eq!(dissolved(&[(20, 0), (6, 1), (5, 1), (20, 2)]), [0, 0, 0, 2]);
    }

    #[test]
    fn a_picture_of_small_pieces_ends_with_none() {
        assert_eq!(dissolved(&[(3, 0), (3, 1), (3, 0), (3, 1), (3, 0)]), [1; 5]);
        assert_eq!(dissolved(&[(1, 7)]), [7]);
        assert_eq!(dissolved(&[(2, 7), (1, 3)]), [7, 7]);
    }
}
