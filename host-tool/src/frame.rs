//! Takes a snapshot: one frame as the device captured it, with its pixels.

use crate::failure::{Failure, Kind};
use crate::reply::judge;
use hivtac_terms::threshold::{PixelFormat, Threshold};
use hivtac_wire::message::{DeviceMessage, Outcome, Sample, Snapshot, SnapshotPart};
use std::collections::VecDeque;
use std::time::Duration;

/// Longest time that the device itself waits for a whole frame.
pub const DEVICE_PATIENCE: Duration = Duration::from_secs(2);
/// Samples that are kept until the snapshot's frame number is known: more than arrive meanwhile.
const SAMPLES_KEPT: usize = 64;
/// Most columns and rows of a valid frame.
const LARGEST_SIDE: u16 = 800;

/// A frame, pixel for pixel as the sensing read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Its number.
    pub number: u32,
    /// Its sample's time, µs.
    pub time_us: u64,
    /// Columns, px.
    pub width: u16,
    /// Rows, px.
    pub height: u16,
    /// The threshold it was read with, which implies its pixel format.
    pub threshold: Threshold,
    /// All rows from the top, as the camera sent them.
    pub bytes: Vec<u8>,
}

impl Frame {
    /// A frame without bytes yet; an error when its size is invalid or does not fit its length.
    fn announced(header: &Snapshot) -> Result<Frame, String> {
        let frame = Frame {
            number: header.frame,
            time_us: header.time_us,
            width: header.width,
            height: header.height,
            threshold: header.threshold,
            bytes: Vec::new(),
        };
        let sides = 1..=LARGEST_SIDE;
        if !sides.contains(&header.width) || !sides.contains(&header.height) {
            return Err(format!("{} × {} px is no frame", frame.width, frame.height));
        }
        match frame.length() == header.bytes as usize {
            true => Ok(frame),
            false => Err(format!(
                "{} × {} px of {} are {} bytes, and it announces {}",
                frame.width,
                frame.height,
                frame.format().name(),
                frame.length(),
                header.bytes
            )),
        }
    }

    /// Its length when it is whole, bytes.
    fn length(&self) -> usize {
        2 * self.format().row_length(self.width) * usize::from(self.height)
    }

    /// Its pixel format.
    pub fn format(&self) -> PixelFormat {
        self.threshold.format()
    }

    /// Its rows as the sensing takes them on this computer: RGB565 in native order, the other
    /// formats as in the device's memory.
    pub fn pixels(&self) -> Vec<u16> {
        pixels(self.format(), &self.bytes)
    }

    fn add(&mut self, part: &SnapshotPart) -> Result<(), String> {
        let (have, offset) = (self.bytes.len(), part.offset as usize);
        if offset != have {
            return Err(format!("bytes {have} to {offset} of it are missing"));
        }
        if have + part.bytes.len() > self.length() {
            return Err("more bytes came than it has".to_owned());
        }
        self.bytes.extend_from_slice(&part.bytes);
        Ok(())
    }
}

/// Converts a camera's bytes of this format to the rows that the sensing takes on this computer.
pub fn pixels(format: PixelFormat, bytes: &[u8]) -> Vec<u16> {
    let pairs = bytes.as_chunks().0.iter();
    match format {
        PixelFormat::Rgb565 => pairs.map(|pair| u16::from_be_bytes(*pair)).collect(),
        PixelFormat::Yuv422 | PixelFormat::Mono => {
            pairs.map(|pair| u16::from_le_bytes(*pair)).collect()
        }
    }
}

/// A frame with the device's sample of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Taken {
    /// The frame.
    pub frame: Frame,
    /// Its sample; `None` if the device does not stream.
    pub sample: Option<Sample>,
}

/// The failure when no part of a snapshot came within `patience`.
pub fn no_part(patience: Duration) -> Failure {
    let seconds = patience.as_secs_f32();
    let message = format!("no part of the snapshot came for {seconds} s; try again");
    Failure::new(Kind::Refused, message)
}

fn damaged(why: &str) -> Failure {
    Failure::new(
        Kind::Lost,
        format!("the snapshot came damaged: {why}; try again, with another cable when it repeats"),
    )
}

/// The parts of a snapshot received until now.
#[derive(Default)]
pub struct Collected {
    frame: Option<Frame>,
    samples: VecDeque<Sample>,
}

impl Collected {
    /// Adds the snapshot's header or a part.
    ///
    /// # Errors
    /// [`Kind::Lost`] when the snapshot came damaged.
    pub fn add(&mut self, message: &DeviceMessage) -> Result<(), Failure> {
        let added = match (message, &mut self.frame) {
            (DeviceMessage::Snapshot(header), None) => {
                Frame::announced(header).map(|frame| self.frame = Some(frame))
            }
            (DeviceMessage::SnapshotPart(part), Some(frame)) => frame.add(part),
            (DeviceMessage::SnapshotPart(_), None) => Err("its beginning is missing".to_owned()),
            _ => Err("a second one began amid it".to_owned()),
        };
        added.map_err(|why| damaged(&why))
    }

    /// Keeps a sample, which may be that of the frame.
    pub fn remember(&mut self, sample: Sample) {
        let frame = self.frame.as_ref();
        if frame.is_some_and(|frame| frame.number != sample.frame) {
            return;
        }
        if self.samples.len() == SAMPLES_KEPT {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
    }

    /// The frame, once the device has replied.
    ///
    /// # Errors
    /// [`Kind::Refused`] when the device cannot send a frame; [`Kind::Lost`] when it came damaged.
    pub fn whole(self, outcome: Outcome) -> Result<Taken, Failure> {
        if outcome == Outcome::NoGoodFrames {
            let message = "the device has no whole frame to send: its camera sent none for 2 s; \
                           see what `hivtac info` counts, and check the camera's cable";
            return Err(Failure::new(Kind::Refused, message));
        }
        judge("snapshot", outcome)?;
        let frame = self.frame.ok_or_else(|| damaged("nothing of it came"))?;
        if frame.bytes.len() != frame.length() {
            return Err(damaged("its end is missing"));
        }
        let own = |sample: &Sample| sample.frame == frame.number;
        let sample = self.samples.into_iter().find(own);
        Ok(Taken { frame, sample })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::force::ContactList;
    use hivtac_terms::marker::MarkerList;
    use hivtac_terms::status::Status;
    use hivtac_terms::threshold::Yuv422;

    const HEADER: Snapshot = Snapshot {
        frame: 9,
        time_us: 77,
        width: 4,
        height: 2,
        threshold: Threshold::Yuv422(Yuv422::RED),
        bytes: 16,
    };

    fn part(offset: u32, bytes: &[u8]) -> DeviceMessage {
        let bytes = bytes.try_into().unwrap();
        DeviceMessage::SnapshotPart(SnapshotPart { offset, bytes })
    }

    fn sample(frame: u32) -> Sample {
        Sample {
            sequence: frame,
            frame,
            time_us: 0,
            status: Status(0),
            force: None,
            contacts: ContactList::default(),
            markers: MarkerList::default(),
        }
    }

    /// The frame of these messages, or the error's text.
    fn collect(messages: &[DeviceMessage], outcome: Outcome) -> Result<Taken, String> {
        let mut collected = Collected::default();
        (0..80).for_each(|number| collected.remember(sample(number / 8)));
        for message in messages {
            collected.add(message).map_err(|it| it.to_string())?;
        }
        let taken = collected.whole(outcome);
        taken.map_err(|failure| failure.to_string())
    }

    #[test]
    fn parts_make_the_frame_and_its_sample_is_found() {
        let header = DeviceMessage::Snapshot(HEADER);
        let messages = [header, part(0, &[1; 10]), part(10, &[2; 6])];
        let taken = collect(&messages, Outcome::Done).unwrap();
        assert_eq!(taken.sample, Some(sample(9)));
        assert_eq!(taken.frame.bytes, [[1; 10].as_slice(), &[2; 6]].concat());
        assert_eq!(taken.frame.pixels()[4..6], [0x0101, 0x0202]);
    }

    #[test]
    fn whatever_is_missing_or_wrong_is_named() {
        let header = || DeviceMessage::Snapshot(HEADER);
        let of_size = |width, height, bytes| {
            DeviceMessage::Snapshot(Snapshot {
                width,
                height,
                bytes,
                ..HEADER
            })
        };
        let cases = [
            (vec![header(), part(4, &[0; 4])], "bytes 0 to 4"),
            (vec![header(), part(0, &[0; 17])], "more bytes"),
            (vec![header(), part(0, &[0; 15])], "end is missing"),
            (vec![part(0, &[0; 4])], "beginning is missing"),
            (vec![header(), header()], "second one"),
            (vec![], "nothing of it came"),
            (vec![of_size(0, 2, 0)], "0 × 2 px"),
            (vec![of_size(9, 801, 0)], "801 px"),
            (vec![of_size(4, 2, 15)], "announces 15"),
        ];
        for (messages, word) in cases {
            let error = collect(&messages, Outcome::Done).unwrap_err();
            assert!(error.contains(word), "{error}");
        }
        let error = collect(&[], Outcome::NoGoodFrames).unwrap_err();
        assert!(error.contains("camera"), "{error}");
        let error = collect(&[header()], Outcome::NotRead).unwrap_err();
        assert!(error.contains("snapshot"), "{error}");
    }

    #[test]
    fn pixels_are_in_the_order_of_their_format() {
        assert_eq!(pixels(PixelFormat::Rgb565, &[0xF8, 1]), [0xF801]);
        assert_eq!(pixels(PixelFormat::Yuv422, &[16, 128]), [0x8010]);
        assert_eq!(pixels(PixelFormat::Mono, &[16, 128]), [0x8010]);
    }
}
