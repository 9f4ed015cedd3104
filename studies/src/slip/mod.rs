//! Tests contact and slip on scenes with known true values.

mod course;
mod friction;
mod score;

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::motion::Motion;
use hivtac_sensor::temporal::{Moment, Temporal};
use hivtac_terms::status::Status;
use hivtac_twin::film::Layout;
use hivtac_twin::{Load, Options, Shutter};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::{Tared, TestedUnit, seeded};
use crate::units::Bench;
use course::{Course, Kind};
use score::{Frame, Score};

/// Lines of an OV7725's frame, 240 of them rows, and its frames a second.
const LINES: u16 = 278;
const RATE_HZ: f64 = 156.12;
/// Exposure of each row, s.
const EXPOSURE_S: f64 = 0.004;
/// Time between two checks whether a drawn course shows all markers, s; if not, another course is
/// drawn.
const LOOKED_AT_S: f64 = 0.02;
/// Most courses that are drawn before the study fails.
const DRAWS: u32 = 1000;
/// How the units are prepared, in the order of the tables.
const UNITS: [&str; 3] = ["nominal", "tare alone", "ten loads"];

/// Press, drag, release, grasp and catch, and count what contact and slip miss, invent, and how
/// late they come.
#[derive(Args)]
pub struct Slip {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Units drawn.
    #[arg(long, default_value_t = 10)]
    units: u64,
    /// Courses of each kind on each of them.
    #[arg(long, default_value_t = 2)]
    courses: u64,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// A row of the table: the unit's preparation, and the kind of the course.
#[derive(Serialize)]
struct Row {
    unit: &'static str,
    kind: &'static str,
    #[serde(flatten)]
    score: Score,
}

/// Contacts and slips by the unit's preparation and by kind; the last entry sums all kinds.
type Scores = [[[Score; 2]; Kind::ALL.len() + 1]; UNITS.len()];

impl Slip {
    /// Runs the study.
    pub fn run(&self) -> Result<()> {
        let weights = Weights::load(&self.weights)?;
        let bytes = export(&weights)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let units = (0..self.units).into_par_iter();
        let scores = units.map(|number| self.test(&weights, &model, number));
        let mut all = Scores::default();
        for scores in scores.collect::<Result<Vec<Scores>>>()? {
            let scores = scores.iter().flatten().flatten();
            let sums = all.iter_mut().flatten().flatten();
            sums.zip(scores).for_each(|(sum, score)| sum.merge(score));
        }
        let [contacts, slips] = [0, 1].map(|which| rows(&all, which));
        if self.json {
            let report = BTreeMap::from([("contacts", contacts), ("slips", slips)]);
            println!("{}", serde_json::to_string(&report)?);
            return Ok(());
        }
        let text = table("Contacts", &contacts)? + &table("Slips", &slips)?;
        print!("{text}");
        page::write("slip.md", include_str!("page.md"), &text)
    }

    /// Tests one unit with each preparation.
    fn test(&self, weights: &Weights, model: &Model<'_>, number: u64) -> Result<Scores> {
        let conditions = &model.conditions;
        let nominal = TestedUnit::new(conditions, Options::default(), 0.5, number)?;
        let drawn = TestedUnit::random(conditions, Layout::default(), number)?;
        let own = (Bench::Ten)
            .calibrate(weights, &drawn, &mut drawn.tare(model)?, number)
            .and_then(|own| export(&own))
            .with_context(|| format!("unit {number}"))?;
        let own = Model::parse(&own).map_err(|error| anyhow!("{error}"))?;
        let ready = [(&nominal, model), (&drawn, model), (&drawn, &own)];
        let mut scores = Scores::default();
        for (nth, (unit, model)) in ready.into_iter().enumerate() {
            let mut tared = unit.tare(model)?;
            tared.sensor.set_motion(Motion::rolling(LINES));
            // The same courses before and after the loads.
            let mut random = seeded(80_000 + 2 * number + u64::from(nth > 0));
            let kinds = Kind::ALL.into_iter().enumerate().cycle();
            for (k, (kind, _)) in kinds.take(self.courses as usize * Kind::ALL.len()) {
                let course = shown(unit, kind, &mut random)?;
                let frames = follow(unit, &mut tared, &course)?;
                for sum in [k, Kind::ALL.len()] {
                    let [contacts, slips] = &mut scores[nth][sum];
                    contacts.merge(&Score::of_contacts(&frames));
                    slips.merge(&Score::of_slips(&frames));
                }
            }
        }
        Ok(scores)
    }
}

/// A course that the simulated film can hold, with all markers in the picture.
fn shown(unit: &TestedUnit, kind: Kind, random: &mut ChaCha8Rng) -> Result<Course> {
    for _ in 0..DRAWS {
        let course = Course::random(kind, unit.tip_radius_mm, random);
        let steps = (course.duration_s() / LOOKED_AT_S) as u32;
        let is_shown = |step: u32| {
            let load = course.load(f64::from(step) * LOOKED_AT_S);
            load.is_ok_and(|load| unit.shows_all(&load).unwrap_or(false))
        };
        if (0..=steps).all(is_shown) {
            return Ok(course);
        }
    }
    Err(anyhow!("no {kind:?} of {DRAWS} can be shown"))
}

/// A sensor's results for a course, frame by frame.
fn follow(unit: &TestedUnit, tared: &mut Tared<'_>, course: &Course) -> Result<Vec<Frame>> {
    let shutter = Shutter {
        exposure_s: EXPOSURE_S,
        readout_s: 240.0 / f64::from(LINES) / RATE_HZ,
    };
    let mut temporal = Temporal::new();
    let mut frames = Vec::new();
    for number in 0.. {
        let time_s = (f64::from(number) + 0.5) / RATE_HZ;
        if time_s > course.duration_s() {
            break;
        }
        // Between the checked times there may be a load that the film does not hold.
        let load = |after_s| course.load(time_s + after_s).unwrap_or(Load::REST);
        let noise = u64::from(number);
        let picture = unit.scene.frame_under(&shutter, noise, load)?;
        let seen = tared.measure(&picture);
        let at = Moment {
            frame: number,
            time_us: (time_s * 1e6) as u64,
        };
        let followed = temporal.follow(at, &seen);
        let truth = course.meeting(time_s);
        frames.push(Frame {
            time_s,
            touches: truth.normal_n > 0.0,
            slips: truth.slips && truth.normal_n > 0.0,
            slipped_mm: truth.slipped_mm,
            has_force: followed.force.is_some(),
            told_touch: followed.status.contains(Status::CONTACT),
            told_slip: followed.status.contains(Status::SLIP),
        });
    }
    Ok(frames)
}

/// The rows of contacts (0) or slips (1): each kind, and all together.
fn rows(all: &Scores, which: usize) -> Vec<Row> {
    let kinds = || Kind::ALL.map(|(_, name)| name).into_iter().chain(["all"]);
    let units = UNITS.into_iter().zip(all);
    let rows = units.flat_map(|(unit, scores)| {
        kinds().zip(scores).map(move |(kind, scores)| Row {
            unit,
            kind,
            score: scores[which].clone(),
        })
    });
    rows.collect()
}

fn table(name: &str, rows: &[Row]) -> Result<String> {
    let mut text = format!(
        "\n{name}:\n\n| unit | what happens | true | reported | precision | recall | missed, of them \
         where frames had no force | delay: median, 95 % |\n|---|---|--:|--:|--:|--:|---|---|\n"
    );
    let percent = |part: u32, of: u32| match of {
        0 => "–".to_owned(),
        _ => format!("{:.0} %", 100.0 * f64::from(part) / f64::from(of)),
    };
    for Row { unit, kind, score } in rows {
        let delay = match (score.delay_ms(50), score.delay_ms(95)) {
            (Some(median), Some(most)) => format!("{median:.0}, {most:.0} ms"),
            _ => "–".to_owned(),
        };
        writeln!(
            text,
            "| {unit} | {kind} | {} | {} | {} | {} | {}, {} | {delay} |",
            score.true_events,
            score.told,
            percent(score.told - score.invented, score.told),
            percent(score.found, score.true_events),
            score.true_events - score.found,
            score.missed_without_force,
        )?;
    }
    Ok(text)
}
