//! Tests with firmware that has a seeded bug. Each bug must fail in its own way, which shows that
//! the rig detects it.

use crate::common::{Bug, Run, Setup, other};
use hivtac_rig::usb_host::Port;
use hivtac_terms::status::Status;

fn run_with(bug: Bug) -> Run {
    Setup::new(other("seeded-bugs"), 280).run_with(bug)
}

/// DMAMUX connects another request. The FIFO is never emptied, and every frame overruns at its
/// fifth word.
#[test]
fn a_wrong_dmamux_request_overruns_every_frame() {
    let run = run_with(Bug::DmamuxRequest);
    assert!(run.samples().is_empty());
    assert!(run.report.dcmi.overruns >= 4, "{:?}", run.report.dcmi);
    assert_eq!(run.report.dcmi.frames, 0);
    let stats = run.stats();
    assert!(
        stats.capture_overruns >= 4 && stats.frames_processed == 0,
        "{stats:?}"
    );
}

/// DCMI takes VSYNC's pulse for the frame and HREF's gaps for the rows.
#[test]
fn wrong_polarities_give_frames_of_the_wrong_size() {
    let run = run_with(Bug::Polarities);
    assert!(run.samples().is_empty());
    let stats = run.stats();
    assert!(
        stats.dropped_size >= 2 && stats.frames_processed == 0,
        "{stats:?}"
    );
}

/// The camera's format register stays at YUV: frames have the right size, but no red marker.
#[test]
fn a_wrong_camera_register_leaves_no_markers() {
    let run = run_with(Bug::CameraRegister);
    let samples = run.samples();
    assert!(
        samples.len() >= 3,
        "{} samples; {:?}",
        samples.len(),
        run.stats()
    );
    for sample in samples {
        assert_eq!(sample.force, None);
        let blamed = [
            Status::MARKERS_MISSING,
            Status::MARKERS_AMBIGUOUS,
            Status::BLOB_OVERFLOW,
            Status::MARKERS_IMPLAUSIBLE,
            Status::IMAGE_SATURATED,
            Status::IMAGE_DARK,
        ];
        assert!(
            blamed.iter().any(|bit| sample.status.contains(*bit)),
            "{sample:?}"
        );
    }
}

/// The DMA moves half of each band: the frame has twice the number of bands, and counts as too
/// long.
#[test]
fn half_size_bands_make_every_frame_too_long() {
    let run = run_with(Bug::HalfBands);
    assert!(run.samples().iter().all(|sample| sample.force.is_none()));
    let stats = run.stats();
    assert!(
        stats.dropped_size >= 4 && stats.frames_processed == 0,
        "{stats:?}"
    );
}

/// USB runs from an oscillator with an error of 0.6 %: the host sees a device and cannot
/// communicate with it.
#[test]
fn with_an_untrimmed_oscillator_usb_never_enumerates() {
    let run = run_with(Bug::UsbClock);
    assert_eq!(run.report.port, Port::Enumerating);
    assert_eq!((run.report.usb.enumerations, run.bytes.len()), (0, 0));
}

/// A bug is what the tests above notice, not the way in which it is chosen.
#[test]
fn without_a_bug_the_same_program_measures() {
    let run = Setup::new(other("seeded-bugs"), 240).run();
    let samples = run.samples();
    assert!(samples.iter().any(|sample| sample.force.is_some()));
}
