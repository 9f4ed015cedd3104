//! Samples for a while.

use super::complaints::hear;
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_wire::message::{DeviceMessage, Request, Sample};
use std::time::{Duration, Instant};

/// How many samples are wanted, and how long they are waited for.
pub struct Wanted {
    /// As many are enough.
    pub enough: usize,
    /// Fewer are of no use.
    pub least: usize,
    /// They are waited for so long,
    pub watch: Duration,
    /// and so long while there are too few: an emulated device is slow.
    pub patience: Duration,
}

/// Has them flow after `start`, and stop; what the device complains about is added to `complaints`.
///
/// # Errors
/// The connection breaks, or the device does not answer.
pub fn collect(
    link: &mut Link,
    start: Request,
    wanted: &Wanted,
    complaints: &mut Vec<String>,
) -> Result<Vec<Sample>, Failure> {
    let answer = wanted.patience;
    link.request(start, answer, |message| hear(complaints, message))?;
    let begun = Instant::now();
    let mut samples = Vec::new();
    while samples.len() < wanted.enough {
        let more = match samples.len() < wanted.least {
            true => wanted.watch.max(wanted.patience),
            false => wanted.watch,
        };
        match link.receive(begun + more)? {
            Some(DeviceMessage::Sample(sample)) => samples.push(sample),
            Some(message) => hear(complaints, message),
            None => break,
        }
    }
    link.request(Request::Stop, answer, |_| ())?;
    Ok(samples)
}
