//! A conversation with a device. While anything waits, the interpreter's lock is free. It is taken
//! only after the connection's own lock, and two threads may use one connection.

use crate::error::{Error, raised};
use crate::told::{self, RestNumbers, SampleNumbers, TareNumbers};
use hivtac_host::contact_shape;
use hivtac_host::down::direction;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::frame;
use hivtac_host::link::{Link, log_text};
use hivtac_host::look;
use hivtac_host::named;
use hivtac_host::port::Address;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_wire::message::{DeviceHello, DeviceMessage, LogLevel, Request};
use hivtac_wire::settings::Selection;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Silence after which a streaming device counts as gone.
const SILENCE: Duration = Duration::from_secs(10);
/// Time for a tare or for keeping settings, in addition to the frames.
const PATIENCE: Duration = Duration::from_secs(10);
/// Longest time between two frames; an emulated device is slower than a real one.
const SLOWEST_FRAME: Duration = Duration::from_millis(500);

/// A connection, open or closed.
#[pyclass(frozen)]
pub struct Connection {
    talk: Mutex<Option<Talk>>,
    hello: DeviceHello,
    patience: Duration,
}

/// The state of an open connection.
struct Talk {
    link: Link,
    is_streaming: bool,
    heard: Heard,
}

/// A log level and a line.
type LeveledLine = (u8, String);

/// Messages that arrived during the wait for another message.
#[derive(Default)]
struct Heard {
    samples: VecDeque<SampleNumbers>,
    /// Log lines of the device.
    lines: Vec<LeveledLine>,
}

impl Heard {
    fn take(&mut self, message: DeviceMessage) {
        match message {
            DeviceMessage::Sample(sample) => {
                self.samples.push_back(told::sample(&sample, now_ns()));
            }
            DeviceMessage::Log(line) => self.lines.push((level(line.level), log_text(&line))),
            _ => (),
        }
    }
}

/// A log level as a number of Python's `logging`.
fn level(level: LogLevel) -> u8 {
    match level {
        LogLevel::Error => 40,
        LogLevel::Warning => 30,
        LogLevel::Info => 20,
    }
}

fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.unwrap_or_default().as_nanos() as u64
}

impl Talk {
    fn request(&mut self, request: Request, patience: Duration) -> Result<(), Failure> {
        let Talk { link, heard, .. } = self;
        link.request(request, patience, |message| heard.take(message))
    }

    /// Waits for the next sample, for as long as the device sends messages.
    fn sample(&mut self, patience: Duration) -> Result<SampleNumbers, Failure> {
        if !self.is_streaming {
            self.request(Request::StartWithMarkers, patience)?;
            self.is_streaming = true;
        }
        loop {
            if let Some(sample) = self.heard.samples.pop_front() {
                return Ok(sample);
            }
            match self.link.receive(Instant::now() + SILENCE)? {
                Some(message) => self.heard.take(message),
                None => return Err(self.link.lost("the device sends nothing")),
            }
        }
    }

    fn tare(&mut self, frames: u16, force: bool, keep: bool) -> Result<TareNumbers, Failure> {
        let request = match force {
            true => Request::TareAnyway { frames },
            false => Request::Tare { frames },
        };
        let mut tared = None;
        let Talk { link, heard, .. } = self;
        let patience = PATIENCE + SLOWEST_FRAME * frames.into();
        link.request(request, patience, |message| match message {
            DeviceMessage::Tared(report) => tared = Some(told::tare(&report)),
            message => heard.take(message),
        })?;
        if keep {
            let tare = true;
            let selection = Selection {
                tare,
                ..Selection::NONE
            };
            self.request(Request::Keep(selection), PATIENCE)?;
        }
        tared.ok_or_else(|| self.link.lost("what the tare gave did not come"))
    }

    fn set_contact(
        &mut self,
        shape: ContactShape,
        keep: bool,
        patience: Duration,
    ) -> Result<(), Failure> {
        self.request(Request::SetContactShape(shape), patience)?;
        if keep {
            let selection = Selection {
                contact_shape: true,
                ..Selection::NONE
            };
            self.request(Request::Keep(selection), PATIENCE)?;
        }
        Ok(())
    }

    fn rest(&mut self, patience: Duration) -> Result<RestNumbers, Failure> {
        let mut rest = None;
        let Talk { link, heard, .. } = self;
        link.request(Request::GetSettings, patience, |message| match message {
            DeviceMessage::Settings(report) => rest = Some(told::rest(&report)),
            message => heard.take(message),
        })?;
        rest.ok_or_else(|| self.link.lost("the settings did not come"))
    }
}

#[pymethods]
impl Connection {
    /// Connects to a port (`tcp:HOST:PORT` or a serial port's name), to the sensor with a name or
    /// serial number, or to the only sensor. `timeout`: longest wait for its answers, s.
    #[new]
    fn open(
        py: Python<'_>,
        port: Option<String>,
        device: Option<String>,
        timeout: f64,
    ) -> PyResult<Connection> {
        let patience = Duration::try_from_secs_f64(timeout)
            .map_err(|_| Error::new_err(format!("timeout: {timeout} s is no time to wait")))?;
        let (link, hello) = py
            .detach(|| {
                let address = match (port, device) {
                    (None, None) => Address::Find,
                    (Some(port), None) => Address::parse(&port),
                    (None, Some(device)) => named::find(&device, patience)?,
                    (Some(_), Some(_)) => {
                        let message = "give a port or a device, not both";
                        return Err(Failure::input(message));
                    }
                };
                Link::connect(&address, patience)
            })
            .map_err(raised)?;
        let talk = Talk {
            link,
            is_streaming: false,
            heard: Heard::default(),
        };
        Ok(Connection {
            talk: Mutex::new(Some(talk)),
            hello,
            patience,
        })
    }

    /// The device's identity.
    fn hello<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        told::hello(py, &self.hello)
    }

    /// The next sample; `None` once the connection is closed.
    fn next(&self, py: Python<'_>) -> PyResult<Option<SampleNumbers>> {
        let next = py.detach(|| match &mut *self.lock() {
            Some(talk) => talk.sample(self.patience).map(Some),
            None => Ok(None),
        });
        next.map_err(raised)
    }

    /// Takes a rest position.
    fn tare(&self, py: Python<'_>, frames: u16, force: bool, keep: bool) -> PyResult<TareNumbers> {
        self.with(py, |talk| talk.tare(frames, force, keep))
    }

    /// The rest position's state and changes.
    fn rest(&self, py: Python<'_>) -> PyResult<RestNumbers> {
        self.with(py, |talk| talk.rest(self.patience))
    }

    /// Sets the direction of gravity, as a vector of any length in the film's frame; `None` if it
    /// is unknown.
    fn set_down(&self, py: Python<'_>, vector: Option<[f64; 3]>) -> PyResult<()> {
        let down = match vector {
            None => Down::Unknown,
            Some(vector) => Down::Told(direction(vector).map_err(Error::new_err)?),
        };
        self.with(py, |talk| talk.link.set_down(down))
    }

    /// Sets the shape of what presses: `needle`, `round:R`, `flat:R` or `unknown`, R in mm.
    fn set_contact(&self, py: Python<'_>, shape: &str, keep: bool) -> PyResult<()> {
        let shape = contact_shape::parse(shape).map_err(Error::new_err)?;
        self.with(py, |talk| talk.set_contact(shape, keep, self.patience))
    }

    /// Number of a frame, its device time (s), columns, rows, and levels of red, green and blue.
    fn snapshot<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(u32, f64, u16, u16, Bound<'py, PyBytes>)> {
        let frame = self.with(py, |talk| {
            let Talk { link, heard, .. } = talk;
            let taken = frame::take(link, self.patience, |message| heard.take(message))?;
            Ok(taken.frame)
        })?;
        let levels = PyBytes::new(py, &look::levels(&frame));
        let time_s = frame.time_us as f64 / 1e6;
        Ok((frame.number, time_s, frame.width, frame.height, levels))
    }

    /// The lines that the device logged since the last call.
    fn take_lines(&self, py: Python<'_>) -> Vec<LeveledLine> {
        py.detach(|| {
            let mut talk = self.lock();
            let lines = talk.as_mut().map(|talk| &mut talk.heard.lines);
            lines.map(std::mem::take).unwrap_or_default()
        })
    }

    /// Ends the conversation; further calls have no effect.
    fn close(&self, py: Python<'_>) {
        py.detach(|| {
            if let Some(mut talk) = self.lock().take()
                && talk.is_streaming
            {
                // An error is ignored: the port may be gone, and is closed anyway.
                let _ = talk.link.command(Request::Stop);
            }
        });
    }
}

impl Connection {
    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Talk>> {
        self.talk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs a function on an open connection, without the interpreter's lock.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Talk) -> Result<T, Failure> + Send,
    ) -> PyResult<T> {
        let done = py.detach(|| match &mut *self.lock() {
            Some(talk) => work(talk),
            None => Err(Failure::new(Kind::Input, "this connection was closed")),
        });
        done.map_err(raised)
    }
}
