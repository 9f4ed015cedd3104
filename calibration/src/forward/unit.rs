//! A unit's own model from a data set of a handful of loads.

use anyhow::{Context, Result, ensure};

use super::{Bench, FilmModel, Fit, KnownLoad, fit};
use crate::weights::Weights;
use hivtac_data::conditions::Conditions;
use hivtac_data::dataset::{Dataset, Observation};
use hivtac_data::rest::Rest;

/// Standard uncertainty of a marker's mean coordinates, px: what the pixel grid does, and what is
/// left of noise. With it χ² of simulated units is 1 over its degrees of freedom, on average.
const MEAN_PX: f64 = 0.008;
/// More loads than this tell nothing that fewer do not, and take long.
const MOST_LOADS: usize = 40;

impl Weights {
    /// These weights for the unit that a data set shows: its rest position, and its film and camera
    /// as its loads tell them.
    ///
    /// `gauge_n` and `stage_mm` are the standard uncertainties of the loads' |F|, N, and of the
    /// stage's zero, mm.
    ///
    /// # Errors
    /// When the data set has other conditions, or as with [`Self::fitted`].
    pub fn for_unit(
        self,
        dataset: &Dataset,
        gauge_n: f64,
        stage_mm: f64,
    ) -> Result<(Weights, Fit)> {
        let [own, other] = [&self.conditions, &dataset.about.conditions];
        ensure!(
            own.to_model()?.geometry == other.to_model()?.geometry
                && own.centroid == other.centroid,
            "the weights are for other frames than the data set's"
        );
        ensure!(
            own.pixel_format == other.pixel_format,
            "the weights are for {}, and the unit sends {}: take those for it \
             (calibration/models), or `hivtac threshold --model`",
            own.pixel_format.name(),
            other.pixel_format.name()
        );
        ensure!(
            own.contact == other.contact,
            "the weights are for the contact reading `{}`, and the data set's is `{}`",
            own.contact,
            other.contact
        );
        let (origin, threshold, dilations) =
            (other.origin.clone(), other.threshold, other.dilations);
        let (mut weights, found) =
            self.fitted(dataset.rest()?, &loads(dataset)?, gauge_n, stage_mm)?;
        weights.conditions = Conditions {
            origin,
            threshold,
            dilations,
            ..weights.conditions
        };
        weights.check()?;
        Ok((weights, found))
    }

    /// These weights for the unit that rests so and answers loads so.
    ///
    /// # Errors
    /// When the weights have no film, there are fewer than 4 loads, or no unit explains them.
    pub fn fitted(
        mut self,
        rest: Rest,
        loads: &[KnownLoad],
        gauge_n: f64,
        stage_mm: f64,
    ) -> Result<(Weights, Fit)> {
        let film = self.film.take();
        let film =
            film.context("the weights have no film: make them with `hivtac-calibrate film`")?;
        let camera = self.conditions.camera()?;
        let bench = Bench {
            focal_px: camera.focal_px(),
            middle_px: [camera.width(), camera.height()].map(|side| (f64::from(side) - 1.0) / 2.0),
            noise_px: MEAN_PX,
            gauge_n,
            stage_mm,
        };
        let found = fit(&bench, &places(&rest.features_px()), loads)?;
        self.film = Some(FilmModel {
            tip_radius_mm: found.tip_radius_mm,
            rest_px: found.rest_px,
            unit: Some(found.unit.clone()),
            open: found.open.clone(),
            ..film
        });
        self.rest = rest;
        Ok((self, found))
    }
}

/// The loads of a data set: rows of the same force at the same place are frames of one. Where
/// nobody noted places, the tip was set on the film's middle.
fn loads(dataset: &Dataset) -> Result<Vec<KnownLoad>> {
    let mut loads: Vec<(KnownLoad, f64)> = Vec::new();
    for sample in dataset.samples() {
        if sample.force_n == [0.0; 3] {
            continue;
        }
        let place_mm = sample.tip_mm.unwrap_or_default();
        let same = |(load, _): &&mut (KnownLoad, f64)| {
            load.force_n == sample.force_n && load.place_mm == place_mm
        };
        let seen_px = seen(sample.seen);
        match loads.iter_mut().find(same) {
            Some((load, frames)) => {
                *frames += 1.0;
                for (mean, now) in load
                    .seen_px
                    .as_flattened_mut()
                    .iter_mut()
                    .zip(seen_px.as_flattened())
                {
                    *mean += (now - *mean) / *frames;
                }
            }
            None => loads.push((
                KnownLoad {
                    force_n: sample.force_n,
                    place_mm,
                    seen_px,
                },
                1.0,
            )),
        }
    }
    ensure!(
        loads.len() <= MOST_LOADS,
        "{} different loads: use at most {MOST_LOADS}, several frames of each",
        loads.len()
    );
    Ok(loads.into_iter().map(|(load, _)| load).collect())
}

fn seen(observation: &Observation) -> [[f64; 2]; 4] {
    places(&observation.features_px())
}

/// Markers 0–3 of a frame's features.
fn places(features_px: &[f64]) -> [[f64; 2]; 4] {
    std::array::from_fn(|k| [features_px[2 * k], features_px[2 * k + 1]])
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use hivtac_scene::Contact;
    use hivtac_terms::threshold::PixelFormat;

    use super::*;
    use hivtac_data::dataset::{Loads, Recipe, generate};
    use hivtac_data::range::Range;

    fn default_weights() -> Weights {
        let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
        Weights::load(&models.join("default.weights")).unwrap()
    }

    /// The unit's own threshold is the model's: with another one it would give no force.
    #[test]
    fn a_model_has_the_threshold_of_its_unit() {
        let recipe = Recipe {
            loads: Loads::Random(8),
            rest: 4,
            ..Recipe::default()
        };
        let mut dataset = generate(&recipe, || ()).unwrap();
        let threshold = [165, 12, 90, 255, 40, 255];
        dataset.about.conditions.threshold = threshold;
        let (own, _) = default_weights().for_unit(&dataset, 1e-3, 0.1).unwrap();
        assert_eq!(own.conditions.threshold, threshold);
        dataset.about.conditions.pixel_format = PixelFormat::Yuv422;
        dataset.about.conditions.threshold = [162, 0, 0, 0, 0, 0];
        let refused = default_weights().for_unit(&dataset, 1e-3, 0.1);
        let error = refused.unwrap_err().to_string();
        assert!(
            error.contains("rgb565") && error.contains("yuv422"),
            "{error}"
        );
    }

    /// Markers that are seen worse than a camera's noise explains leave more open: here each load's
    /// are some hundredths of a pixel off.
    #[test]
    fn loads_that_scatter_tell_less() {
        let recipe = Recipe {
            loads: Loads::Random(10),
            rest: 4,
            ..Recipe::default()
        };
        let dataset = generate(&recipe, || ()).unwrap();
        let mut loads = loads(&dataset).unwrap();
        let fitted = |loads: &[KnownLoad]| {
            let (_, fit) = default_weights()
                .fitted(dataset.rest().unwrap(), loads, 1e-3, 0.1)
                .unwrap();
            let sigmas = fit.numbers.iter().map(|(_, _, sigma)| sigma);
            (fit.chi_square, sigmas.sum::<f64>())
        };
        let (usual, known) = fitted(&loads);
        for (number, load) in loads.iter_mut().enumerate() {
            for (k, part) in load.seen_px.as_flattened_mut().iter_mut().enumerate() {
                *part += [0.012, -0.012][(number * 8 + k) * (number + 3) % 5 / 3];
            }
        }
        let (scattered, less) = fitted(&loads);
        assert!(
            usual < 1.5 && scattered > 1.5 * usual,
            "{usual} {scattered}"
        );
        assert!(less > 1.05 * known, "{less} {known}");
    }

    /// A pressing direction is no direction of the force that the film model explains.
    #[test]
    fn loads_of_another_contact_reading_are_refused() {
        let recipe = Recipe {
            contact: Contact::Stick,
            loads: Loads::Random(5),
            range: Range::default(),
            rest: 2,
            ..Recipe::default()
        };
        let dataset = generate(&recipe, || ()).unwrap();
        let refused = default_weights().for_unit(&dataset, 1e-3, 0.1);
        let error = refused.unwrap_err().to_string();
        assert!(
            error.contains("reading `force`") && error.contains("`stick`"),
            "{error}"
        );
    }
}
