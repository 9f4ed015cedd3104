//! Converts failures of the tool to exceptions with the same text.

use crate::interrupt;
use hivtac_host::failure::{Failure, Kind};
use pyo3::exceptions::{PyException, PyKeyboardInterrupt};
use pyo3::{PyErr, create_exception};

create_exception!(
    hivtac,
    Error,
    PyException,
    "What went wrong, where, and what to do."
);
create_exception!(
    hivtac,
    NoDeviceError,
    Error,
    "None found, its port cannot be opened, or nobody answers."
);
create_exception!(
    hivtac,
    VersionError,
    Error,
    "The sensor speaks another version of the protocol."
);
create_exception!(hivtac, LostError, Error, "The connection was lost.");
create_exception!(
    hivtac,
    RefusedError,
    Error,
    "The sensor refused a command, or did not answer it."
);

/// The exception for a failure; for an interruption, the one that the signal's handler raised.
pub fn raised(failure: Failure) -> PyErr {
    let text = failure.to_string();
    match failure.kind {
        Kind::NoDevice => NoDeviceError::new_err(text),
        Kind::Version => VersionError::new_err(text),
        Kind::Lost => LostError::new_err(text),
        Kind::Refused => RefusedError::new_err(text),
        Kind::Interrupted => {
            interrupt::take().unwrap_or_else(|| PyKeyboardInterrupt::new_err(text))
        }
        Kind::Input | Kind::Usage | Kind::Rate | Kind::Loss | Kind::NotRight => {
            Error::new_err(text)
        }
    }
}
