//! A device's settings: what its user gave it, in use and kept.

use heapless::String;
use hivtac_terms::camera::{CameraLimits, CameraSettings};
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::down::{Direction, Down};
use hivtac_terms::fixed::Q;
use hivtac_terms::marker::Marker;
use hivtac_terms::temporal::TemporalSettings;
use hivtac_terms::threshold::{PixelFormat, Threshold};
use hivtac_terms::units::{Microseconds, MilliDegrees, MilliPx, Px, Sixteenths};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Longest name, bytes of UTF-8.
pub const NAME_BYTES: usize = 24;

/// A name that a user gave a device, empty when there is none.
pub type Name = String<NAME_BYTES>;

/// A rest position that was taken on a device, and by which settings its markers were seen: it
/// means nothing under others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct RestPosition {
    /// Of the frames.
    pub format: PixelFormat,
    /// 3×3 dilations of the mask, 0–3.
    pub dilations: u8,
    /// How a marker's position is taken from its pixels.
    pub centroid: CentroidEstimator,
    /// The four markers at rest.
    pub markers: [Marker; 4],
    /// The mean centre of their bounding rectangle, (x, y).
    pub rect_center: (Px, Px),
    /// Its mean area, px².
    pub rect_area: Q<16, i64>,
    /// Where gravity pulled then; `None` where nobody said.
    pub down: Option<Direction>,
}

/// Answer to [`GetSettings`](crate::message::Request::GetSettings).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SettingsReport {
    /// The name in use.
    pub name: Name,
    /// The threshold in use.
    pub threshold: Threshold,
    /// The rest position as it was taken, when one was; re-zeroing may have moved the one in use.
    pub tare: Option<RestPosition>,
    /// Which of them will be the same after a restart.
    pub kept: Selection,
    /// What the device found in its flash at the start.
    pub found: Found,
    /// Sectors of the flash that were erased so far to keep settings.
    pub erases: u32,
    /// Attempts to write that failed since the start.
    pub failures: u32,
    /// How forces are followed from frame to frame.
    pub temporal: TemporalSettings,
    /// How far re-zeroing moved the rest position that is in use from `tare`: the coordinate of a
    /// marker that it moved farthest.
    pub rezeroed: Px,
    /// How far from the rest position in use the untouched film was seen last, a mean of a second:
    /// the coordinate of a marker that was farthest. `None` until it was seen, and without a rest
    /// position.
    pub seen: Option<MilliPx>,
    /// How far the rest position in use is from the kept one, by the marker that moved most: the
    /// drift since then. `None` unless there are both, for the same frames.
    pub drift: Option<Px>,
    /// How the camera is set.
    pub camera: CameraReport,
    /// What is known of gravity.
    pub down: Down,
}

/// How the camera is set, and what it can be set to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct CameraReport {
    /// What was asked for.
    pub settings: CameraSettings,
    /// How long a row is exposed, as it was set or found; 0 before the camera was set up.
    pub exposure: Microseconds,
    /// The gain, likewise.
    pub gain: Sixteenths,
    /// What it can be set to.
    pub limits: CameraLimits,
}

/// What a tare gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TareReport {
    /// The rest position, in use from now on.
    pub rest: RestPosition,
    /// Largest standard deviation of a marker's coordinate over the frames.
    pub spread: Px,
    /// How far it is from the rest position before; `None` when there was none.
    pub moved: Option<Moved>,
}

/// How far a rest position is from another one, and what a camera's motion explains of that.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Moved {
    /// How far the marker moved that moved most.
    pub farthest: Px,
    /// How far the markers' middle moved, (x, y).
    pub shift: (Px, Px),
    /// How far they turned about it, x towards y.
    pub turn: MilliDegrees,
    /// How much larger their pattern is, in parts of it.
    pub larger: Q<16>,
    /// How far beside that they are: the coordinate of a marker that is farthest.
    pub beside: Px,
}

/// Some of the settings.
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
    /// How the camera is set.
    pub camera: bool,
    /// What is known of gravity.
    pub down: bool,
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
    };
    /// All of them.
    pub const ALL: Selection = Selection {
        name: true,
        threshold: true,
        tare: true,
        temporal: true,
        camera: true,
        down: true,
    };
}

/// What a device found in its flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Found {
    /// Nothing: no settings were ever kept.
    Nothing,
    /// What it kept.
    Settings,
    /// What firmware of another version kept, and this one does not read. It stays until settings
    /// are kept anew.
    AnotherVersion,
}
