//! Tests of the first stage, on images of the flashed ELF as an update writes them: whole, damaged
//! and cut. The loader's stand-in is absent from USB, and starts the flash again after 0.3 s.

use crate::common::{Setup, command, elf, firmware, hello_of, other};
use hivtac_rig::report::Report;
use hivtac_rig::script::Action;
use hivtac_rig::usb_host::Port;
use hivtac_wire::image::header::CRC_AT;
use hivtac_wire::image::{FLASH, HEADER_AT, Image, PROGRAM, SECTOR_BYTES};
use hivtac_wire::message::{Outcome, Request};
use hivtac_wire::version::HelloPrefix;

const BEGIN: usize = (PROGRAM - FLASH.start) as usize;
const HEADER: usize = BEGIN + HEADER_AT as usize;

fn image() -> Image {
    Image::of_elf(&std::fs::read(firmware()).unwrap()).unwrap()
}

/// Returns a run of flash with these bytes, and the folder of its file.
fn of_flash(bytes: &[u8], virtual_ms: u64) -> (Setup, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flash.elf");
    std::fs::write(&path, elf(FLASH.start, bytes)).unwrap();
    (Setup::new(path, virtual_ms), folder)
}

#[test]
fn the_flashed_elf_makes_an_image_that_says_what_it_is() {
    for (elf, board) in [
        (firmware(), "weact-h743"),
        (other("openmv-h7"), "openmv-h7"),
    ] {
        let image = Image::of_elf(&std::fs::read(elf).unwrap()).unwrap();
        assert_eq!(
            (image.board().as_str(), image.version()),
            (board, env!("CARGO_PKG_VERSION"))
        );
        assert!(
            image.first_stage().len() < 1024,
            "{}",
            image.first_stage().len()
        );
        assert!(image.program().len() < 7 * SECTOR_BYTES as usize);
        assert_eq!(Image::of_file(image.bytes()).unwrap(), image);
    }
}

/// Also through its loader: the checksum is right each time.
#[test]
fn a_whole_image_is_started_and_starts_the_loader() {
    const ASKED: u16 = 40;
    let (setup, _folder) = of_flash(image().bytes(), 900);
    let run = setup
        .fault("camera-absent")
        .at(300, Action::Send(command(ASKED, Request::StartLoader)))
        .run();
    assert_eq!(run.outcome(ASKED), Outcome::Done);
    assert_eq!(run.report.resets, 1);
    assert_eq!(run.report.usb.enumerations, 2, "{:?}", run.report.usb_log);
    assert!(run.report.refused.is_empty(), "{:?}", run.report.refused);
}

/// A host of another version cannot send commands, and yet update the firmware.
#[test]
#[ignore = "9 s"]
fn a_hello_of_any_version_starts_the_loader() {
    let wanted = Action::Send(hello_of(HelloPrefix::START_LOADER));
    let other = Action::Send(hello_of(HelloPrefix {
        protocol: u16::MAX,
        schema: 1,
    }));
    let run = |hello: Action| {
        let setup = Setup::new(firmware(), 900).fault("camera-absent");
        setup.at(300, hello).run().report
    };
    let report = run(wanted);
    assert_eq!(
        (report.resets, report.usb.enumerations),
        (1, 2),
        "{:?}",
        report.usb_log
    );
    let report = run(other);
    assert_eq!(
        (report.resets, report.usb.enumerations),
        (0, 1),
        "{:?}",
        report.usb_log
    );
}

/// Runs flash with these bytes.
fn report(bytes: &[u8]) -> Report {
    let (setup, folder) = of_flash(bytes, 600);
    let outcome = setup.try_run(&folder.path().join("truth"));
    outcome.unwrap().report
}

#[test]
fn what_is_damaged_or_cut_is_not_started_and_the_loader_is() {
    let whole = image();
    let changed = |at: usize, byte: u8| {
        let mut bytes = whole.bytes().to_vec();
        assert_ne!(bytes[at], byte);
        bytes[at] = byte;
        bytes
    };
    let last = whole.bytes().len() - 33;
    let flipped = whole.bytes()[last] ^ 0x80;
    let mut blank = whole.bytes().to_vec();
    blank[BEGIN..][..SECTOR_BYTES as usize].fill(0xFF);
    let mut half = whole.bytes().to_vec();
    half[BEGIN + 2 * SECTOR_BYTES as usize..].fill(0xFF);
    let crc = BEGIN + CRC_AT as usize;
    let cases = [
        ("a bit of its data", changed(last, flipped)),
        ("its checksum", changed(crc, whole.bytes()[crc] ^ 1)),
        ("its length", changed(HEADER + 82, 0xFF)),
        ("its layout", changed(HEADER + 8, 2)),
        ("its chip", changed(HEADER + 12, 0x51)),
        ("its mark", changed(HEADER, 0)),
        ("its first sector is blank", blank),
        ("its end was not written", half),
    ];
    for (what, bytes) in cases {
        let report = report(&bytes);
        let seen = (report.port, report.exposures, report.resets);
        assert_eq!(seen, (Port::Empty, 0, 0), "{what}: {:?}", report.usb_log);
        assert!(report.refused.is_empty(), "{what}: {:?}", report.refused);
    }
}
