//! `hivtac update firmware`: starts the device's own loader, and checks the firmware afterwards.

use crate::device::{Device, seconds};
use crate::output::{note, tell};
use crate::request::send;
use clap::Args;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::files::read_at_most;
use hivtac_host::link::Link;
use hivtac_host::port::Address;
use hivtac_host::shown::shown;
use hivtac_host::stop;
use hivtac_wire::message::{DeviceHello, Request};
use serde_json::json;
use std::ops::Range;
use std::time::{Duration, Instant};

/// The flash's first bank, which holds the program.
const FLASH: Range<u32> = 0x0800_0000..0x0810_0000;
/// Range of a valid initial stack pointer.
const DTCM: Range<u32> = 0x2000_0000..0x2002_0001;
/// Time between two searches for the device.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// Restart the device into its own loader (USB DFU), say how to send it firmware, and wait for
/// it to come back
///
/// Prints the `dfu-util` command to run meanwhile in another terminal, then the version before
/// and after. What the device keeps stays. When the loader was started by mistake, take the
/// device off its supply for a moment.
///
/// Example: hivtac update firmware hivtac-firmware.bin
#[derive(Args)]
pub struct FirmwareArguments {
    #[command(flatten)]
    device: Device,
    /// The program as it lies in flash: `arm-none-eabi-objcopy -O binary ELF FILE.bin`
    #[arg(value_name = "FILE.bin")]
    file: String,
    /// Longest wait for the device to come back, s
    #[arg(long, value_name = "S", default_value = "300", value_parser = seconds)]
    wait: Duration,
    /// JSON objects instead of lines: the command to run, then the version before and after
    #[arg(long)]
    json: bool,
}

/// Starts the loader, prints what to do, and waits until the device is back.
///
/// # Errors
/// When the file is not a program for the device, which is checked before anything is sent; when
/// the device refuses; [`Kind::NoDevice`] when it does not come back.
pub fn update(arguments: &FirmwareArguments) -> Result<(), Failure> {
    let FirmwareArguments {
        device,
        file,
        wait,
        json,
    } = arguments;
    let address = device.address()?;
    check(file)?;
    let (mut link, before) = Link::connect(&address, device.timeout)?;
    send(&mut link, Request::StartLoader, device.timeout)?;
    drop(link);
    let line = dfu_util(file);
    let told =
        format!("the device is in its loader; now run\n\n  {line}\n\nand it comes back by itself");
    tell(*json, &told, &json!({ "run": line }))?;
    let after = come_back(&address, device.timeout, &before, *wait)?;
    let [now, was] = [&after.firmware, &before.firmware];
    let told = format!("firmware {}, was {}", shown(now), shown(was));
    tell(
        *json,
        &told,
        &json!({ "firmware": now.as_str(), "was": was.as_str() }),
    )
}

/// The command that sends the file to the loader: to the start of the flash, then leaves the
/// loader.
fn dfu_util(path: &str) -> String {
    let path = path.replace('\'', "'\\''");
    format!("dfu-util -d 0483:df11 -a 0 -s 0x08000000:leave -D '{path}'")
}

fn check(path: &str) -> Result<(), Failure> {
    let wrong = |why: String| Failure::of_file(path, why);
    let most = u64::from(FLASH.end - FLASH.start);
    let bytes = read_at_most(path, most).map_err(|error| wrong(error.to_string()))?;
    let bytes =
        bytes.ok_or_else(|| wrong(format!("longer than the {most} bytes for a program")))?;
    program(&bytes).map_err(|why| wrong(why.to_owned()))
}

/// Checks that the bytes begin as a program does: with its initial stack pointer and its entry
/// point.
fn program(bytes: &[u8]) -> Result<(), &'static str> {
    if bytes.starts_with(b"\x7fELF") {
        return Err("an ELF; make a binary of it with `arm-none-eabi-objcopy -O binary`");
    }
    let word = |at: usize| {
        bytes
            .get(at..at + 4)?
            .try_into()
            .ok()
            .map(u32::from_le_bytes)
    };
    match (word(0), word(4)) {
        (Some(stack), Some(entry)) if DTCM.contains(&stack) && FLASH.contains(&entry) => Ok(()),
        _ => Err("no program for the sensor: it begins with neither its stack nor its entry"),
    }
}

/// Waits for the same device to come back; returns its hello.
fn come_back(
    address: &Address,
    patience: Duration,
    before: &DeviceHello,
    wait: Duration,
) -> Result<DeviceHello, Failure> {
    let end = Instant::now() + wait;
    let mut told = false;
    while Instant::now() < end {
        stop::check()?;
        std::thread::sleep(LOOK_EVERY);
        match Link::connect(address, patience) {
            Ok((_, hello)) if hello.device_id == before.device_id => return Ok(hello),
            Err(failure) if failure.kind == Kind::Version => return Err(failure),
            Err(failure) if failure.kind == Kind::Interrupted => return Err(failure),
            Ok(_) if !std::mem::replace(&mut told, true) => {
                note("hivtac: another device is there; waiting for the one that was updated");
            }
            _ => {}
        }
    }
    let message = format!(
        "the device did not come back within {} s; is `dfu-util` done? `hivtac info` shows it when \
         it is there; taken off its supply for a moment it starts what it has",
        wait.as_secs_f32()
    );
    Err(Failure::new(Kind::NoDevice, message))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_begins_with_its_stack_and_its_entry() {
        let of = |stack: u32, entry: u32| [stack.to_le_bytes(), entry.to_le_bytes()].concat();
        assert_eq!(program(&of(0x2000_6000, 0x0801_0101)), Ok(()));
        assert!(program(b"\x7fELF").unwrap_err().contains("objcopy"));
        for bad in [of(0, 0x0801_0101), of(0x2000_6000, 0x1234), vec![0; 3]] {
            assert!(program(&bad).unwrap_err().contains("no program"));
        }
    }

    #[test]
    fn the_command_can_be_pasted_into_a_shell() {
        assert_eq!(
            dfu_util("it's.bin"),
            "dfu-util -d 0483:df11 -a 0 -s 0x08000000:leave -D 'it'\\''s.bin'"
        );
    }
}
