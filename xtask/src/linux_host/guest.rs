//! The guest's kernel and files: Debian's packages, unpacked and not installed, and the host tool.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::KERNEL;
use crate::{packages, process};

/// Forces that are read first.
const FORCES: u64 = 1000;
/// The kernel's modules, each after those that it needs.
const MODULES: [&str; 6] = [
    "usb-common",
    "usbcore",
    "usbip-core",
    "vhci-hcd",
    "cdc-acm",
    "e1000",
];

/// What QEMU boots.
pub struct Guest {
    /// The kernel.
    pub kernel: PathBuf,
    /// The initramfs.
    pub files: PathBuf,
}

/// Makes the guest. It attaches the rig's device at this port and does each action so many times.
pub fn make(folder: &Path, tool: &Path, port: &str, times: u64) -> Result<Guest> {
    let unpacked = folder.join("packages");
    let package = |name: &str| packages::unpacked(name, &unpacked);
    let linux = package(&kernel_package()?)?;
    let busybox = package("busybox-static")?.join("bin/busybox");
    let root = folder.join("root");
    if root.exists() {
        fs::remove_dir_all(&root).with_context(|| format!("removing {}", root.display()))?;
    }
    for name in ["bin", "modules", "proc", "sys", "dev"] {
        fs::create_dir_all(root.join(name))?;
    }
    let mut tree = Vec::new();
    walk(&linux, &mut tree)?;
    let names = modules(&tree, &root.join("modules"), &busybox)?;
    let programs = [
        busybox.clone(),
        package("usbip")?.join("usr/sbin/usbip"),
        package("usbutils")?.join("usr/bin/usbreset"),
        tool.to_owned(),
    ];
    for program in &programs {
        put(program, &root.join("bin"))?;
        libraries(program, &root)?;
    }
    let parameters = format!(
        "PORT={port}\nFORCES={FORCES}\nTIMES={times}\nMODULES='{}'\n",
        names.join(" ")
    );
    process::write(&root.join("parameters"), &parameters)?;
    let init = root.join("init");
    process::write(&init, include_str!("init.sh"))?;
    fs::set_permissions(&init, fs::Permissions::from_mode(0o755))?;
    let files = folder.join("initramfs");
    pack(&root, &busybox, &files)?;
    let kernel = tree
        .into_iter()
        .find(|file| name_of(file).starts_with("vmlinuz"));
    Ok(Guest {
        kernel: kernel.context("the package has no kernel")?,
        files,
    })
}

/// The name of the package that has the present kernel: `linux-image-6.1.0-56-amd64`.
fn kernel_package() -> Result<String> {
    let mut show = process::command("apt-cache show --no-all-versions");
    let text = process::output(show.arg(KERNEL))?;
    let name = needed_kernel(&text);
    name.with_context(|| format!("{KERNEL} needs no kernel"))
}

/// The package with a kernel among the needs of another package, by the text of `apt-cache show`.
fn needed_kernel(text: &str) -> Option<String> {
    let needs = text
        .lines()
        .find_map(|line| line.strip_prefix("Depends: "))?;
    let mut names = needs.split([',', ' ']);
    names
        .find(|name| name.starts_with("linux-image-"))
        .map(str::to_owned)
}

/// Copies the modules that are not part of the kernel itself; returns their names.
fn modules(tree: &[PathBuf], to: &Path, busybox: &Path) -> Result<Vec<&'static str>> {
    let mut names = Vec::new();
    for module in MODULES {
        let file = format!("{module}.ko");
        let is_it = |path: &&PathBuf| {
            let name = name_of(path);
            name == file || name == format!("{file}.xz")
        };
        let Some(path) = tree.iter().find(is_it) else {
            let is_builtin = |path: &&PathBuf| path.ends_with("modules.builtin");
            let builtin = tree.iter().find(is_builtin).context("no modules.builtin")?;
            let builtin = process::read(builtin)?;
            ensure!(
                builtin.contains(&format!("/{file}")),
                "Debian's kernel has no {module}"
            );
            continue;
        };
        put(path, to)?;
        if path.extension().is_some_and(|extension| extension == "xz") {
            let packed = to.join(format!("{file}.xz"));
            process::run(Command::new(busybox).arg("unxz").arg(packed))?;
        }
        names.push(module);
    }
    Ok(names)
}

/// Adds all files below a folder.
fn walk(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))? {
        let entry = entry?;
        match entry.file_type()?.is_dir() {
            true => walk(&entry.path(), files)?,
            false => files.push(entry.path()),
        }
    }
    Ok(())
}

/// A file's name without its folders.
fn name_of(file: &Path) -> Cow<'_, str> {
    file.file_name().unwrap_or_default().to_string_lossy()
}

/// Copies a file into a folder.
fn put(file: &Path, folder: &Path) -> Result<()> {
    let name = file.file_name().context("a file without a name")?;
    fs::create_dir_all(folder)?;
    let copied = fs::copy(file, folder.join(name));
    copied.with_context(|| format!("copying {}", file.display()))?;
    Ok(())
}

/// Copies the shared libraries that a program needs, to the same places below `root`.
fn libraries(program: &Path, root: &Path) -> Result<()> {
    let Ok(text) = process::output(Command::new("ldd").arg(program)) else {
        // It needs none.
        return Ok(());
    };
    for library in needed_libraries(&text) {
        let library = Path::new(library);
        let place = library.parent().context("a library without a folder")?;
        put(library, &root.join(place.strip_prefix("/")?))?;
    }
    Ok(())
}

/// The paths in what `ldd` prints.
fn needed_libraries(text: &str) -> BTreeSet<&str> {
    text.split_whitespace()
        .filter(|word| word.starts_with('/'))
        .collect()
}

/// Packs a folder as an initramfs.
fn pack(root: &Path, busybox: &Path, to: &Path) -> Result<()> {
    let mut shell = process::command("sh -c");
    shell
        .arg("find . | \"$1\" cpio -o -H newc > \"$2\"")
        .arg("sh");
    process::run(shell.arg(busybox).arg(to).current_dir(root))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_what_tools_print() {
        let show =
            "Package: linux-image-amd64\nDepends: linux-image-6.1.0-56-amd64 (= 6.1.192-2)\n";
        assert_eq!(
            needed_kernel(show).as_deref(),
            Some("linux-image-6.1.0-56-amd64")
        );
        let ldd = "\tlinux-vdso.so.1 (0x00007f9e)\n\tlibc.so.6 => /lib/x86_64-linux-gnu/libc.so.6 \
                   (0x00007f9e)\n\t/lib64/ld-linux-x86-64.so.2 (0x00007f9e)\n";
        let found: Vec<&str> = needed_libraries(ldd).into_iter().collect();
        let both = [
            "/lib/x86_64-linux-gnu/libc.so.6",
            "/lib64/ld-linux-x86-64.so.2",
        ];
        assert_eq!(found, both);
    }
}
