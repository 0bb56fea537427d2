//! The encoder's stages, one room each, in the order of the flow: segment, lattice, cleave, simplify, fit.
//!
//! Forbidden here: a stage that calls another; [`crate::encoder`] alone knows the order.

pub mod cleave;
pub mod fit;
pub mod lattice;
mod parallel;
pub mod segment;
pub mod simplify;
