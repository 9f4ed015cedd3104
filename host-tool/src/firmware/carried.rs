//! The firmware that this program came with: in the same folder of an archive, in `share` of a
//! wheel.

use crate::device::Device;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::shown::shown;
use std::path::{Path, PathBuf};

/// Where images are, from the program's folder on.
const FOLDERS: [&str; 2] = ["firmware", "../share/hivtac/firmware"];

/// Returns the image for the device's board.
///
/// # Errors
/// When this program came with none for it, or the device does not say its board.
pub fn image(device: &Device) -> Result<String, Failure> {
    let program = std::env::current_exe().map_err(|error| {
        Failure::input(format!(
            "this program does not know where it is ({error}): give FILE"
        ))
    })?;
    let folder = program.parent().unwrap_or(Path::new("."));
    let address = device.address()?;
    let (_, hello) = Link::connect(&address, device.timeout).map_err(|failure| {
        let ask = "for which board is not known without the device: give FILE";
        match failure.kind {
            Kind::NoDevice | Kind::Version => {
                Failure::new(failure.kind, format!("{failure}; {ask}"))
            }
            _ => failure,
        }
    })?;
    for_board(folder, &shown(&hello.board))
}

/// The image for a board that is carried by the program in `folder`.
fn for_board(folder: &Path, board: &str) -> Result<String, Failure> {
    let name = format!("hivtac-firmware-{}-{board}.bin", env!("CARGO_PKG_VERSION"));
    let places: Vec<PathBuf> = FOLDERS
        .iter()
        .map(|place| folder.join(place).join(&name))
        .collect();
    let found = places.iter().find(|path| path.is_file());
    let found = found.and_then(|path| path.to_str());
    found.map(str::to_owned).ok_or_else(|| {
        Failure::input(format!(
            "this program came without {name} (looked for it as {}): give FILE, of a release or \
             built by cargo",
            places[0].display()
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_image_of_the_board_is_found_in_an_archive_and_in_a_wheel() {
        for place in FOLDERS {
            let root = tempfile::tempdir().unwrap();
            let program = root.path().join("bin");
            std::fs::create_dir(&program).unwrap();
            std::fs::create_dir_all(program.join(place)).unwrap();
            let missing = for_board(&program, "weact-h743").unwrap_err().to_string();
            assert!(missing.contains("came without"), "{missing}");
            let name = concat!(
                "hivtac-firmware-",
                env!("CARGO_PKG_VERSION"),
                "-weact-h743.bin"
            );
            std::fs::write(program.join(place).join(name), "").unwrap();
            assert!(for_board(&program, "weact-h743").unwrap().ends_with(name));
            assert!(for_board(&program, "openmv-h7").is_err());
        }
    }
}
