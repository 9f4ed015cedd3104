//! What an untouched film looks like.

use anyhow::{Context, Result};
use hivtac_sensing::features::{FEATURES, Features};
use hivtac_terms::units::Px;
use serde::{Deserialize, Serialize};

/// The rest position.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rest {
    /// The eleven features in 1/65,536 px (the rectangle's area in 1/65,536 px²).
    pub features_q16: [i64; FEATURES],
    /// Areas of markers 0–3 in the mask, px.
    pub areas_px: [u32; 4],
}

impl Rest {
    /// The features in px (px²).
    pub fn features_px(&self) -> [f64; FEATURES] {
        self.features_q16.map(|q16| q16 as f64 / 65_536.0)
    }
}

/// The eleven numbers in the paper's order, each with 16 fractional bits, as features.
///
/// # Errors
/// When a coordinate does not fit 32 bits.
pub fn features_from_q16(q16: &[i64; FEATURES]) -> Result<Features> {
    let px = |i: usize| -> Result<Px> {
        let value = i32::try_from(q16[i]);
        Ok(Px(value.with_context(|| {
            format!("feature {i} is {} and does not fit 32 bits", q16[i])
        })?))
    };
    let pair = |i: usize| -> Result<(Px, Px)> { Ok((px(2 * i)?, px(2 * i + 1)?)) };
    Ok(Features {
        centroids: [pair(0)?, pair(1)?, pair(2)?, pair(3)?],
        rect_center: pair(4)?,
        rect_area: q16[10],
    })
}
