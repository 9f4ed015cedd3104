//! The clock: one frame after the other, in real time.

use crate::camera::Kind;
use crate::device::{Captured, Device};
use crate::eye::Eye;
use hivtac_twin::Truth;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Longest sleep, within which a stop is noticed.
const LONGEST_SLEEP: Duration = Duration::from_millis(50);
/// Number of frames that may be late; more are left out.
const LATE: u64 = 2;

/// The true press in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// Number of the frame, as in its sample.
    pub frame: u32,
    /// When it was exposed, µs, as in its sample.
    pub time_us: u64,
    /// The truth.
    pub truth: Truth,
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

/// The camera's clock and its view.
#[derive(Debug)]
pub struct Clock {
    shared: Shared,
    eye: Eye,
    number: u32,
    /// When the next frame begins, µs.
    begins_us: u64,
    missed: bool,
}

impl Clock {
    /// A camera that looks from now on.
    pub fn new(shared: Shared, mut eye: Eye) -> Clock {
        let camera = shared.act(|device| {
            device.set_light(eye.light());
            device.camera()
        });
        // The film's tables are read at their first use, which takes as long as many frames.
        eye.shot(&camera, 0, 0.0);
        let begins_us = shared.now_us();
        Clock {
            shared,
            eye,
            number: 1,
            begins_us,
            missed: false,
        }
    }

    /// Takes frames in real time until `stop` says so. `tell` hears of each frame's true press
    /// before its sample can be read.
    pub fn run(&mut self, stop: impl Fn() -> bool, mut tell: impl FnMut(Told)) {
        while !stop() {
            let frame_us = u64::from(self.shared.device().camera().frame_us());
            // A frame is whole when the next one begins.
            let due_us = self.begins_us + frame_us;
            let now_us = self.shared.now_us();
            if now_us < due_us {
                let wait = Duration::from_micros(due_us - now_us);
                std::thread::sleep(wait.min(LONGEST_SLEEP));
                continue;
            }
            let late = (now_us - due_us) / frame_us;
            if late > LATE {
                self.leave_out(late, frame_us);
            }
            self.take(&mut tell);
        }
    }

    fn leave_out(&mut self, frames: u64, frame_us: u64) {
        self.shared.act(|device| device.missed(frames as u32));
        self.number = self.number.wrapping_add(frames as u32);
        self.begins_us += frames * frame_us;
        self.missed = true;
    }

    /// Takes a frame and measures it.
    fn take(&mut self, tell: &mut impl FnMut(Told)) {
        let camera = self.shared.device().camera();
        let begun_us = self.begins_us;
        let time_us = begun_us.saturating_add_signed(camera.middle_us().into());
        let shot = self.eye.shot(&camera, self.number, 1e-6 * time_us as f64);
        tell(Told {
            frame: self.number,
            time_us,
            truth: shot.truth,
        });
        let captured = Captured {
            number: self.number,
            begun_us,
            camera,
            words: shot.words,
        };
        let missed = std::mem::take(&mut self.missed);
        let shared = &self.shared;
        shared.act(|device| device.frame(&captured, missed, shared.now_us()));
        self.begins_us += u64::from(camera.frame_us());
        self.number = self.number.wrapping_add(1);
    }
}

/// A number for the microcontroller of a twin: told from real ones by its first letters.
pub fn device_id(kind: Kind, unit: u64) -> [u8; 12] {
    let mut id = *b"twin\0\0\0\0\0\0\0\0";
    let number = unit.to_be_bytes();
    if let Some(place) = id.get_mut(4..) {
        place.copy_from_slice(&number);
    }
    if kind == Kind::Mt9v034
        && let Some(first) = id.get_mut(4)
    {
        *first |= 0x80;
    }
    id
}
