//! Runs the HiVTac sensor on the STM32H743.
//!
//! ```text
//! vsync ─┐
//! camera ┴→ capture → bands → pipeline → outbox → usb → host
//!                                ↑ └─→ uart        │
//!                             orders ← commands ←──┘
//!                                         └→ memory → flash
//! ```
//!
//! Which task may interrupt which: [`priorities`]. Their shared state: `docs/shared-state.md`.
//! Memory layout: `memory.x`, [`caches`]. Nothing is allocated after boot.
#![no_std]
#![no_main]

mod band_copy;
mod band_dma;
mod bands;
mod block_move;
mod board;
mod caches;
mod camera;
mod capture;
mod capture_task;
mod commands;
mod condition;
mod dtcm_table;
mod failure;
mod faults;
mod flash;
mod info;
mod led;
mod loader;
mod log;
mod memory;
mod model;
mod model_slots;
mod model_upload;
mod next_model;
mod next_threshold;
mod orders;
mod outbox;
mod output;
mod pipeline_task;
mod priorities;
mod seeded_bugs;
mod self_test;
mod session;
mod settings;
mod snapshot;
mod snapshot_copy;
mod stack;
mod starts;
mod stats;
mod supply;
mod tare;
mod thermometer;
mod uart;
mod usb;
mod usb_core;
mod usb_guard;
mod usb_watch;
mod vsync;

use band_copy::BandCopy;
use camera::Format;
use cortex_m_rt::entry;
use defmt_rtt as _;
use dtcm_table::Sensor;
use embassy_executor::{Executor, InterruptExecutor, SpawnToken, Spawner};
use embassy_stm32::interrupt;
use hivtac_terms::camera::CameraSettings;
use hivtac_wire::image::header::{Header, Mark};
use hivtac_wire::kept::Record;
use memory::Memory;
use model::ModelFile;
use next_model::InUse;
use snapshot_copy::SnapshotCopy;
use static_cell::{ConstStaticCell, StaticCell};

core::arch::global_asm!(include_str!("first_stage.s"));
core::arch::global_asm!(include_str!("start.s"));

/// This mark and the next identify the image's chip and board to an update, at places that
/// `memory.x` fixes.
#[used]
#[unsafe(link_section = ".first_stage.mark")]
static FIRST_STAGE: Mark = Mark::of_first_stage(board::NAME);
/// Without length and checksum, which an image gets when it is made of the ELF.
#[used]
#[unsafe(link_section = ".image_header")]
static HEADER: Header = Header::unsealed(board::NAME, env!("CARGO_PKG_VERSION"));

static CAPTURE_EXECUTOR: InterruptExecutor = InterruptExecutor::new();
static USB_EXECUTOR: InterruptExecutor = InterruptExecutor::new();
static THREAD_EXECUTOR: StaticCell<Executor> = StaticCell::new();
/// Too large for DTCM in addition to the tables. Each part of a frame uses small parts of it, which
/// the data cache holds.
#[unsafe(link_section = ".sram.sensor")]
static SENSOR: ConstStaticCell<Sensor> = ConstStaticCell::new(Sensor::new());

#[entry]
fn main() -> ! {
    let foreground = start();
    THREAD_EXECUTOR
        .init(Executor::new())
        .run(|spawner: Spawner| {
            spawner.spawn(token(pipeline_task::run(
                foreground.sensor,
                foreground.model,
                foreground.bands,
                foreground.snapshots,
            )));
            spawner.spawn(token(faults::feed_watchdog()));
        })
}

/// The state of thread mode.
struct Foreground {
    sensor: &'static mut Sensor,
    model: InUse,
    bands: BandCopy,
    snapshots: SnapshotCopy,
}

/// Starts all tasks. Separate from `main`, which never releases its stack.
#[inline(never)]
fn start() -> Foreground {
    let mut core = cortex_m::Peripherals::take().expect("first and only use");
    caches::enable(&mut core);
    faults::note_reset();
    bands::clear();
    priorities::set();
    let mut board = board::start();
    faults::log_reset();
    seeded_bugs::fail_at_start();
    supply::raise_brown_out(&mut board.flash);
    vsync::start(camera::VSYNC_BLANKING_IS_HIGH);
    let sensor = SENSOR.take();
    let mut memory = Memory::open(board.flash, board.thermometer);
    settings::set_name(memory.record().name.clone());
    let file = memory.model();
    let model = InUse::of(&file);
    let format = configure(sensor, &file, memory.record());
    set_camera(memory.record().camera);
    self_test::at_start(&memory.of_flash(), sensor);

    let usb = USB_EXECUTOR.start(priorities::USB_EXECUTOR);
    usb.spawn(token(usb::run(board.usb)));
    usb.spawn(token(uart::run(board.uart)));
    usb.spawn(token(memory::run(memory)));
    usb.spawn(token(led::run(board.led)));
    let capture = CAPTURE_EXECUTOR.start(priorities::CAPTURE_EXECUTOR);
    capture.spawn(token(capture_task::run(
        board.camera,
        board.capture,
        format,
    )));
    Foreground {
        sensor,
        model,
        bands: board.bands,
        snapshots: board.snapshots,
    }
}

/// Configures the pipeline for the camera's frames and the kept settings; returns the pixel format
/// that it needs.
fn configure(sensor: &mut Sensor, file: &ModelFile, kept: &Record) -> Format {
    let model = file.model();
    let settings = model::fitting().settings(model.as_ref(), kept.threshold);
    if sensor.configure(settings, model).is_err() {
        panic!("the built-in settings are out of range");
    }
    sensor.set_motion(camera::fitted().motion);
    settings::set_down(kept.down);
    sensor.set_down(settings::down());
    if settings::set_contact_shape(kept.contact_shape).is_err() {
        defmt::warn!("the kept radius of what presses is out of range");
    }
    sensor.set_contact_shape(settings::contact_shape());
    hivtac_portable::device::model::start(sensor, kept, |unusable| {
        defmt::warn!(
            "a kept setting cannot be used: {}",
            defmt::Debug2Format(&unusable)
        );
    });
    settings::follow(sensor, file.source);
    // Always a format that the camera sends.
    Format::of(sensor.threshold().format()).unwrap_or(camera::USUAL_FORMAT)
}

/// Sets the camera's initial settings to the kept ones.
fn set_camera(kept: CameraSettings) {
    match camera::limits().check(&kept) {
        Ok(()) => camera::tell(kept),
        Err(_) => defmt::warn!("the kept exposure or gain is out of the camera's range"),
    }
}

/// Returns the token of a task. Each task is started once, at boot; a second start would be a bug
/// in this file.
fn token<S, E>(result: Result<SpawnToken<S>, E>) -> SpawnToken<S> {
    match result {
        Ok(token) => token,
        Err(_) => panic!("a task was started twice"),
    }
}

#[interrupt]
unsafe fn UART4() {
    // SAFETY: this is the executor's interrupt, and nobody else calls it.
    unsafe { CAPTURE_EXECUTOR.on_interrupt() }
}

#[interrupt]
unsafe fn UART5() {
    // SAFETY: as above.
    unsafe { USB_EXECUTOR.on_interrupt() }
}
