//! Reads a connection in a thread of its own: each sample has the time of its arrival, however late
//! the program asks for it.
//!
//! The samples wait in a queue of [`ROOM`]. When it is full, the oldest is passed over. A program
//! that is slower than the sensor takes [`Reader::newest`], or sees [`Reader::missed`] grow.

use crate::clock::{Arrival, LiveClock};
use crate::failure::{Failure, Kind};
use crate::link::Link;
use crate::stop;
use hivtac_wire::message::{DeviceMessage, LogLine, Request, Sample};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Samples that wait for the program: 6.5 s at 156 a second.
pub const ROOM: usize = 1024;
/// Log lines that wait for the program.
const LINES: usize = 256;
/// Time between two looks for an order, while nothing comes from the device.
const LOOK_EVERY: Duration = Duration::from_millis(5);
/// Time between two looks whether the program shall end.
const ASK_EVERY: Duration = Duration::from_millis(50);
/// Silence after which a streaming device counts as gone.
const SILENCE: Duration = Duration::from_secs(10);

/// A sample, when it arrived, and when its frame was exposed.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrived {
    /// The sample.
    pub sample: Sample,
    /// Time of its arrival at this computer, ns since 1970.
    pub came_ns: u64,
    /// Time of its exposure by this computer's clock, ns since 1970: comparable with those of other
    /// devices (see [`LiveClock`]).
    pub exposed_ns: u64,
}

/// Takes messages that come while something else is waited for.
pub type Others<'a> = &'a mut dyn FnMut(DeviceMessage);

/// Work for the thread that has the connection; it returns whether the device streams from then on,
/// if that changed.
type Order = Box<dyn FnOnce(&mut Link, Others<'_>) -> Option<bool> + Send>;

/// A connection that a thread reads.
pub struct Reader {
    orders: Sender<Order>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    inbox: Mutex<Inbox>,
    /// Something came, or the connection is lost.
    news: Condvar,
    is_over: AtomicBool,
    /// Ends the order that is carried out.
    is_given_up: Arc<AtomicBool>,
}

#[derive(Default)]
struct Inbox {
    samples: VecDeque<Arrived>,
    lines: VecDeque<LogLine>,
    missed: u64,
    failure: Option<(Kind, String)>,
    clock: LiveClock,
}

impl Reader {
    /// Reads a connection from now on.
    pub fn start(link: Link) -> Reader {
        let (orders, asked) = mpsc::channel();
        let shared = Arc::new(Shared::default());
        let of_thread = shared.clone();
        let thread = std::thread::spawn(move || of_thread.read(link, &asked));
        Reader {
            orders,
            shared,
            thread: Some(thread),
        }
    }

    /// Asks the device to stream samples with their markers.
    ///
    /// # Errors
    /// Those of [`Link::request`].
    pub fn stream(&self, patience: Duration) -> Result<(), Failure> {
        self.order(Some(true), move |link, others| {
            // Its latency, for the first samples.
            link.request(Request::GetInfo, patience, &mut *others)?;
            link.request(Request::StartWithMarkers, patience, others)
        })
    }

    /// Waits for the next sample.
    ///
    /// # Errors
    /// [`Kind::Lost`] when the connection is lost, or nothing came for 10 s while it streams;
    /// [`Kind::Interrupted`].
    pub fn next_sample(&self) -> Result<Arrived, Failure> {
        self.waited(Inbox::next)
    }

    /// The next sample; `None` if none comes within this time.
    ///
    /// # Errors
    /// Those of [`Reader::next_sample`].
    pub fn next_within(&self, longest: Duration) -> Result<Option<Arrived>, Failure> {
        self.wait(Inbox::next, Some(longest))
    }

    /// The newest sample that the program has not seen; waits for one if necessary. Those before it
    /// are passed over.
    ///
    /// # Errors
    /// Those of [`Reader::next_sample`].
    pub fn newest(&self) -> Result<Arrived, Failure> {
        self.waited(Inbox::newest)
    }

    /// The newest sample that the program has not seen; `None` if none comes within this time. With
    /// 0 s it never waits.
    ///
    /// # Errors
    /// Those of [`Reader::next_sample`].
    pub fn newest_within(&self, longest: Duration) -> Result<Option<Arrived>, Failure> {
        self.wait(Inbox::newest, Some(longest))
    }

    /// Samples that arrived and that the program never gets: [`Reader::newest`] or a full queue
    /// passed them over. Samples lost on the way show as gaps in their numbers.
    pub fn missed(&self) -> u64 {
        self.shared.inbox().missed
    }

    /// The lines that the device logged since the last call; the newest 256.
    pub fn take_lines(&self) -> Vec<LogLine> {
        self.shared.inbox().lines.drain(..).collect()
    }

    /// Works with the connection, between two messages. Messages that the work does not want go to
    /// its second argument.
    ///
    /// # Errors
    /// Those of the work; [`Kind::Lost`] when the connection is lost; [`Kind::Interrupted`], and
    /// then the work ends, too.
    pub fn with<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Link, Others<'_>) -> Result<T, Failure> + Send + 'static,
    ) -> Result<T, Failure> {
        self.order(None, work)
    }

    fn order<T: Send + 'static>(
        &self,
        streams: Option<bool>,
        work: impl FnOnce(&mut Link, Others<'_>) -> Result<T, Failure> + Send + 'static,
    ) -> Result<T, Failure> {
        let (answer, answered) = mpsc::sync_channel(1);
        self.shared.is_given_up.store(false, Ordering::Relaxed);
        let order: Order = Box::new(move |link, others| {
            let done = work(link, others);
            let streams = streams.filter(|_| done.is_ok());
            // Whoever asked may be gone.
            let _ = answer.send(done);
            streams
        });
        // An error shows below: the thread is gone, and the order with its answer.
        let _ = self.orders.send(order);
        loop {
            match answered.recv_timeout(ASK_EVERY) {
                Ok(done) => return done,
                Err(RecvTimeoutError::Timeout) => stop::check().inspect_err(|_| {
                    self.shared.is_given_up.store(true, Ordering::Relaxed);
                })?,
                Err(RecvTimeoutError::Disconnected) => return Err(self.shared.inbox().failure()),
            }
        }
    }

    /// Waits as long as the device sends messages.
    fn waited(&self, take: fn(&mut Inbox) -> Option<Arrived>) -> Result<Arrived, Failure> {
        loop {
            if let Some(arrived) = self.wait(take, None)? {
                return Ok(arrived);
            }
        }
    }

    fn wait(
        &self,
        take: fn(&mut Inbox) -> Option<Arrived>,
        longest: Option<Duration>,
    ) -> Result<Option<Arrived>, Failure> {
        let began = Instant::now();
        let mut inbox = self.shared.inbox();
        loop {
            if let Some(arrived) = take(&mut inbox) {
                return Ok(Some(arrived));
            }
            if inbox.failure.is_some() {
                return Err(inbox.failure());
            }
            let left = longest.map_or(ASK_EVERY, |longest| longest.saturating_sub(began.elapsed()));
            if left.is_zero() {
                return Ok(None);
            }
            let waited = self.shared.news.wait_timeout(inbox, left.min(ASK_EVERY));
            drop(waited.unwrap_or_else(PoisonError::into_inner));
            stop::check()?;
            inbox = self.shared.inbox();
        }
    }
}

impl Drop for Reader {
    /// Stops the stream and closes the connection.
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        self.shared.is_given_up.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic of the thread was reported already.
            let _ = thread.join();
        }
    }
}

impl Inbox {
    fn next(&mut self) -> Option<Arrived> {
        self.samples.pop_front()
    }

    fn newest(&mut self) -> Option<Arrived> {
        let newest = self.samples.pop_back();
        self.missed += self.samples.len() as u64;
        self.samples.clear();
        newest
    }

    fn take(&mut self, message: DeviceMessage, came: Arrival) {
        match message {
            DeviceMessage::Stats(stats) => self.clock.latency(stats.latency_us),
            DeviceMessage::Sample(sample) => {
                if self.samples.len() == ROOM {
                    self.samples.pop_front();
                    self.missed += 1;
                }
                let exposed_ns = self.clock.stamp_ns(sample.time_us, came);
                self.samples.push_back(Arrived {
                    sample,
                    came_ns: came.ns,
                    exposed_ns,
                });
            }
            DeviceMessage::Log(line) => {
                if self.lines.len() == LINES {
                    self.lines.pop_front();
                }
                self.lines.push_back(line);
            }
            _ => (),
        }
    }

    fn failure(&self) -> Failure {
        match &self.failure {
            Some((kind, message)) => Failure::new(*kind, message.clone()),
            None => Failure::new(Kind::Lost, "the connection was closed"),
        }
    }
}

impl Shared {
    fn inbox(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take(&self, message: DeviceMessage) {
        let came = Arrival::now();
        self.inbox().take(message, came);
        self.news.notify_all();
    }

    /// Reads until the end or a failure.
    fn read(&self, mut link: Link, orders: &Receiver<Order>) {
        stop::only_by(self.is_given_up.clone());
        let mut heard = None;
        while !self.is_over.load(Ordering::Relaxed) {
            while let Ok(order) = orders.try_recv() {
                let streams = order(&mut link, &mut |message| self.take(message));
                self.is_given_up.store(false, Ordering::Relaxed);
                heard = match streams {
                    Some(true) => Some(Instant::now()),
                    Some(false) => None,
                    None => heard.map(|_| Instant::now()),
                };
            }
            let failure = match link.receive(Instant::now() + LOOK_EVERY) {
                Ok(Some(message)) => {
                    heard = heard.map(|_| Instant::now());
                    self.take(message);
                    continue;
                }
                Ok(None) if heard.is_some_and(|heard: Instant| heard.elapsed() > SILENCE) => {
                    link.lost("the device sends nothing")
                }
                Ok(None) => continue,
                // An order was given up after its end.
                Err(failure) if failure.kind == Kind::Interrupted => {
                    self.is_given_up.store(false, Ordering::Relaxed);
                    continue;
                }
                Err(failure) => failure,
            };
            self.inbox().failure = Some((failure.kind, failure.to_string()));
            self.news.notify_all();
            return;
        }
        self.is_given_up.store(false, Ordering::Relaxed);
        if heard.is_some() {
            // An error is ignored: the port may be gone, and is closed anyway.
            let _ = link.command(Request::Stop);
        }
    }
}
