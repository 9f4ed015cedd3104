//! Tests that each fault leads to the status or counter in the firmware's documents, and that the
//! device survives it.

use crate::common::{HELLO_MS, Setup, command, firmware, hello};
use hivtac_rig::script::Action;
use hivtac_rig::usb_host::Port;
use hivtac_terms::status::Status;
use hivtac_wire::message::Request;

/// The camera is plugged in late. The firmware searches it again and again, and frames come.
#[test]
fn an_absent_camera_is_reported_and_found_later() {
    let run = Setup::new(firmware(), 1300)
        .fault("camera-absent@0-700")
        .run();
    assert!(run.log().contains("no OV7725"), "{}", run.log());
    assert!(run.samples().len() >= 3, "{:?}", run.stats());
}

/// The firmware does not write its own camera's registers to a different camera.
#[test]
fn a_camera_with_another_id_is_refused() {
    let run = Setup::new(firmware(), 700).fault("camera-wrong-id").run();
    assert!(run.log().contains("76 21"), "{}", run.log());
    assert!(run.samples().is_empty());
    assert_eq!(run.report.sccb_writes, 0);
}

/// After a reset in the middle of a byte, the microcontroller finds the camera holding SDA; nine
/// clocks free it.
#[test]
fn a_camera_that_holds_sda_is_freed() {
    let run = Setup::new(firmware(), 280).fault("sda-stuck").run();
    assert!(run.samples().len() >= 3, "{}", run.log());
    assert_eq!(run.report.resets, 0);
}

/// Errata: I²C1 reports false bus errors. The only cost is one repeated register write.
#[test]
fn a_bus_error_that_there_was_not_costs_one_transfer() {
    for ms in [20, 42, 51] {
        let fault = Box::leak(format!("berr-once@{ms}").into_boxed_str());
        let run = Setup::new(firmware(), 240).fault(fault).run();
        assert!(run.samples().len() >= 3, "{ms} ms: {}", run.log());
        assert_eq!(run.log(), "", "{ms} ms");
    }
}

/// The camera holds SCL for longer than a transfer may take. It is set up again when it releases
/// SCL.
#[test]
fn a_held_clock_is_waited_for() {
    let run = Setup::new(firmware(), 860).fault("scl-stretch@60-90").run();
    assert!(run.samples().len() >= 3, "{}", run.log());
    assert!(run.stats().frames_processed >= 3);
}

/// The camera's clock stops for a while: time-outs, then a restart, and frames again.
#[test]
fn a_silent_camera_is_restarted() {
    let run = Setup::new(firmware(), 640)
        .fault("camera-silent@230-360")
        .run();
    let stats = run.stats();
    assert!(
        stats.camera_timeouts >= 1 && stats.camera_restarts >= 1,
        "{stats:?}"
    );
    let restarted = run
        .samples()
        .into_iter()
        .find(|sample| sample.status.contains(Status::CAMERA_RESTARTED));
    let restarted = restarted.expect("a sample says that the camera was restarted");
    assert!(restarted.time_us > 360_000, "{restarted:?}");
    let last = run.followed().pop().expect("frames after that");
    assert!(
        last.frame > restarted.frame && last.force.is_some(),
        "{last:?}"
    );
    // Frame numbers continue: they still name the exposures.
    run.assert_times();
}

/// The DMA loses the bus for a millisecond, during the rows of one frame or of two consecutive
/// ones. Each is dropped and counted, and the next sample reports it.
#[test]
fn an_overrun_costs_a_frame_and_is_reported() {
    let run = Setup::new(firmware(), 300).fault("dcmi-overrun@243").run();
    let (stats, missing) = (run.stats(), run.missing_frames());
    assert!((1..=2).contains(&missing.len()), "{missing:?}");
    let lost = missing.len() as u32;
    assert_eq!(run.report.dcmi.overruns, u64::from(lost), "{stats:?}");
    assert_eq!(
        (stats.capture_overruns, stats.dropped_overrun),
        (lost, lost),
        "no other frame is lost: {stats:?}"
    );
    let samples = run.samples();
    let telling = samples
        .iter()
        .filter(|sample| sample.status.contains(Status::CAPTURE_OVERRUN));
    let after: Vec<u32> = telling.map(|sample| sample.frame).collect();
    assert_eq!(after, [missing[0] + lost]);
    assert_eq!(run.frames_after_a_loss(), after);
    assert!(samples.len() >= 5 && samples.last().map(|s| s.frame) > after.last().copied());
}

/// Copies of bands and words of the camera wait for the bus, at random, and interrupts come again
/// after they were cleared. No frame is lost.
#[test]
#[ignore = "7 s: as at half speed"]
fn a_busy_bus_costs_nothing() {
    let run = Setup::new(firmware(), 280).fault("bus-busy").run();
    assert!(run.samples().len() >= 4, "{}", run.log());
    assert_eq!(run.missing_frames(), Vec::<u32>::new());
    assert_eq!(run.frames_after_a_loss(), Vec::<u32>::new());
    let dcmi = run.report.dcmi;
    assert_eq!(dcmi.overruns, 0);
    assert!(dcmi.waits * 5 > dcmi.words, "{dcmi:?}");
}

/// The camera sends half a frame: it is dropped and counted, and the next one is captured.
#[test]
fn a_short_frame_costs_itself_and_no_other() {
    let run = Setup::new(firmware(), 300).fault("frame-short@230").run();
    let (stats, missing) = (run.stats(), run.missing_frames());
    assert!((1..=2).contains(&stats.dropped_size), "{stats:?}");
    assert_eq!(missing.len(), stats.dropped_size as usize, "{missing:?}");
    assert_eq!(run.frames_after_a_loss(), [missing.last().unwrap() + 1]);
    let last = run.samples().last().map(|sample| sample.frame);
    assert!(last > missing.last().map(|frame| frame + 3), "{last:?}");
    assert_eq!((stats.capture_overruns, stats.camera_timeouts), (0, 0));
}

/// No frame can be missing before the first sample.
#[test]
fn frames_lost_before_the_first_sample_are_not_reported() {
    let run = Setup::new(firmware(), 300).fault("frame-short@0-230").run();
    assert!(run.stats().dropped_size >= 3, "{:?}", run.stats());
    assert!(run.samples().len() >= 3, "{}", run.log());
    assert_eq!(run.frames_after_a_loss(), Vec::<u32>::new());
}

/// The camera sends rows after the last one. The frame counts as too long, whether it was already
/// measured or, on a slow core, not yet. The next sample reports it, and that frame is whole.
#[test]
fn a_long_frame_is_reported_and_costs_no_other() {
    let run = Setup::new(firmware(), 300).fault("frame-long@230").run();
    let stats = run.stats();
    assert!((1..=2).contains(&stats.dropped_size), "{stats:?}");
    let reported = run.frames_after_a_loss();
    let missing = run.missing_frames();
    // Two consecutive losses are reported by one sample, the next.
    let together = missing.windows(2).filter(|pair| pair[0] + 1 == pair[1]);
    let dropped = reported.len() + together.count();
    assert_eq!(
        dropped, stats.dropped_size as usize,
        "{missing:?} {reported:?}"
    );
    let is_reported =
        |frame: &u32| reported.contains(&(frame + 1)) || missing.contains(&(frame + 1));
    assert!(missing.iter().all(is_reported), "{missing:?} {reported:?}");
    assert_eq!((stats.capture_overruns, stats.camera_timeouts), (0, 0));
}

/// The host leaves the port open and does not read. Samples are dropped and counted, the camera
/// goes on, and the stream is synchronous again at once.
#[test]
fn a_host_that_does_not_read_loses_samples_and_nothing_else() {
    let run = Setup::new(firmware(), 600)
        .fault("host-not-reading@220-420")
        .run();
    let stats = run.stats();
    assert!(stats.usb_dropped >= 1, "{stats:?}");
    assert_eq!((stats.capture_overruns, stats.camera_timeouts), (0, 0));
    assert!(run.rejected.frames() <= 3, "{:?}", run.rejected);
    let samples = run.samples();
    assert!(
        samples
            .last()
            .is_some_and(|sample| sample.time_us > 500_000)
    );
    let gaps = samples
        .windows(2)
        .filter(|pair| pair[1].sequence != pair[0].sequence + 1)
        .count();
    assert!(gaps >= 1, "the loss shows in the sequence numbers");
}

/// The cable is pulled and put back: there is a new enumeration and a new conversation, and the
/// frame numbers went on.
#[test]
fn a_pulled_cable_is_survived() {
    let ms = HELLO_MS;
    let run = Setup::new(firmware(), 640)
        .fault("cable-pulled@230-350")
        .at(ms + 400, Action::Send(hello()))
        .at(ms + 402, Action::Send(command(3, Request::Start)))
        .run();
    assert_eq!(
        (run.report.port, run.report.usb.enumerations),
        (Port::Configured, 2),
        "{:#?}",
        run.report.usb_log
    );
    assert!(run.hellos().len() >= 2);
    let samples = run.samples();
    // The device's clock is 65 ms ahead.
    assert!(samples.iter().any(|sample| sample.time_us < 290_000));
    let after = samples
        .iter()
        .filter(|sample| sample.time_us > 560_000)
        .count();
    assert!(after >= 3, "{after} samples after the cable was put back");
    assert_eq!(run.report.resets, 0);
}
