//! Adaptive models: how probable decisions and symbols are.
//!
//! In: what was coded before in the same context. Out: probabilities. Forbidden here: bytes, and what is decided.

use wide::i16x8;

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
/// What averages keep their distance of from 0 and 1.
const LEAST: u32 = 1 << 8;
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

    /// P(1) in 1/65536, never 0 or 1.
    #[inline]
    pub(super) fn probability(self) -> u32 {
        self.0 >> (SEEN_BITS + AVERAGE_BITS - 16)
    }

    #[inline]
    pub(super) fn update(&mut self, bit: bool) {
        let (average, seen) = (self.0 >> SEEN_BITS, self.0 & SEEN_MAX);
        // Without a branch: which way it goes is as good as random.
        let end = i64::from(if bit { (1 << AVERAGE_BITS) - LEAST } else { LEAST });
        let step = ((end - i64::from(average)) * i64::from(RATES[seen as usize])) >> 16;
        let average = average.wrapping_add(step as u32);
        self.0 = average << SEEN_BITS | (seen + 1).min(SEEN_MAX);
    }
}

/// Symbols of a [`SymbolModel`].
pub(super) const SYMBOLS: usize = 16;

/// Binary digits of cumulative probabilities.
pub(super) const CUMULATIVE_BITS: u32 = 15;

/// Symbols after which a model no longer learns more slowly.
const SYMBOLS_SEEN_MAX: usize = 253;

/// What part of the way to the next symbol the probabilities after n symbols move, in 1/65536: 1 / (n + 3).
const SYMBOL_RATES: [i16; SYMBOLS_SEEN_MAX + 1] = {
    let mut rates = [0; SYMBOLS_SEEN_MAX + 1];
    let mut n = 0;
    while n < rates.len() {
        rates[n] = ((1 << 16) / (n + 3)) as i16;
        n += 1;
    }
    rates
};

/// The probabilities of sixteen symbols, learnt from the symbols coded before in the same context.
#[derive(Debug, Clone)]
pub(super) struct SymbolModel {
    /// Probabilities that a symbol is lower than each, in 2^-15. They rise by 1 at least from one to the next.
    below: [i16; SYMBOLS],
    seen: u16,
}

impl SymbolModel {
    /// A model that expects each symbol as often as these weights say, whose sum is 128.
    pub(super) const fn new(weights: [i16; SYMBOLS]) -> Self {
        let mut below = [0; SYMBOLS];
        let mut symbol = 1;
        while symbol < SYMBOLS {
            below[symbol] = below[symbol - 1] + (weights[symbol - 1] << (CUMULATIVE_BITS - 7));
            symbol += 1;
        }
        Self { below, seen: 0 }
    }

    /// The probabilities that a symbol is lower than this one, and that it is not higher.
    #[inline]
    pub(super) fn bounds(&self, symbol: usize) -> [u32; 2] {
        let high = self.below.get(symbol + 1).map_or(1 << CUMULATIVE_BITS, |&below| below as u32);
        [self.below[symbol] as u32, high]
    }

    /// The symbol at a cumulative probability.
    #[inline]
    pub(super) fn symbol_at(&self, place: i16) -> usize {
        // They rise, so those that are not above it come first.
        let below = self.below.iter().enumerate();
        let mask = below.fold(0u32, |mask, (symbol, &below)| mask | u32::from(below <= place) << symbol);
        mask.trailing_ones() as usize - 1
    }

    #[inline]
    pub(super) fn update(&mut self, symbol: usize) {
        let rate = i16x8::splat(SYMBOL_RATES[usize::from(self.seen)]);
        let symbol = i16x8::splat(symbol as i16);
        let mut first = i16x8::new([0, 1, 2, 3, 4, 5, 6, 7]);
        for eight in self.below.as_chunks_mut().0 {
            let below = i16x8::new(*eight);
            // All but the symbol keep a part of 2^-15.
            let end = first + (first.simd_gt(symbol) & i16x8::splat(i16::MAX - (SYMBOLS as i16 - 1)));
            // The high half of the product, rounded by the highest bit of the low one.
            let way = end - below;
            *eight = (below + way.mul_keep_high(rate) - ((way * rate) >> 15i32)).to_array();
            first += i16x8::splat(8);
        }
        self.seen = (self.seen + 1).min(SYMBOLS_SEEN_MAX as u16);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_symbols_leave_every_symbol_its_part() {
        for symbols in [[0, 0], [15, 15], [0, 15], [7, 8], [1, 14]] {
            let mut model = SymbolModel::new([113, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]);
            for i in 0..if cfg!(miri) { 300 } else { 3_000 } {
                model.update(symbols[i & 1]);
                let bounds: Vec<[u32; 2]> = (0..SYMBOLS).map(|symbol| model.bounds(symbol)).collect();
                assert!(bounds.iter().all(|[low, high]| low < high) && bounds[0][0] == 0 && bounds[15][1] == 1 << 15);
                let found = (0..SYMBOLS).map(|symbol| model.symbol_at(model.below[symbol]));
                assert!(found.eq(0..SYMBOLS));
                assert_eq!(model.symbol_at(i16::MAX), SYMBOLS - 1);
            }
        }
    }

    #[test]
    fn symbols_are_learnt_as_the_format_says() {
        let mut model = SymbolModel::new([8; SYMBOLS]);
        let mut below = model.below.map(i32::from);
        for i in 0..1_000u32 {
            let symbol = i.wrapping_mul(0x9e37_79b9) >> 28;
            model.update(symbol as usize);
            for (s, below) in (0..).zip(&mut below).skip(1) {
                let end = if s > symbol { 32_752 + s } else { s };
                *below += ((end as i32 - *below) * (65_536 / (i.min(253) as i32 + 3)) + 32_768) >> 16;
            }
            assert_eq!(model.below.map(i32::from), below);
        }
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
}
