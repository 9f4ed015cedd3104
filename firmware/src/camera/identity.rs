//! Which camera answers: the one that this firmware is for, or another one, which is named.

use super::{Bus, IDENTITY};
use core::fmt;
use embassy_stm32::i2c;

/// How a camera tells what it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Its name.
    pub name: &'static str,
    /// On the bus, 7 bits.
    pub address: u8,
    /// What it says.
    pub number: u16,
    /// Where it says so.
    pub told: Told,
    /// The cargo feature of the firmware that is for it.
    pub feature: &'static str,
}

/// Where a camera's number is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Told {
    /// In two registers of a byte, the high one first.
    InBytes([u8; 2]),
    /// In a register of two bytes.
    InWord(u8),
}

/// OmniVision OV7725: product number and version.
pub const OV7725: Identity = Identity {
    name: "OV7725",
    address: 0x21,
    number: 0x7721,
    told: Told::InBytes([0x0A, 0x0B]),
    feature: "board-weact",
};

/// onsemi (Aptina) MT9V034, mono: chip version. Its address with both address pins high, as on
/// OpenMV's module.
pub const MT9V034: Identity = Identity {
    name: "MT9V034",
    address: 0x5C,
    number: 0x1324,
    told: Told::InWord(0x00),
    feature: "board-openmv-h7",
};

/// Every camera that some firmware is for.
const KNOWN: [Identity; 2] = [OV7725, MT9V034];

/// Why a camera cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// It does not acknowledge, or the bus does not work.
    Bus(i2c::Error),
    /// A camera answers that other firmware is for.
    Other(Identity),
    /// A part answers that no firmware is for.
    WrongId {
        /// Its number.
        found: u16,
    },
    /// A register does not hold what was written.
    Register {
        /// Its address.
        address: u8,
        /// What it holds.
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

/// Checks that the camera is the one that this firmware is for.
///
/// # Errors
/// What is there instead, as far as it can be told.
pub fn check(bus: &mut Bus) -> Result<(), Error> {
    let found = id(bus);
    if found == Ok(IDENTITY.number) {
        return Ok(());
    }
    let mut others = KNOWN.into_iter().filter(|other| *other != IDENTITY);
    // A bus that does not work at all is not asked for everyone.
    let works = !matches!(found, Err(error) if error != i2c::Error::Nack);
    if works && let Some(other) = others.find(|other| other.ask(bus) == Ok(other.number)) {
        return Err(Error::Other(other));
    }
    Err(match found {
        Ok(found) => Error::WrongId { found },
        Err(error) => Error::Bus(error),
    })
}

/// The number by which the camera in use says what it is.
pub fn id(bus: &mut Bus) -> Result<u16, i2c::Error> {
    IDENTITY.ask(bus)
}

impl Identity {
    /// What answers at its address.
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
