//! The log of arrivals, for measuring latency: one JSON object per sample with the time at which
//! its last byte had left the device.

use std::fmt;
use std::fs::File;
use std::io::Write;
use std::path::Path;

use anyhow::Context;
use hivtac_wire::decoder::{Decoder, Received};
use hivtac_wire::frame::DEVICE_FRAME_LIMIT;
use hivtac_wire::message::DeviceMessage;
use serde_json::json;

/// The log of arrivals, and its file if it has one.
#[derive(Default)]
pub struct Arrivals {
    file: Option<File>,
    decoder: Decoder<DEVICE_FRAME_LIMIT>,
    failed: Option<String>,
}

impl Arrivals {
    /// Returns a log in a file, which is emptied first.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn create(path: &Path) -> anyhow::Result<Self> {
        let file = File::create(path).with_context(|| format!("arrivals {}", path.display()))?;
        Ok(Self {
            file: Some(file),
            ..Self::default()
        })
    }

    /// Logs the samples that end in a packet; the packet was on the bus until `at_ns`.
    pub fn packet(&mut self, mut bytes: &[u8], at_ns: u64) {
        let Some(file) = &mut self.file else { return };
        while let Some(received) = self.decoder.feed(&mut bytes) {
            let Received::Message(DeviceMessage::Sample(sample)) = received else {
                continue;
            };
            let line = json!({"frame": sample.frame, "time_s": at_ns as f64 / 1e9});
            if let Err(error) = file.write_all(format!("{line}\n").as_bytes()) {
                self.failed = Some(error.to_string());
            }
        }
    }

    /// Returns the reason why the log is incomplete; `None` if it is complete.
    pub fn failure(&self) -> Option<&str> {
        self.failed.as_deref()
    }
}

impl fmt::Debug for Arrivals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Arrivals")
            .field("file", &self.file)
            .finish_non_exhaustive()
    }
}
