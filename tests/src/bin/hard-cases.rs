//! Prints the results of the sensing on the scene's hard cases, as Markdown: `cargo run --release
//! -p hivtac-tests --bin hard-cases -- [REPEATS [CONTACT]]`.

use anyhow::{Context, Result};
use hivtac_tests::hard::{detect_in_all, table};
use hivtac_tests::tared::{View, views};
use hivtac_twin::Contact;

/// Number of frames for each case and load.
const REPEATS: u64 = 4;

fn main() -> Result<()> {
    // The reader of the output may close it early.
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
    let yuv422 = View {
        contact,
        ..View::YUV422
    };
    let rgb565 = views(contact, &[[320, 240], [800, 600]]);
    let rgb565 = rgb565.iter().map(|views| &views[..]);
    for views in rgb565.chain([&[yuv422][..]]) {
        for (view, outcomes) in views.iter().zip(detect_in_all(views, repeats)?) {
            println!("{}", table(*view, &outcomes));
        }
    }
    Ok(())
}
