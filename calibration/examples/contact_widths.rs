//! Makes `sensor/data/contact-widths-8v.bin` anew, by finite elements:
//! `cargo run --release -p hivtac-calibration --example contact_widths`, ten minutes of two cores.

use std::path::Path;

use anyhow::Result;
use hivtac_calibration::forward::contact_widths;

fn main() -> Result<()> {
    let bytes = contact_widths("8v".parse()?)?.to_bytes();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sensor/data/contact-widths-8v.bin");
    std::fs::write(&file, &bytes)?;
    println!("{}: {} bytes", file.display(), bytes.len());
    Ok(())
}
