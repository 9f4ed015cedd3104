//! The rest position: how an untouched film looks.

use anyhow::{Context, Result, bail, ensure};
use hivtac_sensor::force::features::{FEATURES, Features};
use hivtac_sensor::force::forward::MOST_EQUATIONS;
use hivtac_sensor::force::rest;
use hivtac_terms::fixed::Q;
use hivtac_terms::list::List;
use hivtac_terms::units::Px;
use hivtac_twin::film::Dots;
use serde::{Deserialize, Serialize};

/// Features after the markers' coordinates: the rectangle's centre and its area.
pub const AFTER_COORDINATES: usize = 3;

/// Features of N markers: 2·N coordinates, and those of their rectangle; px and the last in px², as
/// whole multiples of 1/65,536.
pub type FeatureList = List<Q<16, i64>, { MOST_EQUATIONS + AFTER_COORDINATES }>;

/// The rest position.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rest {
    /// The features, as files hold them.
    pub features_q16: FeatureList,
    /// Areas of the markers in the mask, px.
    pub areas_px: Dots<u32>,
}

impl Rest {
    /// The rest position that a sensor took.
    pub fn of_sensor(rest: &rest::Rest) -> Rest {
        Rest {
            features_q16: features_to_q16(&rest.features),
            areas_px: rest.areas,
        }
    }

    /// The rest position as a sensor and a model file have it.
    ///
    /// # Errors
    /// When a coordinate does not fit 32 bits, or features and areas are not of the same markers.
    pub fn to_sensor(&self) -> Result<rest::Rest> {
        let features = features_from_q16(&self.features_q16)?;
        ensure!(
            features.centroids.len() == self.areas_px.len(),
            "features of {} markers, areas of {}",
            features.centroids.len(),
            self.areas_px.len()
        );
        Ok(rest::Rest {
            features,
            areas: self.areas_px,
        })
    }

    /// The features of four markers in px (px²).
    pub fn features_px(&self) -> [f64; FEATURES] {
        features_px(&self.features_q16)
    }

    /// Where the markers rest, px.
    pub fn places_px(&self) -> Dots<[f64; 2]> {
        places_px(&self.features_q16)
    }
}

/// The features of four markers in px (px²); exact, because they are below 2⁵³ steps.
pub fn features_px(numbers: &FeatureList) -> [f64; FEATURES] {
    numbers.array::<FEATURES>().map(|number| number.to_f64())
}

/// The markers' coordinates among features, px.
pub fn places_px(numbers: &FeatureList) -> Dots<[f64; 2]> {
    let coordinates = numbers.len().saturating_sub(AFTER_COORDINATES);
    let (pairs, _) = numbers[..coordinates].as_chunks::<2>();
    Dots::of(pairs.iter().map(|pair| pair.map(|number| number.to_f64())))
}

/// The nearest multiple of 1/65,536 to a value in px or px².
pub fn q16(px: f64) -> Q<16, i64> {
    Q::from_bits((px * f64::from(Px::ONE.0)).round() as i64)
}

/// The sensor's features as numbers: markers' coordinates, then the rectangle's centre and area.
pub fn features_to_q16(features: &Features) -> FeatureList {
    let coordinates = features.centroids.iter().flat_map(|(x, y)| [*x, *y]);
    let (x, y) = features.rect_center;
    let all = coordinates.chain([x, y]).map(Q::from);
    FeatureList::of(all.chain([features.rect_area]))
}

/// The inverse of [`features_to_q16`].
///
/// # Errors
/// When a coordinate does not fit 32 bits, or the numbers are not those of four markers or more.
pub fn features_from_q16(numbers: &FeatureList) -> Result<Features> {
    let [px @ .., area] = &numbers[..] else {
        bail!("there are no features");
    };
    ensure!(
        px.len() >= FEATURES - 1 && px.len() % 2 == 0,
        "{} features: of N markers there are 2·N + 3, and N is at least 4",
        numbers.len()
    );
    let narrow = |(i, number): (usize, &Q<16, i64>)| -> Result<Px> {
        let bits = number.bits();
        let narrow = i32::try_from(bits);
        Ok(Px(narrow.with_context(|| {
            format!("feature {i} is {bits} and does not fit 32 bits")
        })?))
    };
    let px = px.iter().enumerate().map(narrow);
    let px: Vec<Px> = px.collect::<Result<_>>()?;
    let (pairs, _) = px.as_chunks::<2>();
    let mut pairs: Vec<(Px, Px)> = pairs.iter().map(|[x, y]| (*x, *y)).collect();
    let rect_center = pairs.pop().unwrap_or_default();
    Ok(Features {
        centroids: List::of(pairs),
        rect_center,
        rect_area: *area,
    })
}
