//! Limits of the forces and places of a data set.

use clap::Args;
use serde::{Deserialize, Serialize};

/// Forces from 0 to `force_n`, angles and places to ± their limits.
#[derive(Args, Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Largest |F|, N.
    #[arg(long, default_value_t = Range::RENDERED.force_n)]
    pub force_n: f64,
    /// Largest |α|, degrees.
    #[arg(skip = Range::RENDERED.alpha_deg)]
    pub alpha_deg: f64,
    /// Largest |β|, degrees.
    #[arg(skip = Range::RENDERED.beta_deg)]
    pub beta_deg: f64,
    /// How far from the film's middle the tip is at most, along x and along y, mm; 0 where it is in
    /// the middle, as far as anyone knows.
    #[arg(long = "reach-mm", value_name = "MM", default_value_t = Range::RENDERED.place_mm)]
    #[serde(default, skip_serializing_if = "is_middle")]
    pub place_mm: f64,
}

/// Whether this reach means the film's middle.
fn is_middle(place_mm: &f64) -> bool {
    *place_mm == 0.0
}

impl Range {
    /// The range rendered for the default model. It goes a tenth beyond the forces and angles for
    /// which the model is calibrated, and a twentieth beyond its places, so that their limits lie
    /// inside the data.
    pub const RENDERED: Self = Self {
        force_n: 0.25,
        alpha_deg: 10.0,
        beta_deg: 10.0,
        place_mm: 4.2,
    };

    /// Whether the tip's place is known and may be anywhere.
    pub fn knows_places(&self) -> bool {
        !is_middle(&self.place_mm)
    }
}

impl Default for Range {
    /// The paper's range (Section 6).
    fn default() -> Self {
        Self {
            force_n: 0.2,
            alpha_deg: 10.0,
            beta_deg: 8.0,
            place_mm: 0.0,
        }
    }
}
