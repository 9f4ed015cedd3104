//! Fits a unit's own model to a data set of a handful of loads.

use std::borrow::Cow;

use anyhow::{Context, Result, ensure};

use super::FilmModel;
use crate::data::conditions::Conditions;
use crate::data::dataset::Dataset;
use crate::data::rest::Rest;
use crate::loads::{Certainty, Rough, SeenLoad, loads_of};
use crate::quantize::export;
use crate::unit_fit::{Bench, FINENESS, Fit, OwnFilm, fit};
use crate::weights::Weights;
use hivtac_twin::{Camera, Preset};

/// Standard uncertainty of a marker's mean coordinates, px, from the pixel grid and the remaining
/// noise. With it, χ² of simulated units is 1 over its degrees of freedom, on average.
const MEAN_PX: f64 = 0.008;
/// The fewest loads that determine a unit; and a film in a unit whose camera and dots are known.
const FEWEST_LOADS: usize = 4;
const FEWEST_SWAPPED: usize = 3;
/// The model of the nominal film with the eight dots of `8v`.
const EIGHT: usize = 8;
const OF_EIGHT: &[u8] = include_bytes!("../../models/8v/default.hvtm");
/// The tables of a fitted unit hold for places within this, ±, mm.
const OWN_REACH_MM: f64 = 4.2;

/// Prior knowledge of a unit.
#[derive(Clone, Copy, Debug)]
pub struct Known<'a> {
    /// Standard uncertainty of a load's |F|, N.
    pub gauge_n: f64,
    /// Standard uncertainty of the stage's zero on the film along x and y, mm.
    pub stage_mm: f64,
    /// Standard uncertainty of each noted place relative to the zero, mm.
    pub place_mm: f64,
    /// The same unit with another film: its camera and its dots are known.
    pub from: Option<&'a Weights>,
}

impl Weights {
    /// These weights for the unit in a data set, with its rest position, and its film and camera
    /// fitted to its loads.
    ///
    /// # Errors
    /// When the data set has other conditions; and as [`Self::fitted`].
    pub fn for_unit(self, dataset: &Dataset, known: Known<'_>) -> Result<(Weights, Fit)> {
        let conditions = conditions_of(&self.conditions, &dataset.about.conditions)?;
        let rest = dataset.rest()?;
        let loads = self.loads(dataset, known)?;
        let (mut weights, found) = self.fitted(rest, &loads, dataset.about.down, known)?;
        weights.conditions = conditions;
        weights.check()?;
        Ok((weights, found))
    }

    /// The loads of a data set with their uncertainties.
    fn loads(&self, dataset: &Dataset, known: Known<'_>) -> Result<Vec<SeenLoad>> {
        let certainty = Certainty::of(self, known.gauge_n, known.place_mm);
        let model = self.rough_model()?;
        let rough = Rough::new(&model, &dataset.rest()?)?;
        let loads = loads_of(dataset, &certainty, |seen| rough.place_mm(seen))?;
        rough.check(&loads)?;
        let fewest = known.from.map_or(FEWEST_LOADS, |_| FEWEST_SWAPPED);
        ensure!(
            loads.len() >= fewest,
            "the data set shows {} loads: {fewest} at least are needed, with different forces or \
             places",
            loads.len()
        );
        Ok(loads)
    }

    /// A model that knows only a unit's rest position. That of eight dots takes a minute to make.
    fn rough_model(&self) -> Result<Cow<'static, [u8]>> {
        match self.conditions.markers {
            EIGHT => Ok(OF_EIGHT.into()),
            _ => Ok(export(self)?.into()),
        }
    }

    /// These weights for the unit with this rest position and these loads. `down` is gravity in the
    /// film frame, parts of g, if known.
    ///
    /// # Errors
    /// When the weights have no film, or no unit explains the loads.
    pub fn fitted(
        mut self,
        rest: Rest,
        loads: &[SeenLoad],
        down: Option<[f64; 3]>,
        known: Known<'_>,
    ) -> Result<(Weights, Fit)> {
        let film = self.film.take();
        let film =
            film.context("the weights have no film: make them with `hivtac-calibrate film`")?;
        let camera = self.conditions.camera()?;
        let bench = Bench {
            focal_px: camera.focal_px(),
            middle_px: [camera.width(), camera.height()].map(|side| (f64::from(side) - 1.0) / 2.0),
            rest_px: rest.places_px().to_vec(),
            noise_px: MEAN_PX,
            dots_mm: self.conditions.layout()?.centres_mm().to_vec(),
            // Tables are in focal lengths: all cameras have this lens.
            camera: Camera::new(Preset::Ov7725, 320, 240)?,
            down,
            fineness: FINENESS,
        };
        let from = known.from.map(Weights::own_film).transpose()?;
        let found = fit(&bench, loads, known.stage_mm, from)?;
        self.film = Some(FilmModel {
            own: Some(Box::new(found.own.clone())),
            ..film
        });
        self.rest = rest;
        self.range.place_mm = self.range.place_mm.min(OWN_REACH_MM);
        Ok((self, found))
    }

    fn own_film(&self) -> Result<&OwnFilm> {
        let own = self.film.as_ref().and_then(|film| film.own.as_deref());
        own.context("the weights of the old film (--from) are no unit's own")
    }
}

/// The weights' conditions for the unit of a data set, with its own origin, threshold and
/// dilations.
///
/// # Errors
/// When the data set has other frames, another pixel format or another contact reading.
fn conditions_of(own: &Conditions, unit: &Conditions) -> Result<Conditions> {
    ensure!(
        own.to_model()?.geometry == unit.to_model()?.geometry && own.centroid == unit.centroid,
        "the weights are for other frames than the data set's"
    );
    ensure!(
        own.markers == unit.markers,
        "the weights are for {} dots, and the unit has {}: take those for it (calibration/models)",
        own.markers,
        unit.markers
    );
    ensure!(
        own.pixel_format == unit.pixel_format,
        "the weights are for {}, and the unit sends {}: take those for it \
         (calibration/models), or `hivtac threshold --model`",
        own.pixel_format.name(),
        unit.pixel_format.name()
    );
    ensure!(
        own.contact == unit.contact,
        "the weights are for the contact reading `{}`, and the data set's is `{}`",
        own.contact,
        unit.contact
    );
    Ok(Conditions {
        origin: unit.origin.clone(),
        threshold: unit.threshold,
        dilations: unit.dilations,
        ..own.clone()
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use hivtac_terms::threshold::PixelFormat;
    use hivtac_twin::Contact;

    use super::*;
    use crate::data::conditions::OriginName;
    use crate::data::dataset::{Loads, Recipe, generate};
    use crate::data::range::Range;

    const KNOWN: Known<'static> = Known {
        gauge_n: 1e-3,
        stage_mm: 0.1,
        place_mm: 0.0,
        from: None,
    };

    fn default_weights() -> Weights {
        let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
        Weights::load(&models.join("default.weights")).unwrap()
    }

    /// A unit's model takes the unit's own threshold: with a different one it would give no force.
    #[test]
    fn a_model_has_the_threshold_of_its_unit() {
        let weights = default_weights();
        let unit = Conditions {
            origin: OriginName::Unit("00112233445566778899aabb".to_owned()),
            threshold: [165, 12, 90, 255, 40, 255],
            dilations: 2,
            ..weights.conditions.clone()
        };
        assert_ne!(weights.conditions, unit);
        assert_eq!(conditions_of(&weights.conditions, &unit).unwrap(), unit);
        let yuv422 = Conditions {
            pixel_format: PixelFormat::Yuv422,
            threshold: [162, 0, 0, 0, 0, 0],
            ..unit
        };
        let refused = conditions_of(&weights.conditions, &yuv422);
        let error = refused.unwrap_err().to_string();
        assert!(
            error.contains("rgb565") && error.contains("yuv422"),
            "{error}"
        );
    }

    /// A pressing direction is not the direction of the force that the film model explains.
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
        let refused = default_weights().for_unit(&dataset, KNOWN);
        let error = refused.unwrap_err().to_string();
        assert!(
            error.contains("reading `force`") && error.contains("`stick`"),
            "{error}"
        );
    }
}
