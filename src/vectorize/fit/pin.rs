//! Pins: vertices that subdivision must leave where they are, lest it folds the mesh over.
//!
//! In: a control mesh with positive tets. Out: the same with some free vertices pinned, so that no child of a tet that
//! touches a boundary between labels is flat or inverted at level 1 or 2, by exact integers. A tet whose four vertices
//! are pinned splits linearly, so pinning more ends. Folds of tets without a free vertex are left and counted. Folds
//! inside a label are left too: they show the same colours twice, while pins next to smoothed vertices fold their
//! neighbours in turn (of 6,144 vertices with one label and 1,056 folded tets, pinning all would take 4,900).

use glam::IVec3;

use super::parallel;
use super::patch::Patch;
use crate::mesh::TetMesh;
use crate::render::{FINE_BITS, subdivide};

/// Children, at the level that is looked at, of the parents that are subdivided together: enough that their
/// surroundings do not dominate, few enough that a block stays in the tens of megabytes.
const BLOCK_CHILDREN: usize = 1 << 18;

/// What pinning did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PinReport {
    /// Tets at boundaries with a folded child before: at level 1, or at level 2 once there were none at level 1.
    pub folded_tets: u32,
    /// Vertices newly pinned.
    pub pinned_vertices: u32,
    /// Tets at boundaries whose children still fold since none of their vertices is free to be pinned.
    pub left_folded: u32,
}

/// Pins free vertices of `mesh` until no child folds, at either level, in a tet that has a free vertex and touches a
/// boundary between labels. `free` has an entry per vertex.
pub fn pin_folds(mesh: &mut TetMesh, free: &[bool]) -> PinReport {
    let mut patch = Patch::around(mesh, free, super::RINGS);
    let report = pin_patch(&mut patch, 2);
    patch.write_back(mesh);
    report
}

/// The same on a patch, up to a level: 1 or 2.
pub(super) fn pin_patch(patch: &mut Patch, level: u8) -> PinReport {
    let everything = patch.tets_to_check(&patch.free, 1);
    // Most folds are there at level 1 already, where looking is cheap.
    let first = pin_until_upright(patch, &[1], everything.clone());
    if level == 1 {
        return first;
    }
    let second = pin_until_upright(patch, &[1, 2], everything);
    PinReport {
        folded_tets: first.folded_tets + second.folded_tets,
        pinned_vertices: first.pinned_vertices + second.pinned_vertices,
        left_folded: second.left_folded,
    }
}

/// In each tet of `suspects` with a child that folds at one of `levels`, pins the free vertex that smoothing moves
/// furthest; then looks again at what that concerns. One vertex at a time, since a pin next to smoothed vertices can
/// fold others: all four at once took 51 % of a mesh's vertices where this takes 38 %.
fn pin_until_upright(patch: &mut Patch, levels: &[u8], mut suspects: Vec<u32>) -> PinReport {
    let mut report = PinReport::default();
    // At level 2 a pin is felt one ring further.
    let rings = levels.len() as u8 - 1;
    loop {
        let mut folded: Vec<Fold> = levels.iter().flat_map(|&level| folds(&patch.mesh, &suspects, level)).collect();
        folded.sort_unstable_by_key(|fold| fold.tet);
        folded.dedup_by_key(|fold| fold.tet);
        let mut news = vec![false; patch.mesh.positions.len()];
        for fold in &folded {
            let corners = patch.mesh.tet_vertices(fold.tet as usize);
            let vertices = fold.by_displacement.into_iter().map(|corner| corners[corner].index());
            let open = |v: &usize| patch.movable[*v] && !patch.mesh.pinned[*v];
            vertices.filter(open).take(1).for_each(|v| news[v] = true);
        }
        let pins = news.iter().filter(|&&new| new).count() as u32;
        if report.pinned_vertices == 0 {
            report.folded_tets = folded.len() as u32;
        }
        if pins == 0 {
            report.left_folded = folded.len() as u32;
            return report;
        }
        report.pinned_vertices += pins;
        patch.mesh.pinned.iter_mut().zip(&news).for_each(|(pinned, new)| *pinned |= new);
        suspects = patch.tets_to_check(&news, rings);
        suspects.extend(folded.iter().map(|fold| fold.tet));
        suspects.sort_unstable();
        suspects.dedup();
    }
}

/// A tet with a flat or inverted child.
struct Fold {
    tet: u32,
    /// Its corners, the one that smoothing moves furthest first.
    by_displacement: [usize; 4],
}

/// Those of `tets` (ascending) that fold at a level.
fn folds(mesh: &TetMesh, tets: &[u32], level: u8) -> Vec<Fold> {
    let mut blocks = Vec::new();
    split_blocks(mesh, tets, BLOCK_CHILDREN >> (3 * level), &mut blocks);
    parallel::map(blocks.len(), |block| folds_in_block(mesh, &blocks[block], level)).into_iter().flatten().collect()
}

/// Appends to `blocks` groups of at most `size` of `tets` that lie together: halves at the median along the longest
/// extent until they are small.
fn split_blocks(mesh: &TetMesh, tets: &[u32], size: usize, blocks: &mut Vec<Vec<u32>>) {
    if tets.len() <= size {
        blocks.push(tets.to_vec());
        return;
    }
    let centre = |tet: u32| mesh.tet_positions(tet as usize).into_iter().sum::<IVec3>();
    let low = tets.iter().fold(IVec3::MAX, |low, &tet| low.min(centre(tet)));
    let high = tets.iter().fold(IVec3::MIN, |high, &tet| high.max(centre(tet)));
    let extent = high - low;
    let axis = (0..3).max_by_key(|&axis| extent[axis]).unwrap_or(0);
    let mut ordered = tets.to_vec();
    let middle = ordered.len() / 2;
    ordered.select_nth_unstable_by_key(middle, |&tet| (centre(tet)[axis], tet));
    let (before, after) = ordered.split_at(middle);
    split_blocks(mesh, before, size, blocks);
    split_blocks(mesh, after, size, blocks);
}

fn folds_in_block(mesh: &TetMesh, tets: &[u32], level: u8) -> Vec<Fold> {
    let mut core = vec![false; mesh.positions.len()];
    tets.iter().flat_map(|&tet| mesh.tet_vertices(tet as usize)).for_each(|v| core[v.index()] = true);
    let block = Patch::around(mesh, &core, 0);
    let mut wanted = vec![false; mesh.tets.len()];
    tets.iter().for_each(|&tet| wanted[tet as usize] = true);
    let refined = subdivide(&block.mesh, level);
    let children = 1 << (3 * level);
    let folds = |parent: &usize| {
        wanted[block.tets[*parent] as usize]
            && (parent * children..(parent + 1) * children).any(|child| refined.volume6(child) <= 0)
    };
    let fold = |parent: usize| {
        let displacement = block.mesh.tet_vertices(parent).map(|v| {
            let smoothed: IVec3 = refined.points[v.index()];
            (smoothed - (block.mesh.positions[v.index()] << FINE_BITS)).as_i64vec3().length_squared()
        });
        let mut by_displacement = [0, 1, 2, 3];
        by_displacement.sort_by_key(|&corner| std::cmp::Reverse(displacement[corner]));
        Fold { tet: block.tets[parent], by_displacement }
    };
    (0..block.tets.len()).filter(folds).map(fold).collect()
}
