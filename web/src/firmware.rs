//! New firmware for a device, from the user's file: checked, and divided into blocks that the
//! page's script writes by the device's loader.

use hivtac_wire::image::{FIRST_LOOK, Image, PROGRAM};
use serde_json::{Value, json};

/// A checked image; `None` before there is one.
#[derive(Default)]
pub struct Firmware(Option<Image>);

impl Firmware {
    /// Checks a file, and whether it fits the device's board if one is connected. Returns
    /// `board`, `version`, how many bytes of the flash to read first, and where the program begins;
    /// or `why` not. The image before it is given up in both cases.
    pub fn choose(&mut self, file: &[u8], board: Option<&str>) -> Value {
        let checked = Image::of_file(file).and_then(|image| {
            board.map_or(Ok(()), |board| image.fits(board))?;
            Ok(image)
        });
        self.0 = checked.as_ref().ok().cloned();
        match checked {
            Ok(image) => json!({
                "board": image.board(), "version": image.version(), "look": FIRST_LOOK,
                "program": PROGRAM,
            }),
            Err(refusal) => json!({ "why": refusal.to_string() }),
        }
    }

    /// The parts to write into a device whose flash begins with `found`: `parts`, address and
    /// length of each, and all their bytes; or `why` not.
    pub fn parts(&self, found: &[u8]) -> (Value, Vec<u8>) {
        let Some(image) = &self.0 else {
            return (json!({ "why": "no firmware was chosen" }), Vec::new());
        };
        match image.parts(found) {
            Ok(parts) => {
                let listed: Vec<_> = parts
                    .iter()
                    .map(|part| (part.address, part.bytes.len()))
                    .collect();
                let bytes = parts.iter().flat_map(|part| part.bytes).copied().collect();
                (json!({ "parts": listed }), bytes)
            }
            Err(refusal) => (json!({ "why": refusal.to_string() }), Vec::new()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_wire::image::FIRST_STAGE;
    use hivtac_wire::image::examples;

    #[test]
    fn an_image_is_checked_and_divided() {
        let mut firmware = Firmware::default();
        assert_eq!(firmware.parts(&[]).0["why"], "no firmware was chosen");
        let image = examples::image("board", "1.2.3", 150_000, 7);
        let reported = firmware.choose(image.bytes(), None);
        assert_eq!(reported["version"], image.version());
        let (reported, bytes) = firmware.parts(&image.bytes()[..FIRST_LOOK]);
        assert_eq!(reported["parts"][0][0], PROGRAM);
        assert_eq!(bytes, image.program());
        let (reported, bytes) = firmware.parts(&[0xFF; FIRST_LOOK]);
        assert_eq!(reported["parts"][0][0], FIRST_STAGE);
        assert_eq!(
            bytes.len(),
            image.first_stage().len() + image.program().len()
        );
        let other = firmware.choose(image.bytes(), Some("another"));
        assert!(other["why"].as_str().unwrap().contains("for the board"));
        let cut = firmware.choose(&image.bytes()[..5_000], None);
        assert!(cut["why"].as_str().unwrap().contains("cut"));
        assert_eq!(firmware.parts(&[]).0["why"], "no firmware was chosen");
    }
}
