//! How much of each pixel a polygon covers, exactly.

use crate::disc::Outline;

/// A grid of pixels around a polygon, with the covered part (0 to 1) of each.
///
/// Each edge adds, to every pixel on its right, the signed height that it spans in that pixel's row; summed along
/// the row, the edges of a closed polygon leave exactly the covered area. A pixel (x, y) is the unit square around
/// its centre (x, y).
pub(crate) struct Coverage {
    /// Column and row of the grid's first pixel; may lie outside the frame.
    left: i64,
    top: i64,
    columns: usize,
    /// Row by row.
    parts: Vec<f64>,
}

impl Coverage {
    /// The coverage by a polygon of finite corners, clockwise on the screen.
    pub(crate) fn of(outline: &Outline) -> Coverage {
        let mut grid = Coverage::around(outline);
        for (from, to) in outline.edges() {
            grid.add_edge(from, to);
        }
        for row in grid.parts.chunks_exact_mut(grid.columns) {
            let mut sum = 0.0;
            for part in row {
                sum += *part;
                *part = sum.clamp(0.0, 1.0);
            }
        }
        grid
    }

    /// An empty grid that holds the polygon, with one spare column that takes what the last edges leave over.
    fn around(outline: &Outline) -> Coverage {
        let (low, high) = outline.bounds();
        let first = low.map(|v| (v + 0.5).floor() as i64);
        let last = high.map(|v| (v + 0.5).floor() as i64);
        let columns = (last[0] - first[0] + 2) as usize;
        let rows = (last[1] - first[1] + 1) as usize;
        Coverage {
            left: first[0],
            top: first[1],
            columns,
            parts: vec![0.0; columns * rows],
        }
    }

    /// Splits an edge at the borders between rows.
    fn add_edge(&mut self, from: [f64; 2], to: [f64; 2]) {
        let [x0, y0] = self.in_grid(from);
        let [x1, y1] = self.in_grid(to);
        if y0 == y1 {
            return;
        }
        // Edges downwards lie on the right of a clockwise polygon: what is on their right is outside.
        let (sign, [xa, ya], [xb, yb]) = match y0 < y1 {
            true => (-1.0, [x0, y0], [x1, y1]),
            false => (1.0, [x1, y1], [x0, y0]),
        };
        let x_at = |y: f64| (xa + (xb - xa) * ((y - ya) / (yb - ya))).clamp(xa.min(xb), xa.max(xb));
        let rows = self.parts.len() / self.columns;
        for row in (ya as usize)..(yb.ceil() as usize).min(rows) {
            let top = ya.max(row as f64);
            let bottom = yb.min(row as f64 + 1.0);
            self.add_in_row(row, [x_at(top), x_at(bottom)], sign * (bottom - top));
        }
    }

    /// Splits a piece within one row, spanning a signed height, at the borders between columns.
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
            // What lies right of the piece within this pixel, and what is left over for all pixels after it.
            let to_its_left = (left + right) / 2.0 - column as f64;
            cells[column] += height * part * (1.0 - to_its_left);
            cells[column + 1] += height * part * to_its_left;
        }
    }

    /// A point of the picture in the grid's own coordinates, whose pixels begin at whole numbers.
    fn in_grid(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x + 0.5 - self.left as f64, y + 0.5 - self.top as f64]
    }

    /// The covered pixels inside a frame: (index into the frame, covered part > 0).
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
        Coverage::of(outline).pixels(10, 10).collect()
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

    /// The covered part of a pixel by brute force.
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
            let inside = |x, y| cross(a, b, x, y) >= 0.0 && cross(b, c, x, y) >= 0.0 && cross(c, a, x, y) >= 0.0;
            let grid = Coverage::of(&Outline { corners: vec![a, b, c] });
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
