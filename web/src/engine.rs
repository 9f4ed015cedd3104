//! One sensor at a time, simulated or connected, and the page's requests to it.

use crate::conversation::{Conversation, ConversationEvent, Job, PATIENCE, Ticket};
use crate::recorder::{Recorded, Recorder};
use crate::simulated::Simulated;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::live::camera;
use hivtac_host::page::rows::{self, Event};
use hivtac_host::page::{self, Cursor, Feed, Order, State};
use hivtac_host::usual_tare::TARE_PATIENCE;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_twin::Layout;
use hivtac_wire::message::{DeviceMessage, Request};
use serde_json::json;
use std::collections::VecDeque;

/// Time between two updates of the state, µs.
const TELL_EVERY_US: u64 = 250_000;
/// Silence after which a device is said to send no samples, µs.
const SILENCE_US: u64 = 5_000_000;
/// Longest time between two turns, µs.
const TURN_EVERY_US: u64 = 20_000;
/// Number of frames of a simulated sensor's first tare.
const TARE_FRAMES: u16 = 64;

/// A sensor, and all that the page knows of it.
pub struct Engine {
    /// `None` for a device at the serial port, whose bytes the page brings.
    simulated: Option<Box<Simulated>>,
    presses: bool,
    conversation: Conversation,
    name: String,
    state: Option<State>,
    feed: Feed,
    cursor: Cursor,
    recorder: Recorder,
    /// Time since 1970 when the page's time was 0, ns.
    epoch_ns: u64,
    delivered_us: u64,
    last_message_us: u64,
    events: Vec<Event>,
    /// Bytes that events announce, in their order.
    blobs: VecDeque<Vec<u8>>,
}

impl Engine {
    /// A simulated sensor with this number of dots, 4 or 8, set up as a user would: it knows its
    /// tip, and has a tare.
    ///
    /// # Errors
    /// When no film has that number, or the scene cannot be made.
    pub fn simulated(dots: u32, now_us: u64, epoch_ns: u64) -> Result<Engine, String> {
        let layout = match dots {
            4 => Layout::default(),
            8 => "8v".parse().map_err(|_| "the layout 8v is missing")?,
            _ => return Err(format!("a simulated film has 4 or 8 dots, not {dots}")),
        };
        let simulated = Simulated::start(camera::Kind::default(), layout, now_us)?;
        let mut engine = Engine::new("simulated in this page", now_us, epoch_ns);
        engine.simulated = Some(Box::new(simulated));
        engine.presses = true;
        engine.ask(None, Request::SetContactShape(ContactShape::Needle));
        let frames = TARE_FRAMES;
        engine.conversation.ask(Job {
            ticket: None,
            commands: [(Request::Tare { frames }, TARE_PATIENCE)].into(),
            done: String::new(),
        });
        engine.start();
        Ok(engine)
    }

    /// A device at a serial port that the page opened.
    pub fn connected(name: &str, now_us: u64, epoch_ns: u64) -> Engine {
        let mut engine = Engine::new(name, now_us, epoch_ns);
        engine.start();
        engine
    }

    fn new(name: &str, now_us: u64, epoch_ns: u64) -> Engine {
        let feed = Feed::default();
        Engine {
            simulated: None,
            presses: false,
            conversation: Conversation::begin(name, now_us),
            name: name.to_owned(),
            state: None,
            cursor: feed.begin(),
            feed,
            recorder: Recorder::default(),
            epoch_ns,
            delivered_us: now_us,
            last_message_us: now_us,
            events: Vec::new(),
            blobs: VecDeque::new(),
        }
    }

    fn ask(&mut self, ticket: Option<Ticket>, request: Request) {
        self.conversation.ask(Job {
            ticket,
            commands: [(request, PATIENCE)].into(),
            done: String::new(),
        });
    }

    fn start(&mut self) {
        for request in [
            Request::GetInfo,
            Request::GetSettings,
            Request::StartWithMarkers,
        ] {
            self.ask(None, request);
        }
    }

    /// Lets time pass; returns when the next turn is due, in µs. `now` is the page's time, µs.
    pub fn turn(&mut self, now: &dyn Fn() -> u64) -> u64 {
        let mut wait_us = TURN_EVERY_US;
        if let Some(mut simulated) = self.simulated.take() {
            let (truths, next_us) = simulated.turn(now);
            truths
                .iter()
                .for_each(|frame| self.feed.truth(frame.of_page()));
            wait_us = wait_us.min(next_us);
            self.exchange(&mut simulated, now());
            self.simulated = Some(simulated);
        }
        let now_us = now();
        self.conversation.turn(now_us);
        self.hear(now_us);
        self.notice_silence(now_us);
        self.tell_now_and_then(now_us);
        wait_us
    }

    /// Passes bytes between page and simulated sensor until neither has more.
    fn exchange(&mut self, simulated: &mut Simulated, now_us: u64) {
        loop {
            let to_device = self.conversation.sent();
            simulated.receive(&to_device, now_us);
            let to_host = simulated.sent();
            if to_device.is_empty() && to_host.is_empty() {
                return;
            }
            self.receive(&to_host, now_us);
        }
    }

    /// Takes bytes of the device.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64) {
        self.conversation.receive(bytes, now_us);
        self.hear(now_us);
    }

    /// Takes the bytes for a device at the serial port.
    pub fn sent(&mut self) -> Vec<u8> {
        match self.presses {
            false => self.conversation.sent(),
            true => Vec::new(),
        }
    }

    /// The port is gone; `why` is the browser's message.
    pub fn lost(&mut self, why: &str, now_us: u64) {
        let message = format!(
            "connection to {} lost: {why}; cable pulled or device reset? Connect it again",
            self.name
        );
        let failure = Failure::new(Kind::Lost, message);
        self.conversation.end(failure);
        self.hear(now_us);
        self.tell(now_us);
    }

    fn hear(&mut self, now_us: u64) {
        while let Some(event) = self.conversation.next_event() {
            self.take(event, now_us);
        }
    }

    fn take(&mut self, event: ConversationEvent, now_us: u64) {
        match event {
            ConversationEvent::Hello(hello) => {
                self.events.push(rows::hello(1, true, self.presses));
                self.state = Some(State::new(self.name.clone(), hello));
                self.last_message_us = now_us;
                self.tell(now_us);
            }
            ConversationEvent::Message(message) => self.message(message, now_us),
            ConversationEvent::Ended(Some(ticket), result) => {
                match result {
                    Ok(done) => self.answer(ticket, true, &done),
                    Err(failure) => self.answer(ticket, false, &failure.to_string()),
                }
                self.tell(now_us);
            }
            ConversationEvent::Snapshot(Some(ticket), taken) => self.snapshot(ticket, taken),
            ConversationEvent::Ended(None, _) | ConversationEvent::Snapshot(None, _) => {}
            ConversationEvent::Lost(failure) => {
                let recorded = self.recorder.end(&failure.to_string());
                self.keep(recorded);
                let text = failure.to_string();
                match &mut self.state {
                    Some(state) => state.trouble(text.clone()),
                    None => self
                        .events
                        .push(("gone", json!({ "text": text }).to_string())),
                }
                self.events
                    .push(("lost", json!({ "text": text }).to_string()));
            }
        }
    }

    fn message(&mut self, message: DeviceMessage, now_us: u64) {
        let Some(state) = &mut self.state else {
            return;
        };
        state.take(&message);
        let unix_ns = self.epoch_ns + 1_000 * now_us;
        let full = self.recorder.message(&message, now_us, unix_ns);
        if let DeviceMessage::Sample(sample) = message {
            self.last_message_us = now_us;
            self.feed.sample(sample);
        }
        self.keep(full);
    }

    fn snapshot(&mut self, ticket: Ticket, taken: Result<Box<hivtac_host::frame::Taken>, Failure>) {
        match (taken, &self.state) {
            (Ok(taken), Some(state)) => {
                let bytes = page::picture::bytes(&taken, &state.hello);
                self.blobs.push_back(bytes);
                let event = json!({ "ticket": ticket });
                self.events.push(("picture", event.to_string()));
            }
            (Err(failure), _) => self.answer(ticket, false, &failure.to_string()),
            (Ok(_), None) => {}
        }
    }

    /// Carries out an order of the page, as JSON; its answer is an event with the ticket.
    pub fn order(&mut self, ticket: Ticket, body: &[u8], now_us: u64) {
        match page::parse_order(body) {
            Ok((0, order)) => self.obey(ticket, order, now_us),
            Ok(_) => self.answer(ticket, false, "there is no such sensor"),
            Err(why) => self.answer(ticket, false, &why),
        }
    }

    /// Has a connected device restart into its loader.
    pub fn start_loader(&mut self, ticket: Ticket) {
        match self.board() {
            None => self.answer(ticket, false, "no device is connected"),
            Some(_) => self.ask(Some(ticket), Request::StartLoader),
        }
    }

    /// The board of the connected device; `None` for a simulated one, or before its hello.
    pub fn board(&self) -> Option<&str> {
        let state = self.state.as_ref().filter(|_| !self.presses)?;
        Some(&state.hello.board)
    }

    /// Takes a picture; the answer is an event `picture`, or words.
    pub fn picture(&mut self, ticket: Ticket) {
        self.ask(Some(ticket), Request::Snapshot);
    }

    fn obey(&mut self, ticket: Ticket, order: Order, now_us: u64) {
        let Some(state) = &self.state else {
            return self.answer(ticket, false, "the device is not there");
        };
        match order {
            Order::Press(fingers) => {
                let Some(simulated) = &self.simulated else {
                    return self.answer(ticket, false, "only a simulated film can be pressed");
                };
                simulated.press(fingers);
                self.answer(ticket, true, "");
            }
            Order::Record => {
                let unix_ns = self.epoch_ns + 1_000 * now_us;
                let begun = self.recorder.begin(&state.hello, now_us, unix_ns);
                // The file begins with the device's counters.
                self.ask(None, Request::GetInfo);
                match begun {
                    Ok(text) => self.answer(ticket, true, &text),
                    Err(why) => self.answer(ticket, false, &why),
                }
                self.tell(now_us);
            }
            Order::StopRecording => {
                let recorded = self.recorder.end("as asked");
                self.keep(recorded);
                let text = self.recorder.state().text;
                self.answer(ticket, true, &text);
                self.tell(now_us);
            }
            order => match order.command(&state.hello, PATIENCE) {
                Ok(Some(command)) => {
                    let commands = [
                        (command.request, command.patience),
                        (Request::GetInfo, PATIENCE),
                    ];
                    self.conversation.ask(Job {
                        ticket: Some(ticket),
                        commands: commands.into(),
                        done: command.done,
                    });
                    // A device that does not send its settings has obeyed all the same.
                    self.ask(None, Request::GetSettings);
                }
                Ok(None) => self.answer(ticket, false, "there is no such order"),
                Err(failure) => self.answer(ticket, false, &failure.to_string()),
            },
        }
    }

    fn answer(&mut self, ticket: Ticket, done: bool, text: &str) {
        let answer = json!({ "ticket": ticket, "done": done, "text": text });
        self.events.push(("answer", answer.to_string()));
    }

    /// Announces a whole recording.
    fn keep(&mut self, recorded: Option<Recorded>) {
        if let Some((name, bytes)) = recorded {
            self.blobs.push_back(bytes);
            let file = json!({ "name": name });
            self.events.push(("file", file.to_string()));
        }
    }

    fn notice_silence(&mut self, now_us: u64) {
        let Some(state) = &mut self.state else {
            return;
        };
        if now_us - self.last_message_us >= SILENCE_US && state.trouble.is_none() {
            state.trouble("the device sends no samples: does its camera run?".to_owned());
            self.ask(None, Request::GetInfo);
            self.tell(now_us);
        }
    }

    fn tell_now_and_then(&mut self, now_us: u64) {
        if now_us - self.delivered_us >= TELL_EVERY_US {
            self.tell(now_us);
        }
    }

    fn tell(&mut self, now_us: u64) {
        self.delivered_us = now_us;
        if let Some(state) = &self.state {
            self.feed.state(state.json(self.recorder.state()));
        }
    }

    /// Takes the events since the last call, as a JSON array of `[name, data]`.
    pub fn events(&mut self) -> String {
        let mut events = std::mem::take(&mut self.events);
        let news = self.feed.news(&mut self.cursor);
        events.extend(rows::events(0, &news));
        let events: Vec<String> = events
            .iter()
            .map(|(name, data)| format!("[\"{name}\",{data}]"))
            .collect();
        format!("[{}]", events.join(","))
    }

    /// Takes the bytes that the next event `picture` or `file` announced.
    pub fn blob(&mut self) -> Vec<u8> {
        self.blobs.pop_front().unwrap_or_default()
    }
}
