//! Receives from several sensors at once, with a thread for each, so that they do not wait for each
//! other.

use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_wire::message::{DeviceMessage, Request};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::{Duration, Instant};

/// Longest wait for a message between two checks whether the recording is over.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Silence after which a device counts as gone.
const SILENCE: Duration = Duration::from_secs(10);

/// A message of a sensor.
pub struct Arrival {
    /// The sensor's index, from 0.
    pub sensor: usize,
    /// The receive time.
    pub at: Instant,
    /// The message.
    pub message: DeviceMessage,
}

/// When sensors stop streaming.
struct Until<'f> {
    /// Time for which samples flow; `None` for no limit.
    duration: Option<Duration>,
    /// True after a failure: no more messages are kept.
    is_over: &'f AtomicBool,
}

/// Has all sensors stream for some time (`None` for no limit), or until one fails or `keep`, which
/// gets all their messages, returns.
///
/// # Errors
/// That of `keep`, or the first of a sensor.
pub fn listen_to_all(
    links: &mut [Link],
    patience: Duration,
    duration: Option<Duration>,
    keep: impl FnOnce(&Receiver<Arrival>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let is_over = AtomicBool::new(false);
    let until = &Until {
        duration,
        is_over: &is_over,
    };
    let (sender, arrivals) = mpsc::channel();
    std::thread::scope(|scope| {
        let each = links.iter_mut().enumerate();
        let threads: Vec<_> = each
            .map(|(sensor, link)| {
                let sender = sender.clone();
                scope.spawn(move || {
                    let result = listen(link, sensor, patience, until, &sender);
                    if result.is_err() {
                        until.is_over.store(true, Ordering::Relaxed);
                    }
                    result
                })
            })
            .collect();
        drop(sender);
        let kept = keep(&arrivals);
        is_over.store(true, Ordering::Relaxed);
        let results = threads.into_iter().map(|thread| match thread.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        std::iter::once(kept).chain(results).collect()
    })
}

/// Has a sensor stream until the end; passes on all its messages, including its last counters.
fn listen(
    link: &mut Link,
    sensor: usize,
    patience: Duration,
    until: &Until,
    arrivals: &Sender<Arrival>,
) -> Result<(), Failure> {
    let hand_over = |message| {
        let at = Instant::now();
        // The receiver is gone when the file could not be written.
        let _ = arrivals.send(Arrival {
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
