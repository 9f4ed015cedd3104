//! The camera: its settings, the light that it needs, and its times.

use hivtac_portable::device::camera::{Facts, Rolling, mt9v034, ov5640, ov7725};
use hivtac_portable::device::model::Fitting;
use hivtac_sensor::motion::Motion;
use hivtac_terms::camera::{CameraLimits, CameraSettings, LEAST_GAIN, MOST_GAIN, Rate};
use hivtac_terms::fixed::Q;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::threshold::PixelFormat;
use hivtac_terms::units::{Microseconds, Sixteenths};
use hivtac_twin::{Layout, OV5640_NOISE, Options, Scene, SceneError, Shutter};
use hivtac_wire::message::Inspection;
use hivtac_wire::settings::CameraReport;

/// The kinds of camera that the firmware supports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// OmniVision OV7725: 320 × 240, in colour, rolling shutter, 156 frames a second.
    #[default]
    Ov7725,
    /// OmniVision OV5640: 320 × 240, in colour, rolling shutter, 119 frames a second.
    Ov5640,
    /// onsemi MT9V034: 160 × 152, mono, global shutter, 232 frames a second.
    Mt9v034,
}

impl Kind {
    fn facts(self) -> &'static Facts {
        match self {
            Kind::Ov7725 => &ov7725::FACTS,
            Kind::Ov5640 => &ov5640::FACTS,
            Kind::Mt9v034 => &mt9v034::FACTS,
        }
    }

    /// Its name in the device's hello.
    pub fn name(self) -> &'static str {
        self.facts().name
    }

    /// Its lens and pixels.
    pub fn preset(self) -> Preset {
        match self {
            Kind::Ov7725 => ov7725::PRESET,
            Kind::Ov5640 => ov5640::PRESET,
            Kind::Mt9v034 => mt9v034::PRESET,
        }
    }

    /// The scene's options for the nominal sensor.
    pub fn options(self) -> Options {
        let options = Options::of(self.preset());
        match self {
            Kind::Ov5640 => Options {
                noise: OV5640_NOISE,
                ..options
            },
            Kind::Ov7725 | Kind::Mt9v034 => options,
        }
    }

    /// A scene by its name, of the nominal sensor with these dots. The seed decides the noise.
    ///
    /// # Errors
    /// When there is no such scene, or the film does not take the dots.
    pub fn scene(self, name: &str, layout: Layout, seed: u64) -> Result<Scene, SceneError> {
        let [width, height] = self.size().map(u32::from);
        let options = Options {
            layout,
            ..self.options()
        };
        Scene::preset(name, self.preset(), width, height, seed)?.with_options(options)
    }

    /// Columns and rows of its frames.
    pub fn size(self) -> [u16; 2] {
        match self {
            Kind::Ov7725 => [ov7725::WIDTH, ov7725::HEIGHT],
            Kind::Ov5640 => [ov5640::WIDTH, ov5640::HEIGHT],
            Kind::Mt9v034 => [mt9v034::WIDTH, mt9v034::HEIGHT],
        }
    }

    /// When its rows are exposed.
    pub fn motion(self) -> Motion {
        self.facts().motion
    }

    /// The model of the nominal unit with these dots; with others than four and `8v` the one that
    /// the firmware has built in.
    pub fn model(self, layout: Layout) -> &'static [u8] {
        let is_8v = "8v".parse() == Ok(layout);
        match self {
            Kind::Ov7725 | Kind::Ov5640 if is_8v => {
                include_bytes!("../../../calibration/models/8v/default.hvtm")
            }
            Kind::Ov7725 | Kind::Ov5640 => {
                include_bytes!("../../../calibration/models/default.hvtm")
            }
            Kind::Mt9v034 => include_bytes!("../../../calibration/models/mt9v034/default.hvtm"),
        }
    }

    /// The camera and the unit that a model must fit.
    pub fn fitting(self, device_id: [u8; 12]) -> Fitting {
        let [width, height] = self.size();
        Fitting {
            preset: self.preset(),
            geometry: Geometry::preset(self.preset(), width, height),
            pixels: match self {
                Kind::Ov7725 => ov7725::PIXELS,
                Kind::Ov5640 => ov5640::PIXELS,
                Kind::Mt9v034 => mt9v034::PIXELS,
            },
            device_id,
        }
    }

    fn limits(self) -> CameraLimits {
        self.facts().limits
    }

    /// Time from frame to frame, µs.
    pub fn frame_us(self, rate: Rate) -> u32 {
        (self.facts().frame_us)(rate)
    }

    /// Exposure at which the simulated light exposes the film well with a gain of one, µs: as in
    /// the rig.
    fn well_exposed_us(self) -> f64 {
        match self {
            Kind::Ov7725 => 4_000.0,
            Kind::Ov5640 => 25_300.0,
            Kind::Mt9v034 => 2_000.0,
        }
    }

    /// The times of rows that are exposed one after the other; `None` if all are at once.
    fn rows(self) -> Option<Rolling> {
        match self {
            Kind::Ov7725 => Some(ov7725::ROWS),
            Kind::Ov5640 => Some(ov5640::ROWS),
            Kind::Mt9v034 => None,
        }
    }

    /// Part of a frame's time from its first row to its last.
    fn readout(self) -> f64 {
        match self {
            Kind::Ov7725 => f64::from(ov7725::HEIGHT) / f64::from(ov7725::LINES),
            Kind::Ov5640 => {
                let rows = ov5640::WINDOW[1] / ov5640::SUBSAMPLING;
                f64::from(rows) / f64::from(ov5640::LINES)
            }
            Kind::Mt9v034 => 0.0,
        }
    }
}

/// A camera with its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Its kind.
    pub kind: Kind,
    /// The pixels that it sends.
    pub pixels: PixelFormat,
    settings: CameraSettings,
    /// Exposure of each row, in lines.
    lines: u16,
    gain: Sixteenths,
}

impl Camera {
    /// A camera with these settings in light of a brightness; 1 is nominal.
    pub fn new(kind: Kind, pixels: PixelFormat, settings: CameraSettings, light: f64) -> Self {
        let mut camera = Self {
            kind,
            pixels,
            settings: CameraSettings::default(),
            lines: 1,
            gain: LEAST_GAIN,
        };
        camera.set(settings, light);
        camera
    }

    /// Returns whether the camera can have these settings.
    pub fn accepts(&self, settings: &CameraSettings) -> bool {
        self.kind.limits().check(settings).is_ok()
    }

    /// Applies settings that it [accepts](Self::accepts). Automatic values follow the light:
    /// exposure changes before gain.
    pub fn set(&mut self, settings: CameraSettings, light: f64) {
        self.settings = settings;
        let limits = self.kind.limits().at(settings.rate);
        let wanted_us = self.kind.well_exposed_us() / light.max(1e-3);
        let fixed_gain = settings.gain.unwrap_or(LEAST_GAIN);
        let [shortest, longest] = [limits.shortest, limits.longest].map(|it| self.lines_of(it));
        self.lines = match settings.exposure {
            Some(exposure) => self.lines_of(exposure),
            // The automatic control's register holds whole lines.
            None => {
                let line_us = f64::from(limits.longest.0) / f64::from(longest);
                let wanted_us = 16.0 * wanted_us / f64::from(fixed_gain.0);
                ((wanted_us / line_us) as u16).clamp(shortest, longest)
            }
        };
        self.gain = settings.gain.unwrap_or_else(|| {
            let sixteenths = 16.0 * wanted_us / f64::from(self.exposed().0.max(1));
            Sixteenths((sixteenths.round() as u16).clamp(LEAST_GAIN.0, MOST_GAIN.0))
        });
    }

    /// The number of lines nearest to an exposure.
    fn lines_of(&self, exposure: Microseconds) -> u16 {
        let rate = self.settings.rate;
        match self.kind.rows() {
            Some(rows) => rows.lines_in(exposure, rate),
            None => mt9v034::rows_in(exposure).clamp(1, mt9v034::longest_exposure(rate)),
        }
    }

    /// Lets automatic exposure and gain adapt to the light.
    pub fn expose(&mut self, light: f64) {
        self.set(self.settings, light);
    }

    /// The exposure of each row.
    fn exposed(&self) -> Microseconds {
        match self.kind.rows() {
            Some(rows) => rows.exposed(self.lines.into(), self.settings.rate),
            None => Microseconds(mt9v034::rows_us(self.lines)),
        }
    }

    /// Returns the picture's brightness over that of a well exposed one, in light of a brightness.
    /// A picture within 3 % of well exposed counts as such, as in the rig: exposure has steps.
    pub fn brightness(&self, light: f64) -> f64 {
        let gain = f64::from(self.gain.0) / 16.0;
        let brightness = light * f64::from(self.exposed().0) * gain / self.kind.well_exposed_us();
        let is_close = (brightness - 1.0).abs() < 0.03;
        if is_close { 1.0 } else { brightness }
    }

    /// Returns when each row is exposed.
    pub fn shutter(&self) -> Shutter {
        let frame_s = 1e-6 * f64::from(self.frame_us());
        Shutter {
            exposure_s: 1e-6 * f64::from(self.exposed().0),
            readout_s: frame_s * self.kind.readout(),
        }
    }

    /// Time from frame to frame, µs.
    pub fn frame_us(&self) -> u32 {
        self.kind.frame_us(self.settings.rate)
    }

    /// Time from a frame's begin to the middle of its exposure, µs.
    pub fn middle_us(&self) -> i32 {
        match self.kind.rows() {
            Some(rows) => rows.middle_us(self.lines.into(), self.settings.rate),
            None => mt9v034::middle_us(self.exposed()),
        }
    }

    /// The settings and their limits, for the host.
    pub fn report(&self) -> CameraReport {
        CameraReport {
            settings: self.settings,
            exposure: self.exposed(),
            gain: self.gain,
            limits: self.kind.limits(),
        }
    }

    /// The state for the host. There are no registers to read back.
    pub fn inspection(&self) -> Inspection {
        Inspection {
            silicon: 0,
            camera_id: match self.kind {
                Kind::Ov7725 => ov7725::ID,
                Kind::Ov5640 => ov5640::ID,
                Kind::Mt9v034 => mt9v034::ID,
            },
            registers: 0,
            different: Default::default(),
            frame_time_us: self.frame_us(),
            exposure_us: self.exposed().0,
            longest_exposure_us: self.kind.limits().at(self.settings.rate).longest.0,
            gain_sixteenths: Q::from_bits(self.gain.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(settings: CameraSettings, light: f64) -> Camera {
        Camera::new(Kind::Ov7725, PixelFormat::Rgb565, settings, light)
    }

    #[test]
    fn rates_are_those_of_the_boards() {
        let hz = |kind: Kind| 1e6 / f64::from(kind.frame_us(Rate::Full));
        assert!(
            (hz(Kind::Ov7725) - 156.1).abs() < 0.1,
            "{}",
            hz(Kind::Ov7725)
        );
        assert!(
            (hz(Kind::Mt9v034) - 231.9).abs() < 0.1,
            "{}",
            hz(Kind::Mt9v034)
        );
        assert!(
            (hz(Kind::Ov5640) - 119.1).abs() < 0.1,
            "{}",
            hz(Kind::Ov5640)
        );
    }

    #[test]
    fn an_ov5640_exposes_for_the_whole_frame_and_amplifies() {
        let usual = CameraSettings::default();
        let camera = Camera::new(Kind::Ov5640, PixelFormat::Rgb565, usual, 1.0);
        let shutter = camera.shutter();
        assert!((shutter.exposure_s - 0.00832).abs() < 1e-5, "{shutter:?}");
        assert!((shutter.readout_s - 0.00793).abs() < 3e-4, "{shutter:?}");
        assert!((camera.brightness(1.0) - 1.0).abs() < 0.05, "{camera:?}");
    }

    #[test]
    fn automatic_exposure_suits_the_light_and_fixed_values_stay() {
        let usual = CameraSettings::default();
        for light in [0.3, 1.0, 2.0] {
            let brightness = camera(usual, light).brightness(light);
            assert!((brightness - 1.0).abs() < 0.1, "{light}: {brightness}");
        }
        // Locked at the nominal light, a third of it is a third of the brightness.
        assert!((camera(usual, 1.0).brightness(0.3) - 0.3).abs() < 0.02);
        let fixed = CameraSettings {
            exposure: Some(Microseconds(2_000)),
            gain: Some(Sixteenths(16)),
            ..usual
        };
        let brightness = camera(fixed, 1.0).brightness(1.0);
        assert!((brightness - 0.5).abs() < 0.01, "{brightness}");
    }
}
