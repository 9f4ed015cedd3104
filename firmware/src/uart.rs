//! Also sends the samples over a UART, for a robot's controller without USB, or a second reader.
//!
//! # Design
//! It is always on and only sends, so it needs neither a host nor a setting. The messages and
//! frames are USB's. A hello and the statistics go out once a second each; in between goes every
//! sample, without markers. So a reader may join at any time, and knows device and version a second
//! later.
//!
//! # Note
//! The line takes 200,000 bytes a second; samples need less than a tenth of that. A sample that
//! finds the queue full is dropped. Samples have numbers of their own here, so the reader counts it
//! as a gap.

use crate::board::UartPort;
use crate::{info, stats};
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_futures::select::{Either, select};
use embassy_stm32::usart::{Config, UartTx};
use embassy_stm32::{bind_interrupts, dma, peripherals};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Ticker};
use hivtac_terms::marker::MarkerList;
use hivtac_wire::frame::{MAX_DEVICE_FRAME, encode};
use hivtac_wire::message::{DeviceMessage, Sample};
use hivtac_wire::uart::BAUD;

/// Hello and statistics take turns at this pace.
const TURN: Duration = Duration::from_millis(500);

/// Samples for the line. From the pipeline.
#[unsafe(link_section = ".sram.uart_samples")]
static UART_SAMPLES: Channel<CriticalSectionRawMutex, Sample, 2> = Channel::new();
/// Number of samples produced for the line, dropped ones included. Of the pipeline.
static UART_SEQUENCE: AtomicU32 = AtomicU32::new(0);

type Frame = [u8; MAX_DEVICE_FRAME];

/// The frame that the DMA reads: in AXI SRAM, within its reach and not cached.
#[unsafe(link_section = ".axisram.uart")]
static mut UART_FRAME: MaybeUninit<Frame> = MaybeUninit::uninit();

bind_interrupts!(struct Irqs {
    DMA2_STREAM0 => dma::InterruptHandler<peripherals::DMA2_CH0>;
});

/// Queues a sample, or drops it.
pub fn offer(sample: Sample) {
    let number = UART_SEQUENCE.load(Ordering::Relaxed).wrapping_add(1);
    UART_SEQUENCE.store(number, Ordering::Relaxed);
    // Without space it is dropped; the gap in numbers shows it.
    let _ = UART_SAMPLES.try_send(Sample {
        sequence: number,
        markers: MarkerList::default(),
        ..sample
    });
}

/// Runs for ever at the USB executor's priority.
#[embassy_executor::task]
pub async fn run(port: UartPort) {
    let mut config = Config::default();
    config.baudrate = BAUD;
    let Ok(mut line) = UartTx::new(port.usart, port.pin, port.dma, Irqs, config) else {
        defmt::error!("the UART's clock does not make its rate");
        return;
    };
    let frame = frame();
    let mut turns = Ticker::every(TURN);
    let mut hello_is_next = true;
    loop {
        let message = match select(UART_SAMPLES.receive(), turns.next()).await {
            Either::First(sample) => DeviceMessage::Sample(sample),
            Either::Second(()) => introduction(&mut hello_is_next),
        };
        let Ok(bytes) = encode(&message, frame) else {
            defmt::error!("a message is longer than the longest frame");
            continue;
        };
        // It never fails: it only sends.
        let _ = line.write(bytes).await;
    }
}

/// A hello, or the statistics, in turn.
fn introduction(hello_is_next: &mut bool) -> DeviceMessage {
    let is_hello = *hello_is_next;
    *hello_is_next = !is_hello;
    match is_hello {
        true => DeviceMessage::Hello(info::hello()),
        false => DeviceMessage::Stats(stats::snapshot()),
    }
}

/// The memory of the frame. Call once.
fn frame() -> &'static mut Frame {
    let frame = &raw mut UART_FRAME;
    // SAFETY: the task is started once and calls this once, so that no other reference is made.
    let frame = unsafe { &mut *frame };
    // Written whole, so that the memory's error correction codes are defined.
    frame.write([0; MAX_DEVICE_FRAME])
}
