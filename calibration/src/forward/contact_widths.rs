//! Computes how the width of a contact moves the images of a layout's dots, compared with the
//! nominal tip.

use std::f64::consts::{FRAC_PI_2, TAU};

use anyhow::Result;
use hivtac_sensor::force::forward::{OF_FACE, PER_WIDTH_MM, TIP_MM};
use hivtac_shell::{Contact, Equilibrium, Film, Patch};
use hivtac_twin::film::Layout;
use hivtac_twin::film::reduced::NOMINAL_RADIUS_MM;
use hivtac_twin::{Camera, Disc, Preset};

use super::LeastSquares;
use super::contact_shapes::{RIM_MM, tilted};
use super::covariances::Moved;
use super::motions::MotionsSpec;
use super::presses::{Presses, ROOTS, forces_n};
use crate::parallel;

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

/// The table of the nominal film with a layout that a mirror at either axis does not change, solved
/// by finite elements. This takes minutes.
///
/// # Errors
/// When the film finds no equilibrium.
pub fn contact_widths(layout: Layout) -> Result<MotionsSpec> {
    let members = members()?;
    let forces_n = forces_n()?;
    // The needle, then all members.
    let others = members.iter().map(|member| 1 + member.exchanged);
    let exchanged = [0].into_iter().chain(others).collect();
    let presses = Presses::solve(FINENESS, exchanged, |film, place_mm| {
        under_all(film, &forces_n, &members, place_mm)
    })?;
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
    let places_mm = MotionsSpec::places_mm();
    let knots = parallel::map(places_mm.len(), |knot| {
        let place_mm = places_mm[knot];
        let mut shifts = Vec::new();
        for number in 0..ROOTS.len() {
            let seen = |contact| presses.seen(place_mm, (number, contact), &discs, &camera);
            let needle = seen(0);
            for (k, member) in members.iter().enumerate() {
                let counts = weight((number, member));
                let there = seen(1 + k);
                let pairs = needle.iter().zip(&there);
                let shift = pairs.flat_map(|(from, to)| from.to(to));
                shifts.push(Moved::of(shift.map(|part| counts * part)));
            }
        }
        MotionsSpec::columns(&through, &shifts)
    });
    Ok(MotionsSpec {
        columns: COLUMNS.to_vec(),
        knots,
    })
}

/// The film under growing straight loads at a place: by size, of the needle and all members.
fn under_all(
    film: &Film,
    forces_n: &[[f64; 3]],
    members: &[Member],
    place_mm: [f64; 2],
) -> Result<Vec<Vec<Equilibrium>>> {
    let mut all: Vec<Vec<Equilibrium>> = Vec::new();
    for force_n in forces_n {
        let rest = film.rest();
        let before = |k: usize| all.last().map_or(&rest, |states| &states[k]);
        let contact = Contact::Force(*force_n);
        let mut states = vec![film.press_at(place_mm, NOMINAL_RADIUS_MM, contact, before(0))?];
        for (k, member) in members.iter().enumerate() {
            let patch = member.patch.moved_to(place_mm)?;
            states.push(film.press_patch(&patch, *force_n, before(k + 1))?);
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
