//! Measures the frames rendered per second, and the film's share of a frame's time, on one core:
//! `cargo run --release -p hivtac-twin --example speed`.

use std::time::Instant;

use hivtac_twin::film::Film;
use hivtac_twin::{Contact, Layout, Load, Preset, Scene, SceneError};

/// Frames per measurement. The fastest of several is printed, because others may use the machine.
const FRAMES: u32 = 100;
const REPEATS: u32 = 5;
/// The film's measurements are short; with many, some are undisturbed by other programs.
const FILM_REPEATS: u32 = 40;

fn main() -> Result<(), SceneError> {
    // The reader of the output may close it early.
    sigpipe::reset();
    for preset in [Preset::Paper, Preset::Ov7725] {
        for (width, height) in [(320, 240), (800, 600)] {
            let scene = Scene::preset("demo", preset, width, height, 1)?;
            let seconds = (0..REPEATS)
                .map(|_| measure(&scene))
                .fold(f64::MAX, f64::min);
            let rate = f64::from(FRAMES) / seconds;
            println!("{preset:6} {width}×{height}: {rate:5.0} frames/s");
        }
    }
    for name in Layout::NAMES {
        let film = Film::default().with_layout(name.parse()?)?;
        for contact in [Contact::Force, Contact::Stick, Contact::Slip { mu: 0.6 }] {
            let microseconds = (0..FILM_REPEATS)
                .map(|_| film_us(&film, contact))
                .collect::<Result<Vec<_>, _>>()?;
            let fastest = microseconds.into_iter().fold(f64::MAX, f64::min);
            println!("film, layout {name}, {contact}: {fastest:.2} µs for tip and markers");
        }
    }
    Ok(())
}

/// Returns the time of one load, µs, as the mean of many.
fn film_us(film: &Film, contact: Contact) -> Result<f64, SceneError> {
    const LOADS: u32 = 250;
    let start = Instant::now();
    for k in 1..=LOADS {
        let size_n = 0.25 * f64::from(k) / f64::from(LOADS);
        let load = Load::from_vector([0.1 * size_n, -0.05 * size_n, -size_n])?;
        let load = load.with_contact(contact)?;
        std::hint::black_box(film.press(std::hint::black_box(&load)));
    }
    Ok(start.elapsed().as_secs_f64() * 1e6 / f64::from(LOADS))
}

fn measure(scene: &Scene) -> f64 {
    let start = Instant::now();
    for number in 0..FRAMES {
        let frame = scene.frame(u64::from(number), f64::from(number) / 30.0);
        std::hint::black_box(&frame.pixels);
    }
    start.elapsed().as_secs_f64()
}
