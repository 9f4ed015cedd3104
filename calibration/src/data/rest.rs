//! The rest position: how an untouched film looks.

use anyhow::{Context, Result};
use hivtac_sensor::force::features::{COORDINATES, FEATURES, Features};
use hivtac_terms::fixed::Q;
use hivtac_terms::units::Px;
use serde::{Deserialize, Serialize};

/// The rest position.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rest {
    /// The eleven features, px and the last in px²; files hold them as whole multiples of 1/65,536.
    pub features_q16: [Q<16, i64>; FEATURES],
    /// Areas of markers 0–3 in the mask, px.
    pub areas_px: [u32; 4],
}

impl Rest {
    /// The features in px (px²).
    pub fn features_px(&self) -> [f64; FEATURES] {
        self.features_q16.map(|number| number.to_f64())
    }
}

/// The nearest multiple of 1/65,536 to a value in px or px².
pub fn q16(px: f64) -> Q<16, i64> {
    Q::from_bits((px * f64::from(Px::ONE.0)).round() as i64)
}

/// The eleven numbers in the paper's order, px and the last in px², as features.
///
/// # Errors
/// When a coordinate does not fit 32 bits.
pub fn features_from_q16(numbers: &[Q<16, i64>; FEATURES]) -> Result<Features> {
    for (i, number) in numbers.iter().enumerate().take(COORDINATES) {
        let bits = number.bits();
        i32::try_from(bits)
            .with_context(|| format!("feature {i} is {bits} and does not fit 32 bits"))?;
    }
    Ok(Features::from_array(*numbers))
}
