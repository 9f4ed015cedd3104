//! Sets up the OpenMV Cam H7 with its global shutter module.
//!
//! | what | pins |
//! |---|---|
//! | camera data D0–D7 | PC6 PC7 PE0 PE1 PE4 PB6 PE5 PE6 |
//! | VSYNC, HSYNC (HREF), PIXCLK | PB7, PA4, PA6 |
//! | XCLK | PA8 (TIM1, channel 1) |
//! | I²C clock, data | PB8, PB9 (I2C1) |
//! | camera power-down | PD7, high = standby |
//! | camera reset | PA10, low = reset |
//! | USB D−, D+ | PA11, PA12 |
//! | LED (green) | PC1, low = on |
//! | output | PD12, P7 of the header |
//! | UART for samples | PB10 (USART3), P4 of the header |
//! | crystal | 12 MHz |

use super::parts::{self, Board, StatusLed, UartPort, UsbPort};
use super::silicon::{self, Led};
use crate::band_copy::BandCopy;
use crate::band_dma::BandDma;
use crate::camera::{Bus, Camera, CameraLines, XCLK_HZ};
use crate::capture::Capture;
use crate::faults;
use crate::flash::SecondBank;
use crate::priorities;
use crate::snapshot_copy::SnapshotCopy;
use crate::thermometer::Thermometer;
use embassy_stm32::gpio::{Level, Output, OutputType, Speed};
use embassy_stm32::i2c::I2c;
use embassy_stm32::rcc::*;
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_stm32::{Peri, pac, peripherals};

/// Name in the device's hello.
pub const NAME: &str = "openmv-h7";
/// The output pin.
pub const OUTPUT: (pac::gpio::Gpio, usize) = (pac::GPIOD, 12);
const CRYSTAL_HZ: u32 = 12_000_000;
/// Frequency of TIM1's counter: twice the peripherals' clock.
const TIMER_HZ: u32 = 240_000_000;
/// The camera's clock is high for four ninths of its period, as OpenMV's firmware sets it for this
/// module.
const XCLK_DIVIDER: u32 = 9;
const _: () = assert!(XCLK_HZ == TIMER_HZ / XCLK_DIVIDER);

/// Starts the clocks and sets up every pin. Call once. Does not return on silicon that is too old.
pub fn start() -> Board {
    silicon::refuse_old(&Led {
        port: pac::GPIOC,
        pin: 1,
        on: Level::Low,
    });
    faults::start_watchdog();
    let p = embassy_stm32::init(parts::clocks(CRYSTAL_HZ, PllPreDiv::DIV3, PllMul::MUL240));
    start_camera_clock(p.TIM1, p.PA8);
    parts::connect_camera([
        p.PC6.into(),
        p.PC7.into(),
        p.PE0.into(),
        p.PE1.into(),
        p.PE4.into(),
        p.PB6.into(),
        p.PE5.into(),
        p.PE6.into(),
        p.PB7.into(),
        p.PA4.into(),
        p.PA6.into(),
    ]);
    parts::drive_low(p.PD12.into());
    let bus = I2c::new_blocking(p.I2C1, p.PB8, p.PB9, parts::bus_config());
    let lines = CameraLines {
        standby: Output::new(p.PD7, Level::High, Speed::Low),
        reset: Some(Output::new(p.PA10, Level::Low, Speed::Low)),
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
            pin: Output::new(p.PC1, Level::High, Speed::Low),
            on: Level::Low,
        },
    }
}

/// The timer's clock comes from the crystal: the camera's frame rate is exact.
fn start_camera_clock(
    timer: Peri<'static, peripherals::TIM1>,
    pin: Peri<'static, peripherals::PA8>,
) {
    let pin = PwmPin::new(pin, OutputType::PushPull);
    let edges = CountingMode::EdgeAlignedUp;
    let mut clock = SimplePwm::new(timer, Some(pin), None, None, None, Hertz(XCLK_HZ), edges);
    clock.ch1().set_duty_cycle(XCLK_DIVIDER / 2);
    clock.ch1().enable();
    // Dropping it would stop the timer.
    core::mem::forget(clock);
}
