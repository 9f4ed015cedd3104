//! Computes the paper's features (Section 5): eleven numbers of four markers.

use hivtac_terms::fixed::Q;
use hivtac_terms::list::List;
use hivtac_terms::marker::{MOST_MARKERS, Marker};
use hivtac_terms::units::Px;

/// Number of features of four markers.
pub const FEATURES: usize = 11;
/// Number of coordinates, which come first; the last feature is an area.
pub const COORDINATES: usize = 10;

/// Centroids of markers, (x, y).
pub type Centroids = List<(Px, Px), MOST_MARKERS>;

/// Of four markers: x = [x0, y0, x1, y1, x2, y2, x3, y3, x_rect, y_rect, Area_rect].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Features {
    /// Centroids of the markers.
    pub centroids: Centroids,
    /// Centre of the bounding rectangle of the real-valued centroids, (x, y).
    pub rect_center: (Px, Px),
    /// Area of that rectangle, px² (it overflows 32 bits from VGA up).
    pub rect_area: Q<16, i64>,
}

impl Features {
    /// Returns the features of markers. The centre is rounded half up to 1/65,536 px, the area
    /// to 1/65,536 px².
    pub fn of_markers(markers: &[Marker]) -> Features {
        let centroids = markers.iter().map(|marker| (marker.x, marker.y));
        let (left, right) = extent(markers.iter().map(|marker| marker.x));
        let (top, bottom) = extent(markers.iter().map(|marker| marker.y));
        let span = |low: Px, high: Px| i64::from(high.0) - i64::from(low.0);
        let area: Q<32, i64> = Q::from_bits(span(left, right) * span(top, bottom));
        Features {
            centroids: List::of(centroids),
            rect_center: (middle(left, right), middle(top, bottom)),
            rect_area: area.rounded_to(),
        }
    }

    /// All of the first four markers but the area, in the paper's order.
    pub fn coordinates(&self) -> [Px; COORDINATES] {
        let [(x0, y0), (x1, y1), (x2, y2), (x3, y3)] = self.centroids.array();
        let (x, y) = self.rect_center;
        [x0, y0, x1, y1, x2, y2, x3, y3, x, y]
    }

    /// The eleven numbers of the first four markers in the paper's order: px, the last one px².
    pub fn to_array(&self) -> [Q<16, i64>; FEATURES] {
        let mut numbers = [self.rect_area; FEATURES];
        for (number, coordinate) in numbers.iter_mut().zip(self.coordinates()) {
            *number = coordinate.into();
        }
        numbers
    }

    /// The inverse of [`Features::to_array`]; centroids and centre must fit 32 bits.
    pub fn from_array(numbers: [Q<16, i64>; FEATURES]) -> Features {
        let px = |i: usize| Px(numbers[i].narrowed().bits());
        Features {
            centroids: List::from_fn(4, |marker| (px(2 * marker), px(2 * marker + 1))),
            rect_center: (px(8), px(9)),
            rect_area: numbers[10],
        }
    }
}

/// The smallest and the largest value.
fn extent(values: impl Iterator<Item = Px> + Clone) -> (Px, Px) {
    let low = values.clone().min();
    (low.unwrap_or_default(), values.max().unwrap_or_default())
}

/// Half the sum, rounded half up. The sum of two `i32` halved fits `i32`.
fn middle(Px(low): Px, Px(high): Px) -> Px {
    Px(((i64::from(low) + i64::from(high) + 1) >> 1) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marker(x: f64, y: f64) -> Marker {
        let px = |value: f64| Px((value * 65_536.0) as i32);
        Marker {
            x: px(x),
            y: px(y),
            area: 1,
        }
    }

    #[test]
    fn the_rectangle_is_that_of_the_centroids() {
        let turned = [
            marker(10.5, 11.25),
            marker(20.0, 10.0),
            marker(21.5, 20.0),
            marker(11.0, 22.0),
        ];
        let features = Features::of_markers(&turned);
        assert_eq!(features.rect_center.0.to_f64(), 16.0);
        assert_eq!(features.rect_center.1.to_f64(), 16.0);
        assert_eq!(features.rect_area, Q::from_int(11 * 12));
        assert_eq!(features.centroids[2], (turned[2].x, turned[2].y));
    }

    #[test]
    fn the_largest_frame_fits() {
        let corners = [
            marker(0.0, 0.0),
            marker(799.0, 0.0),
            marker(799.0, 599.0),
            marker(0.0, 599.0),
        ];
        let features = Features::of_markers(&corners);
        assert_eq!(features.rect_area, Q::from_int(799 * 599));
        assert_eq!(features.rect_center.0.to_f64(), 399.5);
        assert_eq!(features.rect_center.1.to_f64(), 299.5);
    }

    #[test]
    fn area_and_centre_round_to_nearest() {
        let mut markers = [marker(0.0, 0.0); 4];
        markers[2] = Marker {
            x: Px(3),
            y: Px(1 << 15),
            area: 1,
        };
        let features = Features::of_markers(&markers);
        assert_eq!(features.rect_center, (Px(2), Px(1 << 14)), "1.5 rounds up");
        assert_eq!(features.rect_area.bits(), 2, "1.5 rounds up");
    }

    #[test]
    fn the_array_is_in_the_papers_order_and_comes_back() {
        let markers = [
            marker(1.0, 2.0),
            marker(3.0, 4.0),
            marker(5.0, 6.0),
            marker(7.0, 8.0),
        ];
        let features = Features::of_markers(&markers);
        let array = features.to_array().map(|number| number.floor());
        assert_eq!(array, [1, 2, 3, 4, 5, 6, 7, 8, 4, 5, 36]);
        assert_eq!(Features::from_array(features.to_array()), features);
    }
}
