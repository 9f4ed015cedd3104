//! Collects warnings and errors that the device logs.

use crate::output::note;
use crate::request::show_log;
use hivtac_host::reply::log_text;
use hivtac_wire::message::{DeviceMessage, LogLevel};

/// Shows a line that the device logs, and keeps it if it is a warning or an error.
pub fn hear(complaints: &mut Vec<String>, message: DeviceMessage) {
    match message {
        DeviceMessage::Log(line) if line.level != LogLevel::Info => {
            let text = log_text(&line);
            note(&text);
            complaints.push(text);
        }
        message => show_log(message),
    }
}
