//! The thread that communicates with a device for the page: keeps its messages and carries out
//! orders.

use super::gripping::Gripping;
use super::recorder::Recorder;
use crate::follow::{Follower, follow};
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::page::{Answer, Feed, Order, Posted, State, picture};
use hivtac_host::port::Address;
use hivtac_wire::decoder::Rejected;
use hivtac_wire::message::{DeviceHello, DeviceMessage, Request};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// Time between two updates of the state.
const TELL_EVERY: Duration = Duration::from_millis(250);

/// A device and its state.
pub struct Owner {
    address: Address,
    patience: Duration,
    orders: Receiver<Posted>,
    watched: Watched,
    /// Whether this connection's device was asked for its settings.
    asked_settings: bool,
}

/// The receivers of a device's messages.
struct Watched {
    feed: Arc<Feed>,
    state: State,
    recorder: Recorder,
    /// Which finger of a grip it is, 0 or 1, and the grip.
    grip: Option<(usize, Gripping)>,
    delivered: Instant,
    /// Whether a message has come since the last update.
    is_new: bool,
}

impl Watched {
    fn message(&mut self, message: DeviceMessage) {
        self.state.take(&message);
        self.recorder.message(&message);
        if let Some((finger, grip)) = &self.grip {
            grip.message(*finger, &message);
        }
        if let DeviceMessage::Sample(sample) = message {
            self.feed.sample(sample);
        }
        self.is_new = true;
        self.tell_now_and_then();
    }

    fn tell_now_and_then(&mut self) {
        if (self.is_new || self.grip.is_some()) && self.delivered.elapsed() >= TELL_EVERY {
            self.tell();
        }
    }

    fn tell(&mut self) {
        self.delivered = Instant::now();
        self.is_new = false;
        // The first finger's page has it.
        if let Some((0, grip)) = &self.grip {
            self.state.grip = grip.cause();
        }
        self.feed.state(self.state.json(self.recorder.state()));
    }

    fn trouble(&mut self, why: String) {
        self.state.trouble(why);
        self.tell();
    }
}

impl Owner {
    /// The owner of a connected device.
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
            grip: None,
            delivered: Instant::now(),
            is_new: false,
        };
        watched.tell();
        Owner {
            address,
            patience,
            orders,
            watched,
            asked_settings: false,
        }
    }

    /// Makes the device a finger of a grip, 0 or 1.
    pub fn grips(&mut self, finger: usize, grip: Gripping) {
        self.watched.grip = Some((finger, grip));
    }

    /// Runs until the program is interrupted.
    pub fn run(mut self, link: Link) {
        let address = self.address.clone();
        follow(&address, self.patience, link, &mut self);
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

    /// Carries out an order. A refusal is only an answer; a lost connection is returned.
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
        match order {
            Order::Picture => return self.picture(link),
            Order::Record => return self.record(link),
            Order::StopRecording => {
                self.request(link, Request::GetInfo, self.patience)?;
                return Ok(Answer::Done(self.watched.recorder.end(Ok(()))));
            }
            _ => {}
        }
        let Some(command) = order.command(&self.watched.state.hello, self.patience)? else {
            // The server presses by itself.
            return Ok(Answer::Done(String::new()));
        };
        self.request(link, command.request, command.patience)?;
        // The values now in use, from the device.
        self.request(link, Request::GetInfo, self.patience)?;
        self.ask_settings(link)?;
        Ok(Answer::Done(command.done))
    }

    /// Asks for the settings in use. A device that does not answer is shown without.
    fn ask_settings(&mut self, link: &mut Link) -> Result<(), Failure> {
        match self.request(link, Request::GetSettings, self.patience) {
            Err(failure) if failure.kind == Kind::Refused => Ok(()),
            result => result,
        }
    }

    /// Begins a file with the device's counters.
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
        let taken = link.snapshot(self.patience, |message| watched.message(message))?;
        let hello = self.watched.state.hello.clone();
        Ok(Answer::Picture(Box::new(move || {
            picture::bytes(&taken, &hello)
        })))
    }
}

impl Follower for Owner {
    fn message(&mut self, message: DeviceMessage) {
        self.watched.message(message);
    }

    fn lost(&mut self, failure: Failure, rejected: Rejected) {
        self.watched.state.tally.rejected(rejected);
        if let Some((_, grip)) = &self.watched.grip {
            grip.lost();
        }
        self.watched.trouble(failure.to_string());
        self.watched.recorder.end(Err(failure));
        self.watched.tell();
    }

    fn connected_again(&mut self, hello: DeviceHello) {
        self.watched.state.connected_again(hello);
        self.asked_settings = false;
    }

    fn trouble(&mut self, why: String) {
        self.watched.trouble(why);
    }

    fn turn(&mut self, mut link: Option<&mut Link>) -> Result<bool, Failure> {
        self.watched.tell_now_and_then();
        let mut is_asked = false;
        if let Some(link) = &mut link
            && !std::mem::replace(&mut self.asked_settings, true)
        {
            self.ask_settings(link)?;
        }
        while let Ok(posted) = self.orders.try_recv() {
            match &mut link {
                Some(link) => self.obey(link, posted)?,
                None => posted.answer(Answer::Failed("the device is not there".to_owned())),
            }
            is_asked = true;
        }
        Ok(is_asked)
    }
}
