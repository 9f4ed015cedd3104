//! What the device finds when it looks at itself: at the start, for the log, and on request.

use crate::health::{self, Condition};
use crate::settings;
use crate::shared::RESET_REASON;
use crate::stack;
use core::sync::atomic::Ordering;
use hivtac_wire::health::{Health, Problem, ResetReason};
use hivtac_wire::message::ModelSource;
use hivtac_wire::settings::Found;

/// Above this the microcontroller is hotter than its data sheet has it, hundredths of a degree.
const HOTTEST: i16 = 8_500;

/// What the flash's owner knows.
pub struct OfFlash {
    /// What it had at the start.
    pub found: Found,
    /// Attempts to write that failed.
    pub failures: u32,
}

/// Looks at everything. The temperature is as it was read, hundredths of a degree.
pub fn health(flash: &OfFlash, temperature_centidegrees: Option<i16>) -> Health {
    let (stack_used, stack_bytes) = (stack::used(), stack::bytes());
    let reset = reset_reason();
    let model = settings::of_pipeline().and_then(|told| told.model);
    let source = model.as_ref().map(|model| model.source);
    let found = [
        (Problem::CameraSilent, health::get() == Condition::NoCamera),
        (Problem::ModelMissing, model.is_none()),
        (
            Problem::ModelFallback,
            source == Some(ModelSource::Fallback),
        ),
        (
            Problem::SettingsUnread,
            flash.found == Found::AnotherVersion,
        ),
        (Problem::FlashFails, flash.failures > 0),
        (Problem::StackLow, stack_used > stack_bytes / 4 * 3),
        (Problem::WatchdogReset, reset == ResetReason::Watchdog),
        (Problem::SoftwareReset, reset == ResetReason::Software),
        (
            Problem::Temperature,
            temperature_centidegrees.is_none_or(|temperature| temperature > HOTTEST),
        ),
    ];
    let is_there = |(problem, is): (Problem, bool)| if is { problem.bit() } else { 0 };
    Health {
        reset,
        temperature_centidegrees,
        stack_used,
        stack_bytes,
        problems: found.map(is_there).iter().sum(),
    }
}

fn reset_reason() -> ResetReason {
    const REASONS: [ResetReason; 5] = [
        ResetReason::PowerOn,
        ResetReason::BrownOut,
        ResetReason::Pin,
        ResetReason::Software,
        ResetReason::Watchdog,
    ];
    let number = RESET_REASON.load(Ordering::Relaxed);
    let reason = REASONS.into_iter().find(|reason| *reason as u8 == number);
    reason.unwrap_or(ResetReason::Other)
}
