//! Prints what the sensing makes of the scene's hard cases, as Markdown: `cargo run --release -p hivtac-tests --bin
//! hard-cases -- [REPEATS [CONTACT]]`.

use anyhow::{Context, Result};
use hivtac_scene::{Contact, Preset};
use hivtac_sensing::model::CentroidEstimator;
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
    for view in views(contact) {
        println!("{}", table(view, &look_at_all(view, repeats)?));
    }
    Ok(())
}

/// Both cameras at two sizes with both estimators, and the firmware's when it sends YUV422.
fn views(contact: Contact) -> Vec<View> {
    let mut views = Vec::new();
    for size in [[320, 240], [800, 600]] {
        for preset in [Preset::Ov7725, Preset::Paper] {
            views.extend(ESTIMATORS.map(|estimator| View {
                preset,
                size,
                format: PixelFormat::Rgb565,
                estimator,
                contact,
            }));
        }
    }
    views.push(View {
        preset: Preset::Ov7725,
        size: [320, 240],
        format: PixelFormat::Yuv422,
        estimator: CentroidEstimator::RednessWeighted,
        contact,
    });
    views
}
