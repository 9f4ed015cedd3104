//! Each table's outputs in full solutions, mirrored so that a marker is in the corner (+, +).

use hivtac_twin::film::reduced::{
    Kind, LARGEST_RADIUS_MM, LARGEST_TILT, LINEAR_N, NOMINAL_RADIUS_MM, Pose, rho,
};

use super::SAME_PLACE_MM;
use super::fit::Known;
use super::symmetry::Mirror;
use crate::sweep::{Moved, Solved};
use crate::{Change, ShellError};

/// Full solutions with tips of two radii.
pub struct Sweeps<'a> {
    /// Solutions with the nominal radius.
    pub nominal: &'a [Solved],
    /// Solutions with the largest radius, at some of the places.
    pub largest: &'a [Solved],
}

/// A row with one number for each output.
type Row = Vec<f64>;

impl<'a> Sweeps<'a> {
    /// Returns the known outputs of a table with the tip at a place. It uses every mirror that puts
    /// a solved place there.
    pub fn known(&self, kind: Kind, place_mm: [f64; 2]) -> Result<Vec<Known>, ShellError> {
        let mut all = Vec::new();
        for mirror in Mirror::all() {
            for (k, solved) in self.nominal.iter().enumerate() {
                let pose = mirror.pose(&solved.pose);
                if same(pose.place_mm, place_mm) {
                    self.tell(kind, &mirror, k, &mut all)?;
                }
            }
        }
        if all.is_empty() {
            return Err(ShellError::Solver(format!(
                "no solution has its tip at {place_mm:?} mm or a mirrored place: sweep the film \
                 anew"
            )));
        }
        Ok(all)
    }

    fn tell(
        &self,
        kind: Kind,
        mirror: &Mirror,
        index: usize,
        all: &mut Vec<Known>,
    ) -> Result<(), ShellError> {
        let solved = &self.nominal[index];
        let pose = mirror.pose(&solved.pose);
        match kind {
            Kind::Moved | Kind::Slopes | Kind::Tip => {
                let of = |moved: &Moved| outputs(kind, mirror, moved);
                for pose in poses(pose) {
                    all.push(Known {
                        pose,
                        values: of(&solved.moved),
                        slopes: Some(slopes(&pose, &by_force(mirror, solved, of))),
                    });
                }
            }
            Kind::Radius => all.extend(self.by_radius(Kind::Moved, mirror, index)),
            Kind::TipRadius => all.extend(self.by_radius(Kind::Tip, mirror, index)),
            Kind::Unit => all.push(value(pose, by_unit(mirror, solved, &pose))),
        }
        Ok(())
    }

    /// Returns the coefficients of ρ, ρ² and ρ³ in the effect of a larger tip, from the difference
    /// at ρ = 1 and the slopes at both ends. Returns `None` at places that are not solved with the
    /// largest radius.
    fn by_radius(&self, kind: Kind, mirror: &Mirror, index: usize) -> Option<Known> {
        let nominal = &self.nominal[index];
        let same_load = |solved: &&Solved| solved.pose == nominal.pose;
        let largest = self.largest.iter().find(same_load)?;
        let of = |moved: &Moved| outputs(kind, mirror, moved);
        let per_rho = |solved: &Solved, radius_mm: f64| {
            let step = 1e-3;
            let rate = (rho(radius_mm + step) - rho(radius_mm - step)) / (2.0 * step);
            let slope = of(&answer(solved, Change::TipRadius));
            slope.into_iter().map(|part| part / rate).collect::<Row>()
        };
        let ends = [
            per_rho(nominal, NOMINAL_RADIUS_MM),
            per_rho(largest, LARGEST_RADIUS_MM),
        ];
        let (here, there) = (of(&nominal.moved), of(&largest.moved));
        let outputs = 0..here.len();
        let cubic = outputs.clone().map(|k| {
            let (more, from, to) = (there[k] - here[k], ends[0][k], ends[1][k]);
            [from, 3.0 * more - 2.0 * from - to, from + to - 2.0 * more]
        });
        let cubic: Vec<[f64; 3]> = cubic.collect();
        let by_power = (0..3).flat_map(|power| cubic.iter().map(move |one| one[power]));
        Some(value(mirror.pose(&nominal.pose), by_power.collect()))
    }
}

/// Returns whether two places are the same.
pub fn same(a: [f64; 2], b: [f64; 2]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < SAME_PLACE_MM)
}

fn value(pose: Pose, values: Row) -> Known {
    Known {
        pose,
        values,
        slopes: None,
    }
}

/// A film at rest has derivatives for a load of any tilt.
pub fn poses(pose: Pose) -> Vec<Pose> {
    if pose.size > 0.0 {
        return vec![pose];
    }
    let ring = |k: u32| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
        [LARGEST_TILT * cos, LARGEST_TILT * sin]
    };
    let tilts = [[0.0; 2]].into_iter().chain((0..8).map(ring));
    tilts.map(|tilt| Pose { tilt, ..pose }).collect()
}

fn answer(solved: &Solved, change: Change) -> Moved {
    let place = Change::of_sweep().position(|one| one == change);
    place.map_or_else(Moved::default, |k| solved.answers[k])
}

/// Returns the outputs of a table of motions.
fn outputs(kind: Kind, mirror: &Mirror, moved: &Moved) -> Row {
    let disc = mirror.disc(&moved.discs[mirror.corner()]);
    match kind {
        Kind::Slopes => vec![disc.along_x[0], disc.along_y[0], disc.along_x[2]],
        Kind::Tip => pick(mirror.vector(moved.tip_mm)),
        _ => pick(disc.moved_mm),
    }
}

fn pick([x, _, z]: [f64; 3]) -> Row {
    vec![x, z]
}

/// Returns the derivatives of mirrored outputs by the force along x, y and z.
fn by_force(mirror: &Mirror, solved: &Solved, of: impl Fn(&Moved) -> Row) -> [Row; 3] {
    let by = |axis: usize| of(&answer(solved, Change::Force(axis)));
    let [x, y] = mirror.components([by(0), by(1)]);
    [x, y, by(2)]
}

/// Returns slopes by size and tilt from slopes by force.
pub fn slopes(pose: &Pose, by_force: &[Row; 3]) -> [Row; 3] {
    let moved = |axis: usize, step: f64| {
        let mut there = *pose;
        match axis {
            0 => there.size += step,
            _ => there.tilt[axis - 1] += step,
        }
        there.force_n()
    };
    [0, 1, 2].map(|axis| {
        let step = 1e-5;
        let [back, forth] = [-step, step].map(|step| moved(axis, step));
        let mut sum = vec![0.0; by_force[0].len()];
        for (c, row) in by_force.iter().enumerate() {
            let part = (forth[c] - back[c]) / (2.0 * step);
            for (sum, value) in sum.iter_mut().zip(row) {
                *sum += part * value;
            }
        }
        sum
    })
}

/// Returns the effects of a film's own differences at a load under which the nominal film has the
/// same depth.
fn by_unit(mirror: &Mirror, solved: &Solved, pose: &Pose) -> Row {
    let of = |moved: &Moved| outputs(Kind::Moved, mirror, moved);
    let [per_size, ..] = slopes(pose, &by_force(mirror, solved, of));
    // The decrease of the size per ln of the thickness t at constant force.
    let s = pose.size;
    let size_per_thickness = match s {
        0.0 => 0.0,
        _ => -(3.0 * LINEAR_N * s + s * s * s) / (LINEAR_N + 3.0 * s * s),
    };
    let thickness_mm = crate::Design::default().material.thickness_mm;
    let thicker = of(&answer(solved, Change::Thickness)).into_iter();
    let thicker = thicker
        .zip(per_size)
        .map(|(part, size)| thickness_mm * part - size * size_per_thickness);
    let mut row: Row = thicker.collect();
    row.extend(of(&answer(solved, Change::Grip)));
    for corner in hivtac_twin::MARKERS {
        let post = mirror.seen_as(corner.centre_mm);
        let by = [0, 1].map(|way| of(&answer(solved, Change::Post(post, way))));
        row.extend(mirror.components(by).concat());
    }
    row
}
