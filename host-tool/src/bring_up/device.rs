//! Checks whether there is a device, and whether its USB is steady.

use super::complaints::hear;
use super::report::Step;
use crate::info::{Info, ask};
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_wire::message::{DeviceHello, Request};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// Questions that the device must answer.
const QUESTIONS: u32 = 50;

/// The step for a device that does not answer.
pub fn not_there(failure: &Failure) -> Step {
    let advice = [
        failure.to_string(),
        "the LED flashes twice a second: the microcontroller is of revision Y or older, which this \
         firmware cannot use"
            .to_owned(),
        "the LED is dark: flash the firmware, and look for a fault of the supply".to_owned(),
        "the LED blinks or breathes: the firmware runs; use a USB cable that carries data, without \
         a hub"
            .to_owned(),
    ];
    let found = "no device answers".to_owned();
    Step::new("usb", found, advice.to_vec(), Value::Null)
}

/// Asks questions, one after the other, and judges the answers.
///
/// # Errors
/// When the connection breaks.
pub fn usb(link: &mut Link, patience: Duration) -> Result<Step, Failure> {
    let mut complaints = Vec::new();
    let (mut longest, mut failed) = (Duration::ZERO, 0);
    for _ in 0..QUESTIONS {
        let begun = Instant::now();
        let answer = link.request(Request::GetInfo, patience, |message| {
            hear(&mut complaints, message);
        });
        failed += u32::from(refused(answer)?);
        longest = longest.max(begun.elapsed());
    }
    let damaged = link.rejected();
    let longest_ms = longest.as_secs_f64() * 1e3;
    let mut wrong = Vec::new();
    if failed + damaged.frames() > 0 {
        wrong.push(format!(
            "{failed} of {QUESTIONS} questions had no answer, {} messages ({} bytes) came damaged: \
             another cable, no hub, and no other program on this port",
            damaged.frames(),
            damaged.bytes
        ));
    }
    let found = format!(
        "{QUESTIONS} questions, answered within {longest_ms:.1} ms, {} bytes damaged",
        damaged.bytes
    );
    let figures = json!({
        "questions": QUESTIONS,
        "unanswered": failed,
        "longest_ms": longest_ms,
        "damaged_messages": damaged.frames(),
        "damaged_bytes": damaged.bytes,
    });
    Ok(Step::new("usb", found, wrong, figures))
}

/// Whether the device refused a command or did not answer it; returns other failures.
pub fn refused(answer: Result<(), Failure>) -> Result<bool, Failure> {
    match reason(answer)? {
        Some(_) => Ok(true),
        None => Ok(false),
    }
}

/// Why the device refused a command, if it did; returns other failures.
pub fn reason(answer: Result<(), Failure>) -> Result<Option<String>, Failure> {
    use hivtac_host::failure::Kind;
    match answer {
        Ok(()) => Ok(None),
        Err(failure) if failure.kind == Kind::Refused => Ok(Some(failure.to_string())),
        Err(failure) => Err(failure),
    }
}

/// The device's state, as `hivtac info --json` prints it.
pub fn described(
    link: &mut Link,
    patience: Duration,
    hello: DeviceHello,
) -> Result<Value, Failure> {
    let (hello, stats) = ask(link, patience, hello)?;
    Ok(json!(Info::new(&link.name, &hello, stats)))
}
