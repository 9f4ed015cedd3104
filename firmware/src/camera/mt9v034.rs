//! Controls the onsemi (Aptina) MT9V034, mono, with a global shutter: 160 × 152 pixels, each 2 × 2
//! binned, over I²C with registers of 16 bits.

use super::identity::{self, Identity};
use super::mt9v034_registers::{
    AEC_AGC_ENABLE, ANALOG_GAIN, AUTOMATIC_EXPOSURE, AUTOMATIC_GAIN, FOUND, Format, LOCKED, NEEDED,
    RESET, SHUTTER_WIDTH, rows_for, table,
};
use super::registers::{Demand, Registers};
use super::{Bus, CameraLines, Error, Pace, Search, Setting, frame_time, problems, store};
use crate::log;
use embassy_time::{Duration, Timer};
use hivtac_portable::device::camera::Facts;
pub use hivtac_portable::device::camera::mt9v034::{FACTS, HEIGHT, PIXELS, PRESET, WIDTH, XCLK_HZ};
use hivtac_portable::device::camera::mt9v034::{longest_exposure, middle_us, rows_in, rows_us};
use hivtac_terms::camera::{CameraSettings, LEAST_GAIN};
use hivtac_terms::units::{Microseconds, Sixteenths};
use hivtac_wire::message::LogLevel;

/// Its identification.
const IDENTITY: Identity = identity::MT9V034;
/// The cameras that this firmware supports.
pub const FITTING: &[Identity] = &[IDENTITY];
/// Its pixel format.
pub const USUAL_FORMAT: Format = Format::Mono;
/// PIXCLK edge on which data is stable. While columns are binned, data change with PIXCLK's rising
/// edge (onsemi MT9V032, pixel data format).
pub const SAMPLE_ON_RISING_EDGE: bool = false;
/// Level of VSYNC (FRAME_VALID) that means "no data": it is high with the rows.
pub const VSYNC_BLANKING_IS_HIGH: bool = false;
/// Level of HSYNC (LINE_VALID) that means "no data": it is high with the data.
pub const HREF_BLANKING_IS_HIGH: bool = false;

/// Time after a reset until registers may be written.
const SETTLE: Duration = Duration::from_millis(20);
/// Number of successive frames with equal exposure and gain that count as steady. The camera's
/// control updates at every third frame.
const STEADY_FRAMES: u32 = 9;

/// The facts of the camera that is there.
pub fn fitted() -> &'static Facts {
    &FACTS
}

/// The camera's control side.
pub struct Camera {
    registers: Registers,
    lines: CameraLines,
    settings: CameraSettings,
    /// The frame time during the newest search for exposure and gain.
    pub pace: Pace,
    /// The registers that keep gain and exposure.
    locked: [(u16, u16); 3],
    /// The newest search ended with exposure and gain that stay.
    well_exposed: bool,
}

impl Camera {
    /// The bus must run at 100 kHz to 400 kHz, and XCLK must already run.
    pub fn new(bus: Bus, lines: CameraLines) -> Self {
        Self {
            registers: Registers::new(bus, &IDENTITY),
            lines,
            settings: CameraSettings::default(),
            pace: Pace::default(),
            locked: [
                (ANALOG_GAIN, 0),
                (SHUTTER_WIDTH, 0),
                (AEC_AGC_ENABLE, LOCKED),
            ],
            well_exposed: true,
        }
    }

    /// Wakes the camera, checks that it is the right one, and resets its registers. Until the next
    /// reset, registers must hold what was written as far as `demand` says.
    pub async fn reset(&mut self, demand: Demand) -> Result<(), Error> {
        self.registers.begin(&IDENTITY, NEEDED, demand);
        self.lines.wake().await;
        Timer::after(SETTLE).await;
        identity::find(&mut self.registers.bus)?;
        self.registers.write(RESET, 1_u16)
    }

    /// Writes the register table after a reset, and applies `settings`, which must be within
    /// [`limits`](super::limits). Returns when the camera sends well exposed frames.
    pub async fn configure(
        &mut self,
        _format: Format,
        settings: CameraSettings,
    ) -> Result<(), Error> {
        Timer::after(SETTLE).await;
        self.registers.set(table()).await?;
        self.set(settings).await
    }

    /// Applies `settings`, which must be within [`limits`](super::limits). Returns when the camera
    /// sends well exposed frames.
    pub async fn set(&mut self, settings: CameraSettings) -> Result<(), Error> {
        self.settings = settings;
        self.registers.set(rows_for(settings.rate)).await?;
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

    /// Does nothing, because there is only one format.
    pub async fn set_format(&mut self, _format: Format) -> Result<(), Error> {
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
        self.registers
            .write(AEC_AGC_ENABLE, LOCKED | self.automatic())?;
        self.pace = Pace::default();
        let mut search = Search::new(STEADY_FRAMES, self.exposure()?);
        while !search.is_over() {
            Timer::after(self.frame_time()).await;
            self.pace.look();
            search.look(self.exposure()?, true);
        }
        self.well_exposed = search.is_settled();
        if !self.well_exposed {
            let text = format_args!("exposure: still moving after 1.5 s; steady light is needed");
            log::say(LogLevel::Warning, text);
        }
        self.take(search.found);
        self.registers.set(&self.locked).await?;
        // Settings are in force from the next frame on.
        Timer::after(2 * self.frame_time()).await;
        let exposed = self.exposed();
        // All rows' exposure ends before the first one is read.
        store(middle_us(exposed), self.settings, exposed, self.gain());
        Ok(())
    }

    /// The bits of [`AEC_AGC_ENABLE`] for the automatic values.
    fn automatic(&self) -> u16 {
        let CameraSettings { exposure, gain, .. } = self.settings;
        let bits = |is_automatic, bits| if is_automatic { bits } else { 0 };
        bits(exposure.is_none(), AUTOMATIC_EXPOSURE) | bits(gain.is_none(), AUTOMATIC_GAIN)
    }

    /// Stores the values to keep: those of the settings, otherwise those found.
    fn take(&mut self, [found_gain, found_rows]: [u16; 2]) {
        let CameraSettings {
            exposure,
            gain,
            rate,
            ..
        } = self.settings;
        let [(_, kept_gain), (_, kept_rows), _] = &mut self.locked;
        *kept_gain = gain.map_or(found_gain, |gain| gain.0).max(LEAST_GAIN.0);
        let rows = exposure.map_or(found_rows, rows_in);
        *kept_rows = rows.clamp(1, longest_exposure(rate));
    }

    /// Reads the camera's state, while frames are captured.
    pub async fn setting(&mut self, _format: Format) -> Result<Setting, Error> {
        let tables = [table(), rows_for(self.settings.rate), &self.locked];
        let longest = longest_exposure(self.settings.rate);
        Ok(Setting {
            id: IDENTITY.ask(&mut self.registers.bus)?,
            comparison: self.registers.compare(&tables).await?,
            exposure: self.exposed(),
            longest_exposure: Microseconds(rows_us(longest)),
            gain: self.gain(),
        })
    }

    /// The exposure of all rows, as kept.
    fn exposed(&self) -> Microseconds {
        let [_, (_, rows), _] = self.locked;
        Microseconds(rows_us(rows))
    }

    /// The gain, as kept.
    fn gain(&self) -> Sixteenths {
        let [(_, gain), ..] = self.locked;
        Sixteenths(gain)
    }

    /// Reads the registers of [`FOUND`].
    fn exposure(&mut self) -> Result<[u16; 2], Error> {
        let [gain, rows] = FOUND;
        Ok([self.registers.read(gain)?, self.registers.read(rows)?])
    }
}
