//! Decimal fractions printed exactly from integers, so that readers can compare them bit for bit.

use serde::{Serialize, Serializer};
use serde_json::value::RawValue;
use std::fmt;

/// An integer in units of 10^−`DECIMALS`, printed with all its decimals: `Decimal::<3>(-50)` is
/// `-0.050`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decimal<const DECIMALS: u32>(pub i64);

/// Thousandths of a degree, printed in degrees; µN in mN; µm in mm.
pub type Thousandths = Decimal<3>;
/// µN, printed in N; µs in s.
pub type Millionths = Decimal<6>;

impl<const DECIMALS: u32> Decimal<DECIMALS> {
    /// From an integer of the wire.
    pub fn from_i32(value: i32) -> Self {
        Decimal(value.into())
    }

    /// From an unsigned integer of the wire; beyond 2⁶³ (292,000 years in µs) it stays at 2⁶³ − 1.
    pub fn from_u64(value: u64) -> Self {
        Decimal(i64::try_from(value).unwrap_or(i64::MAX))
    }
}

impl Millionths {
    /// The same in thousandths: N become mN.
    pub fn in_thousandths(self) -> Thousandths {
        Decimal(self.0)
    }
}

impl<const DECIMALS: u32> fmt::Display for Decimal<DECIMALS> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = 10_u64.pow(DECIMALS);
        let size = self.0.unsigned_abs();
        let digits = format!(
            "{}.{:0width$}",
            size / unit,
            size % unit,
            width = DECIMALS as usize
        );
        // Pads to the width the caller wants, sign included.
        f.pad(&if self.0 < 0 {
            format!("-{digits}")
        } else {
            digits
        })
    }
}

impl<const DECIMALS: u32> Serialize for Decimal<DECIMALS> {
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
        assert_eq!(Millionths::from_i32(-1).to_string(), "-0.000001");
        assert_eq!(Millionths::from_i32(0).to_string(), "0.000000");
        assert_eq!(Millionths::from_i32(1_234_567).to_string(), "1.234567");
        assert_eq!(Millionths::from_i32(i32::MIN).to_string(), "-2147.483648");
        assert_eq!(Thousandths::from_i32(-50).to_string(), "-0.050");
        assert_eq!(format!("{:>8}", Thousandths::from_i32(-50)), "  -0.050");
    }

    #[test]
    fn json_keeps_every_digit() {
        assert_eq!(
            serde_json::to_string(&Thousandths::from_i32(1500)).unwrap(),
            "1.500"
        );
    }
}
