//! The paper's eleven features (Section 5).

use crate::{markers::Marker, units::Px};

/// How many numbers the features are.
pub const FEATURES: usize = 11;

/// x = [x0, y0, x1, y1, x2, y2, x3, y3, x_rect, y_rect, Area_rect].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Features {
    /// Centroids of markers 0–3, (x, y).
    pub centroids: [(Px, Px); 4],
    /// Centre of their bounding rectangle over the real-valued centroids, (x, y).
    pub rect_center: (Px, Px),
    /// Its area in px², Q16.16 in 64 bits (it overflows 32 bits from VGA up).
    pub rect_area: i64,
}

impl Features {
    /// The features of four markers. The centre rounds half up to 1/65,536 px, the area to 1/65,536 px².
    pub fn of_markers(markers: &[Marker; 4]) -> Features {
        let centroids = markers.map(|marker| (marker.x, marker.y));
        let (left, right) = extent(centroids.map(|c| c.0));
        let (top, bottom) = extent(centroids.map(|c| c.1));
        let area_q32 = (right - left) * (bottom - top);
        Features {
            centroids,
            rect_center: (middle(left, right), middle(top, bottom)),
            rect_area: (area_q32 + (1 << (Px::FRACTION_BITS - 1))) >> Px::FRACTION_BITS,
        }
    }

    /// The eleven numbers in the paper's order, each with 16 fractional bits.
    pub fn to_array(&self) -> [i64; FEATURES] {
        let mut numbers = [0; FEATURES];
        for (pair, &(x, y)) in numbers.chunks_exact_mut(2).zip(&self.centroids) {
            pair[0] = i64::from(x.0);
            pair[1] = i64::from(y.0);
        }
        numbers[8] = i64::from(self.rect_center.0.0);
        numbers[9] = i64::from(self.rect_center.1.0);
        numbers[10] = self.rect_area;
        numbers
    }

    /// The other way round; centroids and centre must fit 32 bits.
    pub(crate) fn from_array(numbers: [i64; FEATURES]) -> Features {
        let px = |i: usize| Px(numbers[i] as i32);
        Features {
            centroids: core::array::from_fn(|marker| (px(2 * marker), px(2 * marker + 1))),
            rect_center: (px(8), px(9)),
            rect_area: numbers[10],
        }
    }
}

fn extent(values: [Px; 4]) -> (i64, i64) {
    let low = values.iter().min().map_or(0, |v| i64::from(v.0));
    let high = values.iter().max().map_or(0, |v| i64::from(v.0));
    (low, high)
}

/// Half the sum, rounded half up. The sum of two `i32` halved fits `i32`.
fn middle(low: i64, high: i64) -> Px {
    Px(((low + high + 1) >> 1) as i32)
}
