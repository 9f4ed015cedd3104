//! `cargo xtask size`: what the firmware takes of each memory.

use std::fs;

use anyhow::{Context, Result, ensure};
use clap::Args;
use object::{Object, ObjectSection, SectionFlags, elf};
use serde::Serialize;

use crate::numbers::grouped;
use crate::toolchain::Toolchain;
use crate::{artifacts, workspace};

/// Options of `cargo xtask size`.
#[derive(Args)]
pub struct Size {
    /// Print one JSON object instead of tables.
    #[arg(long)]
    json: bool,
}

/// A memory of `memory.x`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Region {
    name: String,
    origin: u64,
    length: u64,
    used: u64,
}

/// A section that takes memory.
#[derive(Debug, Serialize)]
pub struct Section {
    name: String,
    address: u64,
    size: u64,
    /// Whether flash holds its first contents.
    loaded: bool,
}

impl Size {
    /// Builds the firmware, measures and prints.
    ///
    /// # Errors
    /// When the firmware cannot be built, or a section lies in no memory.
    pub fn run(&self, toolchain: &Toolchain) -> Result<()> {
        let (regions, sections) = of_firmware(toolchain)?;
        if self.json {
            let all = serde_json::json!({ "regions": regions, "sections": sections });
            println!("{}", serde_json::to_string_pretty(&all)?);
        } else {
            print(&regions, &sections);
        }
        Ok(())
    }
}

/// Memories and sections of the firmware, which is built first.
///
/// # Errors
/// When it cannot be built, or a section lies in no memory.
pub fn of_firmware(toolchain: &Toolchain) -> Result<(Vec<Region>, Vec<Section>)> {
    let elf = artifacts::firmware(toolchain)?;
    let bytes = fs::read(&elf).with_context(|| format!("reading {}", elf.display()))?;
    let sections = sections(&bytes).with_context(|| format!("reading {}", elf.display()))?;
    let script = workspace::folder("memory.x");
    let text =
        fs::read_to_string(&script).with_context(|| format!("reading {}", script.display()))?;
    Ok((fill(regions(&text), &sections)?, sections))
}

/// Sections that lie in the chip's memory, with something in them.
fn sections(elf: &[u8]) -> Result<Vec<Section>> {
    let file = object::File::parse(elf).context("not an ELF file")?;
    let mut sections = Vec::new();
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
            continue;
        };
        if !sh_flags.contains(elf::SHF_ALLOC) || section.size() == 0 {
            continue;
        }
        sections.push(Section {
            name: section.name()?.to_owned(),
            address: section.address(),
            size: section.size(),
            loaded: section.file_range().is_some(),
        });
    }
    Ok(sections)
}

/// The lines `NAME : ORIGIN = 0x…, LENGTH = …K` of a linker script.
fn regions(script: &str) -> Vec<Region> {
    script.lines().filter_map(region).collect()
}

fn region(line: &str) -> Option<Region> {
    let (name, rest) = line.split_once(':')?;
    let (origin, length) = rest.split_once(',')?;
    let origin = origin
        .split_once("ORIGIN")?
        .1
        .trim_start_matches([' ', '=']);
    let length = length
        .split_once("LENGTH")?
        .1
        .trim_start_matches([' ', '=']);
    Some(Region {
        name: name.trim().to_owned(),
        origin: number(origin.trim())?,
        length: number(length.trim())?,
        used: 0,
    })
}

/// A number of a linker script: decimal or hexadecimal, perhaps with K or M.
fn number(text: &str) -> Option<u64> {
    let (digits, factor) = match text.strip_suffix(['K', 'M']) {
        Some(digits) if text.ends_with('K') => (digits, 1024),
        Some(digits) => (digits, 1024 * 1024),
        None => (text, 1),
    };
    let value = match digits.strip_prefix("0x") {
        Some(hexadecimal) => u64::from_str_radix(hexadecimal, 16),
        None => digits.parse(),
    };
    Some(value.ok()? * factor)
}

/// Adds up what each memory holds. What is loaded into RAM at the start lies in flash, too.
fn fill(mut regions: Vec<Region>, sections: &[Section]) -> Result<Vec<Region>> {
    for section in sections {
        let holds = |region: &Region| {
            (region.origin..region.origin + region.length).contains(&section.address)
        };
        let place = regions.iter().position(holds);
        let place = place.with_context(|| {
            format!(
                "{} at {:#x} lies in no memory of memory.x",
                section.name, section.address
            )
        })?;
        regions[place].used += section.size;
        if section.loaded && regions[place].name != "FLASH" {
            let flash = regions.iter_mut().find(|region| region.name == "FLASH");
            flash.context("memory.x has no FLASH")?.used += section.size;
        }
    }
    for Region {
        name, length, used, ..
    } in &regions
    {
        ensure!(used <= length, "{name} holds {used} bytes, {length} fit");
    }
    Ok(regions)
}

/// Memories, as a table in Markdown.
pub fn table(regions: &[Region]) -> String {
    let row = |region: &Region| {
        let (used, length) = (grouped(region.used), grouped(region.length));
        format!("| {} | {used} | {length} |\n", region.name)
    };
    let rows: String = regions.iter().map(row).collect();
    format!("| memory | bytes used | of |\n|---|---:|---:|\n{rows}")
}

fn print(regions: &[Region], sections: &[Section]) {
    println!(
        "{:<16}{:>12}{:>12}  from flash",
        "section", "address", "bytes"
    );
    for Section {
        name,
        address,
        size,
        loaded,
    } in sections
    {
        let loaded = if *loaded { "yes" } else { "no" };
        println!("{name:<16}{address:>#12x}{:>12}  {loaded}", grouped(*size));
    }
    println!("\n{:<16}{:>12}{:>12}{:>12}", "memory", "used", "of", "free");
    for Region {
        name, length, used, ..
    } in regions
    {
        let free = length - used;
        println!(
            "{name:<16}{:>12}{:>12}{:>12}",
            grouped(*used),
            grouped(*length),
            grouped(free)
        );
    }
    if let Some(stack) = regions.iter().find(|region| region.name == "STACK") {
        println!(
            "\nThe stack has {} bytes to itself.",
            grouped(stack.length - stack.used)
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCRIPT: &str = "MEMORY\n{\n  FLASH : ORIGIN = 0x08000000, LENGTH = 2048K\n  RAM : ORIGIN \
                          = 0x20008000, LENGTH = 96K\n}\n";

    fn section(address: u64, size: u64, loaded: bool) -> Section {
        Section {
            name: ".some".to_owned(),
            address,
            size,
            loaded,
        }
    }

    #[test]
    fn memories_are_read_from_the_script() {
        let regions = regions(SCRIPT);
        assert_eq!(regions.len(), 2);
        assert_eq!(
            (regions[0].origin, regions[0].length),
            (0x0800_0000, 2048 * 1024)
        );
        assert_eq!(regions[1].name, "RAM");
    }

    #[test]
    fn what_is_loaded_into_ram_lies_in_flash_too() {
        let sections = [
            section(0x0800_0000, 100, true),
            section(0x2000_8000, 10, true),
            section(0x2000_8010, 5, false),
        ];
        let regions = fill(regions(SCRIPT), &sections).unwrap();
        assert_eq!((regions[0].used, regions[1].used), (110, 15));
    }

    #[test]
    fn a_section_outside_every_memory_is_an_error() {
        assert!(fill(regions(SCRIPT), &[section(0x1000, 4, false)]).is_err());
        assert!(fill(regions(SCRIPT), &[section(0x2000_8000, 97 * 1024, false)]).is_err());
    }
}
