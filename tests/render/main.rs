//! Rendering from outside: subdivision, slicing, filling, formats.

mod drawing;
mod formats;
mod meshes;
mod subdivision;
