//! A fake sensor whose film is a formula, and a hand that presses it.

use hivtac_terms::force::{ContactList, Force, Place};
use hivtac_terms::units::{
    MicroNewtons, MilliDegrees, Px, UnsignedMicroNewtons, UnsignedMilliDegrees,
};
use std::f64::consts::TAU;
use std::fs::File;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::down::Direction;
use hivtac_terms::fixed::Q;
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{HsvBox, PixelFormat, Threshold};
use hivtac_wire::decoder::{Decoder, Received};
use hivtac_wire::frame::{HOST_FRAME_LIMIT, MAX_DEVICE_FRAME, encode};
use hivtac_wire::message::{
    DeviceHello, DeviceMessage, HostMessage, ModelIdentity, ModelSource, Outcome, PROTOCOL_VERSION,
    Reply, Request, Sample,
};
use hivtac_wire::settings::{RestPosition, TareReport};
use hivtac_wire::version::SCHEMA_HASH;

/// The hand's force at a time of the sensor, N; it begins after a second.
pub fn press_n(time_s: f64) -> f64 {
    let t = time_s - 1.0;
    let swing = |hz: f64| (TAU * hz * t).sin();
    let force = 0.09 - 0.09 * (TAU * 0.4 * t).cos() + 0.02 * swing(0.77) + 0.01 * swing(1.3);
    if t < 0.0 { 0.0 } else { force.clamp(0.0, 0.2) }
}

/// The force with this size, N, and these angles, degrees, in the film frame, N.
pub fn force_n(size: f64, [alpha, beta]: [f64; 2]) -> [f64; 3] {
    let (sin_a, cos_a) = alpha.to_radians().sin_cos();
    let (sin_b, cos_b) = beta.to_radians().sin_cos();
    [sin_a * cos_b, sin_b, -cos_a * cos_b].map(|part| size * part)
}

/// The markers under a force: spread with its square root, shifted in proportion.
pub fn markers(force: [f64; 3]) -> [Marker; 4] {
    let apart = 40.0 * (-force[2]).max(0.0).sqrt();
    let marker = |x: f64, y: f64| Marker {
        x: Px(((160.0 + x * (44.0 + apart) + 60.0 * force[0]) * 65_536.0).round() as i32),
        y: Px(((120.0 + y * (44.0 + apart) + 60.0 * force[1]) * 65_536.0).round() as i32),
        area: 190,
    };
    [
        marker(-1.0, -1.0),
        marker(1.0, -1.0),
        marker(1.0, 1.0),
        marker(-1.0, 1.0),
    ]
}

/// The hello of a sensor whose model is for this many markers; without any, it has no model.
fn hello(markers: Option<u8>) -> DeviceHello {
    let threshold = Threshold::Rgb565(HsvBox::of_limits([170, 10, 100, 255, 45, 255]));
    DeviceHello {
        protocol: PROTOCOL_VERSION,
        schema: SCHEMA_HASH,
        device_id: [1; 12],
        board: "fake".try_into().unwrap(),
        firmware: "fake".try_into().unwrap(),
        model: markers.map(|markers| ModelIdentity {
            crc: 1,
            name: "fake".try_into().unwrap(),
            markers,
            simulated: true,
            threshold,
            source: ModelSource::BuiltIn,
        }),
        width: 320,
        height: 240,
        threshold,
        preset: "ov7725".try_into().unwrap(),
        dilations: 1,
        centroid: CentroidEstimator::RednessWeighted,
        name: Default::default(),
        filter: Default::default(),
    }
}

/// Returns the sensor's time of the next frame.
pub type Clock = Box<dyn FnMut() -> f64 + Send>;

/// The sample of a frame, by the frame's number and the number of starts of samples before it. Both
/// count from 1.
pub type Film = Box<dyn FnMut(u32, u32) -> Sample + Send>;

/// A sensor on a TCP port, whose film is pressed in the pose set by the test.
pub struct FakeSensor {
    pub port: String,
    pub pose: Arc<Mutex<[f64; 2]>>,
    /// The answer to a tare.
    pub tare: Arc<Mutex<Outcome>>,
    /// Number of markers that its model is for; none without a model.
    pub markers: Arc<Mutex<Option<u8>>>,
}

impl FakeSensor {
    /// Every seventh frame lacks a marker, and every eleventh one is half covered. The sensor
    /// disappears after `after` frames of a conversation.
    pub fn start(mut clock: Clock, after: usize) -> Self {
        let pose = Arc::new(Mutex::new([0.0; 2]));
        let set = pose.clone();
        let film = Box::new(move |frame, _| sample(frame, clock(), *set.lock().unwrap()));
        Self {
            pose,
            ..Self::of_film(film, after)
        }
    }

    /// A sensor that measures this film; it disappears after `after` frames of a conversation.
    pub fn of_film(mut film: Film, after: usize) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = format!("tcp:{}", listener.local_addr().unwrap());
        let tare = Arc::new(Mutex::new(Outcome::Done));
        let markers = Arc::new(Mutex::new(None));
        let (answered, of_model) = (tare.clone(), markers.clone());
        std::thread::spawn(move || {
            let mut counts = [0, 0];
            while let Ok((stream, _)) = listener.accept() {
                let reported = (*answered.lock().unwrap(), *of_model.lock().unwrap());
                talk(stream, &mut film, reported, &mut counts, after);
            }
        });
        Self {
            port,
            pose: Arc::default(),
            tare,
            markers,
        }
    }
}

fn talk(
    mut stream: TcpStream,
    film: &mut Film,
    reported: (Outcome, Option<u8>),
    [frame, start]: &mut [u32; 2],
    after: usize,
) {
    stream
        .set_read_timeout(Some(Duration::from_millis(1)))
        .unwrap();
    let mut decoder = Decoder::<HOST_FRAME_LIMIT>::new();
    let (mut streaming, mut sent) = (false, 0);
    loop {
        let mut bytes = [0; 64];
        match stream.read(&mut bytes) {
            Ok(0) => return,
            Ok(count) => {
                let mut bytes = &bytes[..count];
                while let Some(message) = decoder.feed::<HostMessage>(&mut bytes) {
                    let Received::Message(message) = message else {
                        return;
                    };
                    let was = streaming;
                    answer(&mut stream, message, reported, &mut streaming);
                    *start += u32::from(streaming && !was);
                }
            }
            Err(_) if !streaming => continue,
            Err(_) => {}
        }
        if streaming {
            sent += 1;
            if sent > after {
                return;
            }
            *frame += 1;
            send(&mut stream, &DeviceMessage::Sample(film(*frame, *start)));
        }
    }
}

fn answer(
    stream: &mut TcpStream,
    message: HostMessage,
    (tare, markers): (Outcome, Option<u8>),
    streaming: &mut bool,
) {
    match message {
        HostMessage::Hello(_) => send(stream, &DeviceMessage::Hello(hello(markers))),
        HostMessage::Down(_) => {}
        HostMessage::Command(hivtac_wire::message::Command { id, request }) => {
            let mut outcome = Outcome::Done;
            match request {
                Request::Tare { .. } => {
                    send(stream, &DeviceMessage::Tared(tared()));
                    outcome = tare;
                }
                Request::StartWithMarkers => *streaming = true,
                Request::Stop => *streaming = false,
                other => panic!("{other:?} was not expected"),
            }
            send(stream, &DeviceMessage::Reply(Reply { id, outcome }));
        }
    }
}

/// A tare while the film lies above its camera.
fn tared() -> TareReport {
    TareReport {
        rest: RestPosition {
            format: PixelFormat::Rgb565,
            dilations: 1,
            centroid: CentroidEstimator::BinaryMask,
            markers: markers([0.0; 3]).into(),
            rect_center: (Px(160 << 16), Px(120 << 16)),
            rect_area: Q::from_bits((88 * 88) << 16),
            down: Some(Direction([0, 0, -1000])),
        },
        spread: Px(0),
        moved: None,
    }
}

fn sample(frame: u32, time_s: f64, pose: [f64; 2]) -> Sample {
    let found = !frame.is_multiple_of(7);
    let covered = frame.is_multiple_of(11);
    let mut seen = markers(force_n(press_n(time_s), pose));
    if covered {
        seen[2].x.0 -= 5 << 16;
    }
    Sample {
        sequence: frame,
        frame,
        time_us: (time_s * 1e6) as u64,
        status: match (found, covered) {
            (false, _) => Status::MARKERS_MISSING,
            (true, true) => Status::MODEL_MISSING | Status::MARKERS_IMPLAUSIBLE,
            (true, false) => Status::MODEL_MISSING,
        },
        force: None,
        contacts: ContactList::default(),
        markers: if found {
            seen.into()
        } else {
            MarkerList::default()
        },
    }
}

/// A sample of a film under a straight force, N. Its force, µN, and place are those of a model that
/// does not know the unit.
pub fn pressed(
    frame: u32,
    time_s: f64,
    size_n: f64,
    (felt, place): (i32, Option<Place>),
) -> Sample {
    Sample {
        sequence: frame,
        frame,
        time_us: (time_s * 1e6) as u64,
        status: Status::NOT_CALIBRATED,
        force: Some(Force {
            alpha: MilliDegrees(0),
            beta: MilliDegrees(0),
            magnitude: MicroNewtons(felt),
            cartesian: [0, 0, -felt].map(MicroNewtons),
            direction_sigma: UnsignedMilliDegrees(10_000),
            magnitude_sigma: UnsignedMicroNewtons(20_000),
            place,
        }),
        contacts: ContactList::default(),
        markers: markers(force_n(size_n, [0.0; 2])).into(),
    }
}

fn send(stream: &mut TcpStream, message: &DeviceMessage) {
    let mut buffer = [0; MAX_DEVICE_FRAME];
    // A write to a host that is gone may fail; the next read notices it.
    let _ = stream.write_all(encode(message, &mut buffer).unwrap());
}

/// Starts `hivtac-calibrate ARGUMENTS` with its input and outputs connected.
pub fn start(here: &Path, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_hivtac-calibrate"))
        .current_dir(here)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::from(File::create(here.join("said")).unwrap()))
        .spawn()
        .unwrap()
}

/// Runs it to its end, with lines on its standard input.
pub fn run(here: &Path, arguments: &[&str], lines: &str) -> (Output, String) {
    let mut child = start(here, arguments);
    child
        .stdin
        .take()
        .unwrap()
        .write_all(lines.as_bytes())
        .unwrap();
    let output = child.wait_with_output().unwrap();
    (output, std::fs::read_to_string(here.join("said")).unwrap())
}

/// Its standard output; it must have succeeded.
pub fn stdout((output, said): (Output, String)) -> String {
    assert!(output.status.success(), "{said}");
    String::from_utf8(output.stdout).unwrap()
}
