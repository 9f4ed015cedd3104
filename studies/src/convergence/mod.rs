//! Where steps on the film run forwards find the contact: condition, steps and minima over the
//! place of the tip.

mod condition;
pub mod ways;

use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use rayon::prelude::*;
use serde::Serialize;

use crate::anywhere::WEIGHTS;
use crate::maps::{self, CALIBRATED_MM, FARTHEST_MM, Map, PLACES, place_mm};
use crate::page;
use crate::press::FORCES_MN;
use condition::condition;
use ways::{End, Film, STARTS};

/// Follow Gauss–Newton steps from many starts to contacts all over the film; draw condition, steps
/// and ends.
#[derive(Args)]
pub struct Convergence {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// The picture to write.
    #[arg(long, default_value = "docs/pictures/convergence.svg")]
    picture: PathBuf,
    /// Print one JSON object and write neither page nor picture.
    #[arg(long)]
    json: bool,
}

/// A place of the tip under one force.
struct Cell {
    place_mm: [f64; 2],
    /// `None` where the markers do not tell the load's parts.
    condition: Option<f64>,
    /// From the network's guess.
    network: End,
    /// From every start of the grid.
    ends: Vec<End>,
    /// What the sensor does from each: the same, and from the film's middle where that fails.
    sensor: Vec<End>,
}

/// What happens at one force, at places within a distance along x and y.
#[derive(Serialize)]
struct Row {
    force_mn: u32,
    within_mm: f64,
    /// Median and largest condition.
    condition: [f64; 2],
    /// Steps from the network's guess: median and most.
    steps: [u32; 2],
    /// Places at which the network's guess does not lead to the contact.
    lost: usize,
    places: usize,
    /// Of all starts, per cent: to the contact, to another that explains the markers as well, to
    /// nothing.
    starts: [f64; 3],
    /// The same, as the sensor goes on from the middle.
    sensor: [f64; 3],
    /// Most steps from a start that leads to the contact.
    most_steps: u32,
}

impl Convergence {
    /// Runs it.
    ///
    /// # Errors
    /// When a file cannot be read or written.
    pub fn run(&self) -> Result<()> {
        let weights = Weights::load(&self.weights)?;
        let bytes = export(&weights)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let alone = export(&Weights {
            film: None,
            ..weights.clone()
        })?;
        let alone = Model::parse(&alone).map_err(|error| anyhow!("{error}"))?;
        let film = Film::new(&model, alone).context("the model has no film")?;
        let mut maps = Vec::new();
        for force_mn in FORCES_MN {
            let cells = (0..PLACES * PLACES).into_par_iter();
            let cells = cells.map(|number| cell(&film, force_mn, number));
            maps.push((force_mn, cells.collect::<Result<Vec<Cell>>>()?));
        }
        let rows = maps.iter().flat_map(|(force_mn, cells)| {
            [CALIBRATED_MM, FARTHEST_MM].map(|within_mm| Row::of(*force_mn, within_mm, cells))
        });
        let rows: Vec<Row> = rows.collect();
        if self.json {
            return page::print_rows(&rows);
        }
        maps::write(&self.picture, 3, &panels(&maps))?;
        let mut text = String::from(
            "| force | places | condition, median, largest | steps from the network's guess, \
             median, most | lost from there | of all starts: found, another contact, nothing | the \
             sensor from these starts | most steps |\n\
             |--:|---|--:|--:|--:|---|---|--:|\n",
        );
        text.extend(rows.iter().map(Row::line));
        print!("{text}");
        page::write("convergence.md", include_str!("page.md"), &text)
    }
}

fn cell(film: &Film<'_>, force_mn: u32, number: usize) -> Result<Cell> {
    let place_mm = place_mm(number);
    let contact = film.contact(f64::from(force_mn) * 1e-3, place_mm, Some(number as u64));
    let starts = STARTS.iter().map(|start| contact.start(start));
    let starts: Vec<_> = starts.collect();
    Ok(Cell {
        place_mm,
        condition: condition(film.forward(), contact.best()),
        network: contact.descend(contact.network()?),
        ends: starts.iter().map(|start| contact.descend(*start)).collect(),
        sensor: starts.iter().map(|start| contact.sense(*start)).collect(),
    })
}

/// Parts of ends, per cent: at the contact, at another one, at nothing.
fn parts<'a>(ends: impl Iterator<Item = &'a End>) -> [f64; 3] {
    let mut counts = [0.0; 3];
    for end in ends {
        counts[match end {
            End::Found { .. } => 0,
            End::Another => 1,
            End::Nothing => 2,
        }] += 1.0;
    }
    let all: f64 = counts.iter().sum();
    counts.map(|count| 100.0 * count / all)
}

impl Row {
    fn of(force_mn: u32, within_mm: f64, cells: &[Cell]) -> Row {
        let inside = |cell: &&Cell| cell.place_mm.iter().all(|part| part.abs() <= within_mm);
        let cells: Vec<&Cell> = cells.iter().filter(inside).collect();
        let mut conditions: Vec<f64> = cells
            .iter()
            .map(|cell| cell.condition.unwrap_or(f64::INFINITY))
            .collect();
        conditions.sort_by(f64::total_cmp);
        let mut steps: Vec<u32> = cells
            .iter()
            .filter_map(|cell| cell.network.steps())
            .collect();
        steps.sort_unstable();
        let every = || cells.iter().flat_map(|cell| &cell.ends);
        Row {
            force_mn,
            within_mm,
            condition: [
                conditions[conditions.len() / 2],
                conditions[conditions.len() - 1],
            ],
            steps: [
                steps.get(steps.len() / 2).copied().unwrap_or(0),
                steps.last().copied().unwrap_or(0),
            ],
            lost: cells.len() - steps.len(),
            places: cells.len(),
            starts: parts(every()),
            sensor: parts(cells.iter().flat_map(|cell| &cell.sensor)),
            most_steps: every().filter_map(End::steps).max().unwrap_or(0),
        }
    }

    fn line(&self) -> String {
        let Row {
            force_mn,
            within_mm,
            condition: [usual, worst],
            steps: [median, most],
            lost,
            places,
            starts: [found, another, nothing],
            sensor: [sensed, mistaken, refused],
            most_steps,
        } = self;
        format!(
            "| {force_mn} mN | within ±{within_mm} mm | {usual:.0}, {worst:.0} | {median}, {most} \
             | {lost} of {places} | {found:.2}, {another:.3}, {nothing:.2} % | {sensed:.2}, \
             {mistaken:.3}, {refused:.2} % | {most_steps} |\n"
        )
    }
}

/// Condition, steps and starts that fail, for the weakest and the strongest force.
fn panels(maps: &[(u32, Vec<Cell>)]) -> Vec<Map> {
    let mut panels = Vec::new();
    for (force_mn, cells) in maps.iter().filter(|(force_mn, _)| *force_mn != 100) {
        let failed = |cell: &Cell| 100.0 - parts(cell.ends.iter())[0];
        panels.push(Map {
            title: format!("condition, {force_mn} mN"),
            levels: &[10.0, 14.0, 20.0, 30.0, 50.0, 100.0, 200.0],
            values: cells.iter().map(|cell| cell.condition).collect(),
        });
        panels.push(Map {
            title: format!("steps from the network's guess, {force_mn} mN"),
            levels: &[0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5],
            values: cells
                .iter()
                .map(|cell| cell.network.steps().map(f64::from))
                .collect(),
        });
        panels.push(Map {
            title: format!("starts that do not lead there, %, {force_mn} mN"),
            levels: &[0.1, 5.0, 10.0, 20.0, 30.0, 50.0, 75.0],
            values: cells.iter().map(|cell| Some(failed(cell))).collect(),
        });
    }
    panels
}
