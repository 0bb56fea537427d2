//! Geometry: the control mesh, its adjacency, exact predicates, validation.
//!
//! In: positions, wedges and tets. Out: the same, with topology and checks. Forbidden here: pixels, coding,
//! anything that decides what the mesh should look like. Of our own rooms only `video::Label` is known.

mod adjacency;
mod domain;
mod face_map;
mod ids;
mod predicates;
mod tet_mesh;
mod validate;

pub use adjacency::{EDGES, FACES, StarTable};
pub use domain::{Domain, Sides};
pub(crate) use face_map::FaceMap;
pub use ids::{VertexId, WedgeId};
pub use predicates::volume6;
pub use tet_mesh::{MeshCounts, MeshTail, TetMesh, Wedge};
pub use validate::{MeshError, validate};
