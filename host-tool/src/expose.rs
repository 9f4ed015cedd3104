//! `hivtac expose`: fits exposure and gain to the present light.

use crate::device::Target;
use crate::output;
use crate::request::send;
use clap::Args;
use hivtac_host::failure::Failure;
use hivtac_host::reply::CAMERA_PATIENCE;
use hivtac_wire::message::Request;
use serde_json::json;

/// Let the camera find exposure and gain for the present light, until it restarts
///
/// It does so by itself when it starts. What `settings set` gave it stays.
///
/// Example: hivtac expose
#[derive(Args)]
pub struct ExposeArguments {
    #[command(flatten)]
    target: Target,
}

/// Sends the command that fits exposure and gain to the present light.
pub fn run(arguments: &ExposeArguments) -> Result<(), Failure> {
    let Target { device, json } = &arguments.target;
    let (mut link, _) = device.connect()?;
    let patience = device.timeout.max(CAMERA_PATIENCE);
    send(&mut link, Request::Expose, patience)?;
    output::tell(
        *json,
        "exposure and gain found; take a new tare",
        &json!({ "exposed": true }),
    )
}
