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
    /// The threshold.
    #[serde(with = "ThresholdJson")]
    pub threshold: Threshold,
    /// The rest position, if one was taken.
    #[serde(default, with = "optional_rest")]
    pub tare: Option<RestPosition>,
    /// How forces are followed from frame to frame.
    #[serde(with = "TemporalJson")]
    pub temporal: TemporalSettings,
    /// The camera's settings.
    #[serde(with = "CameraJson")]
    pub camera: CameraSettings,
    /// The direction of gravity, if known.
    #[serde(default, with = "DownJson")]
    pub down: Down,
    /// The contact's shape.
    #[serde(default, with = "ContactShapeJson")]
    pub contact_shape: ContactShape,
}

/// The direction of gravity, if known, in thousandths of a unit vector.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Down", rename_all = "lowercase")]
enum DownJson {
    Fixed,
    Unknown,
    Told(Direction),
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "ContactShape", rename_all = "lowercase")]
enum ContactShapeJson {
    Needle,
    Round(#[serde(with = "RadiusJson")] Micrometres),
    Flat(#[serde(with = "RadiusJson")] Micrometres),
    Unknown,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Micrometres", deny_unknown_fields)]
struct RadiusJson {
    #[serde(getter = "whole")]
    radius_um: u32,
}

fn whole(radius: &Micrometres) -> u32 {
    radius.0
}

impl From<RadiusJson> for Micrometres {
    fn from(json: RadiusJson) -> Micrometres {
        Micrometres(json.radius_um)
    }
}

/// A threshold, as in all JSON of the tool.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Threshold", tag = "format", rename_all = "lowercase")]
enum ThresholdJson {
    Rgb565(#[serde(with = "BoxJson")] HsvBox),
    Yuv422(#[serde(with = "Yuv422Json")] Yuv422),
    Mono(#[serde(with = "MonoJson")] Mono),
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "HsvBox", deny_unknown_fields)]
struct BoxJson {
    hue_low: u8,
    hue_high: u8,
    saturation_low: u8,
    saturation_high: u8,
    value_low: u8,
    value_high: u8,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Yuv422", deny_unknown_fields)]
struct Yuv422Json {
    cr_low: u8,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Mono", deny_unknown_fields)]
struct MonoJson {
    #[serde(rename = "luma_low")]
    low: u8,
    #[serde(rename = "luma_high")]
    high: u8,
}

/// A rest position: coordinates in 1/65,536 px, areas in px.
#[derive(Serialize, Deserialize)]
#[serde(remote = "RestPosition", deny_unknown_fields)]
struct RestJson {
    format: PixelFormat,
    dilations: u8,
    centroid: CentroidEstimator,
    #[serde(with = "markers")]
    markers: MarkerList,
    #[serde(rename = "rect_center_q16")]
    rect_center: (Px, Px),
    #[serde(rename = "rect_area_q16")]
    rect_area: Q<16, i64>,
    /// The direction of gravity at that time, in thousandths.
    #[serde(default)]
    down: Option<Direction>,
}

optional_json!(optional_rest, RestPosition, "super::RestJson");

#[derive(Serialize, Deserialize)]
#[serde(remote = "Marker", deny_unknown_fields)]
struct MarkerJson {
    #[serde(rename = "x_q16")]
    x: Px,
    #[serde(rename = "y_q16")]
    y: Px,
    #[serde(rename = "area_px")]
    area: u32,
}

/// A list of [`MarkerJson`].
mod markers {
    use super::{Marker, MarkerJson, MarkerList};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Seen(#[serde(with = "MarkerJson")] Marker);

    pub fn serialize<S: Serializer>(all: &MarkerList, to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(all.iter().map(|marker| Seen(*marker)))
    }

    pub fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<MarkerList, D::Error> {
        let all = Vec::<Seen>::deserialize(from)?;
        Ok(MarkerList::of(all.into_iter().map(|Seen(marker)| marker)))
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
            threshold: report.threshold,
            tare: report.tare,
            temporal: report.temporal,
            camera: report.camera.settings,
            down: report.down,
            contact_shape: report.contact_shape,
        }
    }

    /// Whether the file was made from this device.
    pub fn is_of(&self, device_id: &[u8; 12]) -> bool {
        self.device_id == unit_number(device_id)
    }
}

/// Reads a file of settings.
///
/// # Errors Its fault, and where.
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
    let threshold = file.threshold;
    threshold
        .check()
        .map_err(|error| format!("the threshold means nothing: {error}"))?;
    file.temporal
        .check()
        .map_err(|error| format!("a limit is out of range: {error}"))?;
    let taken = file.tare.as_ref().and_then(|rest| rest.down);
    if !taken
        .into_iter()
        .chain(file.down.direction())
        .all(Direction::is_sound)
    {
        return Err("down is no direction: its length is not 1000 thousandths".to_owned());
    }
    if !file.contact_shape.is_sound() {
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
            assert_eq!((read.threshold, read.tare), (threshold, report.tare));
            assert_eq!(read.camera, report.camera.settings);
            assert_eq!(read.down, report.down);
            assert_eq!(read.contact_shape, report.contact_shape);
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
            assert_eq!(parse(text.as_bytes()).unwrap().contact_shape, contact_shape);
            let old = text.replace(",\"contact_shape\":\"unknown\"", "");
            let old = old.replace(",\"output\":{\"high\":\"never\"}", "");
            assert!(!old.contains("output"), "{old}");
            assert_eq!(parse(old.as_bytes()).unwrap().contact_shape, contact_shape);
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
