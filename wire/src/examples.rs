//! Provides messages for tests: the longest of each kind, and arbitrary ones.

use crate::failure::*;
use crate::health::*;
use crate::message::*;
use crate::settings::*;
use crate::version::SCHEMA_HASH;
use heapless::{String, Vec as Bytes};
use hivtac_terms::camera::{CameraLimits, CameraSettings, Rate, RateLimits, White};
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::{Direction, Down};
use hivtac_terms::fixed::Q;
use hivtac_terms::force::{ContactList, Force, MOST_CONTACTS, Place};
use hivtac_terms::marker::{MOST_MARKERS, Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{
    ContactLimits, Creep, Filter, Output, Rezero, SlipLimits, TemporalSettings,
};
use hivtac_terms::threshold::{HsvBox, Mono, PixelFormat, Threshold, Yuv422};
use hivtac_terms::units::{
    MicroNewtons, Micrometres, Microseconds, MilliDegrees, MilliPx, Milliseconds, Permille, Px,
    SignedMicrometres, Sixteenths, SmallPermille, UnsignedMicroNewtons, UnsignedMilliDegrees,
};
use proptest::prelude::*;
use std::{vec, vec::Vec};

/// A string of its largest length.
fn full<const N: usize>() -> String<N> {
    String::try_from(std::string::String::from("x").repeat(N).as_str()).unwrap()
}

/// A threshold with the longest encoding.
const RED: Threshold = Threshold::Rgb565(HsvBox::of_limits([170, 10, 100, 255, 45, 255]));

/// An ordinary hello.
pub fn device_hello() -> DeviceHello {
    DeviceHello {
        protocol: PROTOCOL_VERSION,
        schema: SCHEMA_HASH,
        device_id: [7; 12],
        board: String::try_from("board").unwrap(),
        firmware: String::try_from("firmware").unwrap(),
        model: None,
        width: 320,
        height: 240,
        threshold: RED,
        preset: String::try_from("ov7725").unwrap(),
        dilations: 1,
        centroid: CentroidEstimator::RednessWeighted,
        name: String::new(),
        filter: Filter::None,
    }
}

/// For each variant a message whose fields all have their longest encoding.
pub fn longest_device_messages() -> Vec<DeviceMessage> {
    vec![
        DeviceMessage::Hello(DeviceHello {
            protocol: u16::MAX,
            schema: u64::MAX,
            board: full(),
            firmware: full(),
            model: Some(ModelIdentity {
                crc: u32::MAX,
                name: full(),
                markers: u8::MAX,
                simulated: true,
                threshold: RED,
                source: ModelSource::Fallback,
            }),
            width: u16::MAX,
            height: u16::MAX,
            preset: full(),
            name: full(),
            filter: longest_temporal().filter,
            ..device_hello()
        }),
        DeviceMessage::Sample(longest_sample()),
        DeviceMessage::Stats(longest_stats()),
        DeviceMessage::Log(LogLine {
            level: LogLevel::Info,
            time_us: u64::MAX,
            text: full(),
        }),
        DeviceMessage::Reply(Reply {
            id: u16::MAX,
            outcome: Outcome::NoGoodFrames,
        }),
        DeviceMessage::Snapshot(Snapshot {
            frame: u32::MAX,
            time_us: u64::MAX,
            width: u16::MAX,
            height: u16::MAX,
            threshold: RED,
            bytes: u32::MAX,
        }),
        DeviceMessage::SnapshotPart(SnapshotPart {
            offset: u32::MAX,
            bytes: Bytes::from_array([u8::MAX; SNAPSHOT_PART_BYTES]),
        }),
        DeviceMessage::Inspection(longest_inspection()),
        DeviceMessage::Settings(SettingsReport {
            name: full(),
            threshold: RED,
            tare: Some(longest_rest()),
            kept: Selection::ALL,
            found: Found::AnotherVersion,
            erases: u32::MAX,
            failures: u32::MAX,
            temporal: longest_temporal(),
            rezeroed: Px(i32::MIN),
            seen: Some(MilliPx(u16::MAX)),
            drift: Some(Px(i32::MIN)),
            camera: longest_camera_report(),
            down: LONGEST_DOWN,
            contact_shape: LONGEST_CONTACT_SHAPE,
        }),
        DeviceMessage::Health(Health {
            reset: ResetReason::Other,
            temperature_centidegrees: Some(i16::MIN),
            stack_used: u32::MAX,
            stack_bytes: u32::MAX,
            problems: u32::MAX,
            at_start: u32::MAX,
            brown_out: BrownOut::High,
            failure: Some(Failure {
                kind: FailureKind::Watchdog,
                starts_ago: u32::MAX,
                count: u32::MAX,
                program_counter: Some(u32::MAX),
                link_register: Some(u32::MAX),
                address: Some(u32::MAX),
                fault_status: u32::MAX,
                exception: u16::MAX,
                place: full(),
            }),
        }),
        DeviceMessage::Tared(TareReport {
            rest: longest_rest(),
            spread: Px(i32::MIN),
            moved: Some(Moved {
                farthest: Px(i32::MIN),
                shift: (Px(i32::MIN), Px(i32::MIN)),
                turn: MilliDegrees(i32::MIN),
                larger: Q::from_bits(i32::MIN),
                beside: Px(i32::MIN),
            }),
        }),
    ]
}

/// A sample with force, place and markers, each number with its longest encoding.
pub fn longest_sample() -> Sample {
    Sample {
        sequence: u32::MAX,
        frame: u32::MAX,
        time_us: u64::MAX,
        status: Status(u32::MAX),
        force: Some(LONGEST_FORCE),
        contacts: ContactList::filled(MOST_CONTACTS, LONGEST_FORCE),
        markers: MarkerList::filled(
            MOST_MARKERS,
            Marker {
                x: Px(i32::MIN),
                y: Px(i32::MIN),
                area: u32::MAX,
            },
        ),
    }
}

/// A force, each number with its longest encoding.
const LONGEST_FORCE: Force = Force {
    alpha: MilliDegrees(i32::MIN),
    beta: MilliDegrees(i32::MIN),
    magnitude: MicroNewtons(i32::MIN),
    cartesian: [MicroNewtons(i32::MIN); 3],
    direction_sigma: UnsignedMilliDegrees(u32::MAX),
    magnitude_sigma: UnsignedMicroNewtons(u32::MAX),
    place: Some(Place {
        x: SignedMicrometres(i32::MIN),
        y: SignedMicrometres(i32::MIN),
        sigma: Micrometres(u32::MAX),
    }),
};

/// A rest position, each number with its longest encoding.
pub fn longest_rest() -> RestPosition {
    RestPosition {
        format: PixelFormat::Mono,
        dilations: u8::MAX,
        centroid: CentroidEstimator::RednessWeighted,
        markers: longest_sample().markers,
        rect_center: (Px(i32::MIN), Px(i32::MIN)),
        rect_area: Q::from_bits(i64::MIN),
        down: LONGEST_DOWN.direction(),
    }
}

/// A direction, each number with its longest encoding.
pub const LONGEST_DOWN: Down = Down::Told(Direction([i16::MIN; 3]));

/// A shape of what presses, its radius with its longest encoding.
pub const LONGEST_CONTACT_SHAPE: ContactShape = ContactShape::Flat(Micrometres(u32::MAX));

/// Temporal settings, each number with its longest encoding.
pub fn longest_temporal() -> TemporalSettings {
    TemporalSettings {
        contact: ContactLimits {
            begins: UnsignedMicroNewtons(u32::MAX),
            ends: UnsignedMicroNewtons(u32::MAX),
        },
        slip: SlipLimits {
            distance: Micrometres(u32::MAX),
            within: Milliseconds(u32::MAX),
            ratio: Permille(u16::MAX),
        },
        filter: Filter::LowPass {
            time_constant: Milliseconds(u32::MAX),
        },
        rezero: Some(Rezero {
            after: Milliseconds(u32::MAX),
            rate: MilliPx(u16::MAX),
            total: MilliPx(u16::MAX),
        }),
        creep: Creep {
            parts: [SmallPermille(u8::MAX); 2],
        },
        output: Output::Force {
            limit: UnsignedMicroNewtons(u32::MAX),
        },
    }
}

/// Camera settings, each number with its longest encoding.
pub fn longest_camera() -> CameraSettings {
    CameraSettings {
        exposure: Some(Microseconds(u32::MAX)),
        gain: Some(Sixteenths(u16::MAX)),
        rate: Rate::Quarter,
        white: Some(White {
            red: u8::MAX,
            blue: u8::MAX,
        }),
    }
}

fn longest_camera_report() -> CameraReport {
    let limits = RateLimits::new(u16::MAX, [Microseconds(u32::MAX); 2]);
    CameraReport {
        settings: longest_camera(),
        exposure: Microseconds(u32::MAX),
        gain: Sixteenths(u16::MAX),
        limits: CameraLimits([limits; 3]),
    }
}

fn longest_inspection() -> Inspection {
    let register = DifferentRegister {
        address: u16::MAX,
        written: u16::MAX,
        found: u16::MAX,
    };
    Inspection {
        silicon: u16::MAX,
        camera_id: u16::MAX,
        registers: u16::MAX,
        different: Bytes::from_array([register; DIFFERENT_REGISTERS]),
        frame_time_us: u32::MAX,
        exposure_us: u32::MAX,
        longest_exposure_us: u32::MAX,
        gain_sixteenths: Q::from_bits(u16::MAX),
    }
}

fn longest_stats() -> Stats {
    Stats {
        frames_exposed: u32::MAX,
        frames_processed: u32::MAX,
        dropped_busy: u32::MAX,
        dropped_overrun: u32::MAX,
        dropped_size: u32::MAX,
        dropped_setup: u32::MAX,
        camera_timeouts: u32::MAX,
        camera_restarts: u32::MAX,
        capture_overruns: u32::MAX,
        usb_dropped: u32::MAX,
        host_frames_rejected: u32::MAX,
        processing_us: u32::MAX,
        latency_us: u32::MAX,
        uptime_us: u64::MAX,
    }
}

/// For each variant a message whose fields all have their longest encoding.
pub fn longest_host_messages() -> Vec<HostMessage> {
    let requests = [
        Request::GetInfo,
        Request::Start,
        Request::Stop,
        Request::SetThreshold(RED),
        Request::Tare { frames: u16::MAX },
        Request::StartWithMarkers,
        Request::Expose,
        Request::Snapshot,
        Request::Inspect,
        Request::GetSettings,
        Request::SetName(full()),
        Request::SetTare(Some(longest_rest())),
        Request::Keep(Selection::ALL),
        Request::SetTemporal(longest_temporal()),
        Request::BeginModel { bytes: u32::MAX },
        Request::ModelPart(ModelPart {
            offset: u32::MAX,
            bytes: Bytes::from_array([u8::MAX; MODEL_PART_BYTES]),
        }),
        Request::UseModel,
        Request::UseBuiltInModel,
        Request::Reset,
        Request::TareAnyway { frames: u16::MAX },
        Request::GetHealth,
        Request::StartLoader,
        Request::SetCamera(longest_camera()),
        Request::SetContactShape(LONGEST_CONTACT_SHAPE),
    ];
    let commands = requests.map(|request| {
        HostMessage::Command(Command {
            id: u16::MAX,
            request,
        })
    });
    let hello = HostMessage::Hello(HostHello {
        protocol: u16::MAX,
        schema: u64::MAX,
    });
    commands
        .into_iter()
        .chain([hello, HostMessage::Down(LONGEST_DOWN)])
        .collect()
}

/// Any message a device of this version can send.
pub fn any_device_message() -> impl Strategy<Value = DeviceMessage> {
    prop_oneof![
        any_hello().prop_map(DeviceMessage::Hello),
        any_sample().prop_map(DeviceMessage::Sample),
        any_stats().prop_map(DeviceMessage::Stats),
        any_log().prop_map(DeviceMessage::Log),
        any_reply().prop_map(DeviceMessage::Reply),
        any_snapshot().prop_map(DeviceMessage::Snapshot),
        any_part().prop_map(DeviceMessage::SnapshotPart),
        any_inspection().prop_map(DeviceMessage::Inspection),
        any_report().prop_map(DeviceMessage::Settings),
        any_tared().prop_map(DeviceMessage::Tared),
        any_health().prop_map(DeviceMessage::Health),
    ]
}

/// Any message a host of this version can send.
pub fn any_host_message() -> impl Strategy<Value = HostMessage> {
    let request = prop_oneof![
        Just(Request::GetInfo),
        Just(Request::Start),
        Just(Request::Stop),
        any_threshold().prop_map(Request::SetThreshold),
        any::<u16>().prop_map(|frames| Request::Tare { frames }),
        Just(Request::StartWithMarkers),
        Just(Request::Expose),
        Just(Request::Snapshot),
        Just(Request::Inspect),
        Just(Request::GetSettings),
        any_string().prop_map(Request::SetName),
        proptest::option::of(any_rest()).prop_map(Request::SetTare),
        any_selection().prop_map(Request::Keep),
        any_temporal().prop_map(Request::SetTemporal),
        any::<u32>().prop_map(|bytes| Request::BeginModel { bytes }),
        any_model_part().prop_map(Request::ModelPart),
        Just(Request::UseModel),
        Just(Request::UseBuiltInModel),
        Just(Request::Reset),
        any::<u16>().prop_map(|frames| Request::TareAnyway { frames }),
        Just(Request::GetHealth),
        Just(Request::StartLoader),
        any_camera().prop_map(Request::SetCamera),
        any_contact_shape().prop_map(Request::SetContactShape),
    ];
    let command = (any::<u16>(), request)
        .prop_map(|(id, request)| HostMessage::Command(Command { id, request }));
    let hello = HostHello {
        protocol: PROTOCOL_VERSION,
        schema: SCHEMA_HASH,
    };
    prop_oneof![
        Just(HostMessage::Hello(hello)),
        command,
        any_down().prop_map(HostMessage::Down)
    ]
}

fn any_hello() -> impl Strategy<Value = DeviceHello> {
    let names = (any_string(), any_string(), any_string());
    let centroid = prop_oneof![
        Just(CentroidEstimator::BinaryMask),
        Just(CentroidEstimator::RednessWeighted)
    ];
    let seen = (any_threshold(), any::<u8>(), centroid);
    let size = any::<(u16, u16)>();
    let source = prop_oneof![
        Just(ModelSource::BuiltIn),
        Just(ModelSource::Kept),
        Just(ModelSource::Fallback)
    ];
    let model = (
        any::<u32>(),
        (any_string(), any::<u8>()),
        any::<bool>(),
        any_threshold(),
        source,
    );
    let model = proptest::option::of(model);
    let identity = (any::<[u8; 12]>(), any_string(), any_temporal());
    (identity, names, size, model, seen).prop_map(
        |((device_id, name, temporal), (board, firmware, preset), (width, height), model, seen)| {
            DeviceHello {
                device_id,
                name,
                board,
                firmware,
                width,
                height,
                model: model.map(|(crc, (name, markers), simulated, threshold, source)| {
                    ModelIdentity {
                        crc,
                        name,
                        markers,
                        simulated,
                        threshold,
                        source,
                    }
                }),
                threshold: seen.0,
                preset,
                dilations: seen.1,
                centroid: seen.2,
                filter: temporal.filter,
                ..device_hello()
            }
        },
    )
}

fn any_sample() -> impl Strategy<Value = Sample> {
    let force = proptest::option::of(any_force());
    let contacts = proptest::collection::vec(any_force(), 0..=MOST_CONTACTS);
    let head = any::<(u32, u32, u64, u32)>();
    (head, force, contacts, any_markers()).prop_map(
        |((sequence, frame, time_us, status), force, contacts, markers)| Sample {
            sequence,
            frame,
            time_us,
            status: Status(status),
            force,
            contacts: ContactList::of(contacts),
            markers,
        },
    )
}

fn any_markers() -> impl Strategy<Value = MarkerList> {
    proptest::collection::vec(any_marker(), 0..=MOST_MARKERS).prop_map(MarkerList::of)
}

fn any_marker() -> impl Strategy<Value = Marker> {
    any::<(i32, i32, u32)>().prop_map(|(x, y, area)| Marker {
        x: Px(x),
        y: Px(y),
        area,
    })
}

fn any_force() -> impl Strategy<Value = Force> {
    let numbers = (any::<[i32; 3]>(), any::<[i32; 3]>(), any::<[u32; 2]>());
    (numbers, proptest::option::of(any_place())).prop_map(
        |(([alpha, beta, magnitude], cartesian, sigma), place)| Force {
            alpha: MilliDegrees(alpha),
            beta: MilliDegrees(beta),
            magnitude: MicroNewtons(magnitude),
            cartesian: cartesian.map(MicroNewtons),
            direction_sigma: UnsignedMilliDegrees(sigma[0]),
            magnitude_sigma: UnsignedMicroNewtons(sigma[1]),
            place,
        },
    )
}

fn any_place() -> impl Strategy<Value = Place> {
    any::<(i32, i32, u32)>().prop_map(|(x, y, sigma)| Place {
        x: SignedMicrometres(x),
        y: SignedMicrometres(y),
        sigma: Micrometres(sigma),
    })
}

fn any_stats() -> impl Strategy<Value = Stats> {
    (any::<[u32; 13]>(), any::<u64>()).prop_map(|(counts, uptime_us)| Stats {
        frames_exposed: counts[0],
        frames_processed: counts[1],
        dropped_busy: counts[2],
        dropped_overrun: counts[3],
        dropped_size: counts[4],
        dropped_setup: counts[5],
        camera_timeouts: counts[6],
        camera_restarts: counts[7],
        capture_overruns: counts[8],
        usb_dropped: counts[9],
        host_frames_rejected: counts[10],
        processing_us: counts[11],
        latency_us: counts[12],
        uptime_us,
    })
}

fn any_log() -> impl Strategy<Value = LogLine> {
    let level = prop_oneof![
        Just(LogLevel::Error),
        Just(LogLevel::Warning),
        Just(LogLevel::Info)
    ];
    (level, any::<u64>(), any_string()).prop_map(|(level, time_us, text)| LogLine {
        level,
        time_us,
        text,
    })
}

fn any_reply() -> impl Strategy<Value = Reply> {
    let outcome = prop_oneof![
        Just(Outcome::Done),
        Just(Outcome::InvalidArgument),
        Just(Outcome::Busy),
        Just(Outcome::NoGoodFrames),
        Just(Outcome::NotAtRest),
        Just(Outcome::MarkersImplausible),
        Just(Outcome::Unsteady),
        Just(Outcome::Unsupported),
        Just(Outcome::NotRead),
        Just(Outcome::NoCamera),
        Just(Outcome::Worn),
        Just(Outcome::ModelUnusable),
        Just(Outcome::AnotherSensor),
        any::<i32>().prop_map(|looks_like| Outcome::Touched {
            looks_like: MicroNewtons(looks_like)
        }),
    ];
    (any::<u16>(), outcome).prop_map(|(id, outcome)| Reply { id, outcome })
}

fn any_snapshot() -> impl Strategy<Value = Snapshot> {
    (any::<(u32, u64, u16, u16, u32)>(), any_threshold()).prop_map(
        |((frame, time_us, width, height, bytes), threshold)| Snapshot {
            frame,
            time_us,
            width,
            height,
            threshold,
            bytes,
        },
    )
}

fn any_part() -> impl Strategy<Value = SnapshotPart> {
    let bytes = proptest::collection::vec(any::<u8>(), 0..=SNAPSHOT_PART_BYTES);
    (any::<u32>(), bytes).prop_map(|(offset, bytes)| SnapshotPart {
        offset,
        bytes: Bytes::from_slice(&bytes).unwrap(),
    })
}

fn any_model_part() -> impl Strategy<Value = ModelPart> {
    let bytes = proptest::collection::vec(any::<u8>(), 0..=MODEL_PART_BYTES);
    (any::<u32>(), bytes).prop_map(|(offset, bytes)| ModelPart {
        offset,
        bytes: Bytes::from_slice(&bytes).unwrap(),
    })
}

fn any_inspection() -> impl Strategy<Value = Inspection> {
    let register =
        any::<(u16, u16, u16)>().prop_map(|(address, written, found)| DifferentRegister {
            address,
            written,
            found,
        });
    let different = proptest::collection::vec(register, 0..=DIFFERENT_REGISTERS);
    let numbers = any::<(u16, u16, u16, u32, u32, u32, u16)>();
    (numbers, different).prop_map(
        |((silicon, camera_id, registers, frame, exposure, longest, gain), different)| Inspection {
            silicon,
            camera_id,
            registers,
            different: different.into_iter().collect(),
            frame_time_us: frame,
            exposure_us: exposure,
            longest_exposure_us: longest,
            gain_sixteenths: Q::from_bits(gain),
        },
    )
}

fn any_report() -> impl Strategy<Value = SettingsReport> {
    let found = prop_oneof![
        Just(Found::Nothing),
        Just(Found::Settings),
        Just(Found::AnotherVersion)
    ];
    let used = (
        any_string(),
        any_threshold(),
        proptest::option::of(any_rest()),
        any_temporal(),
    );
    let numbers = any::<([u32; 2], i32, Option<u16>, Option<i32>)>();
    let others = (any_camera_report(), any_down(), any_contact_shape());
    (used, any_selection(), found, numbers, others).prop_map(
        |(
            (name, threshold, tare, temporal),
            kept,
            found,
            ([erases, failures], rezeroed, seen, drift),
            (camera, down, contact_shape),
        )| {
            SettingsReport {
                name,
                threshold,
                tare,
                kept,
                found,
                erases,
                failures,
                temporal,
                rezeroed: Px(rezeroed),
                seen: seen.map(MilliPx),
                drift: drift.map(Px),
                camera,
                down,
                contact_shape,
            }
        },
    )
}

fn any_health() -> impl Strategy<Value = Health> {
    let reset = prop_oneof![
        Just(ResetReason::PowerOn),
        Just(ResetReason::BrownOut),
        Just(ResetReason::Pin),
        Just(ResetReason::Software),
        Just(ResetReason::Watchdog),
        Just(ResetReason::Other)
    ];
    let rest = any::<(Option<i16>, u32, u32, [u32; 2])>();
    let brown_out = proptest::sample::select(&BrownOut::ALL[..]);
    (reset, rest, brown_out, proptest::option::of(any_failure())).prop_map(
        |(reset, (temperature_centidegrees, used, bytes, [problems, at_start]), level, failure)| {
            Health {
                reset,
                temperature_centidegrees,
                stack_used: used,
                stack_bytes: bytes,
                problems,
                at_start,
                brown_out: level,
                failure,
            }
        },
    )
}

fn any_failure() -> impl Strategy<Value = Failure> {
    let kind = proptest::sample::select(&FailureKind::ALL[..]);
    let numbers = any::<([u32; 3], [Option<u32>; 3], u16)>();
    (kind, numbers, "[ -~]{0,48}").prop_map(
        |(
            kind,
            ([starts_ago, count, fault_status], [program_counter, link, address], exception),
            place,
        )| {
            Failure {
                kind,
                starts_ago,
                count,
                program_counter,
                link_register: link,
                address,
                fault_status,
                exception,
                place: String::try_from(place.as_str()).unwrap(),
            }
        },
    )
}

fn any_tared() -> impl Strategy<Value = TareReport> {
    let moved = any::<[i32; 6]>().prop_map(|[farthest, x, y, turn, larger, beside]| Moved {
        farthest: Px(farthest),
        shift: (Px(x), Px(y)),
        turn: MilliDegrees(turn),
        larger: Q::from_bits(larger),
        beside: Px(beside),
    });
    let moved = proptest::option::of(moved);
    (any_rest(), any::<i32>(), moved).prop_map(|(rest, spread, moved)| TareReport {
        rest,
        spread: Px(spread),
        moved,
    })
}

fn any_selection() -> impl Strategy<Value = Selection> {
    any::<[bool; 7]>().prop_map(
        |[name, threshold, tare, temporal, camera, down, contact_shape]| Selection {
            name,
            threshold,
            tare,
            temporal,
            camera,
            down,
            contact_shape,
        },
    )
}

/// Any gravity, including invalid directions.
pub fn any_down() -> impl Strategy<Value = Down> {
    let told = any::<[i16; 3]>().prop_map(|parts| Down::Told(Direction(parts)));
    prop_oneof![Just(Down::Fixed), Just(Down::Unknown), told]
}

/// Any shape of what presses, including radii that are not allowed.
pub fn any_contact_shape() -> impl Strategy<Value = ContactShape> {
    let radius = || any::<u32>().prop_map(Micrometres);
    prop_oneof![
        Just(ContactShape::Needle),
        radius().prop_map(ContactShape::Round),
        radius().prop_map(ContactShape::Flat),
        Just(ContactShape::Unknown),
    ]
}

/// Any camera settings.
pub fn any_camera() -> impl Strategy<Value = CameraSettings> {
    let rate = any::<prop::sample::Index>().prop_map(|nth| *nth.get(&Rate::ALL));
    let white = any::<Option<(u8, u8)>>();
    let numbers = any::<(Option<u32>, Option<u16>)>();
    (numbers, rate, white).prop_map(|((exposure, gain), rate, white)| CameraSettings {
        exposure: exposure.map(Microseconds),
        gain: gain.map(Sixteenths),
        rate,
        white: white.map(|(red, blue)| White { red, blue }),
    })
}

fn any_camera_report() -> impl Strategy<Value = CameraReport> {
    let limits = any::<[(u16, [u32; 2]); 3]>();
    (any_camera(), any::<(u32, u16)>(), limits).prop_map(|(settings, (exposure, gain), limits)| {
        let limits =
            limits.map(|(frames, exposures)| RateLimits::new(frames, exposures.map(Microseconds)));
        CameraReport {
            settings,
            exposure: Microseconds(exposure),
            gain: Sixteenths(gain),
            limits: CameraLimits(limits),
        }
    })
}

/// Any temporal settings.
pub fn any_temporal() -> impl Strategy<Value = TemporalSettings> {
    let filter = prop_oneof![
        Just(Filter::None),
        Just(Filter::MedianOfThree),
        any::<u32>().prop_map(|ms| Filter::LowPass {
            time_constant: Milliseconds(ms)
        }),
    ];
    let rezero = proptest::option::of(any::<(u32, u16, u16)>());
    let creep = any::<[u8; 2]>();
    let output = prop_oneof![
        Just(Output::Off),
        Just(Output::Contact),
        Just(Output::Slip),
        any::<u32>().prop_map(|un| Output::Force {
            limit: UnsignedMicroNewtons(un)
        }),
    ];
    let followed = (filter, rezero, creep, output);
    (any::<[u32; 4]>(), any::<u16>(), followed).prop_map(
        |([begins, ends, distance, within], ratio, (filter, rezero, creep, output))| {
            TemporalSettings {
                contact: ContactLimits {
                    begins: UnsignedMicroNewtons(begins),
                    ends: UnsignedMicroNewtons(ends),
                },
                slip: SlipLimits {
                    distance: Micrometres(distance),
                    within: Milliseconds(within),
                    ratio: Permille(ratio),
                },
                filter,
                rezero: rezero.map(|(after, rate, total)| Rezero {
                    after: Milliseconds(after),
                    rate: MilliPx(rate),
                    total: MilliPx(total),
                }),
                creep: Creep {
                    parts: creep.map(SmallPermille),
                },
                output,
            }
        },
    )
}

/// Any rest position.
pub fn any_rest() -> impl Strategy<Value = RestPosition> {
    let formats = [PixelFormat::Rgb565, PixelFormat::Yuv422, PixelFormat::Mono];
    let format = any::<prop::sample::Index>().prop_map(move |nth| *nth.get(&formats));
    let seen = (format, any_down());
    (seen, any::<(u8, bool, i32, i32, i64)>(), any_markers()).prop_map(
        |((format, down), (dilations, weighted, x, y, rect_area), markers)| RestPosition {
            format,
            dilations,
            centroid: match weighted {
                true => CentroidEstimator::RednessWeighted,
                false => CentroidEstimator::BinaryMask,
            },
            markers,
            rect_center: (Px(x), Px(y)),
            rect_area: Q::from_bits(rect_area),
            down: down.direction(),
        },
    )
}

/// Any threshold, including invalid ones.
pub fn any_threshold() -> impl Strategy<Value = Threshold> {
    prop_oneof![
        any_box().prop_map(Threshold::Rgb565),
        any::<u8>().prop_map(|cr_low| Threshold::Yuv422(Yuv422 { cr_low })),
        any::<[u8; 2]>().prop_map(|[low, high]| Threshold::Mono(Mono { low, high })),
    ]
}

fn any_box() -> impl Strategy<Value = HsvBox> {
    any::<[u8; 6]>().prop_map(HsvBox::of_limits)
}

/// Text of any characters that fits.
fn any_string<const N: usize>() -> impl Strategy<Value = String<N>> {
    proptest::collection::vec(any::<char>(), 0..=N).prop_map(|characters| {
        let mut text = String::new();
        for character in characters {
            if text.push(character).is_err() {
                break;
            }
        }
        text
    })
}
