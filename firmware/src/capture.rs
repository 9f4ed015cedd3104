//! The camera interface (DCMI): one frame at a time into a buffer, whatever the camera does.
//!
//! # Design
//! Snapshot mode. [`Capture::frame`] arms DMA and DCMI; DCMI waits for the end of the vertical blanking, passes the
//! frame's words to the DMA, and raises one interrupt: frame complete (at the next blanking) or overrun. The handler
//! takes down which VSYNC edge began the frame, and masks further interrupts until the next arming. A frame is good
//! when the DMA got exactly its number of words and DCMI's FIFO is empty. After anything else the peripheral is
//! reset and set up anew, because an overrun leaves a snapshot hanging for ever.
//!
//! # Note
//! Deadlines, for 39 frames a second (line 92 µs):
//! - *Re-arming*: within the VSYNC pulse that ends a frame, 4 lines or 370 µs. When missed, the next frame is not
//!   captured; it shows as a gap in the frame numbers and in `dropped_busy`.
//! - *The DCMI handler*: within the same pulse. When missed, a frame would carry the number of its successor. Nothing
//!   below it in priority can delay it; critical sections last some µs.
//! - *The DMA*: DCMI's FIFO holds 4 words, 1.3 µs at 12.5 MB/s. When missed, DCMI reports an overrun: the frame is
//!   dropped and counted.
//!
//! # Limitations
//! One frame is one DMA transfer (see `frame_dma`). The CPU must be woken between frames. A frame in which the camera
//! lost bytes and gained as many is not noticed.

use crate::camera::{self, FRAME_TIME};
use crate::frame::Frame;
use crate::frame_dma::{FrameDma, Running};
use crate::seeded_bugs::INVERTED_POLARITIES;
use crate::vsync::{self, Edge};
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::dcmi::regs::Ier;
use embassy_stm32::pac::{DCMI, RCC};
use embassy_stm32::{Peri, peripherals, rcc};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, with_timeout};

/// With no event for so long the camera counts as silent: no frame takes longer than two frame times from arming.
const SILENCE: Duration = Duration::from_micros(4 * FRAME_TIME.as_micros());

/// Why there is no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub enum Failure {
    /// The DMA was too slow for DCMI's FIFO.
    Overrun,
    /// The camera sent fewer or more bytes than a frame has.
    Size,
    /// The camera sent nothing, or no end of frame, for four frame times.
    Silence,
}

/// What the interrupt handler saw.
enum Event {
    FrameEnd(Edge),
    Overrun(Edge),
}

static EVENT: Signal<CriticalSectionRawMutex, Event> = Signal::new();

/// DCMI and its DMA stream.
pub struct Capture {
    dma: FrameDma,
    _dcmi: Peri<'static, peripherals::DCMI>,
}

impl Capture {
    /// Clocks and sets up the peripheral.
    pub fn new(dcmi: Peri<'static, peripherals::DCMI>, dma: FrameDma) -> Self {
        rcc::enable_and_reset::<peripherals::DCMI>();
        set_up();
        interrupt::DCMI.unpend();
        // SAFETY: the handler below shares only `EVENT` and DCMI's flags.
        unsafe { interrupt::DCMI.enable() };
        Self { dma, _dcmi: dcmi }
    }

    /// Captures the next frame that begins into `frame`. Returns the VSYNC edge that began it; on failure, the edge
    /// of the frame that was lost, if one had begun.
    pub async fn frame(&mut self, frame: &mut Frame) -> Result<Edge, (Failure, Edge)> {
        let transfer = self.dma.start(DCMI.dr().as_ptr().cast(), frame);
        arm();
        let result = match with_timeout(SILENCE, EVENT.wait()).await {
            Ok(Event::FrameEnd(edge)) => whole(&transfer, edge),
            Ok(Event::Overrun(edge)) if transfer.missing() == 0 => Err((Failure::Size, edge)),
            Ok(Event::Overrun(edge)) => Err((Failure::Overrun, edge)),
            Err(_) => Err((Failure::Silence, vsync::newest())),
        };
        drop(transfer);
        if result.is_err() {
            restore();
        }
        result
    }
}

/// Judges a frame that DCMI calls complete.
fn whole(transfer: &Running, edge: Edge) -> Result<Edge, (Failure, Edge)> {
    /// Polls for the frame's last words, which may still be under way. They need some bus cycles.
    const PATIENCE: u32 = 64;
    for _ in 0..PATIENCE {
        if transfer.missing() == 0 || !DCMI.sr().read().fne() {
            break;
        }
    }
    let surplus = DCMI.sr().read().fne() || DCMI.ris().read().ovr_ris();
    if transfer.missing() == 0 && !surplus {
        Ok(edge)
    } else {
        Err((Failure::Size, edge))
    }
}

/// Configures DCMI to what the camera's registers were set to: 8 bits, hardware synchronization, snapshot.
fn set_up() {
    DCMI.cr().write(|w| {
        w.set_cm(true);
        w.set_pckpol(camera::SAMPLE_ON_RISING_EDGE != INVERTED_POLARITIES);
        w.set_vspol(camera::VSYNC_BLANKING_IS_HIGH != INVERTED_POLARITIES);
        w.set_hspol(camera::HREF_BLANKING_IS_HIGH != INVERTED_POLARITIES);
    });
}

/// Lets DCMI wait for the next frame.
fn arm() {
    EVENT.reset();
    clear_flags();
    DCMI.ier().write(|w| {
        w.set_frame_ie(true);
        w.set_ovr_ie(true);
    });
    DCMI.cr().modify(|w| w.set_enable(true));
    DCMI.cr().modify(|w| w.set_capture(true));
}

/// Brings DCMI back from any state.
fn restore() {
    DCMI.ier().write_value(Ier(0));
    RCC.ahb2rstr().modify(|w| w.set_dcmirst(true));
    RCC.ahb2rstr().modify(|w| w.set_dcmirst(false));
    set_up();
}

fn clear_flags() {
    DCMI.icr().write(|w| {
        w.set_frame_isc(true);
        w.set_ovr_isc(true);
        w.set_err_isc(true);
        w.set_vsync_isc(true);
        w.set_line_isc(true);
    });
}

#[embassy_stm32::interrupt]
fn DCMI() {
    let edge = vsync::newest();
    let overrun = DCMI.mis().read().ovr_mis();
    // One event for each arming.
    DCMI.ier().write_value(Ier(0));
    EVENT.signal(if overrun {
        Event::Overrun(edge)
    } else {
        Event::FrameEnd(edge)
    });
}
