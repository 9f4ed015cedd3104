//! Assigns each instruction to a stage of the sensing, by the source file that it comes from.

use std::collections::HashMap;
use std::path::Path;

use addr2line::Loader;
use anyhow::{Result, anyhow};

/// The modules of each stage, one stage a line.
const LISTED: &str = include_str!("../../../sensor/stages.txt");

/// The folders with the sensing's modules, and the prefix of the modules' names; innermost first.
const FOLDERS: [(&str, &str); 4] = [
    ("sensor/terms/src", "terms/"),
    ("sensor/src/markers", "markers/"),
    ("sensor/src/force", "force/"),
    ("sensor/src", ""),
];

/// The stages in a frame's order, with that of library functions at the end.
pub fn order() -> impl Iterator<Item = &'static str> {
    let lines = LISTED.lines().filter(|line| !line.starts_with('#'));
    let names = lines.filter_map(|line| Some(line.rsplit_once(':')?.0));
    names.filter(|name| *name != "caller").chain(["library"])
}

/// The stages of an image's instructions.
///
/// An instruction belongs to the innermost function of the sensing that it was inlined from. Stages
/// thus stay separate when the compiler merges functions, and inlined library code counts for the
/// stage that uses it. Library functions that were not inlined, such as `memset`, form their own
/// stage. Code of the harness is left out.
pub struct Stages {
    loader: Loader,
    known: HashMap<u64, Option<&'static str>>,
}

impl Stages {
    /// The stages of the image in this file.
    pub fn of_image(image: &Path) -> Result<Stages> {
        let loader = Loader::new(image).map_err(|error| anyhow!("{}: {error}", image.display()))?;
        let known = HashMap::new();
        Ok(Stages { loader, known })
    }

    /// The stage of the instruction at an address, one of [`order`], or `None` for the harness.
    pub fn stage(&mut self, address: u64) -> Result<Option<&'static str>> {
        if let Some(known) = self.known.get(&address) {
            return Ok(*known);
        }
        let files = self.files(address);
        let files = files.map_err(|error| anyhow!("{address:#x}: {error}"))?;
        // Assembly has no line table; its function's name gives the stage.
        let named = || stage_of_name(self.loader.find_symbol(address)?);
        let stage = match stage(&files) {
            Some("library") => named().or(Some("library")),
            stage => stage,
        };
        self.known.insert(address, stage);
        Ok(stage)
    }

    /// The source files of the functions that an instruction was inlined through, innermost first.
    fn files(&self, address: u64) -> Result<Vec<String>, Box<dyn std::error::Error>> {
        let mut frames = self.loader.find_frames(address)?;
        let mut files = Vec::new();
        while let Some(frame) = frames.next()? {
            let file = frame.location.and_then(|location| location.file);
            files.extend(file.map(str::to_owned));
        }
        Ok(files)
    }
}

/// The stage of these source files; `None` for the harness.
fn stage(files: &[String]) -> Option<&'static str> {
    let known = files.iter().find_map(|file| stage_of_file(file));
    let is_harness = || files.iter().any(|file| file.contains("tests/"));
    known.or_else(|| (!is_harness()).then_some("library"))
}

fn stage_of_file(file: &str) -> Option<&'static str> {
    let module = FOLDERS.iter().find_map(|(folder, begin)| {
        let (_, within) = file.rsplit_once(&format!("/{folder}/"))?;
        let name = within.split(['/', '.']).next()?;
        Some(format!("{begin}{name}"))
    })?;
    let has_it = |stage: &&str| modules_of(stage).any(|name| name == module);
    order().find(has_it)
}

/// The modules of a stage.
fn modules_of(stage: &str) -> impl Iterator<Item = &'static str> {
    let lines = LISTED.lines().filter_map(|line| line.rsplit_once(':'));
    let of_it = lines.filter(move |(name, _)| *name == stage);
    of_it.flat_map(|(_, modules)| modules.split_whitespace())
}

/// The stage of an assembly function, whose name is `hivtac_` and its work.
fn stage_of_name(name: &str) -> Option<&'static str> {
    let work = name.strip_prefix("hivtac_")?;
    let stages = [
        ("threshold weigh", "threshold"),
        ("dilate", "dilation"),
        ("dot expand activate", "network"),
        ("spline", "steps"),
    ];
    let is_it = |parts: &str| parts.split(' ').any(|part| work.contains(part));
    let found = stages.iter().find(|(parts, _)| is_it(parts));
    found.map(|(_, stage)| *stage)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_innermost_function_of_the_sensing_decides() {
        let (core, scanner) = (
            "/rustc/1/library/core/src/slice.rs",
            "/p/sensor/src/markers/scanner.rs",
        );
        let (label, units) = (
            "/p/sensor/src/markers/label.rs",
            "/p/sensor/terms/src/units.rs",
        );
        for (files, expected) in [
            (&[core, label, scanner][..], Some("runs, labels, moments")),
            (&[core, scanner], Some("pipeline")),
            (&[units, label], Some("runs, labels, moments")),
            (&["/p/sensor/src/markers/rules/shape.rs"], Some("markers")),
            (&[core], Some("library")),
            (&["/p/tests/src/golden.rs"], None),
        ] {
            let files: Vec<String> = files.iter().map(|&file| file.to_owned()).collect();
            assert_eq!(stage(&files), expected, "{files:?}");
        }
    }

    #[test]
    fn every_module_of_the_sensing_is_listed_once() {
        let stages = order().chain(["caller"]);
        let mut listed: Vec<String> = stages.flat_map(modules_of).map(str::to_owned).collect();
        listed.sort();
        let mut found = Vec::new();
        for (folder, begin) in FOLDERS {
            for entry in crate::toolchain::at(folder).read_dir().unwrap() {
                let path = entry.unwrap().path();
                found.push(format!("{begin}{}", path.file_stem().unwrap().display()));
            }
        }
        // Modules that are folders.
        found.retain(|module| !["markers", "force"].contains(&module.as_str()));
        found.sort();
        assert_eq!(listed, found);
    }
}
