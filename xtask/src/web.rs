//! `cargo xtask web`: builds the page that needs no server.
//!
//! A browser loads neither modules nor WebAssembly for a page on disk. So the page's scripts become
//! one, and the WebAssembly module lies in another one, packed by gzip, as text.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use flate2::Compression;
use flate2::write::GzEncoder;
use hivtac_wire::image::Image;

use crate::{artifacts, process, toolchain};

/// Where scripts are: those of this page alone take the place of those that `hivtac view` serves.
const FOLDERS: [&str; 2] = ["host-tool/src/page/files", "web/page"];
/// The script that begins, and that of the worker, which is no module.
const MAIN: &str = "main";
const WORKER: &str = "engine";
/// The line of the page that loads its scripts, for `hivtac view`.
const LOADS: &str = r#"<script type="module" src="main.js"></script>"#;
/// What takes its place. Nothing is loaded from elsewhere but what is beside the page.
const LOADS_WHOLE: &str = r#"<script defer src="sensing.js"></script>
<script defer src="firmware.js"></script>
<script defer src="page.js"></script>"#;
/// What is said until the first sensor is there.
const WAITS: [&str; 2] = ["connecting to hivtac …", "starting the simulated sensor …"];

/// Builds the page, with these images for devices; returns its folder.
pub fn page(images: &[Image]) -> Result<PathBuf> {
    let module = artifacts::web_module()?;
    let wasm = fs::read(&module).with_context(|| format!("reading {}", module.display()))?;
    let mut scripts = scripts()?;
    let engine = scripts
        .remove(WORKER)
        .context("web/page/engine.js is missing")?;
    let html = process::read(&toolchain::at(FOLDERS[0]).join("index.html"))?;
    ensure!(
        html.contains(LOADS) && html.contains(WAITS[0]),
        "index.html does not load its scripts as `cargo xtask web` expects"
    );
    let html = html.replace(LOADS, LOADS_WHOLE).replace(WAITS[0], WAITS[1]);
    let style = process::read(&toolchain::at(FOLDERS[0]).join("style.css"))?;
    let sensing = format!(
        "// The WebAssembly module, and the script of its worker.\nglobalThis.HIVTAC = {{\n  \
         module: \"{}\",\n  engine: {},\n}};\n",
        packed(&wasm)?,
        serde_json::to_string(&engine)?
    );
    let folder = toolchain::work_folder("web")?;
    for (name, text) in [
        ("index.html", html),
        ("style.css", style),
        ("page.js", bundle(&scripts)?),
        ("sensing.js", sensing),
        ("firmware.js", firmware(images)?),
    ] {
        let file = folder.join(name);
        fs::write(&file, text).with_context(|| format!("writing {}", file.display()))?;
    }
    Ok(folder)
}

/// The script with the images, by their boards, packed as the module is.
fn firmware(images: &[Image]) -> Result<String> {
    let packed: Result<Vec<String>> = images
        .iter()
        .map(|image| {
            Ok(format!(
                "  \"{}\": \"{}\",\n",
                image.board(),
                packed(image.bytes())?
            ))
        })
        .collect();
    Ok(format!(
        "// Firmware for sensors.\nglobalThis.FIRMWARE ??= {{\n{}}};\n",
        packed?.concat()
    ))
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

/// All scripts, by their names without the ending.
fn scripts() -> Result<BTreeMap<String, String>> {
    let mut scripts = BTreeMap::new();
    for folder in FOLDERS {
        for entry in fs::read_dir(toolchain::at(folder))? {
            let file = entry?.path();
            if let Some(name) = script_name(&file) {
                scripts.insert(name, process::read(&file)?);
            }
        }
    }
    Ok(scripts)
}

fn script_name(file: &Path) -> Option<String> {
    let is_script = file.extension()? == "js";
    let name = file.file_stem()?.to_str()?;
    is_script.then(|| name.to_owned())
}

/// One script of all modules: each is a function, which is called once all that it imports were.
fn bundle(modules: &BTreeMap<String, String>) -> Result<String> {
    let mut done = Vec::new();
    let mut text = "// The page's modules, from host-tool/src/page/files and web/page.\n\"use \
                    strict\";\nconst modules = {};\n"
        .to_owned();
    add(MAIN, modules, &mut Vec::new(), &mut done, &mut text)?;
    let unused = modules.keys().find(|name| !done.contains(name));
    ensure!(unused.is_none(), "{unused:?}.js is imported by no script");
    Ok(text)
}

/// Adds a module after those that it imports.
fn add<'m>(
    name: &'m str,
    modules: &'m BTreeMap<String, String>,
    open: &mut Vec<&'m str>,
    done: &mut Vec<&'m String>,
    text: &mut String,
) -> Result<()> {
    let Some((name, source)) = modules.get_key_value(name) else {
        bail!("{}.js imports {name}.js, which is missing", open.join("/"));
    };
    if done.contains(&name) {
        return Ok(());
    }
    ensure!(
        !open.contains(&name.as_str()),
        "{name}.js imports itself by way of {open:?}"
    );
    open.push(name);
    let mut body = String::new();
    let mut exported = Vec::new();
    for line in source.lines() {
        if let Some((names, from)) = import(line) {
            add(from, modules, open, done, text)?;
            body += &format!("  const {{ {names} }} = modules.{from};\n");
        } else if line.starts_with("import") {
            bail!("{name}.js: write `import {{ … }} from \"./….js\";` in one line: {line}");
        } else if let Some(line) = line.strip_prefix("export ") {
            exported.push(exported_name(line).with_context(|| format!("{name}.js: {line}"))?);
            body += &format!("  {line}\n");
        } else {
            let line = format!("  {line}");
            body += line.trim_end();
            body += "\n";
        }
    }
    let exported = exported.join(", ");
    *text += &format!("\nmodules.{name} = (() => {{\n{body}  return {{ {exported} }};\n}})();\n");
    open.pop();
    done.push(name);
    Ok(())
}

/// The names and the module of a line `import { … } from "./….js";`.
fn import(line: &str) -> Option<(&str, &str)> {
    let (names, from) = line.strip_prefix("import { ")?.split_once(" } from \"./")?;
    Some((names, from.strip_suffix(".js\";")?))
}

/// The name that the rest of a line defines, after `export`.
fn exported_name(line: &str) -> Option<&str> {
    let line = line.strip_prefix("async ").unwrap_or(line);
    let words = ["class ", "function ", "const "];
    let rest = words.iter().find_map(|word| line.strip_prefix(word))?;
    let end = rest.find(|c: char| !c.is_ascii_alphanumeric())?;
    rest.get(..end)
}

/// Packs bytes as a file of gzip, and that as text.
fn packed(bytes: &[u8]) -> Result<String> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::best());
    packer.write_all(bytes)?;
    Ok(text_of(&packer.finish()?))
}

/// Writes bytes as text for `web/page/packed.js`: seven bits a character, the highest first.
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

    fn bundled(modules: &[(&str, &str)]) -> Result<String> {
        let modules = modules.iter();
        let modules = modules.map(|(name, text)| ((*name).to_owned(), (*text).to_owned()));
        bundle(&modules.collect())
    }

    #[test]
    fn modules_follow_what_they_import() {
        let main = ("main", "import { A, b } from \"./a.js\";\nb(A);\n");
        let a = (
            "a",
            "const OWN = 1;\nexport class A {\n}\nexport async function b() {}\n",
        );
        let text = bundled(&[main, a]).unwrap();
        let [first, second] = ["modules.a = ", "modules.main = "].map(|it| text.find(it).unwrap());
        assert!(first < second, "{text}");
        assert!(text.contains("  return { A, b };"), "{text}");
        assert!(text.contains("  const { A, b } = modules.a;"), "{text}");
    }

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

    #[test]
    fn modules_that_cannot_be_put_together_are_named() {
        let main = ("main", "import { A } from \"./a.js\";\n");
        let missing = bundled(&[main]).unwrap_err().to_string();
        assert!(missing.contains("a.js, which is missing"), "{missing}");
        let round = ("a", "import { m } from \"./main.js\";\n");
        let round = bundled(&[main, round]).unwrap_err().to_string();
        assert!(round.contains("imports itself"), "{round}");
        let unused = bundled(&[("main", ""), ("b", "")]).unwrap_err().to_string();
        assert!(unused.contains('b'), "{unused}");
    }
}
