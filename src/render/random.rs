//! Numbers that look random, for tests: the same ones in every run.

/// Numbers from 0 to below what is asked for, by a linear congruence (Knuth's MMIX).
pub(in crate::render) fn below<T: TryFrom<u64> + TryInto<u64>>(mut seed: u64) -> impl FnMut(T) -> T {
    move |end| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let (Ok(end), number) = (end.try_into(), seed >> 33) else { panic!("an end that is not negative") };
        T::try_from(number % end).unwrap_or_else(|_| unreachable!("it is below the end"))
    }
}
