//! Defines further conditions of a frame's features, in addition to geometry and threshold, and the
//! meaning of α and β.

/// How a marker's position is computed from its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema),
    serde(rename_all = "kebab-case")
)]
pub enum CentroidEstimator {
    /// The mean of its pixels in the mask (the paper's).
    #[cfg_attr(feature = "wire", serde(alias = "BinaryMask"))]
    BinaryMask,
    /// The mean of the same pixels, each weighted by how much of it a marker covers: by the redness
    /// of RGB565, the Cr of YUV422, the luma of mono.
    #[cfg_attr(feature = "wire", serde(alias = "RednessWeighted"))]
    RednessWeighted,
}

impl CentroidEstimator {
    /// Its name in files and reports: `binary-mask` or `redness-weighted`.
    pub const fn name(self) -> &'static str {
        match self {
            CentroidEstimator::BinaryMask => "binary-mask",
            CentroidEstimator::RednessWeighted => "redness-weighted",
        }
    }
}

/// The meaning of α and β.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ContactReading {
    /// The direction of the force on the film.
    Force,
    /// The pressing direction of a tip that sticks to the film: not the force's.
    Stick,
    /// The pressing direction of a tip that slips on the film: not the force's.
    Slip,
}
