//! Integers as decisions, symbols and raw bits.
//!
//! In: integers with the model of their context. Out: the same, coded. Forbidden here: what an integer means.

use super::models::{BitModel, SYMBOLS, SymbolModel};
use super::range_coder::BitCoder;

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

/// The symbol of numbers that have none of their own.
const ESCAPE: usize = SYMBOLS - 1;

/// Model of a small number >= 0: a symbol.
#[derive(Debug, Clone)]
pub(super) struct SmallModel(SymbolModel);

impl SmallModel {
    pub(super) const NEW: Self = Self(SymbolModel::new([24, 20, 16, 13, 11, 9, 7, 6, 5, 4, 3, 3, 2, 2, 1, 2]));

    /// Codes `value`, less than 2^31.
    #[inline]
    pub(super) fn code(&mut self, escape: &mut UintModel, coder: &mut impl BitCoder, value: u32) -> i64 {
        let symbol = coder.symbol(&mut self.0, (value as usize).min(ESCAPE));
        if symbol < ESCAPE {
            return symbol as i64;
        }
        i64::from(escape.code(coder, value.saturating_sub(ESCAPE as u32))) + ESCAPE as i64
    }
}

/// Model of a small number around 0: a symbol, the first one and the last one for those far below and far above.
#[derive(Debug, Clone)]
pub(super) struct SignedModel(SymbolModel);

impl SignedModel {
    /// The symbol of 0.
    const MIDDLE: usize = SYMBOLS / 2;

    pub(super) const NEW: Self = Self(SymbolModel::new([1, 1, 2, 3, 5, 9, 14, 19, 21, 18, 13, 9, 6, 3, 2, 2]));

    /// Codes `value`, its magnitude less than 2^31.
    #[inline]
    pub(super) fn code(&mut self, escape: &mut UintModel, coder: &mut impl BitCoder, value: i32) -> i64 {
        let place = (i64::from(value) + Self::MIDDLE as i64).clamp(0, ESCAPE as i64);
        let symbol = coder.symbol(&mut self.0, place as usize);
        let least = symbol as i64 - Self::MIDDLE as i64;
        let mut rest = || i64::from(escape.code(coder, (i64::from(value) - least).unsigned_abs() as u32));
        match symbol {
            0 => least - rest(),
            ESCAPE => least + rest(),
            _ => least,
        }
    }
}

/// Least magnitudes of the classes of a [`ResidualModel`], and binary digits of what is left.
const CLASSES: [(u32, u32); 7] = [(1, 0), (2, 0), (3, 0), (4, 1), (6, 2), (10, 3), (18, 4)];
/// Least magnitude that has no class.
const CLASSES_END: u32 = 34;

/// Model of a number around 0 of any size: a symbol for the class of its magnitude and its sign, the rest raw.
#[derive(Debug, Clone)]
pub(super) struct ResidualModel(SymbolModel);

impl ResidualModel {
    pub(super) const NEW: Self = Self(SymbolModel::new([18, 12, 12, 9, 9, 8, 8, 8, 8, 8, 8, 6, 6, 3, 3, 2]));

    /// Codes `value`, its magnitude less than 2^31.
    #[inline]
    pub(super) fn code(&mut self, escape: &mut UintModel, coder: &mut impl BitCoder, value: i32) -> i64 {
        let (magnitude, is_negative) = (value.unsigned_abs(), value < 0);
        let class = CLASSES.iter().filter(|(least, _)| *least <= magnitude).count();
        let symbol = match class {
            0 => 0,
            _ if magnitude >= CLASSES_END => ESCAPE,
            _ => 2 * class - usize::from(!is_negative),
        };
        let symbol = coder.symbol(&mut self.0, symbol);
        if symbol == 0 {
            return 0;
        }
        let Some(&(least, digits)) = CLASSES.get((symbol - 1) / 2) else {
            let is_negative = coder.raw(1, is_negative.into()) == 1;
            let found = i64::from(escape.code(coder, magnitude.saturating_sub(CLASSES_END))) + i64::from(CLASSES_END);
            return if is_negative { -found } else { found };
        };
        let found = i64::from(least + coder.raw(digits, magnitude.wrapping_sub(least)));
        if symbol % 2 == 0 { -found } else { found }
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::super::range_coder::{RangeDecoder, RangeEncoder};
    use super::*;

    /// All models, one after the other.
    struct Models(UintModel, SmallModel, SignedModel, ResidualModel);

    impl Models {
        const NEW: Self = Self(UintModel::NEW, SmallModel::NEW, SignedModel::NEW, ResidualModel::NEW);

        fn code(&mut self, coder: &mut impl BitCoder, value: i32) -> [i64; 4] {
            let Self(uint, small, signed, residual) = self;
            [
                uint.code(coder, value.unsigned_abs()).into(),
                small.code(uint, coder, value.unsigned_abs()),
                signed.code(uint, coder, value),
                residual.code(uint, coder, value),
            ]
        }
    }

    #[test]
    fn integers_come_back() {
        let values: Vec<i32> = (0..31).flat_map(|e| [(1 << e) - 1, 1 << e, (1 << e) + 1]).collect();
        let values: Vec<i32> = (-40..40).chain(values).filter(|&v| v < i32::MAX - 1).flat_map(|v| [v, -v]).collect();
        let mut encoder = RangeEncoder::new();
        let mut models = Models::NEW;
        for &v in &values {
            models.code(&mut encoder, v);
        }
        let [bytes, raw] = encoder.finish();
        let mut decoder = RangeDecoder::new([&bytes, &raw]);
        let mut models = Models::NEW;
        for &v in &values {
            let magnitude = i64::from(v.unsigned_abs());
            assert_eq!(models.code(&mut decoder, 0), [magnitude, magnitude, v.into(), v.into()]);
        }
        assert!(!decoder.is_exhausted());
    }

    #[test]
    fn any_bytes_give_numbers_in_range() {
        // Miri is a thousand times slower.
        for byte in (0..=255u8).step_by(if cfg!(miri) { 85 } else { 1 }) {
            let bytes = [byte; if cfg!(miri) { 60 } else { 600 }];
            let mut decoder = RangeDecoder::new([&bytes, &bytes]);
            let mut models = Models::NEW;
            while !decoder.is_exhausted() {
                assert!(models.code(&mut decoder, 0).into_iter().all(|found| found.abs() < 1 << 32));
            }
        }
    }
}
