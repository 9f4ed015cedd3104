//! The native half of Python's `hivtac`: connections and recordings, with the tool's code. Its
//! numbers are in SI units. Users see `hivtac/__init__.py`, which makes arrays of them.

mod connection;
mod convert;
mod error;
mod grip;
mod interrupt;
mod reader;
mod twin;

use pyo3::prelude::*;

#[pymodule]
mod _hivtac {
    #[pymodule_export]
    use crate::connection::Connection;
    #[pymodule_export]
    use crate::error::{Error, LostError, NoDeviceError, RefusedError, VersionError};
    #[pymodule_export]
    use crate::grip::Grips;
    #[pymodule_export]
    use crate::reader::Reader;
    #[pymodule_export]
    use crate::twin::Twin;

    use super::*;

    #[pymodule_init]
    fn init(_module: &Bound<'_, PyModule>) -> PyResult<()> {
        hivtac_host::stop::ask_besides(crate::interrupt::is_interrupted);
        Ok(())
    }
}
