//! Prints what the sensing makes of the scene's hard cases, as Markdown: `cargo run --release -p hivtac-tests --bin
//! hard-cases -- [REPEATS [CONTACT]]`.

use anyhow::{Context, Result};
use hivtac_scene::{Contact, Preset};
use hivtac_sensing::threshold::PixelFormat;
use hivtac_tests::hard::{look_at_all, table};
use hivtac_tests::looking::{ESTIMATORS, View};

/// Frames for each case and load.
const REPEATS: u64 = 4;

fn main() -> Result<()> {
    // Whoever reads the output may have enough of it.
    sigpipe::reset();
    let repeats = match std::env::args().nth(1) {
        None => REPEATS,
        Some(text) => text
            .parse()
            .context("REPEATS is the number of frames for each case and load")?,
    };
    let contact = match std::env::args().nth(2) {
        None => Contact::Force,
        Some(text) => text.parse()?,
    };
    for (preset, size) in [
        (Preset::Ov7725, [320, 240]),
        (Preset::Paper, [320, 240]),
        (Preset::Ov7725, [800, 600]),
        (Preset::Paper, [800, 600]),
    ] {
        for estimator in ESTIMATORS {
            let view = View {
                preset,
                size,
                format: PixelFormat::Rgb565,
                estimator,
                contact,
            };
            println!("{}", table(view, &look_at_all(view, repeats)?));
        }
    }
    Ok(())
}
