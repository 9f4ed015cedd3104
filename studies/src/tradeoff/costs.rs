//! What configurations cost on the chip, out of the parts that `cargo xtask bench --tradeoff`
//! counted.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use hivtac_terms::conditions::CentroidEstimator;
use serde::Deserialize;

use super::plan::{Estimator, Numbers};

/// The command that counts them.
pub const COMMAND: &str = "cargo xtask bench --tradeoff";
/// The core's clock, MHz.
pub const CLOCK_MHZ: f64 = 480.0;
/// A model of at most so many bytes is copied to DTCM, a larger one stays in flash
/// (`firmware/src/model.rs`).
const NEAR_LIMIT: u64 = 12 * 1024;
/// For each column of a frame: a ring of 32 bands and three bands more, of 8 rows and 2 bytes a
/// pixel (`firmware/src/bands.rs`).
const BAND_BYTES_OF_A_COLUMN: i64 = (32 + 3) * 8 * 2;
/// Memories that hold data; the code's copy in ITCM is none.
const DATA_MEMORIES: [&str; 3] = ["RAM", "SRAM", "AXISRAM"];

/// All counted parts.
#[derive(Clone, Debug, Deserialize)]
pub struct Costs {
    frames: Vec<FramePart>,
    models: Vec<ModelPart>,
    film: FilmPart,
    firmware: Vec<Memory>,
    default_model_bytes: i64,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct Counted {
    instructions: i64,
    cycles: i64,
}

#[derive(Clone, Debug, Deserialize)]
struct FramePart {
    size: [u16; 2],
    centroid: CentroidEstimator,
    whole: Counted,
    latency: Counted,
    /// Whether the model is run after the last pixel, too.
    answers_last: bool,
}

#[derive(Clone, Debug, Deserialize)]
struct ModelPart {
    model: String,
    bytes: u64,
    whole: Counted,
    flash_cycles: i64,
}

/// The film run forwards behind a network.
#[derive(Clone, Debug, Deserialize)]
struct FilmPart {
    /// Of the model file.
    bytes: u64,
    /// One step: the film is run forwards where the network's answer is, and where the step leads.
    one_step: Counted,
    /// Every other time that it is run forwards.
    each_more: Counted,
    flash_cycles: i64,
}

/// How often the film is run forwards in one step.
const LOOKS_OF_ONE_STEP: f64 = 2.0;

impl FilmPart {
    /// Instructions and cycles of a force for which the film is run forwards so often on average.
    fn cost(&self, looks: f64) -> [i64; 2] {
        let more = (looks - LOOKS_OF_ONE_STEP).max(0.0);
        let (one, each) = (self.one_step, self.each_more);
        [
            one.instructions + (more * each.instructions as f64).round() as i64,
            one.cycles + (more * each.cycles as f64).round() as i64,
        ]
    }
}

/// What makes a force of features.
#[derive(Clone, Copy)]
pub struct Behind<'a> {
    /// The network.
    pub estimator: &'a Estimator,
    /// How its numbers are held.
    pub numbers: Numbers,
    /// How often the film is run forwards from its answer, on average; 0 where the network stands
    /// alone.
    pub looks: f64,
}

#[derive(Clone, Debug, Deserialize)]
struct Memory {
    name: String,
    used: i64,
}

/// What one configuration costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// Instructions of a frame, counted.
    pub instructions: i64,
    /// Cycles of a frame, modelled; weights where they lie.
    pub cycles: i64,
    /// Of these, after the last pixel came.
    pub latency_cycles: i64,
    /// The firmware with this model, bytes of flash.
    pub flash: i64,
    /// Its data: DTCM, SRAM and AXI SRAM, without the stack, bytes.
    pub ram: i64,
}

impl Cost {
    /// Time of a frame at the core's clock, µs.
    pub fn microseconds(&self) -> f64 {
        self.cycles as f64 / CLOCK_MHZ
    }

    /// Frames a second that the core could do.
    pub fn rate(&self) -> f64 {
        1e6 / self.microseconds()
    }

    /// From the last pixel to the sample, µs.
    pub fn latency_microseconds(&self) -> f64 {
        self.latency_cycles as f64 / CLOCK_MHZ
    }
}

impl Costs {
    /// Reads the counted parts.
    ///
    /// # Errors
    /// When the file cannot be read or is none; says what makes it.
    pub fn load(path: &Path) -> Result<Self> {
        let text = fs::read_to_string(path)
            .with_context(|| format!("cannot read {}; `{COMMAND}` makes it", path.display()))?;
        Self::parse(&text)
            .with_context(|| format!("{} is not usable; `{COMMAND}` makes it", path.display()))
    }

    pub(super) fn parse(text: &str) -> Result<Self> {
        Ok(serde_json::from_str(text)?)
    }

    /// Of a configuration; `None` for one that the chip does not run.
    ///
    /// # Errors
    /// When one of its parts was not counted.
    pub fn of(
        &self,
        size: [u16; 2],
        centroid: CentroidEstimator,
        behind: Behind<'_>,
    ) -> Result<Option<Cost>> {
        let Some(name) = behind.estimator.cost_name(behind.numbers) else {
            return Ok(None);
        };
        let is_here = |part: &&FramePart| (part.size, part.centroid) == (size, centroid);
        let frame = self.frames.iter().find(is_here);
        let frame = frame.with_context(|| format!("frames of {size:?} were not counted"))?;
        let model = self.models.iter().find(|part| part.model == name);
        let model = model.with_context(|| format!("the model `{name}` was not counted"))?;
        let near = |bytes: i64| if bytes as u64 <= NEAR_LIMIT { bytes } else { 0 };
        let mut bytes = model.bytes as i64;
        let (mut own, mut flash_cycles) = (model.whole, model.flash_cycles);
        if behind.looks > 0.0 {
            let [instructions, cycles] = self.film.cost(behind.looks);
            own.instructions += instructions;
            own.cycles += cycles;
            bytes += self.film.bytes as i64;
            flash_cycles += self.film.flash_cycles;
        }
        let extra = match near(bytes) {
            0 => own.cycles + flash_cycles,
            _ => own.cycles,
        };
        let columns = i64::from(size[0]) - i64::from(super::plan::firmware_size()[0]);
        let used = |name: &str| {
            let memory = self.firmware.iter().find(|memory| memory.name == name);
            memory
                .map(|memory| memory.used)
                .with_context(|| format!("no memory {name}"))
        };
        let data: i64 = DATA_MEMORIES.map(used).into_iter().sum::<Result<i64>>()?;
        let ram = data + near(bytes) - near(self.default_model_bytes);
        Ok(Some(Cost {
            instructions: frame.whole.instructions + own.instructions,
            cycles: frame.whole.cycles + extra,
            latency_cycles: frame.latency.cycles + if frame.answers_last { extra } else { 0 },
            flash: used("FLASH")? + bytes - self.default_model_bytes,
            ram: ram + columns * BAND_BYTES_OF_A_COLUMN,
        }))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// 1000 instructions and 500 cycles for a frame, and a tenth of each for a model.
    pub fn example() -> Costs {
        let frame = |size: &str, answers_last: bool| {
            format!(
                r#"{{"size":{size},"centroid":"binary-mask",
                    "whole":{{"instructions":1000,"cycles":500}},
                    "latency":{{"instructions":100,"cycles":50}},"answers_last":{answers_last}}}"#
            )
        };
        let model = |name: &str, bytes: u64, flash: u64| {
            format!(
                r#"{{"model":"{name}","bytes":{bytes},
                    "whole":{{"instructions":100,"cycles":50}},"flash_cycles":{flash}}}"#
            )
        };
        let memory = |name: &str, used: u64| {
            format!(r#"{{"name":"{name}","origin":0,"length":0,"used":{used}}}"#)
        };
        let text = format!(
            r#"{{"compiler":"rustc","together":[],"frames":[{}],"models":[{}],
                "film":{{"bytes":50000,"one_step":{{"instructions":300,"cycles":150}},
                    "each_more":{{"instructions":200,"cycles":100}},"flash_cycles":40}},
                "firmware":[{}],"default_model_bytes":8000}}"#,
            [frame("[320,240]", false), frame("[640,480]", true),].join(","),
            [
                model("16-16 int8", 2_000, 30),
                model("128-128 int8", 20_000, 700),
            ]
            .join(","),
            [
                memory("FLASH", 200_000),
                memory("RAM", 90_000),
                memory("SRAM", 60_000),
                memory("AXISRAM", 160_000),
            ]
            .join(",")
        );
        Costs::parse(&text).unwrap()
    }

    #[test]
    fn a_configuration_costs_what_its_parts_do() {
        let (costs, all) = (example(), Estimator::all());
        let of = |size, estimator: usize, numbers| {
            let behind = Behind {
                estimator: &all[estimator],
                numbers,
                looks: 0.0,
            };
            costs.of(size, CentroidEstimator::BinaryMask, behind)
        };
        let cost = of([320, 240], 3, Numbers::Int8PerChannel);
        let cost = cost.unwrap().unwrap();
        assert_eq!(
            (cost.instructions, cost.cycles, cost.latency_cycles),
            (1100, 1250, 50)
        );
        // Weights that do not fit DTCM leave it.
        assert_eq!((cost.flash, cost.ram), (212_000, 302_000));
        assert!((cost.rate() - 480e6 / 1250.0).abs() < 1e-6);
        let cost = of([640, 480], 0, Numbers::Int8PerChannel);
        let cost = cost.unwrap().unwrap();
        assert_eq!(cost.latency_cycles, 100, "the answer comes last");
        assert_eq!(cost.ram, 310_000 - 6_000 + 320 * BAND_BYTES_OF_A_COLUMN);
        assert_eq!(of([320, 240], 0, Numbers::F32).unwrap(), None);
        let error = of([160, 120], 0, Numbers::Int8PerChannel).unwrap_err();
        assert!(error.to_string().contains("[160, 120]"), "{error}");
    }

    #[test]
    fn a_film_costs_as_often_as_it_is_run_forwards() {
        let (costs, all) = (example(), Estimator::all());
        let of = |looks| {
            let behind = Behind {
                estimator: &all[0],
                numbers: Numbers::Int8PerChannel,
                looks,
            };
            let cost = costs.of([320, 240], CentroidEstimator::BinaryMask, behind);
            cost.unwrap().unwrap()
        };
        let (alone, one, more) = (of(0.0), of(2.0), of(2.5));
        assert_eq!((alone.instructions, alone.cycles), (1100, 550));
        // Weights that fit DTCM alone leave it with a film beside them.
        assert_eq!((one.instructions, one.cycles), (1400, 550 + 30 + 150 + 40));
        assert_eq!((one.flash, one.ram), (244_000, alone.ram - 2_000));
        assert_eq!((more.instructions, more.cycles), (1500, one.cycles + 50));
    }

    #[test]
    fn memories_are_the_firmwares() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let has = |file: &str, line: &str| {
            let text = fs::read_to_string(root.join(file)).unwrap();
            assert!(text.contains(line), "no `{line}` in {file}");
        };
        has(
            "firmware/src/model.rs",
            "const NEAR_LIMIT: usize = 12 * 1024;",
        );
        has("firmware/src/bands.rs", "pub const ROWS: u16 = 8;");
        has("firmware/src/bands.rs", "pub const SLOTS: u16 = 32;");
        has(
            "firmware/src/camera/ov7725.rs",
            "pub const WIDTH: u16 = 320;",
        );
        has(
            "firmware/src/camera/ov7725.rs",
            "pub const HEIGHT: u16 = 240;",
        );
    }
}
