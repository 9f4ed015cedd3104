//! Controls the OmniVision OV7725: 320 × 240, RGB565 or YUV422, over SCCB (I²C with a stop between
//! address and read).

use super::identity::{self, Identity};
use super::ov7725_registers::{
    AUTOMATIC_EXPOSURE, AUTOMATIC_GAIN, COM7, COM7_RESET, COM8, EXPOSURE, Format, LEVEL, LOCKED,
    MOST_AUTOMATIC_GAIN, NEEDED, RESTS, TABLE, clock, white,
};
use super::registers::{Demand, Registers};
use super::{Bus, CameraLines, Error, Pace, Search, Setting, frame_time, problems, store};
use crate::log;
use embassy_time::{Duration, Timer};
pub use hivtac_portable::device::camera::ov7725::{
    HEIGHT, LIMITS, MOTION, NAME, PIXELS, PRESET, WIDTH, XCLK_HZ, frame_us,
};
use hivtac_portable::device::camera::ov7725::{LINES, LONGEST_EXPOSURE, exposed, lines, middle_us};
use hivtac_terms::camera::CameraSettings;
use hivtac_terms::units::{Microseconds, Sixteenths};
use hivtac_wire::message::LogLevel;

/// Its identification.
pub const IDENTITY: Identity = identity::OV7725;
/// Its pixel format if no other one is requested.
pub const USUAL_FORMAT: Format = Format::Rgb565;

/// PCLK edge on which data is stable.
pub const SAMPLE_ON_RISING_EDGE: bool = true;
/// Level of VSYNC that means "no data": its pulse is high.
pub const VSYNC_BLANKING_IS_HIGH: bool = true;
/// Level of HREF that means "no data": it is high with the data.
pub const HREF_BLANKING_IS_HIGH: bool = false;

/// The registers are busy for 1 ms after a reset and 10 ms after power-down; doubled here.
const SETTLE: Duration = Duration::from_millis(20);
/// Number of frames after a change of registers that must not be used, by the data sheet.
const FRAMES_TO_SETTLE: u32 = 10;
/// Number of successive well exposed frames with equal exposure and gain that end the search.
const STEADY_FRAMES: u32 = 3;
/// The camera's control side.
pub struct Camera {
    registers: Registers,
    lines: CameraLines,
    settings: CameraSettings,
    /// The frame time during the newest search for exposure and gain.
    pub pace: Pace,
    /// The registers that keep exposure and gain.
    locked: [(u8, u8); 4],
    /// The newest search found a well exposed picture, or there was nothing to search.
    well_exposed: bool,
}

impl Camera {
    /// The bus must run at 100 kHz to 400 kHz, and XCLK must already run.
    pub fn new(bus: Bus, lines: CameraLines) -> Self {
        let [gain, low, high] = EXPOSURE;
        Self {
            registers: Registers::new(bus, NEEDED),
            lines,
            settings: CameraSettings::default(),
            pace: Pace::default(),
            locked: [(COM8, LOCKED), (gain, 0), (low, 0), (high, 0)],
            well_exposed: true,
        }
    }

    /// Wakes the camera, checks that it is the right one, and resets its registers, which only this
    /// does. Until the next reset, registers must hold what was written as far as `demand` says.
    pub async fn reset(&mut self, demand: Demand) -> Result<(), Error> {
        self.registers.begin(demand);
        self.lines.wake().await;
        Timer::after(SETTLE).await;
        identity::check(&mut self.registers.bus)?;
        self.registers.write(COM7, COM7_RESET)
    }

    /// Writes the register table after a reset, and applies `settings`, which must be within
    /// [`LIMITS`](super::LIMITS). Returns when the camera sends well exposed frames.
    pub async fn configure(
        &mut self,
        format: Format,
        settings: CameraSettings,
    ) -> Result<(), Error> {
        Timer::after(SETTLE).await;
        self.settings = settings;
        // The clock comes first, so that exposure is sought with frames of the new rate.
        for table in [clock(settings.rate), format.registers(), TABLE] {
            self.registers.set(table).await?;
        }
        self.registers.set(&self.white()).await?;
        self.lock_exposure().await
    }

    /// Applies `settings`, which must be within [`LIMITS`](super::LIMITS). Returns when the camera
    /// sends well exposed frames.
    pub async fn set(&mut self, settings: CameraSettings) -> Result<(), Error> {
        let before = core::mem::replace(&mut self.settings, settings);
        if settings.rate != before.rate {
            self.registers.set(clock(settings.rate)).await?;
        }
        if settings.white != before.white {
            self.registers.set(&self.white()).await?;
        }
        if (settings.rate, settings.white) != (before.rate, before.white) {
            Timer::after(self.frame_time() * FRAMES_TO_SETTLE).await;
        }
        self.lock_exposure().await
    }

    /// Returns the problems of the newest set-up, bits of `Problem`.
    pub fn problems(&self) -> u32 {
        problems(self.registers.differ(), self.well_exposed)
    }

    /// Time from frame to frame.
    pub fn frame_time(&self) -> Duration {
        frame_time(self.settings.rate)
    }

    /// The registers of white.
    fn white(&self) -> [(u8, u8); 2] {
        white(self.settings.white.unwrap_or_default())
    }

    fn frame_us(&self) -> u32 {
        frame_us(self.settings.rate)
    }

    /// Changes the pixel format of a configured camera. Returns when it sends such frames. Exposure
    /// and gain stay.
    pub async fn set_format(&mut self, format: Format) -> Result<(), Error> {
        self.registers.set(format.registers()).await?;
        Timer::after(self.frame_time() * FRAMES_TO_SETTLE).await;
        Ok(())
    }

    /// Lets automatic exposure and gain adapt to the light, and then keeps their values: markers
    /// must not change their brightness with the load on the film.
    pub async fn lock_exposure(&mut self) -> Result<(), Error> {
        let CameraSettings { exposure, gain, .. } = self.settings;
        if exposure.is_some() || gain.is_some() {
            let before = self.exposure()?;
            self.take(before);
            // Fixed values must be in force while the others are sought.
            self.registers.set(&self.locked).await?;
        }
        self.registers.write(COM8, LOCKED | self.automatic())?;
        self.pace = Pace::default();
        let mut search = Search::new(STEADY_FRAMES, self.exposure()?);
        let mut level = 0;
        while !search.is_over() {
            Timer::after(self.frame_time()).await;
            self.pace.look();
            let found = self.exposure()?;
            level = self.registers.read(LEVEL)?;
            search.look(found, self.is_settled(level, found));
        }
        self.well_exposed = self.automatic() == 0 || RESTS.contains(&level);
        if !self.well_exposed {
            let (least, most) = (RESTS.start(), RESTS.end());
            log::say(
                LogLevel::Warning,
                format_args!("exposure: level {level}, not {least} to {most}; change the light"),
            );
        }
        self.take(search.found);
        self.registers.set(&self.locked).await?;
        let middle_us = middle_us(self.lines(), self.settings.rate);
        store(middle_us, self.settings, self.exposed(), self.gain());
        Ok(())
    }

    /// Returns whether the automatic control rests at a level with these values: the picture is
    /// well exposed, or nothing is left to change.
    fn is_settled(&self, level: u8, [gain, low, high]: [u8; 3]) -> bool {
        let automatic = self.automatic();
        let lines = u16::from_le_bytes([low, high]);
        let at_limit = |bit, is_there| automatic & bit == 0 || is_there;
        let (exposure, amplified) = match () {
            () if level < *RESTS.start() => {
                (lines >= LONGEST_EXPOSURE, gain >= MOST_AUTOMATIC_GAIN)
            }
            () if level > *RESTS.end() => (lines <= 1, gain == 0),
            () => (true, true),
        };
        at_limit(AUTOMATIC_EXPOSURE, exposure) && at_limit(AUTOMATIC_GAIN, amplified)
    }

    /// The bits of [`COM8`] for the automatic values.
    fn automatic(&self) -> u8 {
        let CameraSettings { exposure, gain, .. } = self.settings;
        let bit = |is_automatic, bit| if is_automatic { bit } else { 0 };
        bit(exposure.is_none(), AUTOMATIC_EXPOSURE) | bit(gain.is_none(), AUTOMATIC_GAIN)
    }

    /// Stores the values to keep: those of the settings, otherwise those found.
    fn take(&mut self, [found_gain, found_low, found_high]: [u8; 3]) {
        let CameraSettings { exposure, gain, .. } = self.settings;
        let lines = exposure.map(|time| lines(time, self.settings.rate).to_le_bytes());
        let [set_low, set_high] = lines.unwrap_or([found_low, found_high]);
        let [_, (_, gain_register), (_, low), (_, high)] = &mut self.locked;
        *gain_register = gain.map_or(found_gain, register_of);
        (*low, *high) = (set_low, set_high);
    }

    /// Reads the camera's state, while frames of `format` are captured.
    pub async fn setting(&mut self, format: Format) -> Result<Setting, Error> {
        let clock = clock(self.settings.rate);
        let white = self.white();
        let tables = [format.registers(), TABLE, clock, &white, &self.locked];
        Ok(Setting {
            id: identity::id(&mut self.registers.bus)?,
            comparison: self.registers.compare(&tables).await?,
            exposure: self.exposed(),
            longest_exposure: Microseconds(self.frame_us()),
            gain: self.gain(),
        })
    }

    /// The exposure of a row, as kept.
    fn exposed(&self) -> Microseconds {
        exposed(self.lines(), self.settings.rate)
    }

    /// The gain, as kept.
    fn gain(&self) -> Sixteenths {
        let [_, (_, register), ..] = self.locked;
        gain_of(register)
    }

    /// The exposure of a row in lines, as kept.
    fn lines(&self) -> u32 {
        let [_, _, (_, low), (_, high)] = self.locked;
        u32::from(u16::from_le_bytes([low, high])).min(u32::from(LINES))
    }

    /// Reads the registers of [`EXPOSURE`].
    fn exposure(&mut self) -> Result<[u8; 3], Error> {
        let [gain, low, high] = EXPOSURE;
        let registers = &mut self.registers;
        Ok([
            registers.read(gain)?,
            registers.read(low)?,
            registers.read(high)?,
        ])
    }
}

/// The gain of a register value: each of the upper four bits doubles it, the lower four add
/// sixteenths.
fn gain_of(register: u8) -> Sixteenths {
    Sixteenths((16 + u16::from(register & 0x0F)) << (register >> 4).count_ones())
}

/// The register value of the next lower gain, at most four.
fn register_of(Sixteenths(gain): Sixteenths) -> u8 {
    match gain {
        ..32 => gain.saturating_sub(16) as u8,
        32..64 => 0x10 | (gain / 2 - 16) as u8,
        64.. => 0x30,
    }
}
