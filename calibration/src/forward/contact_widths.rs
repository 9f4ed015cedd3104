//! Computes how the width of a contact moves the images of a layout's dots, compared with the
//! nominal tip.
//!
//! The effect of a wide contact depends on its distance from a dot, and hardly on its place on the
//! film. So the film is pressed at a few places, and its motion at a distance is interpolated
//! between them.

use crate::parallel;
use std::f64::consts::{FRAC_PI_2, TAU};

use anyhow::Result;
use hivtac_sensor::force::forward::{OF_FACE, PER_WIDTH_MM, TIP_MM};
use hivtac_shell::{Contact, Design, Equilibrium, Film, Patch};
use hivtac_twin::film::Layout;
use hivtac_twin::film::reduced::{LARGEST_SIZE, NOMINAL_RADIUS_MM, Unit};
use hivtac_twin::{Camera, Disc, Preset};

use super::contact_shapes::{RIM_MM, tilted};
use super::covariances::Moved;
use super::{LeastSquares, UnitSetup, in_focal_lengths};

/// Knots along each axis, and the largest place, mm.
const KNOTS: u8 = 11;
const END_MM: f64 = 5.5;
/// Places along an axis at which the film is pressed, mm.
const PLACES_MM: [f64; 3] = [0.0, 2.1, 4.2];
/// Roots of the sizes, in parts of the largest.
const ROOTS: [f64; 4] = [0.6, 0.75, 0.9, 1.0];
/// Fineness of the film's mesh. Only the difference of two contacts on the same mesh is used.
const FINENESS: f64 = 0.7;
/// Radii of soft discs and of rims of flat faces, mm.
const DISCS_MM: [f64; 8] = [0.25, 0.6, 1.0, 1.5, 2.0, 2.75, 3.4, 4.0];
const RIMS_MM: [f64; 5] = [0.6, 1.0, 1.75, 2.5, 3.2];
/// Radii of faces that are tilted so far that they just touch all around.
const TILTED_MM: [f64; 2] = [2.0, 3.0];
/// Half the axes of a pad, and half the length and the half width of an edge, mm; the radius of the
/// soft disc that is as wide.
const PAD_MM: ([f64; 2], f64) = ([4.0, 2.5], 3.2);
const EDGE_MM: ([f64; 2], f64) = ([3.0, 0.8], 2.6);
/// The elongation of an edge, in parts of a pad's; and of a tilted face, whose pressure is wider
/// across the tilt.
const LONG_EDGE: f64 = 2.3;
const LONG_TILTED: f64 = -0.6;
/// The width of a tilted face in parts of its radius times [`OF_FACE`].
const OF_TILTED: f64 = 0.866;
/// Number of directions of tilted faces, pads and edges.
const WAYS: usize = 4;
/// Points of a dot's rim, for dots that the camera sees from their edge.
const RIM_POINTS: usize = 12;
/// Columns: group, power of size, power of width.
const COLUMNS: [[u8; 3]; 16] = [
    [0, 1, 1],
    [0, 1, 2],
    [0, 1, 3],
    [0, 2, 1],
    [0, 2, 2],
    [0, 2, 3],
    [1, 1, 2],
    [1, 2, 2],
    [2, 1, 2],
    [2, 2, 2],
    [3, 1, 2],
    [3, 2, 2],
    [4, 1, 2],
    [4, 2, 2],
    [5, 1, 2],
    [5, 2, 2],
];
const GROUPS: usize = 6;
/// Weights of tilted faces, pads and edges in the fit.
const OTHERS_COUNT: f64 = 0.7;

/// A contact of the ensemble.
struct Member {
    patch: Patch,
    width: f64,
    /// The part of each group in its motion.
    groups: [f64; GROUPS],
    /// How much it counts.
    counts: f64,
    /// The number of its mirror image in the diagonal x = y.
    exchanged: usize,
}

/// The motions by the width, as `sensor/data/contact-widths-8v.bin` has them.
pub struct WidthsSpec {
    /// By knot and column, of all coordinates, focal lengths.
    knots: Vec<Vec<Moved>>,
}

/// The table of the nominal film with a layout that a mirror at either axis does not change, solved
/// by finite elements. This takes minutes.
///
/// # Errors
/// When the film finds no equilibrium.
pub fn contact_widths(layout: Layout) -> Result<WidthsSpec> {
    let members = members()?;
    let presses = Presses::solve(&members)?;
    let camera = Camera::new(Preset::Ov7725, 320, 240)?;
    let discs: Vec<Disc> = layout.centres_mm().into_iter().map(Disc::marker).collect();
    let size = |number: usize| ROOTS[number].powi(2);
    let samples = || (0..ROOTS.len()).flat_map(|k| members.iter().map(move |member| (k, member)));
    let weight = |(number, member): (usize, &Member)| {
        let grows = 0.1 + size(number).powf(1.5);
        member.counts / (grows * (0.15 + member.width.max(0.0)))
    };
    let row = |(number, member): (usize, &Member)| {
        let part = |[group, of_size, of_width]: [u8; 3]| {
            let powers = size(number).powi(of_size.into()) * member.width.powi(of_width.into());
            weight((number, member)) * member.groups[usize::from(group)] * powers
        };
        COLUMNS.map(part).to_vec()
    };
    let through = LeastSquares::new(&samples().map(row).collect::<Vec<_>>())?;
    let along = |k: usize| END_MM * k as f64 / f64::from(KNOTS - 1);
    let count = usize::from(KNOTS);
    let knots = parallel::map(count * count, |knot| {
        let place_mm = [along(knot % count), along(knot / count)];
        let mut shifts = Vec::new();
        for number in 0..ROOTS.len() {
            let seen = |member| presses.seen(place_mm, (number, member), &discs, &camera);
            let needle = seen(None);
            for (k, member) in members.iter().enumerate() {
                let counts = weight((number, member));
                let there = seen(Some((k, member)));
                let pairs = needle.iter().zip(&there);
                let shift = pairs.flat_map(|(from, to)| from.to(to));
                shifts.push(Moved::of(shift.map(|part| counts * part)));
            }
        }
        let mut columns = vec![Moved::defaults(2 * discs.len()); COLUMNS.len()];
        for c in 0..2 * discs.len() {
            let samples: Vec<f64> = shifts.iter().map(|shift| shift[c]).collect();
            for (column, part) in columns.iter_mut().zip(through.coefficients(&samples)) {
                column[c] = part;
            }
        }
        columns
    });
    Ok(WidthsSpec { knots })
}

impl WidthsSpec {
    /// The bytes of the table. A column's step is the largest of its entries over 32,767.
    pub fn to_bytes(&self) -> Vec<u8> {
        let coordinates = self.knots[0][0].len();
        let largest = |number: usize| {
            let entries = self.knots.iter().flat_map(|knot| knot[number].iter());
            entries.fold(0.0, |most: f64, entry| most.max(entry.abs()))
        };
        let steps: Vec<f64> = (0..COLUMNS.len()).map(|k| largest(k) / 32_767.0).collect();
        let mut bytes = vec![KNOTS, coordinates as u8, COLUMNS.len() as u8, 0];
        bytes.extend((END_MM as f32).to_le_bytes());
        for ([group, of_size, of_width], step) in COLUMNS.iter().zip(&steps) {
            bytes.extend([*group, *of_size, *of_width, 0]);
            bytes.extend((*step as f32).to_le_bytes());
        }
        for knot in &self.knots {
            for (column, step) in knot.iter().zip(&steps) {
                for entry in column.iter() {
                    bytes.extend(((entry / step).round() as i16).to_le_bytes());
                }
            }
        }
        bytes
    }
}

/// The film under all contacts at the places of an octant.
struct Presses {
    film: Film,
    /// By place along x, along y (at most that along x), and size: the needle, then all members.
    states: Vec<Vec<Vec<Equilibrium>>>,
}

/// The image of a dot, focal lengths from the axis.
struct Image {
    /// The centroid of its image; `None` if the camera sees it from its edge.
    centroid: Option<[f64; 2]>,
    /// The mean of the images of its rim.
    mean: [f64; 2],
}

impl Image {
    fn of(disc: &Disc, moved: impl Fn([f64; 2]) -> [f64; 3] + Copy, camera: &Camera) -> Image {
        let point = |ray: usize| {
            let (sin, cos) = libm::sincos(TAU * ray as f64 / RIM_POINTS as f64);
            let [x, y] = disc.centre_mm;
            let at_mm = [x + disc.radius_mm * cos, y + disc.radius_mm * sin];
            let [dx, dy, dz] = moved(at_mm);
            let seen_px = camera.project([at_mm[0] + dx, at_mm[1] + dy, dz]);
            in_focal_lengths(seen_px, camera)
        };
        let mean = (0..RIM_POINTS).map(point).fold([0.0; 2], |sum, [x, y]| {
            [
                sum[0] + x / RIM_POINTS as f64,
                sum[1] + y / RIM_POINTS as f64,
            ]
        });
        let is_seen = disc.is_seen(moved, camera);
        let centroid = || in_focal_lengths(disc.centroid_px(moved, camera), camera);
        Image {
            centroid: is_seen.then(centroid),
            mean,
        }
    }

    /// The motion to another image.
    fn to(&self, other: &Image) -> [f64; 2] {
        let ends = self.centroid.zip(other.centroid);
        let (from, to) = ends.unwrap_or((self.mean, other.mean));
        [0, 1].map(|way| to[way] - from[way])
    }
}

/// The number of a place of the octant.
fn in_octant([i, j]: [usize; 2]) -> usize {
    i * (i + 1) / 2 + j
}

impl Presses {
    fn solve(members: &[Member]) -> Result<Presses> {
        let design = Design {
            fineness: FINENESS,
            ..Design::default()
        };
        let octant: Vec<[usize; 2]> = (0..PLACES_MM.len())
            .flat_map(|i| (0..=i).map(move |j| [i, j]))
            .collect();
        let at = |place: &[usize; 2]| {
            // Threads that share a film wait for its factors.
            let film = Film::new(&design)?;
            under_all(&film, members, place.map(|k| PLACES_MM[k]))
        };
        Ok(Presses {
            states: parallel::try_map(octant.len(), |k| at(&octant[k]))?,
            film: Film::new(&design)?,
        })
    }

    /// Images of the dots under a contact at a place along +x and +y: of the needle, or of a member
    /// with its number.
    fn seen(
        &self,
        place_mm: [f64; 2],
        (size, member): (usize, Option<(usize, &Member)>),
        discs: &[Disc],
        camera: &Camera,
    ) -> Vec<Image> {
        let [along_x, along_y] = place_mm.map(weights);
        let moved = |rest_mm: [f64; 2]| {
            let off_mm = [0, 1].map(|way| rest_mm[way] - place_mm[way]);
            let mut sum = [0.0; 3];
            for (i, of_x) in along_x.into_iter().enumerate() {
                for (j, of_y) in along_y.into_iter().enumerate() {
                    let there = self.at([i, j], (size, member), off_mm);
                    for (sum, part) in sum.iter_mut().zip(there) {
                        *sum += of_x * of_y * part;
                    }
                }
            }
            sum
        };
        let image = |disc: &Disc| Image::of(disc, moved, camera);
        discs.iter().map(image).collect()
    }

    /// The displacement at a distance from a contact at a place.
    fn at(
        &self,
        [i, j]: [usize; 2],
        (size, member): (usize, Option<(usize, &Member)>),
        [x, y]: [f64; 2],
    ) -> [f64; 3] {
        let number = |exchanged: bool| match member {
            None => 0,
            Some((_, member)) if exchanged => 1 + member.exchanged,
            Some((number, _)) => 1 + number,
        };
        let (place, off_mm, is_exchanged) = match i >= j {
            true => ([i, j], [x, y], false),
            false => ([j, i], [y, x], true),
        };
        let state = &self.states[in_octant(place)][size][number(is_exchanged)];
        let point = [0, 1].map(|way| PLACES_MM[place[way]] + off_mm[way]);
        let [x, y, z] = self.film.displacement(state, point);
        match is_exchanged {
            true => [y, x, z],
            false => [x, y, z],
        }
    }
}

/// The weights of [`PLACES_MM`] in a parabola through them; beyond the last, those there.
fn weights(at_mm: f64) -> [f64; 3] {
    let [a, b, c] = PLACES_MM;
    let x = at_mm.min(c);
    [
        (x - b) * (x - c) / ((a - b) * (a - c)),
        (x - a) * (x - c) / ((b - a) * (b - c)),
        (x - a) * (x - b) / ((c - a) * (c - b)),
    ]
}

/// The film under growing straight loads at a place: by size, of the needle and all members.
fn under_all(film: &Film, members: &[Member], place_mm: [f64; 2]) -> Result<Vec<Vec<Equilibrium>>> {
    let camera = Camera::new(Preset::Ov7725, 320, 240)?;
    let setup = UnitSetup {
        unit: Unit::default(),
        tip_radius_mm: NOMINAL_RADIUS_MM,
        camera: &camera,
    };
    let [linear_n, cubic_n] = setup.stiffness_n();
    let mut all: Vec<Vec<Equilibrium>> = Vec::new();
    for root in ROOTS {
        let size = LARGEST_SIZE * root.powi(2);
        let force_n = [0.0, 0.0, -size * (linear_n + cubic_n * size.powi(2))];
        let rest = film.rest();
        let before = |k: usize| all.last().map_or(&rest, |states| &states[k]);
        let contact = Contact::Force(force_n);
        let mut states = vec![film.press_at(place_mm, NOMINAL_RADIUS_MM, contact, before(0))?];
        for (k, member) in members.iter().enumerate() {
            states.push(film.press_patch(
                &member.patch.moved_to(place_mm)?,
                force_n,
                before(k + 1),
            )?);
        }
        all.push(states);
    }
    Ok(all)
}

/// The width of a soft disc of this radius, mm.
fn width(disc_mm: f64) -> f64 {
    (disc_mm - f64::from(TIP_MM)) / f64::from(PER_WIDTH_MM)
}

/// All contacts. Turned by a quarter or mirrored, they are the same.
fn members() -> Result<Vec<Member>> {
    let (middle, of_face) = ([0.0; 2], f64::from(OF_FACE));
    let mut members: Vec<Member> = Vec::new();
    let mut add = |patch, disc_mm, groups, counts, exchanged| {
        members.push(Member {
            patch,
            width: width(disc_mm),
            groups,
            counts,
            exchanged,
        });
    };
    let mut number = 0;
    for radius_mm in DISCS_MM {
        let groups = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        add(
            Patch::disc(middle, radius_mm)?,
            radius_mm,
            groups,
            1.0,
            number,
        );
        number += 1;
    }
    for radius_mm in RIMS_MM {
        let groups = [1.0, 0.0, 0.0, 0.0, 0.0, -1.0];
        let rim = Patch::rim(middle, radius_mm, RIM_MM)?;
        add(rim, of_face * radius_mm, groups, 1.0, number);
        number += 1;
    }
    // A kind in all directions; a mirror at the diagonal exchanges these two by two.
    let others = |sum: usize| move |way: usize| (sum + WAYS - way) % WAYS;
    for radius_mm in TILTED_MM {
        let exchanged = others(1);
        for way in 0..WAYS {
            let turn = TAU * way as f64 / WAYS as f64;
            let (sin, cos) = libm::sincos(turn);
            let long = LONG_TILTED * libm::cos(2.0 * turn);
            let groups = [1.0, long, 0.0, cos, sin, -1.0];
            let disc_mm = of_face * OF_TILTED * radius_mm;
            let there = number + exchanged(way);
            add(
                tilted(radius_mm, turn)?,
                disc_mm,
                groups,
                OTHERS_COUNT,
                there,
            );
        }
        number += WAYS;
    }
    // Half a turn changes neither a pad nor an edge.
    let exchanged = others(WAYS / 2);
    for is_pad in [true, false] {
        for way in 0..WAYS {
            let turn = 2.0 * FRAC_PI_2 * way as f64 / WAYS as f64;
            let ([a, b], disc_mm) = if is_pad { PAD_MM } else { EDGE_MM };
            let patch = match is_pad {
                true => Patch::ellipse(middle, [a, b], turn.to_degrees())?,
                false => Patch::line(middle, 2.0 * a, b, turn.to_degrees())?,
            };
            let (long, of_rim) = if is_pad { (1.0, 1.0) } else { (LONG_EDGE, 0.0) };
            let (sin, cos) = libm::sincos(2.0 * turn);
            let groups = [1.0, long * cos, long * sin, 0.0, 0.0, of_rim];
            add(
                patch,
                disc_mm,
                groups,
                OTHERS_COUNT,
                number + exchanged(way),
            );
        }
        number += WAYS;
    }
    Ok(members)
}
