//! Puts the linker scripts into the folder where the linker looks for them.

use std::{env, fs, path::Path};

fn main() {
    let folder = env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    let folder = Path::new(&folder);
    let target = env::var("TARGET").expect("cargo sets TARGET");
    let memory = match target.starts_with("thumbv8m") {
        true => "memory-m55.x",
        false => "memory-m7.x",
    };
    for (from, to) in [(memory, "memory.x"), ("sections.x", "sections.x")] {
        fs::copy(from, folder.join(to)).expect("a linker script can be copied");
        println!("cargo:rerun-if-changed={from}");
    }
    // The settings in the root's .cargo pass the firmware's scripts to every program for its
    // target: link.x, which this one needs as well, and defmt.x, which has nothing to place here.
    fs::write(folder.join("defmt.x"), "").expect("an empty defmt.x can be written");
    println!("cargo:rustc-link-search={}", folder.display());
}
