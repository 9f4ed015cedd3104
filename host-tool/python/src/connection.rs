//! A conversation with a device. A wait holds neither the interpreter's lock nor the connection's
//! own: one thread may take samples while another waits for a picture.

use crate::convert::{self, MarkerNumbers, RestNumbers, SampleNumbers, TareNumbers};
use crate::error::{Error, raised};
use hivtac_host::contact_shape;
use hivtac_host::down::direction;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::look;
use hivtac_host::named;
use hivtac_host::port::Address;
use hivtac_host::reader::{Arrived, Others, Reader};
use hivtac_host::reply::log_text;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_wire::message::{DeviceHello, DeviceMessage, LogLevel, Request};
use hivtac_wire::settings::Selection;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Time for a tare or for keeping settings, in addition to the frames.
const PATIENCE: Duration = Duration::from_secs(10);
/// Longest time between two frames; an emulated device is slower than a real one.
const SLOWEST_FRAME: Duration = Duration::from_millis(500);

/// A connection, open or closed. A call that is under way in another thread keeps it open.
#[pyclass(frozen)]
pub struct Connection {
    talk: Mutex<Option<Arc<Talk>>>,
    hello: DeviceHello,
    patience: Duration,
}

/// An open connection.
pub struct Talk {
    reader: Reader,
    is_streaming: AtomicBool,
}

/// The result of [`Connection::look`].
type Look<'py> = (
    u32,
    f64,
    u16,
    u16,
    Bound<'py, PyBytes>,
    Bound<'py, PyBytes>,
    Option<Vec<MarkerNumbers>>,
);

/// A log level and a line.
type LeveledLine = (u8, String);

/// A log level as a number of Python's `logging`.
fn level(level: LogLevel) -> u8 {
    match level {
        LogLevel::Error => 40,
        LogLevel::Warning => 30,
        LogLevel::Info => 20,
    }
}

impl Talk {
    /// Waits for a sample with this function, for as long as the device sends messages.
    pub fn arrived(
        &self,
        patience: Duration,
        wait: impl FnOnce(&Reader) -> Result<Option<Arrived>, Failure>,
    ) -> Result<Option<Arrived>, Failure> {
        // Two threads at once may both ask for the stream, which does no harm.
        if !self.is_streaming.load(Ordering::Relaxed) {
            self.reader.stream(patience)?;
            self.is_streaming.store(true, Ordering::Relaxed);
        }
        wait(&self.reader)
    }
}

fn tare(
    link: &mut Link,
    others: Others<'_>,
    frames: u16,
    force: bool,
    keep: bool,
) -> Result<TareNumbers, Failure> {
    let request = match force {
        true => Request::TareAnyway { frames },
        false => Request::Tare { frames },
    };
    let mut tared = None;
    let patience = PATIENCE + SLOWEST_FRAME * frames.into();
    link.request(request, patience, |message| match message {
        DeviceMessage::Tared(report) => tared = Some(convert::tare(&report)),
        message => others(message),
    })?;
    if keep {
        let tare = true;
        let selection = Selection {
            tare,
            ..Selection::NONE
        };
        link.request(Request::Keep(selection), PATIENCE, others)?;
    }
    tared.ok_or_else(|| link.lost("what the tare gave did not come"))
}

fn set_contact(
    link: &mut Link,
    others: Others<'_>,
    shape: ContactShape,
    keep: bool,
    patience: Duration,
) -> Result<(), Failure> {
    link.request(Request::SetContactShape(shape), patience, &mut *others)?;
    if keep {
        let selection = Selection {
            contact_shape: true,
            ..Selection::NONE
        };
        link.request(Request::Keep(selection), PATIENCE, others)?;
    }
    Ok(())
}

fn rest(link: &mut Link, others: Others<'_>, patience: Duration) -> Result<RestNumbers, Failure> {
    let mut rest = None;
    link.request(Request::GetSettings, patience, |message| match message {
        DeviceMessage::Settings(report) => rest = Some(convert::rest(&report)),
        message => others(message),
    })?;
    rest.ok_or_else(|| link.lost("the settings did not come"))
}

#[pymethods]
impl Connection {
    /// Connects to a port (`tcp:HOST:PORT`, `uart:PORT` or a serial port's name), to the sensor
    /// with a name or serial number, or to the only sensor. `timeout`: longest wait for its
    /// answers, s.
    #[new]
    fn open(
        py: Python<'_>,
        port: Option<String>,
        device: Option<String>,
        timeout: f64,
    ) -> PyResult<Connection> {
        let patience = time(timeout)?;
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
            reader: Reader::start(link),
            is_streaming: AtomicBool::new(false),
        };
        Ok(Connection {
            talk: Mutex::new(Some(Arc::new(talk))),
            hello,
            patience,
        })
    }

    /// The device's identity.
    fn hello<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        convert::hello(py, &self.hello)
    }

    /// The next sample; `None` once the connection is closed.
    fn next(&self, py: Python<'_>) -> PyResult<Option<SampleNumbers>> {
        let Some(talk) = self.open_talk() else {
            return Ok(None);
        };
        self.sample(py, talk, |reader| reader.next_sample().map(Some))
    }

    /// The newest sample; `None` if there is none within `timeout`, s.
    fn newest(&self, py: Python<'_>, timeout: Option<f64>) -> PyResult<Option<SampleNumbers>> {
        let longest = timeout.map(time).transpose()?;
        let talk = self.open_talk().ok_or_else(|| raised(closed()))?;
        self.sample(py, talk, |reader| match longest {
            None => reader.newest().map(Some),
            Some(longest) => reader.newest_within(longest),
        })
    }

    /// Samples that arrived and were passed over.
    fn missed(&self) -> u64 {
        self.open_talk().map_or(0, |talk| talk.reader.missed())
    }

    /// Takes a rest position.
    fn tare(&self, py: Python<'_>, frames: u16, force: bool, keep: bool) -> PyResult<TareNumbers> {
        self.with(py, move |link, others| {
            tare(link, others, frames, force, keep)
        })
    }

    /// The rest position's state and changes.
    fn rest(&self, py: Python<'_>) -> PyResult<RestNumbers> {
        let patience = self.patience;
        self.with(py, move |link, others| rest(link, others, patience))
    }

    /// Sets the direction of gravity, as a vector of any length in the film's frame; `None` if it
    /// is unknown.
    fn set_down(&self, py: Python<'_>, vector: Option<[f64; 3]>) -> PyResult<()> {
        let down = match vector {
            None => Down::Unknown,
            Some(vector) => Down::Told(direction(vector).map_err(Error::new_err)?),
        };
        self.with(py, move |link, _| link.set_down(down))
    }

    /// Sets the contact's shape: `needle`, `round:R`, `flat:R` or `unknown`, R in mm.
    fn set_contact(&self, py: Python<'_>, shape: &str, keep: bool) -> PyResult<()> {
        let shape = contact_shape::parse(shape).map_err(Error::new_err)?;
        let patience = self.patience;
        self.with(py, move |link, others| {
            set_contact(link, others, shape, keep, patience)
        })
    }

    /// Number of a frame, its device time (s), columns, rows, and levels of red, green and blue.
    fn snapshot<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(u32, f64, u16, u16, Bound<'py, PyBytes>)> {
        let patience = self.patience;
        let frame = self.with(py, move |link, others| {
            Ok(link.snapshot(patience, others)?.frame)
        })?;
        let levels = PyBytes::new(py, &look::levels(&frame));
        let time_s = frame.time_us as f64 / 1e6;
        Ok((frame.number, time_s, frame.width, frame.height, levels))
    }

    /// Of a whole frame: its number, device time (s), columns, rows, levels of red, green and blue,
    /// mask (255 passes the threshold, 128 only dilation adds), and column, row and area of each
    /// marker, px.
    fn look<'py>(&self, py: Python<'py>) -> PyResult<Look<'py>> {
        let patience = self.patience;
        let taken = self.with(py, move |link, others| link.snapshot(patience, others))?;
        let (frame, dilations) = (taken.frame, self.hello.dilations);
        let [levels, mask] = py.detach(|| {
            let mask = look::mask(&frame, dilations).unwrap_or_default();
            [look::levels(&frame), mask]
        });
        let [levels, mask] = [levels, mask].map(|bytes| PyBytes::new(py, &bytes));
        let time_s = frame.time_us as f64 / 1e6;
        let (size, markers) = ((frame.width, frame.height), taken.sample);
        let markers = markers.and_then(|sample| convert::markers(&sample));
        Ok((frame.number, time_s, size.0, size.1, levels, mask, markers))
    }

    /// The lines that the device logged since the last call.
    fn take_lines(&self) -> Vec<LeveledLine> {
        let lines = self.open_talk().map(|talk| talk.reader.take_lines());
        let lines = lines.into_iter().flatten();
        lines
            .map(|line| (level(line.level), log_text(&line)))
            .collect()
    }

    /// Ends the conversation; further calls have no effect.
    fn close(&self, py: Python<'_>) {
        let talk = self.lock().take();
        py.detach(|| drop(talk));
    }
}

fn time(seconds: f64) -> PyResult<Duration> {
    Duration::try_from_secs_f64(seconds)
        .map_err(|_| Error::new_err(format!("timeout: {seconds} s is no time to wait")))
}

fn closed() -> Failure {
    Failure::new(Kind::Input, "this connection was closed")
}

impl Connection {
    /// Held for a moment only, and never while the interpreter's lock is waited for.
    fn lock(&self) -> MutexGuard<'_, Option<Arc<Talk>>> {
        self.talk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The open conversation; an error if it was closed.
    pub fn talk(&self) -> PyResult<Arc<Talk>> {
        self.open_talk().ok_or_else(|| raised(closed()))
    }

    /// The device's identity.
    pub fn device(&self) -> &DeviceHello {
        &self.hello
    }

    /// Longest wait for its answers.
    pub fn patience(&self) -> Duration {
        self.patience
    }

    fn open_talk(&self) -> Option<Arc<Talk>> {
        self.lock().clone()
    }

    fn sample(
        &self,
        py: Python<'_>,
        talk: Arc<Talk>,
        wait: impl FnOnce(&Reader) -> Result<Option<Arrived>, Failure> + Send,
    ) -> PyResult<Option<SampleNumbers>> {
        // The last call under way closes the connection, which may wait, too.
        let arrived = py.detach(move || talk.arrived(self.patience, wait));
        let arrived = arrived.map_err(raised)?;
        Ok(arrived.map(|it| convert::sample(&it.sample, it.came_ns, it.exposed_ns)))
    }

    /// Works with an open connection, without the interpreter's lock.
    fn with<T: Send + 'static>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Link, Others<'_>) -> Result<T, Failure> + Send + 'static,
    ) -> PyResult<T> {
        let talk = self.open_talk();
        let done = py.detach(move || match talk {
            Some(talk) => talk.reader.with(work),
            None => Err(closed()),
        });
        done.map_err(raised)
    }
}
