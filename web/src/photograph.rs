//! The sensing's result for a user's picture, as `hivtac sense` shows it.

use hivtac_host::frame::{Frame, Taken};
use hivtac_host::live::camera::Kind;
use hivtac_host::live::device::Device;
use hivtac_host::one_picture::{Sensor, measure, rgb565, settings};
use hivtac_host::page::{lights, picture, rows};
use hivtac_sensor::force::model::Model;
use hivtac_twin::Layout;
use hivtac_wire::message::{DeviceHello, Sample};
use serde_json::json;

/// Senses a picture of red, green, blue and opacity, a byte each. Returns a line of JSON, `{"why":
/// …}` if the picture cannot be used or `{"sample": …, "lights": …}`, and then the picture for the
/// page as [`picture::bytes`] writes it.
pub fn sense(levels: &[u8], width: u16, height: u16) -> Vec<u8> {
    match try_to(levels, width, height) {
        Ok(bytes) => bytes,
        Err(why) => (json!({ "why": why }).to_string() + "\n").into_bytes(),
    }
}

fn try_to(levels: &[u8], width: u16, height: u16) -> Result<Vec<u8>, String> {
    let kind = Kind::default();
    let model = Model::parse(kind.model(Layout::default())).map_err(|error| error.to_string())?;
    let (colours, _) = levels.as_chunks::<4>();
    if colours.len() != usize::from(width) * usize::from(height) {
        return Err(format!("it has not {width} × {height} px"));
    }
    let pixels = colours.iter();
    let pixels: Vec<u16> = pixels
        .map(|[red, green, blue, _]| rgb565([*red, *green, *blue]))
        .collect();
    let settings = settings(&model, None, [width, height]);
    let mut sensor: Box<Sensor> = Box::default();
    sensor
        .configure(settings, Some(model))
        .map_err(|error| format!("it cannot be looked at: {error}"))?;
    let (_, measurement) = measure(&mut sensor, &pixels);
    let sample = Sample {
        sequence: 0,
        frame: 0,
        time_us: 0,
        status: measurement.status,
        force: measurement.force,
        contacts: measurement.contacts,
        markers: measurement.markers.unwrap_or_default(),
    };
    let answer = json!({
        "sample": rows::row(&sample),
        "lights": lights::of(sample.status),
    });
    let hello = DeviceHello {
        width,
        height,
        dilations: settings.dilations,
        centroid: settings.centroid,
        ..Device::new(kind, Layout::default(), [0; 12], 1.0).hello()
    };
    let frame = Frame {
        number: 0,
        time_us: 0,
        width,
        height,
        threshold: settings.threshold,
        bytes: pixels
            .iter()
            .flat_map(|pixel| pixel.to_be_bytes())
            .collect(),
    };
    let taken = Taken {
        frame,
        sample: Some(sample),
    };
    let line = answer.to_string() + "\n";
    Ok([line.into_bytes(), picture::bytes(&taken, &hello)].concat())
}
