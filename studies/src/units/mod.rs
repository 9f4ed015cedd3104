//! Tests randomly drawn units: with a tare alone, and after a calibration.

mod bench;

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_twin::film::Layout;
use rayon::prelude::*;
use serde::Serialize;

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::{Errors, REACH_MM, Tared, TestedUnit, press};
pub use bench::{Bench, Jig};

/// Draw units as people build them; measure them with a tare alone, and after they were calibrated.
#[derive(Args)]
pub struct Units {
    /// A weights file with its film: of a network with places, or of another layout of dots, whose
    /// results are printed and no page.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Units drawn.
    #[arg(long, default_value_t = 24)]
    units: u64,
    /// Presses of each of the table's forces on each of them.
    #[arg(long, default_value_t = 100)]
    presses: u32,
    /// Whose films: of today's tables, or as people mount them.
    #[arg(long, value_enum, default_value_t = Films::Nominal)]
    films: Films,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// Whose films units have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Films {
    /// The simulated film's tables, a little stiffer, thicker, held elsewhere.
    Nominal,
    /// Solved by finite elements: stretched, cut otherwise, of other rubber.
    Real,
}

impl Films {
    /// Ranges of the pressed forces, mN.
    fn forces_mn(self) -> &'static [[u32; 2]] {
        match self {
            Films::Nominal => &[[50, 50], [100, 100], [200, 200]],
            Films::Real => &[[50, 200]],
        }
    }

    /// The calibrations: every one for films of finite elements.
    fn benches(self) -> &'static [(Bench, &'static str)] {
        match self {
            Films::Nominal => &Bench::ALL[..1],
            Films::Real => &Bench::ALL,
        }
    }
}

/// A unit with a tare alone, and after each calibration: its errors at each force, or the reason
/// why it could not be calibrated.
type Tested = Vec<Result<Vec<Errors>>>;

/// The results of all units for one calibration.
#[derive(Serialize)]
struct Row {
    calibration: &'static str,
    force_mn: [u32; 2],
    units: usize,
    without_model: usize,
    /// Root mean squares over all presses, and medians over the units' own: degrees, mN, µm.
    rms: [f64; 3],
    median: [f64; 3],
    /// Percentage of frames.
    with_force: f64,
    /// Percentages of forces: those beyond three stated standard uncertainties in any part, and
    /// those within the stated 95 % of direction, |F| and place.
    beyond: f64,
    within: [f64; 3],
}

impl Units {
    /// Runs the study.
    pub fn run(&self) -> Result<()> {
        let weights = Weights::load(&self.weights)?;
        let bytes = export(&weights)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let tested = (0..self.units).into_par_iter().map(|number| {
            let tested = self.test(&weights, &model, number);
            tested.with_context(|| format!("unit {number}"))
        });
        let tested: Vec<Tested> = tested.collect::<Result<_>>()?;
        let names = ["tare alone"].into_iter();
        let names = names.chain(self.films.benches().iter().map(|(_, name)| *name));
        let mut rows = Vec::new();
        for (nth, name) in names.enumerate() {
            for (k, force_mn) in self.films.forces_mn().iter().enumerate() {
                rows.push(row((name, *force_mn), &tested, |unit| {
                    Some(&unit[nth].as_ref().ok()?[k])
                }));
            }
        }
        if self.json {
            return page::print_rows(&rows);
        }
        let mut text = table(&rows)?;
        for (number, unit) in tested.iter().enumerate() {
            for error in unit.iter().filter_map(|errors| errors.as_ref().err()) {
                writeln!(text, "\nUnit {number} has no model: {error:#}.")?;
            }
        }
        print!("{text}");
        if weights.conditions.layout()? != Layout::default() {
            return Ok(());
        }
        match self.films {
            Films::Nominal => page::write("units.md", &text),
            Films::Real => page::write("real-films.md", &text),
        }
    }

    fn test(&self, weights: &Weights, model: &Model<'_>, number: u64) -> Result<Tested> {
        let layout = weights.conditions.layout()?;
        let unit = match self.films {
            Films::Nominal => TestedUnit::random(&model.conditions, layout, number)?,
            Films::Real => TestedUnit::with_real_film(&model.conditions, layout, number)?,
        };
        let mut tared = unit.tare(model)?;
        let mut tested = vec![Ok(self.answers(&mut tared, &unit, number)?)];
        tested.extend(self.films.benches().iter().map(|(bench, name)| {
            let own = bench.calibrate(weights, &unit, &mut tared, number);
            let own = export(&own.with_context(|| format!("after {name}"))?)?;
            let own = Model::parse(&own).map_err(|error| anyhow!("{error}"))?;
            self.answers(&mut unit.tare(&own)?, &unit, number)
        }));
        Ok(tested)
    }

    fn answers(
        &self,
        tared: &mut Tared<'_>,
        unit: &TestedUnit,
        number: u64,
    ) -> Result<Vec<Errors>> {
        let forces = self.films.forces_mn().iter();
        let all = forces.map(|force_mn| {
            let mut errors = Errors::default();
            for k in 0..self.presses {
                let force_n = force_mn.map(|force| f64::from(force) * 1e-3);
                let load = press(k + 1000 * number as u32, force_n, REACH_MM)?;
                if unit.shows_all(&load)? {
                    let answer = tared.answer(unit, load, k.into())?;
                    errors.add(answer.force.as_ref(), &load)?;
                }
            }
            Ok(errors)
        });
        all.collect()
    }
}

fn row<'a>(
    (calibration, force_mn): (&'static str, [u32; 2]),
    units: &'a [Tested],
    of: impl Fn(&'a Tested) -> Option<&'a Errors>,
) -> Row {
    let each: Vec<&Errors> = units.iter().filter_map(of).collect();
    let median = |k: usize| {
        let mut values: Vec<f64> = each.iter().map(|errors| errors.rms()[k]).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let mut all = Errors::default();
    each.iter().for_each(|errors| all.merge(errors));
    let forces = f64::from(all.count);
    Row {
        calibration,
        force_mn,
        units: units.len(),
        without_model: units.len() - each.len(),
        rms: all.rms(),
        median: [0, 1, 2].map(median),
        with_force: 100.0 * forces / (forces + f64::from(all.refused)),
        beyond: 100.0 * f64::from(all.beyond) / forces,
        within: all.covered(),
    }
}

fn table(rows: &[Row]) -> Result<String> {
    let mut text = String::from(
        "| calibration | force | direction, rms: all, median of units | \\|F\\| | place | frames \
         with a force | beyond 3 stated σ | within the stated 95 %: direction, \\|F\\|, place | \
         units without a model |\n|---|--:|--:|--:|--:|--:|--:|---|--:|\n",
    );
    for row in rows {
        let force = match row.force_mn {
            [least, most] if least < most => format!("{least} to {most} mN"),
            [force, _] => format!("{force} mN"),
        };
        let ([a, b, c], [d, e, f], [x, y, z]) = (row.rms, row.median, row.within);
        writeln!(
            text,
            "| {} | {force} | {a:.2}°, {d:.2}° | {b:.2}, {e:.2} mN | {c:.0}, {f:.0} µm | {:.1} % | \
             {:.1} % | {x:.1}, {y:.1}, {z:.1} % | {} of {} |",
            row.calibration, row.with_force, row.beyond, row.without_model, row.units,
        )?;
    }
    Ok(text)
}
