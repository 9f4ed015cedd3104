//! The page's record button: writes one file at a time while the page is shown.

use crate::record::{Arrival, Recording};
use hivtac_host::failure::Failure;
use hivtac_host::page;
use hivtac_host::shown::{shown, unit_number};
use hivtac_wire::message::{DeviceHello, DeviceMessage};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between two flushes, and therefore the most that a power cut loses.
const FLUSH_EVERY: Duration = Duration::from_secs(1);

/// The recording of a device, if one is running.
pub struct Recorder {
    folder: PathBuf,
    under_way: Option<UnderWay>,
    /// The result of the last file.
    last: String,
}

struct UnderWay {
    recording: Recording,
    name: String,
    flushed: Instant,
}

impl Recorder {
    /// Records into files of this folder.
    pub fn new(folder: &Path) -> Recorder {
        Recorder {
            folder: folder.to_owned(),
            under_way: None,
            last: String::new(),
        }
    }

    /// Begins a file and returns its name. A running file goes on.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn begin(&mut self, hello: &DeviceHello) -> Result<String, Failure> {
        if self.under_way.is_none() {
            let file = free_name(&self.folder, &unit_number(&hello.device_id));
            self.under_way = Some(UnderWay {
                recording: Recording::create(&file, std::slice::from_ref(hello))?,
                name: shown(&file.display().to_string()),
                flushed: Instant::now(),
            });
        }
        Ok(self.state().text)
    }

    /// Keeps a device's message. A full disk only ends the file.
    pub fn message(&mut self, message: &DeviceMessage) {
        let Some(under_way) = &mut self.under_way else {
            return;
        };
        let mut result = under_way.recording.keep(&Arrival {
            sensor: 0,
            at: Instant::now(),
            message: message.clone(),
        });
        if result.is_ok() && under_way.flushed.elapsed() >= FLUSH_EVERY {
            under_way.flushed = Instant::now();
            result = under_way.recording.flush();
        }
        if let Err(failure) = result {
            self.end(Err(failure));
        }
    }

    /// Ends the running file, if there is one, and returns its result; `why` is the reason.
    pub fn end(&mut self, why: Result<(), Failure>) -> String {
        if let Some(under_way) = self.under_way.take() {
            let UnderWay {
                recording, name, ..
            } = under_way;
            let progress = recording.progress();
            self.last = match recording.end(why) {
                Ok(()) => format!("recorded {name}: {progress}"),
                Err(failure) => format!("{name}.partial: {progress}; it ended: {failure}"),
            };
        }
        self.last.clone()
    }

    /// The recording's state, for the page.
    pub fn state(&self) -> page::Recording {
        match &self.under_way {
            Some(UnderWay {
                name, recording, ..
            }) => page::Recording {
                on: true,
                text: format!("recording {name}: {}", recording.progress()),
            },
            None => page::Recording {
                on: false,
                text: self.last.clone(),
            },
        }
    }
}

/// `hivtac-UNIT-N.mcap` with the first free number.
fn free_name(folder: &Path, unit: &str) -> PathBuf {
    let name = |number: u32| folder.join(format!("hivtac-{unit}-{number}.mcap"));
    let is_free = |file: &PathBuf| !file.exists() && !file.with_extension("mcap.partial").exists();
    let mut names = (1..=u32::MAX).map(name);
    names.find(is_free).unwrap_or_else(|| name(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_taken_are_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let name = || free_name(folder.path(), "07");
        assert_eq!(name(), folder.path().join("hivtac-07-1.mcap"));
        std::fs::write(name(), "").unwrap();
        std::fs::write(folder.path().join("hivtac-07-2.mcap.partial"), "").unwrap();
        assert_eq!(name(), folder.path().join("hivtac-07-3.mcap"));
    }
}
