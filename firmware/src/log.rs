//! Sends lines for a person: always to the debug probe, and to a host that listens.

use crate::outbox;
use core::fmt::{self, Write};
use embassy_time::Instant;
use heapless::String;
use hivtac_wire::message::{DeviceMessage, LogLevel, LogLine};

/// Sends a line. A line that is too long is cut; if the host's queue is full, the line goes to the
/// probe only.
pub fn say(level: LogLevel, line: fmt::Arguments) {
    let mut text = Cut(String::new());
    // Never fails: text beyond the capacity is dropped.
    let _ = text.write_fmt(line);
    let Cut(text) = text;
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

/// A string that keeps the text that fits and drops the rest.
struct Cut(String<96>);

impl Write for Cut {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for character in text.chars() {
            if self.0.push(character).is_err() {
                break;
            }
        }
        Ok(())
    }
}
