//! Frames rendered per second, on one core: `cargo run --release -p hivtac-scene --example speed`.

use std::time::Instant;

use hivtac_scene::{Preset, Scene, SceneError};

/// Frames per measurement; the fastest of a few is printed, as others may use the machine.
const FRAMES: u32 = 100;
const REPEATS: u32 = 5;

fn main() -> Result<(), SceneError> {
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
    Ok(())
}

fn measure(scene: &Scene) -> f64 {
    let start = Instant::now();
    for number in 0..FRAMES {
        let frame = scene.frame(u64::from(number), f64::from(number) / 30.0);
        std::hint::black_box(&frame.pixels);
    }
    start.elapsed().as_secs_f64()
}
