//! Buffers to render into. In: the negotiated caps and the peer's answer to an allocation query. Out: a buffer pool,
//! downstream's or our own, and its buffers as the core's surfaces. Forbidden here: decoding, times.

use gst::prelude::*;
use gst_video::prelude::*;
use tetvec::{Plane, Surface};

use super::CAT;
use crate::caps;

/// What pictures are rendered to until the next negotiation.
#[derive(Debug, Clone)]
pub(super) struct Output {
    /// Format, size and rate.
    pub(super) info: gst_video::VideoInfo,
    /// An active pool.
    pub(super) pool: gst::BufferPool,
}

impl Output {
    /// Asks the peer of `pad` for a pool for `caps` and activates it, or one of our own.
    pub(super) fn try_new(pad: &gst::Pad, caps: &gst::Caps) -> Result<Self, gst::LoggableError> {
        let info = gst_video::VideoInfo::from_caps(caps)?;
        let mut query = gst::query::Allocation::new(Some(caps), true);
        // A peer that does not answer takes any buffer without padding.
        let answered = pad.peer_query(&mut query);
        let offer = answered.then_some(&*query);
        let pool = offer
            .and_then(|query| downstream_pool(query, caps, &info))
            .map_or_else(|| own_pool(offer, caps, &info), Ok)?;
        pool.set_active(true)?;
        Ok(Self { info, pool })
    }

    /// Draws into `buffer` with `draw`, which gets the buffer's planes.
    pub(super) fn draw<E: std::fmt::Display>(
        &self,
        buffer: gst::Buffer,
        draw: impl FnOnce(&mut Surface<'_>) -> Result<(), E>,
    ) -> Result<gst::Buffer, gst::LoggableError> {
        let mut frame = gst_video::VideoFrame::from_buffer_writable(buffer, &self.info)
            .map_err(|_| gst::loggable_error!(CAT, "Cannot map the output buffer"))?;
        let format = caps::pixel_format(self.info.format())
            .ok_or_else(|| gst::loggable_error!(CAT, "Format {:?}", self.info.format()))?;
        let strides: Vec<i32> = frame.plane_stride().to_vec();
        let count = frame.n_planes() as usize;
        let planes = frame
            .planes_data_mut()
            .into_iter()
            .take(count)
            .zip(strides)
            .map(|(data, stride)| Plane { data, stride: usize::try_from(stride).unwrap_or(0) })
            .collect();
        let size = (self.info.width(), self.info.height());
        let mut surface = Surface::try_new(format, caps::yuv_matrix(&self.info), size, planes)
            .map_err(|error| gst::loggable_error!(CAT, "{error}"))?;
        draw(&mut surface).map_err(|error| gst::loggable_error!(CAT, "{error}"))?;
        Ok(frame.into_buffer())
    }
}

/// The first pool that the peer offers, configured; `None` where there is none or it refuses.
fn downstream_pool(
    query: &gst::query::Allocation,
    caps: &gst::Caps,
    info: &gst_video::VideoInfo,
) -> Option<gst::BufferPool> {
    let (pool, size, min, max) = query.allocation_pools().next()?;
    let pool = pool?;
    let size = size.max(u32::try_from(info.size()).ok()?);
    configure(&pool, query, caps, (size, min, max)).then_some(pool)
}

fn own_pool(
    query: Option<&gst::query::Allocation>,
    caps: &gst::Caps,
    info: &gst_video::VideoInfo,
) -> Result<gst::BufferPool, gst::LoggableError> {
    let size =
        u32::try_from(info.size()).map_err(|_| gst::loggable_error!(CAT, "Pictures of {} bytes", info.size()))?;
    let pool = gst_video::VideoBufferPool::new().upcast::<gst::BufferPool>();
    let (min, max) =
        query.and_then(|query| query.allocation_pools().next()).map_or((0, 0), |(_, _, min, max)| (min, max));
    let silent = gst::query::Allocation::new(Some(caps), false);
    if configure(&pool, query.unwrap_or(&silent), caps, (size, min, max)) {
        return Ok(pool);
    }
    Err(gst::loggable_error!(CAT, "No buffer pool for {caps}"))
}

/// Configures `pool` for buffers of (bytes, least, most), with what else the query says. A pool may answer with another
/// configuration; it is taken if it holds our pictures.
fn configure(
    pool: &gst::BufferPool,
    query: &gst::query::Allocation,
    caps: &gst::Caps,
    (size, min, max): (u32, u32, u32),
) -> bool {
    let mut config = pool.config();
    config.set_params(Some(caps), size, min, max);
    if let Some((allocator, params)) = query.allocation_params().next() {
        config.set_allocator(allocator.as_ref(), Some(&params));
    }
    let strides = query.find_allocation_meta::<gst_video::VideoMeta>().is_some();
    if strides && pool.has_option(gst_video::BUFFER_POOL_OPTION_VIDEO_META) {
        config.add_option(gst_video::BUFFER_POOL_OPTION_VIDEO_META);
    }
    if pool.set_config(config).is_ok() {
        return true;
    }
    let changed = pool.config();
    changed.validate_params(Some(caps), size, min, max).is_ok() && pool.set_config(changed).is_ok()
}
