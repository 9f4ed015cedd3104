//! The clock: one frame after the other, in real time.

use super::camera::{Camera, Kind};
use super::device::{Captured, Device};
use super::eye::Eye;
use crate::page;
use hivtac_twin::Truth;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Longest sleep, within which a stop is noticed.
const LONGEST_SLEEP: Duration = Duration::from_millis(50);
/// Number of frames that may be late; more are left out.
const LATE: u64 = 2;

/// The true press in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTruth {
    /// Number of the frame, as in its sample.
    pub frame: u32,
    /// When it was exposed, µs, as in its sample.
    pub time_us: u64,
    /// The truth.
    pub truth: Truth,
}

impl FrameTruth {
    /// The press as the page shows it, in the integers of the wire format.
    pub fn of_page(&self) -> page::Truth {
        let thousandths = |value: f64| (1e3 * value).round() as i64;
        let force = self.truth.force;
        let [x, y, z] = force.vector_n();
        let newtons = [x, y, z, force.magnitude_n()].map(|part| thousandths(1e3 * part));
        let angles = [force.alpha_deg(), force.beta_deg()].map(thousandths);
        let place = self.truth.touches_mm.map(|place| place.map(thousandths));
        page::Truth(self.frame, newtons, angles, place)
    }
}

/// A device that several threads share, and its clock.
#[derive(Clone, Debug)]
pub struct Shared(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    device: Mutex<Device>,
    /// Notified when a message may wait.
    news: Condvar,
    begun: Instant,
}

impl Shared {
    /// Shares a device; its clock begins.
    pub fn new(device: Device) -> Shared {
        Shared(Arc::new(Inner {
            device: Mutex::new(device),
            news: Condvar::new(),
            begun: Instant::now(),
        }))
    }

    /// Time since the start, µs.
    pub fn now_us(&self) -> u64 {
        self.0.begun.elapsed().as_micros() as u64
    }

    /// Locks the device for a moment.
    pub fn device(&self) -> MutexGuard<'_, Device> {
        self.0.device.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Acts on the device and wakes whoever waits for its messages.
    pub fn act<T>(&self, what: impl FnOnce(&mut Device) -> T) -> T {
        let done = what(&mut self.device());
        self.0.news.notify_all();
        done
    }

    /// Takes the next message for the host; waits for one up to `patience`.
    pub fn message(&self, patience: Duration) -> Option<hivtac_wire::message::DeviceMessage> {
        let mut device = self.device();
        if let Some(message) = device.message() {
            return Some(message);
        }
        let news = &self.0.news;
        let waited = news.wait_timeout(device, patience);
        device = waited.unwrap_or_else(PoisonError::into_inner).0;
        device.message()
    }
}

/// The camera's clock and its view, without a thread: whoever runs it waits.
#[derive(Debug)]
pub struct Frames {
    eye: Eye,
    number: u32,
    /// When the next frame begins, µs.
    begins_us: u64,
    missed: bool,
}

/// The task at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// The next frame is whole after this time, µs.
    In(u64),
    /// A frame is whole; this many before it came too late to be taken.
    Now(u32),
}

impl Frames {
    /// A camera that looks from `now_us` on, with the settings of `camera`.
    pub fn new(mut eye: Eye, camera: &Camera, now_us: u64) -> Frames {
        // The film's tables are read at their first use, which takes as long as many frames.
        eye.shot(camera, 0, 0.0);
        Frames {
            eye,
            number: 1,
            begins_us: now_us,
            missed: false,
        }
    }

    /// The next task. Frames that came too late are left out, and must be counted.
    pub fn due(&mut self, camera: &Camera, now_us: u64) -> Due {
        let frame_us = u64::from(camera.frame_us());
        // A frame is whole when the next one begins.
        let due_us = self.begins_us + frame_us;
        if now_us < due_us {
            return Due::In(due_us - now_us);
        }
        let late = (now_us - due_us) / frame_us;
        if late <= LATE {
            return Due::Now(0);
        }
        self.number = self.number.wrapping_add(late as u32);
        self.begins_us += late * frame_us;
        self.missed = true;
        Due::Now(late as u32)
    }

    /// Takes the next frame, and the truth in it. Returns, too, whether frames before it are
    /// missing.
    pub fn take(&mut self, camera: Camera) -> (Captured, FrameTruth, bool) {
        let begun_us = self.begins_us;
        let time_us = begun_us.saturating_add_signed(camera.middle_us().into());
        let shot = (self.eye).shot(&camera, self.number, 1e-6 * time_us as f64);
        let truth = FrameTruth {
            frame: self.number,
            time_us,
            truth: shot.truth,
        };
        let captured = Captured {
            number: self.number,
            begun_us,
            camera,
            words: shot.words,
        };
        self.begins_us += u64::from(camera.frame_us());
        self.number = self.number.wrapping_add(1);
        (captured, truth, std::mem::take(&mut self.missed))
    }
}

/// Frames in real time, for a device that several threads share.
#[derive(Debug)]
pub struct Clock {
    shared: Shared,
    frames: Frames,
}

impl Clock {
    /// A camera that looks from now on.
    pub fn new(shared: Shared, eye: Eye) -> Clock {
        let camera = shared.act(|device| {
            device.set_light(eye.light());
            device.camera()
        });
        let mut frames = Frames::new(eye, &camera, 0);
        frames.begins_us = shared.now_us();
        Clock { shared, frames }
    }

    /// Takes frames in real time until `stop` is true. Calls `tell` with each frame's true press
    /// before its sample can be read.
    pub fn run(&mut self, stop: impl Fn() -> bool, mut tell: impl FnMut(FrameTruth)) {
        while !stop() {
            let camera = self.shared.device().camera();
            match self.frames.due(&camera, self.shared.now_us()) {
                Due::In(wait_us) => {
                    std::thread::sleep(Duration::from_micros(wait_us).min(LONGEST_SLEEP));
                }
                Due::Now(late) => {
                    if late > 0 {
                        self.shared.act(|device| device.missed(late));
                    }
                    let (captured, truth, missed) = self.frames.take(camera);
                    tell(truth);
                    let now = || self.shared.now_us();
                    self.shared
                        .act(|device| device.frame(&captured, missed, now));
                }
            }
        }
    }
}

/// A number for the microcontroller of a twin: its first letters distinguish it from real ones.
pub fn device_id(kind: Kind, unit: u64) -> [u8; 12] {
    let mut id = *b"twin\0\0\0\0\0\0\0\0";
    let number = unit.to_be_bytes();
    if let Some(place) = id.get_mut(4..) {
        place.copy_from_slice(&number);
    }
    if let Some(first) = id.get_mut(4) {
        *first |= match kind {
            Kind::Ov7725 => 0,
            Kind::Ov5640 => 0x40,
            Kind::Mt9v034 => 0x80,
        };
    }
    id
}
