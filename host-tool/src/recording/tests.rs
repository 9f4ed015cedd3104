use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::records::{MessageHeader, op};
use mcap::{MAGIC, WriteOptions, Writer};

use super::*;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::force::{ContactList, Force, Place};
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::temporal::Filter;
use hivtac_terms::threshold::{Mono, Threshold};
use hivtac_terms::units::{
    MicroNewtons, MilliDegrees, Px, SignedMicrometres, UnsignedMicroNewtons,
};
use hivtac_wire::decoder;
use hivtac_wire::frame::{MAX_DEVICE_FRAME, encode};
use hivtac_wire::message::{LogLevel, LogLine, PROTOCOL_VERSION, Sample, Stats};
use hivtac_wire::version::SCHEMA_HASH;

const ALL: [u64; 24] = {
    let mut all = [0; 24];
    let mut n = 0;
    while n < 24 {
        all[n] = n as u64;
        n += 1;
    }
    all
};

fn hello(number: u8) -> DeviceHello {
    DeviceHello {
        protocol: PROTOCOL_VERSION,
        schema: SCHEMA_HASH,
        device_id: [number; 12],
        board: "board".try_into().unwrap(),
        firmware: "firmware".try_into().unwrap(),
        model: None,
        width: 320,
        height: 240,
        threshold: Threshold::Mono(Mono { low: 0, high: 64 }),
        preset: "ov7725".try_into().unwrap(),
        dilations: 1,
        centroid: CentroidEstimator::BinaryMask,
        name: "".try_into().unwrap(),
        filter: Filter::None,
    }
}

fn frame(message: &DeviceMessage) -> Vec<u8> {
    encode(message, &mut [0; MAX_DEVICE_FRAME])
        .unwrap()
        .to_vec()
}

fn line(number: u64) -> DeviceMessage {
    let text = number.to_string();
    DeviceMessage::Log(LogLine {
        time_us: number,
        level: LogLevel::Info,
        text: text.as_str().try_into().unwrap(),
    })
}

/// A recording of devices, each with lines of these numbers, four in a chunk.
fn recorded(devices: &[u8], numbers: &[u64], has_hellos: bool) -> Vec<u8> {
    let options = WriteOptions::new().chunk_size(None).compression(None);
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let channels: Vec<u16> = devices
        .iter()
        .map(|device| channel(&mut writer, *device))
        .collect();
    let write = |writer: &mut Writer<_>, channel_id, log_time, message: &DeviceMessage| {
        let header = MessageHeader {
            channel_id,
            sequence: 0,
            log_time,
            publish_time: log_time,
        };
        let data = [&[0; BEFORE_BYTES][..], &frame(message)].concat();
        writer.write_to_known_channel(&header, &data).unwrap();
    };
    for (device, id) in devices.iter().zip(&channels).filter(|_| has_hellos) {
        write(&mut writer, *id, 0, &DeviceMessage::Hello(hello(*device)));
    }
    for four in numbers.chunks(4) {
        for number in four {
            for id in &channels {
                write(&mut writer, *id, *number, &line(*number));
            }
        }
        writer.flush().unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

fn channel(writer: &mut Writer<Cursor<Vec<u8>>>, device: u8) -> u16 {
    let metadata = [(
        HELLO.to_owned(),
        to_hex(&frame(&DeviceMessage::Hello(hello(device)))),
    )];
    let topic = format!("/unit_{device}{WIRE}");
    writer
        .add_channel(0, &topic, "cdr", &BTreeMap::from(metadata))
        .unwrap()
}

fn open(file: Vec<u8>, device: Option<&str>) -> Result<Recording, Failure> {
    Recording::of("it.mcap".to_owned(), Box::new(Cursor::new(file)), device).map(|opened| opened.0)
}

/// The times of the lines.
fn times(recording: &mut Recording) -> Vec<u64> {
    std::iter::from_fn(|| recording.next_message().unwrap())
        .map(|(came_ns, _)| came_ns)
        .collect()
}

/// The file, with the records of each chunk packed anew.
fn repacked(file: &[u8], name: &str, pack: impl Fn(&[u8]) -> Vec<u8>) -> Vec<u8> {
    let mut packed = MAGIC.to_vec();
    let mut rest = &file[MAGIC.len()..];
    while let Some((head, after)) = rest.split_first_chunk::<9>() {
        let length = u64::from_le_bytes(head[1..].try_into().unwrap()) as usize;
        let (body, after) = after.split_at(length);
        rest = after;
        match head[0] {
            op::CHUNK => {
                let records = pack(&body[40..]);
                let length = (40 + name.len() + records.len()) as u64;
                packed.push(op::CHUNK);
                packed.extend(length.to_le_bytes());
                packed.extend(&body[..28]);
                packed.extend((name.len() as u32).to_le_bytes());
                packed.extend(name.bytes());
                packed.extend((records.len() as u64).to_le_bytes());
                packed.extend(records);
            }
            op::DATA_END => break,
            _ => (),
        }
    }
    // The end of the data, and a footer without a summary.
    packed.extend([&[op::DATA_END, 4, 0, 0, 0, 0, 0, 0, 0][..], &[0; 4]].concat());
    packed.extend([&[op::FOOTER, 20, 0, 0, 0, 0, 0, 0, 0][..], &[0; 20]].concat());
    packed.extend(MAGIC);
    packed
}

#[test]
fn what_other_tools_packed_trimmed_or_merged_is_read() {
    let whole = recorded(&[1], &ALL, true);
    let lz4 = repacked(&whole, "lz4", |records| {
        let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
        std::io::Write::write_all(&mut encoder, records).unwrap();
        encoder.finish().unwrap()
    });
    let level = ruzstd::encoding::CompressionLevel::Fastest;
    let zstd = repacked(&whole, "zstd", |records| {
        ruzstd::encoding::compress_to_vec(records, level)
    });
    let trimmed = recorded(&[1], &ALL[9..], false);
    for (file, expected) in [
        (whole, &ALL[..]),
        (lz4, &ALL),
        (zstd, &ALL),
        (trimmed, &ALL[9..]),
    ] {
        let mut recording = open(file, None).unwrap();
        assert_eq!(times(&mut recording), expected);
        assert!(recording.damage().is_empty() && !recording.is_cut());
    }
    let merged = recorded(&[1, 2], &ALL, false);
    let error = open(merged.clone(), None).err().unwrap().to_string();
    assert!(error.contains("more than one sensor"), "{error}");
    let second = unit_number(&hello(2).device_id);
    assert_eq!(times(&mut open(merged, Some(&second)).unwrap()), ALL);
}

/// One flipped bit loses at most the chunk it is in, and a loss is always reported.
#[test]
fn a_flipped_bit_loses_one_chunk_at_most() {
    let whole = recorded(&[1], &ALL, true);
    // Steps that reach each bit of a byte, and each part of a record.
    for bit in (0..whole.len() * 8).step_by(11) {
        let mut file = whole.clone();
        file[bit / 8] ^= 1 << (bit % 8);
        let mut recording = open(file, None).unwrap_or_else(|error| panic!("{bit}: {error}"));
        let times = times(&mut recording);
        let lost: Vec<_> = ALL.iter().filter(|time| !times.contains(time)).collect();
        assert!(times.is_sorted() && lost.len() <= 4, "{bit}: {times:?}");
        assert!(lost.is_empty() || !recording.damage().is_empty(), "{bit}");
        assert!(!recording.is_cut(), "{bit}");
    }
}

#[test]
fn a_cut_anywhere_is_read_up_to_it() {
    let whole = recorded(&[1], &ALL, true);
    let mut before = 0;
    for length in (0..whole.len() - 1).step_by(7) {
        let Ok(mut recording) = open(whole[..length].to_vec(), None) else {
            assert_eq!(before, 0, "{length}");
            continue;
        };
        let times = times(&mut recording);
        assert!(
            times.len() >= before && ALL.starts_with(&times),
            "{length}: {times:?}"
        );
        before = times.len();
    }
    assert_eq!(before, ALL.len());
}

#[test]
fn what_is_no_recording_says_why() {
    for (file, why) in [
        (b"no recording".to_vec(), "it is no MCAP file"),
        (Vec::new(), "it is no MCAP file"),
        (recorded(&[], &[], false), "it has no topic /wire"),
    ] {
        let error = open(file, None).err().unwrap().to_string();
        assert!(error.contains(why), "{error}");
    }
}

proptest::proptest! {
    #[test]
    fn any_damage_ends(changes in proptest::collection::vec((0..6000_usize, 0..=255_u8), 1..40)) {
        let mut file = recorded(&[1], &ALL, true);
        for (at, byte) in changes {
            if let Some(place) = file.get_mut(at) {
                *place = byte;
            }
        }
        if let Ok(mut recording) = open(file, None) {
            proptest::prop_assert!(times(&mut recording).len() <= 2 * ALL.len());
        }
    }
}

/// A frame of any body.
fn framed(body: &[u8]) -> Vec<u8> {
    let content = [body, &crc32fast::hash(body).to_le_bytes()].concat();
    let parts = content.split(|byte| *byte == 0);
    // Short bodies only: no part of 254 bytes without a zero.
    let coded = parts.flat_map(|part| [&[part.len() as u8 + 1], part].concat());
    coded.chain([0]).collect()
}

fn body(message: &DeviceMessage) -> Vec<u8> {
    decoder::body(&mut frame(message).strip_suffix(&[0]).unwrap().to_vec())
        .unwrap()
        .to_vec()
}

fn sample(sequence: u32) -> Sample {
    Sample {
        sequence,
        frame: sequence / 2,
        time_us: 1 << 40,
        status: Status::CONTACT | Status::NOT_CALIBRATED,
        force: Some(Force {
            alpha: MilliDegrees(-12_345),
            magnitude: MicroNewtons(98_765),
            magnitude_sigma: UnsignedMicroNewtons(456),
            place: Some(Place {
                x: SignedMicrometres(-321),
                ..Place::default()
            }),
            ..Force::default()
        }),
        ..Sample::default()
    }
}

#[test]
fn this_releases_messages_are_read_by_their_types_as_without() {
    let types = Types::parse(&types::ours()).unwrap();
    let marker = Marker {
        x: Px(70_000),
        y: Px(-1),
        area: 80,
    };
    let samples = [
        Sample::default(),
        sample(7),
        Sample {
            contacts: ContactList::from([Force::default(); 2]),
            markers: MarkerList::from([marker; 4]),
            ..sample(u32::MAX)
        },
    ];
    let stats = Stats {
        latency_us: 4321,
        uptime_us: u64::MAX,
        ..Stats::default()
    };
    let others = [
        DeviceMessage::Stats(stats),
        DeviceMessage::Hello(hello(9)),
        line(5),
    ];
    for message in samples.map(DeviceMessage::Sample).into_iter().chain(others) {
        assert_eq!(types.message(&frame(&message)), Some(message));
    }
}

/// Another release: its sample begins with a number that this one does not know, and has no
/// contacts; its stats have another name.
fn other_types() -> serde_json::Value {
    let mut types: serde_json::Value = serde_json::from_str(&types::ours()).unwrap();
    let variants = types["ty"]["Enum"].as_array_mut().unwrap();
    let fields = variants[1]["ty"]["NewtypeVariant"]["ty"]["Struct"].as_array_mut();
    let fields = fields.unwrap();
    fields.retain(|field| field["name"] != "contacts");
    let unknown = serde_json::json!({ "name": "warmth", "ty": { "name": "u8", "ty": "U8" } });
    fields.insert(0, unknown);
    variants[2]["name"] = "Counters".into();
    types
}

/// The body of a message of that release.
fn other_body(message: &DeviceMessage) -> Vec<u8> {
    let mut body = body(message);
    match message {
        DeviceMessage::Hello(hello) => {
            let ours = postcard_varint(hello.schema);
            let at = body.windows(ours.len()).position(|it| it == ours).unwrap();
            body.splice(at..at + ours.len(), postcard_varint(0x1234_5678_9abc_def0));
        }
        DeviceMessage::Sample(_) => {
            // Its end are two empty lists: contacts and markers.
            assert!(body.ends_with(&[0, 0]), "{body:?}");
            body.pop();
            body.insert(1, 37);
        }
        _ => (),
    }
    body
}

fn postcard_varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number > 0x7f {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

/// A recording of that release: a hello, samples 0 to 9, and counters.
fn of_another_release(types: Option<String>) -> Vec<u8> {
    let hello_frame = framed(&other_body(&DeviceMessage::Hello(hello(1))));
    let mut metadata = BTreeMap::from([(HELLO.to_owned(), to_hex(&hello_frame))]);
    metadata.extend(types.map(|types| (TYPES.to_owned(), types)));
    let mut writer = Writer::new(Cursor::new(Vec::new())).unwrap();
    let topic = format!("/unit_1{WIRE}");
    let channel_id = writer.add_channel(0, &topic, "cdr", &metadata).unwrap();
    let samples = (0..10).map(|number| DeviceMessage::Sample(sample(number)));
    let messages = samples.chain([DeviceMessage::Stats(Stats::default())]);
    let bodies = messages.map(|message| framed(&other_body(&message)));
    for (log_time, bytes) in (0..).zip([hello_frame].into_iter().chain(bodies)) {
        let header = MessageHeader {
            channel_id,
            sequence: 0,
            log_time,
            publish_time: log_time,
        };
        let data = [&[0; BEFORE_BYTES][..], &bytes].concat();
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

#[test]
fn another_releases_samples_are_read_by_the_types_in_its_recording() {
    let file = of_another_release(Some(other_types().to_string()));
    let (mut recording, found) =
        Recording::of("it.mcap".to_owned(), Box::new(Cursor::new(file)), None).unwrap();
    assert_eq!(found, hello(1), "as this release says it to others");
    for number in 0..10 {
        let (came_ns, message) = recording.next_message().unwrap().unwrap();
        assert_eq!(message, DeviceMessage::Sample(sample(number)));
        assert_eq!(came_ns, u64::from(number) + 1);
    }
    assert_eq!(recording.next_message().unwrap(), None, "unknown: left out");
}

#[test]
fn another_releases_recording_without_usable_types_says_so() {
    let deep = "[".repeat(100_000);
    let endless = r#"{"name":"","ty":{"Seq":{"name":"","ty":"Unit"}}}"#;
    for types in [None, Some("{}"), Some(&deep), Some(endless)] {
        let file = of_another_release(types.map(str::to_owned));
        let error = open(file, None).err().unwrap().to_string();
        assert!(error.contains("another release"), "{error}");
    }
}
