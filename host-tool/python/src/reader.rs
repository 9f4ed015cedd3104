//! Reads a recording sample by sample.

use crate::convert::{self, SampleNumbers};
use crate::error::raised;
use hivtac_host::clock::Clock;
use hivtac_host::recording::Recording;
use hivtac_wire::message::{DeviceHello, DeviceMessage};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A recording of one device.
#[pyclass(frozen)]
pub struct Reader {
    recording: Mutex<(Recording, Clock)>,
    hello: DeviceHello,
}

#[pymethods]
impl Reader {
    #[new]
    fn open(py: Python<'_>, path: PathBuf, device: Option<String>) -> PyResult<Reader> {
        let opened = py.detach(|| Recording::open(&path, device.as_deref()));
        let (recording, hello) = opened.map_err(raised)?;
        let recording = Mutex::new((recording, Clock::default()));
        Ok(Reader { recording, hello })
    }

    /// The device's identity.
    fn hello<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        convert::hello(py, &self.hello)
    }

    /// The next sample; `None` at the end.
    fn next(&self, py: Python<'_>) -> PyResult<Option<SampleNumbers>> {
        let next = py.detach(|| {
            let (recording, clock) = &mut *self.lock();
            while let Some((came_ns, message)) = recording.next_message()? {
                match message {
                    DeviceMessage::Stats(stats) => clock.latency(stats.latency_us),
                    DeviceMessage::Sample(sample) => {
                        let exposed_ns = clock.stamp_ns(sample.time_us, came_ns);
                        return Ok(Some(convert::sample(&sample, came_ns, exposed_ns)));
                    }
                    _ => (),
                }
            }
            Ok(None)
        });
        next.map_err(raised)
    }

    /// True after the end of a recording that was cut.
    fn is_cut(&self, py: Python<'_>) -> bool {
        py.detach(|| self.lock().0.is_cut())
    }

    /// The damaged parts that were skipped until now.
    fn damage(&self, py: Python<'_>) -> Vec<String> {
        py.detach(|| {
            self.lock()
                .0
                .damage()
                .iter()
                .map(ToString::to_string)
                .collect()
        })
    }
}

impl Reader {
    fn lock(&self) -> MutexGuard<'_, (Recording, Clock)> {
        self.recording
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}
