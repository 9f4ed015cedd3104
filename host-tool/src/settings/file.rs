//! Settings as JSON, which `export` writes and `import` reads.

use super::camera::{CameraJson, InUse};
use super::name::name;
use super::temporal::TemporalJson;
use hivtac_host::failure::Failure;
use hivtac_host::files::read_at_most;
use hivtac_host::shown::{to_json, unit_number};
use hivtac_terms::camera::CameraSettings;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::{Direction, Down};
use hivtac_terms::fixed::Q;
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::temporal::TemporalSettings;
use hivtac_terms::threshold::{HsvBox, Mono, PixelFormat, Threshold, Yuv422};
use hivtac_terms::units::{Micrometres, MilliPx, Px};
use hivtac_wire::settings::{Found, RestPosition, Selection, SettingsReport};
use serde::{Deserialize, Serialize};

/// Version of the files' layout.
const VERSION: u32 = 1;
/// Most bytes of a file.
const LONGEST_FILE: u64 = 64 << 10;

/// The settings of a device.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    hivtac_settings: u32,
    /// The unit's number; its rest position is not valid for other units.
    pub device_id: String,
    /// The name; empty if it has none.
    pub name: String,
    threshold: Limits,
    /// The rest position, if one was taken.
    pub tare: Option<Rest>,
    temporal: TemporalJson,
    camera: CameraJson,
    #[serde(default)]
    down: DownJson,
    #[serde(default)]
    contact_shape: ContactShapeJson,
}

/// The direction of gravity, if known, in thousandths of a unit vector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum DownJson {
    #[default]
    Fixed,
    Unknown,
    Told([i16; 3]),
}

/// The shape of what presses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum ContactShapeJson {
    Needle,
    Round {
        radius_um: u32,
    },
    Flat {
        radius_um: u32,
    },
    #[default]
    Unknown,
}

/// A threshold, as in all JSON of the tool.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "format", rename_all = "lowercase", deny_unknown_fields)]
enum Limits {
    Rgb565 {
        hue_low: u8,
        hue_high: u8,
        saturation_low: u8,
        saturation_high: u8,
        value_low: u8,
        value_high: u8,
    },
    Yuv422 {
        cr_low: u8,
    },
    Mono {
        luma_low: u8,
        luma_high: u8,
    },
}

/// A rest position: coordinates in 1/65,536 px, areas in px.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rest {
    format: PixelFormat,
    dilations: u8,
    centroid: CentroidEstimator,
    markers: Vec<Seen>,
    rect_center_q16: [Px; 2],
    rect_area_q16: Q<16, i64>,
    /// The direction of gravity at that time, in thousandths.
    #[serde(default)]
    down: Option<[i16; 3]>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Seen {
    x_q16: Px,
    y_q16: Px,
    area_px: u32,
}

impl Seen {
    fn of(marker: &Marker) -> Seen {
        Seen {
            x_q16: marker.x,
            y_q16: marker.y,
            area_px: marker.area,
        }
    }

    fn marker(&self) -> Marker {
        Marker {
            x: self.x_q16,
            y: self.y_q16,
            area: self.area_px,
        }
    }
}

/// The settings in use, and which of them are kept: `settings get --json`.
#[derive(Serialize)]
pub struct Kept {
    #[serde(flatten)]
    file: File,
    /// Distance in px.
    rezeroed_px: f64,
    /// Distance in px.
    seen_px: Option<f64>,
    kept: Selection,
    found: &'static str,
    erases: u32,
    failures: u32,
    camera_in_use: InUse,
    drift_q16: Option<Px>,
}

impl Kept {
    /// From a device's report.
    pub fn new(device_id: &[u8; 12], report: &SettingsReport) -> Kept {
        Kept {
            file: File::new(device_id, report),
            rezeroed_px: report.rezeroed.to_f64(),
            seen_px: report.seen.map(MilliPx::to_f64),
            kept: report.kept,
            found: match report.found {
                Found::Nothing => "nothing",
                Found::Settings => "settings",
                Found::AnotherVersion => "another-version",
            },
            erases: report.erases,
            failures: report.failures,
            camera_in_use: InUse::new(&report.camera),
            drift_q16: report.drift,
        }
    }
}

impl File {
    /// From a device's report.
    pub fn new(device_id: &[u8; 12], report: &SettingsReport) -> File {
        File {
            hivtac_settings: VERSION,
            device_id: unit_number(device_id),
            name: report.name.as_str().to_owned(),
            threshold: limits(&report.threshold),
            tare: report.tare.as_ref().map(Rest::of),
            temporal: TemporalJson::new(&report.temporal),
            camera: CameraJson::new(&report.camera.settings),
            down: match report.down {
                Down::Fixed => DownJson::Fixed,
                Down::Unknown => DownJson::Unknown,
                Down::Told(Direction(parts)) => DownJson::Told(parts),
            },
            contact_shape: ContactShapeJson::new(report.contact_shape),
        }
    }

    /// Whether the file was made from this device.
    pub fn is_of(&self, device_id: &[u8; 12]) -> bool {
        self.device_id == unit_number(device_id)
    }

    /// The threshold.
    pub fn threshold(&self) -> Threshold {
        match self.threshold {
            Limits::Rgb565 {
                hue_low,
                hue_high,
                saturation_low,
                saturation_high,
                value_low,
                value_high,
            } => Threshold::Rgb565(HsvBox {
                hue_low,
                hue_high,
                saturation_low,
                saturation_high,
                value_low,
                value_high,
            }),
            Limits::Yuv422 { cr_low } => Threshold::Yuv422(Yuv422 { cr_low }),
            Limits::Mono {
                luma_low,
                luma_high,
            } => Threshold::Mono(Mono {
                low: luma_low,
                high: luma_high,
            }),
        }
    }

    /// How forces are followed from frame to frame.
    pub fn temporal(&self) -> TemporalSettings {
        self.temporal.settings()
    }

    /// The camera's settings.
    pub fn camera(&self) -> CameraSettings {
        self.camera.settings()
    }

    /// The direction of gravity, if known.
    pub fn down(&self) -> Down {
        match self.down {
            DownJson::Fixed => Down::Fixed,
            DownJson::Unknown => Down::Unknown,
            DownJson::Told(parts) => Down::Told(Direction(parts)),
        }
    }

    /// The shape of what presses.
    pub fn contact_shape(&self) -> ContactShape {
        self.contact_shape.shape()
    }

    /// The rest position.
    pub fn rest(&self) -> Option<RestPosition> {
        self.tare.as_ref().map(Rest::position)
    }
}

impl ContactShapeJson {
    fn new(shape: ContactShape) -> ContactShapeJson {
        match shape {
            ContactShape::Needle => ContactShapeJson::Needle,
            ContactShape::Round(Micrometres(radius_um)) => ContactShapeJson::Round { radius_um },
            ContactShape::Flat(Micrometres(radius_um)) => ContactShapeJson::Flat { radius_um },
            ContactShape::Unknown => ContactShapeJson::Unknown,
        }
    }

    fn shape(self) -> ContactShape {
        match self {
            ContactShapeJson::Needle => ContactShape::Needle,
            ContactShapeJson::Round { radius_um } => ContactShape::Round(Micrometres(radius_um)),
            ContactShapeJson::Flat { radius_um } => ContactShape::Flat(Micrometres(radius_um)),
            ContactShapeJson::Unknown => ContactShape::Unknown,
        }
    }
}

fn limits(threshold: &Threshold) -> Limits {
    match *threshold {
        Threshold::Rgb565(HsvBox {
            hue_low,
            hue_high,
            saturation_low,
            saturation_high,
            value_low,
            value_high,
        }) => Limits::Rgb565 {
            hue_low,
            hue_high,
            saturation_low,
            saturation_high,
            value_low,
            value_high,
        },
        Threshold::Yuv422(Yuv422 { cr_low }) => Limits::Yuv422 { cr_low },
        Threshold::Mono(Mono { low, high }) => Limits::Mono {
            luma_low: low,
            luma_high: high,
        },
    }
}

impl Rest {
    fn of(position: &RestPosition) -> Rest {
        Rest {
            format: position.format,
            dilations: position.dilations,
            centroid: position.centroid,
            markers: position.markers.iter().map(Seen::of).collect(),
            rect_center_q16: position.rect_center.into(),
            rect_area_q16: position.rect_area,
            down: position.down.map(|Direction(parts)| parts),
        }
    }

    fn position(&self) -> RestPosition {
        RestPosition {
            format: self.format,
            dilations: self.dilations,
            centroid: self.centroid,
            markers: MarkerList::of(self.markers.iter().map(Seen::marker)),
            rect_center: self.rect_center_q16.into(),
            rect_area: self.rect_area_q16,
            down: self.down.map(Direction),
        }
    }
}

/// Reads a file of settings.
///
/// # Errors
/// What is wrong with it, and where.
pub fn read(path: &str) -> Result<File, Failure> {
    let bytes = read_at_most(path, LONGEST_FILE).map_err(|error| Failure::of_file(path, error))?;
    let bytes = bytes.ok_or_else(|| Failure::of_file(path, "too long for a file of settings"))?;
    parse(&bytes).map_err(|why| Failure::of_file(path, why))
}

fn parse(bytes: &[u8]) -> Result<File, String> {
    let file: File = serde_json::from_slice(bytes)
        .map_err(|error| format!("no settings of `hivtac settings export`: {error}"))?;
    if file.hivtac_settings != VERSION {
        return Err(format!(
            "settings of version {}; this hivtac reads version {VERSION}",
            file.hivtac_settings
        ));
    }
    if !file.name.is_empty() {
        name(&file.name).map_err(|why| format!("the name is refused: {why}"))?;
    }
    let threshold = file.threshold();
    threshold
        .check()
        .map_err(|error| format!("the threshold means nothing: {error}"))?;
    file.temporal()
        .check()
        .map_err(|error| format!("a limit is out of range: {error}"))?;
    let taken = file.tare.as_ref().and_then(|rest| rest.down).map(Direction);
    if !taken
        .into_iter()
        .chain(file.down().direction())
        .all(Direction::is_sound)
    {
        return Err("down is no direction: its length is not 1000 thousandths".to_owned());
    }
    if !file.contact_shape().is_sound() {
        return Err("contact_shape has a radius that is not 250 to 4000 µm".to_owned());
    }
    Ok(file)
}

/// Writes a file of settings.
///
/// # Errors
/// When it cannot be written.
pub fn write(path: &str, file: &File) -> Result<(), Failure> {
    let text = to_json(file) + "\n";
    std::fs::write(path, text).map_err(|error| Failure::of_file(path, error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::camera::{CameraLimits, Rate, RateLimits};
    use hivtac_terms::units::{Microseconds, Sixteenths};
    use hivtac_wire::settings::CameraReport;

    fn camera() -> CameraReport {
        let limits = RateLimits::new(156, [24, 6_405].map(Microseconds));
        CameraReport {
            settings: CameraSettings {
                exposure: Some(Microseconds(2_500)),
                gain: None,
                rate: Rate::Quarter,
                white: None,
            },
            exposure: Microseconds(2_512),
            gain: Sixteenths(16),
            limits: CameraLimits([limits; 3]),
        }
    }

    fn report(threshold: Threshold) -> SettingsReport {
        let marker = |nth: i32| Marker {
            x: Px(nth * 70_001),
            y: Px(-nth),
            area: 190,
        };
        SettingsReport {
            name: "thumb".try_into().unwrap(),
            threshold,
            tare: Some(RestPosition {
                format: threshold.format(),
                dilations: 1,
                centroid: CentroidEstimator::RednessWeighted,
                markers: [0, 1, 2, 3].map(marker).into(),
                rect_center: (Px(7), Px(8)),
                rect_area: Q::from_bits(1 << 40),
                down: Some(Direction([0, 0, -1000])),
            }),
            kept: Selection::ALL,
            found: Found::Settings,
            erases: 1,
            failures: 0,
            temporal: TemporalSettings::default(),
            rezeroed: Px(0),
            seen: None,
            drift: None,
            camera: camera(),
            down: Down::Told(Direction([0, 600, -800])),
            contact_shape: ContactShape::Flat(Micrometres(2_000)),
        }
    }

    #[test]
    fn settings_come_back_from_their_file() {
        for threshold in [
            Threshold::Rgb565(HsvBox::of_limits([170, 10, 100, 255, 45, 255])),
            Threshold::Yuv422(Yuv422 { cr_low: 162 }),
            Threshold::Mono(Mono { low: 0, high: 88 }),
        ] {
            let report = report(threshold);
            let file = File::new(&[7; 12], &report);
            let read = parse(to_json(&file).as_bytes()).unwrap();
            assert_eq!(read, file);
            assert_eq!((read.threshold(), read.rest()), (threshold, report.tare));
            assert_eq!(read.camera(), report.camera.settings);
            assert_eq!(read.down(), report.down);
            assert_eq!(read.contact_shape(), report.contact_shape);
            assert!(read.is_of(&[7; 12]) && !read.is_of(&[8; 12]));
        }
    }

    #[test]
    fn every_shape_comes_back_and_an_old_file_has_none() {
        let radius = Micrometres(1_500);
        for contact_shape in [
            ContactShape::Needle,
            ContactShape::Round(radius),
            ContactShape::Flat(radius),
            ContactShape::Unknown,
        ] {
            let report = SettingsReport {
                contact_shape,
                ..report(Threshold::Mono(Mono { low: 0, high: 88 }))
            };
            let text = to_json(&File::new(&[7; 12], &report));
            assert_eq!(
                parse(text.as_bytes()).unwrap().contact_shape(),
                contact_shape
            );
            let old = text.replace(",\"contact_shape\":\"unknown\"", "");
            assert_eq!(
                parse(old.as_bytes()).unwrap().contact_shape(),
                contact_shape
            );
        }
    }

    #[test]
    fn a_file_that_is_none_says_why() {
        let good = to_json(&File::new(
            &[7; 12],
            &report(Threshold::Rgb565(HsvBox::of_limits([
                170, 10, 100, 255, 45, 255,
            ]))),
        ));
        for (from, to, word) in [
            (
                "\"hivtac_settings\":1",
                "\"hivtac_settings\":2",
                "version 2",
            ),
            ("\"thumb\"", "\"th\\u001bumb\"", "cannot be seen"),
            ("\"hue_low\":170", "\"hue_low\":200", "means nothing"),
            ("[0,600,-800]", "[0,600,-80]", "no direction"),
            ("\"radius_um\":2000", "\"radius_um\":200", "250 to 4000"),
            ("\"hue_low\"", "\"huelow\"", "huelow"),
            ("\"within_ms\":50", "\"within_ms\":5", "10 to 100 ms"),
            ("rgb565", "rgb888", "rgb888"),
            ("{", "[", "no settings"),
        ] {
            let bad = good.replace(from, to);
            assert_ne!(bad, good);
            let error = parse(bad.as_bytes()).unwrap_err();
            assert!(error.contains(word), "{word}: {error}");
        }
    }
}
