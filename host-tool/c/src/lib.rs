//! The sensor in C: `include/hivtac.h` says what each function does. Everything else is the code of
//! the tool, which Python uses, too.

mod border;
mod sample;

use border::{guarded, seconds, utf8};
use hivtac_host::down::direction;
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_host::named;
use hivtac_host::port::Address;
use hivtac_host::reader::{Arrived, Reader};
use hivtac_host::usual_tare::usual_tare;
use hivtac_terms::down::Down;
use hivtac_wire::message::Request;
use hivtac_wire::settings::Selection;
use sample::CSample;
use std::ffi::{CStr, c_char, c_int};
use std::time::Duration;

/// `HIVTAC_SAMPLE` and `HIVTAC_DONE` of the header.
const SAMPLE: c_int = 1;
const DONE: c_int = 0;

/// A connection, which C knows by its address.
pub struct Connection {
    reader: Reader,
    patience: Duration,
}

/// Connects to a sensor; null on failure.
///
/// # Safety
/// Each text is null, or ends with a zero byte and stays as it is during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hivtac_open(
    port: *const c_char,
    device: *const c_char,
    timeout_s: f64,
) -> *mut Connection {
    let opened = guarded(|| {
        let patience = seconds(timeout_s)?;
        // SAFETY: the caller's promise.
        let [port, device] = unsafe { [text(port), text(device)] };
        let address = match (port, device) {
            (None, None) => Address::Find,
            (Some(port), None) => Address::parse(utf8(port, "port")?),
            (None, Some(device)) => named::find(utf8(device, "device")?, patience)?,
            (Some(_), Some(_)) => return Err(Failure::input("give a port or a device, not both")),
        };
        let (link, _) = Link::connect(&address, patience)?;
        let reader = Reader::start(link);
        reader.stream(patience)?;
        Ok(Box::new(Connection { reader, patience }))
    });
    opened.map_or(std::ptr::null_mut(), Box::into_raw)
}

/// A text of C, if there is one.
///
/// # Safety
/// As of [`hivtac_open`].
unsafe fn text<'a>(text: *const c_char) -> Option<&'a CStr> {
    // SAFETY: the caller's promise; null is left out.
    (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) })
}

/// Waits for the next sample.
///
/// # Safety
/// `sensor` is null or from [`hivtac_open`] and not closed; `sample` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hivtac_next(
    sensor: *const Connection,
    timeout_s: f64,
    sample: *mut CSample,
) -> c_int {
    // SAFETY: the caller's promise.
    unsafe { take(sensor, timeout_s, sample, Reader::next_within) }
}

/// Waits for the newest sample.
///
/// # Safety
/// As of [`hivtac_next`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hivtac_newest(
    sensor: *const Connection,
    timeout_s: f64,
    sample: *mut CSample,
) -> c_int {
    // SAFETY: the caller's promise.
    unsafe { take(sensor, timeout_s, sample, Reader::newest_within) }
}

/// Writes the result of a wait.
///
/// # Safety
/// As of [`hivtac_next`].
unsafe fn take(
    sensor: *const Connection,
    timeout_s: f64,
    sample: *mut CSample,
    wait: fn(&Reader, Duration) -> Result<Option<Arrived>, Failure>,
) -> c_int {
    let taken = guarded(|| {
        // SAFETY: the caller's promise.
        let connection = unsafe { sensor.as_ref() }.ok_or_else(no_sensor)?;
        if sample.is_null() {
            return Err(Failure::input("sample is NULL"));
        }
        let arrived = wait(&connection.reader, seconds(timeout_s)?)?;
        let Some(arrived) = arrived else {
            return Ok(DONE);
        };
        // SAFETY: the caller's promise; it is not null.
        unsafe { sample.write(CSample::from(&arrived)) };
        Ok(SAMPLE)
    });
    taken.unwrap_or_else(|number| number)
}

fn no_sensor() -> Failure {
    Failure::input("sensor is NULL: was it opened? hivtac_last_error said why not")
}

/// Samples that arrived and were passed over.
///
/// # Safety
/// As of [`hivtac_next`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hivtac_missed(sensor: *const Connection) -> u64 {
    // SAFETY: the caller's promise.
    let connection = unsafe { sensor.as_ref() };
    let missed = guarded(|| Ok(connection.map_or(0, |connection| connection.reader.missed())));
    missed.unwrap_or(0)
}

/// Takes a rest position.
///
/// # Safety
/// As of [`hivtac_next`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hivtac_tare(sensor: *const Connection, keep: c_int) -> c_int {
    // SAFETY: the caller's promise.
    let connection = unsafe { sensor.as_ref() };
    done(|| {
        let connection = connection.ok_or_else(no_sensor)?;
        let (request, patience, _) = usual_tare(connection.patience);
        connection.reader.with(move |link, others| {
            link.request(request, patience, &mut *others)?;
            if keep == 0 {
                return Ok(());
            }
            let tare = Selection {
                tare: true,
                ..Selection::NONE
            };
            link.request(Request::Keep(tare), patience, others)
        })
    })
}

/// Sets which way gravity pulls.
///
/// # Safety
/// As of [`hivtac_next`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hivtac_set_down(
    sensor: *const Connection,
    x: f64,
    y: f64,
    z: f64,
) -> c_int {
    // SAFETY: the caller's promise.
    let connection = unsafe { sensor.as_ref() };
    done(|| {
        let connection = connection.ok_or_else(no_sensor)?;
        let down = Down::Told(direction([x, y, z]).map_err(Failure::input)?);
        connection.reader.with(move |link, _| link.set_down(down))
    })
}

fn done(work: impl FnOnce() -> Result<(), Failure>) -> c_int {
    guarded(work).map_or_else(|number| number, |()| DONE)
}

/// The text of this thread's last failure.
#[unsafe(no_mangle)]
pub extern "C" fn hivtac_last_error() -> *const c_char {
    border::last()
}

/// Ends the connection.
///
/// # Safety
/// `sensor` is null or from [`hivtac_open`], is closed once, and no other call has it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hivtac_close(sensor: *mut Connection) {
    if sensor.is_null() {
        return;
    }
    // SAFETY: the caller's promise.
    let connection = unsafe { Box::from_raw(sensor) };
    // A panic while it ends is reported, as every other.
    let _ = guarded(|| {
        drop(connection);
        Ok(())
    });
}
