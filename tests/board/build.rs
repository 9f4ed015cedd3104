//! Makes cargo link again when the memory map changes, which cargo does not check itself.

fn main() {
    println!("cargo:rerun-if-changed=../../memory.x");
}
