//! The design of a film: its dimensions, its material and its mesh.

use std::f64::consts::PI;
use std::sync::{Arc, LazyLock};

use hivtac_twin::film::MARKER_CENTRES_MM;
use hivtac_twin::film::reduced::Unit;

use crate::ShellError;
use crate::grid::Grid;
use crate::point::{Law, Material};
use crate::sheet::Sheet;
use crate::shell::{Hold, Shell};
use crate::sparse::Pattern;
use crate::spline::Axis;

/// Number of points along a post at which it holds the film, in both directions.
const POST_POINTS: usize = 20;
/// Rings and rays of the points on which a tip presses.
const TIP_RINGS: usize = 10;
const TIP_RAYS: usize = 32;
/// The usual [`Design::tip_reach_mm`]: for a tip of half a millimetre anywhere within ±5 mm.
const TIP_REACH_MM: f64 = 5.5;
/// Growth of cells away from posts and tip, mm per mm.
const GROWTH: f64 = 0.25;
/// Sizes of cells at fineness 1, mm: under the tip, at a post (the film's grip ends within 0.2 mm
/// there), and anywhere.
const TIP_CELL_MM: f64 = 0.5;
const POST_CELL_MM: f64 = 0.35;
const LARGEST_CELL_MM: f64 = 1.6;
/// Number of steps in the layout of cells.
const SAMPLES: usize = 4000;

/// The largest shift of a post from its place along x and along y, mm.
pub const MOST_POST_SHIFT_MM: f64 = 1.0;

/// A film on four posts, pressed by a tip. Lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// Distance between neighbouring posts' centres, > 0 (the paper's 28).
    pub span_mm: f64,
    /// Reach of the film beyond the posts' centres, ≥ 0 (0: the paper's model; 6: its 40 × 40 mm
    /// cut).
    pub overhang_mm: f64,
    /// The material.
    pub material: Material,
    /// The law of its elasticity when it is stretched.
    pub law: Law,
    /// The stretch of the mounted film along x and y, −0.01 to 0.05. With 0.012 it was cut 1.2 %
    /// shorter than it is between the posts.
    pub stretch: [f64; 2],
    /// Variation of the thickness over the mounted film. This is (sx, sy) of t = thickness · (1 +
    /// sx X + sy Y + cxx X² + cxy X Y + cyy Y²), X = x / 14 mm. The thickness must stay between
    /// half and twice the nominal one.
    pub thickness_slope: [f64; 2],
    /// (cxx, cxy, cyy) of [`Self::thickness_slope`].
    pub thickness_curve: [f64; 3],
    /// Gravity in the film's frame, in parts of g, |down| ≤ 2. Zeros mean a weightless film.
    pub down: [f64; 3],
    /// Additional stiffness on dots of 1 mm diameter, in parts of the film's own stiffness, 0 to 3.
    pub dot_stiffening: f64,
    /// The dots' places on the mounted film, mm from the middle.
    pub dots_mm: Vec<[f64; 2]>,
    /// Radius of the discs around the posts' centres on which the film is held, > 0.
    pub post_radius_mm: f64,
    /// Shift of each post from its place, in the order of the markers' identities, within
    /// ±[`MOST_POST_SHIFT_MM`]. The film is cut as for unshifted posts.
    pub post_shift_mm: [[f64; 2]; 4],
    /// Stiffness of a post's grip on the film, N/mm per mm², > 0. At a post's rim the film slips by
    /// √(membrane stiffness / grip): 0.18 mm at the default 20, as if the post were smaller by
    /// that. A rubber film that is clamped on both faces yields by shear through its thickness,
    /// about 12 G/t = 8 N/mm³. The default is not softer than that.
    pub post_grip_n_per_mm3: f64,
    /// Radius of the disc over which the tip spreads its force, > 0; by (1 − r²/R²)².
    pub tip_radius_mm: f64,
    /// The place where the tip meets the film at rest, from the centre.
    pub tip_offset_mm: [f64; 2],
    /// The largest distance from the middle, along x and along y, that a tip's disc reaches within
    /// the small cells, > 0. A tip beyond it meets larger ones.
    pub tip_reach_mm: f64,
    /// Fineness of the mesh, 0.25 to 8. 1 is the default mesh; 2 has cells of half the size.
    pub fineness: f64,
    /// Number of cells along half of the edge, 4 to 400; `None` follows the fineness. Films with
    /// the same number of cells can start from each other's states.
    pub cells: Option<usize>,
    /// Number of Gauss points along a side of a cell: 3, or 2, which takes half the time and is as
    /// close to the solution of a finer mesh.
    pub gauss_points: usize,
}

impl Default for Design {
    fn default() -> Design {
        Design {
            span_mm: 28.0,
            overhang_mm: 0.0,
            material: Material {
                youngs_mpa: 1.0,
                poisson: 0.49,
                thickness_mm: 0.5,
            },
            law: Law::default(),
            stretch: [0.0; 2],
            thickness_slope: [0.0; 2],
            thickness_curve: [0.0; 3],
            down: [0.0; 3],
            dot_stiffening: 0.0,
            dots_mm: MARKER_CENTRES_MM.to_vec(),
            post_radius_mm: 1.5,
            post_shift_mm: [[0.0; 2]; 4],
            post_grip_n_per_mm3: 20.0,
            tip_radius_mm: 0.5,
            tip_offset_mm: [0.0; 2],
            tip_reach_mm: TIP_REACH_MM,
            fineness: 1.0,
            cells: None,
            gauss_points: 3,
        }
    }
}

impl Design {
    /// Returns the film of a unit. The unit's markers are not part of it.
    pub fn of(unit: &Unit) -> Design {
        let nominal = Design::default();
        Design {
            material: Material {
                youngs_mpa: unit.stiffness * nominal.material.youngs_mpa,
                thickness_mm: unit.thickness * nominal.material.thickness_mm,
                ..nominal.material
            },
            post_grip_n_per_mm3: unit.grip * nominal.post_grip_n_per_mm3,
            post_shift_mm: unit.posts_mm,
            ..nominal
        }
    }

    /// Returns half the length of the film's edge.
    pub fn half_edge_mm(&self) -> f64 {
        self.span_mm / 2.0 + self.overhang_mm
    }

    /// Checks that such a film is possible.
    ///
    /// # Errors
    /// If a number is out of its range, or the tip would press on a post.
    pub fn check(&self) -> Result<(), ShellError> {
        let Design { material, .. } = self;
        positive("span", self.span_mm)?;
        positive("post radius", self.post_radius_mm)?;
        positive("post grip", self.post_grip_n_per_mm3)?;
        positive("Young's modulus", material.youngs_mpa)?;
        positive("thickness", material.thickness_mm)?;
        let ranged = [
            ("overhang", self.overhang_mm, 0.0, self.span_mm),
            ("Poisson's ratio", material.poisson, -0.99, 0.5),
            ("fineness", self.fineness, 0.25, 8.0),
            ("stretch along x", self.stretch[0], -0.01, 0.05),
            ("stretch along y", self.stretch[1], -0.01, 0.05),
            ("part of neo-Hooke's law", self.law.neo_hooke, 0.0, 1.0),
            ("stiffening", self.law.stiffening, 0.0, 0.5),
            ("dots' stiffening", self.dot_stiffening, 0.0, 3.0),
        ];
        for (what, value, from, to) in ranged {
            if !(from..=to).contains(&value) {
                return Err(refused(what, value, &format!("between {from} and {to}")));
            }
        }
        for part in self.post_shift_mm.into_iter().flatten() {
            if !(-MOST_POST_SHIFT_MM..=MOST_POST_SHIFT_MM).contains(&part) {
                let bound = format!("within ±{MOST_POST_SHIFT_MM} mm");
                return Err(refused("post shift", part, &bound));
            }
        }
        self.check_sheet()?;
        self.check_tip_at(self.tip_offset_mm, self.tip_radius_mm)
    }

    fn check_sheet(&self) -> Result<(), ShellError> {
        let down = self.down.iter().map(|part| part * part).sum::<f64>().sqrt();
        if !(0.0..=2.0).contains(&down) {
            return Err(refused("size of gravity", down, "between 0 and 2"));
        }
        if self.cells.is_some_and(|cells| !(4..=400).contains(&cells)) {
            let cells = self.cells.unwrap_or_default() as f64;
            return Err(refused("number of cells", cells, "between 4 and 400"));
        }
        if !(2..=3).contains(&self.gauss_points) {
            let points = self.gauss_points as f64;
            return Err(refused("number of Gauss points", points, "2 or 3"));
        }
        let edge = self.half_edge_mm();
        for part in self.dots_mm.iter().flatten() {
            if !(-edge..=edge).contains(part) {
                let bound = format!("within ±{edge} mm, where the film is");
                return Err(refused("dot's place", *part, &bound));
            }
        }
        let sheet = self.sheet();
        for i in -16..=16 {
            for j in -16..=16 {
                let at = [i, j].map(|k| edge * f64::from(k) / 16.0);
                let relative = sheet.relative(at);
                if !(0.5..=2.0).contains(&relative) {
                    let bound = "within half and twice the nominal thickness all over the film";
                    return Err(refused("relative thickness", relative, bound));
                }
            }
        }
        Ok(())
    }

    /// Returns the film as a sheet, without posts.
    pub(crate) fn sheet(&self) -> Sheet {
        let ([sx, sy], [cxx, cxy, cyy]) = (self.thickness_slope, self.thickness_curve);
        Sheet {
            material: self.material,
            law: self.law,
            stretch: self.stretch,
            terms: [sx, sy, cxx, cxy, cyy],
            down: self.down,
            dots_mm: self.dots_mm.clone(),
            dot_stiffening: self.dot_stiffening,
        }
    }

    /// Returns the number of cells along half of the edge.
    pub fn cells(&self) -> usize {
        self.cells
            .unwrap_or_else(|| self.counts().last().map_or(0.0, |most| most.ceil()) as usize)
    }

    /// Checks that a tip at this place (mm) does not touch the posts.
    pub(crate) fn check_tip_at(
        &self,
        offset_mm: [f64; 2],
        radius_mm: f64,
    ) -> Result<(), ShellError> {
        positive("tip radius", radius_mm)?;
        let free = self.span_mm / 2.0 - self.post_radius_mm - radius_mm;
        for offset in offset_mm {
            if !(-free..=free).contains(&offset) {
                let bound = format!("within ±{free} mm, where the tip is clear of the posts");
                return Err(refused("tip offset", offset, &bound));
            }
        }
        Ok(())
    }

    /// Returns the film's cells.
    pub(crate) fn grid(&self) -> Grid {
        let breaks = self.breaks();
        Grid {
            axes: [Axis::new(&breaks), Axis::new(&breaks)],
            points: self.gauss_points,
        }
    }

    /// Returns the film held by its posts. `pattern` is that of a film with the same number of
    /// cells.
    pub(crate) fn shell(&self, pattern: Option<&Arc<Pattern>>) -> Shell {
        let (grid, sheet) = (self.grid(), self.sheet());
        let mut shell = match pattern {
            Some(pattern) => Shell::of(grid, &sheet, Arc::clone(pattern)),
            None => Shell::new(grid, &sheet),
        };
        let hold = Hold::new(shell.grid(), self.springs(None));
        shell.hold(hold);
        shell
    }

    /// Iterates over the springs that hold the film, N/mm at points: of one post, or of all if
    /// `None`.
    pub(crate) fn springs(&self, post: Option<usize>) -> impl Iterator<Item = ([f64; 2], f64)> {
        let grip = self.post_grip_n_per_mm3;
        let points = self.points_of_posts(post).into_iter();
        points.map(move |(point, area)| (point, area * grip))
    }

    /// Returns the points of the film on which the tip presses, mm at rest, with their shares of
    /// its force.
    pub fn tip_points(&self) -> Vec<([f64; 2], f64)> {
        tip_points(self.tip_offset_mm, self.tip_radius_mm)
    }

    /// Returns the points of the film on one post, or on all if `None`, mm at rest, with their
    /// areas in mm². They are Gauss's points over the angle whose sine is x, and along the chord
    /// there. They follow a shifted post, and the film's edge cuts them, without a jump.
    fn points_of_posts(&self, only: Option<usize>) -> Vec<([f64; 2], f64)> {
        let (half, edge) = (self.span_mm / 2.0, self.half_edge_mm());
        let centres = [[-half, -half], [half, -half], [half, half], [-half, half]];
        let radius = self.post_radius_mm;
        let on_film = |from: f64, to: f64| [from.max(-edge), to.min(edge)];
        let mut points = Vec::new();
        for (post, ([cx, cy], [dx, dy])) in centres.into_iter().zip(self.post_shift_mm).enumerate()
        {
            if only.is_some_and(|only| only != post) {
                continue;
            }
            let (cx, cy) = (cx + dx, cy + dy);
            let angles = on_film(cx - radius, cx + radius)
                .map(|x| ((x - cx) / radius).clamp(-1.0, 1.0).asin());
            for (angle, turned) in gauss(angles) {
                let (x, chord) = (cx + radius * angle.sin(), radius * angle.cos());
                let along = gauss(on_film(cy - chord, cy + chord));
                points.extend(along.map(|(y, height)| ([x, y], chord * turned * height)));
            }
        }
        points
    }

    /// Checks that a point that is pressed, mm, is on the film and on no post.
    pub(crate) fn check_pressed(&self, point_mm: [f64; 2]) -> Result<(), ShellError> {
        let (half, edge) = (self.span_mm / 2.0, self.half_edge_mm());
        let on_film = point_mm.iter().all(|part| (-edge..=edge).contains(part));
        let centres = [[-half, -half], [half, -half], [half, half], [-half, half]];
        let on_post = |([cx, cy], [dx, dy]): ([f64; 2], [f64; 2])| {
            let [x, y] = point_mm;
            (x - cx - dx).hypot(y - cy - dy) < self.post_radius_mm
        };
        let mut posts = centres.into_iter().zip(self.post_shift_mm);
        if on_film && !posts.any(on_post) {
            return Ok(());
        }
        Err(ShellError::Contact(format!(
            "it presses at {point_mm:?} mm: press on the film, within ±{edge} mm, and on no post"
        )))
    }

    /// Returns the cell borders along one side: even steps in the integral of 1 / (wanted size),
    /// symmetric.
    fn breaks(&self) -> Vec<f64> {
        let step = self.half_edge_mm() / SAMPLES as f64;
        let counts = self.counts();
        let cells = self
            .cells
            .map_or(counts[SAMPLES].ceil(), |cells| cells as f64);
        let scale = counts[SAMPLES] / cells;
        let border = |k: usize| {
            let i = counts
                .partition_point(|count| *count < k as f64 * scale)
                .clamp(1, SAMPLES);
            let share = (k as f64 * scale - counts[i - 1]) / (counts[i] - counts[i - 1]);
            (i as f64 - 1.0 + share.min(1.0)) * step
        };
        let half: Vec<f64> = (1..=cells as usize).map(border).collect();
        let left = half.iter().rev().map(|x| -x);
        left.chain([0.0]).chain(half.iter().copied()).collect()
    }

    /// Returns the wanted number of cells from the middle to each of many even steps towards the
    /// edge.
    fn counts(&self) -> Vec<f64> {
        let step = self.half_edge_mm() / SAMPLES as f64;
        let mut counts = vec![0.0];
        for i in 0..SAMPLES {
            let at = (i as f64 + 0.5) * step;
            counts.push(counts[i] + step / self.cell_mm(at));
        }
        counts
    }

    /// Returns the wanted size of a cell `at` mm from the middle: small in the tip's range and at
    /// the posts.
    fn cell_mm(&self, at: f64) -> f64 {
        let tip = TIP_CELL_MM + GROWTH * (at - self.tip_reach_mm).max(0.0);
        let outside = (at - self.span_mm / 2.0).abs() - self.post_radius_mm;
        let post = POST_CELL_MM + GROWTH * outside.max(0.0);
        tip.min(post).min(LARGEST_CELL_MM) / self.fineness
    }
}

/// Returns the points on which a tip presses, mm, with their shares of its force.
pub(crate) fn tip_points(place_mm: [f64; 2], radius: f64) -> Vec<([f64; 2], f64)> {
    let points: Vec<_> = disc(place_mm, radius, TIP_RINGS, TIP_RAYS)
        .map(|(point, area, r)| (point, area * (1.0 - (r / radius).powi(2)).powi(2)))
        .collect();
    let total: f64 = points.iter().map(|(_, share)| share).sum();
    points
        .into_iter()
        .map(|(point, share)| (point, share / total))
        .collect()
}

/// Iterates over Gauss's points on a length, with their weights. An empty length has no points.
pub(crate) fn gauss([from, to]: [f64; 2]) -> impl Iterator<Item = (f64, f64)> {
    static POINTS: LazyLock<[(f64, f64); POST_POINTS]> = LazyLock::new(gauss_points);
    let (middle, half) = ((from + to) / 2.0, ((to - from) / 2.0).max(0.0));
    POINTS
        .iter()
        .map(move |(at, weight)| (middle + half * at, half * weight))
        .filter(|(_, weight)| *weight > 0.0)
}

/// Returns Gauss's points and weights on [−1, 1]: the roots of Legendre's polynomial by Newton's
/// method.
fn gauss_points() -> [(f64, f64); POST_POINTS] {
    let n = POST_POINTS as f64;
    std::array::from_fn(|i| {
        let mut x = -(PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut before, mut value) = (1.0, x);
            for k in 2..=POST_POINTS {
                let k = k as f64;
                (before, value) = (
                    value,
                    ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k,
                );
            }
            slope = n * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    })
}

/// Returns the points of a disc in rings: place, area and distance from its centre.
fn disc(
    [cx, cy]: [f64; 2],
    radius: f64,
    rings: usize,
    rays: usize,
) -> impl Iterator<Item = ([f64; 2], f64, f64)> {
    let (width, angle) = (radius / rings as f64, 2.0 * PI / rays as f64);
    let ring = move |i: usize| {
        let r = (i as f64 + 0.5) * width;
        (0..rays).map(move |k| {
            let (sin, cos) = ((k as f64 + 0.5) * angle).sin_cos();
            ([cx + r * cos, cy + r * sin], r * width * angle, r)
        })
    };
    (0..rings).flat_map(ring)
}

fn positive(what: &str, value: f64) -> Result<(), ShellError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(refused(what, value, "more than 0"))
}

fn refused(what: &str, value: f64, bound: &str) -> ShellError {
    ShellError::Design(format!("{what} is {value}: use a number {bound}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_films_are_refused_by_name() {
        let refused = |change: fn(&mut Design)| {
            let mut design = Design::default();
            change(&mut design);
            design.check().unwrap_err().to_string()
        };
        assert!(refused(|d| d.span_mm = 0.0).contains("span"));
        assert!(refused(|d| d.overhang_mm = -1.0).contains("overhang"));
        assert!(refused(|d| d.post_radius_mm = f64::NAN).contains("post radius"));
        assert!(refused(|d| d.material.poisson = 0.6).contains("Poisson"));
        assert!(refused(|d| d.material.thickness_mm = -0.5).contains("thickness"));
        assert!(refused(|d| d.fineness = 100.0).contains("fineness"));
        assert!(refused(|d| d.stretch[1] = 0.2).contains("stretch along y"));
        assert!(refused(|d| d.law.neo_hooke = 2.0).contains("neo-Hooke"));
        assert!(refused(|d| d.law.stiffening = -0.1).contains("stiffening"));
        assert!(refused(|d| d.thickness_slope = [0.4, 0.4]).contains("relative thickness"));
        assert!(refused(|d| d.thickness_curve[0] = f64::NAN).contains("relative thickness"));
        assert!(refused(|d| d.down = [2.0, 1.0, 0.0]).contains("gravity"));
        assert!(refused(|d| d.dot_stiffening = 4.0).contains("dots"));
        assert!(refused(|d| d.dots_mm = vec![[15.0, 0.0]]).contains("dot's place"));
        assert!(refused(|d| d.cells = Some(2)).contains("cells"));
        assert!(refused(|d| d.gauss_points = 1).contains("Gauss"));
        assert!(refused(|d| d.tip_offset_mm = [0.0, 13.0]).contains("tip offset"));
        assert!(refused(|d| d.tip_offset_mm = [f64::NAN, 0.0]).contains("tip offset"));
    }

    #[test]
    fn cells_are_symmetric_and_fill_the_film() {
        for overhang_mm in [0.0, 6.0] {
            let design = Design {
                overhang_mm,
                ..Design::default()
            };
            let breaks = design.breaks();
            let edge = design.half_edge_mm();
            assert!((breaks[breaks.len() - 1] - edge).abs() < 1e-9);
            assert!(breaks.windows(2).all(|pair| pair[1] > pair[0]));
            for (left, right) in breaks.iter().zip(breaks.iter().rev()) {
                assert!((left + right).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn posts_and_tip_have_their_size() {
        let area = |overhang_mm| -> f64 {
            let design = Design {
                overhang_mm,
                ..Design::default()
            };
            let points = design.points_of_posts(None);
            points.iter().map(|(_, area)| area).sum()
        };
        let disc = PI * 1.5 * 1.5;
        assert!((area(0.0) - disc).abs() < 1e-9, "four quarters");
        assert!((area(6.0) - 4.0 * disc).abs() < 1e-9, "four discs");
        let shares: f64 = Design::default()
            .tip_points()
            .iter()
            .map(|(_, share)| share)
            .sum();
        assert!((shares - 1.0).abs() < 1e-12);
    }
}
