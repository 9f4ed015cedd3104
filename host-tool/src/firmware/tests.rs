//! Tests of an update against a simulated loader.

use super::dfuse::Loader;
use super::simulated::{Device, Fault, Usb, starts};
use super::write::{Progress, write};
use hivtac_host::failure::{Failure, Kind};
use hivtac_wire::image::examples;
use hivtac_wire::image::{FIRST_STAGE, FLASH, Image, PROGRAM, SECTOR_BYTES};
use std::cell::RefCell;
use std::rc::Rc;

const BOARD: &str = "a-board";
/// Two sectors and a part of a third, whose last block is short.
const LENGTH: usize = 2 * SECTOR_BYTES as usize + 1024 + 96;

/// A device with older firmware.
fn device() -> Rc<RefCell<Device>> {
    let mut device = Device::new();
    device.put(&image(BOARD, LENGTH + 4096, 1));
    Rc::new(RefCell::new(device))
}

fn image(board: &str, length: usize, seed: u8) -> Image {
    examples::image(board, "1.1", length, seed)
}

fn newer() -> Image {
    image(BOARD, LENGTH, 2)
}

fn update(device: &Rc<RefCell<Device>>, image: &Image) -> Result<Vec<Progress>, Failure> {
    let loader = Loader::new(Usb::of(device)).map_err(|why| {
        let kind = Kind::Lost;
        Failure::new(kind, why.to_string())
    })?;
    let mut reported = Vec::new();
    write(loader, image, |progress| reported.push(progress))?;
    Ok(reported)
}

#[track_caller]
fn assert_has(device: &Rc<RefCell<Device>>, image: &Image) {
    let device = device.borrow();
    let program = &device.flash[(PROGRAM - FIRST_STAGE) as usize..];
    assert!(program.starts_with(image.program()));
    assert!(device.flash.starts_with(image.first_stage()));
    assert!(starts(&device.flash));
    assert_eq!(device.started, Some(FIRST_STAGE));
    let kept = &device.flash[FLASH.len()..];
    assert!(kept.iter().all(|byte| *byte == 0x4B), "what is kept stays");
}

#[test]
fn only_the_sectors_of_the_program_are_written_and_it_is_started() {
    let device = device();
    let reported = update(&device, &newer()).unwrap();
    assert_has(&device, &newer());
    let sectors = [0, 1, 2].map(|nth| PROGRAM + nth * SECTOR_BYTES);
    assert_eq!(device.borrow().erased, sectors);
    let sector = SECTOR_BYTES as usize;
    let expected = [
        Progress::Written(sector, LENGTH),
        Progress::Written(2 * sector, LENGTH),
        Progress::Written(LENGTH, LENGTH),
        Progress::ReadBack,
    ];
    assert_eq!(reported, expected);
}

#[test]
fn a_device_without_a_first_stage_gets_it_first() {
    let blank = Rc::new(RefCell::new(Device::new()));
    let mut other = Device::new();
    other.flash[..0x2_0000].fill(7);
    let other = Rc::new(RefCell::new(other));
    for device in [blank, other] {
        let reported = update(&device, &newer()).unwrap();
        assert_eq!(reported[0], Progress::FirstStage);
        assert_has(&device, &newer());
        assert_eq!(device.borrow().erased[..2], [FIRST_STAGE, PROGRAM]);
    }
}

#[test]
fn another_board_in_its_loader_is_not_written() {
    let device = device();
    let failure = update(&device, &image("b-board", LENGTH, 2)).unwrap_err();
    assert_eq!(failure.kind, Kind::Input);
    let text = failure.to_string();
    assert!(
        text.contains("a-board") && text.contains("b-board"),
        "{text}"
    );
    assert!(device.borrow().erased.is_empty());
}

#[test]
fn another_chip_is_refused() {
    let device = device();
    for memory in [
        "@Internal Flash   /0x08000000/04*016Kg,01*064Kg,07*128Kg",
        "@Internal Flash   /0x08000000/06*128Kg",
        "@Option Bytes   /0x5200201C/01*88 e",
    ] {
        let refused = Loader::new(Usb::named(&device, memory)).err().unwrap();
        assert!(refused.to_string().contains("STM32H743"), "{refused}");
    }
}

#[test]
fn what_the_loader_refuses_is_reported_with_its_place_and_it_works_again() {
    let sector = PROGRAM + SECTOR_BYTES;
    let faults = [
        (Fault::EraseFails(sector), "erasing at 0x08040000"),
        (Fault::WriteFails(sector + 2048), "writing at 0x08040000"),
        (Fault::KeepsWrong(sector + 5), "the first at 0x08040005"),
    ];
    for (fault, place) in faults {
        let device = device();
        device.borrow_mut().fault = Some(fault);
        let failure = update(&device, &newer()).unwrap_err();
        assert_eq!(failure.kind, Kind::Refused);
        let text = failure.to_string();
        assert!(
            text.contains(place) && text.contains("same command again"),
            "{text}"
        );
        assert_eq!(device.borrow().started, None);
        device.borrow_mut().fault = None;
        update(&device, &newer()).unwrap();
        assert_has(&device, &newer());
    }
}

#[test]
fn an_interrupted_conversation_is_taken_up() {
    for state in [3, 5, 9, 10] {
        let device = device();
        device.borrow_mut().confuse(state);
        update(&device, &newer()).unwrap();
        assert_has(&device, &newer());
    }
}

#[test]
fn a_loader_that_is_silent_while_it_erases_is_waited_for() {
    let device = device();
    device.borrow_mut().fault = Some(Fault::Silent(5));
    update(&device, &newer()).unwrap();
    assert_has(&device, &newer());
}

#[test]
fn a_device_that_goes_at_any_request_is_lost_and_written_by_the_next_attempt() {
    let mut ends = 0;
    for requests in (0..).step_by(41) {
        let device = device();
        device.borrow_mut().fault = Some(Fault::Gone(requests));
        match update(&device, &newer()) {
            Ok(_) => break,
            Err(failure) => assert_eq!(failure.kind, Kind::Lost, "{failure}"),
        }
        ends += 1;
        if device.borrow().started.is_none() {
            device.borrow_mut().restart(None);
            update(&device, &newer()).unwrap();
            assert_has(&device, &newer());
        }
    }
    assert!(ends > 20, "{ends}");
}

/// The first stage starts a whole program: the old program before the first erase, the new one
/// after the last write, and the loader between them.
#[test]
fn a_power_cut_at_any_operation_leaves_a_program_that_starts_or_the_loader() {
    let (mut old, mut none) = (0, 0);
    for operations in (0..).step_by(13) {
        let device = device();
        device.borrow_mut().fault = Some(Fault::Unpowered(operations));
        if update(&device, &newer()).is_ok() {
            break;
        }
        match starts(&device.borrow().flash) {
            true => old += 1,
            false => none += 1,
        }
        device.borrow_mut().restart(None);
        update(&device, &newer()).unwrap();
        assert_has(&device, &newer());
    }
    assert!(old <= 1 && none > 15, "{old} {none}");
}
