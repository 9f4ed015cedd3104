//! Linux itself as the USB host of the rig: a Debian kernel in QEMU attaches the emulated device by
//! USB/IP, and resets, suspends and unplugs its port. Forces must continue, and the kernel must not
//! warn.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::report::{Tally, run_tests};
use crate::rig::Rig;
use crate::{artifacts, packages, process, toolchain};

/// Number of forces that are read first.
const FORCES: u64 = 1000;
/// How often each action is tried.
const TIMES: u64 = 20;

/// Why Linux cannot be run here.
pub fn obstacle() -> Option<String> {
    // The package that needs the present kernel's.
    let is_possible = cfg!(target_arch = "x86_64") && packages::are_known("linux-image-amd64");
    let why = "it boots Debian's kernel: x86-64 with Debian's packages is needed";
    (!is_possible).then(|| why.to_owned())
}

/// Runs the firmware in the rig, and Linux in QEMU as its host.
pub fn test(firmware: &Path, tally: &mut Tally) -> Result<()> {
    packages::ensure("qemu-system-x86_64", "qemu-system-x86")?;
    let folder = toolchain::work_folder("linux-host")?;
    let stats = folder.join("rig.json");
    let mut command = Command::new(artifacts::host_program("hivtac-rig")?);
    command.args(["--usbip", "0", "--stats-json"]).arg(&stats);
    let rig = Rig::start(command.arg(firmware), &folder.join("rig.log"))?;
    let port = rig.port.rsplit(':').next().unwrap_or_default();
    let mut guest = Command::new("sh");
    let here = toolchain::at("xtask/src/linux_host");
    guest
        .arg(here.join("guest.sh"))
        .arg(artifacts::host_tool()?);
    guest.arg(here.join("init.sh")).current_dir(&folder);
    guest.env("PORT", port).env("FORCES", FORCES.to_string());
    run_tests(guest.env("TIMES", TIMES.to_string()), tally)?;
    rig.finish()?;
    judge_rig(&serde_json::from_str(&process::read(&stats)?)?)
}

/// Checks the rig's counters: its bus was reset and suspended as often as Linux did it.
fn judge_rig(stats: &Value) -> Result<()> {
    let usb = &stats["usb"];
    let count = |name: &str| usb[name].as_u64().with_context(|| format!("no {name}"));
    // Linux also resets the port of each new device.
    for (name, least) in [("port_resets", 2 * TIMES + 1), ("suspends", TIMES)] {
        let times = count(name)?;
        ensure!(times >= least, "the rig counted {times} {name} only");
    }
    for name in ["failed_transfers", "repeated_packets", "lost_words"] {
        ensure!(count(name)? == 0, "{name}: {}", count(name)?);
    }
    ensure!(stats["resets"] == 0, "the microcontroller was reset");
    Ok(())
}
