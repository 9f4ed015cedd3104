//! Discs on the film, such as the markers, and their images.

use std::f64::consts::PI;

use crate::film::{MARKER_CENTRES_MM, MARKER_RADIUS_MM};

use crate::Camera;

/// The markers by identity: 0 upper left, 1 upper right, 2 lower right, 3 lower left in the image.
pub const MARKERS: [Disc; 4] = [
    Disc::marker(MARKER_CENTRES_MM[0]),
    Disc::marker(MARKER_CENTRES_MM[1]),
    Disc::marker(MARKER_CENTRES_MM[2]),
    Disc::marker(MARKER_CENTRES_MM[3]),
];

/// Number of corners of the polygon that stands for a disc's image. The error of its centroid is
/// less than 1e-4 px.
const CORNERS: u32 = 48;
/// Discs with a smaller radius, mm, have fewer corners: they are specks of a few pixels.
const SPECK_RADIUS_MM: f64 = 0.15;
const SPECK_CORNERS: u32 = 12;

/// Roundness of images: below the first they have no centroid of use, from the second on they do.
/// The layout `4` has none below the second.
const ROUNDNESS: [f64; 2] = [0.05, 0.15];
/// The least roundness of a disc that is seen: its image is five to six times as long as wide.
const SEEN: f64 = 0.4;

/// A disc drawn on the film. It moves with the film; its fields hold for the film at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Centre at rest, mm.
    pub centre_mm: [f64; 2],
    /// Radius at rest, mm.
    pub radius_mm: f64,
}

impl Disc {
    /// Returns a marker with its centre at a place, mm.
    pub const fn marker(centre_mm: [f64; 2]) -> Disc {
        Disc {
            centre_mm,
            radius_mm: MARKER_RADIUS_MM,
        }
    }

    /// Returns the centroid of the disc's image, px, on a film whose points (mm) move by
    /// `displacement`. An image without area has none: as the film turns the disc's edge, and then
    /// its back, to the camera, this becomes the mean of the disc's rim.
    pub fn centroid_px(
        &self,
        displacement: impl Fn([f64; 2]) -> [f64; 3],
        camera: &Camera,
    ) -> [f64; 2] {
        self.image(displacement, camera).middle()
    }

    /// Returns whether a camera sees the whole disc, and not its edge, on a film whose points (mm)
    /// move by `displacement`.
    pub fn is_seen(&self, displacement: impl Fn([f64; 2]) -> [f64; 3], camera: &Camera) -> bool {
        let image = self.image(displacement, camera);
        let ([left, top], [right, bottom]) = image.bounds();
        let [width, height] = [camera.width(), camera.height()].map(f64::from);
        let is_inside = left.min(top) > -0.5 && right < width - 0.5 && bottom < height - 0.5;
        is_inside && image.roundness() >= SEEN
    }

    /// Returns the disc's image on a film whose points (mm) move by `displacement`. It is the image
    /// of the disc's rim, not of its centre.
    pub(crate) fn image(
        &self,
        displacement: impl Fn([f64; 2]) -> [f64; 3],
        camera: &Camera,
    ) -> Outline {
        let rim = rim(self.centre_mm, self.radius_mm);
        let seen = rim.map(|[x, y]| {
            let [dx, dy, dz] = displacement([x, y]);
            camera.project([x + dx, y + dy, dz])
        });
        Outline {
            corners: seen.collect(),
        }
    }
}

/// Returns the corners of a regular polygon with the circle's area.
pub(crate) fn rim([x, y]: [f64; 2], radius: f64) -> impl Iterator<Item = [f64; 2]> {
    let corners = if radius < SPECK_RADIUS_MM {
        SPECK_CORNERS
    } else {
        CORNERS
    };
    let step = 2.0 * PI / f64::from(corners);
    let radius = radius * (step / libm::sin(step)).sqrt();
    (0..corners).map(move |corner| {
        let (sin, cos) = libm::sincos(step * f64::from(corner));
        [x + radius * cos, y + radius * sin]
    })
}

/// A closed polygon in the picture, px, clockwise on the screen (x towards y).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outline {
    pub(crate) corners: Vec<[f64; 2]>,
}

impl Outline {
    /// Iterates over the edges of the closed polygon, each from a corner to the next.
    pub(crate) fn edges(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().copied().zip(next.copied())
    }

    /// Returns the smallest and the largest x and y.
    pub(crate) fn bounds(&self) -> ([f64; 2], [f64; 2]) {
        let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        self.corners.iter().fold(start, |(low, high), corner| {
            (
                [low[0].min(corner[0]), low[1].min(corner[1])],
                [high[0].max(corner[0]), high[1].max(corner[1])],
            )
        })
    }

    /// Returns the area in px²; 0 without corners.
    pub(crate) fn area(&self) -> f64 {
        if self.corners.is_empty() {
            return 0.0;
        }
        self.area_and_centroid().0
    }

    /// Returns the area in px² and the centroid in px. There must be corners; with an area of 0 the
    /// centroid is NaN.
    pub(crate) fn area_and_centroid(&self) -> (f64, [f64; 2]) {
        // Moments about a corner, so that no digits are lost far from the origin.
        let [ox, oy] = self.corners[0];
        let (mut twice_area, mut mx, mut my) = (0.0, 0.0, 0.0);
        for ([ax, ay], [bx, by]) in self.edges() {
            let (ax, ay, bx, by) = (ax - ox, ay - oy, bx - ox, by - oy);
            let cross = ax * by - bx * ay;
            twice_area += cross;
            mx += (ax + bx) * cross;
            my += (ay + by) * cross;
        }
        let centroid = [ox + mx / (3.0 * twice_area), oy + my / (3.0 * twice_area)];
        (twice_area / 2.0, centroid)
    }

    /// Returns the area in parts of that of a circle with the same perimeter; negative if the
    /// corners are counterclockwise.
    fn roundness(&self) -> f64 {
        let lengths = self
            .edges()
            .map(|([ax, ay], [bx, by])| libm::hypot(bx - ax, by - ay));
        let perimeter: f64 = lengths.sum();
        4.0 * PI * self.area() / (perimeter * perimeter)
    }

    /// Returns the centroid, px; without roundness, the mean of the corners; between, a part of
    /// each.
    fn middle(&self) -> [f64; 2] {
        let (_, centroid) = self.area_and_centroid();
        let [flat, round] = ROUNDNESS;
        let part = (self.roundness() - flat) / (round - flat);
        if part >= 1.0 {
            return centroid;
        }
        let count = self.corners.len() as f64;
        let mean = [0, 1].map(|c| self.corners.iter().map(|at| at[c]).sum::<f64>() / count);
        if part <= 0.0 {
            return mean;
        }
        let part = part * part * (3.0 - 2.0 * part);
        [0, 1].map(|c| mean[c] + part * (centroid[c] - mean[c]))
    }

    /// Returns the part of the outline inside a frame with a margin around it, px. The result has
    /// no corners if no part is inside.
    pub(crate) fn clipped(&self, width: u32, height: u32, margin: f64) -> Outline {
        let before = 0.5 + margin;
        let right = f64::from(width) - 0.5 + margin;
        let bottom = f64::from(height) - 0.5 + margin;
        self.clip_half(|[x, _]| x + before)
            .clip_half(|[x, _]| right - x)
            .clip_half(|[_, y]| y + before)
            .clip_half(|[_, y]| bottom - y)
    }

    /// Returns the outline shifted as a whole, px.
    pub(crate) fn moved(mut self, [dx, dy]: [f64; 2]) -> Outline {
        for corner in &mut self.corners {
            *corner = [corner[0] + dx, corner[1] + dy];
        }
        self
    }

    /// Returns the part where `inside` (a signed distance) is not negative (Sutherland and
    /// Hodgman).
    fn clip_half(&self, inside: impl Fn([f64; 2]) -> f64) -> Outline {
        let mut corners = Vec::with_capacity(self.corners.len() + 1);
        for (a, b) in self.edges() {
            let (da, db) = (inside(a), inside(b));
            if da >= 0.0 {
                corners.push(a);
            }
            if (da >= 0.0) != (db >= 0.0) {
                let t = da / (da - db);
                corners.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
            }
        }
        Outline { corners }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;
    use crate::film::MARKER_REST_MM;

    fn circle(centre: [f64; 2], radius: f64) -> Outline {
        Outline {
            corners: rim(centre, radius).collect(),
        }
    }

    #[test]
    fn a_circle_has_its_area_and_centroid() {
        let (area, [x, y]) = circle([100.25, 7.5], 6.5).area_and_centroid();
        assert!((area - PI * 42.25).abs() < 1e-9);
        assert!((x - 100.25).abs() < 1e-12 && (y - 7.5).abs() < 1e-12);
    }

    #[test]
    fn clipping_keeps_the_half_inside() {
        let (area, [x, _]) = circle([-0.5, 50.0], 6.0)
            .clipped(320, 240, 0.0)
            .area_and_centroid();
        assert!((area - PI * 18.0).abs() < 1e-6);
        // Centroid of a half disc: 4 r / 3π from its straight side.
        assert!((x + 0.5 - 8.0 / PI).abs() < 0.01);
        let outside = circle([-20.0, 50.0], 6.0).clipped(320, 240, 0.0);
        assert!(outside.corners.is_empty());
    }

    /// Returns the distance from the axis, mm, of the centroid of a resting disc's image on the
    /// diagonal. It is a sum over the disc: each part of the film counts by the area of its image,
    /// r·r′/ρ with r = f·arctan(ρ / D).
    fn centroid_radius_mm(centre_mm: f64, radius_mm: f64) -> f64 {
        const N: i32 = 400;
        let at = |i: i32| (f64::from(i) + 0.5) / f64::from(N) * radius_mm;
        let (mut area, mut moment) = (0.0, 0.0);
        for (i, j) in (-N..N).flat_map(|i| (-N..N).map(move |j| (i, j))) {
            if at(i) * at(i) + at(j) * at(j) > radius_mm * radius_mm {
                continue;
            }
            let along = centre_mm + at(i);
            let rho = (along * along + at(j) * at(j)).sqrt();
            let r = 2.1 * libm::atan(rho / 10.0);
            let slope = 2.1 / (10.0 * (1.0 + rho * rho / 100.0));
            area += r * slope / rho;
            moment += r * slope / rho * (r * along / rho);
        }
        moment / area
    }

    #[test]
    fn the_centroid_is_that_of_the_disc_and_not_the_image_of_its_centre() {
        let camera = Camera::new(Preset::Ov7725, 320, 240).unwrap();
        let image = MARKERS[2].image(|_| [0.0; 3], &camera);
        let (_, [x, y]) = image.area_and_centroid();
        assert!((x - 159.5 - (y - 119.5)).abs() < 1e-9, "on the diagonal");
        let radius_px = (x - 159.5) * std::f64::consts::SQRT_2;
        let expected_mm = centroid_radius_mm(MARKER_REST_MM * std::f64::consts::SQRT_2, 0.5);
        let error_px = radius_px - expected_mm / 0.012;
        assert!(error_px.abs() < 5e-4, "{error_px} px");
        let of_centre_px = 175.0 * libm::atan(MARKER_REST_MM * std::f64::consts::SQRT_2 / 10.0);
        assert!((of_centre_px - 84.694).abs() < 0.001, "{of_centre_px} px");
        assert!(
            of_centre_px - radius_px > 0.1,
            "the fisheye squeezes the outer half"
        );
    }

    /// A disc that turns its edge and then its back to the camera keeps its place in the picture,
    /// although its image has no area there; only from the front is it seen.
    #[test]
    fn a_disc_seen_on_edge_stays_where_it_is() {
        let camera = Camera::new(Preset::Ov7725, 320, 240).unwrap();
        let disc = Disc::marker([7.0, -4.5]);
        let turned = |degrees: f64| {
            let (sin, cos) = libm::sincos(degrees.to_radians());
            move |[x, _]: [f64; 2]| {
                let x = x - 7.0;
                [x * cos - x, 0.0, x * sin]
            }
        };
        let mut before = disc.centroid_px(turned(0.0), &camera);
        for degrees in 1..180 {
            let here = disc.centroid_px(turned(f64::from(degrees)), &camera);
            let moved = libm::hypot(here[0] - before[0], here[1] - before[1]);
            assert!(moved < 0.1, "{degrees}°: {moved} px");
            before = here;
        }
        let is_seen = |degrees: f64| disc.is_seen(turned(degrees), &camera);
        assert!(is_seen(0.0) && !is_seen(90.0) && !is_seen(180.0));
        let aside = |_: [f64; 2]| [4.0, 0.0, -4.0];
        assert!(!disc.is_seen(aside, &camera));
    }
}
