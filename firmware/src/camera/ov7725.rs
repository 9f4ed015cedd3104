//! OmniVision OV7725: 320 × 240, RGB565 or YUV422, over SCCB (I²C with a stop between address and read).

use super::ov7725_registers::{COM7, COM7_RESET, Format, PID, TABLE, VER};
use crate::board::XCLK_HZ;
use core::fmt;
use embassy_stm32::gpio::Output;
use embassy_stm32::i2c::{self, I2c, Master};
use embassy_stm32::mode::Blocking;
use embassy_time::{Duration, Timer};
use hivtac_sensing::geometry::Preset;

/// Name in the device's hello.
pub const NAME: &str = "ov7725";
/// Its lens and pixels.
pub const PRESET: Preset = Preset::Ov7725;
/// Columns of a frame, px.
pub const WIDTH: u16 = 320;
/// Rows of a frame, px.
pub const HEIGHT: u16 = 240;

/// Time from frame to frame: 278 lines of 576 pixels of two bytes, one byte per PCLK; PCLK = XCLK as configured.
pub const FRAME_TIME: Duration = Duration::from_micros(278 * 576 * 2 * 1_000_000 / XCLK_HZ as u64);

/// PCLK edge on which data is stable.
pub const SAMPLE_ON_RISING_EDGE: bool = true;
/// Level of VSYNC while it says "no data": its pulse is high.
pub const VSYNC_BLANKING_IS_HIGH: bool = true;
/// Level of HREF while it says "no data": it is high with the data.
pub const HREF_BLANKING_IS_HIGH: bool = false;

const ADDRESS: u8 = 0x21;
/// The register file is busy for 1 ms after a reset and 10 ms after power-down; doubled.
const SETTLE: Duration = Duration::from_millis(20);
/// A new format holds from the next frame on; the frame after power-up takes 32 ms. The frames of this time are not used.
const FORMAT_CHANGE: Duration = Duration::from_millis(100);
/// Between two register writes: lets tasks of lower priority run.
const PAUSE: Duration = Duration::from_micros(100);

/// Why a camera cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// It does not acknowledge, or the bus does not work.
    Bus(i2c::Error),
    /// Another part answers.
    WrongId {
        /// Register `PID` and `VER` as read.
        found: [u8; 2],
    },
}

impl From<i2c::Error> for Error {
    fn from(error: i2c::Error) -> Self {
        Error::Bus(error)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Error::Bus(error) => write!(f, "no OV7725 on I2C1 ({error}); check its cable"),
            Error::WrongId { found: [p, v] } => {
                write!(
                    f,
                    "ID {p:02X} {v:02X}, an OV7725 has 77 21; fit that camera"
                )
            }
        }
    }
}

/// The camera's control side.
pub struct Camera {
    sccb: I2c<'static, Blocking, Master>,
    power_down: Output<'static>,
}

impl Camera {
    /// `sccb` at 100 kHz or up to 400 kHz; `power_down` high switches the camera off. XCLK must already run.
    pub fn new(sccb: I2c<'static, Blocking, Master>, power_down: Output<'static>) -> Self {
        Self { sccb, power_down }
    }

    /// Power-cycles the camera, checks that it is the right one, and resets its registers.
    pub async fn reset(&mut self) -> Result<(), Error> {
        self.power_down.set_high();
        Timer::after(SETTLE).await;
        self.power_down.set_low();
        Timer::after(SETTLE).await;
        let found = [self.read(PID.0)?, self.read(VER.0)?];
        if found != [PID.1, VER.1] {
            return Err(Error::WrongId { found });
        }
        self.write(COM7, COM7_RESET)
    }

    /// Writes the register table after a reset; returns when the camera sends frames so.
    pub async fn configure(&mut self, format: Format) -> Result<(), Error> {
        Timer::after(SETTLE).await;
        self.write_all(format.registers()).await?;
        self.write_all(TABLE).await?;
        Timer::after(FORMAT_CHANGE).await;
        Ok(())
    }

    /// Changes the pixel format of a configured camera; returns when it sends frames so.
    pub async fn set_format(&mut self, format: Format) -> Result<(), Error> {
        self.write_all(format.registers()).await?;
        Timer::after(FORMAT_CHANGE).await;
        Ok(())
    }

    async fn write_all(&mut self, table: &[(u8, u8)]) -> Result<(), Error> {
        for (register, value) in table {
            self.write(*register, *value)?;
            Timer::after(PAUSE).await;
        }
        Ok(())
    }

    fn write(&mut self, register: u8, value: u8) -> Result<(), Error> {
        Ok(self.sccb.blocking_write(ADDRESS, &[register, value])?)
    }

    fn read(&mut self, register: u8) -> Result<u8, Error> {
        let mut value = [0];
        self.sccb.blocking_write(ADDRESS, &[register])?;
        self.sccb.blocking_read(ADDRESS, &mut value)?;
        Ok(value[0])
    }
}
