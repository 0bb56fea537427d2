//! What the tests of the elements share: small streams, files of them, and pipelines that are run to their end.
#![allow(dead_code, unreachable_pub, reason = "each test binary uses its own part")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, Once};

use gst::ClockTime;
use gst::prelude::*;

/// Width and height of the small streams.
pub const SIZE: (i32, i32) = (48, 32);
/// Frames a second of the small streams.
pub const RATE: u64 = 25;

/// The encoder of all tests: keyframes every five frames, and settings that make it quick.
pub const ENCODER: &str = "tetvecenc key-int-max=5 window=4 superpixels=1";

/// Longest time that a pipeline may take.
const PATIENCE: ClockTime = ClockTime::from_seconds(60);

/// Starts GStreamer with our elements.
pub fn init() {
    static INIT: Once = Once::new();
    INIT.call_once(|| {
        gst::init().expect("GStreamer starts");
        gsttetvec::plugin_register_static().expect("the plugin registers");
    });
}

/// A file that is removed when dropped.
pub struct TempFile(PathBuf);

impl TempFile {
    /// A file of these bytes.
    pub fn new(bytes: &[u8]) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let name = format!("tetvec-{}-{}.tetv", std::process::id(), NUMBER.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, bytes).expect("the temporary directory can be written to");
        Self(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// `filesrc` of this file.
    pub fn source(&self) -> String {
        format!("filesrc location={}", self.0.display())
    }

    /// A source of this file that does not let others read anywhere.
    pub fn push_source(&self) -> String {
        format!("pushfilesrc location={}", self.0.display())
    }

    pub fn uri(&self) -> String {
        gst::glib::filename_to_uri(&self.0, None).expect("an absolute path").into()
    }
}

impl Drop for TempFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// What came out of a pipeline.
#[derive(Debug, Default)]
pub struct Outcome {
    pub samples: Vec<gst::Sample>,
    pub errors: Vec<String>,
    pub warnings: Vec<String>,
}

impl Outcome {
    /// Fails unless the pipeline ended without an error.
    #[track_caller]
    pub fn expect_clean(self) -> Self {
        assert!(self.errors.is_empty(), "{:?}", self.errors);
        self
    }

    pub fn buffers(&self) -> impl DoubleEndedIterator<Item = &gst::BufferRef> {
        self.samples.iter().map(|sample| sample.buffer().expect("a buffer"))
    }

    /// Time stamps in order.
    pub fn times(&self) -> Vec<ClockTime> {
        self.buffers().map(|buffer| buffer.pts().expect("a stamp")).collect()
    }

    /// All bytes, in order.
    pub fn bytes(&self) -> Vec<u8> {
        self.buffers().flat_map(|buffer| buffer.map_readable().expect("memory").to_vec()).collect()
    }

    /// Format, size and so on of the first sample.
    pub fn info(&self) -> gst_video::VideoInfo {
        let caps = self.samples.first().expect("a sample").caps().expect("caps");
        gst_video::VideoInfo::from_caps(caps).expect("raw video")
    }
}

/// A pipeline with an `appsink` named `sink` whose samples are collected.
pub struct Running {
    pub pipeline: gst::Pipeline,
    samples: Arc<Mutex<Vec<gst::Sample>>>,
}

impl Running {
    /// Makes a pipeline; ` ! appsink` is added to its description.
    pub fn new(description: &str) -> Self {
        init();
        let description = format!("{description} ! appsink name=sink sync=false");
        let pipeline = gst::parse::launch(&description).expect("a description of a pipeline");
        let pipeline = pipeline.downcast::<gst::Pipeline>().expect("a pipeline");
        let sink = pipeline.by_name("sink").and_downcast::<gst_app::AppSink>().expect("an appsink");
        let samples = Arc::new(Mutex::new(Vec::new()));
        let collected = Arc::clone(&samples);
        let callbacks = gst_app::AppSinkCallbacks::builder().new_sample(move |sink| {
            let sample = sink.pull_sample().map_err(|_| gst::FlowError::Eos)?;
            // A copy: where a flush takes a CAPS event out of its queue, appsink writes the pad's caps into the sample
            // that it handed out last, which it must not if others hold it (GStreamer 1.22).
            collected.lock().expect("no test panics here").push(sample.copy());
            Ok(gst::FlowSuccess::Ok)
        });
        sink.set_callbacks(callbacks.build());
        Self { pipeline, samples }
    }

    pub fn element(&self, name: &str) -> gst::Element {
        self.pipeline.by_name(name).expect("a named element")
    }

    /// Goes to PAUSED and waits until data flows.
    pub fn preroll(&self) {
        self.pipeline.set_state(gst::State::Paused).expect("can pause");
        let (result, state, _) = self.pipeline.state(PATIENCE);
        assert!(result.is_ok() && state == gst::State::Paused, "no preroll: {result:?}");
    }

    /// Plays to the end, or to an error, and stops.
    pub fn finish(self) -> Outcome {
        let mut outcome = Outcome::default();
        if self.pipeline.set_state(gst::State::Playing).is_err() {
            outcome.errors.push("cannot play".into());
        }
        let bus = self.pipeline.bus().expect("a pipeline has a bus");
        let kinds = [gst::MessageType::Eos, gst::MessageType::Error, gst::MessageType::Warning];
        loop {
            let message = bus.timed_pop_filtered(PATIENCE, &kinds).expect("the pipeline ends in time");
            match message.view() {
                gst::MessageView::Error(error) => {
                    outcome.errors.push(format!("{} {:?}", error.error(), error.debug()));
                    break;
                }
                gst::MessageView::Warning(warning) => outcome.warnings.push(warning.error().to_string()),
                _ => break,
            }
        }
        self.pipeline.set_state(gst::State::Null).expect("can stop");
        outcome.samples = std::mem::take(&mut self.samples.lock().expect("no test panics here"));
        outcome
    }

    /// Forgets what has been collected so far.
    pub fn clear(&self) {
        self.samples.lock().expect("no test panics here").clear();
    }
}

/// Runs a pipeline to its end; ` ! appsink` is added to its description.
pub fn run(description: &str) -> Outcome {
    Running::new(description).finish()
}

/// A moving ball of `frames` frames, as raw video.
pub fn raw(frames: u64) -> String {
    let (width, height) = SIZE;
    format!(
        "videotestsrc pattern=ball num-buffers={frames} ! video/x-raw,width={width},height={height},framerate={RATE}/1"
    )
}

/// A small stream of `frames` frames, a keyframe every five. Each is encoded once.
pub fn stream(frames: u64) -> Vec<u8> {
    static STREAMS: Mutex<BTreeMap<u64, Vec<u8>>> = Mutex::new(BTreeMap::new());
    let mut streams = STREAMS.lock().expect("no test panics here");
    streams.entry(frames).or_insert_with(|| encode(&raw(frames)).bytes()).clone()
}

/// The packets of a raw source, a keyframe every five frames.
pub fn encode(source: &str) -> Outcome {
    run(&format!("{source} ! {ENCODER}")).expect_clean()
}

/// Time of a frame of the small streams.
pub fn time_of(frame: u64) -> ClockTime {
    ClockTime::from_nseconds(frame * 1_000_000_000 / RATE)
}

/// The outlines of the packets of a stream: (first byte, header).
pub fn packets(bytes: &[u8]) -> Vec<(usize, tetvec::bitstream::PacketHeader)> {
    let limits = tetvec::bitstream::Limits::default();
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let header = tetvec::bitstream::parse_packet_header(&bytes[at..], &limits);
        let header = header.expect("a sound stream").expect("a whole stream");
        found.push((at, header));
        at += header.length;
    }
    found
}
