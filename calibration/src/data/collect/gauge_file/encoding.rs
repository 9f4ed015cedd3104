//! Decodes a file's bytes to text: UTF-8, or UTF-16 as programs under Windows write it.

/// The text of a file. An invalid character becomes `\u{fffd}`, which makes its line an invalid
/// reading.
pub(super) fn text(bytes: &[u8]) -> String {
    let little = |pair: [u8; 2]| u16::from_le_bytes(pair);
    let big = |pair: [u8; 2]| u16::from_be_bytes(pair);
    match bytes {
        [0xff, 0xfe, rest @ ..] => utf16(rest, little),
        [0xfe, 0xff, rest @ ..] => utf16(rest, big),
        [0xef, 0xbb, 0xbf, rest @ ..] => String::from_utf8_lossy(rest).into_owned(),
        // Digits and separators are ASCII: without a byte order mark, every second byte is 0.
        [a, 0, b, 0, ..] if *a != 0 && *b != 0 => utf16(bytes, little),
        [0, a, 0, b, ..] if *a != 0 && *b != 0 => utf16(bytes, big),
        _ => String::from_utf8_lossy(bytes).into_owned(),
    }
}

fn utf16(bytes: &[u8], unit: impl Fn([u8; 2]) -> u16) -> String {
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    char::decode_utf16(units)
        .map(|character| character.unwrap_or(char::REPLACEMENT_CHARACTER))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_encodings_give_the_same_text() {
        let reported = "t;F [N]\n0,5;\u{2212}0,1\n";
        let little: Vec<u8> = reported.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = reported.encode_utf16().flat_map(u16::to_be_bytes).collect();
        let marked = |mark: &[u8], bytes: &[u8]| [mark, bytes].concat();
        for bytes in [
            reported.as_bytes().to_vec(),
            marked(&[0xef, 0xbb, 0xbf], reported.as_bytes()),
            marked(&[0xff, 0xfe], &little),
            marked(&[0xfe, 0xff], &big),
            little,
            big,
        ] {
            assert_eq!(text(&bytes), reported, "{bytes:?}");
        }
        assert_eq!(text(b"\xb5N"), "\u{fffd}N");
        assert_eq!(text(&[0xff, 0xfe, 0x30]), "");
        assert_eq!(text(&[]), "");
    }
}
