//! Identifies the camera: the one that this firmware supports, or a different one, which is named.

use super::{Bus, IDENTITY};
use core::fmt;
use embassy_stm32::i2c;

/// How to identify a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Its name.
    pub name: &'static str,
    /// Its address on the bus, 7 bits.
    pub address: u8,
    /// Its identification number.
    pub number: u16,
    /// The registers of that number.
    pub told: Told,
    /// The cargo feature of the firmware that supports it.
    pub feature: &'static str,
}

/// The registers of a camera's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Told {
    /// Two registers of a byte, the high one first.
    InBytes([u8; 2]),
    /// One register of two bytes.
    InWord(u8),
}

/// OmniVision OV7725: product number and version.
pub const OV7725: Identity = Identity {
    name: "OV7725",
    address: 0x21,
    number: hivtac_portable::device::camera::ov7725::ID,
    told: Told::InBytes([0x0A, 0x0B]),
    feature: "board-weact",
};

/// onsemi (Aptina) MT9V034, mono: chip version. Its address with both address pins high, as on
/// OpenMV's module.
pub const MT9V034: Identity = Identity {
    name: "MT9V034",
    address: 0x5C,
    number: hivtac_portable::device::camera::mt9v034::ID,
    told: Told::InWord(0x00),
    feature: "board-openmv-h7",
};

/// Every camera that a firmware supports.
const KNOWN: [Identity; 2] = [OV7725, MT9V034];

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
    },
    /// A register does not hold the written value.
    Register {
        /// Its address.
        address: u8,
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
        let name = IDENTITY.name;
        match self {
            Error::Bus(error) => write!(f, "no {name} on I2C1 ({error}); check its cable"),
            Error::Other(other) => write!(
                f,
                "this is an {}, this firmware is for an {name}; flash that of {}",
                other.name, other.feature
            ),
            Error::WrongId { found } => {
                let [[a, b], [c, d]] = [*found, IDENTITY.number].map(u16::to_be_bytes);
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

/// Checks whether the camera is the one that this firmware supports.
///
/// # Errors
/// The camera or the fault that was found instead.
pub fn check(bus: &mut Bus) -> Result<(), Error> {
    let found = id(bus);
    if found == Ok(IDENTITY.number) {
        return Ok(());
    }
    let mut others = KNOWN.into_iter().filter(|other| *other != IDENTITY);
    // If the bus does not work at all, other cameras are not tried.
    let works = !matches!(found, Err(error) if error != i2c::Error::Nack);
    if works && let Some(other) = others.find(|other| other.ask(bus) == Ok(other.number)) {
        return Err(Error::Other(other));
    }
    Err(match found {
        Ok(found) => Error::WrongId { found },
        Err(error) => Error::Bus(error),
    })
}

/// Reads the identification number of the camera in use.
pub fn id(bus: &mut Bus) -> Result<u16, i2c::Error> {
    IDENTITY.ask(bus)
}

impl Identity {
    /// Reads the number at this camera's address.
    fn ask(&self, bus: &mut Bus) -> Result<u16, i2c::Error> {
        match self.told {
            Told::InBytes([high, low]) => Ok(u16::from_be_bytes([
                bus.read_byte(self.address, high)?,
                bus.read_byte(self.address, low)?,
            ])),
            Told::InWord(register) => bus.read_word(self.address, register),
        }
    }
}
