//! The sensing of a single picture, without earlier frames.

use hivtac_sensor::force::model::Model;
use hivtac_sensor::markers::blob::Blob;
use hivtac_sensor::markers::screen::ScreenedTable;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::{self, Measurement};
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::threshold::ByteOrder;

/// The sensing with the table type that is fastest on a computer.
pub type Sensor<'m> = pipeline::Sensor<'m, 64, ScreenedTable>;

/// The model's conditions for a picture of this size, px. In another size than the model's, or of
/// another lens, the preset's focal length is scaled with it.
pub fn settings(model: &Model<'_>, preset: Option<Preset>, [width, height]: [u16; 2]) -> Settings {
    let conditions = &model.conditions;
    let own = conditions.settings(ByteOrder::Native);
    let size = [conditions.geometry.width, conditions.geometry.height];
    if preset.is_none() && size == [width, height] {
        return own;
    }
    let geometry = Geometry::preset(preset.unwrap_or(conditions.preset), width, height);
    Settings {
        threshold: own.threshold,
        dilations: own.dilations,
        centroid: own.centroid,
        ..Settings::usual(geometry, ByteOrder::Native)
    }
}

/// Measures a picture, and looks again if the first look was refused. Also returns the blobs that
/// pass the threshold.
pub fn measure(sensor: &mut Sensor<'_>, pixels: &[u16]) -> (Vec<Blob>, Measurement) {
    let mut measurement = sensor.measure_frame(pixels);
    let blobs = sensor.blobs().to_vec();
    if let Some(again) = sensor.look_again() {
        sensor.push_rows(pixels);
        measurement = sensor.finish_again(again);
    }
    (blobs, measurement)
}

/// The nearest RGB565 to levels of red, green and blue.
pub fn rgb565([red, green, blue]: [u8; 3]) -> u16 {
    let round = |level: u8, highest: u16| (u16::from(level) * highest + 127) / 255;
    round(red, 31) << 11 | round(green, 63) << 5 | round(blue, 31)
}
