//! The board's wiring: which pins carry the camera's power, clock and signals, and what USB needs.
//!
//! WeAct MiniSTM32H743 with an OV7725: XCLK from MCO1 on PA8, camera power on PA7 (low is on), SCCB on PB8 and PB9,
//! D0–D7 on PC6 PC7 PE0 PE1 PE4 PD3 PE5 PE6, VSYNC PB7, HSYNC PA4, PIXCLK PA6, USB on PA11 and PA12, 25 MHz crystal.

use rigless::device::{Level, RegisterFile};
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::Stm32h743;
use rigless::soc::stm32h743::generated::gpioa::Register as Port;
use rigless::soc::stm32h743::generated::{pwr, rcc};
use rigless::soc::stm32h743::peripherals::gpio::{Gpio, Pin};
use rigless::soc::stm32h743::peripherals::rcc::{HSI_HZ, HSI48_HZ, Pll, Tap};

use crate::camera::Supply;
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
}

impl Wiring {
    /// How the firmware has set the part up now.
    pub fn of(part: &Stm32h743) -> Wiring {
        let carries = |port: usize, number: u8, function: u8| {
            Gpio::function(pin(number), registers(part, port)) == Some(function)
        };
        let bit = |(i, &(port, number)): (usize, &(usize, u8))| {
            u8::from(carries(port, number, AF_DCMI)) << i
        };
        let clock_hz = if carries(A, 8, AF_MCO) {
            mco1_hz(part)
        } else {
            0
        };
        Wiring {
            supply: Supply {
                powered: camera_powered(part),
                clock_hz,
                sccb: carries(B, 8, AF_I2C1) && carries(B, 9, AF_I2C1),
            },
            pins: Pins {
                data: DATA.iter().enumerate().map(bit).sum(),
                clock: carries(A, 6, AF_DCMI),
                hsync: carries(A, 4, AF_DCMI),
                vsync: carries(B, 7, AF_DCMI),
            },
            hclk_hz: part.rcc.hclk(instance(part, "RCC")),
            usb: carries(A, 11, AF_USB) && carries(A, 12, AF_USB) && usb_supplied(part),
        }
    }
}

/// The switch pulls its gate up: it is on only while PA7 is driven low.
fn camera_powered(part: &Stm32h743) -> bool {
    const OUTPUT: u64 = 1;
    let port = registers(part, A);
    let driven = port.get(Port::Moder) >> 14 & 3 == OUTPUT;
    driven && part.gpio[A].level(pin(7), port) == Level::Low
}

/// PWR_CR3: USB33DEN, which the firmware sets once the 3.3 V are there.
fn usb_supplied(part: &Stm32h743) -> bool {
    instance(part, "PWR").get(pwr::Register::Cr3) >> 24 & 1 == 1
}

/// MCO1, RM0433 RCC_CFGR bits 24:22 (source) and 21:18 (divider, 0 is off).
fn mco1_hz(part: &Stm32h743) -> u64 {
    let registers = instance(part, "RCC");
    let (cfgr, cr) = (
        registers.get(rcc::Register::Cfgr),
        registers.get(rcc::Register::Cr),
    );
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

fn pin(number: u8) -> Pin {
    Pin::new(number).expect("a port has sixteen pins")
}

fn registers(part: &Stm32h743, port: usize) -> &RegisterFile {
    use rigless::soc::stm32h743::peripherals::gpio::PORTS;
    instance(part, PORTS[port])
}

fn instance<'a>(part: &'a Stm32h743, name: &str) -> &'a RegisterFile {
    part.bus().registers(name).expect("an instance of the part")
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigless::mcu::Operate;
    use rigless::soc::Width;
    use rigless::time::VirtualNanos;

    const RCC: u64 = 0x5802_4400;
    const PORT_A: u64 = 0x5802_0000;

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
        let wiring = Wiring::of(&part());
        assert_eq!(wiring.supply, Supply::default());
        assert_eq!(wiring.pins, Pins::default());
        assert!(!wiring.usb);
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
        let wiring = Wiring::of(&part);
        assert!(wiring.supply.powered && wiring.pins.clock && !wiring.pins.hsync);
        assert_eq!(wiring.supply.clock_hz, 64_000_000 / 3);
        write(&mut part, PORT_A + 0x18, 1 << 7);
        assert!(!Wiring::of(&part).supply.powered);
    }
}
