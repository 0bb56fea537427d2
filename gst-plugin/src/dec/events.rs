//! The decoder's events: what each does to the stream, and in which order events leave.
//!
//! Sticky events must follow caps, and caps are only known once downstream was asked: all serialized events but
//! stream-start are held back until caps are sent.

use gst::prelude::*;
use gst::subclass::prelude::*;

use super::CAT;
use super::imp::TetvecDec;
use super::view::Shape;

impl TetvecDec {
    /// An event from upstream.
    pub(super) fn sink_event(&self, pad: &gst::Pad, event: gst::Event) -> bool {
        gst::log!(CAT, obj = pad, "Event {event:?}");
        let is_serialized = event.is_serialized();
        let handled = self.handle(pad, event);
        if is_serialized {
            self.lock_stream().done_with_input();
        }
        handled
    }

    fn handle(&self, pad: &gst::Pad, event: gst::Event) -> bool {
        match event.view() {
            gst::EventView::FlushStart(_) => {
                self.set_flushing(true);
                self.forward(pad, event)
            }
            gst::EventView::FlushStop(_) => {
                let queued = self.lock_stream().flush();
                self.set_flushing(false);
                let forwarded = self.forward(pad, event);
                queued.into_iter().for_each(|event| {
                    self.push_or_hold(event);
                });
                forwarded
            }
            gst::EventView::StreamStart(_) => {
                self.drain();
                self.forward(pad, event)
            }
            gst::EventView::Caps(caps) => {
                self.set_caps(caps.caps());
                true
            }
            gst::EventView::Segment(segment) => self.set_segment(segment.segment(), &event),
            gst::EventView::Eos(_) => self.end_of_stream(event),
            gst::EventView::Gap(_) | gst::EventView::SegmentDone(_) => {
                self.drain();
                self.negotiate_early();
                self.push_or_hold(event)
            }
            // A parser sends many, each time that it knows the bitrate better: so they wait among the packets.
            gst::EventView::Tag(_) => {
                self.lock_stream().queue_event(event);
                self.push_due();
                true
            }
            _ if event.is_serialized() => {
                self.finish_pictures();
                self.push_or_hold(event)
            }
            _ => self.forward(pad, event),
        }
    }

    /// An event from downstream.
    pub(super) fn src_event(&self, pad: &gst::Pad, event: gst::Event) -> bool {
        match event.view() {
            gst::EventView::Qos(report) => {
                let (_, proportion, diff, timestamp) = report.get();
                self.lock_output().qos.report(proportion, diff, timestamp);
                self.forward(pad, event)
            }
            gst::EventView::Navigation(_) => {
                let event = self.to_source_places(event);
                self.forward(pad, event)
            }
            // The pad is marked already; what is sent to us does not depend on what we send.
            gst::EventView::Reconfigure(_) => true,
            _ => self.forward(pad, event),
        }
    }

    /// A navigation event with its place in pixels of the source.
    fn to_source_places(&self, event: gst::Event) -> gst::Event {
        let shape = self.lock_output().output.as_ref().map(|output| Shape::of(&output.info));
        let (Some(shape), Some(source), Some(structure)) = (shape, self.lock_stream().source, event.structure()) else {
            return event;
        };
        let place = |name| structure.get::<f64>(name).ok();
        let (Some(x), Some(y)) = (place("pointer_x"), place("pointer_y")) else { return event };
        let [x, y] = self.view().to_source([x, y], shape, source);
        let mut structure = structure.to_owned();
        structure.set("pointer_x", x);
        structure.set("pointer_y", y);
        gst::event::Navigation::builder(structure).seqnum(event.seqnum()).build()
    }

    fn forward(&self, pad: &gst::Pad, event: gst::Event) -> bool {
        gst::Pad::event_default(pad, Some(&*self.obj()), event)
    }

    fn set_caps(&self, caps: &gst::CapsRef) {
        if self.sink_pad.current_caps().is_some_and(|current| *current == *caps) && self.lock_stream().source.is_some()
        {
            return;
        }
        self.drain();
        self.lock_stream().set_caps(caps);
        self.negotiate_early();
    }

    fn set_segment(&self, segment: &gst::Segment, event: &gst::Event) -> bool {
        self.drain();
        let (segment, event) = match segment.downcast_ref::<gst::ClockTime>() {
            Some(time) => (time.clone(), event.clone()),
            None => {
                gst::debug!(CAT, imp = self, "Segment in {:?}: times start at 0", segment.format());
                let open = gst::FormattedSegment::<gst::ClockTime>::new();
                let event = gst::event::Segment::builder(&open).seqnum(event.seqnum()).build();
                (open, event)
            }
        };
        self.lock_output().qos.reset();
        let mut query = gst::query::Latency::new();
        let live = self.sink_pad.peer_query(&mut query) && query.result().0;
        let mut stream = self.lock_stream();
        stream.set_segment(segment);
        stream.urgent.live = live;
        drop(stream);
        self.push_or_hold(event)
    }

    fn end_of_stream(&self, event: gst::Event) -> bool {
        self.drain();
        self.negotiate_early();
        if self.lock_stream().nothing_decoded() {
            gst::element_imp_error!(self, gst::StreamError::Decode, ("No picture could be decoded before the end"));
        }
        // Nothing will bring caps any more: what is held leaves in any case.
        self.push_held();
        self.src_pad.push_event(event)
    }

    /// Shows the pictures of packets that are queued. Errors of the flow come back with the next buffer. What lies
    /// beyond the end of the segment is decoded all the same, as packets of the next one may depend on it.
    fn finish_pictures(&self) {
        while let Err(error) = self.show_queued(0) {
            gst::debug!(CAT, imp = self, "The last pictures ended with {error:?}");
            if error != gst::FlowError::Eos {
                return;
            }
        }
    }

    /// Shows what is left to show. Errors of the flow come back with the next buffer.
    fn drain(&self) {
        self.finish_pictures();
        let group = self.lock_stream().take_gathered();
        if let Err(error) = self.play_group(group) {
            gst::debug!(CAT, imp = self, "Draining ended with {error:?}");
        }
    }

    /// Negotiates before the first picture if the stream is known already; that it fails is no error yet.
    fn negotiate_early(&self) {
        if self.lock_stream().source.is_none() {
            return;
        }
        if let Err(error) = self.negotiate_if_needed() {
            gst::debug!(CAT, imp = self, "Not negotiated yet: {error:?}");
        }
    }

    /// Sends the events before which no packet waits.
    pub(super) fn push_due(&self) {
        loop {
            // Not in the loop's condition, where the lock would be held over the push.
            let Some(event) = self.lock_stream().next_event() else { break };
            self.push_or_hold(event);
        }
    }

    fn push_or_hold(&self, event: gst::Event) -> bool {
        if self.src_pad.has_current_caps() {
            return self.src_pad.push_event(event);
        }
        self.lock_stream().hold(event);
        true
    }

    /// Sends the events that waited for caps.
    pub(super) fn push_held(&self) {
        let held = self.lock_stream().take_held();
        for event in held {
            self.src_pad.push_event(event);
        }
    }
}
