//! Linux itself as the USB host of the rig: a Debian kernel in QEMU attaches the emulated device by
//! USB/IP, and does to its port what Linux can do. Forces come back, and the kernel warns of
//! nothing.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::report::Tally;
use crate::rig::Rig;
use crate::{artifacts, packages, process, toolchain};

/// Forces that are read first.
const FORCES: u64 = 1000;
/// How often each action is tried.
const TIMES: u64 = 20;
/// The longest duration of the whole; usual are nine to sixteen minutes.
const LIMIT: Duration = Duration::from_secs(45 * 60);
/// The package that needs the present kernel's.
const KERNEL: &str = "linux-image-amd64";

/// Why Linux cannot be run here.
pub fn obstacle() -> Option<String> {
    let is_possible = cfg!(target_arch = "x86_64") && packages::are_known(KERNEL);
    let why = "it boots Debian's kernel: x86-64 with Debian's packages is needed";
    (!is_possible).then(|| why.to_owned())
}

/// Runs the firmware in the rig, and Linux in QEMU as its host.
pub fn test(firmware: &Path, tally: &mut Tally) -> Result<()> {
    packages::ensure_qemu_pc()?;
    let folder = toolchain::work_folder("linux-host")?;
    let rig = artifacts::host_program("hivtac-rig")?;
    let tool = artifacts::host_tool()?;
    let stats = folder.join("rig.json");
    let mut command = Command::new(rig);
    command.args(["--usbip", "0", "--stats-json"]).arg(&stats);
    let rig = Rig::start(command.arg(firmware), &folder.join("rig.log"))?;
    let port = rig.port.rsplit(':').next().unwrap_or_default();
    let mut guest = Command::new("sh");
    let here = toolchain::at("xtask/src/linux_host");
    (guest.arg(here.join("guest.sh")).arg(tool)).arg(here.join("init.sh"));
    guest.env("PORT", port).env("FORCES", FORCES.to_string());
    process::run(guest.env("TIMES", TIMES.to_string()).current_dir(&folder))?;
    let console = folder.join("console.txt");
    run(&folder, &console)?;
    rig.finish()?;
    let text = String::from_utf8_lossy(&fs::read(&console)?).replace('\r', "");
    judge(&text, tally)?;
    let stats: Value = serde_json::from_str(&process::read(&stats)?)?;
    judge_rig(&stats)
}

/// Runs the emulated PC until it switches itself off.
fn run(guest: &Path, console: &Path) -> Result<()> {
    let mut command = process::command(
        "qemu-system-x86_64 -accel tcg -m 512 -display none -monitor none -no-reboot -nodefaults \
         -nic user,model=e1000 -serial",
    );
    command.arg(format!("file:{}", console.display()));
    command.arg("-kernel").arg(guest.join("kernel"));
    command.arg("-initrd").arg(guest.join("initramfs"));
    // The kernel's log is judged at the end, whole.
    let words = "console=ttyS0 loglevel=1 panic=-1 log_buf_len=4M";
    command.args(["-append", words]).stdin(Stdio::null());
    process::say(&format!("+ {command:?}"));
    let errors = File::create(console.with_extension("errors"))?;
    command.stdout(Stdio::null()).stderr(errors);
    let mut qemu = command.spawn().context("starting QEMU")?;
    let begin = Instant::now();
    loop {
        if let Some(status) = qemu.try_wait()? {
            ensure!(status.success(), "QEMU failed ({status})");
            return Ok(());
        }
        if begin.elapsed() > LIMIT {
            // Fails only if it has ended meanwhile.
            let _ = qemu.kill();
            qemu.wait()?;
            anyhow::bail!(
                "Linux did not end; its last words are in {}",
                console.display()
            );
        }
        thread::sleep(Duration::from_millis(100));
    }
}

/// Judges what the guest printed: each action, and each warning of the kernel.
fn judge(console: &str, tally: &mut Tally) -> Result<()> {
    for line in console.lines() {
        process::say(line);
        tally.add_line(line);
    }
    ensure!(
        console.contains("\nLinux has ended\n"),
        "Linux did not come to its end; see the console's text"
    );
    let failed = console.lines().filter(|line| line.ends_with(" ... FAIL"));
    let failed: Vec<&str> = failed.collect();
    ensure!(failed.is_empty(), "{}", failed.join("; "));
    let ok = |line: &&str| line.ends_with(" ... ok");
    let done = console.lines().filter(ok).count() as u64;
    let all = 2 + 4 * TIMES;
    ensure!(done == all, "{done} of {all} actions were done");
    Ok(())
}

/// Judges what the rig counted: its bus was reset and suspended as often as Linux did it.
fn judge_rig(stats: &Value) -> Result<()> {
    let usb = &stats["usb"];
    let count = |name: &str| usb[name].as_u64().with_context(|| format!("no {name}"));
    // Linux also resets the port of each new device.
    let resets = count("port_resets")?;
    ensure!(
        resets > 2 * TIMES,
        "the rig's bus was reset {resets} times only"
    );
    let suspends = count("suspends")?;
    ensure!(
        suspends >= TIMES,
        "the rig's bus was suspended {suspends} times only"
    );
    for name in ["failed_transfers", "repeated_packets", "lost_words"] {
        ensure!(count(name)? == 0, "{name}: {}", count(name)?);
    }
    ensure!(stats["resets"] == 0, "the microcontroller was reset");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_guest_that_stops_or_fails_is_an_error() {
        let all = |last: &str| {
            let text = "x ... ok\n".repeat(1 + 4 * TIMES as usize);
            format!("{text}{last}\nLinux has ended\n")
        };
        let judged = |text: &str| judge(text, &mut Tally::default()).map_err(|e| e.to_string());
        assert_eq!(judged(&all("y ... ok")), Ok(()));
        assert!(
            judged(&all("y ... FAIL"))
                .unwrap_err()
                .contains("y ... FAIL")
        );
        assert!(judged(&all("y")).unwrap_err().contains("81 of 82"));
        assert!(judged("x ... ok\n").unwrap_err().contains("its end"));
    }
}
