//! The sequence header, repeated in every keyframe packet.
//!
//! In: the bytes of a keyframe packet's header. Out: a checked header. The `bincode` crate is known in this file alone;
//! docs/format.md writes its bytes down, so that another library can read them.

use bincode::config;

use super::{Limits, ParseError};

/// A ratio of two integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bincode::Encode, bincode::Decode)]
pub struct Fraction {
    /// Above the line.
    pub numerator: u32,
    /// Below the line; not 0.
    pub denominator: u32,
}

/// What a decoder must know before the first mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bincode::Encode, bincode::Decode)]
pub struct SequenceHeader {
    /// Width of the source picture in pixels.
    pub width: u32,
    /// Height of the source picture in pixels.
    pub height: u32,
    /// Frames a second; 0/1 where the source had no fixed rate.
    pub frame_rate: Fraction,
    /// Width of a pixel over its height.
    pub pixel_aspect_ratio: Fraction,
    /// Binary digits of a position after the point.
    pub subpixel_bits: u8,
    /// The level of subdivision that colours and positions were fitted for, 0 to 2.
    pub subdivision_levels: u8,
}

/// Bytes that a coded header may have; bounds what the decoder of the header may allocate.
pub(super) const MAX_HEADER_BYTES: usize = 256;

/// Largest side of the box in lattice units: [`crate::mesh::volume6`] is exact below.
pub(super) const MAX_EXTENT: i32 = 1 << 19;

/// Largest number of binary digits after the point.
const MAX_SUBPIXEL_BITS: u8 = 6;

impl SequenceHeader {
    /// The header's bytes: bincode's standard configuration (little-endian, integers of variable length).
    #[cfg(feature = "encode")]
    pub fn to_bytes(self) -> Vec<u8> {
        bincode::encode_to_vec(self, config::standard()).expect("a header of integers is coded into memory")
    }

    /// Parses all of `bytes` and checks every field.
    ///
    /// # Errors
    /// More or fewer bytes than a header has, or a field out of its range.
    pub fn from_bytes(bytes: &[u8], limits: &Limits) -> Result<Self, ParseError> {
        let length = |expected| ParseError::Length { field: "sequence header", expected, found: bytes.len() };
        let config = config::standard().with_limit::<MAX_HEADER_BYTES>();
        let (header, used): (Self, usize) =
            bincode::decode_from_slice(bytes, config).map_err(|_| length(bytes.len() + 1))?;
        if used != bytes.len() {
            return Err(length(used));
        }
        header.check(limits)?;
        Ok(header)
    }

    /// Checks every field against the format's ranges and `limits`.
    ///
    /// # Errors
    /// [`ParseError::Field`] or [`ParseError::TooLarge`] for the first field that does not fit.
    pub fn check(&self, limits: &Limits) -> Result<(), ParseError> {
        for (field, side, limit) in
            [("width", self.width, limits.max_width), ("height", self.height, limits.max_height)]
        {
            check_field(field, u64::from(side), 1..=u64::MAX)?;
            if side > limit {
                return Err(ParseError::TooLarge { field, limit: limit.into(), found: side.into() });
            }
        }
        check_field("subpixel bits", self.subpixel_bits.into(), 0..=MAX_SUBPIXEL_BITS.into())?;
        let extent = u64::from(self.width.max(self.height)) << self.subpixel_bits;
        check_field("size in lattice units", extent, 1..=MAX_EXTENT as u64)?;
        check_field("subdivision levels", self.subdivision_levels.into(), 0..=2)?;
        check_field("frame rate denominator", self.frame_rate.denominator.into(), 1..=u64::MAX)?;
        check_field("pixel aspect ratio numerator", self.pixel_aspect_ratio.numerator.into(), 1..=u64::MAX)?;
        check_field("pixel aspect ratio denominator", self.pixel_aspect_ratio.denominator.into(), 1..=u64::MAX)
    }

    /// Longest slab, in frames, that keeps the box within the exact range of the predicates and within `limits`.
    pub(super) fn max_duration(&self, limits: &Limits) -> u32 {
        limits.max_duration.min((MAX_EXTENT >> self.subpixel_bits).unsigned_abs())
    }
}

/// A [`ParseError::Field`] unless `found` lies in `range`.
pub(super) fn check_field(
    field: &'static str,
    found: u64,
    range: std::ops::RangeInclusive<u64>,
) -> Result<(), ParseError> {
    if range.contains(&found) {
        return Ok(());
    }
    let expected = if *range.end() == u64::MAX {
        format!("at least {}", range.start())
    } else {
        format!("{} to {}", range.start(), range.end())
    };
    Err(ParseError::Field { field, expected, found: found.to_string() })
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;

    fn header() -> SequenceHeader {
        SequenceHeader {
            width: 640,
            height: 360,
            frame_rate: Fraction { numerator: 30_000, denominator: 1_001 },
            pixel_aspect_ratio: Fraction { numerator: 1, denominator: 1 },
            subpixel_bits: 3,
            subdivision_levels: 1,
        }
    }

    #[test]
    fn bytes_are_those_of_the_format() {
        let bytes = header().to_bytes();
        assert_eq!(bytes, [251, 0x80, 2, 251, 0x68, 1, 251, 0x30, 0x75, 251, 0xe9, 3, 1, 1, 3, 1]);
        assert_eq!(SequenceHeader::from_bytes(&bytes, &Limits::default()), Ok(header()));
    }

    #[test]
    fn every_truncation_and_extension_is_refused() {
        let mut bytes = header().to_bytes();
        for length in 0..bytes.len() {
            assert!(SequenceHeader::from_bytes(&bytes[..length], &Limits::default()).is_err());
        }
        bytes.push(0);
        assert!(matches!(
            SequenceHeader::from_bytes(&bytes, &Limits::default()),
            Err(ParseError::Length { field: "sequence header", .. })
        ));
    }

    #[test]
    fn fields_out_of_range_are_named() {
        let name = |change: fn(&mut SequenceHeader)| {
            let mut bad = header();
            change(&mut bad);
            match bad.check(&Limits::default()) {
                Err(ParseError::Field { field, .. } | ParseError::TooLarge { field, .. }) => field,
                other => panic!("expected a refusal, found {other:?}"),
            }
        };
        assert_eq!(name(|h| h.width = 0), "width");
        assert_eq!(name(|h| h.height = 20_000), "height");
        assert_eq!(name(|h| h.subpixel_bits = 7), "subpixel bits");
        assert_eq!(name(|h| (h.width, h.subpixel_bits) = (16_000, 6)), "size in lattice units");
        assert_eq!(name(|h| h.subdivision_levels = 3), "subdivision levels");
        assert_eq!(name(|h| h.frame_rate.denominator = 0), "frame rate denominator");
        assert_eq!(name(|h| h.pixel_aspect_ratio.numerator = 0), "pixel aspect ratio numerator");
    }
}
