//! The board's wiring: the pins that carry the camera's power, clock and signals, and USB's needs.
//!
//! On both boards: the camera's control bus on PB8 and PB9, D0–D4 on PC6 PC7 PE0 PE1 PE4, D6 and D7
//! on PE5 PE6, VSYNC PB7, HSYNC PA4, PIXCLK PA6, USB on PA11 and PA12, the UART for samples on
//! PB10.
//!
//! | | WeAct MiniSTM32H743 | OpenMV Cam H7 |
//! |---|---|---|
//! | XCLK | MCO1 on PA8 | TIM1's channel 1 on PA8 |
//! | camera's power-down (low is on) | PA7 | PD7 |
//! | camera's reset (low) | – | PA10 |
//! | D5 | PD3 | PB6 |
//! | LED | PE3, high is on | PC1, low is on |
//! | output | PE7 | PD12 |
//! | crystal | 25 MHz | 12 MHz |

use rigless::device::{Level, RegisterFile};
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::Stm32h743;
use rigless::soc::stm32h743::generated::gpioa::Register as Port;
use rigless::soc::stm32h743::generated::{pwr, rcc, tim1};
use rigless::soc::stm32h743::peripherals::gpio::{Gpio, PORTS, Pin};
use rigless::soc::stm32h743::peripherals::rcc::{HSI_HZ, HSI48_HZ, Pll, Tap, TimerBus};
use rigless::soc::{Bus, Error};

use crate::camera::{Supply, part};
use crate::peripherals::crs;
use crate::peripherals::dcmi::Pins;

/// Port numbers in the order of the part.
const A: usize = 0;
const B: usize = 1;
const C: usize = 2;
const D: usize = 3;
const E: usize = 4;
/// The port of VSYNC, PB7.
pub const VSYNC_PORT: usize = B;

/// Alternate functions.
const AF_MCO: u8 = 0;
const AF_TIM1: u8 = 1;
const AF_I2C1: u8 = 4;
const AF_USART3: u8 = 7;
const AF_USB: u8 = 10;
const AF_DCMI: u8 = 13;

/// A port and a pin's number.
type At = (usize, u8);

/// The boards that the rig can simulate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Kind {
    /// WeAct MiniSTM32H743 with its camera connector.
    #[default]
    Weact,
    /// OpenMV Cam H7.
    OpenmvH7,
}

impl Kind {
    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Weact => "weact-h743",
            Kind::OpenmvH7 => "openmv-h7",
        }
    }

    /// Returns its default camera.
    pub fn usual_camera(self) -> part::Kind {
        match self {
            Kind::Weact => part::Kind::Ov7725,
            Kind::OpenmvH7 => part::Kind::Mt9v034,
        }
    }

    /// Returns the frequency of the crystal on OSC_IN, Hz.
    pub fn crystal_hz(self) -> u64 {
        match self {
            Kind::Weact => 25_000_000,
            Kind::OpenmvH7 => 12_000_000,
        }
    }

    /// Returns the pins of D0 to D7.
    fn data(self) -> [At; 8] {
        let fifth = match self {
            Kind::Weact => (D, 3),
            Kind::OpenmvH7 => (B, 6),
        };
        [
            (C, 6),
            (C, 7),
            (E, 0),
            (E, 1),
            (E, 4),
            fifth,
            (E, 5),
            (E, 6),
        ]
    }

    /// Returns the pin of the camera's power-down; low is on.
    fn power_down(self) -> At {
        match self {
            Kind::Weact => (A, 7),
            Kind::OpenmvH7 => (D, 7),
        }
    }

    /// Returns the pin of the camera's reset, active low; `None` if the microcontroller has no such
    /// pin.
    fn camera_reset(self) -> Option<At> {
        match self {
            Kind::Weact => None,
            Kind::OpenmvH7 => Some((A, 10)),
        }
    }

    /// Returns the LED's pin, and its level while the LED is on.
    fn led(self) -> (At, Level) {
        match self {
            Kind::Weact => ((E, 3), Level::High),
            Kind::OpenmvH7 => ((C, 1), Level::Low),
        }
    }

    /// Returns the output pin.
    fn output(self) -> At {
        match self {
            Kind::Weact => (E, 7),
            Kind::OpenmvH7 => (D, 12),
        }
    }
}

/// The UART for samples, USART3, by its place in the part.
pub const UART: usize = 2;

/// Returns the pin of VSYNC, PB7.
pub fn vsync_pin() -> Pin {
    pin(7)
}

/// The supplies and signals that the microcontroller's pins and clocks give to camera and USB.
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
    /// USB's clock, Hz, with the error of its source; 0 without a clock.
    pub usb_hz: u64,
    /// The LED is on.
    pub led: bool,
    /// The output pin is high.
    pub output: bool,
    /// The UART for samples has its pin.
    pub uart: bool,
}

/// Slots of the registers that decide the wiring.
#[derive(Clone, Copy, Debug)]
pub struct Slots {
    board: Kind,
    ports: [usize; 5],
    rcc: usize,
    /// Slot of TIM1, which may be the camera's clock.
    pub tim1: usize,
    pwr: usize,
    crs: usize,
    /// Slot of the part's identity.
    pub dbgmcu: usize,
}

impl Slots {
    /// Finds the slots.
    ///
    /// # Errors
    /// If the part is not laid out as expected.
    pub fn of(bus: &Bus, board: Kind) -> Result<Self, Error> {
        let mut ports = [0; 5];
        for (slot, name) in ports.iter_mut().zip(PORTS) {
            *slot = bus.slot(name)?;
        }
        Ok(Self {
            board,
            ports,
            rcc: bus.slot("RCC")?,
            tim1: bus.slot("TIM1")?,
            pwr: bus.slot("PWR")?,
            crs: bus.slot("CRS")?,
            dbgmcu: bus.slot("DBGMCU")?,
        })
    }

    /// Returns the slot of VSYNC's port.
    pub fn vsync_port(&self) -> usize {
        self.ports[VSYNC_PORT]
    }

    /// Returns the wiring by the part's present registers.
    pub fn wiring(&self, part: &Stm32h743) -> Wiring {
        let carries = |port: usize, number: u8, function: u8| {
            Gpio::function(pin(number), self.port(part, port)) == Some(function)
        };
        let bit = |(i, &(port, number)): (usize, &(usize, u8))| {
            u8::from(carries(port, number, AF_DCMI)) << i
        };
        let clock_hz = match self.board {
            Kind::Weact if carries(A, 8, AF_MCO) => self.mco1_hz(part),
            Kind::OpenmvH7 if carries(A, 8, AF_TIM1) => self.tim1_hz(part),
            _ => 0,
        };
        let (led, on) = self.board.led();
        Wiring {
            supply: Supply {
                powered: self.driven(part, self.board.power_down()) == Some(Level::Low),
                clock_hz,
                sccb: carries(B, 8, AF_I2C1) && carries(B, 9, AF_I2C1),
                reset: (self.board.camera_reset())
                    .is_some_and(|pin| self.driven(part, pin) != Some(Level::High)),
            },
            pins: Pins {
                data: self.board.data().iter().enumerate().map(bit).sum(),
                clock: carries(A, 6, AF_DCMI),
                hsync: carries(A, 4, AF_DCMI),
                vsync: carries(B, 7, AF_DCMI),
            },
            hclk_hz: part.rcc.hclk(registers(part, self.rcc)),
            usb: carries(A, 11, AF_USB) && carries(A, 12, AF_USB) && self.usb_supplied(part),
            usb_hz: self.usb_hz(part),
            led: self.driven(part, led) == Some(on),
            output: self.driven(part, self.board.output()) == Some(Level::High),
            uart: carries(B, 10, AF_USART3),
        }
    }

    /// Returns the level to which a pin is driven; `None` if it is not driven. The board's pull-ups
    /// on the camera's lines do not count: firmware has to drive them.
    fn driven(&self, part: &Stm32h743, (port, number): At) -> Option<Level> {
        const OUTPUT: u64 = 1;
        let registers = self.port(part, port);
        let driven = registers.get(Port::Moder) >> (2 * number) & 3 == OUTPUT;
        driven.then(|| part.gpio[port].level(pin(number), registers))
    }

    fn port<'a>(&self, part: &'a Stm32h743, port: usize) -> &'a RegisterFile {
        registers(part, self.ports[port])
    }

    /// Returns PWR_CR3.USB33DEN, which the firmware sets once the 3.3 V are there.
    fn usb_supplied(&self, part: &Stm32h743) -> bool {
        registers(part, self.pwr).get(pwr::Register::Cr3) >> 24 & 1 == 1
    }

    /// Returns USB's clock, Hz, by RM0433 RCC_D2CCIP2R bits 21:20: none, PLL1, PLL3, or the
    /// internal oscillator. The oscillator has its error until it is trimmed.
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

    /// Returns MCO1's frequency, Hz: RM0433 RCC_CFGR bits 24:22 (source) and 21:18 (divider, 0 is
    /// off).
    fn mco1_hz(&self, part: &Stm32h743) -> u64 {
        let registers = registers(part, self.rcc);
        let cfgr = registers.get(rcc::Register::Cfgr);
        let cr = registers.get(rcc::Register::Cr);
        let running = |ready_bit: u32, hz: u64| if cr >> ready_bit & 1 == 1 { hz } else { 0 };
        let source = match cfgr >> 22 & 7 {
            0 => running(2, HSI_HZ >> (cr >> 3 & 3)),
            2 => running(17, self.board.crystal_hz()),
            3 => running(25, part.rcc.pll_output(registers, Pll::One, Tap::Q)),
            4 => running(13, HSI48_HZ),
            _ => 0,
        };
        source.checked_div(cfgr >> 18 & 15).unwrap_or(0)
    }

    /// Returns the frequency of TIM1's channel 1 as a clock, Hz (RM0433, chapter 38). It needs PWM
    /// mode 1 or 2, its output and the main one enabled, and a high level in a part of the period.
    fn tim1_hz(&self, part: &Stm32h743) -> u64 {
        use tim1::Register as Timer;
        let timer = registers(part, self.tim1);
        let bit = |register, bit: u32| timer.get(register) >> bit & 1 == 1;
        let mode = timer.get(Timer::Ccmr1Output) >> 4 & 7;
        let (period, high) = (timer.get(Timer::Arr) + 1, timer.get(Timer::Ccr1));
        let enabled = bit(Timer::Cr1, 0) && bit(Timer::Ccer, 0) && bit(Timer::Bdtr, 15);
        let counts_up = timer.get(Timer::Cr1) >> 5 & 3 == 0;
        if !enabled || !counts_up || !matches!(mode, 6 | 7) || !(1..period).contains(&high) {
            return 0;
        }
        let kernel = (part.rcc).timer_clock(registers(part, self.rcc), TimerBus::Apb2);
        kernel / (timer.get(Timer::Psc) + 1) / period
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
        Slots::of(part.bus(), Kind::Weact).unwrap().wiring(part)
    }

    fn write(part: &mut Stm32h743, address: u64, value: u64) {
        part.write(VirtualNanos(0), address, Width::W32, value)
            .unwrap();
    }

    fn part() -> Stm32h743 {
        let mut part = Stm32h743::new().unwrap();
        part.rcc.attach_crystals(Kind::Weact.crystal_hz(), 0);
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
