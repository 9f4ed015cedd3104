//! Listening to several sensors at once: a thread for each, so that none waits for another.

use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_wire::message::{DeviceMessage, Request};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

/// Longest wait for a message before it is looked whether all is over.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// A device that sends nothing for so long is gone.
const SILENCE: Duration = Duration::from_secs(10);

/// What a sensor said.
pub struct Heard {
    /// Which of the sensors, from 0.
    pub sensor: usize,
    /// When it came.
    pub at: Instant,
    /// What came.
    pub message: DeviceMessage,
}

/// How long is listened.
pub struct Until<'f> {
    /// How long samples flow; none: until something ends it.
    pub duration: Option<Duration>,
    /// True when something went wrong: nothing more is kept.
    pub is_over: &'f AtomicBool,
}

/// Has a sensor stream until the end, and hands over all that it says, its last counters too.
pub fn listen(
    link: &mut Link,
    sensor: usize,
    patience: Duration,
    until: &Until,
    heard: &Sender<Heard>,
) -> Result<(), Failure> {
    let hand_over = |message| {
        let at = Instant::now();
        // Nobody takes it any more when the file cannot be written.
        let _ = heard.send(Heard {
            sensor,
            at,
            message,
        });
    };
    for request in [Request::GetInfo, Request::StartWithMarkers] {
        link.request(request, patience, hand_over)?;
    }
    let mut last = Instant::now();
    let end = until.duration.map(|duration| last + duration);
    let is_over = || until.is_over.load(Ordering::Relaxed);
    while end.is_none_or(|end| Instant::now() < end) && !is_over() {
        let look = Instant::now() + LOOK_EVERY;
        if let Some(message) = link.receive(end.map_or(look, |end| end.min(look)))? {
            last = Instant::now();
            hand_over(message);
        }
        if last.elapsed() >= SILENCE {
            return Err(link.lost("the device sends nothing"));
        }
    }
    for request in [Request::Stop, Request::GetInfo] {
        link.request(request, patience, hand_over)?;
    }
    Ok(())
}
