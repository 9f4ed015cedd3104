//! `cargo xtask size`: shows how much of each memory of `memory.x` the firmware takes.

use anyhow::Result;

use crate::artifacts::for_each_message;
use crate::toolchain::{TARGET, cargo};

/// Builds the firmware, and prints the linker's table. What is loaded into RAM at the start is in
/// flash, too.
pub fn run() -> Result<()> {
    let mut command = cargo("rustc --release --package hivtac-firmware --target", "");
    command.args([TARGET, "--message-format=json", "--"]);
    command.args(["-Clink-arg=--print-memory-usage", "-Wlinker-messages"]);
    for_each_message(&mut command, |message| {
        let text = message["message"]["message"].as_str();
        if let Some(table) = text.and_then(|text| text.strip_prefix("linker stdout: ")) {
            println!("{table}");
        } else if let Some(text) = message["message"]["rendered"].as_str() {
            eprintln!("{text}");
        }
    })
}
