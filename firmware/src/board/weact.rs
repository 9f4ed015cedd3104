//! WeAct MiniSTM32H743VIT6 with its camera connector.
//!
//! | what | pins |
//! |---|---|
//! | camera data D0–D7 | PC6 PC7 PE0 PE1 PE4 PD3 PE5 PE6 |
//! | VSYNC, HSYNC (HREF), PIXCLK | PB7, PA4, PA6 |
//! | XCLK | PA8 (MCO1) |
//! | SCCB clock, data | PB8, PB9 (I2C1) |
//! | camera power-down | PA7, high = standby: the camera's supplies stay on, and its registers keep their values |
//! | USB D−, D+ | PA11, PA12 |
//! | LED | PE3, high = on |
//! | crystal | 25 MHz |

use super::free_bus::{self, Lines};
use super::silicon::{self, Led};
use crate::band_copy::BandCopy;
use crate::band_dma::BandDma;
use crate::camera::{Camera, Sccb};
use crate::capture::Capture;
use crate::{priorities, seeded_bugs};
use embassy_stm32::gpio::{AfType, AnyPin, Flex, Level, Output, Pull, Speed};
use embassy_stm32::i2c::{self, I2c};
use embassy_stm32::rcc::*;
use embassy_stm32::time::Hertz;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, pac, peripherals};
use embassy_time::Duration;

/// Name in the device's hello.
pub const NAME: &str = "weact-h743";
/// The camera's clock: the crystal halved.
pub const XCLK_HZ: u32 = HSE_HZ / 2;

/// Of the camera's control bus. The pins' own pull-ups help those on the board, 4.7 kΩ.
pub const SCCB_CLOCK: Hertz = Hertz::khz(100);

const HSE_HZ: u32 = 25_000_000;
/// DCMI's alternate function on each of its pins.
const DCMI_FUNCTION: u8 = 13;
/// The watchdog resets a program whose thread mode stood still for so long.
const WATCHDOG: Duration = Duration::from_secs(2);

/// The board's parts, set up and idle.
pub struct Board {
    /// The camera's control side; its clock runs.
    pub camera: Camera,
    /// The camera's data side.
    pub capture: Capture,
    /// Where the pipeline gets its rows from.
    pub bands: BandCopy,
    /// What the USB task needs to make its driver.
    pub usb: UsbPort,
    /// The status LED, off.
    pub led: Output<'static>,
    /// Not yet started.
    pub watchdog: IndependentWatchdog<'static, peripherals::IWDG1>,
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

impl Board {
    /// Starts the clocks and sets up every pin. Call once. On silicon that is too old it does not
    /// return.
    pub fn start() -> Board {
        silicon::refuse_old(&Led {
            port: pac::GPIOE,
            pin: 3,
        });
        let p = embassy_stm32::init(clocks());
        start_camera_clock(p.MCO1, p.PA8);
        connect_camera([
            p.PC6.into(),
            p.PC7.into(),
            p.PE0.into(),
            p.PE1.into(),
            p.PE4.into(),
            p.PD3.into(),
            p.PE5.into(),
            p.PE6.into(),
            p.PB7.into(),
            p.PA4.into(),
            p.PA6.into(),
        ]);
        let sccb = I2c::new_blocking(p.I2C1, p.PB8, p.PB9, sccb_config());
        let power_down = Output::new(p.PA7, Level::High, Speed::Low);
        Board {
            camera: Camera::new(Sccb::new(sccb), power_down),
            capture: Capture::new(p.DCMI, BandDma::new(p.DMA1_CH0), priorities::CAPTURE),
            bands: BandCopy::new(p.MDMA_CH0),
            usb: UsbPort {
                core: p.USB_OTG_FS,
                plus: p.PA12,
                minus: p.PA11,
            },
            led: Output::new(p.PE3, Level::Low, Speed::Low),
            watchdog: IndependentWatchdog::new(p.IWDG1, WATCHDOG.as_micros() as u32),
        }
    }
}

/// 25 MHz crystal / 5 · 192 / 2 = 480 MHz for the core, 240 MHz for the buses, 120 MHz for the
/// peripherals.
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(Hse {
        freq: Hertz(HSE_HZ),
        mode: HseMode::Oscillator,
    });
    config.rcc.pll1 = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV5,
        mul: PllMul::MUL192,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: (!seeded_bugs::USB_FROM_HSI48).then_some(PllDiv::DIV20),
        divr: None,
    });
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
    config
}

/// USB runs from the crystal, too: 960 MHz / 20 = 48 MHz. The internal 48 MHz oscillator is off by
/// more than the 0.25 % that full speed allows until it is trimmed to the host's packets, and the
/// HAL has it trimmed to those of the other USB core, OTG_HS: its source is write-protected from
/// then on (RM0433, CRS_CFGR).
fn clock_usb(rcc: &mut Config) {
    rcc.mux.usbsel = mux::Usbsel::PLL1_Q;
    if seeded_bugs::USB_FROM_HSI48 {
        rcc.hsi48 = Some(Hsi48Config {
            sync_from_usb: true,
        });
        rcc.mux.usbsel = mux::Usbsel::HSI48;
    }
}

/// The camera's clock comes from the crystal: its frame rate is exact, and needs no other
/// oscillator.
fn start_camera_clock(mco: Peri<'static, peripherals::MCO1>, pin: Peri<'static, peripherals::PA8>) {
    let mut config = McoConfig::default();
    config.prescaler = McoPrescaler::DIV2;
    config.speed = Speed::Medium;
    Mco::new(mco, pin, Mco1Source::HSE, config);
}

/// Gives the pins to DCMI for good.
fn connect_camera(pins: [Peri<'static, AnyPin>; 11]) {
    for pin in pins {
        let mut pin = Flex::new(pin);
        // Pulled down: with no camera fitted, an open VSYNC pin must not make interrupts.
        pin.set_as_af_unchecked(DCMI_FUNCTION, AfType::input(Pull::Down));
        // Dropping it would disconnect the pin.
        core::mem::forget(pin);
    }
}

/// Has a camera that holds the control bus let go of it, and brings I²C1 to its state after a
/// reset.
pub fn free_sccb() {
    let lines = Lines {
        port: pac::GPIOB,
        clock: 8,
        data: 9,
    };
    lines.free();
    free_bus::reset_i2c1();
}

fn sccb_config() -> i2c::Config {
    let mut config = i2c::Config::default();
    config.frequency = SCCB_CLOCK;
    config.sda_pullup = true;
    config.scl_pullup = true;
    // A byte takes 90 µs. A bus that hangs must not hold up the tasks below for long.
    config.timeout = Duration::from_millis(5);
    config
}
