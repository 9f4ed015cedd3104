//! Captures every frame with the camera interface (DCMI) in continuous mode, whatever the camera
//! does.
//!
//! # Design
//! DCMI and its DMA run without a pause. The DMA writes *bands* of 8 rows into a ring of 32 slots
//! in AXI SRAM (`bands`). The ring holds slightly more than a frame at 320 × 240, four tenths of
//! one at 800 × 600. Each finished band causes one interrupt, as do the end of a frame (the VSYNC
//! pulse) and an overrun. The handlers follow `hivtac_portable::capture::Tracker`, and pass its
//! events to the pipeline. The pipeline has finished bands copied to DTCM (`band_copy`) and scans
//! one while the next ones arrive. A frame is measured as soon as its last band is scanned. If more
//! data follows, it counts as too long, and the next sample reports a lost frame.
//!
//! After any unexpected event, DCMI is reset and set up anew, and the DMA begins a new band: the
//! next frame is captured from its beginning. Between two good frames the hardware is not touched.
//!
//! # Note
//! Coherence: the core never reads the ring (see `band_copy`).
//!
//! Deadlines at 156 frames a second (line 23 µs, band 184 µs, frame 6.4 ms); at 78 and 39 frames a
//! second all are two and four times longer:
//! - *The DMA*: DCMI's FIFO holds 4 words, 0.32 µs at 50 MB/s, 76 bus cycles. A word takes some ten
//!   of them, and a burst of the MDMA holds AXI SRAM for 16 to 32 (estimates, not measured). If
//!   missed, DCMI reports an overrun: the frame is dropped and counted.
//! - *The handler of a band*: until the end of the next band, 184 µs. If missed, the DMA overwrites
//!   a band. The handler then sees that the DMA changed its target twice, or that the frame's
//!   number of bands is wrong: the frame is dropped.
//! - *The handler of a frame's end*: within the VSYNC pulse, 92 µs. If missed after a good frame,
//!   the frame counts as dropped; if missed after a bad one, the next frame is not captured either.
//! - *The pipeline*: a band is overwritten 30 bands after it was finished, 5.5 ms. If missed, its
//!   frame is dropped and counted as `dropped_busy`; the camera never waits.
//!
//! # Limitations
//! A frame in which the camera lost bytes and gained the same number is not detected. Neither is a
//! handler of a band that was late by exactly two bands in a frame that was too long by two bands.

use crate::band_dma::BandDma;
use crate::bands::SHAPE;
use crate::camera::{self, Format, USUAL_FORMAT};
use crate::seeded_bugs;
use crate::{stats, vsync};
use core::cell::{Cell, RefCell};
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac::{DCMI, RCC};
use embassy_stm32::{Peri, peripherals, rcc};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use hivtac_portable::capture::{Edge, Event, Interface, Tracker};

/// The tracker and the hardware that it directs. Used by the capture handlers, the capture task and
/// the pipeline, one at a time.
static CAPTURE: CriticalSectionMutex<RefCell<Option<Running>>> =
    CriticalSectionMutex::new(RefCell::new(None));

/// Pixel format of the captured frames. Written by the capture task while the capture is stopped;
/// read by the capture handlers and the capture task.
static CAPTURED_FORMAT: CriticalSectionMutex<Cell<Format>> =
    CriticalSectionMutex::new(Cell::new(USUAL_FORMAT));

/// Number of bands finished since boot, modulo 2³². Written by whoever uses [`CAPTURE`]; read by
/// the pipeline.
static BANDS_FINISHED: AtomicU32 = AtomicU32::new(0);

/// Number of capture events so far, including lost ones. Written by the capture handlers and the
/// capture task; read by the capture task.
static CAPTURE_ACTIVITY: AtomicU32 = AtomicU32::new(0);

/// Capacity for waiting capture events: more than the bands that can still be whole.
const CAPTURE_EVENTS_WAITING: usize = 72;

/// Capture events in order. From the capture handlers and the capture task to the pipeline. If the
/// queue is full, a handler's event is lost; the pipeline detects that by the next one.
pub static CAPTURE_EVENTS: Channel<CriticalSectionRawMutex, CaptureEvent, CAPTURE_EVENTS_WAITING> =
    Channel::new();

/// An event, and the camera's pixel format since the last start.
#[derive(Clone, Copy)]
pub struct CaptureEvent {
    /// The event.
    pub event: Event,
    /// The frames' pixel format.
    pub format: Format,
}

/// The tracker, and the hardware that it directs.
struct Running {
    tracker: Tracker,
    hardware: Hardware,
}

/// DCMI and its DMA.
struct Hardware {
    dma: BandDma,
    _dcmi: Peri<'static, peripherals::DCMI>,
}

/// The camera interface, set up. Its owner starts and stops it.
pub struct Capture(());

impl Capture {
    /// Clocks the peripheral and enables its interrupts at `priority`, which must be the DMA's,
    /// too. Call once.
    pub fn new(dcmi: Peri<'static, peripherals::DCMI>, dma: BandDma, priority: Priority) -> Self {
        rcc::enable_and_reset::<peripherals::DCMI>();
        let running = Running {
            tracker: Tracker::new(SHAPE),
            hardware: Hardware { dma, _dcmi: dcmi },
        };
        CAPTURE.lock(|capture| capture.replace(Some(running)));
        for interrupt in [interrupt::DCMI, interrupt::DMA1_STREAM0] {
            interrupt.set_priority(priority);
            interrupt.unpend();
            // SAFETY: the handlers below share only `CAPTURE`, behind a mutex, and atomics.
            unsafe { interrupt.enable() };
        }
        Self(())
    }

    /// Returns the camera's pixel format.
    pub fn format(&self) -> Format {
        CAPTURED_FORMAT.lock(Cell::get)
    }

    /// Sets the pixel format that the camera sends from now on. Only while capture is stopped.
    pub fn set_format(&mut self, format: Format) {
        CAPTURED_FORMAT.lock(|cell| cell.set(format));
    }

    /// Captures from the next frame on. The event `passed` accounts for the frames before.
    pub async fn start(&mut self, passed: Event) {
        let format = self.format();
        let event = CaptureEvent {
            event: passed,
            format,
        };
        CAPTURE_EVENTS.send(event).await;
        act(|running, _| running.tracker.start(&mut running.hardware));
    }

    /// Stops capturing.
    pub fn stop(&mut self) {
        act(|running, _| running.tracker.stop(&mut running.hardware));
    }

    /// Restarts the capture after a silence.
    pub fn start_again(&mut self) {
        act(|running, mut tell| running.tracker.silence(&mut running.hardware, &mut tell));
    }

    /// Returns a number that changes whenever data comes from the camera: at least once a frame.
    pub fn activity(&self) -> u32 {
        CAPTURE_ACTIVITY.load(Ordering::Relaxed)
    }
}

/// Returns the number of bands finished since boot, modulo 2³².
pub fn finished() -> u32 {
    BANDS_FINISHED.load(Ordering::Acquire)
}

/// Returns whether data has come since the last band that an event reported.
pub fn has_begun_a_band() -> bool {
    let mut begun = true;
    act(|running, _| begun = running.hardware.has_begun_a_band());
    begun
}

/// Calls `what` with exclusive access to the tracker.
fn act(what: impl FnOnce(&mut Running, fn(Event))) {
    CAPTURE.lock(|capture| {
        // `what` never calls this function, so the value is never borrowed already.
        if let Ok(mut capture) = capture.try_borrow_mut()
            && let Some(running) = capture.as_mut()
        {
            what(running, tell);
            BANDS_FINISHED.store(running.tracker.finished(), Ordering::Release);
        }
    });
}

fn tell(event: Event) {
    CAPTURE_ACTIVITY.fetch_add(1, Ordering::Relaxed);
    let format = CAPTURED_FORMAT.lock(Cell::get);
    // A full queue is handled as described at `CAPTURE_EVENTS`.
    let _ = CAPTURE_EVENTS.try_send(CaptureEvent { event, format });
}

impl Interface for Hardware {
    fn restart(&mut self, first: u16, second: u16) {
        reset();
        let source = DCMI.dr().as_ptr().cast();
        self.dma.start(source, first, second);
        configure();
        DCMI.ier().write(|w| {
            w.set_frame_ie(true);
            w.set_ovr_ie(true);
        });
        DCMI.cr().modify(|w| w.set_enable(true));
        DCMI.cr().modify(|w| w.set_capture(true));
    }

    fn stop(&mut self) {
        reset();
        self.dma.halt();
    }

    fn take_finished(&mut self) -> bool {
        self.dma.take_finished()
    }

    fn writes_second(&self) -> bool {
        self.dma.fills_second()
    }

    fn aim(&mut self, slot: u16) {
        self.dma.aim(slot);
    }

    fn has_begun_a_band(&self) -> bool {
        self.dma.has_begun_a_band() || DCMI.sr().read().fne()
    }

    fn newest_edge(&self) -> Edge {
        vsync::newest()
    }
}

/// Resets DCMI in any state.
fn reset() {
    RCC.ahb2rstr().modify(|w| w.set_dcmirst(true));
    RCC.ahb2rstr().modify(|w| w.set_dcmirst(false));
}

/// Configures DCMI to match the camera's registers: 8 bits, hardware synchronization, continuous.
fn configure() {
    let inverts = seeded_bugs::inverts_polarities();
    DCMI.cr().write(|w| {
        w.set_pckpol(camera::SAMPLE_ON_RISING_EDGE != inverts);
        w.set_vspol(camera::VSYNC_BLANKING_IS_HIGH != inverts);
        w.set_hspol(camera::HREF_BLANKING_IS_HIGH != inverts);
    });
}

/// Waits until the DMA has written a frame's last words, which takes some bus cycles. The wait is
/// limited, because they may never come.
fn drain(dma: &BandDma) {
    const PATIENCE: u32 = 64;
    if seeded_bugs::leaves_last_words() {
        return;
    }
    for _ in 0..PATIENCE {
        if !DCMI.sr().read().fne() && dma.is_between_bands() {
            break;
        }
    }
}

#[embassy_stm32::interrupt]
fn DMA1_STREAM0() {
    act(|running, mut tell| {
        if running.hardware.dma.failed() {
            stats::CAPTURE_OVERRUNS.count();
            running.tracker.overrun(&mut running.hardware, &mut tell);
        } else {
            running
                .tracker
                .band_finished(&mut running.hardware, &mut tell);
        }
    });
}

#[embassy_stm32::interrupt]
fn DCMI() {
    act(|running, mut tell| {
        let flags = DCMI.mis().read();
        DCMI.icr().write(|w| {
            w.set_frame_isc(flags.frame_mis());
            w.set_ovr_isc(flags.ovr_mis());
        });
        if flags.ovr_mis() {
            stats::CAPTURE_OVERRUNS.count();
            running.tracker.overrun(&mut running.hardware, &mut tell);
        } else if flags.frame_mis() {
            drain(&running.hardware.dma);
            running
                .tracker
                .frame_ended(&mut running.hardware, &mut tell);
        }
    });
}
