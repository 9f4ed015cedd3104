//! Compares the reduced film with the full solution.

use std::f64::consts::PI;

use hivtac_twin::film::reduced::Unit;
use hivtac_twin::film::{Film as ReducedFilm, FilmError, Load, MAX_RATIO};
use hivtac_twin::{Camera, Disc, Preset};

use crate::parallel::in_parallel;
use crate::path::halton;
use crate::{Design, Film, Loaded, ShellError, press_load};

/// The random draw: sizes of forces and radii uniformly, tilts and places uniformly over their
/// areas.
const FORCE_N: [f64; 2] = [0.002, 0.25];

/// The errors of the tables against the full solution, over loads that they were not made from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Check {
    /// Number of loads solved.
    pub loads: usize,
    /// The largest error of a marker's centroid at 320×240 `ov7725`, px.
    pub worst_px: f64,
    /// The load with that error.
    pub worst_at: Option<Load>,
    /// The root mean square of the errors, px.
    pub rms_px: f64,
    /// The largest error of the tip's place, mm.
    pub worst_tip_mm: f64,
}

/// The range of loads in which the film is compared with the full solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain {
    /// |F|, N.
    pub force_n: [f64; 2],
    /// The largest ratio of tangential to normal force.
    pub ratio: f64,
    /// The largest distance of the places from the middle along x and y, mm.
    pub reach_mm: f64,
    /// The range of the tip's radius, mm.
    pub radii_mm: [f64; 2],
    /// Direction of gravity; `None` means that the film weighs nothing.
    pub down: Option<[f64; 3]>,
}

impl Domain {
    /// Returns the domain of all forces on a weightless film.
    pub fn within(reach_mm: f64, radii_mm: [f64; 2]) -> Domain {
        Domain {
            force_n: FORCE_N,
            ratio: MAX_RATIO,
            reach_mm,
            radii_mm,
            down: None,
        }
    }
}

/// Compares the reduced film of a unit with its full solution at a number of random loads.
///
/// # Errors
/// If the film cannot be made or an equilibrium is not found.
pub fn check(
    unit: &Unit,
    domain: &Domain,
    loads: usize,
    threads: usize,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<Check, ShellError> {
    let reduced = ReducedFilm::of(*unit)?.with_down(domain.down)?;
    let cases = (0..loads).map(|index| case(index, domain));
    let cases = cases.collect::<Result<Vec<_>, _>>()?;
    let camera = Camera::new(Preset::Ov7725, 320, 240)?;
    let design = Design {
        down: domain.down.unwrap_or_default(),
        ..Design::of(unit)
    };
    let errors = in_parallel(&design, &cases, threads, progress, |film, load| {
        errors(film, &reduced, load, &camera)
    })?;
    let mut check = Check {
        loads,
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
    check.rms_px = (check.rms_px / (4 * loads.max(1)) as f64).sqrt();
    Ok(check)
}

/// Returns the tip's error in mm and the markers' in px.
fn errors(
    film: &mut Film,
    reduced: &ReducedFilm,
    load: &Load,
    camera: &Camera,
) -> Result<(f64, [f64; 4]), ShellError> {
    let Loaded { state, .. } = press_load(film, load)?;
    reduced.check(load)?;
    let pressed = reduced.press(load);
    let distance = |disc: Disc| {
        let full = disc.centroid_px(|rest| film.displacement(&state, rest), camera);
        let ours = disc.centroid_px(|rest| pressed.displacement(rest), camera);
        (full[0] - ours[0]).hypot(full[1] - ours[1])
    };
    let discs = reduced.markers_mm().array::<4>().map(Disc::marker);
    let tip_mm = (0..3).map(|c| (pressed.tip_mm[c] - state.tip_mm[c]).powi(2));
    Ok((tip_mm.sum::<f64>().sqrt(), discs.map(distance)))
}

/// Returns a load of the domain, from a sequence that fills it evenly.
fn case(index: usize, domain: &Domain) -> Result<Load, FilmError> {
    let Domain {
        force_n,
        ratio,
        reach_mm,
        radii_mm,
        ..
    } = *domain;
    let part = |base| halton(index + 1000, base);
    let between = |[from, to]: [f64; 2], part: f64| from + (to - from) * part;
    let size_n = between(force_n, part(2));
    let (tilt, turn) = ((ratio * part(3).sqrt()).atan(), 2.0 * PI * part(5));
    let place = [7, 11].map(|base| reach_mm * (2.0 * part(base) - 1.0));
    let radius = between(radii_mm, part(13));
    let sideways = size_n * tilt.sin();
    Load::from_vector([
        sideways * turn.cos(),
        sideways * turn.sin(),
        -size_n * tilt.cos(),
    ])?
    .with_offset_mm(place)?
    .with_tip_radius_mm(radius)
}
