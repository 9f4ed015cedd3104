//! Reads the user's name for a device.

use hivtac_host::shown::shown;
use hivtac_wire::settings::{NAME_BYTES, Name};

/// Reads a name of 1 to 24 bytes with visible characters only.
///
/// # Errors
/// Why it is not a name.
pub fn name(text: &str) -> Result<Name, String> {
    if text.is_empty() {
        return Err("it is empty; `hivtac settings reset` takes a name away".to_owned());
    }
    if shown(text) != text {
        return Err("it has characters that cannot be seen".to_owned());
    }
    Name::try_from(text).map_err(|_| {
        format!(
            "it has {} bytes of UTF-8, of which {NAME_BYTES} can be kept",
            text.len()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_short_and_can_be_read() {
        assert_eq!(name("thumb").unwrap(), "thumb");
        assert_eq!(name("Däumling 2").unwrap(), "Däumling 2");
        for (text, word) in [
            ("", "empty"),
            ("a\u{1b}[2J", "cannot be seen"),
            ("a\nb", "cannot be seen"),
            ("thirteen-ä-characters-ä-ä", "28 bytes"),
        ] {
            let error = name(text).unwrap_err();
            assert!(error.contains(word), "{text:?}: {error}");
        }
    }
}
