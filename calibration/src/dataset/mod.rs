//! Data sets: forces with the features that `sensing` found in the frames.

mod file;
mod generate;

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use hivtac_sensing::features::FEATURES;
use serde::{Deserialize, Serialize};

use crate::conditions::Conditions;
use crate::weights::{Range, Rest};

pub use generate::{Recipe, generate};
pub(crate) use generate::{measure, reasons};

/// A pixel in Q16.16.
const PX: f64 = 65_536.0;

/// A data set.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// Where it came from and what its numbers mean.
    pub about: About,
    /// Its rows.
    pub rows: Vec<Row>,
}

/// Where a data set came from and what its numbers mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct About {
    /// What frames and labels are.
    pub conditions: Conditions,
    /// What the frames show, in words.
    pub scene: String,
    /// Decides loads and noise.
    pub seed: u64,
    /// The limits of its forces.
    pub range: Range,
}

/// One frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The force on the film in N, film frame.
    pub force_n: [f64; 3],
    /// What was seen, or the status names that say why nothing was.
    pub seen: Result<Observation, String>,
}

/// What the pipeline saw in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Observation {
    /// The eleven features in 1/65,536 px (the rectangle's area in 1/65,536 px²).
    pub features_q16: [i64; FEATURES],
    /// Areas of markers 0–3 in the mask, px.
    pub areas_px: [u32; 4],
}

impl Observation {
    /// The features in px (px²); exact, because they are below 2⁵³ steps.
    pub fn features_px(&self) -> [f64; FEATURES] {
        self.features_q16.map(|q16| q16 as f64 / PX)
    }
}

impl Dataset {
    /// Rows whose markers were found, with their forces.
    pub fn accepted(&self) -> impl Iterator<Item = (&Observation, [f64; 3])> {
        self.rows
            .iter()
            .filter_map(|row| Some((row.seen.as_ref().ok()?, row.force_n)))
    }

    /// How many rows were rejected, by status.
    pub fn rejected(&self) -> BTreeMap<&str, usize> {
        let mut counts = BTreeMap::new();
        for status in self.rows.iter().filter_map(|row| row.seen.as_ref().err()) {
            *counts.entry(status.as_str()).or_default() += 1;
        }
        counts
    }

    /// The rest position: the mean of all accepted rows without force, rounded half up.
    ///
    /// # Errors
    /// When there is no such row.
    pub fn rest(&self) -> Result<Rest> {
        let untouched = self.accepted().filter(|(_, force)| *force == [0.0; 3]);
        let seen: Vec<&Observation> = untouched.map(|(seen, _)| seen).collect();
        let count = i64::try_from(seen.len()).ok().filter(|&n| n > 0);
        let count =
            count.context("the data set has no accepted row without force, so no rest position")?;
        let mean = |sum: i64| (2 * sum + count).div_euclid(2 * count);
        Ok(Rest {
            features_q16: std::array::from_fn(|i| {
                mean(seen.iter().map(|s| s.features_q16[i]).sum())
            }),
            areas_px: std::array::from_fn(|i| {
                mean(seen.iter().map(|s| i64::from(s.areas_px[i])).sum()) as u32
            }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_sensing::geometry::Preset;

    pub(super) fn example() -> Dataset {
        let seen = |x: i64| Observation {
            features_q16: std::array::from_fn(|i| x + i as i64),
            areas_px: [200; 4],
        };
        let about = About {
            conditions: Conditions::simulated(Preset::Ov7725, 320, 240),
            scene: "made up".into(),
            seed: 3,
            range: Range::default(),
        };
        let rows = vec![
            Row {
                force_n: [0.0; 3],
                seen: Ok(seen(10)),
            },
            Row {
                force_n: [0.0; 3],
                seen: Ok(seen(11)),
            },
            Row {
                force_n: [0.0, 0.1, -0.1],
                seen: Ok(seen(1 << 32)),
            },
            Row {
                force_n: [0.0, 0.0, -0.1],
                seen: Err("markers_missing".into()),
            },
        ];
        Dataset { about, rows }
    }

    #[test]
    fn rest_is_the_mean_of_rows_without_force() {
        let rest = example().rest().unwrap();
        assert_eq!(
            rest.features_q16,
            std::array::from_fn(|i| 11 + i as i64),
            "10.5 rounds up"
        );
        assert_eq!(rest.areas_px, [200; 4]);
        let pressed = Dataset {
            rows: example().rows[2..].to_vec(),
            ..example()
        };
        assert!(
            pressed
                .rest()
                .unwrap_err()
                .to_string()
                .contains("without force")
        );
    }

    #[test]
    fn rejected_rows_are_counted_by_status() {
        let dataset = example();
        assert_eq!(dataset.rejected(), BTreeMap::from([("markers_missing", 1)]));
        assert_eq!(dataset.accepted().count(), 3);
    }
}
