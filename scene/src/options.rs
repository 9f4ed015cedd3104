//! What makes a frame harder or easier than the default.

use crate::SceneError;

/// How a scene is lit, mounted and disturbed. The default is the nominal sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Brightness of the whole picture, 0 to 4; 1 is nominal. At about 0.3 the default threshold starts to eat the
    /// markers.
    pub gain: f64,
    /// Change of brightness from the picture's middle to its right and lower edge, −1 to 1 each: (0.6, 0) is 160 %
    /// at the right edge and 40 % at the left.
    pub gradient: [f64; 2],
    /// The part of the light that is lost 75° off the optical axis, 0 to 1; it grows with the square of the angle.
    pub falloff: f64,
    /// Standard deviation of the noise of each channel, 0 to 64 of 255 levels.
    pub noise: f64,
    /// Which markers (by identity) have come off.
    pub missing: [bool; 4],
    /// Round patches on the film, painted over the markers in this order.
    pub patches: Vec<Patch>,
    /// How the camera sits.
    pub mounting: Mounting,
}

/// A round patch that moves with the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Where its centre rests on the film, mm, within ±14.
    pub centre_mm: [f64; 2],
    /// Radius, 0.01 to 10 mm; a marker has 0.5 mm.
    pub radius_mm: f64,
    /// Its colour.
    pub paint: Paint,
}

/// The colour of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Paint {
    /// The markers' red: a distracting thing, or a bridge that merges two markers.
    Red,
    /// The film's own colour: cuts what lies beneath.
    Film,
}

/// How far the camera sits from its nominal place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mounting {
    /// Shift of the whole picture, px, within ±200.
    pub shift_px: [f64; 2],
    /// Rotation of the picture about the optical axis, degrees, within ±45; positive turns x towards y.
    pub roll_deg: f64,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            gain: 1.0,
            gradient: [0.0; 2],
            falloff: 0.3,
            noise: 2.5,
            missing: [false; 4],
            patches: Vec::new(),
            mounting: Mounting::default(),
        }
    }
}

impl Options {
    /// # Errors
    /// When a value is outside its range or not a number.
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        within("gain", self.gain, [0.0, 4.0])?;
        within("gradient", self.gradient[0], [-1.0, 1.0])?;
        within("gradient", self.gradient[1], [-1.0, 1.0])?;
        within("falloff", self.falloff, [0.0, 1.0])?;
        within("noise", self.noise, [0.0, 64.0])?;
        within(
            "mounting.shift_px",
            self.mounting.shift_px[0],
            [-200.0, 200.0],
        )?;
        within(
            "mounting.shift_px",
            self.mounting.shift_px[1],
            [-200.0, 200.0],
        )?;
        within("mounting.roll_deg", self.mounting.roll_deg, [-45.0, 45.0])?;
        self.patches.iter().try_for_each(Patch::check)
    }
}

impl Patch {
    fn check(&self) -> Result<(), SceneError> {
        within("patch.centre_mm", self.centre_mm[0], [-14.0, 14.0])?;
        within("patch.centre_mm", self.centre_mm[1], [-14.0, 14.0])?;
        within("patch.radius_mm", self.radius_mm, [0.01, 10.0])
    }
}

fn within(name: &'static str, value: f64, range: [f64; 2]) -> Result<(), SceneError> {
    if value >= range[0] && value <= range[1] {
        return Ok(());
    }
    Err(SceneError::Option { name, value, range })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_allowed() {
        assert_eq!(Options::default().check(), Ok(()));
    }

    #[test]
    fn what_cannot_be_is_named() {
        let mut options = Options {
            gain: f64::NAN,
            ..Options::default()
        };
        assert!(options.check().unwrap_err().to_string().contains("gain"));
        options.gain = 1.0;
        options.patches.push(Patch {
            centre_mm: [0.0; 2],
            radius_mm: -1.0,
            paint: Paint::Red,
        });
        let error = options.check().unwrap_err().to_string();
        assert!(
            error.contains("patch.radius_mm is -1: use 0.01 to 10"),
            "{error}"
        );
    }
}
