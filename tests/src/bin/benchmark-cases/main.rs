//! `benchmark-cases FOLDER`: writes the scripts that `cargo xtask bench` runs, one file each, and
//! lists them, one JSON object a line: `{"name":…,"file":…}`. Those that a board can measure it
//! also writes as `board.rs`, for `firmware/examples/benchmark`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{env, fs};

use anyhow::{Context, Result, anyhow, bail, ensure};
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::forward::MOST_STEPS;
use hivtac_sensor::force::model::{Model, OutputKind};
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::conditions::CentroidEstimator::{self, BinaryMask, RednessWeighted};
use hivtac_terms::geometry::Geometry;
use hivtac_terms::marker::Marker;
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold};
use hivtac_tests::models::{self, Weights};
use hivtac_tests::script::Script;
use hivtac_tests::{pictures, qemu};
use hivtac_twin::{Dots, Format, Load, Options, Preset, Scene};
use serde_json::{Value, json};

/// The model that the sensor runs.
const SMALL: [u16; 4] = [11, 64, 64, 3];
/// Columns and rows of all frames.
const SIZE: [u16; 2] = [320, 240];
/// How many frames may be without a force before one has one.
const ATTEMPTS: u64 = 16;

/// Dots that move further by this, mm: then neither one contact nor two explain them.
const TORN: [usize; 3] = [1, 4, 6];
const TORN_MM: f64 = 0.2;

fn main() -> Result<()> {
    // Whoever reads the output may have enough of it.
    sigpipe::reset();
    let folder = env::args_os().nth(1).map(PathBuf::from);
    let folder = folder.context("usage: benchmark-cases FOLDER")?;
    let mut board = Board::default();
    let cases = cases()?;
    for (number, case) in cases.iter().enumerate() {
        println!("{}", case.write(&folder, number)?);
        board.add(&folder, case)?;
    }
    write(&folder.join("board.rs"), board.source().as_bytes())
}

struct Case {
    work: Work,
    /// A model file for such frames.
    model: Vec<u8>,
    format: PixelFormat,
}

enum Work {
    /// One frame through the whole pipeline, as the firmware runs it.
    Frame {
        /// Its special feature; empty for the usual one.
        special: &'static str,
        /// The frames before it, which show motion.
        before: Vec<Vec<u16>>,
        pixels: Vec<u16>,
    },
    /// One inference of the small model.
    Network,
    /// The network of a model with places, and the number of steps from its answer.
    Steps(u8, [Marker; 4], Box<Rest>),
    /// The threshold's table of 64 KiB.
    Table,
}

impl Case {
    /// Writes the script, and describes the case.
    fn write(&self, folder: &Path, number: usize) -> Result<Value> {
        let file = folder.join(format!("{number}.script"));
        write(&file, self.script().bytes())?;
        Ok(json!({ "name": self.name(), "file": file }))
    }

    fn name(&self) -> String {
        let mut size = SIZE;
        let item = match &self.work {
            Work::Frame { special: "", .. } => "frame full".to_owned(),
            Work::Frame { special, .. } => format!("frame full, {special}"),
            Work::Network => network_name(),
            Work::Steps(1, ..) => "network and 1 step".to_owned(),
            Work::Steps(steps, ..) => format!("network and {steps} steps"),
            Work::Table => {
                // As many values as a pixel has.
                size = [256, 256];
                "table".to_owned()
            }
        };
        format!("{item}, {}x{} {}", size[0], size[1], self.format.name())
    }

    fn script(&self) -> Script {
        let mut script = Script::new();
        script.model(&self.model);
        script.threshold(Threshold::red(self.format), ByteOrder::Swapped);
        match &self.work {
            Work::Frame { before, pixels, .. } => {
                let frames = before.iter().chain([pixels]).map(|frame| &frame[..]);
                script.sense(SIZE[0], &frames.collect::<Vec<_>>())
            }
            Work::Table => {
                script.counted_threshold(Threshold::red(self.format), ByteOrder::Swapped)
            }
            Work::Steps(_, markers, rest) => script.press(markers, rest),
            Work::Network => script.network(&models::rest(), &models::rest()),
        };
        script
    }
}

fn network_name() -> String {
    format!("network {}", SMALL.map(|width| width.to_string()).join("-"))
}

fn cases() -> Result<Vec<Case>> {
    let mut cases = Vec::new();
    for format in PixelFormat::ALL {
        let [model, weighted_model] = [BinaryMask, RednessWeighted].map(|it| model(format, it));
        let model = model?;
        let usual = usual_frame(&model, format)?;
        let case = |(special, pixels)| Case {
            work: Work::Frame {
                special,
                before: Vec::new(),
                pixels,
            },
            model: model.clone(),
            format,
        };
        cases.push(case(("", usual.clone())));
        cases.push(Case {
            model: weighted_model?,
            ..case(("weighted", usual.clone()))
        });
        // Special features are colours, drawn in RGB565.
        if format == PixelFormat::Rgb565 {
            cases.extend(strained(&usual).map(case));
        }
    }
    cases.push(pressed("one step", "4", models::anywhere(1))?);
    cases.push(pressed("eight dots", "8v", models::eight_dots())?);
    cases.push(pressed_by_two(
        "two contacts",
        "force: Some",
        models::UNDER_TWO_MM,
    )?);
    let mut torn_mm = models::UNDER_TWO_MM;
    for dot in TORN {
        torn_mm[dot][0] += TORN_MM;
    }
    cases.push(pressed_by_two("refused", "force: None", torn_mm)?);
    cases.push(Case {
        work: Work::Network,
        model: models::file(&SMALL, Weights::Random, OutputKind::ForceVector, 1),
        format: PixelFormat::Rgb565,
    });
    for steps in 1..=MOST_STEPS {
        cases.push(stepping(steps)?);
    }
    cases.push(Case {
        work: Work::Table,
        model: Vec::new(),
        format: PixelFormat::Rgb565,
    });
    Ok(cases)
}

/// A frame of a press of 0.1 N off the middle that grows, with the model that measures it.
fn pressed(special: &'static str, layout: &str, model: Vec<u8>) -> Result<Case> {
    let format = PixelFormat::Rgb565;
    let scene = scene("rest", format)?;
    let scene = scene.clone().with_options(Options {
        layout: layout.parse()?,
        ..scene.options().clone()
    })?;
    let frame = |number, force_n| -> Result<Vec<u16>> {
        let load = Load::from_angles(force_n, 4.0, -3.0)?.with_offset_mm([1.5, -2.25])?;
        Ok(scene.render_load(&load, number)?.words().into_owned())
    };
    let (before, pixels) = (vec![frame(1, 0.096)?, frame(2, 0.098)?], frame(3, 0.1)?);
    let work = Work::Frame {
        special,
        before,
        pixels,
    };
    measured(special, work, model, "force: Some")
}

/// A frame whose eight dots moved by this, mm, in which one contact has not explained the frames
/// before. Two were looked for at once in those.
fn pressed_by_two(special: &'static str, result: &str, moved_mm: [[f64; 3]; 8]) -> Result<Case> {
    let scene = scene("rest", PixelFormat::Rgb565)?;
    let scene = scene.clone().with_options(Options {
        layout: "8v".parse()?,
        moved_mm: Some(Dots::of(moved_mm)),
        ..scene.options().clone()
    })?;
    let work = Work::Frame {
        special,
        before: vec![frame(&scene, 1, 1.0), frame(&scene, 2, 1.0)],
        pixels: frame(&scene, 3, 1.0),
    };
    measured(special, work, models::eight_dots(), result)
}

/// A case whose three frames have this result.
fn measured(special: &'static str, work: Work, model: Vec<u8>, result: &str) -> Result<Case> {
    let case = Case {
        work,
        model,
        format: PixelFormat::Rgb565,
    };
    let results = qemu::run_on_host(&case.script())?;
    let count = results.matches(result).count();
    ensure!(count == 3, "{special}: {count} of 3 frames have {result:?}");
    Ok(case)
}

/// Steps at a press of 0.1 N off the middle.
fn stepping(steps: u8) -> Result<Case> {
    let format = PixelFormat::Rgb565;
    let model = models::anywhere(steps);
    let rest = Model::parse(&model)
        .map_err(|error| anyhow!("{error}"))?
        .rest;
    let load = Load::from_angles(0.1, 4.0, -3.0)?.with_offset_mm([1.5, -2.25])?;
    let pressed = scene("rest", format)?.render_load(&load, 1)?;
    let markers = seen(format, RednessWeighted, &pressed.words())?.1;
    Ok(Case {
        work: Work::Steps(steps, markers, Box::new(rest)),
        model,
        format,
    })
}

/// Rust source that includes what a board can hold, and the files that it includes.
#[derive(Default)]
struct Board {
    /// The files, each once, and the names of their statics.
    files: BTreeMap<Vec<u8>, String>,
    statics: String,
    frames: String,
    networks: String,
}

impl Board {
    fn add(&mut self, folder: &Path, case: &Case) -> Result<()> {
        match &case.work {
            Work::Steps(..) | Work::Table => {}
            // The board's program measures single frames of RGB565.
            Work::Frame { before, .. } if !before.is_empty() => {}
            Work::Frame { .. } if case.format != PixelFormat::Rgb565 => {}
            Work::Frame {
                special, pixels, ..
            } => {
                let swapped: Vec<u8> = pixels.iter().flat_map(|it| it.to_be_bytes()).collect();
                let pixels = self.file(folder, &swapped)?;
                let model = self.file(folder, &case.model)?;
                self.frames += &format!(
                    "Frame {{ size: {SIZE:?}, special: {special:?}, pixels: &{pixels}.0, model: \
                     &{model}.0 }},\n"
                );
            }
            Work::Network => {
                let (name, model) = (network_name(), self.file(folder, &case.model)?);
                self.networks += &format!("Network {{ name: {name:?}, model: &{model}.0 }},\n");
            }
        }
        Ok(())
    }

    /// Writes a file, if it is new; returns the name of the static that includes it.
    fn file(&mut self, folder: &Path, bytes: &[u8]) -> Result<String> {
        if let Some(name) = self.files.get(bytes) {
            return Ok(name.clone());
        }
        let number = self.files.len();
        let (file, name) = (
            folder.join(format!("{number}.board")),
            format!("FILE_{number}"),
        );
        write(&file, bytes)?;
        // The first bank has the code.
        self.statics += &format!(
            "#[unsafe(link_section = \".bank2\")]\nstatic {name}: AlignedFile<[u8; include_bytes!({file:?}).len()]> = \
             AlignedFile(*include_bytes!({file:?}));\n"
        );
        self.files.insert(bytes.to_vec(), name.clone());
        Ok(name)
    }

    fn source(&self) -> String {
        let Board {
            statics,
            frames,
            networks,
            ..
        } = self;
        format!(
            "{statics}\n/// What is measured.\npub static FRAMES: &[Frame] = &[\n{frames}];\n\n\
             /// What is measured by itself.\npub static NETWORKS: &[Network] = &[\n{networks}];\n"
        )
    }
}

/// Worst cases in addition to the usual frame.
fn strained(usual: &[u16]) -> [(&'static str, Vec<u16>); 4] {
    let [width, height] = SIZE;
    [
        ("5 % salt", pictures::salted(usual.to_vec(), 5, 1)),
        ("checkerboard", pictures::checkerboard(width, height)),
        (
            "2,000 specks",
            pictures::specked(usual.to_vec(), width, 2_000, 1),
        ),
        ("black", pictures::plain(width, height, pictures::BLACK)),
    ]
}

/// The simulated sensor with its usual light and noise under 0.1 N at α = 4°, β = −3°: its first
/// frame that goes all the way to a force, so that all of it is measured.
fn usual_frame(model: &[u8], format: PixelFormat) -> Result<Vec<u16>> {
    let scene = scene("static", format)?;
    for number in 0..ATTEMPTS {
        let pixels = frame(&scene, number, 1.0);
        let mut script = Script::new();
        script
            .model(model)
            .threshold(Threshold::red(format), ByteOrder::Native)
            .sense(SIZE[0], &[&pixels]);
        if qemu::run_on_host(&script)?.contains("force: Some") {
            return Ok(pixels);
        }
    }
    bail!("none of {ATTEMPTS} frames has a force")
}

fn scene(name: &str, format: PixelFormat) -> Result<Scene> {
    let [width, height] = SIZE.map(u32::from);
    let scene = Scene::preset(name, Preset::Ov7725, width, height, 1)?;
    let format: Format = format.name().parse()?;
    Ok(scene.with_options(Options {
        format,
        ..Options::default()
    })?)
}

/// A frame as it lies in memory.
fn frame(scene: &Scene, number: u64, seconds: f64) -> Vec<u16> {
    scene.frame(number, seconds).words().into_owned()
}

/// The small model.
fn model(format: PixelFormat, centroid: CentroidEstimator) -> Result<Vec<u8>> {
    let pixels = frame(&scene("rest", format)?, 0, 0.0);
    let rest = position(format, centroid, &pixels)?;
    let rest = (centroid, rest);
    Ok(models::file_for(geometry(), format, rest, &SMALL))
}

fn geometry() -> Geometry {
    Geometry::preset(Preset::Ov7725, SIZE[0], SIZE[1])
}

/// Where a frame shows the markers.
fn position(format: PixelFormat, centroid: CentroidEstimator, pixels: &[u16]) -> Result<Rest> {
    let (features, markers) = seen(format, centroid, pixels)?;
    Ok(Rest {
        features,
        areas: markers.map(|marker| marker.area).into(),
    })
}

/// Measures a frame.
fn seen(
    format: PixelFormat,
    centroid: CentroidEstimator,
    pixels: &[u16],
) -> Result<(Features, [Marker; 4])> {
    let mut sensor = Box::new(Sensor::<64>::new());
    let settings = Settings {
        threshold: Threshold::red(format),
        centroid,
        ..Settings::usual(geometry(), ByteOrder::Native)
    };
    sensor.configure(settings, None)?;
    let measurement = sensor.measure_frame(pixels);
    let markers = measurement.markers.and_then(|markers| markers.exactly());
    let found = measurement.features.zip(markers);
    found.context("a frame that shows where the markers are has none")
}

fn write(file: &Path, bytes: &[u8]) -> Result<()> {
    fs::write(file, bytes).with_context(|| format!("writing {}", file.display()))
}
