//! The board's wiring: which pins carry the camera's power, clock and signals, and what USB needs.
//!
//! WeAct MiniSTM32H743 with an OV7725: XCLK from MCO1 on PA8, camera power on PA7 (low is on), SCCB
//! on PB8 and PB9, D0–D7 on PC6 PC7 PE0 PE1 PE4 PD3 PE5 PE6, VSYNC PB7, HSYNC PA4, PIXCLK PA6, USB
//! on PA11 and PA12, 25 MHz crystal.

use rigless::device::{Level, RegisterFile};
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::Stm32h743;
use rigless::soc::stm32h743::generated::gpioa::Register as Port;
use rigless::soc::stm32h743::generated::{pwr, rcc};
use rigless::soc::stm32h743::peripherals::gpio::{Gpio, PORTS, Pin};
use rigless::soc::stm32h743::peripherals::rcc::{HSI_HZ, HSI48_HZ, Pll, Tap};
use rigless::soc::{Bus, Error};

use crate::camera::Supply;
use crate::crs;
use crate::dcmi::Pins;

/// The crystal on OSC_IN, Hz.
pub const CRYSTAL_HZ: u64 = 25_000_000;

/// Port numbers as the part counts them.
const A: usize = 0;
const B: usize = 1;
const C: usize = 2;
const D: usize = 3;
const E: usize = 4;
/// The port of VSYNC, PB7.
pub const VSYNC_PORT: usize = B;

/// Alternate functions.
const AF_MCO: u8 = 0;
const AF_I2C1: u8 = 4;
const AF_USB: u8 = 10;
const AF_DCMI: u8 = 13;

/// D0 to D7.
const DATA: [(usize, u8); 8] = [
    (C, 6),
    (C, 7),
    (E, 0),
    (E, 1),
    (E, 4),
    (D, 3),
    (E, 5),
    (E, 6),
];

/// The pin of VSYNC, PB7.
pub fn vsync_pin() -> Pin {
    pin(7)
}

/// What the microcontroller's pins and clocks give the camera and USB.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wiring {
    /// The camera's power, clock and control lines.
    pub supply: Supply,
    /// The camera's signals.
    pub pins: Pins,
    /// The bus clock, Hz.
    pub hclk_hz: u64,
    /// The USB transceiver has its 3.3 V and the pins.
    pub usb: bool,
    /// USB's clock, Hz, with the error of what makes it; 0 without one.
    pub usb_hz: u64,
    /// The LED is on.
    pub led: bool,
}

/// Where the part keeps the registers that decide the wiring.
#[derive(Clone, Copy, Debug)]
pub struct Slots {
    ports: [usize; 5],
    rcc: usize,
    pwr: usize,
    crs: usize,
    /// Of the identity.
    pub dbgmcu: usize,
}

impl Slots {
    /// Finds them.
    ///
    /// # Errors
    /// When the part is not laid out as expected.
    pub fn of(bus: &Bus) -> Result<Self, Error> {
        let mut ports = [0; 5];
        for (slot, name) in ports.iter_mut().zip(PORTS) {
            *slot = bus.slot(name)?;
        }
        Ok(Self {
            ports,
            rcc: bus.slot("RCC")?,
            pwr: bus.slot("PWR")?,
            crs: bus.slot("CRS")?,
            dbgmcu: bus.slot("DBGMCU")?,
        })
    }

    /// The port of VSYNC.
    pub fn vsync_port(&self) -> usize {
        self.ports[VSYNC_PORT]
    }

    /// How the firmware has set the part up now.
    pub fn wiring(&self, part: &Stm32h743) -> Wiring {
        let carries = |port: usize, number: u8, function: u8| {
            Gpio::function(pin(number), self.port(part, port)) == Some(function)
        };
        let bit = |(i, &(port, number)): (usize, &(usize, u8))| {
            u8::from(carries(port, number, AF_DCMI)) << i
        };
        let clock_hz = if carries(A, 8, AF_MCO) {
            self.mco1_hz(part)
        } else {
            0
        };
        Wiring {
            supply: Supply {
                powered: self.camera_powered(part),
                clock_hz,
                sccb: carries(B, 8, AF_I2C1) && carries(B, 9, AF_I2C1),
            },
            pins: Pins {
                data: DATA.iter().enumerate().map(bit).sum(),
                clock: carries(A, 6, AF_DCMI),
                hsync: carries(A, 4, AF_DCMI),
                vsync: carries(B, 7, AF_DCMI),
            },
            hclk_hz: part.rcc.hclk(registers(part, self.rcc)),
            usb: carries(A, 11, AF_USB) && carries(A, 12, AF_USB) && self.usb_supplied(part),
            usb_hz: self.usb_hz(part),
            led: self.led(part),
        }
    }

    /// PE3, driven high.
    fn led(&self, part: &Stm32h743) -> bool {
        const OUTPUT: u64 = 1;
        let port = self.port(part, E);
        port.get(Port::Moder) >> 6 & 3 == OUTPUT && part.gpio[E].level(pin(3), port) == Level::High
    }

    fn port<'a>(&self, part: &'a Stm32h743, port: usize) -> &'a RegisterFile {
        registers(part, self.ports[port])
    }

    /// PA7 high is power-down; the rig has the camera run only while PA7 is driven low, though the
    /// board pulls it down.
    fn camera_powered(&self, part: &Stm32h743) -> bool {
        const OUTPUT: u64 = 1;
        let port = self.port(part, A);
        let driven = port.get(Port::Moder) >> 14 & 3 == OUTPUT;
        driven && part.gpio[A].level(pin(7), port) == Level::Low
    }

    /// PWR_CR3: USB33DEN, which the firmware sets once the 3.3 V are there.
    fn usb_supplied(&self, part: &Stm32h743) -> bool {
        registers(part, self.pwr).get(pwr::Register::Cr3) >> 24 & 1 == 1
    }

    /// RM0433 RCC_D2CCIP2R bits 21:20: nothing, PLL1, PLL3, or the internal oscillator, which is
    /// off by its error until it is trimmed.
    fn usb_hz(&self, part: &Stm32h743) -> u64 {
        let registers = registers(part, self.rcc);
        let pll = |pll| part.rcc.pll_output(registers, pll, Tap::Q);
        match registers.get(rcc::Register::D2ccip2r) >> 20 & 3 {
            1 => pll(Pll::One),
            2 => pll(Pll::Three),
            3 if registers.get(rcc::Register::Cr) >> 13 & 1 == 0 => 0,
            3 if crs::trims(self::registers(part, self.crs)) => HSI48_HZ,
            3 => crs::HSI48_UNTRIMMED_HZ,
            _ => 0,
        }
    }

    /// MCO1, RM0433 RCC_CFGR bits 24:22 (source) and 21:18 (divider, 0 is off).
    fn mco1_hz(&self, part: &Stm32h743) -> u64 {
        let registers = registers(part, self.rcc);
        let cfgr = registers.get(rcc::Register::Cfgr);
        let cr = registers.get(rcc::Register::Cr);
        let running = |ready_bit: u32, hz: u64| if cr >> ready_bit & 1 == 1 { hz } else { 0 };
        let source = match cfgr >> 22 & 7 {
            0 => running(2, HSI_HZ >> (cr >> 3 & 3)),
            2 => running(17, CRYSTAL_HZ),
            3 => running(25, part.rcc.pll_output(registers, Pll::One, Tap::Q)),
            4 => running(13, HSI48_HZ),
            _ => 0,
        };
        source.checked_div(cfgr >> 18 & 15).unwrap_or(0)
    }
}

fn pin(number: u8) -> Pin {
    Pin::new(number).expect("a port has sixteen pins")
}

fn registers(part: &Stm32h743, slot: usize) -> &RegisterFile {
    part.bus().slots()[slot].registers()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigless::mcu::Operate;
    use rigless::soc::Width;
    use rigless::time::VirtualNanos;

    const RCC: u64 = 0x5802_4400;
    const PORT_A: u64 = 0x5802_0000;

    fn wiring(part: &Stm32h743) -> Wiring {
        Slots::of(part.bus()).unwrap().wiring(part)
    }

    fn write(part: &mut Stm32h743, address: u64, value: u64) {
        part.write(VirtualNanos(0), address, Width::W32, value)
            .unwrap();
    }

    fn part() -> Stm32h743 {
        let mut part = Stm32h743::new().unwrap();
        part.rcc.attach_crystals(CRYSTAL_HZ, 0);
        part
    }

    #[test]
    fn out_of_reset_nothing_reaches_the_camera_or_usb() {
        let set_up = wiring(&part());
        assert_eq!(set_up.supply, Supply::default());
        assert_eq!(set_up.pins, Pins::default());
        assert!(!set_up.usb);
    }

    #[test]
    fn power_clock_and_pins_follow_the_registers() {
        let mut part = part();
        write(&mut part, RCC + 0xE0, 0x1F);
        part.advance_to(VirtualNanos(10_000_000));
        write(&mut part, RCC + 0x10, 3 << 18);
        write(
            &mut part,
            PORT_A,
            0xABFF_FFFF & !(3 << 16) & !(3 << 14) & !(3 << 12) | 2 << 16 | 1 << 14 | 2 << 12,
        );
        write(&mut part, PORT_A + 0x20, 13 << 24);
        let set_up = wiring(&part);
        assert!(set_up.supply.powered && set_up.pins.clock && !set_up.pins.hsync);
        assert_eq!(set_up.supply.clock_hz, 64_000_000 / 3);
        write(&mut part, PORT_A + 0x18, 1 << 7);
        assert!(!wiring(&part).supply.powered);
    }
}
