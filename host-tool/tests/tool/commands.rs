//! Tests that the tool finds, greets, queries and commands a device.

use crate::fake::*;
use crate::run::*;
use hivtac_terms::threshold::{HsvBox, Threshold, Yuv422};
use hivtac_terms::units::MicroNewtons;
use hivtac_wire::frame::encode;
use hivtac_wire::message::*;
use hivtac_wire::version::SCHEMA_HASH;

#[test]
fn info_for_a_person() {
    let script: Script = Box::new(|device| {
        device.stats = Stats {
            frames_exposed: 1000,
            frames_processed: 990,
            dropped_busy: 7,
            usb_dropped: 3,
            processing_us: 5300,
            latency_us: 4800,
            uptime_us: 34_000_000,
            ..Stats::default()
        };
        device.serve();
    });
    let device = FakeDevice::on_tcp([script]);
    let run = run(&["info", "--port", &device.port]);
    assert_eq!(
        run.stdout,
        format!(
            "port       {}\n\
             device     000102030405060708090aff, called thumb\n\
             board      fake board\n\
             firmware   fake 1.0\n\
             protocol   2, schema {SCHEMA_HASH:#018x}\n\
             model      11-64-64-3 ov7725, CRC 0000cafe, trained on: simulated sensor; \
             built-in\n\
             frame      320 × 240 px\n\
             threshold  rgb565, H 170–10, S 100–255, V 45–255\n\
             markers    preset ov7725, dilations 1, centroids redness-weighted\n\
             filter     none: each frame's own force\n\
             tare       taken, until restart; 0.310 px from the kept one\n\
             frames     1000 exposed, 990 processed; dropped: busy 7, overrun 0, size 0, set-up 0\n\
             camera     0 timeouts, 0 restarts, 0 overruns\n\
             USB        3 samples dropped, 0 frames from the host rejected\n\
             time       up 34.000 s; last frame took 5300 µs, its sample was ready 4800 µs after \
             the middle of its exposure\n\
             health     started by power-on; 41.5 °C; 6120 of 24576 bytes of stack used\n\
             problems   none\n\
             at start   no problem\n\
             supply     a reset below 2.7 V\n",
            device.port
        )
    );
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
}

#[test]
fn info_as_json() {
    let device = FakeDevice::on_pty(Box::new(|device| device.serve()));
    let run = run(&["info", "--json", "--port", &device.port]);
    let info: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(info["port"], device.port);
    assert_eq!(info["schema"], format!("{SCHEMA_HASH:#018x}"));
    assert_eq!(info["device_id"], "000102030405060708090aff");
    assert_eq!(info["model"]["simulated"], true);
    assert_eq!(info["threshold"]["hue_low"], 170);
    assert_eq!(info["threshold"]["format"], "rgb565");
    assert_eq!(info["filter"]["kind"], "none");
    assert_eq!(info["model"]["threshold"], info["threshold"]);
    assert_eq!(info["stats"]["frames_exposed"], 0);
    assert_eq!(info["model"]["source"], "built-in");
    assert_eq!(info["tare"]["drift_px"], 20_316.0 / 65_536.0);
    assert_eq!(info["tare"]["rezeroed_px"], 0.0);
    assert_eq!(info["tare"]["seen_px"], serde_json::Value::Null);
    assert_eq!(run.stdout.lines().count(), 1);
}

/// A device that greets with another version and schema.
fn of_version(protocol: u16, schema: u64) -> Script {
    Box::new(move |device| {
        let hello = DeviceHello {
            protocol,
            schema,
            ..hello()
        };
        let mut buffer = [0; 256];
        let frame = encode(&DeviceMessage::Hello(hello), &mut buffer).unwrap();
        device.next();
        device.raw(frame);
        device.serve();
    })
}

#[test]
fn another_version_is_named() {
    for (protocol, schema) in [
        (1, 0xe67e_c004_10f1_123b),
        (2, 0x1122_3344_5566_7788),
        (3, 0x1122_3344_5566_7788),
    ] {
        let device = FakeDevice::on_tcp([of_version(protocol, schema)]);
        let run = run(&["monitor", "--port", &device.port]);
        assert_eq!(
            run.stderr,
            format!(
                "hivtac: the device at {} speaks protocol {protocol} (schema {schema:#018x}), \
                 this tool protocol 2 (schema {SCHEMA_HASH:#018x}); \
                 use the hivtac and the firmware of one release\n",
                device.port
            )
        );
        assert_eq!((run.code, run.stdout.as_str()), (Some(4), ""));
    }
}

#[test]
fn a_silent_device_is_no_device() {
    let device = FakeDevice::on_pty(Box::new(|device| while device.next().is_some() {}));
    let run = run(&["info", "--port", &device.port, "--timeout", "0.6"]);
    assert_eq!(
        run.stderr,
        format!(
            "hivtac: no hello from {} within 0.6 s (nothing came); is it a HiVTac sensor, and \
             running? (choose another port with --port, or wait longer with --timeout)\n",
            device.port
        )
    );
    assert_eq!(run.code, Some(3));
}

#[test]
fn a_device_of_another_kind_is_no_device() {
    for said in [
        &b"$GPGGA,some,other,thing\0"[..],
        b"some text of 24 bytes\r\n>",
    ] {
        let device = FakeDevice::on_tcp([Box::new(move |device| {
            device.raw(said);
            while device.next().is_some() {}
        })]);
        let run = run(&["info", "--port", &device.port, "--timeout", "0.6"]);
        assert!(
            run.stderr
                .contains("within 0.6 s (24 bytes came, and none was a hello)"),
            "{}",
            run.stderr
        );
        assert_eq!(run.code, Some(3));
    }
}

/// The device starts late and misses the first hellos.
#[test]
fn the_hello_is_repeated() {
    let device = FakeDevice::on_tcp([Box::new(|device| {
        device.next();
        device.next();
        device.serve();
    })]);
    assert_eq!(run(&["info", "--port", &device.port]).code, Some(0));
}

#[test]
fn ports_that_cannot_be_opened_are_named() {
    let missing = run(&["info", "--port", "/dev/ttyNOWHERE"]);
    assert_eq!(missing.code, Some(3));
    let start = "hivtac: cannot open /dev/ttyNOWHERE: there is no such port; ";
    assert!(missing.stderr.starts_with(start), "{}", missing.stderr);
    let file = tempfile::NamedTempFile::new().unwrap();
    let no_port = run(&["info", "--port", file.path().to_str().unwrap()]);
    assert_eq!(no_port.code, Some(3));
    assert!(
        no_port.stderr.contains("; is it a serial port?"),
        "{}",
        no_port.stderr
    );
    let nobody = run(&["info", "--port", "tcp:127.0.0.1:1"]);
    assert_eq!(nobody.code, Some(3));
    assert!(
        nobody
            .stderr
            .contains("cannot connect to tcp:127.0.0.1:1: "),
        "{}",
        nobody.stderr
    );
}

#[test]
fn an_exposure_is_asked_for() {
    let script: Script = Box::new(|device| device.serve());
    let device = FakeDevice::on_tcp([script]);
    let done = run(&["expose", "--port", &device.port]);
    assert_eq!(
        (done.code, done.stdout.as_str()),
        (Some(0), "exposure and gain found; take a new tare\n")
    );
    let commands: Vec<_> = device.commands.iter().collect();
    assert_eq!(commands, [Request::Expose]);
}

#[test]
fn a_tare_is_taken_refused_or_not_answered() {
    let device = |tare| {
        let script: Script = Box::new(move |device| {
            device.tare = tare;
            device.serve();
        });
        FakeDevice::on_tcp([script])
    };
    let good = device(Some(Outcome::Done));
    let done = run(&["tare", "--frames", "64", "--port", &good.port]);
    assert_eq!(
        (done.code, done.stdout.as_str()),
        (
            Some(0),
            "tare taken over 64 frames: markers at (100.00, 60.00), (220.00, 60.00), \
             (220.00, 180.00), \
             (100.00, 180.00) px, spread 0.012 px, 0.310 px from the rest before: as if the camera \
             had shifted the picture by (0.20, -0.10) px, turned it by 0.01° and enlarged it by \
             0.30 %, but for 0.008 px\n"
        )
    );
    assert_eq!(
        good.commands.iter().collect::<Vec<_>>(),
        [Request::Tare { frames: 64 }]
    );
    let forced = device(Some(Outcome::Done));
    let done = run(&["tare", "--force", "--json", "--port", &forced.port]);
    let tared: serde_json::Value = serde_json::from_str(&done.stdout).unwrap();
    assert_eq!(tared["markers"][2], serde_json::json!([220.0, 180.0]));
    assert_eq!(tared["moved"]["farthest_px"], 20_316.0 / 65_536.0);
    assert_eq!(
        forced.commands.iter().collect::<Vec<_>>(),
        [Request::TareAnyway { frames: 32 }]
    );
    let looks_like = MicroNewtons(1_043);
    let touch = Outcome::Touched { looks_like };
    let touched = run(&["tare", "--port", &device(Some(touch)).port]);
    assert_eq!(touched.code, Some(6));
    for word in ["by 1.0 mN", "--force"] {
        assert!(touched.stderr.contains(word), "{}", touched.stderr);
    }
    let blind = run(&["tare", "--port", &device(Some(Outcome::NoGoodFrames)).port]);
    assert_eq!(blind.code, Some(6));
    assert_eq!(
        blind.stderr,
        "hivtac: the device refused \"tare\": not enough good frames came in time; \
         does the camera see all four markers? (hivtac monitor)\n"
    );
    let pressed = run(&["tare", "--port", &device(Some(Outcome::NotAtRest)).port]);
    assert_eq!(pressed.code, Some(6));
    assert_eq!(
        pressed.stderr,
        "hivtac: the device refused \"tare\": the markers are not where a film at rest has them; \
         take away what touches it, and check the film's distance\n"
    );
    for (outcome, why) in [
        (
            Outcome::MarkersImplausible,
            "not those of four whole, equal markers",
        ),
        (Outcome::Unsteady, "the markers moved meanwhile; take away"),
    ] {
        let refused = run(&["tare", "--port", &device(Some(outcome)).port]);
        assert_eq!(refused.code, Some(6));
        assert!(refused.stderr.contains(why), "{}", refused.stderr);
    }
    let mute = run(&["tare", "--frames", "1", "--port", &device(None).port]);
    assert_eq!(mute.code, Some(6));
    assert_eq!(
        mute.stderr,
        "hivtac: the device did not answer \"tare\" within 10.5 s; it may do it all the same: wait \
         10 s and try again; when it repeats, `hivtac info` shows whether it restarts\n"
    );
}

#[test]
fn a_threshold_is_set_as_given() {
    let device = FakeDevice::on_pty(Box::new(|device| device.serve()));
    let run = run(&[
        "threshold",
        "--hsv",
        "160,8,90,250,40,240",
        "--port",
        &device.port,
    ]);
    assert_eq!(
        (run.code, run.stdout.as_str()),
        (
            Some(0),
            "threshold set: rgb565, H 160–8, S 90–250, V 40–240\n"
        )
    );
    assert!(
        run.stderr.contains("(model_mismatch)"),
        "the model was made for another one: {}",
        run.stderr
    );
    let expected = HsvBox {
        hue_low: 160,
        hue_high: 8,
        saturation_low: 90,
        saturation_high: 250,
        value_low: 40,
        value_high: 240,
    };
    assert_eq!(
        device.commands.iter().next(),
        Some(Request::SetThreshold(Threshold::Rgb565(expected)))
    );
}

#[test]
fn the_pixel_format_follows_the_threshold() {
    let device = FakeDevice::on_pty(Box::new(|device| device.serve()));
    let set = run(&["threshold", "--cr", "162", "--port", &device.port]);
    assert_eq!(
        (set.code, set.stdout.as_str()),
        (Some(0), "threshold set: yuv422, Cr 162–255\n")
    );
    assert_eq!(
        set.stderr,
        "hivtac: samples have markers but no force (model_mismatch): the device's model was made \
         for rgb565, H 170–10, S 100–255, V 45–255; `hivtac threshold --model` goes back to that\n"
    );
    let expected = Request::SetThreshold(Threshold::Yuv422(Yuv422 { cr_low: 162 }));
    assert_eq!(device.commands.iter().next(), Some(expected));
}

#[test]
fn the_models_threshold_needs_no_numbers() {
    let device = FakeDevice::on_pty(Box::new(|device| device.serve()));
    let set = run(&["threshold", "--model", "--port", &device.port]);
    assert_eq!((set.code, set.stderr.as_str()), (Some(0), ""));
    let expected = Request::SetThreshold(hello().threshold);
    assert_eq!(device.commands.iter().next(), Some(expected));
}

#[test]
fn a_format_that_the_camera_does_not_send_is_refused() {
    let device = FakeDevice::on_pty(Box::new(|device| device.serve()));
    let refused = run(&["threshold", "--luma", "0,88", "--port", &device.port]);
    assert_eq!(refused.code, Some(6));
    assert_eq!(
        refused.stderr,
        "hivtac: the device refused \"set threshold\": it cannot do that: its camera does not send \
         that pixel format; \
         choose another\n"
    );
}

#[test]
fn wrong_usage_is_exit_code_2() {
    for arguments in [
        &["tare", "--frames", "257"][..],
        &["tare", "--frames", "0"],
        &["threshold", "--hsv", "200,8,90,250,40,240"],
        &["threshold"],
        &["threshold", "--cr", "256"],
        &["threshold", "--luma", "9,8"],
        &["threshold", "--model", "--cr", "162"],
        &["monitor", "--json", "--csv"],
        &["monitor", "--frames", "0"],
        &["monitor", "--seconds", "-1"],
        &["monitor", "--timeout", "nan"],
        &["nonsense"],
    ] {
        assert_eq!(run(arguments).code, Some(2), "{arguments:?}");
    }
}

#[test]
fn the_help_lists_the_exit_codes() {
    let help = run(&["--help"]);
    assert_eq!(help.code, Some(0));
    for code in ["0  ", "1  ", "2  ", "3  ", "4  ", "5  ", "6  ", "130"] {
        assert!(
            help.stdout.contains(&format!("\n  {code}")),
            "{code}: {}",
            help.stdout
        );
    }
}

#[test]
fn shells_are_reported_what_completes_a_command() {
    for (shell, words) in [
        ("bash", "complete -F _hivtac"),
        ("zsh", "#compdef hivtac"),
        ("fish", "complete -c hivtac"),
        ("powershell", "Register-ArgumentCompleter"),
        ("elvish", "edit:completion"),
    ] {
        let done = run(&["completion", shell]);
        assert_eq!((done.code, done.stderr.as_str()), (Some(0), ""), "{shell}");
        assert!(done.stdout.contains(words), "{shell}: {}", done.stdout);
        assert!(done.stdout.contains("threshold"), "{shell}");
    }
    assert_eq!(run(&["completion", "nonsense"]).code, Some(2));
}

/// Each command prints one object with its result for programs.
#[test]
fn commands_tell_programs_what_they_did() {
    let reported = |arguments: &[&str]| {
        let device = FakeDevice::on_tcp([Box::new(|device: &mut Conversation| device.serve())]);
        let done = run(&[arguments, &["--json", "--port", &device.port]].concat());
        assert_eq!(
            (done.code, done.stderr.as_str()),
            (Some(0), ""),
            "{arguments:?}"
        );
        assert_eq!(done.stdout.lines().count(), 1, "{}", done.stdout);
        serde_json::from_str::<serde_json::Value>(&done.stdout).unwrap()
    };
    let tare = reported(&["tare", "--frames", "8", "--keep"]);
    assert_eq!((&tare["frames"], &tare["kept"]), (&8.into(), &true.into()));
    assert_eq!(tare["moved"]["farthest_px"], 20_316.0 / 65_536.0);
    assert_eq!(
        reported(&["expose"]),
        serde_json::json!({ "exposed": true })
    );
    let threshold = reported(&["threshold", "--model"]);
    assert_eq!(threshold["threshold"]["saturation_low"], 100);
    assert_eq!(threshold["kept"], false);
    let name = reported(&["settings", "set", "name", "index"]);
    assert_eq!(name, serde_json::json!({ "name": "index", "kept": true }));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("thumb.json");
    let file = file.to_str().unwrap();
    assert_eq!(reported(&["settings", "export", file])["file"], file);
    assert_eq!(reported(&["settings", "import", file])["tare"], true);
    assert_eq!(reported(&["settings", "reset"])["kept"], false);
}
