//! Computes square roots of 64 bits with 32-bit instructions: exact, and several times as fast on a
//! Cortex-M as the compiler's library.
//!
//! Heron's rule, starting from a root of eight bits: an error e becomes e²/2√n. In units of the
//! last place, an error of at most 1 in 8 bits becomes at most 1 in 16, and that one at most 1 in
//! 32. Each quotient that is rounded down subtracts up to 1.

/// √(256·m + 128) for m of 64 to 255, rounded to nearest: within 1 of the roots of 256·m to 256·m +
/// 255.
const EIGHT_BITS: [u8; 192] = {
    let mut roots = [0; 192];
    let mut at = 0;
    while at < roots.len() {
        let square = (at as u32 + 64) * 256 + 128;
        let root = square.isqrt();
        let rounded = root + (square > root * root + root) as u32;
        roots[at] = if rounded > 255 { 255 } else { rounded as u8 };
        at += 1;
    }
    roots
};

/// ⌊√`square`⌋.
#[inline(never)]
pub fn root(square: u64) -> u32 {
    if square == 0 {
        return 0;
    }
    // An even shift makes it at least 2⁶².
    let shift = square.leading_zeros() & !1;
    let scaled = square << shift;
    let high = (scaled >> 32) as u32;
    let sixteen = sixteen_bits(high);
    // 2¹⁵·sixteen + (scaled >> 17)/sixteen, divided by half words: the dividend has 47 bits.
    let (upper, lower) = (high >> 1, (scaled >> 17) as u32 & 0xffff);
    let first = upper / sixteen;
    let second = (upper - first * sixteen) << 16 | lower;
    let estimate = (sixteen << 15).wrapping_add((first << 16) + second / sixteen);
    corrected(estimate, scaled) >> (shift / 2)
}

/// √`high` for `high` ≥ 2³⁰, with an error of at most 1: 2¹⁵ to 2¹⁶.
#[inline(always)]
fn sixteen_bits(high: u32) -> u32 {
    // The index is 0 to 191. Every root has its highest bit set, so it is not 0.
    let index = ((high >> 24) as usize).wrapping_sub(64);
    let eight = u32::from(EIGHT_BITS.get(index).copied().unwrap_or_default()) | 0x80;
    (eight << 7) + (high >> 9) / eight
}

/// The root of a square ≥ 2⁶², from an estimate with an error of at most 1. The smallest root is
/// 2³¹; an estimate beyond 2³² − 1 has wrapped and is corrected.
fn corrected(estimate: u32, square: u64) -> u32 {
    let estimate = if estimate < 1 << 30 {
        u32::MAX
    } else {
        estimate
    };
    let below = u64::from(estimate) * u64::from(estimate);
    if below > square {
        return estimate - 1;
    }
    // (e + 1)² ≤ n ⇔ n − e² > 2e.
    let too_small = square - below > 2 * u64::from(estimate);
    estimate + u32::from(too_small)
}

/// √`square`, rounded to nearest.
pub fn rounded_root(square: u64) -> u64 {
    let root = u64::from(root(square));
    // n > (root + ½)² ⇔ n > root² + root.
    root + u64::from(square - root * root > root)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(square: u64) {
        assert_eq!(u64::from(root(square)), square.isqrt(), "{square}");
    }

    #[test]
    fn small_numbers_and_the_largest() {
        (0..1 << 20).for_each(check);
        (0..1 << 12).for_each(|below| check(u64::MAX - below));
    }

    /// Neighbours of squares of roots over the whole range, and of the table's steps.
    #[test]
    fn next_to_squares() {
        let spread = (0..2_000_000u64).map(|at| at.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32);
        for root in spread.chain((1..=256).map(|at| (at << 24) - 1)) {
            let square = root * root;
            [
                square.wrapping_sub(1),
                square,
                square + 1,
                square + root,
                square + 2 * root,
            ]
            .into_iter()
            .for_each(check);
        }
        for step in 64..=255u64 {
            for square in [step << 56, (step << 56) - 1, (step << 56 | 0xff << 48) + 1] {
                check(square);
                check(square >> 2);
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100_000))]

        #[test]
        fn it_is_the_root(number: u64, shift in 0..64u32) {
            let square = number >> shift;
            prop_assert_eq!(u64::from(root(square)), square.isqrt());
            let (rounded, square) = (u128::from(rounded_root(square)), u128::from(square));
            // (2r − 1)² ≤ 4n ≤ (2r + 1)²
            prop_assert!(rounded == 0 || (2 * rounded - 1).pow(2) <= 4 * square);
            prop_assert!(4 * square <= (2 * rounded + 1).pow(2));
        }
    }
}
