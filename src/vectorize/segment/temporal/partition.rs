//! A frame divided into superpixels: which pixel belongs to which, and the sums over each.
//!
//! In: assignments of pixels. Out: sums that follow every change, members, contacts. Forbidden here: deciding what
//! belongs together.

use super::model::{Color, Means, Model, Moments, Prior};
#[cfg(test)]
use crate::vectorize::segment::raster::OUTSIDE;
use crate::vectorize::segment::raster::Raster;

/// Marks a pixel of no superpixel.
pub(super) const NONE: u32 = u32::MAX;

/// One superpixel. Its place in [`Partition::superpixels`] may change from frame to frame, `id` never does.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Superpixel {
    /// Its label: number within the slab, in order of birth.
    pub(super) id: u32,
    /// What the frame before tells; none if it is new in this frame.
    pub(super) prior: Option<Prior>,
    /// Displacement from the frame before, in pixels.
    pub(super) motion: [f64; 2],
    pub(super) moments: Moments,
    /// The means, at hand for [`Superpixel::cost_of_joining`].
    cached: Cached,
}

/// Means and how many pixels they rest on, in single precision: these only rank the moves of one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Cached {
    place: [f32; 2],
    color: [f32; 3],
    place_area: f32,
    color_area: f32,
}

impl Superpixel {
    pub(super) fn means(&self, model: &Model) -> Means {
        model.means(&self.moments, self.prior.as_ref())
    }

    pub(super) fn energy(&self, model: &Model) -> f64 {
        model.energy(&self.moments, self.prior.as_ref())
    }

    /// By how much the misfit grows when a pixel joins: the exact change, the means following (Hartigan's rule for
    /// k-means; Telgarsky and Vattani, AISTATS 2010, §2).
    pub(super) fn cost_of_joining(&self, model: &Model, place: [f32; 2], color: [f32; 3]) -> f32 {
        let Cached { place_area, color_area, .. } = self.cached;
        let [place2, color2] = self.distances2(place, color);
        color2 * color_area / (color_area + 1.0) + model.per_pixel2 as f32 * place2 * place_area / (place_area + 1.0)
    }

    /// By how much the misfit shrinks when one of several pixels leaves.
    pub(super) fn gain_of_leaving(&self, model: &Model, place: [f32; 2], color: [f32; 3]) -> f32 {
        let Cached { place_area, color_area, .. } = self.cached;
        let [place2, color2] = self.distances2(place, color);
        color2 * color_area / (color_area - 1.0) + model.per_pixel2 as f32 * place2 * place_area / (place_area - 1.0)
    }

    fn distances2(&self, place: [f32; 2], color: [f32; 3]) -> [f32; 2] {
        let distance2 = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
        [distance2(&place, &self.cached.place), distance2(&color, &self.cached.color)]
    }

    fn refresh(&mut self, model: &Model) {
        let Means { place, color } = self.means(model);
        let area = self.moments.area as f64;
        let known = |weight: fn(&Prior) -> f64| self.prior.as_ref().map_or(0.0, weight);
        self.cached = Cached {
            place: place.map(|v| v as f32),
            color: color.map(|v| v as f32),
            place_area: (area + known(|prior| prior.place_weight)) as f32,
            color_area: (area + known(|prior| prior.color_weight)) as f32,
        };
    }
}

/// A neighbour of a superpixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Contact {
    /// Place of the neighbour.
    pub(super) with: u32,
    /// Pixel sides shared.
    pub(super) sides: u32,
    /// Pairs of 8-neighbours shared, sides included.
    pub(super) pairs: u32,
}

/// All superpixels of a frame.
#[derive(Debug, Clone)]
pub(super) struct Partition {
    pub(super) raster: Raster,
    pub(super) colors: Vec<Color>,
    /// For every pixel the place of its superpixel.
    pub(super) plane: Vec<u32>,
    /// For every pixel the place of the heir of the superpixel that motion brought to it, or [`NONE`].
    pub(super) carried: Vec<u32>,
    pub(super) superpixels: Vec<Superpixel>,
    next_id: u32,
}

impl Partition {
    pub(super) fn new(raster: Raster, colors: Vec<Color>) -> Self {
        let nothing = vec![NONE; raster.len()];
        Self { raster, colors, plane: nothing.clone(), carried: nothing, superpixels: Vec::new(), next_id: 0 }
    }

    /// Adds a new, empty superpixel and returns its place.
    pub(super) fn add(&mut self, motion: [f64; 2]) -> u32 {
        let id = self.next_id;
        self.next_id += 1;
        let (moments, cached) = (Moments::default(), Cached::default());
        self.superpixels.push(Superpixel { id, prior: None, motion, moments, cached });
        self.superpixels.len() as u32 - 1
    }

    /// Makes a dead superpixel of a new one: its name and what is known of it.
    pub(super) fn name(&mut self, model: &Model, place: u32, id: u32, prior: Prior) {
        self.superpixels[place as usize].id = id;
        self.set_prior(model, place, Some(prior));
    }

    /// Makes a new superpixel of an old one: another name, no prior.
    pub(super) fn rename(&mut self, model: &Model, place: u32) {
        self.superpixels[place as usize].id = self.next_id;
        self.next_id += 1;
        self.set_prior(model, place, None);
    }

    pub(super) fn get(&self, place: u32) -> &Superpixel {
        &self.superpixels[place as usize]
    }

    /// Moves pixel `p` to another superpixel, and the sums with it.
    pub(super) fn reassign(&mut self, model: &Model, p: usize, to: u32) {
        let (place, color) = (self.raster.xy(p).into(), self.colors[p]);
        let from = std::mem::replace(&mut self.plane[p], to);
        if let Some(superpixel) = self.superpixels.get_mut(from as usize) {
            superpixel.moments.remove(place, color);
            superpixel.refresh(model);
        }
        if let Some(superpixel) = self.superpixels.get_mut(to as usize) {
            superpixel.moments.add(place, color);
            superpixel.refresh(model);
        }
    }

    /// Makes a new superpixel, the second heir, of some pixels of another. Returns its place.
    pub(super) fn part_off(&mut self, model: &Model, place: u32, pixels: &[u32]) -> u32 {
        let moments = self.moments_of(pixels);
        let part = self.add(self.get(place).motion);
        for &p in pixels {
            self.plane[p as usize] = part;
            let carried = &mut self.carried[p as usize];
            *carried = if *carried == place { part } else { *carried };
        }
        for (place, change) in [(place, Moments::default().minus(moments)), (part, moments)] {
            let superpixel = &mut self.superpixels[place as usize];
            superpixel.moments = superpixel.moments.plus(change);
            superpixel.refresh(model);
        }
        part
    }

    /// Swaps what two superpixels are called, and with it what the frame before tells of them.
    pub(super) fn swap_identities(&mut self, model: &Model, a: u32, b: u32) {
        let (one, other) = (self.get(a).clone(), self.get(b).clone());
        for (place, named) in [(a, other), (b, one)] {
            let superpixel = &mut self.superpixels[place as usize];
            (superpixel.id, superpixel.prior, superpixel.motion) = (named.id, named.prior, named.motion);
            superpixel.refresh(model);
        }
    }

    /// Sums of a set of pixels.
    pub(super) fn moments_of(&self, pixels: &[u32]) -> Moments {
        let mut moments = Moments::default();
        pixels.iter().for_each(|&p| moments.add(self.raster.xy(p as usize).into(), self.colors[p as usize]));
        moments
    }

    /// Takes all sums from the plane.
    pub(super) fn recount(&mut self, model: &Model) {
        self.superpixels.iter_mut().for_each(|superpixel| superpixel.moments = Moments::default());
        for (p, &place) in self.plane.iter().enumerate().filter(|&(_, &place)| place != NONE) {
            self.superpixels[place as usize].moments.add(self.raster.xy(p).into(), self.colors[p]);
        }
        self.superpixels.iter_mut().for_each(|superpixel| superpixel.refresh(model));
    }

    /// Replaces what the frame before tells of a superpixel.
    pub(super) fn set_prior(&mut self, model: &Model, place: u32, prior: Option<Prior>) {
        let superpixel = &mut self.superpixels[place as usize];
        superpixel.prior = prior;
        superpixel.refresh(model);
    }

    /// Moves every pixel of a superpixel, and what motion brought, to its entry of `heirs`. Sums are taken anew.
    pub(super) fn pass_on(&mut self, model: &Model, heirs: &[u32]) {
        for place in self.plane.iter_mut().chain(&mut self.carried).filter(|place| **place != NONE) {
            *place = heirs[*place as usize];
        }
        self.recount(model);
    }

    /// Takes the empty superpixels out; the others keep their order.
    pub(super) fn take_empty(&mut self) -> Vec<Superpixel> {
        let mut places = vec![NONE; self.superpixels.len()];
        let (mut kept, mut empty) = (Vec::with_capacity(self.superpixels.len()), Vec::new());
        for (place, superpixel) in places.iter_mut().zip(self.superpixels.drain(..)) {
            if superpixel.moments.area > 0 {
                *place = kept.len() as u32;
                kept.push(superpixel);
            } else {
                empty.push(superpixel);
            }
        }
        self.superpixels = kept;
        for place in self.plane.iter_mut().chain(&mut self.carried).filter(|place| **place != NONE) {
            *place = places[*place as usize];
        }
        empty
    }

    /// The neighbours of each superpixel that share a side with it, in order of first contact.
    pub(super) fn contacts(&self) -> Vec<Vec<Contact>> {
        let mut contacts: Vec<Vec<Contact>> = vec![Vec::new(); self.superpixels.len()];
        let mut count = |a: u32, b: u32, sides: u32| {
            for (here, with) in [(a, b), (b, a)] {
                let known = &mut contacts[here as usize];
                match known.iter_mut().find(|contact| contact.with == with) {
                    Some(contact) => {
                        contact.sides += sides;
                        contact.pairs += 1;
                    }
                    None => known.push(Contact { with, sides, pairs: 1 }),
                }
            }
        };
        let Raster { width, height } = self.raster;
        for (y, row) in self.plane.chunks_exact(width).enumerate() {
            // The last row stands for the one below it, which adds no contacts but those along it.
            let below = &self.plane[(y + 1).min(height - 1) * width..][..width];
            for (x, &here) in row.iter().enumerate() {
                let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
                if [row[right], below[left], below[x], below[right]] == [here; 4] {
                    continue;
                }
                if row[right] != here {
                    count(here, row[right], 1);
                }
                if y + 1 == height {
                    continue;
                }
                for (other, sides) in [(below[x], 1), (below[left], 0), (below[right], 0)] {
                    if other != here {
                        count(here, other, sides);
                    }
                }
            }
        }
        contacts.iter_mut().for_each(|known| known.retain(|contact| contact.sides > 0));
        contacts
    }

    /// The pixels of each superpixel, in row order.
    pub(super) fn members(&self) -> Members {
        let mut starts = vec![0usize; self.superpixels.len() + 1];
        for &place in self.plane.iter().filter(|&&place| place != NONE) {
            starts[place as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut pixels = vec![0u32; starts[self.superpixels.len()]];
        for (p, &place) in self.plane.iter().enumerate().filter(|&(_, &place)| place != NONE) {
            pixels[next[place as usize]] = p as u32;
            next[place as usize] += 1;
        }
        Members { starts, pixels }
    }

    /// The whole objective, see [`Model`].
    #[cfg(test)]
    pub(super) fn objective(&self, model: &Model) -> f64 {
        let foreign = |(p, here): (usize, &u32)| {
            self.raster.ring(p).into_iter().filter(|&q| q != OUTSIDE && self.plane[q] != *here).count() as f64
        };
        let pairs: f64 = self.plane.iter().enumerate().map(foreign).sum::<f64>() / 2.0;
        let strays = self.plane.iter().zip(&self.carried).filter(|(a, b)| a != b && **b != NONE).count();
        let alive = self.superpixels.iter().filter(|superpixel| superpixel.moments.area > 0);
        alive.map(|superpixel| superpixel.energy(model)).sum::<f64>()
            + model.outline * pairs
            + model.loyalty * strays as f64
    }
}

/// Pixels by superpixel, see [`Partition::members`].
#[derive(Debug)]
pub(super) struct Members {
    starts: Vec<usize>,
    pixels: Vec<u32>,
}

impl Members {
    pub(super) fn of(&self, place: u32) -> &[u32] {
        &self.pixels[self.starts[place as usize]..self.starts[place as usize + 1]]
    }
}
