//! Tests with firmware that has a seeded bug. Each bug must fail in its own way, which shows that
//! the rig detects it.

use std::path::PathBuf;

use crate::common::{Bug, Run, Setup, command, firmware, hello, other};
use hivtac_rig::peripherals::flash::{Contents, SECTOR_BYTES};
use hivtac_rig::script::Action;
use hivtac_rig::usb_host::Port;
use hivtac_terms::status::Status;
use hivtac_wire::message::{Outcome, Request};
use hivtac_wire::settings::Selection;

/// Number of the command to keep settings.
const KEEP: u16 = 40;

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
#[ignore = "8 s"]
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

/// Returns the message with which a run ends that breaks a rule.
fn broken_rule(setup: Setup, bug: Bug) -> String {
    let directory = tempfile::tempdir().unwrap();
    let outcome = setup.with(bug, |setup| setup.try_run(&directory.path().join("truth")));
    outcome.map(drop).unwrap_err().to_string()
}

/// Without their region, DMA buffers are cacheable as all SRAM is: the core would see old pixels.
#[test]
fn cacheable_dma_buffers_end_the_run() {
    let setup = Setup::new(other("seeded-bugs"), 200);
    let message = broken_rule(setup, Bug::CacheableBuffers);
    let expected = "DMA1 stream 0 moves bytes at 0x24";
    assert!(message.contains(expected), "{message}");
}

/// The core may read memory that no board has ahead of the program, and then waits for ever.
#[test]
fn normal_memory_where_no_board_has_any_ends_the_run() {
    let setup = Setup::new(other("seeded-bugs"), 200);
    let message = broken_rule(setup, Bug::ExternalMemory);
    let expected = "0x60000000 is normal memory";
    assert!(message.contains(expected), "{message}");
}

/// Both sectors for settings have old data, and the first erase fails. A program that ignores this
/// programs words that are not blank, which spoils them.
#[test]
fn an_erase_that_fails_is_noticed() {
    let directory = tempfile::tempdir().unwrap();
    let flash = directory.path().join("old");
    let mut old = Contents::default();
    old.array[..2 * SECTOR_BYTES as usize].fill(0x55);
    old.save(&flash).unwrap();
    let keeping = |elf: PathBuf| {
        let keep = command(KEEP, Request::Keep(Selection::ALL));
        Setup {
            flash: Some(flash.clone()),
            ..Setup::new(elf, 2_600)
                .fault("camera-absent")
                .fault("flash-fails@0-1000")
                .at(190, Action::Send(keep))
        }
    };
    let run = keeping(firmware()).run();
    assert_eq!(run.outcome(KEEP), Outcome::Done, "it tries again");
    let message = broken_rule(keeping(other("seeded-bugs")), Bug::FlashErrors);
    assert!(message.contains("is programmed twice"), "{message}");
}

/// USB's handler and the stamp of a frame have one priority: some stamps are late.
#[test]
#[ignore = "8 s"]
fn a_stamp_that_usb_delays_is_late() {
    let busy = |elf: PathBuf| {
        let mut setup = Setup::new(elf, 500);
        for nth in 0..150 {
            let get_status = Action::Request([0x80, 0, 0, 0, 0, 0, 2, 0]);
            setup = setup.at_us(200_000 + 1_900 * nth, get_status);
        }
        setup
    };
    let right = busy(firmware()).run().report.latest_stamp_ns;
    let wrong = busy(other("seeded-bugs")).run_with(Bug::VsyncPriority);
    let wrong = wrong.report.latest_stamp_ns;
    assert!(right < 1_000 && wrong > 2 * right, "{right}, {wrong}");
}

/// The host begins with DATA0 after each SET_CONFIGURATION, and takes a packet with another toggle
/// for one that it has.
#[test]
#[ignore = "18 s: packets are lost one by one"]
fn a_toggle_that_outlives_a_configuration_loses_packets() {
    let repeated = |bug: Option<Bug>| {
        let mut setup = Setup::new(other("seeded-bugs"), 420);
        for nth in 0..4 {
            let configure = Action::Request([0, 9, 1, 0, 0, 0, 0, 0]);
            let start = Action::Send(command(7, Request::Start));
            setup = setup
                .at(200 + 50 * nth, configure)
                .at(205 + 50 * nth, Action::Send(hello()))
                .at(206 + 50 * nth, start);
        }
        setup.run_with(bug).report.usb.repeated_packets
    };
    assert_eq!(repeated(None), 0);
    assert!(repeated(Some(Bug::KeptToggles)) > 0);
}

/// VSYNC comes while a frame's last words are on their way. Who does not wait for them takes whole
/// frames for short ones.
#[test]
fn an_end_without_its_last_words_drops_whole_frames() {
    let early = |elf: PathBuf| Setup::new(elf, 300).fault("vsync-early");
    let right = early(firmware()).run();
    let lost = (right.stats().dropped_size, right.missing_frames());
    assert_eq!(lost, (0, vec![]));
    let wrong = early(other("seeded-bugs")).run_with(Bug::UndrainedEnd);
    assert!(wrong.stats().dropped_size >= 4, "{:?}", wrong.stats());
}

/// The tests above notice a bug, not the way in which it is chosen.
#[test]
fn without_a_bug_the_same_program_measures() {
    let run = Setup::new(other("seeded-bugs"), 240).run();
    let samples = run.samples();
    assert!(samples.iter().any(|sample| sample.force.is_some()));
}
