//! Rendered frames, measured by the pipeline with a model that knows nothing of forces: where it
//! finds the markers, and whether it would trust them with a force.

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
use hivtac_terms::down::Down;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold};
use hivtac_twin::{Contact, Format, Frame, Load, Mechanics, Options, Preset, Scene, SceneError};

use crate::models;

/// Both ways to take a position from pixels.
const ESTIMATORS: [CentroidEstimator; 2] = [
    CentroidEstimator::BinaryMask,
    CentroidEstimator::RednessWeighted,
];

/// Frames that make a rest position, as many as `hivtac tare` takes at least.
const TARE_FRAMES: u16 = 8;

/// The camera and the pipeline behind it.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Lens and camera.
    pub preset: Preset,
    /// Columns and rows of a frame.
    pub size: [u32; 2],
    /// How the camera codes pixels.
    pub format: PixelFormat,
    /// How positions are taken.
    pub estimator: CentroidEstimator,
    /// What presses, and the reading of the model.
    pub contact: Contact,
}

/// What was made of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Detection {
    /// A force would be given.
    Trusted {
        /// The largest distance of a marker from its true place, px; infinite when there is no such
        /// marker.
        worst_px: f64,
        /// The distance of the markers' mean from the true one, px.
        mean_px: f64,
    },
    /// There is no force, for these reasons.
    Refused(Status),
}

/// A sensor that was tared on the nominal scene at rest. Its model is for such frames and such a
/// contact.
pub struct TaredSensor {
    sensor: Box<Sensor<'static>>,
}

/// RGB565 at these sizes, of both cameras: by both estimators, which see the same frames.
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

    /// How far a marker may be from the truth, px: 0.3 up to QVGA, 0.15 at 800×600, linear between
    /// them. Binary centroids are themselves off by up to 0.35 px at QVGA and 0.25 px at 800×600 on
    /// nominal frames, so that 0.15 px more are allowed to them.
    pub fn tolerance_px(&self) -> f64 {
        let part = (f64::from(self.size[0]) - 320.0) / (800.0 - 320.0);
        let weighted = 0.3 - 0.15 * part.clamp(0.0, 1.0);
        match self.estimator {
            CentroidEstimator::RednessWeighted => weighted,
            CentroidEstimator::BinaryMask => weighted + 0.15,
        }
    }

    /// The nominal scene, pressed in this view's way.
    ///
    /// # Errors
    /// When the frame size is not one.
    pub fn nominal(&self) -> Result<Scene> {
        let [width, height] = self.size;
        let scene = Scene::preset("rest", self.preset, width, height, 7)?;
        Ok(self.pressed(scene)?)
    }

    /// A scene in which loads press in this view's way and whose camera sends this view's format; a
    /// JPEG camera's pictures become RGB565, and are left as they are.
    ///
    /// # Errors
    /// When the film cannot take the scene's own load so.
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

    /// Whether this view's camera can take the frames of a scene: of JPEG only where it sends
    /// RGB565.
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

    /// A sensor for this view, with a model of presses in the middle.
    ///
    /// # Errors
    /// When the frame size is not one, or the nominal scene is not found.
    pub fn sensor(&self) -> Result<TaredSensor> {
        self.sensor_with(OutputKind::ForceVector)
    }

    /// The same with a model that tells places.
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
        // A few hundred bytes that a test keeps to its end.
        let model = Model::parse(Box::leak(file.into_boxed_slice()))?;
        let configured = tared.sensor.configure(settings, Some(model));
        configured.map_err(|error| anyhow!("{error}"))?;
        tared.sensor.set_tare(Some(rest), Drift::NONE);
        Ok(tared)
    }
}

impl TaredSensor {
    /// A sensor with a committed model, tared on the nominal scene of its camera.
    ///
    /// # Errors
    /// When the file is no model's, or the nominal scene is not found.
    pub fn of_model(file: Vec<u8>) -> Result<TaredSensor> {
        // Some tens of kilobytes that a test keeps to its end.
        let model = Model::parse(Box::leak(file.into_boxed_slice()))?;
        let geometry = &model.conditions.geometry;
        let (width, height) = (geometry.width.into(), geometry.height.into());
        let preset = model.conditions.preset;
        let mut sensor = Box::new(Sensor::new());
        let settings = model.conditions.settings(ByteOrder::Native);
        let configured = sensor.configure(settings, Some(model));
        configured.map_err(|error| anyhow!("{error}"))?;
        let mut tared = TaredSensor { sensor };
        let rest = tared.rest(&Scene::preset("rest", preset, width, height, 7)?)?;
        tared.sensor.set_tare(Some(rest), Drift::NONE);
        Ok(tared)
    }

    /// Where the markers of a scene rest.
    fn rest(&mut self, scene: &Scene) -> Result<Rest> {
        let frames = (0..).map_while(|number| scene.render_load(&Load::REST, number).ok());
        let rest = self.tare(TARE_FRAMES, frames)?;
        rest.map_err(|refusal| anyhow!("no rest position: {refusal:?}"))
    }

    /// Tares on frames, of which so many are to be good, and keeps the rest position.
    ///
    /// # Errors
    /// When the frames end before there is an outcome.
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

    /// Another unit: there is no rest position of it.
    pub fn forget_tare(&mut self) {
        self.sensor.set_tare(None, Drift::NONE);
    }

    /// What is known of gravity from now on.
    pub fn set_down(&mut self, down: Down) {
        self.sensor.set_down(down);
    }

    /// The rest position stays, but no frame has confirmed it.
    pub fn tared_at_another_time(&mut self) {
        let rest = self.sensor.tare().copied();
        self.sensor.set_tare(rest, Drift::UNSEEN);
    }

    /// The whole pipeline on a frame that follows none, which it looks at again when it refuses it.
    pub fn sense(&mut self, frame: &Frame) -> Measurement {
        self.sensor.forget_frame();
        self.sensor.measure_frame_closely(&frame.words())
    }

    /// The same from bands of so many rows, of which two are in memory at a time, as on the
    /// microcontroller.
    pub fn sense_in_bands(&mut self, frame: &Frame, rows: usize) -> Measurement {
        let (words, sensor) = (frame.words(), &mut self.sensor);
        let length = words.len() / usize::from(sensor.settings().geometry.height) * rows;
        let push = |sensor: &mut Sensor<'_>| {
            let mut above: &[u16] = &[];
            for band in words.chunks(length) {
                sensor.push_rows_below(above, band);
                above = band;
            }
        };
        sensor.forget_frame();
        sensor.begin_frame();
        push(sensor);
        let measurement = sensor.finish_frame();
        let Some(again) = sensor.look_again() else {
            return measurement;
        };
        push(sensor);
        sensor.finish_again(again)
    }

    /// What the pipeline makes of a frame.
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
    /// The largest distance of a marker from its true place, px; `None` without a force.
    pub fn worst_px(&self) -> Option<f64> {
        match self {
            Detection::Trusted { worst_px, .. } => Some(*worst_px),
            Detection::Refused(_) => None,
        }
    }
}
