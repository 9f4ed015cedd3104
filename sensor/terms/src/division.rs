//! Divides 64-bit numbers exactly with 32-bit instructions, several times as fast on a Cortex-M as
//! the compiler's library.
//!
//! Let B = 2³², d a divisor of B/2 or more, and v = ⌊(B² − 1)/d⌋ − B. Dividing two words by d takes
//! two products and two corrections (Möller and Granlund, *Improved division by invariant
//! integers*, 2011, Algorithm 4). Computing v takes two divisions of 32 bits, once for all
//! dividends.

/// A divisor, for any number of dividends.
#[derive(Clone, Copy, Debug)]
pub struct Divisor {
    /// The divisor, shifted until its highest bit is set.
    normalized: u32,
    shift: u32,
    /// The v of Algorithm 4.
    reciprocal: u32,
}

impl Divisor {
    /// A divisor of at least 1; 0 divides as 1 does.
    #[inline(never)]
    pub fn new(divisor: u32) -> Divisor {
        let divisor = divisor.max(1);
        let shift = divisor.leading_zeros();
        let normalized = divisor << shift;
        Divisor {
            normalized,
            shift,
            reciprocal: reciprocal(normalized),
        }
    }

    /// Returns ⌊`dividend` / divisor⌋.
    #[inline(never)]
    pub fn quotient(&self, dividend: u64) -> u64 {
        let (high, low) = ((dividend >> 32) as u32, dividend as u32);
        // The bits that a left shift by 0 to 31 moves from a word into the next higher one.
        let carried = |word: u32| (word >> 1) >> (31 - self.shift);
        let (top, middle) = (carried(high), (high << self.shift) | carried(low));
        let (upper, rest) = if top == 0 && middle < self.normalized {
            (0, middle)
        } else {
            self.step(top, middle)
        };
        let (lower, _) = self.step(rest, low << self.shift);
        u64::from(upper) << 32 | u64::from(lower)
    }

    /// Returns `dividend` / divisor, rounded towards zero as `/` does.
    pub fn signed_quotient(&self, dividend: i64) -> i64 {
        let quotient = self.quotient(dividend.unsigned_abs()) as i64;
        if dividend < 0 { -quotient } else { quotient }
    }

    /// Quotient and remainder of `high`·B + `low` by the normalized divisor, which must be above
    /// `high`.
    #[inline(always)]
    fn step(&self, high: u32, low: u32) -> (u32, u32) {
        let divisor = self.normalized;
        let words = u64::from(high) << 32 | u64::from(low);
        let estimate = u64::from(self.reciprocal) * u64::from(high) + words;
        let mut quotient = ((estimate >> 32) as u32).wrapping_add(1);
        let mut rest = low.wrapping_sub(quotient.wrapping_mul(divisor));
        if rest > estimate as u32 {
            quotient = quotient.wrapping_sub(1);
            rest = rest.wrapping_add(divisor);
        }
        if rest >= divisor {
            quotient = quotient.wrapping_add(1);
            rest -= divisor;
        }
        (quotient, rest)
    }
}

/// ⌊(B² − 1)/d⌋ − B = ⌊((B − 1 − d)·B + B − 1) / d⌋ for d of B/2 or more, computed by half words.
#[inline(always)]
fn reciprocal(divisor: u32) -> u32 {
    // The upper half always has its highest bit set; setting it here shows that to the compiler.
    let (upper, lower) = (divisor >> 16 | 1 << 15, divisor & 0xffff);
    // A digit from the divisor's upper half is at most 2 too large.
    let digit = |rest: u32| {
        let mut digit = rest / upper;
        let mut left = rest - digit * upper;
        // The next half word of the dividend is all ones.
        while left < 1 << 16 && digit * lower > (left << 16 | 0xffff) {
            digit -= 1;
            left += upper;
        }
        digit
    };
    let first = digit(!divisor);
    let rest = (!divisor << 16 | 0xffff).wrapping_sub(first.wrapping_mul(divisor));
    first << 16 | digit(rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Numbers of any length, and neighbours of powers of two.
    fn numbers() -> impl Strategy<Value = u64> {
        let any_length = (any::<u64>(), 0..64u32).prop_map(|(number, shift)| number >> shift);
        let next_to_powers =
            (0..64u32, -2..3i64).prop_map(|(shift, by)| (1u64 << shift).wrapping_add_signed(by));
        prop_oneof![any_length, next_to_powers, Just(u64::MAX)]
    }

    fn divisors() -> impl Strategy<Value = u32> {
        numbers().prop_map(|number| (number as u32).max(1))
    }

    #[test]
    fn the_reciprocal_is_that_of_its_formula() {
        let by_formula = |divisor: u32| (u64::MAX / u64::from(divisor) - (1 << 32)) as u32;
        let lowest = 1u32 << 31;
        for near in 0..100_000 {
            // From both ends, and near full half words.
            for divisor in [lowest + near, !near, lowest + (near << 14), !(near << 14)] {
                assert_eq!(reciprocal(divisor), by_formula(divisor), "{divisor:#x}");
                let spread = near.wrapping_mul(0x9e37_79b9) | lowest;
                assert_eq!(reciprocal(spread), by_formula(spread), "{spread:#x}");
            }
        }
    }

    #[test]
    fn nothing_is_divided_by_zero() {
        assert_eq!(Divisor::new(0).quotient(7), 7);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(50_000))]

        #[test]
        fn it_is_the_quotient(dividend in numbers(), divisor in divisors()) {
            prop_assert_eq!(
                Divisor::new(divisor).quotient(dividend),
                dividend / u64::from(divisor)
            );
        }

        #[test]
        fn it_is_the_quotient_next_to_multiples(
            divisor in divisors(),
            times in numbers(),
            by in -1..2i64,
        ) {
            let exact = u64::from(divisor);
            let dividend = (times % (u64::MAX / exact) * exact).wrapping_add_signed(by);
            prop_assert_eq!(Divisor::new(divisor).quotient(dividend), dividend / exact);
        }

        #[test]
        fn signs_are_those_of_the_operator(
            dividend: i64,
            shift in 0..64u32,
            divisor in divisors(),
        ) {
            let (dividend, exact) = (dividend >> shift, i64::from(divisor));
            prop_assert_eq!(Divisor::new(divisor).signed_quotient(dividend), dividend / exact);
        }
    }
}
