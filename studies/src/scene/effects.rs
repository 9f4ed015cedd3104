//! `scene effects`: the errors by a film that lets light through, by mirrored LEDs, and by the
//! pixels of a colour camera.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_sensor::force::model::Model;
use hivtac_terms::status::Status;
use hivtac_twin::{Load, Options, Paint, Patch, Room};
use rayon::prelude::*;
use serde::Serialize;

use crate::page;
use crate::press::{Errors, REACH_MM, Tared, TestedUnit, press};

/// Range of the presses' forces, N.
const FORCE_N: [f64; 2] = [0.05, 0.2];
/// The tip's radius, mm.
const TIP_MM: f64 = 0.5;
/// Part of the light that passes clear silicone.
const CLEAR: f64 = 0.9;

/// Arguments of `scene effects`.
#[derive(Args)]
pub struct Effects {
    /// The model; its film is the scene's.
    #[arg(long, default_value = "calibration/models/default.hvtm")]
    model: PathBuf,
    /// Presses of each row.
    #[arg(long, default_value_t = 200)]
    presses: u32,
    /// Only the rows whose names contain this word.
    #[arg(long, default_value = "")]
    only: String,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// An effect: its group, its switch, and the options of the tare and of the presses.
type Effect = (&'static str, String, Options, Options);

/// The errors by one effect.
#[derive(Serialize)]
struct Row {
    effect: &'static str,
    what: String,
    /// Root mean square errors of direction, degrees, and |F|, mN.
    rms: [f64; 2],
    forces: u32,
    refused: u32,
    /// Forces farther off than three stated standard uncertainties.
    beyond: u32,
    /// The most frequent reason for a refusal, or why there was no tare.
    why: String,
}

impl Effects {
    pub(super) fn run(&self) -> Result<()> {
        let bytes = fs::read(&self.model).context("reading the model")?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let effects: Vec<Effect> = [none(), film(), leds(), sensor()].concat();
        let chosen = effects
            .into_par_iter()
            .filter(|effect| effect.0.contains(&self.only));
        let rows: Result<Vec<Row>> = chosen.map(|effect| self.row(effect, &model)).collect();
        let rows = rows?;
        if self.json {
            return page::print_rows(&rows);
        }
        print!("{}", table(&rows)?);
        Ok(())
    }

    fn row(&self, (effect, what, at_rest, pressed): Effect, model: &Model<'_>) -> Result<Row> {
        let unit = |options| TestedUnit::new(&model.conditions, options, TIP_MM, 0);
        let (resting, unit) = (unit(at_rest)?, unit(pressed)?);
        let (mut errors, mut reasons) = (Errors::default(), BTreeMap::new());
        match resting.tare(model) {
            Ok(mut tared) => {
                for number in 0..self.presses {
                    let load = press(number, FORCE_N, REACH_MM)?;
                    let status = answer(&mut tared, &unit, load, number, &mut errors)?;
                    let names = status.into_iter().flat_map(Status::names);
                    names.for_each(|name| *reasons.entry(name.to_owned()).or_insert(0) += 1);
                }
            }
            Err(why) => {
                errors.refused = self.presses;
                reasons.insert(why.to_string(), self.presses);
            }
        }
        let [direction_deg, magnitude_mn, _] = errors.rms();
        let most = reasons.into_iter().max_by_key(|(_, count)| *count);
        Ok(Row {
            effect,
            what,
            rms: [direction_deg, magnitude_mn],
            forces: errors.count,
            refused: errors.refused,
            beyond: errors.beyond,
            why: most.map_or(String::new(), |(name, _)| name),
        })
    }
}

/// Adds the answer to a press that the picture holds; returns the status of a refusal.
fn answer(
    tared: &mut Tared<'_>,
    unit: &TestedUnit,
    load: Load,
    number: u32,
    errors: &mut Errors,
) -> Result<Option<Status>> {
    if !unit.shows_all(&load)? {
        return Ok(None);
    }
    tared.sensor.forget_frame();
    let seen = tared.measure_closely(&unit.frame(&load, number.into())?);
    errors.add(seen.force.as_ref(), &load)?;
    Ok(seen
        .force
        .is_none()
        .then_some(Status(seen.status.0 & Status::NO_FORCE.0)))
}

fn none() -> Vec<Effect> {
    let usual = Options::default();
    vec![("none", "the usual scene".into(), usual.clone(), usual)]
}

/// Options of a film that lets this part of the light through, in a room of this brightness. The
/// camera finds its gain, or has this one.
fn through(transmission: f64, brightness: f64, gain: Option<f64>) -> Options {
    let seen = 1.0 - transmission + transmission * brightness;
    Options {
        gain: gain.unwrap_or(1.0 / seen),
        room: Room {
            transmission,
            brightness,
            ..Room::default()
        },
        ..Options::default()
    }
}

fn film() -> Vec<Effect> {
    let mut rows = Vec::new();
    for brightness in [0.2, 0.5, 1.0, 2.0, 4.0] {
        let what = format!("clear; room {brightness} times the lamp, exposed for it");
        let options = through(CLEAR, brightness, None);
        rows.push(("room", what, options.clone(), options));
    }
    for transmission in [0.1, 0.5, CLEAR] {
        let before = through(transmission, 0.5, None);
        let after = through(transmission, 1.0, Some(before.gain));
        let what = format!("{transmission} passes; the room becomes twice as bright");
        rows.push(("room", what, before, after));
    }
    for transmission in [0.1, 0.3, 0.5, CLEAR] {
        for finger_mm in [4.0, 8.0] {
            let before = through(transmission, 0.2, None);
            let mut after = before.clone();
            after.room.finger_mm = finger_mm;
            let what = format!("{transmission} passes; a fingertip, {finger_mm} mm");
            rows.push(("finger", what, before, after));
        }
    }
    for transmission in [0.1, 0.3, CLEAR] {
        let before = through(transmission, 1.0, None);
        let mut after = before.clone();
        after.room.things = vec![Patch {
            // A marker comes there under a press.
            centre_mm: [5.2, -5.2],
            radius_mm: 2.0,
            paint: Paint::Red,
        }];
        let what = format!("{transmission} passes; something red appears behind it");
        rows.push(("thing", what, before, after));
    }
    rows
}

fn leds() -> Vec<Effect> {
    let lit = |board_mm: f64| Options {
        board_leds_mm: Some(board_mm),
        ..Options::default()
    };
    let at = [5.0, 7.0, 9.0, 12.0, 18.0].map(|board_mm| {
        let what = format!("board {board_mm} mm behind the pinhole");
        ("leds", what, lit(board_mm), lit(board_mm))
    });
    let after = [7.0, 9.0, 12.0].map(|board_mm| {
        let what = format!("the same at {board_mm} mm, switched on after the tare");
        ("leds", what, Options::default(), lit(board_mm))
    });
    at.into_iter().chain(after).collect()
}

fn sensor() -> Vec<Effect> {
    let black = |haze: f64| Options {
        haze,
        ..Options::default()
    };
    let mut rows: Vec<Effect> = [-8.0, -4.0, 4.0, 8.0]
        .map(|levels| {
            let what = format!("{levels:+} levels of 255 after the tare");
            ("black level", what, Options::default(), black(levels))
        })
        .into();
    let bayer = Options {
        bayer: true,
        ..Options::default()
    };
    let what = "interpolated from pixels of one colour".into();
    rows.push(("bayer", what, bayer.clone(), bayer));
    rows
}

fn table(rows: &[Row]) -> Result<String> {
    let mut text = "| effect | | direction | \\|F\\| | forces | beyond 3 σ | refused | why |\n\
                    |---|---|--:|--:|--:|--:|--:|---|\n"
        .to_owned();
    for row in rows {
        let [degrees, mn] = row.rms;
        let figures = match row.forces {
            0 => "– | –".to_owned(),
            _ => format!("{degrees:.2}° | {mn:.2} mN"),
        };
        writeln!(
            text,
            "| {} | {} | {figures} | {} | {} | {} | {} |",
            row.effect, row.what, row.forces, row.beyond, row.refused, row.why
        )?;
    }
    Ok(text)
}
