//! The options of a scene, which make a frame harder or easier than the default.

use crate::bayer;
use crate::film::{Dots, Layout};
use crate::{Format, Lens, Mechanics, Mounting, Patch, Preset, PresetCamera, SceneError, Shutter};
use crate::{Paint, Room, Specks};

/// How a scene is lit, mounted, exposed and disturbed. The default is the nominal sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How the camera codes its pixels.
    pub format: Format,
    /// Brightness of the whole picture, 0 to 4; 1 is nominal. At about 0.3 the default threshold
    /// starts to cut parts off the markers.
    pub gain: f64,
    /// Change of brightness from the picture's middle to its right and lower edge, −1 to 1 each:
    /// (0.6, 0) is 160 % at the right edge and 40 % at the left.
    pub gradient: [f64; 2],
    /// The part of the light that is lost 75° off the optical axis, 0 to 1. It grows with the
    /// square of the angle. A usual lens loses 0.3, which has no effect on a centroid.
    pub falloff: f64,
    /// Veiling light on the whole picture, −64 to 255 levels at a gain of 1: stray light that
    /// washes out colours. Below 0 it is a black level that the camera has set too high.
    pub haze: f64,
    /// Gain of red, green and blue, 0 to 4 each: (1, 1, 1) is the balance that makes the film
    /// nearly grey.
    pub white_balance: [f64; 3],
    /// Distance from the pinhole back to a camera board whose LEDs a glossy film mirrors, 4 to 30
    /// mm; `None` for a matt film, or LEDs that are off.
    pub board_leds_mm: Option<f64>,
    /// The room behind the film.
    pub room: Room,
    /// Standard deviation of a fixed pattern of brightness from pixel to pixel, 0 to 0.5 of the
    /// brightness: the film's grain and the sensor's uneven pixels.
    pub texture: f64,
    /// Standard deviation of the noise of each channel, 0 to 64 of 255 levels.
    pub noise: f64,
    /// Whether each pixel sees one colour only. The camera has four times as many as a frame: it
    /// averages four of a colour, and interpolates the others. The noise is then that of an
    /// average. It has no effect in [`Format::Mono`].
    pub bayer: bool,
    /// Pixels that show a colour of their own; different ones in each frame.
    pub salt: Salt,
    /// The markers at rest: how many, where and how large.
    pub layout: Layout,
    /// The parts of the film's answer that are used.
    pub film: Mechanics,
    /// Weights, 0 to 1, of red, green and blue in a camera of [`Format::Mono`]. (0, 1, 0) is green
    /// light or a green filter.
    pub mono: [f64; 3],
    /// The paint of the markers.
    pub markers: Paint,
    /// Markers (by identity) that came off.
    pub missing: Dots<bool>,
    /// Each marker's shift from its place (by identity), mm along x and y, −1 to 1 each.
    pub glued_mm: Dots<[f64; 2]>,
    /// Each marker's motion (by identity), mm along x, y and z, −8 to 8 each, in place of the
    /// film's; `None` where the film moves them. The shutter then takes no time.
    pub moved_mm: Option<Dots<[f64; 3]>>,
    /// Round patches on the film, painted over the markers in this order.
    pub patches: Vec<Patch>,
    /// Red specks all over the film, under the markers.
    pub specks: Specks,
    /// Side of the squares of a checkerboard of film and markers' red in the whole picture, 0 to
    /// 400 px; 0 means no checkerboard.
    pub checkerboard_px: u32,
    /// How the lens images a point.
    pub lens: Lens,
    /// Shift and roll of the camera.
    pub mounting: Mounting,
    /// When each row is exposed.
    pub shutter: Shutter,
}

/// Pixels that show a colour of their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Salt {
    /// The part of all pixels, 0 to 1.
    pub fraction: f64,
    /// Their colour, in the light of the picture's middle.
    pub paint: Paint,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            format: Format::default(),
            gain: 1.0,
            gradient: [0.0; 2],
            falloff: 0.0,
            haze: 0.0,
            white_balance: [1.0; 3],
            board_leds_mm: None,
            room: Room::default(),
            texture: 0.0,
            noise: 2.5,
            bayer: false,
            salt: Salt {
                fraction: 0.0,
                paint: Paint::Red,
            },
            layout: Layout::default(),
            film: Mechanics::default(),
            mono: [0.0, 1.0, 0.0],
            markers: Paint::Red,
            missing: [false; 4].into(),
            glued_mm: [[0.0; 2]; 4].into(),
            moved_mm: None,
            patches: Vec::new(),
            specks: Specks::default(),
            checkerboard_px: 0,
            lens: Lens::default(),
            mounting: Mounting::default(),
            shutter: Shutter::default(),
        }
    }
}

/// Noise of an OV5640's picture where an OV7725's is 2.5, in the light that exposes that one for 4
/// ms. A pixel of the picture collects light on 26.5 µm² of its chip, instead of 144, for 8.3 ms:
/// 0.38 times the electrons.
pub const OV5640_NOISE: f64 = 4.0;

impl Options {
    /// Returns the options of the nominal sensor of a preset.
    pub fn of(preset: Preset) -> Options {
        Options {
            format: preset.usual_format(),
            markers: preset.usual_markers(),
            ..Options::default()
        }
    }

    /// The camera's own pixels along one of the frame.
    pub(crate) fn finer(&self) -> u32 {
        match self.bayer && self.format != Format::Mono {
            true => bayer::FINER,
            false => 1,
        }
    }

    /// # Errors
    /// If a value is outside its range or not a number.
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        #[cfg(feature = "jpeg")]
        if let Format::Jpeg { quality } = self.format {
            within("jpeg_quality", f64::from(quality), [1.0, 100.0])?;
        }
        within("gain", self.gain, [0.0, 4.0])?;
        all_within("gradient", self.gradient, [-1.0, 1.0])?;
        within("falloff", self.falloff, [0.0, 1.0])?;
        within("haze", self.haze, [-64.0, 255.0])?;
        all_within("white_balance", self.white_balance, [0.0, 4.0])?;
        all_within("mono", self.mono, [0.0, 1.0])?;
        if let Some(board_mm) = self.board_leds_mm {
            within("board_leds_mm", board_mm, [4.0, 30.0])?;
        }
        self.room.check()?;
        within("texture", self.texture, [0.0, 0.5])?;
        within("noise", self.noise, [0.0, 64.0])?;
        within("salt", self.salt.fraction, [0.0, 1.0])?;
        within(
            "checkerboard_px",
            f64::from(self.checkerboard_px),
            [0.0, 400.0],
        )?;
        for place in self.glued_mm {
            all_within("glued_mm", place, [-1.0, 1.0])?;
        }
        for way in self.moved_mm.into_iter().flatten() {
            all_within("moved_mm", way, [-8.0, 8.0])?;
        }
        self.film.creep.check()?;
        self.patches.iter().try_for_each(Patch::check)?;
        self.specks.check()?;
        self.lens.check()?;
        self.mounting.check()?;
        self.shutter.check()
    }
}

pub(crate) fn within(name: &'static str, value: f64, range: [f64; 2]) -> Result<(), SceneError> {
    if value >= range[0] && value <= range[1] {
        return Ok(());
    }
    Err(SceneError::Option { name, value, range })
}

pub(crate) fn all_within<const N: usize>(
    name: &'static str,
    values: [f64; N],
    range: [f64; 2],
) -> Result<(), SceneError> {
    values
        .into_iter()
        .try_for_each(|value| within(name, value, range))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_allowed() {
        assert_eq!(Options::default().check(), Ok(()));
    }

    /// Returns the error message for the default with one change.
    fn said_of(change: impl Fn(&mut Options)) -> String {
        let mut options = Options::default();
        change(&mut options);
        options.check().unwrap_err().to_string()
    }

    #[test]
    fn what_cannot_be_is_named() {
        assert!(said_of(|o| o.gain = f64::NAN).contains("gain"));
        let said = said_of(|o| {
            o.patches.push(Patch {
                centre_mm: [0.0; 2],
                radius_mm: -1.0,
                paint: Paint::Red,
            });
        });
        assert!(said.contains("radius_mm is -1: use 0.01 to 10"), "{said}");
        for (said, name) in [
            (said_of(|o| o.gradient[1] = 1.5), "gradient"),
            (said_of(|o| o.haze = -65.0), "haze"),
            (said_of(|o| o.board_leds_mm = Some(3.0)), "board_leds_mm"),
            (said_of(|o| o.room.transmission = 1.1), "transmission"),
            (said_of(|o| o.room.brightness = -0.1), "brightness"),
            (said_of(|o| o.room.finger_mm = 11.0), "finger_mm"),
            (said_of(|o| o.white_balance[2] = 5.0), "white_balance"),
            (said_of(|o| o.mono[0] = 1.5), "mono"),
            (said_of(|o| o.texture = f64::INFINITY), "texture"),
            (said_of(|o| o.salt.fraction = 1.1), "salt"),
            (said_of(|o| o.checkerboard_px = 401), "checkerboard_px"),
            (said_of(|o| o.glued_mm[3][1] = -1.1), "glued_mm"),
            (said_of(|o| o.film.creep.parts[0] = 0.2), "parts"),
            (said_of(|o| o.film.creep.times_s[1] = 0.0), "times_s"),
            (said_of(|o| o.specks.count = 100_001), "specks"),
            (said_of(|o| o.specks.radius_mm = 0.0), "speck_radius_mm"),
            (said_of(|o| o.lens.blur_px = 21.0), "blur_px"),
            (said_of(|o| o.lens.pitch_um = Some(0.5)), "pitch_um"),
            (said_of(|o| o.lens.aperture_mm = 3.0), "aperture_mm"),
            (said_of(|o| o.lens.focus_mm = 0.0), "focus_mm"),
            (said_of(|o| o.mounting.shift_px[0] = 300.0), "shift_px"),
            (said_of(|o| o.mounting.roll_deg = 50.0), "roll_deg"),
            (said_of(|o| o.shutter.exposure_s = -0.1), "exposure_s"),
            (said_of(|o| o.shutter.readout_s = 0.2), "readout_s"),
        ] {
            assert!(said.contains(name), "{name}: {said}");
        }
        #[cfg(feature = "jpeg")]
        assert!(said_of(|o| o.format = Format::Jpeg { quality: 0 }).contains("jpeg_quality"));
    }
}
