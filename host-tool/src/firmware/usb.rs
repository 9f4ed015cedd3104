//! The USB of a microcontroller's own loader: finds and opens it, and makes its control transfers.

use super::dfuse::{Loader, Trouble};
use dfu_core::functional_descriptor::FunctionalDescriptor;
use dfu_core::memory_layout::MemoryLayout;
use dfu_core::{DfuIo, DfuProtocol};
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::stop;
use nusb::descriptors::language_id::US_ENGLISH;
use nusb::transfer::{ControlIn, ControlOut, ControlType, Recipient, TransferError};
use nusb::{DeviceId, DeviceInfo, ErrorKind, Interface, MaybeFuture};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// ST's id of a loader in DFU mode, the same on each of its microcontrollers.
const LOADER: (u16, u16) = (0x0483, 0xDF11);
/// Begins the name of the memory that holds the program.
const FLASH_NAME: &str = "@Internal Flash";
/// Longest wait for one transfer: while a sector is erased the loader may not answer.
const TRANSFER: Duration = Duration::from_secs(5);
/// Time between two looks at the bus.
const LOOK_EVERY: Duration = Duration::from_millis(200);
/// Longest wait for the right to open a loader that just appeared: udev gives it.
const SETTLING: Duration = Duration::from_secs(2);

/// A loader on the bus.
pub struct Found {
    /// Distinguishes it from loaders that were there before.
    pub id: DeviceId,
    info: DeviceInfo,
}

/// All loaders on the bus.
///
/// # Errors
/// [`Kind::NoDevice`] if the bus cannot be listed.
pub fn loaders() -> Result<Vec<Found>, Failure> {
    // Some containers have no USB at all.
    if cfg!(target_os = "linux") && !std::path::Path::new("/sys/bus/usb/devices").exists() {
        return Ok(Vec::new());
    }
    let devices = nusb::list_devices().wait().map_err(|error| {
        Failure::new(
            Kind::NoDevice,
            format!("cannot list the devices on USB: {error}"),
        )
    })?;
    let loaders = devices.filter(|info| (info.vendor_id(), info.product_id()) == LOADER);
    Ok(loaders
        .map(|info| Found {
            id: info.id(),
            info,
        })
        .collect())
}

/// Waits for a loader that was not there before.
///
/// # Errors
/// [`Kind::NoDevice`] if none appears in time.
pub fn appears(before: &[Found], wait: Duration) -> Result<Found, Failure> {
    let end = Instant::now() + wait;
    loop {
        let is_new = |found: &Found| before.iter().all(|known| known.id != found.id);
        if let Some(found) = loaders()?.into_iter().find(is_new) {
            return Ok(found);
        }
        if Instant::now() >= end {
            let message = format!(
                "the device did not appear with its loader (USB id {:04x}:{:04x}) within {} s; \
                 plug it into this computer's USB, and run the same command again",
                LOADER.0,
                LOADER.1,
                wait.as_secs_f32()
            );
            return Err(Failure::new(Kind::NoDevice, message));
        }
        stop::check()?;
        sleep(LOOK_EVERY);
    }
}

/// Opens a loader.
///
/// # Errors
/// [`Kind::NoDevice`] if it cannot be opened; [`Kind::Refused`] if it is another chip's.
pub fn open(found: &Found) -> Result<Loader<UsbLoader>, Failure> {
    let end = Instant::now() + SETTLING;
    let usb = loop {
        match UsbLoader::open(&found.info) {
            Err(error) if is_early(&error) && Instant::now() < end => sleep(LOOK_EVERY),
            opened => break opened.map_err(|error| not_opened(&error))?,
        }
    };
    Loader::new(usb).map_err(|why| {
        let message = format!("the device with USB id 0483:df11 cannot be used: {why}");
        Failure::new(Kind::Refused, message)
    })
}

fn is_early(error: &nusb::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::PermissionDenied | ErrorKind::NotFound | ErrorKind::Busy
    )
}

fn not_opened(error: &nusb::Error) -> Failure {
    let what_to_do = match error.kind() {
        ErrorKind::PermissionDenied => {
            "this account may not use it: put docs/70-hivtac.rules into /etc/udev/rules.d, then \
             `sudo udevadm control --reload`, plug the device in anew"
        }
        ErrorKind::Busy => "another program has it open: end that one",
        _ if cfg!(windows) => {
            "Windows needs the driver WinUSB for it (docs/troubleshooting.md): install that"
        }
        _ => "plug the device in anew",
    };
    let message = format!(
        "the device is in its loader, which cannot be opened: {error}; {what_to_do}, and run the \
         same command again"
    );
    Failure::new(Kind::NoDevice, message)
}

/// A loader's interface, with its flash selected.
pub struct UsbLoader {
    interface: Interface,
    protocol: DfuProtocol<MemoryLayout>,
    descriptor: FunctionalDescriptor,
}

impl UsbLoader {
    fn open(info: &DeviceInfo) -> Result<Self, nusb::Error> {
        let device = info.open().wait()?;
        let interface = device.claim_interface(0).wait()?;
        let name = |index| {
            let text = device.get_string_descriptor(index, US_ENGLISH, TRANSFER);
            text.wait().ok()
        };
        let memories = interface.descriptors().filter_map(|memory| {
            let name = memory.string_index().and_then(name)?;
            Some((memory.alternate_setting(), name))
        });
        let flash = { memories }.find(|(_, name)| name.starts_with(FLASH_NAME));
        let extras = interface
            .descriptors()
            .flat_map(|memory| memory.descriptors());
        let descriptor = { extras }.find_map(|extra| FunctionalDescriptor::from_bytes(&extra));
        let descriptor = descriptor.and_then(Result::ok).unwrap_or(NO_LOADER);
        let (setting, name) = flash.unwrap_or_default();
        // `Loader::new` refuses other devices and other chips' loaders.
        let protocol = DfuProtocol::new(&name, descriptor.dfu_version);
        let protocol = protocol.unwrap_or(DfuProtocol::Dfu);
        interface.set_alt_setting(setting).wait()?;
        Ok(Self {
            interface,
            protocol,
            descriptor,
        })
    }
}

/// A device that says nothing of its abilities.
const NO_LOADER: FunctionalDescriptor = FunctionalDescriptor {
    can_download: false,
    can_upload: false,
    manifestation_tolerant: false,
    will_detach: false,
    detach_timeout: 0,
    transfer_size: 0,
    dfu_version: (0, 0),
};

impl DfuIo for UsbLoader {
    type Read = usize;
    type Write = usize;
    type Reset = ();
    type Error = Trouble;
    type MemoryLayout = MemoryLayout;

    fn read_control(
        &self,
        _request_type: u8,
        request: u8,
        value: u16,
        buffer: &mut [u8],
    ) -> Result<usize, Trouble> {
        let transfer = ControlIn {
            control_type: ControlType::Class,
            recipient: Recipient::Interface,
            request,
            value,
            index: self.interface.interface_number().into(),
            length: buffer.len().try_into().unwrap_or(u16::MAX),
        };
        let came = self.interface.control_in(transfer, TRANSFER).wait();
        let came = came.map_err(trouble)?;
        let count = came.len().min(buffer.len());
        buffer[..count].copy_from_slice(&came[..count]);
        Ok(count)
    }

    fn write_control(
        &self,
        _request_type: u8,
        request: u8,
        value: u16,
        buffer: &[u8],
    ) -> Result<usize, Trouble> {
        let transfer = ControlOut {
            control_type: ControlType::Class,
            recipient: Recipient::Interface,
            request,
            value,
            index: self.interface.interface_number().into(),
            data: buffer,
        };
        let sent = self.interface.control_out(transfer, TRANSFER).wait();
        sent.map(|()| buffer.len()).map_err(trouble)
    }

    /// Not needed: a loader that is left resets itself.
    fn usb_reset(self) -> Result<(), Trouble> {
        Ok(())
    }

    fn protocol(&self) -> &DfuProtocol<MemoryLayout> {
        &self.protocol
    }

    fn functional_descriptor(&self) -> &FunctionalDescriptor {
        &self.descriptor
    }
}

fn trouble(error: TransferError) -> Trouble {
    match error {
        TransferError::Cancelled => Trouble::Late,
        TransferError::Stall => Trouble::Refused("the request was not accepted".to_owned()),
        other => Trouble::Lost(other.to_string()),
    }
}
