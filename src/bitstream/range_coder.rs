//! Adaptive binary range coding: the one place where decisions become bytes.
//!
//! In: decisions, each with the model of its context. Out: bytes, and back. Forbidden here: what a decision means.
//!
//! The interval arithmetic is Martin's range coder in the carry-propagating form that LZMA made common (32-bit range,
//! renormalised bytewise above 2^24). A library's multi-symbol coder was weighed against it: here every decision is
//! binary and adapts at once, which needs no division and no cumulative table, and a packet of few bytes pays for one
//! or two bytes of flushing instead of a 32-bit word or two.

use super::bits::Part;

/// The probability that a decision is 1, learnt from the decisions coded before in the same context.
///
/// The mean of the decisions so far, then an exponential average of the last ones.
///
/// Both in one word, as models are what the caches of a coder are full of: P(1) in 2^-22 above, and below, in
/// [`SEEN_BITS`], the number of decisions so far, at most [`SEEN_MAX`].
#[derive(Debug, Clone, Copy)]
pub(super) struct BitModel(u32);

/// Binary digits of an average.
const AVERAGE_BITS: u32 = 22;
/// Decisions after which a model no longer learns more slowly.
const SEEN_MAX: u32 = (1 << SEEN_BITS) - 1;
const SEEN_BITS: u32 = 8;

/// What part of the way to the next decision the average of n decisions moves, in 1/65536: 1 / (n + 1.5).
const RATES: [u32; SEEN_MAX as usize + 1] = {
    let mut rates = [0; SEEN_MAX as usize + 1];
    let mut n = 0;
    while n < rates.len() {
        rates[n] = (2 << 16) / (2 * n as u32 + 3);
        n += 1;
    }
    rates
};

impl BitModel {
    /// A model that expects nothing.
    pub(super) const NEW: Self = Self(1 << (AVERAGE_BITS - 1 + SEEN_BITS));

    /// P(1) in 1/65536. It never comes to 0 or 1: averages no longer move when a step would be less than their last digit.
    #[inline]
    fn probability(self) -> u32 {
        self.0 >> (SEEN_BITS + AVERAGE_BITS - 16)
    }

    #[inline]
    fn update(&mut self, bit: bool) {
        let (average, seen) = (self.0 >> SEEN_BITS, self.0 & SEEN_MAX);
        let rate = u64::from(RATES[seen as usize]);
        let part = |distance: u32| ((u64::from(distance) * rate) >> 16) as u32;
        let average = if bit { average + part((1 << AVERAGE_BITS) - average) } else { average - part(average) };
        self.0 = average << SEEN_BITS | (seen + 1).min(SEEN_MAX);
    }
}

/// The range stays at or above this between decisions.
#[cfg(feature = "encode")]
const RANGE_MIN: u32 = 1 << 24;

/// One side of the coding. Models and syntax are written once against it: the writer codes the decisions it is given
/// and returns them, the parser ignores what it is given and returns what it reads.
pub(super) trait BitCoder {
    /// Codes one decision in the context of `model`, and updates it.
    fn bit(&mut self, model: &mut BitModel, bit: bool) -> bool;

    /// Codes the low `count` (at most 32) bits of `value`, each as likely 0 as 1, the highest first.
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
}

#[cfg(feature = "encode")]
impl RangeEncoder {
    pub(super) fn new() -> Self {
        Self { low: 0, range: u32::MAX, waiting: None, waiting_ff: 0, bytes: Vec::new() }
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

    /// The bytes of all decisions: of the final interval the number with the most zeros at its end, those left out.
    pub(super) fn finish(mut self) -> Vec<u8> {
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
        self.bytes
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

    fn raw(&mut self, count: u32, value: u32) -> u32 {
        if count > RAW_BITS {
            let high = self.raw(count - RAW_BITS, value >> RAW_BITS);
            return high << RAW_BITS | self.raw(RAW_BITS, value & ((1 << RAW_BITS) - 1));
        }
        self.range >>= count;
        self.low += u64::from(self.range) * u64::from(value);
        self.normalize();
        value
    }
}

/// Reads decisions back. Reading past the end gives zeros; [`Self::is_exhausted`] tells.
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
}

/// Raw bits that are coded at once.
const RAW_BITS: u32 = 16;

/// Bits that one decision can take up: a probability of 1/16384 leaves 2^10 of a range of 2^24, raw bits 2^8.
const SPARE: u32 = 16;

impl<'a> RangeDecoder<'a> {
    /// Zeros that may be read past the end, since the encoder leaves zeros at the end out.
    pub(super) const FREE_BYTES: u32 = 4;

    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let mut decoder = Self { bytes, next: 0, window: 0, spare: 0, range: u32::MAX };
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
        self.used() > self.bytes.len() + Self::FREE_BYTES as usize
    }

    /// Information of the decisions read so far, in bits.
    pub(super) fn position(&self) -> f64 {
        8.0 * self.used() as f64 - f64::from(self.range).log2()
    }

    /// Bytes at the end that were not read.
    pub(super) fn unread(&self) -> usize {
        self.bytes.len().saturating_sub(self.used())
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

    fn raw(&mut self, count: u32, _: u32) -> u32 {
        if count > RAW_BITS {
            let high = self.raw(count - RAW_BITS, 0);
            return high << RAW_BITS | self.raw(RAW_BITS, 0);
        }
        self.range >>= count;
        let value = ((self.window >> 32) as u32 / self.range).min((1 << count) - 1);
        self.window -= u64::from(self.range * value) << 32;
        self.normalize();
        value
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests {
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

    #[test]
    fn decisions_come_back_and_cost_about_their_entropy() {
        // Miri is a thousand times slower.
        for seed in 0..if cfg!(miri) { 8 } else { 200 } {
            let decisions = decisions(seed, seed as usize * 37);
            let mut encoder = RangeEncoder::new();
            let mut models = [BitModel::NEW; 4];
            for &(context, bit) in &decisions {
                encoder.bit(&mut models[context], bit);
                encoder.raw(3, context as u32);
            }
            let bytes = encoder.finish();
            let mut decoder = RangeDecoder::new(&bytes);
            let mut models = [BitModel::NEW; 4];
            for &(context, bit) in &decisions {
                assert_eq!(decoder.bit(&mut models[context], false), bit);
                assert_eq!(decoder.raw(3, 0), context as u32);
            }
            assert!(!decoder.is_exhausted());
            assert_eq!(decoder.unread(), 0);
        }
    }

    #[test]
    fn certain_decisions_cost_next_to_nothing() {
        let mut encoder = RangeEncoder::new();
        let mut model = BitModel::NEW;
        for _ in 0..10_000 {
            encoder.bit(&mut model, true);
        }
        assert!(encoder.finish().len() < 8);
        let mut encoder = RangeEncoder::new();
        encoder.bit(&mut BitModel { ..BitModel::NEW }, false);
        assert!(encoder.finish().len() <= 1);
    }

    #[test]
    fn probabilities_stay_inside() {
        for bit in [false, true] {
            let mut model = BitModel::NEW;
            for _ in 0..if cfg!(miri) { 1_000 } else { 100_000 } {
                model.update(bit);
                assert!((4..=65_532).contains(&model.probability()));
            }
        }
    }

    #[test]
    fn reading_past_the_end_is_noticed() {
        let mut decoder = RangeDecoder::new(&[]);
        assert!(!decoder.is_exhausted());
        decoder.raw(32, 0);
        assert!(decoder.is_exhausted());
    }
}
