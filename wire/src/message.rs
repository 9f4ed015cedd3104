//! Defines every message, in both directions.

use crate::health::Health;
use crate::settings::{Name, RestPosition, Selection, SettingsReport, TareReport};
use heapless::{String, Vec};
use hivtac_terms::camera::CameraSettings;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_terms::fixed::Q;
use hivtac_terms::force::{self, ContactList, Force};
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{Filter, TemporalSettings};
use hivtac_terms::threshold::Threshold;
use hivtac_terms::units::MicroNewtons;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Must be raised with every incompatible change of this file.
pub const PROTOCOL_VERSION: u16 = 2;

/// A message from the device. `Hello` stays variant 0 and keeps its first two fields for ever, so
/// that any two versions can name each other in an error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum DeviceMessage {
    /// Answer to a [`HostMessage::Hello`] and to [`Request::GetInfo`].
    Hello(DeviceHello),
    /// One frame's force, or why it is missing.
    Sample(Sample),
    /// Counters since boot; sent once a second while streaming, and on request.
    Stats(Stats),
    /// A line for a person.
    Log(LogLine),
    /// Answer to a [`Command`].
    Reply(Reply),
    /// A captured frame follows, in [`SnapshotPart`]s.
    Snapshot(Snapshot),
    /// The next bytes of the frame that the last [`Snapshot`] announced.
    SnapshotPart(SnapshotPart),
    /// The state of the board and its camera.
    Inspection(Inspection),
    /// Answer to [`Request::GetSettings`].
    Settings(SettingsReport),
    /// The result of a tare; sent before its reply.
    Tared(TareReport),
    /// Answer to [`Request::GetHealth`].
    Health(Health),
}

/// A message from the host.
#[expect(
    clippy::large_enum_variant,
    reason = "the device has no heap, and one message at a time"
)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum HostMessage {
    /// First message of a host; the device answers with its own hello and streams only after it.
    Hello(HostHello),
    /// A request, answered by exactly one [`Reply`] with the same `id`.
    Command(Command),
    /// The direction of gravity on the sensor, from the next frame on. Not answered: it may be sent
    /// for every frame, and the newest counts. An invalid direction counts as unknown.
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
    /// The model in use; `None` if there is no usable one.
    pub model: Option<ModelIdentity>,
    /// Columns of a frame, px.
    pub width: u16,
    /// Rows of a frame, px.
    pub height: u16,
    /// The threshold in use, and with it the pixel format.
    pub threshold: Threshold,
    /// Lens and pixels: the name of a geometry preset, e.g. `ov7725`.
    pub preset: String<16>,
    /// 3×3 dilations of the mask, 0–3.
    pub dilations: u8,
    /// How a marker's position is computed from its pixels.
    pub centroid: CentroidEstimator,
    /// Name that the user gave it.
    pub name: Name,
    /// The filter of the force that is sent.
    pub filter: Filter,
}

/// Identifies the model that makes the forces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct ModelIdentity {
    /// CRC-32 of the model file.
    pub crc: u32,
    /// Layer widths, or the number of markers without layers, and preset, e.g. `11-64-64-3 ov7725`.
    pub name: String<32>,
    /// Number of markers of the film that it is for.
    pub markers: u8,
    /// True when it was trained on a simulated sensor.
    pub simulated: bool,
    /// The threshold that it was made for: with a different one there is no force.
    pub threshold: Threshold,
    /// Where it came from.
    pub source: ModelSource,
}

/// Where a model in use came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ModelSource {
    /// Built into the firmware.
    BuiltIn,
    /// Sent by a host, and kept by the device.
    Kept,
    /// Built into the firmware, and used instead of the kept one, which is unreadable or does not
    /// fit this sensor.
    Fallback,
}

/// One frame's result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
#[serde(default)]
pub struct Sample {
    /// Number of the sample; a gap is a sample lost on the way to the host.
    pub sequence: u32,
    /// Number of VSYNC edges since the camera was set up; a gap while streaming is a frame that was
    /// not processed.
    pub frame: u32,
    /// Device time of the middle of the frame's exposure, to which the force belongs, µs since
    /// boot.
    pub time_us: u64,
    /// Why there is no force, or how far it can be trusted.
    pub status: Status,
    /// The force; `None` exactly if `status` has a bit that means "no force".
    pub force: Option<Force>,
    /// The two contacts whose sum `force` is, if the status has [`Status::TWO_CONTACTS`] and they
    /// are resolved; otherwise empty ([`Sample::each_contact`]).
    pub contacts: ContactList,
    /// The markers, if they were requested ([`Request::StartWithMarkers`]) and all were found;
    /// otherwise empty.
    pub markers: MarkerList,
}

impl Sample {
    /// Each contact: one, two, or none if nothing touches the film or two are not resolved.
    pub fn each_contact(&self) -> &[Force] {
        force::contacts(self.status, self.force.as_ref(), &self.contacts)
    }

    /// The markers; `None` if they were not requested, or not all found.
    pub fn found(&self) -> Option<&[Marker]> {
        Some(&self.markers[..]).filter(|markers| !markers.is_empty())
    }
}

/// Counters since boot. They saturate instead of wrapping, which takes 49 days at 1 kHz (32 bits).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(default)]
pub struct Stats {
    /// Number of VSYNC edges.
    pub frames_exposed: u32,
    /// Frames that gave a sample.
    pub frames_processed: u32,
    /// Frames overwritten before they were processed, or whose interrupt came too late.
    pub dropped_busy: u32,
    /// Frames rejected after a capture overrun.
    pub dropped_overrun: u32,
    /// Frames with too few or too many bytes.
    pub dropped_size: u32,
    /// Frames that passed during the set-up of the camera or of a threshold.
    pub dropped_setup: u32,
    /// How often the camera fell silent and the capture timed out.
    pub camera_timeouts: u32,
    /// How often the camera was set up again.
    pub camera_restarts: u32,
    /// Overruns that the camera interface reported.
    pub capture_overruns: u32,
    /// Samples that were not sent because the host did not read.
    pub usb_dropped: u32,
    /// Frames from the host that were rejected: bad CRC, COBS or content.
    pub host_frames_rejected: u32,
    /// Processing time of the last frame, µs.
    pub processing_us: u32,
    /// Time from the middle of the last frame's exposure until its sample was ready, µs.
    pub latency_us: u32,
    /// Device time, µs since boot.
    pub uptime_us: u64,
}

/// A line for a person.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct LogLine {
    /// Its severity.
    pub level: LogLevel,
    /// Device time, µs since boot.
    pub time_us: u64,
    /// UTF-8 text without a line end; longer text is cut.
    pub text: String<96>,
}

/// Severity of a log line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum LogLevel {
    /// Something failed and was recovered or given up.
    Error,
    /// Something is unusual.
    Warning,
    /// Something happened.
    Info,
}

/// Announces a captured frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Snapshot {
    /// Number of the frame, as in its [`Sample`].
    pub frame: u32,
    /// Time of the frame, as in its [`Sample`].
    pub time_us: u64,
    /// Columns, px.
    pub width: u16,
    /// Rows, px.
    pub height: u16,
    /// The threshold that was in use, and with it the frame's pixel format.
    pub threshold: Threshold,
    /// Number of bytes that follow: all rows from the top, as the camera sent them.
    pub bytes: u32,
}

/// Most bytes of a frame in one [`SnapshotPart`]: its frame on the wire is then at most 254 bytes.
pub const SNAPSHOT_PART_BYTES: usize = 240;

/// The next bytes of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SnapshotPart {
    /// Number of the frame's bytes before these.
    pub offset: u32,
    /// The bytes.
    pub bytes: Vec<u8, SNAPSHOT_PART_BYTES>,
}

/// Most differing registers in an [`Inspection`].
pub const DIFFERENT_REGISTERS: usize = 16;

/// The state of the board and its camera: registers are read back while frames are captured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Inspection {
    /// The microcontroller's revision (REV_ID): 0x2001 is X, 0x2003 V.
    pub silicon: u16,
    /// The camera's identification number.
    pub camera_id: u16,
    /// Number of camera registers that were read back: all that the firmware writes.
    pub registers: u16,
    /// The first of those that do not hold the written value.
    pub different: Vec<DifferentRegister, DIFFERENT_REGISTERS>,
    /// Expected time of a frame, µs.
    pub frame_time_us: u32,
    /// Exposure of a row, µs.
    pub exposure_us: u32,
    /// Its longest possible value, µs.
    pub longest_exposure_us: u32,
    /// The camera's gain.
    pub gain_sixteenths: Q<4, u16>,
}

/// A register of the camera that does not hold the written value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct DifferentRegister {
    /// Its address.
    pub address: u16,
    /// The written value.
    pub written: u16,
    /// The value that was read.
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

/// A request of the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Request {
    /// Send a hello and the stats.
    GetInfo,
    /// Start streaming samples and stats.
    Start,
    /// Stop streaming.
    Stop,
    /// Set the threshold and its pixel format. Answered once it is in use; until then the previous
    /// one applies.
    SetThreshold(Threshold),
    /// Use the mean of the next `frames` good frames (1–256) as the rest position. Answered when
    /// done.
    Tare {
        /// How many frames to average.
        frames: u16,
    },
    /// Start streaming samples with their markers, and stats.
    StartWithMarkers,
    /// Let automatic exposure and gain adapt to the light, and then keep their values. Answered
    /// when done.
    Expose,
    /// Send the next whole frame. Answered after its last part.
    Snapshot,
    /// Read the camera's registers back and send an [`Inspection`]. Answered after it.
    Inspect,
    /// Send a [`SettingsReport`]. Answered after it.
    GetSettings,
    /// Set the device's name, until it restarts.
    SetName(Name),
    /// Set the rest position, or remove it. Answered once it is in use.
    SetTare(Option<RestPosition>),
    /// Keep these of the settings in use, through restarts. Answered when they are kept.
    Keep(Selection),
    /// Set how forces are followed from frame to frame. Answered once it is in use.
    SetTemporal(TemporalSettings),
    /// Announces a model file of `bytes` bytes, 1 to [`MODEL_BYTES`], in [`ModelPart`]s. An earlier
    /// upload is discarded.
    BeginModel {
        /// Number of bytes of the file.
        bytes: u32,
    },
    /// The next bytes of the model file.
    ModelPart(ModelPart),
    /// Check the uploaded model, keep it, and use it from the next frame on. Answered once it is in
    /// use.
    UseModel,
    /// Use the built-in model from the next frame on, and delete the kept one. Answered once it is
    /// in use.
    UseBuiltInModel,
    /// Delete all kept data, and continue like a new device. Answered once this is done.
    Reset,
    /// As [`Request::Tare`], even if something moves or touches the film.
    TareAnyway {
        /// How many frames to average.
        frames: u16,
    },
    /// Run all checks, and send a [`Health`]. Answered after it.
    GetHealth,
    /// Restart into the microcontroller's own loader, which receives new firmware. Answered before
    /// the restart.
    StartLoader,
    /// Set the camera. Answered when it sends frames with these settings.
    SetCamera(CameraSettings),
    /// Set the shape of what presses, from the next frame on.
    SetContactShape(ContactShape),
}

/// Most bytes of an uploaded model file.
pub const MODEL_BYTES: usize = 160 << 10;

/// Most bytes of a model file in one [`ModelPart`].
pub const MODEL_PART_BYTES: usize = 224;

/// The next bytes of a model file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct ModelPart {
    /// Number of the file's bytes before these.
    pub offset: u32,
    /// The bytes.
    pub bytes: Vec<u8, MODEL_PART_BYTES>,
}

/// The answer to a command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Reply {
    /// The command's number.
    pub id: u16,
    /// The result of the command.
    pub outcome: Outcome,
}

/// The result of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Outcome {
    /// Done.
    Done,
    /// Refused: an argument is outside its range.
    InvalidArgument,
    /// Refused: the same action is already being carried out.
    Busy,
    /// The tare gave up: not enough good frames arrived in time.
    NoGoodFrames,
    /// Refused: the markers are not where a film at rest has them. Something presses it, or the
    /// sensor is built differently.
    NotAtRest,
    /// Refused: this device's camera does not send that pixel format.
    Unsupported,
    /// Refused: the images at rest are not those of four whole, equal markers. One is covered, cut,
    /// grown, stained or glaring.
    MarkersImplausible,
    /// Refused: the markers moved from frame to frame.
    Unsteady,
    /// The snapshot was given up: the host did not read.
    NotRead,
    /// The camera does not answer, or is not the one that this firmware supports.
    NoCamera,
    /// The flash is worn: new data cannot be kept. Earlier data is still kept.
    Worn,
    /// Refused: the upload is not a model file that this firmware can use. A [`LogLine`] before
    /// this names the fault.
    ModelUnusable,
    /// Refused: the model was made for another sensor, camera or frame. A [`LogLine`] before this
    /// names the difference.
    AnotherSensor,
    /// Refused: something touches the film. The comparison is with the previous rest position, with
    /// that of the unit's calibration, or with how units are built.
    Touched {
        /// The force that it looks like, µN.
        looks_like: MicroNewtons,
    },
}
