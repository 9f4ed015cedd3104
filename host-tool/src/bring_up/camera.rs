//! Checks board and camera: their identities, and whether registers read back as written.

use super::complaints::hear;
use super::device::reason;
use super::report::Step;
use crate::health;
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_terms::fixed::Q;
use hivtac_wire::health::Problem;
use hivtac_wire::message::{DeviceMessage, Inspection, Request};
use serde_json::{Value, json};
use std::time::Duration;

/// Longest time to read all registers. A camera that does not answer is tried every half second.
const INSPECTION: Duration = Duration::from_secs(3);
/// An exposure beyond this part of the longest, with a gain of at least [`HIGH_GAIN`], is the
/// camera's limit.
const LONG_EXPOSURE: f64 = 0.95;
/// The largest gain of an OV7725 below the 4 that the firmware allows.
const HIGH_GAIN: Q<4, u16> = Q::from_bits(62);

/// Has the device read the camera's registers back.
///
/// # Errors
/// When the connection breaks.
pub fn step(link: &mut Link, patience: Duration) -> Result<(Step, Option<Inspection>), Failure> {
    let (mut complaints, mut inspection) = (Vec::new(), None);
    let answer = link.request(
        Request::Inspect,
        patience + INSPECTION,
        |message| match message {
            DeviceMessage::Inspection(it) => inspection = Some(it),
            message => hear(&mut complaints, message),
        },
    );
    let refused = reason(answer)?;
    let differ = |it: &Inspection| !it.different.is_empty();
    let since_set_up = match inspection.as_ref().is_some_and(differ) {
        true => health::ask(link, patience)?.problems & Problem::CameraRegisters.bit() != 0,
        false => false,
    };
    Ok(match (inspection, refused) {
        (Some(inspection), None) => (judge(&inspection, since_set_up), Some(inspection)),
        (_, refused) => (silent(refused, complaints.pop()), None),
    })
}

fn silent(refused: Option<String>, complaint: Option<String>) -> Step {
    let mut wrong: Vec<_> = complaint.into_iter().collect();
    wrong.extend(refused);
    wrong.push(
        "push the ribbon fully home, contacts on the right side; see that it is the camera that \
         this firmware is for"
            .to_owned(),
    );
    let found = "it does not answer as it should".to_owned();
    Step::new("camera", found, wrong, Value::Null)
}

/// Judges an inspection. Registers that already differed at the camera's set-up are reported, but
/// not wrong.
pub fn judge(it: &Inspection, since_set_up: bool) -> Step {
    let different: Vec<_> = it.different.iter().map(different).collect();
    let (own, mut wrong) = match since_set_up {
        true => (different, Vec::new()),
        false => (Vec::new(), different),
    };
    if !wrong.is_empty() {
        wrong.push(
            "the camera lost what was written: its supply dips, or another part answers at its \
             address; reset the device, and look at the ribbon and the 3.3 V"
                .to_owned(),
        );
    }
    let part = f64::from(it.exposure_us) / f64::from(it.longest_exposure_us.max(1));
    if part > LONG_EXPOSURE && it.gain_sixteenths >= HIGH_GAIN {
        wrong.push("longest exposure and highest gain: more light, then `hivtac expose`".into());
    }
    let mut found = format!(
        "id {:04x}, silicon {}; {} of {} registers hold what was written; exposure {:.1} of \
         {:.1} ms, gain {:.1}",
        it.camera_id,
        revision(it.silicon),
        usize::from(it.registers).saturating_sub(it.different.len()),
        it.registers,
        f64::from(it.exposure_us) / 1e3,
        f64::from(it.longest_exposure_us) / 1e3,
        it.gain_sixteenths.to_f64(),
    );
    if !own.is_empty() {
        found += &format!(
            "; since its set-up {}: bits that this revision of the part keeps; used so",
            own.join(", ")
        );
    }
    Step::new("camera", found, wrong, json!(it))
}

fn different(register: &hivtac_wire::message::DifferentRegister) -> String {
    let (address, found, written) = (register.address, register.found, register.written);
    format!("register {address:02x} holds {found:02x}, {written:02x} was written")
}

/// The letter of an STM32H743 revision.
fn revision(silicon: u16) -> String {
    match silicon {
        0x2001 => "X".to_owned(),
        0x2003 => "V".to_owned(),
        other => format!("{other:04x}"),
    }
}
