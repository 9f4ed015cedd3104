//! Domains, and what is outside them.

use std::fmt;

use super::Real;

/// A quantity outside the domain of one of the model's functions.
#[derive(Clone, Debug, PartialEq)]
pub struct OutOfDomain {
    /// Its name in the paper.
    pub quantity: &'static str,
    /// The value given (may be no number).
    pub value: f64,
    /// What is possible, with its unit.
    pub domain: String,
}

impl fmt::Display for OutOfDomain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let OutOfDomain {
            quantity,
            value,
            domain,
        } = self;
        write!(f, "{quantity} is {value}: use {domain}")
    }
}

impl std::error::Error for OutOfDomain {}

/// Refuses `value` unless `inside`.
fn require<T: Real>(
    inside: bool,
    quantity: &'static str,
    value: T,
    domain: impl FnOnce() -> String,
) -> Result<(), OutOfDomain> {
    if inside {
        return Ok(());
    }
    Err(OutOfDomain {
        quantity,
        value: value.to_f64(),
        domain: domain(),
    })
}

/// A finite value above 0.
pub(super) fn positive<T: Real>(quantity: &'static str, value: T) -> Result<(), OutOfDomain> {
    let v = value.to_f64();
    require(v > 0.0 && v.is_finite(), quantity, value, || {
        "a finite value above 0".to_owned()
    })
}

/// A finite value, 0 or more.
pub(super) fn not_negative<T: Real>(quantity: &'static str, value: T) -> Result<(), OutOfDomain> {
    let v = value.to_f64();
    require(v >= 0.0 && v.is_finite(), quantity, value, || {
        "a finite value, 0 or more".to_owned()
    })
}

/// A value from 0 to `high`.
pub(super) fn up_to<T: Real>(quantity: &'static str, value: T, high: T) -> Result<(), OutOfDomain> {
    let (v, h) = (value.to_f64(), high.to_f64());
    require((0.0..=h).contains(&v), quantity, value, || {
        format!("0 to {h}")
    })
}

/// A value from 0 to below `high`.
pub(super) fn below<T: Real>(quantity: &'static str, value: T, high: T) -> Result<(), OutOfDomain> {
    let (v, h) = (value.to_f64(), high.to_f64());
    require((0.0..h).contains(&v), quantity, value, || {
        format!("0 to below {h}")
    })
}

/// A finite value of either sign.
pub(super) fn finite<T: Real>(quantity: &'static str, value: T) -> Result<(), OutOfDomain> {
    require(value.to_f64().is_finite(), quantity, value, || {
        "a finite value".to_owned()
    })
}
