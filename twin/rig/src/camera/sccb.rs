//! The sensor's side of SCCB: I2C in which the acknowledge has no meaning. One register per
//! transaction, no automatic increment. A register's address has one byte or two.

use rigless::chip::Timeline;
use rigless::chip::i2c::Peer;
use rigless::snapshot::Store;

use super::SharedCamera;

/// How a sensor is addressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Address {
    /// Its 7-bit address.
    pub device: u8,
    /// Its registers' addresses have two bytes, the high one first.
    pub is_wide: bool,
}

/// The OV7725's address.
pub const OV7725: Address = Address {
    device: 0x21,
    is_wide: false,
};
/// The OV5640's address.
pub const OV5640: Address = Address {
    device: 0x3C,
    is_wide: true,
};

/// The meaning of the next byte of a transaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Expects {
    HighOfRegister,
    Register,
    Value,
    Nothing,
}

/// The sensor on the I2C bus.
#[derive(Debug)]
pub struct Sccb {
    camera: SharedCamera,
    address: Address,
    register: u16,
    expects: Expects,
}

impl Sccb {
    /// Returns the bus side of a sensor.
    pub fn new(camera: SharedCamera, address: Address) -> Self {
        Self {
            camera,
            address,
            register: 0,
            expects: Expects::Nothing,
        }
    }
}

// The rig takes no snapshots.
impl Store for Sccb {}

impl Peer for Sccb {
    fn start(&mut self, address: u8, read: bool, context: &mut Timeline<'_, '_>) -> bool {
        let answers = address == self.address.device && self.camera.lock().answers(context.now().0);
        self.expects = match answers && !read {
            true if self.address.is_wide => Expects::HighOfRegister,
            true => Expects::Register,
            false => Expects::Nothing,
        };
        answers
    }

    fn write(&mut self, byte: u8, _context: &mut Timeline<'_, '_>) -> bool {
        match self.expects {
            Expects::HighOfRegister => {
                self.register = u16::from(byte) << 8;
                self.expects = Expects::Register;
            }
            Expects::Register => {
                self.register = self.register & 0xFF00 | u16::from(byte);
                self.expects = Expects::Value;
            }
            Expects::Value => {
                (self.camera.lock()).write_register(self.register, byte.into());
                self.expects = Expects::Nothing;
            }
            Expects::Nothing => return false,
        }
        true
    }

    fn read(&mut self, _last: bool, context: &mut Timeline<'_, '_>) -> u8 {
        (self.camera.lock()).read_register(self.register, context.now().0) as u8
    }

    fn stop(&mut self, _context: &mut Timeline<'_, '_>) {
        self.expects = Expects::Nothing;
    }
}
