//! Compares the film on both sides of a marker: light through the film on one side shifts the
//! marker.
//!
//! The weights of a marker's soft edge assume an even film around it. Behind a film that lets light
//! through, a fingertip or a red thing changes redness and brightness of the film next to the
//! marker. Pixels that the marker covers in part then weigh more or less than that part. So each
//! pixel next to a blob has a *pull*: how far it moves the edge of a marker, up to a constant. A
//! difference of pull between two sides shifts the centroid ([`Beside::shift_px2`]). An even
//! surrounding shifts nothing.

use crate::markers::runs::Run;

/// Steps of pull per pixel by which the edge moves: the weight of a pixel that a marker covers
/// wholly.
const PER_PX: f32 = 95.0;
/// Distance from a run at which the film is seen, px: more than the lens smears a marker's edge.
const FAR_PX: u16 = 2;
/// Pull by brightness, of 5 bits: −15.5 times its natural logarithm, and a constant. A film twice
/// as bright on one side moves the edge there by 0.11 px, because weights are ratios to the red.
const BY_LEVEL: [u8; 32] = [
    64, 47, 39, 34, 30, 27, 24, 22, 20, 19, 17, 16, 14, 13, 12, 11, 10, 9, 8, 7, 7, 6, 5, 5, 4, 3,
    3, 2, 2, 1, 1, 0,
];

/// Pixels of more weight are no film: a speck or another thing of a marker's colour.
const MOST_WEIGHT: u8 = 64;

/// Returns the pull of a pixel with this weight and brightness, of 5 bits: 0 to 160.
#[inline(always)]
pub(super) fn pull(weight: u8, level: u16) -> u8 {
    let by_level = BY_LEVEL.get(usize::from(level % 32)).copied();
    by_weight(weight) + by_level.unwrap_or(0)
}

/// Returns the pull of a pixel's weight. It counts in the pixels beyond the marker's edge, and half
/// as much in those on it.
#[inline(always)]
pub(super) fn by_weight(weight: u8) -> u8 {
    match weight {
        0..=MOST_WEIGHT => weight + weight / 2,
        _ => 0,
    }
}

/// Sums of the pull next to the runs of a blob, of its even rows. For a blob larger than any marker
/// they may wrap at 2³².
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Beside {
    /// On both sides.
    pub both: u32,
    /// On the right, less that on the left.
    pub right: i32,
    /// On both sides, times the row.
    pub by_row: u32,
}

impl Beside {
    /// No pixels.
    pub const NONE: Beside = Beside {
        both: 0,
        right: 0,
        by_row: 0,
    };

    /// Returns whether the film next to this row is used: half of the rows suffice.
    #[inline(always)]
    pub(super) fn is_looked_at(y: u16) -> bool {
        y.is_multiple_of(2)
    }

    /// Adds the pull of the pixels left and right of a run in row `y`.
    #[inline(always)]
    pub(super) fn add_row(&mut self, [left, right]: [u8; 2], y: u16) {
        let both = u32::from(left) + u32::from(right);
        self.both += both;
        self.right += i32::from(right) - i32::from(left);
        self.by_row = self.by_row.wrapping_add(both * u32::from(y));
    }

    /// Adds the sums of another part of the same blob.
    pub(super) fn add(&mut self, other: &Beside) {
        self.both += other.both;
        self.right += other.right;
        self.by_row = self.by_row.wrapping_add(other.by_row);
    }

    /// Returns the square of the shift of a marker's centroid, px², that the difference between its
    /// sides makes. The marker is a disc of this area in rows `y0` to `y1`.
    ///
    /// An edge that moves by e(θ) at the angle θ shifts the centroid of a disc by ∫ e·(cos θ, sin
    /// θ) dθ / π. Rows meet the edge at even steps of sin θ: of e(θ) they see cos θ dθ. So of two
    /// halves, right and left, they see nearly all, and of two halves above and below just half.
    pub fn shift_px2(&self, area: u32, [y0, y1]: [u16; 2]) -> f32 {
        let rows = (y0 + y0 % 2, y1 - y1 % 2);
        // Twice the middle of the even rows: a constant pull then cancels.
        let below = 2 * i64::from(self.by_row)
            - i64::from(self.both) * (i64::from(rows.0) + i64::from(rows.1));
        let area = area.max(1) as f32;
        let right = self.right as f32;
        // The radius r is √(area / π). Of every second row, Σ right is r·∫ e cos θ dθ / 2.
        const FOUR_OVER_PI: f32 = 4.0 / core::f32::consts::PI;
        let below = 2.0 * below as f32;
        let by = 1.0 / (area * PER_PX);
        (FOUR_OVER_PI * area * right * right + below * below) * by * by
    }
}

/// The columns next to a run in which the film is seen; `None` left of the picture.
#[inline(always)]
pub(super) fn columns(run: Run) -> (Option<u16>, u16) {
    (run.x0.checked_sub(FAR_PX), run.x1 + FAR_PX)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shift, px, of a disc with these pulls of the film at its edge, by the angle's cosine and
    /// sine.
    fn shift(radius: f64, pull: impl Fn(f64, f64) -> u8) -> f32 {
        let mut beside = Beside::NONE;
        let middle = 100.0;
        let ends = [middle - radius, middle + radius].map(|end| end.round() as u16);
        for y in (ends[0]..=ends[1]).filter(|y| Beside::is_looked_at(*y)) {
            let sine = (f64::from(y) - middle) / radius;
            let cosine = (1.0 - sine * sine).max(0.0).sqrt();
            beside.add_row([pull(-cosine, sine), pull(cosine, sine)], y);
        }
        let area = std::f64::consts::PI * radius * radius;
        beside.shift_px2(area.round() as u32, ends).sqrt()
    }

    #[test]
    fn an_even_film_shifts_nothing() {
        for radius in [7.0, 7.5, 8.0, 8.5, 20.0] {
            assert_eq!(shift(radius, |_, _| 60), 0.0);
        }
    }

    /// Half of an edge that moves by e shifts the centroid by 2·e / π, whichever half it is.
    #[test]
    fn what_pulls_one_half_shifts_the_marker() {
        for radius in [7.0, 9.0, 20.0] {
            let expected = 2.0 / std::f32::consts::PI * 30.0 / PER_PX;
            for shift in [
                shift(radius, |x, _| if x > 0.0 { 40 } else { 10 }),
                shift(radius, |x, _| if x < 0.0 { 40 } else { 10 }),
                shift(radius, |_, y| if y > 0.0 { 40 } else { 10 }),
                shift(radius, |_, y| if y < 0.0 { 40 } else { 10 }),
            ] {
                assert!((shift / expected - 1.0).abs() < 0.25, "{shift} {expected}");
            }
        }
    }

    #[test]
    fn a_brighter_film_pulls_less_and_a_redder_one_more() {
        assert!((1..32).all(|level| pull(0, level) <= pull(0, level - 1)));
        assert_eq!((pull(0, 31), pull(20, 31), pull(64, 0)), (0, 30, 160));
    }
}
