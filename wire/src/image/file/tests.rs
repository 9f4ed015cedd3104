use super::*;
use crate::image::examples;
use proptest::prelude::*;

/// A first stage of 200 bytes and a program of 0x600 bytes, as an ELF loads them.
fn parts() -> [(u32, Vec<u8>); 2] {
    let mut bytes = loaded_example();
    let program = bytes.split_off(BEGIN);
    bytes.truncate(200);
    [(FIRST_STAGE, bytes), (PROGRAM, program)]
}

fn loaded_example() -> Vec<u8> {
    examples::loaded("a-board", "1.2.3", 0x600, 7)
}

/// The smallest ELF that loads these parts.
fn elf(parts: &[(u32, Vec<u8>)]) -> Vec<u8> {
    let mut file = b"\x7fELF\x01\x01\x01".to_vec();
    file.resize(16, 0);
    let half = |file: &mut Vec<u8>, value: u16| file.extend(value.to_le_bytes());
    let full = |file: &mut Vec<u8>, value: u32| file.extend(value.to_le_bytes());
    half(&mut file, 2);
    half(&mut file, 40);
    for value in [1, PROGRAM, 52, 0, 0] {
        full(&mut file, value);
    }
    for value in [52, 32, parts.len() as u16, 40, 0, 0] {
        half(&mut file, value);
    }
    let mut at = 52 + 32 * parts.len() as u32;
    for (address, bytes) in parts {
        let size = bytes.len() as u32;
        for value in [1, at, *address, *address, size, size, 5, 4] {
            full(&mut file, value);
        }
        at += size;
    }
    file.extend(parts.iter().flat_map(|(_, bytes)| bytes));
    file
}

fn image() -> Vec<u8> {
    Image::of_file(&elf(&parts())).unwrap().bytes().to_vec()
}

#[test]
fn the_image_of_an_elf_is_whole_and_says_what_it_is_for() {
    let image = Image::of_file(&elf(&parts())).unwrap();
    assert_eq!(
        (image.board().as_str(), image.version()),
        ("a-board", "1.2.3")
    );
    let [(_, first_stage), (_, program)] = parts();
    assert_eq!(image.first_stage()[..200], first_stage);
    assert_eq!(image.first_stage().len(), 224);
    assert_eq!(image.program().len(), program.len());
    assert_eq!(image.program()[..0x450], program[..0x450]);
    assert_eq!(Image::of_file(image.bytes()).unwrap(), image);
    assert_eq!(examples::image("a-board", "1.2.3", 0x600, 7), image);
    assert_eq!(board_of(image.first_stage()).as_deref(), Some("a-board"));
    assert_eq!(version_of(image.program()).as_deref(), Some("1.2.3"));
    assert_eq!(image.fits("a-board"), Ok(()));
    let other = image.fits("b-board").unwrap_err().to_string();
    assert!(other.contains("a-board") && other.contains("b-board"));
}

#[test]
fn the_order_of_an_elf_does_not_matter() {
    let [first, second] = parts();
    assert_eq!(
        Image::of_file(&elf(&[second, first])).unwrap().bytes(),
        image()
    );
}

#[test]
fn what_is_for_something_else_is_refused() {
    let changed = |at: usize, value: u32| {
        let mut image = image();
        put(&mut image, at, value);
        Image::of_file(&image).unwrap_err()
    };
    for at in [MARK_AT as usize, HEADER] {
        assert_eq!(changed(at + 8, 9), Refusal::OtherLayout(9));
        assert_eq!(changed(at + 12, 0x483), Refusal::OtherChip(0x483));
        assert_eq!(changed(at, 0), Refusal::NoImage);
    }
    for file in [&b""[..], b"text", &[0xFF; 4096], &[0; 0x3_0000]] {
        assert_eq!(Image::of_file(file), Err(Refusal::NoImage));
    }
}

#[test]
fn an_elf_that_is_no_firmware_is_refused() {
    let cut = &elf(&parts())[..500];
    assert!(matches!(Image::of_file(cut), Err(Refusal::BadElf(_))));
    let cut = Image::of_file(b"\x7fELF and more");
    assert!(matches!(cut, Err(Refusal::BadElf(_))));
    let [first_stage, (_, program)] = parts();
    for outside in [FLASH.end, FLASH.end - 4, 0x2000_0000] {
        let elf = elf(&[first_stage.clone(), (outside, program.clone())]);
        assert_eq!(Image::of_file(&elf), Err(Refusal::Outside(outside)));
    }
    let without = [
        vec![first_stage.clone()],
        vec![(PROGRAM, program.clone())],
        vec![first_stage, (PROGRAM, program[..0x440].to_vec())],
        vec![],
    ];
    for parts in without {
        assert_eq!(Image::of_file(&elf(&parts)), Err(Refusal::NoImage));
    }
}

#[test]
fn what_objcopy_makes_is_refused_with_advice() {
    let refusal = Image::of_file(&loaded_example()).unwrap_err();
    assert_eq!(refusal, Refusal::Unsealed);
    assert!(refusal.to_string().contains("the ELF itself"));
}

#[test]
fn damage_tells_its_part() {
    let of = |at: usize| {
        let mut image = image();
        image[at] ^= 1;
        Image::of_file(&image).unwrap_err().to_string()
    };
    assert!(of(150).contains("first stage"));
    assert!(of(HEADER + 200).contains("program"));
    assert!(of(HEADER + 48).contains("program"), "the version counts");
}

proptest! {
    #[test]
    fn no_bit_may_be_wrong(bit in 0..8 * (BEGIN + 0x600)) {
        let mut image = image();
        image[bit / 8] ^= 1 << (bit % 8);
        prop_assert!(Image::of_file(&image).is_err());
    }

    #[test]
    fn no_byte_may_be_missing_or_too_many(length in 0..BEGIN + 0x700) {
        let mut image = image();
        let whole = image.len();
        image.resize(length, 0xFF);
        prop_assert_eq!(Image::of_file(&image).is_ok(), length == whole);
    }

    #[test]
    fn nothing_at_all_panics(bytes in proptest::collection::vec(any::<u8>(), 0..3000), elf in any::<bool>()) {
        let mut file = if elf { b"\x7fELF\x01\x01\x01".to_vec() } else { Vec::new() };
        file.extend(bytes);
        prop_assert!(Image::of_file(&file).is_err());
    }

    #[test]
    fn no_changed_elf_panics(at in 0..116_usize, byte in any::<u8>()) {
        let mut file = elf(&parts());
        file[at] = byte;
        let _ = Image::of_file(&file);
    }
}
