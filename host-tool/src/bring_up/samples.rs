//! Collects a device's samples for a time.

use super::complaints::hear;
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_wire::message::{DeviceMessage, Request, Sample};
use std::time::{Duration, Instant};

/// The number of samples that are wanted, and the longest waits for them.
pub struct Wanted {
    /// Number after which the collection ends.
    pub enough: usize,
    /// Fewest useful samples.
    pub least: usize,
    /// Longest time if there are enough useful samples.
    pub watch: Duration,
    /// Longest time while there are too few: an emulated device is slow.
    pub patience: Duration,
}

/// Starts the samples with `start`, collects them, and stops them. Adds the device's warnings and
/// errors to `complaints`.
///
/// # Errors
/// When the connection breaks or the device does not answer.
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
