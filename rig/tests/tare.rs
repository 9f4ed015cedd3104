//! A tare of the flashed firmware: taken of a film at rest, refused with the reason otherwise.

mod common;

use common::{Run, Setup, command, firmware};
use hivtac_rig::script::Action;
use hivtac_terms::status::Status;
use hivtac_wire::message::{Outcome, Request};

const ASKED: u16 = 40;

fn tared(scene: &'static str, at_ms: u64) -> Run {
    let tare = command(ASKED, Request::Tare { frames: 4 });
    let setup = Setup::new(firmware(), 300).at(at_ms, Action::Send(tare));
    Setup { scene, ..setup }.run()
}

fn outcome(run: &Run) -> Outcome {
    let answers = run.answers(ASKED);
    assert_eq!(answers.len(), 1, "one reply");
    answers[0].0
}

#[test]
fn a_film_at_rest_is_tared() {
    let run = tared("rest", 200);
    assert_eq!(outcome(&run), Outcome::Done);
    let samples = run.samples();
    let last = samples.last().unwrap();
    assert!(last.force.is_some(), "{last:?}");
    assert!(!last.status.contains(Status::TARE_MISSING), "{last:?}");
}

#[test]
fn markers_that_are_covered_from_one_side_are_refused_and_nothing_changes() {
    let run = tared("tests/covered.toml", 200);
    assert_eq!(outcome(&run), Outcome::MarkersImplausible);
    for sample in run.samples() {
        assert!(sample.status.contains(Status::TARE_MISSING), "{sample:?}");
    }
}
