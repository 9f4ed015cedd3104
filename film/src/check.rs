//! Holds the reduced film against the full solution.

use std::f64::consts::PI;

use hivtac_scene::film::Film as ReducedFilm;
use hivtac_scene::{Camera, Contact, Load, MARKERS};

use crate::parallel::in_parallel;
use crate::samples::halton;
use crate::{Design, Film, FilmError, Loaded, paper_camera, press_load};

/// The stated domain: the largest force, N, |α| and |β|, degrees, and offset, mm.
const FORCE_N: f64 = 0.25;
const TILT_DEG: [f64; 2] = [12.0, 10.0];
const OFFSET_MM: f64 = 0.25;

/// How far the curves are from the full solution, over poses that they were not made from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Check {
    /// Poses solved.
    pub poses: usize,
    /// The largest distance of a marker's centroid at 800×600 `paper`, px.
    pub worst_px: f64,
    /// The load that it is at.
    pub worst_at: Option<Load>,
    /// Its root mean square, px.
    pub rms_px: f64,
    /// The largest error of the tip's place, mm.
    pub worst_tip_mm: f64,
}

/// Holds the curves of a contact reading against the full solution at `poses` random loads of the whole domain: |F| up
/// to 0.25 N, |α| to 12°, |β| to 10°, offset to 0.25 mm.
///
/// # Errors
/// When the film cannot be made or an equilibrium is not found.
pub fn check(
    reduced: &ReducedFilm,
    design: &Design,
    contact: Contact,
    poses: usize,
    threads: usize,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<Check, FilmError> {
    let cases = (0..poses)
        .map(|index| case(index, contact))
        .collect::<Result<Vec<_>, _>>()?;
    let camera = paper_camera()?;
    let errors = in_parallel(design, &cases, threads, progress, |film, load| {
        errors(film, reduced, load, &camera)
    })?;
    let mut check = Check {
        poses,
        ..Check::default()
    };
    for ((tip_mm, pixels), load) in errors.iter().zip(&cases) {
        check.worst_tip_mm = check.worst_tip_mm.max(*tip_mm);
        for px in pixels {
            if *px > check.worst_px {
                (check.worst_px, check.worst_at) = (*px, Some(*load));
            }
            check.rms_px += px * px;
        }
    }
    check.rms_px = (check.rms_px / (4 * poses.max(1)) as f64).sqrt();
    Ok(check)
}

/// The tip's error in mm and the markers' in px.
fn errors(
    film: &mut Film,
    reduced: &ReducedFilm,
    load: &Load,
    camera: &Camera,
) -> Result<(f64, [f64; 4]), FilmError> {
    let Loaded { state, .. } = press_load(film, load)?;
    reduced
        .check(load)
        .map_err(|error| FilmError::Scene(error.to_string()))?;
    let pressed = reduced.press(load);
    let distance = |k: usize| {
        let full = MARKERS[k].centroid_px(|rest| film.displacement(&state, rest), camera);
        let ours = MARKERS[k].centroid_px(|rest| pressed.displacement(rest), camera);
        (full[0] - ours[0]).hypot(full[1] - ours[1])
    };
    let tip_mm = (0..3).map(|c| (pressed.tip_mm[c] - state.tip_mm[c]).powi(2));
    Ok((tip_mm.sum::<f64>().sqrt(), std::array::from_fn(distance)))
}

/// A load of the stated domain; from another part of the sequence than the training's, with other bases.
fn case(index: usize, contact: Contact) -> Result<Load, FilmError> {
    let part = |base| halton(index + 1000, base);
    let [alpha, beta] = [(3, 0), (5, 1)].map(|(base, k)| TILT_DEG[k] * (2.0 * part(base) - 1.0));
    let (size, angle) = (OFFSET_MM * part(7).sqrt(), 2.0 * PI * part(11));
    Load::from_angles(FORCE_N * part(2), alpha, beta)
        .and_then(|load| load.with_contact(contact))
        .and_then(|load| load.with_offset_mm([size * angle.cos(), size * angle.sin()]))
        .map_err(|error| FilmError::Scene(error.to_string()))
}
