//! Prints decimal fractions exactly from integers, for bit-exact comparison by readers.

use serde::{Serialize, Serializer};
use serde_json::value::RawValue;
use std::fmt;

/// An integer in thousandths or millionths, printed with all its decimals: −50 thousandths are
/// `-0.050`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decimal {
    integer: i64,
    decimals: u32,
}

impl Decimal {
    /// From an integer of the wire format; values above 2⁶³ (292,000 years in µs) become 2⁶³ − 1.
    pub fn new(integer: impl TryInto<i64>, decimals: u32) -> Decimal {
        let integer = integer.try_into().unwrap_or(i64::MAX);
        Decimal { integer, decimals }
    }

    /// From thousandths of a degree, µN or µm: a decimal in degrees, mN or mm.
    pub fn thousandths(integer: impl TryInto<i64>) -> Decimal {
        Decimal::new(integer, 3)
    }
}

impl fmt::Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = 10_u64.pow(self.decimals);
        let size = self.integer.unsigned_abs();
        let digits = format!(
            "{}.{:0width$}",
            size / unit,
            size % unit,
            width = self.decimals as usize
        );
        // Pads to the caller's width, sign included.
        f.pad(&if self.integer < 0 {
            format!("-{digits}")
        } else {
            digits
        })
    }
}

impl Serialize for Decimal {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let number = RawValue::from_string(self.to_string()).map_err(serde::ser::Error::custom)?;
        number.serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_exact() {
        assert_eq!(Decimal::new(-1, 6).to_string(), "-0.000001");
        assert_eq!(Decimal::new(0, 6).to_string(), "0.000000");
        assert_eq!(Decimal::new(1_234_567, 6).to_string(), "1.234567");
        assert_eq!(Decimal::new(i32::MIN, 6).to_string(), "-2147.483648");
        assert_eq!(Decimal::thousandths(-50).to_string(), "-0.050");
        assert_eq!(format!("{:>8}", Decimal::thousandths(-50)), "  -0.050");
    }

    #[test]
    fn json_keeps_every_digit() {
        assert_eq!(
            serde_json::to_string(&Decimal::thousandths(1500)).unwrap(),
            "1.500"
        );
    }
}
