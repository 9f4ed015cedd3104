//! The eight mirrors and turns under which a square film looks the same.

use hivtac_twin::MARKERS;
use hivtac_twin::film::DiscMotion;
use hivtac_twin::film::reduced::Pose;

/// A mirror: v becomes `matrix`·v along the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror([[f64; 2]; 2]);

impl Mirror {
    /// Iterates over all eight.
    pub fn all() -> impl Iterator<Item = Mirror> {
        let signs = [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];
        signs
            .into_iter()
            .flat_map(|[x, y]| [Mirror([[x, 0.0], [0.0, y]]), Mirror([[0.0, x], [y, 0.0]])])
    }

    /// Returns a place, tilt or shift along the film, mirrored.
    pub fn along(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        self.0.map(|[a, b]| a * x + b * y)
    }

    /// Returns a vector mirrored.
    pub fn vector(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [x, y] = self.along([x, y]);
        [x, y, z]
    }

    /// Returns a load mirrored.
    pub fn pose(&self, pose: &Pose) -> Pose {
        Pose {
            size: pose.size,
            tilt: self.along(pose.tilt),
            place_mm: self.along(pose.place_mm),
        }
    }

    /// Returns the marker that is mirrored to the corner of marker 2.
    pub fn corner(&self) -> usize {
        self.seen_as(MARKERS[2].centre_mm)
    }

    /// Returns the post or marker that is mirrored to a corner.
    pub fn seen_as(&self, [x, y]: [f64; 2]) -> usize {
        let is_it = |k: &usize| {
            let [sx, sy] = self.along(MARKERS[*k].centre_mm);
            sx * x > 0.0 && sy * y > 0.0
        };
        (0..4).find(is_it).unwrap_or_default()
    }

    /// Returns a disc's motion mirrored.
    pub fn disc(&self, disc: &DiscMotion) -> DiscMotion {
        let [[a, b], [c, d]] = self.0;
        let mix = |x: f64, y: f64| -> [f64; 3] {
            let mixed = std::array::from_fn(|k| x * disc.along_x[k] + y * disc.along_y[k]);
            self.vector(mixed)
        };
        DiscMotion {
            moved_mm: self.vector(disc.moved_mm),
            along_x: mix(a, b),
            along_y: mix(c, d),
        }
    }

    /// Mirrors rows that were differentiated by the components of a vector along the film.
    pub fn components(&self, [by_x, by_y]: [Vec<f64>; 2]) -> [Vec<f64>; 2] {
        self.0.map(|[a, b]| {
            let pairs = by_x.iter().zip(&by_y);
            pairs.map(|(x, y)| a * x + b * y).collect()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_marker_is_seen_in_the_corner_twice() {
        let mut seen: Vec<usize> = Mirror::all().map(|mirror| mirror.corner()).collect();
        seen.sort_unstable();
        assert_eq!(seen, [0, 0, 1, 1, 2, 2, 3, 3]);
    }

    #[test]
    fn a_disc_moves_as_what_it_is_seen_to_be() {
        let disc = DiscMotion {
            moved_mm: [0.1, 0.2, 0.3],
            along_x: [0.4, -0.5, 0.6],
            along_y: [-0.7, 0.8, 0.9],
        };
        for mirror in Mirror::all() {
            let seen = mirror.disc(&disc);
            for at in [[0.3, 0.1], [-0.2, 0.5]] {
                let expected = mirror.vector(disc.at(at));
                for (a, b) in seen.at(mirror.along(at)).iter().zip(expected) {
                    assert!((a - b).abs() < 1e-12, "{mirror:?}");
                }
            }
        }
    }
}
