//! Frames whose samples are the same bytes on every machine, in WebAssembly too.

use hivtac_host::live::camera::Kind;
use hivtac_host::live::device::{Captured, Device};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_twin::Layout;
use hivtac_wire::frame::{CRC32, MAX_DEVICE_FRAME, MAX_HOST_FRAME, encode};
use hivtac_wire::message::{Command, DeviceMessage, HostMessage, Request};
use hivtac_wire::version::HelloPrefix;

/// Seed of the scene.
const SEED: u64 = 5;

/// The sums of some frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Summed {
    /// CRC-32 of all pixels and of all samples as they are sent.
    pub crc: u32,
    /// Number of samples with a force.
    pub forces: u32,
}

/// Renders frames of the demo's wandering tip, measures each as a new device would, and sums pixels
/// and samples.
///
/// # Errors
/// When the scene cannot be made.
pub fn sum(kind: Kind, frames: u32) -> Result<Summed, String> {
    let scene = kind
        .scene("demo", Layout::default(), SEED)
        .map_err(|error| error.to_string())?;
    let mut device = Device::new(kind, Layout::default(), [0; 12], 1.0);
    for message in greeting() {
        let mut buffer = [0; MAX_HOST_FRAME];
        if let Ok(frame) = encode(&message, &mut buffer) {
            device.receive(frame, 0);
        }
    }
    let mut digest = CRC32.digest();
    let mut forces = 0;
    for number in 1..=frames {
        let camera = device.camera();
        let begun_us = u64::from(number) * u64::from(camera.frame_us());
        let time_us = begun_us.saturating_add_signed(camera.middle_us().into());
        let shot = scene.frame_by(&camera.shutter(), number.into(), 1e-6 * time_us as f64);
        let words = shot.words().into_owned();
        for word in &words {
            digest.update(&word.to_le_bytes());
        }
        let words = match kind {
            // The camera sends the high byte first.
            Kind::Ov7725 | Kind::Ov5640 => words.iter().map(|word| word.swap_bytes()).collect(),
            Kind::Mt9v034 => words,
        };
        let captured = Captured {
            number,
            begun_us,
            camera,
            words,
        };
        device.frame(&captured, false, || time_us);
        while let Some(message) = device.message() {
            let DeviceMessage::Sample(sample) = &message else {
                continue;
            };
            forces += u32::from(sample.force.is_some());
            let mut buffer = [0; MAX_DEVICE_FRAME];
            if let Ok(frame) = encode(&message, &mut buffer) {
                digest.update(frame);
            }
        }
    }
    Ok(Summed {
        crc: digest.finalize(),
        forces,
    })
}

/// The host's messages, after which samples with markers come.
fn greeting() -> [HostMessage; 3] {
    let command = |id, request| HostMessage::Command(Command { id, request });
    [
        HostMessage::Hello(HelloPrefix::OURS.into()),
        command(1, Request::SetContactShape(ContactShape::Needle)),
        command(2, Request::StartWithMarkers),
    ]
}
