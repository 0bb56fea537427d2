//! Pixels: frames, windows of frames, label planes.
//!
//! In: raw pictures. Out: the same, typed and checked. Forbidden here: anything of ours; geometry, coding and
//! vectorisation live elsewhere.

mod convert;
mod edges;
mod frame;
mod label;
mod surface;
mod volume;

pub(crate) use convert::rgb_to_yuv;
pub use convert::{ConvertError, PlaneRef};
pub use edges::Edges;
pub use frame::{Frame, FrameError, MAX_FRAME_SIDE};
pub use label::{Label, LabelPlane};
pub use surface::{MAX_SURFACE_SIDE, PixelFormat, Plane, Surface, SurfaceError, YuvMatrix};
pub use volume::Volume;
