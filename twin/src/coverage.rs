//! The part of each pixel that a disc's image covers: computed exactly, then blurred by the lens.

use crate::disc::Outline;
use crate::exposure::Image;

/// A grid of pixels around a polygon, with the covered part (0 to 1) of each.
///
/// Each edge adds, to every pixel on its right, the signed height that it spans in that pixel's
/// row; summed along the row, the edges of a closed polygon leave exactly the covered area. A pixel
/// (x, y) is the unit square around its centre (x, y).
pub(crate) struct Coverage {
    /// Column and row of the grid's first pixel. It may lie outside the frame.
    left: i64,
    top: i64,
    columns: usize,
    /// The covered parts, row by row.
    parts: Vec<f64>,
}

impl Coverage {
    /// Returns the coverage by an image, limited to what a frame of this size can see.
    pub(crate) fn of(image: &Image, width: u32, height: u32) -> Coverage {
        // The margin holds light that is blurred into the frame.
        let margin = 4.0 * image.blur_px + 2.0;
        let fits = |outline: &Outline| {
            let (low, high) = outline.bounds();
            let size = [f64::from(width), f64::from(height)];
            (0..2).all(|i| low[i] >= -margin && high[i] <= size[i] - 1.0 + margin)
        };
        if image.outlines.iter().all(fits) {
            return Coverage::mean(&image.outlines, image.blur_px);
        }
        let clipped = image.outlines.iter();
        let clipped: Vec<Outline> = clipped
            .map(|outline| outline.clipped(width, height, margin))
            .collect();
        Coverage::mean(&clipped, image.blur_px)
    }

    /// Returns the mean coverage by polygons with finite corners, clockwise on the screen. There is
    /// one polygon, or several during an exposure. The result is blurred by a Gaussian of standard
    /// deviation `blur_px` ≥ 0 along x and y.
    fn mean(outlines: &[Outline], blur_px: f64) -> Coverage {
        let margin = (3.0 * blur_px).ceil() as i64;
        let mut grid = Coverage::around(outlines, margin);
        let weight = 1.0 / outlines.len() as f64;
        for (from, to) in outlines.iter().flat_map(Outline::edges) {
            grid.add_edge(from, to, weight);
        }
        for row in grid.parts.chunks_exact_mut(grid.columns) {
            let mut sum = 0.0;
            for part in row {
                sum += *part;
                *part = sum.clamp(0.0, 1.0);
            }
        }
        if margin > 0 {
            grid.blur(&bell(blur_px, margin));
        }
        grid
    }

    /// Returns an empty grid that holds the polygons and a margin. One spare column takes the last
    /// edges' carry to their right.
    fn around(outlines: &[Outline], margin: i64) -> Coverage {
        let start = ([0.0; 2], [0.0; 2]);
        let outlines = outlines
            .iter()
            .filter(|outline| !outline.corners.is_empty());
        let bounds = outlines.map(Outline::bounds);
        let both = |a: Bounds, b: Bounds| {
            let low = std::array::from_fn(|i| a.0[i].min(b.0[i]));
            (low, std::array::from_fn(|i| a.1[i].max(b.1[i])))
        };
        let (low, high) = bounds.reduce(both).unwrap_or(start);
        let first = low.map(|v| (v + 0.5).floor() as i64 - margin);
        let last = high.map(|v| (v + 0.5).floor() as i64 + margin);
        let columns = (last[0] - first[0] + 2) as usize;
        let rows = (last[1] - first[1] + 1) as usize;
        Coverage {
            left: first[0],
            top: first[1],
            columns,
            parts: vec![0.0; columns * rows],
        }
    }

    /// Convolves the grid with a bell along its rows, then along its columns. Everything outside
    /// the grid counts as uncovered.
    fn blur(&mut self, bell: &[f64]) {
        let columns = self.columns;
        let rows = self.parts.len() / columns;
        for row in self.parts.chunks_exact_mut(columns) {
            let blurred = convolved(row, bell);
            row.copy_from_slice(&blurred);
        }
        for x in 0..columns {
            let column: Vec<f64> = (0..rows).map(|y| self.parts[y * columns + x]).collect();
            for (y, part) in convolved(&column, bell).into_iter().enumerate() {
                self.parts[y * columns + x] = part;
            }
        }
    }

    /// Splits an edge at the borders between rows.
    fn add_edge(&mut self, from: [f64; 2], to: [f64; 2], weight: f64) {
        let [x0, y0] = self.in_grid(from);
        let [x1, y1] = self.in_grid(to);
        if y0 == y1 {
            return;
        }
        // Edges that go down lie on the right of a clockwise polygon: the area on their right is
        // outside it.
        let (sign, [xa, ya], [xb, yb]) = match y0 < y1 {
            true => (-weight, [x0, y0], [x1, y1]),
            false => (weight, [x1, y1], [x0, y0]),
        };
        let x_at = |y: f64| (xa + (xb - xa) * ((y - ya) / (yb - ya))).clamp(xa.min(xb), xa.max(xb));
        let rows = self.parts.len() / self.columns;
        for row in (ya as usize)..(yb.ceil() as usize).min(rows) {
            let top = ya.max(row as f64);
            let bottom = yb.min(row as f64 + 1.0);
            self.add_in_row(row, [x_at(top), x_at(bottom)], sign * (bottom - top));
        }
    }

    /// Splits a piece within one row, which spans a signed height, at the borders between columns.
    fn add_in_row(&mut self, row: usize, ends: [f64; 2], height: f64) {
        let (xa, xb) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let cells = &mut self.parts[row * self.columns..][..self.columns];
        let last = (xb as usize).min(cells.len() - 2);
        for column in (xa as usize).min(last)..=last {
            let left = xa.max(column as f64);
            let right = if column == last {
                xb
            } else {
                column as f64 + 1.0
            };
            let part = if xb > xa {
                (right - left) / (xb - xa)
            } else {
                1.0
            };
            // The area on the right of the piece within this pixel, and the rest that goes to all
            // pixels after it.
            let to_its_left = (left + right) / 2.0 - column as f64;
            cells[column] += height * part * (1.0 - to_its_left);
            cells[column + 1] += height * part * to_its_left;
        }
    }

    /// Converts a point of the picture to the grid's coordinates, in which pixels begin at whole
    /// numbers.
    fn in_grid(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x + 0.5 - self.left as f64, y + 0.5 - self.top as f64]
    }

    /// Iterates over the covered pixels inside a frame: (index into the frame, covered part > 0).
    pub(crate) fn pixels(&self, width: u32, height: u32) -> impl Iterator<Item = (usize, f64)> {
        let (width, height) = (i64::from(width), i64::from(height));
        let rows = self.parts.chunks_exact(self.columns).zip(self.top..);
        rows.filter(move |(_, y)| (0..height).contains(y))
            .flat_map(move |(row, y)| {
                let parts = row.iter().copied().zip(self.left..);
                parts
                    .filter(move |(part, x)| *part > 0.0 && (0..width).contains(x))
                    .map(move |(part, x)| ((y * width + x) as usize, part))
            })
    }
}

/// Lowest and highest x and y.
type Bounds = ([f64; 2], [f64; 2]);

/// Returns the weights of a Gaussian at whole pixels from −margin to margin. They add up to one.
fn bell(deviation: f64, margin: i64) -> Vec<f64> {
    let weight = |i: i64| {
        let z = i as f64 / deviation;
        libm::exp(-z * z / 2.0)
    };
    let weights: Vec<f64> = (-margin..=margin).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

/// Convolves a line of parts with a bell of odd length; beyond the ends of the line all parts are
/// 0.
fn convolved(line: &[f64], bell: &[f64]) -> Vec<f64> {
    let margin = bell.len() / 2;
    let mut blurred = vec![0.0; line.len() + 2 * margin];
    for (i, part) in line.iter().enumerate().filter(|(_, part)| **part > 0.0) {
        for (sum, weight) in blurred[i..].iter_mut().zip(bell) {
            *sum += part * weight;
        }
    }
    blurred.drain(..margin);
    blurred.truncate(line.len());
    blurred
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> Outline {
        Outline {
            corners: vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]],
        }
    }

    fn covered(outline: &Outline) -> Vec<(usize, f64)> {
        Coverage::mean(std::slice::from_ref(outline), 0.0)
            .pixels(10, 10)
            .collect()
    }

    #[test]
    fn one_whole_pixel() {
        assert_eq!(covered(&rectangle(2.5, 1.5, 3.5, 2.5)), [(23, 1.0)]);
    }

    #[test]
    fn parts_of_pixels() {
        let parts = covered(&rectangle(2.25, 1.5, 3.5, 2.0));
        assert_eq!(parts, [(22, 0.125), (23, 0.5)]);
    }

    #[test]
    fn outside_the_frame_nothing_is_covered() {
        assert_eq!(covered(&rectangle(-9.0, -9.0, -2.0, -2.0)), []);
        assert_eq!(covered(&rectangle(-3.5, 8.5, 0.5, 12.5)), [(90, 1.0)]);
    }

    #[test]
    fn several_images_are_averaged() {
        let images = [rectangle(2.5, 1.5, 3.5, 2.5), rectangle(3.5, 1.5, 5.5, 2.5)];
        let parts: Vec<_> = Coverage::mean(&images, 0.0).pixels(10, 10).collect();
        assert_eq!(parts, [(23, 0.5), (24, 0.5), (25, 0.5)]);
    }

    /// Returns the area, the centroid, and the variances about it along x and along y.
    fn moments(image: &Outline, blur_px: f64) -> [f64; 5] {
        let grid = Coverage::mean(std::slice::from_ref(image), blur_px);
        let parts = || {
            let at = |(pixel, part)| ((pixel % 100) as f64, (pixel / 100) as f64, part);
            grid.pixels(100, 100).map(at)
        };
        let area: f64 = parts().map(|(.., part)| part).sum();
        let x = parts().map(|(x, _, part)| part * x).sum::<f64>() / area;
        let y = parts().map(|(_, y, part)| part * y).sum::<f64>() / area;
        let xx = parts().map(|(u, _, part)| part * (u - x) * (u - x));
        let yy = parts().map(|(_, v, part)| part * (v - y) * (v - y));
        [area, x, y, xx.sum::<f64>() / area, yy.sum::<f64>() / area]
    }

    #[test]
    fn blur_keeps_area_and_centroid_and_adds_its_variance() {
        let image = rectangle(40.25, 30.5, 52.0, 47.75);
        let sharp = moments(&image, 0.0);
        for blur_px in [0.5, 1.0, 2.7] {
            let soft = moments(&image, blur_px);
            for (a, b) in sharp.iter().zip(&soft).take(3) {
                assert!((a - b).abs() < 1e-9, "{a} {b}");
            }
            for (a, b) in sharp[3..].iter().zip(&soft[3..]) {
                let added = (b - a) / (blur_px * blur_px);
                // The bell is cut off at three deviations, and a narrow one falls between pixels.
                let least = if blur_px < 1.0 { 0.85 } else { 0.95 };
                assert!((least..1.01).contains(&added), "{blur_px}: {added}");
            }
        }
    }

    /// Returns the covered part of a pixel by brute force.
    fn sampled(inside: impl Fn(f64, f64) -> bool, x: i64, y: i64) -> f64 {
        const N: u32 = 64;
        let offset = |i: u32| (f64::from(i) + 0.5) / f64::from(N) - 0.5;
        let hits = (0..N * N)
            .filter(|i| inside(x as f64 + offset(i % N), y as f64 + offset(i / N)))
            .count();
        hits as f64 / f64::from(N * N)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn agrees_with_counting_samples(
            p in prop::array::uniform3((0.0..9.0, 0.0..9.0).prop_map(|(x, y)| [x, y])),
        ) {
            let cross = |a: [f64; 2], b: [f64; 2], x: f64, y: f64|
                (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
            let [a, mut b, mut c] = p;
            if cross(a, b, c[0], c[1]) < 0.0 {
                std::mem::swap(&mut b, &mut c);
            }
            let inside = |x, y| {
                cross(a, b, x, y) >= 0.0 && cross(b, c, x, y) >= 0.0 && cross(c, a, x, y) >= 0.0
            };
            let grid = Coverage::mean(&[Outline { corners: vec![a, b, c] }], 0.0);
            let mut exact = [0.0; 100];
            for (pixel, part) in grid.pixels(10, 10) {
                exact[pixel] = part;
            }
            for (pixel, part) in exact.iter().enumerate() {
                let expected = sampled(inside, pixel as i64 % 10, pixel as i64 / 10);
                prop_assert!((part - expected).abs() < 0.06, "pixel {pixel}: {part} {expected}");
            }
        }
    }
}
