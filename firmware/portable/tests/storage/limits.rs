//! Tests the longest records and blobs.

use crate::device::{Action, Device};
use crate::mock::{Cells, Mock, powered};
use hivtac_portable::storage::{Log, PAYLOAD_LIMIT, SaveError};

#[test]
fn the_longest_record_is_kept_and_a_longer_one_refused() {
    let mut cells = Cells::blank(1);
    let mut payload = [0; PAYLOAD_LIMIT];
    let (mut log, _) = Log::open(Mock::new(&mut cells, None), &mut payload);
    let longest = [7; PAYLOAD_LIMIT];
    assert_eq!(powered(log.save(&longest)), Some(Ok(())));
    let longer = [8; PAYLOAD_LIMIT + 1];
    let refused = Some(Err(SaveError::TooLong));
    assert_eq!(powered(log.save(&longer)), refused);
    let (_, length) = Log::open(Mock::new(&mut cells, None), &mut payload);
    assert_eq!((length, payload), (Some(PAYLOAD_LIMIT), longest));
}

/// A record whose seal would lie behind its sector does not count.
#[test]
fn a_record_without_room_for_its_seal_is_not_read() {
    let mut cells = Cells::blank(1);
    let settings = Action::Set(vec![7; 40]);
    let mut device = Device::start(&mut cells, None).unwrap();
    device.act(&settings).unwrap().unwrap();
    let kept = device.kept();
    cells.repeat_at_the_end(2);
    assert_eq!(Device::start(&mut cells, None).unwrap().kept(), kept);
}
