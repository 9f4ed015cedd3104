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
/// What is said until the first sensor is there.
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
    let sensing = json!({ "module": packed(&wasm)?, "engine": engine });
    let firmware: Result<BTreeMap<String, String>> = images
        .iter()
        .map(|image| Ok((image.board(), packed(image.bytes())?)))
        .collect();
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
            format!("globalThis.FIRMWARE ??= {};\n", json!(firmware?)),
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
    Ok(STANDARD.encode(packer.finish()?))
}
