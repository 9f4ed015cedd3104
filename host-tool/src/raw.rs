//! Frames in files, as the camera sent them: PAM (`P7` of Netpbm) with two bytes a pixel. The
//! project's own tuple types keep size and pixel format with the bytes.

use crate::frame::Frame;
use hivtac_terms::threshold::PixelFormat;

/// The first bytes of every PAM.
const MAGIC: &[u8] = b"P7\n";
/// The line of the tuple type lies within this number of bytes.
const HEADER_AT_MOST: usize = 256;

/// The tuple type of each pixel format. RGB565: the high byte first; YUV422: Y0 Cb Y1 Cr.
const TUPLE_TYPES: [(PixelFormat, &str); 2] = [
    (PixelFormat::Rgb565, "RGB565"),
    (PixelFormat::Yuv422, "YUYV"),
];

/// Bytes a pixel.
const DEPTH: usize = 2;

/// A frame read from a file.
pub struct Raw<'b> {
    /// Columns, px.
    pub width: u16,
    /// Rows, px.
    pub height: u16,
    /// Its pixel format.
    pub format: PixelFormat,
    /// All rows from the top.
    pub bytes: &'b [u8],
}

/// A frame as the bytes of a file; `None` for a pixel format without a tuple type.
pub fn of(frame: &Frame) -> Option<Vec<u8>> {
    let known = TUPLE_TYPES
        .iter()
        .find(|(format, _)| *format == frame.format());
    let (_, name) = known?;
    let header = format!(
        "P7\nWIDTH {}\nHEIGHT {}\nDEPTH {DEPTH}\nMAXVAL 255\nTUPLTYPE {name}\nENDHDR\n",
        frame.width, frame.height
    );
    Some([header.as_bytes(), &frame.bytes].concat())
}

/// Whether a file is such a frame; any other PAM is an ordinary picture.
pub fn is_one(file: &[u8]) -> bool {
    let header = &file[..file.len().min(HEADER_AT_MOST)];
    let has = |line: &str| {
        header
            .windows(line.len())
            .any(|bytes| bytes == line.as_bytes())
    };
    let mut names = TUPLE_TYPES.iter().map(|(_, name)| name);
    header.starts_with(MAGIC) && names.any(|name| has(&format!("\nTUPLTYPE {name}\n")))
}

/// Reads the bytes of such a file.
///
/// # Errors
/// The text says which part of the file is invalid.
pub fn parse(file: &[u8]) -> Result<Raw<'_>, String> {
    const END: &[u8] = b"\nENDHDR\n";
    let end = file.windows(END.len()).position(|bytes| bytes == END);
    let end = end.ok_or("its header has no end (ENDHDR)")?;
    let header = str::from_utf8(&file[..end]).map_err(|_| "its header is no text")?;
    let number = |name: &str| -> Result<u16, String> {
        let value = value_of(header, name)?;
        let wrong = |_| format!("{name} is {value}, no number up to 65,535");
        value.parse().map_err(wrong)
    };
    let tuple_type = value_of(header, "TUPLTYPE")?;
    let known = TUPLE_TYPES.iter().find(|(_, name)| *name == tuple_type);
    let (format, _) = known.ok_or_else(|| {
        let names = TUPLE_TYPES.map(|(_, name)| name).join(" or ");
        format!("its TUPLTYPE is {tuple_type}; frames of the sensor are {names}")
    })?;
    if (usize::from(number("DEPTH")?), number("MAXVAL")?) != (DEPTH, 255) {
        return Err(format!("a frame has DEPTH {DEPTH} and MAXVAL 255"));
    }
    let (width, height) = (number("WIDTH")?, number("HEIGHT")?);
    let bytes = &file[end + END.len()..];
    let expected = DEPTH * usize::from(width) * usize::from(height);
    if bytes.len() != expected {
        return Err(format!(
            "it has {} bytes of pixels, not {expected}",
            bytes.len()
        ));
    }
    Ok(Raw {
        width,
        height,
        format: *format,
        bytes,
    })
}

/// The value behind a name in the header.
fn value_of<'h>(header: &'h str, name: &str) -> Result<&'h str, String> {
    let value = |line: &'h str| line.strip_prefix(name)?.strip_prefix(' ');
    let found = header.lines().find_map(value);
    found.ok_or_else(|| format!("its header has no {name}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::threshold::Yuv422;
    use hivtac_terms::threshold::{HsvBox, Threshold};

    fn frame(threshold: Threshold) -> Frame {
        Frame {
            number: 1,
            time_us: 2,
            width: 4,
            height: 2,
            threshold,
            bytes: (0..16).collect(),
        }
    }

    #[test]
    fn frames_come_back_from_their_files() {
        for threshold in [
            Threshold::Rgb565(HsvBox::RED),
            Threshold::Yuv422(Yuv422::RED),
        ] {
            let frame = frame(threshold);
            let file = of(&frame).unwrap();
            assert!(is_one(&file));
            let raw = parse(&file).unwrap();
            assert_eq!((raw.width, raw.height), (4, 2));
            assert_eq!(raw.format, threshold.format());
            assert_eq!(raw.bytes, frame.bytes);
        }
    }

    #[test]
    fn what_is_wrong_with_a_file_is_named() {
        let good = String::from_utf8(of(&frame(HsvBox::RED.into())).unwrap()).unwrap();
        for (from, to, word) in [
            ("ENDHDR", "END", "no end"),
            ("WIDTH 4", "WIDTH 5", "16 bytes of pixels, not 20"),
            ("WIDTH 4", "WIDTH 70000", "70000"),
            ("HEIGHT 2\n", "", "no HEIGHT"),
            ("RGB565", "RGB_ALPHA", "RGB_ALPHA"),
            ("DEPTH 2", "DEPTH 3", "DEPTH 2"),
        ] {
            let error = parse(good.replace(from, to).as_bytes()).err().unwrap();
            assert!(error.contains(word), "{error}");
        }
    }

    #[test]
    fn other_files_are_none() {
        assert!(!is_one(b"P7\nWIDTH 1\nHEIGHT 1\nTUPLTYPE RGB\nENDHDR\n"));
        assert!(!is_one(b"P6\nTUPLTYPE RGB565\n"));
        assert!(!is_one(b""));
    }

    /// The reader accepts or refuses any file, and never panics.
    #[test]
    fn no_header_breaks_the_reader() {
        let good = of(&frame(HsvBox::RED.into())).unwrap();
        for length in 0..good.len() {
            assert!(parse(&good[..length]).is_err());
        }
        for position in 0..good.len() {
            for byte in [0, b'\n', b'9', 0xFF] {
                let mut file = good.clone();
                file[position] = byte;
                let _ = parse(&file);
            }
        }
    }
}
