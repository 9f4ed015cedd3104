//! The simulated sensor in a program's own time: the program presses it, and gets the samples of
//! finished frames.

use crate::convert::{self, SampleNumbers};
use crate::error::{Error, raised};
use hivtac_host::contact_shape;
use hivtac_host::live::calibrated::{Calibrated, CalibratedFilm};
use hivtac_host::live::camera::Kind;
use hivtac_host::live::device::Device;
use hivtac_host::live::eye::{Disturbances, Eye, Presses};
use hivtac_host::live::hand::{Hand, Press};
use hivtac_host::live::run::{Due, Frames, device_id};
use hivtac_host::shown::shown;
use hivtac_host::{model_file, reply};
use hivtac_twin::{Layout, Scene, units};
use hivtac_wire::frame::{MAX_HOST_FRAME, encode};
use hivtac_wire::message::{Command, DeviceMessage, HostMessage, LogLevel, Request};
use hivtac_wire::version::HelloPrefix;
use pyo3::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Frames of the tare that it begins with.
const TARE_FRAMES: u16 = 32;
/// Time for the tare and the untouched frames before it, µs.
const BEGINNING_US: u64 = 1_000_000;

/// A simulated sensor.
#[pyclass(frozen)]
pub struct Twin(Mutex<Simulated>);

struct Simulated {
    device: Device,
    frames: Frames,
    hand: Hand,
    /// The device's time, µs, and when that of the program began.
    now_us: u64,
    begun_us: u64,
    last_id: u16,
}

#[pymethods]
impl Twin {
    /// An untouched sensor with a camera, `ov7725`, `ov5640` or `mt9v034`. The seed decides its
    /// noise, the number selects a randomly drawn unit, and the file has its model. With `is_unit`
    /// it is the calibrated unit of that model.
    #[new]
    fn start(
        py: Python<'_>,
        camera: &str,
        contact: &str,
        seed: u64,
        unit: Option<u64>,
        model: Option<&str>,
        is_unit: bool,
    ) -> PyResult<Twin> {
        let kinds = [Kind::Ov7725, Kind::Ov5640, Kind::Mt9v034];
        let kind = kinds.into_iter().find(|kind| kind.name() == camera);
        let no_camera =
            || Error::new_err(format!("camera {camera:?}: use ov7725, ov5640 or mt9v034"));
        let kind = kind.ok_or_else(no_camera)?;
        let shape = contact_shape::parse(contact).map_err(Error::new_err)?;
        if unit.is_some_and(|unit| !units::DRAWN.contains(&unit)) {
            return Err(Error::new_err("a unit's number is from 1 to 1000000"));
        }
        let model = model.map(model_file::read).transpose();
        let model = model.map_err(raised)?;
        let started = py.detach(|| {
            let mut twin = match model {
                Some((file, _)) if is_unit => Simulated::calibrated(kind, seed, file.leak())?,
                model => {
                    let mut twin = Simulated::drawn(kind, seed, unit)?;
                    let files = model.iter().map(|(file, _)| file);
                    for request in files.flat_map(|file| model_file::requests(file)) {
                        twin.ask(request)?;
                    }
                    twin
                }
            };
            twin.command(Request::SetContactShape(shape));
            twin.command(Request::Tare {
                frames: TARE_FRAMES,
            });
            twin.advance(BEGINNING_US);
            twin.begun_us = twin.now_us;
            Ok(twin)
        });
        Ok(Twin(Mutex::new(
            started.map_err(|why: String| Error::new_err(why))?,
        )))
    }

    /// Presses the film from now on: place, mm, |F|, N, α and β, degrees. `None` releases it.
    fn press(&self, touch: Option<([f64; 2], f64, [f64; 2])>) -> PyResult<()> {
        let touch = touch.map(|(place_mm, force_n, angles_deg)| Press {
            place_mm,
            force_n,
            angles_deg,
        });
        if touch.is_some() && touch.and_then(Press::in_range) != touch {
            return Err(Error::new_err(
                "a press out of the sensor's range: up to 0.25 N, within ±4 mm, α and β within ±12°",
            ));
        }
        self.lock().hand.set([touch, None]);
        Ok(())
    }

    /// The samples of the frames that are whole at this time, s since the start.
    fn advance(&self, py: Python<'_>, to_s: f64) -> PyResult<Vec<SampleNumbers>> {
        if !(0.0..1e9).contains(&to_s) {
            return Err(Error::new_err(format!("{to_s} s is no time")));
        }
        Ok(py.detach(|| {
            let mut twin = self.lock();
            let to_us = twin.begun_us + (to_s * 1e6).round() as u64;
            twin.advance(to_us)
        }))
    }
}

impl Twin {
    fn lock(&self) -> std::sync::MutexGuard<'_, Simulated> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Simulated {
    fn drawn(kind: Kind, seed: u64, unit: Option<u64>) -> Result<Simulated, String> {
        let layout = Layout::default();
        let scene = kind.scene("rest", layout, seed);
        let scene = scene.and_then(|scene| match unit {
            Some(unit) => units::as_unit(unit, scene),
            None => Ok(scene),
        });
        let scene = scene.map_err(|error| error.to_string())?;
        let id = device_id(kind, unit.unwrap_or(units::NOMINAL));
        let device = Device::new(kind, layout, id, 1.0);
        Simulated::start(kind, scene, None, device)
    }

    /// A calibrated unit, whose model is kept until the program ends.
    fn calibrated(kind: Kind, seed: u64, file: &'static [u8]) -> Result<Simulated, String> {
        let unit = Calibrated::of(kind, file)?;
        let scene = kind.scene("rest", unit.layout, seed);
        let seen = scene.and_then(|scene| unit.seen(scene));
        let (scene, film) = seen.map_err(|error| error.to_string())?;
        let device = Device::with_model(kind, unit.file, unit.device_id, 1.0);
        Simulated::start(kind, scene, Some(film), device)
    }

    fn start(
        kind: Kind,
        scene: Scene,
        film: Option<CalibratedFilm>,
        device: Device,
    ) -> Result<Simulated, String> {
        let hand = Hand::at_once();
        let usual = Disturbances::default();
        let mut eye = Eye::new(kind, scene, Presses::Scene, usual, hand.clone())
            .map_err(|error| error.to_string())?;
        if let Some(film) = film {
            eye = eye.with_film(film);
        }
        let frames = Frames::new(eye, &device.camera(), 0);
        let mut twin = Simulated {
            device,
            frames,
            hand,
            now_us: 0,
            begun_us: 0,
            last_id: 0,
        };
        twin.send(&HostMessage::Hello(HelloPrefix::OURS.into()));
        twin.command(Request::StartWithMarkers);
        Ok(twin)
    }

    fn send(&mut self, message: &HostMessage) {
        let mut buffer = [0; MAX_HOST_FRAME];
        match encode(message, &mut buffer) {
            Ok(frame) => self.device.receive(frame, self.now_us),
            Err(error) => unreachable!("{error:?}: MAX_HOST_FRAME holds every message"),
        }
    }

    fn command(&mut self, request: Request) {
        self.last_id += 1;
        let id = self.last_id;
        self.send(&HostMessage::Command(Command { id, request }));
    }

    /// Sends a command that is answered at once, or with the next frames, and waits for that.
    fn ask(&mut self, request: Request) -> Result<(), String> {
        let what = reply::name_of(&request);
        self.command(request);
        let mut why = String::new();
        for _ in 0..TARE_FRAMES {
            while let Some(message) = self.device.message() {
                match message {
                    DeviceMessage::Log(line) if line.level == LogLevel::Error => {
                        why = format!(": {}", shown(&line.text));
                    }
                    DeviceMessage::Reply(reply) if reply.id == self.last_id => {
                        let judged = reply::judge(what, reply.outcome);
                        return judged.map_err(|failure| format!("{failure}{why}"));
                    }
                    _ => {}
                }
            }
            self.frame(u64::MAX);
        }
        Err(format!("the simulated sensor did not answer \"{what}\""))
    }

    /// Takes the next frame if it is whole by then.
    fn frame(&mut self, to_us: u64) -> bool {
        loop {
            let camera = self.device.camera();
            match self.frames.due(&camera, self.now_us) {
                Due::In(wait_us) if self.now_us + wait_us > to_us => return false,
                Due::In(wait_us) => self.now_us += wait_us,
                Due::Now(_) => break,
            }
        }
        let (captured, _, missed) = self.frames.take(self.device.camera());
        let now_us = self.now_us;
        self.device.frame(&captured, missed, || now_us);
        true
    }

    /// Takes each frame when it is whole; other messages of the device are left out.
    fn advance(&mut self, to_us: u64) -> Vec<SampleNumbers> {
        let mut samples = Vec::new();
        while self.frame(to_us) {
            self.tell(&mut samples);
        }
        self.now_us = self.now_us.max(to_us);
        samples
    }

    fn tell(&mut self, samples: &mut Vec<SampleNumbers>) {
        let now_us = self.now_us;
        while let Some(message) = self.device.message() {
            if let DeviceMessage::Sample(mut sample) = message {
                sample.time_us = sample.time_us.saturating_sub(self.begun_us);
                let whole_us = now_us - self.begun_us.min(now_us);
                let exposed_ns = 1000 * sample.time_us;
                samples.push(convert::sample(&sample, 1000 * whole_us, exposed_ns));
            }
        }
    }
}
