//! Every message, both ways.

use crate::health::Health;
use crate::settings::{Name, RestPosition, Selection, SettingsReport, TareReport};
use heapless::{String, Vec};
use hivtac_terms::camera::CameraSettings;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::down::Down;
use hivtac_terms::fixed::Q;
use hivtac_terms::force::Force;
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{Filter, TemporalSettings};
use hivtac_terms::threshold::Threshold;
use hivtac_terms::units::MicroNewtons;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Raised on every incompatible change of this file.
pub const PROTOCOL_VERSION: u16 = 2;

/// What the device sends. `Hello` stays variant 0 and keeps its first two fields for ever, so that
/// any two versions can name each other in an error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum DeviceMessage {
    /// Answer to a [`HostMessage::Hello`] and to [`Request::GetInfo`].
    Hello(DeviceHello),
    /// One frame's force, or why there is none.
    Sample(Sample),
    /// Counters since boot; sent once a second while streaming, and on request.
    Stats(Stats),
    /// A line for a person.
    Log(LogLine),
    /// Answer to a [`Command`].
    Reply(Reply),
    /// A frame follows as it was captured, in [`SnapshotPart`]s.
    Snapshot(Snapshot),
    /// The next bytes of the frame that the newest [`Snapshot`] told of.
    SnapshotPart(SnapshotPart),
    /// What the board and its camera are set to.
    Inspection(Inspection),
    /// Answer to [`Request::GetSettings`].
    Settings(SettingsReport),
    /// A tare was taken; before the reply to it.
    Tared(TareReport),
    /// Answer to [`Request::GetHealth`].
    Health(Health),
}

/// What the host sends.
#[expect(
    clippy::large_enum_variant,
    reason = "the device has no heap, and one message at a time"
)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum HostMessage {
    /// First message of a host; the device answers with its own hello and does not stream before.
    Hello(HostHello),
    /// A request that is answered by exactly one [`Reply`] with the same `id`.
    Command(Command),
    /// What is known of gravity on the sensor, from the next frame on. Not answered: it may come as
    /// often as frames do, and the newest counts. What is no direction counts as unknown.
    Down(Down),
}

/// The host's first message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct HostHello {
    /// [`PROTOCOL_VERSION`] of the sender.
    pub protocol: u16,
    /// Schema hash of the sender.
    pub schema: u64,
}

/// The device's first message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct DeviceHello {
    /// [`PROTOCOL_VERSION`] of the sender.
    pub protocol: u16,
    /// Schema hash of the sender.
    pub schema: u64,
    /// The microcontroller's 96-bit unique number.
    pub device_id: [u8; 12],
    /// Board and camera, e.g. `weact-h743 + ov7725`.
    pub board: String<32>,
    /// Firmware name and version.
    pub firmware: String<32>,
    /// The model in use; `None` when there is no usable one.
    pub model: Option<ModelIdentity>,
    /// Columns of a frame, px.
    pub width: u16,
    /// Rows of a frame, px.
    pub height: u16,
    /// The threshold in use, and with that the pixel format.
    pub threshold: Threshold,
    /// Lens and pixels: the name of a geometry preset, e.g. `ov7725`.
    pub preset: String<16>,
    /// 3×3 dilations of the mask, 0–3.
    pub dilations: u8,
    /// How a marker's position is taken from its pixels.
    pub centroid: CentroidEstimator,
    /// What its user calls it.
    pub name: Name,
    /// What is sent in place of each frame's own force.
    pub filter: Filter,
}

/// Which model makes the forces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct ModelIdentity {
    /// CRC-32 of the model file.
    pub crc: u32,
    /// Layer widths and preset, e.g. `11-64-64-3 ov7725`.
    pub name: String<32>,
    /// True when it was trained on a simulated sensor.
    pub simulated: bool,
    /// The threshold that it was made for: with another one there is no force.
    pub threshold: Threshold,
    /// Where it came from.
    pub source: ModelSource,
}

/// Where a model in use came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ModelSource {
    /// It is built into the firmware.
    BuiltIn,
    /// A host sent it, and the device keeps it.
    Kept,
    /// It is built into the firmware, which uses it instead of the kept one: that one does not
    /// read, or is none for this sensor.
    Fallback,
}

/// One frame's result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Sample {
    /// Counts the samples that were produced; a gap is a sample lost on the way to the host.
    pub sequence: u32,
    /// Counts VSYNC edges since the camera was set up; a gap while streaming is a frame that was
    /// not processed.
    pub frame: u32,
    /// Device time of the middle of the frame's exposure, when the force is true, µs since boot.
    pub time_us: u64,
    /// Why there is no force, or how far to trust it.
    pub status: Status,
    /// The force; `None` exactly when `status` has a bit that says "no force".
    pub force: Option<Force>,
    /// The four markers, when they were asked for ([`Request::StartWithMarkers`]) and found.
    pub markers: Option<[Marker; 4]>,
}

/// Counters since boot. They wrap never in practice (32 bits at 1 kHz: 49 days) and saturate then.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Stats {
    /// VSYNC edges seen.
    pub frames_exposed: u32,
    /// Frames that became a sample.
    pub frames_processed: u32,
    /// Frames overwritten before they were processed, or whose interrupt came too late.
    pub dropped_busy: u32,
    /// Frames thrown away after a capture overrun.
    pub dropped_overrun: u32,
    /// Frames with too few or too many bytes.
    pub dropped_size: u32,
    /// Frames that passed while the camera was set up, or a threshold was set.
    pub dropped_setup: u32,
    /// Times the camera fell silent and the capture timed out.
    pub camera_timeouts: u32,
    /// Times the camera was set up again.
    pub camera_restarts: u32,
    /// Overruns the camera interface reported.
    pub capture_overruns: u32,
    /// Samples that were produced but not sent, because the host did not read.
    pub usb_dropped: u32,
    /// Frames from the host that were thrown away: bad CRC, COBS or content.
    pub host_frames_rejected: u32,
    /// Duration of the last frame's processing, µs.
    pub processing_us: u32,
    /// From the middle of the last frame's exposure until its sample was ready, µs.
    pub latency_us: u32,
    /// Device time, µs since boot.
    pub uptime_us: u64,
}

/// A line for a person.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct LogLine {
    /// How bad it is.
    pub level: LogLevel,
    /// Device time, µs since boot.
    pub time_us: u64,
    /// UTF-8 text without a line end; longer text is cut.
    pub text: String<96>,
}

/// How bad a log line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum LogLevel {
    /// Something failed and was recovered or given up.
    Error,
    /// Something is unusual.
    Warning,
    /// Something happened.
    Info,
}

/// A frame as it was captured, which follows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Snapshot {
    /// Its number, that of its [`Sample`].
    pub frame: u32,
    /// That of its [`Sample`].
    pub time_us: u64,
    /// Columns, px.
    pub width: u16,
    /// Rows, px.
    pub height: u16,
    /// The threshold that it was read with, and with that its pixel format.
    pub threshold: Threshold,
    /// Bytes that follow: all rows from the top, as the camera sent them.
    pub bytes: u32,
}

/// Most bytes of a frame in one [`SnapshotPart`]: a frame on the wire is then at most 254 bytes.
pub const SNAPSHOT_PART_BYTES: usize = 240;

/// The next bytes of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SnapshotPart {
    /// Bytes of the frame before these.
    pub offset: u32,
    /// The bytes.
    pub bytes: Vec<u8, SNAPSHOT_PART_BYTES>,
}

/// Most registers of an [`Inspection`] that differ.
pub const DIFFERENT_REGISTERS: usize = 16;

/// What the board and its camera are set to: registers are read back while frames flow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Inspection {
    /// The microcontroller's revision (REV_ID): 0x2001 is X, 0x2003 V.
    pub silicon: u16,
    /// The number by which the camera says what it is.
    pub camera_id: u16,
    /// The camera's registers that were read back: all that the firmware writes.
    pub registers: u16,
    /// Those that hold something else than what was written, the first of them.
    pub different: Vec<DifferentRegister, DIFFERENT_REGISTERS>,
    /// How long a frame should take, µs.
    pub frame_time_us: u32,
    /// How long a row is exposed, µs.
    pub exposure_us: u32,
    /// The longest that it can be, µs.
    pub longest_exposure_us: u32,
    /// The camera's gain.
    pub gain_sixteenths: Q<4, u16>,
}

/// A register of the camera that does not hold what was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct DifferentRegister {
    /// Its address.
    pub address: u8,
    /// What was written.
    pub written: u16,
    /// What it holds.
    pub found: u16,
}

/// A request with a number that its reply repeats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Command {
    /// Chosen by the host.
    pub id: u16,
    /// What to do.
    pub request: Request,
}

/// What a host can ask for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Request {
    /// Send a hello and the stats.
    GetInfo,
    /// Start streaming samples and stats.
    Start,
    /// Stop streaming.
    Stop,
    /// Set the threshold and its pixel format. Answered when it holds; until then the one before
    /// does.
    SetThreshold(Threshold),
    /// Take the mean of the next `frames` good frames (1–256) as the rest position. Answered when
    /// done.
    Tare {
        /// How many frames to average.
        frames: u16,
    },
    /// Start streaming samples with their markers, and stats.
    StartWithMarkers,
    /// Let what is automatic of exposure and gain find what the light needs, and stay so. Answered
    /// when done.
    Expose,
    /// Send the next whole frame. Answered behind its last part.
    Snapshot,
    /// Read the camera's registers back and send an [`Inspection`]. Answered behind it.
    Inspect,
    /// Send a [`SettingsReport`]. Answered behind it.
    GetSettings,
    /// Set the device's name, until it restarts.
    SetName(Name),
    /// Set the rest position, or forget it. Answered when it holds.
    SetTare(Option<RestPosition>),
    /// Keep these settings as they are in use, through restarts. Answered when they are kept.
    Keep(Selection),
    /// Set how forces are followed from frame to frame. Answered when it holds.
    SetTemporal(TemporalSettings),
    /// A model file of so many bytes follows, 1 to [`MODEL_BYTES`], in [`ModelPart`]s. What was
    /// sent of another one is forgotten.
    BeginModel {
        /// Bytes of the file.
        bytes: u32,
    },
    /// The next bytes of the model file.
    ModelPart(ModelPart),
    /// Check the model that was sent, keep it, and use it from a frame on. Answered when it is in
    /// use.
    UseModel,
    /// Use the built-in model from a frame on, and forget the kept one. Answered when it is in use.
    UseBuiltInModel,
    /// Forget all that is kept, and go on as a new device does. Answered when it is in use.
    Reset,
    /// As [`Request::Tare`], though something moves or touches the film.
    TareAnyway {
        /// How many frames to average.
        frames: u16,
    },
    /// Look at everything, and send a [`Health`]. Answered behind it.
    GetHealth,
    /// Restart into the microcontroller's own loader, which takes new firmware. Answered before
    /// that.
    StartLoader,
    /// Set the camera. Answered when it sends frames so.
    SetCamera(CameraSettings),
}

/// Most bytes of a model file that is sent.
pub const MODEL_BYTES: usize = 96 << 10;

/// Most bytes of a model file in one [`ModelPart`].
pub const MODEL_PART_BYTES: usize = 224;

/// The next bytes of a model file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct ModelPart {
    /// Bytes of the file before these.
    pub offset: u32,
    /// The bytes.
    pub bytes: Vec<u8, MODEL_PART_BYTES>,
}

/// The answer to a command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Reply {
    /// The command's number.
    pub id: u16,
    /// How it went.
    pub outcome: Outcome,
}

/// How a command went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Outcome {
    /// Done.
    Done,
    /// Refused: an argument is outside its range.
    InvalidArgument,
    /// Refused: the same thing is already under way.
    Busy,
    /// Tare gave up: not enough good frames arrived in time.
    NoGoodFrames,
    /// Refused: the markers are not where a film at rest has them. Something presses it, or the
    /// sensor is built otherwise.
    NotAtRest,
    /// Refused: this device's camera does not send that pixel format.
    Unsupported,
    /// Refused: the images at rest are not those of four whole, equal markers. One is covered, cut,
    /// grown, stained or glares.
    MarkersImplausible,
    /// Refused: the markers moved from frame to frame.
    Unsteady,
    /// A snapshot was given up: the host did not read.
    NotRead,
    /// The camera does not answer, or not as the one that this firmware is for.
    NoCamera,
    /// The flash is worn: nothing can be kept any more. What was kept before still is.
    Worn,
    /// Refused: what was sent is no model file that this firmware can use. A [`LogLine`] before
    /// this says what is wrong.
    ModelUnusable,
    /// Refused: the model was made for another sensor, camera or frame. A [`LogLine`] before this
    /// says which.
    AnotherSensor,
    /// Refused: something touches the film, as the rest position from before tells, that of the
    /// unit's calibration, or how units are built.
    Touched {
        /// The force that it looks like, µN.
        looks_like: MicroNewtons,
    },
}
