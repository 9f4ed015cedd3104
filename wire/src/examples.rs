//! Messages for tests: the longest of each kind, and random ones.

use crate::failure::*;
use crate::health::*;
use crate::message::*;
use crate::settings::*;
use crate::version::{HelloPrefix, SCHEMA_HASH};
use core::fmt::Debug;
use heapless::{String, Vec as Bytes};
use hivtac_terms::camera::{CameraLimits, CameraSettings, Rate, RateLimits, White};
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::{Direction, Down};
use hivtac_terms::fixed::Q;
use hivtac_terms::force::{ContactList, Force, MOST_CONTACTS, Place, Torque};
use hivtac_terms::marker::{MOST_MARKERS, Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{
    ContactLimits, Creep, Filter, Output, Rezero, SlipLimits, TemporalSettings,
};
use hivtac_terms::threshold::{HsvBox, PixelFormat, Threshold};
use hivtac_terms::units::{
    MicroNewtons, Micrometres, Microseconds, MilliDegrees, MilliPx, Milliseconds, NanoNewtonMetres,
    Permille, Px, SignedMicrometres, Sixteenths, SmallPermille, UnsignedMicroNewtons,
    UnsignedMilliDegrees, UnsignedNanoNewtonMetres,
};
use proptest::prelude::*;
use serde::de::DeserializeOwned;
use std::{vec, vec::Vec};

/// Numbers of kinds: of a device's messages, and of requests.
const DEVICE_KINDS: u8 = 11;
const REQUESTS: u8 = 24;

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
    torque: Some(Torque {
        z: NanoNewtonMetres(i32::MIN),
        sigma: UnsignedNanoNewtonMetres(u32::MAX),
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

/// Any value, read from these first bytes and random ones. Most of these are small, as most choose
/// a variant or say how long something is.
pub fn any_value<T: DeserializeOwned + Debug>(
    first: impl Strategy<Value = Vec<u8>>,
) -> impl Strategy<Value = T> {
    first.prop_perturb(|first, mut random| {
        loop {
            let mut bytes = [0; 160];
            random.fill_bytes(&mut bytes);
            let small = bytes.map(|byte| match byte % 16 {
                0..10 => byte >> 7,
                10..13 => byte >> 5,
                13..15 => byte >> 1,
                _ => byte,
            });
            let bytes = [&first, &small[..]].concat();
            if let Ok((value, _)) = postcard::take_from_bytes(&bytes) {
                return value;
            }
        }
    })
}

/// Any message a device of this version can send.
pub fn any_device_message() -> impl Strategy<Value = DeviceMessage> {
    any_value((0..DEVICE_KINDS).prop_map(|kind| vec![kind])).prop_map(|mut message| {
        if let DeviceMessage::Hello(hello) = &mut message {
            (hello.protocol, hello.schema) = (PROTOCOL_VERSION, SCHEMA_HASH);
        }
        message
    })
}

/// Any message a host of this version can send.
pub fn any_host_message() -> impl Strategy<Value = HostMessage> {
    let command = (0..128_u8, 0..REQUESTS).prop_map(|(id, kind)| vec![1, id, kind]);
    let first = prop_oneof![9 => command, 1 => Just(vec![0]), 1 => Just(vec![2])];
    any_value(first).prop_map(|message| match message {
        HostMessage::Hello(_) => HostMessage::Hello(HelloPrefix::OURS.into()),
        other => other,
    })
}
