//! The loop: pick the cheapest edge, check, collapse, until the goal is reached.

use glam::{IVec3, Vec3};

use super::SimplifyParams;
use super::legality::{Limits, Marks, RefusalCounts, Topology};
use super::proposal::{Proposal, Proposer};
use super::quadric::WedgeQuadric;
use super::queue::{BucketQueue, Entry};
use super::stars::Stars;
use super::work_mesh::{NONE, WorkMesh};

/// Which part of the window may change, in lattice units of t: vertices at or before `low`, and at or after `high`,
/// are frozen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unfrozen {
    /// The trailing part that has been handed on.
    pub low: i32,
    /// The leading part that waits for its neighbours.
    pub high: i32,
}

impl Unfrozen {
    /// Whether a vertex at this time is frozen.
    pub(super) fn freezes(&self, t: i32) -> bool {
        t <= self.low || t >= self.high
    }
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Vertices before `before` to be left. What lies between `before` and the frozen part is collapsed at the same
    /// cost, but not counted: next to a dense frozen layer it cannot become as sparse.
    pub vertices: usize,
    /// Up to where `vertices` are counted, in lattice units of t.
    pub before: i32,
    /// Vertices before `Unfrozen::high` to be left: what bounds the window's memory.
    pub vertices_in_window: usize,
    /// Most that a collapse may cost: integrated squared colour error, in squared levels x cubic pixels.
    pub max_cost: f32,
    /// Most that the next collapse's cost times the number of `vertices` left may be: as costs are nearly equal
    /// everywhere, this follows the squared error integrated over the part that is counted.
    pub max_error: f32,
}

impl Goal {
    /// Whether few enough vertices are left.
    fn is_reached(&self, report: &SimplifyReport) -> bool {
        report.vertices <= self.vertices && report.vertices_in_window <= self.vertices_in_window
    }
}

/// What a run did.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SimplifyReport {
    /// Edges collapsed.
    pub collapses: u64,
    /// Costs computed.
    pub evaluations: u64,
    /// Refusals by name.
    pub refusals: RefusalCounts,
    /// The greatest cost that was paid.
    pub max_cost: f32,
    /// Vertices left before `Goal::before`.
    pub vertices: usize,
    /// Vertices left before `Unfrozen::high`.
    pub vertices_in_window: usize,
}

impl SimplifyReport {
    /// Adds what another run did; vertices left are not added.
    pub(super) fn add(&mut self, other: &Self) {
        self.collapses += other.collapses;
        self.evaluations += other.evaluations;
        self.refusals.add(&other.refusals);
        self.max_cost = self.max_cost.max(other.max_cost);
    }
}

/// Refusals of one edge before it is put aside until the queue is empty.
const MOST_ATTEMPTS: u16 = 4;
/// Buckets by which a refused edge is put back: an octave of cost.
const SETBACK: usize = 16;
/// Most binary digits of a slot's number in the table of entries known to be queued already.
const KNOWN_BITS: u32 = 18;

struct Simplifier<'a, Q> {
    mesh: &'a mut WorkMesh<Q>,
    unfrozen: Unfrozen,
    goal: Goal,
    params: &'a SimplifyParams,
    limits: Limits,
    queue: BucketQueue,
    aside: Vec<Entry>,
    alias: Vec<u32>,
    known: Vec<[u32; 3]>,
    known_bits: u32,
    report: SimplifyReport,
    star: Vec<u32>,
    /// For the link condition.
    marks: Marks,
}

/// Collapses edges of `mesh` in the order of their cost until `goal` is reached or nothing more is allowed.
pub fn simplify<Q: WedgeQuadric>(
    mesh: &mut WorkMesh<Q>,
    unfrozen: Unfrozen,
    goal: Goal,
    params: &SimplifyParams,
) -> SimplifyReport {
    let unit = i64::from(mesh.domain.unit());
    let limits = Limits {
        min_volume6: ((unit * unit * unit) as f32 * params.min_volume6) as i64,
        min_shape: params.min_shape.powi(3),
        max_extent: (params.max_extent_frames as i32).saturating_mul(mesh.domain.unit()),
    };
    let report = SimplifyReport {
        vertices: mesh.count_before(goal.before),
        vertices_in_window: mesh.count_before(unfrozen.high),
        ..SimplifyReport::default()
    };
    // A window that only grows is done before it begins, and ranking its edges would be all the work there is.
    if goal.is_reached(&report) {
        return report;
    }
    mesh.stars = Stars::new(mesh.vertices.len(), &mesh.tets);
    mesh.places = mesh.vertices.iter().map(|vertex| vertex.position).collect();
    let known_bits = (mesh.vertices.len() as u32 | 1).ilog2().clamp(4, KNOWN_BITS);
    let vertices = mesh.vertices.len();
    let mut run = Simplifier {
        alias: (0..vertices as u32).collect(),
        mesh,
        unfrozen,
        goal,
        params,
        limits,
        queue: BucketQueue::new(),
        aside: Vec::new(),
        known: vec![[NONE; 3]; 1 << known_bits],
        known_bits,
        report,
        star: Vec::new(),
        marks: Marks::new(if params.topology == Topology::Free { 0 } else { vertices }),
    };
    run.collapse();
    let report = run.report;
    mesh.stars = Stars::default();
    mesh.places = Vec::new();
    report
}

impl<Q: WedgeQuadric> Simplifier<'_, Q> {
    /// Fills the queue with every edge that has an end which may move.
    fn rank_edges(&mut self) {
        const CHUNK: usize = 4096;
        let vertices = self.mesh.vertices.len();
        let chunks: Vec<std::ops::Range<usize>> =
            (0..vertices).step_by(CHUNK).map(|start| start..(start + CHUNK).min(vertices)).collect();
        // In groups, so that the ranked edges of a group, not of the whole mesh, wait beside the queue.
        for group in chunks.chunks(32) {
            for (ranked, evaluations, refusals) in self.rank_chunks(group) {
                self.report.evaluations += evaluations;
                self.report.refusals.add(&refusals);
                for (bucket, entry) in ranked {
                    self.queue.push(bucket, entry);
                }
            }
        }
    }

    #[cfg(feature = "threads")]
    fn rank_chunks(&self, group: &[std::ops::Range<usize>]) -> Vec<Ranked> {
        use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
        group.par_iter().map(|range| self.rank_range(range.clone())).collect()
    }

    #[cfg(not(feature = "threads"))]
    fn rank_chunks(&self, group: &[std::ops::Range<usize>]) -> Vec<Ranked> {
        group.iter().map(|range| self.rank_range(range.clone())).collect()
    }

    fn rank_range(&self, range: std::ops::Range<usize>) -> Ranked {
        let (mut ranked, mut evaluations, mut refusals) = (Vec::new(), 0, RefusalCounts::default());
        let mut neighbors = Vec::new();
        for u in range.map(|u| u as u32) {
            neighbors.clear();
            let star = self.mesh.stars.star(u);
            neighbors.extend(star.iter().flat_map(|&t| self.mesh.tets[t as usize]).filter(|&v| v > u));
            neighbors.sort_unstable();
            neighbors.dedup();
            for &v in &neighbors {
                if self.proposer().is_frozen(u) && self.proposer().is_frozen(v) {
                    continue;
                }
                evaluations += 1;
                match self.proposer().propose(u, v) {
                    Ok(proposal) => {
                        let stamp = self.mesh.stamp(u, v);
                        ranked.push((
                            BucketQueue::bucket(proposal.cost),
                            Entry { u, v, stamp, attempts: 0, paid: false },
                        ));
                    }
                    Err(refusal) => refusals.note(refusal),
                }
            }
        }
        (ranked, evaluations, refusals)
    }

    fn collapse(&mut self) {
        let limit = BucketQueue::bucket(self.goal.max_cost);
        let mut collapses_before = u64::MAX;
        let mut due = 0;
        while !self.goal.is_reached(&self.report) {
            if self.report.collapses >= due {
                due = self.rank_anew();
            }
            let Some((bucket, entry)) = self.queue.pop() else {
                // What was refused may have become possible, as long as something changed since.
                if self.aside.is_empty() || self.report.collapses == collapses_before {
                    return;
                }
                collapses_before = self.report.collapses;
                for entry in std::mem::take(&mut self.aside) {
                    self.queue.push(0, Entry { stamp: NONE, attempts: 0, paid: false, ..entry });
                }
                continue;
            };
            let error = BucketQueue::cost(bucket) * self.report.vertices as f32;
            if bucket > limit || error > self.goal.max_error {
                return;
            }
            if let Some((entry, proposal)) = self.renew(bucket, entry) {
                self.try_collapse(bucket, entry, proposal);
            }
        }
    }

    /// Ranks all edges, having made room for collapses where that is wanted. Returns after how many collapses of this run it is to
    /// be done again.
    fn rank_anew(&mut self) -> u64 {
        if self.params.improve_at > 0.0 {
            let price = self.params.improve_cost * self.report.max_cost;
            self.mesh.improve(self.unfrozen, &self.limits, price);
            self.report.vertices = self.mesh.count_before(self.goal.before);
            self.report.vertices_in_window = self.mesh.count_before(self.unfrozen.high);
        }
        self.queue = BucketQueue::new();
        self.aside.clear();
        self.rank_edges();
        let live = self.mesh.vertex_count();
        let few = (self.params.improve_at * live as f32) as usize;
        self.report.collapses + (live.saturating_sub(few) + 1) as u64
    }

    /// The entry and where its collapse would lead, if its cost is current and its turn has come; an outdated one is
    /// renewed and put back.
    fn renew(&mut self, bucket: usize, entry: Entry) -> Option<(Entry, Proposal)> {
        let (u, v) = (self.root(entry.u), self.root(entry.v));
        if u == v {
            return None;
        }
        let stamp = self.mesh.stamp(u, v);
        let is_current = [u, v, stamp] == [entry.u, entry.v, entry.stamp];
        let (u, v) = (u.min(v), u.max(v));
        if !is_current {
            let slot = (u.wrapping_mul(0x9e37_79b1) ^ v.wrapping_mul(0x85eb_ca6b)) >> (32 - self.known_bits);
            if self.known[slot as usize] == [u, v, stamp] {
                return None;
            }
            self.known[slot as usize] = [u, v, stamp];
        }
        self.report.evaluations += 1;
        match self.proposer().propose(u, v) {
            Ok(proposal) if is_current => return Some((entry, proposal)),
            Ok(proposal) => {
                let renewed = Entry { u, v, stamp, attempts: 0, paid: false };
                let due = BucketQueue::bucket(proposal.cost);
                if due <= bucket {
                    return Some((renewed, proposal));
                }
                self.queue.push(due, renewed);
            }
            Err(refusal) => self.report.refusals.note(refusal),
        }
        None
    }

    fn try_collapse(&mut self, bucket: usize, entry: Entry, proposal: Proposal) {
        let (u, v) = (entry.u, entry.v);
        let proposal = match self.mesh.check_geometry([u, v], proposal.position, &self.limits) {
            Ok(()) => Some(proposal),
            Err(refusal) => {
                self.report.refusals.note(refusal);
                self.other_place(u, v, bucket + SETBACK)
            }
        };
        let Some(proposal) = proposal else { return self.put_back(bucket, entry) };
        let is_free = self.params.topology == Topology::Free || entry.paid || proposal.is_priced;
        match if is_free { Ok(()) } else { self.mesh.check_link(u, v, self.params.topology, &mut self.marks) } {
            Ok(()) => self.perform(u, v, proposal),
            Err(refusal) => {
                self.report.refusals.note(refusal);
                if self.params.topology == Topology::Strict {
                    return self.put_back(bucket, entry);
                }
                let due = BucketQueue::bucket(proposal.cost + self.proposer().topology_price(u, v));
                self.queue.push(due.max(bucket), Entry { paid: true, ..entry });
            }
        }
    }

    /// Another place for the merged vertex where tets stay positive, at no more than the cost of a bucket.
    fn other_place(&self, u: u32, v: u32, most: usize) -> Option<Proposal> {
        let places = self.proposer().other_places(u, v)?;
        let affordable = places.into_iter().filter(|place| BucketQueue::bucket(place.cost) <= most);
        affordable.into_iter().find(|place| self.mesh.check_geometry([u, v], place.position, &self.limits).is_ok())
    }

    fn put_back(&mut self, bucket: usize, entry: Entry) {
        let entry = Entry { attempts: entry.attempts + 1, ..entry };
        if entry.attempts < MOST_ATTEMPTS {
            self.queue.push((bucket + SETBACK).min(BucketQueue::bucket(f32::MAX)), entry);
        } else {
            self.aside.push(entry);
        }
    }

    fn root(&mut self, mut v: u32) -> u32 {
        while self.alias[v as usize] != v {
            let parent = self.alias[v as usize];
            self.alias[v as usize] = self.alias[parent as usize];
            v = parent;
        }
        v
    }

    fn proposer(&self) -> Proposer<'_, Q> {
        Proposer { mesh: self.mesh, unfrozen: self.unfrozen, params: self.params }
    }

    /// Merges the two ends. A frozen or committed end keeps its number, else the one with the larger star.
    fn perform(&mut self, u: u32, v: u32, proposal: Proposal) {
        let handed_on = |w: u32| self.mesh.committed[w as usize] != NONE || self.proposer().is_frozen(w);
        let larger = self.mesh.stars.star(u).len() >= self.mesh.stars.star(v).len();
        let keep_u = if handed_on(u) != handed_on(v) { handed_on(u) } else { larger };
        let (kept, gone) = if keep_u { (u, v) } else { (v, u) };
        self.report.collapses += 1;
        self.report.max_cost = self.report.max_cost.max(proposal.cost);
        let times = [gone, kept].map(|w| self.mesh.vertices[w as usize].position.z);
        let count = |vertices: usize, end: i32| {
            let in_both = times.iter().filter(|&&t| t < end).count();
            vertices + usize::from(proposal.position.z < end) - in_both
        };
        self.report.vertices = count(self.report.vertices, self.goal.before);
        self.report.vertices_in_window = count(self.report.vertices_in_window, self.unfrozen.high);
        self.mesh.merge_attributes(kept, gone, proposal.position);
        self.mesh.merge_stars(kept, gone, &mut self.star);
        self.alias[gone as usize] = kept;
    }
}

type Ranked = (Vec<(usize, Entry)>, u64, RefusalCounts);

impl<Q: WedgeQuadric> WorkMesh<Q> {
    /// Vertices before a time, in lattice units.
    fn count_before(&self, time: i32) -> usize {
        self.vertices.iter().filter(|vertex| vertex.stamp != NONE && vertex.position.z < time).count()
    }

    /// Changes that the two have seen.
    fn stamp(&self, u: u32, v: u32) -> u32 {
        self.vertices[u as usize].stamp.wrapping_add(self.vertices[v as usize].stamp)
    }

    /// Moves `kept` to `position` and gives it the wedges and quadrics of `gone`.
    fn merge_attributes(&mut self, kept: u32, gone: u32, position: IVec3) {
        let (k, g) = (kept as usize, gone as usize);
        let to_kept = self.offset(self.vertices[k].position, position);
        let to_gone = self.offset(self.vertices[g].position, position);
        let own = &mut self.vertices[k].first;
        own.quadric = own.quadric.recentered(to_kept);
        let mut next = own.next;
        while let Some(own) = self.overflow.get_mut(next as usize) {
            own.quadric = own.quadric.recentered(to_kept);
            next = own.next;
        }
        let mut other = Some(self.vertices[g].first);
        while let Some(wedge) = other {
            other = self.overflow.get(wedge.next as usize).copied();
            self.wedge_mut(kept, wedge.label).quadric.add(&wedge.quadric.recentered(to_gone));
        }
        self.merge_surfaces(k, g, to_kept, to_gone);
        let gone_sides = self.vertices[g].sides;
        self.vertices[g].stamp = NONE;
        let kept = &mut self.vertices[k];
        kept.position = position;
        self.places[k] = position;
        kept.sides = kept.sides.or(gone_sides);
        kept.stamp += 1;
    }

    fn merge_surfaces(&mut self, k: usize, g: usize, to_kept: Vec3, to_gone: Vec3) {
        let of_gone = self.surfaces.get(self.vertices[g].surface as usize).map(|s| s.recentered(to_gone));
        if let Some(own) = self.surfaces.get_mut(self.vertices[k].surface as usize) {
            *own = own.recentered(to_kept);
            if let Some(other) = of_gone {
                own.add_scaled(&other, 1.0);
            }
        } else if let Some(other) = of_gone {
            let surface = self.vertices[g].surface;
            self.vertices[k].surface = surface;
            self.surfaces[surface as usize] = other;
        }
    }

    /// Lets the tets between the two vanish and hands the others of `gone` to `kept`; `star` is scratch.
    fn merge_stars(&mut self, kept: u32, gone: u32, star: &mut Vec<u32>) {
        star.clear();
        star.extend_from_slice(self.stars.star(kept));
        let own = star.len();
        star.extend_from_slice(self.stars.star(gone));
        for &tet in &star[own..] {
            let corners = self.tets[tet as usize];
            if corners.contains(&kept) {
                self.tets[tet as usize] = [NONE; 4];
                for w in corners.into_iter().filter(|&w| w != kept && w != gone) {
                    self.stars.remove(w, tet);
                }
            } else {
                self.tets[tet as usize] = corners.map(|w| if w == gone { kept } else { w });
            }
        }
        // A tet that vanished stood in both stars; one that lives stands in one.
        star.retain(|&tet| self.tets[tet as usize][0] != NONE);
        self.stars.merge(kept, gone, star);
    }
}
