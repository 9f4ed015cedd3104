//! Performs random actions with the power cut at any operation, repeatedly on the same flash.

use proptest::prelude::*;

use crate::device::{Action, Device, Kept};
use crate::mock::{Cells, Cut, EVERY_WAY};

fn any_action() -> impl Strategy<Value = Action> {
    let bytes = |longest| proptest::collection::vec(any::<u8>(), 0..longest);
    prop_oneof![
        4 => bytes(240).prop_map(Action::Set),
        1 => bytes(1_537).prop_map(Action::Update),
        1 => Just(Action::Reset),
    ]
}

fn any_cut() -> impl Strategy<Value = Option<Cut>> {
    let cut = (0_u64..60, proptest::sample::select(&EVERY_WAY[..]))
        .prop_map(|(operation, leaves)| Cut { operation, leaves });
    proptest::option::of(cut)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn each_start_finds_what_was_saved_last_or_was_being_saved(
        seed: u64,
        turns in proptest::collection::vec((any_action(), any_cut()), 1..25),
    ) {
        let mut cells = Cells::blank(seed);
        let mut possible = vec![Kept::default()];
        for (action, cut) in turns {
            let Some(mut device) = Device::start(&mut cells, cut) else {
                continue;
            };
            let found = device.kept();
            prop_assert!(possible.contains(&found), "{found:?} is none of {possible:?}");
            let after = found.after(&action);
            possible = match device.act(&action) {
                Some(result) => {
                    prop_assert_eq!(result, Ok(()));
                    vec![after]
                }
                None => vec![found, after],
            };
        }
    }
}
