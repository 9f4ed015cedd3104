//! What outlives a restart: read at the start, written when a host asks for it, while everything
//! else goes on.
//!
//! # Design
//! The first two sectors of the flash's second bank hold a log of one record ([`Log`]): after a
//! power cut at any moment the device has what it had kept before, or what it was to keep. A record
//! of another version is not read, nor written over before something is kept.

use crate::flash::SecondBank;
use crate::session::Asked;
use crate::settings::InUse;
use crate::shared::{MEMORY_ORDER, MEMORY_ORDERED};
use crate::{log, outbox, settings};
use core::sync::atomic::Ordering;
use hivtac_storage::{Log, PAYLOAD_LIMIT, SaveError};
use hivtac_wire::kept::{MAX_BYTES, Record};
use hivtac_wire::message::{DeviceMessage, LogLevel, Outcome};
use hivtac_wire::settings::{Found, Selection, SettingsReport};

const _: () = assert!(MAX_BYTES <= PAYLOAD_LIMIT);

/// What a host asks of it, and who.
pub struct MemoryOrder {
    action: Action,
    asked: Asked,
}

/// What is to be done.
#[derive(Clone, Copy)]
pub enum Action {
    /// Tell what is in use, and what is kept.
    Report,
    /// Keep what is in use.
    Keep(Selection),
}

/// Has something done for the command `id`; `Busy` while something is.
pub fn order(action: Action, id: u16) -> Option<Outcome> {
    if MEMORY_ORDERED.swap(true, Ordering::Relaxed) {
        return Some(Outcome::Busy);
    }
    let asked = Asked::by(id);
    MEMORY_ORDER.signal(MemoryOrder { action, asked });
    None
}

/// What is kept, and where.
pub struct Memory {
    log: Log<SecondBank>,
    record: Record,
    /// At the start.
    found: Found,
    /// Whether `record` is what the next start reads.
    is_kept: bool,
}

impl Memory {
    /// Reads what is kept. Call once, at the start.
    pub fn open(bank: SecondBank) -> Self {
        let mut payload = [0; PAYLOAD_LIMIT];
        let (log, length) = Log::open(bank, &mut payload);
        let kept = length.map(|length| Record::of_bytes(payload.get(..length).unwrap_or(&[])));
        let (found, record) = match kept {
            None => (Found::Nothing, Record::default()),
            Some(Ok(record)) => (Found::Settings, record),
            Some(Err(_)) => (Found::AnotherVersion, Record::default()),
        };
        Self {
            log,
            record,
            found,
            is_kept: found == Found::Settings,
        }
    }

    /// What is kept.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// What was written when the power was cut may not read so the next time: it is written again.
    async fn settle(&mut self) {
        if self.log.is_settled() || !self.is_kept {
            return;
        }
        let record = self.record.clone();
        if self.save(record).await.is_err() {
            say_worn();
        }
    }

    async fn carry_out(&mut self, MemoryOrder { action, asked }: MemoryOrder) {
        let outcome = match action {
            Action::Report => self.report(asked),
            Action::Keep(selection) => self.keep(selection).await,
        };
        MEMORY_ORDERED.store(false, Ordering::Relaxed);
        if let Some(id) = asked.id() {
            outbox::reply(id, outcome);
        }
    }

    fn report(&self, asked: Asked) -> Outcome {
        let Some(used) = settings::in_use() else {
            return Outcome::Busy;
        };
        let kept = self.selection(&used);
        let InUse {
            name,
            threshold,
            tare,
            temporal,
            rezeroed,
            ..
        } = used;
        if asked.id().is_some() {
            outbox::offer(DeviceMessage::Settings(SettingsReport {
                name,
                threshold,
                tare,
                kept,
                found: self.found,
                erases: self.log.erases(),
                failures: self.log.failures(),
                temporal,
                rezeroed,
            }));
        }
        Outcome::Done
    }

    /// Which of what is in use is kept.
    fn selection(&self, used: &InUse) -> Selection {
        Selection {
            name: used.name == self.record.name,
            threshold: used.own_threshold() == self.record.threshold,
            tare: used.tare == self.record.tare,
            temporal: used.temporal == self.record.temporal,
        }
    }

    async fn keep(&mut self, selection: Selection) -> Outcome {
        let Some(used) = settings::in_use() else {
            return Outcome::Busy;
        };
        let mut record = self.record.clone();
        if selection.threshold {
            record.threshold = used.own_threshold();
        }
        if selection.tare {
            record.tare = used.tare;
        }
        if selection.name {
            record.name = used.name;
        }
        if selection.temporal {
            record.temporal = used.temporal;
        }
        if record == self.record && self.is_kept {
            return Outcome::Done;
        }
        match self.save(record).await {
            Ok(()) => Outcome::Done,
            Err(_) => {
                say_worn();
                Outcome::Worn
            }
        }
    }

    async fn save(&mut self, record: Record) -> Result<(), SaveError> {
        let mut buffer = [0; MAX_BYTES];
        self.log.save(record.to_bytes(&mut buffer)).await?;
        self.record = record;
        self.is_kept = true;
        Ok(())
    }
}

fn say_worn() {
    let text = format_args!("the flash is worn: settings cannot be kept any more");
    log::say(LogLevel::Error, text);
}

/// Runs for ever at the USB executor's priority.
#[embassy_executor::task]
pub async fn run(mut memory: Memory) {
    memory.settle().await;
    loop {
        let order = MEMORY_ORDER.wait().await;
        memory.carry_out(order).await;
    }
}
