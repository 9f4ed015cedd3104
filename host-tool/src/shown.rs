//! Escapes text from a device for a terminal: characters that would act instead of being read.

use serde::Serialize;

/// Escapes (`\\u{1b}`) every character that a terminal or a reader could misread: controls, line
/// ends, and characters that turn the text's direction or are invisible.
pub fn shown(text: &str) -> String {
    let escaped = |c: char| match acts(c) {
        true => c.escape_unicode().collect(),
        false => c.to_string(),
    };
    text.chars().map(escaped).collect()
}

/// The same for JSON text, with JSON's escapes, which keep the values.
pub fn shown_json(text: &str) -> String {
    let escaped = |c: char| match acts(c) {
        true => format!("\\u{:04x}", u32::from(c)),
        false => c.to_string(),
    };
    text.chars().map(escaped).collect()
}

/// A JSON object without a line end.
pub fn to_json(value: &impl Serialize) -> String {
    // Only maps with unusual keys and failing `Serialize` implementations cause an error; there are
    // no such types here.
    shown_json(&serde_json::to_string(value).expect("plain data becomes JSON"))
}

/// A microcontroller's unique number: 24 hexadecimal digits.
pub fn unit_number(device_id: &[u8; 12]) -> String {
    device_id.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Whether a character must be escaped; all of them are below U+10000.
fn acts(c: char) -> bool {
    let turns = matches!(c, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}');
    let is_invisible = matches!(c, '\u{ad}' | '\u{2060}'..='\u{206f}' | '\u{feff}');
    let ends_a_line = matches!(c, '\u{2028}' | '\u{2029}');
    c.is_control() || turns || is_invisible || ends_a_line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_text_stays_and_what_acts_is_escaped() {
        assert_eq!(shown("11-64-64-3, 5 µm – ok"), "11-64-64-3, 5 µm – ok");
        assert_eq!(shown("\x1b[31mred\r\n"), r"\u{1b}[31mred\u{d}\u{a}");
        assert_eq!(shown("a\u{9b}2J\u{202e}b"), r"a\u{9b}2J\u{202e}b");
    }

    #[test]
    fn json_keeps_its_values() {
        let text = "x\u{1b}\u{9b}\u{202e}y";
        let json = shown_json(&serde_json::to_string(text).unwrap());
        assert!(json.is_ascii(), "{json}");
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), text);
    }
}
