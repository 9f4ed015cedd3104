//! `benchmark-cases FOLDER`: writes the scripts that `cargo xtask bench` runs, one file each, and
//! prints what they are, one JSON object a line:
//! `{"work":…,"file":…,"size":[columns,rows],"format":…}`, where the work is `{"Frame":"…"}`, with
//! what is special about the frame, `{"Network":[widths]}`, `{"Steps":n}` or `"Table"`. What a
//! board can hold of them it writes as `board.rs`, too, for `firmware/examples/benchmark`.

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
use hivtac_twin::{Format, Load, Options, Preset, Scene};
use serde_json::{Value, json};

/// The model that the sensor runs.
const SMALL: [u16; 4] = [11, 64, 64, 3];
/// The paper's model.
const PAPER: [u16; 5] = [11, 512, 512, 512, 3];
/// Columns and rows of the reference frames.
const SIZES: [[u16; 2]; 4] = [[160, 120], [320, 240], [640, 480], [800, 600]];
/// How many frames may be without a force before one has one.
const ATTEMPTS: u64 = 16;
/// The sizes whose worst cases are measured: the firmware's and the paper's.
const STRAINED: [[u16; 2]; 2] = [[320, 240], [800, 600]];

/// Columns of the largest frames that fit a board's flash beside everything else.
const WIDEST_ON_BOARD: u16 = 320;
/// Most bytes of a network that fits there.
const LARGEST_ON_BOARD: usize = 200_000;

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
    /// Columns and rows.
    size: [u16; 2],
    format: PixelFormat,
}

enum Work {
    /// One frame through the whole pipeline, as the firmware runs it.
    Frame {
        /// What is special about it; empty for the usual one.
        special: &'static str,
        /// The frames before it, which tell what moves.
        before: Vec<Vec<u16>>,
        pixels: Vec<u16>,
    },
    /// One inference of a model with these layer widths.
    Network(&'static [u16]),
    /// The network of a model that tells places, and the number of steps from its answer.
    Steps(u8, [Marker; 4], Box<Rest>),
    /// The threshold's table of 64 KiB.
    Table,
}

impl Case {
    /// Writes the script, and describes the case.
    fn write(&self, folder: &Path, number: usize) -> Result<Value> {
        let file = folder.join(format!("{number}.script"));
        write(&file, self.script().bytes())?;
        let (work, size) = (self.work.description(), self.size);
        Ok(json!({ "work": work, "file": file, "size": size, "format": self.format.name() }))
    }

    fn script(&self) -> Script {
        let mut script = Script::new();
        script.model(&self.model);
        script.threshold(Threshold::red(self.format), ByteOrder::Swapped);
        match &self.work {
            Work::Frame { before, pixels, .. } => {
                let frames = before.iter().chain([pixels]).map(|frame| &frame[..]);
                script.sense(self.size[0], &frames.collect::<Vec<_>>())
            }
            Work::Table => {
                script.counted_threshold(Threshold::red(self.format), ByteOrder::Swapped)
            }
            Work::Steps(_, markers, rest) => script.press(markers, rest),
            Work::Network(_) => script.network(&models::rest(), &models::rest()),
        };
        script
    }
}

impl Work {
    fn description(&self) -> Value {
        match self {
            Work::Frame { special, .. } => json!({ "Frame": special }),
            Work::Network(widths) => json!({ "Network": widths }),
            Work::Steps(steps, ..) => json!({ "Steps": steps }),
            Work::Table => json!("Table"),
        }
    }
}

fn cases() -> Result<Vec<Case>> {
    let mut cases = Vec::new();
    for (format, size) in PixelFormat::ALL
        .into_iter()
        .flat_map(|format| SIZES.map(|size| (format, size)))
    {
        let [model, weighted_model] =
            [BinaryMask, RednessWeighted].map(|it| model(format, size, it));
        let model = model?;
        let usual = usual_frame(&model, format, &scene("static", format, size)?, size)?;
        let case = |(special, pixels)| Case {
            work: Work::Frame {
                special,
                before: Vec::new(),
                pixels,
            },
            model: model.clone(),
            size,
            format,
        };
        cases.push(case(("", usual.clone())));
        cases.push(Case {
            model: weighted_model?,
            ..case(("weighted", usual.clone()))
        });
        // What is special are colours, drawn in RGB565.
        if format == PixelFormat::Rgb565 && STRAINED.contains(&size) {
            cases.extend(strained(size, &usual).map(case));
        }
    }
    cases.push(pressed("one step", "4", models::anywhere(1))?);
    cases.push(pressed("eight dots", "8v", models::eight_dots())?);
    cases.extend([&SMALL[..], &PAPER].map(|widths| Case {
        work: Work::Network(widths),
        model: models::file(widths, Weights::Random, OutputKind::ForceVector, 1),
        size: [320, 240],
        format: PixelFormat::Rgb565,
    }));
    for steps in 1..=MOST_STEPS {
        cases.push(stepping(steps)?);
    }
    cases.push(Case {
        work: Work::Table,
        model: Vec::new(),
        // As many values as a pixel has.
        size: [256, 256],
        format: PixelFormat::Rgb565,
    });
    Ok(cases)
}

/// A frame of a press of 0.1 N off the middle that grows, with the model that measures it.
fn pressed(special: &'static str, layout: &str, model: Vec<u8>) -> Result<Case> {
    let (format, size) = (PixelFormat::Rgb565, [320, 240]);
    let scene = scene("rest", format, size)?;
    let scene = scene.clone().with_options(Options {
        layout: layout.parse()?,
        ..scene.options().clone()
    })?;
    let frame = |number, force_n| -> Result<Vec<u16>> {
        let load = Load::from_angles(force_n, 4.0, -3.0)?.with_offset_mm([1.5, -2.25])?;
        Ok(scene.render_load(&load, number)?.words().into_owned())
    };
    let (before, pixels) = (vec![frame(1, 0.096)?, frame(2, 0.098)?], frame(3, 0.1)?);
    let case = Case {
        work: Work::Frame {
            special,
            before,
            pixels,
        },
        model,
        size,
        format,
    };
    let results = qemu::run_on_host(&case.script())?;
    let forces = results.matches("force: Some").count();
    ensure!(forces == 3, "{special}: {forces} of 3 frames have a force");
    Ok(case)
}

/// Steps at a press of 0.1 N off the middle.
fn stepping(steps: u8) -> Result<Case> {
    let (format, size) = (PixelFormat::Rgb565, [320, 240]);
    let model = models::anywhere(steps);
    let rest = Model::parse(&model)
        .map_err(|error| anyhow!("{error}"))?
        .rest;
    let load = Load::from_angles(0.1, 4.0, -3.0)?.with_offset_mm([1.5, -2.25])?;
    let pressed = scene("rest", format, size)?.render_load(&load, 1)?;
    let geometry = Geometry::preset(Preset::Ov7725, size[0], size[1]);
    let markers = seen(geometry, format, RednessWeighted, &pressed.words())?.1;
    Ok(Case {
        work: Work::Steps(steps, markers, Box::new(rest)),
        model,
        size,
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
            Work::Frame { .. } if case.size[0] > WIDEST_ON_BOARD => {}
            Work::Frame { .. } if case.format != PixelFormat::Rgb565 => {}
            Work::Frame {
                special, pixels, ..
            } => {
                let swapped: Vec<u8> = pixels.iter().flat_map(|it| it.to_be_bytes()).collect();
                let (size, pixels) = (case.size, self.file(folder, &swapped)?);
                let model = self.file(folder, &case.model)?;
                self.frames += &format!(
                    "Frame {{ size: {size:?}, special: {special:?}, pixels: &{pixels}.0, model: \
                     &{model}.0 }},\n"
                );
            }
            Work::Network(_) if case.model.len() > LARGEST_ON_BOARD => {}
            Work::Network(widths) => {
                let widths: Vec<String> = widths.iter().map(u16::to_string).collect();
                let (name, model) = (widths.join("-"), self.file(folder, &case.model)?);
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

/// Worst cases beside the usual frame.
fn strained([width, height]: [u16; 2], usual: &[u16]) -> [(&'static str, Vec<u16>); 4] {
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
/// frame that goes all the way to a force, so that all of it is measured. In the smallest frames
/// noise can make a marker implausible.
fn usual_frame(
    model: &[u8],
    format: PixelFormat,
    scene: &Scene,
    [width, height]: [u16; 2],
) -> Result<Vec<u16>> {
    for number in 0..ATTEMPTS {
        let pixels = frame(scene, number, 1.0);
        let mut script = Script::new();
        script
            .model(model)
            .threshold(Threshold::red(format), ByteOrder::Native)
            .sense(width, &[&pixels]);
        if qemu::run_on_host(&script)?.contains("force: Some") {
            return Ok(pixels);
        }
    }
    bail!("none of {ATTEMPTS} frames of {width}x{height} has a force")
}

fn scene(name: &str, format: PixelFormat, [width, height]: [u16; 2]) -> Result<Scene> {
    let (width, height) = (u32::from(width), u32::from(height));
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

/// The small model, for frames of a size.
fn model(format: PixelFormat, size: [u16; 2], centroid: CentroidEstimator) -> Result<Vec<u8>> {
    let geometry = Geometry::preset(Preset::Ov7725, size[0], size[1]);
    let pixels = frame(&scene("rest", format, size)?, 0, 0.0);
    let rest = position(geometry, format, centroid, &pixels)?;
    Ok(models::file_for(geometry, format, (centroid, rest), &SMALL))
}

/// Where a frame shows the markers.
fn position(
    geometry: Geometry,
    format: PixelFormat,
    centroid: CentroidEstimator,
    pixels: &[u16],
) -> Result<Rest> {
    let (features, markers) = seen(geometry, format, centroid, pixels)?;
    Ok(Rest {
        features,
        areas: markers.map(|marker| marker.area).into(),
    })
}

/// What a frame shows.
fn seen(
    geometry: Geometry,
    format: PixelFormat,
    centroid: CentroidEstimator,
    pixels: &[u16],
) -> Result<(Features, [Marker; 4])> {
    let mut sensor = Box::new(Sensor::<64>::new());
    let settings = Settings {
        threshold: Threshold::red(format),
        centroid,
        ..Settings::usual(geometry, ByteOrder::Native)
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
