//! Controls the OmniVision cameras of the 24-pin socket: 320 × 240, RGB565 or YUV422, over SCCB
//! (I²C with a stop between address and read).
//!
//! An OV7725 or an OV5640 may be there. Each set-up asks which one, so the same program is for
//! both. A [`Part`] is all in which they differ; frames, model and signals are the same.

use super::identity::{self, Identity};
use super::registers::{Demand, Registers, Table, few};
use super::{Bus, CameraLines, Error, Pace, Search, Setting, frame_time, problems, store};
use super::{ov5640, ov7725};
use crate::log;
use core::ops::RangeInclusive;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_time::{Duration, Timer};
use heapless::Vec;
pub use hivtac_portable::device::camera::ov7725::{FACTS, HEIGHT, PIXELS, PRESET, WIDTH, XCLK_HZ};
use hivtac_portable::device::camera::{Facts, Rolling};
use hivtac_terms::camera::{CameraSettings, Rate, White};
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;
use hivtac_terms::units::{Microseconds, Sixteenths};
use hivtac_wire::message::LogLevel;

/// The cameras that this firmware supports.
pub const FITTING: &[Identity] = &[identity::OV7725, identity::OV5640];
/// The first one, which counts as fitted until a camera answered.
const OV7725: &Part = &ov7725::PART;
const OV5640: &Part = &ov5640::PART;
/// The camera that answered last is the OV5640. Written by the capture task.
static IS_OV5640: AtomicBool = AtomicBool::new(false);

// Model, threshold and buffers are the same for both.
const _: () = {
    assert!(
        WIDTH == hivtac_portable::device::camera::ov5640::WIDTH
            && HEIGHT == hivtac_portable::device::camera::ov5640::HEIGHT
    );
    assert!(XCLK_HZ == hivtac_portable::device::camera::ov5640::XCLK_HZ);
    assert!(matches!(
        (PRESET, hivtac_portable::device::camera::ov5640::PRESET),
        (Preset::Ov7725, Preset::Ov7725)
    ));
};

/// The pixel format if no other one is requested.
pub const USUAL_FORMAT: Format = Format::Rgb565;
/// PCLK edge on which data is stable.
pub const SAMPLE_ON_RISING_EDGE: bool = true;
/// Level of VSYNC that means "no data": its pulse is high.
pub const VSYNC_BLANKING_IS_HIGH: bool = true;
/// Level of HREF that means "no data": it is high with the data.
pub const HREF_BLANKING_IS_HIGH: bool = false;

/// The registers are busy for 1 ms after a reset and 10 ms after power-down (OV5640: 20 ms).
const SETTLE: Duration = Duration::from_millis(20);
/// Number of frames after a change of registers that must not be used, by the OV7725's data sheet.
const FRAMES_TO_SETTLE: u32 = 10;
/// Number of successive well exposed frames with equal exposure and gain that end the search.
const STEADY_FRAMES: u32 = 3;
/// The levels between which the automatic control rests, as in OpenMV's table of the OV7725: a
/// white film is bright but not saturated.
pub const RESTS: RangeInclusive<u8> = 0x64..=0x96;

/// Returns the facts of the camera that answered last.
pub fn fitted() -> &'static Facts {
    &part().facts
}

fn part() -> &'static Part {
    match IS_OV5640.load(Ordering::Relaxed) {
        false => OV7725,
        true => OV5640,
    }
}

/// The pixel formats that the sensing supports and these cameras send. Mono is not among them: its
/// luma would have to be extracted from YUV422, and in white light red markers are hardly darker
/// than the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// RGB565.
    Rgb565,
    /// YUV422, in the order Y0 Cb Y1 Cr.
    Yuv422,
}

impl Format {
    /// Returns the format with these pixels; `None` if the cameras do not send them.
    pub const fn of(pixels: PixelFormat) -> Option<Format> {
        match pixels {
            PixelFormat::Rgb565 => Some(Format::Rgb565),
            PixelFormat::Yuv422 => Some(Format::Yuv422),
            PixelFormat::Mono => None,
        }
    }

    /// The format's pixels.
    pub const fn pixels(self) -> PixelFormat {
        match self {
            Format::Rgb565 => PixelFormat::Rgb565,
            Format::Yuv422 => PixelFormat::Yuv422,
        }
    }
}

/// A few registers and their values.
pub type Values = Vec<(u16, u8), 6>;
/// The values of the registers of exposure and gain, in the order of [`Part::light`].
pub type Held = Vec<u8, 5>;

/// Exposure and gain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Light {
    /// Exposure of a row, lines.
    pub lines: u16,
    /// Gain.
    pub gain: Sixteenths,
}

/// All in which one camera differs from another.
pub struct Part {
    /// Its identification.
    pub identity: Identity,
    /// Its limits and times.
    pub facts: Facts,
    /// Gains of white if none are set.
    pub white: White,
    /// The writes that reset all of its registers.
    pub reset: &'static Table<u8>,
    /// The first writes, which are not read back.
    pub begin: &'static Table<u8>,
    /// The registers that are the same for all settings.
    pub table: &'static Table<u8>,
    /// The last writes.
    pub end: &'static Table<u8>,
    /// Registers, and their bits, without which no frame can be read.
    pub needed: &'static Table<u16>,
    /// The registers of a format.
    pub format: fn(Format) -> &'static Table<u8>,
    /// The registers of a frame rate.
    pub clock: fn(Rate) -> &'static Table<u8>,
    /// The registers of gains of white.
    pub whiten: fn(White) -> Values,
    /// The register of the automatic control.
    pub control: u16,
    /// Its value, from whether exposure and gain are automatic.
    pub automatic: fn(bool, bool) -> u8,
    /// The registers of exposure and gain.
    pub light: &'static [u16],
    /// The meaning of these registers' values.
    pub light_of: fn(&[u8]) -> Light,
    /// The values for exposure and gain.
    pub held_of: fn(Light) -> Held,
    /// The register of the newest frame's mean level.
    pub level: u16,
    /// Gain from which the automatic control has no more to give.
    pub most_automatic_gain: Sixteenths,
    /// The times of its rows.
    pub rows: Rolling,
}

/// The camera's control side.
pub struct Camera {
    part: &'static Part,
    registers: Registers,
    lines: CameraLines,
    settings: CameraSettings,
    /// The frame time during the newest search for exposure and gain.
    pub pace: Pace,
    /// Exposure and gain as kept.
    kept: Light,
    /// The newest search found a well exposed picture, or there was nothing to search.
    well_exposed: bool,
}

impl Camera {
    /// The bus must run at 100 kHz to 400 kHz, and XCLK must already run.
    pub fn new(bus: Bus, lines: CameraLines) -> Self {
        Self {
            part: OV7725,
            registers: Registers::new(bus, &identity::OV7725),
            lines,
            settings: CameraSettings::default(),
            pace: Pace::default(),
            kept: Light {
                lines: 0,
                gain: Sixteenths(16),
            },
            well_exposed: true,
        }
    }

    /// Wakes the camera, finds out which one it is, and resets its registers, which only this does.
    /// Until the next reset, registers must hold what was written as far as `demand` says.
    pub async fn reset(&mut self, demand: Demand) -> Result<(), Error> {
        self.lines.wake().await;
        Timer::after(SETTLE).await;
        let found = identity::find(&mut self.registers.bus)?;
        IS_OV5640.store(found > 0, Ordering::Relaxed);
        self.part = part();
        (self.registers).begin(&self.part.identity, self.part.needed, demand);
        self.registers.write_all(self.part.reset).await
    }

    /// Writes the register table after a reset, and applies `settings`, which must be within
    /// [`limits`](super::limits). Returns when the camera sends well exposed frames.
    pub async fn configure(
        &mut self,
        format: Format,
        settings: CameraSettings,
    ) -> Result<(), Error> {
        Timer::after(SETTLE).await;
        self.settings = settings;
        let part = self.part;
        self.registers.write_all(part.begin).await?;
        // The clock comes first, so that exposure is sought with frames of the new rate.
        let tables = [
            (part.clock)(settings.rate),
            (part.format)(format),
            part.table,
        ];
        for table in tables {
            self.registers.set(table).await?;
        }
        self.registers.set(&self.white()).await?;
        self.registers.set(part.end).await?;
        self.lock_exposure().await
    }

    /// Applies `settings`, which must be within [`limits`](super::limits). Returns when the camera
    /// sends well exposed frames.
    pub async fn set(&mut self, settings: CameraSettings) -> Result<(), Error> {
        let before = core::mem::replace(&mut self.settings, settings);
        if settings.rate != before.rate {
            self.registers.set((self.part.clock)(settings.rate)).await?;
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
    fn white(&self) -> Values {
        let part = self.part;
        (part.whiten)(self.settings.white.unwrap_or(part.white))
    }

    /// Changes the pixel format of a configured camera. Returns when it sends such frames. Exposure
    /// and gain stay.
    pub async fn set_format(&mut self, format: Format) -> Result<(), Error> {
        self.registers.set((self.part.format)(format)).await?;
        Timer::after(self.frame_time() * FRAMES_TO_SETTLE).await;
        Ok(())
    }

    /// Lets automatic exposure and gain adapt to the light, and then keeps their values: markers
    /// must not change their brightness with the load on the film.
    pub async fn lock_exposure(&mut self) -> Result<(), Error> {
        let CameraSettings { exposure, gain, .. } = self.settings;
        if exposure.is_some() || gain.is_some() {
            let before = self.light()?;
            self.take(before);
            // Fixed values must be in force while the others are sought.
            self.registers.set(&self.locked()).await?;
        }
        let part = self.part;
        let automatic = (part.automatic)(exposure.is_none(), gain.is_none());
        self.registers.write(part.control, automatic)?;
        self.pace = Pace::default();
        let mut search = Search::new(STEADY_FRAMES, self.light()?);
        let mut level = 0;
        while !search.is_over() {
            Timer::after(self.frame_time()).await;
            self.pace.look();
            let found = self.light()?;
            level = self.registers.read(part.level)?;
            search.look(found, self.is_settled(level, found));
        }
        let is_fixed = exposure.is_some() && gain.is_some();
        self.well_exposed = is_fixed || RESTS.contains(&level);
        if !self.well_exposed {
            let (least, most) = (RESTS.start(), RESTS.end());
            log::say(
                LogLevel::Warning,
                format_args!("exposure: level {level}, not {least} to {most}; change the light"),
            );
        }
        self.take(search.found);
        self.registers.set(&self.locked()).await?;
        let rate = self.settings.rate;
        let middle_us = part.rows.middle_us(self.lines(), rate);
        store(middle_us, self.settings, self.exposed(), self.kept.gain);
        Ok(())
    }

    /// Returns whether the automatic control rests at a level with these values: the picture is
    /// well exposed, or nothing is left to change.
    fn is_settled(&self, level: u8, Light { lines, gain }: Light) -> bool {
        let settings = self.settings;
        let (exposure, amplified) = match () {
            () if level < *RESTS.start() => (
                lines >= self.part.rows.longest_exposure,
                gain >= self.part.most_automatic_gain,
            ),
            () if level > *RESTS.end() => (lines <= 1, gain <= Sixteenths(16)),
            () => (true, true),
        };
        (settings.exposure.is_some() || exposure) && (settings.gain.is_some() || amplified)
    }

    /// Keeps the values of the settings, otherwise those found.
    fn take(&mut self, found: Light) {
        let CameraSettings { exposure, gain, .. } = self.settings;
        let lines = exposure.map(|time| self.part.rows.lines_in(time, self.settings.rate));
        let wanted = Light {
            lines: lines.unwrap_or(found.lines),
            gain: gain.unwrap_or(found.gain),
        };
        // Not every gain has a value.
        self.kept = (self.part.light_of)(&(self.part.held_of)(wanted));
    }

    /// The registers that keep exposure and gain.
    fn locked(&self) -> Values {
        let part = self.part;
        let held = (part.held_of)(self.kept);
        let light = part.light.iter().copied().zip(held);
        let control = (part.control, (part.automatic)(false, false));
        few(core::iter::once(control).chain(light))
    }

    /// Reads the camera's state, while frames of `format` are captured.
    pub async fn setting(&mut self, format: Format) -> Result<Setting, Error> {
        let part = self.part;
        let (white, locked) = (self.white(), self.locked());
        let tables: [&Table<u8>; 6] = [
            (part.format)(format),
            part.table,
            (part.clock)(self.settings.rate),
            &white,
            part.end,
            &locked,
        ];
        let identity = &self.part.identity;
        Ok(Setting {
            id: identity.ask(&mut self.registers.bus)?,
            comparison: self.registers.compare(&tables).await?,
            exposure: self.exposed(),
            longest_exposure: Microseconds((part.facts.frame_us)(self.settings.rate)),
            gain: self.kept.gain,
        })
    }

    /// The exposure of a row, as kept.
    fn exposed(&self) -> Microseconds {
        (self.part.rows).exposed(self.lines(), self.settings.rate)
    }

    /// The exposure of a row in lines, as kept.
    fn lines(&self) -> u32 {
        u32::from(self.kept.lines.min(self.part.rows.lines))
    }

    /// Reads exposure and gain.
    fn light(&mut self) -> Result<Light, Error> {
        let mut held = Held::new();
        for register in self.part.light {
            // Has room for all of them.
            let _ = held.push(self.registers.read(*register)?);
        }
        Ok((self.part.light_of)(&held))
    }
}
