//! What the configurations of the trade between speed and accuracy cost (`docs/tradeoff.md`):
//! frames without a model, models without a frame, the film run forwards, and some of all together,
//! which must be their sum.

use std::fs;

use anyhow::{Context, Result, ensure};
use serde::Serialize;

use super::cases::{Part, Work};
use super::measure::{Cost, Measured};
use crate::size::{self, Region};
use crate::toolchain::{Toolchain, cargo};
use crate::{process, workspace};

/// The model behind every frame; its own cost is taken off.
const BEHIND: &str = "16-16 int8";
/// What the name of a model ends with behind whose network there is a step.
const ONE_STEP: &str = ", 1 step";
/// The most steps that are counted.
const MOST_STEPS: u64 = 3;
/// How far from the sum of its parts a whole may be, of itself: what a force takes to become angles
/// depends a little on it, and blocks of instructions follow others.
const TOLERANCE: f64 = 0.01;
/// Where the result goes.
const FILE: &str = "studies/tradeoff/costs.json";
/// Everything, as the file has it.
#[derive(Serialize)]
struct Costs {
    compiler: String,
    frames: Vec<Frame>,
    models: Vec<Model>,
    film: Film,
    together: Vec<Together>,
    /// The firmware's memories, and the size of the model file that it holds.
    firmware: Vec<Region>,
    default_model_bytes: u64,
}

/// Instructions, and modelled cycles in memory without wait states.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Numbers {
    instructions: i64,
    cycles: i64,
}

/// From the first pixel to the features, and from the model's answer to the force.
#[derive(Serialize)]
struct Frame {
    size: [u64; 2],
    centroid: String,
    whole: Numbers,
    /// Of that, what is left to do after the last pixel came.
    latency: Numbers,
    /// Whether the model's answer is a part of that, too.
    answers_last: bool,
}

/// From features to the model's answer.
#[derive(Serialize)]
struct Model {
    model: String,
    bytes: u64,
    whole: Numbers,
    /// Cycles that come on top when its weights are read from flash.
    flash_cycles: u64,
}

/// The film run forwards behind a network.
#[derive(Serialize)]
struct Film {
    /// Of the model file.
    bytes: u64,
    /// One step: the film is run forwards where the network's answer is, and where the step leads.
    one_step: Numbers,
    /// Every other time that it is run forwards.
    each_more: Numbers,
    /// Cycles that come on top when its tables are read from flash.
    flash_cycles: u64,
}

/// A frame with its model, counted, and as the sum of its parts.
#[derive(Debug, Serialize)]
struct Together {
    size: [u64; 2],
    centroid: String,
    model: String,
    counted: Numbers,
    sum: Numbers,
}

/// Takes the parts apart, checks that they add up, and writes the file.
///
/// # Errors
/// When a part is missing, LLVM is, or a whole is not the sum of its parts.
pub fn write(toolchain: &Toolchain, measured: &[Measured]) -> Result<()> {
    let models = models(measured)?;
    let frames = frames(measured, &models)?;
    let film = film(measured, &models)?;
    let together = together(measured, &frames, &models, &film)?;
    let model = workspace::folder("calibration/models/default.hvtm");
    let model = fs::metadata(&model).with_context(|| format!("reading {}", model.display()))?;
    let costs = Costs {
        compiler: toolchain.compiler()?,
        frames,
        models,
        film,
        together,
        firmware: size::of_firmware(toolchain)?.0,
        default_model_bytes: model.len(),
    };
    let file = workspace::folder(FILE);
    let text = serde_json::to_string_pretty(&costs)? + "\n";
    fs::create_dir_all(file.parent().unwrap_or(workspace::root()))?;
    fs::write(&file, text).with_context(|| format!("writing {}", file.display()))?;
    eprintln!("wrote {}", file.display());
    Ok(())
}

/// Has `hivtac-studies tradeoff` write its tables anew.
///
/// # Errors
/// When it fails.
pub fn write_documents() -> Result<()> {
    let mut command = cargo("run", workspace::root());
    command.args(["--release", "--package", "hivtac-studies"]);
    process::run(command.args(["--", "tradeoff"]))
}

fn numbers(cost: Cost) -> Result<Numbers> {
    let cycles = cost
        .cycles
        .context("the trade is in modelled cycles, which need LLVM")?;
    Ok(Numbers {
        instructions: cost.instructions as i64,
        cycles: cycles.round() as i64,
    })
}

fn part(measured: &Measured) -> Result<&Part> {
    let part = measured.case.part.as_ref();
    part.with_context(|| format!("{} is no part of the trade", measured.case.file.display()))
}

fn models(measured: &[Measured]) -> Result<Vec<Model>> {
    let mut models = Vec::new();
    for measured in measured {
        let part = part(measured)?;
        if let Work::Network(_) = measured.case.work {
            models.push(Model {
                model: part.model.clone(),
                bytes: part.bytes,
                whole: numbers(measured.total())?,
                flash_cycles: measured.loads.weights_in_flash(),
            });
        }
    }
    Ok(models)
}

/// Steps less the network before them.
fn film(measured: &[Measured], models: &[Model]) -> Result<Film> {
    let stepping = |steps: u64| {
        let is_it =
            |measured: &&Measured| matches!(measured.case.work, Work::Steps(n) if n == steps);
        let found = measured.iter().find(is_it);
        found.with_context(|| format!("{steps} steps were not counted"))
    };
    let (one, three) = (stepping(1)?, stepping(MOST_STEPS)?);
    let network = find_model(models, &part(one)?.model)?;
    let (whole, all) = (numbers(one.total())?, numbers(three.total())?);
    let more = minus(all, whole);
    let others = MOST_STEPS as i64 - 1;
    Ok(Film {
        bytes: part(one)?.bytes - network.bytes,
        one_step: minus(whole, network.whole),
        each_more: Numbers {
            instructions: more.instructions / others,
            cycles: more.cycles / others,
        },
        flash_cycles: one.loads.weights_in_flash() - network.flash_cycles,
    })
}

fn frames(measured: &[Measured], models: &[Model]) -> Result<Vec<Frame>> {
    let behind = find_model(models, BEHIND)?.whole;
    let mut frames = Vec::new();
    for measured in measured {
        let part = part(measured)?;
        let Some(centroid) = &part.centroid else {
            continue;
        };
        if part.model == BEHIND {
            let whole = minus(numbers(measured.total())?, behind);
            let last_band = numbers(measured.last_band)?;
            let latency = match measured.answers_last {
                true => minus(last_band, behind),
                false => last_band,
            };
            frames.push(Frame {
                size: measured.case.size,
                centroid: centroid.clone(),
                whole,
                latency,
                answers_last: measured.answers_last,
            });
        }
    }
    Ok(frames)
}

fn together(
    measured: &[Measured],
    frames: &[Frame],
    models: &[Model],
    film: &Film,
) -> Result<Vec<Together>> {
    let mut together = Vec::new();
    for measured in measured {
        let part = part(measured)?;
        let Some(centroid) = &part.centroid else {
            continue;
        };
        if part.model == BEHIND {
            continue;
        }
        let is_same =
            |frame: &&Frame| (frame.size, &frame.centroid) == (measured.case.size, centroid);
        let frame = frames.iter().find(is_same);
        let frame = frame.with_context(|| format!("no frame without {}", part.model))?;
        let (a, b) = (frame.whole, behind(models, film, &part.model)?);
        let whole = Together {
            size: measured.case.size,
            centroid: centroid.clone(),
            model: part.model.clone(),
            counted: numbers(measured.total())?,
            sum: Numbers {
                instructions: a.instructions + b.instructions,
                cycles: a.cycles + b.cycles,
            },
        };
        whole.check()?;
        together.push(whole);
    }
    Ok(together)
}

impl Together {
    fn check(&self) -> Result<()> {
        let off = |sum: i64, counted: i64| (sum - counted) as f64 / counted as f64;
        let (counted, sum) = (self.counted, self.sum);
        let offs = [
            off(sum.instructions, counted.instructions),
            off(sum.cycles, counted.cycles),
        ];
        eprintln!(
            "{} behind a frame of {:?}, {}: the sum of its parts is off by {:+.2} % in \
             instructions and {:+.2} % in cycles",
            self.model,
            self.size,
            self.centroid,
            1e2 * offs[0],
            1e2 * offs[1]
        );
        ensure!(
            offs.iter().all(|off| off.abs() <= TOLERANCE),
            "the parts do not add up to the whole, which is {counted:?}"
        );
        Ok(())
    }
}

/// What a model costs, with a step behind its network where its name says so.
fn behind(models: &[Model], film: &Film, name: &str) -> Result<Numbers> {
    let Some(network) = name.strip_suffix(ONE_STEP) else {
        return Ok(find_model(models, name)?.whole);
    };
    let whole = find_model(models, network)?.whole;
    Ok(Numbers {
        instructions: whole.instructions + film.one_step.instructions,
        cycles: whole.cycles + film.one_step.cycles,
    })
}

fn find_model<'m>(models: &'m [Model], name: &str) -> Result<&'m Model> {
    let found = models.iter().find(|model| model.model == name);
    found.with_context(|| format!("the model `{name}` was not counted"))
}

fn minus(a: Numbers, b: Numbers) -> Numbers {
    Numbers {
        instructions: a.instructions - b.instructions,
        cycles: a.cycles - b.cycles,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_whole_that_is_not_the_sum_is_refused() {
        let numbers = |instructions, cycles| Numbers {
            instructions,
            cycles,
        };
        let mut whole = Together {
            size: [320, 240],
            centroid: String::new(),
            model: String::new(),
            counted: numbers(1000, 500),
            sum: numbers(1009, 496),
        };
        assert!(whole.check().is_ok());
        whole.sum = numbers(1000, 510);
        assert!(whole.check().is_err());
    }
}
