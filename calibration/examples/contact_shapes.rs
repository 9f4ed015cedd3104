//! Makes `sensor/data/contact-shapes.bin` anew, by finite elements:
//! `cargo run --release -p hivtac-calibration --example contact_shapes`, ten minutes of two cores.

use std::path::Path;

use anyhow::Result;
use hivtac_calibration::forward::contact_shapes;

fn main() -> Result<()> {
    let bytes = contact_shapes()?.to_bytes();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sensor/data/contact-shapes.bin");
    std::fs::write(&file, &bytes)?;
    println!("{}: {} bytes", file.display(), bytes.len());
    Ok(())
}
