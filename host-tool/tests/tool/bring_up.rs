//! Tests `hivtac bring-up` on devices that are pressed, and without a device.

use crate::fake::*;
use crate::run::*;
use crate::snapshot::at_rest;
use hivtac_terms::fixed::Q;
use hivtac_terms::force::Place;
use hivtac_terms::status::Status;
use hivtac_terms::units::{Micrometres, SignedMicrometres};
use hivtac_wire::message::*;
use serde_json::Value;
use tempfile::TempDir;

/// Frame time, µs.
const FRAME_US: u32 = 33_333;

fn inspection() -> DeviceMessage {
    DeviceMessage::Inspection(Inspection {
        silicon: 0x2003,
        camera_id: 0x7721,
        registers: 49,
        different: Default::default(),
        frame_time_us: FRAME_US,
        exposure_us: 4_000,
        longest_exposure_us: FRAME_US,
        gain_sixteenths: Q::from_bits(16),
    })
}

/// A sample at rest, or under a press at a place in µm.
fn felt(frame: u32, place: Option<[i32; 2]>) -> DeviceMessage {
    let DeviceMessage::Sample(mut sample) = sample(frame, frame) else {
        unreachable!("`sample` makes samples")
    };
    sample.status = match place {
        Some(_) => Status::CONTACT,
        None => Status::OK,
    };
    if let (Some(force), Some([x, y])) = (&mut sample.force, place) {
        force.place = Some(Place {
            x: SignedMicrometres(x),
            y: SignedMicrometres(y),
            sigma: Micrometres(5),
        });
    }
    sample.markers = at_rest().into();
    DeviceMessage::Sample(sample)
}

/// A board without faults that is pressed at these places, in µm, one after the other.
fn board(presses: [[i32; 2]; 2]) -> FakeDevice {
    FakeDevice::on_tcp([Box::new(move |device: &mut Conversation| {
        device.snapshots = vec![crate::snapshot::rest_frame(); 3].into();
        let mut starts = 0;
        let mut frame = 1;
        while let Some(message) = device.next() {
            let request = match &message {
                HostMessage::Command(Command { request, .. }) => Some(request.clone()),
                HostMessage::Hello(_) | HostMessage::Down(_) => None,
            };
            if request == Some(Request::Inspect) {
                device.send(inspection());
            }
            device.answer_to(message);
            // The clocks' step makes the first start, the press's step the second.
            starts += u32::from(request == Some(Request::Start));
            let places = match request {
                Some(Request::Start) if starts == 2 => {
                    let [right, below] = presses.map(Some);
                    [None, right, right, None, None, below, below, None].to_vec()
                }
                Some(Request::Start | Request::StartWithMarkers) => vec![None; 200],
                _ => Vec::new(),
            };
            for place in places {
                device.send(felt(frame, place));
                frame += 1;
            }
        }
    })])
}

fn bring_up(device: &FakeDevice) -> (Finished, Value) {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("report.json");
    let finished = run(&["bring-up", file.to_str().unwrap(), "--port", &device.port]);
    let report = std::fs::read_to_string(&file).unwrap();
    (finished, serde_json::from_str(&report).unwrap())
}

#[test]
fn a_board_on_which_all_is_right_is_so() {
    let (finished, report) = bring_up(&board([[2_500, 200], [-100, 2_000]]));
    assert_eq!(finished.code, Some(0), "{finished:?}");
    assert_eq!(
        (&report["right"], &report["not_done"]),
        (&true.into(), &Value::Array(vec![]))
    );
    assert_eq!(finished.stdout.lines().count(), 9, "{finished:?}");
    assert!(
        finished
            .stdout
            .contains("press    right  on the right: felt (2.5, 0.2) mm")
    );
    assert!(finished.stderr.contains("white card"), "{finished:?}");
}

#[test]
fn a_camera_upside_down_is_reported_by_two_presses() {
    let (finished, report) = bring_up(&board([[-2_500, 200], [-100, -2_000]]));
    assert_eq!(finished.code, Some(9), "{finished:?}");
    assert!(finished.stdout.contains("upside down"), "{finished:?}");
    assert_eq!(report["right"], false);
}

#[test]
fn nobody_there_is_a_report_too() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("report.json");
    let finished = run(&[
        "bring-up",
        file.to_str().unwrap(),
        "--port",
        "tcp:127.0.0.1:1",
    ]);
    assert_eq!(finished.code, Some(3), "{finished:?}");
    assert!(finished.stdout.contains("LED"), "{finished:?}");
    let report: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    assert_eq!(report["steps"][0]["step"], "usb");
}

#[test]
fn a_report_that_cannot_be_written_is_said() {
    let device = board([[2_500, 200], [-100, 2_000]]);
    let finished = run(&["bring-up", "/nowhere/report.json", "--port", &device.port]);
    assert_eq!(finished.code, Some(1), "{finished:?}");
    assert!(
        finished.stderr.contains("/nowhere/report.json"),
        "{finished:?}"
    );
}
