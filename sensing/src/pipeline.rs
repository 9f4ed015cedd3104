//! Rows in, measurement out.

use crate::{features::Features, force::Force, markers::Marker, status::Status};

/// What one frame gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Measurement {
    /// Why there is no force, or how far to trust it.
    pub status: Status,
    /// The four markers, when they were found.
    pub markers: Option<[Marker; 4]>,
    /// Their features, exactly when there are markers.
    pub features: Option<Features>,
    /// The force; `None` exactly when `status` has a bit that says "no force".
    pub force: Option<Force>,
}
