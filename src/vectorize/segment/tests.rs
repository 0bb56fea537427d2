//! Whole clips through the segmenter.

use std::collections::BTreeSet;

use super::connect::pieces;
use super::raster::Raster;
use super::{SegmentParams, Segmenter, explained_variation, mean_duration};
use crate::video::{Frame, Label, LabelPlane};

/// A scene drawn at 4x4 samples a pixel, so that edges are blended as a camera blends them.
fn draw(width: u32, height: u32, color: impl Fn(f32, f32) -> [f32; 3]) -> Frame {
    let pixel = |x: u32, y: u32| {
        let mut sum = [0.0; 3];
        for sample in 0..16u32 {
            let at = |pixel: u32, step: u32| pixel as f32 + (step as f32 + 0.5) / 4.0;
            let here = color(at(x, sample % 4), at(y, sample / 4));
            sum = [0, 1, 2].map(|c| sum[c] + here[c] / 16.0);
        }
        sum.map(|level| level.round().clamp(0.0, 255.0) as u8)
    };
    Frame::from_fn(width, height, pixel).expect("size")
}

fn is_in_disc(x: f32, y: f32, center: [f32; 2], radius: f32) -> bool {
    (x - center[0]).hypot(y - center[1]) < radius
}

/// A bright disc before a darker ground, both with a slight gradient.
fn disc_frame(center: [f32; 2], radius: f32) -> Frame {
    draw(96, 72, |x, y| {
        if is_in_disc(x, y, center, radius) { [220.0, 180.0 + y * 0.3, 60.0] } else { [30.0 + x * 0.2, 50.0, 90.0] }
    })
}

fn labels_of(plane: &LabelPlane) -> BTreeSet<Label> {
    plane.labels().iter().copied().collect()
}

fn push_all(segmenter: &mut Segmenter, frames: &[Frame]) -> Vec<LabelPlane> {
    frames.iter().map(|frame| segmenter.push(frame)).collect()
}

#[test]
fn a_disc_keeps_its_label_as_it_moves() {
    for step in [0.3, 1.0, 6.5] {
        let center = |k: usize| [20.0 + k as f32 * step, 36.0];
        let frames: Vec<Frame> = (0..9).map(|k| disc_frame(center(k), 12.0)).collect();
        let planes = push_all(&mut Segmenter::new(96, 72, SegmentParams::new(0)), &frames);
        let disc = planes[0].label(20, 36);
        for (k, plane) in planes.iter().enumerate() {
            assert_eq!(labels_of(plane).len(), 2, "step {step}, frame {k}");
            for (p, &label) in plane.labels().iter().enumerate() {
                let (x, y) = ((p % 96) as f32 + 0.5, (p / 96) as f32 + 0.5);
                let distance = (x - center(k)[0]).hypot(y - center(k)[1]) - 12.0;
                assert!(
                    distance.abs() < 1.0 || (label == disc) == (distance < 0.0),
                    "step {step}, frame {k}: {x}, {y}"
                );
            }
        }
        assert!(explained_variation(&frames, &planes) > 0.95);
        assert_eq!(mean_duration(&planes), 9.0);
    }
}

#[test]
fn what_appears_gets_a_label_and_what_goes_gives_it_up() {
    let frames: Vec<Frame> = [0.0, 9.0, 9.0, 0.0, 0.0].map(|radius| disc_frame([48.0, 36.0], radius)).to_vec();
    let planes = push_all(&mut Segmenter::new(96, 72, SegmentParams::new(0)), &frames);
    let counts: Vec<usize> = planes.iter().map(|plane| labels_of(plane).len()).collect();
    assert_eq!(counts, [1, 2, 2, 1, 1]);
    assert!(planes.iter().all(|plane| plane.label(2, 2) == planes[0].label(2, 2)));
    assert_eq!(planes[1].label(48, 36), planes[2].label(48, 36));
}

#[test]
fn an_occluded_disc_comes_back_and_the_pillar_before_it_stays() {
    let frames: Vec<Frame> = (0..14)
        .map(|k| {
            let center = [14.0 + 5.0 * k as f32, 36.0];
            draw(96, 72, |x, y| {
                if (44.0..54.0).contains(&x) {
                    [20.0, 160.0, 60.0]
                } else if is_in_disc(x, y, center, 10.0) {
                    [230.0, 90.0, 80.0]
                } else {
                    [40.0, 40.0, 120.0]
                }
            })
        })
        .collect();
    let planes = push_all(&mut Segmenter::new(96, 72, SegmentParams::new(0)), &frames);
    let pillar = planes[0].label(48, 20);
    for (k, plane) in planes.iter().enumerate() {
        assert_eq!(plane.label(48, 20), pillar, "frame {k}");
        let x = 14 + 5 * k as u32;
        if !(33..65).contains(&x) {
            assert!(![pillar, plane.label(x, 10)].contains(&plane.label(x, 36)), "frame {k}");
        }
    }
}

#[test]
fn a_still_picture_keeps_identical_planes() {
    for superpixels in [0, 1, 30] {
        let mut segmenter = Segmenter::new(96, 72, SegmentParams::new(superpixels));
        let frame = disc_frame([40.0, 30.0], 15.0);
        let planes = push_all(&mut segmenter, &vec![frame; 4]);
        assert!(planes.iter().all(|plane| *plane == planes[0]), "{superpixels} superpixels");
    }
}

#[test]
fn motion_elsewhere_leaves_still_boundaries_alone() {
    let frames: Vec<Frame> = (0..6)
        .map(|k| {
            let moving = [70.0 + k as f32 * 1.7, 54.0];
            draw(96, 72, |x, y| {
                if is_in_disc(x, y, [24.0, 24.0], 14.3) {
                    [210.0, 200.0, 60.0]
                } else if is_in_disc(x, y, moving, 10.0) {
                    [200.0, 40.0, 40.0]
                } else {
                    [30.0, 40.0, 90.0]
                }
            })
        })
        .collect();
    let planes = push_all(&mut Segmenter::new(96, 72, SegmentParams::new(0)), &frames);
    for plane in &planes[1..] {
        for y in 0..42 {
            assert!((0..42).all(|x| plane.label(x, y) == planes[0].label(x, y)), "row {y}");
        }
    }
}

#[test]
fn superpixels_number_about_as_asked_last_and_hang_together() {
    let texture = |x: f32, y: f32| {
        let wave = 60.0 * ((x * 0.21).sin() * (y * 0.17).cos() + (x * 0.05 + y * 0.08).sin());
        [120.0 + wave, 110.0 - wave * 0.5, 90.0 + wave * 0.3]
    };
    let frames: Vec<Frame> =
        (0..10).map(|k| draw(160, 120, |x, y| texture(x - 2.0 * k as f32, y - k as f32))).collect();
    let planes = push_all(&mut Segmenter::new(160, 120, SegmentParams::new(100)), &frames);
    for (k, plane) in planes.iter().enumerate() {
        let count = labels_of(plane).len();
        assert!((70..=125).contains(&count), "frame {k}: {count}");
        let labels = plane.labels();
        let found = pieces(Raster::new(160, 120), |_| true, |p, q| labels[p] == labels[q]);
        assert_eq!(found.areas.len(), count, "frame {k}: every superpixel in one piece");
    }
    // The content moves by 18 x 9 pixels: where it stays in view its superpixel's label is to move along.
    let followed = (0..160 * 120).filter(|&p| {
        let (x, y) = (p % 160, p / 160);
        x + 18 < 160 && y + 9 < 120 && planes[0].label(x, y) == planes[9].label(x + 18, y + 9)
    });
    let followed = followed.count() as f64 / f64::from((160 - 18) * (120 - 9));
    assert!(followed > 0.5, "{followed}");
    assert!(explained_variation(&frames, &planes) > 0.8, "{}", explained_variation(&frames, &planes));
    assert!(mean_duration(&planes) > 5.0, "{}", mean_duration(&planes));
}

#[test]
fn tiny_frames_and_noise_do_no_harm() {
    let level = |seed: u32| (seed.wrapping_mul(2_654_435_761) >> 24) as u8;
    for (w, h) in [(1, 1), (2, 2), (3, 1), (1, 40), (50, 40)] {
        for superpixels in [0, 1, 2, 100_000] {
            let mut segmenter = Segmenter::new(w, h, SegmentParams::new(superpixels));
            for k in 0..4 {
                let noise = |x, y| [level(x * 7 + y * 8191 + k * 77), level(x + y * 31 + k), level(x * y + 3 * k)];
                let frame = Frame::from_fn(w, h, noise).expect("size");
                let plane = segmenter.push(&frame);
                assert_eq!((plane.width(), plane.height()), (w, h));
                let count = labels_of(&plane).len() as u32;
                let most =
                    if superpixels == 0 { (w * h / 12).max(1) } else { superpixels.min(w * h) + superpixels / 5 + 1 };
                assert!(count <= most, "{w}x{h}, {superpixels} superpixels: {count} labels");
            }
        }
    }
}

#[test]
fn labels_have_no_small_islands() {
    let frame = draw(120, 90, |x, y| {
        let spot = ((x / 9.0).fract() - 0.5).hypot((y / 9.0).fract() - 0.5) * 9.0;
        if spot < (x / 40.0) { [230.0; 3] } else { [25.0; 3] }
    });
    let plane = Segmenter::new(120, 90, SegmentParams::new(0)).push(&frame);
    let labels = plane.labels();
    let found = pieces(Raster::new(120, 90), |_| true, |p, q| labels[p] == labels[q]);
    assert!(found.areas.iter().all(|&area| area >= 12), "{:?}", found.areas.iter().min());
    assert!(found.areas.len() > 10, "{} pieces", found.areas.len());
}

#[test]
fn a_scene_cut_starts_afresh() {
    let shots = [disc_frame([30.0, 30.0], 14.0), draw(96, 72, |x, y| [200.0 - y, 190.0, 240.0 - x * (y * 0.2).sin()])];
    let mut segmenter = Segmenter::new(96, 72, SegmentParams::new(0));
    let cuts: Vec<bool> = [0, 0, 1, 1, 0].map(|shot| segmenter.segment(&shots[shot]).scene_cut).to_vec();
    assert_eq!(cuts, [false, false, true, false, true]);
    let again = segmenter.push(&shots[0]);
    assert_eq!(
        again,
        Segmenter::new(96, 72, SegmentParams::new(0)).push(&shots[0]),
        "nothing of earlier scenes is left"
    );
}

#[test]
#[should_panic(expected = "frame size")]
fn frames_of_another_size_are_refused() {
    Segmenter::new(95, 72, SegmentParams::new(0)).push(&disc_frame([1.0, 1.0], 1.0));
}
