//! `scene tolerances`: the errors by each dimension of the kit at its tolerance.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_shell::Design;
use hivtac_twin::Options;
use rayon::prelude::*;
use serde::Serialize;

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::{Errors, REACH_MM, RealFilm, TestedUnit, press};
use crate::units::{Bench, Jig};

/// The radius on which the kit's rounded clamps hold the film, mm.
const CLAMP_MM: f64 = 2.0;
/// The film's reach beyond the posts, mm.
const OVERHANG_MM: f64 = 6.0;
/// Range of the presses' forces, N.
const FORCE_N: [f64; 2] = [0.05, 0.2];
/// Fineness of the films' meshes, which differs from that of fits.
const FINENESS: f64 = 0.7;
/// The tip's radius, mm.
const TIP_MM: f64 = 0.5;

/// Arguments of `scene tolerances`.
#[derive(Args)]
pub struct Tolerances {
    /// A weights file of a network with places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Presses on each unit.
    #[arg(long, default_value_t = 30)]
    presses: u32,
    /// Only the dimensions whose names contain this word.
    #[arg(long, default_value = "")]
    only: String,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// A unit of the kit.
struct Built {
    options: Options,
    /// The film, where it is solved by finite elements.
    design: Design,
    /// How far such a film is from its place: mm in the middle, mm per mm along x and y.
    lift: [f64; 3],
    tip_mm: f64,
    jig: Jig,
}

/// A dimension: its name, its error, and a unit with that error.
type Dimension = (&'static str, &'static str, fn(&mut Built));

/// The dimensions of units with the film of the simulated sensor's tables, and none.
const BY_TABLES: [Dimension; 13] = [
    ("nothing", "–", |_| ()),
    (
        "each bore off its place, as `--place-mm` says",
        "0.2 mm",
        |unit| unit.jig.place_mm = 0.2,
    ),
    ("wedge too steep", "0.5°", |unit| unit.jig.tilt_deg = 0.5),
    ("each dot off its place", "0.15 mm", |unit| {
        unit.options.glued_mm = around(0.15).into();
    }),
    ("film's thickness", "−10 %", |unit| {
        unit.options.film.unit.thickness = 0.9
    }),
    ("a post off its place along x and y", "0.3 mm", |unit| {
        unit.options.film.unit.posts_mm[0] = [-0.3; 2];
    }),
    ("weights too heavy", "1 %", |unit| unit.jig.weight = 0.01),
    (
        "lens's axis off the picture's middle",
        "3 px along x and y",
        |unit| {
            unit.options.mounting.shift_px = [3.0; 2];
        },
    ),
    ("camera rolled", "2°", |unit| {
        unit.options.mounting.roll_deg = 2.0
    }),
    ("lens's focal length", "+2 %", |unit| {
        unit.options.lens.pitch_um = Some(12.0 / 1.02);
    }),
    ("film's Young's modulus", "+20 %", |unit| {
        unit.options.film.unit.stiffness = 1.2
    }),
    ("tip's radius", "+0.1 mm", |unit| unit.tip_mm += 0.1),
    ("a camera whose pixels see one colour each", "–", |unit| {
        unit.options.bayer = true
    }),
];
/// Those of units whose film is solved by finite elements, and none.
const SOLVED: [Dimension; 7] = [
    ("nothing", "–", |_| ()),
    ("all posts too long", "0.3 mm", |unit| unit.lift[0] = 0.3),
    ("film stretched along x when it is mounted", "1 %", |unit| {
        unit.design.stretch = [0.01, 0.0];
    }),
    ("the posts of one side too long", "0.3 mm", |unit| {
        unit.lift[1] = 0.3 / 28.0
    }),
    (
        "film thicker at one edge than in its middle",
        "5 %",
        |unit| {
            unit.design.thickness_slope = [0.05, 0.0];
        },
    ),
    ("clamps' radius", "+0.5 mm", |unit| {
        unit.design.post_radius_mm += 0.5
    }),
    ("film's overhang", "+1 mm", |unit| {
        unit.design.overhang_mm += 1.0
    }),
];

/// Four steps of this length, in four directions.
fn around(length: f64) -> [[f64; 2]; 4] {
    let half = length / std::f64::consts::SQRT_2;
    [[length, 0.0], [0.0, length], [half, half], [-half, half]]
}
/// The results of one dimension.
#[derive(Serialize)]
struct Row {
    dimension: &'static str,
    /// Whether the film is solved by finite elements.
    solved: bool,
    off: &'static str,
    /// Root mean squares after ten loads: degrees, mN, µm; or the reason why there is no model.
    rms: Result<[f64; 3], String>,
    /// Percentages of forces within the stated 95 % of direction, |F| and place.
    within: [f64; 3],
    frames: u32,
}

impl Tolerances {
    pub(super) fn run(&self) -> Result<()> {
        let weights = Weights::load(&self.weights)?;
        let bytes = export(&weights)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let all = BY_TABLES.map(|row| (row, false)).into_iter();
        let all = all.chain(SOLVED.map(|row| (row, true)));
        let chosen: Vec<_> = all.filter(|(row, _)| row.0.contains(&self.only)).collect();
        let rows = chosen.into_par_iter();
        let rows = rows.map(|(row, solved)| self.row(row, solved, &weights, &model));
        let rows: Vec<Row> = rows.collect();
        if self.json {
            return page::print_rows(&rows);
        }
        print!("{}", table(&rows)?);
        Ok(())
    }

    fn row(
        &self,
        (name, off, change): Dimension,
        solved: bool,
        weights: &Weights,
        model: &Model<'_>,
    ) -> Row {
        let mut built = Built {
            design: Design {
                overhang_mm: OVERHANG_MM,
                post_radius_mm: CLAMP_MM,
                fineness: FINENESS,
                ..Design::default()
            },
            options: Options::default(),
            lift: [0.0; 3],
            tip_mm: TIP_MM,
            jig: Jig::default(),
        };
        change(&mut built);
        let errors = self.measure(built, solved, weights, model);
        eprintln!("{name}: {:?}", errors.as_ref().map(Errors::rms));
        let seen = errors.as_ref().ok();
        Row {
            dimension: name,
            solved,
            off,
            within: seen.map_or([f64::NAN; 3], Errors::covered),
            frames: seen.map_or(0, |errors| errors.count),
            rms: errors
                .map(|errors| errors.rms())
                .map_err(|error| format!("{error:#}")),
        }
    }

    /// The unit's errors after ten loads.
    fn measure(
        &self,
        built: Built,
        solved: bool,
        weights: &Weights,
        model: &Model<'_>,
    ) -> Result<Errors> {
        let mut unit = TestedUnit::new(&model.conditions, built.options, built.tip_mm, 0)?;
        if solved {
            unit = unit.on_film(RealFilm::lifted(&built.design, built.lift)?);
        }
        let mut tared = unit.tare(model)?;
        let own = Bench::Ten.calibrate_with(built.jig, weights, &unit, &mut tared, 0);
        let own = export(&own.context("after ten loads")?)?;
        let own = Model::parse(&own).map_err(|error| anyhow!("{error}"))?;
        let mut tared = unit.tare(&own)?;
        let mut errors = Errors::default();
        for number in 0..self.presses {
            let load = press(number, FORCE_N, REACH_MM)?;
            if unit.shows_all(&load)? {
                let answer = tared.answer(&unit, load, number.into())?;
                errors.add(answer.force.as_ref(), &load)?;
            }
        }
        Ok(errors)
    }
}

fn table(rows: &[Row]) -> Result<String> {
    let mut text = String::new();
    let groups = [
        (false, "Films of the tables:"),
        (true, "Films solved by finite elements:"),
    ];
    for (solved, title) in groups {
        writeln!(
            text,
            "{title}\n\n| off | by | direction | \\|F\\| | place | within the stated 95 %: \
             direction, \\|F\\|, place | forces |\n|---|---|--:|--:|--:|---|--:|"
        )?;
        for row in rows.iter().filter(|row| row.solved == solved) {
            let (name, off) = (row.dimension, row.off);
            let ([x, y, z], frames) = (row.within, row.frames);
            match &row.rms {
                Ok([a, b, c]) => writeln!(
                    text,
                    "| {name} | {off} | {a:.2}° | {b:.2} mN | {c:.0} µm | {x:.0}, {y:.0}, \
                     {z:.0} % | {frames} |"
                )?,
                Err(why) => writeln!(text, "| {name} | {off} | – | – | – | {why} | 0 |")?,
            }
        }
        writeln!(text)?;
    }
    Ok(text)
}
