//! The conditions under which data was taken and a model holds, as files name them.

use anyhow::{Context, Result, ensure};
use hivtac_host::shown::unit_number;
use hivtac_sensor::force::model::{self, Origin};
use hivtac_terms::conditions::{CentroidEstimator, ContactReading};
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::marker::LEAST_MARKERS;
use hivtac_terms::threshold::{PixelFormat, Threshold};
use hivtac_twin::film::Layout;
use hivtac_twin::{Camera, Contact};
use serde::{Deserialize, Serialize};

/// All properties of frames and labels on which a model depends (`docs/model-file.md`, conditions).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conditions {
    /// Geometry preset: `paper`, `ov7725` or `mt9v034`.
    pub preset: String,
    /// Columns of a frame.
    pub width: u16,
    /// Rows of a frame.
    pub height: u16,
    /// Format of a pixel.
    pub pixel_format: PixelFormat,
    /// Threshold as the model file holds it. RGB565: lowest and highest hue, saturation and value
    /// (OpenCV's 8-bit HSV; hue may wrap through 0). YUV422: the lowest Cr and zeros. Mono: the
    /// lowest and highest luma and zeros.
    pub threshold: [u8; 6],
    /// 3×3 dilations of the mask.
    pub dilations: u8,
    /// How a marker's position is computed from its pixels.
    pub centroid: CentroidEstimator,
    /// Meaning of the labels; model files omit the friction ratio of `slip`.
    #[serde(with = "names::contact")]
    pub contact: Contact,
    /// Origin of the data.
    pub origin: OriginName,
    /// Number of markers.
    #[serde(default = "four", skip_serializing_if = "is_four")]
    pub markers: usize,
}

/// The number of markers where a file names none.
fn four() -> usize {
    LEAST_MARKERS
}

fn is_four(markers: &usize) -> bool {
    *markers == LEAST_MARKERS
}

/// Where data comes from, by name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OriginName {
    /// Rendered from a scene.
    Simulated,
    /// Measured with the unit whose microcontroller has this number, 24 hexadecimal digits.
    Unit(String),
}

impl OriginName {
    /// The origin for the unit with this number.
    pub fn unit(device_id: [u8; 12]) -> Self {
        OriginName::Unit(unit_number(&device_id))
    }

    /// The origin as the model file holds it.
    ///
    /// # Errors
    /// When the unit's number is not 24 hexadecimal digits.
    pub fn to_model(&self) -> Result<Origin> {
        let OriginName::Unit(digits) = self else {
            return Ok(Origin::Simulated);
        };
        let wrong = || format!("unit `{digits}`: 24 hexadecimal digits are needed");
        ensure!(
            digits.len() == 24 && digits.bytes().all(|b| b.is_ascii_hexdigit()),
            wrong()
        );
        let mut device_id = [0; 12];
        for (i, byte) in device_id.iter_mut().enumerate() {
            *byte = u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).with_context(wrong)?;
        }
        Ok(Origin::Unit(device_id))
    }
}

/// The meaning of α, β and |F| in a contact reading, for reports.
pub fn meaning(contact: Contact) -> &'static str {
    match contact {
        Contact::Force => "α, β and |F| are the force on the film",
        Contact::Stick => {
            "α and β are the pressing direction of a tip that sticks to the film, |F| is the force \
             along it"
        }
        Contact::Slip { .. } => {
            "α and β are the pressing direction of a tip that sticks to the film until it slips, \
             |F| is the force along it"
        }
    }
}

impl Conditions {
    /// The defaults of scene and pipeline for a frame size and a pixel format.
    pub fn simulated(preset: Preset, width: u16, height: u16, pixel_format: PixelFormat) -> Self {
        Self {
            preset: preset.name().into(),
            width,
            height,
            pixel_format,
            threshold: Threshold::red(pixel_format).limits(),
            dilations: 1,
            centroid: CentroidEstimator::BinaryMask,
            contact: Contact::default(),
            origin: OriginName::Simulated,
            markers: LEAST_MARKERS,
        }
    }

    /// The layout of these markers.
    ///
    /// # Errors
    /// When no layout has as many.
    pub fn layout(&self) -> Result<Layout> {
        layout(self.markers)
    }

    /// The simulated camera of these conditions.
    ///
    /// # Errors
    /// When the preset or the frame size does not exist.
    pub fn camera(&self) -> Result<Camera> {
        let preset = preset(&self.preset)?;
        Ok(Camera::new(preset, self.width.into(), self.height.into())?)
    }

    /// The conditions as the model file holds them.
    ///
    /// # Errors
    /// When the preset does not exist, or the threshold is invalid.
    pub fn to_model(&self) -> Result<model::Conditions> {
        let preset = preset(&self.preset)?;
        Ok(model::Conditions {
            preset,
            geometry: Geometry::preset(preset, self.width, self.height),
            threshold: Threshold::of_limits(self.pixel_format, self.threshold)?,
            dilations: self.dilations,
            centroid: self.centroid,
            contact: match self.contact {
                Contact::Force => ContactReading::Force,
                Contact::Stick => ContactReading::Stick,
                Contact::Slip { .. } => ContactReading::Slip,
            },
            origin: self.origin.to_model()?,
        })
    }
}

/// The layout with this many markers.
///
/// # Errors
/// When no layout has as many.
pub fn layout(markers: usize) -> Result<Layout> {
    let all = Layout::NAMES.iter().filter_map(|name| name.parse().ok());
    let found = { all }.find(|layout: &Layout| layout.count() == markers);
    found.with_context(|| {
        format!(
            "{markers} markers: where they are is known of the layouts {} alone",
            Layout::NAMES.join(", ")
        )
    })
}

/// The geometry preset with this name.
///
/// # Errors
/// When there is no preset with this name.
pub fn preset(name: &str) -> Result<Preset> {
    let names = Preset::ALL.map(Preset::name);
    Preset::from_name(name)
        .with_context(|| format!("unknown preset `{name}`: use {}", names.join(", ")))
}

/// The pixel format with this name.
///
/// # Errors
/// When there is no format with this name.
pub fn pixel_format(name: &str) -> Result<PixelFormat> {
    let mut all = PixelFormat::ALL.into_iter();
    let found = all.find(|format| format.name() == name);
    found.with_context(|| format!("unknown pixel format `{name}`: use rgb565, yuv422 or mono"))
}

/// Serialization by name.
mod names {
    pub mod contact {
        use hivtac_twin::Contact;
        use serde::{Deserialize, Deserializer, Serializer, de::Error};

        /// `force`, `stick`, or `slip:0.6` with its friction ratio.
        pub fn serialize<S: Serializer>(contact: &Contact, to: S) -> Result<S::Ok, S::Error> {
            to.collect_str(contact)
        }

        pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Contact, D::Error> {
            let name = String::deserialize(from)?;
            name.parse().map_err(D::Error::custom)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_what_the_firmware_uses() {
        let model = Conditions::simulated(Preset::Ov7725, 320, 240, PixelFormat::Rgb565)
            .to_model()
            .unwrap();
        assert_eq!(model.threshold, Threshold::red(PixelFormat::Rgb565));
        assert_eq!(model.dilations, 1);
        assert_eq!(model.geometry, Geometry::preset(Preset::Ov7725, 320, 240));
        assert_eq!(model.origin, Origin::Simulated);
    }

    #[test]
    fn contact_readings_go_through_files() {
        for (name, reading) in [
            ("force", ContactReading::Force),
            ("stick", ContactReading::Stick),
            ("slip:0.6", ContactReading::Slip),
        ] {
            let mut conditions =
                Conditions::simulated(Preset::Ov7725, 320, 240, PixelFormat::Rgb565);
            conditions.contact = name.parse().unwrap();
            assert_eq!(conditions.to_model().unwrap().contact, reading);
            let text = serde_json::to_string(&conditions).unwrap();
            assert!(text.contains(&format!("\"contact\":\"{name}\"")), "{text}");
            assert_eq!(
                serde_json::from_str::<Conditions>(&text).unwrap(),
                conditions
            );
            let bad = text.replace(name, "slip:7");
            let error = serde_json::from_str::<Conditions>(&bad).unwrap_err();
            assert!(error.to_string().contains("friction ratio is 7"), "{error}");
        }
    }

    #[test]
    fn a_unit_keeps_its_number() {
        let id = [0, 1, 2, 0x30, 4, 5, 6, 7, 8, 9, 10, 255];
        let unit = OriginName::unit(id);
        assert_eq!(unit, OriginName::Unit("000102300405060708090aff".into()));
        assert_eq!(unit.to_model().unwrap(), Origin::Unit(id));
        for digits in [
            "",
            "00",
            "g00102300405060708090aff",
            "+00102300405060708090aff",
        ] {
            assert!(
                OriginName::Unit(digits.into()).to_model().is_err(),
                "{digits}"
            );
        }
    }

    #[test]
    fn an_unknown_preset_is_named() {
        let mut conditions = Conditions::simulated(Preset::Paper, 800, 600, PixelFormat::Rgb565);
        conditions.preset = "Paper".into();
        assert!(
            conditions
                .to_model()
                .unwrap_err()
                .to_string()
                .contains("`Paper`")
        );
    }
}
