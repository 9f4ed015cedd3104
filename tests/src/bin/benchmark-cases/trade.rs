//! What the configurations of the trade between speed and accuracy cost (`docs/tradeoff.md`).
//!
//! A frame costs the same whatever model is behind it, and a model the same whatever frame is
//! before it: so the frames are written with the cheapest model, the models by themselves, the film
//! run forwards behind one of them, and some of all together, to check that.

use std::path::Path;

use anyhow::Result;
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::forward::MOST_STEPS;
use hivtac_sensor::force::rest::Rest;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold};
use hivtac_tests::models::{self, Weights};
use hivtac_tests::script::Script;
use hivtac_twin::Scene;
use serde_json::{Value, json};

use super::{SIZES, position, stepping, usual_frame, write};

const ESTIMATORS: [(&str, CentroidEstimator); 2] = [
    ("binary-mask", CentroidEstimator::BinaryMask),
    ("redness-weighted", CentroidEstimator::RednessWeighted),
];
/// The format of all of them.
const FORMAT: PixelFormat = PixelFormat::Rgb565;
/// The size whose models are measured.
const SIZE: [u16; 2] = [320, 240];

/// Hidden layers of the cheapest model, and its name: it is behind every frame.
const SMALLEST: [u16; 2] = [16; 2];
const BEHIND: &str = "16-16 int8";
/// The network of the committed model, whose answer steps begin from.
const BEFORE_STEPS: &str = "64-64 int8";

/// A model by its name.
struct Made {
    name: String,
    widths: Vec<u16>,
    weights: Weights,
}

/// Frames of one size under one estimator.
struct Frames {
    geometry: Geometry,
    centroid: (&'static str, CentroidEstimator),
    usual: Vec<u16>,
    rest: Rest,
}

/// Writes all cases and describes each in a line.
pub fn write_cases(folder: &Path) -> Result<()> {
    let mut number = 0..;
    let mut write_one = |script: &Script, what: Value| -> Result<()> {
        let file = folder.join(format!("trade-{}.script", number.next().unwrap_or(0)));
        write(&file, script.bytes())?;
        let mut line = what;
        line["file"] = json!(file);
        line["format"] = json!(FORMAT.name());
        println!("{line}");
        Ok(())
    };
    let models = made();
    for size in SIZES {
        for centroid in ESTIMATORS {
            let frames = Frames::of(size, centroid)?;
            let together = together(size, centroid.0);
            let with = |model: &&Made| [Some(BEHIND), together].contains(&Some(&model.name));
            for model in models.iter().filter(with) {
                let file = frames.model(model);
                write_one(&frames.script(&file), frames.part(&model.name, &file))?;
            }
            if size == SIZE && centroid == ESTIMATORS[1] {
                for model in &models {
                    let file = frames.model(model);
                    write_one(&frames.inference(&file)?, inference_part(model, &file))?;
                }
                for steps in [1, MOST_STEPS] {
                    let case = stepping(steps)?;
                    let part = json!({ "model": BEFORE_STEPS, "bytes": case.model.len() });
                    let what = case.work.description();
                    write_one(
                        &case.script(),
                        json!({ "work": what, "size": size, "part": part }),
                    )?;
                }
                let file = models::anywhere(1);
                let stepping = frames.part(&format!("{BEFORE_STEPS}, 1 step"), &file);
                write_one(&frames.script(&file), stepping)?;
            }
        }
    }
    Ok(())
}

/// Lens and camera: the sensor's, or the paper's for its size, which no supported camera has.
fn preset(size: [u16; 2]) -> Preset {
    match size {
        [800, 600] => Preset::Paper,
        _ => Preset::Ov7725,
    }
}

/// The model that is also measured behind such frames.
fn together(size: [u16; 2], centroid: &str) -> Option<&'static str> {
    match (size, centroid) {
        (SIZE, "redness-weighted") => Some("64-64 int8"),
        (SIZE, "binary-mask") => Some("64-64 int16"),
        ([800, 600], "redness-weighted") => Some("512-512-512 int8"),
        _ => None,
    }
}

fn made() -> Vec<Made> {
    let mut models = Vec::new();
    let hidden: [&[u16]; 5] = [
        &SMALLEST,
        &[32, 32],
        &[64, 64],
        &[128, 128],
        &[512, 512, 512],
    ];
    for hidden in hidden {
        for (width, weights) in [("int8", Weights::Random), ("int16", Weights::Wide)] {
            let names: Vec<String> = hidden.iter().map(u16::to_string).collect();
            models.push(Made {
                name: format!("{} {width}", names.join("-")),
                widths: [&[11], hidden, &[5]].concat(),
                weights,
            });
        }
    }
    models
}

impl Frames {
    fn of(size: [u16; 2], centroid: (&'static str, CentroidEstimator)) -> Result<Frames> {
        let preset = preset(size);
        let geometry = Geometry::preset(preset, size[0], size[1]);
        let (width, height) = (size[0].into(), size[1].into());
        let scene = |name: &str| Scene::preset(name, preset, width, height, 1);
        let rest = position(
            geometry,
            FORMAT,
            centroid.1,
            &scene("rest")?.frame(0, 0.0).pixels,
        )?;
        let conditions = (geometry, rest, centroid.1);
        let widths = [&[11][..], &SMALLEST, &[5]].concat();
        let model = models::trade_file(conditions, &widths, Weights::Random);
        Ok(Frames {
            geometry,
            centroid,
            usual: usual_frame(&model, FORMAT, &scene("static")?, size)?,
            rest,
        })
    }

    fn model(&self, made: &Made) -> Vec<u8> {
        let conditions = (self.geometry, self.rest, self.centroid.1);
        models::trade_file(conditions, &made.widths, made.weights)
    }

    fn script(&self, model: &[u8]) -> Script {
        let mut script = Script::new();
        script
            .model(model)
            .threshold(Threshold::red(FORMAT), ByteOrder::Swapped);
        script.sense(self.geometry.width, &[&self.usual]);
        script
    }

    /// The model alone, on what the usual frame shows.
    fn inference(&self, model: &[u8]) -> Result<Script> {
        let shown = position(self.geometry, FORMAT, self.centroid.1, &self.usual)?;
        let (features, tare): (Features, Features) = (shown.features, self.rest.features);
        let mut script = Script::new();
        script.model(model).network(&features, &tare);
        Ok(script)
    }

    fn part(&self, model: &str, file: &[u8]) -> Value {
        let size = [self.geometry.width, self.geometry.height];
        let centroid = self.centroid.0;
        let part = json!({ "centroid": centroid, "model": model, "bytes": file.len() });
        json!({ "work": { "Frame": "" }, "size": size, "part": part })
    }
}

fn inference_part(made: &Made, file: &[u8]) -> Value {
    let part = json!({ "model": made.name, "bytes": file.len() });
    json!({ "work": { "Network": made.widths }, "size": SIZE, "part": part })
}
