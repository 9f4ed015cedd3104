//! WeAct MiniSTM32H743VIT6 with its camera connector.
//!
//! | what | pins |
//! |---|---|
//! | camera data D0–D7 | PC6 PC7 PE0 PE1 PE4 PD3 PE5 PE6 |
//! | VSYNC, HSYNC (HREF), PIXCLK | PB7, PA4, PA6 |
//! | XCLK | PA8 (MCO1) |
//! | SCCB clock, data | PB8, PB9 (I2C1) |
//! | camera power-down | PA7, high = off |
//! | USB D−, D+ | PA11, PA12 |
//! | LED | PE3, high = on |
//! | crystal | 25 MHz |

use crate::band_copy::BandCopy;
use crate::band_dma::BandDma;
use crate::camera::Camera;
use crate::capture::Capture;
use crate::{priorities, seeded_bugs};
use embassy_stm32::gpio::{AfType, AnyPin, Flex, Level, Output, Pull, Speed};
use embassy_stm32::i2c::{self, I2c};
use embassy_stm32::pac::CRS;
use embassy_stm32::pac::crs::vals::Syncsrc;
use embassy_stm32::rcc::*;
use embassy_stm32::time::Hertz;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, Peri, peripherals};
use embassy_time::Duration;

/// Name in the device's hello.
pub const NAME: &str = "weact-h743";
/// The camera's clock: the crystal halved.
pub const XCLK_HZ: u32 = HSE_HZ / 2;

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
    /// Starts the clocks and sets up every pin. Call once.
    pub fn start() -> Board {
        let p = embassy_stm32::init(clocks());
        synchronize_hsi48();
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
            camera: Camera::new(sccb, power_down),
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

/// 25 MHz crystal / 5 · 192 / 2 = 480 MHz for the core, 240 MHz for the buses, 120 MHz for the peripherals.
fn clocks() -> Config {
    let mut config = Config::default();
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
        divq: None,
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
    config.rcc.hsi48 = usb_oscillator();
    config.rcc.mux.usbsel = mux::Usbsel::HSI48;
    config
}

/// USB runs from the internal 48 MHz oscillator, trimmed to the host's start-of-frame packets.
fn usb_oscillator() -> Option<Hsi48Config> {
    (!seeded_bugs::NO_HSI48).then_some(Hsi48Config {
        sync_from_usb: true,
    })
}

/// The HAL selects source 2, the other USB core (OTG_HS). This board's plug is on OTG_FS, source 3 (RM0433, CRS_CFGR;
/// silicon revision V).
fn synchronize_hsi48() {
    CRS.cfgr().modify(|w| w.set_syncsrc(Syncsrc::from_bits(3)));
}

/// The camera's clock comes from the crystal: its frame rate is exact, and needs no other oscillator.
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

fn sccb_config() -> i2c::Config {
    let mut config = i2c::Config::default();
    config.frequency = Hertz::khz(100);
    // The camera module has no pull-ups of its own on every make.
    config.sda_pullup = true;
    config.scl_pullup = true;
    // A byte takes 90 µs. A bus that hangs must not hold up the tasks below for long.
    config.timeout = Duration::from_millis(5);
    config
}
