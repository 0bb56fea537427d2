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

/// A ground with a texture that repeats nowhere, and before it a square of another at `left`, if any.
fn square_frame(left: Option<f32>, side: f32) -> Frame {
    draw(160, 96, |x, y| {
        let top = 48.0 - side / 2.0;
        match left {
            Some(left) if (left..left + side).contains(&x) && (top..top + side).contains(&y) => {
                let (u, v) = (x - left, y - top);
                [200.0 + 30.0 * (u * 0.7).sin(), 120.0 + 40.0 * (v * 0.5 + u * 0.1).cos(), 40.0]
            }
            _ => [40.0 + 20.0 * (x * 0.13).sin(), 70.0 + 25.0 * (y * 0.17 + x * 0.03).cos(), 110.0],
        }
    })
}

fn superpixel_planes(frames: &[Frame], count: u32) -> Vec<LabelPlane> {
    push_all(&mut Segmenter::new(frames[0].width(), frames[0].height(), SegmentParams::new(count)), frames)
}

/// Labels of most of whose pixels lie in the square at (left, 48 - side / 2).
fn labels_in_square(plane: &LabelPlane, left: f32, side: f32) -> BTreeSet<Label> {
    let is_inside = |p: usize| {
        let (x, y) = ((p % 160) as f32 + 0.5, (p / 160) as f32 + 0.5);
        (left..left + side).contains(&x) && (48.0 - side / 2.0..48.0 + side / 2.0).contains(&y)
    };
    let is_mostly_inside = |label: &Label| {
        let pixels = plane.labels().iter().enumerate().filter(|(_, other)| *other == label);
        let (inside, all) = pixels.fold((0, 0), |(inside, all), (p, _)| (inside + usize::from(is_inside(p)), all + 1));
        2 * inside > all
    };
    labels_of(plane).into_iter().filter(is_mostly_inside).collect()
}

fn assert_connected(plane: &LabelPlane, what: &str) {
    let labels = plane.labels();
    let found = pieces(Raster::new(plane.width(), plane.height()), |_| true, |p, q| labels[p] == labels[q]);
    assert_eq!(found.areas.len(), labels_of(plane).len(), "{what}: every superpixel in one piece");
}

#[test]
fn superpixels_follow_a_fast_square() {
    for step in [12.0, 31.0] {
        let left = |k: usize| 12.0 + step * k as f32;
        let frames: Vec<Frame> = (0..4).map(|k| square_frame(Some(left(k)), 32.0)).collect();
        let planes = superpixel_planes(&frames, 120);
        let first = labels_in_square(&planes[0], left(0), 32.0);
        assert!(first.len() >= 4, "{} superpixels on the square", first.len());
        for (k, plane) in planes.iter().enumerate() {
            assert_connected(plane, &format!("step {step}, frame {k}"));
            let kept = labels_in_square(plane, left(k), 32.0).intersection(&first).count();
            assert!(10 * kept >= 9 * first.len(), "step {step}, frame {k}: {kept} of {}", first.len());
        }
    }
}

#[test]
fn superpixels_are_the_same_in_every_run() {
    let frames: Vec<Frame> = (0..4).map(|k| square_frame(Some(20.0 + 5.5 * k as f32), 30.0)).collect();
    assert_eq!(superpixel_planes(&frames, 90), superpixel_planes(&frames, 90));
}

#[test]
fn superpixels_are_born_where_something_appears_and_die_where_it_goes() {
    let frames: Vec<Frame> =
        [None, None, Some(60.0), Some(60.0), None, None].map(|left| square_frame(left, 36.0)).into();
    let planes = superpixel_planes(&frames, 120);
    let before = labels_of(&planes[1]);
    let [born, kept] = [2, 3].map(|k| labels_in_square(&planes[k], 60.0, 36.0));
    assert!(!born.is_empty() && born.is_disjoint(&before), "{born:?} are new");
    assert_eq!(born, kept);
    for plane in &planes[4..] {
        assert!(labels_of(plane).is_disjoint(&born), "nothing is left of the square");
    }
    let far = |plane: &LabelPlane| [plane.label(5, 5), plane.label(150, 10), plane.label(8, 90)];
    assert!(planes.iter().all(|plane| far(plane) == far(&planes[0])), "far away nothing happens");
}

#[test]
fn superpixels_give_way_to_an_occluder_and_leave_what_it_uncovers() {
    // The square moves over the ground by 9 pixels a frame: the ground before it goes, that behind it comes back.
    let left = |k: usize| 10.0 + 9.0 * k as f32;
    let frames: Vec<Frame> = (0..9).map(|k| square_frame(Some(left(k)), 32.0)).collect();
    let planes = superpixel_planes(&frames, 120);
    let square = labels_in_square(&planes[0], left(0), 32.0);
    for (k, plane) in planes.iter().enumerate() {
        let here = labels_in_square(plane, left(k), 32.0);
        let strays = plane.labels().iter().enumerate().filter(|(p, label)| {
            let (x, y) = ((p % 160) as f32 + 0.5, (p / 160) as f32 + 0.5);
            let is_outside = x < left(k) - 2.0 || x > left(k) + 34.0 || (y - 48.0).abs() > 18.0;
            is_outside && square.contains(label)
        });
        assert_eq!(strays.count(), 0, "frame {k}: the square's labels stay on it");
        assert!(here.intersection(&square).count() * 10 >= square.len() * 9, "frame {k}");
    }
    // What was before the square at the start is covered in the middle and has died.
    let covered = labels_in_square(&planes[0], left(4), 32.0);
    assert!(!covered.is_empty() && labels_in_square(&planes[4], left(4), 32.0).is_disjoint(&covered));
}

#[test]
fn an_old_label_comes_back_after_an_occlusion_of_one_frame() {
    let flash = draw(160, 96, |x, y| {
        if (40.0..90.0).contains(&x) && (24.0..72.0).contains(&y) {
            [20.0, 230.0, 60.0]
        } else {
            [40.0 + 20.0 * (x * 0.13).sin(), 70.0 + 25.0 * (y * 0.17 + x * 0.03).cos(), 110.0]
        }
    });
    let square = |left| square_frame(Some(left), 30.0);
    let frames = [square(50.0), square(50.0), flash, square(50.0)];
    let planes: [LabelPlane; 4] = superpixel_planes(&frames, 120).try_into().expect("four planes");
    let before = labels_in_square(&planes[1], 50.0, 30.0);
    let shares =
        planes.map(|plane| plane.labels().iter().filter(|label| before.contains(label)).count() as f64 / 900.0);
    assert!(shares[1] > 0.9 && shares[2] == 0.0, "{shares:?}");
    assert!(shares[3] > 0.5, "{shares:?}");
}

#[test]
fn noise_leaves_superpixels_of_a_still_picture_alone() {
    let noise = |k: u32, x: u32, y: u32| ((x * 7 + y * 8191 + k * 104_729).wrapping_mul(2_654_435_761) >> 30) as u8;
    let still = square_frame(Some(60.0), 36.0);
    let frames: Vec<Frame> = (0..5)
        .map(|k| {
            let pixel = |x, y| still.pixels()[(y * 160 + x) as usize].map(|level| level + noise(k, x, y));
            Frame::from_fn(160, 96, pixel).expect("size")
        })
        .collect();
    let planes = superpixel_planes(&frames, 100);
    assert!(planes.iter().all(|plane| *plane == planes[0]));
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
fn what_a_lens_blurs_is_no_jump() {
    // Edges that take `width` pixels from dark to bright.
    let frames = |width: f32| -> Vec<Frame> {
        let frame = |k: usize| {
            let center = [40.0 + 3.0 * k as f32, 36.0];
            draw(96, 72, |x, y| {
                let distance = (x - center[0]).hypot(y - center[1]) - 16.0;
                let inside = (0.5 - distance / width.max(1e-3)).clamp(0.0, 1.0);
                [40.0 + 180.0 * inside, 60.0 + 90.0 * inside, 80.0]
            })
        };
        (0..10).map(frame).collect()
    };
    for (width, labels) in [(0.0, 2), (0.5, 2), (3.0, 1), (5.0, 1)] {
        let planes = push_all(&mut Segmenter::new(96, 72, SegmentParams::new(0)), &frames(width));
        let found: BTreeSet<Label> = planes.iter().flat_map(labels_of).collect();
        assert_eq!(found.len(), labels, "edges of {width} pixels");
    }
}

/// Sides along the grid have one blend in each row, at any part of a pixel, and it goes to whoever has more of it.
#[test]
fn sides_along_the_grid_are_edges_wherever_they_are() {
    let (left, right, floor) = (8.3f32, 14.6f32, 10.4f32);
    let part = |n: u32, from: f32, to: f32| ((n as f32 + 1.0).min(to) - (n as f32).max(from)).clamp(0.0, 1.0);
    let frame = Frame::from_fn(48, 24, |x, y| {
        let (bar, sky) = (part(x, left, right), part(y, 0.0, floor));
        let ground = |c: usize| sky * [150.0, 200.0, 235.0][c] + (1.0 - sky) * [85.0, 85.0, 90.0][c];
        std::array::from_fn(|c| (bar * [110.0, 70.0, 40.0][c] + (1.0 - bar) * ground(c)).round() as u8)
    });
    let frame = frame.expect("size");
    let plane = push_all(&mut Segmenter::new(48, 24, SegmentParams::new(0)), &[frame]).remove(0);
    let [sky, bar, ground] = [plane.label(30, 4), plane.label(11, 4), plane.label(30, 18)];
    assert_eq!(BTreeSet::from([sky, bar, ground]).len(), 3, "three colours");
    for y in 0..10 {
        assert_eq!([7, 8, 14, 15].map(|x| plane.label(x, y)), [sky, bar, bar, sky], "row {y}");
    }
    for x in 20..48 {
        assert_eq!([9, 10].map(|y| plane.label(x, y)), [sky, ground], "column {x}");
    }
}

/// A drawing: a black block, and black strokes of `width` pixels on grounds of two colours, which pass between the rows.
fn stroke_frame(width: f32) -> Frame {
    let ground = |x: f32| if x < 48.0 { [150.0, 210.0, 240.0] } else { [250.0, 250.0, 245.0] };
    draw(96, 72, |x, y| {
        let stroke = (y - 20.2 - 0.11 * x).abs() < 0.5 * width && (8.0..88.0).contains(&x);
        let block = (40.0..60.0).contains(&x) && (50.0..64.0).contains(&y);
        if stroke || block { [20.0; 3] } else { ground(x) }
    })
}

#[test]
fn a_stroke_of_an_ink_is_one_region_of_its_colour() {
    for width in [0.8, 1.0, 1.5] {
        let frame = stroke_frame(width);
        let plane = Segmenter::new(96, 72, SegmentParams::new(0)).push(&frame);
        let row = |x: u32| (20.2 + 0.11 * (x as f32 + 0.5)) as u32;
        let stroke = plane.label(30, row(30));
        let pure = plane.pure_colors().expect("labels by content know their colours");
        for x in 10..86 {
            let found = (row(x) - 1..=row(x) + 1).find(|&y| plane.label(x, y) == stroke);
            let y = found.unwrap_or_else(|| panic!("{width}: the stroke ends at {x}"));
            let color = pure.pixel(x, y);
            assert!(color.iter().all(|channel| channel.abs_diff(20) < 8), "{width}, {x}: {color:?}");
        }
        let raster = Raster::new(96, 72);
        let pixels: Vec<usize> = (0..raster.len()).filter(|&p| plane.labels()[p] == stroke).collect();
        for &p in pixels.iter().filter(|&&p| p < 40 * 96) {
            assert!(raster.sides(p).any(|q| plane.labels()[q] == stroke), "{width}: hangs by a corner at {p}");
        }
    }
}

#[test]
fn small_things_have_labels_if_their_colour_is_worth_it() {
    let dot = |color: [f32; 3]| {
        let frame = draw(48, 48, |x, y| {
            let is_dot = (20.0..23.0).contains(&x) && (20.0..22.0).contains(&y);
            let is_block = x < 12.0;
            if is_dot || is_block { color } else { [90.0, 90.0, 90.0] }
        });
        let plane = Segmenter::new(48, 48, SegmentParams::new(0)).push(&frame);
        plane.label(21, 21) != plane.label(30, 30)
    };
    assert!(dot([255.0, 255.0, 40.0]));
    assert!(!dot([130.0, 130.0, 130.0]));
}

#[test]
fn labels_have_no_small_islands() {
    // Spots up to 3 pixels wide: what differs much is worth less room, but some.
    for (level, least) in [(75.0, 12), (230.0, 4)] {
        let frame = draw(120, 90, |x, y| {
            let spot = ((x / 9.0).fract() - 0.5).hypot((y / 9.0).fract() - 0.5) * 9.0;
            if spot < (x / 40.0) { [level; 3] } else { [25.0; 3] }
        });
        let plane = Segmenter::new(120, 90, SegmentParams::new(0)).push(&frame);
        let labels = plane.labels();
        let found = pieces(Raster::new(120, 90), |_| true, |p, q| labels[p] == labels[q]);
        assert!(found.areas.iter().all(|&area| area >= least), "{level}: {:?}", found.areas.iter().min());
        assert!(found.areas.len() > 10, "{level}: {} pieces", found.areas.len());
    }
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

#[test]
fn too_much_border_is_texture_for_the_rest_of_the_slab() {
    let stripes =
        |width: f32| draw(96, 48, |x, _| [if ((x / width) as u32).is_multiple_of(2) { 20.0 } else { 220.0 }; 3]);
    let mut segmenter = Segmenter::new(96, 48, SegmentParams { most_border: 0.1, ..SegmentParams::new(0) });
    let mut is_uniform = |width: f32| segmenter.push(&stripes(width)).is_uniform();
    assert!(!is_uniform(16.0));
    assert!(is_uniform(6.0));
    assert!(is_uniform(16.0));
    segmenter.start_slab();
    assert!(!segmenter.push(&stripes(16.0)).is_uniform());
}

#[test]
fn sharp_edges_of_what_is_not_flat_are_no_drawing() {
    let blocks = |texture: f32| {
        draw(96, 48, |x, y| {
            let grain = texture * (((x as u32 * 7 + y as u32 * 13) % 5) as f32 - 2.0);
            [if ((x / 24.0) as u32).is_multiple_of(2) { 40.0 } else { 200.0 } + grain; 3]
        })
    };
    let labels = |texture: f32| Segmenter::new(96, 48, SegmentParams::new(0)).push(&blocks(texture));
    assert!(!labels(0.0).is_uniform());
    assert!(labels(1.0).is_uniform());
}
