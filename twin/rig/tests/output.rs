//! Tests of the output pin: it follows contact, slip and a force limit of the frames' own forces,
//! before their samples are on USB.

use crate::common::{Run, Setup, command, firmware, openmv};
use hivtac_rig::script::Action;
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{Output, TemporalSettings};
use hivtac_terms::units::UnsignedMicroNewtons;
use hivtac_wire::message::{Outcome, Request, Sample};

const SET: u16 = 30;
/// Before the tip presses.
const SET_MS: u64 = 170;
/// Time by which the tip has been lifted.
const END_MS: u64 = 520;

fn set(output: Output) -> Action {
    let settings = TemporalSettings {
        output,
        ..TemporalSettings::USUAL
    };
    Action::Send(command(SET, Request::SetTemporal(settings)))
}

/// A drag, with this output.
fn drag(output: Output) -> Run {
    let setup = Setup {
        scene: "tests/drag.toml",
        ..Setup::new(firmware(), END_MS)
    };
    let run = setup.at(SET_MS, set(output)).run();
    assert_eq!(run.outcome(SET), Outcome::Done);
    run
}

/// Returns when the samples with a force had arrived at which `is_high` changes, ns.
fn changes(run: &Run, mut is_high: impl FnMut(&Sample) -> bool) -> Vec<u64> {
    let mut was_high = false;
    let samples = run.samples().into_iter();
    let samples = samples.filter(|sample| sample.force.is_some());
    let changed = samples.filter(|sample| {
        let change = is_high(sample) != was_high;
        was_high ^= change;
        change
    });
    let arrived = |sample: &Sample| {
        let mut arrivals = run.arrivals.iter();
        let arrival = arrivals.find(|line| line["frame"] == sample.frame);
        (arrival.expect("it arrived")["time_s"].as_f64().unwrap() * 1e9) as u64
    };
    changed.map(arrived).collect()
}

/// Asserts that the pin's edges are those of the samples, each before its sample came.
fn assert_follows(run: &Run, changes: &[u64]) {
    let edges = &run.report.output_edges_ns;
    assert_eq!(edges.len(), changes.len(), "{edges:?} {changes:?}");
    for (edge, arrived) in edges.iter().zip(changes) {
        let ahead_ns = arrived.checked_sub(*edge);
        assert!(
            ahead_ns.is_some_and(|ahead| ahead < 2_000_000),
            "{edge} {arrived}"
        );
    }
}

#[test]
fn it_is_high_during_a_contact_and_a_slip() {
    for (output, bit) in [
        (Output::Contact, Status::CONTACT),
        (Output::Slip, Status::SLIP),
    ] {
        let run = drag(output);
        let changes = changes(&run, |sample| sample.status.contains(bit));
        assert!(changes.len() >= 2 && changes.len().is_multiple_of(2));
        assert_follows(&run, &changes);
    }
}

#[test]
fn it_is_high_from_a_force_on_until_a_tenth_below() {
    let limit = UnsignedMicroNewtons(60_000);
    let run = drag(Output::Force { limit });
    let mut is_high = false;
    let changes = changes(&run, |sample| {
        let least = if is_high { 54_000 } else { 60_000 };
        let magnitude = sample.force.expect("only those with one").magnitude;
        is_high = magnitude.0.unsigned_abs() >= least;
        is_high
    });
    assert!(
        !changes.is_empty(),
        "the tip presses by more than the limit"
    );
    assert_follows(&run, &changes);
}

/// On the second board, it is another pin; without its setting it stays low.
#[test]
fn it_is_the_boards_pin_and_off_at_first() {
    let run = openmv(420).at(200, set(Output::Contact)).run();
    assert!(!run.report.output_edges_ns.is_empty());
    let run = openmv(420).run();
    assert_eq!(run.report.output_edges_ns, [0; 0]);
}
