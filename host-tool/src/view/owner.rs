//! The one thread that talks to a device: reads what it sends, does what the page orders, and
//! connects again when the cable was pulled.

use super::feed::Feed;
use super::order::{Answer, Order, Posted};
use super::recorder::Recorder;
use super::state::State;
use crate::command::TARE_PATIENCE;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::frame::take;
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_host::stop;
use hivtac_wire::message::{DeviceHello, DeviceMessage, Request};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// Time between two looks for orders.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// Time between two tellings of the state.
const TELL_EVERY: Duration = Duration::from_millis(250);
/// Time between two attempts to connect again.
const RETRY_EVERY: Duration = Duration::from_millis(500);
/// Silence after which the device is asked whether it is still there.
const SILENCE: Duration = Duration::from_secs(5);
/// Frames of a tare.
const TARE_FRAMES: u16 = 32;

/// A device and what is known of it.
pub struct Owner {
    address: Address,
    patience: Duration,
    orders: Receiver<Posted>,
    watched: Watched,
}

/// What every message of the device goes to.
struct Watched {
    feed: Arc<Feed>,
    state: State,
    recorder: Recorder,
    told: Instant,
    /// Something came since.
    is_new: bool,
    /// When the last sample came.
    heard: Instant,
}

impl Watched {
    fn message(&mut self, message: DeviceMessage) {
        self.state.take(&message);
        self.recorder.message(&message);
        if let DeviceMessage::Sample(sample) = message {
            self.heard = Instant::now();
            self.feed.sample(sample);
        }
        self.is_new = true;
        self.tell_now_and_then();
    }

    fn tell_now_and_then(&mut self) {
        if self.is_new && self.told.elapsed() >= TELL_EVERY {
            self.tell();
        }
    }

    fn tell(&mut self) {
        self.told = Instant::now();
        self.is_new = false;
        self.feed.state(self.state.json(self.recorder.told()));
    }

    fn trouble(&mut self, why: String) {
        self.state.trouble(why);
        self.tell();
    }
}

impl Owner {
    /// Of a device that is connected already.
    pub fn new(
        address: Address,
        patience: Duration,
        (link, hello): (&Link, DeviceHello),
        feed: Arc<Feed>,
        orders: Receiver<Posted>,
        recorder: Recorder,
    ) -> Owner {
        let mut watched = Watched {
            feed,
            state: State::new(link.name.clone(), hello),
            recorder,
            told: Instant::now(),
            is_new: false,
            heard: Instant::now(),
        };
        watched.tell();
        Owner {
            address,
            patience,
            orders,
            watched,
        }
    }

    /// Until it is interrupted, through as many connections as it takes.
    pub fn run(mut self, link: Link) {
        let mut connected = Some(link);
        while !stop::requested() {
            let Some(mut link) = connected.take() else {
                // Long enough for a person to see that it was lost.
                if self.wait().is_ok() {
                    connected = self.connect();
                }
                continue;
            };
            let result = self.converse(&mut link);
            self.watched.state.tally.rejected(link.rejected());
            if let Err(failure) = result {
                self.watched.trouble(failure.to_string());
                self.watched.recorder.end(Err(failure));
                self.watched.tell();
            }
        }
    }

    /// Time without a device, in which orders are refused.
    fn wait(&mut self) -> Result<(), Failure> {
        let end = Instant::now() + RETRY_EVERY;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            match self.orders.recv_timeout(left.min(LOOK_EVERY)) {
                Ok(posted) => posted.answer(Answer::Failed("the device is not there".to_owned())),
                Err(_) if left.is_zero() => return Ok(()),
                Err(_) => stop::check()?,
            }
        }
    }

    fn connect(&mut self) -> Option<Link> {
        match Link::connect(&self.address, self.patience) {
            Ok((link, hello)) => {
                self.watched.state.tally.connected_again();
                self.watched.state.hello = hello;
                Some(link)
            }
            // What was lost is told already; another release of the firmware is news.
            Err(failure) if failure.kind == Kind::Version => {
                self.watched.trouble(failure.to_string());
                None
            }
            Err(_) => None,
        }
    }

    /// One connection, from the start of samples to its loss.
    fn converse(&mut self, link: &mut Link) -> Result<(), Failure> {
        for request in [Request::GetInfo, Request::StartWithMarkers] {
            self.request(link, request, self.patience)?;
        }
        self.watched.heard = Instant::now();
        loop {
            if let Some(message) = link.receive(Instant::now() + LOOK_EVERY)? {
                self.watched.message(message);
            }
            self.watched.tell_now_and_then();
            if self.watched.heard.elapsed() >= SILENCE {
                self.probe(link)?;
            }
            while let Ok(posted) = self.orders.try_recv() {
                self.obey(link, posted)?;
            }
        }
    }

    fn request(
        &mut self,
        link: &mut Link,
        request: Request,
        patience: Duration,
    ) -> Result<(), Failure> {
        let watched = &mut self.watched;
        link.request(request, patience, |message| watched.message(message))
    }

    /// Finds out whether a silent device still knows of this conversation.
    fn probe(&mut self, link: &mut Link) -> Result<(), Failure> {
        match self.request(link, Request::GetInfo, self.patience) {
            Err(failure) if failure.kind == Kind::Refused => {
                Err(link.lost("the device sends nothing and does not answer"))
            }
            Err(failure) => Err(failure),
            Ok(()) => {
                self.watched.heard = Instant::now();
                let why = "the device answers, but sends no samples: does its camera run?";
                self.watched.trouble(why.to_owned());
                Ok(())
            }
        }
    }

    /// Does what is ordered; a refusal is an answer, a lost connection an end.
    fn obey(&mut self, link: &mut Link, posted: Posted) -> Result<(), Failure> {
        match self.try_to(link, posted.order) {
            Ok(answer) => posted.answer(answer),
            Err(failure) => {
                posted.answer(Answer::Failed(failure.to_string()));
                if failure.kind != Kind::Refused {
                    return Err(failure);
                }
            }
        }
        self.watched.tell();
        Ok(())
    }

    fn try_to(&mut self, link: &mut Link, order: Order) -> Result<Answer, Failure> {
        let (request, patience, done) = match order {
            Order::Picture => return self.picture(link),
            Order::Record => return self.record(link),
            Order::StopRecording => {
                self.request(link, Request::GetInfo, self.patience)?;
                return Ok(Answer::Done(self.watched.recorder.end(Ok(()))));
            }
            Order::Tare => {
                let frames = TARE_FRAMES;
                let done = format!("tare taken over {frames} frames");
                (
                    Request::Tare { frames },
                    self.patience.max(TARE_PATIENCE),
                    done,
                )
            }
            Order::Expose => {
                let done = "exposure and gain found; take a new tare".to_owned();
                (Request::Expose, self.patience, done)
            }
            Order::Threshold(wanted) => {
                let done = "threshold set".to_owned();
                (Request::SetThreshold(wanted), self.patience, done)
            }
            Order::ModelThreshold => {
                let model = self.watched.state.hello.model.as_ref();
                let none = || Failure::new(Kind::Refused, "the device has no usable model");
                let wanted = model.ok_or_else(none)?.threshold;
                let done = "threshold of the model set".to_owned();
                (Request::SetThreshold(wanted), self.patience, done)
            }
        };
        self.request(link, request, patience)?;
        // What holds now, as the device has it.
        self.request(link, Request::GetInfo, self.patience)?;
        Ok(Answer::Done(done))
    }

    /// Begins a file, with the device's counters in front.
    fn record(&mut self, link: &mut Link) -> Result<Answer, Failure> {
        let Watched {
            recorder, state, ..
        } = &mut self.watched;
        match recorder.begin(&state.hello) {
            Ok(text) => {
                self.request(link, Request::GetInfo, self.patience)?;
                Ok(Answer::Done(text))
            }
            Err(failure) => Ok(Answer::Failed(failure.to_string())),
        }
    }

    fn picture(&mut self, link: &mut Link) -> Result<Answer, Failure> {
        let watched = &mut self.watched;
        let taken = take(link, self.patience, |message| watched.message(message))?;
        let hello = self.watched.state.hello.clone();
        Ok(Answer::Picture(Box::new((taken, hello))))
    }
}
