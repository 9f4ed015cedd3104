//! Sends a captured frame to the host: requests, memory and sending.
//!
//! # Design
//! `snapshot_copy` keeps a frame in [`FRAME`]. The sender then makes a message of its next bytes
//! whenever no other message waits. There is one snapshot at a time; a second one for the same
//! conversation is refused. When its conversation has ended, pipeline and sender drop the snapshot
//! at their next check, so it never blocks the next conversation.

use crate::bands::{BAND_BYTES, SHAPE};
use crate::orders::{self, Order};
use crate::outbox;
use crate::session::{self, Origin};
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use heapless::Vec;
use hivtac_wire::message::{
    DeviceMessage, Outcome, Reply, SNAPSHOT_PART_BYTES, Snapshot, SnapshotPart,
};

/// The conversation with an active snapshot, or 0. Set by the USB tasks, cleared by them and the
/// pipeline.
static SNAPSHOT_FOR: AtomicU32 = AtomicU32::new(0);

/// A frame that was kept whole. From the pipeline to the sender, one of the USB tasks.
static SNAPSHOT_TAKEN: Signal<CriticalSectionRawMutex, Taken> = Signal::new();

/// Bytes of a frame.
pub const FRAME_BYTES: usize = SHAPE.bands() as usize * BAND_BYTES;

#[repr(C, align(128))]
struct Frame(MaybeUninit<[u8; FRAME_BYTES]>);

#[unsafe(link_section = ".axisram.snapshot")]
static mut FRAME: Frame = Frame(MaybeUninit::uninit());

/// Address of a band of the frame.
pub fn address(index: u16) -> u32 {
    let base = &raw const FRAME as u32;
    base + u32::from(index % SHAPE.bands()) * BAND_BYTES as u32
}

/// A whole frame in [`FRAME`].
pub struct Taken {
    /// Who requested it.
    pub origin: Origin,
    /// Its description.
    pub header: Snapshot,
}

/// Requests the next whole frame for the command `id`; returns `Busy` if a snapshot is already
/// active.
pub fn ask(id: u16) -> Option<Outcome> {
    let conversation = session::number();
    if SNAPSHOT_FOR.swap(conversation, Ordering::Relaxed) == conversation {
        return Some(Outcome::Busy);
    }
    let origin = Origin::by(id);
    let refused = orders::order(Order::Snapshot(origin));
    if refused.is_some() {
        end(origin);
    }
    refused
}

/// Passes a frame to the sender.
pub fn send(taken: Taken) {
    SNAPSHOT_TAKEN.signal(taken);
}

/// Ends the snapshot.
pub fn end(origin: Origin) {
    let conversation = origin.conversation();
    // Fails if another conversation's snapshot is active by now.
    let _ = SNAPSHOT_FOR.compare_exchange(conversation, 0, Ordering::Relaxed, Ordering::Relaxed);
}

/// The snapshot that is being sent, if any.
pub struct Outgoing(Option<Sending>);

struct Sending {
    taken: Taken,
    /// Number of bytes sent; `None` before the header was.
    sent: Option<u32>,
}

impl Outgoing {
    /// No snapshot is being sent.
    pub const NONE: Self = Self(None);

    /// Returns the next message of a snapshot; waits for one.
    pub async fn next(&mut self) -> DeviceMessage {
        loop {
            if let Some(message) = self.message() {
                return message;
            }
            let taken = SNAPSHOT_TAKEN.wait().await;
            self.0 = Some(Sending { taken, sent: None });
        }
    }

    /// Gives the snapshot up, because its host does not read.
    pub fn give_up(&mut self) {
        let Some(Sending { taken, .. }) = self.0.take() else {
            return;
        };
        end(taken.origin);
        if let Some(id) = taken.origin.id() {
            outbox::reply(id, Outcome::NotRead);
        }
    }

    /// Returns the header, then the parts, then the reply; `None` without a snapshot.
    fn message(&mut self) -> Option<DeviceMessage> {
        let sending = self.0.as_mut()?;
        let origin = sending.taken.origin;
        let Some(id) = origin.id() else {
            self.0 = None;
            return None;
        };
        let Some(offset) = sending.sent else {
            sending.sent = Some(0);
            return Some(DeviceMessage::Snapshot(sending.taken.header.clone()));
        };
        let bytes = part(offset as usize);
        if bytes.is_empty() {
            self.0 = None;
            end(origin);
            let outcome = Outcome::Done;
            return Some(DeviceMessage::Reply(Reply { id, outcome }));
        }
        sending.sent = Some(offset + bytes.len() as u32);
        Some(DeviceMessage::SnapshotPart(SnapshotPart { offset, bytes }))
    }
}

/// Returns the bytes of a part; empty from the end of the frame on.
fn part(offset: usize) -> Vec<u8, SNAPSHOT_PART_BYTES> {
    let length = FRAME_BYTES.saturating_sub(offset).min(SNAPSHOT_PART_BYTES);
    let mut bytes = Vec::new();
    // Never fails: the length is within the capacity.
    let _ = bytes.resize(length, 0);
    let from = (&raw const FRAME).cast::<u8>().wrapping_add(offset);
    // SAFETY: `offset + length` lies within `FRAME`, to which no reference is ever made. It was
    // written whole before its `Taken` came, and is written again only for a later command, whose
    // conversation is another one, or which came after this snapshot's end.
    unsafe { from.copy_to_nonoverlapping(bytes.as_mut_ptr(), length) };
    bytes
}
