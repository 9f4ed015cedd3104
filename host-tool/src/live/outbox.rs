//! Messages on their way to the host: bounded, answers before samples, samples before the parts of
//! a snapshot, as on the device.

use hivtac_wire::message::{
    DeviceMessage, Outcome, Reply, SNAPSHOT_PART_BYTES, Sample, Snapshot, SnapshotPart,
};
use std::collections::VecDeque;

/// Most samples that wait.
const SAMPLES: usize = 32;
/// Most answers that wait: a host that asks on without reading loses the rest.
const ANSWERS: usize = 64;

/// The queues.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    answers: VecDeque<DeviceMessage>,
    samples: VecDeque<Sample>,
    snapshot: Option<Sending>,
}

/// A snapshot that is being sent.
#[derive(Debug)]
struct Sending {
    id: u16,
    header: Snapshot,
    bytes: Vec<u8>,
    /// Number of bytes sent; `None` before the header was.
    sent: Option<usize>,
}

impl Outbox {
    /// Discards everything, for a new conversation.
    pub fn clear(&mut self) {
        *self = Outbox::default();
    }

    /// Queues an answer, unless too many wait.
    pub fn answer(&mut self, message: DeviceMessage) {
        if self.answers.len() < ANSWERS {
            self.answers.push_back(message);
        }
    }

    /// Queues the reply to a command.
    pub fn reply(&mut self, id: u16, outcome: Outcome) {
        self.answer(DeviceMessage::Reply(Reply { id, outcome }));
    }

    /// Queues a sample; returns false if too many wait.
    pub fn sample(&mut self, sample: Sample) -> bool {
        let has_room = self.samples.len() < SAMPLES;
        if has_room {
            self.samples.push_back(sample);
        }
        has_room
    }

    /// Returns whether a snapshot is being sent.
    pub fn sends_snapshot(&self) -> bool {
        self.snapshot.is_some()
    }

    /// Sends a frame for the command `id`.
    pub fn snapshot(&mut self, id: u16, header: Snapshot, bytes: Vec<u8>) {
        self.snapshot = Some(Sending {
            id,
            header,
            bytes,
            sent: None,
        });
    }

    /// Gives the snapshot up, because the host does not read.
    pub fn give_up_snapshot(&mut self) {
        if let Some(Sending { id, .. }) = self.snapshot.take() {
            self.reply(id, Outcome::NotRead);
        }
    }

    /// Takes the next message; `None` if nothing waits.
    pub fn take(&mut self) -> Option<DeviceMessage> {
        let answer = self.answers.pop_front();
        answer
            .or_else(|| self.samples.pop_front().map(DeviceMessage::Sample))
            .or_else(|| self.take_of_snapshot())
    }

    /// The header, then the parts, then the reply.
    fn take_of_snapshot(&mut self) -> Option<DeviceMessage> {
        let sending = self.snapshot.as_mut()?;
        let Some(sent) = sending.sent else {
            sending.sent = Some(0);
            return Some(DeviceMessage::Snapshot(sending.header.clone()));
        };
        let rest = sending.bytes.get(sent..).unwrap_or(&[]);
        if rest.is_empty() {
            let (id, outcome) = (sending.id, Outcome::Done);
            self.snapshot = None;
            return Some(DeviceMessage::Reply(Reply { id, outcome }));
        }
        let length = rest.len().min(SNAPSHOT_PART_BYTES);
        sending.sent = Some(sent + length);
        Some(DeviceMessage::SnapshotPart(SnapshotPart {
            offset: sent as u32,
            bytes: rest.iter().take(length).copied().collect(),
        }))
    }
}
