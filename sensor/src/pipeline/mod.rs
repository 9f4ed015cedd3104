//! Runs the whole pipeline: rows in, measurements out.

mod again;
mod ahead;
mod following;
mod hanging;
#[cfg(test)]
mod marker_tests;
mod placed;
mod taring;
#[cfg(test)]
mod tests;
mod three;
mod two;

use crate::force::features::Features;
use crate::force::forward::Drift;
use crate::force::model::Model;
use crate::force::network::Network;
use crate::force::rest::Rest;
use crate::force::{self, Force, NoiseLevel, Pairs, Resting};
use crate::known_answer::{self, Answer};
use crate::markers::blob::Blob;
use crate::markers::formats::Formats;
use crate::markers::lost::Lost;
use crate::markers::rules::{Finder, Found, Reading, Trust};
use crate::markers::scanner::Scanner;
use crate::markers::settings::{Settings, SettingsError};
use crate::markers::tables::{ByteTable, Table};
use crate::motion::Motion;
use crate::rezero::Tare;
use crate::temporal::Temporal;
pub use again::Again;
use again::{BLUR, Look};
use ahead::Ahead;
use hivtac_terms::conditions::{CentroidEstimator, ContactReading};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::{Direction, Down};
use hivtac_terms::force::ContactList;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold, ThresholdError};
use hivtac_terms::units::Px;
pub use two::Work;

/// The result of one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Measurement {
    /// Why there is no force, or how far it can be trusted.
    pub status: Status,
    /// The markers where the frame shows them; `None` if they were not all found.
    pub markers: Option<MarkerList>,
    /// Those of the markers that the frame does not show: `markers` has their rest places. Never
    /// one of four dots.
    pub lost: Lost,
    /// Their features at one common time ([`Sensor::set_motion`]); present exactly if there are
    /// markers and none is lost.
    pub features: Option<Features>,
    /// The force; `None` exactly if `status` has a bit of [`Status::NO_FORCE`].
    pub force: Option<Force>,
    /// The two contacts whose sum it is, if two press and are resolved; otherwise empty
    /// ([`Sensor::follow_two_contacts`]).
    pub contacts: ContactList,
}

/// A frame is saturated if more than one pixel in this many is set: four dots set far fewer.
const SATURATED_PART: u32 = 2;

/// From rows to force, for one camera. Keeps up to `BLOBS` blobs of a frame; `T` is the table for
/// RGB565 pixels.
///
/// A sensor holds all its storage, about 76 KiB and the table (64 KiB). Build it where it shall
/// stay: in a `static` as [`Sensor::new`], which is `const`, and [`configure`](Self::configure) it
/// in place. Then nothing large crosses the stack. For each frame call
/// [`begin_frame`](Self::begin_frame), [`push_rows`](Self::push_rows) with all rows from the top,
/// one or more at a time as they arrive, and [`finish_frame`](Self::finish_frame).
#[derive(Clone, Debug)]
pub struct Sensor<'m, const BLOBS: usize = 64, T = ByteTable> {
    settings: Settings,
    model: Option<Model<'m>>,
    tare: Option<Tare>,
    down: Down,
    contact_shape: ContactShape,
    pixels: Formats<T>,
    scanner: Scanner<BLOBS>,
    network: Network,
    /// `None` until it is configured.
    prepared: Option<Prepared>,
    ahead: Ahead,
    motion: Motion,
    noise: NoiseLevel,
    look: Look,
    temporal: Temporal,
    pairs: Pairs,
}

/// Everything that follows from settings, model and tare before there is a frame.
#[derive(Clone, Debug)]
struct Prepared {
    finder: Finder,
    /// `None` without a rest position to compare with.
    trust: Option<Trust>,
    /// `None` without a forward model.
    resting: Option<Resting>,
    /// The status bits that every frame has, whatever it shows.
    standing: Status,
    /// The rest position that frames are measured against.
    rest: Option<Rest>,
    /// The previous frame's result, for a film of another layout.
    before: placed::Before,
    /// This frame's result, from the blobs known until now.
    now: Option<placed::Before>,
}

impl<'m, const BLOBS: usize, T: Table> Sensor<'m, BLOBS, T> {
    /// A sensor that is not configured; its threshold accepts no colour.
    pub const fn new() -> Self {
        Sensor {
            settings: Settings {
                geometry: Geometry::preset(Preset::Ov7725, 320, 240),
                threshold: Threshold::red(PixelFormat::Rgb565),
                byte_order: ByteOrder::Swapped,
                dilations: 1,
                min_area: 1,
                centroid: CentroidEstimator::BinaryMask,
            },
            model: None,
            tare: None,
            down: Down::Fixed,
            contact_shape: ContactShape::Needle,
            pixels: Formats::CLOSED,
            scanner: Scanner::new(),
            network: Network::new(),
            prepared: None,
            ahead: Ahead::Off,
            motion: Motion::GLOBAL,
            noise: NoiseLevel::AS_MODELLED,
            look: Look::First,
            temporal: Temporal::new(),
            pairs: Pairs::NONE,
        }
    }

    /// Sets settings and model, and discards the tare. Without a model there are markers and
    /// features but no force.
    ///
    /// # Errors
    /// A setting out of its range; then nothing is changed.
    pub fn configure(
        &mut self,
        settings: Settings,
        model: Option<Model<'m>>,
    ) -> Result<(), SettingsError> {
        settings.check()?;
        let seen = (settings.threshold, settings.byte_order);
        let is_set = seen == (self.settings.threshold, self.settings.byte_order);
        // A table of RGB565 takes as long as some frames.
        if self.prepared.is_none() || !is_set {
            let set = self.pixels.set(&settings.threshold, settings.byte_order);
            set.map_err(SettingsError::Threshold)?;
        }
        self.settings = settings;
        self.model = model;
        self.set_tare(None, Drift::NONE);
        Ok(())
    }

    /// As [`configure`](Self::configure), but keeps the rest position with its drift and
    /// re-zeroing, if the new settings find markers in the same way.
    ///
    /// # Errors
    /// A setting out of its range; then nothing is changed.
    pub fn reconfigure(
        &mut self,
        settings: Settings,
        model: Option<Model<'m>>,
    ) -> Result<(), SettingsError> {
        let seen = |by: &Settings| (by.threshold.format(), by.dilations, by.centroid);
        let is_alike = seen(&settings) == seen(&self.settings);
        let markers = model.as_ref().map(|model| model.rest.areas.len());
        let holds = |tare: &Tare| {
            is_alike
                && tare.rest().fits(&settings.geometry)
                && markers.is_none_or(|markers| markers == tare.rest().areas.len())
        };
        let tare = self.tare.filter(holds);
        self.configure(settings, model)?;
        self.tare = tare;
        self.begin_anew();
        Ok(())
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The model in use.
    pub fn model(&self) -> Option<&Model<'m>> {
        self.model.as_ref()
    }

    /// The threshold in use.
    pub fn threshold(&self) -> Threshold {
        self.settings.threshold
    }

    /// Sets the threshold, effective from the next row; call it between frames. A model made with a
    /// different threshold then gives no force ([`Status::MODEL_MISMATCH`]).
    ///
    /// # Errors
    /// An invalid threshold; then the old one stays.
    pub fn set_threshold(&mut self, threshold: Threshold) -> Result<(), ThresholdError> {
        self.pixels.set(&threshold, self.settings.byte_order)?;
        self.settings.threshold = threshold;
        self.begin_anew();
        Ok(())
    }

    /// Sets the rest position of this unit, and how far the film may have drifted from it since it
    /// was taken. With `None`, or if it is not [sound](Rest::is_sound), the model's rest position
    /// is used.
    pub fn set_tare(&mut self, rest: Option<Rest>, drift: Drift) {
        self.set_tare_under(rest, drift, self.down.direction());
    }

    /// As [`set_tare`](Self::set_tare), for a rest position that was taken under this gravity;
    /// `None` if the gravity was unknown.
    pub fn set_tare_under(&mut self, rest: Option<Rest>, drift: Drift, down: Option<Direction>) {
        let rest = rest.filter(Rest::is_sound);
        let down = down.map(Direction::to_unit);
        self.tare = rest.map(|rest| Tare::new(rest, drift, down));
        self.begin_anew();
    }

    /// Call when frames will be seen in a different way: earlier frames then say nothing about
    /// them.
    fn begin_anew(&mut self) {
        self.temporal.begin_anew();
        self.pairs = Pairs::NONE;
        if let Some(tare) = &mut self.tare {
            tare.begin_anew();
        }
        self.prepare();
    }

    /// Sets the contact's shape from the next frame on; call it between two frames. A radius
    /// outside [`ContactShape::RADII`] counts as [`ContactShape::Unknown`]. Initially it is
    /// [`ContactShape::Needle`].
    pub fn set_contact_shape(&mut self, shape: ContactShape) {
        let shape = match shape.is_sound() {
            true => shape,
            false => ContactShape::Unknown,
        };
        if shape != self.contact_shape {
            self.pairs = Pairs::NONE;
        }
        self.contact_shape = shape;
        self.apply_contact_shape();
    }

    fn apply_contact_shape(&mut self) {
        let prepared = self.prepared.as_mut();
        if let Some(resting) = prepared.and_then(|prepared| prepared.resting.as_mut()) {
            resting.set_contact_shape(self.contact_shape);
        }
    }

    /// The contact's shape, as far as known.
    pub fn contact_shape(&self) -> ContactShape {
        self.contact_shape
    }

    fn apply_drift(&mut self) {
        let drift = self.tare.as_ref().map_or(&Drift::NONE, Tare::drift);
        let prepared = self.prepared.as_mut();
        if let Some(resting) = prepared.and_then(|prepared| prepared.resting.as_mut()) {
            resting.set_drift(drift);
        }
    }

    /// The model in use, if it was made for these settings.
    fn fitting_model(&self) -> Option<&Model<'m>> {
        let model = self.model.as_ref();
        model.filter(|model| model.conditions.are_of(&self.settings))
    }

    /// The rest position of this unit that is measured against; `None` if none was taken.
    pub fn tare(&self) -> Option<&Rest> {
        self.tare.as_ref().map(Tare::rest)
    }

    /// Sets when each row of a frame is exposed, and discards the previous frame. Initially all
    /// rows are exposed at once.
    pub fn set_motion(&mut self, motion: Motion) {
        self.motion = motion;
    }

    /// Call before a frame that the previous one says nothing about. The motion of the markers, and
    /// the noise between the frames, are then unknown.
    pub fn forget_frame(&mut self) {
        self.pairs = Pairs::NONE;
        self.motion.forget();
        self.noise.forget_frame();
    }

    /// Call before a frame, for frames of the camera that were missed before it. The motion of the
    /// markers is then their mean motion since the previous frame; the noise is unknown.
    pub fn miss_frames(&mut self, frames: u32) {
        self.motion.miss(frames);
        self.noise.forget_frame();
    }

    /// Starts a frame. Of the previous frame only the markers' positions and the residual are kept.
    pub fn begin_frame(&mut self) {
        self.motion.begin_frame();
        self.noise.begin_frame();
        self.look = Look::First;
        // After `configure` there is no error; before it, every frame becomes incomplete.
        let _ = self.scanner.begin(self.settings.scan());
        self.ahead = Ahead::Nothing;
    }

    /// Takes the next row of pixels, as they lie in memory: a `u16` for each, or for two of mono.
    pub fn push_row(&mut self, row: &[u16]) {
        self.scanner.push_row(&self.pixels, row);
        self.look_ahead();
    }

    /// Takes the next rows of pixels, one after the other in memory. Fewer of them are copied than
    /// with single rows.
    pub fn push_rows(&mut self, rows: &[u16]) {
        self.scanner.push_rows(&self.pixels, rows);
        self.look_ahead();
    }

    /// As [`push_rows`](Self::push_rows), without copying ([`Scanner::push_rows_below`]). `above`
    /// holds the last rows, which must still be in memory, one after the other: all of the frame,
    /// or at least [`Settings::dilations`] rows.
    pub fn push_rows_below(&mut self, above: &[u16], rows: &[u16]) {
        self.scanner.push_rows_below(&self.pixels, above, rows);
        self.look_ahead();
    }

    /// Measures a frame in memory: all rows from the top, one after the other. If the frame does
    /// not follow the previous one, call [`forget_frame`](Self::forget_frame) first.
    pub fn measure_frame(&mut self, frame: &[u16]) -> Measurement {
        self.begin_frame();
        self.push_rows(frame);
        self.finish_frame()
    }

    /// As [`measure_frame`](Self::measure_frame), and [looks again](Self::look_again) if that may
    /// help.
    pub fn measure_frame_closely(&mut self, frame: &[u16]) -> Measurement {
        let measurement = self.measure_frame(frame);
        self.measure_again(frame, measurement)
    }

    /// Returns the measurement of a [second look](Self::look_again) at the last frame, if that may
    /// help; otherwise this one.
    pub fn measure_again(&mut self, frame: &[u16], measurement: Measurement) -> Measurement {
        let Some(again) = self.look_again() else {
            return measurement;
        };
        self.push_rows(frame);
        self.finish_again(again)
    }

    /// Ends the frame and returns its measurement.
    pub fn finish_frame(&mut self) -> Measurement {
        let mut measurement = self.measure_scanned();
        self.end_measurement();
        let seen = measurement.markers.as_ref();
        self.motion.ended(seen.map(|seen| (seen, measurement.lost)));
        self.complete(&mut measurement);
        if self.wants_again(&measurement) {
            self.look = Look::Wanted(measurement);
        }
        measurement
    }

    fn measure_scanned(&mut self) -> Measurement {
        if let Err(reason) = self.end_scan() {
            self.begin_measurement();
            return self.measurement(Err(reason));
        }
        if let Some(measurement) = self.ahead.measurement(self.scanner.blobs().len()) {
            return measurement;
        }
        self.measure_blobs()
    }

    /// Returns the measurement of the blobs of the last finished frame.
    fn measure_blobs(&mut self) -> Measurement {
        self.begin_measurement();
        if self.has_other_layout() {
            return self.measure_placed();
        }
        let found = self.find_markers();
        let found = found.map_err(|reason| reason | self.another_layout(reason));
        self.measurement(found)
    }

    /// Discards the state that a measurement ahead of the last blobs left for later frames. They do
    /// not use a second look, which may come too late.
    fn begin_measurement(&mut self) {
        if matches!(self.look, Look::Again) {
            return;
        }
        self.noise.begin_measurement();
        if let Some(prepared) = self.prepared.as_mut() {
            prepared.now = None;
        }
    }

    /// Keeps the state that the frame's measurement left for later frames.
    fn end_measurement(&mut self) {
        self.noise.end_frame();
        if let Some(prepared) = self.prepared.as_mut()
            && let Some(now) = prepared.now.take()
        {
            prepared.before = now;
        }
    }

    /// Returns the measurement of these markers, or of a frame without.
    fn measurement(&mut self, found: Result<Found, Status>) -> Measurement {
        let (seen, mut status) = match &found {
            Ok(found) => (Some(found), Status::OK),
            Err(reason) => (None, *reason),
        };
        let rows = self.settings.geometry.height;
        self.noise
            .set_beside(seen.map_or(0.0, |seen| seen.shift_px2));
        let moved = seen.and_then(|seen| {
            let markers = MarkerList::from(seen.markers);
            let moved = at_the_middle(&self.motion, &mut self.noise, &markers, Lost::NONE, rows)?;
            Some(seen.moved_to(moved.array()))
        });
        let still = moved.as_ref().or(seen);
        match (&self.prepared, still) {
            (None, _) => status |= self.standing_status(),
            (Some(prepared), None) => status |= prepared.standing,
            (Some(prepared), Some(found)) => {
                let trust = prepared.trust.as_ref();
                status |= prepared.standing | trust.map_or(Status::OK, |trust| trust.judge(found));
            }
        }
        let markers = still.map(|still| &still.markers[..]);
        let features = markers.map(Features::of_markers);
        let force = features
            .as_ref()
            .zip(markers)
            .and_then(|(features, markers)| self.measure(features, markers, &mut status));
        Measurement {
            status,
            markers: seen.map(|seen| MarkerList::from(seen.markers)),
            lost: Lost::NONE,
            features,
            force,
            contacts: ContactList::default(),
        }
    }

    /// Returns how pixels are read.
    pub fn pixels(&self) -> &Formats<T> {
        &self.pixels
    }

    /// Returns the blobs of the last finished frame, of at least [`Settings::min_area`] each.
    pub fn blobs(&self) -> &[Blob] {
        self.scanner.blobs()
    }

    /// Computes everything that follows from settings, model and tare.
    fn prepare(&mut self) {
        self.hang();
        self.ahead = Ahead::Off;
        self.look = Look::First;
        self.noise = NoiseLevel::AS_MODELLED;
        let settings = &self.settings;
        // The rest position and contact of a model for other frames do not apply here.
        let fitting = self.fitting_model();
        let rest = self.tare().copied().or_else(|| self.rest_of_model());
        // The tip is the same, whether or not the model is for these frames.
        let reading = self
            .model
            .as_ref()
            .map_or(Reading::of(ContactReading::Force, false), |model| {
                Reading::of(model.conditions.contact, model.output.tells_place())
            });
        let own_rest = self.tare.is_some();
        self.prepared = Some(Prepared {
            finder: Finder::new(settings),
            resting: fitting
                .zip(rest)
                .and_then(|(model, rest)| Resting::of_turned(model, &rest, self.turned())),
            trust: rest.map(|rest| {
                let markers = rest.markers().array();
                Trust::new(settings, &markers, own_rest, reading)
            }),
            standing: self.standing_status(),
            rest,
            before: placed::Before::default(),
            now: None,
        });
        self.apply_drift();
        self.apply_contact_shape();
    }

    fn standing_status(&self) -> Status {
        let mut status = Status::OK;
        if self.tare.is_none() {
            status |= Status::TARE_MISSING;
        }
        if self.is_weight_unknown() {
            status |= Status::WEIGHT_UNKNOWN;
        }
        match &self.model {
            None => status |= Status::MODEL_MISSING,
            Some(model) => {
                if model.is_simulated() {
                    status |= Status::NOT_CALIBRATED;
                }
                let markers = self.tare.as_ref().map(|tare| tare.rest().areas.len());
                let is_of_layout = markers.is_none_or(|count| count == model.rest.areas.len());
                if !model.conditions.are_of(&self.settings) || !is_of_layout {
                    status |= Status::MODEL_MISMATCH;
                }
            }
        }
        status
    }

    /// Ends the scan. Returns the reason as an error if the frame as a whole has no markers.
    fn end_scan(&mut self) -> Result<(), Status> {
        let geometry = &self.settings.geometry;
        let pixels = u32::from(geometry.width) * u32::from(geometry.height);
        let scan = self.scanner.finish(&self.pixels);
        if scan.status != Status::OK {
            return Err(scan.status);
        }
        if scan.set_pixels == 0 {
            return Err(Status::IMAGE_DARK);
        }
        if scan.set_pixels > pixels / SATURATED_PART {
            return Err(Status::IMAGE_SATURATED);
        }
        Ok(())
    }

    /// Returns the model's answer to the question with a known answer. Measuring frames is not
    /// affected.
    pub fn known_answer(&mut self, model: &Model<'_>) -> Answer {
        known_answer::of(model, &mut self.network)
    }

    fn find_markers(&self) -> Result<Found, Status> {
        // Before it is configured, no pixel passes the threshold.
        let prepared = self.prepared.as_ref().ok_or(Status::IMAGE_DARK)?;
        prepared.finder.find(self.scanner.blobs())
    }

    /// Returns the force of a frame's features; `None` if `status` already forbids one.
    fn measure(
        &mut self,
        features: &Features,
        markers: &[Marker],
        status: &mut Status,
    ) -> Option<Force> {
        if status.intersects(Status::NO_FORCE) {
            return None;
        }
        let model = self.model.as_ref()?;
        let prepared = self.prepared.as_ref()?;
        let rest = prepared.rest.as_ref().unwrap_or(&model.rest);
        let output = self.network.run(model, features, &rest.features);
        let resting = prepared.resting.as_ref();
        let (force, trust) = match model.forward.as_ref().zip(resting) {
            Some((forward, resting)) => {
                let is_again = matches!(self.look, Look::Again);
                let blur = if is_again { BLUR } else { Px(0) };
                let noise = self.noise.of_frame(blur);
                let estimate = resting.estimate(forward, markers, noise, &output);
                if !is_again {
                    self.noise.saw(noise, &estimate.left);
                }
                let reported = resting.force_and_status(forward, &model.range, noise, &estimate);
                if !is_again && is_a_press(reported.1) {
                    self.noise.saw_press(noise, &estimate, markers);
                }
                reported
            }
            None => force::of_outputs(model, &output),
        };
        *status |= trust;
        if status.contains(Status::UNEXPLAINED) {
            return None;
        }
        if output.input_saturated {
            *status |= Status::MAGNITUDE_OUT_OF_RANGE;
        }
        Some(force)
    }
}

/// Returns the markers as [`Motion::at_the_middle`] does, and adds the uncertainty by their motion
/// to `noise`.
fn at_the_middle(
    motion: &Motion,
    noise: &mut NoiseLevel,
    seen: &MarkerList,
    lost: Lost,
    rows: u16,
) -> Option<MarkerList> {
    let times = noise.of_frame(Px(0)).times;
    noise.set_motion(motion.unsteadiness(seen, lost, rows, times));
    motion.at_the_middle(seen, lost, rows)
}

/// Whether a force of this status is a contact as the model's, which explains the markers.
fn is_a_press(status: Status) -> bool {
    const NONE_OF: Status = Status(
        Status::LOOSELY_EXPLAINED.0
            | Status::DIRECTION_OUT_OF_RANGE.0
            | Status::MAGNITUDE_OUT_OF_RANGE.0
            | Status::PLACE_OUT_OF_RANGE.0,
    );
    status.contains(Status::CONTACT) && !status.intersects(NONE_OF)
}

impl<const BLOBS: usize, T: Table> Default for Sensor<'_, BLOBS, T> {
    fn default() -> Self {
        Sensor::new()
    }
}
