//! `hivtac list`: lists the sensors that are plugged in.

use crate::device::seconds;
use crate::output::{self, note};
use clap::Args;
use hivtac_host::failure::Failure;
use hivtac_host::named::Listed;
use hivtac_host::port;
use std::time::Duration;

/// List the sensors that are plugged in: serial number, port, name, board and firmware
///
/// One that another program uses is listed with the error.
///
/// Example: hivtac list
#[derive(Args)]
pub struct ListArguments {
    /// One JSON object a line
    #[arg(long)]
    json: bool,
    /// Longest wait for each one's hello, s
    #[arg(long, value_name = "S", default_value = "2", value_parser = seconds)]
    timeout: Duration,
}

/// Prints a line, or a JSON object, for each sensor that is plugged in.
///
/// # Errors
/// When the ports cannot be listed.
pub fn run(arguments: &ListArguments) -> Result<(), Failure> {
    let attached = port::attached()?;
    if attached.is_empty() {
        note("hivtac: no sensor is plugged in");
    }
    for sensor in attached {
        let listed = Listed::ask(sensor, arguments.timeout);
        output::report(arguments.json, &listed, || listed.line())?;
    }
    Ok(())
}
