//! Tests of faults that may stop USB: cut transfers, packets that no host fetches, hosts that
//! pause. Without a camera the core sleeps, and virtual time costs little.

use crate::common::{Run, Setup, command, firmware, hello};
use hivtac_rig::script::Action;
use hivtac_wire::message::Request;

/// Largest age of a sample that a host gets after a pause, s.
const OLDEST_S: f64 = 0.2;

fn without_camera(virtual_ms: u64) -> Setup {
    Setup::new(firmware(), virtual_ms).fault("camera-absent")
}

/// The device's answers to hellos; the run's end asks for one more.
fn greetings(run: &Run) -> usize {
    run.hellos().len() - 1
}

/// Requests that are cut: one that reads, one that writes, and one without data.
const CUT: [[u8; 8]; 3] = [
    [0x80, 6, 0, 1, 0, 0, 18, 0],
    [0x21, 0x20, 0, 0, 0, 0, 7, 0],
    [0x21, 0x22, 3, 0, 0, 0, 0, 0],
];
/// A transfer takes four to six transactions of 53 µs: cuts lie this far apart.
const STEP_US: u64 = 21;
const STEPS: u64 = 18;
const CUTS: u64 = CUT.len() as u64 * STEPS;

/// Begins a control transfer at a fixed interval, ms, each cut off a step later by the action that
/// `cut` adds at a time in µs; then says hello.
fn cut(period_ms: u64, cut: impl Fn(Setup, u64) -> Setup) -> Run {
    let end_ms = 200 + CUTS * period_ms;
    let mut setup = without_camera(end_ms + 20);
    for nth in 0..CUTS {
        let at_us = 1000 * (200 + nth * period_ms);
        setup = setup.at_us(at_us, Action::Request(CUT[(nth / STEPS) as usize]));
        setup = cut(setup, at_us + STEP_US * (nth % STEPS));
    }
    setup.at(end_ms, Action::Send(hello())).run()
}

/// The bus is reset at any time of a control transfer, to the microsecond: the device is enumerated
/// again each time.
#[test]
fn a_reset_in_a_control_transfer_is_served() {
    let run = cut(30, |setup, cut_us| setup.at_us(cut_us, Action::Reset));
    let log = &run.report.usb_log;
    assert_eq!(run.report.usb.enumerations, 1 + CUTS, "{log:#?}");
    assert_eq!((run.report.usb.failed_transfers, greetings(&run)), (0, 2));
}

/// A host gives transfers up and begins others: each of the others succeeds.
#[test]
fn another_setup_ends_a_control_transfer() {
    let run = cut(2, |setup, cut_us| {
        let another = Action::Request([0x82, 0, 0, 0, 0x80, 0, 2, 0]);
        setup.at_us(cut_us, Action::Cancel).at_us(cut_us, another)
    });
    let log = &run.report.usb_log;
    let answered = log.iter().filter(|line| line.ends_with("2 bytes")).count();
    assert_eq!(
        (answered as u64, run.report.usb.failed_transfers),
        (CUTS, 0),
        "{log:#?}"
    );
    assert_eq!(greetings(&run), 2);
}

/// A suspend that the core reports late, together with the end of a reset, does not count.
#[test]
fn a_stale_suspend_does_not_make_it_deaf() {
    let run = without_camera(220).fault("usb-stale-suspend").run();
    assert_eq!((run.report.usb.enumerations, greetings(&run)), (1, 1));
}

/// The core sends nothing more, whatever is done to its endpoints. A hello without an answer makes
/// the device connect again, once.
#[test]
fn a_hello_without_an_answer_makes_it_connect_again() {
    let run = without_camera(3300)
        .fault("usb-stuck@300")
        .at(400, Action::Send(hello()))
        .at(2900, Action::Send(hello()))
        .run();
    let log = &run.report.usb_log;
    assert_eq!(
        (run.report.usb.enumerations, greetings(&run)),
        (2, 2),
        "{log:#?}"
    );
    assert_eq!(run.report.resets, 0);
}

/// Samples come between a start and the next hello or stop, and at no other time.
#[test]
fn a_hello_or_a_stop_ends_the_samples() {
    let run = Setup::new(firmware(), 420)
        .at(240, Action::Send(hello()))
        .at(300, Action::Send(command(7, Request::Start)))
        .at(360, Action::Send(command(8, Request::Stop)))
        .run();
    for (from_s, until_s, flows) in [(0.2, 0.24, true), (0.25, 0.3, false), (0.32, 0.36, true)] {
        assert_eq!(arrivals(&run, from_s, until_s) > 0, flows, "{from_s} s");
    }
    assert_eq!(arrivals(&run, 0.37, 1.0), 0, "after the stop");
}

/// Times of all arrivals between two times, s.
fn arrivals(run: &Run, from_s: f64, until_s: f64) -> usize {
    let times = run
        .arrivals
        .iter()
        .map(|line| line["time_s"].as_f64().unwrap());
    times
        .filter(|time| (from_s..until_s).contains(time))
        .count()
}

/// Asserts that no sample came that was older than [`OLDEST_S`].
fn all_new(run: &Run) {
    let oldest = run.latencies().into_values().fold(0.0, f64::max);
    assert!(oldest < OLDEST_S, "{oldest} s");
}

/// A packet that nobody fetches outlives whatever a host does to the bus or the endpoint, but
/// samples flow again.
#[test]
fn a_packet_that_waits_does_not_block_what_follows() {
    const CASES: [(&str, &[[u8; 8]]); 4] = [
        ("SET_CONFIGURATION again", &[[0, 9, 1, 0, 0, 0, 0, 0]]),
        ("SET_INTERFACE", &[[1, 11, 0, 0, 1, 0, 0, 0]]),
        (
            "halt",
            &[[2, 3, 0, 0, 0x82, 0, 0, 0], [2, 1, 0, 0, 0x82, 0, 0, 0]],
        ),
        (
            "unconfigured",
            &[[0, 9, 0, 0, 0, 0, 0, 0], [0, 9, 1, 0, 0, 0, 0, 0]],
        ),
    ];
    const PERIOD_MS: u64 = 60;
    let begin = |setup: Setup, at_ms: u64| {
        setup
            .at(at_ms, Action::Send(hello()))
            .at(at_ms + 1, Action::Send(command(7, Request::Start)))
    };
    let at = |nth: usize| 200 + nth as u64 * PERIOD_MS;
    let reset_ms = at(CASES.len());
    let mut setup = Setup::new(firmware(), reset_ms + 110);
    for (nth, (_, requests)) in CASES.iter().enumerate() {
        setup = setup.at(at(nth), Action::StopReading);
        for request in *requests {
            setup = setup.at(at(nth) + 20, Action::Request(*request));
        }
        setup = begin(setup.at(at(nth) + 22, Action::Read), at(nth) + 25);
    }
    let run = begin(
        setup
            .at(reset_ms, Action::StopReading)
            .at(reset_ms + 20, Action::Reset)
            .at(reset_ms + 22, Action::Read),
        reset_ms + 60,
    )
    .run();
    let log = &run.report.usb_log;
    for (nth, (what, _)) in CASES.iter().enumerate() {
        let (from, until) = (at(nth) + 30, at(nth) + PERIOD_MS);
        let came = arrivals(&run, from as f64 * 1e-3, until as f64 * 1e-3);
        assert!(came >= 3, "{what}: {came} {log:#?}");
    }
    let from_s = (reset_ms + 65) as f64 * 1e-3;
    let came = arrivals(&run, from_s, f64::INFINITY);
    assert!(came >= 4, "reset: {came} {log:#?}");
    assert_eq!((run.report.resets, run.report.usb.failed_transfers), (0, 0));
    assert_eq!(
        run.report.usb.repeated_packets, 0,
        "both sides begin with DATA0"
    );
    all_new(&run);
}

fn paused(until_ms: u64) -> Run {
    let run = Setup::new(firmware(), until_ms + 100)
        .at(300, Action::StopReading)
        .at(until_ms, Action::Read)
        .run();
    let samples = run.samples();
    let lost = run.missing_frames().len();
    assert_eq!(lost as u32, run.stats().usb_dropped, "each loss is counted");
    let last = samples.last().expect("samples").time_us;
    assert!(last > 1000 * (until_ms + 50), "{last}");
    run
}

/// A host that does not read for 0.15 s loses nothing.
#[test]
fn a_short_pause_loses_nothing() {
    let run = paused(450);
    assert_eq!(run.missing_frames(), [] as [u32; 0]);
}

/// Samples after a longer pause are new; the others are counted.
#[test]
fn no_old_sample_comes_after_a_pause() {
    let run = paused(900);
    assert!(run.missing_frames().len() > 40);
    all_new(&run);
}

#[test]
#[ignore = "20 s: 4 s of virtual time"]
fn no_old_sample_comes_after_a_long_pause() {
    all_new(&paused(4300));
}
