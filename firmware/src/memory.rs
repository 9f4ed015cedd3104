//! Keeps data through restarts: read at the start, written when a host requests it, while all other
//! tasks go on.
//!
//! # Design
//! The first two sectors of the flash's second bank hold a log of one record ([`Log`]). After a
//! power cut at any moment the device has the old record or the new one. A record of a different
//! version is not read, and not overwritten until something is kept. The next four sectors hold two
//! models; the record names the kept one, after it was read back.

use crate::flash::SecondBank;
use crate::model::{self, ModelFile};
use crate::model_upload::{self, Whole};
use crate::orders::{ORDERS, Order};
use crate::self_test::{self, OfFlash};
use crate::session::Origin;
use crate::thermometer::Thermometer;
use crate::{camera, capture_task, log, model_slots, outbox, settings, supply};
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use hivtac_portable::device::kept::{self, Keeper};
use hivtac_portable::storage::{Log, PAYLOAD_LIMIT, SaveError};
use hivtac_terms::camera::CameraSettings;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_wire::kept::{KeptModel, MAX_BYTES, Record};
use hivtac_wire::message::{DeviceMessage, LogLevel, ModelSource, Outcome};
use hivtac_wire::settings::{Found, Name, Selection};

const _: () = assert!(MAX_BYTES <= PAYLOAD_LIMIT);

/// A host's order for the flash. From the USB tasks.
static MEMORY_ORDER: Signal<CriticalSectionRawMutex, MemoryOrder> = Signal::new();

/// True while such an order is carried out. Set by the USB tasks, cleared by the memory task.
static MEMORY_ORDERED: AtomicBool = AtomicBool::new(false);

/// A host's order for the flash, and who sent it.
struct MemoryOrder {
    action: Action,
    origin: Origin,
}

/// The action of an order.
#[derive(Clone, Copy)]
pub enum Action {
    /// Report the settings in use and the kept ones.
    Report,
    /// Report the result of the self-test.
    Health,
    /// Keep these settings of those in use.
    Keep(Selection),
    /// Keep the uploaded model, and use it.
    UseModel,
    /// Delete the kept model, and use the built-in one.
    UseBuiltInModel,
    /// Delete all kept data, and use the settings of a new device.
    Reset,
}

/// Passes an action on for the command `id`; returns `Busy` if one is already being carried out.
pub fn order(action: Action, id: u16) -> Option<Outcome> {
    if MEMORY_ORDERED.swap(true, Ordering::Relaxed) {
        return Some(Outcome::Busy);
    }
    let origin = Origin::by(id);
    MEMORY_ORDER.signal(MemoryOrder { action, origin });
    None
}

/// Returns whether an action is being carried out.
pub fn is_ordered() -> bool {
    MEMORY_ORDERED.load(Ordering::Relaxed)
}

/// The kept data, and the flash that holds it.
pub struct Memory {
    log: Log<SecondBank>,
    thermometer: Thermometer,
    record: Record,
    /// The content of the flash at the start.
    found: Found,
    /// True if `record` is the record that the next start reads.
    is_kept: bool,
}

impl Memory {
    /// Reads the kept data. Call once, at the start.
    pub fn open(bank: SecondBank, thermometer: Thermometer) -> Self {
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
            thermometer,
            record,
            found,
            is_kept: found == Found::Settings,
        }
    }

    /// The kept data.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// Returns the model for the start.
    pub fn model(&mut self) -> ModelFile {
        match self.record.model {
            Some(kept) => model::kept(self.log.flash(), &kept),
            None => ModelFile::built_in(ModelSource::BuiltIn),
        }
    }

    /// A record whose writing was cut off may read differently next time, so it is written again.
    async fn settle(&mut self) {
        if self.log.is_settled() || !self.is_kept {
            return;
        }
        let record = self.record.clone();
        if self.save(record).await.is_err() {
            say_worn();
        }
    }

    async fn carry_out(&mut self, MemoryOrder { action, origin }: MemoryOrder) {
        let outcome = match action {
            Action::Report => Err(self.report(origin)),
            Action::Health => Err(self.health(origin).await),
            Action::Keep(selection) => Err(self.keep(selection).await),
            Action::UseModel => self.keep_model().await,
            Action::UseBuiltInModel => self.forget_model().await,
            Action::Reset => self.reset().await,
        };
        let outcome = match outcome {
            Err(outcome) => Some(outcome),
            // The pipeline replies once it uses the model.
            Ok(next) => {
                let order = Order::UseModel {
                    origin,
                    next,
                    afresh: matches!(action, Action::Reset),
                };
                ORDERS.send(order).await;
                None
            }
        };
        MEMORY_ORDERED.store(false, Ordering::Relaxed);
        if let Some((id, outcome)) = origin.id().zip(outcome) {
            outbox::reply(id, outcome);
        }
    }

    async fn health(&mut self, origin: Origin) -> Outcome {
        let temperature = self.thermometer.read().await;
        let health = self_test::health(&self.of_flash(), temperature);
        if origin.id().is_some() {
            outbox::offer(DeviceMessage::Health(health));
        }
        Outcome::Done
    }

    /// Returns the flash's part of the self-test.
    pub fn of_flash(&self) -> OfFlash {
        OfFlash {
            found: self.found,
            failures: self.log.failures() + u32::from(supply::has_failed()),
        }
    }

    fn report(&self, origin: Origin) -> Outcome {
        let Some(used) = settings::in_use() else {
            return Outcome::Busy;
        };
        if origin.id().is_some() {
            let keeper = Keeper {
                found: self.found,
                erases: self.log.erases(),
                failures: self.log.failures(),
            };
            let report = kept::report(used, camera::report(), &self.record, &keeper);
            outbox::offer(DeviceMessage::Settings(report));
        }
        Outcome::Done
    }

    async fn keep(&mut self, selection: Selection) -> Outcome {
        let Some(used) = settings::in_use() else {
            return Outcome::Busy;
        };
        let mut record = self.record.clone();
        kept::keep(&mut record, selection, used, &camera::report());
        if record == self.record && self.is_kept {
            return Outcome::Done;
        }
        match self.save_or_say(record).await {
            Ok(()) => Outcome::Done,
            Err(outcome) => outcome,
        }
    }

    /// Checks the uploaded model before the flash is written, and keeps it.
    async fn keep_model(&mut self) -> Result<ModelFile, Outcome> {
        let whole = model_upload::finish().ok_or(Outcome::InvalidArgument)?;
        let file = model_slots::lend(whole.slot, whole.bytes).ok_or(Outcome::Busy)?;
        let kept = self.keep_file(whole, file).await;
        if kept.is_err() {
            model_slots::give_back(whole.slot);
        }
        kept
    }

    async fn keep_file(
        &mut self,
        Whole { slot, bytes }: Whole,
        file: &'static [u8],
    ) -> Result<ModelFile, Outcome> {
        let crc = model::checked(file).map_err(|refusal| {
            log::say(LogLevel::Error, format_args!("{refusal}"));
            refusal.outcome()
        })?;
        let written = self.log.write_blob(model::sectors(slot), file).await;
        written.map_err(|_| {
            say_worn();
            Outcome::Worn
        })?;
        let kept = Some(KeptModel { slot, bytes, crc });
        self.name_model(kept).await?;
        Ok(ModelFile::kept(file, slot))
    }

    async fn forget_model(&mut self) -> Result<ModelFile, Outcome> {
        self.name_model(None).await?;
        Ok(ModelFile::built_in(ModelSource::BuiltIn))
    }

    async fn name_model(&mut self, model: Option<KeptModel>) -> Result<(), Outcome> {
        let record = self.record.clone();
        self.save_or_say(Record { model, ..record }).await
    }

    async fn reset(&mut self) -> Result<ModelFile, Outcome> {
        self.save_or_say(Record::default()).await?;
        settings::set_name(Name::new());
        settings::set_down(Down::default());
        // A new device's shape has no radius that could be out of range.
        let _ = settings::set_contact_shape(ContactShape::default());
        if camera::report().settings != CameraSettings::default() {
            capture_task::set_afresh();
        }
        Ok(ModelFile::built_in(ModelSource::BuiltIn))
    }

    async fn save_or_say(&mut self, record: Record) -> Result<(), Outcome> {
        self.save(record).await.map_err(|_| {
            say_worn();
            Outcome::Worn
        })
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
    let text = format_args!("the flash is worn or the supply low: settings cannot be kept");
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
