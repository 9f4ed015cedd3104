//! The sensor's side of SCCB: I2C in which the acknowledge has no meaning. Address 0x21, one
//! register per transaction, no automatic increment.

use rigless::chip::Timeline;
use rigless::chip::i2c::Peer;
use rigless::snapshot::Store;

use super::SharedCamera;

/// The sensor's 7-bit address.
const ADDRESS: u8 = 0x21;

/// The meaning of the next byte of a transaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Expects {
    Register,
    Value,
    Nothing,
}

/// The sensor on the I2C bus.
#[derive(Debug)]
pub struct Sccb {
    camera: SharedCamera,
    register: u8,
    expects: Expects,
}

impl Sccb {
    /// Returns the bus side of a sensor.
    pub fn new(camera: SharedCamera) -> Self {
        Self {
            camera,
            register: 0,
            expects: Expects::Nothing,
        }
    }
}

// The rig takes no snapshots.
impl Store for Sccb {}

impl Peer for Sccb {
    fn start(&mut self, address: u8, read: bool, context: &mut Timeline<'_, '_>) -> bool {
        let answers = address == ADDRESS && self.camera.lock().answers(context.now().0);
        self.expects = if answers && !read {
            Expects::Register
        } else {
            Expects::Nothing
        };
        answers
    }

    fn write(&mut self, byte: u8, _context: &mut Timeline<'_, '_>) -> bool {
        match self.expects {
            Expects::Register => {
                self.register = byte;
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
