//! The MT9V034's side of its control bus: address 0x5C, registers of two bytes, high byte first,
//! with automatic increment.

use rigless::chip::Timeline;
use rigless::chip::i2c::Peer;
use rigless::snapshot::Store;

use super::SharedCamera;

/// The sensor's 7-bit address, with both of its address pins high.
const ADDRESS: u8 = 0x5C;

/// The meaning of the next byte of a transaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Expects {
    Register,
    High,
    Low(u8),
}

/// The sensor on the I²C bus.
#[derive(Debug)]
pub struct TwoWire {
    camera: SharedCamera,
    register: u8,
    expects: Expects,
}

impl TwoWire {
    /// Returns the bus side of a sensor.
    pub fn new(camera: SharedCamera) -> Self {
        Self {
            camera,
            register: 0,
            expects: Expects::Register,
        }
    }
}

// The rig takes no snapshots.
impl Store for TwoWire {}

impl Peer for TwoWire {
    fn start(&mut self, address: u8, read: bool, context: &mut Timeline<'_, '_>) -> bool {
        let answers = address == ADDRESS && self.camera.lock().answers(context.now().0);
        self.expects = if read {
            Expects::High
        } else {
            Expects::Register
        };
        answers
    }

    fn write(&mut self, byte: u8, _context: &mut Timeline<'_, '_>) -> bool {
        self.expects = match self.expects {
            Expects::Register => {
                self.register = byte;
                Expects::High
            }
            Expects::High => Expects::Low(byte),
            Expects::Low(high) => {
                let value = u16::from_be_bytes([high, byte]);
                (self.camera.lock()).write_register(self.register.into(), value);
                self.register = self.register.wrapping_add(1);
                Expects::High
            }
        };
        true
    }

    fn read(&mut self, _last: bool, context: &mut Timeline<'_, '_>) -> u8 {
        let value = (self.camera.lock()).read_register(self.register.into(), context.now().0);
        let [high, low] = value.to_be_bytes();
        if self.expects == Expects::High {
            self.expects = Expects::Low(high);
            return high;
        }
        self.expects = Expects::High;
        self.register = self.register.wrapping_add(1);
        low
    }

    fn stop(&mut self, _context: &mut Timeline<'_, '_>) {
        self.expects = Expects::Register;
    }
}
