//! The thread of a served device: it passes messages to the outlets, and takes a tare when asked.

use super::diagnosis::diagnose;
use crate::follow::{Follower, note_connected_again};
use crate::output::note;
use hivtac_host::clock::{Arrival, LiveClock, now_ns};
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::page::State;
use hivtac_host::reply::log_text;
use hivtac_host::ros::Diagnosis;
use hivtac_host::usual_tare::usual_tare;
use hivtac_terms::down::Down;
use hivtac_terms::status::Status;
use hivtac_wire::decoder::Rejected;
use hivtac_wire::message::{DeviceHello, DeviceMessage, Sample};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time between two diagnoses.
const DIAGNOSE_EVERY: Duration = Duration::from_secs(1);

/// The content of an event.
pub enum What {
    /// A sample, with the time of its exposure, ns since 1970.
    Sample(Box<Sample>, u64),
    /// The device's state.
    Diagnosis(Diagnosis),
}

/// Something to publish.
pub struct Event {
    /// The device's index, from 0.
    pub sensor: usize,
    /// Receive time, ns since 1970.
    pub came_ns: u64,
    /// The content.
    pub what: What,
}

/// Text for a person: that a tare was taken, or why not.
pub type Answer = Result<String, String>;

/// An order to take a tare, with the sender of its answer.
pub struct TareOrder(pub SyncSender<Answer>);

/// The last direction of gravity set for a device; `None` once it was passed on.
pub type NextDown = Arc<Mutex<Option<Down>>>;

/// A device that is served.
pub struct Sensor {
    number: usize,
    patience: Duration,
    state: State,
    clock: LiveClock,
    /// Bits of the samples since the last diagnosis; `None` if there were no samples.
    since: Option<Status>,
    diagnosed: Instant,
    lost: Option<Instant>,
    events: SyncSender<Event>,
    orders: Receiver<TareOrder>,
    down: NextDown,
    not_published: Arc<AtomicU64>,
}

impl Sensor {
    /// The device with this number, connected at a port. `not_published` counts the samples that an
    /// outlet did not take.
    pub fn new(
        number: usize,
        patience: Duration,
        (port, hello): (String, DeviceHello),
        events: SyncSender<Event>,
        (orders, down): (Receiver<TareOrder>, NextDown),
        not_published: Arc<AtomicU64>,
    ) -> Sensor {
        Sensor {
            number,
            patience,
            state: State::new(port, hello),
            clock: LiveClock::default(),
            since: None,
            diagnosed: Instant::now(),
            lost: None,
            events,
            orders,
            down,
            not_published,
        }
    }

    /// Handles a message that has just arrived.
    fn take(&mut self, message: DeviceMessage) {
        let came = Arrival::now();
        self.state.take(&message);
        match message {
            DeviceMessage::Sample(sample) => {
                let stamp_ns = self.clock.stamp_ns(sample.time_us, came);
                let since = self.since.unwrap_or_default();
                self.since = Some(since | sample.status);
                self.tell(came.ns, What::Sample(Box::new(sample), stamp_ns));
            }
            DeviceMessage::Stats(stats) => self.clock.latency(stats.latency_us),
            DeviceMessage::Log(line) => note(&log_text(&line)),
            _ => (),
        }
    }

    /// Hands an event to the outlets, and counts a sample that they are too slow for.
    fn tell(&mut self, came_ns: u64, what: What) {
        let is_sample = matches!(what, What::Sample(..));
        let event = Event {
            sensor: self.number,
            came_ns,
            what,
        };
        if self.events.try_send(event).is_err() && is_sample {
            self.not_published.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn diagnose(&mut self) {
        self.diagnosed = Instant::now();
        let not_published = self.not_published.load(Ordering::Relaxed);
        let diagnosis = diagnose(&self.state, self.since.take(), not_published);
        self.tell(now_ns(), What::Diagnosis(diagnosis));
    }

    fn tare(&mut self, link: &mut Link) -> Result<String, Failure> {
        let (request, patience, done) = usual_tare(self.patience);
        link.request(request, patience, |message| self.take(message))?;
        Ok(done)
    }

    /// Carries out an order. A refusal is only an answer; a lost connection is returned, too.
    fn obey(&mut self, link: &mut Link, order: &TareOrder) -> Result<(), Failure> {
        let done = self.tare(link);
        let answer = done.as_ref().map_err(ToString::to_string).cloned();
        // The sender of the order may be gone.
        let _ = order.0.try_send(answer);
        match done {
            Err(failure) if failure.kind != Kind::Refused => Err(failure),
            _ => Ok(()),
        }
    }
}

impl Follower for Sensor {
    fn message(&mut self, message: DeviceMessage) {
        self.take(message);
    }

    fn lost(&mut self, failure: Failure, rejected: Rejected) {
        self.state.tally.rejected(rejected);
        if failure.kind != Kind::Interrupted {
            note(&format!("hivtac: {failure}"));
            self.lost = Some(Instant::now());
        }
        self.state.trouble(failure.to_string());
        self.diagnose();
    }

    fn connected_again(&mut self, hello: DeviceHello) {
        self.state.connected_again(hello);
        self.clock = LiveClock::default();
        if let Some(lost) = self.lost.take() {
            note_connected_again(&self.state.port, lost);
        }
    }

    fn trouble(&mut self, why: String) {
        if self.state.trouble.as_deref() != Some(&why) {
            note(&format!("hivtac: {why}"));
        }
        self.state.trouble(why);
        self.diagnose();
    }

    fn turn(&mut self, mut link: Option<&mut Link>) -> Result<bool, Failure> {
        if self.diagnosed.elapsed() >= DIAGNOSE_EVERY {
            self.diagnose();
        }
        let next = self
            .down
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        if let Some((link, down)) = link.as_mut().zip(next) {
            link.set_down(down)?;
        }
        let mut is_asked = false;
        while let Ok(order) = self.orders.try_recv() {
            match &mut link {
                Some(link) => self.obey(link, &order)?,
                None => {
                    let why = "the device is not there; is its cable pulled?".to_owned();
                    let _ = order.0.try_send(Err(why));
                }
            }
            is_asked = true;
        }
        Ok(is_asked)
    }
}
