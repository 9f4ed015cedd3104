//! Tests of the wire format's golden vectors, `tests/vectors/wire.json`. An implementation that
//! shares no code with the Rust one made them. They equal what `hivtac-wire` writes and reads, what
//! `docs/wire.md` quotes, and `tests/vectors/wire-annotated.txt`.

use hivtac_terms::camera::{CameraLimits, CameraSettings, Rate, RateLimits, White};
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::{Direction, Down};
use hivtac_terms::fixed::Q;
use hivtac_terms::force::{ContactList, Force, Place, Torque};
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{Creep, Filter, Output, Rezero, TemporalSettings};
use hivtac_terms::threshold::{HsvBox, Mono, PixelFormat, Threshold, Yuv422};
use hivtac_terms::units::{
    MicroNewtons, Micrometres, Microseconds, MilliDegrees, MilliPx, Milliseconds, NanoNewtonMetres,
    Px, SignedMicrometres, Sixteenths, SmallPermille, UnsignedMicroNewtons, UnsignedMilliDegrees,
    UnsignedNanoNewtonMetres,
};
use hivtac_wire::decoder::{Decoder, Received, Rejected};
use hivtac_wire::failure::{Failure, FailureKind};
use hivtac_wire::frame::{DEVICE_FRAME_LIMIT, HOST_FRAME_LIMIT, MAX_SAMPLE_FRAME, Message, encode};
use hivtac_wire::health::{BrownOut, Health, Problem, ResetReason};
use hivtac_wire::message::*;
use hivtac_wire::settings::*;
use hivtac_wire::version::{HelloPrefix, SCHEMA_HASH};
use serde_json::Value;
use std::collections::BTreeMap;

const VECTORS: &str = include_str!("../vectors/wire.json");
const ANNOTATED: &str = include_str!("../vectors/wire-annotated.txt");
const DOCUMENT: &str = include_str!("../../docs/wire.md");

fn vectors() -> Value {
    serde_json::from_str(VECTORS).expect("tests/vectors/wire.json is JSON")
}

/// Returns the bytes of hexadecimal text without its `#` comments.
fn bytes_of(text: &str) -> Vec<u8> {
    let codes = text
        .lines()
        .flat_map(|line| line.split('#').next().unwrap().split_whitespace());
    codes
        .map(|code| u8::from_str_radix(code, 16).unwrap_or_else(|_| panic!("{code:?} is no byte")))
        .collect()
}

fn hex(value: &Value) -> Vec<u8> {
    bytes_of(value.as_str().expect("a string of hexadecimal bytes"))
}

/// Returns the frames of one section of the vectors by name.
fn frames(section: &str) -> BTreeMap<String, Vec<u8>> {
    let all = vectors();
    let section = all[section].as_object().expect("a section");
    section
        .iter()
        .map(|(name, frame)| (name.clone(), hex(frame)))
        .collect()
}

const RED: Threshold = Threshold::Rgb565(HsvBox::of_limits([170, 10, 100, 255, 45, 255]));
/// Usual limits with a low-pass and re-zeroing.
const OWN: TemporalSettings = TemporalSettings {
    filter: Filter::LowPass {
        time_constant: Milliseconds(20),
    },
    rezero: Some(Rezero {
        after: Milliseconds(10_000),
        rate: MilliPx(5),
        total: MilliPx(100),
    }),
    creep: Creep {
        parts: [SmallPermille(31), SmallPermille(42)],
    },
    output: Output::Force {
        limit: UnsignedMicroNewtons(200_000),
    },
    ..TemporalSettings::USUAL
};
const RED_CR: Threshold = Threshold::Yuv422(Yuv422 { cr_low: 162 });

fn hello(
    model: Option<ModelIdentity>,
    threshold: Threshold,
    name: &str,
    filter: Filter,
) -> DeviceMessage {
    DeviceMessage::Hello(DeviceHello {
        protocol: PROTOCOL_VERSION,
        schema: SCHEMA_HASH,
        device_id: [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12],
        board: "weact-h743 + ov7725".try_into().unwrap(),
        firmware: "hivtac 0.1.0".try_into().unwrap(),
        model,
        width: 320,
        height: 240,
        threshold,
        preset: "ov7725".try_into().unwrap(),
        dilations: 1,
        centroid: CentroidEstimator::RednessWeighted,
        name: name.try_into().unwrap(),
        filter,
    })
}

fn model(threshold: Threshold) -> ModelIdentity {
    ModelIdentity {
        crc: 0xcafe_f00d,
        name: "11-64-64-3 ov7725".try_into().unwrap(),
        markers: 4,
        simulated: true,
        threshold,
        source: ModelSource::Kept,
    }
}

fn sample(status: Status, place: Option<Place>) -> DeviceMessage {
    sample_of(status, place, MarkerList::default())
}

fn sample_of(status: Status, place: Option<Place>, markers: MarkerList) -> DeviceMessage {
    let force = Force {
        alpha: MilliDegrees(-5000),
        beta: MilliDegrees(2500),
        magnitude: MicroNewtons(100_000),
        cartesian: [-8707, 4362, -99_525].map(MicroNewtons),
        direction_sigma: UnsignedMilliDegrees(480),
        magnitude_sigma: UnsignedMicroNewtons(900),
        place,
        torque: None,
    };
    DeviceMessage::Sample(Sample {
        sequence: 41,
        frame: 42,
        time_us: 1_400_000,
        status,
        force: Some(force),
        contacts: ContactList::default(),
        markers,
    })
}

const PLACE: Place = Place {
    x: SignedMicrometres(1250),
    y: SignedMicrometres(-730),
    sigma: Micrometres(85),
};

fn sample_with_eight_markers() -> DeviceMessage {
    let status = Status::NOT_CALIBRATED | Status::CONTACT;
    let mut message = sample_of(status, Some(PLACE), eight_markers());
    if let DeviceMessage::Sample(Sample {
        force: Some(force), ..
    }) = &mut message
    {
        force.torque = Some(Torque {
            z: NanoNewtonMetres(-21_000),
            sigma: UnsignedNanoNewtonMetres(3_100),
        });
    }
    message
}

/// A sample of two contacts; `are_apart` if each is known.
fn sample_of_two(are_apart: bool) -> DeviceMessage {
    let contact = |size, vector: [i32; 3], sigmas: [u32; 2], [x, y]: [i32; 2], around| Force {
        alpha: MilliDegrees(-5000),
        beta: MilliDegrees(2500),
        magnitude: MicroNewtons(size),
        cartesian: vector.map(MicroNewtons),
        direction_sigma: UnsignedMilliDegrees(sigmas[0]),
        magnitude_sigma: UnsignedMicroNewtons(sigmas[1]),
        place: Some(Place {
            x: SignedMicrometres(x),
            y: SignedMicrometres(y),
            sigma: Micrometres(around),
        }),
        torque: None,
    };
    let status = Status::NOT_CALIBRATED | Status::CONTACT | Status::TWO_CONTACTS;
    let mut message = sample(status, Some(PLACE));
    if let DeviceMessage::Sample(sample) = &mut message
        && are_apart
    {
        let (one, other) = ([-3483, 1745, -39_810], [-5224, 2617, -59_715]);
        sample.contacts = ContactList::from([
            contact(40_000, one, [2900, 1800], [3250, -730], 110),
            contact(60_000, other, [2600, 1900], [-83, -730], 95),
        ]);
    }
    message
}

fn sample_without_force(frame: u32, status: Status) -> DeviceMessage {
    DeviceMessage::Sample(Sample {
        sequence: 300,
        frame,
        time_us: 10_000_000,
        status,
        force: None,
        contacts: ContactList::default(),
        markers: MarkerList::default(),
    })
}

fn sample_with_markers() -> DeviceMessage {
    let marker = |x, y, area| Marker {
        x: Px(x),
        y: Px(y),
        area,
    };
    DeviceMessage::Sample(Sample {
        sequence: 7,
        frame: 8,
        time_us: 300_000,
        status: Status::MODEL_MISSING,
        force: None,
        contacts: ContactList::default(),
        markers: MarkerList::from([
            marker(6_553_600, 3_932_160, 190),
            marker(14_417_921, 3_932_159, 191),
            marker(14_417_920, 11_796_480, 189),
            marker(6_553_600, 11_796_480, 190),
        ]),
    })
}

fn eight_markers() -> MarkerList {
    let marker = |(x, y, area)| Marker {
        x: Px(x),
        y: Px(y),
        area,
    };
    let seen = [
        (2_621_440, 2_949_120, 160),
        (18_350_081, 2_949_119, 161),
        (18_350_080, 12_779_520, 159),
        (2_621_440, 12_779_520, 160),
        (7_208_960, 7_864_320, 172),
        (13_762_560, 7_864_321, 173),
        (10_485_760, 4_718_592, 171),
        (10_485_759, 11_010_048, 172),
    ];
    MarkerList::from(seen.map(marker))
}

fn stats() -> DeviceMessage {
    DeviceMessage::Stats(Stats {
        frames_exposed: 1000,
        frames_processed: 990,
        dropped_busy: 7,
        dropped_overrun: 2,
        dropped_size: 1,
        dropped_setup: 12,
        camera_timeouts: 0,
        camera_restarts: 0,
        capture_overruns: 2,
        usb_dropped: 130,
        host_frames_rejected: 0,
        processing_us: 5300,
        latency_us: 4800,
        uptime_us: 34_000_000,
    })
}

fn log() -> DeviceMessage {
    DeviceMessage::Log(LogLine {
        level: LogLevel::Warning,
        time_us: 2_500_000,
        text: "camera silent, restarting".try_into().unwrap(),
    })
}

fn reply(id: u16, outcome: Outcome) -> DeviceMessage {
    DeviceMessage::Reply(Reply { id, outcome })
}

fn snapshot() -> DeviceMessage {
    DeviceMessage::Snapshot(Snapshot {
        frame: 8,
        time_us: 300_000,
        width: 320,
        height: 240,
        threshold: RED,
        bytes: 153_600,
    })
}

fn snapshot_part() -> DeviceMessage {
    DeviceMessage::SnapshotPart(SnapshotPart {
        offset: 153_596,
        bytes: [0xD8, 0xA3, 0xD8, 0xA3].as_slice().try_into().unwrap(),
    })
}

fn inspection() -> DeviceMessage {
    let green = DifferentRegister {
        address: 0x03,
        written: 0x40,
        found: 0,
    };
    DeviceMessage::Inspection(Inspection {
        silicon: 0x2003,
        camera_id: 0x7721,
        registers: 56,
        different: [green].as_slice().try_into().unwrap(),
        frame_time_us: 6_405,
        exposure_us: 5_922,
        longest_exposure_us: 6_405,
        gain_sixteenths: Q::from_bits(24),
    })
}

fn rest() -> RestPosition {
    let marker = |x, y| Marker {
        x: Px(x),
        y: Px(y),
        area: 190,
    };
    RestPosition {
        format: PixelFormat::Rgb565,
        dilations: 1,
        centroid: CentroidEstimator::RednessWeighted,
        markers: MarkerList::from([
            marker(6_553_600, 3_932_160),
            marker(14_417_920, 3_932_160),
            marker(14_417_920, 11_796_480),
            marker(6_553_600, 11_796_480),
        ]),
        rect_center: (Px(10_485_760), Px(7_864_320)),
        rect_area: Q::from_int(14_400),
        down: Some(DOWN),
    }
}

/// Direction of gravity.
const DOWN: Direction = Direction([0, 600, -800]);

const ROUND: ContactShape = ContactShape::Round(Micrometres(1_500));
const FLAT: ContactShape = ContactShape::Flat(Micrometres(2_000));

const NAME_AND_TARE: Selection = Selection {
    name: true,
    threshold: false,
    tare: true,
    temporal: true,
    camera: true,
    down: false,
    contact_shape: true,
};

const CAMERA: CameraSettings = CameraSettings {
    exposure: Some(Microseconds(2_500)),
    gain: None,
    rate: Rate::Half,
    white: Some(White { red: 76, blue: 132 }),
};

fn camera() -> CameraReport {
    CameraReport {
        settings: CAMERA,
        exposure: Microseconds(2_512),
        gain: Sixteenths(24),
        limits: CameraLimits([
            RateLimits::new(156, [24, 6_405].map(Microseconds)),
            RateLimits::new(78, [47, 12_810].map(Microseconds)),
            RateLimits::new(39, [93, 25_620].map(Microseconds)),
        ]),
    }
}

fn settings() -> DeviceMessage {
    DeviceMessage::Settings(SettingsReport {
        name: "thumb".try_into().unwrap(),
        threshold: RED,
        tare: Some(rest()),
        kept: NAME_AND_TARE,
        found: Found::Settings,
        erases: 3,
        failures: 0,
        temporal: OWN,
        rezeroed: Px(1_311),
        seen: Some(MilliPx(100)),
        drift: Some(Px(20_316)),
        camera: camera(),
        down: Down::Told(DOWN),
        contact_shape: FLAT,
    })
}

fn health() -> DeviceMessage {
    DeviceMessage::Health(Health {
        reset: ResetReason::Watchdog,
        temperature_centidegrees: Some(4_150),
        stack_used: 6_120,
        stack_bytes: 24_576,
        problems: Problem::ModelFallback.bit() | Problem::WatchdogReset.bit(),
        at_start: Problem::ModelFallback.bit() | Problem::Arithmetic.bit(),
        brown_out: BrownOut::Off,
        failure: None,
    })
}

/// A bus error in an interrupt's handler, in the run before this one, and a panic before that.
fn health_after_a_failure() -> DeviceMessage {
    DeviceMessage::Health(Health {
        reset: ResetReason::Software,
        temperature_centidegrees: Some(4_150),
        stack_used: 6_120,
        stack_bytes: 24_576,
        problems: Problem::SoftwareReset.bit(),
        at_start: Problem::SoftwareReset.bit(),
        brown_out: BrownOut::High,
        failure: Some(Failure {
            kind: FailureKind::BusFault,
            starts_ago: 1,
            count: 2,
            program_counter: Some(0x0806_1234),
            link_register: Some(0x0806_0ABD),
            address: Some(0x2600_0000),
            fault_status: 0x8200,
            exception: 69,
            place: "".try_into().unwrap(),
        }),
    })
}

fn health_after_a_panic() -> DeviceMessage {
    let DeviceMessage::Health(health) = health_after_a_failure() else {
        unreachable!("it is one");
    };
    DeviceMessage::Health(Health {
        failure: Some(Failure {
            kind: FailureKind::Panic,
            starts_ago: 3,
            count: 1,
            program_counter: None,
            link_register: None,
            address: None,
            fault_status: 0,
            exception: 0,
            place: "firmware/src/usb.rs:123".try_into().unwrap(),
        }),
        ..health
    })
}

/// A camera that moved: 0.2 px to the right and 0.1 px up, by 12 m° and 0.3 %.
const MOVED: Moved = Moved {
    farthest: Px(20_316),
    shift: (Px(13_107), Px(-6_554)),
    turn: MilliDegrees(12),
    larger: Q::from_bits(197),
    beside: Px(524),
};

fn tared() -> DeviceMessage {
    DeviceMessage::Tared(TareReport {
        rest: rest(),
        spread: Px(789),
        moved: Some(MOVED),
    })
}

fn device_messages() -> BTreeMap<String, DeviceMessage> {
    let out_of_range = Status::MAGNITUDE_OUT_OF_RANGE | Status::DIRECTION_OUT_OF_RANGE;
    [
        (
            "device-hello",
            hello(Some(model(RED)), RED, "thumb", OWN.filter),
        ),
        (
            "device-hello-yuv422",
            hello(Some(model(RED_CR)), RED_CR, "thumb", Filter::None),
        ),
        (
            "device-hello-without-model",
            hello(None, RED, "", Filter::None),
        ),
        (
            "sample-force",
            sample(Status::NOT_CALIBRATED | Status::CONTACT, Some(PLACE)),
        ),
        (
            "sample-slip",
            sample(
                Status::NOT_CALIBRATED | Status::CONTACT | Status::SLIP,
                Some(PLACE),
            ),
        ),
        (
            "sample-rezeroed",
            sample(Status::CONTACT | Status::REZEROED, Some(PLACE)),
        ),
        (
            "sample-without-place",
            sample(out_of_range | Status::CONTACT, None),
        ),
        (
            "sample-unexplained",
            sample_without_force(301, Status::UNEXPLAINED),
        ),
        (
            "sample-without-force",
            sample_without_force(305, Status::MARKERS_MISSING | Status::FRAME_DROPPED),
        ),
        ("sample-two-contacts", sample_of_two(true)),
        ("sample-sum-of-two", sample_of_two(false)),
        ("sample-with-markers", sample_with_markers()),
        ("sample-with-eight-markers", sample_with_eight_markers()),
        ("stats", stats()),
        ("log", log()),
        ("reply-done", reply(7, Outcome::Done)),
        (
            "reply-no-good-frames",
            reply(u16::MAX, Outcome::NoGoodFrames),
        ),
        ("reply-unsupported", reply(200, Outcome::Unsupported)),
        (
            "reply-markers-implausible",
            reply(7, Outcome::MarkersImplausible),
        ),
        ("reply-unsteady", reply(7, Outcome::Unsteady)),
        ("reply-not-read", reply(300, Outcome::NotRead)),
        ("snapshot", snapshot()),
        ("snapshot-part", snapshot_part()),
        ("reply-no-camera", reply(10, Outcome::NoCamera)),
        ("inspection", inspection()),
        ("settings", settings()),
        ("tared", tared()),
        ("health", health()),
        ("health-after-a-failure", health_after_a_failure()),
        ("health-after-a-panic", health_after_a_panic()),
        (
            "reply-touched",
            reply(
                7,
                Outcome::Touched {
                    looks_like: MicroNewtons(1_043),
                },
            ),
        ),
        ("reply-worn", reply(14, Outcome::Worn)),
        ("reply-model-unusable", reply(18, Outcome::ModelUnusable)),
        ("reply-another-sensor", reply(18, Outcome::AnotherSensor)),
    ]
    .map(|(name, message)| (name.to_owned(), message))
    .into()
}

fn model_part() -> ModelPart {
    ModelPart {
        offset: 57_972,
        bytes: [0x0D, 0xF0, 0xFE, 0xCA].as_slice().try_into().unwrap(),
    }
}

fn host_messages() -> BTreeMap<String, HostMessage> {
    let median = TemporalSettings {
        filter: Filter::MedianOfThree,
        rezero: None,
        ..TemporalSettings::USUAL
    };
    let command = |id, request| HostMessage::Command(Command { id, request });
    [
        ("host-hello", HostMessage::Hello(HelloPrefix::OURS.into())),
        ("down-told", HostMessage::Down(Down::Told(DOWN))),
        ("down-unknown", HostMessage::Down(Down::Unknown)),
        ("down-fixed", HostMessage::Down(Down::Fixed)),
        ("get-info", command(1, Request::GetInfo)),
        ("start", command(2, Request::Start)),
        ("stop", command(3, Request::Stop)),
        ("set-threshold", command(200, Request::SetThreshold(RED))),
        (
            "set-threshold-yuv422",
            command(200, Request::SetThreshold(RED_CR)),
        ),
        (
            "set-threshold-mono",
            command(
                200,
                Request::SetThreshold(Threshold::Mono(Mono { low: 0, high: 88 })),
            ),
        ),
        ("tare", command(7, Request::Tare { frames: 128 })),
        ("start-with-markers", command(2, Request::StartWithMarkers)),
        ("expose", command(9, Request::Expose)),
        ("take-snapshot", command(300, Request::Snapshot)),
        ("inspect", command(10, Request::Inspect)),
        ("get-settings", command(11, Request::GetSettings)),
        (
            "set-name",
            command(12, Request::SetName("thumb".try_into().unwrap())),
        ),
        ("set-tare", command(13, Request::SetTare(Some(rest())))),
        ("forget-tare", command(13, Request::SetTare(None))),
        ("set-temporal", command(15, Request::SetTemporal(OWN))),
        (
            "set-temporal-usual",
            command(15, Request::SetTemporal(TemporalSettings::USUAL)),
        ),
        (
            "set-temporal-median",
            command(15, Request::SetTemporal(median)),
        ),
        ("keep", command(14, Request::Keep(NAME_AND_TARE))),
        (
            "begin-model",
            command(16, Request::BeginModel { bytes: 57_976 }),
        ),
        ("model-part", command(17, Request::ModelPart(model_part()))),
        ("use-model", command(18, Request::UseModel)),
        ("use-built-in-model", command(19, Request::UseBuiltInModel)),
        ("reset", command(20, Request::Reset)),
        ("get-health", command(21, Request::GetHealth)),
        ("start-loader", command(22, Request::StartLoader)),
        ("set-camera", command(23, Request::SetCamera(CAMERA))),
        (
            "set-camera-automatic",
            command(23, Request::SetCamera(CameraSettings::default())),
        ),
        (
            "set-contact-shape-needle",
            command(24, Request::SetContactShape(ContactShape::Needle)),
        ),
        (
            "set-contact-shape-round",
            command(24, Request::SetContactShape(ROUND)),
        ),
        (
            "set-contact-shape-flat",
            command(24, Request::SetContactShape(FLAT)),
        ),
        (
            "set-contact-shape-unknown",
            command(24, Request::SetContactShape(ContactShape::Unknown)),
        ),
        (
            "tare-anyway",
            command(7, Request::TareAnyway { frames: 128 }),
        ),
    ]
    .map(|(name, message)| (name.to_owned(), message))
    .into()
}

fn decode<M: Message>(bytes: &[u8]) -> (Vec<Received<M>>, Rejected) {
    let mut decoder = Decoder::<DEVICE_FRAME_LIMIT>::new();
    let mut rest = bytes;
    let messages = std::iter::from_fn(|| decoder.feed(&mut rest)).collect();
    (messages, decoder.rejected())
}

/// Checks that every message gives its vector, and every vector its message.
fn check_both_ways<M: Message + Clone + PartialEq + std::fmt::Debug>(
    messages: BTreeMap<String, M>,
    frames: BTreeMap<String, Vec<u8>>,
) {
    assert!(
        messages.keys().eq(frames.keys()),
        "{:?} {:?}",
        messages.keys(),
        frames.keys()
    );
    for (name, message) in messages {
        let mut buffer = [0; DEVICE_FRAME_LIMIT];
        let written = encode(&message, &mut buffer).expect("it fits");
        assert_eq!(written, frames[&name], "{name}");
        let read = decode(&frames[&name]);
        assert_eq!(
            read,
            (vec![Received::Message(message)], Rejected::default()),
            "{name}"
        );
    }
}

#[test]
fn device_messages_are_their_vectors() {
    check_both_ways(device_messages(), frames("device"));
}

#[test]
fn host_messages_are_their_vectors() {
    check_both_ways(host_messages(), frames("host"));
}

#[test]
fn every_kind_of_message_has_a_vector() {
    let devices = device_messages();
    let kinds: Vec<_> = devices.values().map(std::mem::discriminant).collect();
    let distinct: std::collections::HashSet<_> = kinds.into_iter().collect();
    assert_eq!(distinct.len(), 11);
    let hosts = host_messages();
    let requests: std::collections::HashSet<_> = hosts
        .values()
        .filter_map(|message| match message {
            HostMessage::Command(command) => Some(std::mem::discriminant(&command.request)),
            HostMessage::Hello(_) | HostMessage::Down(_) => None,
        })
        .collect();
    assert_eq!(requests.len(), 24);
}

/// The hellos are of an earlier and of a later version: both sides read the sender's version, and
/// nothing else.
#[test]
fn foreign_hellos_are_named() {
    let of_version_1 = (1, 0xe67e_c004_10f1_123b);
    let expected = [
        ("device-hello-version-1", of_version_1),
        ("foreign-hello", (3, 0x1122_3344_5566_7788)),
        ("host-hello-version-1", of_version_1),
    ];
    let frames = frames("foreign");
    assert!(frames.keys().eq(expected.map(|(name, _)| name)));
    for (name, (protocol, schema)) in expected {
        let prefix = HelloPrefix { protocol, schema };
        let as_host = decode::<DeviceMessage>(&frames[name]);
        let expected = (vec![Received::ForeignHello(prefix)], Rejected::default());
        assert_eq!(as_host, expected, "{name}");
        let as_device = decode::<HostMessage>(&frames[name]);
        let expected = (vec![Received::ForeignHello(prefix)], Rejected::default());
        assert_eq!(as_device, expected, "{name}");
    }
}

/// The bytes of this version's hello that every other version reads: 0, version, schema, at fixed
/// places.
#[test]
fn both_hellos_begin_as_in_every_version() {
    let mut start = vec![0, PROTOCOL_VERSION as u8];
    let mut schema = SCHEMA_HASH;
    while schema >= 0x80 {
        start.push(schema as u8 | 0x80);
        schema >>= 7;
    }
    start.push(schema as u8);
    for (section, name) in [("device", "device-hello"), ("host", "host-hello")] {
        let content = remove_cobs(&frames(section)[name]);
        assert!(content.starts_with(&start), "{name}");
    }
}

#[test]
fn rejected_frames_are_counted_by_cause() {
    let all = vectors();
    for (name, entry) in all["rejected"].as_object().unwrap() {
        let frame = hex(&entry["frame"]);
        let bytes = frame.len() as u32 - 1;
        let mut expected = Rejected {
            bytes,
            ..Rejected::default()
        };
        *match entry["cause"].as_str().unwrap() {
            "overlong" => &mut expected.overlong,
            "cobs" => &mut expected.cobs,
            "crc" => &mut expected.crc,
            "body" => &mut expected.body,
            "trailing" => &mut expected.trailing,
            cause => panic!("{name}: {cause} is no cause"),
        } = 1;
        assert_eq!(
            decode::<DeviceMessage>(&frame),
            (vec![], expected),
            "{name}"
        );
    }
}

#[test]
fn a_stream_with_garbage_is_read_and_counted() {
    let all = vectors();
    let stream = &all["stream"];
    let (messages, rejected) = decode::<DeviceMessage>(&hex(&stream["bytes"]));
    let known = device_messages();
    let names = stream["messages"]
        .as_array()
        .unwrap()
        .iter()
        .map(|name| name.as_str().unwrap());
    let expected: Vec<_> = names
        .map(|name| Received::Message(known[name].clone()))
        .collect();
    assert_eq!(messages, expected);
    let count = |cause: &str| stream["rejected"][cause].as_u64().unwrap() as u32;
    let expected = Rejected {
        cobs: count("cobs"),
        crc: count("crc"),
        bytes: count("bytes"),
        ..Rejected::default()
    };
    assert_eq!(rejected, expected);
}

#[test]
fn vectors_and_document_name_this_version() {
    let all = vectors();
    let hash = format!("{SCHEMA_HASH:#018x}");
    assert_eq!(all["protocol"], PROTOCOL_VERSION);
    assert_eq!(all["schema"], hash);
    assert!(DOCUMENT.contains(&format!("Protocol version **{PROTOCOL_VERSION}**")));
    assert!(DOCUMENT.contains(&format!("**{hash}**")));
}

#[test]
fn the_document_states_the_limits_of_the_code() {
    let device = <DeviceMessage as Message>::MAX_FRAME;
    let host = <HostMessage as Message>::MAX_FRAME;
    for row in [
        format!(
            "| of these, a sample's frame | {MAX_SAMPLE_FRAME} bytes | {DEVICE_FRAME_LIMIT} bytes |"
        ),
        format!("| frame from the device | {device} bytes | {DEVICE_FRAME_LIMIT} bytes |"),
        format!("| frame from the host | {host} bytes | {HOST_FRAME_LIMIT} bytes |"),
    ] {
        assert!(DOCUMENT.contains(&row), "{row}");
    }
}

/// Returns the bytes of the document's block that opens with this line.
fn quoted(opening: &str) -> Vec<u8> {
    let blocks = DOCUMENT.split("```").skip(1).step_by(2);
    let mut blocks = blocks.filter_map(|block| block.strip_prefix(opening));
    bytes_of(blocks.next().expect("the block"))
}

#[test]
fn the_document_quotes_the_vectors() {
    let frame = &frames("device")["sample-force"];
    assert_eq!(quoted("text frame sample-force\n"), *frame);
    let body = quoted("text body sample-force\n");
    assert_eq!(body, remove_cobs(frame));
}

#[test]
fn the_bytes_field_by_field_are_the_contents_of_the_frames() {
    let blocks = ANNOTATED.split("\n\n").map(|block| {
        let (name, text) = block.split_once('\n').expect("a line with the name");
        (name.to_owned(), bytes_of(text))
    });
    let sections = ["device", "host", "foreign"].map(frames);
    let frames = sections.into_iter().flatten();
    let contents = frames.map(|(name, frame)| (name, remove_cobs(&frame)));
    let contents: BTreeMap<_, _> = contents.collect();
    assert_eq!(blocks.collect::<BTreeMap<_, _>>(), contents);
}

/// Returns the content of a good frame, which is given with its closing zero.
fn remove_cobs(frame: &[u8]) -> Vec<u8> {
    let mut content = Vec::new();
    let mut rest = frame.strip_suffix(&[0]).expect("a closing zero");
    while let Some((&code, tail)) = rest.split_first() {
        let (run, next) = tail.split_at(usize::from(code) - 1);
        content.extend(run);
        if code != 0xff && !next.is_empty() {
            content.push(0);
        }
        rest = next;
    }
    content
}
