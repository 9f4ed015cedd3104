//! Defines the parts that all boards have: an STM32H743 with a camera on DCMI and I²C1, a crystal,
//! USB and an LED.

use crate::band_copy::BandCopy;
use crate::camera::{BUS_CLOCK, Camera};
use crate::capture::Capture;
use crate::flash::SecondBank;
use crate::priorities;
use crate::seeded_bugs;
use crate::snapshot_copy::SnapshotCopy;
use crate::thermometer::Thermometer;
use embassy_stm32::gpio::{AfType, AnyPin, Flex, Level, Output, Pull, Speed};
use embassy_stm32::i2c;
use embassy_stm32::rcc::*;
use embassy_stm32::time::Hertz;
use embassy_stm32::{Peri, peripherals};
use embassy_time::Duration;

/// DCMI's alternate function on each of its pins.
const DCMI_FUNCTION: u8 = 13;
/// The board's parts, set up and idle.
pub struct Board {
    /// The camera's control side; its clock runs.
    pub camera: Camera,
    /// The camera's data side.
    pub capture: Capture,
    /// The source of the pipeline's rows.
    pub bands: BandCopy,
    /// The flash that keeps the settings.
    pub flash: SecondBank,
    /// The copier that keeps a frame for the host.
    pub snapshots: SnapshotCopy,
    /// The microcontroller's temperature.
    pub thermometer: Thermometer,
    /// The parts that the USB task needs for its driver.
    pub usb: UsbPort,
    /// The parts that the UART's task needs for its driver.
    pub uart: UartPort,
    /// The status LED, off.
    pub led: StatusLed,
}

/// USB full speed on the OTG_FS core.
pub struct UsbPort {
    /// The core.
    pub core: Peri<'static, peripherals::USB_OTG_FS>,
    /// D+.
    pub plus: Peri<'static, peripherals::PA12>,
    /// D−.
    pub minus: Peri<'static, peripherals::PA11>,
}

/// The UART for samples.
pub struct UartPort {
    /// The UART.
    pub usart: Peri<'static, peripherals::USART3>,
    /// Its output.
    pub pin: Peri<'static, peripherals::PB10>,
    /// The stream that writes its data register.
    pub dma: Peri<'static, peripherals::DMA2_CH0>,
}

/// The status LED.
pub struct StatusLed {
    /// Its pin.
    pub pin: Output<'static>,
    /// The level at which it is on.
    pub on: Level,
}

impl StatusLed {
    /// Turns it on or off.
    pub fn set(&mut self, on: bool) {
        let high = (self.on == Level::High) == on;
        self.pin.set_level(high.into());
    }
}

/// The clocks from a crystal of `crystal_hz`, divided such that PLL1 reaches 960 MHz with `mul`.
/// Half of that is for the core, 240 MHz for the buses, 120 MHz for the peripherals.
pub fn clocks(crystal_hz: u32, prediv: PllPreDiv, mul: PllMul) -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(Hse {
        freq: Hertz(crystal_hz),
        mode: HseMode::Oscillator,
    });
    config.rcc.pll1 = Some(Pll {
        source: PllSource::HSE,
        prediv,
        mul,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: (!seeded_bugs::usb_from_hsi48()).then_some(PllDiv::DIV20),
        divr: None,
    });
    // Nothing uses the real-time clock. From the internal 32 kHz oscillator it would let that one
    // run fast after a quick replug, and the watchdog with it (errata ES0396, 2.2.19).
    config.rcc.ls = LsConfig::off();
    // 480 MHz needs the highest core voltage.
    config.rcc.voltage_scale = VoltageScale::Scale0;
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.d1c_pre = AHBPrescaler::DIV1;
    config.rcc.ahb_pre = AHBPrescaler::DIV2;
    config.rcc.apb1_pre = APBPrescaler::DIV2;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.rcc.apb3_pre = APBPrescaler::DIV2;
    config.rcc.apb4_pre = APBPrescaler::DIV2;
    clock_usb(&mut config.rcc);
    config.dma_interrupt_priority = priorities::DMA;
    config
}

/// USB runs from the crystal, too: 960 MHz / 20 = 48 MHz. The internal 48 MHz oscillator is off by
/// more than the 0.25 % that full speed allows until it is trimmed to the host's packets. The HAL
/// trims it to those of the other USB core, OTG_HS, and its source is write-protected from then on
/// (RM0433, CRS_CFGR).
fn clock_usb(rcc: &mut Config) {
    rcc.mux.usbsel = mux::Usbsel::PLL1_Q;
    if seeded_bugs::usb_from_hsi48() {
        rcc.hsi48 = Some(Hsi48Config {
            sync_from_usb: true,
        });
        rcc.mux.usbsel = mux::Usbsel::HSI48;
    }
}

/// Connects the pins to DCMI permanently.
pub fn connect_camera(pins: [Peri<'static, AnyPin>; 11]) {
    for pin in pins {
        let mut pin = Flex::new(pin);
        // Pulled down: without a camera, an open VSYNC pin must not cause interrupts.
        pin.set_as_af_unchecked(DCMI_FUNCTION, AfType::input(Pull::Down));
        // Dropping it would disconnect the pin.
        core::mem::forget(pin);
    }
}

/// Makes a pin an output permanently, low at first.
pub fn drive_low(pin: Peri<'static, AnyPin>) {
    // Dropping it would disconnect the pin.
    core::mem::forget(Output::new(pin, Level::Low, Speed::Low));
}

/// The configuration of the camera's control bus.
pub fn bus_config() -> i2c::Config {
    let mut config = i2c::Config::default();
    config.frequency = BUS_CLOCK;
    config.sda_pullup = true;
    config.scl_pullup = true;
    // A byte takes 90 µs. A hanging bus must not delay tasks of lower priority for long.
    config.timeout = Duration::from_millis(5);
    config
}
