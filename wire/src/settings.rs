//! Defines a device's settings, in use and kept.

use heapless::String;
use hivtac_terms::camera::{CameraLimits, CameraSettings};
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::{Direction, Down};
use hivtac_terms::fixed::Q;
use hivtac_terms::marker::MarkerList;
use hivtac_terms::temporal::TemporalSettings;
use hivtac_terms::threshold::{PixelFormat, Threshold};
use hivtac_terms::units::{Microseconds, MilliDegrees, MilliPx, Px, Sixteenths};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Longest name, bytes of UTF-8.
pub const NAME_BYTES: usize = 24;

/// The name that a user gave a device, or empty.
pub type Name = String<NAME_BYTES>;

/// A rest position that was taken on a device, and the settings with which its markers were found.
/// It is not valid with other settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct RestPosition {
    /// Pixel format of the frames.
    pub format: PixelFormat,
    /// 3×3 dilations of the mask, 0–3.
    pub dilations: u8,
    /// How a marker's position is computed from its pixels.
    pub centroid: CentroidEstimator,
    /// The markers at rest.
    pub markers: MarkerList,
    /// The mean centre of their bounding rectangle, (x, y).
    pub rect_center: (Px, Px),
    /// Mean area of that rectangle, px².
    pub rect_area: Q<16, i64>,
    /// The direction of gravity then; `None` if unknown.
    pub down: Option<Direction>,
}

/// Answer to [`GetSettings`](crate::message::Request::GetSettings).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SettingsReport {
    /// The name in use.
    pub name: Name,
    /// The threshold in use.
    pub threshold: Threshold,
    /// The rest position as it was taken; `None` without one. Re-zeroing may have moved the one in
    /// use.
    pub tare: Option<RestPosition>,
    /// Which of the settings will be the same after a restart.
    pub kept: Selection,
    /// The content of the flash at the start.
    pub found: Found,
    /// Number of flash sectors erased so far to keep settings.
    pub erases: u32,
    /// Number of failed attempts to write since the start.
    pub failures: u32,
    /// How forces are followed from frame to frame.
    pub temporal: TemporalSettings,
    /// The distance by which re-zeroing has moved the rest position from `tare`: the coordinate
    /// that it moved most.
    pub rezeroed: Px,
    /// Distance from the rest position in use at which the untouched film was last seen, a mean of
    /// a second: the largest one of a coordinate. `None` until it was seen, and without a rest
    /// position.
    pub seen: Option<MilliPx>,
    /// Distance of the rest position in use from the kept one, of the marker that moved most: the
    /// drift since then. `None` unless both exist, for the same frames.
    pub drift: Option<Px>,
    /// The camera's settings and limits.
    pub camera: CameraReport,
    /// The known direction of gravity.
    pub down: Down,
    /// The shape of what presses.
    pub contact_shape: ContactShape,
}

/// The camera's settings and limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct CameraReport {
    /// The requested settings.
    pub settings: CameraSettings,
    /// Exposure of a row, as set or found; 0 before the camera was set up.
    pub exposure: Microseconds,
    /// The gain, as set or found; 0 before the camera was set up.
    pub gain: Sixteenths,
    /// The limits of its settings.
    pub limits: CameraLimits,
}

/// The result of a tare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TareReport {
    /// The rest position, in use from now on.
    pub rest: RestPosition,
    /// Largest standard deviation of a marker's coordinate over the frames.
    pub spread: Px,
    /// The motion from the previous rest position; `None` if there was none.
    pub moved: Option<Moved>,
}

/// The motion from one rest position to another, and the part that a motion of the camera explains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Moved {
    /// Distance of the marker that moved most.
    pub farthest: Px,
    /// Shift of the markers' middle, (x, y).
    pub shift: (Px, Px),
    /// Turn about the middle, x towards y.
    pub turn: MilliDegrees,
    /// Relative increase of the pattern's size.
    pub larger: Q<16>,
    /// The rest of the motion: the coordinate of a marker that is farthest.
    pub beside: Px,
}

/// A selection of settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Selection {
    /// The name.
    pub name: bool,
    /// The threshold.
    pub threshold: bool,
    /// The rest position.
    pub tare: bool,
    /// How forces are followed from frame to frame.
    pub temporal: bool,
    /// The camera's settings.
    pub camera: bool,
    /// The known direction of gravity.
    pub down: bool,
    /// The shape of what presses.
    pub contact_shape: bool,
}

impl Selection {
    /// None of them.
    pub const NONE: Selection = Selection {
        name: false,
        threshold: false,
        tare: false,
        temporal: false,
        camera: false,
        down: false,
        contact_shape: false,
    };
    /// All of them.
    pub const ALL: Selection = Selection {
        name: true,
        threshold: true,
        tare: true,
        temporal: true,
        camera: true,
        down: true,
        contact_shape: true,
    };
}

/// The content of a device's flash at its start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Found {
    /// No settings: none were ever kept.
    Nothing,
    /// Settings of this version.
    Settings,
    /// Settings of another firmware version, which this one does not read. They stay until settings
    /// are kept anew.
    AnotherVersion,
}
