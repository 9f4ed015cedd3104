//! Measures how exactly markers are seen, from frames of presses with known force and place.

use anyhow::{Context, Result, ensure};
use hivtac_twin::MARKERS;
use hivtac_twin::film::Film;
use hivtac_twin::film::reduced::{Pose, Unit};

use super::UnitSetup;
use crate::data::dataset::{Dataset, Sample};

/// Mean absolute value of a normal distribution over its standard deviation: √(2/π).
pub(super) const MEAN_SIZE: f64 = 0.797_884_560_802_865_4;
/// The fewest rows that determine the noise.
const FEWEST: usize = 200;

/// Errors of markers' seen positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Rest position as a tare measures it, minus where markers 0–3 rest, px.
    pub rest_px: [[f64; 2]; 4],
    /// Standard uncertainty of a marker as large as at rest, px: away from the pattern's middle,
    /// and across that direction.
    pub at_rest_px: [f64; 2],
    /// Factor on it when the marker's area is four times that at rest.
    pub at_four_areas: [f64; 2],
}

/// A row's errors of eight coordinates, px, and the areas' ratios to those at rest.
struct Off {
    px: [[f64; 2]; 4],
    areas: [f64; 4],
}

impl Noise {
    /// From the rows of a data set with known places, on the nominal film under a tip of a radius
    /// in mm.
    ///
    /// # Errors
    /// When there are too few such rows.
    pub fn of(dataset: &Dataset, tip_radius_mm: f64) -> Result<Self> {
        let all = all_off(dataset, tip_radius_mm)?;
        ensure!(
            all.len() >= FEWEST,
            "the data set has {} presses of known places: {FEWEST} are needed to tell the noise",
            all.len()
        );
        let count = all.len() as f64;
        let mean = |k: usize, i: usize| all.iter().map(|off| off.px[k][i]).sum::<f64>() / count;
        let mean_px: [[f64; 2]; 4] = std::array::from_fn(|k| [0, 1].map(|i| mean(k, i)));
        let (mut away, mut across) = (Line::default(), Line::default());
        for off in &all {
            for (k, disc) in MARKERS.iter().enumerate() {
                let more = (off.areas[k] - 1.0) / 3.0;
                let [x, y] = [0, 1].map(|i| off.px[k][i] - mean_px[k][i]);
                let [cx, cy] = disc
                    .centre_mm
                    .map(|part| part.signum() / std::f64::consts::SQRT_2);
                away.add(more, (x * cx + y * cy).abs() / MEAN_SIZE);
                across.add(more, (y * cx - x * cy).abs() / MEAN_SIZE);
            }
        }
        let [(away, away_grows), (across, across_grows)] = [away.through(), across.through()];
        ensure!(
            away > 0.0 && across > 0.0,
            "the data set's markers have no noise"
        );
        Ok(Self {
            rest_px: mean_px.map(|place| place.map(|part| -part)),
            at_rest_px: [away, across],
            at_four_areas: [away_grows / away, across_grows / across]
                .map(|slope| (1.0 + slope).clamp(0.1, 10.0)),
        })
    }
}

/// The line nearest to points.
#[derive(Default)]
pub(super) struct Line {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
}

impl Line {
    pub fn add(&mut self, x: f64, y: f64) {
        self.count += 1.0;
        (self.x, self.y) = (self.x + x, self.y + y);
        (self.xx, self.xy) = (self.xx + x * x, self.xy + x * y);
    }

    /// Its value at 0, and its slope.
    pub fn through(&self) -> (f64, f64) {
        let slope =
            (self.count * self.xy - self.x * self.y) / (self.count * self.xx - self.x * self.x);
        ((self.y - slope * self.x) / self.count, slope)
    }
}

fn all_off(dataset: &Dataset, tip_radius_mm: f64) -> Result<Vec<Off>> {
    let camera = dataset.about.conditions.camera()?;
    let setup = UnitSetup {
        unit: Unit::default(),
        tip_radius_mm,
        camera: &camera,
    };
    let (film, rest) = (Film::default(), dataset.rest()?);
    let rest_px = rest.features_px();
    let off = |sample: Sample<'_>| -> Result<Option<Off>> {
        let Some(tip_mm) = sample.tip_mm else {
            return Ok(None);
        };
        let pose = Pose::of_force(sample.force_n, tip_mm, [1.0; 2]);
        let features = sample.seen.features_px();
        let mut px = [[0.0; 2]; 4];
        for (k, px) in px.iter_mut().enumerate() {
            let moved = setup.moved(&film, &pose, k)?;
            *px = [0, 1].map(|i| {
                let at = 2 * k + i;
                features[at] - rest_px[at] - camera.focal_px() * moved[i]
            });
        }
        let area =
            |k: usize| f64::from(sample.seen.areas_px[k]) / f64::from(rest.areas_px[k].max(1));
        Ok(Some(Off {
            px,
            areas: std::array::from_fn(area),
        }))
    };
    let all = dataset.samples().map(off).collect::<Result<Vec<_>>>();
    Ok(all
        .context("a press of the data set")?
        .into_iter()
        .flatten()
        .collect())
}
