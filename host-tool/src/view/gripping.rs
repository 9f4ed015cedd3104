//! The page's view of two fingers that grip together: the newest grip of their samples.

use crate::grip_command::Paired;
use hivtac_host::clock::{Arrival, LiveClock};
use hivtac_host::grip::{Grip, Reading, lines};
use hivtac_wire::message::DeviceMessage;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Age from which on a grip is not shown.
const OLD: Duration = Duration::from_secs(1);

/// Two fingers, each with its own thread.
#[derive(Clone)]
pub struct Gripping(Arc<Mutex<Both>>);

struct Both {
    paired: Paired,
    clocks: [LiveClock; 2],
    newest: Option<(Grip, Arrival)>,
}

impl Gripping {
    /// Two fingers that have sent nothing yet.
    pub fn new(paired: Paired) -> Gripping {
        Gripping(Arc::new(Mutex::new(Both {
            paired,
            clocks: Default::default(),
            newest: None,
        })))
    }

    /// Takes a message of a finger, 0 or 1.
    pub fn message(&self, finger: usize, message: &DeviceMessage) {
        let mut both = self.lock();
        match message {
            DeviceMessage::Stats(stats) => both.clocks[finger].latency(stats.latency_us),
            DeviceMessage::Sample(sample) => {
                let came = Arrival::now();
                let stamp_ns = both.clocks[finger].stamp_ns(sample.time_us, came);
                let reading = Reading::of(sample, stamp_ns, came.ns);
                let newest = both.paired.pair.push(finger, reading).pop();
                both.newest = newest.map(|grip| (grip, came)).or(both.newest);
            }
            _ => (),
        }
    }

    /// Forgets the grip: a finger is lost.
    pub fn lost(&self) {
        self.lock().newest = None;
    }

    /// The newest grip for a person; `None` before the first, and when a finger is silent.
    pub fn cause(&self) -> Option<String> {
        let both = self.lock();
        let (grip, came) = both.newest.as_ref()?;
        if came.at.elapsed() > OLD {
            return None;
        }
        Some(lines::sentence(grip, &both.paired.names))
    }

    fn lock(&self) -> MutexGuard<'_, Both> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
