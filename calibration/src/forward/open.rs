//! What a calibration leaves open of a unit: how otherwise its markers may move.

use anyhow::Result;
use hivtac_film::Film;
use hivtac_film::reduced::{LARGEST_SIZE, Pose};
use hivtac_scene::Camera;
use hivtac_sensing::forward::Stiffness;
use hivtac_sensing::model::CovarianceSpec;
use serde::{Deserialize, Serialize};

use super::covariances::{Moved, covariances, sum_of_squares};
use super::tables::turned;
use super::{FOCAL_PX, FilmModel, OwnUnit, UnitSetup};

/// How far an open unit is moved, in parts of what is not known of it.
pub const STEP: f64 = 0.25;
/// A unit that is as likely as the one that was found, but for [`STEP`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Open {
    /// Its film and camera.
    pub unit: OwnUnit,
    /// Its tip's radius, mm.
    pub tip_radius_mm: f64,
    /// What a tare takes for its rest position less where its markers rest, px.
    pub rest_px: [[f64; 2]; 4],
}

impl FilmModel {
    /// What its calibration leaves open of a unit, and what the chip's tables, which leave `left`
    /// focal lengths, do of its film.
    pub(super) fn left_open(
        &self,
        unit: &OwnUnit,
        left: f64,
        camera: &Camera,
    ) -> Result<CovarianceSpec> {
        let found = Open {
            unit: unit.clone(),
            tip_radius_mm: self.tip_radius_mm,
            rest_px: self.rest_px,
        };
        let here = Moving::new(&found, camera)?;
        let open = self.open.iter().map(|open| Moving::new(open, camera));
        let open: Vec<Moving<'_>> = open.collect::<Result<_>>()?;
        covariances(|pose| {
            let moved = here.moved_px(pose)?;
            let difference = |there: &Moving<'_>| -> Result<Moved> {
                let more = there.moved_px(&here.same_force(pose, there))?;
                let mut focal: Moved = std::array::from_fn(|i| (more[i] - moved[i]) / STEP);
                for marker in focal.as_chunks_mut().0 {
                    *marker = turned(unit.per_px(), *marker);
                }
                Ok(focal)
            };
            let differences = open.iter().map(difference).collect::<Result<Vec<_>>>()?;
            let mut covariance = sum_of_squares(&differences);
            let left = left.hypot(self.beside_px / FOCAL_PX) * pose.size / LARGEST_SIZE;
            for (k, row) in covariance.iter_mut().enumerate() {
                row[k] += left * left;
            }
            Ok(covariance)
        })
    }
}

/// How the markers of a unit move.
struct Moving<'a> {
    open: &'a Open,
    setup: UnitSetup<'a>,
    film: Film,
}

impl<'a> Moving<'a> {
    fn new(open: &'a Open, camera: &'a Camera) -> Result<Self> {
        let unit = open.unit.film();
        Ok(Self {
            open,
            film: Film::of(unit)?,
            setup: UnitSetup {
                unit,
                tip_radius_mm: open.tip_radius_mm,
                camera,
            },
        })
    }

    /// Where the markers are seen beside the rest position that was seen, px.
    fn moved_px(&self, pose: &Pose) -> Result<Moved> {
        let to_px = self.open.unit.to_px();
        let mut moved = Moved::default();
        for (marker, place) in moved.chunks_exact_mut(2).enumerate() {
            let [x, y] = to_px(self.setup.moved(&self.film, pose, marker)?);
            let [off_x, off_y] = self.open.rest_px[marker];
            place.copy_from_slice(&[x - off_x, y - off_y]);
        }
        Ok(moved)
    }

    fn stiffness(&self) -> Stiffness {
        let [linear_n, cubic_n] = self.setup.stiffness_n().map(|part| part as f32);
        Stiffness { linear_n, cubic_n }
    }

    /// The pose that the same force has on another unit.
    fn same_force(&self, pose: &Pose, other: &Moving<'_>) -> Pose {
        let magnitude_n = self.stiffness().magnitude_n(pose.size as f32);
        let size = other.stiffness().size_of(magnitude_n, LARGEST_SIZE as f32);
        Pose {
            size: size.into(),
            ..*pose
        }
    }
}
