//! `cargo xtask size`: what the firmware takes of each memory.

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

/// A section that takes memory.
struct Section {
    address: u64,
    size: u64,
    /// Whether flash holds its first contents.
    loaded: bool,
}

/// Builds the firmware, measures, and gives a table of the memories in Markdown.
pub fn memories() -> Result<String> {
    let elf = artifacts::firmware(Board::Weact)?;
    let bytes = std::fs::read(&elf).with_context(|| format!("reading {}", elf.display()))?;
    let sections = sections(&bytes).with_context(|| format!("reading {}", elf.display()))?;
    let script = process::read(&toolchain::at("memory.x"))?;
    Ok(table(&fill(
        script.lines().filter_map(region).collect(),
        &sections,
    )?))
}

/// Sections that lie in the chip's memory, with something in them.
fn sections(elf: &[u8]) -> Result<Vec<Section>> {
    let file = object::File::parse(elf).context("not an ELF file")?;
    let section = |section: object::Section| {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
            return None;
        };
        let is_there = sh_flags.contains(elf::SHF_ALLOC) && section.size() > 0;
        is_there.then(|| Section {
            address: section.address(),
            size: section.size(),
            loaded: section.file_range().is_some(),
        })
    };
    Ok(file.sections().filter_map(section).collect())
}

/// A line `NAME : ORIGIN = 0x…, LENGTH = …K` of a linker script.
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

/// A number of a linker script: decimal or hexadecimal, perhaps with K.
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

/// Adds up what each memory holds. What is loaded into RAM at the start lies in flash, too.
fn fill(mut regions: Vec<Region>, sections: &[Section]) -> Result<Vec<Region>> {
    for section in sections {
        let (address, size) = (section.address, section.size);
        let holds = |it: &&mut Region| (it.origin..it.origin + it.length).contains(&address);
        let place = regions.iter_mut().find(holds);
        let place = place.with_context(|| format!("{address:#x} lies in no memory"))?;
        place.used += size;
        if section.loaded && place.name != "FLASH" {
            let flash = regions.iter_mut().find(|region| region.name == "FLASH");
            flash.context("memory.x has no FLASH")?.used += size;
        }
    }
    let full = regions.iter().find(|region| region.used > region.length);
    ensure!(full.is_none(), "more than fits: {full:?}");
    Ok(regions)
}

/// Memories, as a table in Markdown.
fn table(regions: &[Region]) -> String {
    let row = |region: &Region| {
        let (used, length) = (grouped(region.used), grouped(region.length));
        format!("| {} | {used} | {length} |\n", region.name)
    };
    let rows: String = regions.iter().map(row).collect();
    format!("| memory | bytes used | of |\n|---|---:|---:|\n{rows}")
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
    use super::*;

    fn table_of(sections: &[(u64, u64, bool)]) -> Result<String> {
        let script = "MEMORY\n{\n  FLASH : ORIGIN = 0x08000000, LENGTH = 2048K\n\
                      RAM : ORIGIN = 0x20008000, LENGTH = 96K\n}\n";
        let section = |&(address, size, loaded)| Section {
            address,
            size,
            loaded,
        };
        let sections: Vec<_> = sections.iter().map(section).collect();
        let regions = script.lines().filter_map(region).collect();
        Ok(table(&fill(regions, &sections)?))
    }

    #[test]
    fn what_is_loaded_into_ram_lies_in_flash_too_and_everything_lies_somewhere() {
        let (code, data) = ((0x0800_0000, 1100, true), (0x2000_8000, 10, true));
        let table = table_of(&[code, data, (0x2000_8010, 5, false)]).unwrap();
        let rows = "| FLASH | 1,110 | 2,097,152 |\n| RAM | 15 | 98,304 |\n";
        assert!(table.ends_with(rows), "{table}");
        assert!(table_of(&[(0x1000, 4, false)]).is_err());
        assert!(table_of(&[(0x2000_8000, 97 * 1024, false)]).is_err());
    }
}
