//! Makes `sensor/data/torques-4.bin` and `torques-8v.bin` anew, by finite elements:
//! `cargo run --release -p hivtac-calibration --example torques`, minutes of two cores.

use std::path::Path;

use anyhow::Result;
use hivtac_calibration::forward::torques;

fn main() -> Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sensor/data");
    for layout in ["4", "8v"] {
        let bytes = torques(layout.parse()?)?.to_bytes();
        let file = folder.join(format!("torques-{layout}.bin"));
        std::fs::write(&file, &bytes)?;
        println!("{}: {} bytes", file.display(), bytes.len());
    }
    Ok(())
}
