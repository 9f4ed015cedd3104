//! Which stage of the sensing an instruction belongs to, told by the source file that it was made
//! from.

use std::collections::HashMap;
use std::path::Path;

use addr2line::Loader;
use anyhow::{Context, Result, anyhow};

/// The modules of each stage, a line each.
const LISTED: &str = include_str!("../../../sensor/stages.txt");

/// The folders whose modules are the sensing, and what their names begin with: the innermost first.
const FOLDERS: [(&str, &str); 4] = [
    ("sensor/terms/src", "terms/"),
    ("sensor/src/markers", "markers/"),
    ("sensor/src/force", "force/"),
    ("sensor/src", ""),
];

/// The stages, in the order in which a frame goes through them.
pub const ORDER: [&str; 10] = [
    "threshold",
    "dilation",
    "runs, labels, moments",
    "markers",
    "features",
    "network",
    "steps",
    "angles, force",
    "pipeline",
    "library",
];

/// The stages of an image's instructions.
///
/// An instruction belongs to the innermost function of the sensing that it was inlined from, so
/// that what the compiler made one function of is still told apart, and what comes from a library
/// counts for the stage that uses it. Library functions that were not inlined, such as `memset`,
/// are a stage of their own. What belongs to the harness is left out.
pub struct Stages {
    loader: Loader,
    known: HashMap<u64, Option<&'static str>>,
}

impl Stages {
    /// Of the image in this file.
    ///
    /// # Errors
    /// When the image cannot be read or has no line table.
    pub fn of_image(image: &Path) -> Result<Stages> {
        let loader = Loader::new(image)
            .map_err(|error| anyhow!("{error}"))
            .with_context(|| format!("reading the line table of {}", image.display()))?;
        Ok(Stages {
            loader,
            known: HashMap::new(),
        })
    }

    /// The stage of the instruction at an address, one of [`ORDER`], or `None` for the harness.
    ///
    /// # Errors
    /// When the line table is not sound there.
    pub fn stage(&mut self, address: u64) -> Result<Option<&'static str>> {
        if let Some(known) = self.known.get(&address) {
            return Ok(*known);
        }
        let stage = match stage(&self.files(address)?) {
            Some("library") => self.stage_of_symbol(address).or(Some("library")),
            stage => stage,
        };
        self.known.insert(address, stage);
        Ok(stage)
    }

    /// The source files of the functions that an instruction was inlined through, innermost first.
    fn files(&self, address: u64) -> Result<Vec<String>> {
        let problem = |error: String| anyhow!("looking up {address:#x}: {error}");
        let mut frames = self
            .loader
            .find_frames(address)
            .map_err(|error| problem(error.to_string()))?;
        let mut files = Vec::new();
        while let Some(frame) = frames.next().map_err(|error| problem(error.to_string()))? {
            files.extend(
                frame
                    .location
                    .and_then(|location| location.file)
                    .map(str::to_owned),
            );
        }
        Ok(files)
    }

    /// Assembly has no line table; its names say what it is.
    fn stage_of_symbol(&self, address: u64) -> Option<&'static str> {
        stage_of_name(self.loader.find_symbol(address)?)
    }
}

/// The stage, or `None` for the harness.
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
    ORDER
        .into_iter()
        .find(|stage| modules_of(stage).any(|name| name == module))
}

/// The modules of a stage.
fn modules_of(stage: &str) -> impl Iterator<Item = &'static str> {
    let lines = LISTED.lines().filter_map(|line| line.rsplit_once(':'));
    let of_it = lines.filter(move |(name, _)| *name == stage);
    of_it.flat_map(|(_, modules)| modules.split_whitespace())
}

/// Functions in assembly are called `hivtac_` and what they do.
fn stage_of_name(name: &str) -> Option<&'static str> {
    let work = name.strip_prefix("hivtac_")?;
    let stages = [
        ("threshold", "threshold"),
        ("weigh", "threshold"),
        ("dilate", "dilation"),
        ("dot", "network"),
        ("spline", "steps"),
        ("expand", "network"),
        ("activate", "network"),
    ];
    let found = stages.iter().find(|(part, _)| work.contains(part));
    found.map(|(_, stage)| *stage)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage_of(files: &[&str]) -> Option<&'static str> {
        stage(
            &files
                .iter()
                .map(|&file| file.to_owned())
                .collect::<Vec<_>>(),
        )
    }

    #[test]
    fn the_innermost_function_of_the_sensing_decides() {
        let core = "/rustc/1/library/core/src/slice.rs";
        let (label, scanner) = (
            "/p/sensor/src/markers/label.rs",
            "/p/sensor/src/markers/scanner.rs",
        );
        assert_eq!(
            stage_of(&[core, label, scanner]),
            Some("runs, labels, moments")
        );
        assert_eq!(stage_of(&[core, scanner]), Some("pipeline"));
        assert_eq!(
            stage_of(&["/p/sensor/terms/src/units.rs", label]),
            Some("runs, labels, moments")
        );
        assert_eq!(
            stage_of(&["/p/sensor/src/markers/rules/shape.rs"]),
            Some("markers")
        );
    }

    #[test]
    fn every_module_of_the_sensing_is_listed_once() {
        let stages = ORDER.into_iter().chain(["caller"]);
        let mut listed: Vec<String> = stages.flat_map(modules_of).map(str::to_owned).collect();
        listed.sort();
        let modules = |(folder, begin): &(&str, &str)| {
            let entries = std::fs::read_dir(crate::workspace::folder(folder)).unwrap();
            let name = |entry: std::io::Result<std::fs::DirEntry>| {
                let path = entry.unwrap().path();
                format!("{begin}{}", path.file_stem().unwrap().to_str().unwrap())
            };
            entries.map(name).collect::<Vec<_>>()
        };
        let mut found: Vec<String> = FOLDERS.iter().flat_map(modules).collect();
        // Folders of their own.
        found.retain(|module| !["markers", "force"].contains(&module.as_str()));
        found.sort();
        assert_eq!(listed, found);
    }

    #[test]
    fn what_lies_outside_is_library_or_harness() {
        assert_eq!(stage_of(&[]), Some("library"));
        assert_eq!(
            stage_of(&["/rustc/1/library/core/src/slice.rs"]),
            Some("library")
        );
        assert_eq!(stage_of(&["/p/tests/src/golden.rs"]), None);
    }

    #[test]
    fn assembly_is_known_by_its_name() {
        assert_eq!(stage_of_name("hivtac_threshold_row"), Some("threshold"));
        assert_eq!(stage_of_name("memset"), None);
    }
}
