//! Tests `hivtac monitor` with simulated devices.

use crate::fake::*;
use crate::run::*;
use hivtac_terms::force::ContactList;
use hivtac_terms::marker::MarkerList;
use hivtac_terms::status::Status;
use hivtac_wire::message::*;
use std::io::Write;

const JSON_41: &str = r#"{"seq":41,"frame":42,"time_us":1399986,"force":{"alpha_deg":-5.000,"beta_deg":2.500,"magnitude_n":0.100000,"x_n":-0.008707,"y_n":0.004362,"z_n":-0.099525,"direction_sigma_deg":0.480,"magnitude_sigma_n":0.000900,"place_x_mm":1.250,"place_y_mm":-0.730,"place_sigma_mm":0.085,"torque_z_nm":null,"torque_sigma_nm":null},"contacts":[{"alpha_deg":-5.000,"beta_deg":2.500,"magnitude_n":0.100000,"x_n":-0.008707,"y_n":0.004362,"z_n":-0.099525,"direction_sigma_deg":0.480,"magnitude_sigma_n":0.000900,"place_x_mm":1.250,"place_y_mm":-0.730,"place_sigma_mm":0.085,"torque_z_nm":null,"torque_sigma_nm":null}],"contact":true,"slip":false,"status":["not_calibrated","contact"]}"#;

fn without_force(sequence: u32, frame: u32) -> DeviceMessage {
    DeviceMessage::Sample(Sample {
        sequence,
        frame,
        time_us: 7,
        status: Status::MARKERS_MISSING | Status::FRAME_DROPPED,
        force: None,
        contacts: ContactList::default(),
        markers: MarkerList::default(),
    })
}

#[test]
fn json_lines_and_a_summary_on_standard_error() {
    let device = FakeDevice::on_tcp([streaming(vec![sample(41, 42), without_force(42, 43)])]);
    let run = run(&["monitor", "--port", &device.port, "--json", "--frames", "2"]);
    let second = r#"{"seq":42,"frame":43,"time_us":7,"force":null,"contacts":[],"contact":null,"slip":null,"status":["markers_missing","frame_dropped"]}"#;
    assert_eq!(run.stdout, format!("{JSON_41}\n{second}\n"));
    assert_eq!(
        run.stderr,
        "2 frames shown, 2 received, 0 lost\n\
         lost: 0 samples on the way (gaps in the sequence), 0 frames not processed (gaps in the \
         frame number); rejected here: 0 messages, 0 bytes\n\
         device: 0 frames exposed, 0 processed; dropped: busy 0, overrun 0, size 0, set-up 0, \
         USB 0; camera timeouts 0, restarts 0, overruns 0; commands rejected 0; \
         last frame took 0 µs, its sample was ready 0 µs after the middle of its exposure\n\
         without a force: 1 (markers_missing 1)\n"
    );
    assert_eq!(run.code, Some(0));
}

#[test]
fn the_device_is_asked_started_stopped_and_asked_again() {
    let device = FakeDevice::on_tcp([streaming(samples(0..1))]);
    run(&["monitor", "--port", &device.port, "--frames", "1"]);
    let commands: Vec<_> = device.commands.iter().collect();
    assert_eq!(
        commands,
        [
            Request::GetInfo,
            Request::Start,
            Request::Stop,
            Request::GetInfo
        ]
    );
}

#[test]
fn csv_has_a_header() {
    let device = FakeDevice::on_tcp([streaming(vec![sample(41, 42), without_force(42, 43)])]);
    let run = run(&["monitor", "--port", &device.port, "--csv", "--frames", "2"]);
    assert_eq!(
        run.stdout,
        "seq,frame,time_us,alpha_deg,beta_deg,magnitude_n,x_n,y_n,z_n,\
         direction_sigma_deg,magnitude_sigma_n,place_x_mm,place_y_mm,place_sigma_mm,torque_z_nm,torque_sigma_nm,\
         contact,slip,status,\
         contact1_alpha_deg,contact1_beta_deg,contact1_magnitude_n,\
         contact1_x_n,contact1_y_n,contact1_z_n,\
         contact1_direction_sigma_deg,contact1_magnitude_sigma_n,contact1_place_x_mm,\
         contact1_place_y_mm,contact1_place_sigma_mm,\
         contact1_torque_z_nm,contact1_torque_sigma_nm,\
         contact2_alpha_deg,contact2_beta_deg,contact2_magnitude_n,\
         contact2_x_n,contact2_y_n,contact2_z_n,\
         contact2_direction_sigma_deg,contact2_magnitude_sigma_n,contact2_place_x_mm,\
         contact2_place_y_mm,contact2_place_sigma_mm,\
         contact2_torque_z_nm,contact2_torque_sigma_nm\n\
         41,42,1399986,-5.000,2.500,0.100000,-0.008707,0.004362,-0.099525,\
         0.480,0.000900,1.250,-0.730,0.085,,,true,false,not_calibrated|contact,\
         -5.000,2.500,0.100000,-0.008707,0.004362,-0.099525,\
         0.480,0.000900,1.250,-0.730,0.085,,,,,,,,,,,,,,,\n\
         42,43,7,,,,,,,,,,,,,,,,markers_missing|frame_dropped,,,,,,,,,,,,,,,,,,,,,,,,,,\n"
    );
    assert_eq!(run.code, Some(0));
}

#[test]
fn a_person_sees_columns_and_the_summary_on_a_pseudo_terminal() {
    let device = FakeDevice::on_pty(streaming(vec![sample(41, 42)]));
    let run = run(&["monitor", "--port", &device.port, "--frames", "1"]);
    assert_eq!(run.stderr, "");
    let lines: Vec<_> = run.stdout.lines().collect();
    assert_eq!(
        lines[..5],
        [
            r"     seq   frame         time        α        β      |F|       Fx       Fy       Fz  place x  place y  place ±  contact  status",
            r"                            s        °        °       mN       mN       mN       mN       mm       mm       mm",
            r"      41      42     1.399986   -5.000    2.500  100.000   -8.707    4.362  -99.525    1.250   -0.730    0.085      yes  not_calibrated",
            "",
            "1 frames shown, 1 received, 0 lost",
        ]
    );
    assert_eq!(run.code, Some(0));
}

#[test]
fn losses_are_counted_by_cause() {
    let script: Script = Box::new(|device| {
        device.stats = Stats {
            frames_exposed: 100,
            uptime_us: 10,
            ..Stats::default()
        };
        if !device.until_start() {
            return;
        }
        device.send(sample(10, 20));
        device.raw(b"garbage in between\0");
        device.send(sample(13, 23));
        device.raw(&[3, 4, 6, 5, 9, 0xe7, 9, 0xb7, 0]);
        device.send(sample(14, 26));
        device.stats = Stats {
            frames_exposed: 107,
            frames_processed: 5,
            dropped_busy: 2,
            usb_dropped: 2,
            camera_timeouts: 1,
            dropped_setup: 3,
            processing_us: 5300,
            latency_us: 4800,
            uptime_us: 20,
            ..Stats::default()
        };
        device.serve();
    });
    let device = FakeDevice::on_tcp([script]);
    let run = run(&["monitor", "--port", &device.port, "--json", "--frames", "3"]);
    assert_eq!(
        run.stderr,
        "3 frames shown, 3 received, 4 lost\n\
         lost: 2 samples on the way (gaps in the sequence), 2 frames not processed (gaps in the \
         frame number); rejected here: 2 messages, 26 bytes (overlong 0, cobs 1, crc 1, body 0, \
         trailing 0)\n\
         device: 7 frames exposed, 5 processed; dropped: busy 2, overrun 0, size 0, set-up 3, USB \
         2; camera timeouts 1, restarts 0, overruns 0; commands rejected 0; last frame took 5300 \
         µs, its sample was ready 4800 µs after the middle of its exposure\n"
    );
    assert_eq!(run.code, Some(0));
}

#[test]
fn what_is_left_over_from_before_the_hello_is_ignored() {
    let script: Script = Box::new(|device| {
        device.raw(&[9, 9, 9]);
        device.send(sample(1, 1));
        device.send(sample(2, 2));
        if device.until_start() {
            device.send(sample(7, 7));
            device.serve();
        }
    });
    let device = FakeDevice::on_tcp([script]);
    let run = run(&["monitor", "--port", &device.port, "--json", "--frames", "1"]);
    assert_eq!(sequence_numbers(&run.stdout), [7]);
    assert!(
        run.stderr
            .starts_with("1 frames shown, 1 received, 0 lost\n"),
        "{}",
        run.stderr
    );
    assert!(
        run.stderr.contains("rejected here: 0 messages"),
        "{}",
        run.stderr
    );
}

/// The port stays open, but the device behind it was unplugged or restarted and has lost the
/// conversation. The output is read only after the device has sent everything; none of it is lost.
#[test]
fn it_ends_after_the_given_time() {
    let device = FakeDevice::on_tcp([streaming(samples(0..2))]);
    let run = run(&[
        "monitor",
        "--port",
        &device.port,
        "--json",
        "--seconds",
        "0.5",
    ]);
    assert_eq!(sequence_numbers(&run.stdout), [0, 1]);
    assert_eq!(run.code, Some(0));
}

#[test]
fn log_lines_go_to_standard_error() {
    let log = DeviceMessage::Log(LogLine {
        level: LogLevel::Warning,
        time_us: 2_500_000,
        text: "camera silent, restarting".try_into().unwrap(),
    });
    let device = FakeDevice::on_tcp([streaming(vec![log, sample(0, 0)])]);
    let run = run(&["monitor", "--port", &device.port, "--json", "--frames", "1"]);
    assert!(
        run.stderr
            .starts_with("device, 2.500 s, warning: camera silent, restarting\n"),
        "{}",
        run.stderr
    );
}

#[test]
fn the_truth_stands_beside_and_is_compared() {
    let mut log = tempfile::NamedTempFile::new().unwrap();
    // The sample's exact force, twice the force in the same direction, and a force at a right
    // angle. The sample's place, a place half a millimetre away, and no place.
    for (frame, magnitude, [x, y, z], place) in [
        (
            1,
            0.1,
            [-0.008707, 0.004362, -0.099525],
            "1.25,\"place_y_mm\":-0.73",
        ),
        (
            2,
            0.2,
            [-0.017414, 0.008724, -0.19905],
            "1.65,\"place_y_mm\":-0.43",
        ),
        (3, 0.01, [0.004362, 0.008707, 0.0], "null"),
    ] {
        writeln!(
            log,
            r#"{{"frame":{frame},"time_us":1,"alpha_deg":-5,"beta_deg":2.5,"magnitude_n":{magnitude},"x_n":{x},"y_n":{y},"z_n":{z},"place_x_mm":{place}}}"#
        )
        .unwrap();
    }
    let path = log.path().to_str().unwrap();
    let device = FakeDevice::on_tcp([streaming(vec![
        sample(0, 1),
        sample(1, 2),
        sample(2, 3),
        sample(3, 4),
        without_force(4, 5),
    ])]);
    let run = run(&[
        "monitor",
        "--port",
        &device.port,
        "--frames",
        "5",
        "--truth",
        path,
    ]);
    let lines: Vec<_> = run.stdout.lines().collect();
    assert_eq!(
        lines[3],
        r"       1       2     0.066666   -5.000    2.500  100.000   -8.707    4.362  -99.525    1.250   -0.730    0.085      yes   -5.000    2.500  200.000    1.650   -0.430  not_calibrated"
    );
    assert!(
        lines[4].ends_with(
            "    0.085      yes   -5.000    2.500   10.000        –        –  not_calibrated"
        ),
        "{}",
        lines[4]
    );
    assert!(
        lines[5].ends_with(
            "    0.085      yes        ?        ?        ?        ?        ?  not_calibrated"
        ),
        "{}",
        lines[5]
    );
    let tail = &lines[lines.len() - 3..];
    assert_eq!(
        tail,
        [
            "mean direction error: 30.000° over 3 frames with a force, 0.000° over 2 frames with \
             true |F| ≥ 50 mN",
            "RMSE of |F|: 77.675 mN over 3 frames",
            "RMSE of the place: 353.6 µm over 2 frames",
        ]
    );
    assert_eq!(run.code, Some(0));
}

#[test]
fn a_missing_truth_file_is_named() {
    let run = run(
        &"monitor --port tcp:127.0.0.1:9 --truth /nowhere/truth.jsonl"
            .split(' ')
            .collect::<Vec<_>>(),
    );
    assert_eq!(run.code, Some(1));
    assert!(
        run.stderr
            .starts_with("hivtac: cannot open the truth file /nowhere/truth.jsonl: "),
        "{}",
        run.stderr
    );
}
