//! Sets `armv7em` for processors with kernels of their own.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(armv7em)");
    let target = env::var("TARGET").expect("cargo sets TARGET");
    // Cortex-M4 and M7 have the SIMD instructions of the kernels, for which there is no stable
    // `cfg`.
    if target.starts_with("thumbv7em-") {
        println!("cargo::rustc-cfg=armv7em");
    }
}
