//! The arguments that say what is simulated.

use clap::{Args, ValueEnum};
use hivtac_host::failure::Failure;
use hivtac_host::live::calibrated::Calibrated;
use hivtac_host::live::camera::Kind;
use hivtac_host::live::course::Course;
use hivtac_host::live::device::Device;
use hivtac_host::live::eye::{Disturbances, Eye, Presses};
use hivtac_host::live::hand::Hand;
use hivtac_host::live::run::device_id;
use hivtac_host::model_file;
use hivtac_twin::units;
use hivtac_twin::{Layout, Scene};
use std::ops::RangeInclusive;

/// The simulated sensor.
#[derive(Args, Default, PartialEq)]
pub struct Simulated {
    /// What presses the film: rest, static, demo, sweep, press, drag, grasp, catch, vibration; or a
    /// scene file (FILE.toml, docs/scene-file.md)
    #[arg(long, value_name = "NAME")]
    scene: Option<String>,
    /// Forces from a CSV file of `monitor --csv` in place of the scene's, again and again; two
    /// contacts with --layout 8v
    #[arg(long, value_name = "FILE")]
    course: Option<String>,
    /// The camera, and with it the rate: ov7725 with 156 frames a second when not given, ov5640
    /// with 119, or mt9v034 with 232
    #[arg(long, value_enum)]
    camera: Option<CameraName>,
    /// The dots on the film of a scene by name, and the model for them: 4 when not given, or 8v
    #[arg(long, value_name = "NAME", value_parser = layout)]
    layout: Option<Layout>,
    /// Unit N of those that are drawn as people build them, 1 to 1000000, or a calibrated one, by
    /// the file of its model; without it the nominal one, that of the built-in model
    #[arg(long, value_name = "N|FILE", value_parser = unit)]
    unit: Option<Unit>,
    /// Decides the noise, and where the demo starts, of a scene by name; 1 when not given
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// A reflection cuts a part off a marker
    #[arg(long)]
    glare: bool,
    /// Brightness of the light once exposure was found, 0.05 to 2; 1 is as it was then
    #[arg(long, value_name = "PART", value_parser = within(0.05..=2.0))]
    dim: Option<f64>,
    /// The camera's picture shifts along x by this many pixels a minute, -10 to 10
    #[arg(
        long,
        value_name = "PX",
        value_parser = within(-10.0..=10.0),
        allow_negative_numbers = true
    )]
    drift: Option<f64>,
}

/// Which unit is simulated.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Unit {
    Drawn(u64),
    /// The file of a calibrated unit's model.
    Calibrated(String),
}

/// A camera's name on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum CameraName {
    #[default]
    Ov7725,
    Ov5640,
    Mt9v034,
}

/// The press when the arguments name none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Before {
    /// The demo's wandering tip.
    Demo,
    /// Nothing.
    Rest,
}

impl Simulated {
    /// Makes the device and its camera's view.
    ///
    /// # Errors
    /// When the scene or a file cannot be used.
    pub fn build(&self, before: Before, hand: Hand) -> Result<(Device, Eye), Failure> {
        let kind = match self.camera.unwrap_or_default() {
            CameraName::Ov7725 => Kind::Ov7725,
            CameraName::Ov5640 => Kind::Ov5640,
            CameraName::Mt9v034 => Kind::Mt9v034,
        };
        let name = self.scene.as_deref().unwrap_or(match before {
            Before::Demo => "demo",
            Before::Rest => "rest",
        });
        let calibrated = match &self.unit {
            Some(Unit::Calibrated(path)) => Some(self.calibrated(path, kind)?),
            _ => None,
        };
        let layout = calibrated.as_ref().map(|unit| unit.layout);
        let (scene, film) = match (&calibrated, self.scene(name, kind, layout)?) {
            (None, scene) => (self.as_unit(name, scene)?, None),
            (Some(unit), scene) => {
                let seen = unit.seen(scene).map_err(|error| refused(name, error))?;
                (seen.0, Some(seen.1))
            }
        };
        let presses = match self.course.as_deref() {
            Some(path) => Presses::Course(course(path)?),
            None => Presses::Scene,
        };
        let disturbances = Disturbances {
            glare: self.glare,
            dim: self.dim.unwrap_or(1.0),
            drift_px: self.drift.unwrap_or(0.0),
        };
        let layout = scene.options().layout;
        if kind == Kind::Mt9v034 && layout != Layout::default() {
            return Err(refused(
                name,
                "the camera mt9v034 has no model of other dots",
            ));
        }
        let eye = Eye::new(kind, scene, presses, disturbances, hand);
        let mut eye = eye.map_err(|error| refused(name, error))?;
        eye = match film {
            Some(film) => eye.with_film(film),
            None => eye,
        };
        // Exposure is found in the light as it is before it dims.
        let device = match (calibrated, &self.unit) {
            (Some(unit), _) => Device::with_model(kind, unit.file, unit.device_id, 1.0),
            (None, Some(Unit::Drawn(unit))) => {
                Device::new(kind, layout, device_id(kind, *unit), 1.0)
            }
            (None, _) => Device::new(kind, layout, device_id(kind, units::NOMINAL), 1.0),
        };
        Ok((device, eye))
    }

    /// Reads a calibrated unit's model, which is kept until the program ends.
    fn calibrated(&self, path: &str, kind: Kind) -> Result<Calibrated, Failure> {
        let refused = |why: String| Failure::input(format!("unit {path}: {why}"));
        if self.layout.is_some() {
            return Err(refused(
                "its model says which dots it has: leave --layout out".to_owned(),
            ));
        }
        let (file, _) = model_file::read(path)?;
        Calibrated::of(kind, file.leak()).map_err(refused)
    }

    fn scene(&self, name: &str, kind: Kind, layout: Option<Layout>) -> Result<Scene, Failure> {
        if self.layout.is_some() && name.ends_with(".toml") {
            let why = "the file says which dots it has: leave --layout out";
            return Err(refused(name, why));
        }
        if name.ends_with(".toml") {
            let text = read(name)?;
            return Scene::from_toml(&text).map_err(|error| refused(name, error));
        }
        let layout = layout.or(self.layout).unwrap_or_default();
        kind.scene(name, layout, self.seed.unwrap_or(1))
            .map_err(|error| {
                Failure::input(format!(
                    "{error}; or a scene file, whose name ends with .toml"
                ))
            })
    }

    fn as_unit(&self, name: &str, scene: Scene) -> Result<Scene, Failure> {
        match self.unit {
            Some(Unit::Drawn(unit)) => {
                units::as_unit(unit, scene).map_err(|error| refused(name, error))
            }
            _ => Ok(scene),
        }
    }
}

/// Reads a unit's number, or the name of a file.
fn unit(text: &str) -> Result<Unit, String> {
    match text.parse() {
        Ok(number) if units::DRAWN.contains(&number) => Ok(Unit::Drawn(number)),
        Ok(_) => Err("a unit's number is from 1 to 1000000".to_owned()),
        Err(_) => Ok(Unit::Calibrated(text.to_owned())),
    }
}

/// Reads a layout's name.
fn layout(name: &str) -> Result<Layout, String> {
    name.parse::<Layout>().map_err(|error| error.to_string())
}

fn course(path: &str) -> Result<Course, Failure> {
    Course::parse(&read(path)?).map_err(|error| Failure::of_file(path, error))
}

fn read(path: &str) -> Result<String, Failure> {
    std::fs::read_to_string(path).map_err(|error| Failure::of_file(path, error))
}

fn refused(scene: &str, error: impl std::fmt::Display) -> Failure {
    Failure::input(format!("scene {scene}: {error}"))
}

/// Reads a number within a range.
fn within(
    range: RangeInclusive<f64>,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text: &str| match text.parse::<f64>() {
        Ok(value) if range.contains(&value) => Ok(value),
        _ => Err(format!(
            "a number from {} to {} is needed",
            range.start(),
            range.end()
        )),
    }
}
