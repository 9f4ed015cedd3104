//! Defines fixed-point numbers: the type states how many bits are a fraction.

use core::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A fixed-point number: an integer over 2^`F`. Its unit, if it has one, is stated where it is
/// declared. In memory, messages and files it is that integer.
///
/// Operators are those of the integer, and overflow as it does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize),
    serde(transparent)
)]
pub struct Q<const F: u32, T = i32>(T);

#[cfg(feature = "wire")]
impl<const F: u32, T: postcard_schema::Schema> postcard_schema::Schema for Q<F, T> {
    const SCHEMA: &'static postcard_schema::schema::NamedType = T::SCHEMA;
}

impl<const F: u32, T: Copy> Q<F, T> {
    /// The number that is `bits` over 2^`F`.
    pub const fn from_bits(bits: T) -> Self {
        Q(bits)
    }

    /// The number times 2^`F`.
    pub const fn bits(self) -> T {
        self.0
    }
}

macro_rules! integers {
    ($($integer:ty)*) => {$(
        impl<const F: u32> Q<F, $integer> {
            /// The largest integer that is not above it.
            pub const fn floor(self) -> $integer {
                self.0 >> F
            }

            /// The nearest integer; halves round up. Adding the half must not overflow.
            pub const fn rounded(self) -> $integer {
                (self.0 + const { 1 << (F - 1) }) >> F
            }

            /// The number in floating point, for display, files and tests; exact up to 2⁵³.
            pub fn to_f64(self) -> f64 {
                self.0 as f64 / (1_u64 << F) as f64
            }
        }
    )*};
}

integers! { i16 u16 i32 u32 i64 i128 }

impl<const F: u32> From<Q<F, i16>> for Q<F> {
    fn from(narrow: Q<F, i16>) -> Self {
        Q(narrow.0.into())
    }
}

impl<const F: u32> Q<F, i64> {
    /// An integer, |`whole`| < 2^(63 − `F`).
    pub const fn from_int(whole: i64) -> Self {
        Q(whole << F)
    }

    /// The number with fewer fractional bits; the others are cut off.
    pub const fn floor_to<const G: u32>(self) -> Q<G, i64> {
        Q(self.0 >> const { F - G })
    }

    /// The number with fewer fractional bits, rounded to nearest; halves round up. Adding the half
    /// must not overflow.
    pub const fn rounded_to<const G: u32>(self) -> Q<G, i64> {
        Q((self.0 + const { 1 << (F - G - 1) }) >> const { F - G })
    }

    /// The same number in 32 bits, which must be enough.
    pub const fn narrowed(self) -> Q<F> {
        Q(self.0 as i32)
    }

    /// The sum, saturated at the limits.
    pub const fn saturating_add(self, other: Self) -> Self {
        Q(self.0.saturating_add(other.0))
    }

    /// The difference, saturated at the limits.
    pub const fn saturating_sub(self, other: Self) -> Self {
        Q(self.0.saturating_sub(other.0))
    }
}

impl<const F: u32, T: Add<Output = T>> Add for Q<F, T> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Q(self.0 + other.0)
    }
}

impl<const F: u32, T: AddAssign> AddAssign for Q<F, T> {
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}

impl<const F: u32, T: Sub<Output = T>> Sub for Q<F, T> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Q(self.0 - other.0)
    }
}

impl<const F: u32, T: Neg<Output = T>> Neg for Q<F, T> {
    type Output = Self;
    fn neg(self) -> Self {
        Q(-self.0)
    }
}

/// Multiplies by an integer.
impl<const F: u32, T: Mul<Output = T>> Mul<T> for Q<F, T> {
    type Output = Self;
    fn mul(self, times: T) -> Self {
        Q(self.0 * times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn halves_round_up_on_both_sides_of_zero() {
        for (bits, floor, rounded) in [
            (-6, -2, -1),
            (-5, -2, -1),
            (-7, -2, -2),
            (6, 1, 2),
            (5, 1, 1),
        ] {
            let number = Q::<2>::from_bits(bits);
            assert_eq!(
                (number.floor(), number.rounded()),
                (floor, rounded),
                "{bits}/4"
            );
        }
        assert_eq!(Q::<14, u32>::from_bits(3 << 13).rounded(), 2);
    }

    #[test]
    fn whole_numbers_come_back() {
        for whole in [-(1 << 46), -3, 0, 5, (1 << 46) - 1] {
            let number = Q::<16, i64>::from_int(whole);
            assert_eq!((number.floor(), number.rounded()), (whole, whole));
            assert_eq!(number.to_f64(), whole as f64);
        }
    }

    proptest! {
        /// Compared with exact arithmetic, the rounding error is at most half a step of the result.
        #[test]
        fn fewer_bits_are_the_nearest(bits in -(1_i64 << 61)..1 << 61) {
            let exact = Q::<32, i64>::from_bits(bits);
            let (floor, nearest) = (exact.floor_to::<8>(), exact.rounded_to::<8>());
            let off = |found: Q<8, i64>| i128::from(bits) - (i128::from(found.bits()) << 24);
            prop_assert!((0..1 << 24).contains(&off(floor)));
            prop_assert!((-(1 << 23)..1 << 23).contains(&off(nearest)));
        }

        #[test]
        fn sums_are_those_of_the_numbers(a: i32, b: i32, times in -8_i64..8) {
            let [x, y] = [a, b].map(|bits| Q::<20, i64>::from_bits(i64::from(bits)));
            let sum = (x + y).to_f64();
            prop_assert_eq!(sum, x.to_f64() + y.to_f64());
            prop_assert_eq!((x - y).to_f64(), x.to_f64() - y.to_f64());
            prop_assert_eq!((-x * times).to_f64(), -x.to_f64() * times as f64);
        }
    }

    #[test]
    fn beyond_the_limits_is_the_limit() {
        let [least, most] = [i64::MIN, i64::MAX].map(Q::<16, i64>::from_bits);
        assert_eq!(most.saturating_add(most), most);
        assert_eq!(least.saturating_sub(most), least);
    }
}
