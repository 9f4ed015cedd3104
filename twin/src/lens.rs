//! The lens, the camera's mounting and the shutter.

use crate::SceneError;
use crate::options::{all_within, within};

/// How the lens images a point of the film.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Lens {
    /// How an angle becomes a distance in the picture.
    pub projection: Projection,
    /// How a disc is imaged.
    pub discs: Discs,
    /// Pixel pitch at this frame size, 1 to 50 µm; `None` means the preset's.
    pub pitch_um: Option<f64>,
    /// Standard deviation of the blur of every point, 0 to 20 px, from the lens's faults and a
    /// wrong focus.
    pub blur_px: f64,
    /// Diameter of the entrance pupil, 0 to 2.1 mm: 2.1 mm divided by the F-number. It blurs points
    /// nearer or farther than [`Self::focus_mm`]; 0 blurs none.
    pub aperture_mm: f64,
    /// The distance in focus, from the pinhole along the axis, 1 to 1000 mm.
    pub focus_mm: f64,
}

/// The relation between the angle θ off the axis and the distance r from the axis in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(rename_all = "lowercase"))]
pub enum Projection {
    /// r = f·θ: the sensor's fisheye.
    #[default]
    Equidistant,
    /// r = f·tan θ: a lens without distortion.
    Pinhole,
}

impl Projection {
    /// Returns the name in files: `equidistant` or `pinhole`.
    pub fn name(self) -> &'static str {
        match self {
            Projection::Equidistant => "equidistant",
            Projection::Pinhole => "pinhole",
        }
    }
}

/// How a disc is imaged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(rename_all = "kebab-case"))]
pub enum Discs {
    /// The image of all its points.
    #[default]
    Whole,
    /// The same shape, but with its centroid at the image of the disc's centre, as in a calculation
    /// with points.
    ByCentre,
}

/// The shift and roll of the camera from its nominal place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Mounting {
    /// Shift of the whole picture (the optical centre), px, within ±200.
    pub shift_px: [f64; 2],
    /// Rotation of the picture about the optical axis, degrees, within ±45. Positive turns x
    /// towards y.
    pub roll_deg: f64,
}

/// When each row is exposed. [`crate::Options::gain`] alone sets the brightness: cameras compensate
/// for the exposure time.
///
/// A frame's time is the middle of the exposure of its middle row. Each whole disc is imaged at the
/// time of the row in which it appears. A marker is 13 to 32 rows high; a motion by a pixel within
/// a few rows' time would tear the film.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(default, deny_unknown_fields))]
pub struct Shutter {
    /// Exposure time of each row, 0 to 1 s. Motion during it is smeared.
    pub exposure_s: f64,
    /// Time from the exposure of the first row to that of a row just below the last, 0 to 0.1 s; 0
    /// is a global shutter. The OV7725 has a rolling shutter: 5.5 ms for its 240 rows at 156 frames
    /// per second.
    pub readout_s: f64,
}

impl Default for Lens {
    /// Returns the presets' fisheye, sharp at every distance.
    fn default() -> Lens {
        Lens {
            projection: Projection::Equidistant,
            discs: Discs::Whole,
            pitch_um: None,
            blur_px: 0.0,
            aperture_mm: 0.0,
            focus_mm: 8.0,
        }
    }
}

impl Lens {
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        if let Some(pitch_um) = self.pitch_um {
            within("pitch_um", pitch_um, [1.0, 50.0])?;
        }
        within("blur_px", self.blur_px, [0.0, 20.0])?;
        within("aperture_mm", self.aperture_mm, [0.0, 2.1])?;
        within("focus_mm", self.focus_mm, [1.0, 1000.0])
    }

    /// Returns the standard deviation, px, of the blur of a point at an axial distance in mm, for a
    /// focal length in px. At most 20 px.
    ///
    /// Through a pupil of diameter A, a point at distance Z is a disc of angular diameter A·|1/Z −
    /// 1/Z₀| if Z₀ is in focus. Along each direction the standard deviation of a uniform disc is a
    /// quarter of its diameter.
    pub(crate) fn blur_px_at(&self, distance_mm: f64, focal_px: f64) -> f64 {
        let vergence = (1.0 / distance_mm.max(0.1) - 1.0 / self.focus_mm).abs();
        let defocus_px = focal_px * self.aperture_mm * vergence / 4.0;
        (self.blur_px * self.blur_px + defocus_px * defocus_px)
            .sqrt()
            .min(20.0)
    }
}

impl Mounting {
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        all_within("shift_px", self.shift_px, [-200.0, 200.0])?;
        within("roll_deg", self.roll_deg, [-45.0, 45.0])
    }
}

/// Number of images of a disc during one exposure, if there is an exposure time.
const INSTANTS: u32 = 5;

impl Shutter {
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        within("exposure_s", self.exposure_s, [0.0, 1.0])?;
        within("readout_s", self.readout_s, [0.0, 0.1])
    }

    /// Iterates over the moments of the exposure of a row, s from the frame's time. `below` is the
    /// row's distance below the middle row as a part of the frame's height.
    pub(crate) fn instants(&self, below: f64) -> impl Iterator<Item = f64> {
        let count = if self.exposure_s > 0.0 { INSTANTS } else { 1 };
        let (middle_s, exposure_s) = (below * self.readout_s, self.exposure_s);
        (0..count).map(move |i| {
            let part = (f64::from(i) + 0.5) / f64::from(count) - 0.5;
            middle_s + exposure_s * part
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_focus_has_the_lens_blur_only() {
        let lens = Lens {
            blur_px: 0.7,
            aperture_mm: 0.75,
            ..Lens::default()
        };
        assert_eq!(lens.blur_px_at(8.0, 175.0), 0.7);
        // 175 px · 0.75 mm · (1/5 − 1/8)/mm = 9.84 px across.
        let near = lens.blur_px_at(5.0, 175.0);
        assert!((near - (0.49_f64 + 2.4609 * 2.4609).sqrt()).abs() < 1e-3);
        assert_eq!(Lens::default().blur_px_at(3.0, 175.0), 0.0);
    }

    #[test]
    fn an_exposure_lies_around_its_rows_time() {
        let shutter = Shutter {
            exposure_s: 0.01,
            readout_s: 0.02,
        };
        let instants: Vec<f64> = shutter.instants(0.1).collect();
        assert_eq!(instants.len(), 5);
        assert!((instants.iter().sum::<f64>() / 5.0 - 0.002).abs() < 1e-15);
        assert!((instants[4] - instants[0] - 0.008).abs() < 1e-15);
        assert_eq!(Shutter::default().instants(0.1).collect::<Vec<_>>(), [0.0]);
    }
}
