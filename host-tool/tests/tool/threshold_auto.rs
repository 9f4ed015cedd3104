//! Tests `hivtac threshold auto` with devices that send pictures.

use crate::fake::*;
use crate::run::*;
use crate::snapshot::rest_frame;
use hivtac_wire::message::*;
use hivtac_wire::settings::Selection;
use serde_json::Value;

/// A device that sends three pictures of the untouched film, which `change` may modify.
fn device(change: fn(&mut DeviceMessage)) -> FakeDevice {
    FakeDevice::on_tcp([Box::new(move |device: &mut Conversation| {
        let picture = || {
            let mut messages = rest_frame();
            messages.iter_mut().for_each(change);
            messages
        };
        device.snapshots = [picture(), picture(), picture()].into();
        device.serve();
    })])
}

/// The commands that a device received to set and keep settings.
fn orders(device: &FakeDevice) -> Vec<Request> {
    let is_order = |it: &Request| matches!(it, Request::SetThreshold(_) | Request::Keep(_));
    device.commands.try_iter().filter(is_order).collect()
}

#[test]
fn it_is_set_and_kept_with_the_reason() {
    let device = device(|_| ());
    let run = run(&["threshold", "auto", "--keep", "--port", &device.port]);
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{run:?}");
    let [film, dots, chosen, passes] = ["film ", "dots ", "chosen ", "passes "].map(|begin| {
        let line = run.stdout.lines().find(|line| line.starts_with(begin));
        line.unwrap_or_else(|| panic!("no {begin}in {run:?}"))
    });
    assert!(film.contains("99.9 % of it up to"), "{film}");
    assert!(dots.contains("hue 17"), "{dots}");
    let model = "rgb565, H 170–10, S 100–255, V 45–255: the model's, which separates them";
    assert!(chosen.contains(model), "{chosen}");
    assert!(passes.contains(" of 76800)"), "{passes}");
    let kept = Selection {
        threshold: true,
        ..Selection::NONE
    };
    assert_eq!(
        orders(&device),
        [Request::SetThreshold(RED), Request::Keep(kept)]
    );
}

#[test]
fn a_dry_run_sets_nothing() {
    let device = device(|_| ());
    let port = &device.port;
    let run = run(&["threshold", "auto", "--dry-run", "--json", "--port", port]);
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{run:?}");
    let reported: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(
        (&reported["set"], &reported["is_of_model"]),
        (&false.into(), &true.into())
    );
    let level = |name: &str, which: &str| reported[name][which].as_u64().unwrap();
    let chosen = reported["half_way"]["saturation_low"].as_u64().unwrap();
    assert!(
        level("film", "high") < chosen && chosen < level("dots", "low"),
        "{reported}"
    );
    assert!(
        (0.005..0.015).contains(&reported["passed"].as_f64().unwrap()),
        "{reported}"
    );
    assert_eq!(orders(&device), []);
}

/// With black pictures no threshold is set.
#[test]
fn a_picture_that_does_not_separate_is_exit_code_9() {
    let device = device(|message| {
        if let DeviceMessage::SnapshotPart(part) = message {
            part.bytes.fill(0);
        }
    });
    let run = run(&["threshold", "auto", "--port", &device.port]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(9), ""), "{run:?}");
    let why = "hivtac: no threshold separates the dots from the film: the picture is dark";
    assert!(run.stderr.starts_with(why), "{}", run.stderr);
    assert_eq!(orders(&device), []);
}
