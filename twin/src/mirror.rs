//! A camera board's own LEDs, as a glossy film mirrors them.
//!
//! Light takes the path whose length is least among its neighbours: from the LED to a point of the
//! film and on to the pinhole. A film that is pressed bulges towards the camera, and mirrors the
//! LEDs smaller and farther in.

use crate::disc::{Outline, rim};
use crate::{Camera, FILM_DISTANCE_MM};

/// The LEDs of the usual OV7725 board from its lens's axis, mm (the board's drawing).
const LEDS_MM: [[f64; 2]; 4] = [[-11.6, -10.2], [11.6, -10.2], [11.6, 10.2], [-11.6, 10.2]];
/// Radius of the shining part of an LED of size 2835, mm.
const LED_RADIUS_MM: f64 = 1.5;
/// First and last step of the search for a reflection, mm.
const STEPS_MM: [f64; 2] = [0.5, 1e-3];

/// Returns the images of the LEDs of a board that is `board_mm` behind the pinhole, on a film whose
/// points (mm) move by `displacement`.
pub(crate) fn images(
    board_mm: f64,
    displacement: impl Fn([f64; 2]) -> [f64; 3],
    camera: &Camera,
) -> [Outline; 4] {
    LEDS_MM.map(|led| {
        let at = |[x, y]: [f64; 2]| reflection([x, y], board_mm, &displacement);
        let centre = at(led);
        // An LED is small enough for its image to be an ellipse.
        let [along_x, along_y] = [[LED_RADIUS_MM, 0.0], [0.0, LED_RADIUS_MM]].map(|step| {
            let aside = at([led[0] + step[0], led[1] + step[1]]);
            [0, 1].map(|axis| aside[axis] - centre[axis])
        });
        let corners = rim([0.0; 2], 1.0).map(|[x, y]| {
            let place = [0, 1].map(|axis| centre[axis] + x * along_x[axis] + y * along_y[axis]);
            camera.project(moved(place, displacement(place)))
        });
        Outline {
            corners: corners.collect(),
        }
    })
}

fn moved([x, y]: [f64; 2], [dx, dy, dz]: [f64; 3]) -> [f64; 3] {
    [x + dx, y + dy, dz]
}

/// Returns the point of the film, at rest, that mirrors the point `led` of the board.
fn reflection(
    led: [f64; 2],
    board_mm: f64,
    displacement: &impl Fn([f64; 2]) -> [f64; 3],
) -> [f64; 2] {
    let far_mm = FILM_DISTANCE_MM + board_mm;
    let length = |place: [f64; 2]| {
        let [x, y, z] = moved(place, displacement(place));
        let leg = |[to_x, to_y]: [f64; 2], height: f64| {
            libm::sqrt((x - to_x) * (x - to_x) + (y - to_y) * (y - to_y) + height * height)
        };
        leg([0.0; 2], z + FILM_DISTANCE_MM) + leg(led, z + far_mm)
    };
    // Where a film at rest has it.
    let mut best = led.map(|at| at * FILM_DISTANCE_MM / (FILM_DISTANCE_MM + far_mm));
    let mut least = length(best);
    let [mut step, last] = STEPS_MM;
    while step > last {
        let [x, y] = best;
        let around = [[x + step, y], [x - step, y], [x, y + step], [x, y - step]];
        match around.into_iter().find(|place| length(*place) < least) {
            Some(nearer) => (best, least) = (nearer, length(nearer)),
            None => step /= 2.0,
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;

    #[test]
    fn a_flat_film_mirrors_them_next_to_the_markers() {
        let camera = Camera::new(Preset::Ov7725, 320, 240).unwrap();
        // 154 mm² / (20 mm + h) from the middle: 5.3 mm at h = 9 mm, where the markers are.
        for (board_mm, expected_mm) in [(7.0, 5.72), (9.0, 5.33), (12.0, 4.83)] {
            let images = images(board_mm, |_| [0.0; 3], &camera);
            for image in images {
                let (area, [x, y]) = image.area_and_centroid();
                let seen = libm::hypot(x - 159.5, y - 119.5);
                let angle = seen / camera.focal_px();
                let far_mm = FILM_DISTANCE_MM * libm::tan(angle);
                assert!((far_mm - expected_mm).abs() < 0.05, "{board_mm}: {far_mm}");
                assert!((60.0..260.0).contains(&area), "{board_mm}: {area}");
            }
        }
    }

    #[test]
    fn a_bulge_mirrors_them_smaller_and_farther_in() {
        let camera = Camera::new(Preset::Ov7725, 320, 240).unwrap();
        let flat = images(9.0, |_| [0.0; 3], &camera);
        let bulge = |[x, y]: [f64; 2]| [0.0, 0.0, -2.0 * libm::exp(-(x * x + y * y) / 50.0)];
        let bulged = images(9.0, bulge, &camera);
        for (flat, bulged) in flat.iter().zip(&bulged) {
            assert!(bulged.area() < 0.9 * flat.area());
        }
    }
}
