//! The pipeline on simulated frames, with the default model where that is made for them.

use anyhow::{Context, Result, anyhow, bail};
use hivtac_calibration::data::dataset::reasons;
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::{Measurement, Sensor};
use hivtac_sensor::tare::TareBuilder;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::marker::Marker;
use hivtac_terms::threshold::ByteOrder;
use hivtac_twin::{Camera, Frame, Load, Scene, Truth};

/// The model that firmware and host tool embed.
static MODEL: &[u8] = include_bytes!("../../../calibration/models/default.hvtm");
/// Frames of a tare.
const TARE_FRAMES: u16 = 16;

/// The pipeline of a sensor.
pub struct Pipeline {
    sensor: Box<Sensor<'static>>,
}

/// What it made of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameMeasurement {
    /// Centroids by identity, px, when four markers were found, trusted or not.
    pub centroids_px: Option<[[f64; 2]; 4]>,
    /// N, film frame, when there is a model and nothing forbids a force.
    pub force_n: Option<[f64; 3]>,
    /// The names of the status bits that forbid a force; empty when none does.
    pub rejected: String,
}

impl Pipeline {
    /// One for a camera, without a tare.
    ///
    /// # Errors
    /// When the default model cannot be read, or the pipeline does not take such frames.
    pub fn new(camera: &Camera) -> Result<Pipeline> {
        let size = |count: u32| u16::try_from(count).context("the frame is too large");
        let (width, height) = (size(camera.width())?, size(camera.height())?);
        let geometry = Geometry::preset(camera.preset(), width, height);
        let model = Model::parse(MODEL).map_err(|error| anyhow!("the default model: {error}"))?;
        let model = (model.conditions.geometry == geometry).then_some(model);
        let settings = match &model {
            Some(model) => model.conditions.settings(ByteOrder::Native),
            None => Settings::usual(geometry, ByteOrder::Native),
        };
        let mut sensor = Box::new(Sensor::new());
        let configured = sensor.configure(settings, model);
        configured.map_err(|error| anyhow!("{error}"))?;
        Ok(Pipeline { sensor })
    }

    /// One that was tared on the untouched film of a scene.
    ///
    /// # Errors
    /// As [`Pipeline::new`], and when the markers of the untouched film are not found.
    pub fn tared(scene: &Scene) -> Result<Pipeline> {
        let mut pipeline = Pipeline::new(scene.camera())?;
        let mut builder = TareBuilder::new(TARE_FRAMES).context("not a number of frames")?;
        // Numbers that no test frame has: their noise is the tare's alone.
        for number in (1 << 40).. {
            let frame = scene.render_load(&Load::REST, number)?;
            let measured = pipeline.sensor.measure_frame(&frame.to_rgb565());
            if measured.markers.is_none() {
                bail!("no tare: {}", reasons(measured.status));
            }
            if let Some(outcome) = pipeline.sensor.tare_with(&mut builder, &measured) {
                let rest = outcome.map_err(|refusal| anyhow!("no tare: {refusal:?}"))?;
                pipeline.sensor.set_tare(Some(rest), Drift::NONE);
                break;
            }
        }
        Ok(pipeline)
    }

    /// Measures a frame, whatever its format.
    pub fn measure(&mut self, frame: &Frame) -> FrameMeasurement {
        let Measurement {
            status,
            markers,
            force,
            ..
        } = self.sensor.measure_frame(&frame.to_rgb565());
        FrameMeasurement {
            centroids_px: markers.map(|markers| markers.map(centroid_px)),
            force_n: force.map(hivtac_calibration::evaluation::check::vector_n),
            rejected: reasons(status),
        }
    }
}

fn centroid_px(marker: Marker) -> [f64; 2] {
    [marker.x, marker.y].map(|part| part.to_f64())
}

/// The largest distance of a found marker from the truth, px; endless when the truth has no such
/// marker.
pub fn worst_px(centroids_px: &[[f64; 2]; 4], truth: &Truth) -> f64 {
    let pairs = centroids_px.iter().zip(&truth.markers);
    let distances = pairs.map(|([x, y], marker)| match marker {
        Some(marker) => (x - marker.centroid_px[0]).hypot(y - marker.centroid_px[1]),
        None => f64::INFINITY,
    });
    distances.fold(0.0, f64::max)
}
