//! Says which processors have kernels of their own.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(armv7em)");
    let target = env::var("TARGET").expect("cargo sets TARGET");
    // Cortex-M4 and M7: they have the SIMD instructions of the kernels, which no stable `cfg`
    // tells.
    if target.starts_with("thumbv7em-") {
        println!("cargo::rustc-cfg=armv7em");
    }
}
