//! Tips of another size than the model believes in.

use std::path::PathBuf;

use anyhow::{Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_terms::status::Status;
use hivtac_twin::Options;
use rayon::prelude::*;
use serde::Serialize;

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::{Bound, Errors, FORCES_MN, REACH_MM, Row, TestedUnit, noise_of, press};

/// Radii of tips, mm; the last is the largest that the simulated film knows, a flat fingertip more
/// than a tip.
const RADII_MM: [f64; 6] = [0.25, 0.5, 0.75, 1.0, 1.5, 2.0];
/// Those of which it is asked what a sixth unknown would cost, mm.
const SIXTH_MM: [f64; 2] = [0.5, 1.0];
/// Farthest along x and along y from the middle, mm.
const REACHES_MM: [f64; 2] = [0.5, REACH_MM];

/// Press with tips of 0.25 to 2 mm a unit whose model believes in 0.5 mm.
#[derive(Args)]
pub struct Tips {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Presses of each tip, force and reach.
    #[arg(long, default_value_t = 300)]
    presses: u32,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// Presses of one tip and force within a reach.
#[derive(Serialize)]
struct Pressed {
    radius_mm: f64,
    reach_mm: f64,
    #[serde(flatten)]
    row: Row,
    #[serde(skip)]
    errors: Errors,
    presses: u32,
    /// How many have no force because no contact explains them.
    unexplained: u32,
}

impl Tips {
    /// Runs it.
    ///
    /// # Errors
    /// When a file cannot be read or written, or a press cannot be made.
    pub fn run(&self) -> Result<()> {
        let bytes = export(&Weights::load(&self.weights)?)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let mut all = Vec::new();
        for reach_mm in REACHES_MM {
            for radius_mm in RADII_MM {
                all.extend(FORCES_MN.map(|force_mn| (radius_mm, reach_mm, force_mn)));
            }
        }
        let rows = all.into_par_iter().map(|which| self.pressed(&model, which));
        let rows: Vec<Pressed> = rows.collect::<Result<_>>()?;
        if self.json {
            return page::print_rows(&rows);
        }
        let mut text = String::from(
            "| within | tip's radius | force | direction, rms | \\|F\\|, rms | place, rms | \
             within the stated 95 %: direction, \\|F\\|, place | `unexplained` \
             |\n|--:|--:|--:|--:|--:|--:|---|--:|\n",
        );
        text.extend(rows.iter().map(Pressed::line));
        text += "\n| the bound at | force | radius known: direction, \\|F\\|, place | a sixth \
                 unknown: direction, \\|F\\|, place | radius |\n|--:|--:|---|---|--:|\n";
        for radius_mm in SIXTH_MM {
            for force_mn in FORCES_MN {
                text += &self.sixth(&model, radius_mm, force_mn)?;
            }
        }
        print!("{text}");
        page::write("tips.md", include_str!("tips.md"), &text)
    }

    /// A row: what is possible where the tip's radius is known, and where it is a sixth unknown.
    fn sixth(&self, model: &Model<'_>, radius_mm: f64, force_mn: u32) -> Result<String> {
        let unit = TestedUnit::new(&model.conditions, Options::default(), radius_mm, 1)?;
        let mut tared = unit.tare(model)?;
        let mut answers = Vec::new();
        for number in 0..self.presses {
            let load = press(number, f64::from(force_mn) * 1e-3, REACH_MM)?;
            if unit.shows_all(&load)? {
                answers.push(tared.answer(&unit, load, number.into())?);
            }
        }
        let noise = noise_of(&answers);
        let (mut known, mut unknown, mut radius) = (Bound::default(), Bound::default(), 0.0);
        for answer in &answers {
            known = known.plus(&Bound::of(&unit, &answer.load, &noise)?);
            let (bound, square) = Bound::with_radius(&unit, &answer.load, &noise)?;
            unknown = unknown.plus(&bound);
            radius += square;
        }
        let count = answers.len() as f64;
        let cell = |bound: &Bound| {
            format!(
                "{:.2}°, {:.2} mN, {:.1} µm",
                (bound.direction / count).sqrt().to_degrees(),
                1e3 * (bound.force / count).sqrt(),
                1e3 * (bound.place / count).sqrt()
            )
        };
        Ok(format!(
            "| {radius_mm} mm | {force_mn} mN | {} | {} | {:.3} mm |\n",
            cell(&known),
            cell(&unknown),
            (radius / count).sqrt()
        ))
    }

    fn pressed(
        &self,
        model: &Model<'_>,
        (radius_mm, reach_mm, force_mn): (f64, f64, u32),
    ) -> Result<Pressed> {
        let unit = TestedUnit::new(&model.conditions, Options::default(), radius_mm, 1)?;
        let mut tared = unit.tare(model)?;
        let (mut errors, mut presses, mut unexplained) = (Errors::default(), 0, 0);
        for number in 0..self.presses {
            let load = press(number, f64::from(force_mn) * 1e-3, reach_mm)?;
            if unit.shows_all(&load)? {
                let answer = tared.answer(&unit, load, number.into())?;
                errors.add(answer.force.as_ref(), &load)?;
                presses += 1;
                unexplained += u32::from(answer.status.contains(Status::UNEXPLAINED));
            }
        }
        Ok(Pressed {
            radius_mm,
            reach_mm,
            row: errors.row(force_mn),
            errors,
            presses,
            unexplained,
        })
    }
}

impl Pressed {
    fn line(&self) -> String {
        let Row {
            force_mn,
            direction_deg,
            magnitude_mn,
            place_um,
        } = self.row;
        let [direction, force, place] = self.errors.covered();
        let before = format!(
            "| ±{} mm | {} mm | {force_mn} mN |",
            self.reach_mm, self.radius_mm
        );
        let known = match self.errors.count {
            0 => " – | – | – | – |".to_owned(),
            _ => format!(
                " {direction_deg:.2}° | {magnitude_mn:.2} mN | {place_um:.0} µm | {direction:.0}, \
                 {force:.0}, {place:.0} % |"
            ),
        };
        let refused = self.errors.refused - self.unexplained;
        let others = match refused {
            0 => String::new(),
            _ => format!("; {refused} more refused by the markers"),
        };
        format!(
            "{before}{known} {} of {}{others} |\n",
            self.unexplained, self.presses
        )
    }
}
