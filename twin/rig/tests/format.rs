//! Tests of changes of the pixel format during a stream. No frame is read in the wrong format, and
//! frames that pass meanwhile are counted. After the way back, the forces are those of a run
//! without the changes.

use crate::common::{Run, Setup, command, firmware, set_threshold};
use hivtac_rig::script::Action;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::Mono;
use hivtac_terms::threshold::Yuv422;
use hivtac_terms::threshold::{HsvBox, Threshold};
use hivtac_wire::message::{Outcome, Request, Sample};

const RED: Threshold = Threshold::Rgb565(HsvBox::of_limits([170, 10, 100, 255, 45, 255]));
const RED_CR: Threshold = Threshold::Yuv422(Yuv422 { cr_low: 162 });
const DARK: Threshold = Threshold::Mono(Mono { low: 0, high: 88 });

/// Returns the device's answer to a command; `None` without an answer.
fn outcome(run: &Run, asked: u16) -> Option<Outcome> {
    let answers = run.answers(asked);
    assert!(answers.len() <= 1, "one reply to a command");
    answers.first().map(|(outcome, _)| *outcome)
}

/// Returns the samples before and after the only gap in the frames.
fn around_the_gap(samples: &[&Sample]) -> (usize, u32) {
    let gaps = samples.windows(2).enumerate();
    let mut gaps = gaps.filter(|(_, pair)| pair[1].frame != pair[0].frame + 1);
    let (at, pair) = gaps.next().expect("frames pass while the camera is set");
    assert!(gaps.next().is_none(), "only then");
    (at + 1, pair[1].frame - pair[0].frame - 1)
}

/// The command comes at several times within a frame (one takes 6.4 ms).
#[test]
fn no_frame_is_read_in_the_wrong_format() {
    for ms in [230, 232, 234] {
        let run = Setup::new(firmware(), 340)
            .at(200, Action::Send(command(70, Request::StartWithMarkers)))
            .at(ms, set_threshold(77, RED_CR))
            .run();
        assert_eq!(outcome(&run, 77), Some(Outcome::Done), "{ms} ms");
        let samples = run.samples();
        let (old, passed) = around_the_gap(&samples);
        assert!(
            (10..=14).contains(&passed),
            "{ms} ms: {passed} frames passed"
        );
        assert!(samples.len() >= old + 3, "{ms} ms: {}", samples.len());
        // The first frame may have no predecessor; it is then measured as it is seen.
        for sample in &samples[1..old] {
            assert!(sample.force.is_some(), "{ms} ms: {sample:?}");
        }
        for sample in &samples[old..] {
            assert!(sample.found().is_some(), "{ms} ms: {sample:?}");
            let bits = Status::MODEL_MISMATCH | Status::TARE_MISSING | Status::NOT_CALIBRATED;
            let status = Status(sample.status.0 & !Status::FRAME_DROPPED.0);
            assert_eq!(status, bits, "{ms} ms: {sample:?}");
        }
        assert_eq!(run.frames_after_a_loss(), [samples[old].frame], "{ms} ms");
        let stats = run.stats();
        assert_eq!((stats.dropped_size, stats.dropped_overrun), (0, 0));
        assert_eq!((stats.camera_restarts, stats.camera_timeouts), (0, 0));
        let hello = run.hellos();
        assert_eq!(hello.last().unwrap().threshold, RED_CR);
        assert_eq!(hello.last().unwrap().model.as_ref().unwrap().threshold, RED);
    }
}

#[test]
#[ignore = "6 s"]
fn the_way_back_leads_to_the_same_forces() {
    // The program is the same, to make the camera start at the same instant.
    let undisturbed = Setup::new(firmware(), 520).run();
    let run = Setup::new(firmware(), 520)
        .at(220, set_threshold(80, RED_CR))
        .at(221, set_threshold(81, RED))
        .at(222, set_threshold(82, DARK))
        .at(320, set_threshold(83, DARK))
        .at(325, set_threshold(84, RED))
        .run();
    let outcomes = [80, 81, 82, 83, 84].map(|id| outcome(&run, id).unwrap());
    use Outcome::{Busy, Done, Unsupported};
    assert_eq!(outcomes, [Done, Busy, Busy, Unsupported, Done]);
    let samples = run.samples();
    let gap = samples
        .windows(2)
        .rposition(|pair| pair[1].frame != pair[0].frame + 1);
    // The markers' motion is unknown before the second frame.
    let back = &samples[gap.unwrap() + 2..];
    let with_force = back.iter().filter(|sample| sample.force.is_some());
    assert!(with_force.count() >= 4, "{back:?}");
    for sample in back.iter().filter(|sample| sample.force.is_some()) {
        let others = undisturbed.samples();
        let same = others.iter().find(|it| it.frame == sample.frame);
        // Uncertainties include the film's possible creep by each run's own forces, and are left
        // out.
        let reported = |sample: &Sample| {
            let force = sample.force.unwrap();
            (force.cartesian, force.place.map(|place| (place.x, place.y)))
        };
        assert_eq!(reported(same.unwrap()), reported(sample), "{sample:?}");
    }
}

#[test]
fn a_change_waits_for_a_camera_that_is_away() {
    let run = Setup::new(firmware(), 1_100)
        .fault("camera-absent@230-500")
        .at(300, set_threshold(90, RED_CR))
        .at(305, set_threshold(91, RED))
        .run();
    assert_eq!(outcome(&run, 90), Some(Outcome::Done));
    assert_eq!(outcome(&run, 91), Some(Outcome::Busy));
    let last = run.samples().into_iter().next_back().unwrap();
    assert!(last.status.contains(Status::MODEL_MISMATCH), "{last:?}");
    assert!(!last.status.contains(Status::MARKERS_MISSING), "{last:?}");
}

/// A line as one event reaches memory in three steps, any other one in groups of bytes. All lines
/// come in groups if the bus is ever busy, here long after the end. The device sends the same bytes
/// at the same times, also if a change of the format stops and starts the capture.
#[test]
#[ignore = "8 s"]
fn how_lines_reach_memory_changes_nothing() {
    let setup = || Setup::new(firmware(), 330).at(225, set_threshold(80, RED_CR));
    let lines = setup().run();
    let groups = setup().fault("bus-busy@999999").run();
    assert_eq!(outcome(&lines, 80), Some(Outcome::Done));
    assert!(lines.bytes == groups.bytes, "every byte");
    assert_eq!(lines.arrivals, groups.arrivals);
    assert_eq!(lines.truth, groups.truth);
    assert_eq!(lines.report.dcmi.frames, groups.report.dcmi.frames);
    assert_eq!(lines.report.mdma_bytes, groups.report.mdma_bytes);
}
