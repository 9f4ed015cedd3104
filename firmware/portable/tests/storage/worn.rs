//! Tests words that can no longer be programmed, and how evenly the flash wears.

use crate::device::{Action, Device, Kept};
use crate::mock::{Cells, SECTOR_WORDS};
use hivtac_portable::storage::SaveError;

#[test]
fn bad_words_are_passed_over_and_counted() {
    let mut cells = Cells::blank(1);
    cells.worn = vec![1, 5, 11, SECTOR_WORDS + 2];
    let mut device = Device::start(&mut cells, None).unwrap();
    let mut kept = Kept::default();
    for save in 0..40 {
        let action = Action::Set(vec![save; 20]);
        device.act(&action).unwrap().unwrap();
        kept = kept.after(&action);
        assert_eq!(device.kept(), kept);
    }
    assert!(device.failures() >= 3, "{}", device.failures());
    assert_eq!(Device::start(&mut cells, None).unwrap().kept(), kept);
}

#[test]
fn words_that_read_back_otherwise_are_passed_over_and_counted() {
    let mut cells = Cells::blank(1);
    cells.faint = vec![1];
    let mut device = Device::start(&mut cells, None).unwrap();
    let action = Action::Set(vec![7; 40]);
    device.act(&action).unwrap().unwrap();
    assert_eq!(device.failures(), 1);
    let kept = Kept::default().after(&action);
    assert_eq!(Device::start(&mut cells, None).unwrap().kept(), kept);
    // The second word of each attempt: two words, and one for a seal.
    cells.faint = (4..2 * SECTOR_WORDS).collect();
    cells.faint.retain(|word| word % 3 == 1);
    let mut device = Device::start(&mut cells, None).unwrap();
    let refused = device.act(&Action::Set(vec![8; 40])).unwrap();
    assert_eq!(refused, Err(SaveError::Worn));
    assert_eq!(Device::start(&mut cells, None).unwrap().kept(), kept);
}

#[test]
fn words_that_stay_blank_hide_nothing_behind_them() {
    for (deaf, saves) in [(2..8, 2), (2..16, 2), (2..14, 4), (0..12, 5)] {
        let mut cells = Cells::blank(1);
        let mut kept = Kept::default();
        for save in 0..saves {
            cells.deaf = if save > 0 {
                deaf.clone().collect()
            } else {
                vec![]
            };
            let action = Action::Set(vec![save; 20]);
            let mut device = Device::start(&mut cells, None).unwrap();
            device.act(&action).unwrap().unwrap();
            kept = kept.after(&action);
            assert_eq!(Device::start(&mut cells, None).unwrap().kept(), kept);
        }
    }
}

#[test]
fn flash_that_is_worn_out_says_so_and_keeps_what_it_has() {
    let mut cells = Cells::blank(1);
    let settings = Action::Set(b"last".to_vec());
    let mut device = Device::start(&mut cells, None).unwrap();
    device.act(&settings).unwrap().unwrap();
    let kept = device.kept();
    cells.worn = (0..2 * SECTOR_WORDS).collect();
    for _ in 0..10 {
        let mut device = Device::start(&mut cells, None).unwrap();
        let refused = device.act(&Action::Set(b"more".to_vec())).unwrap();
        assert_eq!(refused, Err(SaveError::Worn));
        assert_eq!(Device::start(&mut cells, None).unwrap().kept(), kept);
    }
}

#[test]
fn a_model_in_worn_flash_is_refused_and_the_one_before_stays() {
    let mut cells = Cells::blank(1);
    let mut device = Device::start(&mut cells, None).unwrap();
    device.act(&Action::Update(vec![7; 100])).unwrap().unwrap();
    let kept = device.kept();
    // The last word of the other slot that the next one needs.
    cells.worn = vec![4 * SECTOR_WORDS + 3];
    let mut device = Device::start(&mut cells, None).unwrap();
    assert!(device.act(&Action::Update(vec![8; 128])).unwrap().is_err());
    assert_eq!(device.failures(), 1);
    assert_eq!(device.kept(), kept);
    assert_eq!(Device::start(&mut cells, None).unwrap().kept(), kept);
}

/// Each write wears it, and a start needs none after a save that was not cut.
#[test]
fn a_start_writes_nothing() {
    let mut cells = Cells::blank(1);
    for save in 0..30 {
        let mut device = Device::start(&mut cells, None).unwrap();
        device.act(&Action::Set(vec![save; 20])).unwrap().unwrap();
        let operations = cells.operations;
        Device::start(&mut cells, None).unwrap();
        assert_eq!(cells.operations, operations, "save {save}");
    }
}

#[test]
fn both_sectors_wear_alike() {
    let mut cells = Cells::blank(1);
    let mut device = Device::start(&mut cells, None).unwrap();
    for save in 0..1000_u32 {
        let action = Action::Set(save.to_le_bytes().to_vec());
        device.act(&action).unwrap().unwrap();
    }
    let reported = device.erases();
    let [first, second, ..] = cells.erases;
    assert!(first.abs_diff(second) <= 1, "{:?}", cells.erases);
    // Two words for each record and its seal: twelve of them a sector.
    assert_eq!(first + second, 1000_u32.div_ceil(12));
    assert_eq!(reported, first + second);
}
