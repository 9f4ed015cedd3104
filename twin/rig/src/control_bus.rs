//! Faults of the camera's control bus: a device that holds a line, and a false bus error.
//!
//! While a line is held, I²C1 sees a busy bus and no transfer moves: [`HeldBus`] answers in its
//! place, and the pins are low. A camera that was interrupted in the middle of a byte releases SDA
//! after nine clocks, which only the pins as outputs can give.

use rigless::device::{Device, DeviceContext, Level, RegisterFile};
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::Stm32h743;
use rigless::soc::stm32h743::generated::gpioa::Register as Port;
use rigless::soc::stm32h743::generated::i2c1::Register;
use rigless::soc::stm32h743::peripherals::gpio::Pin;
use rigless::time::VirtualNanos;

use crate::faults::{Faults, Kind};

/// ISR bits.
const TRANSMIT_EMPTY: u64 = 1;
const BUS_ERROR: u64 = 1 << 8;
const BUSY: u64 = 1 << 15;
/// Clocks after which a device has sent the rest of an interrupted byte.
const CLOCKS: u32 = 9;
/// PB8 and PB9.
const PORT: usize = 1;
const CLOCK_PIN: u8 = 8;
const DATA_PIN: u8 = 9;

/// I²C1 on a bus that a device holds.
#[derive(Debug, Default)]
pub struct HeldBus;

impl Device for HeldBus {
    type Register = Register;

    fn read(
        &mut self,
        register: Register,
        _registers: &mut RegisterFile,
        _context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        (register == Register::Isr).then_some(BUSY | TRANSMIT_EMPTY)
    }
}

/// The bus's lines, and the clocks that they got.
#[derive(Debug)]
pub struct ControlBus {
    faults: Faults,
    wanted: bool,
    port: usize,
    i2c: usize,
    clocks: u32,
    clock: Level,
    held: [bool; 2],
    erred: bool,
}

impl ControlBus {
    /// Returns a bus with these faults, for the port and the interface in these slots.
    pub fn new(faults: Faults, port: usize, i2c: usize) -> Self {
        let kinds = [Kind::SdaStuck, Kind::SclStretch, Kind::BerrOnce];
        Self {
            wanted: kinds.into_iter().any(|kind| faults.asked_for(kind)),
            faults,
            port,
            i2c,
            clocks: 0,
            clock: Level::High,
            held: [false; 2],
            erred: false,
        }
    }

    /// Returns whether a slot is the interface's and a held line cuts it off from the bus.
    pub fn holds(&self, slot: usize) -> bool {
        slot == self.i2c && self.held.contains(&true)
    }

    /// Updates the lines, after every access.
    pub fn settle(&mut self, part: &mut Stm32h743, at: VirtualNanos) {
        if !self.wanted {
            return;
        }
        self.count_clocks(part);
        let stuck = self.faults.on(Kind::SdaStuck, at.0) && self.clocks < CLOCKS;
        let held = [self.faults.on(Kind::SclStretch, at.0), stuck];
        for (i, number) in [CLOCK_PIN, DATA_PIN].into_iter().enumerate() {
            if held[i] != self.held[i] {
                let level = held[i].then_some(Level::Low);
                part.drive_port(at, PORT, |port, registers, context| {
                    port.drive(pin(number), level, registers, context);
                });
            }
        }
        self.held = held;
        if self.faults.on(Kind::BerrOnce, at.0) && !self.erred {
            self.err(part);
        }
    }

    fn count_clocks(&mut self, part: &Stm32h743) {
        const OUTPUT: u64 = 1;
        let registers = part.bus().slots()[self.port].registers();
        if registers.get(Port::Moder) >> (2 * CLOCK_PIN) & 3 != OUTPUT {
            return;
        }
        let level = part.gpio[PORT].level(pin(CLOCK_PIN), registers);
        self.clocks += u32::from(self.clock == Level::Low && level == Level::High);
        self.clock = level;
    }

    /// Raises the bus error of errata ES0396: it is reported during a transfer, which goes on.
    fn err(&mut self, part: &mut Stm32h743) {
        let registers = part.bus_mut().slot_mut(self.i2c).registers_mut();
        let status = registers.get(Register::Isr);
        if status & BUSY != 0 {
            registers.set(Register::Isr, status | BUS_ERROR);
            self.erred = true;
        }
    }
}

fn pin(number: u8) -> Pin {
    Pin::new(number).expect("a port has sixteen pins")
}
