//! Sets up the WeAct MiniSTM32H743VIT6 with its camera connector.
//!
//! | what | pins |
//! |---|---|
//! | camera data D0–D7 | PC6 PC7 PE0 PE1 PE4 PD3 PE5 PE6 |
//! | VSYNC, HSYNC (HREF), PIXCLK | PB7, PA4, PA6 |
//! | XCLK | PA8 (MCO1) |
//! | SCCB clock, data | PB8, PB9 (I2C1), 4.7 kΩ on the board |
//! | camera power-down | PA7, high = standby: the camera's supplies stay on, and its registers keep their values |
//! | USB D−, D+ | PA11, PA12 |
//! | LED | PE3, high = on |
//! | output | PE7 |
//! | UART for samples | PB10 (USART3) |
//! | crystal | 25 MHz |

use super::parts::{self, Board, StatusLed, UartPort, UsbPort};
use super::silicon::{self, Led};
use crate::band_copy::BandCopy;
use crate::band_dma::BandDma;
use crate::camera::{self, Bus, Camera, CameraLines};
use crate::capture::Capture;
use crate::faults;
use crate::flash::SecondBank;
use crate::priorities;
use crate::snapshot_copy::SnapshotCopy;
use crate::thermometer::Thermometer;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::i2c::I2c;
use embassy_stm32::rcc::*;
use embassy_stm32::{Peri, pac, peripherals};

/// Name in the device's hello.
pub const NAME: &str = "weact-h743";
/// The output pin: on the header, and used by no other part of the board.
pub const OUTPUT: (pac::gpio::Gpio, usize) = (pac::GPIOE, 7);
const CRYSTAL_HZ: u32 = 25_000_000;
// The camera's clock is half of the crystal's.
const _: () = assert!(camera::XCLK_HZ == CRYSTAL_HZ / 2);

/// Starts the clocks and sets up every pin. Call once. Does not return on silicon that is too old.
pub fn start() -> Board {
    silicon::refuse_old(&Led {
        port: pac::GPIOE,
        pin: 3,
        on: Level::High,
    });
    faults::start_watchdog();
    let p = embassy_stm32::init(parts::clocks(CRYSTAL_HZ, PllPreDiv::DIV5, PllMul::MUL192));
    start_camera_clock(p.MCO1, p.PA8);
    parts::connect_camera([
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
    parts::drive_low(p.PE7.into());
    let bus = I2c::new_blocking(p.I2C1, p.PB8, p.PB9, parts::bus_config());
    let lines = CameraLines {
        standby: Output::new(p.PA7, Level::High, Speed::Low),
        reset: None,
    };
    Board {
        camera: Camera::new(Bus::new(bus), lines),
        capture: Capture::new(p.DCMI, BandDma::new(p.DMA1_CH0), priorities::CAPTURE),
        bands: BandCopy::new(p.MDMA_CH0),
        flash: SecondBank::new(p.FLASH, p.MDMA_CH2),
        snapshots: SnapshotCopy::new(p.MDMA_CH1),
        thermometer: Thermometer(p.ADC3),
        usb: UsbPort {
            core: p.USB_OTG_FS,
            plus: p.PA12,
            minus: p.PA11,
        },
        uart: UartPort {
            usart: p.USART3,
            pin: p.PB10,
            dma: p.DMA2_CH0,
        },
        led: StatusLed {
            pin: Output::new(p.PE3, Level::Low, Speed::Low),
            on: Level::High,
        },
    }
}

/// The camera's clock comes from the crystal: its frame rate is exact, and no other oscillator is
/// needed.
fn start_camera_clock(mco: Peri<'static, peripherals::MCO1>, pin: Peri<'static, peripherals::PA8>) {
    let mut config = McoConfig::default();
    config.prescaler = McoPrescaler::DIV2;
    config.speed = Speed::Medium;
    Mco::new(mco, pin, Mco1Source::HSE, config);
}
