//! Tests kept settings: shown, changed, exported, imported and reset.

use crate::fake::*;
use crate::run::*;
use hivtac_terms::camera::{CameraSettings, Rate};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::temporal::{Creep, Filter, Output, Rezero, TemporalSettings};
use hivtac_terms::units::{
    Micrometres, Microseconds, MilliPx, Milliseconds, Px, Sixteenths, SmallPermille,
    UnsignedMicroNewtons,
};
use hivtac_wire::message::*;
use hivtac_wire::settings::*;
use serde_json::Value;

const ALL: Selection = Selection::ALL;

fn only(name: bool, threshold: bool, tare: bool) -> Request {
    Request::Keep(Selection {
        name,
        threshold,
        tare,
        ..Selection::NONE
    })
}

fn device() -> FakeDevice {
    FakeDevice::on_tcp([Box::new(|device| device.serve())])
}

fn commands(device: &FakeDevice) -> Vec<Request> {
    device.commands.try_iter().collect()
}

#[test]
fn settings_for_a_person() {
    let device = device();
    let run = run(&["settings", "get", "--port", &device.port]);
    assert_eq!(
        run.stdout,
        "name       thumb (kept)\n\
         threshold  rgb565, H 170–10, S 100–255, V 45–255 (kept)\n\
         tare       taken (until restart)\n\
         touch      from 2.000 mN on, until below 1.000 mN (kept)\n\
         slip       60 µm within 50 ms, from 0.100 of the normal force on (kept)\n\
         filter     none: each frame's own force (kept)\n\
         rezero     after 10.000 s without a contact, by 0.005 px a second, 0.200 px in all \
         (kept)\n\
         creep      not measured: uncertain as silicones differ (kept)\n\
         output     off: its pin stays low (kept)\n\
         exposure   5.922 ms, as the light needs (kept)\n\
         gain       1.5, as the light needs (kept)\n\
         rate       156 frames a second (kept)\n\
         down       fixed, as when the tare was taken (kept)\n\
         contact    unknown: it may be any up to 4 mm, and uncertainties include that (kept)\n\
         flash      settings found at the start\n\
         \x20          3 sectors erased in its life, 0 failed attempts to write since the start\n"
    );
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
}

#[test]
fn settings_as_json() {
    let device = device();
    let run = run(&["settings", "get", "--json", "--port", &device.port]);
    let settings: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(settings["name"], "thumb");
    assert_eq!(settings["kept"]["name"], true);
    assert_eq!(settings["kept"]["tare"], false);
    assert_eq!(settings["threshold"]["hue_low"], 170);
    assert_eq!(settings["tare"]["markers"][2]["x_q16"], 220 << 16);
    assert_eq!(settings["found"], "settings");
    assert_eq!(settings["erases"], 3);
    assert_eq!(settings["drift_q16"], 20_316);
    assert_eq!(settings["camera"]["exposure_us"], Value::Null);
    assert_eq!(settings["camera"]["rate"], "full");
    assert_eq!(settings["camera_in_use"]["exposure_us"], 5_922);
    assert_eq!(settings["camera_in_use"]["frames_per_second"], 156);
    assert_eq!(settings["kept"]["camera"], true);
    assert_eq!(settings["contact_shape"], "unknown");
    assert_eq!(settings["kept"]["contact_shape"], true);
}

#[test]
fn settings_of_another_version_are_reported() {
    let script: Script = Box::new(|device| {
        device.settings.found = Found::AnotherVersion;
        device.serve();
    });
    let device = FakeDevice::on_tcp([script]);
    let run = run(&["settings", "get", "--port", &device.port]);
    assert!(run.stdout.contains("does not read"), "{}", run.stdout);
}

#[test]
fn a_name_is_set_and_kept() {
    let device = device();
    let run = run(&["settings", "set", "name", "index", "--port", &device.port]);
    assert_eq!(run.stdout, "this device is now called index\n");
    let name = Request::SetName("index".try_into().unwrap());
    assert_eq!(commands(&device), [name, only(true, false, false)]);
}

#[test]
fn a_name_that_is_none_is_wrong_usage() {
    for bad in ["", "twenty-five-letters-aaaaaa", "a\u{7}b"] {
        let run = run(&["settings", "set", "name", bad]);
        assert_eq!(run.code, Some(2), "{bad:?}: {}", run.stderr);
    }
}

#[test]
fn a_tare_and_a_threshold_are_kept_when_asked_for() {
    let one = device();
    let taken = run(&["tare", "--keep", "--port", &one.port]);
    let start = "tare taken over 32 frames and kept: markers at ";
    assert!(taken.stdout.starts_with(start), "{}", taken.stdout);
    let tare = Request::Tare { frames: 32 };
    assert_eq!(commands(&one), [tare, only(false, false, true)]);
    let other = device();
    let set = run(&["threshold", "--model", "--keep", "--port", &other.port]);
    let text = "threshold set and kept: rgb565, H 170–10, S 100–255, V 45–255\n";
    assert_eq!(set.stdout, text);
    let threshold = Request::SetThreshold(RED);
    assert_eq!(commands(&other), [threshold, only(false, true, false)]);
}

#[test]
fn worn_flash_is_a_refusal() {
    let script: Script = Box::new(|device| {
        device.flash = Outcome::Worn;
        device.serve();
    });
    let device = FakeDevice::on_tcp([script]);
    let run = run(&["tare", "--keep", "--port", &device.port]);
    assert_eq!(run.code, Some(6));
    assert!(run.stderr.contains("its flash is worn"), "{}", run.stderr);
}

/// A file with the settings of a fake device, with some of its text replaced.
fn exported(directory: &tempfile::TempDir, from: &str, to: &str) -> String {
    let path = directory.path().join("thumb.json");
    let path = path.to_str().unwrap().to_owned();
    let device = device();
    let run = run(&["settings", "export", &path, "--port", &device.port]);
    assert_eq!(run.stdout, format!("settings in use written to {path}\n"));
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{text}");
    std::fs::write(&path, text.replace(from, to)).unwrap();
    path
}

#[test]
fn what_was_exported_is_set_and_kept_again() {
    let directory = tempfile::tempdir().unwrap();
    let file = exported(&directory, "", "");
    let device = device();
    let run = run(&["settings", "import", &file, "--port", &device.port]);
    let text = format!("settings of {file} are in use and kept\n");
    assert_eq!((run.stdout, run.stderr), (text, String::new()));
    let settings = settings();
    let expected = [
        Request::GetSettings,
        Request::SetTare(settings.tare),
        Request::SetTemporal(settings.temporal),
        Request::SetContactShape(settings.contact_shape),
        Request::SetName(settings.name),
        Request::Keep(ALL),
    ];
    assert_eq!(commands(&device), expected);
}

#[test]
fn another_devices_rest_position_is_left_out() {
    let directory = tempfile::tempdir().unwrap();
    let file = exported(&directory, "0405060708090aff", "0405060708090afe");
    let device = device();
    let run = run(&["settings", "import", &file, "--port", &device.port]);
    assert_eq!(run.code, Some(0));
    assert!(run.stderr.contains("of another device"), "{}", run.stderr);
    assert_eq!(commands(&device)[1], Request::SetTare(None));
}

#[test]
fn a_file_that_is_no_settings_changes_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let file = exported(&directory, "\"hue_low\"", "\"hue\"");
    let device = device();
    let refused = run(&["settings", "import", &file, "--port", &device.port]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("`hue`"), "{}", refused.stderr);
    assert!(commands(&device).is_empty());
    let missing = run(&["settings", "import", "/no/such/file.json"]);
    assert_eq!(missing.code, Some(1));
    assert!(missing.stderr.contains("/no/such/file.json"));
}

/// The device refuses the rest position before anything has been kept.
#[test]
fn an_import_that_is_refused_keeps_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let file = exported(&directory, "", "");
    let script: Script = Box::new(|device| {
        while let Some(message) = device.next() {
            match message {
                HostMessage::Command(Command {
                    id,
                    request: Request::SetTare(_),
                }) => device.reply(id, Outcome::NotAtRest),
                message => device.answer_to(message),
            }
        }
    });
    let device = FakeDevice::on_tcp([script]);
    let run = run(&["settings", "import", &file, "--port", &device.port]);
    assert_eq!(run.code, Some(6));
    assert!(run.stderr.contains("nothing was kept"), "{}", run.stderr);
    assert_eq!(commands(&device), [Request::GetSettings], "no Keep");
}

#[test]
fn a_reset_is_the_devices_own() {
    let device = device();
    let run = run(&["settings", "reset", "--port", &device.port]);
    assert_eq!(
        run.stdout,
        "everything that was kept is forgotten; take a tare\n"
    );
    assert_eq!(commands(&device), [Request::Reset]);
}

/// The commands that a device received, and the tool's output.
fn sent(arguments: &[&str]) -> (Vec<Request>, String) {
    let device = device();
    let run = run(&[arguments, &["--port", &device.port]].concat());
    assert_eq!(run.code, Some(0), "{arguments:?}: {}", run.stderr);
    (commands(&device), run.stdout)
}

/// The settings that a device received, and the tool's output.
fn changed(arguments: &[&str]) -> (TemporalSettings, String) {
    let (commands, text) = sent(arguments);
    let [Request::GetSettings, Request::SetTemporal(settings), keep] = &commands[..] else {
        panic!("{commands:?}");
    };
    let only_temporal = Selection {
        temporal: true,
        ..Selection::NONE
    };
    assert_eq!(*keep, Request::Keep(only_temporal));
    (*settings, text)
}

#[test]
fn limits_are_changed_one_by_one_and_kept() {
    let usual = TemporalSettings::default();
    let (touch, text) = changed(&["settings", "set", "touch", "--begins", "3.5"]);
    assert_eq!(
        text,
        "touch set and kept: from 3.500 mN on, until below 1.000 mN\n"
    );
    let mut expected = usual;
    expected.contact.begins.0 = 3_500;
    assert_eq!(touch, expected);
    let (slip, _) = changed(
        &"settings set slip --distance 90 --ratio 0.2"
            .split(' ')
            .collect::<Vec<_>>(),
    );
    let mut expected = usual;
    (expected.slip.distance.0, expected.slip.ratio.0) = (90, 200);
    assert_eq!(slip, expected);
    let (filter, _) = changed(&["settings", "set", "filter", "low-pass", "--ms", "20"]);
    let time_constant = Milliseconds(20);
    assert_eq!(filter.filter, Filter::LowPass { time_constant });
    let (median, _) = changed(&["settings", "set", "filter", "median-of-three"]);
    assert_eq!(median.filter, Filter::MedianOfThree);
    let (rezero, _) = changed(&["settings", "set", "rezero", "on", "--rate", "0.01"]);
    let expected = Rezero {
        rate: MilliPx(10),
        ..Rezero::default()
    };
    assert_eq!(rezero.rezero, Some(expected));
    assert_eq!(
        changed(&["settings", "set", "rezero", "off"]).0.rezero,
        None
    );
    let parts = ["settings", "set", "creep", "0.031,0.042"];
    let (creep, _) = changed(&parts);
    let expected = Creep {
        parts: [SmallPermille(31), SmallPermille(42)],
    };
    assert_eq!(creep.creep, expected);
    let (output, _) = changed(&["settings", "set", "output", "force", "200"]);
    let limit = UnsignedMicroNewtons(200_000);
    assert_eq!(output.output, Output::Force { limit });
    let (output, _) = changed(&["settings", "set", "output", "slip"]);
    assert_eq!(output.output, Output::Slip);
}

#[test]
fn a_limit_out_of_its_range_changes_nothing() {
    for (arguments, word) in [
        (["touch", "--ends", "3"], "0.001 mN to where it begins"),
        (["slip", "--within", "5"], "10 to 100 ms"),
        (["filter", "low-pass", "--ms=0"], "1 to 10000 ms"),
        (["creep", "0.1,0.2", "--json"], "0 to 15 %"),
        (["output", "force", "1000.001"], "0.001 to 1000 mN"),
    ] {
        let device = device();
        let arguments = [&["settings", "set"], &arguments[..]].concat();
        let run = run(&[&arguments[..], &["--port", &device.port]].concat());
        assert_eq!(run.code, Some(1), "{arguments:?}: {}", run.stderr);
        assert!(run.stderr.contains(word), "{}", run.stderr);
        assert_eq!(commands(&device), [Request::GetSettings]);
    }
    for arguments in [
        ["touch", "--begins", "0.0001"],
        ["filter", "low-pass", "--ms=x"],
        ["filter", "median-of-three", "--ms=3"],
        ["rezero", "off", "--rate=0.01"],
        ["creep", "0.1", "--json"],
    ] {
        let run = run(&[&["settings", "set"], &arguments[..]].concat());
        assert_eq!(run.code, Some(2), "{arguments:?}: {}", run.stderr);
    }
}

#[test]
fn a_re_zeroed_rest_position_is_reported() {
    let script = || -> Script {
        Box::new(|device| {
            device.settings.rezeroed = Px(3 << 12);
            device.settings.seen = Some(MilliPx(62));
            device.serve();
        })
    };
    let device = FakeDevice::on_tcp([script(), script()]);
    let became = "re-zeroed by 0.188 px; untouched, last seen 0.062 px from there";
    let shown = run(&["settings", "get", "--port", &device.port]).stdout;
    let line = format!("tare       taken; {became} (until restart)\n");
    assert!(shown.contains(&line), "{shown}");
    let shown = run(&["info", "--port", &device.port]).stdout;
    let line = format!("0.310 px from the kept one; {became}\n");
    assert!(shown.contains(&line), "{shown}");
}

/// These commands print the lines of `docs/using.md`.
#[test]
fn the_guide_shows_what_setting_prints() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap();
    let guide = std::fs::read_to_string(root.join("docs/using.md")).unwrap();
    let mut shown = 0;
    let lines: Vec<&str> = guide.lines().collect();
    for pair in lines.windows(2) {
        let Some(rest) = pair[0].strip_prefix("$ hivtac settings set ") else {
            continue;
        };
        if rest.starts_with("name ") {
            continue;
        }
        let arguments: Vec<&str> = ["settings", "set"]
            .into_iter()
            .chain(rest.split(' '))
            .collect();
        let of_camera = ["exposure", "gain", "rate"].contains(&arguments[2]);
        let printed = match arguments[2] {
            "down" => down_changed(&arguments),
            "contact" => shape_set(&arguments).1,
            _ if of_camera => camera_changed(&arguments).1,
            _ => changed(&arguments).1,
        };
        assert_eq!(printed.trim_end(), pair[1], "{arguments:?}");
        shown += 1;
    }
    assert_eq!(shown, 22);
}

/// The camera settings that a device received, and the tool's output.
fn camera_changed(arguments: &[&str]) -> (CameraSettings, String) {
    let (commands, text) = sent(arguments);
    let [
        Request::GetSettings,
        Request::SetCamera(settings),
        keep,
        Request::GetSettings,
    ] = &commands[..]
    else {
        panic!("{commands:?}");
    };
    let only_camera = Selection {
        camera: true,
        ..Selection::NONE
    };
    assert_eq!(*keep, Request::Keep(only_camera));
    (*settings, text)
}

#[test]
fn exposure_gain_and_rate_are_set_one_by_one_and_kept() {
    let automatic = CameraSettings::default();
    let (exposed, text) = camera_changed(&["settings", "set", "exposure", "2.5"]);
    let exposure = Some(Microseconds(2_500));
    assert_eq!(
        exposed,
        CameraSettings {
            exposure,
            ..automatic
        }
    );
    assert_eq!(text, "exposure set and kept: 2.500 ms\n");
    let (amplified, _) = camera_changed(&["settings", "set", "gain", "1.5"]);
    assert_eq!(amplified.gain, Some(Sixteenths(24)));
    let (slower, text) = camera_changed(&["settings", "set", "rate", "39", "--json"]);
    assert_eq!(slower.rate, Rate::Quarter);
    let reported: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(reported["text"], "39 frames a second");
    let (found, text) = camera_changed(&["settings", "set", "exposure", "auto"]);
    assert_eq!(found, automatic);
    assert_eq!(
        text,
        "exposure set and kept: 5.922 ms, as the light needs\n"
    );
}

#[test]
fn what_the_camera_cannot_do_changes_nothing() {
    for (arguments, word) in [
        (["exposure", "6.406"], "0.024 to 6.405 ms"),
        (["rate", "100"], "156, 78 or 39"),
    ] {
        let device = device();
        let arguments = [&["settings", "set"], &arguments[..]].concat();
        let run = run(&[&arguments[..], &["--port", &device.port]].concat());
        assert_eq!(run.code, Some(1), "{arguments:?}: {}", run.stderr);
        assert!(run.stderr.contains(word), "{}", run.stderr);
        assert_eq!(commands(&device), [Request::GetSettings]);
    }
    for arguments in [["gain", "5"], ["exposure", "bright"], ["rate", "fast"]] {
        let run = run(&[&["settings", "set"], &arguments[..]].concat());
        assert_eq!(run.code, Some(2), "{arguments:?}: {}", run.stderr);
    }
}

/// From another camera, or with another rate: the file's other settings are not set either.
#[test]
fn a_file_with_an_exposure_that_the_camera_has_not_changes_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let file = exported(&directory, "\"exposure_us\":null", "\"exposure_us\":9000");
    let device = device();
    let refused = run(&["settings", "import", &file, "--port", &device.port]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("6.405 ms"), "{}", refused.stderr);
    assert_eq!(commands(&device), [Request::GetSettings]);
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("\"full\"", "\"half\"")).unwrap();
    let device = self::device();
    let taken = run(&["settings", "import", &file, "--port", &device.port]);
    assert_eq!(taken.code, Some(0), "{}", taken.stderr);
    let set = Request::SetCamera(CameraSettings {
        exposure: Some(Microseconds(9_000)),
        gain: None,
        rate: Rate::Half,
        white: None,
    });
    assert_eq!(commands(&device)[1], set);
}

/// The output after a change of gravity; a known direction asks for a new tare.
fn down_changed(arguments: &[&str]) -> String {
    let device = device();
    let run = run(&[arguments, &["--port", &device.port]].concat());
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let only_down = Selection {
        down: true,
        ..Selection::NONE
    };
    let expected = [Request::Keep(only_down), Request::GetSettings];
    assert_eq!(commands(&device), expected);
    let is_vector = arguments.len() == 6;
    assert_eq!(
        run.stderr.contains("take it anew"),
        is_vector,
        "{}",
        run.stderr
    );
    run.stdout
}

/// The contact's shape that a device received, and the tool's output. It is kept only when asked
/// for.
fn shape_set(arguments: &[&str]) -> (ContactShape, String) {
    let (commands, text) = sent(arguments);
    let [Request::SetContactShape(shape), kept @ ..] = &commands[..] else {
        panic!("{commands:?}");
    };
    let only_shape = Selection {
        contact_shape: true,
        ..Selection::NONE
    };
    let is_kept = arguments.contains(&"--keep");
    let expected = is_kept.then_some(Request::Keep(only_shape));
    assert_eq!(kept, expected.as_slice());
    (*shape, text)
}

#[test]
fn what_presses_is_set_and_kept_when_asked_for() {
    let set = ["settings", "set", "contact"];
    let (shape, text) = shape_set(&[&set[..], &["needle"]].concat());
    assert_eq!(shape, ContactShape::Needle);
    assert_eq!(text, "contact set: needle, a tip like the model's\n");
    let (shape, text) = shape_set(&[&set[..], &["flat:2.5", "--keep", "--json"]].concat());
    assert_eq!(shape, ContactShape::Flat(Micrometres(2_500)));
    let reported: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(reported["setting"], "contact");
    assert_eq!(reported["kept"], true);
    assert_eq!(reported["text"], "flat, a rigid face of 2.5 mm radius");
}

#[test]
fn what_is_no_shape_is_wrong_usage() {
    for (shape, word) in [
        ("round:0.1", "0.25 to 4 mm"),
        ("round", "such as round:2"),
        ("flat:x", "is no radius"),
        ("ball:2", "is no shape"),
    ] {
        let run = run(&["settings", "set", "contact", shape]);
        assert_eq!(run.code, Some(2), "{shape}: {}", run.stderr);
        assert!(run.stderr.contains(word), "{shape}: {}", run.stderr);
    }
}

#[test]
fn what_is_no_direction_is_refused() {
    let refused = run(&["settings", "set", "down", "0", "0", "0"]);
    assert_eq!(refused.code, Some(2));
    assert!(
        refused.stderr.contains("no direction"),
        "{}",
        refused.stderr
    );
}
