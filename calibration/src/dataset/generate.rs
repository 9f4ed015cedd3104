//! Data sets from the scene: render a frame, let `sensing` look at it.

use std::ops::Range;

use anyhow::{Result, anyhow};
use hivtac_scene::{Frame, Scene};
use hivtac_sensing::features::Features;
use hivtac_sensing::geometry::Geometry;
use hivtac_sensing::pipeline::{Measurement, Sensor};
use hivtac_sensing::settings::Settings;
use hivtac_sensing::status::Status;
use hivtac_sensing::threshold::{ByteOrder, Threshold};
use rayon::prelude::*;

use super::{Dataset, Observation, Recipe, Row};

/// Renders the frames of a recipe on all cores and looks at each with the pipeline. `progress` is called once for
/// each frame, from any thread.
///
/// # Errors
/// When the recipe asks for what the scene or the pipeline cannot do.
pub fn generate(recipe: &Recipe, progress: impl Fn() + Sync) -> Result<Dataset> {
    Ok(Dataset {
        rows: Renderer::new(recipe)?.rows(0..recipe.rows(), progress)?,
        about: recipe.about()?,
    })
}

/// Rows of a recipe, each by itself.
pub(super) struct Renderer<'a> {
    recipe: &'a Recipe,
    scenes: Vec<Scene>,
}

impl<'a> Renderer<'a> {
    pub fn new(recipe: &'a Recipe) -> Result<Self> {
        recipe.check()?;
        let scenes = (0..recipe.sessions).map(|session| recipe.scene(session));
        Ok(Self {
            recipe,
            scenes: scenes.collect::<Result<_>>()?,
        })
    }

    /// Some of the rows, in order.
    pub fn rows(&self, rows: Range<usize>, progress: impl Fn() + Sync) -> Result<Vec<Row>> {
        let eyes = || unmodelled_sensor(self.recipe);
        let rendered = rows.into_par_iter().map_init(eyes, |sensor, row| {
            let sensor = sensor.as_mut().map_err(|error| anyhow!("{error}"))?;
            let place = self.recipe.place(row);
            let frame =
                self.scenes[place.session].render_load(&self.recipe.load(row)?, row as u64)?;
            progress();
            Ok(Row {
                place,
                force_n: frame.truth.force.vector_n(),
                seen: observe(sensor, &frame),
            })
        });
        rendered.collect()
    }
}

/// A sensor that finds markers and features but knows no model yet.
fn unmodelled_sensor(recipe: &Recipe) -> Result<Box<Sensor<'static>>> {
    let geometry = Geometry::preset(recipe.preset, recipe.width, recipe.height);
    let mut sensor = Box::new(Sensor::new());
    let settings = Settings {
        threshold: Threshold::red(recipe.format.to_model()),
        centroid: recipe.centroid.to_model(),
        ..Settings::usual(geometry, ByteOrder::Native)
    };
    sensor
        .configure(settings, None)
        .map_err(|error| anyhow!("{error}"))?;
    Ok(sensor)
}

/// Shows a frame to a sensor.
pub(crate) fn measure(sensor: &mut Sensor<'_>, frame: &Frame) -> Measurement {
    sensor.begin_frame();
    sensor.push_rows(&frame.words());
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

    use super::super::Loads;
    use hivtac_scene::Contact;

    fn small(seed: u64) -> Recipe {
        Recipe {
            loads: Loads::Random(20),
            rest: 4,
            seed,
            ..Recipe::default()
        }
    }

    #[test]
    fn the_papers_poses_are_all_there() {
        let recipe = Recipe {
            loads: Loads::PaperPoses(1),
            rest: 1,
            sessions: 2,
            ..small(1)
        };
        let dataset = generate(&recipe, || ()).unwrap();
        assert_eq!(dataset.rows.len(), 2 * 358);
        let row = &dataset.rows[358 + 1 + 356];
        assert_eq!((row.place.session, row.place.pose), (1, Some(356)));
        let [x, y, z] = row.force_n;
        assert!((x.atan2(-z).to_degrees() - 10.0).abs() < 1e-9);
        assert!((y.atan2(x.hypot(z)).to_degrees() - 8.0).abs() < 1e-9);
        assert!(
            dataset.accepted().count() >= 710,
            "{:?}",
            dataset.rejected()
        );
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
        let scene = recipe.scene(0).unwrap();
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

    /// The label is the tip's way: a tip that sticks moves the markers much further sideways than a force so tilted.
    #[test]
    fn labels_mean_what_the_contact_reading_says() {
        let shift = |contact: Contact| {
            let recipe = Recipe {
                loads: Loads::PaperPoses(1),
                contact,
                ..small(6)
            };
            let dataset = generate(&recipe, || ()).unwrap();
            assert_eq!(dataset.about.conditions.contact.0, contact);
            let rest = dataset.rest().unwrap().features_px();
            let strong = dataset.rows.iter().filter(|row| row.force_n[2] < -0.05);
            let sideways = strong.filter_map(|row| {
                let seen = row.seen.as_ref().ok()?.features_px();
                let x = (0..4).map(|k| seen[2 * k] - rest[2 * k]).sum::<f64>() / 4.0;
                Some((row.force_n, x / (row.force_n[0] / -row.force_n[2])))
            });
            let tilted = sideways.filter(|(force, _)| force[0] < -0.15 * force[2].abs());
            let shifts: Vec<f64> = tilted.map(|(_, shift)| shift).collect();
            assert!(shifts.len() > 15);
            shifts.iter().sum::<f64>() / shifts.len() as f64
        };
        let (force, stick) = (shift(Contact::Force), shift(Contact::Stick));
        let slip = shift(Contact::Slip { mu: 0.6 });
        assert!(force > 0.0 && slip > 2.0 * force && stick > 1.2 * slip);
    }

    #[test]
    fn what_cannot_be_generated_is_said() {
        let refused = |recipe: Recipe, words: &str| {
            let error = format!("{:#}", generate(&recipe, || ()).unwrap_err());
            assert!(error.contains(words), "{error}");
        };
        refused(
            Recipe {
                sessions: 0,
                ..small(1)
            },
            "session",
        );
        refused(
            Recipe {
                loads: Loads::Random(0),
                rest: 0,
                ..small(1)
            },
            "frame",
        );
        refused(
            Recipe {
                loads: Loads::PaperPoses(usize::MAX),
                ..small(1)
            },
            "more than",
        );
        refused(
            Recipe {
                width: 321,
                ..small(1)
            },
            "321",
        );
    }

    #[test]
    fn reasons_leave_out_what_is_no_reason() {
        let status = Status::MARKERS_MISSING | Status::TARE_MISSING | Status::MODEL_MISSING;
        assert_eq!(reasons(status), "markers_missing");
    }
}
