//! What the camera sees of the film.

use hivtac_scene::{Camera, Preset};

use crate::{Equilibrium, Film, FilmError};

/// Distance of a marker from the centre along x and along y, mm (`docs/architecture.md`).
pub const MARKER_MM: f64 = 3.717;
/// Where the markers rest, in the order of their identities: upper left, upper right, lower right, lower left.
pub const MARKERS_MM: [[f64; 2]; 4] = [
    [-MARKER_MM, -MARKER_MM],
    [MARKER_MM, -MARKER_MM],
    [MARKER_MM, MARKER_MM],
    [-MARKER_MM, MARKER_MM],
];

/// A marker's centre on a pressed film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marker {
    /// How it moved, mm, film frame.
    pub moved_mm: [f64; 3],
    /// Where it is seen, px.
    pub seen_px: [f64; 2],
}

/// The camera in which the film's figures are stated: `paper` at 800×600.
///
/// # Errors
/// Never, while that preset exists.
pub fn paper_camera() -> Result<Camera, FilmError> {
    Camera::new(Preset::Paper, 800, 600).map_err(|error| FilmError::Scene(error.to_string()))
}

/// The four markers of a film in a state.
pub fn markers(film: &Film, state: &Equilibrium, camera: &Camera) -> [Marker; 4] {
    MARKERS_MM.map(|rest| {
        let moved_mm = film.displacement(state, rest);
        Marker {
            moved_mm,
            seen_px: seen(rest, moved_mm, camera),
        }
    })
}

/// Where the camera sees a point of the film's camera side; that side rests at the film's distance.
pub(crate) fn seen([x, y]: [f64; 2], [dx, dy, dz]: [f64; 3], camera: &Camera) -> [f64; 2] {
    camera.project([x + dx, y + dy, dz])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, Design};

    fn film() -> Film {
        let design = Design {
            fineness: 0.5,
            ..Design::default()
        };
        Film::new(&design).unwrap()
    }

    /// Mean distance from the optical axis, and mean shift, px.
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
        let expected = camera.focal_px() * (MARKER_MM * 2f64.sqrt() / 10.0).atan();
        assert!((at_rest - expected).abs() < 1e-9);
        let [slight, full] =
            [(0.009, 0.011), (0.19, 0.21)].map(|(a, b)| (radius(b) - radius(a)) / (b - a));
        // A membrane stiffens as it is pressed.
        assert!(slight > 4.0 * full && full > 0.0, "{slight} {full}");
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
        });
        assert!(by_force > 0.5 && aside.abs() < 1e-6);
        assert!(by_travel > 5.0 * by_force, "{by_travel} {by_force}");
    }
}
