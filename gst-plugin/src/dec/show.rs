//! From a decoded packet to pictures on the source pad: which of them are shown, when, and drawn into what.
//!
//! Packets that come after are decoded while pictures are drawn: some are queued before the first of them is shown, but
//! none where they come live, or before the first picture after a start or a seek.

use gst::prelude::*;
use gst::subclass::prelude::*;
use tetvec::RenderParams;

use super::CAT;
use super::imp::TetvecDec;
use super::stream::Decoded;
use super::timing::{Picture, Span};
use super::view::Shape;

impl TetvecDec {
    /// Shows the pictures of queued packets until no more than `left` wait, and sends events behind them.
    pub(super) fn show_queued(&self, left: usize) -> Result<gst::FlowSuccess, gst::FlowError> {
        loop {
            self.push_due();
            self.check_flow()?;
            let Some((packet, decoded)) = self.lock_stream().receive(left) else { break };
            let number = match self.judge(&packet, decoded) {
                Decoded::Picture(number) => Some(number),
                Decoded::Concealed => None,
                _ => continue,
            };
            let span = self.lock_stream().admit(&packet, number);
            self.show_all(number, span)?;
        }
        Ok(gst::FlowSuccess::Ok)
    }

    /// Shows the pictures of a packet, of a lost one where it has no number.
    pub(super) fn show_all(&self, frame_number: Option<u64>, span: Span) -> Result<(), gst::FlowError> {
        loop {
            self.check_flow()?;
            // Before each picture, so that the times are those of the rate that downstream takes, and no picture is drawn
            // at a size that it no longer takes.
            self.negotiate_if_needed()?;
            let Some(picture) = self.lock_stream().next_picture(span) else { break };
            self.show(frame_number.map(|number| number as f64 + picture.position), picture)?;
        }
        Ok(())
    }

    /// Draws a picture and sends it, unless the segment or QoS forbid. `frame` is its number, with the part that has
    /// passed since; `None` for one in place of a lost one.
    fn show(&self, frame: Option<f64>, picture: Picture) -> Result<(), gst::FlowError> {
        let segment = self.lock_stream().segment.clone();
        let Some((time, duration)) = clip(&segment, picture)? else { return Ok(()) };
        if self.is_late(&segment, time, duration) {
            let mut stream = self.lock_stream();
            (stream.discont, stream.urgent.first) = (true, false);
            return Ok(());
        }
        if let Some(stream_time) = segment.to_stream_time(time) {
            // Only of interest to those who control properties.
            let _ = self.obj().sync_values(stream_time);
        }
        let output = self.lock_output().output.clone().ok_or(gst::FlowError::NotNegotiated)?;
        let buffer = output.pool.acquire_buffer(None)?;
        let view = self.view();
        let drawn = output.draw(buffer, |surface| {
            let mut stream = self.lock_stream();
            let params = RenderParams {
                // Beyond the last frame that came stands the last picture of it.
                frame: frame.unwrap_or(f64::INFINITY),
                viewport: stream.source.and_then(|source| view.viewport(source, Shape::of(&output.info))),
                mesh: view.mesh,
            };
            stream.render(&params, surface)
        });
        let mut buffer = drawn.map_err(|error| {
            error.log_with_object(&*self.obj());
            gst::element_imp_error!(self, gst::StreamError::Decode, ("Cannot draw a picture"), ["{error:?}"]);
            gst::FlowError::Error
        })?;
        let discont = {
            let mut stream = self.lock_stream();
            stream.urgent.first = false;
            std::mem::take(&mut stream.discont)
        };
        let header = buffer.make_mut();
        header.set_pts(time);
        header.set_duration(duration);
        if discont {
            header.set_flags(gst::BufferFlags::DISCONT);
        }
        if frame.is_none() {
            header.set_flags(gst::BufferFlags::CORRUPTED);
        }
        self.src_pad.push(buffer)?;
        gst::log!(CAT, imp = self, "Shown at {time}");
        Ok(())
    }

    /// Whether a picture comes too late to be worth drawing; the application is told of it.
    fn is_late(
        &self,
        segment: &gst::FormattedSegment<gst::ClockTime>,
        time: gst::ClockTime,
        duration: Option<gst::ClockTime>,
    ) -> bool {
        let message = {
            let mut shared = self.lock_output();
            if !shared.qos.is_late(segment.to_running_time(time)) {
                return false;
            }
            shared.qos.message(time, duration, segment)
        };
        let _ = self.obj().post_message(message.src(&*self.obj()).build());
        true
    }
}

/// The part of `picture` that lies in `segment`; `None` outside.
fn clip(
    segment: &gst::FormattedSegment<gst::ClockTime>,
    picture: Picture,
) -> Result<Option<(gst::ClockTime, Option<gst::ClockTime>)>, gst::FlowError> {
    let time = picture.time;
    if segment.rate() > 0.0 && segment.stop().is_some_and(|stop| time >= stop) {
        return Err(gst::FlowError::Eos);
    }
    let Some(duration) = picture.duration else {
        let outside =
            segment.start().is_some_and(|start| time < start) || segment.stop().is_some_and(|stop| time >= stop);
        return Ok((!outside).then_some((time, None)));
    };
    let end = time.checked_add(duration);
    let Some((start, stop)) = segment.clip(time, end) else { return Ok(None) };
    let start = start.unwrap_or(time);
    Ok(Some((start, stop.map(|stop| stop.saturating_sub(start)))))
}
