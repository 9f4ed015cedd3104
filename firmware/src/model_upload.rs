//! A model on its way from the host, part after part, into a slot that is not in use.

use crate::model_slots;
use crate::session;
use core::cell::Cell;
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use hivtac_wire::message::{MODEL_BYTES, ModelPart, Outcome};

/// A model on its way. Used by the USB tasks and the memory task.
static UPLOAD: CriticalSectionMutex<Cell<Option<Upload>>> =
    CriticalSectionMutex::new(Cell::new(None));

/// What has come so far.
#[derive(Clone, Copy)]
struct Upload {
    conversation: u32,
    slot: u8,
    bytes: u32,
    received: u32,
}

/// A file that has come whole.
#[derive(Clone, Copy)]
pub struct Whole {
    /// Where it lies.
    pub slot: u8,
    /// Its length.
    pub bytes: u32,
}

/// A file of so many bytes begins; what came before is forgotten. Only while the memory task has no
/// order.
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

/// The next bytes.
pub fn part(part: &ModelPart) -> Outcome {
    match take(part) {
        Some(upload) => {
            UPLOAD.lock(|cell| cell.set(Some(upload)));
            Outcome::Done
        }
        None => Outcome::InvalidArgument,
    }
}

/// Writes them behind what came before; `None` when they do not follow it.
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

/// The file, once it is whole. It is no upload any more.
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

/// Of the present conversation.
fn current() -> Option<Upload> {
    let upload = UPLOAD.lock(|cell| cell.get());
    upload.filter(|upload| upload.conversation == session::number())
}
