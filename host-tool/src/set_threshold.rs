//! Sets a device's threshold.

use crate::output::note;
use crate::request::{keep, send};
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_host::threshold::text;
use hivtac_terms::threshold::Threshold;
use hivtac_wire::message::{DeviceHello, Request};
use hivtac_wire::settings::Selection;
use std::time::Duration;

/// Sets a threshold, until the device restarts or for good. Warns if there will be no forces with
/// it.
pub fn set_threshold(
    link: &mut Link,
    device: &DeviceHello,
    wanted: Threshold,
    patience: Duration,
    is_kept: bool,
) -> Result<(), Failure> {
    send(link, Request::SetThreshold(wanted), patience)?;
    if is_kept {
        let selection = Selection {
            threshold: true,
            ..Selection::NONE
        };
        keep(link, selection)?;
    }
    let made_for = device.model.as_ref().map(|model| model.threshold);
    if let Some(made_for) = made_for.filter(|made_for| *made_for != wanted) {
        note(&format!(
            "hivtac: samples have markers but no force (model_mismatch): the device's model was \
             made for {}; `hivtac threshold --model` goes back to that",
            text(&made_for)
        ));
    }
    Ok(())
}
