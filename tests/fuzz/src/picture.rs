//! Attacks with picture files: the result is an error that names the file, or all pixels of a
//! frame.

use hivtac_host::picture::Picture;
use hivtac_sensor::markers::scanner::{MAX_HEIGHT, MAX_WIDTH};
use hivtac_terms::threshold::PixelFormat;

/// Reads the input as a PNG, JPEG, BMP or PPM file, or as a raw frame.
pub fn attack(input: &[u8]) -> bool {
    match Picture::parse("it.png", input, PixelFormat::Rgb565) {
        Ok(picture) => {
            let Picture { width, height, .. } = picture;
            assert!((1..=MAX_WIDTH).contains(&width) && (1..=MAX_HEIGHT).contains(&height));
            assert_eq!(
                picture.pixels.len(),
                usize::from(width) * usize::from(height)
            );
            true
        }
        Err(error) => {
            assert!(error.to_string().contains("it.png"), "{error}");
            false
        }
    }
}
