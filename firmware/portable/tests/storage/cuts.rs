//! Cuts the power at every operation of every action, in every way, and after each cut again at
//! every operation of the next start.

use crate::device::{Action, Device, Kept};
use crate::mock::{Cells, Cut, EVERY_WAY, Leaves, SECTOR_WORDS};
use hivtac_portable::storage::flash::WORD_BYTES;

/// A device with a history: settings saved `saves` times, and two models.
fn used(saves: u8) -> (Cells, Kept) {
    let mut cells = Cells::blank(u64::from(saves));
    let mut device = Device::start(&mut cells, None).unwrap();
    let mut kept = Kept::default();
    let mut act = |action: Action| {
        device.act(&action).unwrap().unwrap();
        kept = kept.after(&action);
    };
    act(Action::Update(vec![1; 300]));
    act(Action::Update(vec![2; 450]));
    for save in 0..saves {
        act(Action::Set(vec![save; 40]));
    }
    (cells, kept)
}

/// Performs an action with the power cut at an operation; returns whether the cut happened.
fn cut_at(cells: &mut Cells, action: &Action, operation: u64, leaves: Leaves) -> bool {
    let cut = Cut { operation, leaves };
    Device::start(cells, Some(cut)).is_none_or(|mut device| device.act(action).is_none())
}

/// Returns the device's data after a restart. The power is cut once more at every operation of that
/// restart, and then the device is restarted without cuts: the data is always the same.
fn started_again(cells: &Cells, leaves: Leaves) -> Kept {
    let mut peaceful = cells.clone();
    let kept = Device::start(&mut peaceful, None).unwrap().kept();
    for _ in 0..4 {
        let again = Device::start(&mut peaceful, None).unwrap().kept();
        assert_eq!(again, kept, "it stays as it was found");
    }
    for operation in 0.. {
        let mut cells = cells.clone();
        let cut = Cut { operation, leaves };
        if Device::start(&mut cells, Some(cut)).is_some() {
            break;
        }
        for _ in 0..3 {
            let mut device = Device::start(&mut cells, None).unwrap();
            device.kept();
        }
    }
    kept
}

fn every_cut_keeps_the_old_or_the_new(action: &Action) -> u64 {
    let mut cuts = 0;
    // For one of these numbers the log's sector is full.
    for saves in 0..12 {
        let (before, old) = used(saves);
        let new = old.after(action);
        for leaves in EVERY_WAY {
            for operation in 0.. {
                let mut cells = before.clone();
                if !cut_at(&mut cells, action, operation, leaves) {
                    assert_eq!(Device::start(&mut cells, None).unwrap().kept(), new);
                    break;
                }
                cuts += 1;
                let kept = started_again(&cells, leaves);
                assert!(
                    kept == old || kept == new,
                    "{action:?} after {saves} saves, cut at {operation} ({leaves:?}): {kept:?}"
                );
                // The device still works.
                let next = Action::Set(b"next".to_vec());
                let mut device = Device::start(&mut cells, None).unwrap();
                let kept = device.kept();
                device.act(&next).unwrap().unwrap();
                let found = Device::start(&mut cells, None).unwrap().kept();
                assert_eq!(found, kept.after(&next));
            }
        }
    }
    println!("{cuts} cuts");
    cuts
}

#[test]
fn settings_are_the_old_or_the_new() {
    let cuts = every_cut_keeps_the_old_or_the_new(&Action::Set(b"a new name".to_vec()));
    assert!(cuts >= 120, "{cuts}");
}

#[test]
fn a_model_is_the_old_or_the_new() {
    let cuts = every_cut_keeps_the_old_or_the_new(&Action::Update(vec![3; 500]));
    assert!(cuts >= 1000, "{cuts}");
}

/// The second sector of a slot holds the end of a model of eight dots.
#[test]
fn a_model_of_two_sectors_is_the_old_or_the_new() {
    let bytes = (0..40 * WORD_BYTES).map(|byte| byte as u8);
    let cuts = every_cut_keeps_the_old_or_the_new(&Action::Update(bytes.collect()));
    assert!(cuts >= 2000, "{cuts}");
}

#[test]
fn a_model_longer_than_its_sectors_is_refused_and_the_one_before_stays() {
    let (mut cells, kept) = used(1);
    let bytes = vec![3; 2 * SECTOR_WORDS as usize * WORD_BYTES + 1];
    let mut device = Device::start(&mut cells, None).unwrap();
    assert!(device.act(&Action::Update(bytes)).unwrap().is_err());
    assert_eq!(Device::start(&mut cells, None).unwrap().kept(), kept);
}

#[test]
fn a_factory_reset_is_done_or_not() {
    let cuts = every_cut_keeps_the_old_or_the_new(&Action::Reset);
    assert!(cuts >= 100, "{cuts}");
}

#[test]
fn the_first_save_on_a_new_chip_is_done_or_not() {
    let action = Action::Set(b"first".to_vec());
    for leaves in EVERY_WAY {
        for operation in 0.. {
            let mut cells = Cells::blank(operation);
            if !cut_at(&mut cells, &action, operation, leaves) {
                break;
            }
            let kept = started_again(&cells, leaves);
            let new = Kept::default().after(&action);
            assert!(kept == Kept::default() || kept == new, "{kept:?}");
        }
    }
}
