//! Computes how contacts of other shapes move the images, compared with the nominal tip.

use crate::parallel;
use std::f64::consts::TAU;

use anyhow::{Context as _, Result};
use hivtac_sensor::force::forward::{SHIFTS, span};
use hivtac_sensor::force::model::ShapesSpec;
use hivtac_shell::{Contact, Design, Equilibrium, Film, Patch, markers};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::units::Micrometres;
use hivtac_twin::film::reduced::{NOMINAL_RADIUS_MM, Pose, Unit};
use hivtac_twin::{Camera, Preset};

use super::covariances::{Covariance, END_MM, Moved, OF_FOUR, covariances, knots, sum_of_squares};
use super::{LeastSquares, UnitSetup, in_focal_lengths};

/// Knots along the size, along y and along x.
const KNOTS: [u8; 3] = [6, 5, 5];
/// Radii of round contacts and of flat faces, mm.
const ROUND_MM: [f64; 6] = [0.25, 1.0, 1.75, 2.5, 3.25, 4.0];
const FLAT_MM: [f64; 6] = [0.5, 1.0, 1.75, 2.5, 3.25, 4.0];
/// Radii of faces that are tilted so far that they just touch all around.
const TILTED_MM: [f64; 3] = [1.0, 2.0, 3.0];
/// Half the axes of a pad, and half the length and the half width of an edge, mm.
const PAD_MM: [f64; 2] = [4.0, 2.5];
const EDGE_MM: [f64; 2] = [3.0, 0.8];
/// Factor on standard uncertainties, and its increase at the dots. It rises with the smaller
/// coordinate of the place, mm. Chosen so that forces of presses outside the ensemble are within
/// the stated 95 % nearly as often as stated.
const WIDER: f64 = 1.4;
const WIDER_AT_DOTS: f64 = 1.6;
const AT_DOTS_MM: [f64; 2] = [1.0, 2.5];
/// Half the width of a rim, mm.
pub(super) const RIM_MM: f64 = 0.3;
/// How likely each kind is, all of its kind together.
const ROUND: f64 = 0.35;
const FLAT: f64 = 0.25;
const TILTED: f64 = 0.1;
const PAD: f64 = 0.2;
const EDGE: f64 = 0.1;
/// Number of directions of tilted faces, pads and edges.
const WAYS: usize = 4;

/// A shape of the ensemble, and how likely it is.
struct Member {
    shape: ContactShape,
    patch: Patch,
    weight: f64,
}

/// The table of the nominal film, solved by finite elements. This takes minutes.
///
/// # Errors
/// When the film finds no equilibrium.
pub fn contact_shapes() -> Result<ShapesSpec> {
    let members = members()?;
    // Places along +x and +y only.
    let folded = |pose: Pose| Pose {
        place_mm: pose.place_mm.map(|part| 0.5 * (part + END_MM)),
        ..pose
    };
    let poses: Vec<Pose> = knots(KNOTS).map(folded).collect();
    let places = poses.len() / usize::from(KNOTS[0]);
    let in_octant = |place: &usize| {
        let [x, y] = poses[*place].place_mm;
        y <= x
    };
    let octant: Vec<usize> = (0..places).filter(in_octant).collect();
    let solved = parallel::try_map(octant.len(), |k| {
        // Threads that share a film wait for its factors.
        let nominal = NominalFilm::new()?;
        nominal.shifts(&members, poses.iter().skip(octant[k]).step_by(places))
    })?;
    let (mut factors, mut shifts) = (Vec::new(), Vec::new());
    for (number, pose) in poses.iter().enumerate() {
        let [x, y] = pose.place_mm;
        let inside = [x.max(y), x.min(y)];
        let at = (octant.iter()).position(|place| poses[*place].place_mm == inside);
        let of_place = &solved[at.context("a place without its mirror image")?];
        let own: Vec<Moved> = (of_place[number / places].iter())
            .map(|shift| if y > x { exchanged(shift) } else { *shift })
            .collect();
        let (mean, covariance) = mean_and_covariance(&members, &own);
        let wider = wider(pose.place_mm).powi(2);
        let row = |row: &Moved| row.map(|part| wider * part);
        factors.push(covariance.iter().map(row).collect());
        let radial = |is_kind: fn(ContactShape) -> bool| by_radius(&members, &own, is_kind);
        let [round, round_square] = radial(|shape| matches!(shape, ContactShape::Round(_)))?;
        let [flat, flat_square] = radial(|shape| matches!(shape, ContactShape::Flat(_)))?;
        let all: [Moved; SHIFTS] = [mean, round, round_square, flat, flat_square];
        shifts.push(all.map(|motion| motion.array()));
    }
    Ok(ShapesSpec {
        covariance: covariances(KNOTS, &factors),
        shifts,
    })
}

/// The factor on standard uncertainties at a place along +x and +y, mm. A shape changes the motion
/// of a dot under its rim more than in proportion, so several loads nearly explain such a frame.
fn wider([x, y]: [f64; 2]) -> f64 {
    let [from_mm, to_mm] = AT_DOTS_MM;
    let near = (x.min(y) - from_mm) / (to_mm - from_mm);
    WIDER + WIDER_AT_DOTS * near.clamp(0.0, 1.0)
}

fn mean_and_covariance(members: &[Member], shifts: &[Moved]) -> (Moved, Covariance) {
    let mut mean = Moved::defaults(OF_FOUR);
    for (member, shift) in members.iter().zip(shifts) {
        for (mean, part) in mean.iter_mut().zip(shift.iter()) {
            *mean += member.weight * part;
        }
    }
    let around = members.iter().zip(shifts).map(|(member, shift)| {
        let part = member.weight.sqrt();
        Moved::from_fn(OF_FOUR, |k| part * (shift[k] - mean[k]))
    });
    let covariance = sum_of_squares(&around.collect::<Vec<Moved>>());
    (mean, covariance)
}

/// The motions of contacts of a kind in proportion to the span and to its square.
fn by_radius(
    members: &[Member],
    shifts: &[Moved],
    is_kind: fn(ContactShape) -> bool,
) -> Result<[Moved; 2]> {
    let own = || (members.iter().zip(shifts)).filter(|(member, _)| is_kind(member.shape));
    let rows = own().map(|(member, _)| {
        let radius_mm = (member.shape.radius()).map_or(0.0, |radius| 1e-3 * radius.0 as f32);
        let part = f64::from(span(member.shape, radius_mm));
        vec![part, part * part]
    });
    let through = LeastSquares::new(&rows.collect::<Vec<_>>())?;
    let mut motions = [Moved::defaults(OF_FOUR); 2];
    for k in 0..OF_FOUR {
        let samples: Vec<f64> = own().map(|(_, shift)| shift[k]).collect();
        let found = through.coefficients(&samples);
        (motions[0][k], motions[1][k]) = (found[0], found[1]);
    }
    Ok(motions)
}

/// The nominal film and its camera.
struct NominalFilm {
    film: Film,
    camera: Camera,
    /// Coefficients a and b of |F| = a·s + b·s³, N.
    stiffness_n: [f64; 2],
}

impl NominalFilm {
    fn new() -> Result<Self> {
        let film = Film::new(&Design::default())?;
        let camera = Camera::new(Preset::Ov7725, 320, 240)?;
        let setup = UnitSetup {
            unit: Unit::default(),
            tip_radius_mm: NOMINAL_RADIUS_MM,
            camera: &camera,
        };
        Ok(Self {
            stiffness_n: setup.stiffness_n(),
            film,
            camera,
        })
    }

    /// Images of the dots, focal lengths from the axis.
    fn seen(&self, state: &Equilibrium) -> Moved {
        let images = markers(&self.film, state, &self.camera);
        let mut seen = Moved::defaults(OF_FOUR);
        for (place, marker) in seen.as_chunks_mut::<2>().0.iter_mut().zip(images) {
            *place = in_focal_lengths(marker.seen_px, &self.camera);
        }
        seen
    }

    /// How each member moves the images differently from the nominal tip, under growing straight
    /// loads at one place.
    fn shifts<'a>(
        &self,
        members: &[Member],
        poses: impl Iterator<Item = &'a Pose>,
    ) -> Result<Vec<Vec<Moved>>> {
        let mut needle = self.film.rest();
        let mut states: Vec<Equilibrium> = members.iter().map(|_| self.film.rest()).collect();
        let mut all = Vec::new();
        for pose in poses {
            let [linear_n, cubic_n] = self.stiffness_n;
            let force_n = [
                0.0,
                0.0,
                -pose.size * (linear_n + cubic_n * pose.size.powi(2)),
            ];
            if pose.size == 0.0 {
                all.push(vec![Moved::defaults(OF_FOUR); members.len()]);
                continue;
            }
            let radius_mm = self.film.design().tip_radius_mm;
            let contact = Contact::Force(force_n);
            needle = self
                .film
                .press_at(pose.place_mm, radius_mm, contact, &needle)?;
            let by_needle = self.seen(&needle);
            let mut shifts = Vec::new();
            for (member, state) in members.iter().zip(&mut states) {
                let patch = member.patch.moved_to(pose.place_mm)?;
                *state = self.film.press_patch(&patch, force_n, state)?;
                let seen = self.seen(state);
                shifts.push(Moved::from_fn(OF_FOUR, |k| seen[k] - by_needle[k]));
            }
            all.push(shifts);
        }
        Ok(all)
    }
}

/// All shapes, with weights whose sum is 1. Turned by a quarter or mirrored, they are the same.
fn members() -> Result<Vec<Member>> {
    let middle = [0.0; 2];
    let micrometres = |mm: f64| Micrometres((1e3 * mm).round() as u32);
    let mut members = Vec::new();
    let mut add = |shape, patch, weight| {
        members.push(Member {
            shape,
            patch,
            weight,
        });
    };
    for radius_mm in ROUND_MM {
        let shape = ContactShape::Round(micrometres(radius_mm));
        let weight = ROUND / ROUND_MM.len() as f64;
        add(shape, Patch::disc(middle, radius_mm)?, weight);
    }
    for radius_mm in FLAT_MM {
        let shape = ContactShape::Flat(micrometres(radius_mm));
        let weight = FLAT / FLAT_MM.len() as f64;
        add(shape, Patch::rim(middle, radius_mm, RIM_MM)?, weight);
    }
    for way in 0..WAYS {
        let turn = TAU * way as f64 / WAYS as f64;
        for radius_mm in TILTED_MM {
            let weight = TILTED / (WAYS * TILTED_MM.len()) as f64;
            add(ContactShape::Unknown, tilted(radius_mm, turn)?, weight);
        }
        // Half a turn changes neither a pad nor an edge.
        let turned_deg = turn.to_degrees() / 2.0;
        let of_way = |kind: f64| kind / WAYS as f64;
        let pad = Patch::ellipse(middle, PAD_MM, turned_deg)?;
        add(ContactShape::Unknown, pad, of_way(PAD));
        let edge = Patch::line(middle, 2.0 * EDGE_MM[0], EDGE_MM[1], turned_deg)?;
        add(ContactShape::Unknown, edge, of_way(EDGE));
    }
    Ok(members)
}

/// The rim of a tilted face: its pressure falls evenly to zero at one side.
pub(super) fn tilted(radius_mm: f64, turn: f64) -> Result<Patch> {
    let rim = Patch::rim([0.0; 2], radius_mm, RIM_MM)?;
    let (sin, cos) = libm::sincos(turn);
    let tilted = rim.points().iter().map(|([x, y], part)| {
        let along = (cos * x + sin * y) / (radius_mm + RIM_MM);
        ([*x, *y], part * (1.0 + along))
    });
    Ok(Patch::new(tilted.collect())?)
}

/// The mirror image of a motion of all images in the diagonal x = y. Markers 0 and 2 lie on it, 1
/// and 3 change places.
fn exchanged(moved: &Moved) -> Moved {
    let [ax, ay, bx, by, cx, cy, dx, dy] = moved.array();
    [ay, ax, dy, dx, cy, cx, by, bx].into()
}
