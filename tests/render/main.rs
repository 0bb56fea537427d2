//! Rendering from outside: subdivision, slicing, filling, formats.

mod boundaries;
mod drawing;
mod formats;
mod meshes;
mod subdivision;
