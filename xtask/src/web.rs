//! `cargo xtask web`: builds the page that needs no server.
//!
//! A browser loads neither modules nor WebAssembly for a page on disk. So the page has its modules
//! in itself, and the WebAssembly module lies in a script, packed by gzip, as text.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use hivtac_wire::image::Image;
use serde_json::json;

use crate::{artifacts, process, toolchain};

/// Where scripts are: those of this page alone take the place of those that `hivtac view` serves.
const FOLDERS: [&str; 2] = ["host-tool/src/page/files", "web/page"];
/// The script of the worker, which is no module.
const WORKER: &str = "engine.js";
/// The line of the page that loads its scripts, for `hivtac view`.
const LOADS: &str = r#"<script type="module" src="main.js"></script>"#;
/// Messages until the first sensor is there.
const WAITS: [&str; 2] = ["connecting to hivtac …", "starting the simulated sensor …"];

/// Builds the page, with these images for devices; returns its folder.
pub fn page(images: &[Image]) -> Result<PathBuf> {
    let module = artifacts::web_module()?;
    let wasm = fs::read(&module).with_context(|| format!("reading {}", module.display()))?;
    let files = toolchain::at(FOLDERS[0]);
    let html = process::read(&files.join("index.html"))?;
    ensure!(
        html.contains(LOADS) && html.contains(WAITS[0]),
        "index.html does not load its scripts as `cargo xtask web` expects"
    );
    let loads = format!(
        r#"<script type="importmap">{}</script>
<script defer src="sensing.js"></script>
<script defer src="firmware.js"></script>
<script type="module">import "main.js";</script>"#,
        import_map()?
    );
    let engine = process::read(&toolchain::at(FOLDERS[1]).join(WORKER))?;
    let sensing = format!(
        "{{ module: \"{}\", engine: {} }}",
        packed(&wasm)?,
        json!(engine)
    );
    let firmware = images.iter().map(|image| {
        let packed = packed(image.bytes())?;
        Ok(format!("\"{}\": \"{packed}\"", image.board()))
    });
    let firmware: Result<Vec<String>> = firmware.collect();
    let folder = toolchain::work_folder("web")?;
    for (name, text) in [
        (
            "index.html",
            html.replace(LOADS, &loads).replace(WAITS[0], WAITS[1]),
        ),
        ("style.css", process::read(&files.join("style.css"))?),
        ("sensing.js", format!("globalThis.HIVTAC = {sensing};\n")),
        (
            "firmware.js",
            format!("globalThis.FIRMWARE ??= {{ {} }};\n", firmware?.join(", ")),
        ),
    ] {
        process::write(&folder.join(name), &text)?;
    }
    Ok(folder)
}

/// Builds the page with both boards' firmware, and prints where it is and how large.
pub fn run() -> Result<()> {
    let folder = page(&artifacts::images()?)?;
    let sizes = fs::read_dir(&folder)?.map(|file| Ok(file?.metadata()?.len()));
    let bytes: u64 = sizes.sum::<std::io::Result<u64>>()?;
    println!(
        "{}: {:.2} MB; open it in a browser, or put the folder on any file server",
        folder.join("index.html").display(),
        bytes as f64 * 1e-6
    );
    Ok(())
}

/// The map by which the page's modules find each other: each is a `data:` address of its own.
fn import_map() -> Result<String> {
    let mut imports = BTreeMap::new();
    for folder in FOLDERS {
        for entry in fs::read_dir(toolchain::at(folder))? {
            let file = entry?.path();
            if file.extension().is_some_and(|it| it == "js") && !file.ends_with(WORKER) {
                let name = file.file_name().context("a script without a name")?;
                let source = process::read(&file)?.replace(" from \"./", " from \"");
                let address = format!("data:text/javascript;base64,{}", STANDARD.encode(source));
                imports.insert(name.to_string_lossy().into_owned(), address);
            }
        }
    }
    Ok(json!({ "imports": imports }).to_string())
}

/// Packs bytes as a file of gzip, and that as text.
fn packed(bytes: &[u8]) -> Result<String> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::best());
    packer.write_all(bytes)?;
    Ok(text_of(&packer.finish()?))
}

/// Writes bytes as text for `web/page/packed.js`: seven bits a character, the highest first, which
/// is an eighth less than base64.
fn text_of(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len() * 6 / 5);
    let [mut bits, mut count] = [0_u16, 0];
    for &byte in bytes {
        bits = bits << 8 | u16::from(byte);
        count += 8;
        while count >= 7 {
            count -= 7;
            text.push(character((bits >> count & 127) as u8));
        }
    }
    if count > 0 {
        text.push(character((bits << (7 - count) & 127) as u8));
    }
    text
}

/// The character of seven bits. Those that a string in a script cannot hold are moved up.
fn character(bits: u8) -> char {
    match bits {
        0 | b'\n' | b'\r' | b'"' | b'\\' => char::from(bits | 128),
        _ => char::from(bits),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_from_text() {
        let bytes: Vec<u8> = (0..=255).rev().chain(*b"\0\n\r\"\\").collect();
        for length in 0..bytes.len() {
            let text = text_of(&bytes[..length]);
            assert!(!text.contains(['\0', '\n', '\r', '"', '\\']));
            // As `packed.js` reads it.
            let bits = text
                .chars()
                .flat_map(|it| (0..7).rev().map(move |k| it as u32 >> k & 1));
            let bits: Vec<u32> = bits.collect();
            let read = bits
                .chunks_exact(8)
                .map(|byte| byte.iter().fold(0, |all, bit| all << 1 | bit));
            let read: Vec<u32> = read.take(text.chars().count() * 7 / 8).collect();
            let want: Vec<u32> = bytes[..length].iter().map(|&byte| byte.into()).collect();
            assert_eq!(read, want, "{length}");
        }
    }
}
