//! Receives a model from the host, part by part, into a slot that is not in use.

use crate::model_slots;
use crate::session;
use core::cell::Cell;
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use hivtac_wire::message::{MODEL_BYTES, ModelPart, Outcome};

/// The upload. Used by the USB tasks and the memory task.
static UPLOAD: CriticalSectionMutex<Cell<Option<Upload>>> =
    CriticalSectionMutex::new(Cell::new(None));

/// The part of the file that has been received.
#[derive(Clone, Copy)]
struct Upload {
    conversation: u32,
    slot: u8,
    bytes: u32,
    received: u32,
}

/// A file that has been received completely.
#[derive(Clone, Copy)]
pub struct Whole {
    /// Its slot.
    pub slot: u8,
    /// Its length.
    pub bytes: u32,
}

/// Begins a file of `bytes` bytes; a previous upload is discarded. Only while the memory task has
/// no order.
pub fn begin(bytes: u32) -> Outcome {
    if bytes == 0 || bytes > MODEL_BYTES as u32 {
        return Outcome::InvalidArgument;
    }
    let upload = model_slots::free().map(|slot| Upload {
        conversation: session::number(),
        slot,
        bytes,
        received: 0,
    });
    UPLOAD.lock(|cell| cell.set(upload));
    match upload {
        Some(_) => Outcome::Done,
        None => Outcome::Busy,
    }
}

/// Takes the next bytes.
pub fn part(part: &ModelPart) -> Outcome {
    match take(part) {
        Some(upload) => {
            UPLOAD.lock(|cell| cell.set(Some(upload)));
            Outcome::Done
        }
        None => Outcome::InvalidArgument,
    }
}

/// Writes the bytes behind the previous ones; returns `None` if they do not follow them.
fn take(part: &ModelPart) -> Option<Upload> {
    let upload = current()?;
    let received = upload.received.checked_add(part.bytes.len() as u32)?;
    if part.offset != upload.received || received > upload.bytes {
        return None;
    }
    let range = upload.received as usize..received as usize;
    model_slots::fill(upload.slot, |file| {
        let place = file.get_mut(range)?;
        for (byte, value) in place.iter_mut().zip(&part.bytes) {
            *byte = *value;
        }
        Some(Upload { received, ..upload })
    })?
}

/// Ends the upload and returns the file; `None` if it is not complete.
pub fn finish() -> Option<Whole> {
    let Upload {
        slot,
        bytes,
        received,
        ..
    } = current()?;
    UPLOAD.lock(|cell| cell.set(None));
    (received == bytes).then_some(Whole { slot, bytes })
}

/// Returns the upload of the current conversation.
fn current() -> Option<Upload> {
    let upload = UPLOAD.lock(|cell| cell.get());
    upload.filter(|upload| upload.conversation == session::number())
}
