//! The outline of one marker from what is left of its edge: for frames in which specks, reflections
//! or noise draw its centroid aside.
//!
//! 48 rays from about its middle meet the edge where the weight passes half of what it is inside.
//! An ellipse as r(φ) = c₀ + x·cos φ + y·sin φ + c₂·cos 2φ + s₂·sin 2φ, with the fourth harmonic
//! that an ellipse has with these, is fitted to the points by least squares, in which points weigh
//! the less the farther off they are (Tukey's biweight) and those far off nothing: where something
//! lies on the edge.

use crate::closeup::Window;
use hivtac_terms::division::Divisor;
use hivtac_terms::root::root;
use hivtac_terms::units::Px;

/// Rays, every 7.5°.
pub const RAYS: usize = 48;
/// A ray is looked along from so far within the expected edge to so far beyond, px with 8
/// fractional bits, in steps of half a pixel.
const REACH: i32 = 640;
const STEP: i32 = 128;
const SAMPLES: usize = 2 * (REACH / STEP) as usize + 1;
/// The weight outside is looked at so far beyond the edge, px with 8 fractional bits.
const OUTSIDE: i32 = 768;
/// Inside and outside differ by at least so much weight, with 8 fractional bits.
const LEAST_CONTRAST: i32 = 24 << 8;
/// The scatter of edge points is taken to be at least this: 0.08 px, with 8 fractional bits.
const LEAST_SCATTER: i32 = 20;
/// A point within this of the ellipse is one of the marker's edge: 0.45 px, with 8 fractional bits.
const INLIER: i32 = 115;
/// Times the rays are looked along, each time from where the fit before was, and fits each time.
const PASSES: usize = 2;
const FITS: usize = 4;
/// Unknowns of the ellipse.
const UNKNOWNS: usize = 5;
/// A point's largest weight in the fit.
const WHOLE: i32 = 64;

/// cos of every 7.5°, with 14 fractional bits.
const COS: [i16; RAYS] = [
    16384, 16244, 15826, 15137, 14189, 12998, 11585, 9974, 8192, 6270, 4240, 2139, 0, -2139, -4240,
    -6270, -8192, -9974, -11585, -12998, -14189, -15137, -15826, -16244, -16384, -16244, -15826,
    -15137, -14189, -12998, -11585, -9974, -8192, -6270, -4240, -2139, 0, 2139, 4240, 6270, 8192,
    9974, 11585, 12998, 14189, 15137, 15826, 16244,
];

/// What is left of a marker's outline says this.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outline {
    /// Its centre, column.
    pub x: Px,
    /// Its centre, row.
    pub y: Px,
    /// Mean radius, px in Q16.16.
    pub radius: i32,
    /// Rays of [`RAYS`] that meet its edge.
    pub inliers: u8,
    /// The most rays beside each other, and one, that do not.
    pub gap: u8,
    /// Root mean square of the edge points' distances from it, px with 8 fractional bits.
    pub scatter: i32,
}

/// An ellipse about a point of a window, px with 8 fractional bits.
#[derive(Clone, Copy, Debug)]
struct Ellipse {
    /// With four fractional bits more.
    center: [i32; 2],
    mean: i32,
    /// cos 2φ and sin 2φ.
    second: [i32; 2],
}

/// cos and sin of `times` times a ray's angle, with 14 fractional bits.
fn cos_sin(ray: usize, times: usize) -> [i32; 2] {
    let cos = |at: usize| i32::from(COS.get(at % RAYS).copied().unwrap_or_default());
    let at = ray * times;
    // 270° more.
    [cos(at), cos(at + 3 * RAYS / 4)]
}

impl Ellipse {
    /// Its radius along a ray.
    fn radius(&self, ray: usize) -> i32 {
        let [[c2, s2], [c4, s4]] = [2, 4].map(|times| cos_sin(ray, times));
        let [c, s] = self.second;
        // An ellipse's fourth harmonic is ¾ of the second's square over the mean.
        let over = (4 * self.mean).max(1);
        let fourth = [3 * (c * c - s * s) / over, 6 * c * s / over];
        self.mean + ((c * c2 + s * s2 + fourth[0] * c4 + fourth[1] * s4) >> 14)
    }

    /// The point at a distance from its centre along a ray.
    fn point(&self, ray: usize, distance: i32) -> [i32; 2] {
        let [cos, sin] = cos_sin(ray, 1);
        let [x, y] = self.center.map(|part| part >> 4);
        [x + ((distance * cos) >> 14), y + ((distance * sin) >> 14)]
    }
}

/// The smallest of values from −1,024 to 1,023 that half of those are not above, of which there
/// are.
fn median(values: &[Option<i32>; RAYS]) -> i32 {
    let count = |limit: i32| values.iter().flatten().filter(|it| **it <= limit).count();
    let half = values.iter().flatten().count().div_ceil(2);
    let (mut below, mut at) = (-1_025, 1_023);
    while at - below > 1 {
        let middle = (at + below) >> 1;
        if count(middle) >= half {
            at = middle;
        } else {
            below = middle;
        }
    }
    at
}

/// The weight halfway between inside and outside; `None` when there is hardly a difference.
fn half_level(window: &Window, ellipse: &Ellipse) -> Option<i32> {
    // Weights in halves are in the range of a median.
    let middle = |distance: &dyn Fn(usize) -> i32| {
        let weight = |ray| Some(window.at(ellipse.point(ray, distance(ray))) >> 7);
        median(&core::array::from_fn(weight)) << 7
    };
    let inside = middle(&|ray| ellipse.radius(ray) / 2);
    let outside = middle(&|ray| ellipse.radius(ray) + OUTSIDE);
    (inside - outside >= LEAST_CONTRAST).then_some((inside + outside) / 2)
}

/// How far beyond the ellipse a ray leaves the marker, at the place nearest to the ellipse.
fn edge(window: &Window, ellipse: &Ellipse, level: i32, ray: usize) -> Option<i32> {
    let expected = ellipse.radius(ray);
    let sample = |at: usize| {
        let beyond = STEP * at as i32 - REACH;
        window.at(ellipse.point(ray, expected + beyond))
    };
    let mut nearest: Option<i32> = None;
    let mut inner = sample(0);
    for at in 1..SAMPLES {
        let outer = sample(at);
        if inner >= level && outer < level {
            let part = STEP * (inner - level) / (inner - outer).max(1);
            let beyond = STEP * (at as i32 - 1) - REACH + part;
            if nearest.is_none_or(|other| beyond.abs() < other.abs()) {
                nearest = Some(beyond);
            }
        }
        inner = outer;
    }
    nearest
}

/// What a ray's point says of the unknowns: their factors with 14 fractional bits.
fn factors(ray: usize) -> [i32; UNKNOWNS] {
    let [[c, s], [c2, s2]] = [1, 2].map(|times| cos_sin(ray, times));
    [1 << 14, c, s, c2, s2]
}

/// The unknowns that explain what is beyond the ellipse best, px with 12 fractional bits; `None`
/// when too little of the edge is left.
///
/// Sums over 48 rays: factors' products are at most 2¹⁴ and weights 2⁶, so that the matrix is below
/// 2²⁶; what is beyond is below 2¹⁰, times a factor below 2²⁴ and in sum below 2³⁶. A quotient of
/// two of the matrix has 20 fractional bits and is below 2²⁷ as a pivot is at least 2¹⁸.
fn fitted(beyond: &[Option<i32>; RAYS], weights: &[i32; RAYS]) -> Option<[i32; UNKNOWNS]> {
    let mut matrix = [[0_i64; UNKNOWNS]; UNKNOWNS];
    let mut side = [0_i64; UNKNOWNS];
    for (ray, (beyond, weight)) in beyond.iter().zip(weights).enumerate() {
        let (Some(beyond), 1..) = (beyond, *weight) else {
            continue;
        };
        let factors = factors(ray);
        for ((row, side), a) in matrix.iter_mut().zip(&mut side).zip(factors) {
            // Below 2²⁰, and with another factor 2³⁴.
            let weighed = i64::from(weight * a);
            *side += weighed * i64::from(*beyond);
            for (cell, b) in row.iter_mut().zip(factors) {
                *cell += (weighed * i64::from(b)) >> 14;
            }
        }
    }
    solved(matrix, side)
}

/// Gauss's elimination of a symmetric matrix with large diagonal, without pivoting.
fn solved(
    mut matrix: [[i64; UNKNOWNS]; UNKNOWNS],
    mut side: [i64; UNKNOWNS],
) -> Option<[i32; UNKNOWNS]> {
    for k in 0..UNKNOWNS {
        let (row, right) = (*matrix.get(k)?, *side.get(k)?);
        let pivot = *row.get(k)?;
        if pivot < 1 << 18 {
            return None;
        }
        for (other, side) in matrix.iter_mut().zip(&mut side).skip(k + 1) {
            let factor = (*other.get(k)? << 20) / pivot;
            let cells = other.iter_mut().zip(row);
            cells.for_each(|(cell, above)| *cell -= (factor * above) >> 20);
            *side -= (factor * right) >> 20;
        }
    }
    let mut unknowns = [0_i32; UNKNOWNS];
    for k in (0..UNKNOWNS).rev() {
        let row = matrix.get(k)?;
        let known = row.iter().zip(unknowns).skip(k + 1);
        let left = (*side.get(k)? << 4) - known.map(|(a, x)| a * i64::from(x)).sum::<i64>();
        let unknown = unknowns.get_mut(k)?;
        // Beyond a few pixels it is no fit.
        *unknown = (left / (*row.get(k)?).max(1)).clamp(-(8 << 12), 8 << 12) as i32;
    }
    Some(unknowns)
}

/// What the fit leaves of a ray's point, px with 8 fractional bits.
fn left_over(unknowns: &[i32; UNKNOWNS], ray: usize, beyond: i32) -> i32 {
    let explained = factors(ray)
        .into_iter()
        .zip(unknowns)
        .map(|(a, x)| a * (x >> 2));
    beyond - (explained.sum::<i32>() >> 16)
}

/// Tukey's biweight of residuals, by their scatter.
fn weights(left: &[Option<i32>; RAYS]) -> [i32; RAYS] {
    let sizes = left.map(|left| left.map(i32::abs));
    // Of a normal distribution 1.48 times the median is the standard deviation.
    let scatter = (median(&sizes) * 95 / 64).max(LEAST_SCATTER);
    let limit = (4 * scatter).unsigned_abs();
    let by_limit = Divisor::new(limit);
    sizes.map(|size| {
        let size = size.map_or(limit, |size| size.unsigned_abs().min(limit));
        let part = by_limit.quotient(u64::from(256 * size)) as u32;
        let rest = 65_536 - (part * part) as i32;
        ((rest >> 8) * (rest >> 8)) / (65_536 / WHOLE)
    })
}

/// What is left of the outline of a marker whose mask has this middle, in the frame, px in Q16.16,
/// and these variances (E x², E xy, E y², px² with 12 fractional bits). `None` when nothing goes
/// around.
#[inline(never)]
pub fn outline(window: &Window, [x, y]: [Px; 2], variance: [i32; 3]) -> Option<Outline> {
    let mut ellipse = expected(window, [x, y], variance)?;
    let mut left = [None; RAYS];
    for _ in 0..PASSES {
        let level = half_level(window, &ellipse)?;
        let beyond = core::array::from_fn(|ray| edge(window, &ellipse, level, ray));
        if beyond.iter().flatten().count() < RAYS / 2 {
            return None;
        }
        // Before the first fit all edges are a little within or beyond what was expected.
        let shift = median(&beyond);
        left = beyond.map(|beyond| beyond.map(|beyond| beyond - shift));
        let mut unknowns = [0; UNKNOWNS];
        for _ in 0..FITS {
            unknowns = fitted(&beyond, &weights(&left))?;
            left =
                core::array::from_fn(|ray| Some(left_over(&unknowns, ray, (*beyond.get(ray)?)?)));
        }
        ellipse = ellipse.with(unknowns);
    }
    Some(judged(window, &ellipse, &left))
}

/// The ellipse of the mask's moments.
fn expected(window: &Window, [x, y]: [Px; 2], [xx, xy, yy]: [i32; 3]) -> Option<Ellipse> {
    let center = [(x, window.origin[0]), (y, window.origin[1])];
    let mean = (xx + yy) / 2;
    // Twice the root: an ellipse's radius.
    let radius = 2 * (root((mean.max(0) as u64) << 4) as i32);
    let by_mean = Divisor::new(mean.max(1) as u32);
    (mean > 0 && radius < 24 << 8).then(|| Ellipse {
        center: center.map(|(at, origin)| (at.0 >> 4) - (i32::from(origin) << 12)),
        mean: radius,
        second: [(xx - yy) / 2, xy].map(|part| {
            let product = i64::from(radius) * i64::from(part);
            (by_mean.signed_quotient(product) / 2) as i32
        }),
    })
}

impl Ellipse {
    fn with(self, [mean, x, y, c2, s2]: [i32; UNKNOWNS]) -> Ellipse {
        Ellipse {
            center: [self.center[0] + x, self.center[1] + y],
            mean: self.mean + (mean >> 4),
            second: [self.second[0] + (c2 >> 4), self.second[1] + (s2 >> 4)],
        }
    }
}

fn judged(window: &Window, ellipse: &Ellipse, left: &[Option<i32>; RAYS]) -> Outline {
    let is_inlier = |left: &Option<i32>| left.is_some_and(|left| left.abs() <= INLIER);
    let (mut inliers, mut squares, mut gap, mut run) = (0_u8, 0_i32, 0_u8, 0_u8);
    // Twice around, for a gap across the first ray.
    for (at, left) in left.iter().chain(left).enumerate() {
        run += 1;
        if is_inlier(left) {
            (gap, run) = (gap.max(run), 0);
            if at < RAYS {
                inliers += 1;
                squares += left.map_or(0, |left| left * left);
            }
        }
    }
    let mean = squares / i32::from(inliers.max(1));
    let ([x, y], [left_column, top_row]) = (ellipse.center, window.origin);
    let place = |at: i32, origin: u16| Px((at << 4) + (i32::from(origin) << 16));
    Outline {
        x: place(x, left_column),
        y: place(y, top_row),
        radius: ellipse.mean << 8,
        inliers,
        gap: gap.max(run),
        scatter: root(mean as u64) as i32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closeup::Closeups;
    use crate::tables::Pixels;
    use std::{vec, vec::Vec};

    /// Pixels that are their own weight.
    struct Weights;

    impl Pixels for Weights {
        fn row_length(&self, width: u16) -> usize {
            width.into()
        }

        fn mask_row(&self, _: &[u16], _: &mut [u32]) {}

        fn weight(&self, row: &[u16], column: u16) -> u8 {
            row.get(usize::from(column))
                .map_or(0, |weight| *weight as u8)
        }
    }

    const WIDTH: usize = 80;
    const FULL: f64 = 95.0;

    /// A picture of an ellipse of radii, turned, with soft edges a pixel wide.
    #[derive(Clone, Copy, Debug)]
    struct Drawn {
        center: [f64; 2],
        radii: [f64; 2],
        turn: f64,
    }

    impl Drawn {
        fn covered(&self, x: f64, y: f64) -> f64 {
            let (sin, cos) = self.turn.sin_cos();
            let (dx, dy) = (x - self.center[0], y - self.center[1]);
            let (u, v) = (dx * cos + dy * sin, dy * cos - dx * sin);
            let part = (u / self.radii[0]).hypot(v / self.radii[1]);
            let distance = dx.hypot(dy) * (1.0 - 1.0 / part.max(1e-9));
            (0.5 - distance).clamp(0.0, 1.0)
        }

        fn picture(&self) -> Vec<u16> {
            let pixel = |i: usize| self.covered((i % WIDTH) as f64, (i / WIDTH) as f64);
            (0..WIDTH * WIDTH)
                .map(|i| (FULL * pixel(i)).round() as u16)
                .collect()
        }

        /// E x², E xy, E y² of a mask a pixel larger.
        fn variance(&self) -> [i32; 3] {
            let (sin, cos) = self.turn.sin_cos();
            let [a, b] = self.radii.map(|radius| (radius + 0.8).powi(2) / 4.0);
            let all = [
                a * cos * cos + b * sin * sin,
                (a - b) * sin * cos,
                a * sin * sin + b * cos * cos,
            ];
            all.map(|it| (it * 4096.0) as i32)
        }

        fn outline(&self, picture: &[u16], off: [f64; 2]) -> Option<Outline> {
            let around = self.center.map(|part| part as u16);
            let mut closeups = Closeups::new();
            closeups.begin([WIDTH as u16; 2], [around; 4]);
            closeups.push_rows(&Weights, picture);
            let at = [0, 1].map(|k| Px(((self.center[k] + off[k]) * 65_536.0) as i32));
            outline(&closeups.windows().unwrap()[0], at, self.variance())
        }
    }

    fn far(drawn: &Drawn, found: &Outline) -> f64 {
        (found.x.to_f64() - drawn.center[0]).hypot(found.y.to_f64() - drawn.center[1])
    }

    fn all() -> Vec<Drawn> {
        let mut all = vec![];
        for (i, radius) in [4.0, 6.5, 8.3, 11.0, 14.0].into_iter().enumerate() {
            for (j, squeezed) in [1.0, 0.87, 0.7, 0.6].into_iter().enumerate() {
                let turn = 0.7 * i as f64 + 0.4 * j as f64;
                all.push(Drawn {
                    center: [40.3 + 0.2 * i as f64, 38.9 - 0.3 * j as f64],
                    radii: [radius, radius * squeezed],
                    turn,
                });
            }
        }
        all
    }

    #[test]
    fn whole_outlines_are_found() {
        for drawn in all() {
            let found = drawn.outline(&drawn.picture(), [0.3, -0.2]).unwrap();
            assert!(far(&drawn, &found) < 0.06, "{drawn:?} {found:?}");
            assert_eq!((found.inliers, found.gap), (RAYS as u8, 1), "{drawn:?}");
            assert!(found.scatter < 32, "{drawn:?} {found:?}");
            let mean = (drawn.radii[0] * drawn.radii[1]).sqrt();
            let radius = f64::from(found.radius) / 65_536.0;
            assert!((radius - mean).abs() < 0.05 * mean, "{radius} {mean}");
        }
    }

    /// Bites from the edge as wide as 40° and some specks beside it.
    #[test]
    fn what_lies_on_an_edge_hardly_moves_the_outline() {
        for drawn in all().into_iter().filter(|drawn| drawn.radii[1] > 5.0) {
            let mut picture = drawn.picture();
            let (x, y) = (drawn.center[0] + drawn.radii[0] * 0.9, drawn.center[1]);
            for (i, pixel) in picture.iter_mut().enumerate() {
                let (px, py) = ((i % WIDTH) as f64, (i / WIDTH) as f64);
                if (px - x).hypot(py - y) < drawn.radii[0] * 0.25 {
                    *pixel = 0;
                }
            }
            let below = (drawn.center[1] + drawn.radii[1] + 2.0) as usize;
            picture[below * WIDTH + drawn.center[0] as usize] = 95;
            let found = drawn.outline(&picture, [-0.3, 0.1]).unwrap();
            assert!(far(&drawn, &found) < 0.2, "{drawn:?} {found:?}");
            assert!((33..48).contains(&found.inliers), "{drawn:?} {found:?}");
            assert!((3..10).contains(&found.gap), "{drawn:?} {found:?}");
        }
    }

    #[test]
    fn a_half_disc_has_a_gap_and_nothing_has_no_outline() {
        let drawn = Drawn {
            center: [40.0, 40.0],
            radii: [8.0, 8.0],
            turn: 0.0,
        };
        let mut picture = drawn.picture();
        for row in picture.chunks_mut(WIDTH) {
            row[..38].fill(0);
        }
        if let Some(found) = drawn.outline(&picture, [0.0; 2]) {
            assert!(found.gap > 8 || found.inliers < 33, "{found:?}");
        }
        assert_eq!(drawn.outline(&vec![0; WIDTH * WIDTH], [0.0; 2]), None);
        assert_eq!(drawn.outline(&vec![95; WIDTH * WIDTH], [0.0; 2]), None);
    }
}
