//! A device in a test's conversation, frame by frame.

use super::device::{Captured, Device};
use super::eye::Eye;
use hivtac_wire::frame::{MAX_HOST_FRAME, encode};
use hivtac_wire::message::{Command, DeviceMessage, HostMessage, Request, Sample};
use hivtac_wire::version::HelloPrefix;

/// A device with its camera's view.
pub struct Tested {
    pub device: Device,
    eye: Eye,
    number: u32,
}

impl Tested {
    pub fn new(device: Device, eye: Eye) -> Tested {
        Tested {
            device,
            eye,
            number: 0,
        }
    }

    /// Sends a message; returns those that come at once.
    pub fn send(&mut self, message: &HostMessage) -> Vec<DeviceMessage> {
        let mut buffer = [0; MAX_HOST_FRAME];
        self.device
            .receive(encode(message, &mut buffer).unwrap(), 0);
        self.messages()
    }

    fn messages(&mut self) -> Vec<DeviceMessage> {
        std::iter::from_fn(|| self.device.message()).collect()
    }

    pub fn greet(&mut self) {
        let messages = self.send(&HostMessage::Hello(HelloPrefix::OURS.into()));
        assert!(
            matches!(messages[..], [DeviceMessage::Hello(_)]),
            "{messages:?}"
        );
    }

    /// Sends a command; returns the messages that come at once.
    pub fn ask(&mut self, id: u16, request: Request) -> Vec<DeviceMessage> {
        self.send(&HostMessage::Command(Command { id, request }))
    }

    /// The next frame; returns it with the messages that come of it.
    pub fn frame(&mut self) -> (Captured, Vec<DeviceMessage>) {
        self.number += 1;
        let camera = self.device.camera();
        let begun_us = 6_405 * u64::from(self.number);
        let shot = self.eye.shot(&camera, self.number, 1e-6 * begun_us as f64);
        let frame = Captured {
            number: self.number,
            begun_us,
            camera,
            words: shot.words,
        };
        self.device.frame(&frame, false, || begun_us + 6_405);
        (frame, self.messages())
    }

    /// The sample of the next frame.
    pub fn sample(&mut self) -> Sample {
        let (_, messages) = self.frame();
        let sample = messages.into_iter().find_map(|message| match message {
            DeviceMessage::Sample(sample) => Some(sample),
            _ => None,
        });
        sample.unwrap()
    }
}
