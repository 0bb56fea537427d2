//! Integers as adaptive binary decisions.
//!
//! In: integers with the model of their context. Out: the same, coded. Forbidden here: what an integer means.

use super::range_coder::{BitCoder, BitModel};

/// Exponents that are coded with a model each; larger ones share the last.
const EXPONENTS: usize = 20;
/// Largest exponent, so that values stay below 2^31.
const EXPONENT_MAX: usize = 30;
/// Mantissa bits coded with models; the rest are raw.
const MODELLED_BITS: usize = 2;

/// Model of a number >= 0 whose distribution falls: Elias gamma, an adaptive unary exponent, then the mantissa, its
/// two highest bits adaptive.
#[derive(Debug, Clone)]
pub(super) struct UintModel {
    more: [BitModel; EXPONENTS],
    mantissa: [[BitModel; 1 << MODELLED_BITS]; EXPONENTS],
}

impl UintModel {
    pub(super) const NEW: Self =
        Self { more: [BitModel::NEW; EXPONENTS], mantissa: [[BitModel::NEW; 1 << MODELLED_BITS]; EXPONENTS] };

    /// Codes `value`, less than 2^31 - 1; what is read is, too.
    pub(super) fn code(&mut self, coder: &mut impl BitCoder, value: u32) -> u32 {
        let wanted = (value + 1).ilog2() as usize;
        let mut exponent = 0;
        while exponent < EXPONENT_MAX && coder.bit(&mut self.more[exponent.min(EXPONENTS - 1)], exponent < wanted) {
            exponent += 1;
        }
        let models = &mut self.mantissa[exponent.min(EXPONENTS - 1)];
        let modelled = exponent.min(MODELLED_BITS);
        let mut number = 1u32;
        for place in 0..modelled {
            let bit = coder.bit(&mut models[number as usize], (value + 1) >> (exponent - 1 - place) & 1 == 1);
            number = number << 1 | u32::from(bit);
        }
        let rest = (exponent - modelled) as u32;
        let low = coder.raw(rest, (value + 1) & ((1 << rest) - 1));
        (number << rest | low) - 1
    }
}

/// Model of a number around 0: zero or not, sign, magnitude.
#[derive(Debug, Clone)]
pub(super) struct IntModel {
    zero: BitModel,
    negative: BitModel,
    magnitude: UintModel,
}

impl IntModel {
    pub(super) const NEW: Self = Self { zero: BitModel::NEW, negative: BitModel::NEW, magnitude: UintModel::NEW };

    /// Codes `value`, its magnitude less than 2^31 - 1.
    pub(super) fn code(&mut self, coder: &mut impl BitCoder, value: i32) -> i32 {
        if coder.bit(&mut self.zero, value == 0) {
            return 0;
        }
        let negative = coder.bit(&mut self.negative, value < 0);
        let magnitude = self.magnitude.code(coder, value.unsigned_abs().saturating_sub(1)) as i32 + 1;
        if negative { -magnitude } else { magnitude }
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::super::range_coder::{RangeDecoder, RangeEncoder};
    use super::*;

    #[test]
    fn integers_come_back() {
        let values: Vec<i32> =
            (0..31).flat_map(|e| [(1 << e) - 1, 1 << e, (1 << e) + 1]).filter(|&v: &i32| v < i32::MAX - 1).collect();
        let mut encoder = RangeEncoder::new();
        let (mut uint, mut int) = (UintModel::NEW, IntModel::NEW);
        for &v in &values {
            uint.code(&mut encoder, v as u32);
            int.code(&mut encoder, -v);
            int.code(&mut encoder, v);
        }
        let bytes = encoder.finish();
        let mut decoder = RangeDecoder::new(&bytes);
        let (mut uint, mut int) = (UintModel::NEW, IntModel::NEW);
        for &v in &values {
            assert_eq!(uint.code(&mut decoder, 0), v as u32);
            assert_eq!(int.code(&mut decoder, 0), -v);
            assert_eq!(int.code(&mut decoder, 0), v);
        }
        assert!(!decoder.is_exhausted());
    }

    #[test]
    fn any_bytes_give_numbers_in_range() {
        // Miri is a thousand times slower.
        for byte in (0..=255u8).step_by(if cfg!(miri) { 85 } else { 1 }) {
            let bytes = [byte; if cfg!(miri) { 60 } else { 600 }];
            let mut decoder = RangeDecoder::new(&bytes);
            let (mut uint, mut int) = (UintModel::NEW, IntModel::NEW);
            while !decoder.is_exhausted() {
                assert!(uint.code(&mut decoder, 0) < u32::MAX >> 1);
                assert!(int.code(&mut decoder, 0).unsigned_abs() < u32::MAX >> 1);
            }
        }
    }
}
