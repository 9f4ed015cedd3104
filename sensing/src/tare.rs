//! Tare: the rest position of this unit, measured as the mean of good frames.

use hivtac_force::features::{FEATURES, Features};
use hivtac_force::rest::Rest;
use hivtac_terms::marker::Marker;

/// Most frames in a mean: the sums then stay far inside their types.
pub const MAX_FRAMES: u16 = 256;

/// Sums up good frames until there are enough. All sums are exact; each mean is rounded once, half
/// up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TareBuilder {
    wanted: u16,
    taken: u16,
    features: [i64; FEATURES],
    areas: [u64; 4],
}

impl TareBuilder {
    /// For a mean of `frames` good frames, 1 to [`MAX_FRAMES`]; `None` for any other number.
    pub fn new(frames: u16) -> Option<TareBuilder> {
        let wanted = frames;
        let empty = TareBuilder {
            wanted,
            taken: 0,
            features: [0; FEATURES],
            areas: [0; 4],
        };
        (1..=MAX_FRAMES).contains(&frames).then_some(empty)
    }

    /// Takes the markers and features of a good frame. Gives the rest position once there were
    /// enough, and from then on the same again.
    pub fn add(&mut self, markers: &[Marker; 4], features: &Features) -> Option<Rest> {
        if self.taken < self.wanted {
            self.taken += 1;
            for (sum, feature) in self.features.iter_mut().zip(features.to_array()) {
                *sum += feature;
            }
            for (sum, marker) in self.areas.iter_mut().zip(markers) {
                *sum += u64::from(marker.area);
            }
        }
        (self.taken == self.wanted).then(|| self.mean())
    }

    /// How many good frames are still wanted.
    pub fn remaining(&self) -> u16 {
        self.wanted - self.taken
    }

    fn mean(&self) -> Rest {
        let frames = i64::from(self.taken);
        let mean = |sum: i64| (2 * sum + frames).div_euclid(2 * frames);
        Rest {
            features: Features::from_array(self.features.map(mean)),
            areas: self.areas.map(|sum| mean(sum as i64) as u32),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::units::Px;

    fn frame(x: i32, area: u32) -> ([Marker; 4], Features) {
        let at = |x, y| Marker {
            x: Px(x),
            y: Px(y),
            area,
        };
        let markers = [at(x, 0), at(x + 50, 1), at(x + 51, 40), at(x, 41)];
        (markers, Features::of_markers(&markers))
    }

    #[test]
    fn the_mean_is_rounded_once() {
        let mut builder = TareBuilder::new(3).unwrap();
        for (x, area, remaining) in [(10, 100, 2), (10, 101, 1)] {
            let (markers, features) = frame(x, area);
            assert_eq!(builder.add(&markers, &features), None);
            assert_eq!(builder.remaining(), remaining);
        }
        let (markers, features) = frame(12, 101);
        let rest = builder.add(&markers, &features).unwrap();
        assert_eq!(rest.features.centroids[0], (Px(11), Px(0)), "32/3 = 10.67");
        assert_eq!(rest.areas, [101; 4], "302/3 = 100.67");
        assert_eq!(
            builder.add(&markers, &features),
            Some(rest),
            "more frames change nothing"
        );
    }

    #[test]
    fn halves_round_up_on_both_sides_of_zero() {
        for (first, second, mean) in [(1, 2, 2), (-1, -2, -1), (-1, 0, 0)] {
            let mut builder = TareBuilder::new(2).unwrap();
            let (markers, features) = frame(first, 5);
            builder.add(&markers, &features);
            let (markers, features) = frame(second, 5);
            let rest = builder.add(&markers, &features).unwrap();
            assert_eq!(rest.features.centroids[0].0, Px(mean));
        }
    }

    #[test]
    fn one_frame_is_its_own_mean() {
        let (markers, features) = frame(123_456, 7);
        let rest = TareBuilder::new(1)
            .unwrap()
            .add(&markers, &features)
            .unwrap();
        assert_eq!((rest.features, rest.areas), (features, [7; 4]));
    }

    #[test]
    fn the_number_of_frames_is_checked() {
        assert!(TareBuilder::new(0).is_none());
        assert!(TareBuilder::new(MAX_FRAMES + 1).is_none());
        assert!(TareBuilder::new(MAX_FRAMES).is_some());
    }

    #[test]
    fn the_largest_sums_fit() {
        let largest = Features {
            centroids: [(Px(i32::MAX), Px(i32::MAX)); 4],
            rect_center: (Px(i32::MAX), Px(i32::MAX)),
            rect_area: (800 * 800) << 16,
        };
        let markers = [Marker {
            x: Px(0),
            y: Px(0),
            area: u32::MAX,
        }; 4];
        let mut builder = TareBuilder::new(MAX_FRAMES).unwrap();
        let rest = (0..MAX_FRAMES)
            .find_map(|_| builder.add(&markers, &largest))
            .unwrap();
        assert_eq!((rest.features, rest.areas), (largest, [u32::MAX; 4]));
    }
}
