//! Tests the page's orders to a device: pictures, tares, thresholds and recordings.

use super::client::View;
use super::{device, serve};
use crate::fake::*;
use crate::snapshot::at_rest;
use hivtac_terms::threshold::{HsvBox, Threshold};
use hivtac_wire::message::*;
use serde_json::{Value, json};

#[test]
fn a_picture_has_its_pixels_mask_and_markers() {
    let device = FakeDevice::on_tcp([device(3)]);
    let view = View::of(&[&device.port]);
    let (head, body) = view.get("/picture/0");
    assert!(head.starts_with("HTTP/1.1 200"), "{head}");
    let end = body.iter().position(|&byte| byte == b'\n').unwrap();
    let reported: Value = serde_json::from_slice(&body[..end]).unwrap();
    let pixels = &body[end + 1..];
    assert_eq!(
        (&reported["width"], &reported["height"]),
        (&json!(320), &json!(240))
    );
    assert_eq!(pixels.len(), 4 * 320 * 240);
    let passed = pixels[3 * 320 * 240..]
        .iter()
        .filter(|&&level| level == 255);
    assert_eq!(reported["passed"], passed.count());
    // Four dots of 18 px.
    assert!(
        (600..1400).contains(&reported["passed"].as_u64().unwrap()),
        "{reported}"
    );
    assert_eq!(reported["markers"][3]["area"], at_rest()[3].area);
    assert_eq!(reported["wrong"], json!([]));
    assert_eq!(
        reported["threshold"]["limits"],
        json!([170, 10, 100, 255, 45, 255])
    );
    // The next snapshot is empty, and the page gets the reason for the missing picture.
    let (_, body) = view.get("/picture/0");
    let reported: Value = serde_json::from_slice(&body).unwrap();
    assert!(
        reported["text"]
            .as_str()
            .unwrap()
            .contains("nothing of it came"),
        "{reported}"
    );
}

#[test]
fn orders_reach_the_device_and_refusals_the_page() {
    let script: Script = Box::new(|device| {
        device.tare = Some(Outcome::NotAtRest);
        serve(device, 3);
    });
    let device = FakeDevice::on_tcp([script]);
    let view = View::of(&[&device.port]);
    let refused = view.order(&json!({"sensor": 0, "order": "tare"}));
    assert_eq!(refused["done"], false);
    assert!(
        refused["text"].as_str().unwrap().contains("at rest"),
        "{refused}"
    );
    let limits = json!([1, 2, 3, 4, 5, 6]);
    let done = view
        .order(&json!({"sensor": 0, "order": "threshold", "format": "rgb565", "limits": limits}));
    assert_eq!(done, json!({"done": true, "text": "threshold set"}));
    assert_eq!(
        view.order(&json!({"sensor": 0, "order": "model_threshold"}))["done"],
        true
    );
    let wrong = view.order(&json!({"sensor": 0, "order": "reboot"}));
    assert_eq!(
        wrong,
        json!({"done": false, "text": "there is no such order"})
    );
    let orders: Vec<_> = device
        .commands
        .try_iter()
        .filter(|request| !is_question(request))
        .collect();
    let set = |limits| Request::SetThreshold(Threshold::Rgb565(HsvBox::of_limits(limits)));
    let expected = [
        Request::Tare { frames: 32 },
        set([1, 2, 3, 4, 5, 6]),
        set([170, 10, 100, 255, 45, 255]),
    ];
    assert_eq!(orders, expected);
}

/// Returns whether a command only asks, or starts samples.
fn is_question(request: &Request) -> bool {
    matches!(
        request,
        Request::GetInfo | Request::GetSettings | Request::StartWithMarkers
    )
}

#[test]
fn several_sensors_are_distinguished() {
    let devices = [4, 8].map(|count| FakeDevice::on_tcp([device(count)]));
    let view = View::of(&[&devices[0].port, &devices[1].port]);
    let mut events = view.events();
    assert_eq!(events.until("hello", |hello| hello["sensors"].as_u64()), 2);
    assert_eq!(events.sample(1, 7)[0], 7);
    let done = view.order(&json!({"sensor": 1, "order": "tare"}));
    assert_eq!(done["done"], true);
    let tares = devices.map(|device| {
        let asked: Vec<_> = device.commands.try_iter().collect();
        asked.contains(&Request::Tare { frames: 32 })
    });
    assert_eq!(tares, [false, true]);
    let (head, _) = view.get("/picture/2");
    assert!(head.starts_with("HTTP/1.1 404"), "{head}");
}

#[test]
fn a_recording_begins_and_ends_with_its_button() {
    let folder = tempfile::tempdir().unwrap();
    let vanish: Script = Box::new(|device| {
        while let Some(message) = device.next() {
            if let HostMessage::Command(Command { request, .. }) = &message {
                match request {
                    // The tare brings samples, and the order to expose ends the connection.
                    Request::Tare { .. } => (0..20).for_each(|n| device.send(sample(n, n))),
                    Request::Expose => return,
                    _ => (),
                }
            }
            device.answer_to(message);
        }
    });
    let device = FakeDevice::on_tcp([vanish]);
    let path = folder.path().to_str().unwrap();
    let view = View::with(&[&device.port], &["--recordings", path, "--timeout", "0.5"]);
    let order = |order: &str| view.order(&json!({"sensor": 0, "order": order}));
    let begun = order("record");
    let file = folder.path().join("hivtac-000102030405060708090aff-1.mcap");
    let partial = file.with_extension("mcap.partial");
    assert_eq!(begun["done"], true, "{begun}");
    assert!(partial.exists() && !file.exists());
    view.events()
        .state(0, |state| state["recording"]["on"] == true);
    assert_eq!(order("tare")["done"], true);
    let ended = order("stop_recording");
    assert!(
        ended["text"]
            .as_str()
            .unwrap()
            .contains("20 received, 0 lost"),
        "{ended}"
    );
    assert!(file.exists() && !partial.exists());
    // A file that is cut by a pulled cable keeps its temporary name, and the page says so.
    order("record");
    order("expose");
    let lost = view.events().state(0, |state| {
        state["recording"]["on"] == false && state["trouble"].is_string()
    });
    let text = lost["recording"]["text"].as_str().unwrap();
    assert!(
        text.contains("-2.mcap.partial") && text.contains("lost"),
        "{text}"
    );
    assert!(
        folder
            .path()
            .join("hivtac-000102030405060708090aff-2.mcap.partial")
            .exists()
    );
    let replay = file.to_str().unwrap();
    assert!(
        crate::recordings::replayed(&[replay], "20")
            .into_iter()
            .eq(0..20)
    );
}
