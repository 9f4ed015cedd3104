//! The thread of a device that is served: what it says goes to the outlets, and it takes a tare
//! when that is asked for.

use super::diagnosis::diagnose;
use crate::clock::{Clock, now_ns};
use crate::follow::{Follower, note_connected_again};
use crate::output::note;
use crate::ros::Diagnosis;
use crate::tare::usual_tare;
use crate::view::state::State;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::{Link, log_text};
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

/// What a device has to tell.
pub enum What {
    /// A sample, whose frame was exposed at a time, ns since 1970.
    Sample(Box<Sample>, u64),
    /// How it stands.
    Diagnosis(Diagnosis),
}

/// Something to publish.
pub struct Event {
    /// Of which device, from 0.
    pub sensor: usize,
    /// When it came, ns since 1970.
    pub came_ns: u64,
    /// What it is.
    pub what: What,
}

/// That a tare was taken, in words for a person, or why not.
pub type Answer = Result<String, String>;

/// Takes a tare; whoever asked gets the answer here.
pub struct TareOrder(pub SyncSender<Answer>);

/// What was told last of gravity on a device and is not passed on yet.
pub type Told = Arc<Mutex<Option<Down>>>;

/// A device that is served.
pub struct Sensor {
    number: usize,
    patience: Duration,
    state: State,
    clock: Clock,
    /// Bits of the samples since the last diagnosis, and whether there were any.
    since: Option<Status>,
    diagnosed: Instant,
    lost: Option<Instant>,
    events: SyncSender<Event>,
    orders: Receiver<TareOrder>,
    down: Told,
    not_published: Arc<AtomicU64>,
}

impl Sensor {
    /// The device with this number, connected at a port. `not_published` counts samples that an
    /// outlet did not take.
    pub fn new(
        number: usize,
        patience: Duration,
        (port, hello): (String, DeviceHello),
        events: SyncSender<Event>,
        (orders, down): (Receiver<TareOrder>, Told),
        not_published: Arc<AtomicU64>,
    ) -> Sensor {
        Sensor {
            number,
            patience,
            state: State::new(port, hello),
            clock: Clock::default(),
            since: None,
            diagnosed: Instant::now(),
            lost: None,
            events,
            orders,
            down,
            not_published,
        }
    }

    /// Takes in what the device said at a time, ns since 1970.
    fn take(&mut self, message: DeviceMessage, came_ns: u64) {
        self.state.take(&message);
        match message {
            DeviceMessage::Sample(sample) => {
                let stamp_ns = self.clock.stamp_ns(sample.time_us, came_ns);
                let since = self.since.unwrap_or_default();
                self.since = Some(since | sample.status);
                self.tell(came_ns, What::Sample(Box::new(sample), stamp_ns));
            }
            DeviceMessage::Log(line) => note(&log_text(&line)),
            _ => (),
        }
    }

    /// Hands something over; it is counted when the outlets are too slow for it.
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
        link.request(request, patience, |message| self.take(message, now_ns()))?;
        Ok(done)
    }

    /// Does what is ordered; a refusal is an answer, a lost connection an end, too.
    fn obey(&mut self, link: &mut Link, order: &TareOrder) -> Result<(), Failure> {
        let done = self.tare(link);
        let answer = done.as_ref().map_err(ToString::to_string).cloned();
        // Whoever asked may be gone.
        let _ = order.0.try_send(answer);
        match done {
            Err(failure) if failure.kind != Kind::Refused => Err(failure),
            _ => Ok(()),
        }
    }
}

impl Follower for Sensor {
    fn message(&mut self, message: DeviceMessage) {
        self.take(message, now_ns());
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
        self.clock = Clock::default();
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
        let told = self
            .down
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        if let Some((link, down)) = link.as_mut().zip(told) {
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
