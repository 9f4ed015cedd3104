//! Defines the network's one rounding: `rescale(a, m, s) = (a·m + 2^(s−1)) >> s`, exact, halves up.
//!
//! A Cortex-M computes the high word of a product in one instruction. With s ≥ 33 only that word
//! counts: the rounding is a multiple of 2³², so the low word stays unchanged and is shifted out.
//! The rest, (high + 2^(s−33)) >> (s − 32), equals ((high >> (s − 33)) + 1) >> 1, which cannot
//! overflow.

/// Largest difference of features that is rescaled; larger ones are limited to it.
const LARGEST_DIFFERENCE: i64 = (1 << 38) - 1;
/// Bits between an input's multiplier, below 2²⁴, and 2³¹.
const SPARE_BITS: u32 = 7;

/// sat16(rescale(value, m, s)) with m < 2²⁴ and s of 1 to 62. The value is first limited to ±(2³⁸ −
/// 1).
pub fn rescale_input(value: i64, multiplier: u32, shift: u8) -> i16 {
    match i32::try_from(value) {
        Ok(value) => rescale_small_input(value, multiplier, shift),
        Err(_) => rescale_large_input(value, multiplier, shift),
    }
}

/// [`rescale_input`] for 32 bits, which hold every difference of coordinates in a frame.
#[inline(always)]
pub fn rescale_small_input(value: i32, multiplier: u32, shift: u8) -> i16 {
    // Equal to the definition with m and 2^s both multiplied by 2^`SPARE_BITS`.
    let beyond = u32::from(shift).wrapping_sub(33 - SPARE_BITS);
    if beyond < 31 {
        let rounded = of_high_word(value, multiplier << SPARE_BITS, beyond);
        rounded.clamp(i16::MIN.into(), i16::MAX.into()) as i16
    } else {
        rescale_large_input(value.into(), multiplier, shift)
    }
}

/// sat32(rescale(sum, m, s)) with m < 2³¹ and s of 1 to 62.
#[inline(always)]
pub fn rescale_sum(sum: i32, multiplier: u32, shift: u8) -> i32 {
    let beyond = u32::from(shift).wrapping_sub(33);
    if beyond < 31 {
        of_high_word(sum, multiplier, beyond)
    } else {
        rescale_large_sum(sum, multiplier, shift)
    }
}

/// rescale(value, m, beyond + 33) with m < 2³¹ and `beyond` of 0 to 30. The result is within ±2³⁰.
#[inline(always)]
fn of_high_word(value: i32, multiplier: u32, beyond: u32) -> i32 {
    let high = (i64::from(value) * i64::from(multiplier as i32)) >> 32;
    ((high as i32 >> beyond) + 1) >> 1
}

#[cold]
#[inline(never)]
fn rescale_large_input(value: i64, multiplier: u32, shift: u8) -> i16 {
    let limited = value.clamp(-LARGEST_DIFFERENCE, LARGEST_DIFFERENCE);
    rescale(limited, multiplier, shift).clamp(i16::MIN.into(), i16::MAX.into()) as i16
}

#[cold]
#[inline(never)]
fn rescale_large_sum(sum: i32, multiplier: u32, shift: u8) -> i32 {
    rescale(sum.into(), multiplier, shift).clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

/// value · multiplier / 2^shift, rounded once, half up. `shift` is 1 to 62 and the product within
/// ±2⁶².
fn rescale(value: i64, multiplier: u32, shift: u8) -> i64 {
    (value * i64::from(multiplier) + (1 << (shift - 1))) >> shift
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn rescaling_rounds_once_half_up() {
        for (value, multiplier, shift, expected) in [
            (1, 1, 1, 1),
            (-1, 1, 1, 0),
            (3, 1, 1, 2),
            (-3, 1, 1, -1),
            (5, 3, 3, 2),
            (i64::from(i32::MAX), (1 << 31) - 1, 31, 2_147_483_646),
            (i64::from(i32::MIN), (1 << 31) - 1, 62, -1),
            (-1, 1, 62, 0),
        ] {
            assert_eq!(
                rescale(value, multiplier, shift),
                expected,
                "{value}·{multiplier}>>{shift}"
            );
        }
    }

    /// floor(value · multiplier / 2^shift + ½) in numbers that cannot overflow.
    fn exact(value: i64, multiplier: u32, shift: u8) -> i128 {
        let twice = (i128::from(value) * i128::from(multiplier)) << 1;
        (twice + (1 << shift)) >> (shift + 1)
    }

    #[test]
    fn sums_at_their_ends() {
        let values = [i32::MIN, i32::MIN + 1, -1, 0, 1, i32::MAX];
        for (value, shift) in values.iter().flat_map(|v| (1..=62).map(move |s| (*v, s))) {
            for multiplier in [1, 2, 3, (1 << 31) - 2, (1 << 31) - 1] {
                let expected = exact(value.into(), multiplier, shift);
                let limited = expected.clamp(i32::MIN.into(), i32::MAX.into());
                let found = rescale_sum(value, multiplier, shift);
                assert_eq!(i128::from(found), limited, "{value}·{multiplier}>>{shift}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn sums(value: i32, multiplier in 1u32..1 << 31, shift in 1u8..=62) {
            let expected = exact(value.into(), multiplier, shift);
            let limited = expected.clamp(i32::MIN.into(), i32::MAX.into());
            prop_assert_eq!(i128::from(rescale_sum(value, multiplier, shift)), limited);
        }

        #[test]
        fn inputs(
            value in prop_oneof![
                any::<i32>().prop_map(i64::from),
                any::<i64>(),
                -1i64 << 33..1 << 33
            ],
            multiplier in 1u32..1 << 24,
            shift in 1u8..=62,
        ) {
            let limited = value.clamp(-LARGEST_DIFFERENCE, LARGEST_DIFFERENCE);
            let expected = exact(limited, multiplier, shift).clamp(-32_768, 32_767);
            prop_assert_eq!(i128::from(rescale_input(value, multiplier, shift)), expected);
        }
    }
}
