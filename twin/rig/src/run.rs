//! One run: the board, the host's program, the limits, and the report.

use std::num::NonZeroU64;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use rigless::emulator::{self, AccessKind, Driver, Settled, Start, Stop};
use rigless::image::Image;
use rigless::mcu::Mcu;
use rigless::session::Session;
use rigless::time::VirtualNanos;

use crate::arrivals::Arrivals;
use crate::awake::Awake;
use crate::board;
use crate::camera::{Camera, SharedCamera, part};
use crate::chip::{Chip, Revision};
use crate::dma_reach;
use crate::dma_requests;
use crate::faults::Faults;
use crate::frame_source::FrameSource;
use crate::link::Plug;
use crate::machine::{Entry, Sensor};
use crate::mpu::Protection;
use crate::peripherals::flash::{self, Bank, Contents, Cut};
use crate::power;
use crate::report::Report;
use crate::rules::Rules;
use crate::script::{Restart, Script};
use crate::start_rules::StartRules;
use crate::truth::TruthLog;
use crate::usb_host::{Host, SharedHost};

/// Default of the instructions per second that a run assumes: five in six cycles at 480 MHz.
pub const INSTRUCTIONS_PER_SECOND: u64 = 400_000_000;
/// Period at which the program on the host's port is served, ns.
const LOOK_NS: u64 = 1_000_000;
/// Time for which a run goes on after its client left, before it waits for the next one, ns.
const LINGER_NS: u64 = 100_000_000;
/// Time without a byte on a client's port after which the run goes on slowly, ns. The longest erase
/// of the flash is shorter. A client that waits in real time leaves the processor to others.
const SILENCE_NS: u64 = 1_500_000_000;
/// Pause after each look at a silent port.
const PAUSE: Duration = Duration::from_millis(20);
/// Time for which clocks and pins are checked after a change, ns: oscillators and loops take up to
/// 2.1 ms.
const SETTLING_NS: u64 = 10_000_000;
/// Period of these checks, ns. The program may poll for a change without a pause, but the camera
/// and the host do not need a finer period.
const SETTLING_STEP_NS: u64 = 10_000;

/// Addresses that are reserved, where the first access after each reset is a bus error: below DTCM,
/// into which a stack runs that is used up, and behind AXI SRAM. The emulator answers others.
const RESERVED: [(u64, u64); 2] = [(0x1FFE_0000, 0x2000_0000), (0x2500_0000, 0x3000_0000)];

/// The user of the serial port.
#[derive(Debug)]
pub enum Program {
    /// A script, in virtual time; the device's bytes are kept.
    Script(Script),
    /// A program on this machine.
    Client {
        /// The port's other end.
        plug: Box<dyn Plug>,
        /// Whether to start, and go on, only while a client holds the port.
        wait: bool,
        /// Whether to end when the client leaves.
        exit_on_hangup: bool,
    },
}

/// The limits at which a run ends by itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits {
    /// Number of captured frames.
    pub frames: Option<u64>,
    /// Virtual time, ns.
    pub virtual_ns: Option<u64>,
}

/// All settings of a run.
#[derive(Debug)]
pub struct Options {
    /// The firmware.
    pub elf: PathBuf,
    /// The board.
    pub board: board::Kind,
    /// The camera on it.
    pub camera: part::Kind,
    /// The camera's view.
    pub source: Box<dyn FrameSource>,
    /// The truth log.
    pub truth: TruthLog,
    /// The log of the samples' arrivals.
    pub arrivals: Arrivals,
    /// The faults.
    pub faults: Faults,
    /// File of the flash's second bank and the options. Its contents are read from this file, if it
    /// exists, and written to it at the end.
    pub flash: Option<PathBuf>,
    /// The cut of the power, which ends the run.
    pub cut: Option<Cut>,
    /// Decides the values that a data sheet leaves open.
    pub seed: u64,
    /// Revision of the silicon.
    pub revision: Revision,
    /// The way in which the program is entered.
    pub entry: Entry,
    /// Whether the program's own regions of memory are enforced.
    pub protection: Protection,
    /// The user of the port.
    pub program: Program,
    /// The limits.
    pub limits: Limits,
    /// Instructions per second of virtual time.
    pub instructions_per_second: NonZeroU64,
    /// Ends the run when set.
    pub interrupt: Arc<AtomicBool>,
}

/// The results of a run.
#[derive(Debug)]
pub struct Outcome {
    /// The device's bytes, if a script read them.
    pub bytes: Vec<u8>,
    /// Counters.
    pub report: Report,
}

/// Runs the firmware until a limit, the client's departure, an interrupt, or a broken rule.
///
/// # Errors
/// If the firmware cannot be loaded, a rule of the chip was broken, or the emulator stopped with an
/// error.
pub fn run(options: Options) -> anyhow::Result<Outcome> {
    let contents = match &options.flash {
        Some(file) if file.exists() => Contents::load(file)?,
        _ => Contents::default(),
    };
    let images = vec![load(&options.elf)?, flash::image(&contents)?];
    let rules = Rules::default();
    let bank = Bank::new(contents, options.cut);
    let camera = SharedCamera::new(Camera::new(
        options.camera,
        options.source,
        options.truth,
        options.faults.clone(),
        rules.clone(),
        options.seed,
    ));
    let host = Host::new(options.faults.clone(), options.arrivals);
    let host = SharedHost::new(match &options.program {
        Program::Client { plug, .. } if plug.is_host() => host.of_client(),
        _ => host,
    });
    let chip = Chip::new(
        camera.clone(),
        host.clone(),
        options.faults,
        rules.clone(),
        bank.clone(),
        options.protection,
        options.board,
        options.revision,
        options.seed,
    )?;
    let board = Sensor {
        chip,
        instructions_per_second: options.instructions_per_second,
        entry: options.entry,
    };
    let session = Session::new(Box::new(board), 0, VirtualNanos(0))?;
    let driver = Conductor {
        host: host.clone(),
        camera: camera.clone(),
        rules: rules.clone(),
        start: StartRules::default(),
        bank: bank.clone(),
        array: Vec::new(),
        program: options.program,
        limits: options.limits,
        interrupt: options.interrupt,
        bytes: Vec::new(),
        client: Client::None,
        heard_at: 0,
        settling_until: 0,
        next_look: 0,
        settled_at_ns: 0,
        awake: Awake::new(options.instructions_per_second),
        restart: None,
        seed: options.seed,
        is_on: false,
        armed: None,
    };
    let began = Instant::now();
    // The conductor ends the run at an interrupt: only it can read the flash then.
    let finished = emulator::run(session, &Start::new(&images), driver)?;
    if let Some(broken) = rules.first() {
        bail!("the firmware broke a rule of the chip: {broken}");
    }
    if let Some(file) = &options.flash {
        bank.left(finished.driver.array).save(file)?;
    }
    let report = Report::new(
        &finished.session,
        &finished.session.board().chip,
        &camera,
        &host,
        &bank,
        began.elapsed(),
        finished.driver.settled_at_ns,
    );
    Ok(Outcome {
        bytes: finished.driver.bytes,
        report: Report {
            awake: finished.driver.awake.share(),
            ..report
        },
    })
}

fn load(path: &Path) -> anyhow::Result<Image> {
    let magic = std::fs::read(path).with_context(|| format!("firmware {}", path.display()))?;
    if !magic.starts_with(b"\x7FELF") {
        bail!(
            "firmware {}: not an ELF file; build one with `cargo build --release -p \
             hivtac-firmware --target thumbv7em-none-eabihf`",
            path.display()
        );
    }
    Image::new(path, magic, None).with_context(|| format!("firmware {}", path.display()))
}

/// Whether a client holds the port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Client {
    /// No client has come yet.
    None,
    /// A client is there.
    Here,
    /// The client left at this virtual time.
    Left(u64),
}

/// Observes the firmware's accesses, moves the port's bytes, and ends the run.
struct Conductor {
    host: SharedHost,
    camera: SharedCamera,
    rules: Rules,
    start: StartRules,
    bank: Bank,
    /// The flash's second bank at the end of the run.
    array: Vec<u8>,
    program: Program,
    limits: Limits,
    interrupt: Arc<AtomicBool>,
    bytes: Vec<u8>,
    client: Client,
    /// Time of the client's arrival or of the last byte, ns.
    heard_at: u64,
    /// Time until which clocks or pins may change by themselves, ns.
    settling_until: u64,
    /// Time of their next check, ns.
    next_look: u64,
    settled_at_ns: u64,
    awake: Awake,
    /// A restart from outside that is due.
    restart: Option<Restart>,
    seed: u64,
    /// Whether the power was switched on.
    is_on: bool,
    /// Resets at the time when accesses to [`RESERVED`] were made to fail.
    armed: Option<usize>,
}

/// Returns the time for which a write changes the board's wiring: `None` for not at all, 0 for now,
/// or the settling time of clocks.
fn settles_in(address: u64) -> Option<u64> {
    match address {
        // GPIOA to GPIOE
        0x5802_0000..=0x5802_13FF => Some(0),
        // RCC, PWR
        0x5802_4400..=0x5802_4BFF => Some(SETTLING_NS),
        // TIM1, which may be the camera's clock
        0x4001_0000..=0x4001_03FF => Some(0),
        // CRS
        0x4000_8400..=0x4000_87FF => Some(0),
        _ => None,
    }
}

impl Driver<Sensor> for Conductor {
    fn on_settled(
        &mut self,
        session: &mut Session<Sensor>,
        host: &mut dyn emulator::Host,
        settled: Settled,
    ) {
        if !std::mem::replace(&mut self.is_on, true) {
            power::leave(host, self.seed);
        }
        let now = match settled {
            Settled::Access { access, value } => {
                if access.kind == AccessKind::Write {
                    (self.start).written(access.address, value, host, &self.rules);
                    self.written(session, access.address, value, access.virtual_time);
                }
                session.board_mut().chip.accessed(&access, value);
                access.virtual_time
            }
            Settled::Stop(stop) => stop.at,
            _ => return,
        };
        self.settled_at_ns = now.0;
        session.board_mut().chip.settle(now, host);
        let is_settling = now.0 < self.settling_until && now.0 >= self.next_look;
        if is_settling || self.camera.lock().restarts() {
            self.next_look = now.0 + SETTLING_STEP_NS;
            session.board_mut().chip.rewire(now);
        }
        if self.rules.are_broken() || self.bank.was_cut() {
            session.run_until(now);
        }
    }

    fn on_stop(
        &mut self,
        session: &mut Session<Sensor>,
        stop: Stop,
        host: &mut dyn emulator::Host,
    ) -> Option<VirtualNanos> {
        let now = stop.at.0;
        self.awake.look(now, stop.instruction_count);
        let frames = session.board().chip.dcmi.counters().frames;
        let full = self.limits.frames.is_some_and(|limit| frames >= limit);
        if self.armed != Some(session.resets().len()) {
            self.armed = Some(session.resets().len());
            for (from, to) in RESERVED {
                session.fail_next(from, to);
            }
        }
        let late = self.limits.virtual_ns.is_some_and(|limit| now >= limit);
        let over = full || late || self.rules.are_broken() || self.bank.was_cut();
        if over || !self.serve(now) {
            self.array = flash::read_array(host);
            return None;
        }
        if let Some(restart) = self.restart.take() {
            session.reset_by_pin(stop.at, stop.instruction_count, host);
            if restart == Restart::PowerCycle {
                self.start = StartRules::default();
                power::forget(host, self.seed);
                session.board_mut().chip.powered_on();
            }
        }
        let limit = self.limits.virtual_ns.unwrap_or(u64::MAX);
        let action = match &self.program {
            Program::Script(script) => script.next_at().unwrap_or(u64::MAX),
            Program::Client { .. } => u64::MAX,
        };
        Some(VirtualNanos(
            (now + LOOK_NS).min(limit).min(action.max(now + 1)),
        ))
    }
}

impl Conductor {
    fn written(
        &mut self,
        session: &mut Session<Sensor>,
        address: u64,
        value: u64,
        at: VirtualNanos,
    ) {
        if let Some(settling_ns) = settles_in(address) {
            self.settling_until = self.settling_until.max(at.0 + settling_ns);
            session.board_mut().chip.rewire(at);
        } else if let Some(stream) = dma_reach::enabled_stream(address, value) {
            let registers = session.board().chip.bus().registers(stream.controller);
            let registers = registers.map(dma_reach::values).unwrap_or_default();
            dma_reach::check(stream, value, &registers, &self.rules);
            if let Some(mpu) = &session.board().chip.mpu {
                dma_reach::check_types(stream, value, &registers, mpu.types(), &self.rules);
            }
            if let Some(multiplexer) = session.board().chip.bus().registers("DMAMUX1") {
                dma_requests::check(stream, multiplexer, &self.rules);
            }
        }
    }

    /// Serves the port's program. Returns whether the run goes on.
    fn serve(&mut self, now: u64) -> bool {
        if self.interrupt.load(Ordering::Relaxed) {
            return false;
        }
        match &mut self.program {
            Program::Script(script) => {
                let mut host = self.host.lock();
                self.restart = script.run(now, &mut host);
                self.bytes.extend(host.from_device.drain(..));
                true
            }
            Program::Client { .. } => self.serve_client(now),
        }
    }

    /// Serves the client, and holds the run as long as it has to wait. Returns whether the run goes
    /// on.
    fn serve_client(&mut self, now: u64) -> bool {
        while !self.interrupt.load(Ordering::Relaxed) {
            let before = self.client;
            self.client = self.look_for_client(now);
            if before != self.client {
                self.heard_at = now;
            }
            match self.exchange(now) {
                Turn::Over => {
                    if self.client == Client::Here && now >= self.heard_at + SILENCE_NS {
                        thread::sleep(PAUSE);
                    }
                    return true;
                }
                Turn::End => return false,
                Turn::Wait => {
                    if let Program::Client { plug, .. } = &self.program {
                        plug.wait();
                    }
                }
            }
        }
        false
    }

    fn look_for_client(&mut self, now: u64) -> Client {
        let Program::Client { plug, .. } = &mut self.program else {
            return Client::None;
        };
        match (plug.connected(), self.client) {
            (true, _) => Client::Here,
            (false, Client::Here) => Client::Left(now),
            (false, before) => before,
        }
    }

    fn exchange(&mut self, now: u64) -> Turn {
        let Program::Client {
            plug,
            wait,
            exit_on_hangup,
        } = &mut self.program
        else {
            return Turn::Over;
        };
        let is_here = self.client == Client::Here;
        let traffic = plug.exchange(&mut self.host.lock(), is_here);
        if traffic.moved {
            self.heard_at = now;
        }
        let held_up = match self.client {
            // A slow client slows the run down; it does not make the device lose samples.
            Client::Here => traffic.waits,
            Client::None => *wait,
            Client::Left(_) if *exit_on_hangup => return Turn::End,
            Client::Left(at) => *wait && now >= at + LINGER_NS,
        };
        if held_up { Turn::Wait } else { Turn::Over }
    }
}

/// The result of serving a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    /// The run goes on.
    Over,
    /// The run stands still until the client is ready.
    Wait,
    /// The run ends.
    End,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_elf_is_refused_with_advice() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), b"MZ").unwrap();
        assert!(
            load(file.path())
                .unwrap_err()
                .to_string()
                .contains("not an ELF file")
        );
        assert!(
            load(Path::new("/nowhere.elf"))
                .unwrap_err()
                .to_string()
                .contains("/nowhere.elf")
        );
    }
}
