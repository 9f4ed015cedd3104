//! `host-speed FOLDER`: writes the frames on which `cargo xtask bench --peers` compares, times the
//! sensing on each of them on this computer, and prints one JSON object per line:
//! `{"name":…,"file":…,"size":[columns,rows],"microseconds":…,"markers":…}`.
//!
//! The timed work is everything from RGB565 to markers and features, on one thread. The result is
//! the fastest of many repetitions, which a busy computer disturbs least.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use std::{env, fs};

use anyhow::{Context, Result};
use hivtac_sensor::markers::screen::ScreenedTable;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::{Measurement, Sensor};
use hivtac_terms::geometry::Geometry;
use hivtac_terms::threshold::ByteOrder;
use hivtac_tests::pictures;
use hivtac_twin::{Preset, Scene};
use serde_json::json;

/// Columns and rows of the frames.
const SIZES: [[u16; 2]; 4] = [[160, 120], [320, 240], [640, 480], [800, 600]];
/// Time for which each frame is repeated.
const DURATION: Duration = Duration::from_millis(400);

fn main() -> Result<()> {
    // The reader of the output may close it early.
    sigpipe::reset();
    let folder = env::args_os().nth(1).map(PathBuf::from);
    let folder = folder.context("usage: host-speed FOLDER")?;
    for [width, height] in SIZES {
        let (columns, rows) = (u32::from(width), u32::from(height));
        let scene = Scene::preset("static", Preset::Ov7725, columns, rows, 1)?;
        let usual = scene.frame(0, 1.0).pixels;
        let salted = pictures::salted(usual.clone(), 5, 1);
        for (special, pixels) in [("", usual), (", 5 % salt", salted)] {
            let name = format!("{width}x{height}{special}");
            report(&folder, &name, [width, height], &pixels)?;
        }
    }
    Ok(())
}

fn report(folder: &Path, name: &str, size: [u16; 2], pixels: &[u16]) -> Result<()> {
    let file = folder.join(format!("{name}.rgb565"));
    let bytes: Vec<u8> = pixels
        .iter()
        .flat_map(|pixel| pixel.to_le_bytes())
        .collect();
    fs::write(&file, bytes).with_context(|| format!("writing {}", file.display()))?;
    let (fastest, measurement) = time(size, pixels)?;
    let markers = measurement
        .markers
        .map(|markers| markers.map(|marker| [marker.x, marker.y].map(|px| px.to_f64())));
    println!(
        "{}",
        json!({
            "name": name,
            "file": file,
            "size": size,
            "microseconds": fastest.as_secs_f64() * 1e6,
            "markers": markers,
        })
    );
    Ok(())
}

fn time([width, height]: [u16; 2], pixels: &[u16]) -> Result<(Duration, Measurement)> {
    let geometry = Geometry::preset(Preset::Ov7725, width, height);
    let mut sensor = Box::new(Sensor::<64, ScreenedTable>::new());
    sensor.configure(Settings::usual(geometry, ByteOrder::Native), None)?;
    let (start, mut fastest) = (Instant::now(), Duration::MAX);
    loop {
        let begin = Instant::now();
        let measurement = sense(&mut sensor, width, pixels);
        fastest = fastest.min(begin.elapsed());
        if start.elapsed() > DURATION {
            return Ok((fastest, measurement));
        }
    }
}

fn sense(sensor: &mut Sensor<'_, 64, ScreenedTable>, width: u16, pixels: &[u16]) -> Measurement {
    sensor.begin_frame();
    for row in std::hint::black_box(pixels).chunks_exact(usize::from(width)) {
        sensor.push_row(row);
    }
    sensor.finish_frame()
}
