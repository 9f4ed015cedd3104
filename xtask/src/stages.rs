//! Which stage of the sensing an instruction belongs to, told by the source file that it was made from.

use std::collections::BTreeMap;
use std::path::Path;

use addr2line::Loader;
use anyhow::{Context, Result, anyhow};

/// The stages, in the order in which a frame goes through them.
pub const ORDER: [&str; 9] = [
    "threshold",
    "dilation",
    "runs, labels, moments",
    "markers",
    "features",
    "network",
    "angles, force",
    "pipeline",
    "library",
];

/// Instructions by the stage's name, one of [`ORDER`].
pub type Stages = BTreeMap<&'static str, u64>;

/// Sorts counted addresses into stages.
///
/// An instruction belongs to the innermost function of the sensing that it was inlined from, so that what the compiler
/// made one function of is still told apart, and what comes from a library counts for the stage that uses it. Library
/// functions that were not inlined, such as `memset`, are a stage of their own. What belongs to the harness is left out.
///
/// # Errors
/// When the image cannot be read or has no line table.
pub fn sort(image: &Path, counts: &BTreeMap<u64, u64>) -> Result<Stages> {
    let loader = Loader::new(image)
        .map_err(|error| anyhow!("{error}"))
        .with_context(|| format!("reading the line table of {}", image.display()))?;
    let mut stages = Stages::new();
    for (&address, &count) in counts {
        if let Some(stage) = stage(&files(&loader, address)?) {
            *stages.entry(stage).or_default() += count;
        }
    }
    Ok(stages)
}

/// The source files of the functions that an instruction was inlined through, innermost first.
fn files(loader: &Loader, address: u64) -> Result<Vec<String>> {
    let problem = |error| anyhow!("looking up {address:#x}: {error}");
    let mut frames = loader
        .find_frames(address)
        .map_err(|error| anyhow!("looking up {address:#x}: {error}"))?;
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

/// The stage, or `None` for the harness.
fn stage(files: &[String]) -> Option<&'static str> {
    let known = files.iter().find_map(|file| stage_of_file(file));
    let is_harness = || files.iter().any(|file| file.contains("tests/"));
    known.or_else(|| (!is_harness()).then_some("library"))
}

fn stage_of_file(file: &str) -> Option<&'static str> {
    let (_, module) = file.rsplit_once("sensing/src/")?;
    let module = module.split(['/', '.']).next()?;
    match module {
        "threshold" | "mask" | "hsv" => Some("threshold"),
        "dilate" => Some("dilation"),
        "runs" | "label" | "blob" => Some("runs, labels, moments"),
        "markers" | "geometry" => Some("markers"),
        "features" => Some("features"),
        "network" | "model" => Some("network"),
        "force" | "cordic" => Some("angles, force"),
        // Small things that belong to whoever uses them.
        "units" | "status" => None,
        _ => Some("pipeline"),
    }
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
        let (label, scanner) = ("/p/sensing/src/label.rs", "/p/sensing/src/scanner.rs");
        assert_eq!(
            stage_of(&[core, label, scanner]),
            Some("runs, labels, moments")
        );
        assert_eq!(stage_of(&[core, scanner]), Some("pipeline"));
        assert_eq!(
            stage_of(&["/p/sensing/src/units.rs", label]),
            Some("runs, labels, moments")
        );
        assert_eq!(
            stage_of(&["/p/sensing/src/markers/shape.rs"]),
            Some("markers")
        );
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
}
