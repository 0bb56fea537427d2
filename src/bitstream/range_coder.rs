//! Adaptive range coding: the one place where decisions and symbols become bytes.
//!
//! In: decisions and symbols, each with the model of its context; raw bits. Out: bytes, and back. Forbidden here: what they
//! mean.
//!
//! The interval arithmetic is Martin's range coder in the carry-propagating form that LZMA made common (32-bit range,
//! renormalised bytewise above 2^24). Raw bits are as likely 0 as 1, so no interval is narrowed for them: they follow the
//! coded bytes as they are.

use super::bits::Part;
use super::models::{BitModel, CUMULATIVE_BITS, SymbolModel};

/// The range stays at or above this between decisions.
#[cfg(feature = "encode")]
const RANGE_MIN: u32 = 1 << 24;

/// One side of the coding. Models and syntax are written once against it: the writer codes the decisions it is given
/// and returns them, the parser ignores what it is given and returns what it reads.
pub(super) trait BitCoder {
    /// Codes one decision in the context of `model`, and updates it.
    fn bit(&mut self, model: &mut BitModel, bit: bool) -> bool;

    /// Codes one symbol, less than [`SYMBOLS`], in the context of `model`, and updates it.
    fn symbol(&mut self, model: &mut SymbolModel, symbol: usize) -> usize;

    /// Codes the low `count` (at most 32) bits of `value`, each as likely 0 as 1.
    fn raw(&mut self, count: u32, value: u32) -> u32;

    /// What is coded from here on belongs to this part of the mesh.
    fn enter(&mut self, _: Part) {}
}

/// Codes decisions to bytes.
#[cfg(feature = "encode")]
#[derive(Debug)]
pub(super) struct RangeEncoder {
    /// Low end of the interval; bit 32 is a carry into the bytes that wait.
    low: u64,
    range: u32,
    /// The last byte below which a carry can still reach, then this many bytes 0xff.
    waiting: Option<u8>,
    waiting_ff: usize,
    bytes: Vec<u8>,
    raw: RawWriter,
}

/// Raw bits on their way to bytes, from the lowest bit of each byte on.
#[cfg(feature = "encode")]
#[derive(Debug, Default)]
struct RawWriter {
    bytes: Vec<u8>,
    /// Bits that make no whole byte yet, and how many.
    waiting: u64,
    count: u32,
}

#[cfg(feature = "encode")]
impl RawWriter {
    fn push(&mut self, count: u32, value: u32) {
        self.waiting |= (u64::from(value) & ((1 << count) - 1)) << self.count;
        self.count += count;
        while self.count >= u8::BITS {
            self.bytes.push(self.waiting as u8);
            self.waiting >>= u8::BITS;
            self.count -= u8::BITS;
        }
    }

    fn finish(mut self) -> Vec<u8> {
        if self.count > 0 {
            self.bytes.push(self.waiting as u8);
        }
        self.bytes
    }
}

#[cfg(feature = "encode")]
impl RangeEncoder {
    pub(super) fn new() -> Self {
        Self { low: 0, range: u32::MAX, waiting: None, waiting_ff: 0, bytes: Vec::new(), raw: RawWriter::default() }
    }

    /// Moves the top byte of `low` out, behind the bytes that a carry can still change.
    fn shift_low(&mut self) {
        let top = (self.low >> 24) as u32;
        if top == 0xff {
            self.waiting_ff += 1;
        } else {
            let carry = (top >> 8) as u8;
            // The interval starts within [0, 1), so there is never a carry before the first byte.
            self.bytes.extend(self.waiting.map(|byte| byte.wrapping_add(carry)));
            self.bytes.extend(std::iter::repeat_n(0xffu8.wrapping_add(carry), self.waiting_ff));
            self.waiting = Some(top as u8);
            self.waiting_ff = 0;
        }
        self.low = (self.low & 0x00ff_ffff) << 8;
    }

    fn normalize(&mut self) {
        while self.range < RANGE_MIN {
            self.range <<= 8;
            self.shift_low();
        }
    }

    /// The bytes of all decisions and symbols, and those of the raw bits. Of the final interval the first ones are the number
    /// with the most zeros at its end, those left out.
    pub(super) fn finish(mut self) -> [Vec<u8>; 2] {
        let high = self.low + u64::from(self.range) - 1;
        for mask in [0xff_ffff, 0xffff, 0xff, 0] {
            let rounded = (self.low + mask) & !mask;
            if rounded <= high {
                self.low = rounded;
                break;
            }
        }
        for _ in 0..5 {
            self.shift_low();
        }
        let kept = self.bytes.len().saturating_sub(RangeDecoder::FREE_BYTES as usize);
        while self.bytes.len() > kept && self.bytes.last() == Some(&0) {
            self.bytes.pop();
        }
        [self.bytes, self.raw.finish()]
    }
}

#[cfg(feature = "encode")]
impl BitCoder for RangeEncoder {
    #[inline]
    fn bit(&mut self, model: &mut BitModel, bit: bool) -> bool {
        let bound = ((u64::from(self.range) * u64::from(model.probability())) >> 16) as u32;
        if bit {
            self.range = bound;
        } else {
            self.low += u64::from(bound);
            self.range -= bound;
        }
        model.update(bit);
        self.normalize();
        bit
    }

    fn symbol(&mut self, model: &mut SymbolModel, symbol: usize) -> usize {
        let [low, high] = model.bounds(symbol);
        self.range >>= CUMULATIVE_BITS;
        self.low += u64::from(self.range) * u64::from(low);
        self.range *= high - low;
        model.update(symbol);
        self.normalize();
        symbol
    }

    fn raw(&mut self, count: u32, value: u32) -> u32 {
        self.raw.push(count, value);
        value
    }
}

/// Reads decisions, symbols and raw bits back. Reading past the end gives zeros; [`Self::is_exhausted`] tells.
#[derive(Debug)]
pub(super) struct RangeDecoder<'a> {
    bytes: &'a [u8],
    /// Bytes taken into the window.
    next: usize,
    /// The code above 32 bits, and below it, from the highest bit down, those that follow.
    window: u64,
    /// How many follow: whole bytes, at least [`SPARE`] bits of them between decisions.
    spare: u32,
    range: u32,
    raw: RawReader<'a>,
}

/// Bits that one decision can take up: a probability of 1/16384 leaves 2^10 of a range of 2^24, a symbol's 2^9.
const SPARE: u32 = 16;

/// Reads raw bits back.
#[derive(Debug)]
struct RawReader<'a> {
    bytes: &'a [u8],
    /// Bytes taken into the window.
    next: usize,
    /// The next bits from the lowest one on, and how many.
    window: u64,
    count: u32,
}

impl RawReader<'_> {
    #[inline]
    fn read(&mut self, count: u32) -> u32 {
        if self.count < u32::BITS {
            let four = self.bytes.get(self.next..).and_then(<[u8]>::first_chunk);
            let four = four.map_or_else(|| self.last_bytes(), |four| u32::from_le_bytes(*four));
            self.window |= u64::from(four) << self.count;
            self.next = self.next.saturating_add(4);
            self.count += u32::BITS;
        }
        let value = self.window & ((1 << count) - 1);
        self.window >>= count;
        self.count -= count;
        value as u32
    }

    #[cold]
    fn last_bytes(&self) -> u32 {
        let last = self.bytes.get(self.next..).unwrap_or_default();
        last.iter().rev().fold(0, |bits, &byte| bits << u8::BITS | u32::from(byte))
    }

    /// Bits read.
    #[inline]
    fn position(&self) -> usize {
        8 * self.next - self.count as usize
    }
}

impl<'a> RangeDecoder<'a> {
    /// Zeros that may be read past the end, since the encoder leaves zeros at the end out.
    pub(super) const FREE_BYTES: u32 = 4;

    /// A decoder of the bytes of decisions and symbols, and of those of raw bits.
    pub(super) fn new([bytes, raw]: [&'a [u8]; 2]) -> Self {
        let raw = RawReader { bytes: raw, next: 0, window: 0, count: 0 };
        let mut decoder = Self { bytes, next: 0, window: 0, spare: 0, range: u32::MAX, raw };
        for _ in 0..3 {
            decoder.window <<= SPARE;
            decoder.window |= u64::from(decoder.two_bytes());
        }
        decoder.window <<= SPARE;
        decoder.spare = SPARE;
        decoder
    }

    #[inline]
    fn two_bytes(&mut self) -> u16 {
        let two = self.bytes.get(self.next..).and_then(<[u8]>::first_chunk);
        let two = two.map_or_else(|| self.last_bytes(), |two| u16::from_be_bytes(*two));
        self.next = self.next.saturating_add(2);
        two
    }

    #[cold]
    fn last_bytes(&self) -> u16 {
        u16::from(self.bytes.get(self.next).copied().unwrap_or(0)) << 8
    }

    #[inline]
    fn normalize(&mut self) {
        // Whole bytes, without a branch: whether one is due is as good as random.
        let shift = self.range.leading_zeros() & !7;
        self.range <<= shift;
        self.window <<= shift;
        self.spare -= shift;
        if self.spare < SPARE {
            let two = self.two_bytes();
            self.window |= u64::from(two) << (32 - SPARE - self.spare);
            self.spare += SPARE;
        }
    }

    /// Bytes that decisions have come to, those of the code with them.
    fn used(&self) -> usize {
        self.next - self.spare as usize / 8
    }

    /// Whether more has been read than any encoder wrote.
    #[inline]
    pub(super) fn is_exhausted(&self) -> bool {
        self.used() > self.bytes.len() + Self::FREE_BYTES as usize || self.raw.position() > 8 * self.raw.bytes.len()
    }

    /// Information of the decisions read so far, in bits.
    pub(super) fn position(&self) -> f64 {
        8.0 * self.used() as f64 - f64::from(self.range).log2() + self.raw.position() as f64
    }

    /// Bytes that were not read.
    pub(super) fn unread(&self) -> usize {
        let raw = self.raw.bytes.len().saturating_sub(self.raw.position().div_ceil(8));
        self.bytes.len().saturating_sub(self.used()) + raw
    }
}

impl BitCoder for RangeDecoder<'_> {
    #[inline]
    fn bit(&mut self, model: &mut BitModel, _: bool) -> bool {
        let bound = ((u64::from(self.range) * u64::from(model.probability())) >> 16) as u32;
        let code = (self.window >> 32) as u32;
        let bit = code < bound;
        if bit {
            self.range = bound;
        } else {
            self.window -= u64::from(bound) << 32;
            self.range -= bound;
        }
        model.update(bit);
        self.normalize();
        bit
    }

    #[inline]
    fn symbol(&mut self, model: &mut SymbolModel, _: usize) -> usize {
        self.range >>= CUMULATIVE_BITS;
        let place = ((self.window >> 32) as u32 / self.range).min((1 << CUMULATIVE_BITS) - 1);
        let symbol = model.symbol_at(place as i16);
        let [low, high] = model.bounds(symbol);
        self.window -= u64::from(self.range * low) << 32;
        self.range *= high - low;
        model.update(symbol);
        self.normalize();
        symbol
    }

    #[inline]
    fn raw(&mut self, count: u32, _: u32) -> u32 {
        self.raw.read(count)
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::super::models::SYMBOLS;
    use super::*;

    /// A sequence of (context, bit) with runs that force long carries.
    fn decisions(seed: u32, count: usize) -> Vec<(usize, bool)> {
        let mut state = seed;
        (0..count)
            .map(|i| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let context = (state >> 30) as usize;
                (context, (state >> 8 & 0xfff) < [4, 40, 2048, 4090][context] || i % 1000 < 100)
            })
            .collect()
    }

    const EVEN: SymbolModel = SymbolModel::new([8; SYMBOLS]);

    #[test]
    fn what_is_written_comes_back() {
        // Miri is a thousand times slower.
        for seed in 0..if cfg!(miri) { 8 } else { 200 } {
            let decisions = decisions(seed, seed as usize * 37);
            let mut encoder = RangeEncoder::new();
            let (mut models, mut symbols) = ([BitModel::NEW; 4], EVEN);
            for &(context, bit) in &decisions {
                encoder.bit(&mut models[context], bit);
                encoder.raw(3 + 7 * context as u32, context as u32);
                encoder.symbol(&mut symbols, 5 * context);
            }
            let [bytes, raw] = encoder.finish();
            let mut decoder = RangeDecoder::new([&bytes, &raw]);
            let (mut models, mut symbols) = ([BitModel::NEW; 4], EVEN);
            for &(context, bit) in &decisions {
                assert_eq!(decoder.bit(&mut models[context], false), bit);
                assert_eq!(decoder.raw(3 + 7 * context as u32, 0), context as u32);
                assert_eq!(decoder.symbol(&mut symbols, 0), 5 * context);
            }
            assert!(!decoder.is_exhausted());
            assert_eq!(decoder.unread(), 0);
        }
    }

    #[test]
    fn symbols_cost_about_their_entropy() {
        let mut encoder = RangeEncoder::new();
        let mut model = EVEN;
        for i in 0..10_000usize {
            encoder.symbol(&mut model, i.wrapping_mul(0x9e37_79b9) >> 7 & 3);
        }
        let [bytes, _] = encoder.finish();
        assert!((2_400..2_600).contains(&bytes.len()));
    }

    #[test]
    fn certain_decisions_cost_next_to_nothing() {
        let mut encoder = RangeEncoder::new();
        let mut model = BitModel::NEW;
        for _ in 0..10_000 {
            encoder.bit(&mut model, true);
        }
        assert!(encoder.finish()[0].len() < 8);
        let mut encoder = RangeEncoder::new();
        encoder.bit(&mut { BitModel::NEW }, false);
        assert!(encoder.finish()[0].len() <= 1);
    }

    #[test]
    fn reading_past_the_end_is_noticed() {
        let mut decoder = RangeDecoder::new([&[], &[]]);
        assert!(!decoder.is_exhausted());
        decoder.raw(1, 0);
        assert!(decoder.is_exhausted());
        let mut decoder = RangeDecoder::new([&[], &[]]);
        for _ in 0..9 {
            decoder.symbol(&mut SymbolModel::new([8; SYMBOLS]), 0);
        }
        assert!(decoder.is_exhausted());
    }
}
