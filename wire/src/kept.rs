//! Encodes the data that a device keeps in its flash: one record with all of it, so that it is
//! changed as a whole or not at all.

use crate::settings::{Name, RestPosition};
use hivtac_terms::camera::CameraSettings;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_terms::temporal::TemporalSettings;
use hivtac_terms::threshold::Threshold;
use serde::{Deserialize, Serialize};

/// First byte of a record. Must be raised with every change of the layout.
const VERSION: u8 = 8;

/// Longest record.
pub const MAX_BYTES: usize = 400;

/// All that a device keeps.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Record {
    /// Name that the user gave it.
    pub name: Name,
    /// The user's threshold; `None` for that of the model.
    pub threshold: Option<Threshold>,
    /// The rest position.
    pub tare: Option<RestPosition>,
    /// The uploaded model; `None` for the built-in one.
    pub model: Option<KeptModel>,
    /// How forces are followed from frame to frame.
    pub temporal: TemporalSettings,
    /// The camera's settings.
    pub camera: CameraSettings,
    /// The known direction of gravity.
    pub down: Down,
    /// The shape of what presses.
    pub contact_shape: ContactShape,
}

/// A model file in flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptModel {
    /// The slot for models that holds it, 0 or 1.
    pub slot: u8,
    /// Length of the file, bytes.
    pub bytes: u32,
    /// CRC-32 of the file without its own CRC.
    pub crc: u32,
}

/// The record is of another version, or not a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnotherVersion;

impl Record {
    /// Writes its bytes to the front of `buffer`, and returns them.
    pub fn to_bytes<'b>(&self, buffer: &'b mut [u8; MAX_BYTES]) -> &'b [u8] {
        // The longest record fits: tested below.
        postcard::to_slice(&(VERSION, self), buffer).map_or(&[], |bytes| bytes)
    }

    /// Reads a record from its bytes.
    ///
    /// # Errors
    /// [`AnotherVersion`], also if the bytes are not a record.
    pub fn of_bytes(bytes: &[u8]) -> Result<Record, AnotherVersion> {
        match postcard::take_from_bytes::<(u8, Record)>(bytes) {
            Ok(((VERSION, record), [])) => Ok(record),
            _ => Err(AnotherVersion),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::examples::{
        LONGEST_CONTACT_SHAPE, LONGEST_DOWN, any_value, longest_camera, longest_rest,
        longest_temporal,
    };
    use hivtac_terms::camera::{Rate, White};
    use hivtac_terms::down::Direction;
    use hivtac_terms::temporal::Output;
    use hivtac_terms::threshold::HsvBox;
    use hivtac_terms::units::{Micrometres, Microseconds};
    use proptest::prelude::*;
    use std::vec::Vec;

    fn longest() -> Record {
        Record {
            name: Name::try_from("x".repeat(24).as_str()).unwrap(),
            threshold: Some(Threshold::Rgb565(HsvBox::of_limits([255; 6]))),
            tare: Some(longest_rest()),
            model: Some(KeptModel {
                slot: 1,
                bytes: u32::MAX,
                crc: u32::MAX,
            }),
            temporal: longest_temporal(),
            camera: longest_camera(),
            down: LONGEST_DOWN,
            contact_shape: LONGEST_CONTACT_SHAPE,
        }
    }

    #[test]
    fn the_longest_record_fits_exactly() {
        let mut buffer = [0; MAX_BYTES];
        let bytes = longest().to_bytes(&mut buffer);
        assert_eq!(bytes.len(), MAX_BYTES);
        assert_eq!(Record::of_bytes(bytes), Ok(longest()));
    }

    /// Every firmware with this version's number must read the record of a device in use.
    #[test]
    fn the_bytes_of_version_8() {
        let record = Record {
            name: Name::try_from("thumb").unwrap(),
            threshold: Some(Threshold::Rgb565(HsvBox::of_limits([
                170, 10, 100, 255, 45, 255,
            ]))),
            tare: None,
            model: Some(KeptModel {
                slot: 1,
                bytes: 9_216,
                crc: 0xcafe_f00d,
            }),
            temporal: TemporalSettings {
                rezero: None,
                output: Output::Slip,
                ..TemporalSettings::default()
            },
            camera: CameraSettings {
                exposure: Some(Microseconds(2_500)),
                gain: None,
                rate: Rate::Half,
                white: Some(White { red: 76, blue: 132 }),
            },
            down: Down::Told(Direction([0, 600, -800])),
            contact_shape: ContactShape::Flat(Micrometres(2_000)),
        };
        let bytes = [
            8, 5, b't', b'h', b'u', b'm', b'b', 1, 0, 170, 10, 100, 255, 45, 255, 0, 1, 1, 0x80,
            0x48, 0x8d, 0xe0, 0xfb, 0xd7, 0x0c, 0xd0, 0x0f, 0xe8, 0x07, 60, 50, 100, 0, 0, 0, 0, 2,
            1, 0xc4, 0x13, 0, 1, 1, 76, 132, 2, 0, 0xb0, 0x09, 0xbf, 0x0c, 2, 0xd0, 0x0f,
        ];
        let mut buffer = [0; MAX_BYTES];
        assert_eq!(record.to_bytes(&mut buffer), bytes);
        assert_eq!(Record::of_bytes(&bytes), Ok(record));
    }

    #[test]
    fn records_of_another_version_are_not_read() {
        let mut buffer = [0; MAX_BYTES];
        let length = Record::default().to_bytes(&mut buffer).len();
        let bytes = &mut buffer[..length + 1];
        assert!(Record::of_bytes(&bytes[..length]).is_ok());
        assert_eq!(Record::of_bytes(bytes), Err(AnotherVersion), "a byte more");
        assert_eq!(Record::of_bytes(&bytes[..length - 1]), Err(AnotherVersion));
        bytes[0] = VERSION + 1;
        assert_eq!(Record::of_bytes(&bytes[..length]), Err(AnotherVersion));
        assert_eq!(Record::of_bytes(&[]), Err(AnotherVersion));
    }

    proptest! {
        #[test]
        fn a_record_comes_back(record in any_value::<Record>(Just(Vec::new()))) {
            let mut buffer = [0; MAX_BYTES];
            prop_assert_eq!(Record::of_bytes(record.to_bytes(&mut buffer)), Ok(record));
        }

        #[test]
        fn any_bytes_are_a_record_or_another_version(bytes: Vec<u8>) {
            let _ = Record::of_bytes(&bytes);
        }
    }
}
