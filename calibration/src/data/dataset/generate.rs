//! Generates data sets from the scene: renders a frame and lets the sensing measure it.

use crate::parallel;
use std::ops::Range;

use anyhow::Result;
use hivtac_twin::Scene;

use super::detector::Detectors;
use super::{Dataset, Recipe, Row};

/// Renders the frames of a recipe on all cores and measures each with the pipeline. Calls
/// `progress` once per frame, from any thread.
///
/// # Errors
/// When the scene or the pipeline does not support the recipe.
pub fn generate(recipe: &Recipe, progress: impl Fn() + Sync) -> Result<Dataset> {
    Ok(Dataset {
        rows: Renderer::new(recipe)?.rows(0..recipe.rows(), progress)?,
        about: recipe.about()?,
    })
}

/// Renders single rows of a recipe.
pub(super) struct Renderer<'a> {
    recipe: &'a Recipe,
    scenes: Vec<Scene>,
    detectors: Detectors<'a>,
}

impl<'a> Renderer<'a> {
    pub fn new(recipe: &'a Recipe) -> Result<Self> {
        recipe.check()?;
        let scenes = (0..recipe.sessions).map(|session| recipe.scene(session));
        Ok(Self {
            recipe,
            scenes: scenes.collect::<Result<_>>()?,
            detectors: Detectors::new(recipe),
        })
    }

    /// These rows in order.
    pub fn rows(&self, rows: Range<usize>, progress: impl Fn() + Sync) -> Result<Vec<Row>> {
        parallel::try_map(rows.len(), |number| {
            let row = rows.start + number;
            let place = self.recipe.place(row);
            let scene = &self.scenes[place.session];
            let frame = scene.render_load(&self.recipe.load(row)?, row as u64)?;
            let seen = self.detectors.detect(&frame)?;
            progress();
            let known = self.recipe.range.knows_places();
            Ok(Row {
                place,
                force_n: frame.truth.force.vector_n(),
                tip_mm: frame.truth.touches_mm.filter(|_| known),
                clock_n: None,
                seen,
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use super::super::Loads;
    use crate::data::range::Range;
    use hivtac_twin::Contact;

    fn small(seed: u64) -> Recipe {
        Recipe {
            loads: Loads::Random(20),
            rest: 4,
            range: Range::default(),
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

    /// Rows have the tip's place when it may be anywhere, and the markers are found there.
    #[test]
    fn places_are_labelled_where_they_are_known() {
        let mut recipe = small(3);
        (recipe.range.place_mm, recipe.range.force_n) = (4.0, 0.12);
        let dataset = generate(&recipe, || ()).unwrap();
        assert_eq!(dataset.accepted().count(), 24, "{:?}", dataset.rejected());
        for (row, number) in dataset.rows.iter().zip(0..) {
            let load = recipe.load(number).unwrap();
            let pressed = row.force_n != [0.0; 3];
            assert_eq!(
                row.tip_mm,
                pressed.then_some(load.offset_mm()),
                "row {number}"
            );
        }
        let middle = generate(&small(3), || ()).unwrap();
        assert!(middle.rows.iter().all(|row| row.tip_mm.is_none()));
    }

    /// The label is the tip's direction of motion: a tip that sticks moves the markers much further
    /// sideways than a force with that tilt.
    #[test]
    fn labels_mean_what_the_contact_reading_says() {
        let shift = |contact: Contact| {
            let recipe = Recipe {
                loads: Loads::PaperPoses(1),
                contact,
                ..small(6)
            };
            let dataset = generate(&recipe, || ()).unwrap();
            assert_eq!(dataset.about.conditions.contact, contact);
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
        let slip = shift(Contact::Slip { mu: 0.4 });
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
}
