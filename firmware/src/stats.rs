//! Counts events since boot, from every task and handler.

use crate::vsync;
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_time::{Duration, Instant};
use hivtac_wire::message::Stats;

/// The time since `begun`; 0 if the clock is behind it, where a subtraction would panic. The clock
/// goes back if its interrupt is late by more than half a turn of its timer.
pub fn since(begun: Instant) -> Duration {
    Instant::now().saturating_duration_since(begun)
}

/// A counter that stops at its largest value.
pub struct Counter(AtomicU32);

impl Counter {
    const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// Adds one.
    pub fn count(&self) {
        self.add(1);
    }

    /// Adds `n`.
    pub fn add(&self, n: u32) {
        let saturating = |value: u32| Some(value.saturating_add(n));
        // Never fails: the closure always returns a value.
        let _ = self
            .0
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, saturating);
    }

    /// Replaces the value.
    pub fn set(&self, value: u32) {
        self.0.store(value, Ordering::Relaxed);
    }

    fn get(&self) -> u32 {
        self.0.load(Ordering::Relaxed)
    }
}

/// Number of the last frame before the camera's set-up, while the set-up lasts. Written by the
/// capture task; read by the USB tasks.
static PASSING_OVER: AtomicU32 = AtomicU32::new(NOT_PASSING);

/// [`PASSING_OVER`] while the camera is not being set up.
const NOT_PASSING: u32 = u32::MAX;

/// Counts every frame after number `last` as dropped, from now on.
pub fn pass_over_frames_after(last: u32) {
    PASSING_OVER.store(last, Ordering::Relaxed);
}

/// Ends this; `newest` is the last such frame.
pub fn end_passing_over(newest: u32) {
    DROPPED_SETUP.add(passed_over(newest));
    PASSING_OVER.store(NOT_PASSING, Ordering::Relaxed);
}

fn passed_over(newest: u32) -> u32 {
    match PASSING_OVER.load(Ordering::Relaxed) {
        NOT_PASSING => 0,
        last => newest.wrapping_sub(last),
    }
}

macro_rules! counters {
    ($($name:ident => $field:ident, $writers:literal;)*) => {
        $(
            #[doc = concat!("[`Stats::", stringify!($field), "`]. Written by the ", $writers, ".")]
            pub static $name: Counter = Counter::new();
        )*

        /// Returns all counters. Each is exact; they are read one after the other.
        pub fn snapshot() -> Stats {
            let frames_exposed = vsync::newest().number;
            let mut stats = Stats {
                frames_exposed,
                uptime_us: Instant::now().as_micros(),
                $($field: $name.get(),)*
            };
            let passed = passed_over(frames_exposed);
            stats.dropped_setup = stats.dropped_setup.saturating_add(passed);
            stats
        }
    };
}

counters! {
    FRAMES_PROCESSED => frames_processed, "pipeline";
    DROPPED_BUSY => dropped_busy, "pipeline";
    DROPPED_OVERRUN => dropped_overrun, "pipeline";
    DROPPED_SIZE => dropped_size, "pipeline";
    DROPPED_SETUP => dropped_setup, "pipeline and the capture task";
    CAMERA_TIMEOUTS => camera_timeouts, "capture task";
    CAMERA_RESTARTS => camera_restarts, "capture task";
    CAPTURE_OVERRUNS => capture_overruns, "capture handlers";
    USB_DROPPED => usb_dropped, "pipeline and the USB tasks";
    HOST_FRAMES_REJECTED => host_frames_rejected, "USB tasks";
    PROCESSING_US => processing_us, "pipeline";
    LATENCY_US => latency_us, "pipeline";
}
