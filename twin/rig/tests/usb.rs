//! Tests of control transfers of any kind: the device answers, stalls unknown ones, and goes on.
//! `usb_dead.rs` has faults that may stop USB.

use crate::common::{Run, Setup, firmware};
use hivtac_rig::script::Action;

/// Returns the result of a control transfer from the host's log.
fn outcome(run: &Run, setup: [u8; 8]) -> String {
    let title = format!(
        "control {}",
        setup.map(|byte| format!("{byte:02x}")).join(" ")
    );
    let line = run.report.usb_log.iter().find(|line| line.contains(&title));
    let line = line.unwrap_or_else(|| panic!("{title} is not in {:#?}", run.report.usb_log));
    line.rsplit_once(": ").unwrap().1.to_owned()
}

fn with_requests(setups: &[[u8; 8]]) -> Run {
    let mut setup = Setup::new(firmware(), 320);
    for (at, bytes) in (220..).zip(setups) {
        setup = setup.at(at, Action::Request(*bytes));
    }
    setup.run()
}

/// Asserts that the samples go on to the end without a gap or a reset.
fn goes_on(run: &Run) {
    assert_eq!((run.report.resets, run.rejected.frames()), (0, 0));
    assert!(run.missing_frames().is_empty());
    let sequence: Vec<u32> = run.samples().iter().map(|sample| sample.sequence).collect();
    assert!(sequence.len() > 10, "{sequence:?}");
    assert!(
        sequence.windows(2).all(|pair| pair[1] == pair[0] + 1),
        "{sequence:?}"
    );
    assert_eq!(run.stats().usb_dropped, 0);
}

/// GET_STATUS, CLEAR_FEATURE and SET_FEATURE of endpoints 1 to 15 in both directions.
#[test]
fn requests_about_endpoints_that_do_not_exist_are_stalled() {
    let endpoints = [0x05, 0x09, 0x0f, 0x85, 0x89, 0x8f];
    let of = |endpoint: u8| {
        [
            [0x82, 0, 0, 0, endpoint, 0, 2, 0],
            [0x02, 1, 0, 0, endpoint, 0, 0, 0],
            [0x02, 3, 0, 0, endpoint, 0, 0, 0],
        ]
    };
    let setups: Vec<[u8; 8]> = endpoints.into_iter().flat_map(of).collect();
    let run = with_requests(&setups);
    for setup in setups {
        assert_eq!(outcome(&run, setup), "stalled");
    }
    goes_on(&run);
}

/// A device without high speed stalls a request for its qualifier (USB 2.0, section 9.6.2); Linux
/// warns of a slow port otherwise. Data before a stall are not part of the next transfer: 64 bytes
/// of a request that is too long are not the line coding.
#[test]
fn a_refused_request_leaves_nothing_behind() {
    let qualifier = [0x80, 6, 0, 6, 0, 0, 10, 0];
    let too_long = [0x21, 0x20, 0, 0, 0, 0, 0xFF, 0];
    let line_coding = [0x21, 0x20, 0, 0, 0, 0, 7, 0];
    let run = with_requests(&[qualifier, too_long, line_coding]);
    assert_eq!(outcome(&run, qualifier), "stalled");
    assert_eq!(outcome(&run, too_long), "stalled");
    assert_eq!(outcome(&run, line_coding), "0 bytes");
    goes_on(&run);
}

#[test]
fn the_status_of_an_endpoint_that_exists_is_reported() {
    let setups = [
        [0x82, 0, 0, 0, 0x00, 0, 2, 0],
        [0x82, 0, 0, 0, 0x80, 0, 2, 0],
    ];
    let run = with_requests(&setups);
    for setup in setups {
        assert_eq!(outcome(&run, setup), "2 bytes");
    }
    goes_on(&run);
}

/// CLEAR_FEATURE and SET_CONFIGURATION restart toggles at DATA0 on both sides, with or without a
/// halt. Each request is sent at several times, to cover both toggles before it.
#[test]
fn toggles_begin_anew_where_the_standard_says_so() {
    let clear = |endpoint| [0x02, 1, 0, 0, endpoint, 0, 0, 0];
    let setups: Vec<_> = (1..=4)
        .flat_map(|number| [clear(0x80 | number), clear(number)])
        .collect();
    let run = with_requests(&setups.repeat(4));
    let done = |setup: &&[u8; 8]| outcome(&run, **setup) == "0 bytes";
    assert!(
        setups.iter().filter(done).count() >= 3,
        "{:#?}",
        run.report.usb_log
    );
    assert_eq!(run.report.usb.repeated_packets, 0);
    goes_on(&run);
}
