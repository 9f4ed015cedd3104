//! Counts events that the USB driver's interrupt handler does not report: SETUPs, and packets that
//! left.

use core::future::poll_fn;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Poll;
use embassy_stm32::interrupt::typelevel::{Handler, OTG_FS};
use embassy_stm32::pac::USB_OTG_FS as CORE;
use embassy_sync::waitqueue::AtomicWaker;
use embassy_time::{Duration, Instant, Ticker};

use crate::{session, usb_core};

/// SETUPs so far. This and the following two are written by the USB interrupt, and read by the USB
/// tasks.
static SETUPS: AtomicU32 = AtomicU32::new(0);
/// Packets of samples and answers that a host took so far.
static DEPARTED: AtomicU32 = AtomicU32::new(0);
/// Wakes who waits for a SETUP or a bus reset.
static WAITING: AtomicWaker = AtomicWaker::new();

/// Period at which [`rescue_needed`] looks.
const LOOK: Duration = Duration::from_millis(100);
/// A host that says hello waits for the answer, but no longer than this.
const UNANSWERED: Duration = Duration::from_secs(2);

/// The part of the interrupt handler that runs before the driver's, which clears the flags.
pub struct Watch;

impl Handler<OTG_FS> for Watch {
    unsafe fn on_interrupt() {
        let flags = CORE.gintsts().read();
        if flags.iepint() {
            count_departed();
        }
        let setup = flags.oepint() && CORE.doepint(0).read().stup();
        if setup {
            increment(&SETUPS);
        }
        if setup || flags.usbrst() || flags.enumdne() {
            WAITING.wake();
        }
    }
}

fn count_departed() {
    let mut endpoints = CORE.daint().read().iepint() & !1;
    while endpoints != 0 {
        if CORE
            .diepint(endpoints.trailing_zeros() as usize)
            .read()
            .xfrc()
        {
            increment(&DEPARTED);
        }
        endpoints &= endpoints - 1;
    }
}

/// Adds 1 to a counter that only the interrupt handler writes.
fn increment(counter: &AtomicU32) {
    counter.store(
        counter.load(Ordering::Relaxed).wrapping_add(1),
        Ordering::Relaxed,
    );
}

/// SETUPs so far.
pub fn setups() -> u32 {
    SETUPS.load(Ordering::Relaxed)
}

/// Waits for another SETUP than the first `served` ones.
pub async fn another_setup(served: u32) {
    wait_for(|| setups() != served).await;
}

/// Waits until a control transfer is cut off: another SETUP came than the first `served` ones, or a
/// bus reset.
pub async fn cut_off(served: u32) {
    wait_for(|| setups() != served || usb_core::is_reset()).await;
}

async fn wait_for(condition: impl Fn() -> bool) {
    poll_fn(|context| {
        WAITING.register(context.waker());
        match condition() {
            true => Poll::Ready(()),
            false => Poll::Pending,
        }
    })
    .await;
}

/// Waits until USB is dead for a reason that nothing else handles: a bus reset is not served, or a
/// host said hello and cannot have the answer.
pub async fn rescue_needed() {
    let mut ticker = Ticker::every(LOOK);
    let mut was_reset = false;
    let mut heard = Heard::now();
    loop {
        ticker.next().await;
        let is_reset = usb_core::is_reset();
        if was_reset && is_reset || heard.is_unanswered() {
            return;
        }
        was_reset = is_reset;
    }
}

/// A conversation in which no packet has left so far.
struct Heard {
    conversation: u32,
    departed: u32,
    since: Instant,
}

impl Heard {
    fn now() -> Self {
        Self {
            conversation: session::number(),
            departed: DEPARTED.load(Ordering::Relaxed),
            since: Instant::now(),
        }
    }

    /// True if its hello has waited for too long, on a bus that is not suspended.
    fn is_unanswered(&mut self) -> bool {
        let now = Self::now();
        if self.conversation != now.conversation || usb_core::is_suspended() {
            *self = now;
            return false;
        }
        let waited = now.since.saturating_duration_since(self.since);
        session::is_open() && self.departed == now.departed && waited >= UNANSWERED
    }
}
