//! How far loads would be off by what a calibration leaves open of a unit.

use anyhow::Result;
use hivtac_film::Film;
use hivtac_film::reduced::{LARGEST_SIZE, Pose};
use hivtac_scene::{Camera, Preset};
use hivtac_sensing::forward::{
    Column, Forward, KNOTS, PARTS, PLACES, SIZES, Stiffness, solve, stated,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{FilmModel, OwnUnit, UnitSetup, told};

/// Places go to so many mm either way, and the distance of knots.
pub const END_MM: f64 = 4.2;
const APART_MM: f64 = 2.0 * END_MM / (PLACES - 1) as f64;
/// How far an open unit is moved, in parts of what is not known of it.
pub const STEP: f64 = 0.25;
/// The least and the largest size that is tried, in parts of the largest: a unit that is softer
/// still has to hold the same force.
const TRIED: [f64; 2] = [0.15, 0.95];
/// How far beside a knot the chip's tables are held against the film: in parts of the distance of
/// knots along x and y, inwards from a knot at an end, and tilts, rad.
const BESIDE: [[f64; 4]; 4] = [
    [0.25, 0.25, 0.1, 0.0],
    [-0.25, 0.25, 0.0, 0.1],
    [-0.25, -0.25, -0.1, 0.0],
    [0.25, -0.25, 0.0, -0.1],
];

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

/// How the markers of a unit move.
struct Moving<'a> {
    open: &'a Open,
    setup: UnitSetup<'a>,
    film: Film,
}

/// A load that is tried on a unit.
struct Tried {
    /// How the markers move, px.
    moved: [f64; 8],
    /// By size, tilt and place, in parts of the markers' noise.
    slopes: [Column; 5],
}

/// Sums of squares of what a load is off by: (xx, xy, yy) of the tilt and of the place, the size's,
/// and what no load explains.
#[derive(Clone, Copy, Default)]
struct Off {
    tilt: [f32; 3],
    place: [f32; 3],
    size: f32,
    residual: f32,
}

/// By size, place along y and place along x: standard uncertainties of the force across itself, N,
/// of |F|, as sizes, of the place, mm, and of the residual, in parts of the noise's. They come from
/// what is open of a model's unit, and from what the chip's tables leave out of its film.
///
/// # Errors
/// When a number of the model or of an open unit is out of range.
pub fn left_open(
    model: &FilmModel,
    unit: &OwnUnit,
    chip: &Forward<'_>,
) -> Result<Vec<[f32; PARTS]>> {
    let found = Open {
        unit: unit.clone(),
        tip_radius_mm: model.tip_radius_mm,
        rest_px: model.rest_px,
    };
    let camera = Camera::new(Preset::Ov7725, 320, 240)?;
    let moving = |open| Moving::new(open, &camera);
    let compared = Compared {
        here: moving(&found)?,
        there: model.open.iter().map(moving).collect::<Result<_>>()?,
        chip,
        noise_px: model.noise_px,
    };
    let knots: Vec<usize> = (0..KNOTS).collect();
    let parts = |knot: usize| {
        let at = |k: usize| APART_MM * (k % PLACES) as f64 - END_MM;
        let size = (knot / PLACES / PLACES) as f64 / (SIZES - 1) as f64;
        compared.parts(size, [at(knot), at(knot / PLACES)])
    };
    knots.into_par_iter().map(parts).collect()
}

/// A unit that was found, beside others that it may be, and beside what the chip knows of it.
struct Compared<'a> {
    here: Moving<'a>,
    there: Vec<Moving<'a>>,
    chip: &'a Forward<'a>,
    noise_px: [f64; 2],
}

impl Compared<'_> {
    /// Of a straight load of a size, in parts of the largest, at a place.
    fn parts(&self, size: f64, place_mm: [f64; 2]) -> Result<[f32; PARTS]> {
        let pose = Pose {
            size: LARGEST_SIZE * size.clamp(TRIED[0], TRIED[1]),
            tilt: [0.0; 2],
            place_mm,
        };
        let tried = self.here.tried(&pose, self.noise_px)?;
        let mut off = Off::default();
        for there in &self.there {
            let more = match there.has_film_of(&self.here) {
                true => there.rests_less_than(&self.here),
                false => {
                    let moved = there.moved(&self.here.same_force(&pose, there))?;
                    std::array::from_fn(|i| moved[i] - tried.moved[i])
                }
            };
            off.add(&tried, more.map(|more| more / STEP), self.noise_px);
        }
        for beside in BESIDE {
            let more = self.left_out(&pose, beside)?;
            let part = 1.0 / (BESIDE.len() as f64).sqrt();
            off.add(&tried, more.map(|more| part * more), self.noise_px);
        }
        let size = pose.size as f32;
        let across = stated(off.tilt) * self.here.stiffness().magnitude_n(size);
        Ok([
            across,
            off.size.sqrt(),
            stated(off.place) * std::f32::consts::FRAC_1_SQRT_2,
            off.residual.sqrt(),
        ])
    }

    /// How much more the markers move than the chip's tables say, px, so far beside a pose.
    fn left_out(&self, pose: &Pose, [x, y, a, b]: [f64; 4]) -> Result<[f64; 8]> {
        let inwards = |at_mm: f64, aside: f64| {
            let there = at_mm + APART_MM * aside;
            if there.abs() > END_MM {
                at_mm - APART_MM * aside
            } else {
                there
            }
        };
        let [px, py] = pose.place_mm;
        let pose = Pose {
            tilt: [a, b],
            place_mm: [inwards(px, x), inwards(py, y)],
            ..*pose
        };
        let mut more = self.here.moved(&pose)?;
        let told = told(self.chip, &pose);
        let to_px = self.here.open.unit.to_px();
        for (marker, more) in more.chunks_exact_mut(2).enumerate() {
            let moved = to_px([told[2 * marker], told[2 * marker + 1]]);
            let rest_px = self.here.open.rest_px[marker];
            for i in [0, 1] {
                more[i] += rest_px[i] - moved[i];
            }
        }
        Ok(more)
    }
}

impl Off {
    /// Of markers that move so much more than under the load, px.
    fn add(&mut self, tried: &Tried, more: [f64; 8], noise_px: [f64; 2]) {
        let more = weighed(more.map(|more| more as f32), noise_px);
        let Some(solved) = solve(tried.slopes, more) else {
            return;
        };
        let [size, a, b, x, y] = solved.unknowns;
        for (sums, [x, y]) in [(&mut self.tilt, [a, b]), (&mut self.place, [x, y])] {
            for (sum, product) in sums.iter_mut().zip([x * x, x * y, y * y]) {
                *sum += product;
            }
        }
        self.size += size * size;
        self.residual += solved.left_over;
    }
}

/// Coordinates, px, in parts of the noise: away from the pattern's middle, and across that.
fn weighed(column: Column, noise_px: [f64; 2]) -> Column {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let [away, across] = noise_px.map(|part| half / part as f32);
    let mut turned = [0.0; 8];
    for (k, [cx, cy]) in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .into_iter()
        .enumerate()
    {
        let [x, y] = [column[2 * k], column[2 * k + 1]];
        turned[2 * k] = away * (x * cx + y * cy);
        turned[2 * k + 1] = across * (y * cx - x * cy);
    }
    turned
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

    /// Where the markers are seen beside the rest position that was seen, x and y of 0–3, px, but
    /// for what is the same under every load.
    fn moved(&self, pose: &Pose) -> Result<[f64; 8]> {
        let to_px = self.open.unit.to_px();
        let mut moved = [0.0; 8];
        for (marker, place) in moved.chunks_exact_mut(2).enumerate() {
            let [x, y] = to_px(self.setup.moved(&self.film, pose, marker)?);
            let [off_x, off_y] = self.open.rest_px[marker];
            place.copy_from_slice(&[x - off_x, y - off_y]);
        }
        Ok(moved)
    }

    /// Whether markers move as on another unit's film.
    fn has_film_of(&self, other: &Moving<'_>) -> bool {
        let of = |open: &Open| (open.unit.clone(), open.tip_radius_mm);
        of(self.open) == of(other.open)
    }

    /// How much more its markers move then.
    fn rests_less_than(&self, other: &Moving<'_>) -> [f64; 8] {
        let [own, other] = [self, other].map(|moving| moving.open.rest_px);
        std::array::from_fn(|i| other[i / 2][i % 2] - own[i / 2][i % 2])
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

    fn tried(&self, pose: &Pose, noise_px: [f64; 2]) -> Result<Tried> {
        let slopes = slopes(pose, |pose| self.moved(pose))?;
        Ok(Tried {
            moved: self.moved(pose)?,
            slopes: slopes.map(|column| weighed(column, noise_px)),
        })
    }
}

/// By central differences.
fn slopes(pose: &Pose, moved: impl Fn(&Pose) -> Result<[f64; 8]>) -> Result<[Column; 5]> {
    const STEP: f64 = 1e-3;
    let mut slopes = [[0.0; 8]; 5];
    for (k, column) in slopes.iter_mut().enumerate() {
        let beside = |step: f64| {
            let mut pose = *pose;
            match k {
                0 => pose.size += step,
                1 | 2 => pose.tilt[k - 1] += step,
                _ => pose.place_mm[k - 3] += step,
            }
            moved(&pose)
        };
        let (less, more) = (beside(-STEP)?, beside(STEP)?);
        *column = std::array::from_fn(|i| ((more[i] - less[i]) / (2.0 * STEP)) as f32);
    }
    Ok(slopes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forward::Noise;
    use hivtac_sensing::forward::{Mounting, Observed};

    const FOCAL_PX: f64 = 175.0;
    const NOISE_PX: [f64; 2] = [0.0096, 0.0135];
    /// A size in parts of the largest, and places, mm.
    const SIZE: f64 = 0.75;
    const PLACES_MM: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, -2.0], [-3.0, 2.0], [3.5, 3.0]];

    fn nominal() -> Open {
        Open {
            unit: OwnUnit {
                stiffness: 1.0,
                thickness: 1.0,
                grip: 1.0,
                posts_mm: [[0.0; 2]; 4],
                markers_mm: [[0.0; 2]; 4],
                focal_px: FOCAL_PX,
                roll_deg: 0.0,
            },
            tip_radius_mm: 0.5,
            rest_px: [[0.0; 2]; 4],
        }
    }

    fn chip() -> Vec<u8> {
        let noise = Noise {
            rest_px: [[0.0; 2]; 4],
            at_rest_px: NOISE_PX,
            at_four_areas: [1.0; 2],
        };
        FilmModel::nominal(3, &noise).spec().unwrap().to_bytes()
    }

    /// Runs with a nominal unit that may as well be another.
    fn with<R>(open: &Open, run: impl FnOnce(&Compared<'_>) -> R) -> R {
        let (here, bytes) = (nominal(), chip());
        let camera = Camera::new(Preset::Ov7725, 320, 240).unwrap();
        run(&Compared {
            here: Moving::new(&here, &camera).unwrap(),
            there: vec![Moving::new(open, &camera).unwrap()],
            chip: &Forward::parse(&bytes).unwrap(),
            noise_px: NOISE_PX,
        })
    }

    /// A film of another stiffness, 2 %, moves alike under another force, and nothing else.
    #[test]
    fn a_stiffer_film_is_another_force_alone() {
        let mut open = nominal();
        open.unit.stiffness += STEP * 0.02;
        with(&open, |compared| {
            let stiffness = compared.here.stiffness();
            let size = (LARGEST_SIZE * SIZE) as f32;
            let magnitude_n = stiffness.magnitude_n(size);
            for place_mm in PLACES_MM {
                let [across_n, size_off, place, _] = compared.parts(SIZE, place_mm).unwrap();
                let part = size_off * stiffness.per_size_n(size) / magnitude_n;
                assert!((part - 0.02).abs() < 1e-3, "{place_mm:?}: {part}");
                assert!(across_n < 2e-3 * magnitude_n, "{place_mm:?}: {across_n} N");
                assert!(place < 0.01, "{place_mm:?}: {place} mm");
            }
        });
    }

    /// What one open direction is said to do is what it does to the chip's own answer, where that
    /// is more than the tables leave out.
    #[test]
    fn the_chip_is_off_by_what_is_said() {
        let mut open = nominal();
        open.unit.posts_mm[2] = [0.1, -0.05];
        open.unit.markers_mm[1] = [0.03, 0.04];
        with(&open, |compared| {
            let stiffness = compared.here.stiffness();
            for place_mm in PLACES_MM {
                let pose = Pose {
                    size: LARGEST_SIZE * SIZE,
                    tilt: [0.0; 2],
                    place_mm,
                };
                let [across_n, size, place, residual] = compared.parts(SIZE, place_mm).unwrap();
                let found = answer(compared, &pose);
                let magnitude_n = stiffness.magnitude_n(pose.size as f32);
                let [a, b] = found.pose.tilt;
                let [x, y] = [0, 1].map(|i| found.pose.place_mm[i] - place_mm[i] as f32);
                // A direction alone: its standard uncertainty is widened, for 95 of 100 to lie
                // within as many of it as of a round one.
                let narrow = 1.132;
                for (said, is) in [
                    (across_n, narrow * a.hypot(b) * magnitude_n),
                    (size, (found.pose.size - pose.size as f32).abs()),
                    (place, narrow * x.hypot(y) * std::f32::consts::FRAC_1_SQRT_2),
                    (residual, found.unexplained.sqrt()),
                ] {
                    let is = is / STEP as f32;
                    assert!(
                        (said - is).abs() < 0.2 * is + 3e-3,
                        "{place_mm:?}: {said} {is}"
                    );
                }
            }
        });
    }

    /// What the chip makes of a press on the open unit.
    fn answer(compared: &Compared<'_>, pose: &Pose) -> hivtac_sensing::forward::Estimate {
        let there = &compared.there[0];
        let pose = compared.here.same_force(pose, there);
        let moved = there.moved(&pose).unwrap();
        let [away, across] = NOISE_PX.map(|part| (part / FOCAL_PX) as f32);
        let observed = Observed {
            moved: moved.map(|part| (part / FOCAL_PX) as f32),
            sigma: [away, across, away, across, away, across, away, across],
        };
        let mounting = Mounting {
            per_px: [(1.0 / FOCAL_PX) as f32, 0.0],
            beside_mm: [[0.0; 2]; 4],
        };
        let guess = hivtac_sensing::forward::Pose {
            size: pose.size as f32,
            tilt: [0.0; 2],
            place_mm: pose.place_mm.map(|part| part as f32),
        };
        compared.chip.estimate(&observed, &mounting, guess)
    }

    /// Where only the rest position is not known, markers are off by it under every load.
    #[test]
    fn an_open_rest_position_counts_most_where_the_load_is_small() {
        let mut open = nominal();
        open.rest_px[0] = [0.005 * STEP, 0.0];
        with(&open, |compared| {
            let moving = &compared.there[0];
            assert!(moving.has_film_of(&compared.here));
            let more = moving.rests_less_than(&compared.here);
            assert_eq!(more, [-0.005 * STEP, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
            let place = |size: f64| compared.parts(size, [1.0, -2.0]).unwrap()[2];
            assert!(place(0.25) > 2.0 * place(0.75));
        });
    }
}
