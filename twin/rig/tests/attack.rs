//! Attacks on the firmware: hosts and cables do anything, and the camera fails at the same time.
//! The device must never reset, report a false force or miscount, and it must answer afterwards.
//!
//! `HIVTAC_ATTACKS` sets the number of runs, from seed `HIVTAC_ATTACK_SEED` on; each is 0.9 s of
//! virtual time.

use crate::common::{Run, Setup, command, firmware, hello};
use hivtac_rig::script::Action;
use hivtac_terms::camera::{CameraSettings, Rate, White};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::force::Force;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{PixelFormat, Threshold};
use hivtac_terms::units::{Micrometres, Microseconds, Sixteenths};
use hivtac_wire::message::{MODEL_BYTES, ModelPart, Request};
use hivtac_wire::settings::Selection;
use serde_json::Value;

/// Default number of runs.
const RUNS: u64 = 1;
/// Time of the attack, ms. It ends with a cable that is put back.
const ATTACK_MS: std::ops::Range<u64> = 165..440;
const PLUGGED_MS: u64 = 470;
/// Time by which the host has enumerated the device again.
const GREETED_MS: u64 = 700;
const END_MS: u64 = 900;
/// Faults that may be on at any time during an attack, several at once.
const FAULTS: [&str; 9] = [
    "camera-silent",
    "frame-short",
    "frame-long",
    "dcmi-overrun",
    "berr-once",
    "scl-stretch",
    "cable-pulled",
    "host-not-reading",
    "bus-busy",
];
/// A force counts as wrong if its error is larger than this many of its standard uncertainties, and
/// than the next value.
const SIGMAS: f64 = 6.0;
const OFF_N: f64 = 1e-3;

/// Random numbers that follow from a seed (SplitMix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ mixed >> 31
    }

    fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound
    }

    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        std::array::from_fn(|_| self.next() as u8)
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len() as u64) as usize]
    }
}

/// Returns a SETUP packet: any bytes, or a standard or class request with one or more wrong bytes.
fn setup_packet(numbers: &mut Numbers) -> [u8; 8] {
    let known = [
        [0x80, 6, 0, 1, 0, 0, 18, 0],
        [0x80, 6, 0, 2, 0, 0, 9, 0],
        [0x00, 9, 1, 0, 0, 0, 0, 0],
        [0x00, 5, 7, 0, 0, 0, 0, 0],
        [0x82, 0, 0, 0, 0x81, 0, 2, 0],
        [0x02, 3, 0, 0, 0x81, 0, 0, 0],
        [0x21, 0x22, 3, 0, 0, 0, 0, 0],
        [0x21, 0x20, 0, 0, 0, 0, 7, 0],
        [0x01, 11, 0, 0, 0, 0, 0, 0],
    ];
    if numbers.below(3) == 0 {
        return numbers.bytes();
    }
    let mut packet = numbers.one_of(&known);
    for _ in 0..numbers.below(3) {
        packet[numbers.below(8) as usize] = numbers.next() as u8;
    }
    packet
}

/// Returns settings of exposure, gain, rate and white: possible ones, impossible ones, or none.
fn camera_settings(numbers: &mut Numbers) -> CameraSettings {
    let exposure = Microseconds(numbers.below(30_000) as u32);
    let gain = Sixteenths(numbers.below(80) as u16);
    CameraSettings {
        exposure: (numbers.below(2) == 0).then_some(exposure),
        gain: (numbers.below(2) == 0).then_some(gain),
        rate: numbers.one_of(&Rate::ALL),
        white: (numbers.below(4) == 0).then(|| White {
            red: numbers.next() as u8,
            blue: numbers.next() as u8,
        }),
    }
}

/// Returns a part of an invalid model.
fn model_part(numbers: &mut Numbers) -> ModelPart {
    let bytes = numbers.bytes::<64>();
    ModelPart {
        offset: 32 * numbers.below(4) as u32,
        bytes: bytes[..numbers.below(65) as usize]
            .iter()
            .copied()
            .collect(),
    }
}

/// Returns any request that neither changes the meaning of a force nor restarts the device.
fn request(numbers: &mut Numbers) -> Request {
    let frames = 1 + numbers.below(8) as u16;
    let bytes = numbers.below(2 * MODEL_BYTES as u64) as u32;
    let requests = [
        Request::GetInfo,
        Request::Start,
        Request::StartWithMarkers,
        Request::Stop,
        Request::Expose,
        Request::Snapshot,
        Request::Inspect,
        Request::GetSettings,
        Request::GetHealth,
        Request::Tare { frames },
        Request::SetThreshold(Threshold::red(PixelFormat::Rgb565)),
        Request::SetCamera(camera_settings(numbers)),
        Request::SetContactShape(ContactShape::Needle),
        Request::SetContactShape(ContactShape::Round(Micrometres(u32::MAX))),
        Request::BeginModel { bytes },
        Request::ModelPart(model_part(numbers)),
        Request::UseModel,
        Request::UseBuiltInModel,
        Request::Keep(Selection::NONE),
        Request::Keep(Selection::ALL),
    ];
    requests[numbers.below(requests.len() as u64) as usize].clone()
}

/// Returns bytes for the device: noise, and messages that are whole, damaged or cut.
fn bytes(numbers: &mut Numbers) -> Vec<u8> {
    let request = request(numbers);
    let mut message = match numbers.below(5) {
        0 => numbers.bytes::<96>().to_vec(),
        1 => hello(),
        _ => command(numbers.next() as u16, request),
    };
    match numbers.below(4) {
        0 => {
            let at = numbers.below(message.len() as u64) as usize;
            message[at] ^= 1 << numbers.below(8);
        }
        1 => message.truncate(numbers.below(message.len() as u64) as usize),
        _ => {}
    }
    message
}

fn action(numbers: &mut Numbers) -> Action {
    match numbers.below(16) {
        0..5 => Action::Request(setup_packet(numbers)),
        5..11 => Action::Send(bytes(numbers)),
        11 => Action::StopReading,
        12 => Action::Read,
        13 => Action::Close,
        14 => Action::Open,
        _ if numbers.below(2) == 0 => Action::Plug,
        _ => Action::Unplug,
    }
}

/// Makes a run with an attack, and a host that behaves correctly afterwards.
fn attacked(seed: u64) -> Run {
    let mut numbers = Numbers(seed);
    let mut setup = Setup {
        seed,
        ..Setup::new(firmware(), END_MS)
    };
    let span = ATTACK_MS.end - ATTACK_MS.start;
    for _ in 0..10 + numbers.below(40) {
        let at = ATTACK_MS.start + numbers.below(span);
        setup = setup.at(at, action(&mut numbers));
    }
    for _ in 0..numbers.below(4) {
        let from = ATTACK_MS.start + numbers.below(span - 20);
        let until = from + 1 + numbers.below(ATTACK_MS.end - from);
        let fault = format!("{}@{from}-{until}", numbers.one_of(&FAULTS));
        // Names of faults must outlive their run.
        setup = setup.fault(Box::leak(fault.into_boxed_str()));
    }
    setup
        .at(ATTACK_MS.end, Action::Unplug)
        .at(PLUGGED_MS, Action::Plug)
        .at(PLUGGED_MS + 1, Action::Open)
        .at(PLUGGED_MS + 2, Action::Read)
        .at(GREETED_MS, Action::Send(hello()))
        .at(GREETED_MS + 2, Action::Send(command(3, Request::Start)))
        .protected()
        .run()
}

/// Returns the error of a force, N, and the largest allowed error.
fn off_n(force: &Force, truth: &Value) -> (f64, f64) {
    let true_n: Vec<f64> = ["x_n", "y_n", "z_n"]
        .map(|name| truth[name].as_f64().unwrap())
        .to_vec();
    let found_n = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
    let square = |parts: &[f64]| parts.iter().map(|part| part * part).sum::<f64>();
    let apart: Vec<f64> = found_n.iter().zip(&true_n).map(|(a, b)| a - b).collect();
    let size_n = square(&true_n).sqrt();
    let across_n = size_n * (f64::from(force.direction_sigma.0) * 1e-3).to_radians();
    let along_n = f64::from(force.magnitude_sigma.0) * 1e-6;
    (
        square(&apart).sqrt(),
        SIGMAS * across_n.hypot(along_n) + OFF_N,
    )
}

/// Returns whether the markers' motion before a frame is unknown: a frame before it was lost, or it
/// is the very first one.
fn moved_unseen(run: &Run, nth: usize) -> bool {
    let samples = run.samples();
    let before = nth.checked_sub(1).map(|before| samples[before].frame + 1);
    before != Some(samples[nth].frame)
        || samples[nth].status.contains(Status::FRAME_DROPPED)
        || samples[nth].status.contains(Status::CAMERA_RESTARTED)
}

#[test]
fn nothing_stops_it_and_no_force_is_wrong() {
    let number = |name: &str, default| match std::env::var(name) {
        Ok(text) => text.parse().expect("a whole number"),
        Err(_) => default,
    };
    let first = number("HIVTAC_ATTACK_SEED", 1);
    for seed in first..first + number("HIVTAC_ATTACKS", RUNS) {
        let run = attacked(seed);
        assert_eq!(run.report.resets, 0, "seed {seed}");
        let greeted = run.hellos().len();
        assert!(greeted >= 1, "seed {seed}: {:#?}", run.report.usb_log);
        let last = run.samples().last().map_or(0, |sample| sample.time_us);
        assert!(last > 1000 * (END_MS - 40), "seed {seed}: {last}");
        for (nth, sample) in run.samples().into_iter().enumerate() {
            let truth = run.truth.iter().find(|line| line["frame"] == sample.frame);
            let truth = truth.unwrap_or_else(|| panic!("seed {seed}: {sample:?}"));
            if let Some(force) = sample.force.as_ref().filter(|_| !moved_unseen(&run, nth)) {
                let (off, bound) = off_n(force, truth);
                assert!(off <= bound, "seed {seed}: {off} N of {bound}: {sample:?}");
            }
        }
        let stats = run.stats();
        let counted = stats.frames_processed
            + stats.dropped_busy
            + stats.dropped_overrun
            + stats.dropped_size
            + stats.dropped_setup;
        assert!(
            stats.frames_exposed.abs_diff(counted) <= 2,
            "seed {seed}: {stats:?}"
        );
    }
}
