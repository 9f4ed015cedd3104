//! Computes a force from two pictures of the film, untouched and pressed: `cargo run -p
//! hivtac-sensor --example force -- rest.png pressed.png` (pictures: `hivtac snapshot`, or
//! `hivtac-studies scene`).

use std::error::Error;

use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::{AlignedFile, Model};
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::threshold::ByteOrder;

static MODEL: &AlignedFile<[u8]> =
    &AlignedFile(*include_bytes!("../../calibration/models/default.hvtm"));

/// The pixels of a picture as the camera sends them: RGB565, row by row.
fn pixels(path: &str) -> Result<Vec<u16>, Box<dyn Error>> {
    let picture = image::open(path)?.into_rgb8();
    let level = |level: u8, most: u16| (u16::from(level) * most + 127) / 255;
    let rgb565 = |[r, g, b]: [u8; 3]| level(r, 31) << 11 | level(g, 63) << 5 | level(b, 31);
    Ok(picture.pixels().map(|pixel| rgb565(pixel.0)).collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, rest, pressed] = arguments.as_slice() else {
        return Err("two pictures are needed: untouched, and pressed".into());
    };
    let model = Model::parse(&MODEL.0).map_err(|error| error.to_string())?;
    let settings = model.conditions.settings(ByteOrder::Native);
    let mut sensor: Box<Sensor> = Box::default();
    sensor
        .configure(settings, Some(model))
        .map_err(|error| error.to_string())?;

    let untouched = sensor.measure_frame(&pixels(rest)?);
    let markers = untouched
        .markers
        .ok_or("the first picture shows no four markers")?;
    sensor.set_tare(Some(Rest::of_markers(&markers)), Drift::UNSEEN);

    let measured = sensor.measure_frame(&pixels(pressed)?);
    let status: Vec<_> = measured.status.names().collect();
    match measured.force {
        Some(force) => println!("{:.1} mN ({status:?})", 1e-3 * f64::from(force.magnitude.0)),
        None => println!("no force: {status:?}"),
    }
    Ok(())
}
