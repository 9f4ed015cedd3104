//! Runs the firmware under a scripted host, and decodes the device's messages.
//!
//! `HIVTAC_ELF` names the firmware. `HIVTAC_BUG_ELFS` names a directory with `yuv422.elf` with the
//! model for YUV422, `openmv-h7.elf` for that board, and both boards' with seeded bugs.
//! `HIVTAC_INSTRUCTIONS_PER_SECOND` runs every test at another speed, `HIVTAC_BUSY_BUS` on a busy
//! bus.

use std::collections::BTreeMap;
use std::num::NonZeroU64;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use hivtac_rig::arrivals::Arrivals;
use hivtac_rig::board;
use hivtac_rig::camera::part;
use hivtac_rig::chip::Revision;
use hivtac_rig::faults::Faults;
use hivtac_rig::frame_source::SceneSource;
use hivtac_rig::machine::Entry;
use hivtac_rig::mpu::Protection;
use hivtac_rig::peripherals::flash::{Contents, Cut};
use hivtac_rig::report::Report;
use hivtac_rig::run::{INSTRUCTIONS_PER_SECOND, Limits, Options, Outcome, Program, run};
use hivtac_rig::script::{Action, Restart, Script};
use hivtac_rig::truth::TruthLog;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::Threshold;
use hivtac_twin::Layout;
use hivtac_wire::decoder::{Decoder, Received, Rejected};
use hivtac_wire::frame::{DEVICE_FRAME_LIMIT, MAX_HOST_FRAME, encode};
use hivtac_wire::health::Health;
use hivtac_wire::message::{
    self, Command, DeviceHello, DeviceMessage, HostMessage, Reply, Request, Sample, Stats,
};
use hivtac_wire::settings::SettingsReport;
use hivtac_wire::version::HelloPrefix;
use serde_json::Value;

/// The bugs of firmware with seeded bugs (`firmware/src/seeded_bugs.rs`).
#[derive(Clone, Copy, Debug)]
pub enum Bug {
    DmamuxRequest = 1,
    Polarities = 2,
    CameraRegister = 3,
    HalfBands = 4,
    UsbClock = 5,
    FaultAtStart = 6,
    HangAtStart = 7,
    BusFault = 8,
    Panic = 9,
    StackOverflow = 10,
    Hang = 11,
    FaultLate = 12,
    CacheableBuffers = 13,
    ExternalMemory = 14,
    FlashErrors = 15,
    VsyncPriority = 16,
    KeptToggles = 17,
    UndrainedEnd = 18,
}

/// Time at which the host says hello, ms: the port exists from about 140 ms on.
pub const HELLO_MS: u64 = 160;

/// Number of the command that sets the contact's shape.
const SHAPE: u16 = u16::MAX;

/// Returns the firmware under test.
pub fn firmware() -> PathBuf {
    path_from("HIVTAC_ELF", "the firmware ELF")
}

/// Returns a run of the firmware for the OpenMV Cam H7 on that board.
pub fn openmv(virtual_ms: u64) -> Setup {
    Setup {
        board: board::Kind::OpenmvH7,
        camera: part::Kind::Mt9v034,
        ..Setup::new(other("openmv-h7"), virtual_ms)
    }
}

/// Returns the firmware with seeded bugs, another model, or for another board.
pub fn other(name: &str) -> PathBuf {
    let path = path_from("HIVTAC_BUG_ELFS", "a directory of other firmware ELFs")
        .join(format!("{name}.elf"));
    assert!(
        path.exists(),
        "{} is missing: `cargo xtask test` builds it",
        path.display()
    );
    path
}

fn path_from(variable: &str, what: &str) -> PathBuf {
    let Some(path) = std::env::var_os(variable) else {
        panic!(
            "set {variable} to {what}. `cargo xtask test` does; by hand: in the project's root, \
             `cargo build --release -p hivtac-firmware --target thumbv7em-none-eabihf`, then \
             HIVTAC_ELF=$PWD/target/thumbv7em-none-eabihf/release/hivtac-firmware"
        )
    };
    // Cargo runs tests in the package's folder, but a relative path is relative to the project's
    // root.
    let path = PathBuf::from(path);
    let path = if path.is_relative() {
        PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join("..")
            .join(path)
    } else {
        path
    };
    assert!(
        path.exists(),
        "{variable}: {} does not exist",
        path.display()
    );
    path
}

/// Returns the core's speed for every test that does not set another:
/// `HIVTAC_INSTRUCTIONS_PER_SECOND`, or the default.
pub fn instructions_per_second() -> u64 {
    match std::env::var("HIVTAC_INSTRUCTIONS_PER_SECOND") {
        Ok(text) => text
            .parse()
            .expect("HIVTAC_INSTRUCTIONS_PER_SECOND is a whole number"),
        Err(_) => INSTRUCTIONS_PER_SECOND,
    }
}

/// A run under a scripted host, which opens the port, says hello, sets the contact's shape, starts
/// the stream, and asks for counters at the end.
pub struct Setup {
    pub elf: PathBuf,
    pub board: board::Kind,
    pub camera: part::Kind,
    /// A scene's name, or its file relative to the package's folder.
    pub scene: &'static str,
    pub seed: u64,
    /// The dots of a scene by name.
    pub layout: Layout,
    /// The contact's shape; `None` leaves the device's own. Scenes press with a needle.
    pub shape: Option<ContactShape>,
    pub faults: Vec<&'static str>,
    pub actions: Vec<(u64, Action)>,
    /// File with the flash's second bank.
    pub flash: Option<PathBuf>,
    pub cut: Option<Cut>,
    pub virtual_ms: u64,
    pub instructions_per_second: u64,
    pub revision: Revision,
    pub entry: Entry,
    pub protection: Protection,
}

impl Setup {
    pub fn new(elf: PathBuf, virtual_ms: u64) -> Self {
        Self {
            elf,
            board: board::Kind::Weact,
            camera: part::Kind::Ov7725,
            scene: "demo",
            seed: 1,
            layout: Layout::default(),
            shape: Some(ContactShape::Needle),
            faults: (std::env::var_os("HIVTAC_BUSY_BUS").iter())
                .map(|_| "bus-busy")
                .collect(),
            actions: Vec::new(),
            flash: None,
            cut: None,
            virtual_ms,
            instructions_per_second: instructions_per_second(),
            revision: Revision::V,
            entry: Entry::Reset,
            protection: Protection::Ignored,
        }
    }

    pub fn fault(mut self, fault: &'static str) -> Self {
        self.faults.push(fault);
        self
    }

    pub fn at(self, ms: u64, action: Action) -> Self {
        self.at_us(ms * 1000, action)
    }

    /// Presses the reset button, or cuts the power for a moment.
    pub fn restart_at(self, ms: u64, restart: Restart) -> Self {
        self.at(ms, Action::Restart(restart))
    }

    /// Says hello at a later time, and asks for the device's health 10 ms after it.
    pub fn ask_health_at(self, ms: u64, asked: u16) -> Self {
        let ask = Action::Send(command(asked, Request::GetHealth));
        self.at(ms, Action::Send(hello())).at(ms + 10, ask)
    }

    pub fn at_us(mut self, us: u64, action: Action) -> Self {
        self.actions.push((us * 1000, action));
        self
    }

    /// Runs firmware with seeded bugs with a bug, or with none.
    pub fn run_with(self, bug: impl Into<Option<Bug>>) -> Run {
        self.with(bug, Self::run)
    }

    /// Chooses a bug of firmware with seeded bugs, or none, by the last word of flash; passes the
    /// set-up on.
    pub fn with<R>(mut self, bug: impl Into<Option<Bug>>, run: impl FnOnce(Self) -> R) -> R {
        let flash = self
            .flash
            .as_deref()
            .map(|file| Contents::load(file).unwrap());
        let mut contents = flash.unwrap_or_default();
        let last = contents.array.len() - 4;
        let number = bug.into().map_or(u32::MAX, |bug| bug as u32);
        contents.array[last..].copy_from_slice(&number.to_le_bytes());
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("flash");
        contents.save(&file).unwrap();
        self.flash = Some(file);
        run(self)
    }

    /// Enforces the firmware's own regions of memory. Elsewhere they are not enforced, which is
    /// several times as fast. `firmware::the_same_seed_gives_the_same_bytes` shows that this
    /// changes nothing.
    pub fn protected(self) -> Self {
        Self {
            protection: Protection::Enforced,
            ..self
        }
    }

    pub fn run(self) -> Run {
        let directory = tempfile::tempdir().unwrap();
        let truth = directory.path().join("truth.jsonl");
        let outcome = self.try_run(&truth).unwrap();
        let arrivals = json_lines(&truth.with_extension("arrivals"));
        Run::new(outcome, json_lines(&truth), arrivals)
    }

    fn source(&self) -> anyhow::Result<SceneSource> {
        if self.scene.ends_with(".toml") {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(self.scene);
            return SceneSource::load(&file, self.camera);
        }
        SceneSource::new(self.scene, None, self.seed, self.camera)?.with_layout(self.layout)
    }

    pub fn try_run(self, truth: &Path) -> anyhow::Result<Outcome> {
        let ms = |ms: u64| ms * 1_000_000;
        let mut actions = vec![
            (0, Action::Open),
            (ms(HELLO_MS), Action::Send(hello())),
            (ms(HELLO_MS + 2), Action::Send(command(1, Request::Start))),
            (
                ms(self.virtual_ms - 4),
                Action::Send(command(2, Request::GetInfo)),
            ),
        ];
        actions.extend(self.shape.map(|shape| {
            let request = Request::SetContactShape(shape);
            (ms(HELLO_MS + 1), Action::Send(command(SHAPE, request)))
        }));
        let source = Box::new(self.source()?);
        let seed = self.seed;
        actions.extend(self.actions);
        run(Options {
            elf: self.elf,
            board: self.board,
            camera: self.camera,
            source,
            truth: TruthLog::create(truth)?,
            arrivals: Arrivals::create(&truth.with_extension("arrivals"))?,
            faults: Faults::new(
                self.faults
                    .iter()
                    .map(|fault| fault.parse().unwrap())
                    .collect(),
            ),
            flash: self.flash,
            cut: self.cut,
            seed,
            revision: self.revision,
            entry: self.entry,
            protection: self.protection,
            program: Program::Script(Script::new(actions)),
            limits: Limits {
                frames: None,
                virtual_ns: Some(ms(self.virtual_ms)),
            },
            instructions_per_second: NonZeroU64::new(self.instructions_per_second).unwrap(),
            interrupt: Arc::new(AtomicBool::new(false)),
        })
    }
}

/// Reads one JSON value per line.
fn json_lines(file: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(file).unwrap();
    let lines = text.lines();
    lines
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// Returns an ELF that loads these bytes at their address, and is entered behind two vectors.
pub fn elf(base: u32, bytes: &[u8]) -> Vec<u8> {
    let mut elf = b"\x7FELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
    let halves =
        |elf: &mut Vec<u8>, values: &[u16]| elf.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    let words =
        |elf: &mut Vec<u8>, values: &[u32]| elf.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    halves(&mut elf, &[2, 40]);
    words(&mut elf, &[1, base + 9, 52, 0, 0x0500_0000]);
    halves(&mut elf, &[52, 32, 1, 40, 0, 0]);
    let length = bytes.len() as u32;
    words(&mut elf, &[1, 84, base, base, length, length, 5, 4]);
    elf.extend(bytes);
    elf
}

/// Returns a host's hello, with a zero byte before it.
pub fn hello() -> Vec<u8> {
    hello_of(HelloPrefix::OURS)
}

/// Returns the hello of a host of any version.
pub fn hello_of(prefix: HelloPrefix) -> Vec<u8> {
    frame(&HostMessage::Hello(prefix.into()))
}

/// Returns a command.
pub fn command(id: u16, request: Request) -> Vec<u8> {
    frame(&HostMessage::Command(Command { id, request }))
}

/// Returns the message that sets the direction of gravity.
pub fn down(down: Down) -> Action {
    Action::Send(frame(&HostMessage::Down(down)))
}

/// Returns a command that sets the threshold.
pub fn set_threshold(id: u16, threshold: Threshold) -> Action {
    Action::Send(command(id, Request::SetThreshold(threshold)))
}

fn frame(message: &HostMessage) -> Vec<u8> {
    let mut buffer = [0; MAX_HOST_FRAME];
    [&[0], encode(message, &mut buffer).unwrap()].concat()
}

/// All statuses of a sample in an undisturbed scene before a tare. The demo's tip wanders over the
/// film; fast parts are a slip.
const USUAL: Status =
    Status(Status::TARE_MISSING.0 | Status::NOT_CALIBRATED.0 | Status::CONTACT.0 | Status::SLIP.0);

/// Asserts that a sample has no statuses but the usual ones, and those of frames lost before it.
pub fn assert_usual(sample: &Sample) {
    let others = sample.status.0 & !USUAL.0 & !Status::CAMERA_RESTARTED.0;
    assert_eq!(others & !Status::FRAME_DROPPED.0, 0, "{sample:?}");
}

/// The results of a run.
pub struct Run {
    pub bytes: Vec<u8>,
    pub messages: Vec<DeviceMessage>,
    pub rejected: Rejected,
    pub report: Report,
    pub truth: Vec<Value>,
    pub arrivals: Vec<Value>,
}

impl Run {
    fn new(outcome: Outcome, truth: Vec<Value>, arrivals: Vec<Value>) -> Self {
        let mut decoder = Decoder::<DEVICE_FRAME_LIMIT>::new();
        let mut rest = &outcome.bytes[..];
        let mut messages = Vec::new();
        while let Some(received) = decoder.feed(&mut rest) {
            match received {
                Received::Message(message) => messages.push(message),
                Received::ForeignHello(prefix) => {
                    panic!("the firmware speaks {prefix:?}: build it from this tree")
                }
            }
        }
        let rejected = decoder.rejected();
        Self {
            bytes: outcome.bytes,
            messages,
            rejected,
            report: outcome.report,
            truth,
            arrivals,
        }
    }

    pub fn samples(&self) -> Vec<&Sample> {
        self.messages
            .iter()
            .filter_map(|m| {
                if let DeviceMessage::Sample(s) = m {
                    Some(s)
                } else {
                    None
                }
            })
            .collect()
    }

    /// Returns the samples that come right after a sample of the previous frame. For all others the
    /// speed of the markers is unknown; a force that changes during their exposure may be
    /// unexplained.
    pub fn followed(&self) -> Vec<&Sample> {
        let samples = self.samples();
        let pairs = samples.windows(2);
        pairs
            .filter(|pair| pair[1].frame == pair[0].frame + 1)
            .map(|pair| pair[1])
            .collect()
    }

    pub fn hellos(&self) -> Vec<&DeviceHello> {
        self.messages
            .iter()
            .filter_map(|m| {
                if let DeviceMessage::Hello(h) = m {
                    Some(h)
                } else {
                    None
                }
            })
            .collect()
    }

    /// Returns the device's answers to a command, each with the number of samples sent before it.
    pub fn answers(&self, asked: u16) -> Vec<(message::Outcome, usize)> {
        let (mut samples, mut answers) = (0, Vec::new());
        for message in &self.messages {
            match message {
                DeviceMessage::Sample(_) => samples += 1,
                DeviceMessage::Reply(Reply { id, outcome }) if *id == asked => {
                    answers.push((*outcome, samples));
                }
                _ => {}
            }
        }
        answers
    }

    /// Returns the device's answer to a command; there must be exactly one.
    pub fn outcome(&self, asked: u16) -> message::Outcome {
        let answers = self.answers(asked);
        assert_eq!(answers.len(), 1, "one reply to {asked}");
        answers[0].0
    }

    /// Returns the last settings.
    pub fn settings(&self) -> &SettingsReport {
        let settings = self.messages.iter().rev().find_map(|m| {
            if let DeviceMessage::Settings(s) = m {
                Some(s)
            } else {
                None
            }
        });
        settings.expect("settings came")
    }

    /// Returns the first report of the device's health.
    pub fn health(&self) -> &Health {
        let health = self.messages.iter().find_map(|m| match m {
            DeviceMessage::Health(health) => Some(health),
            _ => None,
        });
        health.expect("it answers")
    }

    /// Returns the last counters.
    pub fn stats(&self) -> &Stats {
        let stats = self.messages.iter().rev().find_map(|m| {
            if let DeviceMessage::Stats(s) = m {
                Some(s)
            } else {
                None
            }
        });
        stats.unwrap_or_else(|| panic!("no stats came; the USB port: {:#?}", self.report.usb_log))
    }

    /// Returns the log lines, joined.
    pub fn log(&self) -> String {
        let lines = self.messages.iter().filter_map(|m| {
            if let DeviceMessage::Log(l) = m {
                Some(l.text.as_str())
            } else {
                None
            }
        });
        lines.collect::<Vec<_>>().join("\n")
    }

    /// Returns the frames without a sample between the first and the last sample.
    pub fn missing_frames(&self) -> Vec<u32> {
        let frames: Vec<u32> = self.samples().iter().map(|sample| sample.frame).collect();
        let between = |pair: &[u32]| pair[0] + 1..pair[1];
        frames.windows(2).flat_map(between).collect()
    }

    /// Asserts that every frame was measured, or passed during a change of settings. Two frames may
    /// be under way: one in readout, and the one before it in computation.
    pub fn assert_only_setup_drops(&self) {
        let stats = self.stats();
        let losses = [
            stats.dropped_busy,
            stats.dropped_overrun,
            stats.dropped_size,
        ];
        assert_eq!(losses, [0; 3], "{stats:?}");
        let counted = stats.frames_processed + stats.dropped_setup;
        assert!(stats.frames_exposed - counted <= 2, "{stats:?}");
    }

    /// Returns the frames whose samples report that a frame before them was lost.
    pub fn frames_after_a_loss(&self) -> Vec<u32> {
        let reported = |sample: &&&Sample| sample.status.contains(Status::FRAME_DROPPED);
        let samples = self.samples();
        samples
            .iter()
            .filter(reported)
            .map(|sample| sample.frame)
            .collect()
    }

    /// Asserts that every sample names an exposure, and that the device's clock and the true one
    /// have a constant difference: the start of the device's clock.
    pub fn assert_times(&self) {
        let ahead = self.clock_ahead_us();
        let first = *ahead.first().expect("samples");
        // HAL and emulator disagree about a compare flag at the timer's start: half a turn of 16
        // bits, 65.5 ms.
        assert!((-20_000..70_000).contains(&first), "{ahead:?}");
        assert!(
            ahead.iter().all(|other| other.abs_diff(first) <= 10),
            "{ahead:?}"
        );
    }

    /// Returns by how much the device's clock is ahead of the true one in each sample, µs.
    pub fn clock_ahead_us(&self) -> Vec<i64> {
        let ahead = |sample: &&Sample| sample.time_us as i64 - self.true_time_us(sample.frame);
        self.samples().iter().map(ahead).collect()
    }

    /// Returns the time from the middle of a frame's exposure until its sample's last byte had
    /// left, s.
    pub fn latencies(&self) -> BTreeMap<u64, f64> {
        let number = |line: &Value| line["frame"].as_u64().unwrap();
        let time = |line: &Value| line["time_s"].as_f64().unwrap();
        let exposed = self.truth.iter().map(|line| (number(line), time(line)));
        let exposed: BTreeMap<u64, f64> = exposed.collect();
        let sent = self.arrivals.iter();
        sent.map(|line| (number(line), time(line) - exposed[&number(line)]))
            .collect()
    }

    /// Returns the forces a second on the wire, from the exposures of the first and the last one.
    pub fn rate_hz(&self) -> f64 {
        let frame = |line: &Value| line["frame"].as_u64().unwrap();
        let ends = [self.arrivals.first(), self.arrivals.last()];
        let [first, last] = ends.map(|line| frame(line.expect("samples")));
        let [begin_s, end_s] = [first, last].map(|frame| self.exposed_s(frame));
        (last - first) as f64 / (end_s - begin_s)
    }

    /// Returns the largest difference between |F| of these samples and the truth, µN.
    pub fn worst_force_un(&self, samples: &[&Sample]) -> f64 {
        let off_un = |sample: &&Sample| {
            let truth_n = self.truth_of(sample.frame)["magnitude_n"].as_f64().unwrap();
            (f64::from(sample.force.unwrap().magnitude.0) - 1e6 * truth_n).abs()
        };
        samples.iter().map(off_un).fold(0.0, f64::max)
    }

    /// Returns the time of the middle of a frame's exposure, s.
    fn exposed_s(&self, frame: impl Into<u64>) -> f64 {
        self.truth_of(frame)["time_s"].as_f64().unwrap()
    }

    fn truth_of(&self, frame: impl Into<u64>) -> &Value {
        let frame = frame.into();
        let exposed = self.truth.iter().find(|truth| truth["frame"] == frame);
        exposed.unwrap_or_else(|| panic!("frame {frame} was never exposed"))
    }

    fn true_time_us(&self, frame: u32) -> i64 {
        (self.exposed_s(frame) * 1e6) as i64
    }
}
