//! Puts the linker scripts into the folder where the linker looks for them.

use std::{env, fs, path::Path};

fn main() {
    let folder = env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    let folder = Path::new(&folder);
    fs::copy("memory.x", folder.join("memory.x")).expect("memory.x can be copied");
    // The settings in the root's .cargo pass the firmware's scripts to every program for this
    // target: link.x, which this one needs as well, and defmt.x, which has nothing to place here.
    fs::write(folder.join("defmt.x"), "").expect("an empty defmt.x can be written");
    println!("cargo:rustc-link-search={}", folder.display());
    println!("cargo:rerun-if-changed=memory.x");
}
