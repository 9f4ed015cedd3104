//! The truth drawn into a picture.

use hivtac_twin::Truth;

use super::canvas::{BLACK, CHARACTER, CYAN, Canvas};

/// Draws a cross at each marker's true centroid and its identity beside it, into a picture of a
/// frame at a scale.
pub fn draw(canvas: &mut Canvas, truth: &Truth, scale: u32) {
    for (id, marker) in truth.markers.iter().enumerate() {
        if let Some(marker) = marker {
            let at = marker.centroid_px.map(|px| in_picture(px, scale));
            cross(canvas, at, scale);
            // Towards the outside of the pattern, where no other marker is.
            let width = i64::from(scale * CHARACTER);
            let right = [1, 2].contains(&id);
            let beside = 10 * i64::from(scale);
            let x = at[0] + if right { beside } else { -beside - width };
            canvas.edged_text([x, at[1] - width / 2], scale, &id.to_string(), CYAN);
        }
    }
}

/// The pixel of a picture at a scale in which a point of the frame lies.
fn in_picture(px: f64, scale: u32) -> i64 {
    ((px + 0.5) * f64::from(scale)).floor() as i64
}

/// A cross of one-pixel lines, whatever the scale, with a dark edge: its middle is the place.
fn cross(canvas: &mut Canvas, [x, y]: [i64; 2], scale: u32) {
    let arm = 3 * i64::from(scale);
    let length = 2 * arm + 1;
    if scale > 2 {
        canvas.fill([x - arm - 1, y - 1], [length + 2, 3], BLACK);
        canvas.fill([x - 1, y - arm - 1], [3, length + 2], BLACK);
    }
    canvas.fill([x - arm, y], [length, 1], CYAN);
    canvas.fill([x, y - arm], [1, length], CYAN);
}
