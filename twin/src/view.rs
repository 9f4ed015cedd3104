//! The motion of a disc of the film, so that the camera sees the disc where the film has it.

use std::f64::consts::PI;
use std::sync::LazyLock;

use crate::film::DiscMotion;
use crate::{Camera, Disc, Preset};

/// Number of rays of the points from which a disc's motion is computed.
const RAYS: usize = 8;
/// Radii of their rings in parts of the disc's: Gauss's two points for sums over a disc. Each ring
/// stands for half of the area.
const RINGS: [f64; 2] = [0.459_700_843_380_983_1, 0.888_073_833_977_115_3];

/// Shift of discs in the finite difference that gives the size of a pixel, mm.
const SHIFT_MM: f64 = 1e-3;

/// Returns the camera by which discs are seen: `paper` at 800×600. Others of that distance see them
/// alike.
pub(crate) fn paper_camera() -> &'static Camera {
    static CAMERA: LazyLock<Camera> = LazyLock::new(|| {
        Camera::new(Preset::Paper, 800, 600).expect("the preset has frames of that size")
    });
    &CAMERA
}

/// Returns the affine map nearest to the displacement over a disc: the mean, and the slopes 4/R² ·
/// mean(u · (x, y)).
pub fn disc_motion(moved: impl Fn([f64; 2]) -> [f64; 3], disc: &Disc) -> DiscMotion {
    let mut motion = DiscMotion::default();
    let [cx, cy] = disc.centre_mm;
    let count = (RAYS * RINGS.len()) as f64;
    let slope = 4.0 / (disc.radius_mm * disc.radius_mm * count);
    for ring in RINGS {
        for ray in 0..RAYS {
            let (sin, cos) = libm::sincos(ray as f64 * 2.0 * PI / RAYS as f64);
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
pub fn seen_motion(
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
