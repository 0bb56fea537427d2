//! How long the first accurate seek into a stream takes until its picture is there: `seek_time FILE FRAME [CAPS]`. Which
//! plugin is measured `GST_PLUGIN_PATH` says.
//!
//! A paused pipeline has shown the first picture and decoded no other packet. Each seek is the first of a pipeline of its
//! own; milliseconds of five of them are printed.

use std::error::Error;
use std::time::Instant;

use gst::ClockTime;
use gst::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, frame, caps @ ..] = &arguments[..] else {
        return Err("expected FILE FRAME [CAPS]".into());
    };
    let (frame, caps) = (frame.parse()?, caps.first().map_or("video/x-raw,format=I420", String::as_str));
    gst::init()?;
    for _ in 0..5 {
        println!("{:.0} ms", seconds(file, frame, caps)? * 1000.0);
    }
    Ok(())
}

/// From the seek to the picture, with a pipeline of its own.
fn seconds(file: &str, frame: u64, caps: &str) -> Result<f64, Box<dyn Error>> {
    let description =
        format!("filesrc name=source ! tetvecparse ! tetvecdec name=decoder ! {caps} ! fakesink sync=true");
    let pipeline = gst::parse::launch(&description)?.downcast::<gst::Pipeline>().map_err(|_| "no pipeline")?;
    pipeline.by_name("source").ok_or("no source")?.set_property("location", file);
    pipeline.set_state(gst::State::Paused)?;
    wait(&pipeline)?;
    let pad = pipeline.by_name("decoder").and_then(|decoder| decoder.static_pad("src")).ok_or("no pad")?;
    let caps = pad.current_caps().ok_or("no caps")?;
    let rate: gst::Fraction = caps.structure(0).ok_or("no caps")?.get("framerate")?;
    let time = u64::try_from(rate.denom())? * ClockTime::SECOND.nseconds() * frame / u64::try_from(rate.numer())?;
    let start = Instant::now();
    pipeline.seek_simple(gst::SeekFlags::FLUSH | gst::SeekFlags::ACCURATE, ClockTime::from_nseconds(time))?;
    wait(&pipeline)?;
    let taken = start.elapsed();
    pipeline.set_state(gst::State::Null)?;
    Ok(taken.as_secs_f64())
}

/// Until the picture of a change of state or a seek is there.
fn wait(pipeline: &gst::Pipeline) -> Result<(), Box<dyn Error>> {
    let bus = pipeline.bus().ok_or("no bus")?;
    let kinds = [gst::MessageType::AsyncDone, gst::MessageType::Error, gst::MessageType::Eos];
    let message = bus.timed_pop_filtered(ClockTime::from_seconds(60), &kinds).ok_or("nothing happened for a minute")?;
    match message.view() {
        gst::MessageView::AsyncDone(_) => Ok(()),
        gst::MessageView::Error(error) => Err(error.error().into()),
        _ => Err("the stream ended".into()),
    }
}
