//! Links anew when the memory map changes, which cargo does not look at by itself.

fn main() {
    println!("cargo:rerun-if-changed=../../memory.x");
}
