//! `cargo xtask release`: makes and checks the files of a release.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Args;
use hivtac_wire::image::Image;
use serde_json::Value;

use crate::python::Environment;
use crate::{artifacts, process, toolchain, web};

/// Options of `cargo xtask release`.
#[derive(Args)]
pub struct Release {
    /// Raise the version to this one first, as `0.3.0`, wherever it is written.
    version: Option<String>,
    /// Linux computers for which to build, by Rust's names. By default x86-64 and ARM, with glibc
    /// 2.17 and with musl.
    #[arg(long, value_name = "TARGET")]
    target: Vec<String>,
    /// Tag this commit at the end, as `v0.2.0`, with the notes, after a commit of a raised version.
    /// Pushed, the tag publishes.
    #[arg(long)]
    tag: bool,
}

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Where the version is written: a file, and what is before and behind it.
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
/// What builds programs and wheels for other computers.
const BUILDERS: Environment = Environment {
    folder: "python-release",
    modules: "maturin, ziglang",
    packages: "maturin>=1.9,<2 cargo-zigbuild>=0.20,<1 ziglang",
    needs: "Python 3.9",
};
/// Programs without symbols are a third as large. The profile's own `strip` does not reach packages
/// that have settings of their own there.
const STRIP: [&str; 2] = ["RUSTFLAGS", "-C strip=symbols"];
/// Files beside the program in each archive.
const BESIDE: [&str; 4] = ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"];

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
        let folder = toolchain::work_folder("release")?.join(VERSION);
        if folder.exists() {
            std::fs::remove_dir_all(&folder)?;
        }
        std::fs::create_dir_all(&folder)?;
        let changes = process::read(&toolchain::at("CHANGELOG.md"))?;
        let notes_file = folder.join("notes.md");
        std::fs::write(&notes_file, notes(&changes, VERSION)?)?;
        let python = BUILDERS.ready()?.0;
        let mut names: Vec<&str> = self.target.iter().map(String::as_str).collect();
        if names.is_empty() {
            names.extend(LINUX);
        }
        let built = artifacts::images()?;
        let images = write_images(&folder, &built)?;
        web_page(&folder, &built)?;
        for &name in &names {
            let target = Target {
                name,
                python: &python,
                folder: &folder,
            };
            let program = target.build()?;
            target.archive(&program, &images)?;
            target.wheel(&program, &images)?;
        }
        bill_of_materials(&folder)?;
        install(&folder, &names)?;
        let sums = process::output(
            Command::new("sh")
                .arg("-c")
                .arg("sha256sum -- *")
                .current_dir(&folder),
        )?;
        std::fs::write(folder.join("SHA256SUMS"), &sums)?;
        process::print(&sums);
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

/// Checks that a tag of this version would mark what is built.
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

/// A computer for which files are made.
struct Target<'a> {
    name: &'a str,
    /// With maturin and zig.
    python: &'a Path,
    folder: &'a Path,
}

impl Target<'_> {
    /// A command with the environment's programs first in its path.
    fn with_builders(&self, mut command: Command) -> Result<Command> {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let programs = self.python.with_file_name("");
        let folders = std::iter::once(programs).chain(std::env::split_paths(&path));
        command.env("PATH", std::env::join_paths(folders)?);
        Ok(command)
    }

    /// Builds the host tool against the oldest C library that wheels allow.
    fn build(&self) -> Result<PathBuf> {
        process::run(process::command("rustup target add").arg(self.name))?;
        let glibc = self.name.ends_with("-gnu").then_some(".2.17");
        let mut build = toolchain::cargo("zigbuild --release --package hivtac --bin hivtac", "");
        build.env(STRIP[0], STRIP[1]).arg("--target");
        build.arg(format!("{}{}", self.name, glibc.unwrap_or_default()));
        process::run(&mut self.with_builders(build)?)?;
        let built = toolchain::at("target").join(self.name);
        Ok(built.join("release/hivtac"))
    }

    /// Packs the program, with both boards' firmware beside it.
    fn archive(&self, program: &Path, images: &[PathBuf]) -> Result<()> {
        let name = format!("hivtac-{VERSION}-{}", self.name);
        let packed = toolchain::work_folder("release")?.join(&name);
        copy_into(&packed, &[program])?;
        let beside = BESIDE.map(toolchain::at);
        copy_into(&packed, &beside.each_ref().map(PathBuf::as_path))?;
        copy_into(&packed.join("firmware"), images)?;
        let mut tar = Command::new("tar");
        tar.arg("-czf")
            .arg(self.folder.join(format!("{name}.tar.gz")));
        let folder = packed.with_file_name("");
        process::run(tar.arg("-C").arg(folder).arg(&name))?;
        Ok(std::fs::remove_dir_all(packed)?)
    }

    /// Builds Python's package, with the program and both boards' firmware in it.
    fn wheel(&self, program: &Path, images: &[PathBuf]) -> Result<()> {
        let package = toolchain::at("host-tool/python");
        // The other files of `hivtac.data` are the project's own.
        let scripts = package.join("hivtac.data/scripts");
        let firmware = package.join("hivtac.data/data/share/hivtac/firmware");
        copy_into(&scripts, &[program])?;
        copy_into(&firmware, images)?;
        let is_musl = self.name.ends_with("-musl");
        let system = if is_musl {
            "musllinux_1_2"
        } else {
            "manylinux2014"
        };
        let mut maturin = Command::new(self.python);
        maturin.env(STRIP[0], STRIP[1]).current_dir(&package);
        maturin.args("-m maturin build --release --zig --compatibility".split(' '));
        maturin
            .args([system, "--target", self.name, "--out"])
            .arg(self.folder);
        let built = process::run(&mut self.with_builders(maturin)?);
        std::fs::remove_dir_all(scripts)?;
        std::fs::remove_dir_all(firmware)?;
        built
    }
}

/// Copies files into a folder, which is made if missing.
fn copy_into(folder: &Path, files: &[impl AsRef<Path>]) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    for file in files {
        let file = file.as_ref();
        let name = file.file_name().context("a file has a name")?;
        let copied = std::fs::copy(file, folder.join(name));
        copied.with_context(|| format!("copying {}", file.display()))?;
    }
    Ok(())
}

/// Writes firmware: the images, and as other tools for DFU take them.
fn write_images(folder: &Path, images: &[Image]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for image in images {
        let file = folder.join(format!("hivtac-firmware-{VERSION}-{}.bin", image.board()));
        std::fs::write(&file, image.bytes())?;
        std::fs::write(file.with_extension("dfu"), image.dfuse())?;
        files.push(file);
    }
    Ok(files)
}

/// Writes the page that needs no server.
fn web_page(folder: &Path, images: &[Image]) -> Result<()> {
    let page = web::page(images)?;
    let mut tar = Command::new("tar");
    tar.arg("-czf")
        .arg(folder.join(format!("hivtac-page-{VERSION}.tar.gz")));
    process::run(tar.arg("-C").arg(page).arg("."))
}

/// Writes what the host tool is made of, as CycloneDX. Each wheel has its own list.
fn bill_of_materials(folder: &Path) -> Result<()> {
    if !toolchain::has("cyclonedx") {
        process::run(&mut toolchain::cargo(
            "install --locked cargo-cyclonedx",
            "",
        ))?;
    }
    let name = format!("hivtac-{VERSION}.cdx");
    let mut list = toolchain::cargo("cyclonedx --format json", "");
    list.args(["--override-filename", &name]);
    list.arg("--manifest-path")
        .arg(toolchain::at("host-tool/Cargo.toml"));
    process::run(&mut list)?;
    // It writes one beside each manifest of the workspace.
    let metadata = process::output(&mut toolchain::cargo(
        "metadata --no-deps --format-version 1",
        "",
    ))?;
    let metadata: Value = serde_json::from_str(&metadata)?;
    for package in metadata["packages"].as_array().into_iter().flatten() {
        let manifest = Path::new(package["manifest_path"].as_str().unwrap_or_default());
        let written = manifest.with_file_name(format!("{name}.json"));
        if package["name"] == "hivtac" {
            std::fs::copy(&written, folder.join(format!("{name}.json")))?;
        }
        std::fs::remove_file(written)?;
    }
    Ok(())
}

/// What is asked of an installed program: forces of a simulated sensor, and firmware for both
/// boards.
const ASK: &str = r#"
import glob, json, subprocess, sys
import hivtac

program, firmware, version = sys.argv[1:]
assert len(glob.glob(f"{firmware}/hivtac-firmware-{version}-*.bin")) == 2, firmware
command = [program, "twin", "--json", "--scene", "static"]
twin = subprocess.Popen(command, stdout=subprocess.PIPE)
try:
    with hivtac.open(json.loads(twin.stdout.readline())["port"]) as sensor:
        forces = sum(next(sensor).force is not None for _ in range(200))
finally:
    twin.kill()
assert forces > 150, forces
print(f"{program}: {forces} of 200 samples have a force")
"#;

/// Installs the wheel of a version that runs here from a folder into an environment of its own,
/// unpacks the archives, and asks their programs.
const INSTALL: &str = r#"
set -e
files=$1 work=$2 version=$3 ask=$4
python3 -m venv --clear --system-site-packages "$work/installed"
"$work/installed/bin/pip" install --quiet --find-links "$files" "hivtac==$version"
"$work/installed/bin/python" -c "$ask" \
    "$work/installed/bin/hivtac" "$work/installed/share/hivtac/firmware" "$version"
for archive in "$files/hivtac-$version-$(uname -m)"-*-linux-*.tar.gz; do
    rm -rf "$work/unpacked"
    mkdir "$work/unpacked"
    tar -xzf "$archive" -C "$work/unpacked" --strip-components=1
    "$work/installed/bin/python" -c "$ask" \
        "$work/unpacked/hivtac" "$work/unpacked/firmware" "$version"
done
"#;

/// Processors by Rust's names, and Debian's.
const PROCESSORS: [(&str, &str); 2] = [("x86_64", "amd64"), ("aarch64", "arm64")];

/// Installs what was made for `targets`: on this computer what runs here, then in a new Debian of
/// each processor, emulated if it is another.
fn install(folder: &Path, targets: &[&str]) -> Result<()> {
    let work = toolchain::work_folder("release")?;
    let is_made = |processor: &str| targets.iter().any(|name| name.starts_with(processor));
    if is_made(std::env::consts::ARCH) {
        let mut here = process::command("env");
        here.args(INSTALL_BY).arg(folder).arg(&work);
        process::run(here.args([VERSION, ASK]))?;
    }
    let is_root = process::output(&mut process::command("id -u"))?.trim() == "0";
    if !is_root || process::find_program("debootstrap").is_none() {
        process::say("not installed in a new Debian: that needs root and the program debootstrap");
        return Ok(());
    }
    for (processor, debian) in PROCESSORS.iter().filter(|(name, _)| is_made(name)) {
        let emulator = format!("/proc/sys/fs/binfmt_misc/qemu-{processor}");
        if *processor == std::env::consts::ARCH || Path::new(&emulator).exists() {
            in_debian(folder, &work.join("debian"), debian)?;
        } else {
            process::say(&format!(
                "not installed on {processor}: that needs Debian's qemu-user-static"
            ));
        }
    }
    Ok(())
}

/// What runs [`INSTALL`] with the arguments that follow.
const INSTALL_BY: [&str; 4] = ["sh", "-c", INSTALL, "install"];

fn in_debian(folder: &Path, debian: &Path, architecture: &str) -> Result<()> {
    if debian.exists() {
        std::fs::remove_dir_all(debian)?;
    }
    let mut make = process::command(
        "debootstrap --variant=minbase --include=python3-venv,python3-numpy --arch",
    );
    process::run(make.args([architecture, "stable"]).arg(debian))?;
    for file in folder.read_dir()? {
        copy_into(&debian.join("files"), &[file?.path()])?;
    }
    let mut there = process::command("env PIP_NO_INDEX=1 chroot");
    there.arg(debian).args(INSTALL_BY);
    process::run(there.args(["/files", "/tmp", VERSION, ASK]))?;
    Ok(std::fs::remove_dir_all(debian)?)
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
