//! Data sets from the scene: render a frame, let `sensing` look at it.

use anyhow::{Result, anyhow, ensure};
use hivtac_scene::{Frame, Preset as ScenePreset, Scene};
use hivtac_sensing::features::Features;
use hivtac_sensing::geometry::{Geometry, Preset};
use hivtac_sensing::pipeline::{Measurement, Sensor};
use hivtac_sensing::settings::Settings;
use hivtac_sensing::status::Status;
use hivtac_sensing::threshold::ByteOrder;
use rayon::prelude::*;

use super::{About, Dataset, Observation, Row};
use crate::conditions::Conditions;
use crate::loads::RandomLoads;
use crate::weights::Range;

/// What to generate.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    /// Lens and camera.
    pub preset: Preset,
    /// Columns of a frame.
    pub width: u16,
    /// Rows of a frame.
    pub height: u16,
    /// Frames in all.
    pub samples: usize,
    /// How many of them show the untouched film.
    pub rest: usize,
    /// The limits of the forces.
    pub range: Range,
    /// Decides loads and noise.
    pub seed: u64,
}

impl Default for Recipe {
    /// The sensor's camera at the firmware's frame size; forces a tenth beyond the calibrated range, so that its
    /// ends are inside the data.
    fn default() -> Self {
        Self {
            preset: Preset::Ov7725,
            width: 320,
            height: 240,
            samples: 40_000,
            rest: 64,
            range: Range {
                force_n: 0.22,
                alpha_deg: 11.0,
                beta_deg: 8.8,
            },
            seed: 1,
        }
    }
}

impl Recipe {
    /// The scene that it renders.
    ///
    /// # Errors
    /// When the scene has no such preset or frame size.
    pub fn scene(&self) -> Result<Scene> {
        let preset = match self.preset {
            Preset::Paper => ScenePreset::Paper,
            Preset::Ov7725 => ScenePreset::Ov7725,
        };
        Ok(Scene::preset(
            "rest",
            preset,
            self.width.into(),
            self.height.into(),
            self.seed,
        )?)
    }

    /// The load of a row.
    ///
    /// # Errors
    /// When the limits are no limits of a force.
    pub fn load(&self, row: usize) -> Result<hivtac_scene::Load> {
        RandomLoads {
            range: self.range,
            rest: self.rest,
            seed: self.seed,
        }
        .load(row)
    }

    fn about(&self, scene: &Scene) -> About {
        let options = scene.options();
        About {
            conditions: Conditions::simulated(self.preset, self.width, self.height),
            scene: format!(
                "stand-in film, gain {}, falloff {}, noise {} of 255 levels",
                options.gain, options.falloff, options.noise
            ),
            seed: self.seed,
            range: self.range,
        }
    }
}

/// Renders the frames of a recipe on all cores and looks at each with the pipeline. `progress` is called once for
/// each frame, from any thread.
///
/// # Errors
/// When the recipe asks for what the scene or the pipeline cannot do.
pub fn generate(recipe: &Recipe, progress: impl Fn() + Sync) -> Result<Dataset> {
    ensure!(
        recipe.rest <= recipe.samples,
        "{} frames at rest are more than all {}",
        recipe.rest,
        recipe.samples
    );
    let scene = recipe.scene()?;
    let eyes = || unmodelled_sensor(recipe);
    let rows = (0..recipe.samples)
        .into_par_iter()
        .map_init(eyes, |sensor, row| {
            let sensor = sensor.as_mut().map_err(|error| anyhow!("{error}"))?;
            let frame = scene.render_load(&recipe.load(row)?, row as u64)?;
            progress();
            Ok(Row {
                force_n: frame.truth.force.vector_n(),
                seen: observe(sensor, &frame),
            })
        });
    Ok(Dataset {
        rows: rows.collect::<Result<Vec<Row>>>()?,
        about: recipe.about(&scene),
    })
}

/// A sensor that finds markers and features but knows no model yet.
fn unmodelled_sensor(recipe: &Recipe) -> Result<Box<Sensor<'static>>> {
    let geometry = Geometry::preset(recipe.preset, recipe.width, recipe.height);
    let mut sensor = Box::new(Sensor::new());
    let settings = Settings::usual(geometry, ByteOrder::Native);
    sensor
        .configure(settings, None)
        .map_err(|error| anyhow!("{error}"))?;
    Ok(sensor)
}

/// Shows a frame to a sensor.
pub(crate) fn measure(sensor: &mut Sensor<'_>, frame: &Frame) -> Measurement {
    sensor.begin_frame();
    for row in frame.pixels.chunks(frame.width as usize) {
        sensor.push_row(row);
    }
    sensor.finish_frame()
}

fn observe(sensor: &mut Sensor<'_>, frame: &Frame) -> Result<Observation, String> {
    let measurement = measure(sensor, frame);
    match (measurement.markers, measurement.features) {
        (Some(markers), Some(features)) => Ok(Observation {
            features_q16: Features::to_array(&features),
            areas_px: markers.map(|m| m.area),
        }),
        _ => Err(reasons(measurement.status)),
    }
}

/// The names of the status bits that forbid a force, but not the missing model.
pub(crate) fn reasons(status: Status) -> String {
    let forbids = |name: &&str| {
        let bit = Status::NAMES
            .iter()
            .find(|(_, n)| n == name)
            .map_or(Status::OK, |(bit, _)| *bit);
        Status::NO_FORCE.contains(bit) && bit != Status::MODEL_MISSING
    };
    status.names().filter(forbids).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small(seed: u64) -> Recipe {
        Recipe {
            samples: 24,
            rest: 4,
            seed,
            ..Recipe::default()
        }
    }

    #[test]
    fn the_same_recipe_gives_the_same_rows() {
        let dataset = generate(&small(1), || ()).unwrap();
        assert_eq!(dataset, generate(&small(1), || ()).unwrap());
        assert_ne!(dataset.rows, generate(&small(2), || ()).unwrap().rows);
        assert_eq!(dataset.accepted().count(), 24, "{:?}", dataset.rejected());
        assert_eq!(
            dataset
                .rows
                .iter()
                .filter(|row| row.force_n == [0.0; 3])
                .count(),
            4
        );
    }

    #[test]
    fn features_are_near_the_true_centroids() {
        let recipe = small(9);
        let scene = recipe.scene().unwrap();
        let dataset = generate(&recipe, || ()).unwrap();
        for (row, (seen, _)) in dataset.accepted().enumerate() {
            let truth = scene
                .render_load(&recipe.load(row).unwrap(), 0)
                .unwrap()
                .truth;
            let features = seen.features_px();
            for (id, marker) in truth.markers.iter().enumerate() {
                let [x, y] = marker.unwrap().centroid_px;
                let error = (features[2 * id] - x).hypot(features[2 * id + 1] - y);
                assert!(error < 0.4, "row {row}, marker {id}: {error} px off");
            }
        }
    }

    #[test]
    fn what_cannot_be_generated_is_said() {
        let too_many = generate(
            &Recipe {
                rest: 30,
                ..small(1)
            },
            || (),
        )
        .unwrap_err()
        .to_string();
        assert!(too_many.contains("30 frames at rest"), "{too_many}");
        assert!(
            generate(
                &Recipe {
                    width: 321,
                    ..small(1)
                },
                || ()
            )
            .is_err()
        );
    }

    #[test]
    fn reasons_leave_out_what_is_no_reason() {
        let status = Status::MARKERS_MISSING | Status::TARE_MISSING | Status::MODEL_MISSING;
        assert_eq!(reasons(status), "markers_missing");
    }
}
