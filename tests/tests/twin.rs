//! Tests that the twin answers as the flashed program in the rig does: on the same frames the same
//! bytes.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use crate::rig::{Rig, TIMEOUT_S, exposed, tool};
use hivtac_host::link::Link;
use hivtac_host::live::camera::Kind;
use hivtac_host::live::device::{Captured, Device};
use hivtac_host::live::hand::Press;
use hivtac_host::live::pair::PairFilm;
use hivtac_host::port::Address;
use hivtac_terms::camera::CameraSettings;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{HsvBox, Mono, Threshold};
use hivtac_terms::units::{Microseconds, Sixteenths};
use hivtac_tests::artifact;
use hivtac_twin::{Disc, Format, Layout, Scene};
use hivtac_wire::frame::{MAX_DEVICE_FRAME, MAX_HOST_FRAME, encode};
use hivtac_wire::health::Health;
use hivtac_wire::message::{
    Command, DeviceHello, DeviceMessage, HostMessage, Outcome, Reply, Request, Sample, Stats,
};
use hivtac_wire::settings::SettingsReport;
use hivtac_wire::version::HelloPrefix;
use serde_json::Value;
use tempfile::TempDir;

const SEED: u64 = 1;
/// Columns and rows of an MT9V034's array, binned.
const MT9V034_ARRAY: [u32; 2] = [376, 240];
/// Samples that are compared.
const SAMPLES: usize = 24;
const PATIENCE: Duration = Duration::from_secs(TIMEOUT_S as u64);

/// The requests to a new device. A threshold discards the state of earlier frames. The first one is
/// not the model's: samples say so, until the first frame under the second.
fn set_up(kind: Kind) -> [Request; 4] {
    let [other, own]: [Threshold; 2] = match kind {
        Kind::Ov7725 | Kind::Ov5640 => {
            let [mut other, own] = [HsvBox::RED; 2];
            other.value_low += 1;
            [other, own].map(Threshold::Rgb565)
        }
        Kind::Mt9v034 => {
            let [mut other, own] = [Mono::DARK; 2];
            other.high -= 1;
            [other, own].map(Threshold::Mono)
        }
    };
    [
        Request::StartWithMarkers,
        Request::SetContactShape(ContactShape::Needle),
        Request::SetThreshold(other),
        Request::SetThreshold(own),
    ]
}

/// The settings of a camera whose automatic exposure ends a row or two off the twin's.
fn fixed(kind: Kind) -> Option<Request> {
    let settings = CameraSettings {
        exposure: Some(Microseconds(2_000)),
        gain: Some(Sixteenths(16)),
        ..CameraSettings::default()
    };
    (kind == Kind::Mt9v034).then_some(Request::SetCamera(settings))
}

/// The model of eight dots, and their layout.
const EIGHT_DOTS: &str = "../calibration/models/8v/default.hvtm";

fn eight_dots() -> Layout {
    "8v".parse().unwrap()
}

/// Returns the next sample, of the model's threshold or of another one.
fn next_sample(link: &mut Link, is_mismatch: bool) -> Sample {
    loop {
        let message = link.receive(Instant::now() + PATIENCE).unwrap();
        if let DeviceMessage::Sample(sample) = message.expect("samples come")
            && sample.status.contains(Status::MODEL_MISMATCH) == is_mismatch
        {
            return sample;
        }
    }
}

/// Returns the hello of the firmware in a rig, and the samples of successive frames, from the first
/// one after these requests.
fn from_the_rig(rig: &Rig, kind: Kind, count: usize) -> (DeviceHello, SettingsReport, Vec<Sample>) {
    let address = Address::Tty(rig.port().to_owned());
    let (mut link, hello) = Link::connect(&address, PATIENCE).unwrap();
    let [start, shape, other, own] = set_up(kind);
    for request in [start, shape, other] {
        link.request(request, PATIENCE, |_| {}).unwrap();
    }
    // From the first frame on the camera has its settings.
    next_sample(&mut link, true);
    if let Some(request) = fixed(kind) {
        link.request(request, PATIENCE, |_| {}).unwrap();
    }
    let mut report = None;
    let ask = link.request(Request::GetSettings, PATIENCE, |message| {
        if let DeviceMessage::Settings(settings) = message {
            report = Some(settings);
        }
    });
    ask.unwrap();
    link.request(own, PATIENCE, |_| {}).unwrap();
    let samples = (0..count).map(|_| next_sample(&mut link, false)).collect();
    (
        hello,
        report.expect("settings come before the reply"),
        samples,
    )
}

/// A twin in a conversation.
struct Twin(Device);

impl Twin {
    fn new(kind: Kind, layout: Layout) -> Twin {
        let mut twin = Twin(Device::new(kind, layout, [0; 12], 1.0));
        twin.send(&HostMessage::Hello(HelloPrefix::OURS.into()));
        twin
    }

    fn send(&mut self, message: &HostMessage) {
        let mut buffer = [0; MAX_HOST_FRAME];
        self.0.receive(encode(message, &mut buffer).unwrap(), 0);
    }

    /// Sends a request; returns the messages that come at once.
    fn ask(&mut self, request: Request) -> Vec<DeviceMessage> {
        self.send(&HostMessage::Command(Command { id: 1, request }));
        std::iter::from_fn(|| self.0.message()).collect()
    }
}

/// Returns the pixels of an exposure as they lie in the device's memory: of mono two in a word, of
/// the middle of the array.
fn words(scene: &Scene, kind: Kind, line: &Value) -> Vec<u16> {
    let frame = exposed(scene, line);
    if frame.format != Format::Mono {
        return frame
            .pixels
            .iter()
            .map(|pixel| pixel.swap_bytes())
            .collect();
    }
    let [width, height] = kind.size().map(usize::from);
    let [left, above] = [frame.width as usize - width, frame.height as usize - height];
    let rows = frame.mono_rows().skip(above / 2).take(height);
    let pixels = rows.flat_map(|row| row[left / 2..][..width].as_chunks::<2>().0);
    pixels.map(|pair| u16::from_le_bytes(*pair)).collect()
}

fn bytes(sample: Sample) -> Vec<u8> {
    let mut buffer = [0; MAX_DEVICE_FRAME];
    encode(&DeviceMessage::Sample(sample), &mut buffer)
        .unwrap()
        .to_vec()
}

/// Measures the frames of a rig's samples, with its truth, in the twin: the same bytes follow. The
/// number of the sample counts from the device's start, and is the only difference. Returns how
/// many had a force.
fn same_samples(twin: &mut Twin, scene: &Scene, rig: &Rig, samples: Vec<Sample>) -> usize {
    let kind = twin.0.camera().kind;
    let lines = rig.truth().unwrap();
    let lines: HashMap<u64, &Value> = lines
        .iter()
        .map(|line| (line["frame"].as_u64().unwrap(), line))
        .collect();
    for request in set_up(kind) {
        let (id, outcome) = (1, Outcome::Done);
        assert_eq!(
            twin.ask(request),
            [DeviceMessage::Reply(Reply { id, outcome })]
        );
    }
    let mut forces = 0;
    let mut before = None;
    for (nth, sample) in samples.into_iter().enumerate() {
        let camera = twin.0.camera();
        let lost = before.map_or(0, |before: u32| sample.frame - before - 1);
        before = Some(sample.frame);
        if lost > 0 {
            twin.0.missed(lost);
        }
        let frame = Captured {
            number: sample.frame,
            begun_us: sample.time_us.strict_sub_signed(camera.middle_us().into()),
            camera,
            words: words(scene, kind, lines[&u64::from(sample.frame)]),
        };
        // Whether one was lost before the first is the program's affair.
        let is_lost = match nth {
            0 => sample.status.contains(Status::FRAME_DROPPED),
            _ => lost > 0,
        };
        twin.0.frame(&frame, is_lost, || sample.time_us);
        // Counters may come, too.
        let messages: Vec<_> = std::iter::from_fn(|| twin.0.message()).collect();
        let own = messages.into_iter().find_map(|message| match message {
            DeviceMessage::Sample(own) => Some(own),
            _ => None,
        });
        let own = own.expect("a sample comes of each frame");
        forces += usize::from(sample.force.is_some());
        let sequence = sample.sequence;
        assert_eq!(
            bytes(Sample {
                sequence,
                ..own.clone()
            }),
            bytes(sample.clone()),
            "{nth}: {own:?}\n{sample:?}"
        );
    }
    forces
}

/// A twin with a camera sends the same hello as the program in the rig with that camera, and the
/// same samples for the same frames of a scene of the whole array.
fn a_twin_is_as_the_program(kind: Kind, scene: &Scene, rig: Rig) {
    let (hello, settings, samples) = from_the_rig(&rig, kind, SAMPLES);
    let mut twin = Twin::new(kind, Layout::default());
    let DeviceMessage::Hello(own) = twin.0.message().unwrap() else {
        panic!("a hello comes first");
    };
    let same = DeviceHello {
        device_id: hello.device_id,
        board: hello.board.clone(),
        ..own
    };
    assert_eq!(same, hello);
    let [_, shape, other, _] = set_up(kind);
    for request in [shape, other].into_iter().chain(fixed(kind)) {
        twin.ask(request);
    }
    let report = twin.ask(Request::GetSettings);
    assert_eq!(report[0], DeviceMessage::Settings(settings));
    let forces = same_samples(&mut twin, scene, &rig, samples);
    assert!(forces > SAMPLES / 2, "{forces}");
    rig.finish().unwrap();
}

#[test]
fn a_twin_sends_the_bytes_of_the_flashed_program() {
    let kind = Kind::Ov7725;
    let rig = Rig::start(&["--scene", "demo", "--seed", &SEED.to_string()]).unwrap();
    let scene = kind.scene("demo", Layout::default(), SEED).unwrap();
    a_twin_is_as_the_program(kind, &scene, rig);
}

/// Its noise makes frames have specks, and second looks.
#[test]
#[ignore = "slow: the second of three cameras"]
fn a_twin_with_an_ov5640_sends_the_bytes_of_the_flashed_program() {
    let text = format!("seed = {SEED}\n[camera]\npreset = \"ov5640\"\n[load]\nmotion = \"demo\"\n");
    let rig = Rig::start_under(&text, &["--camera", "ov5640"]).unwrap();
    let scene = Scene::from_toml(&text).unwrap();
    a_twin_is_as_the_program(Kind::Ov5640, &scene, rig);
}

#[test]
#[ignore = "slow: the third of three cameras"]
fn a_twin_with_an_mt9v034_sends_the_bytes_of_the_flashed_program() {
    let kind = Kind::Mt9v034;
    let elf = artifact::named_by("HIVTAC_BUG_ELFS").join("openmv-h7.elf");
    let seed = SEED.to_string();
    let options = ["--scene", "demo", "--seed", &seed, "--board", "openmv-h7"];
    let rig = Rig::start_with(&elf, &options).unwrap();
    let [width, height] = MT9V034_ARRAY;
    let scene = Scene::preset("demo", kind.preset(), width, height, SEED).unwrap();
    a_twin_is_as_the_program(kind, &scene, rig);
}

/// Gives a device with this flash the model of eight dots.
fn give_eight_dots(flash: &str) {
    let rig = Rig::start(&["--fault", "camera-absent", "--flash", flash]).unwrap();
    let sent = tool(&rig, "update model", &[EIGHT_DOTS]).unwrap();
    assert_eq!(sent.code, Some(0), "{sent:?}");
    rig.finish().unwrap();
}

/// A device that was given the model of eight dots. It measures every frame of a moving press.
#[test]
#[ignore = "slow: boots two devices"]
fn a_twin_of_eight_dots_sends_the_bytes_of_the_flashed_program() {
    let folder = tempfile::tempdir().unwrap();
    let flash = folder.path().join("flash");
    let flash = flash.to_str().unwrap();
    give_eight_dots(flash);
    let seed = SEED.to_string();
    let options = ["--scene", "demo", "--seed", &seed, "--layout", "8v"];
    let rig = Rig::start(&[&options[..], &["--flash", flash]].concat()).unwrap();
    let (hello, _, samples) = from_the_rig(&rig, Kind::Ov7725, SAMPLES);
    let scene = Kind::Ov7725.scene("demo", eight_dots(), SEED).unwrap();
    let mut twin = Twin::new(Kind::Ov7725, eight_dots());
    let DeviceMessage::Hello(own) = twin.0.message().unwrap() else {
        panic!("a hello comes first");
    };
    let crc = |hello: DeviceHello| hello.model.expect("a model").crc;
    assert_eq!(crc(hello), crc(own));
    let numbers = samples.windows(2).map(|pair| pair[1].frame - pair[0].frame);
    assert!(numbers.into_iter().all(|step| step == 1), "{samples:?}");
    let forces = same_samples(&mut twin, &scene, &rig, samples);
    assert!(forces > SAMPLES / 2, "{forces}");
    rig.finish().unwrap();
}

/// Two needles.
const NEEDLES: [Press; 2] = [
    Press {
        place_mm: [-2.5, 1.0],
        force_n: 0.05,
        angles_deg: [3.0, -2.0],
    },
    Press {
        place_mm: [1.5, 0.5],
        force_n: 0.05,
        angles_deg: [0.0, 4.0],
    },
];
/// Number of corrections of a dot's place by its image, and the approximate size of a pixel for
/// them.
const CORRECTIONS: usize = 12;
const MM_PER_PX: f64 = 0.05;
/// Samples until both are found and followed.
const SAMPLES_OF_TWO: usize = 220;
/// The first of them; the program looks closely at each.
const FIRST: usize = 6;
/// Samples of a film that nothing explains, most frames for them, and how far some dots are moved
/// for that, mm.
const SAMPLES_REFUSED: usize = 60;
const FRAMES_REFUSED: u32 = 64;
const TORN: [usize; 3] = [1, 4, 6];
const TORN_MM: f64 = 0.2;

/// How the dots of eight move under two needles, mm, so that their images are where the sensing's
/// model has them: in a scene they stay flat.
fn moved_by_two() -> Vec<[f64; 3]> {
    let scene = Kind::Ov7725.scene("rest", eight_dots(), SEED).unwrap();
    let model = Kind::Ov7725.model(eight_dots());
    let film = PairFilm::of(model, eight_dots()).unwrap();
    let moved = film.displacement(&scene, NEEDLES).unwrap();
    let flat = |dot| {
        let (disc, camera) = (Disc::marker(dot), scene.camera());
        let wanted = disc.centroid_px(&moved, camera);
        let mut flat = moved(dot);
        for _ in 0..CORRECTIONS {
            let here = disc.centroid_px(|_| flat, camera);
            for axis in [0, 1] {
                flat[axis] += MM_PER_PX * (wanted[axis] - here[axis]);
            }
        }
        flat
    };
    eight_dots().centres_mm().into_iter().map(flat).collect()
}

/// The samples of a device with eight dots that moved by this, mm. A twin makes the same of the
/// same frames. Returns the rig as well, and the folder of its files.
fn samples_of(moved_mm: &[[f64; 3]], count: usize) -> (Vec<Sample>, Rig, TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let flash = folder.path().join("flash");
    let flash = flash.to_str().unwrap();
    give_eight_dots(flash);
    let text = format!("layout = \"8v\"\n[marks]\nmoved_mm = {moved_mm:?}\n");
    let rig = Rig::start_under(&text, &["--flash", flash]).unwrap();
    let (_, _, samples) = from_the_rig(&rig, Kind::Ov7725, count);
    let mut twin = Twin::new(Kind::Ov7725, eight_dots());
    assert!(matches!(twin.0.message(), Some(DeviceMessage::Hello(_))));
    let scene = Scene::from_toml(&text).unwrap();
    same_samples(&mut twin, &scene, &rig, samples.clone());
    (samples, rig, folder)
}

/// The flashed program finds them within two seconds, and then reports them in every frame.
#[test]
#[ignore = "slow: boots two devices"]
fn two_needles_are_two_contacts_on_the_flashed_program() {
    let (samples, rig, _folder) = samples_of(&moved_by_two(), SAMPLES_OF_TWO);
    let steps = samples.windows(2).map(|pair| pair[1].frame - pair[0].frame);
    let steps: Vec<u32> = steps.collect();
    let reported = |sample: &Sample| sample.status.contains(Status::TWO_CONTACTS);
    let first = samples.iter().position(reported).expect("two contacts");
    assert!((20..190).contains(&first), "{first}");
    assert!(samples[first..].iter().all(reported), "{samples:?}");
    assert!(steps[FIRST..].iter().all(|step| *step == 1), "{steps:?}");
    let last = samples.last().unwrap();
    let mut each = last.each_contact().to_vec();
    each.sort_by_key(|contact| contact.place.unwrap().x);
    assert_eq!(each.len(), 2, "{last:?}");
    for (contact, needle) in each.iter().zip(NEEDLES) {
        let place = contact.place.unwrap();
        let off = |um: i32, mm: f64| (1e-3 * f64::from(um) - mm).abs();
        assert!(off(place.x.0, needle.place_mm[0]) < 0.3, "{contact:?}");
        assert!(off(place.y.0, needle.place_mm[1]) < 0.3, "{contact:?}");
        let sigma = contact.magnitude_sigma.0 as i32;
        assert!(
            (contact.magnitude.0 - 50_000).abs() < 3 * sigma,
            "{contact:?}"
        );
        assert!(sigma < 2_500, "{contact:?}");
    }
    let (health, stats) = health_and_stats(&rig);
    let free = health.stack_bytes - health.stack_used;
    assert!(free > 4_000, "{health:?}");
    assert!(stats.processing_us < 6_400, "{stats:?}");
    rig.finish().unwrap();
}

/// To look for two contacts that are not there takes no frames.
#[test]
#[ignore = "slow: boots two devices"]
fn what_nothing_explains_goes_on_at_full_rate() {
    let mut moved_mm = moved_by_two();
    for dot in TORN {
        moved_mm[dot][0] += TORN_MM;
    }
    let (samples, rig, _folder) = samples_of(&moved_mm, SAMPLES_REFUSED);
    let refused = |sample: &Sample| sample.status.contains(Status::UNEXPLAINED);
    assert!(samples.iter().all(refused), "{samples:?}");
    let frames = samples[SAMPLES_REFUSED - 1].frame - samples[0].frame;
    let steps = samples.windows(2).map(|pair| pair[1].frame - pair[0].frame);
    assert!(
        frames < FRAMES_REFUSED,
        "{frames}: {:?}",
        steps.collect::<Vec<_>>()
    );
    rig.finish().unwrap();
}

fn health_and_stats(rig: &Rig) -> (Health, Stats) {
    let address = Address::Tty(rig.port().to_owned());
    let (mut link, _) = Link::connect(&address, PATIENCE).unwrap();
    let (mut health, mut stats) = (None, None);
    for request in [Request::GetHealth, Request::GetInfo] {
        let ask = link.request(request, PATIENCE, |message| match message {
            DeviceMessage::Health(reported) => health = Some(reported),
            DeviceMessage::Stats(reported) => stats = Some(reported),
            _ => {}
        });
        ask.unwrap();
    }
    (health.unwrap(), stats.unwrap())
}
