//! `hivtac list`: which sensors are plugged in.

use crate::lines::to_json;
use crate::output::{note, print};
use hivtac_host::failure::Failure;
use hivtac_host::named::Listed;
use hivtac_host::port;
use std::time::Duration;

/// Prints a line, or a JSON object, for each sensor that is plugged in.
///
/// # Errors
/// When the ports cannot be listed.
pub fn run(patience: Duration, json: bool) -> Result<(), Failure> {
    let attached = port::attached()?;
    if attached.is_empty() {
        note("hivtac: no sensor is plugged in");
    }
    for sensor in attached {
        let listed = Listed::ask(sensor, patience);
        print(&match json {
            true => to_json(&listed),
            false => listed.line(),
        })?;
    }
    Ok(())
}
