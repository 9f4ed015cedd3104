//! Brings a new threshold into use between two frames: at once, or, if it has a different pixel
//! format, with the first frame of that format. Until then the previous threshold stays.

use crate::camera::Format;
use crate::capture_task;
use crate::dtcm_table::Sensor;
use crate::session::Origin;
use hivtac_terms::threshold::Threshold;
use hivtac_wire::message::Outcome;

/// The threshold that waits for the camera's pixels, if any, and who requested it.
pub struct NextThreshold(Option<(Origin, Threshold)>);

impl NextThreshold {
    /// No threshold waits.
    pub const NONE: Self = Self(None);

    /// Takes an unchecked threshold for the command `id`, while frames have the pixel format of
    /// `sensor`'s threshold. Brings it into use, or requests its pixel format from the camera.
    /// Returns whether it is in use.
    ///
    /// # Errors
    /// Why it is refused: a threshold already waits, it is invalid, or the camera does not send its
    /// pixel format.
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
        self.begin(Origin::by(id), threshold, format);
        Ok(false)
    }

    /// Makes a threshold of a different pixel format wait for the first frame of that format, for a
    /// command. Returns false if a threshold already waits, or the camera does not send the format.
    pub fn wait_for(&mut self, origin: Origin, threshold: Threshold) -> bool {
        let format = Format::of(threshold.format()).filter(|_| self.0.is_none());
        if let Some(format) = format {
            self.begin(origin, threshold, format);
        }
        format.is_some()
    }

    fn begin(&mut self, origin: Origin, threshold: Threshold, format: Format) {
        self.0 = Some((origin, threshold));
        capture_task::request_format(format);
    }

    /// Brings the waiting threshold into use, once the camera sends its pixels. Returns who
    /// requested it; `None` if no threshold waits.
    pub fn come_into_use(&mut self, sensor: &mut Sensor) -> Option<Origin> {
        let (origin, threshold) = self.0.take()?;
        // It was checked when it came.
        let _ = sensor.set_threshold(threshold);
        Some(origin)
    }
}
