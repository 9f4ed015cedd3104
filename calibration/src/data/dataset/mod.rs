//! Data sets: forces, each with the features that the sensing found in its frame.

mod detector;
mod file;
mod generate;
mod recipe;
mod resume;
mod session;
mod split;

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};
use hivtac_sensor::force::features::FEATURES;
use hivtac_terms::fixed::Q;
use hivtac_twin::film::Dots;
use serde::{Deserialize, Serialize};

use crate::data::conditions::Conditions;
use crate::data::range::Range;
use crate::data::rest::{AFTER_COORDINATES, FeatureList, Rest, features_px, places_px};

pub use detector::{measure, reasons};
pub use file::{LARGEST_AREA, LARGEST_N};
pub use generate::generate;
pub use recipe::{Loads, Recipe};
pub use resume::generate_file;

/// Rows, and their meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// Its origin and the meaning of its numbers.
    pub about: About,
    /// One row per frame.
    pub rows: Vec<Row>,
}

/// Origin of a data set and meaning of its numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// Conditions of frames and labels.
    pub conditions: Conditions,
    /// Description of the scene, in words.
    pub scene: String,
    /// The loads of each session.
    pub loads: Loads,
    /// Frames of the untouched film in each session.
    pub rest: usize,
    /// Number of sessions: for each, the sensor was set up anew.
    pub sessions: usize,
    /// Seed of loads, sessions and noise.
    pub seed: u64,
    /// The limits of its forces.
    pub range: Range,
    /// Describes rows without a place. If absent, those rows were pressed on the film's middle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub free: Option<Free>,
    /// Direction of gravity in the film frame, parts of g (length 1): x right and y down in the
    /// image, z away from the camera. Absent if unknown, or different between rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub down: Option<[f64; 3]>,
}

/// Checks a direction of gravity: a vector of length 1, to 1 %.
///
/// # Errors
/// When its length is different.
pub fn check_down(down: &[f64; 3]) -> Result<()> {
    let length = down.iter().map(|part| part * part).sum::<f64>().sqrt();
    ensure!(
        (length - 1.0).abs() <= 0.01,
        "down is {down:?}, of length {length}: a vector of length 1 is needed, such as [0,0,1]"
    );
    Ok(())
}

/// Presses at unknown places: the tip was anywhere on the film.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Free {
    /// Standard uncertainty of the direction along each of the two axes across it, degrees.
    pub direction_deg: f64,
}

/// A row's position in the data set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// Its session, from 0.
    pub session: usize,
    /// Its pose among the paper's ([`crate::data::loads::PaperPoses`]), if it has one.
    pub pose: Option<usize>,
}

/// One frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its session and its pose.
    pub place: Place,
    /// The labelled force, N, film frame: the force on the film in the contact reading `force`,
    /// otherwise |F| along the pressing direction.
    pub force_n: [f64; 3],
    /// The point of the film under the tip, given by its rest position, mm from the middle; `None`
    /// without a force, and where unknown.
    pub tip_mm: Option<[f64; 2]>,
    /// Standard uncertainty of |F|, N, from the clocks' lag, the time between readings and the rate
    /// of the force. `None` where the force was held, or is known otherwise.
    pub clock_n: Option<f64>,
    /// The observation, or names of the status bits that explain its absence.
    pub seen: Result<Observation, String>,
}

/// A row whose markers were found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<'a> {
    /// The observation.
    pub seen: &'a Observation,
    /// The labelled force, N: [`Row::force_n`].
    pub force_n: [f64; 3],
    /// The tip's place, mm: [`Row::tip_mm`].
    pub tip_mm: Option<[f64; 2]>,
    /// Standard uncertainty of |F| due to the clocks, N: [`Row::clock_n`].
    pub clock_n: Option<f64>,
    /// Its session.
    pub session: usize,
}

impl<'a> Sample<'a> {
    fn of(row: &'a Row) -> Option<Self> {
        Some(Self {
            seen: row.seen.as_ref().ok()?,
            force_n: row.force_n,
            tip_mm: row.tip_mm,
            clock_n: row.clock_n,
            session: row.place.session,
        })
    }
}

/// The pipeline's measurement of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Observation {
    /// The features, px and the last in px².
    pub features_q16: FeatureList,
    /// Areas of the markers in the mask, px.
    pub areas_px: Dots<u32>,
}

impl Observation {
    /// The features of four markers in px (px²).
    pub fn features_px(&self) -> [f64; FEATURES] {
        features_px(&self.features_q16)
    }

    /// The markers' places, px.
    pub fn places_px(&self) -> Dots<[f64; 2]> {
        places_px(&self.features_q16)
    }
}

impl Dataset {
    /// Rows whose markers were found, with their forces.
    pub fn accepted(&self) -> impl Iterator<Item = (&Observation, [f64; 3])> {
        self.rows
            .iter()
            .filter_map(|row| Some((row.seen.as_ref().ok()?, row.force_n)))
    }

    /// The accepted rows among these numbers; rejected ones are left out.
    pub fn pick(&self, rows: &[usize]) -> Vec<Sample<'_>> {
        let picked = rows.iter().map(|&i| &self.rows[i]);
        picked.filter_map(Sample::of).collect()
    }

    /// All accepted rows.
    pub fn samples(&self) -> impl Iterator<Item = Sample<'_>> {
        self.rows.iter().filter_map(Sample::of)
    }

    /// Whether the tip may be anywhere and every row has its place.
    pub fn knows_places(&self) -> bool {
        self.about.range.knows_places() && self.about.free.is_none()
    }

    /// Whether a row is a press at an unknown place.
    pub fn is_free(&self, row: &Row) -> bool {
        self.about.free.is_some() && row.tip_mm.is_none() && row.force_n != [0.0; 3]
    }

    /// The data set without presses at unknown places, and their number.
    pub fn without_free(mut self) -> (Self, usize) {
        let (of_all, free) = (self.rows.len(), self.about.free.take());
        if free.is_some() {
            let is_known = |row: &Row| row.tip_mm.is_some() || row.force_n == [0.0; 3];
            self.rows.retain(is_known);
        }
        let left = self.rows.len();
        (self, of_all - left)
    }

    /// Number of rejected rows, by status.
    pub fn rejected(&self) -> BTreeMap<&str, usize> {
        let mut counts = BTreeMap::new();
        for status in self.rows.iter().filter_map(|row| row.seen.as_ref().err()) {
            *counts.entry(status.as_str()).or_default() += 1;
        }
        counts
    }

    /// The rest position of the first session, with which all other sessions are compared.
    ///
    /// # Errors
    /// When the session has no accepted row without force.
    pub fn rest(&self) -> Result<Rest> {
        self.session_rest(0)
    }

    /// Rewrites every session's features as if it had the first one's rest position, as a tare does
    /// on the chip.
    ///
    /// # Errors
    /// When a session has no accepted row without force.
    pub fn tared(mut self) -> Result<Self> {
        let common = self.rest()?;
        for session in 1..self.about.sessions {
            let rest = self
                .session_rest(session)
                .with_context(|| format!("session {session}"))?;
            let rows = self
                .rows
                .iter_mut()
                .filter(|row| row.place.session == session);
            for seen in rows.filter_map(|row| row.seen.as_mut().ok()) {
                for (i, feature) in seen.features_q16.iter_mut().enumerate() {
                    *feature += common.features_q16[i] - rest.features_q16[i];
                }
            }
        }
        Ok(self)
    }

    /// The rest position of a session: the mean of its accepted rows without force, rounded half
    /// up.
    ///
    /// # Errors
    /// When there is no such row.
    pub fn session_rest(&self, session: usize) -> Result<Rest> {
        let untouched = |row: &&Row| row.place.session == session && row.force_n == [0.0; 3];
        let rows = self.rows.iter().filter(untouched);
        let seen: Vec<&Observation> = rows.filter_map(|row| row.seen.as_ref().ok()).collect();
        let count = i64::try_from(seen.len()).ok().filter(|&n| n > 0);
        let count =
            count.context("the data set has no accepted row without force, so no rest position")?;
        let mean = |sum: i64| (2 * sum + count).div_euclid(2 * count);
        let markers = self.about.conditions.markers;
        Ok(Rest {
            features_q16: FeatureList::from_fn(2 * markers + AFTER_COORDINATES, |i| {
                let sum = seen.iter().map(|s| s.features_q16[i].bits()).sum();
                Q::from_bits(mean(sum))
            }),
            areas_px: Dots::from_fn(markers, |i| {
                mean(seen.iter().map(|s| i64::from(s.areas_px[i])).sum()) as u32
            }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::geometry::Preset;
    use hivtac_terms::threshold::PixelFormat;

    pub(super) fn example() -> Dataset {
        let seen = |x: i64| Observation {
            features_q16: FeatureList::from_fn(FEATURES, |i| Q::from_bits(x + i as i64)),
            areas_px: [200; 4].into(),
        };
        let about = About {
            conditions: Conditions::simulated(Preset::Ov7725, 320, 240, PixelFormat::Rgb565),
            scene: "made up".into(),
            loads: Loads::Random(2),
            rest: 2,
            sessions: 1,
            seed: 3,
            range: Range::default(),
            free: None,
            down: None,
        };
        let rows = vec![
            Row {
                place: Place::default(),
                force_n: [0.0; 3],
                tip_mm: None,
                clock_n: None,
                seen: Ok(seen(10)),
            },
            Row {
                place: Place::default(),
                force_n: [0.0; 3],
                tip_mm: None,
                clock_n: None,
                seen: Ok(seen(11)),
            },
            Row {
                place: Place::default(),
                force_n: [0.0, 0.1, -0.1],
                tip_mm: None,
                clock_n: None,
                seen: Ok(seen(1 << 32)),
            },
            Row {
                place: Place::default(),
                force_n: [0.0, 0.0, -0.1],
                tip_mm: None,
                clock_n: None,
                seen: Err("markers_missing".into()),
            },
        ];
        Dataset { about, rows }
    }

    /// Sessions of one rest row each, followed by poses of `each` rows.
    pub(super) fn many(sessions: usize, poses: usize, each: usize) -> Dataset {
        let row = |session: usize, pose: Option<usize>, i: usize| Row {
            place: Place { session, pose },
            force_n: [0.0, 0.0, pose.map_or(0.0, |_| -0.01 * (i + 1) as f64)],
            tip_mm: None,
            clock_n: None,
            seen: Ok(Observation {
                features_q16: FeatureList::from_fn(FEATURES, |f| {
                    Q::from_bits((1000 * session + 10 * i + f) as i64)
                }),
                areas_px: [200; 4].into(),
            }),
        };
        let session = |s: usize| {
            let pressed = (0..poses * each).map(move |i| row(s, Some(i / each), i));
            std::iter::once(row(s, None, 0)).chain(pressed)
        };
        let mut about = example().about;
        (about.sessions, about.rest, about.loads) = (sessions, 1, Loads::PaperPoses(each));
        Dataset {
            about,
            rows: (0..sessions).flat_map(session).collect(),
        }
    }

    #[test]
    fn a_tare_makes_sessions_comparable() {
        let tared = many(3, 2, 2).tared().unwrap();
        let of = |session: usize| -> Vec<_> {
            let rows = tared.rows.iter().filter(|row| row.place.session == session);
            rows.map(|row| (row.force_n, row.seen.clone())).collect()
        };
        assert_eq!(of(0), of(1));
        assert_eq!(of(0), of(2));
        let mut untouched_missing = many(2, 2, 2);
        untouched_missing.rows.remove(5);
        assert!(format!("{:#}", untouched_missing.tared().unwrap_err()).contains("session 1"));
    }

    #[test]
    fn rest_is_the_mean_of_rows_without_force() {
        let rest = example().rest().unwrap();
        assert_eq!(
            rest.features_q16,
            FeatureList::from_fn(FEATURES, |i| Q::from_bits(11 + i as i64)),
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
