//! A conversation with a device (`docs/wire.md`) that never waits: bytes in and out, commands one
//! after the other, each with its time.

use hivtac_host::failure::{Failure, Kind};
use hivtac_host::frame::{Collected, DEVICE_PATIENCE, Taken, no_part};
use hivtac_host::reply::{foreign, judge, name_of, unanswered};
use hivtac_wire::decoder::{Decoder, Received, Rejected};
use hivtac_wire::frame::{DEVICE_FRAME_LIMIT, MAX_HOST_FRAME, encode};
use hivtac_wire::message::{Command, DeviceHello, DeviceMessage, HostMessage, Outcome, Request};
use hivtac_wire::version::HelloPrefix;
use std::collections::VecDeque;
use std::time::Duration;

/// Longest wait for the device's hello and for a usual reply.
pub const PATIENCE: Duration = Duration::from_secs(2);
/// Time between two hellos while none is answered, µs.
const HELLO_AGAIN_US: u64 = 250_000;

/// Number of an order of the page, by which it knows the answer.
pub type Ticket = u32;

/// Commands that belong together; the first refusal ends them.
pub struct Job {
    /// Whose answer it is; `None` if nobody asked.
    pub ticket: Option<Ticket>,
    /// The commands, each with the longest wait for its reply.
    pub commands: VecDeque<(Request, Duration)>,
    /// The message when all are done.
    pub done: String,
}

/// An event of a conversation.
pub enum ConversationEvent {
    /// The first hello.
    Hello(DeviceHello),
    /// Any other message.
    Message(DeviceMessage),
    /// A job is done, or why not.
    Ended(Option<Ticket>, Result<String, Failure>),
    /// A snapshot, or why it is missing.
    Snapshot(Option<Ticket>, Result<Box<Taken>, Failure>),
    /// The conversation is over.
    Lost(Failure),
}

/// A command that was sent.
struct Sent {
    id: u16,
    request: Request,
    patience: Duration,
    until_us: u64,
    /// The parts, of a snapshot.
    collected: Option<Collected>,
}

/// How far it has come.
enum Phase {
    /// Since when, and when the next hello goes out, µs.
    Greets(u64, u64),
    Open,
    Over,
}

/// A conversation.
pub struct Conversation {
    /// The device's name, for messages.
    name: String,
    phase: Phase,
    decoder: Decoder<DEVICE_FRAME_LIMIT>,
    out: Vec<u8>,
    jobs: VecDeque<Job>,
    sent: Option<Sent>,
    last_id: u16,
    events: VecDeque<ConversationEvent>,
}

impl Conversation {
    /// Begins with hellos to the device of this name.
    pub fn begin(name: &str, now_us: u64) -> Conversation {
        Conversation {
            name: name.to_owned(),
            phase: Phase::Greets(now_us, now_us),
            decoder: Decoder::new(),
            out: Vec::new(),
            jobs: VecDeque::new(),
            sent: None,
            last_id: 0,
            events: VecDeque::new(),
        }
    }

    /// Queues commands.
    pub fn ask(&mut self, job: Job) {
        self.jobs.push_back(job);
    }

    /// Takes the bytes for the device.
    pub fn sent(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.out)
    }

    /// Takes its next event, if any.
    pub fn next_event(&mut self) -> Option<ConversationEvent> {
        self.events.pop_front()
    }

    /// The decoder's rejects since the device's hello.
    pub fn rejected(&self) -> Rejected {
        self.decoder.rejected()
    }

    /// Takes bytes of the device.
    pub fn receive(&mut self, mut bytes: &[u8], now_us: u64) {
        while let Some(received) = self.decoder.feed::<DeviceMessage>(&mut bytes) {
            match (received, &self.phase) {
                (_, Phase::Over) => return,
                (Received::Message(message), Phase::Open) => self.message(message, now_us),
                (Received::Message(DeviceMessage::Hello(hello)), Phase::Greets(..)) => {
                    self.phase = Phase::Open;
                    // Rejects before its hello do not count.
                    self.decoder.reset();
                    self.events.push_back(ConversationEvent::Hello(hello));
                }
                // The rest of an earlier conversation.
                (Received::Message(_), Phase::Greets(..)) => {}
                (Received::ForeignHello(prefix), _) => {
                    let failure = foreign(&self.name, prefix);
                    self.end(failure);
                }
            }
        }
        self.turn(now_us);
    }

    fn message(&mut self, message: DeviceMessage, now_us: u64) {
        let Some(sent) = &mut self.sent else {
            self.events.push_back(ConversationEvent::Message(message));
            return;
        };
        match (&message, &mut sent.collected) {
            (DeviceMessage::Reply(reply), _) if reply.id == sent.id => {
                let outcome = reply.outcome;
                self.replied(outcome);
                return;
            }
            (DeviceMessage::Snapshot(_) | DeviceMessage::SnapshotPart(_), Some(collected)) => {
                sent.until_us = now_us + PATIENCE.as_micros() as u64;
                if let Err(failure) = collected.add(&message) {
                    self.snapshot(Err(failure));
                }
                return;
            }
            (DeviceMessage::Sample(sample), Some(collected)) => collected.remember(sample.clone()),
            _ => {}
        }
        self.events.push_back(ConversationEvent::Message(message));
    }

    fn replied(&mut self, outcome: Outcome) {
        let Some(sent) = self.sent.take() else {
            return;
        };
        match sent.collected {
            Some(collected) => {
                let whole = collected.whole(outcome);
                self.snapshot(whole);
            }
            None => match judge(name_of(&sent.request), outcome) {
                Ok(()) => self.step(),
                Err(failure) => self.give_up(failure),
            },
        }
    }

    /// Ends a job that is a snapshot.
    fn snapshot(&mut self, taken: Result<Taken, Failure>) {
        self.sent = None;
        if let Some(job) = self.jobs.pop_front() {
            self.events
                .push_back(ConversationEvent::Snapshot(job.ticket, taken.map(Box::new)));
        }
    }

    /// Goes on to the job's next command; ends it after the last.
    fn step(&mut self) {
        let Some(job) = self.jobs.front_mut() else {
            return;
        };
        job.commands.pop_front();
        if job.commands.is_empty()
            && let Some(job) = self.jobs.pop_front()
        {
            self.events
                .push_back(ConversationEvent::Ended(job.ticket, Ok(job.done)));
        }
    }

    fn give_up(&mut self, failure: Failure) {
        self.sent = None;
        if let Some(job) = self.jobs.pop_front() {
            self.events
                .push_back(ConversationEvent::Ended(job.ticket, Err(failure)));
        }
    }

    /// Ends everything; all that waits is answered with this failure.
    pub fn end(&mut self, failure: Failure) {
        self.phase = Phase::Over;
        self.sent = None;
        for job in self.jobs.drain(..) {
            let failure = Failure::new(Kind::Lost, failure.to_string());
            self.events
                .push_back(ConversationEvent::Ended(job.ticket, Err(failure)));
        }
        self.events.push_back(ConversationEvent::Lost(failure));
    }

    /// Sends due messages, and gives up commands that took too long.
    pub fn turn(&mut self, now_us: u64) {
        match self.phase {
            Phase::Greets(begun_us, next_us) => self.greet(begun_us, next_us, now_us),
            Phase::Open => {
                self.time_out(now_us);
                self.next(now_us);
            }
            Phase::Over => {}
        }
    }

    fn greet(&mut self, begun_us: u64, next_us: u64, now_us: u64) {
        if now_us >= begun_us + PATIENCE.as_micros() as u64 {
            let bytes = match self.decoder.rejected().bytes {
                0 => "nothing came".to_owned(),
                bytes => format!("{bytes} bytes came that are no message"),
            };
            let why = format!(
                "no hello from {} within {} s ({bytes}); is it a HiVTac sensor, and running? \
                 Choose another port, or press its reset button and connect again",
                self.name,
                PATIENCE.as_secs()
            );
            self.end(Failure::new(Kind::NoDevice, why));
        } else if now_us >= next_us {
            self.phase = Phase::Greets(begun_us, now_us + HELLO_AGAIN_US);
            // A zero ends any half frame in the line.
            self.out.push(0);
            self.send(&HostMessage::Hello(HelloPrefix::OURS.into()));
        }
    }

    fn time_out(&mut self, now_us: u64) {
        let late = self.sent.take_if(|sent| sent.until_us <= now_us);
        match late {
            Some(sent) if sent.collected.is_some() => {
                self.snapshot(Err(no_part(sent.patience)));
            }
            Some(sent) => self.give_up(unanswered(&sent.request, sent.patience)),
            None => {}
        }
    }

    /// Sends the next command, if none is on its way.
    fn next(&mut self, now_us: u64) {
        let job = self.jobs.front().filter(|_| self.sent.is_none());
        let Some((request, patience)) = job.and_then(|job| job.commands.front().cloned()) else {
            return;
        };
        self.last_id = self.last_id.wrapping_add(1);
        let id = self.last_id;
        let collected = matches!(request, Request::Snapshot).then(Collected::default);
        let more = match collected {
            Some(_) => DEVICE_PATIENCE,
            None => Duration::ZERO,
        };
        self.sent = Some(Sent {
            id,
            request: request.clone(),
            patience,
            until_us: now_us + (patience + more).as_micros() as u64,
            collected,
        });
        self.send(&HostMessage::Command(Command { id, request }));
    }

    fn send(&mut self, message: &HostMessage) {
        let mut buffer = [0; MAX_HOST_FRAME];
        // The buffer holds every message.
        if let Ok(frame) = encode(message, &mut buffer) {
            self.out.extend_from_slice(frame);
        }
    }
}
