//! A new threshold on its way: it comes into use between two frames, at once, or, when it is of
//! another pixel format, with the first frame of that format. Until then the one before serves.

use crate::camera::Format;
use crate::capture_task;
use crate::dtcm_table::Sensor;
use crate::session::Asked;
use hivtac_terms::threshold::Threshold;
use hivtac_wire::message::Outcome;

/// The threshold that waits for the camera's pixels, if any, and who asked for it.
pub struct NextThreshold(Option<(Asked, Threshold)>);

impl NextThreshold {
    /// None waits.
    pub const NONE: Self = Self(None);

    /// Takes a threshold, as it came, for the command `id`, while frames have the pixels of
    /// `sensor`'s threshold: brings it into use, or asks the camera for its pixels. Tells whether
    /// it is in use.
    ///
    /// # Errors
    /// Why it is refused: another one waits, it means nothing, or the camera does not send such
    /// pixels.
    pub fn take(
        &mut self,
        id: u16,
        threshold: Threshold,
        sensor: &mut Sensor,
    ) -> Result<bool, Outcome> {
        if self.0.is_some() {
            return Err(Outcome::Busy);
        }
        threshold.check().map_err(|_| Outcome::InvalidArgument)?;
        let format = Format::of(threshold.format()).ok_or(Outcome::Unsupported)?;
        if threshold.format() == sensor.threshold().format() {
            // It was checked.
            let _ = sensor.set_threshold(threshold);
            return Ok(true);
        }
        self.begin(Asked::by(id), threshold, format);
        Ok(false)
    }

    /// Has a threshold of other pixels come into use with the first frame of them, for a command;
    /// false when another one waits, or the camera does not send such pixels.
    pub fn wait_for(&mut self, asked: Asked, threshold: Threshold) -> bool {
        let format = Format::of(threshold.format()).filter(|_| self.0.is_none());
        if let Some(format) = format {
            self.begin(asked, threshold, format);
        }
        format.is_some()
    }

    fn begin(&mut self, asked: Asked, threshold: Threshold, format: Format) {
        self.0 = Some((asked, threshold));
        capture_task::request_format(format);
    }

    /// Brings the threshold that waited into use: the camera sends its pixels now. Tells who asked
    /// for it.
    pub fn come_into_use(&mut self, sensor: &mut Sensor) -> Option<Asked> {
        let (asked, threshold) = self.0.take()?;
        // It was checked when it came.
        let _ = sensor.set_threshold(threshold);
        Some(asked)
    }
}
