//! Measures rendered frames by the pipeline with a model that is not trained: it shows where the
//! pipeline finds the markers, and whether it accepts them for a force.

use std::boxed::Box;
use std::vec::Vec;

use anyhow::{Context, Result, anyhow};
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::{Model, OutputKind};
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::{Measurement, Sensor};
use hivtac_sensor::tare::{Refusal, TareBuilder};
use hivtac_terms::conditions::{CentroidEstimator, ContactReading};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold};
use hivtac_twin::{Contact, Format, Frame, Load, Mechanics, Options, Preset, Scene, SceneError};

use crate::models;

/// Both estimators of a marker's position from pixels.
const ESTIMATORS: [CentroidEstimator; 2] = [
    CentroidEstimator::BinaryMask,
    CentroidEstimator::RednessWeighted,
];

/// Number of frames for a rest position; `hivtac tare` uses at least as many.
const TARE_FRAMES: u16 = 8;

/// The camera and the settings of its pipeline.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Lens and camera.
    pub preset: Preset,
    /// Columns and rows of a frame.
    pub size: [u32; 2],
    /// The camera's pixel format.
    pub format: PixelFormat,
    /// The estimator of positions.
    pub estimator: CentroidEstimator,
    /// The contact reading of the scene and of the model.
    pub contact: Contact,
}

/// The result of the pipeline on a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Detection {
    /// There is a force.
    Trusted {
        /// The largest distance of a marker from its true place, px; infinite if there is no such
        /// marker.
        worst_px: f64,
        /// The distance of the markers' mean from the true mean, px.
        mean_px: f64,
    },
    /// There is no force, for this status's reasons.
    Refused(Status),
}

/// A sensor that was tared on the nominal scene at rest. Its model is for such frames and contacts.
pub struct TaredSensor {
    sensor: Box<Sensor<'static>>,
}

/// Returns views in RGB565 at these sizes, of both cameras: each with both estimators, which see
/// the same frames.
pub fn views(contact: Contact, sizes: &[[u32; 2]]) -> Vec<[View; 2]> {
    let mut views = Vec::new();
    for &size in sizes {
        for preset in [Preset::Ov7725, Preset::Paper] {
            views.push(ESTIMATORS.map(|estimator| View {
                preset,
                size,
                format: PixelFormat::Rgb565,
                estimator,
                contact,
            }));
        }
    }
    views
}

impl View {
    /// The firmware's camera when it sends YUV422.
    pub const YUV422: View = View {
        preset: Preset::Ov7725,
        size: [320, 240],
        format: PixelFormat::Yuv422,
        estimator: CentroidEstimator::RednessWeighted,
        contact: Contact::Force,
    };

    /// Returns the largest allowed error of a marker, px: 0.3 up to QVGA, 0.15 at 800×600, linear
    /// between them. Binary centroids have errors up to 0.35 px at QVGA and 0.25 px at 800×600 even
    /// on nominal frames. They are allowed 0.15 px more.
    pub fn tolerance_px(&self) -> f64 {
        let part = (f64::from(self.size[0]) - 320.0) / (800.0 - 320.0);
        let weighted = 0.3 - 0.15 * part.clamp(0.0, 1.0);
        match self.estimator {
            CentroidEstimator::RednessWeighted => weighted,
            CentroidEstimator::BinaryMask => weighted + 0.15,
        }
    }

    /// Returns the nominal scene with this view's contact reading.
    ///
    /// # Errors
    /// If the frame size is not valid.
    pub fn nominal(&self) -> Result<Scene> {
        let [width, height] = self.size;
        let scene = Scene::preset("rest", self.preset, width, height, 7)?;
        Ok(self.pressed(scene)?)
    }

    /// Returns a scene with this view's contact reading and pixel format. Pictures of a JPEG camera
    /// become RGB565 and are not changed.
    ///
    /// # Errors
    /// If the film cannot take the scene's own load in that reading.
    pub fn pressed(&self, scene: Scene) -> Result<Scene, SceneError> {
        let options = scene.options().clone();
        let film = Mechanics {
            contact: self.contact,
            ..options.film
        };
        let format = match options.format {
            Format::Jpeg { .. } => options.format,
            _ => self.sent(),
        };
        scene.with_options(Options {
            film,
            format,
            ..options
        })
    }

    /// Returns whether this view's camera can take the frames of a scene. JPEG scenes need a view
    /// in RGB565.
    pub fn takes(&self, scene: &Scene) -> bool {
        self.format == PixelFormat::Rgb565 || scene.options().format == self.sent()
    }

    fn sent(&self) -> Format {
        match self.format {
            PixelFormat::Rgb565 => Format::Rgb565,
            PixelFormat::Yuv422 => Format::Yuv422,
            PixelFormat::Mono => Format::Mono,
        }
    }

    fn reading(&self) -> ContactReading {
        match self.contact {
            Contact::Force => ContactReading::Force,
            Contact::Stick => ContactReading::Stick,
            Contact::Slip { .. } => ContactReading::Slip,
        }
    }

    /// Returns a sensor for this view, with a model of presses in the middle.
    ///
    /// # Errors
    /// If the frame size is not valid, or the nominal scene's markers are not found.
    pub fn sensor(&self) -> Result<TaredSensor> {
        self.sensor_with(OutputKind::ForceVector)
    }

    /// As [`Self::sensor`], with a model that gives places.
    ///
    /// # Errors
    /// As [`Self::sensor`].
    pub fn sensor_anywhere(&self) -> Result<TaredSensor> {
        self.sensor_with(OutputKind::ForceAndPlace)
    }

    fn sensor_with(&self, output: OutputKind) -> Result<TaredSensor> {
        let [width, height] = self.size;
        let geometry = Geometry::preset(self.preset, width as u16, height as u16);
        let settings = Settings {
            threshold: Threshold::red(self.format),
            centroid: self.estimator,
            ..Settings::usual(geometry, ByteOrder::Native)
        };
        let mut sensor = Box::new(Sensor::new());
        let configured = sensor.configure(settings, None);
        configured.map_err(|error| anyhow!("{error}"))?;
        let mut tared = TaredSensor { sensor };
        let rest = tared.rest(&self.nominal()?)?;
        let file = models::file_read_so(&settings, rest, self.reading(), output);
        // Leaks a few hundred bytes, which a test keeps to its end.
        let model = Model::parse(Box::leak(file.into_boxed_slice()))?;
        let configured = tared.sensor.configure(settings, Some(model));
        configured.map_err(|error| anyhow!("{error}"))?;
        tared.sensor.set_tare(Some(rest), Drift::NONE);
        Ok(tared)
    }
}

impl TaredSensor {
    /// Returns a sensor with a committed model, tared on the nominal scene of its camera.
    ///
    /// # Errors
    /// If the file is not a model, or the nominal scene's markers are not found.
    pub fn of_model(file: Vec<u8>) -> Result<TaredSensor> {
        // Leaks some tens of kilobytes, which a test keeps to its end.
        let model = Model::parse(Box::leak(file.into_boxed_slice()))?;
        let geometry = &model.conditions.geometry;
        let (width, height) = (geometry.width.into(), geometry.height.into());
        let scene = Scene::preset("rest", model.conditions.preset, width, height, 7)?;
        Self::on(model, &scene)
    }

    /// Returns a sensor with a committed model of this scene's layout, tared on that scene.
    ///
    /// # Errors
    /// As [`Self::of_model`].
    pub fn of_model_on(file: Vec<u8>, scene: &Scene) -> Result<TaredSensor> {
        Self::on(Model::parse(Box::leak(file.into_boxed_slice()))?, scene)
    }

    fn on(model: Model<'static>, scene: &Scene) -> Result<TaredSensor> {
        let mut sensor = Box::new(Sensor::new());
        let settings = model.conditions.settings(ByteOrder::Native);
        let configured = sensor.configure(settings, Some(model));
        configured.map_err(|error| anyhow!("{error}"))?;
        let mut tared = TaredSensor { sensor };
        let rest = tared.rest(scene)?;
        tared.sensor.set_tare(Some(rest), Drift::NONE);
        Ok(tared)
    }

    /// Sets the contact's shape.
    pub fn set_contact_shape(&mut self, shape: ContactShape) {
        self.sensor.set_contact_shape(shape);
    }

    /// Returns the rest position of a scene's markers.
    fn rest(&mut self, scene: &Scene) -> Result<Rest> {
        let frames = (0..).map_while(|number| scene.render_load(&Load::REST, number).ok());
        let rest = self.tare(TARE_FRAMES, frames)?;
        rest.map_err(|refusal| anyhow!("no rest position: {refusal:?}"))
    }

    /// Tares on frames (a given number must be good) and keeps the rest position.
    ///
    /// # Errors
    /// If the frames end before there is an outcome.
    pub fn tare(
        &mut self,
        wanted: u16,
        frames: impl IntoIterator<Item = Frame>,
    ) -> Result<Result<Rest, Refusal>> {
        let mut tare = TareBuilder::new(wanted).context("a number of frames")?;
        for frame in frames {
            let measurement = self.sensor.measure_frame(&frame.words());
            if let Some(outcome) = self.sensor.tare_with(&mut tare, &measurement) {
                self.sensor.set_tare(outcome.ok(), Drift::NONE);
                return Ok(outcome);
            }
        }
        Err(anyhow!("too few frames that show markers"))
    }

    /// Removes the rest position, as for another unit.
    pub fn forget_tare(&mut self) {
        self.sensor.set_tare(None, Drift::NONE);
    }

    /// Sets the direction of gravity from now on.
    pub fn set_down(&mut self, down: Down) {
        self.sensor.set_down(down);
    }

    /// Keeps the rest position alone, and discards the state of earlier frames.
    pub fn begin_anew(&mut self) {
        let rest = self.sensor.tare().copied();
        self.sensor.set_tare(rest, Drift::NONE);
    }

    /// Keeps the rest position, but marks it as confirmed by no frame.
    pub fn tared_at_another_time(&mut self) {
        let rest = self.sensor.tare().copied();
        self.sensor.set_tare(rest, Drift::UNSEEN);
    }

    /// Runs the whole pipeline on a frame without a predecessor, with a second look if the frame is
    /// refused.
    pub fn sense(&mut self, frame: &Frame) -> Measurement {
        self.sensor.forget_frame();
        self.sense_next(frame)
    }

    /// As [`Self::sense`], for a frame that follows the previous one.
    pub fn sense_next(&mut self, frame: &Frame) -> Measurement {
        self.sensor.measure_frame_closely(&frame.words())
    }

    /// As [`Self::sense`], from bands of `rows` rows. Two bands are in memory at a time, as on the
    /// microcontroller.
    pub fn sense_in_bands(&mut self, frame: &Frame, rows: usize) -> Measurement {
        self.sensor.forget_frame();
        self.sense_next_in_bands(frame, rows)
    }

    /// As [`Self::sense_in_bands`], for a frame that follows the previous one.
    pub fn sense_next_in_bands(&mut self, frame: &Frame, rows: usize) -> Measurement {
        let (words, sensor) = (frame.words(), &mut self.sensor);
        let length = words.len() / usize::from(sensor.settings().geometry.height) * rows;
        let push = |sensor: &mut Sensor<'_>| {
            let mut above: &[u16] = &[];
            for band in words.chunks(length) {
                sensor.push_rows_below(above, band);
                above = band;
            }
        };
        sensor.begin_frame();
        push(sensor);
        let measurement = sensor.finish_frame();
        let Some(again) = sensor.look_again() else {
            return measurement;
        };
        push(sensor);
        sensor.finish_again(again)
    }

    /// Returns the result of the pipeline on a frame.
    pub fn detect(&mut self, frame: &Frame) -> Detection {
        let seen = self.sense(frame);
        let markers = match seen.markers {
            Some(markers) if !seen.status.intersects(Status::NO_FORCE) => markers,
            _ => return Detection::Refused(seen.status),
        };
        let (mut worst_px, mut sum) = (0.0f64, [0.0, 0.0]);
        for (marker, truth) in markers.iter().zip(&frame.truth.markers) {
            let [x, y] = truth.map_or([f64::INFINITY; 2], |truth| truth.centroid_px);
            let (dx, dy) = (marker.x.to_f64() - x, marker.y.to_f64() - y);
            worst_px = worst_px.max(dx.hypot(dy));
            sum = [sum[0] + dx, sum[1] + dy];
        }
        let mean_px = f64::hypot(sum[0], sum[1]) / 4.0;
        Detection::Trusted { worst_px, mean_px }
    }
}

impl Detection {
    /// Returns the largest distance of a marker from its true place, px; `None` without a force.
    pub fn worst_px(&self) -> Option<f64> {
        match self {
            Detection::Trusted { worst_px, .. } => Some(*worst_px),
            Detection::Refused(_) => None,
        }
    }
}
