//! From a slab's control mesh to pixels: subdivide, slice at a time, fill, pack into the pixel format.
//!
//! ```text
//! complex -> rings -> level | refiner -> slice -> setup -> near | scan, run -> canvas -> crossed -> pack
//! ```
//!
//! In: a mesh, a time, a size. Out: pixels; for the fit also masks ([`color_masks`], [`position_masks`]) and where
//! pixels lie in the mesh ([`sample`]). Geometry is in *fine units*, integers of 2^-[`FINE_BITS`] lattice units.
//!
//! Forbidden here: coding, files, clocks; anything that makes pixels depend on the number of threads.

mod active;
mod canvas;
mod children;
mod complex;
mod coverage;
mod cpu;
mod crossed;
mod draw;
mod grid;
mod interfaces;
mod lanes;
mod level;
mod masks;
mod measure;
mod near;
mod pack;
mod paint;
mod parallel;
mod piece;
#[cfg(test)]
mod random;
mod refiner;
mod rings;
mod run;
mod sample;
mod scan;
mod scene;
mod second;
mod section;
mod setup;
mod shade;
mod slice;
mod subdivide;
mod view;
mod window;

pub use complex::{FINE_BITS, Node};
pub use draw::{DrawParams, draw};
pub use masks::{Masks, color_masks, position_masks};
pub use sample::{PixelSamples, sample};
pub use scene::Scene;
pub use section::{SectionPolygon, cross_section};
pub use subdivide::{Refined, subdivide};
pub use view::{Viewport, ViewportError};
