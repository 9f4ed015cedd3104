//! Linux itself as the USB host of the rig: a Debian kernel in QEMU attaches the emulated device by
//! USB/IP, and does to its port what Linux can do. Forces come back, and the kernel warns of
//! nothing.

mod guest;
mod log;

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
    let guest = guest::make(&folder, &tool, port, TIMES)?;
    let console = folder.join("console.txt");
    run(&guest, &console)?;
    rig.finish()?;
    let text = String::from_utf8_lossy(&fs::read(&console)?).replace('\r', "");
    judge(&text, tally)?;
    let stats: Value = serde_json::from_str(&process::read(&stats)?)?;
    judge_rig(&stats)
}

/// Runs the emulated PC until it switches itself off.
fn run(guest: &guest::Guest, console: &Path) -> Result<()> {
    let mut command = process::command(
        "qemu-system-x86_64 -accel tcg -m 512 -display none -monitor none -no-reboot -nodefaults \
         -nic user,model=e1000 -serial",
    );
    command.arg(format!("file:{}", console.display()));
    command.arg("-kernel").arg(&guest.kernel);
    command.arg("-initrd").arg(&guest.files);
    // The kernel's log comes at the end, whole.
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

/// Judges what the guest printed: each action, and the kernel's log.
fn judge(console: &str, tally: &mut Tally) -> Result<()> {
    let (actions, rest) = (console.split_once("\nlog begins\n"))
        .context("Linux did not come to its end; see the console's text")?;
    let (kernel, _) = rest
        .split_once("\nlog ends")
        .context("the kernel's log is not whole")?;
    let mut failed = 0;
    for line in actions.lines() {
        process::say(line);
        tally.add_line(line);
        failed += u64::from(line.ends_with(" ... FAIL"));
    }
    let warnings = log::warnings(kernel);
    for warning in &warnings {
        process::say(&format!("Linux warns: {warning}"));
    }
    let done = actions
        .lines()
        .filter(|line| line.ends_with(" ... ok"))
        .count() as u64;
    let all = 2 + 4 * TIMES;
    ensure!(
        failed == 0,
        "after {failed} of {all} actions no forces came"
    );
    ensure!(done == all, "{done} of {all} actions were done");
    ensure!(warnings.is_empty(), "Linux warns: {}", warnings.join("; "));
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
            let mut text = "x ... ok\n".repeat(1 + 4 * TIMES as usize);
            text.push_str(last);
            text + "\nlog begins\n<6>[    1.0] usb 1-1: new\nlog ends\n"
        };
        let judged = |text: &str| judge(text, &mut Tally::default()).map_err(|e| e.to_string());
        assert_eq!(judged(&all("y ... ok")), Ok(()));
        assert!(judged(&all("y ... FAIL")).unwrap_err().contains("1 of 82"));
        assert!(judged(&all("y")).unwrap_err().contains("81 of 82"));
        assert!(judged("x ... ok\n").unwrap_err().contains("its end"));
        let warned = all("y ... ok").replace("<6>", "<4>");
        assert!(judged(&warned).unwrap_err().contains("usb 1-1: new"));
    }
}
