//! `hivtac sense`: runs the sensor's own code on pictures, and shows each intermediate result.

use crate::finding::Finding;
use crate::hsv;
use crate::output::{Reader, note, print};
use clap::Args;
use hivtac_host::contact_shape;
use hivtac_host::failure::Failure;
use hivtac_host::files::read_at_most;
use hivtac_host::one_picture::{Sensor, measure, settings};
use hivtac_host::picture::Picture;
use hivtac_host::stop;
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::tare::{Refusal, TareBuilder};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::{HsvBox, PixelFormat};
use std::ops::Range;

/// The model that is built into the firmware.
static MODEL: &[u8] = include_bytes!("../../calibration/models/default.hvtm");

/// Most bytes of a model file; the sensor's flash has 2 MiB.
const LARGEST_MODEL: u64 = 16 << 20;

/// Look for markers and force in pictures, with the sensor's own code
///
/// PNG, JPEG, BMP, PPM, or a raw frame of `hivtac snapshot`, up to 800 × 800 px. Eight bits a
/// channel are rounded to RGB565, which is what the sensor's camera delivers; with a mono
/// camera's model, their luma is taken. There is a force
/// only when size, preset and threshold are those of the model; the status says so otherwise,
/// and blobs, markers and features are there all the same.
///
/// Example: hivtac sense photo.jpg
#[derive(Args)]
pub struct SenseArguments {
    /// Pictures
    #[arg(required = true, value_name = "IMAGE")]
    images: Vec<String>,
    /// Lens and pixels; the model's when not given. Other sizes than the preset's scale its focal
    /// length
    #[arg(long, value_name = "paper|ov7725")]
    preset: Option<Preset>,
    /// Colours of a marker, as in `hivtac threshold --hsv`; the model's when not given
    #[arg(long, value_name = "h0,h1,s0,s1,v0,v1", value_parser = hsv::parse)]
    threshold: Option<HsvBox>,
    /// Smallest blob, px; a quarter of a marker at rest when not given
    #[arg(long, value_name = "PX")]
    min_area: Option<u32>,
    /// Model file; the firmware's own when not given
    #[arg(long, value_name = "FILE")]
    model: Option<String>,
    /// Columns and rows to search, in all pictures; the rest counts as empty
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", value_parser = region)]
    region: Option<Region>,
    /// Picture of the same size, white where to search and black elsewhere
    #[arg(long, value_name = "IMAGE")]
    mask: Option<String>,
    /// Picture of the untouched film, to measure displacements from
    #[arg(long, value_name = "IMAGE")]
    tare: Option<String>,
    /// The contact's shape, as in `hivtac settings set contact`
    #[arg(long, value_name = "SHAPE", default_value = "unknown",
          value_parser = contact_shape::parse)]
    contact: ContactShape,
    /// One JSON object a line
    #[arg(long)]
    json: bool,
}

/// Prints what is found in each picture. A picture that cannot be used is reported, and the others
/// are still processed.
pub fn run(arguments: &SenseArguments) -> Result<(), Failure> {
    let file = arguments.model.as_deref().map(read_model).transpose()?;
    let name = arguments.model.as_deref().unwrap_or("the built-in model");
    let model = Model::parse(file.as_deref().unwrap_or(MODEL))
        .map_err(|error| Failure::input(format!("{name} is no usable model: {error}")))?;
    let mask = arguments.mask.as_deref();
    let bench = Bench {
        arguments,
        mask: mask
            .map(|path| Picture::load(path, PixelFormat::Mono))
            .transpose()?,
        model,
        name,
    };
    let tare = arguments
        .tare
        .as_deref()
        .map(|path| bench.tare(path))
        .transpose()?;
    let mut bad = 0;
    for path in &arguments.images {
        match bench.look(path, tare.as_ref()) {
            Ok(text) => {
                if print(&text)? != Reader::There {
                    return stop::check();
                }
            }
            Err(failure) => {
                note(&format!("hivtac: {failure}"));
                bad += 1;
            }
        }
    }
    match bad {
        0 => Ok(()),
        _ => Err(Failure::input(format!(
            "{bad} of {} pictures could not be used",
            arguments.images.len()
        ))),
    }
}

fn read_model(path: &str) -> Result<Vec<u8>, Failure> {
    let cannot = |why: String| Failure::input(format!("cannot read the model {path}: {why}"));
    read_at_most(path, LARGEST_MODEL)
        .map_err(|error| cannot(error.to_string()))?
        .ok_or_else(|| {
            cannot(format!(
                "it has more than {LARGEST_MODEL} bytes, which no model has"
            ))
        })
}

/// A rest position and the size of the picture it comes from.
struct Tare {
    rest: Rest,
    size: (u16, u16),
}

/// Columns and rows of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Region {
    columns: Range<u32>,
    rows: Range<u32>,
}

impl Region {
    fn contains(&self, column: u16, row: u16) -> bool {
        self.columns.contains(&column.into()) && self.rows.contains(&row.into())
    }
}

fn region(text: &str) -> Result<Region, String> {
    let numbers: Result<Vec<u16>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let range = |from: u16, length: u16| from.into()..u32::from(from) + u32::from(length);
    match numbers.as_deref() {
        Ok(&[x, y, width @ (1..), height @ (1..)]) => Ok(Region {
            columns: range(x, width),
            rows: range(y, height),
        }),
        _ => Err("four whole numbers, such as 40,20,240,200: left, top, width, height, px".into()),
    }
}

/// The arguments and model that all pictures share.
struct Bench<'a> {
    arguments: &'a SenseArguments,
    mask: Option<Picture>,
    model: Model<'a>,
    /// The model's name, for messages.
    name: &'a str,
}

impl<'a> Bench<'a> {
    /// The result for one picture, as text or JSON.
    fn look(&self, path: &str, tare: Option<&Tare>) -> Result<String, Failure> {
        let picture = self.picture(path)?;
        let mut sensor = self.sensor(path, &picture)?;
        if let Some(tare) = tare {
            if tare.size != (picture.width, picture.height) {
                let (width, height) = tare.size;
                return Err(Failure::input(format!(
                    "the picture {path} has {} × {} px, but the tare's has {width} × {height} px; \
                     use pictures of one size",
                    picture.width, picture.height
                )));
            }
            sensor.set_tare(Some(tare.rest), Drift::UNSEEN);
        }
        let (blobs, mut measurement) = measure(&mut sensor, &picture.pixels);
        let brightness = picture.brightness();
        if let Some(two) = sensor.two_contacts(&measurement) {
            measurement.tell(&two);
        }
        let settings = sensor.settings();
        let dots = self.model.rest.areas.len();
        let finding = Finding::new(path, settings, &blobs, measurement, brightness, dots);
        Ok(if self.arguments.json {
            finding.json()
        } else {
            finding.text()
        })
    }

    /// Reads the visible part of a picture, in the format of the model's camera.
    fn picture(&self, path: &str) -> Result<Picture, Failure> {
        let mut picture = Picture::load(path, self.model.conditions.threshold.format())?;
        let size = [picture.width, picture.height];
        if let Some(region) = &self.arguments.region {
            let ends = [region.columns.end, region.rows.end];
            if ends
                .into_iter()
                .zip(size)
                .any(|(end, size)| end > size.into())
            {
                return Err(Failure::input(format!(
                    "--region goes beyond the picture {path} of {} × {} px",
                    size[0], size[1]
                )));
            }
            picture.hide(|x, y| region.contains(x, y));
        }
        if let Some(mask) = &self.mask {
            let mask_size = [mask.width, mask.height];
            if mask_size != size {
                return Err(Failure::input(format!(
                    "the mask has {} × {} px, and the picture {path} has {} × {}; use one size",
                    mask_size[0], mask_size[1], size[0], size[1]
                )));
            }
            picture.hide(|x, y| mask.level(x, y) >= 128);
        }
        Ok(picture)
    }

    /// Finds the rest position in a picture.
    fn tare(&self, path: &str) -> Result<Tare, Failure> {
        let picture = self.picture(path)?;
        let mut sensor = self.sensor(path, &picture)?;
        let measurement = sensor.measure_frame(&picture.pixels);
        let rest = TareBuilder::new(1)
            .and_then(|mut builder| sensor.tare_with(&mut builder, &measurement));
        match rest {
            Some(Ok(rest)) => Ok(Tare {
                rest,
                size: (picture.width, picture.height),
            }),
            Some(Err(refusal)) => Err(Failure::input(format!(
                "the tare picture {path} {}",
                complaint(refusal)
            ))),
            None => {
                let status: Vec<_> = measurement.status.names().collect();
                Err(Failure::input(format!(
                    "the tare picture {path} does not show all markers ({}); look at it with \
                     `hivtac sense {path}`",
                    status.join(" ")
                )))
            }
        }
    }

    /// A sensor set for this picture.
    fn sensor(&self, path: &str, picture: &Picture) -> Result<Box<Sensor<'a>>, Failure> {
        let (made_for, format) = (self.model.conditions.threshold.format(), picture.format);
        if format != made_for {
            return Err(Failure::input(format!(
                "{} is for frames of {}, and {path} is read as {}; choose a model for that with \
                 --model",
                self.name,
                made_for.name(),
                format.name()
            )));
        }
        let mut sensor: Box<Sensor> = Box::default();
        sensor
            .configure(self.settings(picture), Some(self.model))
            .map_err(|error| {
                Failure::input(format!("the picture {path} cannot be looked at: {error}"))
            })?;
        sensor.set_contact_shape(self.arguments.contact);
        Ok(sensor)
    }

    /// The conditions of a picture, changed by the arguments.
    fn settings(&self, picture: &Picture) -> Settings {
        let size = [picture.width, picture.height];
        let mut settings = settings(&self.model, self.arguments.preset, size);
        settings.threshold = match self.arguments.threshold {
            Some(hsv_box) => hsv_box.into(),
            None => settings.threshold,
        };
        settings.min_area = self.arguments.min_area.unwrap_or(settings.min_area);
        settings
    }
}

/// Why a tare's picture was refused, and the remedy.
fn complaint(refusal: Refusal) -> String {
    match refusal {
        Refusal::Touched(force) => {
            let millinewtons = f64::from(force.0) * 1e-3;
            return format!(
                "shows a film that looks touched, by {millinewtons:.1} mN, compared with the \
                 unit at its calibration, or with sensors as built: use a picture without a \
                 press, or calibrate anew"
            );
        }
        Refusal::MarkersImplausible | Refusal::Unsteady => {
            "does not show four whole, equal markers: one may be covered, cut, stained or glare; \
             use a picture of a clean film in even light"
        }
        Refusal::NotAtRest => {
            "does not show a film at rest: its markers are more than 15 % nearer to or farther \
             from their centre than the preset has them; use a picture without a press, or another \
             --preset"
        }
    }
    .to_owned()
}
