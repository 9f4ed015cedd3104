//! Identifies the camera: one that this firmware supports, or a different one, which is named.

use super::{Bus, Device, FITTING};
use core::fmt;
use embassy_stm32::i2c;

/// How to identify a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Its name.
    pub name: &'static str,
    /// Its address on the bus.
    pub device: Device,
    /// Its identification number.
    pub number: u16,
    /// The registers of that number.
    pub number_at: NumberAt,
    /// The cargo feature of the firmware that supports it.
    pub feature: &'static str,
}

/// The registers of a camera's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberAt {
    /// Two registers of a byte, the high one first.
    InBytes([u16; 2]),
    /// One register of two bytes.
    InWord(u16),
}

/// OmniVision OV7725: product number and version.
pub const OV7725: Identity = Identity {
    name: "OV7725",
    device: Device {
        address: 0x21,
        is_wide: false,
    },
    number: hivtac_portable::device::camera::ov7725::ID,
    number_at: NumberAt::InBytes([0x0A, 0x0B]),
    feature: "board-weact",
};

/// OmniVision OV5640: chip number. Variants with a focus motor have the same.
pub const OV5640: Identity = Identity {
    name: "OV5640",
    device: Device {
        address: 0x3C,
        is_wide: true,
    },
    number: hivtac_portable::device::camera::ov5640::ID,
    number_at: NumberAt::InBytes([0x300A, 0x300B]),
    feature: "board-weact",
};

/// onsemi (Aptina) MT9V034, mono: chip version. Its address with both address pins high, as on
/// OpenMV's module.
pub const MT9V034: Identity = Identity {
    name: "MT9V034",
    device: Device {
        address: 0x5C,
        is_wide: false,
    },
    number: hivtac_portable::device::camera::mt9v034::ID,
    number_at: NumberAt::InWord(0x00),
    feature: "board-openmv-h7",
};

/// Every camera that a firmware supports.
const KNOWN: [Identity; 3] = [OV7725, OV5640, MT9V034];

/// Why a camera cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// It does not acknowledge, or the bus does not work.
    Bus(i2c::Error),
    /// The camera is supported by a different firmware.
    Other(Identity),
    /// The part is not supported by any firmware.
    WrongId {
        /// Its number.
        found: u16,
        /// The camera whose address it has.
        at: Identity,
    },
    /// A register does not hold the written value.
    Register {
        /// Its address.
        address: u16,
        /// Its value.
        found: u16,
    },
}

impl From<i2c::Error> for Error {
    fn from(error: i2c::Error) -> Self {
        Error::Bus(error)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Error::Bus(error) => {
                let these = Names(" or ");
                write!(f, "no {these} on I2C1 ({error}); check its cable")
            }
            Error::Other(other) => {
                let (name, feature) = (other.name, other.feature);
                let these = Names(", ");
                write!(
                    f,
                    "this is an {name}; flash {feature}, as this is for: {these}"
                )
            }
            Error::WrongId { found, at } => {
                let [[a, b], [c, d]] = [*found, at.number].map(u16::to_be_bytes);
                let name = at.name;
                write!(
                    f,
                    "ID {a:02X} {b:02X}, an {name} has {c:02X} {d:02X}; fit that camera"
                )
            }
            Error::Register { address, found } => {
                write!(f, "register {address:02X} reads {found:02X} after a write")
            }
        }
    }
}

/// The names of the cameras that this firmware supports, with this text between them.
struct Names(&'static str);

impl fmt::Display for Names {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (i, identity) in FITTING.iter().enumerate() {
            let between = if i == 0 { "" } else { self.0 };
            write!(f, "{between}{}", identity.name)?;
        }
        Ok(())
    }
}

/// Finds out which of the cameras that this firmware supports is there: its index in [`FITTING`].
///
/// # Errors
/// The camera or the fault that was found instead.
pub fn find(bus: &mut Bus) -> Result<usize, Error> {
    let mut wrong = Error::Bus(i2c::Error::Nack);
    for (index, identity) in FITTING.iter().enumerate() {
        match identity.ask(bus) {
            Ok(found) if found == identity.number => return Ok(index),
            Ok(found) => {
                let at = *identity;
                wrong = Error::WrongId { found, at };
            }
            // Nothing has this address.
            Err(i2c::Error::Nack) => {}
            // The bus does not work at all; other cameras are not tried.
            Err(error) => return Err(Error::Bus(error)),
        }
    }
    let mut others = KNOWN
        .into_iter()
        .filter(|other| !FITTING.iter().any(|fitting| fitting == other));
    match others.find(|other| other.ask(bus) == Ok(other.number)) {
        Some(other) => Err(Error::Other(other)),
        None => Err(wrong),
    }
}

impl Identity {
    /// Reads the number at this camera's address.
    ///
    /// # Errors
    /// Nothing has that address, or the bus does not work.
    pub fn ask(&self, bus: &mut Bus) -> Result<u16, i2c::Error> {
        match self.number_at {
            NumberAt::InBytes([high, low]) => Ok(u16::from_be_bytes([
                bus.read_byte(self.device, high)?,
                bus.read_byte(self.device, low)?,
            ])),
            NumberAt::InWord(register) => bus.read_word(self.device, register),
        }
    }
}
