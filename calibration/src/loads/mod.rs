//! Selects the loads of a data set for the fit of a unit: each with its picture, and the
//! uncertainties of its size, direction and place.
//!
//! | rows | loads |
//! |---|---|
//! | of one force at one noted place | frames of one load |
//! | pressed anywhere, no place noted | a selection over places and sizes: [`representative`] |

mod contradiction;
mod representative;

use std::cell::RefCell;

use crate::data::dataset::{Dataset, Observation, Sample};
use crate::data::loads::norm;
use crate::data::rest::{Rest, features_to_q16};
use crate::evaluation::answer::Chip;
use anyhow::{Result, anyhow};
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::model::Model;
use hivtac_terms::marker::Marker;
use hivtac_terms::units::Px;
use hivtac_twin::film::Dots;

use crate::weights::Weights;

pub use contradiction::{RoughLoad, check};
pub use representative::{LoadFrames, representative};

/// The largest number of loads selected from presses anywhere.
pub const MOST_FREE: usize = 120;
/// The greatest estimate of a press's distance from the middle along x or y, mm.
const FARTHEST_MM: f64 = 4.5;
/// Standard uncertainty of a marker's mean coordinates over many frames, px: the pixel grid's
/// effect.
const GRID_PX: f64 = 0.008;
/// Standard uncertainty in a single frame, px, if the weights have none.
const FRAME_PX: f64 = 0.025;

/// The picture of a load, and the uncertainties of its stated values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenLoad {
    /// The force by gauge or weight along the pose's direction, N.
    pub force_n: [f64; 3],
    /// Standard uncertainty of |F|, N.
    pub size_n: f64,
    /// Standard uncertainty of the direction along each of the two axes across it, radians; 0 where
    /// a stage set it.
    pub direction_rad: f64,
    /// The tip's place as noted, mm; otherwise estimated.
    pub place_mm: [f64; 2],
    /// Standard uncertainty of this place along x and y, without the part common to all places, mm;
    /// infinite if nobody noted it.
    pub each_place_mm: f64,
    /// Seen positions of the markers, mean of the frames, px.
    pub seen_px: Dots<[f64; 2]>,
    /// Standard uncertainty of these coordinates, px.
    pub noise_px: f64,
    /// Number of frames.
    pub frames: usize,
}

/// Uncertainties of a bench's loads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certainty {
    /// Standard uncertainty of a load's |F|, N.
    pub gauge_n: f64,
    /// Standard uncertainty of each noted place on its own, mm; 0 with a stage.
    pub place_mm: f64,
    /// Standard uncertainty of a marker's coordinates in one frame, px.
    pub frame_px: f64,
}

impl Certainty {
    /// With the frame noise stated in the weights.
    pub fn of(weights: &Weights, gauge_n: f64, place_mm: f64) -> Self {
        let noise_px = weights.film.as_ref().map(|film| film.noise_px);
        let frame_px = noise_px.map_or(FRAME_PX, |[away, across]| {
            ((away * away + across * across) / 2.0).sqrt()
        });
        Self {
            gauge_n,
            place_mm,
            frame_px,
        }
    }

    /// Standard uncertainty of the mean of this many frames, px: noise averages out, the pixel
    /// grid's effect remains.
    fn mean_px(&self, frames: usize) -> f64 {
        let noise = (self.frame_px.powi(2) - GRID_PX.powi(2)).max(0.0);
        (GRID_PX.powi(2) + noise / frames.max(1) as f64).sqrt()
    }
}

/// The loads of a data set, its sessions tared. `rough_place_mm` estimates places that nobody noted
/// from the picture ([`Rough`]).
///
/// # Errors
/// When a session has no frame of the untouched film.
pub fn loads_of(
    dataset: &Dataset,
    certainty: &Certainty,
    rough_place_mm: impl Fn(&Observation) -> [f64; 2],
) -> Result<Vec<SeenLoad>> {
    let tared = dataset.clone().tared()?;
    let is_free = |sample: &Sample<'_>| tared.about.free.is_some() && sample.tip_mm.is_none();
    let pressed = tared.samples().filter(|sample| sample.force_n != [0.0; 3]);
    let (free, known): (Vec<_>, Vec<_>) = pressed.partition(is_free);
    let mut loads = noted(&known, certainty);
    if let Some(about) = &tared.about.free {
        let direction_rad = about.direction_deg.to_radians();
        let chosen = representative(&free, MOST_FREE, rough_place_mm);
        loads.extend(chosen.iter().map(|load| SeenLoad {
            force_n: load.force_n,
            size_n: certainty.gauge_n.hypot(load.clock_n),
            direction_rad,
            place_mm: load.place_mm,
            each_place_mm: f64::INFINITY,
            seen_px: load.seen_px,
            noise_px: certainty.mean_px(load.frames),
            frames: load.frames,
        }));
    }
    Ok(loads)
}

/// Groups rows of the same force at the same place as frames of one load. Rows without a place were
/// pressed on the film's middle.
fn noted(samples: &[Sample<'_>], certainty: &Certainty) -> Vec<SeenLoad> {
    let mut loads: Vec<SeenLoad> = Vec::new();
    for sample in samples {
        let place_mm = sample.tip_mm.unwrap_or_default();
        let same =
            |load: &&mut SeenLoad| load.force_n == sample.force_n && load.place_mm == place_mm;
        let seen_px = sample.seen.places_px();
        match loads.iter_mut().find(same) {
            Some(load) => load.add(&seen_px),
            None => loads.push(SeenLoad {
                force_n: sample.force_n,
                size_n: certainty.gauge_n.hypot(sample.clock_n.unwrap_or(0.0)),
                direction_rad: 0.0,
                place_mm,
                each_place_mm: certainty.place_mm,
                seen_px,
                noise_px: 0.0,
                frames: 1,
            }),
        }
    }
    for load in &mut loads {
        load.noise_px = certainty.mean_px(load.frames);
    }
    loads
}

impl SeenLoad {
    /// The load's picture, with markers of these areas, px.
    pub fn observation(&self, areas_px: Dots<u32>) -> Observation {
        let px = |part: f64| Px((part * f64::from(Px::ONE.0)) as i32);
        let markers = self.seen_px.map(|[x, y]| Marker {
            x: px(x),
            y: px(y),
            area: 1,
        });
        Observation {
            features_q16: features_to_q16(&Features::of_markers(&markers)),
            areas_px,
        }
    }

    /// |F|, N.
    pub fn magnitude_n(&self) -> f64 {
        norm(self.force_n)
    }

    fn add(&mut self, seen_px: &[[f64; 2]]) {
        self.frames += 1;
        let now = seen_px.as_flattened();
        for (mean, now) in self.seen_px.as_flattened_mut().iter_mut().zip(now) {
            *mean += (now - *mean) / self.frames as f64;
        }
    }
}

/// Estimates loads by a model that knows only a unit's rest position.
pub struct Rough<'m>(RefCell<Chip<'m>>);

impl<'m> Rough<'m> {
    /// From a model file, and the unit's rest position.
    ///
    /// # Errors
    /// When the bytes are not a model, or its numbers cannot hold the rest position.
    pub fn new(model: &'m [u8], rest: &Rest) -> Result<Self> {
        let model = Model::parse(model).map_err(|error| anyhow!("{error}"))?;
        Ok(Self(RefCell::new(Chip::new(model, rest)?)))
    }

    /// Estimated place of a press, mm; the film's middle if unknown.
    pub fn place_mm(&self, seen: &Observation) -> [f64; 2] {
        self.load(seen).map_or([0.0; 2], |load| load.place_mm)
    }

    /// The estimate of a load; `None` if the model gives no places.
    pub fn load(&self, seen: &Observation) -> Option<RoughLoad> {
        let (force, _) = self.0.borrow_mut().force(seen).ok()?;
        let place = force.place?;
        Some(RoughLoad {
            magnitude_n: f64::from(force.magnitude.0) * 1e-6,
            place_mm: [place.x, place.y]
                .map(|um| (f64::from(um.0) * 1e-3).clamp(-FARTHEST_MM, FARTHEST_MM)),
        })
    }

    /// Checks loads' notes against the estimates.
    ///
    /// # Errors
    /// Names the contradiction.
    pub fn check(&self, loads: &[SeenLoad]) -> Result<()> {
        let areas_px = self.0.borrow().areas_px();
        let of_load = |load: &SeenLoad| self.load(&load.observation(areas_px));
        match loads.iter().map(of_load).collect::<Option<Vec<_>>>() {
            Some(rough) => check(loads, &rough),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;
