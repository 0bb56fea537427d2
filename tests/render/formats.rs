//! Pixel formats: all carry the picture that RGB carries.

use tetvec::render::draw;
use tetvec::video::{Frame, PixelFormat, Plane, PlaneRef, Surface, YuvMatrix};

use crate::drawing::{picture, smooth};
use crate::meshes::Lattice;

const FORMATS: [PixelFormat; 5] =
    [PixelFormat::Rgb, PixelFormat::Rgbx, PixelFormat::Bgrx, PixelFormat::I420, PixelFormat::Nv12];

/// Bytes of padding are filled with this, and must stay.
const PADDING: u8 = 0xA5;

struct Drawn {
    planes: Vec<(Vec<u8>, usize)>,
    frame: Frame,
}

/// Draws in `format` with `extra` bytes of padding a row, and reads the result back.
fn drawn(format: PixelFormat, matrix: YuvMatrix, size: (u32, u32), extra: usize) -> Drawn {
    let mesh = Lattice::new([40, 30, 6], [3, 3, 2]).plain(12);
    let sizes = format.plane_sizes(size.0, size.1);
    let mut planes: Vec<_> =
        sizes.iter().map(|&(row, rows)| (vec![PADDING; (row + extra) * rows - extra], row + extra)).collect();
    let views = planes.iter_mut().map(|(data, stride)| Plane { data, stride: *stride }).collect();
    let mut surface = Surface::try_new(format, matrix, size, views).expect("planes of the right size");
    draw(&mesh, 2.5, &smooth(1), &mut surface).expect("the whole picture");
    let views: Vec<_> = planes.iter().map(|(data, stride)| PlaneRef { data, stride: *stride }).collect();
    let frame = Frame::try_from_planes(format, matrix, size, &views).expect("planes of the right size");
    Drawn { planes, frame }
}

#[test]
fn rgb_formats_carry_the_same_picture() {
    let mesh = Lattice::new([40, 30, 6], [3, 3, 2]).plain(12);
    for size in [(1, 1), (41, 33), (64, 100)] {
        let reference = picture(&mesh, 2.5, smooth(1), size);
        for format in [PixelFormat::Rgb, PixelFormat::Rgbx, PixelFormat::Bgrx] {
            for extra in [0, 1, 13] {
                assert_eq!(drawn(format, YuvMatrix::Bt601, size, extra).frame.pixels(), reference, "{format:?}");
            }
        }
    }
}

#[test]
fn yuv_formats_carry_the_same_picture() {
    let mesh = Lattice::new([40, 30, 6], [3, 3, 2]).plain(12);
    for size in [(320, 241), (401, 300), (255, 513)] {
        let reference = picture(&mesh, 2.5, smooth(1), size);
        for format in [PixelFormat::I420, PixelFormat::Nv12] {
            for matrix in [YuvMatrix::Bt601, YuvMatrix::Bt709] {
                let frame = drawn(format, matrix, size, 3).frame;
                let off = frame.pixels().iter().zip(&reference).flat_map(|(a, b)| (0..3).map(|c| a[c].abs_diff(b[c])));
                let (mut total, mut worst) = (0, 0);
                off.for_each(|off| (total, worst) = (total + u32::from(off), worst.max(off)));
                let mean = f64::from(total) / (3 * reference.len()) as f64;
                // Colour changes slowly here, by up to about 4 levels a pixel.
                assert!(mean < 1.0 && worst <= 8, "{format:?} {matrix:?} {size:?}: mean {mean}, worst {worst}");
            }
        }
    }
}

#[test]
fn i420_and_nv12_hold_the_same_samples() {
    for size in [(1, 1), (2, 3), (37, 65)] {
        let planar = drawn(PixelFormat::I420, YuvMatrix::Bt709, size, 0);
        let paired = drawn(PixelFormat::Nv12, YuvMatrix::Bt709, size, 0);
        assert_eq!(planar.planes[0], paired.planes[0]);
        let pairs: Vec<u8> = planar.planes[1].0.iter().zip(&planar.planes[2].0).flat_map(|(u, v)| [*u, *v]).collect();
        assert_eq!(pairs, paired.planes[1].0);
        assert_eq!(planar.frame, paired.frame);
    }
}

#[test]
fn padding_is_left_alone() {
    for format in FORMATS {
        for (plane, (data, stride)) in drawn(format, YuvMatrix::Bt601, (33, 35), 11).planes.iter().enumerate() {
            let row = stride - 11;
            let padding = data.chunks(*stride).filter_map(|bytes| bytes.get(row..)).flatten();
            assert!(padding.into_iter().all(|byte| *byte == PADDING), "{format:?}, plane {plane}");
        }
    }
}
