//! Compares the tables of the whole film with full solutions.

use std::f64::consts::TAU;

use hivtac_twin::film::reduced::{NOMINAL_RADIUS_MM, Pose, Unit};
use hivtac_twin::film::whole::WholeFilm;
use hivtac_twin::film::{Film as FourDots, Load, MAX_PLACE_MM, MAX_RATIO};
use hivtac_twin::{Camera, Disc, MARKERS, Preset};

use super::sampled::design;
use crate::parallel::in_parallel;
use crate::path::halton;
use crate::{Contact, Design, Equilibrium, Film, ShellError};

/// The random draw: sizes of forces uniformly, tilts and places uniformly over their areas, N.
const FORCE_N: [f64; 2] = [0.002, 0.25];
/// The largest distances of dots from the middle along x and along y, mm.
const DOTS_MM: [f64; 2] = [8.5, 6.0];
/// Number of random dots under a load; as many lie within this distance of the tip, mm.
const DOTS: usize = 12;
const NEAR_MM: f64 = 1.5;
/// Columns and rows of the picture in which errors are measured.
const PICTURE: [u32; 2] = [320, 240];

/// Errors of centroids, px.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Number of dots.
    pub count: usize,
    /// The sum of their squares.
    squares: f64,
    /// The largest one.
    pub worst_px: f64,
}

impl Errors {
    fn add(&mut self, px: f64) {
        self.count += 1;
        self.squares += px * px;
        self.worst_px = self.worst_px.max(px);
    }

    /// Returns the root mean square, px.
    pub fn rms_px(&self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }
}

/// The errors of tables against full solutions for loads that they were not made from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WholeCheck {
    /// Of dots anywhere.
    pub anywhere: Errors,
    /// Of dots near the tip.
    pub near: Errors,
    /// Of the nominal sensor's four dots by the tables of the whole film.
    pub four: Errors,
    /// Of the same dots by the tables that are made for them.
    pub four_by_own: Errors,
    /// The largest error of the tip's place, mm.
    pub worst_tip_mm: f64,
}

/// The films and loads of a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WholeDomain {
    /// The largest distance of the tip from the middle along x and along y, mm.
    pub reach_mm: f64,
    /// The range of the tip's radius, mm.
    pub radii_mm: [f64; 2],
    /// The film's own differences from the nominal one.
    pub unit: Unit,
}

impl WholeDomain {
    /// Returns the loads of the nominal tip on the nominal film.
    pub fn within(reach_mm: f64) -> WholeDomain {
        WholeDomain {
            reach_mm,
            radii_mm: [NOMINAL_RADIUS_MM; 2],
            unit: Unit::default(),
        }
    }
}

/// A load of a comparison.
struct Case {
    index: usize,
    force_n: [f64; 3],
    place_mm: [f64; 2],
    radius_mm: f64,
    unit: Unit,
}

/// Compares the whole film with its full solution at a number of random loads of a domain. Dots
/// that leave the picture do not count.
///
/// # Errors
/// If an equilibrium is not found.
pub fn check_whole(
    whole: &WholeFilm,
    domain: &WholeDomain,
    loads: usize,
    threads: usize,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<WholeCheck, ShellError> {
    let camera = Camera::new(Preset::Ov7725, PICTURE[0], PICTURE[1])?;
    let cases: Vec<Case> = (0..loads).map(|index| case(index, domain)).collect();
    let mesh = design(NOMINAL_RADIUS_MM);
    let design = Design {
        tip_reach_mm: mesh.tip_reach_mm,
        fineness: mesh.fineness,
        gauss_points: mesh.gauss_points,
        ..Design::of(&domain.unit)
    };
    let found = in_parallel(&design, &cases, threads, progress, |film, case| {
        film.move_tip(case.place_mm, case.radius_mm)?;
        let state = film.press(Contact::Force(case.force_n), &film.rest())?;
        compared(whole, film, &state, case, &camera)
    })?;
    Ok(found
        .iter()
        .fold(WholeCheck::default(), |sum, one| sum.and(one)))
}

impl WholeCheck {
    fn and(mut self, other: &WholeCheck) -> WholeCheck {
        let pairs = [
            (&mut self.anywhere, other.anywhere),
            (&mut self.near, other.near),
            (&mut self.four, other.four),
            (&mut self.four_by_own, other.four_by_own),
        ];
        for (sum, more) in pairs {
            sum.count += more.count;
            sum.squares += more.squares;
            sum.worst_px = sum.worst_px.max(more.worst_px);
        }
        self.worst_tip_mm = self.worst_tip_mm.max(other.worst_tip_mm);
        self
    }
}

fn compared(
    whole: &WholeFilm,
    film: &Film,
    state: &Equilibrium,
    case: &Case,
    camera: &Camera,
) -> Result<WholeCheck, ShellError> {
    let Case {
        place_mm,
        radius_mm,
        unit,
        ..
    } = case;
    let pose = &Pose::of_force(case.force_n, *place_mm, unit.bending_and_stretching());
    let mut check = WholeCheck::default();
    let full = |disc: &Disc| disc.centroid_px(|rest| film.displacement(state, rest), camera);
    let predicted = |disc: &Disc| {
        let motion = whole.disc(pose, *radius_mm, unit, disc);
        let [x, y] = disc.centre_mm;
        disc.centroid_px(|rest| motion.at([rest[0] - x, rest[1] - y]), camera)
    };
    let error = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let (anywhere, near) = dots(case.index, *place_mm);
    for (discs, errors) in [(anywhere, &mut check.anywhere), (near, &mut check.near)] {
        for disc in &discs {
            let seen = full(disc);
            if is_seen(seen) {
                errors.add(error(seen, predicted(disc)));
            }
        }
    }
    let own = place_mm.iter().all(|part| part.abs() <= MAX_PLACE_MM);
    if own {
        let load = Load::from_vector(case.force_n)?.with_offset_mm(*place_mm)?;
        let pressed = FourDots::of(*unit)?.press(&load.with_tip_radius_mm(*radius_mm)?);
        for disc in &MARKERS {
            let seen = full(disc);
            if is_seen(seen) {
                check.four.add(error(seen, predicted(disc)));
                let by_own = disc.centroid_px(|rest| pressed.displacement(rest), camera);
                check.four_by_own.add(error(seen, by_own));
            }
        }
    }
    let tip = whole.tip_mm(pose, *radius_mm, unit);
    let off = (0..3).map(|c| (tip[c] - state.tip_mm[c]).powi(2));
    check.worst_tip_mm = off.sum::<f64>().sqrt();
    Ok(check)
}

fn is_seen([x, y]: [f64; 2]) -> bool {
    let [width, height] = PICTURE.map(f64::from);
    (0.0..width).contains(&x) && (0.0..height).contains(&y)
}

/// Returns dots anywhere, and dots near the tip.
fn dots(index: usize, tip_mm: [f64; 2]) -> (Vec<Disc>, Vec<Disc>) {
    let place = |k: usize| {
        let at = 1 + DOTS * index + k;
        [3, 5].map(|base| 2.0 * halton(at, base) - 1.0)
    };
    let within = |part: f64, most: f64| part.clamp(-most, most);
    let anywhere = |k| {
        let part = place(k);
        Disc::marker([0, 1].map(|c| part[c] * DOTS_MM[c]))
    };
    let near = |k| {
        let part = place(k);
        let near = |c: usize| tip_mm[c] + NEAR_MM * part[c];
        Disc::marker([0, 1].map(|c| within(near(c), DOTS_MM[c])))
    };
    (
        (0..DOTS).map(anywhere).collect(),
        (0..DOTS).map(near).collect(),
    )
}

/// Returns a load, from a sequence that fills the range evenly.
fn case(index: usize, domain: &WholeDomain) -> Case {
    let part = |base| halton(index + 2000, base);
    let force_n = FORCE_N[0] + (FORCE_N[1] - FORCE_N[0]) * part(2);
    let (tilt, turn) = ((MAX_RATIO * part(3).sqrt()).atan(), TAU * part(5));
    let sideways = force_n * tilt.sin();
    let force = [
        sideways * turn.cos(),
        sideways * turn.sin(),
        -force_n * tilt.cos(),
    ];
    let place = [7, 11].map(|base| domain.reach_mm * (2.0 * part(base) - 1.0));
    let [from, to] = domain.radii_mm;
    Case {
        index,
        force_n: force,
        place_mm: place,
        radius_mm: from + (to - from) * part(13),
        unit: domain.unit,
    }
}
