//! `cargo xtask release`: makes and checks the files of a release. The scripts in this folder only
//! run other programs; `.github/workflows/release.yml` also runs one of them.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Args;

use crate::{artifacts, process, python, toolchain, web};

/// Options of `cargo xtask release`.
#[derive(Args)]
pub struct Release {
    /// Raise the version to this one first, as `0.3.0`, wherever it is written.
    version: Option<String>,
    /// Linux computers for which to build, by Rust's names. By default x86-64 and ARM, with glibc
    /// 2.17 and with musl.
    #[arg(long, value_name = "TARGET", default_values = LINUX)]
    target: Vec<String>,
    /// Tag this commit at the end, as `v0.2.0`, with the notes, after a commit of a raised version.
    /// Pushed, the tag publishes.
    #[arg(long)]
    tag: bool,
}

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Where the version is written: a file, and the text before and behind it.
const WRITTEN: [(&str, &str, &str); 5] = [
    ("Cargo.toml", "\nversion = \"", "\"\n"),
    ("tests/qemu/Cargo.toml", "\nversion = \"", "\"\n"),
    ("host-tool/lerobot/pyproject.toml", "\nversion = \"", "\"\n"),
    ("host-tool/lerobot/pyproject.toml", "\"hivtac==", "\""),
    (
        "ros2/hivtac_ros2_control/package.xml",
        "<version>",
        "</version>",
    ),
];
const LINUX: [&str; 4] = [
    "x86_64-unknown-linux-gnu",
    "x86_64-unknown-linux-musl",
    "aarch64-unknown-linux-gnu",
    "aarch64-unknown-linux-musl",
];
/// Packages that build programs and wheels for other computers.
const BUILDERS: [&str; 3] = ["maturin>=1.9,<2", "cargo-zigbuild>=0.20,<1", "ziglang"];

impl Release {
    /// Writes the files to `target/xtask/release/VERSION/`, then installs those that this computer
    /// runs.
    pub fn run(&self) -> Result<()> {
        if let Some(version) = self.version.as_deref().filter(|it| *it != VERSION) {
            return self.raise(version);
        }
        if self.tag {
            may_be_tagged(VERSION)?;
        }
        let work = toolchain::work_folder("release")?;
        let folder = work.join(VERSION);
        if folder.exists() {
            std::fs::remove_dir_all(&folder)?;
        }
        std::fs::create_dir_all(&folder)?;
        let changes = process::read(&toolchain::at("CHANGELOG.md"))?;
        let notes_file = folder.join("notes.md");
        process::write(&notes_file, &notes(&changes, VERSION)?)?;
        firmware_and_page(&folder)?;
        let builders = python::environment("release", &BUILDERS)?;
        let mut files = script("files.sh", &[&folder]);
        files.arg(VERSION).args(&self.target);
        process::before_path(&mut files, &builders.with_file_name(""))?;
        process::run(&mut files)?;
        for installs in ["install.sh", "debian.sh"] {
            process::run(script(installs, &[&folder, &work]).arg(VERSION))?;
        }
        let sums = "sha256sum -- * > SHA256SUMS && cat SHA256SUMS";
        process::run(Command::new("sh").args(["-c", sums]).current_dir(&folder))?;
        match self.tag {
            // Lines with `#` are notes, too.
            true => {
                let mut mark = git("tag --annotate --cleanup=verbatim --file");
                process::run(mark.arg(notes_file).arg(format!("v{VERSION}")))
            }
            false => Ok(()),
        }
    }

    /// Writes another version wherever this one is, then makes the release with a program of it.
    fn raise(&self, version: &str) -> Result<()> {
        notes(&process::read(&toolchain::at("CHANGELOG.md"))?, version)?;
        if self.tag {
            may_be_tagged(version)?;
        }
        for place in WRITTEN {
            let (file, text) = raised(place, version)?;
            process::write(&file, &text)?;
        }
        process::run(&mut toolchain::cargo("update --workspace --offline", ""))?;
        process::run(&mut toolchain::cargo(
            "update --workspace --offline",
            "tests/qemu",
        ))?;
        if self.tag {
            process::run(git("commit --all --message").arg(format!("Release {version}")))?;
        }
        let mut release = toolchain::cargo("xtask release", "");
        for target in &self.target {
            release.args(["--target", target]);
        }
        process::run(release.args(self.tag.then_some("--tag")))
    }
}

/// A file of [`WRITTEN`], with another version there.
fn raised((name, before, after): (&str, &str, &str), version: &str) -> Result<(PathBuf, String)> {
    let file = toolchain::at(name);
    let text = process::read(&file)?;
    let written = |version: &str| format!("{before}{version}{after}");
    let is_once = text.matches(&written(VERSION)).count() == 1;
    ensure!(is_once, "{name} needs {:?}, once", written(VERSION));
    Ok((file, text.replace(&written(VERSION), &written(version))))
}

fn git(words: &str) -> Command {
    let mut git = process::command(&format!("git {words}"));
    git.current_dir(toolchain::at(""));
    git
}

/// Checks that a tag of this version would mark this build.
fn may_be_tagged(version: &str) -> Result<()> {
    let changed = process::output(&mut git("status --porcelain"))?;
    ensure!(changed.is_empty(), "not committed yet:\n{changed}");
    let taken = process::output(git("tag --list").arg(format!("v{version}")))?;
    ensure!(taken.is_empty(), "the tag v{version} is there already");
    Ok(())
}

/// The newest section of the changelog `text`, which must be that of `version`.
fn notes(text: &str, version: &str) -> Result<String> {
    let newest = text.split("\n## ").nth(1);
    let newest = newest.context("CHANGELOG.md has no section")?;
    let of = newest.split([',', ' ', '\n']).next().unwrap_or_default();
    ensure!(
        of == version,
        "the newest section of CHANGELOG.md is of {of}, the release is {version}"
    );
    Ok(format!("# {newest}"))
}

/// Writes both boards' firmware, also as other tools for DFU take it, and the page that needs no
/// server.
fn firmware_and_page(folder: &Path) -> Result<()> {
    let images = artifacts::images()?;
    for image in &images {
        let file = folder.join(format!("hivtac-firmware-{VERSION}-{}.bin", image.board()));
        std::fs::write(&file, image.bytes())?;
        std::fs::write(file.with_extension("dfu"), image.dfuse())?;
    }
    let packed = folder.join(format!("hivtac-page-{VERSION}.tar.gz"));
    let mut tar = process::command("tar -czf");
    process::run(tar.arg(packed).arg("-C").arg(web::page(&images)?).arg("."))
}

/// A command that runs a script of this folder, in the project's root.
fn script(name: &str, folders: &[&Path]) -> Command {
    let mut command = Command::new("sh");
    command.arg(toolchain::at("xtask/src/release").join(name));
    command.args(folders).current_dir(toolchain::at(""));
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_package_has_the_workspaces_version() {
        for place in WRITTEN {
            let text = raised(place, "9.8.7").unwrap().1;
            assert!(text.contains(&format!("{}9.8.7{}", place.1, place.2)));
        }
    }

    #[test]
    fn notes_are_the_newest_section() {
        let of = |text: &str| notes(text, "0.2.0").ok();
        let text = "# Changelog\n\n## 0.2.0, the first\n\n- New.\n\n## 0.1.0\n\n- Old.\n";
        assert_eq!(of(text).as_deref(), Some("# 0.2.0, the first\n\n- New.\n"));
        assert_eq!(of("# Changelog\n\n## 0.1.0\n\n- Old.\n"), None);
        assert_eq!(of("# Changelog\n"), None);
    }
}
