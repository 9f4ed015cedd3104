//! Sends lines for a person: always to the debug probe, and to a host that listens.

use crate::outbox;
use core::fmt;
use embassy_time::Instant;
use heapless::String;
use hivtac_portable::device::answer::text;
use hivtac_wire::message::{DeviceMessage, LogLevel, LogLine};

/// Sends a line. A line that is too long is cut; if the host's queue is full, the line goes to the
/// probe only.
pub fn say(level: LogLevel, line: fmt::Arguments) {
    let text: String<96> = text(line);
    match level {
        LogLevel::Error => defmt::error!("{=str}", text.as_str()),
        LogLevel::Warning => defmt::warn!("{=str}", text.as_str()),
        LogLevel::Info => defmt::info!("{=str}", text.as_str()),
    }
    outbox::offer(DeviceMessage::Log(LogLine {
        level,
        time_us: Instant::now().as_micros(),
        text,
    }));
}
