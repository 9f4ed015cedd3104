//! The camera's view of the film, for full solutions.

use std::f64::consts::PI;

use hivtac_twin::film::{DiscMotion, Pressed};
use hivtac_twin::{Camera, Disc, MARKERS, Preset};

use crate::{Equilibrium, Film, ShellError};

/// Number of rays of the points from which a disc's motion is computed.
const RAYS: usize = 8;
/// Radii of their rings in parts of the disc's: Gauss's two points for sums over a disc. Each ring
/// stands for half of the area.
const RINGS: [f64; 2] = [0.459_700_843_380_983_1, 0.888_073_833_977_115_3];

/// Shift of discs in the finite difference that gives the size of a pixel, mm.
const SHIFT_MM: f64 = 1e-3;

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

/// Returns a film in a state in the form that a scene renders. It has the motion at the first four
/// of these discs, relative to the flat mounted film.
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
    let mut pressed = Pressed::default();
    let places = pressed.centres_mm.iter_mut().zip(&mut pressed.discs);
    for ((centre_mm, motion), disc) in places.zip(discs) {
        *centre_mm = disc.centre_mm;
        *motion = seen_motion(moved, &disc, &camera);
    }
    Ok(pressed)
}

/// Returns the affine map nearest to the displacement over a disc: the mean, and the slopes 4/R² ·
/// mean(u · (x, y)).
fn disc_motion(moved: impl Fn([f64; 2]) -> [f64; 3], disc: &Disc) -> DiscMotion {
    let mut motion = DiscMotion::default();
    let [cx, cy] = disc.centre_mm;
    let count = (RAYS * RINGS.len()) as f64;
    let slope = 4.0 / (disc.radius_mm * disc.radius_mm * count);
    for ring in RINGS {
        for ray in 0..RAYS {
            let (sin, cos) = (ray as f64 * 2.0 * PI / RAYS as f64).sin_cos();
            let [x, y] = [cos, sin].map(|part| ring * disc.radius_mm * part);
            for (c, part) in moved([cx + x, cy + y]).into_iter().enumerate() {
                motion.moved_mm[c] += part / count;
                motion.along_x[c] += slope * part * x;
                motion.along_y[c] += slope * part * y;
            }
        }
    }
    motion
}

/// Returns the affine map nearest to the displacement over a disc, shifted along the film to give
/// the same centroid in the camera as the film. Without the shift, the centroid is some hundredths
/// of a pixel off if the film is curved within the disc.
pub(crate) fn seen_motion(
    film: impl Fn([f64; 2]) -> [f64; 3],
    disc: &Disc,
    camera: &Camera,
) -> DiscMotion {
    let mut motion = disc_motion(&film, disc);
    let [x, y] = disc.centroid_px(&film, camera);
    let seen = |shift: [f64; 2]| {
        let moved = |[px, py]: [f64; 2]| {
            let [cx, cy] = disc.centre_mm;
            let [dx, dy, dz] = motion.at([px - cx, py - cy]);
            [dx + shift[0], dy + shift[1], dz]
        };
        disc.centroid_px(moved, camera)
    };
    let here = seen([0.0; 2]);
    let step = |way| {
        let there = seen(way);
        [0, 1].map(|c| (there[c] - here[c]) / SHIFT_MM)
    };
    let ([xx, yx], [xy, yy]) = (step([SHIFT_MM, 0.0]), step([0.0, SHIFT_MM]));
    let (aside, below) = (x - here[0], y - here[1]);
    let whole = xx * yy - xy * yx;
    motion.moved_mm[0] += (yy * aside - xy * below) / whole;
    motion.moved_mm[1] += (xx * below - yx * aside) / whole;
    motion
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, Design};
    use hivtac_twin::film::MARKER_REST_MM;

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
