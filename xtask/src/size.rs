//! `cargo xtask size`: measures how much of each memory the firmware takes.

use anyhow::{Context, Result, ensure};
use object::{Object, ObjectSection, SectionFlags, elf};

use crate::artifacts::{self, Board};
use crate::{process, toolchain};

/// A memory of `memory.x`.
#[derive(Debug, PartialEq, Eq)]
struct Region {
    name: String,
    origin: u64,
    length: u64,
    used: u64,
}

/// A section that takes memory: address, size, and whether flash holds its initial contents.
type Section = (u64, u64, bool);

/// Builds the firmware and measures it; returns a Markdown table of the memories.
pub fn memories() -> Result<String> {
    let elf = artifacts::firmware(Board::Weact)?;
    let bytes = std::fs::read(&elf).with_context(|| format!("reading {}", elf.display()))?;
    let script = process::read(&toolchain::at("memory.x"))?;
    table(&script, &sections(&bytes)?)
}

/// Non-empty sections in the chip's memory.
fn sections(elf: &[u8]) -> Result<Vec<Section>> {
    let file = object::File::parse(elf).context("not an ELF file")?;
    let section = |section: object::Section| {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
            return None;
        };
        let is_there = sh_flags.contains(elf::SHF_ALLOC) && section.size() > 0;
        let loaded = section.file_range().is_some();
        is_there.then(|| (section.address(), section.size(), loaded))
    };
    Ok(file.sections().filter_map(section).collect())
}

/// Reads a line `NAME : ORIGIN = 0x…, LENGTH = …K` of a linker script.
fn region(line: &str) -> Option<Region> {
    let (name, rest) = line.split_once(':')?;
    let (origin, length) = rest.split_once(',')?;
    let value =
        |text: &str, word: &str| number(text.split_once(word)?.1.trim_start_matches([' ', '=']));
    Some(Region {
        name: name.trim().to_owned(),
        origin: value(origin, "ORIGIN")?,
        length: value(length, "LENGTH")?,
        used: 0,
    })
}

/// Reads a linker script's number: decimal or hexadecimal, with an optional K.
fn number(text: &str) -> Option<u64> {
    let text = text.trim();
    let digits = text.strip_suffix('K');
    let factor = digits.map_or(1, |_| 1024);
    let digits = digits.unwrap_or(text);
    let value = match digits.strip_prefix("0x") {
        Some(hexadecimal) => u64::from_str_radix(hexadecimal, 16),
        None => digits.parse(),
    };
    Some(value.ok()? * factor)
}

/// A table of the contents of each memory. Sections loaded into RAM at the start are in flash, too.
fn table(script: &str, sections: &[Section]) -> Result<String> {
    let mut regions: Vec<Region> = script.lines().filter_map(region).collect();
    for (address, size, loaded) in sections {
        let holds = |it: &&mut Region| (it.origin..it.origin + it.length).contains(address);
        let place = regions.iter_mut().find(holds);
        let place = place.with_context(|| format!("{address:#x} lies in no memory"))?;
        place.used += size;
        if *loaded && place.name != "FLASH" {
            let flash = regions.iter_mut().find(|region| region.name == "FLASH");
            flash.context("memory.x has no FLASH")?.used += size;
        }
    }
    let full = regions.iter().find(|region| region.used > region.length);
    ensure!(full.is_none(), "more than fits: {full:?}");
    let mut text = "| memory | bytes used | of |\n|---|---:|---:|\n".to_owned();
    for region in &regions {
        let (used, length) = (grouped(region.used), grouped(region.length));
        text += &format!("| {} | {used} | {length} |\n", region.name);
    }
    Ok(text)
}

/// A number with a comma after each three digits.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let parts = digits.as_bytes().rchunks(3).rev();
    let parts: Vec<_> = parts.map(String::from_utf8_lossy).collect();
    parts.join(",")
}

#[cfg(test)]
mod tests {
    use super::table;

    #[test]
    fn what_is_loaded_into_ram_lies_in_flash_too_and_everything_lies_somewhere() {
        let script = "MEMORY\n{\n  FLASH : ORIGIN = 0x08000000, LENGTH = 2048K\n\
                      RAM : ORIGIN = 0x20008000, LENGTH = 96K\n}\n";
        let (code, data) = ((0x0800_0000, 1100, true), (0x2000_8000, 10, true));
        let text = table(script, &[code, data, (0x2000_8010, 5, false)]).unwrap();
        let rows = "| FLASH | 1,110 | 2,097,152 |\n| RAM | 15 | 98,304 |\n";
        assert!(text.ends_with(rows), "{text}");
        assert!(table(script, &[(0x1000, 4, false)]).is_err());
        assert!(table(script, &[(0x2000_8000, 97 * 1024, false)]).is_err());
    }
}
