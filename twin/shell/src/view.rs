//! The camera's view of the film, for full solutions.

use hivtac_twin::film::Pressed;
use hivtac_twin::{Camera, Disc, Dots, MARKERS, Preset, disc_motion, seen_motion};

use crate::{Equilibrium, Film, ShellError};

/// A marker on a pressed film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marker {
    /// Its displacement, mm, film frame: the mean over its disc.
    pub moved_mm: [f64; 3],
    /// The centroid of its image, px.
    pub seen_px: [f64; 2],
}

/// Returns the camera for which the film's figures are given: `paper` at 800×600.
///
/// # Errors
/// Never, as long as that preset exists.
pub fn paper_camera() -> Result<Camera, ShellError> {
    Ok(Camera::new(Preset::Paper, 800, 600)?)
}

/// Returns the four markers of a film in a state.
pub fn markers(film: &Film, state: &Equilibrium, camera: &Camera) -> [Marker; 4] {
    let moved = |rest| film.displacement(state, rest);
    MARKERS.map(|disc| Marker {
        moved_mm: disc_motion(moved, &disc).moved_mm,
        seen_px: disc.centroid_px(moved, camera),
    })
}

/// Returns a film in a state in the form that a scene renders. It has the motion at these discs,
/// one for each dot, relative to the flat mounted film.
///
/// # Errors
/// Never, as long as the camera's preset exists.
pub fn pressed(
    film: &Film,
    state: &Equilibrium,
    discs: impl Iterator<Item = Disc>,
) -> Result<Pressed, ShellError> {
    let moved = |point| film.displacement(state, point);
    let camera = paper_camera()?;
    let discs: Vec<Disc> = discs.collect();
    Ok(Pressed {
        centres_mm: Dots::from_fn(discs.len(), |k| discs[k].centre_mm),
        discs: Dots::from_fn(discs.len(), |k| seen_motion(moved, &discs[k], &camera)),
        ..Pressed::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, Design};
    use hivtac_twin::film::{DiscMotion, MARKER_REST_MM};

    fn film() -> Film {
        let design = Design {
            fineness: 0.5,
            ..Design::default()
        };
        Film::new(&design).unwrap()
    }

    /// Returns the mean distance from the optical axis, and the mean shift, px.
    fn radius_and_shift(markers: &[Marker; 4]) -> (f64, [f64; 2]) {
        let (mut radius, mut shift) = (0.0, [0.0; 2]);
        for marker in markers {
            let [x, y] = [marker.seen_px[0] - 399.5, marker.seen_px[1] - 299.5];
            radius += (x * x + y * y).sqrt() / 4.0;
            shift[0] += x / 4.0;
            shift[1] += y / 4.0;
        }
        (radius, shift)
    }

    #[test]
    fn a_press_moves_markers_outward_in_the_picture() {
        let (film, camera) = (film(), paper_camera().unwrap());
        let radius = |force_n: f64| {
            let contact = Contact::Force([0.0, 0.0, -force_n]);
            let state = film.press(contact, &film.rest()).unwrap();
            radius_and_shift(&markers(&film, &state, &camera)).0
        };
        let at_rest = radius_and_shift(&markers(&film, &film.rest(), &camera)).0;
        let of_centre = camera.focal_px() * (MARKER_REST_MM * 2f64.sqrt() / 10.0).atan();
        assert!(
            (0.2..0.4).contains(&(of_centre - at_rest)),
            "the fisheye squeezes the outer half"
        );
        let [slight, full] =
            [(0.009, 0.011), (0.19, 0.21)].map(|(a, b)| (radius(b) - radius(a)) / (b - a));
        // A membrane gets stiffer as it is pressed.
        assert!(slight > 4.0 * full && full > 0.0, "{slight} {full}");
    }

    /// A deep press in front of the post towards which the tip is pushed: there the film is most
    /// curved.
    #[test]
    fn affine_discs_are_seen_where_the_films_are() {
        let (film, camera) = (film(), paper_camera().unwrap());
        let contact = Contact::Stick {
            direction: [0.2, 0.15, -1.0],
            force_n: 0.25,
            slid_mm: [0.0; 2],
        };
        let state = film.press(contact, &film.rest()).unwrap();
        let distance = |motions: [DiscMotion; 4]| {
            let of_marker = |(disc, motion): (Disc, DiscMotion)| {
                let [cx, cy] = disc.centre_mm;
                let [x, y] = disc.centroid_px(|[x, y]| motion.at([x - cx, y - cy]), &camera);
                let full = disc.centroid_px(|rest| film.displacement(&state, rest), &camera);
                (full[0] - x).hypot(full[1] - y)
            };
            MARKERS
                .into_iter()
                .zip(motions)
                .map(of_marker)
                .fold(0.0, f64::max)
        };
        let seen = distance(
            MARKERS.map(|disc| seen_motion(|rest| film.displacement(&state, rest), &disc, &camera)),
        );
        let nearest = distance(
            MARKERS.map(|disc| disc_motion(|rest| film.displacement(&state, rest), &disc)),
        );
        assert!(seen < 1e-4 && nearest > 0.03, "{seen} {nearest} px");
    }

    #[test]
    fn tilting_the_force_shifts_less_than_tilting_the_travel() {
        let (film, camera) = (film(), paper_camera().unwrap());
        let (sin, cos) = 5f64.to_radians().sin_cos();
        let direction = [sin, 0.0, -cos];
        let shift = |contact| {
            let state = film.press(contact, &film.rest()).unwrap();
            radius_and_shift(&markers(&film, &state, &camera)).1
        };
        let [by_force, aside] = shift(Contact::Force(direction.map(|part| 0.2 * part)));
        let [by_travel, _] = shift(Contact::Stick {
            direction,
            force_n: 0.2,
            slid_mm: [0.0; 2],
        });
        assert!(by_force > 0.5 && aside.abs() < 1e-6);
        assert!(by_travel > 5.0 * by_force, "{by_travel} {by_force}");
    }
}
