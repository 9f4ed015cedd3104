//! Tests of contact, slip and filter in the firmware: they equal, bit for bit, those that the
//! sensing on this computer computes from the same forces.

use crate::common::{Run, Setup, command, firmware};
use hivtac_rig::script::Action;
use hivtac_sensor::markers::lost::Lost;
use hivtac_sensor::pipeline::Measurement;
use hivtac_sensor::temporal::{Moment, Temporal};
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{ContactLimits, Filter, TemporalSettings};
use hivtac_terms::units::{MicroNewtons, Milliseconds, UnsignedMicroNewtons};
use hivtac_wire::message::{Outcome, Request, Sample};
use std::collections::BTreeMap;

/// Numbers of commands, and the time at which they are sent.
const SET: u16 = 30;
const WRONG: u16 = 31;
const SET_MS: u64 = 360;
/// Time by which the tip has been lifted.
const END_MS: u64 = 520;

fn setup() -> Setup {
    Setup {
        scene: "tests/drag.toml",
        ..Setup::new(firmware(), END_MS)
    }
}

/// A status, and a force's components, µN. Uncertainties are left out: they include the film's
/// possible creep, which a sample that is followed again would include twice.
type Reported = (Status, Option<[MicroNewtons; 3]>);

/// Returns a sample of another run with only the values of its own frame.
fn measured(sample: &Sample) -> Measurement {
    Measurement {
        status: sample.status,
        markers: None,
        lost: Lost::NONE,
        features: None,
        force: sample.force,
        contacts: sample.contacts,
    }
}

/// Returns the results of the sensing on this computer for samples, with other settings from the
/// index `from` on.
fn followed(samples: &[&Sample], other: TemporalSettings, from: usize) -> Vec<Reported> {
    let mut temporal = Temporal::new();
    let followed = samples.iter().enumerate().map(|(nth, sample)| {
        if nth == from {
            temporal.set(other).unwrap();
        }
        let at = Moment {
            frame: sample.frame,
            time_us: sample.time_us,
        };
        let followed = temporal.follow(at, &measured(sample));
        (followed.status, followed.force.map(|force| force.cartesian))
    });
    followed.collect()
}

fn reported(run: &Run) -> Vec<Reported> {
    let samples = run.samples();
    let stated = |s: &&Sample| (s.status, s.force.map(|force| force.cartesian));
    samples.iter().map(stated).collect()
}

/// Returns the truth of each frame: whether the tip presses, and the distance that its contact has
/// moved, mm.
fn truth(run: &Run) -> BTreeMap<u32, (bool, f64)> {
    let lines = run.truth.iter().map(|line| {
        let number = |key: &str| line[key].as_f64();
        let presses = number("magnitude_n").unwrap_or(0.0) > 0.0;
        let moved = number("place_x_mm").unwrap_or(0.0);
        (line["frame"].as_u64().unwrap() as u32, (presses, moved))
    });
    lines.collect()
}

#[test]
fn a_drag_is_a_contact_and_slips_and_new_settings_hold_for_whole_frames() {
    let run = setup().run();
    run.assert_only_setup_drops();
    let samples = run.samples();
    let usual = TemporalSettings::USUAL;
    assert_eq!(reported(&run), followed(&samples, usual, usize::MAX));
    check_truth(&run);

    // Another filter, and limits above every touch.
    let other = TemporalSettings {
        contact: ContactLimits {
            begins: UnsignedMicroNewtons(500_000),
            ends: UnsignedMicroNewtons(400_000),
        },
        filter: Filter::LowPass {
            time_constant: Milliseconds(20),
        },
        ..usual
    };
    let mut wrong = usual;
    wrong.slip.within = Milliseconds(101);
    let send = |id, settings| Action::Send(command(id, Request::SetTemporal(settings)));
    let changed = setup()
        .at(SET_MS, send(SET, other))
        .at(SET_MS + 60, send(WRONG, wrong))
        .run();
    assert_eq!(changed.outcome(SET), Outcome::Done);
    assert_eq!(changed.outcome(WRONG), Outcome::InvalidArgument);
    assert_eq!(changed.hellos().last().unwrap().filter, other.filter);
    // The reply overtakes waiting samples, by one or two.
    let before = changed.answers(SET)[0].1;
    let fits = |from: &usize| reported(&changed) == followed(&samples, other, *from);
    let from = (before - 1..before + 3).find(fits);
    assert!(from.is_some(), "every frame by one of the two settings");
}

/// Checks that contact and slip are reported when they are true, and soon.
fn check_truth(run: &Run) {
    let truth = truth(run);
    let first = |is: &dyn Fn(&Sample) -> bool| {
        let samples = run.samples();
        let first = samples.iter().find(|sample| is(sample));
        first.map(|sample| sample.frame).expect("it happens")
    };
    let presses = first(&|sample| truth[&sample.frame].0);
    let touched = first(&|sample| sample.status.contains(Status::CONTACT));
    assert!(
        (presses..presses + 3).contains(&touched),
        "{presses} {touched}"
    );
    let moves = first(&|sample| truth[&sample.frame].1 > 1e-6);
    let slips = first(&|sample| sample.status.contains(Status::SLIP));
    // While the force still rises, its place may seem to move some frames earlier, once the pull is
    // strong enough for a slip.
    assert!((moves - 4..moves + 4).contains(&slips), "{moves} {slips}");
    let last = run.samples().last().unwrap().status;
    assert!(!last.contains(Status::CONTACT), "{last:?}");
}
