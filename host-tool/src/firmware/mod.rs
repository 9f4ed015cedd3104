//! `hivtac update firmware`: checks an image, starts the device's own loader, writes the image by
//! it, and reports the new version.

mod carried;
mod dfuse;
#[cfg(test)]
mod simulated;
#[cfg(test)]
mod tests;
mod usb;
mod write;

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
use hivtac_wire::image::Image;
use hivtac_wire::message::{DeviceHello, Request};
use serde_json::json;
use std::time::{Duration, Instant};
use usb::Found;
use write::Progress;

/// An ELF has much more than the loaded bytes, such as its lines for a debugger.
const MOST_BYTES: u64 = 64 << 20;
/// Time between two searches for the device.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// Write new firmware over USB, read it back, and restart the device with it
///
/// What the device keeps stays. The file is checked first: for another board, cut, or damaged, it
/// is refused and the device goes on. After an interruption, also of the power, the device waits
/// in its loader: run the same command again.
///
/// Example: hivtac update firmware hivtac-firmware.bin
#[derive(Args)]
pub struct FirmwareArguments {
    #[command(flatten)]
    device: Device,
    /// The .bin of a release, or the ELF that cargo builds; by default the firmware that came with
    /// this program
    #[arg(value_name = "FILE")]
    file: Option<String>,
    /// Longest wait for the device's loader, and for the device to come back, s
    #[arg(long, value_name = "S", default_value = "30", value_parser = seconds)]
    wait: Duration,
    /// One JSON object instead of lines
    #[arg(long)]
    json: bool,
}

/// Checks the file, has the device start its loader, writes, and waits until the device is back.
///
/// # Errors
/// When the file is not an image for the device, which is checked before anything is sent; when
/// the device refuses; [`Kind::NoDevice`] when it or its loader does not appear; [`Kind::Lost`]
/// when it goes in the middle.
pub fn update(arguments: &FirmwareArguments) -> Result<(), Failure> {
    let FirmwareArguments {
        device,
        file,
        wait,
        json,
    } = arguments;
    let file = match file {
        Some(file) => file.clone(),
        None => carried::image(device)?,
    };
    let image = read(&file)?;
    let (found, address, before) = reach(arguments, &file, &image)?;
    note("the device is in its loader; keep it plugged in");
    let written = write::write(usb::open(&found)?, &image, say);
    written.inspect_err(|failure| {
        if failure.kind == Kind::Interrupted {
            note(&failure.to_string());
        }
    })?;
    let after = come_back(&address, device.timeout, before.as_ref(), *wait)?;
    report(*json, &image, before.as_ref(), &after)
}

/// The device's loader, the address at which the device comes back, and its hello if it could be
/// understood.
fn reach(
    arguments: &FirmwareArguments,
    file: &str,
    image: &Image,
) -> Result<(Found, Address, Option<DeviceHello>), Failure> {
    let device = &arguments.device;
    let connected = device.address().and_then(|address| {
        let connected = match Link::connect(&address, device.timeout) {
            Err(failure) if failure.kind == Kind::Version => None,
            connected => Some(connected?),
        };
        Ok((address, connected))
    });
    match connected {
        Ok((address, Some((link, hello)))) => {
            // A twin, for which no firmware is, refuses by itself.
            if !hello.board.starts_with("twin") {
                let fits = image.fits(&shown(&hello.board));
                fits.map_err(|refusal| Failure::of_file(file, refusal))?;
            }
            let found = into_loader(arguments, link)?;
            Ok((found, address, Some(hello)))
        }
        Ok((address, None)) => {
            note("the device speaks another version; its board is checked in its loader");
            let before = usb::loaders()?;
            Link::start_loader(&address, device.timeout)?;
            Ok((usb::appears(&before, arguments.wait)?, address, None))
        }
        Err(failure) if failure.kind == Kind::NoDevice => {
            Ok((waiting(failure)?, Address::Find, None))
        }
        Err(failure) => Err(failure),
    }
}

fn read(path: &str) -> Result<Image, Failure> {
    let bytes = read_at_most(path, MOST_BYTES).map_err(|error| Failure::of_file(path, error))?;
    let bytes = bytes.ok_or_else(|| {
        Failure::of_file(path, format!("no firmware: more than {MOST_BYTES} bytes"))
    })?;
    if bytes.starts_with(b"\x7fELF") {
        note("it is an ELF: the image is made from it");
    }
    Image::of_file(&bytes).map_err(|refusal| Failure::of_file(path, refusal))
}

/// Has the device start its loader; returns that.
fn into_loader(arguments: &FirmwareArguments, mut link: Link) -> Result<Found, Failure> {
    let before = usb::loaders()?;
    send(&mut link, Request::StartLoader, arguments.device.timeout)?;
    drop(link);
    usb::appears(&before, arguments.wait)
}

/// The only loader on the bus, where no device was found for this reason.
fn waiting(failure: Failure) -> Result<Found, Failure> {
    let mut loaders = usb::loaders()?;
    match (loaders.pop(), loaders.len()) {
        (Some(only), 0) => Ok(only),
        (None, _) => Err(failure),
        (Some(_), others) => {
            let message = format!(
                "{failure}; and {} devices wait in their loaders: leave one of them plugged in",
                others + 1
            );
            Err(Failure::new(Kind::NoDevice, message))
        }
    }
}

fn say(progress: Progress) {
    match progress {
        Progress::FirstStage => {
            note("it has no first stage, which is written now: do not cut its power for 3 s");
        }
        Progress::Written(bytes, all) => {
            note(&format!("{} of {} kB written", bytes / 1000, all / 1000));
        }
        Progress::ReadBack => note("read back, every byte right; restarting"),
    }
}

fn report(
    json: bool,
    image: &Image,
    before: Option<&DeviceHello>,
    after: &DeviceHello,
) -> Result<(), Failure> {
    let now = shown(&after.firmware);
    let was = before.map(|hello| shown(&hello.firmware));
    let reported = match &was {
        Some(was) => format!("firmware {now}, was {was}"),
        None => format!("firmware {now}"),
    };
    tell(json, &reported, &json!({ "firmware": now, "was": was }))?;
    match now.ends_with(&format!(" {}", image.version())) {
        true => Ok(()),
        false => {
            let message = format!(
                "the device says that it has firmware {now}, and the file is of {}; look with \
                 `hivtac info`, and try again",
                image.version()
            );
            Err(Failure::new(Kind::Refused, message))
        }
    }
}

/// Waits for the same device to come back; returns its hello. Any one, if it was in its loader
/// before.
fn come_back(
    address: &Address,
    patience: Duration,
    before: Option<&DeviceHello>,
    wait: Duration,
) -> Result<DeviceHello, Failure> {
    let end = Instant::now() + wait;
    let mut reported = false;
    let is_same = |hello: &DeviceHello| before.is_none_or(|it| it.device_id == hello.device_id);
    while Instant::now() < end {
        stop::check()?;
        std::thread::sleep(LOOK_EVERY);
        match Link::connect(address, patience) {
            Ok((_, hello)) if is_same(&hello) => return Ok(hello),
            Err(failure) if failure.kind == Kind::Version => return Err(failure),
            Err(failure) if failure.kind == Kind::Interrupted => return Err(failure),
            Ok(_) if !std::mem::replace(&mut reported, true) => {
                note("hivtac: another device is there; waiting for the one that was updated");
            }
            _ => {}
        }
    }
    let message = format!(
        "the firmware is written, and the device did not come back within {} s; unplug it for a \
         moment: `hivtac info` shows it when it is there",
        wait.as_secs_f32()
    );
    Err(Failure::new(Kind::NoDevice, message))
}
