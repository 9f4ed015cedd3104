//! The simulated sensor, frame by frame: its film is pressed by hand.

use hivtac_host::live::camera::Kind;
use hivtac_host::live::device::Device;
use hivtac_host::live::eye::{Disturbances, Eye, Presses};
use hivtac_host::live::hand::{Fingers, Hand, Press};
use hivtac_host::live::run::{Due, FrameTruth, Frames, device_id};
use hivtac_twin::{Layout, units};
use hivtac_wire::frame::{MAX_DEVICE_FRAME, encode};

/// Most frames of one turn, so that the page's other work is not late.
const AT_ONCE: usize = 4;
/// Seed of the noise.
const SEED: u64 = 1;

/// A simulated sensor with a film at rest.
pub struct Simulated {
    device: Device,
    frames: Frames,
    hand: Hand,
}

impl Simulated {
    /// Starts it, with a layout of dots.
    ///
    /// # Errors
    /// When the scene cannot be made; the text says why.
    pub fn start(kind: Kind, layout: Layout, now_us: u64) -> Result<Simulated, String> {
        let scene = kind
            .scene("rest", layout, SEED)
            .map_err(|error| error.to_string())?;
        let hand = Hand::default();
        let usual = Disturbances::default();
        let eye = Eye::new(kind, scene, Presses::Scene, usual, hand.clone())
            .map_err(|error| error.to_string())?;
        let device = Device::new(kind, layout, device_id(kind, units::NOMINAL), 1.0);
        let frames = Frames::new(eye, &device.camera(), now_us);
        Ok(Simulated {
            device,
            frames,
            hand,
        })
    }

    /// Presses the film in this way from now on.
    pub fn press(&self, fingers: Fingers) {
        self.hand
            .set(fingers.map(|touch| touch.and_then(Press::in_range)));
    }

    /// Takes the frames that are due; returns the truth in each, and the time to the next one, µs.
    pub fn turn(&mut self, now: &dyn Fn() -> u64) -> (Vec<FrameTruth>, u64) {
        let mut truths = Vec::new();
        for _ in 0..AT_ONCE {
            let camera = self.device.camera();
            match self.frames.due(&camera, now()) {
                Due::In(wait_us) => return (truths, wait_us),
                Due::Now(late) => {
                    if late > 0 {
                        self.device.missed(late);
                    }
                    let (captured, truth, missed) = self.frames.take(camera);
                    truths.push(truth);
                    self.device.frame(&captured, missed, now);
                }
            }
        }
        (truths, 0)
    }

    /// Takes bytes of the host.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64) {
        self.device.receive(bytes, now_us);
    }

    /// The bytes for the host.
    pub fn sent(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut buffer = [0; MAX_DEVICE_FRAME];
        while let Some(message) = self.device.message() {
            if let Ok(frame) = encode(&message, &mut buffer) {
                bytes.extend_from_slice(frame);
            }
        }
        bytes
    }
}
