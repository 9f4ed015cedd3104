//! Computes how a torque about the film's normal moves the images of a layout's dots.

use anyhow::Result;
use hivtac_shell::{Contact, Equilibrium, Film};
use hivtac_twin::film::Layout;
use hivtac_twin::film::reduced::NOMINAL_RADIUS_MM;
use hivtac_twin::{Camera, Disc, Preset};

use super::LeastSquares;
use super::covariances::Moved;
use super::motions::MotionsSpec;
use super::presses::{Presses, ROOTS, forces_n};
use crate::parallel;

/// Fineness of the film's mesh: a torque on the tip acts on few cells.
const FINENESS: f64 = 1.5;
/// The torques whose difference is taken, N·mm.
const STEP_NMM: f64 = 0.01;
/// Powers of the size.
const POWERS: [u8; 3] = [1, 2, 3];
/// Numbers of the contacts: turned back and forth. A mirror in a diagonal exchanges them.
const BACK: usize = 0;
const FORTH: usize = 1;

/// The motions by a torque of the straight force times 1 mm, on the nominal film with a layout that
/// a mirror at either axis does not change, solved by finite elements. This takes minutes.
///
/// # Errors
/// When the film finds no equilibrium.
pub fn torques(layout: Layout) -> Result<MotionsSpec> {
    let forces_n = forces_n()?;
    let presses = Presses::solve(FINENESS, vec![FORTH, BACK], |film, place_mm| {
        under_all(film, &forces_n, place_mm)
    })?;
    let camera = Camera::new(Preset::Ov7725, 320, 240)?;
    let discs: Vec<Disc> = layout.centres_mm().into_iter().map(Disc::marker).collect();
    let size = |root: f64| root.powi(2);
    // Steps of the images are as uncertain as they are large.
    let row = |root: f64| {
        POWERS
            .map(|power| size(root).powi(i32::from(power) - 1))
            .to_vec()
    };
    let through = LeastSquares::new(&ROOTS.map(row))?;
    let places_mm = MotionsSpec::places_mm();
    let knots = parallel::map(places_mm.len(), |knot| {
        let place_mm = places_mm[knot];
        let sample = |(number, root): (usize, f64)| {
            let seen = |contact| presses.seen(place_mm, (number, contact), &discs, &camera);
            let (back, forth) = (seen(BACK), seen(FORTH));
            // The motion by |F| · 1 mm, over the size.
            let arm = forces_n[number][2].abs() / (2.0 * STEP_NMM) / size(root);
            let moved = back.iter().zip(&forth).flat_map(|(from, to)| from.to(to));
            Moved::of(moved.map(|part| arm * part))
        };
        let samples: Vec<Moved> = ROOTS.into_iter().enumerate().map(sample).collect();
        MotionsSpec::columns(&through, &samples)
    });
    Ok(MotionsSpec {
        columns: POWERS.map(|power| [0, power, 1]).to_vec(),
        knots,
    })
}

/// The film under growing straight loads at a place, turned back and forth.
fn under_all(
    film: &Film,
    forces_n: &[[f64; 3]],
    place_mm: [f64; 2],
) -> Result<Vec<Vec<Equilibrium>>> {
    let mut before = film.rest();
    let mut all = Vec::new();
    for force_n in forces_n {
        let contact = Contact::Force(*force_n);
        before = film.press_at(place_mm, NOMINAL_RADIUS_MM, contact, &before)?;
        let answer = film.answer_to_torque(&before)?;
        let turned = |torque_nmm: f64| film.beside(&before, &answer, torque_nmm);
        all.push(vec![turned(-STEP_NMM), turned(STEP_NMM)]);
    }
    Ok(all)
}
