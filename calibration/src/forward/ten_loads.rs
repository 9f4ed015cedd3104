//! A unit's film and camera from a handful of known loads: least squares over the few numbers in
//! which units differ, each drawn to its nominal value as strongly as building tolerances say.

use std::fmt;

use anyhow::{Result, ensure};
use hivtac_film::Film;
use hivtac_film::reduced::NOMINAL_RADIUS_MM;
use hivtac_scene::{Camera, Disc, Load, Preset};

use super::building::{FOCAL, MARKER_MM, MIDDLE_PX, POST_MM, ROLL_DEG, STIFFNESS, THICKNESS};
use super::{Open, OwnUnit, STEP as OPEN_STEP, UnitSetup};

/// A load that was put on, and what was seen of it.
#[derive(Clone, Copy, Debug)]
pub struct KnownLoad {
    /// The force as the gauge or the weight tells it, N.
    pub force_n: [f64; 3],
    /// Where the stage says the tip is, mm.
    pub place_mm: [f64; 2],
    /// Where markers 0–3 were seen, mean of some frames, px.
    pub seen_px: [[f64; 2]; 4],
}

/// What is known before there is a load.
#[derive(Clone, Copy, Debug)]
pub struct Bench {
    /// The camera's nominal focal length, px.
    pub focal_px: f64,
    /// Where its axis meets the picture, px.
    pub middle_px: [f64; 2],
    /// Standard uncertainty of a marker's mean coordinates, px.
    pub noise_px: f64,
    /// That of |F|, N.
    pub gauge_n: f64,
    /// That of the stage's zero, mm.
    pub stage_mm: f64,
}

/// A number in which units differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    /// ln of Young's modulus over the nominal one, and of the thickness.
    Stiffness,
    Thickness,
    /// A post's place along x or y, mm.
    Post(usize, usize),
    /// A marker's, mm.
    Marker(usize, usize),
    /// How far the camera is rolled, degrees; ln of its focal length over the nominal one; where
    /// the axis is, px.
    Roll,
    Focal,
    Middle(usize),
    /// The tip's radius, mm, and the stage's zero, mm.
    TipRadius,
    Stage(usize),
    /// What the pixel grid does to a marker at rest, px.
    Rest(usize, usize),
    /// How much larger a load is than its gauge says, N.
    Gauge(usize),
}

/// Standard deviations of the tip's radius, mm, and of what the pixel grid does at rest, px.
const TIP_RADIUS_MM: f64 = 0.25;
const REST_PX: f64 = 0.006;
/// Steps of numbers, in parts of their standard deviations, to see what they do.
const STEP: f64 = 0.02;
/// Gauss–Newton steps at most, and the change of χ² that ends them.
const ROUNDS: usize = 25;
const SETTLED: f64 = 1e-4;
/// Nothing is taken farther than so many standard deviations.
const AT_MOST: f64 = 3.0;
/// χ² of what is seen, over its degrees of freedom, of a fit that can be trusted.
const TRUSTED: f64 = 4.0;

/// What a fit found.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The unit.
    pub unit: OwnUnit,
    /// The tip's radius, mm.
    pub tip_radius_mm: f64,
    /// The stage's zero on the film, mm.
    pub stage_mm: [f64; 2],
    /// What a tare takes for the rest position less where markers rest, px.
    pub rest_px: [[f64; 2]; 4],
    /// Each number's name, value and standard uncertainty.
    pub numbers: Vec<(String, f64, f64)>,
    /// χ² over the degrees of freedom.
    pub chi_square: f64,
    /// What is still not known of the unit.
    pub open: Vec<Open>,
}

impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |part: f64| 100.0 * (part - 1.0);
        let (stiffer, thicker) = (percent(self.unit.stiffness), percent(self.unit.thickness));
        let words = |percent: f64, more: &str, less: &str| {
            let word = if percent < 0.0 { less } else { more };
            format!("{:.1} % {word}", percent.abs())
        };
        writeln!(
            f,
            "the film is {} and {} than the nominal one",
            words(stiffer, "stiffer", "softer"),
            words(thicker, "thicker", "thinner")
        )?;
        writeln!(f, "χ² over its degrees of freedom: {:.2}", self.chi_square)?;
        for (name, value, sigma) in &self.numbers {
            writeln!(f, "{name:<40} {value:>9.4} ± {sigma:.4}")?;
        }
        Ok(())
    }
}

/// A unit's numbers, their standard deviations before, and loads to hold them against.
struct Problem<'a> {
    bench: &'a Bench,
    rest_px: &'a [[f64; 2]; 4],
    loads: &'a [KnownLoad],
    numbers: Vec<(Number, f64)>,
    camera: Camera,
}

/// Fits a unit to its rest position and to loads, from several starts.
///
/// # Errors
/// When there are too few loads, or no start ends where the markers are explained: then something
/// is not as it was said to be.
pub fn fit(bench: &Bench, rest_px: &[[f64; 2]; 4], loads: &[KnownLoad]) -> Result<Fit> {
    ensure!(
        loads.len() >= 4,
        "{} loads: at least 4 are needed, best ten, some tilted and some 2 to 3 mm off the middle",
        loads.len()
    );
    let problem = Problem {
        bench,
        rest_px,
        loads,
        numbers: numbers(bench, loads.len()),
        camera: Camera::new(Preset::Ov7725, 320, 240)?,
    };
    let mut found = At::default();
    for start in problem.starts() {
        let end = problem.descend(start)?;
        if found.parts.is_empty() || end.square() < found.square() {
            found = end;
        }
    }
    let chi_square = found.square() / (8 * loads.len() + 8) as f64;
    ensure!(
        chi_square <= TRUSTED,
        "no unit explains these loads (χ² {chi_square:.1} over its degrees of freedom): check the \
         forces, their directions and the tip's places"
    );
    // What is seen scatters more than it should: what the loads tell is known so much less.
    let noisier = Bench {
        noise_px: bench.noise_px * chi_square.max(1.0).sqrt(),
        ..*bench
    };
    let problem = Problem {
        bench: &noisier,
        ..problem
    };
    problem.fitted(found, chi_square)
}

fn numbers(bench: &Bench, loads: usize) -> Vec<(Number, f64)> {
    let mut numbers = vec![
        (Number::Stiffness, STIFFNESS),
        (Number::Thickness, THICKNESS),
        (Number::Roll, ROLL_DEG),
        (Number::Focal, FOCAL),
        (Number::TipRadius, TIP_RADIUS_MM),
    ];
    for axis in [0, 1] {
        numbers.push((Number::Middle(axis), MIDDLE_PX));
        numbers.push((Number::Stage(axis), bench.stage_mm));
        for k in 0..4 {
            numbers.push((Number::Post(k, axis), POST_MM));
            numbers.push((Number::Marker(k, axis), MARKER_MM));
            numbers.push((Number::Rest(k, axis), REST_PX));
        }
    }
    numbers.extend((0..loads).map(|k| (Number::Gauge(k), bench.gauge_n)));
    numbers
}

/// A unit as its numbers, in parts of their standard deviations, make it.
struct Made {
    unit: OwnUnit,
    tip_radius_mm: f64,
    stage_mm: [f64; 2],
    middle_px: [f64; 2],
    rest_px: [[f64; 2]; 4],
    gauge_n: Vec<f64>,
}

/// How markers 0–3 move under a load, focal lengths.
type Moved = [[f64; 2]; 4];

/// Some values of a unit's numbers, and what they explain.
#[derive(Default)]
struct At {
    /// The values, in parts of the numbers' standard deviations.
    parts: Vec<f64>,
    /// How the markers move under each load.
    moved: Vec<Moved>,
    residuals: Vec<f64>,
}

impl At {
    /// χ²: what is seen, and how far the numbers are from their nominal values.
    fn square(&self) -> f64 {
        let all = self.residuals.iter().chain(&self.parts);
        all.map(|part| part * part).sum()
    }
}

impl Problem<'_> {
    fn made(&self, parts: &[f64]) -> Made {
        let mut made = Made {
            unit: OwnUnit {
                stiffness: 1.0,
                thickness: 1.0,
                grip: 1.0,
                posts_mm: [[0.0; 2]; 4],
                markers_mm: [[0.0; 2]; 4],
                focal_px: self.bench.focal_px,
                roll_deg: 0.0,
            },
            tip_radius_mm: NOMINAL_RADIUS_MM,
            stage_mm: [0.0; 2],
            middle_px: self.bench.middle_px,
            rest_px: [[0.0; 2]; 4],
            gauge_n: vec![0.0; self.loads.len()],
        };
        for ((number, sigma), part) in self.numbers.iter().zip(parts) {
            let value = part * sigma;
            match *number {
                Number::Stiffness => made.unit.stiffness = libm::exp(value),
                Number::Thickness => made.unit.thickness = libm::exp(value),
                Number::Post(k, axis) => made.unit.posts_mm[k][axis] = value,
                Number::Marker(k, axis) => made.unit.markers_mm[k][axis] = value,
                Number::Roll => made.unit.roll_deg = value,
                Number::Focal => made.unit.focal_px *= libm::exp(value),
                Number::Middle(axis) => made.middle_px[axis] += value,
                Number::TipRadius => {
                    made.tip_radius_mm = (NOMINAL_RADIUS_MM + value).clamp(0.25, 2.0);
                }
                Number::Stage(axis) => made.stage_mm[axis] = value,
                Number::Rest(k, axis) => made.rest_px[k][axis] = value,
                Number::Gauge(k) => made.gauge_n[k] = value,
            }
        }
        made.unit.thickness = made.unit.thickness.clamp(0.7, 1.3);
        made.unit.stiffness = made.unit.stiffness.clamp(0.5, 2.0);
        made
    }

    fn setup(&self, made: &Made) -> UnitSetup<'_> {
        UnitSetup {
            unit: made.unit.film(),
            tip_radius_mm: made.tip_radius_mm,
            camera: &self.camera,
        }
    }

    /// How the markers move under each load, focal lengths.
    fn moved(&self, made: &Made) -> Result<Vec<Moved>> {
        (0..self.loads.len())
            .map(|number| self.moved_by(made, number))
            .collect()
    }

    fn moved_by(&self, made: &Made, number: usize) -> Result<Moved> {
        let setup = self.setup(made);
        let film = Film::of(setup.unit)?;
        let load = self.load(&self.loads[number], made, number)?;
        let mut moved = Moved::default();
        for (k, moved) in moved.iter_mut().enumerate() {
            *moved = setup.moved_by(&film, &load, k)?;
        }
        Ok(moved)
    }

    /// The same where one number has changed: most of a fit's time is spent on films, and not every
    /// number changes one.
    fn moved_again(&self, made: &Made, changed: Number, before: &[Moved]) -> Result<Vec<Moved>> {
        match changed {
            Number::Roll | Number::Focal | Number::Middle(_) | Number::Rest(..) => {
                Ok(before.to_vec())
            }
            Number::Gauge(load) => {
                let mut moved = before.to_vec();
                moved[load] = self.moved_by(made, load)?;
                Ok(moved)
            }
            _ => self.moved(made),
        }
    }

    /// What is seen less what should be, in parts of the noise: the rest position, then the loads.
    fn residuals(&self, made: &Made, moved: &[Moved]) -> Result<Vec<f64>> {
        let film = Film::of(self.setup(made).unit)?;
        let to_px = made.unit.to_px();
        let mut residuals = Vec::new();
        let mut add = |seen: [f64; 2], should: [f64; 2]| {
            residuals.extend([0, 1].map(|i| (seen[i] - should[i]) / self.bench.noise_px));
        };
        for k in 0..4 {
            let at = to_px(self.at_rest(&film, k));
            let off = made.rest_px[k];
            let should = [0, 1].map(|i| made.middle_px[i] + at[i] + off[i]);
            add(self.rest_px[k], should);
        }
        for (load, moved) in self.loads.iter().zip(moved) {
            for k in 0..4 {
                let moved = to_px(moved[k]);
                let should = [0, 1].map(|i| self.rest_px[k][i] - made.rest_px[k][i] + moved[i]);
                add(load.seen_px[k], should);
            }
        }
        Ok(residuals)
    }

    /// Where the numbers are so.
    fn at(&self, parts: Vec<f64>) -> Result<At> {
        let made = self.made(&parts);
        let moved = self.moved(&made)?;
        Ok(At {
            residuals: self.residuals(&made, &moved)?,
            moved,
            parts,
        })
    }

    /// Where a marker is seen at rest, focal lengths from the axis.
    fn at_rest(&self, film: &Film, marker: usize) -> [f64; 2] {
        let disc = Disc::marker(film.markers_mm()[marker]);
        let [x, y] = disc.centroid_px(|_| [0.0; 3], &self.camera);
        let middle =
            [self.camera.width(), self.camera.height()].map(|side| (f64::from(side) - 1.0) / 2.0);
        [x - middle[0], y - middle[1]].map(|part| part / self.camera.focal_px())
    }

    fn load(&self, load: &KnownLoad, made: &Made, number: usize) -> Result<Load> {
        let told_n = hivtac_data::loads::norm(load.force_n);
        let larger = 1.0 + made.gauge_n[number] / told_n;
        let place_mm = [0, 1].map(|i| load.place_mm[i] + made.stage_mm[i]);
        Ok(Load::from_vector(load.force_n.map(|part| larger * part))?
            .with_offset_mm(place_mm)?
            .with_tip_radius_mm(made.tip_radius_mm)?)
    }

    /// As tolerances have it; with a thicker, softer film; with a thinner, stiffer one.
    fn starts(&self) -> [Vec<f64>; 3] {
        [0.0, 1.5, -1.5].map(|thicker| {
            let part = |number: &Number| match number {
                Number::Thickness => thicker,
                Number::Stiffness => -1.5 * thicker,
                _ => 0.0,
            };
            self.numbers
                .iter()
                .map(|(number, _)| part(number))
                .collect()
        })
    }

    /// Gauss–Newton steps, each shortened until χ² falls; ends where it falls no more.
    fn descend(&self, parts: Vec<f64>) -> Result<At> {
        let mut here = self.at(parts)?;
        for _ in 0..ROUNDS {
            let (_, step) = self.solve(&here)?;
            let mut fell = false;
            for length in [1.0, 0.5, 0.2, 0.05] {
                let there = here.parts.iter().zip(&step);
                let there =
                    there.map(|(part, step)| (part + length * step).clamp(-AT_MOST, AT_MOST));
                let there = self.at(there.collect())?;
                if there.square() < here.square() {
                    fell = here.square() - there.square() > SETTLED;
                    here = there;
                    break;
                }
            }
            if !fell {
                break;
            }
        }
        Ok(here)
    }

    /// The covariance of the numbers, in parts of their standard deviations before, and the step to
    /// where they explain most.
    fn solve(&self, here: &At) -> Result<(Vec<Vec<f64>>, Vec<f64>)> {
        let At {
            parts, residuals, ..
        } = here;
        let mut columns = Vec::new();
        for (k, (number, _)) in self.numbers.iter().enumerate() {
            let mut there = parts.clone();
            there[k] += STEP;
            let made = self.made(&there);
            let moved = self.moved_again(&made, *number, &here.moved)?;
            let other = self.residuals(&made, &moved)?;
            let slope = other.iter().zip(residuals).map(|(a, b)| (a - b) / STEP);
            columns.push(slope.collect::<Vec<f64>>());
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let entry =
            |i: usize, j: usize| dot(&columns[i], &columns[j]) + f64::from(u8::from(i == j));
        let count = parts.len();
        let matrix = (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect());
        let covariance = inverse(matrix.collect())?;
        let side: Vec<f64> = (0..count)
            .map(|i| -dot(&columns[i], residuals) - parts[i])
            .collect();
        let step = covariance.iter().map(|row| dot(row, &side)).collect();
        Ok((covariance, step))
    }

    /// What a descent found, in parts of this noise.
    fn fitted(&self, mut found: At, chi_square: f64) -> Result<Fit> {
        let made = self.made(&found.parts);
        found.residuals = self.residuals(&made, &found.moved)?;
        let (covariance, _) = self.solve(&found)?;
        let told = self.numbers.iter().zip(&found.parts).enumerate();
        let numbers = told.map(|(k, ((number, sigma), part))| {
            (
                number.name(),
                sigma * part,
                sigma * covariance[k][k].max(0.0).sqrt(),
            )
        });
        Ok(Fit {
            unit: made.unit,
            tip_radius_mm: made.tip_radius_mm,
            stage_mm: made.stage_mm,
            rest_px: made.rest_px,
            numbers: numbers.collect(),
            chi_square,
            open: self.open(&found.parts, &covariance)?,
        })
    }

    /// The unit moved along each column of its numbers' factor: what is not known of it, without
    /// what a model file does not hold.
    fn open(&self, parts: &[f64], covariance: &[Vec<f64>]) -> Result<Vec<Open>> {
        let mut held: Vec<usize> = (0..parts.len())
            .filter(|k| self.numbers[*k].0.is_held())
            .collect();
        // Columns of those that come last leave the film as it is.
        held.sort_by_key(|k| matches!(self.numbers[*k].0, Number::Rest(..)));
        let row = |i: &usize| held.iter().map(|j| covariance[*i][*j]).collect();
        let spread = cholesky(held.iter().map(row).collect())?;
        let moved = |column: usize| {
            let mut there = parts.to_vec();
            for (row, k) in spread.iter().zip(&held) {
                there[*k] += OPEN_STEP * row[column];
            }
            let made = self.made(&there);
            Open {
                unit: made.unit,
                tip_radius_mm: made.tip_radius_mm,
                rest_px: made.rest_px,
            }
        };
        Ok((0..held.len()).map(moved).collect())
    }
}

impl Number {
    /// Whether a model file holds it: the others are the bench's.
    fn is_held(self) -> bool {
        !matches!(
            self,
            Number::Middle(_) | Number::Stage(_) | Number::Gauge(_)
        )
    }

    fn name(self) -> String {
        let along = |axis: usize| ["x", "y"][axis];
        match self {
            Number::Stiffness => "film's stiffness, ln".into(),
            Number::Thickness => "film's thickness, ln".into(),
            Number::Post(k, axis) => format!("post {k}, {}, mm", along(axis)),
            Number::Marker(k, axis) => format!("marker {k}, {}, mm", along(axis)),
            Number::Roll => "camera's roll, °".into(),
            Number::Focal => "focal length, ln".into(),
            Number::Middle(axis) => format!("optical axis, {}, px", along(axis)),
            Number::TipRadius => "tip's radius less 0.5 mm".into(),
            Number::Stage(axis) => format!("stage's zero, {}, mm", along(axis)),
            Number::Rest(k, axis) => format!("pixel grid at rest, marker {k}, {}, px", along(axis)),
            Number::Gauge(k) => format!("load {k} beyond its gauge, N"),
        }
    }
}

/// The factor L of a symmetric matrix L·Lᵀ that is positive definite; what is above its diagonal
/// means nothing.
fn cholesky(mut matrix: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>> {
    let count = matrix.len();
    for i in 0..count {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| matrix[i][k] * matrix[j][k]).sum();
            let left = matrix[i][j] - known;
            matrix[i][j] = if i == j {
                left.sqrt()
            } else {
                left / matrix[j][j]
            };
        }
        ensure!(
            matrix[i][i] > 0.0,
            "the loads do not tell the unit's numbers"
        );
        matrix[i][i + 1..].fill(0.0);
    }
    Ok(matrix)
}

/// Of a symmetric matrix that is positive definite.
fn inverse(matrix: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>> {
    let (count, matrix) = (matrix.len(), cholesky(matrix)?);
    // Columns of the factor's inverse, then their products.
    let mut columns = vec![vec![0.0; count]; count];
    for (k, column) in columns.iter_mut().enumerate() {
        for i in k..count {
            let known: f64 = (k..i).map(|j| matrix[i][j] * column[j]).sum();
            column[i] = (f64::from(u8::from(i == k)) - known) / matrix[i][i];
        }
    }
    let product = |i: usize, j: usize| columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum();
    Ok((0..count)
        .map(|i| (0..count).map(|j| product(i, j)).collect())
        .collect())
}
